"""Tables about theories of the pressure, for the terminal and reports."""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.outputs.records.theories import theory_words
from fecontact.outputs.tables.table import Column, Record, Table, number, table_of, text

_OTHERS = {"UNRESOLVED": "open whether a cheaper one holds", "none": "none holds", "failed": "could not be solved"}

_SHARES = (
    text("theory", lambda one: one.get("words") or _OTHERS[one["theory"]]),
    text("cost", "cost"),
    number("cheapest\ncells", "cheapest_cells", "{:.0f}"),
    number("cheapest\n%", "cheapest_percent", "{:.0f}"),
    number("out of\nrange", "out_of_range_cells", "{:.0f}"),
    number("largest part\nof a limit", "largest_limit_used", "{:.2f}"),
    number("holds\n%", "holds_percent", "{:.0f}"),
)


def shares_table(shares: Sequence[Record]) -> Table:
    """In how many cells of a map each theory is the cheapest that holds, and in how many it holds at all."""
    shown = [one for one in shares if one["cheapest_cells"] or "cost" in one]
    return table_of("The cheapest theory that holds, and where each holds", _SHARES, shown)


def cheapest_column(heading: str, of: str, *, name: str = "") -> Column:
    """The cheapest theory that holds in words, and whether it is out of its range."""
    return text(
        heading, lambda row: theory_words(row.get(of), row.get(f"{of}_status")), none="-", name=name, wraps=True
    )
