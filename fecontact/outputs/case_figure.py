"""The picture of a case: its verdict, both pressures and their difference, cuts through the peak, and all measures."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.measures import hertz_on
from fecontact.comparison.patch import signed_square
from fecontact.contact.grid import ContactGrid
from fecontact.geometry.placement import Placement
from fecontact.outputs.measure_words import WORDS
from fecontact.outputs.style import (
    ACROSS,
    ANSWERS,
    DIFFERENCE,
    FE,
    HERTZ,
    PRESSURE,
    RAIL_JUNCTION,
    ROLLING,
    SIDES,
    WHEEL_JUNCTION,
    blank_figure,
    save_figure,
)
from fecontact.outputs.verdict_words import case_words, verdict_reason
from fecontact.solving.solve import CaseResult
from fecontact.theory.hertz import HertzContact

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

_WIDTH = 15.0
# Inches of a map's frame where three stand side by side, and its lowest and largest height.
_MAP_WIDTH, _LEAST_HEIGHT, _MOST_HEIGHT = 3.7, 1.3, 4.4
# Room in inches for the head, for titles and labels of a row of maps, for the cuts, and for what a map has beside it.
_HEAD, _LABELS, _CUTS, _BESIDE = 0.55, 1.15, 4.2, 1.75
# The words need this width.
_WORDS = 4.2
# Colours of a pressure map and of a difference where nothing presses.
_NO_PRESSURE, _NO_DIFFERENCE = "#440154", "#f7f6f6"


@dataclass(frozen=True, kw_only=True, eq=False)
class PressureFields:
    """Both pressures (nx, ns) in MPa on the nodes of the whole contact, far enough to hold Hertz's ellipse."""

    grid: ContactGrid
    fe: Floats
    hertz: Floats
    ellipse: HertzContact

    @classmethod
    def of(cls, load: JudgedLoad) -> PressureFields:
        """The fields of a judged load."""
        hertz = load.hertz
        fe = load.fe.pressure.covering(hertz.extent_x_mm, hertz.extent_y_mm)
        return cls(grid=fe.grid, fe=fe.values, hertz=hertz_on(fe.grid, hertz), ellipse=hertz)

    @property
    def peak(self) -> tuple[int, int]:
        """Indices of the highest finite-element pressure."""
        i, j = np.unravel_index(int(np.argmax(self.fe)), self.fe.shape)
        return int(i), int(j)

    @property
    def top_MPa(self) -> float:
        """The highest pressure of both."""
        return float(max(self.fe.max(), self.hertz.max()))

    def limits_mm(self, *, across: bool) -> tuple[float, float]:
        """Range along s (`across`) or x that shows both patches with some room, and not the whole grid."""
        line = self.grid.s_mm if across else self.grid.x_mm
        pressed = line[np.flatnonzero(np.any(self.fe > 0.0, axis=0 if across else 1))]
        reach = 0.5 * (self.ellipse.extent_y_mm if across else self.ellipse.extent_x_mm)
        low, high = min(float(pressed[0]), -reach), max(float(pressed[-1]), reach)
        room = 0.12 * (high - low)
        return low - room, high + room


def case_figure(result: CaseResult, path: str | Path) -> Path:
    """Draw one case as PNG, and as SVG beside it; see `draw_case`."""
    fields = PressureFields.of(result.load)
    figure = blank_figure(_WIDTH, _height(fields))
    draw_case(figure, result.load, result.placement, fields)
    return save_figure(figure, path)


def draw_case(figure: Figure, load: JudgedLoad, placement: Placement, fields: PressureFields | None = None) -> None:
    """Draw a judged load into a figure: the head with the verdict, maps, cuts and words.

    Maps show the rail's surface around the first touch point: finite elements, Hertz (same scale) and their difference,
    with the outlines of both patches. Cuts go through the peak of the finite elements; below the lateral one is the
    rail, true to scale.
    """
    fields = fields or PressureFields.of(load)
    tall, height = _is_tall(fields), _map_height(fields)
    rows = figure.add_gridspec(3, 1, height_ratios=(_HEAD, height + _LABELS, _CUTS))
    _draw_head(figure.add_subplot(rows[0]), load)
    widths = [height / _ratio(fields) + _BESIDE] * 3 if tall else [1.0] * 3
    rest = [_WIDTH - sum(widths)] if tall else []
    maps = rows[1].subgridspec(1, 3 + len(rest), width_ratios=widths + rest)
    for number, kind in enumerate(("finite elements", "Hertz", "finite elements minus Hertz")):
        draw_pressure(figure.add_subplot(maps[0, number]), load, kind, fields)
    cuts = rows[2].subgridspec(1, 2 if tall else 3)
    across = cuts[0, 0].subgridspec(2, 1, height_ratios=(3.0, 1.0))
    lateral = figure.add_subplot(across[0])
    draw_lateral_cut(lateral, load, placement, fields)
    _draw_rail(figure.add_subplot(across[1], sharex=lateral), placement, fields)
    draw_rolling_cut(figure.add_subplot(cuts[0, 1]), load, fields)
    words = figure.add_subplot(maps[0, 3] if tall else cuts[0, 2])
    words.axis("off")
    words.text(0.0, 1.0, _case_text(load, placement), va="top", family="monospace", fontsize=9.3, linespacing=1.4)


def _ratio(fields: PressureFields) -> float:
    """Height over width of what a map shows."""
    (x_low, x_high), (s_low, s_high) = fields.limits_mm(across=False), fields.limits_mm(across=True)
    return (x_high - x_low) / (s_high - s_low)


def _is_tall(fields: PressureFields) -> bool:
    # three tall maps leave room for the words beside them
    return 3.0 * (_MOST_HEIGHT / _ratio(fields) + _BESIDE) + _WORDS <= _WIDTH


def _map_height(fields: PressureFields) -> float:
    return float(np.clip(_MAP_WIDTH * _ratio(fields), _LEAST_HEIGHT, _MOST_HEIGHT))


def _height(fields: PressureFields) -> float:
    return _HEAD + _map_height(fields) + _LABELS + _CUTS


def _draw_head(ax: Axes, load: JudgedLoad) -> None:
    """Verdict and why, and what was solved, over the whole width."""
    ax.axis("off")
    answer = load.verdict.answer
    ax.text(
        *(0.005, 0.9, f" Hertz {answer} "),
        va="top",
        fontsize=15,
        weight="bold",
        bbox={"fc": ANSWERS[answer], "ec": "0.2", "boxstyle": "round,pad=0.35"},
    )
    ax.text(0.135, 1.05, case_words(load.case), va="top", fontsize=13)
    ax.text(0.135, 0.42, verdict_reason(load), va="top", fontsize=11)


def draw_pressure(ax: Axes, load: JudgedLoad, kind: str, fields: PressureFields | None = None) -> None:
    """Draw a map of `finite elements`, `Hertz`, or `finite elements minus Hertz` over the rail's surface into axes.

    The outlines of both patches are drawn on it, and the lobes of the finite elements are numbered, the highest first.
    """
    fields = fields or PressureFields.of(load)
    of: dict[str, tuple[Floats, dict[str, Any], str]] = {}
    top = fields.top_MPa
    of["finite elements"] = (fields.fe, {"cmap": PRESSURE, "vmin": 0.0, "vmax": top}, _NO_PRESSURE)
    of["Hertz"] = (fields.hertz, {"cmap": PRESSURE, "vmin": 0.0, "vmax": top}, _NO_PRESSURE)
    difference = fields.fe - fields.hertz
    most = float(np.abs(difference).max()) or 1.0
    of["finite elements minus Hertz"] = (
        difference,
        {"cmap": DIFFERENCE, "vmin": -most, "vmax": most},
        _NO_DIFFERENCE,
    )
    values, scale, ground = of[kind]
    image = ax.pcolormesh(fields.grid.s_mm, fields.grid.x_mm, values, shading="gouraud", rasterized=True, **scale)
    if ground == _NO_DIFFERENCE:
        # both ends of the colour map are dark in grey: dashed where Hertz presses more
        levels = most * np.array([-0.75, -0.5, -0.25, 0.25, 0.5, 0.75])
        ax.contour(fields.grid.s_mm, fields.grid.x_mm, values, levels=levels, colors="0.25", linewidths=0.6)
    _draw_outlines(ax, fields)
    _draw_lobes(ax, load, fields)
    ax.set(title=kind, xlabel=f"{ACROSS}\n{SIDES}", ylabel=ROLLING, aspect="equal", facecolor=ground)
    ax.set(xlim=fields.limits_mm(across=True), ylim=fields.limits_mm(across=False))
    bar = ax.figure.colorbar(image, cax=ax.inset_axes((1.03, 0.0, 0.045, 1.0)))
    bar.set_label("difference in MPa" if ground == _NO_DIFFERENCE else "pressure in MPa")


def _draw_outlines(ax: Axes, fields: PressureFields) -> None:
    """Edges of both patches, white on black so that they are seen on every colour: the ellipse is dashed."""
    (hx, hs), grid = fields.grid.steps_mm, fields.grid
    x = np.concatenate([[grid.x_mm[0] - hx], grid.x_mm, [grid.x_mm[-1] + hx]])
    s = np.concatenate([[grid.s_mm[0] - hs], grid.s_mm, [grid.s_mm[-1] + hs]])
    square = signed_square(fields.fe)
    ellipse = ellipse_outline(fields.ellipse)
    # drawn twice and not with path effects, with which SVG files differ from one drawing to the next
    for colour, width, name in (("black", 2.8, "_"), ("white", 1.4, "")):
        ax.plot(*ellipse, color=colour, lw=width, ls="-" if name else (0, (4, 2)), label=f"{name}Hertz")
        edge = ax.contour(s, x, square, levels=[0.0], colors=colour, linewidths=width)
        edge.set(label=f"{name}finite elements")


def ellipse_outline(hertz: HertzContact, points: int = 181) -> tuple[Floats, Floats]:
    """Edge of Hertz's ellipse: s and x (points,) in mm, closed."""
    turn = np.linspace(0.0, 2.0 * np.pi, points)
    first, second = hertz.a_mm * np.cos(turn), hertz.b_mm * np.sin(turn)
    c, s = np.cos(hertz.orientation_rad), np.sin(hertz.orientation_rad)
    return first * s + second * c, first * c - second * s


def _draw_lobes(ax: Axes, load: JudgedLoad, fields: PressureFields) -> None:
    lobes = load.comparison.patch.lobes
    if len(lobes) < 2:
        return
    for number, lobe in enumerate(lobes, start=1):
        column = int(np.argmin(np.abs(fields.grid.s_mm - lobe.y_mm)))
        x = float(fields.grid.x_mm[int(np.argmax(fields.fe[:, column]))])
        around = {"fc": "white", "ec": "black", "boxstyle": "circle,pad=0.15", "lw": 0.8}
        ax.text(lobe.y_mm, x, str(number), ha="center", va="center", fontsize=8, weight="bold", bbox=around)


def draw_lateral_cut(
    ax: Axes, load: JudgedLoad, placement: Placement, fields: PressureFields | None = None, *, label: bool = False
) -> None:
    """Draw both pressures across, through the peak of the finite elements, with the junctions of both profiles.

    With `label` the axis across is labelled, which otherwise belongs to the rail below.
    """
    fields = fields or PressureFields.of(load)
    i, grid = fields.peak[0], fields.grid
    s = np.linspace(grid.s_mm[0], grid.s_mm[-1], 400)
    _draw_cut(ax, (grid.s_mm, fields.fe[i]), (s, fields.ellipse.pressure_MPa(grid.x_mm[i], s)))
    low, high = fields.limits_mm(across=True)
    for junctions, colour, style, name in (
        (_rail_junctions(placement), RAIL_JUNCTION, "-", "rail junction"),
        (_wheel_junctions(placement), WHEEL_JUNCTION, ":", "wheel junction"),
    ):
        shown = junctions[(junctions > low) & (junctions < high)]
        for number, position in enumerate(shown):
            ax.axvline(float(position), color=colour, ls=style, lw=1.3, label=name if number == 0 else None, zorder=0)
    ax.set(title=f"lateral cut at x = {grid.x_mm[i]:z.2f} mm", xlim=(low, high))
    if label:
        ax.set(xlabel=f"{ACROSS}\n{SIDES}")
    else:
        ax.tick_params(labelbottom=False)
    ax.legend(loc="best", fontsize=9)


def draw_rolling_cut(ax: Axes, load: JudgedLoad, fields: PressureFields | None = None) -> None:
    """Draw both pressures along the running direction, through the peak of the finite elements."""
    fields = fields or PressureFields.of(load)
    j, grid = fields.peak[1], fields.grid
    x = np.linspace(grid.x_mm[0], grid.x_mm[-1], 400)
    _draw_cut(ax, (grid.x_mm, fields.fe[:, j]), (x, fields.ellipse.pressure_MPa(x, grid.s_mm[j])))
    ax.set(xlabel=ROLLING, title=f"rolling cut at s = {grid.s_mm[j]:z.2f} mm", xlim=fields.limits_mm(across=False))
    ax.legend(loc="best", fontsize=9)


def _draw_cut(ax: Axes, fe: tuple[Floats, Floats], hertz: tuple[Floats, Floats]) -> None:
    ax.plot(*fe, color=FE, marker="o", ms=2.5, lw=1.3, label="finite elements")
    ax.plot(*hertz, color=HERTZ, ls="--", lw=1.6, label="Hertz")
    ax.set(ylabel="pressure in MPa", ylim=(0.0, 1.12 * max(float(fe[1].max()), float(hertz[1].max()), 1.0)))
    ax.grid(alpha=0.3)


def _draw_rail(ax: Axes, placement: Placement, fields: PressureFields) -> None:
    """The rail's line over the same s as the cut above it, true to scale, in the frame of the first touch point."""
    low, high = fields.limits_mm(across=True)
    s = np.linspace(low, high, 300)
    points, _ = placement.surface(0.0, s)
    first = placement.first
    height = (points - np.array([first.x_mm, first.y_mm, first.z_mm])) @ first.normal
    there = np.isfinite(height)
    bottom = float(np.nanmin(height)) - 0.06 * (high - low)
    ax.fill_between(s[there], height[there], bottom, color="0.85", lw=0.0)
    ax.plot(s, height, color="0.2", lw=1.4)
    ends = [low, *(float(k) for k in sorted(_rail_junctions(placement)) if low < k < high), high]
    for place in ends[1:-1]:
        ax.axvline(place, color=RAIL_JUNCTION, lw=1.3, zorder=0)
    profile = placement.rail.profile
    for left, right in pairwise(ends):
        u = profile.at_arc_length(0.5 * (left + right) + placement.first_arc_length_mm)
        curvature = profile.convex_sign * float(profile.evaluate(u).curvature_per_mm)
        if np.isfinite(curvature) and right - left > 0.12 * (high - low):
            radius = "straight" if abs(curvature) < 1e-9 else f"R {1.0 / curvature:.4g}"
            ax.text(0.5 * (left + right), bottom, radius, ha="center", va="bottom", fontsize=8.5)
    ax.set(xlabel=f"{ACROSS}\n{SIDES}", ylabel="rail", yticks=[], aspect="equal", adjustable="datalim")
    ax.set_xlim(low, high)


def _rail_junctions(placement: Placement) -> Floats:
    """Positions s (mm) of the rail's junctions."""
    profile = placement.rail.profile
    y = np.array([junction.y_mm for junction in profile.junctions])
    return profile.arc_length(profile.snap(profile.locate(y))) - placement.first_arc_length_mm


def _wheel_junctions(placement: Placement) -> Floats:
    """Positions (mm) of the wheel's junctions along its own line, which lies on the rail's near the touch point."""
    profile = placement.wheel.profile
    y = np.array([junction.y_mm for junction in profile.junctions])
    at_touch = float(profile.arc_length(placement.first.wheel_u))
    return profile.arc_length(profile.snap(profile.locate(y))) - at_touch


def _case_text(load: JudgedLoad, placement: Placement) -> str:
    comparison, first, side = load.comparison, placement.first, load.sides[-1]
    lines = [f"{'':<10} {'FE':>6} {'Hertz':>6} {'off by':>9} {'±':>6}"]
    fe, hertz = comparison.fe.as_dict(), side.measures.as_dict()
    for name, answer in side.verdict.each.items():
        words = WORDS[name]
        head = f"{words.short} {words.unit}" if name in fe else words.short
        values = (f"{of[name]:.4g}" if name in of else "" for of in (fe, hertz))
        off, unsure = words.off(side.deviation[name]), words.off(side.uncertainty[name], size=True).split()[0]
        lines.append(f"{head:<10} {' '.join(f'{value:>6}' for value in values)} {off:>9} {unsure:>6} {answer}")
    if first.at_junction:
        # the ellipse drawn, and the numbers, are those of one side
        lines.append("all with the curvature of the field side")
    lines += ["", f"touch at {first.rail_y_mm:+z.2f} mm on the rail, {1e3 * first.contact_angle_rad:+z.1f} mrad"]
    lobes = comparison.patch.lobes
    for number, lobe in enumerate(lobes if len(lobes) > 1 else (), start=1):
        lines.append(
            f"lobe {number} at {lobe.y_mm:+z.1f} mm: {lobe.p_max_MPa:.0f} MPa, {1e2 * lobe.force_share:.1f} % of it"
        )
    lines.append(f"lobes {len(lobes)}, patches {comparison.patch.pieces}")
    lines.append(f"L2 {1e2 * comparison.pressure_l2:.1f} %, overlap {comparison.overlap:.2f}")
    size_x, size_s = load.level.nodal.grid.steps_mm
    lines.append(f"elements {size_x:.2f} by {size_s:.2f} mm, {len(load.solved.levels)} meshes")
    lines.append(f"status: {load.status}")
    return "\n".join(lines)
