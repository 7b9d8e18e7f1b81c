"""Views of a map for pictures and texts: cells, columns, and bands over the load."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from fecontact.case import Case
from fecontact.maps.model import FIRST_YIELD, PLASTIC_LIMIT

Band = tuple[float, float, str]
"""Smallest and largest load (kN) of a stretch of loads, and its answer."""
# Columns farther apart than the first value (mm) have gaps between them. Their width is the second value as a fraction
# of the step, at most the third value (mm).
CLOSE_SHIFTS_MM, _WIDTH_PER_STEP, _LARGEST_WIDTH_MM = 0.5, 0.7, 1.0

YIELD_WORDS: Mapping[str, str] = {
    FIRST_YIELD: "first yield of virgin steel",
    PLASTIC_LIMIT: "yielding alone reaches a limit\nat first loading",
}


def column_width(shifts_mm: Sequence[float]) -> float:
    """Width of every column of a map, in mm.

    The width is the smallest step between two shifts. Larger steps leave gaps, because the result at a shift says
    nothing about shifts that are farther away than its usual neighbours.

    Parameters
    ----------
    shifts_mm
        Lateral shifts in mm, increasing.

    Returns
    -------
    float
        Width in mm; 1 for a single shift.
    """
    step = min((after - before for before, after in pairwise(shifts_mm)), default=math.inf)
    if not math.isfinite(step):
        return 1.0
    return step if step <= CLOSE_SHIFTS_MM else min(max(CLOSE_SHIFTS_MM, _WIDTH_PER_STEP * step), _LARGEST_WIDTH_MM)


@dataclass(frozen=True, kw_only=True)
class CellView:
    """View of a position under a load.

    Attributes
    ----------
    load_kN
        Load in kN.
    answer
        Key of the view's colours.
    text, letter
        Text in the picture with a number, and text without space for numbers.
    printed
        Text in the table; empty if the table has `text`.
    bold
        Whether the text is bold, as for a theory that does not hold.
    diamond
        Whether a diamond is drawn below the text.
    out_of_range
        Whether the theory of the answer is outside its range.
    share
        Fraction of the profile variants on which the theory holds; None if the verdict does not depend on the variant.
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
    """View of a lateral shift over the loads.

    Attributes
    ----------
    shift_mm
        Lateral shift in mm.
    bands
        Smallest and largest load (kN) and answer of each stretch of loads, by increasing load; empty without results.
    solved_kN
        Loads that were solved, in kN. Without these loads the column has no border.
    cells
        Views of the cells, by increasing load.
    limit
        Loads at which the theory holds, in words; empty for a map without limits.
    lines
        Loads (kN) of lines across the column, with the meaning of each line.
    """

    shift_mm: float
    bands: Sequence[Band]
    solved_kN: tuple[float, ...]
    cells: tuple[CellView, ...]
    limit: str = ""
    lines: Sequence[tuple[float, str]] = ()

    @property
    def further_kN(self) -> tuple[float, ...]:
        """Solved loads (kN) in addition to the map's loads."""
        return tuple(load for load in self.solved_kN if load not in {cell.load_kN for cell in self.cells})


@dataclass(frozen=True, kw_only=True)
class MapView:
    """View of a map.

    Attributes
    ----------
    case, loads_N, columns
        Base case, loads in N, and columns by increasing shift.
    title, criterion, preposition
        Title, and limits within which a theory holds, or conditions at which a number is valid.
    colours
        Colour of each answer.
    answers, marks, number
        Legend: meaning of the occurring answers, of the marks, and of the number in a cell.
    diamond
        Meaning of a diamond; empty without diamonds.
    notes
        Lines below the table.
    yaw_mrad
        Yaw in the title of the picture; None for a title without a yaw.
    number_example
        Number that stands for the numbers of the cells in the legend.
    is_compact
        Whether the texts of cells are so short that the picture of many shifts can be narrower.
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
    yaw_mrad: float | None = None
    number_example: str = "0.5"
    is_compact: bool = False
    preposition: str = "within"

    @property
    def lines(self) -> list[str]:
        """Meanings of the lines across columns, in the order of their dashes."""
        meanings = {words for column in self.columns for _, words in column.lines}
        return [words for words in YIELD_WORDS.values() if words in meanings]


def format_utilisation(utilisation: float) -> str:
    """Limit utilisation as a text of three characters, or more from 1000."""
    return f"{utilisation:.{2 if utilisation < 1.0 else 1 if utilisation < 10.0 else 0}f}"
