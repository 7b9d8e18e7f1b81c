"""Points held against an exact line: where the line must lie to fit them best, and how far they are off it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.profiles.curve import Profile
from fecontact.profiles.segments import Floats, Registration

# Gauss-Newton steps; from 5 mm and 50 mrad off they end after eight.
_MOST_STEPS = 20
# Points that lie off by more than so many times the usual are worn and count less (Huber 1964).
_HUBER = 2.0
# No rail is inclined by more.
_LARGEST_TURN_RAD = 0.2
_FOOT_STEPS = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class FootPoints:
    """For each of n points the nearest one on a line.

    Attributes
    ----------
    s_mm, points, normals
        Its arc length, place, and the line's normal there, to the left.
    off_mm
        How far the point lies off along that normal.
    inside
        Whether it lies beside the line and not beyond its ends.
    """

    s_mm: Floats
    points: Floats
    normals: Floats
    off_mm: Floats
    inside: NDArray[np.bool_]


def foot_points(line: Profile, points: Floats, *, near: FootPoints | None = None) -> FootPoints:
    """The nearest points of a line to points (n, 2) that lie a few mm off it at most; `near` has places to begin at."""
    if near is None:
        from scipy.spatial import cKDTree

        table = line._table
        nearest = cKDTree(np.column_stack((table.points.y, table.points.z))).query(points)[1]
        s = line._table_lengths[nearest]
    else:
        s = near.s_mm
    for _ in range(_FOOT_STEPS):
        p = line.evaluate(line.at_arc_length(s))
        speed = np.hypot(p.dy, p.dz)
        tangent = np.column_stack((p.dy, p.dz)) / speed[:, None]
        off = points - np.column_stack((p.y, p.z))
        along = (off * tangent).sum(axis=1)
        across = off[:, 1] * tangent[:, 0] - off[:, 0] * tangent[:, 1]
        # beyond the centre of a tight arc there is no foot point to converge to
        step = np.clip(along / np.maximum(1.0 - p.curvature_per_mm * across, 0.2), -1.0, 1.0)
        # points beyond an end would go on for ever
        further = np.clip(s + step, 0.0, line.length_mm)
        if not np.any(np.abs(further - s) > 1e-10):
            break
        s = further
    return FootPoints(
        s_mm=s,
        points=np.column_stack((p.y, p.z)),
        normals=np.column_stack((-tangent[:, 1], tangent[:, 0])),
        off_mm=across,
        inside=(np.abs(along) < 1e-6) & (s >= 0.0) & (s <= line.length_mm),
    )


def register(line: Profile, points: Floats, *, steps: int = _MOST_STEPS) -> tuple[Registration, float]:
    """Turn and move a line onto points (n, 2), worn ones counting less; with the usual distance that is left (mm)."""
    found = Registration(shift=first_shift(line, points))
    feet: FootPoints | None = None
    for _ in range(steps):
        moved = found.to_reference(points)
        feet = foot_points(line, moved, near=feet)
        scale = _usual(feet.off_mm[feet.inside])
        weight = np.where(feet.inside, np.minimum(1.0, _HUBER * scale / np.maximum(np.abs(feet.off_mm), 1e-12)), 0.0)
        # moving the points by -shift and turning them by -turn, to first order about where they are
        lever = moved[:, 0] * feet.normals[:, 1] - moved[:, 1] * feet.normals[:, 0]
        matrix = np.sqrt(weight)[:, None] * np.column_stack((feet.normals, lever))
        step = np.linalg.lstsq(matrix, np.sqrt(weight) * feet.off_mm, rcond=1e-6)[0]
        step[2] = np.clip(step[2], -0.05, 0.05)
        step[:2] = np.clip(step[:2], -3.0, 3.0)
        turn = float(np.clip(found.turn_rad + step[2], -_LARGEST_TURN_RAD, _LARGEST_TURN_RAD))
        added = found.turned(step[None, :2])[0]
        found = Registration(turn_rad=turn, shift=(found.shift[0] + added[0], found.shift[1] + added[1]))
        if np.abs(step).max() < 1e-9:
            break
    feet = foot_points(line, found.to_reference(points))
    return found, _usual(feet.off_mm[feet.inside]) if np.count_nonzero(feet.inside) > 0.8 * len(points) else math.inf


def _usual(off: Floats) -> float:
    return float(np.median(np.abs(off))) / 0.6745 + 1e-9 if off.size else math.inf


def first_shift(line: Profile, points: Floats) -> tuple[float, float]:
    """The crowns of two rails, or the flange tips of two wheels, on one another."""
    table = line._table.points
    if line.kind == "rail":
        i, j = int(np.argmax(table.z)), int(np.argmax(points[:, 1]))
        # a crown is flat: across, the middles of the heads are surer
        middle = 0.5 * float(np.ptp(points[:, 0]) - np.ptp(table.y)) + float(points[:, 0].min() - table.y.min())
        return middle, float(points[j, 1] - table.z[i])
    i, j = int(np.argmin(table.z)), int(np.argmin(points[:, 1]))
    if min(np.ptp(table.z), np.ptp(points[:, 1])) < 15.0:
        return 0.0, 0.0
    return float(points[j, 0] - table.y[i]), float(points[j, 1] - table.z[i])
