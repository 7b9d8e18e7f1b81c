"""A line with a usable curvature from measured points: smoothing splines along the arc, of a stated width.

The curvature of a spline through points with an error e every h carries 6 e / h^2, for 0.01 mm every 0.2 mm 500 times
that of a rail head. A smoothing spline of the wave length w carries 0.3 e sqrt(h) (2 pi / w)^2.5 only, and blurs
what is shorter than w. The head of a rail has both: radii of 300 mm and junctions to 13 mm. So the points are held
against the nearest profile of the library, if they support one, and their deviation from it is smoothed, which is what
wear and tolerances are; otherwise the line itself.

Kim and Gu (2004) for the score by which the width is chosen: generalised cross-validation in which a degree of freedom
costs more, as the plain one follows the noise in one case of ten.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from fecontact.profiles.curve import Profile
from fecontact.profiles.measured import Held, Measured
from fecontact.profiles.noise import noise_of
from fecontact.profiles.registration import foot_points
from fecontact.profiles.segments import Floats, Registration, Segment
from fecontact.profiles.smoothing_spline import least_bending, smoothed_by

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


@dataclass(frozen=True, kw_only=True, eq=False)
class _Fit:
    residual: Floats
    width_mm: float
    score: float


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
        fits.append((held, _fit(held, width, noise_mm)))
    held, best = min(fits, key=lambda fit: fit[1].score)
    scatter = noise_of(held.points) if noise_mm is None else noise_mm
    made = Measured(
        held=held,
        residual_mm=best.residual,
        noise_mm=scatter,
        width_mm=best.width_mm,
        curvature_noise_per_mm=_curvature_noise(held, best.width_mm, scatter),
    )
    return made, best.score


def _widths(s: Floats) -> list[float]:
    """Widths to choose from: none below what four points show."""
    low = max(NARROWEST_MM, 4.0 * (s[-1] - s[0]) / (s.size - 1))
    return [low * (max(WIDEST_MM, low) / low) ** (k / (_STEPS - 1)) for k in range(_STEPS)]


def _fit(held: Held, width: float, noise: float | None) -> _Fit:
    """One width and its score: cross-validation, or with a known noise Mallows' estimate of the error."""
    s, values = held.s_mm, held.values
    probes = np.random.default_rng(SEED).choice([-1.0, 1.0], size=(s.size, _PROBES))
    fitted = smoothed_by(s, np.column_stack((values, probes)), width, held.relative_width)(s)
    # the trace of the smoother (Hutchinson), which is its degrees of freedom
    freedom = float(np.mean((probes * fitted[:, 2:]).sum(axis=0)))
    residual = np.asarray(((values - fitted[:, :2]) * held.normals).sum(axis=1))
    off = float((residual**2).mean())
    if noise is None:
        score = off / max(1.0 - _COST * freedom / s.size, 1e-3) ** 2
    else:
        score = off + 2.0 * _COST * noise**2 * freedom / s.size
    return _Fit(residual=residual, width_mm=width, score=score)


def _curvature_noise(held: Held, width: float, noise: float) -> Floats:
    s = held.s_mm
    draws = noise * np.random.default_rng(SEED).normal(size=(s.size, _DRAWS))
    return np.asarray(np.sqrt((smoothed_by(s, draws, width, held.relative_width)(s, 2) ** 2).mean(axis=1)))


def choose(candidates: Sequence[tuple[Measured, float]]) -> Measured:
    """The candidate of the best score; the first one of those that are as good."""
    best = min(score for _, score in candidates)
    return next(measured for measured, score in candidates if score <= best * (1.0 + 1e-9))
