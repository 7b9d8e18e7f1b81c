"""Smoothing of measured points to a profile with a usable curvature.

The points are smoothed along the arc over a stated length. The curvature of a spline through points with an error e
and a spacing h has an error of 6 e / h^2: for 0.01 mm and 0.2 mm it is 500 times the curvature of a rail head. The
curvature of a smoothing spline of the wave length w has an error of only 0.3 e sqrt(h) (2 pi / w)^2.5. The spline
blurs features that are shorter than w. Practice smooths measured rails and wheels over 4 to 8 mm. Points that
certainly belong to a profile of the library with little wear are smoothed as their deviation from it: its junctions
are kept, and the noise allows more.

Source of the score that chooses the filter length: Kim and Gu (2004), generalised cross-validation with a higher cost
of a degree of freedom. Plain cross-validation follows the noise in one case of ten.
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
from fecontact.profiles.point_noise import estimate_noise_mm, find_rounding_noise_mm
from fecontact.profiles.registration import estimate_distance_mm, find_foot_points
from fecontact.profiles.segments import Registration, Segment, SmoothingFrame, SmoothingResult
from fecontact.profiles.smoothing_splines import fit_smoothing_spline, minimise_bending

# --- A profile with a usable curvature from measured points: smoothing splines along the arc with a stated filter
# length.

PRACTICE_MM = (4.0, 8.0)
"""Shortest and longest usual filter length of measured profiles (mm)."""
PRACTICE_MIDDLE_MM = math.sqrt(PRACTICE_MM[0] * PRACTICE_MM[1])
"""Geometric mean of the usual filter lengths (mm), 5.7 mm."""
# Filter lengths for the deviation from a profile of the library. Longer waves cannot be distinguished from a rail's
# head.
_NARROWEST_MM, _WIDEST_MM, _FILTER_STEPS = 2.0, 60.0, 12
# If the noise requires more than the usual filter lengths, the filter length follows the curvature. The full length is
# used where the profile is flatter than this curvature.
_FOLLOWING_STEPS, _FLAT_PER_MM = 8, 1.0 / 300.0
# Cost of a degree of freedom in the score. With 1.4 (Kim and Gu), 2 of 100 noisy sections got a third of the filter
# length that they allow. With 2 no section did.
_FREEDOM_COST = 2.0
# Largest slope of the running part of a profile, for which the filter is chosen. Distances beyond the second number,
# as a multiple of the usual distance, are dents or places where two scans meet.
_RUNNING_SLOPE, _DENT_RATIO = 0.4, 4.0
_FEWEST_RUNNING = 40
_PILOT_MM = 8.0
# Least number of points that a filter length spans.
_FEWEST_FILTERED = 4.0
_PROBE_COUNT = 6
_NOISE_DRAW_COUNT = 48
SEED = 14
_SLIDE_STEPS = 4
# Number of neighbouring points whose mean square residual is compared with independent noise: it has an error of a
# quarter.
_LOCAL_COUNT = 31


def frame_on_reference(reference: Profile, registration: Registration, points: Floats) -> SmoothingFrame | None:
    """Assign points to the foot points on a registered reference.

    Parameters
    ----------
    reference
        Exact profile.
    registration
        Rigid displacement of the reference onto the points.
    points
        Points (n, 2) in mm.

    Returns
    -------
    SmoothingFrame or None
        Points with their deviations from the reference; None if less than 80 % of the points are over the reference.
    """
    feet = find_foot_points(reference, registration.to_reference(points))
    is_over = feet.inside & np.concatenate(([True], np.diff(np.maximum.accumulate(feet.s_mm)) > 1e-9))
    if np.count_nonzero(is_over) < 0.8 * len(points):
        return None
    return SmoothingFrame(
        points=points[is_over],
        s_mm=feet.s_mm[is_over],
        values=points[is_over] - registration.from_reference(feet.points[is_over]),
        normals=registration.rotate(feet.normals[is_over]),
        nominal=reference.name,
        registration=registration,
        reference=reference.segments,
    )


def frame_on_chords(points: Floats) -> SmoothingFrame:
    """Assign points (n, 2) to the length of the chords between them.

    Parameters
    ----------
    points
        Points (n, 2) in mm.

    Returns
    -------
    SmoothingFrame
        Points without a nominal profile.
    """
    s = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    first = fit_smoothing_spline(s, points, _PILOT_MM)(s, 1)
    normals = np.column_stack((-first[:, 1], first[:, 0])) / np.hypot(*first.T)[:, None]
    return SmoothingFrame(points=points, s_mm=s, values=points, normals=normals)


@lru_cache(maxsize=8)
def make_nominal_profile(segments: tuple[Segment, ...]) -> Profile:
    """Make the profile of nominal segments, once for all profile variants.

    Its table takes longer than the foot points.

    Parameters
    ----------
    segments
        Segments of the nominal profile.

    Returns
    -------
    Profile
        Profile of these segments, kept for equal segments.
    """
    return Profile(name="nominal", kind="rail", segments=segments)


def slide_along_nominal(frame: SmoothingFrame, filter_mm: float) -> SmoothingFrame:
    """Assign points to the nominal positions from which a smooth displacement leads to them.

    These positions differ from the foot points. A displacement across the nominal profile turns with its normal, and
    has a kink where the curvature of the nominal profile jumps. Under 1 mm of wear, smoothing would blur this kink into
    a wrong curvature. Only the distance of the points across the smoothed profile counts. The least-bending
    displacement gives their positions along the nominal profile. So the junctions of the nominal profile move with the
    wear.

    Parameters
    ----------
    frame
        Points and their reference.
    filter_mm
        Filter length (mm).

    Returns
    -------
    SmoothingFrame
        Points with new positions and deviations; `frame` itself without a nominal profile.
    """
    if not frame.reference:
        return frame
    nominal_profile, s_mm = make_nominal_profile(frame.reference), frame.s_mm
    end_margin = 1e-3 * np.arange(s_mm.size)
    for _ in range(_SLIDE_STEPS):
        values, tangent = _measure_deviations(nominal_profile, frame, s_mm)
        normals = np.column_stack((-tangent[:, 1], tangent[:, 0]))
        remainder = values - minimise_bending(s_mm, values, normals, filter_mm)
        next_s = s_mm + np.clip((remainder * tangent).sum(axis=1), -1.0, 1.0)
        # there is no position beyond an end: the last points stay next to the end, one after another
        next_s = np.clip(next_s, end_margin, nominal_profile.length_mm - end_margin[::-1])
        if np.diff(next_s).min() <= 1e-9:
            break
        s_mm = next_s
    values, tangent = _measure_deviations(nominal_profile, frame, s_mm)
    return replace(frame, s_mm=s_mm, values=values, normals=np.column_stack((-tangent[:, 1], tangent[:, 0])))


def _measure_deviations(nominal_profile: Profile, frame: SmoothingFrame, s: Floats) -> tuple[Floats, Floats]:
    """Measure the deviations of points from positions on the registered nominal profile.

    Parameters
    ----------
    nominal_profile
        Nominal profile.
    frame
        Points and their reference.
    s
        Arc lengths (n,) on the nominal profile (mm).

    Returns
    -------
    deviations, tangents
        Deviations (n, 2) in mm, and unit tangents (n, 2) of the nominal profile.
    """
    p = nominal_profile.evaluate(nominal_profile.at_arc_length(s))
    tangent = frame.registration.rotate(np.column_stack((p.dy, p.dz)) / np.hypot(p.dy, p.dz)[:, None])
    return frame.points - frame.registration.from_reference(np.column_stack((p.y, p.z))), tangent


def smooth_frame(
    frame: SmoothingFrame, *, filter_mm: float | None, noise_mm: float | None
) -> tuple[SmoothingResult, float]:
    """Smooth the deviations of points from their reference.

    The score does not decide between the usual filter lengths: practice does. If it chooses one of them, the smoothing
    has the middle of the usual lengths.

    Parameters
    ----------
    frame
        Points and their reference.
    filter_mm
        Declared filter length (mm); None chooses it by the score.
    noise_mm
        Standard deviation of the noise (mm); None estimates it from the points.

    Returns
    -------
    measured, score
        Smoothing, and the score of the chosen filter. The least score is the best.
    """
    fits = []
    # from the longest length downwards; each search begins at the positions of the search before
    for length in sorted(_list_filter_lengths(frame) if filter_mm is None else [filter_mm], reverse=True):
        frame = slide_along_nominal(frame, length)
        fits.append((frame, length, *fit_deviation(frame, length, noise_mm)))
    if filter_mm is None and not frame.reference:
        # a filter length that suits the noise on the top of a head would blur its corners
        for length in np.geomspace(PRACTICE_MM[1], _WIDEST_MM, _FOLLOWING_STEPS):
            following_frame = replace(frame, relative_filter=_compute_relative_filter(frame, length))
            fits.append((following_frame, float(length), *fit_deviation(following_frame, length, noise_mm)))
    frame, length, residual, freedom, score = min(fits, key=lambda fit: fit[-1])
    is_usual = filter_mm is None and is_usual_filter(frame, length)
    if is_usual:
        frame, length = slide_along_nominal(frame, PRACTICE_MIDDLE_MM), PRACTICE_MIDDLE_MM
        residual, freedom, _ = fit_deviation(frame, length, noise_mm)
    # of the usual filters some keep and some remove waves above the shortest length
    waves, waves_freedom, _ = fit_deviation(frame, PRACTICE_MM[0], noise_mm) if is_usual else (residual, freedom, 0.0)
    is_running = select_running_part(frame)
    inner = _limit_outliers(residual[is_running])
    scatter = math.sqrt(float((inner**2).mean()) / max(1.0 - freedom, 0.1)) if noise_mm is None else noise_mm
    rounding_mm = find_rounding_noise_mm(frame.points, is_running)
    known_mm = noise_mm if noise_mm is not None else rounding_mm if rounding_mm > 0.0 else None
    independent_mm = estimate_noise_mm(frame.points) if known_mm is None else known_mm
    # what a declared filter removes is not part of the profile
    has_correlated_noise = noise_mm is None and filter_mm is None
    independent_share = independent_mm**2 * (1.0 - waves_freedom)
    measured = SmoothingResult(
        held=frame,
        residual_mm=residual,
        noise_mm=scatter,
        independent_noise_mm=independent_mm,
        correlated_noise_mm=has_correlated_noise * _reduce_residual(waves, independent_share),
        filter_mm=length,
        is_filter_declared=filter_mm is not None,
        is_noise_known=known_mm is not None,
        curvature_noise_per_mm=np.zeros(0),
    )
    draws = draw_noise(measured, [SEED], _NOISE_DRAW_COUNT)
    second_derivatives = fit_smoothing_spline(frame.s_mm, draws, length, frame.relative_filter)(frame.s_mm, 2)
    return replace(measured, curvature_noise_per_mm=np.sqrt((second_derivatives**2).mean(axis=1))), score


def _reduce_residual(residual_mm: Floats, independent_share: float) -> Floats:
    """Reduce a residual (n,) by the noise that is independent in each point.

    Parameters
    ----------
    residual_mm
        Distances of points from their smoothed profile (mm).
    independent_share
        Mean square of the distances that independent noise causes (mm^2).

    Returns
    -------
    ndarray
        Distances (n,) in mm. Where the residual is not larger than independent noise, they are 0.
    """
    reach = np.ones(min(_LOCAL_COUNT, residual_mm.size))
    mean_square = np.convolve(residual_mm**2, reach, "same") / np.convolve(np.ones_like(residual_mm), reach, "same")
    share = independent_share / np.maximum(mean_square, np.finfo(float).tiny)
    return np.asarray(residual_mm * np.sqrt(np.maximum(1.0 - share, 0.0)))


def is_usual_filter(frame: SmoothingFrame, filter_mm: float) -> bool:
    """Whether a filter has a constant usual length and spans enough points.

    Parameters
    ----------
    frame
        Points and their reference.
    filter_mm
        Filter length (mm).

    Returns
    -------
    bool
        Whether the length is within `PRACTICE_MM`, and the middle of these lengths spans at least four points.
    """
    low, high = PRACTICE_MM
    is_resolved = _FEWEST_FILTERED * _measure_mean_spacing_mm(frame) <= PRACTICE_MIDDLE_MM
    return frame.relative_filter is None and is_resolved and low - 1e-9 <= filter_mm <= high + 1e-9


def _measure_mean_spacing_mm(frame: SmoothingFrame) -> float:
    return float((frame.s_mm[-1] - frame.s_mm[0]) / (frame.s_mm.size - 1))


def _list_filter_lengths(frame: SmoothingFrame) -> list[float]:
    """List the candidate filter lengths, of at least four points each.

    Deviations from a nominal profile have a wider range of lengths.
    """
    low, high = (_NARROWEST_MM, _WIDEST_MM) if frame.reference else PRACTICE_MM
    low = max(low, _FEWEST_FILTERED * _measure_mean_spacing_mm(frame))
    return [float(length) for length in np.geomspace(low, max(low, high), _FILTER_STEPS if frame.reference else 5)]


def _compute_relative_filter(frame: SmoothingFrame, filter_mm: float) -> Floats:
    """Compute the filter length at each point divided by the full filter length.

    It is proportional to the square root of the radius, and not below the shortest usual length. A head has radii of 13
    and of 300 mm, and a filter that would keep a corner leaves the noise in the top.

    Parameters
    ----------
    frame
        Points and their reference.
    filter_mm
        Full filter length (mm).

    Returns
    -------
    ndarray
        Relative filter lengths (n,), at most 1.
    """
    along = np.arctan2(frame.normals[:, 1], frame.normals[:, 0])
    bend = np.abs(np.gradient(np.unwrap(along), frame.s_mm))
    # averaged over some mm, because the noise of the first smoothing is not a curvature
    sigma = _PILOT_MM * frame.s_mm.size / frame.s_mm[-1]
    reach = math.ceil(4.0 * sigma)
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    # the import of scipy.ndimage takes a tenth of the time of the smoothing
    spread = np.convolve(np.pad(bend, reach, mode="edge"), bell / bell.sum(), "valid")
    relative = np.sqrt(_FLAT_PER_MM / np.maximum(spread, _FLAT_PER_MM))
    return np.asarray(np.clip(relative, PRACTICE_MM[0] / filter_mm, 1.0))


def select_running_part(frame: SmoothingFrame) -> NDArray[np.bool_]:
    """Select the points on the running part of the profile.

    The mask (n,) selects all points if hardly any point is on the running part.

    Parameters
    ----------
    frame
        Points with their normals.

    Returns
    -------
    ndarray of shape (n,)
        Whether each point is selected.
    """
    is_flat = np.abs(frame.normals[:, 0]) < _RUNNING_SLOPE * np.abs(frame.normals[:, 1])
    return is_flat if np.count_nonzero(is_flat) >= _FEWEST_RUNNING else np.ones_like(is_flat)


def _limit_outliers(distances_mm: Floats) -> Floats:
    """Limit distances (n,) to a multiple of the usual distance."""
    largest = _DENT_RATIO * estimate_distance_mm(distances_mm)
    return np.clip(distances_mm, -largest, largest)


def fit_deviation(
    frame: SmoothingFrame, filter_mm: float, noise: float | None, rated: NDArray[np.bool_] | None = None
) -> tuple[Floats, float, float]:
    """Fit the deviations with a given filter length, and rate the filter.

    Parameters
    ----------
    frame
        Points and their reference.
    filter_mm
        Filter length (mm).
    noise
        Standard deviation of the noise (mm); None if unknown.
    rated
        Points (n,) that count for the score, at least one; None for the running part.

    Returns
    -------
    residual, freedom, score
        Distances (n,) of the points from the smoothed profile (mm), degrees of freedom per point, and the score. The
        score is cross-validation on the rated points, or Mallows' estimate of the error if the noise is given.
    """
    s, values = frame.s_mm, frame.values
    if rated is None:
        rated = select_running_part(frame)
    probes = _draw_probes(s.size)
    fitted = fit_smoothing_spline(s, np.column_stack((values, probes)), filter_mm, frame.relative_filter)(s)
    # the trace of the smoother (Hutchinson) is its number of degrees of freedom
    freedom = float(np.mean((probes * fitted[:, 2:])[rated]))
    residual = np.asarray(((values - fitted[:, :2]) * frame.normals).sum(axis=1))
    mean_square = float((_limit_outliers(residual[rated]) ** 2).mean())
    if noise is None:
        return residual, freedom, mean_square / max(1.0 - _FREEDOM_COST * freedom, 1e-3) ** 2
    return residual, freedom, mean_square + 2.0 * _FREEDOM_COST * noise**2 * freedom


@lru_cache(maxsize=8)
def _draw_probes(number: int) -> Floats:
    """Draw random signs (number, probes) for the trace of a smoother."""
    return np.random.default_rng(SEED).choice(np.array([-1.0, 1.0]), size=(number, _PROBE_COUNT))


def draw_noise(
    measured: SmoothingResult, seed: Sequence[int], number: int, *, independent_filter_mm: float | None = None
) -> Floats:
    """Draw noise with the statistics of the measured points.

    Each point has an independent error. Waves that neighbours have in common keep their position and their size, and
    get a new sign and strength every few mm (Shao 2010, the dependent wild bootstrap).

    A smoothing spline is its points minus a penalty times the jumps of its third derivatives, and the penalty is
    proportional to the fourth power of the filter length. So independent noise can be changed such that the filter of
    the smoothing leaves exactly what another filter would leave.

    Parameters
    ----------
    measured
        Smoothing.
    seed
        Seed of the generator.
    number
        Number of draws.
    independent_filter_mm
        Filter length (mm) through which the independent noise passes; None for the filter of the smoothing.

    Returns
    -------
    ndarray
        Distances (n, number) of points from their profile (mm).
    """
    rng, s = np.random.default_rng(seed), measured.s_mm
    independent = measured.independent_noise_mm * rng.normal(size=(s.size, number))
    if independent_filter_mm is not None:
        passed = fit_smoothing_spline(s, independent, independent_filter_mm, measured.held.relative_filter)(s)
        independent = passed + (measured.filter_mm / independent_filter_mm) ** 4 * (independent - passed)
    stretch, fraction = np.divmod(s / measured.filter_mm, 1.0)
    strength = rng.normal(size=(int(stretch[-1]) + 2, number))
    stretch_index, angle = stretch.astype(np.intp), 0.5 * math.pi * fraction[:, None]
    return independent + measured.correlated_noise_mm[:, None] * (
        np.cos(angle) * strength[stretch_index] + np.sin(angle) * strength[stretch_index + 1]
    )


# --- Recognition of the library profile that measured points belong to.

# Number of points for the first look at all profiles, and number of profiles for the second look.
FIRST_LOOK_POINTS, SECOND_LOOK_PROFILES = 60, 3
