"""Load limits of Hertz at a position: usable loads, the next load to solve, and the limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, takewhile
from typing import TypeVar

import numpy as np

from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.verdict import Answer
from fecontact.maps.model import LoadInterval, LoadLimit, MapCell

# The search assumes nothing about the change of the verdict over the load: a second lobe may appear and disappear
# again.

_Word = TypeVar("_Word", bound=str)
# Largest distance between the loads on both sides of a limit, as a fraction of the load. The second value is for the
# loads at which an unresolved verdict begins or ends; these loads follow from the uncertainty and not from the contact.
LOAD_TOLERANCE = 0.02
_OPEN_TOLERANCE = 0.05
MOST_FURTHER_LOADS = 14
"""Largest number of loads at a position for its limits, in addition to the map's loads."""
LOADS_FOR_LIMITS = 5.0
"""Typical number of loads for the limits at a position of measured profiles.

A position of a worn pair with a suddenly appearing second patch took 14 loads. For new profiles, the verdict changed at
4 in 13 positions, and each of these 4 took 3.5 loads.
"""
# Ratio of neighbouring loads above which a guard load is tried beyond a limit.
_LEAST_GUARDED_RATIO = 1.1
# Loads on the way guard the limit if no gap between them is more than this fraction of the whole range, in logarithms.
_GUARDED_FRACTION = 0.75


@dataclass(frozen=True, kw_only=True)
class LoadVerdict:
    """Verdict at a load.

    Attributes
    ----------
    load_N, answer
        Load in N, and verdict.
    excess
        Limit utilisation minus 1, of the measure with the largest limit utilisation.
    least, most
        Smallest and largest value of the excess within its uncertainty. Hertz fails if the smallest value is above 0,
        and holds if the largest value is not above 0.
    """

    load_N: float
    answer: Answer
    excess: float
    least: float = math.nan
    most: float = math.nan

    @classmethod
    def of(cls, judged_load: JudgedLoad) -> LoadVerdict:
        """Verdict at a judged load, by the worst side.

        Parameters
        ----------
        judged_load
            Judged load.

        Returns
        -------
        LoadVerdict
            Verdict with its excess.
        """
        sides = judged_load.sides.values() if judged_load.plastic is None else (judged_load.plastic.deciding,)
        # NaN on a single side is NaN on the worst side.
        excess, lowest, highest = np.max([(side.limit_utilisation, *side.limit_range) for side in sides], axis=0) - 1.0
        return cls(
            load_N=judged_load.load_N,
            answer=judged_load.verdict.answer,
            excess=float(excess),
            least=float(lowest),
            most=float(highest),
        )


def list_usable_loads(cells: Sequence[MapCell], tried: Sequence[JudgedLoad] = ()) -> tuple[LoadVerdict, ...]:
    """Usable loads of a position, by increasing load.

    Parameters
    ----------
    cells
        Cells of the map's loads.
    tried
        Loads solved in addition to the map's loads.

    Returns
    -------
    tuple of LoadVerdict
        Verdicts of the usable loads.
    """
    loads = [LoadVerdict.of(load) for load in tried if load.usable]
    loads += [LoadVerdict.of(cell.usable) for cell in cells if cell.usable]
    return tuple(sorted(loads, key=lambda load: load.load_N))


def choose_next_load(
    usable_loads: Sequence[LoadVerdict], map_loads_N: Sequence[float], unusable_N: Sequence[float] = ()
) -> float | None:
    """Load (N) to solve next in the search for load limits.

    Between two loads with different verdicts, the next load is at the zero of the excess that makes the difference, on
    a straight line. Afterwards guard loads are tried: half way from the failing loads at a limit to the map's next load
    above, because Hertz might hold there again.

    Parameters
    ----------
    usable_loads
        Verdicts by increasing load.
    map_loads_N
        Loads of the map, in N.
    unusable_N
        Loads that were tried without a usable result, in N. Nothing more is tried between their neighbours, because
        another attempt would end in this way too.

    Returns
    -------
    float or None
        Load in N; None if every change of the verdict is enclosed within the tolerance, or if enough loads were tried.
    """
    # This is not the difference of both numbers, because loads of the map may be missing.
    if len(unusable_N) + sum(load.load_N not in map_loads_N for load in usable_loads) >= MOST_FURTHER_LOADS:
        return None
    for lower, upper in pairwise(usable_loads):
        if lower.answer == upper.answer or any(lower.load_N < load_N < upper.load_N for load_N in unusable_N):
            continue
        tolerance = _OPEN_TOLERANCE if "UNRESOLVED" in (lower.answer, upper.answer) else LOAD_TOLERANCE
        if upper.load_N - lower.load_N > tolerance * upper.load_N:
            return _choose_load_between(lower, upper, tolerance)
    for number, (before, first) in enumerate(pairwise(usable_loads), 1):
        if before.answer == "FAILS" or first.answer != "FAILS" or first.load_N in map_loads_N:
            continue
        failing = [load.load_N for load in takewhile(lambda load: load.answer == "FAILS", usable_loads[number:])]
        map_index = next((place for place, load_N in enumerate(failing) if load_N in map_loads_N), 0)
        if map_index and not unusable_N and (guard := _find_guard_load(failing[: map_index + 1])) is not None:
            return guard
    return None


def _find_guard_load(failing_N: Sequence[float]) -> float | None:
    """Load (N) in the widest gap between failing loads; None for narrow gaps.

    The failing loads reach from a limit to the map's next load.

    A load from the search near the limit does not guard the loads beyond it.
    """
    gap, low_N = max((upper_N / lower_N, lower_N) for lower_N, upper_N in pairwise(failing_N))
    range_ratio = failing_N[-1] / failing_N[0]
    return low_N * math.sqrt(gap) if gap > max(_LEAST_GUARDED_RATIO, range_ratio**_GUARDED_FRACTION) else None


def _choose_load_between(lower: LoadVerdict, upper: LoadVerdict, tolerance: float) -> float:
    """Load (N) between two loads with different verdicts.

    The load is near the zero of the excess that makes the verdict change, on the side with the larger unresolved range.

    Parameters
    ----------
    lower, upper
        Neighbouring loads.
    tolerance
        Largest distance of both loads at the end of the search, as a fraction of the load.

    Returns
    -------
    float
        Load in N.
    """
    low, high = math.log(lower.load_N), math.log(upper.load_N)
    answers = {lower.answer, upper.answer}
    change = "excess" if "UNRESOLVED" not in answers else "least" if "FAILS" in answers else "most"
    ends: list[float] = [getattr(load, change) for load in (lower, upper)]
    if not math.prod(ends) < 0.0:
        return math.exp(0.5 * (low + high))
    # A suddenly appearing second patch is far beyond its limit: a straight line to its excess would converge slowly.
    before, after = (max(-1.0, min(1.0, end)) for end in ends)
    fraction = before / (before - after)
    root = low + fraction * (high - low)
    # The offset puts the next load on the other side of the limit, with the change between both loads.
    offset = 0.4 * tolerance
    target = root - offset if fraction > 0.5 else root + offset
    room = 0.1 * (high - low)
    return math.exp(min(max(target, low + room), high - room))


def find_load_limit(
    cells: Sequence[MapCell], tried: Sequence[JudgedLoad] = (), *, stopped: MapCell | None = None
) -> LoadLimit:
    """Loads at which Hertz holds at a position, from its solved loads.

    Parameters
    ----------
    cells
        Cells of the map's loads, by increasing load.
    tried
        Loads solved in addition to the map's loads.
    stopped
        Further load that could not be solved.

    Returns
    -------
    LoadLimit
        Intervals of loads with their verdicts.
    """
    usable_loads = list_usable_loads(cells, tried)
    unusable_cells = [] if not usable_loads else [cell for cell in cells if not cell.usable]
    unusable_cells += [] if stopped is None else [stopped]
    statuses = {cell.status for cell in cells}
    notes = [f"{cell.load_N / 1e3:.4g} kN: {cell.status}" for cell in unusable_cells]
    unusable_loads = [load for load in tried if not load.usable]
    notes += [f"{load.load_N / 1e3:.4g} kN: {load.status}" for load in unusable_loads]
    return LoadLimit(
        intervals=find_intervals([(load.load_N, load.answer) for load in usable_loads]),
        reason=None if usable_loads else statuses.pop() if len(statuses) == 1 else "no load could be solved",
        note="; ".join(notes) or None,
        tried=tuple((load.load_N, load.verdict.answer) for load in tried),
        narrowed=stopped is None
        and choose_next_load(usable_loads, [cell.load_N for cell in cells], [load.load_N for load in unusable_loads])
        is None,
    )


def find_intervals(answers_by_load: Sequence[tuple[float, Answer]]) -> tuple[LoadInterval, ...]:
    """Intervals between loads with verdicts, by increasing load.

    Parameters
    ----------
    answers_by_load
        Loads in N with their verdicts, by increasing load.

    Returns
    -------
    tuple of LoadInterval
        Intervals without gaps between them.
    """
    answer_stretches = find_stretches(answers_by_load, "UNRESOLVED")
    return tuple(LoadInterval(low_N=low_N, high_N=high_N, answer=answer) for low_N, high_N, answer in answer_stretches)


def find_stretches(words_by_load: Sequence[tuple[float, _Word]], between: _Word) -> list[tuple[float, float, _Word]]:
    """Stretches of loads with a single word each.

    Between two loads with equal words the stretch has this word; between two loads with different words it has the word
    `between`.

    Parameters
    ----------
    words_by_load
        Loads in N with their words, by increasing load.
    between
        Word between different words.

    Returns
    -------
    list of (float, float, str)
        Smallest load (N), largest load (N) and word of each stretch.
    """
    finished: list[tuple[float, float, _Word]] = []

    def add(low_N: float, high_N: float, word: _Word) -> None:
        """Append a stretch, or extend the last stretch if the words are equal."""
        if finished and finished[-1][2] == word:
            low_N = finished.pop()[0]
        finished.append((low_N, high_N, word))

    for number, (load_N, word) in enumerate(words_by_load):
        if number and words_by_load[number - 1][1] != word:
            add(words_by_load[number - 1][0], load_N, between)
        add(finished[-1][1] if finished else load_N, load_N, word)
    return finished
