"""Threads of one process, and daemonic processes such as workers of `multiprocessing.Pool`."""

import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import pytest

import fecontact
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.fe.linear_solver import count_factor_threads
from fecontact.jobs.workers import make_process_crew, open_evaluators
from fecontact.process import use_factor_threads

# Two sessions of gmsh at a time end the process: each of these scripts has a process of its own.
SECTIONS = """
from concurrent.futures import ThreadPoolExecutor
import numpy as np
from fecontact.fe.section import _mesh_polygon

def square(corners):
    angle = np.linspace(0.0, 2.0 * np.pi, 2 * corners, endpoint=False)
    return _mesh_polygon(10.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1))

sizes = [20, 40, 30, 24] * 3
alone = list(map(square, sizes))
with ThreadPoolExecutor(4) as threads:
    together = list(threads.map(square, sizes))
assert all(np.array_equal(a, b) for one, other in zip(alone, together) for a, b in zip(one, other))
print("equal")
"""
SOLVES = """
from concurrent.futures import ThreadPoolExecutor
import io
import numpy as np
import fecontact

def solved(shift_mm):
    result = fecontact.solve(fecontact.Case(lateral_shift_mm=shift_mm))
    figure = fecontact.plot.case(result)
    content = io.BytesIO()
    figure.savefig(content, format="png")
    return result.pressure_MPa, content.getvalue()

shifts = [3.0, -3.0]
alone = list(map(solved, shifts))
with ThreadPoolExecutor(2) as threads:
    together = list(threads.map(solved, shifts))
for (pressure, picture), (other, other_picture) in zip(alone, together):
    assert np.array_equal(pressure, other)
    assert picture == other_picture
print("equal")
"""


@pytest.mark.parametrize(
    "script", [pytest.param(SECTIONS, id="sections"), pytest.param(SOLVES, id="solves", marks=pytest.mark.slow)]
)
def test_threads_of_one_process_have_the_bits_of_one_after_the_other(script):
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=600)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "equal\n", "")


def _pid(_: int) -> int:
    return os.getpid()


def _count_workers(_: int) -> tuple[int, list[int], int, int]:
    with open_evaluators(2, here=False, workers=2) as map_over:
        evaluated = list(map_over(_pid, range(2)))
    crew = make_process_crew(2, 1)
    with crew.open(crew.workers) as executor:
        return os.getpid(), evaluated, crew.workers, executor.submit(_pid, 0).result()


def test_a_daemonic_process_does_its_work_itself():
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        own_threads, evaluated, workers, submitted = pool.apply(_count_workers, (0,))
    assert own_threads != os.getpid()
    assert (evaluated, workers, submitted) == ([own_threads, own_threads], 1, own_threads)


def _answers(out: Path, workers: int) -> list[str]:
    case = fecontact.Case(lateral_shift_mm=3.0)
    (row,) = fecontact.run([case], out / "run", workers=workers).rows
    (cell,) = fecontact.map(case, [3.0], [100e3], out / "map", workers=workers).made
    return [str(row["verdict_answer"]), cell.verdict]


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_studies_and_maps_run_in_a_daemonic_process(workers, tmp_path):
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(_answers, (tmp_path, workers)) == ["FAILS", "FAILS"]


def print_threads(**environment):
    """Threads of three factors on 4 cores, and the variable of OpenBLAS."""
    script = (
        "import os, fecontact.process as process\n"
        "process.limit_dense_threads()\n"
        "import fecontact.fe.linear_solver as solver\n"
        "solver.count_cores = lambda: 4\n"
        "print(*map(solver.count_factor_threads, (1000, 60_000, 10**6)), os.environ.get('OPENBLAS_NUM_THREADS'))"
    )
    without = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    ended = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=without | environment, check=True
    )
    return ended.stdout.split()


def test_threads_follow_the_size_of_a_factor():
    assert print_threads() == ["1", "2", "4", "1"]


@pytest.mark.parametrize("name", ["OMP_NUM_THREADS", "MKL_NUM_THREADS"])
def test_threads_of_the_environment_are_kept(name):
    assert print_threads(**{name: "3"})[:3] == ["0", "0", "0"]
    assert print_threads(OMP_NUM_THREADS="3")[3] == "None"
    assert print_threads(OPENBLAS_NUM_THREADS="2")[3] == "2"


def test_given_threads_have_precedence_and_are_limited_by_the_cores(monkeypatch, capsys):
    monkeypatch.setattr("fecontact.process.count_cores", lambda: 4)
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    with use_factor_threads(3):
        assert [count_factor_threads(unknowns) for unknowns in (1000, 10**6)] == [3, 3]
        with use_factor_threads(None):
            assert count_factor_threads(1000) == 0
    assert count_factor_threads(10**6) == 0
    for threads in ("0", "5"):
        assert call(["solve", "--threads", threads]) == 2
        assert f"threads is {threads}; allowed: 1 to 4" in capsys.readouterr().err


@pytest.mark.parametrize("words", [[], ["--wheelset"]])
def test_solve_uses_the_given_threads(words, monkeypatch):
    threads = []

    def stop(*_, **__):
        threads.append(count_factor_threads(10**6))
        raise InputError("stopped")

    monkeypatch.setattr("fecontact.process.count_cores", lambda: 4)
    monkeypatch.setattr("fecontact.solving.solve.solve", stop)
    monkeypatch.setattr("fecontact.solving.wheelset_solution.solve_wheelset", stop)
    assert call(["solve", "--threads", "4", *words]) == 2
    assert threads == [4]
