"""Creep forces by every theory on any contact, and the creepages of a wheelset that runs along the track.

On any patch, theories of an ellipse take the ellipse of its second moments (`contact_theories.rolling.fastsim`) and the
creepages at its centre. FASTSIM marches over the patch in strips; the rolling half-space takes the unchanged pressure.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import RollingPair
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.rolling.creepage import Creepages, CreepForce, CurvedCreepages, Motion, RollingEllipse
from fecontact.contact_theories.rolling.fastsim import STRIPS, Strips, ellipse_strips, fastsim_strips, mean_creepages
from fecontact.contact_theories.rolling.kalker import kalker_linear
from fecontact.contact_theories.rolling.polach import polach
from fecontact.contact_theories.rolling.saturation import shen_hedrick_elkins, vermeulen_johnson
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.creep.steady import PressureCells, ellipse_cells, steady_rolling
from fecontact.placement.wheel_on_rail import Placement

_LAWS: dict[str, Callable[[RollingEllipse, Creepages], CreepForce]] = {
    "kalker": kalker_linear,
    "vermeulen_johnson": vermeulen_johnson,
    "she": shen_hedrick_elkins,
    "polach": polach,
}
THEORIES = (*_LAWS, "fastsim", "rolling_half_space")
"""Names of the theories, from the simplest to the exact theory."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CreepPatch:
    """A contact in the forms that creep theories need.

    Attributes
    ----------
    ellipse, centre_mm
        Ellipse of the contact, and position of its centre from the first touch point, along x and across.
    pieces
        Separate patches in strips.
    cells
        Pressure on cells.
    """

    ellipse: RollingEllipse
    centre_mm: tuple[float, float]
    pieces: tuple[Strips, ...]
    cells: PressureCells


def ellipse_patch(contact: RollingEllipse) -> CreepPatch:
    """Hertz's pressure on an ellipse at the first touch point."""
    return CreepPatch(
        ellipse=contact,
        centre_mm=(0.0, 0.0),
        pieces=(ellipse_strips(contact, STRIPS),),
        cells=ellipse_cells(contact.a_mm, contact.b_mm, contact.normal_force_N),
    )


def hertz_patch(hertz: HertzContact, pair: RollingPair) -> CreepPatch:
    """Hertz's contact; if its axes are turned, with half-widths from its second moments along x and across."""
    a, b = 0.5 * hertz.extent_x_mm, 0.5 * hertz.extent_y_mm
    scale = math.sqrt(hertz.a_mm * hertz.b_mm / (a * b))
    return ellipse_patch(RollingEllipse.of(pair, a_mm=scale * a, b_mm=scale * b, normal_force_N=hertz.normal_force_N))


def creep_force(theory: str, patch: CreepPatch, creepages: Motion) -> CreepForce:
    """Force of a theory at creepages of the first touch point, or over curved surfaces; moment about this point.

    The laws of an ellipse take the creepages at its centre, or over curved surfaces the mean weighted by the load.

    Raises
    ------
    InputError
        If the theory does not cover the ellipse or the creepages.
    ConvergenceError
        If the rolling half-space did not converge.
    """
    if theory == "fastsim":
        return fastsim_strips(patch.pieces, creepages)
    if theory == "rolling_half_space":
        return _on_half_space(patch, creepages)
    if theory not in _LAWS:
        raise InputError(f"theory is {theory!r}; allowed: {', '.join(THEORIES)}")
    return _LAWS[theory](patch.ellipse, mean_creepages(patch.pieces, creepages)).at(*patch.centre_mm)


def _on_half_space(patch: CreepPatch, creepages: Motion) -> CreepForce:
    solution = steady_rolling(patch.cells, creepages, patch.ellipse)
    if solution.status != "converged":
        plane = creepages.at(0.0, 0.0)
        raise ConvergenceError(
            f"the rolling half-space did not converge at xi {plane.xi:g}, eta {plane.eta:g}, spin"
            f" {plane.spin_per_mm:g} 1/mm (residual {solution.friction.residual:.1e}); take FASTSIM there"
        )
    return solution.force


def creep_forces(patch: CreepPatch, creepages: Motion) -> Mapping[str, CreepForce | str]:
    """Forces of all theories, or the reason why a theory does not cover the contact or did not converge."""
    found: dict[str, CreepForce | str] = {}
    for theory in THEORIES:
        try:
            found[theory] = creep_force(theory, patch, creepages)
        except (InputError, ConvergenceError) as error:
            found[theory] = str(error)
    return found


def force_difference(one: CreepForce, other: CreepForce, limit_N: float) -> float:
    """Length of the difference of two tangential force vectors, over mu N."""
    return float(np.hypot(one.fx_N - other.fx_N, one.fy_N - other.fy_N)) / limit_N


# --- Creepages of a wheelset that runs along the track, at a touch point and over the curved surfaces.

_ROUNDING = 1e-12


def wheelset_creepages(placement: Placement, speed_ratio: float = 1.0) -> Creepages:
    """Creepages at the first touch point of a wheelset that runs along the track and turns about its axle.

    Parameters
    ----------
    speed_ratio
        Speed of rotation over the speed at which the tape circle rolls without slip.

    Notes
    -----
    From the velocity of the rigid wheel at the touch point, over the running speed: 1 along x, the rotation, and the
    velocity along z that keeps the wheel on the rail. For a wheelset without yaw and roll xi = 1 - speed_ratio r / r0
    and spin = -speed_ratio sin(contact angle) / r0, with the rolling radius r, and r0 at the tape circle.
    """
    wheel, touch = placement.wheel, placement.first
    turning = _turning(placement, speed_ratio)
    arm = np.array([touch.x_mm, touch.y_mm, touch.z_mm]) - wheel.centre_mm
    velocity = np.array([1.0, 0.0, 0.0]) + np.cross(turning, arm)
    velocity[2] -= float(velocity @ touch.normal) / touch.normal[2]
    xi, eta, spin = float(velocity[0]), float(velocity @ touch.tangent), float(turning @ touch.normal)
    # rounding errors are set to zero: some theories refuse any spin
    xi, eta = (0.0 if abs(one) < _ROUNDING else one for one in (xi, eta))
    return Creepages(xi=xi, eta=eta, spin_per_mm=0.0 if abs(spin) * wheel.rolling_radius_mm < _ROUNDING else spin)


def curved_creepages(placement: Placement, plane: Creepages, s_mm: Floats, speed_ratio: float = 1.0) -> CurvedCreepages:
    """Creepages over the curved surfaces: the contact angle, and with it the rolling radius, changes across the patch.

    Parameters
    ----------
    plane
        Creepages at the first touch point.
    s_mm (n,)
        Places across, uniform, on the rail's surface from the first touch point.

    Notes
    -----
    Under pressure, bodies of one material meet midway between their undeformed surfaces. On this surface, at x = 0, the
    velocity of the rigid wheel is taken. Range of validity: theories of the half-space leave out the change of the
    rolling radius by the approach, so that the longitudinal creepage has an error of half the undeformed gap over the
    radius, some 1e-4 at the edges of a patch. If surfaces are not conforming, creepages change by no more than this.
    """
    points, normals = placement.surface(0.0, s_mm)
    midway = points + 0.5 * placement.gap(0.0, s_mm)[:, None] * normals
    touch, turning = placement.first, _turning(placement, speed_ratio)
    arms = midway - np.array([touch.x_mm, touch.y_mm, touch.z_mm])
    xi = slip_beside_plane(arms, s_mm, turning, touch.normal)
    return CurvedCreepages(
        plane=plane, y_mm=s_mm, xi_beside=xi, spin_beside_per_mm=-np.gradient(xi, s_mm, edge_order=2)
    )


def slip_beside_plane(arms_mm: Floats, s_mm: Floats, turning_per_mm: Floats, normal: Floats) -> Floats:
    """Longitudinal creepage (n,) on a line across minus the tangent plane's; zero on a straight line, as of a cone.

    Parameters
    ----------
    arms_mm (n, 3), s_mm (n,)
        The line from the touch point, and its arc length.
    turning_per_mm (3,)
        Angular velocity of the wheel over the running speed.
    normal (3,)
        Normal at the touch point.
    """
    return np.asarray(np.cross(turning_per_mm, arms_mm)[:, 0] + float(turning_per_mm @ normal) * s_mm)


def _turning(placement: Placement, speed_ratio: float) -> Floats:
    """Angular velocity (3,) of the wheel over the running speed, 1/mm."""
    return np.asarray(speed_ratio / placement.wheel.rolling_radius_mm * placement.wheel.axes[:, 1])
