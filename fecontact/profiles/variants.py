"""Profile variants: smoothed profiles that are consistent with the measured points."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.profiles.curve import Profile
from fecontact.profiles.segments import (
    Arc,
    Polynomial,
    Segment,
    SmoothedSegment,
    SmoothingFrame,
    SmoothingResult,
    StraightSegment,
    integrate_polynomial_length,
)
from fecontact.profiles.smoothing import (
    PRACTICE_MM,
    SEED,
    draw_noise,
    fit_deviation,
    frame_on_chords,
    is_usual_filter,
    select_running_part,
    slide_along_nominal,
    smooth_frame,
)
from fecontact.profiles.smoothing_splines import fit_smoothing_spline


def make_segments(measured: SmoothingResult) -> tuple[Segment, ...]:
    """Make the segments of a smoothed profile."""
    return build_smoothed_segments(measured.held, measured.filter_mm)


def build_smoothed_segments(frame: SmoothingFrame, filter_mm: float) -> tuple[Segment, ...]:
    """Segments of a profile that is smoothed through points.

    Parameters
    ----------
    frame
        Points and their reference.
    filter_mm
        Filter length (mm).

    Returns
    -------
    tuple of SmoothedSegment
        One segment for each segment of the nominal profile, or a single segment without a nominal profile.
    """
    field = fit_smoothing_spline(frame.s_mm, frame.values, filter_mm, frame.relative_filter)
    first, last = float(frame.s_mm[0]), float(frame.s_mm[-1])
    if not frame.reference:
        return (SmoothedSegment(field=field, s_from=first, s_to=last),)
    segments: list[Segment] = []
    start = 0.0
    for base in frame.reference:
        assert isinstance(base, StraightSegment | Arc | Polynomial)
        full_segment = SmoothedSegment(
            field=field, s_from=start, s_to=start + _measure_length_mm(base), base=base, registration=frame.registration
        )
        low, high = max(first, full_segment.s_from), min(last, full_segment.s_to)
        start = full_segment.s_to
        if high - low > 1e-6:
            v_from, v_to = (float(v) for v in full_segment.local_parameters(np.array([low, high])))
            segments.append(replace(full_segment, s_from=low, s_to=high, v_from=v_from, v_to=v_to))
    return tuple(segments)


def scale_deviation(profile: Profile, factor: float) -> Profile:
    """Smoothed profile with a scaled deviation from its nominal profile.

    Parameters
    ----------
    profile
        Profile that was smoothed as a deviation from a nominal profile.
    factor
        Factor of the deviation: 0 gives the nominal profile, 1 the smoothed profile itself.

    Returns
    -------
    Profile
        Profile without measured points.

    Raises
    ------
    InputError
        The profile was not smoothed as a deviation from a nominal profile.
    """
    if profile.measured is None or not profile.measured.nominal:
        raise InputError(
            f"{profile.name} has no deviation from a nominal profile; give a file of measured points, and the name of"
            " the"
            " nominal profile if it is not recognised"
        )
    segments = []
    for segment in profile.segments:
        assert isinstance(segment, SmoothedSegment)
        field = segment.field
        segments.append(replace(segment, field=type(field)(factor * field.c, field.x)))
    return replace(profile, segments=tuple(segments), name=f"{profile.name} times {factor:g}", measured=None)


@dataclass(frozen=True, kw_only=True)
class ProfileVariant:
    """Profile variant: a smoothed profile that is consistent with the measured points.

    Attributes
    ----------
    profile
        The profile.
    filter_mm, nominal
        Filter length (mm), and name of the nominal profile; empty without a nominal profile.
    draw
        Number of the noise draw; -1 for the measured points.
    is_judged
        Whether verdicts count the variant; otherwise only stated ranges include it.
    """

    profile: Profile
    filter_mm: float
    nominal: str
    draw: int = -1
    is_judged: bool = True


# Number of profile variants with different noise.
_VARIANT_DRAWS = 4
NO_SUPPORT = 10.0
"""Largest difference in Akaike's criterion between a profile that the points support and the best profile (Burnham and
Anderson 2002, section 2.6: beyond 10 a model has essentially no support).
"""
# Least curvature noise with an effect on a contact (1/mm): 0.3 % of R 300 mm.
_LEAST_CURVATURE_NOISE_PER_MM = 1e-5


def make_profile_variants(profile: Profile) -> tuple[ProfileVariant, ...]:
    """Profile variants that the points of a smoothed profile allow, besides the profile itself.

    If the profile has the middle of the usual filter lengths, they are smoothed over 4 and 8 mm. If the noise asks for
    a different filter, they are smoothed over 0.71 and 1.41 times its length. If the filter was declared, all variants
    have this filter. One variant has no nominal profile, unless the points contradict it. Further variants have new
    draws of equally large noise, unless it has no effect on the curvature. The draws are reproducible.

    Parameters
    ----------
    profile
        Rail or wheel.

    Returns
    -------
    tuple of ProfileVariant
        Variants; empty for an exact profile.
    """
    return _make_variants(_ContentKey(profile=profile)) if profile.measured is not None else ()


@dataclass(frozen=True, eq=False)
class _ContentKey:
    """Smoothed profile as a key: profiles with equal points, filter and nominal profile are equal."""

    profile: Profile

    def _content(self) -> tuple[object, ...]:
        """Values that define the smoothed profile."""
        measured = self.profile.measured
        assert measured is not None
        settings = (
            self.profile.kind,
            self.profile.name,
            measured.filter_mm,
            measured.is_filter_declared,
            measured.nominal,
            measured.noise_mm,
        )
        return (*settings, measured.points.tobytes(), measured.s_mm.tobytes())

    def __eq__(self, key: object) -> bool:
        return isinstance(key, _ContentKey) and self._content() == key._content()

    def __hash__(self) -> int:
        return hash(self._content())


@lru_cache(maxsize=16)
def _make_variants(key: _ContentKey) -> tuple[ProfileVariant, ...]:
    """Make the variants of a smoothed profile.

    Parameters
    ----------
    key
        Smoothed profile.

    Returns
    -------
    tuple of ProfileVariant
        Variants.
    """
    profile, measured = key.profile, key.profile.measured
    assert measured is not None
    changed = [(replace(measured, filter_mm=length), -1) for length in list_other_filters_mm(measured)]
    if measured.nominal:
        is_noise_known = not measured.correlated_noise_mm.any() and not measured.is_filter_declared
        free_measured, _ = smooth_frame(
            frame_on_chords(measured.points),
            filter_mm=measured.filter_mm if measured.is_filter_declared else None,
            noise_mm=measured.noise_mm if is_noise_known else None,
        )
        *_, score = fit_deviation(free_measured.held, free_measured.filter_mm, None)
        if _is_supported(score, measured):
            changed.append((free_measured, -1))
    if measured.nominal or has_effective_noise(measured):
        changed += [(_redraw_noise(profile, measured, k), k) for k in range(_VARIANT_DRAWS)]
    variants = (
        (_build_variant(profile, changed_measured), changed_measured, draw) for changed_measured, draw in changed
    )
    return tuple(
        ProfileVariant(
            profile=variant_profile,
            filter_mm=changed_measured.filter_mm,
            nominal=changed_measured.nominal,
            draw=draw,
            is_judged=not _is_too_short(changed_measured, measured),
        )
        for variant_profile, changed_measured, draw in variants
        if variant_profile is not None
    )


def _select_noise_filter(measured: SmoothingResult) -> SmoothingResult:
    """Select the filter through which redrawn correlated noise passes.

    Of the usual filters, the shortest keeps most of the waves that neighbouring points have in common. With the middle
    filter, the stated uncertainty of the semi-axis a covered the values of CONTACT with 4 mm in 86 % of 66 positions.

    Parameters
    ----------
    measured
        Smoothing of the profile.

    Returns
    -------
    SmoothingResult
        With the shortest usual filter if neighbouring points have waves in common and all usual filters count;
        otherwise unchanged.
    """
    if measured.correlated_noise_mm.any() and is_usual_filter(measured.held, measured.filter_mm):
        return replace(measured, filter_mm=PRACTICE_MM[0])
    return measured


def list_other_filters_mm(measured: SmoothingResult) -> tuple[float, ...]:
    """List the filter lengths of the variants besides the filter of the profile itself.

    Parameters
    ----------
    measured
        Smoothing of the profile.

    Returns
    -------
    tuple of float
        Filter lengths (mm); empty for a declared filter.
    """
    if measured.is_filter_declared:
        return ()
    if is_usual_filter(measured.held, measured.filter_mm):
        return PRACTICE_MM
    return math.sqrt(0.5) * measured.filter_mm, math.sqrt(2.0) * measured.filter_mm


def _is_too_short(changed: SmoothingResult, measured: SmoothingResult) -> bool:
    """Whether the filter of a variant is too short for noise with a fixed size.

    A shorter filter supposes that a part of the noise is profile. If the noise is known, it is not. Then the shorter
    filter shows 2.4 times as much noise of the curvature as the profile, whose own noise the noise samples show
    already. On files that are rounded to 0.01 mm, 8 of 45 verdicts with it were opposite to those on the files as they
    are; those with the filter of the profile and with 1.41 times its length agreed in all but one.

    Parameters
    ----------
    changed
        Smoothing of the variant.
    measured
        Smoothing of the profile.

    Returns
    -------
    bool
        Answer; False for a variant with another nominal profile, which has its own filter.
    """
    asks_for_more = measured.held.relative_filter is not None or measured.filter_mm > PRACTICE_MM[1]
    is_shorter = changed.nominal == measured.nominal and changed.filter_mm < measured.filter_mm
    return measured.is_noise_known and asks_for_more and is_shorter


def has_effective_noise(measured: SmoothingResult) -> bool:
    """Whether the noise of points changes the curvature of a smoothed profile.

    Parameters
    ----------
    measured
        Smoothing of the profile.

    Returns
    -------
    bool
        Whether the standard deviation of the curvature is at least 0.3 % of a radius of 300 mm anywhere.
    """
    return bool(measured.curvature_noise_per_mm.max() >= _LEAST_CURVATURE_NOISE_PER_MM)


def _is_supported(score: float, measured: SmoothingResult) -> bool:
    """Whether a variant with this score is nearly as good as the reference variant.

    Without a nominal profile, the corners of a variant are blunt. Waves that neighbouring points have in common reduce
    the number of independent points.

    Parameters
    ----------
    score
        Score of the variant.
    measured
        Smoothing of the reference variant.

    Returns
    -------
    bool
        Answer.
    """
    *_, reference_score = fit_deviation(measured.held, measured.filter_mm, None)
    independent_points = min(1.0, (measured.independent_noise_mm / measured.noise_mm) ** 2) * np.count_nonzero(
        select_running_part(measured.held)
    )
    return bool(independent_points * math.log(score / reference_score) <= NO_SUPPORT)


def _build_variant(profile: Profile, changed: SmoothingResult) -> Profile | None:
    """Build the profile of points that are smoothed differently.

    The result is None if the points are no longer over their nominal profile.
    """
    try:
        smoothed_measured = replace(changed, held=slide_along_nominal(changed.held, changed.filter_mm))
    except np.linalg.LinAlgError:
        return None
    return replace(profile, segments=make_segments(smoothed_measured), measured=smoothed_measured)


def _redraw_noise(profile: Profile, measured: SmoothingResult, number: int) -> SmoothingResult:
    """Redraw the noise of the points of a smoothed profile, with equal size.

    The independent noise is the error of the smoothed profile and passes its filter. Which waves of neighbouring points
    belong to the profile is a matter of practice: these waves pass the filter of `_select_noise_filter`.

    Parameters
    ----------
    profile
        Smoothed profile.
    measured
        Its smoothing.
    number
        Number of the draw.

    Returns
    -------
    SmoothingResult
        Smoothing of the new points.
    """
    points, normals = _evaluate_normals(profile, measured.s_mm)
    seed = [SEED, number, 0 if profile.kind == "rail" else 1]
    noisy_measured = _select_noise_filter(measured)
    noise = draw_noise(noisy_measured, seed, 1, independent_filter_mm=measured.filter_mm)
    return replace(noisy_measured, held=_replace_points(points + noise * normals, measured.held))


def _replace_points(points: Floats, frame: SmoothingFrame) -> SmoothingFrame:
    """Replace the points (n, 2) at equal positions on an equal reference."""
    return replace(frame, points=points, values=frame.values + (points - frame.points))


def _evaluate_normals(profile: Profile, s: Floats) -> tuple[Floats, Floats]:
    """Evaluate points and normals of a smoothed profile at arc lengths of its reference.

    Parameters
    ----------
    profile
        Smoothed profile.
    s
        Arc lengths (n,) in mm.

    Returns
    -------
    points, normals
        Points (n, 2) in mm and unit normals (n, 2).
    """
    points, normals = np.empty((s.size, 2)), np.empty((s.size, 2))
    for segment in profile.segments:
        assert isinstance(segment, SmoothedSegment)
        is_here = (s >= segment.s_from - 1e-9) & (s <= segment.s_to + 1e-9)
        v = np.clip(_invert_arc_length(segment, s[is_here]), 0.0, 1.0)
        curve_points = segment.evaluate(v)
        points[is_here] = np.column_stack((curve_points.y, curve_points.z))
        normals[is_here] = (
            np.column_stack((-curve_points.dz, curve_points.dy)) / np.hypot(curve_points.dy, curve_points.dz)[:, None]
        )
    return points, normals


def _invert_arc_length(segment: SmoothedSegment, s: Floats) -> Floats:
    grid = np.linspace(0.0, 1.0, 257)
    return np.interp(s, segment._arc_length(grid), grid)


def _measure_length_mm(base: StraightSegment | Arc | Polynomial) -> float:
    if isinstance(base, StraightSegment):
        return math.hypot(base.end[0] - base.start[0], base.end[1] - base.start[1])
    if isinstance(base, Arc):
        return base.radius * abs(base.angle_to - base.angle_from)
    return float(integrate_polynomial_length(base, 0.0, 1.0)(1.0))
