"""A load as it was solved, on all its meshes, and what it says of Hertz: everything that a verdict is made of.

A solved load is fields and numbers alone. Judging it needs no finite elements, so that one that was stored is judged
again in milliseconds, with other criteria or by other readings.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from typing import Literal

import numpy as np

from fecontact.case import Case
from fecontact.comparison.cause import PatchGeometry, cause_of, patch_geometry
from fecontact.comparison.compare import Comparison, compare
from fecontact.comparison.ladder import Ladder
from fecontact.comparison.measures import (
    FLOORS,
    MEASURES,
    MISFITS,
    Measures,
    deviations,
    hertz_measures,
    measures_of,
    misfit_of,
    patch_of,
)
from fecontact.comparison.patch import lobe_columns
from fecontact.comparison.point_noise import PointNoise
from fecontact.comparison.uncertainty import elements_uncertainty, step_uncertainty, uncertainty
from fecontact.comparison.verdict import AT_JUNCTION, ELEMENTS, FROM_BEST, PROFILE, Verdict, judge
from fecontact.comparison.warnings import junction_warnings, slide_warnings, yield_warnings
from fecontact.contact.elements import COMPLIANCE_LIMIT
from fecontact.contact.rung import Rung, misfit
from fecontact.geometry.placement import Placement
from fecontact.geometry.touch_points import TouchPoint
from fecontact.theory.hertz import HertzContact, hertz_from_hessian
from fecontact.theory.touch_hertz import Side, sides

Status = Literal["converged", "not converged", "patch at the edge of the fine mesh", "elements too soft or too stiff"]
# Of the peak between two lobes, or of the patch's width between two patches: less is little.
_LITTLE = 0.1
# The elements' own contact may be so many times as far from that of the finer nodes as both are unsure.
_APART = 2.0
ELEMENTS_OFF: Status = "elements too soft or too stiff"
"""Status of a load whose elements are not those of the bodies' material, or of too poor a shape."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Level:
    """A load solved on one pair of meshes.

    Attributes
    ----------
    nodal
        Contact between the finite bodies, as the nodes of their elements carry it.
    fe
        Contact of the finite bodies on finer nodes: that of the true gap on a half-space, opened by what the bodies of
        `nodal` open more than a half-space of the same elements. That is smooth and known well on coarse meshes, so
        that the fine pressure has neither the elements' softness nor their size.
    otherwise
        As `fe`, with another idea of what of the opening is the elements' and what the bodies'.
    compliance_error
        By how much the elements are softer than their material, far from a unit pressure; NaN where it is not seen.
    slide_mm
        How far the wheel goes along the rail under the load, where the surface is steep.
    degrees_of_freedom, elements
        Of rail and wheel.
    enlarged, at_edge
        How often the fine zone was enlarged, and whether the patch still came to its edge.
    """

    nodal: Rung
    fe: Rung
    otherwise: Rung
    compliance_error: float
    degrees_of_freedom: Mapping[str, int]
    elements: Mapping[str, int]
    enlarged: int
    at_edge: bool
    slide_mm: float = 0.0

    @property
    def rungs(self) -> dict[str, Rung]:
        """Its contacts by name."""
        return {name: getattr(self, name) for name in LEVEL_RUNGS}

    @property
    def status(self) -> Status:
        """Whether the level may be used."""
        return "patch at the edge of the fine mesh" if self.at_edge else _worst_status(*self.rungs.values())

    @cached_property
    def on_elements(self) -> Rung:
        """The contact on the elements' own nodes, as what reads pressures takes it."""
        return self.nodal.even()

    @property
    def misfit(self) -> float:
        """Part of the load that the elements' own nodes carry elsewhere than the finer ones."""
        return misfit(self.nodal, self.fe)


LEVEL_RUNGS = tuple(one.name for one in fields(Level) if one.type == "Rung")
"""Names of the contacts of a level."""


def _worst_status(*rungs: Rung) -> Status:
    return "converged" if all(rung.status == "converged" for rung in rungs) else "not converged"


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedLoad:
    """A load at a position, solved on two meshes or more.

    Attributes
    ----------
    case
        The position under this load.
    levels
        One a pair of meshes, the finest first.
    half_space
        The true gap on a half-space; separate patches have a plane each.
    turned
        The true gap on a half-space with each pressure along its own normal; None for a single lobe.
    quadratic
        Hertz's gap on a half-space, with as many nodes a semi-axis.
    point_noise
        None where both profiles are exact lines.
    limits
        What stopped a refinement.
    short_of_memory
        Whether the machine had too little memory for what the case asks for.
    """

    case: Case
    levels: tuple[Level, ...]
    half_space: Rung
    quadratic: Rung
    point_noise: PointNoise | None
    turned: Rung | None = None
    limits: tuple[str, ...] = ()
    short_of_memory: bool = False

    @property
    def rungs(self) -> tuple[tuple[str, Rung], ...]:
        """The rungs above Hertz by their names, in the order of the ladder."""
        return (
            ("half_space_quadratic", self.quadratic),
            ("half_space", self.half_space),
            ("elements", self.levels[0].on_elements),
            ("fe", self.levels[0].fe),
        )

    @property
    def status(self) -> Status:
        """`converged` if all solutions are, on all meshes; otherwise why the load must not be used."""
        for level in self.levels:
            if level.status != "converged":
                return level.status
        noise = self.point_noise
        of_points = () if noise is None else [one for one in (noise.own, *noise.others) if one is not None]
        turned = () if self.turned is None else (self.turned,)
        of_rungs = _worst_status(self.half_space, self.quadratic, *turned, *(rung for _, rung in of_points))
        return ELEMENTS_OFF if of_rungs == "converged" and _elements_off(self) else of_rungs


@dataclass(frozen=True, kw_only=True, eq=False)
class SideJudgement:
    """Hertz with the curvature on one side of the first touch point, against the finite elements."""

    side: Side
    hertz: HertzContact
    measures: Measures
    deviation: Mapping[str, float]
    uncertainty: Mapping[str, float]
    verdict: Verdict


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedLoad:
    """A solved load and everything that is read from it.

    Attributes
    ----------
    sides
        One entry, or two (gauge side, field side) where the touch point lies at a curvature junction, so that Hertz's
        ellipse is not defined.
    comparison, ladder, geometry
        The finest mesh against Hertz on the field side, the rungs between both, and the profiles below the patch.
    bodies_step_uncertainty
        Uncertainty of the relative step of each measure from the half-space to the bodies.
    elements_uncertainty
        Relative uncertainty of the measures on the elements' own nodes, where meshes tell it.
    verdict
        The worst of the sides: who takes either curvature must be able to rely on it.
    warnings
        What does not change the verdict.
    """

    solved: SolvedLoad
    sides: tuple[SideJudgement, ...]
    comparison: Comparison
    ladder: Ladder
    geometry: PatchGeometry
    bodies_step_uncertainty: Mapping[str, float]
    elements_uncertainty: Mapping[str, float]
    verdict: Verdict
    warnings: tuple[str, ...]

    def __repr__(self) -> str:
        case, verdict = self.case, self.verdict
        return (
            f"<JudgedLoad {case.rail} and {case.wheel}, {case.lateral_shift_mm:+z.2f} mm, {self.load_N / 1e3:g} kN:"
            f" {self.status}, Hertz {verdict.answer} by {verdict.measure}>"
        )

    @property
    def case(self) -> Case:
        """The position under this load."""
        return self.solved.case

    @property
    def load_N(self) -> float:
        """The load of the case."""
        return self.solved.case.load_N

    @property
    def level(self) -> Level:
        """The finest pair of meshes."""
        return self.solved.levels[0]

    @property
    def fe(self) -> Rung:
        """Contact between the finite bodies, from the finest meshes."""
        return self.level.fe

    @property
    def status(self) -> Status:
        """`converged`, or why the load must not be used."""
        return self.solved.status

    @property
    def normal_force_N(self) -> float:
        """Force along the contact normal at first touch that the finite elements carry."""
        return self.fe.normal_force_N

    @property
    def hertz(self) -> HertzContact:
        """Hertz's ellipse under that force, with the field side's curvature at a junction."""
        return self.sides[-1].hertz

    @property
    def deviation(self) -> Mapping[str, float]:
        """(Hertz - FE) / FE of each of `MEASURES`, and the `MISFITS`."""
        return self.comparison.deviation

    @property
    def limit_used(self) -> float:
        """By how much the measure that uses most of its limit does so, on the worst side; Hertz is off from 1 on."""
        limits = self.case.criteria.limits
        used = [abs(side.deviation[name]) / limit for side in self.sides for name, limit in limits.items()]
        return math.nan if any(math.isnan(part) for part in used) else max(used)

    @property
    def uncertainty(self) -> Mapping[str, float]:
        """Numerical uncertainty of the deviations, of those where it is known."""
        return self.sides[-1].uncertainty


def judge_load(solved: SolvedLoad, placement: Placement) -> JudgedLoad:
    """Read everything from a solved load, by the criteria of its case."""
    finest, touch = solved.levels[0], placement.first
    judged = judge_sides(solved.case, solved.levels, touch, solved.point_noise)
    hertz = judged[-1].hertz
    comparison = compare(finest.fe, hertz)
    ladder = Ladder.of(hertz, solved.rungs)
    geometry = patch_geometry(placement, finest.fe, hertz, comparison.patch)
    worst = worst_of(judged)
    cause: str | None = None
    if _is_off(judged, worst, solved.case):
        cause = AT_JUNCTION if touch.at_junction else cause_of(ladder.steps, worst.measure, geometry)
    if worst.answer == "UNRESOLVED" and _profile_decides(judged, worst, solved.point_noise):
        cause = PROFILE
    if solved.status == ELEMENTS_OFF:
        cause = ELEMENTS
    return JudgedLoad(
        solved=solved,
        sides=judged,
        comparison=comparison,
        ladder=ladder,
        geometry=geometry,
        bodies_step_uncertainty=_bodies_step_uncertainty(solved, hertz),
        elements_uncertainty=_elements_uncertainty(solved),
        verdict=replace(worst, cause=cause).usable(solved.status == "converged"),
        warnings=(
            *junction_warnings([(side.side, side.verdict, side.deviation) for side in judged]),
            *solved.limits,
            *slide_warnings(finest.slide_mm, comparison),
            *yield_warnings(solved.case, comparison),
        ),
    )


def judge_sides(
    case: Case, levels: Sequence[Level], touch: TouchPoint, point_noise: PointNoise | None, *, meshes: bool = True
) -> tuple[SideJudgement, ...]:
    """Judge Hertz with the curvature of each side of the first touch point, under the finest level's normal force.

    Without `meshes` as if those were exact: by the uncertainty of the profiles alone.
    """
    finest = levels[0].fe
    of_points = {} if point_noise is None else point_noise.uncertainty()
    found = []
    for side, curvature in zip(sides(touch), touch.curvatures, strict=True):
        hertz = hertz_from_hessian(
            curvature.hessian, normal_force_N=finest.normal_force_N, contact_modulus_MPa=case.contact_modulus_MPa
        )
        deviation = deviations(finest, hertz)
        known = uncertainties(levels, partial(_read, hertz=hertz), deviation)
        uncertainty = {name: (value if meshes else 0.0) + of_points.get(name, 0.0) for name, value in known.items()}
        found.append(
            SideJudgement(
                side=side,
                hertz=hertz,
                measures=hertz_measures(hertz),
                deviation=deviation,
                uncertainty=uncertainty,
                verdict=judge(deviation, uncertainty, case.criteria),
            )
        )
    return tuple(found)


def uncertainties(
    levels: Sequence[Level], read: Callable[[Rung], Mapping[str, float]], deviation: Mapping[str, float]
) -> dict[str, float]:
    """Uncertainty of each deviation, where meshes tell it; `read` reads all measures off a rung."""
    finest = levels[0]
    measured, otherwise = [read(level.fe) for level in levels], read(finest.otherwise)
    parting, shared = patches_just_part(level.fe for level in levels), patch_of(finest.fe).pieces > 1
    found = {}
    for name in deviation:
        values = [one[name] for one in measured]
        known = uncertainty(
            name,
            values,
            otherwise=otherwise[name],
            residual=finest.fe.residual,
            compliance_error=finest.compliance_error,
            parting=parting,
            shared=shared,
        )
        if known is not None:
            # of (Hertz - FE) / FE, from that of the finite-element measure
            found[name] = known * abs(1.0 + deviation[name]) if name in MEASURES else known
    return found


def patches_just_part(rungs: Iterable[Rung]) -> bool:
    """Whether on any mesh two lobes hang together by little pressure, or patches lie apart by little."""
    return any(_just_parts(rung) for rung in rungs)


def _just_parts(rung: Rung) -> bool:
    ridge = rung.pressure_MPa.max(axis=0)
    below = np.flatnonzero(ridge)
    columns = lobe_columns(rung.pressure.whole().values)
    if len(columns) == 1:
        return False
    # between two lobes either the pressure that is left there, or the surface that is free
    least = min(float(ridge[own.start]) for own in columns[1:])
    free = int(np.diff(below).max()) - 1
    return least < _LITTLE * float(ridge.max()) and free < _LITTLE * below.size


def _read(rung: Rung, hertz: HertzContact) -> dict[str, float]:
    return measures_of(rung).as_dict() | misfit_of(rung, hertz).as_dict()


def _on_each(rungs: Sequence[Rung], hertz: HertzContact) -> dict[str, list[float]]:
    """All measures on several rungs."""
    read = [_read(rung, hertz) for rung in rungs]
    return {name: [values[name] for values in read] for name in (*MEASURES, *MISFITS)}


def worst_of(judged: Sequence[SideJudgement]) -> Verdict:
    """The worst verdict of the sides, that of the field side where both are the same."""
    return max((side.verdict for side in reversed(judged)), key=lambda verdict: FROM_BEST.index(verdict.answer))


def _profile_decides(judged: Sequence[SideJudgement], worst: Verdict, noise: PointNoise | None) -> bool:
    """Whether most of the uncertainty of the measure that leaves the verdict open is the measured profile's."""
    if noise is None:
        return False
    part = noise.uncertainty().get(worst.measure, 0.0)
    whole = next(side for side in reversed(judged) if side.verdict == worst).uncertainty.get(worst.measure, 0.0)
    # what is not a number is not known, for want of a contact
    return not part <= 0.5 * whole


def _is_off(judged: Sequence[SideJudgement], worst: Verdict, case: Case) -> bool:
    """Whether Hertz fails, or would if the numbers were exact: an open verdict by itself needs no cause."""
    limit = case.criteria.limits[worst.measure]
    return worst.answer != "HOLDS" and any(abs(side.deviation[worst.measure]) > limit for side in judged)


def _elements_off(solved: SolvedLoad) -> bool:
    """Whether the elements of the finest meshes are not those of their material.

    Seen by their compliance far from a pressure, or by their own contact: it is the finer nodes' one but for what its
    meshes leave open. Of 24 contacts with healthy elements it stays within half of that.
    """
    finest, coarser = solved.levels[:2]
    if abs(finest.compliance_error) > COMPLIANCE_LIMIT:
        return True
    own, fine, before = (measures_of(rung).as_dict() for rung in (finest.on_elements, finest.fe, coarser.fe))
    unsure = _elements_uncertainty(solved)
    return any(
        abs(own[name] / fine[name] - 1.0) > _APART * (unsure[name] + abs(before[name] / fine[name] - 1.0))
        for name in ("p_max_MPa", "a_mm", "b_mm")
    )


def _elements_uncertainty(solved: SolvedLoad) -> dict[str, float]:
    """Uncertainty of each measure on the elements' own nodes, from those of its meshes."""
    finest, rungs = solved.levels[0], [level.on_elements for level in solved.levels]
    patch, (step_x, step_s) = patch_of(rungs[0]), rungs[0].grid.steps_mm
    elements = min(patch.a_mm / step_x, patch.b_mm / step_s / len(patch.lobes))
    read = [measures_of(rung).as_dict() for rung in rungs]
    found = {
        name: elements_uncertainty(
            name,
            [values[name] for values in read],
            elements=elements,
            compliance_error=finest.compliance_error,
            residual=finest.nodal.residual,
        )
        for name in MEASURES
    }
    return {name: value for name, value in found.items() if value is not None}


def _bodies_step_uncertainty(solved: SolvedLoad, hertz: HertzContact) -> dict[str, float]:
    """Uncertainty of the step of each measure from the half-space to the bodies; it has no approach.

    The half-space of several lobes is not a single thing where the surface turns from one to the other: what lies
    between planes for patches and normals that all turn is a part.
    """
    finest = solved.levels[0]
    on_half_space, otherwise = _on_each([solved.half_space], hertz), _on_each([finest.otherwise], hertz)
    turned = on_half_space if solved.turned is None else _on_each([solved.turned], hertz)
    parting, shared = patches_just_part(level.fe for level in solved.levels), patch_of(finest.fe).pieces > 1
    found = {}
    for name, values in _on_each([level.fe for level in solved.levels], hertz).items():
        if FLOORS[name] is not None:
            flat = on_half_space[name][0]
            ratio, size = (values[0] / flat, abs(flat)) if name in MEASURES else (1.0, 1.0)
            of_meshes = step_uncertainty(
                name,
                values,
                otherwise=otherwise[name][0],
                residual=finest.fe.residual,
                compliance_error=finest.compliance_error,
                parting=parting,
                shared=shared,
            )
            found[name] = abs(ratio) * (of_meshes + abs(turned[name][0] - flat) / size)
    return found
