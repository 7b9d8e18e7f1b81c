"""A wheelset on its rails: its roll, and its contact functions over the lateral shift.

The roll of a free wheelset is the roll at which both wheels touch. Shift, roll and yaw are given for the left side: a
positive shift is towards the left rail, a positive roll lifts the left wheel. The right wheel on its rail is the left
wheel of the mirror image, for which shift, roll and yaw change their signs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fecontact.arrays import Floats, Integers
from fecontact.bodies import TrackSide
from fecontact.errors import InputError
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
    radius_mm
        Radius of the wheel at the touch point.
    """

    axle_mm: float
    lever_mm: float
    y_mm: float
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
        slid, radius = z * np.tan(tangent), self.pair.rolling_radius_mm - points.z[places]
        ends = np.cumsum([0, *sizes])
        return [
            _lowest(shift, places[part], gap[part], y[part], slid[part], radius[part])
            for shift, part in zip(shifts_mm, map(slice, ends[:-1], ends[1:]), strict=True)
        ]


def _lowest(shift_mm: float, places: Integers, gap: Floats, y: Floats, slid: Floats, radius: Floats) -> Standing | None:
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
# Points of the integral over one period.
_PHASES = 4000


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

    Profiles are usually compared without roll.
    """

    amplitude_mm: float
    rolled: float
    unrolled: float


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
    conicities
        Conicities at whole amplitudes (mm), up to the largest amplitude that is possible to both sides.
    """

    symmetric: bool
    centred_height_mm: float
    positions: dict[float, PlacedWheelset | str]
    jumps: tuple[Jump, ...]
    conicities: tuple[Conicity, ...]


def rolling_radius_difference_mm(placed: PlacedWheelset) -> float:
    """Rolling radius of the left wheel minus rolling radius of the right wheel, each at its first touch point."""
    left, right = (float(side.wheel.radius(side.first.wheel_u)) for side in (placed.left, placed.right))
    return left - right


def contact_functions(wheelset: Wheelset, shifts_mm: Sequence[float], yaw_rad: float = 0.0) -> ContactFunctions:
    """Set a wheelset on its rails at many shifts, with the roll at which both wheels touch.

    Parameters
    ----------
    shifts_mm
        Shifts of the table; jumps are looked for between them. Conicities do not depend on them.
    """
    positions = positions_at(wheelset, shifts_mm, yaw_rad)
    centred = wheelset.stand(0.0, yaw_rad)
    height = float("nan") if isinstance(centred, str) else centred.left.axle_mm
    # without a possible shift there are no jumps
    possible = [shift for shift, placed in positions.items() if not isinstance(placed, str)]
    low, high = min(possible, default=0.0), max(possible, default=0.0)
    rolled, unrolled = (_Line(wheelset, yaw_rad, rolls=rolls) for rolls in (True, False))
    jumps = rolled.jumps(low, high)
    end = min(-low, high)
    # this finds the jumps, whose shifts are nodes of the integrals
    unrolled.jumps(-max(end, 0.0), max(end, 0.0))
    return ContactFunctions(
        symmetric=wheelset.symmetric,
        centred_height_mm=height,
        positions=positions,
        jumps=jumps,
        conicities=tuple(
            Conicity(amplitude_mm=amplitude, rolled=rolled.conicity(amplitude), unrolled=unrolled.conicity(amplitude))
            for amplitude in map(float, range(1, int(end + 1e-9) + 1))
        ),
    )


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

    def conicity(self, amplitude: float) -> float:
        """Equivalent conicity at an amplitude (mm)."""
        # shifts that are known already lie closer about jumps
        known = {shift for shift in self._known if abs(shift) < amplitude}
        nodes = sorted({*_line(-amplitude, amplitude), *known, *((-shift for shift in known) if self._mirrors else ())})
        return harmonic_conicity(self._radius_difference, amplitude, nodes)

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
        return float("nan") if standings is None else standings[0].radius_mm - standings[1].radius_mm


def _line(low: float, high: float) -> list[float]:
    """Shifts from `low` to `high` in steps of a tenth of a millimetre or a little less."""
    inner = np.arange(np.ceil(low / _SHIFT_STEP_MM + 1e-9), np.floor(high / _SHIFT_STEP_MM - 1e-9) + 1.0)
    every = np.round(np.concatenate([[low], _SHIFT_STEP_MM * inner, [high]]), 9)
    return sorted({float(shift) for shift in every})


def harmonic_conicity(
    radius_difference_mm: Callable[[float], float], amplitude_mm: float, nodes_mm: Sequence[float] | None = None
) -> float:
    """Equivalent conicity of a rolling-radius difference by harmonic linearisation.

    Parameters
    ----------
    radius_difference_mm
        Difference (mm) over the lateral shift y (mm); 2 g y for cones of the conicity g.
    amplitude_mm
        Amplitude A of the lateral motion y = A cos(phase).
    nodes_mm
        Shifts from -A to A between which the difference is taken as linear; every 0.1 mm if not given.

    Returns
    -------
    float
        Mean of the difference times cos(phase) over a period, divided by A: the conicity of cones with an equal first
        harmonic.

    Notes
    -----
    Harmonic (quasi-) linearisation, one of the methods in use for EN 15302.
    """
    nodes = _line(-amplitude_mm, amplitude_mm) if nodes_mm is None else nodes_mm
    values = np.array([radius_difference_mm(shift) for shift in nodes])
    cosine = np.cos((np.arange(_PHASES) + 0.5) * 2.0 * np.pi / _PHASES)
    return float(np.mean(np.interp(amplitude_mm * cosine, nodes, values) * cosine) / amplitude_mm)
