"""Whether the nominal of a measured rail is found: every rail of the library, as it is canted and cut in the track."""

import math
from dataclasses import replace

import numpy as np
import pytest
from points import profile_from_points

from fecontact.errors import InputError
from fecontact.profiles.library import EQUAL_HEADS, list_names, load_library_profile
from fecontact.profiles.reading import DEFAULT_READING
from fecontact.profiles.recognition import find_nearest_profiles
from fecontact.profiles.segments import Registration

CANTS = (0.0, 1.0 / 40.0, 1.0 / 20.0)
# Where an instrument ends beside the head (mm below the top).
CUT_MM = 16.0


def measure_rail(name, cant, *, cut, seed=0, noise_mm=0.005, step_mm=0.3):
    """Points along a rail of the library that stands in the track, its top anywhere."""
    line = load_library_profile(name)
    p = line.evaluate(line.at_arc_length(np.arange(0.0, line.length_mm, step_mm)))
    noise = noise_mm * np.random.default_rng(seed).normal(size=p.y.size)
    points = np.column_stack((p.y - noise * np.sin(p.angle_rad), p.z + noise * np.cos(p.angle_rad)))
    points = Registration(turn_rad=-math.atan(cant), shift=(1.0, -0.5)).from_reference(points)
    return points[points[:, 1] > points[:, 1].max() - CUT_MM] if cut else points


# the 5 of 17 rails that a filter by the middles of both heads missed most often, and the rail of the benchmark
@pytest.mark.parametrize(("cant", "cut"), [(CANTS[1], True), (CANTS[2], False)])
@pytest.mark.parametrize("name", ["60E1", "60E2", "A65", "54E4", "56E1", "MBench_UIC60"])
def test_the_nominal_of_a_canted_rail_is_found(name, cant, cut):
    assert find_nearest_profiles(measure_rail(name, cant, cut=cut), "rail")[0].name == name


@pytest.mark.slow
@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("cant", CANTS)
@pytest.mark.parametrize("name", list_names("rail"))
def test_every_rail_of_the_library_is_smoothed_towards_itself(name, cant, cut):
    """A rail with the head of a different rail has the name of that rail."""
    points, nominal = measure_rail(name, cant, cut=cut, seed=7), EQUAL_HEADS.get(name, name)
    assert find_nearest_profiles(points, "rail")[0].name == nominal
    # a head that is canted outwards may be mirrored: the user settles it
    reading = DEFAULT_READING
    if cant > 0.0:
        with pytest.raises(InputError, match="may be mirrored"):
            profile_from_points(*points.T, kind="rail", name="p", reading=reading)
        reading = replace(reading, mirror=False)
    line = profile_from_points(*points.T, kind="rail", name="p", reading=reading)
    assert line.measured.nominal == nominal
    # its rotation, within the error that noise of 0.005 mm leaves on a head of 70 mm
    assert line.measured.held.registration.turn_rad == pytest.approx(-math.atan(cant), abs=1e-4)
    # the mirror image is canted as in the track
    mirrored = profile_from_points(*(points[::-1] * (-1, 1)).T, kind="rail", name="p", reading=DEFAULT_READING)
    assert mirrored.measured.held.registration.turn_rad == pytest.approx(math.atan(cant), abs=1e-4)
