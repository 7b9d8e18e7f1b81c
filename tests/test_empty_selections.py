"""Profiles without a point in the selection that a mean or a quantile needs."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from points import profile_from_points

from fecontact.errors import InputError
from fecontact.profiles.examples import make_worn_points
from fecontact.profiles.nominal_choice import choose_nominal, is_nominal_supported
from fecontact.profiles.recognition import _measure_field_side_loss_mm
from fecontact.profiles.registration import FootPoints
from fecontact.profiles.smoothing import frame_on_chords, select_running_part, smooth_frame

POINTS = make_worn_points("60E1", 0.0, 0.3, 0.008, np.random.default_rng(1))


@pytest.fixture(autouse=True)
def _no_warnings_of_numpy():
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        yield


def smooth(points, nominal):
    """Smoothing that covers some points; its nominal profile is only a name."""
    smoothing, _ = smooth_frame(frame_on_chords(points), filter_mm=None, noise_mm=None)
    return replace(smoothing, held=replace(smoothing.held, nominal=nominal))


def test_profiles_that_cover_different_points_are_not_compared():
    """The profile that covers most is chosen, in any order."""
    short, long = smooth(POINTS[:90], "short"), smooth(POINTS[100:], "long")
    for smoothings in ([short, long], [long, short]):
        chosen, equal_names = choose_nominal(smoothings, None)
        assert (chosen.nominal, equal_names) == ("long", ())
    chosen, equal_names = choose_nominal([short, long], 0.008)
    assert (chosen.nominal, equal_names) == ("long", ())


def test_profiles_without_a_common_running_point_are_compared_on_their_common_points():
    """The running part of a profile without a flat part is all of it."""
    first_flat = int(np.argmax(select_running_part(smooth(POINTS, "").held)))
    side = smooth(POINTS[:first_flat], "side")
    shoulder = smooth(POINTS[40 : first_flat + 40], "shoulder")
    side_points, shoulder_points = (
        {*map(tuple, smoothing.points[select_running_part(smoothing.held)])} for smoothing in (side, shoulder)
    )
    assert len(side_points) == first_flat
    assert len(shoulder_points) == 40
    assert not side_points & shoulder_points
    chosen, equal_names = choose_nominal([side, shoulder], None)
    # both are smoothings of the same points
    assert {chosen.nominal, *equal_names} == {"side", "shoulder"}


def test_a_nominal_profile_beside_the_running_part_is_not_supported():
    free = smooth(POINTS, "")
    is_running = select_running_part(free.held)
    assert 40 <= np.count_nonzero(is_running) < len(POINTS)
    side = smooth(POINTS[: int(np.argmax(is_running))], "beside")
    assert not is_nominal_supported(side, free, None)
    assert is_nominal_supported(free, free, None)


def test_a_side_above_the_other_side_has_no_loss():
    """All points of a side are lower than the lowest point of the other side."""
    y = np.array([-30.0, -29.0, 28.0, 29.0])

    def measure(z):
        feet = FootPoints(
            s_mm=y, points=np.column_stack((y, z)), normals=np.zeros((4, 2)), off_mm=-np.arange(4.0), inside=y != 0.0
        )
        return _measure_field_side_loss_mm(feet)

    assert measure([-9.0, -8.0, -4.0, -3.5]) is None
    # 0.9 quantiles of 0 and 1, and of 2 and 3
    assert measure([-9.0, -8.0, -9.0, -8.0]) == pytest.approx(2.0)


def test_points_of_which_nearly_all_turn_back_are_refused():
    points = [(0, 0), (0, 1), (0, 2), (0, 0), (0, 1), (0, 0), (0, 1), (0, 0), (1, 0), (-1, 3)]
    with pytest.raises(InputError, match="allowed: at least 10; give the points of the running surface"):
        profile_from_points(*np.array(points, dtype=float).T, kind="rail", name="points")
