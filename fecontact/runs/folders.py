"""The folder of results before anything is solved: whether it can be written, and whether other results are in it."""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.files import json_text, read_json
from fecontact.outputs.records.results import case_inputs
from fecontact.runs.identity import case_id
from fecontact.runs.store import ROW

_KINDS = {ROW: "case", "study.json": "study", "map.json": "map"}
# of the case of a map these are the map's own, or those by which it is judged
_NOT_OF_A_MAP = ("lateral_shift_mm", "load_N", "criteria", "creep")


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
    _prepare(out, ROW, lambda stored: stored["row"]["id"] == name, force)


def prepare_for_study(out: Path, name: str, *, force: bool = False) -> None:
    """Do as `prepare_for_case` does, for a study."""
    _prepare(out, "study.json", lambda stored: stored["study"] == name, force)


def prepare_for_map(out: Path, case: Case, *, force: bool = False) -> None:
    """Do as `prepare_for_case` does, for a map, whose shifts, loads, criteria and friction may be others."""
    own = {name: value for name, value in case_inputs(case).items() if name not in _NOT_OF_A_MAP}
    written = json.loads(json_text(own))
    _prepare(
        out, "map.json", lambda stored: all(stored["case"].get(name) == value for name, value in written.items()), force
    )


def _prepare(out: Path, own: str, is_own: Callable[[Any], bool], force: bool) -> None:
    for file, kind in () if force else _KINDS.items():
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
