"""A comparison of two tables of results on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fecontact.outputs.tables.comparison import case_names, column_table, head_lines, value_text
from fecontact.outputs.terminal.console import print_table, say, standard_console
from fecontact.regression.compare import ColumnComparison, TableComparison

if TYPE_CHECKING:
    from rich.console import Console

# Columns that are shown where none differs, so that one sees how close it is.
_CLOSEST = 5


# Terminals that are narrower show fewer columns.
_ROOMY_WIDTH = 110


def print_comparison(comparison: TableComparison, *, console: Console | None = None) -> None:
    """Print what differs, the worst column first, or what is closest to it where nothing does, and the verdict.

    Parameters
    ----------
    comparison
        What is shown; columns in which all values are equal are not.
    console
        Standard output, if not given.
    """
    console = console or standard_console()
    for line in head_lines(comparison):
        say(console, line)
    names = case_names(comparison)
    differing = [column for column in comparison.columns if column.differing]
    closest = [column for column in comparison.columns if not column.unchanged][:_CLOSEST]
    if differing:
        print_table(console, column_table("Columns that differ", differing, names), roomy_width=_ROOMY_WIDTH)
    elif closest:
        print_table(console, column_table("Closest to their tolerance", closest, names), roomy_width=_ROOMY_WIDTH)
    changed = [column for column in comparison.efforts if column.worst.baseline != column.worst.new]
    if changed:
        say(console, f"not compared: {', '.join(_effort(column) for column in changed)}")
    say(console, comparison.verdict)


def _effort(column: ColumnComparison) -> str:
    worst = column.worst
    was, now = (value_text(text, worst.difference) for text in (worst.baseline, worst.new))
    return f"{column.column} {was} -> {now}"
