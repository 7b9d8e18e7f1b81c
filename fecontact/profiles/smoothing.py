"""A line with a usable curvature from measured points: smoothed along the arc over a stated length.

The curvature of a spline through points with an error e every h carries 6 e / h^2, for 0.01 mm every 0.2 mm 500 times
the curvature of a rail head. A smoothing spline of the wave length w carries 0.3 e sqrt(h) (2 pi / w)^2.5 only. It
blurs what is shorter than w. Practice smooths measured rails and wheels over 4 to 8 mm. Points that are certainly a
profile of the library, little worn, are smoothed as their deviation from it: its junctions stay, and noise allows more.

Kim and Gu (2004) for the score by which the filter length is chosen: generalised cross-validation in which a degree of
freedom costs more, as the plain one follows the noise in one case of ten.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.profiles.curve import Kind, Profile
from fecontact.profiles.library import find, load, names
from fecontact.profiles.points import (
    LOWER_MM,
    Points,
    apart,
    checked,
    counted,
    is_exact,
    lower_on_field_side_mm,
    profile_of,
    spacing_mm,
    spline_through,
)
from fecontact.profiles.reading import Reading, mirror_remedy, mirror_settled
from fecontact.profiles.segments import (
    Arc,
    CurvePoints,
    Held,
    Line,
    Measured,
    Polynomial,
    Registration,
    Segment,
    Smoothed,
    least_bending,
    noise_of,
    polynomial_arc,
    smoothed_by,
)

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

# --- Points held against an exact line: where the line must lie to fit them best, and how far they are off it.

# Gauss-Newton steps; from 5 mm and 50 mrad off they end after eight.
_MOST_STEPS = 20
# Points that lie off by more than so many times the usual are worn and count less (Huber 1964).
_HUBER = 2.0
# How far off points may be that still count beside wear, at first and at last (in parts of their noise), and how it
# falls; and within how much of their noise nearly all unworn ones lie.
_FIRST_REACH_MM, _REACH, _REACH_FALLS, _WITHIN = 0.3, 1.5, 0.8, 3.0
# Lines of the library are drawings, and no surface is made to less.
_LEAST_NOISE_MM = 0.001
# Of a Gauss-Newton step, across, upwards (mm) and turned (rad).
_LARGEST_STEP = np.array([3.0, 3.0, 0.05])
# No rail is inclined by more.
_LARGEST_TURN_RAD = 0.2
_FOOT_STEPS = 8
# While the line still moves, fewer do: each begins at the feet of the one before.
_FIRST_FOOT_STEPS = 3
# Points whose nearest ones are looked up together, and of which ends of pieces.
_AT_ONCE, _APART = 500, 4


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
            powers = [np.concatenate((one.curve.c, _end_of(one.curve)), axis=1) for one in pieces]
            curve = type(curve)(np.concatenate(powers, axis=1)[:, :-1], u)
        return cls(
            lines=lines,
            curve=curve,
            u=u,
            s_mm=np.concatenate([one.arc.values + by for one, by in zip(pieces, first, strict=True)]),
            first_mm=first[:, None],
            last_mm=(first + lengths)[:, None],
        )

    def near(self, points: Floats) -> Floats:
        """Arc lengths (k, n) of the nearest of some places on each line to points (k, n, 2)."""
        found = []
        for line, of_line, first in zip(self.lines, points, self.first_mm, strict=True):
            ends, lengths = line._pieces.ends, line._pieces.arc.values
            y, z, far = ends.y[::_APART], ends.z[::_APART], first + lengths[::_APART]
            parts = np.array_split(of_line, max(1, len(of_line) // _AT_ONCE))
            nearest = [((part[:, :1] - y) ** 2 + (part[:, 1:] - z) ** 2).argmin(axis=1) for part in parts]
            found.append(far[np.concatenate(nearest)])
        return np.stack(found)


def _end_of(curve: PPoly) -> Floats:
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
        return [_usual(off[inside]) for off, inside in zip(self.off_mm, self.inside, strict=True)]


def foot_points(line: Profile, points: Floats) -> FootPoints:
    """The nearest points of a line to points (n, 2) that lie a few mm off it at most."""
    return _foot_points(Lines.of(line), points[None]).of(0)


def _foot_points(
    lines: Lines, points: Floats, *, near: FootPoints | None = None, steps: int = _FOOT_STEPS
) -> FootPoints:
    """The nearest points of k lines to points (k, n, 2); `near` has places to begin at."""
    s = lines.near(points) if near is None else near.s_mm + lines.first_mm
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
    registrations, usual, _ = _registered(Lines.of(line), points, [Registration(shift=first_shift(line, points))])
    return registrations[0], usual[0]


def _registered(
    lines: Lines, points: Floats, begin: Sequence[Registration], *, steps: int = _MOST_STEPS
) -> tuple[list[Registration], list[float], FootPoints]:
    """`register` for each of the lines, from given registrations; and the points over the lines then."""
    found, feet, moves = list(begin), None, np.ones(len(begin), dtype=bool)
    for _ in range(steps):
        moved = _to_references(found, points)
        feet = _foot_points(lines, moved, near=feet, steps=_FIRST_FOOT_STEPS)
        reach = _HUBER * np.array(feet.usual_mm)[:, None]
        weight = np.where(feet.inside, np.minimum(1.0, reach / np.maximum(np.abs(feet.off_mm), 1e-12)), 0.0)
        further, size = _moved_by(found, moved, feet, weight)
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


def _moved_by(
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
        added = one.turned(step[None, :2])[0]
        further.append(Registration(turn_rad=turn, shift=(one.shift[0] + added[0], one.shift[1] + added[1])))
    return further, np.abs(steps).max(axis=1)


def _beside_wear(
    lines: Lines, points: Floats, begin: Sequence[Registration], noise_mm: float
) -> tuple[FootPoints, list[float]]:
    """Points (n, 2) over lines that lie on those beside their wear, and the part of them that each does lie on.

    Wear that is deep and wide pulls a line off the rest, however little it counts. Here what is off by more than the
    noise ends up not counting at all (Geman and McClure 1987), from some tenths of a millimetre down.
    """
    found, feet, reach = list(begin), None, _FIRST_REACH_MM
    while reach > _REACH * noise_mm:
        moved = _to_references(found, points)
        feet = _foot_points(lines, moved, near=feet, steps=_FIRST_FOOT_STEPS)
        weight = np.where(feet.inside, 1.0 / (1.0 + (feet.off_mm / reach) ** 2) ** 2, 0.0)
        found, _ = _moved_by(found, moved, feet, weight)
        reach *= _REACH_FALLS
    feet = _foot_points(lines, _to_references(found, points))
    unworn = (feet.inside & (np.abs(feet.off_mm) < _WITHIN * noise_mm)).mean(axis=1)
    return feet, [float(part) for part in unworn]


def _usual(off: Floats) -> float:
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


# --- A line with a usable curvature from measured points: smoothing splines along the arc, of a stated filter length.

PRACTICE_MM = (4.0, 8.0)
"""Filter lengths over which measured profiles are usually smoothed."""
# Filter lengths for the deviation from a profile of the library. No longer waves are told from a rail's head.
_NARROWEST_MM, _WIDEST_MM, _STEPS = 2.0, 60.0, 12
# Where noise asks for more than what is usual, the filter follows the curvature, from what is flat.
_FOLLOWING_STEPS, _FLAT_PER_MM = 8, 1.0 / 300.0
# What a degree of freedom costs in the score. With 1.4 (Kim and Gu) 2 of 100 noisy sections got a filter of a third of
# what they allow; with 2 none did.
_COST = 2.0
# The running part of a line, which the filter is chosen for, is flatter; distances beyond so many times the usual are
# of dents and of places where two scans meet.
_RUNNING_SLOPE, _DENT = 0.4, 4.0
_FEWEST_RUNNING = 40
_PILOT_MM = 8.0
_PROBES = 6
_DRAWS = 48
SEED = 14
_SLIDES = 4


def against(reference: Profile, registration: Registration, points: Floats) -> Held | None:
    """Points (n, 2) over a registered reference; None where too few of them lie over it."""
    feet = foot_points(reference, registration.to_reference(points))
    over = feet.inside & np.concatenate(([True], np.diff(np.maximum.accumulate(feet.s_mm)) > 1e-9))
    if np.count_nonzero(over) < 0.8 * len(points):
        return None
    return Held(
        points=points[over],
        s_mm=feet.s_mm[over],
        values=points[over] - registration.from_reference(feet.points[over]),
        normals=registration.turned(feet.normals[over]),
        nominal=reference.name,
        registration=registration,
        reference=reference.segments,
    )


def alone(points: Floats) -> Held:
    """Points (n, 2) over the length of the chords between them."""
    s = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    first = smoothed_by(s, points, _PILOT_MM)(s, 1)
    normals = np.column_stack((-first[:, 1], first[:, 0])) / np.hypot(*first.T)[:, None]
    return Held(points=points, s_mm=s, values=points, normals=normals)


@lru_cache(maxsize=8)
def line_of(segments: tuple[Segment, ...]) -> Profile:
    """The nominal line alone, once for all lines that its points allow: its table takes longer than the foot points."""
    return Profile(name="nominal", kind="rail", segments=segments)


def slid(held: Held, filter_mm: float) -> Held:
    """Points at the places of their nominal line from which a smooth displacement leads to them, and not at its feet.

    A displacement across the nominal turns with its normal, and has a kink wherever the curvature of that jumps: under
    1 mm of wear a smoothing would blur it into a wrong curvature. What counts is how far points are off the smoothed
    line across it; where along the nominal they come from, the least bending displacement says. So the junctions of
    the nominal move with the wear.
    """
    if not held.reference:
        return held
    line, s = line_of(held.reference), held.s_mm
    beside_end = 1e-3 * np.arange(s.size)
    for _ in range(_SLIDES):
        values, tangent = _from_nominal(line, held, s)
        normals = np.column_stack((-tangent[:, 1], tangent[:, 0]))
        rest = values - least_bending(s, values, normals, filter_mm)
        further = s + np.clip((rest * tangent).sum(axis=1), -1.0, 1.0)
        # beyond an end there is no place: the last points stay beside it, one after another
        further = np.clip(further, beside_end, line.length_mm - beside_end[::-1])
        if np.diff(further).min() <= 1e-9:
            break
        s = further
    values, tangent = _from_nominal(line, held, s)
    return replace(held, s_mm=s, values=values, normals=np.column_stack((-tangent[:, 1], tangent[:, 0])))


def _from_nominal(line: Profile, held: Held, s: Floats) -> tuple[Floats, Floats]:
    """What points are from the places s of the registered nominal, and its unit tangents there."""
    p = line.evaluate(line.at_arc_length(s))
    tangent = held.registration.turned(np.column_stack((p.dy, p.dz)) / np.hypot(p.dy, p.dz)[:, None])
    return held.points - held.registration.from_reference(np.column_stack((p.y, p.z))), tangent


def smoothed(held: Held, *, filter_mm: float | None, noise_mm: float | None) -> tuple[Measured, float]:
    """What points are off the line that they are held against, smoothed; with the score of its filter, least is best.

    Filter length and noise (mm) are found from the points where they are None.
    """
    fits = []
    # from the longest, each from the places of the one before
    for length in sorted(_lengths(held) if filter_mm is None else [filter_mm], reverse=True):
        held = slid(held, length)
        fits.append((held, length, *_fit(held, length, noise_mm)))
    if filter_mm is None and not held.reference:
        # what noise asks for on the top of a head would blur its corners
        for length in np.geomspace(PRACTICE_MM[1], _WIDEST_MM, _FOLLOWING_STEPS):
            follows = replace(held, relative_filter=_relative(held, length))
            fits.append((follows, float(length), *_fit(follows, length, noise_mm)))
    held, length, residual, freedom, score = min(fits, key=lambda fit: fit[-1])
    inner = _levelled(residual[_running(held)])
    scatter = math.sqrt(float((inner**2).mean()) / max(1.0 - freedom, 0.1)) if noise_mm is None else noise_mm
    made = Measured(
        held=held,
        residual_mm=residual,
        noise_mm=scatter,
        white_mm=noise_of(held.points) if noise_mm is None else noise_mm,
        waves_mm=residual * (noise_mm is None),
        filter_mm=length,
        curvature_noise_per_mm=np.zeros(0),
    )
    draws = _noise_draws(made, [SEED], _DRAWS)
    bent = smoothed_by(held.s_mm, draws, length, held.relative_filter)(held.s_mm, 2)
    return replace(made, curvature_noise_per_mm=np.sqrt((bent**2).mean(axis=1))), score


def _lengths(held: Held) -> list[float]:
    """Filter lengths to choose from: usual lengths, or any length for a deviation, and never below four points."""
    low, high = (_NARROWEST_MM, _WIDEST_MM) if held.reference else PRACTICE_MM
    low = max(low, 4.0 * (held.s_mm[-1] - held.s_mm[0]) / (held.s_mm.size - 1))
    return [float(one) for one in np.geomspace(low, max(low, high), _STEPS if held.reference else 5)]


def _relative(held: Held, filter_mm: float) -> Floats:
    """Filter length at each point over the whole one: with the root of the radius, and not below what is usual.

    A head has radii of 13 and of 300 mm, and what would blur a corner leaves the noise in the top.
    """
    along = np.arctan2(held.normals[:, 1], held.normals[:, 0])
    bend = np.abs(np.gradient(np.unwrap(along), held.s_mm))
    # over some mm: the pilot's own noise is no curvature
    sigma = _PILOT_MM * held.s_mm.size / held.s_mm[-1]
    reach = math.ceil(4.0 * sigma)
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    # scipy.ndimage takes as long to import as a tenth of all this
    spread = np.convolve(np.pad(bend, reach, mode="edge"), bell / bell.sum(), "valid")
    relative = np.sqrt(_FLAT_PER_MM / np.maximum(spread, _FLAT_PER_MM))
    return np.asarray(np.clip(relative, PRACTICE_MM[0] / filter_mm, 1.0))


def _running(held: Held) -> NDArray[np.bool_]:
    """Which points lie on the running part of the line; all where hardly any do."""
    flat = np.abs(held.normals[:, 0]) < _RUNNING_SLOPE * np.abs(held.normals[:, 1])
    return flat if np.count_nonzero(flat) >= _FEWEST_RUNNING else np.ones_like(flat)


def _levelled(off: Floats) -> Floats:
    """Distances (n,) of which those beyond the usual are cut down to that."""
    most = _DENT * _usual(off)
    return np.clip(off, -most, most)


def _fit(held: Held, filter_mm: float, noise: float | None) -> tuple[Floats, float, float]:
    """How far points are off a line of one filter length, its degrees of freedom a point, and its score.

    That is cross-validation on the running part, or with a known noise Mallows' estimate of the error.
    """
    s, values, running = held.s_mm, held.values, _running(held)
    probes = _probes(s.size)
    fitted = smoothed_by(s, np.column_stack((values, probes)), filter_mm, held.relative_filter)(s)
    # the trace of the smoother (Hutchinson), which is its degrees of freedom
    freedom = float(np.mean((probes * fitted[:, 2:])[running]))
    residual = np.asarray(((values - fitted[:, :2]) * held.normals).sum(axis=1))
    off = float((_levelled(residual[running]) ** 2).mean())
    if noise is None:
        return residual, freedom, off / max(1.0 - _COST * freedom, 1e-3) ** 2
    return residual, freedom, off + 2.0 * _COST * noise**2 * freedom


@lru_cache(maxsize=8)
def _probes(number: int) -> Floats:
    return np.random.default_rng(SEED).choice([-1.0, 1.0], size=(number, _PROBES))


def _noise_draws(measured: Measured, seed: Sequence[int], number: int) -> Floats:
    """Distances (n, number) of points from their line that are as those that were measured.

    Each point has an error of its own; waves that neighbours have together keep their place and their size, and get
    another sign and strength every few mm (Shao 2010, the dependent wild bootstrap).
    """
    rng, s = np.random.default_rng(seed), measured.s_mm
    white = measured.white_mm * rng.normal(size=(s.size, number))
    stretch, part = np.divmod(s / measured.filter_mm, 1.0)
    strength = rng.normal(size=(int(stretch[-1]) + 2, number))
    k, turn = stretch.astype(np.intp), 0.5 * math.pi * part[:, None]
    return white + measured.waves_mm[:, None] * (np.cos(turn) * strength[k] + np.sin(turn) * strength[k + 1])


# --- Lines made of smoothed points: the one of the points, others that they allow, and a part of a deviation.


def segments_of(measured: Measured) -> tuple[Segment, ...]:
    """The pieces of a smoothed line."""
    return pieces_of(measured.held, measured.filter_mm)


def pieces_of(held: Held, filter_mm: float) -> tuple[Segment, ...]:
    """The pieces of a line through held points: one for each segment of the nominal profile, or a single one."""
    field = smoothed_by(held.s_mm, held.values, filter_mm, held.relative_filter)
    first, last = float(held.s_mm[0]), float(held.s_mm[-1])
    if not held.reference:
        return (Smoothed(field=field, s_from=first, s_to=last),)
    made: list[Segment] = []
    start = 0.0
    for base in held.reference:
        assert isinstance(base, Line | Arc | Polynomial)
        whole = Smoothed(
            field=field, s_from=start, s_to=start + _length(base), base=base, registration=held.registration
        )
        low, high = max(first, whole.s_from), min(last, whole.s_to)
        start = whole.s_to
        if high - low > 1e-6:
            v_from, v_to = (float(v) for v in whole.local(np.array([low, high])))
            made.append(replace(whole, s_from=low, s_to=high, v_from=v_from, v_to=v_to))
    return tuple(made)


def scaled(profile: Profile, part: float) -> Profile:
    """A smoothed line with a part of its deviation from its nominal profile: 0 is the nominal, 1 the line itself.

    Raises
    ------
    InputError
        The line was not smoothed as a deviation from a nominal profile.
    """
    if profile.measured is None or not profile.measured.nominal:
        raise InputError(
            f"{profile.name} is not known by its deviation from a nominal profile; give a file of measured points, and"
            " the name of the nominal where it is not recognised"
        )
    segments = []
    for segment in profile.segments:
        assert isinstance(segment, Smoothed)
        field = segment.field
        segments.append(replace(segment, field=type(field)(part * field.c, field.x)))
    return replace(profile, segments=tuple(segments), name=f"{profile.name} times {part:g}", measured=None)


@dataclass(frozen=True, kw_only=True)
class OtherLine:
    """Another line that the points of a smoothed profile allow.

    Attributes
    ----------
    profile
        The line itself, as good a profile as any.
    filter_mm, nominal
        Over which wave length it was smoothed, and as the deviation from which profile of the library, if any.
    draw
        Number of the draw of other noise, -1 where it goes through the measured points.
    """

    profile: Profile
    filter_mm: float
    nominal: str
    draw: int = -1


# Draws of other noise among the lines that the points allow.
_OTHER_DRAWS = 4
# How much worse than the own line, by Akaike's criterion, a line may be that points allow (Burnham and Anderson 2002,
# section 2.6: beyond 10 it has essentially no support).
_NO_SUPPORT = 10.0


def other_lines(profile: Profile) -> tuple[OtherLine, ...]:
    """Lines that the points of a smoothed profile allow beside its own; none for exact lines.

    Smoothed over 4, 5.7 and 8 mm, or where the deviation from a profile of the library is smoothed over longer waves,
    over 0.71 and 1.41 times its own length, and without that profile unless the points speak against it; and from
    points with other draws of equally large noise. The draws are reproducible.
    """
    return _other_lines(_ByContent(profile=profile)) if profile.measured is not None else ()


@dataclass(frozen=True, eq=False)
class _ByContent:
    """A smoothed profile, equal to another one with equal points, filter and nominal."""

    profile: Profile

    def _content(self) -> tuple[object, ...]:
        measured = self.profile.measured
        assert measured is not None
        made = (self.profile.kind, self.profile.name, measured.filter_mm, measured.nominal, measured.noise_mm)
        return (*made, measured.points.tobytes(), measured.s_mm.tobytes())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ByContent) and self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())


@lru_cache(maxsize=16)
def _other_lines(one: _ByContent) -> tuple[OtherLine, ...]:
    profile, measured = one.profile, one.profile.measured
    assert measured is not None
    own, (low, high) = measured.filter_mm, PRACTICE_MM
    usual = low <= own <= high and measured.held.relative_filter is None
    lengths = (low, math.sqrt(low * high), high) if usual else (math.sqrt(0.5) * own, math.sqrt(2.0) * own)
    changed = [(replace(measured, filter_mm=length), -1) for length in lengths if abs(length - own) > 0.05 * own]
    if measured.nominal:
        by_itself, score = smoothed(alone(measured.points), filter_mm=None, noise_mm=None)
        if _is_supported(score, measured):
            changed.append((by_itself, -1))
    changed += [(_drawn(profile, measured, k), k) for k in range(_OTHER_DRAWS)]
    found = ((_other(profile, line), line, draw) for line, draw in changed)
    return tuple(
        OtherLine(profile=made, filter_mm=line.filter_mm, nominal=line.nominal, draw=draw)
        for made, line, draw in found
        if made is not None
    )


def _is_supported(score: float, measured: Measured) -> bool:
    """Whether another line with this score is nearly as good as the own one: without a nominal its corners are blunt.

    Waves that neighbouring points have together count as the fewer points that they are.
    """
    *_, own = _fit(measured.held, measured.filter_mm, None)
    by_itself = min(1.0, (measured.white_mm / measured.noise_mm) ** 2) * np.count_nonzero(_running(measured.held))
    return bool(by_itself * math.log(score / own) <= _NO_SUPPORT)


def _other(profile: Profile, changed: Measured) -> Profile | None:
    """The line of differently smoothed points; None if they no longer lie over their nominal profile."""
    try:
        made = replace(changed, held=slid(changed.held, changed.filter_mm))
    except np.linalg.LinAlgError:
        return None
    return replace(profile, segments=segments_of(made), measured=made)


def _drawn(profile: Profile, measured: Measured, number: int) -> Measured:
    """Points of a smoothed line with another draw of equally large noise."""
    points, normals = _at(profile, measured.s_mm)
    seed = [SEED, number, 0 if profile.kind == "rail" else 1]
    noise = _noise_draws(measured, seed, 1)
    return replace(measured, held=_moved_to(points + noise * normals, measured.held))


def _moved_to(points: Floats, held: Held) -> Held:
    """Other points (n, 2) at the same places, held against the same line."""
    return replace(held, points=points, values=held.values + (points - held.points))


def _at(profile: Profile, s: Floats) -> tuple[Floats, Floats]:
    """Points and normals (n, 2) of a smoothed line at places s of what it was smoothed over."""
    points, normals = np.empty((s.size, 2)), np.empty((s.size, 2))
    for segment in profile.segments:
        assert isinstance(segment, Smoothed)
        here = (s >= segment.s_from - 1e-9) & (s <= segment.s_to + 1e-9)
        v = np.clip(_local(segment, s[here]), 0.0, 1.0)
        p = segment.evaluate(v)
        points[here] = np.column_stack((p.y, p.z))
        normals[here] = np.column_stack((-p.dz, p.dy)) / np.hypot(p.dy, p.dz)[:, None]
    return points, normals


def _local(segment: Smoothed, s: Floats) -> Floats:
    grid = np.linspace(0.0, 1.0, 257)
    return np.interp(s, segment._arc(grid), grid)


def _length(base: Line | Arc | Polynomial) -> float:
    if isinstance(base, Line):
        return math.hypot(base.end[0] - base.start[0], base.end[1] - base.start[1])
    if isinstance(base, Arc):
        return base.radius * abs(base.angle_to - base.angle_from)
    return float(polynomial_arc(base, 0.0, 1.0)(1.0))


# --- Which profile of the library measured points are, worn or not, and the line that is smoothed from them.

# Points for the first look at a profile, and profiles that get a second one.
_FEW_POINTS, _MOST_CLOSE = 60, 3
# Steps of that: from 50 mrad and some mm off the true one of all rails is nearest after four.
_FIRST_STEPS = 6
# Digits (of mm) of how near profiles are.
_DIGITS = 9
# A profile that the points are usually farther off is another one.
_FARTHEST_MM = 2.0
# One that they are farther off anywhere is not theirs for certain; nor is one that they are off by more than this, if
# their deviation has shorter waves than they have themselves.
_MOST_WEAR_MM, _UNWORN_MM = 3.0, 0.3
# Nor is one that most points are off: where all that runs is worn, another profile of the same kind fits as well.
_MOST_WORN_ALL_OVER_MM = 0.5
# A profile that so many of the points lie on is theirs, and none that fewer lie on by more than the other part: under
# 3 mm of wear the next one is as near to all of them, and what is off it as smooth.
_UNWORN_PART, _FEWER = 0.65, 0.1
# A head is worn and canted to the gauge side. One that leans outwards by more, is so much lower beside its field side
# or has lost so much more there is mirrored, unless it has lost as much more on its gauge side. A new one canted by
# 1:40 is lower by 1.1 mm; the worn ones of 0.5 mm and more lean by 6 mrad and more.
_OUTWARDS_RAD, _LOST_MM = 0.005, 0.5
# What a side has lost, nine tenths of its points have at most: from so far beside the middle, down to as deep below the
# top (mm) as both sides are measured, and that is nothing where one of them ends sooner.
_BESIDE_MM, _DEEPEST_MM, _LEAST_DEEP_MM, _OF_A_SIDE = 6.0, 14.0, 4.0, 0.9
# Cants of rails (1:n), and how near to one a turn (as a part of it) makes one ask for it.
_USUAL_CANT, _CANT_CLOSE = (20, 30, 40), 0.12
# Points closer than this part of the usual spacing tell nothing about the line between them.
_CLOSE_TO_SPACING = 0.2


@dataclass(frozen=True, kw_only=True)
class Nearest:
    """A profile of the library beside measured points.

    Attributes
    ----------
    usual_mm, farthest_mm
        How far the points lie off it, usually (as a standard deviation) and at most.
    at_y_mm
        Where that is the most.
    unworn
        The part of the points that lie on it beside their wear.
    lost_on_field_side_mm
        How much more of its field side than of its gauge side they have lost; None where one of them is not measured.
    """

    name: str
    registration: Registration
    usual_mm: float
    farthest_mm: float
    at_y_mm: float
    unworn: float
    lost_on_field_side_mm: float | None


def nearest(points: Floats, kind: Kind, among: tuple[str, ...] | None = None) -> list[Nearest]:
    """Profiles of the library that points (n, 2) may be, the nearest first."""
    known, noise = names(kind) if among is None else among, max(noise_of(points), _LEAST_NOISE_MM)
    first = _at_first(points[:: max(1, len(points) // _FEW_POINTS)], known, noise)
    if not first:
        return []
    lines = Lines.of(*map(load, first))
    registrations, usual, over = _registered(lines, points, list(first.values()))
    beside, unworn = _beside_wear(lines, points, registrations, noise)
    found = []
    for number, name in enumerate(first):
        if usual[number] > _FARTHEST_MM:
            continue
        feet = over.of(number)
        off = np.where(feet.inside, np.abs(feet.off_mm), 0.0)
        at = int(np.argmax(off))
        is_beside = unworn[number] > _UNWORN_PART
        found.append(
            Nearest(
                name=name,
                registration=registrations[number],
                usual_mm=usual[number],
                farthest_mm=float(off[at]),
                at_y_mm=float(points[at, 0]),
                unworn=unworn[number],
                lost_on_field_side_mm=_lost_on_field_side_mm(beside.of(number) if is_beside else feet),
            )
        )
    most = max((one.unworn for one in found), default=0.0)
    if most > _UNWORN_PART:
        found = [one for one in found if one.unworn > most - _FEWER]
    return sorted(found, key=lambda one: (round(one.usual_mm, _DIGITS), known.index(one.name)))


def _at_first(few: Floats, known: Sequence[str], noise_mm: float) -> dict[str, Registration]:
    """Profiles that get a second look, the nearest first, and where they lie on few points (n, 2)."""
    profiles = [load(name) for name in known]
    begin = [Registration(shift=first_shift(one, few)) for one in profiles]
    registrations, usual, _ = _registered(Lines.of(*profiles), few, begin, steps=_FIRST_STEPS)
    lies, off = dict(zip(known, registrations, strict=True)), dict(zip(known, usual, strict=True))
    close = [name for name in known if len(known) <= _MOST_CLOSE or off[name] < 2.0 * _FARTHEST_MM]
    # two drawings of one profile are as near, but for rounding: their order is that of the library
    close.sort(key=lambda name: round(off[name], _DIGITS))
    chosen, others = close[:_MOST_CLOSE], close[_MOST_CLOSE:]
    if others:
        # deep wear pulls a profile far off its points, and others nearer
        _, parts = _beside_wear(Lines.of(*map(load, others)), few, [lies[name] for name in others], noise_mm)
        chosen += [name for name, part in zip(others, parts, strict=True) if part > _UNWORN_PART]
    return {name: lies[name] for name in chosen}


def _lost_on_field_side_mm(feet: FootPoints) -> float | None:
    """How much more points have lost of the field side of a head than of its gauge side; None without both sides."""
    y, z = feet.points.T
    sides = [feet.inside & (side * y > _BESIDE_MM) for side in (-1.0, 1.0)]
    level = max(-_DEEPEST_MM, *(float(z[side].min(initial=0.0)) for side in sides))
    if level > -_LEAST_DEEP_MM:
        return None
    gauge, field = (np.quantile(-feet.off_mm[side & (z >= level)], _OF_A_SIDE) for side in sides)
    return float(field - gauge)


def _mirrored(given: Points, reading: Reading, close: Sequence[Nearest] = ()) -> list[str]:
    """What is to be said of a head that is canted or worn to the field side, once it is said whether it is mirrored.

    Raises
    ------
    InputError
        Nothing is said about it; with the options that settle it.
    """
    if given.kind == "wheel":
        return []
    lower = lower_on_field_side_mm(given.points) or 0.0
    near = next((one for one in close if one.lost_on_field_side_mm is not None or one.farthest_mm < _UNWORN_MM), None)
    turn, lost = (near.registration.turn_rad, near.lost_on_field_side_mm or 0.0) if near else (0.0, 0.0)
    if lost > _LOST_MM or (lost > -_LOST_MM and (turn < -_OUTWARDS_RAD or lower > LOWER_MM)):
        found = [f"the head is {lower:.1f} mm lower on its field side than on its gauge side"] * (lower > 0.0)
        found += [f"{near.name} lies on it turned by {1e3 * turn:+.1f} mrad"] if near else []
        found += [f"its field side has lost {lost:.1f} mm more than its gauge side"] * (lost > _LOST_MM)
        said = f"{', and '.join(found)}: it may be worn or canted and mirrored"
        if reading.mirror is None:
            raise InputError(
                f"{given.name}: {said}; a head wears and is canted to its gauge side, y < 0;"
                f" {mirror_remedy(given.kind, mirrored=False)} if it is mirrored, or {mirror_settled(given.kind)} if it"
                " is not"
            )
        return [f"{said}; {mirror_remedy(given.kind, mirrored=True)} if it is" if reading.mirror else said]
    return []


def line_through(given: Points, reading: Reading) -> Profile:
    """The line through points that are checked here: smoothed, or splines where they have no noise or are to be exact.

    Raises
    ------
    InputError
        The points do not look like a running surface; or the nominal profile that is asked for is not in the library,
        or they do not lie over it.
    """
    given = checked(given, reading)
    if reading.filter_mm == 0.0 or len(given.points) < 20:
        return spline_through(replace(given, notes=(*given.notes, *_mirrored(given, reading))))
    points = apart(given.points, _CLOSE_TO_SPACING * spacing_mm(given.points))
    asked = reading.filter_mm is not None or reading.noise_mm is not None or reading.nominal not in ("auto", "none")
    if not asked and is_exact(points):
        return spline_through(replace(given, notes=(*given.notes, *_mirrored(given, reading))))
    named = reading.nominal not in ("auto", "none")
    close = nearest(points, given.kind, (find(reading.nominal, given.kind),) if named else None)
    measured = _smoothed(replace(given, points=points), reading, close)
    crowded = len(given.points) - len(points)
    said = [*_mirrored(given, reading, close), *_left_out(given, measured, crowded)]
    said += [_note(measured, reading), *_choices(measured, given.kind)]
    return profile_of(given, segments_of(measured), said, measured)


def _smoothed(given: Points, reading: Reading, near: Sequence[Nearest]) -> Measured:
    """Points as a smoothed deviation from a profile of the library that is theirs for certain, or by themselves."""
    smooth = partial(smoothed, filter_mm=reading.filter_mm, noise_mm=reading.noise_mm)
    by_itself = smooth(alone(given.points))
    if reading.nominal == "none":
        return by_itself[0]
    if reading.nominal != "auto":
        named = [_deviation(one, given.points, smooth) for one in near]
        if not named or named[0] is None:
            raise InputError(
                f"{given.name}: the points do not lie over {reading.nominal} within {_FARTHEST_MM:g} mm, or reach"
                " beyond its ends; give another nominal profile, or none"
            )
        return named[0][0]
    close = [one for one in near if one.farthest_mm < _MOST_WEAR_MM]
    over = [(one, *made) for one in close if (made := _deviation(one, given.points, smooth)) is not None]
    certain = [
        (one.usual_mm, made, score)
        for one, made, score in over
        if one.farthest_mm < _UNWORN_MM or made.filter_mm >= _on_running_part_mm(by_itself[0])
    ]
    lines = [*certain, (0.0, *by_itself)]
    best = min(score for *_, score in lines)
    # the first one of those that are as good
    usual, measured = next((usual, made) for usual, made, score in lines if score <= best * (1.0 + 1e-9))
    return measured if usual < _MOST_WORN_ALL_OVER_MM else by_itself[0]


def _on_running_part_mm(line: Measured) -> float:
    """The filter length that half of the running part of a line has at most."""
    relative = line.held.relative_filter
    return line.filter_mm * (1.0 if relative is None else float(np.median(relative[_running(line.held)])))


def _deviation(
    one: Nearest, points: Floats, smooth: Callable[[Held], tuple[Measured, float]]
) -> tuple[Measured, float] | None:
    """Points smoothed as their deviation from a profile; None where they do not lie over it."""
    held = against(load(one.name), one.registration, points)
    try:
        return None if held is None else smooth(held)
    except np.linalg.LinAlgError:
        return None


def _choices(made: Measured, kind: Kind) -> list[str]:
    """What is taken for granted of points that are held against a profile of the library, and how to take it back."""
    if not made.nominal:
        return []
    said = []
    if load(made.nominal).junctions:
        said.append(
            f"where the curvature of {made.nominal} jumps, the curvature of the {kind} is taken to jump too:"
            f" --{kind}-nominal none takes the points alone"
        )
    turn_rad = made.held.registration.turn_rad
    near = [one for one in _USUAL_CANT if abs(abs(turn_rad) * one - 1.0) < _CANT_CLOSE]
    if kind == "rail" and near:
        said.append(
            f"{made.nominal} lies on the points turned by {1e3 * turn_rad:+.1f} mrad, near 1:{near[0]}:"
            f" is the rail canted in the file already? Then give --inclination none"
        )
    return said


def _left_out(given: Points, made: Measured, crowded: int) -> list[str]:
    """How many points tell the line nothing, and why."""
    beside = len(given.points) - crowded - len(made.points)
    said = [f"{crowded} that nearly repeat the one before"] * (crowded > 0)
    said += [f"{beside} beyond the ends of {made.nominal}"] * (beside > 0)
    return [f"of {counted(len(given.points), 'point')} left out: {', '.join(said)}"] if said else []


def _note(made: Measured, reading: Reading) -> str:
    # across the line: along it they have only been slid to where they come from
    largest = float(np.abs((made.held.values * made.held.normals).sum(axis=1)).max())
    of = f"its deviation from {made.nominal} (at most {largest:.2g} mm across it)" if made.nominal else "the line"
    how = "as given" if reading.filter_mm is not None else "from the scatter of the points"
    if not made.nominal and reading.filter_mm is None and made.filter_mm == PRACTICE_MM[0]:
        how = "the least that is usual"
    if made.held.relative_filter is not None:
        how = f"from the noise of the points; {PRACTICE_MM[0]:g} mm and more where the line bends"
    middle = float(np.median(made.curvature_noise_per_mm))
    return (
        f"smoothed from {len(made.points)} points that scatter by {1e3 * made.noise_mm:.2g} um: {of}, over waves of"
        f" {made.filter_mm:.3g} mm ({how}); curvature uncertain by {middle:.1g} /mm from that"
    )
