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
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.profiles.curve import Profile
from fecontact.profiles.point_noise import noise_of
from fecontact.profiles.registration import estimate_distance_mm, foot_points
from fecontact.profiles.segments import Held, Measured, Registration, Segment
from fecontact.profiles.smoothing_splines import least_bending, smoothed_by

# --- A line with a usable curvature from measured points: smoothing splines along the arc, of a stated filter length.

PRACTICE_MM = (4.0, 8.0)
"""Filter lengths over which measured profiles are usually smoothed."""
# Filter lengths for the deviation from a profile of the library. No longer waves are told from a rail's head.
_NARROWEST_MM, _WIDEST_MM, _FILTER_STEPS = 2.0, 60.0, 12
# Where noise asks for more than what is usual, the filter follows the curvature, from what is flat.
_FOLLOWING_STEPS, _FLAT_PER_MM = 8, 1.0 / 300.0
# What a degree of freedom costs in the score. With 1.4 (Kim and Gu) 2 of 100 noisy sections got a filter of a third of
# what they allow; with 2 none did.
_FREEDOM_COST = 2.0
# The running part of a line, which the filter is chosen for, is flatter; distances beyond so many times the usual are
# of dents and of places where two scans meet.
_RUNNING_SLOPE, _DENT_RATIO = 0.4, 4.0
_FEWEST_RUNNING = 40
_PILOT_MM = 8.0
_PROBE_COUNT = 6
_NOISE_DRAW_COUNT = 48
SEED = 14
_SLIDE_STEPS = 4


def frame_on_reference(reference: Profile, registration: Registration, points: Floats) -> Held | None:
    """Points (n, 2) over a registered reference; None where too few of them lie over it."""
    feet = foot_points(reference, registration.to_reference(points))
    over = feet.inside & np.concatenate(([True], np.diff(np.maximum.accumulate(feet.s_mm)) > 1e-9))
    if np.count_nonzero(over) < 0.8 * len(points):
        return None
    return Held(
        points=points[over],
        s_mm=feet.s_mm[over],
        values=points[over] - registration.from_reference(feet.points[over]),
        normals=registration.rotate(feet.normals[over]),
        nominal=reference.name,
        registration=registration,
        reference=reference.segments,
    )


def frame_on_chords(points: Floats) -> Held:
    """Points (n, 2) over the length of the chords between them."""
    s = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    first = smoothed_by(s, points, _PILOT_MM)(s, 1)
    normals = np.column_stack((-first[:, 1], first[:, 0])) / np.hypot(*first.T)[:, None]
    return Held(points=points, s_mm=s, values=points, normals=normals)


@lru_cache(maxsize=8)
def make_nominal_profile(segments: tuple[Segment, ...]) -> Profile:
    """The nominal line alone, once for all lines that its points allow: its table takes longer than the foot points."""
    return Profile(name="nominal", kind="rail", segments=segments)


def slide_along_nominal(held: Held, filter_mm: float) -> Held:
    """Points at the places of their nominal line from which a smooth displacement leads to them, and not at its feet.

    A displacement across the nominal turns with its normal, and has a kink wherever the curvature of that jumps: under
    1 mm of wear a smoothing would blur it into a wrong curvature. What counts is how far points are off the smoothed
    line across it; where along the nominal they come from, the least bending displacement says. So the junctions of
    the nominal move with the wear.
    """
    if not held.reference:
        return held
    line, s = make_nominal_profile(held.reference), held.s_mm
    beside_end = 1e-3 * np.arange(s.size)
    for _ in range(_SLIDE_STEPS):
        values, tangent = _measure_deviations(line, held, s)
        normals = np.column_stack((-tangent[:, 1], tangent[:, 0]))
        rest = values - least_bending(s, values, normals, filter_mm)
        further = s + np.clip((rest * tangent).sum(axis=1), -1.0, 1.0)
        # beyond an end there is no place: the last points stay beside it, one after another
        further = np.clip(further, beside_end, line.length_mm - beside_end[::-1])
        if np.diff(further).min() <= 1e-9:
            break
        s = further
    values, tangent = _measure_deviations(line, held, s)
    return replace(held, s_mm=s, values=values, normals=np.column_stack((-tangent[:, 1], tangent[:, 0])))


def _measure_deviations(line: Profile, held: Held, s: Floats) -> tuple[Floats, Floats]:
    """What points are from the places s of the registered nominal, and its unit tangents there."""
    p = line.evaluate(line.at_arc_length(s))
    tangent = held.registration.rotate(np.column_stack((p.dy, p.dz)) / np.hypot(p.dy, p.dz)[:, None])
    return held.points - held.registration.from_reference(np.column_stack((p.y, p.z))), tangent


def smooth_frame(held: Held, *, filter_mm: float | None, noise_mm: float | None) -> tuple[Measured, float]:
    """What points are off the line that they are held against, smoothed; with the score of its filter, least is best.

    Filter length and noise (mm) are found from the points where they are None.
    """
    fits = []
    # from the longest, each from the places of the one before
    for length in sorted(_list_filter_lengths(held) if filter_mm is None else [filter_mm], reverse=True):
        held = slide_along_nominal(held, length)
        fits.append((held, length, *fit_deviation(held, length, noise_mm)))
    if filter_mm is None and not held.reference:
        # what noise asks for on the top of a head would blur its corners
        for length in np.geomspace(PRACTICE_MM[1], _WIDEST_MM, _FOLLOWING_STEPS):
            follows = replace(held, relative_filter=_compute_relative_filter(held, length))
            fits.append((follows, float(length), *fit_deviation(follows, length, noise_mm)))
    held, length, residual, freedom, score = min(fits, key=lambda fit: fit[-1])
    inner = _limit_outliers(residual[select_running_part(held)])
    scatter = math.sqrt(float((inner**2).mean()) / max(1.0 - freedom, 0.1)) if noise_mm is None else noise_mm
    made = Measured(
        held=held,
        residual_mm=residual,
        noise_mm=scatter,
        independent_noise_mm=noise_of(held.points) if noise_mm is None else noise_mm,
        correlated_noise_mm=residual * (noise_mm is None),
        filter_mm=length,
        curvature_noise_per_mm=np.zeros(0),
    )
    draws = draw_noise(made, [SEED], _NOISE_DRAW_COUNT)
    bent = smoothed_by(held.s_mm, draws, length, held.relative_filter)(held.s_mm, 2)
    return replace(made, curvature_noise_per_mm=np.sqrt((bent**2).mean(axis=1))), score


def _list_filter_lengths(held: Held) -> list[float]:
    """Filter lengths to choose from: usual lengths, or any length for a deviation, and never below four points."""
    low, high = (_NARROWEST_MM, _WIDEST_MM) if held.reference else PRACTICE_MM
    low = max(low, 4.0 * (held.s_mm[-1] - held.s_mm[0]) / (held.s_mm.size - 1))
    return [float(one) for one in np.geomspace(low, max(low, high), _FILTER_STEPS if held.reference else 5)]


def _compute_relative_filter(held: Held, filter_mm: float) -> Floats:
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


def select_running_part(held: Held) -> NDArray[np.bool_]:
    """Which points lie on the running part of the line; all where hardly any do."""
    flat = np.abs(held.normals[:, 0]) < _RUNNING_SLOPE * np.abs(held.normals[:, 1])
    return flat if np.count_nonzero(flat) >= _FEWEST_RUNNING else np.ones_like(flat)


def _limit_outliers(off: Floats) -> Floats:
    """Distances (n,) of which those beyond the usual are cut down to that."""
    most = _DENT_RATIO * estimate_distance_mm(off)
    return np.clip(off, -most, most)


def fit_deviation(held: Held, filter_mm: float, noise: float | None) -> tuple[Floats, float, float]:
    """How far points are off a line of one filter length, its degrees of freedom a point, and its score.

    That is cross-validation on the running part, or with a known noise Mallows' estimate of the error.
    """
    s, values, running = held.s_mm, held.values, select_running_part(held)
    probes = _draw_probes(s.size)
    fitted = smoothed_by(s, np.column_stack((values, probes)), filter_mm, held.relative_filter)(s)
    # the trace of the smoother (Hutchinson), which is its degrees of freedom
    freedom = float(np.mean((probes * fitted[:, 2:])[running]))
    residual = np.asarray(((values - fitted[:, :2]) * held.normals).sum(axis=1))
    off = float((_limit_outliers(residual[running]) ** 2).mean())
    if noise is None:
        return residual, freedom, off / max(1.0 - _FREEDOM_COST * freedom, 1e-3) ** 2
    return residual, freedom, off + 2.0 * _FREEDOM_COST * noise**2 * freedom


@lru_cache(maxsize=8)
def _draw_probes(number: int) -> Floats:
    return np.random.default_rng(SEED).choice(np.array([-1.0, 1.0]), size=(number, _PROBE_COUNT))


def draw_noise(measured: Measured, seed: Sequence[int], number: int) -> Floats:
    """Distances (n, number) of points from their line that are as those that were measured.

    Each point has an error of its own; waves that neighbours have together keep their place and their size, and get
    another sign and strength every few mm (Shao 2010, the dependent wild bootstrap).
    """
    rng, s = np.random.default_rng(seed), measured.s_mm
    white = measured.independent_noise_mm * rng.normal(size=(s.size, number))
    stretch, part = np.divmod(s / measured.filter_mm, 1.0)
    strength = rng.normal(size=(int(stretch[-1]) + 2, number))
    k, turn = stretch.astype(np.intp), 0.5 * math.pi * part[:, None]
    return white + measured.correlated_noise_mm[:, None] * (np.cos(turn) * strength[k] + np.sin(turn) * strength[k + 1])


# --- Which profile of the library measured points are, worn or not, and the line that is smoothed from them.

# Points for the first look at a profile, and profiles that get a second one.
FIRST_LOOK_POINTS, SECOND_LOOK_PROFILES = 60, 3
