"""The pieces of a profile line, exact or through points, and the points that a line is made from.

A segment is evaluated at the local parameter v from 0 to 1: position and both derivatives, in mm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.polynomial.polynomial import polyval

from fecontact.arrays import Floats, Integers

if TYPE_CHECKING:
    # scipy is for those that look at a line: results are compared without it
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


# --- A chain of segments as polynomials of short pieces, which are evaluated and inverted for all points at once.

# A coordinate this little beyond an end still counts as the end (mm).
_END_SLACK_MM = 1e-9
# Local parameters closer than this are one.
_SAME_PARAMETER = 1e-9
# Newton steps converge quadratically: after one of this size the next would be lost in rounding.
_LAST_NEWTON = 1e-11
# Smallest sine between the line and the observer's direction that still counts as running forward.
_FORWARD_SINE = 1e-9
# Slowest increase by which a Newton step is taken; where a line turns back it is none.
_LEAST_RATE = 1e-30
# Second derivatives and speeds are laid through so many places of a piece. On an arc of a radian each of its pieces is
# 0.016 rad long, and the curvature good to 1e-15.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
_TO_POWERS = np.linalg.inv(np.vander(_NODES, increasing=True))
# From powers about the middle of a piece to powers about its beginning, in half lengths.
_TO_BEGINNING = np.array([[math.comb(k, j) * (-1.0) ** (k - j) if k >= j else 0.0 for k in range(6)] for j in range(6)])


def sampled(segment: Segment) -> Floats:
    """Local parameters from 0 to 1 between which a segment is a polynomial, or as good as one."""
    if isinstance(segment, Spline):
        return np.interp(np.arange(4 * segment.knots.size - 3) / 4.0, np.arange(segment.knots.size), segment.knots)
    return segment.knots if isinstance(segment, Smoothed) else np.linspace(0.0, 1.0, 65)


@dataclass(frozen=True, kw_only=True, eq=False)
class Increasing:
    """A function of the parameter that increases along some pieces of a chain.

    Attributes
    ----------
    function
        Its value and its rate.
    u (k,)
        Parameters of the ends of these pieces.
    values (k,)
        The function there.
    """

    function: PPoly
    u: Floats
    values: Floats

    def inverted(self, t: Floats) -> Floats:
        """Parameters where the function is t, in the shape of t; NaN beyond its ends.

        By Newton steps that are kept within a piece.
        """
        first, last = self.values[0], self.values[-1]
        # np.clip takes as long as five of these, and this is called a hundred times for a placement
        target = np.minimum(np.maximum(t, first), last)
        piece = np.minimum(self.values.searchsorted(target, side="right"), self.values.size - 1)
        low, high = self.u[piece - 1], self.u[piece]
        u = np.interp(target, self.values, self.u)
        for _ in range(60):
            at = self.function(u)
            step = (target - at[..., 0]) / np.maximum(at[..., 1], _LEAST_RATE)
            before, u = u, np.minimum(np.maximum(u + step, low), high)
            if not (np.abs(u - before) > _LAST_NEWTON).any():
                break
        return np.where((t >= first - _END_SLACK_MM) & (t <= last + _END_SLACK_MM), u, np.nan)


@dataclass(frozen=True, kw_only=True, eq=False)
class Pieces:
    """A chain of segments in short pieces; where two segments meet, a piece of no length leads from one to the other.

    Attributes
    ----------
    u (m + 1,)
        Parameters of their ends: number of the segment plus its local parameter.
    ends
        Points (m + 1,) there; both of them where two segments meet.
    curve
        y, z in mm, and their first and second derivatives, over the parameter.
    arc
        The arc length in mm.
    """

    u: Floats
    ends: CurvePoints
    curve: PPoly
    arc: Increasing

    @classmethod
    def of(cls, segments: Sequence[Segment]) -> Pieces:
        """The pieces of a chain."""
        v = [sampled(segment) for segment in segments]
        u = np.concatenate([k + one for k, one in enumerate(v)])
        points = [segment.evaluate(one) for segment, one in zip(segments, v, strict=True)]
        ends = CurvePoints(**{name: np.concatenate([getattr(one, name) for one in points]) for name in vars(points[0])})
        begin = ends.taken(slice(-1))
        bent = np.concatenate([_bent(segment, one) for segment, one in zip(segments, v, strict=True)], axis=2)[..., :-1]
        first = _integrated(bent[:, :2], np.stack((begin.dy, begin.dz)))
        place = _integrated(first, np.stack((begin.y, begin.z)))
        speed = bent[:, 2:]
        steps = polyval(np.diff(u), _integrated(speed, np.zeros((1, u.size - 1)))[:, 0], tensor=False)
        lengths = np.append(0.0, np.cumsum(steps))
        arc = _function(u, _integrated(speed, lengths[None, :-1]), speed)
        return cls(
            u=u,
            ends=ends,
            curve=_function(u, place, first, bent[:, :2]),
            arc=Increasing(function=arc, u=u, values=lengths),
        )

    def evaluate(self, u: Floats, side: Literal["left", "right"] = "right") -> CurvePoints:
        """Points at parameters u; where two segments meet, those of the segment on a side."""
        # at an end the function takes the piece that begins there
        at = self.curve(u if side == "right" else np.nextafter(u, -np.inf))
        return CurvePoints(*(at[..., k] for k in range(6)))

    def along(self, angle_rad: float) -> Increasing | None:
        """The coordinate along a tilted axis, on the stretch where it increases the farthest; None where nowhere."""
        from scipy.interpolate import PPoly

        c, s = math.cos(angle_rad), math.sin(angle_rad)
        values, chords = self.ends.y * c + self.ends.z * s, np.hypot(np.diff(self.ends.y), np.diff(self.ends.z))
        forward = (np.diff(values) > _FORWARD_SINE * chords) | (np.diff(self.u) == 0.0)
        turns = np.flatnonzero(np.diff(forward, prepend=False, append=False))
        starts, stops = turns[::2], turns[1::2]
        if not starts.size:
            return None
        widest = int(np.argmax(values[stops] - values[starts]))
        part = slice(int(starts[widest]), int(stops[widest]) + 1)
        # rounded data may step back by a hair at a joint
        return Increasing(
            function=PPoly(self.curve.c[..., :4:2] * c + self.curve.c[..., 1:4:2] * s, self.u),
            u=self.u[part],
            values=np.maximum.accumulate(values[part]),
        )


def _bent(segment: Segment, v: Floats) -> Floats:
    """Second derivatives of y and z, and speed, of a segment on the n - 1 pieces between local parameters (n,), and 0.

    By powers (6, 3, n) of the parameter from the beginning of each piece. Second derivatives have no digits to lose.
    """
    half, middle = 0.5 * np.diff(v), 0.5 * (v[1:] + v[:-1])
    at = segment.evaluate(middle[:, None] + half[:, None] * _NODES)
    scale = half ** -np.arange(6.0)[:, None]
    out = np.zeros((6, 3, v.size))
    for k, of in enumerate((at.ddy, at.ddz, np.hypot(at.dy, at.dz))):
        out[:, k, :-1] = _TO_BEGINNING @ (_TO_POWERS @ of.T) * scale
    return out


def _integrated(powers: Floats, begin: Floats) -> Floats:
    """Powers (k + 1, c, m) of the integral of functions with powers (k, c, m), which begins with values (c, m)."""
    return np.concatenate((begin[None], powers / np.arange(1.0, len(powers) + 1.0)[:, None, None]))


def _function(u: Floats, *columns: Floats) -> PPoly:
    """Functions with ascending powers (k, c, m) on the pieces between u, beside one another."""
    from scipy.interpolate import PPoly

    powers = np.zeros((max(map(len, columns)), u.size - 1, sum(one.shape[1] for one in columns)))
    at = 0
    for one in columns:
        # scipy has the highest power first
        powers[len(powers) - len(one) :, :, at : at + one.shape[1]] = one[::-1].swapaxes(1, 2)
        at += one.shape[1]
    return PPoly(powers, u)


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


# --- How noisy points are: what each misses the line through its neighbours by.

# So many points know their scatter to a third.
_FEWEST = 60


def noise_of(points: Floats) -> float:
    """Standard deviation of points (n, 2) across their line, from what four neighbours say of each, at most."""
    missed, weight = missed_by_neighbours(points)
    return float(scatter_of(points, missed / weight).max()) if missed.size else 0.0


def scatter_of(points: Floats, missed: Floats) -> Floats:
    """Standard deviation (n - 4,) across the line that the inner ones of points (n, 2) have by their misses (n - 4,).

    An instrument may be wrong in the height alone, or across alone: flat and steep points are looked at by themselves,
    and what is between them has of both.
    """
    along = points[4:] - points[:-4]
    steep = np.abs(along[:, 1]) > np.abs(along[:, 0])
    parts = (~steep, steep)
    if any(np.count_nonzero(part) < _FEWEST for part in parts):
        return np.full(missed.size, _deviation(missed))
    flat, side = (_deviation(missed[part]) for part in parts)
    scatter = np.hypot(flat * along[:, 0], side * along[:, 1])
    return np.asarray(scatter / np.maximum(np.hypot(*along.T), 1e-12))


def _deviation(missed: Floats) -> float:
    # the median keeps corners, junctions and spikes out; 0.6745 turns it into a standard deviation
    return float(np.median(np.abs(missed))) / 0.6745


def missed_by_neighbours(points: Floats, place: Literal[0, 2, 4] = 2) -> tuple[Floats, Floats]:
    """How far one of every five points lies across the cubic through the others, and its error over theirs.

    Parameters
    ----------
    points (n, 2)
        In mm, in the order along the line.
    place
        The middle one, the first or the last of the five: the line is then continued from one side.

    Returns
    -------
    missed, weight (n - 4,)
        Positive to the left (mm); standard deviation of it where each point has one of 1.
    """
    if len(points) < 5:
        return np.zeros(0), np.ones(0)
    five = [points[k : len(points) - 4 + k] for k in range(5)]
    chords = [np.hypot(*(q - p).T) for p, q in pairwise(five)]
    s = np.cumsum([np.zeros(len(five[0])), *chords], axis=0)
    at, known = s[place], [k for k in range(5) if k != place]

    def apart(k: int, m: int) -> Floats:
        # two points at one place have no distance
        return np.where(np.abs(s[k] - s[m]) < 1e-12, 1e-12, s[k] - s[m])

    weights = [np.prod([(at - s[m]) / apart(k, m) for m in known if m != k], axis=0) for k in known]
    guess = sum(w[:, None] * five[k] for w, k in zip(weights, known, strict=True))
    along = five[min(place + 1, 4)] - five[max(place - 1, 0)]
    along = along / np.maximum(np.hypot(*along.T), 1e-12)[:, None]
    off = five[place] - guess
    return off[:, 1] * along[:, 0] - off[:, 0] * along[:, 1], np.sqrt(1.0 + sum(w**2 for w in weights))


# --- The cubic smoothing spline of a stated width.
#
# Reinsch (1967), smoothing by spline functions; in the form of Green and Silverman (1994), nonparametric regression and
# generalized linear models, section 2.3. scipy's `make_smoothing_spline` is the same spline in another basis: it takes
# 15 times as long, and its equations lose so many digits that over waves of 500 mm it lies 0.0002 mm off.

# How much a displacement along the line counts beside one across it: so little that it is free.
_ALONG = 1e-5


def smoothed_by(s_mm: Floats, values: Floats, filter_mm: float, relative: Floats | None = None) -> PPoly:
    """Cubic smoothing spline that leaves half of a wave of this length, however far apart the points are.

    It makes the sum of the squared distances from the points, each times the spacing there, plus (filter / 2 pi)^4
    times the integral of its squared second derivative the least.

    Parameters
    ----------
    s_mm (n,), values (n, k)
        Places along the line, ascending, and what is smoothed there.
    relative (n,)
        Filter length at each place over `filter_mm`; constant if not given.
    """
    from scipy.interpolate import PPoly
    from scipy.linalg import solveh_banded

    h = np.diff(s_mm)
    length = filter_mm if relative is None else filter_mm * relative
    # a spline is stiffer or softer with the fourth root of the penalty at a point
    penalty = (length / (2.0 * math.pi)) ** 4 / (0.5 * (np.append(h, 0.0) + np.insert(h, 0, 0.0)))
    # second differences: row j is of the points j, j + 1, j + 2
    second = np.array([1.0 / h[:-1], -1.0 / h[:-1] - 1.0 / h[1:], 1.0 / h[1:]])
    rows = s_mm.size - 2
    lower = np.zeros((3, rows))
    lower[0], lower[1, :-1] = (h[:-1] + h[1:]) / 3.0, h[1:-1] / 6.0
    for k in range(3):
        for i in range(3 - k):
            lower[k, : rows - k] += second[i + k, : rows - k] * second[i, k:] * penalty[i + k : i + rows]
    bent = np.zeros_like(values)
    bent[1:-1] = solveh_banded(lower, np.diff(np.diff(values, axis=0) / h[:, None], axis=0), lower=True)

    # from values and second derivatives at the points to the four coefficients of each piece
    jumps = np.diff(np.pad(np.diff(bent, axis=0) / h[:, None], ((1, 1), (0, 0))), axis=0)
    fitted, h = values - penalty[:, None] * jumps, h[:, None]
    slope = np.diff(fitted, axis=0) / h - h * (2.0 * bent[:-1] + bent[1:]) / 6.0
    return PPoly(np.array([np.diff(bent, axis=0) / (6.0 * h), bent[:-1] / 2.0, slope, fitted[:-1]]), s_mm)


def least_bending(s_mm: Floats, values: Floats, normals: Floats, width_mm: float) -> Floats:
    """Displacements (n, 2) as `smoothed_by` has them, where only what is across the line counts, to a small part.

    Second differences in place of the spline: enough to say where points belong, and one banded solution.
    """
    from scipy.linalg import solveh_banded

    n, h = s_mm.size, np.diff(s_mm)
    penalty = (width_mm / (2.0 * math.pi)) ** 4 * (n - 1) / (s_mm[-1] - s_mm[0])
    between = 0.5 * (h[:-1] + h[1:])
    second = np.array([1.0 / h[:-1], -1.0 / h[:-1] - 1.0 / h[1:], 1.0 / h[1:]]) / between
    upper = np.zeros((5, 2 * n))
    for k in range(3):
        for i in range(3 - k):
            # of the points j + i and j + i + k, for both of their coordinates
            entries = penalty * between * second[i] * second[i + k]
            for axis in range(2):
                upper[4 - 2 * k, 2 * (i + k) + axis : 2 * (n - 2 + i + k) + axis : 2] += entries
    across = normals[:, :, None] * normals[:, None, :] * (1.0 - _ALONG) + _ALONG * np.eye(2)
    upper[4] += across[:, (0, 1), (0, 1)].ravel()
    upper[3, 1::2] += across[:, 0, 1]
    right = np.einsum("nij,nj->ni", across, values).ravel()
    return np.asarray(solveh_banded(upper, right).reshape(n, 2))


# --- What is wrong with measured points, each with its place: out of order, crossing themselves; `spikes` has the rest.

What = Literal["spike", "unclear", "out of order", "crosses itself"]

# A step back in y is the side of the body, not a fold of the line, if it is this much steeper than wide.
OVERHANG_SLOPE = 5.0
_TURNED_RAD = 2.0
_DENT_MM = 0.5


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Something that is wrong with a point.

    Attributes
    ----------
    index
        Of the point, from 0.
    y_mm, z_mm
        Its place.
    size_mm
        How large it is.
    """

    what: What
    index: int
    y_mm: float
    z_mm: float
    size_mm: float

    @classmethod
    def at(cls, what: What, index: int, point: Floats, size_mm: float) -> Problem:
        """Of a point (2,)."""
        return cls(what=what, index=index, y_mm=float(point[0]), z_mm=float(point[1]), size_mm=size_mm)

    @property
    def text(self) -> str:
        """In words."""
        at = f"point {self.index + 1}, ({self.y_mm:.4g}, {self.z_mm:.4g}) mm"
        if self.what == "spike":
            return f"a spike of {abs(self.size_mm):.2g} mm at {at}"
        if self.what == "unclear":
            return f"{at} is {abs(self.size_mm):.2g} mm off the lines on either side of it"
        if self.what == "out of order":
            return f"the line turns back at {at}"
        return f"the line crosses itself at {at}"


def turning_angles(points: Floats) -> Floats:
    """Angle (rad) between the chords before and after each inner point."""
    d = np.diff(points, axis=0)
    return np.asarray(np.arctan2(d[:-1, 0] * d[1:, 1] - d[:-1, 1] * d[1:, 0], (d[:-1] * d[1:]).sum(axis=1)))


def out_of_order(points: Floats, noise_mm: Floats) -> list[Problem]:
    """Points (n, 2) at which the line turns back, by more than the noise (n,) there does; the farthest back first."""
    step = np.diff(points, axis=0)
    back = step[:, 0] <= -np.maximum(noise_mm[:-1], noise_mm[1:])
    back &= np.abs(step[:, 1]) < OVERHANG_SLOPE * np.abs(step[:, 0])
    # a dent in a steep side leads back by less
    behind = np.maximum.accumulate(points[:, 0]) - points[:, 0]
    folded = np.flatnonzero(back & (behind[1:] > _DENT_MM))
    chord = np.hypot(*step.T)
    sharp = np.abs(turning_angles(points))
    turned = np.flatnonzero((sharp > _TURNED_RAD) & (np.minimum(chord[:-1], chord[1:]) > noise_mm[1:-1])) + 1
    # of both ends of a fold the one that the line turns at more is the wrong one, from whichever side one comes
    at = np.pad(sharp, 1)
    wrong = np.where(at[folded] >= at[folded + 1], folded, folded + 1)
    sizes = dict(
        sorted(zip([*wrong, *turned], [*chord[folded], *np.minimum(chord[:-1], chord[1:])[turned - 1]], strict=True))
    )
    return [
        Problem.at("out of order", int(i), points[i], float(sizes[i])) for i in sorted(sizes, key=lambda i: -sizes[i])
    ]


def crossings(points: Floats) -> list[Problem]:
    """Where the line through points (n, 2) crosses itself; a line that never turns back does not."""
    if np.all(np.diff(points[:, 0]) > 0.0):
        return []
    a, b = points[:-1], points[1:]
    d = b - a
    found = []
    # the least y of all that comes from the second point after a chord on
    later = np.minimum.accumulate(points[::-1, 0])[::-1][2:]
    for i in np.flatnonzero(later[: len(a) - 2] < np.maximum(a[:-2, 0], b[:-2, 0])):
        c, e = a[i + 2 :], d[i + 2 :]
        cross = d[i, 0] * e[:, 1] - d[i, 1] * e[:, 0]
        off = c - a[i]
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            t = (off[:, 0] * e[:, 1] - off[:, 1] * e[:, 0]) / cross
            u = (off[:, 0] * d[i, 1] - off[:, 1] * d[i, 0]) / cross
        if np.any((t > 0.0) & (t < 1.0) & (u > 0.0) & (u < 1.0)):
            found.append(Problem.at("crosses itself", int(i), a[i], float(np.hypot(*d[i]))))
    return found
