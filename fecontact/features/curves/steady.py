"""Steady motion of a vehicle on curved track: the forces of the rails, what must vanish, and where it does.

Otero Yugat's equation of motion (Part I, eq. 15), M qdd + Cq^T lambda = Qv + Qext with the constraints C(q, t) = 0, is
taken for each body in a track frame that runs along, turned with the track. Steady motion has a constant position there
(eq. 16, whose dot on lambda is a misprint), and M qdd - Qv are the centripetal and gyroscopic terms (`without_rails`).
Qext are weight, suspension (`_external`) and the forces of the rails (`wheel_force`). The constraints are the rigid
wheelset and the given speed; the force lambda of the latter is the pull that the curve costs (`Balance.pull_N`).
Projected on the five directions that are left to each wheelset, and on three of a frame, nothing but algebra remains.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.features.curves.balance import FRAME_SIZE, MILLI, WHEELSET_SIZE, Balance, Line, balance, jacobian
from fecontact.features.curves.model import Vehicle
from fecontact.features.curves.newton import STALLS, largest, newton
from fecontact.features.curves.normal import OutOfReach, standing

# --- Equilibria of steady motion at one curvature, and the path of them from straight track on.

Status = Literal["equilibrium", "no equilibrium"]

TOLERANCE_N = 1e-4
"""Of forces, and of moments at an arm of a metre: a billionth of an axle load."""
# What iterations strive for; theories that search in themselves do not come so far.
_WANTED_N, _ITERATIONS = 1e-6, 30
# The same between asked places on a path.
_BETWEEN_N, _FEW = 1.0, 12
# Curvature (1/mm) of the first step from straight track, growth of steps, and the smallest part of a curvature.
_FIRST_STEP, _GROWTH, _SMALLEST_STEP = 5e-8, 2.0, 1e-3
# Two places on the path have a direction if they are farther apart than this part of their curvature.
_APART = 0.02
# Farther (mm, mrad) from where the path leads an equilibrium is taken for one of another path; and beyond a place where
# none was met, over which a path may end and another one begin.
_ON_THE_PATH, _BEYOND_A_GAP = 0.5, 0.1
_STARTS_MM = (0.0, 4.5, -4.5)
BASE_MM = 1500.0
"""Distance of the contact circles, over which cant is measured."""
PRESSED_MM = 0.1
"""How deep wheels are pressed into the rails to begin with."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Equilibrium:
    """State (n,) of steady motion, or the best that was found.

    Attributes
    ----------
    balance
        None if the forces of the rails could not be computed at the start, so that there is no better state.
    slopes (n, n)
        Of what is left over, near the state; None where they were not to be had.
    moved
        How far (mm, mrad) from its start it lies.
    notes
        From how many starts none was found; and contacts that were not solved.
    path_ends_per_mm
        Curvatures at which paths end before it, the one from straight track first; none where it is on that one.
    """

    status: Status
    line: Line
    state: Floats
    balance: Balance | None
    slopes: Floats | None
    moved: float
    notes: tuple[str, ...] = ()
    path_ends_per_mm: tuple[float, ...] = ()

    @property
    def left_over_N(self) -> float:
        """Largest component that is left over; NaN without a balance."""
        return math.nan if self.balance is None else largest(self.balance.residual_N)


def solve_at(
    start: Floats, vehicle: Vehicle, line: Line, *, slopes: Floats | None = None, between: bool = False
) -> Equilibrium:
    """The equilibrium from a start (n,).

    `slopes` (n, n) is a Jacobian from nearby. What is only `between` others on a path need not be met so well, and is
    given up where it is not near its start.
    """
    slips = [WHEELSET_SIZE * k + 4 for k in range(vehicle.wheelsets)]
    try:
        state, found, slopes = newton(
            lambda state: balance(state, vehicle, line),
            lambda state: jacobian(state, vehicle, line),
            start,
            wanted_N=_BETWEEN_N if between else _WANTED_N,
            most=_FEW if between else _ITERATIONS,
            rates=slips,
            slopes=slopes,
            near=_ON_THE_PATH if between else math.inf,
            stalls=1 if between else STALLS,
        )
    except OutOfReach as error:
        return Equilibrium(
            status="no equilibrium",
            line=line,
            state=start,
            balance=None,
            slopes=None,
            moved=0.0,
            notes=(str(error),),
        )
    balanced = largest(found.residual_N) < (_BETWEEN_N if between else TOLERANCE_N) and not found.problems
    return Equilibrium(
        status="equilibrium" if balanced else "no equilibrium",
        line=line,
        state=state,
        balance=found,
        slopes=slopes,
        moved=largest(np.delete(state - start, slips)),
        notes=found.problems,
    )


def straight_start(vehicle: Vehicle, line: Line, shifts_mm: Sequence[float] = (0.0, 0.0)) -> Floats:
    """A state to begin with: wheelsets without roll and yaw at some shifts, pressed into the rails.

    They roll without slip on the mean radius at the rigid wheels' first touch points.
    """
    both = ((line.left, 1.0), (line.right, -1.0))
    size = WHEELSET_SIZE * vehicle.wheelsets + (FRAME_SIZE if vehicle.bogie is not None else 0)
    state = np.zeros(size)
    for k in range(vehicle.wheelsets):
        stands = [standing(surfaces.pair, sign * shifts_mm[k]) for surfaces, sign in both]
        left, right = (float(stand.wheel.centre_mm[2]) for stand in stands)
        rolling = sum(float(stand.wheel.radius(stand.first.wheel_u)) for stand in stands)
        tape_circles = sum(stand.wheel.rolling_radius_mm for stand in stands)
        state[WHEELSET_SIZE * k : WHEELSET_SIZE * (k + 1)] = (
            shifts_mm[k],
            0.5 * (left + right) - PRESSED_MM,
            # the higher wheel lifts its side
            1e3 * (left - right) / BASE_MM,
            0.0,
            (tape_circles / rolling - 1.0) / MILLI,
        )
    return state


def path(vehicle: Vehicle, lines: Callable[[float], Line], curvatures_per_mm: Sequence[float]) -> Iterator[Equilibrium]:
    """Equilibria at curvatures of one sign, found one after the other along one path from straight track on.

    Parameters
    ----------
    lines
        Track and running conditions at a curvature (1/mm).
    curvatures_per_mm
        The widest first.

    Notes
    -----
    Each step starts where the straight line through the two equilibria before it leads, and is halved where Newton's
    method does not end, or ends too far from there. Where the smallest step fails the path has a fold, or a contact has
    vanished under load: the curvature is told, and the next equilibrium is looked for from several starts. What is
    found so need not be all, and a gap over which the path goes on by less than 0.1 mm is not seen.
    """
    yield from map(_Path(vehicle, lines).to, curvatures_per_mm)


class _Path:
    """The last equilibria of a path, from the straight on, and where it has broken."""

    def __init__(self, vehicle: Vehicle, lines: Callable[[float], Line]) -> None:
        self._vehicle, self._lines = vehicle, lines
        line = lines(0.0)
        self._known = [solve_at(straight_start(vehicle, line), vehicle, line)]
        self._step = _FIRST_STEP
        self._broken = self._known[0].status != "equilibrium"
        self._ends = [0.0] if self._broken else []
        self._missed = math.inf

    def to(self, curvature: float) -> Equilibrium:
        """The equilibrium at a curvature beyond those before."""
        sign = -1.0 if curvature < 0.0 else 1.0
        while not self._broken and abs(self._here) < abs(curvature):
            self._forward(curvature, sign)
        last = self._known[-1]
        if self._broken:
            one = self._beyond(curvature)
        elif self._here == curvature:
            one = last
        else:
            one = solve_at(last.state, self._vehicle, self._lines(curvature))
        return replace(one, path_ends_per_mm=tuple(self._ends))

    @property
    def _here(self) -> float:
        return self._known[-1].line.curvature_per_mm

    def _forward(self, curvature: float, sign: float) -> None:
        """One step towards a curvature, or the note that there is none."""
        step = min(self._step, abs(curvature) - abs(self._here))
        there = curvature if step == abs(curvature) - abs(self._here) else self._here + sign * step
        start, slopes = self._predicted(there), self._known[-1].slopes
        one = solve_at(start, self._vehicle, self._lines(there), slopes=slopes, between=there != curvature)
        if one.status == "equilibrium" and one.moved < (_ON_THE_PATH if abs(there) < self._missed else _BEYOND_A_GAP):
            # a direction is not taken from two places that are nearly one
            before = self._known[-1] if step > _APART * abs(self._here) else self._known[0]
            self._known = [before, one]
            self._step = _GROWTH * max(step, _FIRST_STEP)
            self._missed = self._missed if abs(there) < self._missed else math.inf
            return
        self._missed = min(self._missed, abs(there))
        if step < max(_SMALLEST_STEP * abs(self._here), 1e-3 * _FIRST_STEP):
            self._broken = True
            self._ends.append(there)
        else:
            self._step = 0.5 * step

    def _predicted(self, curvature: float) -> Floats:
        if len(self._known) == 1:
            return self._known[0].state
        (first, second) = self._known
        part = (curvature - second.line.curvature_per_mm) / (second.line.curvature_per_mm - first.line.curvature_per_mm)
        return second.state + part * (second.state - first.state)

    def _beyond(self, curvature: float) -> Equilibrium:
        """An equilibrium beyond the end of the path from several starts, with what is to be said of it."""
        line, vehicle = self._lines(curvature), self._vehicle
        tried: list[Equilibrium] = []
        for start in self._starts(line):
            one = solve_at(start, vehicle, line)
            if one.status == "equilibrium":
                # from here on the path is followed again
                self._known, self._broken, self._step, self._missed = [one], False, _FIRST_STEP, math.inf
                return one
            tried.append(one)
        best = min(tried, key=lambda one: math.inf if one.balance is None else one.left_over_N)
        left = f"no equilibrium was found from {len(tried)} starts"
        left += "" if best.balance is None else f": {best.left_over_N:.0f} N left"
        return replace(best, notes=(left, *best.notes))

    def _starts(self, line: Line) -> Iterator[Floats]:
        yield self._known[-1].state
        for shifts in itertools.product(_STARTS_MM, repeat=self._vehicle.wheelsets):
            # narrow clearances do not have the shifted ones
            with suppress(InputError):
                yield straight_start(self._vehicle, line, (*shifts, 0.0))
