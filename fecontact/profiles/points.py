"""Profiles from measured or tabulated points, and single points that lie off their line.

A file that looks wrong is refused with the remedy rather than repaired in silence: half of all trouble with profiles is
a unit, a sign or an order. What had to be assumed is written into the notes of the profile.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats, Integers
from fecontact.errors import InputError
from fecontact.profiles.curve import LARGEST_COORDINATE_MM, Kind, Profile, check_shape
from fecontact.profiles.origin import check_origin
from fecontact.profiles.point_noise import estimate_scatter, missed_by_neighbours, noise_of
from fecontact.profiles.point_problems import Problem, compute_turning_angles, crossings, out_of_order
from fecontact.profiles.reading import Reading, remedy
from fecontact.profiles.segments import Line, Measured, Segment, Spline

# --- Single points that lie off their line: spikes of a measurement, and wrong digits in a table of exact points.
#
# Each point is compared with the cubic through its neighbours, in units of what the points about it scatter: one of
# 0.001 mm stands out of a table of exact points, and none does of one that is rounded to 0.001 mm. A corner or a
# junction makes points miss as well; what tells a spike is that nothing misses any more without it.

# A spike lies off by so many times the scatter of its neighbours: beyond what noise does in some thousand points.
_SPIKE_SIGMAS = 7.0
# Where they scatter more than elsewhere, so many points on either side say how much. Few points do not know it well, so
# only this part of what they say counts.
_LOCAL_POINTS, _FEWEST_LOCAL_POINTS, _LOCAL_WEIGHT = 12, 4, 0.7
# Rounding makes a point miss by the step that coordinates are rounded to at most, in units of the weight of its guess.
_ROUNDING_STEPS, _ROUNDED_SHARE = 1.5, 0.9
# A spike of the size e among points a step h apart bends a spline by 4.4 e / h^2. One that bends it by less changes
# nothing: 3 % of R 300 mm.
_SPIKE_BEND, _HARMLESS_BEND_PER_MM = 4.4, 1e-4
# A junction from straight to R 10 mm misses by up to so much of the square of the spacing (1/mm).
_JUNCTION_MISS_MM, _JUNCTION_MISS_PER_MM = 0.003, 0.012
# Without a spike its neighbours miss less than this part of it: one that no junction can be, and a smaller one.
_REMAINDER_OF_LARGE, _REMAINDER_OF_SMALL = 0.35, 0.2
_LARGEST_SPIKE_COUNT = 50
# Two junctions within four points look like a spike by this part of the square of the spacing times the curvature
# there; so do any where the spacing changes by more than this factor.
_TWO_JUNCTIONS_FACTOR, _EVEN_SPACING_RATIO = 0.75, 1.6


def spikes(points: Floats) -> list[Problem]:
    """Single points (n, 2) that lie off the line through their neighbours, the largest first."""
    found: list[Problem] = []
    left, index = points, np.arange(len(points))
    while len(found) < _LARGEST_SPIKE_COUNT and (at := _find_largest_spike(left)) is not None:
        k, missed = at
        found.append(Problem.from_point("spike", int(index[k]), left[k], missed))
        left, index = np.delete(left, k, axis=0), np.delete(index, k)
    return found


def unclear(points: Floats) -> list[Problem]:
    """Points (n, 2) beside a corner or a junction that may be spikes: off the lines on their left and on their right.

    A junction is on one side only; two junctions within a few points may look the same.
    """
    if len(points) < 2 * _LOCAL_POINTS:
        return []
    rounding, least = _ROUNDING_STEPS * _estimate_resolution_mm(points), _harmless_sizes(points)
    off, limit = _compare_with_both_sides(points, rounding, least)
    limit = np.maximum(limit, _limit_two_junctions(points))
    found = []
    for k in (int(i) for i in np.flatnonzero(np.abs(off) > limit)):
        rest, _ = _compare_with_both_sides(np.delete(points, k + 2, axis=0), rounding, np.delete(least, k))
        if np.abs(rest[max(k - 4, 0) : k + 4]).max() < min(_REMAINDER_OF_SMALL * abs(off[k]), limit[k]):
            found.append(Problem.from_point("unclear", k + 2, points[k + 2], float(off[k])))
    return found


def _find_largest_spike(points: Floats) -> tuple[int, float] | None:
    """Index of the point (n, 2) that stands out most among its neighbours, and by how much; None if none does."""
    missed, weight = missed_by_neighbours(points)
    if missed.size < _FEWEST_LOCAL_POINTS + 1:
        return None
    rounding = _ROUNDING_STEPS * _estimate_resolution_mm(points)
    usual = estimate_scatter(points, missed / weight)
    limit = _compute_miss_limits(missed, weight, rounding, _harmless_sizes(points), usual)
    everywhere = np.maximum(_SPIKE_SIGMAS * usual, rounding) * weight
    beyond_junctions = np.maximum(everywhere, _JUNCTION_MISS_MM + _JUNCTION_MISS_PER_MM * _mean_spacing(points) ** 2)
    over = np.abs(missed) / np.minimum(limit, beyond_junctions)
    for k in (int(i) for i in np.argsort(-over)[: np.count_nonzero(over > 1.0)]):
        size = abs(float(missed[k]))
        # a corner or a junction causes the misses next to it
        around = slice(max(k - 4, 0), k + 9)
        place = k - around.start
        rest, _ = missed_by_neighbours(np.delete(points[around], place + 2, axis=0))
        near = np.abs(rest[max(place - 2, 0) : place + 2])
        allowed = max(_REMAINDER_OF_LARGE * size, everywhere[k])
        large = size > beyond_junctions[k] and near.size > 0 and near.max() < allowed
        small = size > limit[k] and near.size == 4 and near.max() < min(_REMAINDER_OF_SMALL * size, limit[k])
        if (large and _is_outlier(points, k + 2)) or (small and _is_outlier(points, k + 2, bent=True)):
            return k + 2, float(missed[k])
    return None


def _mean_spacing(points: Floats) -> Floats:
    """Mean spacing of every five points (n, 2)."""
    return np.asarray(0.25 * np.hypot(*(points[4:] - points[:-4]).T))


def _harmless_sizes(points: Floats) -> Floats:
    return np.asarray(_HARMLESS_BEND_PER_MM / _SPIKE_BEND * _mean_spacing(points) ** 2)


def _compute_miss_limits(missed: Floats, weight: Floats, rounding: float, least: Floats, usual: Floats) -> Floats:
    """What a point may miss by for the scatter and the rounding of the points about it."""
    return np.asarray(
        np.maximum(
            np.maximum(_SPIKE_SIGMAS * _estimate_local_scatter(missed / weight, usual), rounding) * weight, least
        )
    )


def _estimate_local_scatter(missed: Floats, usual: Floats) -> Floats:
    """Standard deviation that points have by their misses (n,), at each: the usual one, or more that is about it."""
    n, reach = missed.size, _LOCAL_POINTS
    padded = np.concatenate((np.full(reach, np.nan), np.abs(missed), np.full(reach, np.nan)))
    windows = np.lib.stride_tricks.sliding_window_view(padded, reach - 2)
    # a spike makes its two neighbours on each side miss as well
    sides = [_LOCAL_WEIGHT * _compute_window_medians(windows[start : start + n]) for start in (0, reach + 3)]
    return np.asarray(np.fmax.reduce([usual, *(side / 0.6745 for side in sides)]))


def _compute_window_medians(windows: Floats) -> Floats:
    known = np.count_nonzero(np.isfinite(windows), axis=1) >= _FEWEST_LOCAL_POINTS
    out = np.full(len(windows), np.nan)
    out[known] = np.nanmedian(windows[known], axis=1)
    return out


def _estimate_resolution_mm(points: Floats) -> float:
    """The power of ten that the coordinates are rounded to, but for a few; 0 if to more than nine digits."""
    for digits in range(1, 10):
        rounded = np.abs(points - np.round(points, digits)) < 1e-10
        if rounded.mean() > _ROUNDED_SHARE:
            return float(10.0**-digits)
    return 0.0


def _is_outlier(points: Floats, k: int, *, bent: bool = False) -> bool:
    """Whether point k stands out of a line that goes on in its direction, or in its bend, as no corner does."""
    angles = compute_turning_angles(points[max(k - 3, 0) : k + 4])
    middle = k - max(k - 3, 0) - 1
    before, own, after = angles[middle - 1 : middle + 2]
    # what a spike does not touch says how the line itself bends
    others = [*angles[: middle - 1], *angles[middle + 2 :]]
    bend = float(np.mean(others)) if bent and others else 0.0
    return bool(abs(before + own + after - 3.0 * bend) < 0.5 * abs(own - bend))


def _compare_with_both_sides(points: Floats, rounding: float, least: Floats) -> tuple[Floats, Floats]:
    """How far each inner point lies off the line continued from its left or right, the less of both; and the limit."""
    (right, right_limit), (left, left_limit) = (
        (missed, _compute_miss_limits(missed, weight, rounding, least, estimate_scatter(points, missed / weight)))
        for missed, weight in (missed_by_neighbours(points, place) for place in (0, 4))
    )
    off, limit = np.zeros(right.size), np.full(right.size, np.inf)
    # the first of five points is compared with those on its right, the last with those on its left
    whole = slice(2, right.size - 2)
    off[whole] = np.where(np.abs(right[4:]) < np.abs(left[:-4]), right[4:], left[:-4])
    limit[whole] = np.maximum(right_limit[4:], left_limit[:-4])
    return off, limit


def _limit_two_junctions(points: Floats) -> Floats:
    """How far off two junctions close to one another may make a point seem; infinite where points are not even."""
    chord = np.hypot(*np.diff(points, axis=0).T)
    around = np.lib.stride_tricks.sliding_window_view(chord, 8)
    low, high = around.min(axis=1), around.max(axis=1)
    # a spike turns the line itself by twice its size over the spacing, at its place and half as much beside it
    turning = np.lib.stride_tricks.sliding_window_view(np.abs(compute_turning_angles(points)), 7)
    turning = np.maximum(0.35 * turning.max(axis=1), turning[:, [0, 1, 5, 6]].max(axis=1))
    out = np.full(len(points) - 4, np.inf)
    out[2:-2] = np.where(high < _EVEN_SPACING_RATIO * low, _TWO_JUNCTIONS_FACTOR * turning * high, np.inf)
    return out


# --- Profiles from measured or tabulated points.

# Angle between neighbouring chords that is a corner of the body and not a coarsely sampled fillet (rad, 20 degrees).
SPLIT_ANGLE_RAD = 0.35
# Root mean square of the curvature of a cubic spline through independent errors e at spacing h, in e / h^2: the
# transfer function 12 (1 - cos w) / (4 + 2 cos w) of the spline averaged over all waves.
SPLINE_NOISE = 6.0
FEWEST_POINTS = 10
# A spline through points with less noise in its curvature than this is as good as the points (1/mm): 1 % of R 300.
_CURVATURE_NOISE_PER_MM = 3e-5
# Spikes up to this are left out without being asked, in tables of exact points and in measured ones: the line misses
# nothing without them.
_TINY_SPIKE_MM = 0.002, 0.01
# The largest part of the points that a repair may leave out.
_LARGEST_OMITTED_SHARE = 0.05
_LARGEST_POINT_COUNT = 10_000
# A kink turns by so much, and by so many times as much as the points beside it.
_KINK_RAD, _KINK_RATIO = 0.01, 8.0
# Of a rail's head no more is looked at for its widest points; a side that turns in by less is a steep side.
_HEAD_DEPTH_MM, _LEAST_TURN_IN_MM = 45.0, 0.02
# Neighbours that differ by less are in no order: two points of a thousand differ by four of these. Where two scans of
# an instrument meet, points scatter by up to so much.
_NOISE_SIGMAS, _LARGEST_LOCAL_NOISE_MM = 8.0, 0.05
# Both shoulders of a head that is so wide are compared, so far beside its sides, which are looked for so deep below its
# top.
_WHOLE_HEAD_WIDTH_MM, _SHOULDER_OFFSET_MM, _SHOULDER_DEPTH_MM, _LEAST_SHOULDER_DEPTH_MM = 50.0, 8.0, 14.0, 4.0
# No rail reaches a chamfer beyond this place of a tread, which rises by 0.07; nor any wheel a side of a head so deep.
_TREAD_END_MM, _CHAMFER_RAD = 45.0, 0.35
_SIDE_DEPTH_MM, _SIDE_SLOPE_RAD = 16.0, 1.0
# Points nearer than this are one: far below any instrument, and far above what arithmetic loses in some 100 mm.
_REPEATED_POINT_MM = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Points:
    """Points along a running surface, before a line is made of them.

    Attributes
    ----------
    points (n, 2)
        y and z in mm, in the order along the line.
    kind, name, source
        Of the profile that is made of them.
    notes, problems
        What was assumed; points that were left out, and doubtful ones.
    flipped_columns
        What to ask the columns of the file to be so that the sign of z is turned.
    """

    points: Floats
    kind: Kind
    name: str
    source: str = ""
    notes: tuple[str, ...] = ()
    problems: tuple[Problem, ...] = ()
    flipped_columns: str = "1,-2"


def checked(given: Points, reading: Reading) -> Points:
    """Points of a running surface in the axes of the library, from small to large y.

    Raises
    ------
    InputError
        The points do not look like a running surface.
    """
    points, said, name = given.points, list(given.notes), given.name
    # also false for NaN
    bad = np.flatnonzero(~(np.abs(points) <= LARGEST_COORDINATE_MM).all(axis=1))
    if bad.size:
        raise InputError(
            f"{name}: point {bad[0] + 1} is {_format_point(points[bad[0]])}; allowed: -{LARGEST_COORDINATE_MM:g} to "
            f"{LARGEST_COORDINATE_MM:g} mm; "
            "remove it, or move the origin to the crown of the rail or the tape circle of the wheel"
        )

    points, repeated = _drop_repeated_points(points)
    if repeated:
        said.append(f"{format_count(repeated, 'repeated point')} dropped")
    if not FEWEST_POINTS <= len(points) <= _LARGEST_POINT_COUNT:
        raise InputError(
            f"{name}: there are {format_count(len(points), 'different point')}; at least {FEWEST_POINTS} are needed, "
            f"{_LARGEST_POINT_COUNT} are allowed, better one every 0.1 to 0.5 mm"
        )
    if points[-1, 0] < points[0, 0]:
        points = points[::-1]
        said.append("the points ran towards small y: their order was reversed")

    points, cut = _cut_turned_in_ends(points, given.kind)
    # a line that turns back has no shape to speak of
    points, problems, repaired = _remove_wrong_points(points, given, repair=reading.repair)
    check_shape(
        *points.T,
        kind=given.kind,
        what=name,
        flipped_columns=given.flipped_columns,
        unit=reading.units or "mm",
        is_mirrored=bool(reading.mirror),
    )
    points = points - (0.0, reading.tape_circle_z_mm or 0.0)
    said += [*cut, *repaired, *_check_spacing(points, given.kind, name)]
    said += [
        *_describe_assumptions(given.kind),
        *check_origin(points, given.kind, reading, name),
        *_describe_kinks(points),
    ]
    return replace(given, points=points, notes=tuple(said), problems=problems)


def spacing_mm(points: Floats) -> float:
    """The usual distance of neighbours among points (n, 2)."""
    return float(np.median(np.hypot(*np.diff(points, axis=0).T)))


def is_exact(points: Floats) -> bool:
    """Whether the noise of points (n, 2) does not show in the curvature of a spline through them."""
    return SPLINE_NOISE * noise_of(points) / spacing_mm(points) ** 2 < _CURVATURE_NOISE_PER_MM


def fit_splines(given: Points) -> Profile:
    """Cubic splines through points that were checked, between their corners."""
    points, corners, said = given.points, _find_corners(given.points), []
    if corners.size:
        where = ", ".join(f"{points[i, 0]:.2f}" for i in corners[:6]) + (" ..." if corners.size > 6 else "")
        said.append(f"split at {format_count(corners.size, 'corner')}: y = {where} mm")
    said.append(_describe_noise(points))
    pieces = np.split(np.arange(len(points)), corners)
    return build_profile(given, tuple(_make_segment(points[piece[0] : piece[-1] + 2]) for piece in pieces), said)


def build_profile(
    given: Points, segments: tuple[Segment, ...], said: Sequence[str], measured: Measured | None = None
) -> Profile:
    """The profile of a line that was made of points, with what is said of it."""
    return Profile(
        name=given.name,
        kind=given.kind,
        segments=segments,
        source=given.source,
        notes=(*given.notes, *said),
        measured=measured,
        points=given.points,
        problems=given.problems,
    )


def _find_corners(points: Floats) -> Integers:
    return np.flatnonzero(np.abs(compute_turning_angles(points)) > SPLIT_ANGLE_RAD) + 1


def _describe_kinks(points: Floats) -> list[str]:
    """Where a line turns, within two points, that does not turn beside them: no junction does so, a lost sign does."""
    turning = compute_turning_angles(points)
    if turning.size < 6:
        return []
    both = np.abs(turning[2:-3] + turning[3:-2])
    beside = np.max(np.abs([turning[:-5], turning[1:-4], turning[4:-1], turning[5:]]), axis=0)
    found = np.flatnonzero((both > _KINK_RAD) & (both < SPLIT_ANGLE_RAD) & (both > _KINK_RATIO * beside)) + 2
    # the sharper one of both, and each once
    places = dict.fromkeys(int(i) + int(abs(turning[i + 1]) > abs(turning[i])) for i in found)
    return [f"a kink at {_format_point(points[i + 1])}: a corner of the body, or a wrong sign" for i in places]


def _drop_repeated_points(points: Floats) -> tuple[Floats, int]:
    """Points (n, 2) without those that repeat the one before, and how many those are."""
    same = np.zeros(len(points), bool)
    same[1:] = np.hypot(*np.diff(points, axis=0).T) < _REPEATED_POINT_MM
    return points[~same], int(same.sum())


def drop_close_points(points: Floats, closest_mm: float) -> Floats:
    """Points (n, 2) without those that lie closer than this to the one before that is kept."""
    kept = points[:1].tolist()
    for point in points[1:]:
        if np.hypot(*(point - kept[-1])) >= closest_mm:
            kept.append(point)
    return np.array(kept)


def _cut_turned_in_ends(points: Floats, kind: Kind) -> tuple[Floats, list[str]]:
    """Points (n, 2) between the widest of both sides, where the line turns in behind them; and what was cut off.

    A wheel or a rail that comes from above or below touches nothing behind the widest point of the other.
    """
    y = _filter_single_points(points[:, 0])
    # a whole section has a foot that is wider than its head
    near = np.flatnonzero((points[:, 1] > points[:, 1].max() - _HEAD_DEPTH_MM) | (kind == "wheel"))
    low, high = (_find_widest(points[:, 0], int(near[np.argmin(side * y[near])]), side) for side in (1.0, -1.0))
    middle, turned_in = 0.5 * (y[low] + y[high]), max(_LEAST_TURN_IN_MM, _NOISE_SIGMAS * noise_of(points))
    first, last, said = 0, len(points) - 1, []
    if low < high and y[low] + turned_in < y[: low + 1].max() < middle:
        first = low
    if low < high and y[high] - turned_in > y[high:].min() > middle:
        last = high
    for at, off in ((first, first), (last, len(points) - 1 - last)):
        if off:
            said.append(
                f"the line turns in beyond its widest point {_format_point(points[at])}: "
                f"{format_count(off, 'point')} cut off"
            )
    return points[first : last + 1], said


def _find_widest(y: Floats, near: int, side: float) -> int:
    """Index of the least `side` times y a few points about one that is the least but for single points."""
    start = max(near - 3, 0)
    return start + int(np.argmin(side * y[start : near + 4]))


def _filter_single_points(values: Floats) -> Floats:
    """Values (n,) in which a point or two that stand out are levelled: the middle one of every five."""
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(np.pad(values, 2, "reflect"), 5), axis=1))


def _remove_wrong_points(
    points: Floats, given: Points, *, repair: bool
) -> tuple[Floats, tuple[Problem, ...], list[str]]:
    """The points without those that are wrong, where leaving out is asked for; those, and what is to be said."""
    left_out: list[Problem] = []
    tiny = _TINY_SPIKE_MM[0] if is_exact(points) else _TINY_SPIKE_MM[1]
    for find in (_find_disorder_beyond_noise, spikes, _find_crossings_beyond_noise):
        while problems := find(points):
            large = [one for one in problems if one.what != "spike" or abs(one.size_mm) > tiny]
            too_many = len(left_out) + len(problems) > _LARGEST_OMITTED_SHARE * len(points)
            if large and (too_many or not repair):
                raise InputError(_explain_refusal(large, given, repair=repair, too_many=too_many))
            if too_many:
                break
            # points out of order are found once more from their new neighbours
            gone = problems if find is spikes else problems[:1]
            left_out += gone
            # what stood between two equal points may be gone
            points, _ = _drop_repeated_points(np.delete(points, [problem.index for problem in gone], axis=0))
    said = _list_texts([problem.text for problem in left_out])
    notes = [f"{format_count(len(left_out), 'point')} left out: {said}"] if left_out else []
    if doubtful := unclear(points):
        notes.append(
            f"{_list_texts([problem.text for problem in doubtful])}: wrong, or at two junctions close to one another; a"
            " spline bends there"
        )
    back = np.diff(points[:, 0]) <= 0.0
    if back.any():
        notes.append(
            f"the line is vertical or overhangs at {format_count(int(back.sum()), 'point')}: kept as a steep side"
        )
    return points, (*left_out, *doubtful), notes


def _find_disorder_beyond_noise(points: Floats) -> list[Problem]:
    return out_of_order(points, _estimate_local_noise(points))


def _find_crossings_beyond_noise(points: Floats) -> list[Problem]:
    noise = _estimate_local_noise(points)
    return [one for one in crossings(points) if one.size_mm > noise[one.index]]


def _estimate_local_noise(points: Floats) -> Floats:
    """What each of n points may be moved by for the scatter of the points about it, in which there is no order."""
    missed, weight = missed_by_neighbours(points)
    usual = noise_of(points)
    if not missed.size:
        return np.zeros(len(points))
    local = np.clip(
        _estimate_local_scatter(missed / weight, np.full(missed.size, usual)),
        usual,
        max(usual, _LARGEST_LOCAL_NOISE_MM),
    )
    return _NOISE_SIGMAS * np.pad(local, 2, "edge")


def _explain_refusal(problems: list[Problem], given: Points, *, repair: bool, too_many: bool) -> str:
    said = f"{given.name}: {_list_texts([problem.text for problem in problems])}"
    if too_many:
        said += f"; that is more than {100 * _LARGEST_OMITTED_SHARE:g} % of the points"
        if not _find_disorder_beyond_noise(given.points[:, ::-1]):
            y, z = given.flipped_columns.replace("-", "").split(",")
            return f"{said}; the columns are y and z the other way round: {remedy(given.kind, 'columns', f'{z},{y}')}"
    mend = f", or {remedy(given.kind, 'repair', 'yes')} to leave such points out" * (not (repair or too_many))
    if problems[0].what == "spike":
        return f"{said}; {'correct the file' if mend else 'measure the profile again'}{mend}"
    return (
        f"{said}; give the points of the running surface in their order along the line, once, without the inside of the"
        f" body{mend}"
    )


def format_count(number: int, noun: str) -> str:
    """A number of things in words."""
    return f"{number} {noun}" + ("" if number == 1 else "s")


def _list_texts(texts: list[str]) -> str:
    return "; ".join(texts[:4]) + (f" and {len(texts) - 4} more" if len(texts) > 4 else "")


def _format_point(point: Floats) -> str:
    return f"({point[0]:.4g}, {point[1]:.4g}) mm"


def _check_spacing(points: Floats, kind: Kind, name: str) -> list[str]:
    chord = np.hypot(*np.diff(points, axis=0).T)
    # a face between two corners needs only its ends
    is_end = np.ones(len(points), dtype=bool)
    is_end[1:-1] = False
    is_end[_find_corners(points)] = True
    chord[is_end[:-1] & is_end[1:]] = 0.0
    typical = float(np.median(chord))
    most = max(2.0, 10.0 * typical)
    said = []
    for gap in np.flatnonzero((chord > most) & _is_out_of_reach(points, kind)):
        said.append(
            f"a gap of {chord[gap]:.2f} mm after {_format_point(points[gap])}, out of reach of a contact: a "
            "straight piece"
        )
        chord[gap] = 0.0
    i = int(chord.argmax())
    if chord[i] > most:
        raise InputError(
            f"{name}: a gap of {chord[i]:.2f} mm after {_format_point(points[i])}, where points are usually "
            f"{typical:.2g} mm "
            f"apart; allowed: {most:.3g} mm; add points there or cut the file at the gap"
        )
    if chord[i] > 2.0:
        said.append(
            f"points are up to {chord[i]:.2g} mm apart, at {_format_point(points[i])}: a smaller feature is not seen"
        )
    return said


def _is_out_of_reach(points: Floats, kind: Kind) -> NDArray[np.bool_]:
    """Whether chords of points (n, 2) lie where nothing touches: chamfers, sides of heads, backs of flanges."""
    (y, z), (dy, dz) = points.T, np.diff(points, axis=0).T
    steep = np.arctan2(np.abs(dz), np.abs(dy))
    if kind == "rail":
        deep = z < z.max() - _SIDE_DEPTH_MM
        return np.asarray(deep[:-1] & deep[1:] & (steep > _SIDE_SLOPE_RAD))
    behind = y <= y[np.argmin(z)]
    return np.asarray(((y[:-1] > _TREAD_END_MM) & (steep > _CHAMFER_RAD)) | (behind[:-1] & behind[1:]))


def _describe_assumptions(kind: Kind) -> list[str]:
    across = "y positive to the field side" + (" and 0 at the tape circle" if kind == "wheel" else "")
    canted = ", not canted" if kind == "rail" else ""
    return [f"taken as: mm, {across}, z up{canted}"]


# A new head that is canted outwards by 1:40 is so much lower beside its field side, and a little more.
LARGEST_FIELD_SIDE_DROP_MM = 1.0


def measure_field_side_drop_mm(points: Floats) -> float | None:
    """By how much points (n, 2) of a whole head lie lower beside its field side than beside its gauge side."""
    y, z = points.T
    # both sides of the head as deep below its top as both are there
    level = max(z.max() - _SHOULDER_DEPTH_MM, z[0], z[-1])
    above = y[z >= level]
    if np.ptp(above) < _WHOLE_HEAD_WIDTH_MM or level > z.max() - _LEAST_SHOULDER_DEPTH_MM:
        return None
    gauge, field = np.interp(
        (above[0] + _SHOULDER_OFFSET_MM, above[-1] - _SHOULDER_OFFSET_MM), np.maximum.accumulate(y), z
    )
    return float(gauge - field)


def _describe_noise(points: Floats) -> str:
    """Scatter of the points across the line, and the curvature error that a spline through them has from it."""
    scatter = noise_of(points)
    spacing = spacing_mm(points)
    noise = SPLINE_NOISE * scatter / spacing**2
    return (
        f"{len(points)} points about {spacing:.2g} mm apart, scatter about {scatter:.1g} mm: "
        f"curvature uncertain by about {noise:.1g} /mm (a radius of 300 mm has {1 / 300:.1g} /mm)"
    )


def _make_segment(points: Floats) -> Segment:
    if len(points) == 2:
        return Line(start=(float(points[0, 0]), float(points[0, 1])), end=(float(points[1, 0]), float(points[1, 1])))
    return Spline(points=points)
