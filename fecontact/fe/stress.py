"""Stresses in the elements, their largest values, and the plastic strains that follow from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, RBFInterpolator
from scipy.sparse import csc_matrix

from fecontact.arrays import Floats, Integers
from fecontact.bodies import Material
from fecontact.fe.body import ElasticBody
from fecontact.fe.body_mesh import CORNER_SIGNS, BodyMesh, shape_gradients, vector_product
from fecontact.fe.stiffness import elasticity_MPa


def nodal_stress(body: ElasticBody, displacements: Floats, relaxed: Floats | None = None) -> Floats:
    """Stress at the nodes: the mean of the corner values of adjacent elements.

    Corner values are extrapolated from the 2 x 2 x 2 Gauss points, where trilinear elements are most accurate.

    Parameters
    ----------
    body
        Elastic body with n nodes and m hexahedra.
    displacements : ndarray of shape (n, 3)
        Displacements of all nodes in mm.
    relaxed : ndarray of shape (m, 8, 6) or None
        Stress in MPa at the Gauss points that plastic strain removes; None without plastic strain.

    Returns
    -------
    stress (n, 6)
        XX YY ZZ XY YZ XZ in MPa.
    """
    mesh, signs = body.mesh, CORNER_SIGNS
    p, u = mesh.points[mesh.hexes], displacements[mesh.hexes]
    gauss_stress = np.empty((len(mesh.hexes), 8, 6))
    tensor_rows = np.stack(
        [elasticity_MPa(body.material)[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))]
    )
    for k in range(8):
        # Row l and column k: the derivative of u_k by x_l.
        gauss_stress[:, k] = np.tensordot(_gradients_at_gauss_point(p, k)[0] @ u, tensor_rows, axes=((2, 1), (1, 2)))
    if relaxed is not None:
        gauss_stress -= relaxed
    # The value at corner c is the sum over the Gauss points of their values times the trilinear functions at the scaled
    # corner position.
    weights = np.prod(1.0 + signs[:, None, :] * signs[None, :, :] * np.sqrt(3.0), axis=2) / 8.0
    return average_at_nodes(mesh, weights @ gauss_stress)


def average_at_nodes(mesh: BodyMesh, corners: Floats) -> Floats:
    """Mean at the nodes of values at the corners of all adjacent elements.

    Parameters
    ----------
    mesh
        Mesh with n nodes and m hexahedra.
    corners : ndarray of shape (m, 8, k)
        Values at the corners.

    Returns
    -------
    means (n, k)
        In the unit of the values.
    """
    return _sum_at_nodes(mesh.hexes, corners, len(mesh.points)) / np.bincount(mesh.hexes.ravel())[:, None]


def _sum_at_nodes(hexes: Integers, corners: Floats, count: int) -> Floats:
    """Sum (count, k) at the nodes of values at the corners of hexahedra.

    The values are (m, 8, k), the hexahedra (m, 8). numpy.add.at is slower.
    """
    adjacent = csc_matrix((np.ones(hexes.size), hexes.ravel(), np.arange(hexes.size + 1)), shape=(count, hexes.size))
    # a body without a plastic zone has no hexahedra, so the number of components is given
    return np.asarray(adjacent @ corners.reshape(hexes.size, corners.shape[-1]))


def von_mises(stress: Floats) -> Floats:
    """Von Mises stress of stresses in the order XX YY ZZ XY YZ XZ.

    Parameters
    ----------
    stress : ndarray of shape (n, 6)
        Stress in MPa or in another unit.

    Returns
    -------
    von_mises (n,)
        In the unit of the stress.

    Examples
    --------
    >>> float(von_mises(np.array([200.0, 0.0, 0.0, 0.0, 0.0, 0.0])))
    200.0
    """
    xx, yy, zz, xy, yz, xz = np.moveaxis(stress, -1, 0)
    return np.asarray(np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + yz**2 + xz**2)))


# --- The largest von Mises stress below the contact, from the finite elements.


@dataclass(frozen=True, kw_only=True)
class StressPeak:
    """Largest von Mises stress in a body below its contact zone, and its place.

    Attributes
    ----------
    von_mises_MPa
        Von Mises stress in MPa.
    depth_mm
        Depth below the surface, along the normal; 0 at the surface.
    x_mm, y_mm
        Position in the track frame of the surface point above the stress peak.
    """

    von_mises_MPa: float
    depth_mm: float
    x_mm: float
    y_mm: float


def find_stress_peak(mesh: BodyMesh, stress: Floats) -> StressPeak:
    """Find the largest von Mises stress below the contact zone of a body.

    The node of the uniform block with the largest stress decides on the normal. Along this normal a cubic spline runs
    through the nodes, so that depth and size do not stick to the layers. The peak below a Hertz patch lies at 0.48 to
    0.78 of the shorter semi-axis (Johnson 1985, section 4.2 and eq. 3.69). The block is 1.5 semi-axes deep if the
    surface allows. Below a tight corner the block ends earlier, and the line continues through the mesh below.

    Parameters
    ----------
    mesh
        Mesh of the body with n nodes.
    stress : ndarray of shape (n, 6)
        Stress at the nodes in MPa.

    Returns
    -------
    StressPeak
        Size and place of the peak.
    """
    values = von_mises(stress)
    i, j, k = np.unravel_index(int(np.argmax(values[mesh.block_nodes])), mesh.block_nodes.shape)
    column = mesh.block_nodes[i, j]
    depths, column_values = np.linalg.norm(mesh.points[column] - mesh.points[column[0]], axis=1), values[column]
    if k == column.size - 1:
        continuation = _values_below_block(mesh, int(i), int(j), values)
        depths, column_values = (
            np.concatenate([depths, continuation[0]]),
            np.concatenate([column_values, continuation[1]]),
        )
    depth_mm, peak_MPa = find_peak(depths, column_values)
    x, y, _ = mesh.points[column[0]]
    return StressPeak(von_mises_MPa=peak_MPa, depth_mm=depth_mm, x_mm=float(x), y_mm=float(y))


def _values_below_block(mesh: BodyMesh, i: int, j: int, values: Floats) -> tuple[Floats, Floats]:
    """Depths and nodal values below a column (i, j) of the block.

    They extend down to half the zone's width. Values are interpolated by a thin-plate spline through the nodes of the
    cross-section. Interpolation on triangles depends on the last digits of the nodes: the corners of a rectangle are on
    a circle, so that either diagonal may divide it. At a switch tongue this changed the depth of the peak by 1.1 %.
    """
    # Nodes are numbered cross-section by cross-section.
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
    steps = max(3, round((reach - depths[-1]) / step))
    new_depths = depths[-1] + step * np.arange(1, steps + 1)
    # A thin body ends above half the zone's width; a spline must not be used beyond its nodes.
    new_depths = new_depths[new_depths <= section[near, 0].max()]
    spline = RBFInterpolator(section[near], values[first : first + count][near], kernel="thin_plate_spline")
    return new_depths, spline(np.column_stack([new_depths, np.zeros_like(new_depths)]))


def find_peak(depth_mm: Floats, values: Floats) -> tuple[float, float]:
    """Depth and size of the largest value on a cubic spline (not-a-knot) through values.

    Parameters
    ----------
    depth_mm : ndarray of shape (n,)
        Increasing depths in mm.
    values : ndarray of shape (n,)
        Values at these depths.

    Returns
    -------
    depth, size
        Depth in mm and size in the unit of the values.
    """
    spline = CubicSpline(depth_mm, values)
    stationary_depths = spline.derivative().roots(extrapolate=False)
    # A constant piece has no single root.
    candidates = np.concatenate([depth_mm, stationary_depths[np.isfinite(stationary_depths)]])
    sizes = spline(candidates)
    largest = int(np.argmax(sizes))
    return float(candidates[largest]), float(sizes[largest])


# --- Elastic-plastic flow in the elements of a body, as initial strains on its elastic stiffness.
#
# Von Mises plasticity with isotropic linear hardening, or none, under small strains. The plastic strain of a body acts
# as forces at the nodes of the elements that yield (initial strains; Zienkiewicz, Valliappan and King 1969), so that
# only the elastic stiffness is ever factorised. Range of validity: a load that only grows, steel without residual
# stresses, and plastic strains of a few per cent.

# Substeps of a straight strain path for the plastic flow. Half the substep size moves a contact's peak by 0.1 %.
SUBSTEPS = 8
_SQRT_TWO_THIRDS = np.sqrt(2.0 / 3.0)
_UNIT_TENSOR = np.eye(3)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticState:
    """Plastic strain and accumulated equivalent plastic strain.

    The plastic strain keeps the volume. The equivalent strain is the sum of sqrt(2/3) |d plastic|: in uniaxial stress
    it is the plastic strain.

    Attributes
    ----------
    strain : ndarray of shape (..., 3, 3)
        Plastic strain (-).
    equivalent : ndarray of shape (...)
        Accumulated equivalent plastic strain (-).
    """

    strain: Floats
    equivalent: Floats

    @classmethod
    def none(cls, *shape: int) -> PlasticState:
        """State of virgin material at an array of points.

        Parameters
        ----------
        *shape
            Shape of the array of points.

        Returns
        -------
        PlasticState
            State with zero plastic strain.
        """
        return cls(strain=np.zeros((*shape, 3, 3)), equivalent=np.zeros(shape))


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticLaw:
    """Material of a body that yields.

    Attributes
    ----------
    shear_MPa
        Shear modulus.
    yield_MPa
        Yield stress; infinite for a material that never yields.
    hardening_MPa
        Plastic modulus d stress / d plastic strain.

    Examples
    --------
    >>> law = PlasticLaw(shear_MPa=80e3, yield_MPa=400.0, hardening_MPa=0.0)
    >>> strain = np.zeros((3, 3))
    >>> strain[0, 1] = strain[1, 0] = 0.01
    >>> state = law.flow(np.zeros((3, 3)), strain, PlasticState.none())
    >>> round(float(law.von_mises(strain, state)), 6)
    400.0
    """

    shear_MPa: float
    yield_MPa: float
    hardening_MPa: float

    @classmethod
    def of(cls, material: Material) -> PlasticLaw:
        """Plastic law of a material.

        A material without a yield stress never yields.

        Parameters
        ----------
        material
            Elastic constants, yield stress and hardening.

        Returns
        -------
        PlasticLaw
            The law; its yield stress is infinite without yielding.
        """
        yield_MPa = math.inf if material.yield_MPa is None else material.yield_MPa
        return cls(shear_MPa=material.shear_MPa, yield_MPa=yield_MPa, hardening_MPa=material.hardening_MPa)

    def stress(self, strain: Floats, state: PlasticState) -> Floats:
        """Deviatoric stress (..., 3, 3) in MPa at strains (..., 3, 3).

        Parameters
        ----------
        strain : ndarray of shape (..., 3, 3)
            Total strain (-).
        state
            Plastic strain at these points.

        Returns
        -------
        ndarray of shape (..., 3, 3)
            Deviatoric stress in MPa.
        """
        return 2.0 * self.shear_MPa * (_deviator(strain) - state.strain)

    def von_mises(self, strain: Floats, state: PlasticState) -> Floats:
        """Von Mises stress (...) in MPa at strains (..., 3, 3).

        Parameters
        ----------
        strain : ndarray of shape (..., 3, 3)
            Total strain (-).
        state
            Plastic strain at these points.

        Returns
        -------
        ndarray of shape (...)
            Von Mises stress in MPa.
        """
        return np.asarray(_norm(self.stress(strain, state)) / _SQRT_TWO_THIRDS)

    def flow(self, start: Floats, end: Floats, state: PlasticState, substeps: int = SUBSTEPS) -> PlasticState:
        """State after a straight strain path.

        Radial return (Wilkins 1964; Simo and Hughes 1998, box 3.1) in equal substeps of the path.

        Parameters
        ----------
        start, end : ndarray of shape (..., 3, 3)
            Total strains at both ends of the path (-).
        state
            State at the start.
        substeps
            Number of substeps.

        Returns
        -------
        PlasticState
            State at the end of the path.
        """
        # The elastic domain is convex: a path that is inside at both ends is inside all the way.
        yields = self.von_mises(end, state) > self.yield_MPa + self.hardening_MPa * state.equivalent
        if not np.any(yields):
            return state
        first, last = _deviator(start[yields]), _deviator(end[yields])
        plastic, equivalent = state.strain[yields], state.equivalent[yields]
        for k in range(1, substeps + 1):
            strain = first + (k / substeps) * (last - first)
            trial = 2.0 * self.shear_MPa * (strain - plastic)
            trial_norm = _norm(trial)
            excess = trial_norm - _SQRT_TWO_THIRDS * (self.yield_MPa + self.hardening_MPa * equivalent)
            increment = np.maximum(excess, 0.0) / (2.0 * self.shear_MPa + _SQRT_TWO_THIRDS**2 * self.hardening_MPa)
            # A point without stress has no direction, and does not yield.
            plastic = plastic + (increment / np.where(trial_norm > 0.0, trial_norm, 1.0))[..., None, None] * trial
            equivalent = equivalent + _SQRT_TWO_THIRDS * increment
        strains, equivalents = state.strain.copy(), state.equivalent.copy()
        strains[yields], equivalents[yields] = plastic, equivalent
        return PlasticState(strain=strains, equivalent=equivalents)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticZone:
    """Elements of a body that may yield, with the arrays for their strains and forces.

    Attributes
    ----------
    law
        Plastic law of the material.
    elements : ndarray of shape (m,)
        Indices of the elements among all hexahedra.
    nodes : ndarray of shape (m, 8)
        Nodes of the elements.
    gradients : ndarray of shape (m, 8 points, 3, 8 corners)
        Derivatives of the shape functions by x, y, z at the Gauss points, 1/mm.
    volumes_mm3 : ndarray of shape (m, 8)
        Volume of the model at each Gauss point.
    points
        Number of nodes of the mesh.
    """

    law: PlasticLaw
    elements: NDArray[np.int64]
    nodes: NDArray[np.int64]
    gradients: Floats
    volumes_mm3: Floats
    points: int

    @classmethod
    def of(cls, mesh: BodyMesh, law: PlasticLaw, elements: NDArray[np.int64]) -> PlasticZone:
        """The zone of some elements of a mesh.

        Parameters
        ----------
        mesh
            Mesh of the body.
        law
            Plastic law of the material.
        elements : ndarray of shape (m,)
            Indices of the elements among all hexahedra.

        Returns
        -------
        PlasticZone
            The elements with their derivatives and volumes.
        """
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

    def part(self, is_selected: NDArray[np.bool_]) -> PlasticZone:
        """Subset of the zone with selected elements (m,).

        Parameters
        ----------
        is_selected : ndarray of shape (m,)
            Whether each element is selected.

        Returns
        -------
        PlasticZone
            Zone with the selected elements only.
        """
        names = ("elements", "nodes", "gradients", "volumes_mm3")
        return replace(self, **{name: getattr(self, name)[is_selected] for name in names})

    def none(self) -> PlasticState:
        """State of virgin material.

        Returns
        -------
        PlasticState
            State with zero plastic strain at all points of the zone.
        """
        return PlasticState.none(*self.volumes_mm3.shape)

    def strains(self, displacements: Floats) -> Floats:
        """Strains at the Gauss points under displacements of the nodes.

        Parameters
        ----------
        displacements : ndarray of shape (n, 3)
            Displacements of all nodes in mm.

        Returns
        -------
        strains (m, 8, 3, 3)
            Small strains (-).
        """
        m, points = self.volumes_mm3.shape
        gradient = self.gradients.reshape(m, points * 3, 8) @ displacements[self.nodes]
        gradient = gradient.reshape(m, points, 3, 3)
        return 0.5 * (gradient + gradient.transpose(0, 1, 3, 2))

    def forces(self, plastic_strain: Floats) -> Floats:
        """Nodal forces of a plastic strain: int grad N . C : plastic.

        Parameters
        ----------
        plastic_strain : ndarray of shape (m, 8, 3, 3)
            Plastic strain at the Gauss points (-).

        Returns
        -------
        forces (n, 3)
            Forces on all nodes in N.
        """
        m, points = self.volumes_mm3.shape
        # The plastic strain keeps the volume, so that Hooke's law is 2 G alone.
        stress = (2.0 * self.law.shear_MPa * self.volumes_mm3)[..., None, None] * plastic_strain
        at_corners = self.gradients.reshape(m, points * 3, 8).transpose(0, 2, 1) @ stress.reshape(m, points * 3, 3)
        return _sum_at_nodes(self.nodes, at_corners, self.points)

    @property
    def weights(self) -> Floats:
        """Weights (m, 8, 1, 1) of a plastic strain for its elastic energy.

        The sum of the squares of the weighted strain is twice the elastic energy in N mm.
        """
        return np.asarray(np.sqrt(2.0 * self.law.shear_MPa * self.volumes_mm3)[..., None, None])


def gauss_gradients(corners: Floats) -> tuple[Floats, Floats]:
    """Derivatives of the shape functions and volumes at the Gauss points of hexahedra.

    Parameters
    ----------
    corners : ndarray of shape (m, 8, 3)
        Corners of the hexahedra in mm, in VTK order.

    Returns
    -------
    gradients (m, 8, 3, 8)
        Derivatives by x, y, z in 1/mm. Point i lies nearest to corner i.
    volumes (m, 8)
        Volume of the hexahedron at each point in mm^3.
    """
    gradients, volumes = np.empty((len(corners), 8, 3, 8)), np.empty((len(corners), 8))
    for k in range(8):
        gradients[:, k], volumes[:, k] = _gradients_at_gauss_point(corners, k)
    return gradients, volumes


def _gradients_at_gauss_point(corners: Floats, point: int) -> tuple[Floats, Floats]:
    """Derivatives (m, 3, 8) and volume (m,) at a Gauss point; see `gauss_gradients`."""
    unit_gradients = shape_gradients(*(CORNER_SIGNS[point] / np.sqrt(3.0)))
    jacobian = corners.transpose(0, 2, 1) @ unit_gradients
    x, y, z = jacobian.transpose(1, 2, 0)
    # By cofactors: LAPACK takes four times as long for such small matrices.
    cofactors = np.stack((vector_product(y, z), vector_product(z, x), vector_product(x, y)))
    volume = (x * cofactors[0]).sum(axis=0)
    return (cofactors / volume).transpose(2, 0, 1) @ unit_gradients.T, volume


def _deviator(tensor: Floats) -> Floats:
    """Deviatoric part (..., 3, 3) of tensors (..., 3, 3)."""
    mean = np.trace(tensor, axis1=-2, axis2=-1) / 3.0
    return np.asarray(tensor - mean[..., None, None] * _UNIT_TENSOR)


def _norm(tensor: Floats) -> Floats:
    """Frobenius norm (...) of tensors (..., 3, 3)."""
    return np.asarray(np.sqrt(np.einsum("...ij,...ij->...", tensor, tensor)))
