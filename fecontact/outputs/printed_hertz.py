"""What Hertz says of a position on the terminal: touch points, and the ellipse of each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fecontact.outputs.terminal import print_notes, say, standard_console, titled_table
from fecontact.profiles.curve import radius_text

if TYPE_CHECKING:
    from rich.console import Console

Record = Mapping[str, Any]


def print_hertz(record: Record, *, console: Console | None = None) -> None:
    """Print a Hertz record: touch points and the ellipse of each, and of each side of a junction."""
    console = console or standard_console()
    print_touch_points(record, console)
    table = titled_table(console, title="Hertz's ellipse, each with the whole load")
    for heading in (
        "point",
        "side",
        "F_n\nkN",
        "p0\nMPa",
        "a\nmm",
        "b\nmm",
        "turned\nmrad",
        "area\nmm²",
        "approach\nmm",
    ):
        table.add_column(heading, justify="left" if heading == "side" else "right")
    keys = ("p_max_MPa", "a_mm", "b_mm", "orientation_rad", "area_mm2", "approach_mm")
    forms = ("{:.1f}", "{:.3f}", "{:.3f}", "{:+z.1f}", "{:.2f}", "{:.5f}")
    for ellipse in record["ellipses"]:
        point = str(ellipse["touch_point"] + 1)
        if "problem" in ellipse:
            table.add_row(point, ellipse["side"], *["-"] * (len(keys) + 1))
            continue
        values = [1e3 * ellipse[key] if key == "orientation_rad" else ellipse[key] for key in keys]
        cells = (form.format(value) for form, value in zip(forms, values, strict=True))
        table.add_row(point, ellipse["side"], f"{ellipse['normal_force_N'] / 1e3:.3f}", *cells)
    console.print(table)
    _print_shared(record["shared"], console)
    for ellipse in record["ellipses"]:
        if "problem" in ellipse:
            say(console, f"point {ellipse['touch_point'] + 1}, {ellipse['side']} side: {ellipse['problem']}")
    print_notes(record["warnings"], console)


def _print_shared(shared: Record, console: Console) -> None:
    if len(shared["ellipses"]) < 2:
        return
    parts = (
        f"point {e['touch_point'] + 1} {e['normal_force_N'] / 1e3:.1f} kN, p0 {e['p_max_MPa']:.0f} MPa"
        for e in shared["ellipses"]
    )
    overlap = "; but their ellipses overlap: they are one patch" if shared["overlapping"] else ""
    say(console, f"As springs side by side they share the load: {'; '.join(parts)}{overlap}.")


def print_touch_points(record: Record, console: Console) -> None:
    """Print where the rigid bodies touch, and the radii there."""
    table = titled_table(console, title="Touch points (radii positive where convex)")
    headings: tuple[str, ...] = ("point", "y rail\nmm", "y wheel\nmm", "angle\nmrad", "gap\nmm", "side")
    headings += ("R rail\nmm", "R wheel\nacross mm", "R wheel\nrolling mm")
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "side" else "right")
    for number, touch in enumerate(record["touch_points"], start=1):
        position: tuple[str, ...] = (
            str(number),
            f"{touch['rail_y_mm']:+z.3f}",
            f"{touch['wheel_y_mm']:+z.3f}",
            f"{1e3 * touch['contact_angle_rad']:+z.2f}",
            f"{touch['vertical_gap_mm']:.4f}",
        )
        for curvature in touch["curvatures"]:
            radii = (curvature[f"{name}_radius_mm"] for name in ("rail", "wheel_lateral", "wheel_rolling"))
            table.add_row(*position, curvature["side"], *map(radius_text, radii))
            position = ("",) * len(position)
    console.print(table)
