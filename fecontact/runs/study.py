"""Many cases: each solved once, kept as it is finished, and told of in tables, figures and reports."""

from __future__ import annotations

import contextlib
import math
import secrets
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from fecontact.case import INPUTS, Case, unusual
from fecontact.criteria import Creep, Criteria
from fecontact.errors import FecontactError, InputError, failed, usable
from fecontact.files import read_json, write_text
from fecontact.jobs.engine import RunSettings, finish, open_run
from fecontact.jobs.remaining import Progress, duration
from fecontact.jobs.workers import Done, default_workers
from fecontact.outputs.cases import ReportedCase
from fecontact.outputs.documents import (
    ShownPair,
    most_used,
    reported_case,
    study_figures,
    write_study_report,
    write_tables,
)
from fecontact.outputs.figures.case import case_figure
from fecontact.outputs.figures.relief import relief_picture
from fecontact.outputs.figures.study import study_figure
from fecontact.outputs.records.results import Row, input_columns, read_row, result_record, versions
from fecontact.outputs.tables import VARIED, short_name
from fecontact.outputs.words import case_words, verdict_reason
from fecontact.packages import require_finite_elements
from fecontact.profiles.curve import Profile
from fecontact.profiles.library import profile_identity
from fecontact.profiles.resolve import resolve_rail
from fecontact.regression.checks import Check, reports
from fecontact.runs.casefile import Study, kinds, load_study
from fecontact.runs.identity import case_id, with_absolute_paths
from fecontact.runs.store import ROW, Solving, Told, case_folder, job_of, keep_solved, keep_told, read_case, seal_case
from fecontact.solving.placing import place_case
from fecontact.solving.position import (
    START_SECONDS,
    cpu_seconds,
    memory_GB,
    preview,
    preview_to_solve,
    times_by_yielding,
)
from fecontact.solving.solve import CaseResult, SharedLoads

# --- About what time and memory many cases take, from a few of them that are placed and expected.

# Each takes 0.1 to 0.6 s.
_MOST_SEEN = 3
_REFINED = 3.0
"""Ratio of unknowns for a verdict that stays open: all meshes over the first ones, where the limit allows."""
Item = TypeVar("Item")


@dataclass(frozen=True, kw_only=True)
class Cost:
    """About what a study or a map takes, on an idle machine.

    Attributes
    ----------
    seconds, memory_GB
        Of the whole and of its largest case, if every verdict is clear on its first meshes.
    most_seconds, most_memory_GB
        Of the whole and of its largest case with finer meshes, where verdicts stay open: these go on up to as many
        unknowns as cases may have, however few the first meshes have.
    available_GB
        Memory that is free now.
    """

    workers: int
    seconds: float
    memory_GB: float
    most_seconds: float
    most_memory_GB: float
    available_GB: float

    @property
    def words(self) -> tuple[str, ...]:
        """Time and memory in words, and whether there is too little memory."""
        workers = f"{self.workers} worker{'s' * (self.workers != 1)}"
        expected = (
            f"about {duration(self.seconds)} with {workers} and {self.memory_GB:.1f} GB per worker; up to"
            f" {duration(self.most_seconds)} and {self.most_memory_GB:.1f} GB where verdicts stay open"
        )
        if self.most_memory_GB * self.workers <= self.available_GB:
            return (expected,)
        return (expected, f"{self.available_GB:.1f} GB are available: fewer --workers may be needed")


# CPU seconds of files, pictures and reports: of each case or cell by its worker, and of all of them at the end. Of
# S1002 on 60E1 under 100 kN a case alone took 2.7, 2.9 and 3.4 s, studies of 3 and 9 cases 7.3 and 15 s, maps of as
# many positions, with one load each, 4.0 and 7.6 s.
CASE_FILES_S, STUDY_FILES_S, MAP_FILES_S = (0.0, 2.8), (1.3, 3.3), (0.6, 2.2)
# Part of the solution that a further load of a position takes, on meshes that it shares; of a map with its load limits.
# 2 and 4 loads a position took 0.53 to 0.67 and 0.54 to 0.64 of what they would take one by one.
_SHARING = 0.5


def cost_of(
    cases: Sequence[Case],
    workers: int,
    *,
    further: tuple[float, float] = (0.0, 0.0),
    files: tuple[float, float] = (0.0, 0.0),
) -> Cost | None:
    """What all cases take together, so many at a time; None where none of those that are looked at can be solved.

    Loads of a position share meshes. `further` has how many loads the limits of a map take for the lines of measured
    points, about and at most; `files` the seconds of what is written of each case, and of all at the end.
    """
    import psutil

    seen = []
    for case in spread(cases, _MOST_SEEN):
        # what cannot be solved says so when it is its turn
        with suppress(FecontactError):
            seen.append(preview_to_solve(case))
    if not seen:
        return None
    first = [one.degrees_of_freedom for one in seen]
    finest = [max(one.degrees_of_freedom, one.case.most_unknowns) for one in seen]
    most = [min(_REFINED * unknowns, last) for unknowns, last in zip(first, finest, strict=True)]
    times = [times_by_yielding(one.case, one.hertz.p0_MPa) for one in seen]
    solved_s, refined_s = (
        sum(by * cpu_seconds(unknowns) for by, unknowns in zip(times, of, strict=True)) for of in (first, most)
    )
    lines_seconds = sum(one.lines_seconds for one in seen)
    # a position with fewer others than workers is shared out among them
    alone = max(len({_position(case) for case in cases}), min(workers, len(cases)))
    solved = (alone + _SHARING * (len(cases) - alone)) / len(seen) / workers
    on_lines = len(cases) / len(seen) / workers * lines_seconds
    of_limits, of_limits_most = (loads * lines_seconds / len(seen) / workers for loads in further)
    beside = START_SECONDS + len(cases) * files[0] / workers + files[1]
    return Cost(
        workers=workers,
        seconds=beside + solved * solved_s + on_lines + of_limits,
        memory_GB=memory_GB(max(first)),
        most_seconds=beside + solved * refined_s + on_lines + of_limits_most,
        most_memory_GB=memory_GB(max(finest)),
        available_GB=psutil.virtual_memory().available / 1e9,
    )


# A forecast takes 0.1 to 0.6 s; among more positions the last one is a small part of the whole.
_MOST_FORECAST = 24


def longest_first(cases: Mapping[str, Case], workers: int) -> list[str]:
    """Names of positions, those first that will take longest, so that no worker waits long for the last one.

    They stay in their order where that saves nothing: on one worker, with a worker for each, or where they are many.
    """
    if not 1 < workers < len(cases) <= _MOST_FORECAST:
        return list(cases)
    seconds = dict.fromkeys(cases, 0.0)
    for name, case in cases.items():
        # what cannot be solved takes no time, and says so when it is its turn
        with suppress(FecontactError):
            seconds[name] = preview(case).cpu_seconds
    return sorted(cases, key=lambda name: -seconds[name])


def spread(items: Sequence[Item], most: int) -> list[Item]:
    """So many of some items at most, from the first to the last."""
    step = max(1.0, (len(items) - 1) / (most - 1))
    return [items[round(number * step)] for number in range(min(len(items), most))]


# --- A study looked at before it is solved: whether its inputs are right, and about what it costs.

# A position takes 15 ms; of more than these, some that are spread over the study.
_MOST_PLACED = 40


@dataclass(frozen=True, kw_only=True)
class StudyCheck:
    """What a study asks for.

    Attributes
    ----------
    varied
        The inputs that are not the same in all cases, with how many values they have.
    cost
        None where something is wrong.
    positions, placed
        Positions of a wheel on a rail among the cases, and how many of them were tried.
    problems
        What is wrong with profiles, or with the first position in which the wheel does not run on the rail.
    notes
        What is allowed and not usual.
    """

    cases: int
    varied: tuple[str, ...]
    cost: Cost | None
    positions: int
    placed: int
    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()


def check_study(path: Path, *, quick: bool = False) -> StudyCheck:
    """Read a study file and all its profiles, and place its wheels; nothing is meshed or solved.

    Raises
    ------
    InputError
        As `load_study` does.
    """
    cases = load_study(path, quick=quick).cases
    positions = _positions(cases)
    problems = tuple(_profile_problems(cases))
    placed, problem = (0, None) if problems else _place(positions)
    problems = problems if problem is None else (problem,)
    return StudyCheck(
        cases=len(cases),
        varied=tuple(_varied(cases)),
        cost=None if problems else cost_of(cases, min(default_workers(), len(cases)), files=STUDY_FILES_S),
        positions=len(positions),
        placed=placed,
        problems=problems,
        notes=unusual(cases),
    )


def _varied(cases: tuple[Case, ...]) -> Iterable[str]:
    for slot in INPUTS:
        values = {slot.of(case) for case in cases}
        if len(values) > 1:
            yield f"{len(values)} values of {slot.key}"


# A row has columns for these; what only judges does not make another case.
_SHOWN = ("rail", "wheel", "inclination", "lateral_shift_mm", "load_kN", "distance_mm")
_JUDGING = ("verdict", "creep")


def varied_words(cases: Sequence[Case]) -> list[str]:
    """For each case the inputs that are not the same in all cases of a pair, in words, but those in every table.

    What all cases of a pair have alike is known by the pair.
    """
    pairs = [(case.rail, case.wheel) for case in cases]
    found: dict[tuple[str, tuple[str, ...]], str] = {}
    for slot in INPUTS:
        own = (slot.of(case) for case in cases)
        values = tuple("none" if value is None else slot.input.shown(value) for value in own)
        varies = len(set(zip(pairs, values, strict=True))) > len(set(pairs))
        if varies and slot.key not in _SHOWN and slot.group not in _JUDGING:
            same = (slot.key, values)
            # what both bodies have alike is told once
            found[same] = slot.key if same in found else f"{slot.body} {slot.key}".strip()
    return [", ".join(f"{name} {values[at]}" for (_, values), name in found.items()) for at in range(len(cases))]


def _profile_problems(cases: tuple[Case, ...]) -> Iterable[str]:
    from fecontact.profiles.resolve import resolve_wheel

    for name, reading in dict.fromkeys((case.rail, case.rail_file) for case in cases):
        yield from _problem(partial(resolve_rail, name, reading))
    for name, reading in dict.fromkeys((case.wheel, case.wheel_file) for case in cases):
        yield from _problem(partial(resolve_wheel, name, reading))


# groups of inputs that say where a wheel is on its rail
_WHERE = ("pair", "position", "wheelset", "standing", "irregular", "profiles")


def _positions(cases: tuple[Case, ...]) -> list[Case]:
    """A case for each position of a wheel on a rail, whatever the load is."""
    where = [slot for slot in INPUTS if slot.group in _WHERE]
    return list({tuple(slot.of(case) for slot in where): case for case in cases}.values())


def _place(positions: Sequence[Case]) -> tuple[int, str | None]:
    """Place some positions, up to the first that is none; how many were tried, and what is wrong with the last one."""

    chosen = spread(positions, _MOST_PLACED)
    for number, case in enumerate(chosen, start=1):
        for problem in _problem(partial(place_case, case)):
            return number, problem
    return len(chosen), None


def _problem(read: Callable[[], object]) -> Iterable[str]:
    try:
        read()
    except InputError as error:
        yield str(error)


# --- `report.html` of what was solved or judged: which cases it shows, and pictures of the pair and of new verdicts.

# Each takes up to a second to draw, and judging shall not take minutes.
_MOST_JUDGED_PICTURES = 12


def study_pair(study: Study, rows: Sequence[Row]) -> ShownPair | None:
    """The pair of the case that uses most of a limit; None where no case can be used."""
    for row in most_used(_usable(rows), 1):
        case = next(case for case in study.cases if case_id(case) == row["id"])
        return ShownPair(row=row, placement=place_case(case))
    return None


def report_study(
    study: Study,
    rows: Sequence[Row],
    out: Path,
    criteria: Criteria | None,
    conclusion: str | None,
    shown: ShownPair | None,
) -> Path:
    """Write the report of a study that lies in `out`."""
    return write_study_report(
        study.name,
        [reported_case(row, case_folder(out, str(row["id"]))) for row in rows],
        out,
        shown=shown,
        criteria=criteria,
        conclusion=conclusion,
    )


def keep_with_report(result: CaseResult, told: Told, folder: Path) -> Path:
    """Put the files of a solved case into a folder, as `load` and `judge` read them, with its report."""
    keep_solved(result, result.case, folder)
    keep_told(result, told, folder, svg=True)
    seal_case(result.case, folder)
    relief = relief_picture(result.load, result.placement)
    return write_study_report(
        case_words(result.case, result.placement),
        [ReportedCase(row=told.row, record=told.record, picture=folder / "case.png", relief=relief)],
        folder,
        shown=ShownPair(row=told.row, placement=result.placement),
        criteria=result.case.criteria,
    )


def report_judged(
    name: str, rows: Sequence[Row], folders: Sequence[Path], out: Path, criteria: Criteria, creep: Creep | None
) -> Path:
    """Write the report, and the picture, of rows that were judged by other criteria; their cases are in the folders.

    Pictures of cases have the new verdicts; they are in the report alone.
    """
    rails = {str(row["rail"]) for row in rows}
    most = most_used(_usable(rows), _MOST_JUDGED_PICTURES)
    shown = None
    with TemporaryDirectory() as temporary:
        cases = []
        for row, folder in zip(rows, folders, strict=True):
            if row not in most:
                kept = reported_case(row, folder)
                cases.append(ReportedCase(row=row, record={"solver": kept.record.get("solver", {})}))
                continue
            result = read_case(folder, criteria=criteria, creep=creep)
            path = case_figure(result, Path(temporary) / str(row["id"]) / "case.png", svg=False)
            relief = relief_picture(result.load, result.placement) if len(rows) == 1 else None
            cases.append(ReportedCase(row=row, record=result_record(result), picture=path, relief=relief))
            if row is most[0]:
                shown = ShownPair(row=row, placement=result.placement)
        rail = shown.placement.rail.profile if shown is not None and len(rails) == 1 else None
        # a single case is no line over the shift
        if sum(row.get("fe_p_max_MPa") is not None for row in rows) > 1:
            study_figure(rows, out / "study.png", rail, criteria)
        return write_study_report(
            f"{name}, judged again",
            cases,
            out,
            shown=shown,
            criteria=criteria,
            pictures="judge a case alone to see another one",
        )


def _usable(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if usable(row)]


# --- Many cases: each solved once, kept as it is finished, and told of in tables, figures and collections.

_TABLES_EVERY_S = 2.0
_ANY_LOAD_N = 100e3


@dataclass(frozen=True, kw_only=True)
class StudyOutcome:
    """What a study gave.

    Attributes
    ----------
    rows
        One a case, in the order of the study's cases.
    conclusion
        The text of the study's conclusion; None if it has none, and for a part.
    collections
        Names of the ParaView collections over the lateral shift.
    reused
        Ids of the cases that were finished before.
    recomputed
        Why finished cases were solved, or judged, again, by id.
    """

    rows: tuple[Row, ...]
    conclusion: str | None
    collections: tuple[str, ...] = ()
    reused: tuple[str, ...] = ()
    recomputed: dict[str, str] = field(default_factory=dict)

    @property
    def all_converged(self) -> bool:
        """Whether every case gave a result that may be used."""
        return all(usable(row) for row in self.rows)


def run_study(
    study: Study,
    out: Path,
    *,
    settings: RunSettings | None = None,
    progress: Progress | None = None,
) -> StudyOutcome:
    """Solve all cases of a study that are not finished and write its outputs below `out`.

    A case that cannot be solved becomes a row that says why; the others go on. Cases are kept as they finish, so that
    the same call goes on where an interrupted one stopped. Cases are solved in processes of their own, which do not
    import the script that calls this.

    Parameters
    ----------
    progress
        Called with the number of finished cases, the number of cases, and what is under way.

    Raises
    ------
    InputError
        If another run has the folder, the cluster cannot be used, or two cases differ in criteria or creepages alone.
    """
    settings = settings or RunSettings()
    command = {"workers": settings.workers, "threads": settings.threads, "scheduler": settings.scheduler}
    command["part"] = settings.part and f"{settings.part[0]}/{settings.part[1]}"
    for case in study.cases:
        case.creep.refuse_unheard()
    named = [(case_id(case), case) for case in study.cases]
    cases = _by_name(named)
    solved = {name: with_absolute_paths(case) if settings.scheduler else case for name, case in cases.items()}
    shared = _shared(solved)
    own = _own_part(settings, {name: where for name, (where, _) in shared.items()})
    table = _Table(study.name, [(name, case) for name, case in named if name in set(own)], len(named), out, settings)
    with open_run(out, out / "cases", settings, progress) as by:
        jobs = [
            job_of(
                solved[name],
                case_folder(out, name),
                Solving(case=solved[name], name=name, settings=command, loads=shared[name][1]),
                label=_label(cases[name], study.cases),
                group=shared[name][0],
            )
            for name in _ordered({name: shared[name][0] for name in own}, solved, by.crew.workers)
        ]
        try:
            finish(jobs, by, on_done=table.done)
        finally:
            with contextlib.suppress(OSError):
                table.write()
        rows = table.write()
        collections: tuple[str, ...] = ()
        conclusion: str | None = None
        if settings.part is None:
            criteria = _only_criteria(study.cases)
            shown = study_pair(study, rows)
            collections = study_figures(rows, out, _only_rail(study.cases), criteria)
            conclusion = _conclude(study, rows, out)
            report_study(study, rows, out, criteria, conclusion, shown)
    return StudyOutcome(
        rows=tuple(rows),
        conclusion=conclusion,
        collections=collections,
        reused=tuple(by.reused),
        recomputed=by.recomputed,
    )


def _shared(cases: Mapping[str, Case]) -> dict[str, tuple[str, SharedLoads | None]]:
    """For each case a name of its position, and the loads there that share their meshes; None for one alone."""
    positions: dict[Case, dict[str, float]] = {}
    for name, case in cases.items():
        positions.setdefault(_position(case), {})[name] = case.load_N
    found: dict[str, tuple[str, SharedLoads | None]] = {}
    for own in positions.values():
        first, loads = next(iter(own)), tuple(sorted(own.values()))
        together = SharedLoads(case=cases[first], loads_N=loads) if len(own) > 1 else None
        # loads that share a mesh come one after the other
        found |= dict.fromkeys(sorted(own, key=own.__getitem__), (first, together))
    return found


def _position(case: Case) -> Case:
    """The same for all loads that share their meshes: a roll that is found under the load is another one for each."""
    with_load = case.roll == "loaded" and case.roll_load_N is None
    return case if with_load else replace(case, load_N=_ANY_LOAD_N)


def _own_part(settings: RunSettings, positions: Mapping[str, str]) -> list[str]:
    """The cases of a part: all loads of a position are in one where there are as many positions as parts."""
    names = list(dict.fromkeys(positions.values()))
    if settings.part is not None and settings.part[1] > len(names):
        return list(settings.own_part(list(positions)))
    own = set(settings.own_part(names))
    return [name for name, where in positions.items() if where in own]


def _ordered(positions: Mapping[str, str], cases: Mapping[str, Case], workers: int) -> list[str]:
    """Names of cases by their positions, the longest first; loads of one stay in their order."""
    of_position: dict[str, list[str]] = {}
    for name, where in positions.items():
        of_position.setdefault(where, []).append(name)
    largest = {
        where: max((cases[name] for name in names), key=lambda case: case.load_N)
        for where, names in of_position.items()
    }
    return [name for where in longest_first(largest, workers) for name in of_position[where]]


def _label(case: Case, cases: tuple[Case, ...]) -> str:
    """What a case is called while it is solved: position and load, and the pair where there are several."""
    pair = ""
    if len({(one.rail, one.wheel) for one in cases}) > 1:
        rail, wheel = (short_name(profile_identity(spec)) for spec in (case.rail, case.wheel))
        pair = f"{wheel} on {rail} "
    along = f" at {case.distance_mm:g} mm" if case.irregularities else ""
    return f"{pair}{case.lateral_shift_mm:+z.2f} mm {case.load_N / 1e3:g} kN{along}"


def _by_name(named: list[tuple[str, Case]]) -> dict[str, Case]:
    cases: dict[str, Case] = {}
    for name, case in named:
        first = cases.setdefault(name, case)
        if (first.criteria, first.creep) != (case.criteria, case.creep):
            what = "criteria" if first.criteria != case.criteria else "friction or creepages"
            raise InputError(
                f"case {name} is there with different {what}; a case is solved once: give each by one set of"
                " them, and judge the results again by others (fecontact judge)"
            )
    return cases


class _Table:
    """The rows of a study's cases as they are finished."""

    def __init__(self, study: str, named: list[tuple[str, Case]], cases: int, out: Path, settings: RunSettings) -> None:
        self._study, self._named, self._cases, self._out = study, named, cases, out
        self._stem = f"study{settings.part_suffix}"
        self._rows: dict[str, Row] = {}
        self._inputs = dict(named)
        told = varied_words([case for _, case in named])
        self._varied = {name: words for (name, _), words in zip(named, told, strict=True) if words}
        self._written = time.monotonic()

    def done(self, done: Done) -> None:
        """Take what came of a case; write the tables if that was some time ago."""
        name = done.name
        if done.failure is None:
            self._rows[name] = read_row(case_folder(self._out, name) / ROW)
        else:
            self._rows[name] = {"id": name, "status": failed(done.failure), **input_columns(self._inputs[name])}
        if name in self._varied:
            self._rows[name] = {**self._rows[name], VARIED: self._varied[name]}
        if time.monotonic() - self._written > _TABLES_EVERY_S:
            # a full disk now may have room at the end
            with contextlib.suppress(OSError):
                self.write()
            self._written = time.monotonic()

    def write(self) -> list[Row]:
        """Write the tables of the study, or of the part; returns their rows in the order of the study."""
        rows = [self._rows[name] for name, _ in self._named if name in self._rows]
        write_tables(self._study, self._cases, rows, self._out / self._stem)
        return rows


def _only_rail(cases: tuple[Case, ...]) -> Profile | None:
    """The rail of all cases, if they have the same one and it can be read."""
    rails = {(case.rail, case.rail_file) for case in cases}
    if len(rails) > 1:
        return None
    try:
        return resolve_rail(*rails.pop())
    except InputError:
        return None


def _only_criteria(cases: tuple[Case, ...]) -> Criteria | None:
    """The criteria of all cases, if they have the same."""
    found = {case.criteria for case in cases}
    return found.pop() if len(found) == 1 else None


def _conclude(study: Study, rows: list[Row], out: Path) -> str | None:
    if study.conclude is None:
        return None
    unusable = sum(not usable(row) for row in rows)
    if unusable:
        return f"No conclusion: {unusable} of {len(rows)} cases gave no usable result."
    return study.conclude(rows, out)


# --- Many cases from Python, as `fecontact run` solves them.


def run(
    study: str | Path | Study | Iterable[Case],
    out: str | Path,
    *,
    quick: bool = False,
    workers: int | None = None,
    threads: int = 1,
    force: bool = False,
    progress: Progress | None = None,
) -> StudyOutcome:
    """Solve many cases at a time, each once, and write their tables, pictures and ParaView files.

    The same call goes on where an interrupted one stopped. `outcome.rows` is a list of flat dictionaries, one a case,
    with units in their keys, as `pandas.DataFrame` takes it.

    Parameters
    ----------
    study
        Cases, or a study file: a script with `cases(quick=False)`, or TOML.
    out
        Folder for the results; `fecontact.load` reads them back.
    quick
        The small version of a study file.
    workers
        Cases at a time; as many as there are cores and 2 GB of memory for each, if not given.
    threads
        Threads that each case computes on.
    force
        Solve finished cases again, and write into a folder that holds other results.
    progress
        Called with the number of finished cases, the number of cases, and what is under way.

    Raises
    ------
    InputError
        If the study cannot be read, or another run has the folder. A case that cannot be solved is not an error but a
        row whose status says why.
    """
    require_finite_elements()
    settings = RunSettings(workers=workers, threads=threads, force=force)
    found = _study(study, Path(out), quick)
    prepare_for_study(Path(out), found.name, force=force)
    return run_study(found, Path(out), settings=settings, progress=progress)


def _study(study: str | Path | Study | Iterable[Case], out: Path, quick: bool) -> Study:
    if isinstance(study, Study):
        return study
    if isinstance(study, str | Path):
        return load_study(study, quick=quick)
    cases = tuple(study)
    if not cases or not all(isinstance(case, Case) for case in cases):
        raise InputError("run: give at least one Case and nothing else, or the file of a study")
    return Study(name=out.name, cases=cases)


# --- A first example: a position at which Hertz's peak is right and its patch is not, and a sphere, where all is.

_RADIUS_MM = 460.0
POSITION = Case(lateral_shift_mm=3.0, refine="never")
# two cylinders of one radius that cross at right angles touch as a sphere of that radius touches a plane
SPHERE = Case(
    rail=f"circle:{_RADIUS_MM:g}",
    wheel=f"cylinder:{_RADIUS_MM:g}",
    inclination_rad=0.0,
    refine="never",
)


def demo_study() -> Study:
    """Both cases, on first meshes alone."""
    return Study(name="demo", cases=(POSITION, SPHERE))


def exact_peak_MPa() -> float:
    """Peak pressure of the sphere in closed form (Johnson 1985, eq. 3.25): (6 F E*^2 / (pi^3 R^2))^(1/3)."""
    return float((6.0 * SPHERE.load_N * SPHERE.contact_modulus_MPa**2 / (math.pi**3 * _RADIUS_MM**2)) ** (1.0 / 3.0))


def demo_words(out: Path, outcome: StudyOutcome) -> str:
    """What came out, and where the files are."""
    if not outcome.all_converged:
        return f"Not all could be solved; {out / 'study.csv'} says why"
    folders = {case: case_folder(out, case_id(case)) for case in (POSITION, SPHERE)}
    result, sphere = (read_case(folder) for folder in folders.values())
    exact, found = exact_peak_MPa(), sphere.comparison.fe.p_max_MPa
    where, verdict = folders[POSITION], result.load.answer.answer
    return "\n".join(
        (
            f"Sphere of {_RADIUS_MM:g} mm on a plane, {SPHERE.load_N / 1e3:g} kN: the finite elements' peak pressure is"
            f" {found:.1f} MPa, the exact one {exact:.1f} MPa: {1e2 * (found / exact - 1.0):+.2f} %.",
            f"S1002 on 60E1 1:40, shifted by {POSITION.lateral_shift_mm:g} mm, {POSITION.load_N / 1e3:g} kN: Hertz"
            f" {verdict}.",
            f"  {verdict_reason(result.load)}",
            f"  Peak pressure: Hertz {result.comparison.hertz.p_max_MPa:.0f} MPa, finite elements"
            f" {result.comparison.fe.p_max_MPa:.0f} MPa.",
            "",
            f"Report:   {out / 'report.html'}",
            f"Picture:  {where / 'case.png'}",
            f"ParaView: {where / 'case.vtm'}",
            f"Table:    {out / 'study.csv'}",
            "Next: fecontact init FOLDER for a study of your own, fecontact solve --help-all for all inputs",
        )
    )


# --- Studies run and their numbers checked against references, all of them in one table.


@dataclass(frozen=True, kw_only=True)
class Validation:
    """Checks of all studies, studies with cases or checks without a usable result, and the file of the table."""

    checks: tuple[Check, ...]
    unusable: tuple[str, ...]
    path: Path

    @property
    def failed(self) -> tuple[Check, ...]:
        """Checks outside their limits."""
        return tuple(check for check in self.checks if not check.passed)


def validate(
    studies: Sequence[Study],
    out: Path,
    *,
    table: Path | None = None,
    workers: int | None = None,
    watched: Callable[[str], AbstractContextManager[Progress]],
) -> Validation:
    """Run studies that have checks, and write a table of them and a page for each; other studies' lines are kept.

    Parameters
    ----------
    out
        Folder for the results, one folder a study.
    table
        Markdown file for a line of each study; VALIDATION.md in `out`, if not given. Their pages are beside it.
    watched
        Who hears of the progress of a study, by its name.
    """
    found: dict[str, list[Check]] = {}
    unusable = []
    for study in studies:
        with watched(study.name) as progress:
            outcome = run_study(study, out / study.name, settings=RunSettings(workers=workers), progress=progress)
        bad = [str(row["id"]) for row in outcome.rows if not usable(row)]
        if bad:
            unusable.append(f"{study.name}: {', '.join(bad)}")
        assert study.checks is not None
        try:
            found[study.name] = study.checks([row for row in outcome.rows if usable(row)])
        except FecontactError as error:
            # hours of other studies are not lost with one
            unusable.append(f"{study.name}: its checks: {error}")
    path = table or out / "VALIDATION.md"
    asked = {study.name: study.question for study in studies}
    before = path.read_text("utf-8") if path.exists() else ""
    summary, *pages = reports(found, asked, versions(), unusable, before).items()
    for place, text in ((path.name, summary[1]), *pages):
        write_text(path.parent / place, text)
    checks = tuple(check for own in found.values() for check in own)
    return Validation(checks=checks, unusable=tuple(unusable), path=path)


def checked_studies(paths: Sequence[Path], *, quick: bool = False) -> tuple[Study, ...]:
    """Those of some study files that have checks.

    Raises
    ------
    InputError
        If none has, or a file is no study.
    """
    loaded = [load_study(path, quick=quick) for path in paths]
    found = tuple(study for study in loaded if study.checks is not None)
    if not found:
        raise InputError("validate: none of the studies has a function checks(rows); give scripts of studies/ that do")
    return found


# --- The folder of results before anything is solved: whether it can be written, and whether other results are in it.


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
