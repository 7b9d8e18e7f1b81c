"""Rounded points: the stated range of the peak contains the exact peak.

The reference is the half-space on the exact profile of the library. The points of one body are rounded; the nominal
profile is not used, because with it the points would be smoothed to the exact profile itself.
"""

from functools import cache

import numpy as np
import pytest
from points import profile_from_points

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.reading import Reading
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space
from fecontact.solving.profile_variants import judge_case_variants

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
@pytest.mark.parametrize("step_mm", [0.01, 0.001])
def test_the_stated_range_of_the_peak_contains_the_exact_peak_as_the_guide_says(step_mm):
    # the range is that of smoothed profiles: a filter of 4 mm smooths a jump of the curvature, so that the exact peak
    # is at most 2 % outside, less than half of the limit of the verdict
    missing = [find_missing_percent(body, step_mm, spacing_mm) for body in NAMES for spacing_mm in (0.1, 0.25, 0.5)]
    values = [value for by_shift in missing for value in by_shift.values()]
    assert values.count(0.0) >= 0.9 * len(values)
    assert max(values) < 2.0
