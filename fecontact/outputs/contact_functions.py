"""The geometry of a wheelset on its rails over the lateral shift: as a record, and as tables on the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from fecontact.case import Case, case_record
from fecontact.errors import InputError
from fecontact.geometry.contact_functions import ContactFunctions, contact_functions, rolling_radius_difference_mm
from fecontact.geometry.placement import Placement
from fecontact.geometry.wheelset import PlacedWheelset, possible_wheelset_shifts
from fecontact.outputs.terminal import print_fitting, print_notes, say, standard_console, titled_table
from fecontact.profiles.identity import profile_identity
from fecontact.solving.placing import wheelset_of_case

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

Record = dict[str, Any]

GEOMETRY_SCHEMA = "fecontact/geometry/1"
_INPUTS = ("rail", "wheel", "inclination_rad", "yaw_rad", "rolling_radius_mm", "track", "opposite", "flange_climb")
# where something is said about them
_READINGS = ("rail_file", "wheel_file")
# Straight lines come out of sums of large numbers with a curvature of rounding size.
_STRAIGHT_PER_MM = 1e-9


def functions_of_case(case: Case, shifts_mm: Sequence[float]) -> ContactFunctions:
    """The wheelset of a case at many shifts; the case's own shift, roll and side do not count.

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
                "rail_radius_mm": _radius_mm(touch.curvature.rail_per_mm),
                "wheel_lateral_radius_mm": _radius_mm(touch.curvature.wheel_lateral_per_mm),
                "wheel_rolling_radius_mm": _radius_mm(touch.curvature.wheel_rolling_per_mm),
            }
            for touch in placement.touch_points
        ],
    }


def _radius_mm(curvature_per_mm: float) -> float | None:
    return 1.0 / curvature_per_mm if abs(curvature_per_mm) > _STRAIGHT_PER_MM else None


_HEADINGS = (
    *("shift\nmm", "roll\nmrad", "lift\nmm", "r left -\nright mm", "y rail\nmm", "y wheel\nmm", "angle\nmrad"),
    *("radius\nmm", "R rail\nmm", "R wheel\nacross mm", "R wheel\nrolling mm", "touch\npoints"),
)
# Left out in turn where there is no room, and what they are called then; the file or pipe has them all.
_WITHOUT = {
    "R wheel\nrolling mm": "radius of the wheel along the rail",
    "lift\nmm": "lift",
    "radius\nmm": "rolling radius",
    "y wheel\nmm": "y wheel",
    "R wheel\nacross mm": "radius of the wheel across",
}


def print_functions(record: Mapping[str, Any], *, console: Console | None = None) -> None:
    """Print a geometry record: a table of the left side, and of the right one where it is not its mirror image."""
    console = console or standard_console()
    mirrored = record["symmetric"] and record["case"]["yaw_rad"] == 0.0
    for side in ("left",) if mirrored else ("left", "right"):
        _print_side(record, side, console)
    if mirrored:
        say(console, "The right wheel at a shift is the left one at the opposite shift.")
    sides = ("left",) if mirrored else ("left", "right")
    for jump in (jump for jump in record["jumps"] if jump["side"] in sides):
        say(
            console,
            f"jump at {jump['shift_mm']:+z.3f} mm: the {jump['side']} rail is touched first at y ="
            f" {jump['from_rail_y_mm']:+z.2f} mm below it, at {jump['to_rail_y_mm']:+z.2f} mm above it",
        )
    _print_conicity(record["equivalent_conicity"], console)
    for row in record.get("loaded_conicity", ()):
        say(
            console,
            f"loaded, {row['wheel_load_N'] / 1e3:g} kN a wheel, {row['amplitude_mm']:g} mm: conicity"
            f" {row['overlap']:.3f} by overlapping strips, {row['half_space']:.3f} by the half-space",
        )
    problems = [row for row in record["positions"] if "problem" in row]
    for row in problems:
        say(console, f"no position at {row['lateral_shift_mm']:+z.2f} mm: {row['problem']}")
    print_notes(record["warnings"], console)


def _print_side(record: Mapping[str, Any], side: str, console: Console) -> None:
    title = f"The {side} wheel on its rail; lengths in mm, radii positive where convex"
    lines = [_line(row, side) for row in record["positions"] if "problem" not in row]

    def tables() -> Iterator[tuple[Table, list[str]]]:
        for count in range(len(_WITHOUT) + 1):
            left_out = list(_WITHOUT)[:count]
            headings = [heading for heading in _HEADINGS if heading not in left_out]
            table = titled_table(console, title=title)
            for heading in headings:
                table.add_column(heading, justify="right", no_wrap=True)
            for line in lines:
                table.add_row(*(line[heading] for heading in headings))
            yield table, [_WITHOUT[heading] for heading in left_out]

    print_fitting(console, tables())


def _line(row: Mapping[str, Any], side: str) -> dict[str, str]:
    """A line of the table by its headings."""
    points = row[side]["touch_points"]
    touch = points[0]
    radii = (touch[f"{name}_radius_mm"] for name in ("rail", "wheel_lateral", "wheel_rolling"))
    cells = (
        f"{row['lateral_shift_mm']:+z.2f}",
        f"{row['roll_mrad']:+z.4f}",
        f"{row['lift_mm']:+z.3f}",
        f"{row['rolling_radius_difference_mm']:+z.3f}",
        f"{touch['rail_y_mm']:+z.2f}",
        f"{touch['wheel_y_mm']:+z.2f}",
        f"{1e3 * touch['contact_angle_rad']:+z.2f}",
        f"{touch['rolling_radius_mm']:.3f}",
        *("straight" if radius is None else f"{radius:.1f}" for radius in radii),
        str(len(points)) + (" junction" if touch["at_junction"] else ""),
    )
    return dict(zip(_HEADINGS, cells, strict=True))


def _print_conicity(conicities: Sequence[Mapping[str, float]], console: Console) -> None:
    if not conicities:
        return
    parts = (f"{one['amplitude_mm']:g} mm {one['unrolled']:.3f} ({one['rolled']:.3f})" for one in conicities)
    say(
        console,
        "equivalent conicity by amplitude, harmonic linearisation without roll (with it in brackets): "
        + ", ".join(parts),
    )
