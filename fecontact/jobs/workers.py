"""Who solves the cases of a study: worker processes of this machine, or a Dask cluster."""

from __future__ import annotations

import os
import shutil
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from multiprocessing import connection, get_context, parent_process
from typing import Protocol

from fecontact.errors import InputError
from fecontact.jobs.job import Done, Task, run_task
from fecontact.jobs.store import remove_leftovers

_BYTES_A_WORKER = 2e9
# Less than this cannot hold the files of a case.
_FULL_DISK_BYTES = 50e6
_THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")


@dataclass(frozen=True, kw_only=True)
class Crew:
    """Workers for tasks.

    Attributes
    ----------
    open
        Opens an executor with so many workers; what still runs when it is left by an exception is stopped.
    workers
        Number of workers.
    together
        Tasks handed out at a time; with `workers` of them it is known which were under way when a worker dies.
    run
        What a worker calls.
    """

    open: Callable[[int], AbstractContextManager[Executor]]
    workers: int
    together: int
    run: Callable[[Task], Done] = run_task


class Report(Protocol):
    """Hears of the tasks."""

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
    # a process is started when the first task is handed to it, so the environment holds as long as the pool
    with thread_environment(threads):
        executor = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin_worker)
        try:
            yield executor
        except BaseException:
            for process in list((executor._processes or {}).values()):
                process.kill()
            executor.shutdown(cancel_futures=True)
            raise
        executor.shutdown()


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


def run_tasks(tasks: Sequence[Task], crew: Crew, report: Report) -> None:
    """Run all tasks and report each once.

    When a worker process dies, the tasks that were under way run again, each alone; one whose process dies twice is
    reported as failed. A task that was short of memory beside others runs again alone, after all others.
    """
    queue = deque(replace(task, alone=crew.workers == 1) for task in tasks)
    again: list[Task] = []
    while queue:
        for task in _together(queue, again, crew, report):
            report.done(_alone(task, crew, report, deaths=1))
    for task in again:
        report.done(_alone(task, crew, report, deaths=0))


def _together(queue: deque[Task], again: list[Task], crew: Crew, report: Report) -> list[Task]:
    """Run tasks of the queue until it is empty or a worker dies; returns those that were under way then."""
    running: dict[Future[Done], Task] = {}
    lost: list[Task] = []
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
            report.under_way([task.name for task in running.values()])
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                task = running.pop(future)
                done = _outcome(future, task)
                if done is None:
                    lost.append(task)
                elif done.short_of_memory:
                    again.append(task)
                else:
                    report.done(done)
    return lost


def _alone(task: Task, crew: Crew, report: Report, *, deaths: int) -> Done:
    """Run a task with nothing beside it, each time in a new process."""
    task = replace(task, alone=True)
    report.under_way([task.name])
    while deaths < 2:
        if deaths:
            remove_leftovers(task.out, task.name)
        with crew.open(1) as executor:
            done = _outcome(executor.submit(crew.run, task), task)
        if done is not None:
            return done
        deaths += 1
    # ParaView's writers can end the process when the disk is full, so it is looked at before its room is given back
    full = shutil.disk_usage(task.out).free < _FULL_DISK_BYTES
    remove_leftovers(task.out, task.name)
    return Done(name=task.name, failure=f"failed: its process died twice ({'disk full' if full else 'out of memory'}?)")


def _outcome(future: Future[Done], task: Task) -> Done | None:
    """What came of a task; None if its worker died."""
    try:
        return future.result()
    except BrokenExecutor:
        return None
    except InputError as error:
        return Done(name=task.name, failure=f"failed: {error}")
    except Exception as error:
        # the executor's own troubles, such as a cluster that has given the task up
        return Done(name=task.name, failure=" ".join(f"failed: {type(error).__name__}: {error}".split()))
