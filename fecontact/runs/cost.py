"""About what time and memory many cases take, from a few of them that are placed and expected."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TypeVar

from fecontact.case import Case
from fecontact.errors import FecontactError
from fecontact.jobs.remaining import duration
from fecontact.solving.cost import START_SECONDS, cpu_seconds, memory_GB, times_by_yielding
from fecontact.solving.preview import preview, preview_to_solve

# Each takes 0.1 to 0.6 s.
_MOST_SEEN = 3
_REFINED = 3.0
"""Ratio of unknowns for a verdict that stays open: all meshes over the first ones, where the limit allows."""
Item = TypeVar("Item")


@dataclass(frozen=True, kw_only=True)
class Cost:
    """About what a study or a map takes, on an idle machine.

    Attributes
    ----------
    seconds, memory_GB
        Of the whole and of its largest case, if every verdict is clear on its first meshes.
    most_seconds, most_memory_GB
        Of the whole and of its largest case with finer meshes, where verdicts stay open: these go on up to as many
        unknowns as cases may have, however few the first meshes have.
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
            f"about {duration(self.seconds)} with {workers} and {self.memory_GB:.1f} GB per worker; up to"
            f" {duration(self.most_seconds)} and {self.most_memory_GB:.1f} GB where verdicts stay open"
        )
        if self.most_memory_GB * self.workers <= self.available_GB:
            return (expected,)
        return (expected, f"{self.available_GB:.1f} GB are available: fewer --workers may be needed")


# CPU seconds of files, pictures and reports: of each case or cell by its worker, and of all of them at the end. Of
# S1002 on 60E1 under 100 kN a case alone took 2.7, 2.9 and 3.4 s, studies of 3 and 9 cases 7.3 and 15 s, maps of as
# many positions, with one load each, 4.0 and 7.6 s.
CASE_FILES_S, STUDY_FILES_S, MAP_FILES_S = (0.0, 2.8), (1.3, 3.3), (0.6, 2.2)
# Part of the solution that a further load of a position takes, on meshes that it shares; of a map with its load limits.
# 2 and 4 loads a position took 0.53 to 0.67 and 0.54 to 0.64 of what they would take one by one.
_SHARING = 0.5


def cost_of(
    cases: Sequence[Case],
    workers: int,
    *,
    further: tuple[float, float] = (0.0, 0.0),
    files: tuple[float, float] = (0.0, 0.0),
) -> Cost | None:
    """What all cases take together, so many at a time; None where none of those that are looked at can be solved.

    Loads of a position share meshes. `further` has how many loads the limits of a map take for the lines of measured
    points, about and at most; `files` the seconds of what is written of each case, and of all at the end.
    """
    import psutil

    seen = []
    for case in spread(cases, _MOST_SEEN):
        # what cannot be solved says so when it is its turn
        with suppress(FecontactError):
            seen.append(preview_to_solve(case))
    if not seen:
        return None
    first = [one.degrees_of_freedom for one in seen]
    finest = [max(one.degrees_of_freedom, one.case.most_unknowns) for one in seen]
    most = [min(_REFINED * unknowns, last) for unknowns, last in zip(first, finest, strict=True)]
    times = [times_by_yielding(one.case, one.hertz.p0_MPa) for one in seen]
    solved_s, refined_s = (
        sum(by * cpu_seconds(unknowns) for by, unknowns in zip(times, of, strict=True)) for of in (first, most)
    )
    lines_seconds = sum(one.lines_seconds for one in seen)
    # a position with fewer others than workers is shared out among them
    alone = max(len({any_load(case) for case in cases}), min(workers, len(cases)))
    solved = (alone + _SHARING * (len(cases) - alone)) / len(seen) / workers
    on_lines = len(cases) / len(seen) / workers * lines_seconds
    of_limits, of_limits_most = (loads * lines_seconds / len(seen) / workers for loads in further)
    beside = START_SECONDS + len(cases) * files[0] / workers + files[1]
    return Cost(
        workers=workers,
        seconds=beside + solved * solved_s + on_lines + of_limits,
        memory_GB=memory_GB(max(first)),
        most_seconds=beside + solved * refined_s + on_lines + of_limits_most,
        most_memory_GB=memory_GB(max(finest)),
        available_GB=psutil.virtual_memory().available / 1e9,
    )


# A forecast takes 0.1 to 0.6 s; among more positions the last one is a small part of the whole.
_MOST_FORECAST = 24


def longest_first(cases: Mapping[str, Case], workers: int) -> list[str]:
    """Names of positions, those first that will take longest, so that no worker waits long for the last one.

    They stay in their order where that saves nothing: on one worker, with a worker for each, or where they are many.
    """
    if not 1 < workers < len(cases) <= _MOST_FORECAST:
        return list(cases)
    seconds = dict.fromkeys(cases, 0.0)
    for name, case in cases.items():
        # what cannot be solved takes no time, and says so when it is its turn
        with suppress(FecontactError):
            seconds[name] = preview(case).cpu_seconds
    return sorted(cases, key=lambda name: -seconds[name])


def spread(items: Sequence[Item], most: int) -> list[Item]:
    """So many of some items at most, from the first to the last."""
    step = max(1.0, (len(items) - 1) / (most - 1))
    return [items[round(number * step)] for number in range(min(len(items), most))]


_ANY_LOAD_N = 100e3


def any_load(case: Case) -> Case:
    """The same for all loads that share their meshes: a roll that is found under the load is another one for each."""
    with_load = case.roll == "loaded" and case.roll_load_N is None
    return case if with_load else replace(case, load_N=_ANY_LOAD_N)
