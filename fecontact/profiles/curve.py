"""Plane profile lines made of exact segments: positions, slopes, curvatures, junctions.

A profile lives in its own axes: y lateral (positive to the field side), z up, in mm. A rail has its material below the
line, a wheel above it. A profile is one curve with the parameter u in [0, n]: segment k covers u in [k, k+1].
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.errors import InputError

if TYPE_CHECKING:
    from scipy.interpolate import BSpline, CubicSpline

    from fecontact.profiles.problems import Problem

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.intp]
Kind = Literal["rail", "wheel"]
Side = Literal["left", "right"]

# Tangent jump that makes a corner (rad). The rounding of published coordinates leaves 1e-6, a real corner has 1e-2.
CORNER_RAD = 1e-3
# Curvature jump that makes a junction (1/mm): the curvature of an arc of R 100 m.
CURVATURE_JUMP_PER_MM = 1e-5
# Largest gap between neighbouring segments (mm). The published sections of the S1002 leave 1.2e-4.
JOINT_GAP_MM = 1e-3
# Farthest coordinate (mm): doubles lie 1e-7 mm apart there, and products of a few coordinates are finite.
FARTHEST_MM = 1e9
# A coordinate this little beyond an end still counts as the end (mm).
_END_SLACK_MM = 1e-9
# Longest step of the table of a smoothed line: the least width is some points, and those are 0.1 mm apart and more.
_TABLE_STEP_MM = 0.25
# A cubic spline with not-a-knot ends needs as many points.
_FEWEST_KNOTS = 4
# Smallest sine between the line and the observer's direction that still counts as running forward.
_FORWARD_SINE = 1e-9
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True, kw_only=True, eq=False)
class CurvePoints:
    """Points of a curve with their first and second derivatives by the parameter u (mm)."""

    y: Floats
    z: Floats
    dy: Floats
    dz: Floats
    ddy: Floats
    ddz: Floats

    @property
    def angle_rad(self) -> Floats:
        """Angle of the tangent, atan2(dz, dy)."""
        return np.arctan2(self.dz, self.dy)

    @property
    def curvature_per_mm(self) -> Floats:
        """Signed curvature of the curve, positive when it turns to the left (upwards for growing y)."""
        return np.asarray((self.dy * self.ddz - self.dz * self.ddy) / np.hypot(self.dy, self.dz) ** 3)


@dataclass(frozen=True, kw_only=True)
class Line:
    """Straight segment from `start` to `end` (mm)."""

    start: tuple[float, float]
    end: tuple[float, float]

    def evaluate(self, v: Floats) -> CurvePoints:
        """Points at the local parameter v in [0, 1]."""
        dy, dz = self.end[0] - self.start[0], self.end[1] - self.start[1]
        zero = np.zeros_like(v)
        return CurvePoints(
            y=self.start[0] + dy * v, z=self.start[1] + dz * v, dy=zero + dy, dz=zero + dz, ddy=zero, ddz=zero
        )


@dataclass(frozen=True, kw_only=True)
class Arc:
    """Circular segment (mm, rad): from `angle_from` to `angle_to` about `centre`, the parameter is the angle."""

    centre: tuple[float, float]
    radius: float
    angle_from: float
    angle_to: float

    def evaluate(self, v: Floats) -> CurvePoints:
        """Points at the local parameter v in [0, 1]."""
        turn = self.angle_to - self.angle_from
        c, s = self.radius * np.cos(self.angle_from + turn * v), self.radius * np.sin(self.angle_from + turn * v)
        return CurvePoints(
            y=self.centre[0] + c,
            z=self.centre[1] + s,
            dy=-turn * s,
            dz=turn * c,
            ddy=-(turn**2) * c,
            ddz=-(turn**2) * s,
        )


@dataclass(frozen=True, kw_only=True)
class Polynomial:
    """Segment z = sum_k coefficients[k] y^k for y from `y_from` to `y_to` (mm)."""

    coefficients: tuple[float, ...]
    y_from: float
    y_to: float

    @cached_property
    def _centred(self) -> tuple[np.polynomial.Polynomial, np.polynomial.Polynomial, np.polynomial.Polynomial]:
        """The polynomial and its first and second derivatives."""
        # Published coefficients are powers about a far origin and cancel by six digits (S1002, section C), so they are
        # moved to the middle of the segment in exact arithmetic; the variable runs from -1 to 1.
        middle = (Fraction(self.y_from) + Fraction(self.y_to)) / 2
        half = (Fraction(self.y_to) - Fraction(self.y_from)) / 2
        powers = range(len(self.coefficients))
        moved = [
            half**k * sum(math.comb(n, k) * Fraction(self.coefficients[n]) * middle ** (n - k) for n in powers[k:])
            for k in powers
        ]
        centred = np.polynomial.Polynomial([float(value) for value in moved])
        return centred, centred.deriv(), centred.deriv(2)

    def evaluate(self, v: Floats) -> CurvePoints:
        """Points at the local parameter v in [0, 1]."""
        span = self.y_to - self.y_from
        x, (p, first, second) = 2.0 * v - 1.0, self._centred
        zero = np.zeros_like(v)
        return CurvePoints(
            y=self.y_from + span * v, z=p(x), dy=zero + span, dz=2.0 * first(x), ddy=zero, ddz=4.0 * second(x)
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Spline:
    """Cubic spline through points (n, 2) (mm) over their cumulative chord length, not-a-knot ends.

    The curvature of an interpolating spline carries the noise of its points (about 6 e / h^2 for independent errors e
    and a spacing h), so results on such a profile depend on how well the points were measured.
    """

    points: Floats

    def thinned(self) -> Spline:
        """The spline through every second point and both ends; the same one if that leaves fewer than four."""
        keep = np.arange(len(self.points)) % 2 == 0
        keep[-1] = True
        return Spline(points=self.points[keep]) if np.count_nonzero(keep) >= _FEWEST_KNOTS else self

    @cached_property
    def _spline(self) -> CubicSpline:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.knots, self.points)

    @cached_property
    def knots(self) -> Floats:
        """Local parameters of the points."""
        chord = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(self.points, axis=0).T))))
        return np.asarray(chord / chord[-1])

    def evaluate(self, v: Floats) -> CurvePoints:
        """Points at the local parameter v in [0, 1]."""
        p, d, dd = self._spline(v), self._spline(v, 1), self._spline(v, 2)
        return CurvePoints(y=p[..., 0], z=p[..., 1], dy=d[..., 0], dz=d[..., 1], ddy=dd[..., 0], ddz=dd[..., 1])


@dataclass(frozen=True, kw_only=True, eq=False)
class Smoothed:
    """A piece of a line that was smoothed from measured points: a part of an exact segment, moved by a smooth field.

    Attributes
    ----------
    field
        Displacement (y, z) in mm over the arc length s of the line that the points were held against; where there is no
        `base`, the position itself.
    s_from, s_to
        Its part of s (mm).
    base, v_from, v_to
        Exact segment below it and the part of its parameter.
    turn_rad, shift
        How the exact segment was turned about its origin, and then moved (mm), to lie on the points.
    """

    field: BSpline
    s_from: float
    s_to: float
    base: Line | Arc | Polynomial | None = None
    v_from: float = 0.0
    v_to: float = 1.0
    turn_rad: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def knots(self) -> Floats:
        """Local parameters that are close enough for a table of the line."""
        return np.linspace(0.0, 1.0, max(3, math.ceil((self.s_to - self.s_from) / _TABLE_STEP_MM)))

    @cached_property
    def _arc(self) -> CubicSpline:
        """Arc length s over the local parameter; a polynomial does not run at one speed."""
        from scipy.interpolate import CubicSpline

        if isinstance(self.base, Polynomial):
            return polynomial_arc(self.base, self.v_from, self.v_to, self.s_from)
        return CubicSpline([0.0, 0.5, 1.0], np.linspace(self.s_from, self.s_to, 3))

    def evaluate(self, v: Floats) -> CurvePoints:
        """Points at the local parameter v in [0, 1]."""
        s, rate, rate_of_rate = self._arc(v), self._arc(v, 1), self._arc(v, 2)
        p, first, second = self.field(s), self.field(s, 1), self.field(s, 2)
        d = first * rate[..., None]
        dd = second * rate[..., None] ** 2 + first * rate_of_rate[..., None]
        if self.base is None:
            return CurvePoints(y=p[..., 0], z=p[..., 1], dy=d[..., 0], dz=d[..., 1], ddy=dd[..., 0], ddz=dd[..., 1])
        part, c, n = self.v_to - self.v_from, math.cos(self.turn_rad), math.sin(self.turn_rad)
        b = self.base.evaluate(self.v_from + part * v)
        return CurvePoints(
            y=b.y * c - b.z * n + self.shift[0] + p[..., 0],
            z=b.y * n + b.z * c + self.shift[1] + p[..., 1],
            dy=part * (b.dy * c - b.dz * n) + d[..., 0],
            dz=part * (b.dy * n + b.dz * c) + d[..., 1],
            ddy=part**2 * (b.ddy * c - b.ddz * n) + dd[..., 0],
            ddz=part**2 * (b.ddy * n + b.ddz * c) + dd[..., 1],
        )


def polynomial_arc(base: Polynomial, v_from: float, v_to: float, s_from: float = 0.0) -> CubicSpline:
    """Arc length (mm) along a part of a polynomial segment, over a parameter from 0 to 1, beginning with `s_from`."""
    from scipy.interpolate import CubicSpline

    v = np.linspace(0.0, 1.0, 65)
    half, part = 0.5 * np.diff(v)[:, None], v_to - v_from
    points = base.evaluate(v_from + part * (v[:-1, None] + half * (1.0 + _GAUSS_NODES)))
    steps = (half * part * np.hypot(points.dy, points.dz)) @ _GAUSS_WEIGHTS
    return CubicSpline(v, s_from + np.concatenate(([0.0], np.cumsum(steps))))


Segment: TypeAlias = Line | Arc | Polynomial | Spline | Smoothed


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
    def is_corner(self) -> bool:
        """Whether the slope itself jumps."""
        return abs(math.remainder(self.angle_right_rad - self.angle_left_rad, math.tau)) > CORNER_RAD


@dataclass(frozen=True, kw_only=True, eq=False)
class _Table:
    """Samples of a chain of segments, both ends of every segment included (so each joint is there twice)."""

    segment: Integers
    v: Floats
    points: CurvePoints

    @property
    def chords(self) -> Floats:
        return np.hypot(np.diff(self.points.y), np.diff(self.points.z))

    @cached_property
    def joints(self) -> NDArray[np.bool_]:
        """Whether the interval after each sample only steps from one segment to the next."""
        return np.diff(self.segment) > 0


@dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """The points behind a smoothed line, and how it was made from them.

    Attributes
    ----------
    points (n, 2)
        In mm, without those that were left out.
    s_mm, residual_mm (n,)
        Arc length of each point along the line that it was held against, and how far it lies to the left of the
        smoothed line.
    noise_mm
        Standard deviation of the points across the line.
    width_mm
        Wave length of which the smoothing leaves half, where the line is flat.
    relative_width (n,)
        Width at each point over that, where it follows the curvature.
    nominal, turn_rad, shift
        Name of the profile from which the deviation was smoothed, if any; how that was turned and moved to lie on
        the points.
    curvature_noise_per_mm (n,)
        Standard deviation of the line's curvature from the noise of the points.
    reference
        Segments of the nominal profile.
    """

    points: Floats
    s_mm: Floats
    residual_mm: Floats
    noise_mm: float
    width_mm: float
    curvature_noise_per_mm: Floats
    nominal: str = ""
    turn_rad: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)
    reference: tuple[Segment, ...] = ()
    relative_width: Floats | None = None


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
        The points behind a smoothed line; None where the line is exact, or taken as exact.
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

    def thinned(self) -> Profile | None:
        """The line through every second of its points, None if it is not made of points: how much they decide."""
        if not any(isinstance(segment, Spline) for segment in self.segments):
            return None
        segments = tuple(segment.thinned() if isinstance(segment, Spline) else segment for segment in self.segments)
        return replace(self, segments=segments)

    @property
    def convex_sign(self) -> float:
        """Factor that makes the curvature of the line positive where the body is convex."""
        return -1.0 if self.kind == "rail" else 1.0

    def evaluate(self, u: ArrayLike, side: Side = "right") -> CurvePoints:
        """Points at the parameter u, in the shape of u; NaN outside [0, number of segments].

        `side` picks the segment where u is a whole number, that is at the end of one segment and the start of the next.
        """
        return self._points(*self._split(np.asarray(u, dtype=float), side))

    def _split(self, u: Floats, side: Side = "right") -> tuple[Integers, Floats]:
        """Segment and local parameter of u; the local parameter is NaN outside the running surface."""
        n = len(self.segments)
        # parameters come out of sums of a segment number and a fraction, so allow for their rounding
        inside = (u >= -1e-12 * n) & (u <= n * (1.0 + 1e-12))
        u = np.where(inside, np.clip(u, 0.0, n), np.nan)
        index = np.floor(u) if side == "right" else np.ceil(u) - 1.0
        k = np.clip(np.nan_to_num(index), 0, n - 1).astype(np.intp)
        return k, u - k

    def _points(self, k: Integers, v: Floats) -> CurvePoints:
        """Points at the local parameters v of the segments k."""
        out = np.empty((6, *v.shape))
        for i in np.flatnonzero(np.bincount(k.ravel(), minlength=len(self.segments))):
            mask = k == i
            p = self.segments[i].evaluate(v[mask])
            out[:, mask] = p.y, p.z, p.dy, p.dz, p.ddy, p.ddz
        return CurvePoints(y=out[0], z=out[1], dy=out[2], dz=out[3], ddy=out[4], ddz=out[5])

    @cached_property
    def _table(self) -> _Table:
        samples = [
            np.interp(np.arange(4 * s.knots.size - 3) / 4.0, np.arange(s.knots.size), s.knots)
            if isinstance(s, Spline)
            else s.knots
            if isinstance(s, Smoothed)
            else np.linspace(0.0, 1.0, 65)
            for s in self.segments
        ]
        segment = np.repeat(np.arange(len(samples)), [v.size for v in samples])
        v = np.concatenate(samples)
        return _Table(segment=segment, v=v, points=self._points(segment, v))

    def locate(self, t: ArrayLike, *, angle_rad: float = 0.0, origin: tuple[float, float] = (0.0, 0.0)) -> Floats:
        """Parameter u of the points whose coordinate along a tilted axis is t (mm), in the shape of t.

        The axis starts at `origin` and points along (cos angle, sin angle). An observer who looks along its normal sees
        the line run forward on one or more stretches and fold back between them: the widest stretch is answered, and
        NaN elsewhere. In the gap that rounded data leave at a joint the answer is the joint.
        """
        c, s = math.cos(angle_rad), math.sin(angle_rad)

        def along(points: CurvePoints) -> Floats:
            return (points.y - origin[0]) * c + (points.z - origin[1]) * s

        def along_and_rate(k: Integers, v: Floats) -> tuple[Floats, Floats]:
            points = self._points(k, v)
            return along(points), points.dy * c + points.dz * s

        table = self._table
        values = along(table.points)
        forward = (np.diff(values) > _FORWARD_SINE * table.chords) | table.joints
        turns = np.flatnonzero(np.diff(forward, prepend=False, append=False))
        starts, stops = turns[::2], turns[1::2]
        if not starts.size:
            return np.full(np.shape(t), np.nan)
        widest = int(np.argmax(values[stops] - values[starts]))
        return self._invert(t, values, slice(int(starts[widest]), int(stops[widest]) + 1), along_and_rate)

    def _invert(
        self, t: ArrayLike, values: Floats, part: slice, function: Callable[[Integers, Floats], tuple[Floats, Floats]]
    ) -> Floats:
        """Parameter u where an increasing function is t, NaN beyond its ends, by bracketed Newton steps.

        `values` are those of the function on the table, and only the table's `part` is searched. `function` returns the
        value and its derivative by v at the local parameters v of the segments k.
        """
        t = np.asarray(t, dtype=float)
        table_k, table_v, values = self._table.segment[part], self._table.v[part], values[part]
        inside = (t >= values[0] - _END_SLACK_MM) & (t <= values[-1] + _END_SLACK_MM)
        target = np.clip(t[inside], values[0], values[-1])

        # rounded data may step back by a hair at a joint
        j = np.searchsorted(np.maximum.accumulate(values), target, side="right") - 1
        j = np.clip(j, 0, values.size - 2)
        k, high = table_k[j + 1], table_v[j + 1]
        low = np.where(k == table_k[j], table_v[j], high)
        rise = values[j + 1] - values[j]
        v = low + (high - low) * np.clip((target - values[j]) / np.where(rise > 0.0, rise, 1.0), 0.0, 1.0)

        active = np.flatnonzero(high > low)
        for _ in range(60):
            if not active.size:
                break
            v_old = v[active]
            value, rate = function(k[active], v_old)
            residual = target[active] - value
            low[active] = np.where(residual >= 0.0, v_old, low[active])
            high[active] = np.where(residual <= 0.0, v_old, high[active])
            with np.errstate(divide="ignore", invalid="ignore"):
                v_new = v_old + residual / rate
            trapped = (v_new >= low[active]) & (v_new <= high[active])
            v_new = np.where(trapped, v_new, 0.5 * (low[active] + high[active]))
            v[active] = v_new
            # Newton steps converge quadratically: after one of this size the next would be lost in rounding
            active = active[np.abs(v_new - v_old) > 1e-11]
        u = np.full(t.shape, np.nan)
        u[inside] = k + v
        return u

    @property
    def y_range_mm(self) -> tuple[float, float]:
        """Smallest and largest y of the running surface."""
        y = self._table.points.y
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
        ends = np.arange(1, len(self.segments), dtype=float)
        left, right = self.evaluate(ends, "left"), self.evaluate(ends, "right")
        found = []
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

    def _gauss_length(self, k: Integers, v_from: Floats, v_to: Floats) -> Floats:
        """Arc length of the short pieces [v_from, v_to] of the segments k."""
        half = 0.5 * (v_to - v_from)[..., None]
        nodes = 0.5 * (v_to + v_from)[..., None] + half * _GAUSS_NODES
        points = self._points(np.broadcast_to(k[..., None], nodes.shape), nodes)
        return np.asarray((half * np.hypot(points.dy, points.dz)) @ _GAUSS_WEIGHTS)

    @cached_property
    def _table_lengths(self) -> Floats:
        table = self._table
        pieces = self._gauss_length(table.segment[1:], np.where(table.joints, 0.0, table.v[:-1]), table.v[1:])
        return np.concatenate(([0.0], np.cumsum(pieces)))

    @property
    def length_mm(self) -> float:
        """Arc length of the running surface."""
        return float(self._table_lengths[-1])

    def arc_length(self, u: ArrayLike) -> Floats:
        """Arc length (mm) from the gauge-side end to the parameter u."""
        return self._arc_length(*self._split(np.asarray(u, dtype=float)))

    def _arc_length(self, k: Integers, v: Floats) -> Floats:
        table = self._table
        first = np.searchsorted(table.segment, k)
        last = np.searchsorted(table.segment, k, side="right") - 1
        i = np.clip(np.searchsorted(table.segment + table.v, k + v, side="right") - 1, first, last - 1)
        return np.asarray(self._table_lengths[i] + self._gauss_length(k, table.v[i], v))

    def spread(self, step_mm: float) -> Floats:
        """Parameters u along the line, this far apart: exactly on exact lines, to the step of a table on others."""
        s = np.linspace(0.0, self.length_mm, int(np.ceil(self.length_mm / step_mm)) + 1)
        if self.measured is None:
            return self.at_arc_length(s)
        return np.interp(s, self._table_lengths, self._table.segment + self._table.v)

    def at_arc_length(self, s: ArrayLike) -> Floats:
        """Parameter u at the arc length s (mm), NaN beyond the ends."""

        def length_and_speed(k: Integers, v: Floats) -> tuple[Floats, Floats]:
            points = self._points(k, v)
            return self._arc_length(k, v), np.hypot(points.dy, points.dz)

        return self._invert(s, self._table_lengths, slice(None), length_and_speed)
