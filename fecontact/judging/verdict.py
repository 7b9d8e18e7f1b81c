"""Verdicts on theories of the contact: answer, deciding measure, cause and uncertainty."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from fecontact.contact.grid import Rung
from fecontact.contact_theories.approximation import TheoryContact
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.registry import HERTZ_GAUGE
from fecontact.contact_theories.touch_hertz import Side
from fecontact.criteria import Criteria
from fecontact.judging.causes import PatchGeometry, find_cause
from fecontact.judging.ladder import LADDER_STEPS, PLASTIC_STEP, Ladder
from fecontact.judging.lines import NO_SHIFTS, VariantShifts, find_open_cause, is_judged
from fecontact.judging.measures import (
    MEASURES,
    Measures,
    compute_deviations,
    is_relative,
    read_measures,
    read_theory_measures,
    read_values,
)
from fecontact.judging.own_measures import NO_OWN_MEASURES, OwnMeasures
from fecontact.judging.solved_load import Level, SolvedLoad
from fecontact.judging.uncertainty_budget import UncertaintyBudget
from fecontact.judging.yielded import YIELD_STRESS_SPREAD, PlasticResult

Answer = Literal["HOLDS", "FAILS", "UNRESOLVED"]
ANSWERS_BEST_FIRST: tuple[Answer, ...] = ("HOLDS", "UNRESOLVED", "FAILS")
"""Answers from the best to the worst."""


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Answer for a theory, with the deciding measure and the cause.

    Attributes
    ----------
    answer
        Worst answer of all judged measures. With profile variants: the answer of at least 95 % of the variants, and
        UNRESOLVED if no answer is that frequent.
    measure
        Name of the deciding measure. For HOLDS and FAILS it has the largest deviation as a fraction of its limit; for
        UNRESOLVED it has the largest uncertainty as a fraction of its limit.
    each
        Answer of each judged measure, by its name.
    cause
        Reason for a deviation beyond its limit, or `PROFILE_CAUSE`, or `ELEMENTS_CAUSE`; None without a reason.
    unknown
        Names of the judged measures without a deviation or without an uncertainty.
    variant_answers
        Answer on each profile variant, by its label; empty for an exact profile.
    """

    TELLS = ("answer", "measure", "each", "failing", "cause", "open_because", "unknown", "variant_answers")

    answer: Answer
    measure: str
    each: Mapping[str, Answer]
    cause: str | None = None
    unknown: tuple[str, ...] = ()
    variant_answers: Mapping[str, Answer] = field(default_factory=dict)

    @property
    def failing(self) -> tuple[str, ...]:
        """Names of the measures that fail."""
        return tuple(measure for measure, answer in self.each.items() if answer == "FAILS")

    @property
    def open_because(self) -> str | None:
        """Name in `OPEN_CAUSES` of the cause of UNRESOLVED; else None."""
        if self.answer != "UNRESOLVED":
            return None
        if self.cause == ELEMENTS_CAUSE or "UNRESOLVED" not in {*self.each.values(), *self.variant_answers.values()}:
            # the measures are decided, but the numbers must not be used
            return "solution" if len({*self.variant_answers.values()}) <= 1 else find_open_cause(self.variant_answers)
        cause = find_open_cause(self.variant_answers)
        is_profile_undecided = cause == "mesh" and self.cause == PROFILE_CAUSE
        return "filter" if is_profile_undecided and len(self.variant_answers) > 1 else cause

    def usable(self, is_usable: bool) -> Verdict:
        """Verdict of a usable result; UNRESOLVED for an unusable result.

        Parameters
        ----------
        is_usable
            Whether the numbers of the result may be used.

        Returns
        -------
        Verdict
            The verdict, or the verdict UNRESOLVED.
        """
        return self if is_usable else replace(self, answer="UNRESOLVED")


def judge(deviation: Mapping[str, float], uncertainty: Mapping[str, float], criteria: Criteria) -> Verdict:
    """Compare deviations with their limits.

    The answer for each measure is that of `compare_with_limit`, and UNRESOLVED if the measure has no deviation or no
    uncertainty. A theory FAILS if at least one measure FAILS, and HOLDS if every measure HOLDS.

    Parameters
    ----------
    deviation, uncertainty
        Deviation of the theory from the finite elements and its uncertainty (-), by the name of the measure: relative
        for each of `MEASURES`, absolute for each of `MISFITS`.
    criteria
        Limits of the judged measures.

    Returns
    -------
    Verdict
        Without a cause, and without answers on profile variants. Use `judge_profile_variants` for a measured profile.

    Examples
    --------
    >>> from fecontact.criteria import Criteria
    >>> from fecontact.judging.verdict import judge
    >>> judge({"p_max_MPa": -0.08}, {"p_max_MPa": 0.01}, Criteria(judged_by=("strength",))).answer
    'FAILS'
    """
    limits = criteria.limits
    missing_measures = tuple(measure for measure in limits if measure not in deviation or measure not in uncertainty)
    answers = {
        measure: "UNRESOLVED"
        if measure in missing_measures
        else compare_with_limit(deviation[measure], uncertainty[measure], limit)
        for measure, limit in limits.items()
    }
    worst_answer = max(answers.values(), key=ANSWERS_BEST_FIRST.index)

    def rank_measure(measure: str) -> float:
        """Uncertainty or deviation of a measure as a fraction of its limit."""
        if measure in missing_measures or math.isnan(uncertainty[measure]) or math.isnan(deviation[measure]):
            return math.inf
        magnitude = uncertainty[measure] if worst_answer == "UNRESOLVED" else abs(deviation[measure])
        return magnitude / limits[measure]

    deciding_measure = max((measure for measure, answer in answers.items() if answer == worst_answer), key=rank_measure)
    return Verdict(answer=worst_answer, measure=deciding_measure, each=answers, unknown=missing_measures)


# A theory HOLDS or FAILS if it does so on at least this fraction of the profile variants.
_DECIDING_FRACTION = 0.95


def judge_profile_variants(
    deviation: Mapping[str, float], uncertainty: Mapping[str, float], shifts: VariantShifts, criteria: Criteria
) -> tuple[Verdict, dict[str, float]]:
    """Judge a theory on every profile variant.

    A profile variant is a smoothed profile that is consistent with the measured points. A variant with other patches is
    judged by its contact on the half-space; its uncertainty includes the step to the finite elements on the reference
    variant.

    Parameters
    ----------
    deviation, uncertainty
        Deviation on the reference variant and its numerical uncertainty (-), by the name of the measure, as in `judge`.
    shifts
        Shift of each deviation from the reference variant to each profile variant; `NO_SHIFTS` for an exact profile.
    criteria
        Limits of the judged measures.

    Returns
    -------
    verdict : Verdict
        Answer of at least 95 % of the variants, for the theory and for each measure, else UNRESOLVED. A variant without
        this contact is UNRESOLVED. A variant with a shorter filter than known noise asks for does not count. The
        deciding measure has the answer of the theory; for FAILS it is the measure that FAILS on most variants.
    uncertainty : dict of str to float
        Numerical uncertainty plus the largest shift of the deviation (-). It covers every combination of filter length
        and noise sample, over the variants with this contact.
    """
    reference_verdict, stated_uncertainty = judge(deviation, uncertainty, criteria), dict(uncertainty)
    if not shifts.by_line:
        return reference_verdict, stated_uncertainty
    variant_deviations = shifts.deviations(deviation)
    variant_verdicts = {}
    for label, variant_deviation in variant_deviations.items():
        if not is_judged(label):
            continue
        # A relative deviation is theory / finite elements - 1. The uncertainty of the finite elements changes the
        # deviation in proportion to theory / finite elements, which is 1 + deviation.
        variant_uncertainty = {
            name: value * abs((1.0 + variant_deviation[name]) / (1.0 + deviation[name])) if is_relative(name) else value
            for name, value in uncertainty.items()
        }
        step = shifts.step_uncertainty(label, deviation)
        variant_verdicts[label] = judge(
            variant_deviation, {name: value + step[name] for name, value in variant_uncertainty.items()}, criteria
        )
    for name in stated_uncertainty:
        stated_uncertainty[name] += shifts.farthest(name, deviation[name])
    answers = {
        name: _answer_of_most([variant_verdict.each[name] for variant_verdict in variant_verdicts.values()])
        for name in reference_verdict.each
    }
    common_answer = _answer_of_most([variant_verdict.answer for variant_verdict in variant_verdicts.values()])

    def rank_measure(measure: str) -> tuple[bool, int, float]:
        """Sort key: answer, number of variants with the answer, and fraction of the limit."""
        count = sum(variant_verdict.each[measure] == common_answer for variant_verdict in variant_verdicts.values())
        magnitude = (
            stated_uncertainty.get(measure, math.inf)
            if common_answer == "UNRESOLVED"
            else abs(deviation.get(measure, math.inf))
        )
        fraction = magnitude / criteria.limits[measure]
        return (
            answers[measure] == common_answer,
            count if common_answer == "FAILS" else 0,
            math.inf if math.isnan(fraction) else fraction,
        )

    verdict = replace(
        reference_verdict,
        answer=common_answer,
        measure=max(answers, key=rank_measure),
        each=answers,
        variant_answers={label: variant_verdict.answer for label, variant_verdict in variant_verdicts.items()},
    )
    return verdict, stated_uncertainty


def _answer_of_most(answers: Sequence[Answer]) -> Answer:
    """Answer of at least 95 % of the profile variants, else UNRESOLVED."""
    resolved: tuple[Answer, ...] = ("HOLDS", "FAILS")
    return next(
        (answer for answer in resolved if answers.count(answer) >= _DECIDING_FRACTION * len(answers)), "UNRESOLVED"
    )


def compare_with_limit(deviation: float, uncertainty: float, limit: float) -> Answer:
    """Compare the deviation of a single measure with its limit.

    Parameters
    ----------
    deviation, uncertainty, limit
        In equal units. The sign of the deviation is ignored.

    Returns
    -------
    Answer
        HOLDS or FAILS if the deviation is below or above the limit by more than the uncertainty, else UNRESOLVED.

    Examples
    --------
    >>> from fecontact.judging.verdict import compare_with_limit
    >>> [compare_with_limit(deviation, 0.01, limit=0.05) for deviation in (0.03, -0.045, 0.08)]
    ['HOLDS', 'UNRESOLVED', 'FAILS']
    """
    if abs(deviation) - uncertainty > limit:
        return "FAILS"
    # Both comparisons are false for NaN, so that a deviation of NaN is UNRESOLVED.
    return "HOLDS" if abs(deviation) + uncertainty < limit else "UNRESOLVED"


JUNCTION_CAUSE = "curvature undefined at the contact point"
"""Cause of a verdict at a contact point on a curvature junction, independent of the ladder."""


PROFILE_CAUSE = "profile"
"""Cause of an UNRESOLVED verdict: the measured profile is not accurate enough."""


ELEMENTS_CAUSE = "elements"
"""Cause of an UNRESOLVED verdict: the finite elements behave differently from their material."""


# --- Judgement: a theory compared with the finite elements, with deviations, uncertainties and verdict.


@dataclass(frozen=True, kw_only=True, eq=False)
class TheoryAnswer:
    """Answer for a theory, with the contact that the theory predicts.

    Attributes
    ----------
    name
        Name of the theory; empty if no theory holds.
    answer
        Answer by the numbers of the theory, inside and outside its range of validity.
    made
        Contact by the theory; None for a theory that does not predict the pressure, such as a creep law.
    """

    name: str = ""
    answer: Answer = "FAILS"
    made: TheoryContact | None = None

    @property
    def out_of_range(self) -> bool:
        """Whether the contact is outside the theory's range of validity.

        A theory that does not predict the pressure has no range.
        """
        return self.made is not None and self.made.status == "out of range"

    @property
    def label(self) -> str:
        """Name of a theory that HOLDS, `none` for FAILS, or `UNRESOLVED`."""
        return {"HOLDS": self.name, "FAILS": "none"}.get(self.answer, self.answer)


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """Comparison of a theory with the finite elements.

    Attributes
    ----------
    deviation
        Deviation of the theory (-), by the name of the measure: (theory - FE) / FE for each of `MEASURES`, absolute for
        each of `MISFITS` and for measures of a feature.
    uncertainty
        Uncertainty of each deviation (-); a measure without a stated uncertainty has no entry.
    limits
        Limits of the judged measures (-).
    verdict
        Verdict on the theory.
    approximation
        Contact by the theory; None for a theory that does not predict the pressure.
    numerical, moves
        Contribution of the meshes to the uncertainty (-), and shifts of the deviations over the profile variants.
    budgets
        Contributions to each uncertainty, which add up to it (-); empty for a measure of a feature.
    own_values
        Values of the theory in a user's measures, by name, in their units.
    """

    deviation: Mapping[str, float]
    uncertainty: Mapping[str, float]
    limits: Mapping[str, float]
    verdict: Verdict
    approximation: TheoryContact | None = None
    numerical: Mapping[str, float] = field(default_factory=dict)
    moves: VariantShifts = NO_SHIFTS
    budgets: Mapping[str, UncertaintyBudget] = field(default_factory=dict)
    own_values: Mapping[str, float] = field(default_factory=dict)

    def band(self, p_max_MPa: float) -> tuple[float, float] | None:
        """Smallest and largest peak pressure of all profile variants.

        Parameters
        ----------
        p_max_MPa
            Peak pressure of the finite elements on the reference variant, in MPa.

        Returns
        -------
        tuple of float or None
            Peak pressures in MPa, extended by the numerical uncertainty; None for an exact profile.
        """
        relative_uncertainty = self.numerical["p_max_MPa"] / abs(1.0 + self.deviation["p_max_MPa"])
        return self.moves.band(p_max_MPa, relative_uncertainty)

    @property
    def measures(self) -> Measures:
        """Measures of the contact by the theory.

        Raises
        ------
        AssertionError
            If the theory does not predict the pressure.
        """
        assert self.approximation is not None
        return read_theory_measures(self.approximation)

    @property
    def hertz(self) -> HertzContact:
        """Ellipse of a theory with a single elliptical patch.

        Raises
        ------
        AssertionError
            If the theory predicts several patches, or a patch that is not an ellipse.
        """
        assert self.approximation is not None
        assert self.approximation.single is not None
        ellipse = self.approximation.single.hertz
        assert ellipse is not None
        return ellipse

    @property
    def limit_utilisation(self) -> float:
        """Largest limit utilisation of all judged measures with a deviation (-); above 1 the theory fails."""
        utilisations = [
            abs(self.deviation[name]) / limit for name, limit in self.limits.items() if name in self.deviation
        ]
        return float(np.max(utilisations)) if utilisations else math.nan

    @property
    def limit_range(self) -> tuple[float, float]:
        """Bounds of the largest limit utilisation (-); NaN if a measure has no uncertainty."""
        magnitudes = np.array([abs(self.deviation.get(name, math.nan)) for name in self.limits])
        uncertainties = np.array([self.uncertainty.get(name, math.nan) for name in self.limits])
        limits = np.array([*self.limits.values()])
        return float(np.max((magnitudes - uncertainties) / limits)), float(
            np.max((magnitudes + uncertainties) / limits)
        )


def select_worst_judgement(judgements: Mapping[str, Judgement] | Mapping[Side, Judgement]) -> Judgement:
    """Judgement with the worst answer; the last of equal answers.

    The gauge side comes first, so that the field side wins a tie.

    Parameters
    ----------
    judgements
        Judgements by the name of a side or a theory.

    Returns
    -------
    Judgement
        The judgement with the worst answer.
    """
    return max(
        reversed([*judgements.values()]), key=lambda judgement: ANSWERS_BEST_FIRST.index(judgement.verdict.answer)
    )


def find_worst_verdict(judgements: Mapping[str, Judgement]) -> Verdict:
    """Verdict of the judgement with the worst answer."""
    return select_worst_judgement(judgements).verdict


def list_theory_answers(judgements: Mapping[str, Judgement]) -> list[TheoryAnswer]:
    """Answer for each judged theory, in the order of the judgements.

    Parameters
    ----------
    judgements
        Judgements by the name of the theory.

    Returns
    -------
    list of TheoryAnswer
        Answers with the contacts by the theories.
    """
    return [
        TheoryAnswer(name=name, answer=judgement.verdict.answer, made=judgement.approximation)
        for name, judgement in judgements.items()
    ]


def find_cheapest_theory(theories: Iterable[TheoryAnswer], *, in_range: bool = False) -> TheoryAnswer:
    """First theory in order of cost that holds.

    Without one, the result is the first theory that may hold.

    Parameters
    ----------
    theories
        Answers for the theories, the cheapest theory first.
    in_range
        Whether theories outside their range of validity are skipped.

    Returns
    -------
    TheoryAnswer
        With the answer UNRESOLVED if no theory is known to hold and one may hold; without a name if all theories fail.

    Examples
    --------
    >>> from fecontact.judging.verdict import TheoryAnswer, find_cheapest_theory
    >>> find_cheapest_theory([TheoryAnswer(name="hertz"), TheoryAnswer(name="multi_hertz", answer="HOLDS")]).label
    'multi_hertz'
    """
    candidates = [theory for theory in theories if theory.answer != "FAILS" and not (in_range and theory.out_of_range)]
    return min(candidates, key=lambda theory: ANSWERS_BEST_FIRST.index(theory.answer), default=TheoryAnswer())


def find_cheaper_possible_theory(theories: Iterable[TheoryAnswer], *, in_range: bool = False) -> TheoryAnswer:
    """First theory that may hold and is cheaper than the cheapest theory that holds.

    Parameters
    ----------
    theories, in_range
        As in `find_cheapest_theory`.

    Returns
    -------
    TheoryAnswer
        Without a name if there is no such theory, or if no theory is known to hold.
    """
    candidates = [theory for theory in theories if theory.answer != "FAILS" and not (in_range and theory.out_of_range)]
    is_any_known = any(theory.answer == "HOLDS" for theory in candidates)
    return candidates[0] if is_any_known and candidates[0].answer == "UNRESOLVED" else TheoryAnswer()


# --- Plastic verdict: first loading of virgin steel, and Hertz compared with bodies that yield.

PLASTIC_VALIDITY = "first loading of virgin steel, without shakedown, residual stress, friction and repeated passes"
"""Range of validity of the plastic rung, for every message and record with its numbers."""
# Error of the load steps, as a fraction of the change from half as many load steps. Measured: 0.3 to 0.5.
_LOAD_STEP_FRACTION = 0.5
# Least error of the elements, as a fraction of the plastic step, multiplied by the square of the number of elements per
# semi-axis. Two coarse meshes may agree by chance: with 4 elements per semi-axis, peak and area of spheres at 1.8 to
# 3.5 yield stresses have errors of up to 8 % of their plastic step, and two meshes show half of that error.
_LEAST_ELEMENT_ERROR = 1.6
# Relative error of the peak that remains after the corrections.
_CORRECTION_ERROR = 1e-4
# Relative error of the von Mises peak. Below spheres, the points of the elements give values that are 1 to 2 % too low,
# although two meshes agree.
_VON_MISES_ERROR = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticVerdict:
    """Verdict on Hertz's theory for bodies that may yield, in their first loading.

    Must not be used for repeated passes; see `PLASTIC_VALIDITY`.

    Attributes
    ----------
    yielded
        Plastic contact on the finest meshes.
    status
        `converged` or `not converged`.
    step_uncertainty
        Uncertainty of the ladder step `bodies_to_plastic` (-), by the name of the measure, for an exact yield stress.
    band
        Plastic step of each measure (-) with a yield stress that is lower and higher by `YIELD_STRESS_SPREAD`; empty if
        the coarser meshes do not yield.
    judgements
        Hertz on each side of the contact point compared with bodies that yield, by the name of the theory.
    verdict
        Worst verdict of the judgements, with its cause.
    first_yield_uncertainty
        Relative uncertainty of the load of first yield (-).
    plastic_load_N, plastic_measure
        Smallest load at which the plastic step of a measure reaches the limit of the measure, and the name of the
        measure; None if no plastic step reaches a limit up to the load of the case.
    cancelling
        Text on steps that compensate each other, if Hertz HOLDS although the plastic step exceeds a limit; else empty.
    """

    yielded: PlasticResult
    status: str
    step_uncertainty: Mapping[str, float]
    band: Mapping[str, tuple[float, float]]
    judgements: Mapping[str, Judgement]
    verdict: Verdict
    first_yield_uncertainty: float
    plastic_load_N: float | None
    plastic_measure: str | None
    cancelling: str

    @property
    def deciding(self) -> Judgement:
        """Judgement against bodies that yield on the deciding side, with the verdict."""
        return replace(select_worst_judgement(self.judgements), verdict=self.verdict)

    @property
    def deciding_side(self) -> Side:
        """Deciding side of the contact point; `both` if the curvatures of both sides are equal."""
        if len(self.judgements) == 1:
            return "both"
        return "gauge" if select_worst_judgement(self.judgements) is self.judgements[HERTZ_GAUGE] else "field"

    @property
    def has_yielded(self) -> bool:
        """Whether a body has yielded under the load."""
        return any(body.largest_strain > 0.0 for body in self.yielded.bodies.values())


def judge_plastic(
    solved_load: SolvedLoad,
    judgements: Mapping[str, Judgement],
    ladder: Ladder,
    geometry: PatchGeometry,
    own_measures: OwnMeasures = NO_OWN_MEASURES,
    *,
    at_junction: bool,
) -> PlasticVerdict | None:
    """Judge Hertz's theory against the plastic rung of a load.

    Parameters
    ----------
    solved_load
        Contacts of the load on all mesh levels.
    judgements
        Hertz on each side of the contact point compared with elastic bodies, by the name of the theory.
    ladder, geometry
        Steps from Hertz to the plastic rung, and geometry of the profiles below the patch, for the cause.
    own_measures
        Criteria of a user at this position.
    at_junction
        Whether the contact point is on a curvature junction.

    Returns
    -------
    PlasticVerdict or None
        None if no body has a yield stress, or if the plastic rung was not solved.
    """
    finest = solved_load.levels[0]
    if finest.yielded is None:
        return None
    plastic_contact, limits = finest.yielded, solved_load.case.criteria.limits
    status = "converged" if _is_converged(solved_load) else "not converged"
    (theory, *_) = (judgement.approximation for judgement in judgements.values())
    assert theory is not None
    step_uncertainty = _plastic_step_uncertainty(solved_load.levels, theory, own_measures)
    plastic_judgements = {
        name: _judge_against_plastic(
            judgement, plastic_contact, step_uncertainty, solved_load, own_measures.enter_stage(f"plastic {name}")
        )
        for name, judgement in judgements.items()
    }
    worst = find_worst_verdict(plastic_judgements)
    is_beyond_limit = any(
        abs(judgement.deviation.get(worst.measure, 0.0)) > limits[worst.measure]
        for judgement in plastic_judgements.values()
    )
    cause: str | None = None
    if worst.answer != "HOLDS" and is_beyond_limit:
        cause = JUNCTION_CAUSE if at_junction else find_cause(ladder.steps, worst.measure, geometry, plastic=True)
    load_N, measure = _plastic_load(plastic_contact, limits)
    return PlasticVerdict(
        yielded=plastic_contact,
        status=status,
        step_uncertainty=step_uncertainty,
        band=_yield_stress_ranges(solved_load.levels),
        judgements=plastic_judgements,
        verdict=replace(worst, cause=cause).usable(status == "converged"),
        first_yield_uncertainty=_first_yield_uncertainty(solved_load.levels),
        plastic_load_N=load_N,
        plastic_measure=measure,
        cancelling=_describe_cancelling_steps(ladder.steps, limits) if worst.answer == "HOLDS" else "",
    )


def _is_converged(solved_load: SolvedLoad) -> bool:
    """Whether elastic and plastic contact have converged on every mesh level."""
    return solved_load.status == "converged" and all(
        level.yielded is not None and level.yielded.status == "converged" for level in solved_load.levels
    )


def _judge_against_plastic(
    elastic: Judgement,
    plastic_contact: PlasticResult,
    step_uncertainty: Mapping[str, float],
    solved_load: SolvedLoad,
    own_measures: OwnMeasures,
) -> Judgement:
    """Judge Hertz with a single curvature against bodies that yield.

    The numerical uncertainty is the sum of the uncertainty against elastic bodies and the uncertainty of the plastic
    step. Both are multiplied by theory / finite elements of the plastic contact.
    """
    theory = elastic.approximation
    assert theory is not None
    deviation = compute_deviations(plastic_contact.fe, theory) | own_measures.compute_deviations(
        plastic_contact.fe, theory
    )
    plastic_step = {
        name: step_uncertainty[name] * (abs(1.0 + deviation[name]) if is_relative(name) else 1.0)
        for name in elastic.numerical
    }
    ratios = {name: _deviation_ratio(name, deviation, elastic.deviation) for name in elastic.numerical}
    numerical_uncertainty = {
        name: elastic_uncertainty * ratios[name] + plastic_step[name]
        for name, elastic_uncertainty in elastic.numerical.items()
    }
    verdict, uncertainty = judge_profile_variants(
        deviation, numerical_uncertainty, elastic.moves, solved_load.case.criteria
    )
    budgets = {
        name: replace(
            budget.scaled(ratios[name]),
            plastic_step=plastic_step[name],
            profile_variants=uncertainty[name] - numerical_uncertainty[name],
        )
        for name, budget in elastic.budgets.items()
    }
    return replace(
        elastic,
        deviation=deviation,
        uncertainty=uncertainty,
        numerical=numerical_uncertainty,
        verdict=verdict,
        budgets=budgets,
    )


def _deviation_ratio(name: str, plastic: Mapping[str, float], elastic: Mapping[str, float]) -> float:
    """Ratio of 1 + deviation between plastic and elastic contact.

    1 + deviation is theory / finite elements. The ratio is 1 for an absolute measure.
    """
    return abs((1.0 + plastic[name]) / (1.0 + elastic[name])) if is_relative(name) else 1.0


def _plastic_step(
    level: Level, plastic_rung: Rung, theory: TheoryContact, own_measures: OwnMeasures, stage: str
) -> dict[str, float]:
    """Change of each measure by plasticity, on equal nodes (-).

    The change is relative for each of `MEASURES`, and absolute for each of `MISFITS`. `stage` is the name of the stage
    for a user's measures.
    """
    before, after = (
        read_values(rung, theory) | own_measures.enter_stage(f"{stage}, {material}").read_values(rung)
        for material, rung in (("elastic", level.fe), ("plastic", plastic_rung))
    )
    return {
        name: value / before[name] - 1.0 if is_relative(name) else value - before[name] for name, value in after.items()
    }


def _plastic_step_uncertainty(
    levels: Sequence[Level], theory: TheoryContact, own_measures: OwnMeasures
) -> dict[str, float]:
    """Uncertainty of the plastic step of each measure (-).

    The contributions are the meshes, the load steps, the nodes of the elements and the corrections. With a single mesh
    level, the uncertainty is NaN.
    """
    plastic_levels = [(level, level.yielded) for level in levels if level.yielded is not None]
    steps = [
        _plastic_step(level, contact.fe, theory, own_measures, f"mesh {number}")
        for number, (level, contact) in enumerate(plastic_levels)
    ]
    load_step_pairs = [
        (step, _plastic_step(level, contact.fewer_steps, theory, own_measures, f"mesh {number}, fewer steps"))
        for number, (step, (level, contact)) in enumerate(zip(steps, plastic_levels, strict=True))
        if contact.fewer_steps is not None
    ]
    if len(steps) < 2:
        return dict.fromkeys(steps[0], math.nan)
    finest, coarser = steps[:2]
    step_on_elements, least_fraction = (
        _plastic_step_on_elements(levels[0]),
        _LEAST_ELEMENT_ERROR / _elements_per_semi_axis(levels[0]) ** 2,
    )
    uncertainty = {}
    for name, value in finest.items():
        load_step_error = (
            _LOAD_STEP_FRACTION * abs(load_step_pairs[0][0][name] - load_step_pairs[0][1][name])
            if load_step_pairs
            else 0.0
        )
        node_error = abs(step_on_elements[name] - value) if name in step_on_elements else 0.0
        element_error = max(abs(value - coarser[name]), least_fraction * abs(value))
        uncertainty[name] = element_error + load_step_error + node_error + _CORRECTION_ERROR
    return uncertainty


def _elements_per_semi_axis(level: Level) -> float:
    """Number of elements per semi-axis, in the direction with fewer elements."""
    patch, (spacing_x_mm, spacing_y_mm) = read_measures(level.fe), level.nodal.grid.steps_mm
    return min(patch.a_mm / spacing_x_mm, patch.b_mm / spacing_y_mm)


def _plastic_step_on_elements(level: Level) -> dict[str, float]:
    """Relative change of peak pressure and approach by plasticity.

    The change is read on the nodes of the elements. These nodes resolve the other measures of a plastic pressure too
    coarsely.
    """
    assert level.yielded is not None
    before, after = (read_measures(rung).as_dict() for rung in (level.on_elements, level.yielded.nodal.even()))
    return {name: after[name] / before[name] - 1.0 for name in ("p_max_MPa", "approach_mm")}


def _first_yield_uncertainty(levels: Sequence[Level]) -> float:
    """Relative uncertainty of the load of first yield; NaN without coarser meshes."""
    loads_N = [level.yielded.first_yield_N for level in levels if level.yielded is not None]
    # The load is proportional to the third power of the stress.
    return math.nan if len(loads_N) < 2 else abs(loads_N[1] / loads_N[0] - 1.0) + 3.0 * _VON_MISES_ERROR


def _yield_stress_ranges(levels: Sequence[Level]) -> dict[str, tuple[float, float]]:
    """Plastic step of each measure with lower and higher yield stress.

    The effect of the yield stress is solved on coarse meshes and applied to the plastic step on the finest meshes. The
    result is empty if the effect was not solved.
    """
    coarse = next((level.yielded for level in levels if level.yielded is not None and level.yielded.by_band), None)
    finest = levels[0].yielded
    if coarse is None or finest is None:
        return {}
    before, after = (read_measures(rung).as_dict() for rung in (levels[0].fe, finest.fe))
    coarse_steps = coarse.by_band
    ranges = {}
    for name in MEASURES:
        ratio = after[name] / before[name] / (1.0 + coarse_steps["given"][name])
        ranges[name] = (
            ratio * (1.0 + coarse_steps["lower"][name]) - 1.0,
            ratio * (1.0 + coarse_steps["higher"][name]) - 1.0,
        )
    return ranges


def _plastic_load(plastic_contact: PlasticResult, limits: Mapping[str, float]) -> tuple[float | None, str | None]:
    """Smallest load at which a plastic step reaches its limit.

    The result is the load in N and the name of the measure. The load is interpolated linearly between the loads of the
    load path.
    """
    crossings: list[tuple[float, str]] = []
    for name in (name for name in limits if name in MEASURES):
        load_N, step = plastic_contact.first_yield_N, 0.0
        for point in plastic_contact.path:
            next_step = abs(point.steps[name])
            if next_step > limits[name]:
                fraction = (limits[name] - step) / (next_step - step)
                crossings.append((load_N + fraction * (point.load_N - load_N), name))
                break
            load_N, step = point.load_N, next_step
    return min(crossings, default=(None, None), key=lambda crossing: crossing[0] or 0.0)


def _describe_cancelling_steps(steps: Mapping[str, Mapping[str, float]], limits: Mapping[str, float]) -> str:
    """Text on the ladder steps that compensate each other.

    The text is for the first measure with a plastic step beyond its limit, and empty without such a measure.
    """
    for name in (name for name in limits if name in MEASURES):
        step_by_cause = {
            step.cause: steps[step.name][name] for step in LADDER_STEPS if step.cause and step.name in steps
        }
        if abs(step_by_cause[PLASTIC_STEP.cause]) > limits[name]:
            contributions = ", ".join(f"{cause} {1e2 * step:+.1f} %" for cause, step in step_by_cause.items())
            return f"HOLDS by cancellation of {contributions}"
    return ""


def describe_plasticity(verdict: PlasticVerdict | None) -> list[str]:
    """Warnings on yielding, with their range of validity.

    Parameters
    ----------
    verdict
        Verdict for bodies that may yield; None for elastic bodies.

    Returns
    -------
    list of str
        A single warning; empty for elastic bodies.
    """
    if verdict is None:
        return []
    contact, load_kN = verdict.yielded, verdict.yielded.first_yield_N / 1e3
    first_yield = (
        f"the {contact.first_body} yields first, at {load_kN:.3g} kN ± {1e2 * verdict.first_yield_uncertainty:.0f} %"
    )
    if not verdict.has_yielded:
        return [f"plasticity: no body yields under this load; {first_yield} ({PLASTIC_VALIDITY})"]
    if verdict.status != "converged":
        return [
            f"plasticity: {first_yield}; its effect on the contact was not solved: {verdict.status}"
            f" ({PLASTIC_VALIDITY})"
        ]
    step = contact.path[-1].steps
    spread = f"yield stresses {1e2 * YIELD_STRESS_SPREAD:.0f} % lower and higher"
    if "p_max_MPa" in verdict.band:
        low, high = verdict.band["p_max_MPa"]
        spread_effect = f"with {spread} the peak by {1e2 * low:+.1f} and {1e2 * high:+.1f} %"
    else:
        spread_effect = f"the effect of {spread} is unknown, because the coarser meshes do not yield"
    change = (
        f"plasticity: {first_yield}; the peak changes by {1e2 * step['p_max_MPa']:+.1f} ±"
        f" {1e2 * verdict.step_uncertainty['p_max_MPa']:.1f} %, the area by {1e2 * step['area_mm2']:+.1f} ±"
        f" {1e2 * verdict.step_uncertainty['area_mm2']:.1f} %; {spread_effect}"
    )
    answer = f"Hertz {verdict.verdict.answer} against bodies that yield"
    return [f"{change}; {answer}{'; ' * bool(verdict.cancelling)}{verdict.cancelling} ({PLASTIC_VALIDITY})"]
