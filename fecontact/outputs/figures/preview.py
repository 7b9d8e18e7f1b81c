"""The picture of a case before it is solved."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.outputs.figures.profile import draw_problems
from fecontact.outputs.figures.section import draw_section, section_lines
from fecontact.outputs.figures.style import (
    EXPECTED,
    RAIL,
    SIDES,
    WHEEL,
    blank_figure,
    finish,
    legend_beside,
    save_figure,
)
from fecontact.outputs.records.preview import junctions_of
from fecontact.outputs.words.cases import case_words
from fecontact.solving.preview import Preview

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
    near.set(title="about the expected patch (shaded), heights drawn out", xlabel=f"y in mm\n{SIDES}", ylabel="z in mm")
    near.axvspan(touch.y_mm + patch.s_low_mm, touch.y_mm + patch.s_high_mm, color=EXPECTED, alpha=0.3, lw=0)
    _draw_curvatures(bent, seen, reach)
    legend_beside(whole)
    wheel = seen.placement.wheel
    draw_problems(whole, rail.profile, rail.point)
    draw_problems(whole, wheel.profile, wheel.lowest_point)
    return save_figure(figure, path)


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
            # a smoothed line begins somewhere in the arc length of what its points were held against
            start = float(getattr(profile.segments[0], "s_from", 0.0))
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
