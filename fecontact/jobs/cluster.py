"""Jobs on a Dask cluster whose workers share the folder of the results."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.jobs.job import Done, Job, run_job
from fecontact.jobs.workers import Crew, other_threads

_CONNECT_S = 10
_FIRST_WORKER_S = 60
# A file that was just made may take a moment to be seen by another machine.
_SEEN_S = 5.0
_RETRIES = 2


@contextmanager
def dask_crew(address: str, lock: Path, threads: int) -> Iterator[Crew]:
    """The workers of a Dask cluster.

    Parameters
    ----------
    address
        Of the scheduler, such as tcp://10.0.0.1:8786.
    lock
        The lock file of the results' folder, which every worker must see.
    threads
        Threads that a job computes on; workers whose environment says otherwise are refused.

    Raises
    ------
    InputError
        If `distributed` is not installed, the scheduler is not reachable, no worker comes, or a worker does not see
        the folder, or runs several tasks at once.
    """
    with ExitStack() as stack:
        client = stack.enter_context(_connected(address))
        _check_workers(client, address, lock, threads)

        @contextmanager
        def executor(count: int) -> Iterator[Executor]:
            made = client.get_executor(retries=_RETRIES)
            try:
                yield made
            finally:
                made.shutdown(wait=False)

        # all at once: the cluster knows best, and runs again what a lost worker had
        yield Crew(open=executor, workers=max(2, len(client.nthreads())), together=10**9, run=_Run(lock, threads))


class _Run:
    """`run_job` with the checks of a worker that came later."""

    def __init__(self, lock: Path, threads: int) -> None:
        self._lock, self._threads = lock, threads

    def __call__(self, job: Job) -> Done:
        if problem := worker_problem(self._lock, self._threads):
            raise InputError(problem)
        return run_job(job)


@contextmanager
def _connected(address: str) -> Iterator[Any]:
    try:
        # it has types in part only
        distributed: Any = import_module("distributed")
    except ImportError as error:
        raise InputError("--scheduler needs the package distributed: pip install distributed") from error
    try:
        client = distributed.Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"scheduler {address}: not reachable within {_CONNECT_S} s ({error}); start one with `dask scheduler`, its"
            " address is the one it prints"
        ) from error
    try:
        yield client
    finally:
        client.close()


def _check_workers(client: Any, address: str, lock: Path, threads: int) -> None:
    try:
        client.wait_for_workers(1, timeout=_FIRST_WORKER_S)
    except TimeoutError as error:
        raise InputError(
            f"scheduler {address}: it has had no worker for {_FIRST_WORKER_S} s; start some with"
            f" `dask worker {address} --nthreads 1`"
        ) from error
    for worker, count in client.nthreads().items():
        if count != 1:
            raise InputError(
                f"worker {worker} runs {count} tasks at once, and gmsh only one a process; start it with --nthreads 1"
            )
    for worker, problem in client.run(worker_problem, lock, threads).items():
        if problem:
            raise InputError(f"worker {worker}: {problem}")


def worker_problem(lock: Path, threads: int) -> str | None:
    """Why this process cannot work on a run: it does not see the folder, or computes on other threads."""
    if problem := other_threads(threads):
        return f"{problem}; set it before the worker is started, and --threads likewise"
    end = time.monotonic() + _SEEN_S
    while not os.path.exists(lock):
        if time.monotonic() > end:
            return (
                f"{socket.gethostname()} does not see {lock}; --out must be on a file system that all workers share,"
                " under the same path"
            )
        time.sleep(0.2)
    return None
