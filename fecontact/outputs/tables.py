"""Records, tables and parts of documents as values, for the terminal, CSV files and pages."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

from fecontact.files import FORMULA_PREFIXES, require_ending, write_text
from fecontact.inputs.texts import escape_invisible
from fecontact.profiles.curve import format_radius

Tone: TypeAlias = Literal["plain", "fails", "open", "dim"]
"""Emphasis of a row: no emphasis, failing or unusable, open, or dimmed because the row does not decide."""
TABLE_ENDINGS = (".csv",)
"""Endings of tables for other programs."""
TableRecord: TypeAlias = Mapping[str, Any]
"""Content of a line of a table: a record of results, or a row."""
ColumnKind: TypeAlias = Literal["number", "text", "answer"]
CellSource: TypeAlias = str | Callable[[Any], Any]
"""Source of the value of a column: a key of the record, or a function of the record."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """Column of a table.

    Attributes
    ----------
    heading
        Heading of the column, with the unit in a separate line.
    kind
        Numbers are aligned to the right, and a report gives answers their colour.
    rank, name
        If there is no room, columns with a name are left out, the lowest rank first, and their names are shown.
    wraps
        Whether texts may take several lines if there is no room.
    cell
        Function from a record to the text of the cell, for tables that are made of records (`make_table`).
    """

    heading: str
    kind: ColumnKind = "number"
    rank: int = 0
    name: str = ""
    wraps: bool = False
    cell: Callable[[Any], str] = str


@dataclass(frozen=True, kw_only=True)
class TableRow:
    """Line of a table, with a text for each column.

    Attributes
    ----------
    cells
        Text of each column.
    tone
        Tone of the line on a page.
    """

    cells: Sequence[str]
    tone: Tone = "plain"


@dataclass(frozen=True, kw_only=True)
class Table:
    """Table of texts.

    Attributes
    ----------
    title
        Title; empty for a table without a title.
    columns
        Columns in order.
    rows
        Lines in order.
    shorter
        Tables with shorter texts. They are tried before columns are left out if there is no room.
    roomy_width
        Smallest width of a terminal, in characters, with more space between columns.
    """

    title: str
    columns: Sequence[Column]
    rows: Sequence[TableRow]
    shorter: Sequence[Table] = ()
    roomy_width: int = 100

    def drop_columns(self, names: Sequence[str]) -> Table:
        """Copy of the table without some of its named columns.

        Parameters
        ----------
        names
            Names of the columns to leave out.

        Returns
        -------
        Table
            The copy.
        """
        remaining = [
            number for number, column in enumerate(self.columns) if not column.name or column.name not in names
        ]
        return replace(
            self,
            columns=[self.columns[number] for number in remaining],
            rows=[replace(row, cells=[row.cells[number] for number in remaining]) for row in self.rows],
        )

    def narrower_forms(self) -> Iterator[tuple[Table, list[str]]]:
        """Iterate over narrower and narrower forms of the table.

        Returns
        -------
        Iterator of (Table, list of str)
            The table, the shorter tables, then tables with fewer and fewer columns. The list has the names of the
            columns that are left out.
        """
        *longer_tables, shortest = (self, *self.shorter)
        yield from ((table, []) for table in longer_tables)
        names = [
            named_column.name
            for named_column in sorted(self.columns, key=lambda column: column.rank)
            if named_column.name
        ]
        for count in range(len(names) + 1):
            yield shortest.drop_columns(names[:count]), names[:count]


def make_table(
    title: str, columns: Sequence[Column], records: Iterable[Any], tone: Callable[[Any], Tone] | None = None
) -> Table:
    """Make a table with a line for each record.

    Parameters
    ----------
    title
        Title of the table.
    columns
        Columns with functions `cell`.
    records
        Records or rows.
    tone
        Function from a record to its emphasis; None for no emphasis.

    Returns
    -------
    Table
        The table.

    Examples
    --------
    >>> from fecontact.outputs.tables import make_table, number_column, text_column
    >>> columns = [text_column("rail", "rail"), number_column("p_max", "p_max_MPa", "{:.0f}")]
    >>> table = make_table("", columns, [{"rail": "60E1"}])
    >>> table.rows[0].cells
    ['60E1', '-']
    """
    rows = [
        TableRow(cells=[column.cell(record) for column in columns], tone="plain" if tone is None else tone(record))
        for record in records
    ]
    return Table(title=title, columns=columns, rows=rows)


def number_column(
    heading: str,
    source: CellSource,
    form: str = "{:g}",
    factor: float = 1.0,
    *,
    none: str = "-",
    rank: int = 0,
    name: str = "",
) -> Column:
    """Make a column of numbers in a format.

    Parameters
    ----------
    heading
        Heading of the column.
    source
        Key of the record, or function of the record.
    form
        Format of the number.
    factor
        Factor before the number is formatted.
    none
        Text for a missing or infinite number.
    rank, name
        See `Column`.

    Returns
    -------
    Column
        The column.
    """

    def cell(record: Any) -> str:
        value = _read_value(source, record)
        return none if is_missing(value) else form.format(factor * float(value))

    return Column(heading=heading, rank=rank, name=name, cell=cell)


def text_column(
    heading: str,
    source: CellSource,
    kind: ColumnKind = "text",
    *,
    none: str = "",
    rank: int = 0,
    name: str = "",
    wraps: bool = False,
) -> Column:
    """Make a column of words.

    Parameters
    ----------
    heading
        Heading of the column.
    source
        Key of the record, or function of the record.
    kind
        Kind of the column, see `Column`.
    none
        Text for a missing text.
    rank, name, wraps
        See `Column`.

    Returns
    -------
    Column
        The column.
    """

    def cell(record: Any) -> str:
        value = _read_value(source, record)
        return none if value is None or value == "" else str(value)

    return Column(heading=heading, kind=kind, rank=rank, name=name, wraps=wraps, cell=cell)


def radius_column(heading: str, source: CellSource, form: str = "{:.1f}", *, rank: int = 0, name: str = "") -> Column:
    """Make a column of radii in mm; None is a straight line."""
    return text_column(
        heading, lambda record: format_radius(_read_value(source, record), form), "number", rank=rank, name=name
    )


def _read_value(source: CellSource, record: Any) -> Any:
    return source(record) if callable(source) else record.get(source)


def make_columns(*headings: str, texts: Sequence[str] = (), answers: Sequence[str] = ()) -> list[Column]:
    """Make columns of numbers, texts and answers from their headings.

    Parameters
    ----------
    headings
        Headings in order.
    texts, answers
        Headings of the columns of texts, and of the columns of answers. All other columns have numbers.

    Returns
    -------
    list of Column
        The columns, without functions for cells.
    """
    return [
        Column(heading=heading, kind="text" if heading in texts else "answer" if heading in answers else "number")
        for heading in headings
    ]


def is_missing(value: object) -> bool:
    """Whether a value of a row is None, NaN or infinite."""
    return value is None or (isinstance(value, float) and not math.isfinite(value))


def number_text(value: float | None, form: str = "{:.5g}") -> str:
    """Text for a number, or a dash for a missing number."""
    return "-" if value is None or is_missing(value) else form.format(value)


# --- Rows as CSV, for other programs.


def write_csv(rows: Iterable[TableRecord], path: str | Path) -> Path:
    """Write rows as CSV.

    Columns are in the order in which they first occur. Missing values and NaN are empty. A text that spreadsheets would
    evaluate has an apostrophe before it (`files.FORMULA_PREFIXES`), also in the heading; texts of numbers have none.
    Characters that a terminal
    would execute are escapes (`escape_invisible`).

    Parameters
    ----------
    rows
        Rows; they may have different columns.
    path
        File to write.

    Returns
    -------
    Path
        The written file.

    Raises
    ------
    InputError
        If the path has another ending than .csv.
    """
    require_ending(path, TABLE_ENDINGS, "table")
    rows = list(rows)
    columns = list(dict.fromkeys(key for row in rows for key in row))
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(map(_cell, columns))
    writer.writerows([_cell(row.get(column)) for column in columns] for row in rows)
    return write_text(path, buffer.getvalue())


# Texts that begin with a sign and that no spreadsheet evaluates: numbers, also in per cent, and a dash alone.
_SIGNED_NUMBER = re.compile(r"[+-](?:(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?: ?%)?)?\Z", re.ASCII)


def _cell(value: object) -> object:
    if isinstance(value, str):
        is_formula = value.startswith(FORMULA_PREFIXES) and not _SIGNED_NUMBER.match(value)
        return escape_invisible(f"'{value}" if is_formula else value)
    return None if is_missing(value) else value
