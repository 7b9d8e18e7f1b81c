"""Hertz's contact of a position on the terminal: contact points, and the ellipse of each."""

from __future__ import annotations

from fecontact.outputs.own_profiles import geometry_line
from fecontact.outputs.tables import (
    Item,
    Table,
    number,
    radius,
    table_of,
    text,
)
from fecontact.outputs.terminal import Lines, notes

_ELLIPSE = (
    number("point", lambda one: one["touch_point"] + 1, "{:.0f}"),
    text("side", "side"),
    number("F_n\nkN", "normal_force_N", "{:.3f}", 1e-3),
    number("p0\nMPa", "p_max_MPa", "{:.1f}"),
    number("a\nmm", "a_mm", "{:.3f}"),
    number("b\nmm", "b_mm", "{:.3f}"),
    number("turned\nmrad", "orientation_rad", "{:+z.1f}", 1e3),
    number("area\nmm²", "area_mm2", "{:.2f}"),
    number("approach\nmm", "approach_mm", "{:.5f}"),
)
_TOUCH = (
    number("point", "point", "{:.0f}", none=""),
    number("y rail\nmm", "rail_y_mm", "{:+z.3f}", none=""),
    number("y wheel\nmm", "wheel_y_mm", "{:+z.3f}", none=""),
    number("angle\nmrad", "contact_angle_rad", "{:+z.2f}", 1e3, none=""),
    number("gap\nmm", "vertical_gap_mm", "{:.4f}", none=""),
    text("side", "side"),
    radius("R rail\nmm", "rail_radius_mm"),
    radius("R wheel\nacross mm", "wheel_lateral_radius_mm"),
    radius("R wheel\nrolling mm", "wheel_rolling_radius_mm"),
)


def hertz_lines(record: Item) -> Lines:
    """A Hertz record: touch points and the ellipse of each, and of each side of a junction."""
    yield from geometry_line(record)
    yield touch_point_table(record)
    yield table_of("Hertz's ellipse, each with the whole load", _ELLIPSE, record["ellipses"])
    if len(record["springs"]["patches"]) > 1:
        yield _shared_text(record["springs"])
    for ellipse in record["ellipses"]:
        if "problem" in ellipse:
            yield f"point {ellipse['touch_point'] + 1}, {ellipse['side']} side: {ellipse['problem']}"
    yield from notes([*record["notes"], *record["warnings"]])


def _shared_text(shared: Item) -> str:
    parts = (
        f"point {e['touch_point'] + 1} {e['normal_force_N'] / 1e3:.1f} kN, p0 {e['p_max_MPa']:.0f} MPa"
        for e in shared["patches"]
    )
    overlap = "; but their ellipses overlap: they are one patch" if shared["overlapping"] else ""
    return f"As springs side by side they share the load: {'; '.join(parts)}{overlap}."


def touch_point_table(record: Item) -> Table:
    """Where the rigid bodies touch, and the radii there; of a junction the second side has a line without the place."""
    lines = [
        {**({} if second else {**touch, "point": place}), **curvature}
        for place, touch in enumerate(record["touch_points"], start=1)
        for second, curvature in enumerate(touch["curvatures"])
    ]
    return table_of("Touch points (radii positive where convex)", _TOUCH, lines)
