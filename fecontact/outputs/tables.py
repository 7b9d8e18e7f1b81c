"""Records, tables and parts of documents as values, for the terminal, CSV files and pages."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

from fecontact.files import FORMULA, write_text
from fecontact.profiles.curve import radius_text

Tone: TypeAlias = Literal["plain", "fails", "open", "dim"]
"""Emphasis of a row: none, failing or unusable, open, or dimmed because it does not decide."""
Item: TypeAlias = Mapping[str, Any]
"""Item of a table: a record of results, or a row."""
Kind: TypeAlias = Literal["number", "text", "answer"]
Of: TypeAlias = str | Callable[[Any], Any]
"""How a column gets its value from an item: by a key, or by a function of the item."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    heading
        Heading of the column; a unit stands in a separate line.
    kind
        Numbers are aligned to the right, and a report gives answers their colour.
    rank, name
        If there is no room, columns with a name are left out, the lowest rank first, and their names are shown.
    wraps
        Whether texts may take several lines if there is no room.
    cell
        Text of an item, if the table is made of items (`table_of`).
    """

    heading: str
    kind: Kind = "number"
    rank: int = 0
    name: str = ""
    wraps: bool = False
    cell: Callable[[Any], str] = str


@dataclass(frozen=True, kw_only=True)
class TableRow:
    """A line of a table, with a text for each column."""

    cells: Sequence[str]
    tone: Tone = "plain"


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table of texts.

    Attributes
    ----------
    shorter
        A table with shorter texts, which is shown if there is no room, before columns are left out.
    roomy_width
        Characters of a terminal from which on there is more space between columns.
    """

    title: str
    columns: Sequence[Column]
    rows: Sequence[TableRow]
    shorter: Sequence[Table] = ()
    roomy_width: int = 100

    def without(self, names: Sequence[str]) -> Table:
        """The table without some of its named columns."""
        kept = [number for number, column in enumerate(self.columns) if not column.name or column.name not in names]
        return replace(
            self,
            columns=[self.columns[number] for number in kept],
            rows=[replace(row, cells=[row.cells[number] for number in kept]) for row in self.rows],
        )

    def narrower(self) -> Iterator[tuple[Table, list[str]]]:
        """The table, shorter tables, then tables with fewer and fewer columns, with the names of columns left out."""
        *before, shortest = (self, *self.shorter)
        yield from ((table, []) for table in before)
        names = [one.name for one in sorted(self.columns, key=lambda column: column.rank) if one.name]
        for count in range(len(names) + 1):
            yield shortest.without(names[:count]), names[:count]


def table_of(
    title: str, columns: Sequence[Column], items: Iterable[Any], tone: Callable[[Any], Tone] | None = None
) -> Table:
    """A table with a line for each item."""
    rows = [
        TableRow(cells=[column.cell(item) for column in columns], tone="plain" if tone is None else tone(item))
        for item in items
    ]
    return Table(title=title, columns=columns, rows=rows)


def number(
    heading: str, of: Of, form: str = "{:g}", factor: float = 1.0, *, none: str = "-", rank: int = 0, name: str = ""
) -> Column:
    """A column of numbers in a format, multiplied by a factor; `none` stands for a missing or infinite number."""

    def cell(item: Any) -> str:
        value = _value(of, item)
        return none if missing(value) else form.format(factor * float(value))

    return Column(heading=heading, rank=rank, name=name, cell=cell)


def text(
    heading: str, of: Of, kind: Kind = "text", *, none: str = "", rank: int = 0, name: str = "", wraps: bool = False
) -> Column:
    """A column of words; `none` stands for a missing text."""

    def cell(item: Any) -> str:
        value = _value(of, item)
        return none if value is None or value == "" else str(value)

    return Column(heading=heading, kind=kind, rank=rank, name=name, wraps=wraps, cell=cell)


def radius(heading: str, of: Of, form: str = "{:.1f}", *, rank: int = 0, name: str = "") -> Column:
    """A column of radii in mm; None stands for a straight line."""
    return text(heading, lambda item: radius_text(_value(of, item), form), "number", rank=rank, name=name)


def _value(of: Of, item: Any) -> Any:
    return of(item) if callable(of) else item.get(of)


def columns_of(*headings: str, texts: Sequence[str] = (), answers: Sequence[str] = ()) -> list[Column]:
    """Columns of numbers by their headings, except the headings listed as texts or answers."""
    return [
        Column(heading=one, kind="text" if one in texts else "answer" if one in answers else "number")
        for one in headings
    ]


def missing(value: object) -> bool:
    """Whether a value of a row is None, NaN or infinite."""
    return value is None or (isinstance(value, float) and not math.isfinite(value))


def number_text(value: float | None, form: str = "{:.5g}") -> str:
    """A number, or a dash if there is no number."""
    return "-" if value is None or missing(value) else form.format(value)


# --- Rows as CSV, for other programs.


def write_csv(rows: Iterable[Item], path: str | Path) -> Path:
    """Write rows as CSV: the columns in the order in which they first occur, missing values and NaN empty.

    A text that spreadsheets would evaluate has an apostrophe before it (`files.FORMULA`).
    """
    rows = list(rows)
    columns = list(dict.fromkeys(key for row in rows for key in row))
    text = io.StringIO()
    table = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    table.writeheader()
    table.writerows({key: _cell(value) for key, value in row.items()} for row in rows)
    return write_text(path, text.getvalue())


def _cell(value: object) -> object:
    if isinstance(value, str) and value.startswith(FORMULA):
        return f"'{value}"
    return None if missing(value) else value
