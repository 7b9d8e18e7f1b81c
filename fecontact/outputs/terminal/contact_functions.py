"""The geometry of a wheelset over its lateral shift on the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fecontact.outputs.tables.table import Column, Table, TableRow
from fecontact.outputs.terminal.console import print_notes, print_table, say, standard_console
from fecontact.profiles.curve import radius_text

if TYPE_CHECKING:
    from rich.console import Console

_COLUMNS = (
    Column(heading="shift\nmm"),
    Column(heading="roll\nmrad"),
    Column(heading="lift\nmm", rank=2, name="lift"),
    Column(heading="r left -\nright mm"),
    Column(heading="y rail\nmm"),
    Column(heading="y wheel\nmm", rank=4, name="y wheel"),
    Column(heading="angle\nmrad"),
    Column(heading="radius\nmm", rank=3, name="rolling radius"),
    Column(heading="R rail\nmm"),
    Column(heading="R wheel\nacross mm", rank=5, name="radius of the wheel across"),
    Column(heading="R wheel\nrolling mm", rank=1, name="radius of the wheel along the rail"),
    Column(heading="touch\npoints"),
)


def print_functions(record: Mapping[str, Any], *, console: Console | None = None) -> None:
    """Print a geometry record: a table of the left side, and of the right one where it is not its mirror image."""
    console = console or standard_console()
    mirrored = record["symmetric"] and record["case"]["yaw_rad"] == 0.0
    sides = ("left",) if mirrored else ("left", "right")
    for side in sides:
        print_table(console, _side_table(record, side))
    if mirrored:
        say(console, "The right wheel at a shift is the left one at the opposite shift.")
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


def _side_table(record: Mapping[str, Any], side: str) -> Table:
    rows = [TableRow(cells=_cells(row, side)) for row in record["positions"] if "problem" not in row]
    title = f"The {side} wheel on its rail; lengths in mm, radii positive where convex"
    return Table(title=title, columns=_COLUMNS, rows=rows)


def _cells(row: Mapping[str, Any], side: str) -> tuple[str, ...]:
    points = row[side]["touch_points"]
    touch = points[0]
    return (
        f"{row['lateral_shift_mm']:+z.2f}",
        f"{row['roll_mrad']:+z.4f}",
        f"{row['lift_mm']:+z.3f}",
        f"{row['rolling_radius_difference_mm']:+z.3f}",
        f"{touch['rail_y_mm']:+z.2f}",
        f"{touch['wheel_y_mm']:+z.2f}",
        f"{1e3 * touch['contact_angle_rad']:+z.2f}",
        f"{touch['rolling_radius_mm']:.3f}",
        *(radius_text(touch[f"{name}_radius_mm"]) for name in ("rail", "wheel_lateral", "wheel_rolling")),
        str(len(points)) + (" junction" if touch["at_junction"] else ""),
    )


def _print_conicity(conicities: Sequence[Mapping[str, float]], console: Console) -> None:
    if not conicities:
        return
    parts = (f"{one['amplitude_mm']:g} mm {one['unrolled']:.3f} ({one['rolled']:.3f})" for one in conicities)
    say(
        console,
        "equivalent conicity by amplitude, harmonic linearisation without roll (with it in brackets): "
        + ", ".join(parts),
    )
