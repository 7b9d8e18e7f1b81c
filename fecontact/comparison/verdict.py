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
        Why Hertz is off where he is, by more than a limit; `profile` where the measured profile leaves it open.
    unknown
        Measures that the result does not tell.
    """

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


@dataclass(frozen=True, kw_only=True)
class PatchGeometry:
    """What the profiles do below the finite-element patch.

    Attributes
    ----------
    junction_distance_mm
        From the touch point to the next curvature junction of either profile, inf without one.
    junction_distance_over_b
        The same over Hertz's semi-axis on that side.
    junction_in_patch
        Whether the patch covers a junction.
    curvature_variation
        (Largest - smallest) over the value at the touch point of the relative lateral curvature below the patch.
    normal_turn_rad
        How far the rail's normal turns below the patch: the measure of conformity.
    lobes, pieces
        Lobes of the pressure, and separate patches.
    """

    junction_distance_mm: float
    junction_distance_over_b: float
    junction_in_patch: bool
    curvature_variation: float
    normal_turn_rad: float
    lobes: int
    pieces: int


# Above this turn of the normals below the patch the surfaces are called conforming: a flat half-space is off by about
# the square of half of it, 2 % here.
_CONFORMING_RAD = 0.3


AT_JUNCTION = "curvature undefined at the touch point"
"""Cause where the touch point lies at a curvature junction, whatever the ladder says."""


PROFILE = "profile"
"""Cause where the verdict is open because the measured profile is not known better."""


def cause_of(steps: Mapping[str, Mapping[str, float]], measure: str, geometry: PatchGeometry) -> str:
    """Why Hertz is off in a measure, from the step of the ladder that moved it most and from the geometry."""
    # the load on a second patch jumps to nothing where the two just touch, on one rung or the other; whether there are
    # two at all is told by the valley between them
    told_by = "valley" if measure == "separate_load" else measure
    gap_step = abs(steps["quadratic_to_true_gap"][told_by])
    body_step = abs(steps["half_space_to_bodies"][told_by])
    if body_step > gap_step:
        return "finite bodies"
    if geometry.pieces > 1:
        return "second patch"
    if geometry.lobes > 1:
        return "second lobe"
    if geometry.junction_in_patch:
        return "curvature change within the patch"
    if geometry.normal_turn_rad > _CONFORMING_RAD:
        return "conformity"
    return "curvature varies over the patch"
