"""Profiles on the terminal and in a picture: library, segments and junctions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.arrays import Floats
from fecontact.outputs.flat_records import Record, select_attributes
from fecontact.outputs.pair_names import body_words
from fecontact.outputs.style import SERIES_MARKS, SIDE_LABELS, Colour, add_grid, blank_figure, save_figure
from fecontact.outputs.tables import make_table, number_column, radius_column, text_column
from fecontact.outputs.terminal import OutputLines, note_lines
from fecontact.profiles.curve import Profile, format_radius, invert_curvature_mm
from fecontact.profiles.point_problems import PointProblem
from fecontact.profiles.segments import Arc, Segment, SmoothingResult, StraightSegment

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fecontact.profiles.readers.instrument_header import InstrumentHeader
    from fecontact.profiles.recognition import ProfileMatch


# Keys of the ends of a profile, from the gauge side to the field side.
_RANGE_KEYS = ("y_from_mm", "y_to_mm")
_LIBRARY_COLUMNS = (
    text_column("name", "name"),
    *(
        number_column(f"{name}\nmm", key, "{:.1f}", none="")
        for name, key in zip(("y from", "y to"), _RANGE_KEYS, strict=True)
    ),
    text_column("junctions", "junctions", "number"),
    text_column("certainty", "certainty"),
    text_column("source", lambda record: record["source"].partition(";")[0], wraps=True),
)
_FILE_COLUMNS = (text_column("name", "name"), text_column("file", "source", wraps=True))
_JUNCTION_COLUMNS = (
    number_column("y mm", lambda junction: junction.y_mm, "{:.4f}"),
    number_column("z mm", lambda junction: junction.z_mm, "{:.4f}"),
    radius_column("R before mm", lambda junction: invert_curvature_mm(junction.curvature_left_per_mm), "{:.2f}"),
    radius_column("R after mm", lambda junction: invert_curvature_mm(junction.curvature_right_per_mm), "{:.2f}"),
    number_column("kink mrad", lambda junction: junction.turn_rad, "{:z.3f}", 1e3),
)
_SEGMENT_COLUMNS = (
    text_column("segment", "number", "number"),
    text_column("kind", lambda segment_row: type(segment_row["segment"]).__name__.lower()),
    *(number_column(f"{name} mm", name, "{:.4f}") for name in ("y from", "y to", "z from", "z to")),
    text_column("R mm", lambda segment_row: _segment_radius(segment_row["segment"]), "number"),
)


def library_record(folder: Path | None = None) -> list[Record]:
    """Records of the profiles of the library, and of the files of a folder.

    Parameters
    ----------
    folder
        Folder with profile files; None for the library alone.

    Returns
    -------
    list of Record
        Name, kind, group, other names, range in mm, number of junctions, certainty, source and notes.
    """
    from fecontact.profiles.library import ALIASES, find_group, list_names, load_library_profile

    records: list[Record] = []
    for profile in map(load_library_profile, list_names()):
        entries = select_attributes(profile, "name kind certainty source") | {"junctions": len(profile.junctions)}
        aliases = [alias for alias, name in ALIASES.items() if name == profile.name]
        entries |= {"group": find_group(profile.name), "aliases": aliases, "notes": list(profile.notes)}
        records.append(entries | dict(zip(_RANGE_KEYS, profile.y_range_mm, strict=True)))
    for path in sorted(folder.iterdir()) if folder is not None and folder.is_dir() else ():
        if path.is_file():
            records.append({"name": path.stem, "source": f"file {path.name} of {folder}"})
    return records


def library_lines(records: Sequence[Record]) -> OutputLines:
    """Iterate over the outputs of the library, with the texts allowed instead of a name.

    Parameters
    ----------
    records
        Records of `library_record`.

    Returns
    -------
    iterator of Table and str
        Table and line.
    """
    # files of a folder have no group
    own_files = [record for record in records if "group" not in record]
    groups = sorted({(record["kind"], record["group"]) for record in records if "group" in record})
    for kind, group in groups:
        members = [record for record in records if (record.get("kind"), record.get("group")) == (kind, group)]
        yield make_table(f"{kind.capitalize()}s: {group}", _LIBRARY_COLUMNS, members)
        for record in members:
            if record["certainty"] == "doubtful":
                yield from (f"{record['name']}: {note}" for note in record["notes"])
    if own_files:
        yield make_table("Your files", _FILE_COLUMNS, own_files)
    yield "fecontact profiles NAME shows the whole source of a profile, its notes and its segments."
    yield "Also allowed: circle:R and arcs:R/R@D (rails), cylinder:R (wheel), in mm, or the path of a profile file."


def profile_record(
    profile: Profile, nearest_profiles: Sequence[ProfileMatch], header: InstrumentHeader | None = None
) -> Record:
    """Record of a profile: junctions, smoothing, header, and nearest profiles of the library.

    Parameters
    ----------
    profile
        Profile.
    nearest_profiles
        Profiles of the library, the nearest first.
    header
        Header of the file; None for a file without a header of an instrument.

    Returns
    -------
    Record
        Lengths in mm, curvatures in 1/mm, angles in rad.
    """
    measured = profile.measured
    return {
        "schema": "fecontact/profile/1",
        **select_attributes(profile, "name kind source length_mm"),
        **dict(zip(_RANGE_KEYS, profile.y_range_mm, strict=True)),
        "notes": list(profile.notes),
        "header": None if header is None else header.columns,
        "smoothed": None if measured is None else select_attributes(measured, "nominal filter_mm noise_mm"),
        "junctions": [
            select_attributes(junction, "y_mm z_mm curvature_left_per_mm curvature_right_per_mm turn_rad")
            for junction in profile.junctions
        ],
        "nearest": [
            select_attributes(candidate, "name usual_mm farthest_mm at_y_mm")
            | select_attributes(candidate.registration, "turn_rad")
            for candidate in nearest_profiles
        ],
    }


def profile_lines(
    profile: Profile, nearest_profiles: Sequence[ProfileMatch], header: InstrumentHeader | None = None
) -> OutputLines:
    """Iterate over the outputs of a profile: segments, curvature junctions and nearest library profile.

    Parameters
    ----------
    profile
        Profile.
    nearest_profiles
        Profiles of the library, the nearest first.
    header
        Header of the file; None for a file without a header of an instrument.

    Returns
    -------
    iterator of Table and str
        Tables and lines in order.
    """
    low, high = profile.y_range_mm
    name, length_text = body_words(profile.kind, profile.name), f"{profile.length_mm:.2f} mm long"
    yield f"{name}: y from {low:.3f} to {high:.3f} mm, {length_text}"
    if profile.source:
        yield f"source: {profile.source}"
    if header is not None and (entries := header.describe()):
        yield f"header: {entries}"
    yield from note_lines(profile.notes)
    segment_rows = []
    for place, segment in enumerate(profile.segments, start=1):
        ends = segment.evaluate(np.array([0.0, 1.0]))
        where = dict(zip(("y from", "y to", "z from", "z to"), (*ends.y, *ends.z), strict=True))
        segment_rows.append({"number": place, "segment": segment, **where})
    yield make_table("Running surface, from the gauge side to the field side", _SEGMENT_COLUMNS, segment_rows)
    yield make_table("Junctions (convex radii are positive)", _JUNCTION_COLUMNS, profile.junctions)
    if profile.points is not None:
        yield nearest_text(nearest_profiles, "" if profile.measured is None else profile.measured.nominal or "")


def nearest_text(nearest_profiles: Sequence[ProfileMatch], nominal: str = "") -> str:
    """Text on the library profile nearest to the measured points, and on the nominal profile.

    Parameters
    ----------
    nearest_profiles
        Profiles of the library, the nearest first.
    nominal
        Name of the profile from which the deviation is smoothed; empty without a nominal profile.

    Returns
    -------
    str
        Name, rotation (mrad), translation (mm), usual and largest distance of the points (mm).
    """
    if not nearest_profiles:
        return "nearest library profile: none within 2 mm"
    best, turn_mrad = nearest_profiles[0], 1e3 * nearest_profiles[0].registration.turn_rad
    dy, dz = nearest_profiles[0].registration.shift
    appendix = "".join(f"; next: {candidate.name} ({candidate.usual_mm:.2g} mm)" for candidate in nearest_profiles[1:2])
    appendix += f"; smoothed is the deviation from {nominal}" if nominal not in ("", best.name) else ""
    deviation_text = (
        f"usual distance of the points {best.usual_mm:.2g} mm, largest {best.farthest_mm:.2g} mm at y ="
        f" {best.at_y_mm:.1f} mm"
        if best.farthest_mm > 1e-3
        else "all points are within 0.001 mm of it"
    )
    return (
        f"nearest library profile, over all points: {best.name}{_equal_heads_text(best.name)}, rotated by"
        f" {turn_mrad:+.2f} mrad and moved by ({dy:+.3f}, {dz:+.3f}) mm; {deviation_text}{appendix}"
    )


def _equal_heads_text(name: str) -> str:
    """Text with the rails that have the head of a rail too; empty if there is none."""
    from fecontact.profiles.library import EQUAL_HEADS

    rails = [rail for rail, head in EQUAL_HEADS.items() if head == name]
    return f" (or {' or '.join(rails)}, with an equal head)" if rails else ""


def _segment_radius(segment: Segment) -> str:
    return (
        format_radius(getattr(segment, "radius", None), "{:.4g}")
        if isinstance(segment, StraightSegment | Arc)
        else "varies"
    )


# --- The picture of a profile.

_PROBLEM_LABELS = {
    "spike": "omitted: spike",
    "out of order": "omitted: out of order",
    "crosses itself": "omitted: profile crosses itself",
    "unclear": "doubtful, kept",
}
# Shortest arc with a written radius, as a fraction of the picture's width. Radii of shorter arcs would overlap.
_MIN_ARC_WIDTH = 0.045
# Curvature up to which its scale is nearly linear, and height of a visible band as a fraction of the picture's height.
_LINEAR_CURVATURE_PER_MM, _VISIBLE_HEIGHT = 5e-4, 0.02


def draw_profile(profile: Profile, path: str | Path) -> Path:
    """Draw a profile and its curvature (positive if convex) over y, with marked junctions.

    For a smoothed profile the points, their deviations and twice the noise of the curvature are drawn too.

    Parameters
    ----------
    profile
        Profile to draw.
    path
        File of the picture.

    Returns
    -------
    Path
        The given path.
    """
    measured, colour = profile.measured, Colour.LINES[profile.kind]
    ratios = (1.0, 1.0) if measured is None else (1.0, 0.8, 1.1)
    figure = blank_figure(10.5, 4.0 + 2.0 * len(ratios))
    profile_axes, *point_axes, curvature_axes = figure.subplots(len(ratios), 1, sharex=True, height_ratios=ratios)
    _set_curvature_scale(curvature_axes)
    bands: list[tuple[Floats, Floats]] = []
    for index, segment in enumerate(profile.segments):
        # slightly inside the ends, so that each segment shows its curvature up to its ends
        p = profile.evaluate(index + np.linspace(1e-9, 1.0 - 1e-9, 1200))
        curvature = profile.convex_sign * p.curvature_per_mm
        profile_axes.plot(p.y, p.z, color=colour, lw=1.8)
        curvature_axes.plot(p.y, curvature, color=colour, lw=1.8)
        if measured is not None:
            s = np.linspace(getattr(segment, "s_from", 0.0), getattr(segment, "s_to", 0.0), p.y.size)
            noise = 2.0 * np.interp(s, measured.s_mm, measured.curvature_noise_per_mm)
            curvature_axes.fill_between(p.y, curvature - noise, curvature + noise, color=colour, alpha=0.25, lw=0)
            bands.append((curvature - noise, curvature + noise))
    for junction in profile.junctions:
        profile_axes.plot(junction.y_mm, junction.z_mm, "o", color=Colour.RAIL_JUNCTION, ms=5)
        for ax in (profile_axes, curvature_axes):
            ax.axvline(junction.y_mm, color=Colour.RAIL_JUNCTION, lw=0.8, ls=":", zorder=0)
    curvature_axes.margins(y=0.08)
    curvature_axes.axhline(0.0, color="0.5", lw=0.8)
    band_label = "\nband: twice the noise" if _is_band_visible(curvature_axes, bands) else ""
    curvature_axes.set(
        ylabel=f"curvature in 1/mm, convex positive{band_label}",
        xlabel=f"y in mm\n{SIDE_LABELS}",
    )
    description = "" if measured is None else _draw_points(profile_axes, point_axes[0], measured)
    profile_axes.set(title=f"{body_words(profile.kind, profile.name)}{description}", ylabel="z (up) in mm")
    _write_radii(profile_axes, profile)
    draw_problems(profile_axes, profile)
    add_grid(profile_axes, *point_axes, curvature_axes)
    return save_figure(figure, path)


def _set_curvature_scale(ax: Axes) -> None:
    """Make a vertical axis of curvatures in 1/mm, which span four decades of either sign.

    The scale is the inverse hyperbolic sine: logarithmic far from zero, linear at zero, and smooth between both.
    """
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    decades = [10.0**power for power in range(-3, 3)]
    ax.set_yscale("asinh", linear_width=_LINEAR_CURVATURE_PER_MM)
    ax.yaxis.set_major_locator(FixedLocator([*(-decade for decade in decades), 0.0, *decades]))
    ax.yaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_major_formatter(FuncFormatter(lambda curvature_per_mm, _: f"{curvature_per_mm:g}"))


def _is_band_visible(ax: Axes, bands: Sequence[tuple[Floats, Floats]]) -> bool:
    """Whether a band between two curvatures is anywhere higher than a line is wide."""
    if not bands:
        return False
    to_axes = ax.transScale.transform
    low, high = to_axes(np.column_stack((np.zeros(2), ax.get_ylim())))[:, 1]
    heights = [
        float(np.max(to_axes(np.column_stack((top, top)))[:, 1] - to_axes(np.column_stack((bottom, bottom)))[:, 1]))
        for bottom, top in bands
    ]
    return max(heights) > float(_VISIBLE_HEIGHT * (high - low))


def _draw_points(profile_axes: Axes, deviation_axes: Axes, measured: SmoothingResult) -> str:
    """Draw the points of a smoothed profile and their deviations from it.

    The points (y, z) are in mm; the deviations over y are in um, with dashed lines at twice the noise.

    Returns
    -------
    str
        Description of the smoothing for the title.
    """
    y, z = measured.points.T
    profile_axes.plot(y, z, ".", color=Colour.POINTS, ms=2)
    deviation_axes.plot(y, 1e3 * measured.residual_mm, ".", color=Colour.POINTS, ms=3)
    for level in (-2e3 * measured.noise_mm, 0.0, 2e3 * measured.noise_mm):
        deviation_axes.axhline(level, color="0.5", lw=0.8, ls="-" if level == 0.0 else "--")
    deviation_axes.set(ylabel="deviation of points in um\n(dashed: twice the noise)")
    smoothed_quantity = f"deviation from {measured.nominal}" if measured.nominal else "profile"
    return f": {smoothed_quantity} smoothed, filter length {measured.filter_mm:.3g} mm"


def draw_problems(
    ax: Axes, profile: Profile, to_picture: Callable[[Floats, Floats], tuple[Floats, Floats]] | None = None
) -> None:
    """Mark omitted and doubtful points of a file, with the reasons in the legend.

    Parameters
    ----------
    ax
        Axes to draw into.
    profile
        Profile with its problems.
    to_picture
        Function from y and z of the profile (mm) to coordinates of the picture; None if they are equal.
    """
    groups: dict[str, list[PointProblem]] = {}
    for problem in profile.problems:
        groups.setdefault(_PROBLEM_LABELS[problem.what], []).append(problem)
    for (reason, problems), marker in zip(groups.items(), SERIES_MARKS, strict=False):
        y, z = np.array([(mark.y_mm, mark.z_mm) for mark in problems]).T
        y, z = (y, z) if to_picture is None else to_picture(y, z)
        # hollow, so that the profile is visible through the marks
        label = f"{reason} ({len(problems)})"
        ax.plot(y, z, marker, color=Colour.PROBLEM, mfc="none", mew=1.8, ms=10, ls="none", label=label)
    if groups:
        ax.legend(loc="best")


def _write_radii(ax: Axes, profile: Profile) -> None:
    """Write the radius beside each arc that is long enough for the text."""
    low, high = ax.get_xlim()
    for index in range(len(profile.segments)):
        p = profile.evaluate(index + np.array([1e-9, 0.5, 1.0 - 1e-9]))
        curvature = profile.convex_sign * profile.evaluate(index + np.linspace(0.01, 0.99, 9)).curvature_per_mm
        mean = float(np.mean(curvature))
        is_arc = abs(mean) > 1e-9 and bool(np.ptp(curvature) < 1e-6 * abs(mean))
        if is_arc and abs(float(p.y[2] - p.y[0])) > _MIN_ARC_WIDTH * (high - low):
            # profiles run to the field side: the material of a rail is on the right, of a wheel on the left
            inwards = np.array([p.z[2] - p.z[0], p.y[0] - p.y[2]]) * (1.0 if profile.kind == "rail" else -1.0)
            offset = tuple(13.0 * inwards / np.linalg.norm(inwards))
            style: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": "center", "fontsize": 8.5}
            ax.annotate(f"R{1.0 / mean:.4g}", (float(p.y[1]), float(p.z[1])), xytext=offset, **style)
