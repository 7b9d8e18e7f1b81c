"""Creep force as a measure: its deviation relative to mu N over a range of creepages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fecontact.contact_theories.rolling.creepage import (
    Creepages,
)
from fecontact.judging.verdict import FROM_BEST, Judgement, Verdict, answer_of

FORCE = "force"
"""The measure of a law of creep forces."""


@dataclass(frozen=True, kw_only=True)
class ForceAt:
    """By how much of mu N a force is off at creepages of the first touch point, and how well that is known."""

    creepages: Creepages
    deviation_of_muN: float
    uncertainty_of_muN: float


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedForce(Judgement):
    """A law by its force, with the creepages at which the exact theory decided, the worst one first."""

    decided: tuple[ForceAt, ...]


def judged_force(decided: Sequence[ForceAt], limit: float, *, usable: bool = True) -> JudgedForce:
    """A creep law by the worst answer of some creepages; a result that must not be used leaves it open."""
    each = [(answer_of(at.deviation_of_muN, at.uncertainty_of_muN, limit), at) for at in decided]
    each.sort(key=lambda one: (FROM_BEST.index(one[0]), one[1].deviation_of_muN), reverse=True)
    answer, worst = each[0]
    return JudgedForce(
        deviation={FORCE: worst.deviation_of_muN},
        uncertainty={FORCE: worst.uncertainty_of_muN},
        limits={FORCE: limit},
        verdict=Verdict(answer=answer, measure=FORCE, each={FORCE: answer}).usable(usable),
        decided=tuple(at for _, at in each),
    )
