"""Equilibria of steady motion: Newton's method at one curvature, and the path of them from straight track on."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.vehicle.model import Vehicle
from fecontact.vehicle.steady import FRAME_SIZE, WHEELSET_SIZE, Balance, Line, balance, jacobian
from fecontact.vehicle.surfaces import standing

Floats = NDArray[np.float64]
Status = Literal["equilibrium", "no equilibrium"]

TOLERANCE_N = 1e-4
"""Of forces, and of moments at an arm of a metre: a billionth of an axle load."""
# What iterations strive for; theories that search in themselves do not come so far.
_WANTED_N = 1e-6
_ITERATIONS, _HALVINGS = 30, 4
# The same between asked places on a path.
_BETWEEN_N, _FEW = 1.0, 12
# So many iterations that do not bring what is left over below this part of the least before end the search.
_STALLS, _STALLED = 5, 0.7
# Slopes from elsewhere are good as long as a step leaves less than this part over.
_WELL_DOWN = 0.3
# Largest change of a state in an iteration, in mm and mrad.
_LONGEST_STEP = 0.6
# Curvature (1/mm) of the first step from straight track, growth of steps, and the smallest part of a curvature.
_FIRST_STEP, _GROWTH, _SMALLEST_STEP = 5e-8, 2.0, 1e-3
# Two places on the path have a direction if they are farther apart than this part of their curvature.
_APART = 0.02
# Farther (mm, mrad) from where the path leads an equilibrium is taken for one of another path.
_ON_THE_PATH = 0.5
_STARTS_MM = (0.0, 4.5, -4.5)
# Distance of the contacts, near enough to begin with, and how deep they are pressed into the rails.
_BASE_MM = 1500.0
_PRESSED_MM = 0.1


@dataclass(frozen=True, kw_only=True, eq=False)
class Equilibrium:
    """State of steady motion, or the best that was found.

    Attributes
    ----------
    state (n,)
        As in `vehicle.steady`.
    slopes (n, n)
        Of what is left over, near the state; None where they were not to be had.
    iterations
        Of Newton's method.
    notes
        What happened on the way: folds, jumps to another branch; and contacts that were not solved.
    """

    status: Status
    line: Line
    state: Floats
    balance: Balance
    slopes: Floats | None
    iterations: int
    notes: tuple[str, ...] = ()

    @property
    def left_over_N(self) -> float:
        """Largest component that is left over."""
        return float(np.abs(self.balance.residual_N).max())


def solve_at(
    start: Floats, vehicle: Vehicle, line: Line, *, slopes: Floats | None = None, between: bool = False
) -> Equilibrium:
    """Newton's method from a start (n,); steps are bounded, and halved where they make things worse.

    `slopes` (n, n) is a Jacobian from nearby. It follows by Broyden's rank-one updates (1965) as long as steps bring
    what is left over well down, and is taken anew by differences where they do not. What is only `between` others on
    a path need not be met so well, and is given up where it is not near its start.
    """
    wanted, tolerance, most = (_BETWEEN_N, _BETWEEN_N, _FEW) if between else (_WANTED_N, TOLERANCE_N, _ITERATIONS)
    state, here, stalled, least, iterations = start, balance(start, vehicle, line), 0, np.inf, 0
    while iterations < most and stalled < _STALLS:
        if float(np.abs(here.residual_N).max()) < wanted or (between and not _near(state, start, vehicle)):
            break
        iterations += 1
        size, fresh = float(np.linalg.norm(here.residual_N)), slopes is None
        slopes = jacobian(state, vehicle, line) if slopes is None else slopes
        step = _step(slopes, here.residual_N, vehicle)
        if step is None:
            if fresh:
                break
            slopes = None
            continue
        part, trial = _damped(lambda place: balance(place, vehicle, line), state, step, size, _HALVINGS if fresh else 1)
        found = float(np.linalg.norm(trial.residual_N))
        if not fresh and found > _WELL_DOWN * size:
            # from the better of both places with slopes of its own
            state, here, slopes = (state + part * step, trial, None) if found < size else (state, here, None)
            continue
        change = trial.residual_N - here.residual_N - part * (slopes @ step)
        slopes = slopes + np.outer(change, step) / (part * float(step @ step))
        state, here = state + part * step, trial
        if found > _WELL_DOWN * size:
            slopes = None
        stalled, least = (stalled + 1, least) if found > _STALLED * least else (0, found)
    balanced = float(np.abs(here.residual_N).max()) < tolerance and not here.problems
    return Equilibrium(
        status="equilibrium" if balanced else "no equilibrium",
        line=line,
        state=state,
        balance=here,
        slopes=slopes,
        iterations=iterations,
        notes=here.problems,
    )


def _near(state: Floats, start: Floats, vehicle: Vehicle) -> bool:
    """Whether a state is on the path that leads to a start."""
    return float(np.abs(_positions(state - start, vehicle)).max()) < _ON_THE_PATH


def _step(slopes: Floats, residual: Floats, vehicle: Vehicle) -> Floats | None:
    """Newton's step, bounded; None where the slopes are singular."""
    try:
        step = np.asarray(np.linalg.solve(slopes, -residual))
    except np.linalg.LinAlgError:
        return None
    return np.asarray(step * min(1.0, _LONGEST_STEP / float(np.abs(_positions(step, vehicle)).max())))


def _damped(
    balance_at: Callable[[Floats], Balance], state: Floats, step: Floats, size: float, parts: int
) -> tuple[float, Balance]:
    """The part of a step, halved some times, that leaves enough less over, or else the best one; and the balance."""
    best: tuple[float, float, Balance] | None = None
    for part in 0.5 ** np.arange(parts):
        trial = balance_at(state + part * step)
        found = float(np.linalg.norm(trial.residual_N))
        if best is None or found < best[0]:
            best = (found, float(part), trial)
        if found < (1.0 - 0.25 * part) * size:
            break
    assert best is not None
    return best[1], best[2]


def _positions(step: Floats, vehicle: Vehicle) -> Floats:
    """What of a step is a position: all but the slips of rotation."""
    slips = [WHEELSET_SIZE * k + 4 for k in range(vehicle.wheelsets)]
    return np.delete(step, slips)


def straight_start(vehicle: Vehicle, line: Line, shifts_mm: Sequence[float] = (0.0, 0.0)) -> Floats:
    """A state to begin with: wheelsets without roll and yaw at some shifts, pressed into the rails."""
    both = ((line.left, 1.0), (line.right, -1.0))
    size = WHEELSET_SIZE * vehicle.wheelsets + (FRAME_SIZE if vehicle.bogie is not None else 0)
    state = np.zeros(size)
    for k in range(vehicle.wheelsets):
        stands = [float(standing(surfaces.pair, sign * shifts_mm[k]).wheel.centre_mm[2]) for surfaces, sign in both]
        state[WHEELSET_SIZE * k : WHEELSET_SIZE * k + 3] = (
            shifts_mm[k],
            0.5 * sum(stands) - _PRESSED_MM,
            # the higher wheel lifts its side
            1e3 * (stands[0] - stands[1]) / _BASE_MM,
        )
    return state


def path(vehicle: Vehicle, lines: Callable[[float], Line], curvatures_per_mm: Sequence[float]) -> list[Equilibrium]:
    """Equilibria at curvatures of one sign, found along one path from straight track on.

    Parameters
    ----------
    lines
        Track and running conditions at a curvature (1/mm).
    curvatures_per_mm
        In any order; results are in theirs.

    Notes
    -----
    Each step starts where the straight line through the two equilibria before it leads, and is halved where Newton's
    method does not end. Where the smallest step fails the path has a fold, or a contact has vanished under load: the
    radius is told, and the next equilibrium is looked for from several starts. What is found so need not be all.
    """
    found: dict[float, Equilibrium] = {}
    walk = _Path(vehicle, lines)
    for curvature in sorted(set(curvatures_per_mm), key=abs):
        found[curvature] = walk.to(curvature)
    return [found[curvature] for curvature in curvatures_per_mm]


class _Path:
    """The last equilibria of a path, from the straight on, and where it has broken."""

    def __init__(self, vehicle: Vehicle, lines: Callable[[float], Line]) -> None:
        self._vehicle, self._lines = vehicle, lines
        line = lines(0.0)
        self._known = [solve_at(straight_start(vehicle, line), vehicle, line)]
        self._step = _FIRST_STEP
        self._broken_at: float | None = None
        if self._known[0].status != "equilibrium":
            self._broken_at = 0.0

    def to(self, curvature: float) -> Equilibrium:
        """The equilibrium at a curvature beyond those before."""
        sign = -1.0 if curvature < 0.0 else 1.0
        while self._broken_at is None and abs(self._here) < abs(curvature):
            self._forward(curvature, sign)
        if self._broken_at is None:
            return (
                self._known[-1]
                if self._here == curvature
                else solve_at(self._known[-1].state, self._vehicle, self._lines(curvature))
            )
        return self._beyond(curvature)

    @property
    def _here(self) -> float:
        return self._known[-1].line.curvature_per_mm

    def _forward(self, curvature: float, sign: float) -> None:
        """One step towards a curvature, or the note that there is none."""
        step = min(self._step, abs(curvature) - abs(self._here))
        there = curvature if step == abs(curvature) - abs(self._here) else self._here + sign * step
        start = self._predicted(there)
        one = solve_at(
            start, self._vehicle, self._lines(there), slopes=self._known[-1].slopes, between=there != curvature
        )
        if one.status == "equilibrium" and _near(one.state, start, self._vehicle):
            # a direction is not taken from two places that are nearly one
            before = self._known[-1] if step > _APART * abs(self._here) else self._known[0]
            self._known = [before, one]
            self._step = _GROWTH * max(step, _FIRST_STEP)
        elif step < max(_SMALLEST_STEP * abs(self._here), 1e-3 * _FIRST_STEP):
            self._broken_at = there
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
        assert self._broken_at is not None
        end = f"the path from straight track ends at R {_radius_m(self._broken_at)} m"
        line, vehicle = self._lines(curvature), self._vehicle
        tried: list[Equilibrium] = []
        for start in self._starts(line):
            one = solve_at(start, vehicle, line)
            if one.status == "equilibrium":
                # from here on the path is followed again
                self._known, self._broken_at, self._step = [one], None, _FIRST_STEP
                return replace(one, notes=(f"{end}; this equilibrium is another one beyond it",))
            tried.append(one)
        best = min(tried, key=lambda one: one.left_over_N)
        left = f"no equilibrium was found from {len(tried)} starts: {best.left_over_N:.0f} N left"
        return replace(best, notes=(end, left, *best.notes))

    def _starts(self, line: Line) -> Iterator[Floats]:
        yield self._known[-1].state
        for shifts in itertools.product(_STARTS_MM, repeat=self._vehicle.wheelsets):
            yield straight_start(self._vehicle, line, (*shifts, 0.0))


def _radius_m(curvature_per_mm: float) -> str:
    return "infinite" if curvature_per_mm == 0.0 else f"{1e-3 / abs(curvature_per_mm):.0f}"
