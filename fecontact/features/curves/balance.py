"""Balance of forces of a vehicle at rest in the moving track frame: the residuals of steady motion."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fecontact.arrays import Floats
from fecontact.features.curves.model import GRAVITY_M_S2, Bogie, Vehicle
from fecontact.features.curves.newton import differences
from fecontact.features.curves.normal import Surfaces
from fecontact.features.curves.wheel_forces import ContactLaw, Motion, WheelForce, wheel_force

# frame.

# Of a wheelset: shift and height (mm), roll and yaw (mrad), slip of rotation (thousandths); of a frame without two.
WHEELSET_SIZE, FRAME_SIZE = 5, 3
MILLI = 1e-3
_UNITS = np.array([1.0, 1.0, MILLI, MILLI])
# Moments count as forces at a metre.
_ARM_MM = 1e3


@dataclass(frozen=True, kw_only=True, eq=False)
class Line:
    """Track and running conditions.

    Attributes
    ----------
    left, right
        Wheel and rail of both sides, the right one as its mirror image.
    law
        Of all contacts.
    curvature_per_mm
        Positive to the left.
    cant_rad
        Positive where the left rail is the higher one.
    speed_m_s
        Running speed.
    """

    left: Surfaces
    right: Surfaces
    law: ContactLaw
    curvature_per_mm: float = 0.0
    cant_rad: float = 0.0
    speed_m_s: float = 0.0

    @property
    def acceleration_m_s2(self) -> tuple[float, float]:
        """Weight and centripetal acceleration as one, along the track's y and z."""
        centripetal = self.speed_m_s**2 * self.curvature_per_mm * 1e3
        c, s = math.cos(self.cant_rad), math.sin(self.cant_rad)
        return -GRAVITY_M_S2 * s - centripetal * c, -GRAVITY_M_S2 * c + centripetal * s


@dataclass(frozen=True, kw_only=True, eq=False)
class Balance:
    """What is left over of forces and moments at a state, and the forces of the rails there.

    Attributes
    ----------
    residual_N (n,)
        Forces, and moments at an arm of a metre.
    wheels
        Left and right wheel of each wheelset, both in the frame of the left side.
    pull_N
        Multiplier of the constraint that keeps the speed: the force that the curve costs.
    power_per_speed_N
        Dissipated by slip, over the speed; the pull where all is balanced.
    """

    residual_N: Floats
    wheels: tuple[tuple[WheelForce, WheelForce], ...]
    pull_N: float
    power_per_speed_N: float

    @property
    def problems(self) -> tuple[str, ...]:
        """Why forces of wheels are not to be trusted, each reason once; empty where all are."""
        return tuple(dict.fromkeys(wheel.problem for both in self.wheels for wheel in both if wheel.problem))


def motion_of(state: Floats, curvature_per_mm: float, rates: Floats | None = None) -> Motion:
    """The motion that a state (5,) of a wheelset stands for; `rates` (4,): change of its position over the speed."""
    place, slip = state[:4] * _UNITS, MILLI * float(state[4])
    own = np.zeros(4) if rates is None else rates * _UNITS
    return Motion(place=place, slip=slip, curvature_per_mm=curvature_per_mm, rates=own)


def rail_forces(state: Floats, line: Line, rates: Floats | None = None) -> tuple[WheelForce, WheelForce]:
    """Forces of both rails on a wheelset in a state (5,)."""
    motion = motion_of(state, line.curvature_per_mm, rates)
    return wheel_force(line.left, motion, line.law), wheel_force(line.right, motion.mirrored(), line.law).mirrored()


def on_wheelset(wheels: tuple[WheelForce, WheelForce], state: Floats) -> Floats:
    """Sums (5,) that rails add to a wheelset's balance: Fy, Fz, Mx, Mz, and the moment about the axle."""
    force, moment = wheels[0].force_N + wheels[1].force_N, wheels[0].moment_Nmm + wheels[1].moment_Nmm
    axle = motion_of(state, 0.0).axle
    return np.array([force[1], force[2], moment[0] / _ARM_MM, moment[2] / _ARM_MM, float(moment @ axle) / _ARM_MM])


def balance(state: Floats, vehicle: Vehicle, line: Line) -> Balance:
    """Balance of a vehicle in a state (n,)."""
    states = wheelset_states(state, vehicle)
    wheels = tuple(rail_forces(one, line) for one in states)
    of_rails = np.zeros(state.size)
    for k, (one, forces) in enumerate(zip(states, wheels, strict=True)):
        of_rails[WHEELSET_SIZE * k : WHEELSET_SIZE * (k + 1)] = on_wheelset(forces, one)
    return Balance(
        residual_N=of_rails + without_rails(state, vehicle, line),
        wheels=wheels,
        pull_N=sum(_pull(forces, one, line) for one, forces in zip(states, wheels, strict=True)),
        power_per_speed_N=sum(wheel.power_per_speed_N for both in wheels for wheel in both),
    )


def jacobian(state: Floats, vehicle: Vehicle, line: Line, step: float = 1e-6) -> Floats:
    """Derivatives (n, n) of the residual, by differences: five of each wheelset's rails, and of all that is linear."""
    found = differences(lambda one: without_rails(one, vehicle, line), state, 1e-3)
    for k, one in enumerate(wheelset_states(state, vehicle)):
        block = slice(WHEELSET_SIZE * k, WHEELSET_SIZE * (k + 1))
        found[block, block] += differences(lambda q: on_wheelset(rail_forces(q, line), q), one, step)
    return found


def wheelset_states(state: Floats, vehicle: Vehicle) -> list[Floats]:
    """States (5,) of the wheelsets, the leading one first."""
    return [state[WHEELSET_SIZE * k : WHEELSET_SIZE * (k + 1)] for k in range(vehicle.wheelsets)]


def without_rails(state: Floats, vehicle: Vehicle, line: Line) -> Floats:
    """Residual (n,) but for the forces of the rails."""
    found = _external(state, vehicle, line)
    # Qv - M qdd of wheelsets that turn about their axles while the track turns is the gyroscopic moment about x, in
    # N m, that is N at a metre; the centripetal part goes with the weight, as one acceleration
    turning = vehicle.wheelset.axle_inertia_kg_m2 * line.speed_m_s**2 * line.curvature_per_mm * 1e3
    found[2 : WHEELSET_SIZE * vehicle.wheelsets : WHEELSET_SIZE] += turning / (
        1e-3 * vehicle.wheelset.rolling_radius_mm
    )
    return found


def _external(state: Floats, vehicle: Vehicle, line: Line) -> Floats:
    """Qext but for the rails: weight with the centripetal acceleration, and suspension."""
    if vehicle.bogie is not None:
        return _of_bogie(state, vehicle, vehicle.bogie, line)
    assert vehicle.guide is not None
    across, down = line.acceleration_m_s2
    load = 1e3 * vehicle.guide.axle_load_kN / GRAVITY_M_S2
    lateral = load * across - 1e-3 * vehicle.guide.lateral_N_per_m * state[0]
    return np.array([lateral, load * down, 0.0, -MILLI * vehicle.guide.yaw_Nm_per_rad * state[3], 0.0])


def links(bogie: Bogie, size: int, kind: Literal["N_per_m", "Ns_per_m"]) -> Iterator[tuple[float, Floats, float]]:
    """Springs or dampers of a bogie but for those across and up to the body, in metres and radians.

    Of each its rate, by how much it closes where each position (n,) moves, and by how much in a curve of curvature 1.
    """
    spring, above, a = bogie.primary, bogie.secondary, bogie.frame.half_wheelbase_m
    places, arm2 = np.eye(size), spring.half_distance_m**2
    y, roll, yaw = places[-FRAME_SIZE:]
    for k, sign in enumerate((1.0, -1.0)):
        own = places[WHEELSET_SIZE * k :]
        # each wheelset has a track frame of its own, at its place on the curve
        yield 2.0 * getattr(spring, f"lateral_{kind}"), y + sign * a * yaw - own[0], -0.5 * a**2
        yield 2.0 * getattr(spring, f"vertical_{kind}") * arm2, roll - own[2], 0.0
        yield 2.0 * getattr(spring, f"longitudinal_{kind}") * arm2, yaw - own[3], -sign * a
    yield 2.0 * getattr(above, f"longitudinal_{kind}") * above.half_distance_m**2, yaw, bogie.ahead_m


def _of_bogie(state: Floats, vehicle: Vehicle, bogie: Bogie, line: Line) -> Floats:
    """Suspension and weight of a bogie, in metres and radians inside."""
    frame, own = bogie.frame, vehicle.wheelset
    across, down = line.acceleration_m_s2
    found = np.zeros(state.size)
    for rate, moves, of_curve in links(bogie, state.size, "N_per_m"):
        found -= rate * (1e-3 * float(moves @ state) + 1e3 * of_curve * line.curvature_per_mm) * moves
    carried = bogie.body.mass_kg / 4.0 + frame.mass_kg / 2.0 + own.mass_kg
    for of_wheelset in wheelset_states(found, vehicle):
        of_wheelset[:2] += own.mass_kg * across, carried * down
    from_body, body_roll = _of_body(bogie, 1e-3 * float(state[-2]), across, down)
    axle_height = 1e-3 * own.rolling_radius_mm
    found[-3] += from_body + frame.mass_kg * across
    found[-2] += body_roll - (
        (frame.height_m - axle_height) * frame.mass_kg * across + (bogie.secondary.height_m - axle_height) * from_body
    )
    return found


def _of_body(bogie: Bogie, roll_frame: float, across: float, down: float) -> tuple[float, float]:
    """Lateral force (N) and roll moment (N m) of half a body on its frame, the body in balance on its springs.

    The body sways on its lateral springs, and its weight goes aside with it. There is no lateral stop.
    """
    above, half_mass = bogie.secondary, 0.5 * bogie.body.mass_kg
    force, lever = half_mass * across, bogie.body.height_m - above.height_m
    stiffness = bogie.roll_stiffness_Nm_per_rad
    roll = (stiffness * roll_frame - lever * force) / (stiffness + half_mass * down * lever)
    sway_m = 0.5 * force / above.lateral_N_per_m if above.lateral_N_per_m > 0.0 else 0.0
    return force, stiffness * (roll - roll_frame) + half_mass * down * sway_m


def _pull(wheels: tuple[WheelForce, WheelForce], state: Floats, line: Line) -> float:
    """The rails' forces on a wheelset projected on its motion with the speed, backwards."""
    force, moment = wheels[0].force_N + wheels[1].force_N, wheels[0].moment_Nmm + wheels[1].moment_Nmm
    kappa, y = line.curvature_per_mm, float(state[0])
    ahead = wheels[0].turned_N + wheels[1].turned_N
    return float(ahead - force[0] * (1.0 - kappa * y) - kappa * moment[2])
