"""From a solved load to what it says: the ladder, the lobes, and each theory judged alike."""

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
from fecontact.judging.notes import warnings_of
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
from fecontact.judging.theory import fails_for_certain, judge_hertz, judge_theories, profiles_leave_open
from fecontact.judging.uncertainty import step_uncertainty
from fecontact.judging.verdict import (
    AT_JUNCTION,
    ELEMENTS,
    PROFILE,
    Answer,
    Judgement,
    Verdict,
    judge_plastic,
    worst_judgement,
    worst_of,
)
from fecontact.placement.wheel_on_rail import Placement


def judge_load(solved: SolvedLoad, placement: Placement, theories: Iterable[str] = THEORIES) -> JudgedLoad:
    """Read everything from a solved load, by the criteria of its case.

    Parameters
    ----------
    theories
        Those of the pressure that are asked for. Hertz is always judged; by Hertz alone lobes are not looked at, and
        features read nothing.
    """
    case, finest, touch = solved.case, solved.levels[0], placement.first
    judged = judge_hertz(case, solved.levels, placement, solved.lines)
    by_elements = worst_judgement(judge_hertz(case, solved.levels, placement, solved.lines, by="elements"))
    hertz = judged[HERTZ].hertz
    comparison = compare(finest.fe, hertz)
    ladder = Ladder.of(hertz, solved.rungs)
    geometry = patch_geometry(placement, finest.fe, hertz, comparison.patch)
    worst = worst_of(judged)
    status = _status(solved, ladder, placement, {worst.answer, by_elements.verdict.answer})
    usable = status == CONVERGED
    others = [name for name in theories if name not in EITHER_SIDE]
    found, without = judge_theories(others, solved, placement, usable=usable)
    cause: str | None = None
    if _is_off(judged, worst, case):
        cause = AT_JUNCTION if touch.at_junction else cause_of(ladder.steps, worst.measure, geometry)
    if worst.answer == "UNRESOLVED" and profiles_leave_open(case, solved.levels, placement, solved.lines):
        cause = PROFILE
    certain = solved.status == ELEMENTS_OFF and fails_for_certain(judged, solved.half_space)
    if solved.status == ELEMENTS_OFF and not certain:
        cause = ELEMENTS
    elastic = replace(worst, cause=cause).usable(usable or certain)
    plastic = judge_plastic(solved, judged, ladder, geometry, at_junction=touch.at_junction)
    load = JudgedLoad(
        solved=solved,
        judgements=judged | found,
        without=without,
        comparison=comparison,
        ladder=ladder,
        geometry=geometry,
        bodies_step_uncertainty=_bodies_step_uncertainty(solved, Approximation.of(hertz)),
        elements_uncertainty=elements_uncertainties(solved.levels),
        by_elements=replace(by_elements, verdict=by_elements.verdict.usable(usable)),
        status=status,
        verdict=elastic if plastic is None else plastic.verdict.usable(usable),
        warnings=(),
        lobes=judge_lobes(solved, placement, usable=usable) if others else (),
        elastic_verdict=None if plastic is None else elastic,
        plastic=plastic,
    )
    load = replace(load, warnings=tuple(warnings_of(load)))
    return with_readings(load, placement) if others else load


def with_readings(load: JudgedLoad, placement: Placement, kind: str = "READINGS") -> JudgedLoad:
    """A judged load with what features read of it."""
    found = {name: read(load, placement) for name, read in offered(kind).items()}
    return replace(load, features={**load.features, **{name: one for name, one in found.items() if one is not None}})


def _status(solved: SolvedLoad, ladder: Ladder, placement: Placement, answers: set[Answer]) -> Status:
    """Whether a load may be used: its solutions and elements, its references, and the answers of both verdicts."""
    if not solved.usable:
        return solved.status
    if gap_faults(solved) or not reference_error(ladder, placement) <= REFERENCE_LIMIT:
        return REFERENCES_OFF
    return CONTRADICTION if {"HOLDS", "FAILS"} <= answers else solved.status


def _is_off(judged: Mapping[str, Judgement], worst: Verdict, case: Case) -> bool:
    """Whether Hertz fails, or would if the numbers were exact: an open verdict by itself needs no cause."""
    limit = case.criteria.limits[worst.measure]
    return worst.answer != "HOLDS" and any(abs(one.deviation[worst.measure]) > limit for one in judged.values())


def _bodies_step_uncertainty(solved: SolvedLoad, hertz: Approximation) -> dict[str, float]:
    """Uncertainty of the step of each measure from the half-space to the bodies; it has no approach.

    The half-space of several lobes is not a single thing where the surface turns from one to the other: what lies
    between planes for patches and normals that all turn is a part.
    """
    on_half_space = values_of(solved.half_space, hertz)
    otherwise = values_of(finest_otherwise(solved.levels), hertz)
    turned = on_half_space if solved.turned is None else values_of(solved.turned, hertz)
    levels = [values_of(level.fe, hertz) for level in solved.levels]
    known, found = as_solved(solved.levels), {}
    for name, flat in on_half_space.items():
        if FLOORS[name] is not None:
            values = [one[name] for one in levels]
            ratio, size = (values[0] / flat, abs(flat)) if name in MEASURES else (1.0, 1.0)
            of_meshes = step_uncertainty(name, values, known, otherwise=otherwise[name])
            found[name] = abs(ratio) * (of_meshes + abs(turned[name] - flat) / size)
    return found
