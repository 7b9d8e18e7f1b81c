"""Profiles from measured or tabulated points, and single points that are off their profile.

A suspicious file is refused with a remedy, and not repaired without notice: half of all problems with profiles are a
unit, a sign or an order. The notes of the profile contain all assumptions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats, Integers
from fecontact.errors import InputError
from fecontact.inputs.texts import count_text
from fecontact.profiles.curve import LARGEST_COORDINATE_MM, Profile, ProfileKind, check_shape
from fecontact.profiles.origin import SHORTEST_WHEEL_MM, check_origin, describe_short_wheel
from fecontact.profiles.outlines import cut_outline
from fecontact.profiles.point_noise import compare_with_neighbours, estimate_noise_mm, estimate_scatter
from fecontact.profiles.point_problems import PointProblem, compute_turning_angles, find_crossings, find_disorder
from fecontact.profiles.reading import Reading, suggest_option
from fecontact.profiles.segments import Segment, SmoothingResult, Spline, StraightSegment
from fecontact.profiles.suspicions import SuspiciousProfileError

# --- Single points that are off their profile: spikes of a measurement, and wrong digits in a table of exact points.
#
# Each point is compared with the cubic through its neighbours, in units of the scatter of the points around it. A spike
# of 0.001 mm is visible in a table of exact points, and invisible in a table that is rounded to 0.001 mm. Corners and
# junctions are off the cubic too. The criterion of a spike is that no point is off the cubic after its removal.

# Least distance of a spike, in multiples of the scatter of its neighbours. Noise of some thousand points stays below.
_SPIKE_SIGMAS = 7.0
# Where points scatter more than elsewhere, this number of points on each side gives the local scatter. Its estimate
# from few points is inaccurate, so it is multiplied by a weight.
_LOCAL_POINTS, _FEWEST_LOCAL_POINTS, _LOCAL_WEIGHT = 12, 4, 0.7
# Rounding moves a point off the cubic by at most the rounding step of the coordinates, in units of the error factor of
# the cubic.
_ROUNDING_STEPS, _ROUNDED_SHARE = 1.5, 0.9
# A spike of the size e among points with a spacing h changes the curvature of a spline by 4.4 e / h^2. A smaller change
# has no effect: 3 % of R 300 mm.
_SPIKE_BEND, _HARMLESS_BEND_PER_MM = 4.4, 1e-4
# A junction from straight to R 10 mm is off the cubic by up to the second number (1/mm) times the square of the
# spacing. The first number is added.
_JUNCTION_MISS_MM, _JUNCTION_MISS_PER_MM = 0.003, 0.012
# After the removal of a spike, its neighbours are off by less than this fraction of it: for a spike that is too large
# for a junction, and for a smaller spike.
_REMAINDER_OF_LARGE, _REMAINDER_OF_SMALL = 0.35, 0.2
_LARGEST_SPIKE_COUNT = 50
# Two junctions within four points look like a spike of this factor times the square of the spacing times the local
# curvature. So do all junctions where the spacing changes by more than the second factor.
_TWO_JUNCTIONS_FACTOR, _EVEN_SPACING_RATIO = 0.75, 1.6


def find_spikes(points: Floats) -> list[PointProblem]:
    """Single points that are off the profile through their neighbours.

    Parameters
    ----------
    points
        Points (n, 2) in mm.

    Returns
    -------
    list of PointProblem
        Spikes, the largest first.
    """
    problems: list[PointProblem] = []
    remaining, index = points, np.arange(len(points))
    while len(problems) < _LARGEST_SPIKE_COUNT and (spike := _find_largest_spike(remaining)) is not None:
        k, distance = spike
        problems.append(PointProblem.make_at("spike", int(index[k]), remaining[k], distance))
        remaining, index = np.delete(remaining, k, axis=0), np.delete(index, k)
    return problems


def find_unclear_points(points: Floats) -> list[PointProblem]:
    """Points near a corner or a junction that may be spikes.

    They are off the profile on their left and off the profile on their right. A junction is off one side only, but two
    junctions within a few points may look like a spike.

    Parameters
    ----------
    points
        Points (n, 2) in mm.

    Returns
    -------
    list of PointProblem
        Doubtful points, in the order along the profile.
    """
    if len(points) < 2 * _LOCAL_POINTS:
        return []
    rounding, harmless_mm = _ROUNDING_STEPS * _estimate_resolution_mm(points), _harmless_sizes(points)
    distances, limit = _compare_with_both_sides(points, rounding, harmless_mm)
    limit = np.maximum(limit, _limit_two_junctions(points))
    problems = []
    for k in (int(i) for i in np.flatnonzero(np.abs(distances) > limit)):
        remaining, _ = _compare_with_both_sides(np.delete(points, k + 2, axis=0), rounding, np.delete(harmless_mm, k))
        if np.abs(remaining[max(k - 4, 0) : k + 4]).max() < min(_REMAINDER_OF_SMALL * abs(distances[k]), limit[k]):
            problems.append(PointProblem.make_at("unclear", k + 2, points[k + 2], float(distances[k])))
    return problems


def _find_largest_spike(points: Floats) -> tuple[int, float] | None:
    """Find the point that differs most from its neighbours.

    Parameters
    ----------
    points
        Points (n, 2) in mm.

    Returns
    -------
    tuple of int and float, or None
        Index of the point, and its distance from the cubic through its neighbours (mm); None without a spike.
    """
    distances, weight = compare_with_neighbours(points)
    if distances.size < _FEWEST_LOCAL_POINTS + 1:
        return None
    rounding = _ROUNDING_STEPS * _estimate_resolution_mm(points)
    usual = estimate_scatter(points, distances / weight)
    limit = _compute_miss_limits(distances, weight, rounding, _harmless_sizes(points), usual)
    everywhere = np.maximum(_SPIKE_SIGMAS * usual, rounding) * weight
    beyond_junctions = np.maximum(everywhere, _JUNCTION_MISS_MM + _JUNCTION_MISS_PER_MM * _mean_spacing(points) ** 2)
    over = np.abs(distances) / np.minimum(limit, beyond_junctions)
    for k in (int(i) for i in np.argsort(-over)[: np.count_nonzero(over > 1.0)]):
        size = abs(float(distances[k]))
        # a corner or a junction causes the distances next to it
        around = slice(max(k - 4, 0), k + 9)
        position = k - around.start
        rest, _ = compare_with_neighbours(np.delete(points[around], position + 2, axis=0))
        near = np.abs(rest[max(position - 2, 0) : position + 2])
        largest_remainder = max(_REMAINDER_OF_LARGE * size, everywhere[k])
        large = size > beyond_junctions[k] and near.size > 0 and near.max() < largest_remainder
        small = size > limit[k] and near.size == 4 and near.max() < min(_REMAINDER_OF_SMALL * size, limit[k])
        if (large and _is_outlier(points, k + 2)) or (small and _is_outlier(points, k + 2, bent=True)):
            return k + 2, float(distances[k])
    return None


def _mean_spacing(points: Floats) -> Floats:
    """Mean spacing of every five points (n, 2), in mm."""
    return np.asarray(0.25 * np.hypot(*(points[4:] - points[:-4]).T))


def _harmless_sizes(points: Floats) -> Floats:
    """Sizes (n - 4,) of spikes in mm that do not affect the curvature."""
    return np.asarray(_HARMLESS_BEND_PER_MM / _SPIKE_BEND * _mean_spacing(points) ** 2)


def _compute_miss_limits(
    distances: Floats, weight: Floats, rounding: float, harmless_mm: Floats, usual: Floats
) -> Floats:
    """Compute the largest distances from the cubic that scatter and rounding explain.

    Parameters
    ----------
    distances, weight
        Distances (n,) in mm from the cubic through the neighbours, and their error factors.
    rounding
        Distance (mm) that rounding of the coordinates causes.
    harmless_mm
        Distances (n,) that do not matter for the curvature (mm).
    usual
        Usual scatter (n,) in mm.

    Returns
    -------
    ndarray
        Limits (n,) in mm.
    """
    return np.asarray(
        np.maximum(
            np.maximum(_SPIKE_SIGMAS * _estimate_local_scatter(distances / weight, usual), rounding) * weight,
            harmless_mm,
        )
    )


def _estimate_local_scatter(distances: Floats, usual: Floats) -> Floats:
    """Estimate the standard deviation of points from distances to the cubic through their neighbours.

    Parameters
    ----------
    distances
        Distances (n,) divided by their error factors (mm).
    usual
        Usual standard deviation (n,) in mm.

    Returns
    -------
    ndarray
        Standard deviation (n,) in mm: the usual value, or a larger local value.
    """
    n, reach = distances.size, _LOCAL_POINTS
    padded = np.concatenate((np.full(reach, np.nan), np.abs(distances), np.full(reach, np.nan)))
    windows = np.lib.stride_tricks.sliding_window_view(padded, reach - 2)
    # a spike moves the cubics of its two neighbours on each side too
    sides = [_LOCAL_WEIGHT * _compute_window_medians(windows[start : start + n]) for start in (0, reach + 3)]
    return np.asarray(np.fmax.reduce([usual, *(side / 0.6745 for side in sides)]))


def _compute_window_medians(windows: Floats) -> Floats:
    is_sufficient = np.count_nonzero(np.isfinite(windows), axis=1) >= _FEWEST_LOCAL_POINTS
    medians = np.full(len(windows), np.nan)
    medians[is_sufficient] = np.nanmedian(windows[is_sufficient], axis=1)
    return medians


def _estimate_resolution_mm(points: Floats) -> float:
    """Estimate the power of ten to which the coordinates are rounded, except for a few.

    The result is 0 for more than nine digits.
    """
    for digits in range(1, 10):
        rounded = np.abs(points - np.round(points, digits)) < 1e-10
        if rounded.mean() > _ROUNDED_SHARE:
            return float(10.0**-digits)
    return 0.0


def _is_outlier(points: Floats, k: int, *, bent: bool = False) -> bool:
    """Whether point k differs from a profile that continues in its direction or its curvature.

    A corner does not differ in this way.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    k
        Index of the point.
    bent
        Whether the profile continues in its curvature.

    Returns
    -------
    bool
        Whether the angles at the point and its neighbours nearly cancel.
    """
    angles = compute_turning_angles(points[max(k - 3, 0) : k + 4])
    middle = k - max(k - 3, 0) - 1
    before, middle_angle, after = angles[middle - 1 : middle + 2]
    # the angles that the spike does not change give the curvature of the profile
    other_angles = [*angles[: middle - 1], *angles[middle + 2 :]]
    bend = float(np.mean(other_angles)) if bent and other_angles else 0.0
    return bool(abs(before + middle_angle + after - 3.0 * bend) < 0.5 * abs(middle_angle - bend))


def _compare_with_both_sides(points: Floats, rounding: float, harmless_mm: Floats) -> tuple[Floats, Floats]:
    """Compare each inner point with the profiles extrapolated from both sides.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    rounding
        Distance (mm) that rounding of the coordinates causes.
    harmless_mm
        Distances (n - 4,) that do not matter for the curvature (mm).

    Returns
    -------
    smaller_distances, limit
        The smaller of both distances (n - 4,), and its limit (n - 4,), in mm.
    """
    (right, right_limit), (left, left_limit) = (
        (
            distances,
            _compute_miss_limits(
                distances, weight, rounding, harmless_mm, estimate_scatter(points, distances / weight)
            ),
        )
        for distances, weight in (compare_with_neighbours(points, place) for place in (0, 4))
    )
    smaller_distances, limit = np.zeros(right.size), np.full(right.size, np.inf)
    # the first of five points is compared with the points on its right, the last with the points on its left
    inner = slice(2, right.size - 2)
    smaller_distances[inner] = np.where(np.abs(right[4:]) < np.abs(left[:-4]), right[4:], left[:-4])
    limit[inner] = np.maximum(right_limit[4:], left_limit[:-4])
    return smaller_distances, limit


def _limit_two_junctions(points: Floats) -> Floats:
    """Compute the largest apparent distances that two close junctions cause.

    Parameters
    ----------
    points
        Points (n, 2) in mm.

    Returns
    -------
    ndarray
        Distances (n - 4,) in mm; infinite where the spacing of the points is uneven.
    """
    chord = np.hypot(*np.diff(points, axis=0).T)
    around = np.lib.stride_tricks.sliding_window_view(chord, 8)
    low, high = around.min(axis=1), around.max(axis=1)
    # a spike turns the chords by twice its size divided by the spacing, and by half of this at its neighbours
    turning = np.lib.stride_tricks.sliding_window_view(np.abs(compute_turning_angles(points)), 7)
    turning = np.maximum(0.35 * turning.max(axis=1), turning[:, [0, 1, 5, 6]].max(axis=1))
    limits = np.full(len(points) - 4, np.inf)
    limits[2:-2] = np.where(high < _EVEN_SPACING_RATIO * low, _TWO_JUNCTIONS_FACTOR * turning * high, np.inf)
    return limits


# --- Profiles from measured or tabulated points.

# Least angle between neighbouring chords at a corner of the body (rad, 20 degrees). A coarsely sampled fillet has less.
SPLIT_ANGLE_RAD = 0.35
# Root mean square of the curvature of a cubic spline through independent errors e at spacing h, in e / h^2: the
# transfer function 12 (1 - cos w) / (4 + 2 cos w) of the spline averaged over all waves.
SPLINE_NOISE = 6.0
FEWEST_POINTS = 10
# A spline is used if the noise of its curvature is smaller (1/mm): 1 % of R 300.
_CURVATURE_NOISE_PER_MM = 3e-5
# Spikes up to this size are left out without a request, in tables of exact points and in measured points. The profile
# does not need them.
_TINY_SPIKE_MM = 0.002, 0.01
# Largest fraction of the points that a repair may leave out.
_LARGEST_OMITTED_SHARE = 0.05
_LARGEST_POINT_COUNT = 10_000
# Least angle of a kink, and its least ratio to the angles at the neighbours.
_KINK_RAD, _KINK_RATIO = 0.01, 8.0
# Depth of the part of a rail's head in which the widest points are searched. A side that turns in by less is a steep
# side.
_HEAD_DEPTH_MM, _LEAST_TURN_IN_MM = 45.0, 0.02
# Neighbours that differ by less have no order: two points of a thousand differ by four standard deviations. Where two
# scans of an instrument meet, points scatter by up to the second number.
_NOISE_SIGMAS, _LARGEST_LOCAL_NOISE_MM = 8.0, 0.05
# The shoulders of a head are compared if the head has this width. They are at this distance from its sides. The sides
# are searched at this depth below the top.
_WHOLE_HEAD_WIDTH_MM, _SHOULDER_OFFSET_MM, _SHOULDER_DEPTH_MM, _LEAST_SHOULDER_DEPTH_MM = 50.0, 8.0, 14.0, 4.0
# No rail touches a chamfer beyond this position on a tread; a tread rises by 0.07. No wheel touches a side of a head at
# this depth.
_TREAD_END_MM, _CHAMFER_RAD = 45.0, 0.35
_SIDE_DEPTH_MM, _SIDE_SLOPE_RAD = 16.0, 1.0
# Points that are closer are equal: far below the resolution of instruments, and far above rounding errors of some
# 100 mm.
_REPEATED_POINT_MM = 1e-9


_UNKNOWN_SHAPE = ". Several bodies in a file, such as a crossing nose with its wing rail, are not a known shape"
# The narrowest heads, of light rails, have 40 mm at the depth at which the gauge is measured.
_NARROWEST_HEAD_MM, _WIDTH_DEPTH_MM = 38.0, 14.0


@dataclass(frozen=True, kw_only=True, eq=False)
class ProfilePoints:
    """Points along a running surface, before a profile is made of them.

    Attributes
    ----------
    points : ndarray of shape (n, 2)
        y and z in mm, in the order along the profile.
    kind, name, source
        Properties of the profile.
    notes, problems
        Assumptions; points that were left out, and doubtful points.
    flipped_columns
        Columns option for the file with the opposite sign of z.
    gauge_side_end_mm
        Widest point (y, z) of a head, at which its gauge side was cut; None if it was not cut.
    question
        Refusal of a file whose header does not define the origin; empty if the origin is known.
    """

    points: Floats
    kind: ProfileKind
    name: str
    source: str = ""
    notes: tuple[str, ...] = ()
    problems: tuple[PointProblem, ...] = ()
    flipped_columns: str = "1,-2"
    gauge_side_end_mm: tuple[float, float] | None = None
    question: str = ""


def check_points(file_points: ProfilePoints, reading: Reading) -> ProfilePoints:
    """Check the points of a running surface, and put them in order.

    Parameters
    ----------
    file_points
        Points of a file.
    reading
        Options of the file.

    Returns
    -------
    ProfilePoints
        Points in the axes of the library, from small to large y, with notes.

    Raises
    ------
    InputError
        The points do not look like a running surface.
    """
    points, remarks, name = file_points.points, list(file_points.notes), file_points.name
    # the comparison is also false for NaN
    invalid = np.flatnonzero(~(np.abs(points) <= LARGEST_COORDINATE_MM).all(axis=1))
    if invalid.size:
        raise InputError(
            f"{name}: point {invalid[0] + 1} is {_format_point(points[invalid[0]])}; allowed: "
            f"-{LARGEST_COORDINATE_MM:g} to {LARGEST_COORDINATE_MM:g} mm; "
            "remove it, or move the origin to the crown of the rail or the tape circle of the wheel"
        )

    points, repeated = _drop_repeated_points(points)
    if repeated:
        remarks.append(f"{count_text(repeated, 'repeated point')} left out")
    if not FEWEST_POINTS <= len(points) <= _LARGEST_POINT_COUNT:
        raise InputError(
            f"{name}: there are {count_text(len(points), 'different point')}; allowed: {FEWEST_POINTS} to "
            f"{_LARGEST_POINT_COUNT}; give a point every 0.1 to 0.5 mm"
        )
    points, cut_remarks = cut_outline(points, file_points.kind, name, file_points.flipped_columns)
    if points[-1, 0] < points[0, 0]:
        points = points[::-1]
        remarks.append("the points are in the order of decreasing y: their order is reversed")

    outline_end_mm = (float(points[0, 0]), float(points[0, 1])) if cut_remarks and file_points.kind == "rail" else None
    points, end_remarks, gauge_side_end_mm = _cut_turned_in_ends(points, file_points.kind)
    if len(points) < FEWEST_POINTS:
        raise InputError(
            f"{name}: {count_text(len(points), 'point')} of the file can be a running surface, without closed outlines"
            f" and ends that turn back; allowed: at least {FEWEST_POINTS}; give the points of the running surface in"
            " their order along it"
        )
    # the shape of a profile that turns back is undefined, so wrong points are removed first
    points, problems, repair_remarks = _remove_wrong_points(points, file_points, repair=reading.repair)
    if file_points.question:
        raise SuspiciousProfileError(file_points.question, "tape circle")
    check_shape(
        *points.T,
        kind=file_points.kind,
        what=name,
        flipped_columns=file_points.flipped_columns,
        unit=reading.units or "mm",
        is_mirrored=bool(reading.mirror),
    )
    points = points - (0.0, reading.tape_circle_z_mm or 0.0)
    points, gap_remarks = _check_spacing(points, file_points.kind, name)
    remarks += [*cut_remarks, *end_remarks, *repair_remarks, *gap_remarks]
    remarks += [
        *_describe_assumptions(file_points.kind),
        *_describe_width(points, file_points.kind),
        *check_origin(points, file_points.kind, reading, name),
        *_describe_kinks(points),
    ]
    return replace(
        file_points,
        points=points,
        notes=tuple(remarks),
        problems=problems,
        gauge_side_end_mm=gauge_side_end_mm or outline_end_mm,
    )


def measure_spacing_mm(points: Floats) -> float:
    """Median distance of neighbours among points (n, 2), in mm.

    Parameters
    ----------
    points : ndarray of shape (n, 2)
        Points in mm.

    Returns
    -------
    float
        Distance in mm.
    """
    return float(np.median(np.hypot(*np.diff(points, axis=0).T)))


def is_exact(points: Floats) -> bool:
    """Whether the noise of points (n, 2) is invisible in the curvature of a spline.

    Parameters
    ----------
    points : ndarray of shape (n, 2)
        Points in mm.

    Returns
    -------
    bool
        Whether the points are as good as exact.
    """
    return SPLINE_NOISE * estimate_noise_mm(points) / measure_spacing_mm(points) ** 2 < _CURVATURE_NOISE_PER_MM


def fit_splines(file_points: ProfilePoints) -> Profile:
    """Fit cubic splines through checked points, between their corners.

    Parameters
    ----------
    file_points
        Checked points.

    Returns
    -------
    Profile
        Profile through all points.
    """
    points, corners, remarks = file_points.points, _find_corners(file_points.points), []
    if corners.size:
        where = ", ".join(f"{points[i, 0]:.2f}" for i in corners[:6]) + (" ..." if corners.size > 6 else "")
        remarks.append(f"split at {count_text(corners.size, 'corner')}: y = {where} mm")
    remarks.append(_describe_noise(points))
    pieces = np.split(np.arange(len(points)), corners)
    return build_profile(
        file_points, tuple(_make_segment(points[piece[0] : piece[-1] + 2]) for piece in pieces), remarks
    )


def build_profile(
    file_points: ProfilePoints,
    segments: tuple[Segment, ...],
    remarks: Sequence[str],
    measured: SmoothingResult | None = None,
) -> Profile:
    """Build the profile of segments that were made of points.

    Parameters
    ----------
    file_points
        Checked points.
    segments
        Segments of the profile.
    remarks
        Notes on the profile.
    measured
        Smoothing; None for a profile through the points.

    Returns
    -------
    Profile
        Profile with all notes.
    """
    return Profile(
        name=file_points.name,
        kind=file_points.kind,
        segments=segments,
        source=file_points.source,
        notes=(*file_points.notes, *remarks),
        measured=measured,
        points=file_points.points,
        problems=file_points.problems,
        gauge_side_end_mm=file_points.gauge_side_end_mm,
    )


def _find_corners(points: Floats) -> Integers:
    """Find the indices of the points with an angle of a corner."""
    return np.flatnonzero(np.abs(compute_turning_angles(points)) > SPLIT_ANGLE_RAD) + 1


def _describe_width(points: Floats, kind: ProfileKind) -> list[str]:
    """Describe a profile that is narrower than any tread or any head.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    kind
        `rail` or `wheel`.

    Returns
    -------
    list of str
        Notes.
    """
    y, z = points.T
    if kind == "wheel":
        width = float(np.ptp(y))
        return [describe_short_wheel(width)] if width < SHORTEST_WHEEL_MM else []
    level = float(z.max()) - _WIDTH_DEPTH_MM
    width = float(np.ptp(y[z >= level]))
    if max(z[0], z[-1]) > level or width >= _NARROWEST_HEAD_MM:
        return []
    return [
        f"the profile is {width:.0f} mm wide {_WIDTH_DEPTH_MM:g} mm below its top, narrower than any rail head: a"
        " crossing nose, a switch tongue or a part of a head is taken as a rail that is equal along the track"
    ]


def _describe_kinks(points: Floats) -> list[str]:
    """Describe kinks: large angles within two points, with small angles at the neighbours.

    Junctions have no such angles, but a lost sign has.

    Parameters
    ----------
    points
        Points (n, 2) in mm.

    Returns
    -------
    list of str
        Notes.
    """
    turning = compute_turning_angles(points)
    if turning.size < 6:
        return []
    turns = np.abs(turning[2:-3] + turning[3:-2])
    neighbour_turns = np.max(np.abs([turning[:-5], turning[1:-4], turning[4:-1], turning[5:]]), axis=0)
    kinks = (
        np.flatnonzero((turns > _KINK_RAD) & (turns < SPLIT_ANGLE_RAD) & (turns > _KINK_RATIO * neighbour_turns)) + 2
    )
    # the point with the larger angle of two, and each point once
    places = dict.fromkeys(int(i) + int(abs(turning[i + 1]) > abs(turning[i])) for i in kinks)
    return [f"a kink at {_format_point(points[i + 1])}: a corner of the body, or a wrong sign" for i in places]


def _drop_repeated_points(points: Floats) -> tuple[Floats, int]:
    """Drop points (n, 2) that repeat the point before, and count them."""
    is_repeated = np.zeros(len(points), bool)
    is_repeated[1:] = np.hypot(*np.diff(points, axis=0).T) < _REPEATED_POINT_MM
    return points[~is_repeated], int(is_repeated.sum())


def drop_close_points(points: Floats, closest_mm: float) -> Floats:
    """Drop points that are close to the previous point that is kept.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    closest_mm
        Least distance (mm).

    Returns
    -------
    ndarray
        Remaining points (m, 2) in mm.
    """
    kept_points = points[:1].tolist()
    for point in points[1:]:
        if np.hypot(*(point - kept_points[-1])) >= closest_mm:
            kept_points.append(point)
    return np.array(kept_points)


def _cut_turned_in_ends(points: Floats, kind: ProfileKind) -> tuple[Floats, list[str], tuple[float, float] | None]:
    """Cut the ends of a profile that turn in beyond its widest points.

    A wheel or a rail that approaches from above or below does not touch such an end behind the widest point.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    kind
        `rail` or `wheel`.

    Returns
    -------
    points, notes, gauge_side_end_mm
        Remaining points (m, 2) in mm, notes on the omitted ends, and the widest point of a head if its gauge side was
        cut there.
    """
    y = _filter_single_points(points[:, 0])
    # the foot of a complete section is wider than its head
    near = np.flatnonzero((points[:, 1] > points[:, 1].max() - _HEAD_DEPTH_MM) | (kind == "wheel"))
    low, high = (_find_widest(points[:, 0], int(near[np.argmin(side * y[near])]), side) for side in (1.0, -1.0))
    middle, turned_in = 0.5 * (y[low] + y[high]), max(_LEAST_TURN_IN_MM, _NOISE_SIGMAS * estimate_noise_mm(points))
    first, last, remarks = 0, len(points) - 1, []
    # a foot is below both, and may begin or end anywhere
    deep = (points[:, 1] < points[:, 1].max() - _HEAD_DEPTH_MM) & (kind == "rail")
    if low < high and y[low] + turned_in < y[: low + 1].max() and (y[: low + 1].max() < middle or deep[:low].any()):
        first = low
    if low < high and y[high] - turned_in > y[high:].min() and (y[high:].min() > middle or deep[high:].any()):
        last = high
    for end, omitted in ((first, first), (last, len(points) - 1 - last)):
        if omitted:
            remarks.append(
                f"the profile turns in beyond its widest point {_format_point(points[end])}: "
                f"{count_text(omitted, 'point')} cut off"
            )
    widest = (float(points[first, 0]), float(points[first, 1])) if first and kind == "rail" else None
    return points[first : last + 1], remarks, widest


def _find_widest(y: Floats, near: int, side: float) -> int:
    """Find the index of the least `side` times y near an approximate index.

    The approximate index ignores single points.
    """
    start = max(near - 3, 0)
    return start + int(np.argmin(side * y[start : near + 4]))


def _filter_single_points(values: Floats) -> Floats:
    """Filter single outlying points, or pairs, from values (n,) by the median of every five."""
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(np.pad(values, 2, "reflect"), 5), axis=1))


def _remove_wrong_points(
    points: Floats, file_points: ProfilePoints, *, repair: bool
) -> tuple[Floats, tuple[PointProblem, ...], list[str]]:
    """Remove wrong points, if it is requested.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    file_points
        Points of the file, for messages.
    repair
        Whether wrong points may be removed.

    Returns
    -------
    points, problems, notes
        Remaining points (m, 2) in mm, problems of removed and doubtful points, and notes.

    Raises
    ------
    InputError
        Points are wrong and may not be removed, or too many points are wrong.
    """
    left_out: list[PointProblem] = []
    tiny = _TINY_SPIKE_MM[0] if is_exact(points) else _TINY_SPIKE_MM[1]
    for find_problems in (_find_disorder_beyond_noise, find_spikes, _find_crossings_beyond_noise):
        while problems := find_problems(points):
            large = [problem for problem in problems if problem.what != "spike" or abs(problem.size_mm) > tiny]
            too_many = len(left_out) + len(problems) > _LARGEST_OMITTED_SHARE * len(points)
            if large and (too_many or not repair):
                is_remedy = not (repair or too_many) and _can_repair(points, file_points)
                text = _explain_refusal(large, file_points, is_remedy=is_remedy, too_many=too_many)
                if all(problem.what == "spike" for problem in large):
                    raise SuspiciousProfileError(text, "dented")
                raise InputError(text)
            if too_many:
                break
            # points out of order are searched again among their new neighbours
            removed = problems if find_problems is find_spikes else problems[:1]
            left_out += removed
            # a removed point may have been between two equal points
            points, _ = _drop_repeated_points(np.delete(points, [problem.index for problem in removed], axis=0))
    omitted_text = _list_texts([problem.text for problem in left_out])
    notes = [f"{count_text(len(left_out), 'point')} left out: {omitted_text}"] if left_out else []
    if doubtful := find_unclear_points(points):
        notes.append(
            f"{_list_texts([problem.text for problem in doubtful])}: wrong points, or two junctions close together; the"
            " profile bends there"
        )
    is_backward = np.diff(points[:, 0]) <= 0.0
    if is_backward.any():
        notes.append(
            f"the profile is vertical or overhangs at {count_text(int(is_backward.sum()), 'point')}: kept as a steep"
            " side"
        )
    return points, (*left_out, *doubtful), notes


def _find_disorder_beyond_noise(points: Floats) -> list[PointProblem]:
    """Find points at which the profile turns back by more than the local noise."""
    return find_disorder(points, _estimate_local_noise(points))


def _find_crossings_beyond_noise(points: Floats) -> list[PointProblem]:
    """Find points at which the profile crosses itself by more than the local noise."""
    noise = _estimate_local_noise(points)
    return [problem for problem in find_crossings(points) if problem.size_mm > noise[problem.index]]


def _estimate_local_noise(points: Floats) -> Floats:
    """Estimate the displacement of each point that the local scatter allows.

    Points that differ by less have no order.

    Parameters
    ----------
    points
        Points (n, 2) in mm.

    Returns
    -------
    ndarray
        Displacements (n,) in mm.
    """
    distances, weight = compare_with_neighbours(points)
    usual = estimate_noise_mm(points)
    if not distances.size:
        return np.zeros(len(points))
    local = np.clip(
        _estimate_local_scatter(distances / weight, np.full(distances.size, usual)),
        usual,
        max(usual, _LARGEST_LOCAL_NOISE_MM),
    )
    return _NOISE_SIGMAS * np.pad(local, 2, "edge")


def _can_repair(points: Floats, file_points: ProfilePoints) -> bool:
    """Whether a profile remains if the wrong points are removed."""
    try:
        _remove_wrong_points(points, file_points, repair=True)
    except InputError:
        return False
    return True


def _explain_refusal(
    problems: list[PointProblem], file_points: ProfilePoints, *, is_remedy: bool, too_many: bool
) -> str:
    """Explain the refusal of wrong points, with the remedy.

    Parameters
    ----------
    problems
        Problems of points.
    file_points
        Points of the file.
    is_remedy
        Whether the removal of the points helps.
    too_many
        Whether more points are wrong than may be removed.

    Returns
    -------
    str
        Message.
    """
    text = f"{file_points.name}: {_list_texts([problem.text for problem in problems])}"
    if too_many:
        text += f"; this is more than {100 * _LARGEST_OMITTED_SHARE:g} % of the points"
        if not _find_disorder_beyond_noise(file_points.points[:, ::-1]):
            y, z = file_points.flipped_columns.replace("-", "").split(",")
            return (
                f"{text}; the columns y and z are exchanged: {suggest_option(file_points.kind, 'columns', f'{z},{y}')}"
            )
    mend = f", or {suggest_option(file_points.kind, 'repair', 'yes')} to leave such points out" if is_remedy else ""
    if problems[0].what == "spike":
        return f"{text}; {'correct the file' if mend else 'measure the profile again'}{mend}"
    return (
        f"{text}; give each point of the running surface once, in the order along the profile, without the inside of"
        f" the body{mend or _UNKNOWN_SHAPE}"
    )


def _list_texts(texts: list[str]) -> str:
    return "; ".join(texts[:4]) + (f" and {len(texts) - 4} more" if len(texts) > 4 else "")


def _format_point(point: Floats) -> str:
    return f"({point[0]:.4g}, {point[1]:.4g}) mm"


def _check_spacing(points: Floats, kind: ProfileKind, name: str) -> tuple[Floats, list[str]]:
    """Check the gaps between points.

    A gap where no contact is possible is filled, or the profile is cut there.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    kind
        `rail` or `wheel`.
    name
        Name in the message.

    Returns
    -------
    points, notes
        Points (m, 2) in mm, and notes.

    Raises
    ------
    InputError
        A gap is too wide.
    """
    chord = np.hypot(*np.diff(points, axis=0).T)
    # a straight face between two corners needs only its ends
    is_end = np.ones(len(points), dtype=bool)
    is_end[1:-1] = False
    is_end[_find_corners(points)] = True
    chord[is_end[:-1] & is_end[1:]] = 0.0
    typical = float(np.median(chord))
    largest_gap_mm = max(2.0, 10.0 * typical)
    remarks = []
    is_reachable, is_side = _find_reachable(points, kind)
    first, last = 0, len(points) - 1
    for gap in np.flatnonzero((chord > largest_gap_mm) & ~is_reachable):
        action = "filled by a straight segment"
        if not is_side[gap]:
            # the profile beyond the gap may belong to a different part of the body
            action = "the profile is cut there"
            if is_reachable[:gap].any():
                last = min(last, int(gap))
            else:
                first = int(gap) + 1
        remarks.append(
            f"a gap of {chord[gap]:.2f} mm after {_format_point(points[gap])}, where no contact is possible: {action}"
        )
        chord[gap] = 0.0
    points, chord = points[first : last + 1], chord[first:last]
    widest = int(chord.argmax())
    if chord[widest] > largest_gap_mm:
        raise InputError(
            f"{name}: a gap of {chord[widest]:.2f} mm after {_format_point(points[widest])}, where the usual spacing"
            " is "
            f"{typical:.2g} mm; allowed: at most {largest_gap_mm:.3g} mm; add points there or cut the file at the gap"
        )
    if chord[widest] > 2.0:
        remarks.append(
            f"points are up to {chord[widest]:.2g} mm apart, at {_format_point(points[widest])}: smaller features are"
            " missed"
        )
    return points, remarks


def _find_reachable(points: Floats, kind: ProfileKind) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Find the chords within the reach of a contact, and steep chords.

    No contact is on the chamfer of a tread, far below the top of a head, and on the back of a flange.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    kind
        `rail` or `wheel`.

    Returns
    -------
    is_reachable, is_side : ndarray of bool
        Answers (n - 1,) for each chord.
    """
    (y, z), (dy, dz) = points.T, np.diff(points, axis=0).T
    steep = np.arctan2(np.abs(dz), np.abs(dy))
    if kind == "rail":
        deep = z < z.max() - _SIDE_DEPTH_MM
        return ~(deep[:-1] & deep[1:]), steep > _SIDE_SLOPE_RAD
    behind = y <= y[np.argmin(z)]
    is_back = behind[:-1] & behind[1:]
    is_chamfer = (y[:-1] > _TREAD_END_MM) & (steep > _CHAMFER_RAD)
    return ~(is_back | is_chamfer), is_back | is_chamfer


def _describe_assumptions(kind: ProfileKind) -> list[str]:
    across = "y positive to the field side" + (" and 0 at the tape circle" if kind == "wheel" else "")
    canted = ", not canted" if kind == "rail" else ""
    return [f"assumed: mm, {across}, z up{canted}"]


# A new head that is canted outwards by 1:40 is lower near its field side by slightly more.
LARGEST_FIELD_SIDE_DROP_MM = 1.0


def measure_field_side_drop_mm(points: Floats) -> float | None:
    """Measure the drop of a head near its field side relative to its gauge side.

    Parameters
    ----------
    points
        Points (n, 2) in mm.

    Returns
    -------
    float or None
        Drop (mm), positive if the field side is lower; None for an incomplete head.
    """
    y, z = points.T
    # both sides of the head at the depth below its top that both sides reach
    level = max(z.max() - _SHOULDER_DEPTH_MM, z[0], z[-1])
    head_y = y[z >= level]
    if np.ptp(head_y) < _WHOLE_HEAD_WIDTH_MM or level > z.max() - _LEAST_SHOULDER_DEPTH_MM:
        return None
    gauge, field = np.interp(
        (head_y[0] + _SHOULDER_OFFSET_MM, head_y[-1] - _SHOULDER_OFFSET_MM), np.maximum.accumulate(y), z
    )
    return float(gauge - field)


def _describe_noise(points: Floats) -> str:
    """Describe the scatter of the points and the curvature error of a spline.

    Parameters
    ----------
    points
        Points (n, 2) in mm.

    Returns
    -------
    str
        Note.
    """
    scatter = estimate_noise_mm(points)
    spacing = measure_spacing_mm(points)
    noise = SPLINE_NOISE * scatter / spacing**2
    return (
        f"{len(points)} points about {spacing:.2g} mm apart with a noise of about {scatter:.1g} mm: "
        f"curvature uncertain by about {noise:.1g} 1/mm (a radius of 300 mm has {1 / 300:.1g} 1/mm)"
    )


def _make_segment(points: Floats) -> Segment:
    if len(points) == 2:
        return StraightSegment(
            start=(float(points[0, 0]), float(points[0, 1])), end=(float(points[1, 0]), float(points[1, 1]))
        )
    return Spline(points=points)
