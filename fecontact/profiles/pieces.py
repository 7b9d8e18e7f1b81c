"""Profiles as short polynomials, which are evaluated and inverted for all points at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.polynomial.polynomial import polyval

from fecontact.arrays import Floats
from fecontact.profiles.segments import CurvePoints, Segment, SmoothedSegment, Spline

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

# A coordinate that is beyond an end by less is at the end (mm).
_END_SLACK_MM = 1e-9
# Newton steps converge quadratically: after a step of this size the next step is smaller than the rounding error.
_NEWTON_TOLERANCE = 1e-11
# For heights the error after a step of this size is small enough: at most 1e-12 mm.
_FOLLOWING_TOLERANCE = 1e-8
# A cubic with end slopes up to this many times the slope of its chord increases (Fritsch and Carlson 1980).
_STEEPEST_OVER_CHORD = 3.0
# Least sine of the angle between profile and viewing direction for a piece that runs forward.
_FORWARD_SINE = 1e-9
# Least rate in a Newton step. The rate is zero where a profile turns back.
_LEAST_RATE = 1e-30
# Nodes of a piece for the polynomials of second derivatives and speeds. On an arc of 1 rad each piece is 0.016 rad
# long, and the curvature has an error of 1e-15.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
_TO_POWERS = np.linalg.inv(np.vander(_NODES, increasing=True))
# Matrix from powers about the middle of a piece to powers about its beginning, in half lengths.
_TO_BEGINNING = np.array([[math.comb(k, j) * (-1.0) ** (k - j) if k >= j else 0.0 for k in range(6)] for j in range(6)])


def sample_parameters(segment: Segment) -> Floats:
    """Sample a segment at local parameters between which it is nearly a polynomial.

    Parameters
    ----------
    segment
        Segment.

    Returns
    -------
    ndarray
        Local parameters (n,) from 0 to 1.
    """
    if isinstance(segment, Spline):
        return np.interp(np.arange(4 * segment.knots.size - 3) / 4.0, np.arange(segment.knots.size), segment.knots)
    return segment.knots if isinstance(segment, SmoothedSegment) else np.linspace(0.0, 1.0, 65)


@dataclass(frozen=True, kw_only=True, eq=False)
class MonotoneFunction:
    """Function of the parameter that increases along some pieces of a chain.

    Attributes
    ----------
    function
        Value and rate of the function, in the last axis of its result. Further columns are pairs of a value and a rate
        of other functions.
    u : ndarray of shape (k,)
        Parameters of the ends of these pieces.
    values, rates : ndarray of shape (k,)
        Values and rates of the function at the ends.
    """

    function: Callable[[Floats], Floats]
    u: Floats
    values: Floats
    rates: Floats

    @cached_property
    def _inverse(self) -> Floats:
        """Cubics of the inverse function, without their constants: the coefficients (3, k - 1) of ascending powers.

        Value and parameter are counted from the beginning of each piece. The cubics have the slopes of the inverse
        function at both ends, unless they would not increase: then only the first power is used.
        """
        lengths, steps = np.diff(self.u), np.diff(self.values)
        coefficients = np.zeros((3, lengths.size))
        chord = np.divide(lengths, steps, out=coefficients[0], where=steps > 0.0)
        slopes = 1.0 / np.maximum(self.rates, _LEAST_RATE)
        is_cubic = (chord > 0.0) & (np.maximum(slopes[:-1], slopes[1:]) <= _STEEPEST_OVER_CHORD * chord)
        begin, end, chord, step = (values[is_cubic] for values in (slopes[:-1], slopes[1:], chord, steps))
        cubics = (begin, (3.0 * chord - 2.0 * begin - end) / step, (begin + end - 2.0 * chord) / step**2)
        coefficients[:, is_cubic] = cubics
        return coefficients

    def inverted(self, t: Floats) -> Floats:
        """Parameters at which the function has the value t.

        Parameters
        ----------
        t
            Values, in any shape.

        Returns
        -------
        ndarray
            Parameters in the shape of t; NaN beyond the ends.
        """
        u, _, _ = self._solve(t, _NEWTON_TOLERANCE)
        return self._mask_beyond(t, u)

    def follow(self, t: Floats) -> Floats:
        """Value of the second function of `function` where the first function has the value t.

        Parameters
        ----------
        t
            Values, in any shape.

        Returns
        -------
        ndarray
            Values of the second function in the shape of t; NaN beyond the ends.
        """
        _, columns, step = self._solve(t, _FOLLOWING_TOLERANCE)
        return self._mask_beyond(t, columns[..., 2] + step * columns[..., 3])

    def _mask_beyond(self, t: Floats, results: Floats) -> Floats:
        """Results, with NaN where t is beyond the ends."""
        first, last = self.values[0], self.values[-1]
        return np.where((t >= first - _END_SLACK_MM) & (t <= last + _END_SLACK_MM), results, np.nan)

    def _solve(self, t: Floats, tolerance: float) -> tuple[Floats, Floats, Floats]:
        """Parameters at which the function has the value t, or the nearest end.

        Newton steps are limited to one piece, and end with a step of at most the tolerance. The second result has the
        last columns of the function, and the third the last step, from their parameters to the first result.
        """
        # np.clip takes five times as long, and this function is called a hundred times for a placement
        target = np.minimum(np.maximum(t, self.values[0]), self.values[-1])
        piece = np.minimum(self.values.searchsorted(target, side="right"), self.values.size - 1) - 1
        # `take` needs half the time of an index
        low, high, begin = self.u.take(piece), self.u.take(piece + 1), self.values.take(piece)
        offset, (linear, square, cube) = target - begin, (powers.take(piece) for powers in self._inverse)
        u = np.minimum(np.maximum(low + offset * (linear + offset * (square + offset * cube)), low), high)
        for _ in range(60):
            columns = self.function(u)
            step = (target - columns[..., 0]) / np.maximum(columns[..., 1], _LEAST_RATE)
            previous, u = u, np.minimum(np.maximum(u + step, low), high)
            step = u - previous
            if not (np.abs(step) > tolerance).any():
                break
        return u, columns, step


@dataclass(frozen=True, kw_only=True, eq=False)
class PiecewiseCurve:
    """Chain of segments in short polynomial pieces.

    Where two segments meet, a piece of zero length leads from the first to the second.

    Attributes
    ----------
    u : ndarray of shape (m + 1,)
        Parameters of the ends of the pieces: number of the segment plus its local parameter.
    ends
        Points (m + 1,) at the ends; both points where two segments meet.
    curve
        y, z in mm, and their first and second derivatives, over the parameter.
    arc
        Arc length in mm over the parameter.
    """

    u: Floats
    ends: CurvePoints
    curve: PPoly
    arc: MonotoneFunction

    @classmethod
    def of(cls, segments: Sequence[Segment]) -> PiecewiseCurve:
        """Divide a chain of segments into pieces.

        Parameters
        ----------
        segments
            Chain of segments.

        Returns
        -------
        PiecewiseCurve
            Pieces of all segments.
        """
        local_parameters = [sample_parameters(segment) for segment in segments]
        u = np.concatenate([k + parameters for k, parameters in enumerate(local_parameters)])
        points = [segment.evaluate(parameters) for segment, parameters in zip(segments, local_parameters, strict=True)]
        ends = CurvePoints(
            **{name: np.concatenate([getattr(point, name) for point in points]) for name in vars(points[0])}
        )
        begin = ends.select(slice(-1))
        derivatives = np.concatenate(
            [
                _fit_derivatives(segment, parameters)
                for segment, parameters in zip(segments, local_parameters, strict=True)
            ],
            axis=2,
        )[..., :-1]
        first = _integrate_powers(derivatives[:, :2], np.stack((begin.dy, begin.dz)))
        position = _integrate_powers(first, np.stack((begin.y, begin.z)))
        speed = derivatives[:, 2:]
        steps = polyval(np.diff(u), _integrate_powers(speed, np.zeros((1, u.size - 1)))[:, 0], tensor=False)
        lengths = np.append(0.0, np.cumsum(steps))
        arc = _join_polynomials(u, _integrate_powers(speed, lengths[None, :-1]), speed)
        return cls(
            u=u,
            ends=ends,
            curve=_join_polynomials(u, position, first, derivatives[:, :2]),
            arc=MonotoneFunction(function=arc, u=u, values=lengths, rates=np.hypot(ends.dy, ends.dz)),
        )

    @cached_property
    def tangents(self) -> PPoly:
        """y, z in mm and their first derivatives, over the parameter.

        It takes two thirds of the time of `curve`.
        """
        from scipy.interpolate import PPoly

        return PPoly(self.curve.c[..., :4], self.u)

    def evaluate(self, u: Floats, side: Literal["left", "right"] = "right") -> CurvePoints:
        """Points at parameters u.

        Parameters
        ----------
        u
            Parameters, in any shape.
        side
            Segment at a point where two segments meet.

        Returns
        -------
        CurvePoints
            Points (mm) in the shape of u.
        """
        # at an end the function uses the piece that begins there
        at = self.curve(u if side == "right" else np.nextafter(u, -np.inf))
        return CurvePoints(*(at[..., k] for k in range(6)))

    def along(self, angle_rad: float) -> MonotoneFunction | None:
        """Coordinate along a tilted axis, on the stretch with the largest increase.

        Parameters
        ----------
        angle_rad
            Angle of the axis (rad).

        Returns
        -------
        MonotoneFunction or None
            Coordinate (mm); None if it increases nowhere.
        """
        from scipy.interpolate import PPoly

        c, s = math.cos(angle_rad), math.sin(angle_rad)
        coordinate = PPoly(self.curve.c[..., :4:2] * c + self.curve.c[..., 1:4:2] * s, self.u)
        ends = self.ends
        return self.find_rise(coordinate, ends.y * c + ends.z * s, ends.dy * c + ends.dz * s)

    def find_rise(self, function: Callable[[Floats], Floats], values: Floats, rates: Floats) -> MonotoneFunction | None:
        """Restrict a coordinate to the stretch with its largest increase.

        Parameters
        ----------
        function
            Coordinate (mm) at parameters, and its rate, in the last axis of the result. Further columns are as in
            `MonotoneFunction`.
        values, rates
            Coordinate and rate (m + 1,) at the ends of the pieces.

        Returns
        -------
        MonotoneFunction or None
            Coordinate (mm); None if it increases nowhere.
        """
        chords = np.hypot(np.diff(self.ends.y), np.diff(self.ends.z))
        forward = (np.diff(values) > _FORWARD_SINE * chords) | (np.diff(self.u) == 0.0)
        turns = np.flatnonzero(np.diff(forward, prepend=False, append=False))
        starts, stops = turns[::2], turns[1::2]
        if not starts.size:
            return None
        widest = int(np.argmax(values[stops] - values[starts]))
        stretch = slice(int(starts[widest]), int(stops[widest]) + 1)
        # rounded coordinates may have a tiny step back at a joint
        return MonotoneFunction(
            function=function,
            u=self.u[stretch],
            values=np.maximum.accumulate(values[stretch]),
            rates=rates[stretch],
        )


def _fit_derivatives(segment: Segment, v: Floats) -> Floats:
    """Fit polynomials to the second derivatives and the speed of a segment.

    Second derivatives have no digits to lose by cancellation.

    Parameters
    ----------
    segment
        Segment.
    v
        Local parameters (n,) of the ends of the n - 1 pieces.

    Returns
    -------
    ndarray
        Coefficients (6, 3, n) of ascending powers of the parameter from the beginning of each piece, for the second
        derivatives of y and z and for the speed. The last entry is 0.
    """
    half, middle = 0.5 * np.diff(v), 0.5 * (v[1:] + v[:-1])
    points = segment.evaluate(middle[:, None] + half[:, None] * _NODES)
    scale = half ** -np.arange(6.0)[:, None]
    coefficients = np.zeros((6, 3, v.size))
    for k, derivative in enumerate((points.ddy, points.ddz, np.hypot(points.dy, points.dz))):
        coefficients[:, k, :-1] = _TO_BEGINNING @ (_TO_POWERS @ derivative.T) * scale
    return coefficients


def _integrate_powers(powers: Floats, begin: Floats) -> Floats:
    """Integrate polynomials with coefficients (k, c, m), from start values (c, m).

    The result has the coefficients (k + 1, c, m) of ascending powers.
    """
    return np.concatenate((begin[None], powers / np.arange(1.0, len(powers) + 1.0)[:, None, None]))


def _join_polynomials(u: Floats, *columns: Floats) -> PPoly:
    """Join functions with ascending powers (k, c, m) on the pieces between u, as columns.

    Parameters
    ----------
    u
        Ends of the pieces (m + 1,).
    *columns
        Coefficients (k, c, m) of ascending powers.

    Returns
    -------
    PPoly
        Function with the values of all columns.
    """
    from scipy.interpolate import PPoly

    powers = np.zeros((max(map(len, columns)), u.size - 1, sum(column.shape[1] for column in columns)))
    start = 0
    for column in columns:
        # scipy needs the highest power first
        powers[len(powers) - len(column) :, :, start : start + column.shape[1]] = column[::-1].swapaxes(1, 2)
        start += column.shape[1]
    return PPoly(powers, u)
