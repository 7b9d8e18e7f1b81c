"""The geometry of a wheelset on its rails over the lateral shift, as a record."""

from __future__ import annotations

from dataclasses import asdict

from fecontact.case import Case, case_record
from fecontact.geometry.contact_functions import ContactFunctions, rolling_radius_difference_mm
from fecontact.geometry.placement import Placement
from fecontact.geometry.wheelset import PlacedWheelset
from fecontact.outputs.records.results import profile_notes, touch_columns
from fecontact.outputs.records.told import Record, picked
from fecontact.profiles.identity import profile_identity

GEOMETRY_SCHEMA = "fecontact/geometry/1"
_INPUTS = ("rail", "wheel", "inclination_rad", "yaw_rad", "rolling_radius_mm", "track", "opposite", "flange_climb")
# where something is said about them
_READINGS = ("rail_file", "wheel_file")


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
    return list(dict.fromkeys((*profile_notes(placed.left), *profile_notes(placed.right))))


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


def functions_rows(record: Record) -> list[Record]:
    """Positions of a record as flat rows: touch points are numbered, those of the left wheel first."""
    rows = []
    for position in record["positions"]:
        row = {name: value for name, value in position.items() if name not in ("left", "right")}
        for side in ("left", "right"):
            for number, touch in enumerate(position.get(side, {}).get("touch_points", ()), start=1):
                row |= {f"{side}_touch{number}_{name}": value for name, value in touch.items()}
        rows.append(row)
    return rows


def _side_record(placement: Placement) -> Record:
    return {
        "touch_points": [
            {
                **picked(touch, "rail_y_mm wheel_y_mm"),
                "ahead_mm": touch.x_mm - float(placement.wheel.point(touch.wheel_y_mm, 0.0, 0.0)[0]),
                **touch_columns(placement, touch),
            }
            for touch in placement.touch_points
        ],
    }
