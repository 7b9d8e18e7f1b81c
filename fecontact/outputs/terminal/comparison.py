"""A comparison of two tables of results on the terminal."""

from __future__ import annotations

from fecontact.outputs.tables.comparison import case_names, column_table, head_lines, value_text
from fecontact.outputs.terminal.console import Lines
from fecontact.regression.compare import ColumnComparison, TableComparison

# Columns that are shown where none differs, so that one sees how close it is.
_CLOSEST = 5


def comparison_lines(comparison: TableComparison) -> Lines:
    """What differs, the worst column first, or what is closest to it where nothing does, and the verdict.

    Columns in which all values are equal are not shown.
    """
    yield from head_lines(comparison)
    names = case_names(comparison)
    differing = [column for column in comparison.columns if column.differing]
    closest = [column for column in comparison.columns if not column.unchanged][:_CLOSEST]
    if differing:
        yield column_table("Columns that differ", differing, names)
    elif closest:
        yield column_table("Closest to their tolerance", closest, names)
    changed = [column for column in comparison.efforts if column.worst.baseline != column.worst.new]
    if changed:
        yield f"not compared: {', '.join(_effort(column) for column in changed)}"
    yield comparison.verdict


def _effort(column: ColumnComparison) -> str:
    worst = column.worst
    was, now = (value_text(text, worst.difference) for text in (worst.baseline, worst.new))
    return f"{column.column} {was} -> {now}"
