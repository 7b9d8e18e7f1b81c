"""The pipeline from a case to its result: profiles, placement, meshes, elasticity, contact, Hertz, comparison."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
import psutil
from numpy.typing import NDArray

from fecontact.applicability import AT_JUNCTION, Answer, Criteria, Judgement, PatchGeometry, cause_of, judge
from fecontact.case import RESOLUTIONS, Case
from fecontact.comparison import MEASURES, Comparison, Measures, compare, deviations, hertz_measures, measure
from fecontact.contact import Compliance, ContactProblem, ContactSolution, solve_contact
from fecontact.defect_correction import model_of, solve_by_correction
from fecontact.elasticity import SolverName, check_memory, choose_solver, elastic_body, stiffness
from fecontact.errors import ConvergenceError, InputError
from fecontact.expected_patch import ExpectedPatch, approach_direction, expected_patch
from fecontact.halfspace import half_space_compliance
from fecontact.hertz import HertzContact, first_yield_p0_MPa, hertz_from_hessian
from fecontact.ladder import Ladder, patch_geometry, quadratic_rung
from fecontact.material import contact_modulus_MPa
from fecontact.meshing import BodyMesh, FineZone, least_memory_bytes, rail_mesh, wheel_mesh
from fecontact.mortar import ContactGrid, CoupledBodies, mortar_matrix
from fecontact.placement import Placement, RelativeCurvature, place
from fecontact.profiles import Profile, has_no_gauge_face, resolve_rail, resolve_wheel
from fecontact.subsurface import StressPeak, stress_peak
from fecontact.touch_hertz import HertzPoints, Side, hertz_points, sides
from fecontact.uncertainty import MESH_RATIO, estimate

_log = logging.getLogger(__name__)

Floats = NDArray[np.float64]
Status = Literal["converged", "not converged", "patch at the edge of the fine mesh"]
Progress = Callable[[str], None]

# Free room around the expected patch, in elements; a patch within EDGE_ELEMENTS of the edge enlarges the zone.
_MARGIN_ELEMENTS = 4
EDGE_ELEMENTS = 2
# The patch's edge should not fall on a line of nodes: their cells are half covered, and the pressure there is compared
# with zero. A quarter of an element more on a semi-axis takes a third off the L2 error of an elliptic contact.
_OFF_THE_EDGE = 0.25
_ENLARGEMENTS = 4
# The case's own mesh, a coarser one, and two refinements.
_MOST_MESHES = 4


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


@dataclass(frozen=True, kw_only=True, eq=False)
class SideJudgement:
    """Hertz with the curvature on one side of the first touch point, against the finite elements."""

    side: Side
    hertz: Measures
    deviation: Mapping[str, float]
    uncertainty: Mapping[str, float]
    judgement: Judgement


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


class _Clock:
    """Wall seconds and memory by step."""

    def __init__(self, progress: Progress | None) -> None:
        self.seconds: dict[str, float] = {}
        self.memory_MB: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        if self._progress is not None:
            self._progress(name)
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
            self.memory_MB[name] = psutil.Process().memory_info().rss / 1e6


def place_case(case: Case, *, rail: Profile | None = None, wheel: Profile | None = None) -> Placement:
    """Put the wheel of a case on its rail; `rail` and `wheel` stand for the case's own lines where given.

    Raises
    ------
    InputError
        For profiles that cannot be read and positions in which the wheel does not run on the rail.
    """
    case_wheel = resolve_wheel(case.wheel)
    track = case.track
    if has_no_gauge_face(case.rail) and track.rail_crown_y_mm is None:
        track = replace(track, rail_crown_y_mm=track.tape_circle_y_mm)
    return place(
        rail or resolve_rail(case.rail),
        wheel or case_wheel.profile,
        inclination_rad=case.inclination_rad,
        lateral_shift_mm=case.lateral_shift_mm,
        roll_rad=case.roll_rad,
        yaw_rad=case.yaw_rad,
        rolling_radius_mm=case_wheel.rolling_radius_mm or case.rolling_radius_mm,
        track=track,
    )


def hertz_of_case(case: Case, placement: Placement, normal_force_N: float | None = None) -> HertzContact:
    """Hertz's ellipse at the first touch point; at a junction that of its field side.

    Raises
    ------
    InputError
        If the surfaces conform at the touch point, so that there is no ellipse.
    """
    touch = placement.first
    if normal_force_N is None:
        tilted = float(touch.normal @ approach_direction(placement, normal_force=case.load_kind == "normal"))
        normal_force_N = case.load_N / tilted
    return _hertz(case, touch.curvatures[-1], normal_force_N)


def _hertz(case: Case, curvature: RelativeCurvature, normal_force_N: float) -> HertzContact:
    return hertz_from_hessian(
        curvature.hessian,
        normal_force_N=normal_force_N,
        contact_modulus_MPa=contact_modulus_MPa(case.rail_material, case.wheel_material),
    )


def hertz_points_of_case(case: Case, placement: Placement) -> HertzPoints:
    """Hertz at all touch points of a case, each with the whole load and all sharing it."""
    return hertz_points(
        placement,
        case.load_N,
        direction=approach_direction(placement, normal_force=case.load_kind == "normal"),
        contact_modulus_MPa=contact_modulus_MPa(case.rail_material, case.wheel_material),
    )


@dataclass(frozen=True, kw_only=True)
class _Room:
    """Free room around the expected patch (mm), where the contact may turn out larger than expected."""

    x: float = 0.0
    s_low: float = 0.0
    s_high: float = 0.0


def element_size_mm(case: Case, expected: ExpectedPatch, hertz: HertzContact) -> tuple[float, float]:
    """Element sizes along x and across: the resolution's elements on the narrowest semi-axis of the expected patch."""
    if not isinstance(case.resolution, str):
        return case.resolution
    count = RESOLUTIONS[case.resolution] + _OFF_THE_EDGE
    return (
        min(expected.semi_axis_x_mm, hertz.a_mm) / count,
        min(expected.semi_axis_s_mm, hertz.b_mm) / count,
    )


def fine_zone(
    case: Case, expected: ExpectedPatch, hertz: HertzContact, room: _Room | None = None, coarser: float = 1.0
) -> FineZone:
    """The uniform zone: the expected patch and a margin, with the resolution's elements on its narrowest semi-axis.

    `coarser` multiplies the element sizes.
    """
    room = room or _Room()
    step_x, step_s = (coarser * size for size in element_size_mm(case, expected, hertz))
    length = max(expected.x_high_mm, -expected.x_low_mm) + _MARGIN_ELEMENTS * step_x + room.x
    low = expected.s_low_mm - _MARGIN_ELEMENTS * step_s - room.s_low
    high = expected.s_high_mm + _MARGIN_ELEMENTS * step_s + room.s_high
    steps = 2 * math.ceil(0.5 * (high - low) / step_s)
    middle = 0.5 * (low + high)
    return FineZone(
        half_length_mm=step_x * math.ceil(length / step_x),
        s_low_mm=middle - 0.5 * steps * step_s,
        s_high_mm=middle + 0.5 * steps * step_s,
        step_x_mm=step_x,
        step_s_mm=step_s,
    )


def _more_room(room: _Room, grid: ContactGrid, contact: NDArray[np.bool_], expected: ExpectedPatch) -> _Room:
    """More room where the contact comes within EDGE_ELEMENTS of the edge; the same room if it nowhere does."""
    rows, columns = np.asarray(contact.any(axis=1)), np.asarray(contact.any(axis=0))
    at_end = bool(rows[-EDGE_ELEMENTS:].any() or (not grid.half and rows[:EDGE_ELEMENTS].any()))
    quarter = 0.25 * (expected.s_high_mm - expected.s_low_mm)
    return _Room(
        x=room.x + (0.25 * expected.x_high_mm if at_end else 0.0),
        s_low=room.s_low + (quarter if columns[:EDGE_ELEMENTS].any() else 0.0),
        s_high=room.s_high + (quarter if columns[-EDGE_ELEMENTS:].any() else 0.0),
    )


def couple(case: Case, placement: Placement, zone: FineZone, clock: _Clock) -> CoupledBodies:
    """Mesh both bodies, assemble and factorise them, and couple their surfaces."""
    check_memory(least_memory_bytes(zone), f"a contact zone of {zone.intervals_x} by {zone.intervals_s} elements")
    with clock.step("mesh"):
        rail = rail_mesh(placement, zone, half=case.half, size=case.size)
        wheel = wheel_mesh(placement, zone, half=case.half, size=case.size)
    path = choose_solver(case.solver, [3 * len(mesh.points) for mesh in (rail, wheel)])
    bodies = []
    for mesh, material in ((rail, case.rail_material), (wheel, case.wheel_material)):
        with clock.step("assemble"):
            matrix = stiffness(mesh, material)
        with clock.step("factorise"):
            bodies.append(elastic_body(mesh, material, path, matrix))
        # the factor is what is kept
        del matrix
    rail_body, wheel_body = bodies
    with clock.step("couple"):
        x = np.linspace(0.0 if case.half else -zone.half_length_mm, zone.half_length_mm, rail.contact_nodes.shape[0])
        s = np.linspace(zone.s_low_mm, zone.s_high_mm, rail.contact_nodes.shape[1])
        grid = ContactGrid(x_mm=x, s_mm=s, half=case.half)
        _, normals = placement.surface(x[:, None], s[None, :])
        wheel_nodes = np.unique(wheel.surfaces["contact"])
        local = np.full(len(wheel.points), -1)
        local[wheel_nodes] = np.arange(wheel_nodes.size)
        return CoupledBodies(
            rail=rail_body,
            wheel=wheel_body,
            grid=grid,
            normals=normals.reshape(-1, 3),
            rail_nodes=rail.contact_nodes.ravel(),
            wheel_nodes=wheel_nodes,
            coupling=mortar_matrix(
                grid, placement.project(wheel.points[wheel_nodes]), local[wheel.surfaces["contact"]]
            ),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class CoupledProblem:
    """The contact problem of a position on one mesh: between the bodies, on a half-space, and a model of the bodies."""

    bodies: ContactProblem
    half_space: ContactProblem
    model: Compliance

    def solve(self, load_N: float) -> tuple[ContactSolution, ContactSolution]:
        """Solve the contact on the half-space, and from there that of the bodies."""
        on_half_space = solve_contact(self.half_space, load_N)
        start = on_half_space.pressure_MPa
        return on_half_space, solve_by_correction(self.bodies, load_N, self.model, start_MPa=start)


def coupled_problem(position: Position, bodies: CoupledBodies) -> CoupledProblem:
    """Set up the contact of coupled bodies; costs one application of their compliance."""
    case, grid = position.case, bodies.grid
    uniform: dict[str, Any] = {
        "nodes_x": grid.shape[0],
        "nodes_s": grid.shape[1],
        "step_x_mm": grid.steps_mm[0],
        "step_s_mm": grid.steps_mm[1],
        "contact_modulus_MPa": contact_modulus_MPa(case.rail_material, case.wheel_material),
        "half": grid.half,
    }
    problem = ContactProblem(
        compliance=bodies.compliance,
        gap_mm=grid.weighted_mean(position.placement.gap),
        closing=bodies.normals @ position.direction,
        area_mm2=grid.whole_area_mm2(),
    )
    return CoupledProblem(
        bodies=problem,
        half_space=replace(problem, compliance=half_space_compliance(**uniform)),
        model=model_of(bodies.compliance, **uniform),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Level:
    """A load solved on one mesh.

    Attributes
    ----------
    half_space, solution
        Contact of the true gap on a half-space, and between the finite bodies.
    enlarged, at_edge
        How often the fine zone was enlarged, and whether the patch still came to its edge.
    displacement_mm
        Displacements (n, 3) of the meshes' nodes; empty where the factors were kept for further loads.
    """

    bodies: CoupledBodies
    half_space: ContactSolution
    solution: ContactSolution
    enlarged: int
    at_edge: bool
    displacement_mm: dict[str, Floats]
    normal_force_N: float
    hertz_sides: tuple[tuple[Side, HertzContact], ...]
    comparison: Comparison

    @property
    def hertz(self) -> HertzContact:
        """Hertz's ellipse, with the field side's curvature at a junction."""
        return self.hertz_sides[-1][1]

    @property
    def degrees_of_freedom(self) -> int:
        """Of both bodies together."""
        return 3 * (len(self.bodies.rail.mesh.points) + len(self.bodies.wheel.mesh.points))

    def half_space_measures(self, position: Position) -> Measures:
        """Measures of the true gap on a half-space."""
        grid = self.bodies.grid
        approach = self.half_space.approach_mm * float(position.direction @ position.placement.first.normal)
        return measure(grid, self.half_space.pressure_MPa.reshape(grid.shape), approach)

    @property
    def status(self) -> Status:
        """Whether the level may be used."""
        return "patch at the edge of the fine mesh" if self.at_edge else self.solution.status


@dataclass(frozen=True, kw_only=True, eq=False)
class Position:
    """What all meshes and loads of a position share; case and expected patch are those that the meshes are made for."""

    case: Case
    placement: Placement
    direction: Floats
    expected: ExpectedPatch
    expected_hertz: HertzContact
    clock: _Clock

    def for_load(self, load_N: float) -> Position:
        """The same position with meshes for another load."""
        case = replace(self.case, load_N=load_N)
        with self.clock.step("expect the patch"):
            hertz = hertz_of_case(case, self.placement)
            return replace(self, case=case, expected=_expect(case, self.placement, hertz), expected_hertz=hertz)

    @property
    def element_size_mm(self) -> tuple[float, float]:
        """Sizes along x and across that the resolution asks for."""
        return element_size_mm(self.case, self.expected, self.expected_hertz)


def position_of(case: Case, *, progress: Progress | None = None) -> Position:
    """Place a case and expect its patch.

    Raises
    ------
    InputError
        As `solve` does.
    """
    clock = _Clock(progress)
    # a solver that is not there is said before any work
    choose_solver(case.solver)
    with clock.step("place"):
        placement = place_case(case)
        direction = approach_direction(placement, normal_force=case.load_kind == "normal")
        expected_hertz = hertz_of_case(case, placement)
    with clock.step("expect the patch"):
        expected = _expect(case, placement, expected_hertz)
    return Position(
        case=case,
        placement=placement,
        direction=direction,
        expected=expected,
        expected_hertz=expected_hertz,
        clock=clock,
    )


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
        finest = self.levels[0]
        residual = finest.solution.contact_residual + finest.solution.penetration_residual
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
        self._meshes: dict[float, _Mesh] = {}

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
        mesh = self._meshes.get(coarser) or _Mesh(self.position, coarser)
        half_space, solution, at_edge = mesh.solve(case)
        displacement: dict[str, Floats] = {}
        if self._keep:
            self._meshes[coarser] = mesh
        else:
            with self.position.clock.step("recover"):
                u_rail, u_wheel = mesh.bodies.displacements(solution.pressure_MPa)
                displacement = {"rail": u_rail, "wheel": u_wheel}
                mesh.close()
        return _level(self.position, case, mesh, (half_space, solution), at_edge, displacement)


class _Mesh:
    """Bodies of a position on one mesh, coupled once; the fine zone grows where a patch comes to its edge."""

    def __init__(self, position: Position, coarser: float) -> None:
        self._position, self._coarser = position, coarser
        self._room = _Room()
        self.enlarged = 0
        self._take(self._couple(self._room))

    def solve(self, case: Case) -> tuple[ContactSolution, ContactSolution, bool]:
        """Contact on a half-space and between the bodies, and whether the patch is at the edge of the zone."""
        position = self._position
        while True:
            with position.clock.step("contact"):
                half_space, solution = self._problem.solve(case.load_N)
            contact = solution.in_contact.reshape(self.bodies.grid.shape)
            more = _more_room(self._room, self.bodies.grid, contact, position.expected)
            if more == self._room or self.enlarged == _ENLARGEMENTS:
                return half_space, solution, more != self._room
            try:
                larger = self._couple(more)
            except InputError as error:
                _log.warning("the contact zone cannot be enlarged: %s", error)
                return half_space, solution, True
            self.bodies.close()
            self._take(larger)
            self._room, self.enlarged = more, self.enlarged + 1

    def close(self) -> None:
        self.bodies.close()

    def _couple(self, room: _Room) -> CoupledBodies:
        position = self._position
        zone = fine_zone(position.case, position.expected, position.expected_hertz, room, self._coarser)
        return couple(position.case, position.placement, zone, position.clock)

    def _take(self, bodies: CoupledBodies) -> None:
        self.bodies = bodies
        with self._position.clock.step("contact"):
            self._problem = coupled_problem(self._position, bodies)


def _level(
    position: Position,
    case: Case,
    mesh: _Mesh,
    solutions: tuple[ContactSolution, ContactSolution],
    at_edge: bool,
    displacement_mm: dict[str, Floats],
) -> Level:
    placement, grid = position.placement, mesh.bodies.grid
    half_space, solution = solutions
    with position.clock.step("compare"):
        area = grid.whole_area_mm2()
        normal_force = float(np.dot(area * (mesh.bodies.normals @ placement.first.normal), solution.pressure_MPa))
        hertz_sides = tuple(
            (side, _hertz(case, curvature, normal_force))
            for side, curvature in zip(sides(placement.first), placement.first.curvatures, strict=True)
        )
        approach = solution.approach_mm * float(position.direction @ placement.first.normal)
        comparison = compare(grid, solution.pressure_MPa.reshape(grid.shape), approach, hertz_sides[-1][1])
    return Level(
        bodies=mesh.bodies,
        half_space=half_space,
        solution=solution,
        enlarged=mesh.enlarged,
        at_edge=at_edge,
        displacement_mm=displacement_mm,
        normal_force_N=normal_force,
        hertz_sides=hertz_sides,
        comparison=comparison,
    )


def points_part(case: Case, placement: Placement) -> dict[str, float]:
    """Uncertainty of each deviation from profiles that are given by points: nothing where both are exact lines.

    How much the deviation of Hertz from the half-space under the true gap changes when these profiles lose every second
    point: it sees noise and spacing alike. NaN where such profiles do not come into contact.
    """
    rail, wheel = placement.rail.profile.thinned(), placement.wheel.profile.thinned()
    if rail is None and wheel is None:
        return dict.fromkeys(MEASURES, 0.0)
    own = _half_space_deviations(case, placement)
    try:
        other = _half_space_deviations(case, place_case(case, rail=rail, wheel=wheel))
    except (InputError, ConvergenceError):
        return dict.fromkeys(MEASURES, math.nan)
    return {name: abs(other[name] - own[name]) for name in MEASURES}


def expect_on_half_space(case: Case, placement: Placement | None = None) -> tuple[HertzContact, ExpectedPatch]:
    """Hertz's ellipse of a case and the half-space under its true gap: all that can be said without finite elements.

    Raises
    ------
    InputError
        As `place_case` and `hertz_of_case` do, and if the patch reaches the end of the running surface.
    ConvergenceError
        If the patch grows without bound.
    """
    placement = placement or place_case(case)
    hertz = hertz_of_case(case, placement)
    return hertz, _expect(case, placement, hertz)


def _half_space_deviations(case: Case, placement: Placement) -> dict[str, float]:
    hertz, expected = expect_on_half_space(case, placement)
    return deviations(hertz_measures(hertz), expected.measures)


def _judge(case: Case, levels: Sequence[Level], of_points: Mapping[str, float]) -> tuple[SideJudgement, ...]:
    """Judge Hertz with the curvature of each side of the first touch point, under the finest level's normal force."""
    finest = levels[0]
    residual = finest.solution.contact_residual + finest.solution.penetration_residual
    relative = {}
    for name in MEASURES:
        values = [getattr(level.comparison.fe, name) for level in levels]
        reading = finest.comparison.area_reading if name == "area_mm2" else 0.0
        relative[name] = estimate(values, residual=residual, reading=reading).relative
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


_FROM_BEST: tuple[Answer, ...] = ("HOLDS", "UNRESOLVED", "FAILS")


def _worst(sides: Sequence[SideJudgement]) -> Judgement:
    return max((side.judgement for side in reversed(sides)), key=lambda judgement: _FROM_BEST.index(judgement.verdict))


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


def mesh_case(case: Case, body: Literal["rail", "wheel"]) -> BodyMesh:
    """Mesh one body of a case, without solving it.

    Raises
    ------
    InputError
        As `solve` does.
    """
    placement = place_case(case)
    hertz = hertz_of_case(case, placement)
    zone = fine_zone(case, _expect(case, placement, hertz), hertz)
    check_memory(least_memory_bytes(zone), f"a contact zone of {zone.intervals_x} by {zone.intervals_s} elements")
    make = rail_mesh if body == "rail" else wheel_mesh
    return make(placement, zone, half=case.half, size=case.size)


def _expect(case: Case, placement: Placement, hertz: HertzContact) -> ExpectedPatch:
    return expected_patch(
        placement,
        case.load_N,
        contact_modulus_MPa=contact_modulus_MPa(case.rail_material, case.wheel_material),
        direction=approach_direction(placement, normal_force=case.load_kind == "normal"),
        half=case.half,
        guess_mm=1.1 * hertz.approach_mm,
    )


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
