"""Roll of a wheelset with a vertical load on each wheel."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from fecontact.bodies import TrackSide
from fecontact.case import Case
from fecontact.contact_theories.touch_hertz import solve_hertz_points
from fecontact.errors import ConvergenceError, InputError
from fecontact.placement.wheel_on_rail import Placement
from fecontact.placement.wheelset import (
    TRACK_SIDES,
    PlacedWheelset,
    Wheelset,
    describe_possible_wheelset_shifts,
    place_wheelset,
)

# Without load both wheels touch. Under load each wheel approaches its rail, by more if the contact is more curved or
# more inclined. The rigid axle rolls until the heights of both sides agree again.

# First and largest range of the search for the roll; loads of running wheels change the roll by some hundredths of a
# mrad.
_FIRST_REACH_RAD, _LARGEST_REACH_RAD = 2e-5, 1e-2
_UP = np.array([0.0, 0.0, 1.0])
# Tolerance of the roll, which is a picometre in height: contact points on flat gaps move by a thousand times this.
_ROLL_RAD = 1e-15


def place_loaded_wheelset(wheelset: Wheelset, case: Case) -> PlacedWheelset:
    """Set the wheelset of a case on its rails with the roll under load.

    At this roll the axle heights of both loaded wheels agree:

    h_left(roll) - d_left(roll) = h_right(roll) - d_right(roll), with the height h of the axle's centre at which a wheel
    just touches its rail, and the vertical approach d at which Hertz's springs at all contact points carry the wheel's
    load.

    Range of validity: vertical loads, as in `Case.roll_loads_N`, without friction; the vehicle holds the wheelset
    laterally and against rolling over. Bodies and track below the contacts yield equally on both sides. Under unequal
    loads they do not: a rail that sinks 1 mm more rolls the wheelset by 0.67 mrad, in addition to this roll.

    Parameters
    ----------
    wheelset
        Both wheels over both rails.
    case
        Case with shift, yaw and loads.

    Returns
    -------
    PlacedWheelset
        Both wheels unloaded at this roll; the axle height is the height under load.

    Raises
    ------
    InputError
        As in `place_wheelset`, and if the surfaces conform at a contact point, so that there is no spring.
    ConvergenceError
        If there is no such roll near the roll of the unloaded wheelset.
    """
    shift_mm, yaw_rad = case.lateral_shift_mm, case.yaw_rad
    touching_roll_rad = place_wheelset(wheelset, shift_mm, yaw_rad).roll_rad

    def height_difference_mm(roll_rad: float) -> float:
        left, right = (_height_mm(wheelset, case, roll_rad, side) for side in TRACK_SIDES)
        return left - right

    # The difference decreases with the roll, as for unloaded wheels.
    start_mm, reach_rad = height_difference_mm(touching_roll_rad), _FIRST_REACH_RAD
    sign = 1.0 if start_mm > 0.0 else -1.0
    while start_mm * height_difference_mm(touching_roll_rad + sign * reach_rad) > 0.0:
        reach_rad *= 2.0
        if reach_rad > _LARGEST_REACH_RAD:
            loads = " and ".join(f"{load_N / 1e3:g} kN ({side})" for side, load_N in case.roll_loads_N().items())
            raise ConvergenceError(
                f"lateral shift {shift_mm:g} mm of the wheelset: no roll was found at which the wheels carry"
                f" {loads} with the axle at equal height; give a different kind of roll"
            )
    loaded_roll_rad = float(
        brentq(height_difference_mm, touching_roll_rad, touching_roll_rad + sign * reach_rad, xtol=_ROLL_RAD)
    )
    return PlacedWheelset(
        shift_mm=shift_mm,
        yaw_rad=yaw_rad,
        roll_rad=loaded_roll_rad,
        axle_height_mm=_height_mm(wheelset, case, loaded_roll_rad, "left"),
        left=_place_side(wheelset, case, loaded_roll_rad, "left"),
        right=_place_side(wheelset, case, loaded_roll_rad, "right"),
    )


def _height_mm(wheelset: Wheelset, case: Case, roll_rad: float, side: TrackSide) -> float:
    """Height of the axle's centre over the rail's highest point under load.

    The wheel of the given side is pressed into its rail.
    """
    placement = _place_side(wheelset, case, roll_rad, side)
    load_N = case.roll_loads_N()[side]
    points = solve_hertz_points(placement, load_N, direction=_UP, contact_modulus_MPa=case.contact_modulus_MPa)
    if points.shared_approach_mm is None:
        problem = next(point.problem for point in points.points if point.problem)
        raise InputError(f"{side} side of the wheelset: {problem}; give a different kind of roll")
    return float(placement.wheel.centre_mm[2]) - points.shared_approach_mm


def _place_side(wheelset: Wheelset, case: Case, roll_rad: float, side: TrackSide) -> Placement:
    placement = wheelset.placed(side, case.lateral_shift_mm, roll_rad, case.yaw_rad)
    if isinstance(placement, str):
        possible_shifts = describe_possible_wheelset_shifts(wheelset, case.yaw_rad)
        raise InputError(f"lateral shift {case.lateral_shift_mm:g} mm of the wheelset: {placement}; {possible_shifts}")
    return placement
