"""At which loads Hertz holds at one position: what is known, and which load to solve next to know it better.

Nothing is assumed of how the verdict changes over the load: a second lobe may come and be swallowed again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, takewhile
from typing import TypeVar

from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.verdict import Answer
from fecontact.map.cells import LoadInterval, LoadLimit, MapCell

_Word = TypeVar("_Word", bound=str)
# The loads on both sides of a limit are brought together to this part of the load; those where an open verdict begins
# or ends to the second, which follows from the uncertainty and not from the contact.
LOAD_TOLERANCE = 0.02
_OPEN_TOLERANCE = 0.05
# Solved loads at most, beside the map's own.
_MOST_TRIED = 14
# A load beyond a limit is tried where the next one is farther away than this.
_GUARD_FROM = 1.1
# Loads on the way guard it if no gap between them is more than this part of the whole, in logarithms.
_GUARDED = 0.75


@dataclass(frozen=True, kw_only=True)
class KnownLoad:
    """Verdict at a load; `excess` is by how much the measure that uses most of its limit is beyond it, in limits."""

    load_N: float
    answer: Answer
    excess: float

    @classmethod
    def of(cls, judged: JudgedLoad) -> KnownLoad:
        """The worst side of a judged load."""
        return cls(load_N=judged.load_N, answer=judged.verdict.answer, excess=judged.limit_used - 1.0)


def known_loads(cells: Sequence[MapCell], tried: Sequence[JudgedLoad] = ()) -> tuple[KnownLoad, ...]:
    """The loads of a position that may be used, by increasing load."""
    found = [KnownLoad.of(judged) for judged in tried if judged.usable]
    found += [KnownLoad.of(cell.usable) for cell in cells if cell.usable]
    return tuple(sorted(found, key=lambda known: known.load_N))


def next_load(known: Sequence[KnownLoad], own_N: Sequence[float]) -> float | None:
    """The load (N) to solve next, None where every change of the verdict is known well, or enough loads were tried.

    Parameters
    ----------
    known
        By increasing load.
    own_N
        The loads that the map asks for.

    Notes
    -----
    Between two loads whose verdicts differ, where the excess of a straight line between them is zero; then, as a
    guard, half way from the loads that fail beside a limit to the map's next one above, where Hertz might hold again.
    """
    # not the difference of both numbers: of the map's own loads some may not be known
    if sum(one.load_N not in own_N for one in known) >= _MOST_TRIED:
        return None
    for below, above in pairwise(known):
        if below.answer == above.answer:
            continue
        limit = "UNRESOLVED" not in (below.answer, above.answer)
        if above.load_N - below.load_N > (LOAD_TOLERANCE if limit else _OPEN_TOLERANCE) * above.load_N:
            return _between(below, above)
    for number, (before, first) in enumerate(pairwise(known), 1):
        if before.answer == "FAILS" or first.answer != "FAILS" or first.load_N in own_N:
            continue
        failing = [one.load_N for one in takewhile(lambda one: one.answer == "FAILS", known[number:])]
        own = next((place for place, load_N in enumerate(failing) if load_N in own_N), 0)
        if own and (guard := _guard(failing[: own + 1])) is not None:
            return guard
    return None


def _guard(failing_N: Sequence[float]) -> float | None:
    """A load in the widest gap between those that fail from a limit to the map's next load, None if it is narrow.

    A load that came of the search beside the limit is no guard of what lies beyond it.
    """
    gap, low_N = max((above / below, below) for below, above in pairwise(failing_N))
    whole = failing_N[-1] / failing_N[0]
    return low_N * math.sqrt(gap) if gap > max(_GUARD_FROM, whole**_GUARDED) else None


def _between(below: KnownLoad, above: KnownLoad) -> float:
    """A load between two: beside the zero of the excess, on the side where more is open."""
    low, high = math.log(below.load_N), math.log(above.load_N)
    part = 0.5
    if below.excess * above.excess < 0.0:
        part = below.excess / (below.excess - above.excess)
    root = low + part * (high - low)
    # so that the next load lies on the other side of the limit, and the change between both
    beside = 0.4 * LOAD_TOLERANCE
    wanted = root - beside if root - low > high - root else root + beside
    room = 0.1 * (high - low)
    return math.exp(min(max(wanted, low + room), high - room))


def load_limit(
    cells: Sequence[MapCell], tried: Sequence[JudgedLoad] = (), *, stopped: MapCell | None = None
) -> LoadLimit:
    """What the loads of one position, by increasing load, say of where Hertz holds.

    Parameters
    ----------
    tried
        Loads solved beside those of the map.
    stopped
        A further load that could not be solved.
    """
    known = known_loads(cells, tried)
    lost = [] if not known else [cell for cell in cells if not cell.usable]
    lost += [] if stopped is None else [stopped]
    notes = [f"{cell.load_N / 1e3:.4g} kN: {cell.status}" for cell in lost]
    unusable = [judged for judged in tried if not judged.usable]
    notes += [f"{judged.load_N / 1e3:.4g} kN: {judged.status}" for judged in unusable]
    return LoadLimit(
        intervals=intervals_of([(one.load_N, one.answer) for one in known]),
        reason=None if known else _without_any(cells),
        note="; ".join(notes) or None,
        tried=tuple((one.load_N, one.verdict.answer) for one in tried),
        # another attempt would end in the same unusable result
        narrowed=stopped is None and (bool(unusable) or next_load(known, [cell.load_N for cell in cells]) is None),
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


def _without_any(cells: Sequence[MapCell]) -> str:
    statuses: Mapping[str, None] = dict.fromkeys(cell.status for cell in cells)
    return "no load could be solved" if len(statuses) != 1 else next(iter(statuses))
