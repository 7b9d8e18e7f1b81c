"""Noise of points: the distance of each point from the curve through its neighbours."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats

# From this number of points on, the standard deviation has an error of at most a third.
_FEWEST_FOR_SCATTER = 60
# Steps of rounding (mm), the largest first, in mm and in inches. Numbers have errors of 1e-13; the tolerance allows for
# conversions.
_ROUNDING_STEPS_MM = sorted(
    {float(f"{digit}e{power}") for digit in (1, 2, 2.5, 5) for power in (-2, -3, -4)}
    | {0.1}
    | {25.4 * 10.0**power for power in (-3, -4, -5)},
    reverse=True,
)
_ROUNDING_ERROR_MM, _ROUNDED_SHARE = 1e-7, 0.9
# Scatter on the running part (root mean square) divided by the standard deviation of rounding. Without more noise it
# is 0.93 to 1.15 (five measured profiles, and 60E1 and S1002 with a point every 0.1 to 0.5 mm). Normal noise of 0.3 of
# the step makes it 1.32 or more. Distances beyond the second number are corners and dents.
_ROUNDED_SCATTER_RATIO, _OUTLIER_RATIO = 1.25, 3.5


def estimate_noise_mm(points: Floats) -> float:
    """Largest standard deviation of points across their profile.

    Parameters
    ----------
    points
        Points (n, 2) in mm, in the order along the profile.

    Returns
    -------
    float
        Standard deviation (mm), from the distance of each point to the cubic through its four neighbours.
    """
    distances, weight = compare_with_neighbours(points)
    return float(estimate_scatter(points, distances / weight).max()) if distances.size else 0.0


def estimate_scatter(points: Floats, distances: Floats) -> Floats:
    """Estimate the standard deviation of points across their profile.

    An instrument may have errors in the height alone, or in the lateral position alone. So flat and steep points are
    evaluated separately, and points between them have a combination of both standard deviations.

    Parameters
    ----------
    points
        Points (n, 2) in mm, in the order along the profile.
    distances
        Distances (n - 4,) of the inner points from the cubic through their neighbours (mm).

    Returns
    -------
    ndarray
        Standard deviations (n - 4,) of the inner points (mm).
    """
    along = points[4:] - points[:-4]
    is_steep = np.abs(along[:, 1]) > np.abs(along[:, 0])
    masks = (~is_steep, is_steep)
    if any(np.count_nonzero(mask) < _FEWEST_FOR_SCATTER for mask in masks):
        return np.full(distances.size, _estimate_robust_deviation(distances))
    flat_scatter, side_scatter = (_estimate_robust_deviation(distances[mask]) for mask in masks)
    scatter = np.hypot(flat_scatter * along[:, 0], side_scatter * along[:, 1])
    return np.asarray(scatter / np.maximum(np.hypot(*along.T), 1e-12))


def _estimate_robust_deviation(distances: Floats) -> float:
    # the median ignores corners, junctions and spikes; division by 0.6745 makes it a standard deviation
    return float(np.median(np.abs(distances))) / 0.6745


def compare_with_neighbours(points: Floats, place: Literal[0, 2, 4] = 2) -> tuple[Floats, Floats]:
    """Distances of points from the cubic through their four neighbours, with their error factors.

    Parameters
    ----------
    points : ndarray of shape (n, 2)
        Points in mm, in the order along the profile.
    place
        Index of the tested point among each five: the middle one, the first or the last. The first and the last are
        compared with the extrapolated curve from one side.

    Returns
    -------
    distances (n - 4,)
        Distances across the profile, positive to the left (mm).
    weight (n - 4,)
        Standard deviations of the distances if each point has a standard deviation of 1.
    """
    if len(points) < 5:
        return np.zeros(0), np.ones(0)
    five = [points[k : len(points) - 4 + k] for k in range(5)]
    chords = [np.hypot(*(q - p).T) for p, q in pairwise(five)]
    s = np.cumsum([np.zeros(len(five[0])), *chords], axis=0)
    target, neighbours = s[place], [k for k in range(5) if k != place]

    def apart(k: int, m: int) -> Floats:
        # two equal points have no distance
        return np.where(np.abs(s[k] - s[m]) < 1e-12, 1e-12, s[k] - s[m])

    weights = [np.prod([(target - s[m]) / apart(k, m) for m in neighbours if m != k], axis=0) for k in neighbours]
    guess = sum(weight[:, None] * five[k] for weight, k in zip(weights, neighbours, strict=True))
    along = five[min(place + 1, 4)] - five[max(place - 1, 0)]
    along = along / np.maximum(np.hypot(*along.T), 1e-12)[:, None]
    deviation = five[place] - guess
    return deviation[:, 1] * along[:, 0] - deviation[:, 0] * along[:, 1], np.sqrt(
        1.0 + sum(weight**2 for weight in weights)
    )


def estimate_rounding_step_mm(points: Floats) -> float:
    """Step to which the coordinates of points are rounded.

    Only differences of coordinates count, so that points that were shifted or mirrored after their rounding have the
    same step. Points that were turned have no step.

    Parameters
    ----------
    points
        Points (n, 2) in mm.

    Returns
    -------
    float
        Step (mm): 1, 2, 2.5 or 5 times a power of ten in mm, or a power of ten in inches; 0 without a step of at least
        0.0001 mm.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.profiles.point_noise import estimate_rounding_step_mm
    >>> y = np.arange(0.0, 20.0, 0.25)
    >>> estimate_rounding_step_mm(np.column_stack((y, np.round(-(y**2) / 600.0, 2))))
    0.01
    """
    differences = np.diff(points, axis=0)
    for step in _ROUNDING_STEPS_MM:
        rests = np.abs(differences - step * np.round(differences / step))
        # ends of cuts and of filled gaps are not rounded
        if (rests < _ROUNDING_ERROR_MM).all(axis=1).mean() > _ROUNDED_SHARE:
            return step
    return 0.0


def find_rounding_noise_mm(points: Floats, is_running: NDArray[np.bool_]) -> float:
    """Standard deviation of the noise of points that rounding alone causes.

    The errors of points that are rounded to a step are distributed evenly over the step: their standard deviation is
    the step divided by the square root of 12, across the profile too. The estimate from the scatter is worse: in a flat
    part the errors of neighbours depend on each other, and the estimate is 0.9 to 2.5 times the true value.

    Parameters
    ----------
    points
        Points (n, 2) in mm, in the order along the profile.
    is_running
        Whether each point (n,) is on the running part of the profile.

    Returns
    -------
    float
        Standard deviation (mm); 0 if the points are not rounded, or scatter by more than rounding.
    """
    rounding_mm = estimate_rounding_step_mm(points) / math.sqrt(12.0)
    distances, weight = compare_with_neighbours(points)
    scatter = (distances / weight)[is_running[2:-2]]
    if rounding_mm == 0.0 or not scatter.size:
        return 0.0
    largest = _OUTLIER_RATIO * rounding_mm
    usual = math.sqrt(float(np.mean(np.clip(scatter, -largest, largest) ** 2)))
    return rounding_mm if usual <= _ROUNDED_SCATTER_RATIO * rounding_mm else 0.0
