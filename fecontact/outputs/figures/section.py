"""Rail and wheel in section through the first touch point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fecontact.geometry.placement import Placement
from fecontact.outputs.figures.style import HERTZ, RAIL, WHEEL, blank_figure, finish, legend_beside
from fecontact.outputs.words.pairs import short_name
from fecontact.profiles.segments import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Lines = Mapping[str, tuple[Floats, Floats]]
# Of the wheel what lies this far about the touch point is drawn.
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
    """Lines (y, z) in mm of rail and wheel, as far as they lie so far about the first touch point."""
    rail, wheel = placement.rail, placement.wheel
    u_rail, u_wheel = (np.linspace(0.0, len(one.profile.segments) - 1e-9, 3000) for one in (rail, wheel))
    lines = {"rail": rail.section(u_rail)[:2], "wheel": wheel.silhouette(u_wheel)[2:]}
    near = {of: np.abs(y - placement.first.y_mm) < about_mm for of, (y, _) in lines.items()}
    return {of: (y[near[of]], z[near[of]]) for of, (y, z) in lines.items()}


def draw_section(ax: Axes, placement: Placement, lines: Lines) -> None:
    """Draw both lines, and the touch points: the first one filled."""
    names = {"rail": placement.rail.profile.name, "wheel": placement.wheel.profile.name}
    for (of, line), colour in zip(lines.items(), (RAIL, WHEEL), strict=True):
        ax.plot(*line, color=colour, lw=1.8, label=f"{of} {short_name(names[of])}")
    for number, touch in enumerate(placement.touch_points):
        label = "touch point" if number == 0 else ("further touch points" if number == 1 else None)
        inside = HERTZ if number == 0 else "white"
        ax.plot(touch.y_mm, touch.z_mm, "o", label=label, mfc=inside, mec=HERTZ, ms=7, zorder=5)
    finish(ax)
