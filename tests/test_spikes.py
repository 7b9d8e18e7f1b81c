"""A single wrong point in a table of exact points.

The wrong point is found at its place, and no point of a good table counts as wrong.
"""

import numpy as np
import pytest
from points import profile_from_points

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.profiles.library import EQUAL_HEADS, list_names, load_library_profile
from fecontact.profiles.point_noise import estimate_noise_mm
from fecontact.profiles.point_problems import find_crossings
from fecontact.profiles.points import find_spikes, find_unclear_points
from fecontact.profiles.reading import Reading
from fecontact.profiles.writers import sample_points
from fecontact.solving.hertz import compute_hertz
from fecontact.solving.placing import place_case
from fecontact.solving.profile_variants import estimate_hertz_uncertainty


def along(name, step_mm, start_mm=0.0):
    """Points evenly along the line, and its normals."""
    profile = load_library_profile(name)
    p = profile.evaluate(profile.at_arc_length(np.arange(start_mm, profile.length_mm, step_mm)))
    return np.column_stack((p.y, p.z)), np.column_stack((-np.sin(p.angle_rad), np.cos(p.angle_rad)))


def over_y(name, step_mm):
    """Points at equal steps in y.

    On the sides they are many steps apart.
    """
    profile = load_library_profile(name)
    low, high = profile.y_range_mm
    y = np.arange(low + 0.05, high - 0.05, step_mm)
    z = profile.height(y)
    return np.column_stack((y, z))[np.isfinite(z)]


# --- good tables ------------------------------------------------------------------------------------------------


# profiles with the running surface of a different profile are left out: rails with an equal head, and flange heights
DISTINCT = [name for name in list_names() if name not in EQUAL_HEADS and "_h" not in name]


@pytest.mark.parametrize("digits", [12, 4, 3])
@pytest.mark.parametrize("step_mm", [0.1, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("name", DISTINCT)
def test_no_exact_profile_has_any(name, step_mm, digits):
    """Exact profiles written as rounded points in three ways.

    Corners, junctions and short arcs are among them.
    """
    lines = [
        sample_points(load_library_profile(name), step_mm),
        along(name, step_mm, 0.3 * step_mm)[0],
        over_y(name, step_mm),
    ]
    for line in lines:
        points = np.round(line, digits)
        assert find_spikes(points) == []
        assert find_unclear_points(points) == []


@pytest.mark.parametrize("noise_mm", [0.005, 0.01, 0.02])
@pytest.mark.parametrize("step_mm", [0.1, 0.2, 0.5])
@pytest.mark.parametrize("name", ["60E1", "54E1", "S1002"])
def test_no_noise_is_any(name, step_mm, noise_mm):
    for seed in range(6):
        line, normals = along(name, step_mm)
        points = line + noise_mm * np.random.default_rng(seed).normal(size=len(line))[:, None] * normals
        assert find_spikes(points) == []
        assert find_unclear_points(points) == []


@pytest.mark.parametrize("direction", [(0.0, 1.0), (1.0, 0.0)], ids=["height", "across"])
@pytest.mark.parametrize("step_mm", [0.1, 0.2, 0.5])
@pytest.mark.parametrize("name", ["60E1", "54E1", "S1002"])
def test_no_noise_in_one_direction_is_any(name, step_mm, direction):
    """Noise in one direction, which affects one half of the points of a section.

    The steep half, or the flat half, has hardly any of this noise and gives no estimate for the other half.
    """
    noises = []
    for seed in range(6):
        line, _ = along(name, step_mm)
        points = line + 0.01 * np.random.default_rng(seed).normal(size=len(line))[:, None] * np.array(direction)
        assert find_spikes(points) == []
        assert find_unclear_points(points) == []
        noises.append(estimate_noise_mm(points))
    # points at 45 degrees have seven tenths of it, and 70 of a flange know theirs to a third: measured 0.80 to 1.01
    assert np.mean(noises) == pytest.approx(0.01, rel=0.25)


# --- wrong points -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size_mm", [-0.03, 0.001, 0.0003])
@pytest.mark.parametrize("step_mm", [0.2, 0.5])
@pytest.mark.parametrize("name", ["60E1", "54E1", "S1002"])
def test_one_wrong_point_of_an_exact_table_is_named(name, step_mm, size_mm):
    """Wrong points anywhere on the running surface, except next to a junction.

    There the message is only that the cause is not clear.
    """
    points, normals = along(name, step_mm)
    junctions = np.array([j.y_mm for j in load_library_profile(name).junctions])
    inner = np.flatnonzero(np.abs(points[:, 0]) < 25.0)
    for k in inner[:: max(1, len(inner) // 25)]:
        wrong = points.copy()
        wrong[k] += size_mm * normals[k]
        named_spikes = find_spikes(wrong)
        if named_spikes:
            assert [problem.index for problem in named_spikes] == [k]
            assert named_spikes[0].size_mm == pytest.approx(size_mm, rel=0.1)
        else:
            assert np.abs(junctions - points[k, 0]).min() < 5.0 * step_mm


def test_a_wrong_digit_is_refused_and_left_out_on_request():
    """An error of 0.03 mm in y of one point.

    Hertz was wrong by 80 %, and there was no message.
    """
    points = sample_points(load_library_profile("54E1"), 0.5)
    k = int(np.argmin(np.abs(points[:, 0] + 14.0)))
    points[k, 0] -= 0.03
    with pytest.raises(InputError, match=rf"a spike of 0\.0025 mm at point {k + 1}, .*; correct the file, or give"):
        profile_from_points(*points.T, kind="rail", name="p")
    mended = profile_from_points(*points.T, kind="rail", name="p", reading=Reading(repair=True, filter_mm=0.0))
    # without it the spline has one gap of 1 mm on R 80 mm, whose cubic is 1e-5 mm off
    y = np.linspace(-15.0, -13.0, 41)
    assert mended.height(y) == pytest.approx(load_library_profile("54E1").height(y), abs=1e-4)


def test_a_wrong_point_beside_a_junction_is_told():
    points, normals = along("60E1", 0.5)
    junction = next(j.y_mm for j in load_library_profile("60E1").junctions if abs(j.y_mm) < 12.0)
    noted = 0
    for k in np.flatnonzero(np.abs(points[:, 0] - junction) < 1.2):
        wrong = points.copy()
        wrong[k] += 0.01 * normals[k]
        try:
            profile = profile_from_points(*wrong.T, kind="rail", name="p")
        except InputError:
            noted += 1
        else:
            noted += any("off the profile on both of its sides" in note for note in profile.notes)
    assert noted >= 4


@pytest.mark.parametrize(("name", "shift_mm", "step_mm", "y_mm", "off_mm"), [
    ("60E1", 5.75, 1.0, -28.797, -0.08), ("50E6", 3.5, 0.5, -23.362, -0.008),
])  # fmt: skip
def test_what_a_wrong_point_beside_a_junction_does_to_hertz_is_stated(name, shift_mm, step_mm, y_mm, off_mm):
    """A wrong point that cannot be distinguished from the junction.

    One half of the points does not contain it, whichever half it is in.
    """
    case = Case(rail=name, wheel="S1002", lateral_shift_mm=shift_mm, roll="given")
    true = compute_hertz(case, place_case(case)).p0_MPa
    points = sample_points(load_library_profile(name), step_mm)
    k = int(np.argmin(np.abs(points[:, 0] - y_mm)))
    points[k, 1] += off_mm
    rail = profile_from_points(*points.T, kind="rail", name="p")
    placement = place_case(case, rail=rail)
    hertz_MPa, stated = compute_hertz(case, placement).p0_MPa, estimate_hertz_uncertainty(case, placement)["p_max_MPa"]
    assert 0.1 < abs(true - hertz_MPa) / hertz_MPa < stated


@pytest.mark.parametrize("on_first", [-0.05, 0.05, 0.95, 1.05])
@pytest.mark.parametrize("on_last", [-0.05, 0.05, 0.95, 1.05])
def test_a_line_crosses_itself_where_both_chords_do_however_near_to_their_ends(on_first, on_last):
    """Two chords of different length that cross.

    The first chord is 10 mm long. The last chord is upright, 4 mm long, and meets its line at fractions of both
    lengths.
    """
    x, low = 10.0 * on_first, -4.0 * on_last
    line = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, -9.0], [-20.0, -9.0], [-20.0, low], [x, low], [x, low + 4.0]])
    loops = [(crossing.what, crossing.size_mm) for crossing in find_crossings(line) if crossing.index == 0]
    is_on_both = 0.0 < on_first < 1.0 and 0.0 < on_last < 1.0
    assert loops == ([("crosses itself", pytest.approx(10.0))] if is_on_both else [])


@pytest.mark.parametrize("at", [4, 30, 55])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_loop_is_found_wherever_it_lies_and_from_whichever_side_the_line_comes(at, side):
    """A loop between the points `at` and `at` + 5 of a line of 60 mm.

    The last chord of the loop crosses its first chord.
    """
    y = np.arange(61.0)
    loop = y[at] + np.array([0.4, 1.5, 1.5, 0.6, 0.6])
    line = np.column_stack((np.insert(y, at + 1, loop), np.insert(np.zeros(61), at + 1, [0.0, 0.0, 2.0, 2.0, -2.0])))
    line[:, 0] *= side
    assert [crossing.index for crossing in find_crossings(line)] == [at + 1]


def test_few_points_say_nothing_of_their_noise():
    """Each point needs two neighbours on either side."""
    zigzag = np.column_stack([np.arange(5.0), 0.1 * (-1.0) ** np.arange(5)])
    assert estimate_noise_mm(zigzag[:4]) == 0.0
    assert estimate_noise_mm(zigzag) > 0.05
