"""Creepages of a wheelset that runs along the track, at a touch point and over the curved surfaces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fecontact.geometry.placement import Placement
from fecontact.theory.creep.contact import Creepages, CurvedCreepages

Floats = NDArray[np.float64]
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
