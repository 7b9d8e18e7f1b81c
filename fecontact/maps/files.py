"""The files of a map: tables, JSON and pictures; and a map on the terminal."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.feature_registry import offered
from fecontact.files import write_sealed
from fecontact.maps.model import ApplicabilityMap
from fecontact.maps.telling import judged_row, law_row, map_record, stiffness_rows
from fecontact.maps.theory_views import laws_judged
from fecontact.maps.view import CellView, ColumnView, MapView, column_width
from fecontact.maps.views import map_view, refuse_measure, views_of
from fecontact.outputs.alone import ordered
from fecontact.outputs.case_words import other_wheel_label, roll_words, shift_label
from fecontact.outputs.flat_records import Record
from fecontact.outputs.pair_names import pair_words
from fecontact.outputs.style import ANSWERS, BETWEEN, blank_figure, save_figure
from fecontact.outputs.tables import write_csv

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# --- The picture of a map: coloured columns over the load, one a lateral shift, with words at the loads.

# Points below which no numbers are written, letters alone.
_SMALLEST_FONT = 5.0
# Inches: of the legend, of a column of positions at its widest, between two lines of words at least, of the axes.
_LEGEND, _COLUMN, _LINE, _TALLEST = 3.6, 0.75, 0.19, 11.0
# So many characters, of which a % counts twice, need this many columns' inches a point of the font; more are smaller.
_INCHES_A_POINT, _CHARACTERS = 0.055, 6
# What was not solved.
_HATCHED: dict[str, Any] = {BETWEEN: {"hatch": "////", "ec": "0.7"}}
_DASHES = ("--", ":")
# In the colour of what holds.
_DIAMOND: dict[str, Any] = {"ls": "none", "marker": "D", "mfc": ANSWERS["HOLDS"], "mec": "k", "mew": 0.8}


Blank: TypeAlias = "Callable[[float, float], Figure]"
"""Makes an empty figure of a width and a height in inches."""


@dataclass(frozen=True)
class Sizes:
    """Inches of the axes' width, and points of the words, for so many columns side by side."""

    columns: int

    @property
    def width(self) -> float:
        """Of the axes."""
        return float(np.clip(_COLUMN * self.columns, 4.5, 13.0))

    @property
    def font(self) -> float:
        """Of the words in the columns."""
        return self.font_of("")

    def font_of(self, text: str) -> float:
        """Of words in a column, which they do not leave."""
        characters = max(_CHARACTERS, len(text) + text.count("%"))
        return min(9.5, self.width / self.columns / _INCHES_A_POINT * _CHARACTERS / characters)

    @property
    def has_numbers(self) -> bool:
        """Whether there is room for numbers beside the letters."""
        return self.font >= _SMALLEST_FONT


def map_figure(view: MapView, path: str | Path) -> Path:
    """Draw a map, as PNG and as SVG."""
    return save_figure(draw_map(view), path)


def figure_of(made: ApplicabilityMap, measure: str, theory: str, blank: Blank) -> Figure:
    """Draw a map by a measure and a theory.

    Raises
    ------
    InputError
        For a measure or a theory that there is not.
    """
    refuse_measure(made.case, measure, theory)
    return draw_map(map_view(made, measure, theory), blank)


def draw_map(view: MapView, blank: Blank = blank_figure) -> Figure:
    """Draw a map over lateral shift and load into a figure of `blank`.

    The load axis is linear. The colour of a column changes at the loads at which the answer does, as far as they are
    known. Each load of the map has the words of its cell; every other load that was solved is a tick at both sides of
    its column. For a symmetric wheelset the axis above shows the other wheel.
    """
    case, loads = view.case, np.array(view.loads_N) / 1e3
    shifts = np.array([column.shift_mm for column in view.columns])
    width = column_width([column.shift_mm for column in view.columns])
    sizes = Sizes(1 + round(float(np.ptp(shifts)) / width))
    figure = blank(sizes.width + _LEGEND, _height(loads))
    ax = figure.add_subplot()
    ends, reach = _load_range(loads), 0.5 * width
    for middle, column in zip(shifts, view.columns, strict=True):
        sides = (middle - reach, middle + reach)
        _draw_column(ax, column, view.colours, sides, ends)
        for load, words in column.lines:
            if ends[0] < load < ends[1]:
                ax.plot(sides, [load, load], color="k", lw=1.6, ls=_DASHES[view.lines.index(words)])
        # a tick beside a number looks like a minus
        _draw_ticks(ax, column.further_kN if sizes.has_numbers else column.solved_kN, sides)
        for cell in column.cells:
            _write(ax, cell, _colour(cell, view.colours), middle, sizes)
    ax.set_xlim(shifts[0] - reach, shifts[-1] + reach)
    ax.set(ylim=ends, yticks=loads)
    ax.legend(
        handles=_handles(view, sizes), loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, fontsize=9
    )
    # from the left: a narrow map is shorter than its title, and the legend beside it leaves room
    title = f"{pair_words(case)}, {roll_words(case)}:\n{view.title},\nwithin {view.criterion}"
    ax.set_title(title, x=0.0, ha="left")
    ax.set(xlabel=shift_label(case), ylabel=f"{case.load_kind} load in kN")
    if label := other_wheel_label(case):
        above = ax.secondary_xaxis("top", functions=(np.negative, np.negative))
        above.set_xlabel(label)
    return figure


def cell_boxes(view: MapView, figure: Figure) -> list[tuple[float, float, float, float]]:
    """Left, top, width and height of each cell of a drawn map, in percent of the picture, by shift and then by load.

    A cell reaches half the way to the loads beside it.
    """
    (ax,) = figure.axes[:1]
    frame, (left, right), ends = ax.get_position(), ax.get_xlim(), ax.get_ylim()
    per_mm, per_kN = 100.0 * frame.width / (right - left), 100.0 * frame.height / (ends[1] - ends[0])
    reach = 0.5 * column_width([column.shift_mm for column in view.columns])
    boxes = []
    for column in view.columns:
        loads = [cell.load_kN for cell in column.cells]
        edges = [ends[0], *(0.5 * (low + top) for low, top in pairwise(loads)), ends[1]]
        x = 100.0 * frame.x0 + per_mm * (column.shift_mm - reach - left)
        for low, top in pairwise(edges):
            y = 100.0 * (1.0 - frame.y1) + per_kN * (ends[1] - top)
            boxes.append((round(x, 2), round(y, 2), round(2.0 * reach * per_mm, 2), round(per_kN * (top - low), 2)))
    return boxes


def _handles(view: MapView, sizes: Sizes) -> list[Any]:
    """What colours, the diamond, ticks, numbers and letters stand for."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [
        Patch(fc=view.colours[answer], label=words, **({"ec": "0.4"} | _HATCHED.get(answer, {})))
        for answer, words in view.answers
    ]
    handles += [
        Line2D([], [], color="k", lw=1.6, ls=dash, label=words)
        for words, dash in zip(view.lines, _DASHES, strict=False)
    ]
    shifts = [column.shift_mm for column in view.columns]
    if any(after - before > column_width(shifts) for before, after in pairwise(shifts)):
        handles.append(Patch(fc="w", ec="0.4", label="no shift was solved here"))
    if view.diamond:
        handles.append(Line2D([], [], ms=6, label=view.diamond, **_DIAMOND))
    marks = [("$-$", "solved at this load")]
    if sizes.has_numbers:
        further = any(column.further_kN for column in view.columns)
        marks = [("$-$", "further loads that were solved")] * further + [("$0.5$", view.number)]
    return handles + [
        Line2D([], [], ls="none", marker=mark, color="k", ms=16 if any(map(str.isdigit, mark)) else 8, label=label)
        for mark, label in (*marks, *view.marks)
    ]


def _height(loads: Floats) -> float:
    """Inches at which the closest loads leave a line of words each, within reason."""
    if loads.size < 2:
        return 4.0
    bottom, top = _load_range(loads)
    return float(np.clip(_LINE * (top - bottom) / np.diff(loads).min(), 4.6, _TALLEST)) + 1.6


def _load_range(loads: Floats) -> tuple[float, float]:
    """Range of the load axis: some room beyond the smallest and the largest load for what is written at them."""
    room = 0.05 * float(np.ptp(loads)) or 0.5
    return max(0.0, float(loads[0]) - room), float(loads[-1]) + room


def _draw_column(
    ax: Axes,
    column: ColumnView,
    colours: Mapping[str, str],
    sides: tuple[float, float],
    ends: tuple[float, float],
) -> None:
    left, right = sides
    place: dict[str, Any] = {"x": left, "width": right - left, "align": "edge", "lw": 0.0}
    if not column.bands:
        ax.bar(bottom=ends[0], height=ends[1] - ends[0], color=colours["failed"], **place)
    for number, (low, high, answer) in enumerate(column.bands):
        # the first and the last go on to the frame: nothing is known beyond them, but it is room for words
        bottom = ends[0] if number == 0 else low
        top = ends[1] if number == len(column.bands) - 1 else high
        ax.bar(bottom=bottom, height=top - bottom, color=colours[answer], **place, **_HATCHED.get(answer, {}))
        if number:
            ax.plot(sides, [low, low], color="k", lw=0.9, solid_capstyle="butt")
    if column.solved_kN:
        ax.bar(bottom=ends[0], height=ends[1] - ends[0], fill=False, ec="white", **place | {"lw": 1.2})


def _draw_ticks(ax: Axes, loads_kN: Sequence[float], sides: tuple[float, float]) -> None:
    left, right = sides
    tick = 0.09 * (right - left)
    for load in loads_kN:
        for start, end in ((left, left + tick), (right - tick, right)):
            ax.plot([start, end], [load, load], color="k", lw=1.0, solid_capstyle="butt")


def _colour(cell: CellView, colours: Mapping[str, str]) -> str:
    """Colour of a cell: of its answer, or of the share of lines on which an open verdict holds."""
    if cell.share is None:
        return colours[cell.answer]
    from matplotlib.colors import LinearSegmentedColormap, to_hex

    ends = [colours[answer] for answer in ("FAILS", "UNRESOLVED", "HOLDS")]
    return to_hex(LinearSegmentedColormap.from_list("share", ends)(cell.share))


def _write(ax: Axes, cell: CellView, colour: str, middle: float, sizes: Sizes) -> None:
    """A cell's words on its colour, so that a border of colours is not drawn through them."""
    from matplotlib.transforms import ScaledTranslation

    text = cell.text if sizes.has_numbers else cell.letter
    ax.text(
        *(middle, cell.load_kN, text),
        ha="center",
        va="center",
        fontsize=max(sizes.font_of(text), 6.0),
        weight="bold" if cell.bold else "normal",
        bbox={"fc": colour, "ec": "none", "pad": 0.6},
    )
    if cell.diamond:
        below = ScaledTranslation(0.0, -(0.5 * sizes.font + 3.5) / 72.0, ax.figure.dpi_scale_trans)
        ax.plot(middle, cell.load_kN, transform=ax.transData + below, ms=min(sizes.font, 6.0), **_DIAMOND)


# --- The files of a map: tables, JSON and pictures.


def write_map(
    made: ApplicabilityMap,
    out: Path,
    name: str = "map",
    *,
    theory: str = HERTZ,
    provenance: Record | None = None,
    drawn: bool = True,
) -> None:
    """Write a map's tables and pictures into a folder.

    NAME.csv, NAME.json, NAME.png (Hertz) and NAME_theory.png (the cheapest theory of the pressure that holds); of
    another `theory` NAME_THEORY.png; a picture of each verdict of a feature (`MAPS`) that the case asks for; a table
    and a picture of its laws (`LAWS`), where they were judged. For the whole map contacts.csv, lines of a contact table
    with the theory to use, and stiffness.csv, if it has any.
    """
    write_csv(made.rows(), out / f"{name}.csv")
    if name == "map":
        lines = [judged_row(cell, position.placement) for position in made.positions for cell in position.cells]
        write_csv(ordered(lines), out / "contacts.csv")
        stiffness = [row for position in made.positions for row in stiffness_rows(position)]
        if stiffness:
            write_csv(stiffness, out / "stiffness.csv")
        else:
            # one of other loads would not belong to this map
            (out / "stiffness.csv").unlink(missing_ok=True)
    write_sealed(out / f"{name}.json", map_record(made, provenance), [out / f"{name}.csv"])
    if not (drawn and made.positions):
        return
    # pictures of another friction, or of theories before, would not belong to this map
    for old in (*offered("MAPS"), *offered("LAWS"), *THEORIES):
        for ending in ("png", "svg", "csv"):
            (out / f"{name}_{old}.{ending}").unlink(missing_ok=True)
    for of, view in views_of(made, theory).items():
        map_figure(view, out / f"{name}{of and f'_{of}'}.png")
    for of, laws in laws_judged(made).items():
        write_csv([law_row(cell, laws) for cell in made.cells], out / f"{name}_{of}.csv")
