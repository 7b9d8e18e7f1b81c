"""Creepages of a case: those that were given, and from the motion of the wheelset those that were not."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.case import Case
from fecontact.geometry.placement import Placement
from fecontact.theory.creep.contact import Creepages

Floats = NDArray[np.float64]
_ROUNDING = 1e-12


def creepages_of(case: Case, placement: Placement) -> Creepages:
    """Creepages of the wheel against the rail at the first touch point, in the contact frame."""
    given, motion = case.creep, wheelset_creepages(placement, case.creep.speed_ratio)
    return Creepages(
        xi=motion.xi if given.xi is None else given.xi,
        eta=motion.eta if given.eta is None else given.eta,
        spin_per_mm=motion.spin_per_mm if given.spin_per_mm is None else given.spin_per_mm,
    )


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
    turning = speed_ratio / wheel.rolling_radius_mm * wheel.axes[:, 1]
    arm = np.array([touch.x_mm, touch.y_mm, touch.z_mm]) - wheel.centre_mm
    velocity = np.array([1.0, 0.0, 0.0]) + np.cross(turning, arm)
    velocity[2] -= float(velocity @ touch.normal) / touch.normal[2]
    xi, eta, spin = float(velocity[0]), float(velocity @ touch.tangent), float(turning @ touch.normal)
    # what rounding leaves is no creepage: some theories know none of spin
    xi, eta = (0.0 if abs(one) < _ROUNDING else one for one in (xi, eta))
    return Creepages(xi=xi, eta=eta, spin_per_mm=0.0 if abs(spin) * wheel.rolling_radius_mm < _ROUNDING else spin)


def surface_creepage(placement: Placement, s_mm: ArrayLike, speed_ratio: float = 1.0) -> Floats:
    """Longitudinal creepage on the rail's surface at s (mm) from the first touch, beside that of the plane there.

    In the tangent plane spin makes it grow with the distance; on the curved head the contact angle, and so the rolling
    radius, change otherwise. The forces here, as those of vehicle codes and of planar contact theories, leave it out.
    """
    wheel, touch = placement.wheel, placement.first
    turning = speed_ratio / wheel.rolling_radius_mm * wheel.axes[:, 1]
    s = np.asarray(s_mm, dtype=np.float64)
    arms = [placement.surface(0.0, at)[0] - wheel.centre_mm for at in (s, np.zeros_like(s))]
    there, here = (np.cross(turning, arm)[..., 0] for arm in arms)
    return np.asarray(there - here + float(turning @ touch.normal) * s)
