"""Judgement of a single theory: deviations, uncertainties and verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

from fecontact.case import Case
from fecontact.contact.grid import Rung
from fecontact.contact_theories.approximation import TheoryContact
from fecontact.contact_theories.registry import HERTZ_OF_EACH_SIDE, THEORIES, LoadedPlacement
from fecontact.judging.lines import NO_SHIFTS, ProfileVariants, VariantShifts
from fecontact.judging.measures import UNCERTAINTIES, compute_deviations, read_values
from fecontact.judging.own_measures import NO_OWN_MEASURES, OwnMeasures, keep_irreducible
from fecontact.judging.solved_load import (
    Level,
    SolvedLoad,
    compute_elements_per_semi_axis,
    estimate_budgets,
    estimate_elements_budgets,
    estimate_irreducible_budgets,
    read_other_fit,
    read_quality,
    scale_to_deviation,
)
from fecontact.judging.uncertainty import MESH_RATIO, estimate_irregularity_uncertainty
from fecontact.judging.uncertainty_budget import UncertaintyBudget
from fecontact.judging.verdict import Judgement, find_worst_verdict, judge_profile_variants
from fecontact.placement.wheel_on_rail import Placement

Evidence = Literal["fe", "elements", "profiles"]
"""Contact with which a theory is compared, or the only uncertainty that counts."""


def judge_hertz(
    case: Case,
    levels: Sequence[Level],
    placement: Placement,
    lines: ProfileVariants | None,
    *,
    by: Evidence = "fe",
    refinements: int | None = None,
    own_measures: OwnMeasures | None = None,
) -> dict[str, Judgement]:
    """Judge Hertz with the curvature of each side of the first contact point.

    The ellipse has the normal force of the finest level.

    Parameters
    ----------
    case
        Case with criteria, material and irregularities.
    levels
        Mesh levels, the finest first.
    placement
        Wheel on rail, with the first contact point.
    lines
        Theories on the profile variants; None for exact profiles.
    by, refinements
        As in `judge_theory`.
    own_measures
        Criteria of a user at this position; made from the case if not given.

    Returns
    -------
    dict of str to Judgement
        By the name of the theory; a single entry if the curvatures of both sides are equal.
    """
    judgements = {}
    own_measures = own_measures or OwnMeasures.read_criteria(case, placement)
    stage = "elements" if by == "elements" else "fe"
    for name in HERTZ_OF_EACH_SIDE:
        theory_contact = THEORIES[name].approximate(
            LoadedPlacement(placement=placement, case=case, normal_force_N=levels[0].fe.normal_force_N)
        )
        if isinstance(theory_contact, TheoryContact):
            shifts = NO_SHIFTS if lines is None else lines.find_shifts(name)
            judgements[name] = judge_theory(
                case,
                levels,
                theory_contact,
                shifts,
                by=by,
                refinements=refinements,
                own_measures=own_measures.enter_stage("" if refinements is not None else f"{stage} {name}"),
            )
    return judgements


def is_unresolved_by_profiles(
    case: Case,
    levels: Sequence[Level],
    placement: Placement,
    lines: ProfileVariants | None,
    own_measures: OwnMeasures | None = None,
) -> bool:
    """Whether the profile variants alone make the verdict on Hertz UNRESOLVED.

    Parameters
    ----------
    case, levels, placement, lines, own_measures
        As in `judge_hertz`.

    Returns
    -------
    bool
        False for exact profiles.
    """
    if lines is None:
        return False
    judgements = judge_hertz(case, levels, placement, lines, by="profiles", own_measures=own_measures)
    return find_worst_verdict(judgements).answer == "UNRESOLVED"


def is_undecidable_by_refinement(
    case: Case,
    levels: Sequence[Level],
    placement: Placement,
    lines: ProfileVariants | None,
    *,
    by: Evidence = "fe",
    refinements: int = 0,
) -> bool:
    """Whether the verdict on Hertz stays UNRESOLVED after further refinements.

    The numbers of the finer meshes are taken as the present numbers. The remaining uncertainties are the profile
    variants, reading a measure from its nodes, and the bodies' cut planes.

    Parameters
    ----------
    case, levels, placement, lines
        As in `judge_hertz`.
    by
        As in `judge_theory`.
    refinements
        Number of further refinements.

    Returns
    -------
    bool
        True if no refinement decides.
    """
    worst = find_worst_verdict(judge_hertz(case, levels, placement, lines, by=by, refinements=refinements))
    return worst.answer == "UNRESOLVED" and (lines is not None or not worst.unknown)


def judge_theories(
    names: Iterable[str],
    solved_load: SolvedLoad,
    placement: Placement,
    *,
    usable: bool,
    own_measures: OwnMeasures = NO_OWN_MEASURES,
) -> tuple[dict[str, Judgement], dict[str, str]]:
    """Judge several theories under the normal force of the finest level.

    Parameters
    ----------
    names
        Names of the theories.
    solved_load
        Contacts of the load on all mesh levels.
    placement
        Wheel on rail.
    usable
        Whether the numbers of the load may be used; if not, each verdict is UNRESOLVED.
    own_measures
        Criteria of a user at this position.

    Returns
    -------
    judgements : dict of str to Judgement
        Judgement of each theory with a contact, by its name.
    reasons : dict of str to str
        Reason for each theory without a contact, by its name.
    """
    loaded = LoadedPlacement(
        placement=placement,
        case=solved_load.case,
        normal_force_N=solved_load.levels[0].fe.normal_force_N,
        half_space=solved_load.half_space,
    )
    judgements, reasons = {}, {}
    for name in names:
        theory_contact = THEORIES[name].approximate(loaded)
        if isinstance(theory_contact, str):
            reasons[name] = theory_contact
        elif theory_contact is not None:
            shifts = NO_SHIFTS if solved_load.lines is None else solved_load.lines.find_shifts(name)
            judgement = judge_theory(
                solved_load.case,
                solved_load.levels,
                theory_contact,
                shifts,
                own_measures=own_measures.enter_stage(f"fe {name}"),
            )
            judgements[name] = replace(judgement, verdict=judgement.verdict.usable(usable and theory_contact.definite))
    return judgements, reasons


def judge_theory(
    case: Case,
    levels: Sequence[Level],
    theory_contact: TheoryContact,
    moves: VariantShifts = NO_SHIFTS,
    *,
    by: Evidence = "fe",
    refinements: int | None = None,
    own_measures: OwnMeasures = NO_OWN_MEASURES,
) -> Judgement:
    """Judge a theory against the finest level, by the criteria of a case.

    Parameters
    ----------
    case
        Case with criteria and irregularities.
    levels
        Mesh levels, the finest first.
    theory_contact
        Contact predicted by the theory.
    moves
        Shifts of its deviations over the profile variants; `NO_SHIFTS` for exact profiles.
    by
        `fe`: compare with the contact on the finer nodes. `elements`: compare with the contact on the elements' nodes.
        `profiles`: compare with the contact on the finer nodes, with the uncertainty of the profiles alone, as if the
        meshes were exact.
    refinements
        If given, the deviations are taken from the finer nodes, and their uncertainty is the remainder after this
        number of further refinements.
    own_measures
        Criteria of a user at this position.

    Returns
    -------
    Judgement
        Deviations, uncertainties and verdict.
    """

    def read_theory_values(rung: Rung) -> dict[str, float]:
        return read_values(rung, theory_contact)

    if refinements is not None:
        deviation = compute_deviations(levels[0].fe, theory_contact)
        on_elements = refinements if by == "elements" else None
        irreducible = estimate_irreducible_budgets(levels[0], read_theory_values, deviation, on_elements=on_elements)
        # If the present uncertainty is more than twice the remaining uncertainty, finer meshes may still show any
        # deviation.
        budgets = {
            name: irreducible[name] if budget.total <= 2.0 * irreducible[name].total else UncertaintyBudget()
            for name, budget in estimate_budgets(levels, read_theory_values, deviation).items()
            if name in irreducible
        }
    elif by == "elements":
        deviation = compute_deviations(levels[0].on_elements, theory_contact)
        budgets = {
            name: scale_to_deviation(name, budget, deviation[name])
            for name, budget in estimate_elements_budgets(levels, read_theory_values).items()
        }
    else:
        deviation = compute_deviations(levels[0].fe, theory_contact)
        budgets = estimate_budgets(levels, read_theory_values, deviation)
    if by == "profiles":
        budgets = {name: UncertaintyBudget() for name in budgets}
    slope = sum(irregularity.largest_slope for irregularity in case.irregularities)
    budgets = {
        name: replace(budget, irregularity=estimate_irregularity_uncertainty(name, deviation[name], slope=slope))
        for name, budget in budgets.items()
    }
    rung = levels[0].on_elements if by == "elements" and refinements is None else levels[0].fe
    deviation |= own_measures.compute_deviations(rung, theory_contact)
    budgets |= _estimate_own_budgets(own_measures, levels, theory_contact, by, refinements)
    numerical_uncertainty = {name: budget.total for name, budget in budgets.items()}
    verdict, uncertainty = judge_profile_variants(deviation, numerical_uncertainty, moves, case.criteria)
    return Judgement(
        approximation=theory_contact,
        deviation=deviation,
        uncertainty=uncertainty,
        limits=case.criteria.limits,
        verdict=verdict,
        numerical=numerical_uncertainty,
        moves=moves,
        budgets={
            name: replace(budget, profile_variants=uncertainty[name] - numerical_uncertainty[name])
            for name, budget in budgets.items()
        },
        own_values=own_measures.read_theory_values(rung, theory_contact),
    )


def _estimate_own_budgets(
    own_measures: OwnMeasures,
    levels: Sequence[Level],
    theory_contact: TheoryContact,
    evidence: Evidence,
    refinements: int | None,
) -> dict[str, UncertaintyBudget]:
    """Contributions to the uncertainty of the deviations in a user's measures.

    The arguments are the arguments of `judge_theory`; `evidence` is `by`.
    """
    if evidence == "profiles":
        return own_measures.zero_budgets
    if own_measures is NO_OWN_MEASURES:
        return {}
    finest = levels[0]
    if evidence == "elements":
        budgets = own_measures.estimate_elements_budgets(
            [level.on_elements for level in levels],
            theory_contact,
            elements=compute_elements_per_semi_axis(finest) * MESH_RATIO ** (refinements or 0),
            compliance_error=finest.compliance_error,
            residual=finest.nodal.residual,
        )
    else:
        budgets = own_measures.estimate_budgets(
            [level.fe for level in levels], read_other_fit(levels), theory_contact, read_quality(levels)
        )
    if refinements is None:
        return budgets
    irreducible = {name: keep_irreducible(budget) for name, budget in budgets.items()}
    return {
        name: irreducible[name] if budget.total <= 2.0 * irreducible[name].total else UncertaintyBudget()
        for name, budget in budgets.items()
    }


# A failure is certain if the deviation exceeds its limit by this number of uncertainties, independently of the
# elements.
_CERTAINTY_FACTOR = 5.0


def has_certain_failure(judgements: Mapping[str, Judgement], half_space: Rung) -> bool:
    """Whether Hertz fails on every profile variant by the half-space alone.

    A deviation must exceed its limit by five times its uncertainty. The uncertainty includes the change by the bodies.
    Exact profiles are never certain: their meshes are refined until they show the quality of their numbers.

    Parameters
    ----------
    judgements
        Judgements of Hertz, by the name of the theory.
    half_space
        Contact of the true gap on the half-space.

    Returns
    -------
    bool
        True if a judgement fails on every profile variant.
    """
    return any(
        _fails_beyond_doubt(judgement, half_space) for judgement in judgements.values() if judgement.moves.by_line
    )


def _fails_beyond_doubt(judgement: Judgement, half_space: Rung) -> bool:
    """Whether a theory fails by the half-space with five uncertainties on every variant.

    A variant fails if at least one measure exceeds its limit by more than `_CERTAINTY_FACTOR` times its uncertainty.
    The difference of the deviations from the half-space and from the finite elements is added to the numerical
    uncertainty. Measures of a user do not count.
    """
    assert judgement.approximation is not None
    half_space_deviation = compute_deviations(half_space, judgement.approximation)
    uncertainty = {
        name: judgement.numerical.get(name, math.nan) + abs(half_space_deviation[name] - judgement.deviation[name])
        for name in judgement.limits
        if name in UNCERTAINTIES
    }
    steps = {label: judgement.moves.step_uncertainty(label, judgement.deviation) for label in judgement.moves.by_line}
    return all(
        any(
            abs(variant_deviation[name]) - limit > _CERTAINTY_FACTOR * (uncertainty[name] + steps[label][name])
            for name, limit in judgement.limits.items()
            if name in UNCERTAINTIES
        )
        for label, variant_deviation in judgement.moves.deviations(half_space_deviation).items()
    )
