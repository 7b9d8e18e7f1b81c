"""Finished results in their folders: cases, and solutions of features at a position under several loads.

`solved.json`, `fields.npz` and `profiles/` have the inputs and the solution. All other files of a folder are made from
them. Results are judged again from them, by different criteria or a newer evaluation, without a new solution.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case, read_case_record
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.criteria import Creep, Criteria
from fecontact.errors import FecontactError, InputError
from fecontact.fe.stress import StressPeak
from fecontact.files import is_file_name, read_json, write_json
from fecontact.jobs.store import write_manifest
from fecontact.jobs.workers import Job, Work, WorkResult
from fecontact.judging.judge import judge_load
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.own_measures import make_evaluations_record, restore_evaluations
from fecontact.outputs.records.results import DERIVED_INPUTS, Row, case_inputs, case_row, result_record, write_row
from fecontact.outputs.records.stored import (
    Arrays,
    placement_record,
    read_arrays,
    restore_placement,
    solved_from_record,
    solved_record,
    write_arrays,
)
from fecontact.outputs.words import criteria_settings
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.library import file_of_identity, is_library_name, read_content
from fecontact.profiles.reading import is_short_form
from fecontact.runs.identity import determine_origin, digest_input_files, make_case_id, make_provenance
from fecontact.solving.meshes import would_be_refined
from fecontact.solving.solve import CaseResult, Effort, SharedLoads, disable_refinement, solve

SCHEMA = "fecontact/solved/2"
SOLUTION_FILE, FIELDS_FILE, PROFILES_FOLDER = "solved.json", "fields.npz", "profiles"
"""File of the solution, file of its fields, and folder of the profiles that are files."""
RECORD_FILE, ROW_FILE = "result.json", "row.json"
"""Files of the record of a case, and of its row of a table."""
_OWN_ENTRY = "own_evaluations"
_BODY_FILES = ("rail.vtu", "wheel.vtu")
_PICTURE_FILES = ("case.png", "case.svg", "case.vtm", "bodies.vtm", "pressure.vtp", "elements.vtp", "hertz_ellipse.vtp")

Result = TypeVar("Result")


def name_case_folder(out: Path, name: str) -> Path:
    """Folder of a finished case."""
    return out / "cases" / name


@dataclass(frozen=True, kw_only=True)
class CaseWork:
    """Work on a case: solve it and keep it.

    Attributes
    ----------
    case
        Case.
    name
        Id of the case.
    settings
        Settings of the command, for the provenance.
    loads
        All loads of a study at its position, which the group of the job shares; None for a single load.
    """

    case: Case
    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    loads: SharedLoads | None = None

    def __call__(self, folder: Path, finished: Path | None) -> WorkResult:
        """Solve the case, or judge the finished folder again, and write all files."""
        if finished is not None and (judged_result := judge_again(read_case, finished, self.case)) is not None:
            from fecontact.outputs.paraview.vtk import write_contact_vtk

            copy_solved(finished, folder, self.case, judged_result)
            write_contact_vtk(judged_result, folder)
            write_case_records(judged_result, CaseRecords.of(judged_result), folder, self.settings)
            return WorkResult()
        result = solve(self.case) if self.loads is None else self.loads.sweep.result(self.case.load_N)
        write_solution(result, self.case, folder)
        write_case_records(result, CaseRecords.of(result), folder, self.settings)
        refuse_changed_profiles(self.case, self.name)
        return WorkResult(short_of_memory=result.short_of_memory)


class SolvedLoads(Protocol):
    """Solution at a position."""

    @property
    def placement(self) -> Placement | None:
        """Placement of the wheel; None if the wheel could not be placed."""

    @property
    def solved(self) -> tuple[JudgedLoad, ...]:
        """All loads with numbers."""


Solved = TypeVar("Solved", bound=SolvedLoads)


def judge_again(read_result: Callable[..., Solved], finished: Path, case: Case) -> Solved | None:
    """Read a stored result with the present criteria and readings.

    Parameters
    ----------
    read_result
        Reads the result of a folder, with the keywords `criteria` and `creep`.
    finished
        Folder of the stored result.
    case
        Case with the present criteria, friction and creepages.

    Returns
    -------
    SolvedLoads or None
        The result. None if it has another layout, or if a new solution would refine its meshes further.
    """
    try:
        # a study without criteria of a user does not keep stored ones
        criteria = replace(case.criteria, own=case.criteria.own or ())
        result = read_result(finished, criteria=criteria, creep=case.creep)
    except InputError:
        # the result has another layout
        return None
    placement = result.placement
    is_refined_further = placement is not None and any(would_be_refined(load, placement) for load in result.solved)
    return None if is_refined_further else result


def refuse_changed_profiles(case: Case, name: str, loads_N: Sequence[float] = ()) -> None:
    """Refuse a solution if the id of its inputs has changed.

    Parameters
    ----------
    case
        Case of the solution.
    name
        Id of the case before the solution.
    loads_N
        Loads in N of a position under several loads.

    Raises
    ------
    InputError
        If the file of a profile was changed.
    """
    if make_case_id(case, loads_N) != name:
        raise InputError("a profile file was changed during the solution; run the same command again")


def make_job(case: Case, folder: Path, work: Work, *, label: str = "", group: str = "") -> Job:
    """Job of a case; its folder has the name of the job.

    Parameters
    ----------
    case
        Case that determines the origin of the numbers.
    folder
        Folder of the result.
    work
        Work of the job.
    label
        Name shown while the job is under way.
    group
        Group of the job.

    Returns
    -------
    Job
        The job.

    Raises
    ------
    InputError
        If workers cannot import the function of a user's criterion.
    """
    case.criteria.refuse_unsendable_own()
    return Job(
        name=folder.name,
        folder=folder.absolute(),
        origin=determine_origin(case),
        origin_here=partial(determine_origin, case),
        work=work,
        label=label,
        group=group,
    )


@dataclass(frozen=True, kw_only=True)
class CaseRecords:
    """Row and record of a case.

    Attributes
    ----------
    row
        Row of a table.
    record
        Complete record.
    """

    row: Row
    record: Mapping[str, Any]

    @classmethod
    def of(cls, result: CaseResult) -> CaseRecords:
        """Row and record of a solved case."""
        return cls(row={"id": make_case_id(result.case), **case_row(result)}, record=result_record(result))


def write_solution(result: CaseResult, case: Case, folder: Path) -> None:
    """Write all data from which a solved case can be judged again, and its meshes.

    Parameters
    ----------
    result
        Solved case.
    case
        Case with the present criteria.
    folder
        Folder for the files.
    """
    from fecontact.outputs.paraview.vtk import write_case_vtk

    peaks = {body: asdict(peak) for body, peak in result.von_mises.items()}
    keep_loads(result, case, folder, von_mises=peaks, effort=asdict(result.effort))
    write_case_vtk(result, folder)


def keep_loads(result: SolvedLoads, case: Case, folder: Path, **entries: Any) -> None:
    """Write all data from which the loads of a position can be judged again.

    Parameters
    ----------
    result
        Solution at the position.
    case
        Case of the position.
    folder
        Folder for the files.
    **entries
        Further entries of `solved.json`.
    """
    copy_profiles(case, folder)
    arrays: Arrays = {}
    record = {
        "schema": SCHEMA,
        "case": case_inputs(case),
        "placement": None if result.placement is None else placement_record(result.placement),
        "loads": [
            solved_record(load.solved, arrays, f"load{number}_") | _own_entry(load)
            for number, load in enumerate(result.solved)
        ],
        **entries,
    }
    write_arrays(folder / FIELDS_FILE, arrays)
    write_json(folder / SOLUTION_FILE, record)


def _own_entry(load: JudgedLoad) -> dict[str, Any]:
    """Entry of `solved.json` with the evaluations of a user's criteria; empty without evaluations."""
    return {_OWN_ENTRY: make_evaluations_record(load.own_evaluations)} if load.own_evaluations else {}


def write_case_records(
    result: CaseResult,
    case_records: CaseRecords,
    folder: Path,
    settings: Mapping[str, Any] | None = None,
    *,
    svg: bool = False,
) -> None:
    """Write row, record and picture of a case beside its solution.

    A vector picture takes as long as a pixel picture: a study of hundreds of cases has no vector pictures.

    Parameters
    ----------
    result
        Solved case.
    case_records
        Row and record of the case.
    folder
        Folder for the files.
    settings
        Settings of the command, for the provenance.
    svg
        Whether to write a vector picture too.
    """
    from fecontact.outputs.figures.case import write_case_figure

    write_case_figure(result, folder / "case.png", svg=svg)
    result_provenance = make_provenance(result.case, id=case_records.row["id"], settings=dict(settings or {}))
    write_json(folder / RECORD_FILE, {**case_records.record, "provenance": result_provenance})
    write_row(folder / ROW_FILE, case_records.row, criteria_settings([result.case.criteria]))


def seal_case(case: Case, folder: Path) -> None:
    """Seal the files of a case in a folder that may have other files.

    Parameters
    ----------
    case
        Solved case.
    folder
        Folder with the files of its result.
    """
    sealed_files = [
        folder / file for file in (SOLUTION_FILE, FIELDS_FILE, RECORD_FILE, ROW_FILE, *_BODY_FILES, *_PICTURE_FILES)
    ]
    sealed_files += [folder / PROFILES_FOLDER / body / file["name"] for body, file in digest_input_files(case).items()]
    write_manifest(folder, sealed_files, make_case_id(case), determine_origin(case))


def copy_profiles(case: Case, folder: Path) -> None:
    """Copy the profile files of a case into its folder; without them the case cannot be judged again.

    Parameters
    ----------
    case
        Solved case.
    folder
        Folder of its result.
    """
    for body, spec in case.profiles.items():
        if (name_and_content := read_content(spec)) is not None:
            target = folder / PROFILES_FOLDER / body / name_and_content[0]
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(name_and_content[1])


def copy_solved(finished: Path, folder: Path, case: Case, result: SolvedLoads) -> None:
    """Copy a solution into a new folder, with the present criteria.

    Parameters
    ----------
    finished
        Folder of the solution.
    folder
        New folder.
    case
        Case with the present criteria.
    result
        Solution, judged by the present criteria.
    """
    for file in (FIELDS_FILE, *_BODY_FILES):
        if (finished / file).is_file():
            shutil.copyfile(finished / file, folder / file)
    if (finished / PROFILES_FOLDER).is_dir():
        shutil.copytree(finished / PROFILES_FOLDER, folder / PROFILES_FOLDER)
    record = read_solution(finished)
    loads = [
        {name: value for name, value in stored_load.items() if name != _OWN_ENTRY}
        | (_own_entry(load) if load.load_N == stored_load["load_N"] else {})
        for stored_load, load in zip(record["loads"], result.solved, strict=True)
    ]
    write_json(folder / SOLUTION_FILE, {**record, "case": case_inputs(case), "loads": loads})


@dataclass(frozen=True, kw_only=True)
class StoredPosition:
    """Content of the folder of a solved position.

    Attributes
    ----------
    record
        Content of `solved.json`.
    case
        Case with the requested criteria and creepages.
    stored_criteria
        Criteria with which the position was solved.
    placement
        Placement of the wheel; None if the wheel could not be placed.
    arrays
        Fields of the solution.
    """

    record: Mapping[str, Any]
    case: Case
    stored_criteria: Criteria
    placement: Placement | None
    arrays: Mapping[str, NDArray[np.float64]]

    def judged(self, number: int, *, is_from_search: bool = False) -> JudgedLoad:
        """Judge a load by all theories; a load of the search for a limit is judged only by Hertz.

        Parameters
        ----------
        number
            Number of the load in the record.
        is_from_search
            Whether the search for a load limit solved the load.

        Returns
        -------
        JudgedLoad
            The judged load.
        """
        assert self.placement is not None
        load = self.record["loads"][number]
        case = replace(self.case, load_N=load["load_N"])
        solved_load = solved_from_record(load, self.arrays, disable_refinement(case) if is_from_search else case)
        stored_digests = {criterion.digest for criterion in self.stored_criteria.own or ()}
        equal_own = [criterion for criterion in case.criteria.own or () if criterion.digest in stored_digests]
        if solved_load.lines is not None:
            equal_measures = [criterion.key for criterion in equal_own]
            solved_load = replace(solved_load, lines=solved_load.lines.select_own(equal_measures))
        unavailable_measures = [criterion.key for criterion in equal_own if not criterion.is_available]
        stored_own = restore_evaluations(load.get(_OWN_ENTRY, {}), unavailable_measures)
        return judge_load(solved_load, self.placement, (HERTZ,) if is_from_search else THEORIES, stored_own)


def read_case(folder: str | Path, *, criteria: Criteria | None = None, creep: Creep | None = None) -> CaseResult:
    """Read a finished case and judge it.

    Parameters
    ----------
    folder
        Folder of the case.
    criteria, creep
        Criteria, and friction with creepages; the stored values if not given. Criteria with `own` None keep the stored
        criteria of the user.

    Returns
    -------
    CaseResult
        The result, without meshes.

    Raises
    ------
    InputError
        If the folder holds no finished case, or a case of another layout; the message has the remedy.
    """
    return read_stored(_restore_case, Path(folder), criteria, creep)


@dataclass(frozen=True, kw_only=True)
class ChangedCase:
    """Stored case that is judged by changed criteria.

    Attributes
    ----------
    folder
        Folder of the case.
    criteria, creep
        Changed criteria, friction and creepages.
    """

    folder: Path
    criteria: Criteria
    creep: Creep

    def read(self) -> CaseResult:
        """Read the case and judge it, as `read_case` does."""
        return read_case(self.folder, criteria=self.criteria, creep=self.creep)


def read_stored(
    make_result: Callable[[StoredPosition], Result], folder: Path, criteria: Criteria | None, creep: Creep | None
) -> Result:
    """Read a stored position and make a result of it.

    Parameters
    ----------
    make_result
        Makes the result from the content of the folder.
    folder
        Folder of the position.
    criteria, creep
        Criteria, and friction with creepages; None for the stored values.

    Returns
    -------
    Result
        The result.

    Raises
    ------
    InputError
        If the folder has another layout, or was changed.
    """
    record = read_solution(folder)
    with refuse_changed_files(folder, "solve it again"):
        stored_case = read_stored_case(folder, record["case"])
        new_criteria = stored_case.criteria.apply_change(criteria)
        case = replace(stored_case, criteria=new_criteria, creep=creep or stored_case.creep)
        placement = None if record["placement"] is None else restore_placement(case, record["placement"])
        return make_result(
            StoredPosition(
                record=record,
                case=case,
                stored_criteria=stored_case.criteria,
                placement=placement,
                arrays=read_arrays(folder / FIELDS_FILE),
            )
        )


@contextmanager
def refuse_changed_files(path: Path, remedy: str) -> Iterator[None]:
    """Turn every exception that a changed file causes into an `InputError`.

    Parameters
    ----------
    path
        File or folder for the message.
    remedy
        Remedy for the message.

    Yields
    ------
    None
        Control to the enclosed code.

    Raises
    ------
    InputError
        In place of exceptions that are not from fecontact.
    """
    try:
        yield
    except FecontactError:
        raise
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        raise InputError(f"{path} cannot be read ({reason}); {remedy}") from error


def _restore_case(stored: StoredPosition) -> CaseResult:
    """Restore the result of a case from its stored content."""
    placement, effort = stored.placement, stored.record["effort"]
    assert placement is not None
    return CaseResult(
        load=stored.judged(0),
        placement=placement,
        von_mises={body: StressPeak(**peak) for body, peak in stored.record["von_mises"].items()},
        effort=Effort(
            path=effort["path"],
            seconds={step: float(value) for step, value in effort["seconds"].items()},
            cpu_seconds=effort.get("cpu_seconds"),
            memory_MB={step: float(value) for step, value in effort["memory_MB"].items()},
            peak_memory_MB=float(effort["peak_memory_MB"]),
        ),
        bodies=None,
    )


def read_solution(folder: Path) -> Mapping[str, Any]:
    """Read `solved.json` of a folder.

    Parameters
    ----------
    folder
        Folder of a result.

    Returns
    -------
    mapping
        The content.

    Raises
    ------
    InputError
        If the file is missing or has another layout; the message has the remedy.
    """
    path = folder / SOLUTION_FILE
    record = read_json(path)
    schema = record.get("schema") if isinstance(record, Mapping) else None
    if not isinstance(record, Mapping) or schema != SCHEMA:
        raise InputError(f"{path}: the layout is {schema}; allowed: {SCHEMA}; solve it again")
    return record


def read_stored_inputs(folder: Path) -> Case:
    """Read the case of a stored result, with the stored profiles as its files.

    Parameters
    ----------
    folder
        Folder of the result.

    Returns
    -------
    Case
        The case.

    Raises
    ------
    InputError
        If the folder has another layout, or was changed.
    """
    record = read_solution(folder)
    with refuse_changed_files(folder, "solve it again"):
        return read_stored_case(folder, record["case"])


def read_stored_case(folder: Path, record: Mapping[str, Any]) -> Case:
    """Make the case of a record, with the stored profiles as its files.

    Parameters
    ----------
    folder
        Folder of the result.
    record
        Record of the case.

    Returns
    -------
    Case
        The case.

    Raises
    ------
    InputError
        If the record has a profile that is not stored in the folder.
    """
    case = read_case_record({name: value for name, value in record.items() if name not in DERIVED_INPUTS})
    files = {}
    for body, spec in case.profiles.items():
        name = file_of_identity(spec)
        if name is None and (is_library_name(spec) or is_short_form(spec)):
            continue
        if not is_file_name(name):
            raise InputError(
                f"{folder}: {body} is {spec!r:.80}; allowed: the name of a file in this folder, with @ and its hash"
            )
        files[body] = str(folder / PROFILES_FOLDER / body / name)
    return case.with_profiles(files)
