"""A vehicle in curves on the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from fecontact.outputs.tables.table import Table, TableRow, columns_of, missing
from fecontact.outputs.terminal.console import print_notes, print_table, say, standard_console
from fecontact.outputs.words.curve import ZONES
from fecontact.vehicle.curve import CurveRun, WheelsetRun
from fecontact.vehicle.model import Vehicle
from fecontact.vehicle.visits import Curves

if TYPE_CHECKING:
    from rich.console import Console


def print_curves(found: Curves, console: Console | None = None) -> None:
    """Print a table a theory, what theories change, and where the wheels are on the map."""
    console = console or standard_console()
    for theory, runs in found.runs.items():
        _print_theory(found.vehicle, theory, runs, console)
    _print_differences(found.runs, console)
    for theory in found.runs if found.visits else ():
        parts = found.visited(theory)
        told = ", ".join(f"{zone} {1e2 * parts[zone]:.0f} %" for zone in ZONES if parts.get(zone))
        say(console, f"{theory}: of the way of all wheels {told}")


def _print_theory(vehicle: Vehicle, theory: str, runs: Sequence[CurveRun], console: Console) -> None:
    headings = (
        *("radius\nm", "speed\nkm/h", "wheelset", "shift\nmm", "yaw\nmrad", "Y/Q\nleft", "Y/Q\nright"),
        *("patches left\nkN", "patches right\nkN", "resistance\nN/kN"),
    )
    lines = []
    for run in runs:
        for number, wheelset in enumerate(run.wheelsets, start=1):
            first = number == 1
            resists = first and run.status != "no equilibrium"
            cells = [f"{run.radius_m:g}" if first else "", f"{run.speed_km_h:.0f}" if first else "", str(number)]
            cells += [*_cells(run, wheelset), _number(run.resistance_N_per_kN, ".2f") if resists else ""]
            lines.append(TableRow(cells=cells))
    title = f"{vehicle.name}, normal forces by {theory}; shift > 0 and yaw > 0 to the left"
    print_table(console, Table(title=title, columns=columns_of(*headings), rows=lines))
    print_notes((f"R {run.radius_m:g} m: {run.status}: {'; '.join(run.notes)}" for run in runs if run.notes), console)


def _cells(run: CurveRun, wheelset: WheelsetRun) -> list[str]:
    if run.status == "no equilibrium":
        return ["none", *[""] * 5]
    left, right = wheelset.wheels
    return [
        f"{wheelset.lateral_shift_mm:+z.2f}",
        f"{wheelset.yaw_mrad:+z.2f}",
        *(_number(wheel.y_over_q, "+z.2f") for wheel in (left, right)),
        *(" + ".join(f"{1e-3 * patch.normal_force_N:.1f}" for patch in wheel.patches) for wheel in (left, right)),
    ]


def _print_differences(runs: Mapping[str, tuple[CurveRun, ...]], console: Console) -> None:
    """What each theory changes against the last one, wheelset by wheelset, where both have an equilibrium."""
    *others, reference = runs
    for theory in others:
        pairs = [(one, other) for one, other in zip(runs[theory], runs[reference], strict=True) if _both(one, other)]
        missing = [f"{one.radius_m:g}" for one in runs[theory] if one.status == "no equilibrium"]
        if missing:
            say(console, f"{theory} has no equilibrium at R {', '.join(missing)} m")
        if not pairs:
            continue
        shift, at = max(
            (abs(a.lateral_shift_mm - b.lateral_shift_mm), one.radius_m)
            for one, other in pairs
            for a, b in zip(one.wheelsets, other.wheelsets, strict=True)
        )
        guiding, where = max(
            (abs(a.wheels[k].y_over_q - b.wheels[k].y_over_q), one.radius_m)
            for one, other in pairs
            for a, b in zip(one.wheelsets, other.wheelsets, strict=True)
            for k in (0, 1)
        )
        say(
            console,
            f"{theory} against {reference}: shift differs by up to {shift:.2f} mm (R {at:g} m), Y/Q by up to"
            f" {guiding:.3f} (R {where:g} m)",
        )


def _both(one: CurveRun, other: CurveRun) -> bool:
    return "no equilibrium" not in (one.status, other.status)


def _number(value: float, form: str) -> str:
    return "-" if missing(value) else f"{value:{form}}"
