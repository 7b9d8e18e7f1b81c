"""The load up to which Hertz holds at one position, by bisection between the loads of a map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

from fecontact.case import Criteria
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.verdict import Answer
from fecontact.errors import FecontactError, InputError
from fecontact.map.cells import LoadLimit, MapCell

# The load limit is bisected until its bracket is this part of the load.
LOAD_TOLERANCE = 0.02

Between = Callable[[float, float], JudgedLoad]
"""Gives a load between two others (N), best half way."""


def load_limit(
    criteria: Criteria, cells: Sequence[MapCell], between: Between, *, tolerance: float = LOAD_TOLERANCE
) -> LoadLimit:
    """The load up to which Hertz holds, bisected between the last load that holds and the first that fails.

    Parameters
    ----------
    criteria
        They decide about unresolved loads.
    cells
        One position by increasing load.
    between
        Solves, or finds, a further load.
    """
    decided = [(c.load_N, c.verdict) for c in cells if c.verdict in ("HOLDS", "FAILS")]
    verdicts = [verdict for _, verdict in decided]
    changes = [k for k in range(1, len(decided)) if verdicts[k - 1 : k + 1] == ["HOLDS", "FAILS"]]
    note = _not_monotone(decided)
    if not changes:
        return LoadLimit(reason=without_bracket(cells, verdicts), note=note)
    low, high = decided[changes[0] - 1][0], decided[changes[0]][0]
    return _bisect(criteria, (low, high), between, tolerance, note)


def among(loads: Sequence[JudgedLoad], stopped: MapCell | None = None) -> Between:
    """Further loads among those that were solved already; `stopped` is the one that could not be."""

    def between(low: float, high: float) -> JudgedLoad:
        inside = [load for load in loads if low < load.load_N < high]
        if not inside and stopped is not None and stopped.load_N == 0.5 * (low + high):
            raise InputError(stopped.status.removeprefix("failed: "))
        if not inside:
            raise InputError(
                f"none was solved between {low / 1e3:.1f} and {high / 1e3:.1f} kN; solve the map with these criteria"
            )
        return min(inside, key=lambda load: abs(load.load_N - 0.5 * (low + high)))

    return between


def without_bracket(cells: Sequence[MapCell], verdicts: Sequence[str]) -> str:
    """Why there is no load limit, where no load that fails follows one that holds."""
    if not verdicts:
        usable = any(cell.status in ("converged", "inferred") for cell in cells)
        return "unresolved at all loads" if usable else "no load could be solved"
    if "FAILS" in verdicts and "HOLDS" in verdicts:
        return "fails at small loads and holds above"
    rest = "" if len(verdicts) == len(cells) else " that are resolved"
    return f"holds at all loads{rest}" if "HOLDS" in verdicts else f"fails at all loads{rest}"


def _not_monotone(decided: Sequence[tuple[float, str]]) -> str | None:
    """Where Hertz holds again above a load at which it fails."""
    again = [
        f"fails at {low / 1e3:g} kN but holds at {high / 1e3:g} kN"
        for (low, before), (high, after) in pairwise(decided)
        if (before, after) == ("FAILS", "HOLDS")
    ]
    return f"not monotone: {', '.join(again)}" if again else None


def _bisect(
    criteria: Criteria, bracket: tuple[float, float], between: Between, tolerance: float, note: str | None
) -> LoadLimit:
    low, high = bracket
    tried: list[tuple[float, Answer]] = []
    notes = [note] if note else []
    narrowed = True
    while high - low > tolerance * high:
        try:
            found = between(low, high)
        except FecontactError as error:
            notes.append(f"bisection stopped at {0.5e-3 * (low + high):.1f} kN: {error}")
            narrowed = False
            break
        if found.status != "converged":
            notes.append(f"bisection stopped at {found.load_N / 1e3:.1f} kN: {found.status}")
            break
        answer = found.verdict.answer
        tried.append((found.load_N, answer))
        if answer == "HOLDS" or (answer == "UNRESOLVED" and _within(criteria, found)):
            low = found.load_N
        else:
            high = found.load_N
    # a verdict beyond doubt next to the limit, not one that a later step has passed
    holds = max([bracket[0], *(load for load, answer in tried if answer == "HOLDS" and load <= low)])
    fails = min([bracket[1], *(load for load, answer in tried if answer == "FAILS" and load >= high)])
    if any(answer == "UNRESOLVED" for _, answer in tried):
        notes.append(f"unresolved between {holds / 1e3:.1f} and {fails / 1e3:.1f} kN")
    return LoadLimit(
        F_max_N=low,
        holds_N=holds,
        fails_N=fails,
        note="; ".join(notes) or None,
        tried=tuple(tried),
        narrowed=narrowed,
    )


def _within(criteria: Criteria, load: JudgedLoad) -> bool:
    return all(abs(load.deviation[name]) <= limit for name, limit in criteria.limits.items())
