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
from fecontact.maps.yaw_map import describe_missing_yaw, round_yaw
from fecontact.outputs.flat_records import Record
from fecontact.outputs.records.results import case_inputs
from fecontact.runs.stored_map import list_map_documents, read_map_document

# Inputs of a case that determine the contact. Other inputs determine how it is solved and judged.
_CONTACT_INPUTS = (
    *("rail", "wheel", "inclination_rad", "roll", "roll_rad", "yaw_rad", "roll_load_N", "flange_climb", "side"),
    *("opposite", "load_kind", "rail_material", "wheel_material", "rolling_radius_mm", "track"),
)


def read_map_rows(folder: Path, case: Case, *, but_for: Sequence[str] = ()) -> list[Mapping[str, str]]:
    """Read the rows of a stored map at the yaw of a case.

    They have the verdicts at the time of writing.

    Parameters
    ----------
    folder
        Folder of the map.
    case
        Case with the required contact.
    but_for
        Inputs that may differ. The yaw may not differ from all yaws of a map of several yaws.

    Returns
    -------
    list of mapping
        Rows of `map.csv`.

    Raises
    ------
    InputError
        For a map of another contact or of other yaws, and for files that were changed.
    """
    documents = list_map_documents(read_map_document(folder))
    document = documents[0] if len(documents) == 1 else _select_yaw(folder, documents, case.yaw_rad)
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
    # its import of pandas takes 0.3 s
    from fecontact.regression.tables import load_table

    rows = list(load_table(folder / "map.csv").rows.to_dict("records"))
    if len(documents) == 1:
        return rows
    yaw_mrad = round_yaw(1e3 * document["case"]["yaw_rad"])
    return [row for row in rows if round_yaw(float(row["yaw_mrad"])) == yaw_mrad]


def _select_yaw(folder: Path, documents: Sequence[Mapping[str, Any]], yaw_rad: float) -> Mapping[str, Any]:
    """Record of the map at a yaw; `InputError` if the yaw is not stored."""
    for document in documents:
        if round_yaw(1e3 * document["case"]["yaw_rad"]) == round_yaw(1e3 * yaw_rad):
            return document
    stored_mrad = [1e3 * document["case"]["yaw_rad"] for document in documents]
    raise InputError(f"{folder}: {describe_missing_yaw(1e3 * yaw_rad, stored_mrad)}")


def read_map_yaws_rad(folder: Path) -> tuple[float, ...]:
    """Read the yaws of the wheelset of a stored map.

    Parameters
    ----------
    folder
        Folder of the map.

    Returns
    -------
    tuple of float
        Yaws in rad; a single yaw for a map without a list of yaws.
    """
    return tuple(float(document["case"]["yaw_rad"]) for document in list_map_documents(read_map_document(folder)))


def _select_contact_inputs(record: Mapping[str, Any]) -> Record:
    """Inputs that determine the contact, without the inputs of yielding."""
    contact_inputs = {name: record.get(name) for name in _CONTACT_INPUTS}
    for name in ("rail_material", "wheel_material"):
        contact_inputs[name] = {
            key: value for key, value in (record.get(name) or {}).items() if key in ("young_MPa", "poisson")
        }
    return contact_inputs


def read_map_bands(folder: Path, yaw_rad: float = 0.0) -> list[tuple[float, float, Sequence[Band]]]:
    """Read the verdicts of a stored map over the load.

    Parameters
    ----------
    folder
        Folder of the map.
    yaw_rad
        Yaw in rad, for a map of several yaws.

    Returns
    -------
    list of tuple
        For each lateral shift: the shift in mm, its range on both sides in mm, and its verdicts over the load.

    Raises
    ------
    InputError
        If a map of several yaws does not have this yaw, and for files that were changed.
    """
    documents = list_map_documents(read_map_document(folder))
    document = documents[0] if len(documents) == 1 else _select_yaw(folder, documents, yaw_rad)
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
