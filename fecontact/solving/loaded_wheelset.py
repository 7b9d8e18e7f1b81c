"""Roll of a wheelset whose wheels are pressed into their rails, each by a vertical load."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from fecontact.bodies import TrackSide
from fecontact.case import Case
from fecontact.contact_theories.touch_hertz import hertz_points
from fecontact.errors import ConvergenceError, InputError
from fecontact.placement.wheel_on_rail import Placement
from fecontact.placement.wheelset import (
    SIDES,
    PlacedWheelset,
    Wheelset,
    place_wheelset,
    possible_wheelset_shifts,
)

#
# Without load both wheels touch. Under load each wheel approaches its rail, by more if the contact is more curved or
# more inclined. The rigid axle rolls until the heights of both sides agree again.

# First and last range of the search for the roll; loads of running wheels change the roll by some hundredths of a mrad.
_FIRST_RAD, _MOST_RAD = 2e-5, 1e-2
_UP = np.array([0.0, 0.0, 1.0])
# Tolerance of the roll, a picometre in height: touch points on flat gaps move by a thousand times this.
_ROLL_RAD = 1e-15


def place_loaded_wheelset(wheelset: Wheelset, case: Case) -> PlacedWheelset:
    """Set the wheelset of a case on its rails with the roll at which the axle heights of both loaded wheels agree.

    h_left(roll) - d_left(roll) = h_right(roll) - d_right(roll), with the height h of the axle's centre at which a wheel
    just touches its rail, and the vertical approach d at which Hertz's springs at all touch points carry the wheel's
    load.

    Range of validity: vertical loads, as in `Case.roll_loads_N`, without friction; the vehicle holds the wheelset
    sideways and against rolling over. Bodies and track below the contacts yield equally on both sides. Under unequal
    loads they do not: a rail that sinks 1 mm more rolls the wheelset by 0.67 mrad, in addition to this roll.

    Returns
    -------
    PlacedWheelset
        Both wheels unloaded at this roll; the axle height is the height under load.

    Raises
    ------
    InputError
        As in `place_wheelset`, and if the surfaces conform at a touch point, so that there is no spring.
    ConvergenceError
        If there is no such roll near the roll of the unloaded wheelset.
    """
    shift, yaw = case.lateral_shift_mm, case.yaw_rad
    touching = place_wheelset(wheelset, shift, yaw).roll_rad

    def difference(roll_rad: float) -> float:
        left, right = (_height_mm(wheelset, case, roll_rad, side) for side in SIDES)
        return left - right

    # the difference falls with the roll, as it does for unloaded wheels
    start, reach = difference(touching), _FIRST_RAD
    sign = 1.0 if start > 0.0 else -1.0
    while start * difference(touching + sign * reach) > 0.0:
        reach *= 2.0
        if reach > _MOST_RAD:
            loads = " and ".join(f"{load_N / 1e3:g} kN ({side})" for side, load_N in case.roll_loads_N().items())
            raise ConvergenceError(
                f"lateral shift {shift:g} mm of the wheelset: no roll is found at which the wheels carry"
                f" {loads} at one height of the axle; take another roll"
            )
    roll = float(brentq(difference, touching, touching + sign * reach, xtol=_ROLL_RAD))
    return PlacedWheelset(
        shift_mm=shift,
        yaw_rad=yaw,
        roll_rad=roll,
        axle_height_mm=_height_mm(wheelset, case, roll, "left"),
        left=_placed(wheelset, case, roll, "left"),
        right=_placed(wheelset, case, roll, "right"),
    )


def _height_mm(wheelset: Wheelset, case: Case, roll_rad: float, side: TrackSide) -> float:
    """Height of the axle's centre over the rail's highest point, with the wheel of a side pressed into its rail."""
    placement = _placed(wheelset, case, roll_rad, side)
    load_N = case.roll_loads_N()[side]
    points = hertz_points(placement, load_N, direction=_UP, contact_modulus_MPa=case.contact_modulus_MPa)
    if points.shared_approach_mm is None:
        problem = next(point.problem for point in points.points if point.problem)
        raise InputError(f"{side} side of the wheelset: {problem}; take another roll")
    return float(placement.wheel.centre_mm[2]) - points.shared_approach_mm


def _placed(wheelset: Wheelset, case: Case, roll_rad: float, side: TrackSide) -> Placement:
    placed = wheelset.placed(side, case.lateral_shift_mm, roll_rad, case.yaw_rad)
    if isinstance(placed, str):
        can = possible_wheelset_shifts(wheelset, case.yaw_rad)
        raise InputError(f"lateral shift {case.lateral_shift_mm:g} mm of the wheelset: {placed}; {can}")
    return placed
