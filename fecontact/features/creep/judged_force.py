"""Creep force as a measure: its deviation relative to mu N over a range of creepages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fecontact.contact_theories.rolling.creepage import (
    Creepages,
)
from fecontact.judging.verdict import ANSWERS_BEST_FIRST, Judgement, Verdict, compare_with_limit

FORCE_MEASURE = "force"
"""Name of the measure of a law of creep forces."""


@dataclass(frozen=True, kw_only=True)
class ForceDeviation:
    """Deviation of a force at creepages of the first contact point, with its uncertainty.

    Attributes
    ----------
    creepages
        Creepages at the first contact point.
    deviation_of_muN, uncertainty_of_muN
        Size of the difference of forces and its uncertainty, over mu N; NaN if there is no value.
    """

    creepages: Creepages
    deviation_of_muN: float
    uncertainty_of_muN: float


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceJudgement(Judgement):
    """Judgement of a law by its force.

    Attributes
    ----------
    decided
        Deviations at the creepages where the exact theory decided, the worst first.
    """

    decided: tuple[ForceDeviation, ...]


def judge_force(decided: Sequence[ForceDeviation], limit: float, *, usable: bool = True) -> ForceJudgement:
    """Judge a creep law by its worst answer over some creepages.

    Parameters
    ----------
    decided
        Deviations of the force at each of the creepages.
    limit
        Largest deviation, over mu N, at which the law holds.
    usable
        Whether the result may be used; otherwise the verdict stays unresolved.

    Returns
    -------
    ForceJudgement
        Verdict, deviation and uncertainty over mu N by `FORCE_MEASURE`, and all deviations from the worst to the best.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import Creepages
    >>> from fecontact.features.creep.judged_force import ForceDeviation, judge_force
    >>> deviation = ForceDeviation(creepages=Creepages(xi=1e-3), deviation_of_muN=0.08, uncertainty_of_muN=0.01)
    >>> judge_force([deviation], 0.05).verdict.answer
    'FAILS'
    """
    answers = [
        (compare_with_limit(deviation.deviation_of_muN, deviation.uncertainty_of_muN, limit), deviation)
        for deviation in decided
    ]
    answers.sort(
        key=lambda answered: (ANSWERS_BEST_FIRST.index(answered[0]), answered[1].deviation_of_muN), reverse=True
    )
    answer, worst = answers[0]
    return ForceJudgement(
        deviation={FORCE_MEASURE: worst.deviation_of_muN},
        uncertainty={FORCE_MEASURE: worst.uncertainty_of_muN},
        limits={FORCE_MEASURE: limit},
        verdict=Verdict(answer=answer, measure=FORCE_MEASURE, each={FORCE_MEASURE: answer}).usable(usable),
        decided=tuple(deviation for _, deviation in answers),
    )
