"""Steady motion of a vehicle on curved track.

Otero Yugat's equation of motion (Part I, eq. 15), M qdd + Cq^T lambda = Qv + Qext with the constraints C(q, t) = 0, is
written for each body in a track frame that moves along and is turned with the track. In steady motion the position in
this frame is constant (eq. 16, whose dot on lambda is a misprint), and M qdd - Qv are the centripetal and gyroscopic
terms (`compute_vehicle_residual`). Qext are weight, suspension (`balance._compute_vehicle_forces`) and the forces of
the rails (`compute_wheel_force`). The constraints are the rigid wheelset and the given speed. The force lambda of the
given speed is the pull that the curve costs (`Balance.pull_N`). The equation is projected on the five directions that
are left to each wheelset and on three directions of a frame, so that only algebraic equations remain.
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
from fecontact.features.curves.balance import (
    FRAME_SIZE,
    MILLI,
    WHEELSET_SIZE,
    Balance,
    TrackConditions,
    compute_balance,
    compute_jacobian,
)
from fecontact.features.curves.model import Vehicle
from fecontact.features.curves.newton import MAX_STALLS, largest_magnitude, solve_newton
from fecontact.features.curves.normal import OutOfReachError, place_wheel

# --- Equilibria of steady motion at a curvature, and the path of equilibria from straight track.

EquilibriumStatus = Literal["equilibrium", "no equilibrium"]

BALANCE_TOLERANCE_N = 1e-4
"""Tolerance of forces, and of moments at an arm of a metre: a billionth of an axle load."""
# Target of the iterations, and their largest number. Theories with an inner search do not reach the target.
_TARGET_N, _MAX_ITERATIONS = 1e-6, 30
# Tolerance and largest number of iterations between the requested curvatures of a path.
_PATH_TOLERANCE_N, _PATH_ITERATIONS = 1.0, 12
# Curvature (1/mm) of the first step from straight track, growth of the steps, and smallest step as a fraction of the
# curvature.
_FIRST_STEP, _STEP_GROWTH, _MIN_STEP_RATIO = 5e-8, 2.0, 1e-3
# Two equilibria on the path give a direction if they are farther apart than this fraction of their curvature.
_MIN_SEPARATION = 0.02
# Largest distance (mm, mrad) of an equilibrium from the predicted state: a farther equilibrium belongs to another path.
# The second value is valid beyond a curvature at which no equilibrium was found, since a path may end there and another
# path begin.
_MAX_PATH_DISTANCE, _MAX_GAP_DISTANCE = 0.5, 0.1
_START_SHIFTS_MM = (0.0, 4.5, -4.5)
CANT_BASE_MM = 1500.0
"""Distance (mm) of the contact circles, over which cant is measured."""
START_DEPTH_MM = 0.1
"""Depth (mm) of the wheels in the rails at the start of an iteration."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Equilibrium:
    """State (n,) of steady motion, or the best state if there is no equilibrium.

    Attributes
    ----------
    status
        Whether the state is an equilibrium.
    track
        Track and running conditions.
    state : ndarray of shape (n,)
        States of the wheelsets and of the frame.
    balance
        Balance at the state; None if the forces of the rails could not be computed at the start, so that there is no
        better state.
    jacobian : ndarray of shape (n, n) or None
        Jacobian of the residual near the state; None if it could not be computed.
    start_distance
        Largest distance (mm, mrad) from the start.
    notes
        Number of starts without an equilibrium, and contacts without a solution.
    path_ends_per_mm
        Curvatures at which paths end before the state, the path from straight track first; empty on this path.
    """

    status: EquilibriumStatus
    track: TrackConditions
    state: Floats
    balance: Balance | None
    jacobian: Floats | None
    start_distance: float
    notes: tuple[str, ...] = ()
    path_ends_per_mm: tuple[float, ...] = ()

    @property
    def left_over_N(self) -> float:
        """Largest component of the residual; NaN without a balance."""
        return math.nan if self.balance is None else largest_magnitude(self.balance.residual_N)


def solve_equilibrium(
    start: Floats,
    vehicle: Vehicle,
    track: TrackConditions,
    *,
    jacobian: Floats | None = None,
    intermediate: bool = False,
) -> Equilibrium:
    """Search the equilibrium from a start.

    Parameters
    ----------
    start : ndarray of shape (n,)
        First state.
    vehicle, track
        Vehicle, and track and running conditions.
    jacobian : ndarray of shape (n, n) or None
        Jacobian from a state nearby.
    intermediate
        Whether the equilibrium is only needed between others on a path. Then the tolerance is coarser, and the search
        is given up if the state is not near its start.

    Returns
    -------
    Equilibrium
        The equilibrium, or the last state with the status `no equilibrium`.
    """
    slip_indices = [WHEELSET_SIZE * index + 4 for index in range(vehicle.wheelsets)]
    try:
        state, reached, jacobian = solve_newton(
            lambda state: compute_balance(state, vehicle, track),
            lambda state: compute_jacobian(state, vehicle, track),
            start,
            wanted_N=_PATH_TOLERANCE_N if intermediate else _TARGET_N,
            most=_PATH_ITERATIONS if intermediate else _MAX_ITERATIONS,
            slip_indices=slip_indices,
            slopes=jacobian,
            max_distance=_MAX_PATH_DISTANCE if intermediate else math.inf,
            stalls=1 if intermediate else MAX_STALLS,
        )
    except OutOfReachError as error:
        return Equilibrium(
            status="no equilibrium",
            track=track,
            state=start,
            balance=None,
            jacobian=None,
            start_distance=0.0,
            notes=(str(error),),
        )
    is_balanced = (
        largest_magnitude(reached.residual_N) < (_PATH_TOLERANCE_N if intermediate else BALANCE_TOLERANCE_N)
        and not reached.problems
    )
    return Equilibrium(
        status="equilibrium" if is_balanced else "no equilibrium",
        track=track,
        state=state,
        balance=reached,
        jacobian=jacobian,
        start_distance=largest_magnitude(np.delete(state - start, slip_indices)),
        notes=reached.problems,
    )


def make_straight_start(vehicle: Vehicle, track: TrackConditions, shifts_mm: Sequence[float] = (0.0, 0.0)) -> Floats:
    """Make a start with wheelsets at given shifts, without yaw.

    The wheels are pressed into the rails, and the roll follows from the difference of their heights. They roll without
    slip on the mean radius at the first contact points of the rigid wheels.

    Parameters
    ----------
    vehicle, track
        Vehicle, and track and running conditions.
    shifts_mm
        Lateral shift of each wheelset.

    Returns
    -------
    array (n,)
        The state.

    Raises
    ------
    InputError
        If a wheel cannot stand on its rail at a shift.
    """
    sides = ((track.left, 1.0), (track.right, -1.0))
    size = WHEELSET_SIZE * vehicle.wheelsets + (FRAME_SIZE if vehicle.bogie is not None else 0)
    state = np.zeros(size)
    for index in range(vehicle.wheelsets):
        placements = [place_wheel(surfaces.pair, sign * shifts_mm[index]) for surfaces, sign in sides]
        left, right = (float(placement.wheel.centre_mm[2]) for placement in placements)
        rolling_radii = sum(float(placement.wheel.radius(placement.first.wheel_u)) for placement in placements)
        tape_circles = sum(placement.wheel.rolling_radius_mm for placement in placements)
        state[WHEELSET_SIZE * index : WHEELSET_SIZE * (index + 1)] = (
            shifts_mm[index],
            0.5 * (left + right) - START_DEPTH_MM,
            # the roll (mrad) by the difference in height: the higher wheel lifts its side
            1e3 * (left - right) / CANT_BASE_MM,
            0.0,
            (tape_circles / rolling_radii - 1.0) / MILLI,
        )
    return state


def follow_path(
    vehicle: Vehicle, track_at: Callable[[float], TrackConditions], curvatures_per_mm: Sequence[float]
) -> Iterator[Equilibrium]:
    """Follow the equilibria from straight track to curvatures of equal sign.

    Parameters
    ----------
    vehicle
        Vehicle.
    track_at
        Track and running conditions at a curvature (1/mm).
    curvatures_per_mm
        Requested curvatures, the smallest first.

    Yields
    ------
    Equilibrium
        The equilibrium at each requested curvature, or the best attempt if there is none.

    Notes
    -----
    Each step starts at the linear extrapolation of the last two equilibria. The step is halved if Newton's method does
    not converge, or converges too far from there. If the smallest step fails, then the path has a fold, or a contact
    has vanished under load. `path_ends_per_mm` then has this curvature, and the next equilibrium is searched from
    several starts. This search need not find all equilibria. A gap over which the path continues by less than 0.1 mm is
    not detected.
    """
    yield from map(_PathFollower(vehicle, track_at).solve, curvatures_per_mm)


class _PathFollower:
    """Last equilibria of a path from straight track, and the ends of paths."""

    def __init__(self, vehicle: Vehicle, track_at: Callable[[float], TrackConditions]) -> None:
        """Start a path at the equilibrium on straight track."""
        self._vehicle, self._track_at = vehicle, track_at
        track = track_at(0.0)
        self._equilibria = [solve_equilibrium(make_straight_start(vehicle, track), vehicle, track)]
        self._step = _FIRST_STEP
        self._has_ended = self._equilibria[0].status != "equilibrium"
        self._ends = [0.0] if self._has_ended else []
        self._gap_start = math.inf

    def solve(self, curvature: float) -> Equilibrium:
        """Solve the equilibrium at a curvature beyond all previous curvatures.

        Parameters
        ----------
        curvature
            Curvature in 1/mm.

        Returns
        -------
        Equilibrium
            The equilibrium, with the ends of paths before it.
        """
        sign = -1.0 if curvature < 0.0 else 1.0
        while not self._has_ended and abs(self._curvature) < abs(curvature):
            self._take_step(curvature, sign)
        last = self._equilibria[-1]
        if self._has_ended:
            equilibrium = self._solve_beyond_end(curvature)
        elif self._curvature == curvature:
            equilibrium = last
        else:
            equilibrium = solve_equilibrium(last.state, self._vehicle, self._track_at(curvature))
        return replace(equilibrium, path_ends_per_mm=tuple(self._ends))

    @property
    def _curvature(self) -> float:
        """Curvature (1/mm) of the last equilibrium."""
        return self._equilibria[-1].track.curvature_per_mm

    def _take_step(self, curvature: float, sign: float) -> None:
        """Take a step towards a curvature.

        If there is no equilibrium on the path, then the next step is half as long. After the smallest step the path has
        ended.
        """
        step = min(self._step, abs(curvature) - abs(self._curvature))
        next_curvature = curvature if step == abs(curvature) - abs(self._curvature) else self._curvature + sign * step
        start, jacobian = self._predict_state(next_curvature), self._equilibria[-1].jacobian
        equilibrium = solve_equilibrium(
            start,
            self._vehicle,
            self._track_at(next_curvature),
            jacobian=jacobian,
            intermediate=next_curvature != curvature,
        )
        if equilibrium.status == "equilibrium" and equilibrium.start_distance < (
            _MAX_PATH_DISTANCE if abs(next_curvature) < self._gap_start else _MAX_GAP_DISTANCE
        ):
            # two equilibria that are nearly equal do not give a direction
            before = self._equilibria[-1] if step > _MIN_SEPARATION * abs(self._curvature) else self._equilibria[0]
            self._equilibria = [before, equilibrium]
            self._step = _STEP_GROWTH * max(step, _FIRST_STEP)
            self._gap_start = self._gap_start if abs(next_curvature) < self._gap_start else math.inf
            return
        self._gap_start = min(self._gap_start, abs(next_curvature))
        if step < max(_MIN_STEP_RATIO * abs(self._curvature), 1e-3 * _FIRST_STEP):
            self._has_ended = True
            self._ends.append(next_curvature)
        else:
            self._step = 0.5 * step

    def _predict_state(self, curvature: float) -> Floats:
        """State at a curvature, extrapolated linearly from the last two equilibria."""
        if len(self._equilibria) == 1:
            return self._equilibria[0].state
        (before, last) = self._equilibria
        ratio = (curvature - last.track.curvature_per_mm) / (
            last.track.curvature_per_mm - before.track.curvature_per_mm
        )
        return last.state + ratio * (last.state - before.state)

    def _solve_beyond_end(self, curvature: float) -> Equilibrium:
        """Search an equilibrium beyond the end of the path from several starts.

        Returns
        -------
        Equilibrium
            The first equilibrium; or the best attempt, with notes, if there is no equilibrium.
        """
        track, vehicle = self._track_at(curvature), self._vehicle
        attempts: list[Equilibrium] = []
        for start in self._start_states(track):
            equilibrium = solve_equilibrium(start, vehicle, track)
            if equilibrium.status == "equilibrium":
                # the path is followed again from this equilibrium
                self._equilibria, self._has_ended, self._step, self._gap_start = (
                    [equilibrium],
                    False,
                    _FIRST_STEP,
                    math.inf,
                )
                return equilibrium
            attempts.append(equilibrium)
        best = min(
            attempts, key=lambda equilibrium: math.inf if equilibrium.balance is None else equilibrium.left_over_N
        )
        note = f"no equilibrium found from {len(attempts)} starting positions"
        note += "" if best.balance is None else f": smallest residual {best.left_over_N:.0f} N"
        return replace(best, notes=(note, *best.notes))

    def _start_states(self, track: TrackConditions) -> Iterator[Floats]:
        """Yield the last state of the path, then states at several shifts."""
        yield self._equilibria[-1].state
        for shifts in itertools.product(_START_SHIFTS_MM, repeat=self._vehicle.wheelsets):
            # in a narrow clearance the shifted wheelsets cannot stand
            with suppress(InputError):
                yield make_straight_start(self._vehicle, track, (*shifts, 0.0))
