"""Linear systems of a body, solved by conjugate gradients.

The preconditioner is a Cholesky factor by MKL PARDISO or multigrid by pyamg.
"""

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
from fecontact.process import count_cores, read_factor_threads

SolverName = Literal["pardiso", "amg"]
# Function of forces (3n,) in N and a tolerance of the residual, which returns displacements (3n,) in mm.
LinearSolver = Callable[[Floats, float], Floats]
_MKL_PATH = "PYPARDISO_MKL_RT"
# The tolerance is far below the tolerance of the contact solver, so that the contact residuals do not contain this
# error.
LINEAR_TOLERANCE = 1e-9
_MAX_ITERATIONS = {"pardiso": 20, "amg": 400}
# Unknowns of both bodies above which multigrid is cheaper for a single load. CPU seconds of one core (AMD EPYC,
# virtual, 2026; cylinder R 460 on R 300) for the first load, by factors and by multigrid: 1.7 and 2.9 with 52 thousand
# unknowns, 6.1 and 8.8 with 140, 15 and 20 with 283, 28 and 31 with 426. A further load takes 0.06 of this time by
# factors, and 0.3 by multigrid.
_MULTIGRID_UNKNOWNS = 450_000
# Unknowns of a body for each thread of its factor. With two threads, 51 thousand unknowns take 13 % less time and 15 %
# more CPU time; 17 thousand take 3 % less time and 8 % more CPU time.
_UNKNOWNS_PER_THREAD = 25_000
# Largest multigrid level that is solved directly, in nodes. Each node has six degrees of freedom.
_MAX_DIRECT_NODES = 80
_MAX_LEVELS = 10
# A connection of a node is strong if it is at most this ratio times as long as the shortest connection of the node.
_STRONG_LENGTH_RATIO = 3.0
# Number of earlier solutions for the first guess of a new solution, and the relative size below which a singular value
# of their combination counts as zero.
_MAX_EARLIER_SOLUTIONS = 8
_ZERO_SINGULAR_VALUE = 1e-12


def is_pardiso_available() -> bool:
    """Whether MKL PARDISO can be loaded on this machine.

    Returns
    -------
    bool
        False if the package pypardiso or the library MKL is missing.
    """
    try:
        return _import_pypardiso() is not None
    except (ImportError, OSError):
        return False


def _import_pypardiso() -> Any:
    """Import the package pypardiso, with the path of MKL in the environment.

    The search of pypardiso through the whole environment takes 0.5 s.
    """
    if _MKL_PATH not in os.environ:
        with contextlib.suppress(PackageNotFoundError):
            for path in files("mkl") or ():
                if path.name.startswith(("libmkl_rt.", "mkl_rt.")):
                    os.environ[_MKL_PATH] = str(path.locate())
    import pypardiso

    return pypardiso


def choose_solver(
    solver: Literal["auto", "pardiso", "amg"], degrees_of_freedom: Sequence[int] = (), *, several_loads: bool = True
) -> SolverName:
    """Choose the linear solver for bodies that are solved together.

    `auto` takes PARDISO if the platform has it, its factors fit into the available memory, and it is cheaper for this
    size and number of loads (studies/benchmark.py). Else it takes multigrid, which needs a third to a half of the
    memory.

    Parameters
    ----------
    solver
        The solver that the user chose.
    degrees_of_freedom
        Number of degrees of freedom of each body.
    several_loads
        Whether the bodies are solved for more than one load.

    Returns
    -------
    SolverName
        `pardiso` or `amg`.

    Raises
    ------
    InputError
        If the user chose PARDISO and this platform does not have it.
    """
    import psutil

    if solver == "auto":
        needed_bytes = sum(factor_bytes(count) for count in degrees_of_freedom)
        has_memory = needed_bytes <= USABLE_MEMORY * float(psutil.virtual_memory().available)
        is_cheaper = several_loads or sum(degrees_of_freedom) <= _MULTIGRID_UNKNOWNS
        return "pardiso" if is_pardiso_available() and has_memory and is_cheaper else "amg"
    if solver == "pardiso" and not is_pardiso_available():
        raise InputError(
            "solver pardiso: MKL cannot be loaded; run pip install pypardiso (x86-64 Linux and Windows), or use solver"
            " auto or amg"
        )
    return solver


def count_factor_threads(unknowns: int) -> int:
    """Number of threads for the factor of a body.

    Parameters
    ----------
    unknowns
        Number of degrees of freedom of the body.

    Returns
    -------
    int
        The number of `use_factor_threads` if there is one. Otherwise 0, which leaves the number to MKL, if the
        environment has a number of threads, or a thread for each 25 thousand unknowns, at most the cores of this
        process.
    """
    if (threads := read_factor_threads()) is not None:
        return threads
    if any(name in os.environ for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS")):
        return 0
    return max(1, min(unknowns // _UNKNOWNS_PER_THREAD, count_cores()))


def _new_pardiso_solver() -> Any:
    """A PARDISO solver for symmetric positive definite matrices of 3 x 3 blocks.

    It has single precision.
    """
    solver = _import_pypardiso().PyPardisoSolver(mtype=2)
    os.environ.setdefault(_MKL_PATH, solver.libmkl._name)
    # nested dissection: the ordering is somewhat slower, and all later phases are faster
    solver.iparm[0], solver.iparm[1] = 1, 32
    # single precision
    solver.iparm[27] = 1
    # 3 x 3 blocks: the graph of the blocks is ordered in a third of the time
    solver.iparm[36] = 3
    return solver


class _PardisoFactor:
    """Cholesky factor by MKL PARDISO, in single precision.

    The matrix is symmetric positive definite; the factor reads the upper triangle of its blocks. It takes two thirds of
    the time and half of the memory of a factor in double precision. Its solutions leave residuals of 2e-5 to 2e-4 (13
    to 115 thousand unknowns), so that two or three steps of conjugate gradients reach 1e-9.
    """

    def __init__(self, matrix: bsr_matrix) -> None:
        """Analyse and factor a symmetric matrix (3n, 3n) in 3 x 3 blocks.

        Only the upper blocks are used, in single precision.

        Raises
        ------
        MemoryShortageError
            If the factor needs more memory than is free.
        """
        rows = _block_rows(matrix)
        block_rows = matrix.indptr.size - 1
        upper = matrix.indices >= rows
        # The arrays that pypardiso hands over. pypardiso does not support blocks; PARDISO reads each block by columns.
        self._upper: Any = SimpleNamespace(
            shape=(block_rows, block_rows),
            data=matrix.data[upper].transpose(0, 2, 1).astype(np.float32, order="C"),
            indices=matrix.indices[upper],
            indptr=np.searchsorted(rows[upper], np.arange(block_rows + 1)),
        )
        self._pardiso = _new_pardiso_solver()
        self._threads = count_factor_threads(matrix.shape[0])
        zero_forces = np.zeros(matrix.shape[0])
        self._run(11, zero_forces)
        # The analysis gives the memory in KB: the peak while ordering, or the factor and its work space.
        peak, permanent, factor = (self._pardiso.get_iparm(k) for k in (15, 16, 17))
        check_memory(1024.0 * max(peak, permanent + factor), f"the factor of {matrix.shape[0]} degrees of freedom")
        self._run(22, zero_forces)

    def _run(self, phase: int, forces: Floats) -> Floats:
        """Run a phase of PARDISO with forces (3n,) on the right-hand side.

        Raises
        ------
        ConvergenceError
            If PARDISO finds no factor.
        """
        from pypardiso.pardiso_wrapper import PyPardisoError

        self._pardiso.libmkl.MKL_Set_Num_Threads_Local(self._threads)
        self._pardiso.set_phase(phase)
        try:
            return np.asarray(self._pardiso._call_pardiso(self._upper, forces.astype(np.float32)), dtype=float)
        except PyPardisoError as error:
            # for example because a pivot is zero in single precision
            raise ConvergenceError(
                f"solver pardiso: the matrix of {forces.size} degrees of freedom has no factor ({error}); use the amg"
                " solver or a coarser resolution"
            ) from error

    def __call__(self, forces: Floats) -> Floats:
        """Approximate displacements (3n,) in mm under forces (3n,) in N."""
        return self._run(33, forces)

    def release(self) -> None:
        """Release the memory of the factor and of the analysis."""
        if self._upper is not None:
            # memory of the factor and of the analysis
            self._pardiso.free_memory(everything=True)
            self._upper = None

    def __del__(self) -> None:
        # Python does not release MKL's memory. At the end of the interpreter the operating system does.
        if getattr(self, "_upper", None) is not None and not sys.is_finalizing():
            self.release()


def _block_rows(matrix: bsr_matrix) -> Integers:
    """Row of each block (k,)."""
    return np.repeat(np.arange(matrix.indptr.size - 1), np.diff(matrix.indptr))


def decouple_fixed(matrix: bsr_matrix, is_free: NDArray[np.bool_]) -> bsr_matrix:
    """Decouple the fixed displacements of a matrix.

    Each node keeps its 3 x 3 block.

    Parameters
    ----------
    matrix
        Stiffness matrix (3n, 3n) in N/mm.
    is_free : ndarray of shape (n, 3)
        Whether each displacement component of a node is free.

    Returns
    -------
    bsr_matrix
        The matrix (3n, 3n) with the mean of the diagonal at fixed displacements, and without their coupling.
    """
    rows, columns = _block_rows(matrix), matrix.indices
    blocks, has_fixed = matrix.data.copy(), np.logical_not(is_free.all(axis=1))
    coupled = np.flatnonzero(has_fixed[rows] | has_fixed[columns])
    blocks[coupled] *= is_free[rows[coupled]][:, :, None] & is_free[columns[coupled]][:, None, :]
    fixed_blocks = np.zeros((len(is_free), 3, 3))
    fixed_blocks[:, range(3), range(3)] = float(matrix.diagonal().mean()) * ~is_free
    blocks[rows == columns] += fixed_blocks
    return bsr_matrix((blocks, columns, matrix.indptr), shape=matrix.shape)


def _build_multigrid(matrix: bsr_matrix, is_free: NDArray[np.bool_], points: Floats) -> Callable[[Floats], Floats]:
    """Build the multigrid hierarchy of a matrix by smoothed aggregation.

    The function that it returns is a single cycle. `points` (n, 3) are the nodes in mm, and `is_free` (3n,) marks the
    free degrees of freedom.
    """
    import pyamg

    strengths, aggregates = _aggregate_neighbours(matrix, points)
    hierarchy = pyamg.smoothed_aggregation_solver(
        matrix,
        B=rigid_body_modes(points) * is_free.reshape(-1, 1),
        strength=strengths,
        aggregate=aggregates,
        smooth=("energy", {"krylov": "cg", "maxiter": 3}),
        presmoother=("block_gauss_seidel", {"sweep": "forward"}),
        postsmoother=("block_gauss_seidel", {"sweep": "backward"}),
        improve_candidates=None,
    )
    cycle: Callable[[Floats], Floats] = hierarchy.aspreconditioner().matvec
    return cycle


def _aggregate_neighbours(matrix: bsr_matrix, points: Floats) -> tuple[list[Any], list[Any]]:
    """Strengths of connection and aggregates of each level.

    They join a node with its nearest neighbours.

    The elements are up to a hundred times as long as thin where the fine zone is swept to the cut planes. Errors vary
    slowly only across the thin sides, so that nodes may be joined only there. A strength from the matrix entries misses
    this on coarse levels: six times as many iterations with 230 thousand degrees of freedom.
    """
    from pyamg.aggregation import standard_aggregation
    from pyamg.strength import distance_strength_of_connection

    graph = csr_matrix((np.ones(matrix.indices.size), matrix.indices, matrix.indptr))
    strengths, aggregates = [], []
    for _ in range(_MAX_LEVELS):
        strength = distance_strength_of_connection(graph, points, theta=_STRONG_LENGTH_RATIO)
        aggregate, _ = standard_aggregation(strength)
        strengths.append(("predefined", {"C": strength}))
        aggregates.append(("predefined", {"AggOp": aggregate}))
        members = csr_matrix(aggregate, dtype=float)
        points = (members.T @ points) / np.asarray(members.sum(axis=0)).reshape(-1, 1)
        if len(points) <= _MAX_DIRECT_NODES:
            break
        # Two aggregates are connected if their smoothed basis functions overlap.
        neighbours = csr_matrix(strength) @ members
        graph = csr_matrix(neighbours.T @ graph @ neighbours)
        graph.data[:] = 1.0
    return strengths, aggregates


class ConjugateGradients:
    """Preconditioned conjugate gradients, started from the best combination of the last solutions."""

    def __init__(self, matrix: bsr_matrix, is_free: NDArray[np.bool_], points: Floats, solver: SolverName) -> None:
        """Factor a matrix or build its multigrid hierarchy.

        Parameters
        ----------
        matrix
            Stiffness matrix (3n, 3n) in N/mm, with fixed displacements decoupled.
        is_free : ndarray of shape (n, 3)
            Whether each displacement component of a node is free.
        points : ndarray of shape (n, 3)
            Nodes in mm.
        solver
            `pardiso` for a factor, `amg` for multigrid.
        """
        self._matrix, self._is_free, self._solver = matrix, is_free.ravel(), solver
        self._nearly = _PardisoFactor(matrix) if solver == "pardiso" else _build_multigrid(matrix, is_free, points)
        self._earlier_solutions: deque[tuple[Floats, Floats]] = deque(maxlen=_MAX_EARLIER_SOLUTIONS)

    def __call__(self, forces: Floats, tolerance: float, whole_load_N: float = 0.0) -> Floats:
        """Displacements under forces on the nodes.

        Parameters
        ----------
        forces : ndarray of shape (3n,)
            Forces in N. They may be a small fraction of a larger load.
        tolerance
            Largest norm of the residual, relative to the norm of the forces.
        whole_load_N
            Norm of the larger load, by which the residual may be measured instead.

        Returns
        -------
        u (3n,)
            Displacements in mm.

        Raises
        ------
        ConvergenceError
            If the residual is too large after all iterations.
        """
        load, max_iterations = forces * self._is_free, _MAX_ITERATIONS[self._solver]
        u, exit_code = cg(
            self._matrix,
            load,
            x0=self._first_guess(load),
            rtol=tolerance,
            atol=tolerance * whole_load_N,
            maxiter=max_iterations,
            M=LinearOperator(self._matrix.shape, self._nearly, dtype=float),
        )
        if exit_code != 0:
            norm = float(np.linalg.norm(load))
            residual = float(np.linalg.norm(load - self._matrix @ u))
            other_solver = "amg" if self._solver == "pardiso" else "pardiso"
            raise ConvergenceError(
                f"solver {self._solver}: residual {residual / norm:.1e} after {max_iterations} iterations"
                f" (allowed: at most {tolerance:g}); use the {other_solver} solver or a coarser resolution"
            )
        self._earlier_solutions.append((load, u))
        return np.asarray(u)

    def forget(self) -> None:
        """Start the next solution from zero.

        Then its last digits do not depend on earlier solutions.
        """
        self._earlier_solutions.clear()

    def release(self) -> None:
        """Release the memory of a factor now."""
        getattr(self._nearly, "release", lambda: None)()

    def _first_guess(self, load: Floats) -> Floats | None:
        """Combination of earlier solutions with the least elastic energy of the error.

        None without earlier solutions.
        """
        if not self._earlier_solutions:
            return None
        loads, solutions = (np.array(column) for column in zip(*self._earlier_solutions, strict=True))
        coefficients, *_ = np.linalg.lstsq(solutions @ loads.T, solutions @ load, rcond=_ZERO_SINGULAR_VALUE)
        return np.asarray(coefficients @ solutions)


def rigid_body_modes(points: Floats) -> Floats:
    """The six rigid body displacements of points, about their centre and scaled to their extent.

    Parameters
    ----------
    points : ndarray of shape (n, 3)
        Nodes in mm.

    Returns
    -------
    modes (3n, 6)
        Three translations and three rotations.
    """
    p = (points - points.mean(axis=0)) / np.ptp(points, axis=0).max()
    modes = np.zeros((len(points), 3, 6))
    modes[:, [0, 1, 2], [0, 1, 2]] = 1.0
    for k, (i, j) in enumerate(((0, 1), (1, 2), (2, 0))):
        modes[:, i, 3 + k] = -p[:, j]
        modes[:, j, 3 + k] = p[:, i]
    return modes.reshape(-1, 6)
