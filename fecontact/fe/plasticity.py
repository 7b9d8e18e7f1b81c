"""Elastic-plastic flow in the elements of a body, as strains that its elastic stiffness is loaded with.

Von Mises plasticity with isotropic linear hardening, or none, under small strains. The plastic strain of a body acts on
its elastic stiffness as forces at the nodes of the elements that yield (initial strains; Zienkiewicz, Valliappan and
King 1969), so that no stiffness but the elastic one is ever factorised. Range of validity: one loading that never turns
back, of steel without stresses of its own; plastic strains of a few per cent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fecontact.fe.body_mesh import CORNER_SIGNS, BodyMesh, shape_gradients
from fecontact.material import Material

Floats = NDArray[np.float64]

# Parts of a straight way of the strain on which the flow is followed: halving them moves a contact's peak by 0.1 %.
SUBSTEPS = 8
_ROOT = np.sqrt(2.0 / 3.0)
_ONE = np.eye(3)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticState:
    """Plastic strain (..., 3, 3), which keeps the volume, and the equivalent plastic strain (...) that was passed.

    The second is the sum of sqrt(2/3) |d plastic|: in uniaxial stress the plastic strain itself.
    """

    strain: Floats
    equivalent: Floats

    @classmethod
    def none(cls, *shape: int) -> PlasticState:
        """The state of virgin material at points of some shape."""
        return cls(strain=np.zeros((*shape, 3, 3)), equivalent=np.zeros(shape))


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticLaw:
    """Material of a body that yields: shear modulus, yield stress and plastic modulus d stress / d plastic in MPa."""

    shear_MPa: float
    yield_MPa: float
    hardening_MPa: float

    @classmethod
    def of(cls, material: Material) -> PlasticLaw:
        """The law of a material; one without a yield stress never yields."""
        yield_MPa = math.inf if material.yield_MPa is None else material.yield_MPa
        return cls(shear_MPa=material.shear_MPa, yield_MPa=yield_MPa, hardening_MPa=material.hardening_MPa)

    def stress(self, strain: Floats, state: PlasticState) -> Floats:
        """Deviatoric stress (..., 3, 3) in MPa at strains (..., 3, 3)."""
        return 2.0 * self.shear_MPa * (_deviator(strain) - state.strain)

    def von_mises(self, strain: Floats, state: PlasticState) -> Floats:
        """Von Mises stress (...) in MPa at strains (..., 3, 3)."""
        return np.asarray(_norm(self.stress(strain, state)) / _ROOT)

    def flow(self, start: Floats, end: Floats, state: PlasticState, substeps: int = SUBSTEPS) -> PlasticState:
        """State after a straight way of the strain from `start` to `end` (..., 3, 3).

        Radial return (Wilkins 1964; Simo and Hughes 1998, box 3.1) in each of `substeps` equal parts of the way.
        """
        # the elastic domain is convex: who is inside at both ends has been so all the way
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
    """Elements of a body that may yield, with what their strains and forces take.

    Attributes
    ----------
    elements (m,), nodes (m, 8)
        Their places among all hexahedra, and their nodes.
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
        """Set up some elements (m,) of a mesh."""
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
        """The zone of some of its elements, chosen (m,)."""
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
        # it keeps the volume, so that Hooke's law is 2 G alone
        stress = (2.0 * self.law.shear_MPa * self.volumes_mm3)[..., None, None] * plastic_strain
        at_corners = self.gradients.reshape(m, points * 3, 8).transpose(0, 2, 1) @ stress.reshape(m, points * 3, 3)
        total = np.zeros((self.points, 3))
        np.add.at(total, self.nodes, at_corners)
        return total

    @property
    def weights(self) -> Floats:
        """Weights (m, 8, 1, 1) of a plastic strain whose squares sum up to twice its elastic energy, N mm."""
        return np.asarray(np.sqrt(2.0 * self.law.shear_MPa * self.volumes_mm3)[..., None, None])


def gauss_gradients(corners: Floats) -> tuple[Floats, Floats]:
    """Derivatives (m, 8, 3, 8) of the shape functions at the Gauss points of hexahedra with corners (m, 8, 3), 1/mm.

    And the volume (m, 8) in mm^3 that each point stands for. Each point lies nearest to the corner of its number.
    """
    gradients, volumes = np.empty((len(corners), 8, 3, 8)), np.empty((len(corners), 8))
    for k, place in enumerate(CORNER_SIGNS / np.sqrt(3.0)):
        by_unit = shape_gradients(*place)
        jacobian = corners.transpose(0, 2, 1) @ by_unit
        gradients[:, k] = np.linalg.solve(jacobian.transpose(0, 2, 1), by_unit.T[None].repeat(len(corners), axis=0))
        volumes[:, k] = np.linalg.det(jacobian)
    return gradients, volumes


def _deviator(tensor: Floats) -> Floats:
    mean = np.trace(tensor, axis1=-2, axis2=-1) / 3.0
    return np.asarray(tensor - mean[..., None, None] * _ONE)


def _norm(tensor: Floats) -> Floats:
    return np.asarray(np.sqrt(np.einsum("...ij,...ij->...", tensor, tensor)))
