"""Runs of many jobs: each job once, on all cores or a cluster.

Finished jobs are kept, also if others fail.
"""

from __future__ import annotations

import contextlib
import re
import secrets
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from fecontact.errors import InputError, ProgramError
from fecontact.files import remove_unfinished
from fecontact.jobs.remaining import Progress, estimate_seconds_left, format_duration
from fecontact.jobs.store import StoredJob, check_stored_job, lock_folder, read_job_progress, remove_leftovers
from fecontact.jobs.workers import Crew, Job, JobOutcome, count_default_workers, make_process_crew, run_jobs

_MAX_NAMES_SHOWN = 8


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """Settings of a run; except `threads` no setting changes a result.

    Attributes
    ----------
    workers
        Number of processes at a time; None for `workers.count_default_workers`.
    threads
        Threads of each job; more than 1 may change the last digits of results.
    force
        Whether finished jobs are solved again.
    part
        (i, N): only every N-th job, from the i-th on.
    scheduler
        Address of a Dask scheduler with the workers that solve.
    """

    workers: int | None = None
    threads: int = 1
    force: bool = False
    part: tuple[int, int] | None = None
    scheduler: str | None = None

    def __post_init__(self) -> None:
        for name, value in (("workers", self.workers), ("threads", self.threads)):
            if value is not None and value < 1:
                raise InputError(f"{name} is {value}; allowed: at least 1")
        if self.part is not None and not 1 <= self.part[0] <= self.part[1]:
            raise InputError(f"part is {self.part[0]}/{self.part[1]}; allowed: 1/N to N/N")

    @property
    def part_suffix(self) -> str:
        """Ending of the names of the tables of a part; empty for a complete run."""
        return "" if self.part is None else f".part-{self.part[0]}-of-{self.part[1]}"

    def select_part(self, names: Sequence[str]) -> tuple[str, ...]:
        """Ids of the jobs in this part, each once.

        Parameters
        ----------
        names
            Ids of all jobs.

        Returns
        -------
        tuple of str
            Every n-th id from the number of this part; all ids without parts.
        """
        distinct_names = tuple(dict.fromkeys(names))
        return distinct_names if self.part is None else distinct_names[self.part[0] - 1 :: self.part[1]]


def parse_part(text: str) -> tuple[int, int]:
    """Read the part i of N from the text `i/N`.

    Parameters
    ----------
    text
        The text.

    Returns
    -------
    tuple of int
        i and N.

    Raises
    ------
    InputError
        If the text has another form.
    """
    match = re.fullmatch(r"(\d+)/(\d+)", text.strip())
    if match is None:
        raise InputError(f"part is {text!r}; give the number of the part and the number of parts, such as 2/4")
    return int(match[1]), int(match[2])


@dataclass(frozen=True, kw_only=True)
class OpenRun:
    """A run that holds its folder.

    Attributes
    ----------
    crew
        Workers of the jobs.
    settings
        Settings of the run.
    progress
        Receives the number of finished jobs, the number of all jobs, and the present activity.
    run
        Name of the run; results of this run are taken even with `force`.
    reused
        Ids of the jobs that were finished before, also if the run is interrupted.
    recomputed
        Reasons for solving or evaluating finished jobs again, by id.
    """

    crew: Crew
    settings: RunSettings
    progress: Progress | None = None
    run: str = field(default_factory=lambda: secrets.token_hex(8))
    reused: list[str] = field(default_factory=list)
    recomputed: dict[str, str] = field(default_factory=dict)


@contextmanager
def open_run(out: Path, store: Path, settings: RunSettings, progress: Progress | None = None) -> Iterator[OpenRun]:
    """Lock the folder of a run and start its workers.

    Parameters
    ----------
    out
        Folder of the run.
    store
        Folder of the finished jobs.
    settings
        Settings of the run.
    progress
        Receives the progress.

    Yields
    ------
    OpenRun
        The run.

    Raises
    ------
    InputError
        If another run has the folder, or the cluster cannot be used.
    """
    try:
        with lock_folder(out, settings.part) as lock, _open_crew(settings, lock) as crew:
            if settings.part is None:
                remove_unfinished(out)
                remove_leftovers(store)
            yield OpenRun(crew=crew, settings=settings, progress=progress)
            if settings.part is None:
                # the tables of the whole run contain the tables of its parts
                for path in out.iterdir():
                    if re.fullmatch(r"\w+\.part-\d+-of-\d+[._]\w+(\.\w+)?", path.name):
                        path.unlink(missing_ok=True)
                remove_leftovers(store)
    except KeyboardInterrupt as error:
        # also for an interruption before the first job, as soon as the folder is locked
        error.add_note("finished results are kept")
        raise


@contextmanager
def _open_crew(settings: RunSettings, lock: Path) -> Iterator[Crew]:
    """Open the workers of a cluster, or of this machine."""
    if settings.scheduler is not None:
        from fecontact.jobs.cluster import dask_crew

        with dask_crew(settings.scheduler, lock.absolute(), settings.threads) as crew:
            yield crew
    else:
        yield make_process_crew(settings.workers or count_default_workers(), settings.threads)


def finish_jobs(jobs: Sequence[Job], held_run: OpenRun, *, on_done: Callable[[JobOutcome], None] | None = None) -> None:
    """Do all jobs that are not finished.

    Parameters
    ----------
    jobs
        Jobs, also the finished ones.
    held_run
        Run with the workers and the settings.
    on_done
        Called after each job, also for jobs that were finished before. After an interruption it is called for the jobs
        that workers finished meanwhile. It is not called for a job that ended with an error of the program.

    Raises
    ------
    ProgramError
        If jobs ended with an error of the program, when all other jobs are done and kept.
    """
    # workers of a cluster have another working directory
    forced = [
        replace(job, folder=job.folder.absolute(), run=held_run.run, force=job.force or held_run.settings.force)
        for job in jobs
    ]
    report = _JobProgress(forced, held_run, on_done)
    report.reuse()
    try:
        run_jobs(report.open, held_run.crew, report)
    except BaseException:
        # workers may have finished jobs that they could not report any more
        with contextlib.suppress(OSError):
            report.take_finished()
        raise
    report.refuse_program_errors()


class _JobProgress:
    """State of the jobs while they run."""

    def __init__(self, jobs: Sequence[Job], by: OpenRun, on_done: Callable[[JobOutcome], None] | None) -> None:
        """Start with all jobs open.

        `by` is the opened run with its settings, and `on_done` receives the outcome of each job.
        """
        self._jobs, self._by, self._on_done = jobs, by, on_done
        self._begun: dict[str, float] = {}
        self._durations: list[float] = []
        self._done: set[str] = set()
        self._program_errors: list[JobOutcome] = []
        self._labels = {job.name: job.label or job.name for job in jobs}
        self._folders = {job.name: job.folder for job in jobs}

    @property
    def open(self) -> list[Job]:
        """Jobs that have not been done."""
        return [job for job in self._jobs if job.name not in self._done]

    def reuse(self) -> None:
        """Mark finished jobs, and note the reasons why other stored jobs are unusable.

        A worker still has to read the results of the finished jobs.
        """
        for job in self.open:
            stored_job = StoredJob() if job.force else check_stored_job(job.folder, job.name, job.origin)
            if stored_job.usable:
                self._by.reused.append(job.name)
                if job.read is None:
                    self.receive(JobOutcome(name=job.name))
            elif stored_job.found:
                self._by.recomputed[job.name] = stored_job.problem or stored_job.outdated or ""

    def take_finished(self) -> None:
        """Take the jobs that workers finished before the run was interrupted."""
        for job in self.open:
            if job.read is None and check_stored_job(job.folder, job.name, job.origin).usable:
                self.receive(JobOutcome(name=job.name))

    def under_way(self, names: Sequence[str]) -> None:
        """Report the number of finished jobs, and the approximate remaining time.

        `names` are the ids of jobs under way. Up to `_MAX_NAMES_SHOWN` jobs are shown by their labels, more by their
        number.
        """
        now = time.monotonic()
        workers = self._by.crew.workers
        # a cluster receives all jobs at once, and begins with the first jobs
        self._begun = {name: self._begun.get(name, now) for name in names[:workers]}
        if self._by.progress is not None:
            parts = {name: read_job_progress(self._folders[name], name) for name in self._begun}
            labels = (f"{self._labels[name]} {parts[name][1] if name in parts else ''}".strip() for name in names)
            text = ", ".join(labels) if len(names) <= _MAX_NAMES_SHOWN else f"{len(names)} jobs"
            done_count, total = len(self._done), len(self._labels)
            # jobs that were finished before need only be read
            unread = set(self._by.reused) - self._done - self._begun.keys()
            waiting = total - done_count - len(self._begun) - len(unread)
            ages = [now - start for start in self._begun.values()]
            remaining_s = estimate_seconds_left(
                self._durations, ages, waiting, workers, [parts[name][0] for name in self._begun]
            )
            remaining_time = "" if remaining_s is None else f"; about {format_duration(remaining_s)} left"
            self._by.progress(done_count, total, f"solving {text}{remaining_time}")

    def receive(self, outcome: JobOutcome) -> None:
        """Keep the outcome of a job."""
        self._done.add(outcome.name)
        self._begun.pop(outcome.name, None)
        if outcome.unreadable is not None:
            self._by.reused.remove(outcome.name)
            self._by.recomputed[outcome.name] = outcome.unreadable
        # a job that was finished before took almost no time, which is no measure for other jobs
        if outcome.seconds and outcome.name not in self._by.reused:
            self._durations.append(outcome.seconds)
        if outcome.is_program_error:
            self._program_errors.append(outcome)
        elif self._on_done is not None:
            self._on_done(outcome)

    def refuse_program_errors(self) -> None:
        """Raise `ProgramError` if jobs ended with an error of the program."""
        if self._program_errors:
            first = self._program_errors[0]
            raise ProgramError(
                f"{len(self._program_errors)} of {len(self._jobs)} jobs ended with an error of the program, first"
                f" {self._labels[first.name]}: {first.failure} in {self._folders[first.name].parent}; report the error"
                " with this file; these jobs have no result, all other jobs are kept; run the same command again with a"
                " corrected program"
            )
