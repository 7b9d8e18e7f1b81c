"""What a vehicle does in curves: conditions of track and running, positions and forces of all wheels."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import STEEL, Material, TrackSide, contact_modulus_MPa
from fecontact.contact_theories.rolling.creepage import rolling_pair
from fecontact.criteria import FRICTION
from fecontact.errors import InputError
from fecontact.features.curves.balance import Balance, Line, wheelset_states
from fecontact.features.curves.model import GRAVITY_M_S2, Vehicle
from fecontact.features.curves.normal import DEFAULT_THEORY, Surfaces, normal_theory, place_wheel
from fecontact.features.curves.steady import CANT_BASE_MM, Equilibrium, path
from fecontact.features.curves.wheel_forces import ContactLaw, PatchForce
from fecontact.inputs.kinds import given, number
from fecontact.inputs.slots import inputs
from fecontact.placement.poses import search_points
from fecontact.placement.wheel_on_rail import Pair
from fecontact.placement.wheelset import SIDES, Wheelset

# --- Track and running conditions of a curve: cant, speed, friction, and the pair of wheel and rail.

# Trams run in tighter curves, with guard rails.
_LEAST_RADIUS_M = 50.0
MOST_UNBALANCED_M_S2 = 2.0
"""Largest lateral acceleration: from 2.2 on Newton's method stalls where a wheelset goes from tread to flange."""
_STEP_MM, _FARTHEST_MM = 0.1, 30.0


@inputs
class Conditions:
    """How a curve is run through.

    Without a speed it is that at which the acceleration that cant leaves over is `unbalanced_m_s2`.
    """

    friction: float = given(0.3, FRICTION)
    cant_mm: float = number(100.0, "Cant, over 1500 mm", high=300.0, remedy="tracks have up to 180 mm")
    unbalanced_m_s2: float = number(
        0.0,
        "Lateral acceleration in the plane of the track, outwards positive",
        label="unbalanced acceleration",
        low=-MOST_UNBALANCED_M_S2,
        high=MOST_UNBALANCED_M_S2,
        remedy="usual limits are 0.65 to 1 m/s2, those of tilting trains 2",
    )
    speed_km_h: float | None = number(None, "Running speed", remedy="leave it out for a balanced one")

    def __post_init__(self) -> None:
        """Refuse a speed beside the acceleration that would make another one.

        Raises
        ------
        InputError
            With both.
        """
        if self.speed_km_h is not None and self.unbalanced_m_s2 != 0.0:
            raise InputError(
                f"unbalanced acceleration is {self.unbalanced_m_s2:g} m/s2 and speed {self.speed_km_h:g} km/h; allowed:"
                " one of both, since one makes the other; leave one out"
            )


@dataclass(frozen=True, kw_only=True, eq=False)
class Ride:
    """What a vehicle runs on, and by what its contacts are evaluated.

    Attributes
    ----------
    wheelset
        Both wheels over their rails, with the vehicle's rolling radius.
    theory
        Of the normal force.
    materials
        Of wheel and rail.
    """

    wheelset: Wheelset
    conditions: Conditions = field(default_factory=Conditions)
    theory: str = DEFAULT_THEORY
    materials: tuple[Material, Material] = (STEEL, STEEL)


def lines_of(ride: Ride, *, widest_per_mm: float) -> Callable[[float], Line]:
    """Track and running conditions over the curvature (1/mm).

    Parameters
    ----------
    widest_per_mm
        Curvature of the widest curve that is asked for. Up to it cant and unbalanced acceleration grow from none on
        straight track.
    """
    wheelset, conditions = ride.wheelset, ride.conditions
    left, right = Surfaces.make_sides(wheelset)
    law = ContactLaw(
        normal=normal_theory(ride.theory),
        contact_modulus_MPa=contact_modulus_MPa(*ride.materials),
        pair=rolling_pair(conditions.friction, *ride.materials),
    )

    def at(curvature_per_mm: float) -> Line:
        part = min(1.0, abs(curvature_per_mm / widest_per_mm)) if curvature_per_mm else 0.0
        tilt = part * math.asin(conditions.cant_mm / CANT_BASE_MM)
        return Line(
            left=left,
            right=right,
            law=law,
            curvature_per_mm=curvature_per_mm,
            # the outer rail is the higher one
            cant_rad=-math.copysign(tilt, curvature_per_mm),
            speed_m_s=_speed_m_s(conditions, curvature_per_mm, tilt, part),
        )

    return at


def straight_line(ride: Ride) -> Line:
    """Straight track without cant, for small motions about it."""
    line = lines_of(ride, widest_per_mm=math.inf)(0.0)
    return replace(line, speed_m_s=0.0, law=replace(line.law, normal=normal_theory(ride.theory, fine=True)))


def _speed_m_s(conditions: Conditions, curvature_per_mm: float, tilt_rad: float, part: float) -> float:
    if conditions.speed_km_h is not None:
        return conditions.speed_km_h / 3.6
    if curvature_per_mm == 0.0:
        return 0.0
    across = part * conditions.unbalanced_m_s2 + GRAVITY_M_S2 * math.sin(tilt_rad)
    if across < 0.0:
        raise InputError(
            f"unbalanced acceleration is {conditions.unbalanced_m_s2:g} m/s2; allowed: no less than a vehicle has that"
            f" stands on the cant of {conditions.cant_mm:g} mm; give a larger one, or more cant"
        )
    return math.sqrt(across / (1e3 * abs(curvature_per_mm) * math.cos(tilt_rad)))


def curvatures_per_mm(radii_m: Sequence[float], vehicle: Vehicle, wheelset: Wheelset) -> list[float]:
    """Curvatures of radii, which users give positive to the right and negative to the left.

    Raises
    ------
    InputError
        If a radius is too small: the wheelbase's arrow in the curve must fit into the clearance of the gauge; or if a
        wheel does not stand on its rail.
    """
    least, why = _LEAST_RADIUS_M, "tighter ones need guard rails"
    if vehicle.bogie is not None:
        clearance = sum(_largest_shift_mm(side.pair) for side in (wheelset.left, wheelset.right))
        arrow = 0.5 * (1e3 * vehicle.bogie.frame.half_wheelbase_m) ** 2
        if 1e-3 * arrow > least * clearance:
            # which is known to a step
            least = 1e-3 * arrow / max(clearance, _STEP_MM)
            why = f"the wheelbase does not fit into the clearance of {clearance:.1f} mm"
    for radius in radii_m:
        if not math.isfinite(radius) or abs(radius) < least:
            raise InputError(f"radius is {radius:g} m; allowed: {least:.0f} m and more, negative to the left; {why}")
    return [-1e-3 / radius for radius in radii_m]


def _largest_shift_mm(pair: Pair) -> float:
    """The shift at which a wheel without roll and yaw comes to the steepest place of its flange."""
    place_wheel(pair, 0.0)
    low, high = 0.0, _FARTHEST_MM
    while high - low > _STEP_MM:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if isinstance(pair.placed(middle, 0.0, 0.0), str) else (middle, high)
    return low


def check_speed(vehicle: Vehicle, line: Line) -> None:
    """Refuse a speed at which the inner wheels carry nothing, or that is not what curves are run through with.

    Raises
    ------
    InputError
        With the speed and the largest one of the curve.
    """
    across, down = line.acceleration_m_s2
    height_m = 1e-3 * vehicle.wheelset.rolling_radius_mm
    if vehicle.bogie is not None:
        body, frame = vehicle.bogie.body, vehicle.bogie.frame
        masses = (body.mass_kg, 2.0 * frame.mass_kg, 4.0 * vehicle.wheelset.mass_kg)
        heights = (body.height_m, frame.height_m, height_m)
        height_m = sum(m * h for m, h in zip(masses, heights, strict=True)) / sum(masses)
    curvature, cant = 1e3 * abs(line.curvature_per_mm), abs(line.cant_rad)
    said = f"speed is {3.6 * line.speed_m_s:.0f} km/h at R {1.0 / curvature:.0f} m; allowed: below"
    if abs(across) * height_m >= abs(down) * 0.5e-3 * CANT_BASE_MM:
        most = math.sqrt(GRAVITY_M_S2 * math.tan(math.atan(0.5e-3 * CANT_BASE_MM / height_m) + cant) / curvature)
        raise InputError(f"{said} {3.6 * most:.0f} km/h, where the vehicle overturns; run slower")
    if abs(across) > MOST_UNBALANCED_M_S2 + _ROUNDING_M_S2:
        most = math.sqrt((MOST_UNBALANCED_M_S2 + GRAVITY_M_S2 * math.sin(cant)) / (curvature * math.cos(cant)))
        raise InputError(
            f"{said} {3.6 * most:.0f} km/h, where cant leaves {MOST_UNBALANCED_M_S2:g} m/s2 over; run slower, or give"
            " more cant"
        )


# --- What a vehicle does in curves: positions and forces of all wheels at several radii, by a theory of the contact.

CurveStatus = Literal["equilibrium", "no equilibrium", "derails"]
# A contact so near to the steepest place of the flange climbs.
_STEEPEST_RAD = math.radians(0.5)
_ROUNDING_M_S2 = 1e-9
# A wheel whose steepest place is flatter has no flange; flanges have 60 to 75 degrees.
_FLANGE_RAD = math.radians(40.0)


@dataclass(frozen=True, kw_only=True)
class WheelRun:
    """A wheel in steady motion.

    Attributes
    ----------
    lateral_force_N, vertical_force_N
        On the rail: Y outwards, away from the track, and Q.
    patches
        In the frame of the left side, as that wheel's mirror image where it is the right one.
    """

    TELLS = ("side", "normal_force_N", "lateral_force_N", "vertical_force_N", "y_over_q", "patches")

    side: TrackSide
    lateral_force_N: float
    vertical_force_N: float
    patches: tuple[PatchForce, ...]

    @property
    def y_over_q(self) -> float:
        """Guiding over vertical force; NaN where the wheel carries nothing."""
        return self.lateral_force_N / self.vertical_force_N if self.vertical_force_N > 0.0 else math.nan

    @property
    def normal_force_N(self) -> float:
        """Sum over all patches."""
        return sum(patch.normal_force_N for patch in self.patches)


@dataclass(frozen=True, kw_only=True)
class WheelsetRun:
    """A wheelset in steady motion; its yaw against the track is the angle of attack."""

    lateral_shift_mm: float
    yaw_mrad: float
    roll_mrad: float
    wheels: tuple[WheelRun, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class CurveRun:
    """A vehicle in a curve.

    Attributes
    ----------
    radius_m
        Positive to the right, where the left wheels are the outer ones.
    theory
        Of the normal force.
    status, notes
        Whether it is an equilibrium, and what is to be said of it; without one the numbers are of the best attempt.
    wheelsets
        The leading one first; none if the forces could not be computed at any start.
    pull_N, power_per_speed_N
        Force that keeps the speed, and the power of slip over the speed; NaN without wheelsets.
    resistance_N_per_kN
        The pull over the weight.
    left_over_N
        Largest force, or moment at a metre, that is not in balance.
    path_ends_m
        Radii at which paths end before this curve, the one from straight track first; none where it is on that one.
    """

    radius_m: float
    theory: str
    speed_km_h: float
    unbalanced_m_s2: float
    status: CurveStatus
    notes: tuple[str, ...]
    wheelsets: tuple[WheelsetRun, ...]
    pull_N: float
    power_per_speed_N: float
    resistance_N_per_kN: float
    left_over_N: float
    path_ends_m: tuple[float, ...] = ()

    @property
    def is_balanced(self) -> bool:
        """Whether its numbers describe an equilibrium, even one that derails."""
        return self.status != "no equilibrium"


def curves(vehicle: Vehicle, ride: Ride, radii_m: Sequence[float]) -> Iterator[CurveRun]:
    """Steady motion in curves, each found on the path from straight track: those to the right first, the widest first.

    Inputs are checked at once, curves are solved one after the other as they are asked for.

    Parameters
    ----------
    radii_m
        Positive to the right, negative to the left.

    Raises
    ------
    InputError
        For radii that the gauge does not let through, speeds at which the vehicle overturns, and unknown theories.
    """
    curvatures = dict(zip(curvatures_per_mm(radii_m, vehicle, ride.wheelset), radii_m, strict=True))
    walks: list[tuple[list[float], Iterator[Equilibrium]]] = []
    for sign in (-1.0, 1.0):
        if own := sorted((curvature for curvature in curvatures if curvature * sign > 0.0), key=abs):
            lines = lines_of(ride, widest_per_mm=abs(own[0]))
            for curvature in own:
                check_speed(vehicle, lines(curvature))
            walks.append((own, path(vehicle, lines, own)))
    return (
        _run(curvatures[curvature], vehicle, ride, one)
        for own, walk in walks
        for curvature, one in zip(own, walk, strict=True)
    )


def _run(radius: float, vehicle: Vehicle, ride: Ride, one: Equilibrium) -> CurveRun:
    across, down = one.line.acceleration_m_s2
    runs = () if one.balance is None else _wheelset_runs(one.state, vehicle, one.balance)
    weight = sum(wheel.vertical_force_N for run in runs for wheel in run.wheels) * GRAVITY_M_S2 / abs(down)
    pull, power = (math.nan, math.nan) if one.balance is None else (one.balance.pull_N, one.balance.power_per_speed_N)
    derails = _derailing(runs, ride.wheelset, one.line.law.pair.friction) if one.status == "equilibrium" else ()
    return CurveRun(
        radius_m=radius,
        theory=ride.theory,
        speed_km_h=3.6 * one.line.speed_m_s,
        unbalanced_m_s2=-math.copysign(1.0, one.line.curvature_per_mm) * across,
        status="derails" if derails else one.status,
        notes=(*one.notes, *derails),
        wheelsets=runs,
        pull_N=pull,
        power_per_speed_N=power,
        resistance_N_per_kN=1e3 * pull / weight if weight > 0.0 else math.nan,
        left_over_N=one.left_over_N,
        path_ends_m=tuple(-1e-3 / end if end else math.inf for end in one.path_ends_per_mm),
    )


def _wheelset_runs(state: Floats, vehicle: Vehicle, balance: Balance) -> tuple[WheelsetRun, ...]:
    return tuple(
        WheelsetRun(
            lateral_shift_mm=float(own[0]),
            yaw_mrad=float(own[3]),
            roll_mrad=float(own[2]),
            wheels=tuple(
                WheelRun(
                    side=side,
                    lateral_force_N=-sign * float(wheel.force_N[1]),
                    vertical_force_N=float(wheel.force_N[2]),
                    patches=wheel.patches,
                )
                for side, sign, wheel in zip(SIDES, (1.0, -1.0), wheels, strict=True)
            ),
        )
        for own, wheels in zip(wheelset_states(state, vehicle), balance.wheels, strict=True)
    )


def _derailing(runs: Sequence[WheelsetRun], wheelset: Wheelset, friction: float) -> tuple[str, ...]:
    """Why an equilibrium is one of a wheel that climbs: beyond Nadal's limit, or on its flange's steepest place."""
    notes = []
    for place, run in enumerate(runs, start=1):
        for side, wheel in zip(SIDES, run.wheels, strict=True):
            steepest = steepest_rad(wheelset, side)
            if steepest < _FLANGE_RAD:
                continue
            limit = nadal_limit(steepest, friction)
            main = max(wheel.patches, key=lambda patch: patch.normal_force_N, default=None)
            # the other wheel has its flange away from the rail, and friction alone
            towards = run.lateral_shift_mm if side == "left" else -run.lateral_shift_mm
            if wheel.y_over_q > limit and towards > 0.0:
                notes.append(f"wheelset {place}, {side}: Y/Q {wheel.y_over_q:.2f} is beyond Nadal's {limit:.2f}")
            elif main is not None and main.angle_rad > steepest - _STEEPEST_RAD:
                notes.append(f"wheelset {place}, {side}: it runs on the steepest place of its flange")
    return tuple(notes)


def steepest_rad(wheelset: Wheelset, side: TrackSide) -> float:
    """Largest angle of a wheel's flange."""
    profile = (wheelset.left if side == "left" else wheelset.right).pair.wheel
    points = search_points(profile)[1].taken(slice(1, -1))
    return float(np.max(np.where(points.y < 0.0, np.arctan2(points.dz, points.dy), 0.0)))


def nadal_limit(angle_rad: float, friction: float) -> float:
    """Y/Q above which a wheel climbs on a flange of an angle: (tan d - mu) / (1 + mu tan d) (Nadal 1908)."""
    slope = math.tan(angle_rad)
    return (slope - friction) / (1.0 + friction * slope)
