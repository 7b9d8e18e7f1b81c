"""The picture of a study over the lateral shift: peak pressures, deviations of Hertz, and touch points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.criteria import Criteria
from fecontact.errors import InputError, usable
from fecontact.outputs.case_words import SHIFT, roll_words_of_rows
from fecontact.outputs.pair_names import Row, pair_of_row
from fecontact.outputs.records.asked import asked_row
from fecontact.outputs.series import Series, series
from fecontact.outputs.style import (
    ANSWERS,
    SERIES,
    Colour,
    blank_figure,
    finish,
    legend_beside,
    save_figure,
    series_style,
)
from fecontact.outputs.verdict_words import YIELDING
from fecontact.outputs.words import WORDS, deviation_column
from fecontact.profiles.curve import Profile, radius_mm, radius_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TOUCH, _PLACE = "touch_rail_y_mm", "place in the picture"
ANSWER_MARKS = {"HOLDS": "o", "UNRESOLVED": "D", "FAILS": "X", "failed": "s"}
# Style of a row whose numbers must not be used.
_BAD: Mapping[str, Any] = {"marker": "x", "ms": 9, "mew": 2.0, "ls": "none"}


def study_figure(
    rows: Sequence[Row], path: str | Path, rail: Profile | None = None, criteria: Criteria | None = None
) -> Path:
    """Draw a study over the lateral shift: peak pressures, deviations of Hertz, and touch points on the rail.

    Where all cases have one shift, they stand side by side in their order, with what varies below each.

    With one series and one set of criteria, deviations are drawn with uncertainties for each measure that decides, in
    parts of the limit; else for peak and area, in percent. Each series has a colour and a mark; if there are more
    series than colours, they are not named. Neighbours are not joined by a line if the contact jumps between them. A
    row whose status is not `converged` is a cross without a line, at its value, or at the bottom of the first panel if
    it has no value. The junctions of `rail` are drawn beside the touch points.

    Parameters
    ----------
    criteria
        Criteria by which all rows were judged; None if there is more than one set.

    Raises
    ------
    InputError
        If there are no rows.
    """
    if not rows:
        raise InputError("study figure: there are no rows to draw")
    rows = [asked_row(row) for row in rows]
    found = series(rows)
    names: list[str] = []
    if len(rows) > 1 and len({float(row["lateral_shift_mm"]) for row in rows}) == 1:
        names = [", ".join(one.label for one in found if row in one.rows) for row in rows]
        rows = [{**row, _PLACE: number} for number, row in enumerate(rows)]
        found = (Series(rows=tuple(rows), own={}),)
    single = len(found) == 1
    figure = blank_figure(11.0, 11.0)
    peak, off, touch = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.4, 0.9))
    # more series than colours cannot be told apart
    shown = len(found) <= len(SERIES)
    for number, one in enumerate(found):
        style, group = series_style(number), one.rows
        label = f", {one.label}" if one.label and shown else ""
        # an underscore keeps a line out of the legend
        kept = "" if shown or number == 0 else "_"
        fe, hertz = f"{kept}FE{label}", f"{kept}Hertz{label}"
        of_fe: dict[str, Any] = style | ({"color": Colour.FE} if single else {})
        of_hertz: dict[str, Any] = style | ({"color": Colour.HERTZ} if single else {}) | {"ls": "--", "mfc": "white"}
        value, of_ellipse, places = (_numbers(group, name) for name in ("fe_p_max_MPa", "hertz_p_max_MPa", _TOUCH))
        unsure = 1e-2 * _numbers(group, "hertz_uncertainty_p_max_percent") * value
        _draw_series(peak, group, value, unsure, label=fe, **of_fe)
        _draw_series(peak, group, of_ellipse, label=hertz, **of_hertz)
        _draw_series(touch, group, places, **style | ({"color": "0.2"} if single else {}))
        _draw_without_value(peak, group)
        if not single or criteria is None:
            _draw_deviations(off, group, style, (f"{kept}peak{label}", f"{kept}area{label}"))
    if single and criteria is not None:
        _draw_used_limits(off, found[0].rows, criteria)
    else:
        _finish_deviations(off, criteria)
    if any(_jumps(one.rows).size for one in found):
        words: dict[str, Any] = {"transform": touch.transAxes, "fontsize": 8.5, "color": "0.35"}
        touch.text(0.008, 0.03, "lines are cut where the touch point jumps", **words)
    _draw_answers(peak, rows)
    _finish_study(peak, off, touch, rows, rail)
    if names:
        touch.set(xlabel=f"lateral shift {float(rows[0]['lateral_shift_mm']):+z.2f} mm")
        touch.set_xticks(range(len(names)), [name.replace(", ", "\n") for name in names])
    return save_figure(figure, path)


def _place(row: Row) -> float:
    """Where a case stands on the axis: at its shift, or at its number where all cases have one shift."""
    return float(row.get(_PLACE, row["lateral_shift_mm"]))


def _numbers(rows: Sequence[Row], column: str) -> Floats:
    """A column of rows, with NaN for a missing number."""
    return np.array([np.nan if row.get(column) is None else float(row[column]) for row in rows])


def _draw_deviations(ax: Axes, group: Sequence[Row], style: Mapping[str, Any], labels: tuple[str, str]) -> None:
    for measure, label, own in zip(("p_max", "area"), labels, ({"ls": "-"}, {"ls": ":", "mfc": "white"}), strict=True):
        value, unsure = (_numbers(group, f"hertz_{of}_{measure}_percent") for of in ("deviation", "uncertainty"))
        _draw_series(ax, group, value, unsure, label=label, **style, **own)


def _finish_deviations(ax: Axes, criteria: Criteria | None) -> None:
    limits = {} if criteria is None else criteria.limits
    drawn = [(limits[name], WORDS[name].short) for name in ("p_max_MPa", "area_mm2") if name in limits]
    for (limit, _), grey in zip(sorted(drawn, reverse=True), ("0.93", "0.86"), strict=False):
        ax.axhspan(-1e2 * limit, 1e2 * limit, color=grey, zorder=0)
    ax.axhline(0.0, color="0.4", lw=0.8)
    bands = ", ".join(f"{short} ±{1e2 * limit:g} %" for limit, short in drawn)
    ax.set(ylabel="Hertz against FE in %" + (f"\n(bands: {bands})" if bands else ""))


def _draw_used_limits(ax: Axes, group: Sequence[Row], criteria: Criteria) -> None:
    """Deviation of Hertz in every measure that decides, in parts of the limit, with its uncertainty."""
    for number, (measure, limit) in enumerate(criteria.limits.items()):
        column, unsure, factor = deviation_column(measure)
        used, error = (np.abs(_numbers(group, name)) / (factor * limit) for name in (column, unsure))
        _draw_series(ax, group, used, error, label=WORDS[measure].short, **series_style(number))
    ax.axhspan(0.0, 1.0, color="0.93", zorder=0)
    ax.axhline(1.0, color="0.3", lw=1.0, zorder=1)
    style: dict[str, Any] = {"transform": ax.get_yaxis_transform(), "fontsize": 8.5, "color": "0.35"}
    ax.text(0.008, 1.03, "beyond the limit", va="bottom", **style)
    ax.text(0.008, 0.97, "within the limit", va="top", **style)
    # linear within the limits, logarithmic beyond
    ax.set_yscale("symlog", linthresh=1.0, linscale=1.0)
    top = max(3.0, 1.3 * ax.get_ylim()[1])
    ax.set_ylim(0.0, top)
    ticks = [tick for tick in (0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0) if tick <= top]
    ax.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.minorticks_off()
    ax.set(ylabel="Hertz against FE:\nshare of the limit\n(logarithmic above 1)")
    # outside: so many lines leave no room for a legend
    legend_beside(ax)


def _draw_answers(ax: Axes, rows: Sequence[Row]) -> None:
    """The verdicts above the first panel, each with a colour and a mark."""
    from matplotlib.lines import Line2D

    handles = []
    for answer, colour in ANSWERS.items():
        shifts = [_place(row) for row in rows if usable(row) and row.get("verdict_answer") == answer]
        if shifts:
            style: dict[str, Any] = {"marker": ANSWER_MARKS[answer], "ms": 9, "mfc": colour, "mec": "0.2", "mew": 0.8}
            place: dict[str, Any] = {"transform": ax.get_xaxis_transform(), "clip_on": False, "ls": "none"}
            ax.plot(shifts, [1.0] * len(shifts), zorder=5, label=f"_{answer}", **style, **place)
            handles.append(Line2D([], [], ls="none", label=answer, **style))
    if handles:
        # outside, so that it never hides a verdict
        legend = ax.legend(handles=handles, fontsize=9, loc="lower left", bbox_to_anchor=(1.01, 0.0), title="Hertz")
        # the layout makes no room for a clipped artist
        ax.add_artist(legend).set_clip_on(False)


def _draw_series(ax: Axes, group: Sequence[Row], value: Floats, unsure: Floats | None = None, **style: Any) -> None:
    shift, good = np.array([_place(row) for row in group]), np.array([usable(row) for row in group])
    shown, breaks = np.where(good, value, np.nan), _jumps(group)
    # NaN breaks the line, so that nobody reads a value between a good and a bad row, or within a jump
    ax.plot(np.insert(shift, breaks, np.nan), np.insert(shown, breaks, np.nan), lw=1.6, ms=5.5, **style)
    if unsure is not None:
        ax.errorbar(shift, shown, yerr=unsure, fmt="none", ecolor=style["color"], capsize=2.5, lw=1.0)
    ax.plot(shift[~good], value[~good], color=style["color"], **_BAD)


def _jumps(group: Sequence[Row]) -> NDArray[np.int64]:
    """Numbers of the rows before which the touch point moves further than the Hertz ellipse of either row is wide."""
    touch, width = _numbers(group, _TOUCH), _numbers(group, "hertz_b_mm")
    # an unknown number (NaN) is no jump
    return 1 + np.flatnonzero(np.abs(np.diff(touch)) > np.minimum(width[1:], width[:-1]))


def _draw_without_value(ax: Axes, group: Sequence[Row]) -> None:
    lost = [_place(row) for row in group if row.get("fe_p_max_MPa") is None]
    ax.plot(lost, [0.04] * len(lost), transform=ax.get_xaxis_transform(), color="0.2", **_BAD)


def _finish_study(peak: Axes, off: Axes, touch: Axes, rows: Sequence[Row], rail: Profile | None) -> None:
    pairs = sorted({pair_of_row(row) for row in rows})
    loads = sorted({float(row["load_kN"]) for row in rows})
    title = "; ".join(pairs[:3]) + ("; ..." if len(pairs) > 3 else "")
    peak.set(ylabel="peak pressure in MPa")
    with_load = title + (f", {loads[0]:g} kN" if len(loads) == 1 else "")
    yaws = {float(row.get("yaw_mrad") or 0.0) for row in rows} - {0.0}
    turned = f"yaw {yaws.pop():+g} mrad" if len(yaws) == 1 else ""
    yields = YIELDING if any("elastic_verdict_answer" in row for row in rows) else ""
    peak.set_title("; ".join(filter(None, (with_load, roll_words_of_rows(rows), turned, yields))), pad=14)
    peak.margins(y=0.12)
    if rail is not None:
        _draw_junction_levels(touch, rail)
    touch.set(xlabel=SHIFT, ylabel="touch point on the rail\ny in mm  (gauge side negative)")
    if any(not usable(row) for row in rows):
        peak.plot([], [], color="0.2", label="not usable", **_BAD)
    for ax in (peak, off):
        if ax.get_legend_handles_labels()[0] and (ax is peak or ax.get_legend() is None):
            legend_beside(ax)
    finish(peak, off, touch)


def _draw_junction_levels(ax: Axes, rail: Profile) -> None:
    low, high = ax.get_ylim()
    room = 0.15 * (high - low) + 2.0
    shown = [junction for junction in rail.junctions if low - room < junction.y_mm < high + room]
    for junction in shown:
        ax.axhline(junction.y_mm, color=Colour.RAIL_JUNCTION, lw=1.0, ls="-.", zorder=0)
        sides = (junction.curvature_left_per_mm, junction.curvature_right_per_mm)
        radii = " | ".join(radius_text(radius_mm(one), "R{:.4g}") for one in sides)
        place: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "xytext": (0, 2), "textcoords": "offset points"}
        style: dict[str, Any] = {"ha": "right", "va": "bottom", "fontsize": 8.5, "color": Colour.RAIL_JUNCTION}
        ax.annotate(radii, (0.995, junction.y_mm), **place, **style)
    # room for the words above the highest line
    top = max([high, *(junction.y_mm + 0.5 * room for junction in shown)])
    ax.set_ylim(low - room, top + 0.5 * room)
