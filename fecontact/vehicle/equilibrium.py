"""Equilibria of steady motion: Newton's method at one curvature, and the path of them from straight track on."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError
from fecontact.vehicle.model import Vehicle
from fecontact.vehicle.steady import FRAME_SIZE, WHEELSET_SIZE, Balance, Line, balance, jacobian

Floats = NDArray[np.float64]
Status = Literal["equilibrium", "no equilibrium"]

TOLERANCE_N = 1e-6
"""Of forces, and of moments at an arm of a metre."""
_ITERATIONS, _HALVINGS = 40, 6
# Largest change of a state in an iteration, in mm and mrad.
_LONGEST_STEP = 0.6
# Curvature (1/mm) of the first step from straight track, how much a step may grow, and the smallest part of a curvature.
_FIRST_STEP, _GROWTH, _SMALLEST_STEP = 5e-8, 2.0, 1e-3
_STARTS_MM = (0.0, 4.5, -4.5)
# Pressed into the rails by so much to begin with.
_PRESSED_MM = 0.1


@dataclass(frozen=True, kw_only=True, eq=False)
class Equilibrium:
    """State of steady motion, or the best that was found.

    Attributes
    ----------
    state (n,)
        As in `vehicle.steady`.
    iterations
        Of Newton's method, on the whole way to it.
    notes
        What happened on the way: folds, jumps to another branch.
    """

    status: Status
    line: Line
    state: Floats
    balance: Balance
    iterations: int
    notes: tuple[str, ...] = ()

    @property
    def left_over_N(self) -> float:
        """Largest component that is left over."""
        return float(np.abs(self.balance.residual_N).max())


def solve_at(start: Floats, vehicle: Vehicle, line: Line) -> Equilibrium:
    """Newton's method from a start (n,); steps are bounded, and halved where they make things worse."""
    state, here = start, balance(start, vehicle, line)
    for iteration in range(1, _ITERATIONS + 1):
        size = float(np.linalg.norm(here.residual_N))
        if float(np.abs(here.residual_N).max()) < TOLERANCE_N:
            return Equilibrium(status="equilibrium", line=line, state=state, balance=here, iterations=iteration)
        try:
            step = np.linalg.solve(jacobian(state, vehicle, line), -here.residual_N)
        except np.linalg.LinAlgError:
            break
        step = step * min(1.0, _LONGEST_STEP / float(np.abs(_positions(step, vehicle)).max()))
        best: tuple[float, Floats, Balance] | None = None
        for part in 0.5 ** np.arange(_HALVINGS):
            trial = balance(state + part * step, vehicle, line)
            found = float(np.linalg.norm(trial.residual_N))
            if best is None or found < best[0]:
                best = (found, state + part * step, trial)
            if found < (1.0 - 0.25 * part) * size:
                break
        assert best is not None
        _, state, here = best
    return Equilibrium(status="no equilibrium", line=line, state=state, balance=here, iterations=_ITERATIONS)


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
        stands = [_axle_height(surfaces.pair.placed(sign * shifts_mm[k], 0.0, 0.0)) for surfaces, sign in both]
        state[WHEELSET_SIZE * k : WHEELSET_SIZE * k + 3] = (
            shifts_mm[k],
            0.5 * sum(stands) - _PRESSED_MM,
            # the higher wheel lifts its side
            1e3 * (stands[0] - stands[1]) / 1500.0,
        )
    return state


def _axle_height(placed: object) -> float:
    if isinstance(placed, str):
        raise InputError(f"a wheel cannot stand on its rail: {placed}; check gauge, profiles and back-to-back distance")
    return float(placed.wheel.centre_mm[2])  # type: ignore[attr-defined]
