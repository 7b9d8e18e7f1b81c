"""Residuals of the steady motion of a vehicle.

The vehicle is at rest in the moving track frame, so that its forces and moments are in balance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fecontact.arrays import Floats
from fecontact.features.curves.model import GRAVITY_M_S2, Bogie, Vehicle
from fecontact.features.curves.newton import estimate_jacobian
from fecontact.features.curves.normal import Surfaces
from fecontact.features.curves.wheel_forces import ContactSettings, Motion, WheelForce, compute_wheel_force

# State of a wheelset: shift and height (mm), roll and yaw (mrad), slip of rotation (thousandths). State of a frame:
# shift (mm), roll and yaw (mrad).
WHEELSET_SIZE, FRAME_SIZE = 5, 3
"""Number of components in the state of a wheelset, and in the state of a bogie frame."""
MILLI = 1e-3
"""Factor from mrad to rad, and from thousandths to 1."""
_STATE_UNITS = np.array([1.0, 1.0, MILLI, MILLI])
# Moments are expressed as forces at an arm of a metre.
_MOMENT_ARM_MM = 1e3


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackConditions:
    """Track and running conditions at a place of the track.

    Attributes
    ----------
    left, right
        Wheel and rail of both sides, the right side as its mirror image.
    law
        Theories and constants of all contacts.
    curvature_per_mm
        Curvature, positive to the left.
    cant_rad
        Cant angle, positive if the left rail is higher.
    speed_m_s
        Running speed.
    """

    left: Surfaces
    right: Surfaces
    law: ContactSettings
    curvature_per_mm: float = 0.0
    cant_rad: float = 0.0
    speed_m_s: float = 0.0

    @property
    def acceleration_m_s2(self) -> tuple[float, float]:
        """Sum of weight and centripetal acceleration, along the track's y and z."""
        centripetal = self.speed_m_s**2 * self.curvature_per_mm * 1e3
        cos_cant, sin_cant = math.cos(self.cant_rad), math.sin(self.cant_rad)
        return -GRAVITY_M_S2 * sin_cant - centripetal * cos_cant, -GRAVITY_M_S2 * cos_cant + centripetal * sin_cant


@dataclass(frozen=True, kw_only=True, eq=False)
class Balance:
    """Residual of forces and moments at a state, and the forces of the rails.

    Attributes
    ----------
    residual_N : ndarray of shape (n,)
        Forces, and moments divided by an arm of a metre.
    wheels
        Forces on the left and the right wheel of each wheelset, both in the frame of the left side.
    pull_N
        Multiplier of the constraint that keeps the speed: the force that the curve costs.
    power_per_speed_N
        Power of slip, divided by the speed; equal to the pull if all forces are in balance.
    """

    residual_N: Floats
    wheels: tuple[tuple[WheelForce, WheelForce], ...]
    pull_N: float
    power_per_speed_N: float

    @property
    def problems(self) -> tuple[str, ...]:
        """Reasons why forces of wheels are not reliable.

        Each reason is there once. The tuple is empty if all forces are reliable.
        """
        return tuple(dict.fromkeys(wheel.problem for pair in self.wheels for wheel in pair if wheel.problem))


def make_motion(state: Floats, curvature_per_mm: float, rates: Floats | None = None) -> Motion:
    """Motion of a wheelset from its state.

    Parameters
    ----------
    state : ndarray of shape (5,)
        Shift and height (mm), roll and yaw (mrad), slip of rotation (thousandths).
    curvature_per_mm
        Curvature of the track, positive to the left.
    rates : ndarray of shape (4,) or None
        Rates of the position (mm and mrad) per mm of way; zero if not given.

    Returns
    -------
    Motion
        The motion in mm and rad.
    """
    position, slip = state[:4] * _STATE_UNITS, MILLI * float(state[4])
    scaled_rates = np.zeros(4) if rates is None else rates * _STATE_UNITS
    return Motion(place=position, slip=slip, curvature_per_mm=curvature_per_mm, rates=scaled_rates)


def compute_rail_forces(
    state: Floats, track: TrackConditions, rates: Floats | None = None
) -> tuple[WheelForce, WheelForce]:
    """Compute the forces of both rails on a wheelset.

    Parameters
    ----------
    state : ndarray of shape (5,)
        State of the wheelset.
    track
        Track and running conditions.
    rates : ndarray of shape (4,) or None
        Rates of the position per mm of way; zero if not given.

    Returns
    -------
    tuple of WheelForce
        Forces on the left and the right wheel, both in the frame of the left side.
    """
    motion = make_motion(state, track.curvature_per_mm, rates)
    return compute_wheel_force(track.left, motion, track.law), compute_wheel_force(
        track.right, motion.mirror_image(), track.law
    ).mirror_image()


def sum_rail_forces(wheels: tuple[WheelForce, WheelForce], state: Floats) -> Floats:
    """Sum the contributions of both rails to the residual of a wheelset.

    Parameters
    ----------
    wheels
        Forces on the left and the right wheel.
    state : ndarray of shape (5,)
        State of the wheelset.

    Returns
    -------
    array (5,)
        Fy and Fz (N), Mx, Mz and the moment about the axle (N at an arm of a metre).
    """
    force, moment = wheels[0].force_N + wheels[1].force_N, wheels[0].moment_Nmm + wheels[1].moment_Nmm
    axle = make_motion(state, 0.0).axle
    return np.array(
        [
            force[1],
            force[2],
            moment[0] / _MOMENT_ARM_MM,
            moment[2] / _MOMENT_ARM_MM,
            float(moment @ axle) / _MOMENT_ARM_MM,
        ]
    )


def compute_balance(state: Floats, vehicle: Vehicle, track: TrackConditions) -> Balance:
    """Compute the balance of a vehicle at a state.

    Parameters
    ----------
    state : ndarray of shape (n,)
        States of the wheelsets and of the frame.
    vehicle
        Vehicle with n components of its state.
    track
        Track and running conditions.

    Returns
    -------
    Balance
        Residual, forces of the rails, pull and power of slip.

    Notes
    -----
    Source: Otero Yugat, Part I, eq. 15 and 16, see `features.curves.steady`. Range of validity: steady motion.
    """
    states = split_wheelset_states(state, vehicle)
    wheels = tuple(compute_rail_forces(wheelset_state, track) for wheelset_state in states)
    rail_residual = np.zeros(state.size)
    for index, (wheelset_state, forces) in enumerate(zip(states, wheels, strict=True)):
        rail_residual[WHEELSET_SIZE * index : WHEELSET_SIZE * (index + 1)] = sum_rail_forces(forces, wheelset_state)
    return Balance(
        residual_N=rail_residual + compute_vehicle_residual(state, vehicle, track),
        wheels=wheels,
        pull_N=sum(
            _compute_pull(forces, wheelset_state, track) for wheelset_state, forces in zip(states, wheels, strict=True)
        ),
        power_per_speed_N=sum(wheel.power_per_speed_N for pair in wheels for wheel in pair),
    )


def compute_jacobian(state: Floats, vehicle: Vehicle, track: TrackConditions, step: float = 1e-6) -> Floats:
    """Compute the Jacobian (n, n) of the residual by forward differences.

    The rails of each wheelset need five differences. The rest of the residual is linear.

    Parameters
    ----------
    state : ndarray of shape (n,)
        State of the vehicle.
    vehicle, track
        Vehicle, and track and running conditions.
    step
        Change of each component for the forces of the rails.

    Returns
    -------
    array (n, n)
        Derivatives of the residual.
    """
    derivatives = estimate_jacobian(
        lambda wheelset_state: compute_vehicle_residual(wheelset_state, vehicle, track), state, 1e-3
    )
    for index, wheelset_state in enumerate(split_wheelset_states(state, vehicle)):
        block = slice(WHEELSET_SIZE * index, WHEELSET_SIZE * (index + 1))
        derivatives[block, block] += estimate_jacobian(
            lambda varied_state: sum_rail_forces(compute_rail_forces(varied_state, track), varied_state),
            wheelset_state,
            step,
        )
    return derivatives


def split_wheelset_states(state: Floats, vehicle: Vehicle) -> list[Floats]:
    """States (5,) of the wheelsets, the leading wheelset first.

    The states are views of the state of the vehicle.

    Parameters
    ----------
    state : ndarray of shape (n,)
        State of the vehicle, with the wheelsets first.
    vehicle
        Vehicle with its number of wheelsets.

    Returns
    -------
    list of ndarray of shape (5,)
        State of each wheelset.
    """
    return [state[WHEELSET_SIZE * index : WHEELSET_SIZE * (index + 1)] for index in range(vehicle.wheelsets)]


def compute_vehicle_residual(state: Floats, vehicle: Vehicle, track: TrackConditions) -> Floats:
    """Compute the residual (n,) without the forces of the rails.

    Parameters
    ----------
    state : ndarray of shape (n,)
        State of the vehicle.
    vehicle, track
        Vehicle, and track and running conditions.

    Returns
    -------
    array (n,)
        Forces of weight, suspension and inertia (N), and moments at an arm of a metre.
    """
    residual = _compute_vehicle_forces(state, vehicle, track)
    # Wheelsets turn about their axles while the track turns: their Qv - M qdd is the gyroscopic moment about x, in N m,
    # which is N at a metre. The centripetal part is added to the weight as an acceleration.
    turning = vehicle.wheelset.axle_inertia_kg_m2 * track.speed_m_s**2 * track.curvature_per_mm * 1e3
    residual[2 : WHEELSET_SIZE * vehicle.wheelsets : WHEELSET_SIZE] += turning / (
        1e-3 * vehicle.wheelset.rolling_radius_mm
    )
    return residual


def _compute_vehicle_forces(state: Floats, vehicle: Vehicle, track: TrackConditions) -> Floats:
    """Compute the external forces Qext without the forces of the rails.

    These are the weight with the centripetal acceleration, and the suspension.
    """
    if vehicle.bogie is not None:
        return _compute_bogie_forces(state, vehicle, vehicle.bogie, track)
    assert vehicle.guide is not None
    across, down = track.acceleration_m_s2
    load = 1e3 * vehicle.guide.axle_load_kN / GRAVITY_M_S2
    lateral = load * across - 1e-3 * vehicle.guide.lateral_N_per_m * state[0]
    return np.array([lateral, load * down, 0.0, -MILLI * vehicle.guide.yaw_Nm_per_rad * state[3], 0.0])


def suspension_links(
    bogie: Bogie, size: int, kind: Literal["N_per_m", "Ns_per_m"]
) -> Iterator[tuple[float, Floats, float]]:
    """Springs or dampers of a bogie, in metres and radians.

    The links across and up to the body are not included.

    Parameters
    ----------
    bogie
        Bogie with its suspension.
    size
        Number of components n of the vehicle's state.
    kind
        Unit in the name of the attributes: springs or dampers.

    Yields
    ------
    rate
        Stiffness or damping.
    closures (n,)
        Closing of the link per motion of each component.
    curve_closure
        Closing of the link in a curve of curvature 1 1/m.
    """
    primary, secondary, half_wheelbase = bogie.primary, bogie.secondary, bogie.frame.half_wheelbase_m
    unit_motions, arm2 = np.eye(size), primary.half_distance_m**2
    y, roll, yaw = unit_motions[-FRAME_SIZE:]
    for index, sign in enumerate((1.0, -1.0)):
        wheelset_motions = unit_motions[WHEELSET_SIZE * index :]
        # each wheelset has a separate track frame, at its position on the curve
        yield (
            2.0 * getattr(primary, f"lateral_{kind}"),
            y + sign * half_wheelbase * yaw - wheelset_motions[0],
            -0.5 * half_wheelbase**2,
        )
        yield 2.0 * getattr(primary, f"vertical_{kind}") * arm2, roll - wheelset_motions[2], 0.0
        yield 2.0 * getattr(primary, f"longitudinal_{kind}") * arm2, yaw - wheelset_motions[3], -sign * half_wheelbase
    yield 2.0 * getattr(secondary, f"longitudinal_{kind}") * secondary.half_distance_m**2, yaw, bogie.ahead_m


def _compute_bogie_forces(state: Floats, vehicle: Vehicle, bogie: Bogie, track: TrackConditions) -> Floats:
    """Compute the forces of suspension and weight of a bogie, in metres and radians inside.

    Returns
    -------
    ndarray of shape (n,)
        Force in N or moment in N m on each component of the state: the wheelsets, then the frame.
    """
    frame, wheelset = bogie.frame, vehicle.wheelset
    across, down = track.acceleration_m_s2
    residual = np.zeros(state.size)
    for rate, closures, curve_closure in suspension_links(bogie, state.size, "N_per_m"):
        residual -= rate * (1e-3 * float(closures @ state) + 1e3 * curve_closure * track.curvature_per_mm) * closures
    carried_mass = bogie.body.mass_kg / 4.0 + frame.mass_kg / 2.0 + wheelset.mass_kg
    for wheelset_residual in split_wheelset_states(residual, vehicle):
        wheelset_residual[:2] += wheelset.mass_kg * across, carried_mass * down
    from_body, body_roll = _compute_body_forces(bogie, 1e-3 * float(state[-2]), across, down)
    axle_height = 1e-3 * wheelset.rolling_radius_mm
    residual[-3] += from_body + frame.mass_kg * across
    residual[-2] += body_roll - (
        (frame.height_m - axle_height) * frame.mass_kg * across + (bogie.secondary.height_m - axle_height) * from_body
    )
    return residual


def _compute_body_forces(bogie: Bogie, roll_frame: float, across: float, down: float) -> tuple[float, float]:
    """Lateral force (N) and roll moment (N m) of half a body on its frame.

    The body is in balance on its springs. It sways on its lateral springs, and its weight moves aside with it. There is
    no lateral stop.

    Parameters
    ----------
    bogie
        Bogie with its body and secondary springs.
    roll_frame
        Roll of the frame in rad.
    across, down
        Components of `TrackConditions.acceleration_m_s2` (m/s2).

    Returns
    -------
    force, moment
        Positive in the directions of `across` and of the roll.
    """
    secondary, half_mass = bogie.secondary, 0.5 * bogie.body.mass_kg
    force, lever = half_mass * across, bogie.body.height_m - secondary.height_m
    stiffness = bogie.roll_stiffness_Nm_per_rad
    roll = (stiffness * roll_frame - lever * force) / (stiffness + half_mass * down * lever)
    sway_m = 0.5 * force / secondary.lateral_N_per_m if secondary.lateral_N_per_m > 0.0 else 0.0
    return force, stiffness * (roll - roll_frame) + half_mass * down * sway_m


def _compute_pull(wheels: tuple[WheelForce, WheelForce], state: Floats, track: TrackConditions) -> float:
    """Pull (N) of a wheelset: the forces of the rails projected backwards on its motion with the speed."""
    force, moment = wheels[0].force_N + wheels[1].force_N, wheels[0].moment_Nmm + wheels[1].moment_Nmm
    kappa, y = track.curvature_per_mm, float(state[0])
    turned_force = wheels[0].turned_N + wheels[1].turned_N
    return float(turned_force - force[0] * (1.0 - kappa * y) - kappa * moment[2])
