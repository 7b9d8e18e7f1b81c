"""The picture of a case: both pressures and their difference, cuts, all measures; and small pictures for reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid
from fecontact.contact.patch import signed_square
from fecontact.contact_theories.approximation import mean_pressure
from fecontact.contact_theories.hertz import HertzContact
from fecontact.errors import usable
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.ladder import STEPS
from fecontact.judging.lobes import LobeJudgement
from fecontact.outputs.case_words import SHIFT, case_words
from fecontact.outputs.pair_names import Row
from fecontact.outputs.series import series
from fecontact.outputs.style import (
    ANSWERS,
    SERIES,
    SIDES,
    Colour,
    blank_figure,
    finish,
    legend_beside,
    save_figure,
    save_image,
)
from fecontact.outputs.verdict_words import shown_measures, verdict_reason
from fecontact.outputs.words import WORDS
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.curve import Kind, radius_mm, radius_text
from fecontact.solving.solve import CaseResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# --- Maps of contact pressures over the rail's surface, with the outlines of both patches.

# Labels of axes over the rail's surface.
_ACROSS, _ROLLING = f"s across in mm\n{SIDES}", "x (rolling) in mm"
# Colour maps of pressures (lighter where higher) and of signed differences.
_PRESSURE, _DIFFERENCE = "viridis", "RdBu_r"
# A map has room for only three numbers across if it is this many times as tall as wide.
_NARROW = 2.2
# Colours of a pressure map and of a difference map without pressure.
_NO_PRESSURE, _NO_DIFFERENCE = "#440154", "#f7f6f6"


@dataclass(frozen=True, kw_only=True, eq=False)
class PressureFields:
    """Both pressures (nx, ns) in MPa on the nodes of the whole contact, far enough to hold Hertz's ellipse.

    `fe` are bodies that yield if there is a yield stress; `elastic` then are elastic ones, else None.
    """

    grid: ContactGrid
    fe: Floats
    hertz: Floats
    ellipse: HertzContact
    elastic: Floats | None = None

    @classmethod
    def of(cls, load: JudgedLoad) -> PressureFields:
        """The fields of a judged load."""
        hertz, yielded = load.hertz, load.level.yielded
        extents = hertz.extent_x_mm, hertz.extent_y_mm
        elastic = load.fe.even().pressure.covering(*extents)
        fe = elastic if yielded is None else yielded.fe.even().pressure.covering(*extents)
        return cls(
            grid=fe.grid,
            fe=fe.values,
            hertz=mean_pressure(fe.grid, hertz),
            ellipse=hertz,
            elastic=None if yielded is None else elastic.at(fe.grid).values,
        )

    @property
    def peak(self) -> tuple[int, int]:
        """Indices of the highest finite-element pressure."""
        i, j = np.unravel_index(int(np.argmax(self.fe)), self.fe.shape)
        return int(i), int(j)

    def limits_mm(self, *, across: bool) -> tuple[float, float]:
        """Range along s (`across`) or x that shows both patches with some room, less than the whole grid."""
        line = self.grid.s_mm if across else self.grid.x_mm
        pressed = line[np.flatnonzero(np.any(self.fe > 0.0, axis=0 if across else 1))]
        reach = 0.5 * (self.ellipse.extent_y_mm if across else self.ellipse.extent_x_mm)
        low, high = min(float(pressed[0]), -reach), max(float(pressed[-1]), reach)
        room = 0.12 * (high - low)
        return low - room, high + room


def draw_pressure(ax: Axes, load: JudgedLoad, kind: str, fields: PressureFields, *, scale: bool = True) -> None:
    """Draw a map of `finite elements`, `Hertz`, or `Hertz minus finite elements` over the rail's surface into axes.

    The outlines of both patches are drawn on it, with a cross at the first touch point, and the lobes
    of the finite elements are numbered above their centres of pressure, the one with the largest force first. With
    `scale` the colours have theirs beside the map.
    """
    is_difference = kind == "Hertz minus finite elements"
    values = {"finite elements": fields.fe, "Hertz": fields.hertz}.get(kind, fields.hertz - fields.fe)
    top = (float(np.abs(values).max()) or 1.0) if is_difference else float(max(fields.fe.max(), fields.hertz.max()))
    ground = _NO_DIFFERENCE if is_difference else _NO_PRESSURE
    image = ax.imshow(
        values,
        origin="lower",
        interpolation="bilinear",
        cmap=_DIFFERENCE if is_difference else _PRESSURE,
        vmin=-top if is_difference else 0.0,
        vmax=top,
        extent=(*_cell_edges(fields.grid.s_mm), *_cell_edges(fields.grid.x_mm)),
    )
    if is_difference:
        # in grey both ends of the colour map are dark: lines are dashed if the finite elements' pressure is larger
        levels = top * np.array([-0.75, -0.5, -0.25, 0.25, 0.5, 0.75])
        ax.contour(fields.grid.s_mm, fields.grid.x_mm, values, levels=levels, colors="0.25", linewidths=0.6)
    _draw_outlines(ax, fields)
    _draw_lobes(ax, load)
    for colour, width in (("black", 3.0), ("white", 1.4)):
        ax.plot(0.0, 0.0, "+", color=colour, ms=9, mew=width, label="_first touch point")
    # with a given place matplotlib does not look for one in each drawing
    ax.set_title(
        f"{kind}, bodies that yield" if kind == "finite elements" and fields.elastic is not None else kind, y=1.0
    )
    ax.set(xlabel=_ACROSS, ylabel=_ROLLING, aspect="equal", facecolor=ground)
    (s_low, s_high), (x_low, x_high) = fields.limits_mm(across=True), fields.limits_mm(across=False)
    ax.set(xlim=(s_low, s_high), ylim=(x_low, x_high))
    if x_high - x_low > _NARROW * (s_high - s_low):
        # more numbers would overlap
        ax.locator_params(axis="x", nbins=3)
    if scale:
        bar = ax.figure.colorbar(image, cax=ax.inset_axes((1.03, 0.0, 0.045, 1.0)))
        bar.set_label("difference in MPa" if is_difference else "pressure in MPa")


def _cell_edges(nodes_mm: Floats) -> tuple[float, float]:
    """Outer ends of the cells of the first and the last of equally spaced nodes."""
    half = 0.5 * float(nodes_mm[1] - nodes_mm[0])
    return float(nodes_mm[0]) - half, float(nodes_mm[-1]) + half


def _draw_outlines(ax: Axes, fields: PressureFields) -> None:
    """Edges of both patches, white on black so that they are seen on every colour; the ellipse is dashed."""
    (hx, hs), grid = fields.grid.steps_mm, fields.grid
    x = np.concatenate([[grid.x_mm[0] - hx], grid.x_mm, [grid.x_mm[-1] + hx]])
    s = np.concatenate([[grid.s_mm[0] - hs], grid.s_mm, [grid.s_mm[-1] + hs]])
    square = signed_square(fields.fe)
    ellipse = ellipse_outline(fields.ellipse)
    # drawn twice: with path effects SVG files would differ from one drawing to the next
    for colour, width, name in (("black", 2.8, "_"), ("white", 1.4, "")):
        ax.plot(*ellipse, color=colour, lw=width, ls="-" if name else (0, (4, 2)), label=f"{name}Hertz")
        edge = ax.contour(s, x, square, levels=[0.0], colors=colour, linewidths=width)
        edge.set(label=f"{name}finite elements")


def ellipse_outline(hertz: HertzContact) -> tuple[Floats, Floats]:
    """Edge of Hertz's ellipse: s and x (n,) in mm, closed."""
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    first, second = hertz.a_mm * np.cos(turn), hertz.b_mm * np.sin(turn)
    c, s = np.cos(hertz.orientation_rad), np.sin(hertz.orientation_rad)
    return first * s + second * c, first * c - second * s


def _lobes(load: JudgedLoad) -> Sequence[LobeJudgement]:
    """Lobes of a contact, none of a single one."""
    return load.lobes if len(load.lobes) > 1 else ()


def _draw_lobes(ax: Axes, load: JudgedLoad) -> None:
    for number, lobe in enumerate(_lobes(load), start=1):
        x, s = lobe.centre_mm
        around = {"fc": "white", "ec": "black", "boxstyle": "circle,pad=0.15", "lw": 0.8}
        # above the centre: the touch point may be there
        ax.annotate(
            str(number),
            (s, x),
            xytext=(0.0, 10.0),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=8,
            weight="bold",
            bbox=around,
        )


# --- The picture of a case: its verdict, both pressures and their difference, cuts through the peak, and all measures.

# Inches: width of a picture, width of a map's frame with three maps side by side, smallest and largest height of a map.
_WIDTH, _MAP_WIDTH, _LEAST_HEIGHT, _MOST_HEIGHT = 15.0, 3.05, 1.3, 4.4
# Inches: heights of the head, of the title of a row of maps, of the labels below it and of the cuts; widths of the
# labels to the left of a map, and of all labels beside it.
_HEAD, _TITLE, _BELOW, _CUTS, _LEFT, _BESIDE = 0.65, 0.4, 0.75, 4.2, 0.85, 1.75
# Inches: width of the words.
_WORDS = 4.35


def case_figure(result: CaseResult, path: str | Path, *, svg: bool = True) -> Path:
    """Draw a case as PNG, and as SVG beside it unless that is not wanted; see `draw_case`."""
    fields = PressureFields.of(result.load)
    figure = blank_figure(*case_inches(fields))
    draw_case(figure, result.load, result.placement, fields)
    return save_figure(figure, path) if svg else save_image(figure, Path(path))


def case_inches(fields: PressureFields) -> tuple[float, float]:
    """Width and height of the picture of a case."""
    return _WIDTH, _HEAD + _TITLE + _map_height(fields) + _BELOW + _CUTS


def draw_case(figure: Figure, load: JudgedLoad, placement: Placement, fields: PressureFields) -> None:
    """Draw a judged load into a figure: the head with the verdict, maps, cuts and words.

    Maps show the rail's surface around the first touch point: finite elements, Hertz (same scale) and their difference,
    with the outlines of both patches. Cuts go through the peak of the finite elements; below the lateral cut is the
    rail, true to scale. All parts have fixed places within `case_inches`: a layout engine would double the time.
    """
    figure.set_layout_engine(None)
    (width, height), tall, of_map = case_inches(fields), _is_tall(fields), _map_height(fields)

    def axes(left: float, bottom: float, wide: float, high: float, **more: Any) -> Axes:
        return figure.add_axes((left / width, bottom / height, wide / width, high / height), **more)

    def write(left: float, top: float, text: str, **style: Any) -> None:
        figure.text(left / width, top / height, text, va="top", **style)

    answer = load.answer.answer
    box = {"fc": ANSWERS[answer], "ec": "0.2", "boxstyle": "round,pad=0.35"}
    write(0.18, height - 0.22, f" Hertz {answer} ", fontsize=15, weight="bold", bbox=box)
    after = 0.45 + 0.155 * len(f"Hertz {answer}")
    write(after, height - 0.12, case_words(load.case, placement), fontsize=13)
    write(after, height - 0.42, verdict_reason(load), fontsize=11)
    wide = of_map / _ratio(fields) if tall else _MAP_WIDTH
    step = wide + _BESIDE if tall else width / 3.0
    for number, kind in enumerate(("finite elements", "Hertz", "Hertz minus finite elements")):
        ax = axes(number * step + _LEFT, _CUTS + _BELOW, wide, of_map)
        draw_pressure(ax, load, kind, fields)
        for place in _junctions(placement, "rail"):
            # seen on the dark ground of a pressure and on the light ground of a difference
            ax.axvline(place, color="0.6", ls=":", lw=1.2, label="_rail junction")
        ax.set_xlim(fields.limits_mm(across=True))
    words_left = 3.0 * step + 0.15 if tall else width - _WORDS
    of_cut = 0.5 * (width if tall else words_left)
    lateral = axes(_LEFT, 1.75, of_cut - _LEFT - 0.1, 2.0)
    draw_lateral_cut(lateral, placement, fields)
    _draw_rail(axes(_LEFT, 0.75, of_cut - _LEFT - 0.1, 0.8, sharex=lateral), placement, fields)
    draw_rolling_cut(axes(of_cut + _LEFT, 0.75, of_cut - _LEFT - 0.2, 3.0), fields)
    words_top = _CUTS + _BELOW + of_map if tall else _CUTS - 0.4
    text = _case_text(load, placement, fields)
    write(words_left, words_top, text, family="monospace", fontsize=8.2, linespacing=1.5)


def _ratio(fields: PressureFields) -> float:
    """Height over width of a map's range."""
    (x_low, x_high), (s_low, s_high) = fields.limits_mm(across=False), fields.limits_mm(across=True)
    return (x_high - x_low) / (s_high - s_low)


def _is_tall(fields: PressureFields) -> bool:
    # tall: three maps leave room for the words beside them
    return 3.0 * (_MOST_HEIGHT / _ratio(fields) + _BESIDE) + _WORDS <= _WIDTH


def _map_height(fields: PressureFields) -> float:
    return float(np.clip(_MAP_WIDTH * _ratio(fields), _LEAST_HEIGHT, _MOST_HEIGHT))


def draw_lateral_cut(ax: Axes, placement: Placement, fields: PressureFields, *, label: bool = False) -> None:
    """Draw both pressures across, through the peak of the finite elements, with the junctions of both profiles.

    With `label` the axis across is labelled; without it the label is below the rail's picture.
    """
    i, grid = fields.peak[0], fields.grid
    s = np.linspace(grid.s_mm[0], grid.s_mm[-1], 400)
    elastic = None if fields.elastic is None else fields.elastic[i]
    _draw_cut(ax, (grid.s_mm, fields.fe[i]), (s, fields.ellipse.pressure_MPa(grid.x_mm[i], s)), elastic)
    low, high = fields.limits_mm(across=True)
    for junctions, colour, style, name in (
        (_junctions(placement, "rail"), Colour.RAIL_JUNCTION, "-", "rail junction"),
        (_junctions(placement, "wheel"), Colour.WHEEL_JUNCTION, ":", "wheel junction"),
    ):
        shown = [place for place in junctions if low < place < high]
        for number, place in enumerate(shown):
            ax.axvline(place, color=colour, ls=style, lw=1.3, label=name if number == 0 else None, zorder=0)
    ax.set_title(f"lateral cut at x = {grid.x_mm[i]:z.2f} mm", y=1.0)
    ax.set_xlim(low, high)
    if label:
        ax.set(xlabel=_ACROSS)
    else:
        ax.tick_params(labelbottom=False)
    ax.legend(loc="best", fontsize=9)


def draw_rolling_cut(ax: Axes, fields: PressureFields) -> None:
    """Draw both pressures along the running direction, through the peak of the finite elements."""
    j, grid = fields.peak[1], fields.grid
    x = np.linspace(grid.x_mm[0], grid.x_mm[-1], 400)
    elastic = None if fields.elastic is None else fields.elastic[:, j]
    _draw_cut(ax, (grid.x_mm, fields.fe[:, j]), (x, fields.ellipse.pressure_MPa(x, grid.s_mm[j])), elastic)
    ax.set_title(f"rolling cut at s = {grid.s_mm[j]:z.2f} mm", y=1.0)
    ax.set(xlabel=_ROLLING, xlim=fields.limits_mm(across=False))
    ax.legend(loc="best", fontsize=9)


def _draw_cut(ax: Axes, fe: tuple[Floats, Floats], hertz: tuple[Floats, Floats], elastic: Floats | None) -> None:
    yields = "" if elastic is None else ", bodies that yield"
    ax.plot(*fe, color=Colour.FE, marker="o", ms=2.5, lw=1.3, label=f"finite elements{yields}")
    if elastic is not None:
        ax.plot(fe[0], elastic, color=Colour.FE, ls=":", lw=1.3, label="finite elements, elastic bodies")
    ax.plot(*hertz, color=Colour.HERTZ, ls="--", lw=1.6, label="Hertz")
    highest = max(float(one.max()) for one in (fe[1], hertz[1], *([] if elastic is None else [elastic])))
    ax.set(ylabel="pressure in MPa", ylim=(0.0, 1.12 * max(highest, 1.0)))
    ax.grid(alpha=0.3)


def _draw_rail(ax: Axes, placement: Placement, fields: PressureFields) -> None:
    """The rail's line below the cut, over an equal range of s, true to scale, in the frame of the first touch point."""
    low, high = fields.limits_mm(across=True)
    s = np.linspace(low, high, 300)
    points, _ = placement.surface(0.0, s)
    first = placement.first
    height = (points - np.array([first.x_mm, first.y_mm, first.z_mm])) @ first.normal
    there = np.isfinite(height)
    bottom = float(np.nanmin(height)) - 0.06 * (high - low)
    ax.fill_between(s[there], height[there], bottom, color="0.85", lw=0.0)
    ax.plot(s, height, color="0.2", lw=1.4)
    ends = [low, *(place for place in _junctions(placement, "rail") if low < place < high), high]
    for place in ends[1:-1]:
        ax.axvline(place, color=Colour.RAIL_JUNCTION, lw=1.3, zorder=0)
    profile = placement.rail.profile
    for left, right in pairwise(ends):
        u = profile.at_arc_length(0.5 * (left + right) + placement.first_arc_length_mm)
        curvature = profile.convex_sign * float(profile.evaluate(u).curvature_per_mm)
        if np.isfinite(curvature) and right - left > 0.12 * (high - low):
            radius = radius_text(radius_mm(curvature), "R {:.4g}")
            ax.text(0.5 * (left + right), bottom, radius, ha="center", va="bottom", fontsize=8.5)
    ax.set(xlabel=_ACROSS, ylabel="rail", yticks=[], aspect="equal", adjustable="datalim")
    ax.set_xlim(low, high)


def _junctions(placement: Placement, kind: Kind) -> list[float]:
    """Positions (mm) of one profile's junctions; the wheel's line lies on the rail's near the touch point."""
    return sorted(place.s_mm for place in placement.junctions if place.profile.kind == kind)


def _case_text(load: JudgedLoad, placement: Placement, fields: PressureFields) -> str:
    comparison, first, side = load.comparison, placement.first, [*load.sides.values()][-1]
    side = side if load.plastic is None else load.plastic.deciding
    lines = [f"{'':<10} {'FE':>6} {'Hertz':>6} {'off by':>9} {'±':>6} {'limit':>7}"]
    fe, hertz, limits = shown_measures(load).as_dict(), side.measures.as_dict(), load.case.criteria.limits
    for name, answer in side.verdict.each.items():
        words = WORDS[name]
        head = f"{words.short} {words.unit}" if name in fe else words.short
        values = (f"{of[name]:.4g}" if name in of else "" for of in (fe, hertz))
        off, unsure = words.off(side.deviation[name]), words.off(side.uncertainty[name], size=True).split()[0]
        limit = words.limit(limits[name]) if name in limits else ""
        sizes = " ".join(f"{value:>6}" for value in values)
        lines.append(f"{head:<10} {sizes} {off:>9} {unsure:>6} {limit:>7} {answer}")
    if first.at_junction:
        # the ellipse in the picture, and the numbers, belong to one side
        lines.append("all with the curvature of the field side")
    low, high = fields.limits_mm(across=True)
    dotted = ", dotted: rail junction" if any(low < place < high for place in _junctions(placement, "rail")) else ""
    lines += ["", f"solid: finite elements, dashed: Hertz{dotted}"]
    lines += [f"touch (+) at {first.rail_y_mm:+z.2f} mm on the rail, {1e3 * first.contact_angle_rad:+z.1f} mrad"]
    for number, lobe in enumerate(_lobes(load), start=1):
        carries = f"{lobe.fe['p_max_MPa']:.0f} MPa, {1e-3 * lobe.normal_force_N:.2f} kN"
        lines.append(f"lobe {number}, centre at rail y {lobe.rail_y_mm:+z.1f} mm: {carries}")
    lines.append(f"lobes {len(comparison.patch.lobes)}, patches {comparison.patch.pieces}")
    lines.append(f"status: {load.status}")
    return "\n".join(lines)


# --- Further pictures for reports: the ladder over the shift, and small pictures of patches.


def ladder_figure(rows: Sequence[Row]) -> Figure | None:
    """Draw over the shift which step of the ladder moves the peak pressure away from Hertz; None without such rows.

    A panel for each step that all rows have, in percent of the peak with its uncertainty: from Hertz's gap to the true
    gap on a half-space, from the half-space to the finite bodies, and to bodies that yield.
    """
    told = [row for row in rows if usable(row)]
    steps = {
        step.name: step.cause
        for step in STEPS
        if step.shown and all(row.get(f"steps_{step.name}_p_max_percent") is not None for row in told)
    }
    if not told or not steps:
        return None
    figure = blank_figure(9.0, 2.6 * len(steps))
    panels = figure.subplots(len(steps), 1, sharex=True)
    found = series(told)
    for number, one in enumerate(found):
        colour = SERIES[number % len(SERIES)]
        for ax, name in zip(panels, steps, strict=True):
            label = one.label if ax is panels[0] and len(found) <= len(SERIES) else ""
            _draw_step(ax, one.rows, name, colour, label or None)
    for ax, cause in zip(panels, steps.values(), strict=True):
        ax.set_ylabel(f"{cause}:\npeak changes by %")
        ax.axhline(0.0, color="0.3", lw=0.9, zorder=0)
    panels[-1].set_xlabel(SHIFT)
    finish(*panels)
    if panels[0].get_legend_handles_labels()[0]:
        legend_beside(panels[0])
    return figure


def _draw_step(ax: Axes, rows: Sequence[Row], name: str, colour: str, label: str | None) -> None:
    shifts = [float(row["lateral_shift_mm"]) for row in rows]
    values = [float(row[f"steps_{name}_p_max_percent"]) for row in rows]
    unsure = [row.get(f"steps_uncertainty_{name}_p_max_percent") for row in rows]
    ax.plot(shifts, values, "o", color=colour, ms=5, label=label)
    ax.vlines(shifts, 0.0, values, color=colour, lw=1.4)
    if all(value is not None for value in unsure):
        ax.errorbar(shifts, values, yerr=np.array(unsure, dtype=float), fmt="none", ecolor="0.2", capsize=3, lw=1.0)


# Of an axis of a small picture.
_FEW_TICKS = 4


def small_figure(load: JudgedLoad, placement: Placement) -> Figure:
    """Draw a small picture of the pressure and the lateral cut of a load; without a layout engine, as `draw_case`.

    Ticks and scales take most of the time of a picture, and a report has a hundred: the cut has the scale of the map.
    """
    figure = blank_figure(4.0, 5.0)
    figure.set_layout_engine(None)
    over, below = figure.add_axes((0.17, 0.5, 0.79, 0.45)), figure.add_axes((0.17, 0.1, 0.79, 0.3))
    _draw_small(over, below, load, placement)
    return figure


def _draw_small(over: Axes, below: Axes, load: JudgedLoad, placement: Placement) -> None:
    fields = PressureFields.of(load)
    for ax in (over, below):
        # a narrow map gets fewer still
        ax.locator_params(nbins=_FEW_TICKS)
    draw_pressure(over, load, "finite elements", fields, scale=False)
    draw_lateral_cut(below, placement, fields, label=True)
    over.set(xlabel="", ylabel="x in mm")
    below.set(title="", xlabel="s across in mm")


def patches_figure(loads: Sequence[tuple[JudgedLoad, Placement]]) -> Figure:
    """Draw small pictures of pressure and lateral cut for several loads, each with its shift, load and verdict."""
    columns = min(4, len(loads))
    lines = -(-len(loads) // columns)
    figure = blank_figure(3.9 * columns, 5.2 * lines)
    axes = figure.subplots(2 * lines, columns, squeeze=False, height_ratios=[1.1, 1.0] * lines)
    for ax in axes.ravel():
        ax.set_axis_off()
    for number, (load, placement) in enumerate(loads):
        line, column = divmod(number, columns)
        over, below = axes[2 * line, column], axes[2 * line + 1, column]
        for ax in (over, below):
            ax.set_axis_on()
        _draw_small(over, below, load, placement)
        shift, kilonewtons = load.case.lateral_shift_mm, load.load_N / 1e3
        over.set(title=f"{shift:+z.2f} mm, {kilonewtons:.4g} kN: {load.answer.answer}")
        if number:
            below.get_legend().remove()
    return figure
