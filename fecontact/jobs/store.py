"""Finished cases on disk: each a folder that is whole or absent, with the checksums of its files."""

from __future__ import annotations

import contextlib
import errno
import glob
import hashlib
import json
import secrets
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fecontact.case import Case, case_record
from fecontact.files import write_json
from fecontact.jobs.provenance import difference, fingerprint, provenance
from fecontact.solving.solve import CaseResult, solve

Record = dict[str, Any]

CHECKSUMS = "checksums.json"


def write_case(result: CaseResult, folder: Path, name: str, settings: Mapping[str, Any] | None = None) -> Record:
    """Write all files of one case into a folder and return its row.

    Parameters
    ----------
    settings
        Settings of the command, for the provenance in `result.json`.
    """
    from fecontact.outputs.figures import case_figure
    from fecontact.outputs.record import result_record, row
    from fecontact.outputs.vtk import write_case_vtk

    folder.mkdir(parents=True, exist_ok=True)
    record = result_record(result) | {"provenance": provenance(result.case, name, settings or {})}
    write_case_vtk(result, folder)
    case_figure(result, folder / "case.png")
    write_json(folder / "case.json", case_record(result.case))
    write_json(folder / "result.json", record)
    return {"id": name, **row(record)}


def solve_into(case: Case, folder: Path, name: str, settings: Mapping[str, Any]) -> None:
    """Solve a case and write its files into a folder.

    Raises
    ------
    FecontactError
        As `solve` does.
    OSError
        If the disk refuses a file.
    """
    write_case(solve(case), folder, name, settings)


def case_folder(out: Path, name: str) -> Path:
    """Folder of a finished case."""
    return out / "cases" / name


@contextmanager
def new_case_folder(out: Path, name: str) -> Iterator[Path]:
    """A temporary folder to write a case into, put in the place of the case's folder in one step if nothing is raised.

    Files get their checksums before that; a reader, or a killed run, sees the old folder, none, or the whole new one.
    """
    final = case_folder(out, name)
    temporary = _beside(final)
    temporary.mkdir(parents=True)
    try:
        yield temporary
        files = sorted(path for path in temporary.rglob("*") if path.is_file())
        write_json(temporary / CHECKSUMS, {path.relative_to(temporary).as_posix(): _sha256(path) for path in files})
        _put(temporary, final)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _beside(final: Path) -> Path:
    return final.with_name(f".{final.name}.{secrets.token_hex(6)}")


def _put(temporary: Path, final: Path) -> None:
    older = _beside(final)
    while True:
        with contextlib.suppress(FileNotFoundError):
            final.rename(older)
        try:
            temporary.rename(final)
            break
        except OSError as error:
            # a worker that was given up for lost has put the same case there in between
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
            shutil.rmtree(older, ignore_errors=True)
    shutil.rmtree(older, ignore_errors=True)


def remove_leftovers(out: Path, name: str | None = None) -> None:
    """Remove the temporary folders of processes that were killed: of one case, or of all.

    Those of all are only for who has the whole store to himself.
    """
    for path in (out / "cases").glob(".*" if name is None else f".{glob.escape(name)}.*"):
        shutil.rmtree(path, ignore_errors=True)


@dataclass(frozen=True, kw_only=True)
class Kept:
    """A finished case as it is on disk: its result record if it may be used again, and if not why."""

    record: Record | None = None
    problem: str | None = None


def kept_case(out: Path, name: str, made_by: Mapping[str, str]) -> Kept:
    """Read a finished case; neither record nor problem if it has not been solved.

    A file that is missing or not as it was written, and a result that something else than `made_by` (see
    `identity.makers`) made, are problems.
    """
    from fecontact.outputs.record import row

    folder = case_folder(out, name)
    if not folder.is_dir():
        return Kept()
    if problem := _damage(folder):
        return Kept(problem=problem)
    record: Record = json.loads((folder / "result.json").read_text("utf-8"))
    made = record.get("provenance", {})
    if made.get("fingerprint") != fingerprint(name, made_by):
        changes = difference(made.get("made_by", {}), made_by)
        return Kept(problem=f"made by another version: {changes or 'its fingerprint differs'}")
    try:
        row(record)
    except (KeyError, TypeError) as error:
        return Kept(problem=f"its result.json has another layout ({error})")
    return Kept(record=record)


def _damage(folder: Path) -> str | None:
    """The first file of a case's folder that is not as it was written."""
    try:
        expected = json.loads((folder / CHECKSUMS).read_text("utf-8"))
    except (OSError, ValueError):
        return f"{CHECKSUMS} is missing or damaged"
    if not isinstance(expected, dict) or "result.json" not in expected:
        return f"{CHECKSUMS} is damaged"
    for name, digest in expected.items():
        try:
            actual = _sha256(folder / name)
        except FileNotFoundError:
            return f"{name} is missing"
        except OSError as error:
            return f"{name} cannot be read ({error.strerror})"
        if actual != digest:
            return f"{name} is damaged (its checksum differs)"
    return None


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
