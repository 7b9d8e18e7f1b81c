"""Dimensions of flanges, against the formulas of the standard profiles."""

import math

import numpy as np
import pytest

from fecontact.profiles.examples import make_worn_points, write_examples
from fecontact.profiles.flange import measure_flange
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import resolve_wheel
from fecontact.profiles.writers import sample_points

# S1002 (UIC 510-2, h 28, e 32.5), lateral position from the tape circle and depth below it: tip on an arc of R 12 about
# (-55, 16), flank on an arc of R 20 about (-58.558326, 8.834924), root on an arc of R 13 about (-26.210665, 16.446).
TIP_DEPTH = 16.0 + 12.0
ROOT_AT_10 = -26.210665 - math.sqrt(13.0**2 - (16.446 - 10.0) ** 2)
FLANK_AT_26 = -58.558326413 + math.sqrt(20.0**2 - (26.0 - 8.834924130) ** 2)


@pytest.mark.parametrize("name", ["S1002", "EN13715_1in40"])
def test_standard_flanges_have_the_dimensions_of_their_formulas(name):
    # both profiles have the flange h 28, e 32.5; the numbers of the standard have rounding of 0.1 um to 0.2 um
    flange = measure_flange(load_library_profile(name))
    assert flange.height_mm == pytest.approx(TIP_DEPTH, abs=1e-3)
    assert flange.thickness_mm == pytest.approx(70.0 + ROOT_AT_10, abs=1e-3)
    assert flange.thickness_mm == pytest.approx(32.5, abs=1e-3)
    assert flange.qr_mm == pytest.approx(ROOT_AT_10 - FLANK_AT_26, abs=1e-3)


def write_wheel(path, points):
    np.savetxt(path, points, delimiter=",", header="y_mm,z_mm", comments="")
    return resolve_wheel(str(path), Reading(filter_mm=4.0)).profile


@pytest.mark.parametrize("wear_mm", [0.0, 1.5])
def test_measured_flanges_have_the_dimensions_of_their_wear(tmp_path, wear_mm):
    # The tread is worn at the tape circle, the flange is not: Sh grows by the wear, and the level of Sd is nearer to
    # the tread by the wear, on the same arc. Noise of 5 um, smoothed over 4 mm, leaves about 10 um.
    points = make_worn_points("S1002", 0.0, wear_mm, 0.005, np.random.default_rng(1)) - (0.0, wear_mm)
    flange = measure_flange(write_wheel(tmp_path / "worn.csv", points))
    worn_root = -26.210665 - math.sqrt(13.0**2 - (16.446 - 10.0 + wear_mm) ** 2)
    assert flange.height_mm == pytest.approx(TIP_DEPTH + wear_mm, abs=0.03)
    assert flange.thickness_mm == pytest.approx(70.0 + worn_root, abs=0.03)
    assert flange.qr_mm == pytest.approx(worn_root - FLANK_AT_26, abs=0.05)


def test_profiles_without_a_flange_have_no_dimensions(tmp_path):
    assert measure_flange(load_library_profile("60E1")) is None
    assert measure_flange(resolve_wheel("cylinder:460", Reading()).profile) is None
    write_examples(tmp_path)
    assert measure_flange(resolve_wheel(str(tmp_path / "wheel.csv"), Reading()).profile) is not None
    # a profile that ends before the tip
    points = sample_points(load_library_profile("S1002"), 0.2)
    assert measure_flange(write_wheel(tmp_path / "short.csv", points[points[:, 0] > -52.0])) is None
