"""The folder of results before anything is solved: whether it can be written, and whether other results are in it."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.files import read_json
from fecontact.runs.casefile import kinds
from fecontact.runs.identity import case_id
from fecontact.runs.store import ROW


def prepare_for_case(out: Path, case: Case, *, force: bool = False) -> None:
    """Make the folder of a case and see that it can be written; one with other results in it is taken by force alone.

    Raises
    ------
    InputError
        With what is in it.
    OSError
        If it cannot be written.
    """
    name = case_id(case)
    prepare(out, ROW, lambda stored: stored["row"]["id"] == name, force)


def prepare_for_study(out: Path, name: str, *, force: bool = False) -> None:
    """Do as `prepare_for_case` does, for a study."""
    prepare(out, "study.json", lambda stored: stored["study"] == name, force)


def prepare(out: Path, own: str, is_own: Callable[[Any], bool], force: bool) -> None:
    """Make the folder of results whose file is `own`; others in it, that are not its own either, are taken by force."""
    for file, kind in () if force else kinds().items():
        if (out / file).is_file() and not (file == own and _holds(is_own, out / file)):
            which = f"another {kind}" if file == own else f"a {kind}"
            raise InputError(f"{out} holds {which} ({file}), which would be lost; give another --out, or --force")
    out.mkdir(parents=True, exist_ok=True)
    probe = out / f".probe.{secrets.token_hex(6)}"
    try:
        probe.write_bytes(b"0")
    finally:
        probe.unlink(missing_ok=True)


def _holds(is_own: Callable[[Any], bool], path: Path) -> bool:
    try:
        return is_own(read_json(path))
    except (InputError, KeyError, TypeError, AttributeError):
        # a file that is damaged is no result that could be lost
        return True
