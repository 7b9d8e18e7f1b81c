"""A judged theory as a value: how far it is off the finite elements, how sure that is, and its verdict.

A theory of the pressure is judged by its measures; a law of creep forces by one of its own, over a range of creepages.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fecontact.comparison.approximation import Approximation
from fecontact.comparison.measures import Measures, measures_of_theory
from fecontact.comparison.verdict import FROM_BEST, Verdict, answer_of
from fecontact.theory.creep.contact import Creepages
from fecontact.theory.hertz import HertzContact

FORCE = "force"
"""The measure of a creep law: its force, off by so much of mu N."""


@dataclass(frozen=True, kw_only=True)
class ForceAt:
    """By how much of mu N a force is off at creepages of the first touch point, and how well that is known."""

    creepages: Creepages
    deviation: float
    uncertainty: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """A theory of the contact against the finite elements.

    Attributes
    ----------
    deviation
        (Theory - FE) / FE of each of `MEASURES`, and the `MISFITS`; of a creep law that of the `FORCE`.
    uncertainty
        Of the deviations, of those where it is known.
    limits
        Of the measures that decide.
    approximation
        What a theory of the pressure says.
    decided
        Creepages at which the exact theory decided about a creep law, the worst one first.
    """

    deviation: Mapping[str, float]
    uncertainty: Mapping[str, float]
    limits: Mapping[str, float]
    verdict: Verdict
    approximation: Approximation | None = None
    decided: tuple[ForceAt, ...] = ()

    @property
    def measures(self) -> Measures:
        """The own measures of a theory of the pressure."""
        assert self.approximation is not None
        return measures_of_theory(self.approximation)

    @property
    def hertz(self) -> HertzContact:
        """The ellipse of a theory that has a single one."""
        assert self.approximation is not None
        assert self.approximation.single is not None
        ellipse = self.approximation.single.hertz
        assert ellipse is not None
        return ellipse

    @property
    def limit_used(self) -> float:
        """By how much the measure that uses most of its limit does so; the theory is off from 1 on."""
        used = [abs(self.deviation[name]) / limit for name, limit in self.limits.items()]
        return math.nan if any(math.isnan(part) for part in used) else max(used)


def judged_force(decided: Sequence[ForceAt], limit: float, *, usable: bool = True) -> Judgement:
    """A creep law by the worst answer of some creepages; a result that must not be used leaves it open."""
    each = [(answer_of(at.deviation, at.uncertainty, limit), at) for at in decided]
    each.sort(key=lambda one: (FROM_BEST.index(one[0]), one[1].deviation), reverse=True)
    answer, worst = each[0]
    return Judgement(
        deviation={FORCE: worst.deviation},
        uncertainty={FORCE: worst.uncertainty},
        limits={FORCE: limit},
        verdict=Verdict(answer=answer, measure=FORCE, each={FORCE: answer}).usable(usable),
        decided=tuple(at for _, at in each),
    )


def worst_judgement(judged: Mapping[str, Judgement]) -> Judgement:
    """The worst of both sides, that of the field side where both are the same."""
    return max(reversed([*judged.values()]), key=lambda one: FROM_BEST.index(one.verdict.answer))


def worst_of(judged: Mapping[str, Judgement]) -> Verdict:
    """The worst verdict of both sides, that of the field side where both are the same."""
    return worst_judgement(judged).verdict


def first_standing(judged: Mapping[str, Judgement]) -> str | None:
    """The cheapest of theories by cost that does not fail; its answer may be open."""
    return next((name for name, one in judged.items() if one.verdict.answer != "FAILS"), None)


def cheapest(judged: Mapping[str, Judgement]) -> str | None:
    """The cheapest of theories by cost that holds; None where a cheaper one is open, or none does."""
    first = first_standing(judged)
    return first if first is not None and judged[first].verdict.answer == "HOLDS" else None
