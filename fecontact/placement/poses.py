"""Poses of wheel and rail, and the points at which they touch with their relative curvatures."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from fecontact.arrays import Floats, Integers
from fecontact.bodies import Track
from fecontact.errors import InputError
from fecontact.profiles.curve import Profile, Side
from fecontact.profiles.reading import remedy
from fecontact.profiles.segments import CurvePoints

_SEARCH_STEP_MM = 0.02
# Places of a head that are as high as its highest one.
_FLAT_MM = 1e-6


# A direction meets the surface if the last step along it is below this; without steps of the line it is below 1e-9.
_STEP_OF_A_LINE_MM = 1e-3
# A Newton step this small leaves less than its square over 10 mm.
_LAST_STEP_MM = 1e-5


@dataclass(frozen=True, kw_only=True, eq=False)
class RailPose:
    """A rail profile in the track frame: turned inwards by the inclination, its crown at (crown_y, crown_z) (mm)."""

    profile: Profile
    inclination_rad: float
    crown_y_mm: float
    crown_z_mm: float

    def parameter_at_y(self, y: ArrayLike) -> Floats:
        """Profile parameter of the points at the lateral position y (mm) of the track, NaN off the head."""
        return self.profile.locate(np.asarray(y, dtype=float) - self.crown_y_mm, angle_rad=-self.inclination_rad)

    def section(self, u: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Position y, z (mm) and tangent angle (rad) in the track frame at the profile parameter u."""
        p = self.profile.evaluate(u)
        return (*self.point(p.y, p.z), p.angle_rad + self.inclination_rad)

    def height_at_y(self, y: Floats) -> Floats:
        """Height (mm) at the lateral position y (mm) of the track, NaN off the head."""
        p = self.profile.evaluate(self.parameter_at_y(y))
        return self.point(p.y, p.z)[1]

    @cached_property
    def seen_from_above(self) -> tuple[Floats, Floats]:
        """Lateral positions and heights (mm) of the part of the head that is seen from above, `_SEARCH_STEP_MM` apart.

        Empty where none is.
        """
        u, points = search_points(self.profile)
        y, z = self.point(points.y, points.z)
        with np.errstate(invalid="ignore"):
            seen = np.abs(self.parameter_at_y(y) - u) < 1e-6
        return y[seen], z[seen]

    def point(self, y: Floats, z: Floats) -> tuple[Floats, Floats]:
        """Position y, z (mm) in the track frame of a point at y, z (mm) of the profile."""
        c, s = np.cos(self.inclination_rad), np.sin(self.inclination_rad)
        return self.crown_y_mm + y * c - z * s, self.crown_z_mm + y * s + z * c


# cached: one rail carries many positions
@lru_cache(maxsize=64)
def place_rail(profile: Profile, inclination_rad: float, track: Track) -> RailPose:
    """Incline a rail and set it to gauge, its highest point at z = 0.

    Raises
    ------
    InputError
        If the head does not reach down to the gauge plane and no crown position is given.
    """
    at_origin = RailPose(profile=profile, inclination_rad=inclination_rad, crown_y_mm=0.0, crown_z_mm=0.0)
    u, points = search_points(profile)
    _, z = at_origin.point(points.y, points.z)
    top = int(np.argmax(z))
    u_top = u[top]
    if 0 < top < u.size - 1:
        ends = u[[top - 1]], u[[top + 1]]

        def slope(v: Floats) -> Floats:
            return np.sin(at_origin.section(v)[2])

        (u_top,) = sign_changes(slope, *ends, *map(slope, ends))
    z_top = float(at_origin.section(u_top)[1])
    if track.rail_crown_y_mm is not None:
        # the highest place of the rail in its own axes, which is the origin of the library's rails
        lowest = points.z.max() - _FLAT_MM
        # a level top ends at junctions, between two search points: 3 um there turn a conforming contact by 0.016 rad
        level_ends = [one.y_mm for one in profile.junctions if float(profile.height(np.array(one.y_mm))) > lowest]
        tops = np.append(points.y[points.z > lowest], level_ends)
        middle = 0.5 * (float(tops.min()) + float(tops.max()))
        from_origin = float(at_origin.point(np.array(middle), np.array(float(points.z.max())))[0])
        crown_y = track.rail_crown_y_mm - (0.0 if abs(middle) < _SEARCH_STEP_MM else from_origin)
    else:
        gauge_z = z_top - track.gauge_depth_mm
        u_gauge = profile.locate(gauge_z, angle_rad=0.5 * np.pi - inclination_rad)
        if not np.isfinite(u_gauge):
            raise InputError(_no_gauge_side(profile, z_top - float(z[0]), z_top - float(z[-1]), track.gauge_depth_mm))
        crown_y = 0.5 * track.gauge_mm - float(at_origin.section(u_gauge)[0])
    return RailPose(profile=profile, inclination_rad=inclination_rad, crown_y_mm=crown_y, crown_z_mm=-z_top)


def _no_gauge_side(profile: Profile, gauge_side_mm: float, field_side_mm: float, depth_mm: float) -> str:
    """Why a rail has no point of its gauge side at the gauge depth, by how deep both of its sides reach."""
    mirrored = (
        f"its field side reaches {field_side_mm:.2f} mm down: {remedy('rail', 'mirror', 'yes')} if it is mirrored; "
    )
    return (
        f"rail {profile.name}: its gauge side ends {gauge_side_mm:.2f} mm below the highest point, but the gauge is"
        f" measured {depth_mm:g} mm below it; {mirrored * (field_side_mm > depth_mm)}give a rail line that reaches"
        " there, a smaller gauge depth (--gauge-depth-mm, gauge_depth_mm in [track]), or the position of the rail's"
        " crown (--rail-crown-y-mm, rail_crown_y_mm)"
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class WheelPose:
    """A wheel profile revolved about the axle and set down in the track frame.

    `axes` has the wheel's own directions as columns: forward, along the axle to the field side, up. The wheelset's
    centre lies at `centre_mm`; the tape circle `tape_circle_y_mm` along the axle, with the radius `rolling_radius_mm`.
    """

    profile: Profile
    rolling_radius_mm: float
    tape_circle_y_mm: float
    axes: Floats
    centre_mm: Floats

    def radius(self, u: ArrayLike) -> Floats:
        """Distance (mm) of the running surface from the axle at the profile parameter u."""
        return np.asarray(self.rolling_radius_mm - self.profile.evaluate(u).z)

    def silhouette(self, u: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
        """Outline of the wheel as seen along the rail: angle theta (rad) about the axle, and x-, y-, z-position (mm).

        A rail is a prism, so the rigid contact is the plane contact of this outline with the rail's section.
        """
        return self.silhouette_of(self.profile.evaluate(u))

    def silhouette_of(self, p: CurvePoints) -> tuple[Floats, Floats, Floats, Floats]:
        """Outline, as in `silhouette`, at points of the profile."""
        # a vertical end of the line (the back of a flange) has no finite slope; it never touches the head
        theta = self._silhouette_angle(-p.dz / np.where(np.abs(p.dy) > 1e-12, p.dy, 1e-12))
        position = self.point(p.y, self.rolling_radius_mm - p.z, theta)
        return theta, position[..., 0], position[..., 1], position[..., 2]

    def _silhouette_angle(self, radius_rate: Floats) -> Floats:
        # on the outline the normal (e_r - r' e_axle) has no x-component
        forward, axle, up = map(float, self.axes[0])
        sine = np.minimum(np.maximum(radius_rate * (axle / math.hypot(up, forward)), -1.0), 1.0)
        return np.asarray(np.arcsin(sine) + math.atan2(up, forward))

    def point(self, y: Floats | float, radius: Floats | float, theta: Floats | float) -> Floats:
        """Track position (..., 3) in mm of a point at y (mm) across, at a radius (mm) and an angle (rad) from below."""
        local = np.empty((*np.broadcast_shapes(*map(np.shape, (y, radius, theta))), 3))
        local[..., 0] = radius * np.sin(theta)
        local[..., 1] = self.tape_circle_y_mm + y
        local[..., 2] = -radius * np.cos(theta)
        return np.asarray(self.centre_mm + local @ self.axes.T)

    def lowest_point(self, y: Floats, z: Floats) -> tuple[Floats, Floats]:
        """Position y, z (mm) in the track frame of points at y, z (mm) of the profile, straight below the axle."""
        position = self.point(y, self.rolling_radius_mm - z, 0.0)
        return position[..., 1], position[..., 2]

    def distance_along(self, points: Floats, normals: Floats, guess_mm: ArrayLike = 0.0) -> Floats:
        """Distance (mm) from points (..., 3) along unit directions (..., 3) to the wheel's running surface.

        NaN if a direction does not meet the surface within a few mm. Newton's method on the body of revolution, from a
        guess (...), to 1e-11 mm.
        """
        start = np.ascontiguousarray(((points - self.centre_mm) @ self.axes).reshape(-1, 3).T)
        along = np.ascontiguousarray((normals @ self.axes).reshape(-1, 3).T)
        y_low, y_high = self.profile.y_range_mm
        t = np.broadcast_to(np.asarray(guess_mm, float), points.shape[:-1]).reshape(-1).copy()
        active = np.arange(t.size)
        met = np.zeros(t.size, dtype=bool)
        for _ in range(12):
            n = along[:, active]
            d = start[:, active] + t[active] * n
            y = d[1] - self.tape_circle_y_mm
            rho = np.hypot(d[0], d[2])
            # beyond its ends the surface is continued by its end point; such points are removed below by their y
            p = self.profile.evaluate(self.profile.locate(np.clip(y, y_low, y_high)))
            height = self.rolling_radius_mm - p.z - rho
            # all over the slope's denominator: where the line is vertical, or the direction runs along the surface, a
            # step has no length, and the direction is not taken for one that meets the surface
            rate = (d[0] * n[0] + d[2] * n[2]) / rho * p.dy + p.dz * n[1]
            step = np.copysign(np.inf, height)
            np.divide(height * p.dy, rate, out=step, where=(rate != 0.0) & (p.dy != 0.0))
            t[active] += np.clip(step, -5.0, 5.0)
            # rounded coefficients let a line step at a junction (S1002: 2e-4 mm), and Newton steps alternate there
            met[active] = (y >= y_low) & (y <= y_high) & (np.abs(step) < _STEP_OF_A_LINE_MM)
            active = active[np.abs(step) > _LAST_STEP_MM]
            if not active.size:
                break
        return np.where(met, t, np.nan).reshape(points.shape[:-1])


# cached: equal for every position of the profile, and a table of positions has many searches
@lru_cache(maxsize=64)
def search_points(profile: Profile) -> tuple[Floats, CurvePoints]:
    """Parameters along a profile, `_SEARCH_STEP_MM` apart, and the points there."""
    u = profile.spread(_SEARCH_STEP_MM)
    u.flags.writeable = False
    return u, profile.evaluate(u)


# Coarse search among every eighth sample of 0.02 mm; places higher than the lowest of these by more than the bound are
# left out of the fine search. On two lines of R 6 the coarse samples miss a touch point by 1e-3 mm, a tenth of the
# bound.
_EVERY = 8
_NEAR_MM = 0.01
# So are places from which the gap falls to the next coarse sample by more than this. A minimum between two samples
# leaves them nearer to each other if the relative curvature is below 0.08/mm there, as on an arc of R 13; at a junction
# it may be 2e-5 mm deep and a tenth of a millimetre wide.
_FALL_MM = 1e-3


def places_near(rail: RailPose, wheel: WheelPose, points: CurvePoints, above_mm: float = 0.0) -> Integers:
    """Which points (n,) along a wheel lie about minima of the gap that are no higher than the lowest one and so much.

    None if no point lies over the rail.
    """
    (places,) = places_at_shifts(rail, wheel, points, [0.0], above_mm)
    return places


def places_at_shifts(
    rail: RailPose, wheel: WheelPose, points: CurvePoints, shifts_mm: Iterable[float], above_mm: float = 0.0
) -> list[Integers]:
    """As `places_near`, with the wheel shifted across by so much more."""
    _, _, y, z = wheel.silhouette_of(points.taken(slice(None, None, _EVERY)))
    found = []
    for shift in shifts_mm:
        gap = z - np.interp(y + shift, *rail.seen_from_above, left=-np.inf, right=-np.inf)
        near = np.isfinite(gap) & (gap < gap.min() + above_mm + _NEAR_MM)
        near[1:] &= gap[1:] <= gap[:-1] + _FALL_MM
        near[:-1] &= gap[:-1] <= gap[1:] + _FALL_MM
        beside = np.convolve(near, np.ones(5), "same") > 0.5
        found.append(np.flatnonzero(np.repeat(beside, _EVERY)[: points.y.size]))
    return found


# Secants end with a step of the parameter this small, some 2e-9 mm: the place is better than that.
_LAST_SECANT = 1e-10


def sign_changes(f: Callable[[Floats], Floats], low: Floats, high: Floats, f_low: Floats, f_high: Floats) -> Floats:
    """Where a function changes its sign between places (n,), at which it has values (n,).

    Without a change it is the end at which the function is nearer to 0.
    By secants for all places at once; the value at an end that stays is halved (Illinois, Dowell and Jarratt 1971).
    """
    # at a kink the sign change may be missed by rounding at both ends
    changes = f_low * f_high <= 0.0
    nearer = np.where(np.abs(f_low) < np.abs(f_high), low, high)
    for _ in range(100):
        with np.errstate(divide="ignore", invalid="ignore"):
            x = high - f_high * (high - low) / (f_high - f_low)
        x = np.where(changes & np.isfinite(x), x, high)
        if not np.any(np.abs(x - high)[changes] > _LAST_SECANT):
            break
        f_x = f(x)
        stays = f_x * f_high >= 0.0
        low, f_low = np.where(stays, low, high), np.where(stays, 0.5 * f_low, f_high)
        high, f_high = x, f_x
    return np.where(changes, x, nearer)


# --- Touch points of the rigid bodies: contact frame, contact angle and relative curvatures.

# A touch point this close to a junction has the curvatures of both sides: profile tolerances are hundredths of a mm.
AT_JUNCTION_MM = 1e-3


@dataclass(frozen=True, kw_only=True)
class RelativeCurvature:
    """Curvatures at a touch point (1/mm, positive where the body is convex) and the Hessian of the gap.

    gap = 1/2 (xx x^2 + 2 xy x y + yy y^2) in the contact frame. At a junction each side has its curvature.
    """

    rail_per_mm: float
    wheel_lateral_per_mm: float
    wheel_rolling_per_mm: float
    xx_per_mm: float
    xy_per_mm: float
    yy_per_mm: float

    @property
    def hessian(self) -> Floats:
        """Second derivatives of the gap (2, 2) in 1/mm."""
        return np.array([[self.xx_per_mm, self.xy_per_mm], [self.xy_per_mm, self.yy_per_mm]])


@dataclass(frozen=True, kw_only=True)
class TouchPoint:
    """A separate minimum of the vertical gap between wheel and rail.

    Attributes
    ----------
    x_mm, y_mm, z_mm
        Position in the track frame, on the rail.
    rail_y_mm, wheel_y_mm
        Position across the rail's profile and across the wheel's profile.
    contact_angle_rad
        Angle of the tangent plane about x, positive on the gauge side of the head.
    vertical_gap_mm
        Undeformed gap; 0 at the first touch point.
    curvatures
        One entry, or two entries (gauge side, field side) for a touch point at a junction.
    """

    x_mm: float
    y_mm: float
    z_mm: float
    rail_u: float
    wheel_u: float
    rail_y_mm: float
    wheel_y_mm: float
    contact_angle_rad: float
    vertical_gap_mm: float
    curvatures: tuple[RelativeCurvature, ...]

    @property
    def curvature(self) -> RelativeCurvature:
        """The curvature; at a junction the curvature of the field side."""
        return self.curvatures[-1]

    @property
    def at_junction(self) -> bool:
        """Whether the touch point lies at a junction, where the curvature is undefined."""
        return len(self.curvatures) > 1

    @property
    def tangent(self) -> Floats:
        """Lateral unit vector of the contact frame in the track frame."""
        return np.array([0.0, np.cos(self.contact_angle_rad), np.sin(self.contact_angle_rad)])

    @property
    def normal(self) -> Floats:
        """Normal unit vector of the contact frame in the track frame, from the rail to the wheel."""
        return np.array([0.0, -np.sin(self.contact_angle_rad), np.cos(self.contact_angle_rad)])


def touch_points_at(
    rail: RailPose, wheel: WheelPose, u_wheel: Floats, u_rail: Floats, gap: Floats
) -> tuple[TouchPoint, ...]:
    """The touch points at parameters (n,) of both lines with gaps (n,) in mm between them, and their curvatures."""
    on_wheel, on_rail = wheel.profile.evaluate(u_wheel), rail.profile.evaluate(u_rail)
    theta, x, y, _ = wheel.silhouette_of(on_wheel)
    _, z = rail.point(on_rail.y, on_rail.z)
    angle = on_rail.angle_rad + rail.inclination_rad
    at_wheel, at_rail = wheel.profile.snap(u_wheel, AT_JUNCTION_MM), rail.profile.snap(u_rail, AT_JUNCTION_MM)
    right = _relative_curvatures(rail, wheel, at_wheel, at_rail, theta, angle, "right")
    at_end = np.any((at_wheel % 1.0 == 0.0) | (at_rail % 1.0 == 0.0))
    left = _relative_curvatures(rail, wheel, at_wheel, at_rail, theta, angle, "left") if at_end else right
    return tuple(
        TouchPoint(
            x_mm=float(x[i]),
            y_mm=float(y[i]),
            z_mm=float(z[i]),
            rail_u=float(u_rail[i]),
            wheel_u=float(u_wheel[i]),
            rail_y_mm=float(on_rail.y[i]),
            wheel_y_mm=float(on_wheel.y[i]),
            contact_angle_rad=float(angle[i]),
            vertical_gap_mm=float(gap[i]),
            curvatures=(of_right,) if _are_alike(of_left, of_right) else (of_left, of_right),
        )
        for i, (of_left, of_right) in enumerate(zip(left, right, strict=True))
    )


def _are_alike(left: RelativeCurvature, right: RelativeCurvature) -> bool:
    """Whether both sides of a touch point have one curvature across."""
    one, other = (c.rail_per_mm + c.wheel_lateral_per_mm for c in (left, right))
    return abs(one - other) <= 1e-6 * (abs(one) + abs(other)) + 1e-9


def _relative_curvatures(
    rail: RailPose, wheel: WheelPose, u_wheel: Floats, u_rail: Floats, theta: Floats, angle: Floats, side: Side
) -> list[RelativeCurvature]:
    p, zero = wheel.profile.evaluate(u_wheel, side), np.zeros_like(theta)
    meridian = np.arctan2(p.dz, p.dy)[:, None]
    radial = np.stack([np.sin(theta), zero, -np.cos(theta)], axis=1) @ wheel.axes.T
    round_about = np.stack([np.cos(theta), zero, np.sin(theta)], axis=1) @ wheel.axes.T
    along = np.cos(meridian) * wheel.axes[:, 1] - np.sin(meridian) * radial
    rolling = np.cos(meridian[:, 0]) / (wheel.rolling_radius_mm - p.z)
    lateral = wheel.profile.convex_sign * p.curvature_per_mm
    of_rail = rail.profile.convex_sign * rail.profile.evaluate(u_rail, side).curvature_per_mm
    tangent = np.stack([zero, np.cos(angle), np.sin(angle)], axis=1)
    (ax, ay), (bx, by) = ((v[:, 0], (v * tangent).sum(axis=1)) for v in (round_about, along))
    columns = (
        of_rail,
        lateral,
        rolling,
        rolling * ax**2 + lateral * bx**2,
        rolling * ax * ay + lateral * bx * by,
        rolling * ay**2 + lateral * by**2 + of_rail,
    )
    names = [field.name for field in fields(RelativeCurvature)]
    return [RelativeCurvature(**dict(zip(names, map(float, row), strict=True))) for row in zip(*columns, strict=True)]
