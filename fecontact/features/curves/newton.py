"""Newton's method with slopes that follow the residual."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

import numpy as np

from fecontact.arrays import Floats
from fecontact.features.curves.normal import OutOfReach

_HALVINGS = 4
# So many iterations that do not bring what is left over below this part of the least before end the search; between
# asked places, where a smaller step is at hand, the first.
STALLS, _STALLED = 5, 0.7
# Slopes from elsewhere are good as long as a step leaves less than this part over.
_WELL_DOWN = 0.3
# Largest change of a position in an iteration, in mm and mrad, and of a slip, in thousandths: beyond about 3 all of a
# patch slips, the force hardly changes any more, and a step by its slope has no bound.
_LONGEST_STEP, _LARGEST_SLIP_STEP = 0.6, 3.0


class LeftOver(Protocol):
    """What is evaluated at a state."""

    @property
    def residual_N(self) -> Floats:
        """What must vanish (n,)."""


_Value = TypeVar("_Value", bound=LeftOver)


def largest(values: Floats) -> float:
    """Largest absolute value."""
    return float(np.abs(values).max())


def differences(f: Callable[[Floats], Floats], at: Floats, step: float) -> Floats:
    """Slopes (m, n) of a function."""
    here = f(at)
    return np.stack([(f(at + step * unit) - here) / step for unit in np.eye(at.size)], axis=1)


def newton(
    value_at: Callable[[Floats], _Value],
    slopes_at: Callable[[Floats], Floats],
    start: Floats,
    *,
    wanted_N: float,
    most: int,
    rates: Sequence[int] = (),
    slopes: Floats | None = None,
    near: float = math.inf,
    stalls: int = STALLS,
) -> tuple[Floats, _Value, Floats | None]:
    """Newton's method from a start (n,): the last state, what is there, and slopes (n, n) near it if there are any.

    Steps are bounded, and halved if they make things worse. A step to a state that is out of reach has failed too.

    Parameters
    ----------
    wanted_N
        Below this in all components the search ends.
    most
        Iterations.
    rates
        Which components are slips of rotation, and no positions.
    slopes
        A Jacobian (n, n) from nearby. It follows by Broyden's rank-one updates (1965) as long as steps bring what is
        left over well down, and is taken anew where they do not.
    near
        The search is given up where a position is so far from its start.
    stalls
        And after so many iterations that do not bring what is left over well below the least before.

    Raises
    ------
    OutOfReach
        If the start is out of reach.
    """
    places = np.delete(np.arange(start.size), list(rates))
    state, here, stalled, least, iterations = start, value_at(start), 0, np.inf, 0
    while iterations < most and stalled < stalls:
        if largest(here.residual_N) < wanted_N or largest((state - start)[places]) >= near:
            break
        iterations += 1
        size, fresh = float(np.linalg.norm(here.residual_N)), slopes is None
        try:
            slopes = slopes_at(state) if slopes is None else slopes
            step = np.asarray(np.linalg.solve(slopes, -here.residual_N))
        except (OutOfReach, np.linalg.LinAlgError):
            slopes = None
            if fresh:
                break
            continue
        too_long = max(1.0, largest(step[places]) / _LONGEST_STEP, *np.abs(step[list(rates)]) / _LARGEST_SLIP_STEP)
        step = step / too_long
        damped = _damped(value_at, state, step, size, _HALVINGS if fresh else 1)
        if damped is None:
            slopes = None
            if fresh:
                break
            continue
        part, trial = damped
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
    return state, here, slopes


def _damped(
    value_at: Callable[[Floats], _Value], state: Floats, step: Floats, size: float, parts: int
) -> tuple[float, _Value] | None:
    """The part of a step, halved some times, that leaves enough less over, or else the best one; and the value.

    None if all parts lead out of reach.
    """
    tried: list[tuple[float, float, _Value]] = []
    for part in map(float, 0.5 ** np.arange(parts)):
        try:
            trial = value_at(state + part * step)
        except OutOfReach:
            continue
        tried.append((float(np.linalg.norm(trial.residual_N)), part, trial))
        if tried[-1][0] < (1.0 - 0.25 * part) * size:
            break
    return min(tried, key=lambda one: one[0])[1:] if tried else None
