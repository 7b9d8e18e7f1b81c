"""Worker processes and their jobs: threads, memory, time, and the death of a worker."""

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

from fecontact.errors import FecontactError, InputError, MemoryShortageError, is_memory_shortage
from fecontact.files import write_text
from fecontact.jobs.store import Origin, check_stored_job, describe_differences, remove_leftovers, replace_folder
from fecontact.process import THREAD_VARIABLES, collect_rarely, count_cores

# --- A job in a worker process: do its work, store its files, and report the outcome; nothing is raised.

# gmsh has one global state in each process.
_JOB_LOCK = threading.Lock()


@dataclass(frozen=True, kw_only=True)
class WorkResult:
    """Result of the work of a job, in addition to the files in its folder.

    Attributes
    ----------
    short_of_memory
        Whether there was not enough memory for the complete work.
    value
        Value that `Job.read` gives for the folder; None if the folder has to be read.
    """

    short_of_memory: bool = False
    value: Any = None


class Work(Protocol):
    """Work of a job: a callable that a worker can import."""

    def __call__(self, folder: Path, finished: Path | None) -> WorkResult:
        """Write the job's files into a folder.

        Parameters
        ----------
        folder
            Folder for the files.
        finished
            Stored folder of the job if its fields are only to be evaluated again; otherwise None.

        Returns
        -------
        WorkResult
            Result of the work.
        """


@dataclass(frozen=True, kw_only=True)
class Job:
    """Work with a result that is kept in a folder.

    Attributes
    ----------
    name, folder
        Id of the job, and folder of its result.
    origin
        Versions and sources on the machine that started the run; a worker must have equal ones.
    origin_here
        Determines the origin on a worker.
    work
        The work itself.
    read
        Extracts the needed values from the finished folder; called on the worker. It raises an `InputError` if the
        folder has another layout; then the job is done again.
    label
        Name shown while the job is under way; `name` if not given.
    run
        Name of the run; its results are taken even with `force`.
    force
        Whether to solve the job again if it is finished.
    alone
        Whether no other job runs on this machine at the same time.
    group
        A worker does all jobs of a group, one after the other, so that their works may hand on shared objects.
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
"""Exceptions that only a wrong program raises, and not the numbers of a position, the memory or the disk."""


@dataclass(frozen=True, kw_only=True)
class JobOutcome:
    """Outcome of a job.

    Attributes
    ----------
    failure
        Reason for a missing result; None if the job has a result.
    is_program_error
        Whether the failure is an error of the program, which is not caused by the inputs of the job.
    is_system_failure
        Whether memory, disk, or the loss of a worker caused the failure, and not the inputs of the job.
    short_of_memory
        Whether the job may succeed when it runs alone.
    value
        Value that `Job.read` returned, or would have returned.
    unreadable
        Reason for doing a job again that was finished before.
    seconds
        Wall time of the job, in s.
    name
        Id of the job.
    """

    name: str
    failure: str | None = None
    is_program_error: bool = False
    is_system_failure: bool = False
    short_of_memory: bool = False
    value: Any = None
    unreadable: str | None = None
    seconds: float = 0.0


JobGroup = tuple[Job, ...]


def run_group(jobs: JobGroup) -> tuple[JobOutcome, ...]:
    """Do the jobs of a group in their order; their works share objects also in this process."""
    return tuple(map(run_job, jobs))


def run_job(job: Job) -> JobOutcome:
    """Do a job and put its folder into the store.

    A job that was short of memory while other jobs ran is not stored: its result would depend on the other jobs.

    Parameters
    ----------
    job
        The job.

    Returns
    -------
    JobOutcome
        Outcome, with the wall time.
    """
    with _JOB_LOCK:
        _reset_peak_memory()
        start = time.monotonic()
        outcome = _try_job(job)
        return replace(outcome, seconds=time.monotonic() - start)


def _try_job(job: Job) -> JobOutcome:
    """Do a job; exceptions become failures of its outcome.

    An unexpected error writes its traceback to a file next to the job. Lack of memory is marked, so that the job can
    run again alone.
    """
    try:
        return _do_job(job)
    except MemoryError:
        return _describe_failure(job, "out of memory", is_short_of_memory=True, is_system_failure=True)
    except FecontactError as error:
        is_short = isinstance(error, MemoryShortageError)
        is_system_failure = is_short or isinstance(error, WorkersLost)
        return _describe_failure(job, str(error), is_short_of_memory=is_short, is_system_failure=is_system_failure)
    except OSError as error:
        # most often a full disk
        failure = f"{error.strerror or error} ({error.filename})" if error.filename else str(error)
        return _describe_failure(job, failure, is_system_failure=True)
    except Exception as error:
        if is_memory_shortage(error):
            # a library that the work imports did not fit into the memory
            failure = f"out of memory ({error})"
            return _describe_failure(job, failure, is_short_of_memory=True, is_system_failure=True)
        # other jobs go on; `finish` raises `ProgramError` for an error that no input can cause
        file = error_file(job.folder)
        with contextlib.suppress(OSError):
            write_text(file, traceback.format_exc())
        outcome = _describe_failure(job, f"{type(error).__name__}: {error}; see {file.name}")
        return replace(outcome, is_program_error=isinstance(error, PROGRAM_ERRORS))


def error_file(folder: Path) -> Path:
    """File for the traceback of a job that ended with an unexpected error."""
    return folder.with_name(f"{folder.name}.error.txt")


def _describe_failure(
    job: Job, failure: str, *, is_short_of_memory: bool = False, is_system_failure: bool = False
) -> JobOutcome:
    return JobOutcome(
        name=job.name,
        failure=failure,
        is_system_failure=is_system_failure,
        short_of_memory=is_short_of_memory and not job.alone,
    )


def _do_job(job: Job) -> JobOutcome:
    """Do a job if it is not finished already, and check the stored files.

    Results that are stored completely are read and not computed again, except with `force` in an earlier run. Stored
    files that are whole but judged by other inputs are given to the work.

    Raises
    ------
    WorkersLost
        If the worker has other versions.
    MemoryShortageError
        If the memory did not suffice while other jobs ran.
    """
    if problem := describe_worker_differences(job):
        raise WorkersLost(problem)
    stored_before, unreadable = check_stored_job(job.folder, job.name, job.origin), None
    if stored_before.usable and (not job.force or (job.run and stored_before.run == job.run)):
        # the job is finished: by an earlier run, or by a worker that was lost before it could report
        try:
            return JobOutcome(name=job.name, value=_read_value(job))
        except InputError as error:
            unreadable = str(error)
    is_to_judge = stored_before.found and stored_before.problem is None and not job.force and unreadable is None
    with replace_folder(job.folder, job.name, job.origin, job.run) as folder:
        output = job.work(folder, job.folder if is_to_judge else None)
        if output.short_of_memory and not job.alone:
            raise MemoryShortageError("not enough memory to solve the job completely while other jobs run")
    error_file(job.folder).unlink(missing_ok=True)
    stored = check_stored_job(job.folder, job.name, job.origin)
    if not stored.usable:
        raise OSError(f"the written files cannot be read: {stored.problem or stored.outdated}")
    value = _read_value(job) if output.value is None else output.value
    return JobOutcome(name=job.name, value=value, unreadable=unreadable)


def _read_value(job: Job) -> Any:
    return None if job.read is None else job.read(job.folder)


def describe_worker_differences(job: Job) -> str | None:
    """Explain why this process must not do a job.

    Parameters
    ----------
    job
        The job, with the versions and sources of the run.

    Returns
    -------
    str or None
        The differences from the versions or sources of the run; None without differences.
    """
    local_origin = job.origin_here()
    changes = (
        describe_differences(job.origin.solved_by, local_origin.solved_by),
        describe_differences(job.origin.evaluated_by, local_origin.evaluated_by),
    )
    differences = ", ".join(filter(None, changes))
    return (
        f"worker on {socket.gethostname()} has different versions or sources from the run: {differences}"
        if differences
        else None
    )


def _reset_peak_memory() -> None:
    """Reset the peak memory of the process, to measure it for each job; Linux only."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


# --- Worker processes of this machine, and what happens when a worker dies.

_BYTES_PER_WORKER, _REPORT_INTERVAL_S = 2e9, 2.0
# A disk with less free space than this cannot hold the files of a case.
_FULL_DISK_BYTES = 50e6


@dataclass(frozen=True, kw_only=True)
class Crew:
    """Workers for jobs.

    Attributes
    ----------
    open
        Opens an executor with a given number of workers; an exception stops the jobs that still run.
    workers
        Number of workers.
    together
        Groups of jobs handed out at a time. If their number equals the number of workers, the jobs under way are
        identified when a worker dies.
    run
        Function that a worker calls.
    refuse
        Raises an `InputError` if no worker can do the job.
    lost
        Explains why workers cannot be reached any more; returns None if they can.
    """

    open: Callable[[int], AbstractContextManager[Executor]]
    workers: int
    together: int
    run: Callable[[JobGroup], tuple[JobOutcome, ...]] = run_group
    refuse: Callable[[Job], None] | None = None
    lost: Callable[[], str | None] | None = None


class WorkersLost(FecontactError):
    """Workers have ended, cannot be reached any more, or have different versions; stored results are kept."""

    exit_code = 3


class JobReceiver(Protocol):
    """Receiver of reports about the jobs."""

    def under_way(self, names: Sequence[str]) -> None:
        """Receive the names of the jobs that workers have and that are not done.

        Of each group the next job is named.

        Parameters
        ----------
        names
            Ids of the jobs.
        """

    def receive(self, done: JobOutcome) -> None:
        """Receive the outcome of a job that will not run again.

        Parameters
        ----------
        done
            Outcome of the job.
        """


def count_default_workers() -> int:
    """Default number of workers: a worker per usable core and per 2 GB of available memory.

    Returns
    -------
    int
        The smaller of both numbers, at least 1.
    """
    import psutil

    return max(1, min(count_cores(), int(psutil.virtual_memory().available / _BYTES_PER_WORKER)))


def make_process_crew(workers: int, threads: int) -> Crew:
    """Worker processes of this machine.

    They are spawned, not forked: a fork would copy the threads and the state of MKL, OpenMP and gmsh only in part. Even
    a single worker is a separate process, so that its crash does not end the study. A daemonic process, such as a
    worker of `multiprocessing.Pool`, must not have children: it does the jobs itself, on its present threads.

    Parameters
    ----------
    workers
        Number of processes.
    threads
        Threads of each process.

    Returns
    -------
    Crew
        The workers.
    """
    if current_process().daemon:
        workers = 1
    return Crew(open=lambda worker_count: _process_pool(worker_count, threads), workers=workers, together=workers)


class _ThisProcess(Executor):
    """Executor that does each job in this process when it is submitted."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def _process_pool(worker_count: int, threads: int) -> Iterator[Executor]:
    """Open a pool of worker processes; in a daemonic process an executor in this process.

    `threads` is the number of threads of the numerical libraries in each process. After an exception the processes are
    killed and waiting jobs are cancelled.
    """
    if current_process().daemon:
        yield _ThisProcess()
        return
    # a process is started when the first job is handed to it, so the environment must last as long as the pool
    with set_thread_environment(threads):
        executor = _QuietPool(worker_count, mp_context=get_context("spawn"), initializer=_initialise_worker)
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
        """Hand a call to a worker; raises `WorkersLost` if a process or thread of the pool cannot be started."""
        try:
            with _hide_main_script(), _block_interrupt():
                self._start_feeder()
                return super().submit(fn, *args, **kwargs)
        except BrokenExecutor:
            raise
        except (RuntimeError, OSError, MemoryError) as error:
            pool: Any = self
            manager = pool._executor_manager_thread
            if manager is not None and not manager.is_alive():
                # a thread that was not started cannot be waited for
                pool._executor_manager_thread = None
            reason = getattr(error, "strerror", None) or str(error) or "out of memory"
            raise WorkersLost(
                f"not enough memory to start a worker process ({reason}); close other programs, use fewer --workers, or"
                " raise the limits with ulimit -v and ulimit -u"
            ) from error

    def _start_feeder(self) -> None:
        """Start the thread that hands calls to the workers.

        Python 3.11 starts it in another thread, which ends with an error without memory for a new thread. Then nobody
        reports the calls, and the caller waits forever.
        """
        pool: Any = self
        calls = pool._call_queue
        with calls._notempty:
            if calls._thread is None:
                calls._start_thread()


@contextmanager
def _hide_main_script() -> Iterator[None]:
    """Hide the main module, so that a new process does not import the script."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


@contextmanager
def _block_interrupt() -> Iterator[None]:
    """Block Ctrl-C; a process that is started meanwhile never receives it, not even during its imports."""
    if not hasattr(signal, "pthread_sigmask"):
        # Windows
        yield
        return
    previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)


def _initialise_worker() -> None:
    # Ctrl-C reaches all processes of a terminal; the parent decides
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    collect_rarely()
    try:
        threading.Thread(target=_end_with_parent, daemon=True).start()
    except (RuntimeError, MemoryError):
        # not enough memory for a thread: the caller reports the lost worker, and the pool would print a traceback
        os._exit(1)


def _end_with_parent() -> None:
    """End this process when its parent has ended.

    A process pool does not notice an end by kill -9.
    """
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


@contextmanager
def set_thread_environment(threads: int) -> Iterator[None]:
    """Set the number of threads of the numerical libraries in new processes.

    The previous environment returns at the end.

    Parameters
    ----------
    threads
        Number of threads.

    Yields
    ------
    None
        Control to the enclosed code.
    """
    variables = {name: str(threads) for name in THREAD_VARIABLES} | {"MKL_DYNAMIC": "FALSE"}
    previous_values = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in previous_values.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def describe_wrong_threads(threads: int) -> str | None:
    """Explain a wrong number of threads in the environment of this process.

    Parameters
    ----------
    threads
        Required number of threads.

    Returns
    -------
    str or None
        The wrong variable and its value; None if all variables are right.
    """
    for name in THREAD_VARIABLES:
        if os.environ.get(name) != str(threads):
            return f"{name} is {os.environ.get(name, 'not set')}; required: {threads}"
    return None


@contextmanager
def open_evaluators(count: int, *, here: bool, workers: int | None = None) -> Iterator[Callable[..., Iterable[Any]]]:
    """Open a function like `map`, in this process or in single-threaded worker processes.

    A daemonic process, which must not have children, does all items itself.

    Parameters
    ----------
    count
        Number of items.
    here
        Whether this process does all items.
    workers
        Number of processes; `count_default_workers` if not given.

    Yields
    ------
    callable
        Function with the arguments of `map`.

    Raises
    ------
    InputError
        If `workers` is less than 1.
    WorkersLost
        If a worker process ends early.
    """
    if workers is not None and workers < 1:
        raise InputError(f"workers is {workers}; allowed: at least 1")
    if here or current_process().daemon:
        yield map
        return
    workers = max(1, min(workers or count_default_workers(), count))
    try:
        with _process_pool(workers, 1) as executor:
            yield partial(executor.map, chunksize=max(1, min(50, count // (4 * workers))))
    except BrokenExecutor as error:
        raise WorkersLost(
            "a worker process ended early (killed or out of memory?); give fewer inputs at a time, or use fewer workers"
        ) from error


def has_single_thread() -> bool:
    """Whether the numerical libraries of this process have a single thread.

    They read the environment when they start.

    Returns
    -------
    bool
        False on systems without `/proc`, where the start environment cannot be read.
    """
    try:
        start_environment = Path("/proc/self/environ").read_bytes().split(b"\0")
    except OSError:
        return False
    return all(f"{name}=1".encode() in start_environment for name in THREAD_VARIABLES)


def run_jobs(jobs: Sequence[Job], crew: Crew, report: JobReceiver) -> None:
    """Run all jobs and report each once.

    When a worker process dies, the jobs that were under way run again, each alone; a job with two dead processes is
    reported as failed. A job that was short of memory at the same time as other jobs runs again alone, after all
    others.

    Parameters
    ----------
    jobs
        Jobs to run.
    crew
        Workers.
    report
        Receiver of the outcomes.
    """
    if jobs and crew.refuse is not None:
        crew.refuse(jobs[0])
    queue = deque(divide_into_groups([replace(job, alone=crew.workers == 1) for job in jobs], crew.workers))
    short_jobs: list[Job] = []
    while queue:
        for job in _run_groups(queue, short_jobs, crew, report):
            report.receive(_run_alone(job, crew, report, deaths=1))
    for job in short_jobs:
        report.receive(_run_alone(job, crew, report, deaths=0))


def divide_into_groups(jobs: Sequence[Job], workers: int) -> list[JobGroup]:
    """Divide jobs into their groups; if there are fewer groups than workers, groups are split.

    Parameters
    ----------
    jobs
        Jobs with their groups.
    workers
        Number of workers.

    Returns
    -------
    list of tuple of Job
        Groups, each for a worker.
    """
    groups: dict[str, list[Job]] = {}
    for job in jobs:
        groups.setdefault(job.group or job.name, []).append(job)
    parts_per_group = math.ceil(workers / max(1, len(groups)))
    split_groups = []
    for group in groups.values():
        size = math.ceil(len(group) / parts_per_group)
        split_groups += [tuple(group[first : first + size]) for first in range(0, len(group), size)]
    return split_groups


def _run_groups(queue: deque[JobGroup], short_jobs: list[Job], crew: Crew, report: JobReceiver) -> list[Job]:
    """Run groups of the queue until it is empty or a worker dies.

    Returns the jobs that were under way when a worker died. Jobs that were short of memory are added to `short_jobs`.
    """
    running: dict[Future[tuple[JobOutcome, ...]], JobGroup] = {}
    lost_jobs: list[Job] = []
    with crew.open(crew.workers) as executor:
        while (queue and not lost_jobs) or running:
            while queue and not lost_jobs and len(running) < crew.together:
                try:
                    running[executor.submit(crew.run, queue[0])] = queue[0]
                except BrokenExecutor:
                    break
                queue.popleft()
            if not running:
                break
            report.under_way(list(map(_name_present_job, running.values())))
            # the remaining time of a long job is reported while it is under way
            for future in wait(running, _REPORT_INTERVAL_S, return_when=FIRST_COMPLETED).done:
                group = running.pop(future)
                outcome = _collect_outcome(future, group, crew)
                if outcome is None:
                    lost_jobs += group
                    continue
                for job, job_outcome in zip(group, outcome, strict=True):
                    if job_outcome.short_of_memory:
                        short_jobs.append(job)
                    else:
                        report.receive(job_outcome)
    return lost_jobs


def _name_present_job(group: JobGroup) -> str:
    """Name of the present job of a group: the first without a result."""
    return next((job for job in group if not job.folder.is_dir()), group[-1]).name


def _run_alone(job: Job, crew: Crew, report: JobReceiver, *, deaths: int) -> JobOutcome:
    """Run a job while no other job runs, each time in a new process.

    `deaths` counts the processes that already ended during this job. After two deaths the outcome is a failure with the
    probable cause: out of memory or disk full.
    """
    job = replace(job, alone=True)
    report.under_way([job.name])
    while deaths < 2:
        if deaths:
            remove_leftovers(job.folder.parent, job.name)
        with crew.open(1) as executor:
            outcome = _collect_outcome(executor.submit(crew.run, (job,)), (job,), crew)
        if outcome is not None:
            return outcome[0]
        deaths += 1
    # ParaView's writers can end the process if the disk is full, so free space is read before files are removed. A
    # process that dies at its start has not made the folder of the store
    existing_folder = next(folder for folder in job.folder.parents if folder.exists())
    full = shutil.disk_usage(existing_folder).free < _FULL_DISK_BYTES
    remove_leftovers(job.folder.parent, job.name)
    failure = f"the process died twice ({'disk full' if full else 'out of memory'}?)"
    return JobOutcome(name=job.name, failure=failure, is_system_failure=True)


def _collect_outcome(
    future: Future[tuple[JobOutcome, ...]], group: JobGroup, crew: Crew
) -> tuple[JobOutcome, ...] | None:
    """Outcome of each job of a group; None if its worker died.

    Raises
    ------
    WorkersLost
        If no worker can be reached any more.
    """
    is_program_error = False
    try:
        return future.result()
    except BrokenExecutor:
        return None
    except CancelledError as error:
        if crew.lost is not None and (reason := crew.lost()):
            raise WorkersLost(reason) from error
        failure = f"the cluster gave up this job ({error or 'no reason given'})"
    except InputError as error:
        failure = str(error)
    except Exception as error:
        # errors of the executor, such as a cluster that has given the job up
        failure, is_program_error = f"{type(error).__name__}: {error}", isinstance(error, PROGRAM_ERRORS)
    return tuple(
        JobOutcome(
            name=job.name,
            failure=failure,
            is_program_error=is_program_error,
            is_system_failure=not is_program_error,
        )
        for job in group
    )
