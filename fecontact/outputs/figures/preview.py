"""Pictures of a case before it is solved, and of a profile with the points behind it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.outputs.figures.profile import draw_problems
from fecontact.outputs.figures.style import (
    EXPECTED,
    HERTZ,
    POINTS,
    RAIL,
    RAIL_JUNCTION,
    SIDES,
    WHEEL,
    blank_figure,
    finish,
    legend_beside,
    save_figure,
)
from fecontact.outputs.records.preview import junctions_of
from fecontact.outputs.words.cases import case_words
from fecontact.outputs.words.pairs import short_name
from fecontact.profiles.curve import Profile
from fecontact.solving.preview import Preview

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def preview_figure(seen: Preview, path: str | Path) -> Path:
    """Draw the pair in position, the place of contact, and the curvatures of both lines about the expected patch."""
    figure = blank_figure(13.0, 9.0)
    grid = figure.add_gridspec(2, 2)
    whole, near, bent = (figure.add_subplot(place) for place in (grid[0, :], grid[1, 0], grid[1, 1]))
    patch, touch = seen.expected, seen.placement.first
    for ax in (whole, near):
        _draw_lines(ax, seen)
    figure.suptitle(case_words(seen.case, seen.placement), fontsize=13)
    whole.set(xlabel=f"y in mm\n{SIDES}", ylabel="z (up) in mm")
    whole.set_aspect("equal", adjustable="datalim")
    reach = 0.8 * (patch.s_high_mm - patch.s_low_mm)
    near.set_xlim(touch.y_mm + patch.s_low_mm - reach, touch.y_mm + patch.s_high_mm + reach)
    rail = seen.placement.rail
    _, z, _ = rail.section(rail.parameter_at_y(np.linspace(*near.get_xlim(), 50)))
    low, high = float(np.nanmin(z)), float(np.nanmax(z))
    near.set_ylim(low - 0.3 * (high - low + 0.1), high + 0.6 * (high - low + 0.1))
    near.set(title="about the expected patch (shaded), heights drawn out", xlabel=f"y in mm\n{SIDES}", ylabel="z in mm")
    near.axvspan(touch.y_mm + patch.s_low_mm, touch.y_mm + patch.s_high_mm, color=EXPECTED, alpha=0.3, lw=0)
    _draw_curvatures(bent, seen, reach)
    legend_beside(whole)
    wheel = seen.placement.wheel
    draw_problems(whole, rail.profile, rail.point)
    draw_problems(whole, wheel.profile, wheel.lowest_point)
    return save_figure(figure, path)


def _draw_lines(ax: Axes, seen: Preview) -> None:
    placed = seen.placement
    u = np.linspace(0.0, len(placed.rail.profile.segments), 3000)
    y, z, _ = placed.rail.section(u)
    ax.plot(y, z, color=RAIL, lw=1.8, label=f"rail {short_name(placed.rail.profile.name)}")
    u = np.linspace(0.0, len(placed.wheel.profile.segments), 3000)
    _, _, y, z = placed.wheel.silhouette(u)
    ax.plot(y, z, color=WHEEL, lw=1.8, label=f"wheel {short_name(placed.wheel.profile.name)}")
    for k, touch in enumerate(placed.touch_points):
        ax.plot(touch.y_mm, touch.z_mm, "o", color=HERTZ, ms=7 if k == 0 else 6, mfc=HERTZ if k == 0 else "white")
    finish(ax)


def _draw_curvatures(ax: Axes, seen: Preview, reach: float) -> None:
    """Curvature of the rail and of the wheel, positive where convex, over the distance from the touch point."""
    touch, patch, banded = seen.placement.first, seen.expected, False
    s = np.linspace(patch.s_low_mm - reach, patch.s_high_mm + reach, 1200)
    for profile, u, colour in (
        (seen.placement.rail.profile, touch.rail_u, RAIL),
        (seen.placement.wheel.profile, touch.wheel_u, WHEEL),
    ):
        at = profile.at_arc_length(s + float(profile.arc_length(u)))
        curvature = profile.convex_sign * profile.evaluate(at).curvature_per_mm
        ax.plot(s, curvature, color=colour, lw=1.5, label=f"{profile.kind}")
        if (measured := profile.measured) is not None:
            start = _start_of(profile)
            noise = np.interp(s + float(profile.arc_length(u)) + start, measured.s_mm, measured.curvature_noise_per_mm)
            ax.fill_between(s, curvature - 2.0 * noise, curvature + 2.0 * noise, color=colour, alpha=0.25, lw=0)
            banded = True
    ax.axvspan(patch.s_low_mm, patch.s_high_mm, color=EXPECTED, alpha=0.3, lw=0)
    ax.axvline(0.0, color="k", lw=0.8)
    ax.axhline(0.0, color="0.5", lw=0.8)
    for one in junctions_of(seen):
        if s[0] <= one["distance_mm"] <= s[-1]:
            ax.axvline(one["distance_mm"], color=RAIL if one["profile"] == "rail" else WHEEL, ls=":", lw=1.0)
    ax.set(
        title=f"curvatures (dotted: junctions{'; bands: twice the noise' if banded else ''})",
        xlabel=f"distance across from the touch point in mm\n{SIDES}",
        ylabel="curvature in 1/mm, convex positive",
    )
    finish(ax)
    ax.legend(fontsize=9)


def _start_of(profile: Profile) -> float:
    """Where a smoothed line begins, in the arc length of what its points were held against."""
    return float(getattr(profile.segments[0], "s_from", 0.0))


def measured_figure(profile: Profile, path: str | Path) -> Path:
    """Draw a smoothed line with its points, what they are off it, and its curvature with twice its noise."""
    measured = profile.measured
    assert measured is not None
    figure = blank_figure(11.0, 10.5)
    line, off, bent = figure.subplots(3, 1, sharex=True, height_ratios=(1.0, 0.8, 1.1))
    for number in range(len(profile.segments)):
        p = profile.evaluate(number + np.linspace(1e-9, 1.0 - 1e-9, 300))
        line.plot(p.y, p.z, color=RAIL, lw=1.6)
        curvature = profile.convex_sign * p.curvature_per_mm
        segment = profile.segments[number]
        s = np.linspace(getattr(segment, "s_from", 0.0), getattr(segment, "s_to", 0.0), p.y.size)
        noise = np.interp(s, measured.s_mm, measured.curvature_noise_per_mm)
        bent.plot(p.y, curvature, color=RAIL, lw=1.6)
        bent.fill_between(p.y, curvature - 2.0 * noise, curvature + 2.0 * noise, color=RAIL, alpha=0.25, lw=0)
    y, z = measured.points.T
    line.plot(y, z, ".", color=POINTS, ms=2)
    off.plot(y, 1e3 * measured.residual_mm, ".", color=POINTS, ms=3)
    for level in (-2e3 * measured.noise_mm, 0.0, 2e3 * measured.noise_mm):
        off.axhline(level, color="0.5", lw=0.8, ls="-" if level == 0.0 else "--")
    for junction in profile.junctions:
        for ax in (line, bent):
            ax.axvline(junction.y_mm, color=RAIL_JUNCTION, lw=0.8, ls=":", zorder=0)
    bent.set_yscale("symlog", linthresh=1e-3)
    bent.margins(y=0.08)
    bent.axhline(0.0, color="0.5", lw=0.8)
    draw_problems(line, profile)
    of = f"deviation from {measured.nominal}" if measured.nominal else "line"
    line.set(
        title=f"{profile.kind} {short_name(profile.name)}: {of} smoothed over {measured.width_mm:.3g} mm",
        ylabel="z in mm",
    )
    off.set(ylabel="points off the line in um\n(dashed: twice the noise)")
    bent.set(ylabel="curvature in 1/mm, convex positive\n(band: twice its noise)", xlabel=f"y in mm\n{SIDES}")
    finish(line, off, bent)
    return save_figure(figure, path)
