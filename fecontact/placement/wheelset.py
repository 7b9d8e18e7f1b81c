"""A wheelset on its rails: its roll, and its contact functions over the lateral shift.

The roll of a free wheelset is the roll at which both wheels touch. Shift, roll and yaw are given for the left side: a
positive shift is towards the left rail, a positive roll lifts the left wheel. The right wheel on its rail is the left
wheel of the mirror image, for which shift, roll and yaw change their signs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from fecontact.arrays import Floats, Integers
from fecontact.bodies import TrackSide
from fecontact.placement.carrying import is_on_flange_top
from fecontact.placement.conicity import RadiusDifference
from fecontact.placement.poses import sample_profile, select_near_minima_at_shifts
from fecontact.placement.problems import PlacementError, PositionProblem
from fecontact.placement.wheel_on_rail import SIDE_SIGN, TRIAL_SHIFTS_MM, Pair, Placement

TRACK_SIDES: tuple[TrackSide, TrackSide] = ("left", "right")
# Largest difference of both wheels' axle heights. The heights are equally exact: a roll of 1e-12 rad.
_HEIGHT_TOLERANCE_MM = 1e-9
_MAX_ITERATIONS = 60
_CHECK_WHEELSET = "check gauge, back-to-back distance and both profiles"
# Wheelsets that run on their treads or flanges roll by a tenth of this.
_MAX_ROLL_RAD = 0.1
# Grid spacing and end of the search for possible shifts.
_TRIAL_STEP_MM, _MAX_TRIAL_SHIFT_MM = 0.5, 60.0


@dataclass(frozen=True, kw_only=True)
class LoweredWheel:
    """A wheel on its rail, in the frame of the left side.

    Attributes
    ----------
    axle_mm
        Height of the axle's centre.
    lever_mm
        Distance by which the axle falls per radian of roll.
    y_mm
        Lateral position of the contact point from the track's centre.
    wheel_y_mm
        Lateral position of the contact point on the wheel, from its tape circle.
    radius_mm
        Radius of the wheel at the contact point.
    """

    axle_mm: float
    lever_mm: float
    y_mm: float
    wheel_y_mm: float
    radius_mm: float


@dataclass(frozen=True, kw_only=True, eq=False)
class PairSampler:
    """A pair with a fast search of the first touch, for thousands of positions.

    Attributes
    ----------
    pair
        The wheel and its rail.
    """

    pair: Pair

    def standing(self, shift_mm: float, roll_rad: float, yaw_rad: float) -> LoweredWheel | None:
        """The wheel at its first touch; None if it is not over the rail.

        Parameters
        ----------
        shift_mm, roll_rad, yaw_rad
            Shift, roll and yaw of the wheelset on the left side.

        Returns
        -------
        LoweredWheel or None
            The wheel on its rail.
        """
        (wheel,) = self.standings([shift_mm], roll_rad, yaw_rad)
        return wheel

    def standings(self, shifts_mm: Sequence[float], roll_rad: float, yaw_rad: float) -> list[LoweredWheel | None]:
        """The wheel at its first touch at each shift; None where it is not over the rail.

        The smallest gap among samples of 0.02 mm on the exact profiles is refined by the parabola through it and its
        neighbours. The height is exact to 1e-9 mm if the curvatures of both profiles are constant between the samples.

        Parameters
        ----------
        shifts_mm
            Lateral shifts of the wheel in mm.
        roll_rad, yaw_rad
            Roll and yaw of the wheelset on the left side.

        Returns
        -------
        wheels
            The wheel on its rail for each shift.
        """
        pose, rail = self.pair.hung(0.0, roll_rad, yaw_rad), self.pair.rail
        points = sample_profile(self.pair.wheel)[1].select(slice(1, -1))
        places_by_shift = select_near_minima_at_shifts(rail, pose, points, shifts_mm)
        places, sizes = np.concatenate(places_by_shift), [places_at_shift.size for places_at_shift in places_by_shift]
        _, _, y, z = pose.silhouette_of(points.select(places))
        y = y + np.repeat(shifts_mm, sizes)
        _, z_rail, tangent = rail.section(rail.parameter_at_y(y))
        gap = np.nan_to_num(z - z_rail, nan=np.inf)
        # The contact point slides along the common tangent of both profiles.
        slide, wheel_y, radius = z * np.tan(tangent), points.y[places], self.pair.rolling_radius_mm - points.z[places]
        ends = np.cumsum([0, *sizes])
        return [
            _refine_first_touch(
                shift, places[samples], gap[samples], y[samples], slide[samples], wheel_y[samples], radius[samples]
            )
            for shift, samples in zip(shifts_mm, map(slice, ends[:-1], ends[1:]), strict=True)
        ]


def _refine_first_touch(
    shift_mm: float, places: Integers, gap: Floats, y: Floats, slide: Floats, wheel_y: Floats, radius: Floats
) -> LoweredWheel | None:
    """The wheel at the smallest gap over samples (n,) along it; None without a finite gap.

    A parabola through three neighbours refines the position if they are next to each other.

    Parameters
    ----------
    shift_mm
        Lateral shift of the wheel in mm.
    places
        Indices of the samples; gaps in them are samples that were left out.
    gap
        Vertical gap in mm for an axle at height 0.
    y, wheel_y
        Lateral positions in mm in the track frame and on the wheel's profile.
    slide
        Slide of the contact point along the common tangent in mm, which adds to the lever.
    radius
        Rolling radius in mm.
    """
    lowest = int(np.argmin(gap)) if gap.size else 0
    if not gap.size or not np.isfinite(gap[lowest]):
        return None
    min_gap, step = float(gap[lowest]), 0.0
    if 0 < lowest < gap.size - 1 and places[lowest + 1] - places[lowest - 1] == 2:
        before, after = float(gap[lowest - 1]), float(gap[lowest + 1])
        bend = before - 2.0 * min_gap + after
        # infinite next to the end of a profile
        if 0.0 < bend < np.inf:
            step = 0.5 * (before - after) / bend
            min_gap -= 0.125 * (before - after) ** 2 / bend
    touch_index, indices = lowest + step, np.arange(gap.size)
    y_touch = float(np.interp(touch_index, indices, y))
    # The contact point turns about the axle's centre.
    return LoweredWheel(
        axle_mm=-min_gap,
        lever_mm=(y_touch - shift_mm) + float(slide[lowest]),
        y_mm=y_touch,
        wheel_y_mm=float(np.interp(touch_index, indices, wheel_y)),
        radius_mm=float(np.interp(touch_index, indices, radius)),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedWheelset:
    """A wheelset that stands on both rails.

    Attributes
    ----------
    shift_mm
        Lateral shift, positive to the left.
    yaw_rad
        Yaw angle.
    roll_rad
        Roll at which both wheels touch; positive lifts the left wheel.
    axle_height_mm
        Height of the axle's centre over the rails' highest point.
    left, right
        Both wheels on their rails, each in the frame of the left side.
    """

    shift_mm: float
    yaw_rad: float
    roll_rad: float
    axle_height_mm: float
    left: Placement
    right: Placement

    @property
    def climbs(self) -> bool:
        """Whether a flange touches its rail beyond its steepest place."""
        return self.left.climbs or self.right.climbs

    def side(self, side: TrackSide) -> Placement:
        """The wheel of a side on its rail, with the climbing of the other wheel.

        Parameters
        ----------
        side
            `left` or `right`.

        Returns
        -------
        Placement
            In the frame of the left side.
        """
        placement, opposite = (self.left, self.right) if side == "left" else (self.right, self.left)
        return replace(placement, other_climbs=opposite.climbs)


@dataclass(frozen=True, kw_only=True)
class LoweredWheelset:
    """Roll at which both wheels touch, with both wheels at this roll.

    Attributes
    ----------
    roll_rad
        Roll; positive lifts the left wheel.
    left, right
        Both wheels on their rails, each in the frame of the left side.
    """

    roll_rad: float
    left: LoweredWheel
    right: LoweredWheel


@dataclass(frozen=True, kw_only=True, eq=False)
class Wheelset:
    """A rigid wheelset on a track: left and right wheel over their rails.

    Attributes
    ----------
    left, right
        Both pairs of wheel and rail, each in the frame of the left side.
    asked
        Side of the requested wheel; None for both sides. The flange of the wheel on the other side may climb.
    """

    left: PairSampler
    right: PairSampler
    asked: TrackSide | None = None

    @classmethod
    def of(cls, left: Pair, right: Pair) -> Wheelset:
        """A wheelset of two wheels over their rails.

        Parameters
        ----------
        left, right
            Both pairs, each in the frame of the left side. A symmetric wheelset has a single object for both.

        Returns
        -------
        Wheelset
            With both wheels requested.
        """
        left_sampler = PairSampler(pair=left)
        return cls(left=left_sampler, right=left_sampler if right is left else PairSampler(pair=right))

    @property
    def symmetric(self) -> bool:
        """Whether the right side is the mirror image of the left side."""
        return self.left is self.right

    def stand(
        self, shift_mm: float, yaw_rad: float = 0.0, *, guess_rad: float = 0.0
    ) -> LoweredWheelset | PositionProblem:
        """Find the roll at which both wheels touch.

        Newton's method, and bisection if it fails. The height difference is continuous in the roll and falls, but has a
        kink wherever a wheel's contact point jumps.

        Parameters
        ----------
        shift_mm
            Lateral shift in mm, positive to the left.
        yaw_rad
            Yaw angle.
        guess_rad
            First guess of the roll.

        Returns
        -------
        LoweredWheelset or PositionProblem
            Roll and wheels with equal height of the axle, or the reason against them.
        """
        roll, low, high = guess_rad, -_MAX_ROLL_RAD, _MAX_ROLL_RAD
        for _ in range(_MAX_ITERATIONS):
            left = self.left.standing(shift_mm, roll, yaw_rad)
            right = self.right.standing(-shift_mm, -roll, -yaw_rad)
            if left is None or right is None:
                return PositionProblem(
                    f"the {'left' if left is None else 'right'} wheel is not above its rail",
                    "a wheel is not above its rail",
                    remedy=_CHECK_WHEELSET,
                )
            difference = left.axle_mm - right.axle_mm
            if abs(difference) < _HEIGHT_TOLERANCE_MM:
                return LoweredWheelset(roll_rad=roll, left=left, right=right)
            low, high = (roll, high) if difference > 0.0 else (low, roll)
            lever = left.lever_mm + right.lever_mm
            roll += difference / lever if lever > 0.0 else np.inf
            if not low < roll < high:
                roll = 0.5 * (low + high)
        return PositionProblem("no roll was found at which both wheels touch their rails", remedy=_CHECK_WHEELSET)

    def placed(self, side: TrackSide, shift_mm: float, roll_rad: float, yaw_rad: float) -> Placement | PositionProblem:
        """Place a wheel on its rail.

        Parameters
        ----------
        side
            `left` or `right`.
        shift_mm, roll_rad, yaw_rad
            Shift, roll and yaw of the wheelset.

        Returns
        -------
        Placement or PositionProblem
            The wheel on its rail, or the reason against it.
        """
        sign, pair = SIDE_SIGN[side], (self.left if side == "left" else self.right).pair
        if self.asked not in (None, side):
            pair = replace(pair, flange_climb=True)
        placement = pair.placed(sign * shift_mm, sign * roll_rad, sign * yaw_rad)
        return placement.extend(before=f"{side} side: ") if isinstance(placement, PositionProblem) else placement

    def at(self, shift_mm: float, yaw_rad: float = 0.0, *, guess_rad: float = 0.0) -> PlacedWheelset | PositionProblem:
        """Place the wheelset on its rails.

        Parameters
        ----------
        shift_mm
            Lateral shift in mm, positive to the left.
        yaw_rad
            Yaw angle.
        guess_rad
            First guess of the roll.

        Returns
        -------
        PlacedWheelset or PositionProblem
            The wheelset on its rails, or the reason against it.
        """
        lowered = self.stand(shift_mm, yaw_rad, guess_rad=guess_rad)
        if isinstance(lowered, str):
            return lowered
        placements: dict[TrackSide, Placement] = {}
        for side in TRACK_SIDES:
            placement = self.placed(side, shift_mm, lowered.roll_rad, yaw_rad)
            if isinstance(placement, str):
                return placement
            placements[side] = placement
        return PlacedWheelset(
            shift_mm=shift_mm,
            yaw_rad=yaw_rad,
            roll_rad=lowered.roll_rad,
            axle_height_mm=float(placements["left"].wheel.centre_mm[2]),
            **placements,
        )


def place_wheelset(wheelset: Wheelset, lateral_shift_mm: float, yaw_rad: float = 0.0) -> PlacedWheelset:
    """Set a wheelset on its rails.

    Parameters
    ----------
    wheelset
        Both wheels over their rails.
    lateral_shift_mm
        Displacement, positive towards the left rail.
    yaw_rad
        Yaw angle.

    Returns
    -------
    PlacedWheelset
        The wheelset on its rails.

    Raises
    ------
    PlacementError
        If a wheel leaves its rail, or a requested wheel climbs over it. The message gives the possible shifts.

    Examples
    --------
    >>> from fecontact.placement.wheel_on_rail import set_up_pair
    >>> from fecontact.profiles.library import load_library_profile
    >>> pair = set_up_pair(load_library_profile("60E1"), load_library_profile("S1002"), inclination_rad=0.025)
    >>> wheelset = place_wheelset(Wheelset.of(pair, pair), 3.0)
    >>> round(1e3 * wheelset.roll_rad, 3)
    0.18
    """
    placement = wheelset.at(lateral_shift_mm, yaw_rad)
    if isinstance(placement, str):
        shifts = describe_possible_wheelset_shifts(wheelset, yaw_rad)
        raise PlacementError(
            placement.extend(
                before=f"lateral shift {lateral_shift_mm:g} mm of the wheelset: ",
                after=f"; {shifts}; with a given roll (--roll-mrad) the opposite wheel is not placed",
            )
        )
    return placement


def describe_possible_wheelset_shifts(wheelset: Wheelset, yaw_rad: float = 0.0) -> str:
    """Text with the possible shifts of a wheelset.

    The search goes from the middle outwards, up to the first impossible shift.

    Parameters
    ----------
    wheelset
        Both wheels over their rails.
    yaw_rad
        Yaw angle.

    Returns
    -------
    text
        Smallest and largest possible shift, or possible gauges.
    """
    ends = []
    for step in (-_TRIAL_STEP_MM, _TRIAL_STEP_MM):
        shift = 0.0
        while abs(shift) <= _MAX_TRIAL_SHIFT_MM and not isinstance(wheelset.at(shift, yaw_rad), str):
            shift += step
        ends.append(shift - step)
    if ends[0] > ends[1]:
        return f"the wheelset does not fit in the middle of the track: {_describe_possible_gauges(wheelset, yaw_rad)}"
    return f"shifts between {ends[0]:g} and {ends[1]:g} mm (in steps of {_TRIAL_STEP_MM:g} mm) are possible"


def _describe_possible_gauges(wheelset: Wheelset, yaw_rad: float) -> str:
    """Remedy for a wheelset that cannot run in the middle of the track: wider or narrower gauges on which it can.

    Only a symmetric wheelset has no roll there, so that its left wheel is tried alone at lateral shifts, each for twice
    the change of the gauge. The remedy for another wheelset names the inputs to check.

    Parameters
    ----------
    wheelset
        Wheelset over its rails.
    yaw_rad
        Yaw of the wheelset; the opposite yaw is tried too.

    Returns
    -------
    str
        Range of gauges in mm relative to the present gauge, or inputs to check.
    """
    if not wheelset.symmetric:
        return "check gauge, back-to-back distance, and profiles and diameters of both sides"
    # If the gauge is wider by 2 mm, each rail is 1 mm farther from its wheel.
    gauge_changes = [
        -2.0 * shift
        for shift in TRIAL_SHIFTS_MM
        if not any(isinstance(wheelset.left.pair.placed(float(shift), 0.0, yaw), str) for yaw in {yaw_rad, -yaw_rad})
    ]
    if not gauge_changes:
        return "it fits on no gauge up to 80 mm wider or narrower; check the profiles"
    wider = min(gauge_changes) > 0.0
    low, high = sorted(abs(end) for end in (min(gauge_changes), max(gauge_changes)))
    return (
        f"it fits on a gauge {low:g} to {high:g} mm {'wider' if wider else 'narrower'}, or with a back-to-back distance"
        f" {'smaller' if wider else 'larger'} by as much"
    )


# --- Contact functions of a wheelset over its lateral shift: rolling radii, jumps, equivalent conicity.

# Grid spacing of the shifts, between which all functions are linear and jumps are searched for.
_SHIFT_GRID_SPACING_MM = 0.1
# A contact point jumps if it moves by more than this across the rail for any step of the shift. Without a jump it moves
# by at most 20 mm per millimetre of shift.
_MIN_JUMP_MM = 0.5
_JUMP_TOLERANCE_MM = 1e-4
# Largest amplitude of conicities, in whole millimetres, as in the tables of EN 15302, and farthest shift of a motion.
# Wheels of unequal diameters move about a shift outside the middle of the track.
_MAX_AMPLITUDE_MM, _MAX_MOTION_SHIFT_MM = 7.0, 10.0


@dataclass(frozen=True)
class Jump:
    """A jump of a wheel's first contact point across the rail.

    Attributes
    ----------
    side
        Side of the wheel.
    shift_mm
        Lateral shift at the jump.
    from_rail_y_mm, to_rail_y_mm
        Positions across the rail profile before and after the jump.
    """

    side: TrackSide
    shift_mm: float
    from_rail_y_mm: float
    to_rail_y_mm: float


@dataclass(frozen=True, kw_only=True)
class Conicity:
    """Equivalent conicity at an amplitude of the lateral motion, with and without the wheelset's roll.

    Profiles are usually compared without roll, as in EN 15302.

    Attributes
    ----------
    amplitude_mm
        Amplitude of the lateral motion.
    rolled, unrolled
        By the wave length of the kinematic motion (EN 15302); NaN if there is no motion of this amplitude.
    harmonic_rolled, harmonic_unrolled
        By harmonic linearisation about the shift of equal radii; NaN if the amplitude is not possible.
    """

    amplitude_mm: float
    rolled: float
    unrolled: float
    harmonic_rolled: float
    harmonic_unrolled: float


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactFunctions:
    """A wheelset over its lateral shifts.

    Attributes
    ----------
    symmetric
        Whether the right side is the mirror image of the left side.
    centred_height_mm
        Height of the axle without a shift; NaN if the wheelset cannot stand there.
    positions
        The wheelset on its rails for each shift (mm, positive to the left), or the reason against it.
    jumps
        Jumps between the smallest and the largest possible shift, in the order of the shifts.
    largest_amplitude_mm
        Largest amplitude of `conicities`.
    rolled, unrolled
        Rolling-radius difference with the wheelset's roll and without it, where both wheels stand on treads and
        flanges; None with fewer than two such shifts.
    """

    symmetric: bool
    centred_height_mm: float
    positions: dict[float, PlacedWheelset | PositionProblem]
    jumps: tuple[Jump, ...]
    largest_amplitude_mm: float
    rolled: RadiusDifference | None
    unrolled: RadiusDifference | None

    @cached_property
    def conicities(self) -> tuple[Conicity, ...]:
        """Conicities at whole amplitudes (mm).

        They include motions that end on a flange, as the conicities of EN 15302 do.
        """
        if self.rolled is None or self.unrolled is None:
            return ()
        return tuple(
            Conicity(
                amplitude_mm=amplitude,
                rolled=self.rolled.conicity(amplitude),
                unrolled=self.unrolled.conicity(amplitude),
                harmonic_rolled=self.rolled.harmonic_conicity(amplitude),
                harmonic_unrolled=self.unrolled.harmonic_conicity(amplitude),
            )
            for amplitude in map(float, range(1, int(self.largest_amplitude_mm + 1e-9) + 1))
        )


def rolling_radius_difference_mm(placed_wheelset: PlacedWheelset) -> float:
    """Rolling radius of the left wheel minus rolling radius of the right wheel.

    Parameters
    ----------
    placed_wheelset
        The wheelset on its rails.

    Returns
    -------
    difference
        Difference in mm of the radii at the first contact points.
    """
    left, right = (
        float(side.wheel.radius(side.first.wheel_u)) for side in (placed_wheelset.left, placed_wheelset.right)
    )
    return left - right


def compute_contact_functions(wheelset: Wheelset, shifts_mm: Sequence[float], yaw_rad: float = 0.0) -> ContactFunctions:
    """Set a wheelset on its rails at many shifts.

    Its roll is the roll at which both wheels touch.

    Parameters
    ----------
    wheelset
        Both wheels over their rails.
    shifts_mm
        Shifts of the table. Jumps are searched for between them. Conicities depend on them only because amplitudes
        above 7 mm need such shifts.
    yaw_rad
        Yaw angle.

    Returns
    -------
    ContactFunctions
        Positions, jumps and radius differences.
    """
    positions = place_wheelset_at_shifts(wheelset, shifts_mm, yaw_rad)
    centred_wheelset = wheelset.stand(0.0, yaw_rad)
    height = float("nan") if isinstance(centred_wheelset, str) else centred_wheelset.left.axle_mm
    # Without a possible shift there are no jumps.
    possible = [shift for shift, placed_wheelset in positions.items() if not isinstance(placed_wheelset, str)]
    low, high = min(possible, default=0.0), max(possible, default=0.0)
    contact_points = _ContactPointsOverShift(wheelset, yaw_rad, rolls=True)
    jumps = contact_points.jumps(low, high)
    amplitude = max(_MAX_AMPLITUDE_MM, min(-low, high))
    farthest = max(_MAX_MOTION_SHIFT_MM, -low, high)
    return ContactFunctions(
        symmetric=wheelset.symmetric,
        centred_height_mm=height,
        positions=positions,
        jumps=jumps,
        largest_amplitude_mm=amplitude,
        rolled=contact_points.radius_difference(-farthest, farthest),
        unrolled=compute_radius_difference(wheelset, -farthest, farthest, yaw_rad, rolls=False),
    )


def compute_radius_difference(
    wheelset: Wheelset, low_mm: float, high_mm: float, yaw_rad: float = 0.0, *, rolls: bool
) -> RadiusDifference | None:
    """Compute the difference of the rolling radii, left minus right, between two shifts.

    Jumps are included. Flanges may climb, but not over their tops.

    Parameters
    ----------
    wheelset
        Both wheels over their rails.
    low_mm, high_mm
        Range of the shifts in mm.
    yaw_rad
        Yaw angle.
    rolls
        Whether the wheelset rolls until both wheels touch.

    Returns
    -------
    RadiusDifference or None
        None if the wheelset stands at fewer than two shifts.
    """
    return _ContactPointsOverShift(wheelset, yaw_rad, rolls=rolls).radius_difference(low_mm, high_mm)


def place_wheelset_at_shifts(
    wheelset: Wheelset, shifts_mm: Sequence[float], yaw_rad: float = 0.0
) -> dict[float, PlacedWheelset | PositionProblem]:
    """Place the wheelset on its rails at many shifts.

    Parameters
    ----------
    wheelset
        Both wheels over their rails.
    shifts_mm
        Shifts in mm, positive to the left.
    yaw_rad
        Yaw angle.

    Returns
    -------
    positions
        The wheelset on its rails, or the reason against it, by increasing shift.
    """
    positions: dict[float, PlacedWheelset | PositionProblem] = {}
    guess = 0.0
    # From the middle outwards on either side. Each roll is the guess for the next shift.
    for shift in sorted(shifts_mm, key=lambda shift: (shift < 0.0, abs(shift))):
        mirrored = positions.get(-shift)
        # The permission of a flange to climb depends on the side.
        if isinstance(mirrored, PlacedWheelset) and wheelset.symmetric and yaw_rad == 0.0 and not mirrored.climbs:
            positions[shift] = replace(
                mirrored, shift_mm=shift, roll_rad=-mirrored.roll_rad, left=mirrored.right, right=mirrored.left
            )
            continue
        placed_wheelset = wheelset.at(shift, yaw_rad, guess_rad=guess)
        guess = 0.0 if isinstance(placed_wheelset, str) else placed_wheelset.roll_rad
        positions[shift] = placed_wheelset
    return {shift: positions[shift] for shift in sorted(positions)}


class _ContactPointsOverShift:
    """First contact points of both wheels over the shift, cached by shift.

    The wheelset rolls or does not roll. If it is symmetric and not yawed, the contact points at opposite shifts are
    mirror images.
    """

    def __init__(self, wheelset: Wheelset, yaw_rad: float, *, rolls: bool) -> None:
        """Start without any shift.

        Parameters
        ----------
        wheelset
            Both wheels over their rails.
        yaw_rad
            Yaw angle.
        rolls
            Whether the wheelset rolls until both wheels touch.
        """
        self._wheelset, self._yaw, self._rolls = wheelset, yaw_rad, rolls
        self._is_mirrored = wheelset.symmetric and yaw_rad == 0.0
        self._wheels_by_shift: dict[float, tuple[LoweredWheel, LoweredWheel] | None] = {}
        self._guess = 0.0

    def jumps(self, low: float, high: float) -> tuple[Jump, ...]:
        """Jumps of both wheels' first contact points between two shifts."""
        sides: tuple[TrackSide, TrackSide] = ("left", "right")
        jumps = (self._find_jump(side, a, b) for a, b in pairwise(_shift_grid(low, high)) for side in sides)
        return tuple(jump for jump in jumps if jump is not None)

    def radius_difference(self, low: float, high: float) -> RadiusDifference | None:
        """Rolling-radius difference between two shifts.

        It is NaN where a wheel stands on the top of its flange.

        Parameters
        ----------
        low, high
            Range of the shifts in mm.

        Returns
        -------
        RadiusDifference or None
            None if the wheelset stands at fewer than two shifts.
        """
        # This finds the jumps: the cached shifts are closer about them.
        self.jumps(low, high)
        cached = {shift for shift in self._wheels_by_shift if low < shift < high}
        mirrored = {-shift for shift in cached if low < -shift < high} if self._is_mirrored else set()
        nodes = sorted({*_shift_grid(low, high), *cached, *mirrored})
        return RadiusDifference.of(nodes, [self._radius_difference(shift) for shift in nodes])

    def _lowered_wheels(self, shift: float) -> tuple[LoweredWheel, LoweredWheel] | None:
        """Both wheels on their rails at a shift, from the cache; None if a wheel cannot stand there."""
        if self._is_mirrored and shift < 0.0:
            mirrored = self._lowered_wheels(-shift)
            return mirrored and (mirrored[1], mirrored[0])
        if shift not in self._wheels_by_shift:
            self._wheels_by_shift[shift] = self._lower_wheels(shift)
        return self._wheels_by_shift[shift]

    def _lower_wheels(self, shift: float) -> tuple[LoweredWheel, LoweredWheel] | None:
        """Both wheels on their rails at a shift; None if a wheel cannot stand there.

        `shift` is in mm, positive to the left. If the wheelset rolls, its roll is the first guess for the next shift.
        The right wheel is in its mirrored frame.
        """
        wheelset = self._wheelset
        if self._rolls:
            lowered = wheelset.stand(shift, self._yaw, guess_rad=self._guess)
            if isinstance(lowered, str):
                return None
            self._guess = lowered.roll_rad
            return lowered.left, lowered.right
        left, right = wheelset.left.standing(shift, 0.0, self._yaw), wheelset.right.standing(-shift, 0.0, -self._yaw)
        return None if left is None or right is None else (left, right)

    def _find_jump(self, side: TrackSide, low: float, high: float) -> Jump | None:
        """A jump between two shifts (mm), by bisection; None if the contact point moves continuously.

        The bisection ends if the contact points at both ends are close.
        """
        ends = self._touch_y(side, low), self._touch_y(side, high)
        while abs(ends[1] - ends[0]) > _MIN_JUMP_MM:
            middle = 0.5 * (low + high)
            if high - low < _JUMP_TOLERANCE_MM:
                rail = getattr(self._wheelset, side).pair.rail
                places = (float(rail.profile.evaluate(rail.parameter_at_y(y)).y) for y in ends)
                return Jump(side, middle, *places)
            middle_y = self._touch_y(side, middle)
            if abs(middle_y - ends[0]) > abs(ends[1] - middle_y):
                high, ends = middle, (ends[0], middle_y)
            else:
                low, ends = middle, (middle_y, ends[1])
        return None

    def _touch_y(self, side: TrackSide, shift: float) -> float:
        """Lateral position of the first contact point of a side in mm; NaN without both wheels on their rails."""
        lowered_wheels = self._lowered_wheels(shift)
        return float("nan") if lowered_wheels is None else lowered_wheels[0 if side == "left" else 1].y_mm

    def _radius_difference(self, shift: float) -> float:
        """Rolling-radius difference at a shift in mm.

        NaN where a wheel stands on the top of its flange, or not at all.
        """
        lowered_wheels = self._lowered_wheels(shift)
        if lowered_wheels is None:
            return float("nan")
        wheels = (self._wheelset.left.pair.wheel, self._wheelset.right.pair.wheel)
        if any(
            is_on_flange_top(wheel, lowered.wheel_y_mm) for wheel, lowered in zip(wheels, lowered_wheels, strict=True)
        ):
            return float("nan")
        return lowered_wheels[0].radius_mm - lowered_wheels[1].radius_mm


def _shift_grid(low: float, high: float) -> list[float]:
    """Shifts from `low` to `high` in steps of at most a tenth of a millimetre."""
    inner = np.arange(
        np.ceil(low / _SHIFT_GRID_SPACING_MM + 1e-9), np.floor(high / _SHIFT_GRID_SPACING_MM - 1e-9) + 1.0
    )
    shifts = np.round(np.concatenate([[low], _SHIFT_GRID_SPACING_MM * inner, [high]]), 9)
    return sorted({float(shift) for shift in shifts})
