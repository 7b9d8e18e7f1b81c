"""Cubic smoothing splines with a stated filter length."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from fecontact.arrays import Floats

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


#
# Reinsch (1967), smoothing by spline functions; in the form of Green and Silverman (1994), nonparametric regression and
# generalized linear models, section 2.3. scipy's `make_smoothing_spline` is an equal spline in a different basis. It
# takes 15 times as long, and its equations lose digits: over waves of 500 mm its error is 0.0002 mm.

# Weight of a displacement along the profile relative to a displacement across it. It is so small that the displacement
# along the profile is free.
_ALONG_WEIGHT = 1e-5


def fit_smoothing_spline(s_mm: Floats, values: Floats, filter_mm: float, relative: Floats | None = None) -> PPoly:
    """Cubic smoothing spline that halves a wave of a given length.

    The length does not depend on the spacing of the points.

    It minimises the sum of the squared distances from the points, each times the local spacing, plus (filter / 2 pi)^4
    times the integral of the squared second derivative.

    Parameters
    ----------
    s_mm, values : ndarrays of shapes (n,), (n, k)
        Arc lengths, ascending (mm), and the values that are smoothed.
    filter_mm
        Filter length (mm).
    relative : ndarray of shape (n,) or None
        Filter length at each point divided by `filter_mm`; None for a constant length.

    Returns
    -------
    PPoly
        Spline over the arc length, with values (k,).

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.profiles.smoothing_splines import fit_smoothing_spline
    >>> s = np.arange(0.0, 401.0, 0.5)
    >>> wave = np.sin(2.0 * np.pi * s / 8.0)[:, None]
    >>> round(float(fit_smoothing_spline(s, wave, 8.0)(202.0)[0]), 2)
    0.5
    """
    from scipy.interpolate import PPoly
    from scipy.linalg import solveh_banded

    h = np.diff(s_mm)
    length = filter_mm if relative is None else filter_mm * relative
    # the filter length is proportional to the fourth root of the penalty at a point
    penalty = (length / (2.0 * math.pi)) ** 4 / (0.5 * (np.append(h, 0.0) + np.insert(h, 0, 0.0)))
    # second differences: row j has the points j, j + 1, j + 2
    second = np.array([1.0 / h[:-1], -1.0 / h[:-1] - 1.0 / h[1:], 1.0 / h[1:]])
    rows = s_mm.size - 2
    lower = np.zeros((3, rows))
    lower[0], lower[1, :-1] = (h[:-1] + h[1:]) / 3.0, h[1:-1] / 6.0
    for k in range(3):
        for i in range(3 - k):
            lower[k, : rows - k] += second[i + k, : rows - k] * second[i, k:] * penalty[i + k : i + rows]
    second_derivatives = np.zeros_like(values)
    second_derivatives[1:-1] = solveh_banded(lower, np.diff(np.diff(values, axis=0) / h[:, None], axis=0), lower=True)

    # from values and second derivatives at the points to the four coefficients of each piece
    jumps = np.diff(np.pad(np.diff(second_derivatives, axis=0) / h[:, None], ((1, 1), (0, 0))), axis=0)
    fitted, h = values - penalty[:, None] * jumps, h[:, None]
    slope = np.diff(fitted, axis=0) / h - h * (2.0 * second_derivatives[:-1] + second_derivatives[1:]) / 6.0
    return PPoly(
        np.array([np.diff(second_derivatives, axis=0) / (6.0 * h), second_derivatives[:-1] / 2.0, slope, fitted[:-1]]),
        s_mm,
    )


def minimise_bending(s_mm: Floats, values: Floats, normals: Floats, width_mm: float) -> Floats:
    """Displacements with the least bending that match the points across the profile.

    They agree with `fit_smoothing_spline`, but displacements along the profile have only a small weight. Second
    differences replace the spline: they are accurate enough for the positions of points, and need one banded solution.

    Parameters
    ----------
    s_mm
        Arc lengths (n,), ascending (mm).
    values
        Displacements (n, 2) of the points (mm).
    normals
        Normals (n, 2) of the profile.
    width_mm
        Filter length (mm).

    Returns
    -------
    ndarray
        Displacements (n, 2) in mm.
    """
    from scipy.linalg import solveh_banded

    n, h = s_mm.size, np.diff(s_mm)
    penalty = (width_mm / (2.0 * math.pi)) ** 4 * (n - 1) / (s_mm[-1] - s_mm[0])
    between = 0.5 * (h[:-1] + h[1:])
    second = np.array([1.0 / h[:-1], -1.0 / h[:-1] - 1.0 / h[1:], 1.0 / h[1:]]) / between
    upper = np.zeros((5, 2 * n))
    for k in range(3):
        for i in range(3 - k):
            # entries for the points j + i and j + i + k, for both coordinates
            entries = penalty * between * second[i] * second[i + k]
            for axis in range(2):
                upper[4 - 2 * k, 2 * (i + k) + axis : 2 * (n - 2 + i + k) + axis : 2] += entries
    across = normals[:, :, None] * normals[:, None, :] * (1.0 - _ALONG_WEIGHT) + _ALONG_WEIGHT * np.eye(2)
    upper[4] += across[:, (0, 1), (0, 1)].ravel()
    upper[3, 1::2] += across[:, 0, 1]
    right = np.einsum("nij,nj->ni", across, values).ravel()
    return np.asarray(solveh_banded(upper, right).reshape(n, 2))
