"""Cases on the terminal: a line each, with a table for each rail and wheel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fecontact.outcome import usable
from fecontact.outputs.records.theories import theory_text
from fecontact.outputs.tables.cases import deviation_table
from fecontact.outputs.tables.table import Table
from fecontact.outputs.terminal.console import print_first_that_fits, say, standard_console
from fecontact.outputs.words.pairs import pair_of_row, position_text
from fecontact.outputs.words.roll import roll_words_of_rows

if TYPE_CHECKING:
    from rich.console import Console

Record = Mapping[str, Any]

_KEY = "dev %: what Hertz is off; valley: between lobes; mispl.: load elsewhere"
# More of them are one table, with the pair in its first column.
_MOST_TABLES = 6
# Characters for the measures by which a case fails, from the most down to the fewest; those beyond are counted.
_FAILING_WIDTHS = (50, 34, 30, 26, 22, 18)


def print_rows(rows: Sequence[Record], *, console: Console | None = None) -> None:
    """Print one line a case, a table for each rail, wheel and inclination, and in full what makes a row unusable."""
    console = console or standard_console()
    groups: dict[tuple[Any, ...], list[Record]] = {}
    for row in rows:
        pair = (row["rail"], row["wheel"], float(row.get("inclination_rad") or 0.0))
        groups.setdefault(pair, []).append(row)
    if len(groups) > _MOST_TABLES:
        print_first_that_fits(console, _narrower(rows, "", with_pair=True))
    else:
        for own in groups.values():
            title = "; ".join(filter(None, (pair_of_row(own[0]), roll_words_of_rows(own))))
            print_first_that_fits(console, _narrower(own, title))
    if any(usable(row) for row in rows):
        say(console, _KEY)
    for row in rows:
        where = (f"{pair_of_row(row)}, " if len(groups) > 1 else "") + position_text(row)
        if not usable(row):
            say(console, f"{where}: {row['status']}")
            continue
        if row.get("verdict_cause"):
            say(console, f"{where}: {row['verdict']}: {row['verdict_cause']}")
        if text := theory_text(row):
            say(console, f"{where}: {text}")


def _narrower(rows: Sequence[Record], title: str, *, with_pair: bool = False) -> Iterator[tuple[Table, list[str]]]:
    """The list of measures shrinks first, then columns go."""
    for width in _FAILING_WIDTHS[:-1]:
        yield deviation_table(rows, title, width, with_pair=with_pair), []
    yield from deviation_table(rows, title, _FAILING_WIDTHS[-1], with_pair=with_pair).narrower()
