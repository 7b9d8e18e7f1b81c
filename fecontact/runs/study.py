"""Many cases: each solved once, kept as it is finished, and told of in tables, figures and collections."""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass, field
from pathlib import Path

from fecontact.case import Case
from fecontact.criteria import Criteria
from fecontact.errors import InputError
from fecontact.jobs.engine import Progress, RunSettings, finish, open_run
from fecontact.jobs.job import Done
from fecontact.outcome import failed, usable
from fecontact.outputs.records.results import Row, input_columns, read_row
from fecontact.outputs.reports.study_files import study_figures, write_tables
from fecontact.profiles.curve import Profile
from fecontact.profiles.resolve import resolve_rail
from fecontact.runs.casefile import Study
from fecontact.runs.identity import case_id, with_absolute_paths
from fecontact.runs.reports import report_study, study_pair
from fecontact.runs.store import ROW, Solving, case_folder, job_of

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
    own = settings.own_part([name for name, _ in named])
    table = _Table(study.name, [(name, case) for name, case in named if name in set(own)], len(named), out, settings)
    with open_run(out, out / "cases", settings, progress) as by:
        solved = {name: with_absolute_paths(cases[name]) if settings.scheduler else cases[name] for name in own}
        jobs = [
            job_of(
                case,
                case_folder(out, name),
                Solving(case=case, name=name, settings=command),
                label=_label(cases[name], study.cases),
            )
            for name, case in solved.items()
        ]
        try:
            finish(jobs, by, on_done=table.done)
        finally:
            with contextlib.suppress(OSError):
                table.write()
        rows = table.write()
        whole = settings.part is None
        # in a process of its own, beside the other pictures
        shown = study_pair(study, rows, out) if whole else None
        collections = study_figures(rows, out, _only_rail(study.cases), _only_criteria(study.cases)) if whole else ()
        conclusion = _conclude(study, rows, out) if whole else None
        if whole:
            report_study(study, rows, out, _only_criteria(study.cases), conclusion, shown)
    return StudyOutcome(
        rows=tuple(rows),
        conclusion=conclusion,
        collections=collections,
        reused=tuple(by.finished.reused),
        recomputed=by.finished.recomputed,
    )


def _label(case: Case, cases: tuple[Case, ...]) -> str:
    """What a case is called while it is solved: position and load, and the pair where there are several."""
    pair = "" if len({(one.rail, one.wheel) for one in cases}) == 1 else f"{case.wheel} on {case.rail} "
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
        self._written = time.monotonic()

    def done(self, done: Done) -> None:
        """Take what came of a case; write the tables if that was some time ago."""
        name = done.name
        if done.failure is None:
            self._rows[name] = read_row(case_folder(self._out, name) / ROW)
        else:
            self._rows[name] = {"id": name, "status": failed(done.failure), **input_columns(self._inputs[name])}
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
