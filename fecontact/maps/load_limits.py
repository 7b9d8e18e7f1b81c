"""Load limits of Hertz at one position: which loads are known, which load to solve next, and the limit."""

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

#
# Nothing is assumed of how the verdict changes over the load: a second lobe may come and be swallowed again.

_Word = TypeVar("_Word", bound=str)
# The loads on both sides of a limit are brought together to this part of the load; those where an open verdict begins
# or ends to the second, which follows from the uncertainty and not from the contact.
LOAD_TOLERANCE = 0.02
_OPEN_TOLERANCE = 0.05
MOST_TRIED = 14
"""Loads at a position that its limits take at most, beside the map's own."""
LOADS_FOR_LIMITS = 5.0
"""What they take about at a position of measured profiles: 14 were at one of a worn pair whose second patch comes at
once, and 3.5 at each of the 4 in 13 positions of new profiles at which the verdict changes."""
# A load beyond a limit is tried where the next one is farther away than this.
_GUARD_FROM = 1.1
# Loads on the way guard it if no gap between them is more than this part of the whole, in logarithms.
_GUARDED = 0.75


@dataclass(frozen=True, kw_only=True)
class KnownLoad:
    """Verdict at a load.

    Attributes
    ----------
    excess
        By how much the measure that uses most of its limit is beyond it, in limits.
    least, most
        How little and how much that may be: Hertz fails where the least is beyond 0, and holds where the most is not.
    """

    load_N: float
    answer: Answer
    excess: float
    least: float = math.nan
    most: float = math.nan

    @classmethod
    def of(cls, judged: JudgedLoad) -> KnownLoad:
        """The worst side of a judged load."""
        sides = judged.sides.values() if judged.plastic is None else (judged.plastic.deciding,)
        # what is not a number on one side is none on the worst
        excess, least, most = np.max([(side.limit_used, *side.limit_range) for side in sides], axis=0) - 1.0
        return cls(
            load_N=judged.load_N,
            answer=judged.verdict.answer,
            excess=float(excess),
            least=float(least),
            most=float(most),
        )


def known_loads(cells: Sequence[MapCell], tried: Sequence[JudgedLoad] = ()) -> tuple[KnownLoad, ...]:
    """The loads of a position that may be used, by increasing load."""
    found = [KnownLoad.of(judged) for judged in tried if judged.usable]
    found += [KnownLoad.of(cell.usable) for cell in cells if cell.usable]
    return tuple(sorted(found, key=lambda known: known.load_N))


def next_load(known: Sequence[KnownLoad], own_N: Sequence[float], lost_N: Sequence[float] = ()) -> float | None:
    """The load (N) to solve next, None where every change of the verdict is known well, or enough loads were tried.

    Parameters
    ----------
    known
        By increasing load.
    own_N
        The loads that the map asks for.
    lost_N
        Loads that were tried and may not be used: between their neighbours nothing more is tried, for another attempt
        would end so too.

    Notes
    -----
    Between two loads whose verdicts differ, where the excess that makes the difference is zero on a straight line.
    Then, as a guard, half way from the loads that fail beside a limit to the map's next one above, where Hertz might
    hold again.
    """
    # not the difference of both numbers: of the map's own loads some may not be known
    if len(lost_N) + sum(one.load_N not in own_N for one in known) >= MOST_TRIED:
        return None
    for below, above in pairwise(known):
        if below.answer == above.answer or any(below.load_N < load_N < above.load_N for load_N in lost_N):
            continue
        within = _OPEN_TOLERANCE if "UNRESOLVED" in (below.answer, above.answer) else LOAD_TOLERANCE
        if above.load_N - below.load_N > within * above.load_N:
            return _load_between(below, above, within)
    for number, (before, first) in enumerate(pairwise(known), 1):
        if before.answer == "FAILS" or first.answer != "FAILS" or first.load_N in own_N:
            continue
        failing = [one.load_N for one in takewhile(lambda one: one.answer == "FAILS", known[number:])]
        own = next((place for place, load_N in enumerate(failing) if load_N in own_N), 0)
        if own and not lost_N and (guard := _guard(failing[: own + 1])) is not None:
            return guard
    return None


def _guard(failing_N: Sequence[float]) -> float | None:
    """A load in the widest gap between those that fail from a limit to the map's next load, None if it is narrow.

    A load that came of the search beside the limit is no guard of what lies beyond it.
    """
    gap, low_N = max((above / below, below) for below, above in pairwise(failing_N))
    whole = failing_N[-1] / failing_N[0]
    return low_N * math.sqrt(gap) if gap > max(_GUARD_FROM, whole**_GUARDED) else None


def _load_between(below: KnownLoad, above: KnownLoad, within: float) -> float:
    """A load between two: beside the zero of what makes the verdict change, on the side where more is open."""
    low, high = math.log(below.load_N), math.log(above.load_N)
    answers = {below.answer, above.answer}
    change = "excess" if "UNRESOLVED" not in answers else "least" if "FAILS" in answers else "most"
    ends: list[float] = [getattr(one, change) for one in (below, above)]
    if not math.prod(ends) < 0.0:
        return math.exp(0.5 * (low + high))
    # a second patch that comes at once is beyond its limit by far: a straight line to it would creep
    before, after = (max(-1.0, min(1.0, end)) for end in ends)
    part = before / (before - after)
    root = low + part * (high - low)
    # so that the next load lies on the other side of the limit, and the change between both
    beside = 0.4 * within
    wanted = root - beside if part > 0.5 else root + beside
    room = 0.1 * (high - low)
    return math.exp(min(max(wanted, low + room), high - room))


def load_limit(
    cells: Sequence[MapCell], tried: Sequence[JudgedLoad] = (), *, stopped: MapCell | None = None
) -> LoadLimit:
    """What the loads of one position, by increasing load, say of where Hertz holds.

    Parameters
    ----------
    tried
        Loads solved in addition to the map's loads.
    stopped
        A further load that could not be solved.
    """
    known = known_loads(cells, tried)
    lost = [] if not known else [cell for cell in cells if not cell.usable]
    lost += [] if stopped is None else [stopped]
    statuses = {cell.status for cell in cells}
    notes = [f"{cell.load_N / 1e3:.4g} kN: {cell.status}" for cell in lost]
    unusable = [judged for judged in tried if not judged.usable]
    notes += [f"{judged.load_N / 1e3:.4g} kN: {judged.status}" for judged in unusable]
    return LoadLimit(
        intervals=intervals_of([(one.load_N, one.answer) for one in known]),
        reason=None if known else statuses.pop() if len(statuses) == 1 else "no load could be solved",
        note="; ".join(notes) or None,
        tried=tuple((one.load_N, one.verdict.answer) for one in tried),
        narrowed=stopped is None
        and next_load(known, [cell.load_N for cell in cells], [one.load_N for one in unusable]) is None,
    )


def intervals_of(known: Sequence[tuple[float, Answer]]) -> tuple[LoadInterval, ...]:
    """Intervals between known loads, by increasing load."""
    found = stretches(known, "UNRESOLVED")
    return tuple(LoadInterval(low_N=low_N, high_N=high_N, answer=answer) for low_N, high_N, answer in found)


def stretches(known: Sequence[tuple[float, _Word]], between: _Word) -> list[tuple[float, float, _Word]]:
    """Stretches of loads with one word each, from known loads by increasing load.

    Between two loads with one word it is theirs; between others it is the word `between`.
    """
    found: list[tuple[float, float, _Word]] = []

    def add(low_N: float, high_N: float, word: _Word) -> None:
        if found and found[-1][2] == word:
            low_N = found.pop()[0]
        found.append((low_N, high_N, word))

    for number, (load_N, word) in enumerate(known):
        if number and known[number - 1][1] != word:
            add(known[number - 1][0], load_N, between)
        add(found[-1][1] if found else load_N, load_N, word)
    return found
