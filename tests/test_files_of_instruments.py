"""Measured rails and wheels in the files of instruments and other programs, and profiles made like them."""

from pathlib import Path

import numpy as np
import pytest
from points import profile_from_points, simpack

from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.profiles.library import list_names, list_reference_names, load_library_profile
from fecontact.profiles.point_noise import estimate_noise_mm
from fecontact.profiles.points import find_spikes, is_exact
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.profiles.smoothing import PRACTICE_MIDDLE_MM, PRACTICE_MM
from fecontact.profiles.variants import make_profile_variants
from fecontact.profiles.writers import sample_points

FILES = Path(__file__).parent / "profiles"
RAILS = ("site_b_hr.prr", "rail_left_iter288.ban", "avg_low2.ban")


def raw(name):
    """First two numbers of each line that begins with two numbers.

    The numbers are not changed.
    """
    rows = []
    for line in (FILES / name).read_text("latin-1").splitlines():
        try:
            rows.append([float(text) for text in line.split()[:2]])
        except ValueError:
            continue
    return np.array([row for row in rows if len(row) == 2])


def rail(name, **reading):
    return resolve_rail(str(FILES / name), Reading(**reading))


def wheel(name, **reading):
    return resolve_wheel(str(FILES / name), Reading(**reading)).profile


# --- read on the right side, as they are -----------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "turn"), [(RAILS[0], (1, -1)), (RAILS[1], (-1, 1)), (RAILS[2], (-1, 1))])
def test_a_rail_that_wraps_under_its_head_is_cut_at_its_widest_points(name, turn):
    """On the raw points within 10 nm; MiniProf's X grows to the centre of the track, SIMPACK's y to the field side."""
    line = rail(name, filter_mm=0.0)
    points = line.points
    raw_points = {tuple(point) for point in raw(name) * turn}
    assert all(tuple(point) in raw_points for point in points)
    y = line.points[5:-5, 0]
    middle = np.abs(y - y.mean()) < 25.0
    assert line.height(y[middle]) == pytest.approx(line.points[5:-5, 1][middle], abs=1e-5)
    # nothing is wider than the ends, but for the side's own scatter; what is left touches any wheel that the rest did
    assert points[0, 0] == points[:, 0].min() == pytest.approx((raw(name) * turn)[:, 0].min(), abs=0.01)
    assert sum("the profile turns in beyond its widest point" in note for note in line.notes) == 2
    # the gauge corner is worn, on the side of the small y: 8 mm from the widest points it is lower by some mm
    gauge, field = line.height([points[0, 0] + 8.0, points[-1, 0] - 8.0])
    assert field - gauge > 3.0
    assert not any("mirror" in note for note in line.notes)


@pytest.mark.parametrize("name", RAILS)
def test_a_rail_that_an_option_has_mirrored_is_noticed_with_the_option_to_leave_out(name):
    (note,) = [text for text in rail(name, mirror=True, filter_mm=0.0).notes if "mm lower on its field side" in text]
    assert note.endswith("mirrored; leave out --rail-mirror (mirror in [rail_file]) if it is")


@pytest.mark.parametrize("nominal", ["auto", "none"])
def test_a_new_rail_with_its_cant_the_other_way_is_noticed(nominal):
    y, z = sample_points(load_library_profile("60E1"), 0.3).T
    z = z + 0.005 * np.random.default_rng(0).normal(size=z.size)

    def read_turned(turn, **reading):
        line = y * np.cos(turn) - z * np.sin(turn), y * np.sin(turn) + z * np.cos(turn)
        return profile_from_points(*line, kind="rail", name="p", reading=Reading(nominal=nominal, **reading))

    assert not any("mirror" in note for note in read_turned(0.025).notes)
    with pytest.raises(InputError, match=r"give --rail-mirror yes .* or give --rail-mirror no"):
        read_turned(-0.025)
    assert any("so the profile may be mirrored" in note for note in read_turned(-0.025, mirror=False).notes)


def test_a_wheel_from_the_back_of_its_flange_is_read_with_the_option_that_is_named(tmp_path):
    """A file with several peculiarities.

    It has a header in words, a line of numbers in it, two scans that meet at the flange, and a rim that turns back.
    """
    with pytest.raises(InputError, match=r"give --wheel-tape-circle-mm 70 \(tape_circle_mm = 70 in \[wheel_file\]\)"):
        wheel("Car7422_0001r.whl")
    line = wheel("Car7422_0001r.whl", tape_circle_mm=70.0, filter_mm=0.0)
    points = raw("Car7422_0001r.whl")[1:] * (1, -1) - (70.0, 0.0)
    tread = np.abs(points[:, 0]) < 30.0
    assert line.height(points[tread, 0]) == pytest.approx(points[tread, 1], abs=1e-5)
    assert line.y_range_mm == pytest.approx((-70.1, 61.4), abs=0.1)
    assert any("turns in beyond its widest point (61.38, 17" in note for note in line.notes)
    # the tape circle of any other file
    with pytest.raises(InputError, match=r"flange is at y = 20\.6 mm.* give --wheel-tape-circle-mm 70 "):
        wheel("worn_high_mileage.prw", filter_mm=0.0)
    settled = wheel("worn_high_mileage.prw", filter_mm=0.0, tape_circle_mm=70.0)
    assert settled.y_range_mm == pytest.approx((-66.07, 73.44), abs=0.01)
    with pytest.raises(InputError, match="a rail has no tape circle; leave out --rail-tape-circle-mm"):
        rail("site_b_hr.prr", tape_circle_mm=70.0)


def test_two_rails_in_one_file_are_refused_as_that(capsys):
    for reading in ({}, {"repair": True}):
        with pytest.raises(
            InputError, match=r"has two heads with a groove of .* two rails, or a rail with its guard rail; cut"
        ):
            rail("guard_rail_test.ban", **reading)


def written(path, points):
    """A file of columns with nine digits per number."""
    np.savetxt(path, points, fmt="%.9f")
    return str(path)


def test_the_unit_is_asked_for_before_the_tape_circle(tmp_path):
    """A file in inches is refused for its unit first.

    The tip of a flange was sought at the wrong place, and the tape circle asked for.
    """
    points = sample_points(load_library_profile("S1002"), 0.5)
    path = written(tmp_path / "in.whl", (points * (1, -1) + (70.0, 0.0)) / 25.4)
    with pytest.raises(InputError, match="the unit of the file may be in: give --wheel-units in"):
        resolve_wheel(path)
    with pytest.raises(InputError, match=r"flange is at X = 15.0 mm.* give --wheel-tape-circle-mm 70"):
        resolve_wheel(path, Reading(units="in"))
    line = resolve_wheel(path, Reading(units="in", tape_circle_mm=70.0)).profile
    assert line.height(10.0) == pytest.approx(load_library_profile("S1002").height(10.0), abs=1e-6)


@pytest.mark.parametrize(("ending", "up"), [("whl", -1), ("txt", 1)])
def test_a_mirrored_wheel_from_its_back_has_its_tape_circle_at_a_negative_y(tmp_path, ending, up):
    points = sample_points(load_library_profile("S1002"), 0.5)
    path = written(tmp_path / f"mirrored.{ending}", (points + np.array([70.0, 0.0])) * (-1, up))
    try:
        message = " ".join(resolve_wheel(path, Reading(mirror=True)).profile.notes)
    except InputError as refused:
        message = str(refused)
    assert "give --wheel-tape-circle-mm -70 (" in message
    line = resolve_wheel(path, Reading(mirror=True, tape_circle_mm=-70.0)).profile
    assert line.height(10.0) == pytest.approx(load_library_profile("S1002").height(10.0), abs=1e-6)
    assert not any("tape-circle" in note for note in line.notes)


@pytest.mark.parametrize(("kind", "name"), [("rail", "60E1"), ("wheel", "S1002")])
def test_columns_the_other_way_round_are_told_as_that(tmp_path, kind, name):
    """A repair was printed, which could not do it."""
    path = written(tmp_path / "zy.txt", sample_points(load_library_profile(name), 0.5)[:, ::-1])
    resolve = resolve_rail if kind == "rail" else lambda *a: resolve_wheel(*a).profile
    for reading in (Reading(), Reading(repair=True)):
        with pytest.raises(InputError, match=f"y and z are exchanged: give --{kind}-columns 2,1 "):
            resolve(path, reading)
    assert resolve(path, Reading(columns="2,1")).height(5.0) == pytest.approx(
        load_library_profile(name).height(5.0), abs=1e-6
    )


def worn(name, what, depth_mm, cant_rad=0.0):
    """A worn head down to 16 mm, with 5 um of noise.

    It is worn at its gauge corner, on its crown or on its gauge side.
    """
    line = load_library_profile(name)
    p = line.evaluate(line.at_arc_length(np.arange(0.3, line.length_mm - 0.3, 0.25)))
    half, y, z, nx, nz = 0.5 * np.ptp(p.y), p.y, p.z, -np.sin(p.angle_rad), np.cos(p.angle_rad)
    off = 0.005 * np.random.default_rng(3).normal(size=y.size)
    if what == "side":
        # a gauge face that leans by 1:5
        y = y + 0.3 * np.log1p(np.exp(np.clip((depth_mm - half + 0.2 * (z + 14.0) - y) / 0.3, -50.0, 50.0)))
    else:
        middle, reach = (8.0 - half, 18.0) if what == "gauge corner" else (-8.0, 22.0)
        off -= depth_mm * np.cos(0.5 * np.pi * np.clip((y - middle) / reach, -1.0, 1.0)) ** 2
    points = np.column_stack((y + nx * off, z + nz * off))[z > -16.0]
    c, s = np.cos(cant_rad), np.sin(cant_rad)
    return points @ np.array([[c, s], [-s, c]])


@pytest.mark.parametrize("name", ["60E1", "46E1"])
@pytest.mark.parametrize(("what", "depth_mm", "cant_rad"), [
    ("gauge corner", 0.5, 0.025), ("gauge corner", 1.0, 0.0), ("gauge corner", 2.0, 0.0), ("crown", 0.5, 0.0),
    ("crown", 1.0, 0.0), ("crown", 2.0, 0.0), ("crown", 1.0, 0.025), ("side", 2.0, 0.0), ("side", 6.0, 0.025),
])  # fmt: skip
def test_a_worn_head_is_asked_for_its_mirror_on_the_wrong_side_alone(name, what, depth_mm, cant_rad):
    """6 mm of side wear make the gauge side higher than the field side.

    Hertz on a mirrored line is the ellipse of another contact.
    """
    assert asked_for_its_mirror(worn(name, what, depth_mm, cant_rad)) == [False, True]


# seen by nobody who chose the limits; A45 is narrower than what is taken for a whole head without its nominal profile
@pytest.mark.parametrize(("name", "depth_mm"), [("46E1", 3.0), ("A45", 1.5)])
def test_side_wear_is_known_by_what_the_sides_have_lost(name, depth_mm):
    """It leaves the top as it was; the side that is left is higher, which a new head leaning inwards would be too."""
    assert asked_for_its_mirror(worn(name, "side", depth_mm)) == [False, True]


@pytest.mark.slow
@pytest.mark.parametrize("name", list_names("rail"))
@pytest.mark.parametrize(("what", "depth_mm", "cant_rad"), [
    ("side", 2.5, 0.0), ("side", 2.5, 0.05), ("side", 3.5, 0.0), ("crown", 0.7, 0.0), ("gauge corner", 1.5, 0.025),
])  # fmt: skip
def test_every_worn_rail_of_the_library_is_asked_for_its_mirror_on_the_wrong_side_alone(name, what, depth_mm, cant_rad):
    """Depths of wear that were not used to choose the limits.

    1.5 mm at the side take hardly anything off the leaning sides. Crane rails are symmetric: wear on one half of A45,
    or in the middle of A75, leaves too little to tell by.
    """
    as_it_is, mirrored = asked_for_its_mirror(worn(name, what, depth_mm, cant_rad))
    assert not as_it_is
    assert mirrored or (name, what) in (("A45", "gauge corner"), ("A75", "crown"))


def test_side_wear_of_a_crane_rail_is_not_taken_for_a_narrower_one():
    """A55 with 3.5 mm of side wear is nearer to all of A45 than to all of A55."""
    assert asked_for_its_mirror(worn("A55", "side", 3.5)) == [False, True]


@pytest.mark.parametrize("name", ["A45", "A55", "A75"])
def test_a_new_head_that_is_its_own_mirror_image_is_read_as_the_same_line_from_either_side(name):
    points, y = worn(name, "crown", 0.0), np.linspace(-20.0, 20.0, 81)
    as_it_is, mirrored = (
        profile_from_points(*image.T, kind="rail", name="p", reading=Reading())
        for image in (points, points[::-1] * (-1, 1))
    )
    assert as_it_is.measured.nominal == mirrored.measured.nominal == name
    # noise of 5 um is mirrored with the points
    assert mirrored.height(-y) == pytest.approx(as_it_is.height(y), abs=1e-4)
    assert mirrored.height(y) == pytest.approx(as_it_is.height(y), abs=0.01)
    assert not any("--rail-mirror" in note for line in (as_it_is, mirrored) for note in line.notes)


def asked_for_its_mirror(points):
    """Whether a head is, as it is and mirrored."""

    def is_refused(image):
        try:
            profile_from_points(*image, kind="rail", name="p", reading=Reading())
        except InputError as error:
            return "give --rail-mirror yes (mirror = true in [rail_file]) if it is mirrored, or give" in str(error)
        return False

    return [is_refused((points[::side] * (side, 1)).T) for side in (1, -1)]


def test_what_is_wrong_with_a_wheel_is_told_and_not_that_it_is_no_rail(capsys):
    assert call(["profiles", str(FILES / "Car7422_0001r.whl")]) == 2
    assert "give --wheel-tape-circle-mm 70" in capsys.readouterr().err


# --- comments, remarks, old files ------------------------------------------------------------------------------------


def test_comments_stand_anywhere_in_a_simpack_file(tmp_path):
    y = np.arange(-34.0, 34.5, 0.5)
    z = load_library_profile("54E1").height(y)
    rows = [f"{a:.9f} {-b:.9f}" for a, b in zip(y, z, strict=True)]
    rows[3] += "  % a remark"
    rows[4] += "  // another"
    rows[10:10] = ["%   -299.7 286.5", "# words", "! words", "// words"]
    path = tmp_path / "a.prr"
    path.write_text(simpack(y, z, points="\n".join(rows)), "utf-8")
    assert resolve_rail(str(path), Reading(filter_mm=0.0)).height(y) == pytest.approx(z, abs=1e-8)


def test_words_behind_the_numbers_and_three_columns_of_an_old_file(tmp_path):
    points = sample_points(load_library_profile("S1002"), 0.5)
    rows = [f"{a + 70.0:.6f} {-b:.6f} 0.000" for a, b in points]
    rows[7] += "  point (by hand)"
    path = tmp_path / "old.whl"
    path.write_text("\n".join(rows), "utf-8")
    with pytest.raises(InputError, match="give --wheel-tape-circle-mm 70"):
        resolve_wheel(str(path))
    line = resolve_wheel(str(path), Reading(tape_circle_mm=70.0, filter_mm=0.0)).profile
    assert line.height(points[20:-20, 0]) == pytest.approx(points[20:-20, 1], abs=2e-6)
    assert "text after the numbers left out in line 8" in line.notes
    plain = tmp_path / "old.txt"
    plain.write_text("\n".join(rows), "utf-8")
    with pytest.raises(InputError, match="give --wheel-columns 1,2"):
        resolve_wheel(str(plain))
    with pytest.raises(InputError, match="give --wheel-columns 1,-2"):
        resolve_wheel(str(plain), Reading(columns="1,2"))
    profile = resolve_wheel(str(plain), Reading(columns="1,-2", tape_circle_mm=70.0, filter_mm=0.0)).profile
    assert profile.height(10.0) == pytest.approx(line.height(10.0), abs=1e-9)


# --- wrong points ----------------------------------------------------------------------------------------------------


def test_a_spike_of_a_micrometre_is_left_out_and_told():
    points = sample_points(load_library_profile("60E1"), 0.25)
    points[200, 1] += 0.0013
    assert [spike.index for spike in find_spikes(points)] == [200]
    profile = profile_from_points(*points.T, kind="rail", name="p", reading=Reading())
    assert any("1 point left out: a spike of 0.0013 mm at point 201" in note for note in profile.notes)
    points[200, 1] += 0.05
    with pytest.raises(InputError, match=r"a spike of 0\.05.*give --rail-repair yes"):
        profile_from_points(*points.T, kind="rail", name="p", reading=Reading())


def test_a_repair_does_not_depend_on_the_end_that_it_begins_at():
    rng = np.random.default_rng(2)
    points = sample_points(load_library_profile("60E1"), 0.3) + 0.004 * rng.normal(
        size=(len(sample_points(load_library_profile("60E1"), 0.3)), 2)
    )
    for k, off in ((40, (0.9, 0.1)), (120, (0.0, 0.3)), (180, (-1.3, 0.0)), (181, (-0.2, 0.02))):
        points[k] += off
    reading = Reading(repair=True, filter_mm=0.0)
    forward = profile_from_points(*points.T, kind="rail", name="p", reading=reading).points
    backward = profile_from_points(*(points[::-1] * (-1, 1)).T, kind="rail", name="p", reading=reading).points
    assert len(forward) < len(points)
    assert np.array_equal(backward[::-1] * (-1, 1), forward)


# --- the line of the points ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", RAILS)
def test_a_measured_line_has_a_stated_filter_and_the_scatter_that_is_there(name):
    line = rail(name)
    measured = line.measured
    assert measured.nominal == ""
    # points that were rounded to 0.01 mm have a noise of their own, and ask for more where the line is flat
    follows = name == "avg_low2.ban"
    assert (measured.held.relative_filter is not None) == follows
    if follows:
        assert PRACTICE_MM[1] < measured.filter_mm < 13.0
        assert measured.filter_mm * measured.held.relative_filter.min() == pytest.approx(PRACTICE_MM[0])
    else:
        assert measured.filter_mm == PRACTICE_MIDDLE_MM
    tangent = np.gradient(measured.points, axis=0)
    is_flat = np.abs(tangent[:, 1]) < 0.35 * np.abs(tangent[:, 0])
    usual = np.median(np.abs(measured.residual_mm[is_flat])) / 0.6745
    assert 0.7 * usual < measured.noise_mm < 8.0 * usual
    (note,) = [note for note in line.notes if f"{measured.filter_mm:.3g} mm" in note and "with a noise of" in note]
    assert follows or "filter length 5.66 mm (the middle of the usual 4 to 8 mm)" in note
    # independent errors of points would be far less on files that were filtered
    assert measured.noise_mm > (1.0 if follows else 5.0) * estimate_noise_mm(measured.points)


def test_noise_asks_for_a_longer_filter():
    """Independent neighbours show the noise in the points, on a head of R 32 mm at its top."""
    y = np.arange(-30.0, 30.0, 0.2)
    lengths = []
    for noise_mm in (0.0003, 0.003, 0.02):
        z = -((y / 8.0) ** 2) + noise_mm * np.random.default_rng(1).normal(size=y.size)
        measured = profile_from_points(y, z, kind="rail", name="p", reading=Reading(nominal="none")).measured
        assert measured.noise_mm == pytest.approx(noise_mm, rel=0.25)
        lengths.append(measured.filter_mm)
    assert PRACTICE_MM[0] <= lengths[0] < lengths[1] < lengths[2]


def test_the_lines_that_the_points_allow():
    line = rail("site_b_hr.prr")
    variants = make_profile_variants(line)
    assert make_profile_variants(line) is variants
    assert make_profile_variants(load_library_profile("60E1")) == ()
    y = np.linspace(-25.0, 25.0, 41)
    lengths = {round(variant.filter_mm, 1) for variant in variants} | {round(line.measured.filter_mm, 1)}
    assert lengths == {4.0, 5.7, 8.0}
    # waves that neighbouring points have in common are redrawn on the shortest filter, which keeps the most of them
    assert [(round(variant.filter_mm, 1), variant.draw) for variant in variants] == [
        *((4.0, -1), (8.0, -1)),
        *((4.0, draw) for draw in range(4)),
    ]
    for variant in variants:
        off = np.abs(variant.profile.height(y) - line.height(y)).max()
        assert 1e-6 < off < 0.05
        single = rail("site_b_hr.prr", filter_mm=variant.filter_mm, nominal="none")
        if variant.draw < 0:
            assert variant.profile.height(y) == pytest.approx(single.height(y), abs=1e-9)
    # a declared filter is the only one, and what it removes is no noise
    declared = rail("site_b_hr.prr", filter_mm=8.0)
    assert make_profile_variants(declared) == ()
    assert any("filter length 8 mm (declared: verdicts count for this filter alone)" in note for note in declared.notes)
    noisy = rail("avg_low2.ban", filter_mm=8.0)
    assert [(variant.filter_mm, variant.draw) for variant in make_profile_variants(noisy)] == [
        (8.0, draw) for draw in range(4)
    ]
    # as the deviation of a profile, and without it
    points = sample_points(load_library_profile("60E1"), 0.3)
    points[:, 1] += 0.005 * np.random.default_rng(0).normal(size=len(points))
    by_nominal = profile_from_points(*points.T, kind="rail", name="p", reading=Reading())
    assert by_nominal.measured.nominal
    # the points speak against the line without it, whose corners are blunt
    assert {variant.nominal for variant in make_profile_variants(by_nominal)} == {by_nominal.measured.nominal}


def worn_wheel(depth_mm, middle_mm, half_mm, seed=0, name="S1002"):
    """A wheel worn over a width across, smoothed from points with 4 um of noise."""
    exact = load_library_profile(name)
    p = exact.evaluate(exact.at_arc_length(np.arange(0.6, exact.length_mm - 0.6, 0.3)))
    worn = depth_mm * np.cos(0.5 * np.pi * np.clip((p.y - middle_mm) / half_mm, -1.0, 1.0)) ** 2
    off = worn + 0.004 * np.random.default_rng(seed).normal(size=worn.size)
    y, z = p.y - off * np.sin(p.angle_rad), p.z + off * np.cos(p.angle_rad)
    # hollow: the rolling radius belongs to the new wheel
    return profile_from_points(y, z, kind="wheel", name="p", reading=Reading(tape_circle_z_mm=0.0)).measured


# 3 mm over the whole tread lie as near to a cone of 1:40, and over more of it to a thicker flange
@pytest.mark.parametrize(("depth_mm", "middle_mm", "half_mm"), [
    (0.3, -42.0, 15.0), (0.7, -42.0, 15.0), (1.5, -42.0, 15.0), (0.7, 10.0, 25.0), (1.5, 10.0, 25.0),
    (3.0, 0.0, 20.0), (3.0, 0.0, 30.0),
])  # fmt: skip
def test_a_worn_wheel_is_its_own_profile_or_none(depth_mm, middle_mm, half_mm):
    """A worn wheel is recognised as its new profile or as no profile.

    Worn flanges ended in a traceback, and hollow treads became the treads of the next profile that fits.
    """
    wheel = worn_wheel(depth_mm, middle_mm, half_mm)
    assert wheel.nominal in ("S1002", "MBench_S1002", "")
    assert wheel.noise_mm == pytest.approx(0.004, rel=0.3)


# the third is further off all of its points than three other profiles are
@pytest.mark.parametrize(("name", "depth_mm", "middle_mm", "half_mm", "seed"), [
    ("S1002", 3.0, 5.0, 22.0, 31), ("EN13715_1in40", 3.0, 15.0, 18.0, 1), ("EN15302_H", 1.0, 5.0, 22.0, 1),
])  # fmt: skip
def test_a_wheel_is_the_profile_that_it_lies_on_beside_its_wear(name, depth_mm, middle_mm, half_mm, seed):
    """The profile is chosen by the points beside the wear.

    Another profile is as near to all of the points together, with a deviation as smooth.
    """
    assert worn_wheel(depth_mm, middle_mm, half_mm, seed, name).nominal == name


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in list_reference_names("wheel") if not name.startswith("CONE")])
def test_wheels_of_the_library_that_are_hollow_are_their_own_profile_or_none(name):
    """Hollow wheels of the library; turned cones are equal to each other."""
    nominals = {
        worn_wheel(depth, middle, half, seed, name).nominal
        for middle, half in ((5.0, 22.0), (-5.0, 25.0), (15.0, 18.0))
        for depth in (1.0, 3.0)
        for seed in (1, 2)
    }
    assert nominals <= {name, ""} | ({"S1002", "MBench_S1002"} if "S1002" in name else set())


@pytest.mark.slow
@pytest.mark.parametrize("middle_mm", [-45.0, -42.0, -38.0, -5.0, 0.0, 5.0, 10.0])
def test_wheels_worn_at_the_flange_and_hollow_ones_are_their_own_profile_or_none(middle_mm):
    """Seeds and widths that nothing was chosen by."""
    half, depths = (12.0, (0.3, 0.6, 0.9, 1.2, 1.5)) if middle_mm < -30.0 else (22.0, (0.5, 1.0, 2.0, 3.0))
    nominals = [worn_wheel(depth, middle_mm, half, seed).nominal for depth in depths for seed in range(30, 34)]
    assert set(nominals) <= {"S1002", "MBench_S1002", ""}
    # the least worn are recognised
    assert all(nominals[:4])


def test_library_lines_without_noise_are_exact():
    for name, kind in (("60E1", "rail"), ("54E1", "rail"), ("S1002", "wheel")):
        points = sample_points(load_library_profile(name), 0.5)
        assert is_exact(points)
        line = profile_from_points(*points.T, kind=kind, name="p", reading=Reading())
        assert line.measured is None
        assert line.height(points[5:-5, 0]) == pytest.approx(points[5:-5, 1], abs=1e-5)


@pytest.mark.parametrize(("old", "new"), [
    ("smoothing_mm", "filter_mm"), ("flip_z", "columns = '1,-2'"), ("decimal", "recognised"), ("offsets", "are added"),
])  # fmt: skip
def test_an_old_input_is_refused_with_the_new_way_to_write_it(old, new, capsys):
    with pytest.raises(InputError, match=f"{old} is no longer an input; .*{new}"):
        Reading(**{old: "1"})
    assert call(["profiles", "60E1", f"--rail-{old.replace('_', '-')}", "1"]) == 2
    assert new in capsys.readouterr().err
