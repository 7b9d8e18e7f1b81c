"""Where a wheel and its rail overlap: the wheel's silhouette against the rail's line, for thousands of positions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError
from fecontact.geometry.placement import Pair, Placement
from fecontact.profiles.segments import CurvePoints

Floats = NDArray[np.float64]
# Distance of points on the wheel, and of those on the rail between which cubics run.
_WHEEL_STEP_MM, _RAIL_STEP_MM = 0.1, 0.05
# Feet on the rail are looked for in the order along this direction (rad): head and gauge face run forward along it.
_SLANT = 0.25 * np.pi
_FOOT_STEPS = 4
# Wider gaps are never closed by what theories know of their surroundings; and how far off a first guess of them may be.
_WIDEST_GAP_MM, _ROUGHLY_MM = 0.5, 2.0
_FEWEST = 3


def standing(pair: Pair, shift_mm: float) -> Placement:
    """A wheel on its rail, shifted towards it, without roll and yaw.

    Raises
    ------
    InputError
        If it does not stand there, with the reason.
    """
    placed = pair.placed(shift_mm, 0.0, 0.0)
    if isinstance(placed, str):
        raise InputError(f"a wheel cannot stand on its rail: {placed}; check gauge, profiles and back-to-back distance")
    return placed


@dataclass(frozen=True, kw_only=True, eq=False)
class Overlap:
    """A stretch of a wheel's silhouette near its rail, in points from the gauge side to the field side.

    Attributes
    ----------
    s_mm (n,)
        Arc length of their feet on the rail, increasing.
    depth_mm (n,)
        How deep they lie in the rail, along its normal; negative where there is a gap.
    place_mm (n, 3)
        Midway between both surfaces, in the track frame.
    angle_rad (n,)
        Angle of the rail's tangent plane there.
    radius_mm (n,)
        Distance from the axle.
    """

    s_mm: Floats
    depth_mm: Floats
    place_mm: Floats
    angle_rad: Floats
    radius_mm: Floats

    @property
    def curvature_along_per_mm(self) -> Floats:
        """Relative curvature (n,) along the rail: that of the rolling circle in the contact plane."""
        return np.asarray(np.cos(self.angle_rad) / self.radius_mm)


@dataclass(frozen=True, kw_only=True, eq=False)
class Surfaces:
    """A pair in the frame of the left side with tables of both lines."""

    pair: Pair

    @cached_property
    def _wheel(self) -> CurvePoints:
        return self.pair.wheel.evaluate(self.pair.wheel.spread(_WHEEL_STEP_MM)[1:-1])

    @cached_property
    def _rail(self) -> tuple[float, Floats]:
        """Step of the arc length, and along it y, z, cosine and sine of the tangent, and the place on the slant."""
        rail = self.pair.rail
        count = int(np.ceil(rail.profile.length_mm / _RAIL_STEP_MM)) + 1
        s = np.linspace(0.0, rail.profile.length_mm, count)
        y, z, angle = rail.section(rail.profile.at_arc_length(s))
        # a side that falls back steeper than the slant carries no wheel
        forward = np.cos(angle - _SLANT) > 0.05
        first, last = int(np.argmax(forward)), count - int(np.argmax(forward[::-1]))
        slant = y * np.cos(_SLANT) + z * np.sin(_SLANT)
        table = np.stack([s, y, z, np.cos(angle), np.sin(angle), slant])[:, first:last]
        return float(s[1]), table

    def overlap(self, shift_mm: float, height_mm: float, roll_rad: float, yaw_rad: float) -> Overlap | None:
        """Where the wheel is nearest to the rail, or in it; None where no point of it is within 0.5 mm.

        Parameters
        ----------
        shift_mm, height_mm
            Lateral position and height of the wheelset's centre over the track's.
        roll_rad, yaw_rad
            As everywhere; all of the left side.
        """
        pose = self.pair.hung(shift_mm, roll_rad, yaw_rad)
        _, x, y, z = pose.silhouette_of(self._wheel)
        z = z + height_mm
        # thousands of points are not near
        kept = np.flatnonzero(self._rough_depth(y, z) > -_ROUGHLY_MM)
        x, y, z = x[kept], y[kept], z[kept]
        s, depth, angle = self._feet(y, z)
        # feet that run back belong to a flank that faces away
        near = np.flatnonzero((depth > -_WIDEST_GAP_MM) & (np.diff(s, prepend=-np.inf) > 0.0))
        if near.size < _FEWEST:
            return None
        near = near[np.argsort(s[near], kind="stable")]
        half = 0.5 * depth[near]
        place = np.stack([x[near], y[near] - np.sin(angle[near]) * half, z[near] + np.cos(angle[near]) * half], axis=1)
        return Overlap(
            s_mm=s[near],
            depth_mm=depth[near],
            place_mm=place,
            angle_rad=angle[near],
            radius_mm=self.pair.rolling_radius_mm - self._wheel.z[kept[near]],
        )

    def _rough_depth(self, y: Floats, z: Floats) -> Floats:
        """Depths (n,) of points below the tangents of the rail at their places on the slant."""
        _, table = self._rail
        k = np.searchsorted(table[5, :-1], y * np.cos(_SLANT) + z * np.sin(_SLANT))
        return np.asarray((y - table[1, k]) * table[4, k] - (z - table[2, k]) * table[3, k])

    def _feet(self, y: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
        """Arc lengths (n,) of the feet of points on the rail, depths below it, and angles there."""
        step, table = self._rail
        slant = table[5]
        count = slant.size
        at = np.interp(y * np.cos(_SLANT) + z * np.sin(_SLANT), slant, np.arange(count, dtype=float))
        for _ in range(_FOOT_STEPS):
            k = np.clip(at.astype(int), 0, count - 2)
            v = at - k
            low, high = table[1:5, k], table[1:5, k + 1]
            py, pz = (_hermite(v, low[j], high[j], step * low[j + 2], step * high[j + 2]) for j in (0, 1))
            c, n = low[2] + v * (high[2] - low[2]), low[3] + v * (high[3] - low[3])
            dy, dz = y - py, z - pz
            bend = (low[2] * high[3] - low[3] * high[2]) / step
            along = (dy * c + dz * n) / (1.0 - bend * (dz * c - dy * n))
            at = np.clip(at + np.clip(along / step, -100.0, 100.0), 0.0, count - 1.0)
        size = np.hypot(c, n)
        depth = (dy * n - dz * c) / size
        # beyond the ends of the rail there is nothing
        depth = np.where((at > 0.0) & (at < count - 1.0) & (np.abs(along) < 1e-3), depth, -np.inf)
        return table[0, 0] + at * step, depth, np.arctan2(n, c)


def _hermite(v: Floats, p0: Floats, p1: Floats, m0: Floats, m1: Floats) -> Floats:
    """Cubic between two places with their rates, at v from 0 to 1."""
    a = p1 - p0
    return np.asarray(p0 + v * (m0 + v * (3.0 * a - 2.0 * m0 - m1 + v * (m0 + m1 - 2.0 * a))))
