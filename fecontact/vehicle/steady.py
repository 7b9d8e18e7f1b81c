"""The projected algebraic system of steady motion: what must vanish where a vehicle runs at rest in the moving frame.

Otero Yugat's equation of motion (Part I, eq. 15), M qdd + Cq^T lambda = Qv + Qext with the constraints C(q, t) = 0, is
taken for each body in a track frame that runs along, turned with the track. Steady motion has a constant position there
(eq. 16), and M qdd - Qv are the centripetal and gyroscopic terms (`_inertia`). Qext are weight, suspension
(`_external`) and the forces of the rails (`wheel_force`). The constraints are the rigid wheelset and the given speed;
the force lambda of the latter is the pull that the curve costs (`Balance.pull_N`). Projected on the five directions
that are left to each wheelset, and on three of a frame, nothing but algebra remains.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.vehicle.model import Bogie, Vehicle
from fecontact.vehicle.surfaces import Surfaces
from fecontact.vehicle.wheel_force import ContactLaw, Motion, WheelForce, wheel_force

Floats = NDArray[np.float64]
GRAVITY_M_S2 = 9.81
# Of a wheelset: shift and height (mm), roll and yaw (mrad), slip of rotation (thousandths); of a frame without two.
WHEELSET_SIZE, FRAME_SIZE = 5, 3
_MILLI = 1e-3
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
    """The motion that a state (5,) of a wheelset stands for; `rates` (4,) are those of its position over the speed."""
    y, z, roll, yaw, slip = (float(one) for one in state)
    r = (0.0,) * 4 if rates is None else tuple(float(one) for one in rates)
    return Motion(
        shift_mm=y,
        height_mm=z,
        roll_rad=_MILLI * roll,
        yaw_rad=_MILLI * yaw,
        slip=_MILLI * slip,
        curvature_per_mm=curvature_per_mm,
        rates=(r[0], r[1], _MILLI * r[2], _MILLI * r[3]),
    )


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
    found = _differences(lambda one: without_rails(one, vehicle, line), state, 1e-3)
    for k, one in enumerate(wheelset_states(state, vehicle)):
        block = slice(WHEELSET_SIZE * k, WHEELSET_SIZE * (k + 1))
        found[block, block] += _differences(lambda q: on_wheelset(rail_forces(q, line), q), one, step)
    return found


def _differences(f: Callable[[Floats], Floats], at: Floats, step: float) -> Floats:
    here = f(at)
    return np.stack([(f(at + step * unit) - here) / step for unit in np.eye(at.size)], axis=1)


def wheelset_states(state: Floats, vehicle: Vehicle) -> list[Floats]:
    """States (5,) of the wheelsets, the leading one first."""
    return [state[WHEELSET_SIZE * k : WHEELSET_SIZE * (k + 1)] for k in range(vehicle.wheelsets)]


def without_rails(state: Floats, vehicle: Vehicle, line: Line) -> Floats:
    """Residual (n,) but for the forces of the rails."""
    return _inertia(state, vehicle, line) + _external(state, vehicle, line)


def _inertia(state: Floats, vehicle: Vehicle, line: Line) -> Floats:
    """Qv - M qdd of wheelsets that turn about their axles while the track turns: the gyroscopic moment about x.

    The centripetal part goes with the weight, as one acceleration.
    """
    found = np.zeros(state.size)
    turning = vehicle.wheelset.axle_inertia_kg_m2 * line.speed_m_s**2 * line.curvature_per_mm * 1e3
    for k in range(vehicle.wheelsets):
        # N m, that is N at a metre
        found[WHEELSET_SIZE * k + 2] = turning / (1e-3 * vehicle.wheelset.rolling_radius_mm)
    return found


def _external(state: Floats, vehicle: Vehicle, line: Line) -> Floats:
    """Qext but for the rails: weight with the centripetal acceleration, and suspension."""
    if vehicle.bogie is not None:
        return _of_bogie(state, vehicle, vehicle.bogie, line)
    assert vehicle.guide is not None
    across, down = line.acceleration_m_s2
    load = 1e3 * vehicle.guide.axle_load_kN / GRAVITY_M_S2
    return np.array(
        [
            load * across - 1e-3 * vehicle.guide.lateral_N_per_m * state[0],
            load * down,
            0.0,
            -_MILLI * vehicle.guide.yaw_Nm_per_rad * state[3],
            0.0,
        ]
    )


def _of_bogie(state: Floats, vehicle: Vehicle, bogie: Bogie, line: Line) -> Floats:
    """Suspension and weight of a bogie, in metres and radians inside."""
    frame, body, spring, above = bogie.frame, bogie.body, bogie.primary, bogie.secondary
    across, down = line.acceleration_m_s2
    kappa, a = 1e3 * line.curvature_per_mm, frame.half_wheelbase_m
    y_frame, roll_frame, yaw_frame = 1e-3 * state[-3:]
    found = np.zeros(state.size)
    lateral, rolling, yawing = 0.0, 0.0, 0.0
    for k, sign in enumerate((1.0, -1.0)):
        y, _, roll, yaw, _ = 1e-3 * state[WHEELSET_SIZE * k : WHEELSET_SIZE * (k + 1)]
        # each wheelset has a track frame of its own, at its place on the curve
        force = 2.0 * spring.lateral_N_per_m * (y_frame + sign * a * yaw_frame - y - 0.5 * a**2 * kappa)
        turn = yaw_frame - yaw - sign * a * kappa
        yaw_moment = 2.0 * spring.longitudinal_N_per_m * spring.half_distance_m**2 * turn
        roll_moment = 2.0 * spring.vertical_N_per_m * spring.half_distance_m**2 * (roll_frame - roll)
        carried = body.mass_kg / 4.0 + frame.mass_kg / 2.0 + vehicle.wheelset.mass_kg
        found[WHEELSET_SIZE * k : WHEELSET_SIZE * k + 4] = (
            force + vehicle.wheelset.mass_kg * across,
            carried * down,
            roll_moment,
            yaw_moment,
        )
        lateral, rolling = lateral + force, rolling + roll_moment
        yawing += yaw_moment + sign * a * force
    from_body, body_roll = _of_body(bogie, roll_frame, across, down)
    axle_height = 1e-3 * vehicle.wheelset.rolling_radius_mm
    secondary_yaw = 2.0 * above.longitudinal_N_per_m * above.half_distance_m**2 * (yaw_frame + bogie.ahead_m * kappa)
    found[-3:] = (
        -lateral + from_body + frame.mass_kg * across,
        -rolling
        + body_roll
        - (frame.height_m - axle_height) * frame.mass_kg * across
        - (above.height_m - axle_height) * from_body,
        -yawing - secondary_yaw,
    )
    return found


def _of_body(bogie: Bogie, roll_frame: float, across: float, down: float) -> tuple[float, float]:
    """Lateral force (N) and roll moment (N m) of half a body on its frame, the body in balance on its springs."""
    above, half_mass = bogie.secondary, 0.5 * bogie.body.mass_kg
    force, lever = half_mass * across, bogie.body.height_m - above.height_m
    stiffness = 2.0 * above.vertical_N_per_m * above.half_distance_m**2 + above.roll_bar_Nm_per_rad
    roll = (stiffness * roll_frame - lever * force) / (stiffness + half_mass * down * lever)
    return force, stiffness * (roll - roll_frame)


def _pull(wheels: tuple[WheelForce, WheelForce], state: Floats, line: Line) -> float:
    """The rails' forces on a wheelset projected on its motion with the speed, backwards."""
    force, moment = wheels[0].force_N + wheels[1].force_N, wheels[0].moment_Nmm + wheels[1].moment_Nmm
    kappa, y = line.curvature_per_mm, float(state[0])
    ahead = wheels[0].turned_N + wheels[1].turned_N
    return float(ahead - force[0] * (1.0 - kappa * y) - kappa * moment[2])
