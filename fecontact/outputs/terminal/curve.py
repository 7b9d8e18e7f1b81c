"""A vehicle in curves on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fecontact.outputs.tables.table import Table, TableRow, columns_of, missing
from fecontact.outputs.terminal.console import print_notes, print_table, say, standard_console
from fecontact.outputs.words.curve import ZONES, difference_words, share_words, straight_words
from fecontact.vehicle.curve import CurveRun, WheelsetRun
from fecontact.vehicle.model import Vehicle
from fecontact.vehicle.visits import Curves

if TYPE_CHECKING:
    from rich.console import Console


def print_curves(found: Curves, console: Console | None = None) -> None:
    """Print what theories change, a table a theory, straight track, and where the wheels are on the map."""
    console = console or standard_console()
    for one in found.differences:
        say(console, difference_words(one))
    for theory, runs in found.runs.items():
        _print_theory(found.vehicle, theory, runs, console)
    for straight in found.straight:
        say(console, straight_words(straight))
    if found.cells:
        _print_map(found, console)


def _print_map(found: Curves, console: Console) -> None:
    for theory in found.runs:
        say(console, f"{theory}: of the way of all wheels {share_words(found.visited(theory), ZONES)}")
        say(console, f"{theory}: the cheapest theory that holds there: {share_words(found.sufficient(theory))}")
    yaw = max((abs(visit.yaw_mrad) for visit in found.visits), default=0.0)
    print_notes((f"{note}; here up to {yaw:.1f} mrad" for note in found.notes), console)


def _print_theory(vehicle: Vehicle, theory: str, runs: Sequence[CurveRun], console: Console) -> None:
    headings = (
        *("radius\nm", "speed\nkm/h", "wheelset", "shift\nmm", "yaw\nmrad", "Y/Q\nleft", "Y/Q\nright"),
        *("patches left\nkN", "patches right\nkN", "resistance\nN/kN"),
    )
    lines = []
    for run in runs:
        for number, wheelset in enumerate(run.wheelsets, start=1):
            first = number == 1
            resists = first and run.is_balanced
            cells = [f"{run.radius_m:g}" if first else "", f"{run.speed_km_h:.0f}" if first else "", str(number)]
            cells += [*_cells(run, wheelset), _number(run.resistance_N_per_kN, ".2f") if resists else ""]
            lines.append(TableRow(cells=cells))
    which = "" if vehicle.bogie is None else ", leading bogie" if vehicle.bogie.leads else ", trailing bogie"
    title = f"{vehicle.name}{which}, normal forces by {theory}; shift > 0 and yaw > 0 to the left"
    print_table(console, Table(title=title, columns=columns_of(*headings), rows=lines))
    print_notes((f"R {run.radius_m:g} m: {run.status}: {'; '.join(run.notes)}" for run in runs if run.notes), console)


def _cells(run: CurveRun, wheelset: WheelsetRun) -> list[str]:
    if not run.is_balanced:
        return ["none", *[""] * 5]
    left, right = wheelset.wheels
    return [
        f"{wheelset.lateral_shift_mm:+z.2f}",
        f"{wheelset.yaw_mrad:+z.2f}",
        *(_number(wheel.y_over_q, "+z.2f") for wheel in (left, right)),
        *(" + ".join(f"{1e-3 * patch.normal_force_N:.1f}" for patch in wheel.patches) for wheel in (left, right)),
    ]


def _number(value: float, form: str) -> str:
    return "-" if missing(value) else f"{value:{form}}"
