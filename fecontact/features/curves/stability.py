"""Small motions about an equilibrium on straight track: eigenvalues, critical speed, wavelength of hunting.

The equation of motion (Otero Yugat, Part I, eq. 15) is linearised about the equilibrium: the rails' forces by
differences in positions and in rates over the speed, masses and suspension as they are. The car body stays where it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.curves.balance import (
    FRAME_SIZE,
    WHEELSET_SIZE,
    Line,
    compute_rail_forces,
    links,
    sum_rail_forces,
    wheelset_states,
    without_rails,
)
from fecontact.features.curves.model import Vehicle
from fecontact.features.curves.steady import solve_at, straight_start

# Positions of a wheelset but for its slip of rotation, which is a rate.
_PLACES = 4
# Of mm and mrad, and of their rates over the speed.
_PLACE_STEP, _RATE_STEP = 1e-4, 1e-7
_SLOWEST_M_S, _FASTEST_M_S, _SPEEDS = 2.0, 250.0, 60
_SPEED_WITHIN_M_S = 0.01


@dataclass(frozen=True, kw_only=True)
class StraightTrack:
    """How a vehicle runs on straight track; of its stability in curves nothing is known.

    Attributes
    ----------
    critical_speed_km_h
        From which on an oscillation grows; None if there is none, if one grows at `slow_km_h` already, the lowest speed
        that is searched, or without an equilibrium.
    frequency_Hz, wavelength_m
        Of the least damped oscillation: of hunting, where it begins, or else at `slow_km_h`.
    slow_wavelength_m
        At `slow_km_h`, where masses count for nothing: Klingel's, of what the suspension holds together.
    problem
        Why there is nothing, or what is to be said.
    """

    theory: str
    critical_speed_km_h: float | None = None
    frequency_Hz: float | None = None
    wavelength_m: float | None = None
    slow_km_h: float = 3.6 * _SLOWEST_M_S
    slow_wavelength_m: float | None = None
    problem: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearModel:
    """A vehicle linearised about its equilibrium on straight track: what does not hang on the speed.

    Forces in N, and moments at a metre; positions in mm and mrad, as in `features.curves.steady`.

    Attributes
    ----------
    stiffness (n, n)
        Force over positions, and over slips of rotation.
    damping (n, n), of_rates (n, n)
        Force of the dampers over rates in mm/s and mrad/s, and of the rails over rates per mm of way.
    """

    vehicle: Vehicle
    stiffness: Floats
    damping: Floats
    of_rates: Floats


@dataclass(frozen=True, kw_only=True)
class Hunting:
    """The least damped oscillation at a speed: its rate of growth (1/s), frequency (Hz), and wavelength (m)."""

    speed_m_s: float
    growth_per_s: float
    frequency_Hz: float

    @property
    def wavelength_m(self) -> float:
        """Way of one period."""
        return self.speed_m_s / self.frequency_Hz if self.frequency_Hz > 0.0 else math.inf


def linear_model(vehicle: Vehicle, line: Line) -> LinearModel:
    """Linearise a vehicle about its equilibrium on straight track.

    Raises
    ------
    InputError
        If it has none there, or the track is curved.
    ConvergenceError
        If a contact beside it is not solved.
    """
    if line.curvature_per_mm != 0.0:
        raise InputError("stability is computed on straight track alone; allowed: curvature 0")
    found = solve_at(straight_start(vehicle, line), vehicle, line)
    if found.status != "equilibrium":
        why = "; ".join(found.notes) or f"{found.left_over_N:.0f} N left; check profiles"
        raise InputError(f"there is no equilibrium on straight track: {why}")
    size = found.state.size
    stiffness = _central(lambda q: without_rails(q, vehicle, line), found.state, 1e-3)
    if vehicle.bogie is not None:
        stiffness[-FRAME_SIZE, -FRAME_SIZE] -= 2e-3 * vehicle.bogie.secondary.lateral_N_per_m
    of_rates = np.zeros((size, size))
    for k, one in enumerate(wheelset_states(found.state, vehicle)):
        block = slice(WHEELSET_SIZE * k, WHEELSET_SIZE * (k + 1))
        stiffness[block, block] += _central(lambda q: _of_rails(q, line), one, _PLACE_STEP)
        of_rates[block, WHEELSET_SIZE * k : WHEELSET_SIZE * k + _PLACES] = _central(
            lambda r, q=one: _of_rails(q, line, r),  # type: ignore[misc]
            np.zeros(_PLACES),
            _RATE_STEP,
        )
    return LinearModel(vehicle=vehicle, stiffness=stiffness, damping=_dampers(vehicle, size), of_rates=of_rates)


def _of_rails(state: Floats, line: Line, rates: Floats | None = None) -> Floats:
    """Sums (5,) that rails add to a wheelset's balance, of contacts that were solved."""
    wheels = compute_rail_forces(state, line, rates)
    if problem := wheels[0].problem or wheels[1].problem:
        raise ConvergenceError(problem)
    return sum_rail_forces(wheels, state)


def _central(f: Callable[[Floats], Floats], at: Floats, step: float) -> Floats:
    return np.stack([(f(at + step * unit) - f(at - step * unit)) / (2.0 * step) for unit in np.eye(at.size)], axis=1)


def eigenvalues(model: LinearModel, speed_m_s: float) -> NDArray[np.complex128]:
    """Eigenvalues (1/s) at a speed."""
    vehicle = model.vehicle
    size = model.stiffness.shape[0]
    slips = [WHEELSET_SIZE * k + _PLACES for k in range(vehicle.wheelsets)]
    places = [k for k in range(size) if k not in slips]
    mass, gyroscopic = _masses(vehicle, size, speed_m_s)
    # rates of the position over the speed are per mm of way
    rates = model.of_rates / (1e3 * speed_m_s) + model.damping + gyroscopic
    n, m = len(places), len(slips)
    system = np.zeros((2 * n + m, 2 * n + m))
    system[:n, n : 2 * n] = np.eye(n)
    inverse = np.linalg.inv(mass)
    stiff, slow = inverse @ model.stiffness, inverse @ rates
    moved = np.concatenate([stiff[:, places], slow[:, places], stiff[:, slips]], axis=1)
    system[n : 2 * n], system[2 * n :] = moved[places], moved[slips]
    return np.asarray(np.linalg.eigvals(system))


def hunting(model: LinearModel, speed_m_s: float) -> Hunting:
    """The least damped oscillation at a speed.

    Raises
    ------
    ConvergenceError
        If no motion oscillates, as without conicity.
    """
    found = eigenvalues(model, speed_m_s)
    swinging = found[found.imag > 1e-6]
    if swinging.size == 0:
        raise ConvergenceError(f"no motion oscillates at {3.6 * speed_m_s:g} km/h")
    worst = swinging[int(np.argmax(swinging.real))]
    return Hunting(
        speed_m_s=speed_m_s, growth_per_s=float(worst.real), frequency_Hz=float(worst.imag) / (2.0 * math.pi)
    )


def straight_track(theory: str, vehicle: Vehicle, line: Line) -> StraightTrack:
    """Critical speed and wavelengths on a straight line, by a theory that `line` has; without an equilibrium, why."""
    try:
        model = linear_model(vehicle, line)
        found, slow = critical_speed_m_s(model), hunting(model, _SLOWEST_M_S)
        # at the lowest speed it is not known from which on
        critical = None if found == _SLOWEST_M_S else found
        at = slow if critical is None else hunting(model, critical)
    except (InputError, ConvergenceError) as error:
        return StraightTrack(theory=theory, problem=str(error))
    return StraightTrack(
        theory=theory,
        critical_speed_km_h=None if critical is None else 3.6 * critical,
        frequency_Hz=at.frequency_Hz,
        wavelength_m=at.wavelength_m,
        slow_wavelength_m=slow.wavelength_m,
        problem=_said_of(found),
    )


def _said_of(critical_m_s: float | None) -> str:
    if critical_m_s is None:
        return f"no oscillation grows up to {3.6 * _FASTEST_M_S:g} km/h, the highest speed searched"
    slowest = f"the critical speed is below {3.6 * _SLOWEST_M_S:g} km/h, the lowest speed searched"
    return slowest * (critical_m_s == _SLOWEST_M_S)


def critical_speed_m_s(model: LinearModel) -> float | None:
    """The lowest speed from which on an oscillation grows, 2 m/s if one grows there already; None up to 250 m/s.

    Of a model about the equilibrium: motions with amplitudes of their own may persist below it (limit cycles).
    """

    def grows(speed: float) -> bool:
        return bool(eigenvalues(model, speed).real.max() > 1e-9)

    speeds = np.linspace(_SLOWEST_M_S, _FASTEST_M_S, _SPEEDS)
    first = next((k for k, speed in enumerate(speeds) if grows(float(speed))), None)
    if not first:
        return None if first is None else float(speeds[0])
    low, high = float(speeds[first - 1]), float(speeds[first])
    while high - low > _SPEED_WITHIN_M_S:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    return 0.5 * (low + high)


def _masses(vehicle: Vehicle, size: int, speed_m_s: float) -> tuple[Floats, Floats]:
    """Mass (n, n) in N over mm/s2 and mrad/s2 (moments at a metre), and gyroscopic force over rates."""
    body = vehicle.wheelset
    mass, gyroscopic = np.zeros((size, size)), np.zeros((size, size))
    turning = body.axle_inertia_kg_m2 * speed_m_s / (1e-3 * body.rolling_radius_mm)
    # slips of rotation are thousandths of the speed over the radius
    values = (body.mass_kg, body.mass_kg, body.roll_inertia_kg_m2, body.yaw_inertia_kg_m2, turning)
    for k in range(vehicle.wheelsets):
        at = WHEELSET_SIZE * k
        mass[range(at, at + WHEELSET_SIZE), range(at, at + WHEELSET_SIZE)] = values
        gyroscopic[at + 2, at + 3], gyroscopic[at + 3, at + 2] = turning, -turning
    if vehicle.bogie is not None:
        frame = vehicle.bogie.frame
        own = (frame.mass_kg, frame.roll_inertia_kg_m2, frame.yaw_inertia_kg_m2)
        mass[range(-FRAME_SIZE, 0), range(-FRAME_SIZE, 0)] = own
    return 1e-3 * mass, 1e-3 * gyroscopic


def _dampers(vehicle: Vehicle, size: int) -> Floats:
    """Force of all dampers over rates in mm/s and mrad/s; dampers of the body act against its resting place."""
    found = np.zeros((size, size))
    if vehicle.bogie is None:
        return found
    above, (y, roll, _) = vehicle.bogie.secondary, np.eye(size)[-FRAME_SIZE:]
    dampers = [(damping, moves) for damping, moves, _ in links(vehicle.bogie, size, "Ns_per_m")]
    dampers.append((2.0 * above.lateral_Ns_per_m, y))
    dampers.append((2.0 * above.vertical_Ns_per_m * above.half_distance_m**2, roll))
    for damping, moves in dampers:
        found -= damping * np.outer(moves, moves)
    return 1e-3 * found
