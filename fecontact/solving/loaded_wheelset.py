"""The roll of a wheelset whose wheels are pressed into their rails, each by its own vertical load.

Without a load both wheels touch. Under it each approaches its rail, by more where the contact is more curved or more
inclined, and the rigid axle rolls until both sides have one height again.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from fecontact.case import Case
from fecontact.dimensions import TrackSide
from fecontact.errors import ConvergenceError, InputError
from fecontact.geometry.placement import Placement
from fecontact.geometry.wheelset import SIDES, PlacedWheelset, Wheelset, place_wheelset, possible_wheelset_shifts
from fecontact.theory.touch_hertz import hertz_points

# Loads of running wheels move the roll by some hundredths of a mrad; twice as much is looked at, and so on up to this.
_FIRST_RAD, _MOST_RAD = 2e-5, 1e-2
_UP = np.array([0.0, 0.0, 1.0])
# A picometre in height: touch points on flat gaps move by a thousand times that.
_ROLL_RAD = 1e-15


def place_loaded_wheelset(wheelset: Wheelset, case: Case) -> PlacedWheelset:
    """Set the wheelset of a case on its rails with the roll at which both wheels, loaded, have one height of the axle.

    h_left(roll) - d_left(roll) = h_right(roll) - d_right(roll), with the heights h of the axle's centre at which each
    wheel just touches its rail, and the vertical approaches d of Hertz's springs at all its touch points, which carry
    its wheel's load together.

    Range of validity: loads are vertical, as `Case.roll_loads_N` has them, without friction; what holds the wheelset
    sideways and keeps it from rolling over is the vehicle's matter. What the bodies and the track give way farther
    below is taken to be the same on both sides. Under unequal loads it is not: a rail that sinks 1 mm more rolls the
    wheelset by 0.67 mrad, which is a matter of the track and comes on top.

    Returns
    -------
    PlacedWheelset
        Both wheels as they touch, unloaded, at that roll; its axle has the height under the load.

    Raises
    ------
    InputError
        As `place_wheelset` does, and where the surfaces conform at a touch point: there is no spring then.
    ConvergenceError
        If there is no such roll near that of the unloaded wheelset.
    """
    shift, yaw = case.lateral_shift_mm, case.yaw_rad
    touching = place_wheelset(wheelset, shift, yaw).roll_rad

    def difference(roll_rad: float) -> float:
        left, right = (_height_mm(wheelset, case, roll_rad, side) for side in SIDES)
        return left - right

    # it falls with the roll, as the heights of touching wheels do
    start, reach = difference(touching), _FIRST_RAD
    sign = 1.0 if start > 0.0 else -1.0
    while start * difference(touching + sign * reach) > 0.0:
        reach *= 2.0
        if reach > _MOST_RAD:
            raise ConvergenceError(
                f"lateral shift {shift:g} mm of the wheelset: no roll is found at which the wheels carry"
                f" {_loads_text(case)} at one height of the axle; take another roll"
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
    """Height of the axle's centre over the rail's highest point, the wheel of one side pressed into its rail."""
    placement = _placed(wheelset, case, roll_rad, side)
    load_N = case.roll_loads_N()[side]
    points = hertz_points(placement, load_N, direction=_UP, contact_modulus_MPa=case.contact_modulus_MPa)
    if points.shared_approach_mm is None:
        problem = next(point.problem for point in points.points if point.problem)
        raise InputError(f"{side} side of the wheelset: {problem}; take another roll")
    return float(placement.wheel.centre_mm[2]) - points.shared_approach_mm


def _loads_text(case: Case) -> str:
    return " and ".join(f"{load_N / 1e3:g} kN ({side})" for side, load_N in case.roll_loads_N().items())


def _placed(wheelset: Wheelset, case: Case, roll_rad: float, side: TrackSide) -> Placement:
    placed = wheelset.placed(side, case.lateral_shift_mm, roll_rad, case.yaw_rad)
    if isinstance(placed, str):
        can = possible_wheelset_shifts(wheelset, case.yaw_rad)
        raise InputError(f"lateral shift {case.lateral_shift_mm:g} mm of the wheelset: {placed}; {can}")
    return placed
