"""Files of a comparison: JSON, a picture, and one HTML file without time stamps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fecontact.files import write_json, write_text
from fecontact.outputs.parts import Details, Heading, Items, Lead, Part
from fecontact.outputs.style import page

if TYPE_CHECKING:
    from pathlib import Path

    from fecontact.regression.compare import TableComparison
from fecontact.outputs.comparison.record import comparison_record
from fecontact.outputs.comparison.tables import (
    COLUMN_TABLE,
    VALUE_TABLE,
    head_lines,
    tolerance_table,
    value_table,
    version_table,
)
from fecontact.outputs.comparison.verdicts import verdict_lines


def write_comparison(comparison: TableComparison, folder: Path) -> Path:
    """Write the record, the page, and a picture where each verdict has a shift and a load of its own."""
    write_json(folder / "comparison.json", comparison_record(comparison))
    write_text(folder / "comparison.html", comparison_html(comparison))
    if not comparison.verdicts.empty and not comparison.verdicts.duplicated(["lateral_shift_mm", "load_kN"]).any():
        from fecontact.outputs.figures.verdicts import verdicts_figure

        verdicts_figure(comparison, folder / "comparison.png")
    return folder


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
        *verdict_lines(comparison),
        value_table("Columns, the worst first", COLUMN_TABLE, changed, comparison),
        Details(f"{beyond}: {len(differences)}", [values]) if many else values,
        *(Details(title, [one]) for title, one in below.items()),
    ]
    return page(comparison.verdict, parts)
