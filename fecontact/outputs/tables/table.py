"""A table as a value, made once and then shown on the terminal, in a report, or both."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

Tone: TypeAlias = Literal["plain", "fails", "open", "dim"]
"""How a row is to be seen: as it is, as what fails or must not be used, as what is open, as what does not decide."""


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
    """

    heading: str
    kind: Literal["number", "text", "answer"] = "number"
    rank: int = 0
    name: str = ""
    wraps: bool = False


@dataclass(frozen=True, kw_only=True)
class TableRow:
    """A line of texts, one a column."""

    cells: Sequence[str]
    tone: Tone = "plain"


@dataclass(frozen=True, kw_only=True)
class Table:
    """Columns, and lines of them."""

    title: str
    columns: Sequence[Column]
    rows: Sequence[TableRow]

    def without(self, names: Sequence[str]) -> Table:
        """The same table without some of the columns that have a name."""
        kept = [number for number, column in enumerate(self.columns) if not column.name or column.name not in names]
        return replace(
            self,
            columns=[self.columns[number] for number in kept],
            rows=[replace(row, cells=[row.cells[number] for number in kept]) for row in self.rows],
        )

    def narrower(self) -> Iterator[tuple[Table, list[str]]]:
        """The table, then without one column after the other, each with the names of those that are left out."""
        names = [one.name for one in sorted(self.columns, key=lambda column: column.rank) if one.name]
        for count in range(len(names) + 1):
            yield self.without(names[:count]), names[:count]


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
