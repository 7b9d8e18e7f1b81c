"""What a map shows, as a value that one table and one picture draw, whatever it shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fecontact.case import Case

Band = tuple[float, float, str]
"""Smallest and largest load (kN) of a stretch, and its answer."""


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
        In the table.
    bold
        For what does not hold.
    diamond
        Whether there is a diamond below it.
    out_of_range
        Whether the theory that is the answer is out of its own range.
    """

    load_kN: float
    answer: str
    text: str
    letter: str
    printed: str
    bold: bool = False
    diamond: bool = False
    out_of_range: bool = False


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
        """Loads that were solved beside those of the map."""
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
    lines
        What lines across columns stand for, in the order of their dashes.
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
    lines: Sequence[str] = ()


def part_words(used: float) -> str:
    """A part of a limit in three characters, whatever it is."""
    return f"{used:.{2 if used < 1.0 else 1 if used < 10.0 else 0}f}"
