"""One case in its folder: solved and written, judged again from what was stored, and read back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.comparison.judging import judge_load
from fecontact.creep import Creep
from fecontact.criteria import Criteria
from fecontact.fe.stress_peak import StressPeak
from fecontact.files import read_json, write_json
from fecontact.jobs.store import write_manifest
from fecontact.outputs.records.results import RESULT_SCHEMA, result_record, shown_case_record
from fecontact.outputs.records.rows import Row, case_row, write_row
from fecontact.outputs.records.stored import (
    Arrays,
    placement_record,
    read_arrays,
    solved_from_record,
    solved_record,
    stored_placement,
    write_arrays,
)
from fecontact.runs.identity import case_id, input_files, origin_of, provenance
from fecontact.runs.work import FIELDS, PROFILES, Store, StoredWork, copy_profiles, read_stored
from fecontact.solving.meshes import would_be_refined
from fecontact.solving.position import hertz_points_of_case
from fecontact.solving.solve import CaseResult, Effort, solve

ROW, RESULT = "row.json", "result.json"
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


def case_work(case: Case, name: str, settings: Mapping[str, Any]) -> StoredWork[CaseResult]:
    """What a worker does with a case of a study: solve it and write its files."""
    return StoredWork(store=CASES, case=case, name=name, settings=settings)


def keep_case(result: CaseResult, folder: Path, stored: Mapping[str, Any] | None = None) -> None:
    """Put the files of a solved case into a folder, as `load` and `judge` read them; other files there stay.

    `stored` is what `store_fields` returned if it has been called already.
    """
    case = result.case
    name = case_id(case)
    write_case(result, folder, name, stored)
    own = [folder / file for file in _FILES]
    own += [folder / PROFILES / body / file["name"] for body, file in input_files(case).items()]
    write_manifest(folder, own, name, origin_of(case))


def write_case(result: CaseResult, folder: Path, name: str, stored: Mapping[str, Any] | None = None) -> Row:
    """Write all files of one case into a folder and return its row; `stored` as for `keep_case`."""
    folder.mkdir(parents=True, exist_ok=True)
    copy_profiles(result.case, folder)
    stored = stored or store_fields(result, folder)
    return _write_judged(result, case_work(result.case, name, {}), folder, stored)


def store_fields(result: CaseResult, folder: Path) -> Mapping[str, Any]:
    """Write meshes and fields of a solved case into a folder, and return what its record has to have of them."""
    from fecontact.outputs.paraview.vtk import write_case_vtk

    write_case_vtk(result, folder)
    arrays: Arrays = {}
    stored = {
        "placement": placement_record(result.placement),
        "load": solved_record(result.load.solved, arrays),
    }
    write_arrays(folder / FIELDS, arrays)
    return stored


def _write(result: CaseResult, work: StoredWork[CaseResult], folder: Path, finished: Path | None) -> Row:
    from fecontact.outputs.paraview.vtk import write_contact_vtk

    if finished is None:
        return _write_judged(result, work, folder, store_fields(result, folder))
    write_contact_vtk(result, folder)
    return _write_judged(result, work, folder, read_json(finished / RESULT)["stored"])


def _write_judged(result: CaseResult, work: StoredWork[CaseResult], folder: Path, stored: Mapping[str, Any]) -> Row:
    """Write what is read from a solved case."""
    from fecontact.outputs.figures.case import case_figure

    case = work.case
    shown = shown_case_record(case, result.placement)
    record = result_record(result) | {"case": shown, "provenance": provenance(case, work.name, work.settings)}
    case_figure(result, folder / "case.png")
    write_json(folder / "case.json", shown_case_record(case))
    write_json(folder / RESULT, record | {"stored": stored})
    row = {"id": work.name, **case_row(result)}
    write_row(folder / ROW, row)
    return row


def read_case(folder: str | Path, *, criteria: Criteria | None = None, creep: Creep | None = None) -> CaseResult:
    """Read a finished case and judge it, by other criteria, friction and creepages than its own if they are given.

    Raises
    ------
    InputError
        If the folder holds no finished case, or one of another layout, and what to do.
    """
    return read_stored(CASES, folder, criteria, creep)


def _read(folder: Path, record: Mapping[str, Any], case: Case) -> CaseResult:
    stored = record["stored"]
    placement = stored_placement(case, stored["placement"])
    solved = solved_from_record(stored["load"], read_arrays(folder / FIELDS), case)
    solver = record["solver"]
    return CaseResult(
        load=judge_load(solved, placement),
        placement=placement,
        hertz_points=hertz_points_of_case(case, placement),
        von_mises={body: StressPeak(**peak) for body, peak in record["von_mises"].items()},
        effort=Effort(
            path=solver["path"],
            seconds={step: float(value) for step, value in solver["seconds"].items()},
            memory_MB={step: float(value) for step, value in solver["memory_MB"].items()},
            peak_memory_MB=float(solver["peak_memory_MB"]),
        ),
        bodies=None,
    )


def _solve(work: StoredWork[CaseResult]) -> CaseResult:
    return solve(work.case)


def _decided(result: CaseResult) -> bool:
    return not would_be_refined(result.load, result.placement)


def _short_of_memory(result: CaseResult) -> bool:
    return result.load.solved.short_of_memory


CASES = Store(
    record=RESULT,
    schema=RESULT_SCHEMA,
    unchanged=(*_BODIES, FIELDS),
    solve=_solve,
    write=_write,
    read=_read,
    decided=_decided,
    short_of_memory=_short_of_memory,
)
