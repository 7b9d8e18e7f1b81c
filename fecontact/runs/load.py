"""Results read back from their folders: cases, studies and maps, as the objects that the solution gave."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path, PureWindowsPath
from typing import Any

from fecontact.bodies import OF_YIELDING
from fecontact.case import Case
from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError, has_numbers
from fecontact.files import broken_seal, read_json
from fecontact.jobs.store import whole_manifest
from fecontact.outputs.documents import STUDY_SCHEMA
from fecontact.outputs.records.results import Row, case_inputs
from fecontact.outputs.records.rows import MAP_SCHEMA
from fecontact.runs.identity import SOLVING_SOURCE, origin_of
from fecontact.runs.store import (
    RESULT,
    SOLVED,
    case_folder,
    position_folder,
    read_case,
    read_position,
    refused_if_changed,
    solved_in,
    stored_case,
)
from fecontact.solving.map import ApplicabilityMap, MapPosition, failed_position
from fecontact.solving.solve import CaseResult

Judges = Callable[[int], AbstractContextManager[Callable[..., Iterable[Any]]]]

_REMEDY = "give the folder of a case, a study or a map that fecontact wrote"


def load(folder: str | Path) -> CaseResult | tuple[CaseResult, ...] | ApplicabilityMap:
    """Read finished results.

    Parameters
    ----------
    folder
        Of a case (what `solve --out` writes, or one of a study's `cases/`), of a study, or of a map.

    Returns
    -------
    CaseResult, tuple of CaseResult, or ApplicabilityMap
        What the solution gave, but for the meshes; of a study the cases that have a result, in its order.

    Raises
    ------
    InputError
        If there is nothing to read, a result is damaged, or another version of the program solved it.
    """
    folder = Path(folder)
    if (folder / RESULT).is_file():
        refuse_unusable(folder)
        return read_case(folder)
    if (folder / "study.json").is_file():
        _, rows = stored_study(folder)
        folders = [case_folder(folder, row["id"]) for row in rows if has_numbers(row)]
        for one in folders:
            refuse_unusable(one)
        return tuple(read_case(one) for one in folders)
    if (folder / "map.json").is_file():
        made, problems = read_map(folder)
        if problems:
            raise InputError(next(iter(problems.values())))
        return made
    raise InputError(f"{folder}: it has no {RESULT}, study.json or map.json; {_REMEDY}")


def refuse_unusable(folder: Path) -> None:
    """Raise `InputError` where a finished case or position cannot be judged any more, with why and what to do."""
    if problem := unusable(folder):
        raise InputError(problem)


def unusable(folder: Path) -> str | None:
    """Why a finished case or position cannot be judged any more, and what to do."""
    file = folder / SOLVED
    if not file.is_file():
        return f"{folder}: there is no finished result of this version ({SOLVED}); solve it"
    manifest = whole_manifest(folder)
    if isinstance(manifest, str):
        return f"{folder}: {manifest}; solve it again"
    try:
        with refused_if_changed(file, "solve it again"):
            case = stored_case(folder, solved_in(folder)["case"])
    except InputError as error:
        return str(error)
    # the packages, and the solver, of the machine that solved it need not be there for judging it
    made, here = (of.get(SOLVING_SOURCE, "none") for of in (manifest["solved_by"], origin_of(case).solved_by))
    if made == here:
        return None
    return f"{folder}: made by another version: {SOLVING_SOURCE} {made} -> {here}; solve it again"


def stored_study(folder: Path) -> tuple[str, list[Row]]:
    """Name and rows of a study as `study.json` has them.

    Raises
    ------
    InputError
        If it has another layout.
    """
    if not (folder / "study.json").exists():
        raise InputError(f"{folder}: there are no results in it; {_REMEDY}")
    document = _sealed(folder / "study.json", STUDY_SCHEMA, "run the study again")
    name, rows = document.get("study"), document.get("rows")
    if not isinstance(name, str) or not isinstance(rows, list) or not all(map(_is_row, rows)):
        raise InputError(f"{folder / 'study.json'}: it is no list of rows; run the study again")
    return name, rows


def _is_row(row: Any) -> bool:
    """Whether a row names a case, in a folder of its own, and what came of it."""
    texts = isinstance(row, Mapping) and isinstance(row.get("id"), str) and isinstance(row.get("status"), str)
    return texts and _is_name(row["id"])


def _is_name(text: Any) -> bool:
    return isinstance(text, str) and PureWindowsPath(text).name == text not in ("", "..")


def _sealed(path: Path, schema: str, remedy: str) -> Mapping[str, Any]:
    """A document of a layout as it was written."""
    document = read_json(path)
    if not isinstance(document, Mapping) or document.get("schema") != schema:
        raise InputError(f"{path}: its layout is not {schema}; {remedy}")
    if problem := broken_seal(path, document):
        raise InputError(f"{problem}; {remedy}")
    return document


def map_document(folder: Path) -> Mapping[str, Any]:
    """What `map.json` says, as it was written together with `map.csv`.

    Raises
    ------
    InputError
        If it has another layout, or either file was changed.
    """
    return _sealed(folder / "map.json", MAP_SCHEMA, "make the map again")


def read_map(
    folder: Path,
    criteria: Criteria | None = None,
    creep: Creep | None = None,
    *,
    creep_laws: bool = False,
    judges: Judges = lambda count: nullcontext(map),
) -> tuple[ApplicabilityMap, dict[float, str]]:
    """A finished map, and which positions cannot be used.

    Criteria, friction and creepages are those of the map, or others if they are given. `judges` opens what reads so
    many positions as `map` does.

    Raises
    ------
    InputError
        If `map.json` has another layout, or no position of the map can be read.
    """
    document = map_document(folder)
    read = partial(_position, criteria=criteria, creep=creep, creep_laws=creep_laws)
    with refused_if_changed(folder / "map.json", "make the map again"):
        names = {shift: name for name, shift in document["provenance"].get("positions", {}).items() if _is_name(name)}
        folders = {shift: position_folder(folder, name) for shift, name in names.items()}
        problems = {shift: problem for shift, own in folders.items() if (problem := unusable(own))}
        usable = {shift: own for shift, own in folders.items() if shift not in problems}
        with judges(len(usable)) as map_over:
            found: dict[float, MapPosition | str] = dict(zip(usable, map_over(read, usable.values()), strict=True))
        problems |= {shift: one for shift, one in found.items() if isinstance(one, str)}
        known = {shift: one for shift, one in found.items() if not isinstance(one, str)}
        positions = [
            known[shift] if shift in known else failed_position(shift, document["loads_N"], problems[shift])
            for shift in folders
        ]
        if not known:
            why = next(iter(problems.values()), "none is there")
            raise InputError(f"{folder}: no position of the map can be judged ({why})")
        first = usable[min(known)]
        base = stored_case(first, solved_in(first)["case"])
        case = replace(base, lateral_shift_mm=0.0, criteria=criteria or base.criteria, creep=creep or base.creep)
        return ApplicabilityMap(case=case, loads_N=tuple(document["loads_N"]), positions=tuple(positions)), problems


def _position(folder: Path, **by: Any) -> MapPosition | str:
    """A finished position, or why it cannot be read."""
    try:
        return read_position(folder, **by)
    except InputError as error:
        return str(error)


# --- Rows of a stored map that must be of a given contact.

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
    from fecontact.regression.tables import load_table

    return list(load_table(folder / "map.csv").rows.to_dict("records"))


def _contact(record: Mapping[str, Any]) -> Record:
    """The inputs that say which contact it is, without what is said of yielding."""
    found = {name: record.get(name) for name in _CONTACT}
    for name in ("rail_material", "wheel_material"):
        found[name] = {key: value for key, value in (record.get(name) or {}).items() if key not in OF_YIELDING}
    return found
