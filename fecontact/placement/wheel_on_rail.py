"""A wheel placed on a rail: contact points and the undeformed gap, also over an irregularity.

Track frame (right-handed): x along the running direction, y lateral and positive to the field side of the left rail, z
up, origin in the track centre at the height of the rail's highest point. The pair is the left wheel on the left rail.
The wheelset turns about its centre on the axle: first roll about x, then yaw about z (both right-handed, so that
positive roll lifts this wheel and positive yaw moves it backwards).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fecontact.arrays import Floats, find_runs
from fecontact.bodies import ROLLING_RADIUS_MM, Track, TrackSide
from fecontact.errors import CoverageError
from fecontact.placement.along_track import PlacedIrregularities
from fecontact.placement.carrying import find_doubt, find_support_problem, is_beyond_flank
from fecontact.placement.poses import (
    ContactPoint,
    RailPose,
    WheelPose,
    WheelSection,
    find_sign_changes,
    make_contact_points,
    place_rail,
    sample_profile,
    select_near_minima,
)
from fecontact.placement.problems import PlacementError, PositionProblem
from fecontact.profiles.curve import Junction, Profile

# --- A wheel on a rail: contact points, contact frame, relative curvatures and the true undeformed gap.

# Gap in mm at rail points with a normal that does not meet the wheel's running surface: far beyond any elastic
# approach.
OPEN_GAP_MM = 1e3
# Largest height in mm of a minimum of the vertical gap that counts as a contact point, three times the approach under
# 200 kN.
TOUCH_REACH_MM = 0.3
TRIAL_SHIFTS_MM = np.arange(-40.0, 40.5, 0.5)
"""Shifts (mm) to try for a message with the possible shifts."""
# Largest height step of a profile above the contact points. Segments may miss each other by this step.
_MAX_HEIGHT_STEP_MM = 2e-3
# Turning angle of a rail profile at the start of the side of the head, and spacing of the trial places for it.
_SIDE_TURNING_ANGLE_RAD = math.pi / 3.0
_SIDE_STEP_MM = 0.1
_CHECK_PROFILES = "check position, units and points of both profiles"
SIDE_SIGN: dict[TrackSide, float] = {"left": 1.0, "right": -1.0}
"""Sign of a wheelset's shift, roll and yaw in the frame of its left side."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedJunction:
    """A junction of the rail's or the wheel's profile on the placed pair.

    Attributes
    ----------
    profile
        Profile of the rail or of the wheel.
    junction
        The junction.
    s_mm
        Distance of the junction along the profile from first touch.
    """

    profile: Profile
    junction: Junction
    s_mm: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Placement:
    """A wheel resting on a rail: poses, contact points and the true gap.

    Attributes
    ----------
    rail, wheel
        Poses of both bodies.
    contact_points
        Contact points; the first of them carries the rigid wheel.
    climbs
        Whether the wheel touches beyond the steepest place of its flange. Only a lateral force holds it there.
    other_climbs
        Whether the other wheel of the wheelset climbs. The roll of the wheelset follows from that wheel too.
    along
        Irregularities of both bodies along the track; None without any.
    """

    rail: RailPose
    wheel: WheelPose
    contact_points: tuple[ContactPoint, ...]
    climbs: bool = False
    other_climbs: bool = False
    along: PlacedIrregularities | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on both profiles and on flanges that climb."""
        climbing = (
            f"the flange climbs: the contact point is beyond the steepest place of the flange, at"
            f" {math.degrees(self.first.contact_angle_rad):.1f} degrees; only a lateral force holds the wheel there"
        )
        other_climbing = (
            "the opposite wheel derails: the contact point is beyond the steepest place of its flange; this wheel is at"
            " the roll that follows from both wheels"
        )
        climb_notes = (*((climbing,) if self.climbs else ()), *((other_climbing,) if self.other_climbs else ()))
        profiles = (self.rail.profile, self.wheel.profile)
        return (*(f"{profile.kind}: {note}" for profile in profiles for note in profile.notes), *climb_notes)

    @property
    def first(self) -> ContactPoint:
        """The contact point of the rigid bodies."""
        return self.contact_points[0]

    @property
    def ahead_mm(self) -> float:
        """Distance along the track from first touch of smooth bodies to first touch."""
        return 0.0 if self.along is None else self.first.x_mm - self.along.middle_x_mm

    @cached_property
    def first_arc_length_mm(self) -> float:
        """Arc length along the rail profile at the first contact point, in mm.

        It is the origin of the surface coordinate s.
        """
        return float(self.rail.profile.arc_length(self.first.rail_u))

    def load_direction(self, *, normal: bool) -> Floats:
        """Unit vector (3,) along which load and approach act.

        It is the normal at first touch, or the vertical.

        Parameters
        ----------
        normal
            Whether load and approach act along the contact normal.

        Returns
        -------
        ndarray of shape (3,)
            Unit vector in the track frame, upwards.
        """
        return self.first.normal if normal else np.array([0.0, 0.0, 1.0])

    def arc_mm(self, touch: ContactPoint) -> float:
        """Surface coordinate s (mm) of a contact point.

        Parameters
        ----------
        touch
            A contact point of the rigid bodies.

        Returns
        -------
        float
            Coordinate s in mm from the first contact point.
        """
        return float(self.rail.profile.arc_length(touch.rail_u)) - self.first_arc_length_mm

    @cached_property
    def junctions(self) -> tuple[PlacedJunction, ...]:
        """Junctions of the rail, then of the wheel, each by increasing y."""
        placed_junctions = []
        for profile, u in ((self.rail.profile, self.first.rail_u), (self.wheel.profile, self.first.wheel_u)):
            arcs = profile.arc_length(profile.locate([j.y_mm for j in profile.junctions]))
            for junction, arc in zip(profile.junctions, arcs - float(profile.arc_length(u)), strict=True):
                if np.isfinite(arc):
                    placed_junctions.append(PlacedJunction(profile=profile, junction=junction, s_mm=float(arc)))
        return tuple(placed_junctions)

    def on_profiles(self, x: float, s: float) -> tuple[float, float, float]:
        """Position across both profiles at surface coordinates, and the angle of the rail.

        The wheel's point is opposite the rail's point along the rail's normal.

        Parameters
        ----------
        x, s
            Surface coordinates in mm.

        Returns
        -------
        rail_y, wheel_y, angle
            Positions across the rail's and the wheel's profile in mm, and angle of the rail in rad. The position on the
            wheel is NaN if there is no opposite point.
        """
        u = self.rail.profile.at_arc_length(s + self.first_arc_length_mm)
        point, normal = self.surface(x, s)
        wheel_point = point + self.wheel.distance_along(point, normal) * normal
        wheel_y = (wheel_point - self.wheel.centre_mm) @ self.wheel.axes[:, 1] - self.wheel.tape_circle_y_mm
        return float(self.rail.profile.evaluate(u).y), float(wheel_y), float(self.rail.section(u)[2])

    def side_mm(self, s: float) -> float:
        """Distance along the rail's surface from a place to the nearer side of the head.

        A side begins where the profile has turned by a sixth of a circle, or where the profile ends.

        Parameters
        ----------
        s
            Surface coordinate of the place in mm.

        Returns
        -------
        distance
            Distance in mm.
        """
        profile, place = self.rail.profile, self.first_arc_length_mm + s
        u = profile.spread(_SIDE_STEP_MM)
        arc, angle = profile.arc_length(u), profile.evaluate(u).angle_rad
        is_side = np.abs(angle - np.interp(place, arc, angle)) > _SIDE_TURNING_ANGLE_RAD
        is_side[[0, -1]] = True
        return float(np.abs(arc[is_side] - place).min())

    def surface(self, x: ArrayLike, s: ArrayLike) -> tuple[Floats, Floats]:
        """Points on the rail and their outward unit normals.

        Parameters
        ----------
        x
            Distance from first touch along the track in mm.
        s
            Arc length from first touch in mm.

        Returns
        -------
        points (..., 3), normals (..., 3)
            Points in mm and unit vectors in the track frame; NaN beyond the running surface.
        """
        u = self.rail.profile.at_arc_length(np.asarray(s, float) + self.first_arc_length_mm)
        y, z, angle = self.rail.section(u)
        points = np.broadcast_arrays(np.asarray(x, float) + self.first.x_mm, y, z)
        normals = np.broadcast_arrays(np.zeros_like(points[0]), -np.sin(angle), np.cos(angle))
        return np.stack(points, axis=-1), np.stack(normals, axis=-1)

    def project(self, points: Floats) -> Floats:
        """Surface coordinates of points near the rail's surface, along its normals.

        Parameters
        ----------
        points : ndarray of shape (..., 3)
            Points in the track frame in mm.

        Returns
        -------
        coordinates (..., 2)
            x and s in mm.

        Raises
        ------
        CoverageError
            If a point does not project on the running surface.
        """
        rail = self.rail
        u = rail.parameter_at_y(points[..., 1])
        # For points outside the head, the search begins at the nearer end of the head.
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
            raise CoverageError(
                "the contact zone of the wheel extends beyond the running surface of the rail; reduce the load, or give"
                " a longer rail profile"
            )
        return np.stack([points[..., 0] - self.first.x_mm, s - self.first_arc_length_mm], axis=-1)

    def gap(self, x: ArrayLike, s: ArrayLike) -> Floats:
        """True undeformed gap along the rail's normal.

        Parameters
        ----------
        x, s
            Surface coordinates in mm.

        Returns
        -------
        gap
            Gap in mm, including irregularities; OPEN_GAP_MM if the surfaces never meet.
        """
        points, normals = self.surface(x, s)
        gap = np.nan_to_num(self.wheel.distance_along(points, normals), nan=OPEN_GAP_MM)
        if self.along is None:
            return gap
        return gap + self.along.opening_mm(points[..., 0]) - self.along.lowered_mm * normals[..., 2]

    def rail_over_plane(self, t: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Parameters, heights and angles of the rail over places across in the tangent plane.

        Parameters
        ----------
        t : ndarray of shape (n,)
            Distances across from first touch in the tangent plane, in mm.

        Returns
        -------
        u (n,), height (n,), angle (n,)
            Parameters of the rail profile, heights in mm, and angles to the tangent plane in rad; NaN if the rail is
            missing there.
        """
        touch, rail = self.first, self.rail
        tilt = touch.contact_angle_rad - rail.inclination_rad
        foot = rail.profile.evaluate(touch.rail_u)
        u = rail.profile.locate(t, angle_rad=tilt, origin=(float(foot.y), float(foot.z)))
        y, z, dy, dz = np.moveaxis(rail.profile.pieces.tangents(u), -1, 0)
        height = -(y - foot.y) * np.sin(tilt) + (z - foot.z) * np.cos(tilt)
        return u, height, np.arctan2(dz, dy) + rail.inclination_rad - touch.contact_angle_rad

    @cached_property
    def wheel_over_plane(self) -> WheelSection:
        """Section of the wheel across the rail over the tangent plane at first touch."""
        touch = self.first
        origin = np.array([touch.x_mm, touch.y_mm, touch.z_mm])
        return WheelSection(self.wheel, origin, touch.tangent, touch.normal)


@dataclass(frozen=True, kw_only=True, eq=False)
class Pair:
    """A wheel and the rail below it, in the frame of the left side.

    The right side is given as its mirror image.

    Attributes
    ----------
    rail
        Pose of the rail.
    wheel
        Wheel profile.
    rolling_radius_mm
        Radius of the tape circle.
    tape_circle_y_mm
        Position of the tape circle along the axle.
    flange_climb
        Whether the wheel may stand beyond the steepest place of its flange.
    """

    rail: RailPose
    wheel: Profile
    rolling_radius_mm: float
    tape_circle_y_mm: float
    flange_climb: bool = False

    def hung(self, shift_mm: float, roll_rad: float, yaw_rad: float) -> WheelPose:
        """The wheel with the axle's centre at height zero.

        Parameters
        ----------
        shift_mm, roll_rad, yaw_rad
            Shift, roll and yaw of the wheelset as in `place`, on the left side.

        Returns
        -------
        WheelPose
            The wheel above its rail.
        """
        return WheelPose(
            profile=self.wheel,
            rolling_radius_mm=self.rolling_radius_mm,
            tape_circle_y_mm=self.tape_circle_y_mm,
            axes=_wheel_axes(roll_rad, yaw_rad),
            centre_mm=np.array([0.0, shift_mm, 0.0]),
        )

    def placed(
        self, shift_mm: float, roll_rad: float, yaw_rad: float, *, reach_mm: float = TOUCH_REACH_MM
    ) -> Placement | PositionProblem:
        """Lower the wheel on the rail.

        Parameters
        ----------
        shift_mm, roll_rad, yaw_rad
            Shift, roll and yaw of the wheelset as in `place`, on the left side.
        reach_mm
            Largest height of further minima of the vertical gap above the first touch in mm.

        Returns
        -------
        Placement or PositionProblem
            The wheel on its rail, or the reason against it.
        """
        return _lower_wheel(self.rail, self.hung(shift_mm, roll_rad, yaw_rad), reach_mm, flange_climb=self.flange_climb)


def set_up_pair(
    rail_profile: Profile,
    wheel_profile: Profile,
    *,
    inclination_rad: float,
    rolling_radius_mm: float = ROLLING_RADIUS_MM,
    track: Track | None = None,
    flange_climb: bool = False,
) -> Pair:
    """Set a rail to gauge, and a wheel on its axle.

    Parameters
    ----------
    rail_profile, wheel_profile
        Profiles of both bodies.
    inclination_rad
        Angle by which the rail is turned inwards.
    rolling_radius_mm
        Radius of the tape circle.
    track
        Gauge and tape circle; None for the standard track.
    flange_climb
        Whether the wheel may stand beyond the steepest place of its flange.

    Returns
    -------
    SmoothBodies
        Rail and wheel, before the wheel is lowered.

    Raises
    ------
    InputError
        As in `place_rail`.
    """
    track = track or Track()
    return Pair(
        rail=place_rail(rail_profile, inclination_rad, track),
        wheel=wheel_profile,
        rolling_radius_mm=rolling_radius_mm,
        tape_circle_y_mm=track.tape_circle_y_mm,
        flange_climb=flange_climb,
    )


def place(
    rail_profile: Profile,
    wheel_profile: Profile,
    *,
    inclination_rad: float,
    lateral_shift_mm: float = 0.0,
    roll_rad: float = 0.0,
    yaw_rad: float = 0.0,
    rolling_radius_mm: float = ROLLING_RADIUS_MM,
    track: Track | None = None,
    side: TrackSide = "left",
    reach_mm: float = TOUCH_REACH_MM,
    flange_climb: bool = False,
) -> Placement:
    """Lower a wheel on a rail until the rigid bodies touch.

    Parameters
    ----------
    rail_profile, wheel_profile
        Profiles of both bodies.
    inclination_rad
        Angle by which the rail is turned inwards.
    lateral_shift_mm
        Displacement of the wheelset, positive towards the left rail.
    roll_rad, yaw_rad
        Roll and yaw of the wheelset.
    rolling_radius_mm
        Radius of the tape circle.
    track
        Gauge and tape circle; None for the standard track.
    side
        Side of the wheel. The right wheel on its rail is given as the left wheel of the mirror image.
    reach_mm
        Largest height of further minima of the vertical gap above the first touch.
    flange_climb
        Whether the wheel may stand beyond the steepest place of its flange.

    Returns
    -------
    Placement
        The wheel on its rail, in the frame of the left side.

    Raises
    ------
    PlacementError
        If the wheel leaves the rail or its flange climbs over it. The message gives the possible shifts.

    Examples
    --------
    >>> from fecontact.profiles.library import load_library_profile
    >>> placement = place(load_library_profile("60E1"), load_library_profile("S1002"), inclination_rad=0.025)
    >>> len(placement.contact_points), round(placement.first.wheel_y_mm, 1)
    (2, 3.2)
    """
    pair = set_up_pair(
        rail_profile,
        wheel_profile,
        inclination_rad=inclination_rad,
        rolling_radius_mm=rolling_radius_mm,
        track=track,
        flange_climb=flange_climb,
    )
    sign = SIDE_SIGN[side]

    def place_at(shift: float) -> Placement | PositionProblem:
        """The wheel at a shift, or the reason against it."""
        return pair.placed(sign * shift, sign * roll_rad, sign * yaw_rad, reach_mm=reach_mm)

    placement = place_at(lateral_shift_mm)
    if isinstance(placement, str):
        raise PlacementError(
            placement.extend(
                before=f"lateral shift {lateral_shift_mm:g} mm: ", after=f"; {describe_possible_shifts(place_at)}"
            )
        )
    return placement


def describe_possible_shifts(place_at: Callable[[float], object]) -> str:
    """Text with the possible shifts, which an error message ends with.

    Parameters
    ----------
    place_at
        Function of a shift in mm, which returns a text if the shift is impossible.

    Returns
    -------
    text
        Ranges of possible shifts, or the statement that there is none.
    """
    runs = find_runs(np.array([not isinstance(place_at(float(shift)), str) for shift in TRIAL_SHIFTS_MM]))
    if not runs:
        return "no shift between -40 and 40 mm is possible for this wheel, rail and track"
    # a crane wheel may stand on its tread and beyond the corner of the tread, but not between
    step = float(TRIAL_SHIFTS_MM[1] - TRIAL_SHIFTS_MM[0])
    ends = [(TRIAL_SHIFTS_MM[first], TRIAL_SHIFTS_MM[last]) for first, last in runs]
    texts = [f"of {low:g} mm" if low == high else f"between {low:g} and {high:g} mm" for low, high in ends]
    return f"shifts {' and '.join(texts)} (in steps of {step:g} mm) are possible"


def _wheel_axes(roll: float, yaw: float) -> Floats:
    """Directions (3, 3) of a wheel as columns: forward, along the axle, up."""
    cr, sr, cy, sy = np.cos(roll), np.sin(roll), np.cos(yaw), np.sin(yaw)
    turn_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    turn_z = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn_z @ turn_x)


def _lower_wheel(
    rail: RailPose, wheel: WheelPose, reach_mm: float, *, flange_climb: bool
) -> Placement | PositionProblem:
    """Lower the wheel from an axle at height zero onto the rail.

    Returns the reason if the wheel cannot stand there.
    """
    u, points = sample_profile(wheel.profile)
    places = select_near_minima(rail, wheel, points, reach_mm)
    _, _, y, z = wheel.silhouette_of(points.select(places))
    # All other places are higher.
    gap = np.full(u.size, np.inf)
    gap[places] = z - rail.height_at_y(y)
    is_over_rail = np.isfinite(gap)
    if np.count_nonzero(is_over_rail) < 3:
        return PositionProblem("the wheel is not above the rail", remedy=_CHECK_PROFILES)
    lowest = int(np.nanargmin(gap))
    if not (0 < lowest < u.size - 1 and is_over_rail[lowest - 1] and is_over_rail[lowest + 1]):
        # A profile may end where the body ends or where its measurement ends: whether the wheel stands is unknown.
        return PositionProblem(
            "the wheel leaves the rail: the contact point is at the end of a running surface",
            remedy="give longer profiles of wheel and rail, or leave out this shift",
        )
    inner = np.flatnonzero(is_over_rail[:-2] & is_over_rail[1:-1] & is_over_rail[2:]) + 1
    minima = inner[
        (gap[inner] <= gap[inner - 1]) & (gap[inner] < gap[inner + 1]) & (gap[inner] <= gap[lowest] + reach_mm)
    ]

    def slope_difference(v: Floats) -> Floats:
        """Slope of the wheel's outline minus slope of the rail at parameters of the wheel."""
        p = wheel.profile.evaluate(v)
        theta, _, y, _ = wheel.silhouette_of(p)
        normal = wheel.axes @ (np.sin(theta), p.dz / p.dy, -np.cos(theta))
        return np.asarray(-normal[1] / normal[2] - np.tan(rail.section(rail.parameter_at_y(y))[2]))

    low, high = u[minima - 1], u[minima + 1]
    f_low, f_high = np.split(slope_difference(np.concatenate((low, high))), 2)
    # Without a sign change the minimum is a height step (rounded data of a profile), not a stationary point.
    has_tangent = (f_low < 0.0) & (f_high > 0.0)
    v = find_sign_changes(slope_difference, *(ends[has_tangent] for ends in (low, high, f_low, f_high)))
    _, _, y, z = wheel.silhouette(v)
    u_rail = rail.parameter_at_y(y)
    tangent_gap = z - rail.section(u_rail)[1]
    if not v.size:
        return PositionProblem(
            "the running surfaces are not tangent to each other where they come closest", remedy=_CHECK_PROFILES
        )
    order = np.argsort(tangent_gap)
    drop = float(tangent_gap[order[0]])
    if drop - gap[lowest] > _MAX_HEIGHT_STEP_MM:
        return PositionProblem(
            f"a profile has a step: at y = {points.y[lowest]:.2f} mm of the wheel the surfaces meet without a common"
            f" tangent, {1e3 * (drop - gap[lowest]):.0f} micrometres before they touch elsewhere; check both profiles"
            " there",
            "a profile has a step where wheel and rail come closest",
            remedy=_CHECK_PROFILES,
        )
    lowered = replace(wheel, centre_mm=wheel.centre_mm - np.array([0.0, 0.0, drop]))
    contact_points = make_contact_points(rail, lowered, v[order], u_rail[order], tangent_gap[order] - drop)
    climbs = is_beyond_flank(lowered.profile, contact_points[0].wheel_y_mm)
    if problem := find_support_problem(lowered.profile, contact_points[0], climbs=climbs, flange_climb=flange_climb):
        return problem
    first = contact_points[0]
    if doubt := find_doubt(rail.profile, first.rail_y_mm) or find_doubt(lowered.profile, first.wheel_y_mm):
        return doubt
    return Placement(rail=rail, wheel=lowered, contact_points=contact_points, climbs=climbs)
