"""The pieces of a profile line, exact or through points, and the points that a line is made from.

A segment is evaluated at the local parameter v from 0 to 1: position and both derivatives, in mm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from fecontact.arrays import Floats, Integers

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline, PPoly


# Longest step of the table of a smoothed line: the least width is some points, and those are 0.1 mm apart and more.
_TABLE_STEP_MM = 0.25
# A cubic spline with not-a-knot ends needs as many points.
_FEWEST_KNOTS = 4
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True, eq=False)
class CurvePoints:
    """Points of a curve with their first and second derivatives by the parameter u (mm)."""

    y: Floats
    z: Floats
    dy: Floats
    dz: Floats
    ddy: Floats
    ddz: Floats

    @classmethod
    def of(cls, place: Floats, first: Floats, second: Floats) -> CurvePoints:
        """Of positions and derivatives (..., 2)."""
        (y, z), (dy, dz), (ddy, ddz) = (np.moveaxis(both, -1, 0) for both in (place, first, second))
        return cls(y=y, z=z, dy=dy, dz=dz, ddy=ddy, ddz=ddz)

    def taken(self, which: Integers | slice) -> CurvePoints:
        """Some of the points."""
        return CurvePoints(**{name: values[which] for name, values in vars(self).items()})

    @property
    def angle_rad(self) -> Floats:
        """Angle of the tangent, atan2(dz, dy)."""
        return np.arctan2(self.dz, self.dy)

    @property
    def curvature_per_mm(self) -> Floats:
        """Signed curvature of the curve, positive when it turns to the left (upwards for growing y)."""
        speed2 = self.dy * self.dy + self.dz * self.dz
        return np.asarray((self.dy * self.ddz - self.dz * self.ddy) / (speed2 * np.sqrt(speed2)))


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

    def thinned(self, first: Literal[0, 1] = 0) -> Spline:
        """The spline through every second point, from this one on, and both ends; itself if those are too few."""
        keep = np.arange(len(self.points)) % 2 == first
        keep[[0, -1]] = True
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
        return CurvePoints.of(self._spline(v), self._spline(v, 1), self._spline(v, 2))


@dataclass(frozen=True, kw_only=True)
class Registration:
    """How a reference line is turned about its origin (rad), and then moved (mm), to lie on points."""

    turn_rad: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)

    def turned(self, vectors: Floats) -> Floats:
        """Directions (..., 2) of the reference, as they lie on the points."""
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        y, z = vectors[..., 0], vectors[..., 1]
        return np.stack((y * c - z * s, y * s + z * c), axis=-1)

    def from_reference(self, points: Floats) -> Floats:
        """Points (..., 2) of the reference, as they lie on the points."""
        return np.asarray(self.turned(points) + np.array(self.shift))

    def to_reference(self, points: Floats) -> Floats:
        """The way back."""
        return Registration(turn_rad=-self.turn_rad).turned(points - np.array(self.shift))


IN_PLACE = Registration()
"""Neither turned nor moved."""


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
    registration
        How the exact segment was turned and moved to lie on the points.
    """

    field: PPoly
    s_from: float
    s_to: float
    base: Line | Arc | Polynomial | None = None
    v_from: float = 0.0
    v_to: float = 1.0
    registration: Registration = IN_PLACE

    @cached_property
    def knots(self) -> Floats:
        """Local parameters between which the line is as good as a polynomial, close enough for a table of it."""
        even = np.linspace(0.0, 1.0, max(3, math.ceil((self.s_to - self.s_from) / _TABLE_STEP_MM)))
        fields = self.field.x[(self.field.x > self.s_from) & (self.field.x < self.s_to)]
        v = np.sort(np.concatenate((even, self.local(fields), self._arc.x[1:-1])))
        inner = v[1:-1][np.diff(v)[:-1] > _SAME_PARAMETER]
        return np.concatenate(([0.0], inner[inner < 1.0 - _SAME_PARAMETER], [1.0]))

    def local(self, s: Floats) -> Floats:
        """Local parameters of places s (mm) on its part, by Newton's steps."""
        v = np.interp(s, (self.s_from, self.s_to), (0.0, 1.0))
        for _ in range(20 if isinstance(self.base, Polynomial) else 1):
            before, v = v, np.clip(v - (self._arc(v) - s) / self._arc(v, 1), 0.0, 1.0)
            if np.array_equal(before, v):
                break
        return v

    @cached_property
    def _arc(self) -> PPoly:
        """Arc length s over the local parameter; a polynomial does not run at one speed."""
        from scipy.interpolate import PPoly

        if isinstance(self.base, Polynomial):
            return polynomial_arc(self.base, self.v_from, self.v_to, self.s_from)
        return PPoly([[self.s_to - self.s_from], [self.s_from]], [0.0, 1.0])

    def evaluate(self, v: Floats) -> CurvePoints:
        """Points at the local parameter v in [0, 1]."""
        s, rate = self._arc(v), self._arc(v, 1)[..., None]
        p, first, second = self.field(s), self.field(s, 1), self.field(s, 2)
        d, dd = first * rate, second * rate**2
        if isinstance(self.base, Polynomial):
            dd = dd + first * self._arc(v, 2)[..., None]
        if self.base is None:
            return CurvePoints.of(p, d, dd)
        part, lies = self.v_to - self.v_from, self.registration
        b = self.base.evaluate(self.v_from + part * v)
        return CurvePoints.of(
            lies.from_reference(np.stack((b.y, b.z), axis=-1)) + p,
            part * lies.turned(np.stack((b.dy, b.dz), axis=-1)) + d,
            part**2 * lies.turned(np.stack((b.ddy, b.ddz), axis=-1)) + dd,
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


def moved_by(segment: Segment, dy_mm: float, dz_mm: float) -> Segment:
    """A line, arc or polynomial moved across and upwards (mm)."""
    if isinstance(segment, Polynomial):
        shifted = np.polynomial.Polynomial(segment.coefficients)(np.polynomial.Polynomial([-dy_mm, 1.0])).coef
        constant, *rest = map(float, shifted if dy_mm else segment.coefficients)
        ends = {"y_from": segment.y_from + dy_mm, "y_to": segment.y_to + dy_mm}
        return replace(segment, coefficients=(constant + dz_mm, *rest), **ends)
    if isinstance(segment, Arc):
        return replace(segment, centre=(segment.centre[0] + dy_mm, segment.centre[1] + dz_mm))
    assert isinstance(segment, Line)
    (y0, z0), (y1, z1) = segment.start, segment.end
    return Line(start=(y0 + dy_mm, z0 + dz_mm), end=(y1 + dy_mm, z1 + dz_mm))


# Local parameters closer than this are one.
_SAME_PARAMETER = 1e-9


# --- The points behind a smoothed line.


@dataclass(frozen=True, kw_only=True, eq=False)
class Held:
    """Points held against a line, which may be their own.

    Attributes
    ----------
    points (n, 2)
        In mm, without those that were left out.
    s_mm (n,)
        Arc length of each point along the line that it is held against.
    values (n, 2)
        What is smoothed: how far the points lie off their nominal profile, or the points themselves.
    normals (n, 2)
        Of the line, to its left.
    relative_filter (n,)
        Filter length at each point over the whole one, where it follows the curvature.
    nominal, registration, reference
        Name of the profile that the points are held against, if any; how that was turned and moved to lie on the
        points; its segments.
    """

    points: Floats
    s_mm: Floats
    values: Floats
    normals: Floats
    relative_filter: Floats | None = None
    nominal: str = ""
    registration: Registration = IN_PLACE
    reference: tuple[Segment, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """The points behind a smoothed line, and how it was made from them.

    Attributes
    ----------
    held
        The points and what they were held against.
    residual_mm (n,)
        How far each point lies to the left of the smoothed line.
    noise_mm
        Standard deviation of the points across the line, which is no part of the line.
    white_mm, waves_mm (n,)
        What of that each point has by itself, and what is alike in neighbours: an instrument's waves, or the line's
        own, shorter than its filter.
    filter_mm
        Wave length of which the smoothing leaves half, where the line is flat if that follows the curvature.
    curvature_noise_per_mm (n,)
        Standard deviation of the line's curvature from the noise of the points.
    """

    held: Held
    residual_mm: Floats
    noise_mm: float
    white_mm: float
    waves_mm: Floats
    filter_mm: float
    curvature_noise_per_mm: Floats

    @property
    def points(self) -> Floats:
        """The points (n, 2) in mm."""
        return self.held.points

    @property
    def s_mm(self) -> Floats:
        """Arc length (n,) of each point along the line that it was held against."""
        return self.held.s_mm

    @property
    def nominal(self) -> str:
        """Name of the profile from which the deviation was smoothed; empty where there is none."""
        return self.held.nominal
