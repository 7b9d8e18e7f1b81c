"""Refusals of profile files with a doubtful origin, in every format, and their remedies."""

import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from fecontact.bodies import Track
from fecontact.case import Case
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.placement.poses import place_rail
from fecontact.placement.wheel_on_rail import set_up_pair
from fecontact.profiles.examples import write_examples
from fecontact.profiles.library import list_names, load_library_profile
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.solving.placing import place_case


def points_of(name: str, step_mm: float = 0.3) -> np.ndarray:
    line = load_library_profile(name)
    points = line.evaluate(line.spread(step_mm))
    return np.column_stack((points.y, points.z))


def save_csv(path, y, z):
    path.write_text("y_mm,z_mm\n" + "".join(f"{a:.6f},{b:.6f}\n" for a, b in zip(y, z, strict=True)))


def save_text(path, y, z):
    path.write_text("".join(f"{a:.6f} {b:.6f}\n" for a, b in zip(y, z, strict=True)))


def save_simpack(path, y, z):
    head = (
        f"header.begin\n  version = 1\n  type = {int(path.suffix == '.prw')}\nheader.end\nspline.begin\npoint.begin\n"
    )
    rows = "".join(f"  {a:.6f} {-b:.6f}\n" for a, b in zip(y, z, strict=True))
    path.write_text(f"{head}{rows}point.end\nspline.end\n")


def save_miniprof(path, y, z):
    # Y grows into the body of a wheel; X of a rail grows to the centre of the track
    sign = 1.0 if path.suffix == ".whl" else -1.0
    rows = "".join(f"{sign * a:.6f} {-b:.6f}\n" for a, b in zip(y, z, strict=True))
    path.write_text(f"MPTypeNo=1\nColumnDef=X,Y\n\n{rows}")


def save_toml(path, y, z):
    kind = "wheel" if "wheel" in path.name else "rail"
    ends = [f"[{float(a)!r}, {float(b)!r}]" for a, b in zip(y, z, strict=True)]
    lines = [f'[[surface]]\ntype = "line"\nfrom = {a}\nto = {b}\n' for a, b in pairwise(ends)]
    path.write_text(f'kind = "{kind}"\nunits = "mm"\n' + "".join(lines))


FORMATS = {".csv": save_csv, ".txt": save_text, ".prw": save_simpack, ".whl": save_miniprof, ".toml": save_toml}
RAIL_FORMATS = {".csv": save_csv, ".txt": save_text, ".prr": save_simpack, ".ban": save_miniprof, ".toml": save_toml}


def wheel_file(folder, ending, shift_y=0.0, shift_z=0.0, rows=slice(None)):
    path = folder / f"wheel{ending}"
    y, z = points_of("S1002")[rows].T
    FORMATS[ending](path, y + shift_y, z + shift_z)
    return str(path)


@pytest.mark.parametrize("ending", FORMATS)
def test_a_wheel_counted_from_the_back_of_its_flange_is_refused_until_its_tape_circle_is_given(tmp_path, ending):
    path = wheel_file(tmp_path, ending, 70.0)
    with pytest.raises(InputError, match=r"give --wheel-tape-circle-mm 70 \(tape_circle_mm = 70 in \[wheel_file\]\)"):
        resolve_wheel(path)
    settled = resolve_wheel(path, Reading(tape_circle_mm=70.0, filter_mm=0.0)).profile
    y = np.linspace(-30.0, 40.0, 29)
    # TOML: error of chords of 0.3 mm; other formats: digits of 1e-6 mm
    assert settled.height(y) == pytest.approx(
        load_library_profile("S1002").height(y), abs=1e-3 if ending == ".toml" else 2e-5
    )


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize(("shift_y", "remedy"), [(55.0, "55"), (25.0, "25"), (-40.0, "-40"), (135.0, "135")])
def test_a_flange_far_from_its_place_is_refused_with_the_tape_circle(tmp_path, ending, shift_y, remedy):
    path = wheel_file(tmp_path, ending, shift_y)
    with pytest.raises(
        InputError, match=r"flange is at y = .* allowed: -75 to -40 mm.*give --wheel-tape-circle-mm " + remedy
    ):
        resolve_wheel(path)
    assert resolve_wheel(path, Reading(tape_circle_mm=shift_y, filter_mm=0.0)).profile.height(0.0) == pytest.approx(
        0.0, abs=1e-3
    )


@pytest.mark.parametrize("ending", FORMATS)
def test_a_tape_circle_outside_the_profile_is_refused(tmp_path, ending):
    # the tread alone, from y = -20 mm, moved by 30 mm
    tread = points_of("S1002")[:, 0] > -20.0
    path = wheel_file(tmp_path, ending, 30.0, rows=tread)
    with pytest.raises(
        InputError,
        match=r"tape circle y = 0 is outside the profile or at its end.* 11\.\d* to 94 mm, with --wheel-tape",
    ):
        resolve_wheel(path)
    assert resolve_wheel(path, Reading(tape_circle_mm=30.0, filter_mm=0.0)).profile.height(0.0) == pytest.approx(
        0.0, abs=1e-3
    )


@pytest.mark.parametrize("ending", FORMATS)
def test_a_height_at_the_tape_circle_is_refused_until_it_is_settled(tmp_path, ending):
    path = wheel_file(tmp_path, ending, 0.0, 2.0)
    with pytest.raises(
        InputError,
        match=r"z = 2 mm at the tape circle y = 0; allowed: -0\.5 to 0\.5 mm;"
        r" give --wheel-tape-circle-z-mm 2 .*-z-mm 0 ",
    ):
        resolve_wheel(path)
    for reading, height in ((2.0, 0.0), (0.0, 2.0)):
        settled = resolve_wheel(path, Reading(tape_circle_z_mm=reading, filter_mm=0.0)).profile
        assert settled.height(0.0) == pytest.approx(height, abs=1e-4)
    # small offsets of instruments give only a note
    little = resolve_wheel(wheel_file(tmp_path, ending, 0.0, -0.3), Reading(filter_mm=0.0)).profile
    assert any("z = -0.3 mm at the tape circle y = 0, not 0" in note for note in little.notes)


def canted_rail(folder, ending, *, mirrored, one_in=20.0):
    """Write a 60E1 that is canted to the track centre, or its mirror image."""
    y, z = points_of("60E1").T
    c, s = np.cos(np.arctan(1.0 / one_in)), np.sin(np.arctan(1.0 / one_in))
    y, z = y * c - z * s, y * s + z * c
    if mirrored:
        y, z = -y[::-1], z[::-1]
    path = folder / f"rail{ending}"
    RAIL_FORMATS[ending](path, y, z)
    return str(path)


@pytest.mark.parametrize("ending", RAIL_FORMATS)
def test_a_gauge_corner_on_the_wrong_side_is_refused_until_it_is_settled(tmp_path, ending):
    right = resolve_rail(canted_rail(tmp_path, ending, mirrored=False), Reading(filter_mm=0.0))
    path = canted_rail(tmp_path, ending, mirrored=True)
    with pytest.raises(
        InputError, match=r"lower on its field side.* give --rail-mirror yes .* or give --rail-mirror no "
    ):
        resolve_rail(path, Reading(filter_mm=0.0))
    y = np.linspace(-25.0, 25.0, 21)
    mirrored, unmirrored = (resolve_rail(path, Reading(filter_mm=0.0, mirror=mirror)) for mirror in (True, False))
    assert mirrored.height(y) == pytest.approx(right.height(y), abs=1e-6)
    assert unmirrored.height(-y) == pytest.approx(right.height(y), abs=1e-6)


def test_a_rail_without_a_gauge_side_is_refused_with_the_option_that_turns_it(tmp_path):
    y, z = points_of("60E1").T
    is_on_field_side = y < 12.0
    save_csv(tmp_path / "half.csv", -y[is_on_field_side][::-1], z[is_on_field_side][::-1])
    half = str(tmp_path / "half.csv")
    with pytest.raises(
        InputError,
        match=r"gauge side ends 0\.\d* mm below.*field side ends 3\d\.\d* mm below it: give --rail-mirror yes",
    ):
        place_case(Case(rail=half))
    placement = place_case(Case(rail=half, rail_file=Reading(mirror=True, filter_mm=0.0)))
    assert placement.first.rail_y_mm == pytest.approx(place_case(Case()).first.rail_y_mm, abs=2e-3)


def test_the_given_place_of_a_crown_is_that_of_the_crown_and_not_of_the_origin(tmp_path):
    y, z = points_of("60E1", 0.02).T
    save_csv(tmp_path / "beside.csv", y + 30.0, z - 5.0)
    displaced = resolve_rail(str(tmp_path / "beside.csv"), Reading(filter_mm=0.0))
    for inclination in (0.0, 0.025):
        track = Track(rail_crown_y_mm=750.0)
        from_file, library = (
            place_rail(profile, inclination, track) for profile in (displaced, load_library_profile("60E1"))
        )
        across = np.linspace(725.0, 775.0, 26)
        # the position of the crown is accurate to 0.02 mm
        assert from_file.height_at_y(across) == pytest.approx(library.height_at_y(across), abs=0.02)


def test_profiles_of_the_library_and_flangeless_ones_are_not_doubtful(tmp_path):
    for name in list_names("wheel"):
        path = tmp_path / "wheel.csv"
        save_csv(path, *points_of(name).T)
        assert not any(
            "tape circle" in note for note in resolve_wheel(str(path), Reading(filter_mm=0.0)).profile.notes[1:]
        )
    for name in list_names("rail"):
        save_csv(tmp_path / "rail.csv", *points_of(name).T)
        rail = resolve_rail(str(tmp_path / "rail.csv"), Reading(filter_mm=0.0))
        assert not any("mirrored" in note for note in rail.notes)
        set_up_pair(rail, load_library_profile("S1002"), inclination_rad=0.025)


def test_pair_geometry_have_a_line_of_geometry_above_the_ellipse(tmp_path, capsys):
    path = wheel_file(tmp_path, ".csv")
    placement = place_case(Case(wheel=path, wheel_file=Reading(filter_mm=0.0), lateral_shift_mm=2.0))
    arguments = ["--wheel", path, "--wheel-filter-mm", "0", "--shift", "2"]
    for command in (["hertz"], ["theory", "strip"], ["place"]):
        assert call([*command, *arguments]) == 0
        line = capsys.readouterr().out.splitlines()[0]
        assert line.startswith("geometry of wheel.csv@"), command
        assert f"contact point at y = {placement.first.rail_y_mm:+.2f} mm of the rail" in line
        assert f"rolling radius {float(placement.wheel.radius(placement.first.wheel_u)):.2f} mm" in line
        assert "flange height 28.00 mm (tip at y = -55.0 mm), rail inclined by 1:40" in line
    assert call(["hertz", *arguments, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["pair_geometry"] == line
    assert call(["solve", *arguments, "--resolution", "0.9,0.7", "--refine", "never"]) in (0, 3)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == line
    assert any(verdict_line.startswith("Hertz ") for verdict_line in lines[1:4])
    assert call(["hertz"]) == 0
    assert "geometry of" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("content", "radius", "is_marked"),
    [("csv", None, True), ("csv", 460.0, True), ("csv", 450.0, False), ("whl", None, False), ("library", None, False)],
)
def test_a_rolling_radius_that_is_the_default_is_marked(content, radius, is_marked, tmp_path, capsys):
    """Files of wheels rarely have a diameter, and 460 mm may be wrong."""
    write_examples(tmp_path, with_miniprof=True)
    pair = ["--rail", str(tmp_path / "rail.csv"), "--wheel", "S1002"]
    if content != "library":
        pair[-1] = str(tmp_path / f"wheel.{content}")
    radii = [] if radius is None else ["--rolling-radius-mm", str(radius)]
    assert call(["hertz", *pair, *radii, "--shift", "3"]) == 0
    line = capsys.readouterr().out.splitlines()[0]
    assert line.startswith("geometry of ")
    assert (" mm (default: 460 mm at the tape circle; --rolling-radius-mm), flange height" in line) == is_marked


def test_gaps_where_nothing_touches_are_straight_pieces(tmp_path):
    """A chamfer of 45 degrees by its two ends; the side of a head from 17 to 30 mm below its top."""
    y, z = points_of("S1002", 0.5).T
    is_measured = (y < 61.0) | (y > 64.9)
    save_csv(tmp_path / "wheel.csv", y[is_measured], z[is_measured])
    wheel = resolve_wheel(str(tmp_path / "wheel.csv"), Reading(filter_mm=0.0)).profile
    assert any("where no contact is possible: filled by a straight segment" in note for note in wheel.notes)
    # the points miss the corner at 60 mm
    across = np.append(np.linspace(-30.0, 59.0, 64), np.linspace(61.0, 64.5, 8))
    assert wheel.height(across) == pytest.approx(load_library_profile("S1002").height(across), abs=2e-3)
    y, z = points_of("60E1", 0.5).T
    is_measured = ~((z < -17.0) & (z > -30.0) & (y < 0.0))
    save_csv(tmp_path / "rail.csv", y[is_measured], z[is_measured])
    rail = resolve_rail(str(tmp_path / "rail.csv"), Reading(filter_mm=0.0))
    assert any("where no contact is possible: filled by a straight segment" in note for note in rail.notes)
    assert place_case(Case(rail=str(tmp_path / "rail.csv"))).first.rail_y_mm == pytest.approx(
        place_case(Case()).first.rail_y_mm, abs=0.01
    )
    # a gap on the tread is refused
    y, z = points_of("S1002", 0.5).T
    is_measured = (y < 10.0) | (y > 17.0)
    save_csv(tmp_path / "wheel.csv", y[is_measured], z[is_measured])
    with pytest.raises(InputError, match=r"a gap of 7\.\d* mm after"):
        resolve_wheel(str(tmp_path / "wheel.csv"))


def test_an_ellipse_that_does_not_fit_on_its_bodies_is_noted(tmp_path, capsys):
    """A groove of R 81 and 40 mm width on a head of R 80.

    Under 100 kN, b is 22.6 mm.
    """
    reach = math.asin(20.0 / 81.0)
    ends = [f"[{side * 20.0}, {81.0 * math.cos(reach) - 81.0!r}]" for side in (-1.0, 1.0)]
    (tmp_path / "groove.toml").write_text(
        'kind = "wheel"\nunits = "mm"\n[[surface]]\ntype = "arc"\n'
        f"from = {ends[0]}\nto = {ends[1]}\ncentre = [0.0, -81.0]\nradius = 81.0\n"
    )
    pair = [
        "--rail",
        "circle:80",
        "--wheel",
        str(tmp_path / "groove.toml"),
        "--roll-mrad",
        "0",
        "--inclination",
        "none",
    ]
    assert call(["hertz", *pair, "--load-kn", "100"]) == 0
    assert "a part of the ellipse is beyond the profile" in capsys.readouterr().out
    assert call(["hertz", *pair, "--load-kn", "10"]) == 0
    assert "a part of the ellipse is beyond the profile" not in capsys.readouterr().out


def test_an_unusual_flange_is_taken_where_its_tape_circle_is_given(tmp_path):
    """A wheel with its flange tip 30 mm from the tape circle: refused, and settled by a given tape circle y = 0."""
    points = points_of("S1002")
    save_csv(tmp_path / "wheel.csv", *np.add(points, (25.0, 0.0)).T)
    with pytest.raises(InputError, match=r"tape_circle_mm = 0 in \[wheel_file\]"):
        resolve_wheel(str(tmp_path / "wheel.csv"))
    profile = resolve_wheel(str(tmp_path / "wheel.csv"), Reading(tape_circle_mm=0.0, tape_circle_z_mm=0.0)).profile
    assert any("the tip of the flange is at y = -30" in note for note in profile.notes)


def test_the_crown_of_a_level_top_is_its_middle():
    """Level from a junction at y = 0 to 50 mm: the crown is at 25 mm to rounding, not to a step of the search."""
    studies = Path(__file__).parents[1] / "studies" / "profiles"
    rail = resolve_rail(str(studies / "corner_R10.toml"))
    pose = place_rail(rail, 0.0, Track(rail_crown_y_mm=750.0))
    assert pose.crown_y_mm == pytest.approx(725.0, abs=1e-9)
