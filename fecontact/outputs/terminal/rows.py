"""Cases on the terminal: a line each, with a table for each rail and wheel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from fecontact.outcome import usable
from fecontact.outputs.records.theories import theory_text
from fecontact.outputs.tables.cases import deviation_table
from fecontact.outputs.tables.table import Record, Table
from fecontact.outputs.terminal.console import Lines
from fecontact.outputs.words.pairs import pair_of_row, position_text
from fecontact.outputs.words.roll import roll_words_of_rows

_KEY = "dev %: what Hertz is off; valley: between lobes; mispl.: load elsewhere"
# More of them are one table, with the pair in its first column.
_MOST_TABLES = 6
# Characters for the measures by which a case fails, from the most down to the fewest; those beyond are counted.
_FAILING_WIDTHS = (50, 34, 30, 26, 22, 18)


def rows_lines(rows: Sequence[Record]) -> Lines:
    """One line a case, a table for each rail, wheel and inclination, and in full what makes a row unusable."""
    groups: dict[tuple[Any, ...], list[Record]] = {}
    for row in rows:
        pair = (row["rail"], row["wheel"], float(row.get("inclination_rad") or 0.0))
        groups.setdefault(pair, []).append(row)
    if len(groups) > _MOST_TABLES:
        yield _fitting(rows, "", with_pair=True)
    else:
        for own in groups.values():
            yield _fitting(own, "; ".join(filter(None, (pair_of_row(own[0]), roll_words_of_rows(own)))))
    if any(usable(row) for row in rows):
        yield _KEY
    for row in rows:
        where = (f"{pair_of_row(row)}, " if len(groups) > 1 else "") + position_text(row)
        if not usable(row):
            yield f"{where}: {row['status']}"
            continue
        if row.get("verdict_cause"):
            yield f"{where}: {row['verdict']}: {row['verdict_cause']}"
        if text := theory_text(row):
            yield f"{where}: {text}"


def _fitting(rows: Sequence[Record], title: str, *, with_pair: bool = False) -> Table:
    """The list of measures shrinks first, then columns go."""
    wide, *shorter = (deviation_table(rows, title, width, with_pair=with_pair) for width in _FAILING_WIDTHS)
    return replace(wide, shorter=shorter)
