"""What is wrong with measured points: spikes, points out of order, lines that cross themselves; each with its place."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fecontact.profiles.curve import Floats
from fecontact.profiles.smoothing import missed_by_neighbours, noise_of

What = Literal["spike", "out of order", "crosses itself"]

# A spike lies off by so many times the scatter of its neighbours: beyond what noise does in some thousand points.
_SPIKE_SIGMAS = 7.0
# Smaller ones change nothing, and the scatter of exact points is smaller still.
_LEAST_SPIKE_MM = 0.003
# A junction from straight to R 10 mm misses by up to so much of the square of the spacing (1/mm).
_JUNCTION_PER_MM = 0.012
# A corner or a junction misses as well: without a spike its neighbours miss less than this part of it.
_LEFT_WITHOUT = 0.35
_MOST_SPIKES = 50
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
        if self.what == "out of order":
            return f"the line turns back at {at}"
        return f"the line crosses itself at {at}"


def spikes(points: Floats) -> list[Problem]:
    """Single points (n, 2) that lie off the line through their neighbours, the largest first."""
    left, index, found = points, np.arange(len(points)), []
    corners: set[int] = set()
    for _ in range(_MOST_SPIKES):
        missed, weight = missed_by_neighbours(left)
        if missed.size < 5:
            break
        scatter = float(np.median(np.abs(missed) / weight)) / 0.6745
        step = 0.25 * np.hypot(*(left[4:] - left[:-4]).T)
        limit = np.maximum(_SPIKE_SIGMAS * scatter * weight, _LEAST_SPIKE_MM + _JUNCTION_PER_MM * step**2)
        over = np.abs(missed) / limit
        over[[i for i in range(over.size) if int(index[i + 2]) in corners]] = 0.0
        worst = int(np.argmax(over))
        if over[worst] < 1.0:
            break
        without = np.delete(left, worst + 2, axis=0)
        rest, _ = missed_by_neighbours(without)
        near = np.abs(rest[max(worst - 2, 0) : worst + 2])
        if (
            _stands_out(left[worst : worst + 5])
            and near.size
            and near.max() < max(_LEFT_WITHOUT * abs(missed[worst]), limit[worst])
        ):
            y, z = left[worst + 2]
            found.append(
                Problem(
                    what="spike",
                    index=int(index[worst + 2]),
                    y_mm=float(y),
                    z_mm=float(z),
                    size_mm=float(missed[worst]),
                )
            )
            left, index = without, np.delete(index, worst + 2)
        else:
            corners.update(int(index[k]) for k in range(max(worst - 1, 0), min(worst + 6, index.size)))
    return found


def _stands_out(five: Floats) -> bool:
    """Whether the middle one of five points stands out of a line that goes on in its direction, as no corner does."""
    d = np.diff(five, axis=0)
    angles = np.arctan2(d[:, 1], d[:, 0])
    net, own = math.remainder(angles[3] - angles[0], math.tau), math.remainder(angles[2] - angles[1], math.tau)
    return abs(net) < 0.5 * abs(own)


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
        with np.errstate(divide="ignore", invalid="ignore"):
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
