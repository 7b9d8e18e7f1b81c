"""Stresses in the elements, their largest values, and the plastic strains that follow from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CloughTocher2DInterpolator, CubicSpline
from scipy.sparse import csc_matrix

from fecontact.arrays import Floats, Integers
from fecontact.bodies import Material
from fecontact.fe.body import ElasticBody
from fecontact.fe.body_mesh import CORNER_SIGNS, BodyMesh, shape_gradients, vector_product
from fecontact.fe.stiffness import elasticity_MPa


def nodal_stress(body: ElasticBody, displacements: Floats, relaxed: Floats | None = None) -> Floats:
    """Stress (n, 6) in MPa at the nodes: XX YY ZZ XY YZ XZ, the mean of the adjacent elements' corner values.

    Corner values are extrapolated from the 2 x 2 x 2 Gauss points, where trilinear elements are most accurate.

    Parameters
    ----------
    displacements (n, 3)
        Displacements of all nodes in mm.
    relaxed (m, 8, 6)
        Stress at the Gauss points that plastic strain takes off.
    """
    mesh, signs = body.mesh, CORNER_SIGNS
    p, u = mesh.points[mesh.hexes], displacements[mesh.hexes]
    at_gauss = np.empty((len(mesh.hexes), 8, 6))
    law = np.stack([elasticity_MPa(body.material)[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))])
    for k in range(8):
        # row l and column k: the derivative of u_k by x_l
        at_gauss[:, k] = np.tensordot(_at_gauss_point(p, k)[0] @ u, law, axes=((2, 1), (1, 2)))
    if relaxed is not None:
        at_gauss -= relaxed
    # value at corner c = sum over the Gauss points of value times trilinear function at the scaled corner position
    weights = np.prod(1.0 + signs[:, None, :] * signs[None, :, :] * np.sqrt(3.0), axis=2) / 8.0
    return mean_at_nodes(mesh, weights @ at_gauss)


def mean_at_nodes(mesh: BodyMesh, corners: Floats) -> Floats:
    """Mean (n, k) at the nodes of values (m, 8, k) at the corners of all adjacent elements."""
    return _sum_at_nodes(mesh.hexes, corners, len(mesh.points)) / np.bincount(mesh.hexes.ravel())[:, None]


def _sum_at_nodes(hexes: Integers, corners: Floats, count: int) -> Floats:
    """Sum (count, k) at the nodes of values (m, 8, k) at the corners of hexahedra (m, 8); numpy.add.at is slower."""
    adjacent = csc_matrix((np.ones(hexes.size), hexes.ravel(), np.arange(hexes.size + 1)), shape=(count, hexes.size))
    return np.asarray(adjacent @ corners.reshape(hexes.size, -1))


def von_mises(stress: Floats) -> Floats:
    """Von Mises stress (n,) of stresses (n, 6) in the order XX YY ZZ XY YZ XZ."""
    xx, yy, zz, xy, yz, xz = np.moveaxis(stress, -1, 0)
    return np.asarray(np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + yz**2 + xz**2)))


# --- The largest von Mises stress below the contact, from the finite elements.


@dataclass(frozen=True, kw_only=True)
class StressPeak:
    """Largest von Mises stress in a body below its contact zone, in MPa, and its place.

    Attributes
    ----------
    depth_mm
        Depth below the surface, along the normal; 0 at the surface.
    x_mm, y_mm
        Position in the track frame of the surface point above the stress peak.
    """

    von_mises_MPa: float
    depth_mm: float
    x_mm: float
    y_mm: float


def stress_peak(mesh: BodyMesh, stress: Floats) -> StressPeak:
    """Find the largest von Mises stress below the contact zone of a body, from its stress (n, 6) in MPa at the nodes.

    The node of the uniform block with the largest stress decides about the normal. Along this normal a cubic spline
    goes through the nodes, so that depth and size do not stick to the layers. The peak below a Hertz patch lies at 0.48
    to 0.78 of the shorter semi-axis (Johnson 1985, section 4.2 and eq. 3.69). The block is 1.5 semi-axes deep if the
    surface allows; below a tight corner the block ends earlier, and the line continues through the mesh below.
    """
    values = von_mises(stress)
    i, j, k = np.unravel_index(int(np.argmax(values[mesh.block_nodes])), mesh.block_nodes.shape)
    column = mesh.block_nodes[i, j]
    depth, below = np.linalg.norm(mesh.points[column] - mesh.points[column[0]], axis=1), values[column]
    if k == column.size - 1:
        further = _below_the_block(mesh, int(i), int(j), values)
        depth, below = np.concatenate([depth, further[0]]), np.concatenate([below, further[1]])
    depth_mm, size = peak_on_line(depth, below)
    x, y, _ = mesh.points[column[0]]
    return StressPeak(von_mises_MPa=size, depth_mm=depth_mm, x_mm=float(x), y_mm=float(y))


def _below_the_block(mesh: BodyMesh, i: int, j: int, values: Floats) -> tuple[Floats, Floats]:
    """Depths from below a block's column (i, j) down to half the zone's width, and nodal values at these depths.

    Values are cubic by piecewise cubics (Clough and Tocher) among the nodes of the cross-section.
    """
    # nodes are numbered cross-section by cross-section
    count = int(mesh.block_nodes[1, 0, 0] - mesh.block_nodes[0, 0, 0])
    first = int(mesh.block_nodes[i, j, 0]) // count * count
    line = mesh.points[mesh.block_nodes[i, j]]
    row = mesh.points[mesh.block_nodes[i, :, 0]]
    depths = np.linalg.norm(line - line[0], axis=1)
    inward = (line[-1] - line[0]) / depths[-1]
    across = row[min(j + 1, len(row) - 1)] - row[max(j - 1, 0)]
    across -= (across @ inward) * inward
    across /= np.linalg.norm(across)
    section = (mesh.points[first : first + count] - line[0]) @ np.column_stack([inward, across])
    reach = 0.5 * float(np.linalg.norm(row[-1] - row[0]))
    near = np.all(np.abs(section) < 2.0 * reach, axis=1)
    step = depths[-1] - depths[-2]
    further = np.arange(depths[-1] + step, max(reach, depths[-1] + 3.0 * step), step)
    cubic = CloughTocher2DInterpolator(section[near], values[first : first + count][near])(further, 0.0 * further)
    inside = np.isfinite(cubic)
    return further[inside], cubic[inside]


def peak_on_line(depth_mm: Floats, values: Floats) -> tuple[float, float]:
    """Depth and size of the largest value on a cubic spline (not-a-knot) through values at rising depths (n,)."""
    spline = CubicSpline(depth_mm, values)
    turns = spline.derivative().roots(extrapolate=False)
    # a constant piece has no single root
    candidates = np.concatenate([depth_mm, turns[np.isfinite(turns)]])
    sizes = spline(candidates)
    best = int(np.argmax(sizes))
    return float(candidates[best]), float(sizes[best])


# --- Elastic-plastic flow in the elements of a body, as initial strains on its elastic stiffness.
#
# Von Mises plasticity with isotropic linear hardening, or none, under small strains. The plastic strain of a body acts
# as forces at the nodes of the elements that yield (initial strains; Zienkiewicz, Valliappan and King 1969), so that
# only the elastic stiffness is ever factorised. Range of validity: a load that only grows, steel without residual
# stresses, and plastic strains of a few per cent.

# Substeps of a straight strain path on which the flow is followed: halving them moves a contact's peak by 0.1 %.
SUBSTEPS = 8
_ROOT = np.sqrt(2.0 / 3.0)
_ONE = np.eye(3)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticState:
    """Plastic strain (..., 3, 3), which keeps the volume, and accumulated equivalent plastic strain (...).

    The equivalent strain is the sum of sqrt(2/3) |d plastic|: in uniaxial stress it is the plastic strain.
    """

    strain: Floats
    equivalent: Floats

    @classmethod
    def none(cls, *shape: int) -> PlasticState:
        """State of virgin material at an array of points."""
        return cls(strain=np.zeros((*shape, 3, 3)), equivalent=np.zeros(shape))


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticLaw:
    """Material of a body that yields: shear modulus, yield stress and plastic modulus d stress / d plastic in MPa."""

    shear_MPa: float
    yield_MPa: float
    hardening_MPa: float

    @classmethod
    def of(cls, material: Material) -> PlasticLaw:
        """The law of a material; a material without a yield stress never yields."""
        yield_MPa = math.inf if material.yield_MPa is None else material.yield_MPa
        return cls(shear_MPa=material.shear_MPa, yield_MPa=yield_MPa, hardening_MPa=material.hardening_MPa)

    def stress(self, strain: Floats, state: PlasticState) -> Floats:
        """Deviatoric stress (..., 3, 3) in MPa at strains (..., 3, 3)."""
        return 2.0 * self.shear_MPa * (_deviator(strain) - state.strain)

    def von_mises(self, strain: Floats, state: PlasticState) -> Floats:
        """Von Mises stress (...) in MPa at strains (..., 3, 3)."""
        return np.asarray(_norm(self.stress(strain, state)) / _ROOT)

    def flow(self, start: Floats, end: Floats, state: PlasticState, substeps: int = SUBSTEPS) -> PlasticState:
        """State after a straight strain path from `start` to `end` (..., 3, 3).

        Radial return (Wilkins 1964; Simo and Hughes 1998, box 3.1) in each of `substeps` equal parts of the path.
        """
        # the elastic domain is convex: a path that is inside at both ends is inside all the way
        yields = self.von_mises(end, state) > self.yield_MPa + self.hardening_MPa * state.equivalent
        if not np.any(yields):
            return state
        first, last = _deviator(start[yields]), _deviator(end[yields])
        plastic, equivalent = state.strain[yields], state.equivalent[yields]
        for k in range(1, substeps + 1):
            strain = first + (k / substeps) * (last - first)
            trial = 2.0 * self.shear_MPa * (strain - plastic)
            size = _norm(trial)
            beyond = size - _ROOT * (self.yield_MPa + self.hardening_MPa * equivalent)
            rate = np.maximum(beyond, 0.0) / (2.0 * self.shear_MPa + _ROOT**2 * self.hardening_MPa)
            # a point without stress has no direction, and does not yield
            plastic = plastic + (rate / np.where(size > 0.0, size, 1.0))[..., None, None] * trial
            equivalent = equivalent + _ROOT * rate
        strains, passed = state.strain.copy(), state.equivalent.copy()
        strains[yields], passed[yields] = plastic, equivalent
        return PlasticState(strain=strains, equivalent=passed)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticZone:
    """Elements of a body that may yield, with the arrays for their strains and forces.

    Attributes
    ----------
    elements (m,), nodes (m, 8)
        Indices of the elements among all hexahedra, and nodes of the elements.
    gradients (m, 8 points, 3, 8 corners)
        Derivatives of the shape functions by x, y, z at the Gauss points, 1/mm.
    volumes_mm3 (m, 8)
        Volume that each Gauss point stands for, in the model.
    """

    law: PlasticLaw
    elements: NDArray[np.int64]
    nodes: NDArray[np.int64]
    gradients: Floats
    volumes_mm3: Floats
    points: int

    @classmethod
    def of(cls, mesh: BodyMesh, law: PlasticLaw, elements: NDArray[np.int64]) -> PlasticZone:
        """The zone of some elements (m,) of a mesh."""
        nodes = mesh.hexes[elements]
        gradients, volumes = gauss_gradients(mesh.points[nodes])
        return cls(
            law=law,
            elements=elements,
            nodes=nodes,
            gradients=gradients,
            volumes_mm3=volumes,
            points=len(mesh.points),
        )

    def part(self, chosen: NDArray[np.bool_]) -> PlasticZone:
        """The part of the zone with the elements chosen (m,)."""
        names = ("elements", "nodes", "gradients", "volumes_mm3")
        return replace(self, **{name: getattr(self, name)[chosen] for name in names})

    def none(self) -> PlasticState:
        """The state of virgin material."""
        return PlasticState.none(*self.volumes_mm3.shape)

    def strains(self, displacements: Floats) -> Floats:
        """Strains (m, 8, 3, 3) at the Gauss points under displacements (n, 3) in mm of all nodes."""
        m, points = self.volumes_mm3.shape
        gradient = self.gradients.reshape(m, points * 3, 8) @ displacements[self.nodes]
        gradient = gradient.reshape(m, points, 3, 3)
        return 0.5 * (gradient + gradient.transpose(0, 1, 3, 2))

    def forces(self, plastic_strain: Floats) -> Floats:
        """Forces (n, 3) in N that a plastic strain (m, 8, 3, 3) puts on all nodes: int grad N . C : plastic."""
        m, points = self.volumes_mm3.shape
        # the plastic strain keeps the volume, so that Hooke's law is 2 G alone
        stress = (2.0 * self.law.shear_MPa * self.volumes_mm3)[..., None, None] * plastic_strain
        at_corners = self.gradients.reshape(m, points * 3, 8).transpose(0, 2, 1) @ stress.reshape(m, points * 3, 3)
        return _sum_at_nodes(self.nodes, at_corners, self.points)

    @property
    def weights(self) -> Floats:
        """Weights (m, 8, 1, 1) of a plastic strain whose squares sum up to twice its elastic energy, N mm."""
        return np.asarray(np.sqrt(2.0 * self.law.shear_MPa * self.volumes_mm3)[..., None, None])


def gauss_gradients(corners: Floats) -> tuple[Floats, Floats]:
    """Derivatives (m, 8, 3, 8) of the shape functions at the Gauss points of hexahedra with corners (m, 8, 3), 1/mm.

    Also the volume (m, 8) in mm^3 that each point stands for. Point i lies nearest to corner i.
    """
    gradients, volumes = np.empty((len(corners), 8, 3, 8)), np.empty((len(corners), 8))
    for k in range(8):
        gradients[:, k], volumes[:, k] = _at_gauss_point(corners, k)
    return gradients, volumes


def _at_gauss_point(corners: Floats, number: int) -> tuple[Floats, Floats]:
    """Derivatives (m, 3, 8) and volume (m,) of one of the eight points; see `gauss_gradients`."""
    by_unit = shape_gradients(*(CORNER_SIGNS[number] / np.sqrt(3.0)))
    jacobian = corners.transpose(0, 2, 1) @ by_unit
    x, y, z = jacobian.transpose(1, 2, 0)
    # by cofactors: LAPACK takes four times as long for matrices that are so small
    cofactors = np.stack((vector_product(y, z), vector_product(z, x), vector_product(x, y)))
    volume = (x * cofactors[0]).sum(axis=0)
    return (cofactors / volume).transpose(2, 0, 1) @ by_unit.T, volume


def _deviator(tensor: Floats) -> Floats:
    mean = np.trace(tensor, axis1=-2, axis2=-1) / 3.0
    return np.asarray(tensor - mean[..., None, None] * _ONE)


def _norm(tensor: Floats) -> Floats:
    return np.asarray(np.sqrt(np.einsum("...ij,...ij->...", tensor, tensor)))
