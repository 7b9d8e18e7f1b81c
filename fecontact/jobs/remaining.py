"""Remaining time of jobs, estimated from the durations of finished jobs."""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

Progress = Callable[[int, int, str], None]
"""Hears the number of finished jobs, the number of all jobs, and what is under way."""
Result = TypeVar("Result")

# Only the age of a job is known if it takes longer than all finished jobs: its rest is taken as this part of the age.
_UNKNOWN_REST = 0.25


def seconds_left(
    durations: Sequence[float], ages: Sequence[float], waiting: int, workers: int, parts: Sequence[float] = ()
) -> float | None:
    """Expected seconds until the last job ends; None while no job has ended, and no part of a job.

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
    parts
        Which part of each job under way is done; 0 where it does not say. Such a job goes on as it went.
    """
    parts = parts or [0.0] * len(ages)
    known = [*durations, *(age / part for age, part in zip(ages, parts, strict=True) if part)]
    if not known:
        return None
    mean = sum(known) / len(known)
    free = [age / part - age if part else _rest(known, age) for age, part in zip(ages, parts, strict=True)]
    free += [0.0] * (workers - len(free))
    heapq.heapify(free)
    for _ in range(waiting):
        heapq.heapreplace(free, free[0] + mean)
    return max(free)


def _rest(durations: Sequence[float], age: float) -> float:
    longer = [duration for duration in durations if duration > age]
    return sum(longer) / len(longer) - age if longer else _UNKNOWN_REST * age


def watched(results: Iterable[Result], count: int, progress: Progress | None, words: str) -> Iterator[Result]:
    """Results as they come, with progress and the time that is left after each.

    Parameters
    ----------
    results
        So many as `count`, one after the other; of none nothing is said.
    words
        What is done, such as "judging".
    """
    if progress is None or not count:
        yield from results
        return
    begun = time.monotonic()
    progress(0, count, words)
    for number, result in enumerate(results, start=1):
        yield result
        if number < count:
            left = seconds_left([], [time.monotonic() - begun], 0, 1, [number / count])
            progress(number, count, words if left is None else f"{words}; about {duration(left)} left")


def duration(seconds: float) -> str:
    """A time in words."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
