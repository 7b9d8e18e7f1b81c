"""Choice of the nominal profile of measured points among profiles of the library.

The score that chooses a filter length (`smoothing.fit_deviation`) is computed on the points that a profile covers, and
on its own running part. Scores of different profiles are comparable only on equal points: a rail of which the drawing
ends earlier leaves out points, and a fit of fewer points is not a better fit. So profiles are compared on the points
that all of them cover. These are all points with the sides and the corners of a head, because a head is recognised by
its width and its corners: under 0.4 mm of wear a 54E1, a 50E3 and a CHN60 have running parts that cannot be told apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.profiles.segments import SmoothingResult
from fecontact.profiles.smoothing import PRACTICE_MM, fit_deviation, select_running_part
from fecontact.profiles.variants import NO_SUPPORT

# Profiles with a smaller difference in Akaike's criterion are equal except for rounding: two drawings of one profile.
_EQUAL_SUPPORT = 0.1


def choose_nominal(
    smoothings: Sequence[SmoothingResult], noise_mm: float | None
) -> tuple[SmoothingResult, tuple[str, ...]]:
    """Choose the nominal profile that the points support best.

    Profiles without support are dropped one by one, because the points that all remaining profiles cover increase with
    each. Of profiles that have no point in common, the profile that covers the least is dropped. Of the profiles that
    cannot be told apart, those are preferred that cover the points. Of these, the profile is chosen with the best score
    on the running part, where contacts are.

    Parameters
    ----------
    smoothings
        Smoothings of equal points, each as the deviation from a different profile, the nearest profile first.
    noise_mm
        Given standard deviation of the noise (mm); None if it is estimated.

    Returns
    -------
    chosen, equal_names
        Smoothing of the chosen profile, and the names of the profiles that cannot be told apart from it.
    """
    remaining = list(smoothings)
    while True:
        labels = reduce(np.intersect1d, map(_label_points, remaining))
        if not labels.size:
            # profiles without a common point cannot be compared
            covered_mm = [_measure_covered_mm(smoothing) for smoothing in remaining]
            del remaining[covered_mm.index(min(covered_mm))]
            continue
        lacks = _compare(remaining, labels, noise_mm)
        if max(lacks) <= NO_SUPPORT:
            break
        del remaining[lacks.index(max(lacks))]
    # an end that is shorter than the shortest filter does not distinguish profiles
    longest_mm = max(map(_measure_covered_mm, remaining))
    covering = [smoothing for smoothing in remaining if _measure_covered_mm(smoothing) > longest_mm - PRACTICE_MM[0]]
    running_labels = [_label_points(smoothing)[select_running_part(smoothing.held)] for smoothing in covering]
    common_running_labels = reduce(np.intersect1d, running_labels)
    # without a common point on the running part, all common points count
    lacks = _compare(covering, common_running_labels if common_running_labels.size else labels, noise_mm)
    chosen = next(smoothing for smoothing, lack in zip(covering, lacks, strict=True) if lack <= _EQUAL_SUPPORT)
    return chosen, tuple(smoothing.nominal for smoothing in remaining if smoothing is not chosen)


def is_nominal_supported(nominal: SmoothingResult, free: SmoothingResult, noise_mm: float | None) -> bool:
    """Whether points support their nominal profile against a smoothing without it.

    They are compared on the running part that the profile covers, because blunt corners are no reason against it.

    Parameters
    ----------
    nominal, free
        Smoothings of equal points with and without a nominal profile.
    noise_mm
        Given standard deviation of the noise (mm); None if it is estimated.

    Returns
    -------
    bool
        Answer; False if the nominal profile covers no point of the running part.
    """
    is_running = select_running_part(free.held)
    common = np.intersect1d(_label_points(free)[is_running], _label_points(nominal))
    if not common.size:
        return False
    return _rate(nominal, common, noise_mm) <= _rate(free, common, noise_mm)


def _label_points(measured: SmoothingResult) -> NDArray[np.complex128]:
    """Label the points (n,) by their coordinates."""
    return np.asarray(measured.points[:, 0] + 1j * measured.points[:, 1])


def _rate(
    measured: SmoothingResult, labels: NDArray[np.complex128], noise_mm: float | None, filter_mm: float | None = None
) -> float:
    """Score of a smoothing, or of another filter length, on labelled points."""
    rated = np.isin(_label_points(measured), labels)
    *_, score = fit_deviation(measured.held, filter_mm or measured.filter_mm, noise_mm, rated)
    return score


def _compare(
    smoothings: Sequence[SmoothingResult], labels: NDArray[np.complex128], noise_mm: float | None
) -> list[float]:
    """Compare profiles on the points with some labels.

    Each profile has its best score with the filter lengths of all of them: the filter of a profile was chosen on its
    running part, and would decide on the other points.

    Parameters
    ----------
    smoothings
        Smoothings of equal points, each as the deviation from a different profile.
    labels
        Points that all profiles cover.
    noise_mm
        Given standard deviation of the noise (mm); None if it is estimated.

    Returns
    -------
    list of float
        Differences in Akaike's criterion from the best profile.
    """
    filters_mm = {smoothing.filter_mm for smoothing in smoothings}
    scores = [min(_rate(smoothing, labels, noise_mm, length) for length in filters_mm) for smoothing in smoothings]
    best = min(scores)
    if noise_mm is not None:
        return [labels.size * (score - best) / noise_mm**2 for score in scores]
    measured = smoothings[scores.index(best)]
    # waves that neighbouring points have in common reduce the number of independent points
    independent_points = min(1.0, (measured.independent_noise_mm / measured.noise_mm) ** 2) * labels.size
    return [independent_points * math.log(score / best) for score in scores]


def _measure_covered_mm(measured: SmoothingResult) -> float:
    """Length of the part of the points that a profile covers (mm)."""
    chords: Floats = np.hypot(*np.diff(measured.points, axis=0).T)
    return float(chords.sum())
