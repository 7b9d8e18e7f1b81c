"""Linear elasticity of one body: stiffness by scikit-fem, factorisation or algebraic multigrid, stresses."""

from __future__ import annotations

import os
import sys
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix, csr_matrix, diags, triu
from scipy.sparse.linalg import cg

from fecontact.errors import ConvergenceError, InputError
from fecontact.material import Material
from fecontact.meshing import BodyMesh

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
SolverName = Literal["pardiso", "amg"]
LinearSolver = Callable[[Floats], Floats]

# scikit-fem's corner order of a hexahedron, as positions in the VTK order.
_TO_SKFEM = np.array([0, 4, 3, 1, 7, 5, 2, 6])
# Far below the contact solver's own tolerance, so that its residuals are those of the contact problem.
AMG_TOLERANCE = 1e-10
_AMG_ITERATIONS = 400
# The level that is solved directly, with six degrees of freedom a node.
_COARSEST_NODES = 80
_MOST_LEVELS = 10
# Connections up to this many times the shortest one of a node are strong.
_NEAR = 3.0
# Earlier solutions that a new one begins with; combinations that differ by less than this part are the same.
_REMEMBERED = 8
_INDEPENDENT = 1e-12


def stiffness(mesh: BodyMesh, material: Material) -> csr_matrix:
    """Stiffness matrix (3n, 3n) in N/mm, three displacement components per node in turn.

    Trilinear hexahedra, isotropic Hooke's law, small strains. The integrals of d_i u d_j v are taken from scikit-fem's
    shape functions and quadrature for all elements at once, and added up in one common pattern, which is faster than
    its vector form by an order of magnitude.
    """
    from skfem import Basis, ElementHex1

    basis = Basis(_skfem_mesh(mesh), ElementHex1(), intorder=3)
    # one array (elements, corners, quadrature points) a direction
    gradients = [np.stack([shape[0].grad[i] for shape in basis.basis], axis=1) for i in range(3)]
    weights = basis.dx[:, None, :]
    nodes, count = basis.element_dofs.T.astype(np.int64), len(mesh.points)
    pairs, place = np.unique(nodes[:, :, None] * count + nodes[:, None, :], return_inverse=True)
    place = place.ravel()
    # row and column of the matrix belong to v and u
    parts: dict[tuple[int, int], NDArray[Any]] = {}
    for i in range(3):
        for j in range(i, 3):
            integrals = (gradients[i] * weights) @ gradients[j].transpose(0, 2, 1)
            parts[i, j] = np.bincount(place, integrals.ravel())
            if i != j:
                parts[j, i] = np.bincount(place, integrals.transpose(0, 2, 1).ravel())
    lame, shear = material.lame_MPa, material.shear_MPa
    blocks = np.empty((pairs.size, 3, 3))
    laplace = parts[0, 0] + parts[1, 1] + parts[2, 2]
    for i in range(3):
        for j in range(3):
            blocks[:, i, j] = lame * parts[i, j] + shear * parts[j, i]
        blocks[:, i, i] += shear * laplace
    rows, columns = np.divmod(pairs, count)
    starts = np.searchsorted(rows, np.arange(count + 1))
    return bsr_matrix((blocks, columns, starts), shape=(3 * count, 3 * count)).tocsr()


def _skfem_mesh(mesh: BodyMesh) -> Any:
    from skfem import MeshHex1

    return MeshHex1(mesh.points.T.copy(), mesh.hexes[:, _TO_SKFEM].T.copy(), sort_t=False)


@dataclass(frozen=True, kw_only=True, eq=False)
class ElasticBody:
    """A meshed body with its stiffness ready to be solved; held at its base and on its plane of symmetry.

    Attributes
    ----------
    solve
        Displacements (3n,) in mm under forces (3n,) in N; zero where the body is held.
    """

    mesh: BodyMesh
    material: Material
    solve: LinearSolver
    solver: SolverName

    def displacements(self, nodes: Integers, forces: Floats) -> Floats:
        """Displacements (n, 3) in mm of all nodes under forces (k, 3) in N on `nodes` (k,)."""
        load = np.zeros(3 * len(self.mesh.points))
        np.add.at(load.reshape(-1, 3), nodes, forces)
        return self.solve(load).reshape(-1, 3)

    def close(self) -> None:
        """Release the factor's memory now."""
        release = getattr(self.solve, "release", None)
        if release is not None:
            release()


def elastic_body(
    mesh: BodyMesh, material: Material, solver: SolverName, matrix: csr_matrix | None = None
) -> ElasticBody:
    """Factorise (or set up the multigrid hierarchy of) one body; assembles its stiffness unless `matrix` is it."""
    if matrix is None:
        matrix = stiffness(mesh, material)
    held = np.zeros((len(mesh.points), 3), dtype=bool)
    held[np.unique(mesh.surfaces["fixed" if mesh.name == "rail" else "driven"])] = True
    if mesh.name == "rail":
        # the rail goes on beyond its cut planes and keeps the head from rolling on its slender web
        held[np.unique(mesh.surfaces["end"]), 1:] = True
    if mesh.half:
        held[np.unique(mesh.surfaces["symmetry"]), 0] = True
    free = np.flatnonzero(~held.ravel())
    make = _pardiso_solver if solver == "pardiso" else _amg_solver
    return ElasticBody(mesh=mesh, material=material, solve=make(matrix, free, mesh.points), solver=solver)


def pardiso_available() -> bool:
    """Whether MKL PARDISO can be loaded on this machine."""
    try:
        import pypardiso
    except (ImportError, OSError):
        return False
    return pypardiso is not None


def choose_solver(wanted: Literal["auto", "pardiso", "amg"], degrees_of_freedom: Sequence[int] = ()) -> SolverName:
    """Name of the solver path to take for bodies with so many degrees of freedom, which are solved at the same time.

    `auto` takes PARDISO where the platform has it and its factors fit into the available memory, otherwise multigrid,
    which needs a third to a half of it and 1.5 to 1.7 times as long (studies/benchmark.py).

    Raises
    ------
    InputError
        If PARDISO is asked for and this platform does not have it.
    """
    import psutil

    if wanted == "auto":
        needed = sum(factor_bytes(count) for count in degrees_of_freedom)
        fits = needed <= _USABLE_MEMORY * float(psutil.virtual_memory().available)
        return "pardiso" if pardiso_available() and fits else "amg"
    if wanted == "pardiso" and not pardiso_available():
        raise InputError("solver pardiso: MKL is not installed on this platform; use auto or amg")
    return wanted


# Bytes of a Cholesky factor of n degrees of freedom and of its analysis, from PARDISO's own count on bodies of 26 to
# 179 thousand: 158 to 187 n^(4/3), the growth of nested dissection in space, and 1.3 kB each.
_FACTOR_BYTES = 190.0
_ANALYSIS_BYTES = 1300.0
# The matrix itself, its assembly and the other body's work beside it.
_USABLE_MEMORY = 0.8


def factor_bytes(degrees_of_freedom: int) -> float:
    """Memory that PARDISO needs for a body, before anything is made."""
    return float(_FACTOR_BYTES * degrees_of_freedom ** (4.0 / 3.0) + _ANALYSIS_BYTES * degrees_of_freedom)


SHORT_OF_MEMORY = "GB of memory"
"""What every message about too little memory has in it: alone on the machine the same case may be solved."""


def check_memory(needed_bytes: float, what: str) -> None:
    """Refuse what the machine cannot hold before it is begun.

    Raises
    ------
    InputError
        If more is needed than is available now.
    """
    import psutil

    available = float(psutil.virtual_memory().available)
    if needed_bytes > available:
        raise InputError(
            f"{what} needs about {needed_bytes / 1e9:.1f} {SHORT_OF_MEMORY}, {available / 1e9:.1f} GB are available;"
            " use a coarser resolution, the amg solver, or a larger machine"
        )


def _pardiso() -> Any:
    from pypardiso import PyPardisoSolver

    solver = PyPardisoSolver(mtype=2)
    # the search for the library takes longer than a small solution: the next solver is told where it was found
    os.environ.setdefault("PYPARDISO_MKL_RT", solver.libmkl._name)
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


def _pardiso_solver(matrix: csr_matrix, free: Integers, points: Floats) -> LinearSolver:
    return _PardisoFactor(matrix, free)


def _amg_solver(matrix: csr_matrix, free: Integers, points: Floats) -> LinearSolver:
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


def nodal_stress(body: ElasticBody, displacements: Floats) -> Floats:
    """Stress (n, 6) in MPa at the nodes: XX YY ZZ XY YZ XZ, the mean of the adjacent elements' corner values.

    Corner values are extrapolated from the 2 x 2 x 2 Gauss points, where trilinear elements are most accurate.
    """
    mesh = body.mesh
    gauss = 1.0 / np.sqrt(3.0)
    signs = np.array(
        [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
    )
    from fecontact.meshing import _shape_gradients

    p, u = mesh.points[mesh.hexes], displacements[mesh.hexes]
    at_gauss = np.empty((len(mesh.hexes), 8, 6))
    lame, shear = body.material.lame_MPa, body.material.shear_MPa
    for k, (r, s, t) in enumerate(gauss * signs):
        dn = _shape_gradients(r, s, t)
        jacobian = p.transpose(0, 2, 1) @ dn
        grad = np.linalg.solve(jacobian.transpose(0, 2, 1), dn.T[None].repeat(len(p), axis=0)) @ u
        trace = lame * np.trace(grad, axis1=1, axis2=2)
        for m, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))):
            at_gauss[:, k, m] = shear * (grad[:, i, j] + grad[:, j, i]) + (trace if i == j else 0.0)
    # value at corner c = sum over Gauss points of their trilinear functions at the scaled corner position
    weights = np.prod(1.0 + signs[:, None, :] * signs[None, :, :] * np.sqrt(3.0), axis=2) / 8.0
    corners = np.einsum("cg,mgs->mcs", weights, at_gauss)
    total = np.zeros((len(mesh.points), 6))
    count = np.zeros(len(mesh.points))
    np.add.at(total, mesh.hexes.ravel(), corners.reshape(-1, 6))
    np.add.at(count, mesh.hexes.ravel(), 1.0)
    return total / count[:, None]


def von_mises(stress: Floats) -> Floats:
    """Von Mises stress (n,) of stresses (n, 6) in the order XX YY ZZ XY YZ XZ."""
    xx, yy, zz, xy, yz, xz = np.moveaxis(stress, -1, 0)
    return np.asarray(np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + yz**2 + xz**2)))
