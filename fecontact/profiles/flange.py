"""Dimensions of the flange of a wheel: height Sh, thickness Sd and qR (EN 15313)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from fecontact.arrays import Floats
from fecontact.profiles.curve import Profile

# Distance of the back of the flange from the tape circle (EN 13715).
_BACK_TO_TAPE_CIRCLE_MM = 70.0
# Level of the thickness below the tape circle, and level of the upper point of qR above the tip of the flange.
_THICKNESS_LEVEL_MM, _TIP_LEVEL_MM = 10.0, 2.0
# Points along the profile between which the levels are searched for. Flanges of wheels have radii of at least 10 mm.
_STEP_MM = 0.05


@dataclass(frozen=True, kw_only=True)
class FlangeDimensions:
    """Dimensions of a flange in mm.

    Attributes
    ----------
    height_mm
        Height Sh of the tip of the flange from the profile at the tape circle.
    thickness_mm
        Thickness Sd, 10 mm from the level of the tape circle towards the tip. The back of the flange is taken at 70 mm
        from the tape circle.
    qr_mm
        Horizontal distance qR between the flank at the level of the thickness and the flank 2 mm below the tip.
    """

    height_mm: float
    thickness_mm: float
    qr_mm: float


def measure_flange(wheel: Profile) -> FlangeDimensions | None:
    """Measure the flange of a wheel profile.

    Parameters
    ----------
    wheel
        Wheel profile with its tape circle at y = 0; smoothed if it was measured.

    Returns
    -------
    FlangeDimensions or None
        Dimensions in mm; None for a rail, for a profile without a tape circle or without the tip of a flange, and for a
        flange of less than 12 mm, which has no flank between both levels.

    Examples
    --------
    >>> from fecontact.profiles.flange import measure_flange
    >>> from fecontact.profiles.library import load_library_profile
    >>> flange = measure_flange(load_library_profile("S1002"))
    >>> round(flange.height_mm, 2), round(flange.thickness_mm, 2), round(flange.qr_mm, 2)
    (28.0, 32.5, 10.79)
    """
    low_y, high_y = wheel.y_range_mm
    if wheel.kind != "wheel" or not low_y < 0.0 < high_y:
        return None
    level = float(wheel.height(0.0))
    u = wheel.spread(_STEP_MM)
    points = wheel.evaluate(u)
    tip = int(np.argmin(points.z))
    # At the end of a profile the flange may continue.
    if not 0 < tip < u.size - 1 or points.y[tip] > 0.0:
        return None
    search = minimize_scalar(
        lambda v: float(wheel.evaluate(v).z), bounds=(u[tip - 1], u[tip + 1]), method="bounded", options={"xatol": 1e-9}
    )
    height = level - float(search.fun)
    if height < _THICKNESS_LEVEL_MM + _TIP_LEVEL_MM:
        return None
    flank = u[tip:]
    flank = flank[wheel.evaluate(flank).y <= 0.0]
    thickness_y = _find_y_at_height(wheel, flank, level - _THICKNESS_LEVEL_MM)
    tip_y = _find_y_at_height(wheel, flank, level - height + _TIP_LEVEL_MM)
    return FlangeDimensions(
        height_mm=height, thickness_mm=thickness_y + _BACK_TO_TAPE_CIRCLE_MM, qr_mm=thickness_y - tip_y
    )


def _find_y_at_height(wheel: Profile, flank: Floats, z_mm: float) -> float:
    """Position across of the flank at a height.

    Parameters
    ----------
    wheel
        Wheel profile.
    flank : ndarray of shape (n,)
        Parameters of the profile from the tip to the tape circle.
    z_mm
        Height between the tip and the tape circle.
    """
    upper = int(np.argmax(wheel.evaluate(flank).z >= z_mm))
    u = brentq(lambda v: float(wheel.evaluate(v).z) - z_mm, flank[upper - 1], flank[upper], xtol=1e-12)
    return float(wheel.evaluate(u).y)
