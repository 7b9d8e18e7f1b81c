"""Judgement of a solved load: the ladder, the lobes, and each theory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from fecontact.case import Case
from fecontact.contact_theories.approximation import TheoryContact
from fecontact.contact_theories.registry import HERTZ, HERTZ_OF_EACH_SIDE, THEORIES
from fecontact.errors import CONVERGED
from fecontact.feature_registry import load_offers
from fecontact.judging.causes import find_cause, measure_patch_geometry
from fecontact.judging.comparison import compare
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.ladder import Ladder
from fecontact.judging.lobes import judge_lobes
from fecontact.judging.measures import MEASURES, UNCERTAINTIES, read_values
from fecontact.judging.notes import iterate_warnings
from fecontact.judging.own_measures import OwnEvaluations, OwnMeasures
from fecontact.judging.reference_check import REFERENCE_LIMIT, compute_reference_error
from fecontact.judging.solution_faults import describe_solution_faults
from fecontact.judging.solved_load import (
    CONTRADICTION_STATUS,
    ELEMENTS_STATUS,
    REFERENCES_STATUS,
    SolvedLoad,
    Status,
    estimate_elements_uncertainties,
    read_other_fit,
    read_quality,
)
from fecontact.judging.theory import has_certain_failure, is_unresolved_by_profiles, judge_hertz, judge_theories
from fecontact.judging.uncertainty import estimate_step_budget
from fecontact.judging.verdict import (
    ELEMENTS_CAUSE,
    JUNCTION_CAUSE,
    PROFILE_CAUSE,
    Answer,
    Judgement,
    Verdict,
    find_worst_verdict,
    judge_plastic,
    select_worst_judgement,
)
from fecontact.placement.wheel_on_rail import Placement


def judge_load(
    solved_load: SolvedLoad,
    placement: Placement,
    theories: Iterable[str] = THEORIES,
    stored_own: OwnEvaluations | None = None,
) -> JudgedLoad:
    """Judge a solved load by the criteria of its case.

    Parameters
    ----------
    solved_load
        Contacts of the load on all mesh levels.
    placement
        Wheel on rail.
    theories
        Names of the theories of the pressure to judge. Hertz is always judged. For Hertz alone, lobes are not judged
        and features have no readings.
    stored_own
        Stored evaluations of criteria of a user whose functions are not available.

    Returns
    -------
    JudgedLoad
        Judgements, ladder, lobes, readings and warnings.
    """
    case, finest, contact_point = solved_load.case, solved_load.levels[0], placement.first
    own_measures = OwnMeasures.read_criteria(case, placement, stored_own)
    hertz_judgements = judge_hertz(case, solved_load.levels, placement, solved_load.lines, own_measures=own_measures)
    elements_judgement = select_worst_judgement(
        judge_hertz(case, solved_load.levels, placement, solved_load.lines, by="elements", own_measures=own_measures)
    )
    hertz = hertz_judgements[HERTZ].hertz
    comparison = compare(finest.fe, hertz)
    ladder = Ladder.of(hertz, solved_load.rungs, own_measures)
    geometry = measure_patch_geometry(placement, finest.fe, hertz, comparison.patch)
    worst = find_worst_verdict(hertz_judgements)
    status = _status(solved_load, ladder, placement, {worst.answer, elements_judgement.verdict.answer})
    is_usable = status == CONVERGED
    other_names = [name for name in theories if name not in HERTZ_OF_EACH_SIDE]
    theory_judgements, reasons = judge_theories(
        other_names, solved_load, placement, usable=is_usable, own_measures=own_measures
    )
    cause: str | None = None
    if _needs_cause(hertz_judgements, worst, case):
        cause = JUNCTION_CAUSE if contact_point.at_junction else find_cause(ladder.steps, worst.measure, geometry)
    if worst.answer == "UNRESOLVED" and is_unresolved_by_profiles(
        case, solved_load.levels, placement, solved_load.lines, own_measures
    ):
        cause = PROFILE_CAUSE
    is_certain = solved_load.status == ELEMENTS_STATUS and has_certain_failure(hertz_judgements, solved_load.half_space)
    if solved_load.status == ELEMENTS_STATUS and not is_certain:
        cause = ELEMENTS_CAUSE
    elastic_verdict = replace(worst, cause=cause).usable(is_usable or is_certain)
    plastic_verdict = judge_plastic(
        solved_load, hertz_judgements, ladder, geometry, own_measures, at_junction=contact_point.at_junction
    )
    load = JudgedLoad(
        solved=solved_load,
        judgements=hertz_judgements | theory_judgements,
        without=reasons,
        comparison=comparison,
        ladder=ladder,
        geometry=geometry,
        bodies_step_uncertainty=_bodies_step_uncertainty(solved_load, TheoryContact.of(hertz)),
        elements_uncertainty=estimate_elements_uncertainties(solved_load.levels),
        by_elements=replace(elements_judgement, verdict=elements_judgement.verdict.usable(is_usable)),
        status=status,
        verdict=elastic_verdict if plastic_verdict is None else plastic_verdict.verdict.usable(is_usable),
        warnings=(),
        lobes=judge_lobes(solved_load, placement, usable=is_usable) if other_names else (),
        elastic_verdict=None if plastic_verdict is None else elastic_verdict,
        plastic=plastic_verdict,
        own_evaluations=own_measures.evaluations,
    )
    load = replace(load, warnings=tuple(iterate_warnings(load)))
    return add_readings(load, placement) if other_names else load


def add_readings(load: JudgedLoad, placement: Placement, kind: str = "READINGS") -> JudgedLoad:
    """Judged load with the readings of features.

    Parameters
    ----------
    load
        Judged load.
    placement
        Wheel on rail.
    kind
        Kind of reading in the registry of features.

    Returns
    -------
    JudgedLoad
        Load with an entry for each feature that has a reading.
    """
    readings = {name: read(load, placement) for name, read in load_offers(kind).items()}
    return replace(
        load, features={**load.features, **{name: reading for name, reading in readings.items() if reading is not None}}
    )


def _status(solved_load: SolvedLoad, ladder: Ladder, placement: Placement, answers: set[Answer]) -> Status:
    """Status of a load, from its solutions, elements, references and answers.

    Contrary answers on the elements' nodes and on the finer nodes contradict each other.
    """
    if not solved_load.usable:
        return solved_load.status
    if describe_solution_faults(solved_load) or not compute_reference_error(ladder, placement) <= REFERENCE_LIMIT:
        return REFERENCES_STATUS
    return CONTRADICTION_STATUS if {"HOLDS", "FAILS"} <= answers else solved_load.status


def _needs_cause(judgements: Mapping[str, Judgement], worst: Verdict, case: Case) -> bool:
    """Whether Hertz fails, or would fail with exact numbers.

    An UNRESOLVED verdict with a deviation within its limit does not need a cause.
    """
    limit = case.criteria.limits[worst.measure]
    return worst.answer != "HOLDS" and any(
        abs(judgement.deviation.get(worst.measure, 0.0)) > limit for judgement in judgements.values()
    )


def _bodies_step_uncertainty(solved_load: SolvedLoad, hertz: TheoryContact) -> dict[str, float]:
    """Uncertainty of the step of each measure from the half-space to the bodies (-).

    The approach has no entry. If the surface turns from lobe to lobe, the half-space is not unique. The difference
    between planes for patches and a normal at each place is therefore added.
    """
    half_space_values = read_values(solved_load.half_space, hertz)
    other_fit_values = read_values(read_other_fit(solved_load.levels), hertz)
    turned_values = half_space_values if solved_load.turned is None else read_values(solved_load.turned, hertz)
    level_values = [read_values(level.fe, hertz) for level in solved_load.levels]
    quality, uncertainty_by_name = read_quality(solved_load.levels), {}
    for name, half_space_value in half_space_values.items():
        if UNCERTAINTIES[name].reading is not None:
            values = [values_by_name[name] for values_by_name in level_values]
            ratio, size = (values[0] / half_space_value, abs(half_space_value)) if name in MEASURES else (1.0, 1.0)
            mesh_uncertainty = estimate_step_budget(name, values, quality, otherwise=other_fit_values[name]).total
            uncertainty_by_name[name] = abs(ratio) * (
                mesh_uncertainty + abs(turned_values[name] - half_space_value) / size
            )
    return uncertainty_by_name
