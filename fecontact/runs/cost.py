"""About what time and memory many cases take, from a few of them that are placed and expected."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TypeVar

from fecontact.case import Case
from fecontact.errors import FecontactError
from fecontact.jobs.remaining import duration
from fecontact.solving.cost import START_SECONDS, cpu_seconds, memory_GB
from fecontact.solving.preview import preview

# Each takes 0.1 to 0.6 s.
_MOST_SEEN = 3
_REFINED = 3.0
"""Unknowns of all meshes of a verdict that stays open over those of the first ones, where the limit allows."""
Item = TypeVar("Item")


@dataclass(frozen=True, kw_only=True)
class Cost:
    """About what a study or a map takes, on an idle machine.

    Attributes
    ----------
    seconds, memory_GB
        Of the whole and of its largest case, if every verdict is clear on its first meshes.
    most_seconds, most_memory_GB
        Of the whole and of its largest case with finer meshes, where verdicts stay open.
    available_GB
        Memory that is free now.
    """

    workers: int
    seconds: float
    memory_GB: float
    most_seconds: float
    most_memory_GB: float
    available_GB: float

    @property
    def words(self) -> tuple[str, ...]:
        """Time and memory in words, and whether there is too little memory."""
        workers = f"{self.workers} worker{'s' * (self.workers != 1)}"
        expected = (
            f"about {duration(self.seconds)} with {workers} and {self.memory_GB:.1f} GB a worker; up to"
            f" {duration(self.most_seconds)} and {self.most_memory_GB:.1f} GB where verdicts stay open"
        )
        if self.most_memory_GB * self.workers <= self.available_GB:
            return (expected,)
        return (expected, f"{self.available_GB:.1f} GB are available: fewer --workers may be needed")


def cost_of(cases: Sequence[Case], workers: int) -> Cost | None:
    """What all cases take together, so many at a time; None where none of those that are looked at can be solved.

    The loads of a map are counted as cases: what they save by sharing their meshes its load limits take about again.
    """
    import psutil

    first, most = [], []
    for case in spread(cases, _MOST_SEEN):
        # what cannot be solved says so when it is its turn
        with suppress(FecontactError):
            unknowns = preview(case).degrees_of_freedom
            first.append(unknowns)
            most.append(max(unknowns, min(_REFINED * unknowns, case.refine_degrees_of_freedom)))
    if not first:
        return None
    each = len(cases) / len(first) / workers
    return Cost(
        workers=workers,
        seconds=START_SECONDS + each * sum(map(cpu_seconds, first)),
        memory_GB=memory_GB(max(first)),
        most_seconds=START_SECONDS + each * sum(map(cpu_seconds, most)),
        most_memory_GB=memory_GB(max(most)),
        available_GB=psutil.virtual_memory().available / 1e9,
    )


def spread(items: Sequence[Item], most: int) -> list[Item]:
    """So many of some items at most, from the first to the last."""
    step = max(1.0, (len(items) - 1) / (most - 1))
    return [items[round(number * step)] for number in range(min(len(items), most))]
