"""Profiles of rails and wheels: position, slope, curvature, junctions, axes, and standard shapes.

A profile has its own axes: y lateral (positive to the field side), z up, in mm. A rail has its material below the
profile, a wheel above it. A profile is one curve with the parameter u in [0, n]: segment k covers u in [k, k+1].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from fecontact.arrays import Floats
from fecontact.errors import InputError, check_positive
from fecontact.profiles.pieces import MonotoneFunction, PiecewiseCurve
from fecontact.profiles.reading import MM_PER_UNIT, suggest_mirroring, suggest_option
from fecontact.profiles.segments import Arc, CurvePoints, Polynomial, Segment, SmoothingResult, Spline, StraightSegment
from fecontact.profiles.suspicions import SuspiciousProfileError

if TYPE_CHECKING:
    from fecontact.profiles.point_problems import PointProblem


ProfileKind = Literal["rail", "wheel"]
Side = Literal["left", "right"]

# Largest coordinate (mm): doubles are 1e-7 mm apart there, and products of a few coordinates are finite.
LARGEST_COORDINATE_MM = 1e9
# Least tangent jump of a corner (rad). The rounding of published coordinates causes 1e-6, a real corner has 1e-2.
CORNER_RAD = 1e-3
# Least curvature jump of a junction (1/mm): the curvature of an arc of R 100 m.
CURVATURE_JUMP_PER_MM = 1e-5
# Largest gap between neighbouring segments (mm). The published sections of EN 15302 have gaps of up to 8.2e-4 mm.
JOINT_GAP_MM = 1e-3


# Straight segments may have a curvature of the size of rounding errors, because sums of large numbers cancel.
_STRAIGHT_PER_MM = 1e-9


def invert_curvature_mm(curvature_per_mm: float) -> float | None:
    """Signed radius of a curvature; None for a straight line.

    Parameters
    ----------
    curvature_per_mm
        Curvature in 1/mm.

    Returns
    -------
    float or None
        Radius in mm with the sign of the curvature.
    """
    return 1.0 / curvature_per_mm if abs(curvature_per_mm) > _STRAIGHT_PER_MM else None


def format_radius(radius_mm: float | None, form: str = "{:.1f}") -> str:
    """Text of a radius in mm; None is a straight line."""
    return "straight" if radius_mm is None else form.format(radius_mm)


@dataclass(frozen=True, kw_only=True)
class Junction:
    """Point between two segments where slope or curvature changes.

    Attributes
    ----------
    y_mm, z_mm
        Position (mm).
    angle_left_rad, angle_right_rad
        Angle of the tangent on both sides (rad).
    curvature_left_per_mm, curvature_right_per_mm
        Curvature on both sides (1/mm), positive if the body is convex.
    step_mm
        Distance between the ends of both segments (mm), from the digits of published coordinates.
    """

    y_mm: float
    z_mm: float
    angle_left_rad: float
    angle_right_rad: float
    curvature_left_per_mm: float
    curvature_right_per_mm: float
    step_mm: float = 0.0

    @property
    def turn_rad(self) -> float:
        """Change of the tangent angle at the junction, positive to the left (rad)."""
        return math.remainder(self.angle_right_rad - self.angle_left_rad, math.tau)

    @property
    def is_corner(self) -> bool:
        """Whether the slope jumps."""
        return abs(self.turn_rad) > CORNER_RAD


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """Running surface as a chain of segments.

    The segments go from the gauge side (small y) to the field side.

    Attributes
    ----------
    name
        Name that the user knows.
    kind
        `rail` (material below the profile) or `wheel` (material above it).
    segments
        Running surface in mm, from small y to large y.
    source, certainty
        Source of the numbers, and their certainty.
    outline
        Closed outline of the body, which begins with the running surface in its direction; empty if only the running
        surface is available.
    notes
        Assumptions of a reader, which are shown to the user.
    doubtful_y_mm
        Range across the profile (mm) where its shape is doubtful, so that no contact there is solved; None if the whole
        profile is usable.
    measured
        Smoothing of the profile from measured points; None for an exact profile, or for points that are used as exact.
    points : ndarray of shape (n, 2) or None
        Points in mm through which the profile was made, exact or smoothed; None for a profile without points.
    problems
        Points of a file that were left out on request, and doubtful points that were kept.
    gauge_side_end_mm
        Widest measured point (y, z) of a head, at which its gauge side was cut because it turns in below; None if it
        was not cut.

    Raises
    ------
    InputError
        Neighbouring segments do not meet within 0.001 mm, or the running surface runs towards small y.

    Examples
    --------
    >>> from fecontact.profiles.library import load_library_profile
    >>> rail = load_library_profile("60E1")
    >>> rail.kind, round(float(rail.curvature(0.0)) ** -1)
    ('rail', 300)
    """

    name: str
    kind: ProfileKind
    segments: tuple[Segment, ...]
    source: str = ""
    certainty: str = ""
    outline: tuple[Segment, ...] = ()
    notes: tuple[str, ...] = ()
    doubtful_y_mm: tuple[float, float] | None = None
    measured: SmoothingResult | None = None
    points: Floats | None = None
    problems: tuple[PointProblem, ...] = ()
    gauge_side_end_mm: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Refuse a profile without segments, and segments with gaps of more than `JOINT_GAP_MM`."""
        if not self.segments:
            raise InputError(f"{self.name}: the running surface has no segments; give at least one")
        for chain_name, chain, closed in (("running surface", self.segments, False), ("outline", self.outline, True)):
            ends = [segment.evaluate(np.array([0.0, 1.0])) for segment in chain]
            for i, end in enumerate(ends if closed else ends[:-1]):
                j = (i + 1) % len(ends)
                gap = math.hypot(ends[j].y[0] - end.y[1], ends[j].z[0] - end.z[1])
                if not gap <= JOINT_GAP_MM:
                    raise InputError(
                        f"{self.name}: {chain_name}: segment {i + 1} ends at ({end.y[1]:.6g}, {end.z[1]:.6g}) mm but "
                        f"segment {j + 1} starts at ({ends[j].y[0]:.6g}, {ends[j].z[0]:.6g}) mm; the gap is {gap:.3g} "
                        f"mm; allowed: at most {JOINT_GAP_MM:g} mm; give both points equal coordinates"
                        + ", or leave out all [[body]] segments: the running surface is enough"
                        * closed
                    )
            if not closed and not ends[0].y[0] < ends[-1].y[1]:
                raise InputError(
                    f"{self.name}: the running surface runs from y = {ends[0].y[0]:.6g} to {ends[-1].y[1]:.6g} mm; "
                    "list its segments from small to large y"
                )

    def thinned(self, first: Literal[0, 1] = 0) -> Profile | None:
        """Profile through every second point; None for a profile without points.

        It shows the influence of the points. A wrong point, except at the ends, is in the profile from point 0 or in
        the profile from point 1.

        Parameters
        ----------
        first
            Index of the first point that is kept besides the end, 0 or 1.

        Returns
        -------
        Profile or None
            Thinned profile; None for smoothed profiles too.
        """
        if self.points is None or self.measured is not None:
            return None
        thinned_segments = (
            segment.thinned(first) if isinstance(segment, Spline) else segment for segment in self.segments
        )
        return replace(self, segments=tuple(thinned_segments))

    @property
    def convex_sign(self) -> float:
        """Factor that makes the curvature positive where the body is convex."""
        return -1.0 if self.kind == "rail" else 1.0

    def evaluate(self, u: ArrayLike, side: Side = "right") -> CurvePoints:
        """Points at the parameter u.

        Parameters
        ----------
        u
            Parameters in any shape.
        side
            Segment at a whole number u, which is the end of one segment and the start of the next: the `left` or the
            `right` one.

        Returns
        -------
        CurvePoints
            Points (mm) in the shape of u; NaN outside [0, number of segments].
        """
        return self.pieces.evaluate(self._mask_outside(u), side)

    def _mask_outside(self, u: ArrayLike) -> Floats:
        """Parameters, with NaN outside the running surface.

        Parameters are results of sums, so a rounding error beyond the ends is allowed.
        """
        u, n = np.asarray(u, dtype=float), len(self.segments)
        return np.where((u >= -1e-12 * n) & (u <= n * (1.0 + 1e-12)), u, np.nan)

    @cached_property
    def pieces(self) -> PiecewiseCurve:
        """Running surface as short polynomials."""
        return PiecewiseCurve.of(self.segments)

    def locate(self, t: ArrayLike, *, angle_rad: float = 0.0, origin: tuple[float, float] = (0.0, 0.0)) -> Floats:
        """Parameter u of the points at a coordinate along a tilted axis.

        The axis starts at `origin` and points along (cos angle, sin angle). Seen along the normal of the axis, the
        profile runs forward on one or more stretches and folds back between them. Only the widest stretch has results.

        Parameters
        ----------
        t
            Coordinates along the axis (mm), in any shape.
        angle_rad
            Angle of the axis (rad).
        origin
            Origin of the axis (y, z) (mm).

        Returns
        -------
        ndarray
            Parameters in the shape of t; NaN outside the widest stretch. In a gap that rounded numbers leave at a
            joint, the result is the joint.
        """
        stretch = _find_stretch(self, angle_rad)
        t = np.asarray(t, dtype=float) + (origin[0] * math.cos(angle_rad) + origin[1] * math.sin(angle_rad))
        return np.full(t.shape, np.nan) if stretch is None else stretch.inverted(t)

    @property
    def y_range_mm(self) -> tuple[float, float]:
        """Smallest and largest y of the running surface (mm)."""
        y = self.pieces.ends.y
        return float(y.min()), float(y.max())

    def height(self, y: ArrayLike) -> Floats:
        """Height z (mm) at y (mm); NaN outside the running surface.

        Parameters
        ----------
        y
            Positions across in mm, in any shape.

        Returns
        -------
        ndarray
            Height in mm.
        """
        return self.evaluate(self.locate(y)).z

    def slope(self, y: ArrayLike, side: Side = "right") -> Floats:
        """Slope dz/dy at y (mm), with a choice of side at a junction.

        Parameters
        ----------
        y
            Lateral positions (mm), in any shape.
        side
            Side of a junction.

        Returns
        -------
        ndarray
            Slopes in the shape of y; very large, with either sign, where the profile is vertical.
        """
        points = self.evaluate(self.snap(self.locate(y)), side)
        with np.errstate(divide="ignore"):
            return np.asarray(points.dz / points.dy)

    def curvature(self, y: ArrayLike, side: Side = "right") -> Floats:
        """Curvature (1/mm) at y (mm), with a choice of side at a junction.

        It is positive where the body is convex.

        Parameters
        ----------
        y
            Positions across in mm, in any shape.
        side
            Side from which the curvature at a junction is taken.

        Returns
        -------
        ndarray
            Curvature in 1/mm.
        """
        return self.convex_sign * self.evaluate(self.snap(self.locate(y)), side).curvature_per_mm

    def snap(self, u: ArrayLike, tolerance_mm: float = 1e-6) -> Floats:
        """Round parameters near the end of a segment to this end.

        Then both sides of the end can be evaluated.

        Parameters
        ----------
        u
            Parameters in any shape.
        tolerance_mm
            Largest distance from the end along the profile (mm).

        Returns
        -------
        ndarray
            Parameters in the shape of u.
        """
        u = np.asarray(u, dtype=float)
        points = self.evaluate(u)
        nearest = np.round(u)
        return np.where(np.abs(u - nearest) * np.hypot(points.dy, points.dz) <= tolerance_mm, nearest, u)

    @cached_property
    def junctions(self) -> tuple[Junction, ...]:
        """Points with a jump of slope or curvature, from small to large y.

        Lengths are in mm, angles in rad; curvatures (1/mm) are positive for a convex body. Jumps of the curvature of up
        to `CURVATURE_JUMP_PER_MM` are left out.
        """
        ends, jumps = np.arange(1, len(self.segments), dtype=float), []
        left, right = self.evaluate(ends, "left"), self.evaluate(ends, "right")
        for i in range(ends.size):
            junction = Junction(
                y_mm=float(right.y[i]),
                z_mm=float(right.z[i]),
                angle_left_rad=float(left.angle_rad[i]),
                angle_right_rad=float(right.angle_rad[i]),
                curvature_left_per_mm=float(self.convex_sign * left.curvature_per_mm[i] + 0.0),
                curvature_right_per_mm=float(self.convex_sign * right.curvature_per_mm[i] + 0.0),
                step_mm=float(np.hypot(right.y[i] - left.y[i], right.z[i] - left.z[i])),
            )
            jump = abs(junction.curvature_right_per_mm - junction.curvature_left_per_mm)
            if junction.is_corner or jump > CURVATURE_JUMP_PER_MM:
                jumps.append(junction)
        return tuple(jumps)

    @property
    def length_mm(self) -> float:
        """Arc length of the running surface (mm)."""
        return float(self.pieces.arc.values[-1])

    def arc_length(self, u: ArrayLike) -> Floats:
        """Arc length (mm) from the gauge-side end to the parameter u.

        Parameters
        ----------
        u
            Parameters, in any shape.

        Returns
        -------
        ndarray
            Arc length in mm, NaN outside the running surface.
        """
        return np.asarray(self.pieces.arc.function(self._mask_outside(u))[..., 0])

    def spread(self, step_mm: float) -> Floats:
        """Parameters u at equal arc lengths along the profile.

        They are exact for exact profiles. For smoothed profiles they have the accuracy of a table.

        Parameters
        ----------
        step_mm
            Largest distance of neighbours (mm).

        Returns
        -------
        ndarray
            Parameters (n,) from end to end.
        """
        s = np.linspace(0.0, self.length_mm, int(np.ceil(self.length_mm / step_mm)) + 1)
        return self.at_arc_length(s) if self.measured is None else np.interp(s, self.pieces.arc.values, self.pieces.u)

    def at_arc_length(self, s: ArrayLike) -> Floats:
        """Parameter u at the arc length s (mm); NaN beyond the ends.

        Parameters
        ----------
        s
            Arc lengths from the gauge-side end in mm, in any shape.

        Returns
        -------
        ndarray
            Parameters u.
        """
        return self.pieces.arc.inverted(np.asarray(s, dtype=float))


# cached: a pose of a rail is evaluated along equal axes many times
@lru_cache(maxsize=64)
def _find_stretch(profile: Profile, angle_rad: float) -> MonotoneFunction | None:
    return profile.pieces.along(angle_rad)


# --- Profiles that a few lengths define: arcs, straight segments, and standard heads of tangent arcs.

PlanePoint = tuple[float, float]


def make_arc(start: PlanePoint, end: PlanePoint, *, centre: PlanePoint, radius: float, label: str = "arc") -> Arc:
    """Make the shorter arc between two points about a centre.

    The points only define its two angles.

    Parameters
    ----------
    start, end
        Ends of the arc (y, z) (mm).
    centre
        Centre (y, z) (mm).
    radius
        Radius (mm).
    label
        Subject of a message.

    Returns
    -------
    Arc
        Arc shorter than a half circle.

    Raises
    ------
    InputError
        A point is more than 0.001 mm off the circle.
    """
    angles = []
    for point in (start, end):
        distance_mm = math.hypot(point[0] - centre[0], point[1] - centre[1]) - radius
        if not abs(distance_mm) <= JOINT_GAP_MM:
            raise InputError(
                f"{label}: the point {point} mm is {distance_mm:.3g} mm off the circle of radius {radius:g} mm "
                f"about {centre} mm; allowed: at most {JOINT_GAP_MM:g} mm; correct the point, the centre or the radius"
            )
        angles.append(math.atan2(point[1] - centre[1], point[0] - centre[0]))
    turn = math.remainder(angles[1] - angles[0], math.tau)
    return Arc(centre=centre, radius=radius, angle_from=angles[0], angle_to=angles[0] + turn)


def make_tangent_head(
    radii: Sequence[float], half_widths: Sequence[float], *, side_one_in: float, side_to_z: float
) -> list[Segment]:
    """Make the segments of a symmetric rail head of tangent arcs and straight sides.

    Parameters
    ----------
    radii
        Radii of the arcs from the crown outwards (mm).
    half_widths
        Distance from the axis of the point where each arc meets the next (mm), one fewer than the radii.
    side_one_in
        The sides lean outwards, 1 across to this much down; infinite for vertical sides.
    side_to_z
        Height at which the sides end (mm, negative: below the crown).

    Returns
    -------
    list of Segment
        Segments from left to right.

    Raises
    ------
    InputError
        The arcs do not follow one another outwards and downwards.
    """
    # Each centre is on the radius through the joint, so the joint is exactly tangent. Angles are from the y axis.
    centre, angles = (0.0, -radii[0]), [math.pi / 2]
    right: list[Segment] = []
    for i, radius in enumerate(radii):
        if i < len(half_widths):
            reach = (half_widths[i] - centre[0]) / radius
            angle = math.acos(reach) if 0.0 < reach < 1.0 else math.nan
        else:
            angle = math.atan(1.0 / side_one_in)
        if not angle < angles[-1]:
            raise InputError(
                f"head: arc {i + 1} with radius {radius:g} mm cannot reach its outer end; give the half-widths from "
                f"the crown outwards, each within its arc (radii {list(radii)}, half_widths {list(half_widths)} mm)"
            )
        right.append(Arc(centre=centre, radius=radius, angle_from=angles[-1], angle_to=angle))
        angles.append(angle)
        if i + 1 < len(radii):
            shift = radius - radii[i + 1]
            centre = (centre[0] + shift * math.cos(angle), centre[1] + shift * math.sin(angle))
    corner = (centre[0] + radii[-1] * math.cos(angles[-1]), centre[1] + radii[-1] * math.sin(angles[-1]))
    if not side_to_z < corner[1]:
        raise InputError(
            f"head: side_to_z is {side_to_z:g} mm; allowed: below the end of the last arc, {corner[1]:.4f} mm"
        )
    foot = (corner[0] + (corner[1] - side_to_z) / side_one_in, side_to_z)
    right.append(StraightSegment(start=corner, end=foot))
    crown = Arc(centre=(0.0, -radii[0]), radius=radii[0], angle_from=math.pi - angles[1], angle_to=angles[1])
    return [*mirror_segments(right[1:]), crown, *right[1:]]


def mirror_segments(segments: Sequence[Segment]) -> list[Segment]:
    """Mirror a chain of segments in y.

    Parameters
    ----------
    segments
        Exact segments.

    Returns
    -------
    list of Segment
        Mirror image in reverse order, so that it continues a chain that ends on the axis.
    """
    image: list[Segment] = []
    for segment in reversed(segments):
        if isinstance(segment, StraightSegment):
            image.append(
                StraightSegment(start=(-segment.end[0], segment.end[1]), end=(-segment.start[0], segment.start[1]))
            )
        elif isinstance(segment, Arc):
            image.append(
                Arc(
                    centre=(-segment.centre[0], segment.centre[1]),
                    radius=segment.radius,
                    angle_from=math.pi - segment.angle_to,
                    angle_to=math.pi - segment.angle_from,
                )
            )
        elif isinstance(segment, Polynomial):
            flipped = tuple(c * (-1.0) ** k for k, c in enumerate(segment.coefficients))
            image.append(Polynomial(coefficients=flipped, y_from=-segment.y_to, y_to=-segment.y_from))
        else:
            raise AssertionError("points are never mirrored")
    return image


# Half-width of a usual rail head, such as 60E1.
_HEAD_HALF_WIDTH_MM = 36.0


def make_circular_rail_head(radius_mm: float, half_width_mm: float = _HEAD_HALF_WIDTH_MM) -> Profile:
    """Circular rail head with its crown at (0, 0), for comparisons with closed forms.

    The arc reaches to |y| = min(half_width_mm, 0.95 radius_mm).

    Parameters
    ----------
    radius_mm
        Radius (mm).
    half_width_mm
        Half of the width of the head (mm).

    Returns
    -------
    Profile
        Rail.

    Raises
    ------
    InputError
        A length is not finite and positive.

    Examples
    --------
    >>> from fecontact.profiles.curve import make_circular_rail_head
    >>> make_circular_rail_head(300.0).name
    'circle:300'
    """
    check_positive("radius of the rail head", radius_mm, "mm", "for example circle:300")
    check_positive("half-width of the rail head", half_width_mm, "mm", f"for example {_HEAD_HALF_WIDTH_MM:g}")
    reach = math.asin(min(half_width_mm / radius_mm, 0.95))
    arc = Arc(centre=(0.0, -radius_mm), radius=radius_mm, angle_from=math.pi / 2 + reach, angle_to=math.pi / 2 - reach)
    return Profile(name=f"circle:{radius_mm:g}", kind="rail", segments=(arc,), source="circular arc")


def make_two_arc_rail_head(
    crown_mm: float, gauge_mm: float, junction_mm: float, half_width_mm: float = _HEAD_HALF_WIDTH_MM
) -> Profile:
    """Make a rail head of two tangent arcs with its crown at (0, 0).

    It has a curvature junction at a given distance from the crown.

    Parameters
    ----------
    crown_mm
        Radius on the field side of the junction (mm).
    gauge_mm
        Radius on the gauge side of the junction (mm).
    junction_mm
        Arc length from the crown to the junction (mm), positive to the gauge side. Positive: the crown is on the first
        arc. Negative: the crown is on the second arc. 0: the crown is at the junction.
    half_width_mm
        Largest |y| of the arcs (mm). The arcs reach at most to 95 % of their radius from their centre.

    Returns
    -------
    Profile
        Rail.

    Raises
    ------
    InputError
        A length is not finite and positive, or the crown is not on the arcs.

    Examples
    --------
    >>> from fecontact.profiles.curve import make_two_arc_rail_head
    >>> make_two_arc_rail_head(300.0, 80.0, 2.5).name
    'arcs:300/80@2.5'
    """
    for name, radius in (("field", crown_mm), ("gauge", gauge_mm)):
        check_positive(f"radius on the {name} side", radius, "mm", "for example arcs:300/80@2.5")
    radius = crown_mm if junction_mm >= 0.0 else gauge_mm
    if not abs(junction_mm) < min(radius, half_width_mm):
        raise InputError(
            f"junction at {junction_mm:g} mm from the crown; allowed: less than the radius of the arc, {radius:g} mm,"
            f" and the half-width, {half_width_mm:g} mm"
        )
    angle = math.pi / 2 + junction_mm / radius
    normal = (math.cos(angle), math.sin(angle))
    # each centre is on the common normal, so the junction is exactly tangent
    joint = (radius * normal[0], radius * (normal[1] - 1.0))
    segments: list[Segment] = []
    for r, side in ((gauge_mm, -1.0), (crown_mm, 1.0)):
        centre = (joint[0] - r * normal[0], joint[1] - r * normal[1])
        reach = min(max((half_width_mm - side * centre[0]) / r, 0.0), 0.95)
        end = math.pi / 2 - side * math.asin(reach)
        first, last = (end, angle) if side < 0.0 else (angle, end)
        if not first > last:
            raise InputError(
                f"junction at {junction_mm:g} mm: the arc of radius {r:g} mm is too steep there; give a smaller"
                " distance"
            )
        segments.append(Arc(centre=centre, radius=r, angle_from=first, angle_to=last))
    name = f"arcs:{crown_mm:g}/{gauge_mm:g}@{junction_mm:g}"
    return Profile(name=name, kind="rail", segments=tuple(segments), source="two tangent arcs")


def make_cylinder_wheel(y_from_mm: float = -70.0, y_to_mm: float = 65.0) -> Profile:
    """Wheel with a straight tread at z = 0 and no flange.

    It serves for comparisons with closed forms.

    Parameters
    ----------
    y_from_mm, y_to_mm
        Ends of the tread (mm).

    Returns
    -------
    Profile
        Wheel.

    Raises
    ------
    InputError
        The tread does not run from small to large y.
    """
    tread = StraightSegment(start=(float(y_from_mm), 0.0), end=(float(y_to_mm), 0.0))
    return Profile(name="cylinder", kind="wheel", segments=(tread,), source="straight line")


# --- Checks of the size and the axes of a profile: y to the field side, z up, mm.

# The least span is above the number that a head or a tread has in cm.
_ALLOWED_SPAN_MM = {"rail": (10.0, 500.0), "wheel": (15.0, 500.0)}
_USUAL_SPAN_MM = {"rail": 72.0, "wheel": 135.0}
# Neither a dip of a rail's head nor a drop of a wheel's rim at its field side is so deep.
_LARGEST_DIP_MM = 8.0
# Least width at the top of a head. The back of a flange is narrower.
_LEAST_HEAD_WIDTH_MM = 20.0


def check_size(y: Floats, z: Floats, *, kind: ProfileKind, label: str, unit: str = "mm") -> None:
    """Check the size of a profile.

    Parameters
    ----------
    y, z
        Coordinates (n,) in mm.
    kind
        `rail` or `wheel`.
    label
        Subject of the message.
    unit
        Unit in which the file was read.

    Raises
    ------
    InputError
        The size is implausible. The message has the unit in which the profile would have the usual size.
    """
    span, (low, high) = float(max(np.ptp(y), np.ptp(z))), _ALLOWED_SPAN_MM[kind]
    if low <= span <= high:
        return
    in_file, usual = max(span / MM_PER_UNIT[unit], 1e-300), _USUAL_SPAN_MM[kind]
    likely = min(MM_PER_UNIT, key=lambda unit_name: abs(math.log(in_file * MM_PER_UNIT[unit_name] / usual)))
    advice = f"the unit of the file may be {likely}: {suggest_option(kind, 'units', likely)}"
    raise InputError(
        f"{label}: the profile spans {span:.4g} mm; allowed: {low:g} to {high:g} mm; "
        + (advice if likely != unit else f"give the whole running surface of the {kind}, and only this surface")
    )


def check_shape(
    y: Floats,
    z: Floats,
    *,
    kind: ProfileKind,
    what: str,
    flipped_columns: str = "1,-2",
    unit: str = "mm",
    is_mirrored: bool = False,
) -> None:
    """Check the size of a profile and the direction of its axes.

    Parameters
    ----------
    y, z
        Coordinates (n,) in mm.
    kind
        `rail` or `wheel`.
    what
        Subject of the message.
    flipped_columns
        Columns of the file with the opposite sign of z.
    unit
        Unit in which the file was read.
    is_mirrored
        Whether the profile was mirrored after it was read.

    Raises
    ------
    InputError
        The size is implausible, z points down, or a wheel has its flange on the field side.
    """
    check_size(y, z, kind=kind, label=what, unit=unit)
    if kind == "rail":
        _check_rail_shape(y, z, what, flipped_columns)
    else:
        _check_wheel_shape(y, z, what, flipped_columns, is_mirrored=is_mirrored)


def _check_rail_shape(y: Floats, z: Floats, what: str, flipped_columns: str) -> None:
    """Refuse two heads, a head upside down, and a wheel in place of a rail."""
    dip, at = _find_deepest_dip(z)
    sides = [(y[side], z[side]) for side in (slice(at), slice(at, None))]
    if dip > _LARGEST_DIP_MM and all(
        np.ptp(side_y[side_z > side_z.max() - _LARGEST_DIP_MM]) > _LEAST_HEAD_WIDTH_MM for side_y, side_z in sides
    ):
        raise InputError(
            f"{what}: the profile has two heads with a groove of {dip:.1f} mm at y = {y[at]:.1f} mm between them:"
            " two rails, or a rail with its guard rail; cut the file there, and give only the running rail. If the"
            " file has the other direction of y, as MiniProf files of rails have, cut it at"
            f" {-y[at]:.1f} mm. A crossing nose with its wing rail is not a known shape"
        )
    # a head is above the chord between its ends, even if it is canted, worn or half
    middle = np.abs(y - 0.5 * (y[0] + y[-1])) <= 0.1 * abs(y[-1] - y[0])
    height_above_chord = 0.0
    if np.count_nonzero(middle) > 1:
        height_above_chord = measure_median_height(y[middle], z[middle]) - 0.5 * (z[0] + z[-1])
    if height_above_chord < -0.1:
        raise InputError(
            f"{what}: the middle of the rail is {-height_above_chord:.2f} mm below the chord between its ends, "
            "but z points up and a rail head is highest in the middle; reverse the sign of z, or "
            + suggest_option("rail", "columns", flipped_columns)
        )
    if dip > _LARGEST_DIP_MM:
        raise SuspiciousProfileError(
            f"{what}: the profile dips by {dip:.1f} mm at y = {y[at]:.1f} mm, like the flange of a wheel, but a"
            " rail is needed; give the file as the wheel (--wheel, or --kind wheel), or cut the profile at the"
            " sides of the head",
            "other body",
        )


def _check_wheel_shape(y: Floats, z: Floats, what: str, flipped_columns: str, *, is_mirrored: bool) -> None:
    """Refuse a rail in place of a wheel, a wheel upside down, and a flange on the field side."""
    middle = (y > y[0] + 0.3 * (y[-1] - y[0])) & (y < y[0] + 0.7 * (y[-1] - y[0]))
    if (
        np.count_nonzero(middle) > 1
        and measure_median_height(y[middle], z[middle]) - max(z[0], z[-1]) > _LARGEST_DIP_MM
        and _find_deepest_dip(z)[0] < 1.0
    ):
        raise SuspiciousProfileError(
            f"{what}: both ends of the profile are more than {_LARGEST_DIP_MM:g} mm below its middle, as on a rail,"
            " but a wheel is needed; give the file as the rail (--rail, or --kind rail)",
            "other body",
        )
    # the back of the flange and the face of the rim are high, so they are ignored
    steep = np.abs(np.diff(z)) > 4.0 * np.abs(np.diff(y))
    gentle = np.flatnonzero(~steep)
    if not gentle.size:
        raise InputError(f"{what}: the whole profile is steep, but y is across and z up; swap the columns")
    y, z = y[gentle[0] : gentle[-1] + 2], z[gentle[0] : gentle[-1] + 2]
    tread = measure_median_height(y, z)
    rise, drop = float(z.max()) - tread, tread - float(z.min())
    if rise > 10.0 and rise > drop:
        raise InputError(
            f"{what}: the profile rises to {rise:.1f} mm above the tread at y = {y[z.argmax()]:.1f} mm and falls only "
            f"{drop:.1f} mm below it, but z points up and a flange reaches down; reverse the sign of z, or "
            + suggest_option("wheel", "columns", flipped_columns)
        )
    if drop > 10.0 and y[z.argmin()] > 0.5 * (y.min() + y.max()):
        raise SuspiciousProfileError(
            f"{what}: the flange is at y = {y[z.argmin()]:.1f} mm, but a flange is on the gauge side, y < 0; reverse "
            "the sign of y, or " + suggest_mirroring("wheel", mirrored=is_mirrored),
            "mirrored",
        )


def measure_median_height(y: Floats, z: Floats) -> float:
    """Median height of a profile over its width.

    Points may be at any distances: each chord counts with its width, and not each point.

    Parameters
    ----------
    y, z
        Coordinates (n,) in mm, at least two points.

    Returns
    -------
    float
        Height in mm.
    """
    chord_heights = 0.5 * (z[1:] + z[:-1])
    order = np.argsort(chord_heights)
    width = np.cumsum(np.abs(np.diff(y))[order])
    return float(chord_heights[order[np.searchsorted(width, 0.5 * width[-1])]])


def _find_deepest_dip(z: Floats) -> tuple[float, int]:
    """Find the largest depth of a profile below higher points on both of its sides.

    Parameters
    ----------
    z
        Heights (n,) in mm.

    Returns
    -------
    depth, index
        Depth (mm), and the index of the point.
    """
    depth = np.minimum(np.maximum.accumulate(z), np.maximum.accumulate(z[::-1])[::-1]) - z
    at = int(np.argmax(depth))
    return float(depth[at]), at
