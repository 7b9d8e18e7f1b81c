"""A comparison of two tables of results as one HTML file, without time stamps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fecontact.outputs.documents.parts import Details, Heading, Items, Lead, Part
from fecontact.outputs.reports.html import page
from fecontact.outputs.tables.comparison import (
    COLUMN_TABLE,
    VALUE_TABLE,
    head_lines,
    tolerance_table,
    value_table,
    version_table,
)

if TYPE_CHECKING:
    from fecontact.regression.compare import TableComparison

# More values than these are folded away.
_MOST_OPEN = 40


def comparison_html(comparison: TableComparison) -> str:
    """The comparison as one HTML page that needs no other file; well-formed XML as well."""
    columns, differences = comparison.columns, comparison.differences
    changed, equal = columns[columns.times_tolerance > 0.0], columns[columns.times_tolerance == 0.0]
    beyond = "All values beyond their tolerance, the worst first"
    many = len(differences) > _MOST_OPEN
    values = value_table("" if many else beyond, VALUE_TABLE, differences, comparison)
    below = {
        f"Columns with equal values: {len(equal)}": value_table("", COLUMN_TABLE, equal, comparison),
        "Not compared; where they are furthest apart": value_table("", VALUE_TABLE, comparison.efforts, comparison),
        "Tolerances": tolerance_table(comparison),
        "Versions": version_table(comparison),
    }
    parts: list[Part] = [
        Heading("Comparison of results", 1),
        Lead(comparison.verdict, "same" if comparison.same else "different"),
        Items(list(head_lines(comparison))),
        value_table("Columns, the worst first", COLUMN_TABLE, changed, comparison),
        Details(f"{beyond}: {len(differences)}", [values]) if many else values,
        *(Details(title, [one]) for title, one in below.items()),
    ]
    return page(comparison.verdict, parts)
