"""Points registered on exact profiles: rigid displacements, nearest points and distances."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.profiles.curve import Profile
from fecontact.profiles.segments import CurvePoints, Registration

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


# Gauss-Newton steps; from 5 mm and 50 mrad off they end after eight.
_MOST_STEPS = 20
# Points that lie off by more than so many times the usual are worn and count less (Huber 1964).
_HUBER_FACTOR = 2.0
# How far off points may be that still count beside wear, at first and at last (in parts of their noise), and how it
# falls; and within how much of their noise nearly all unworn ones lie.
_FIRST_REACH_MM, _LAST_REACH_OVER_NOISE, _REACH_FACTOR, _UNWORN_OVER_NOISE = 0.3, 1.5, 0.8, 3.0
# Lines of the library are drawings, and no surface is made to less.
LEAST_NOISE_MM = 0.001
# Of a Gauss-Newton step, across, upwards (mm) and turned (rad).
_LARGEST_STEP = np.array([3.0, 3.0, 0.05])
# No rail is inclined by more.
_LARGEST_TURN_RAD = 0.2
_FOOT_STEPS = 8
# While the line still moves, fewer do: each begins at the feet of the one before.
_FIRST_FOOT_STEPS = 3
# Points whose nearest ones are looked up together, and of which ends of pieces.
_POINTS_PER_BLOCK, _SAMPLE_STRIDE = 500, 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Lines:
    """Exact lines (k,) as one curve, one behind another, for the nearest points on all of them in one calculation.

    Attributes
    ----------
    curve
        y, z in mm, and their first and second derivatives, over the parameter.
    u, s_mm
        A table of the parameter and the arc length, both going on from line to line.
    first_mm, last_mm (k, 1)
        The arc length there at both ends of each line.
    """

    lines: tuple[Profile, ...]
    curve: PPoly
    u: Floats
    s_mm: Floats
    first_mm: Floats
    last_mm: Floats

    @classmethod
    def of(cls, *lines: Profile) -> Lines:
        """Lines with room between one and the next."""
        pieces = [line._pieces for line in lines]
        lengths = np.array([line.length_mm for line in lines])
        first = np.concatenate(([0.0], np.cumsum(lengths + 1.0)[:-1]))
        begin = np.concatenate(([0.0], np.cumsum([one.u[-1] + 1.0 for one in pieces])[:-1]))
        u = np.concatenate([one.u + by for one, by in zip(pieces, begin, strict=True)])
        curve = pieces[0].curve
        if len(pieces) > 1:
            powers = [np.concatenate((one.curve.c, _extend_end(one.curve)), axis=1) for one in pieces]
            curve = type(curve)(np.concatenate(powers, axis=1)[:, :-1], u)
        return cls(
            lines=lines,
            curve=curve,
            u=u,
            s_mm=np.concatenate([one.arc.values + by for one, by in zip(pieces, first, strict=True)]),
            first_mm=first[:, None],
            last_mm=(first + lengths)[:, None],
        )

    def find_nearest_samples(self, points: Floats) -> Floats:
        """Arc lengths (k, n) of the nearest of some places on each line to points (k, n, 2)."""
        found = []
        for line, of_line, first in zip(self.lines, points, self.first_mm, strict=True):
            ends, lengths = line._pieces.ends, line._pieces.arc.values
            y, z, far = ends.y[::_SAMPLE_STRIDE], ends.z[::_SAMPLE_STRIDE], first + lengths[::_SAMPLE_STRIDE]
            parts = np.array_split(of_line, max(1, len(of_line) // _POINTS_PER_BLOCK))
            nearest = [((part[:, :1] - y) ** 2 + (part[:, 1:] - z) ** 2).argmin(axis=1) for part in parts]
            found.append(far[np.concatenate(nearest)])
        return np.stack(found)


def _extend_end(curve: PPoly) -> Floats:
    """Powers of a piece that stays at the end of a curve."""
    stays = np.zeros_like(curve.c[:, :1])
    stays[-1] = curve(curve.x[-1])
    return np.asarray(stays)


@dataclass(frozen=True, kw_only=True, eq=False)
class FootPoints:
    """For each of n points the nearest one on a line, or on each of k lines.

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

    def of(self, number: int) -> FootPoints:
        """Those on one of the lines."""
        return FootPoints(**{name: values[number] for name, values in vars(self).items()})

    @property
    def usual_mm(self) -> list[float]:
        """How far the points lie off each of the lines, usually."""
        return [estimate_distance_mm(off[inside]) for off, inside in zip(self.off_mm, self.inside, strict=True)]


def foot_points(line: Profile, points: Floats) -> FootPoints:
    """The nearest points of a line to points (n, 2) that lie a few mm off it at most."""
    return _foot_points(Lines.of(line), points[None]).of(0)


def _foot_points(
    lines: Lines, points: Floats, *, near: FootPoints | None = None, steps: int = _FOOT_STEPS
) -> FootPoints:
    """The nearest points of k lines to points (k, n, 2); `near` has places to begin at."""
    s = lines.find_nearest_samples(points) if near is None else near.s_mm + lines.first_mm
    for _ in range(steps):
        # as far along the line as its table knows: the point itself lies on the line
        at = lines.curve(np.interp(s, lines.s_mm, lines.u))
        p = CurvePoints(*(at[..., k] for k in range(6)))
        speed = np.hypot(p.dy, p.dz)
        t_y, t_z, off_y, off_z = p.dy / speed, p.dz / speed, points[..., 0] - p.y, points[..., 1] - p.z
        along, across = off_y * t_y + off_z * t_z, off_z * t_y - off_y * t_z
        # beyond the centre of a tight arc there is no foot point to converge to; np.clip takes as long as five of these
        step = along / np.maximum(1.0 - p.curvature_per_mm * across, 0.2)
        # points beyond an end would go on for ever
        further = s + np.minimum(np.maximum(step, -1.0), 1.0)
        further = np.minimum(np.maximum(further, lines.first_mm), lines.last_mm)
        if not (np.abs(further - s) > 1e-10).any():
            break
        s = further
    return FootPoints(
        s_mm=s - lines.first_mm,
        points=np.stack((p.y, p.z), axis=-1),
        normals=np.stack((-t_z, t_y), axis=-1),
        off_mm=across,
        inside=(np.abs(along) < 1e-6) & (s >= lines.first_mm) & (s <= lines.last_mm),
    )


def register(line: Profile, points: Floats) -> tuple[Registration, float]:
    """Turn and move a line onto points (n, 2), worn ones counting less; with the usual distance that is left (mm)."""
    registrations, usual, _ = register_all(Lines.of(line), points, [Registration(shift=first_shift(line, points))])
    return registrations[0], usual[0]


def register_all(
    lines: Lines, points: Floats, begin: Sequence[Registration], *, steps: int = _MOST_STEPS
) -> tuple[list[Registration], list[float], FootPoints]:
    """`register` for each of the lines, from given registrations; and the points over the lines then."""
    found, feet, moves = list(begin), None, np.ones(len(begin), dtype=bool)
    for _ in range(steps):
        moved = _to_references(found, points)
        feet = _foot_points(lines, moved, near=feet, steps=_FIRST_FOOT_STEPS)
        reach = _HUBER_FACTOR * np.array(feet.usual_mm)[:, None]
        weight = np.where(feet.inside, np.minimum(1.0, reach / np.maximum(np.abs(feet.off_mm), 1e-12)), 0.0)
        further, size = _improve_registrations(found, moved, feet, weight)
        found = [then if goes_on else one for one, then, goes_on in zip(found, further, moves, strict=True)]
        # one that has arrived stays: along a straight line rounding alone would carry it away
        moves &= size >= 1e-7
        if not moves.any():
            break
    feet = _foot_points(lines, _to_references(found, points))
    enough = np.count_nonzero(feet.inside, axis=1) > 0.8 * len(points)
    usual_mm = [off if over else math.inf for off, over in zip(feet.usual_mm, enough, strict=True)]
    return found, usual_mm, feet


def _to_references(found: Sequence[Registration], points: Floats) -> Floats:
    """Points (k, n, 2) that lie on each reference as the points (n, 2) do on it as it is registered."""
    return np.stack([one.to_reference(points) for one in found])


def _improve_registrations(
    found: Sequence[Registration], moved: Floats, feet: FootPoints, weight: Floats
) -> tuple[list[Registration], Floats]:
    """A Gauss-Newton step from each registration by which points are moved onto a line, and how far it goes."""
    # moving the points by -shift and turning them by -turn, to first order about where they are
    lever = moved[..., 0] * feet.normals[..., 1] - moved[..., 1] * feet.normals[..., 0]
    matrix = np.sqrt(weight)[..., None] * np.concatenate((feet.normals, lever[..., None]), axis=-1)
    steps = (np.linalg.pinv(matrix, rcond=1e-6) @ (np.sqrt(weight) * feet.off_mm)[..., None])[..., 0]
    steps = np.minimum(np.maximum(steps, -_LARGEST_STEP), _LARGEST_STEP)
    further = []
    for one, step in zip(found, steps, strict=True):
        turn = min(max(one.turn_rad + float(step[2]), -_LARGEST_TURN_RAD), _LARGEST_TURN_RAD)
        added = one.rotate(step[None, :2])[0]
        further.append(Registration(turn_rad=turn, shift=(one.shift[0] + added[0], one.shift[1] + added[1])))
    return further, np.abs(steps).max(axis=1)


def select_unworn(
    lines: Lines, points: Floats, begin: Sequence[Registration], noise_mm: float
) -> tuple[FootPoints, list[float]]:
    """Points (n, 2) over lines that lie on those beside their wear, and the part of them that each does lie on.

    Wear that is deep and wide pulls a line off the rest, however little it counts. Here what is off by more than the
    noise ends up not counting at all (Geman and McClure 1987), from some tenths of a millimetre down.
    """
    found, feet, reach = list(begin), None, _FIRST_REACH_MM
    while reach > _LAST_REACH_OVER_NOISE * noise_mm:
        moved = _to_references(found, points)
        feet = _foot_points(lines, moved, near=feet, steps=_FIRST_FOOT_STEPS)
        weight = np.where(feet.inside, 1.0 / (1.0 + (feet.off_mm / reach) ** 2) ** 2, 0.0)
        found, _ = _improve_registrations(found, moved, feet, weight)
        reach *= _REACH_FACTOR
    feet = _foot_points(lines, _to_references(found, points))
    unworn = (feet.inside & (np.abs(feet.off_mm) < _UNWORN_OVER_NOISE * noise_mm)).mean(axis=1)
    return feet, [float(part) for part in unworn]


def estimate_distance_mm(off: Floats) -> float:
    """Standard deviation of distances (n,) in mm by their median, so that worn points hardly count."""
    return float(np.median(np.abs(off))) / 0.6745 + 1e-9 if off.size else math.inf


def first_shift(line: Profile, points: Floats) -> tuple[float, float]:
    """The crowns of two rails, or the flange tips of two wheels, on one another."""
    table = line._pieces.ends
    if line.kind == "rail":
        i, j = int(np.argmax(table.z)), int(np.argmax(points[:, 1]))
        # a crown is flat: across, the middles of the heads are surer
        middle = 0.5 * float(np.ptp(points[:, 0]) - np.ptp(table.y)) + float(points[:, 0].min() - table.y.min())
        return middle, float(points[j, 1] - table.z[i])
    i, j = int(np.argmin(table.z)), int(np.argmin(points[:, 1]))
    if min(np.ptp(table.z), np.ptp(points[:, 1])) < 15.0:
        return 0.0, 0.0
    return float(points[j, 0] - table.y[i]), float(points[j, 1] - table.z[i])
