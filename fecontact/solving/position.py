"""A case at its position before it is solved: the wheel on the rail, and the patch that is expected."""

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
from fecontact.fe.meshing import too_short
from fecontact.judging.measures import MEASURES, patch_of
from fecontact.judging.solved_load import changes_on_more_nodes
from fecontact.packages import require_finite_elements
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.element_sizes import element_size_mm, element_width_mm
from fecontact.solving.expected_patch import ExpectedPatch, expected_patch, on_fewer_nodes, on_more_nodes
from fecontact.solving.hertz import direction_of_case, hertz_of_case
from fecontact.solving.placing import place_case
from fecontact.solving.plane_angles import turned_force
from fecontact.solving.true_gap import TOLERANCE, TrueGap

Progress = Callable[[str], None]
MOST_YIELD = 5.0
"""Elastic peak pressure over the yield stress up to which a first loading is solved."""
# Nodes on which peak, area and valley are read once more, over those of the case: 96 in place of 32, for 0.1 to 2 s. A
# strip of the patch beyond a junction that is narrower than the steps is not there on 48 either (60E1 upright with
# EN15302_H, -0.31 mm, 158.5 kN: 0.69 % of the area, of which 48 show 0.14 and 96 show 0.66 %).
_MORE_NODES = 3.0
# What is looked at on fewer nodes, where more would be too many.
_FEWER_NODES = 1.5


class Clock:
    """Wall seconds and memory by step."""

    def __init__(self, progress: Progress | None) -> None:
        """`progress` hears the name of each step as it begins, after the `stage` and a colon if there is one."""
        self.stage = ""
        self.seconds: dict[str, float] = {}
        self.memory_MB: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Time what is done inside under a name."""
        if self._progress is not None:
            self._progress(f"{self.stage}: {name}" if self.stage else name)
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
            self.memory_MB[name] = psutil.Process().memory_info().rss / 1e6

    def taken(self) -> dict[str, float]:
        """Seconds by step since they were taken the last time."""
        seconds, self.seconds = self.seconds, {}
        return seconds


@dataclass(frozen=True, kw_only=True, eq=False)
class Position:
    """What all meshes and loads of a position share; case and expected patch are those that the meshes are made for.

    Attributes
    ----------
    element_size_mm
        Along x and across, of the finest meshes that are made at first.
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
        """The position under a load, with the meshes that it asks for."""
        if load_N == self.case.load_N:
            return self
        return _expecting(replace(self.case, load_N=load_N), self.placement, self.clock)

    def widest_element_mm(self, low_mm: float, high_mm: float) -> float:
        """Largest width across of the elements below what lies between two places of the surface."""
        below = [part for part in self.expected.parts if part.s_low_mm <= high_mm and part.s_high_mm >= low_mm]
        return max((element_width_mm(self.element_size_mm, part) for part in below), default=math.inf)

    @property
    def placement(self) -> Placement:
        """Where both bodies stand."""
        return self.true_gap.placement

    @cached_property
    def more_nodes(self) -> dict[str, float]:
        """What more nodes change of the half-space; nothing where no junction lies below and there is no valley.

        Where more nodes would be too many, or find no contact, it is what these change of fewer ones. A lobe that does
        not get all of its nodes may be read less well in all measures.
        """
        expected, clock = self.expected, self.clock
        rung = expected.half_space
        below = any(expected.s_low_mm < one.s_mm < expected.s_high_mm for one in self.placement.junctions)
        if not below and patch_of(rung).valley == 0.0:
            return {}
        nodes = round(_MORE_NODES * self.case.nodes_a_semi_axis)
        with clock.step("resolve"), suppress(ConvergenceError):
            return changes_on_more_nodes(rung, on_more_nodes(expected, self.case.load_N, nodes=nodes))
        with clock.step("resolve"), suppress(ConvergenceError):
            fewer = on_fewer_nodes(expected, self.case.load_N, fewer=_FEWER_NODES)
            return changes_on_more_nodes(fewer, rung, MEASURES)
        return {}

    @cached_property
    def turned_force(self) -> float:
        """By how much the force differs along another normal, relative (`plane_angles.turned_force`)."""
        return turned_force(self.expected.true_gap, self.expected.half_space)


def position_of(case: Case, *, progress: Progress | None = None) -> Position:
    """Place a case and expect its patch.

    Raises
    ------
    InputError
        As `solve` does.
    """
    clock = Clock(progress)
    # what is not there is said before any work
    require_finite_elements()
    choose_solver(case.solver)
    with clock.step("place"):
        placement = place_case(case)
    return _expecting(case, placement, clock)


# A patch with so few nodes on its narrowest semi-axis is within 5 % of one with 32 nodes (five loads of 10 to 100 MN on
# 60E1) and takes a tenth of the time. Hertz's ellipse is at least half as long as the patch.
ROUGH_NODES, _ROUGH, _LONG = 8, 1.1, 0.5


def refuse_too_long(case: Case, placement: Placement) -> None:
    """Refuse a patch that is far longer than the bodies before it is known well, which takes seconds.

    Raises
    ------
    InputError
        As meshes of the bodies would, if the patch is a tenth longer than they are.
    """
    half_length = case.size.at_radius(placement.wheel.rolling_radius_mm).half_length_mm
    hertz = hertz_of_case(case, placement)
    if hertz.extent_x_mm / 2.0 < _LONG * half_length:
        return
    true_gap, guess = true_gap_of_case(case, placement), 1.1 * hertz.approach_mm
    rough = expected_patch(true_gap, case.load_N, half=case.half, nodes=ROUGH_NODES, guess_mm=guess)
    if (reach := max(rough.x_high_mm, -rough.x_low_mm)) > _ROUGH * half_length:
        raise too_short("the rail's half length", half_length, f"about {reach:.0f}")


def _expecting(case: Case, placement: Placement, clock: Clock) -> Position:
    with clock.step("expect the patch"):
        refuse_too_long(case, placement)
        _, expected = expect_on_half_space(case, placement)
    return Position(
        case=case,
        true_gap=expected.true_gap,
        expected=expected,
        element_size_mm=element_size_mm(case, expected),
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
    """Hertz's ellipse of a case and the half-space under its true gap: all that can be said without finite elements.

    `nodes` on the narrowest semi-axis are the case's if not given, `most` and `tolerance` as in `expected_patch`.

    Raises
    ------
    InputError
        As `place_case` and `hertz_of_case` do, and if the patch reaches the end of the running surface.
    ConvergenceError
        If the patch grows without bound.
    """
    placement = placement or place_case(case)
    hertz = hertz_of_case(case, placement)
    true_gap = true_gap_of_case(case, placement)
    expected = expected_patch(
        *(true_gap, case.load_N),
        half=case.half,
        nodes=nodes or case.nodes_a_semi_axis,
        most=most,
        guess_mm=1.1 * hertz.approach_mm,
        tolerance=tolerance,
    )
    refuse_fully_plastic(case, float(expected.half_space.pressure_MPa.max()))
    # elements whose size is given have it everywhere
    return hertz, expected if isinstance(case.resolution, str) else expected.joined()


def refuse_fully_plastic(case: Case, p_max_MPa: float) -> None:
    """Refuse yield stresses so low that strains and rotations are large.

    Raises
    ------
    InputError
        If the peak of the elastic pressure is beyond `MOST_YIELD` times a yield stress.
    """
    for name, material in (("rail", case.rail_material), ("wheel", case.wheel_material)):
        if material.yield_MPa is not None and p_max_MPa > MOST_YIELD * material.yield_MPa:
            raise InputError(
                f"{name}: yield stress is {material.yield_MPa:g} MPa, and the elastic peak pressure of"
                f" {p_max_MPa:.0f} MPa is {p_max_MPa / material.yield_MPa:.1f} times that; allowed: up to"
                f" {MOST_YIELD:g} times, beyond it flows freely and small strains say nothing; take a smaller load, or"
                " leave the yield stress out"
            )


def true_gap_of_case(case: Case, placement: Placement) -> TrueGap:
    """The gap of a case, the half-space below it and the direction of its load."""
    return TrueGap(
        placement=placement, contact_modulus_MPa=case.contact_modulus_MPa, direction=direction_of_case(case, placement)
    )
