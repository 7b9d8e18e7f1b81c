"""A wheel on a rail before any finite element: placement, Hertz, and what the half-space expects of the patch."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
import psutil
from numpy.typing import NDArray

from fecontact.case import RESOLUTIONS, Case
from fecontact.errors import InputError
from fecontact.fe.linear_solver import choose_solver
from fecontact.geometry.placement import Placement
from fecontact.solving.expected_patch import ExpectedPart, ExpectedPatch, expected_patch
from fecontact.solving.placing import place_case
from fecontact.solving.true_gap import TrueGap
from fecontact.theory.hertz import HertzContact, hertz_from_hessian
from fecontact.theory.touch_hertz import HertzPoints, hertz_points

Floats = NDArray[np.float64]
Progress = Callable[[str], None]
# More than the resolution says, so that its meshes have as many where the patch is a little smaller than expected.
_ROOM = 0.25
_ELEMENTS_A_WAVE = 8.0
MOST_YIELD = 5.0
"""Elastic peak pressure over the yield stress up to which a first loading is solved."""
MARGIN_ELEMENTS = 4
"""Elements of free room around the expected patch."""
# Longest element over its width.
_MOST_SLENDER = 2.0
# A patch that would have more rows than this on its half length gets longer elements, up to so many times their width:
# on the flange root they would be 73.
_MOST_ROWS = 36
_MOST_SLENDER_IN_ROWS = 4.0
# Patches far apart have equally long elements. They may be longer than that for the widths of the narrowest, up to so
# many times those that each patch would have by itself, as long as each has its number of them along x too. Measured on
# S1002 and UIC60 at 5 mm, 50 kN, for six tenths of the time: forces and peaks of both patches are within 0.02 % of
# those with 2 at `quick`, and 0.035 % at `standard`, where both meshes of a case are 0.1 % apart; with 6 they are 0.1 %
# off.
_MOST_SLENDER_APART = 4.0


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


def hertz_of_case(case: Case, placement: Placement) -> HertzContact:
    """Hertz's ellipse at the first touch point under the case's load; at a junction that of its field side.

    Raises
    ------
    InputError
        If the surfaces conform at the touch point, so that there is no ellipse.
    """
    touch = placement.first
    try:
        return hertz_from_hessian(
            touch.curvature.hessian,
            normal_force_N=case.load_N / float(touch.normal @ direction_of_case(case, placement)),
            contact_modulus_MPa=case.contact_modulus_MPa,
        )
    except InputError as error:
        of_points = [p.name for p in (placement.rail.profile, placement.wheel.profile) if p.thinned() is not None]
        if not of_points:
            raise
        raise InputError(
            f"{error}; the line of {' and '.join(of_points)} goes through its points as they are: give"
            " --rail-smoothing-mm or --wheel-smoothing-mm a width, or look for a wrong point with `fecontact profiles`"
        ) from None


def hertz_points_of_case(case: Case, placement: Placement) -> HertzPoints:
    """Hertz at all touch points of a case, each with the whole load and all sharing it."""
    return hertz_points(
        placement,
        case.load_N,
        direction=direction_of_case(case, placement),
        contact_modulus_MPa=case.contact_modulus_MPa,
    )


def element_size_mm(case: Case, expected: ExpectedPatch) -> tuple[float, float]:
    """Element sizes along x and across: the resolution's elements on the narrowest semi-axis of the expected patch.

    A slender patch gets more of them along its length: long elements answer a pressure less like a half-space.
    """
    if not isinstance(case.resolution, str):
        return case.resolution
    count = RESOLUTIONS[case.resolution] + _ROOM
    along_x, across = expected.semi_axis_x_mm / count, expected.semi_axis_s_mm / count
    longest = min(max(_MOST_SLENDER * across, expected.semi_axis_x_mm / _MOST_ROWS), _MOST_SLENDER_IN_ROWS * across)
    if len(expected.parts) > 1:
        own = (min(x, _MOST_SLENDER_APART * s) for x, s in (part.semi_axes_mm for part in expected.parts))
        longest = max(longest, min(own) / count)
    along = expected.true_gap.placement.along
    wave = math.inf if along is None else along.finest_mm / _ELEMENTS_A_WAVE
    return min(along_x, longest, wave), min(across, _MOST_SLENDER * along_x)


def element_width_mm(element_size_mm: tuple[float, float], part: ExpectedPart) -> float:
    """Width across of the elements below one of several patches far apart, where those of the narrowest are given."""
    along_x, across = element_size_mm
    return max(across, min(part.larger * across, _MOST_SLENDER * along_x))


@dataclass(frozen=True, kw_only=True, eq=False)
class Position:
    """What all meshes and loads of a position share; case and expected patch are those that the meshes are made for.

    Attributes
    ----------
    element_size_mm
        Along x and across, of the finest meshes that are made at first.
    several_loads
        Whether the meshes serve more loads than that of the case.
    """

    case: Case
    true_gap: TrueGap
    expected: ExpectedPatch
    element_size_mm: tuple[float, float]
    clock: Clock
    several_loads: bool = False

    def for_load(self, load_N: float) -> Position:
        """The position under another load, with the meshes that it asks for."""
        case = replace(self.case, load_N=load_N)
        with self.clock.step("expect the patch"):
            _, expected = expect_on_half_space(case, self.placement)
        return replace(
            self,
            case=case,
            true_gap=expected.true_gap,
            expected=expected,
            element_size_mm=element_size_mm(case, expected),
        )

    def widest_element_mm(self, low_mm: float, high_mm: float) -> float:
        """Largest width across of the elements below what lies between two places of the surface."""
        below = [part for part in self.expected.parts if part.s_low_mm <= high_mm and part.s_high_mm >= low_mm]
        return max((element_width_mm(self.element_size_mm, part) for part in below), default=math.inf)

    @property
    def placement(self) -> Placement:
        """Where both bodies stand."""
        return self.true_gap.placement


def position_of(case: Case, *, progress: Progress | None = None) -> Position:
    """Place a case and expect its patch.

    Raises
    ------
    InputError
        As `solve` does.
    """
    clock = Clock(progress)
    # a solver that is not there is said before any work
    choose_solver(case.solver)
    with clock.step("place"):
        placement = place_case(case)
    with clock.step("expect the patch"):
        _, expected = expect_on_half_space(case, placement)
    return Position(
        case=case,
        true_gap=expected.true_gap,
        expected=expected,
        element_size_mm=element_size_mm(case, expected),
        clock=clock,
    )


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
    true_gap = true_gap_of_case(case, placement)
    expected = expected_patch(
        true_gap, case.load_N, half=case.half, nodes=case.nodes_a_semi_axis, guess_mm=1.1 * hertz.approach_mm
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


def direction_of_case(case: Case, placement: Placement) -> Floats:
    """Unit vector (3,) along which the load of a case acts."""
    return placement.load_direction(normal=case.load_kind == "normal")
