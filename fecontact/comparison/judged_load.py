"""A load as it was solved, on all its meshes, and what it says of Hertz: everything that a verdict is made of.

A solved load is fields and numbers alone. Judging it needs no finite elements, so that one that was stored is judged
again in milliseconds, with other criteria or by other readings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from fecontact.case import Case
from fecontact.comparison.compare import Comparison, compare
from fecontact.comparison.ladder import Ladder, patch_geometry
from fecontact.comparison.measures import (
    MEASURES,
    Measures,
    deviations,
    hertz_measures,
    measures_of,
    patch_of,
    reading_uncertainty,
)
from fecontact.comparison.uncertainty import estimate
from fecontact.comparison.verdict import AT_JUNCTION, Answer, PatchGeometry, Verdict, cause_of, judge
from fecontact.comparison.warnings import junction_warnings, yield_warnings
from fecontact.contact.rung import Rung
from fecontact.geometry.placement import Placement
from fecontact.geometry.touch_points import TouchPoint
from fecontact.theory.hertz import HertzContact, hertz_from_hessian
from fecontact.theory.touch_hertz import Side, sides

Status = Literal["converged", "not converged", "patch at the edge of the fine mesh"]
_FROM_BEST: tuple[Answer, ...] = ("HOLDS", "UNRESOLVED", "FAILS")


@dataclass(frozen=True, kw_only=True, eq=False)
class Level:
    """A load solved on one pair of meshes.

    Attributes
    ----------
    half_space, fe
        Contact of the true gap on a half-space, and between the finite bodies, on the same nodes.
    degrees_of_freedom, elements
        Of rail and wheel.
    enlarged, at_edge
        How often the fine zone was enlarged, and whether the patch still came to its edge.
    """

    half_space: Rung
    fe: Rung
    degrees_of_freedom: Mapping[str, int]
    elements: Mapping[str, int]
    enlarged: int
    at_edge: bool

    @property
    def status(self) -> Status:
        """Whether the level may be used."""
        return "patch at the edge of the fine mesh" if self.at_edge else self.fe.status


@dataclass(frozen=True, kw_only=True, eq=False)
class PointNoise:
    """Hertz and the half-space under the true gap, for profiles given by points as they are and with half of them.

    `thinned` has every second point left out; None where such profiles do not come into contact.
    """

    own: tuple[HertzContact, Rung]
    thinned: tuple[HertzContact, Rung] | None

    def uncertainty(self) -> dict[str, float]:
        """Change of each deviation of Hertz from the half-space, which sees noise and spacing alike; NaN without."""
        own = _half_space_deviations(self.own)
        if self.thinned is None:
            return dict.fromkeys(MEASURES, float("nan"))
        other = _half_space_deviations(self.thinned)
        return {name: abs(other[name] - own[name]) for name in MEASURES}


def _half_space_deviations(solved: tuple[HertzContact, Rung]) -> dict[str, float]:
    hertz, rung = solved
    return deviations(hertz_measures(hertz), measures_of(rung))


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedLoad:
    """A load at a position, solved on two meshes or more.

    Attributes
    ----------
    case
        The position under this load.
    levels
        One a pair of meshes, the finest first.
    quadratic
        Hertz's gap on a discrete half-space, with the spacing of the finest mesh.
    point_noise
        None where both profiles are exact lines.
    limits
        What stopped a refinement.
    short_of_memory
        Whether the machine had too little memory for what the case asks for.
    """

    case: Case
    levels: tuple[Level, ...]
    quadratic: Rung
    point_noise: PointNoise | None
    limits: tuple[str, ...] = ()
    short_of_memory: bool = False


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
    verdict: Verdict
    warnings: tuple[str, ...]

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
        """Contact of the finite elements on the finest meshes."""
        return self.level.fe

    @property
    def status(self) -> Status:
        """`converged`, or why the load must not be used."""
        return self.level.status

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
        """(Hertz - FE) / FE of each measure."""
        return self.comparison.deviation

    @property
    def uncertainty(self) -> Mapping[str, float]:
        """Numerical uncertainty of each deviation."""
        return self.sides[-1].uncertainty


def judge_load(solved: SolvedLoad, placement: Placement) -> JudgedLoad:
    """Read everything from a solved load, by the criteria of its case."""
    finest, touch = solved.levels[0], placement.first
    judged = judge_sides(solved.case, solved.levels, touch, solved.point_noise)
    hertz = judged[-1].hertz
    comparison = compare(finest.fe, hertz)
    ladder = Ladder(
        hertz=comparison.hertz,
        half_space_quadratic=measures_of(solved.quadratic),
        half_space=measures_of(finest.half_space),
        fe=comparison.fe,
    )
    geometry = patch_geometry(placement, finest.fe, hertz, comparison.pieces)
    worst = worst_of(judged)
    cause: str | None = None
    if _is_off(judged, worst, solved.case):
        cause = AT_JUNCTION if touch.at_junction else cause_of(ladder.steps, worst.measure, geometry)
    return JudgedLoad(
        solved=solved,
        sides=judged,
        comparison=comparison,
        ladder=ladder,
        geometry=geometry,
        bodies_step_uncertainty=_bodies_step_uncertainty(solved.levels),
        # a result that must not be used leaves it open
        verdict=replace(worst, cause=cause, answer=worst.answer if finest.status == "converged" else "UNRESOLVED"),
        warnings=(
            *junction_warnings([(side.side, side.verdict, side.deviation) for side in judged]),
            *solved.limits,
            *yield_warnings(solved.case, comparison),
        ),
    )


def judge_sides(
    case: Case, levels: Sequence[Level], touch: TouchPoint, point_noise: PointNoise | None
) -> tuple[SideJudgement, ...]:
    """Judge Hertz with the curvature of each side of the first touch point, under the finest level's normal force."""
    finest = levels[0].fe
    of_points = dict.fromkeys(MEASURES, 0.0) if point_noise is None else point_noise.uncertainty()
    measured = [measures_of(level.fe) for level in levels]
    reading = reading_uncertainty(patch_of(finest))
    relative = {
        name: estimate(
            [getattr(one, name) for one in measured], residual=finest.residual, reading=reading[name]
        ).relative
        for name in MEASURES
    }
    found = []
    for side, curvature in zip(sides(touch), touch.curvatures, strict=True):
        hertz = hertz_from_hessian(
            curvature.hessian, normal_force_N=finest.normal_force_N, contact_modulus_MPa=case.contact_modulus_MPa
        )
        measures = hertz_measures(hertz)
        deviation = deviations(measures, measured[0])
        # of (Hertz - FE) / FE, from that of the finite-element measure
        uncertainty = {name: relative[name] * abs(1.0 + deviation[name]) + of_points[name] for name in MEASURES}
        found.append(
            SideJudgement(
                side=side,
                hertz=hertz,
                measures=measures,
                deviation=deviation,
                uncertainty=uncertainty,
                verdict=judge(deviation, uncertainty, case.criteria),
            )
        )
    return tuple(found)


def worst_of(judged: Sequence[SideJudgement]) -> Verdict:
    """The worst verdict of the sides, that of the field side where both are the same."""
    return max((side.verdict for side in reversed(judged)), key=lambda verdict: _FROM_BEST.index(verdict.answer))


def _is_off(judged: Sequence[SideJudgement], worst: Verdict, case: Case) -> bool:
    """Whether Hertz fails, or would if the numbers were exact: an open verdict by itself needs no cause."""
    limit = case.criteria.limits[worst.measure]
    return worst.answer != "HOLDS" and any(abs(side.deviation[worst.measure]) > limit for side in judged)


def _bodies_step_uncertainty(levels: Sequence[Level]) -> dict[str, float]:
    """Uncertainty of the relative step of each measure from the half-space to the bodies.

    Both rungs have the same nodes, so that most of their discretisation error is not in their ratio.
    """
    pairs = [(measures_of(level.fe).as_dict(), measures_of(level.half_space).as_dict()) for level in levels]
    found = {}
    for name in MEASURES:
        ratios = [fe[name] / half_space[name] for fe, half_space in pairs]
        found[name] = estimate(ratios, residual=levels[0].fe.residual).relative * abs(ratios[0])
    return found
