"""Section of rail and wheel through the first contact point, and picture of a preview."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.arrays import Floats
from fecontact.outputs.case_words import case_words
from fecontact.outputs.pair_names import body_words
from fecontact.outputs.profiles import draw_problems
from fecontact.outputs.records.results import case_inputs
from fecontact.outputs.style import SIDE_LABELS, Colour, add_grid, add_legend_beside, blank_figure, save_figure
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.preview import Preview

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# --- Section of rail and wheel through the first contact point.

SectionLines = Mapping[str, tuple[Floats, Floats]]
# The wheel is drawn up to this distance from the contact point.
_DRAWN_DISTANCE_MM = 75.0


def pair_figure(placement: Placement) -> Figure:
    """Draw rail and wheel in section through the first contact point, true to scale.

    Parameters
    ----------
    placement
        Placement of the pair.

    Returns
    -------
    Figure
        Figure with all contact points.
    """
    lines = section_lines(placement, _DRAWN_DISTANCE_MM)
    (rail_y, rail_z), (wheel_y, wheel_z) = lines["rail"], lines["wheel"]
    extent = float(np.ptp(np.concatenate([rail_z, wheel_z])))
    figure = blank_figure(10.0, max(2.0, 1.4 + 7.5 * extent / (2.0 * _DRAWN_DISTANCE_MM)))
    ax = figure.add_subplot()
    ax.fill_between(rail_y, rail_z, float(np.min(rail_z)) - 8.0, color="0.82", lw=0.0)
    ax.fill_between(wheel_y, wheel_z, float(np.max(wheel_z)) + 10.0, color="0.9", lw=0.0)
    draw_section(ax, placement, lines)
    ax.set(aspect="equal", xlabel="y in mm, from the track centre  (gauge side ←  → field side)", ylabel="z in mm")
    add_legend_beside(ax)
    return figure


def section_lines(placement: Placement, about_mm: float = np.inf) -> SectionLines:
    """Lines (y, z) in mm of rail and wheel near the first contact point.

    Parameters
    ----------
    placement
        Placement of the pair.
    about_mm
        Largest lateral distance from the first contact point.

    Returns
    -------
    dict
        Coordinates y (n,) and z (n,) by body, in the track frame.
    """
    rail, wheel = placement.rail, placement.wheel
    u_rail, u_wheel = (np.linspace(0.0, len(body.profile.segments) - 1e-9, 3000) for body in (rail, wheel))
    lines = {"rail": rail.section(u_rail)[:2], "wheel": wheel.silhouette(u_wheel)[2:]}
    near = {name: np.abs(y - placement.first.y_mm) < about_mm for name, (y, _) in lines.items()}
    return {name: (y[near[name]], z[near[name]]) for name, (y, z) in lines.items()}


def draw_section(ax: Axes, placement: Placement, lines: SectionLines) -> None:
    """Draw rail and wheel with their contact points; the first contact point is filled.

    Parameters
    ----------
    ax
        Axes to draw into.
    placement
        Placement of the pair.
    lines
        Lines of rail and wheel, from `section_lines`.
    """
    names = {"rail": placement.rail.profile.name, "wheel": placement.wheel.profile.name}
    for (body, profile_line), colour in zip(lines.items(), Colour.LINES.values(), strict=True):
        ax.plot(*profile_line, color=colour, lw=1.8, label=body_words(body, names[body]))
    for number, touch in enumerate(placement.contact_points):
        label = "contact point" if number == 0 else ("further contact points" if number == 1 else None)
        fill_colour = Colour.HERTZ if number == 0 else "white"
        ax.plot(touch.y_mm, touch.z_mm, "o", label=label, mfc=fill_colour, mec=Colour.HERTZ, ms=7, zorder=5)
    add_grid(ax)


# --- Picture of a case before it is solved.


def draw_preview(preview: Preview, path: str | Path) -> Path:
    """Draw the pair in position, the contact, and the curvatures about the expected patch.

    Parameters
    ----------
    preview
        Preview of a case.
    path
        File of the picture.

    Returns
    -------
    Path
        The given path.
    """
    figure = blank_figure(13.0, 9.0)
    grid = figure.add_gridspec(2, 2)
    pair_axes, patch_axes, curvature_axes = (figure.add_subplot(cell) for cell in (grid[0, :], grid[1, 0], grid[1, 1]))
    patch, touch = preview.expected, preview.placement.first
    lines = section_lines(preview.placement)
    for ax in (pair_axes, patch_axes):
        draw_section(ax, preview.placement, lines)
    figure.suptitle(case_words(case_inputs(preview.case, preview.placement)), fontsize=13)
    pair_axes.set(xlabel=f"y in mm\n{SIDE_LABELS}", ylabel="z (up) in mm")
    pair_axes.set_aspect("equal", adjustable="datalim")
    reach = 0.8 * (patch.s_high_mm - patch.s_low_mm)
    patch_axes.set_xlim(touch.y_mm + patch.s_low_mm - reach, touch.y_mm + patch.s_high_mm + reach)
    rail = preview.placement.rail
    _, z, _ = rail.section(rail.parameter_at_y(np.linspace(*patch_axes.get_xlim(), 50)))
    low, high = float(np.nanmin(z)), float(np.nanmax(z))
    patch_axes.set_ylim(low - 0.3 * (high - low + 0.1), high + 0.6 * (high - low + 0.1))
    patch_axes.set(
        title="surroundings of the expected patch (shaded), vertical scale exaggerated",
        xlabel=f"y in mm\n{SIDE_LABELS}",
        ylabel="z in mm",
    )
    patch_axes.axvspan(
        touch.y_mm + patch.s_low_mm, touch.y_mm + patch.s_high_mm, color=Colour.EXPECTED, alpha=0.3, lw=0
    )
    _draw_curvatures(curvature_axes, preview, reach)
    add_legend_beside(pair_axes)
    wheel = preview.placement.wheel
    draw_problems(pair_axes, rail.profile, rail.point)
    draw_problems(pair_axes, wheel.profile, wheel.lowest_point)
    return save_figure(figure, path)


def _draw_curvatures(ax: Axes, preview: Preview, reach: float) -> None:
    """Draw the curvatures of rail and wheel over the distance from the contact point.

    Curvatures are positive if convex.
    """
    touch, patch, has_bands = preview.placement.first, preview.expected, False
    s = np.linspace(patch.s_low_mm - reach, patch.s_high_mm + reach, 1200)
    for profile, u in (
        (preview.placement.rail.profile, touch.rail_u),
        (preview.placement.wheel.profile, touch.wheel_u),
    ):
        colour = Colour.LINES[profile.kind]
        parameters = profile.at_arc_length(s + float(profile.arc_length(u)))
        curvature = profile.convex_sign * profile.evaluate(parameters).curvature_per_mm
        ax.plot(s, curvature, color=colour, lw=1.5, label=f"{profile.kind}")
        if (measured := profile.measured) is not None:
            # the arc length of a smoothed profile begins at an offset, since it may be counted along a nominal profile
            start = float(getattr(profile.segments[0], "s_from", 0.0))
            noise = np.interp(s + float(profile.arc_length(u)) + start, measured.s_mm, measured.curvature_noise_per_mm)
            ax.fill_between(s, curvature - 2.0 * noise, curvature + 2.0 * noise, color=colour, alpha=0.25, lw=0)
            has_bands = True
    ax.axvspan(patch.s_low_mm, patch.s_high_mm, color=Colour.EXPECTED, alpha=0.3, lw=0)
    ax.axvline(0.0, color="k", lw=0.8)
    ax.axhline(0.0, color="0.5", lw=0.8)
    for place in preview.placement.junctions:
        if s[0] <= place.s_mm <= s[-1]:
            ax.axvline(place.s_mm, color=Colour.LINES[place.profile.kind], ls=":", lw=1.0)
    ax.set(
        title=f"curvatures (dotted: junctions{'; bands: twice the noise' if has_bands else ''})",
        xlabel=f"lateral distance from the contact point in mm\n{SIDE_LABELS}",
        ylabel="curvature in 1/mm, convex positive",
    )
    add_grid(ax)
    ax.legend(fontsize=9)
