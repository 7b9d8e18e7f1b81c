"""Tables about theories of the pressure, for the terminal and reports."""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.outputs.tables.table import Record, Table, number, table_of, text

_OTHERS = {"UNRESOLVED": "open whether a cheaper one holds", "none": "none holds", "failed": "could not be solved"}


_SHARES = (
    text("theory", lambda one: one.get("words") or _OTHERS[one["theory"]]),
    text("cost", "cost"),
    number("cheapest\ncells", "cheapest_cells", "{:.0f}"),
    number("cheapest\n%", "cheapest_percent", "{:.0f}"),
    number("largest part\nof a limit", "largest_limit_used", "{:.2f}"),
    number("holds\n%", "holds_percent", "{:.0f}"),
)


def shares_table(shares: Sequence[Record]) -> Table:
    """In how many cells of a map each theory is the cheapest that holds, and in how many it holds at all."""
    shown = [one for one in shares if one["cheapest_cells"] or "cost" in one]
    return table_of("The cheapest theory that holds, and where each holds", _SHARES, shown)
