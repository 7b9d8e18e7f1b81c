"""The mesh of a body: hexahedra, surfaces, volume and normals, with checks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from fecontact.arrays import Floats, Integers
from fecontact.errors import FoldedMeshError


@dataclass(frozen=True, kw_only=True, eq=False)
class ConstrainedNodes:
    """Nodes without unknowns, far from the contact.

    There the solution has fewer layers than the mesh, and its layers are farther apart.

    Attributes
    ----------
    hexes : ndarray of shape (k, 8)
        The elements of the solution. Far from the contact each element spans several layers of the mesh.
    between : ndarray of shape (h,)
        Nodes of the mesh without unknowns. Their displacement is interpolated.
    ends : ndarray of shape (h, 2)
        The nodes with unknowns before and after each node of `between` along the sweep.
    parts : ndarray of shape (h, 2)
        Weights of the displacements of both `ends` in the displacement of the node between them.
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
    name
        `rail` or `wheel`.
    points : ndarray of shape (n, 3)
        Nodes in mm.
    hexes : ndarray of shape (m, 8)
        Cells in VTK order: four nodes of one layer, then the four nodes above them.
    surfaces
        Named boundary quadrilaterals (k, 4) with outward normals: `contact` (the uniform zone), `fixed` or `driven`,
        `symmetry` (half models), `end` (cut planes), `free`.
    contact_nodes : ndarray of shape (nx, ns)
        Nodes of the uniform zone: rows along x, columns from the gauge to the field side.
    block_nodes : ndarray of shape (nx, ns, layers)
        Nodes of the uniform block below each contact node, along the inward normal. The first of them is the contact
        node.
    half
        Whether only x >= 0 is meshed.
    volume_mm3
        Volume of the swept section in closed form.
    opposite : ndarray of shape (n,) or None
        The mirror image of each node, for a whole mesh with a mirror plane; else None.
    spacing
        Nodes without unknowns; None if the solution has all layers of the mesh.
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
    spacing: ConstrainedNodes | None = field(default=None, repr=False)

    @property
    def unknowns(self) -> int:
        """Number of displacement components, including fixed components."""
        return 3 * (len(self.points) - (0 if self.spacing is None else self.spacing.between.size))


# Each corner of a hexahedron in VTK order, and its three neighbours in a right-handed order.
_CORNERS = np.array(
    [[0, 1, 3, 4], [1, 2, 0, 5], [2, 3, 1, 6], [3, 0, 2, 7], [4, 7, 5, 0], [5, 4, 6, 1], [6, 5, 7, 2], [7, 6, 4, 3]]
)


def corner_jacobians(mesh: BodyMesh) -> Floats:
    """Jacobian determinants (m, 8) at the corners of the hexahedra, in mm^3.

    Parameters
    ----------
    mesh
        Mesh with m hexahedra.

    Returns
    -------
    ndarray of shape (m, 8)
        Determinants in mm^3; positive in a valid hexahedron.
    """
    p = mesh.points.T[:, mesh.hexes.T]
    return _determinants((p[:, _CORNERS[:, 1:]] - p[:, :, None]).swapaxes(1, 2)).T


def mesh_volume(mesh: BodyMesh) -> float:
    """Volume of the trilinear hexahedra in mm^3, by exact quadrature.

    Parameters
    ----------
    mesh
        Mesh of hexahedra.

    Returns
    -------
    float
        Volume in mm^3.
    """
    p = mesh.points.T[:, mesh.hexes.T]
    gauss_points = CORNER_SIGNS / np.sqrt(3.0)
    return sum(float(_determinants(shape_gradients(*gauss_point).T @ p).sum()) for gauss_point in gauss_points)


def _determinants(a: Floats) -> Floats:
    """Determinants (...) of matrices (3, 3, ...).

    For many small matrices this takes a fifth of LAPACK's time.
    """
    x, y, z = a
    return np.asarray((x * vector_product(y, z)).sum(axis=0))


def vector_product(a: Floats, b: Floats) -> Floats:
    """Vector product (3, ...) of vectors (3, ...).

    It multiplies components, in a fraction of the time of numpy.cross.

    Parameters
    ----------
    a, b : ndarray of shape (3, ...)
        Components of the vectors along the first axis.

    Returns
    -------
    ndarray of shape (3, ...)
        Components of a x b.
    """
    return np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))


CORNER_SIGNS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
)
"""Corners of the unit hexahedron from -1 to 1, in VTK order. Its Gauss points are the corners times 1 / sqrt(3)."""


def shape_gradients(r: float, s: float, t: float) -> Floats:
    """Derivatives of the trilinear shape functions by r, s and t.

    Parameters
    ----------
    r, s, t
        Position in the unit hexahedron, each from -1 to 1.

    Returns
    -------
    gradients (8, 3)
        Row i belongs to the corner i in VTK order.

    Examples
    --------
    >>> shape_gradients(0.0, 0.0, 0.0)[6].tolist()
    [0.125, 0.125, 0.125]
    """
    signs = CORNER_SIGNS
    factors = 1.0 + signs * np.array([r, s, t])
    return np.asarray(
        0.125
        * np.column_stack(
            [
                signs[:, 0] * factors[:, 1] * factors[:, 2],
                signs[:, 1] * factors[:, 0] * factors[:, 2],
                signs[:, 2] * factors[:, 0] * factors[:, 1],
            ]
        )
    )


def surface_normals(mesh: BodyMesh, name: str) -> Floats:
    """Outward unit normals (k, 3) of the quadrilaterals of a named surface.

    Parameters
    ----------
    mesh
        Mesh with the surface.
    name
        Name of the surface, a key of `mesh.surfaces`.

    Returns
    -------
    ndarray of shape (k, 3)
        Unit vector of each quadrilateral, perpendicular to its diagonals.
    """
    p = mesh.points[mesh.surfaces[name]]
    n = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    return np.asarray(n / np.linalg.norm(n, axis=1, keepdims=True))


def check_mesh(mesh: BodyMesh) -> None:
    """Check a finished mesh: a broken mesh would give a wrong pressure without any message.

    Parameters
    ----------
    mesh
        Mesh of the rail or of the wheel.

    Raises
    ------
    FoldedMeshError
        If a hexahedron has a corner with a Jacobian of at most zero.
    AssertionError
        If a surface is empty, the volume or the mirror image is wrong, or contact normals point inwards.
    """
    for name, quads in mesh.surfaces.items():
        assert len(quads) > 0, f"{mesh.name}: surface {name} is empty"
    jacobian = float(corner_jacobians(mesh).min())
    if jacobian <= 0.0:
        raise FoldedMeshError(
            f"{mesh.name}: the mesh folds (smallest Jacobian {jacobian:.3g} mm^3); use a finer or coarser resolution"
            " or a different cut, or check the profile for sharp corners next to the contact zone"
        )
    volume = mesh_volume(mesh)
    assert abs(volume - mesh.volume_mm3) < 1e-9 * volume, (
        f"{mesh.name}: the volume is {volume} mm^3 instead of {mesh.volume_mm3} mm^3"
    )
    outward = 1.0 if mesh.name == "rail" else -1.0
    if mesh.opposite is not None:
        differences, sums = (mesh.points + sign * mesh.points[mesh.opposite] for sign in (-1.0, 1.0))
        axes = select_half(mesh)[1]
        asymmetry = max(np.abs(differences @ axes[:, 1:]).max(), np.ptp(sums @ axes[:, 0]))
        assert asymmetry < 1e-9 * np.ptp(mesh.points), (
            f"{mesh.name}: the mesh differs from its mirror image by {asymmetry:.2g} mm"
        )
    # The mean only: around a corner some normals may point sideways or even backwards.
    mean_outward = outward * float(surface_normals(mesh, "contact")[:, 2].mean())
    assert mean_outward > 0.0, f"{mesh.name}: contact normals point inwards"


def select_half(mesh: BodyMesh) -> tuple[Integers, Floats]:
    """Nodes of half of a mesh with a mirror plane, and axes along its normal.

    Parameters
    ----------
    mesh
        A whole mesh with `opposite` nodes.

    Returns
    -------
    nodes (k,)
        Nodes on one side of the plane, and nodes on the plane.
    axes (3, 3)
        Unit vectors as columns. The first is the normal of the plane.
    """
    opposite, points = mesh.opposite, mesh.points
    differences = points - points[opposite]
    farthest = int(np.argmax(np.einsum("nd,nd->n", differences, differences)))
    axes, _ = np.linalg.qr(np.column_stack([differences[farthest], np.eye(3)]))
    return np.flatnonzero((differences @ differences[farthest] > 0.0) | (opposite == np.arange(len(points)))), axes
