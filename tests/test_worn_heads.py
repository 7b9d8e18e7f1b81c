"""Worn heads: Hertz on the smoothed profile of noisy points, and its stated uncertainty.

The reference is Hertz on the exact worn line. Wear is planted as a smooth depth that is taken off in the vertical: the
exact line is the spline through points 0.05 mm apart without noise. The measured points are 0.2 mm apart with 10 um of
noise. Hertz's peak pressure is taken under 100 kN.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from points import profile_from_points

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.reading import DEFAULT_READING
from fecontact.solving.hertz import compute_hertz
from fecontact.solving.placing import place_case
from fecontact.solving.profile_variants import estimate_hertz_uncertainty

# Centre (mm across, gauge side negative) and width of 1 mm of wear.
SHAPES = {"top": (-5.0, 18.0), "field side": (8.0, 14.0), "gauge corner": (-22.0, 12.0), "wide": (-8.0, 22.0)}
SHIFTS_MM = (-4.0, 0.0, 4.0)
# A head with 1 mm of wear on its field side has lost 0.78 mm more there than on its gauge side: the reader asks whether
# its file is mirrored.
NOT_MIRRORED = replace(DEFAULT_READING, mirror=False)


def worn(shape, noise_mm=0.0, step_mm=0.05, seed=0):
    centre, width = SHAPES[shape]
    line = load_library_profile("60E1")
    p = line.evaluate(line.at_arc_length(np.arange(0.0, line.length_mm, step_mm)))
    noise = noise_mm * np.random.default_rng([seed, 23]).normal(size=p.y.size)
    depth = np.exp(-(((p.y - centre) / width) ** 2))
    return p.y - noise * np.sin(p.angle_rad), p.z - depth + noise * np.cos(p.angle_rad)


@cache
def exact(shape, shift_mm):
    case = Case(lateral_shift_mm=shift_mm, roll="given")
    rail = profile_from_points(*worn(shape), kind="rail", name="exact", reading=NOT_MIRRORED)
    return compute_hertz(case, place_case(case, rail=rail)).p0_MPa


def errors(shape, seeds):
    """Relative errors of the peak and their stated uncertainties, (n,) each."""
    errors_percent = []
    for seed in seeds:
        rail = profile_from_points(*worn(shape, 0.01, 0.2, seed), kind="rail", name="worn", reading=NOT_MIRRORED)
        # the same head, by another drawing, or none where its wear has shorter waves than it has itself
        assert rail.measured.nominal in ("60E1", "MBench_UIC60", "")
        for shift in SHIFTS_MM:
            case = Case(lateral_shift_mm=shift, roll="given")
            placement = place_case(case, rail=rail)
            error = abs(compute_hertz(case, placement).p0_MPa / exact(shape, shift) - 1.0)
            errors_percent.append((error, estimate_hertz_uncertainty(case, placement)["p_max_MPa"]))
    return np.array(errors_percent).T


@pytest.mark.parametrize("shape", SHAPES)
def test_only_a_head_that_is_worn_on_its_field_side_is_asked_for_its_mirror(shape):
    """The loss on the field side minus the loss on the gauge side is planted: -0.43, 0.78, -0.95 and -0.47 mm.

    A question needs 0.5 mm, or a head that leans outwards without a worn gauge side. The mirror image of the head of
    the question is worn on its gauge side, and is read without a question.
    """
    y, z = worn(shape, 0.01, 0.2, 500)
    if shape != "field side":
        assert profile_from_points(y, z, kind="rail", name="worn", reading=DEFAULT_READING).measured
        return
    with pytest.raises(InputError, match=r"its field side is worn 0\.\d mm more than its gauge side"):
        profile_from_points(y, z, kind="rail", name="worn", reading=DEFAULT_READING)
    mirror_image = profile_from_points(-y[::-1], z[::-1], kind="rail", name="worn", reading=DEFAULT_READING)
    assert not any("mirrored" in note for note in mirror_image.notes)


def test_a_worn_top_is_known_to_a_percent():
    """The profile without the nominal profile does not count either.

    Its corners are blunt, and its points speak against it.
    """
    error, stated = errors("top", (500,))
    assert stated.max() < 0.02
    assert np.all(error <= stated)


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
def test_what_is_stated_of_worn_heads_covers_the_error_and_is_not_much_more(shape):
    """Thirty seeds that were not used to choose any constant."""
    error, stated = errors(shape, range(500, 530))
    assert np.mean(error <= stated) >= 0.95
    # two standard deviations are 95 %; three, and the scatter of six draws. The worn top has 3.07: its error is 0.6 %
    # with its own rail as nominal profile, and was 0.7 % where another drawing of the rail was taken
    assert np.median(stated) <= 3.2 * np.sqrt(np.mean(error**2))
