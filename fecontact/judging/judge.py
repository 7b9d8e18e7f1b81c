"""Judgement of a solved load: the ladder, the lobes, and each theory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from fecontact.case import Case
from fecontact.contact_theories.approximation import Approximation
from fecontact.contact_theories.registry import EITHER_SIDE, HERTZ, THEORIES
from fecontact.errors import CONVERGED
from fecontact.feature_registry import offered
from fecontact.judging.causes import cause_of, patch_geometry
from fecontact.judging.comparison import compare
from fecontact.judging.gap_faults import gap_faults
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.ladder import Ladder
from fecontact.judging.lobes import judge_lobes
from fecontact.judging.measures import FLOORS, MEASURES, values_of
from fecontact.judging.notes import iterate_warnings
from fecontact.judging.reference_check import REFERENCE_LIMIT, reference_error
from fecontact.judging.solved_load import (
    CONTRADICTION,
    ELEMENTS_OFF,
    REFERENCES_OFF,
    SolvedLoad,
    Status,
    as_solved,
    elements_uncertainties,
    finest_otherwise,
)
from fecontact.judging.theory import fails_for_certain, is_unresolved_by_profiles, judge_hertz, judge_theories
from fecontact.judging.uncertainty import step_uncertainty
from fecontact.judging.verdict import (
    AT_JUNCTION,
    ELEMENTS,
    PROFILE,
    Answer,
    Judgement,
    Verdict,
    judge_plastic,
    select_worst_judgement,
    worst_of,
)
from fecontact.placement.wheel_on_rail import Placement


def judge_load(solved_load: SolvedLoad, placement: Placement, theories: Iterable[str] = THEORIES) -> JudgedLoad:
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

    Returns
    -------
    JudgedLoad
        Judgements, ladder, lobes, readings and warnings.
    """
    case, finest, contact_point = solved_load.case, solved_load.levels[0], placement.first
    hertz_judgements = judge_hertz(case, solved_load.levels, placement, solved_load.lines)
    elements_judgement = select_worst_judgement(
        judge_hertz(case, solved_load.levels, placement, solved_load.lines, by="elements")
    )
    hertz = hertz_judgements[HERTZ].hertz
    comparison = compare(finest.fe, hertz)
    ladder = Ladder.of(hertz, solved_load.rungs)
    geometry = patch_geometry(placement, finest.fe, hertz, comparison.patch)
    worst = worst_of(hertz_judgements)
    status = _status(solved_load, ladder, placement, {worst.answer, elements_judgement.verdict.answer})
    is_usable = status == CONVERGED
    other_names = [name for name in theories if name not in EITHER_SIDE]
    theory_judgements, reasons = judge_theories(other_names, solved_load, placement, usable=is_usable)
    cause: str | None = None
    if _needs_cause(hertz_judgements, worst, case):
        cause = AT_JUNCTION if contact_point.at_junction else cause_of(ladder.steps, worst.measure, geometry)
    if worst.answer == "UNRESOLVED" and is_unresolved_by_profiles(
        case, solved_load.levels, placement, solved_load.lines
    ):
        cause = PROFILE
    is_certain = solved_load.status == ELEMENTS_OFF and fails_for_certain(hertz_judgements, solved_load.half_space)
    if solved_load.status == ELEMENTS_OFF and not is_certain:
        cause = ELEMENTS
    elastic_verdict = replace(worst, cause=cause).usable(is_usable or is_certain)
    plastic_verdict = judge_plastic(
        solved_load, hertz_judgements, ladder, geometry, at_junction=contact_point.at_junction
    )
    load = JudgedLoad(
        solved=solved_load,
        judgements=hertz_judgements | theory_judgements,
        without=reasons,
        comparison=comparison,
        ladder=ladder,
        geometry=geometry,
        bodies_step_uncertainty=_bodies_step_uncertainty(solved_load, Approximation.of(hertz)),
        elements_uncertainty=elements_uncertainties(solved_load.levels),
        by_elements=replace(elements_judgement, verdict=elements_judgement.verdict.usable(is_usable)),
        status=status,
        verdict=elastic_verdict if plastic_verdict is None else plastic_verdict.verdict.usable(is_usable),
        warnings=(),
        lobes=judge_lobes(solved_load, placement, usable=is_usable) if other_names else (),
        elastic_verdict=None if plastic_verdict is None else elastic_verdict,
        plastic=plastic_verdict,
    )
    load = replace(load, warnings=tuple(iterate_warnings(load)))
    return with_readings(load, placement) if other_names else load


def with_readings(load: JudgedLoad, placement: Placement, kind: str = "READINGS") -> JudgedLoad:
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
    readings = {name: read(load, placement) for name, read in offered(kind).items()}
    return replace(
        load, features={**load.features, **{name: reading for name, reading in readings.items() if reading is not None}}
    )


def _status(solved_load: SolvedLoad, ladder: Ladder, placement: Placement, answers: set[Answer]) -> Status:
    """Status of a load, from its solutions, elements, references and answers.

    Contrary answers on the elements' nodes and on the finer nodes contradict each other.
    """
    if not solved_load.usable:
        return solved_load.status
    if gap_faults(solved_load) or not reference_error(ladder, placement) <= REFERENCE_LIMIT:
        return REFERENCES_OFF
    return CONTRADICTION if {"HOLDS", "FAILS"} <= answers else solved_load.status


def _needs_cause(judgements: Mapping[str, Judgement], worst: Verdict, case: Case) -> bool:
    """Whether Hertz fails, or would fail with exact numbers.

    An UNRESOLVED verdict with a deviation within its limit does not need a cause.
    """
    limit = case.criteria.limits[worst.measure]
    return worst.answer != "HOLDS" and any(
        abs(judgement.deviation[worst.measure]) > limit for judgement in judgements.values()
    )


def _bodies_step_uncertainty(solved_load: SolvedLoad, hertz: Approximation) -> dict[str, float]:
    """Uncertainty of the step of each measure from the half-space to the bodies (-).

    The approach has no entry. If the surface turns from lobe to lobe, the half-space is not unique. The difference
    between planes for patches and a normal at each place is therefore added.
    """
    half_space_values = values_of(solved_load.half_space, hertz)
    other_fit_values = values_of(finest_otherwise(solved_load.levels), hertz)
    turned_values = half_space_values if solved_load.turned is None else values_of(solved_load.turned, hertz)
    level_values = [values_of(level.fe, hertz) for level in solved_load.levels]
    quality, uncertainty_by_name = as_solved(solved_load.levels), {}
    for name, half_space_value in half_space_values.items():
        if FLOORS[name] is not None:
            values = [values_by_name[name] for values_by_name in level_values]
            ratio, size = (values[0] / half_space_value, abs(half_space_value)) if name in MEASURES else (1.0, 1.0)
            mesh_uncertainty = step_uncertainty(name, values, quality, otherwise=other_fit_values[name])
            uncertainty_by_name[name] = abs(ratio) * (
                mesh_uncertainty + abs(turned_values[name] - half_space_value) / size
            )
    return uncertainty_by_name
