"""Jobs on a Dask cluster with workers that share the folder of the results."""

from __future__ import annotations

import contextlib
import logging
import os
import re
import socket
import time
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.jobs.workers import (
    Crew,
    Job,
    JobGroup,
    JobOutcome,
    describe_worker_differences,
    describe_wrong_threads,
    run_group,
)

_CONNECT_S = 10
_FIRST_WORKER_S = 60
# Longest wait for the lock file: a new file may be visible on another machine only after a moment.
_LOCK_FILE_WAIT_S = 5.0
_RETRIES = 2
_PAUSE_S = 1.0
_TOPIC = "fecontact"
_LOGGERS_TO_SILENCE = ("distributed", "tornado", "asyncio", "concurrent")
# host names have labels of at most 63 characters; an IPv6 address is in brackets
_ADDRESS = re.compile(r"((tcp|tls)://)?(\[[0-9a-fA-F:.]+\]|[\w-]{1,63}(\.[\w-]{1,63})*):(?P<port>[0-9]{1,5})")
_LOG = logging.getLogger(__name__)


@contextmanager
def dask_crew(address: str, lock: Path, threads: int) -> Iterator[Crew]:
    """Connect to the workers of a Dask cluster.

    Parameters
    ----------
    address
        Address of the scheduler, such as tcp://10.0.0.1:8786.
    lock
        Lock file of the folder of the results, which every worker must see.
    threads
        Threads of each job; workers with another number of threads in their environment are refused.

    Yields
    ------
    Crew
        The workers of the cluster.

    Raises
    ------
    InputError
        If `distributed` is not installed, the scheduler is not reachable, no worker comes, or a worker does not see the
        folder, or runs several tasks at once.
    """
    with ExitStack() as stack:
        client = stack.enter_context(_connect(address))
        _check_workers(client, address, lock, threads)

        @contextmanager
        def open_executor(count: int) -> Iterator[Executor]:
            executor = client.get_executor(retries=_RETRIES)
            try:
                yield executor
            finally:
                executor.shutdown(wait=False)

        # each problem of a worker is logged once
        log_once = cache(lambda problem: _LOG.warning("%s; other workers take its jobs", problem))
        client.subscribe_topic(_TOPIC, lambda event: log_once(event[1]))
        # all jobs are handed out at once: the cluster distributes them, and runs the jobs of a lost worker again
        yield Crew(
            open=open_executor,
            workers=max(2, len(client.nthreads())),
            together=10**9,
            run=partial(_run, lock, threads),
            refuse=partial(_refuse_if_all_differ, client),
            lost=partial(_explain_loss, client, address),
        )


def _run(lock: Path, threads: int, jobs: JobGroup) -> tuple[JobOutcome, ...]:
    """Do `run_group` on a worker that passes the checks.

    A worker that came later may fail the checks; it returns its jobs to the other workers.
    """
    if problem := find_worker_problem(lock, threads) or describe_worker_differences(jobs[0]):
        distributed: Any = import_module("distributed")
        worker = distributed.get_worker()
        worker.log_event(_TOPIC, problem)
        time.sleep(_PAUSE_S)
        worker.loop.add_callback(_pause_worker, worker)
        raise distributed.Reschedule
    return run_group(jobs)


def _pause_worker(worker: Any) -> None:
    """Pause a worker for `_PAUSE_S`: the scheduler would hand a returned job to this idle worker again."""
    status = import_module("distributed.core").Status
    worker.status = status.paused
    worker.loop.call_later(_PAUSE_S, partial(setattr, worker, "status", status.running))


def _refuse_if_all_differ(client: Any, job: Job) -> None:
    problems = client.run(describe_worker_differences, job, on_error="return")
    if problems and all(problems.values()):
        worker, problem = next(iter(problems.items()))
        raise InputError(f"worker {worker}: {problem}; start workers with the same installation")


def _explain_loss(client: Any, address: str) -> str | None:
    if client.status == "running":
        return None
    return (
        f"scheduler {address}: connection lost during the run; finished jobs are kept; start a scheduler and workers,"
        " and run the same command with the new address"
    )


@contextmanager
def _connect(address: str) -> Iterator[Any]:
    """Connect to a scheduler and yield the client.

    The client is closed at the end of the context.

    Raises
    ------
    InputError
        If the package distributed is missing, an encrypted connection lacks its certificates, or the scheduler does not
        answer within `_CONNECT_S`.
    """
    try:
        # distributed is typed only in part
        distributed: Any = import_module("distributed")
    except ImportError as error:
        raise InputError("--scheduler needs the package distributed; install it: pip install distributed") from error
    security = _read_certificates(distributed, address)
    try:
        with _silence_loggers():
            client = distributed.Client(address, timeout=_CONNECT_S, set_as_default=False, security=security)
    except (OSError, ValueError) as error:
        raise InputError(
            f"scheduler {address}: not reachable within {_CONNECT_S} s ({str(error) or type(error).__name__}); start a"
            " scheduler with `dask scheduler --host 127.0.0.1`, and give the address that it prints"
        ) from error
    try:
        with _silence_loggers():
            yield client
    finally:
        # closing fails if the scheduler is gone
        with _silence_loggers(), contextlib.suppress(Exception):
            client.close()


def _read_certificates(distributed: Any, address: str) -> Any:
    """Check an address, and read the certificates of the client from the configuration of Dask.

    A client of Dask that refuses an address, or lacks a certificate, is not closed by Dask: it holds the program for
    20 s and ends with a traceback. So both are checked before a client is made.

    Raises
    ------
    InputError
        If the address has another form, if a certificate or key cannot be read, if an encrypted address has no
        certificates, or if the configuration requires encryption and the address is not encrypted.
    """
    match = _ADDRESS.fullmatch(address)
    if match is None or not 0 < int(match["port"]) < 65536:
        raise InputError(
            f"scheduler is {address!r:.200}; allowed: tcp://HOST:PORT or tls://HOST:PORT; give the address that `dask"
            " scheduler` prints"
        )
    try:
        security = distributed.Security()
        context = security.get_connection_args("client").get("ssl_context")
    # ssl.SSLError is an OSError
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"scheduler {address}: the certificate or key of the client cannot be read ({error}); set the variables"
            " DASK_DISTRIBUTED__COMM__TLS__CA_FILE, ..CLIENT__CERT and ..CLIENT__KEY to PEM files"
        ) from error
    if address.startswith("tls:") and context is None:
        raise InputError(
            f"scheduler {address}: no certificate for an encrypted connection; set the variables"
            " DASK_DISTRIBUTED__COMM__TLS__CA_FILE, ..CLIENT__CERT and ..CLIENT__KEY to PEM files, see `fecontact guide"
            " trust`"
        )
    if security.require_encryption and not address.startswith("tls:"):
        raise InputError(
            f"scheduler {address}: not encrypted, but the configuration of Dask requires encryption; give an address"
            " that starts with tls://"
        )
    return security


@contextmanager
def _silence_loggers() -> Iterator[None]:
    """Silence loggers that report a lost scheduler with tracebacks.

    The rows of the run report the lost scheduler.
    """
    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in _LOGGERS_TO_SILENCE]
    loggers = [logging.getLogger(name) for name in names]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def _check_workers(client: Any, address: str, lock: Path, threads: int) -> None:
    """Wait for the first worker, and refuse workers that cannot work on the run.

    Raises
    ------
    InputError
        If no worker comes within `_FIRST_WORKER_S`, if a worker has several threads, or if it reports a problem.
    """
    try:
        client.wait_for_workers(1, timeout=_FIRST_WORKER_S)
    except TimeoutError as error:
        raise InputError(
            f"scheduler {address}: no worker within {_FIRST_WORKER_S} s; start workers with"
            f" `dask worker {address} --nthreads 1`"
        ) from error
    for worker, count in client.nthreads().items():
        if count != 1:
            raise InputError(
                f"worker {worker} runs {count} tasks at once; allowed: 1, because of gmsh; start it with --nthreads 1"
            )
    for worker, problem in client.run(find_worker_problem, lock, threads, on_error="return").items():
        if problem:
            raise InputError(f"worker {worker}: {problem}")


def find_worker_problem(lock: Path, threads: int) -> str | None:
    """Explain why this process cannot work on a run.

    Parameters
    ----------
    lock
        Lock file of the run, which this process must see within 5 s.
    threads
        Threads of each job.

    Returns
    -------
    str or None
        The problem: this process does not see the folder, or has another number of threads. None without a problem.
    """
    if problem := describe_wrong_threads(threads):
        return f"{problem}; set it before you start the worker, and give the same number with --threads"
    end = time.monotonic() + _LOCK_FILE_WAIT_S
    while not os.path.exists(lock):
        if time.monotonic() > end:
            return (
                f"{socket.gethostname()} does not see {lock}; give an --out on a file system that all workers share,"
                " under the same path"
            )
        time.sleep(0.2)
    return None
