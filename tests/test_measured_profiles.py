"""Measured points: the nearest profile, the smoothed line, and the messages before a solution."""

import json
import math
import re
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from points import profile_from_points, simpack
from scipy.interpolate import make_smoothing_spline

from fecontact.case import Case, Track
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.outputs.figures.position import draw_preview
from fecontact.outputs.preview import preview_lines, preview_record
from fecontact.outputs.profiles import draw_profile, nearest_text
from fecontact.profiles.curve import Profile
from fecontact.profiles.library import list_names, load_library_profile
from fecontact.profiles.point_noise import compare_with_neighbours, estimate_noise_mm
from fecontact.profiles.reading import Reading
from fecontact.profiles.recognition import _describe_choices, _measure_field_side_loss_mm, find_nearest_profiles
from fecontact.profiles.registration import (
    FootPoints,
    ProfileChain,
    _find_foot_points,
    _move_to_references,
    estimate_shift,
    find_foot_points,
    register,
    register_all,
)
from fecontact.profiles.segments import Polynomial, Registration
from fecontact.profiles.smoothing_splines import fit_smoothing_spline, minimise_bending
from fecontact.profiles.variants import _ContentKey, _measure_length_mm, scale_deviation
from fecontact.solving.hertz import compute_hertz
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space
from fecontact.solving.preview import preview_case


def sampled(name, noise_mm=0.0, step_mm=0.2, seed=0, *, wear=None, registration=None):
    """Points along an exact line: worn by a depth over y below the line, with noise across it, and moved."""
    profile = load_library_profile(name)
    s = np.arange(0.0, profile.length_mm, step_mm)
    p = profile.evaluate(profile.at_arc_length(s))
    normal = np.column_stack((-np.sin(p.angle_rad), np.cos(p.angle_rad)))
    depth = np.zeros(s.size) if wear is None else wear(p.y)
    off = noise_mm * np.random.default_rng(seed).normal(size=s.size) - depth
    points = np.column_stack((p.y, p.z)) + off[:, None] * normal
    return points if registration is None else registration.from_reference(points)


def read(points, kind="rail", **reading):
    return profile_from_points(*points.T, kind=kind, name="p", reading=Reading(**reading))


def corner_wear(y):
    """Wear at the gauge corner; the rest of the head shows the place of the rail."""
    return 0.6 * np.exp(-(((y + 25.0) / 8.0) ** 2))


# --- foot points and registration --------------------------------------------------------------------------------


def test_foot_points_are_at_right_angles():
    line = load_library_profile("60E1")
    points = sampled("60E1", wear=lambda y: 0.3 + 0.0 * y)
    feet = find_foot_points(line, points)
    inside = feet.inside
    assert np.count_nonzero(inside) > 0.97 * inside.size
    # 0.3 mm below the line, everywhere
    assert feet.off_mm[inside] == pytest.approx(-0.3, abs=1e-9)
    assert np.hypot(*(points - feet.points).T)[inside] == pytest.approx(0.3, abs=1e-9)


@pytest.mark.parametrize(
    "expected",
    [Registration(), Registration(turn_rad=-0.025, shift=(3.0, -1.0)), Registration(turn_rad=0.05, shift=(0.4, 2.0))],
)
@pytest.mark.parametrize("name", ["60E1", "54E1", "S1002"])
def test_a_moved_line_is_found_where_it_lies(name, expected):
    registration, usual = register(load_library_profile(name), sampled(name, registration=expected))
    assert registration.turn_rad == pytest.approx(expected.turn_rad, abs=1e-7)
    assert registration.shift == pytest.approx(expected.shift, abs=1e-6)
    assert usual < 1e-6


@pytest.mark.parametrize(
    ("kind", "name", "wear"), [("rail", "54E1", corner_wear), ("wheel", "S1002", None), ("wheel", "CONE20", None)]
)
def test_lines_together_are_found_where_each_is_by_itself(kind, name, wear):
    """Registration of several profiles together equals that of each profile alone.

    The points are also far off the profiles, beyond their ends, and along a straight line, where nothing says how far
    along.
    """
    displacement = Registration(turn_rad=0.02, shift=(1.0, -0.7))
    points = sampled(name, 0.01, 1.7, wear=wear, registration=displacement)
    lines = [load_library_profile(one) for one in list_names(kind)]
    begin = [Registration(shift=estimate_shift(one, points)) for one in lines]
    for steps in (1, 6):
        together, usuals, _ = register_all(ProfileChain.of(*lines), points, begin, steps=steps)
        for one, begun, registration, usual in zip(lines, begin, together, usuals, strict=True):
            (alone,), (usual_alone,), _ = register_all(ProfileChain.of(one), points, [begun], steps=steps)
            assert registration.turn_rad == pytest.approx(alone.turn_rad, abs=1e-9)
            assert registration.shift == pytest.approx(alone.shift, abs=1e-9)
            assert usual == pytest.approx(usual_alone, abs=1e-9)
    # registered, on a part that some lines do not reach to
    feet = _find_foot_points(ProfileChain.of(*lines), _move_to_references(together, points))
    assert not feet.inside.all()
    for number, (line, registered) in enumerate(zip(lines, together, strict=True)):
        alone = find_foot_points(line, registered.to_reference(points))
        registration_feet = feet.of(number)
        assert np.array_equal(registration_feet.inside, alone.inside)
        for was, now in (
            (alone.s_mm, registration_feet.s_mm),
            (alone.off_mm, registration_feet.off_mm),
            (alone.points, registration_feet.points),
        ):
            assert np.abs(now - was)[alone.inside].max() < 1e-9


@pytest.mark.parametrize("is_turned", [False, True])
def test_two_drawings_of_one_profile_are_told_in_the_order_of_the_library(is_turned):
    """Both are as near, but for rounding."""
    points = sampled("S1002", 0.01, seed=int(is_turned), registration=Registration(turn_rad=0.01 * is_turned))
    points = points[points[:, 0] < 30.0]
    drawings = [
        candidate for candidate in find_nearest_profiles(points, "wheel") if candidate.name in ("S1002", "MBench_S1002")
    ]
    assert [candidate.name for candidate in drawings] == ["MBench_S1002", "S1002"]
    assert drawings[0].usual_mm == pytest.approx(drawings[1].usual_mm, abs=1e-9)


def test_the_way_back_is_the_way_back():
    move = Registration(turn_rad=0.3, shift=(5.0, -2.0))
    points = np.array([[1.0, 2.0], [-30.0, 4.0]])
    assert move.to_reference(move.from_reference(points)) == pytest.approx(points, abs=1e-14)


# --- recognition --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["60E1", "54E1", "49E1", "60E2", "46E1", "S1002"])
def test_a_noisy_profile_is_recognised(name):
    kind = load_library_profile(name).kind
    candidates = find_nearest_profiles(sampled(name, 0.01), kind)
    # the benchmark's wheel is the S1002 without its chamfer
    assert candidates[0].name in (name, f"MBench_{name}")
    assert candidates[0].usual_mm == pytest.approx(0.01, rel=0.25)


def test_a_worn_rail_is_its_rail_and_its_wear():
    points = sampled("60E1", 0.01, wear=corner_wear)
    assert find_nearest_profiles(points, "rail")[0].name == "60E1"
    measured = read(points).measured
    assert measured.nominal == "60E1"
    text = nearest_text(find_nearest_profiles(points, "rail"), "54E1")
    assert "nearest library profile, over all points: 60E1" in text
    # another one than it is smoothed from is no riddle
    assert text.endswith("; smoothed is the deviation from 54E1")
    assert "smoothed" not in nearest_text(find_nearest_profiles(points, "rail"), "60E1")
    # of points that lie on it no rounding is told
    assert "all points are within 0.001 mm of it" in nearest_text(find_nearest_profiles(sampled("60E1", 0.0), "rail"))
    # the wear that was planted, to some of the noise, where both lines are registered by the sides of the head
    line = read(points, nominal="60E1")
    feet = find_foot_points(replace(load_library_profile("60E1"), outline=()), line.points)
    assert feet.off_mm.min() == pytest.approx(-0.6, abs=0.05)


@pytest.mark.parametrize(
    ("planted", "nominal"),
    [
        # worn by 0.6 mm at the corner: it is theirs although they are not unworn
        ({}, "60E1"),
        # most points are off it by half a millimetre, one by three
        ({"usual_mm": 0.49}, "60E1"),
        ({"usual_mm": 0.51}, ""),
        ({"farthest_mm": 2.9}, "60E1"),
        ({"farthest_mm": 3.1}, ""),
    ],
)
def test_a_profile_that_points_are_too_far_off_is_not_theirs(planted, nominal, monkeypatch):
    monkeypatch.setattr(
        "fecontact.profiles.recognition.find_nearest_profiles",
        lambda *arguments: [replace(candidate, **planted) for candidate in find_nearest_profiles(*arguments)],
    )
    assert read(sampled("60E1", 0.01, wear=corner_wear)).measured.nominal == nominal


@pytest.mark.slow
def test_what_is_taken_for_granted_of_a_measured_rail_is_said_with_the_way_back():
    def notes(turn_rad, **reading):
        line = read(sampled("60E1", 0.01, registration=Registration(turn_rad=turn_rad)), **reading)
        return " ".join(line.notes)

    jump_note = "at the curvature jumps of 60E1 the curvature of the rail is assumed to jump too; --rail-nominal none"
    assert jump_note in notes(0.0)
    assert jump_note not in notes(0.0, nominal="none")
    for turn_rad, cant in ((0.0, ""), (0.01, ""), (0.025, "1:40"), (-0.0245, "1:40"), (0.05, "1:20")):
        # a head that is lower on its field side is refused until its side is given
        mirror = False if turn_rad < 0.0 else None
        text = notes(turn_rad, mirror=mirror)
        assert ("if the rail in the file is canted already, give --inclination none" in text) == bool(cant)
        assert f"near {cant};" in text or not cant


def test_points_of_no_rail_have_no_nominal():
    y = np.arange(-30.0, 30.0 + 1e-9, 0.2)
    points = np.column_stack((y, -((y / 7.0) ** 2) + 0.01 * np.random.default_rng(0).normal(size=y.size)))
    line = read(points)
    assert line.measured.nominal == ""
    with pytest.raises(InputError, match="the points deviate from 60E1 by more than 2 mm"):
        read(points, nominal="60E1")


# --- the smoothed line --------------------------------------------------------------------------------------------


def test_a_deviation_is_told_across_the_line_as_the_nearest_profile_is():
    """Worn over a flat, where points slide along the line to where they come from."""
    worn = read(sampled("60E1", 0.005, step_mm=0.25, wear=lambda y: 0.4 * np.exp(-(((y + 20.0) / 12.0) ** 2))))
    (note,) = [text for text in worn.notes if "its deviation from 60E1" in text]
    deviation_mm = float(re.search(r"at most (\S+) mm\)", note)[1])
    (same,) = find_nearest_profiles(worn.points, "rail", ("60E1",))
    # two digits of it are told
    assert deviation_mm == pytest.approx(same.farthest_mm, rel=0.06)


def test_points_that_tell_nothing_of_the_line_are_counted():
    """Points without information are left out and counted.

    These are a point that nearly coincides with another, and points beyond the end of the nominal profile.
    """
    points = sampled("60E1", 0.005)
    doubled = np.insert(
        points, range(40, 140, 10), points[40:140:10] + 0.01 * np.sign(np.diff(points, axis=0)[40:140:10]), axis=0
    )
    assert not any("left out" in note for note in read(points).notes)
    profile = read(doubled)
    (note,) = [text for text in profile.notes if "left out" in text]
    assert note == f"left out of {len(doubled)} points: 10 too close to the previous point"
    assert f"smoothed from {len(points)} points" in " ".join(profile.notes)
    further = points[-1] + np.arange(1, 6)[:, None] * (points[-1] - points[-2])
    (note,) = [text for text in read(np.vstack((points, further))).notes if "left out" in text]
    assert re.fullmatch(rf"left out of {len(points) + 5} points: [567] beyond the ends of 60E1", note)


def test_exact_points_are_not_smoothed():
    assert read(sampled("60E1", step_mm=0.5)).measured is None
    assert read(sampled("60E1", 0.01), filter_mm=0.0).measured is None


@pytest.mark.parametrize("wave_mm", [4.0, 8.0, 16.0])
def test_half_of_a_wave_of_the_width_is_left(wave_mm):
    s = np.linspace(0.0, 200.0, 2001)
    wave = np.cos(2.0 * math.pi * s / wave_mm)
    left = fit_smoothing_spline(s, wave[:, None], wave_mm)(s)[:, 0]
    middle = slice(600, 1400)
    assert left[middle] @ wave[middle] / (wave[middle] @ wave[middle]) == pytest.approx(0.5, abs=2e-3)


@pytest.mark.parametrize("filter_mm", [1.0, 8.0, 30.0])
def test_the_smoothing_spline_is_that_of_scipy(filter_mm):
    """Uneven points, each with the weight of the line beside it.

    The equations of scipy keep ten digits here.
    """
    rng = np.random.default_rng(4)
    s = np.cumsum(rng.uniform(0.5, 1.3, 150))
    values = np.column_stack((s, 20.0 * np.sin(s / 30.0))) + rng.normal(0.0, 0.01, (150, 2))
    weights = 0.5 * (np.diff(s, append=s[-1]) + np.diff(s, prepend=s[0]))
    expected = make_smoothing_spline(s, values, w=weights, lam=(filter_mm / math.tau) ** 4)
    smoothed, places = fit_smoothing_spline(s, values, filter_mm), np.linspace(s[0] - 0.5, s[-1] + 0.5, 1000)
    for order, tolerance in ((0, 1e-9), (1, 1e-10), (2, 1e-11)):
        assert smoothed(places, order) == pytest.approx(expected(places, order), rel=0.0, abs=tolerance)


def test_a_straight_line_stays_where_it_is_over_the_longest_waves():
    """Where the equations of scipy's spline are 0.0002 mm off, for points 0.2 mm apart."""
    s = np.linspace(0.0, 160.0, 801)
    line = np.column_stack((s, 3.0 + 0.1 * s))
    assert fit_smoothing_spline(s, line, 500.0)(s) == pytest.approx(line, rel=0.0, abs=1e-12)


@pytest.mark.parametrize("noise_mm", [0.002, 0.01, 0.02])
@pytest.mark.parametrize("step_mm", [0.1, 0.2, 0.5])
def test_the_noise_is_told_from_the_points(noise_mm, step_mm):
    noises = [estimate_noise_mm(sampled("60E1", noise_mm, step_mm, seed)) for seed in range(8)]
    assert np.mean(noises) == pytest.approx(noise_mm, rel=0.1)


def test_the_stated_curvature_noise_is_the_one_that_arises():
    """Standard deviation over seeds of the curvature half way along the top of the head.

    All seeds use a single filter width.
    """
    lines = [read(sampled("60E1", 0.01, seed=seed), filter_mm=15.0, nominal="60E1") for seed in range(40)]
    arisen = np.std([line.curvature(3.0) for line in lines])
    measured = lines[0].measured
    stated = np.interp(3.0, measured.points[:, 0], measured.curvature_noise_per_mm)
    # forty values know their scatter to 11 %, and so do the draws
    assert arisen == pytest.approx(stated, rel=0.35)


def test_a_smoothed_line_keeps_the_junctions_and_has_no_steps():
    line = read(sampled("60E1", 0.01))
    assert [j.y_mm for j in line.junctions] == pytest.approx(
        [j.y_mm for j in load_library_profile("60E1").junctions], abs=0.02
    )
    assert not any(junction.is_corner for junction in line.junctions)
    u = np.arange(1.0, len(line.segments))
    left, right = line.evaluate(u, "left"), line.evaluate(u, "right")
    assert left.y == pytest.approx(right.y, abs=1e-8)
    assert left.angle_rad == pytest.approx(right.angle_rad, abs=1e-7)


def test_derivatives_of_a_smoothed_line_are_those_of_its_points():
    line = read(sampled("S1002", 0.01), kind="wheel")
    u = np.linspace(0.3, len(line.segments) - 0.3, 400)
    u = u[np.abs(u - np.round(u)) > 1e-2]
    h = 1e-5
    low, middle, high = (line.evaluate(u + d) for d in (-h, 0.0, h))
    for name in ("y", "z"):
        first = (getattr(high, name) - getattr(low, name)) / (2 * h)
        assert getattr(middle, f"d{name}") == pytest.approx(first, rel=1e-5, abs=1e-4)
        second = (getattr(high, f"d{name}") - getattr(low, f"d{name}")) / (2 * h)
        assert getattr(middle, f"dd{name}") == pytest.approx(second, rel=1e-4, abs=2e-3)


def test_the_deviation_from_the_nominal_scales():
    line = read(sampled("60E1", 0.005, wear=corner_wear), nominal="60E1")
    y = np.linspace(-20.0, 20.0, 81)
    without_deviation, half, with_deviation = (
        scale_deviation(line, fraction).height(y) for fraction in (0.0, 0.5, 1.0)
    )
    assert with_deviation == pytest.approx(line.height(y), abs=1e-12)
    # a displacement across the line: its height is linear in it to the square of 0.6 mm over the radii of 80 mm
    assert half == pytest.approx(0.5 * (without_deviation + with_deviation), abs=1e-3)
    registration = line.measured.held.registration
    assert find_foot_points(
        load_library_profile("60E1"), registration.to_reference(np.column_stack((y, without_deviation)))
    ).off_mm == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(InputError, match="has no deviation from a nominal profile"):
        scale_deviation(load_library_profile("60E1"), 0.5)


@pytest.mark.parametrize("spacing_mm", [0.5, 2.0])
def test_three_points_are_bent_as_their_one_second_difference_says(spacing_mm):
    """Smoothing of three points has a single unknown.

    min |u - v|^2 + (w / 2 pi)^4 (D u)^2 with D = (1, -2, 1) / h^2.
    """
    width, v = 3.0, np.array([0.0, 0.4, 0.1])
    values = np.column_stack((np.zeros(3), v))
    smoothed = minimise_bending(spacing_mm * np.arange(3.0), values, np.tile([0.0, 1.0], (3, 1)), width)
    bent = np.array([1.0, -2.0, 1.0]) / spacing_mm**2
    much = (width / (2.0 * math.pi)) ** 4
    np.testing.assert_allclose(smoothed[:, 1], v - bent * (much * bent @ v / (1.0 + much * bent @ bent)), atol=1e-9)


def test_a_parabola_is_as_long_as_its_closed_form():
    """z = y^2 / 2 from 0 to 2: (y sqrt(1 + y^2) + asinh y) / 2."""
    closed_form = 0.5 * (2.0 * math.sqrt(5.0) + math.asinh(2.0))
    assert _measure_length_mm(Polynomial(coefficients=(0.0, 0.0, 0.5), y_from=0.0, y_to=2.0)) == pytest.approx(
        closed_form, rel=1e-12
    )


def test_smoothed_profiles_are_equal_by_their_points():
    def profile(points, is_filter_declared=False):
        measured = SimpleNamespace(
            **{"filter_mm": 4.0, "is_filter_declared": is_filter_declared, "nominal": "", "noise_mm": 0.01},
            points=np.array(points),
            s_mm=np.arange(2.0),
        )
        return _ContentKey(SimpleNamespace(kind="rail", name="one", measured=measured))

    reference = profile([1.0, 2.0])
    assert reference == profile([1.0, 2.0])
    assert reference != profile([1.0, 2.5])
    assert reference != profile([1.0, 2.0], is_filter_declared=True)
    assert reference != "one"


@pytest.mark.parametrize("cant", [20, 30, 40])
def test_a_rail_that_lies_canted_in_its_file_is_asked_for(cant):
    nominal_held = SimpleNamespace(registration=SimpleNamespace(turn_rad=-1.0 / cant))
    (*_, said) = _describe_choices(SimpleNamespace(nominal="60E1", held=nominal_held), "rail", ())
    assert f"near 1:{cant}; if the rail in the file is canted" in said


@pytest.mark.parametrize(("gauge_mm", "field_mm"), [(0.7, 0.7), (0.2, 0.9), (0.9, 0.2)])
def test_what_a_head_has_lost_of_its_field_side_counts_beside_its_gauge_side(gauge_mm, field_mm):
    y = np.linspace(-30.0, 30.0, 121)
    feet = FootPoints(
        s_mm=y,
        points=np.column_stack((y, -(y**2) / 100.0)),
        normals=np.tile([0.0, 1.0], (y.size, 1)),
        off_mm=np.where(y < 0.0, -gauge_mm, -field_mm),
        inside=np.ones(y.size, dtype=bool),
    )
    assert _measure_field_side_loss_mm(feet) == pytest.approx(field_mm - gauge_mm, abs=1e-12)


# --- a case before it is solved -------------------------------------------------------------------------------------


def test_a_preview_says_what_the_solution_will_begin_with(tmp_path):
    case = Case(lateral_shift_mm=3.0, roll="given")
    previewed = preview_case(case)
    _, expected = expect_on_half_space(case, place_case(case))
    assert previewed.expected.semi_axis_x_mm == expected.semi_axis_x_mm
    assert previewed.hertz_uncertainty is None
    assert previewed.lines_seconds == 0.0
    # the mesh of this case has 11,838 and 17,448 unknowns
    assert previewed.degrees_of_freedom == pytest.approx(29_286, rel=0.1)
    text = "\n".join(preview_lines(preview_record(previewed)))
    assert "curvature junctions in the patch: rail at +2.35 mm" in text
    record = json.loads(json.dumps(preview_record(previewed)))
    assert record["hertz"]["p_max_MPa"] == pytest.approx(1585.4, abs=0.1)
    assert draw_preview(previewed, tmp_path / "seen.png").stat().st_size > 10_000
    assert "vertical scale exaggerated" in (tmp_path / "seen.svg").read_text("utf-8")


def test_place_and_profiles_on_the_command_line(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.savetxt("mine.csv", sampled("60E1", 0.01), delimiter=",", fmt="%.6f")
    assert call(["place", "--rail", "mine.csv", "--shift", "-4", "--out", "seen.png"]) == 0
    out = capsys.readouterr().out
    assert "uncertainty of the measured profiles: p0 ±" in out
    assert (tmp_path / "seen.png").exists()
    # the contact is found on each line that the points allow, some eight
    previewed = preview_case(Case(rail="mine.csv", lateral_shift_mm=-4.0))
    assert 2.0 < previewed.lines_seconds < 8.0
    assert previewed.cpu_seconds > preview_case(Case(lateral_shift_mm=-4.0)).cpu_seconds + 2.0
    assert call(["place", "--rail", "mine.csv", "--shift", "-4", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    # which body a note is about
    assert record["notes"]
    assert all(note.startswith("rail: ") for note in record["notes"])
    profile_part = record["uncertainty_of_profile"]
    assert 0.0 < profile_part["p_max_MPa"] < 0.05
    assert call(["profiles", "mine.csv", "--kind", "rail", "--write", "again.csv", "--out", "mine.png"]) == 0
    out = capsys.readouterr().out
    assert "nearest library profile, over all points: 60E1" in out
    assert "its deviation from 60E1" in out
    assert (tmp_path / "mine.png").exists()
    assert call(["profiles", "mine.csv", "--kind", "rail", "--json"]) == 0
    profile = json.loads(capsys.readouterr().out)
    assert (profile["smoothed"]["nominal"], profile["nearest"][0]["name"]) == ("60E1", "60E1")
    # the scatter that was planted, and the junctions of 60E1 between arcs of 300, 80 and 13 mm
    assert profile["smoothed"]["noise_mm"] == pytest.approx(0.01, rel=0.25)
    assert [junction["y_mm"] for junction in profile["junctions"]] == pytest.approx(
        [junction.y_mm for junction in load_library_profile("60E1").junctions], abs=0.05
    )
    assert call(["profiles", "again.csv", "--kind", "rail"]) == 0
    (tmp_path / "mine.prr").write_text(simpack(*sampled("60E1", 0.01).T), "utf-8")
    assert call(["profiles", "mine.prr", "--kind", "wheel"]) == 2
    assert "is a rail, but a wheel is needed" in capsys.readouterr().err


def test_the_labels_of_the_picture_of_a_measured_line_are_apart(monkeypatch):
    figures = []
    monkeypatch.setattr("fecontact.outputs.profiles.save_figure", lambda figure, path: figures.append(figure))
    line = read(sampled("60E1", 0.01))
    assert isinstance(line, Profile)
    draw_profile(line, "line.png")
    figures[0].canvas.draw()
    ends = [ax.yaxis.label.get_window_extent() for ax in figures[0].axes]
    assert all(upper.y0 > lower.y1 for upper, lower in pairwise(ends))
    assert ends[-1].y0 > 0.0


def test_what_was_left_out_is_drawn_with_its_place_and_a_key(tmp_path, monkeypatch):
    """Marks in the pictures of a smoothed line, of an exact line, and of the pair in position."""
    figures = []
    monkeypatch.setattr("fecontact.outputs.figures.position.save_figure", lambda figure, path: figures.append(figure))
    monkeypatch.setattr("fecontact.outputs.profiles.save_figure", lambda figure, path: figures.append(figure))
    points = sampled("60E1", 0.01)
    points[200, 1] += 0.15
    line = read(points, repair=True)
    assert [(problem.what, problem.index) for problem in line.problems] == [("spike", 200)]
    exact = sampled("60E1", step_mm=0.5)
    exact[80, 1] += 0.002
    as_is = read(exact, repair=True)
    path = tmp_path / "rail.txt"
    np.savetxt(path, exact, fmt="%.9f")
    previewed = preview_case(Case(rail=str(path), rail_file=Reading(repair=True), lateral_shift_mm=-4.0, roll="given"))
    draw_profile(line, tmp_path / "a.png")
    draw_profile(as_is, tmp_path / "b.png")
    draw_preview(previewed, tmp_path / "c.png")
    for figure, (y, z) in zip(
        figures, (points[200], exact[80], previewed.placement.rail.point(*exact[80])), strict=True
    ):
        ax = figure.axes[0]
        (mark,) = [artist for artist in ax.lines if str(artist.get_label()).startswith("omitted")]
        assert mark.get_label() == "omitted: spike (1)"
        assert (mark.get_xdata()[0], mark.get_ydata()[0]) == pytest.approx((y, z), abs=1e-6)
        assert "omitted: spike (1)" in [text.get_text() for text in ax.get_legend().get_texts()]


def test_a_profile_without_problems_has_no_marks(monkeypatch):
    figures = []
    monkeypatch.setattr("fecontact.outputs.profiles.save_figure", lambda figure, path: figures.append(figure))
    draw_profile(load_library_profile("60E1"), "none.png")
    assert figures[0].axes[0].get_legend() is None


def test_points_that_are_taken_as_exact_and_are_not_are_named(tmp_path):
    path = tmp_path / "noisy.txt"
    # a head that is flatter than its noise: a spline through it is hollow at the contact point in every other file
    y = np.arange(-30.0, 30.0 + 1e-9, 0.2)
    np.savetxt(path, np.column_stack((y, 0.01 * np.cos(math.pi * y / 0.4) - y**2 / 2000.0)))
    case = Case(
        rail=str(path), rail_file=Reading(filter_mm=0.0), wheel="cylinder:460", inclination_rad=0.0,
        track=Track(rail_crown_y_mm=750.0),
    )  # fmt: skip
    hollow = replace(place_case(case).first.curvature, yy_per_mm=-1.0)
    placement = place_case(case)
    placement = replace(placement, contact_points=(replace(placement.first, curvatures=(hollow,)),))
    with pytest.raises(InputError, match="noisy: the points are not smoothed; give --rail-filter-mm or"):
        compute_hertz(case, placement)


@pytest.mark.parametrize("place", [0, 2, 4])
def test_a_cubic_misses_no_neighbour_and_four_points_have_none_to_miss(place):
    x = np.array([0.0, 1.0, 1.8, 3.0, 4.1, 5.0, 6.2])
    points = np.column_stack([x, 1e-9 * x**3])
    points[3, 1] += 0.01
    for count in (4, 5, 7):
        missed, weight = compare_with_neighbours(points[:count], place)
        assert missed.size == weight.size == count - 4
    # the point that lies aside is in the middle of the second five
    missed, weight = compare_with_neighbours(points, 2)
    assert missed[1] == pytest.approx(0.01, rel=1e-3)
    assert np.all(weight > 1.0)
