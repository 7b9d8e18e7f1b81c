"""Folder of results before a solution: whether it can be written, and whether it has other results."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.files import read_json
from fecontact.runs.casefile import list_result_files
from fecontact.runs.identity import make_case_id
from fecontact.runs.store import ROW_FILE


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
    prepare_folder(out, ROW_FILE, lambda stored: stored["row"]["id"] == name, force)


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
    prepare_folder(out, "study.json", lambda stored: stored["study"] == name, force)


def prepare_folder(out: Path, result_file: str, can_continue: Callable[[Any], bool], force: bool) -> None:
    """Create a folder of results and check that it can be written.

    A folder with other results is used only by force.

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

    Raises
    ------
    InputError
        If the folder has other results; the message names them.
    OSError
        If the folder cannot be written.
    """
    for file, kind in () if force else list_result_files().items():
        if (out / file).is_file() and not (file == result_file and _has_continuable_result(can_continue, out / file)):
            existing_result = f"a different {kind}" if file == result_file else f"a {kind}"
            raise InputError(
                f"{out} has {existing_result} ({file}), which would be overwritten; give another --out, or --force"
            )
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


def _has_continuable_result(can_continue: Callable[[Any], bool], path: Path) -> bool:
    """Whether a file belongs to the present results, or is damaged."""
    try:
        return can_continue(read_json(path))
    except (ValueError, KeyError, TypeError, AttributeError):
        # a damaged file is not a result that could be lost
        return True
