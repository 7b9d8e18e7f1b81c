"""Approximate time and memory of many cases, from previews of some of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TypeVar

from fecontact.case import Case
from fecontact.errors import FecontactError
from fecontact.jobs.remaining import format_duration
from fecontact.solving.cost import START_SECONDS, estimate_cpu_seconds, estimate_memory_GB, estimate_yield_factor
from fecontact.solving.preview import preview_case, preview_case_to_solve

# A preview takes 0.1 to 0.6 s.
_MAX_PREVIEWS = 3
_REFINEMENT_RATIO = 3.0
"""Ratio of unknowns for a verdict that stays unresolved: all meshes to the first meshes, if the limit allows it."""
Item = TypeVar("Item")


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Approximate cost of a study or a map on an idle machine.

    Attributes
    ----------
    workers
        Number of workers.
    seconds, memory_GB
        Time of all cases in s and memory of the largest case in GB, if every verdict is clear on its first meshes.
    most_seconds, most_memory_GB
        Time of all cases in s and memory of the largest case in GB with finer meshes, if verdicts stay unresolved. The
        meshes are refined up to the largest number of unknowns that cases may have, also from small first meshes.
    available_GB
        Memory that is free now, in GB.
    """

    workers: int
    seconds: float
    memory_GB: float
    most_seconds: float
    most_memory_GB: float
    available_GB: float

    @property
    def words(self) -> tuple[str, ...]:
        """Time and memory in words, and a note if there is too little memory."""
        workers = f"{self.workers} worker{'s' * (self.workers != 1)}"
        expected = (
            f"about {format_duration(self.seconds)} with {workers} and {self.memory_GB:.1f} GB per worker; up to"
            f" {format_duration(self.most_seconds)} and {self.most_memory_GB:.1f} GB if verdicts stay unresolved"
        )
        if self.most_memory_GB * self.workers <= self.available_GB:
            return (expected,)
        return (expected, f"{self.available_GB:.1f} GB are available: you may need fewer --workers")


# CPU seconds of files, pictures and reports: per case or cell in its worker, and for all of them at the end. With
# S1002 on 60E1 under 100 kN a single case took 2.7, 2.9 and 3.4 s, studies of 3 and 9 cases 7.3 and 15 s, and maps of
# 3 and 9 positions, with one load each, 4.0 and 7.6 s.
CASE_FILES_S, STUDY_FILES_S, MAP_FILES_S = (0.0, 2.8), (1.3, 3.3), (0.6, 2.2)
# Time of a further load of a position on shared meshes, as a fraction of the time of a separate solution; for a map
# with its load limits. 2 and 4 loads per position took 0.53 to 0.67 and 0.54 to 0.64 of the time of separate solutions.
_FURTHER_LOAD_FRACTION = 0.5


def estimate_cost(
    cases: Sequence[Case],
    workers: int,
    *,
    further: tuple[float, float] = (0.0, 0.0),
    files: tuple[float, float] = (0.0, 0.0),
) -> Cost | None:
    """Estimate the cost of all cases together; loads of a position share meshes.

    Parameters
    ----------
    cases
        Cases.
    workers
        Number of cases at a time.
    further
        Numbers of loads that the load limits of a map take for the profile variants of measured points: expected,
        largest.
    files
        CPU seconds for the files of each case, and for all files at the end.

    Returns
    -------
    Cost or None
        The cost; None if no previewed case can be solved.
    """
    import psutil

    previews = []
    for case in select_evenly(cases, _MAX_PREVIEWS):
        # the error of a case that cannot be solved is reported when the case is solved
        with suppress(FecontactError):
            previews.append(preview_case_to_solve(case))
    if not previews:
        return None
    first_unknowns = [case_preview.degrees_of_freedom for case_preview in previews]
    finest_unknowns = [
        max(case_preview.degrees_of_freedom, case_preview.case.most_unknowns) for case_preview in previews
    ]
    refined_unknowns = [
        min(_REFINEMENT_RATIO * unknowns, finest_count)
        for unknowns, finest_count in zip(first_unknowns, finest_unknowns, strict=True)
    ]
    times = [estimate_yield_factor(case_preview.case, case_preview.hertz.p0_MPa) for case_preview in previews]
    solved_s, refined_s = (
        sum(
            time_factor * estimate_cpu_seconds(unknowns)
            for time_factor, unknowns in zip(times, unknown_counts, strict=True)
        )
        for unknown_counts in (first_unknowns, refined_unknowns)
    )
    variant_seconds = sum(case_preview.lines_seconds for case_preview in previews)
    # if there are fewer positions than workers, the loads of a position are divided among workers
    first_loads = max(len({use_common_load(case) for case in cases}), min(workers, len(cases)))
    solutions_per_worker = (first_loads + _FURTHER_LOAD_FRACTION * (len(cases) - first_loads)) / len(previews) / workers
    variants_s = len(cases) / len(previews) / workers * variant_seconds
    limits_s, most_limits_s = (loads * variant_seconds / len(previews) / workers for loads in further)
    fixed_s = START_SECONDS + len(cases) * files[0] / workers + files[1]
    return Cost(
        workers=workers,
        seconds=fixed_s + solutions_per_worker * solved_s + variants_s + limits_s,
        memory_GB=estimate_memory_GB(max(first_unknowns)),
        most_seconds=fixed_s + solutions_per_worker * refined_s + variants_s + most_limits_s,
        most_memory_GB=estimate_memory_GB(max(finest_unknowns)),
        available_GB=psutil.virtual_memory().available / 1e9,
    )


# A forecast takes 0.1 to 0.6 s. With more positions the last position is a small part of the total time.
_MAX_FORECASTS = 24


def sort_longest_first(cases: Mapping[str, Case], workers: int) -> list[str]:
    """Sort names of positions by the expected time, the longest first.

    So no worker waits long for the last position. The order stays if sorting saves nothing: with a single worker, with
    a worker per position, or with many positions.

    Parameters
    ----------
    cases
        Cases by name.
    workers
        Number of workers.

    Returns
    -------
    list of str
        Sorted names.
    """
    if not 1 < workers < len(cases) <= _MAX_FORECASTS:
        return list(cases)
    seconds = dict.fromkeys(cases, 0.0)
    for name, case in cases.items():
        # a case that cannot be solved takes no time; its error is reported when it is solved
        with suppress(FecontactError):
            seconds[name] = preview_case(case).cpu_seconds
    return sorted(cases, key=lambda name: -seconds[name])


def select_evenly(candidates: Sequence[Item], max_count: int) -> list[Item]:
    """Select evenly spaced elements of a sequence, from the first to the last.

    Parameters
    ----------
    candidates
        The sequence.
    max_count
        Largest number of elements.

    Returns
    -------
    list
        The selected elements.
    """
    step = max(1.0, (len(candidates) - 1) / (max_count - 1))
    return [candidates[round(number * step)] for number in range(min(len(candidates), max_count))]


_ANY_LOAD_N = 100e3


def use_common_load(case: Case) -> Case:
    """Replace the load of a case by a common load.

    Cases that share meshes are equal after this.

    A roll that depends on the load is different for each load; then the case is returned unchanged.

    Parameters
    ----------
    case
        Case with any load.

    Returns
    -------
    Case
        Case with the common load, or the unchanged case.
    """
    has_roll_by_load = case.roll == "loaded" and case.roll_load_N is None
    return case if has_roll_by_load else replace(case, load_N=_ANY_LOAD_N)
