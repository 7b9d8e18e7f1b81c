"""Poses of wheel and rail, and their contact points with relative curvatures."""

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
from fecontact.profiles.pieces import MonotoneFunction
from fecontact.profiles.reading import suggest_option
from fecontact.profiles.segments import CurvePoints

_SEARCH_STEP_MM = 0.02
# Height below the highest point of a head within which a place counts as highest.
_LEVEL_TOLERANCE_MM = 1e-6


# A direction meets the surface if the last Newton step along it is below this. Without height steps of the profile the
# last step is below 1e-9.
_MAX_MEETING_STEP_MM = 1e-3
# Newton's method ends below this step: the remaining error is smaller than the square of the step over 10 mm.
_NEWTON_TOLERANCE_MM = 1e-5


@dataclass(frozen=True, kw_only=True, eq=False)
class RailPose:
    """A rail profile in the track frame.

    Attributes
    ----------
    profile
        Rail profile.
    inclination_rad
        Angle by which the profile is turned inwards.
    crown_y_mm, crown_z_mm
        Position of the profile's origin, its crown, in the track frame.
    """

    profile: Profile
    inclination_rad: float
    crown_y_mm: float
    crown_z_mm: float

    def parameter_at_y(self, y: ArrayLike) -> Floats:
        """Profile parameter of the points at the lateral position y (mm) of the track.

        NaN off the head.

        Parameters
        ----------
        y
            Lateral positions in the track frame in mm, in any shape.

        Returns
        -------
        ndarray
            Parameter of the profile at each position.
        """
        return self.profile.locate(np.asarray(y, dtype=float) - self.crown_y_mm, angle_rad=-self.inclination_rad)

    def section(self, u: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Position and tangent angle in the track frame at a profile parameter.

        Parameters
        ----------
        u
            Profile parameters, of any shape.

        Returns
        -------
        y, z, angle
            Position in mm and tangent angle in rad.
        """
        p = self.profile.evaluate(u)
        return (*self.point(p.y, p.z), p.angle_rad + self.inclination_rad)

    def height_at_y(self, y: Floats) -> Floats:
        """Height (mm) at the lateral position y (mm) of the track, NaN off the head.

        Parameters
        ----------
        y
            Lateral positions in the track frame in mm, in any shape.

        Returns
        -------
        ndarray
            Height in mm.
        """
        p = self.profile.evaluate(self.parameter_at_y(y))
        return self.point(p.y, p.z)[1]

    @cached_property
    def visible_head(self) -> tuple[Floats, Floats]:
        """Lateral positions and heights (mm) of the head as visible from above.

        They are `_SEARCH_STEP_MM` apart, and empty if no place is visible.
        """
        u, points = sample_profile(self.profile)
        y, z = self.point(points.y, points.z)
        with np.errstate(invalid="ignore"):
            is_visible = np.abs(self.parameter_at_y(y) - u) < 1e-6
        return y[is_visible], z[is_visible]

    def point(self, y: Floats, z: Floats) -> tuple[Floats, Floats]:
        """Position in the track frame of a point of the profile.

        Parameters
        ----------
        y, z
            Position in the profile in mm.

        Returns
        -------
        y, z
            Position in the track frame in mm.
        """
        c, s = np.cos(self.inclination_rad), np.sin(self.inclination_rad)
        return self.crown_y_mm + y * c - z * s, self.crown_z_mm + y * s + z * c


# cached: a rail carries many positions
@lru_cache(maxsize=64)
def place_rail(profile: Profile, inclination_rad: float, track: Track) -> RailPose:
    """Incline a rail and set it to gauge.

    Its highest point is at z = 0.

    Parameters
    ----------
    profile
        Rail profile.
    inclination_rad
        Angle by which the profile is turned inwards.
    track
        Gauge and its depth, or the lateral position of the rail's crown.

    Returns
    -------
    RailPose
        The rail in the track frame.

    Raises
    ------
    InputError
        If the head does not extend down to the gauge plane and no crown position is given.
    """
    at_origin = RailPose(profile=profile, inclination_rad=inclination_rad, crown_y_mm=0.0, crown_z_mm=0.0)
    u, points = sample_profile(profile)
    _, z = at_origin.point(points.y, points.z)
    top = int(np.argmax(z))
    u_top = u[top]
    if 0 < top < u.size - 1:
        ends = u[[top - 1]], u[[top + 1]]

        def slope(v: Floats) -> Floats:
            return np.sin(at_origin.section(v)[2])

        (u_top,) = find_sign_changes(slope, *ends, *map(slope, ends))
    z_top = float(at_origin.section(u_top)[1])
    if track.rail_crown_y_mm is not None:
        # The highest place of the rail in the axes of its profile, which is the origin of the library's rails.
        lowest = points.z.max() - _LEVEL_TOLERANCE_MM
        # A level top ends at junctions, between two search points. 3 um there turn a conforming contact by 0.016 rad.
        level_ends = [
            junction.y_mm for junction in profile.junctions if float(profile.height(np.array(junction.y_mm))) > lowest
        ]
        tops = np.append(points.y[points.z > lowest], level_ends)
        middle = 0.5 * (float(tops.min()) + float(tops.max()))
        from_origin = float(at_origin.point(np.array(middle), np.array(float(points.z.max())))[0])
        crown_y = track.rail_crown_y_mm - (0.0 if abs(middle) < _SEARCH_STEP_MM else from_origin)
    else:
        gauge_y = _find_narrowest_y(at_origin, u[: top + 1], z_top - track.gauge_depth_mm)
        if gauge_y is None:
            raise InputError(
                _gauge_side_message(profile, z_top - float(z[0]), z_top - float(z[-1]), track.gauge_depth_mm)
            )
        crown_y = 0.5 * track.gauge_mm - gauge_y
    return RailPose(profile=profile, inclination_rad=inclination_rad, crown_y_mm=crown_y, crown_z_mm=-z_top)


def _find_narrowest_y(rail: RailPose, u: Floats, gauge_z_mm: float) -> float | None:
    """Lateral position (mm) of the gauge point: the narrowest place of the gauge side down to the gauge plane.

    Parameters
    ----------
    rail
        Rail in the track frame.
    u
        Parameters (n,) from the end of the gauge side to the highest point.
    gauge_z_mm
        Height of the gauge plane (mm).

    Returns
    -------
    float or None
        Position in mm; None if the side ends above the gauge plane and was not cut at its widest point.
    """
    y, z, _ = rail.section(u)
    u_plane = rail.profile.locate(gauge_z_mm, angle_rad=0.5 * np.pi - rail.inclination_rad)
    at_plane_mm = float(rail.section(u_plane)[0]) if np.isfinite(u_plane) else np.inf
    is_above = z >= gauge_z_mm
    if not is_above.any():
        return None
    narrowest = int(np.argmin(np.where(is_above, y, np.inf)))
    # without the rounding of a vertical side, so that the gauge point of an exact profile is on the gauge plane
    if y[narrowest] < at_plane_mm - _LEVEL_TOLERANCE_MM:
        ends = u[[max(narrowest - 1, 0)]], u[[min(narrowest + 1, u.size - 1)]]

        def lean(v: Floats) -> Floats:
            return np.cos(rail.section(v)[2])

        (u_narrowest,) = find_sign_changes(lean, *ends, *map(lean, ends))
        at_plane_mm = min(float(rail.section(u_narrowest)[0]), float(y[narrowest]))
    if z[0] <= gauge_z_mm:
        return at_plane_mm
    # a measured side that is cut where it turns in is not wider below its end; smoothing moves the end by up to 0.3 mm
    if (end := rail.profile.gauge_side_end_mm) is not None:
        end_mm = float(rail.point(np.array(end[0]), np.array(end[1]))[0])
        return end_mm if narrowest == 0 else min(end_mm, at_plane_mm)
    return None


def _gauge_side_message(profile: Profile, gauge_side_mm: float, field_side_mm: float, depth_mm: float) -> str:
    """Message for a rail without a point of its gauge side at the gauge depth.

    It gives the depth to which each side of the rail extends.
    """
    option = suggest_option("rail", "mirror", "yes")
    mirrored = f"its field side ends {field_side_mm:.2f} mm below it: {option} if the profile is mirrored; "
    return (
        f"rail {profile.name}: its gauge side ends {gauge_side_mm:.2f} mm below the highest point, but the gauge is"
        f" measured {depth_mm:g} mm below it; {mirrored * (field_side_mm > depth_mm)}give a rail profile that"
        " reaches this depth, a smaller gauge depth (--gauge-depth-mm, gauge_depth_mm in [track]), or the position of"
        " the rail's crown (--rail-crown-y-mm, rail_crown_y_mm)"
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class WheelPose:
    """A wheel profile revolved about the axle and set down in the track frame.

    Attributes
    ----------
    profile
        Wheel profile.
    rolling_radius_mm
        Radius of the tape circle.
    tape_circle_y_mm
        Position of the tape circle along the axle.
    axes : ndarray of shape (3, 3)
        Directions of the wheel as columns: forward, along the axle to the field side, up.
    centre_mm : ndarray of shape (3,)
        Centre of the wheelset in the track frame.
    """

    profile: Profile
    rolling_radius_mm: float
    tape_circle_y_mm: float
    axes: Floats
    centre_mm: Floats

    def radius(self, u: ArrayLike) -> Floats:
        """Distance (mm) of the running surface from the axle at the profile parameter u.

        Parameters
        ----------
        u
            Parameters of the profile, in any shape.

        Returns
        -------
        ndarray
            Distance in mm, in the shape of `u`.
        """
        return np.asarray(self.rolling_radius_mm - self.profile.evaluate(u).z)

    def silhouette(self, u: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
        """Outline of the wheel as seen along the rail.

        A rail is a prism, so the rigid contact is the plane contact of this outline with the rail's section.

        Parameters
        ----------
        u
            Profile parameters, of any shape.

        Returns
        -------
        theta, x, y, z
            Angle (rad) about the axle, and position (mm) in the track frame.
        """
        return self.silhouette_of(self.profile.evaluate(u))

    def silhouette_of(self, p: CurvePoints) -> tuple[Floats, Floats, Floats, Floats]:
        """Outline, as in `silhouette`, at points of the profile.

        Parameters
        ----------
        p
            Points of the profile.

        Returns
        -------
        theta, x, y, z
            Angle (rad) about the axle, and position (mm) in the track frame.
        """
        # A vertical end of the profile (the back of a flange) has no finite slope; it never touches the head.
        theta = self._silhouette_angle(-p.dz / np.where(np.abs(p.dy) > 1e-12, p.dy, 1e-12))
        position = self.point(p.y, self.rolling_radius_mm - p.z, theta)
        return theta, position[..., 0], position[..., 1], position[..., 2]

    def _silhouette_angle(self, radius_rate: Floats) -> Floats:
        """Angle (rad) about the axle of the outline at a rate of the radius."""
        # On the outline the normal (e_r - r' e_axle) has no x-component.
        forward, axle, up = map(float, self.axes[0])
        sine = np.minimum(np.maximum(radius_rate * (axle / math.hypot(up, forward)), -1.0), 1.0)
        return np.asarray(np.arcsin(sine) + math.atan2(up, forward))

    def point(self, y: Floats | float, radius: Floats | float, theta: Floats | float) -> Floats:
        """Position of points of the wheel in the track frame.

        Parameters
        ----------
        y
            Position across the profile in mm.
        radius
            Distance from the axle in mm.
        theta
            Angle about the axle in rad, from straight below it.

        Returns
        -------
        position (..., 3)
            Position in mm.
        """
        local = np.empty((*np.broadcast_shapes(*map(np.shape, (y, radius, theta))), 3))
        local[..., 0] = radius * np.sin(theta)
        local[..., 1] = self.tape_circle_y_mm + y
        local[..., 2] = -radius * np.cos(theta)
        return np.asarray(self.centre_mm + local @ self.axes.T)

    def lowest_point(self, y: Floats, z: Floats) -> tuple[Floats, Floats]:
        """Position y, z (mm) in the track frame of profile points straight below the axle.

        The points are at y, z (mm) of the profile.

        Parameters
        ----------
        y, z
            Positions in the axes of the profile in mm; shapes that broadcast together.

        Returns
        -------
        y, z : ndarray
            Positions in the track frame in mm.
        """
        position = self.point(y, self.rolling_radius_mm - z, 0.0)
        return position[..., 1], position[..., 2]

    def distance_along(self, points: Floats, normals: Floats, guess_mm: ArrayLike = 0.0) -> Floats:
        """Distance from points along unit directions to the wheel's running surface.

        Newton's method on the body of revolution, to 1e-11 mm.

        Parameters
        ----------
        points : ndarray of shape (..., 3)
            Points in the track frame in mm.
        normals : ndarray of shape (..., 3)
            Unit directions.
        guess_mm : ndarray of shape (...)
            First guess of the distance in mm.

        Returns
        -------
        distance (...)
            Distance in mm. NaN if a direction does not meet the surface within a few mm.
        """
        start = np.ascontiguousarray(((points - self.centre_mm) @ self.axes).reshape(-1, 3).T)
        along = np.ascontiguousarray((normals @ self.axes).reshape(-1, 3).T)
        y_low, y_high = self.profile.y_range_mm
        distance = np.broadcast_to(np.asarray(guess_mm, float), points.shape[:-1]).reshape(-1).copy()
        active = np.arange(distance.size)
        has_met = np.zeros(distance.size, dtype=bool)
        for _ in range(12):
            direction = along[:, active]
            position = start[:, active] + distance[active] * direction
            y = position[1] - self.tape_circle_y_mm
            rho = np.hypot(position[0], position[2])
            # Beyond its ends the surface is continued by its end point; such points are removed below by their y.
            p = self.profile.evaluate(self.profile.locate(np.clip(y, y_low, y_high)))
            height = self.rolling_radius_mm - p.z - rho
            # The step is a fraction with the slope's denominator in both parts. If the profile is vertical, or the
            # direction runs along the surface, the step has no length, and the direction does not count as meeting the
            # surface.
            rate = (position[0] * direction[0] + position[2] * direction[2]) / rho * p.dy + p.dz * direction[1]
            step = np.copysign(np.inf, height)
            np.divide(height * p.dy, rate, out=step, where=(rate != 0.0) & (p.dy != 0.0))
            distance[active] += np.clip(step, -5.0, 5.0)
            # With rounded coefficients a profile has a height step at a junction (S1002: 2e-4 mm), about which Newton
            # steps alternate.
            has_met[active] = (y >= y_low) & (y <= y_high) & (np.abs(step) < _MAX_MEETING_STEP_MM)
            active = active[np.abs(step) > _NEWTON_TOLERANCE_MM]
            if not active.size:
                break
        return np.where(has_met, distance, np.nan).reshape(points.shape[:-1])


@dataclass(frozen=True, eq=False)
class WheelSection:
    """Section of a wheel by a plane across the rail, over an axis.

    In the plane x = constant, a point of the wheel at the radius r is the distance s along the wheel and the depth
    sqrt(r^2 - s^2) below the axle. s is a linear function of y, and the coordinates are linear functions of y and of
    the depth.

    Attributes
    ----------
    wheel
        Pose of the wheel.
    origin : ndarray of shape (3,)
        Origin of the axis in the track frame in mm.
    along, normal : ndarray of shape (3,)
        Unit vectors of the axis and normal to it, both in the plane.
    """

    wheel: WheelPose
    origin: Floats
    along: Floats
    normal: Floats

    @cached_property
    def _coefficients(self) -> tuple[Floats, Floats]:
        """Coefficients (2,) of s, and (2, 3) of both coordinates.

        They multiply 1 and y, and for the coordinates the depth.
        """
        tape_circle_y, from_centre = self.wheel.tape_circle_y_mm, self.origin - self.wheel.centre_mm
        forward, axle, up = map(float, self.wheel.axes[0])
        length = math.hypot(forward, up)
        s = np.array([from_centre[0] - axle * tape_circle_y, -axle]) / length
        # both directions over the wheel's axes; s is along (forward, 0, up) / length
        directions = np.stack((self.along, self.normal))
        of_wheel = directions @ self.wheel.axes
        of_s = (of_wheel[:, 0] * forward + of_wheel[:, 2] * up) / length
        of_depth = (of_wheel[:, 0] * up - of_wheel[:, 2] * forward) / length
        constant = of_wheel[:, 1] * tape_circle_y - directions @ from_centre
        return s, np.stack((constant + of_s * s[0], of_wheel[:, 1] + of_s * s[1], of_depth), axis=1)

    def _project_tangents(self, tangents: Floats) -> Floats:
        """Coordinates (mm) along the axis and normal to it, each followed by its rate.

        `tangents` (..., 4) has y and z of points of the profile in mm, and their rates; the result has the same shape.
        """
        (s_zero, s_rate), (of_t, of_height) = self._coefficients
        y, z, dy, dz = np.moveaxis(tangents, -1, 0)
        s, radius = s_zero + s_rate * y, self.wheel.rolling_radius_mm - z
        depth = np.sqrt(radius * radius - s * s)
        depth_rate = -(radius * dz + s_rate * s * dy) / depth
        projected = np.empty_like(tangents)
        for column, (constant, of_y, of_depth) in ((0, of_t), (2, of_height)):
            projected[..., column] = constant + of_y * y + of_depth * depth
            projected[..., column + 1] = of_y * dy + of_depth * depth_rate
        return projected

    @cached_property
    def _rise(self) -> MonotoneFunction | None:
        """Coordinate along the axis, on the widest stretch of the profile that runs forward."""
        pieces = self.wheel.profile.pieces
        ends = np.stack((pieces.ends.y, pieces.ends.z, pieces.ends.dy, pieces.ends.dz), axis=-1)
        projected = self._project_tangents(ends)
        return pieces.find_rise(self._project_points, projected[:, 0], projected[:, 1])

    def _project_points(self, u: Floats) -> Floats:
        """Coordinates and rates (..., 4) of points of the wheel, as by `_project_tangents`."""
        return self._project_tangents(self.wheel.profile.pieces.tangents(u))

    def heights(self, t: Floats) -> Floats:
        """Heights of the wheel over places along the axis.

        Parameters
        ----------
        t : ndarray of shape (n,)
            Distances from the origin in mm.

        Returns
        -------
        ndarray of shape (n,)
            Heights in mm; NaN where the widest stretch of the section that runs forward is missing.
        """
        if self._rise is None:
            return np.full(t.shape, np.nan)
        return self._rise.follow(t)


# cached: equal for every position of the profile, and a table of positions has many searches
@lru_cache(maxsize=64)
def sample_profile(profile: Profile) -> tuple[Floats, CurvePoints]:
    """Parameters along a profile and the points there, `_SEARCH_STEP_MM` apart.

    Parameters
    ----------
    profile
        Rail or wheel.

    Returns
    -------
    u : ndarray of shape (n,)
        Parameters; the array cannot be written.
    points : CurvePoints
        Points of the profile at these parameters.
    """
    u = profile.spread(_SEARCH_STEP_MM)
    u.flags.writeable = False
    return u, profile.evaluate(u)


# Coarse search among every eighth sample of 0.02 mm. The fine search leaves out places that are higher than the lowest
# of these samples by more than the margin. On two profiles of R 6 the coarse samples miss a contact point by 1e-3 mm, a
# tenth of the margin.
_COARSE_STRIDE = 8
_COARSE_MARGIN_MM = 0.01
# The fine search also leaves out places from which the gap falls to the next coarse sample by more than this. If the
# relative curvature is below 0.08/mm, as on an arc of R 13, a minimum between two samples leaves their gaps nearer to
# each other. At a junction a minimum may be 2e-5 mm deep and a tenth of a millimetre wide.
_MAX_COARSE_FALL_MM = 1e-3


def select_near_minima(rail: RailPose, wheel: WheelPose, points: CurvePoints, above_mm: float = 0.0) -> Integers:
    """Select points along a wheel about minima of the gap.

    Parameters
    ----------
    rail, wheel
        Poses of both bodies.
    points
        Points (n,) along the wheel profile.
    above_mm
        Largest height of a minimum above the lowest minimum in mm.

    Returns
    -------
    places (k,)
        Indices of the points; empty if no point lies over the rail.
    """
    (places,) = select_near_minima_at_shifts(rail, wheel, points, [0.0], above_mm)
    return places


def select_near_minima_at_shifts(
    rail: RailPose, wheel: WheelPose, points: CurvePoints, shifts_mm: Iterable[float], above_mm: float = 0.0
) -> list[Integers]:
    """Select points along a shifted wheel about minima of the gap, for several shifts.

    Parameters
    ----------
    rail, wheel
        Poses of both bodies.
    points
        Points (n,) along the wheel profile.
    shifts_mm
        Lateral shifts of the wheel in mm.
    above_mm
        Largest height of a minimum above the lowest minimum in mm.

    Returns
    -------
    places
        Indices (k,) of the points for each shift; empty if no point lies over the rail.
    """
    if not rail.visible_head[0].size:
        # so far from the track centre that the positions of its points are equal
        return [np.empty(0, dtype=np.intp) for _ in shifts_mm]
    _, _, y, z = wheel.silhouette_of(points.select(slice(None, None, _COARSE_STRIDE)))
    places = []
    for shift in shifts_mm:
        gap = z - np.interp(y + shift, *rail.visible_head, left=-np.inf, right=-np.inf)
        is_near = np.isfinite(gap) & (gap < gap.min() + above_mm + _COARSE_MARGIN_MM)
        is_near[1:] &= gap[1:] <= gap[:-1] + _MAX_COARSE_FALL_MM
        is_near[:-1] &= gap[:-1] <= gap[1:] + _MAX_COARSE_FALL_MM
        is_close = np.convolve(is_near, np.ones(5), "same") > 0.5
        places.append(np.flatnonzero(np.repeat(is_close, _COARSE_STRIDE)[: points.y.size]))
    return places


# Secants end with a step of the parameter this small, some 2e-9 mm. The place is more exact.
_SECANT_TOLERANCE = 1e-10


def find_sign_changes(
    f: Callable[[Floats], Floats], low: Floats, high: Floats, f_low: Floats, f_high: Floats
) -> Floats:
    """Places between two ends at which a function changes its sign.

    By secants for all places at once. If an end stays, its value is halved (Illinois, Dowell and Jarratt 1971).

    Parameters
    ----------
    f
        Function of places (n,).
    low, high : ndarray of shape (n,)
        Both ends.
    f_low, f_high : ndarray of shape (n,)
        Values of the function at both ends.

    Returns
    -------
    places (n,)
        Without a change of sign, the end at which the function is nearer to 0.

    Examples
    --------
    >>> ends = np.array([0.0]), np.array([2.0])
    >>> round(float(find_sign_changes(lambda x: x**2 - 2.0, *ends, np.array([-2.0]), np.array([2.0]))[0]), 9)
    1.414213562
    """
    # At a kink rounding may hide the sign change at both ends.
    changes = f_low * f_high <= 0.0
    nearer = np.where(np.abs(f_low) < np.abs(f_high), low, high)
    for _ in range(100):
        with np.errstate(divide="ignore", invalid="ignore"):
            x = high - f_high * (high - low) / (f_high - f_low)
        x = np.where(changes & np.isfinite(x), x, high)
        if not np.any(np.abs(x - high)[changes] > _SECANT_TOLERANCE):
            break
        f_x = f(x)
        stays = f_x * f_high >= 0.0
        low, f_low = np.where(stays, low, high), np.where(stays, 0.5 * f_low, f_high)
        high, f_high = x, f_x
    return np.where(changes, x, nearer)


# --- Contact points of the rigid bodies: contact frame, contact angle and relative curvatures.

# A contact point this close to a junction has the curvatures of both sides: profile tolerances are hundredths of a mm.
AT_JUNCTION_MM = 1e-3


@dataclass(frozen=True, kw_only=True)
class RelativeCurvature:
    """Curvatures at a contact point and the Hessian of the gap.

    gap = 1/2 (xx x^2 + 2 xy x y + yy y^2) in the contact frame. At a junction each side has its curvature.

    Attributes
    ----------
    rail_per_mm
        Curvature of the rail across, in 1/mm, positive if the body is convex.
    wheel_lateral_per_mm, wheel_rolling_per_mm
        Curvatures of the wheel across and around the axle, in 1/mm, positive if the body is convex.
    xx_per_mm, xy_per_mm, yy_per_mm
        Second derivatives of the gap in 1/mm.
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
class ContactPoint:
    """A separate minimum of the vertical gap between wheel and rail.

    Attributes
    ----------
    x_mm, y_mm, z_mm
        Position in the track frame, on the rail.
    rail_u, wheel_u
        Parameters of the rail profile and of the wheel profile.
    rail_y_mm, wheel_y_mm
        Position across the rail's profile and across the wheel's profile.
    contact_angle_rad
        Angle of the tangent plane about x, positive on the gauge side of the head.
    vertical_gap_mm
        Undeformed gap; 0 at the first contact point.
    curvatures
        A single entry, or two entries (gauge side, field side) for a contact point at a junction.
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
        """Whether the contact point lies at a junction, where the curvature is undefined."""
        return len(self.curvatures) > 1

    @property
    def tangent(self) -> Floats:
        """Lateral unit vector (3,) of the contact frame in the track frame."""
        return np.array([0.0, np.cos(self.contact_angle_rad), np.sin(self.contact_angle_rad)])

    @property
    def normal(self) -> Floats:
        """Normal unit vector (3,) of the contact frame, from the rail to the wheel.

        Its components are in the track frame.
        """
        return np.array([0.0, -np.sin(self.contact_angle_rad), np.cos(self.contact_angle_rad)])


def make_contact_points(
    rail: RailPose, wheel: WheelPose, u_wheel: Floats, u_rail: Floats, gap: Floats
) -> tuple[ContactPoint, ...]:
    """Make contact points with their curvatures from parameters of both profiles.

    Parameters
    ----------
    rail, wheel
        Poses of both bodies.
    u_wheel, u_rail : ndarray of shape (n,)
        Parameters of the contact points on the wheel profile and on the rail profile.
    gap : ndarray of shape (n,)
        Gaps between the bodies in mm.

    Returns
    -------
    contact_points
        In the order of the parameters.
    """
    on_wheel, on_rail = wheel.profile.evaluate(u_wheel), rail.profile.evaluate(u_rail)
    theta, x, y, _ = wheel.silhouette_of(on_wheel)
    _, z = rail.point(on_rail.y, on_rail.z)
    angle = on_rail.angle_rad + rail.inclination_rad
    at_wheel, at_rail = wheel.profile.snap(u_wheel, AT_JUNCTION_MM), rail.profile.snap(u_rail, AT_JUNCTION_MM)
    right = _relative_curvatures(rail, wheel, at_wheel, at_rail, theta, angle, "right")
    at_end = np.any((at_wheel % 1.0 == 0.0) | (at_rail % 1.0 == 0.0))
    left = _relative_curvatures(rail, wheel, at_wheel, at_rail, theta, angle, "left") if at_end else right
    return tuple(
        ContactPoint(
            x_mm=float(x[i]),
            y_mm=float(y[i]),
            z_mm=float(z[i]),
            rail_u=float(u_rail[i]),
            wheel_u=float(u_wheel[i]),
            rail_y_mm=float(on_rail.y[i]),
            wheel_y_mm=float(on_wheel.y[i]),
            contact_angle_rad=float(angle[i]),
            vertical_gap_mm=float(gap[i]),
            curvatures=(of_right,) if _is_equal_curvature(of_left, of_right) else (of_left, of_right),
        )
        for i, (of_left, of_right) in enumerate(zip(left, right, strict=True))
    )


def _is_equal_curvature(left: RelativeCurvature, right: RelativeCurvature) -> bool:
    """Whether both sides of a contact point have equal relative curvature across."""
    left_sum, right_sum = (c.rail_per_mm + c.wheel_lateral_per_mm for c in (left, right))
    return abs(left_sum - right_sum) <= 1e-6 * (abs(left_sum) + abs(right_sum)) + 1e-9


def _relative_curvatures(
    rail: RailPose, wheel: WheelPose, u_wheel: Floats, u_rail: Floats, theta: Floats, angle: Floats, side: Side
) -> list[RelativeCurvature]:
    """Relative curvatures at contact points (n,), from a side of the profiles.

    Axes of the wheel's surface and of the rail's tangent are projected on the contact frame.

    Parameters
    ----------
    rail, wheel
        Poses of both bodies.
    u_wheel, u_rail
        Profile parameters of the contact points.
    theta
        Angle about the wheel's axle in rad.
    angle
        Contact angle in rad.
    side
        Side from which curvatures at a junction are taken.
    """
    p, zero = wheel.profile.evaluate(u_wheel, side), np.zeros_like(theta)
    meridian = np.arctan2(p.dz, p.dy)[:, None]
    radial = np.stack([np.sin(theta), zero, -np.cos(theta)], axis=1) @ wheel.axes.T
    round_about = np.stack([np.cos(theta), zero, np.sin(theta)], axis=1) @ wheel.axes.T
    along = np.cos(meridian) * wheel.axes[:, 1] - np.sin(meridian) * radial
    rolling = np.cos(meridian[:, 0]) / (wheel.rolling_radius_mm - p.z)
    lateral = wheel.profile.convex_sign * p.curvature_per_mm
    of_rail = rail.profile.convex_sign * rail.profile.evaluate(u_rail, side).curvature_per_mm
    tangent = np.stack([zero, np.cos(angle), np.sin(angle)], axis=1)
    (round_x, round_y), (along_x, along_y) = ((v[:, 0], (v * tangent).sum(axis=1)) for v in (round_about, along))
    columns = (
        of_rail,
        lateral,
        rolling,
        rolling * round_x**2 + lateral * along_x**2,
        rolling * round_x * round_y + lateral * along_x * along_y,
        rolling * round_y**2 + lateral * along_y**2 + of_rail,
    )
    names = [field.name for field in fields(RelativeCurvature)]
    return [RelativeCurvature(**dict(zip(names, map(float, row), strict=True))) for row in zip(*columns, strict=True)]
