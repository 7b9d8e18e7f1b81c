"""Picture of a case: both pressures and their difference, cuts, and all measures."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.arrays import Floats
from fecontact.judging.measures import MEASURES
from fecontact.outputs.case_words import case_words
from fecontact.outputs.records.asked import requested_record
from fecontact.outputs.records.results import result_record
from fecontact.outputs.style import (
    ANSWER_COLOURS,
    Colour,
    blank_figure,
    empty_axes,
    line_width,
    save_figure,
    save_image,
)
from fecontact.outputs.tables import TableRecord
from fecontact.outputs.theory_records import deciding_hertz
from fecontact.outputs.verdict_words import verdict_reason
from fecontact.outputs.words import MEASURE_WORDS
from fecontact.own_criterion import is_own
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.curve import ProfileKind, format_radius, invert_curvature_mm
from fecontact.solving.solve import CaseResult

if TYPE_CHECKING:
    from matplotlib import RcParams
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
from fecontact.outputs.figures.budget import draw_budget
from fecontact.outputs.figures.pressure_maps import (
    ACROSS_LABEL,
    ROLLING_LABEL,
    PressureFields,
    draw_pressure,
)

# --- Picture of a case: its verdict, both pressures and their difference, cuts through the peak, and all measures.

# Inches: width of a picture, width of a map's frame with three maps side by side, smallest and largest height of a map.
_WIDTH, _MAP_WIDTH, _MIN_MAP_HEIGHT, _MAX_MAP_HEIGHT = 15.0, 3.05, 1.3, 4.4
# Inches: heights of the head, of the title of a row of maps, of the labels below the row and of the cuts; widths of the
# labels to the left of a map, and of all labels on both sides of the map.
_HEAD_HEIGHT, _TITLE_HEIGHT, _LABEL_HEIGHT, _CUTS_HEIGHT, _LEFT_WIDTH, _SIDES_WIDTH = 0.65, 0.4, 0.75, 4.2, 0.85, 1.75
# Inches: width of the words.
_WORDS_WIDTH = 4.35
# Inches: height of the contributions to the uncertainty, at the bottom.
_BUDGET_HEIGHT = 0.9
# Largest number of intervals between the numbers of an axis. Ticks with their numbers take a third of the time of a
# picture.
_MAX_INTERVALS = 5
# Figure of the previous picture with its settings of matplotlib. Axes, ticks and colour scales take a fifth of the time
# of a picture.
_DRAWN_FIGURE: deque[tuple[RcParams, Figure]] = deque(maxlen=1)


def write_case_figure(result: CaseResult, path: str | Path, *, svg: bool = True) -> Path:
    """Draw a case as PNG, and as SVG if it is wanted; see `draw_case`.

    Parameters
    ----------
    result
        Result of a case.
    path
        File of the picture.
    svg
        Whether an SVG is written too.

    Returns
    -------
    Path
        The given path.
    """
    from matplotlib import rcParams

    fields, settings = PressureFields.of(result.load), rcParams.copy()
    figure = _take_figure(settings, *case_inches(fields))
    draw_case(figure, result_record(result), result.placement, fields)
    written_path = save_figure(figure, path) if svg else save_image(figure, Path(path))
    # a figure that could not be drawn is not used again
    _DRAWN_FIGURE.append((settings, figure))
    return written_path


def _take_figure(settings: RcParams, width: float, height: float) -> Figure:
    """Figure of the previous picture if matplotlib has equal settings, or an empty figure."""
    # threads never share a figure: only one of them gets it
    with suppress(IndexError):
        previous_settings, figure = _DRAWN_FIGURE.pop()
        if previous_settings == settings:
            figure.set_size_inches(width, height)
            return figure
    return blank_figure(width, height)


def case_inches(fields: PressureFields) -> tuple[float, float]:
    """Width and height of the picture of a case, in inches."""
    return _WIDTH, _HEAD_HEIGHT + _TITLE_HEIGHT + _map_height(fields) + _LABEL_HEIGHT + _CUTS_HEIGHT + _BUDGET_HEIGHT


def draw_case(figure: Figure, record: TableRecord, placement: Placement, fields: PressureFields) -> None:
    """Draw a result into a figure: the head with the verdict, maps, cuts and words.

    Maps show the rail's surface around the first contact point: finite elements, Hertz (with equal scales) and their
    difference, with the outlines of both patches. Cuts pass through the peak of the finite elements. Below the lateral
    cut is the rail, true to scale. All parts have fixed places within `case_inches`, because a layout engine would
    double the time.

    Parameters
    ----------
    figure
        Figure of the size `case_inches`, either empty or with a picture of another case, whose axes are used again.
    record
        Record of the result.
    placement
        Placement of the load.
    fields
        Pressure fields of the load.
    """
    figure.set_layout_engine(None)
    (width, height), is_tall, map_height = case_inches(fields), _is_tall(fields), _map_height(fields)
    previous_axes = deque(figure.axes)
    for previous_text in tuple(figure.texts):
        previous_text.remove()

    def axes(left: float, bottom: float, axes_width: float, axes_height: float, **options: Any) -> Axes:
        place = (left / width, bottom / height, axes_width / width, axes_height / height)
        if previous_axes:
            ax = previous_axes.popleft()
            empty_axes(ax)
            ax.set_position(place)
        else:
            ax = figure.add_axes(place, **options)
        ax.locator_params(nbins=_MAX_INTERVALS)
        return ax

    def write(left: float, top: float, text: str, **text_style: Any) -> None:
        figure.text(left / width, top / height, text, va="top", **text_style)

    cuts_top, cuts_bottom = _BUDGET_HEIGHT + _CUTS_HEIGHT, _BUDGET_HEIGHT + 0.75
    answer, measure = record["verdict"]["answer"], record["verdict"]["measure"]
    box = {"fc": ANSWER_COLOURS[answer], "ec": "0.2", "boxstyle": "round,pad=0.35"}
    write(0.18, height - 0.22, f" Hertz {answer} ", fontsize=15, weight="bold", bbox=box)
    text_left = 0.45 + 0.155 * len(f"Hertz {answer}")
    write(text_left, height - 0.12, case_words(record["case"]), fontsize=13)
    write(text_left, height - 0.42, verdict_reason(record), fontsize=11)
    map_width = map_height / _height_to_width(fields) if is_tall else _MAP_WIDTH
    map_spacing = map_width + _SIDES_WIDTH if is_tall else width / 3.0
    for number, kind in enumerate(("finite elements", "Hertz", "Hertz minus finite elements")):
        ax = axes(number * map_spacing + _LEFT_WIDTH, cuts_top + _LABEL_HEIGHT, map_width, map_height)
        draw_pressure(ax, kind, fields, record["lobes"], image=next(iter(ax.images), None))
        for place in _junction_places_mm(placement, "rail"):
            # visible on the dark background of a pressure and on the light background of a difference
            ax.axvline(place, color="0.6", ls=":", lw=line_width(1.2), label="_rail junction")
        ax.set_xlim(fields.limits_mm(across=True))
    words_left = 3.0 * map_spacing + 0.15 if is_tall else width - _WORDS_WIDTH
    cut_width = 0.5 * (width if is_tall else words_left)
    lateral_axes = axes(_LEFT_WIDTH, cuts_bottom + 1.0, cut_width - _LEFT_WIDTH - 0.1, 2.0)
    draw_lateral_cut(lateral_axes, placement, fields)
    _draw_rail(
        axes(_LEFT_WIDTH, cuts_bottom, cut_width - _LEFT_WIDTH - 0.1, 0.8, sharex=lateral_axes),
        placement,
        fields,
    )
    draw_rolling_cut(axes(cut_width + _LEFT_WIDTH, cuts_bottom, cut_width - _LEFT_WIDTH - 0.2, 3.0), fields)
    words_top = cuts_top + _LABEL_HEIGHT + map_height if is_tall else cuts_top - 0.4
    text = _case_text(record, placement, fields)
    write(words_left, words_top, text, family="monospace", fontsize=8.2, linespacing=1.5)
    if sum((budget := record["uncertainty_budget"].get(measure, {})).values()) > 0.0:
        draw_budget(axes(_LEFT_WIDTH, 0.42, width - _LEFT_WIDTH - 0.4, 0.16), measure, budget)
    for ax in previous_axes:
        ax.remove()


def _height_to_width(fields: PressureFields) -> float:
    """Ratio of height to width of the range of a map."""
    (x_low, x_high), (s_low, s_high) = fields.limits_mm(across=False), fields.limits_mm(across=True)
    return (x_high - x_low) / (s_high - s_low)


def _is_tall(fields: PressureFields) -> bool:
    # tall maps leave room for the words at their side
    return 3.0 * (_MAX_MAP_HEIGHT / _height_to_width(fields) + _SIDES_WIDTH) + _WORDS_WIDTH <= _WIDTH


def _map_height(fields: PressureFields) -> float:
    return float(np.clip(_MAP_WIDTH * _height_to_width(fields), _MIN_MAP_HEIGHT, _MAX_MAP_HEIGHT))


def draw_lateral_cut(ax: Axes, placement: Placement, fields: PressureFields, *, label: bool = False) -> None:
    """Draw both pressures across, through the peak of the finite elements.

    The junctions of both profiles are marked.

    Parameters
    ----------
    ax
        Axes to draw into.
    placement
        Placement of the load.
    fields
        Pressure fields of the load.
    label
        Whether the axis across has a label; without it the label is below the picture of the rail.
    """
    i, grid = fields.peak[0], fields.grid
    s = np.linspace(grid.s_mm[0], grid.s_mm[-1], 400)
    elastic = None if fields.elastic is None else fields.elastic[i]
    _draw_cut(ax, (grid.s_mm, fields.fe[i]), (s, fields.ellipse.pressure_MPa(grid.x_mm[i], s)), elastic)
    low, high = fields.limits_mm(across=True)
    for junctions, colour, style, name in (
        (_junction_places_mm(placement, "rail"), Colour.RAIL_JUNCTION, "-", "rail junction"),
        (_junction_places_mm(placement, "wheel"), Colour.WHEEL_JUNCTION, ":", "wheel junction"),
    ):
        shown_places_mm = [place_mm for place_mm in junctions if low < place_mm < high]
        for number, place_mm in enumerate(shown_places_mm):
            ax.axvline(
                place_mm, color=colour, ls=style, lw=line_width(1.3), label=name if number == 0 else None, zorder=0
            )
    ax.set_title(f"lateral cut at x = {grid.x_mm[i]:z.2f} mm", y=1.0)
    ax.set_xlim(low, high)
    if label:
        ax.set(xlabel=ACROSS_LABEL)
    else:
        ax.tick_params(labelbottom=False)
    ax.legend(loc="best", fontsize="small")


def draw_rolling_cut(ax: Axes, fields: PressureFields) -> None:
    """Draw both pressures along the running direction, through the peak of the finite elements.

    Parameters
    ----------
    ax
        Axes to draw into.
    fields
        Pressure fields of the load.
    """
    j, grid = fields.peak[1], fields.grid
    x = np.linspace(grid.x_mm[0], grid.x_mm[-1], 400)
    elastic = None if fields.elastic is None else fields.elastic[:, j]
    _draw_cut(ax, (grid.x_mm, fields.fe[:, j]), (x, fields.ellipse.pressure_MPa(x, grid.s_mm[j])), elastic)
    ax.set_title(f"longitudinal cut at s = {grid.s_mm[j]:z.2f} mm", y=1.0)
    ax.set(xlabel=ROLLING_LABEL, xlim=fields.limits_mm(across=False))
    ax.legend(loc="best", fontsize="small")


def _draw_cut(ax: Axes, fe: tuple[Floats, Floats], hertz: tuple[Floats, Floats], elastic: Floats | None) -> None:
    """Draw the pressures (MPa) of finite elements and Hertz over a coordinate (mm).

    `fe` and `hertz` are pairs (coordinates, pressures). `elastic` is the pressure of elastic bodies at the coordinates
    of `fe`, if `fe` belongs to bodies that yield; None if not.
    """
    yields = "" if elastic is None else ", bodies that yield"
    ax.plot(*fe, color=Colour.FE, marker="o", ms=2.5, lw=line_width(1.3), label=f"finite elements{yields}")
    if elastic is not None:
        ax.plot(fe[0], elastic, color=Colour.FE, ls=":", lw=line_width(1.3), label="finite elements, elastic bodies")
    ax.plot(*hertz, color=Colour.HERTZ, ls="--", lw=line_width(1.6), label="Hertz")
    highest = max(float(pressure.max()) for pressure in (fe[1], hertz[1], *([] if elastic is None else [elastic])))
    ax.set(ylabel="pressure in MPa", ylim=(0.0, 1.12 * max(highest, 1.0)))
    ax.grid(alpha=0.3)


def _draw_rail(ax: Axes, placement: Placement, fields: PressureFields) -> None:
    """Draw the rail below the cut, true to scale.

    The range of s is equal to the range of the cut. The picture is in the frame of the first contact point.
    """
    low, high = fields.limits_mm(across=True)
    s = np.linspace(low, high, 300)
    points, _ = placement.surface(0.0, s)
    first = placement.first
    height = (points - np.array([first.x_mm, first.y_mm, first.z_mm])) @ first.normal
    is_on_rail = np.isfinite(height)
    bottom = float(np.nanmin(height)) - 0.06 * (high - low)
    ax.fill_between(s[is_on_rail], height[is_on_rail], bottom, color="0.85", lw=0.0)
    ax.plot(s, height, color="0.2", lw=line_width(1.4))
    ends = [low, *(place for place in _junction_places_mm(placement, "rail") if low < place < high), high]
    for place in ends[1:-1]:
        ax.axvline(place, color=Colour.RAIL_JUNCTION, lw=line_width(1.3), zorder=0)
    profile = placement.rail.profile
    for left, right in pairwise(ends):
        u = profile.at_arc_length(0.5 * (left + right) + placement.first_arc_length_mm)
        curvature = profile.convex_sign * float(profile.evaluate(u).curvature_per_mm)
        if np.isfinite(curvature) and right - left > 0.12 * (high - low):
            radius = format_radius(invert_curvature_mm(curvature), "R {:.4g}")
            ax.text(0.5 * (left + right), bottom, radius, ha="center", va="bottom", fontsize="small")
    ax.set(xlabel=ACROSS_LABEL, ylabel="rail", yticks=[], aspect="equal", adjustable="datalim")
    ax.set_xlim(low, high)


def _junction_places_mm(placement: Placement, kind: ProfileKind) -> list[float]:
    """Positions s (mm) of the junctions of a profile.

    The wheel's profile lies on the rail's profile near the contact point.
    """
    return sorted(place.s_mm for place in placement.junctions if place.profile.kind == kind)


# Characters of the names of measures in the text of a case.
_NAME_WIDTH = 10


def _case_text(record: TableRecord, placement: Placement, fields: PressureFields) -> str:
    """Text with all measures, deviations, uncertainties, limits and lobes of a load.

    It is a table in monospace columns, with the key of the line styles and the status below. At a junction the numbers
    are by the curvature of the side that decides the verdict, as the ellipse of the picture and the contributions to
    the uncertainty. With a yield stress they are of the bodies that yield.
    """
    requested, first = requested_record(record), record["contact_points"][0]
    limits, fe, hertz = record["verdict"]["limits"], requested["fe"], deciding_hertz(requested)
    lines = [f"{'':<{_NAME_WIDTH}} {'FE':>6} {'Hertz':>6} {'deviation':>9} {'±':>6} {'limit':>7}"]
    for name, answer in hertz["verdict"]["each"].items():
        words = MEASURE_WORDS[name]
        head = f"{words.short} {words.unit}" if name in MEASURES else words.short
        if len(head) > _NAME_WIDTH:
            # the numbers of a long name of a user have a line of their own, below the columns
            lines.append(head)
            head = ""
        if name not in hertz["deviation"]:
            lines.append(f"{head:<{_NAME_WIDTH}} {'not judged':>31} {answer}")
            continue
        has_values = name in MEASURES or is_own(name)
        values = (f"{measures[name]:.4g}" if has_values else "" for measures in (fe, hertz))
        deviation, uncertainty = (
            words.deviation_text(hertz["deviation"][name]),
            words.deviation_text(hertz["uncertainty"][name], size=True).split()[0],
        )
        limit = words.limit_text(limits[name]) if name in limits else ""
        sizes = " ".join(f"{value:>6}" for value in values)
        lines.append(f"{head:<{_NAME_WIDTH}} {sizes} {deviation:>9} {uncertainty:>6} {limit:>7} {answer}")
    if first["at_junction"]:
        lines.append(f"Hertz with the curvature of the {record['verdict']['side']} side")
    low, high = fields.limits_mm(across=True)
    dotted = (
        ", dotted: rail junction" if any(low < place < high for place in _junction_places_mm(placement, "rail")) else ""
    )
    lines += ["", f"solid: finite elements, dashed: Hertz{dotted}"]
    lines += [f"contact point (+): rail y {first['rail_y_mm']:+z.2f} mm, {1e3 * first['contact_angle_rad']:+z.1f} mrad"]
    for number, lobe in enumerate(record["lobes"], start=1):
        lobe_words = f"{lobe['fe']['p_max_MPa']:.0f} MPa, {1e-3 * lobe['normal_force_N']:.2f} kN"
        lines.append(f"lobe {number}, centre at rail y {lobe['rail_y_mm']:+z.1f} mm: {lobe_words}")
    lines.append(f"lobes {len(fe['lobes'])}, patches {fe['patch_count']}")
    lines.append(f"status: {record['status']}")
    return "\n".join(lines)
