"""One pair of meshes of a position: fine zone, both bodies coupled at their surfaces, and the contact between them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case
from fecontact.comparison.judged_load import Level
from fecontact.contact.correction import model_of, solve_by_correction
from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact.halfspace import half_space_problem
from fecontact.contact.rung import Rung
from fecontact.contact.solver import Compliance, ContactProblem, ContactSolution, solve_contact
from fecontact.errors import InputError
from fecontact.fe.body import elastic_body
from fecontact.fe.coupling import CoupledBodies
from fecontact.fe.linear_solver import choose_solver
from fecontact.fe.memory import check_memory
from fecontact.fe.meshing import BodyMesh, FineZone, least_memory_bytes, rail_mesh, wheel_mesh
from fecontact.fe.mortar import mortar_matrix
from fecontact.fe.stiffness import stiffness
from fecontact.geometry.placement import Placement
from fecontact.solving.expected_patch import ExpectedPatch
from fecontact.solving.position import Clock, Position, element_size_mm, expect_on_half_space, place_case
from fecontact.theory.hertz import HertzContact

# Free room around the expected patch, in elements; a patch within EDGE_ELEMENTS of the edge enlarges the zone.
_MARGIN_ELEMENTS = 4
EDGE_ELEMENTS = 2
_ENLARGEMENTS = 4


@dataclass(frozen=True, kw_only=True)
class Room:
    """Free room around the expected patch (mm), where the contact may turn out larger than expected."""

    x: float = 0.0
    s_low: float = 0.0
    s_high: float = 0.0


def fine_zone(
    case: Case, expected: ExpectedPatch, hertz: HertzContact, room: Room | None = None, coarser: float = 1.0
) -> FineZone:
    """The uniform zone: the expected patch and a margin, with the resolution's elements on its narrowest semi-axis.

    `coarser` multiplies the element sizes.
    """
    room = room or Room()
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
        semi_axis_mm=min(expected.semi_axis_s_mm, hertz.b_mm),
    )


def _more_room(room: Room, grid: ContactGrid, contact: NDArray[np.bool_], expected: ExpectedPatch) -> Room:
    """More room where the contact comes within EDGE_ELEMENTS of the edge; the same room if it nowhere does."""
    rows, columns = np.asarray(contact.any(axis=1)), np.asarray(contact.any(axis=0))
    at_end = bool(rows[-EDGE_ELEMENTS:].any() or (not grid.half and rows[:EDGE_ELEMENTS].any()))
    quarter = 0.25 * (expected.s_high_mm - expected.s_low_mm)
    return Room(
        x=room.x + (0.25 * expected.x_high_mm if at_end else 0.0),
        s_low=room.s_low + (quarter if columns[:EDGE_ELEMENTS].any() else 0.0),
        s_high=room.s_high + (quarter if columns[-EDGE_ELEMENTS:].any() else 0.0),
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
    grid, modulus = bodies.grid, position.case.contact_modulus_MPa
    half_space = half_space_problem(
        grid,
        grid.weighted_mean(position.placement.gap),
        closing=bodies.normals @ position.direction,
        contact_modulus_MPa=modulus,
    )
    return CoupledProblem(
        bodies=replace(half_space, compliance=bodies.compliance),
        half_space=half_space,
        model=model_of(bodies.compliance, grid, contact_modulus_MPa=modulus),
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

    def solve(self, load_N: float) -> Level:
        """Contact on a half-space and between the bodies, and whether the patch is at the edge of the zone."""
        position = self._position
        while True:
            with position.clock.step("contact"):
                half_space, solution = self._problem.solve(load_N)
            contact = Field.of_nodes(self.bodies.grid, solution.in_contact).values
            more = _more_room(self._room, self.bodies.grid, contact, position.expected)
            if more == self._room or self._enlarged == _ENLARGEMENTS:
                return self._level(half_space, solution, at_edge=more != self._room)
            try:
                larger = self._couple(more)
            except InputError as error:
                self.stopped_by = error
                return self._level(half_space, solution, at_edge=True)
            self.bodies.close()
            self._take(larger)
            self._room, self._enlarged = more, self._enlarged + 1

    def close(self) -> None:
        """Release both factors."""
        self.bodies.close()

    def _couple(self, room: Room) -> CoupledBodies:
        position = self._position
        zone = fine_zone(position.case, position.expected, position.expected_hertz, room, self._coarser)
        return couple(position.case, position.placement, zone, position.clock)

    def _take(self, bodies: CoupledBodies) -> None:
        self.bodies = bodies
        with self._position.clock.step("contact"):
            self._problem = coupled_problem(self._position, bodies)

    def _level(self, half_space: ContactSolution, solution: ContactSolution, *, at_edge: bool) -> Level:
        bodies, position = self.bodies, self._position
        upright = bodies.normals @ position.placement.first.normal
        on_half_space, fe = (
            Rung.of(bodies.grid, one, approach_mm=one.approach_mm * position.closing, upright=upright)
            for one in (half_space, solution)
        )
        meshes = (bodies.rail.mesh, bodies.wheel.mesh)
        return Level(
            half_space=on_half_space,
            fe=fe,
            degrees_of_freedom={mesh.name: 3 * len(mesh.points) for mesh in meshes},
            elements={mesh.name: len(mesh.hexes) for mesh in meshes},
            enlarged=self._enlarged,
            at_edge=at_edge,
        )


def mesh_case(case: Case, body: Literal["rail", "wheel"]) -> BodyMesh:
    """Mesh one body of a case, without solving it.

    Raises
    ------
    InputError
        As `solve` does.
    """
    placement = place_case(case)
    hertz, expected = expect_on_half_space(case, placement)
    zone = fine_zone(case, expected, hertz)
    check_memory(least_memory_bytes(zone), f"a contact zone of {zone.intervals_x} by {zone.intervals_s} elements")
    make = rail_mesh if body == "rail" else wheel_mesh
    return make(placement, zone, half=case.half, size=case.size)
