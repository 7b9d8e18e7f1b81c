"""What all that is printed on the terminal shares: where it goes, its tables, its lines, and how numbers look."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from fecontact.outputs.tables.table import Table

if TYPE_CHECKING:
    from rich.console import Console, JustifyMethod
    from rich.table import Table as RichTable

# Width of a table that goes to a file or a pipe.
_PLAIN_WIDTH = 120
# Terminals that are narrower have columns closer together.
_ROOMY_WIDTH = 100


def standard_console() -> Console:
    """Standard output: as wide as the terminal, or `_PLAIN_WIDTH` and without any colour where there is none."""
    from rich.console import Console

    console = Console(highlight=False)
    return console if console.is_terminal else Console(width=_PLAIN_WIDTH, no_color=True, highlight=False)


def print_table(console: Console, table: Table, *, roomy_width: int = _ROOMY_WIDTH) -> None:
    """Print a table, and name the columns that find no room."""
    print_first_that_fits(console, table.narrower(), roomy_width=roomy_width)


def print_first_that_fits(
    console: Console, tables: Iterable[tuple[Table, Sequence[str]]], *, roomy_width: int = _ROOMY_WIDTH
) -> None:
    """Print the first of some tables that finds room, or the last, and name the columns that it leaves out."""
    from rich.measure import Measurement

    unbounded = console.options.update(max_width=10_000)
    for table, without in tables:
        shown, left_out = _rendered(console, table, roomy_width), without
        if Measurement.get(console, unbounded, shown).maximum - _slack(table) <= console.width:
            break
    console.print(shown)
    if left_out:
        say(console, f"no room for: {', '.join(left_out)}")


def _slack(table: Table) -> int:
    """Characters by which a table becomes narrower where texts take several lines."""
    wrapped = [[row.cells[n] for row in table.rows] for n, column in enumerate(table.columns) if column.wraps]
    return sum(
        max(map(len, texts)) - max((len(word) for text in texts for word in text.split()), default=0)
        for texts in wrapped
        if texts
    )


def _rendered(console: Console, table: Table, roomy_width: int) -> RichTable:
    """A table on a terminal with rules, and with columns closer together if it is narrower than that width."""
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    made = RichTable(
        title=Text(table.title) if table.title else None,
        title_justify="left",
        title_style="bold",
        box=box.SIMPLE_HEAD if console.is_terminal else None,
        # the box has a space between columns as well
        padding=(0, 1) if not console.is_terminal or console.width >= roomy_width else (0, 1, 0, 0),
        pad_edge=False,
    )
    for column in table.columns:
        justify: JustifyMethod = "right" if column.kind == "number" else "left"
        made.add_column(column.heading, justify=justify, no_wrap=not column.wraps, overflow="fold")
    for row in table.rows:
        # as text and not as markup: names of profiles may have brackets
        made.add_row(*map(Text, row.cells), style=_STYLES[row.tone])
    return made


_STYLES = {"plain": "", "fails": "red", "open": "yellow", "dim": "dim"}


def say(console: Console, text: str) -> None:
    """Print a line."""
    # not as markup: profile names and notes may have brackets
    console.print(text, markup=False, soft_wrap=not console.is_terminal)


def print_notes(notes: Iterable[str], console: Console) -> None:
    """Print what is to be known beside the numbers."""
    for note in notes:
        say(console, f"note: {note}")
