"""A table as a value, made once and then shown on the terminal, in a report, or both."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

from fecontact.profiles.curve import radius_text

Tone: TypeAlias = Literal["plain", "fails", "open", "dim"]
"""How a row is to be seen: as it is, as what fails or must not be used, as what is open, as what does not decide."""
Record: TypeAlias = Mapping[str, Any]
"""What a table is made of: a record of results, or a row."""
Kind: TypeAlias = Literal["number", "text", "answer"]
Of: TypeAlias = str | Callable[[Any], Any]
"""What a column takes of an item: the value of a key, or what a function says of it."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    heading
        Its name; a unit stands in a line of its own.
    kind
        Numbers stand at the right end, and a report gives answers their colour.
    rank, name
        Where there is no room columns with a name are left out, those of the lowest rank first, and named.
    wraps
        Whether its texts may take several lines where there is no room.
    cell
        Its text of an item, where the table is made of items (`table_of`).
    """

    heading: str
    kind: Kind = "number"
    rank: int = 0
    name: str = ""
    wraps: bool = False
    cell: Callable[[Any], str] = str


@dataclass(frozen=True, kw_only=True)
class TableRow:
    """A line of texts, one a column."""

    cells: Sequence[str]
    tone: Tone = "plain"


@dataclass(frozen=True, kw_only=True)
class Table:
    """Columns, and lines of them.

    Attributes
    ----------
    shorter
        The same table with shorter texts, to be shown where there is no room before columns are left out.
    roomy_width
        Characters of a terminal from which on there is more space between columns.
    """

    title: str
    columns: Sequence[Column]
    rows: Sequence[TableRow]
    shorter: Sequence[Table] = ()
    roomy_width: int = 100

    def without(self, names: Sequence[str]) -> Table:
        """The same table without some of the columns that have a name."""
        kept = [number for number, column in enumerate(self.columns) if not column.name or column.name not in names]
        return replace(
            self,
            columns=[self.columns[number] for number in kept],
            rows=[replace(row, cells=[row.cells[number] for number in kept]) for row in self.rows],
        )

    def narrower(self) -> Iterator[tuple[Table, list[str]]]:
        """The table, shorter ones, then without one column after the other, with the names of those left out."""
        *before, shortest = (self, *self.shorter)
        yield from ((table, []) for table in before)
        names = [one.name for one in sorted(self.columns, key=lambda column: column.rank) if one.name]
        for count in range(len(names) + 1):
            yield shortest.without(names[:count]), names[:count]


def table_of(
    title: str, columns: Sequence[Column], items: Iterable[Any], tone: Callable[[Any], Tone] | None = None
) -> Table:
    """A table of items, each a line of what its columns say of it."""
    rows = [
        TableRow(cells=[column.cell(item) for column in columns], tone="plain" if tone is None else tone(item))
        for item in items
    ]
    return Table(title=title, columns=columns, rows=rows)


def number(
    heading: str, of: Of, form: str = "{:g}", factor: float = 1.0, *, none: str = "-", rank: int = 0, name: str = ""
) -> Column:
    """A column of numbers in a format, in so many parts of their unit; `none` where there is no finite one."""

    def cell(item: Any) -> str:
        value = _value(of, item)
        return none if missing(value) else form.format(factor * float(value))

    return Column(heading=heading, rank=rank, name=name, cell=cell)


def text(
    heading: str, of: Of, kind: Kind = "text", *, none: str = "", rank: int = 0, name: str = "", wraps: bool = False
) -> Column:
    """A column of words; `none` where there are none."""

    def cell(item: Any) -> str:
        value = _value(of, item)
        return none if value is None or value == "" else str(value)

    return Column(heading=heading, kind=kind, rank=rank, name=name, wraps=wraps, cell=cell)


def radius(heading: str, of: Of, form: str = "{:.1f}", *, rank: int = 0, name: str = "") -> Column:
    """A column of radii in mm, None of a straight line."""
    return text(heading, lambda item: radius_text(_value(of, item), form), "number", rank=rank, name=name)


def _value(of: Of, item: Any) -> Any:
    return of(item) if callable(of) else item.get(of)


def columns_of(*headings: str, texts: Sequence[str] = (), answers: Sequence[str] = ()) -> list[Column]:
    """Columns of numbers by their headings, but for those that are texts or answers."""
    return [
        Column(heading=one, kind="text" if one in texts else "answer" if one in answers else "number")
        for one in headings
    ]


def missing(value: object) -> bool:
    """Whether a value of a row is none, or no finite number."""
    return value is None or (isinstance(value, float) and not math.isfinite(value))


def number_text(value: float | None, form: str = "{:.5g}") -> str:
    """A number, or a dash where there is none."""
    return "-" if value is None or missing(value) else form.format(value)
