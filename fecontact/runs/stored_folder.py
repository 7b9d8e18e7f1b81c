"""Folders of finished results: their usability in this version, and the rows of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.files import explain_broken_seal, is_file_name, read_json
from fecontact.jobs.store import read_intact_manifest
from fecontact.outputs.records.results import Row
from fecontact.outputs.study_files import STUDY_SCHEMA
from fecontact.runs.identity import SOLVING_SOURCE, determine_origin
from fecontact.runs.store import SOLUTION_FILE, read_solution, read_stored_case, refuse_changed_files

REMEDY = "give the folder of a case, a map or a study of fecontact"


def refuse_unusable(folder: Path) -> None:
    """Raise `InputError` if a finished case or position cannot be judged any more.

    The message has the reason and the remedy.

    Parameters
    ----------
    folder
        Folder of the case or position.

    Raises
    ------
    InputError
        If the result is missing, damaged, or of another version.
    """
    if problem := describe_unusable_result(folder):
        raise InputError(problem)


def describe_unusable_result(folder: Path) -> str | None:
    """Explain why a finished case or position cannot be judged any more.

    Parameters
    ----------
    folder
        Folder of the case or position.

    Returns
    -------
    str or None
        The reason and the remedy; None if it can be judged.
    """
    file = folder / SOLUTION_FILE
    if not file.is_file():
        return f"{folder}: no finished result of this version ({SOLUTION_FILE}); solve it"
    manifest = read_intact_manifest(folder)
    if isinstance(manifest, str):
        return f"{folder}: {manifest}; solve it again"
    try:
        with refuse_changed_files(file, "solve it again"):
            case = read_stored_case(folder, read_solution(folder)["case"])
    except InputError as error:
        return str(error)
    # a verdict needs neither the packages nor the solver of the machine that solved the case
    stored_source, present_source = (
        digests.get(SOLVING_SOURCE, "none") for digests in (manifest["solved_by"], determine_origin(case).solved_by)
    )
    if stored_source == present_source:
        return None
    return (
        f"{folder}: made by a different version: {SOLVING_SOURCE} {stored_source} -> {present_source}; solve it again"
    )


def read_stored_study(folder: Path) -> tuple[str, list[Row], int]:
    """Read the name and the rows of a study from `study.json`.

    Parameters
    ----------
    folder
        Folder of the study.

    Returns
    -------
    tuple of str, list of rows, and int
        Name, rows, and number of cases, which include cases that are still to be solved.

    Raises
    ------
    InputError
        If the file is missing, or has another layout.
    """
    if not (folder / "study.json").exists():
        raise InputError(f"{folder} has no results; {REMEDY}")
    document = read_sealed_document(folder / "study.json", [STUDY_SCHEMA], "run the study again")
    name, rows = document.get("study"), document.get("rows")
    if not isinstance(name, str) or not isinstance(rows, list) or not all(map(_is_row, rows)):
        raise InputError(f"{folder / 'study.json'}: this is not a list of rows; run the study again")
    cases = document.get("cases")
    return name, rows, max(cases if isinstance(cases, int) else 0, len(rows))


def _is_row(row: Any) -> bool:
    """Whether a row has a status and an id that can name a folder."""
    has_texts = isinstance(row, Mapping) and isinstance(row.get("id"), str) and isinstance(row.get("status"), str)
    return has_texts and is_file_name(row["id"])


def read_sealed_document(path: Path, schemas: Sequence[str], remedy: str) -> Mapping[str, Any]:
    """Read a document, and check its layout and its seal.

    Parameters
    ----------
    path
        File.
    schemas
        Allowed layouts; the message has the first.
    remedy
        Remedy for the message of an error.

    Returns
    -------
    mapping
        The document.

    Raises
    ------
    InputError
        If the document has another layout, or was changed.
    """
    document = read_json(path)
    if not isinstance(document, Mapping) or document.get("schema") not in schemas:
        raise InputError(f"{path}: the layout is not {schemas[0]}; {remedy}")
    if problem := explain_broken_seal(path, document):
        raise InputError(f"{problem}; {remedy}")
    return document
