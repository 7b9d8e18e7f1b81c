"""Picture of a map: coloured columns over the load, a column for each lateral shift, with texts at the loads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.maps.view import CellView, ColumnView, MapView, column_width
from fecontact.maps.views import build_map_view, refuse_measure
from fecontact.maps.yaw_map import MapResult, YawMap, format_yaw, join_yaws
from fecontact.outputs.case_words import other_wheel_label, roll_words, shift_label
from fecontact.outputs.pair_names import pair_words
from fecontact.outputs.style import ANSWER_COLOURS, BETWEEN_VERDICTS, MM_PER_INCH, blank_figure, line_width, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Font size in points below which the cells have letters alone, without numbers.
_SMALLEST_FONT = 7.0
# Inches: widths of a narrow and a wide picture, width of a column, width beside the columns, least distance of two
# lines of text, smallest and largest height of the axes, and height of the title and the labels.
_NARROW, _WIDE, _COLUMN_WIDTH, _SIDES = 6.2, 7.6, 0.55, 1.0
_LINE_HEIGHT, _LEAST_HEIGHT, _LARGEST_HEIGHT, _LABELS_HEIGHT = 0.19, 2.6, 9.0, 1.3
# Inches: height of a line of the legend, and width of a picture for two columns of the legend.
_LEGEND_LINE, _TWO_COLUMNS = 0.22, 6.0
# Relative luminance of a colour below which a text on it is white.
_DARK = 0.18
# A text of the given number of characters (a % counts twice) needs this width in inches per point of the font. Longer
# texts are smaller.
_INCHES_PER_POINT, _FULL_SIZE_CHARACTERS, _COMPACT_CHARACTERS = 0.055, 6, 4
# Hatching of ranges that were not solved.
_HATCHED: dict[str, Any] = {BETWEEN_VERDICTS: {"hatch": "////", "ec": "0.7"}}
# Inches: width of a character of the title and of a small text.
_TITLE_INCHES, _SMALL_INCHES = 0.085, 0.07
_DASHES = ("--", ":")
# The diamond has the colour of a theory that holds.
_DIAMOND: dict[str, Any] = {"ls": "none", "marker": "D", "mfc": ANSWER_COLOURS["HOLDS"], "mec": "k", "mew": 0.8}


Blank: TypeAlias = "Callable[[float, float], Figure]"
"""Function that makes an empty figure of a width and a height in inches."""


@dataclass(frozen=True, kw_only=True)
class ColumnSizes:
    """Width of the axes in inches, and font sizes in points.

    Attributes
    ----------
    columns
        Number of columns side by side.
    width
        Width of all columns in inches.
    numbers
        Whether numbers are wanted.
    is_compact
        Whether the texts are short.
    """

    columns: int
    width: float
    numbers: bool = True
    is_compact: bool = False

    @property
    def font(self) -> float:
        """Font size of the texts in the columns, in points."""
        return self.font_of("")

    def font_of(self, text: str) -> float:
        """Font size with which a text fits into a column, in points.

        Parameters
        ----------
        text
            Text of the widest cell.

        Returns
        -------
        float
            Size in points, at most 9.5.
        """
        shortest = _COMPACT_CHARACTERS if self.is_compact else _FULL_SIZE_CHARACTERS
        characters = len(text) + text.count("%") if text else shortest
        return min(9.5, self.width / self.columns / _INCHES_PER_POINT * _FULL_SIZE_CHARACTERS / characters)

    @property
    def has_numbers(self) -> bool:
        """Whether the columns have numbers beside the letters: they are wanted and have room."""
        return self.numbers and self.font >= _SMALLEST_FONT


def save_map_figure(view: MapView, path: str | Path) -> Path:
    """Draw a map, as PNG and as SVG."""
    return save_figure(draw_map(view), path)


def draw_map_by_measure(
    applicability_map: MapResult, measure: str, theory: str, blank: Blank, **options: Any
) -> Figure:
    """Draw a map by a measure and a theory.

    Parameters
    ----------
    applicability_map
        Map of a single yaw.
    measure
        `pressure`, `theory`, or the name of a feature's verdict.
    theory
        Name of a theory of the pressure.
    blank
        Function that makes the empty figure.
    **options
        Further options of `draw_map`.

    Returns
    -------
    Figure
        Figure with the picture.

    Raises
    ------
    InputError
        If the measure or the theory does not exist, and for the maps of several yaws.
    """
    if isinstance(applicability_map, YawMap):
        raise InputError(
            f"these are maps at {join_yaws(applicability_map.yaws_mrad)}, and a picture shows one yaw; give one of"
            f" them, such as select_yaw({format_yaw(applicability_map.yaws_mrad[0])})"
        )
    refuse_measure(applicability_map.case, measure, theory)
    return draw_map(build_map_view(applicability_map, measure, theory), blank, **options)


def draw_map(
    view: MapView,
    blank: Blank = blank_figure,
    *,
    axes: Axes | None = None,
    width_mm: float | None = None,
    title: bool = True,
    numbers: bool = True,
) -> Figure:
    """Draw a map over lateral shift and load.

    The load axis is linear. The colour of a column changes at the loads at which the answer changes, as far as these
    loads are determined. Each load of the map has the text of its cell, without a number if the columns are too narrow
    to read it. Every other solved load is a tick at both sides of its column. For a symmetric wheelset the upper axis
    shows the other wheel.

    Parameters
    ----------
    view
        View of the map.
    blank
        Function that makes the empty figure.
    axes
        Axes for the map; a new figure is made if they are not given.
    width_mm
        Width of a new figure in mm; it follows the number of shifts if it is not given.
    title
        Whether the map has a title.
    numbers
        Whether cells have numbers where they have room.

    Returns
    -------
    Figure
        Figure with the picture.
    """
    loads = np.array(view.loads_N) / 1e3
    shifts = np.array([column.shift_mm for column in view.columns])
    width = column_width([column.shift_mm for column in view.columns])
    columns = 1 + round(float(np.ptp(shifts)) / width)
    if axes is not None:
        inches = _SIDES + axes.get_window_extent().width / axes.figure.dpi
    elif width_mm is not None:
        inches = width_mm / MM_PER_INCH
    else:
        inches = float(np.clip(_SIDES + _COLUMN_WIDTH * columns, _NARROW, _WIDE))
    sizes = ColumnSizes(columns=columns, width=inches - _SIDES, numbers=numbers, is_compact=view.is_compact)
    handles = _build_legend(view, sizes)
    if axes is None:
        legend_height = _LEGEND_LINE * (len(handles) // _count_legend_columns(inches) + 2)
        figure = blank(inches, _compute_height(loads, sizes) + _LABELS_HEIGHT + legend_height)
        ax = figure.add_subplot()
    else:
        ax = axes
    ends, reach = _compute_load_range(loads), 0.5 * width
    for shift, column in zip(shifts, view.columns, strict=True):
        sides = (shift - reach, shift + reach)
        _draw_column(ax, column, view.colours, sides, ends)
        for load, meaning in column.lines:
            if ends[0] < load < ends[1]:
                ax.plot(sides, [load, load], color="k", lw=line_width(1.6), ls=_DASHES[view.lines.index(meaning)])
        # A tick beside a number looks like a minus sign, so the map's loads have no ticks if the cells have numbers.
        _draw_ticks(ax, column.further_kN if sizes.has_numbers else column.solved_kN, sides)
        for cell in column.cells:
            _draw_text(ax, cell, _choose_colour(cell, view.colours), shift, sizes)
    ax.set_xlim(shifts[0] - reach, shifts[-1] + reach)
    ax.set(ylim=ends, yticks=loads)
    _add_words(ax, view, handles, inches, title=title)
    return ax.figure  # type: ignore[return-value]


def _add_words(ax: Axes, view: MapView, handles: Sequence[Any], inches: float, *, title: bool) -> None:
    """Add title, labels and legend to a map of a width in inches; the legend is below the map."""
    from matplotlib import rcParams, rcParamsDefault

    case, points = view.case, float(rcParams["font.size"]) / float(rcParamsDefault["font.size"])
    title_letters, small_letters = inches / (points * _TITLE_INCHES), (inches - _SIDES) / (points * _SMALL_INCHES)
    if title:
        yaw_text = "" if view.yaw_mrad is None else f", yaw {format_yaw(view.yaw_mrad)} mrad"
        words = f"{pair_words(case)}{yaw_text}: {view.title}"
        ax.set_title(_wrap_lines(words, title_letters), x=0.0, ha="left", fontsize="medium")
    ax.set_xlabel(_balance_lines(shift_label(case), small_letters), fontsize="small")
    ax.set_ylabel(f"{case.load_kind} load in kN", fontsize="small")
    if label := other_wheel_label(case):
        upper_axis = ax.secondary_xaxis("top", functions=(np.negative, np.negative))
        upper_axis.set_xlabel(_balance_lines(label, small_letters), fontsize="small")
    conditions = _wrap_lines(f"{roll_words(case)}; {view.preposition} {view.criterion}", small_letters)
    legend_style: dict[str, Any] = {
        "handles": handles,
        "ncols": _count_legend_columns(inches),
        "columnspacing": 1.0,
        "handlelength": 1.6,
        "fontsize": "small",
        "frameon": False,
        "title": conditions,
        "title_fontsize": "small",
        "alignment": "left",
    }
    if len(ax.figure.axes) == 1 and ax.figure.get_layout_engine() is not None:
        ax.figure.legend(loc="outside lower left", **legend_style)
    else:
        legend_top = -1.3 * _LABELS_HEIGHT * points * ax.figure.dpi / ax.get_window_extent().height
        ax.legend(loc="upper left", bbox_to_anchor=(0.0, legend_top), borderaxespad=0.0, **legend_style)


def _count_legend_columns(inches: float) -> int:
    """Number of columns of the legend of a picture of a width in inches."""
    return 2 if inches >= _TWO_COLUMNS else 1


def _wrap_lines(text: str, characters: float) -> str:
    """Wrap the lines of a text that are longer than a number of characters."""
    return "\n".join(
        wrapped
        for line in text.split("\n")
        for wrapped in (wrap(line, int(characters)) if len(line) > characters else [line])
    )


def _balance_lines(text: str, characters: float) -> str:
    """Wrap a centred text into lines of nearly equal lengths.

    The text has as many lines as lines with a number of characters need. No word is alone on the last line.
    """
    lines = _wrap_lines(text, characters)
    for shorter in range(int(characters), 0, -1):
        if (balanced := _wrap_lines(text, shorter)).count("\n") > lines.count("\n"):
            break
        lines = balanced
    return lines


def cell_boxes(view: MapView, figure: Figure) -> list[tuple[float, float, float, float]]:
    """Boxes of the cells of a drawn map, in percent of the picture.

    A cell reaches half way to the neighbouring loads.

    Parameters
    ----------
    view
        View of the map.
    figure
        Figure of `draw_map`, laid out.

    Returns
    -------
    list of (float, float, float, float)
        Left, top, width and height of each cell, by shift and then by load.
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


def _build_legend(view: MapView, sizes: ColumnSizes) -> list[Any]:
    """Legend of colours, lines, the diamond, ticks, numbers and letters.

    Parameters
    ----------
    view
        View of the map.
    sizes
        Sizes of the picture.

    Returns
    -------
    list
        Handles of matplotlib with their labels.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [
        Patch(fc=view.colours[answer], label=words, **({"ec": "0.4"} | _HATCHED.get(answer, {})))
        for answer, words in view.answers
    ]
    handles += [
        Line2D([], [], color="k", lw=line_width(1.6), ls=dash, label=words)
        for words, dash in zip(view.lines, _DASHES, strict=False)
    ]
    shifts = [column.shift_mm for column in view.columns]
    if any(after - before > column_width(shifts) for before, after in pairwise(shifts)):
        handles.append(Patch(fc="w", ec="0.4", label="no shift solved here"))
    if view.diamond:
        handles.append(Line2D([], [], ms=6, label=view.diamond, **_DIAMOND))
    marks = [("$-$", "solved at this load")]
    if sizes.has_numbers:
        has_further_loads = any(column.further_kN for column in view.columns)
        marks = [("$-$", "additional solved load")] * has_further_loads + [(f"${view.number_example}$", view.number)]
    return handles + [
        Line2D([], [], ls="none", marker=mark, color="k", ms=16 if any(map(str.isdigit, mark)) else 8, label=label)
        for mark, label in (*marks, *view.marks)
    ]


def _compute_height(loads: Floats, sizes: ColumnSizes) -> float:
    """Height of the axes in inches, within bounds; the closest loads have a line of text each."""
    if loads.size < 2:
        return _LEAST_HEIGHT
    bottom, top = _compute_load_range(loads)
    height = _LINE_HEIGHT * (top - bottom) / np.diff(loads).min()
    return float(np.clip(height, max(_LEAST_HEIGHT, 0.45 * sizes.width), _LARGEST_HEIGHT))


def _compute_load_range(loads: Floats) -> tuple[float, float]:
    """Range of the load axis in kN, with room for texts at both ends."""
    room = 0.08 * float(np.ptp(loads)) or 0.5
    return max(0.0, float(loads[0]) - room), float(loads[-1]) + room


def _draw_column(
    ax: Axes,
    column: ColumnView,
    colours: Mapping[str, str],
    sides: tuple[float, float],
    ends: tuple[float, float],
) -> None:
    """Draw the bands of a column, with its border if loads were solved.

    Parameters
    ----------
    ax
        Axes.
    column
        View of the column.
    colours
        Colour of each answer.
    sides
        Left and right end of the column, in mm.
    ends
        Range of the load axis, in kN.
    """
    left, right = sides
    rectangle: dict[str, Any] = {"x": left, "width": right - left, "align": "edge", "lw": 0.0}
    if not column.bands:
        ax.bar(bottom=ends[0], height=ends[1] - ends[0], color=colours["failed"], **rectangle)
    for number, (low, high, answer) in enumerate(column.bands):
        # The first and the last band extend to the frame. Nothing is determined there, but the texts need the room.
        bottom = ends[0] if number == 0 else low
        top = ends[1] if number == len(column.bands) - 1 else high
        ax.bar(bottom=bottom, height=top - bottom, color=colours[answer], **rectangle, **_HATCHED.get(answer, {}))
        if number:
            ax.plot(sides, [low, low], color="k", lw=line_width(0.9), solid_capstyle="butt")
    if column.solved_kN:
        ax.bar(bottom=ends[0], height=ends[1] - ends[0], fill=False, ec="white", **rectangle | {"lw": line_width(1.2)})


def _draw_ticks(ax: Axes, loads_kN: Sequence[float], sides: tuple[float, float]) -> None:
    """Draw a tick at both sides of a column for each load."""
    left, right = sides
    tick = 0.09 * (right - left)
    for load in loads_kN:
        for start, end in ((left, left + tick), (right - tick, right)):
            ax.plot([start, end], [load, load], color="k", lw=line_width(1.0), solid_capstyle="butt")


def _choose_colour(cell: CellView, colours: Mapping[str, str]) -> str:
    """Colour of a cell: of its answer, or of the fraction of profile variants on which an unresolved verdict holds."""
    if cell.share is None:
        return colours[cell.answer]
    from matplotlib.colors import LinearSegmentedColormap, to_hex

    ends = [colours[answer] for answer in ("FAILS", "UNRESOLVED", "HOLDS")]
    return to_hex(LinearSegmentedColormap.from_list("share", ends)(cell.share))


def _is_dark(colour: str) -> bool:
    """Whether a colour is too dark for a black text (relative luminance of WCAG 2.1)."""
    from matplotlib.colors import to_rgb

    linear = np.array(
        [value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4 for value in to_rgb(colour)]
    )
    return bool(linear @ (0.2126, 0.7152, 0.0722) < _DARK)


def _draw_text(ax: Axes, cell: CellView, colour: str, shift_mm: float, sizes: ColumnSizes) -> None:
    """Draw the text of a cell on its colour.

    The colour hides the borders of bands behind the text."""
    from matplotlib.transforms import ScaledTranslation

    text = cell.text if sizes.has_numbers else cell.letter
    ax.text(
        *(shift_mm, cell.load_kN, text),
        ha="center",
        va="center",
        fontsize=max(sizes.font_of(text), 6.0),
        weight="bold" if cell.bold else "normal",
        color="w" if _is_dark(colour) else "k",
        bbox={"fc": colour, "ec": "none", "pad": 0.6},
    )
    if cell.diamond:
        offset = ScaledTranslation(0.0, -(0.5 * sizes.font + 3.5) / 72.0, ax.figure.dpi_scale_trans)
        ax.plot(shift_mm, cell.load_kN, transform=ax.transData + offset, ms=min(sizes.font, 6.0), **_DIAMOND)
