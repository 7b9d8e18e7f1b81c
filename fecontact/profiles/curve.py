"""Plane profile lines made of exact segments: positions, slopes, curvatures, junctions.

A profile lives in its own axes: y lateral (positive to the field side), z up, in mm. A rail has its material below the
line, a wheel above it. A profile is one curve with the parameter u in [0, n]: segment k covers u in [k, k+1].
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from fecontact.errors import InputError
from fecontact.profiles.inversion import Table, inverted
from fecontact.profiles.measured import Measured
from fecontact.profiles.segments import (
    GAUSS_NODES,
    GAUSS_WEIGHTS,
    CurvePoints,
    Floats,
    Integers,
    Segment,
    Smoothed,
    Spline,
)

if TYPE_CHECKING:
    from fecontact.profiles.problems import Problem

Kind = Literal["rail", "wheel"]
Side = Literal["left", "right"]

# Farthest coordinate (mm): doubles lie 1e-7 mm apart there, and products of a few coordinates are finite.
FARTHEST_MM = 1e9
# Tangent jump that makes a corner (rad). The rounding of published coordinates leaves 1e-6, a real corner has 1e-2.
CORNER_RAD = 1e-3
# Curvature jump that makes a junction (1/mm): the curvature of an arc of R 100 m.
CURVATURE_JUMP_PER_MM = 1e-5
# Largest gap between neighbouring segments (mm). The published sections of the S1002 leave 1.2e-4.
JOINT_GAP_MM = 1e-3
# Smallest sine between the line and the observer's direction that still counts as running forward.
_FORWARD_SINE = 1e-9


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
        hit = np.flatnonzero(np.bincount(k.ravel(), minlength=len(self.segments)))
        if hit.size == 1:
            return self.segments[int(hit[0])].evaluate(v)
        out = np.empty((6, *v.shape))
        for i in hit:
            mask = k == i
            p = self.segments[i].evaluate(v[mask])
            out[:, mask] = p.y, p.z, p.dy, p.dz, p.ddy, p.ddz
        return CurvePoints(y=out[0], z=out[1], dy=out[2], dz=out[3], ddy=out[4], ddz=out[5])

    @cached_property
    def _table(self) -> Table:
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
        return Table(segment=segment, v=v, points=self._points(segment, v))

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
        return inverted(table, values, slice(int(starts[widest]), int(stops[widest]) + 1), t, along_and_rate)

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

    def _gauss_length(self, k: Integers, v_from: Floats, v_to: Floats) -> Floats:
        """Arc length of the short pieces [v_from, v_to] of the segments k."""
        half = 0.5 * (v_to - v_from)[..., None]
        nodes = 0.5 * (v_to + v_from)[..., None] + half * GAUSS_NODES
        points = self._points(np.broadcast_to(k[..., None], nodes.shape), nodes)
        return np.asarray((half * np.hypot(points.dy, points.dz)) @ GAUSS_WEIGHTS)

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

        return inverted(self._table, self._table_lengths, slice(None), s, length_and_speed)
