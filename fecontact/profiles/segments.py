"""Segments of a profile, and the measured points of a smoothed profile.

A segment is evaluated at the local parameter v from 0 to 1. It returns the position and both derivatives in mm.
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


# Longest step of the table of a smoothed segment: the shortest filter spans some points, which are at least 0.1 mm
# apart.
_TABLE_STEP_MM = 0.25
# Fewest points of a cubic spline with not-a-knot ends.
_FEWEST_KNOTS = 4
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True, eq=False)
class CurvePoints:
    """Points of a curve with their first and second derivatives with respect to a parameter.

    Attributes
    ----------
    y, z
        Coordinates (mm), in any shape.
    dy, dz, ddy, ddz
        First and second derivatives with respect to the parameter u (mm), in the shape of y.
    """

    y: Floats
    z: Floats
    dy: Floats
    dz: Floats
    ddy: Floats
    ddz: Floats

    @classmethod
    def split_vectors(cls, position: Floats, first: Floats, second: Floats) -> CurvePoints:
        """Split vectors (y, z) into the coordinates of curve points.

        Parameters
        ----------
        position, first, second
            Positions, first and second derivatives, shape (..., 2) (mm).

        Returns
        -------
        CurvePoints
            Points in the shape (...).
        """
        (y, z), (dy, dz), (ddy, ddz) = (np.moveaxis(vectors, -1, 0) for vectors in (position, first, second))
        return cls(y=y, z=z, dy=dy, dz=dz, ddy=ddy, ddz=ddz)

    def select(self, index: Integers | slice) -> CurvePoints:
        """Selected points."""
        return CurvePoints(**{name: values[index] for name, values in vars(self).items()})

    @property
    def angle_rad(self) -> Floats:
        """Angle of the tangent, atan2(dz, dy)."""
        return np.arctan2(self.dz, self.dy)

    @property
    def curvature_per_mm(self) -> Floats:
        """Signed curvature (1/mm).

        It is positive where the curve turns to the left (upwards for growing y).
        """
        speed2 = self.dy * self.dy + self.dz * self.dz
        return np.asarray((self.dy * self.ddz - self.dz * self.ddy) / (speed2 * np.sqrt(speed2)))


@dataclass(frozen=True, kw_only=True)
class StraightSegment:
    """Straight segment from `start` to `end` (mm).

    Attributes
    ----------
    start, end
        Points (y, z) in mm at the parameters 0 and 1.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.profiles.segments import StraightSegment
    >>> StraightSegment(start=(0.0, 0.0), end=(4.0, 2.0)).evaluate(np.array([0.5])).y
    array([2.])
    """

    start: tuple[float, float]
    end: tuple[float, float]

    def evaluate(self, v: Floats) -> CurvePoints:
        """Points at the local parameter v.

        Parameters
        ----------
        v
            Local parameters in [0, 1], in any shape.

        Returns
        -------
        CurvePoints
            Points (mm) in the shape of v.
        """
        dy, dz = self.end[0] - self.start[0], self.end[1] - self.start[1]
        zero = np.zeros_like(v)
        return CurvePoints(
            y=self.start[0] + dy * v, z=self.start[1] + dz * v, dy=zero + dy, dz=zero + dz, ddy=zero, ddz=zero
        )


@dataclass(frozen=True, kw_only=True)
class Arc:
    """Circular segment about `centre` (mm), from `angle_from` to `angle_to` (rad).

    The parameter is proportional to the angle.

    Attributes
    ----------
    centre
        Centre (y, z) in mm.
    radius
        Radius in mm.
    angle_from, angle_to
        Angles in rad at the parameters 0 and 1, from the y axis.
    """

    centre: tuple[float, float]
    radius: float
    angle_from: float
    angle_to: float

    def evaluate(self, v: Floats) -> CurvePoints:
        """Points at the local parameter v.

        Parameters
        ----------
        v
            Local parameters in [0, 1], in any shape.

        Returns
        -------
        CurvePoints
            Points (mm) in the shape of v.
        """
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
    """Segment z = sum_k coefficients[k] y^k for y from `y_from` to `y_to` (mm).

    Attributes
    ----------
    coefficients
        Coefficient of y^k at index k, in mm^(1 - k).
    y_from, y_to
        Positions y in mm at the parameters 0 and 1.
    """

    coefficients: tuple[float, ...]
    y_from: float
    y_to: float

    @cached_property
    def _centred(self) -> tuple[np.polynomial.Polynomial, np.polynomial.Polynomial, np.polynomial.Polynomial]:
        """Polynomial about the middle of the segment, with its first and second derivatives.

        The variable runs from -1 to 1.
        """
        # Published coefficients are powers about a distant origin and lose six digits by cancellation (S1002, section
        # C). So they are moved to the middle of the segment in exact arithmetic. The variable runs from -1 to 1.
        middle = (Fraction(self.y_from) + Fraction(self.y_to)) / 2
        half = (Fraction(self.y_to) - Fraction(self.y_from)) / 2
        powers = range(len(self.coefficients))
        shifted = [
            half**k * sum(math.comb(n, k) * Fraction(self.coefficients[n]) * middle ** (n - k) for n in powers[k:])
            for k in powers
        ]
        centred = np.polynomial.Polynomial([float(value) for value in shifted])
        return centred, centred.deriv(), centred.deriv(2)

    def evaluate(self, v: Floats) -> CurvePoints:
        """Points at the local parameter v.

        Parameters
        ----------
        v
            Local parameters in [0, 1], in any shape.

        Returns
        -------
        CurvePoints
            Points (mm) in the shape of v.
        """
        span = self.y_to - self.y_from
        x, (p, first, second) = 2.0 * v - 1.0, self._centred
        zero = np.zeros_like(v)
        return CurvePoints(
            y=self.y_from + span * v, z=p(x), dy=zero + span, dz=2.0 * first(x), ddy=zero, ddz=4.0 * second(x)
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Spline:
    """Cubic spline through points over their cumulative chord length, with not-a-knot ends.

    The curvature of an interpolating spline carries the noise of its points (about 6 e / h^2 for independent errors e
    and a spacing h). So results on such a profile depend on the accuracy of the points.

    Attributes
    ----------
    points
        Points (n, 2) in mm.
    """

    points: Floats

    def thinned(self, first: Literal[0, 1] = 0) -> Spline:
        """Spline through every second point and both ends.

        Parameters
        ----------
        first
            Index of the first point that is kept besides the end, 0 or 1.

        Returns
        -------
        Spline
            Thinned spline, or the spline itself if fewer than four points would be left.
        """
        keep = np.arange(len(self.points)) % 2 == first
        keep[[0, -1]] = True
        return Spline(points=self.points[keep]) if np.count_nonzero(keep) >= _FEWEST_KNOTS else self

    @cached_property
    def _spline(self) -> CubicSpline:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.knots, self.points)

    @cached_property
    def knots(self) -> Floats:
        """Local parameters (n,) of the points."""
        chord = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(self.points, axis=0).T))))
        return np.asarray(chord / chord[-1])

    def evaluate(self, v: Floats) -> CurvePoints:
        """Points at the local parameter v.

        Parameters
        ----------
        v
            Local parameters in [0, 1], in any shape.

        Returns
        -------
        CurvePoints
            Points (mm) in the shape of v.
        """
        return CurvePoints.split_vectors(self._spline(v), self._spline(v, 1), self._spline(v, 2))


@dataclass(frozen=True, kw_only=True)
class Registration:
    """Rigid displacement of a reference profile onto points.

    The reference is turned about its origin first, and then moved.

    Attributes
    ----------
    turn_rad
        Angle, positive to the left (rad).
    shift
        Displacement (y, z) after the turn (mm).

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.profiles.segments import Registration
    >>> Registration(shift=(1.0, -2.0)).from_reference(np.array([3.0, 4.0]))
    array([4., 2.])
    """

    turn_rad: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)

    def rotate(self, vectors: Floats) -> Floats:
        """Rotate directions of the reference into the axes of the points.

        Parameters
        ----------
        vectors
            Directions (..., 2) in the axes of the reference.

        Returns
        -------
        ndarray
            Directions (..., 2) in the axes of the points.
        """
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        y, z = vectors[..., 0], vectors[..., 1]
        return np.stack((y * c - z * s, y * s + z * c), axis=-1)

    def from_reference(self, points: Floats) -> Floats:
        """Points of the reference in the axes of the measured points, shape (..., 2) (mm).

        Parameters
        ----------
        points : ndarray of shape (..., 2)
            Points in the axes of the reference in mm.

        Returns
        -------
        ndarray of shape (..., 2)
            Points in the axes of the measured points in mm.
        """
        return np.asarray(self.rotate(points) + np.array(self.shift))

    def to_reference(self, points: Floats) -> Floats:
        """Measured points in the axes of the reference, shape (..., 2) (mm).

        This is the inverse of `from_reference`.

        Parameters
        ----------
        points : ndarray of shape (..., 2)
            Points in the axes of the measured points in mm.

        Returns
        -------
        ndarray of shape (..., 2)
            Points in the axes of the reference in mm.
        """
        return Registration(turn_rad=-self.turn_rad).rotate(points - np.array(self.shift))


IDENTITY_REGISTRATION = Registration()
"""Registration without turn and displacement."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothedSegment:
    """Segment of a profile that was smoothed from measured points.

    It is a part of an exact segment that is moved by a smooth field.

    Attributes
    ----------
    field
        Displacement (y, z) in mm over the arc length s of the profile to which the points were assigned. Without a
        `base`, the position itself.
    s_from, s_to
        Range of s on this segment (mm).
    base, v_from, v_to
        Exact segment that is moved, and the range of its parameter.
    registration
        Rigid displacement of the exact segment onto the points.
    """

    field: PPoly
    s_from: float
    s_to: float
    base: StraightSegment | Arc | Polynomial | None = None
    v_from: float = 0.0
    v_to: float = 1.0
    registration: Registration = IDENTITY_REGISTRATION

    @cached_property
    def knots(self) -> Floats:
        """Local parameters between which the segment is nearly a polynomial.

        It is close enough to a polynomial for a table.
        """
        even = np.linspace(0.0, 1.0, max(3, math.ceil((self.s_to - self.s_from) / _TABLE_STEP_MM)))
        fields = self.field.x[(self.field.x > self.s_from) & (self.field.x < self.s_to)]
        v = np.sort(np.concatenate((even, self.local_parameters(fields), self._arc_length.x[1:-1])))
        inner = v[1:-1][np.diff(v)[:-1] > _PARAMETER_TOLERANCE]
        return np.concatenate(([0.0], inner[inner < 1.0 - _PARAMETER_TOLERANCE], [1.0]))

    def local_parameters(self, s: Floats) -> Floats:
        """Local parameters of arc lengths, by Newton's method.

        Parameters
        ----------
        s
            Arc lengths on this segment (mm), in any shape.

        Returns
        -------
        ndarray
            Local parameters in [0, 1], in the shape of s.
        """
        v = np.interp(s, (self.s_from, self.s_to), (0.0, 1.0))
        for _ in range(20 if isinstance(self.base, Polynomial) else 1):
            previous, v = v, np.clip(v - (self._arc_length(v) - s) / self._arc_length(v, 1), 0.0, 1.0)
            if np.array_equal(previous, v):
                break
        return v

    @cached_property
    def _arc_length(self) -> PPoly:
        """Arc length s over the local parameter.

        The speed along a polynomial is not constant.
        """
        from scipy.interpolate import PPoly

        if isinstance(self.base, Polynomial):
            return integrate_polynomial_length(self.base, self.v_from, self.v_to, self.s_from)
        return PPoly([[self.s_to - self.s_from], [self.s_from]], [0.0, 1.0])

    def evaluate(self, v: Floats) -> CurvePoints:
        """Points at the local parameter v.

        Parameters
        ----------
        v
            Local parameters in [0, 1], in any shape.

        Returns
        -------
        CurvePoints
            Points (mm) in the shape of v.
        """
        s, rate = self._arc_length(v), self._arc_length(v, 1)[..., None]
        p, first, second = self.field(s), self.field(s, 1), self.field(s, 2)
        d, dd = first * rate, second * rate**2
        if isinstance(self.base, Polynomial):
            dd = dd + first * self._arc_length(v, 2)[..., None]
        if self.base is None:
            return CurvePoints.split_vectors(p, d, dd)
        span, pose = self.v_to - self.v_from, self.registration
        b = self.base.evaluate(self.v_from + span * v)
        return CurvePoints.split_vectors(
            pose.from_reference(np.stack((b.y, b.z), axis=-1)) + p,
            span * pose.rotate(np.stack((b.dy, b.dz), axis=-1)) + d,
            span**2 * pose.rotate(np.stack((b.ddy, b.ddz), axis=-1)) + dd,
        )


def integrate_polynomial_length(base: Polynomial, v_from: float, v_to: float, s_from: float = 0.0) -> CubicSpline:
    """Integrate the arc length along a part of a polynomial segment.

    Parameters
    ----------
    base
        Polynomial segment.
    v_from, v_to
        Range of its local parameter.
    s_from
        Arc length at the beginning (mm).

    Returns
    -------
    CubicSpline
        Arc length (mm) over a parameter from 0 to 1.
    """
    from scipy.interpolate import CubicSpline

    v = np.linspace(0.0, 1.0, 65)
    half, span = 0.5 * np.diff(v)[:, None], v_to - v_from
    points = base.evaluate(v_from + span * (v[:-1, None] + half * (1.0 + _GAUSS_NODES)))
    steps = (half * span * np.hypot(points.dy, points.dz)) @ _GAUSS_WEIGHTS
    return CubicSpline(v, s_from + np.concatenate(([0.0], np.cumsum(steps))))


Segment: TypeAlias = StraightSegment | Arc | Polynomial | Spline | SmoothedSegment


def translate_segment(segment: Segment, dy_mm: float, dz_mm: float) -> Segment:
    """Translate a line, arc or polynomial.

    Parameters
    ----------
    segment
        Exact segment.
    dy_mm, dz_mm
        Displacement across and upwards (mm).

    Returns
    -------
    Segment
        Segment of the same kind.
    """
    if isinstance(segment, Polynomial):
        shifted = np.polynomial.Polynomial(segment.coefficients)(np.polynomial.Polynomial([-dy_mm, 1.0])).coef
        constant, *rest = map(float, shifted if dy_mm else segment.coefficients)
        ends = {"y_from": segment.y_from + dy_mm, "y_to": segment.y_to + dy_mm}
        return replace(segment, coefficients=(constant + dz_mm, *rest), **ends)
    if isinstance(segment, Arc):
        return replace(segment, centre=(segment.centre[0] + dy_mm, segment.centre[1] + dz_mm))
    assert isinstance(segment, StraightSegment)
    (y0, z0), (y1, z1) = segment.start, segment.end
    return StraightSegment(start=(y0 + dy_mm, z0 + dz_mm), end=(y1 + dy_mm, z1 + dz_mm))


# Local parameters that differ by less are equal.
_PARAMETER_TOLERANCE = 1e-9


# --- The measured points of a smoothed profile.


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothingFrame:
    """Measured points as deviations from a reference.

    The reference is a nominal profile, or the chain of chords through the points.

    Attributes
    ----------
    points : ndarray of shape (n, 2)
        Points in mm, without those that were left out.
    s_mm : ndarray of shape (n,)
        Arc length of each point along the reference.
    values : ndarray of shape (n, 2)
        Smoothed quantity (mm): the deviations of the points from their nominal profile, or the points themselves.
    normals : ndarray of shape (n, 2)
        Normals of the reference, to its left.
    relative_filter : ndarray of shape (n,) or None
        Filter length at each point divided by the full filter length, where it follows the curvature; None if it is
        constant.
    nominal
        Name of the nominal profile; empty if there is none.
    registration
        Rigid displacement of the nominal profile onto the points.
    reference
        Segments of the nominal profile.
    """

    points: Floats
    s_mm: Floats
    values: Floats
    normals: Floats
    relative_filter: Floats | None = None
    nominal: str = ""
    registration: Registration = IDENTITY_REGISTRATION
    reference: tuple[Segment, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothingResult:
    """Measured points of a smoothed profile, with the settings and results of the smoothing.

    Attributes
    ----------
    held
        Points and their reference.
    residual_mm : ndarray of shape (n,)
        Distance of each point to the left of the smoothed profile.
    noise_mm
        Standard deviation of the noise of the points, across the profile.
    independent_noise_mm
        Standard deviation of the noise that is independent in each point.
    correlated_noise_mm : ndarray of shape (n,)
        Noise that neighbours have in common: waves of an instrument, or waves of the profile that are shorter than its
        filter.
    filter_mm
        Wave length that the smoothing halves; in flat parts, if the filter follows the curvature.
    curvature_noise_per_mm : ndarray of shape (n,)
        Standard deviation of the curvature of the profile that the noise causes (1/mm).
    is_filter_declared
        Whether the filter length was given: then no other filter length counts.
    is_noise_known
        Whether the independent noise was given, or is the rounding of the points, in place of an estimate.
    """

    held: SmoothingFrame
    residual_mm: Floats
    noise_mm: float
    independent_noise_mm: float
    correlated_noise_mm: Floats
    filter_mm: float
    curvature_noise_per_mm: Floats
    is_filter_declared: bool = False
    is_noise_known: bool = False

    @property
    def points(self) -> Floats:
        """Measured points (n, 2) in mm."""
        return self.held.points

    @property
    def s_mm(self) -> Floats:
        """Arc length (n,) of each point along its reference (mm)."""
        return self.held.s_mm

    @property
    def nominal(self) -> str:
        """Name of the nominal profile; empty if there is none."""
        return self.held.nominal
