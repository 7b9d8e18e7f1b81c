"""What a wheelset's touch points do over its lateral shift: rolling radii, jumps, equivalent conicity."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fecontact.dimensions import TrackSide
from fecontact.geometry.wheelset import PlacedWheelset, Standing, Wheelset

# Steps of the shift between which all functions are taken as straight, and in which jumps are looked for.
_STEP_MM = 0.1
# A touch point that moves by more across the rail, however small the step of the shift, jumps: it moves by 20 mm for a
# millimetre of shift at most where two arcs are followed.
_JUMP_MM = 0.5
_JUMP_WITHIN_MM = 1e-4
# Of the integral over one period.
_PHASES = 4000


@dataclass(frozen=True)
class Jump:
    """A shift at which the first touch point of one wheel goes from one place of its rail to another (mm)."""

    side: TrackSide
    shift_mm: float
    from_rail_y_mm: float
    to_rail_y_mm: float


@dataclass(frozen=True, kw_only=True)
class Conicity:
    """Equivalent conicity at an amplitude of the lateral motion: of a wheelset that rolls as it shifts, and of one that
    does not, as profiles are compared by it.
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
        For each shift (mm, positive to the left) the wheelset on its rails, or why it cannot stand there.
    centred_height_mm
        Of the axle without a shift; NaN where the wheelset cannot stand there.
    jumps
        Between the smallest and the largest shift that are possible, in the order of the shifts.
    conicities
        At whole amplitudes (mm) up to the smaller of both ends.
    """

    symmetric: bool
    centred_height_mm: float
    positions: dict[float, PlacedWheelset | str]
    jumps: tuple[Jump, ...]
    conicities: tuple[Conicity, ...]


def rolling_radius_difference_mm(placed: PlacedWheelset) -> float:
    """Radius of the left wheel at its first touch point minus that of the right one, positive towards the left."""
    left, right = (float(side.wheel.radius(side.first.wheel_u)) for side in (placed.left, placed.right))
    return left - right


def contact_functions(wheelset: Wheelset, shifts_mm: Sequence[float], yaw_rad: float = 0.0) -> ContactFunctions:
    """Set a wheelset on its rails at many shifts, with the roll at which both wheels touch.

    Parameters
    ----------
    shifts_mm
        Shifts of the table; jumps are looked for between them, and conicities need none of them.
    """
    positions = _positions(wheelset, shifts_mm, yaw_rad)
    centred = wheelset.stand(0.0, yaw_rad)
    height = float("nan") if isinstance(centred, str) else centred.left.axle_mm
    possible = [shift for shift, placed in positions.items() if not isinstance(placed, str)]
    if not possible:
        return ContactFunctions(
            symmetric=wheelset.symmetric, centred_height_mm=height, positions=positions, jumps=(), conicities=()
        )
    low, high = min(possible), max(possible)
    rolled, unrolled = (_Line(wheelset, yaw_rad, rolls=rolls) for rolls in (True, False))
    jumps = rolled.jumps(low, high)
    end = min(-low, high)
    # their shifts are nodes of the integrals
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


def _positions(wheelset: Wheelset, shifts_mm: Sequence[float], yaw_rad: float) -> dict[float, PlacedWheelset | str]:
    positions: dict[float, PlacedWheelset | str] = {}
    guess = 0.0
    # from the middle outwards on either side, each from the roll before it
    for shift in sorted(shifts_mm, key=lambda shift: (shift < 0.0, abs(shift))):
        mirrored = positions.get(-shift)
        if isinstance(mirrored, PlacedWheelset) and wheelset.symmetric and yaw_rad == 0.0:
            positions[shift] = _mirrored(mirrored)
            continue
        placed = wheelset.at(shift, yaw_rad, guess_rad=guess)
        guess = 0.0 if isinstance(placed, str) else placed.roll_rad
        positions[shift] = placed
    return {shift: positions[shift] for shift in sorted(positions)}


def _mirrored(placed: PlacedWheelset) -> PlacedWheelset:
    """The mirror image of a symmetric wheelset that is not yawed."""
    return PlacedWheelset(
        shift_mm=-placed.shift_mm,
        yaw_rad=placed.yaw_rad,
        roll_rad=-placed.roll_rad,
        axle_height_mm=placed.axle_height_mm,
        left=placed.right,
        right=placed.left,
    )


class _Line:
    """First touch points of both wheels over the shift, each shift found once; with the roll of the wheelset or none.

    Those of a symmetric wheelset that is not yawed are mirror images.
    """

    def __init__(self, wheelset: Wheelset, yaw_rad: float, *, rolls: bool) -> None:
        self._wheelset, self._yaw, self._rolls = wheelset, yaw_rad, rolls
        self._mirrors = wheelset.symmetric and yaw_rad == 0.0
        self._known: dict[float, tuple[Standing, Standing] | None] = {}
        self._guess = 0.0

    def jumps(self, low: float, high: float) -> tuple[Jump, ...]:
        """Jumps of both wheels' first touch points between two shifts."""
        sides: tuple[TrackSide, TrackSide] = ("left", "right")
        found = (self._jump(side, a, b) for a, b in pairwise(_line(low, high)) for side in sides)
        return tuple(jump for jump in found if jump is not None)

    def conicity(self, amplitude: float) -> float:
        """Equivalent conicity at an amplitude (mm)."""
        # more of them about jumps
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
        """A jump between two shifts, by halving them as long as the touch point is at places far apart at both."""
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
        found = self._standings(shift)
        return float("nan") if found is None else found[0 if side == "left" else 1].y_mm

    def _radius_difference(self, shift: float) -> float:
        found = self._standings(shift)
        return float("nan") if found is None else found[0].radius_mm - found[1].radius_mm


def _line(low: float, high: float) -> list[float]:
    """Shifts from one to another in steps of a tenth of a millimetre or a little less, the same for all lines."""
    inner = np.arange(np.ceil(low / _STEP_MM + 1e-9), np.floor(high / _STEP_MM - 1e-9) + 1.0)
    every = np.round(np.concatenate([[low], _STEP_MM * inner, [high]]), 9)
    return sorted({float(shift) for shift in every})


def harmonic_conicity(
    radius_difference_mm: Callable[[float], float], amplitude_mm: float, nodes_mm: Sequence[float] | None = None
) -> float:
    """Equivalent conicity of a rolling-radius difference by harmonic linearisation.

    Parameters
    ----------
    radius_difference_mm
        Difference (mm) over the lateral shift (mm); that of cones of the conicity g is 2 g y.
    amplitude_mm
        Of the lateral motion y = A cos(phase).
    nodes_mm
        Shifts between which the difference is taken as straight, from -A to A; every 0.1 mm if not given.

    Returns
    -------
    float
        The mean of the difference times cos(phase) over a period, over A: the conicity of cones whose wheelset has the
        same first harmonic.

    Notes
    -----
    Harmonic (quasi-) linearisation, one of the methods in use for EN 15302.
    """
    nodes = _line(-amplitude_mm, amplitude_mm) if nodes_mm is None else nodes_mm
    values = np.array([radius_difference_mm(shift) for shift in nodes])
    cosine = np.cos((np.arange(_PHASES) + 0.5) * 2.0 * np.pi / _PHASES)
    return float(np.mean(np.interp(amplitude_mm * cosine, nodes, values) * cosine) / amplitude_mm)
