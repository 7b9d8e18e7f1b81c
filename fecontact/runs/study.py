"""Many cases: each solved once, kept as it is finished, and told of in tables, figures and reports."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fecontact.case import Case
from fecontact.criteria import Criteria
from fecontact.errors import InputError, failed, usable
from fecontact.jobs.engine import RunSettings, finish, open_run
from fecontact.jobs.remaining import Progress
from fecontact.jobs.workers import Done
from fecontact.outputs.pair_names import VARIED, short_name
from fecontact.outputs.records.results import Row, input_columns, read_row
from fecontact.outputs.study_files import study_figures, write_tables
from fecontact.packages import require_finite_elements
from fecontact.profiles.curve import Profile
from fecontact.profiles.library import profile_identity
from fecontact.profiles.resolve import resolve_rail
from fecontact.runs.casefile import Study, load_study
from fecontact.runs.cost import any_load, longest_first
from fecontact.runs.folder import prepare_for_study
from fecontact.runs.identity import case_id, with_absolute_paths
from fecontact.runs.report import report_study, study_pair
from fecontact.runs.store import ROW, Solving, case_folder, job_of
from fecontact.runs.varied import varied_words
from fecontact.solving.solve import SharedLoads

# --- Many cases: each solved once, kept as it is finished, and told of in tables, figures and collections.

_TABLES_EVERY_S = 2.0


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
        positions.setdefault(any_load(case), {})[name] = case.load_N
    found: dict[str, tuple[str, SharedLoads | None]] = {}
    for own in positions.values():
        first, loads = next(iter(own)), tuple(sorted(own.values()))
        together = SharedLoads(case=cases[first], loads_N=loads) if len(own) > 1 else None
        # loads that share a mesh come one after the other
        found |= dict.fromkeys(sorted(own, key=own.__getitem__), (first, together))
    return found


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
