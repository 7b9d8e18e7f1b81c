"""Shared fixtures of the tests: solved cases, and settings of hypothesis."""

# ruff: noqa: E402 - threads are set before NumPy is imported

import hashlib
import os
import pickle
from collections.abc import Callable
from functools import cache

# Numbers are compared to the last bit, which hangs on the threads of a sum; set before NumPy is imported.
for _name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import pytest
from declared_keys import find_record_faults, find_undeclared_columns
from hypothesis import settings

from fecontact.case import Case
from fecontact.runs.store import CaseRecords
from fecontact.solving.solve import CaseResult, solve

try:
    import fcntl
except ImportError:
    fcntl = None

# An example that takes longer than usual says that the machine is busy, not that the code is wrong.
settings.register_profile("fecontact", deadline=None)
settings.load_profile("fecontact")


@pytest.fixture(scope="session")
def solved(tmp_path_factory) -> Callable[[Case], CaseResult]:
    """Solver of a case, once for all tests and all their processes.

    Its result has everything but the factors.
    """
    folder = tmp_path_factory.getbasetemp()
    if fcntl is not None and "PYTEST_XDIST_WORKER" in os.environ:
        # each process has a folder of its own in that of the run
        folder = folder.parent
    (folder / "solved").mkdir(exist_ok=True)

    @cache
    def solved_once(case: Case) -> CaseResult:
        """Result of a case, solved once for all processes."""
        name = hashlib.sha256(repr(case).encode()).hexdigest()
        with (folder / "solved" / name).open("a+b") as file:
            if fcntl is not None:
                fcntl.flock(file, fcntl.LOCK_EX)
            if file.seek(0, os.SEEK_END) == 0:
                pickle.dump(solve(case), file)
            file.seek(0)
            return pickle.load(file)

    return solved_once


@pytest.fixture(scope="session")
def elliptic_quick(solved) -> CaseResult:
    """A cylinder on a cylinder at quick resolution: Hertz holds, in a half model of a few thousand elements."""
    return solved(
        Case(
            rail="circle:300",
            wheel="cylinder:460",
            inclination_rad=0.0,
            resolution="quick",
            refine="never",
        )
    )


@pytest.fixture(autouse=True)
def stored_results_have_the_declared_keys(monkeypatch):
    """Hold every result that a test stores to the declared keys and columns."""
    make_records = CaseRecords.of.__func__

    def make_checked_records(kind: type[CaseRecords], result: CaseResult) -> CaseRecords:
        records = make_records(kind, result)
        faults = find_record_faults(records.record)
        assert not faults, faults
        undeclared_columns = find_undeclared_columns(records.row, result.case.criteria.own_measures)
        assert not undeclared_columns, undeclared_columns
        return records

    monkeypatch.setattr(CaseRecords, "of", classmethod(make_checked_records))
