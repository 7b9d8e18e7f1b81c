"""Parts of a document: what is told of a result is made once, and shown on a terminal or as a page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from fecontact.outputs.tables.table import Table

if TYPE_CHECKING:
    from PIL.Image import Image


@dataclass(frozen=True)
class Heading:
    """A heading; a page has one of level 1."""

    text: str
    level: int = 2


@dataclass(frozen=True)
class Lead:
    """The answer, with the style of the page's sheet that says how it turned out."""

    text: str
    style: str = "lead"


@dataclass(frozen=True)
class Items:
    """Notes, a line each."""

    lines: Sequence[str]


@dataclass(frozen=True)
class Terms:
    """Names, and what they mean."""

    pairs: Sequence[tuple[str, str]]


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture for a page: a PNG or SVG file, the text of an SVG, or an image; none where the file is not there.

    On a wide screen a small one takes 40 % of it; an image is shown at most `width` pixels wide.
    """

    content: Path | bytes | Image
    words: str
    small: bool = False
    width: int = 1600


@dataclass(frozen=True)
class Details:
    """What is shown on demand: folded on a page, with `--long` on a terminal."""

    summary: str
    parts: Sequence[Part]


Part: TypeAlias = "str | Table | Heading | Lead | Items | Terms | Picture | Details"
Parts: TypeAlias = Iterable[Part]
