"""Rows of the screening as a table of Parquet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from fecontact.criteria import Criteria
from fecontact.features.fleet.tables import of_arrow

PART = "part.parquet"
COLUMN: dict[str, str] = {
    limit.metadata["measure"]: limit.name for limit in fields(Criteria) if "measure" in limit.metadata
}
"""What the columns of each measure begin with; in percent of the screen's value, of Hertz's b, the peak, the load."""
_FIRST = ("place_y_mm", "touch_angle_mrad", "conicity", "contact_concentration", "hertz_p_max_MPa", "screen_p_max_MPa")
NUMBERS = (
    *("shift_mm", "load_kN", *_FIRST),
    *(f"{name}_{what}" for name in COLUMN.values() for what in ("percent", "uncertainty_percent")),
    *("margin", "lines_holding", "lines"),
)
TEXTS = ("verdict", "measure", "cause", "cheapest_theory", "reason")
Row = dict[str, Any]


def schema(*more: tuple[str, str]) -> Any:
    """Columns of the screen's table, after others by name and kind (string, double)."""
    arrow = of_arrow("lib")
    kinds = {"string": arrow.string(), "double": arrow.float64()}
    columns = [*more, *((name, "double") for name in NUMBERS), *((name, "string") for name in TEXTS)]
    return arrow.schema([(name, kinds[kind]) for name, kind in columns])


def write_rows(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write rows of the screen."""
    table = of_arrow("lib").Table.from_pylist([dict(row) for row in rows], schema=schema())
    of_arrow("parquet").write_table(table, path)
