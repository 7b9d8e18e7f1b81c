"""Single points that lie off their line: spikes of a measurement, and wrong digits in a table of exact points.

Each point is compared with the cubic through its neighbours, in units of what the points about it scatter: one of 0.001
mm stands out of a table of exact points, and none does of one that is rounded to 0.001 mm. A corner or a junction makes
points miss as well; what tells a spike is that nothing misses any more without it.
"""

from __future__ import annotations

import numpy as np

from fecontact.profiles.noise import missed_by_neighbours, scatter_of
from fecontact.profiles.problems import Problem, turning_angles
from fecontact.profiles.segments import Floats

# A spike lies off by so many times the scatter of its neighbours: beyond what noise does in some thousand points.
_SIGMAS = 7.0
# Where they scatter more than elsewhere, so many points on either side say how much. Few points do not know it well, so
# only this part of what they say counts.
_LOCAL_REACH, _FEWEST_LOCAL, _LOCAL_TRUST = 12, 4, 0.7
# Rounding makes a point miss by the step that coordinates are rounded to at most, in units of the weight of its guess.
_ROUNDING_STEPS, _ROUNDED_PART = 1.5, 0.9
# A spike of the size e among points a step h apart bends a spline by 4.4 e / h^2. One that bends it by less changes
# nothing: 3 % of R 300 mm.
_BEND, _LEAST_BEND_PER_MM = 4.4, 1e-4
# A junction from straight to R 10 mm misses by up to so much of the square of the spacing (1/mm).
_LEAST_MM, _JUNCTION_PER_MM = 0.003, 0.012
# Without a spike its neighbours miss less than this part of it: one that no junction can be, and a smaller one.
_LEFT_OF_LARGE, _LEFT_OF_SMALL = 0.35, 0.2
_MOST = 50
# Two junctions within four points look like a spike by this part of the square of the spacing times the curvature
# there; so do any where the spacing changes by more than this factor.
_TWO_JUNCTIONS, _EVEN = 0.75, 1.6


def spikes(points: Floats) -> list[Problem]:
    """Single points (n, 2) that lie off the line through their neighbours, the largest first."""
    found: list[Problem] = []
    left, index = points, np.arange(len(points))
    while len(found) < _MOST and (at := _largest_spike(left)) is not None:
        k, missed = at
        y, z = left[k]
        found.append(Problem(what="spike", index=int(index[k]), y_mm=float(y), z_mm=float(z), size_mm=missed))
        left, index = np.delete(left, k, axis=0), np.delete(index, k)
    return found


def unclear(points: Floats) -> list[Problem]:
    """Points (n, 2) beside a corner or a junction that may be spikes: off the lines on their left and on their right.

    A junction is on one side only; two junctions within a few points may look the same.
    """
    if len(points) < 2 * _LOCAL_REACH:
        return []
    rounding, least = _ROUNDING_STEPS * _resolution_mm(points), _least(points)
    off, limit = _from_either_side(points, rounding, least)
    limit = np.maximum(limit, _of_two_junctions(points))
    found = []
    for k in (int(i) for i in np.flatnonzero(np.abs(off) > limit)):
        rest, _ = _from_either_side(np.delete(points, k + 2, axis=0), rounding, np.delete(least, k))
        if np.abs(rest[max(k - 4, 0) : k + 4]).max() < min(_LEFT_OF_SMALL * abs(off[k]), limit[k]):
            y, z = points[k + 2]
            found.append(Problem(what="unclear", index=k + 2, y_mm=float(y), z_mm=float(z), size_mm=float(off[k])))
    return found


def _largest_spike(points: Floats) -> tuple[int, float] | None:
    """Index of the point (n, 2) that stands out most among its neighbours, and by how much; None if none does."""
    missed, weight = missed_by_neighbours(points)
    if missed.size < _FEWEST_LOCAL + 1:
        return None
    rounding = _ROUNDING_STEPS * _resolution_mm(points)
    usual = scatter_of(points, missed / weight)
    limit = _limit(missed, weight, rounding, _least(points), usual)
    everywhere = np.maximum(_SIGMAS * usual, rounding) * weight
    beyond_junctions = np.maximum(everywhere, _LEAST_MM + _JUNCTION_PER_MM * _step(points) ** 2)
    over = np.abs(missed) / np.minimum(limit, beyond_junctions)
    for k in (int(i) for i in np.argsort(-over)[: np.count_nonzero(over > 1.0)]):
        size = abs(float(missed[k]))
        # the misses next to a corner or a junction are those of its own
        around = slice(max(k - 4, 0), k + 9)
        place = k - around.start
        rest, _ = missed_by_neighbours(np.delete(points[around], place + 2, axis=0))
        near = np.abs(rest[max(place - 2, 0) : place + 2])
        allowed = max(_LEFT_OF_LARGE * size, everywhere[k])
        large = size > beyond_junctions[k] and near.size > 0 and near.max() < allowed
        small = size > limit[k] and near.size == 4 and near.max() < min(_LEFT_OF_SMALL * size, limit[k])
        if (large and _stands_out(points, k + 2)) or (small and _stands_out(points, k + 2, bent=True)):
            return k + 2, float(missed[k])
    return None


def _step(points: Floats) -> Floats:
    """Mean spacing of every five points (n, 2)."""
    return np.asarray(0.25 * np.hypot(*(points[4:] - points[:-4]).T))


def _least(points: Floats) -> Floats:
    return np.asarray(_LEAST_BEND_PER_MM / _BEND * _step(points) ** 2)


def _limit(missed: Floats, weight: Floats, rounding: float, least: Floats, usual: Floats) -> Floats:
    """What a point may miss by for the scatter and the rounding of the points about it."""
    return np.asarray(np.maximum(np.maximum(_SIGMAS * _scatter(missed / weight, usual), rounding) * weight, least))


def _scatter(missed: Floats, usual: Floats) -> Floats:
    """Standard deviation that points have by their misses (n,), at each: the usual one, or more that is about it."""
    n, reach = missed.size, _LOCAL_REACH
    padded = np.concatenate((np.full(reach, np.nan), np.abs(missed), np.full(reach, np.nan)))
    windows = np.lib.stride_tricks.sliding_window_view(padded, reach - 2)
    # a spike makes its two neighbours on each side miss as well
    sides = [_LOCAL_TRUST * _median(windows[start : start + n]) for start in (0, reach + 3)]
    return np.asarray(np.fmax.reduce([usual, *(side / 0.6745 for side in sides)]))


def _median(windows: Floats) -> Floats:
    known = np.count_nonzero(np.isfinite(windows), axis=1) >= _FEWEST_LOCAL
    out = np.full(len(windows), np.nan)
    out[known] = np.nanmedian(windows[known], axis=1)
    return out


def _resolution_mm(points: Floats) -> float:
    """The power of ten that the coordinates are rounded to, but for a few; 0 if to more than nine digits."""
    for digits in range(1, 10):
        rounded = np.abs(points - np.round(points, digits)) < 1e-10
        if rounded.mean() > _ROUNDED_PART:
            return float(10.0**-digits)
    return 0.0


def _stands_out(points: Floats, k: int, *, bent: bool = False) -> bool:
    """Whether point k stands out of a line that goes on in its direction, or in its bend, as no corner does."""
    angles = turning_angles(points[max(k - 3, 0) : k + 4])
    middle = k - max(k - 3, 0) - 1
    before, own, after = angles[middle - 1 : middle + 2]
    # what a spike does not touch says how the line itself bends
    others = [*angles[: middle - 1], *angles[middle + 2 :]]
    bend = float(np.mean(others)) if bent and others else 0.0
    return bool(abs(before + own + after - 3.0 * bend) < 0.5 * abs(own - bend))


def _from_either_side(points: Floats, rounding: float, least: Floats) -> tuple[Floats, Floats]:
    """How far each inner point lies off the line continued from its left or right, the less of both; and the limit."""
    (right, right_limit), (left, left_limit) = (
        (missed, _limit(missed, weight, rounding, least, scatter_of(points, missed / weight)))
        for missed, weight in (missed_by_neighbours(points, place) for place in (0, 4))
    )
    off, limit = np.zeros(right.size), np.full(right.size, np.inf)
    # the first of five points is compared with those on its right, the last with those on its left
    whole = slice(2, right.size - 2)
    off[whole] = np.where(np.abs(right[4:]) < np.abs(left[:-4]), right[4:], left[:-4])
    limit[whole] = np.maximum(right_limit[4:], left_limit[:-4])
    return off, limit


def _of_two_junctions(points: Floats) -> Floats:
    """How far off two junctions close to one another may make a point seem; infinite where points are not even."""
    chord = np.hypot(*np.diff(points, axis=0).T)
    around = np.lib.stride_tricks.sliding_window_view(chord, 8)
    low, high = around.min(axis=1), around.max(axis=1)
    # a spike turns the line itself by twice its size over the spacing, at its place and half as much beside it
    turning = np.lib.stride_tricks.sliding_window_view(np.abs(turning_angles(points)), 7)
    turning = np.maximum(0.35 * turning.max(axis=1), turning[:, [0, 1, 5, 6]].max(axis=1))
    out = np.full(len(points) - 4, np.inf)
    out[2:-2] = np.where(high < _EVEN * low, _TWO_JUNCTIONS * turning * high, np.inf)
    return out
