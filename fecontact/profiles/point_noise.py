"""Noise of points: the distance of each point from the curve through its neighbours."""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np

from fecontact.arrays import Floats

# So many points know their scatter to a third.
_FEWEST = 60


def noise_of(points: Floats) -> float:
    """Standard deviation of points (n, 2) across their line, from what four neighbours say of each, at most."""
    missed, weight = missed_by_neighbours(points)
    return float(scatter_of(points, missed / weight).max()) if missed.size else 0.0


def scatter_of(points: Floats, missed: Floats) -> Floats:
    """Standard deviation (n - 4,) across the line that the inner ones of points (n, 2) have by their misses (n - 4,).

    An instrument may be wrong in the height alone, or across alone: flat and steep points are looked at by themselves,
    and what is between them has of both.
    """
    along = points[4:] - points[:-4]
    steep = np.abs(along[:, 1]) > np.abs(along[:, 0])
    parts = (~steep, steep)
    if any(np.count_nonzero(part) < _FEWEST for part in parts):
        return np.full(missed.size, _deviation(missed))
    flat, side = (_deviation(missed[part]) for part in parts)
    scatter = np.hypot(flat * along[:, 0], side * along[:, 1])
    return np.asarray(scatter / np.maximum(np.hypot(*along.T), 1e-12))


def _deviation(missed: Floats) -> float:
    # the median keeps corners, junctions and spikes out; 0.6745 turns it into a standard deviation
    return float(np.median(np.abs(missed))) / 0.6745


def missed_by_neighbours(points: Floats, place: Literal[0, 2, 4] = 2) -> tuple[Floats, Floats]:
    """How far one of every five points lies across the cubic through the others, and its error over theirs.

    Parameters
    ----------
    points (n, 2)
        In mm, in the order along the line.
    place
        The middle one, the first or the last of the five: the line is then continued from one side.

    Returns
    -------
    missed, weight (n - 4,)
        Positive to the left (mm); standard deviation of it where each point has one of 1.
    """
    if len(points) < 5:
        return np.zeros(0), np.ones(0)
    five = [points[k : len(points) - 4 + k] for k in range(5)]
    chords = [np.hypot(*(q - p).T) for p, q in pairwise(five)]
    s = np.cumsum([np.zeros(len(five[0])), *chords], axis=0)
    at, known = s[place], [k for k in range(5) if k != place]

    def apart(k: int, m: int) -> Floats:
        # two points at one place have no distance
        return np.where(np.abs(s[k] - s[m]) < 1e-12, 1e-12, s[k] - s[m])

    weights = [np.prod([(at - s[m]) / apart(k, m) for m in known if m != k], axis=0) for k in known]
    guess = sum(w[:, None] * five[k] for w, k in zip(weights, known, strict=True))
    along = five[min(place + 1, 4)] - five[max(place - 1, 0)]
    along = along / np.maximum(np.hypot(*along.T), 1e-12)[:, None]
    off = five[place] - guess
    return off[:, 1] * along[:, 0] - off[:, 0] * along[:, 1], np.sqrt(1.0 + sum(w**2 for w in weights))
