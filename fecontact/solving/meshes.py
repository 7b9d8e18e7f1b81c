"""Meshes of a position with their factors, and the refinement of a load."""

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
from fecontact.contact.grid import ContactGrid, Field, Rung, build_banded_grid
from fecontact.contact.solver import (
    Compliance,
    ContactProblem,
    ContactSolution,
    solve_by_correction,
    solve_contact,
)
from fecontact.contact_theories.hertz import hertz_from_hessian
from fecontact.errors import CoverageError, FoldedMeshError, InputError, MemoryShortageError
from fecontact.fe.body import make_elastic_body, mesh_to_assemble
from fecontact.fe.coupling import CoupledBodies, mortar_matrix
from fecontact.fe.linear_solver import choose_solver
from fecontact.fe.memory import check_memory
from fecontact.fe.meshing import FineZone, check_on_profiles, estimate_least_memory_bytes, rail_mesh, wheel_mesh
from fecontact.fe.stiffness import assemble_stiffness
from fecontact.fe.stress import nodal_stress
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.lines import ProfileVariants
from fecontact.judging.measures import read_patch
from fecontact.judging.own_measures import OwnMeasures
from fecontact.judging.solved_load import Level, SolvedLoad, has_faulty_elements
from fecontact.judging.theory import Evidence, has_certain_failure, is_undecidable_by_refinement, judge_hertz
from fecontact.judging.uncertainty import MESH_RATIO
from fecontact.judging.verdict import find_worst_verdict
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.cost import estimate_cpu_seconds
from fecontact.solving.expected_patch import measure_resolved_lobes_mm
from fecontact.solving.fine_zone import EDGE_ELEMENTS, MARGIN_ELEMENTS, ZoneMargin, enlarge_room, make_fine_zone
from fecontact.solving.gap_checks import compute_gap_curvature_error, compute_gap_distance_error_mm, recover_gap
from fecontact.solving.lobe_sizes import measure_lobe_sizes
from fecontact.solving.plane_angles import compute_normal_angles
from fecontact.solving.plastic_contact import (
    PlasticContact,
    YieldingBodies,
    add_variants,
    compute_nodal_fields,
    load_bodies,
)
from fecontact.solving.position import Clock, Position
from fecontact.solving.profile_variants import judge_case_variants
from fecontact.solving.quadratic_gap import solve_quadratic_gap
from fecontact.solving.solution_checks import (
    compute_correction_error,
    compute_load_error,
    iterate_loaded_rungs,
)
from fecontact.solving.true_gap import TrueGap

# --- A pair of meshes of a position: fine zone, both bodies coupled at their surfaces, and the contact between them.

# Offset of a second unit response from the centre, as a fraction of the zone's length and width: two thirds of the way
# to the edge of the patch.
_OFFSET_FRACTION = 0.15
_ENLARGEMENTS = 4
# Ratio of neighbouring layers if steel may yield: a plastic zone reaches down to 1.2 semi-axes at 2.5 yield stresses.
# With this ratio, six elements per semi-axis give the peak of a sphere within 0.2 %; with a ratio of 1.3 the peak is
# 1 % too high.
_YIELDING_LAYER_RATIO = 1.2
# Tolerances of the linear solutions for slides and stresses. The solutions of the contact itself are used, which are
# more accurate.
_SLIDE_TOLERANCE, _STRESS_TOLERANCE = 1e-3, 1e-7
# Factors on the element size that are tried in turn if the elements of a section fold: another size gives another mesh.
_FOLDED_SIZE_FACTORS = (1.0, 0.97, 0.94, 0.91)


def couple_bodies(
    case: Case, placement: Placement, zone: FineZone, clock: Clock, *, several_loads: bool = False
) -> CoupledBodies:
    """Mesh both bodies, couple their surfaces, assemble and factorise their matrices.

    Parameters
    ----------
    case
        Case with materials, sizes and solver.
    placement
        Wheel on rail.
    zone
        Fine zone of both meshes.
    clock
        Clock of the steps.
    several_loads
        Whether the factors are used for several loads.

    Returns
    -------
    CoupledBodies
        Both bodies with their factors.

    Raises
    ------
    MemoryShortageError
        If the meshes need more memory than the machine has.
    CoverageError, FoldedMeshError
        If a body does not cover the zone, or if its elements fold.
    """
    check_memory(
        estimate_least_memory_bytes(zone), f"a contact zone of {zone.intervals_x} by {zone.intervals_s} elements"
    )
    with clock.step("mesh"):
        layer_ratio = _YIELDING_LAYER_RATIO if case.may_yield else None
        rail = rail_mesh(placement, zone, half=case.half, size=case.size, layer_ratio=layer_ratio)
        wheel = wheel_mesh(placement, zone, half=case.half, size=case.size, layer_ratio=layer_ratio)
        check_on_profiles(placement, rail, wheel)
    # The surfaces are coupled before the factorisation, which takes longest: surfaces that do not face each other do
    # not need it.
    with clock.step("couple"):
        x_mm = np.linspace(0.0 if case.half else -zone.half_length_mm, zone.half_length_mm, rail.contact_nodes.shape[0])
        grid = ContactGrid(x_mm=x_mm, s_mm=zone.s_mm, half=case.half)
        _, normals = placement.surface(x_mm[:, None], grid.s_mm[None, :])
        wheel_nodes = np.unique(wheel.surfaces["contact"])
        local_numbers = np.full(len(wheel.points), -1)
        local_numbers[wheel_nodes] = np.arange(wheel_nodes.size)
        coupling = mortar_matrix(
            grid, placement.project(wheel.points[wheel_nodes]), local_numbers[wheel.surfaces["contact"]]
        )
    # Bodies that yield are solved many times for a load, and several patches are solved twice for each patch before the
    # contact. A whole body has a factorisation of each half.
    factors = 1 if case.half else 2
    solver = choose_solver(
        case.solver,
        [mesh.unknowns // factors for mesh in (rail, wheel) for _ in range(factors)],
        several_loads=several_loads or case.may_yield or len(zone.bands) > 1,
    )
    bodies = []
    for mesh, material in ((rail, case.rail_material), (wheel, case.wheel_material)):
        with clock.step("assemble"):
            matrix = assemble_stiffness(mesh_to_assemble(mesh), material)
        with clock.step("factorise"):
            bodies.append(make_elastic_body(mesh, material, solver, matrix))
        # Only the factorisation is needed from here on.
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
    """Contact problem of a position on a pair of meshes, with its compliances.

    Attributes
    ----------
    bodies
        Contact between the finite bodies, on the nodes of their mesh.
    half_space
        Contact of their gap on a half-space, where the solution starts.
    model
        Compliance of the bodies, taken as equal at every node.
    elements, otherwise
        Half-spaces with the compliance of the elements, by two fits that separate the response of the elements from the
        response of the bodies; the second fit is None where it is not needed.
    compliance_error
        Relative error of the compliance of the elements (-), the largest of all bands.
    """

    bodies: ContactProblem
    half_space: ContactProblem
    model: Compliance
    elements: Compliance
    otherwise: Compliance | None
    compliance_error: float

    def with_gap(self, gap_mm: Floats) -> CoupledProblem:
        """Contact of these bodies with another gap (n,) in mm.

        Parameters
        ----------
        gap_mm : ndarray of shape (n,)
            Gap on the nodes in mm.

        Returns
        -------
        CoupledProblem
            Problem with this gap for the bodies and for the half-space.
        """
        return replace(
            self, bodies=replace(self.bodies, gap_mm=gap_mm), half_space=replace(self.half_space, gap_mm=gap_mm)
        )

    def solve(self, load_N: float, *, slid: Callable[[ContactSolution], Floats] | None = None) -> ContactSolution:
        """Solve the contact of the bodies, starting from the contact on the half-space.

        Parameters
        ----------
        load_N
            Load in N.
        slid
            Function that returns the gap (n,) in mm after the slide of a solution; None without a slide.

        Returns
        -------
        ContactSolution
            Pressure and approach.
        """
        start_MPa = solve_contact(self.half_space, load_N).pressure_MPa
        return solve_by_correction(self.bodies, load_N, self.model, start_MPa=start_MPa, slid=slid)

    def read(
        self, solution: ContactSolution, true_gap: TrueGap, bodies: CoupledBodies
    ) -> tuple[Rung, Field, Field | None]:
        """Read the rung on the elements' nodes, and the opening beyond the elements.

        Parameters
        ----------
        solution
            Solution of the contact of the bodies.
        true_gap
            True gap with the direction of the load.
        bodies
            Coupled bodies with the grid of the nodes.

        Returns
        -------
        nodal : Rung
            Contact on the elements' nodes.
        added : Field
            Opening of the bodies minus opening of a half-space of elements, in mm.
        otherwise : Field or None
            This opening with the other fit; None where it is not needed.
        """
        nodal = Rung.of(
            bodies.grid,
            solution,
            approach_mm=solution.approach_mm * true_gap.closing,
            upright=bodies.normals @ true_gap.placement.first.normal,
        )
        opening_mm = self.bodies.opening_mm(solution)

        def subtract_elements(elements: Compliance) -> Field:
            return Field.of_nodes(bodies.grid, opening_mm - elements(solution.pressure_MPa))

        return (
            nodal,
            subtract_elements(self.elements),
            None if self.otherwise is None else subtract_elements(self.otherwise),
        )


def make_coupled_problem(true_gap: TrueGap, bodies: CoupledBodies, *, otherwise: bool = True) -> CoupledProblem:
    """Set up the contact problem of coupled bodies.

    The cost is an application of the compliance for each band of the bodies. For whole bodies, the other fit costs
    another application for each band.

    Parameters
    ----------
    true_gap
        True gap with contact modulus and direction.
    bodies
        Coupled bodies with their grid.
    otherwise
        Whether the other fit is needed.

    Returns
    -------
    CoupledProblem
        Problem without a load.
    """
    grid, modulus = bodies.grid, true_gap.contact_modulus_MPa
    body_problem = ContactProblem(
        compliance=bodies.compliance,
        within=bodies.compliance,
        gap_mm=grid.weighted_mean(true_gap.gap),
        closing=bodies.normals @ true_gap.direction,
        area_mm2=grid.whole_area_mm2(),
    )
    bands = Bands(grid=grid, columns=bodies.bands, contact_modulus_MPa=modulus)
    responses = bands.responses(bodies.compliance)
    other_fit: Compliance | None = None
    if otherwise:
        # The elements of a yawed wheel meet the elements of the rail differently at each place.
        other_responses = responses if grid.half else bands.responses(bodies.compliance, beside=_OFFSET_FRACTION)
        other_fit = bands.combine([response.half_space_of_elements(quartic=True) for response in other_responses])
    return CoupledProblem(
        bodies=body_problem,
        half_space=replace(body_problem, compliance=bands.half_space(), within=None),
        model=bands.combine([response.model() for response in responses]),
        elements=bands.combine([response.half_space_of_elements() for response in responses]),
        otherwise=other_fit,
        compliance_error=_compliance_error(responses, true_gap.placement, bodies),
    )


def _compliance_error(responses: Sequence[UnitResponse], placement: Placement, bodies: CoupledBodies) -> float:
    """Error of the compliance with the largest magnitude of all bands; NaN without a measured error."""
    normals = bodies.normals[: bodies.grid.shape[1]]
    angle_rad = np.arctan2(-normals[:, 1], normals[:, 2])
    errors = (
        response.compliance_error(angle_rad[columns], placement.side_mm(float(response.grid.s_mm[response.node[1]])))
        for response, columns in zip(responses, bodies.bands, strict=True)
    )
    return max((error for error in errors if not math.isnan(error)), key=abs, default=math.nan)


class CoupledMesh:
    """Bodies of a position on a pair of meshes, coupled once.

    The fine zone grows if a patch comes near its edge.

    Attributes
    ----------
    room
        Room around the expected patch.
    enlarged
        Number of enlargements of the zone.
    growth_error
        Error that prevented an enlargement; None without an error.
    bodies
        Coupled bodies with their factors.
    plastic
        Yielding bodies and their contact; None if no body has yielded.
    """

    def __init__(self, position: Position, coarser: float, room: ZoneMargin | None = None) -> None:
        """Make and couple both bodies.

        `coarser` is a factor on the element sizes, and `room` is the room that other meshes needed.

        Parameters
        ----------
        position
            Placed case with its element sizes.
        coarser
            Factor on the element sizes (-).
        room
            Room around the patch that other meshes needed.
        """
        self.plastic: tuple[YieldingBodies, PlasticContact] | None = None
        self._position, self._coarser = position, coarser
        self.room = room or ZoneMargin()
        self.enlarged = 0
        self.growth_error: InputError | None = None
        try:
            bodies = self._couple(self.room)
        except InputError:
            if self.room == ZoneMargin():
                raise
            # Elements of this size may not need the room.
            self.room = ZoneMargin()
            bodies = self._couple(self.room)
        self._set_bodies(bodies)

    def solve(self, position: Position) -> Level:
        """Solve the contact of the position's load between the bodies.

        Parameters
        ----------
        position
            Position under the load.

        Returns
        -------
        Level
            Contact, also with yielding bodies, and whether the patch is at the edge of the zone.
        """
        while True:
            self.bodies.forget()
            with position.clock.step("contact"):
                true_gap, problem, solution = self._contact(position)
                nodal, added, other_fit = problem.read(solution, true_gap, self.bodies)
            position = replace(position, true_gap=true_gap)
            room = self._more_room(position, nodal, added)
            at_edge, larger_bodies = room != self.room, None
            if at_edge and self.enlarged < _ENLARGEMENTS:
                try:
                    larger_bodies = self._couple(room)
                except InputError as error:
                    self.growth_error = error
            if larger_bodies is None:
                level = self._level(position, nodal, (added, other_fit), at_edge=at_edge)
                return self._add_yield(position, problem, solution, level)
            self.bodies.close()
            self._set_bodies(larger_bodies)
            self.room, self.enlarged = room, self.enlarged + 1

    def _contact(self, position: Position) -> tuple[TrueGap, CoupledProblem, ContactSolution]:
        """Solve the contact on the elements' nodes, with the slide on a steep surface.

        Returns
        -------
        true_gap, problem, solution
            The gap function (with the slide of the solution on a steep surface), the contact problem with this gap, and
            its solution.
        """
        problem, true_gap, grid = self._problem, position.true_gap, self.bodies.grid
        if true_gap.slide_mm != self._position.true_gap.slide_mm:
            problem = problem.with_gap(grid.weighted_mean(true_gap.gap))
        if not true_gap.is_steep:
            return true_gap, problem, problem.solve(position.case.load_N)
        gaps: list[tuple[TrueGap, Floats]] = []

        def compute_slid_gap(solution: ContactSolution) -> Floats:
            slid_gap = replace(true_gap, slide_mm=self._slide_mm(true_gap, solution))
            gaps.append((slid_gap, grid.weighted_mean(slid_gap.gap)))
            return gaps[-1][1]

        solution = problem.solve(position.case.load_N, slid=compute_slid_gap)
        true_gap, gap_mm = gaps[-1]
        return true_gap, problem.with_gap(gap_mm), solution

    def _add_yield(self, position: Position, problem: CoupledProblem, solution: ContactSolution, level: Level) -> Level:
        """Add the first loading of bodies that may yield to a level.

        The level is returned unchanged if the case has no yield stress or the level is not converged. `plastic` keeps
        the plastic contact for further loads. Variants of the yield stress are solved on the coarser meshes only.
        """
        if not position.case.may_yield or level.status != "converged":
            return level
        load_N, true_gap = position.case.load_N, position.true_gap

        def read_rungs(plastic_solution: ContactSolution, load_N: float) -> tuple[Rung, Rung]:
            nodal, added, _ = problem.read(plastic_solution, true_gap, self.bodies)
            grid = make_covering_grid(position.expected.half_space.grid, nodal)
            return nodal, true_gap.solve(grid, load_N, added=added, start=level.fe.pressure)

        with position.clock.step("yield"):
            elastic = (solution, level.nodal, level.fe)
            bodies = YieldingBodies.of(self.bodies, problem.bodies, problem.model, solution.pressure_MPa)
            is_coarse = self._coarser > 1.0
            result = load_bodies(bodies, elastic, load_N, read_rungs, sparing=is_coarse)
            if is_coarse:
                result = add_variants(result, bodies, elastic, load_N, read_rungs)
        self.plastic = None if result.contact is None else (bodies, result.contact)
        return replace(level, yielded=result.yielded)

    def _slide_mm(self, true_gap: TrueGap, solution: ContactSolution) -> float:
        """Lateral slide of the wheel along the tangent of the rail's profile at first contact.

        The slide is the tangential part of the approach minus the tangential deformation of both bodies below the
        patch, a mean with the pressure as its weight.

        Parameters
        ----------
        true_gap
            Gap with the direction of the approach.
        solution
            Contact under this gap.

        Returns
        -------
        float
            Slide in mm.
        """
        tangent = true_gap.placement.first.tangent
        force = self.bodies.grid.whole_area_mm2() * solution.pressure_MPa
        parting_mm = self.bodies.parting(solution.pressure_MPa, _SLIDE_TOLERANCE) @ tangent
        yielding_mm = float(force @ parting_mm) / float(force.sum())
        return solution.approach_mm * float(true_gap.direction @ tangent) - yielding_mm

    def _more_room(self, position: Position, nodal: Rung, added: Field) -> ZoneMargin:
        """Room of the zone, enlarged where the contact is near or beyond its edge.

        Parameters
        ----------
        position
            Position with the gap function.
        nodal
            Contact on the elements' nodes.
        added
            Elastic opening in mm that the elements add to the half-space.
        """
        larger_room = enlarge_room(self.room, nodal, position.expected, self.bodies.bands)
        overlap_mm = position.true_gap.find_overlap_beyond(nodal, added)
        if overlap_mm is None:
            return larger_room
        low_mm, high_mm = overlap_mm
        s_mm = nodal.grid.s_mm
        return replace(
            larger_room,
            s_low=larger_room.s_low + max(0.0, float(s_mm[0]) - low_mm),
            s_high=larger_room.s_high + max(0.0, high_mm - float(s_mm[-1])),
        )

    def close(self) -> None:
        """Release both factors."""
        self.bodies.close()

    def _couple(self, room: ZoneMargin) -> CoupledBodies:
        """Couple the bodies over the expected patch and a margin.

        The margin is narrower if a head does not have the width for it.
        """
        width_mm = self._coarser * self._position.element_size_mm[1]
        first_error: CoverageError | FoldedMeshError | None = None
        for columns in range(MARGIN_ELEMENTS - EDGE_ELEMENTS + 1):
            narrower_room = replace(
                room, s_low=room.s_low - columns * width_mm, s_high=room.s_high - columns * width_mm
            )
            try:
                return self._couple_with_sizes(narrower_room)
            except (CoverageError, FoldedMeshError) as error:
                first_error = first_error or error
        assert first_error is not None
        raise first_error

    def _couple_with_sizes(self, room: ZoneMargin) -> CoupledBodies:
        """Couple the bodies over a room, with smaller elements if elements fold.

        All factors of `_FOLDED_SIZE_FACTORS` are tried in turn; if elements fold with every factor, the first error is
        raised.
        """
        position = self._position
        first_error: FoldedMeshError | None = None
        for factor in _FOLDED_SIZE_FACTORS:
            length_mm, width_mm = (factor * self._coarser * size_mm for size_mm in position.element_size_mm)
            zone = make_fine_zone(position.expected, (length_mm, width_mm), room)
            try:
                return couple_bodies(
                    position.case, position.placement, zone, position.clock, several_loads=position.several_loads
                )
            except FoldedMeshError as error:
                first_error = first_error or error
        assert first_error is not None
        raise first_error

    def _set_bodies(self, bodies: CoupledBodies) -> None:
        self.bodies = bodies
        with self._position.clock.step("contact"):
            self._problem = make_coupled_problem(self._position.true_gap, bodies, otherwise=self._coarser <= 1.0)

    def _level(self, position: Position, nodal: Rung, added: tuple[Field, Field | None], *, at_edge: bool) -> Level:
        """Make the level of a solved contact, with the contact on finer nodes.

        Parameters
        ----------
        position
            Position with its gap function and load.
        nodal
            Contact on the elements' nodes.
        added
            Opening in mm that the elements add to the half-space, by the fit and by the other fit (None without it).
        at_edge
            Whether the contact is near the edge of the zone.
        """
        bodies = self.bodies
        with position.clock.step("resolve"):
            half_space, gap, load_N = position.expected.half_space, position.true_gap, position.case.load_N
            grid = make_covering_grid(half_space.grid, nodal)
            fe = gap.solve(grid, load_N, added=added[0], start=half_space.pressure)
            if gap.overlaps_between(fe, added[0]):
                fe = gap.solve(fe.even().grid, load_N, added=added[0], start=fe.pressure)
            other_fit = None
            if added[1] is not None:
                # The contact is nearly equal to the contact before.
                other_fit = gap.solve(fe.grid, load_N, added=added[1], start=fe.pressure)
        meshes = (bodies.rail.mesh, bodies.wheel.mesh)
        force_balance, moment_balance = bodies.balance(nodal.pressure_MPa.ravel())
        return Level(
            nodal=nodal,
            fe=fe,
            otherwise=other_fit,
            compliance_error=self._problem.compliance_error,
            degrees_of_freedom={mesh.name: mesh.unknowns for mesh in meshes},
            elements={mesh.name: len(mesh.hexes) for mesh in meshes},
            slide_mm=position.true_gap.slide_mm,
            force_balance=force_balance,
            moment_balance=moment_balance,
            enlarged=self.enlarged,
            at_edge=at_edge,
            gap_distance_error_mm=compute_gap_distance_error_mm(gap, recover_gap(gap, fe, added[0]), bodies),
            correction_error=compute_correction_error(
                added[0], nodal.pressure, self._problem.model, self._problem.half_space.compliance
            ),
        )


def make_covering_grid(fine: ContactGrid, nodal: Rung) -> ContactGrid:
    """Grid with the steps and positions of a finer grid, over a contact on elements.

    It also covers two elements around the contact.

    Parameters
    ----------
    fine
        Finer grid.
    nodal
        Contact on the elements' nodes.

    Returns
    -------
    ContactGrid
        Grid with the bands of the finer grid.
    """
    rows, columns = (np.flatnonzero(nodal.pressure_MPa.any(axis=axis)) for axis in (1, 0))
    x_mm = _extend_axis(fine.x_mm, nodal.grid.x_mm, rows, from_plane=nodal.grid.half)
    if len(bands := fine.bands) == 1:
        return ContactGrid(x_mm=x_mm, s_mm=_extend_axis(fine.s_mm, nodal.grid.s_mm, columns), half=fine.half)
    middles_mm = [0.5 * (left_band.s_mm[-1] + right_band.s_mm[0]) for left_band, right_band in pairwise(bands)]
    band_numbers = np.searchsorted(middles_mm, nodal.grid.s_mm[columns])
    bands_mm = [
        _extend_band(band.s_mm, nodal.grid.s_mm, columns[band_numbers == number]) for number, band in enumerate(bands)
    ]
    return build_banded_grid(x_mm, bands_mm, half=fine.half)


def _extend_band(fine_mm: Floats, coarse_mm: Floats, columns: NDArray[np.int64]) -> Floats:
    """Extend a band over a contact on elements, at most by its width per end.

    Parameters
    ----------
    fine_mm
        Uniform positions (n,) of the band in mm.
    coarse_mm
        Positions of the elements' nodes in mm.
    columns
        Indices of the loaded columns on the elements' nodes; the band is returned unchanged if there are none.
    """
    if columns.size == 0:
        return fine_mm
    step_mm, extended_mm = float(fine_mm[1] - fine_mm[0]), _extend_axis(fine_mm, coarse_mm, columns)
    added_nodes = [
        min(max(0, round(excess_mm / step_mm)), fine_mm.size)
        for excess_mm in (fine_mm[0] - extended_mm[0], extended_mm[-1] - fine_mm[-1])
    ]
    return np.asarray(fine_mm[0] + step_mm * np.arange(-added_nodes[0], fine_mm.size + added_nodes[1]))


def _extend_axis(fine_mm: Floats, coarse_mm: Floats, columns: NDArray[np.int64], *, from_plane: bool = False) -> Floats:
    """Positions in the steps of a finer axis, over the covered columns and two more at either end."""
    first, last = max(int(columns[0]) - 2, 0), min(int(columns[-1]) + 2, coarse_mm.size - 1)
    step_mm = float(fine_mm[1] - fine_mm[0])
    low_number = 0 if from_plane else math.ceil((float(coarse_mm[first]) - float(fine_mm[0])) / step_mm)
    high_number = math.floor((float(coarse_mm[last]) - float(fine_mm[0])) / step_mm)
    return np.asarray(fine_mm[0] + step_mm * np.arange(low_number, high_number + 1))


# --- Meshes of a position, which own their factors: the verdict decides on the number of meshes for a load.

# Mesh of the case, a coarser mesh, and three refinements.
_MOST_MESHES = 5
# Number of meshes if the verdict on the elements' nodes is needed too.
_MOST_EVIDENCE_MESHES = 6
# Number of elements on the semi-axis for which they are made, on the finest meshes of every named resolution.
_FEWEST_ELEMENTS = 4
# Smallest number of elements per semi-axis, measured on the nodes of the elements. With fewer elements a single row of
# nodes carries 98 % of the load, so that the nodes show neither the size of the patch nor their own error.
_LEAST_ELEMENTS = 0.25
# Poisson's ratio above which the elements can be far too stiff, so that a single row of nodes carries the load.
_STIFF_POISSON = 0.49
# Fraction of the requested nodes below which a lobe counts as poorly resolved. A lobe is measured slightly differently
# on its last nodes than on the nodes for which they were made.
_NODE_SHORTAGE_FRACTION = 0.7


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedBodies:
    """Both bodies of the finest meshes under a load, with their displacements.

    Base and driver are fixed: the rigid approach is not included. Displacements are elastic.

    Attributes
    ----------
    coupled
        Coupled bodies with their meshes.
    displacement_mm
        Displacements (n, 3) in mm of the nodes, by body.
    yielded
        Arrays at the nodes of a body that has yielded (`plastic_contact.compute_nodal_fields`).
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
    """Meshes of a position, made on demand and solved for any number of loads.

    Parameters
    ----------
    position
        Position; its expected patch decides on zone and element size of all meshes.
    keep
        Whether the factors are kept for further loads until `close`. If not, they are released when a load is solved,
        and `bodies` belong to its finest meshes.
    """

    def __init__(self, position: Position, *, keep: bool = False) -> None:
        """Start without any mesh.

        Parameters
        ----------
        position
            Placed case with its element sizes.
        keep
            Whether the bodies of the finest mesh are kept.
        """
        self.position = position
        self.bodies: SolvedBodies | None = None
        self._keep = keep
        self._meshes: dict[float, CoupledMesh] = {}
        self._not_enlarged: list[InputError] = []
        self._room = ZoneMargin()
        self._seconds_by_factor: dict[float, float] = {}

    def solve(self, position: Position) -> SolvedLoad:
        """Solve a position's load on two meshes, and refine while the verdict is UNRESOLVED.

        Refinement ends at the limit of unknowns.

        Parameters
        ----------
        position
            Position of the meshes, under any load.

        Returns
        -------
        SolvedLoad
            Contacts on all mesh levels, with the half-space and the profile variants.

        Raises
        ------
        InputError
            If the elements of the first meshes are too coarse for the patch, or the function of a user's criterion
            fails.
        """
        case, placement = position.case, position.placement
        # an error in the function of a user is reported before the meshes are made
        OwnMeasures.read_criteria(case, placement).read_values(position.expected.half_space)
        with position.clock.step("expect the patch"):
            lines = judge_case_variants(case, placement)
        self._not_enlarged, self._room = [], ZoneMargin()
        levels = [self._level(position, 1.0)]
        _check_element_size(case, levels[0])
        levels.append(self._level(position, MESH_RATIO, self._left_s(levels, estimate_coarser_unknowns(levels[0]))))
        stop_error: InputError | None = None
        while stop_error is None and is_open(case, levels, placement, lines, position.expected.half_space):
            stop_error = self._refine(position, levels)
        with position.clock.step("ladder"):
            hertz = hertz_from_hessian(
                placement.first.curvature.hessian,
                normal_force_N=levels[0].fe.normal_force_N,
                contact_modulus_MPa=case.contact_modulus_MPa,
            )
            half_space, turned_rung = position.expected.half_space, _solve_with_turned_normals(position)
            return SolvedLoad(
                case=case,
                levels=tuple(levels),
                half_space=half_space,
                turned=turned_rung,
                quadratic=solve_quadratic_gap(placement.first, hertz, half=case.half, nodes=case.nodes_per_semi_axis),
                lines=lines,
                limits=(
                    *_iterate_limits(position, levels),
                    *(f"the contact zone cannot be enlarged: {error}" for error in self._not_enlarged),
                    *(() if stop_error is None else (f"refinement stopped: {stop_error}",)),
                ),
                short_of_memory=any(
                    isinstance(error, MemoryShortageError) for error in (*self._not_enlarged, stop_error)
                ),
                gap_curvature_error=compute_gap_curvature_error(position.true_gap, half_space.grid),
                load_error=compute_load_error(
                    position.true_gap, case.load_N, iterate_loaded_rungs(half_space, turned_rung, levels)
                ),
            )

    def recover_bodies(self, solved_load: SolvedLoad) -> SolvedBodies:
        """Both bodies of the finest meshes under the load that was solved last.

        Parameters
        ----------
        solved_load
            Load that was solved last.

        Returns
        -------
        SolvedBodies
            Bodies with their displacements.
        """
        if self._keep:
            self._recover(self._meshes[MESH_RATIO ** (2 - len(solved_load.levels))], solved_load.levels[0])
        assert self.bodies is not None
        return self.bodies

    def drop_enlarged(self) -> None:
        """Release meshes that grew under a load.

        The result of the next load is then independent of the loads before it.
        """
        for coarser in [coarser for coarser, mesh in self._meshes.items() if mesh.room != ZoneMargin()]:
            self._meshes.pop(coarser).close()

    def close(self) -> None:
        """Release all factors; a further load makes its meshes again."""
        for mesh in self._meshes.values():
            mesh.close()
        self._meshes.clear()

    def _refine(self, position: Position, levels: list[Level]) -> InputError | None:
        """Insert a level on finer meshes before the other levels.

        The elements are smaller by `MESH_RATIO` than on the finest level. Reasons are too many degrees of freedom and
        too little memory or geometry for the meshes; then `levels` is unchanged. The result is None if the level was
        inserted.
        """
        case = position.case
        expected_unknowns = estimate_finer_unknowns(levels)
        if expected_unknowns > case.most_unknowns:
            return InputError(
                f"the next meshes need about {expected_unknowns} degrees of freedom (allowed: at most"
                f" {case.most_unknowns})"
            )
        try:
            level = self._level(position, MESH_RATIO ** (1 - len(levels)), self._left_s(levels, expected_unknowns))
            _check_element_size(case, level)
        except InputError as error:
            return error
        levels.insert(0, level)
        return None

    def _level(self, position: Position, coarser: float, seconds_left: float | None = None) -> Level:
        """Solve a level and measure its wall time.

        `coarser` is the size of the elements as a factor of the size of the case. `seconds_left` is the estimated time,
        for the progress only.
        """
        clock, start_seconds = position.clock, time.perf_counter()
        clock.stage = _describe_stage(position.case, coarser, seconds_left)
        try:
            return self._solved(position, coarser)
        finally:
            clock.stage = ""
            self._seconds_by_factor[coarser] = time.perf_counter() - start_seconds

    def _left_s(self, levels: Sequence[Level], degrees_of_freedom: float) -> float | None:
        """Estimated seconds for a number of unknowns, from the time of the finest meshes.

        None if bodies may yield.
        """
        finest_unknowns = sum(levels[0].degrees_of_freedom.values())
        finest_seconds = self._seconds_by_factor[min(self._seconds_by_factor)]
        return (
            None
            if self.position.case.may_yield
            else finest_seconds * estimate_cpu_seconds(degrees_of_freedom) / estimate_cpu_seconds(finest_unknowns)
        )

    def _solved(self, position: Position, coarser: float) -> Level:
        """Solve a level on its meshes, which are made if they do not exist yet.

        `coarser` is the size of the elements as a factor of the size of the case: 1 for the meshes of the case, below 1
        for a refinement. Meshes are kept for further loads or closed, as `keep` decides.
        """
        mesh = self._meshes.get(coarser) or CoupledMesh(self.position, coarser, self._room)
        level = replace(mesh.solve(position), more_nodes=position.more_nodes, turned_force=position.turned_force)
        self._room = mesh.room
        if mesh.growth_error is not None:
            self._not_enlarged.append(mesh.growth_error)
        if self._keep:
            self._meshes[coarser] = mesh
            return level
        # The coarse mesh is solved second, a refinement after it.
        if self.bodies is None or coarser < 1.0:
            self._recover(mesh, level)
        mesh.close()
        return level

    def _recover(self, mesh: CoupledMesh, level: Level) -> None:
        """Recover the displacements of both bodies."""
        with self.position.clock.step("recover"):
            rail, wheel = mesh.bodies.displacements(level.nodal.pressure_MPa.ravel(), tolerance=_STRESS_TOLERANCE)
            self.bodies = SolvedBodies(
                coupled=mesh.bodies,
                displacement_mm={"rail": rail, "wheel": wheel},
                yielded={} if mesh.plastic is None else compute_nodal_fields(*mesh.plastic),
            )


def _check_element_size(case: Case, level: Level) -> None:
    """Refuse a level with elements that are wider than the patch.

    Raises
    ------
    InputError
        If the patch on the nodes of the elements has fewer than `_LEAST_ELEMENTS` elements per semi-axis.
    """
    patch = read_patch(level.on_elements)
    semi_axes_mm, sizes_mm = (patch.a_mm, patch.b_mm), level.on_elements.grid.steps_mm
    count, size_mm, direction = min(
        (axis_mm / size_mm, size_mm, direction)
        for axis_mm, size_mm, direction in zip(semi_axes_mm, sizes_mm, ("along x", "across"), strict=True)
    )
    if count >= _LEAST_ELEMENTS:
        return
    stiff = max(case.rail_material.poisson, case.wheel_material.poisson) > _STIFF_POISSON
    raise InputError(
        f"the elements are too coarse for this patch: the patch on their nodes has {count:.2g} elements of"
        f" {size_mm:.3g} mm per semi-axis {direction}; allowed: at least {_LEAST_ELEMENTS:g}; use smaller elements, for"
        " example --resolution quick"
        + (
            f", or a Poisson's ratio of at most {_STIFF_POISSON:g}, because they are too stiff above it"
            if stiff
            else ""
        )
    )


def _solve_with_turned_normals(position: Position) -> Rung | None:
    """Half-space of several lobes with each pressure along the normal at its place.

    None for a single lobe.
    """
    rung = position.expected.half_space
    if len(read_patch(rung).lobes) == 1:
        return None
    angle_rad = compute_normal_angles(position.placement, rung.grid.s_mm)
    return position.true_gap.solve(rung.grid, position.case.load_N, start=rung.pressure, angle_rad=angle_rad)


def _describe_stage(case: Case, coarser: float, seconds_left: float | None) -> str:
    """Description of the present meshes and of their remaining time, for waiting users.

    `coarser` is the factor on the size of the elements: 1 for the first meshes, above 1 for coarser meshes, below 1 for
    finer meshes.
    """
    if coarser == 1.0:
        return "first meshes"
    time_left = "" if seconds_left is None else f", about {max(seconds_left, 1.0):.0f} s left"
    if coarser > 1.0:
        return f"coarser meshes, for the uncertainty{time_left}"
    # With refine = "evidence", finer meshes also follow if the verdict is decided and the verdict on the elements'
    # nodes is not.
    open_verdict = (
        "the verdict, or the verdict on the nodes of the elements," if case.refine == "evidence" else "the verdict"
    )
    return f"finer meshes, because {open_verdict} is unresolved{time_left}{' if these resolve it' * bool(time_left)}"


def _iterate_limits(position: Position, levels: Sequence[Level]) -> Iterator[str]:
    """Sentence on each shortage of elements or nodes for the patch.

    There is a shortage with fewer than `_FEWEST_ELEMENTS` elements per semi-axis, and with fewer pressure nodes per
    lobe than `_NODE_SHORTAGE_FRACTION` of the requested number. Without a shortage nothing is yielded.
    """
    semi_axes_mm = (position.expected.semi_axis_x_mm, position.expected.semi_axis_s_mm)
    sizes_mm = levels[0].nodal.grid.steps_mm
    count, size_mm, semi_axis_mm = min(
        (axis_mm / size_mm, size_mm, axis_mm) for axis_mm, size_mm in zip(semi_axes_mm, sizes_mm, strict=True)
    )
    # This is possible with given element sizes.
    if count < _FEWEST_ELEMENTS:
        yield (
            f"elements of {size_mm:.2f} mm are only {count:.1f} per semi-axis of the patch ({semi_axis_mm:.2f} mm); use"
            f" at least {_FEWEST_ELEMENTS}, so that the effect of the finite bodies is reliable"
        )
    rung, requested = position.expected.half_space, position.case.nodes_per_semi_axis
    lengths_and_steps = zip(measure_resolved_lobes_mm(measure_lobe_sizes(rung)), rung.grid.steps_mm, strict=True)
    count, length_mm = min((length_mm / step_mm, length_mm) for length_mm, step_mm in lengths_and_steps)
    # The number of nodes of the case would be too many.
    if count <= _NODE_SHORTAGE_FRACTION * requested:
        yield (
            f"a lobe of {length_mm:.2g} mm has {count:.0f} pressure nodes instead of {requested}, because a patch this"
            " wide would need too many; the uncertainty of its peak and load is larger than stated"
        )


def is_open(
    case: Case, levels: Sequence[Level], placement: Placement, lines: ProfileVariants | None, half_space: Rung
) -> bool:
    """Whether another pair of meshes may decide an UNRESOLVED verdict on a load.

    If `Case.refine` is "evidence", the verdict on the elements' nodes counts, too. Elements that are too coarse for
    their place appear too soft or too stiff; finer elements appear so only if they are.

    Parameters
    ----------
    case
        Case with criteria and refinement.
    levels
        Mesh levels, the finest first.
    placement
        Wheel on rail.
    lines
        Theories on the profile variants; None for exact profiles.
    half_space
        Contact of the true gap on the half-space.

    Returns
    -------
    bool
        False if the largest number of meshes is reached, or if a level has not converged.
    """
    most_meshes = _MOST_EVIDENCE_MESHES if case.refine == "evidence" else _MOST_MESHES
    if any(level.status != "converged" for level in levels) or len(levels) == most_meshes:
        return False
    evidences: tuple[Evidence, ...] = ("fe", "elements") if case.refine == "evidence" else ("fe",)
    is_undecidable = {
        evidence: is_undecidable_by_refinement(
            case, levels, placement, lines, by=evidence, refinements=most_meshes - len(levels)
        )
        for evidence in evidences
    }
    if has_faulty_elements(levels):
        # If the numbers are wrong, only the profile variants show that no mesh decides.
        may_be_decided = lines is None or not all(is_undecidable.values())
        return may_be_decided and not has_certain_failure(judge_hertz(case, levels, placement, lines), half_space)
    return any(
        _is_unresolved(evidence, case, levels, placement, lines)
        for evidence in evidences
        if not is_undecidable[evidence]
    )


def _is_unresolved(
    evidence: Evidence, case: Case, levels: Sequence[Level], placement: Placement, lines: ProfileVariants | None
) -> bool:
    """Whether the verdict on Hertz is UNRESOLVED by the given evidence."""
    return find_worst_verdict(judge_hertz(case, levels, placement, lines, by=evidence)).answer == "UNRESOLVED"


def would_be_refined(load: JudgedLoad, placement: Placement) -> bool:
    """Whether a new solution would refine a stored load with an UNRESOLVED verdict.

    Parameters
    ----------
    load
        Judged load.
    placement
        Wheel on rail.

    Returns
    -------
    bool
        False if the next meshes would have too many unknowns.
    """
    solved_load = load.solved
    is_affordable = estimate_finer_unknowns(solved_load.levels) <= load.case.most_unknowns
    return is_affordable and is_open(
        load.case, solved_load.levels, placement, solved_load.lines, solved_load.half_space
    )


def estimate_coarser_unknowns(level: Level) -> float:
    """Expected degrees of freedom of the coarser meshes.

    Graded meshes grow with about the square of MESH_RATIO.

    Parameters
    ----------
    level
        Mesh level with its finer meshes.

    Returns
    -------
    float
        Number of degrees of freedom of both bodies.
    """
    return sum(level.degrees_of_freedom.values()) / MESH_RATIO**2


def estimate_finer_unknowns(levels: Sequence[Level]) -> int:
    """Expected degrees of freedom of the next finer meshes.

    Graded meshes grow less than with the third power of MESH_RATIO.

    Parameters
    ----------
    levels
        Mesh levels, the finest first.

    Returns
    -------
    int
        Degrees of freedom of both bodies.
    """
    fine_unknowns, coarse_unknowns = (sum(level.degrees_of_freedom.values()) for level in levels[:2])
    # The uniform zone grows faster than the rest, so that the ratio increases too.
    return int(fine_unknowns * min((fine_unknowns / coarse_unknowns) ** 1.2, MESH_RATIO**3))
