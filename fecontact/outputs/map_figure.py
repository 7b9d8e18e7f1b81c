"""The picture of an applicability map: at which loads Hertz holds, over the lateral shift."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case
from fecontact.comparison.verdict import AT_JUNCTION
from fecontact.criteria import Criteria
from fecontact.map.cells import ApplicabilityMap, MapCell, MapPosition
from fecontact.outputs.measure_words import WORDS
from fecontact.outputs.multi_hertz import springs_help
from fecontact.outputs.roll_words import other_wheel_label, roll_words, shift_label
from fecontact.outputs.series import short_name
from fecontact.outputs.style import ANSWER_WORDS, ANSWERS, blank_figure, save_figure
from fecontact.outputs.verdict_words import inclination_words
from fecontact.profiles.identity import profile_identity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

CAUSE_LETTERS = {
    "finite bodies": "B",
    "second patch": "S",
    "second lobe": "L",
    "curvature change within the patch": "J",
    "conformity": "C",
    "curvature varies over the patch": "V",
    AT_JUNCTION: "U",
}
"""Marks of the causes in the picture."""

# Inches: of the legend, of a column of positions at its widest, between two lines of numbers at least, of the axes.
_LEGEND, _COLUMN, _LINE, _TALLEST = 3.6, 0.75, 0.19, 11.0
# A number of four characters and a letter need this many columns' inches a point of the font.
_INCHES_A_POINT = 0.055
_SMALLEST_FONT = 5.0


def map_figure(made: ApplicabilityMap, path: str | Path) -> Path:
    """Draw over lateral shift and load where Hertz holds, as PNG and as SVG.

    The load axis is linear. The colour of a column changes at the loads at which the verdict does, as far as they are
    known: a range left open between two verdicts has its own colour. Each load of the map has the largest part of a
    limit that Hertz uses (he is off from 1 on), with a letter for the cause where he does not hold; every other load
    that was solved is a tick at both sides of its column. A diamond says that he holds there at all touch points, if
    they share the load as springs. Columns that were inferred have no border. Of a symmetric wheelset the axis above is
    that of the other wheel.
    """
    shifts, loads = np.array(made.lateral_shifts_mm), np.array(made.loads_N) / 1e3
    width = float(np.clip(_COLUMN * shifts.size, 4.5, 13.0))
    figure = blank_figure(width + _LEGEND, _height(loads))
    ax = figure.add_subplot()
    bottom, top = _load_range(loads)
    font = min(9.5, width / shifts.size / _INCHES_A_POINT)
    for (left, right), position in zip(pairwise(_edges(shifts)), made.positions, strict=True):
        _draw_column(ax, position, (left, right), (bottom, top), numbered=font >= _SMALLEST_FONT)
        _draw_numbers(ax, position, 0.5 * (left + right), made.case.criteria, font)
    ax.set_xlim(*_edges(shifts)[[0, -1]])
    ax.set(ylim=(bottom, top), yticks=loads)
    ax.legend(handles=_handles(made, font), loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, fontsize=9)
    case = made.case
    rail, wheel = (short_name(profile_identity(spec)) for spec in (case.rail, case.wheel))
    title = (
        f"rail {rail}{inclination_words(case.inclination_rad)}, wheel {wheel}: where Hertz holds,\n"
        f"{roll_words(case)},\nwithin {criteria_words(case.criteria)}"
    )
    # from the left: a narrow map is shorter than its title, and the legend beside it leaves room
    ax.set_title(title, x=0.0, ha="left")
    ax.set(xlabel=shift_label(case), ylabel=f"{case.load_kind} load in kN")
    draw_other_wheel(ax, case)
    return save_figure(figure, path)


def draw_other_wheel(ax: Axes, case: Case) -> None:
    """Draw a second axis above, on which the same picture is that of the other wheel of the wheelset, if it is."""
    if label := other_wheel_label(case):
        above = ax.secondary_xaxis("top", functions=(np.negative, np.negative))
        above.set_xlabel(label)


def _height(loads: Floats) -> float:
    """Inches at which the closest loads leave a line of numbers each, within reason."""
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
    ax: Axes, position: MapPosition, sides: tuple[float, float], ends: tuple[float, float], *, numbered: bool
) -> None:
    left, right = sides
    place: dict[str, Any] = {"x": left, "width": right - left, "align": "edge", "lw": 0.0}
    intervals = position.limit.intervals
    if not intervals:
        ax.bar(bottom=ends[0], height=ends[1] - ends[0], color=ANSWERS["failed"], **place)
    for number, one in enumerate(intervals):
        # the first and the last go on to the frame: nothing is known beyond them, but it is room for words
        low = ends[0] if number == 0 else one.low_N / 1e3
        high = ends[1] if number == len(intervals) - 1 else one.high_N / 1e3
        ax.bar(bottom=low, height=high - low, color=ANSWERS[one.answer], **place)
        if number:
            ax.plot(sides, [low, low], color="k", lw=0.9, solid_capstyle="butt")
    solved = [cell.load_N / 1e3 for cell in position.cells if cell.judged is not None]
    solved += [load / 1e3 for load, _ in position.limit.tried]
    if solved:
        ax.bar(bottom=ends[0], height=ends[1] - ends[0], fill=False, ec="white", **place | {"lw": 1.2})
    tick = 0.09 * (right - left)
    # a tick beside a number looks like a minus
    with_number = {cell.load_N / 1e3 for cell in position.cells} if numbered else set()
    for load in (load for load in solved if load not in with_number):
        for start, end in ((left, left + tick), (right - tick, right)):
            ax.plot([start, end], [load, load], color="k", lw=1.0, solid_capstyle="butt")


# In the colour of what holds.
_SPRINGS: dict[str, Any] = {"ls": "none", "marker": "D", "mfc": ANSWERS["HOLDS"], "mec": "k", "mew": 0.8}


def _draw_numbers(ax: Axes, position: MapPosition, middle: float, criteria: Criteria, font: float) -> None:
    from matplotlib.transforms import ScaledTranslation

    for cell in position.cells:
        letter = "" if cell.cause is None else CAUSE_LETTERS[cell.cause]
        used = limit_used(cell, criteria)
        # three characters and the letter, whatever the number
        words = f"{used:.{2 if used < 1.0 else 1 if used < 10.0 else 0}f} {letter}"
        if cell.status not in ("converged", "inferred"):
            words = "!"
        elif font < _SMALLEST_FONT:
            words = letter
        style = "normal" if cell.solved else "italic"
        ax.text(
            *(middle, cell.load_N / 1e3, words.strip()),
            ha="center",
            va="center",
            fontsize=max(font, 6.0),
            style=style,
            weight="bold" if cell.verdict == "FAILS" else "normal",
            # a border of colours is not drawn through a number
            bbox={"fc": ANSWERS[cell.verdict], "ec": "none", "pad": 0.6},
        )
        if springs_help(cell, position.placement):
            below = ScaledTranslation(0.0, -(0.5 * font + 3.5) / 72.0, ax.figure.dpi_scale_trans)
            place = {"transform": ax.transData + below, "ms": min(font, 6.0), **_SPRINGS}
            ax.plot(middle, cell.load_N / 1e3, **place)


def limit_used(cell: MapCell, criteria: Criteria) -> float:
    """By how much the measure that uses most of its limit does so; NaN where there is none."""
    if cell.judged is not None:
        return cell.judged.limit_used
    used = [abs(value) / criteria.limits[name] for name, value in cell.deviation.items() if name in criteria.limits]
    return max(used, default=math.nan)


def _handles(made: ApplicabilityMap, font: float) -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    shown: set[str] = {one.answer for limit in made.limits for one in limit.intervals}
    shown |= {"failed" for limit in made.limits if not limit.intervals}
    handles: list[Any] = [Patch(fc=c, ec="0.4", label=ANSWER_WORDS[v]) for v, c in ANSWERS.items() if v in shown]
    words = [("$-$", "solved at this load")]
    if font >= _SMALLEST_FONT:
        words[0] = ("$-$", "further loads that were solved")
        words.append(("$0.5$", "largest part of a limit\nthat Hertz uses; off from 1 on"))
    if not all(cell.solved for cell in made.cells):
        words.append(("$i$", "italic: inferred"))
    if any(cell.status not in ("converged", "inferred") for cell in made.cells):
        words.append(("$!$", "not to be used"))
    causes = {cell.cause for cell in made.cells}
    words += [(rf"$\mathbf{{{letter}}}$", cause) for cause, letter in CAUSE_LETTERS.items() if cause in causes]
    if any(springs_help(cell, position.placement) for position in made.positions for cell in position.cells):
        label = "springs at all touch points hold"
        handles.append(Line2D([], [], ms=6, label=label, **_SPRINGS))
    return handles + [
        Line2D([], [], ls="none", marker=mark, color="k", ms=16 if mark == "$0.5$" else 8, label=label)
        for mark, label in words
    ]


def criteria_words(criteria: Criteria) -> str:
    """Measures that decide by their limits, such as "5 % p_max; 10 % area, a, b; 0.15 b centre"."""
    groups: dict[str, list[str]] = {}
    for measure, limit in criteria.limits.items():
        words = WORDS[measure]
        groups.setdefault(f"{words.factor * limit:.4g} {words.off_unit}", []).append(words.short)
    return "; ".join(f"{limit} {', '.join(names)}" for limit, names in groups.items())
