"""A contact table on the terminal: its most important columns."""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.outputs.tables.table import Record, number, table_of, text
from fecontact.outputs.tables.theories import cheapest_column
from fecontact.outputs.terminal.console import Lines

_COLUMNS = (
    number("shift\nmm", "lateral_shift_mm", "{:+z.2f}"),
    number("load\nkN", "load_kN"),
    number("angle\nmrad", "touch1_contact_angle_rad", "{:.1f}", 1e3, rank=2, name="angle"),
    number("points", "touch_points", "{:.0f}", rank=1, name="points"),
    number("Hertz\np_max MPa", "hertz_p_max_MPa", "{:.0f}"),
    number("strips\np_max MPa", "strip_p_max_MPa", "{:.0f}"),
    number("area\nmm²", "strip_area_mm2", "{:.1f}", rank=6, name="area"),
    number("a\nmm", "strip_a_mm", "{:.2f}", rank=5, name="a"),
    number("b\nmm", "strip_b_mm", "{:.2f}", rank=4, name="b"),
    number("approach\nmm", "strip_approach_mm", "{:.4f}", rank=3, name="approach"),
    number("stiffness\nkN/mm", "strip_stiffness_N_per_mm", "{:.0f}", 1e-3, rank=7, name="stiffness"),
    text("strips", "strip_status", none="-"),
    cheapest_column("cheapest like them", "cheapest_theory"),
)
_OF_MAP = cheapest_column("map: cheapest", "map_cheapest_theory")


def contact_table_lines(rows: Sequence[Record]) -> Lines:
    """The most important columns of a contact table, those of a map where it was asked, and what is missing."""
    of_map = any("map_cheapest_theory" in row for row in rows)
    yield table_of("Contact table", [*_COLUMNS, *[_OF_MAP] * of_map], rows)
    for row in rows:
        if row["problem"]:
            yield f"{row['lateral_shift_mm']:+z.2f} mm, {row['load_kN']:g} kN: {row['problem']}"
