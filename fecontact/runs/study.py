"""Many cases: solve each once, on all cores or a cluster, keep what is finished, lose nothing when one fails."""

from __future__ import annotations

import contextlib
import re
import secrets
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.jobs.job import Done, SolveInto, Task
from fecontact.jobs.lock import locked
from fecontact.jobs.provenance import case_id, makers, with_absolute_paths
from fecontact.jobs.store import kept_case, remove_leftovers, solve_into, write_case
from fecontact.jobs.workers import Crew, default_workers, process_crew, run_tasks
from fecontact.outputs.study_files import study_figures, write_tables
from fecontact.runs.casefile import Study

__all__ = ["RunSettings", "StudyOutcome", "case_id", "parse_part", "run_study", "write_case"]

Progress = Callable[[int, int, str], None]

_TABLES_EVERY_S = 2.0
_MOST_NAMES = 8


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """How a study is run; none of it changes a row.

    Attributes
    ----------
    workers
        Processes at a time; None for `workers.default_workers`.
    threads
        Threads that each case computes on; other than 1 may change the last digits of results.
    force
        Solve finished cases again.
    part
        (i, N): only every N-th case, from the i-th on.
    scheduler
        Address of a Dask scheduler whose workers are to solve.
    """

    workers: int | None = None
    threads: int = 1
    force: bool = False
    part: tuple[int, int] | None = None
    scheduler: str | None = None

    def __post_init__(self) -> None:
        for name, value in (("workers", self.workers), ("threads", self.threads)):
            if value is not None and value < 1:
                raise InputError(f"{name} is {value}; allowed: 1 and more")
        if self.part is not None and not 1 <= self.part[0] <= self.part[1]:
            raise InputError(f"part {self.part[0]}/{self.part[1]}: allowed are 1/N to N/N")


def parse_part(text: str) -> tuple[int, int]:
    """The part i of N from `i/N`."""
    match = re.fullmatch(r"(\d+)/(\d+)", text.strip())
    if match is None:
        raise InputError(f"part {text!r}: give which of how many, such as 2/4")
    return int(match[1]), int(match[2])


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
        Why finished cases were solved again, by id.
    """

    rows: tuple[dict[str, Any], ...]
    conclusion: str | None
    collections: tuple[str, ...] = ()
    reused: tuple[str, ...] = ()
    recomputed: dict[str, str] = field(default_factory=dict)

    @property
    def all_converged(self) -> bool:
        """Whether every case gave a result that may be used."""
        return all(row["status"] == "converged" for row in self.rows)


def run_study(
    study: Study,
    out: Path,
    *,
    settings: RunSettings | None = None,
    progress: Progress | None = None,
    crew: Crew | None = None,
    solve: SolveInto = solve_into,
) -> StudyOutcome:
    """Solve all cases of a study that are not finished and write its outputs below `out`.

    A case that cannot be solved becomes a row that says why; the others go on. Cases are kept as they finish, so that
    the same call goes on where an interrupted one stopped. Cases are solved in processes of their own: a script that
    calls this must do so below `if __name__ == "__main__":`.

    Parameters
    ----------
    progress
        Called with the number of finished cases, the number of cases, and what is under way.
    crew, solve
        Who solves, and what it calls to solve a case and write its files; for tests.

    Raises
    ------
    InputError
        If another run has the folder, or the cluster cannot be used.
    """
    settings = settings or RunSettings()
    names = _part([case_id(case) for case in study.cases], settings.part)
    with locked(out, settings.part) as lock, _crew(settings, lock, crew) as crew:
        if settings.part is None:
            remove_leftovers(out)
        run = _Run(study, names, out, settings, progress)
        try:
            run.reuse()
            run_tasks(run.tasks(solve), crew, run)
        except BaseException:
            # workers may have finished cases that they could not tell of any more
            with contextlib.suppress(OSError):
                run.reuse()
            raise
        finally:
            with contextlib.suppress(OSError):
                run.write()
        run.write()
        whole = settings.part is None
        collections = study_figures(run.rows(), out) if whole else ()
        conclusion = _conclude(study, run.rows(), out) if whole else None
    return StudyOutcome(
        rows=tuple(run.rows()),
        conclusion=conclusion,
        collections=collections,
        reused=tuple(run.reused),
        recomputed=run.recomputed,
    )


def _part(names: Sequence[str], part: tuple[int, int] | None) -> tuple[str, ...]:
    """Ids that a part solves, each once."""
    once = tuple(dict.fromkeys(names))
    return once if part is None else once[part[0] - 1 :: part[1]]


@contextmanager
def _crew(settings: RunSettings, lock: Path, given: Crew | None) -> Iterator[Crew]:
    if given is not None:
        yield given
    elif settings.scheduler is not None:
        from fecontact.jobs.cluster import dask_crew

        with dask_crew(settings.scheduler, lock, settings.threads) as crew:
            yield crew
    else:
        yield process_crew(settings.workers or default_workers(), settings.threads)


class _Run:
    """What is known of a study's cases while it runs, by id."""

    def __init__(
        self, study: Study, names: Sequence[str], out: Path, settings: RunSettings, progress: Progress | None
    ) -> None:
        self._study, self._names, self._out, self._settings, self._progress = study, names, out, settings, progress
        self._cases = {case_id(case): case for case in reversed(study.cases)}
        self._done: dict[str, Done] = {}
        self._written = time.monotonic()
        self.reused: list[str] = []
        self.recomputed: dict[str, str] = {}

    def reuse(self) -> None:
        """Take the cases that are finished, and say of the others why not."""
        for name in () if self._settings.force else [name for name in self._names if name not in self._done]:
            kept = kept_case(self._out, name, makers(self._cases[name]))
            if kept.record is not None:
                self._done[name] = Done(name=name, record=kept.record)
                self.reused.append(name)
            elif kept.problem is not None:
                self.recomputed[name] = kept.problem

    def tasks(self, solve: SolveInto) -> list[Task]:
        """Tasks of the cases that are not finished."""
        settings = self._settings
        told = {
            "run": secrets.token_hex(8),
            "workers": settings.workers,
            "threads": settings.threads,
            "part": settings.part and f"{settings.part[0]}/{settings.part[1]}",
            "scheduler": settings.scheduler,
        }
        return [
            Task(
                case=with_absolute_paths(self._cases[name]) if settings.scheduler else self._cases[name],
                name=name,
                out=self._out.absolute(),
                made_by=makers(self._cases[name]),
                settings=told,
                solve_into=solve,
                force=settings.force,
            )
            for name in self._names
            if name not in self._done
        ]

    def under_way(self, names: Sequence[str]) -> None:
        """Tell the progress."""
        if self._progress is not None:
            text = ", ".join(names) if len(names) <= _MOST_NAMES else f"{len(names)} cases"
            self._progress(len(self._done), len(self._names), f"solving {text}")

    def done(self, done: Done) -> None:
        """Keep what came of a case; write the tables if that was some time ago."""
        self._done[done.name] = done
        if time.monotonic() - self._written > _TABLES_EVERY_S:
            # a full disk now may have room at the end
            with contextlib.suppress(OSError):
                self.write()
            self._written = time.monotonic()

    def rows(self) -> list[dict[str, Any]]:
        """Rows of the cases that have been done, in the order of the study."""
        mine = set(self._names) & self._done.keys()
        return [_row(case, name, self._done[name]) for case in self._study.cases if (name := case_id(case)) in mine]

    def write(self) -> None:
        """Write the tables of the study, or of the part."""
        part = self._settings.part
        stem = "study" if part is None else f"study.part-{part[0]}-of-{part[1]}"
        write_tables(self._study.name, len(self._study.cases), self.rows(), self._out / stem)


def _row(case: Case, name: str, done: Done) -> dict[str, Any]:
    from fecontact.outputs.record import row

    if done.record is not None:
        # the same profile may have been in another folder when it was solved
        return {"id": name, **row(done.record), "rail": case.rail, "wheel": case.wheel}
    return {
        "id": name,
        "status": done.failure,
        "rail": case.rail,
        "wheel": case.wheel,
        "lateral_shift_mm": case.lateral_shift_mm,
        "load_kN": case.load_N / 1e3,
        "inclination_rad": case.inclination_rad,
    }


def _conclude(study: Study, rows: list[dict[str, Any]], out: Path) -> str | None:
    if study.conclude is None:
        return None
    unusable = sum(row["status"] != "converged" for row in rows)
    if unusable:
        return f"No conclusion: {unusable} of {len(rows)} cases gave no usable result."
    return study.conclude(rows, out)
