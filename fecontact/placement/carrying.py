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
from fecontact.profiles.curve import Profile

# Slope above which the field side is a chamfer: treads rise by 0.07, chamfers by 0.8.
_CHAMFER_RAD = 0.35
# Steepest angle of a profile below which the profile has no flange. Worn treads are less steep.
_MIN_FLANGE_ANGLE_RAD = 0.25 * np.pi
# The flank is the part of a flange with angles within this difference from the steepest angle: a straight flank through
# measured points varies by this difference. On the arc of an S1002 beyond the flank (R 20) this angle is 0.08 mm long.
_FLANK_ANGLE_RANGE_RAD = 4e-3


def find_support_problem(wheel: Profile, touch: ContactPoint, *, climbs: bool, flange_climb: bool) -> str:
    """Reason why a wheel cannot run on a contact point; empty if it can.

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
    reason
        Text of a message, or an empty text.
    """
    y_mm = touch.wheel_y_mm
    if any(abs(y_mm - j.y_mm) < 1e-6 and j.is_corner for j in wheel.junctions):
        return f"the wheel leaves the rail: the contact point is on the corner of its tread, at y = {y_mm:.2f} mm"
    # A wheel on the chamfer beyond the tread's corner slides down between the rails.
    is_beyond_corner = any(0.0 < j.y_mm < y_mm and j.is_corner for j in wheel.junctions)
    if is_beyond_corner and touch.contact_angle_rad > _CHAMFER_RAD:
        return f"the wheel leaves the rail: the contact point is on its chamfer, at y = {y_mm:.2f} mm"
    if not climbs:
        return ""
    where = f"the wheel derails: the contact point is at y = {y_mm:.2f} mm, beyond the"
    if y_mm <= _locate_flange(wheel)[0]:
        return f"{where} top of its flange"
    return "" if flange_climb else f"{where} steepest place of its flange (--flange-climb allows this)"


def find_doubt(profile: Profile, y_mm: float) -> str:
    """Reason why a contact point is on a doubtful part of a profile; empty if it is not.

    Parameters
    ----------
    profile
        Rail or wheel.
    y_mm
        Position of the contact point across the profile in mm.

    Returns
    -------
    reason
        Text of a message, or an empty text.
    """
    if profile.doubtful_y_mm is None or not profile.doubtful_y_mm[0] <= y_mm <= profile.doubtful_y_mm[1]:
        return ""
    low, high = profile.doubtful_y_mm
    return (
        f"the contact point is at y = {y_mm:.2f} mm of the {profile.kind}, but the shape of {profile.name} from"
        f" {low:.1f} to {high:.1f} mm is doubtful (fecontact profiles {profile.name}); give a profile that is certain"
        " there"
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
