"""A line with a usable curvature from measured points: smoothing splines along the arc (scipy's, of a stated width).

The curvature of a spline through points with an error e every h carries 6 e / h^2, for 0.01 mm every 0.2 mm 500 times
that of a rail head. A smoothing spline of the wave length w carries 0.3 e sqrt(h) (2 pi / w)^2.5 only, and blurs
what is shorter than w. The head of a rail has both: radii of 300 mm and junctions to 13 mm. So the points are held
against the nearest profile of the library, if they support one, and their deviation from it is smoothed, which is what
wear and tolerances are; otherwise the line itself.

Reinsch (1967), smoothing by spline functions; Kim and Gu (2004) for the score by which the width is chosen: generalised
cross-validation in which a degree of freedom costs more, as the plain one follows the noise in one case of ten.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.curve import Arc, Floats, Line, Measured, Polynomial, Profile, Segment, Smoothed, polynomial_arc
from fecontact.profiles.registration import Registration, foot_points

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

Variant = Literal["half", "double"] | int
"""Another line that the points allow: of half or double the width, or from points with other noise of the same size."""
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
_SEED = 14


@dataclass(frozen=True, kw_only=True, eq=False)
class _Fit:
    residual: Floats
    width_mm: float
    score: float


def smoothed_by(s_mm: Floats, values: Floats, width_mm: float, relative: Floats | None = None) -> BSpline:
    """Cubic smoothing spline (scipy) that leaves half of a wave of this length.

    Parameters
    ----------
    s_mm (n,), values (n, k)
        Places along the line, ascending, and what is smoothed there.
    relative (n,)
        Width at each place over `width_mm`; the same everywhere if not given.
    """
    from scipy.interpolate import make_smoothing_spline

    spacing = (s_mm[-1] - s_mm[0]) / (s_mm.size - 1)
    # a weight makes the spline stiffer or softer about its point, with the fourth root as the penalty does
    weights = None if relative is None else relative**-4.0
    return make_smoothing_spline(s_mm, values, w=weights, lam=(width_mm / (2.0 * math.pi)) ** 4 / spacing)


def smoothed_deviation(
    points: Floats, reference: Profile, registration: Registration, *, width_mm: float | None, noise_mm: float | None
) -> tuple[Measured, float] | None:
    """The deviation of points (n, 2) from a registered reference, smoothed; with the score of its width, least is best.

    None where too few of the points lie over the reference.
    """
    feet = foot_points(reference, registration.to_reference(points))
    over = feet.inside & np.concatenate(([True], np.diff(np.maximum.accumulate(feet.s_mm)) > 1e-9))
    if np.count_nonzero(over) < 0.8 * len(points):
        return None
    s, points = feet.s_mm[over], points[over]
    offset = points - registration.from_reference(feet.points[over])
    normals = registration.turned(feet.normals[over])
    return _measured(
        points,
        s,
        offset,
        normals,
        width_mm,
        noise_mm,
        nominal=reference.name,
        turn_rad=registration.turn_rad,
        shift=registration.shift,
        reference=reference.segments,
    )


def smoothed_line(points: Floats, *, width_mm: float | None, noise_mm: float | None) -> tuple[Measured, float]:
    """Points (n, 2) themselves, smoothed over the length of the chords between them.

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
    return _measured(points, s, points, normals, width_mm, noise_mm, relative=np.sqrt(_FLAT_PER_MM / spread))


def _measured(
    points: Floats,
    s: Floats,
    values: Floats,
    normals: Floats,
    width: float | None,
    noise: float | None,
    *,
    nominal: str = "",
    turn_rad: float = 0.0,
    shift: tuple[float, float] = (0.0, 0.0),
    reference: tuple[Segment, ...] = (),
    relative: Floats | None = None,
) -> tuple[Measured, float]:
    widths = _widths(s) if width is None else [width]
    fits = [_fit(s, values, normals, one, noise, relative) for one in widths]
    best = min(fits, key=lambda fit: fit.score)
    scatter = noise_of(points) if noise is None else noise
    made = Measured(
        points=points,
        s_mm=s,
        residual_mm=best.residual,
        noise_mm=scatter,
        width_mm=best.width_mm,
        curvature_noise_per_mm=_curvature_noise(s, best.width_mm, scatter, relative),
        nominal=nominal,
        turn_rad=turn_rad,
        shift=shift,
        reference=reference,
        relative_width=relative,
    )
    return made, best.score


def _widths(s: Floats) -> list[float]:
    """Widths to choose from: none below what four points show."""
    low = max(NARROWEST_MM, 4.0 * (s[-1] - s[0]) / (s.size - 1))
    return [low * (max(WIDEST_MM, low) / low) ** (k / (_STEPS - 1)) for k in range(_STEPS)]


def _fit(
    s: Floats, values: Floats, normals: Floats, width: float, noise: float | None, relative: Floats | None
) -> _Fit:
    """One width and its score: cross-validation, or with a known noise Mallows' estimate of the error."""
    probes = np.random.default_rng(_SEED).choice([-1.0, 1.0], size=(s.size, _PROBES))
    field = smoothed_by(s, np.column_stack((values, probes)), width, relative)
    fitted = field(s)
    # the trace of the smoother (Hutchinson), which is its degrees of freedom
    freedom = float(np.mean((probes * fitted[:, 2:]).sum(axis=0)))
    residual = np.asarray(((values - fitted[:, :2]) * normals).sum(axis=1))
    off = float((residual**2).mean())
    if noise is None:
        score = off / max(1.0 - _COST * freedom / s.size, 1e-3) ** 2
    else:
        score = off + 2.0 * _COST * noise**2 * freedom / s.size
    return _Fit(residual=residual, width_mm=width, score=score)


def _curvature_noise(s: Floats, width: float, noise: float, relative: Floats | None) -> Floats:
    draws = noise * np.random.default_rng(_SEED).normal(size=(s.size, _DRAWS))
    return np.asarray(np.sqrt((smoothed_by(s, draws, width, relative)(s, 2) ** 2).mean(axis=1)))


def noise_of(points: Floats) -> float:
    """Standard deviation of points (n, 2) across their line, from what four neighbours say of each."""
    missed, weight = missed_by_neighbours(points)
    # the median keeps corners, junctions and spikes out; 0.6745 turns it into a standard deviation
    return float(np.median(np.abs(missed) / weight)) / 0.6745 if missed.size else 0.0


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
    weights = [
        np.prod([(at - s[m]) / np.where(s[k] == s[m], 1e-12, s[k] - s[m]) for m in known if m != k], axis=0)
        for k in known
    ]
    guess = sum(w[:, None] * five[k] for w, k in zip(weights, known, strict=True))
    along = five[min(place + 1, 4)] - five[max(place - 1, 0)]
    along = along / np.maximum(np.hypot(*along.T), 1e-12)[:, None]
    off = five[place] - guess
    return off[:, 1] * along[:, 0] - off[:, 0] * along[:, 1], np.sqrt(1.0 + sum(w**2 for w in weights))


def profile_of(measured: Measured, like: Profile) -> Profile:
    """The smoothed line, with name, kind and notes of another profile."""
    values = measured.points
    if measured.reference:
        feet = foot_points(_line_of(measured.reference), _unmoved(measured))
        values = measured.points - _registration(measured).from_reference(feet.points)
    field = smoothed_by(measured.s_mm, values, measured.width_mm, measured.relative_width)
    return replace(like, segments=_segments(measured, field), outline=(), measured=measured)


@lru_cache(maxsize=8)
def _line_of(segments: tuple[Segment, ...]) -> Profile:
    """The nominal line alone, once for all lines that its points allow: its table takes longer than the foot points."""
    return Profile(name="nominal", kind="rail", segments=segments)


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
        segments.append(replace(segment, field=type(field)(field.t, part * field.c, field.k)))
    return replace(profile, segments=tuple(segments), name=f"{profile.name} times {part:g}", measured=None)


@lru_cache(maxsize=64)
def variant(profile: Profile, which: Variant) -> Profile:
    """Another line that the points of a smoothed profile allow; the profile itself where it has none."""
    measured = profile.measured
    if measured is None:
        return profile
    if which == "half":
        return profile_of(replace(measured, width_mm=0.5 * measured.width_mm), profile)
    if which == "double":
        return profile_of(replace(measured, width_mm=2.0 * measured.width_mm), profile)
    rng = np.random.default_rng([_SEED, int(which), 0 if profile.kind == "rail" else 1])
    line = _at(profile, measured.s_mm)
    drawn = line.points + (measured.noise_mm * rng.normal(size=measured.s_mm.size))[:, None] * line.normals
    return profile_of(replace(measured, points=drawn), profile)


@dataclass(frozen=True, kw_only=True, eq=False)
class _OnLine:
    points: Floats
    normals: Floats


def _at(profile: Profile, s: Floats) -> _OnLine:
    """Points and normals of a smoothed line at places s of what it was smoothed over."""
    points, normals = np.empty((s.size, 2)), np.empty((s.size, 2))
    for segment in profile.segments:
        assert isinstance(segment, Smoothed)
        here = (s >= segment.s_from - 1e-9) & (s <= segment.s_to + 1e-9)
        v = np.clip(_local(segment, s[here]), 0.0, 1.0)
        p = segment.evaluate(v)
        points[here] = np.column_stack((p.y, p.z))
        normals[here] = np.column_stack((-p.dz, p.dy)) / np.hypot(p.dy, p.dz)[:, None]
    return _OnLine(points=points, normals=normals)


def _local(segment: Smoothed, s: Floats) -> Floats:
    grid = np.linspace(0.0, 1.0, 257)
    return np.interp(s, segment._arc(grid), grid)


def _registration(measured: Measured) -> Registration:
    return Registration(turn_rad=measured.turn_rad, shift=measured.shift)


def _unmoved(measured: Measured) -> Floats:
    return _registration(measured).to_reference(measured.points)


def _segments(measured: Measured, field: BSpline) -> tuple[Segment, ...]:
    """The pieces of a smoothed line: one for each segment of the nominal profile, or a single one."""
    first, last = float(measured.s_mm[0]), float(measured.s_mm[-1])
    if not measured.reference:
        return (Smoothed(field=field, s_from=first, s_to=last),)
    made: list[Segment] = []
    start = 0.0
    for base in measured.reference:
        assert isinstance(base, Line | Arc | Polynomial)
        whole = Smoothed(field=field, s_from=start, s_to=start + _length(base), base=base)
        low, high = max(first, whole.s_from), min(last, whole.s_to)
        start = whole.s_to
        if high - low > 1e-6:
            v_from, v_to = (float(v) for v in _exact_local(whole, np.array([low, high])))
            made.append(
                replace(
                    whole,
                    s_from=low,
                    s_to=high,
                    v_from=v_from,
                    v_to=v_to,
                    turn_rad=measured.turn_rad,
                    shift=measured.shift,
                )
            )
    return tuple(made)


def _exact_local(segment: Smoothed, s: Floats) -> Floats:
    v = np.interp(s, (segment.s_from, segment.s_to), (0.0, 1.0))
    for _ in range(20):
        v = np.clip(v - (segment._arc(v) - s) / segment._arc(v, 1), 0.0, 1.0)
    return v


def _length(base: Line | Arc | Polynomial) -> float:
    if isinstance(base, Line):
        return math.hypot(base.end[0] - base.start[0], base.end[1] - base.start[1])
    if isinstance(base, Arc):
        return base.radius * abs(base.angle_to - base.angle_from)
    return float(polynomial_arc(base, 0.0, 1.0)(1.0))


def choose(candidates: Sequence[tuple[Measured, float]]) -> Measured:
    """The candidate of the best score; the first one of those that are as good."""
    best = min(score for _, score in candidates)
    return next(measured for measured, score in candidates if score <= best * (1.0 + 1e-9))
