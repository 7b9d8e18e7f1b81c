"""A comparison of two tables of results as one HTML file, without time stamps."""

from __future__ import annotations

from fecontact.outputs.reports.html import folded, heading, items, page, paragraph, table
from fecontact.outputs.tables.comparison import (
    case_names,
    column_table,
    effort_table,
    head_lines,
    tolerance_table,
    value_table,
    version_table,
)
from fecontact.regression.compare import TableComparison, counted

# More values than these are folded away.
_MOST_OPEN = 40


def comparison_html(comparison: TableComparison) -> str:
    """The comparison as one HTML page that needs no other file; well-formed XML as well."""
    names = case_names(comparison)
    changed = [column for column in comparison.columns if not column.unchanged]
    unchanged = [column for column in comparison.columns if column.unchanged]
    beyond = "All values beyond their tolerance, the worst first"
    values = table(value_table(beyond, comparison.differences, names))
    if len(comparison.differences) > _MOST_OPEN:
        open_values = value_table("", comparison.differences, names)
        values = folded(f"{beyond}: {len(comparison.differences)}", table(open_values))
    equal = f"{counted(len(unchanged), 'column')} with equal values"
    return page(
        comparison.verdict,
        [
            heading("Comparison of results", 1),
            paragraph(comparison.verdict, "same" if comparison.same else "different"),
            items(head_lines(comparison)),
            table(column_table("Columns, the worst first", changed, names)),
            values,
            folded(equal, table(column_table("", unchanged, names))),
            folded("Not compared; where they are furthest apart", table(effort_table(comparison, names))),
            folded("Tolerances", table(tolerance_table(comparison))),
            folded("Versions", table(version_table(comparison))),
        ],
    )
