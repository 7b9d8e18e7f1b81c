"""A comparison of two tables of results on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fecontact.outputs.tables.comparison import COLUMN_TABLE, head_lines, value_table, value_text

if TYPE_CHECKING:
    from fecontact.outputs.terminal.console import Lines
    from fecontact.regression.compare import TableComparison

# Columns that are shown where none differs, so that one sees how close it is.
_CLOSEST = 5


def comparison_lines(comparison: TableComparison) -> Lines:
    """What differs, the worst column first, or what is closest to it where nothing does, and the verdict.

    Columns in which all values are equal are not shown.
    """
    yield from head_lines(comparison)
    columns, efforts = comparison.columns, comparison.efforts
    if columns.differing.any():
        yield value_table("Columns that differ", COLUMN_TABLE, columns[columns.differing > 0], comparison)
    elif (columns.times_tolerance > 0.0).any():
        closest = columns[columns.times_tolerance > 0.0][:_CLOSEST]
        yield value_table("Closest to their tolerance", COLUMN_TABLE, closest, comparison)
    changed = efforts[efforts.baseline != efforts.new].to_dict("records")
    if changed:
        told = (f"{one['column']} {value_text(one, 'baseline')} -> {value_text(one, 'new')}" for one in changed)
        yield f"not compared: {', '.join(told)}"
    yield comparison.verdict
