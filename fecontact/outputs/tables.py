"""Records, tables and parts of documents as values, for the terminal, CSV files and pages."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from fecontact.files import FORMULA, write_text
from fecontact.profiles.curve import radius_text
from fecontact.profiles.library import file_of_identity, profile_identity

if TYPE_CHECKING:
    from PIL.Image import Image

    from fecontact.case import Case


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


# --- A value as a record, and a record as a row: results keep the names that they have in the program.

Record: TypeAlias = dict[str, Any]

# Beginnings of groups of relative numbers: relative to the finite elements, or a step relative to the rung before it.
_RELATIVE = ("deviation", "uncertainty", "step")


def told(value: Any) -> Any:
    """A value in plain JSON; a dataclass gives the fields and properties in its `TELLS`, or all its fields."""
    if is_dataclass(value):
        names: tuple[str, ...] = getattr(type(value), "TELLS", None) or tuple(one.name for one in fields(value))
        return {name: told(getattr(value, name)) for name in names}
    if isinstance(value, Mapping):
        return {str(key): told(one) for key, one in value.items()}
    if isinstance(value, tuple | list):
        return [told(one) for one in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def picked(value: object, names: str, before: str = "") -> Record:
    """Attributes of a value by their names, which are separated by blanks; keys get the prefix `before`."""
    return {f"{before}{name}": told(getattr(value, name)) for name in names.split()}


def flat(record: Mapping[str, Any]) -> Record:
    """A record as a row: each number and text by its path, joined by `_`.

    Numbers of a relative group are in percent, and `percent` replaces the unit in their names. A list of records is
    counted, a list of texts is joined.
    """
    return dict(_columns(record, "", relative=False))


def _columns(record: Mapping[str, Any], before: str, *, relative: bool) -> Iterator[tuple[str, Any]]:
    for name, value in record.items():
        if isinstance(value, Mapping):
            yield from _columns(value, f"{before}{name}_", relative=relative or name.startswith(_RELATIVE))
        elif isinstance(value, list):
            of_records = any(isinstance(one, Mapping) for one in value)
            yield f"{before}{name}", len(value) if of_records else "; ".join(map(str, value))
        elif relative:
            column = relative_name(name)
            yield f"{before}{column}", 1e2 * value if column.endswith("_percent") and value is not None else value
        else:
            yield f"{before}{name}", value


def relative_name(measure: str) -> str:
    """Column of a relative number: `p_max_percent` for `p_max_MPa`, `valley_percent` for `valley`, `centre_over_b`."""
    stem, _, unit = measure.rpartition("_")
    if measure.endswith("_over_b"):
        return measure
    return f"{stem if unit in ('MPa', 'mm', 'mm2') else measure}_percent"


# --- Parts of a document, for the terminal and for pages.


@dataclass(frozen=True)
class Heading:
    """A heading; a page has one heading of level 1."""

    text: str
    level: int = 2


@dataclass(frozen=True)
class Lead:
    """The answer, with the style in which the page shows it."""

    text: str
    style: str = "lead"


@dataclass(frozen=True)
class Items:
    """Notes, each in a line."""

    lines: Sequence[str]


@dataclass(frozen=True)
class Terms:
    """Names and their meanings."""

    pairs: Sequence[tuple[str, str]]


@dataclass(frozen=True, kw_only=True)
class Spot:
    """A place of a picture that leads to `Details` by their name.

    `box` is left, top, width and height, in percent of the picture. `words` are shown beside the pointer.
    """

    name: str
    words: str
    box: tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture for a page: a PNG or SVG file, left out if it does not exist; the bytes of an SVG or WEBP; or an image.

    An image is shown at most `width` pixels wide. `spots` are places to point at. `relief` is a surface that turns
    under the pointer (see `outputs.figures.relief`); the picture stands for it if no script runs.
    """

    content: Path | bytes | Image
    words: str
    width: int = 1600
    spots: Sequence[Spot] = ()
    relief: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Details:
    """Parts that are shown on demand: folded on a page, with `--long` on a terminal; spots find them by their name."""

    summary: str
    parts: Sequence[Part]
    name: str = ""


Part: TypeAlias = "str | Table | Heading | Lead | Items | Terms | Picture | Details"
Parts: TypeAlias = Iterable[Part]


@dataclass(frozen=True, kw_only=True)
class Telling:
    """How what a feature reads of a load is told.

    Attributes
    ----------
    record
        Of what was read.
    left_out
        Patterns of the record's columns that a row leaves out.
    columns
        Of the table of verdicts, made of rows.
    parts
        Of a document on a case, from the record.
    of_rows
        What is said below rows.
    """

    record: Callable[[Any], Any] = told
    left_out: tuple[str, ...] = ()
    columns: tuple[Column, ...] = ()
    parts: Callable[[Item], Parts] = lambda record: ()
    of_rows: Callable[[Sequence[Item]], Parts] = lambda rows: ()


# --- Rails and wheels in words: on the terminal, in pictures and in reports.

Row: TypeAlias = Mapping[str, Any]


# longer ones leave no room for a picture
_LONGEST_NAME = 60


BODIES = ("rail", "wheel")


def short_name(name: str) -> str:
    """A profile's name, for a file (`NAME.ext@HASH`) without ending and hash; a long name is cut and has its hash.

    A file that is called rail or wheel, whatever it is, is told from others by its hash alone.
    """
    file = file_of_identity(name)
    if file is None or (stem := Path(file).stem).lower() in BODIES:
        return name
    return stem if len(stem) <= _LONGEST_NAME else f"{stem[: _LONGEST_NAME - 20]}…{name.rpartition('@')[2]}"


def inclination_words(inclination_rad: float) -> str:
    """A rail's inclination such as " 1:40"; empty for an upright rail."""
    return f" 1:{1.0 / math.tan(inclination_rad):.3g}" if inclination_rad else ""


def pair_words(case: Case, between: str = ", ") -> str:
    """Rail and wheel, such as "rail 60E1 1:40, wheel S1002"."""
    return pair_text(profile_identity(case.rail), profile_identity(case.wheel), case.inclination_rad, between)


def pair_of_row(row: Row, between: str = ", ") -> str:
    """Rail and wheel of a row, as in `pair_words`."""
    return pair_text(str(row["rail"]), str(row["wheel"]), float(row.get("inclination_rad") or 0.0), between)


def pair_text(rail: str, wheel: str, inclination_rad: float, between: str) -> str:
    """Two profiles by their identities, without endings and hashes where their names tell enough."""
    return f"{body_words('rail', rail)}{inclination_words(inclination_rad)}{between}{body_words('wheel', wheel)}"


def body_words(body: str, name: str) -> str:
    """A rail or a wheel with its name, such as "rail 60E1"; the name alone of a file that is called so."""
    short = short_name(name)
    return short if short.lower().partition(".")[0] == body else f"{body} {short}"


VARIED = "varied"
"""Column of what else varies in a study: names and values of inputs, separated by commas."""


def position_text(row: Row) -> str:
    """Shift and load of a row, the distance along an irregularity, and what else varies in its study."""
    along = "" if row.get("distance_mm") is None else f", at {row['distance_mm']:g} mm"
    varied = f", {row[VARIED]}" if row.get(VARIED) else ""
    return f"{row['lateral_shift_mm']:+z.2f} mm, {row['load_kN']:g} kN{along}{varied}"
