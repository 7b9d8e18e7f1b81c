"""A case before it is solved, and a profile with the points behind it: as text, as a record, and as pictures."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.outputs.case_words import case_words, short_name
from fecontact.outputs.figures import draw_problems
from fecontact.outputs.record import shown_case_record, touch_record
from fecontact.outputs.style import (
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
from fecontact.profiles.curve import Profile
from fecontact.profiles.recognition import Nearest
from fecontact.solving.preview import Preview

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def preview_record(seen: Preview) -> dict[str, Any]:
    """Everything that a preview says, with units in the keys."""
    patch = seen.expected
    sizes = ("x_low_mm", "x_high_mm", "s_low_mm", "s_high_mm", "semi_axis_x_mm", "semi_axis_s_mm")
    expected = {name: getattr(patch, name) for name in sizes} | {"parts": [asdict(part) for part in patch.parts]}
    return {
        "schema": "fecontact/place/1",
        "case": shown_case_record(seen.case, seen.placement),
        "touch_points": [touch_record(touch) for touch in seen.placement.touch_points],
        "hertz": {"p_max_MPa": seen.hertz.p0_MPa, "a_mm": seen.hertz.a_mm, "b_mm": seen.hertz.b_mm},
        "uncertainty_of_profile": seen.hertz_uncertainty,
        "expected_patch": expected,
        "element_size_mm": list(seen.element_size_mm),
        "elements": list(seen.elements),
        "degrees_of_freedom": seen.degrees_of_freedom,
        "cpu_seconds": seen.cpu_seconds,
        "memory_GB": seen.memory_GB,
        "junctions": _junctions(seen),
        "notes": [*seen.placement.rail.profile.notes, *seen.placement.wheel.profile.notes],
    }


def _junctions(seen: Preview) -> list[dict[str, Any]]:
    """Curvature junctions of both profiles by their distance from the first touch point along the line."""
    found = [
        {"profile": place.profile.kind, "y_mm": place.junction.y_mm, "distance_mm": place.s_mm}
        for place in seen.placement.junctions
    ]
    return sorted(found, key=lambda one: abs(one["distance_mm"]))


def preview_text(seen: Preview) -> str:
    """A preview in lines."""
    patch, (dx, ds) = seen.expected, seen.element_size_mm
    lines = [
        f"touch point {k}: rail y {touch.rail_y_mm:+.2f} mm, wheel y {touch.wheel_y_mm:+.2f} mm, contact angle"
        f" {1e3 * touch.contact_angle_rad:+.1f} mrad, gap {1e3 * touch.vertical_gap_mm:.1f} um"
        for k, touch in enumerate(seen.placement.touch_points, start=1)
    ]
    hertz = f"Hertz: p0 {seen.hertz.p0_MPa:.1f} MPa, a {seen.hertz.a_mm:.3f} mm, b {seen.hertz.b_mm:.3f} mm"
    if seen.hertz_uncertainty is not None:
        hertz += f"; {uncertainty_text(seen.hertz_uncertainty)}"
    lines.append(hertz)
    lines.append(
        f"expected patch: {patch.x_high_mm - patch.x_low_mm:.2f} mm along x, {patch.s_high_mm - patch.s_low_mm:.2f} mm"
        f" across, from {patch.s_low_mm:+.2f} to {patch.s_high_mm:+.2f} mm of the touch point"
    )
    reached = [one for one in _junctions(seen) if patch.s_low_mm <= one["distance_mm"] <= patch.s_high_mm]
    lines.append(
        "curvature junctions below it: "
        + (", ".join(f"{one['profile']} at {one['distance_mm']:+.2f} mm" for one in reached) or "none")
    )
    lines.append(
        f"elements {dx:.3g} by {ds:.3g} mm, {seen.elements[0]} by {seen.elements[1]} in the fine zone: about"
        f" {round(seen.degrees_of_freedom, -3)} unknowns, {seen.cpu_seconds:.0f} CPU s and {seen.memory_GB:.1f} GB;"
        f" more where the verdict is open, up to {seen.case.refine_degrees_of_freedom} unknowns"
    )
    notes = (*seen.placement.rail.profile.notes, *seen.placement.wheel.profile.notes)
    return "\n".join((*lines, *(f"note: {note}" for note in notes)))


def uncertainty_text(part: dict[str, float]) -> str:
    """What measured profiles leave open of Hertz, in words."""
    if any(np.isnan(value) for value in part.values()):
        return "another line that the measured points allow does not come into contact here: Hertz is not known"
    p, a, b = (100.0 * part[name] for name in ("p_max_MPa", "a_mm", "b_mm"))
    return f"the measured profiles leave ±{p:.2g} % of p0, ±{a:.2g} % of a and ±{b:.2g} % of b open"


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
    for one in _junctions(seen):
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


def nearest_text(found: list[Nearest]) -> str:
    """Which profile of the library measured points are, in words."""
    if not found:
        return "nearest library profile: none within 2 mm"
    best, turn = found[0], 1e3 * found[0].registration.turn_rad
    dy, dz = found[0].registration.shift
    rest = "".join(f"; then {one.name} ({one.usual_mm:.2g} mm)" for one in found[1:2])
    return (
        f"nearest library profile: {best.name}, turned by {turn:+.2f} mrad and moved by ({dy:+.3f}, {dz:+.3f}) mm; the"
        f" points are usually {best.usual_mm:.2g} mm off it, at most {best.farthest_mm:.2g} mm at y ="
        f" {best.at_y_mm:.1f} mm{rest}"
    )
