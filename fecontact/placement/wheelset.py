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
from fecontact.errors import InputError
from fecontact.placement.carrying import is_on_flange_top
from fecontact.placement.conicity import RadiusDifference
from fecontact.placement.poses import places_at_shifts, search_points
from fecontact.placement.wheel_on_rail import EVERY_SHIFT, SIGN, Pair, Placement

SIDES: tuple[TrackSide, TrackSide] = ("left", "right")
# Largest difference of both wheels' axle heights, which are as exact: a roll of 1e-12 rad.
_HEIGHT_MM = 1e-9
_STEPS = 60
# Wheelsets that run on their treads or flanges roll by a tenth of this.
_MOST_ROLL_RAD = 0.1
# Step and end of the search for possible shifts.
_STEP_MM, _FARTHEST_MM = 0.5, 60.0


@dataclass(frozen=True, kw_only=True)
class Standing:
    """A wheel on its rail, in the frame of the left side.

    Attributes
    ----------
    axle_mm
        Height of the axle's centre.
    lever_mm
        How much the axle falls for a radian of roll.
    y_mm
        Lateral position of the touch point from the track's centre.
    wheel_y_mm
        Lateral position of the touch point on the wheel, from its tape circle.
    radius_mm
        Radius of the wheel at the touch point.
    """

    axle_mm: float
    lever_mm: float
    y_mm: float
    wheel_y_mm: float
    radius_mm: float


@dataclass(frozen=True, kw_only=True, eq=False)
class HungPair:
    """A pair whose wheel stands on its rail in thousands of positions."""

    pair: Pair

    def standing(self, shift_mm: float, roll_rad: float, yaw_rad: float) -> Standing | None:
        """The wheel at its first touch; None if it does not stand over the rail."""
        (found,) = self.standings([shift_mm], roll_rad, yaw_rad)
        return found

    def standings(self, shifts_mm: Sequence[float], roll_rad: float, yaw_rad: float) -> list[Standing | None]:
        """The wheel at its first touch at each shift; None where it does not stand over the rail.

        The smallest gap among samples of 0.02 mm on the exact lines is refined by the parabola through it and its
        neighbours. The height is exact to 1e-9 mm if the curvatures of both lines are constant between the samples.
        """
        pose, rail = self.pair.hung(0.0, roll_rad, yaw_rad), self.pair.rail
        points = search_points(self.pair.wheel)[1].taken(slice(1, -1))
        near = places_at_shifts(rail, pose, points, shifts_mm)
        places, sizes = np.concatenate(near), [one.size for one in near]
        _, _, y, z = pose.silhouette_of(points.taken(places))
        y = y + np.repeat(shifts_mm, sizes)
        _, z_rail, tangent = rail.section(rail.parameter_at_y(y))
        gap = np.nan_to_num(z - z_rail, nan=np.inf)
        # the touch point slides along the common tangent of both lines
        slid, wheel_y, radius = z * np.tan(tangent), points.y[places], self.pair.rolling_radius_mm - points.z[places]
        ends = np.cumsum([0, *sizes])
        return [
            _lowest(shift, places[part], gap[part], y[part], slid[part], wheel_y[part], radius[part])
            for shift, part in zip(shifts_mm, map(slice, ends[:-1], ends[1:]), strict=True)
        ]


def _lowest(
    shift_mm: float, places: Integers, gap: Floats, y: Floats, slid: Floats, wheel_y: Floats, radius: Floats
) -> Standing | None:
    """Where the gap over samples (n,) along the wheel is smallest."""
    k = int(np.argmin(gap)) if gap.size else 0
    if not gap.size or not np.isfinite(gap[k]):
        return None
    least, step = float(gap[k]), 0.0
    if 0 < k < gap.size - 1 and places[k + 1] - places[k - 1] == 2:
        before, after = float(gap[k - 1]), float(gap[k + 1])
        bend = before - 2.0 * least + after
        # infinite next to the end of a line
        if 0.0 < bend < np.inf:
            step = 0.5 * (before - after) / bend
            least -= 0.125 * (before - after) ** 2 / bend
    at, every = k + step, np.arange(gap.size)
    y_touch = float(np.interp(at, every, y))
    # the touch point turns about the axle's centre
    return Standing(
        axle_mm=-least,
        lever_mm=(y_touch - shift_mm) + float(slid[k]),
        y_mm=y_touch,
        wheel_y_mm=float(np.interp(at, every, wheel_y)),
        radius_mm=float(np.interp(at, every, radius)),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedWheelset:
    """A wheelset that stands on both rails.

    Attributes
    ----------
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
        """The wheel of a side on its rail, which knows whether the other one climbs."""
        own, other = (self.left, self.right) if side == "left" else (self.right, self.left)
        return replace(own, other_climbs=other.climbs)


@dataclass(frozen=True, kw_only=True)
class Stand:
    """Roll (rad) at which both wheels touch, and both wheels there, each in the frame of the left side."""

    roll_rad: float
    left: Standing
    right: Standing


@dataclass(frozen=True, kw_only=True, eq=False)
class Wheelset:
    """A rigid wheelset on a track: left and right wheel over their rails.

    `asked` is the side whose wheel is asked for: what the flange of the other wheel does is no reason against it. With
    None both are asked for.
    """

    left: HungPair
    right: HungPair
    asked: TrackSide | None = None

    @classmethod
    def of(cls, left: Pair, right: Pair) -> Wheelset:
        """A wheelset of two wheels over their rails; the same object twice for a symmetric one."""
        hung = HungPair(pair=left)
        return cls(left=hung, right=hung if right is left else HungPair(pair=right))

    @property
    def symmetric(self) -> bool:
        """Whether the right side is the mirror image of the left one."""
        return self.left is self.right

    def stand(self, shift_mm: float, yaw_rad: float = 0.0, *, guess_rad: float = 0.0) -> Stand | str:
        """Roll at which both wheels touch, with one height of the axle; or why there is no such roll.

        Newton's method, and bisection if it fails: the height difference is continuous in the roll and falls, but has a
        kink wherever a wheel's touch point jumps.
        """
        roll, low, high = guess_rad, -_MOST_ROLL_RAD, _MOST_ROLL_RAD
        for _ in range(_STEPS):
            left = self.left.standing(shift_mm, roll, yaw_rad)
            right = self.right.standing(-shift_mm, -roll, -yaw_rad)
            if left is None or right is None:
                return f"the {'left' if left is None else 'right'} wheel does not stand over its rail"
            difference = left.axle_mm - right.axle_mm
            if abs(difference) < _HEIGHT_MM:
                return Stand(roll_rad=roll, left=left, right=right)
            low, high = (roll, high) if difference > 0.0 else (low, roll)
            lever = left.lever_mm + right.lever_mm
            roll += difference / lever if lever > 0.0 else np.inf
            if not low < roll < high:
                roll = 0.5 * (low + high)
        return "no roll is found at which both wheels touch their rails"

    def placed(self, side: TrackSide, shift_mm: float, roll_rad: float, yaw_rad: float) -> Placement | str:
        """A wheel on its rail, at a shift, roll and yaw of the wheelset; or why it cannot stand there."""
        sign, pair = SIGN[side], (self.left if side == "left" else self.right).pair
        if self.asked not in (None, side):
            pair = replace(pair, flange_climb=True)
        placement = pair.placed(sign * shift_mm, sign * roll_rad, sign * yaw_rad)
        return f"{side} side: {placement}" if isinstance(placement, str) else placement

    def at(self, shift_mm: float, yaw_rad: float = 0.0, *, guess_rad: float = 0.0) -> PlacedWheelset | str:
        """The wheelset on its rails at a shift (mm, positive to the left) and yaw, or why it cannot stand there."""
        stand = self.stand(shift_mm, yaw_rad, guess_rad=guess_rad)
        if isinstance(stand, str):
            return stand
        placed: dict[TrackSide, Placement] = {}
        for side in SIDES:
            placement = self.placed(side, shift_mm, stand.roll_rad, yaw_rad)
            if isinstance(placement, str):
                return placement
            placed[side] = placement
        return PlacedWheelset(
            shift_mm=shift_mm,
            yaw_rad=yaw_rad,
            roll_rad=stand.roll_rad,
            axle_height_mm=float(placed["left"].wheel.centre_mm[2]),
            **placed,
        )


def place_wheelset(wheelset: Wheelset, lateral_shift_mm: float, yaw_rad: float = 0.0) -> PlacedWheelset:
    """Set a wheelset on its rails.

    Parameters
    ----------
    lateral_shift_mm
        Displacement, positive towards the left rail.

    Raises
    ------
    InputError
        If a wheel leaves its rail, or one that is asked for climbs over it; the message gives the possible shifts.
    """
    placed = wheelset.at(lateral_shift_mm, yaw_rad)
    if isinstance(placed, str):
        can = possible_wheelset_shifts(wheelset, yaw_rad)
        raise InputError(
            f"lateral shift {lateral_shift_mm:g} mm of the wheelset: {placed}; {can}; a roll that is given"
            " (--roll-mrad) leaves the other wheel out"
        )
    return placed


def possible_wheelset_shifts(wheelset: Wheelset, yaw_rad: float = 0.0) -> str:
    """Possible shifts in words: from the middle outwards, up to the first shift that is not possible."""
    ends = []
    for step in (-_STEP_MM, _STEP_MM):
        shift = 0.0
        while abs(shift) <= _FARTHEST_MM and not isinstance(wheelset.at(shift, yaw_rad), str):
            shift += step
        ends.append(shift - step)
    if ends[0] > ends[1]:
        return f"the wheelset cannot stand in the middle of the track: {_possible_gauges(wheelset, yaw_rad)}"
    return f"shifts between {ends[0]:g} and {ends[1]:g} mm (in steps of {_STEP_MM:g} mm) are possible"


def _possible_gauges(wheelset: Wheelset, yaw_rad: float) -> str:
    """Other gauges, in words, on which a symmetric wheelset stands in the middle of the track.

    Only a symmetric wheelset has no roll there, so that each wheel can be tried alone.
    """
    if not wheelset.symmetric:
        return "check gauge, back-to-back distance, and profiles and diameters of both sides"
    # if the gauge is wider by 2 mm, each rail is 1 mm farther from its wheel
    widths = [
        -2.0 * shift
        for shift in EVERY_SHIFT
        if not any(isinstance(wheelset.left.pair.placed(float(shift), 0.0, yaw), str) for yaw in {yaw_rad, -yaw_rad})
    ]
    if not widths:
        return "nor would it on a gauge up to 80 mm wider or narrower; check the profiles"
    wider = min(widths) > 0.0
    low, high = sorted(abs(end) for end in (min(widths), max(widths)))
    return (
        f"it can on a gauge {low:g} to {high:g} mm {'wider' if wider else 'narrower'}, or with a back-to-back distance"
        f" that much {'smaller' if wider else 'larger'}"
    )


# --- Contact functions of a wheelset over its lateral shift: rolling radii, jumps, equivalent conicity.

# Steps of the shift in which all functions are taken as linear, and in which jumps are looked for.
_SHIFT_STEP_MM = 0.1
# A touch point jumps if it moves by more than this across the rail, however small the step of the shift. Without a jump
# it moves by at most 20 mm for each millimetre of shift.
_JUMP_MM = 0.5
_JUMP_WITHIN_MM = 1e-4
# Largest amplitude of conicities, in whole millimetres, as in the tables of EN 15302; and farthest shift of a motion:
# wheels of unequal diameters move about a shift beside the middle of the track.
_AMPLITUDE_MM, _FARTHEST_MOTION_MM = 7.0, 10.0


@dataclass(frozen=True)
class Jump:
    """A shift (mm) at which a wheel's first touch point jumps from one place of the rail to another (mm)."""

    side: TrackSide
    shift_mm: float
    from_rail_y_mm: float
    to_rail_y_mm: float


@dataclass(frozen=True, kw_only=True)
class Conicity:
    """Equivalent conicity at an amplitude of the lateral motion, with the wheelset's roll and without it.

    Profiles are usually compared without roll, as in EN 15302.

    Attributes
    ----------
    rolled, unrolled
        By the wave length of the kinematic motion (EN 15302); NaN if there is no motion of this amplitude.
    harmonic_rolled, harmonic_unrolled
        By harmonic linearisation about the shift of equal radii; NaN where the amplitude is not possible.
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
    positions
        The wheelset on its rails for each shift (mm, positive to the left), or why it cannot stand there.
    centred_height_mm
        Height of the axle without a shift; NaN if the wheelset cannot stand there.
    jumps
        Jumps between the smallest and the largest possible shift, in the order of the shifts.
    largest_amplitude_mm
        Largest amplitude of `conicities`.
    rolled, unrolled
        Rolling-radius difference with the wheelset's roll and without it, as far as both wheels stand on treads and
        flanges; None if they do at fewer than two shifts.
    """

    symmetric: bool
    centred_height_mm: float
    positions: dict[float, PlacedWheelset | str]
    jumps: tuple[Jump, ...]
    largest_amplitude_mm: float
    rolled: RadiusDifference | None
    unrolled: RadiusDifference | None

    @cached_property
    def conicities(self) -> tuple[Conicity, ...]:
        """Conicities at whole amplitudes (mm). They include motions that end on a flange, as those of EN 15302 do."""
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


def rolling_radius_difference_mm(placed: PlacedWheelset) -> float:
    """Rolling radius of the left wheel minus rolling radius of the right wheel, each at its first touch point."""
    left, right = (float(side.wheel.radius(side.first.wheel_u)) for side in (placed.left, placed.right))
    return left - right


def contact_functions(wheelset: Wheelset, shifts_mm: Sequence[float], yaw_rad: float = 0.0) -> ContactFunctions:
    """Set a wheelset on its rails at many shifts, with the roll at which both wheels touch.

    Parameters
    ----------
    shifts_mm
        Shifts of the table; jumps are looked for between them. Conicities depend on them only in that amplitudes above
        7 mm need such shifts.
    """
    positions = positions_at(wheelset, shifts_mm, yaw_rad)
    centred = wheelset.stand(0.0, yaw_rad)
    height = float("nan") if isinstance(centred, str) else centred.left.axle_mm
    # without a possible shift there are no jumps
    possible = [shift for shift, placed in positions.items() if not isinstance(placed, str)]
    low, high = min(possible, default=0.0), max(possible, default=0.0)
    touches = _Line(wheelset, yaw_rad, rolls=True)
    jumps = touches.jumps(low, high)
    amplitude = max(_AMPLITUDE_MM, min(-low, high))
    farthest = max(_FARTHEST_MOTION_MM, -low, high)
    return ContactFunctions(
        symmetric=wheelset.symmetric,
        centred_height_mm=height,
        positions=positions,
        jumps=jumps,
        largest_amplitude_mm=amplitude,
        rolled=touches.radius_difference(-farthest, farthest),
        unrolled=radius_difference(wheelset, -farthest, farthest, yaw_rad, rolls=False),
    )


def radius_difference(
    wheelset: Wheelset, low_mm: float, high_mm: float, yaw_rad: float = 0.0, *, rolls: bool
) -> RadiusDifference | None:
    """Rolling radius of the left wheel minus that of the right wheel between two shifts (mm), with its jumps.

    `rolls` says whether the wheelset rolls until both wheels touch. None if it stands at fewer than two shifts. Flanges
    may climb, but not over their tops.
    """
    return _Line(wheelset, yaw_rad, rolls=rolls).radius_difference(low_mm, high_mm)


def positions_at(
    wheelset: Wheelset, shifts_mm: Sequence[float], yaw_rad: float = 0.0
) -> dict[float, PlacedWheelset | str]:
    """The wheelset on its rails at many shifts (mm, positive to the left), or why it cannot stand there."""
    positions: dict[float, PlacedWheelset | str] = {}
    guess = 0.0
    # from the middle outwards on either side; each roll is the guess for the next
    for shift in sorted(shifts_mm, key=lambda shift: (shift < 0.0, abs(shift))):
        mirrored = positions.get(-shift)
        # whether a flange may climb hangs on the side
        if isinstance(mirrored, PlacedWheelset) and wheelset.symmetric and yaw_rad == 0.0 and not mirrored.climbs:
            positions[shift] = replace(
                mirrored, shift_mm=shift, roll_rad=-mirrored.roll_rad, left=mirrored.right, right=mirrored.left
            )
            continue
        placed = wheelset.at(shift, yaw_rad, guess_rad=guess)
        guess = 0.0 if isinstance(placed, str) else placed.roll_rad
        positions[shift] = placed
    return {shift: positions[shift] for shift in sorted(positions)}


class _Line:
    """First touch points of both wheels over the shift, with the roll of the wheelset or without; cached by shift.

    If the wheelset is symmetric and not yawed, the touch points at opposite shifts are mirror images.
    """

    def __init__(self, wheelset: Wheelset, yaw_rad: float, *, rolls: bool) -> None:
        self._wheelset, self._yaw, self._rolls = wheelset, yaw_rad, rolls
        self._mirrors = wheelset.symmetric and yaw_rad == 0.0
        self._known: dict[float, tuple[Standing, Standing] | None] = {}
        self._guess = 0.0

    def jumps(self, low: float, high: float) -> tuple[Jump, ...]:
        """Jumps of both wheels' first touch points between two shifts."""
        sides: tuple[TrackSide, TrackSide] = ("left", "right")
        jumps = (self._jump(side, a, b) for a, b in pairwise(_line(low, high)) for side in sides)
        return tuple(jump for jump in jumps if jump is not None)

    def radius_difference(self, low: float, high: float) -> RadiusDifference | None:
        """Rolling-radius difference between two shifts, NaN where a wheel stands on the top of its flange."""
        # this finds the jumps: shifts that are known lie closer about them
        self.jumps(low, high)
        known = {shift for shift in self._known if low < shift < high}
        mirrored = {-shift for shift in known if low < -shift < high} if self._mirrors else set()
        nodes = sorted({*_line(low, high), *known, *mirrored})
        return RadiusDifference.of(nodes, [self._radius_difference(shift) for shift in nodes])

    def _standings(self, shift: float) -> tuple[Standing, Standing] | None:
        if self._mirrors and shift < 0.0:
            mirrored = self._standings(-shift)
            return mirrored and (mirrored[1], mirrored[0])
        if shift not in self._known:
            self._known[shift] = self._find(shift)
        return self._known[shift]

    def _find(self, shift: float) -> tuple[Standing, Standing] | None:
        wheelset = self._wheelset
        if self._rolls:
            stand = wheelset.stand(shift, self._yaw, guess_rad=self._guess)
            if isinstance(stand, str):
                return None
            self._guess = stand.roll_rad
            return stand.left, stand.right
        left, right = wheelset.left.standing(shift, 0.0, self._yaw), wheelset.right.standing(-shift, 0.0, -self._yaw)
        return None if left is None or right is None else (left, right)

    def _jump(self, side: TrackSide, low: float, high: float) -> Jump | None:
        """A jump between two shifts, by bisection as long as the touch points at both ends are far apart."""
        ends = self._y(side, low), self._y(side, high)
        while abs(ends[1] - ends[0]) > _JUMP_MM:
            middle = 0.5 * (low + high)
            if high - low < _JUMP_WITHIN_MM:
                rail = getattr(self._wheelset, side).pair.rail
                places = (float(rail.profile.evaluate(rail.parameter_at_y(y)).y) for y in ends)
                return Jump(side, middle, *places)
            at = self._y(side, middle)
            if abs(at - ends[0]) > abs(ends[1] - at):
                high, ends = middle, (ends[0], at)
            else:
                low, ends = middle, (at, ends[1])
        return None

    def _y(self, side: TrackSide, shift: float) -> float:
        standings = self._standings(shift)
        return float("nan") if standings is None else standings[0 if side == "left" else 1].y_mm

    def _radius_difference(self, shift: float) -> float:
        standings = self._standings(shift)
        if standings is None:
            return float("nan")
        wheels = (self._wheelset.left.pair.wheel, self._wheelset.right.pair.wheel)
        if any(is_on_flange_top(wheel, one.wheel_y_mm) for wheel, one in zip(wheels, standings, strict=True)):
            return float("nan")
        return standings[0].radius_mm - standings[1].radius_mm


def _line(low: float, high: float) -> list[float]:
    """Shifts from `low` to `high` in steps of a tenth of a millimetre or a little less."""
    inner = np.arange(np.ceil(low / _SHIFT_STEP_MM + 1e-9), np.floor(high / _SHIFT_STEP_MM - 1e-9) + 1.0)
    every = np.round(np.concatenate([[low], _SHIFT_STEP_MM * inner, [high]]), 9)
    return sorted({float(shift) for shift in every})
