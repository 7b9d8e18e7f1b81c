"""The pipeline from a case to its result: placement, meshes, contact, Hertz, comparison, verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case
from fecontact.comparison.compare import Comparison
from fecontact.comparison.ladder import Ladder
from fecontact.comparison.verdict import Answer, PatchGeometry
from fecontact.contact.grid import ContactGrid
from fecontact.fe.coupling import CoupledBodies
from fecontact.fe.linear_solver import SolverName
from fecontact.fe.meshing import BodyMesh
from fecontact.fe.stress_peak import StressPeak, stress_peak
from fecontact.geometry.placement import Placement
from fecontact.solving.expected_patch import ExpectedPatch
from fecontact.solving.judged_load import JudgedLoad, Meshes, SideJudgement
from fecontact.solving.levels import Status
from fecontact.solving.position import Position, Progress, hertz_points_of_case, position_of
from fecontact.theory.axis_stress import first_yield_p0_MPa
from fecontact.theory.hertz import HertzContact
from fecontact.theory.touch_hertz import HertzPoints

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class SolverRecord:
    """How the contact was solved: path, work, residuals, wall seconds and resident memory at the end of each step."""

    path: SolverName
    iterations: int
    compliance_calls: int
    contact_residual: float
    penetration_residual: float
    load_balance: float
    degrees_of_freedom: dict[str, int]
    elements: dict[str, int]
    element_size_mm: tuple[float, float]
    meshes: int
    zone_enlarged: int
    seconds: dict[str, float]
    memory_MB: dict[str, float]
    peak_memory_MB: float


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Whether Hertz holds, the measure that decided, and why it does not; warnings that do not change it.

    At a curvature junction Hertz's ellipse is not defined: `sides` has it with the curvature of either side, and the
    verdict is the worse of the two.
    """

    verdict: Answer
    measure: str
    cause: str | None
    sides: tuple[SideJudgement, ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseResult:
    """Everything that a case gives.

    Attributes
    ----------
    status
        `converged`, or why the result must not be used.
    normal_force_N
        Force along the contact normal at first touch that the finite elements carry.
    grid, pressure_MPa, gap_mm (nx, ns), in_contact
        Pressure nodes, the finite-element pressure and the deformed gap on them.
    surface_points_mm (nx, ns, 3)
        The pressure nodes on the true rail, in the track frame.
    hertz, hertz_points
        Hertz's ellipse at the first touch point under `normal_force_N`, and those at all touch points.
    ladder, bodies_step_uncertainty, geometry
        The rungs between Hertz and the finite elements, how sure the relative step of each measure from the half-space
        to the bodies is, and what the profiles do below the patch.
    uncertainty
        Numerical uncertainty of each deviation of `comparison`, from the meshes, the residuals and the cut planes.
    displacement_mm
        Displacements (n, 3) of the meshes' nodes, base held and driver held: the rigid approach is not in them.
    von_mises
        Largest von Mises stress of rail and wheel, and where it lies.
    """

    case: Case
    status: Status
    placement: Placement
    expected: ExpectedPatch
    normal_force_N: float
    grid: ContactGrid
    pressure_MPa: Floats
    gap_mm: Floats
    surface_points_mm: Floats
    hertz: HertzContact
    hertz_points: HertzPoints
    comparison: Comparison
    ladder: Ladder
    bodies_step_uncertainty: dict[str, float]
    geometry: PatchGeometry
    uncertainty: dict[str, float]
    verdict: Verdict
    bodies: CoupledBodies
    displacement_mm: dict[str, Floats]
    von_mises: dict[str, StressPeak]
    solver: SolverRecord
    warnings: tuple[str, ...] = field(default=())

    @property
    def meshes(self) -> dict[str, BodyMesh]:
        """Meshes of rail and wheel."""
        return {"rail": self.bodies.rail.mesh, "wheel": self.bodies.wheel.mesh}


def solve(case: Case, *, progress: Progress | None = None) -> CaseResult:
    """Solve one case on two meshes, climb the ladder from Hertz, and judge; refine where the verdict stays open.

    Parameters
    ----------
    progress
        Called with the name of each step as it begins.

    Raises
    ------
    InputError
        For inputs that cannot be solved, naming value, range and remedy. A contact that does not converge is not an
        error but a result whose `status` says so.
    """
    position = position_of(case, progress=progress)
    judged = Meshes(position).solve(case.load_N)
    with position.clock.step("climb the ladder"):
        return _result(position, judged)


def _result(position: Position, judged: JudgedLoad) -> CaseResult:
    case, placement, clock = position.case, position.placement, position.clock
    level = judged.levels[0]
    grid, solution, bodies, comparison = level.bodies.grid, level.solution, level.bodies, level.comparison
    ladder, geometry, cause = judged.climb(position)
    verdict = Verdict(
        verdict=judged.verdict,
        measure=judged.judgement.measure,
        cause=cause,
        sides=judged.sides,
        warnings=(*_junction_warning(judged.sides), *judged.limits, *_yield_warning(case, comparison)),
    )
    return CaseResult(
        case=case,
        status=level.status,
        placement=placement,
        expected=position.expected,
        normal_force_N=level.normal_force_N,
        grid=grid,
        pressure_MPa=solution.pressure_MPa.reshape(grid.shape),
        gap_mm=solution.gap_mm.reshape(grid.shape),
        surface_points_mm=placement.surface(grid.x_mm[:, None], grid.s_mm[None, :])[0],
        hertz=level.hertz,
        hertz_points=hertz_points_of_case(case, placement),
        comparison=comparison,
        ladder=ladder,
        bodies_step_uncertainty=judged.bodies_step_uncertainty(position),
        geometry=geometry,
        uncertainty=judged.uncertainty,
        verdict=verdict,
        bodies=bodies,
        displacement_mm=level.displacement_mm,
        von_mises={
            b.mesh.name: stress_peak(b, level.displacement_mm[b.mesh.name]) for b in (bodies.rail, bodies.wheel)
        },
        solver=SolverRecord(
            path=bodies.rail.solver,
            iterations=solution.iterations,
            compliance_calls=solution.compliance_calls,
            contact_residual=solution.contact_residual,
            penetration_residual=solution.penetration_residual,
            load_balance=solution.load_balance,
            degrees_of_freedom={b.mesh.name: 3 * len(b.mesh.points) for b in (bodies.rail, bodies.wheel)},
            elements={b.mesh.name: len(b.mesh.hexes) for b in (bodies.rail, bodies.wheel)},
            element_size_mm=grid.steps_mm,
            meshes=len(judged.levels),
            zone_enlarged=level.enlarged,
            seconds=clock.seconds,
            memory_MB=clock.memory_MB,
            peak_memory_MB=_peak_memory_MB(),
        ),
        warnings=_warnings(placement, comparison),
    )


def _junction_warning(sides: Sequence[SideJudgement]) -> list[str]:
    """What Hertz says with the curvature of either side of a junction."""
    if len(sides) == 1:
        return []
    said = (
        f"with that of its {side.side} side Hertz {side.judgement.verdict} ({side.deviation['p_max_MPa']:+.1%} in peak"
        f" pressure, {side.deviation['area_mm2']:+.1%} in area)"
        for side in sides
    )
    return [f"the curvature is undefined at the touch point: {'; '.join(said)}"]


def _yield_warning(case: Case, comparison: Comparison) -> list[str]:
    """First yield below a Hertz ellipse of the finite elements' peak pressure."""
    found = []
    for name, material in (("rail", case.rail_material), ("wheel", case.wheel_material)):
        if material.yield_MPa is None:
            continue
        limit = first_yield_p0_MPa(
            a_mm=comparison.hertz.a_mm,
            b_mm=comparison.hertz.b_mm,
            poisson=material.poisson,
            yield_MPa=material.yield_MPa,
        )
        if comparison.fe.p_max_MPa > limit:
            found.append(
                f"first yield: the {name} yields below the surface at a peak pressure of {limit:.0f} MPa, it is"
                f" {comparison.fe.p_max_MPa:.0f} MPa; the verdict is that of elastic bodies"
            )
    return found


def _warnings(placement: Placement, comparison: Comparison) -> tuple[str, ...]:
    found = [*placement.rail.profile.notes, *placement.wheel.profile.notes]
    if not placement.rail.profile.outline:
        found.append(
            f"rail {placement.rail.profile.name}: only its running surface is known; the body below"
            " it is a block down to the cut"
        )
    if placement.first.at_junction:
        found.append(
            "the touch point lies at a curvature junction: deviations are those from Hertz with the curvature of its"
            " field side; the verdict is the worse of both sides"
        )
    if comparison.pieces > 1:
        found.append(
            f"the contact has {comparison.pieces} separate patches; Hertz stands for the first touch point alone"
        )
    return tuple(found)


def _peak_memory_MB() -> float:
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0 / 1e6
