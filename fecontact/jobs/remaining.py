"""How long jobs will still take, from how long those before them took."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

# Of a job that takes longer than all before it nothing is known but its age: this part of it is given to the rest.
_UNKNOWN_REST = 0.25


def seconds_left(durations: Sequence[float], ages: Sequence[float], waiting: int, workers: int) -> float | None:
    """Expected seconds until the last job ends; None while no job has ended.

    A job that waits takes the mean time of those that have ended, and goes to the worker that is free first. One that
    is under way takes the mean time of those that took longer than it has by now. So workers that have nothing left to
    do do not count at the end.

    Parameters
    ----------
    durations
        Seconds that each job took that has ended.
    ages
        Seconds that each job has been under way for.
    waiting
        Jobs that nobody has begun.
    """
    if not durations:
        return None
    mean = sum(durations) / len(durations)
    free = [_rest(durations, age) for age in ages]
    free += [0.0] * (workers - len(free))
    heapq.heapify(free)
    for _ in range(waiting):
        heapq.heapreplace(free, free[0] + mean)
    return max(free)


def _rest(durations: Sequence[float], age: float) -> float:
    longer = [duration for duration in durations if duration > age]
    return sum(longer) / len(longer) - age if longer else _UNKNOWN_REST * age


def duration(seconds: float) -> str:
    """A time as one would say it."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
