"""A judged theory as a value: how far it is off the finite elements, how sure that is, and its verdict.

A theory of the pressure is judged by its measures; a law of creep forces by one of its own, over a range of creepages.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from fecontact.comparison.approximation import Approximation
from fecontact.comparison.measures import Measures, measures_of_theory
from fecontact.comparison.verdict import FROM_BEST, Answer, Verdict, answer_of
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
class Standing:
    """Whether a theory holds by its numbers, and what it says of the contact; without a name where none stands."""

    name: str = ""
    answer: Answer = "FAILS"
    made: Approximation | None = None

    @property
    def out_of_range(self) -> bool:
        """Whether the theory is out of its own range; a law of creep forces has none."""
        return self.made is not None and self.made.status == "out of range"

    @property
    def label(self) -> str:
        """The name of a theory that holds, UNRESOLVED where that is open, `none` where all fail."""
        return {"HOLDS": self.name, "FAILS": "none"}.get(self.answer, self.answer)


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


def standings(judged: Mapping[str, Judgement]) -> list[Standing]:
    """How judged theories stand, in their order."""
    return [Standing(name=name, answer=one.verdict.answer, made=one.approximation) for name, one in judged.items()]


def cheapest(theories: Iterable[Standing], *, in_range: bool = False) -> Standing:
    """The first theory by cost that does not fail; where it is open whether that one holds, so is the answer.

    A theory holds by its numbers. With `in_range` it must be in its own range too.
    """
    left = (one for one in theories if one.answer != "FAILS" and not (in_range and one.out_of_range))
    return next(left, Standing())
