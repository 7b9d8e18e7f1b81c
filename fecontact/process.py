"""Settings that each process of the program makes, main process and workers alike."""

from __future__ import annotations

import gc
import os

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
