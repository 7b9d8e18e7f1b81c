"""Who does the jobs: worker processes of this machine, and what happens when one of them dies."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import threading
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
from multiprocessing import connection, get_context, parent_process
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol

from fecontact.errors import FecontactError, InputError
from fecontact.jobs.job import Done, Job, run_job
from fecontact.jobs.store import remove_leftovers

_BYTES_A_WORKER = 2e9
# Less than this cannot hold the files of a case.
_FULL_DISK_BYTES = 50e6
_THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")


@dataclass(frozen=True, kw_only=True)
class Crew:
    """Workers for jobs.

    Attributes
    ----------
    open
        Opens an executor with so many workers; what still runs when it is left by an exception is stopped.
    workers
        Number of workers.
    together
        Jobs handed out at a time; with `workers` of them it is known which were under way when a worker dies.
    run
        What a worker calls.
    refuse
        Raises an `InputError` where no worker can do such a job.
    lost
        Why workers cannot be reached any more, None as long as they can.
    """

    open: Callable[[int], AbstractContextManager[Executor]]
    workers: int
    together: int
    run: Callable[[Job], Done] = run_job
    refuse: Callable[[Job], None] | None = None
    lost: Callable[[], str | None] | None = None


class WorkersLost(FecontactError):
    """Workers have ended, or cannot be reached any more; what is finished and stored is kept."""

    exit_code = 3


class Report(Protocol):
    """Hears of the jobs."""

    def under_way(self, names: Sequence[str]) -> None:
        """These have been handed to workers and have not come back."""

    def done(self, done: Done) -> None:
        """One has come back for good."""


def default_workers() -> int:
    """One worker a core that this process may use, and at most one for each 2 GB of available memory."""
    import psutil

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(cores, int(psutil.virtual_memory().available / _BYTES_A_WORKER)))


def process_crew(workers: int, threads: int) -> Crew:
    """Worker processes of this machine, each computing on so many threads.

    They are spawned, not forked: MKL, OpenMP and gmsh have threads and state that a fork would copy half. Even a single
    worker is a process of its own, whose crash leaves the study alive.
    """
    return Crew(open=lambda count: _process_pool(count, threads), workers=workers, together=workers)


@contextmanager
def _process_pool(workers: int, threads: int) -> Iterator[Executor]:
    # a process is started when the first job is handed to it, so the environment holds as long as the pool
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

    A spawned process imports the script that started it, which fails where that is read from standard input, and solves
    everything once more where it has no main guard. Workers need none of it: what they do can be imported.
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
    """Hold Ctrl-C back; a process that is started meanwhile never hears it, not even while it imports its modules."""
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
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent has ended, also by kill -9, which a pool of itself does not notice."""
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


@contextmanager
def thread_environment(threads: int) -> Iterator[None]:
    """Environment in which the numerical libraries of new processes compute on so many threads, then the old one."""
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
    """What is wrong with the number of threads in this process's environment."""
    for name in _THREAD_VARIABLES:
        if os.environ.get(name) != str(threads):
            return f"its {name} is {os.environ.get(name, 'not set')}, not {threads}"
    return None


@contextmanager
def evaluators(count: int, *, here: bool, workers: int | None = None) -> Iterator[Callable[..., Iterable[Any]]]:
    """What evaluates so many things as `map` does: this process if `here`, else worker processes on one thread each.

    There are `default_workers` of them if not told how many.

    Raises
    ------
    InputError
        If there are to be no workers.
    WorkersLost
        If one of the processes ends before its time.
    """
    if workers is not None and workers < 1:
        raise InputError(f"workers is {workers}; allowed: 1 and more")
    if here:
        yield map
        return
    workers = max(1, min(workers or default_workers(), count))
    try:
        with _process_pool(workers, 1) as executor:
            yield partial(executor.map, chunksize=max(1, min(50, count // (4 * workers))))
    except BrokenExecutor as error:
        raise WorkersLost(
            "a worker process ended before its time (killed, or out of memory?); give less at a time, or fewer workers"
        ) from error


def began_on_one_thread() -> bool:
    """Whether the numerical libraries of this process have one thread; they look at the environment when they begin."""
    try:
        began = Path("/proc/self/environ").read_bytes().split(b"\0")
    except OSError:
        return False
    return all(f"{name}=1".encode() in began for name in _THREAD_VARIABLES)


def run_jobs(jobs: Sequence[Job], crew: Crew, report: Report) -> None:
    """Run all jobs and report each once.

    When a worker process dies, the jobs that were under way run again, each alone; one whose process dies twice is
    reported as failed. A job that was short of memory beside others runs again alone, after all others.
    """
    if jobs and crew.refuse is not None:
        crew.refuse(jobs[0])
    queue = deque(replace(job, alone=crew.workers == 1) for job in jobs)
    again: list[Job] = []
    while queue:
        for job in _together(queue, again, crew, report):
            report.done(_alone(job, crew, report, deaths=1))
    for job in again:
        report.done(_alone(job, crew, report, deaths=0))


def _together(queue: deque[Job], again: list[Job], crew: Crew, report: Report) -> list[Job]:
    """Run jobs of the queue until it is empty or a worker dies; returns those that were under way then."""
    running: dict[Future[Done], Job] = {}
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
            report.under_way([job.name for job in running.values()])
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                job = running.pop(future)
                done = _outcome(future, job, crew)
                if done is None:
                    lost.append(job)
                elif done.short_of_memory:
                    again.append(job)
                else:
                    report.done(done)
    return lost


def _alone(job: Job, crew: Crew, report: Report, *, deaths: int) -> Done:
    """Run a job with nothing beside it, each time in a new process."""
    job = replace(job, alone=True)
    report.under_way([job.name])
    while deaths < 2:
        if deaths:
            remove_leftovers(job.folder.parent, job.name)
        with crew.open(1) as executor:
            done = _outcome(executor.submit(crew.run, job), job, crew)
        if done is not None:
            return done
        deaths += 1
    # ParaView's writers can end the process when the disk is full, so it is looked at before its room is given back
    full = shutil.disk_usage(job.folder.parent).free < _FULL_DISK_BYTES
    remove_leftovers(job.folder.parent, job.name)
    return Done(name=job.name, failure=f"its process died twice ({'disk full' if full else 'out of memory'}?)")


def _outcome(future: Future[Done], job: Job, crew: Crew) -> Done | None:
    """What came of a job; None if its worker died.

    Raises
    ------
    WorkersLost
        If no worker can be reached any more.
    """
    try:
        return future.result()
    except BrokenExecutor:
        return None
    except CancelledError as error:
        if crew.lost is not None and (reason := crew.lost()):
            raise WorkersLost(reason) from error
        return Done(name=job.name, failure=f"the cluster gave it up ({error or 'no reason'})")
    except InputError as error:
        return Done(name=job.name, failure=str(error))
    except Exception as error:
        # the executor's own troubles, such as a cluster that has given the job up
        return Done(name=job.name, failure=f"{type(error).__name__}: {error}")
