"""An elastic body: its mesh, its supports, its stiffness matrix and its linear solver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix

from fecontact.arrays import Floats, Integers
from fecontact.bodies import Material
from fecontact.errors import InputError
from fecontact.fe.body_mesh import BodyMesh, ConstrainedNodes, select_half
from fecontact.fe.linear_solver import LINEAR_TOLERANCE, ConjugateGradients, LinearSolver, SolverName, decouple_fixed
from fecontact.fe.stiffness import assemble_stiffness

# --- One elastic body, ready to be solved.


@dataclass(frozen=True, kw_only=True, eq=False)
class ElasticBody:
    """A meshed body with supports and a solver of its stiffness matrix.

    The supports are at the base of the body and on its plane of symmetry.

    Attributes
    ----------
    mesh
        Mesh of the body, with n nodes.
    material
        Elastic constants.
    solve
        Displacements (3n,) in mm under forces (3n,) in N; zero at the supports.
    solver
        Name of the linear solver.
    """

    mesh: BodyMesh
    material: Material
    solve: LinearSolver
    solver: SolverName

    def __getstate__(self) -> dict[str, Any]:
        # A factor lives in the memory of the library that made it.
        return {**self.__dict__, "solve": _refuse_without_factor}

    def displacements(
        self,
        nodes: Integers,
        forces: Floats,
        further_forces: Floats | None = None,
        *,
        tolerance: float = LINEAR_TOLERANCE,
    ) -> Floats:
        """Displacements of all nodes under nodal forces.

        Parameters
        ----------
        nodes : ndarray of shape (k,)
            Loaded nodes.
        forces : ndarray of shape (k, 3)
            Forces on `nodes` in N.
        further_forces : ndarray of shape (n, 3) or None
            Further forces on all nodes in N; None for zero.
        tolerance
            Largest norm of the residual, relative to the norm of the forces.

        Returns
        -------
        u (n, 3)
            Displacements in mm.
        """
        load = np.zeros((len(self.mesh.points), 3)) if further_forces is None else further_forces.copy()
        np.add.at(load, nodes, forces)
        spacing = self.mesh.spacing
        if spacing is not None and further_forces is not None:
            np.add.at(load, spacing.ends, spacing.parts[:, :, None] * load[spacing.between, None])
        u = self.solve(load.ravel(), tolerance).reshape(-1, 3)
        if spacing is not None:
            u[spacing.between] = np.einsum("he,hed->hd", spacing.parts, u[spacing.ends])
        return u

    def forget(self) -> None:
        """Solve the next load as if it were the first load, to the last bit."""
        getattr(self.solve, "forget", lambda: None)()

    def close(self) -> None:
        """Release the memory of the factor now."""
        release = getattr(self.solve, "release", None)
        if release is not None:
            release()


def _refuse_without_factor(forces: Floats, tolerance: float) -> Floats:
    """Raise the error of a body that was read from a pickle."""
    raise InputError("a body that was read from a pickle has no factor of its stiffness matrix; solve the case again")


def make_elastic_body(
    mesh: BodyMesh, material: Material, solver: SolverName, matrix: bsr_matrix | None = None
) -> ElasticBody:
    """Set up the linear solver of a body.

    The rail is fixed at its base, and at its cut planes in lateral and vertical direction. The wheel is fixed at its
    driven surface. Half models are fixed normal to the plane of symmetry.

    Parameters
    ----------
    mesh
        Mesh of the body.
    material
        Elastic constants.
    solver
        Name of the linear solver.
    matrix
        Stiffness matrix in N/mm of the mesh that `mesh_to_assemble` returns; None to assemble it here.

    Returns
    -------
    ElasticBody
        The body with its linear solver.
    """
    assembled = mesh_to_assemble(mesh)
    if matrix is None:
        matrix = assemble_stiffness(assembled, material)

    def solver_with_supports(is_fixed: NDArray[np.bool_]) -> ConjugateGradients:
        """The linear solver of the matrix with fixed displacements."""
        return ConjugateGradients(decouple_fixed(matrix, ~is_fixed), ~is_fixed, assembled.points, solver)

    is_fixed = np.zeros((len(mesh.points), 3), dtype=bool)
    if mesh.spacing is not None:
        # nodes without equations
        is_fixed[mesh.spacing.between] = True
    is_fixed[np.unique(mesh.surfaces["fixed" if mesh.name == "rail" else "driven"])] = True
    if mesh.name == "rail":
        # The rail continues beyond its cut planes. This keeps the head from rolling on its slender web.
        is_fixed[np.unique(mesh.surfaces["end"]), 1:] = True
    if mesh.half:
        is_fixed[np.unique(mesh.surfaces["symmetry"]), 0] = True
    solve: LinearSolver = (
        solver_with_supports(is_fixed)
        if mesh.opposite is None
        else _MirroredHalves(mesh, is_fixed, solver_with_supports)
    )
    return ElasticBody(mesh=mesh, material=material, solve=solve, solver=solver)


# --- A whole body with a mirror plane, solved on one half of it.
#
# A load is the sum of an even and an odd part. Under the even part the points of the middle plane stay in it, under the
# odd part they move straight out of it. Two factors of half of the unknowns cost less than one factor of all unknowns.


_MIRRORED = np.array([-1.0, 1.0, 1.0])


def mesh_to_assemble(mesh: BodyMesh) -> BodyMesh:
    """The mesh that needs a stiffness matrix: all of a body or half of it.

    A body with a mirror plane needs one half, in axes that begin with the normal of the plane.

    Parameters
    ----------
    mesh
        Mesh of the body.

    Returns
    -------
    BodyMesh
        The mesh itself, or its half without surfaces.
    """
    if mesh.opposite is None:
        return mesh
    nodes, axes = select_half(mesh)
    number = np.full(len(mesh.points), -1)
    number[nodes] = np.arange(nodes.size)

    def hexes_of_half(hexes: Integers) -> Integers:
        """The hexahedra of the half, with the node numbers of the half."""
        numbers = number[hexes]
        return numbers[(numbers >= 0).all(axis=1)]

    spacing = mesh.spacing
    if spacing is not None:
        in_half = number[spacing.between] >= 0
        spacing = ConstrainedNodes(
            hexes=hexes_of_half(spacing.hexes),
            between=number[spacing.between[in_half]],
            ends=number[spacing.ends[in_half]],
            parts=spacing.parts[in_half],
        )
    return replace(
        mesh,
        points=(mesh.points @ axes)[nodes],
        hexes=hexes_of_half(mesh.hexes),
        surfaces={},
        opposite=None,
        spacing=spacing,
    )


class _MirroredHalves:
    """Linear solver of a body with a mirror plane, for even and odd loads.

    It has a factor for each of them.
    """

    def __init__(
        self,
        mesh: BodyMesh,
        is_fixed: NDArray[np.bool_],
        solver_with_supports: Callable[[NDArray[np.bool_]], ConjugateGradients],
    ) -> None:
        """Set up the solvers of the half for even and for odd loads.

        Parameters
        ----------
        mesh
            A whole mesh with `opposite` nodes.
        is_fixed : ndarray of shape (n, 3)
            Whether each displacement component is fixed; it must be equal on both sides of the plane.
        solver_with_supports
            Function that returns the solver of the half with fixed displacements.
        """
        assert mesh.opposite is not None
        self._nodes, self._axes = select_half(mesh)
        self._opposite = mesh.opposite[self._nodes]
        self._on_plane = self._nodes == self._opposite
        # A force on the plane acts on both halves.
        self._share = np.where(self._on_plane, 0.25, 0.5)[:, None]
        even, odd = is_fixed[self._nodes], is_fixed[self._nodes]
        even[self._on_plane, 0], odd[self._on_plane, 1:] = True, True
        self._halves = solver_with_supports(even), solver_with_supports(odd)

    def __call__(self, forces: Floats, tolerance: float) -> Floats:
        """Displacements (3n,) in mm under forces (3n,) in N.

        They are the sum of an even and an odd solution.
        """
        local_forces = forces.reshape(-1, 3) @ self._axes
        near_forces, mirrored_forces = local_forces[self._nodes], local_forces[self._opposite] * _MIRRORED
        # If the even or the odd part is small, its precision relative to itself may be low.
        whole_load_N = float(np.linalg.norm(self._share * local_forces[self._nodes]))
        even, odd = (
            solve((self._share * half_load).ravel(), tolerance, whole_load_N).reshape(-1, 3)
            for solve, half_load in zip(
                self._halves, (near_forces + mirrored_forces, near_forces - mirrored_forces), strict=True
            )
        )
        u = np.empty_like(local_forces)
        # On the plane both values are equal.
        u[self._opposite], u[self._nodes] = (even - odd) * _MIRRORED, even + odd
        return np.asarray((u @ self._axes.T).ravel())

    def forget(self) -> None:
        """Start the next solutions of both halves from zero."""
        for solve in self._halves:
            solve.forget()

    def release(self) -> None:
        """Release the memory of both factors."""
        for solve in self._halves:
            solve.release()
