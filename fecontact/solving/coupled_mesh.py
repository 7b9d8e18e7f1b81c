"""One pair of meshes of a position: fine zone, both bodies coupled at their surfaces, and the contact between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case
from fecontact.comparison.judged_load import Level
from fecontact.contact.bands import Bands
from fecontact.contact.correction import solve_by_correction
from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact.rung import Rung
from fecontact.contact.solver import Compliance, ContactProblem, ContactSolution, solve_contact
from fecontact.errors import FoldedMesh, InputError
from fecontact.fe.body import elastic_body
from fecontact.fe.coupling import CoupledBodies
from fecontact.fe.linear_solver import choose_solver
from fecontact.fe.memory import check_memory
from fecontact.fe.meshing import FineZone, least_memory_bytes, rail_mesh, wheel_mesh
from fecontact.fe.mortar import mortar_matrix
from fecontact.fe.section import Stretch
from fecontact.fe.stiffness import stiffness
from fecontact.geometry.placement import Placement
from fecontact.solving.expected_patch import ExpectedPatch
from fecontact.solving.position import MARGIN_ELEMENTS, Clock, Position, element_width_mm
from fecontact.solving.true_gap import TrueGap

Floats = NDArray[np.float64]

# A patch within so many elements of the edge enlarges the zone.
EDGE_ELEMENTS = 2
_ENLARGEMENTS = 4
# Sizes of the elements tried one after the other where those of a section fold: another size is another mesh.
_SIZES_IF_FOLDED = (1.0, 0.97, 0.94, 0.91)


@dataclass(frozen=True, kw_only=True)
class Room:
    """Free room around the expected patch (mm), where the contact may turn out larger than expected.

    `joined` where it goes on between patches that were expected far apart.
    """

    x: float = 0.0
    s_low: float = 0.0
    s_high: float = 0.0
    joined: bool = False


def fine_zone(expected: ExpectedPatch, element_size_mm: tuple[float, float], room: Room | None = None) -> FineZone:
    """The zone of these elements: the expected patch and a margin, in bands where patches are far apart."""
    room = room or Room()
    step_x, step_s = element_size_mm
    bands = () if room.joined else _bands(expected, element_size_mm, room)
    length = max(expected.x_high_mm, -expected.x_low_mm) + MARGIN_ELEMENTS * step_x + room.x
    low = expected.s_low_mm - MARGIN_ELEMENTS * step_s - room.s_low
    high = expected.s_high_mm + MARGIN_ELEMENTS * step_s + room.s_high
    whole = _even_stretch(low, high, step_s)
    return FineZone(
        half_length_mm=step_x * math.ceil(length / step_x),
        s_low_mm=bands[0].low_mm if bands else whole.low_mm,
        s_high_mm=bands[-1].high_mm if bands else whole.high_mm,
        step_x_mm=step_x,
        step_s_mm=step_s,
        semi_axis_mm=expected.semi_axis_s_mm,
        bands=bands,
    )


def _even_stretch(low: float, high: float, step: float) -> Stretch:
    steps = 2 * math.ceil(0.5 * (high - low) / step)
    middle = 0.5 * (low + high)
    return Stretch(low_mm=middle - 0.5 * steps * step, high_mm=middle + 0.5 * steps * step, intervals=steps)


def _bands(expected: ExpectedPatch, element_size_mm: tuple[float, float], room: Room) -> tuple[Stretch, ...]:
    """A band for each of several patches far apart; none where margins leave too little between them."""
    found = []
    for part in expected.parts:
        step = element_width_mm(element_size_mm, part)
        low = part.s_low_mm - MARGIN_ELEMENTS * step - (room.s_low if part is expected.parts[0] else 0.0)
        high = part.s_high_mm + MARGIN_ELEMENTS * step + (room.s_high if part is expected.parts[-1] else 0.0)
        found.append(_even_stretch(low, high, step))
    short = (after.low_mm - before.high_mm < before.step_mm + after.step_mm for before, after in pairwise(found))
    return () if len(found) == 1 or any(short) else tuple(found)


def _more_room(room: Room, nodal: Rung, expected: ExpectedPatch, bands: Sequence[slice]) -> Room:
    """More room where the contact comes within EDGE_ELEMENTS of the edge; the same room if it nowhere does."""
    contact = nodal.pressure_MPa > 0.0
    rows, columns = np.asarray(contact.any(axis=1)), np.asarray(contact.any(axis=0))
    between = np.ones(columns.size, dtype=bool)
    for band in bands:
        start, stop, _ = band.indices(columns.size)
        between[start + (EDGE_ELEMENTS if start else 0) : stop - (EDGE_ELEMENTS if stop < columns.size else 0)] = False
    at_end = bool(rows[-EDGE_ELEMENTS:].any() or (not nodal.grid.half and rows[:EDGE_ELEMENTS].any()))
    quarter = 0.25 * (expected.s_high_mm - expected.s_low_mm)
    return Room(
        x=room.x + (0.25 * expected.x_high_mm if at_end else 0.0),
        s_low=room.s_low + (quarter if columns[:EDGE_ELEMENTS].any() else 0.0),
        s_high=room.s_high + (quarter if columns[-EDGE_ELEMENTS:].any() else 0.0),
        joined=room.joined or bool(columns[between].any()),
    )


def couple(case: Case, placement: Placement, zone: FineZone, clock: Clock) -> CoupledBodies:
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
        grid = ContactGrid(x_mm=x, s_mm=zone.s_mm, half=case.half)
        _, normals = placement.surface(x[:, None], grid.s_mm[None, :])
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
            bands=zone.columns,
            coupling=mortar_matrix(
                grid, placement.project(wheel.points[wheel_nodes]), local[wheel.surfaces["contact"]]
            ),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class CoupledProblem:
    """The contact problem of a position on one mesh, and what is known of its elements.

    Attributes
    ----------
    bodies
        Between the finite bodies, on the nodes of their mesh.
    half_space
        The same gap on a half-space, where the solution starts.
    model
        The bodies' compliance as if it were the same at every node.
    elements, otherwise
        A half-space as soft as the elements, and the same with another idea of what is the elements'.
    """

    bodies: ContactProblem
    half_space: ContactProblem
    model: Compliance
    elements: Compliance
    otherwise: Compliance

    def with_gap(self, gap_mm: Floats) -> CoupledProblem:
        """The same bodies with another gap (n,)."""
        return replace(
            self, bodies=replace(self.bodies, gap_mm=gap_mm), half_space=replace(self.half_space, gap_mm=gap_mm)
        )

    def solve(self, load_N: float) -> ContactSolution:
        """Solve the contact on the half-space, and from there that of the bodies."""
        start = solve_contact(self.half_space, load_N).pressure_MPa
        return solve_by_correction(self.bodies, load_N, self.model, start_MPa=start)

    def read(self, solution: ContactSolution, true_gap: TrueGap, bodies: CoupledBodies) -> tuple[Rung, Field, Field]:
        """A solution on the elements' nodes, and what the bodies open under it more than a half-space of elements.

        The latter twice, by both ideas of what is the elements'.
        """
        nodal = Rung.of(
            bodies.grid,
            solution,
            approach_mm=solution.approach_mm * true_gap.closing,
            upright=bodies.normals @ true_gap.placement.first.normal,
        )
        opening = self.bodies.opening_mm(solution)
        added, otherwise = (
            Field.of_nodes(bodies.grid, opening - elements(solution.pressure_MPa))
            for elements in (self.elements, self.otherwise)
        )
        return nodal, added, otherwise


def coupled_problem(true_gap: TrueGap, bodies: CoupledBodies) -> CoupledProblem:
    """Set up the contact of coupled bodies; costs one application of their compliance for each of their bands."""
    grid, modulus = bodies.grid, true_gap.contact_modulus_MPa
    of_bodies = ContactProblem(
        compliance=bodies.compliance,
        gap_mm=grid.weighted_mean(true_gap.gap),
        closing=bodies.normals @ true_gap.direction,
        area_mm2=grid.whole_area_mm2(),
    )
    bands = Bands(grid=grid, columns=bodies.bands, contact_modulus_MPa=modulus)
    responses = bands.responses(bodies.compliance)
    return CoupledProblem(
        bodies=of_bodies,
        half_space=replace(of_bodies, compliance=bands.half_space()),
        model=bands.together([one.model() for one in responses]),
        elements=bands.together([one.half_space_of_elements() for one in responses]),
        otherwise=bands.together([one.half_space_of_elements(quartic=True) for one in responses]),
    )


class CoupledMesh:
    """Bodies of a position on one mesh, coupled once; the fine zone grows where a patch comes to its edge.

    `stopped_by` is the error that kept it from growing.
    """

    def __init__(self, position: Position, coarser: float) -> None:
        """Make and couple both bodies; `coarser` multiplies the element sizes."""
        self._position, self._coarser = position, coarser
        self._room = Room()
        self._enlarged = 0
        self.stopped_by: InputError | None = None
        self._take(self._couple(self._room))

    def solve(self, position: Position) -> Level:
        """Contact of the position's load between the bodies, and whether the patch is at the edge of the zone."""
        while True:
            with position.clock.step("contact"):
                nodal, added, otherwise = self._contact(position)
            more = self._more_room(position, nodal, added)
            at_edge = more != self._room
            if not at_edge or self._enlarged == _ENLARGEMENTS:
                return self._level(position, nodal, (added, otherwise), at_edge=at_edge)
            try:
                larger = self._couple(more)
            except InputError as error:
                self.stopped_by = error
                return self._level(position, nodal, (added, otherwise), at_edge=True)
            self.bodies.close()
            self._take(larger)
            self._room, self._enlarged = more, self._enlarged + 1

    def _contact(self, position: Position) -> tuple[Rung, Field, Field]:
        """Contact on the elements' nodes, and what the bodies open under it beyond a half-space of elements, twice."""
        problem, true_gap = self._problem, position.true_gap
        if true_gap.slide_mm != self._position.true_gap.slide_mm:
            problem = problem.with_gap(self.bodies.grid.weighted_mean(true_gap.gap))
        return problem.read(problem.solve(position.case.load_N), true_gap, self.bodies)

    def _more_room(self, position: Position, nodal: Rung, added: Field) -> Room:
        """More room where the contact comes near the edge of the zone or goes on beyond it; else the same."""
        more = _more_room(self._room, nodal, position.expected, self.bodies.bands)
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
        position = self._position
        folded: FoldedMesh | None = None
        for factor in _SIZES_IF_FOLDED:
            step_x, step_s = (factor * self._coarser * step for step in position.element_size_mm)
            zone = fine_zone(position.expected, (step_x, step_s), room)
            try:
                return couple(position.case, position.placement, zone, position.clock)
            except FoldedMesh as error:
                folded = folded or error
        assert folded is not None
        raise folded

    def _take(self, bodies: CoupledBodies) -> None:
        self.bodies = bodies
        with self._position.clock.step("contact"):
            self._problem = coupled_problem(self._position.true_gap, bodies)

    def _level(self, position: Position, nodal: Rung, added: tuple[Field, Field], *, at_edge: bool) -> Level:
        bodies = self.bodies
        with position.clock.step("resolve"):
            rungs = [position.expected.half_space]
            grid = grid_over(rungs[0].grid, nodal)
            for one in added:
                # each is nearly the one before it
                start = rungs[-1].pressure
                rungs.append(position.true_gap.solve(grid, position.case.load_N, added=one, start=start))
            _, fe, otherwise = rungs
        meshes = (bodies.rail.mesh, bodies.wheel.mesh)
        return Level(
            nodal=nodal,
            fe=fe,
            otherwise=otherwise,
            degrees_of_freedom={mesh.name: 3 * len(mesh.points) for mesh in meshes},
            elements={mesh.name: len(mesh.hexes) for mesh in meshes},
            enlarged=self._enlarged,
            at_edge=at_edge,
        )


def grid_over(fine: ContactGrid, nodal: Rung) -> ContactGrid:
    """A grid with the steps and the places of a finer one, over a contact on elements and two of them around it."""
    rows, columns = (np.flatnonzero(nodal.pressure_MPa.any(axis=axis)) for axis in (1, 0))
    return ContactGrid(
        x_mm=_line_over(fine.x_mm, nodal.grid.x_mm, rows, from_plane=nodal.grid.half),
        s_mm=_line_over(fine.s_mm, nodal.grid.s_mm, columns),
        half=nodal.grid.half,
    )


def _line_over(fine: Floats, coarse: Floats, covered: NDArray[np.int64], *, from_plane: bool = False) -> Floats:
    first, last = max(int(covered[0]) - 2, 0), min(int(covered[-1]) + 2, coarse.size - 1)
    step = float(fine[1] - fine[0])
    low = 0 if from_plane else math.ceil((float(coarse[first]) - float(fine[0])) / step)
    high = math.floor((float(coarse[last]) - float(fine[0])) / step)
    return np.asarray(fine[0] + step * np.arange(low, high + 1))
