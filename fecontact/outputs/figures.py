"""Pictures of a case, of a study and of a profile, as PNG files that are the same every time they are drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Criteria
from fecontact.comparison.measures import hertz_on
from fecontact.errors import InputError
from fecontact.files import write_atomically
from fecontact.geometry.placement import Placement
from fecontact.outputs.measure_words import WORDS
from fecontact.outputs.rows import deviation_column
from fecontact.outputs.series import series, short_name
from fecontact.profiles.curve import Profile
from fecontact.profiles.identity import profile_identity
from fecontact.solving.solve import CaseResult
from fecontact.theory.hertz import HertzContact

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]
Row = Mapping[str, Any]

_DPI = 130
# matplotlib's colours of lines.
_MOST_LABELS = 10
_FE, _HERTZ, _RAIL_JUNCTION, _WHEEL_JUNCTION = "#0b5fa5", "#d1495b", "0.35", "0.65"
# What the two colour maps show at zero.
_NO_PRESSURE, _NO_DIFFERENCE = "#440154", "#f7f6f6"
# Okabe and Ito's colours, told apart by the colour-blind and in grey.
_ANSWER_COLOURS = {"HOLDS": "#56b4e9", "UNRESOLVED": "#f0e442", "FAILS": "#d55e00"}
_MARKERS = "o^sDvP*X"
_ACROSS, _ROLLING = "s across in mm", "x (rolling) in mm"
_SIDES = "gauge side ←            → field side"


def case_figure(result: CaseResult, path: str | Path) -> Path:
    """Draw one case.

    Top: finite-element pressure, Hertz pressure (same scale) and their difference over the rail's surface, with the
    outline of Hertz's ellipse. Below: cuts through the peak of the finite elements, with the junctions of both
    profiles in the lateral one, and the case in words.
    """
    figure = blank_figure(15.0, 9.6)
    grid = figure.add_gridspec(2, 3, height_ratios=(1.15, 1.0))
    field = _covering_field(result)
    _draw_maps(figure, [figure.add_subplot(grid[0, k]) for k in range(3)], field, result.hertz)
    i, j = np.unravel_index(int(np.argmax(field.fe)), field.fe.shape)
    _draw_lateral_cut(figure.add_subplot(grid[1, 0]), field, int(i), result)
    _draw_rolling_cut(figure.add_subplot(grid[1, 1]), field, int(j), result.hertz)
    words = figure.add_subplot(grid[1, 2])
    words.axis("off")
    words.text(0.0, 1.0, _case_text(result), va="top", ha="left", family="monospace", fontsize=9.5, linespacing=1.45)
    return save_figure(figure, path)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Field:
    """Both pressures (nx, ns) in MPa on the nodes of the whole contact, far enough to hold Hertz's ellipse."""

    x_mm: Floats
    s_mm: Floats
    fe: Floats
    hertz: Floats


def _covering_field(result: CaseResult) -> _Field:
    hertz = result.hertz
    fe = result.load.fe.pressure.covering(hertz.extent_x_mm, hertz.extent_y_mm)
    return _Field(x_mm=fe.grid.x_mm, s_mm=fe.grid.s_mm, fe=fe.values, hertz=hertz_on(fe.grid, hertz))


def _draw_maps(figure: Figure, axes: Sequence[Axes], field: _Field, hertz: HertzContact) -> None:
    top = float(max(field.fe.max(), field.hertz.max()))
    difference = field.fe - field.hertz
    most = float(np.abs(difference).max()) or 1.0
    titles = ("finite elements", "Hertz", "finite elements minus Hertz")
    scales: tuple[dict[str, Any], ...] = (
        {"cmap": "viridis", "vmin": 0.0, "vmax": top},
        {"cmap": "viridis", "vmin": 0.0, "vmax": top},
        {"cmap": "RdBu_r", "vmin": -most, "vmax": most},
    )
    for ax, title, values, scale in zip(axes, titles, (field.fe, field.hertz, difference), scales, strict=True):
        image = ax.pcolormesh(field.s_mm, field.x_mm, values, shading="gouraud", rasterized=True, **scale)
        outline = "white" if scale["cmap"] == "viridis" else "0.1"
        ax.plot(*_outline(hertz), color=outline, lw=1.4, ls="--")
        ax.set(title=title, xlabel=f"{_ACROSS}\n{_SIDES}", ylabel=_ROLLING, aspect="equal")
        ax.set(xlim=_limits(field, hertz, axis=1), ylim=_limits(field, hertz, axis=0))
        # nothing presses outside of the grid
        ax.set_facecolor(_NO_PRESSURE if scale["cmap"] == "viridis" else _NO_DIFFERENCE)
        bar = figure.colorbar(image, cax=ax.inset_axes((1.03, 0.0, 0.045, 1.0)))
        bar.set_label("pressure in MPa" if title != titles[2] else "difference in MPa")


def _outline(hertz: HertzContact) -> tuple[Floats, Floats]:
    """Edge of Hertz's ellipse: s and x (mm)."""
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    first, second = hertz.a_mm * np.cos(turn), hertz.b_mm * np.sin(turn)
    c, s = np.cos(hertz.orientation_rad), np.sin(hertz.orientation_rad)
    return first * s + second * c, first * c - second * s


def _limits(field: _Field, hertz: HertzContact, *, axis: int) -> tuple[float, float]:
    """Range that shows both patches with some room, and not the whole grid."""
    line = (field.x_mm, field.s_mm)[axis]
    pressed = line[np.flatnonzero(np.any(field.fe > 0.0, axis=1 - axis))]
    reach = 0.5 * (hertz.extent_x_mm, hertz.extent_y_mm)[axis]
    low, high = min(float(pressed[0]), -reach), max(float(pressed[-1]), reach)
    room = 0.12 * (high - low)
    return low - room, high + room


def _draw_lateral_cut(ax: Axes, field: _Field, i: int, result: CaseResult) -> None:
    s = np.linspace(field.s_mm[0], field.s_mm[-1], 400)
    _draw_cut(ax, (field.s_mm, field.fe[i]), (s, result.hertz.pressure_MPa(field.x_mm[i], s)))
    low, high = _limits(field, result.hertz, axis=1)
    for junctions, colour, style, label in (
        (_rail_junctions(result.placement), _RAIL_JUNCTION, "-", "rail junction"),
        (_wheel_junctions(result.placement), _WHEEL_JUNCTION, ":", "wheel junction"),
    ):
        shown = junctions[(junctions > low) & (junctions < high)]
        for number, position in enumerate(shown):
            ax.axvline(float(position), color=colour, ls=style, lw=1.3, label=label if number == 0 else None, zorder=0)
    ax.set(xlabel=f"{_ACROSS}\n{_SIDES}", title=f"lateral cut at x = {field.x_mm[i]:z.2f} mm", xlim=(low, high))
    ax.legend(loc="best", fontsize=9)


def _draw_rolling_cut(ax: Axes, field: _Field, j: int, hertz: HertzContact) -> None:
    x = np.linspace(field.x_mm[0], field.x_mm[-1], 400)
    _draw_cut(ax, (field.x_mm, field.fe[:, j]), (x, hertz.pressure_MPa(x, field.s_mm[j])))
    ax.set(xlabel=_ROLLING, title=f"rolling cut at s = {field.s_mm[j]:z.2f} mm", xlim=_limits(field, hertz, axis=0))
    ax.legend(loc="best", fontsize=9)


def _draw_cut(ax: Axes, fe: tuple[Floats, Floats], hertz: tuple[Floats, Floats]) -> None:
    ax.plot(*fe, color=_FE, marker="o", ms=2.5, lw=1.3, label="finite elements")
    ax.plot(*hertz, color=_HERTZ, ls="--", lw=1.6, label="Hertz")
    ax.set(ylabel="pressure in MPa", ylim=(0.0, 1.12 * max(float(fe[1].max()), float(hertz[1].max()), 1.0)))
    ax.grid(alpha=0.3)


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


def _case_text(result: CaseResult) -> str:
    case, comparison, first = result.case, result.comparison, result.placement.first
    verdict, side = result.verdict, result.load.sides[-1]
    lines = [
        f"rail {short_name(profile_identity(case.rail))}, wheel {short_name(profile_identity(case.wheel))}",
        f"lateral shift {case.lateral_shift_mm:+z.2f} mm, {case.load_kind} load {case.load_N / 1e3:.1f} kN",
        f"touch at {first.rail_y_mm:+z.2f} mm on the rail, {1e3 * first.contact_angle_rad:+z.1f} mrad",
        "",
        f"{'':<10} {'FE':>6} {'Hertz':>6} {'off by':>9} {'±':>6}",
    ]
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
    lines += ["", f"Hertz {verdict.answer}" + (f": {verdict.cause}" if verdict.cause else "")]
    lines.append(f"L2 {1e2 * comparison.pressure_l2:.1f} %, overlap {comparison.overlap:.2f}")
    lines.append(f"lobes {len(comparison.patch.lobes)}, patches {comparison.patch.pieces}")
    lines.append(f"status: {result.status}")
    return "\n".join(lines)


def study_figure(
    rows: Sequence[Row], path: str | Path, rail: Profile | None = None, criteria: Criteria | None = None
) -> Path:
    """Draw a study over the lateral shift: peak pressures, how far Hertz is off, and where the wheel touches the rail.

    How far he is off is drawn for each measure that decides, in parts of its limit, where there is one series and one
    set of criteria; otherwise for peak and area, in percent. One colour for each series; more of them than there are
    colours are not named. A row whose status is not `converged` is a cross that no line goes through; it lies at its
    value, or at the bottom of the first panel if it has none. The junctions of `rail` are drawn beside the touch
    points.

    Parameters
    ----------
    criteria
        Those by which all rows were judged, None if there is more than one set.

    Raises
    ------
    InputError
        If there are no rows.
    """
    if not rows:
        raise InputError("study figure: there are no rows to draw")
    found = series(rows)
    figure = blank_figure(10.0, 11.0)
    peak, off, touch = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.4, 0.9))
    # more than there are colours cannot be told apart anyway
    shown = len(found) <= _MOST_LABELS
    for number, one in enumerate(found):
        colour, group = f"C{number % 10}", one.rows
        label = f", {one.label}" if one.label and shown else ""
        # an underscore keeps a line out of the legend
        kept = "" if shown or number == 0 else "_"
        fe, hertz = f"{kept}FE{label}", f"{kept}Hertz{label}"
        _draw_series(peak, group, "p_max_fe_MPa", color=colour, marker="o", label=fe)
        _draw_series(peak, group, "p_max_hertz_MPa", color=colour, marker="s", ls="--", mfc="white", label=hertz)
        _draw_series(touch, group, "touch_rail_y_mm", color=colour, marker="o")
        _draw_without_value(peak, group)
        if len(found) > 1 or criteria is None:
            _draw_deviations(off, group, colour, (f"{kept}peak{label}", f"{kept}area{label}"))
    if len(found) == 1 and criteria is not None:
        _draw_used_limits(off, found[0].rows, criteria)
    else:
        _finish_deviations(off, criteria)
    _finish_study(peak, off, touch, rows, rail)
    return save_figure(figure, path)


def _draw_deviations(ax: Axes, group: Sequence[Row], colour: str, labels: tuple[str, str]) -> None:
    peak, area = labels
    _draw_series(ax, group, "p_max_deviation_percent", color=colour, marker="o", label=peak)
    _draw_series(ax, group, "area_deviation_percent", color=colour, marker="^", ls=":", mfc="white", label=area)


def _finish_deviations(ax: Axes, criteria: Criteria | None) -> None:
    limits = {} if criteria is None else criteria.limits
    drawn = [(limits[name], WORDS[name].short) for name in ("p_max_MPa", "area_mm2") if name in limits]
    for (limit, _), grey in zip(sorted(drawn, reverse=True), ("0.93", "0.86"), strict=False):
        ax.axhspan(-1e2 * limit, 1e2 * limit, color=grey, zorder=0)
    ax.axhline(0.0, color="0.4", lw=0.8)
    bands = ", ".join(f"{short} ±{1e2 * limit:g} %" for limit, short in drawn)
    ax.set(ylabel="Hertz against FE in %" + (f"\n(bands: {bands})" if bands else ""))


def _draw_used_limits(ax: Axes, group: Sequence[Row], criteria: Criteria) -> None:
    """How far Hertz is off in every measure that decides, in parts of its limit, and the verdicts above."""
    for number, (measure, limit) in enumerate(criteria.limits.items()):
        column, _, factor = deviation_column(measure)
        used = [
            {**row, "used": None if row.get(column) is None else abs(float(row[column])) / (factor * limit)}
            for row in group
        ]
        style = {"color": f"C{number}", "marker": _MARKERS[number], "ls": "-" if number % 2 else "--"}
        _draw_series(ax, used, "used", label=WORDS[measure].short, **style)
    ax.axhspan(0.0, 1.0, color="0.93", zorder=0)
    ax.axhline(1.0, color="0.3", lw=1.0, zorder=1)
    # what is within the limits on a line, what is beyond by its magnitude
    ax.set_yscale("symlog", linthresh=1.0, linscale=1.0)
    top = max(3.0, 1.3 * ax.get_ylim()[1])
    ax.set_ylim(0.0, top)
    ticks = [tick for tick in (0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0) if tick <= top]
    ax.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.minorticks_off()
    for answer, colour in _ANSWER_COLOURS.items():
        shifts = [
            float(row["lateral_shift_mm"])
            for row in group
            if row["status"] == "converged" and row.get("verdict") == answer
        ]
        if shifts:
            place: dict[str, Any] = {"transform": ax.get_xaxis_transform(), "clip_on": False}
            ax.plot(shifts, [1.0] * len(shifts), "s", ms=8, mfc=colour, mec="0.3", mew=0.7, label=answer, **place)
    ax.set(ylabel="Hertz against FE\nin parts of the limit")
    # outside: so many lines leave no room for it
    ax.legend(fontsize=9, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)


def _draw_series(ax: Axes, group: Sequence[Row], key: str, **style: Any) -> None:
    shift = np.array([float(row["lateral_shift_mm"]) for row in group])
    value = np.array([np.nan if row.get(key) is None else float(row[key]) for row in group])
    good = np.array([row["status"] == "converged" for row in group])
    # NaN breaks the line, so that nobody reads a value between a good and a bad row
    ax.plot(shift, np.where(good, value, np.nan), lw=1.6, ms=5.5, **style)
    ax.plot(shift[~good], value[~good], color=style["color"], marker="x", ms=9, mew=2.0, ls="none")


def _draw_without_value(ax: Axes, group: Sequence[Row]) -> None:
    lost = [float(row["lateral_shift_mm"]) for row in group if row.get("p_max_fe_MPa") is None]
    ax.plot(
        lost, [0.04] * len(lost), transform=ax.get_xaxis_transform(), color="0.2", marker="x", ms=9, mew=2.0, ls="none"
    )


def _finish_study(peak: Axes, off: Axes, touch: Axes, rows: Sequence[Row], rail: Profile | None) -> None:
    pairs = sorted({(short_name(str(row["rail"])), short_name(str(row["wheel"]))) for row in rows})
    loads = sorted({float(row["load_kN"]) for row in rows})
    title = "; ".join(f"rail {rail}, wheel {wheel}" for rail, wheel in pairs[:3]) + ("; ..." if len(pairs) > 3 else "")
    peak.set(title=title + (f", {loads[0]:g} kN" if len(loads) == 1 else ""), ylabel="peak pressure in MPa")
    peak.set_ylim(bottom=0.0)
    if rail is not None:
        _draw_junction_levels(touch, rail)
    touch.set(xlabel="lateral shift of the wheelset in mm  (positive: towards this rail)")
    touch.set(ylabel="touch point on the rail\ny in mm  (gauge side negative)")
    if any(row["status"] != "converged" for row in rows):
        peak.plot([], [], color="0.2", marker="x", ms=9, mew=2.0, ls="none", label="not usable")
    for ax in (peak, off):
        if ax.get_legend() is None:
            ax.legend(fontsize=9, ncols=2 if len(ax.get_legend_handles_labels()[0]) > 4 else 1)
    for ax in (peak, off, touch):
        ax.grid(alpha=0.3)


def _draw_junction_levels(ax: Axes, rail: Profile) -> None:
    low, high = ax.get_ylim()
    room = 0.15 * (high - low) + 2.0
    shown = [junction for junction in rail.junctions if low - room < junction.y_mm < high + room]
    for junction in shown:
        ax.axhline(junction.y_mm, color=_RAIL_JUNCTION, lw=1.0, ls="-.", zorder=0)
        radii = (_radius(junction.curvature_left_per_mm), _radius(junction.curvature_right_per_mm))
        ax.annotate(
            f"{radii[0]} | {radii[1]}",
            (0.995, junction.y_mm),
            xycoords=("axes fraction", "data"),
            xytext=(0, 2),
            textcoords="offset points",
            ha="right",
            va="bottom",
            fontsize=8.5,
            color=_RAIL_JUNCTION,
        )
    # room for the words above the highest line
    top = max([high, *(junction.y_mm + 0.5 * room for junction in shown)])
    ax.set_ylim(low - room, top + 0.5 * room)


def _radius(curvature_per_mm: float) -> str:
    return "straight" if abs(curvature_per_mm) < 1e-9 else f"R{1.0 / curvature_per_mm:.4g}"


def profile_figure(profile: Profile, path: str | Path) -> Path:
    """Draw a profile: its line, and its curvature (positive where convex) over y, with the junctions marked."""
    figure = blank_figure(10.0, 8.0)
    line, curvature = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 1.0))
    for number in range(len(profile.segments)):
        # a hair inside the ends, so that each segment shows its own curvature up to them
        p = profile.evaluate(number + np.linspace(1e-9, 1.0 - 1e-9, 200))
        line.plot(p.y, p.z, color=f"C{number % 2}", lw=2.0)
        curvature.plot(p.y, profile.convex_sign * p.curvature_per_mm, color=f"C{number % 2}", lw=2.0)
    for junction in profile.junctions:
        line.plot(junction.y_mm, junction.z_mm, "o", color=_RAIL_JUNCTION, ms=5)
        for ax in (line, curvature):
            ax.axvline(junction.y_mm, color=_RAIL_JUNCTION, lw=0.8, ls=":", zorder=0)
    # curvatures of a head span four decades of either sign
    curvature.set_yscale("symlog", linthresh=1e-3)
    curvature.margins(y=0.08)
    curvature.axhline(0.0, color="0.5", lw=0.8)
    line.set(title=f"{profile.kind} {short_name(profile.name)}", ylabel="z (up) in mm")
    curvature.set(ylabel="curvature in 1/mm\n(convex positive)", xlabel=f"y in mm\n{_SIDES}")
    for ax in (line, curvature):
        ax.grid(alpha=0.3)
    return save_figure(figure, path)


def blank_figure(width: float, height: float) -> Figure:
    """An empty figure of a size in inches."""
    # Figure itself, not pyplot: a study draws hundreds, and pyplot would keep them all
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=_DPI)
    figure.set_layout_engine("constrained", w_pad=0.12, h_pad=0.12)
    return figure


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write a figure as PNG, the same bytes every time."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    # no version in the file either: the picture is all that may differ between two runs
    return write_atomically(
        path, lambda temporary: canvas.print_figure(temporary, dpi=_DPI, format="png", metadata={"Software": None})
    )
