"""A line with a usable curvature from measured points: smoothed along the arc, held against the library's lines.

The curvature of a spline through points with an error e every h carries 6 e / h^2, for 0.01 mm every 0.2 mm 500 times
that of a rail head. A smoothing spline of the wave length w carries 0.3 e sqrt(h) (2 pi / w)^2.5 only, and blurs
what is shorter than w. The head of a rail has both: radii of 300 mm and junctions to 13 mm. So the points are held
against the nearest profile of the library, if they support one, and their deviation from it is smoothed, which is what
wear and tolerances are; otherwise the line itself.

Kim and Gu (2004) for the score by which the width is chosen: generalised cross-validation in which a degree of freedom
costs more, as the plain one follows the noise in one case of ten.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.profiles.curve import Kind, Profile
from fecontact.profiles.library import find, load, names
from fecontact.profiles.points import SPLINE_NOISE, Points, apart, checked, profile_of, spline_through
from fecontact.profiles.reading import Reading
from fecontact.profiles.segments import (
    Arc,
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

# --- Points held against an exact line: where the line must lie to fit them best, and how far they are off it.

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


# --- A line with a usable curvature from measured points: smoothing splines along the arc, of a stated width.

NARROWEST_MM, WIDEST_MM = 2.0, 60.0
"""Widths among which one is chosen. No waves longer than a rail's head are told from its shape."""
_STEPS = 12
# What a degree of freedom costs in the score. With 1.4 (Kim and Gu) 2 of 100 noisy sections got a width of a third of
# what they allow; with 2 none did.
_COST = 2.0
# A first smoothing, by which the width follows the curvature, and the curvature below which a line is flat to it.
_PILOT_MM = 8.0
_FLAT_PER_MM = 1.0 / 300.0
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
    """Points (n, 2) over the length of the chords between them.

    The width follows the curvature, with the root of its radius: a head has radii of 13 and of 300 mm, and what would
    blur a corner leaves the noise in the top.
    """
    s = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    pilot = smoothed_by(s, points, _PILOT_MM)
    first, second = pilot(s, 1), pilot(s, 2)
    speed = np.hypot(*first.T)
    normals = np.column_stack((-first[:, 1], first[:, 0])) / speed[:, None]
    bend = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / speed**3
    # over some mm, and far from both ends of the scale: the pilot's own noise is no curvature
    from scipy.ndimage import gaussian_filter1d

    spread = np.maximum(gaussian_filter1d(bend, _PILOT_MM * s.size / s[-1], mode="nearest"), _FLAT_PER_MM)
    return Held(points=points, s_mm=s, values=points, normals=normals, relative_width=np.sqrt(_FLAT_PER_MM / spread))


@lru_cache(maxsize=8)
def line_of(segments: tuple[Segment, ...]) -> Profile:
    """The nominal line alone, once for all lines that its points allow: its table takes longer than the foot points."""
    return Profile(name="nominal", kind="rail", segments=segments)


def slid(held: Held, width_mm: float) -> Held:
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
        rest = values - least_bending(s, values, normals, width_mm)
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


def smoothed(held: Held, *, width_mm: float | None, noise_mm: float | None) -> tuple[Measured, float]:
    """What points are off the line that they are held against, smoothed; with the score of its width, least is best.

    Width and noise (mm) are found from the points where they are None.
    """
    widths = _widths(held.s_mm) if width_mm is None else [width_mm]
    fits = []
    # from the widest, each from the places of the one before
    for width in sorted(widths, reverse=True):
        held = slid(held, width)
        fits.append((held, width, *_fit(held, width, noise_mm)))
    held, best, residual, score = min(fits, key=lambda fit: fit[-1])
    scatter = noise_of(held.points) if noise_mm is None else noise_mm
    made = Measured(
        held=held,
        residual_mm=residual,
        noise_mm=scatter,
        width_mm=best,
        curvature_noise_per_mm=_curvature_noise(held, best, scatter),
    )
    return made, score


def _widths(s: Floats) -> list[float]:
    """Widths to choose from: none below what four points show."""
    low = max(NARROWEST_MM, 4.0 * (s[-1] - s[0]) / (s.size - 1))
    return [low * (max(WIDEST_MM, low) / low) ** (k / (_STEPS - 1)) for k in range(_STEPS)]


def _fit(held: Held, width: float, noise: float | None) -> tuple[Floats, float]:
    """How far points are off a line of one width, and its score.

    That is cross-validation, or with a known noise Mallows' estimate of the error.
    """
    s, values = held.s_mm, held.values
    probes = np.random.default_rng(SEED).choice([-1.0, 1.0], size=(s.size, _PROBES))
    fitted = smoothed_by(s, np.column_stack((values, probes)), width, held.relative_width)(s)
    # the trace of the smoother (Hutchinson), which is its degrees of freedom
    freedom = float(np.mean((probes * fitted[:, 2:]).sum(axis=0)))
    residual = np.asarray(((values - fitted[:, :2]) * held.normals).sum(axis=1))
    off = float((residual**2).mean())
    if noise is None:
        return residual, off / max(1.0 - _COST * freedom / s.size, 1e-3) ** 2
    return residual, off + 2.0 * _COST * noise**2 * freedom / s.size


def _curvature_noise(held: Held, width: float, noise: float) -> Floats:
    s = held.s_mm
    draws = noise * np.random.default_rng(SEED).normal(size=(s.size, _DRAWS))
    return np.asarray(np.sqrt((smoothed_by(s, draws, width, held.relative_width)(s, 2) ** 2).mean(axis=1)))


def choose(candidates: Sequence[tuple[Measured, float]]) -> Measured:
    """The candidate of the best score; the first one of those that are as good."""
    best = min(score for _, score in candidates)
    return next(measured for measured, score in candidates if score <= best * (1.0 + 1e-9))


# --- Lines made of smoothed points: the one of the points, others that they allow, and a part of a deviation.

Variant = Literal["narrow", "double"] | int
"""Another line that the points allow: of 0.71 or double the width, or from points with other noise of the same size."""


def segments_of(measured: Measured) -> tuple[Segment, ...]:
    """The pieces of a smoothed line: one for each segment of the nominal profile, or a single one."""
    held = measured.held
    field = smoothed_by(held.s_mm, held.values, measured.width_mm, held.relative_width)
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
            v_from, v_to = (float(v) for v in _exact_local(whole, np.array([low, high])))
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


@lru_cache(maxsize=64)
def variant(profile: Profile, which: Variant) -> Profile:
    """Another line that the points of a smoothed profile allow; the profile itself where it has none."""
    measured = profile.measured
    if measured is None:
        return profile
    if which == "narrow":
        changed = _with_width(measured, math.sqrt(0.5) * measured.width_mm)
    elif which == "double":
        changed = _with_width(measured, 2.0 * measured.width_mm)
    else:
        rng = np.random.default_rng([SEED, int(which), 0 if profile.kind == "rail" else 1])
        points, normals = _at(profile, measured.s_mm)
        drawn = points + (measured.noise_mm * rng.normal(size=measured.s_mm.size))[:, None] * normals
        changed = _with_width(replace(measured, held=_moved_to(drawn, measured.held)), measured.width_mm)
    return replace(profile, segments=segments_of(changed), measured=changed)


def _with_width(measured: Measured, width_mm: float) -> Measured:
    return replace(measured, width_mm=width_mm, held=slid(measured.held, width_mm))


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


def _exact_local(segment: Smoothed, s: Floats) -> Floats:
    v = np.interp(s, (segment.s_from, segment.s_to), (0.0, 1.0))
    for _ in range(20):
        before, v = v, np.clip(v - (segment._arc(v) - s) / segment._arc(v, 1), 0.0, 1.0)
        if np.array_equal(before, v):
            break
    return v


def _length(base: Line | Arc | Polynomial) -> float:
    if isinstance(base, Line):
        return math.hypot(base.end[0] - base.start[0], base.end[1] - base.start[1])
    if isinstance(base, Arc):
        return base.radius * abs(base.angle_to - base.angle_from)
    return float(polynomial_arc(base, 0.0, 1.0)(1.0))


# --- Which profile of the library measured points are, worn or not, and the line that is smoothed from them.

# A spline through points with less noise in its curvature than this is as good as the points (1/mm): 1 % of R 300.
_CURVATURE_NOISE_PER_MM = 3e-5
# Points for the first look at a profile, and profiles that get a second one.
_FEW_POINTS, _MOST_CLOSE = 60, 3
# Steps of that: from 50 mrad and some mm off the true one of all rails is nearest after four.
_FIRST_STEPS = 6
# A profile that the points are usually farther off is another one.
_FARTHEST_MM = 2.0
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
    """

    name: str
    registration: Registration
    usual_mm: float
    farthest_mm: float
    at_y_mm: float


def nearest(points: Floats, kind: Kind, among: tuple[str, ...] | None = None) -> list[Nearest]:
    """Profiles of the library that points (n, 2) may be, the nearest first."""
    few = points[:: max(1, len(points) // _FEW_POINTS)]
    known = names(kind) if among is None else among
    if len(known) > _MOST_CLOSE:
        known = tuple(sorted(known, key=lambda name: register(load(name), few, steps=_FIRST_STEPS)[1]))
    found = []
    for name in known[:_MOST_CLOSE]:
        registration, usual = register(load(name), points)
        if usual > _FARTHEST_MM:
            continue
        feet = foot_points(load(name), registration.to_reference(points))
        off = np.where(feet.inside, np.abs(feet.off_mm), 0.0)
        at = int(np.argmax(off))
        found.append(
            Nearest(
                name=name,
                registration=registration,
                usual_mm=usual,
                farthest_mm=float(off[at]),
                at_y_mm=float(points[at, 0]),
            )
        )
    return sorted(found, key=lambda one: one.usual_mm)


def line_through(given: Points, reading: Reading) -> Profile:
    """The line through points that are checked here: smoothed, or splines where they have no noise or are to be exact.

    Raises
    ------
    InputError
        The points do not look like a running surface; or the nominal profile that is asked for is not in the library,
        or they do not lie over it.
    """
    given = checked(given, repair=reading.repair)
    if reading.smoothing_mm == 0.0 or len(given.points) < 20:
        return spline_through(given)
    points = apart(given.points, _CLOSE_TO_SPACING * _spacing_mm(given.points))
    spacing = _spacing_mm(points)
    asked = reading.smoothing_mm is not None or reading.noise_mm is not None or reading.nominal not in ("auto", "none")
    if not asked and SPLINE_NOISE * noise_of(points) / spacing**2 < _CURVATURE_NOISE_PER_MM:
        return spline_through(given)
    measured = _smoothed(replace(given, points=points), reading)
    return profile_of(
        given, segments_of(measured), [_note(measured, reading), *_choices(measured, given.kind)], measured
    )


def _spacing_mm(points: Floats) -> float:
    return float(np.median(np.hypot(*np.diff(points, axis=0).T)))


def _smoothed(given: Points, reading: Reading) -> Measured:
    """Points as a smoothed deviation from the nearest profiles of the library, or by themselves, whichever is best."""
    smooth = partial(smoothed, width_mm=reading.smoothing_mm, noise_mm=reading.noise_mm)
    if reading.nominal == "none":
        return smooth(alone(given.points))[0]
    among = None if reading.nominal == "auto" else (find(reading.nominal, given.kind),)
    close = nearest(given.points, given.kind, among)[:2]
    held = [against(load(one.name), one.registration, given.points) for one in close]
    candidates = [smooth(one) for one in held if one is not None]
    if among is None:
        return choose([*candidates, smooth(alone(given.points))])
    if not candidates:
        raise InputError(
            f"{given.name}: the points do not lie over {among[0]} within {_FARTHEST_MM:g} mm, or reach beyond its"
            " ends; give another nominal profile, or none"
        )
    return candidates[0][0]


def _choices(made: Measured, kind: Kind) -> list[str]:
    """What is taken for granted of points that are held against a profile of the library, and how to take it back."""
    if not made.nominal:
        return []
    said = []
    if load(made.nominal).junctions:
        said.append(
            f"where the curvature of {made.nominal} jumps, that of the {kind} is taken to jump too:"
            f" --{kind}-nominal none takes the points alone"
        )
    turn_rad = made.held.registration.turn_rad
    near = [one for one in _USUAL_CANT if abs(abs(turn_rad) * one - 1.0) < _CANT_CLOSE]
    if kind == "rail" and near:
        said.append(
            f"{made.nominal} lies on the points turned by {1e3 * turn_rad:+.1f} mrad, near 1:{near[0]}:"
            " is the rail canted in the file already? Then give --inclination none"
        )
    return said


def _note(made: Measured, reading: Reading) -> str:
    largest = float(np.hypot(*made.held.values.T).max())
    of = f"its deviation from {made.nominal} (at most {largest:.2g} mm)" if made.nominal else "the line"
    how = "as given" if reading.smoothing_mm is not None else "from the noise of the points"
    middle = float(np.median(made.curvature_noise_per_mm))
    return (
        f"smoothed from {len(made.points)} points with {1e3 * made.noise_mm:.2g} um of noise: {of}, over waves of"
        f" {made.width_mm:.3g} mm ({how}); curvature uncertain by {middle:.1g} /mm from the noise"
    )
