"""Tables about theories of the pressure, for the terminal and reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fecontact.outputs.tables.table import Table, TableRow, columns_of, number_text

Record = Mapping[str, Any]

_OTHERS = {"UNRESOLVED": "open whether a cheaper one holds", "none": "none holds", "failed": "could not be solved"}


def shares_table(shares: Sequence[Record]) -> Table:
    """In how many cells of a map each theory is the cheapest that holds, and in how many it holds at all."""
    rows = [
        TableRow(
            cells=[
                str(one.get("words") or _OTHERS[one["theory"]]),
                str(one.get("cost") or ""),
                str(one["cheapest_cells"]),
                f"{one['cheapest_percent']:.0f}",
                number_text(one.get("largest_limit_used"), "{:.2f}"),
                number_text(one.get("holds_percent"), "{:.0f}"),
            ]
        )
        for one in shares
        if one["cheapest_cells"] or "cost" in one
    ]
    headings = ("theory", "cost", "cheapest\ncells", "cheapest\n%", "largest part\nof a limit", "holds\n%")
    return Table(
        title="The cheapest theory that holds, and where each holds",
        columns=columns_of(*headings, texts=("theory", "cost")),
        rows=rows,
    )
