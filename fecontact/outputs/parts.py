"""Parts of a document, for the terminal and for pages."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from fecontact.outputs.flat_records import to_plain
from fecontact.outputs.tables import Column, Table, TableRecord

if TYPE_CHECKING:
    from PIL.Image import Image


@dataclass(frozen=True)
class Heading:
    """Heading of a section; the headline of a page is its `Lead`.

    Attributes
    ----------
    text
        Text of the heading.
    level
        Level from 2.
    """

    text: str
    level: int = 2


@dataclass(frozen=True)
class Lead:
    """Answer of a document: the headline of its page.

    Attributes
    ----------
    text
        The answer.
    style
        Classes of the style sheet, such as `lead holds`.
    subject
        Judged inputs, in small letters below the answer; empty if the text has them.
    """

    text: str
    style: str = "lead"
    subject: str = ""


@dataclass(frozen=True)
class Items:
    """Notes, each in a separate line.

    Attributes
    ----------
    lines
        Texts of the notes.
    """

    lines: Sequence[str]


@dataclass(frozen=True)
class Terms:
    """Terms with their meanings.

    Attributes
    ----------
    pairs
        Each term with its meaning.
    """

    pairs: Sequence[tuple[str, str]]


@dataclass(frozen=True, kw_only=True)
class Spot:
    """Place in a picture that opens `Details`.

    Attributes
    ----------
    name
        Name of the `Details`.
    words
        Text that is shown beside the pointer.
    box
        Left, top, width and height, in percent of the picture.
    """

    name: str
    words: str
    box: tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Picture:
    """Picture for a page.

    Attributes
    ----------
    content
        PNG or SVG file, which is left out if it does not exist; bytes of an SVG or WEBP; or an image.
    words
        Text below the picture.
    width
        Largest width of an image, in pixels.
    spots
        Places to point at.
    relief
        Surface that turns under the pointer (see `outputs.figures.relief`). If no script runs, the picture is shown
        instead.
    """

    content: Path | bytes | Image
    words: str
    width: int = 1600
    spots: Sequence[Spot] = ()
    relief: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Details:
    """Parts that are shown on demand: folded on a page, with `--long` on a terminal.

    Spots refer to details by their `name`.

    Attributes
    ----------
    summary
        Line that is always shown.
    parts
        Parts that are shown on demand.
    name
        Name for references.
    """

    summary: str
    parts: Sequence[Part]
    name: str = ""


Part: TypeAlias = "str | Table | Heading | Lead | Items | Terms | Picture | Details"
Parts: TypeAlias = Iterable[Part]


@dataclass(frozen=True, kw_only=True)
class Telling:
    """Outputs of a feature for a load: record, columns and parts of documents.

    Attributes
    ----------
    record
        Function from the feature's values of a load to a record.
    keys
        Declarations of the record's keys and of its columns in tables, as TOML (`outputs/records/result_keys.toml`).
        Without declarations the record has any keys, and all of its numbers and texts are columns.
    columns
        Columns of the table of verdicts, which is made of rows.
    answer
        Function from the record to sentences that belong to the main results of a case.
    parts
        Function from the record to parts of a document on a case, its details.
    of_rows
        Function from rows to the parts that are shown below them.
    total
        Function from the records of the wheels of a vehicle to sentences on their sum. The record of a wheel without a
        usable result is None.
    """

    record: Callable[[Any], Any] = to_plain
    keys: str = ""
    columns: tuple[Column, ...] = ()
    answer: Callable[[TableRecord], Iterable[str]] = lambda record: ()
    parts: Callable[[TableRecord], Parts] = lambda record: ()
    of_rows: Callable[[Sequence[TableRecord]], Parts] = lambda rows: ()
    total: Callable[[Sequence[TableRecord | None]], Iterable[str]] = lambda records: ()
