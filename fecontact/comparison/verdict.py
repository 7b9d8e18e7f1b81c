"""Verdict: does Hertz hold here, by which measure, why not, and how sure is that?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from fecontact.criteria import Criteria

Answer = Literal["HOLDS", "FAILS", "UNRESOLVED"]
FROM_BEST: tuple[Answer, ...] = ("HOLDS", "UNRESOLVED", "FAILS")
"""Answers from the best to the worst."""


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Whether Hertz holds, and what decided it.

    Attributes
    ----------
    answer
        The worst of `each`.
    measure
        The measure that decided: the one furthest beyond its limit (FAILS), with the largest uncertainty for its limit
        (UNRESOLVED), or using most of its limit (HOLDS).
    each
        The answer of every measure that is judged.
    cause
        Why Hertz is off where it is, by more than a limit; `profile` where the measured profile leaves it open.
    unknown
        Measures that the result does not tell.
    """

    TELLS = ("answer", "measure", "each", "failing", "cause", "unknown")

    answer: Answer
    measure: str
    each: Mapping[str, Answer]
    cause: str | None = None
    unknown: tuple[str, ...] = ()

    @property
    def failing(self) -> tuple[str, ...]:
        """The measures that fail."""
        return tuple(measure for measure, answer in self.each.items() if answer == "FAILS")

    def usable(self, converged: bool) -> Verdict:
        """The verdict on a result: one that must not be used leaves it open."""
        return self if converged else replace(self, answer="UNRESOLVED")


def judge(deviation: Mapping[str, float], uncertainty: Mapping[str, float], criteria: Criteria) -> Verdict:
    """Compare deviations with their limits.

    A measure FAILS if it is beyond its limit by more than its uncertainty, HOLDS if it is within by more than that, and
    is UNRESOLVED otherwise, or where the result does not tell it. Hertz fails if a measure does, and holds if all do.
    """
    limits = criteria.limits
    unknown = tuple(measure for measure in limits if measure not in deviation or measure not in uncertainty)
    each = {
        measure: "UNRESOLVED" if measure in unknown else answer_of(deviation[measure], uncertainty[measure], limit)
        for measure, limit in limits.items()
    }
    worst = max(each.values(), key=FROM_BEST.index)

    def weight(measure: str) -> float:
        if measure in unknown or math.isnan(uncertainty[measure]) or math.isnan(deviation[measure]):
            return math.inf
        of = uncertainty[measure] if worst == "UNRESOLVED" else abs(deviation[measure])
        return of / limits[measure]

    decided = max((measure for measure, answer in each.items() if answer == worst), key=weight)
    return Verdict(answer=worst, measure=decided, each=each, unknown=unknown)


def answer_of(deviation: float, uncertainty: float, limit: float) -> Answer:
    """Whether a deviation is within its limit, whatever it is inside its uncertainty."""
    if abs(deviation) - uncertainty > limit:
        return "FAILS"
    # not the other way round: what is not a number does not hold
    return "HOLDS" if abs(deviation) + uncertainty < limit else "UNRESOLVED"


AT_JUNCTION = "curvature undefined at the touch point"
"""Cause where the touch point lies at a curvature junction, whatever the ladder says."""


PROFILE = "profile"
"""Cause where the verdict is open because the measured profile is not known better."""


ELEMENTS = "elements"
"""Cause where the verdict is open because the finite elements do not answer as their material does."""
