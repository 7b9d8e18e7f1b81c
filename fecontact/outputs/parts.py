"""Parts of a document, for the terminal and for pages."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from fecontact.outputs.flat_records import told
from fecontact.outputs.tables import Column, Item, Table

if TYPE_CHECKING:
    from PIL.Image import Image


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
