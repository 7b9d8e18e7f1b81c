"""A vehicle in curves on the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fecontact.features.curves.curve import CurveRun
from fecontact.features.curves.records import OF_MAPS, OF_STABILITY, SHARES
from fecontact.features.curves.sentences import ZONES, difference_words, path_words, share_words, straight_words
from fecontact.features.curves.visits import Curves
from fecontact.outputs.tables import Table, number, number_text, table_of, text
from fecontact.outputs.terminal import Lines, notes

_WHEELSET = (
    number("radius\nm", "radius_m", none=""),
    number("speed\nkm/h", "speed_km_h", "{:.0f}", none=""),
    number("wheelset", "wheelset", "{:.0f}"),
    number("shift\nmm", "lateral_shift_mm", "{:+z.2f}", none="none"),
    number("yaw\nmrad", "yaw_mrad", "{:+z.2f}", none=""),
    *(text(f"Y/Q\n{side}", f"y_over_q {side}", "number") for side in ("left", "right")),
    *(text(f"patches {side}\nkN", f"patches {side}", "number") for side in ("left", "right")),
    text("resistance\nN/kN", "resistance", "number"),
)


def curves_lines(found: Curves) -> Lines:
    """What theories change, a table a theory, straight track, and where the wheels are on the map."""
    yield from map(difference_words, found.differences)
    bogie = found.vehicle.bogie
    which = "" if bogie is None else ", leading bogie" if bogie.leads else ", trailing bogie"
    for theory, runs in found.runs.items():
        title = f"{found.vehicle.name}{which}, normal forces by {theory}; shift > 0 and yaw > 0 to the left"
        yield _wheelset_table(title, runs)
        yield from notes(f"R {run.radius_m:g} m: {run.status}: {'; '.join(run.notes)}" for run in runs if run.notes)
    yield from notes(path_words(found))
    yield from map(straight_words, found.straight)
    yield from notes([OF_STABILITY])
    if found.columns:
        for theory in found.runs:
            way, enough = (found.shares(theory, of) for of in SHARES.values())
            yield f"{theory}: of the way of all wheels {share_words(way, ZONES)}"
            yield f"{theory}: the cheapest theory that holds there: {share_words(enough)}"
        yaw = max((abs(visit.yaw_mrad) for visit in found.visits), default=0.0)
        yield from notes([f"{OF_MAPS}; here up to {yaw:.1f} mrad"])


def _wheelset_table(title: str, runs: Sequence[CurveRun]) -> Table:
    """One line per wheelset; values common to a run stand in its first line."""
    items: list[dict[str, Any]] = []
    for run in runs:
        own: dict[str, Any] = {"radius_m": run.radius_m, "speed_km_h": run.speed_km_h}
        if run.is_balanced:
            own["resistance"] = number_text(run.resistance_N_per_kN, "{:.2f}")
        for place, wheelset in enumerate(run.wheelsets, start=1):
            own["wheelset"] = place
            if run.is_balanced:
                own |= {"lateral_shift_mm": wheelset.lateral_shift_mm, "yaw_mrad": wheelset.yaw_mrad}
            for wheel in wheelset.wheels if run.is_balanced else ():
                own[f"y_over_q {wheel.side}"] = number_text(wheel.y_over_q, "{:+z.2f}")
                own[f"patches {wheel.side}"] = " + ".join(f"{1e-3 * one.normal_force_N:.1f}" for one in wheel.patches)
            items.append(own)
            own = {}
        if not run.wheelsets:
            items.append(own)
    return table_of(title, _WHEELSET, items)
