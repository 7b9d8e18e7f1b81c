"""Profiles on the terminal and in a picture: the library, and a profile's segments and junctions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.arrays import Floats
from fecontact.outputs.flat_records import Record, picked
from fecontact.outputs.pair_names import body_words
from fecontact.outputs.style import MARKS, SIDES, Colour, blank_figure, finish, save_figure
from fecontact.outputs.tables import number, radius, table_of, text
from fecontact.outputs.terminal import Lines, notes
from fecontact.profiles.curve import Profile, radius_mm, radius_text
from fecontact.profiles.point_problems import Problem
from fecontact.profiles.segments import Arc, Line, Measured, Segment

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fecontact.profiles.recognition import Nearest


# Ends of a line, from the gauge side to the field side.
_ENDS = ("y_from_mm", "y_to_mm")
_LIBRARY = (
    text("name", "name"),
    text("kind", "kind"),
    *(number(f"{name}\nmm", key, "{:.1f}", none="") for name, key in zip(("y from", "y to"), _ENDS, strict=True)),
    text("junctions", "junctions", "number"),
    text("certainty", "certainty"),
    text("source", "source", wraps=True),
)
_JUNCTIONS = (
    number("y mm", lambda one: one.y_mm, "{:.4f}"),
    number("z mm", lambda one: one.z_mm, "{:.4f}"),
    radius("R before mm", lambda one: radius_mm(one.curvature_left_per_mm), "{:.2f}"),
    radius("R after mm", lambda one: radius_mm(one.curvature_right_per_mm), "{:.2f}"),
    number("kink mrad", lambda one: one.turn_rad, "{:z.3f}", 1e3),
)
_SEGMENTS = (
    text("segment", "number", "number"),
    text("kind", lambda one: type(one["segment"]).__name__.lower()),
    *(number(f"{name} mm", name, "{:.4f}") for name in ("y from", "y to", "z from", "z to")),
    text("R mm", lambda one: _segment_radius(one["segment"]), "number"),
)


def library_record(folder: Path | None = None) -> list[Record]:
    """The profiles of the library, and the files of a folder."""
    from fecontact.profiles.library import load, names

    items: list[Record] = []
    for profile in map(load, names()):
        own = picked(profile, "name kind certainty source") | {"junctions": len(profile.junctions)}
        items.append(own | dict(zip(_ENDS, profile.y_range_mm, strict=True)))
    for path in sorted(folder.iterdir()) if folder is not None and folder.is_dir() else ():
        if path.is_file():
            items.append({"name": path.stem, "source": f"file {path.name} of {folder}"})
    return items


def library_lines(items: Sequence[Record]) -> Lines:
    """The profiles of the library, and other texts that may be given instead of a name."""
    yield table_of("Profile library", _LIBRARY, items)
    yield "Also: circle:R and arcs:R/R@D (rails), cylinder:R (wheel), all in mm, or the path of a profile file."


def profile_record(profile: Profile, found: Sequence[Nearest]) -> Record:
    """A profile with its junctions, how it was smoothed, and the profiles of the library that it is nearest to."""
    measured = profile.measured
    return {
        "schema": "fecontact/profile/1",
        **picked(profile, "name kind source length_mm"),
        **dict(zip(_ENDS, profile.y_range_mm, strict=True)),
        "notes": list(profile.notes),
        "smoothed": None if measured is None else picked(measured, "nominal filter_mm noise_mm"),
        "junctions": [
            picked(one, "y_mm z_mm curvature_left_per_mm curvature_right_per_mm turn_rad") for one in profile.junctions
        ],
        "nearest": [
            picked(one, "name usual_mm farthest_mm at_y_mm") | picked(one.registration, "turn_rad") for one in found
        ],
    }


def profile_lines(profile: Profile, found: Sequence[Nearest]) -> Lines:
    """The segments of a profile, the junctions where its curvature jumps, and what of the library it is nearest to."""
    low, high = profile.y_range_mm
    named, long = body_words(profile.kind, profile.name), f"{profile.length_mm:.2f} mm long"
    yield f"{named}: y from {low:.3f} to {high:.3f} mm, {long}"
    if profile.source:
        yield f"source: {profile.source}"
    yield from notes(profile.notes)
    items = []
    for place, segment in enumerate(profile.segments, start=1):
        ends = segment.evaluate(np.array([0.0, 1.0]))
        where = dict(zip(("y from", "y to", "z from", "z to"), (*ends.y, *ends.z), strict=True))
        items.append({"number": place, "segment": segment, **where})
    yield table_of("Running surface, from the gauge side to the field side", _SEGMENTS, items)
    yield table_of("Junctions (radii positive where convex)", _JUNCTIONS, profile.junctions)
    if profile.points is not None:
        yield nearest_text(found, "" if profile.measured is None else profile.measured.nominal or "")


def nearest_text(found: Sequence[Nearest], nominal: str = "") -> str:
    """Which profile of the library measured points are, and from which one they are smoothed, in words."""
    if not found:
        return "nearest library profile: none within 2 mm"
    best, turn = found[0], 1e3 * found[0].registration.turn_rad
    dy, dz = found[0].registration.shift
    rest = "".join(f"; then {one.name} ({one.usual_mm:.2g} mm)" for one in found[1:2])
    rest += f"; what is smoothed is the deviation from {nominal}" if nominal not in ("", best.name) else ""
    off = (
        f"the points are usually {best.usual_mm:.2g} mm off it, at most {best.farthest_mm:.2g} mm at y ="
        f" {best.at_y_mm:.1f} mm"
        if best.farthest_mm > 1e-3
        else "all points are within 0.001 mm of it"
    )
    return (
        f"nearest library profile over the whole line: {best.name}, turned by {turn:+.2f} mrad and moved by"
        f" ({dy:+.3f}, {dz:+.3f}) mm; {off}{rest}"
    )


def _segment_radius(segment: Segment) -> str:
    return radius_text(getattr(segment, "radius", None), "{:.4g}") if isinstance(segment, Line | Arc) else "varies"


# --- The picture of a profile.

_KEY_OF_PROBLEM = {
    "spike": "left out: spike",
    "out of order": "left out: out of order",
    "crosses itself": "left out: line crosses itself",
    "unclear": "doubtful, kept",
}
# Shortest arc with a written radius, over the picture's width: radii of shorter arcs would overlap.
_LEAST_WIDTH = 0.045


def profile_figure(profile: Profile, path: str | Path) -> Path:
    """Draw a profile: its line, and its curvature (positive if convex) over y, with the junctions marked.

    For a smoothed line the points, their deviations and twice the noise of the curvature are drawn as well.
    """
    measured, colour = profile.measured, Colour.LINES[profile.kind]
    ratios = (1.0, 1.0) if measured is None else (1.0, 0.8, 1.1)
    figure = blank_figure(10.5, 4.0 + 2.0 * len(ratios))
    line, *points, bent = figure.subplots(len(ratios), 1, sharex=True, height_ratios=ratios)
    for index, segment in enumerate(profile.segments):
        # slightly inside the ends, so that each segment shows its curvature up to its ends
        p = profile.evaluate(index + np.linspace(1e-9, 1.0 - 1e-9, 300))
        curvature = profile.convex_sign * p.curvature_per_mm
        line.plot(p.y, p.z, color=colour, lw=1.8)
        bent.plot(p.y, curvature, color=colour, lw=1.8)
        if measured is not None:
            s = np.linspace(getattr(segment, "s_from", 0.0), getattr(segment, "s_to", 0.0), p.y.size)
            noise = 2.0 * np.interp(s, measured.s_mm, measured.curvature_noise_per_mm)
            bent.fill_between(p.y, curvature - noise, curvature + noise, color=colour, alpha=0.25, lw=0)
    for junction in profile.junctions:
        line.plot(junction.y_mm, junction.z_mm, "o", color=Colour.RAIL_JUNCTION, ms=5)
        for ax in (line, bent):
            ax.axvline(junction.y_mm, color=Colour.RAIL_JUNCTION, lw=0.8, ls=":", zorder=0)
    # curvatures of a head span four decades of either sign
    bent.set_yscale("symlog", linthresh=1e-3)
    bent.margins(y=0.08)
    bent.axhline(0.0, color="0.5", lw=0.8)
    band = "" if measured is None else "\nband: twice its noise"
    bent.set(
        ylabel=f"curvature in 1/mm, convex positive\n(logarithmic beyond ±0.001){band}",
        xlabel=f"y in mm\n{SIDES}",
    )
    of = "" if measured is None else _draw_points(line, points[0], measured)
    line.set(title=f"{body_words(profile.kind, profile.name)}{of}", ylabel="z (up) in mm")
    _write_radii(line, profile)
    draw_problems(line, profile)
    finish(line, *points, bent)
    return save_figure(figure, path)


def _draw_points(line: Axes, off: Axes, measured: Measured) -> str:
    """Draw the points of a smoothed line and their deviations from it; returns a description of the line."""
    y, z = measured.points.T
    line.plot(y, z, ".", color=Colour.POINTS, ms=2)
    off.plot(y, 1e3 * measured.residual_mm, ".", color=Colour.POINTS, ms=3)
    for level in (-2e3 * measured.noise_mm, 0.0, 2e3 * measured.noise_mm):
        off.axhline(level, color="0.5", lw=0.8, ls="-" if level == 0.0 else "--")
    off.set(ylabel="points off line in um\n(dashed: twice scatter)")
    of = f"deviation from {measured.nominal}" if measured.nominal else "line"
    return f": {of} smoothed over {measured.filter_mm:.3g} mm"


def draw_problems(
    ax: Axes, profile: Profile, place: Callable[[Floats, Floats], tuple[Floats, Floats]] | None = None
) -> None:
    """Mark points of a file that were left out or are doubtful, with the reasons in the legend.

    `place` turns y and z of the profile (mm) into coordinates of the picture, if they differ.
    """
    groups: dict[str, list[Problem]] = {}
    for problem in profile.problems:
        groups.setdefault(_KEY_OF_PROBLEM[problem.what], []).append(problem)
    for (words, those), marker in zip(groups.items(), MARKS, strict=False):
        y, z = np.array([(one.y_mm, one.z_mm) for one in those]).T
        y, z = (y, z) if place is None else place(y, z)
        # hollow, so that the line is seen through them
        label = f"{words} ({len(those)})"
        ax.plot(y, z, marker, color=Colour.PROBLEM, mfc="none", mew=1.8, ms=10, ls="none", label=label)
    if groups:
        ax.legend(loc="best")


def _write_radii(ax: Axes, profile: Profile) -> None:
    """Write the radius beside each arc that is long enough for it."""
    low, high = ax.get_xlim()
    for index in range(len(profile.segments)):
        p = profile.evaluate(index + np.array([1e-9, 0.5, 1.0 - 1e-9]))
        curvature = profile.convex_sign * profile.evaluate(index + np.linspace(0.01, 0.99, 9)).curvature_per_mm
        mean = float(np.mean(curvature))
        is_arc = abs(mean) > 1e-9 and bool(np.ptp(curvature) < 1e-6 * abs(mean))
        if is_arc and abs(float(p.y[2] - p.y[0])) > _LEAST_WIDTH * (high - low):
            # lines run to the field side: a rail's material is on their right, a wheel's on their left
            inwards = np.array([p.z[2] - p.z[0], p.y[0] - p.y[2]]) * (1.0 if profile.kind == "rail" else -1.0)
            offset = tuple(13.0 * inwards / np.linalg.norm(inwards))
            style: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": "center", "fontsize": 8.5}
            ax.annotate(f"R{1.0 / mean:.4g}", (float(p.y[1]), float(p.z[1])), xytext=offset, **style)
