"""Steady motion of a vehicle on curved track: the forces of the rails, what must vanish, and where it does.

Otero Yugat's equation of motion (Part I, eq. 15), M qdd + Cq^T lambda = Qv + Qext with the constraints C(q, t) = 0, is
taken for each body in a track frame that runs along, turned with the track. Steady motion has a constant position there
(eq. 16), and M qdd - Qv are the centripetal and gyroscopic terms (`without_rails`). Qext are weight, suspension
(`_external`) and the forces of the rails (`wheel_force`). The constraints are the rigid wheelset and the given speed;
the force lambda of the latter is the pull that the curve costs (`Balance.pull_N`). Projected on the five directions
that are left to each wheelset, and on three of a frame, nothing but algebra remains.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import RollingPair
from fecontact.rolling.fastsim import Strips, strip_forces
from fecontact.rolling.laws import Creepages, CurvedCreepages
from fecontact.vehicle.model import Bogie, Vehicle
from fecontact.vehicle.normal import NormalTheory, Overlap, Pressed, Surfaces, standing

# --- Force and moment of a rail on its wheel at any position of the wheelset on a curved track.

_FASTSIM_CELLS = 30
# Kalker's table ends there; flange contact has 17 to 23.
_MOST_SLENDER = 10.0


@dataclass(frozen=True, kw_only=True)
class ContactLaw:
    """What a contact is evaluated with: theory of the normal force, contact modulus, friction and elastic constants."""

    normal: NormalTheory
    contact_modulus_MPa: float
    pair: RollingPair


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """Motion of a wheelset's centre in the track frame that runs along, of the left side; all over the running speed.

    Attributes
    ----------
    shift_mm, height_mm, roll_rad, yaw_rad
        Position.
    slip
        Speed of rotation over that which rolls the tape circle, less 1.
    curvature_per_mm
        Of the track, positive to the left.
    rates (4,)
        Of the position; zero in steady motion.
    """

    shift_mm: float
    height_mm: float
    roll_rad: float
    yaw_rad: float
    slip: float
    curvature_per_mm: float
    rates: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)

    def mirrored(self) -> Motion:
        """The motion of the right wheel as that of a left one."""
        y, z, roll, yaw = self.rates
        return replace(
            self,
            shift_mm=-self.shift_mm,
            roll_rad=-self.roll_rad,
            yaw_rad=-self.yaw_rad,
            curvature_per_mm=-self.curvature_per_mm,
            rates=(-y, z, -roll, -yaw),
        )

    @property
    def axle(self) -> Floats:
        """Direction (3,) of the axle to the left."""
        (cr, cy), (sr, sy) = np.cos([self.roll_rad, self.yaw_rad]), np.sin([self.roll_rad, self.yaw_rad])
        return np.array([-sy * cr, cy * cr, sr])


@dataclass(frozen=True, kw_only=True)
class PatchForce:
    """What one patch of a wheel carries, in the frame of the left side.

    Attributes
    ----------
    normal_force_N, fx_N, fy_N
        On the wheel: size of the normal force, and creep forces along and across.
    angle_rad, place_mm
        Contact angle and place (3,) at its centre of pressure, the latter from the wheelset's track frame.
    radius_mm
        Rolling radius there.
    a_mm, b_mm
        Semi-axes of the ellipse that stands for it.
    creepages
        There.
    problem
        Why the normal force is not to be trusted; empty where it is.
    """

    normal_force_N: float
    fx_N: float
    fy_N: float
    angle_rad: float
    place_mm: tuple[float, float, float]
    radius_mm: float
    a_mm: float
    b_mm: float
    creepages: Creepages
    problem: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class WheelForce:
    """Force (3,) and moment (3,) about the wheelset's centre on a wheel, and the power of slip over the speed.

    `turned_N` is what contacts ahead of the axle add along the rails, which are turned there.
    """

    force_N: Floats
    moment_Nmm: Floats
    power_per_speed_N: float
    turned_N: float
    patches: tuple[PatchForce, ...]

    @property
    def problem(self) -> str:
        """Why the normal force of a patch is not to be trusted; empty where all are."""
        return next((patch.problem for patch in self.patches if patch.problem), "")

    def mirrored(self) -> WheelForce:
        """That of the right wheel in the frame of the left side, which it is the mirror image of."""
        return replace(
            self,
            force_N=self.force_N * np.array([1.0, -1.0, 1.0]),
            moment_Nmm=self.moment_Nmm * np.array([-1.0, 1.0, -1.0]),
        )


def wheel_force(surfaces: Surfaces, motion: Motion, law: ContactLaw) -> WheelForce:
    """Force on a left wheel; zero where it does not touch."""
    overlap = surfaces.overlap(motion.shift_mm, motion.height_mm, motion.roll_rad, motion.yaw_rad)
    pressed = () if overlap is None else law.normal(overlap, law.contact_modulus_MPa)
    parts = [_patch_force(one, overlap, motion, law, surfaces.pair.rolling_radius_mm) for one in pressed if overlap]
    return WheelForce(
        force_N=sum((part.force_N for part in parts), start=np.zeros(3)),
        moment_Nmm=sum((part.moment_Nmm for part in parts), start=np.zeros(3)),
        power_per_speed_N=sum(part.power_per_speed_N for part in parts),
        turned_N=sum(part.turned_N for part in parts),
        patches=tuple(patch for part in parts for patch in part.patches),
    )


def _patch_force(pressed: Pressed, overlap: Overlap, motion: Motion, law: ContactLaw, radius_mm: float) -> WheelForce:
    """What one patch adds to the force on its wheel."""
    line = pressed.force_N_per_mm * pressed.width_mm
    load = float(line.sum())
    centre_s = float(pressed.s_mm @ line) / load
    # the strips, and the centre of pressure
    s = np.append(pressed.s_mm, centre_s)
    place = np.stack([np.interp(s, overlap.s_mm, column) for column in overlap.place_mm.T], axis=1)
    angle = np.interp(s, overlap.s_mm, overlap.angle_rad)
    normal = np.stack([np.zeros_like(s), -np.sin(angle), np.cos(angle)], axis=1)
    arm = place - np.array([0.0, motion.shift_mm, motion.height_mm])
    velocity, turning = rigid_slip(arm, motion, radius_mm)
    spin = normal @ turning
    tangent = np.array([0.0, math.cos(angle[-1]), math.sin(angle[-1])])
    plane = Creepages(xi=float(velocity[-1, 0]), eta=float(velocity[-1] @ tangent), spin_per_mm=float(spin[-1]))
    across = pressed.s_mm - centre_s
    creepages = CurvedCreepages(
        plane=plane,
        y_mm=across,
        xi_beside=velocity[:-1, 0] - plane.across(across)[0],
        spin_beside_per_mm=spin[:-1] - plane.spin_per_mm,
    )
    piece = _piece(pressed, across, law)
    fx, fy, turning_moment = strip_forces(piece, creepages, cells=_FASTSIM_CELLS)
    lines = slice(0, -1)
    along = np.stack([np.zeros_like(fy), np.cos(angle[lines]), np.sin(angle[lines])], axis=1)
    tangential = np.array([1.0, 0.0, 0.0]) * fx[:, None] + along * fy[:, None]
    of_strips = normal[lines] * line[:, None] + tangential
    patch = PatchForce(
        normal_force_N=load,
        fx_N=float(fx.sum()),
        fy_N=float(fy.sum()),
        angle_rad=float(angle[-1]),
        place_mm=(float(place[-1, 0]), float(place[-1, 1]), float(place[-1, 2])),
        radius_mm=float(np.interp(centre_s, overlap.s_mm, overlap.radius_mm)),
        a_mm=piece.contact.a_mm,
        b_mm=piece.contact.b_mm,
        creepages=plane,
        problem=pressed.problem,
    )
    return WheelForce(
        force_N=of_strips.sum(axis=0),
        moment_Nmm=np.cross(arm[lines], of_strips).sum(axis=0) + turning_moment @ normal[lines],
        power_per_speed_N=-float((velocity[lines] * tangential).sum() + spin[lines] @ turning_moment),
        turned_N=motion.curvature_per_mm * float(of_strips[:, 1] @ arm[lines, 0]),
        patches=(patch,),
    )


def rigid_slip(arm_mm: Floats, motion: Motion, radius_mm: float) -> tuple[Floats, Floats]:
    """Velocity (n, 3) of the rigid wheel against the rail at arms (n, 3) from its centre, and its turning (3,); over V.

    The rail bends as well: ahead of the axle it is turned by the curvature times the distance.
    """
    y_rate, z_rate, roll_rate, yaw_rate = motion.rates
    kappa = motion.curvature_per_mm
    turning = (1.0 + motion.slip) / radius_mm * motion.axle + np.array([roll_rate, 0.0, kappa + yaw_rate])
    forward = np.array([1.0 - kappa * motion.shift_mm, y_rate, z_rate])
    velocity = forward + np.cross(turning, arm_mm)
    velocity[:, 1] -= kappa * arm_mm[:, 0]
    return velocity, turning


def _piece(pressed: Pressed, across: Floats, law: ContactLaw) -> Strips:
    """The patch for FASTSIM, with the ellipse of its second moments."""
    piece = Strips.of(
        law.pair,
        y_mm=across,
        width_mm=pressed.width_mm,
        middle_x_mm=np.zeros_like(across),
        half_length_mm=pressed.half_length_mm,
        force_N_per_mm=pressed.force_N_per_mm,
    )
    ellipse = piece.contact
    slender = math.sqrt(min(max(ellipse.a_mm / ellipse.b_mm, 1.0 / _MOST_SLENDER), _MOST_SLENDER))
    size = math.sqrt(ellipse.a_mm * ellipse.b_mm)
    return replace(piece, contact=replace(ellipse, a_mm=size * slender, b_mm=size / slender))


# --- The projected algebraic system of steady motion: what must vanish where a vehicle runs at rest in the moving
# frame.

GRAVITY_M_S2 = 9.81
# Of a wheelset: shift and height (mm), roll and yaw (mrad), slip of rotation (thousandths); of a frame without two.
WHEELSET_SIZE, FRAME_SIZE = 5, 3
_MILLI = 1e-3
_UNITS = np.array([1.0, 1.0, _MILLI, _MILLI, _MILLI])
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
    y, z, roll, yaw, slip = (float(one) for one in state * _UNITS)
    own = (0.0, 0.0, 0.0, 0.0) if rates is None else tuple(float(one) for one in rates * _UNITS[:4])
    return Motion(
        shift_mm=y, height_mm=z, roll_rad=roll, yaw_rad=yaw, slip=slip, curvature_per_mm=curvature_per_mm, rates=own
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
    return np.array([lateral, load * down, 0.0, -_MILLI * vehicle.guide.yaw_Nm_per_rad * state[3], 0.0])


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


# --- Equilibria of steady motion: Newton's method at one curvature, and the path of them from straight track on.

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
        self._broken_at = None if self._known[0].status == "equilibrium" else 0.0

    def to(self, curvature: float) -> Equilibrium:
        """The equilibrium at a curvature beyond those before."""
        sign = -1.0 if curvature < 0.0 else 1.0
        while self._broken_at is None and abs(self._here) < abs(curvature):
            self._forward(curvature, sign)
        if self._broken_at is not None:
            return self._beyond(curvature)
        last = self._known[-1]
        return last if self._here == curvature else solve_at(last.state, self._vehicle, self._lines(curvature))

    @property
    def _here(self) -> float:
        return self._known[-1].line.curvature_per_mm

    def _forward(self, curvature: float, sign: float) -> None:
        """One step towards a curvature, or the note that there is none."""
        step = min(self._step, abs(curvature) - abs(self._here))
        there = curvature if step == abs(curvature) - abs(self._here) else self._here + sign * step
        start, slopes = self._predicted(there), self._known[-1].slopes
        one = solve_at(start, self._vehicle, self._lines(there), slopes=slopes, between=there != curvature)
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
