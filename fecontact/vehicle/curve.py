"""What a vehicle does in curves: positions and forces of all wheels at several radii, by a theory of the contact."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fecontact.dimensions import TrackSide
from fecontact.geometry.poses import search_parameters
from fecontact.geometry.wheelset import SIDES, Wheelset
from fecontact.vehicle.conditions import Ride, check_overturning, curvatures_per_mm, lines_of
from fecontact.vehicle.equilibrium import Equilibrium, path
from fecontact.vehicle.model import Vehicle
from fecontact.vehicle.steady import GRAVITY_M_S2, wheelset_states
from fecontact.vehicle.wheel_force import PatchForce, WheelForce

CurveStatus = Literal["equilibrium", "no equilibrium", "derails"]
# A contact so near to the steepest place of the flange climbs.
_STEEPEST_RAD = math.radians(0.5)


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
    wheels: tuple[WheelRun, WheelRun]


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
        The leading one first.
    pull_N, power_per_speed_N
        Force that keeps the speed, and the power of slip over the speed.
    resistance_N_per_kN
        The pull over the weight.
    left_over_N
        Largest force, or moment at a metre, that is not in balance.
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

    @property
    def is_balanced(self) -> bool:
        """Whether its numbers are those of an equilibrium, be it one that derails."""
        return self.status != "no equilibrium"


def curves(vehicle: Vehicle, ride: Ride, radii_m: Sequence[float]) -> list[CurveRun]:
    """Steady motion in curves, each found on the path from straight track.

    Parameters
    ----------
    radii_m
        Positive to the right, negative to the left.

    Raises
    ------
    InputError
        For radii that the gauge does not let through, speeds at which the vehicle overturns, and unknown theories.
    """
    curvatures = dict(zip(radii_m, curvatures_per_mm(radii_m, vehicle, ride.wheelset), strict=True))
    found: dict[float, CurveRun] = {}
    for sign in (-1.0, 1.0):
        own = [radius for radius in radii_m if np.sign(curvatures[radius]) == sign]
        if not own:
            continue
        lines = lines_of(ride, widest_per_mm=min(abs(curvatures[radius]) for radius in own))
        for radius in own:
            check_overturning(vehicle, lines(curvatures[radius]))
        for radius, one in zip(own, path(vehicle, lines, [curvatures[radius] for radius in own]), strict=True):
            found[radius] = _run(radius, vehicle, ride, one)
    return [found[radius] for radius in radii_m]


def _run(radius: float, vehicle: Vehicle, ride: Ride, one: Equilibrium) -> CurveRun:
    across, down = one.line.acceleration_m_s2
    runs = tuple(
        WheelsetRun(
            lateral_shift_mm=float(state[0]),
            yaw_mrad=float(state[3]),
            roll_mrad=float(state[2]),
            wheels=(_wheel("left", wheels[0]), _wheel("right", wheels[1])),
        )
        for state, wheels in zip(wheelset_states(one.state, vehicle), one.balance.wheels, strict=True)
    )
    weight = sum(wheel.vertical_force_N for run in runs for wheel in run.wheels) * GRAVITY_M_S2 / abs(down)
    derails = _derailing(runs, ride.wheelset, one.line.law.pair.friction) if one.status == "equilibrium" else ()
    return CurveRun(
        radius_m=radius,
        theory=ride.theory,
        speed_km_h=3.6 * one.line.speed_m_s,
        unbalanced_m_s2=-math.copysign(1.0, one.line.curvature_per_mm) * across,
        status="derails" if derails else one.status,
        notes=(*one.notes, *derails),
        wheelsets=runs,
        pull_N=one.balance.pull_N,
        power_per_speed_N=one.balance.power_per_speed_N,
        resistance_N_per_kN=1e3 * one.balance.pull_N / weight if weight > 0.0 else math.nan,
        left_over_N=one.left_over_N,
    )


def _wheel(side: TrackSide, force: WheelForce) -> WheelRun:
    sign = 1.0 if side == "left" else -1.0
    return WheelRun(
        side=side,
        lateral_force_N=-sign * float(force.force_N[1]),
        vertical_force_N=float(force.force_N[2]),
        patches=force.patches,
    )


def _derailing(runs: Sequence[WheelsetRun], wheelset: Wheelset, friction: float) -> tuple[str, ...]:
    """Why an equilibrium is one of a wheel that climbs: beyond Nadal's limit, or on its flange's steepest place."""
    notes = []
    for number, run in enumerate(runs, start=1):
        for side, wheel in zip(SIDES, run.wheels, strict=True):
            steepest = steepest_rad(wheelset, side)
            limit = nadal_limit(steepest, friction)
            main = max(wheel.patches, key=lambda patch: patch.normal_force_N, default=None)
            # the other wheel has its flange away from the rail, and friction alone
            towards = run.lateral_shift_mm if side == "left" else -run.lateral_shift_mm
            if wheel.y_over_q > limit and towards > 0.0:
                notes.append(f"wheelset {number}, {side}: Y/Q {wheel.y_over_q:.2f} is beyond Nadal's {limit:.2f}")
            elif main is not None and main.angle_rad > steepest - _STEEPEST_RAD:
                notes.append(f"wheelset {number}, {side}: it runs on the steepest place of its flange")
    return tuple(notes)


def steepest_rad(wheelset: Wheelset, side: TrackSide) -> float:
    """Largest angle of a wheel's flange."""
    profile = (wheelset.left if side == "left" else wheelset.right).pair.wheel
    points = profile.evaluate(search_parameters(profile)[1:-1])
    return float(np.max(np.where(points.y < 0.0, np.arctan2(points.dz, points.dy), 0.0)))


def nadal_limit(angle_rad: float, friction: float) -> float:
    """Y/Q above which a wheel climbs on a flange of an angle: (tan d - mu) / (1 + mu tan d) (Nadal 1908)."""
    slope = math.tan(angle_rad)
    return (slope - friction) / (1.0 + friction * slope)
