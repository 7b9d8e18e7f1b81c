"""Remaining time of jobs, estimated from the durations of finished jobs."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

# Only the age of a job is known if it takes longer than all finished jobs: its rest is taken as this part of the age.
_UNKNOWN_REST = 0.25


def seconds_left(durations: Sequence[float], ages: Sequence[float], waiting: int, workers: int) -> float | None:
    """Expected seconds until the last job ends; None while no job has ended.

    A waiting job takes the mean time of the jobs that have ended, and goes to the worker that is free first. A job
    under way takes the mean time of the ended jobs that took longer than its present age. So workers without a job do
    not count at the end.

    Parameters
    ----------
    durations
        Seconds that each ended job took.
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
    """A time in words."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
