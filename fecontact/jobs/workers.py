"""Worker processes and the jobs that they do: threads, memory, time, and the death of a worker."""

from __future__ import annotations

import contextlib
import math
import os
import shutil
import signal
import socket
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import connection, current_process, get_context, parent_process
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol

from fecontact.errors import FecontactError, InputError, NotEnoughMemory
from fecontact.files import write_text
from fecontact.jobs.store import Origin, difference, kept_folder, new_folder, remove_leftovers
from fecontact.process import collect_rarely

# --- One job in a worker process: do its work, store its files, and report the outcome; nothing is raised.

# gmsh has one global state in each process.
_ONE_AT_A_TIME = threading.Lock()


@dataclass(frozen=True, kw_only=True)
class Made:
    """What came of the work of a job, beside the files in its folder.

    Attributes
    ----------
    short_of_memory
        Whether there was not enough memory for all that was asked for.
    value
        What `Job.read` gives of the folder; None where it has to be read.
    """

    short_of_memory: bool = False
    value: Any = None


class Work(Protocol):
    """The work of a job: a callable that a worker can import."""

    def __call__(self, folder: Path, finished: Path | None) -> Made:
        """Write the job's files into a folder.

        `finished` is the job's stored folder if its fields are only to be evaluated again.
        """


@dataclass(frozen=True, kw_only=True)
class Job:
    """A piece of work whose result is kept in a folder.

    Attributes
    ----------
    name, folder
        Id of the job, and folder in which its result is kept.
    origin
        Versions and sources on the machine that started the run; a worker must have the same.
    origin_here
        Determines the origin on a worker.
    read
        Extracts what the run needs from the finished folder; called on the worker. It raises an `InputError` if the
        folder has another layout; then the job is done again.
    label
        Name shown while the job is under way; `name` if not given.
    run
        Name of the run, whose results are taken even with `force`.
    force
        Whether to solve the job again if it is finished.
    alone
        Whether no other job runs beside the job on this machine.
    group
        One worker does all jobs of a group, one after the other, so that their works may hand on what they share.
    """

    name: str
    folder: Path
    origin: Origin
    origin_here: Callable[[], Origin]
    work: Work
    read: Callable[[Path], Any] | None = None
    label: str = ""
    run: str = ""
    force: bool = False
    alone: bool = False
    group: str = ""


PROGRAM_ERRORS = (AssertionError, AttributeError, ImportError, LookupError, NameError, NotImplementedError, TypeError)
"""What only a wrong program raises: not the numbers of a position, the memory or the disk."""


@dataclass(frozen=True, kw_only=True)
class Done:
    """Outcome of a job.

    Attributes
    ----------
    failure
        Why the job has no result; None if it has a result.
    short_of_memory
        Whether the job may succeed when it runs alone.
    value
        What `Job.read` returned, or would have.
    unreadable
        Why a job that was finished before had to be done again.
    seconds
        How long it took.
    program_error
        Whether the failure is an error of the program, which says nothing about the inputs of the job.
    """

    name: str
    failure: str | None = None
    program_error: bool = False
    short_of_memory: bool = False
    value: Any = None
    unreadable: str | None = None
    seconds: float = 0.0


Group = tuple[Job, ...]


def run_group(jobs: Group) -> tuple[Done, ...]:
    """Do the jobs of a group in their order; what their works share is one object here, too."""
    return tuple(map(run_job, jobs))


def run_job(job: Job) -> Done:
    """Do a job and put its folder into the store.

    A job that was short of memory while others ran beside it is not stored: its result would depend on them.
    """
    with _ONE_AT_A_TIME:
        _reset_peak_memory()
        begun = time.monotonic()
        done = _tried(job)
        return replace(done, seconds=time.monotonic() - begun)


def _tried(job: Job) -> Done:
    try:
        return _do(job)
    except MemoryError:
        return _failed(job, "out of memory", short=True)
    except FecontactError as error:
        return _failed(job, str(error), short=isinstance(error, NotEnoughMemory))
    except OSError as error:
        # most often a full disk
        return _failed(job, f"{error.strerror or error} ({error.filename})" if error.filename else str(error))
    except Exception as error:
        # other jobs go on; `finish` raises `ProgramError` for an error that no input can cause
        file = error_file(job.folder)
        with contextlib.suppress(OSError):
            write_text(file, traceback.format_exc())
        done = _failed(job, f"{type(error).__name__}: {error}; see {file.name}")
        return replace(done, program_error=isinstance(error, PROGRAM_ERRORS))


def error_file(folder: Path) -> Path:
    """File for the traceback of a job that ended with an unexpected error."""
    return folder.with_name(f"{folder.name}.error.txt")


def _failed(job: Job, failure: str, *, short: bool = False) -> Done:
    return Done(name=job.name, failure=failure, short_of_memory=short and not job.alone)


def _do(job: Job) -> Done:
    if problem := unlike(job):
        raise InputError(problem)
    kept, unreadable = kept_folder(job.folder, job.name, job.origin), None
    if kept.usable and (not job.force or (job.run and kept.run == job.run)):
        # done already: by an earlier run, or by a worker that was lost before it could report
        try:
            return Done(name=job.name, value=_value(job))
        except InputError as error:
            unreadable = str(error)
    judged = kept.found and kept.problem is None and not job.force and unreadable is None
    with new_folder(job.folder, job.name, job.origin, job.run) as folder:
        made = job.work(folder, job.folder if judged else None)
        if made.short_of_memory and not job.alone:
            raise NotEnoughMemory("there was not enough memory to solve it as far as it would have been alone")
    error_file(job.folder).unlink(missing_ok=True)
    stored = kept_folder(job.folder, job.name, job.origin)
    if not stored.usable:
        raise OSError(f"what was written cannot be read again: {stored.problem or stored.outdated}")
    value = _value(job) if made.value is None else made.value
    return Done(name=job.name, value=value, unreadable=unreadable)


def _value(job: Job) -> Any:
    return None if job.read is None else job.read(job.folder)


def unlike(job: Job) -> str | None:
    """Why this process must not do a job: its versions or sources are not the run's."""
    here = job.origin_here()
    changes = (
        difference(job.origin.solved_by, here.solved_by),
        difference(job.origin.evaluated_by, here.evaluated_by),
    )
    said = ", ".join(filter(None, changes))
    return f"worker on {socket.gethostname()} is not like the one that started the run: {said}" if said else None


def _reset_peak_memory() -> None:
    """Reset the peak memory of the process, so that it is measured for each job; Linux only."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


# --- Worker processes of this machine, and what happens when a worker dies.

_BYTES_A_WORKER, _TOLD_EVERY_S = 2e9, 2.0
# A disk with less free space than this cannot hold the files of a case.
_FULL_DISK_BYTES = 50e6
_THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")


@dataclass(frozen=True, kw_only=True)
class Crew:
    """Workers for jobs.

    Attributes
    ----------
    open
        Opens an executor with so many workers; an exception stops the jobs that still run.
    workers
        Number of workers.
    together
        Groups of jobs handed out at a time. If they are as many as workers, the jobs under way are known when a worker
        dies.
    run
        Function that a worker calls.
    refuse
        Raises an `InputError` if no worker can do the job.
    lost
        Why workers cannot be reached any more; None as long as they can.
    """

    open: Callable[[int], AbstractContextManager[Executor]]
    workers: int
    together: int
    run: Callable[[Group], tuple[Done, ...]] = run_group
    refuse: Callable[[Job], None] | None = None
    lost: Callable[[], str | None] | None = None


class WorkersLost(FecontactError):
    """Workers have ended, or cannot be reached any more; stored results are kept."""

    exit_code = 3


class Report(Protocol):
    """Receives reports about the jobs."""

    def under_way(self, names: Sequence[str]) -> None:
        """These jobs have been handed to workers and are not done; of each group the one that is next."""

    def done(self, done: Done) -> None:
        """A job is done, and will not run again."""


def default_workers() -> int:
    """A worker for each core that this process may use, and at most a worker for each 2 GB of available memory."""
    import psutil

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(cores, int(psutil.virtual_memory().available / _BYTES_A_WORKER)))


def process_crew(workers: int, threads: int) -> Crew:
    """Worker processes of this machine, each computing on so many threads.

    They are spawned, not forked: a fork would copy the threads and the state of MKL, OpenMP and gmsh only in part. Even
    a single worker is a process of its own, so that its crash does not end the study. A daemonic process, such as a
    worker of `multiprocessing.Pool`, must not have children: it does the jobs itself, on the threads that it has.
    """
    if current_process().daemon:
        workers = 1
    return Crew(open=lambda count: _process_pool(count, threads), workers=workers, together=workers)


class _ThisProcess(Executor):
    """An executor that does each job in this process when it is submitted."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def _process_pool(workers: int, threads: int) -> Iterator[Executor]:
    if current_process().daemon:
        yield _ThisProcess()
        return
    # a process is started when the first job is handed to it, so the environment must last as long as the pool
    with thread_environment(threads):
        executor = _QuietPool(workers, mp_context=get_context("spawn"), initializer=_begin_worker)
        try:
            yield executor
        except BaseException:
            for process in list((executor._processes or {}).values()):
                process.kill()
            executor.shutdown(cancel_futures=True)
            raise
        executor.shutdown()


class _QuietPool(ProcessPoolExecutor):
    """Worker processes that begin without the caller's script and without Ctrl-C.

    A spawned process imports the script that started it. This fails if the script is read from standard input, and
    solves everything once more if the script has no main guard. Workers do not need the script: their work can be
    imported.
    """

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        with _no_script(), _no_interrupt():
            return super().submit(fn, *args, **kwargs)


@contextmanager
def _no_script() -> Iterator[None]:
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


@contextmanager
def _no_interrupt() -> Iterator[None]:
    """Block Ctrl-C; a process that is started meanwhile never receives it, not even while it imports its modules."""
    if not hasattr(signal, "pthread_sigmask"):
        # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin_worker() -> None:
    # Ctrl-C reaches all processes of a terminal; the parent decides
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    collect_rarely()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent has ended, also by kill -9, which a process pool does not notice."""
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


@contextmanager
def thread_environment(threads: int) -> Iterator[None]:
    """Set the number of threads of the numerical libraries in new processes; the old environment returns at the end."""
    wanted = {name: str(threads) for name in _THREAD_VARIABLES} | {"MKL_DYNAMIC": "FALSE"}
    before = {name: os.environ.get(name) for name in wanted}
    os.environ.update(wanted)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def other_threads(threads: int) -> str | None:
    """What is wrong with the number of threads in this process's environment; None if it is right."""
    for name in _THREAD_VARIABLES:
        if os.environ.get(name) != str(threads):
            return f"its {name} is {os.environ.get(name, 'not set')}, not {threads}"
    return None


@contextmanager
def evaluators(count: int, *, here: bool, workers: int | None = None) -> Iterator[Callable[..., Iterable[Any]]]:
    """A function like `map` for `count` items: in this process if `here`, else in worker processes on one thread each.

    A daemonic process, which must not have children, does all of them. Without `workers` there are `default_workers`.

    Raises
    ------
    InputError
        If `workers` is less than 1.
    WorkersLost
        If a worker process ends early.
    """
    if workers is not None and workers < 1:
        raise InputError(f"workers is {workers}; allowed: 1 and more")
    if here or current_process().daemon:
        yield map
        return
    workers = max(1, min(workers or default_workers(), count))
    try:
        with _process_pool(workers, 1) as executor:
            yield partial(executor.map, chunksize=max(1, min(50, count // (4 * workers))))
    except BrokenExecutor as error:
        raise WorkersLost(
            "a worker process ended early (killed, or out of memory?); give less at a time, or fewer workers"
        ) from error


def began_on_one_thread() -> bool:
    """Whether the numerical libraries of this process have one thread; they read the environment when they start."""
    try:
        began = Path("/proc/self/environ").read_bytes().split(b"\0")
    except OSError:
        return False
    return all(f"{name}=1".encode() in began for name in _THREAD_VARIABLES)


def run_jobs(jobs: Sequence[Job], crew: Crew, report: Report) -> None:
    """Run all jobs and report each once.

    When a worker process dies, the jobs that were under way run again, each alone; a job whose process dies twice is
    reported as failed. A job that was short of memory beside others runs again alone, after all others.
    """
    if jobs and crew.refuse is not None:
        crew.refuse(jobs[0])
    queue = deque(groups_of([replace(job, alone=crew.workers == 1) for job in jobs], crew.workers))
    again: list[Job] = []
    while queue:
        for job in _together(queue, again, crew, report):
            report.done(_alone(job, crew, report, deaths=1))
    for job in again:
        report.done(_alone(job, crew, report, deaths=0))


def groups_of(jobs: Sequence[Job], workers: int) -> list[Group]:
    """Jobs by their groups, which are split where they are fewer than workers."""
    groups: dict[str, list[Job]] = {}
    for job in jobs:
        groups.setdefault(job.group or job.name, []).append(job)
    pieces = math.ceil(workers / max(1, len(groups)))
    found = []
    for group in groups.values():
        size = math.ceil(len(group) / pieces)
        found += [tuple(group[first : first + size]) for first in range(0, len(group), size)]
    return found


def _together(queue: deque[Group], again: list[Job], crew: Crew, report: Report) -> list[Job]:
    """Run groups of the queue until it is empty or a worker dies; returns the jobs that were under way then."""
    running: dict[Future[tuple[Done, ...]], Group] = {}
    lost: list[Job] = []
    with crew.open(crew.workers) as executor:
        while (queue and not lost) or running:
            while queue and not lost and len(running) < crew.together:
                try:
                    running[executor.submit(crew.run, queue[0])] = queue[0]
                except BrokenExecutor:
                    break
                queue.popleft()
            if not running:
                break
            report.under_way(list(map(_under_way, running.values())))
            # what is left of a long job is told while it is under way
            for future in wait(running, _TOLD_EVERY_S, return_when=FIRST_COMPLETED).done:
                group = running.pop(future)
                outcome = _outcome(future, group, crew)
                if outcome is None:
                    lost += group
                    continue
                for job, done in zip(group, outcome, strict=True):
                    if done.short_of_memory:
                        again.append(job)
                    else:
                        report.done(done)
    return lost


def _under_way(group: Group) -> str:
    """Name of the job of a group that is done now: the first without a result."""
    return next((job for job in group if not job.folder.is_dir()), group[-1]).name


def _alone(job: Job, crew: Crew, report: Report, *, deaths: int) -> Done:
    """Run a job with nothing beside it, each time in a new process."""
    job = replace(job, alone=True)
    report.under_way([job.name])
    while deaths < 2:
        if deaths:
            remove_leftovers(job.folder.parent, job.name)
        with crew.open(1) as executor:
            outcome = _outcome(executor.submit(crew.run, (job,)), (job,), crew)
        if outcome is not None:
            return outcome[0]
        deaths += 1
    # ParaView's writers can end the process if the disk is full, so free space is read before files are removed
    full = shutil.disk_usage(job.folder.parent).free < _FULL_DISK_BYTES
    remove_leftovers(job.folder.parent, job.name)
    return Done(name=job.name, failure=f"its process died twice ({'disk full' if full else 'out of memory'}?)")


def _outcome(future: Future[tuple[Done, ...]], group: Group, crew: Crew) -> tuple[Done, ...] | None:
    """Outcome of each job of a group; None if its worker died.

    Raises
    ------
    WorkersLost
        If no worker can be reached any more.
    """
    wrong = False
    try:
        return future.result()
    except BrokenExecutor:
        return None
    except CancelledError as error:
        if crew.lost is not None and (reason := crew.lost()):
            raise WorkersLost(reason) from error
        failure = f"the cluster gave it up ({error or 'no reason'})"
    except InputError as error:
        failure = str(error)
    except Exception as error:
        # errors of the executor, such as a cluster that has given the job up
        failure, wrong = f"{type(error).__name__}: {error}", isinstance(error, PROGRAM_ERRORS)
    return tuple(Done(name=job.name, failure=failure, program_error=wrong) for job in group)
