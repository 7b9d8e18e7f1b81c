"""The picture of a profile."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fecontact.outputs.series import short_name
from fecontact.outputs.style import RAIL_JUNCTION, SIDES, blank_figure, save_figure
from fecontact.profiles.curve import Profile


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
        line.plot(junction.y_mm, junction.z_mm, "o", color=RAIL_JUNCTION, ms=5)
        for ax in (line, curvature):
            ax.axvline(junction.y_mm, color=RAIL_JUNCTION, lw=0.8, ls=":", zorder=0)
    # curvatures of a head span four decades of either sign
    curvature.set_yscale("symlog", linthresh=1e-3)
    curvature.margins(y=0.08)
    curvature.axhline(0.0, color="0.5", lw=0.8)
    line.set(title=f"{profile.kind} {short_name(profile.name)}", ylabel="z (up) in mm")
    curvature.set(ylabel="curvature in 1/mm\n(convex positive)", xlabel=f"y in mm\n{SIDES}")
    for ax in (line, curvature):
        ax.grid(alpha=0.3)
    return save_figure(figure, path)
