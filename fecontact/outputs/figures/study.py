"""Picture of a study over the lateral shift: peak pressures, deviations of Hertz, contact points."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.criteria import Criteria
from fecontact.errors import InputError, is_usable_status
from fecontact.outputs.case_words import SHIFT_LABEL, roll_words_of_rows
from fecontact.outputs.pair_names import VARIED_COLUMN, RowMapping, row_pair_text
from fecontact.outputs.records.asked import requested_row
from fecontact.outputs.series import Series, split_into_series
from fecontact.outputs.style import (
    ANSWER_COLOURS,
    SERIES_COLOURS,
    Colour,
    add_grid,
    add_legend_beside,
    blank_figure,
    line_width,
    save_figure,
    series_style,
)
from fecontact.outputs.verdict_words import AGAINST_YIELDING_BODIES
from fecontact.outputs.words import MEASURE_WORDS, deviation_columns
from fecontact.profiles.curve import Profile, format_radius, invert_curvature_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.transforms import Transform

_TOUCH_COLUMN, _PLACE_COLUMN = "contact_rail_y_mm", "place in the picture"
ANSWER_MARKS = {"HOLDS": "o", "UNRESOLVED": "D", "FAILS": "X", "failed": "s"}
# Style of an unusable row.
_UNUSABLE_STYLE: Mapping[str, Any] = {"marker": "x", "ms": 9, "mew": 2.0, "ls": "none"}
# Form of the lines of a quantity.
_FORM_STYLES: Mapping[str, Mapping[str, Any]] = {
    "fe": {"ls": "-"},
    "hertz": {"ls": "--", "mfc": "white"},
    "p_max": {"ls": "-"},
    "area": {"ls": ":", "mfc": "white"},
}
# Distance between the rows of verdicts of two series in points.
_ANSWER_ROW_POINTS = 12.0
# A longer title is wrapped.
_TITLE_LETTERS = 95


def draw_study(
    rows: Sequence[RowMapping], path: str | Path, rail: Profile | None = None, criteria: Criteria | None = None
) -> Path:
    """Draw a study over the lateral shift: peak pressures, deviations of Hertz, and contact points on the rail.

    If all cases have one shift, they are placed side by side in their order, with the varied inputs below each case.

    With one series and one set of criteria, deviations are drawn with uncertainties for each deciding measure, as a
    fraction of the limit. If not, they are drawn for peak and area, in percent. Each series has a colour and a mark. If
    there are more series than colours, they are not named. Neighbours are not joined by a line if the contact jumps
    between them. A row with a status other than `converged` is a cross without a line, at its value, or at the bottom
    of the first panel if it has no value. The junctions of `rail` are drawn at the contact points.

    Parameters
    ----------
    rows
        Rows of a study.
    path
        File of the picture.
    rail
        Only rail of the study; None if there are several rails.
    criteria
        Criteria by which all rows were judged; None if there are several sets.

    Returns
    -------
    Path
        The given path.

    Raises
    ------
    InputError
        If there are no rows.
    """
    if not rows:
        raise InputError("study figure: no rows; give at least one row")
    rows = [requested_row(row) for row in rows]
    all_series = split_into_series(rows)
    case_names: list[str] = []
    case_labels: list[Mapping[str, str]] = []
    if len(rows) > 1 and len({float(row["lateral_shift_mm"]) for row in rows}) == 1:
        case_names = [", ".join(series_.label for series_ in all_series if row in series_.rows) for row in rows]
        case_labels = [series_.labels for series_ in all_series]
        rows = [{**row, _PLACE_COLUMN: number} for number, row in enumerate(rows)]
        all_series = (Series(rows=tuple(rows), labels={}),)
    is_single = len(all_series) == 1
    figure = blank_figure(11.0, 11.0)
    peak_axes, deviation_axes, touch_axes = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.4, 0.9))
    # more series than colours cannot be distinguished
    is_labelled = len(all_series) <= len(SERIES_COLOURS)
    for number, series_ in enumerate(all_series):
        style, group = series_style(number), series_.rows
        fe_style: dict[str, Any] = style | ({"color": Colour.FE} if is_single else {})
        hertz_style: dict[str, Any] = (
            style | ({"color": Colour.HERTZ} if is_single else {}) | dict(_FORM_STYLES["hertz"])
        )
        fe_value, hertz_value, touch_places = (
            _read_numbers(group, name) for name in ("fe_p_max_MPa", "hertz_p_max_MPa", _TOUCH_COLUMN)
        )
        uncertainty = 1e-2 * _read_numbers(group, "hertz_uncertainty_p_max_percent") * fe_value
        fe_label, hertz_label = ("finite elements", "Hertz") if is_single else (None, None)
        _draw_series(peak_axes, group, fe_value, uncertainty, label=fe_label, **fe_style)
        _draw_series(peak_axes, group, hertz_value, label=hertz_label, **hertz_style)
        _draw_series(touch_axes, group, touch_places, **style | ({"color": "0.2"} if is_single else {}))
        _draw_without_value(peak_axes, group)
        if not is_single or criteria is None:
            _draw_deviations(deviation_axes, group, style, is_single)
    if is_single and criteria is not None:
        _draw_used_limits(deviation_axes, all_series[0].rows, criteria)
    else:
        _finish_deviations(deviation_axes, criteria)
    if any(_find_jumps(series_.rows).size for series_ in all_series):
        # above the panel, where it covers no curve
        hint = "curves are interrupted where the contact point jumps"
        touch_axes.set_title(hint, loc="left", fontsize="small", color="0.35")
    _draw_answers(peak_axes, [series_.rows for series_ in all_series] if is_labelled else [rows])
    labels = [series_.label for series_ in all_series] if is_labelled else []
    _finish_study((peak_axes, deviation_axes, touch_axes), rows, rail, labels)
    if case_names:
        varied_words = dict.fromkeys(_varied_words(column) for labels in case_labels for column in labels)
        shift_words = f"lateral shift of {float(rows[0]['lateral_shift_mm']):+z.2f} mm"
        touch_axes.set(xlabel=f"{', '.join(varied_words)} at a {shift_words}" if varied_words else shift_words)
        touch_axes.set_xticks(range(len(case_names)), [name.replace(", ", "\n") for name in case_names])
    return save_figure(figure, path)


def _varied_words(column: str) -> str:
    """Words for a varied input on an axis, such as "load" for `load_kN`."""
    if column == VARIED_COLUMN:
        return "varied input"
    return (column.rpartition("_")[0] or column).replace("_", " ")


def _axis_place(row: RowMapping) -> float:
    """Place of a case on the axis over the shift.

    It is the shift, or the number of the case if all cases have one shift.
    """
    return float(row.get(_PLACE_COLUMN, row["lateral_shift_mm"]))


def _read_numbers(rows: Sequence[RowMapping], column: str) -> Floats:
    """Column of rows as an array, with NaN for a missing number."""
    return np.array([np.nan if row.get(column) is None else float(row[column]) for row in rows])


def _draw_deviations(ax: Axes, group: Sequence[RowMapping], style: Mapping[str, Any], is_labelled: bool) -> None:
    """Draw the deviations of peak pressure and area (%) with their uncertainties.

    A full line is for the peak pressure, and a dotted line with open marks for the area.
    """
    for measure, label in (("p_max", "peak pressure"), ("area", "area")):
        value, uncertainty = (
            _read_numbers(group, f"hertz_{quantity}_{measure}_percent") for quantity in ("deviation", "uncertainty")
        )
        line_style = _FORM_STYLES[measure]
        _draw_series(ax, group, value, uncertainty, label=label if is_labelled else None, **style, **line_style)


def _add_series_legends(peak_axes: Axes, deviation_axes: Axes, labels: Sequence[str], *, has_unusable: bool) -> None:
    """Add the legends of several series: each series once, then the forms of lines.

    Parameters
    ----------
    peak_axes, deviation_axes
        Panels of the peak pressures and of the deviations.
    labels
        Label of each series by its number; empty if the series have no labels.
    has_unusable
        Whether a row is not usable.
    """
    from matplotlib.lines import Line2D

    series = [Line2D([], [], label=label, **series_style(number)) for number, label in enumerate(labels)]
    form: dict[str, Any] = {"color": "0.3", "marker": "o"}
    forms = {name: Line2D([], [], **form, **_FORM_STYLES[name]) for name in _FORM_STYLES}
    for name, label in (("fe", "finite elements"), ("hertz", "Hertz"), ("p_max", "peak pressure"), ("area", "area")):
        forms[name].set_label(label)
    unusable = [Line2D([], [], color="0.2", label="not usable", **_UNUSABLE_STYLE)] * has_unusable
    add_legend_beside(peak_axes, handles=[*series, forms["fe"], forms["hertz"], *unusable])
    if deviation_axes.lines:
        add_legend_beside(deviation_axes, handles=[forms["p_max"], forms["area"]])


def _finish_deviations(ax: Axes, criteria: Criteria | None) -> None:
    """Draw the bands of the limits and the label of the deviations."""
    limits = {} if criteria is None else criteria.limits
    drawn_limits = [(limits[name], MEASURE_WORDS[name].short) for name in ("p_max_MPa", "area_mm2") if name in limits]
    for (limit, _), grey in zip(sorted(drawn_limits, reverse=True), ("0.93", "0.86"), strict=False):
        ax.axhspan(-1e2 * limit, 1e2 * limit, color=grey, zorder=0)
    ax.axhline(0.0, color="0.4", lw=line_width(0.8))
    bands = ", ".join(f"{short} ±{1e2 * limit:g} %" for limit, short in drawn_limits)
    ax.set(ylabel="deviation of Hertz in %" + (f"\n(limits: {bands})" if bands else ""))


def _draw_used_limits(ax: Axes, group: Sequence[RowMapping], criteria: Criteria) -> None:
    """Draw the limit utilisation of Hertz in every deciding measure, with its uncertainty.

    Each measure is a line over the cases of a group; the vertical axis is linear up to 1, the limit, and logarithmic
    above it.

    Parameters
    ----------
    ax
        Axes for the drawing.
    group
        Rows of the cases of a series, in their order along the horizontal axis.
    criteria
        Deciding measures with their limits.
    """
    for number, (measure, limit) in enumerate(criteria.limits.items()):
        column, uncertainty_column, factor = deviation_columns(measure)
        utilisation, uncertainty = (
            np.abs(_read_numbers(group, name)) / (factor * limit) for name in (column, uncertainty_column)
        )
        _draw_series(ax, group, utilisation, uncertainty, label=MEASURE_WORDS[measure].short, **series_style(number))
    ax.axhspan(0.0, 1.0, color="0.93", zorder=0)
    ax.axhline(1.0, color="0.3", lw=line_width(1.0), zorder=1)
    style: dict[str, Any] = {"transform": ax.get_yaxis_transform(), "fontsize": "small", "color": "0.35"}
    ax.text(0.008, 1.03, "beyond the limit", va="bottom", **style)
    ax.text(0.008, 0.97, "within the limit", va="top", **style)
    # linear within the limits, logarithmic beyond
    ax.set_yscale("symlog", linthresh=1.0, linscale=1.0)
    top = max(3.0, 1.3 * ax.get_ylim()[1])
    ax.set_ylim(0.0, top)
    ticks = [tick for tick in (0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0) if tick <= top]
    ax.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.minorticks_off()
    ax.set(ylabel="limit utilisation of Hertz\n(logarithmic above 1)")
    # outside, since the lines leave no room for a legend
    add_legend_beside(ax)


def _draw_answers(ax: Axes, groups: Sequence[Sequence[RowMapping]]) -> None:
    """Draw the verdicts above the first panel, each with a colour and a mark; a row for each group."""
    from matplotlib.lines import Line2D
    from matplotlib.transforms import ScaledTranslation

    def row_place(number: int, transform: Transform) -> dict[str, Any]:
        offset = ScaledTranslation(
            0.0, _ANSWER_ROW_POINTS * (number + (len(groups) > 1)) / 72.0, ax.figure.dpi_scale_trans
        )
        return {"transform": transform + offset, "clip_on": False, "ls": "none"}

    handles = []
    for answer, mark in ANSWER_MARKS.items():
        style: dict[str, Any] = {"marker": mark, "ms": 9, "mfc": ANSWER_COLOURS[answer], "mec": "0.2", "mew": 0.8}
        is_drawn = False
        for number, group in enumerate(groups):
            usable_rows = [row for row in group if is_usable_status(row)]
            shifts = [_axis_place(row) for row in usable_rows if row.get("verdict_answer") == answer]
            if not shifts:
                # the layout would make room for a curve without points at the corner of the picture
                continue
            is_drawn, place = True, row_place(number, ax.get_xaxis_transform())
            ax.plot(shifts, [1.0] * len(shifts), zorder=5, label=f"_{answer}", **style, **place)
        if is_drawn:
            handles.append(Line2D([], [], ls="none", label=answer, **style))
    for number in range(len(groups) if len(groups) > 1 else 0):
        place = row_place(number, ax.transAxes)
        ax.plot([-0.02], [1.0], ms=5.5, label="_series", **series_style(number), **place)
    if handles:
        # outside, so that it never hides a verdict
        legend = ax.legend(
            handles=handles, fontsize="small", loc="lower left", bbox_to_anchor=(1.01, 0.0), title="Hertz"
        )
        # the layout makes no room for a clipped artist
        ax.add_artist(legend).set_clip_on(False)


def _draw_series(
    ax: Axes, group: Sequence[RowMapping], value: Floats, uncertainty: Floats | None = None, **style: Any
) -> None:
    """Draw a curve with error bars over the usable rows, and crosses at unusable rows.

    `value` and `uncertainty` have a number for each row of `group`, in the unit of the axis. The curve is broken at
    unusable rows and at jumps of the contact point.
    """
    shift, is_usable = np.array([_axis_place(row) for row in group]), np.array([is_usable_status(row) for row in group])
    usable_value = np.where(is_usable, value, np.nan)
    breaks = np.union1d(_find_jumps(group), _find_pair_changes(group))
    # NaN breaks the line, so that nobody reads a value between a usable and an unusable row, within a jump or between
    # two pairs
    ax.plot(
        np.insert(shift, breaks, np.nan), np.insert(usable_value, breaks, np.nan), lw=line_width(1.6), ms=5.5, **style
    )
    if uncertainty is not None:
        ax.errorbar(
            shift, usable_value, yerr=uncertainty, fmt="none", ecolor=style["color"], capsize=2.5, lw=line_width(1.0)
        )
    ax.plot(shift[~is_usable], value[~is_usable], color=style["color"], **_UNUSABLE_STYLE)


def _find_jumps(group: Sequence[RowMapping]) -> NDArray[np.int64]:
    """Numbers of the rows before which the contact point jumps.

    A jump is a movement by more than the width of the narrower Hertz ellipse of both rows, which have the same pair.
    """
    touch, width = _read_numbers(group, _TOUCH_COLUMN), _read_numbers(group, "hertz_b_mm")
    # a missing number (NaN) is not a jump
    jumps = 1 + np.flatnonzero(np.abs(np.diff(touch)) > np.minimum(width[1:], width[:-1]))
    return np.setdiff1d(jumps, _find_pair_changes(group))


def _find_pair_changes(group: Sequence[RowMapping]) -> NDArray[np.int64]:
    """Numbers of the rows before which the rail or the wheel changes."""
    pairs = [(row.get("rail"), row.get("wheel")) for row in group]
    return np.array([number for number in range(1, len(pairs)) if pairs[number] != pairs[number - 1]], dtype=np.int64)


def _draw_without_value(ax: Axes, group: Sequence[RowMapping]) -> None:
    places = [_axis_place(row) for row in group if row.get("fe_p_max_MPa") is None]
    ax.plot(places, [0.04] * len(places), transform=ax.get_xaxis_transform(), color="0.2", **_UNUSABLE_STYLE)


def _finish_study(
    panels: tuple[Axes, Axes, Axes], rows: Sequence[RowMapping], rail: Profile | None, labels: Sequence[str]
) -> None:
    """Add labels, title, junctions and legends to the panels of a study.

    The title has at most three pairs, and the load and the yaw if they are equal in all rows. `rail` is the profile for
    the junctions; None if the rows have several rails. `labels` are those of the series; empty without labels.
    """
    peak_axes, deviation_axes, touch_axes = panels
    pairs = sorted({row_pair_text(row) for row in rows})
    loads = sorted({float(row["load_kN"]) for row in rows})
    title = "; ".join(pairs[:3]) + ("; ..." if len(pairs) > 3 else "")
    peak_axes.set(ylabel="peak pressure in MPa")
    with_load = title + (f", {loads[0]:g} kN" if len(loads) == 1 else "")
    yaws = {float(row.get("yaw_mrad") or 0.0) for row in rows} - {0.0}
    yaw_text = f"yaw {yaws.pop():+g} mrad" if len(yaws) == 1 else ""
    reference = AGAINST_YIELDING_BODIES if any("elastic_verdict_answer" in row for row in rows) else ""
    words = "; ".join(filter(None, (with_load, roll_words_of_rows(rows), yaw_text, reference)))
    room = 14.0 + _ANSWER_ROW_POINTS * (len(labels) if len(labels) > 1 else 0)
    peak_axes.set_title(textwrap.fill(words, _TITLE_LETTERS), pad=room)
    peak_axes.margins(y=0.12)
    if rail is not None:
        _draw_junction_levels(touch_axes, rail)
    touch_axes.set(xlabel=SHIFT_LABEL, ylabel="contact point on the rail\ny in mm  (gauge side negative)")
    has_unusable = any(not is_usable_status(row) for row in rows)
    if len(labels) != 1:
        _add_series_legends(peak_axes, deviation_axes, labels, has_unusable=has_unusable)
    else:
        if has_unusable:
            peak_axes.plot([], [], color="0.2", label="not usable", **_UNUSABLE_STYLE)
        for ax in (peak_axes, deviation_axes):
            if ax.get_legend_handles_labels()[0] and (ax is peak_axes or ax.get_legend() is None):
                add_legend_beside(ax)
    add_grid(peak_axes, deviation_axes, touch_axes)


def _draw_junction_levels(ax: Axes, rail: Profile) -> None:
    """Draw the curvature junctions of the rail near the contact points, with their radii.

    Each junction is a horizontal line at its lateral position in mm, with the radii on its left and right. The limits
    of the axis are widened for the texts.
    """
    low, high = ax.get_ylim()
    margin = 0.15 * (high - low) + 2.0
    shown_junctions = [junction for junction in rail.junctions if low - margin < junction.y_mm < high + margin]
    for junction in shown_junctions:
        ax.axhline(junction.y_mm, color=Colour.RAIL_JUNCTION, lw=line_width(1.0), ls="-.", zorder=0)
        sides = (junction.curvature_left_per_mm, junction.curvature_right_per_mm)
        radii = " | ".join(format_radius(invert_curvature_mm(curvature), "R{:.4g}") for curvature in sides)
        place: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "xytext": (0, 2), "textcoords": "offset points"}
        style: dict[str, Any] = {"ha": "right", "va": "bottom", "fontsize": "small", "color": Colour.RAIL_JUNCTION}
        ax.annotate(radii, (0.995, junction.y_mm), **place, **style)
    # margin for the words above the highest line
    top = max([high, *(junction.y_mm + 0.5 * margin for junction in shown_junctions)])
    ax.set_ylim(low - margin, top + 0.5 * margin)
