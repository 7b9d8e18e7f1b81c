"""One elastic body: its mesh, its supports, its stiffness matrix and the linear solver of that matrix."""

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
from fecontact.fe.body_mesh import BodyMesh, Spacing, half_of
from fecontact.fe.linear_solver import LINEAR_TOLERANCE, ConjugateGradients, LinearSolver, SolverName, decouple_fixed
from fecontact.fe.stiffness import stiffness

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

    def held_at(held: NDArray[np.bool_]) -> ConjugateGradients:
        return ConjugateGradients(decouple_fixed(matrix, ~held), ~held, part.points, solver)

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
    nodes, axes = half_of(mesh)
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


class _BothHalves:
    """Solver of a body that is its own mirror image; it is held alike on both sides (n, 3), and so is each half."""

    def __init__(
        self, mesh: BodyMesh, held: NDArray[np.bool_], held_at: Callable[[NDArray[np.bool_]], ConjugateGradients]
    ) -> None:
        assert mesh.opposite is not None
        self._nodes, self._axes = half_of(mesh)
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
