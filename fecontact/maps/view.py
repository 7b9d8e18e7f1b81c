"""What a picture and a text of a map show: cells, columns and their bands over the load."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from fecontact.case import Case
from fecontact.maps.model import FIRST_YIELD, PLASTIC_LIMIT

Band = tuple[float, float, str]
"""Smallest and largest load (kN) of a stretch, and its answer."""
# Columns farther apart than the first (mm) have gaps between them: so much of a step is their width, at most the last.
CLOSE_MM, _PART_OF_WIDE, _WIDEST_MM = 0.5, 0.7, 1.0

YIELD_WORDS: Mapping[str, str] = {
    FIRST_YIELD: "first yield of virgin steel",
    PLASTIC_LIMIT: "yielding alone takes up a limit\nat first loading",
}


def column_width(shifts_mm: Sequence[float]) -> float:
    """Width of every column, in mm: the smallest step between two, of which wide ones leave gaps; a single one has 1.

    What was solved at a shift says nothing of shifts that are farther away than their neighbours usually are.
    """
    step = min((after - before for before, after in pairwise(shifts_mm)), default=math.inf)
    if not math.isfinite(step):
        return 1.0
    return step if step <= CLOSE_MM else min(max(CLOSE_MM, _PART_OF_WIDE * step), _WIDEST_MM)


@dataclass(frozen=True, kw_only=True)
class CellView:
    """What is shown of a position under one load.

    Attributes
    ----------
    answer
        Key of the view's colours.
    text, letter
        In the picture: with its number, and where there is no room for numbers.
    printed
        In the table; empty where it is the text there too.
    bold
        For what does not hold.
    diamond
        Whether there is a diamond below it.
    out_of_range
        Whether the theory that is the answer is out of its own range.
    share
        Part of the lines that measured points allow on which it holds; where it hangs on them.
    """

    load_kN: float
    answer: str
    text: str
    letter: str
    printed: str = ""
    bold: bool = False
    diamond: bool = False
    out_of_range: bool = False
    share: float | None = None


@dataclass(frozen=True, kw_only=True)
class ColumnView:
    """A lateral shift over the loads.

    Attributes
    ----------
    bands
        Smallest and largest load (kN) and answer, by increasing load; none where nothing is known.
    solved_kN
        Loads that were solved; without any there is no border.
    lines
        Loads (kN) at which something begins, and what.
    limit
        At which loads it holds, in words; empty where the map has no limits.
    """

    shift_mm: float
    bands: Sequence[Band]
    solved_kN: tuple[float, ...]
    cells: tuple[CellView, ...]
    limit: str = ""
    lines: Sequence[tuple[float, str]] = ()

    @property
    def further_kN(self) -> tuple[float, ...]:
        """Loads that were solved beside the map's own."""
        return tuple(load for load in self.solved_kN if load not in {cell.load_kN for cell in self.cells})


@dataclass(frozen=True, kw_only=True)
class MapView:
    """A map as it is shown.

    Attributes
    ----------
    title, criterion
        What it shows, and within what.
    colours
        Colour of each answer.
    answers, marks, number
        What the answers that occur, the marks, and the number of a cell stand for, for the legend.
    diamond
        What a diamond stands for; empty where there is none.
    notes
        Lines below the table.
    """

    case: Case
    loads_N: tuple[float, ...]
    columns: tuple[ColumnView, ...]
    title: str
    criterion: str
    colours: Mapping[str, str]
    answers: Sequence[tuple[str, str]]
    marks: Sequence[tuple[str, str]]
    number: str
    notes: Sequence[str]
    diamond: str = ""

    @property
    def lines(self) -> list[str]:
        """What lines across columns stand for, in the order of their dashes."""
        shown = {words for column in self.columns for _, words in column.lines}
        return [words for words in YIELD_WORDS.values() if words in shown]


def part_words(used: float) -> str:
    """A part of a limit in three characters, whatever it is."""
    return f"{used:.{2 if used < 1.0 else 1 if used < 10.0 else 0}f}"
