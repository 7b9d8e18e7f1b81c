"""A contact table on the terminal: its most important columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fecontact.outputs.tables.table import Column, Table, TableRow, number_text
from fecontact.outputs.terminal.console import print_table, say, standard_console

if TYPE_CHECKING:
    from rich.console import Console

Record = Mapping[str, Any]

# Heading, column of the rows, how a number is written, and its name and rank where there is no room for it.
_NUMBERS = (
    ("shift\nmm", "lateral_shift_mm", "{:+z.2f}", "", 0),
    ("load\nkN", "load_kN", "{:g}", "", 0),
    ("angle\nmrad", "touch1_contact_angle_rad", "{:.1f}", "angle", 2),
    ("points", "touch_points", "{}", "points", 1),
    ("Hertz\np_max MPa", "hertz_p_max_MPa", "{:.0f}", "", 0),
    ("strips\np_max MPa", "strip_p_max_MPa", "{:.0f}", "", 0),
    ("area\nmm²", "strip_area_mm2", "{:.1f}", "area", 6),
    ("a\nmm", "strip_a_mm", "{:.2f}", "a", 5),
    ("b\nmm", "strip_b_mm", "{:.2f}", "b", 4),
    ("approach\nmm", "strip_approach_mm", "{:.4f}", "approach", 3),
    ("stiffness\nkN/mm", "strip_stiffness_N_per_mm", "{:.0f}", "stiffness", 7),
)
_THOUSANDTHS = {"touch1_contact_angle_rad": 1e3, "strip_stiffness_N_per_mm": 1e-3}
_TEXTS = (
    ("strips", "strip_status"),
    ("cheapest like them", "cheapest_theory"),
    ("of itself", "cheapest_theory_status"),
)
_MAP = ("map: cheapest", "map_cheapest_theory")


def print_lines(rows: Sequence[Record], *, console: Console | None = None) -> None:
    """Print a line each, and below what is missing."""
    console = console or standard_console()
    print_table(console, lines_table(rows))
    for row in rows:
        if row["problem"]:
            say(console, f"{row['lateral_shift_mm']:+z.2f} mm, {row['load_kN']:g} kN: {row['problem']}")


def lines_table(rows: Sequence[Record]) -> Table:
    """The most important columns of a contact table."""
    texts = [*_TEXTS, *([_MAP] if rows and _MAP[1] in rows[0] else [])]
    columns = [Column(heading=heading, name=name, rank=rank) for heading, _, _, name, rank in _NUMBERS]
    columns += [Column(heading=heading, kind="text") for heading, _ in texts]
    cells = [
        [*(_number(row, key, form) for _, key, form, _, _ in _NUMBERS), *(str(row.get(key) or "-") for _, key in texts)]
        for row in rows
    ]
    return Table(title="Contact table", columns=columns, rows=[TableRow(cells=one) for one in cells])


def _number(row: Record, key: str, form: str) -> str:
    value = row.get(key)
    return number_text(value if value is None else _THOUSANDTHS.get(key, 1) * value, form)
