"""The mesh of one body, and what is measured on it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import FoldedMesh

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


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
        Nodes of the uniform block below each contact node, along the normal into the body; the first one lies on it.
    half
        Whether only x >= 0 is meshed.
    volume_mm3
        Volume of the swept section in closed form.
    """

    name: Literal["rail", "wheel"]
    points: Floats
    hexes: Integers
    surfaces: dict[str, Integers] = field(repr=False)
    contact_nodes: Integers
    block_nodes: Integers = field(repr=False)
    half: bool
    volume_mm3: float


# Corner, and its three neighbours in a right-handed order, of a hexahedron in VTK order.
_CORNERS = np.array(
    [[0, 1, 3, 4], [1, 2, 0, 5], [2, 3, 1, 6], [3, 0, 2, 7], [4, 7, 5, 0], [5, 4, 6, 1], [6, 5, 7, 2], [7, 6, 4, 3]]
)


def corner_jacobians(mesh: BodyMesh) -> Floats:
    """Jacobian determinants (m, 8) at the corners of the hexahedra (mm^3)."""
    p = mesh.points[mesh.hexes[:, _CORNERS]]
    e = p[:, :, 1:] - p[:, :, :1]
    return np.asarray(np.einsum("mci,mci->mc", np.cross(e[:, :, 0], e[:, :, 1]), e[:, :, 2]))


def mesh_volume(mesh: BodyMesh) -> float:
    """Volume (mm^3) of the trilinear hexahedra, by quadrature (exact)."""
    nodes, _ = np.polynomial.legendre.leggauss(2)
    total = 0.0
    p = mesh.points[mesh.hexes]
    for r in nodes:
        for s in nodes:
            for t in nodes:
                d = p.transpose(0, 2, 1) @ shape_gradients(r, s, t)
                total += float(np.sum(np.linalg.det(d)))
    return total


CORNER_SIGNS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
)
"""Corners of the unit hexahedron from -1 to 1, in VTK order; its Gauss points lie at 1 / sqrt(3) of them."""


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
    """Guards of the mesh hand-over: a broken mesh would give a wrong pressure without any message."""
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
    # in the mean: around a corner some of them may point sideways and further
    upwards = up * float(surface_normals(mesh, "contact")[:, 2].mean())
    assert upwards > 0.0, f"{mesh.name}: contact normals point inwards"
