"""Plane profile lines made of segments: positions, slopes, curvatures, junctions, axes, and standard shapes.

A profile lives in its own axes: y lateral (positive to the field side), z up, in mm. A rail has its material below the
line, a wheel above it. A profile is one curve with the parameter u in [0, n]: segment k covers u in [k, k+1].
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
from fecontact.profiles.pieces import Increasing, Pieces
from fecontact.profiles.reading import MM, mirror_remedy, remedy
from fecontact.profiles.segments import Arc, CurvePoints, Line, Measured, Polynomial, Segment, Spline

if TYPE_CHECKING:
    from fecontact.profiles.point_problems import Problem


Kind = Literal["rail", "wheel"]
Side = Literal["left", "right"]

# Farthest coordinate (mm): doubles lie 1e-7 mm apart there, and products of a few coordinates are finite.
FARTHEST_MM = 1e9
# Tangent jump that makes a corner (rad). The rounding of published coordinates leaves 1e-6, a real corner has 1e-2.
CORNER_RAD = 1e-3
# Curvature jump that makes a junction (1/mm): the curvature of an arc of R 100 m.
CURVATURE_JUMP_PER_MM = 1e-5
# Largest gap between neighbouring segments (mm). The published sections of EN 15302 leave up to 8.2e-4.
JOINT_GAP_MM = 1e-3


# Straight lines come out of sums of large numbers with a curvature of rounding size.
_STRAIGHT_PER_MM = 1e-9


def radius_mm(curvature_per_mm: float) -> float | None:
    """Radius of a curvature, with its sign; None of a straight line."""
    return 1.0 / curvature_per_mm if abs(curvature_per_mm) > _STRAIGHT_PER_MM else None


def radius_text(radius_mm: float | None, form: str = "{:.1f}") -> str:
    """A radius in words, None for a straight line."""
    return "straight" if radius_mm is None else form.format(radius_mm)


@dataclass(frozen=True, kw_only=True)
class Junction:
    """A point between two segments where slope or curvature changes (mm, rad, 1/mm; curvature positive if convex)."""

    y_mm: float
    z_mm: float
    angle_left_rad: float
    angle_right_rad: float
    curvature_left_per_mm: float
    curvature_right_per_mm: float

    @property
    def turn_rad(self) -> float:
        """How much the line turns there, to the left."""
        return math.remainder(self.angle_right_rad - self.angle_left_rad, math.tau)

    @property
    def is_corner(self) -> bool:
        """Whether the slope itself jumps."""
        return abs(self.turn_rad) > CORNER_RAD


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """A running surface as a chain of segments, ordered from the gauge side (small y) to the field side.

    Attributes
    ----------
    name
        What the user calls it.
    kind
        `rail` (material below the line) or `wheel` (material above it).
    segments
        The running surface in mm, from small y to large y.
    source, certainty
        Where the numbers come from, and how sure they are.
    outline
        Closed outline of the body, beginning with the running surface in its direction, or empty where only the running
        surface is known.
    notes
        What a reader assumed; shown to the user.
    measured
        How a line was smoothed from points; None where the line is exact, or taken as exact.
    points (n, 2)
        In mm, of which a line was made, exact or smoothed; None where it was not made of points.
    problems
        Points of a file that were left out on request, and those that are doubtful and were not.

    Raises
    ------
    InputError
        Neighbouring segments do not meet within 0.001 mm, or the running surface runs towards small y.
    """

    name: str
    kind: Kind
    segments: tuple[Segment, ...]
    source: str = ""
    certainty: str = ""
    outline: tuple[Segment, ...] = ()
    notes: tuple[str, ...] = ()
    measured: Measured | None = None
    points: Floats | None = None
    problems: tuple[Problem, ...] = ()

    def __post_init__(self) -> None:
        if not self.segments:
            raise InputError(f"{self.name}: the running surface has no segments; give at least one")
        for what, chain, closed in (("running surface", self.segments, False), ("outline", self.outline, True)):
            ends = [segment.evaluate(np.array([0.0, 1.0])) for segment in chain]
            for i, end in enumerate(ends if closed else ends[:-1]):
                j = (i + 1) % len(ends)
                gap = math.hypot(ends[j].y[0] - end.y[1], ends[j].z[0] - end.z[1])
                if not gap <= JOINT_GAP_MM:
                    raise InputError(
                        f"{self.name}: {what}: segment {i + 1} ends at ({end.y[1]:.6g}, {end.z[1]:.6g}) mm but "
                        f"segment {j + 1} starts at ({ends[j].y[0]:.6g}, {ends[j].z[0]:.6g}) mm; the gap of {gap:.3g} "
                        f"mm may be at most {JOINT_GAP_MM:g} mm; make the two points the same"
                    )
            if not closed and not ends[0].y[0] < ends[-1].y[1]:
                raise InputError(
                    f"{self.name}: the running surface goes from y = {ends[0].y[0]:.6g} to {ends[-1].y[1]:.6g} mm; "
                    "list its segments from small to large y"
                )

    def thinned(self, first: Literal[0, 1] = 0) -> Profile | None:
        """The line through every second of its points, None if it is not made of points: how much they decide.

        A wrong point is in the line from point 0 on or in that from point 1 on, but for the ends.
        """
        if self.points is None or self.measured is not None:
            return None
        halves = (one.thinned(first) if isinstance(one, Spline) else one for one in self.segments)
        return replace(self, segments=tuple(halves))

    @property
    def convex_sign(self) -> float:
        """Factor that makes the curvature of the line positive where the body is convex."""
        return -1.0 if self.kind == "rail" else 1.0

    def evaluate(self, u: ArrayLike, side: Side = "right") -> CurvePoints:
        """Points at the parameter u, in the shape of u; NaN outside [0, number of segments].

        `side` picks the segment where u is a whole number, that is at the end of one segment and the start of the next.
        """
        return self._pieces.evaluate(self._inside(u), side)

    def _inside(self, u: ArrayLike) -> Floats:
        """Parameters, NaN outside the running surface; they come out of sums, so allow for their rounding."""
        u, n = np.asarray(u, dtype=float), len(self.segments)
        return np.where((u >= -1e-12 * n) & (u <= n * (1.0 + 1e-12)), u, np.nan)

    @cached_property
    def _pieces(self) -> Pieces:
        return Pieces.of(self.segments)

    def locate(self, t: ArrayLike, *, angle_rad: float = 0.0, origin: tuple[float, float] = (0.0, 0.0)) -> Floats:
        """Parameter u of the points whose coordinate along a tilted axis is t (mm), in the shape of t.

        The axis starts at `origin` and points along (cos angle, sin angle). An observer who looks along its normal sees
        the line run forward on one or more stretches and fold back between them: the widest stretch is answered, and
        NaN elsewhere. In the gap that rounded data leave at a joint the answer is the joint.
        """
        stretch = _stretch_along(self, angle_rad)
        t = np.asarray(t, dtype=float) + (origin[0] * math.cos(angle_rad) + origin[1] * math.sin(angle_rad))
        return np.full(t.shape, np.nan) if stretch is None else stretch.inverted(t)

    @property
    def y_range_mm(self) -> tuple[float, float]:
        """Smallest and largest y of the running surface."""
        y = self._pieces.ends.y
        return float(y.min()), float(y.max())

    def height(self, y: ArrayLike) -> Floats:
        """Height z (mm) at y (mm), NaN outside the running surface."""
        return self.evaluate(self.locate(y)).z

    def slope(self, y: ArrayLike, side: Side = "right") -> Floats:
        """Slope dz/dy at y (mm), one-sided at a junction; huge and of either sign where the line is vertical."""
        points = self.evaluate(self.snap(self.locate(y)), side)
        with np.errstate(divide="ignore"):
            return np.asarray(points.dz / points.dy)

    def curvature(self, y: ArrayLike, side: Side = "right") -> Floats:
        """Curvature (1/mm) at y (mm), positive where the body is convex, one-sided at a junction."""
        return self.convex_sign * self.evaluate(self.snap(self.locate(y)), side).curvature_per_mm

    def snap(self, u: ArrayLike, tolerance_mm: float = 1e-6) -> Floats:
        """Round parameters that lie within a tolerance of a segment end to it, so that both sides can be asked for."""
        u = np.asarray(u, dtype=float)
        points = self.evaluate(u)
        nearest = np.round(u)
        return np.where(np.abs(u - nearest) * np.hypot(points.dy, points.dz) <= tolerance_mm, nearest, u)

    @cached_property
    def junctions(self) -> tuple[Junction, ...]:
        """Points where slope or curvature jumps, from small to large y."""
        ends, found = np.arange(1, len(self.segments), dtype=float), []
        left, right = self.evaluate(ends, "left"), self.evaluate(ends, "right")
        for i in range(ends.size):
            junction = Junction(
                y_mm=float(right.y[i]),
                z_mm=float(right.z[i]),
                angle_left_rad=float(left.angle_rad[i]),
                angle_right_rad=float(right.angle_rad[i]),
                curvature_left_per_mm=float(self.convex_sign * left.curvature_per_mm[i] + 0.0),
                curvature_right_per_mm=float(self.convex_sign * right.curvature_per_mm[i] + 0.0),
            )
            jump = abs(junction.curvature_right_per_mm - junction.curvature_left_per_mm)
            if junction.is_corner or jump > CURVATURE_JUMP_PER_MM:
                found.append(junction)
        return tuple(found)

    @property
    def length_mm(self) -> float:
        """Arc length of the running surface."""
        return float(self._pieces.arc.values[-1])

    def arc_length(self, u: ArrayLike) -> Floats:
        """Arc length (mm) from the gauge-side end to the parameter u."""
        return np.asarray(self._pieces.arc.function(self._inside(u))[..., 0])

    def spread(self, step_mm: float) -> Floats:
        """Parameters u along the line, this far apart: exactly on exact lines, to the step of a table on others."""
        s = np.linspace(0.0, self.length_mm, int(np.ceil(self.length_mm / step_mm)) + 1)
        return self.at_arc_length(s) if self.measured is None else np.interp(s, self._pieces.arc.values, self._pieces.u)

    def at_arc_length(self, s: ArrayLike) -> Floats:
        """Parameter u at the arc length s (mm), NaN beyond the ends."""
        return self._pieces.arc.inverted(np.asarray(s, dtype=float))


# cached: one pose of a rail is looked at along the same axes again and again
@lru_cache(maxsize=64)
def _stretch_along(profile: Profile, angle_rad: float) -> Increasing | None:
    return profile._pieces.along(angle_rad)


# --- Profiles that are made from a few lengths: arcs, straight lines, and standard heads of tangent arcs.

Point = tuple[float, float]


def arc_between(start: Point, end: Point, *, centre: Point, radius: float, what: str = "arc") -> Arc:
    """Shorter arc from `start` to `end` about `centre` (mm); the points only give its two angles.

    Raises
    ------
    InputError
        A point lies off the circle by more than 0.001 mm.
    """
    angles = []
    for point in (start, end):
        off = math.hypot(point[0] - centre[0], point[1] - centre[1]) - radius
        if not abs(off) <= JOINT_GAP_MM:
            raise InputError(
                f"{what}: the point {point} mm lies {off:.3g} mm off the circle of radius {radius:g} mm about {centre} "
                f"mm; allowed: {JOINT_GAP_MM:g} mm; correct the point, the centre or the radius"
            )
        angles.append(math.atan2(point[1] - centre[1], point[0] - centre[0]))
    turn = math.remainder(angles[1] - angles[0], math.tau)
    return Arc(centre=centre, radius=radius, angle_from=angles[0], angle_to=angles[0] + turn)


def tangent_head(
    radii: Sequence[float], half_widths: Sequence[float], *, side_one_in: float, side_to_z: float
) -> list[Segment]:
    """Segments of a mirror-symmetric rail head of tangent arcs and straight sides, from left to right.

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

    Raises
    ------
    InputError
        The arcs do not follow one another outwards and downwards.
    """
    # Each centre lies on the radius through the joint, which makes the joint exactly tangent. Angles from the y axis.
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
        raise InputError(f"head: side_to_z is {side_to_z:g} mm; allowed: below the last arc, {corner[1]:.4f} mm")
    foot = (corner[0] + (corner[1] - side_to_z) / side_one_in, side_to_z)
    right.append(Line(start=corner, end=foot))
    crown = Arc(centre=(0.0, -radii[0]), radius=radii[0], angle_from=math.pi - angles[1], angle_to=angles[1])
    return [*mirrored(right[1:]), crown, *right[1:]]


def mirrored(segments: Sequence[Segment]) -> list[Segment]:
    """Mirror image in y of a chain, in the order that goes on from its end on the axis."""
    image: list[Segment] = []
    for s in reversed(segments):
        if isinstance(s, Line):
            image.append(Line(start=(-s.end[0], s.end[1]), end=(-s.start[0], s.start[1])))
        elif isinstance(s, Arc):
            image.append(
                Arc(
                    centre=(-s.centre[0], s.centre[1]),
                    radius=s.radius,
                    angle_from=math.pi - s.angle_to,
                    angle_to=math.pi - s.angle_from,
                )
            )
        elif isinstance(s, Polynomial):
            flipped = tuple(c * (-1.0) ** k for k, c in enumerate(s.coefficients))
            image.append(Polynomial(coefficients=flipped, y_from=-s.y_to, y_to=-s.y_from))
        else:
            raise AssertionError("points are never mirrored")
    return image


def circular_rail_head(radius_mm: float, half_width_mm: float = 36.0) -> Profile:
    """Rail head of one arc with its crown at (0, 0), for comparisons with closed forms.

    The arc reaches to |y| = min(half_width_mm, 0.95 radius_mm).

    Raises
    ------
    InputError
        A length is not finite and positive.
    """
    check_positive("radius of the rail head", radius_mm, "mm", "for example circle:300")
    check_positive("half-width of the rail head", half_width_mm, "mm", "for example 36")
    reach = math.asin(min(half_width_mm / radius_mm, 0.95))
    arc = Arc(centre=(0.0, -radius_mm), radius=radius_mm, angle_from=math.pi / 2 + reach, angle_to=math.pi / 2 - reach)
    return Profile(name=f"circle:{radius_mm:g}", kind="rail", segments=(arc,), source="circular arc")


def two_arc_rail_head(crown_mm: float, gauge_mm: float, junction_mm: float, half_width_mm: float = 36.0) -> Profile:
    """Rail head of two tangent arcs with its crown at (0, 0): a curvature junction at a known distance from it.

    Parameters
    ----------
    crown_mm
        Radius on the field side of the junction.
    gauge_mm
        Radius on its gauge side.
    junction_mm
        Arc length from the crown to the junction, positive to the gauge side: the crown then lies on the first arc;
        negative: on the second; 0: at the junction itself.
    half_width_mm
        The arcs reach to this |y|, at most to 95 % of their radius from their centre.

    Raises
    ------
    InputError
        A length is not finite and positive, or the crown does not lie on the arcs.
    """
    for name, radius in (("field", crown_mm), ("gauge", gauge_mm)):
        check_positive(f"radius on the {name} side", radius, "mm", "for example arcs:300/80@2.5")
    radius = crown_mm if junction_mm >= 0.0 else gauge_mm
    if not abs(junction_mm) < min(radius, half_width_mm):
        raise InputError(
            f"junction at {junction_mm:g} mm from the crown; allowed: less than the arc of {radius:g} mm under it and"
            f" the half-width of {half_width_mm:g} mm"
        )
    angle = math.pi / 2 + junction_mm / radius
    normal = (math.cos(angle), math.sin(angle))
    # each centre lies on the common normal, which makes the junction exactly tangent
    joint = (radius * normal[0], radius * (normal[1] - 1.0))
    segments: list[Segment] = []
    for r, side in ((gauge_mm, -1.0), (crown_mm, 1.0)):
        centre = (joint[0] - r * normal[0], joint[1] - r * normal[1])
        reach = min(max((half_width_mm - side * centre[0]) / r, 0.0), 0.95)
        end = math.pi / 2 - side * math.asin(reach)
        first, last = (end, angle) if side < 0.0 else (angle, end)
        if not first > last:
            raise InputError(
                f"junction at {junction_mm:g} mm: the arc of {r:g} mm beside it is too steep there; give a smaller"
                " distance"
            )
        segments.append(Arc(centre=centre, radius=r, angle_from=first, angle_to=last))
    name = f"arcs:{crown_mm:g}/{gauge_mm:g}@{junction_mm:g}"
    return Profile(name=name, kind="rail", segments=tuple(segments), source="two tangent arcs")


def cylinder_wheel(y_from_mm: float = -70.0, y_to_mm: float = 65.0) -> Profile:
    """Wheel with a straight tread at z = 0 and no flange, for comparisons with closed forms.

    Raises
    ------
    InputError
        The tread does not run from small to large y.
    """
    tread = Line(start=(float(y_from_mm), 0.0), end=(float(y_to_mm), 0.0))
    return Profile(name="cylinder", kind="wheel", segments=(tread,), source="straight line")


# --- Whether a line has the size and the axes of a rail or of a wheel: y to the field side, z up, mm.

# The least is above what a head or a tread has in cm.
_SPAN_MM = {"rail": (10.0, 500.0), "wheel": (15.0, 500.0)}
_USUAL_SPAN_MM = {"rail": 72.0, "wheel": 135.0}
# A rail's head has no dip, and a wheel's rim no drop at its field side, of this depth.
_DIP_MM = 8.0
# What is so wide on top is a head; the back of a flange is not.
_HEAD_WIDTH_MM = 20.0


def check_size(y: Floats, z: Floats, *, kind: Kind, what: str, unit: str = "mm") -> None:
    """Check the size of a line (mm, shape (n,)); `unit` is the one that its file was read in.

    Raises
    ------
    InputError
        Implausible size; with the unit in which the line has the usual one.
    """
    span, (low, high) = float(max(np.ptp(y), np.ptp(z))), _SPAN_MM[kind]
    if low <= span <= high:
        return
    in_file, usual = max(span / MM[unit], 1e-300), _USUAL_SPAN_MM[kind]
    likely = min(MM, key=lambda one: abs(math.log(in_file * MM[one] / usual)))
    advice = f"the file looks like {likely}: {remedy(kind, 'units', likely)}"
    raise InputError(
        f"{what}: the line spans {span:.4g} mm; allowed: {low:g} to {high:g} mm; "
        + (advice if likely != unit else f"give the running surface of the {kind} alone, whole")
    )


def check_shape(
    y: Floats,
    z: Floats,
    *,
    kind: Kind,
    what: str,
    turned_columns: str = "1,-2",
    unit: str = "mm",
    turned_over: bool = False,
) -> None:
    """Check the size of a line (mm, shape (n,)) and the direction of its axes.

    `turned_columns` are the columns of its file with the sign of z turned, `unit` is the one that it was read in, and
    `turned_over` whether it was mirrored.

    Raises
    ------
    InputError
        Implausible size, z pointing down, or a wheel with its flange on the field side.
    """
    check_size(y, z, kind=kind, what=what, unit=unit)
    if kind == "rail":
        dip, at = _deepest_dip(z)
        sides = [(y[part], z[part]) for part in (slice(at), slice(at, None))]
        if dip > _DIP_MM and all(np.ptp(one[up > up.max() - _DIP_MM]) > _HEAD_WIDTH_MM for one, up in sides):
            raise InputError(
                f"{what}: there are two heads beside one another, with a groove of {dip:.1f} mm at y = {y[at]:.1f} mm:"
                " two rails, or a rail with its guard; cut the file there, and give the running rail alone"
            )
        # a head lies above the chord between its ends, canted, worn or half
        middle = np.abs(y - 0.5 * (y[0] + y[-1])) <= 0.1 * abs(y[-1] - y[0])
        above = float(np.median(z[middle])) - 0.5 * (z[0] + z[-1]) if middle.any() else 0.0
        if above < -0.1:
            raise InputError(
                f"{what}: the middle of the rail lies {-above:.2f} mm below the chord between its ends, but z points "
                "up and a rail head is highest in the middle; flip the sign of z, or "
                + remedy(kind, "columns", turned_columns)
            )
        if dip > _DIP_MM:
            raise InputError(
                f"{what}: the line dips by {dip:.1f} mm at y = {y[at]:.1f} mm, as the flange of a wheel does; a rail is"
                " wanted: give the file as the wheel (--wheel, or --kind wheel), or cut the line at the sides of the"
                " head"
            )
        return
    middle = z[(y > y[0] + 0.3 * (y[-1] - y[0])) & (y < y[0] + 0.7 * (y[-1] - y[0]))]
    if middle.size and float(np.median(middle)) - max(z[0], z[-1]) > _DIP_MM and _deepest_dip(z)[0] < 1.0:
        raise InputError(
            f"{what}: both ends of the line lie more than {_DIP_MM:g} mm below its middle, as on a rail;"
            " a wheel is wanted: give the file as the rail (--rail, or --kind rail)"
        )
    # the flange back and the rim face reach up far, so they do not count
    steep = np.abs(np.diff(z)) > 4.0 * np.abs(np.diff(y))
    gentle = np.flatnonzero(~steep)
    if not gentle.size:
        raise InputError(
            f"{what}: the whole line is steep; a wheel needs its tread, z up and y across; swap the columns"
        )
    y, z = y[gentle[0] : gentle[-1] + 2], z[gentle[0] : gentle[-1] + 2]
    tread = float(np.median(z))
    up, down = float(z.max()) - tread, tread - float(z.min())
    if up > 10.0 and up > down:
        raise InputError(
            f"{what}: the line rises to {up:.1f} mm above the tread at y = {y[z.argmax()]:.1f} mm and falls only "
            f"{down:.1f} mm below it, but z points up and a flange reaches down; flip the sign of z, or "
            + remedy(kind, "columns", turned_columns)
        )
    if down > 10.0 and y[z.argmin()] > 0.5 * (y.min() + y.max()):
        raise InputError(
            f"{what}: the flange lies at y = {y[z.argmin()]:.1f} mm, on the field side, but y is positive to the field "
            "side; flip the sign of y, or " + mirror_remedy(kind, mirrored=turned_over)
        )


def _deepest_dip(z: Floats) -> tuple[float, int]:
    """How far a line lies below higher points on both of its sides at most, and where."""
    depth = np.minimum(np.maximum.accumulate(z), np.maximum.accumulate(z[::-1])[::-1]) - z
    at = int(np.argmax(depth))
    return float(depth[at]), at
