"""Linear systems of a body: conjugate gradients with a Cholesky factor by MKL PARDISO, or with multigrid by pyamg."""

from __future__ import annotations

import contextlib
import os
import sys
from collections import deque
from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, files
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix, csr_matrix
from scipy.sparse.linalg import LinearOperator, cg

from fecontact.arrays import Floats, Integers
from fecontact.errors import ConvergenceError, InputError
from fecontact.fe.memory import USABLE_MEMORY, check_memory, factor_bytes

SolverName = Literal["pardiso", "amg"]
# Displacements (3n,) in mm under forces (3n,) in N, to a tolerance of the residual.
LinearSolver = Callable[[Floats, float], Floats]
_MKL_PATH = "PYPARDISO_MKL_RT"
# Far below the contact solver's tolerance, so that the contact residuals do not contain this error.
LINEAR_TOLERANCE = 1e-9
_MOST_ITERATIONS = {"pardiso": 20, "amg": 400}
# Unknowns of both bodies above which multigrid is cheaper for a single load. CPU seconds of one core (AMD EPYC,
# virtual, 2026; cylinder R 460 on R 300) for the first load, by factors and by multigrid: 1.7 and 2.9 with 52 thousand
# unknowns, 6.1 and 8.8 with 140, 15 and 20 with 283, 28 and 31 with 426. A further load takes 0.06 of this time by
# factors, 0.3 by multigrid.
_MULTIGRID_UNKNOWNS = 450_000
# Largest level that is solved directly, with six degrees of freedom a node.
_COARSEST_NODES = 80
_MOST_LEVELS = 10
# A connection of a node is strong up to this many times the length of its shortest connection.
_NEAR = 3.0
# Number of earlier solutions for the first guess of a new one, and the relative size below which a singular value of
# their combination is zero.
_REMEMBERED = 8
_INDEPENDENT = 1e-12


def pardiso_available() -> bool:
    """Whether MKL PARDISO can be loaded on this machine."""
    try:
        return _pypardiso() is not None
    except (ImportError, OSError):
        return False


def _pypardiso() -> Any:
    """The package pypardiso, told where MKL is: its own search of the whole environment takes 0.5 s."""
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
    """Linear solver for bodies with these degrees of freedom, which are solved at the same time.

    `auto` takes PARDISO if the platform has it, its factors fit into the available memory, and it is cheaper for this
    size and number of loads (studies/benchmark.py). Else it takes multigrid, which needs a third to a half of the
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
    # nested dissection, somewhat slower at that and faster after it
    solver.iparm[0], solver.iparm[1] = 1, 32
    # single precision
    solver.iparm[27] = 1
    # 3 x 3 blocks: their graph is ordered in a third of the time
    solver.iparm[36] = 3
    return solver


class _PardisoFactor:
    """Cholesky factor by MKL PARDISO (symmetric positive definite, upper triangle of blocks), in single precision.

    It takes two thirds of the time and half of the memory of one in double precision. Its solutions leave
    residuals of 2e-5 to 2e-4 (13 to 115 thousand unknowns): two or three steps of conjugate gradients reach 1e-9.
    """

    def __init__(self, matrix: bsr_matrix) -> None:
        rows = _block_rows(matrix)
        count = matrix.indptr.size - 1
        upper = matrix.indices >= rows
        # what pypardiso hands over, which knows no blocks; PARDISO reads each of them by columns
        self._upper: Any = SimpleNamespace(
            shape=(count, count),
            data=matrix.data[upper].transpose(0, 2, 1).astype(np.float32, order="C"),
            indices=matrix.indices[upper],
            indptr=np.searchsorted(rows[upper], np.arange(count + 1)),
        )
        self._pardiso = _pardiso()
        nothing = np.zeros(matrix.shape[0])
        self._run(11, nothing)
        # the analysis gives the memory in KB: the peak while ordering, or the factor and its work space
        peak, permanent, factor = (self._pardiso.get_iparm(k) for k in (15, 16, 17))
        check_memory(1024.0 * max(peak, permanent + factor), f"the factor of {matrix.shape[0]} degrees of freedom")
        self._run(22, nothing)

    def _run(self, phase: int, forces: Floats) -> Floats:
        from pypardiso.pardiso_wrapper import PyPardisoError

        self._pardiso.set_phase(phase)
        try:
            return np.asarray(self._pardiso._call_pardiso(self._upper, forces.astype(np.float32)), dtype=float)
        except PyPardisoError as error:
            # such as a pivot that single precision has as zero
            raise ConvergenceError(
                f"solver pardiso: no factor of {forces.size} degrees of freedom ({error}); use the amg solver or a"
                " coarser resolution"
            ) from error

    def __call__(self, forces: Floats) -> Floats:
        return self._run(33, forces)

    def release(self) -> None:
        if self._upper is not None:
            # memory of the factor and of the analysis
            self._pardiso.free_memory(everything=True)
            self._upper = None

    def __del__(self) -> None:
        # Python does not release MKL's memory; at the interpreter's end the operating system does
        if getattr(self, "_upper", None) is not None and not sys.is_finalizing():
            self.release()


def _block_rows(matrix: bsr_matrix) -> Integers:
    """Row of each block (k,)."""
    return np.repeat(np.arange(matrix.indptr.size - 1), np.diff(matrix.indptr))


def decouple_fixed(matrix: bsr_matrix, moves: NDArray[np.bool_]) -> bsr_matrix:
    """The matrix with what does not move (n, 3) decoupled, so that each node keeps its 3 x 3 block."""
    rows, columns = _block_rows(matrix), matrix.indices
    data, holds = matrix.data.copy(), np.logical_not(moves.all(axis=1))
    beside = np.flatnonzero(holds[rows] | holds[columns])
    data[beside] *= moves[rows[beside]][:, :, None] & moves[columns[beside]][:, None, :]
    held = np.zeros((len(moves), 3, 3))
    held[:, range(3), range(3)] = float(matrix.diagonal().mean()) * ~moves
    data[rows == columns] += held
    return bsr_matrix((data, columns, matrix.indptr), shape=matrix.shape)


def _multigrid(matrix: bsr_matrix, moves: NDArray[np.bool_], points: Floats) -> Callable[[Floats], Floats]:
    """One cycle of smoothed aggregation."""
    import pyamg

    strengths, aggregates = _near_neighbours(matrix, points)
    hierarchy = pyamg.smoothed_aggregation_solver(
        matrix,
        B=rigid_body_modes(points) * moves.reshape(-1, 1),
        strength=strengths,
        aggregate=aggregates,
        smooth=("energy", {"krylov": "cg", "maxiter": 3}),
        presmoother=("block_gauss_seidel", {"sweep": "forward"}),
        postsmoother=("block_gauss_seidel", {"sweep": "backward"}),
        improve_candidates=None,
    )
    cycle: Callable[[Floats], Floats] = hierarchy.aspreconditioner().matvec
    return cycle


def _near_neighbours(matrix: bsr_matrix, points: Floats) -> tuple[list[Any], list[Any]]:
    """Strength of connection and aggregates of each level: a node is put together with its nearest neighbours.

    The elements are up to a hundred times as long as thin where the fine zone is swept to the cut planes. Errors vary
    slowly only across the thin sides, so that nodes may be put together only there. A strength from the matrix entries
    misses this on coarse levels: six times as many iterations with 230 thousand degrees of freedom.
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
        # two aggregates are connected if their smoothed basis functions overlap
        reached = csr_matrix(strength) @ members
        graph = csr_matrix(reached.T @ graph @ reached)
        graph.data[:] = 1.0
    return strengths, aggregates


class ConjugateGradients:
    """Preconditioned conjugate gradients, started from the best combination of the last solutions."""

    def __init__(self, matrix: bsr_matrix, moves: NDArray[np.bool_], points: Floats, solver: SolverName) -> None:
        """Factor, or build the multigrid hierarchy of, a matrix whose nodes `moves` (n, 3) says to be free."""
        self._matrix, self._moves, self._solver = matrix, moves.ravel(), solver
        self._nearly = _PardisoFactor(matrix) if solver == "pardiso" else _multigrid(matrix, moves, points)
        self._solved: deque[tuple[Floats, Floats]] = deque(maxlen=_REMEMBERED)

    def __call__(self, forces: Floats, tolerance: float, whole_N: float = 0.0) -> Floats:
        """Displacements (3n,) in mm under forces (3n,) in N; they may be a small part of a load of this size."""
        load, most = forces * self._moves, _MOST_ITERATIONS[self._solver]
        u, info = cg(
            self._matrix,
            load,
            x0=self._first_guess(load),
            rtol=tolerance,
            atol=tolerance * whole_N,
            maxiter=most,
            M=LinearOperator(self._matrix.shape, self._nearly, dtype=float),
        )
        if info != 0:
            norm = float(np.linalg.norm(load))
            residual = float(np.linalg.norm(load - self._matrix @ u))
            other = "amg" if self._solver == "pardiso" else "pardiso"
            raise ConvergenceError(
                f"solver {self._solver}: residual {residual / norm:.1e} after {most} iterations"
                f" (wanted {tolerance:g}); use the {other} solver or a coarser resolution"
            )
        self._solved.append((load, u))
        return np.asarray(u)

    def forget(self) -> None:
        """Begin the next solution from nothing, so that its last digits do not hang on those before."""
        self._solved.clear()

    def release(self) -> None:
        """Release the memory of a factor now."""
        getattr(self._nearly, "release", lambda: None)()

    def _first_guess(self, load: Floats) -> Floats | None:
        """Combination of earlier solutions whose error has the least elastic energy."""
        if not self._solved:
            return None
        loads, solutions = (np.array(column) for column in zip(*self._solved, strict=True))
        part, *_ = np.linalg.lstsq(solutions @ loads.T, solutions @ load, rcond=_INDEPENDENT)
        return np.asarray(part @ solutions)


def rigid_body_modes(points: Floats) -> Floats:
    """The six rigid body displacements (3n, 6) of points (n, 3), about their centre and scaled to their extent."""
    p = (points - points.mean(axis=0)) / np.ptp(points, axis=0).max()
    modes = np.zeros((len(points), 3, 6))
    modes[:, [0, 1, 2], [0, 1, 2]] = 1.0
    for k, (i, j) in enumerate(((0, 1), (1, 2), (2, 0))):
        modes[:, i, 3 + k] = -p[:, j]
        modes[:, j, 3 + k] = p[:, i]
    return modes.reshape(-1, 6)
