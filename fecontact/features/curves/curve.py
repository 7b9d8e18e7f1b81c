"""Steady motion of a vehicle in curves.

The module has the conditions of track and running, and the positions and forces of all wheels.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import STEEL, Material, TrackSide, combine_moduli_MPa
from fecontact.contact_theories.rolling.creepage import combine_materials
from fecontact.errors import InputError
from fecontact.features.curves.balance import Balance, TrackConditions, split_wheelset_states
from fecontact.features.curves.conditions import DEFAULT_THEORY, MAX_UNBALANCED_M_S2, Conditions
from fecontact.features.curves.model import GRAVITY_M_S2, Vehicle
from fecontact.features.curves.normal import Surfaces, normal_theory, place_wheel
from fecontact.features.curves.steady import CANT_BASE_MM, Equilibrium, follow_path
from fecontact.features.curves.wheel_forces import ContactSettings, PatchForce
from fecontact.placement.poses import sample_profile
from fecontact.placement.wheel_on_rail import Pair
from fecontact.placement.wheelset import TRACK_SIDES, Wheelset

# --- Track and running conditions in a curve: cant, speed, friction, and the pair of wheel and rail.

# Smallest radius: trams run in tighter curves, with guard rails.
_MIN_RADIUS_M = 50.0
# Tolerance and largest value of the search for the largest shift.
_SHIFT_TOLERANCE_MM, _MAX_SHIFT_MM = 0.1, 30.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Ride:
    """Track of a vehicle, and settings for the evaluation of its contacts.

    Attributes
    ----------
    wheelset
        Both wheels over their rails, with the vehicle's rolling radius.
    conditions
        Friction, cant and speed.
    theory
        Name of the theory of the normal force.
    materials
        Materials of wheel and rail.
    """

    wheelset: Wheelset
    conditions: Conditions = field(default_factory=Conditions)
    theory: str = DEFAULT_THEORY
    materials: tuple[Material, Material] = (STEEL, STEEL)


def make_track_conditions(ride: Ride, *, widest_per_mm: float) -> Callable[[float], TrackConditions]:
    """Make the track and running conditions as a function of the curvature (1/mm).

    Parameters
    ----------
    ride
        Wheelset, conditions, theory and materials.
    widest_per_mm
        Curvature of the widest requested curve. From straight track to this curvature, cant and unbalanced acceleration
        grow linearly from zero.

    Returns
    -------
    callable
        Track and running conditions at a curvature (1/mm), positive to the left.
    """
    wheelset, conditions = ride.wheelset, ride.conditions
    left, right = Surfaces.make_sides(wheelset)
    law = ContactSettings(
        normal=normal_theory(ride.theory),
        contact_modulus_MPa=combine_moduli_MPa(*ride.materials),
        pair=combine_materials(conditions.friction, *ride.materials),
    )

    def track_at(curvature_per_mm: float) -> TrackConditions:
        """Track and running conditions at a curvature (1/mm)."""
        fraction = min(1.0, abs(curvature_per_mm / widest_per_mm)) if curvature_per_mm else 0.0
        cant_rad = fraction * math.asin(conditions.cant_mm / CANT_BASE_MM)
        return TrackConditions(
            left=left,
            right=right,
            law=law,
            curvature_per_mm=curvature_per_mm,
            # the outer rail is higher
            cant_rad=-math.copysign(cant_rad, curvature_per_mm),
            speed_m_s=_compute_speed_m_s(conditions, curvature_per_mm, cant_rad, fraction),
        )

    return track_at


def make_straight_track(ride: Ride) -> TrackConditions:
    """Make the conditions of straight track without cant, for small motions about the equilibrium.

    Parameters
    ----------
    ride
        Wheelset, conditions, theory and materials.

    Returns
    -------
    TrackConditions
        Straight track at speed 0. The half-space has its finer grid for derivatives.
    """
    track = make_track_conditions(ride, widest_per_mm=math.inf)(0.0)
    return replace(track, speed_m_s=0.0, law=replace(track.law, normal=normal_theory(ride.theory, fine=True)))


def _compute_speed_m_s(conditions: Conditions, curvature_per_mm: float, tilt_rad: float, fraction: float) -> float:
    """Compute the speed from the unbalanced acceleration, if no speed is given.

    Raises
    ------
    InputError
        If the unbalanced acceleration is less than that of a vehicle at rest on the cant.
    """
    if conditions.speed_km_h is not None:
        return conditions.speed_km_h / 3.6
    if curvature_per_mm == 0.0:
        return 0.0
    lateral_acceleration = fraction * conditions.unbalanced_m_s2 + GRAVITY_M_S2 * math.sin(tilt_rad)
    if lateral_acceleration < 0.0:
        raise InputError(
            f"unbalanced acceleration is {conditions.unbalanced_m_s2:g} m/s2; allowed: at least the value of a vehicle"
            f" at rest on the cant of {conditions.cant_mm:g} mm; increase the acceleration or the cant"
        )
    return math.sqrt(lateral_acceleration / (1e3 * abs(curvature_per_mm) * math.cos(tilt_rad)))


def curvatures_per_mm(radii_m: Sequence[float], vehicle: Vehicle, wheelset: Wheelset) -> list[float]:
    """Convert radii to curvatures, and check them.

    Parameters
    ----------
    radii_m
        Radii, positive to the right and negative to the left.
    vehicle
        Vehicle; its wheelbase limits the radius.
    wheelset
        Both wheels over their rails.

    Returns
    -------
    list of float
        Curvatures in 1/mm, positive to the left.

    Raises
    ------
    InputError
        If a radius is too small, since the wheelbase's arrow in the curve must fit into the clearance of the gauge; or
        if a wheel cannot stand on its rail.
    """
    min_radius, reason = _MIN_RADIUS_M, "tighter curves need guard rails"
    if vehicle.bogie is not None:
        clearance = sum(_find_largest_shift_mm(side.pair) for side in (wheelset.left, wheelset.right))
        arrow = 0.5 * (1e3 * vehicle.bogie.frame.half_wheelbase_m) ** 2
        if 1e-3 * arrow > min_radius * clearance:
            # the clearance is accurate to the tolerance
            min_radius = 1e-3 * arrow / max(clearance, _SHIFT_TOLERANCE_MM)
            reason = f"the wheelbase does not fit into the clearance of {clearance:.1f} mm"
    for radius in radii_m:
        if not math.isfinite(radius) or abs(radius) < min_radius:
            raise InputError(
                f"radius is {radius:g} m; allowed: at least {min_radius:.0f} m, negative to the left; {reason}"
            )
    return [-1e-3 / radius for radius in radii_m]


def _find_largest_shift_mm(pair: Pair) -> float:
    """Find the shift at which a wheel reaches the steepest place of its flange.

    The wheel has no roll and no yaw. The shift is accurate to 0.1 mm, and at most 30 mm.
    """
    place_wheel(pair, 0.0)
    low, high = 0.0, _MAX_SHIFT_MM
    while high - low > _SHIFT_TOLERANCE_MM:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if isinstance(pair.placed(middle, 0.0, 0.0), str) else (middle, high)
    return low


def check_speed(vehicle: Vehicle, track: TrackConditions) -> None:
    """Refuse a speed that is too high for a curve.

    Parameters
    ----------
    vehicle
        Vehicle, with its masses and heights.
    track
        Track and running conditions in the curve.

    Raises
    ------
    InputError
        If the inner wheels carry no load, or if the unbalanced acceleration is more than 2 m/s2. The message has the
        speed and the largest allowed speed.
    """
    across, down = track.acceleration_m_s2
    height_m = 1e-3 * vehicle.wheelset.rolling_radius_mm
    if vehicle.bogie is not None:
        body, frame = vehicle.bogie.body, vehicle.bogie.frame
        masses = (body.mass_kg, 2.0 * frame.mass_kg, 4.0 * vehicle.wheelset.mass_kg)
        heights = (body.height_m, frame.height_m, height_m)
        height_m = sum(mass * height for mass, height in zip(masses, heights, strict=True)) / sum(masses)
    curvature, cant = 1e3 * abs(track.curvature_per_mm), abs(track.cant_rad)
    message = f"speed is {3.6 * track.speed_m_s:.0f} km/h at R {1.0 / curvature:.0f} m; allowed: below"
    if abs(across) * height_m >= abs(down) * 0.5e-3 * CANT_BASE_MM:
        max_speed = math.sqrt(GRAVITY_M_S2 * math.tan(math.atan(0.5e-3 * CANT_BASE_MM / height_m) + cant) / curvature)
        raise InputError(f"{message} {3.6 * max_speed:.0f} km/h, where the vehicle overturns; reduce the speed")
    if abs(across) > MAX_UNBALANCED_M_S2 + _SPEED_ROUNDING_M_S2:
        max_speed = math.sqrt((MAX_UNBALANCED_M_S2 + GRAVITY_M_S2 * math.sin(cant)) / (curvature * math.cos(cant)))
        raise InputError(
            f"{message} {3.6 * max_speed:.0f} km/h, where the unbalanced acceleration is {MAX_UNBALANCED_M_S2:g} m/s2;"
            " reduce the speed or increase the cant"
        )


# --- Steady motion in curves: positions and forces of all wheels at several radii, by a theory of the contact.

CurveStatus = Literal["equilibrium", "no equilibrium", "derails"]
# A contact within this angle of the steepest place of the flange climbs.
_CLIMBING_MARGIN_RAD = math.radians(0.5)
_SPEED_ROUNDING_M_S2 = 1e-9
# A wheel with a smaller largest angle has no flange; flanges have 60 to 75 degrees.
_MIN_FLANGE_ANGLE_RAD = math.radians(40.0)


@dataclass(frozen=True, kw_only=True)
class WheelRun:
    """Wheel in steady motion.

    Attributes
    ----------
    side
        `left` or `right`.
    lateral_force_N, vertical_force_N
        Forces on the rail: Y outwards, away from the track, and Q.
    patches
        Forces of the patches in the frame of the left side; a right wheel is mirrored to the left side.
    """

    TELLS = ("side", "normal_force_N", "lateral_force_N", "vertical_force_N", "y_over_q", "t_gamma_N", "patches")

    side: TrackSide
    lateral_force_N: float
    vertical_force_N: float
    patches: tuple[PatchForce, ...]

    @property
    def y_over_q(self) -> float:
        """Ratio Y/Q of guiding force and vertical force; NaN without a vertical force."""
        return self.lateral_force_N / self.vertical_force_N if self.vertical_force_N > 0.0 else math.nan

    @property
    def sorted_patches(self) -> tuple[PatchForce, ...]:
        """Patches by decreasing normal force."""
        return tuple(sorted(self.patches, key=lambda patch: patch.normal_force_N, reverse=True))

    @property
    def normal_force_N(self) -> float:
        """Sum of the normal forces of all patches."""
        return sum(patch.normal_force_N for patch in self.patches)

    @property
    def t_gamma_N(self) -> float:
        """T-gamma, the wear number, of all patches: power of slip divided by the running speed."""
        return sum(patch.t_gamma_N for patch in self.patches)


@dataclass(frozen=True, kw_only=True)
class WheelsetRun:
    """Wheelset in steady motion.

    Attributes
    ----------
    lateral_shift_mm, height_mm, roll_mrad
        Lateral shift, height of the centre in the track frame, and roll.
    yaw_mrad
        Yaw against the track: the angle of attack.
    slip
        Speed of rotation divided by the speed of rotation that rolls on the tape circle, minus 1.
    wheels
        Left wheel and right wheel.
    """

    lateral_shift_mm: float
    height_mm: float
    yaw_mrad: float
    roll_mrad: float
    slip: float
    wheels: tuple[WheelRun, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class CurveRun:
    """Steady motion of a vehicle in a curve.

    Attributes
    ----------
    radius_m
        Radius, positive to the right, where the left wheels are the outer wheels.
    theory
        Name of the theory of the normal force.
    speed_km_h, unbalanced_m_s2
        Running speed, and lateral acceleration that the cant leaves, positive outwards.
    status, notes
        Whether the state is an equilibrium, and remarks on it. Without an equilibrium the numbers are those of the best
        attempt.
    wheelsets
        Motion of each wheelset, the leading wheelset first; empty if the forces could not be computed at any start.
    pull_N, power_per_speed_N
        Force that keeps the speed, and power of slip divided by the speed; NaN without wheelsets.
    resistance_N_per_kN
        Pull divided by the weight.
    left_over_N
        Largest force, or moment at an arm of a metre, that is not in balance.
    path_ends_m
        Radii at which paths end before this curve, the path from straight track first; empty for a curve on this path.
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
        """Whether the numbers describe an equilibrium; an equilibrium that derails is included."""
        return self.status != "no equilibrium"


def solve_curves(vehicle: Vehicle, ride: Ride, radii_m: Sequence[float]) -> Iterator[CurveRun]:
    """Solve the steady motion in curves along the path from straight track.

    Curves to the right come first, and the widest curve of each side comes first. All inputs are checked at once. Each
    curve is solved when it is requested from the iterator.

    Parameters
    ----------
    vehicle
        Vehicle.
    ride
        Wheelset, conditions, theory and materials.
    radii_m
        Radii, positive to the right, negative to the left.

    Yields
    ------
    CurveRun
        Positions and forces in each curve.

    Raises
    ------
    InputError
        For radii that do not fit into the gauge, speeds at which the vehicle overturns, and unknown theories.

    Notes
    -----
    Source: Otero Yugat, Part I, eq. 15 and 16. Range of validity: steady motion at unbalanced accelerations of up to
    2 m/s2, without a lateral stop of the body.
    """
    curvatures = dict(zip(curvatures_per_mm(radii_m, vehicle, ride.wheelset), radii_m, strict=True))
    paths: list[tuple[list[float], Iterator[Equilibrium]]] = []
    for sign in (-1.0, 1.0):
        if side_curvatures := sorted((curvature for curvature in curvatures if curvature * sign > 0.0), key=abs):
            track_at = make_track_conditions(ride, widest_per_mm=abs(side_curvatures[0]))
            for curvature in side_curvatures:
                check_speed(vehicle, track_at(curvature))
            paths.append((side_curvatures, follow_path(vehicle, track_at, side_curvatures)))
    return (
        _make_curve_run(curvatures[curvature], vehicle, ride, equilibrium)
        for side_curvatures, equilibria in paths
        for curvature, equilibrium in zip(side_curvatures, equilibria, strict=True)
    )


def _make_curve_run(radius: float, vehicle: Vehicle, ride: Ride, equilibrium: Equilibrium) -> CurveRun:
    """Make the result in a curve from its equilibrium.

    `radius` is in m, positive to the right. An equilibrium in which a wheel climbs has the status `derails`; without a
    balance the forces are NaN, and there are no wheelsets.
    """
    across, down = equilibrium.track.acceleration_m_s2
    runs = () if equilibrium.balance is None else _make_wheelset_runs(equilibrium.state, vehicle, equilibrium.balance)
    weight = sum(wheel.vertical_force_N for run in runs for wheel in run.wheels) * GRAVITY_M_S2 / abs(down)
    pull, power = (
        (math.nan, math.nan)
        if equilibrium.balance is None
        else (equilibrium.balance.pull_N, equilibrium.balance.power_per_speed_N)
    )
    derails = (
        _describe_derailment(runs, ride.wheelset, equilibrium.track.law.pair.friction)
        if equilibrium.status == "equilibrium"
        else ()
    )
    return CurveRun(
        radius_m=radius,
        theory=ride.theory,
        speed_km_h=3.6 * equilibrium.track.speed_m_s,
        unbalanced_m_s2=-math.copysign(1.0, equilibrium.track.curvature_per_mm) * across,
        status="derails" if derails else equilibrium.status,
        notes=(*equilibrium.notes, *derails),
        wheelsets=runs,
        pull_N=pull,
        power_per_speed_N=power,
        resistance_N_per_kN=1e3 * pull / weight if weight > 0.0 else math.nan,
        left_over_N=equilibrium.left_over_N,
        path_ends_m=tuple(-1e-3 / end if end else math.inf for end in equilibrium.path_ends_per_mm),
    )


def _make_wheelset_runs(state: Floats, vehicle: Vehicle, balance: Balance) -> tuple[WheelsetRun, ...]:
    """Make the results of all wheelsets from the state and the forces of the rails.

    Shifts are in mm, angles in mrad and forces in N. The lateral force of a wheel on its rail is positive outwards,
    towards the field side of the rail.
    """
    return tuple(
        WheelsetRun(
            lateral_shift_mm=float(wheelset_state[0]),
            yaw_mrad=float(wheelset_state[3]),
            height_mm=float(wheelset_state[1]),
            roll_mrad=float(wheelset_state[2]),
            slip=1e-3 * float(wheelset_state[4]),
            wheels=tuple(
                WheelRun(
                    side=side,
                    lateral_force_N=-sign * float(wheel.force_N[1]),
                    vertical_force_N=float(wheel.force_N[2]),
                    patches=wheel.patches,
                )
                for side, sign, wheel in zip(TRACK_SIDES, (1.0, -1.0), wheels, strict=True)
            ),
        )
        for wheelset_state, wheels in zip(split_wheelset_states(state, vehicle), balance.wheels, strict=True)
    )


def _describe_derailment(runs: Sequence[WheelsetRun], wheelset: Wheelset, friction: float) -> tuple[str, ...]:
    """Reasons why a wheel climbs in an equilibrium.

    A wheel climbs beyond Nadal's limit, or on the steepest place of its flange.
    """
    notes = []
    for wheelset_number, wheelset_run in enumerate(runs, start=1):
        for side, wheel in zip(TRACK_SIDES, wheelset_run.wheels, strict=True):
            flange_angle = find_flange_angle_rad(wheelset, side)
            if flange_angle < _MIN_FLANGE_ANGLE_RAD:
                continue
            limit = compute_nadal_limit(flange_angle, friction)
            main_patch = max(wheel.patches, key=lambda patch: patch.normal_force_N, default=None)
            # the flange of the other wheel is away from its rail, and only friction guides that wheel
            shift_to_rail = wheelset_run.lateral_shift_mm if side == "left" else -wheelset_run.lateral_shift_mm
            if wheel.y_over_q > limit and shift_to_rail > 0.0:
                notes.append(
                    f"wheelset {wheelset_number}, {side}: Y/Q {wheel.y_over_q:.2f} exceeds Nadal's limit {limit:.2f}"
                )
            elif main_patch is not None and main_patch.angle_rad > flange_angle - _CLIMBING_MARGIN_RAD:
                notes.append(f"wheelset {wheelset_number}, {side}: the wheel runs on the steepest place of its flange")
    return tuple(notes)


def find_flange_angle_rad(wheelset: Wheelset, side: TrackSide) -> float:
    """Largest angle (rad) of a wheel's flange.

    Parameters
    ----------
    wheelset
        Both wheels over their rails.
    side
        `left` or `right`.

    Returns
    -------
    float
        Angle in rad; 0 without a flange.
    """
    profile = (wheelset.left if side == "left" else wheelset.right).pair.wheel
    points = sample_profile(profile)[1].select(slice(1, -1))
    return float(np.max(np.where(points.y < 0.0, np.arctan2(points.dz, points.dy), 0.0)))


def compute_nadal_limit(angle_rad: float, friction: float) -> float:
    """Compute Nadal's limit of Y/Q, above which a wheel climbs on its flange.

    Parameters
    ----------
    angle_rad
        Angle of the flange.
    friction
        Coefficient of friction.

    Returns
    -------
    float
        (tan d - mu) / (1 + mu tan d).

    Notes
    -----
    Source: Nadal (1908). Range of validity: a single contact on the flange with full slip across; safe for small angles
    of attack, at which longitudinal slip also uses friction.

    Examples
    --------
    >>> import math
    >>> from fecontact.features.curves.curve import compute_nadal_limit
    >>> round(compute_nadal_limit(math.radians(70.0), 0.3), 3)
    1.342
    """
    flange_slope = math.tan(angle_rad)
    return (flange_slope - friction) / (1.0 + friction * flange_slope)
