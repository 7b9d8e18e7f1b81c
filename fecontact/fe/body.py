"""One elastic body: its mesh, how it is held, and its stiffness ready to be solved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from fecontact.errors import InputError
from fecontact.fe.body_mesh import BodyMesh
from fecontact.fe.linear_solver import LinearSolver, SolverName, amg_solver, pardiso_solver
from fecontact.fe.stiffness import stiffness
from fecontact.material import Material

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]


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

    def __getstate__(self) -> dict[str, Any]:
        # a factor lives in the memory of the library that made it
        return {**self.__dict__, "solve": _no_factor}

    def displacements(self, nodes: Integers, forces: Floats, more: Floats | None = None) -> Floats:
        """Displacements (n, 3) in mm under forces (k, 3) in N on some `nodes` (k,), and `more` (n, 3) on all."""
        load = np.zeros(3 * len(self.mesh.points)) if more is None else more.reshape(-1).copy()
        np.add.at(load.reshape(-1, 3), nodes, forces)
        return self.solve(load).reshape(-1, 3)

    def close(self) -> None:
        """Release the factor's memory now."""
        release = getattr(self.solve, "release", None)
        if release is not None:
            release()


def _no_factor(forces: Floats) -> Floats:
    raise InputError("a body that was pickled has no factor of its stiffness; solve the case again")


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
    make = pardiso_solver if solver == "pardiso" else amg_solver
    return ElasticBody(mesh=mesh, material=material, solve=make(matrix, free, mesh.points), solver=solver)
