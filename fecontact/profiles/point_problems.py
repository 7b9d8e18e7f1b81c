"""Problems of measured points, each with its place: spikes, wrong order, self-crossing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fecontact.arrays import Floats

What = Literal["spike", "unclear", "out of order", "crosses itself"]

# A step back in y is the side of the body, not a fold of the line, if it is this much steeper than wide.
OVERHANG_SLOPE = 5.0
_TURNED_RAD = 2.0
_DENT_MM = 0.5


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Something that is wrong with a point.

    Attributes
    ----------
    index
        Of the point, from 0.
    y_mm, z_mm
        Its place.
    size_mm
        How large it is.
    """

    what: What
    index: int
    y_mm: float
    z_mm: float
    size_mm: float

    @classmethod
    def at(cls, what: What, index: int, point: Floats, size_mm: float) -> Problem:
        """Of a point (2,)."""
        return cls(what=what, index=index, y_mm=float(point[0]), z_mm=float(point[1]), size_mm=size_mm)

    @property
    def text(self) -> str:
        """In words."""
        at = f"point {self.index + 1}, ({self.y_mm:.4g}, {self.z_mm:.4g}) mm"
        if self.what == "spike":
            return f"a spike of {abs(self.size_mm):.2g} mm at {at}"
        if self.what == "unclear":
            return f"{at} is {abs(self.size_mm):.2g} mm off the lines on either side of it"
        if self.what == "out of order":
            return f"the line turns back at {at}"
        return f"the line crosses itself at {at}"


def turning_angles(points: Floats) -> Floats:
    """Angle (rad) between the chords before and after each inner point."""
    d = np.diff(points, axis=0)
    return np.asarray(np.arctan2(d[:-1, 0] * d[1:, 1] - d[:-1, 1] * d[1:, 0], (d[:-1] * d[1:]).sum(axis=1)))


def out_of_order(points: Floats, noise_mm: Floats) -> list[Problem]:
    """Points (n, 2) at which the line turns back, by more than the noise (n,) there does; the farthest back first."""
    step = np.diff(points, axis=0)
    back = step[:, 0] <= -np.maximum(noise_mm[:-1], noise_mm[1:])
    back &= np.abs(step[:, 1]) < OVERHANG_SLOPE * np.abs(step[:, 0])
    # a dent in a steep side leads back by less
    behind = np.maximum.accumulate(points[:, 0]) - points[:, 0]
    folded = np.flatnonzero(back & (behind[1:] > _DENT_MM))
    chord = np.hypot(*step.T)
    sharp = np.abs(turning_angles(points))
    turned = np.flatnonzero((sharp > _TURNED_RAD) & (np.minimum(chord[:-1], chord[1:]) > noise_mm[1:-1])) + 1
    # of both ends of a fold the one that the line turns at more is the wrong one, from whichever side one comes
    at = np.pad(sharp, 1)
    wrong = np.where(at[folded] >= at[folded + 1], folded, folded + 1)
    sizes = dict(
        sorted(zip([*wrong, *turned], [*chord[folded], *np.minimum(chord[:-1], chord[1:])[turned - 1]], strict=True))
    )
    return [
        Problem.at("out of order", int(i), points[i], float(sizes[i])) for i in sorted(sizes, key=lambda i: -sizes[i])
    ]


def crossings(points: Floats) -> list[Problem]:
    """Where the line through points (n, 2) crosses itself; a line that never turns back does not."""
    if np.all(np.diff(points[:, 0]) > 0.0):
        return []
    a, b = points[:-1], points[1:]
    d = b - a
    found = []
    # the least y of all that comes from the second point after a chord on
    later = np.minimum.accumulate(points[::-1, 0])[::-1][2:]
    for i in np.flatnonzero(later[: len(a) - 2] < np.maximum(a[:-2, 0], b[:-2, 0])):
        c, e = a[i + 2 :], d[i + 2 :]
        cross = d[i, 0] * e[:, 1] - d[i, 1] * e[:, 0]
        off = c - a[i]
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            t = (off[:, 0] * e[:, 1] - off[:, 1] * e[:, 0]) / cross
            u = (off[:, 0] * d[i, 1] - off[:, 1] * d[i, 0]) / cross
        if np.any((t > 0.0) & (t < 1.0) & (u > 0.0) & (u < 1.0)):
            found.append(Problem.at("crosses itself", int(i), a[i], float(np.hypot(*d[i]))))
    return found
