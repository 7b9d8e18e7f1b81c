"""The geometry of a wheelset on its rails over the lateral shift, as a record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from fecontact.case import Case, case_record
from fecontact.errors import InputError
from fecontact.geometry.contact_functions import ContactFunctions, contact_functions, rolling_radius_difference_mm
from fecontact.geometry.placement import Placement
from fecontact.geometry.wheelset import PlacedWheelset, possible_wheelset_shifts
from fecontact.profiles.curve import radius_mm
from fecontact.profiles.identity import profile_identity
from fecontact.solving.placing import wheelset_of_case

if TYPE_CHECKING:
    pass

Record = dict[str, Any]


GEOMETRY_SCHEMA = "fecontact/geometry/1"


_INPUTS = ("rail", "wheel", "inclination_rad", "yaw_rad", "rolling_radius_mm", "track", "opposite", "flange_climb")


# where something is said about them
_READINGS = ("rail_file", "wheel_file")


def functions_of_case(case: Case, shifts_mm: Sequence[float]) -> ContactFunctions:
    """The wheelset of a case at many shifts; the case's own shift, roll and side do not count.

    >>> import fecontact
    >>> found = fecontact.geometry(fecontact.Case(), [0.0, 5.0])
    >>> round(1e3 * found.positions[5.0].roll_rad, 2)
    0.34

    Raises
    ------
    InputError
        If the wheelset can stand at none of the shifts, naming those at which it can.
    """
    wheelset = wheelset_of_case(case)
    found = contact_functions(wheelset, shifts_mm, case.yaw_rad)
    if all(isinstance(placed, str) for placed in found.positions.values()):
        why = next(iter(found.positions.values()))
        raise InputError(
            f"the wheelset can stand at none of the shifts: {why}; {possible_wheelset_shifts(wheelset, case.yaw_rad)}"
        )
    return found


def functions_record(case: Case, found: ContactFunctions) -> Record:
    """The table with units in its keys; radii of straight lines are None, positive where convex."""
    shown = case_record(case.with_profiles({body: profile_identity(spec) for body, spec in case.profiles.items()}))
    return {
        "schema": GEOMETRY_SCHEMA,
        "case": {name: shown[name] for name in (*_INPUTS, *_READINGS) if name in shown},
        "symmetric": found.symmetric,
        "positions": [
            _position_record(shift, placed, found.centred_height_mm) for shift, placed in found.positions.items()
        ],
        "jumps": [asdict(jump) for jump in found.jumps],
        "equivalent_conicity": [asdict(conicity) for conicity in found.conicities],
        "warnings": _notes(found),
    }


def _notes(found: ContactFunctions) -> list[str]:
    placed = next(one for one in found.positions.values() if not isinstance(one, str))
    profiles = [side.profile for one in (placed.left, placed.right) for side in (one.rail, one.wheel)]
    return list(dict.fromkeys(note for profile in profiles for note in profile.notes))


def _position_record(shift: float, placed: PlacedWheelset | str, centred_mm: float) -> Record:
    if isinstance(placed, str):
        return {"lateral_shift_mm": shift, "problem": placed}
    return {
        "lateral_shift_mm": shift,
        "roll_mrad": 1e3 * placed.roll_rad,
        "axle_height_mm": placed.axle_height_mm,
        "lift_mm": placed.axle_height_mm - centred_mm,
        "rolling_radius_difference_mm": rolling_radius_difference_mm(placed),
        "left": _side_record(placed.left),
        "right": _side_record(placed.right),
    }


def _side_record(placement: Placement) -> Record:
    return {
        "touch_points": [
            {
                "rail_y_mm": touch.rail_y_mm,
                "wheel_y_mm": touch.wheel_y_mm,
                "ahead_mm": touch.x_mm - float(placement.wheel.point(touch.wheel_y_mm, 0.0, 0.0)[0]),
                "contact_angle_rad": touch.contact_angle_rad,
                "vertical_gap_mm": touch.vertical_gap_mm,
                "rolling_radius_mm": float(placement.wheel.radius(touch.wheel_u)),
                "at_junction": touch.at_junction,
                "rail_radius_mm": radius_mm(touch.curvature.rail_per_mm),
                "wheel_lateral_radius_mm": radius_mm(touch.curvature.wheel_lateral_per_mm),
                "wheel_rolling_radius_mm": radius_mm(touch.curvature.wheel_rolling_per_mm),
            }
            for touch in placement.touch_points
        ],
    }
