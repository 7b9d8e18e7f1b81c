"""One elastic body: its mesh, its supports, its stiffness matrix and the linear solver of that matrix."""

from __future__ import annotations

import contextlib
import os
import sys
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import PackageNotFoundError, files
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix, coo_matrix, csr_matrix
from scipy.sparse.linalg import LinearOperator, cg

from fecontact.arrays import Floats, Integers
from fecontact.bodies import Material
from fecontact.errors import ConvergenceError, FoldedMesh, InputError, NotEnoughMemory

# --- The mesh of one body, and its measures.


@dataclass(frozen=True, kw_only=True, eq=False)
class Spacing:
    """Where a mesh has fewer unknowns than nodes: far from the contact the layers of the solution are further apart.

    Attributes
    ----------
    hexes (k, 8)
        The elements of the solution. Far from the contact each spans several layers of the mesh.
    between (h,)
        Nodes of the mesh that have no displacement of their own.
    ends (h, 2), parts (h, 2)
        The nodes before and after each of them along the sweep, and how much of either's displacement it has.
    """

    hexes: Integers
    between: Integers
    ends: Integers
    parts: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class BodyMesh:
    """A hexahedral mesh in the track frame (mm).

    Attributes
    ----------
    points (n, 3), hexes (m, 8)
        Cells in VTK order: four nodes of one layer, then the four nodes above them.
    surfaces
        Named boundary quadrilaterals (k, 4), their normals outward: `contact` (the uniform zone), `fixed` or `driven`,
        `symmetry` (half models), `end` (cut planes), `free`.
    contact_nodes (nx, ns)
        Nodes of the uniform zone: rows along x, columns from the gauge to the field side.
    block_nodes (nx, ns, layers)
        Nodes of the uniform block below each contact node, along the inward normal; the first is the contact node.
    half
        Whether only x >= 0 is meshed.
    volume_mm3
        Volume of the swept section in closed form.
    opposite (n,)
        Of a whole mesh that is its own mirror image: the node opposite of each node.
    spacing
        Where the solution has fewer layers than the mesh; None if it has all of them.
    """

    name: Literal["rail", "wheel"]
    points: Floats
    hexes: Integers
    surfaces: dict[str, Integers] = field(repr=False)
    contact_nodes: Integers
    block_nodes: Integers = field(repr=False)
    half: bool
    volume_mm3: float
    opposite: Integers | None = field(default=None, repr=False)
    spacing: Spacing | None = field(default=None, repr=False)

    @property
    def unknowns(self) -> int:
        """Number of displacement components, also of those that are held."""
        return 3 * (len(self.points) - (0 if self.spacing is None else self.spacing.between.size))


# Corner, and its three neighbours in a right-handed order, of a hexahedron in VTK order.
_CORNERS = np.array(
    [[0, 1, 3, 4], [1, 2, 0, 5], [2, 3, 1, 6], [3, 0, 2, 7], [4, 7, 5, 0], [5, 4, 6, 1], [6, 5, 7, 2], [7, 6, 4, 3]]
)


def corner_jacobians(mesh: BodyMesh) -> Floats:
    """Jacobian determinants (m, 8) at the corners of the hexahedra (mm^3)."""
    p = mesh.points.T[:, mesh.hexes.T]
    return _determinants((p[:, _CORNERS[:, 1:]] - p[:, :, None]).swapaxes(1, 2)).T


def mesh_volume(mesh: BodyMesh) -> float:
    """Volume (mm^3) of the trilinear hexahedra, by quadrature (exact)."""
    p = mesh.points.T[:, mesh.hexes.T]
    places = CORNER_SIGNS / np.sqrt(3.0)
    return sum(float(_determinants(shape_gradients(*place).T @ p).sum()) for place in places)


def _determinants(a: Floats) -> Floats:
    """Determinants (...) of matrices (3, 3, ...): of so many small ones this takes a fifth of LAPACK's time."""
    x, y, z = a
    return np.asarray((x * vector_product(y, z)).sum(axis=0))


def vector_product(a: Floats, b: Floats) -> Floats:
    """Vector product (3, ...) of vectors (3, ...) by their components, in a fraction of the time of numpy.cross."""
    return np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))


CORNER_SIGNS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
)
"""Corners of the unit hexahedron from -1 to 1, in VTK order; its Gauss points are the corners times 1 / sqrt(3)."""


def shape_gradients(r: float, s: float, t: float) -> Floats:
    """Derivatives (8, 3) of the trilinear shape functions by r, s and t, each from -1 to 1."""
    signs = CORNER_SIGNS
    f = 1.0 + signs * np.array([r, s, t])
    return np.asarray(
        0.125
        * np.column_stack(
            [signs[:, 0] * f[:, 1] * f[:, 2], signs[:, 1] * f[:, 0] * f[:, 2], signs[:, 2] * f[:, 0] * f[:, 1]]
        )
    )


def surface_normals(mesh: BodyMesh, name: str) -> Floats:
    """Unit normals (k, 3) of the quadrilaterals of a named surface."""
    p = mesh.points[mesh.surfaces[name]]
    n = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    return np.asarray(n / np.linalg.norm(n, axis=1, keepdims=True))


def check_mesh(mesh: BodyMesh) -> None:
    """Check a finished mesh: a broken mesh would give a wrong pressure without any message."""
    for name, quads in mesh.surfaces.items():
        assert len(quads) > 0, f"{mesh.name}: surface {name} is empty"
    worst = float(corner_jacobians(mesh).min())
    if worst <= 0.0:
        raise FoldedMesh(
            f"{mesh.name}: the mesh folds (smallest Jacobian {worst:.3g} mm^3); use a finer or coarser resolution,"
            " another cut, or check the profile for sharp corners next to the contact zone"
        )
    volume = mesh_volume(mesh)
    assert abs(volume - mesh.volume_mm3) < 1e-9 * volume, (
        f"{mesh.name}: volume {volume} instead of {mesh.volume_mm3} mm^3"
    )
    up = 1.0 if mesh.name == "rail" else -1.0
    if mesh.opposite is not None:
        apart, both = (mesh.points + sign * mesh.points[mesh.opposite] for sign in (-1.0, 1.0))
        across = _half_of(mesh)[1]
        off = max(np.abs(apart @ across[:, 1:]).max(), np.ptp(both @ across[:, 0]))
        assert off < 1e-9 * np.ptp(mesh.points), f"{mesh.name}: {off:.2g} mm off its own mirror image"
    # only the mean: around a corner some normals may point sideways or even backwards
    upwards = up * float(surface_normals(mesh, "contact")[:, 2].mean())
    assert upwards > 0.0, f"{mesh.name}: contact normals point inwards"


# --- Hooke's law of an isotropic body, for both its stiffness and its stresses.


def elasticity_MPa(material: Material) -> Floats:
    """Elasticity tensor C (3, 3, 3, 3) in MPa: stress_ij = C_ijkl du_k/dx_l, small strains.

    C_ijkl = lambda d_ij d_kl + G (d_ik d_jl + d_il d_jk) with Lame's constants.
    """
    delta = np.eye(3)
    dilation = np.einsum("ij,kl->ijkl", delta, delta)
    shear = np.einsum("ik,jl->ijkl", delta, delta) + np.einsum("il,jk->ijkl", delta, delta)
    return np.asarray(material.lame_MPa * dilation + material.shear_MPa * shear)


# --- Stiffness matrix of one body by scikit-fem.

# scikit-fem's corner order of a hexahedron, as positions in the VTK order.
_TO_SKFEM = np.array([0, 4, 3, 1, 7, 5, 2, 6])


def stiffness(mesh: BodyMesh, material: Material) -> bsr_matrix:
    """Stiffness matrix (3n, 3n) in N/mm in blocks of the three displacement components of each node.

    Trilinear hexahedra, isotropic Hooke's law, small strains. The integrals of d_i u d_j v use scikit-fem's shape
    functions and quadrature. They are computed for all elements at once and added up in one sparsity pattern, which is
    ten times as fast as scikit-fem's vector form.
    """
    from skfem import Basis, ElementHex1

    basis = Basis(_skfem_mesh(mesh), ElementHex1(), intorder=3)
    # for each direction an array (elements, corners, quadrature points)
    gradients = [np.stack([shape[0].grad[i] for shape in basis.basis], axis=1) for i in range(3)]
    weights = basis.dx[:, None, :]
    nodes, count = basis.element_dofs.T.astype(np.int64), len(mesh.points)
    pairs, values = _scatter(nodes, count, mesh.spacing)
    # rows of the matrix belong to the test function v, columns to the displacement u
    pattern = coo_matrix((np.ones(len(pairs[0])), pairs), shape=(count, count)).tocsr()
    parts = np.empty((pattern.nnz, 3, 3))
    # where the integrals of a pair of nodes are added up (numpy.unique takes twice as long), and of the pair reversed
    pattern.data = np.arange(pattern.nnz)
    place, reversed_ = np.asarray(pattern[pairs]).ravel(), pattern.T.tocsr().data
    for i in range(3):
        for j in range(i, 3):
            integrals = (gradients[i] * weights) @ gradients[j].transpose(0, 2, 1)
            parts[:, i, j] = np.bincount(place, values(integrals))
            if i != j:
                parts[:, j, i] = parts[reversed_, i, j]
    # d_k v_i C_ikjl d_l u_j
    blocks = np.tensordot(parts, elasticity_MPa(material), axes=((1, 2), (1, 3)))
    return bsr_matrix((blocks, pattern.indices, pattern.indptr), shape=(3 * count, 3 * count))


def _skfem_mesh(mesh: BodyMesh) -> Any:
    from skfem import MeshHex1

    hexes = mesh.hexes if mesh.spacing is None else mesh.spacing.hexes
    return MeshHex1(mesh.points.T.copy(), hexes[:, _TO_SKFEM].T.copy(), sort_t=False)


def _scatter(
    nodes: Integers, count: int, spacing: Spacing | None
) -> tuple[tuple[Integers, Integers], Callable[[Floats], Floats]]:
    """Pairs of nodes, rows (p,) and columns (p,), and what integrals (k, 8, 8) of elements add at each."""
    if spacing is None:
        return _pairs(nodes), np.ravel
    ends, parts = np.repeat(np.arange(count)[:, None], 2, axis=1), np.repeat([[1.0, 0.0]], count, axis=0)
    ends[spacing.between], parts[spacing.between] = spacing.ends, spacing.parts
    # an element with a corner between two nodes acts on both of them: it has sixteen nodes
    hangs = (parts[nodes, 0] < 1.0).any(axis=1)
    own, both = nodes[~hangs], ends[nodes[hangs]].transpose(0, 2, 1).reshape(-1, 16)
    shares = (parts[nodes[hangs]].transpose(0, 2, 1)[:, None] * np.eye(8)[:, None, :]).reshape(-1, 8, 16)
    # a node without unknowns keeps its place on the diagonal
    pairs = _pairs(own), _pairs(both), (spacing.between, spacing.between)

    def values(integrals: Floats) -> Floats:
        shared = shares.transpose(0, 2, 1) @ integrals[hangs] @ shares
        return np.concatenate([integrals[~hangs].ravel(), shared.ravel(), np.zeros(spacing.between.size)])

    rows, columns = (np.concatenate(both) for both in zip(*pairs, strict=True))
    return (rows, columns), values


def _pairs(nodes: Integers) -> tuple[Integers, Integers]:
    """All pairs of the nodes (m, k) of each element: rows and columns (m k^2,)."""
    return np.repeat(nodes, nodes.shape[1], axis=1).ravel(), np.tile(nodes, (1, nodes.shape[1])).ravel()


# --- Memory that the solution of a body needs, and whether the machine has it.

# Bytes of a Cholesky factor of n degrees of freedom, and bytes a degree of freedom of its analysis. PARDISO itself
# counts 71 to 85 n^(4/3) (the growth of nested dissection in space) and 206 to 242 on bodies of 11 to 158 thousand.
_FACTOR_BYTES = 86.0
_ANALYSIS_BYTES = 242.0
# Part of the available memory for factors: the matrix, its assembly and the other body need the rest.
USABLE_MEMORY = 0.8


def factor_bytes(degrees_of_freedom: int) -> float:
    """Estimated memory that PARDISO needs for a body."""
    return float(_FACTOR_BYTES * degrees_of_freedom ** (4.0 / 3.0) + _ANALYSIS_BYTES * degrees_of_freedom)


def check_memory(needed_bytes: float, what: str) -> None:
    """Refuse work that needs more memory than the machine has, before the work begins.

    Raises
    ------
    NotEnoughMemory
        If more memory is needed than is available now.
    """
    import psutil

    available = float(psutil.virtual_memory().available)
    if needed_bytes > available:
        raise NotEnoughMemory(
            f"{what} needs about {needed_bytes / 1e9:.1f} GB of memory, {available / 1e9:.1f} GB are available;"
            " use a coarser resolution, the amg solver, or a larger machine"
        )


# --- Linear systems of a body: conjugate gradients with a Cholesky factor by MKL PARDISO, or with algebraic multigrid.

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


def _decoupled(matrix: bsr_matrix, moves: NDArray[np.bool_]) -> bsr_matrix:
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


class _ConjugateGradients:
    """Preconditioned conjugate gradients, started from the best combination of the last solutions."""

    def __init__(self, matrix: bsr_matrix, moves: NDArray[np.bool_], points: Floats, solver: SolverName) -> None:
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


# --- One elastic body, ready to be solved.


@dataclass(frozen=True, kw_only=True, eq=False)
class ElasticBody:
    """A meshed body, held at its base and on its plane of symmetry, with a solver of its stiffness matrix.

    Attributes
    ----------
    solve
        Displacements (3n,) in mm under forces (3n,) in N; zero where the body is held.
    """

    mesh: BodyMesh
    material: Material
    solve: LinearSolver
    solver: SolverName

    def __getstate__(self) -> dict[str, Any]:
        # a factor lives in the memory of the library that made it
        return {**self.__dict__, "solve": _no_factor}

    def displacements(
        self, nodes: Integers, forces: Floats, more: Floats | None = None, *, tolerance: float = LINEAR_TOLERANCE
    ) -> Floats:
        """Displacements (n, 3) in mm under forces (k, 3) in N on `nodes` (k,) and forces `more` (n, 3) on all nodes.

        The residual's norm is at most `tolerance` times that of the forces.
        """
        load = np.zeros((len(self.mesh.points), 3)) if more is None else more.copy()
        np.add.at(load, nodes, forces)
        spacing = self.mesh.spacing
        if spacing is not None and more is not None:
            np.add.at(load, spacing.ends, spacing.parts[:, :, None] * load[spacing.between, None])
        u = self.solve(load.ravel(), tolerance).reshape(-1, 3)
        if spacing is not None:
            u[spacing.between] = np.einsum("he,hed->hd", spacing.parts, u[spacing.ends])
        return u

    def forget(self) -> None:
        """Solve the next load as if it were the first one, to the last bit."""
        getattr(self.solve, "forget", lambda: None)()

    def close(self) -> None:
        """Release the factor's memory now."""
        release = getattr(self.solve, "release", None)
        if release is not None:
            release()


def _no_factor(forces: Floats, tolerance: float) -> Floats:
    raise InputError("a body that was pickled has no factor of its stiffness; solve the case again")


def elastic_body(
    mesh: BodyMesh, material: Material, solver: SolverName, matrix: bsr_matrix | None = None
) -> ElasticBody:
    """Set up the linear solver of one body; `matrix` is the stiffness of its `assembled_part`, if it is there."""
    part = assembled_part(mesh)
    if matrix is None:
        matrix = stiffness(part, material)

    def held_at(held: NDArray[np.bool_]) -> _ConjugateGradients:
        return _ConjugateGradients(_decoupled(matrix, ~held), ~held, part.points, solver)

    held = np.zeros((len(mesh.points), 3), dtype=bool)
    if mesh.spacing is not None:
        # they have no equations
        held[mesh.spacing.between] = True
    held[np.unique(mesh.surfaces["fixed" if mesh.name == "rail" else "driven"])] = True
    if mesh.name == "rail":
        # the rail continues beyond its cut planes: this keeps the head from rolling on its slender web
        held[np.unique(mesh.surfaces["end"]), 1:] = True
    if mesh.half:
        held[np.unique(mesh.surfaces["symmetry"]), 0] = True
    solve: LinearSolver = held_at(held) if mesh.opposite is None else _BothHalves(mesh, held, held_at)
    return ElasticBody(mesh=mesh, material=material, solve=solve, solver=solver)


# --- A whole body that is its own mirror image, solved on one half of it.
#
# A load is the sum of an even and an odd part. Under the even part points of the middle plane stay in it, under the odd
# part they move straight out of it: two factors of half of the unknowns cost less than one of all of them.


_MIRRORED = np.array([-1.0, 1.0, 1.0])


def assembled_part(mesh: BodyMesh) -> BodyMesh:
    """The mesh whose stiffness is needed: all of it, or a half in axes of which the first is the plane's normal."""
    if mesh.opposite is None:
        return mesh
    nodes, axes = _half_of(mesh)
    number = np.full(len(mesh.points), -1)
    number[nodes] = np.arange(nodes.size)

    def own(hexes: Integers) -> Integers:
        found = number[hexes]
        return found[(found >= 0).all(axis=1)]

    spacing = mesh.spacing
    if spacing is not None:
        here = number[spacing.between] >= 0
        spacing = Spacing(
            hexes=own(spacing.hexes),
            between=number[spacing.between[here]],
            ends=number[spacing.ends[here]],
            parts=spacing.parts[here],
        )
    return replace(
        mesh,
        points=(mesh.points @ axes)[nodes],
        hexes=own(mesh.hexes),
        surfaces={},
        opposite=None,
        spacing=spacing,
    )


def _half_of(mesh: BodyMesh) -> tuple[Integers, Floats]:
    """Nodes (k,) on one side of the middle plane of a mesh and on it, and axes (3, 3) whose first is its normal."""
    opposite, points = mesh.opposite, mesh.points
    apart = points - points[opposite]
    first = int(np.argmax(np.einsum("nd,nd->n", apart, apart)))
    axes, _ = np.linalg.qr(np.column_stack([apart[first], np.eye(3)]))
    return np.flatnonzero((apart @ apart[first] > 0.0) | (opposite == np.arange(len(points)))), axes


class _BothHalves:
    """Solver of a body that is its own mirror image; it is held alike on both sides (n, 3), and so is each half."""

    def __init__(
        self, mesh: BodyMesh, held: NDArray[np.bool_], held_at: Callable[[NDArray[np.bool_]], _ConjugateGradients]
    ) -> None:
        assert mesh.opposite is not None
        self._nodes, self._axes = _half_of(mesh)
        self._opposite = mesh.opposite[self._nodes]
        self._on_plane = self._nodes == self._opposite
        # a force on the plane is shared by both halves
        self._share = np.where(self._on_plane, 0.25, 0.5)[:, None]
        even, odd = held[self._nodes], held[self._nodes]
        even[self._on_plane, 0], odd[self._on_plane, 1:] = True, True
        self._halves = held_at(even), held_at(odd)

    def __call__(self, forces: Floats, tolerance: float) -> Floats:
        f = forces.reshape(-1, 3) @ self._axes
        here, there = f[self._nodes], f[self._opposite] * _MIRRORED
        # where one of them is small, so may be its precision
        whole_N = float(np.linalg.norm(self._share * f[self._nodes]))
        even, odd = (
            solve((self._share * own).ravel(), tolerance, whole_N).reshape(-1, 3)
            for solve, own in zip(self._halves, (here + there, here - there), strict=True)
        )
        u = np.empty_like(f)
        # on the plane both are the same
        u[self._opposite], u[self._nodes] = (even - odd) * _MIRRORED, even + odd
        return np.asarray((u @ self._axes.T).ravel())

    def forget(self) -> None:
        for solve in self._halves:
            solve.forget()

    def release(self) -> None:
        for solve in self._halves:
            solve.release()
