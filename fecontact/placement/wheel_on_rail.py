"""A wheel placed on a rail: touch points of the rigid bodies and the undeformed gap, also over an irregularity.

Track frame (right-handed): x along the running direction, y lateral and positive to the field side of the left rail,
z up, origin in the track centre at the height of the rail's highest point. The pair is the left wheel on the left rail.
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

from fecontact.arrays import Floats
from fecontact.bodies import Track, TrackSide
from fecontact.errors import InputError, NotCovered
from fecontact.placement.along_track import AlongTrack
from fecontact.placement.carrying import climbs_at, find_support_problem
from fecontact.placement.poses import (
    RailPose,
    TouchPoint,
    WheelPose,
    place_rail,
    places_near,
    search_points,
    sign_changes,
    touch_points_at,
)
from fecontact.profiles.curve import Junction, Profile

# --- A wheel on a rail: touch points, contact frame, relative curvatures and the true undeformed gap.

# Gap at rail points whose normal does not meet the wheel's running surface: far beyond any elastic approach.
OPEN_GAP_MM = 1e3
# Further minima of the vertical gap up to this height are touch points: three times the approach under 200 kN.
REACH_MM = 0.3
EVERY_SHIFT = np.arange(-40.0, 40.5, 0.5)
"""Shifts (mm) that are tried for a message with the possible shifts."""
# Largest step in the height of a line above the touch points: segments may miss each other by as much.
_STEP_MM = 2e-3
# Angle of a rail's line at which the side of the head begins, and spacing of the places that are tried for it.
_SIDE_TURN_RAD = math.pi / 3.0
_SIDE_STEP_MM = 0.1
SIGN: dict[TrackSide, float] = {"left": 1.0, "right": -1.0}
"""Sign of a wheelset's shift, roll and yaw in the frame of its left side."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedJunction:
    """A junction of the rail's or the wheel's profile; `s_mm` is its distance along the line from first touch."""

    profile: Profile
    junction: Junction
    s_mm: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Placement:
    """A wheel resting on a rail: poses, touch points (the first one carries the rigid wheel) and the true gap.

    `climbs` says that the wheel touches beyond the steepest place of its flange: only a lateral force holds it there.
    `other_climbs` says so of the other wheel of its wheelset, which has the wheelset's roll from there.
    `along` holds the irregularities of both bodies along the track, if any.
    """

    rail: RailPose
    wheel: WheelPose
    touch_points: tuple[TouchPoint, ...]
    climbs: bool = False
    other_climbs: bool = False
    along: AlongTrack | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """What is to be known of both profiles, and of flanges that climb."""
        climbing = (
            f"the flange climbs: it touches the rail beyond its steepest place, at"
            f" {math.degrees(self.first.contact_angle_rad):.1f} degrees; a lateral force alone holds it there"
        )
        other = (
            "the wheelset derails on its other side: there the flange touches the rail beyond its steepest place; this"
            " wheel stands at the roll which that gives"
        )
        said = (*((climbing,) if self.climbs else ()), *((other,) if self.other_climbs else ()))
        profiles = (self.rail.profile, self.wheel.profile)
        return (*(f"{one.kind}: {note}" for one in profiles for note in one.notes), *said)

    @property
    def first(self) -> TouchPoint:
        """The touch point of the rigid bodies."""
        return self.touch_points[0]

    @property
    def ahead_mm(self) -> float:
        """Distance along the track of the first touch point ahead of the touch point of smooth bodies."""
        return 0.0 if self.along is None else self.first.x_mm - self.along.middle_x_mm

    @cached_property
    def first_arc_length_mm(self) -> float:
        """Arc length along the rail profile at the first touch point: the origin of the surface coordinate s."""
        return float(self.rail.profile.arc_length(self.first.rail_u))

    def load_direction(self, *, normal: bool) -> Floats:
        """Unit vector (3,) along which load and approach act: the normal at first touch, or the vertical."""
        return self.first.normal if normal else np.array([0.0, 0.0, 1.0])

    def arc_mm(self, touch: TouchPoint) -> float:
        """Surface coordinate s (mm) of a touch point."""
        return float(self.rail.profile.arc_length(touch.rail_u)) - self.first_arc_length_mm

    @cached_property
    def junctions(self) -> tuple[PlacedJunction, ...]:
        """Junctions of the rail, then of the wheel, each by increasing y."""
        placed = []
        for profile, u in ((self.rail.profile, self.first.rail_u), (self.wheel.profile, self.first.wheel_u)):
            arcs = profile.arc_length(profile.locate([j.y_mm for j in profile.junctions]))
            for junction, arc in zip(profile.junctions, arcs - float(profile.arc_length(u)), strict=True):
                if np.isfinite(arc):
                    placed.append(PlacedJunction(profile=profile, junction=junction, s_mm=float(arc)))
        return tuple(placed)

    def on_profiles(self, x: float, s: float) -> tuple[float, float, float]:
        """Position (mm) across the rail's and the wheel's profile at surface coordinates (mm), and the rail's angle.

        The wheel's point faces the rail along the rail's normal; NaN if there is no such point.
        """
        u = self.rail.profile.at_arc_length(s + self.first_arc_length_mm)
        point, normal = self.surface(x, s)
        facing = point + self.wheel.distance_along(point, normal) * normal
        wheel_y = (facing - self.wheel.centre_mm) @ self.wheel.axes[:, 1] - self.wheel.tape_circle_y_mm
        return float(self.rail.profile.evaluate(u).y), float(wheel_y), float(self.rail.section(u)[2])

    def bodies_that_end(self, low_s_mm: float, high_s_mm: float) -> tuple[str, ...]:
        """Bodies (rail, wheel) whose running surface does not reach from one surface coordinate to another."""
        ends = [self.on_profiles(0.0, s)[:2] for s in (low_s_mm, high_s_mm)]
        return tuple(
            body
            for body, places in zip(("rail", "wheel"), zip(*ends, strict=True), strict=True)
            if np.isnan(places).any()
        )

    def side_mm(self, s: float) -> float:
        """Distance (mm) along the rail's surface from a place to the nearer side of the head.

        A side begins where the line has turned by a sixth of a circle, or where the line ends.
        """
        profile, place = self.rail.profile, self.first_arc_length_mm + s
        u = profile.spread(_SIDE_STEP_MM)
        arc, angle = profile.arc_length(u), profile.evaluate(u).angle_rad
        turned = np.abs(angle - np.interp(place, arc, angle)) > _SIDE_TURN_RAD
        turned[[0, -1]] = True
        return float(np.abs(arc[turned] - place).min())

    def surface(self, x: ArrayLike, s: ArrayLike) -> tuple[Floats, Floats]:
        """Points (..., 3) on the rail and their outward unit normals at x and the arc length s (mm) from first touch.

        NaN beyond the running surface.
        """
        u = self.rail.profile.at_arc_length(np.asarray(s, float) + self.first_arc_length_mm)
        y, z, angle = self.rail.section(u)
        points = np.broadcast_arrays(np.asarray(x, float) + self.first.x_mm, y, z)
        normals = np.broadcast_arrays(np.zeros_like(points[0]), -np.sin(angle), np.cos(angle))
        return np.stack(points, axis=-1), np.stack(normals, axis=-1)

    def project(self, points: Floats) -> Floats:
        """Surface coordinates (x, s) (..., 2) in mm of points near the rail's surface, along its normals.

        Raises
        ------
        NotCovered
            If a point does not project on the running surface.
        """
        rail = self.rail
        u = rail.parameter_at_y(points[..., 1])
        # the search for points beside the head begins at its nearer end
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
            raise NotCovered(
                "the wheel's contact zone reaches past the rail's running surface; use a smaller zone or a longer"
                " rail line"
            )
        return np.stack([points[..., 0] - self.first.x_mm, s - self.first_arc_length_mm], axis=-1)

    def gap(self, x: ArrayLike, s: ArrayLike) -> Floats:
        """True undeformed gap (mm) along the rail's normal at (x, s); OPEN_GAP_MM where the surfaces never meet."""
        points, normals = self.surface(x, s)
        gap = np.nan_to_num(self.wheel.distance_along(points, normals), nan=OPEN_GAP_MM)
        if self.along is None:
            return gap
        return gap + self.along.opening_mm(points[..., 0]) - self.along.lowered_mm * normals[..., 2]

    def over_tangent_plane(self, t: ArrayLike) -> tuple[Floats, Floats]:
        """Parameters of the rail, and points (..., 3) on it, over places t (mm) across in the tangent plane.

        NaN if the rail is missing there.
        """
        touch, rail = self.first, self.rail
        tilt = touch.contact_angle_rad - rail.inclination_rad
        foot = rail.profile.evaluate(touch.rail_u)
        u = rail.profile.locate(t, angle_rad=tilt, origin=(float(foot.y), float(foot.z)))
        p = rail.profile.evaluate(u)
        height = -(p.y - foot.y) * np.sin(tilt) + (p.z - foot.z) * np.cos(tilt)
        origin = np.array([touch.x_mm, touch.y_mm, touch.z_mm])
        return u, origin + np.asarray(t, float)[..., None] * touch.tangent + height[..., None] * touch.normal

    def gap_over_plane(self, points: Floats, guess_mm: ArrayLike = 0.0) -> Floats:
        """True undeformed gap (mm) along the normal at first touch, at points (..., 3) that lie over the tangent plane.

        Sought from a guess (...); NaN if one of the bodies is missing there. Irregularities are left out:
        they are constant along a line across.
        """
        return self.wheel.distance_along(points, np.broadcast_to(self.first.normal, points.shape), guess_mm)


@dataclass(frozen=True, kw_only=True, eq=False)
class Pair:
    """A wheel and the rail below it, in the frame of the left side; the right side is given as its mirror image.

    With `flange_climb` the wheel may stand beyond the steepest place of its flange.
    """

    rail: RailPose
    wheel: Profile
    rolling_radius_mm: float
    tape_circle_y_mm: float
    flange_climb: bool = False

    def hung(self, shift_mm: float, roll_rad: float, yaw_rad: float) -> WheelPose:
        """The wheel with the axle's centre at height zero; shift, roll and yaw as in `place`, on the left side."""
        return WheelPose(
            profile=self.wheel,
            rolling_radius_mm=self.rolling_radius_mm,
            tape_circle_y_mm=self.tape_circle_y_mm,
            axes=_axes(roll_rad, yaw_rad),
            centre_mm=np.array([0.0, shift_mm, 0.0]),
        )

    def placed(
        self, shift_mm: float, roll_rad: float, yaw_rad: float, *, reach_mm: float = REACH_MM
    ) -> Placement | str:
        """The wheel lowered on the rail, or why it cannot stand there."""
        return _touch(self.rail, self.hung(shift_mm, roll_rad, yaw_rad), reach_mm, flange_climb=self.flange_climb)


def pair_of(
    rail_profile: Profile,
    wheel_profile: Profile,
    *,
    inclination_rad: float,
    rolling_radius_mm: float = 460.0,
    track: Track | None = None,
    flange_climb: bool = False,
) -> Pair:
    """Set a rail to gauge, and a wheel on its axle.

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
    rolling_radius_mm: float = 460.0,
    track: Track | None = None,
    side: TrackSide = "left",
    reach_mm: float = REACH_MM,
    flange_climb: bool = False,
) -> Placement:
    """Lower a wheel on a rail until the rigid bodies touch.

    Parameters
    ----------
    lateral_shift_mm
        Wheelset displacement, positive towards the left rail.
    side
        Which wheel; the right wheel on its rail is given as the left wheel of the mirror image.
    reach_mm
        Further minima of the vertical gap up to this height above the first touch are reported.
    flange_climb
        Whether the wheel may stand beyond the steepest place of its flange.

    Raises
    ------
    InputError
        If the wheel leaves the rail or its flange climbs over it; the message gives the possible shifts.
    """
    pair = pair_of(
        rail_profile,
        wheel_profile,
        inclination_rad=inclination_rad,
        rolling_radius_mm=rolling_radius_mm,
        track=track,
        flange_climb=flange_climb,
    )
    sign = SIGN[side]

    def at(shift: float) -> Placement | str:
        return pair.placed(sign * shift, sign * roll_rad, sign * yaw_rad, reach_mm=reach_mm)

    placed = at(lateral_shift_mm)
    if isinstance(placed, str):
        raise InputError(f"lateral shift {lateral_shift_mm:g} mm: {placed}; {possible_shifts(at)}")
    return placed


def possible_shifts(at: Callable[[float], object]) -> str:
    """Possible shifts in words: the shifts at which `at` does not return a reason against them."""
    good = [shift for shift in EVERY_SHIFT if not isinstance(at(float(shift)), str)]
    if not good:
        return "no shift between -40 and 40 mm is possible for this wheel, rail and track"
    return f"shifts between {min(good):g} and {max(good):g} mm (in steps of 0.5 mm) are possible"


def _axes(roll: float, yaw: float) -> Floats:
    cr, sr, cy, sy = np.cos(roll), np.sin(roll), np.cos(yaw), np.sin(yaw)
    turn_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    turn_z = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn_z @ turn_x)


def _touch(rail: RailPose, wheel: WheelPose, reach_mm: float, *, flange_climb: bool) -> Placement | str:
    """The wheel lowered from an axle at height zero onto the rail, or the reason why it cannot stand there."""
    u, points = search_points(wheel.profile)
    places = places_near(rail, wheel, points, reach_mm)
    _, _, y, z = wheel.silhouette_of(points.taken(places))
    # what is not looked at lies integral_difference
    gap = np.full(u.size, np.inf)
    gap[places] = z - rail.height_at_y(y)
    over = np.isfinite(gap)
    if np.count_nonzero(over) < 3:
        return "the wheel does not stand over the rail"
    lowest = int(np.nanargmin(gap))
    if not (0 < lowest < u.size - 1 and over[lowest - 1] and over[lowest + 1]):
        return "the wheel leaves the rail: the end of one of the running surfaces carries it"
    inner = np.flatnonzero(over[:-2] & over[1:-1] & over[2:]) + 1
    minima = inner[
        (gap[inner] <= gap[inner - 1]) & (gap[inner] < gap[inner + 1]) & (gap[inner] <= gap[lowest] + reach_mm)
    ]

    def slope_difference(v: Floats) -> Floats:
        p = wheel.profile.evaluate(v)
        theta, _, y, _ = wheel.silhouette_of(p)
        normal = wheel.axes @ (np.sin(theta), p.dz / p.dy, -np.cos(theta))
        return np.asarray(-normal[1] / normal[2] - np.tan(rail.section(rail.parameter_at_y(y))[2]))

    low, high = u[minima - 1], u[minima + 1]
    f_low, f_high = np.split(slope_difference(np.concatenate((low, high))), 2)
    # without a sign change it is a step in the height (rounded data of a profile), not a stationary point
    rising = (f_low < 0.0) & (f_high > 0.0)
    v = sign_changes(slope_difference, *(ends[rising] for ends in (low, high, f_low, f_high)))
    _, _, y, z = wheel.silhouette(v)
    u_rail = rail.parameter_at_y(y)
    tangent_gap = z - rail.section(u_rail)[1]
    if not v.size:
        return "no point of the running surfaces is tangent to the other one where they come closest"
    order = np.argsort(tangent_gap)
    height = float(tangent_gap[order[0]])
    if height - gap[lowest] > _STEP_MM:
        return (
            f"the bodies come closest at y = {points.y[lowest]:.2f} mm of the wheel, where neither line is tangent to"
            f" the other one, {1e3 * (height - gap[lowest]):.0f} micrometres before they touch elsewhere: a step in a"
            " profile"
        )
    down = replace(wheel, centre_mm=wheel.centre_mm - np.array([0.0, 0.0, height]))
    touch_points = touch_points_at(rail, down, v[order], u_rail[order], tangent_gap[order] - height)
    climbs = climbs_at(down.profile, touch_points[0].wheel_y_mm)
    if reason := find_support_problem(down.profile, touch_points[0], climbs=climbs, flange_climb=flange_climb):
        return reason
    return Placement(rail=rail, wheel=down, touch_points=touch_points, climbs=climbs)
