"""Verdicts of a stored map for other commands: its rows, and its verdicts over the load at each shift."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.maps.model import LoadInterval, LoadLimit
from fecontact.maps.verdict_views import list_bands
from fecontact.maps.view import Band, column_width
from fecontact.outputs.flat_records import Record
from fecontact.outputs.records.results import case_inputs
from fecontact.regression.tables import load_table
from fecontact.runs.stored_map import read_map_document

# Inputs of a case that determine the contact. Other inputs determine how it is solved and judged.
_CONTACT_INPUTS = (
    *("rail", "wheel", "inclination_rad", "roll", "roll_rad", "yaw_rad", "roll_load_N", "flange_climb", "side"),
    *("opposite", "load_kind", "rail_material", "wheel_material", "rolling_radius_mm", "track"),
)


def read_map_rows(folder: Path, case: Case, *, but_for: Sequence[str] = ()) -> list[Mapping[str, str]]:
    """Read the rows of a stored map, with the verdicts at the time of writing.

    Parameters
    ----------
    folder
        Folder of the map.
    case
        Case with the required contact.
    but_for
        Inputs that may differ.

    Returns
    -------
    list of mapping
        Rows of `map.csv`.

    Raises
    ------
    InputError
        For a map of another contact, and for files that were changed.
    """
    document = read_map_document(folder)
    map_inputs, given_inputs = (_select_contact_inputs(record) for record in (document["case"], case_inputs(case)))
    different = [
        name for name in _CONTACT_INPUTS if name not in but_for and map_inputs.get(name) != given_inputs.get(name)
    ]
    if different:
        differences = "; ".join(
            f"{name} {map_inputs.get(name)!r} in the map, {given_inputs.get(name)!r} given" for name in different
        )
        raise InputError(
            f"{folder}: this is the map of a different contact ({differences}); give the same inputs, or another map"
        )
    return list(load_table(folder / "map.csv").rows.to_dict("records"))


def read_map_yaw_rad(folder: Path) -> float:
    """Read the yaw of the wheelset of a stored map.

    Parameters
    ----------
    folder
        Folder of the map.

    Returns
    -------
    float
        Yaw in rad.
    """
    return float(read_map_document(folder)["case"]["yaw_rad"])


def _select_contact_inputs(record: Mapping[str, Any]) -> Record:
    """Inputs that determine the contact, without the inputs of yielding."""
    contact_inputs = {name: record.get(name) for name in _CONTACT_INPUTS}
    for name in ("rail_material", "wheel_material"):
        contact_inputs[name] = {
            key: value for key, value in (record.get(name) or {}).items() if key in ("young_MPa", "poisson")
        }
    return contact_inputs


def read_map_bands(folder: Path) -> list[tuple[float, float, Sequence[Band]]]:
    """Read the verdicts of a stored map over the load.

    Parameters
    ----------
    folder
        Folder of the map.

    Returns
    -------
    list of tuple
        For each lateral shift: the shift in mm, its range on both sides in mm, and its verdicts over the load.
    """
    document = read_map_document(folder)
    reach = 0.5 * column_width(document["lateral_shifts_mm"])
    return [(limit["lateral_shift_mm"], reach, _bands(limit, document["cells"])) for limit in document["limits"]]


def _bands(limit: Mapping[str, Any], cells: Sequence[Mapping[str, Any]]) -> Sequence[Band]:
    """Verdicts over the load at a lateral shift, with the unresolved loads in kN.

    `limit` is the record of the load limit at the shift, and `cells` the records of all cells of the map.
    """
    cells_at_shift = [
        cell for cell in cells if cell["lateral_shift_mm"] == limit["lateral_shift_mm"] and "verdict" in cell
    ]
    answers = [(cell["load_N"], cell["verdict"]["answer"]) for cell in cells_at_shift]
    answers += [(load_record["load_N"], load_record["verdict"]) for load_record in limit["tried"]]
    open_kN = {1e-3 * load_N for load_N, answer in answers if answer == "UNRESOLVED"}
    return list_bands(
        LoadLimit(intervals=tuple(LoadInterval(**load_record) for load_record in limit["intervals"])), open_kN
    )
