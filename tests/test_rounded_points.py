"""Rounded points: their noise is found, verdicts are decided, and the stated range of the peak contains the exact peak.

The reference of the peaks is the half-space on the exact profile of the library. The points of one body are rounded;
the nominal profile is not used, because with it the points would be smoothed to the exact profile itself.
"""

from functools import cache

import numpy as np
import pytest
from points import profile_from_points

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ
from fecontact.criteria import Criteria
from fecontact.judging.lines import VariantShifts
from fecontact.judging.verdict import judge_profile_variants
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.point_noise import estimate_noise_mm, estimate_rounding_step_mm, find_rounding_noise_mm
from fecontact.profiles.reading import Reading
from fecontact.profiles.smoothing import draw_noise, frame_on_chords, select_running_part, smooth_frame
from fecontact.profiles.smoothing_splines import fit_smoothing_spline
from fecontact.profiles.variants import make_profile_variants
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space
from fecontact.solving.profile_variants import judge_case_variants, list_profile_variants

NAMES = {"rail": "60E1", "wheel": "S1002"}
SHIFTS_MM = (-6.0, -5.0, -4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0)
# Error of a half-space with 16 nodes per semi-axis, by which a range is widened.
READING = 0.002


def rounded_points(body, step_mm, spacing_mm):
    exact = load_library_profile(NAMES[body])
    p = exact.evaluate(exact.at_arc_length(np.arange(0.0, exact.length_mm, spacing_mm)))
    points = np.round(np.column_stack((p.y, p.z)) / step_mm) * step_mm
    return points[np.concatenate(([True], np.any(np.diff(points, axis=0) != 0.0, axis=1)))]


def case_at(shift_mm):
    return Case(lateral_shift_mm=shift_mm, roll="given", load_N=80e3)


@cache
def exact_peak_MPa(shift_mm):
    case = case_at(shift_mm)
    return expect_on_half_space(case, place_case(case), nodes=16)[1].half_space.pressure_MPa.max()


def find_missing_percent(body, step_mm, spacing_mm, shifts_mm=SHIFTS_MM):
    """Distance of the exact peak from the stated range by shift, in percent."""
    points = rounded_points(body, step_mm, spacing_mm)
    reading = Reading(nominal="none", mirror=False if body == "rail" else None)
    profile = profile_from_points(*points.T, kind=body, name="rounded", reading=reading)
    missing_percent = {}
    for shift_mm in shifts_mm:
        case = case_at(shift_mm)
        variants = judge_case_variants(case, place_case(case, **{body: profile}))
        low, high = variants.find_shifts(HERTZ).band(variants.own.p_max_MPa, READING)
        peak = exact_peak_MPa(shift_mm)
        missing_percent[shift_mm] = 1e2 * max(low / peak - 1.0, 1.0 - high / peak, 0.0)
    return missing_percent


def test_the_stated_range_of_the_peak_contains_the_exact_peak():
    assert find_missing_percent("wheel", 0.01, 0.25, SHIFTS_MM[1::3]) == dict.fromkeys(SHIFTS_MM[1::3], 0.0)


@pytest.mark.slow
@pytest.mark.parametrize(("step_mm", "least_inside"), [(0.01, 50), (0.001, 43)])
def test_the_stated_range_of_the_peak_contains_the_exact_peak_as_the_guide_says(step_mm, least_inside):
    # The range is that of smoothed profiles: a filter of 4 mm smooths a jump of the curvature, and four noise samples
    # do not span the whole noise. The numbers inside, of 60, are those that were measured. At the others the exact peak
    # is at most 2 % outside, less than half of the limit of the verdict, and by less than 0.5 % at most of them.
    missing = [find_missing_percent(body, step_mm, spacing_mm) for body in NAMES for spacing_mm in (0.1, 0.25, 0.5)]
    values = np.array([value for by_shift in missing for value in by_shift.values()])
    assert np.count_nonzero(values == 0.0) >= least_inside
    assert values.max() < 2.0
    assert np.median(values[values > 0.0]) < 0.5


# --- the noise of rounded points -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("step_mm", "scale", "expected_mm"), [(0.01, 1.0, 0.01), (0.005, 1.0, 0.005), (0.001, 25.4, 0.0254)]
)
def test_the_step_of_rounding_is_found(step_mm, scale, expected_mm):
    points = scale * rounded_points("rail", step_mm, 0.25)
    for changed in (points, points[::-1] * (-1, 1) + (70.0 / 3.0, -1.0 / 7.0)):
        assert estimate_rounding_step_mm(changed) == pytest.approx(expected_mm, rel=1e-12)
    # a few points that ends of cuts add are not rounded
    cut = np.vstack((points, points[-1] + (0.0123456, -0.3)))
    assert estimate_rounding_step_mm(cut) == pytest.approx(expected_mm, rel=1e-12)
    # turned points have no step, and neither have points that are not rounded
    rotation = np.array([[np.cos(0.05), np.sin(0.05)], [-np.sin(0.05), np.cos(0.05)]])
    assert estimate_rounding_step_mm(points @ rotation) == 0.0


def test_a_grid_of_lateral_positions_is_not_the_step_of_rounding():
    y = np.arange(-30.0, 30.0, 0.25)
    assert estimate_rounding_step_mm(np.column_stack((y, np.round(-(y**2) / 600.0, 3)))) == 0.001


@pytest.mark.parametrize("body", NAMES)
@pytest.mark.parametrize("spacing_mm", [0.1, 0.25, 0.5])
def test_rounding_is_all_noise_unless_points_scatter_more(body, spacing_mm):
    """Points rounded to 0.01 mm, alone and with normal noise of 5 um before rounding."""

    def find_noise_mm(points):
        return find_rounding_noise_mm(points, select_running_part(frame_on_chords(points)))

    points = rounded_points(body, 0.01, spacing_mm)
    assert find_noise_mm(points) == pytest.approx(0.01 / np.sqrt(12.0), rel=1e-12)
    exact = rounded_points(body, 1e-9, spacing_mm)
    noise = 0.005 * np.random.default_rng(3).normal(size=exact.shape)
    assert find_noise_mm(np.round(exact + noise, 2)) == 0.0


def test_noise_samples_have_the_noise_of_the_points_once():
    """A residual of independent noise is not counted as waves of neighbouring points too."""
    y = np.arange(-35.0, 35.0, 0.2)
    for noise_mm in (None, 0.004):
        z = -(y**2) / 600.0
        z = np.round(z, 2) if noise_mm is None else z + noise_mm * np.random.default_rng(2).normal(size=y.size)
        measured, _ = smooth_frame(frame_on_chords(np.column_stack((y, z))), filter_mm=None, noise_mm=None)
        assert measured.is_noise_known == (noise_mm is None)
        samples = draw_noise(measured, [1], 200)
        expected_mm = 0.01 / np.sqrt(12.0) if noise_mm is None else estimate_noise_mm(measured.points)
        # with both it would be 1.4 times as large
        assert np.sqrt(np.mean(samples**2)) == pytest.approx(expected_mm, rel=0.1)


def test_independent_noise_passes_the_requested_filter():
    """Changed noise through the filter of the smoothing equals noise through the requested filter."""
    y = np.arange(-35.0, 35.0, 0.2)
    points = np.column_stack((y, np.round(-(y**2) / 600.0, 2)))
    measured, _ = smooth_frame(frame_on_chords(points), filter_mm=4.0, noise_mm=0.003)
    noise, changed = draw_noise(measured, [1], 3), draw_noise(measured, [1], 3, independent_filter_mm=6.0)
    expected = fit_smoothing_spline(measured.s_mm, noise, 6.0)(measured.s_mm, 2)
    assert fit_smoothing_spline(measured.s_mm, changed, 4.0)(measured.s_mm, 2) == pytest.approx(expected, abs=1e-9)


def test_a_filter_that_is_too_short_for_the_rounding_widens_ranges_and_does_not_judge():
    reading = Reading(nominal="none", mirror=False)
    points = rounded_points("rail", 0.01, 0.25)
    profile = profile_from_points(*points.T, kind="rail", name="rounded", reading=reading)
    assert profile.measured.held.relative_filter is not None
    variants = make_profile_variants(profile)
    lengths = [(round(variant.filter_mm / profile.measured.filter_mm, 2), variant.is_judged) for variant in variants]
    assert lengths[:2] == [(0.71, False), (1.41, True)]
    labels = [*list_profile_variants(profile)]
    assert [label.split(" ")[0] for label in labels] == ["short", "filter", *["noise"] * 4]
    # more noise than that of rounding is estimated: a part of it may be profile, and both filters are judged
    exact = rounded_points("rail", 1e-9, 0.25)
    noisy = np.round(exact + 0.005 * np.random.default_rng(3).normal(size=exact.shape), 2)
    profile = profile_from_points(*noisy.T, kind="rail", name="noisy", reading=reading)
    assert all(variant.is_judged for variant in make_profile_variants(profile))
    # its deviation is in the stated uncertainty, its peak in the range
    shifts = {"own": 1.0, labels[0]: 0.8, labels[1]: 1.01}
    moves = VariantShifts(by_line={label: {"p_max_MPa": factor} for label, factor in shifts.items()}, peaks=shifts)
    criteria = Criteria(judged_by=("p_max",))
    verdict, stated = judge_profile_variants({"p_max_MPa": 0.01}, {"p_max_MPa": 0.0}, moves, criteria)
    assert (verdict.answer, [*verdict.variant_answers]) == ("HOLDS", ["own", labels[1]])
    assert stated["p_max_MPa"] == pytest.approx(0.2 * 1.01)
    assert moves.band(1000.0) == pytest.approx((800.0, 1010.0))
