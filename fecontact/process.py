"""Settings that each process of the program makes, main process and workers alike."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from fecontact.errors import InputError

THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
"""Variables of the environment for the number of threads of the numerical libraries."""


def collect_rarely() -> None:
    """Let Python search all objects for reference cycles half as often.

    Modules and most objects of a solution stay alive. Searching them takes 3 to 4 % of the time.
    """
    gc.set_threshold(gc.get_threshold()[0], 20, 20)


def count_cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def limit_dense_threads() -> None:
    """Use a single thread for dense matrices, unless the environment has a number.

    The dense matrices of a case are small: on two cores, the second thread costs two thirds more CPU time and saves no
    time (`studies/benchmark.py`). NumPy reads the variable when it is imported.
    """
    if "OMP_NUM_THREADS" not in os.environ:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


_factor_threads: ContextVar[int | None] = ContextVar("factor_threads", default=None)


@contextmanager
def use_factor_threads(threads: int | None) -> Iterator[None]:
    """Factor and solve with a number of threads in the enclosed code.

    Parameters
    ----------
    threads
        Number of threads; None leaves the choice to the program.

    Yields
    ------
    None
        Control to the enclosed code.

    Raises
    ------
    InputError
        If the number is less than 1 or larger than the number of cores.
    """
    if threads is not None and not 1 <= threads <= count_cores():
        raise InputError(f"threads is {threads}; allowed: 1 to {count_cores()}, the cores of this process")
    token = _factor_threads.set(threads)
    try:
        yield
    finally:
        _factor_threads.reset(token)


def read_factor_threads() -> int | None:
    """Number of threads of `use_factor_threads`; None without a number."""
    return _factor_threads.get()
