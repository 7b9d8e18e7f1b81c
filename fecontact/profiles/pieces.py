"""A chain of segments as polynomials of short pieces, evaluated and inverted for all points at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.polynomial.polynomial import polyval

from fecontact.arrays import Floats
from fecontact.profiles.segments import CurvePoints, Segment, Smoothed, Spline

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

# A coordinate this little beyond an end still counts as the end (mm).
_END_SLACK_MM = 1e-9
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
