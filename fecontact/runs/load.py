"""Results read back from their folders: cases, studies and what features have, as the objects that solving gave."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PureWindowsPath
from typing import Any

from fecontact.errors import InputError, has_numbers
from fecontact.features import at, places
from fecontact.files import broken_seal, read_json
from fecontact.jobs.store import whole_manifest
from fecontact.outputs.documents import STUDY_SCHEMA
from fecontact.outputs.records.results import Row
from fecontact.runs.identity import SOLVING_SOURCE, origin_of
from fecontact.runs.store import (
    RESULT,
    SOLVED,
    case_folder,
    read_case,
    refused_if_changed,
    solved_in,
    stored_case,
)

_KINDS = places("RESULTS")
_FILES = (RESULT, "study.json", *(f"{kind}.json" for kind in _KINDS))
_REMEDY = (
    f"give the folder of {', '.join(('a case', *(f'a {kind}' for kind in places('RESULTS'))))} or a study of fecontact"
)


def load(folder: str | Path) -> Any:
    """Read finished results.

    Parameters
    ----------
    folder
        Of a case (what `solve --out` writes, or one of a study's `cases/`), of a study, or of a map, if there are maps.

    Returns
    -------
    CaseResult, tuple of CaseResult, or what a feature has, such as ApplicabilityMap
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
        _, rows, _ = stored_study(folder)
        folders = [case_folder(folder, row["id"]) for row in rows if has_numbers(row)]
        for one in folders:
            refuse_unusable(one)
        return tuple(read_case(one) for one in folders)
    for kind, place in _KINDS.items():
        if (folder / f"{kind}.json").is_file():
            return at(place)(folder)
    raise InputError(f"{folder}: it has no {' or '.join(_FILES)}; {_REMEDY}")


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


def stored_study(folder: Path) -> tuple[str, list[Row], int]:
    """Name and rows of a study as `study.json` has them, and how many cases it has or will have.

    Raises
    ------
    InputError
        If it has another layout.
    """
    if not (folder / "study.json").exists():
        raise InputError(f"{folder}: there are no results in it; {_REMEDY}")
    document = sealed(folder / "study.json", STUDY_SCHEMA, "run the study again")
    name, rows = document.get("study"), document.get("rows")
    if not isinstance(name, str) or not isinstance(rows, list) or not all(map(_is_row, rows)):
        raise InputError(f"{folder / 'study.json'}: it is no list of rows; run the study again")
    cases = document.get("cases")
    return name, rows, max(cases if isinstance(cases, int) else 0, len(rows))


def _is_row(row: Any) -> bool:
    """Whether a row names a case, in a folder of its own, and what came of it."""
    texts = isinstance(row, Mapping) and isinstance(row.get("id"), str) and isinstance(row.get("status"), str)
    return texts and is_name(row["id"])


def is_name(text: Any) -> bool:
    """Whether a text is the name of a file or folder, without a path."""
    return isinstance(text, str) and PureWindowsPath(text).name == text not in ("", "..")


def sealed(path: Path, schema: str, remedy: str) -> Mapping[str, Any]:
    """A document of a layout as it was written."""
    document = read_json(path)
    if not isinstance(document, Mapping) or document.get("schema") != schema:
        raise InputError(f"{path}: its layout is not {schema}; {remedy}")
    if problem := broken_seal(path, document):
        raise InputError(f"{problem}; {remedy}")
    return document
