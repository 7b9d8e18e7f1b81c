"""From a solved load to what it says: the ladder, the lobes, and each theory judged in the same way."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

from fecontact.case import Case
from fecontact.comparison.approximation import Approximation
from fecontact.comparison.cause import cause_of, patch_geometry
from fecontact.comparison.compare import compare
from fecontact.comparison.creep_comparison import creep_of
from fecontact.comparison.creep_theories import judge_creep_laws
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judgement import Judgement, worst_judgement, worst_of
from fecontact.comparison.ladder import Ladder
from fecontact.comparison.lobes import judge_lobes
from fecontact.comparison.measures import FLOORS, MEASURES, deviations_of, values_of
from fecontact.comparison.plastic_verdict import judge_plastic, plastic_warnings
from fecontact.comparison.point_noise import PointNoise
from fecontact.comparison.solved_load import (
    ELEMENTS_OFF,
    Level,
    SolvedLoad,
    as_solved,
    elements_uncertainties,
    uncertainties,
)
from fecontact.comparison.theories import EITHER_SIDE, HERTZ, THEORIES, Loaded
from fecontact.comparison.uncertainty import step_uncertainty, unmeshed_uncertainty
from fecontact.comparison.verdict import AT_JUNCTION, ELEMENTS, PROFILE, Verdict, judge
from fecontact.comparison.warnings import elements_warnings, junction_warnings, slide_warnings
from fecontact.contact.rung import Rung
from fecontact.geometry.placement import Placement

Evidence = Literal["fe", "elements", "profiles"]
"""What a theory is held against."""


def judge_load(solved: SolvedLoad, placement: Placement, theories: Iterable[str] = THEORIES) -> JudgedLoad:
    """Read everything from a solved load, by the criteria of its case.

    Parameters
    ----------
    theories
        Those of the pressure that are asked for. Hertz is always judged; by Hertz alone neither lobes nor creep forces
        are looked at.
    """
    case, finest, touch = solved.case, solved.levels[0], placement.first
    judged = judge_hertz(case, solved.levels, placement, solved.point_noise)
    by_elements = judge_hertz(case, solved.levels, placement, solved.point_noise, by="elements")
    hertz = judged[HERTZ].hertz
    others = [name for name in theories if name not in EITHER_SIDE]
    found, without = _judge_theories(others, solved, placement)
    comparison = compare(finest.fe, hertz)
    ladder = Ladder.of(hertz, solved.rungs)
    geometry = patch_geometry(placement, finest.fe, hertz, comparison.patch)
    worst = worst_of(judged)
    cause: str | None = None
    if _is_off(judged, worst, case):
        cause = AT_JUNCTION if touch.at_junction else cause_of(ladder.steps, worst.measure, geometry)
    if worst.answer == "UNRESOLVED" and _profile_decides(judged, worst, solved.point_noise):
        cause = PROFILE
    if solved.status == ELEMENTS_OFF:
        cause = ELEMENTS
    creep = creep_of(solved, hertz, placement) if others else None
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
        by_elements=_usable(worst_judgement(by_elements), solved),
        verdict=replace(worst, cause=cause).usable(solved.usable),
        warnings=(),
        lobes=judge_lobes(solved, placement) if others else (),
        creep=creep,
        plastic=plastic,
    )
    of_bodies = (*slide_warnings(finest.slide_mm, comparison), *plastic_warnings(plastic))
    of_meshes = (*solved.limits, *elements_warnings(finest))
    return replace(load, warnings=(*junction_warnings(load.sides), *of_meshes, *of_bodies))


def with_creep_laws(load: JudgedLoad, placement: Placement) -> JudgedLoad:
    """A judged load with the laws of creep forces judged too, where there is a friction; it takes seconds."""
    if load.creep is None:
        return load
    return replace(load, creep_laws=judge_creep_laws(load.solved, placement, load.judgements, load.creep.verdict))


def judge_hertz(
    case: Case,
    levels: Sequence[Level],
    placement: Placement,
    point_noise: PointNoise | None,
    *,
    by: Evidence = "fe",
) -> dict[str, Judgement]:
    """Judge Hertz with the curvature of each side of the first touch point, under the finest level's normal force."""
    of_points = {} if point_noise is None else point_noise.uncertainty()
    found = {}
    for name in EITHER_SIDE:
        made = THEORIES[name].approximate(
            Loaded(placement=placement, case=case, normal_force_N=levels[0].fe.normal_force_N)
        )
        if isinstance(made, Approximation):
            found[name] = judge_theory(case, levels, made, of_points, by=by)
    return found


def _judge_theories(
    names: Iterable[str], solved: SolvedLoad, placement: Placement
) -> tuple[dict[str, Judgement], dict[str, str]]:
    """Each theory judged, and why others have no contact.

    What points of profiles leave open is taken to be that of one ellipse.
    """
    of_points = {} if solved.point_noise is None else solved.point_noise.uncertainty()
    loaded = Loaded(
        placement=placement,
        case=solved.case,
        normal_force_N=solved.levels[0].fe.normal_force_N,
        half_space=solved.half_space,
    )
    found, without = {}, {}
    for name in names:
        made = THEORIES[name].approximate(loaded)
        if isinstance(made, str):
            without[name] = made
        elif made is not None:
            one = judge_theory(solved.case, solved.levels, made, of_points)
            found[name] = replace(one, verdict=one.verdict.usable(solved.usable and made.definite))
    return found, without


def judge_theory(
    case: Case,
    levels: Sequence[Level],
    made: Approximation,
    of_points: Mapping[str, float],
    *,
    by: Evidence = "fe",
) -> Judgement:
    """Judge a theory against the finest level, by the criteria of a case.

    Parameters
    ----------
    of_points
        What the profiles leave open of each deviation.
    by
        The contact on the finer nodes, that on the elements' own ones, or the finer one as if its meshes were exact, by
        the uncertainty of the profiles alone.
    """

    def read(rung: Rung) -> dict[str, float]:
        return values_of(rung, made)

    if by == "elements":
        deviation = deviations_of(levels[0].on_elements, made)
        # of (Hertz - FE) / FE, from that of the finite-element measure
        known = {
            name: value * abs(1.0 + deviation[name]) if name in MEASURES else value
            for name, value in elements_uncertainties(levels, read).items()
        }
    else:
        deviation = deviations_of(levels[0].fe, made)
        known = uncertainties(levels, read, deviation)
    exact = by == "profiles"
    slope = sum(line.largest_slope for line in case.irregularities)
    uncertainty = {
        name: (0.0 if exact else value)
        + of_points.get(name, 0.0)
        + unmeshed_uncertainty(name, deviation[name], slope=slope)
        for name, value in known.items()
    }
    return Judgement(
        approximation=made,
        deviation=deviation,
        uncertainty=uncertainty,
        limits=case.criteria.limits,
        verdict=judge(deviation, uncertainty, case.criteria),
    )


def _usable(judged: Judgement, solved: SolvedLoad) -> Judgement:
    return replace(judged, verdict=judged.verdict.usable(solved.usable))


def _profile_decides(judged: Mapping[str, Judgement], worst: Verdict, noise: PointNoise | None) -> bool:
    """Whether most of the uncertainty of the measure that leaves the verdict open is the measured profile's."""
    if noise is None:
        return False
    part = noise.uncertainty().get(worst.measure, 0.0)
    whole = next(one for one in reversed([*judged.values()]) if one.verdict == worst).uncertainty.get(
        worst.measure, 0.0
    )
    # what is not a number is not known, for want of a contact
    return not part <= 0.5 * whole


def _is_off(judged: Mapping[str, Judgement], worst: Verdict, case: Case) -> bool:
    """Whether Hertz fails, or would if the numbers were exact: an open verdict by itself needs no cause."""
    limit = case.criteria.limits[worst.measure]
    return worst.answer != "HOLDS" and any(abs(one.deviation[worst.measure]) > limit for one in judged.values())


def _bodies_step_uncertainty(solved: SolvedLoad, hertz: Approximation) -> dict[str, float]:
    """Uncertainty of the step of each measure from the half-space to the bodies; it has no approach.

    The half-space of several lobes is not a single thing where the surface turns from one to the other: what lies
    between planes for patches and normals that all turn is a part.
    """
    finest = solved.levels[0]
    on_half_space, otherwise = values_of(solved.half_space, hertz), values_of(finest.otherwise, hertz)
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
