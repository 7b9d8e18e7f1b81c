"""What Hertz says of a position on the terminal: touch points, and the ellipse of each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fecontact.outputs.tables.table import Table, TableRow, columns_of
from fecontact.outputs.terminal.console import print_notes, print_table, say, standard_console
from fecontact.profiles.curve import radius_text

if TYPE_CHECKING:
    from rich.console import Console

Record = Mapping[str, Any]

_ELLIPSE = {
    "p0\nMPa": ("p_max_MPa", "{:.1f}"),
    "a\nmm": ("a_mm", "{:.3f}"),
    "b\nmm": ("b_mm", "{:.3f}"),
    "turned\nmrad": ("orientation_rad", "{:+z.1f}"),
    "area\nmm²": ("area_mm2", "{:.2f}"),
    "approach\nmm": ("approach_mm", "{:.5f}"),
}


def print_hertz(record: Record, *, console: Console | None = None) -> None:
    """Print a Hertz record: touch points and the ellipse of each, and of each side of a junction."""
    console = console or standard_console()
    print_table(console, touch_point_table(record))
    print_table(console, ellipse_table(record))
    if len(record["shared"]["ellipses"]) > 1:
        say(console, _shared_text(record["shared"]))
    for ellipse in record["ellipses"]:
        if "problem" in ellipse:
            say(console, f"point {ellipse['touch_point'] + 1}, {ellipse['side']} side: {ellipse['problem']}")
    print_notes(record["warnings"], console)


def ellipse_table(record: Record) -> Table:
    """The ellipse of each touch point, and of each side of a junction."""
    rows = []
    for one in record["ellipses"]:
        cells = ["-"] * (1 + len(_ELLIPSE))
        if "problem" not in one:
            of = {**one, "orientation_rad": 1e3 * one["orientation_rad"]}
            cells = [f"{of['normal_force_N'] / 1e3:.3f}", *(form.format(of[key]) for key, form in _ELLIPSE.values())]
        rows.append(TableRow(cells=[str(one["touch_point"] + 1), one["side"], *cells]))
    columns = columns_of("point", "side", "F_n\nkN", *_ELLIPSE, texts=("side",))
    return Table(title="Hertz's ellipse, each with the whole load", columns=columns, rows=rows)


def _shared_text(shared: Record) -> str:
    parts = (
        f"point {e['touch_point'] + 1} {e['normal_force_N'] / 1e3:.1f} kN, p0 {e['p_max_MPa']:.0f} MPa"
        for e in shared["ellipses"]
    )
    overlap = "; but their ellipses overlap: they are one patch" if shared["overlapping"] else ""
    return f"As springs side by side they share the load: {'; '.join(parts)}{overlap}."


def touch_point_table(record: Record) -> Table:
    """Where the rigid bodies touch, and the radii there."""
    rows = []
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
            rows.append(TableRow(cells=[*position, curvature["side"], *map(radius_text, radii)]))
            position = ("",) * len(position)
    places = ("point", "y rail\nmm", "y wheel\nmm", "angle\nmrad", "gap\nmm", "side")
    columns = columns_of(*places, "R rail\nmm", "R wheel\nacross mm", "R wheel\nrolling mm", texts=("side",))
    return Table(title="Touch points (radii positive where convex)", columns=columns, rows=rows)
