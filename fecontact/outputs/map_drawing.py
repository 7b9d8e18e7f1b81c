"""How every picture of a map is drawn: coloured columns over the load, one a lateral shift, with words at the loads."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case
from fecontact.outputs.roll_words import other_wheel_label, shift_label
from fecontact.outputs.style import ANSWERS, blank_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

SMALLEST_FONT = 5.0
"""Points below which no numbers are written, letters alone."""
# Inches: of the legend, of a column of positions at its widest, between two lines of words at least, of the axes.
_LEGEND, _COLUMN, _LINE, _TALLEST = 3.6, 0.75, 0.19, 11.0
# A number of four characters and a letter need this many columns' inches a point of the font.
_INCHES_A_POINT = 0.055
DIAMOND: dict[str, Any] = {"ls": "none", "marker": "D", "mfc": ANSWERS["HOLDS"], "mec": "k", "mew": 0.8}
"""In the colour of what holds."""


@dataclass(frozen=True, kw_only=True)
class Words:
    """What is written at a load.

    Attributes
    ----------
    text, letter
        With its number, and where there is no room for numbers.
    colour
        Of the answer at this load, on which it is written: a border of colours is not drawn through it.
    bold
        For what does not hold.
    diamond
        Whether there is a diamond below.
    """

    load_kN: float
    text: str
    letter: str
    colour: str
    bold: bool = False
    diamond: bool = False


@dataclass(frozen=True, kw_only=True)
class Column:
    """A lateral shift over the loads.

    Attributes
    ----------
    bands
        Smallest and largest load (kN) and colour, by increasing load; none where nothing is known.
    solved_kN
        Loads that were solved, which have a tick each where no number is; without any there is no border.
    """

    shift_mm: float
    bands: tuple[tuple[float, float, str], ...]
    solved_kN: tuple[float, ...]
    words: tuple[Words, ...]


@dataclass(frozen=True)
class Sizes:
    """Inches of the axes' width, and points of the words, for so many columns."""

    columns: int

    @property
    def width(self) -> float:
        """Of the axes."""
        return float(np.clip(_COLUMN * self.columns, 4.5, 13.0))

    @property
    def font(self) -> float:
        """Of the words in the columns."""
        return min(9.5, self.width / self.columns / _INCHES_A_POINT)


def draw_columns(
    case: Case, loads_N: Sequence[float], columns: Sequence[Column], *, title: str, handles: Sequence[Any]
) -> Figure:
    """Draw a map; its load axis is linear, and the axis above a symmetric wheelset is that of the other wheel."""
    sizes, loads = Sizes(len(columns)), np.array(loads_N) / 1e3
    shifts = np.array([column.shift_mm for column in columns])
    figure = blank_figure(sizes.width + _LEGEND, _height(loads))
    ax = figure.add_subplot()
    ends = _load_range(loads)
    for sides, column in zip(pairwise(_edges(shifts)), columns, strict=True):
        # a tick beside a number looks like a minus
        numbered = {words.load_kN for words in column.words} if sizes.font >= SMALLEST_FONT else set()
        _draw_column(ax, column, sides, ends, ticks=[load for load in column.solved_kN if load not in numbered])
        for words in column.words:
            _write(ax, words, 0.5 * (sides[0] + sides[1]), sizes.font)
    ax.set_xlim(*_edges(shifts)[[0, -1]])
    ax.set(ylim=ends, yticks=loads)
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, fontsize=9)
    # from the left: a narrow map is shorter than its title, and the legend beside it leaves room
    ax.set_title(title, x=0.0, ha="left")
    ax.set(xlabel=shift_label(case), ylabel=f"{case.load_kind} load in kN")
    if label := other_wheel_label(case):
        above = ax.secondary_xaxis("top", functions=(np.negative, np.negative))
        above.set_xlabel(label)
    return figure


def first_marks(font: float, number: str) -> list[tuple[str, str]]:
    """What ticks and numbers stand for, `number` in words, where there is room for numbers."""
    if font < SMALLEST_FONT:
        return [("$-$", "solved at this load")]
    return [("$-$", "further loads that were solved"), ("$0.5$", number)]


def mark_handles(marks: Sequence[tuple[str, str]]) -> list[Any]:
    """What marks stand for, for the legend."""
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], ls="none", marker=mark, color="k", ms=16 if any(map(str.isdigit, mark)) else 8, label=label)
        for mark, label in marks
    ]


def colour_handles(colours: Sequence[tuple[str, str]]) -> list[Any]:
    """What colours stand for, for the legend."""
    from matplotlib.patches import Patch

    return [Patch(fc=colour, ec="0.4", label=label) for colour, label in colours]


def _height(loads: Floats) -> float:
    """Inches at which the closest loads leave a line of words each, within reason."""
    if loads.size < 2:
        return 4.0
    bottom, top = _load_range(loads)
    return float(np.clip(_LINE * (top - bottom) / np.diff(loads).min(), 4.6, _TALLEST)) + 1.6


def _load_range(loads: Floats) -> tuple[float, float]:
    """Range of the load axis: some room beyond the smallest and the largest load for what is written at them."""
    room = 0.04 * float(np.ptp(loads)) or 0.5
    return max(0.0, float(loads[0]) - room), float(loads[-1]) + room


def _edges(centres: Floats) -> Floats:
    """Edges of columns half way between their centres, the outermost as near as the closest; a single one is 1 wide."""
    reach = 0.5 * float(np.diff(centres).min(initial=math.inf)) if centres.size > 1 else 0.5
    return np.concatenate([[centres[0] - reach], 0.5 * (centres[:-1] + centres[1:]), [centres[-1] + reach]])


def _draw_column(
    ax: Axes, column: Column, sides: tuple[float, float], ends: tuple[float, float], *, ticks: Sequence[float]
) -> None:
    left, right = sides
    place: dict[str, Any] = {"x": left, "width": right - left, "align": "edge", "lw": 0.0}
    if not column.bands:
        ax.bar(bottom=ends[0], height=ends[1] - ends[0], color=ANSWERS["failed"], **place)
    for number, (low, high, colour) in enumerate(column.bands):
        # the first and the last go on to the frame: nothing is known beyond them, but it is room for words
        bottom = ends[0] if number == 0 else low
        top = ends[1] if number == len(column.bands) - 1 else high
        ax.bar(bottom=bottom, height=top - bottom, color=colour, **place)
        if number:
            ax.plot(sides, [low, low], color="k", lw=0.9, solid_capstyle="butt")
    if column.solved_kN:
        ax.bar(bottom=ends[0], height=ends[1] - ends[0], fill=False, ec="white", **place | {"lw": 1.2})
    tick = 0.09 * (right - left)
    for load in ticks:
        for start, end in ((left, left + tick), (right - tick, right)):
            ax.plot([start, end], [load, load], color="k", lw=1.0, solid_capstyle="butt")


def _write(ax: Axes, words: Words, middle: float, font: float) -> None:
    from matplotlib.transforms import ScaledTranslation

    ax.text(
        *(middle, words.load_kN, words.letter if font < SMALLEST_FONT else words.text),
        ha="center",
        va="center",
        fontsize=max(font, 6.0),
        weight="bold" if words.bold else "normal",
        bbox={"fc": words.colour, "ec": "none", "pad": 0.6},
    )
    if words.diamond:
        below = ScaledTranslation(0.0, -(0.5 * font + 3.5) / 72.0, ax.figure.dpi_scale_trans)
        ax.plot(middle, words.load_kN, transform=ax.transData + below, ms=min(font, 6.0), **DIAMOND)
