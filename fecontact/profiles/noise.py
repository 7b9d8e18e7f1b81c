"""How noisy points are: what each misses the line through its neighbours by."""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np

from fecontact.profiles.segments import Floats


def noise_of(points: Floats) -> float:
    """Standard deviation of points (n, 2) across their line, from what four neighbours say of each."""
    missed, weight = missed_by_neighbours(points)
    # the median keeps corners, junctions and spikes out; 0.6745 turns it into a standard deviation
    return float(np.median(np.abs(missed) / weight)) / 0.6745 if missed.size else 0.0


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
    weights = [
        np.prod([(at - s[m]) / np.where(s[k] == s[m], 1e-12, s[k] - s[m]) for m in known if m != k], axis=0)
        for k in known
    ]
    guess = sum(w[:, None] * five[k] for w, k in zip(weights, known, strict=True))
    along = five[min(place + 1, 4)] - five[max(place - 1, 0)]
    along = along / np.maximum(np.hypot(*along.T), 1e-12)[:, None]
    off = five[place] - guess
    return off[:, 1] * along[:, 0] - off[:, 0] * along[:, 1], np.sqrt(1.0 + sum(w**2 for w in weights))
