"""Newton's method with a Jacobian that Broyden's updates adapt to the residual."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

import numpy as np

from fecontact.arrays import Floats
from fecontact.features.curves.normal import OutOfReachError

_MAX_STEP_TRIALS = 4
# Number of stalls that end the search. A stall is an iteration whose residual is above this fraction of the smallest
# residual before it. Between the requested curvatures of a path, where a smaller step is possible, the first stall ends
# the search.
MAX_STALLS, _STALL_RATIO = 5, 0.7
# A Jacobian from another state is good enough if a step reduces the residual to less than this fraction.
_FAST_DECREASE = 0.3
# Largest change of a position in an iteration (mm and mrad), and of a slip (thousandths). Beyond a slip of about 3 the
# whole patch slips and the force hardly changes with the slip, so that a step by the Jacobian has no bound.
_MAX_POSITION_STEP, _MAX_SLIP_STEP = 0.6, 3.0


class Evaluation(Protocol):
    """Result of an evaluation at a state."""

    @property
    def residual_N(self) -> Floats:
        """Residual (n,) that must vanish."""


_Evaluation = TypeVar("_Evaluation", bound=Evaluation)


def largest_magnitude(values: Floats) -> float:
    """Largest absolute value of an array.

    Parameters
    ----------
    values
        An array that is not empty.

    Returns
    -------
    float
        The magnitude, in the unit of the values.
    """
    return float(np.abs(values).max())


def estimate_jacobian(function: Callable[[Floats], Floats], state: Floats, step: float) -> Floats:
    """Estimate the Jacobian (m, n) of a function by forward differences.

    Parameters
    ----------
    function
        Function from a state (n,) to values (m,).
    state : ndarray of shape (n,)
        State at which the Jacobian is estimated.
    step
        Change of each component of the state.

    Returns
    -------
    array (m, n)
        Derivatives of the values.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.features.curves.newton import estimate_jacobian
    >>> estimate_jacobian(lambda state: state**2, np.array([1.0, 3.0]), 1e-6).round(3).tolist()
    [[2.0, 0.0], [0.0, 6.0]]
    """
    value = function(state)
    return np.stack([(function(state + step * unit) - value) / step for unit in np.eye(state.size)], axis=1)


def solve_newton(
    value_at: Callable[[Floats], _Evaluation],
    jacobian_at: Callable[[Floats], Floats],
    start: Floats,
    *,
    wanted_N: float,
    most: int,
    slip_indices: Sequence[int] = (),
    slopes: Floats | None = None,
    max_distance: float = math.inf,
    stalls: int = MAX_STALLS,
) -> tuple[Floats, _Evaluation, Floats | None]:
    """Search a root by Newton's method from a start (n,).

    Steps are bounded, and halved if they increase the residual. A step to a state that is out of reach has failed too.

    Parameters
    ----------
    value_at
        Evaluation at a state (n,).
    jacobian_at
        Jacobian (n, n) at a state.
    start : ndarray of shape (n,)
        First state.
    wanted_N
        Tolerance: the search ends if all components of the residual are below it.
    most
        Largest number of iterations.
    slip_indices
        Components of the state that are slips of rotation, not positions.
    slopes
        Jacobian (n, n) from a state nearby. The method updates it by Broyden's rank-one updates (1965) as long as steps
        reduce the residual fast enough, and evaluates it again if they do not.
    max_distance
        The search is given up if a position is at least this far from its start (mm and mrad).
    stalls
        The search is given up after this number of successive iterations that do not reduce the residual well below the
        smallest residual before them.

    Returns
    -------
    state (n,)
        Last state.
    evaluation
        Evaluation at this state.
    jacobian
        Jacobian (n, n) near this state; None if there is none.

    Raises
    ------
    OutOfReachError
        If the start is out of reach.

    Notes
    -----
    Sources: Newton's method, and Broyden (1965) for the updates. Range of validity: starts near a root of a residual
    that is smooth between the start and the root.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> import numpy as np
    >>> from fecontact.features.curves.newton import solve_newton
    >>> state, _, _ = solve_newton(
    ...     lambda x: SimpleNamespace(residual_N=x**2 - 2.0),
    ...     lambda x: np.diag(2.0 * x),
    ...     np.array([1.0]),
    ...     wanted_N=1e-12,
    ...     most=20,
    ... )
    >>> round(float(state[0]), 6)
    1.414214
    """
    position_indices = np.delete(np.arange(start.size), list(slip_indices))
    state, current, stall_count, smallest, iterations = start, value_at(start), 0, np.inf, 0
    while iterations < most and stall_count < stalls:
        if (
            largest_magnitude(current.residual_N) < wanted_N
            or largest_magnitude((state - start)[position_indices]) >= max_distance
        ):
            break
        iterations += 1
        size, is_fresh = float(np.linalg.norm(current.residual_N)), slopes is None
        try:
            slopes = jacobian_at(state) if slopes is None else slopes
            step = np.asarray(np.linalg.solve(slopes, -current.residual_N))
        except (OutOfReachError, np.linalg.LinAlgError):
            slopes = None
            if is_fresh:
                break
            continue
        reduction = max(
            1.0,
            largest_magnitude(step[position_indices]) / _MAX_POSITION_STEP,
            *np.abs(step[list(slip_indices)]) / _MAX_SLIP_STEP,
        )
        step = step / reduction
        accepted = _damp_step(value_at, state, step, size, _MAX_STEP_TRIALS if is_fresh else 1)
        if accepted is None:
            slopes = None
            if is_fresh:
                break
            continue
        factor, trial = accepted
        trial_size = float(np.linalg.norm(trial.residual_N))
        if not is_fresh and trial_size > _FAST_DECREASE * size:
            # go on from the better of both states, and evaluate the Jacobian there
            state, current, slopes = (
                (state + factor * step, trial, None) if trial_size < size else (state, current, None)
            )
            continue
        change = trial.residual_N - current.residual_N - factor * (slopes @ step)
        slopes = slopes + np.outer(change, step) / (factor * float(step @ step))
        state, current = state + factor * step, trial
        if trial_size > _FAST_DECREASE * size:
            slopes = None
        stall_count, smallest = (stall_count + 1, smallest) if trial_size > _STALL_RATIO * smallest else (0, trial_size)
    return state, current, slopes


def _damp_step(
    value_at: Callable[[Floats], _Evaluation], state: Floats, step: Floats, size: float, trial_count: int
) -> tuple[float, _Evaluation] | None:
    """Halve a step until it reduces the residual enough.

    Returns
    -------
    tuple or None
        Factor on the step, and the evaluation there: the first factor that reduces the residual enough, or else the
        factor with the smallest residual. None if all factors lead out of reach.
    """
    trials: list[tuple[float, float, _Evaluation]] = []
    for factor in map(float, 0.5 ** np.arange(trial_count)):
        try:
            trial = value_at(state + factor * step)
        except OutOfReachError:
            continue
        trials.append((float(np.linalg.norm(trial.residual_N)), factor, trial))
        if trials[-1][0] < (1.0 - 0.25 * factor) * size:
            break
    return min(trials, key=lambda candidate: candidate[0])[1:] if trials else None
