"""Rows of the screening as a table of Parquet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from fecontact.criteria import Criteria
from fecontact.features.fleet.packages import import_arrow, import_parquet
from fecontact.profiles.smoothing import PRACTICE_MIDDLE_MM, PRACTICE_MM

ROWS_FILE = "part.parquet"
MEASURE_COLUMNS: dict[str, str] = {
    limit.metadata["measure"]: limit.name for limit in fields(Criteria) if "measure" in limit.metadata
}
"""Beginning of the columns of each measure.

Values are in percent of the screening's value, of Hertz's b, of the peak or of the load.
"""
_PLACE_COLUMNS = (
    "place_y_mm",
    "contact_angle_mrad",
    "conicity",
    "contact_concentration",
    "hertz_p_max_MPa",
    "screen_p_max_MPa",
)
NUMBERS = (
    *("shift_mm", "load_kN", *_PLACE_COLUMNS),
    *(f"{name}_{what}" for name in MEASURE_COLUMNS.values() for what in ("percent", "uncertainty_percent")),
    *("margin", "variants_holding", "variants"),
)
FILTER_COLUMNS = {
    f"filter_{length:.2g}_mm".replace(".", "_"): length
    for length in (PRACTICE_MM[0], PRACTICE_MIDDLE_MM, PRACTICE_MM[1])
}
"""Usual filter lengths (mm) by the column with the verdict if this filter were declared."""
TEXTS = (
    *("verdict", "measure", "cause", "open_because", *FILTER_COLUMNS),
    *("cheapest_theory", "cheaper_possible_theory", "reason", "reason_kind", "remedy"),
)
NO_CONTACT, REFUSED = "NO CONTACT", "REFUSED"
"""Verdicts of positions without an answer.

The wheel derails or falls between the rails, so that the position is not a contact; or there is no answer for a
different reason.
"""
Row = dict[str, Any]


def make_schema(*first_columns: tuple[str, str]) -> Any:
    """Columns of the table of the screening, after some first columns.

    Parameters
    ----------
    first_columns
        Name and kind (string, double) of each first column.

    Returns
    -------
    pyarrow.Schema
        Names and types of all columns.
    """
    arrow = import_arrow("lib")
    kinds = {"string": arrow.string(), "double": arrow.float64()}
    columns = [*first_columns, *((name, "double") for name in NUMBERS), *((name, "string") for name in TEXTS)]
    return arrow.schema([(name, kinds[kind]) for name, kind in columns])


def write_rows(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write rows of the screening as Parquet.

    Parameters
    ----------
    rows
        Rows with the columns of the screening.
    path
        Path of the Parquet file.
    """
    table = import_arrow("lib").Table.from_pylist([dict(row) for row in rows], schema=make_schema())
    with path.open("wb") as file:
        import_parquet().write_table(table, file)
