"""Track and running conditions of a curve: cant, speed, friction, and the pair of wheel and rail."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from fecontact.creep import FRICTION
from fecontact.errors import InputError
from fecontact.geometry.placement import Pair
from fecontact.geometry.wheelset import Wheelset
from fecontact.inputs.kinds import Number
from fecontact.inputs.slots import check_inputs, given
from fecontact.material import STEEL, Material, contact_modulus_MPa
from fecontact.theory.creep.contact import rolling_pair
from fecontact.vehicle.model import Vehicle
from fecontact.vehicle.normal import DEFAULT_THEORY, normal_theory
from fecontact.vehicle.steady import GRAVITY_M_S2, Line
from fecontact.vehicle.surfaces import Surfaces, standing
from fecontact.vehicle.wheel_force import ContactLaw

# Cant is measured between the contact circles.
_BASE_MM = 1500.0
# Tighter curves are those of trams, with guard rails.
_LEAST_RADIUS_M = 50.0
_STEP_MM, _FARTHEST_MM = 0.1, 30.0


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """How a curve is run through.

    Without a speed it is that at which the acceleration that cant leaves over is `unbalanced_m_s2`.
    """

    friction: float = given(0.3, FRICTION)
    cant_mm: float = given(
        100.0,
        Number(
            label="cant",
            help="Cant, over 1500 mm",
            unit="mm",
            low=0.0,
            high=300.0,
            remedy="tracks have up to 180 mm",
        ),
    )
    unbalanced_m_s2: float = given(
        0.0,
        Number(
            label="unbalanced acceleration",
            help="Lateral acceleration in the plane of the track, outwards positive",
            unit="m/s2",
            low=-3.0,
            high=10.0,
            remedy="usual limits are 0.65 to 1 m/s2",
        ),
    )
    speed_km_h: float | None = given(
        None, Number(label="speed", help="Running speed", unit="km/h", remedy="leave it out for a balanced one")
    )

    def __post_init__(self) -> None:
        check_inputs(self)


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
    left = Surfaces(pair=wheelset.left.pair)
    right = left if wheelset.symmetric else Surfaces(pair=wheelset.right.pair)
    law = ContactLaw(
        normal=normal_theory(ride.theory),
        contact_modulus_MPa=contact_modulus_MPa(*ride.materials),
        pair=rolling_pair(conditions.friction, *ride.materials),
    )

    def at(curvature_per_mm: float) -> Line:
        part = min(1.0, abs(curvature_per_mm / widest_per_mm)) if curvature_per_mm else 0.0
        tilt = part * math.asin(conditions.cant_mm / _BASE_MM)
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
            f"unbalanced acceleration is {conditions.unbalanced_m_s2:g} m/s2; allowed: not below that of a vehicle that"
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
    standing(pair, 0.0)
    low, high = 0.0, _FARTHEST_MM
    while high - low > _STEP_MM:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if isinstance(pair.placed(middle, 0.0, 0.0), str) else (middle, high)
    return low


def check_overturning(vehicle: Vehicle, line: Line) -> None:
    """Refuse a speed at which the inner wheels carry nothing.

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
    if abs(across) * height_m < abs(down) * 0.5e-3 * _BASE_MM:
        return
    most = math.sqrt(
        GRAVITY_M_S2
        * math.tan(math.atan(0.5e-3 * _BASE_MM / height_m) + abs(line.cant_rad))
        / (1e3 * abs(line.curvature_per_mm))
    )
    raise InputError(
        f"speed is {3.6 * line.speed_m_s:.0f} km/h at R {1e-3 / abs(line.curvature_per_mm):.0f} m; allowed: below"
        f" {3.6 * most:.0f} km/h, where the vehicle overturns; run slower"
    )
