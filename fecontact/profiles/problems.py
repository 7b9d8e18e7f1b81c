"""What is wrong with measured points, each with its place: out of order, crossing themselves; `spikes` has the rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fecontact.profiles.noise import noise_of
from fecontact.profiles.segments import Floats

What = Literal["spike", "unclear", "out of order", "crosses itself"]

# A step back in y is the side of the body, not a fold of the line, if it is this much steeper than wide.
OVERHANG_SLOPE = 5.0
_TURNED_RAD = 2.0
# Neighbours that differ by less are in no order: two points of a thousand differ by four of these.
_NOISE_SIGMAS = 8.0


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


def out_of_order(points: Floats) -> list[Problem]:
    """Points (n, 2) at which the line turns back, by more than the noise of a steep side does."""
    step = np.diff(points, axis=0)
    noise = _NOISE_SIGMAS * noise_of(points)
    back = step[:, 0] <= -noise
    folded = np.flatnonzero(back & (np.abs(step[:, 1]) < OVERHANG_SLOPE * np.abs(step[:, 0])))
    chord = np.hypot(*step.T)
    turned = (
        np.flatnonzero((np.abs(turning_angles(points)) > _TURNED_RAD) & (np.minimum(chord[:-1], chord[1:]) > noise)) + 1
    )
    return [
        Problem(
            what="out of order",
            index=int(i),
            y_mm=float(points[i, 0]),
            z_mm=float(points[i, 1]),
            size_mm=float(np.hypot(*step[min(i, len(step) - 1)])),
        )
        for i in dict.fromkeys((*folded, *turned))
    ]


def crossings(points: Floats) -> list[Problem]:
    """Where the line through points (n, 2) crosses itself; a line that never turns back does not."""
    if np.all(np.diff(points[:, 0]) > 0.0):
        return []
    a, b = points[:-1], points[1:]
    d = b - a
    found = []
    for i in range(len(a) - 2):
        c, e = a[i + 2 :], d[i + 2 :]
        cross = d[i, 0] * e[:, 1] - d[i, 1] * e[:, 0]
        off = c - a[i]
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            t = (off[:, 0] * e[:, 1] - off[:, 1] * e[:, 0]) / cross
            u = (off[:, 0] * d[i, 1] - off[:, 1] * d[i, 0]) / cross
        if np.any((t > 0.0) & (t < 1.0) & (u > 0.0) & (u < 1.0)):
            found.append(
                Problem(
                    what="crosses itself",
                    index=i,
                    y_mm=float(a[i, 0]),
                    z_mm=float(a[i, 1]),
                    size_mm=float(np.hypot(*d[i])),
                )
            )
    return found
