"""The geometry of a wheelset over its lateral shift on the terminal."""

from __future__ import annotations

from fecontact.outputs.tables.table import Record, Table, number, radius, table_of, text
from fecontact.outputs.terminal.console import Lines, notes

_COLUMNS = (
    number("shift\nmm", "lateral_shift_mm", "{:+z.2f}"),
    number("roll\nmrad", "roll_mrad", "{:+z.4f}"),
    number("lift\nmm", "lift_mm", "{:+z.3f}", rank=2, name="lift"),
    number("r left -\nright mm", "rolling_radius_difference_mm", "{:+z.3f}"),
    number("y rail\nmm", "rail_y_mm", "{:+z.2f}"),
    number("y wheel\nmm", "wheel_y_mm", "{:+z.2f}", rank=4, name="y wheel"),
    number("angle\nmrad", "contact_angle_rad", "{:+z.2f}", 1e3),
    number("radius\nmm", "rolling_radius_mm", "{:.3f}", rank=3, name="rolling radius"),
    radius("R rail\nmm", "rail_radius_mm"),
    radius("R wheel\nacross mm", "wheel_lateral_radius_mm", rank=5, name="radius of the wheel across"),
    radius("R wheel\nrolling mm", "wheel_rolling_radius_mm", rank=1, name="radius of the wheel along the rail"),
    text("touch\npoints", lambda row: f"{row['points']}{' junction' * row['at_junction']}", "number"),
)


def functions_lines(record: Record) -> Lines:
    """A geometry record: a table of the left side, and of the right one where it is not its mirror image."""
    mirrored = record["symmetric"] and record["case"]["yaw_rad"] == 0.0
    sides = ("left",) if mirrored else ("left", "right")
    for side in sides:
        yield _side_table(record, side)
    if mirrored:
        yield "The right wheel at a shift is the left one at the opposite shift."
    for jump in (jump for jump in record["jumps"] if jump["side"] in sides):
        yield (
            f"jump at {jump['shift_mm']:+z.3f} mm: the {jump['side']} rail is touched first at y ="
            f" {jump['from_rail_y_mm']:+z.2f} mm below it, at {jump['to_rail_y_mm']:+z.2f} mm above it"
        )
    if conicities := record["equivalent_conicity"]:
        yield (
            "equivalent conicity by amplitude, harmonic linearisation without roll (with it in brackets): "
            + ", ".join(f"{one['amplitude_mm']:g} mm {one['unrolled']:.3f} ({one['rolled']:.3f})" for one in conicities)
        )
    for row in record.get("loaded_conicity", ()):
        yield (
            f"loaded, {row['wheel_load_N'] / 1e3:g} kN a wheel, {row['amplitude_mm']:g} mm: conicity"
            f" {row['overlap']:.3f} by overlapping strips, {row['half_space']:.3f} by the half-space"
        )
    for row in record["positions"]:
        if "problem" in row:
            yield f"no position at {row['lateral_shift_mm']:+z.2f} mm: {row['problem']}"
    yield from notes(record["warnings"])


def _side_table(record: Record, side: str) -> Table:
    """A side of the wheelset at each shift, by its first touch point."""
    placed = [(row, row[side]["touch_points"]) for row in record["positions"] if "problem" not in row]
    title = f"The {side} wheel on its rail; lengths in mm, radii positive where convex"
    return table_of(title, _COLUMNS, [{**row, **points[0], "points": len(points)} for row, points in placed])
