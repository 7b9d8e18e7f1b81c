"""A wheel on a rail before it is solved: placement, Hertz, the expected patch, where its meshes are fine, its cost."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from itertools import pairwise
from typing import Literal, TypeVar

import numpy as np
import psutil
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.case import RESOLUTIONS, Case
from fecontact.comparison.judging import judge_line
from fecontact.comparison.lines import FILTER, NOISE, Lines, OnLine, is_drawn
from fecontact.comparison.measures import MEASURES, patch_of
from fecontact.comparison.solved_load import changes_on_more_nodes
from fecontact.contact.grid import Rung
from fecontact.errors import ConvergenceError, InputError
from fecontact.fe.body import BodyMesh, check_memory, choose_solver
from fecontact.fe.meshing import FineZone, least_memory_bytes, rail_mesh, too_short, wheel_mesh
from fecontact.fe.section import Stretch
from fecontact.normal.hertz import HertzContact, hertz_from_hessian
from fecontact.normal.touch_hertz import HertzPoints, hertz_points
from fecontact.packages import require_finite_elements
from fecontact.profiles.curve import Profile
from fecontact.profiles.smoothing import other_lines
from fecontact.solving.expected_patch import (
    TOLERANCE,
    ExpectedPart,
    ExpectedPatch,
    TrueGap,
    expected_patch,
    on_fewer_nodes,
    on_more_nodes,
)
from fecontact.solving.placing import place_case
from fecontact.wheel_rail.placement import Placement

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
# Nodes on which peak and valley are read once more, over those of the case: 48 in place of 32.
_MORE_NODES = 1.5


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


def hertz_of_case(case: Case, placement: Placement) -> HertzContact:
    """Hertz's ellipse at the first touch point under the case's load; at a junction the ellipse of its field side.

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
            " --rail-filter-mm or --wheel-filter-mm a width, or look for a wrong point with `fecontact profiles`"
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
    """Width across of the elements below one of several patches far apart, from the sizes below the narrowest."""
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
            fewer = on_fewer_nodes(expected, self.case.load_N, fewer=_MORE_NODES)
            return changes_on_more_nodes(fewer, rung, MEASURES)
        return {}


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
_ROUGH_NODES, _ROUGH, _LONG = 8, 1.1, 0.5


def _refuse_too_long(case: Case, placement: Placement) -> None:
    """Refuse a patch that is far longer than the bodies before it is known well, which takes seconds.

    Raises
    ------
    InputError
        As meshes of the bodies would, if the patch is a tenth longer than they are.
    """
    half_length, hertz = case.size.half_length_mm, hertz_of_case(case, placement)
    if hertz.extent_x_mm / 2.0 < _LONG * half_length:
        return
    true_gap, guess = true_gap_of_case(case, placement), 1.1 * hertz.approach_mm
    rough = expected_patch(true_gap, case.load_N, half=case.half, nodes=_ROUGH_NODES, guess_mm=guess)
    if (reach := max(rough.x_high_mm, -rough.x_low_mm)) > _ROUGH * half_length:
        raise too_short("the rail's half length", half_length, f"about {reach:.0f}")


def _expecting(case: Case, placement: Placement, clock: Clock) -> Position:
    with clock.step("expect the patch"):
        _refuse_too_long(case, placement)
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


def direction_of_case(case: Case, placement: Placement) -> Floats:
    """Unit vector (3,) along which the load of a case acts."""
    return placement.load_direction(normal=case.load_kind == "normal")


# --- A case on the other lines that its measured points allow: what they leave open of Hertz and of the half-space.

# Deviations move from line to line by what lines are, and 16 nodes per semi-axis read that as well as 32. Where a
# narrow lobe would ask for more nodes than these in all it has fewer. The tolerance leaves 1e-4 of the pressure.
_NODES_A_LINE, _MOST_A_LINE, _TOLERANCE_OF_A_LINE = 16, 40_000, 1e-5
OWN_LINE = "own line"
# Of the scatter of four draws about the own line, for 95 %.
_STUDENT = 2.78
Value = TypeVar("Value")


def lines_of_case(case: Case, placement: Placement) -> Lines | None:
    """Every theory against the half-space, on the own line and on all others that points allow; None of exact lines."""

    def on_line(label: str, placed: Placement) -> OnLine:
        _, expected = expect_on_half_space(
            case, placed, nodes=_NODES_A_LINE, most=_MOST_A_LINE, tolerance=_TOLERANCE_OF_A_LINE
        )
        return judge_line(label, case, placed, expected.half_space)

    found = _on_lines(case, placement, on_line)
    if not found:
        return None
    own, *others = (OnLine(label=label) if one is None else one for label, one in found.items())
    return Lines(own=own, others=tuple(others))


def hertz_uncertainty(case: Case, placement: Placement) -> dict[str, float] | None:
    """What profiles given by points leave open of Hertz's peak pressure and semi-axes, relative, by closed forms alone.

    The largest change by another filter or nominal, and the scatter by other noise for 95 %, as independent errors.
    None where both are exact lines; NaN where another line does not come into contact.
    """

    def read(_: str, placed: Placement) -> dict[str, float]:
        hertz = hertz_of_case(case, placed)
        return {"p_max_MPa": hertz.p0_MPa, "a_mm": hertz.extent_x_mm / 2.0, "b_mm": hertz.extent_y_mm / 2.0}

    found = _on_lines(case, placement, read)
    if not found:
        return None
    own = read(OWN_LINE, placement)

    def left_open(name: str, value: float) -> float:
        by = {label: math.nan if one is None else one[name] / value - 1.0 for label, one in found.items()}
        drawn = np.array([change for label, change in by.items() if is_drawn(label)])
        smoothed = np.abs([change for label, change in by.items() if not is_drawn(label)]).max()
        scatter = math.sqrt(float(np.mean(drawn**2))) if drawn.size else 0.0
        return math.hypot(float(smoothed), _STUDENT * scatter)

    return {name: left_open(name, value) for name, value in own.items()}


def _on_lines(case: Case, placement: Placement, evaluate: Callable[[str, Placement], Value]) -> dict[str, Value | None]:
    """Something of the case on its own line and on every other one by its label; empty of exact lines.

    The same filter is taken for rail and wheel, and None stands for lines that do not come into contact.
    """
    rail, wheel = placement.rail.profile, placement.wheel.profile
    rails, wheels = _labelled(rail), _labelled(wheel)
    labels = dict.fromkeys([*rails, *wheels])
    own = _own_label(rail, wheel)

    def with_lines(label: str) -> Value | None:
        try:
            return evaluate(label, place_case(case, rail=rails.get(label, rail), wheel=wheels.get(label, wheel)))
        except (InputError, ConvergenceError):
            return None

    return {own: evaluate(own, placement), **{label: with_lines(label) for label in labels}} if labels else {}


def _own_label(rail: Profile, wheel: Profile) -> str:
    """What the own line is, where rail and wheel were smoothed alike."""
    made = {_filter(p.measured.filter_mm, p.measured.nominal) for p in (rail, wheel) if p.measured is not None}
    return made.pop() if len(made) == 1 else OWN_LINE


def _filter(filter_mm: float, nominal: str) -> str:
    return f"{FILTER} {filter_mm:.3g} mm" + (f" from {nominal}" if nominal else "")


def _labelled(profile: Profile) -> dict[str, Profile]:
    """Lines that the points of a profile allow beside its own by their labels, as they are through either half."""
    if profile.measured is None:
        halves = {f"half {k + 1} of the points": profile.thinned(k) for k in (0, 1)}
        return {label: line for label, line in halves.items() if line is not None}
    return {
        f"{NOISE} {one.draw + 1}" if one.draw >= 0 else _filter(one.filter_mm, one.nominal): one.profile
        for one in other_lines(profile)
    }


# --- Hertz's theory alone at a case's position: what a solution is compared with, in milliseconds.


@dataclass(frozen=True, kw_only=True, eq=False)
class HertzAlone:
    """Hertz at a case's position.

    Attributes
    ----------
    hertz
        At the first touch point under the case's load, at a junction with the curvature of its field side.
    points
        At every touch point, with the whole load and all sharing it.
    uncertainty_of_profile
        What profiles given by points leave open of its peak pressure and semi-axes (relative); None for exact lines.
    """

    case: Case
    placement: Placement
    hertz: HertzContact
    points: HertzPoints
    uncertainty_of_profile: Mapping[str, float] | None


def hertz_alone(case: Case) -> HertzAlone:
    """Place a case and evaluate Hertz.

    Raises
    ------
    InputError
        As `place_case` and `hertz_of_case` do.
    """
    placement = place_case(case)
    return HertzAlone(
        case=case,
        placement=placement,
        hertz=hertz_of_case(case, placement),
        points=hertz_points_of_case(case, placement),
        uncertainty_of_profile=hertz_uncertainty(case, placement),
    )


# --- Where a position's meshes are fine: around the expected patch, and where the contact turns out to reach further.

# A patch within so many elements of the edge enlarges the zone.
EDGE_ELEMENTS = 2
# A patch that is a whole number of elements long but for rounding gets no element more.
_ROUNDING = 1e-6


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
        half_length_mm=step_x * math.ceil(length / step_x - _ROUNDING),
        s_low_mm=bands[0].low_mm if bands else whole.low_mm,
        s_high_mm=bands[-1].high_mm if bands else whole.high_mm,
        step_x_mm=step_x,
        step_s_mm=step_s,
        semi_axis_mm=expected.semi_axis_s_mm,
        bands=bands,
    )


def _even_stretch(low: float, high: float, step: float) -> Stretch:
    steps = 2 * math.ceil(0.5 * (high - low) / step - _ROUNDING)
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


def more_room(room: Room, nodal: Rung, expected: ExpectedPatch, bands: Sequence[slice]) -> Room:
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


# --- Meshes of a case that is not solved here: one body, or both with all that another program needs to press them.


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshedPair:
    """Both bodies of a case on the first meshes that `solve` makes.

    Attributes
    ----------
    direction (3,)
        Unit vector against which the wheel is pushed: upwards, or the contact normal at first touch.
    approach_mm
        What the wheel moves along it under the case's load if both bodies were half-spaces.
    """

    case: Case
    rail: BodyMesh
    wheel: BodyMesh
    direction: NDArray[np.float64]
    approach_mm: float


def mesh_case(case: Case, body: Literal["rail", "wheel"]) -> BodyMesh:
    """Mesh one body of a case, without solving it.

    Raises
    ------
    InputError
        As `solve` does.
    """
    placement = place_case(case)
    zone, _ = _expected(case, placement)
    make = rail_mesh if body == "rail" else wheel_mesh
    return make(placement, zone, half=case.half, size=case.size)


def mesh_pair(case: Case) -> MeshedPair:
    """Mesh both bodies of a case, without solving it.

    Raises
    ------
    InputError
        As `solve` does.
    """
    placement = place_case(case)
    zone, approach = _expected(case, placement)
    direction = placement.load_direction(normal=case.load_kind == "normal")
    return MeshedPair(
        case=case,
        rail=rail_mesh(placement, zone, half=case.half, size=case.size),
        wheel=wheel_mesh(placement, zone, half=case.half, size=case.size),
        direction=direction,
        # the half-space's approach is the part along the normal
        approach_mm=approach / float(direction @ placement.first.normal),
    )


def _expected(case: Case, placement: Placement) -> tuple[FineZone, float]:
    """The fine zone of a case's first meshes, and the half-space's approach (mm) along the normal."""
    require_finite_elements()
    _, expected = expect_on_half_space(case, placement)
    zone = fine_zone(expected, element_size_mm(case, expected))
    check_memory(least_memory_bytes(zone), f"a contact zone of {zone.intervals_x} by {zone.intervals_s} elements")
    return zone, expected.half_space.approach_mm


# --- About what the solution of a case takes: unknowns of its first meshes, CPU time and memory.

START_SECONDS = 1.0
"""CPU seconds of the start of the program and the position."""
# Unknowns of both bodies for n_x by n_s elements in the zone of a half model: nineteen meshes of 8 by 17 to 40 by 109
# elements have 0.93 to 1.11 of it (60E1 and a cylinder; quick, standard and fine).
_UNKNOWNS, _POWER_X, _MORE_S = 286.0, 0.66, 7.6
# Unknowns of a whole model over the unknowns of half of it.
_WHOLE = 2.0
_ONE_PATCH, _SECONDS, _SECONDS_POWER = 28_250.0, 1.5, 1.16
# A load at which bodies yield takes so many times as long: 3.5 at -4 mm, 4.4 at 3 mm, 4.0 at 0 mm and 3.7 with a yaw
# (`quick`), 6.2 at 3 mm (`standard`), S1002 on 60E1, 100 kN, 450 MPa. First yield is at a peak of 1.6 yield stresses
# (Hertz), of which stresses 15 % lower, which are solved too, make 1.4; at 1.3 it takes no time.
_YIELDING, _PEAK_OF_YIELD = 4.0, 1.4
# Of each line that points allow, under each load: 0.23, 0.24, 0.30, 0.69 and 2.1 s at five positions of the worn pair
# of `fecontact profiles --examples`; the most where patches lie far apart.
_LINE_SECONDS = 0.5
# Factors fill in by more than in proportion.
_BASE_GB, _GB, _GB_POWER = 0.15, 0.115, 1.16


def unknowns_of(elements_x: int, elements_s: int, *, half: bool) -> float:
    """Degrees of freedom of meshes with so many elements along x and across in their fine zone."""
    return float(round(_UNKNOWNS * elements_x**_POWER_X * (elements_s + _MORE_S) * (1.0 if half else _WHOLE)))


def cpu_seconds(unknowns: float) -> float:
    """CPU seconds of a solution on one thread, with the coarser meshes and the half-spaces, but for `START_SECONDS`.

    Measured by `fecontact solve --refine never` of S1002 on 60E1 under 100 kN, by PARDISO on one core
    (AMD EPYC, virtual, 2026): -2, 1, 3, 5, 5.5 and 6 mm at `quick`, 1, 3 and 6 mm at `standard` and `fine`, and 3 mm
    with a yaw; 28 to 256 thousand unknowns. Users' and system's seconds are met to 22 %, and are
    up to 45 % more at 6 mm on the finer meshes.
    In the flange root the first mesh may have to grow and is made twice: at 6.3 mm, 100 kN 23 s, where 9 s are told.
    """
    return float(_SECONDS * (unknowns / _ONE_PATCH) ** _SECONDS_POWER)


def times_by_yielding(case: Case, p_max_MPa: float) -> float:
    """How many times as long a load takes because bodies yield under its peak pressure."""
    stresses = [one.yield_MPa for one in (case.rail_material, case.wheel_material) if one.yield_MPa is not None]
    return _YIELDING if stresses and p_max_MPa > _PEAK_OF_YIELD * min(stresses) else 1.0


def memory_GB(unknowns: float) -> float:
    """Largest memory of the process that solves, with so many unknowns in its finest meshes.

    Met to 10 % by one process each: 57 to 433 thousand unknowns at 6, 5.5, 3 and 1 mm. A whole model takes a fifth
    less, since its halves have a factor each.
    """
    return float(_BASE_GB + _GB * (unknowns / _ONE_PATCH) ** _GB_POWER)


# --- A case before it is solved: position, expected patch and mesh, and about what the solution will cost.


@dataclass(frozen=True, kw_only=True, eq=False)
class Preview:
    """What is known of a case without finite elements.

    Attributes
    ----------
    hertz
        At the first touch point under the case's load.
    expected
        The patch under the true gap on a half-space.
    element_size_mm, elements
        Along x and across: sizes, and how many there are in the fine zone.
    degrees_of_freedom, cpu_seconds, memory_GB
        Of `fecontact solve` on its first meshes, to 10 % and to a factor of two (at 5.5 mm on 60E1, where two patches
        are far apart, 1.6 times as many unknowns as there are); a refinement takes up to `Case.most_unknowns`.
    lines_seconds
        The part of `cpu_seconds` for the lines that points allow, which each load takes; 0 for exact lines.
    """

    case: Case
    placement: Placement
    hertz: HertzContact
    expected: ExpectedPatch
    element_size_mm: tuple[float, float]
    elements: tuple[int, int]
    degrees_of_freedom: int
    cpu_seconds: float
    lines_seconds: float
    memory_GB: float

    @cached_property
    def hertz_uncertainty(self) -> dict[str, float] | None:
        """What measured profiles leave open of Hertz's peak pressure and semi-axes (relative); None for exact lines."""
        return hertz_uncertainty(self.case, self.placement)

    def __repr__(self) -> str:
        case, points = self.case, len(self.placement.touch_points)
        return (
            f"<Preview {case.rail} and {case.wheel}, {case.lateral_shift_mm:+z.2f} mm, {case.load_N / 1e3:g} kN:"
            f" {points} touch points, Hertz {self.hertz.p0_MPa:.0f} MPa, about {self.cpu_seconds:.0f} s to solve>"
        )

    def _repr_html_(self) -> str:
        points = {
            f"touch point {number}": {
                "rail y in mm": f"{one.rail_y_mm:.2f}",
                "wheel y in mm": f"{one.wheel_y_mm:.2f}",
                "contact angle in mrad": f"{1e3 * one.contact_angle_rad:.1f}",
            }
            for number, one in enumerate(self.placement.touch_points, start=1)
        }
        import pandas

        return f"<p>{escape(repr(self))}</p>{pandas.DataFrame.from_dict(points, orient='index').to_html()}"


def preview(case: Case) -> Preview:
    """Place a case and expect its patch and the cost of its solution.

    >>> import fecontact
    >>> seen = fecontact.place(fecontact.Case(lateral_shift_mm=4.0))
    >>> round(seen.placement.first.rail_y_mm, 1), seen.elements[1] > seen.elements[0]
    (-13.8, True)

    Raises
    ------
    InputError, ConvergenceError
        As `expect_on_half_space` does.
    """
    return _preview(case, place_case(case))


def preview_to_solve(case: Case) -> Preview:
    """As `preview`, of a case that is to be solved: a patch that is far longer than the bodies is refused first.

    The patch is that of few nodes, as the cost is told to a factor of two.
    """
    placement = place_case(case)
    _refuse_too_long(case, placement)
    return _preview(case, placement, nodes=_ROUGH_NODES)


def _preview(case: Case, placement: Placement, *, nodes: int | None = None) -> Preview:
    hertz, expected = expect_on_half_space(case, placement, nodes=nodes)
    sizes = element_size_mm(case, expected)
    lengths = (max(expected.x_high_mm, -expected.x_low_mm), expected.s_high_mm - expected.s_low_mm)
    along_x = round(lengths[0] / sizes[0]) + MARGIN_ELEMENTS
    across = round(lengths[1] / sizes[1]) + 2 * MARGIN_ELEMENTS
    # patches far apart have fewer between them
    if (zone := fine_zone(expected, sizes)).bands:
        across = zone.intervals_s
    unknowns = unknowns_of(along_x, across, half=case.half)
    others = {*_labelled(placement.rail.profile), *_labelled(placement.wheel.profile)}
    lines_seconds = _LINE_SECONDS * (1 + len(others)) if others else 0.0
    return Preview(
        case=case,
        placement=placement,
        hertz=hertz,
        expected=expected,
        element_size_mm=sizes,
        elements=(along_x, across),
        degrees_of_freedom=int(unknowns),
        cpu_seconds=START_SECONDS + times_by_yielding(case, hertz.p0_MPa) * cpu_seconds(unknowns) + lines_seconds,
        lines_seconds=lines_seconds,
        memory_GB=memory_GB(unknowns),
    )
