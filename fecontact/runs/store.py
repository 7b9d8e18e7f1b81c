"""Finished results in their folders: cases, and what features solve at a position under loads of their own.

`solved.json`, `fields.npz` and `profiles/` have the inputs and what was solved. All else in a folder is made from them,
and they are judged again, by other criteria or a newer evaluation, without being solved.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path, PureWindowsPath
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case, case_from_record
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.criteria import Creep, Criteria
from fecontact.errors import FecontactError, InputError
from fecontact.fe.stress import StressPeak
from fecontact.files import read_json, write_json
from fecontact.jobs.store import write_manifest
from fecontact.jobs.workers import Job, Made, Work
from fecontact.judging.judge import judge_load
from fecontact.judging.judged_load import JudgedLoad
from fecontact.outputs.records.results import FOUND_INPUTS, Row, case_inputs, case_row, result_record, write_row
from fecontact.outputs.records.stored import (
    Arrays,
    placement_record,
    read_arrays,
    solved_from_record,
    solved_record,
    stored_placement,
    write_arrays,
)
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.library import content_of, file_of_identity, is_known
from fecontact.profiles.reading import is_short_form
from fecontact.runs.identity import case_id, input_files, origin_of, provenance
from fecontact.solving.meshes import would_be_refined
from fecontact.solving.solve import CaseResult, Effort, SharedLoads, solve, unrefined

SCHEMA = "fecontact/solved/2"
SOLVED, FIELDS, PROFILES = "solved.json", "fields.npz", "profiles"
"""What was solved, its fields, and the profiles that are files."""
RESULT, ROW = "result.json", "row.json"
"""What is told of a case: all of it, and its line of a table."""
_BODIES = ("rail.vtu", "wheel.vtu")
_SHOWN = ("case.png", "case.svg", "case.vtm", "pressure.vtp", "elements.vtp", "hertz_ellipse.vtp")

Result = TypeVar("Result")


def case_folder(out: Path, name: str) -> Path:
    """Folder of a finished case."""
    return out / "cases" / name


@dataclass(frozen=True, kw_only=True)
class Solving:
    """What a worker does with a case: solve it and keep it; `settings` are the command's.

    `loads` are all loads of a study at its position, which its group shares; None where it is the only one.
    """

    case: Case
    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    loads: SharedLoads | None = None

    def __call__(self, folder: Path, finished: Path | None) -> Made:
        """Solve, or judge again what is in the finished folder, and write all files."""
        if finished is not None and (again := judged_again(read_case, finished, self.case)) is not None:
            from fecontact.outputs.paraview.vtk import write_contact_vtk

            copy_solved(finished, folder, self.case)
            write_contact_vtk(again, folder)
            keep_told(again, Told.of(again), folder, self.settings)
            return Made()
        result = solve(self.case) if self.loads is None else self.loads.sweep.result(self.case.load_N)
        keep_solved(result, self.case, folder)
        keep_told(result, Told.of(result), folder, self.settings)
        refuse_changed_profiles(self.case, self.name)
        return Made(short_of_memory=result.short_of_memory)


class OfLoads(Protocol):
    """What was solved at a position."""

    @property
    def placement(self) -> Placement | None:
        """None where the wheel could not be placed."""

    @property
    def solved(self) -> tuple[JudgedLoad, ...]:
        """All loads that gave numbers."""


Solved = TypeVar("Solved", bound=OfLoads)


def judged_again(read: Callable[..., Solved], finished: Path, case: Case) -> Solved | None:
    """What is stored by the criteria and readings of today, None where a new solution would have more."""
    try:
        result = read(finished, criteria=case.criteria, creep=case.creep)
    except InputError:
        # of another layout
        return None
    placement = result.placement
    refined = placement is not None and any(would_be_refined(load, placement) for load in result.solved)
    return None if refined else result


def refuse_changed_profiles(case: Case, name: str, loads_N: Sequence[float] = ()) -> None:
    """Refuse what was solved where its inputs have another name by now.

    Raises
    ------
    InputError
        If the file of a profile is another one.
    """
    if case_id(case, loads_N) != name:
        raise InputError("a profile's file changed while it was used for solving; give the same command again")


def job_of(case: Case, folder: Path, work: Work, *, label: str = "", group: str = "") -> Job:
    """Job that is kept in a folder of its own name; its case says what decides about its numbers."""
    return Job(
        name=folder.name,
        folder=folder.absolute(),
        origin=origin_of(case),
        origin_here=partial(origin_of, case),
        work=work,
        label=label,
        group=group,
    )


@dataclass(frozen=True, kw_only=True)
class Told:
    """What is told of a case: its line of a table, and all of it."""

    row: Row
    record: Mapping[str, Any]

    @classmethod
    def of(cls, result: CaseResult) -> Told:
        """What is told of a solved case."""
        return cls(row={"id": case_id(result.case), **case_row(result)}, record=result_record(result))


def keep_solved(result: CaseResult, case: Case, folder: Path) -> None:
    """Put a solved case into a folder: all that it can be judged again from, and its meshes."""
    from fecontact.outputs.paraview.vtk import write_case_vtk

    peaks = {body: asdict(peak) for body, peak in result.von_mises.items()}
    keep_loads(result, case, folder, von_mises=peaks, effort=asdict(result.effort))
    write_case_vtk(result, folder)


def keep_loads(result: OfLoads, case: Case, folder: Path, **own: Any) -> None:
    """Put the solved loads of a position into a folder: all that they can be judged again from, and what is `own`."""
    copy_profiles(case, folder)
    arrays: Arrays = {}
    record = {
        "schema": SCHEMA,
        "case": case_inputs(case),
        "placement": None if result.placement is None else placement_record(result.placement),
        "loads": [solved_record(one.solved, arrays, f"load{number}_") for number, one in enumerate(result.solved)],
        **own,
    }
    write_arrays(folder / FIELDS, arrays)
    write_json(folder / SOLVED, record)


def keep_told(
    result: CaseResult, told: Told, folder: Path, settings: Mapping[str, Any] | None = None, *, svg: bool = False
) -> None:
    """Put what is told of a case beside what was solved; `settings` are the command's, `svg` adds a picture of lines.

    A picture of lines takes as long as that of pixels: a study of hundreds of cases has none.
    """
    from fecontact.outputs.figures.case import case_figure

    case_figure(result, folder / "case.png", svg=svg)
    made = provenance(result.case, id=told.row["id"], settings=dict(settings or {}))
    write_json(folder / RESULT, {**told.record, "provenance": made})
    write_row(folder / ROW, told.row)


def seal_case(case: Case, folder: Path) -> None:
    """Seal the files of a case in a folder that may have others."""
    own = [folder / file for file in (SOLVED, FIELDS, RESULT, ROW, *_BODIES, *_SHOWN)]
    own += [folder / PROFILES / body / file["name"] for body, file in input_files(case).items()]
    write_manifest(folder, own, case_id(case), origin_of(case))


def copy_profiles(case: Case, folder: Path) -> None:
    """Keep the profiles of a case that are files beside its result: without them it could not be judged again."""
    for body, spec in case.profiles.items():
        if (file := content_of(spec)) is not None:
            own = folder / PROFILES / body / file[0]
            own.parent.mkdir(parents=True, exist_ok=True)
            own.write_bytes(file[1])


def copy_solved(finished: Path, folder: Path, case: Case) -> None:
    """Take what was solved over into a new folder, with the criteria by which it is judged from now on."""
    for file in (FIELDS, *_BODIES):
        if (finished / file).is_file():
            shutil.copyfile(finished / file, folder / file)
    if (finished / PROFILES).is_dir():
        shutil.copytree(finished / PROFILES, folder / PROFILES)
    write_json(folder / SOLVED, {**read_json(finished / SOLVED), "case": case_inputs(case)})


@dataclass(frozen=True, kw_only=True)
class Stored:
    """What a folder has of a solved position; the case by the criteria and creepages that are asked for."""

    record: Mapping[str, Any]
    case: Case
    placement: Placement | None
    arrays: Mapping[str, NDArray[np.float64]]

    def judged(self, number: int, *, tried: bool = False) -> JudgedLoad:
        """A load; one that the search for a limit solved is judged by Hertz alone."""
        assert self.placement is not None
        load = self.record["loads"][number]
        case = replace(self.case, load_N=load["load_N"])
        solved = solved_from_record(load, self.arrays, unrefined(case) if tried else case)
        return judge_load(solved, self.placement, (HERTZ,) if tried else THEORIES)


def read_case(folder: str | Path, *, criteria: Criteria | None = None, creep: Creep | None = None) -> CaseResult:
    """Read a finished case and judge it, by other criteria, friction and creepages than its own if they are given.

    Raises
    ------
    InputError
        If the folder holds no finished case, or one of another layout, and what to do.
    """
    return read_stored(_case_of, Path(folder), criteria, creep)


def read_stored(of: Callable[[Stored], Result], folder: Path, criteria: Criteria | None, creep: Creep | None) -> Result:
    """What a function makes of a stored position, by other criteria and creepages if they are given."""
    record = solved_in(folder)
    with refused_if_changed(folder, "solve it again"):
        case = stored_case(folder, record["case"])
        case = replace(case, criteria=criteria or case.criteria, creep=creep or case.creep)
        placement = None if record["placement"] is None else stored_placement(case, record["placement"])
        return of(Stored(record=record, case=case, placement=placement, arrays=read_arrays(folder / FIELDS)))


@contextmanager
def refused_if_changed(path: Path, remedy: str) -> Iterator[None]:
    """Refuse whatever a file that was changed on purpose leads to."""
    try:
        yield
    except FecontactError:
        raise
    except Exception as error:
        said = f"{type(error).__name__}: {error}"
        raise InputError(f"{path}: it cannot be read ({said}); {remedy}") from error


def _case_of(stored: Stored) -> CaseResult:
    placement, effort = stored.placement, stored.record["effort"]
    assert placement is not None
    return CaseResult(
        load=stored.judged(0),
        placement=placement,
        von_mises={body: StressPeak(**peak) for body, peak in stored.record["von_mises"].items()},
        effort=Effort(
            path=effort["path"],
            seconds={step: float(value) for step, value in effort["seconds"].items()},
            memory_MB={step: float(value) for step, value in effort["memory_MB"].items()},
            peak_memory_MB=float(effort["peak_memory_MB"]),
        ),
        bodies=None,
    )


def solved_in(folder: Path) -> Mapping[str, Any]:
    """What `solved.json` of a folder says.

    Raises
    ------
    InputError
        If there is none, or one of another layout, and what to do.
    """
    path = folder / SOLVED
    record = read_json(path)
    found = record.get("schema") if isinstance(record, Mapping) else None
    if not isinstance(record, Mapping) or found != SCHEMA:
        raise InputError(f"{path}: its layout is {found}, not {SCHEMA}; solve it again")
    return record


def stored_case(folder: Path, record: Mapping[str, Any]) -> Case:
    """The case of a record, with the profiles that were stored beside it in place of the files that it was given."""
    case = case_from_record({name: value for name, value in record.items() if name not in FOUND_INPUTS})
    files = {}
    for body, spec in case.profiles.items():
        name = file_of_identity(spec)
        if name is None and (is_known(spec) or is_short_form(spec)):
            continue
        if name is None or PureWindowsPath(name).name != name:
            raise InputError(
                f"{folder}: {body} is {spec!r:.80}; allowed is the name of a file beside the result, with @"
            )
        files[body] = str(folder / PROFILES / body / name)
    return case.with_profiles(files)
