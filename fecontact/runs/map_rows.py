"""Rows of a stored map that must be of a given contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.material import OF_YIELDING
from fecontact.outputs.records.results import case_inputs
from fecontact.regression.tables import load_table
from fecontact.runs.load import map_document

Record = dict[str, Any]

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
        found[name] = {key: value for key, value in (record.get(name) or {}).items() if key not in OF_YIELDING}
    return found
