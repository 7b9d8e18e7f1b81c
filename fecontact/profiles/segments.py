"""The pieces of a profile line: exact ones, splines through points, and smoothed ones.

A segment is evaluated at the local parameter v from 0 to 1: position and both derivatives, in mm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline, PPoly

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.intp]

# Longest step of the table of a smoothed line: the least width is some points, and those are 0.1 mm apart and more.
_TABLE_STEP_MM = 0.25
# A cubic spline with not-a-knot ends needs as many points.
_FEWEST_KNOTS = 4
GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(5)
"""Of the arc length of short pieces."""


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
        p, d, dd = self._spline(v), self._spline(v, 1), self._spline(v, 2)
        return CurvePoints(y=p[..., 0], z=p[..., 1], dy=d[..., 0], dz=d[..., 1], ddy=dd[..., 0], ddz=dd[..., 1])


@dataclass(frozen=True, kw_only=True)
class Registration:
    """How a reference line is turned about its origin (rad), and then moved (mm), to lie on points."""

    turn_rad: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)

    @property
    def cosine_and_sine(self) -> tuple[float, float]:
        """Of the turn."""
        return math.cos(self.turn_rad), math.sin(self.turn_rad)

    def turned(self, vectors: Floats) -> Floats:
        """Directions (n, 2) of the reference, as they lie on the points."""
        c, s = self.cosine_and_sine
        return np.column_stack((vectors[:, 0] * c - vectors[:, 1] * s, vectors[:, 0] * s + vectors[:, 1] * c))

    def from_reference(self, points: Floats) -> Floats:
        """Points (n, 2) of the reference, as they lie on the points."""
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
        """Local parameters that are close enough for a table of the line."""
        return np.linspace(0.0, 1.0, max(3, math.ceil((self.s_to - self.s_from) / _TABLE_STEP_MM)))

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
            return CurvePoints(y=p[..., 0], z=p[..., 1], dy=d[..., 0], dz=d[..., 1], ddy=dd[..., 0], ddz=dd[..., 1])
        part, (c, n) = self.v_to - self.v_from, self.registration.cosine_and_sine
        b = self.base.evaluate(self.v_from + part * v)
        return CurvePoints(
            y=b.y * c - b.z * n + self.registration.shift[0] + p[..., 0],
            z=b.y * n + b.z * c + self.registration.shift[1] + p[..., 1],
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
    points = base.evaluate(v_from + part * (v[:-1, None] + half * (1.0 + GAUSS_NODES)))
    steps = (half * part * np.hypot(points.dy, points.dz)) @ GAUSS_WEIGHTS
    return CubicSpline(v, s_from + np.concatenate(([0.0], np.cumsum(steps))))


Segment: TypeAlias = Line | Arc | Polynomial | Spline | Smoothed
