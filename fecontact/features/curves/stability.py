"""Small motions about an equilibrium on straight track.

The module has eigenvalues, critical speed, and wavelength of hunting. The equation of motion (Otero Yugat, Part I,
eq. 15) is linearised about the equilibrium. The forces of the rails are linearised by differences in positions and in
rates divided by the speed; masses and suspension are linear. The car body does not move.
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
    TrackConditions,
    compute_rail_forces,
    compute_vehicle_residual,
    split_wheelset_states,
    sum_rail_forces,
    suspension_links,
)
from fecontact.features.curves.model import Vehicle
from fecontact.features.curves.steady import make_straight_start, solve_equilibrium

# Number of positions of a wheelset, without its slip of rotation, which is a rate.
_POSITION_COUNT = 4
# Steps of the differences: of positions in mm and mrad, and of their rates per mm of way.
_POSITION_STEP, _RATE_STEP = 1e-4, 1e-7
# Lowest and highest speed of the search for the critical speed, and number of speeds.
_MIN_SPEED_M_S, _MAX_SPEED_M_S, _SPEED_COUNT = 2.0, 250.0, 60
_SPEED_TOLERANCE_M_S = 0.01
# Least wavelength of hunting. Klingel's wavelength of a small wheel (radius 150 mm, gauge 1000 mm) with a conicity of 1
# is 1.7 m. At low speeds all shorter oscillations are of the bodies on their suspension and on the contacts: their
# frequency does not depend on the speed.
_LEAST_WAVELENGTH_M = 1.0
# Growth that is a rounding error, in 1/s and as a fraction of the frequency: a wheelset of cylinders on its contacts
# oscillates at 1550 rad/s without damping, and the eigenvalue has a real part of 7e-8.
_GROWTH_ROUNDING, _RELATIVE_GROWTH_ROUNDING = 1e-9, 1e-9


@dataclass(frozen=True, kw_only=True)
class StraightTrack:
    """Stability of a vehicle on straight track.

    The stability in curves is not analysed.

    Attributes
    ----------
    theory
        Name of the theory of the normal force.
    critical_speed_km_h
        Speed above which an oscillation grows. None if no oscillation grows, if an oscillation grows at `slow_km_h`,
        the lowest speed of the search, or without an equilibrium.
    frequency_Hz, wavelength_m
        Least damped oscillation: hunting at the critical speed, or else the oscillation at `slow_km_h`.
    slow_km_h
        Lowest speed of the search.
    slow_wavelength_m
        Wavelength at `slow_km_h`, where masses have no effect: Klingel's wavelength of the wheelsets as the suspension
        connects them.
    problem
        Reason why there is no result, or a remark on it.
    """

    theory: str
    critical_speed_km_h: float | None = None
    frequency_Hz: float | None = None
    wavelength_m: float | None = None
    slow_km_h: float = 3.6 * _MIN_SPEED_M_S
    slow_wavelength_m: float | None = None
    problem: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearModel:
    """Vehicle linearised about its equilibrium on straight track.

    The model has all terms that do not depend on the speed. Forces are in N, and moments in N at an arm of a metre.
    Positions are in mm and mrad, as in `features.curves.steady`.

    Attributes
    ----------
    stiffness : ndarray of shape (n, n)
        Derivatives of the forces by positions, and by slips of rotation.
    damping : ndarray of shape (n, n)
        Derivatives of the dampers' forces by rates in mm/s and mrad/s.
    rail_damping : ndarray of shape (n, n)
        Derivatives of the rails' forces by rates per mm of way.
    vehicle
        Vehicle that is linearised.
    """

    vehicle: Vehicle
    stiffness: Floats
    damping: Floats
    rail_damping: Floats


@dataclass(frozen=True, kw_only=True)
class Hunting:
    """Least damped oscillation at a speed.

    Attributes
    ----------
    speed_m_s
        Running speed.
    growth_per_s
        Rate of growth; negative if the oscillation fades.
    frequency_Hz
        Frequency.

    Examples
    --------
    >>> from fecontact.features.curves.stability import Hunting
    >>> Hunting(speed_m_s=50.0, growth_per_s=-0.5, frequency_Hz=2.0).wavelength_m
    25.0
    """

    speed_m_s: float
    growth_per_s: float
    frequency_Hz: float

    @property
    def wavelength_m(self) -> float:
        """Distance that the vehicle runs in a period, m."""
        return self.speed_m_s / self.frequency_Hz if self.frequency_Hz > 0.0 else math.inf


def linearise_vehicle(vehicle: Vehicle, track: TrackConditions) -> LinearModel:
    """Linearise a vehicle about its equilibrium on straight track.

    Parameters
    ----------
    vehicle
        Vehicle.
    track
        Straight track, with the theory of the contact.

    Returns
    -------
    LinearModel
        Stiffness and damping by central differences.

    Raises
    ------
    InputError
        If there is no equilibrium, or if the track is curved.
    ConvergenceError
        If a contact at a state nearby is not solved.

    Notes
    -----
    Source: Otero Yugat, Part I, eq. 15. Range of validity: small motions about the centred position; the body is fixed.
    """
    if track.curvature_per_mm != 0.0:
        raise InputError("stability is computed on straight track only; allowed: curvature 0")
    equilibrium = solve_equilibrium(make_straight_start(vehicle, track), vehicle, track)
    if equilibrium.status != "equilibrium":
        reason = "; ".join(equilibrium.notes) or f"residual {equilibrium.left_over_N:.0f} N; check the profiles"
        raise InputError(f"no equilibrium on straight track: {reason}")
    size = equilibrium.state.size
    stiffness = _estimate_central_jacobian(
        lambda state: compute_vehicle_residual(state, vehicle, track), equilibrium.state, 1e-3
    )
    if vehicle.bogie is not None:
        stiffness[-FRAME_SIZE, -FRAME_SIZE] -= 2e-3 * vehicle.bogie.secondary.lateral_N_per_m
    rail_damping = np.zeros((size, size))
    for index, wheelset_state in enumerate(split_wheelset_states(equilibrium.state, vehicle)):
        block = slice(WHEELSET_SIZE * index, WHEELSET_SIZE * (index + 1))
        stiffness[block, block] += _estimate_central_jacobian(
            lambda state: _sum_solved_rail_forces(state, track), wheelset_state, _POSITION_STEP
        )
        rail_damping[block, WHEELSET_SIZE * index : WHEELSET_SIZE * index + _POSITION_COUNT] = (
            _estimate_central_jacobian(
                lambda rates, state=wheelset_state: _sum_solved_rail_forces(state, track, rates),  # type: ignore[misc]
                np.zeros(_POSITION_COUNT),
                _RATE_STEP,
            )
        )
    return LinearModel(
        vehicle=vehicle, stiffness=stiffness, damping=_make_damping_matrix(vehicle, size), rail_damping=rail_damping
    )


def _sum_solved_rail_forces(state: Floats, track: TrackConditions, rates: Floats | None = None) -> Floats:
    """Sums (5,) of both rails' contributions to the residual of a wheelset.

    Raises
    ------
    ConvergenceError
        If a contact is not solved.
    """
    wheels = compute_rail_forces(state, track, rates)
    if problem := wheels[0].problem or wheels[1].problem:
        raise ConvergenceError(problem)
    return sum_rail_forces(wheels, state)


def _estimate_central_jacobian(function: Callable[[Floats], Floats], state: Floats, step: float) -> Floats:
    """Estimate a Jacobian (m, n) by central differences."""
    return np.stack(
        [(function(state + step * unit) - function(state - step * unit)) / (2.0 * step) for unit in np.eye(state.size)],
        axis=1,
    )


def compute_eigenvalues(model: LinearModel, speed_m_s: float) -> NDArray[np.complex128]:
    """Compute the eigenvalues of a linear model at a speed.

    Parameters
    ----------
    model
        Vehicle linearised about its equilibrium.
    speed_m_s
        Running speed.

    Returns
    -------
    array of complex
        Eigenvalues in 1/s; a positive real part is a motion that grows.
    """
    vehicle = model.vehicle
    size = model.stiffness.shape[0]
    slip_indices = [WHEELSET_SIZE * index + _POSITION_COUNT for index in range(vehicle.wheelsets)]
    position_indices = [index for index in range(size) if index not in slip_indices]
    mass, gyroscopic = _make_mass_matrices(vehicle, size, speed_m_s)
    # the rail forces depend on rates of the position per mm of way
    rates = model.rail_damping / (1e3 * speed_m_s) + model.damping + gyroscopic
    position_count, slip_count = len(position_indices), len(slip_indices)
    system = np.zeros((2 * position_count + slip_count, 2 * position_count + slip_count))
    system[:position_count, position_count : 2 * position_count] = np.eye(position_count)
    inverse = np.linalg.inv(mass)
    stiffness_rates, damping_rates = inverse @ model.stiffness, inverse @ rates
    accelerations = np.concatenate(
        [stiffness_rates[:, position_indices], damping_rates[:, position_indices], stiffness_rates[:, slip_indices]],
        axis=1,
    )
    system[position_count : 2 * position_count], system[2 * position_count :] = (
        accelerations[position_indices],
        accelerations[slip_indices],
    )
    return np.asarray(np.linalg.eigvals(system))


def find_hunting(model: LinearModel, speed_m_s: float) -> Hunting:
    """Find the least damped oscillation with a wavelength of hunting at a speed.

    Parameters
    ----------
    model
        Vehicle linearised about its equilibrium.
    speed_m_s
        Running speed.

    Returns
    -------
    Hunting
        Growth, frequency and wavelength.

    Raises
    ------
    ConvergenceError
        If no motion oscillates over at least 1 m of track, for example without conicity.
    """
    values = compute_eigenvalues(model, speed_m_s)
    oscillating = values[(values.imag > 1e-6) & (values.imag < 2.0 * math.pi * speed_m_s / _LEAST_WAVELENGTH_M)]
    if oscillating.size == 0:
        raise ConvergenceError(
            f"no motion oscillates at {3.6 * speed_m_s:g} km/h with a wavelength of at least {_LEAST_WAVELENGTH_M:g} m:"
            " the vehicle does not hunt"
        )
    least_damped = oscillating[int(np.argmax(oscillating.real))]
    return Hunting(
        speed_m_s=speed_m_s,
        growth_per_s=float(least_damped.real),
        frequency_Hz=float(least_damped.imag) / (2.0 * math.pi),
    )


def analyse_straight_track(theory: str, vehicle: Vehicle, track: TrackConditions) -> StraightTrack:
    """Analyse the stability of a vehicle on straight track.

    Parameters
    ----------
    theory
        Name of the theory, for the result.
    vehicle
        Vehicle.
    track
        Straight track, with the normal force by this theory.

    Returns
    -------
    StraightTrack
        Critical speed and wavelengths; without an equilibrium only the reason.
    """
    try:
        model = linearise_vehicle(vehicle, track)
        critical_speed, slow_motion = find_critical_speed_m_s(model), find_hunting(model, _MIN_SPEED_M_S)
        # if an oscillation grows at the lowest speed, then the critical speed is not known
        reported_speed = None if critical_speed == _MIN_SPEED_M_S else critical_speed
        motion = slow_motion if reported_speed is None else find_hunting(model, reported_speed)
    except (InputError, ConvergenceError) as error:
        return StraightTrack(theory=theory, problem=str(error))
    return StraightTrack(
        theory=theory,
        critical_speed_km_h=None if reported_speed is None else 3.6 * reported_speed,
        frequency_Hz=motion.frequency_Hz,
        wavelength_m=motion.wavelength_m,
        slow_wavelength_m=slow_motion.wavelength_m,
        problem=_describe_critical_speed(critical_speed),
    )


def _describe_critical_speed(critical_m_s: float | None) -> str:
    """Remark on a critical speed that is outside of the range of the search; else empty."""
    if critical_m_s is None:
        return f"no oscillation grows up to {3.6 * _MAX_SPEED_M_S:g} km/h, the highest speed searched"
    note = f"the critical speed is below {3.6 * _MIN_SPEED_M_S:g} km/h, the lowest speed searched"
    return note * (critical_m_s == _MIN_SPEED_M_S)


def find_critical_speed_m_s(model: LinearModel) -> float | None:
    """Find the lowest speed above which an oscillation grows.

    Parameters
    ----------
    model
        Vehicle linearised about its equilibrium.

    Returns
    -------
    float or None
        Critical speed in m/s, accurate to 0.01 m/s. 2 m/s if an oscillation grows there already; None if no oscillation
        grows up to 250 m/s.

    Notes
    -----
    Range of validity: small motions about the equilibrium. Limit cycles, which are motions with a finite amplitude, may
    persist below the critical speed.
    """

    def is_growing(speed: float) -> bool:
        values = compute_eigenvalues(model, speed)
        return bool((values.real > _GROWTH_ROUNDING + _RELATIVE_GROWTH_ROUNDING * np.abs(values)).any())

    speeds = np.linspace(_MIN_SPEED_M_S, _MAX_SPEED_M_S, _SPEED_COUNT)
    first_growing = next((index for index, speed in enumerate(speeds) if is_growing(float(speed))), None)
    if not first_growing:
        return None if first_growing is None else float(speeds[0])
    low, high = float(speeds[first_growing - 1]), float(speeds[first_growing])
    while high - low > _SPEED_TOLERANCE_M_S:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if is_growing(middle) else (middle, high)
    return 0.5 * (low + high)


def _make_mass_matrices(vehicle: Vehicle, size: int, speed_m_s: float) -> tuple[Floats, Floats]:
    """Make the mass matrix (n, n) and the matrix of gyroscopic forces by rates.

    The mass is in N per mm/s2 and per mrad/s2, with moments in N at an arm of a metre.
    """
    body = vehicle.wheelset
    mass, gyroscopic = np.zeros((size, size)), np.zeros((size, size))
    gyroscopic_inertia = body.axle_inertia_kg_m2 * speed_m_s / (1e-3 * body.rolling_radius_mm)
    # slips of rotation are thousandths of the ratio of speed and radius
    values = (body.mass_kg, body.mass_kg, body.roll_inertia_kg_m2, body.yaw_inertia_kg_m2, gyroscopic_inertia)
    for index in range(vehicle.wheelsets):
        start = WHEELSET_SIZE * index
        mass[range(start, start + WHEELSET_SIZE), range(start, start + WHEELSET_SIZE)] = values
        gyroscopic[start + 2, start + 3], gyroscopic[start + 3, start + 2] = gyroscopic_inertia, -gyroscopic_inertia
    if vehicle.bogie is not None:
        frame = vehicle.bogie.frame
        frame_values = (frame.mass_kg, frame.roll_inertia_kg_m2, frame.yaw_inertia_kg_m2)
        mass[range(-FRAME_SIZE, 0), range(-FRAME_SIZE, 0)] = frame_values
    return 1e-3 * mass, 1e-3 * gyroscopic


def _make_damping_matrix(vehicle: Vehicle, size: int) -> Floats:
    """Derivatives of all dampers' forces by rates in mm/s and mrad/s.

    Dampers of the body act against its position at rest.
    """
    damping_matrix = np.zeros((size, size))
    if vehicle.bogie is None:
        return damping_matrix
    secondary, (y, roll, _) = vehicle.bogie.secondary, np.eye(size)[-FRAME_SIZE:]
    dampers = [(damping, closures) for damping, closures, _ in suspension_links(vehicle.bogie, size, "Ns_per_m")]
    dampers.append((2.0 * secondary.lateral_Ns_per_m, y))
    dampers.append((2.0 * secondary.vertical_Ns_per_m * secondary.half_distance_m**2, roll))
    for damping, closures in dampers:
        damping_matrix -= damping * np.outer(closures, closures)
    return 1e-3 * damping_matrix
