"""Verdict: does Hertz hold here, by which measure, why not, and how sure is that?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from fecontact.case import Criteria

Answer = Literal["HOLDS", "FAILS", "UNRESOLVED"]


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Whether Hertz holds, the measure that decided, and why he does not where he is off by more than a limit."""

    answer: Answer
    measure: str
    cause: str | None = None


def judge(deviation: Mapping[str, float], uncertainty: Mapping[str, float], criteria: Criteria) -> Verdict:
    """Compare deviations with their limits.

    FAILS if any measure is beyond its limit by more than its uncertainty; otherwise UNRESOLVED if a limit lies within
    the uncertainty of any measure, or a measure is not a number; otherwise HOLDS. The measure named is the one furthest
    beyond its limit (FAILS), the one with the largest uncertainty for its limit (UNRESOLVED), or the one that uses most
    of its limit (HOLDS).
    """
    limits = criteria.limits
    used = {name: abs(deviation[name]) / limit for name, limit in limits.items()}
    fails = [m for m, limit in limits.items() if abs(deviation[m]) - uncertainty[m] > limit]
    if fails:
        return Verdict(answer="FAILS", measure=max(fails, key=lambda m: used[m]))
    open_ = [m for m, limit in limits.items() if not abs(deviation[m]) + uncertainty[m] < limit]
    if open_:
        unsure = {m: uncertainty[m] / limits[m] for m in open_}
        return Verdict(
            answer="UNRESOLVED", measure=max(open_, key=lambda m: math.inf if math.isnan(unsure[m]) else unsure[m])
        )
    return Verdict(answer="HOLDS", measure=max(used, key=lambda m: used[m]))


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
    pieces
        Separate patches.
    """

    junction_distance_mm: float
    junction_distance_over_b: float
    junction_in_patch: bool
    curvature_variation: float
    normal_turn_rad: float
    pieces: int


# Above this turn of the normals below the patch the surfaces are called conforming: a flat half-space is off by about
# the square of half of it, 2 % here.
_CONFORMING_RAD = 0.3


AT_JUNCTION = "curvature undefined at the touch point"
"""Cause where the touch point lies at a curvature junction, whatever the ladder says."""


def cause_of(steps: Mapping[str, Mapping[str, float]], measure: str, geometry: PatchGeometry) -> str:
    """Why Hertz is off in a measure, from the step of the ladder that moved it most and from the geometry."""
    gap_step = abs(steps["quadratic_to_true_gap"][measure])
    body_step = abs(steps["half_space_to_bodies"][measure])
    if body_step > gap_step:
        return "finite bodies"
    if geometry.pieces > 1:
        return "second patch"
    if geometry.junction_in_patch:
        return "curvature change within the patch"
    if geometry.normal_turn_rad > _CONFORMING_RAD:
        return "conformity"
    return "curvature varies over the patch"
