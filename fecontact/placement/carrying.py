"""Places of a wheel profile that can carry the wheel: its tread and its flange.

The flange can carry it up to its steepest place.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from fecontact.placement.poses import (
    ContactPoint,
    sample_profile,
)
from fecontact.placement.problems import PositionProblem
from fecontact.profiles.curve import Profile

# Slope above which the field side is a chamfer: treads rise by 0.07, chamfers by 0.8.
_CHAMFER_RAD = 0.35
# Steepest angle of a profile below which the profile has no flange. Worn treads are less steep.
_MIN_FLANGE_ANGLE_RAD = 0.25 * np.pi
# The flank is the part of a flange with angles within this difference from the steepest angle: a straight flank through
# measured points varies by this difference. On the arc of an S1002 beyond the flank (R 20) this angle is 0.08 mm long.
_FLANK_ANGLE_RANGE_RAD = 4e-3


_NOT_A_CONTACT = "leave out shifts at which the wheel cannot stand on the rail; if they are usual, check the gauge"


def find_support_problem(
    wheel: Profile, touch: ContactPoint, *, climbs: bool, flange_climb: bool
) -> PositionProblem | None:
    """Reason why a wheel cannot run on a contact point; None if it can.

    Parameters
    ----------
    wheel
        Wheel profile.
    touch
        Contact point of the wheel.
    climbs
        Whether the contact point lies beyond the steepest place of the flange.
    flange_climb
        Whether a wheel may climb.

    Returns
    -------
    PositionProblem or None
        Text of a message with its kind.
    """
    y_mm = touch.wheel_y_mm
    place = f"at y = {y_mm:.2f} mm"
    if any(abs(y_mm - j.y_mm) < 1e-6 and j.is_corner for j in wheel.junctions):
        corner = "the wheel leaves the rail: the contact point is on the corner of its tread"
        return PositionProblem(f"{corner}, {place}", corner, remedy=_NOT_A_CONTACT, is_derailed=True)
    # A wheel on the chamfer beyond the tread's corner slides down between the rails.
    is_beyond_corner = any(0.0 < j.y_mm < y_mm and j.is_corner for j in wheel.junctions)
    if is_beyond_corner and touch.contact_angle_rad > _CHAMFER_RAD:
        chamfer = "the wheel leaves the rail: the contact point is on its chamfer"
        return PositionProblem(f"{chamfer}, {place}", chamfer, remedy=_NOT_A_CONTACT, is_derailed=True)
    if not climbs:
        return None
    is_over_top = y_mm <= _locate_flange(wheel)[0]
    if flange_climb and not is_over_top:
        return None
    limit = "beyond the top of its flange" if is_over_top else "beyond the steepest place of its flange"
    return PositionProblem(
        f"the wheel derails: the contact point is {place}, {limit}"
        f"{'' if is_over_top else ' (--flange-climb allows this)'}",
        f"the wheel derails: the contact point is {limit}",
        remedy=_NOT_A_CONTACT if is_over_top else f"{_NOT_A_CONTACT}; flange_climb = true allows this",
        is_derailed=True,
    )


def find_doubt(profile: Profile, y_mm: float) -> PositionProblem | None:
    """Reason why a contact point is on a doubtful part of a profile.

    Parameters
    ----------
    profile
        Rail or wheel.
    y_mm
        Position of the contact point across the profile in mm.

    Returns
    -------
    PositionProblem or None
        None if the contact point is on a certain part.
    """
    if profile.doubtful_y_mm is None or not profile.doubtful_y_mm[0] <= y_mm <= profile.doubtful_y_mm[1]:
        return None
    (low, high), remedy = profile.doubtful_y_mm, "give a profile that is certain there"
    return PositionProblem(
        f"the contact point is at y = {y_mm:.2f} mm of the {profile.kind}, but the shape of {profile.name} from"
        f" {low:.1f} to {high:.1f} mm is doubtful (fecontact profiles {profile.name}); {remedy}",
        f"the contact point is on a doubtful part of the {profile.kind}",
        remedy=remedy,
    )


def is_beyond_flank(wheel: Profile, y_mm: float) -> bool:
    """Whether a position across a wheel profile lies beyond the steepest place of the flange.

    Parameters
    ----------
    wheel
        Wheel profile.
    y_mm
        Position across the profile in mm.

    Returns
    -------
    bool
        Whether the position is beyond the flank.
    """
    return y_mm < _locate_flange(wheel)[1]


def is_on_flange_top(wheel: Profile, y_mm: float) -> bool:
    """Whether a position across a wheel profile lies at or beyond the flange's top.

    Parameters
    ----------
    wheel
        Wheel profile.
    y_mm
        Position across the profile in mm.

    Returns
    -------
    bool
        Whether the position is on the flange's top.
    """
    top, steepest = _locate_flange(wheel)
    return y_mm < steepest and y_mm <= top


@lru_cache(maxsize=64)
def _locate_flange(wheel: Profile) -> tuple[float, float]:
    """Positions across a wheel profile of the flange's top and of its steepest place.

    A wheel without a flange cannot climb: its steepest place is at minus infinity.
    """
    p = sample_profile(wheel)[1].select(slice(1, -1))
    # Angles, not slopes: a flange may be upright.
    angles = np.where(p.y < 0.0, np.arctan2(p.dz, p.dy), 0.0)
    steepest, top = float(np.max(angles)), float(p.y[np.argmin(p.z)])
    return top, float(
        np.min(p.y[angles > steepest - _FLANK_ANGLE_RANGE_RAD])
    ) if steepest > _MIN_FLANGE_ANGLE_RAD else -math.inf
