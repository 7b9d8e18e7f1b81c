"""The meshes of a position, the one owner of their factors: a load is solved on as many as its verdict takes."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.case import Case
from fecontact.contact.elements import Bands, UnitResponse
from fecontact.contact.grid import ContactGrid, Field, Rung, in_bands
from fecontact.contact.solver import (
    Compliance,
    ContactProblem,
    ContactSolution,
    solve_by_correction,
    solve_contact,
)
from fecontact.contact_theories.hertz import hertz_from_hessian
from fecontact.errors import FoldedMesh, InputError, NotCovered, NotEnoughMemory
from fecontact.fe.body import assembled_part, elastic_body
from fecontact.fe.coupling import CoupledBodies, mortar_matrix
from fecontact.fe.linear_solver import choose_solver
from fecontact.fe.memory import check_memory
from fecontact.fe.meshing import FineZone, check_on_profiles, least_memory_bytes, rail_mesh, wheel_mesh
from fecontact.fe.stiffness import stiffness
from fecontact.fe.stress import nodal_stress
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.lines import Lines
from fecontact.judging.measures import patch_of
from fecontact.judging.solved_load import Level, SolvedLoad, elements_off
from fecontact.judging.theory import Evidence, fails_for_certain, judge_hertz, no_mesh_decides
from fecontact.judging.uncertainty import MESH_RATIO
from fecontact.judging.verdict import worst_of
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.cost import cpu_seconds
from fecontact.solving.expected_patch import followed_mm
from fecontact.solving.fine_zone import EDGE_ELEMENTS, MARGIN_ELEMENTS, Room, fine_zone, more_room
from fecontact.solving.gap_checks import gap_curvature_error, gap_distance_error_mm, solved_gap
from fecontact.solving.lobe_sizes import lobe_sizes
from fecontact.solving.plane_angles import angle_of_normals
from fecontact.solving.plastic_contact import PlasticContact, YieldingBodies, climb, nodal_fields, with_variants
from fecontact.solving.position import Clock, Position
from fecontact.solving.profile_variants import lines_of_case
from fecontact.solving.quadratic_gap import quadratic_rung
from fecontact.solving.true_gap import TrueGap

# --- One pair of meshes of a position: fine zone, both bodies coupled at their surfaces, and the contact between them.

# How far beside the middle a second response is looked at, as a part of the zone's length and width: two thirds of the
# way to the edge of the patch.
_BESIDE = 0.15
_ENLARGEMENTS = 4
# How layers grow downwards where steel may yield: a plastic zone reaches down to 1.2 semi-axes at 2.5 yield stresses.
# Six elements per semi-axis have the peak of a sphere within 0.2 % then, and 1 % too high where layers grow by 1.3.
_LAYERS_THAT_YIELD = 1.2
# Linear solutions that slides and stresses are taken from: the contact's own, which are better.
_OF_SLIDES, _OF_STRESSES = 1e-3, 1e-7
# Element sizes tried one after the other where a section's elements fold: another size is another mesh.
_SIZES_IF_FOLDED = (1.0, 0.97, 0.94, 0.91)


def couple(
    case: Case, placement: Placement, zone: FineZone, clock: Clock, *, several_loads: bool = False
) -> CoupledBodies:
    """Mesh both bodies, couple their surfaces, assemble and factorise them, for one load or for several."""
    check_memory(least_memory_bytes(zone), f"a contact zone of {zone.intervals_x} by {zone.intervals_s} elements")
    with clock.step("mesh"):
        ratio = _LAYERS_THAT_YIELD if case.may_yield else None
        rail = rail_mesh(placement, zone, half=case.half, size=case.size, layer_ratio=ratio)
        wheel = wheel_mesh(placement, zone, half=case.half, size=case.size, layer_ratio=ratio)
        check_on_profiles(placement, rail, wheel)
    # before the factors, which take longest: surfaces that do not face each other need none
    with clock.step("couple"):
        x = np.linspace(0.0 if case.half else -zone.half_length_mm, zone.half_length_mm, rail.contact_nodes.shape[0])
        grid = ContactGrid(x_mm=x, s_mm=zone.s_mm, half=case.half)
        _, normals = placement.surface(x[:, None], grid.s_mm[None, :])
        wheel_nodes = np.unique(wheel.surfaces["contact"])
        local = np.full(len(wheel.points), -1)
        local[wheel_nodes] = np.arange(wheel_nodes.size)
        coupling = mortar_matrix(grid, placement.project(wheel.points[wheel_nodes]), local[wheel.surfaces["contact"]])
    # bodies that yield are solved many times for one load, and several patches twice a patch before the contact
    # a whole body has a factor of each half
    factors = 1 if case.half else 2
    path = choose_solver(
        case.solver,
        [mesh.unknowns // factors for mesh in (rail, wheel) for _ in range(factors)],
        several_loads=several_loads or case.may_yield or len(zone.bands) > 1,
    )
    bodies = []
    for mesh, material in ((rail, case.rail_material), (wheel, case.wheel_material)):
        with clock.step("assemble"):
            matrix = stiffness(assembled_part(mesh), material)
        with clock.step("factorise"):
            bodies.append(elastic_body(mesh, material, path, matrix))
        # the factor is what is kept
        del matrix
    rail_body, wheel_body = bodies
    return CoupledBodies(
        rail=rail_body,
        wheel=wheel_body,
        grid=grid,
        normals=normals.reshape(-1, 3),
        rail_nodes=rail.contact_nodes.ravel(),
        wheel_nodes=wheel_nodes,
        bands=zone.columns,
        coupling=coupling,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class CoupledProblem:
    """The contact problem of a position on one mesh, and what is known of its elements.

    Attributes
    ----------
    bodies
        Contact between the finite bodies, on the nodes of their mesh.
    half_space
        Contact of their gap on a half-space, where the solution starts.
    model
        Compliance of the bodies, taken as equal at every node.
    elements, otherwise
        Half-spaces as soft as the elements, by two ideas of what of a response is the elements'; the second one is None
        where nobody asks it.
    compliance_error
        By how much the elements are softer than their material, the worst of all bands.
    """

    bodies: ContactProblem
    half_space: ContactProblem
    model: Compliance
    elements: Compliance
    otherwise: Compliance | None
    compliance_error: float

    def with_gap(self, gap_mm: Floats) -> CoupledProblem:
        """Contact of these bodies with another gap (n,)."""
        return replace(
            self, bodies=replace(self.bodies, gap_mm=gap_mm), half_space=replace(self.half_space, gap_mm=gap_mm)
        )

    def solve(self, load_N: float, *, slid: Callable[[ContactSolution], Floats] | None = None) -> ContactSolution:
        """Solve the contact on the half-space, and from there the contact of the bodies, which may slide."""
        start = solve_contact(self.half_space, load_N).pressure_MPa
        return solve_by_correction(self.bodies, load_N, self.model, start_MPa=start, slid=slid)

    def read(
        self, solution: ContactSolution, true_gap: TrueGap, bodies: CoupledBodies
    ) -> tuple[Rung, Field, Field | None]:
        """Rung of a solution on the elements' nodes, and what the bodies open more than a half-space of elements.

        The opening twice, by both ideas of what is the elements'.
        """
        nodal = Rung.of(
            bodies.grid,
            solution,
            approach_mm=solution.approach_mm * true_gap.closing,
            upright=bodies.normals @ true_gap.placement.first.normal,
        )
        opening = self.bodies.opening_mm(solution)

        def beyond(elements: Compliance) -> Field:
            return Field.of_nodes(bodies.grid, opening - elements(solution.pressure_MPa))

        return nodal, beyond(self.elements), None if self.otherwise is None else beyond(self.otherwise)


def coupled_problem(true_gap: TrueGap, bodies: CoupledBodies, *, otherwise: bool = True) -> CoupledProblem:
    """Set up the contact of coupled bodies; costs one application of their compliance for each of their bands.

    The other idea of what is the elements' costs as many of whole bodies, where it is asked.
    """
    grid, modulus = bodies.grid, true_gap.contact_modulus_MPa
    of_bodies = ContactProblem(
        compliance=bodies.compliance,
        within=bodies.compliance,
        gap_mm=grid.weighted_mean(true_gap.gap),
        closing=bodies.normals @ true_gap.direction,
        area_mm2=grid.whole_area_mm2(),
    )
    bands = Bands(grid=grid, columns=bodies.bands, contact_modulus_MPa=modulus)
    responses = bands.responses(bodies.compliance)
    other: Compliance | None = None
    if otherwise:
        # a yawed wheel's elements meet the rail's elements differently from place to place
        others = responses if grid.half else bands.responses(bodies.compliance, beside=_BESIDE)
        other = bands.together([one.half_space_of_elements(quartic=True) for one in others])
    return CoupledProblem(
        bodies=of_bodies,
        half_space=replace(of_bodies, compliance=bands.half_space(), within=None),
        model=bands.together([one.model() for one in responses]),
        elements=bands.together([one.half_space_of_elements() for one in responses]),
        otherwise=other,
        compliance_error=_compliance_error(responses, true_gap.placement, bodies),
    )


def _compliance_error(responses: Sequence[UnitResponse], placement: Placement, bodies: CoupledBodies) -> float:
    """The error of the largest size of all bands; NaN where none is seen."""
    across = bodies.normals[: bodies.grid.shape[1]]
    angle = np.arctan2(-across[:, 1], across[:, 2])
    errors = (
        one.compliance_error(angle[own], placement.side_mm(float(one.grid.s_mm[one.node[1]])))
        for one, own in zip(responses, bodies.bands, strict=True)
    )
    return max((error for error in errors if not math.isnan(error)), key=abs, default=math.nan)


class CoupledMesh:
    """Bodies of a position on one mesh, coupled once; the fine zone grows where a patch comes to its edge.

    `room` is around the expected patch, `enlarged` how often it grew, and `stopped_by` the error that kept it from
    growing.
    """

    def __init__(self, position: Position, coarser: float, room: Room | None = None) -> None:
        """Make and couple both bodies; `coarser` multiplies the element sizes, `room` is what other meshes needed."""
        self.plastic: tuple[YieldingBodies, PlasticContact] | None = None
        self._position, self._coarser = position, coarser
        self.room = room or Room()
        self.enlarged = 0
        self.stopped_by: InputError | None = None
        try:
            bodies = self._couple(self.room)
        except InputError:
            if self.room == Room():
                raise
            # other elements may do without
            self.room = Room()
            bodies = self._couple(self.room)
        self._take(bodies)

    def solve(self, position: Position) -> Level:
        """Contact of the position's load between the bodies, and whether the patch is at the edge of the zone."""
        while True:
            self.bodies.forget()
            with position.clock.step("contact"):
                true_gap, problem, solution = self._contact(position)
                nodal, added, otherwise = problem.read(solution, true_gap, self.bodies)
            position = replace(position, true_gap=true_gap)
            more = self._more_room(position, nodal, added)
            at_edge, larger = more != self.room, None
            if at_edge and self.enlarged < _ENLARGEMENTS:
                try:
                    larger = self._couple(more)
                except InputError as error:
                    self.stopped_by = error
            if larger is None:
                level = self._level(position, nodal, (added, otherwise), at_edge=at_edge)
                return self._with_yield(position, problem, solution, level)
            self.bodies.close()
            self._take(larger)
            self.room, self.enlarged = more, self.enlarged + 1

    def _contact(self, position: Position) -> tuple[TrueGap, CoupledProblem, ContactSolution]:
        """Gap with the slide of the bodies on a steep surface, and the contact on the elements' nodes."""
        problem, true_gap, grid = self._problem, position.true_gap, self.bodies.grid
        if true_gap.slide_mm != self._position.true_gap.slide_mm:
            problem = problem.with_gap(grid.weighted_mean(true_gap.gap))
        if not true_gap.is_steep:
            return true_gap, problem, problem.solve(position.case.load_N)
        gaps: list[tuple[TrueGap, Floats]] = []

        def slid(solution: ContactSolution) -> Floats:
            after = replace(true_gap, slide_mm=self._slide_mm(true_gap, solution))
            gaps.append((after, grid.weighted_mean(after.gap)))
            return gaps[-1][1]

        solution = problem.solve(position.case.load_N, slid=slid)
        true_gap, gap_mm = gaps[-1]
        return true_gap, problem.with_gap(gap_mm), solution

    def _with_yield(
        self, position: Position, problem: CoupledProblem, solution: ContactSolution, level: Level
    ) -> Level:
        """A level with the first loading of bodies that may yield, on the nodes of its rungs."""
        if not position.case.may_yield or level.status != "converged":
            return level
        load_N, true_gap = position.case.load_N, position.true_gap

        def read(solved: ContactSolution, load_N: float) -> tuple[Rung, Rung]:
            nodal, added, _ = problem.read(solved, true_gap, self.bodies)
            grid = grid_over(position.expected.half_space.grid, nodal)
            return nodal, true_gap.solve(grid, load_N, added=added, start=level.fe.pressure)

        with position.clock.step("yield"):
            elastic = (solution, level.nodal, level.fe)
            bodies = YieldingBodies.of(self.bodies, problem.bodies, problem.model, solution.pressure_MPa)
            is_coarse = self._coarser > 1.0
            found = climb(bodies, elastic, load_N, read, sparing=is_coarse)
            if is_coarse:
                found = with_variants(found, bodies, elastic, load_N, read)
        self.plastic = None if found.contact is None else (bodies, found.contact)
        return replace(level, yielded=found.yielded)

    def _slide_mm(self, true_gap: TrueGap, solution: ContactSolution) -> float:
        """How far the wheel goes along the rail below the patch, less what both bodies give way to it there."""
        tangent = true_gap.placement.first.tangent
        force = self.bodies.grid.whole_area_mm2() * solution.pressure_MPa
        parting = self.bodies.parting(solution.pressure_MPa, _OF_SLIDES) @ tangent
        gives_way = float(force @ parting) / float(force.sum())
        return solution.approach_mm * float(true_gap.direction @ tangent) - gives_way

    def _more_room(self, position: Position, nodal: Rung, added: Field) -> Room:
        """Room of the zone: more where the contact comes near its edge or goes on beyond it, else what there is."""
        more = more_room(self.room, nodal, position.expected, self.bodies.bands)
        beyond = position.true_gap.overlaps_beyond(nodal, added)
        if beyond is None:
            return more
        low, high = beyond
        s = nodal.grid.s_mm
        return replace(
            more,
            s_low=more.s_low + max(0.0, float(s[0]) - low),
            s_high=more.s_high + max(0.0, high - float(s[-1])),
        )

    def close(self) -> None:
        """Release both factors."""
        self.bodies.close()

    def _couple(self, room: Room) -> CoupledBodies:
        """Couple the bodies over the expected patch and a margin, a narrower one where a head bears no wider one."""
        step_s = self._coarser * self._position.element_size_mm[1]
        too_wide: NotCovered | FoldedMesh | None = None
        for less in range(MARGIN_ELEMENTS - EDGE_ELEMENTS + 1):
            narrower = replace(room, s_low=room.s_low - less * step_s, s_high=room.s_high - less * step_s)
            try:
                return self._couple_over(narrower)
            except (NotCovered, FoldedMesh) as error:
                too_wide = too_wide or error
        assert too_wide is not None
        raise too_wide

    def _couple_over(self, room: Room) -> CoupledBodies:
        position = self._position
        folded: FoldedMesh | None = None
        for factor in _SIZES_IF_FOLDED:
            step_x, step_s = (factor * self._coarser * step for step in position.element_size_mm)
            zone = fine_zone(position.expected, (step_x, step_s), room)
            try:
                return couple(
                    position.case, position.placement, zone, position.clock, several_loads=position.several_loads
                )
            except FoldedMesh as error:
                folded = folded or error
        assert folded is not None
        raise folded

    def _take(self, bodies: CoupledBodies) -> None:
        self.bodies = bodies
        with self._position.clock.step("contact"):
            self._problem = coupled_problem(self._position.true_gap, bodies, otherwise=self._coarser <= 1.0)

    def _level(self, position: Position, nodal: Rung, added: tuple[Field, Field | None], *, at_edge: bool) -> Level:
        bodies = self.bodies
        with position.clock.step("resolve"):
            half_space, gap, load_N = position.expected.half_space, position.true_gap, position.case.load_N
            grid = grid_over(half_space.grid, nodal)
            fe = gap.solve(grid, load_N, added=added[0], start=half_space.pressure)
            if gap.overlaps_between(fe, added[0]):
                fe = gap.solve(fe.even().grid, load_N, added=added[0], start=fe.pressure)
            otherwise = None
            if added[1] is not None:
                # nearly the one before it
                otherwise = gap.solve(fe.grid, load_N, added=added[1], start=fe.pressure)
        meshes = (bodies.rail.mesh, bodies.wheel.mesh)
        force_balance, moment_balance = bodies.balance(nodal.pressure_MPa.ravel())
        return Level(
            nodal=nodal,
            fe=fe,
            otherwise=otherwise,
            compliance_error=self._problem.compliance_error,
            degrees_of_freedom={mesh.name: mesh.unknowns for mesh in meshes},
            elements={mesh.name: len(mesh.hexes) for mesh in meshes},
            slide_mm=position.true_gap.slide_mm,
            force_balance=force_balance,
            moment_balance=moment_balance,
            enlarged=self.enlarged,
            at_edge=at_edge,
            gap_distance_error_mm=gap_distance_error_mm(gap, solved_gap(gap, fe, added[0]), bodies),
        )


def grid_over(fine: ContactGrid, nodal: Rung) -> ContactGrid:
    """A grid with the steps and the places of a finer one, over a contact on elements and two of them around it."""
    rows, columns = (np.flatnonzero(nodal.pressure_MPa.any(axis=axis)) for axis in (1, 0))
    x = _line_over(fine.x_mm, nodal.grid.x_mm, rows, from_plane=nodal.grid.half)
    if len(bands := fine.bands) == 1:
        return ContactGrid(x_mm=x, s_mm=_line_over(fine.s_mm, nodal.grid.s_mm, columns), half=fine.half)
    middles = [0.5 * (before.s_mm[-1] + after.s_mm[0]) for before, after in pairwise(bands)]
    owner = np.searchsorted(middles, nodal.grid.s_mm[columns])
    lines = [_band_over(band.s_mm, nodal.grid.s_mm, columns[owner == k]) for k, band in enumerate(bands)]
    return in_bands(x, lines, half=fine.half)


def _band_over(fine: Floats, coarse: Floats, covered: NDArray[np.int64]) -> Floats:
    """A band, and what a contact on elements covers beside it, up to its own width at either end."""
    if covered.size == 0:
        return fine
    step, line = float(fine[1] - fine[0]), _line_over(fine, coarse, covered)
    more = [min(max(0, round(by / step)), fine.size) for by in (fine[0] - line[0], line[-1] - fine[-1])]
    return np.asarray(fine[0] + step * np.arange(-more[0], fine.size + more[1]))


def _line_over(fine: Floats, coarse: Floats, covered: NDArray[np.int64], *, from_plane: bool = False) -> Floats:
    first, last = max(int(covered[0]) - 2, 0), min(int(covered[-1]) + 2, coarse.size - 1)
    step = float(fine[1] - fine[0])
    low = 0 if from_plane else math.ceil((float(coarse[first]) - float(fine[0])) / step)
    high = math.floor((float(coarse[last]) - float(fine[0])) / step)
    return np.asarray(fine[0] + step * np.arange(low, high + 1))


# --- The meshes of a position, the one owner of their factors: a load is solved on as many as its verdict takes.

# The case's own mesh, a coarser one, and three refinements.
_MOST_MESHES = 5
# Where the elements' own nodes are to know the verdict too.
_MOST_FOR_EVIDENCE = 6
# Elements that the finest meshes of every named resolution have on the semi-axis that they are made for.
_FEWEST_ELEMENTS = 4
# A lobe on its last nodes is measured a little differently than on those that they were made for.
_MOST_OF_NODES = 0.7


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedBodies:
    """Both bodies of the finest meshes under a load, and the displacements (n, 3) in mm of their nodes.

    Base held and driver held: the rigid approach is not in them. Displacements are elastic; `yielded` has arrays at the
    nodes of a body that has yielded (`yielding.nodal_fields`).
    """

    coupled: CoupledBodies
    displacement_mm: dict[str, NDArray[np.float64]]
    yielded: Mapping[str, Mapping[str, NDArray[np.float64]]] = field(default_factory=dict)

    @cached_property
    def stress_MPa(self) -> dict[str, Floats]:
        """Stress (n, 6) at the nodes of each body, as in `nodal_stress`."""
        bodies = (self.coupled.rail, self.coupled.wheel)
        return {body.mesh.name: nodal_stress(body, self.displacement_mm[body.mesh.name]) for body in bodies}


class Meshes:
    """The meshes of a position, each made when it is first needed and solved for any number of loads.

    Parameters
    ----------
    position
        Its expected patch decides about zone and element size of all meshes.
    keep
        Whether the factors stay for further loads until `close`. If not, they go as soon as a load is solved, and
        `bodies` belong to its finest meshes.
    """

    def __init__(self, position: Position, *, keep: bool = False) -> None:
        """Make no mesh yet."""
        self.position = position
        self.bodies: SolvedBodies | None = None
        self._keep = keep
        self._meshes: dict[float, CoupledMesh] = {}
        self._not_enlarged: list[InputError] = []
        self._room = Room()
        self._took: dict[float, float] = {}

    def solve(self, position: Position) -> SolvedLoad:
        """Solve a position's load on two meshes; refine while the verdict is open and the limit allows.

        It is the position of the meshes, or the same one under another load.
        """
        case, placement = position.case, position.placement
        with position.clock.step("expect the patch"):
            lines = lines_of_case(case, placement)
        self._not_enlarged, self._room = [], Room()
        levels = [self._level(position, 1.0)]
        levels.append(self._level(position, MESH_RATIO, self._left_s(levels, coarser_degrees_of_freedom(levels[0]))))
        stop: InputError | None = None
        while stop is None and is_open(case, levels, placement, lines, position.expected.half_space):
            stop = self._refine(position, levels)
        with position.clock.step("ladder"):
            hertz = hertz_from_hessian(
                placement.first.curvature.hessian,
                normal_force_N=levels[0].fe.normal_force_N,
                contact_modulus_MPa=case.contact_modulus_MPa,
            )
            return SolvedLoad(
                case=case,
                levels=tuple(levels),
                half_space=position.expected.half_space,
                turned=_turned(position),
                quadratic=quadratic_rung(placement.first, hertz, half=case.half, nodes=case.nodes_a_semi_axis),
                lines=lines,
                limits=(
                    *_limits(position, levels),
                    *(f"the contact zone cannot be enlarged: {error}" for error in self._not_enlarged),
                    *(() if stop is None else (f"refinement stopped: {stop}",)),
                ),
                short_of_memory=any(isinstance(error, NotEnoughMemory) for error in (*self._not_enlarged, stop)),
                gap_curvature_error=gap_curvature_error(position.true_gap, position.expected.half_space.grid),
            )

    def bodies_of(self, solved: SolvedLoad) -> SolvedBodies:
        """Both bodies of the finest meshes under the load that was solved last."""
        if self._keep:
            self._recover(self._meshes[MESH_RATIO ** (2 - len(solved.levels))], solved.levels[0])
        assert self.bodies is not None
        return self.bodies

    def drop_enlarged(self) -> None:
        """Release meshes that grew under a load, so that the next load begins as it would by itself."""
        for coarser in [coarser for coarser, mesh in self._meshes.items() if mesh.room != Room()]:
            self._meshes.pop(coarser).close()

    def close(self) -> None:
        """Release all factors; a further load makes its meshes again."""
        for mesh in self._meshes.values():
            mesh.close()
        self._meshes.clear()

    def _refine(self, position: Position, levels: list[Level]) -> InputError | None:
        """Put a level on finer meshes before the others, or say why there is none."""
        case = position.case
        expected = finer_degrees_of_freedom(levels)
        if expected > case.most_unknowns:
            return InputError(
                f"the next meshes would have about {expected} of at most {case.most_unknowns} degrees of freedom"
            )
        try:
            levels.insert(0, self._level(position, MESH_RATIO ** (1 - len(levels)), self._left_s(levels, expected)))
        except InputError as error:
            return error
        return None

    def _level(self, position: Position, coarser: float, left_s: float | None = None) -> Level:
        clock, begun = position.clock, time.perf_counter()
        clock.stage = _stage(position.case, coarser, left_s)
        try:
            return self._solved(position, coarser)
        finally:
            clock.stage = ""
            self._took[coarser] = time.perf_counter() - begun

    def _left_s(self, levels: Sequence[Level], degrees_of_freedom: float) -> float | None:
        """Seconds that meshes of so many unknowns take by what the finest ones took; None where bodies yield."""
        finest = sum(levels[0].degrees_of_freedom.values())
        took = self._took[min(self._took)]
        return None if self.position.case.may_yield else took * cpu_seconds(degrees_of_freedom) / cpu_seconds(finest)

    def _solved(self, position: Position, coarser: float) -> Level:
        mesh = self._meshes.get(coarser) or CoupledMesh(self.position, coarser, self._room)
        level = replace(mesh.solve(position), more_nodes=position.more_nodes, turned_force=position.turned_force)
        self._room = mesh.room
        if mesh.stopped_by is not None:
            self._not_enlarged.append(mesh.stopped_by)
        if self._keep:
            self._meshes[coarser] = mesh
            return level
        # the coarse mesh comes second, a refinement after it
        if self.bodies is None or coarser < 1.0:
            self._recover(mesh, level)
        mesh.close()
        return level

    def _recover(self, mesh: CoupledMesh, level: Level) -> None:
        with self.position.clock.step("recover"):
            rail, wheel = mesh.bodies.displacements(level.nodal.pressure_MPa.ravel(), tolerance=_OF_STRESSES)
            self.bodies = SolvedBodies(
                coupled=mesh.bodies,
                displacement_mm={"rail": rail, "wheel": wheel},
                yielded={} if mesh.plastic is None else nodal_fields(*mesh.plastic),
            )


def _turned(position: Position) -> Rung | None:
    """The half-space of several lobes with each pressure along its own normal; None for a single lobe."""
    rung = position.expected.half_space
    if len(patch_of(rung).lobes) == 1:
        return None
    angle = angle_of_normals(position.placement, rung.grid.s_mm)
    return position.true_gap.solve(rung.grid, position.case.load_N, start=rung.pressure, angle_rad=angle)


def _stage(case: Case, coarser: float, left_s: float | None) -> str:
    """Which meshes are under way, and how long they take, for those who wait."""
    if coarser == 1.0:
        return "first meshes"
    left = "" if left_s is None else f", about {max(left_s, 1.0):.0f} s left"
    if coarser > 1.0:
        return f"coarser meshes, for the uncertainty{left}"
    # by all evidence finer ones follow also where the verdict is decided and that of the elements' own nodes is not
    open_one = "the verdict, or that of the elements by themselves," if case.refine == "evidence" else "the verdict"
    return f"finer meshes, because {open_one} is open{left}{' if these decide it' * bool(left)}"


def _limits(position: Position, levels: Sequence[Level]) -> Iterator[str]:
    """What is to be said where there are few elements or nodes for the patch."""
    semi_axes = (position.expected.semi_axis_x_mm, position.expected.semi_axis_s_mm)
    sizes = levels[0].nodal.grid.steps_mm
    count, size, semi_axis = min((axis / size, size, axis) for axis, size in zip(semi_axes, sizes, strict=True))
    # by sizes that were given
    if count < _FEWEST_ELEMENTS:
        yield (
            f"elements of {size:.2f} mm are only {count:.1f} to the patch's semi-axis of {semi_axis:.2f} mm;"
            f" {_FEWEST_ELEMENTS} or more make what the bodies add below it sure"
        )
    rung, wanted = position.expected.half_space, position.case.nodes_a_semi_axis
    least = zip(followed_mm(lobe_sizes(rung)), rung.grid.steps_mm, strict=True)
    count, length = min((length / step, length) for length, step in least)
    # as many as the case asks for would be too many
    if count <= _MOST_OF_NODES * wanted:
        yield (
            f"a lobe of {length:.2g} mm has {count:.0f} pressure nodes in place of {wanted}: in so wide a patch more"
            " would be too many; its own peak and load are known less well than is stated"
        )


def is_open(case: Case, levels: Sequence[Level], placement: Placement, lines: Lines | None, half_space: Rung) -> bool:
    """Whether the verdict on a load is open and another pair of meshes may decide it.

    If `Case.refine` is "evidence", the verdict on the elements' own nodes counts, too. Elements that are too coarse for
    their place look too soft or too stiff; finer ones look so only if they are.
    """
    most = _MOST_FOR_EVIDENCE if case.refine == "evidence" else _MOST_MESHES
    if any(level.status != "converged" for level in levels) or len(levels) == most:
        return False
    asked: tuple[Evidence, ...] = ("fe", "elements") if case.refine == "evidence" else ("fe",)
    hopeless = {
        by: no_mesh_decides(case, levels, placement, lines, by=by, refinements=most - len(levels)) for by in asked
    }
    if elements_off(levels):
        # of numbers that are not right only the lines that points allow say that no mesh decides
        seen = lines is None or not all(hopeless.values())
        return seen and not fails_for_certain(judge_hertz(case, levels, placement, lines), half_space)
    return any(_open_by(by, case, levels, placement, lines) for by in asked if not hopeless[by])


def _open_by(by: Evidence, case: Case, levels: Sequence[Level], placement: Placement, lines: Lines | None) -> bool:
    return worst_of(judge_hertz(case, levels, placement, lines, by=by)).answer == "UNRESOLVED"


def would_be_refined(load: JudgedLoad, placement: Placement) -> bool:
    """Whether a new solution would go on where a stored one, as it is judged now, leaves the verdict open."""
    solved = load.solved
    affordable = finer_degrees_of_freedom(solved.levels) <= load.case.most_unknowns
    return affordable and is_open(load.case, solved.levels, placement, solved.lines, solved.half_space)


def coarser_degrees_of_freedom(level: Level) -> float:
    """Degrees of freedom to expect of the coarser meshes: graded ones grow with about the square of MESH_RATIO."""
    return sum(level.degrees_of_freedom.values()) / MESH_RATIO**2


def finer_degrees_of_freedom(levels: Sequence[Level]) -> int:
    """Degrees of freedom to expect of the next finer meshes: graded ones grow less than with the cube of MESH_RATIO."""
    fine, coarse = (sum(level.degrees_of_freedom.values()) for level in levels[:2])
    # the uniform zone grows faster than the rest, so that the ratio grows too
    return int(fine * min((fine / coarse) ** 1.2, MESH_RATIO**3))
