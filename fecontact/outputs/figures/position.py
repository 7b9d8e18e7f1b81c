"""Rail and wheel in section through the first touch point, and the picture of a case before it is solved."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.arrays import Floats
from fecontact.outputs.case_words import case_words
from fecontact.outputs.pair_names import body_words
from fecontact.outputs.profiles import draw_problems
from fecontact.outputs.style import SIDES, Colour, blank_figure, finish, legend_beside, save_figure
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.preview import Preview

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# --- Rail and wheel in section through the first touch point.

Lines = Mapping[str, tuple[Floats, Floats]]
# The wheel is drawn up to this distance from the touch point.
_ABOUT_MM = 75.0


def pair_figure(placement: Placement) -> Figure:
    """Draw rail and wheel in section through the first touch point, true to scale, with all touch points."""
    lines = section_lines(placement, _ABOUT_MM)
    (rail_y, rail_z), (wheel_y, wheel_z) = lines["rail"], lines["wheel"]
    extent = float(np.ptp(np.concatenate([rail_z, wheel_z])))
    figure = blank_figure(10.0, max(2.0, 1.4 + 7.5 * extent / (2.0 * _ABOUT_MM)))
    ax = figure.add_subplot()
    ax.fill_between(rail_y, rail_z, float(np.min(rail_z)) - 8.0, color="0.82", lw=0.0)
    ax.fill_between(wheel_y, wheel_z, float(np.max(wheel_z)) + 10.0, color="0.9", lw=0.0)
    draw_section(ax, placement, lines)
    ax.set(aspect="equal", xlabel="y in mm, from the track centre  (gauge side ←  → field side)", ylabel="z in mm")
    legend_beside(ax)
    return figure


def section_lines(placement: Placement, about_mm: float = np.inf) -> Lines:
    """Lines (y, z) in mm of rail and wheel, up to a distance from the first touch point."""
    rail, wheel = placement.rail, placement.wheel
    u_rail, u_wheel = (np.linspace(0.0, len(one.profile.segments) - 1e-9, 3000) for one in (rail, wheel))
    lines = {"rail": rail.section(u_rail)[:2], "wheel": wheel.silhouette(u_wheel)[2:]}
    near = {of: np.abs(y - placement.first.y_mm) < about_mm for of, (y, _) in lines.items()}
    return {of: (y[near[of]], z[near[of]]) for of, (y, z) in lines.items()}


def draw_section(ax: Axes, placement: Placement, lines: Lines) -> None:
    """Draw both lines and the touch points; the first touch point is filled."""
    names = {"rail": placement.rail.profile.name, "wheel": placement.wheel.profile.name}
    for (of, line), colour in zip(lines.items(), Colour.LINES.values(), strict=True):
        ax.plot(*line, color=colour, lw=1.8, label=body_words(of, names[of]))
    for number, touch in enumerate(placement.touch_points):
        label = "touch point" if number == 0 else ("further touch points" if number == 1 else None)
        inside = Colour.HERTZ if number == 0 else "white"
        ax.plot(touch.y_mm, touch.z_mm, "o", label=label, mfc=inside, mec=Colour.HERTZ, ms=7, zorder=5)
    finish(ax)


# --- The picture of a case before it is solved.


def preview_figure(seen: Preview, path: str | Path) -> Path:
    """Draw the pair in position, the place of contact, and the curvatures of both lines about the expected patch."""
    figure = blank_figure(13.0, 9.0)
    grid = figure.add_gridspec(2, 2)
    whole, near, bent = (figure.add_subplot(place) for place in (grid[0, :], grid[1, 0], grid[1, 1]))
    patch, touch = seen.expected, seen.placement.first
    lines = section_lines(seen.placement)
    for ax in (whole, near):
        draw_section(ax, seen.placement, lines)
    figure.suptitle(case_words(seen.case, seen.placement), fontsize=13)
    whole.set(xlabel=f"y in mm\n{SIDES}", ylabel="z (up) in mm")
    whole.set_aspect("equal", adjustable="datalim")
    reach = 0.8 * (patch.s_high_mm - patch.s_low_mm)
    near.set_xlim(touch.y_mm + patch.s_low_mm - reach, touch.y_mm + patch.s_high_mm + reach)
    rail = seen.placement.rail
    _, z, _ = rail.section(rail.parameter_at_y(np.linspace(*near.get_xlim(), 50)))
    low, high = float(np.nanmin(z)), float(np.nanmax(z))
    near.set_ylim(low - 0.3 * (high - low + 0.1), high + 0.6 * (high - low + 0.1))
    near.set(
        title="about the expected patch (shaded), vertical scale exaggerated",
        xlabel=f"y in mm\n{SIDES}",
        ylabel="z in mm",
    )
    near.axvspan(touch.y_mm + patch.s_low_mm, touch.y_mm + patch.s_high_mm, color=Colour.EXPECTED, alpha=0.3, lw=0)
    _draw_curvatures(bent, seen, reach)
    legend_beside(whole)
    wheel = seen.placement.wheel
    draw_problems(whole, rail.profile, rail.point)
    draw_problems(whole, wheel.profile, wheel.lowest_point)
    return save_figure(figure, path)


def _draw_curvatures(ax: Axes, seen: Preview, reach: float) -> None:
    """Curvature of rail and wheel, positive if convex, over the distance from the touch point."""
    touch, patch, banded = seen.placement.first, seen.expected, False
    s = np.linspace(patch.s_low_mm - reach, patch.s_high_mm + reach, 1200)
    for profile, u in ((seen.placement.rail.profile, touch.rail_u), (seen.placement.wheel.profile, touch.wheel_u)):
        colour = Colour.LINES[profile.kind]
        at = profile.at_arc_length(s + float(profile.arc_length(u)))
        curvature = profile.convex_sign * profile.evaluate(at).curvature_per_mm
        ax.plot(s, curvature, color=colour, lw=1.5, label=f"{profile.kind}")
        if (measured := profile.measured) is not None:
            # the arc length of a smoothed line begins at an offset, since it may be counted along a nominal line
            start = float(getattr(profile.segments[0], "s_from", 0.0))
            noise = np.interp(s + float(profile.arc_length(u)) + start, measured.s_mm, measured.curvature_noise_per_mm)
            ax.fill_between(s, curvature - 2.0 * noise, curvature + 2.0 * noise, color=colour, alpha=0.25, lw=0)
            banded = True
    ax.axvspan(patch.s_low_mm, patch.s_high_mm, color=Colour.EXPECTED, alpha=0.3, lw=0)
    ax.axvline(0.0, color="k", lw=0.8)
    ax.axhline(0.0, color="0.5", lw=0.8)
    for place in seen.placement.junctions:
        if s[0] <= place.s_mm <= s[-1]:
            ax.axvline(place.s_mm, color=Colour.LINES[place.profile.kind], ls=":", lw=1.0)
    ax.set(
        title=f"curvatures (dotted: junctions{'; bands: twice the noise' if banded else ''})",
        xlabel=f"distance across from the touch point in mm\n{SIDES}",
        ylabel="curvature in 1/mm, convex positive",
    )
    finish(ax)
    ax.legend(fontsize=9)
