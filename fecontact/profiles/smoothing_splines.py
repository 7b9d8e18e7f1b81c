"""Cubic smoothing splines of a stated width."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from fecontact.arrays import Floats

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


#
# Reinsch (1967), smoothing by spline functions; in the form of Green and Silverman (1994), nonparametric regression and
# generalized linear models, section 2.3. scipy's `make_smoothing_spline` is the same spline in another basis: it takes
# 15 times as long, and its equations lose so many digits that over waves of 500 mm it lies 0.0002 mm off.

# How much a displacement along the line counts beside one across it: so little that it is free.
_ALONG_WEIGHT = 1e-5


def smoothed_by(s_mm: Floats, values: Floats, filter_mm: float, relative: Floats | None = None) -> PPoly:
    """Cubic smoothing spline that leaves half of a wave of this length, however far apart the points are.

    It makes the sum of the squared distances from the points, each times the spacing there, plus (filter / 2 pi)^4
    times the integral of its squared second derivative the least.

    Parameters
    ----------
    s_mm (n,), values (n, k)
        Places along the line, ascending, and what is smoothed there.
    relative (n,)
        Filter length at each place over `filter_mm`; constant if not given.
    """
    from scipy.interpolate import PPoly
    from scipy.linalg import solveh_banded

    h = np.diff(s_mm)
    length = filter_mm if relative is None else filter_mm * relative
    # a spline is stiffer or softer with the fourth root of the penalty at a point
    penalty = (length / (2.0 * math.pi)) ** 4 / (0.5 * (np.append(h, 0.0) + np.insert(h, 0, 0.0)))
    # second differences: row j is of the points j, j + 1, j + 2
    second = np.array([1.0 / h[:-1], -1.0 / h[:-1] - 1.0 / h[1:], 1.0 / h[1:]])
    rows = s_mm.size - 2
    lower = np.zeros((3, rows))
    lower[0], lower[1, :-1] = (h[:-1] + h[1:]) / 3.0, h[1:-1] / 6.0
    for k in range(3):
        for i in range(3 - k):
            lower[k, : rows - k] += second[i + k, : rows - k] * second[i, k:] * penalty[i + k : i + rows]
    bent = np.zeros_like(values)
    bent[1:-1] = solveh_banded(lower, np.diff(np.diff(values, axis=0) / h[:, None], axis=0), lower=True)

    # from values and second derivatives at the points to the four coefficients of each piece
    jumps = np.diff(np.pad(np.diff(bent, axis=0) / h[:, None], ((1, 1), (0, 0))), axis=0)
    fitted, h = values - penalty[:, None] * jumps, h[:, None]
    slope = np.diff(fitted, axis=0) / h - h * (2.0 * bent[:-1] + bent[1:]) / 6.0
    return PPoly(np.array([np.diff(bent, axis=0) / (6.0 * h), bent[:-1] / 2.0, slope, fitted[:-1]]), s_mm)


def least_bending(s_mm: Floats, values: Floats, normals: Floats, width_mm: float) -> Floats:
    """Displacements (n, 2) as `smoothed_by` has them, where only what is across the line counts, to a small part.

    Second differences in place of the spline: enough to say where points belong, and one banded solution.
    """
    from scipy.linalg import solveh_banded

    n, h = s_mm.size, np.diff(s_mm)
    penalty = (width_mm / (2.0 * math.pi)) ** 4 * (n - 1) / (s_mm[-1] - s_mm[0])
    between = 0.5 * (h[:-1] + h[1:])
    second = np.array([1.0 / h[:-1], -1.0 / h[:-1] - 1.0 / h[1:], 1.0 / h[1:]]) / between
    upper = np.zeros((5, 2 * n))
    for k in range(3):
        for i in range(3 - k):
            # of the points j + i and j + i + k, for both of their coordinates
            entries = penalty * between * second[i] * second[i + k]
            for axis in range(2):
                upper[4 - 2 * k, 2 * (i + k) + axis : 2 * (n - 2 + i + k) + axis : 2] += entries
    across = normals[:, :, None] * normals[:, None, :] * (1.0 - _ALONG_WEIGHT) + _ALONG_WEIGHT * np.eye(2)
    upper[4] += across[:, (0, 1), (0, 1)].ravel()
    upper[3, 1::2] += across[:, 0, 1]
    right = np.einsum("nij,nj->ni", across, values).ravel()
    return np.asarray(solveh_banded(upper, right).reshape(n, 2))
