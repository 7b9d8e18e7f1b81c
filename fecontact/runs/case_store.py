"""One case in its folder: solved and written, judged again from what was stored, and read back."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from fecontact.case import Case, case_from_record
from fecontact.comparison.judged_load import judge_load
from fecontact.creep import Creep
from fecontact.criteria import Criteria
from fecontact.errors import InputError
from fecontact.fe.stress_peak import StressPeak
from fecontact.files import read_json, write_json
from fecontact.jobs.job import Job, Work
from fecontact.jobs.store import write_manifest
from fecontact.outputs.record import FOUND_INPUTS, RESULT_SCHEMA, result_record, shown_case_record
from fecontact.outputs.rows import Row, case_row, write_row
from fecontact.outputs.stored import (
    Arrays,
    placement_from_record,
    placement_record,
    read_arrays,
    solved_from_record,
    solved_record,
    write_arrays,
)
from fecontact.profiles.identity import file_of_identity, profile_file
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.runs.identity import case_id, input_files, origin_of, provenance
from fecontact.solving.meshes import would_be_refined
from fecontact.solving.position import hertz_points_of_case
from fecontact.solving.solve import CaseResult, Effort, solve

ROW, RESULT, FIELDS, PROFILES = "row.json", "result.json", "fields.npz", "profiles"
# Of a case that is judged again these stay as they are.
_BODIES = ("rail.vtu", "wheel.vtu")
_FILES = (
    ROW,
    RESULT,
    FIELDS,
    "case.json",
    "case.png",
    "case.svg",
    "case.vtm",
    "contact.vtp",
    "hertz_ellipse.vtp",
    *_BODIES,
)


def case_folder(out: Path, name: str) -> Path:
    """Folder of a finished case."""
    return out / "cases" / name


@dataclass(frozen=True, kw_only=True)
class CaseWork:
    """What a worker does with a case of a study."""

    case: Case
    name: str
    settings: Mapping[str, Any]

    def __call__(self, folder: Path, finished: Path | None) -> bool:
        """Solve the case, or judge it again from its finished folder, and write its files."""
        result = None if finished is None else self._judged_again(finished)
        if finished is not None and result is not None:
            _write_again(result, self.case, finished, folder, self.name, self.settings)
            return False
        result = solve(self.case)
        write_case(result, folder, self.name, self.settings)
        if case_id(self.case) != self.name:
            raise InputError("a profile's file changed while the case was solved; run the study again")
        return result.load.solved.short_of_memory

    def _judged_again(self, finished: Path) -> CaseResult | None:
        """The stored case by the criteria and readings of today, None where it has to be solved again."""
        try:
            result = read_case(finished, criteria=self.case.criteria, creep=self.case.creep)
        except InputError:
            # of another layout
            return None
        return None if would_be_refined(result.load, result.placement) else result


def keep_case(result: CaseResult, folder: Path) -> None:
    """Put the files of a solved case into a folder, as `load` and `judge` read them; other files there stay."""
    case = result.case
    name = case_id(case)
    write_case(result, folder, name)
    own = [folder / file for file in _FILES]
    own += [folder / PROFILES / body / file["name"] for body, file in input_files(case).items()]
    write_manifest(folder, own, name, origin_of(case))


def job_of(case: Case, folder: Path, work: Work, *, label: str = "") -> Job:
    """Job that is kept in a folder of its own name; its case says what decides about its numbers."""
    return Job(
        name=folder.name,
        folder=folder.absolute(),
        origin=origin_of(case),
        origin_here=partial(origin_of, case),
        work=work,
        label=label,
    )


def write_case(result: CaseResult, folder: Path, name: str, settings: Mapping[str, Any] | None = None) -> Row:
    """Write all files of one case into a folder and return its row.

    Parameters
    ----------
    settings
        Settings of the command, for the provenance in `result.json`.
    """
    from fecontact.outputs.vtk import write_case_vtk

    folder.mkdir(parents=True, exist_ok=True)
    write_case_vtk(result, folder)
    copy_profiles(result.case, folder)
    arrays: Arrays = {}
    stored = {
        "placement": placement_record(result.placement),
        "load": solved_record(result.load.solved, arrays),
    }
    write_arrays(folder / FIELDS, arrays)
    return _write_judged(result, result.case, folder, name, stored, settings or {})


def copy_profiles(case: Case, folder: Path) -> None:
    """Keep the profiles of a case that are files beside its result: without them it could not be judged again."""
    for body, spec in case.profiles.items():
        if (path := profile_file(spec)) is not None:
            own = folder / PROFILES / body / path.name
            own.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, own)


def _write_judged(
    result: CaseResult, case: Case, folder: Path, name: str, stored: Mapping[str, Any], settings: Mapping[str, Any]
) -> Row:
    """Write what is read from a solved case."""
    from fecontact.outputs.case_figure import case_figure

    shown = shown_case_record(case, result.placement)
    record = result_record(result) | {"case": shown, "provenance": provenance(case, name, settings)}
    case_figure(result, folder / "case.png")
    write_json(folder / "case.json", shown_case_record(case))
    write_json(folder / RESULT, record | {"stored": stored})
    row = {"id": name, **case_row(result)}
    write_row(folder / ROW, row)
    return row


def _write_again(
    result: CaseResult, case: Case, finished: Path, folder: Path, name: str, settings: Mapping[str, Any]
) -> None:
    from fecontact.outputs.vtk import write_contact_vtk

    for file in (*_BODIES, FIELDS):
        shutil.copyfile(finished / file, folder / file)
    if (finished / PROFILES).is_dir():
        shutil.copytree(finished / PROFILES, folder / PROFILES)
    write_contact_vtk(result, folder)
    _write_judged(result, case, folder, name, read_json(finished / RESULT)["stored"], settings)


def read_case(folder: str | Path, *, criteria: Criteria | None = None, creep: Creep | None = None) -> CaseResult:
    """Read a finished case and judge it, by other criteria, friction and creepages than its own if they are given.

    Raises
    ------
    InputError
        If the folder holds no finished case, or one of another layout, and what to do.
    """
    folder = Path(folder)
    with stored_record(folder / RESULT, RESULT_SCHEMA, "solve the case again") as record:
        return _result(folder, record, criteria, creep)


@contextmanager
def stored_record(path: Path, schema: str, remedy: str) -> Iterator[Mapping[str, Any]]:
    """The record of a finished case or position, while a result is made of it.

    Raises
    ------
    InputError
        If its layout is another one, or what is read from it does not fit; with the remedy.
    """
    record = read_json(path)
    found = record.get("schema") if isinstance(record, Mapping) else None
    if found != schema:
        raise InputError(f"{path}: its layout is {found}, not {schema}; {remedy}")
    try:
        yield record
    except InputError:
        raise
    except (KeyError, TypeError, AttributeError, ValueError, OSError) as error:
        raise InputError(f"{path.parent}: it cannot be read ({type(error).__name__}: {error}); {remedy}") from error


def _result(folder: Path, record: Mapping[str, Any], criteria: Criteria | None, creep: Creep | None) -> CaseResult:
    case = stored_case(folder, record["case"])
    case = replace(case, criteria=criteria or case.criteria, creep=creep or case.creep)
    stored = record["stored"]
    placement = placement_from_record(
        stored["placement"], resolve_rail(case.rail, case.rail_file), resolve_wheel(case.wheel, case.wheel_file).profile
    )
    solved = solved_from_record(stored["load"], read_arrays(folder / FIELDS), case)
    solver = record["solver"]
    return CaseResult(
        load=judge_load(solved, placement),
        placement=placement,
        hertz_points=hertz_points_of_case(case, placement),
        von_mises={body: StressPeak(**peak) for body, peak in record["von_mises"].items()},
        effort=Effort(**{name: solver[name] for name in ("path", "seconds", "memory_MB", "peak_memory_MB")}),
        bodies=None,
    )


def stored_case(folder: Path, record: Mapping[str, Any]) -> Case:
    """The case of a record, with the profiles that were stored beside it in place of the files that it was given."""
    case = case_from_record({name: value for name, value in record.items() if name not in FOUND_INPUTS})
    files = {body: file_of_identity(spec) for body, spec in case.profiles.items()}
    return case.with_profiles(
        {body: str(folder / PROFILES / body / name) for body, name in files.items() if name is not None}
    )
