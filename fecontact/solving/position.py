"""Position of a case before its solution: the wheel on the rail, and the expected patch."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cached_property

import psutil

from fecontact.case import Case
from fecontact.contact_theories.hertz import HertzContact
from fecontact.errors import ConvergenceError, InputError
from fecontact.fe.linear_solver import choose_solver
from fecontact.fe.meshing import make_too_short_error
from fecontact.judging.measures import MEASURES, read_patch
from fecontact.judging.solved_load import compare_with_more_nodes
from fecontact.packages import require_finite_elements
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.element_sizes import choose_element_size_mm, choose_element_width_mm
from fecontact.solving.expected_patch import (
    ExpectedPatch,
    find_expected_patch,
    solve_on_fewer_nodes,
    solve_on_more_nodes,
)
from fecontact.solving.hertz import compute_hertz, compute_load_direction
from fecontact.solving.placing import place_case
from fecontact.solving.plane_angles import compute_turned_force
from fecontact.solving.true_gap import TOLERANCE, TrueGap

Progress = Callable[[str], None]
LARGEST_PEAK_OVER_YIELD_STRESS = 5.0
"""Largest ratio of elastic peak pressure to yield stress at which a first loading is solved."""
# Number of nodes for a second reading of peak, area and valley, divided by the number of the case: 96 instead of 32,
# for 0.1 to 2 s. If the strip of the patch beyond a junction is narrower than the grid spacing, 48 nodes do not show it
# either (60E1 upright with EN15302_H, -0.31 mm, 158.5 kN: 0.69 % of the area, of which 48 nodes show 0.14 and 96 nodes
# show 0.66 %).
_NODE_FACTOR = 3.0
# Factor on the grid spacing for the reading on fewer nodes, if more nodes would be too many.
_COARSER_SPACING_FACTOR = 1.5


class Clock:
    """Wall seconds and memory of each step.

    Attributes
    ----------
    stage
        Stage of the solution, in words; empty without a stage.
    seconds, memory_MB
        Wall seconds, and resident memory in MB after each step, by the name of the step.
    """

    def __init__(self, progress: Progress | None) -> None:
        """Start without any step.

        `progress` is called with the name of each step as it begins, after the `stage` and a colon if there is a stage.

        Parameters
        ----------
        progress
            Function that is called with a text; None for no calls.
        """
        self.stage = ""
        self.seconds: dict[str, float] = {}
        self.cpu_seconds = 0.0
        self.memory_MB: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Measure time and memory of the enclosed code under a name.

        Parameters
        ----------
        name
            Name of the step.

        Yields
        ------
        None
            Control to the measured code.
        """
        if self._progress is not None:
            self._progress(f"{self.stage}: {name}" if self.stage else name)
        start, cpu_start = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self.cpu_seconds += time.process_time() - cpu_start
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
            self.memory_MB[name] = psutil.Process().memory_info().rss / 1e6

    def take_seconds(self) -> dict[str, float]:
        """Return the seconds of each step since the last call.

        Returns
        -------
        dict
            Seconds by the names of the steps.
        """
        seconds, self.seconds = self.seconds, {}
        return seconds

    def take_cpu_seconds(self) -> float:
        """Return the CPU seconds of all steps since the last call.

        Returns
        -------
        float
            User and system time of all threads of the process, in s.
        """
        cpu_seconds, self.cpu_seconds = self.cpu_seconds, 0.0
        return cpu_seconds


@dataclass(frozen=True, kw_only=True, eq=False)
class Position:
    """Common properties of all meshes and loads of a position.

    Attributes
    ----------
    case, expected
        Case and expected patch for which the meshes are made.
    true_gap
        True gap under the load.
    element_size_mm
        Length and width of the elements of the first meshes.
    clock
        Clock of the steps.
    several_loads
        Whether the meshes serve more loads than the case's load.
    """

    case: Case
    true_gap: TrueGap
    expected: ExpectedPatch
    element_size_mm: tuple[float, float]
    clock: Clock
    several_loads: bool = False

    def for_load(self, load_N: float) -> Position:
        """Position under another load, with the meshes for that load.

        Parameters
        ----------
        load_N
            Load in N.

        Returns
        -------
        Position
            This position if the load is equal.
        """
        if load_N == self.case.load_N:
            return self
        return _expect_position(replace(self.case, load_N=load_N), self.placement, self.clock)

    def widest_element_mm(self, low_mm: float, high_mm: float) -> float:
        """Largest width of the elements below a lateral range of the surface in mm.

        `low_mm` and `high_mm` are positions in mm from the first contact point; inf without elements.

        Parameters
        ----------
        low_mm, high_mm
            Ends of the range in mm from the first contact point.

        Returns
        -------
        float
            Width in mm.
        """
        patches = [patch for patch in self.expected.parts if patch.s_low_mm <= high_mm and patch.s_high_mm >= low_mm]
        return max((choose_element_width_mm(self.element_size_mm, patch) for patch in patches), default=math.inf)

    @property
    def placement(self) -> Placement:
        """Wheel on rail."""
        return self.true_gap.placement

    @cached_property
    def more_nodes(self) -> dict[str, float]:
        """Relative change of the half-space on more nodes (-).

        It is empty without a junction below the patch and without a valley. If more nodes would be too many, or if the
        contact is not found on them, the change is taken from fewer nodes to these nodes. A lobe without all of its
        nodes may be read less accurately in all measures.
        """
        expected, clock = self.expected, self.clock
        rung = expected.half_space
        has_junction = any(
            expected.s_low_mm < junction.s_mm < expected.s_high_mm for junction in self.placement.junctions
        )
        if not has_junction and read_patch(rung).valley == 0.0:
            return {}
        nodes = round(_NODE_FACTOR * self.case.nodes_per_semi_axis)
        with clock.step("resolve"), suppress(ConvergenceError):
            return compare_with_more_nodes(rung, solve_on_more_nodes(expected, self.case.load_N, nodes=nodes))
        with clock.step("resolve"), suppress(ConvergenceError):
            coarser_rung = solve_on_fewer_nodes(expected, self.case.load_N, fewer=_COARSER_SPACING_FACTOR)
            return compare_with_more_nodes(coarser_rung, rung, MEASURES)
        return {}

    @cached_property
    def turned_force(self) -> float:
        """Relative difference of the force along another normal (`plane_angles.compute_turned_force`)."""
        return compute_turned_force(self.expected.true_gap, self.expected.half_space)


def expect_position(case: Case, *, progress: Progress | None = None) -> Position:
    """Place a case and estimate its patch.

    Parameters
    ----------
    case
        Case with profiles, position and load.
    progress
        Called with the name of each step as it begins.

    Returns
    -------
    Position
        Position with its expected patch.

    Raises
    ------
    InputError
        As in `solve`.
    """
    clock = Clock(progress)
    # Missing packages are reported before any work.
    require_finite_elements()
    choose_solver(case.solver)
    with clock.step("place"):
        placement = place_case(case)
    return _expect_position(case, placement, clock)


# A patch with this number of nodes on its narrowest semi-axis is within 5 % of a patch with 32 nodes (five loads of 10
# to 100 MN on 60E1) and takes a tenth of the time. Hertz's ellipse is at least half as long as the patch.
ROUGH_NODES, _ROUGH_LENGTH_RATIO, _ELLIPSE_LENGTH_RATIO = 8, 1.1, 0.5


def refuse_too_long(case: Case, placement: Placement) -> None:
    """Refuse a patch that is much longer than the bodies.

    The check comes before the patch is solved accurately, which takes seconds.

    Parameters
    ----------
    case
        Case with profiles, position and load.
    placement
        Wheel on rail.

    Raises
    ------
    InputError
        As for meshes of the bodies, if the patch is a tenth longer than the bodies.
    """
    half_length_mm = case.size.at_radius(placement.wheel.rolling_radius_mm).half_length_mm
    hertz = compute_hertz(case, placement)
    if hertz.extent_x_mm / 2.0 < _ELLIPSE_LENGTH_RATIO * half_length_mm:
        return
    true_gap, guess_mm = make_true_gap(case, placement), 1.1 * hertz.approach_mm
    rough_patch = find_expected_patch(true_gap, case.load_N, half=case.half, nodes=ROUGH_NODES, guess_mm=guess_mm)
    if (reach_mm := max(rough_patch.x_high_mm, -rough_patch.x_low_mm)) > _ROUGH_LENGTH_RATIO * half_length_mm:
        raise make_too_short_error("the rail's half length", half_length_mm, f"about {reach_mm:.0f}")


def _expect_position(case: Case, placement: Placement, clock: Clock) -> Position:
    """Position of a placed case, with its expected patch and element size."""
    with clock.step("expect the patch"):
        refuse_too_long(case, placement)
        _, expected = expect_on_half_space(case, placement)
    return Position(
        case=case,
        true_gap=expected.true_gap,
        expected=expected,
        element_size_mm=choose_element_size_mm(case, expected),
        clock=clock,
    )


def expect_on_half_space(
    case: Case,
    placement: Placement | None = None,
    *,
    nodes: int | None = None,
    most: int | None = None,
    tolerance: float = TOLERANCE,
) -> tuple[HertzContact, ExpectedPatch]:
    """Hertz's ellipse of a case, and the half-space contact of its true gap.

    These are all results without finite elements.

    Parameters
    ----------
    case
        Case with profiles, position and load.
    placement
        Wheel on rail; placed here if None.
    nodes
        Number of nodes on the narrowest semi-axis; None for the number of the case.
    most, tolerance
        As in `expected_patch`.

    Returns
    -------
    hertz : HertzContact
        Ellipse at the first contact point.
    expected : ExpectedPatch
        Expected patch with its half-space contact.

    Raises
    ------
    InputError
        As in `place_case` and `compute_hertz`, and if the patch reaches the end of the running surface.
    ConvergenceError
        If the patch grows without bound.
    """
    placement = placement or place_case(case)
    hertz = compute_hertz(case, placement)
    true_gap = make_true_gap(case, placement)
    expected = find_expected_patch(
        *(true_gap, case.load_N),
        half=case.half,
        nodes=nodes or case.nodes_per_semi_axis,
        most=most,
        guess_mm=1.1 * hertz.approach_mm,
        tolerance=tolerance,
    )
    refuse_fully_plastic(case, float(expected.half_space.pressure_MPa.max()))
    # Elements of a given size have this size everywhere.
    return hertz, expected if isinstance(case.resolution, str) else expected.joined()


def refuse_fully_plastic(case: Case, p_max_MPa: float) -> None:
    """Refuse low yield stresses that would cause large strains and rotations.

    Parameters
    ----------
    case
        Case with the yield stresses.
    p_max_MPa
        Elastic peak pressure in MPa.

    Raises
    ------
    InputError
        If the elastic peak pressure is more than `LARGEST_PEAK_OVER_YIELD_STRESS` times a yield stress.
    """
    for name, material in (("rail", case.rail_material), ("wheel", case.wheel_material)):
        if material.yield_MPa is not None and p_max_MPa > LARGEST_PEAK_OVER_YIELD_STRESS * material.yield_MPa:
            raise InputError(
                f"{name}: yield stress is {material.yield_MPa:g} MPa, and the elastic peak pressure of"
                f" {p_max_MPa:.0f} MPa is {p_max_MPa / material.yield_MPa:.1f} times the yield stress; allowed: at most"
                f" {LARGEST_PEAK_OVER_YIELD_STRESS:g} times, because a body that flows freely has large strains; reduce"
                " the load, or leave the yield stress out"
            )


def make_true_gap(case: Case, placement: Placement) -> TrueGap:
    """True gap of a case, with the half-space and the direction of the load.

    Parameters
    ----------
    case
        Case with its materials and its kind of load.
    placement
        The wheel on the rail.

    Returns
    -------
    TrueGap
        The gap before any approach.
    """
    return TrueGap(
        placement=placement,
        contact_modulus_MPa=case.contact_modulus_MPa,
        direction=compute_load_direction(case, placement),
    )
