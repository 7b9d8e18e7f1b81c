"""Folder of results before a solution: whether it can be written, and whether it has other results."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.files import read_json
from fecontact.jobs.store import LOCK
from fecontact.outputs.study_report import REPORT_FILE
from fecontact.runs.casefile import list_result_files
from fecontact.runs.identity import make_case_id
from fecontact.runs.store import RECORD_FILE, ROW_FILE, SOLUTION_FILE

_CASE_FILES = (ROW_FILE, RECORD_FILE, "case.png", "case.svg", REPORT_FILE)
_STUDY_FILES = ("study.csv", "study.json", "study.png", "study.svg", "study*.pvd", REPORT_FILE)


def prepare_for_case(out: Path, case: Case, *, force: bool = False) -> None:
    """Create the folder of a case and check that it can be written.

    A folder with other results is used only by force.

    Parameters
    ----------
    out
        Folder.
    case
        Case that is to be solved.
    force
        Whether to write into a folder with other results.

    Raises
    ------
    InputError
        If the folder has other results; the message names them.
    OSError
        If the folder cannot be written.
    """
    name = make_case_id(case)
    prepare_folder(out, ROW_FILE, lambda stored: stored["row"]["id"] == name, force, _CASE_FILES, SOLUTION_FILE)


def prepare_for_study(out: Path, name: str, *, force: bool = False) -> None:
    """Create the folder of a study and check that it can be written.

    Parameters, and exceptions, are those of `prepare_for_case`; `name` is the name of the study.

    Parameters
    ----------
    out
        Folder of the study.
    name
        Name of the study.
    force
        Whether results of another study in the folder are replaced.
    """
    prepare_folder(out, "study.json", lambda stored: stored["study"] == name, force, _STUDY_FILES)


def prepare_folder(
    out: Path,
    result_file: str,
    can_continue: Callable[[Any], bool],
    force: bool,
    written_files: Iterable[str],
    first_file: str = LOCK,
) -> None:
    """Create a folder of results and check that it can be written.

    A folder with other results is used only by force, and so is a folder without a run that has files with the names
    of results.

    Parameters
    ----------
    out
        Folder.
    result_file
        Name of the file that identifies the results.
    can_continue
        Whether the stored content of this file belongs to the present results.
    force
        Whether to write into a folder with other results.
    written_files
        Names and patterns of the files that the run writes after `first_file`.
    first_file
        File by which the folder of an interrupted run is recognised.

    Raises
    ------
    InputError
        If the folder has other results, or files of the user; the message names them.
    OSError
        If the folder cannot be written.
    """
    for file, kind in () if force else list_result_files().items():
        if (out / file).is_file() and not (file == result_file and _has_continuable_result(can_continue, out / file)):
            existing_result = f"a different {kind}" if file == result_file else f"a {kind}"
            raise InputError(
                f"{out} has {existing_result} ({file}), which would be overwritten; give another --out, or --force"
            )
    if not force and not _has_earlier_run(out / first_file, out / result_file, can_continue):
        refuse_foreign_files(out, written_files)
    out.mkdir(parents=True, exist_ok=True)
    probe = out / f".probe.{secrets.token_hex(6)}"
    try:
        probe.write_bytes(b"0")
    except OSError as error:
        # the user knows the folder
        error.filename = str(out)
        raise
    finally:
        probe.unlink(missing_ok=True)


def _has_earlier_run(first_file: Path, result: Path, can_continue: Callable[[Any], bool]) -> bool:
    """Whether an earlier run left its first file or its result."""
    if first_file.is_file():
        return True
    try:
        return can_continue(read_json(result))
    except (ValueError, KeyError, TypeError, AttributeError):
        return False


def refuse_foreign_files(out: Path, written_files: Iterable[str]) -> None:
    """Refuse a folder without a run if it has files that a run would overwrite.

    Parameters
    ----------
    out
        Folder without results of an earlier run.
    written_files
        Names and patterns of the files that the run writes.

    Raises
    ------
    InputError
        With the names of the files.
    """
    if names := sorted({path.name for pattern in written_files for path in out.glob(pattern)}):
        raise InputError(
            f"{out} has {', '.join(names)}, which no run of this program wrote and which would be overwritten; give"
            " another --out, or --force"
        )


def _has_continuable_result(can_continue: Callable[[Any], bool], path: Path) -> bool:
    """Whether a file belongs to the present results, or is damaged."""
    try:
        return can_continue(read_json(path))
    except (ValueError, KeyError, TypeError, AttributeError):
        # a damaged file is not a result that could be lost
        return True
