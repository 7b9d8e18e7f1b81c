"""Remaining time of jobs, estimated from the durations of finished jobs."""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

Progress = Callable[[int, int, str], None]
"""Receives the number of finished jobs, the number of all jobs, and the present activity."""
Result = TypeVar("Result")

# If a job takes longer than all finished jobs, its remaining time is estimated as this fraction of its age.
_UNKNOWN_REST = 0.25


def estimate_seconds_left(
    durations: Sequence[float], ages: Sequence[float], waiting: int, workers: int, parts: Sequence[float] = ()
) -> float | None:
    """Expected seconds until the last job ends.

    A waiting job takes the mean time of the jobs that have ended, and goes to the worker that is free first. A job
    under way takes the mean time of the ended jobs that took longer than its present age. So workers without a job do
    not count at the end.

    Parameters
    ----------
    durations
        Seconds that each ended job took.
    ages
        Seconds since the start of each job under way.
    waiting
        Number of jobs that have not begun.
    workers
        Number of workers.
    parts
        Finished fraction of each job under way; 0 if the job does not report it. A job with a fraction is expected to
        continue at its speed so far.

    Returns
    -------
    float or None
        Seconds; None if no job has ended and no job reports a fraction.
    """
    parts = parts or [0.0] * len(ages)
    total_times = [*durations, *(age / fraction for age, fraction in zip(ages, parts, strict=True) if fraction)]
    if not total_times:
        return None
    mean = sum(total_times) / len(total_times)
    times_to_free = [
        age / fraction - age if fraction else _estimate_remaining_time(total_times, age)
        for age, fraction in zip(ages, parts, strict=True)
    ]
    times_to_free += [0.0] * (workers - len(times_to_free))
    heapq.heapify(times_to_free)
    for _ in range(waiting):
        heapq.heapreplace(times_to_free, times_to_free[0] + mean)
    return max(times_to_free)


def _estimate_remaining_time(durations: Sequence[float], age: float) -> float:
    longer = [duration for duration in durations if duration > age]
    return sum(longer) / len(longer) - age if longer else _UNKNOWN_REST * age


def report_progress(results: Iterable[Result], count: int, progress: Progress | None, words: str) -> Iterator[Result]:
    """Yield results as they come, and report progress with the remaining time after each.

    Parameters
    ----------
    results
        Results of `count` jobs, one after the other. Nothing is reported without jobs.
    count
        Number of results.
    progress
        Receives the progress.
    words
        Present activity, such as "judging".

    Yields
    ------
    Result
        Each of the results.
    """
    if progress is None or not count:
        yield from results
        return
    start = time.monotonic()
    progress(0, count, words)
    for number, result in enumerate(results, start=1):
        yield result
        if number < count:
            remaining_s = estimate_seconds_left([], [time.monotonic() - start], 0, 1, [number / count])
            progress(
                number, count, words if remaining_s is None else f"{words}; about {format_duration(remaining_s)} left"
            )


def format_duration(seconds: float) -> str:
    """Time in words, in s, min or h.

    Parameters
    ----------
    seconds
        Time in s.

    Returns
    -------
    str
        In s below 100 s, in min below 100 min, in h from there.
    """
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
