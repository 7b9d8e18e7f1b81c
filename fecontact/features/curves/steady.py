"""Steady motion of a vehicle on curved track: the forces of the rails, what must vanish, and where it does.

Otero Yugat's equation of motion (Part I, eq. 15), M qdd + Cq^T lambda = Qv + Qext with the constraints C(q, t) = 0, is
taken for each body in a track frame that runs along, turned with the track. Steady motion has a constant position there
(eq. 16, whose dot on lambda is a misprint), and M qdd - Qv are the centripetal and gyroscopic terms (`without_rails`).
Qext are weight, suspension (`_external`) and the forces of the rails (`wheel_force`). The constraints are the rigid
wheelset and the given speed; the force lambda of the latter is the pull that the curve costs (`Balance.pull_N`).
Projected on the five directions that are left to each wheelset, and on three of a frame, nothing but algebra remains.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Literal, Protocol, TypeVar

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import RollingPair
from fecontact.contact_theories.rolling.fastsim import Strips, strip_forces
from fecontact.contact_theories.rolling.laws import Creepages, CurvedCreepages
from fecontact.errors import InputError
from fecontact.features.curves.model import GRAVITY_M_S2, Bogie, Vehicle
from fecontact.features.curves.normal import (
    NormalTheory,
    OutOfReach,
    Overlap,
    Pressed,
    Surfaces,
    press,
    standing,
    within_reach,
)

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
    place (4,)
        Lateral shift and height (mm), roll and yaw (rad).
    slip
        Speed of rotation over that which rolls the tape circle, less 1.
    curvature_per_mm
        Of the track, positive to the left.
    rates (4,)
        Of the place; zero in steady motion.
    """

    place: Floats
    slip: float
    curvature_per_mm: float
    rates: Floats = field(default_factory=lambda: np.zeros(4))

    def mirrored(self) -> Motion:
        """The motion of the right wheel, mirrored to a left wheel."""
        mirror = np.array([-1.0, 1.0, -1.0, -1.0])
        curvature = -self.curvature_per_mm
        return replace(self, place=self.place * mirror, curvature_per_mm=curvature, rates=self.rates * mirror)

    @property
    def axle(self) -> Floats:
        """Direction (3,) of the axle to the left."""
        (cr, cy), (sr, sy) = np.cos(self.place[2:]), np.sin(self.place[2:])
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
    """Force on a left wheel; zero where it does not touch.

    Raises
    ------
    OutOfReach
        If the wheel lies in the rail where no theory has a force.
    """
    overlap = surfaces.overlap(*map(float, motion.place))
    pressed = press(overlap, law.normal, law.contact_modulus_MPa)
    with within_reach():
        parts = [
            _patch_force(patch, overlap, motion, law, surfaces.pair.rolling_radius_mm) for patch in pressed if overlap
        ]
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
    here = overlap.at(np.append(pressed.s_mm, centre_s))
    place, angle = here.place_mm, here.angle_rad
    normal = np.stack([np.zeros_like(angle), -np.sin(angle), np.cos(angle)], axis=1)
    arm = place - np.array([0.0, *motion.place[:2]])
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
        radius_mm=float(here.radius_mm[-1]),
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
    forward = np.array([1.0 - kappa * motion.place[0], y_rate, z_rate])
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

# Of a wheelset: shift and height (mm), roll and yaw (mrad), slip of rotation (thousandths); of a frame without two.
WHEELSET_SIZE, FRAME_SIZE = 5, 3
_MILLI = 1e-3
_UNITS = np.array([1.0, 1.0, _MILLI, _MILLI])
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
    place, slip = state[:4] * _UNITS, _MILLI * float(state[4])
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
    return np.array([lateral, load * down, 0.0, -_MILLI * vehicle.guide.yaw_Nm_per_rad * state[3], 0.0])


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


# --- Where what is left over vanishes: Newton's method with slopes that follow.

_HALVINGS = 4
# So many iterations that do not bring what is left over below this part of the least before end the search; between
# asked places, where a smaller step is at hand, the first.
_STALLS, _STALLED = 5, 0.7
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
    stalls: int = _STALLS,
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


# --- Equilibria of steady motion at one curvature, and the path of them from straight track on.

Status = Literal["equilibrium", "no equilibrium"]

TOLERANCE_N = 1e-4
"""Of forces, and of moments at an arm of a metre: a billionth of an axle load."""
# What iterations strive for; theories that search in themselves do not come so far.
_WANTED_N, _ITERATIONS = 1e-6, 30
# The same between asked places on a path.
_BETWEEN_N, _FEW = 1.0, 12
# Curvature (1/mm) of the first step from straight track, growth of steps, and the smallest part of a curvature.
_FIRST_STEP, _GROWTH, _SMALLEST_STEP = 5e-8, 2.0, 1e-3
# Two places on the path have a direction if they are farther apart than this part of their curvature.
_APART = 0.02
# Farther (mm, mrad) from where the path leads an equilibrium is taken for one of another path; and beyond a place where
# none was met, over which a path may end and another one begin.
_ON_THE_PATH, _BEYOND_A_GAP = 0.5, 0.1
_STARTS_MM = (0.0, 4.5, -4.5)
BASE_MM = 1500.0
"""Distance of the contact circles, over which cant is measured."""
PRESSED_MM = 0.1
"""How deep wheels are pressed into the rails to begin with."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Equilibrium:
    """State (n,) of steady motion, or the best that was found.

    Attributes
    ----------
    balance
        None if the forces of the rails could not be computed at the start, so that there is no better state.
    slopes (n, n)
        Of what is left over, near the state; None where they were not to be had.
    moved
        How far (mm, mrad) from its start it lies.
    notes
        From how many starts none was found; and contacts that were not solved.
    path_ends_per_mm
        Curvatures at which paths end before it, the one from straight track first; none where it is on that one.
    """

    status: Status
    line: Line
    state: Floats
    balance: Balance | None
    slopes: Floats | None
    moved: float
    notes: tuple[str, ...] = ()
    path_ends_per_mm: tuple[float, ...] = ()

    @property
    def left_over_N(self) -> float:
        """Largest component that is left over; NaN without a balance."""
        return math.nan if self.balance is None else largest(self.balance.residual_N)


def solve_at(
    start: Floats, vehicle: Vehicle, line: Line, *, slopes: Floats | None = None, between: bool = False
) -> Equilibrium:
    """The equilibrium from a start (n,).

    `slopes` (n, n) is a Jacobian from nearby. What is only `between` others on a path need not be met so well, and is
    given up where it is not near its start.
    """
    slips = [WHEELSET_SIZE * k + 4 for k in range(vehicle.wheelsets)]
    try:
        state, found, slopes = newton(
            lambda state: balance(state, vehicle, line),
            lambda state: jacobian(state, vehicle, line),
            start,
            wanted_N=_BETWEEN_N if between else _WANTED_N,
            most=_FEW if between else _ITERATIONS,
            rates=slips,
            slopes=slopes,
            near=_ON_THE_PATH if between else math.inf,
            stalls=1 if between else _STALLS,
        )
    except OutOfReach as error:
        return Equilibrium(
            status="no equilibrium",
            line=line,
            state=start,
            balance=None,
            slopes=None,
            moved=0.0,
            notes=(str(error),),
        )
    balanced = largest(found.residual_N) < (_BETWEEN_N if between else TOLERANCE_N) and not found.problems
    return Equilibrium(
        status="equilibrium" if balanced else "no equilibrium",
        line=line,
        state=state,
        balance=found,
        slopes=slopes,
        moved=largest(np.delete(state - start, slips)),
        notes=found.problems,
    )


def straight_start(vehicle: Vehicle, line: Line, shifts_mm: Sequence[float] = (0.0, 0.0)) -> Floats:
    """A state to begin with: wheelsets without roll and yaw at some shifts, pressed into the rails.

    They roll without slip on the mean radius at the rigid wheels' first touch points.
    """
    both = ((line.left, 1.0), (line.right, -1.0))
    size = WHEELSET_SIZE * vehicle.wheelsets + (FRAME_SIZE if vehicle.bogie is not None else 0)
    state = np.zeros(size)
    for k in range(vehicle.wheelsets):
        stands = [standing(surfaces.pair, sign * shifts_mm[k]) for surfaces, sign in both]
        left, right = (float(stand.wheel.centre_mm[2]) for stand in stands)
        rolling = sum(float(stand.wheel.radius(stand.first.wheel_u)) for stand in stands)
        tape_circles = sum(stand.wheel.rolling_radius_mm for stand in stands)
        state[WHEELSET_SIZE * k : WHEELSET_SIZE * (k + 1)] = (
            shifts_mm[k],
            0.5 * (left + right) - PRESSED_MM,
            # the higher wheel lifts its side
            1e3 * (left - right) / BASE_MM,
            0.0,
            (tape_circles / rolling - 1.0) / _MILLI,
        )
    return state


def path(vehicle: Vehicle, lines: Callable[[float], Line], curvatures_per_mm: Sequence[float]) -> Iterator[Equilibrium]:
    """Equilibria at curvatures of one sign, found one after the other along one path from straight track on.

    Parameters
    ----------
    lines
        Track and running conditions at a curvature (1/mm).
    curvatures_per_mm
        The widest first.

    Notes
    -----
    Each step starts where the straight line through the two equilibria before it leads, and is halved where Newton's
    method does not end, or ends too far from there. Where the smallest step fails the path has a fold, or a contact has
    vanished under load: the curvature is told, and the next equilibrium is looked for from several starts. What is
    found so need not be all, and a gap over which the path goes on by less than 0.1 mm is not seen.
    """
    yield from map(_Path(vehicle, lines).to, curvatures_per_mm)


class _Path:
    """The last equilibria of a path, from the straight on, and where it has broken."""

    def __init__(self, vehicle: Vehicle, lines: Callable[[float], Line]) -> None:
        self._vehicle, self._lines = vehicle, lines
        line = lines(0.0)
        self._known = [solve_at(straight_start(vehicle, line), vehicle, line)]
        self._step = _FIRST_STEP
        self._broken = self._known[0].status != "equilibrium"
        self._ends = [0.0] if self._broken else []
        self._missed = math.inf

    def to(self, curvature: float) -> Equilibrium:
        """The equilibrium at a curvature beyond those before."""
        sign = -1.0 if curvature < 0.0 else 1.0
        while not self._broken and abs(self._here) < abs(curvature):
            self._forward(curvature, sign)
        last = self._known[-1]
        if self._broken:
            one = self._beyond(curvature)
        elif self._here == curvature:
            one = last
        else:
            one = solve_at(last.state, self._vehicle, self._lines(curvature))
        return replace(one, path_ends_per_mm=tuple(self._ends))

    @property
    def _here(self) -> float:
        return self._known[-1].line.curvature_per_mm

    def _forward(self, curvature: float, sign: float) -> None:
        """One step towards a curvature, or the note that there is none."""
        step = min(self._step, abs(curvature) - abs(self._here))
        there = curvature if step == abs(curvature) - abs(self._here) else self._here + sign * step
        start, slopes = self._predicted(there), self._known[-1].slopes
        one = solve_at(start, self._vehicle, self._lines(there), slopes=slopes, between=there != curvature)
        if one.status == "equilibrium" and one.moved < (_ON_THE_PATH if abs(there) < self._missed else _BEYOND_A_GAP):
            # a direction is not taken from two places that are nearly one
            before = self._known[-1] if step > _APART * abs(self._here) else self._known[0]
            self._known = [before, one]
            self._step = _GROWTH * max(step, _FIRST_STEP)
            self._missed = self._missed if abs(there) < self._missed else math.inf
            return
        self._missed = min(self._missed, abs(there))
        if step < max(_SMALLEST_STEP * abs(self._here), 1e-3 * _FIRST_STEP):
            self._broken = True
            self._ends.append(there)
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
        line, vehicle = self._lines(curvature), self._vehicle
        tried: list[Equilibrium] = []
        for start in self._starts(line):
            one = solve_at(start, vehicle, line)
            if one.status == "equilibrium":
                # from here on the path is followed again
                self._known, self._broken, self._step, self._missed = [one], False, _FIRST_STEP, math.inf
                return one
            tried.append(one)
        best = min(tried, key=lambda one: math.inf if one.balance is None else one.left_over_N)
        left = f"no equilibrium was found from {len(tried)} starts"
        left += "" if best.balance is None else f": {best.left_over_N:.0f} N left"
        return replace(best, notes=(left, *best.notes))

    def _starts(self, line: Line) -> Iterator[Floats]:
        yield self._known[-1].state
        for shifts in itertools.product(_STARTS_MM, repeat=self._vehicle.wheelsets):
            # narrow clearances do not have the shifted ones
            with suppress(InputError):
                yield straight_start(self._vehicle, line, (*shifts, 0.0))
