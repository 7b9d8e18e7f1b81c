"""Verdicts of a stored map looked up by another command: its rows, and its verdicts over the load at each shift."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.maps.model import LoadInterval, LoadLimit
from fecontact.maps.verdict_views import bands_of
from fecontact.maps.view import Band, column_width
from fecontact.outputs.flat_records import Record
from fecontact.outputs.records.results import case_inputs
from fecontact.regression.tables import load_table
from fecontact.runs.stored_map import map_document

# Inputs of a case that say which contact it is; the others say how it is solved and judged.
_CONTACT = (
    *("rail", "wheel", "inclination_rad", "roll", "roll_rad", "yaw_rad", "roll_load_N", "flange_climb", "side"),
    *("opposite", "load_kind", "rail_material", "wheel_material", "rolling_radius_mm", "track"),
)


def map_rows(folder: Path, case: Case, *, but_for: Sequence[str] = ()) -> list[Mapping[str, str]]:
    """Rows of a stored map, as it was judged when it was written.

    Parameters
    ----------
    case
        The contact that it must be of.
    but_for
        Inputs that may be others.

    Raises
    ------
    InputError
        For a map of another contact, and for files that were changed.
    """
    document = map_document(folder)
    theirs, own = (_contact(one) for one in (document["case"], case_inputs(case)))
    different = [name for name in _CONTACT if name not in but_for and theirs.get(name) != own.get(name)]
    if different:
        told = "; ".join(f"{name} {theirs.get(name)!r} there, {own.get(name)!r} here" for name in different)
        raise InputError(f"{folder}: it is the map of another contact ({told}); give the same inputs, or another map")
    return list(load_table(folder / "map.csv").rows.to_dict("records"))


def _contact(record: Mapping[str, Any]) -> Record:
    """The inputs that say which contact it is, without what is said of yielding."""
    found = {name: record.get(name) for name in _CONTACT}
    for name in ("rail_material", "wheel_material"):
        found[name] = {key: value for key, value in (record.get(name) or {}).items() if key in ("young_MPa", "poisson")}
    return found


def map_bands(folder: Path) -> list[tuple[float, float, Sequence[Band]]]:
    """Each shift of a stored map (mm), how far on both sides it counts (mm), and its verdicts over the load."""
    document = map_document(folder)
    reach = 0.5 * column_width(document["lateral_shifts_mm"])
    return [(one["lateral_shift_mm"], reach, _bands(one, document["cells"])) for one in document["limits"]]


def _bands(limit: Mapping[str, Any], cells: Sequence[Mapping[str, Any]]) -> Sequence[Band]:
    own = [cell for cell in cells if cell["lateral_shift_mm"] == limit["lateral_shift_mm"] and "verdict" in cell]
    answers = [(cell["load_N"], cell["verdict"]["answer"]) for cell in own]
    answers += [(one["load_N"], one["verdict"]) for one in limit["tried"]]
    open_kN = {1e-3 * load_N for load_N, answer in answers if answer == "UNRESOLVED"}
    return bands_of(LoadLimit(intervals=tuple(LoadInterval(**one) for one in limit["intervals"])), open_kN)
