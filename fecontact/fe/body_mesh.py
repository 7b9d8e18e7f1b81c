"""The mesh of one body: hexahedra, surfaces, volume and normals, checked."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from fecontact.arrays import Floats, Integers
from fecontact.errors import FoldedMesh


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
        across = half_of(mesh)[1]
        off = max(np.abs(apart @ across[:, 1:]).max(), np.ptp(both @ across[:, 0]))
        assert off < 1e-9 * np.ptp(mesh.points), f"{mesh.name}: {off:.2g} mm off its own mirror image"
    # only the mean: around a corner some normals may point sideways or even backwards
    upwards = up * float(surface_normals(mesh, "contact")[:, 2].mean())
    assert upwards > 0.0, f"{mesh.name}: contact normals point inwards"


def half_of(mesh: BodyMesh) -> tuple[Integers, Floats]:
    """Nodes (k,) on one side of the middle plane of a mesh and on it, and axes (3, 3) whose first is its normal."""
    opposite, points = mesh.opposite, mesh.points
    apart = points - points[opposite]
    first = int(np.argmax(np.einsum("nd,nd->n", apart, apart)))
    axes, _ = np.linalg.qr(np.column_stack([apart[first], np.eye(3)]))
    return np.flatnonzero((apart @ apart[first] > 0.0) | (opposite == np.arange(len(points)))), axes
