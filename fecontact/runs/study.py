"""Studies of many cases: each case solved once, and shown in tables, figures and reports.

Every case is kept when it is finished.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from fecontact.case import Case
from fecontact.criteria import Criteria
from fecontact.errors import InputError, describe_failure, is_usable_status
from fecontact.inputs.texts import count_text
from fecontact.jobs.engine import RunSettings, finish_jobs, open_run
from fecontact.jobs.remaining import Progress
from fecontact.jobs.workers import JobOutcome
from fecontact.outputs.pair_names import VARIED_COLUMN, short_name
from fecontact.outputs.records.results import Row, input_columns, read_row
from fecontact.outputs.study_files import study_figures, write_tables
from fecontact.packages import require_finite_elements
from fecontact.profiles.curve import Profile
from fecontact.profiles.library import profile_identity
from fecontact.profiles.resolve import resolve_rail
from fecontact.runs.casefile import Study, load_study
from fecontact.runs.cost import sort_longest_first, use_common_load
from fecontact.runs.folder import prepare_for_study
from fecontact.runs.identity import make_case_id, make_paths_absolute
from fecontact.runs.report import report_study, study_pair
from fecontact.runs.store import ROW_FILE, CaseWork, make_job, name_case_folder
from fecontact.runs.varied import describe_varied_inputs
from fecontact.solving.solve import SharedLoads

# --- Many cases: each is solved once, kept when it is finished, and shown in tables, figures and collections.

_TABLE_INTERVAL_S = 2.0


@dataclass(frozen=True, kw_only=True)
class StudyOutcome:
    """Results of a study.

    Attributes
    ----------
    rows
        A row per case, in the order of the study's cases.
    conclusion
        Text of the study's conclusion; None for a study without a conclusion, and for a part.
    collections
        Names of the ParaView collections over the lateral shift.
    reused
        Ids of the cases that were finished before.
    recomputed
        Reasons for solving or judging finished cases again, by id.
    """

    rows: tuple[Row, ...]
    conclusion: str | None
    collections: tuple[str, ...] = ()
    reused: tuple[str, ...] = ()
    recomputed: dict[str, str] = field(default_factory=dict)

    @property
    def all_converged(self) -> bool:
        """Whether every case has a usable result."""
        return all(is_usable_status(row) for row in self.rows)


def run_study(
    study: Study,
    out: Path,
    *,
    settings: RunSettings | None = None,
    progress: Progress | None = None,
) -> StudyOutcome:
    """Solve all unfinished cases of a study, and write its outputs below `out`.

    If a case cannot be solved, the status of its row gives the reason, and the other cases continue. Cases are kept
    when they finish, so that an interrupted run resumes with the same call. Cases are solved in separate processes,
    which do not import the script that calls this function.

    Parameters
    ----------
    study
        Study.
    out
        Folder for the results.
    settings
        Settings of the run; the defaults if not given.
    progress
        Receives the number of finished cases, the number of cases, and the present activity.

    Returns
    -------
    StudyOutcome
        Rows, conclusion and collections.

    Raises
    ------
    InputError
        If another run has the folder, the cluster cannot be used, or two cases differ only in criteria or creepages.
    """
    settings = settings or RunSettings()
    command = {"workers": settings.workers, "threads": settings.threads, "scheduler": settings.scheduler}
    command["part"] = settings.part and f"{settings.part[0]}/{settings.part[1]}"
    for case in study.cases:
        case.creep.refuse_unheard()
    named_cases = [(make_case_id(case), case) for case in study.cases]
    cases = _collect_cases(named_cases)
    solved_cases = {name: make_paths_absolute(case) if settings.scheduler else case for name, case in cases.items()}
    shared_loads = _share_loads(solved_cases)
    own_names = _select_part(settings, {name: position_name for name, (position_name, _) in shared_loads.items()})
    table = _Table(
        study.name,
        [(name, case) for name, case in named_cases if name in set(own_names)],
        len(named_cases),
        out,
        settings,
    )
    with open_run(out, out / "cases", settings, progress) as study_run:
        jobs = [
            make_job(
                solved_cases[name],
                name_case_folder(out, name),
                CaseWork(case=solved_cases[name], name=name, settings=command, loads=shared_loads[name][1]),
                label=_label_case(cases[name], study.cases),
                group=shared_loads[name][0],
            )
            for name in _order_cases(
                {name: shared_loads[name][0] for name in own_names}, solved_cases, study_run.crew.workers
            )
        ]
        try:
            finish_jobs(jobs, study_run, on_done=table.receive)
        finally:
            with contextlib.suppress(OSError):
                table.write()
        rows = table.write()
        collections: tuple[str, ...] = ()
        conclusion: str | None = None
        if settings.part is None:
            criteria = _common_criteria(study.cases)
            shown_pair = study_pair(study, rows)
            collections = study_figures(rows, out, _common_rail(study.cases), criteria)
            conclusion = _write_conclusion(study, rows, out)
            report_study(study, rows, out, criteria, conclusion, shown_pair)
    return StudyOutcome(
        rows=tuple(rows),
        conclusion=conclusion,
        collections=collections,
        reused=tuple(study_run.reused),
        recomputed=study_run.recomputed,
    )


def _share_loads(cases: Mapping[str, Case]) -> dict[str, tuple[str, SharedLoads | None]]:
    """Name of the position of each case, and the loads with shared meshes there.

    The loads are None for a position with a single load.
    """
    positions: dict[Case, dict[str, float]] = {}
    for name, case in cases.items():
        positions.setdefault(use_common_load(case), {})[name] = case.load_N
    positions_by_case: dict[str, tuple[str, SharedLoads | None]] = {}
    for loads_by_name in positions.values():
        first, loads = next(iter(loads_by_name)), tuple(sorted(loads_by_name.values()))
        shared_loads = SharedLoads(case=cases[first], loads_N=loads) if len(loads_by_name) > 1 else None
        # loads that share a mesh come one after the other
        positions_by_case |= dict.fromkeys(sorted(loads_by_name, key=loads_by_name.__getitem__), (first, shared_loads))
    return positions_by_case


def _select_part(settings: RunSettings, positions: Mapping[str, str]) -> list[str]:
    """Names of the cases of a part.

    All loads of a position are in the same part if there are at least as many positions as parts.
    """
    names = list(dict.fromkeys(positions.values()))
    if settings.part is not None and settings.part[1] > len(names):
        return list(settings.select_part(list(positions)))
    own_positions = set(settings.select_part(names))
    return [name for name, position_name in positions.items() if position_name in own_positions]


def _order_cases(positions: Mapping[str, str], cases: Mapping[str, Case], workers: int) -> list[str]:
    """Names of cases by their positions, the longest first; loads of a position stay in their order."""
    names_by_position: dict[str, list[str]] = {}
    for name, position_name in positions.items():
        names_by_position.setdefault(position_name, []).append(name)
    largest = {
        position_name: max((cases[name] for name in names), key=lambda case: case.load_N)
        for position_name, names in names_by_position.items()
    }
    return [name for position_name in sort_longest_first(largest, workers) for name in names_by_position[position_name]]


def _label_case(case: Case, cases: tuple[Case, ...]) -> str:
    """Label of a case while it is solved: position and load, and the pair if there are several pairs."""
    pair = ""
    if len({(other_case.rail, other_case.wheel) for other_case in cases}) > 1:
        rail, wheel = (short_name(profile_identity(spec)) for spec in (case.rail, case.wheel))
        pair = f"{wheel} on {rail} "
    distance_text = f" at {case.distance_mm:g} mm" if case.irregularities else ""
    return f"{pair}{case.lateral_shift_mm:+z.2f} mm {case.load_N / 1e3:g} kN{distance_text}"


def _collect_cases(named_cases: list[tuple[str, Case]]) -> dict[str, Case]:
    """Cases by name, each once.

    Raises
    ------
    InputError
        If two cases differ only in criteria or creepages.
    """
    cases: dict[str, Case] = {}
    for name, case in named_cases:
        first = cases.setdefault(name, case)
        if (first.criteria, first.creep) != (case.criteria, case.creep):
            what = "criteria" if first.criteria != case.criteria else "friction or creepages"
            raise InputError(
                f"case {name} occurs with different {what}; a case is solved once: give it with one set, and judge"
                " the results by other sets with fecontact judge"
            )
    return cases


class _Table:
    """Rows of the finished cases of a study."""

    def __init__(
        self, study: str, named_cases: list[tuple[str, Case]], cases: int, out: Path, settings: RunSettings
    ) -> None:
        """Prepare an empty table.

        Parameters
        ----------
        study
            Name of the study.
        named_cases
            Names and cases of the table.
        cases
            Number of cases of the complete study.
        out
            Folder of the results.
        settings
            Settings of the run.
        """
        self._study, self._named, self._cases, self._out = study, named_cases, cases, out
        self._stem = f"study{settings.part_suffix}"
        self._rows: dict[str, Row] = {}
        self._inputs = dict(named_cases)
        varied_texts = describe_varied_inputs([case for _, case in named_cases])
        self._varied = {name: words for (name, _), words in zip(named_cases, varied_texts, strict=True) if words}
        self._written = time.monotonic()

    def receive(self, outcome: JobOutcome) -> None:
        """Take the outcome of a case; write the tables if the last time was `_TABLE_INTERVAL_S` ago."""
        name = outcome.name
        if outcome.failure is None:
            self._rows[name] = read_row(name_case_folder(self._out, name) / ROW_FILE)
        else:
            self._rows[name] = {
                "id": name,
                "status": describe_failure(outcome.failure),
                **input_columns(self._inputs[name]),
            }
        if name in self._varied:
            self._rows[name] = {**self._rows[name], VARIED_COLUMN: self._varied[name]}
        if time.monotonic() - self._written > _TABLE_INTERVAL_S:
            # a disk that is full now may have room at the end
            with contextlib.suppress(OSError):
                self.write()
            self._written = time.monotonic()

    def write(self) -> list[Row]:
        """Write the tables of the study, or of the part; returns their rows in the order of the study."""
        rows = [self._rows[name] for name, _ in self._named if name in self._rows]
        criteria_of_cases = [case.criteria for case in self._inputs.values()]
        write_tables(self._study, self._cases, rows, self._out / self._stem, criteria_of_cases)
        return rows


def _common_rail(cases: tuple[Case, ...]) -> Profile | None:
    """Rail of all cases; None if they have different rails, or if it cannot be read."""
    rails = {(case.rail, case.rail_file) for case in cases}
    if len(rails) > 1:
        return None
    try:
        return resolve_rail(*rails.pop())
    except InputError:
        return None


def _common_criteria(cases: tuple[Case, ...]) -> Criteria | None:
    """Criteria of all cases; None if the cases have different criteria."""
    distinct_criteria = {case.criteria for case in cases}
    return distinct_criteria.pop() if len(distinct_criteria) == 1 else None


def _write_conclusion(study: Study, rows: list[Row], out: Path) -> str | None:
    """Conclusion of a study; a sentence if cases without a usable result prevent it."""
    if study.conclude is None:
        return None
    unusable = sum(not is_usable_status(row) for row in rows)
    if unusable:
        return f"No conclusion: {unusable} of {count_text(len(rows), 'case')} without a usable result."
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
    """Solve many cases, and write their tables, pictures and ParaView files.

    Each case is solved once. If the run is interrupted, an equal call resumes it.

    Parameters
    ----------
    study
        Cases, or a study file: a script with `cases(quick=False)`, or TOML.
    out
        Folder for the results; `fecontact.load` reads them back.
    quick
        Whether to solve the small version of a study file.
    workers
        Number of cases at a time; if not given, a worker per core and per 2 GB of memory.
    threads
        Threads of each case.
    force
        Whether to solve finished cases again, and to write into a folder that holds other results.
    progress
        Receives the number of finished cases, the number of cases, and the present activity.

    Returns
    -------
    StudyOutcome
        Its `rows` are flat dictionaries, a dictionary per case, with units in their keys, suitable for
        `pandas.DataFrame`.

    Raises
    ------
    InputError
        If the study cannot be read, or another run has the folder. A case that cannot be solved raises no error: the
        status of its row gives the reason.

    Examples
    --------
    >>> import tempfile
    >>> import fecontact
    >>> pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outcome = fecontact.run([fecontact.Case(**pair, resolution="quick", refine="never")], folder)
    >>> [(row["status"], row["verdict_answer"]) for row in outcome.rows]
    [('converged', 'HOLDS')]
    """
    require_finite_elements()
    settings = RunSettings(workers=workers, threads=threads, force=force)
    loaded_study = _read_study(study, Path(out), quick)
    prepare_for_study(Path(out), loaded_study.name, force=force)
    return run_study(loaded_study, Path(out), settings=settings, progress=progress)


def _read_study(study: str | Path | Study | Iterable[Case], out: Path, quick: bool) -> Study:
    """Study from a file, from cases, or as given.

    Raises
    ------
    InputError
        If there is no case, or an object that is not a case.
    """
    if isinstance(study, Study):
        return study
    if isinstance(study, str | Path):
        return load_study(study, quick=quick)
    cases = tuple(study)
    if not cases or not all(isinstance(case, Case) for case in cases):
        raise InputError("run: give at least one Case and nothing else, or the file of a study")
    return Study(name=out.name, cases=cases)
