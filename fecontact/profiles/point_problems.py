"""Problems of measured points with their positions: spikes, wrong order, self-crossing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fecontact.arrays import Floats

ProblemType = Literal["spike", "unclear", "out of order", "crosses itself"]

# A step back in y belongs to the side of the body, and is not a fold of the profile, if its height is at least this
# multiple of its width.
OVERHANG_SLOPE = 5.0
_REVERSAL_RAD = 2.0
_LARGEST_DENT_MM = 0.5


@dataclass(frozen=True, kw_only=True)
class PointProblem:
    """Problem of a measured point.

    Attributes
    ----------
    what
        Type of the problem.
    index
        Index of the point, from 0.
    y_mm, z_mm
        Position of the point (mm).
    size_mm
        Size of the problem (mm).
    """

    what: ProblemType
    index: int
    y_mm: float
    z_mm: float
    size_mm: float

    @classmethod
    def make_at(cls, what: ProblemType, index: int, point: Floats, size_mm: float) -> PointProblem:
        """Make the problem of a point (2,) in mm."""
        return cls(what=what, index=index, y_mm=float(point[0]), z_mm=float(point[1]), size_mm=size_mm)

    @property
    def text(self) -> str:
        """Description of the problem, with the number of the point from 1."""
        at = f"point {self.index + 1}, ({self.y_mm:.4g}, {self.z_mm:.4g}) mm"
        if self.what == "spike":
            return f"a spike of {abs(self.size_mm):.2g} mm at {at}"
        if self.what == "unclear":
            return f"{at} is {abs(self.size_mm):.2g} mm off the profile on both of its sides"
        if self.what == "out of order":
            return f"the profile turns back at {at}"
        return f"the profile crosses itself at {at}"


def compute_turning_angles(points: Floats) -> Floats:
    """Compute the angles (rad) between the chords before and after each inner point.

    Parameters
    ----------
    points : ndarray of shape (n, 2)
        Points in mm.

    Returns
    -------
    ndarray of shape (n - 2,)
        Signed angle in rad, positive for a turn to the left.
    """
    d = np.diff(points, axis=0)
    return np.asarray(np.arctan2(d[:-1, 0] * d[1:, 1] - d[:-1, 1] * d[1:, 0], (d[:-1] * d[1:]).sum(axis=1)))


def find_disorder(points: Floats, noise_mm: Floats) -> list[PointProblem]:
    """Points at which the profile turns back by more than the noise.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    noise_mm
        Noise (n,) at the points (mm).

    Returns
    -------
    list of PointProblem
        Problems, the largest first.
    """
    step = np.diff(points, axis=0)
    back = step[:, 0] <= -np.maximum(noise_mm[:-1], noise_mm[1:])
    back &= np.abs(step[:, 1]) < OVERHANG_SLOPE * np.abs(step[:, 0])
    # a dent in a steep side is a smaller step back
    behind = np.maximum.accumulate(points[:, 0]) - points[:, 0]
    folded = np.flatnonzero(back & (behind[1:] > _LARGEST_DENT_MM))
    chord = np.hypot(*step.T)
    sharp = np.abs(compute_turning_angles(points))
    reversals = np.flatnonzero((sharp > _REVERSAL_RAD) & (np.minimum(chord[:-1], chord[1:]) > noise_mm[1:-1])) + 1
    # a fold has two ends; the wrong point is the end at which the profile turns more, in either direction of travel
    sharpness = np.pad(sharp, 1)
    wrong = np.where(sharpness[folded] >= sharpness[folded + 1], folded, folded + 1)
    sizes = dict(
        sorted(
            zip([*wrong, *reversals], [*chord[folded], *np.minimum(chord[:-1], chord[1:])[reversals - 1]], strict=True)
        )
    )
    return [
        PointProblem.make_at("out of order", int(i), points[i], float(sizes[i]))
        for i in sorted(sizes, key=lambda i: -sizes[i])
    ]


def find_crossings(points: Floats) -> list[PointProblem]:
    """Points at which the profile crosses itself.

    Parameters
    ----------
    points
        Points (n, 2) in mm, in the order along the profile.

    Returns
    -------
    list of PointProblem
        Problems at the first point of a crossing chord; empty if the profile never turns back.
    """
    if np.all(np.diff(points[:, 0]) > 0.0):
        return []
    a, b = points[:-1], points[1:]
    d = b - a
    problems = []
    # the least y of all points from the second point after a chord
    least_later_y = np.minimum.accumulate(points[::-1, 0])[::-1][2:]
    for i in np.flatnonzero(least_later_y[: len(a) - 2] < np.maximum(a[:-2, 0], b[:-2, 0])):
        c, e = a[i + 2 :], d[i + 2 :]
        cross = d[i, 0] * e[:, 1] - d[i, 1] * e[:, 0]
        offset = c - a[i]
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            t = (offset[:, 0] * e[:, 1] - offset[:, 1] * e[:, 0]) / cross
            u = (offset[:, 0] * d[i, 1] - offset[:, 1] * d[i, 0]) / cross
        if np.any((t > 0.0) & (t < 1.0) & (u > 0.0) & (u < 1.0)):
            problems.append(PointProblem.make_at("crosses itself", int(i), a[i], float(np.hypot(*d[i]))))
    return problems
