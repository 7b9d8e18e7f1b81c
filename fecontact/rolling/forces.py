"""Creep forces by every theory on any contact, and the creepages of a wheelset that runs along the track.

Theories that need an ellipse take on another patch that of its second moments (`rolling.fastsim`) with the
creepages of its centre; FASTSIM marches in strips over it; the rolling half-space takes the pressure as it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import RollingPair
from fecontact.errors import ConvergenceError, InputError
from fecontact.normal.hertz import HertzContact
from fecontact.rolling.fastsim import STRIPS, Strips, ellipse_strips, fastsim_strips, mean_creepages
from fecontact.rolling.laws import (
    Creepages,
    CreepForce,
    CurvedCreepages,
    Motion,
    RollingEllipse,
    friction_warnings,
    kalker_linear,
    polach,
    shen_hedrick_elkins,
    vermeulen_johnson,
)
from fecontact.rolling.steady import PressureCells, ellipse_cells, steady_rolling
from fecontact.wheel_rail.placement import Placement

_LAWS: dict[str, Callable[[RollingEllipse, Creepages], CreepForce]] = {
    "kalker": kalker_linear,
    "vermeulen_johnson": vermeulen_johnson,
    "she": shen_hedrick_elkins,
    "polach": polach,
}
THEORIES = (*_LAWS, "fastsim", "rolling_half_space")
"""Names of the theories, from the simplest to the exact one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CreepPatch:
    """A contact as creep theories take it.

    Attributes
    ----------
    ellipse, centre_mm
        Its ellipse, and where its centre lies from the first touch point, along x and across.
    pieces
        Its separate patches in strips.
    cells
        Its pressure on cells.
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
    """Hertz's contact; one whose axes are turned has the half-widths of its moments along x and across."""
    a, b = 0.5 * hertz.extent_x_mm, 0.5 * hertz.extent_y_mm
    scale = math.sqrt(hertz.a_mm * hertz.b_mm / (a * b))
    return ellipse_patch(RollingEllipse.of(pair, a_mm=scale * a, b_mm=scale * b, normal_force_N=hertz.normal_force_N))


def creep_force(theory: str, patch: CreepPatch, creepages: Motion) -> CreepForce:
    """Force of a theory at creepages of the first touch point, or over the curved surfaces; the moment about the point.

    The laws of an ellipse take the creepages of its centre, over curved surfaces their mean over the load.

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
    """Forces of all theories; in place of one that does not cover the contact, or did not converge, why."""
    found: dict[str, CreepForce | str] = {}
    for theory in THEORIES:
        try:
            found[theory] = creep_force(theory, patch, creepages)
        except (InputError, ConvergenceError) as error:
            found[theory] = str(error)
    return found


def force_difference(one: CreepForce, other: CreepForce, limit_N: float) -> float:
    """Size of the difference of two tangential forces, as vectors, over mu N."""
    return float(np.hypot(one.fx_N - other.fx_N, one.fy_N - other.fy_N)) / limit_N


# --- Creep forces on an ellipse that is given by numbers, without any placement.


@dataclass(frozen=True, kw_only=True)
class EllipseForces:
    """Creep forces on an ellipse: of each theory its force, or why there is none, and what makes them doubtful."""

    contact: RollingEllipse
    creepages: Creepages
    forces: Mapping[str, CreepForce | str]
    warnings: tuple[str, ...]


def forces_on_ellipse(contact: RollingEllipse, creepages: Creepages, theories: Sequence[str]) -> EllipseForces:
    """Creep forces by some theories, or by `all` that cover the ellipse.

    Raises
    ------
    InputError
        If a theory that was named does not cover the ellipse or the creepages.
    """
    patch = ellipse_patch(contact)
    forces: Mapping[str, CreepForce | str] = (
        creep_forces(patch, creepages)
        if list(theories) == ["all"]
        else {theory: creep_force(theory, patch, creepages) for theory in theories}
    )
    warnings = friction_warnings(contact.friction)
    return EllipseForces(contact=contact, creepages=creepages, forces=forces, warnings=warnings)


# --- Creepages of a wheelset that runs along the track, at a touch point and over the curved surfaces.

_ROUNDING = 1e-12


def wheelset_creepages(placement: Placement, speed_ratio: float = 1.0) -> Creepages:
    """Creepages at the first touch point of a wheelset that runs along the track and turns about its axle.

    Parameters
    ----------
    speed_ratio
        Speed of rotation over that which rolls the tape circle.

    Notes
    -----
    From the velocity of the rigid wheel there, over the running speed: 1 along x, the rotation, and as much along z as
    keeps it on the rail. For a wheelset without yaw and roll xi = 1 - speed_ratio r / r0 and
    spin = -speed_ratio sin(contact angle) / r0, with r the rolling radius at the touch point and r0 the tape circle's.
    """
    wheel, touch = placement.wheel, placement.first
    turning = _turning(placement, speed_ratio)
    arm = np.array([touch.x_mm, touch.y_mm, touch.z_mm]) - wheel.centre_mm
    velocity = np.array([1.0, 0.0, 0.0]) + np.cross(turning, arm)
    velocity[2] -= float(velocity @ touch.normal) / touch.normal[2]
    xi, eta, spin = float(velocity[0]), float(velocity @ touch.tangent), float(turning @ touch.normal)
    # what rounding leaves is no creepage: some theories know none of spin
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
    Under pressure bodies of one material meet midway between their undeformed surfaces. That surface is taken at x = 0:
    the velocity of the rigid wheel there. Range of validity: theories of the half-space leave out how the approach
    changes the rolling radius, so the longitudinal creepage is known to half the gap of the undeformed surfaces over
    the radius, some 1e-4 at the edges of a patch. Where they are not conforming the change itself is no larger.
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
    """Longitudinal creepage (n,) on a line across beside that of the tangent plane; zero of a cone, a straight line.

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
