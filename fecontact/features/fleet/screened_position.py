"""Screened position of a pair on all profile variants, and its row."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from fecontact.case import Case
from fecontact.contact.patch import find_ridge_peaks
from fecontact.contact_theories.approximation import TheoryContact, theory_contact_from_rung
from fecontact.contact_theories.registry import (
    HERTZ,
    HERTZ_OF_EACH_SIDE,
    THEORIES,
    LoadedPlacement,
    fast_theory,
    solve_strips_of_positions,
)
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.fleet.model import ScreeningTheory
from fecontact.features.fleet.screening_rows import FILTER_COLUMNS, MEASURE_COLUMNS, Row
from fecontact.judging.causes import PatchGeometry, find_gap_cause
from fecontact.judging.lines import find_open_cause, is_judged, read_filter_mm
from fecontact.judging.measures import UNCERTAINTIES, compare_theories, compute_deviations
from fecontact.judging.theory_pair import POINTS_ACROSS, evaluate_pressure
from fecontact.judging.verdict import ANSWERS_BEST_FIRST, JUNCTION_CAUSE, PROFILE_CAUSE, Answer, judge
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.alone import HALF_SPACE, STRIPS, compute_normal_force
from fecontact.solving.position import expect_on_half_space
from fecontact.solving.profile_variants import REFERENCE_LABEL

# Number of nodes on the narrowest semi-axis of a half-space, and the factor of its uncertainty relative to the declared
# uncertainty of reading.
SCREENING_NODES, _COARSE_FACTOR = 16, 4.0
STRIP_UNCERTAINTY: dict[str, float] = {
    name: declared.strips for name, declared in UNCERTAINTIES.items() if declared.strips is not None
}
"""Uncertainty of the strip method against the half-space on the same gap (-)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ScreenedVariant:
    """Screening of a position on a profile variant.

    Attributes
    ----------
    loaded
        Placed position under its load.
    contact
        Contact by the theory of the screening.
    off
        Deviations of a theory's contact from this contact, by measure.
    uncertainty
        Uncertainty of the deviations by measure: relative for a measure, absolute for a misfit.
    """

    loaded: LoadedPlacement
    contact: TheoryContact
    off: Callable[[TheoryContact], Mapping[str, float]]
    uncertainty: Mapping[str, float]

    @cached_property
    def hertz(self) -> TheoryContact | str | None:
        """Hertz's ellipse, or the reason why there is none."""
        return THEORIES[HERTZ].approximate(self.loaded)

    def judge_theory(self, name: str) -> tuple[Answer, Mapping[str, float], str] | None:
        """Judge a theory by the contact of the screening.

        Parameters
        ----------
        name
            Name of the theory; for Hertz the worse answer of both sides of the contact point counts.

        Returns
        -------
        tuple or None
            Answer, deviations and the measure that decides; None if the theory has no contact here. A theory other than
            Hertz has no answer outside its range, unless the criteria include such theories.
        """
        candidates: list[tuple[Answer, Mapping[str, float], str]] = []
        for side in HERTZ_OF_EACH_SIDE if name == HERTZ else (name,):
            theory_contact = self.hertz if side == HERTZ else fast_theory(side)(self.loaded)
            if isinstance(theory_contact, TheoryContact) and (name == HERTZ or self.can_name(theory_contact)):
                deviations = self.off(theory_contact)
                verdict = judge(deviations, self.uncertainty, self.loaded.case.criteria)
                certain = theory_contact.definite and self.contact.status == "solved"
                candidates.append((verdict.answer if certain else "UNRESOLVED", deviations, verdict.measure))
        return max(reversed(candidates), key=lambda judgement: ANSWERS_BEST_FIRST.index(judgement[0]), default=None)

    def can_name(self, contact: TheoryContact) -> bool:
        """Whether the theory of a contact can be named.

        A theory outside its range can be named only if the criteria include such theories.
        """
        return contact.status != "out of range" or self.loaded.case.criteria.theories_out_of_range


def screen_variant(case: Case, placement: Placement, theory: ScreeningTheory) -> ScreenedVariant:
    """Contact at a position on a profile variant by the theory of the screening.

    Parameters
    ----------
    case
        Case of the position.
    placement
        Wheel on rail, with the profile variants.
    theory
        `strip` or `half_space`.

    Returns
    -------
    ScreenedVariant
        The contact, and how other theories are compared with it.

    Raises
    ------
    InputError
        If the strip method has no contact at this position.
    ConvergenceError
        If the half-space did not converge.
    """
    (outcome,) = screen_variants([(case, placement)], theory)
    if not isinstance(outcome, ScreenedVariant):
        raise outcome
    return outcome


def screen_variants(
    positions: Sequence[tuple[Case, Placement]], theory: ScreeningTheory
) -> list[ScreenedVariant | InputError | ConvergenceError]:
    """Contacts at many positions by the theory of the screening.

    The strip method solves all positions together.

    Parameters
    ----------
    positions
        Cases with their placements, equal but for shift, load and profile variant.
    theory
        `strip` or `half_space`.

    Returns
    -------
    list
        For each position its contact as by `screen_variant`, or the error.
    """
    loaded_placements = [
        LoadedPlacement(placement=placement, case=case, normal_force_N=compute_normal_force(case, placement))
        for case, placement in positions
    ]
    if theory == STRIPS:
        return [
            ScreenedVariant(
                loaded=loaded, contact=contact, off=partial(compare_theories, contact), uncertainty=STRIP_UNCERTAINTY
            )
            if isinstance(contact, TheoryContact)
            else InputError(f"{THEORIES[STRIPS].words}: {contact}")
            for loaded, contact in solve_strips_of_positions(loaded_placements)
        ]
    outcomes: list[ScreenedVariant | InputError | ConvergenceError] = []
    for loaded in loaded_placements:
        try:
            outcomes.append(_screen_on_half_space(loaded))
        except (InputError, ConvergenceError) as error:
            outcomes.append(error)
    return outcomes


def _screen_on_half_space(loaded: LoadedPlacement) -> ScreenedVariant:
    """Contact on the half-space, with the uncertainty of its reading."""
    case, placement = loaded.case, loaded.placement
    half_space = expect_on_half_space(case, placement, nodes=SCREENING_NODES)[1].half_space
    loaded = replace(loaded, normal_force_N=half_space.normal_force_N, half_space=half_space)
    uncertainties = {
        name: _COARSE_FACTOR * declared.reading
        for name, declared in UNCERTAINTIES.items()
        if declared.reading is not None
    }
    return ScreenedVariant(
        loaded=loaded,
        contact=theory_contact_from_rung(half_space),
        off=partial(compute_deviations, half_space),
        uncertainty=uncertainties,
    )


def make_position_row(variants: Mapping[str, ScreenedVariant | None]) -> Row:
    """Row of a position from its contacts on all profile variants.

    Parameters
    ----------
    variants
        Contact on each profile variant by its label, the reference variant first; None for a variant without a contact,
        whose answer is open.

    Returns
    -------
    dict
        Verdict, deviations and uncertainties in percent, peaks in MPa, margin, cause, what leaves it open, the verdict
        with each usual filter, and the cheapest theory.

    Raises
    ------
    InputError
        If Hertz has no ellipse on the reference variant.
    """
    reference, *_ = variants.values()
    assert reference is not None
    judgements = {
        label: None if variant is None else variant.judge_theory(HERTZ) for label, variant in variants.items()
    }
    known_judgements = [judgement for judgement in judgements.values() if judgement is not None]
    if next(iter(judgements.values())) is None:
        raise InputError("no Hertz ellipse exists at the contact point")
    answers: dict[str, Answer] = {
        label: "UNRESOLVED" if judgement is None else judgement[0]
        for label, judgement in judgements.items()
        if is_judged(label)
    }
    verdict = _find_common_answer(answers)
    variant_deviations = np.array([[values[name] for name in MEASURE_COLUMNS] for _, values, _ in known_judgements])
    mean_deviations = variant_deviations.mean(axis=0)
    largest_changes = np.abs(variant_deviations - mean_deviations).max(axis=0)
    deviations = dict(zip(MEASURE_COLUMNS, mean_deviations.tolist(), strict=True))
    uncertainties = {
        name: change + reference.uncertainty.get(name, math.nan)
        for name, change in zip(MEASURE_COLUMNS, largest_changes.tolist(), strict=True)
    }
    known_variants = [variant for variant in variants.values() if variant is not None]
    row: Row = {
        "hertz_p_max_MPa": _average_hertz_peak(known_variants),
        "screen_p_max_MPa": _average_peak(known_variants),
    }
    for name, column in MEASURE_COLUMNS.items():
        row[f"{column}_percent"], row[f"{column}_uncertainty_percent"] = (
            1e2 * deviations[name],
            1e2 * uncertainties[name],
        )
    cheapest_theory, cheaper_possible_theory = _find_cheapest_theories(
        [variants[label] for label in answers], reference, verdict
    )
    return row | {
        "verdict": _WORDS.get(verdict, verdict),
        "measure": next(
            (measure for answer, _, measure in known_judgements if answer == verdict), known_judgements[0][2]
        ),
        "margin": _compute_margin(reference.loaded.case, deviations, uncertainties),
        "variants_holding": [*answers.values()].count("HOLDS"),
        "variants": len(answers),
        "cause": None if verdict == "HOLDS" else _find_cause(verdict, [*answers.values()], reference),
        "open_because": _describe_open_cause(answers) if verdict == "UNRESOLVED" else None,
        **{column: _answer_with_filter(answers, length) for column, length in FILTER_COLUMNS.items()},
        "cheapest_theory": cheapest_theory,
        "cheaper_possible_theory": cheaper_possible_theory,
    }


_WORDS = {"UNRESOLVED": "OPEN"}


def _find_common_answer(answers: Mapping[str, Answer]) -> Answer:
    """Answer of all variants, else UNRESOLVED."""
    answer, *different_answers = {*answers.values()}
    return "UNRESOLVED" if different_answers else answer


def _describe_open_cause(answers: Mapping[str, Answer]) -> str:
    """Name of the cause of an open position."""
    cause = find_open_cause(answers)
    return "accuracy of the screen" if cause == "mesh" else cause


def _answer_with_filter(answers: Mapping[str, Answer], filter_mm: float) -> str | None:
    """Verdict if a usual filter were declared, from the answers on all variants.

    The variants with this filter count, and noise samples. None if this filter was not judged: if other filters were
    declared, or if the noise of a profile asks for a longer filter, which a declared filter would replace.
    """
    usual_lengths = {label: usual for label in answers if (usual := _find_usual_length(label)) is not None}
    has_unusual_length = any(read_filter_mm(label) is not None and label not in usual_lengths for label in answers)
    # the reference variant has no common length if the profiles of a pair have different filters
    has_different_filters = REFERENCE_LABEL in answers and len(answers) > 1
    is_judged = not usual_lengths or filter_mm in usual_lengths.values()
    if has_unusual_length or has_different_filters or not is_judged:
        return None
    answer = _find_common_answer(
        {label: answer for label, answer in answers.items() if usual_lengths.get(label, filter_mm) == filter_mm}
    )
    return _WORDS.get(answer, answer)


def _find_usual_length(label: str) -> float | None:
    """Usual filter length of a variant in mm, from its label; None for other variants."""
    length = read_filter_mm(label)
    if length is None:
        return None
    return next((usual for usual in FILTER_COLUMNS.values() if abs(length / usual - 1.0) < _SAME_LENGTH), None)


# Labels have three digits of a filter length.
_SAME_LENGTH = 0.01


def _compute_margin(case: Case, deviations: Mapping[str, float], uncertainties: Mapping[str, float]) -> float:
    """Least distance of a deviation to its limit, divided by its uncertainty.

    A measure without a stated uncertainty has no margin.
    """
    margins = (
        (limit - abs(deviations[name])) / uncertainties[name]
        for name, limit in case.criteria.limits.items()
        if math.isfinite(uncertainties[name])
    )
    return min(margins, default=math.nan)


def _average_hertz_peak(variants: Sequence[ScreenedVariant]) -> float:
    """Mean over the variants of Hertz's largest peak pressure in MPa."""
    contacts = [variant.hertz for variant in variants if isinstance(variant.hertz, TheoryContact)]
    return float(np.mean([max(patch.p_max_MPa for patch in contact.patches) for contact in contacts]))


def _average_peak(variants: Sequence[ScreenedVariant]) -> float:
    """Mean over the variants of the largest peak pressure of the screening in MPa."""
    return float(np.mean([max(patch.p_max_MPa for patch in variant.contact.patches) for variant in variants]))


def _find_cause(verdict: Answer, answers: Sequence[Answer], variant: ScreenedVariant) -> str:
    """Cause of a verdict that is not HOLDS."""
    contact = variant.contact
    if len(set(answers)) > 1:
        return PROFILE_CAUSE
    if variant.loaded.placement.first.at_junction:
        return JUNCTION_CAUSE
    if contact.status != "solved":
        return f"{contact.status}: {'; '.join(contact.notes)}"
    return find_gap_cause(_describe_patch_geometry(variant.loaded.placement, contact))


def _describe_patch_geometry(placement: Placement, contact: TheoryContact) -> PatchGeometry:
    """Those values of the geometry below the patch that determine a cause; the rest are NaN."""
    low, high = contact.box_mm[0][1], contact.box_mm[1][1]
    places = [junction.s_mm for junction in placement.junctions]
    s = np.linspace(low, high, POINTS_ACROSS)
    ridge = evaluate_pressure(contact, np.zeros(1), s)[0]
    peaks, _ = find_ridge_peaks(np.concatenate(([0.0], ridge, [0.0])), STRIP_UNCERTAINTY["valley"])
    u = placement.rail.profile.at_arc_length(np.array([low, high]) + placement.first_arc_length_mm)
    return PatchGeometry(
        junction_distance_mm=abs(min(places, key=abs, default=math.inf)),
        junction_distance_over_b=math.nan,
        junction_in_patch=any(low <= place <= high for place in places),
        curvature_variation=math.nan,
        normal_turn_rad=float(np.ptp(placement.rail.section(u)[2])),
        lobes=len(peaks),
        patch_count=len(contact.patches),
    )


def _find_cheapest_theories(
    variants: Sequence[ScreenedVariant | None], reference: ScreenedVariant, hertz_answer: Answer
) -> tuple[str, str | None]:
    """Cheapest theory that certainly holds, and a cheaper theory that may hold.

    A theory is known to hold if it holds on all variants, and may hold unless it fails on all of them. The theory of
    the screening, the reference of all, is the last.
    """
    if not all(
        variant.can_name(variant.hertz)
        for variant in variants
        if variant is not None and isinstance(variant.hertz, TheoryContact)
    ):
        hertz_answer = "FAILS"
    if hertz_answer == "HOLDS":
        return HERTZ, None
    possible_theory = HERTZ if hertz_answer == "UNRESOLVED" else None
    screening_theory = STRIPS if reference.uncertainty is STRIP_UNCERTAINTY else HALF_SPACE
    for name in THEORIES:
        if name not in (*HERTZ_OF_EACH_SIDE, STRIPS, HALF_SPACE):
            answers: set[Answer] = set()
            for variant in variants:
                answers.add(_answer_on_variant(variant, name))
                # The theory neither holds nor fails on all variants, or it is not the first theory that may hold.
                if answers not in ({"HOLDS"}, {"FAILS"}) or (possible_theory and answers == {"FAILS"}):
                    break
            if answers == {"HOLDS"}:
                return name, possible_theory
            if answers != {"FAILS"}:
                possible_theory = possible_theory or name
    return screening_theory, possible_theory


def _answer_on_variant(variant: ScreenedVariant | None, name: str) -> Answer:
    """Answer for a theory on a profile variant; FAILS for a theory without a contact."""
    if variant is None:
        return "UNRESOLVED"
    judgement = variant.judge_theory(name)
    return "FAILS" if judgement is None else judgement[0]
