"""Hertz's contact of a position on the terminal: contact points and their ellipses."""

from __future__ import annotations

from fecontact.outputs.pair_geometry import pair_geometry_lines
from fecontact.outputs.tables import (
    Table,
    TableRecord,
    make_table,
    number_column,
    radius_column,
    text_column,
)
from fecontact.outputs.terminal import OutputLines, note_lines

_ELLIPSE_COLUMNS = (
    number_column("point", lambda ellipse: ellipse["contact_point_number"] + 1, "{:.0f}"),
    text_column("side", "side"),
    number_column("F_n\nkN", "normal_force_N", "{:.3f}", 1e-3),
    number_column("p0\nMPa", "p_max_MPa", "{:.1f}"),
    number_column("a\nmm", "a_mm", "{:.3f}"),
    number_column("b\nmm", "b_mm", "{:.3f}"),
    number_column("rotation\nmrad", "orientation_rad", "{:+z.1f}", 1e3),
    number_column("area\nmm²", "area_mm2", "{:.2f}"),
    number_column("approach\nmm", "approach_mm", "{:.5f}"),
    number_column("K_H\nGN/m^1.5", "stiffness_GN_per_m15", "{:.2f}", rank=1, name="K_H"),
)
_TOUCH_POINT_COLUMNS = (
    number_column("point", "point", "{:.0f}", none=""),
    number_column("y rail\nmm", "rail_y_mm", "{:+z.3f}", none=""),
    number_column("y wheel\nmm", "wheel_y_mm", "{:+z.3f}", none=""),
    number_column("angle\nmrad", "contact_angle_rad", "{:+z.2f}", 1e3, none=""),
    number_column("gap\nmm", "vertical_gap_mm", "{:.4f}", none=""),
    text_column("side", "side"),
    radius_column("R rail\nmm", "rail_radius_mm"),
    radius_column("R wheel\nacross mm", "wheel_lateral_radius_mm"),
    radius_column("R wheel\nrolling mm", "wheel_rolling_radius_mm"),
)


def hertz_lines(record: TableRecord) -> OutputLines:
    """Iterate over the outputs of a Hertz record: contact points, ellipses and notes.

    At a junction there is an ellipse for each side.

    Parameters
    ----------
    record
        Record of Hertz's theory alone.

    Returns
    -------
    iterator of Table and str
        Tables and lines in order.
    """
    yield from pair_geometry_lines(record)
    yield contact_point_table(record)
    yield make_table(
        "Hertz's ellipse at each contact point, under the whole load", _ELLIPSE_COLUMNS, record["ellipses"]
    )
    if len(record["springs"]["patches"]) > 1:
        yield _shared_load_text(record["springs"])
    for ellipse in record["ellipses"]:
        if "problem" in ellipse:
            yield f"point {ellipse['contact_point_number'] + 1}, {ellipse['side']} side: {ellipse['problem']}"
    yield from note_lines([*record["notes"], *record["warnings"]])


def _shared_load_text(springs: TableRecord) -> str:
    patch_texts = (
        f"point {patch['contact_point_number'] + 1} {patch['normal_force_N'] / 1e3:.1f} kN,"
        f" p0 {patch['p_max_MPa']:.0f} MPa"
        for patch in springs["patches"]
    )
    overlap = "; the ellipses overlap, so that they are a single patch" if springs["overlapping"] else ""
    return f"Load shared by parallel springs: {'; '.join(patch_texts)}{overlap}."


def contact_point_table(record: TableRecord) -> Table:
    """Table of the contact points of the rigid bodies, with the radii there.

    At a junction the second side has a separate line without the place.

    Parameters
    ----------
    record
        Record with `contact_points`.

    Returns
    -------
    Table
        Lengths in mm, angles in mrad; radii are positive if convex.
    """
    rows = [
        {**({} if is_field_side else {**touch, "point": place}), **curvature}
        for place, touch in enumerate(record["contact_points"], start=1)
        for is_field_side, curvature in enumerate(touch["curvatures"])
    ]
    return make_table("Contact points (convex radii are positive)", _TOUCH_POINT_COLUMNS, rows)
