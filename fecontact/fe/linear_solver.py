"""Linear systems of a body: Cholesky factors by MKL PARDISO, or conjugate gradients with algebraic multigrid."""

from __future__ import annotations

import contextlib
import os
import sys
from collections import deque
from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, files
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix, csr_matrix, diags, triu
from scipy.sparse.linalg import cg

from fecontact.errors import ConvergenceError, InputError
from fecontact.fe.memory import USABLE_MEMORY, check_memory, factor_bytes

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
SolverName = Literal["pardiso", "amg"]
LinearSolver = Callable[[Floats], Floats]
_MKL_PATH = "PYPARDISO_MKL_RT"
# Far below the contact solver's own tolerance, so that its residuals are those of the contact problem.
AMG_TOLERANCE = 1e-10
_AMG_ITERATIONS = 400
# Of both bodies under a single load: from here on multigrid is the cheaper one. Factors or hierarchy and first load
# take, in CPU seconds of one core (AMD EPYC, virtual, 2026; cylinder R 460 on R 300), 0.7 and 1.5 with 31 thousand, 2.1
# and 4.8 with 69, 3.6 and 6.8 with 100, 11.6 and 12.4 with 188; they grow with n^1.8 and n^1 there. A further load
# takes 0.1 of the first one with factors, 0.6 of it without.
_MULTIGRID_UNKNOWNS = 200_000
# The level that is solved directly, with six degrees of freedom a node.
_COARSEST_NODES = 80
_MOST_LEVELS = 10
# Connections up to this many times the shortest one of a node are strong.
_NEAR = 3.0
# Earlier solutions that a new one begins with; combinations that differ by less than this part are the same.
_REMEMBERED = 8
_INDEPENDENT = 1e-12


def pardiso_available() -> bool:
    """Whether MKL PARDISO can be loaded on this machine."""
    try:
        return _pypardiso() is not None
    except (ImportError, OSError):
        return False


def _pypardiso() -> Any:
    """The package, told where MKL is: it asks the compiler and lists all of the environment, twice in 0.5 s."""
    if _MKL_PATH not in os.environ:
        with contextlib.suppress(PackageNotFoundError):
            for path in files("mkl") or ():
                if path.name.startswith(("libmkl_rt.", "mkl_rt.")):
                    os.environ[_MKL_PATH] = str(path.locate())
    import pypardiso

    return pypardiso


def choose_solver(
    wanted: Literal["auto", "pardiso", "amg"], degrees_of_freedom: Sequence[int] = (), *, several_loads: bool = True
) -> SolverName:
    """Name of the solver path to take for bodies with so many degrees of freedom, which are solved at the same time.

    `auto` takes PARDISO where the platform has it, its factors fit into the available memory, and it is the cheaper one
    by size and number of loads (studies/benchmark.py); otherwise multigrid, which needs a third to a half of the
    memory.

    Raises
    ------
    InputError
        If PARDISO is asked for and this platform does not have it.
    """
    import psutil

    if wanted == "auto":
        needed = sum(factor_bytes(count) for count in degrees_of_freedom)
        fits = needed <= USABLE_MEMORY * float(psutil.virtual_memory().available)
        cheaper = several_loads or sum(degrees_of_freedom) <= _MULTIGRID_UNKNOWNS
        return "pardiso" if pardiso_available() and fits and cheaper else "amg"
    if wanted == "pardiso" and not pardiso_available():
        raise InputError(
            "solver pardiso: MKL cannot be loaded here; pip install pypardiso (x86-64 Linux and Windows), or use auto"
            " or amg"
        )
    return wanted


def _pardiso() -> Any:
    solver = _pypardiso().PyPardisoSolver(mtype=2)
    os.environ.setdefault(_MKL_PATH, solver.libmkl._name)
    # own values: nested dissection, no refinement of the solution (with it a solution takes 2.6 times as long, and
    # Cholesky needs none: errors are of rounding size without it)
    solver.iparm[0], solver.iparm[1] = 1, 2
    return solver


class _PardisoFactor:
    """Cholesky factor by MKL PARDISO (symmetric positive definite, upper triangle)."""

    def __init__(self, matrix: csr_matrix, free: Integers) -> None:
        self._free = free
        self._upper = triu(matrix[free][:, free], format="csr")
        self._upper.sort_indices()
        self._pardiso = _pardiso()
        self._run(11)
        # the analysis knows the size of the factor (KB): peak while ordering, or factor and its work space
        peak, permanent, factor = (self._pardiso.get_iparm(k) for k in (15, 16, 17))
        check_memory(1024.0 * max(peak, permanent + factor), f"the factor of {free.size} degrees of freedom")
        self._run(22)
        self._pardiso.set_phase(33)

    def _run(self, phase: int) -> None:
        self._pardiso.set_phase(phase)
        self._pardiso._call_pardiso(self._upper, np.zeros(self._free.size))

    def __call__(self, forces: Floats) -> Floats:
        u = np.zeros_like(forces)
        u[self._free] = self._pardiso._call_pardiso(self._upper, np.ascontiguousarray(forces[self._free]))
        return u

    def release(self) -> None:
        if self._upper is not None:
            # all of this factor's memory, that of the analysis as well
            self._pardiso.free_memory(everything=True)
            self._upper = None

    def __del__(self) -> None:
        # MKL's memory is not Python's; at the interpreter's end the process gives it back anyway
        if getattr(self, "_upper", None) is not None and not sys.is_finalizing():
            self.release()


def pardiso_solver(matrix: csr_matrix, free: Integers, points: Floats) -> LinearSolver:
    """Factors by MKL's PARDISO of the free degrees of freedom; it needs no points."""
    return _PardisoFactor(matrix, free)


def amg_solver(matrix: csr_matrix, free: Integers, points: Floats) -> LinearSolver:
    """Conjugate gradients with smoothed aggregation; held degrees of freedom stay as decoupled rows, so that the
    3 x 3 blocks of the nodes stay whole.
    """
    import pyamg

    moves = np.zeros(matrix.shape[0])
    moves[free] = 1.0
    keep = diags(moves)
    scale = float(matrix.diagonal().mean())
    held = (keep @ matrix @ keep + diags(scale * (1.0 - moves))).tobsr(blocksize=(3, 3))
    strengths, aggregates = _near_neighbours(held, points)
    hierarchy = pyamg.smoothed_aggregation_solver(
        held,
        B=rigid_body_modes(points) * moves[:, None],
        strength=strengths,
        aggregate=aggregates,
        smooth=("energy", {"krylov": "cg", "maxiter": 3}),
        presmoother=("block_gauss_seidel", {"sweep": "forward"}),
        postsmoother=("block_gauss_seidel", {"sweep": "backward"}),
        improve_candidates=None,
    )
    return _MultigridSolver(held, moves, hierarchy.aspreconditioner())


def _near_neighbours(matrix: bsr_matrix, points: Floats) -> tuple[list[Any], list[Any]]:
    """Strength of connection and aggregates of each level, by distance: a node goes together with the nearest ones.

    The elements are up to a hundred times as long as thin where the fine zone is swept to the cut planes. Errors vary
    slowly only across their thin sides, so that only there nodes may be put together. What is read off the matrix
    instead misses that on the coarse levels: six times as many iterations with 230 thousand degrees of freedom.
    """
    from pyamg.aggregation import standard_aggregation
    from pyamg.strength import distance_strength_of_connection

    graph = csr_matrix((np.ones(matrix.indices.size), matrix.indices, matrix.indptr))
    strengths, aggregates = [], []
    for _ in range(_MOST_LEVELS):
        strength = distance_strength_of_connection(graph, points, theta=_NEAR)
        aggregate, _ = standard_aggregation(strength)
        strengths.append(("predefined", {"C": strength}))
        aggregates.append(("predefined", {"AggOp": aggregate}))
        members = csr_matrix(aggregate, dtype=float)
        points = (members.T @ points) / np.asarray(members.sum(axis=0)).reshape(-1, 1)
        if len(points) <= _COARSEST_NODES:
            break
        # aggregates meet where their smoothed basis functions do
        reached = csr_matrix(strength) @ members
        graph = csr_matrix(reached.T @ graph @ reached)
        graph.data[:] = 1.0
    return strengths, aggregates


class _MultigridSolver:
    """Preconditioned conjugate gradients that begin with the best combination of the last solutions."""

    def __init__(self, matrix: bsr_matrix, moves: Floats, preconditioner: Any) -> None:
        self._matrix, self._moves, self._preconditioner = matrix, moves, preconditioner
        self._solved: deque[tuple[Floats, Floats]] = deque(maxlen=_REMEMBERED)

    def __call__(self, forces: Floats) -> Floats:
        load = forces * self._moves
        u, info = cg(
            self._matrix,
            load,
            x0=self._first_guess(load),
            rtol=AMG_TOLERANCE,
            maxiter=_AMG_ITERATIONS,
            M=self._preconditioner,
        )
        if info != 0:
            norm = float(np.linalg.norm(load))
            residual = float(np.linalg.norm(load - self._matrix @ u))
            raise ConvergenceError(
                f"multigrid: residual {residual / norm:.1e} after {_AMG_ITERATIONS} iterations"
                f" (wanted {AMG_TOLERANCE:g}); use the pardiso solver or a coarser resolution"
            )
        self._solved.append((load, u))
        return np.asarray(u)

    def _first_guess(self, load: Floats) -> Floats | None:
        """The combination of earlier solutions with the least elastic energy of the error."""
        if not self._solved:
            return None
        loads, solutions = (np.array(column) for column in zip(*self._solved, strict=True))
        part, *_ = np.linalg.lstsq(solutions @ loads.T, solutions @ load, rcond=_INDEPENDENT)
        return np.asarray(part @ solutions)


def rigid_body_modes(points: Floats) -> Floats:
    """The six rigid body displacements (3n, 6) of points (n, 3), about their centre and scaled to its size."""
    p = (points - points.mean(axis=0)) / np.ptp(points, axis=0).max()
    modes = np.zeros((len(points), 3, 6))
    modes[:, [0, 1, 2], [0, 1, 2]] = 1.0
    for k, (i, j) in enumerate(((0, 1), (1, 2), (2, 0))):
        modes[:, i, 3 + k] = -p[:, j]
        modes[:, j, 3 + k] = p[:, i]
    return modes.reshape(-1, 6)
