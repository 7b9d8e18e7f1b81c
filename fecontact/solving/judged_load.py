"""One load on as many meshes as its verdict takes: uncertainty, judgement, ladder and cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case, Criteria
from fecontact.comparison.ladder import Ladder, patch_geometry, quadratic_rung
from fecontact.comparison.measures import MEASURES, Measures, deviations, hertz_measures
from fecontact.comparison.uncertainty import MESH_RATIO, estimate
from fecontact.comparison.verdict import AT_JUNCTION, Answer, Judgement, PatchGeometry, cause_of, judge
from fecontact.errors import InputError
from fecontact.solving.levels import Level, LoadedMesh, level_of
from fecontact.solving.position import Position, points_part
from fecontact.theory.touch_hertz import Side

# The case's own mesh, a coarser one, and two refinements.
_MOST_MESHES = 4
_FROM_BEST: tuple[Answer, ...] = ("HOLDS", "UNRESOLVED", "FAILS")


@dataclass(frozen=True, kw_only=True, eq=False)
class SideJudgement:
    """Hertz with the curvature on one side of the first touch point, against the finite elements."""

    side: Side
    hertz: Measures
    deviation: Mapping[str, float]
    uncertainty: Mapping[str, float]
    judgement: Judgement


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedLoad:
    """A load on all its meshes, the finest first, judged with both sides of the touch point; what stopped a refinement.

    `sides` has one entry, or two (gauge side, field side) where the touch point lies at a junction.
    """

    levels: tuple[Level, ...]
    sides: tuple[SideJudgement, ...]
    limits: tuple[str, ...]

    @property
    def judgement(self) -> Judgement:
        """The worst of the sides: who takes either curvature must be able to rely on it."""
        return _worst(self.sides)

    @property
    def uncertainty(self) -> dict[str, float]:
        """Numerical uncertainty of each deviation of the finest level from Hertz on the field side."""
        return dict(self.sides[-1].uncertainty)

    def climb(self, position: Position) -> tuple[Ladder, PatchGeometry, str | None]:
        """Ladder and geometry of the finest level, and the cause where Hertz is off by more than a limit."""
        level, placement = self.levels[0], position.placement
        grid = level.bodies.grid
        ladder = Ladder(
            hertz=level.comparison.hertz,
            half_space_quadratic=quadratic_rung(grid, placement.first, level.hertz),
            half_space=level.half_space_measures(position),
            fe=level.comparison.fe,
        )
        pressure = level.solution.pressure_MPa.reshape(grid.shape)
        geometry = patch_geometry(placement, grid, pressure, level.hertz, level.comparison.pieces)
        cause: str | None = None
        if self._is_off(position.case.criteria):
            at_junction = placement.first.at_junction
            cause = AT_JUNCTION if at_junction else cause_of(ladder.steps, self.judgement.measure, geometry)
        return ladder, geometry, cause

    def bodies_step_uncertainty(self, position: Position) -> dict[str, float]:
        """Uncertainty of the relative step of each measure from the half-space to the bodies.

        Both rungs have the same nodes, so that most of their discretisation error is not in their ratio.
        """
        residual = self.levels[0].solution.residual
        half_space = [level.half_space_measures(position).as_dict() for level in self.levels]
        found = {}
        for name in MEASURES:
            ratios = [
                getattr(level.comparison.fe, name) / before[name]
                for level, before in zip(self.levels, half_space, strict=True)
            ]
            found[name] = estimate(ratios, residual=residual).relative * abs(ratios[0])
        return found

    def _is_off(self, criteria: Criteria) -> bool:
        """Whether Hertz fails, or would if the numbers were exact: an open verdict by itself needs no cause."""
        measure = self.judgement.measure
        off = any(abs(side.deviation[measure]) > criteria.limits[measure] for side in self.sides)
        return self.judgement.verdict != "HOLDS" and off

    @property
    def verdict(self) -> Answer:
        """The judgement, which a result that must not be used leaves open."""
        return self.judgement.verdict if self.levels[0].status == "converged" else "UNRESOLVED"


class Meshes:
    """The meshes of a position, each made when it is first needed and solved for any number of loads.

    Parameters
    ----------
    position
        Its expected patch decides about zone and element size of all meshes.
    keep
        Whether the factors stay for further loads until `close`; otherwise they go as soon as a load is solved.
    """

    def __init__(self, position: Position, *, keep: bool = False) -> None:
        """Make no mesh yet."""
        self.position = position
        self._keep = keep
        self._meshes: dict[float, LoadedMesh] = {}

    def solve(self, load_N: float) -> JudgedLoad:
        """Solve a load on two meshes and judge it; refine while the verdict stays open and the limit allows."""
        case = replace(self.position.case, load_N=load_N)
        levels = [self._level(case, 1.0), self._level(case, MESH_RATIO)]
        limits: list[str] = []
        with self.position.clock.step("expect the patch"):
            of_points = points_part(case, self.position.placement)
        sides = _judge(case, levels, of_points)
        while _worst(sides).verdict == "UNRESOLVED" and levels[0].status == "converged" and len(levels) < _MOST_MESHES:
            finer = MESH_RATIO ** (1 - len(levels))
            expected = _finer_degrees_of_freedom(levels)
            if expected > case.refine_degrees_of_freedom:
                limits.append(
                    f"refinement stopped: the next meshes would have about {expected} of at most"
                    f" {case.refine_degrees_of_freedom} degrees of freedom"
                )
                break
            try:
                levels.insert(0, self._level(case, finer))
            except InputError as error:
                limits.append(f"refinement stopped: {error}")
                break
            sides = _judge(case, levels, of_points)
        return JudgedLoad(levels=tuple(levels), sides=sides, limits=tuple(limits))

    def close(self) -> None:
        """Release all factors; a further load makes its meshes again."""
        for mesh in self._meshes.values():
            mesh.close()
        self._meshes.clear()

    def _level(self, case: Case, coarser: float) -> Level:
        mesh = self._meshes.get(coarser) or LoadedMesh(self.position, coarser)
        half_space, solution, at_edge = mesh.solve(case)
        displacement: dict[str, NDArray[np.float64]] = {}
        if self._keep:
            self._meshes[coarser] = mesh
        else:
            with self.position.clock.step("recover"):
                u_rail, u_wheel = mesh.bodies.displacements(solution.pressure_MPa)
                displacement = {"rail": u_rail, "wheel": u_wheel}
                mesh.close()
        return level_of(self.position, case, mesh, (half_space, solution), at_edge, displacement)


def _judge(case: Case, levels: Sequence[Level], of_points: Mapping[str, float]) -> tuple[SideJudgement, ...]:
    """Judge Hertz with the curvature of each side of the first touch point, under the finest level's normal force."""
    finest = levels[0]
    relative = {}
    for name in MEASURES:
        values = [getattr(level.comparison.fe, name) for level in levels]
        reading = finest.comparison.area_reading if name == "area_mm2" else 0.0
        relative[name] = estimate(values, residual=finest.solution.residual, reading=reading).relative
    found = []
    for side, hertz in finest.hertz_sides:
        measures = hertz_measures(hertz)
        deviation = deviations(measures, finest.comparison.fe)
        # of (Hertz - FE) / FE, from that of the finite-element measure
        uncertainty = {name: relative[name] * abs(1.0 + deviation[name]) + of_points[name] for name in MEASURES}
        found.append(
            SideJudgement(
                side=side,
                hertz=measures,
                deviation=deviation,
                uncertainty=uncertainty,
                judgement=judge(deviation, uncertainty, case.criteria),
            )
        )
    return tuple(found)


def _finer_degrees_of_freedom(levels: Sequence[Level]) -> int:
    """Degrees of freedom to expect of the next finer meshes: graded ones grow less than with the cube of MESH_RATIO."""
    fine, coarse = levels[0].degrees_of_freedom, levels[1].degrees_of_freedom
    # the uniform zone grows faster than the rest, so that the ratio grows too
    return int(fine * min((fine / coarse) ** 1.2, MESH_RATIO**3))


def _worst(sides: Sequence[SideJudgement]) -> Judgement:
    return max((side.judgement for side in reversed(sides)), key=lambda judgement: _FROM_BEST.index(judgement.verdict))
