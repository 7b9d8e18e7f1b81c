"""Put a wheel on a rail: touch points, contact frame, relative curvatures and the true undeformed gap.

Track frame (right-handed): x along the running direction, y lateral and positive to the field side of the left rail,
z up, origin in the track centre at the height of the rail's highest point. The pair is the left wheel on the left rail.
The wheelset turns about its centre on the axle: first roll about x, then yaw about z (both right-handed, so that
positive roll lifts this wheel and positive yaw moves it backwards).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from fecontact.errors import InputError
from fecontact.profiles.curve import Profile, Side

Floats = NDArray[np.float64]

# A touch point this close to a junction has no curvature of its own: profile tolerances are hundredths of a mm.
AT_JUNCTION_MM = 1e-3
# Gap given to rail points whose normal does not meet the wheel's running surface: far beyond any elastic approach.
OPEN_GAP_MM = 1e3
_SEARCH_STEP_MM = 0.02


@dataclass(frozen=True, kw_only=True)
class Track:
    """Track and wheelset dimensions (mm).

    The gauge is measured `gauge_depth_mm` below the highest point of the inclined rail. `rail_crown_y_mm` puts the
    crown of the rail at a given distance from the track centre instead (for heads without a gauge face).
    """

    gauge_mm: float = 1435.0
    gauge_depth_mm: float = 14.0
    back_to_back_mm: float = 1360.0
    tape_circle_from_back_mm: float = 70.0
    rail_crown_y_mm: float | None = None

    @property
    def tape_circle_y_mm(self) -> float:
        """Distance of the tape circle from the wheelset's centre."""
        return 0.5 * self.back_to_back_mm + self.tape_circle_from_back_mm


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

    def section(self, u: ArrayLike, side: Side = "right") -> tuple[Floats, Floats, Floats]:
        """Position y, z (mm) and tangent angle (rad) in the track frame at the profile parameter u."""
        p = self.profile.evaluate(u, side)
        c, s = np.cos(self.inclination_rad), np.sin(self.inclination_rad)
        return (
            self.crown_y_mm + p.y * c - p.z * s,
            self.crown_z_mm + p.y * s + p.z * c,
            p.angle_rad + self.inclination_rad,
        )


def place_rail(profile: Profile, inclination_rad: float, track: Track) -> RailPose:
    """Incline a rail and set it to gauge, its highest point at z = 0.

    Raises
    ------
    InputError
        If the head does not reach down to the gauge plane and no crown position is given.
    """
    at_origin = RailPose(profile=profile, inclination_rad=inclination_rad, crown_y_mm=0.0, crown_z_mm=0.0)
    u = _sample(profile)
    _, z, _ = at_origin.section(u)
    top = int(np.argmax(z))
    u_top = u[top]
    if 0 < top < u.size - 1:
        u_top = _root(lambda v: float(np.sin(at_origin.section(v)[2])), u[top - 1], u[top + 1])
    z_top = float(at_origin.section(u_top)[1])
    if track.rail_crown_y_mm is not None:
        crown_y = track.rail_crown_y_mm
    else:
        gauge_z = z_top - track.gauge_depth_mm
        u_gauge = profile.locate(gauge_z, angle_rad=0.5 * np.pi - inclination_rad)
        if not np.isfinite(u_gauge):
            raise InputError(
                f"rail {profile.name}: its gauge side ends {z_top - z[0]:.2f} mm below the highest point, but the gauge"
                f" is measured {track.gauge_depth_mm:g} mm below it; give a rail line that reaches there, a smaller"
                " gauge depth, or the position of the rail's crown"
            )
        crown_y = 0.5 * track.gauge_mm - float(at_origin.section(u_gauge)[0])
    return RailPose(profile=profile, inclination_rad=inclination_rad, crown_y_mm=crown_y, crown_z_mm=-z_top)


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
        p = self.profile.evaluate(u)
        # a vertical end of the line (the back of a flange) has no finite slope; it never touches the head
        theta = self._silhouette_angle(-p.dz / np.where(np.abs(p.dy) > 1e-12, p.dy, 1e-12))
        position = self.point(p.y, self.rolling_radius_mm - p.z, theta)
        return theta, position[..., 0], position[..., 1], position[..., 2]

    def _silhouette_angle(self, radius_rate: Floats) -> Floats:
        # the normal (e_r - r' e_axle) has no x-component there
        forward, axle, up = self.axes[0]
        size = np.hypot(up, forward)
        return np.asarray(np.arcsin(np.clip(radius_rate * axle / size, -1.0, 1.0)) + np.arctan2(up, forward))

    def point(self, y: ArrayLike, radius: ArrayLike, theta: ArrayLike) -> Floats:
        """Track position (..., 3) in mm of a point at y (mm) across, at a radius (mm) and an angle (rad) from below."""
        y, radius, theta = np.broadcast_arrays(
            np.asarray(y, float), np.asarray(radius, float), np.asarray(theta, float)
        )
        local = np.stack([radius * np.sin(theta), self.tape_circle_y_mm + y, -radius * np.cos(theta)], axis=-1)
        return np.asarray(self.centre_mm + local @ self.axes.T)

    def distance_along(self, points: Floats, normals: Floats) -> Floats:
        """Distance (mm) from points (..., 3) along unit directions (..., 3) to the wheel's running surface.

        NaN where the direction does not meet it within a few mm. Newton's method on the body of revolution.
        """
        d0 = (points - self.centre_mm) @ self.axes
        n = normals @ self.axes
        t = np.zeros(points.shape[:-1])
        y_low, y_high = self.profile.y_range_mm
        for _ in range(12):
            d = d0 + t[..., None] * n
            y = d[..., 1] - self.tape_circle_y_mm
            rho = np.hypot(d[..., 0], d[..., 2])
            # beyond the ends the surface is continued by its end point; such points are sorted out below
            u = self.profile.locate(np.clip(y, y_low, y_high))
            p = self.profile.evaluate(u)
            rate = (d[..., 0] * n[..., 0] + d[..., 2] * n[..., 2]) / rho + p.dz / p.dy * n[..., 1]
            step = -(rho - self.rolling_radius_mm + p.z) / rate
            t = t + np.clip(step, -5.0, 5.0)
            if not np.any(np.abs(step) > 1e-12):
                break
        inside = (y >= y_low) & (y <= y_high) & (np.abs(step) < 1e-9)
        return np.where(inside, t, np.nan)


@dataclass(frozen=True, kw_only=True)
class RelativeCurvature:
    """Curvatures at a touch point (1/mm, positive where the body is convex) and the Hessian of the gap.

    gap = 1/2 (xx x^2 + 2 xy x y + yy y^2) in the contact frame. At a junction there is one for each side of it.
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
        Position across the rail's and the wheel's own profile.
    contact_angle_rad
        Angle of the tangent plane about x, positive on the gauge side of the head.
    vertical_gap_mm
        Undeformed gap; 0 at the first touch point.
    curvatures
        One entry, or two (gauge side, field side) where the touch point lies at a junction.
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
    def at_junction(self) -> bool:
        """Whether the curvature is undefined here."""
        return len(self.curvatures) > 1

    @property
    def tangent(self) -> Floats:
        """Lateral unit vector of the contact frame in the track frame."""
        return np.array([0.0, np.cos(self.contact_angle_rad), np.sin(self.contact_angle_rad)])

    @property
    def normal(self) -> Floats:
        """Normal unit vector of the contact frame in the track frame, from the rail to the wheel."""
        return np.array([0.0, -np.sin(self.contact_angle_rad), np.cos(self.contact_angle_rad)])


@dataclass(frozen=True, kw_only=True, eq=False)
class Placement:
    """A wheel resting on a rail: poses, touch points (the first one carries the rigid wheel) and the true gap."""

    rail: RailPose
    wheel: WheelPose
    touch_points: tuple[TouchPoint, ...]

    @property
    def first(self) -> TouchPoint:
        """The touch point of the rigid bodies."""
        return self.touch_points[0]

    @cached_property
    def first_arc_length_mm(self) -> float:
        """Arc length along the rail profile at the first touch point: the origin of the surface coordinate s."""
        return float(self.rail.profile.arc_length(self.first.rail_u))

    def surface(self, x: ArrayLike, s: ArrayLike) -> tuple[Floats, Floats]:
        """Points (..., 3) on the rail and their outward unit normals at x and the arc length s (mm) from first touch.

        NaN beyond the running surface.
        """
        x, s = np.broadcast_arrays(np.asarray(x, float), np.asarray(s, float))
        u = self.rail.profile.at_arc_length(s + self.first_arc_length_mm)
        y, z, angle = self.rail.section(u)
        points = np.stack([x + self.first.x_mm, y, z], axis=-1)
        return points, np.stack([np.zeros_like(y), -np.sin(angle), np.cos(angle)], axis=-1)

    def project(self, points: Floats) -> Floats:
        """Surface coordinates (x, s) (..., 2) in mm of points near the rail's surface, along its normals.

        Raises
        ------
        InputError
            If a point does not project on the running surface.
        """
        rail = self.rail
        u = rail.parameter_at_y(points[..., 1])
        # points beside the head begin at its nearer end
        end = np.where(points[..., 1] > rail.crown_y_mm, rail.profile.length_mm, 0.0)
        s = np.where(np.isfinite(u), rail.profile.arc_length(np.nan_to_num(u)), end)
        for _ in range(30):
            u = rail.profile.at_arc_length(s)
            y, z, angle = rail.section(u)
            dy, dz = points[..., 1] - y, points[..., 2] - z
            curvature = rail.profile.evaluate(u).curvature_per_mm
            step = (dy * np.cos(angle) + dz * np.sin(angle)) / (
                1.0 - curvature * (dz * np.cos(angle) - dy * np.sin(angle))
            )
            s = s + np.clip(step, -2.0, 2.0)
            if not np.any(np.abs(step) > 1e-11):
                break
        if not np.all(np.abs(step) < 1e-8):
            raise InputError(
                "the wheel's contact zone reaches past the rail's running surface; use a smaller zone or a longer"
                " rail line"
            )
        return np.stack([points[..., 0] - self.first.x_mm, s - self.first_arc_length_mm], axis=-1)

    def gap(self, x: ArrayLike, s: ArrayLike) -> Floats:
        """True undeformed gap (mm) along the rail's normal at (x, s); OPEN_GAP_MM where the surfaces never meet."""
        points, normals = self.surface(x, s)
        return np.nan_to_num(self.wheel.distance_along(points, normals), nan=OPEN_GAP_MM)

    def tangent_plane_gap(self, x: ArrayLike, t: ArrayLike) -> Floats:
        """True undeformed gap (mm) along the contact normal over the tangent plane at the first touch point.

        x and t (mm) are the coordinates in that plane; NaN where one of the bodies is missing.
        """
        x, t = np.broadcast_arrays(np.asarray(x, float), np.asarray(t, float))
        touch, rail = self.first, self.rail
        tilt = touch.contact_angle_rad - rail.inclination_rad
        foot = rail.profile.evaluate(touch.rail_u)
        p = rail.profile.evaluate(rail.profile.locate(t, angle_rad=tilt, origin=(float(foot.y), float(foot.z))))
        height = -(p.y - foot.y) * np.sin(tilt) + (p.z - foot.z) * np.cos(tilt)
        origin = np.array([touch.x_mm, touch.y_mm, touch.z_mm])
        plane = origin + x[..., None] * np.array([1.0, 0.0, 0.0]) + t[..., None] * touch.tangent
        points = plane + height[..., None] * touch.normal
        return self.wheel.distance_along(points, np.broadcast_to(touch.normal, points.shape))


def place(
    rail_profile: Profile,
    wheel_profile: Profile,
    *,
    inclination_rad: float,
    lateral_shift_mm: float = 0.0,
    roll_rad: float = 0.0,
    yaw_rad: float = 0.0,
    rolling_radius_mm: float = 460.0,
    track: Track | None = None,
    reach_mm: float = 0.3,
) -> Placement:
    """Lower a wheel on a rail until the rigid bodies touch.

    Parameters
    ----------
    lateral_shift_mm
        Wheelset displacement, positive towards this rail.
    reach_mm
        Further minima of the vertical gap up to this height above the first touch are reported.

    Raises
    ------
    InputError
        If the wheel leaves the rail or its flange climbs over it, naming the shifts that are possible.
    """
    track = track or Track()
    rail = place_rail(rail_profile, inclination_rad, track)

    def at(shift: float) -> Placement | str:
        axes = _axes(roll_rad, yaw_rad)
        lifted = WheelPose(
            profile=wheel_profile,
            rolling_radius_mm=rolling_radius_mm,
            tape_circle_y_mm=track.tape_circle_y_mm,
            axes=axes,
            centre_mm=np.array([0.0, shift, 0.0]),
        )
        return _touch(rail, lifted, reach_mm)

    placed = at(lateral_shift_mm)
    if isinstance(placed, str):
        raise InputError(f"lateral shift {lateral_shift_mm:g} mm: {placed}; {_possible_shifts(at)}")
    return placed


def _possible_shifts(at: Callable[[float], Placement | str]) -> str:
    good = [shift for shift in np.arange(-40.0, 40.5, 0.5) if not isinstance(at(float(shift)), str)]
    if not good:
        return "no shift between -40 and 40 mm is possible for this wheel, rail and track"
    return f"shifts between {min(good):g} and {max(good):g} mm (in steps of 0.5 mm) are possible"


def _axes(roll: float, yaw: float) -> Floats:
    cr, sr, cy, sy = np.cos(roll), np.sin(roll), np.cos(yaw), np.sin(yaw)
    turn_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    turn_z = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn_z @ turn_x)


def _sample(profile: Profile) -> Floats:
    count = int(np.ceil(profile.length_mm / _SEARCH_STEP_MM)) + 1
    return profile.at_arc_length(np.linspace(0.0, profile.length_mm, count))


def _root(f: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(f, low, high, xtol=1e-14, rtol=1e-14))


def _touch(rail: RailPose, wheel: WheelPose, reach_mm: float) -> Placement | str:
    """All touch points of a wheel that hangs with its axle at height zero, or the reason why there are none."""
    u = _sample(wheel.profile)
    _, _, y, z = wheel.silhouette(u)
    over = np.isfinite(u_rail := rail.parameter_at_y(y))
    gap = np.where(over, z - rail.section(u_rail)[1], np.nan)
    if np.count_nonzero(over) < 3:
        return "the wheel does not stand over the rail"

    def slope_difference(v: float) -> float:
        p = wheel.profile.evaluate(v)
        theta = wheel._silhouette_angle(np.asarray(-p.dz / p.dy))
        radial = wheel.axes @ np.array([np.sin(theta), 0.0, -np.cos(theta)])
        normal = radial + float(p.dz / p.dy) * wheel.axes[:, 1]
        angle = rail.section(rail.parameter_at_y(wheel.silhouette(v)[2]))[2]
        return float(-normal[1] / normal[2] - np.tan(angle))

    lowest = int(np.nanargmin(gap))
    if not (0 < lowest < u.size - 1 and over[lowest - 1] and over[lowest + 1]):
        return "the wheel leaves the rail: the end of one of the running surfaces carries it"
    inner = np.flatnonzero(over[:-2] & over[1:-1] & over[2:]) + 1
    minima = inner[
        (gap[inner] <= gap[inner - 1]) & (gap[inner] < gap[inner + 1]) & (gap[inner] <= gap[lowest] + reach_mm)
    ]
    found = []
    for i in minima:
        low, high = u[i - 1], u[i + 1]
        f_low, f_high = slope_difference(low), slope_difference(high)
        # no sign change: a step in the height (rounded data of a profile), not a stationary point
        if f_low < 0.0 < f_high:
            v = _root(slope_difference, low, high)
            u_r = float(rail.parameter_at_y(wheel.silhouette(v)[2]))
            found.append((float(wheel.silhouette(v)[3] - rail.section(u_r)[1]), v, u_r))
    if not found:
        return "no point of the running surfaces is tangent to the other one where they come closest"
    found.sort()
    height = found[0][0]
    down = WheelPose(
        profile=wheel.profile,
        rolling_radius_mm=wheel.rolling_radius_mm,
        tape_circle_y_mm=wheel.tape_circle_y_mm,
        axes=wheel.axes,
        centre_mm=wheel.centre_mm - np.array([0.0, 0.0, height]),
    )
    points = tuple(_touch_point(rail, down, v, u_r, g - height) for g, v, u_r in found)
    if reason := _unsafe(down, points[0]):
        return reason
    return Placement(rail=rail, wheel=down, touch_points=points)


def _unsafe(wheel: WheelPose, touch: TouchPoint) -> str:
    """Why a touch point cannot carry a running wheel, or an empty string."""
    if any(abs(touch.wheel_y_mm - j.y_mm) < 1e-6 and j.is_corner for j in wheel.profile.junctions):
        return f"the wheel leaves the rail: the corner of its tread at y = {touch.wheel_y_mm:.2f} mm carries it"
    p = wheel.profile.evaluate(_sample(wheel.profile)[1:-1])
    # angles, not slopes: a flange may be upright
    slope = np.where(p.y < 0.0, np.arctan2(p.dz, p.dy), 0.0)
    steepest = float(np.max(slope))
    # without a flange there is nothing to climb on
    if steepest > 0.25 * np.pi and touch.wheel_y_mm < np.min(p.y[slope > steepest - 1e-6]):
        return f"the wheel derails: the rail touches it at y = {touch.wheel_y_mm:.2f} mm, on the tip of its flange"
    return ""


def _touch_point(rail: RailPose, wheel: WheelPose, u_wheel: float, u_rail: float, gap: float) -> TouchPoint:
    theta, x, y, _ = wheel.silhouette(u_wheel)
    _, z_rail, angle = rail.section(u_rail)
    sides: tuple[Side, ...] = ("left", "right")
    rail_u = {s: rail.profile.snap(u_rail, AT_JUNCTION_MM) for s in sides}
    wheel_u = {s: wheel.profile.snap(u_wheel, AT_JUNCTION_MM) for s in sides}
    both = tuple(
        _relative_curvature(rail, wheel, float(wheel_u[s]), float(rail_u[s]), float(theta), float(angle), s)
        for s in sides
    )
    left, right = (c.rail_per_mm + c.wheel_lateral_per_mm for c in both)
    smooth = abs(left - right) <= 1e-6 * (abs(left) + abs(right)) + 1e-9
    return TouchPoint(
        x_mm=float(x),
        y_mm=float(y),
        z_mm=float(z_rail),
        rail_u=u_rail,
        wheel_u=u_wheel,
        rail_y_mm=float(rail.profile.evaluate(u_rail).y),
        wheel_y_mm=float(wheel.profile.evaluate(u_wheel).y),
        contact_angle_rad=float(angle),
        vertical_gap_mm=gap,
        curvatures=both[1:] if smooth else both,
    )


def _relative_curvature(
    rail: RailPose, wheel: WheelPose, u_wheel: float, u_rail: float, theta: float, angle: float, side: Side
) -> RelativeCurvature:
    p = wheel.profile.evaluate(u_wheel, side)
    meridian = np.arctan2(float(p.dz), float(p.dy))
    radial = wheel.axes @ np.array([np.sin(theta), 0.0, -np.cos(theta)])
    round_about = wheel.axes @ np.array([np.cos(theta), 0.0, np.sin(theta)])
    along = np.cos(meridian) * wheel.axes[:, 1] - np.sin(meridian) * radial
    rolling = float(np.cos(meridian) / wheel.radius(u_wheel))
    lateral = float(wheel.profile.convex_sign * p.curvature_per_mm)
    rail_curvature = float(rail.profile.convex_sign * rail.profile.evaluate(u_rail, side).curvature_per_mm)
    tangent = np.array([0.0, np.cos(angle), np.sin(angle)])
    a = np.array([round_about[0], round_about @ tangent])
    b = np.array([along[0], along @ tangent])
    hessian = rolling * np.outer(a, a) + lateral * np.outer(b, b)
    return RelativeCurvature(
        rail_per_mm=rail_curvature,
        wheel_lateral_per_mm=lateral,
        wheel_rolling_per_mm=rolling,
        xx_per_mm=float(hessian[0, 0]),
        xy_per_mm=float(hessian[0, 1]),
        yy_per_mm=float(hessian[1, 1]) + rail_curvature,
    )
