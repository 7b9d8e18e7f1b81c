"""Files of points: accepted files, refusals with their remedies, and accuracy of curvatures."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from points import profile_from_points, read_points

from fecontact.errors import InputError
from fecontact.profiles.curve import check_shape
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.origin import check_origin
from fecontact.profiles.points import SPLINE_NOISE
from fecontact.profiles.readers import formats
from fecontact.profiles.readers.columns import ColumnSource, parse_columns
from fecontact.profiles.readers.formats import parse_toml, read_toml
from fecontact.profiles.reading import MM_PER_UNIT, Reading
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.profiles.segments import StraightSegment
from fecontact.profiles.writers import sample_points


def rail_points(step=0.5):
    y = np.arange(-35.0, 35.0 + step / 2, step)
    return y, load_library_profile("60E1").height(y)


def wheel_points(step=0.5, y_to=60.0):
    y = np.arange(-69.5, y_to + step / 2, step)
    return y, load_library_profile("S1002").height(y)


def text_of(y, z, separator=" "):
    return "".join(f"{a:.6f}{separator}{b:.6f}\n" for a, b in zip(y, z, strict=True))


@pytest.fixture
def write(tmp_path):
    def writer(content):
        path = tmp_path / "measured.txt"
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
        return path

    return writer


@pytest.mark.parametrize("separator", [" ", "\t", ",", ";", " ; ", "   "])
def test_separators_comments_and_a_header(write, separator):
    y, z = rail_points()
    path = write("# a comment\n! another\n% a third\n\ny [mm]" + separator + "z [mm]\n" + text_of(y, z, separator))
    rail = read_points(path, kind="rail")
    assert rail.name == "measured"
    assert rail.height(y) == pytest.approx(z, abs=1e-6)
    assert rail.notes[0] == "assumed: mm, y positive to the field side, z up, not canted"


def test_byte_order_mark_windows_line_ends_and_an_old_encoding(write):
    y, z = rail_points()
    lines = text_of(y, z).replace("\n", "\r\n").encode()
    assert read_points(write(b"\xef\xbb\xbf" + lines), kind="rail").height(0.0) == pytest.approx(0.0, abs=1e-6)
    assert read_points(write("# Prüfling\n".encode("latin-1") + lines), kind="rail").y_range_mm == (-35.0, 35.0)


def test_resolve_reads_a_file_of_points(write):
    assert resolve_rail(str(write(text_of(*rail_points())))).kind == "rail"
    assert resolve_wheel(str(write(text_of(*wheel_points())))).profile.kind == "wheel"


def test_the_ending_chooses_the_reader(tmp_path):
    assert formats.find_reader(Path("mine.toml")) is formats.find_reader(Path("a.b/MINE.TOML"))
    for name in ("mine.txt", "mine.CSV", "mine.2026", "mine", ".toml"):
        path = tmp_path / name
        path.write_text(text_of(*rail_points()), "utf-8")
        assert resolve_rail(str(path)).segments[0].points.shape == (141, 2)


def test_a_new_format_is_one_entry(tmp_path, monkeypatch):
    paths = []

    def reader(path, kind, reading):
        paths.append((path, kind))
        return load_library_profile("S1002")

    monkeypatch.setitem(formats.READERS, ".mini", reader)
    path = tmp_path / "worn.Mini"
    assert resolve_wheel(str(path)).profile is load_library_profile("S1002")
    with pytest.raises(InputError, match="is a wheel, but a rail is needed"):
        resolve_rail(str(path))
    assert paths == [(path, "wheel"), (path, "rail")]


def test_descending_points_are_reversed_with_a_note():
    y, z = rail_points()
    rail = profile_from_points(y[::-1], z[::-1], kind="rail", name="r")
    assert rail.height(y) == pytest.approx(z, abs=1e-12)
    assert any("reversed" in note for note in rail.notes)


def test_repeated_points_are_dropped_with_a_note():
    y, z = rail_points()
    rail = profile_from_points(np.insert(y, 7, y[7]), np.insert(z, 7, z[7]), kind="rail", name="r")
    assert rail.curvature(0.0) == pytest.approx(1 / 300, rel=1e-4)
    assert "1 repeated point left out" in rail.notes


def good():
    return text_of(*rail_points())


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"PK\x03\x04\0\0\0", "not plain text"),
        ("1 2\n3 4\n".encode("utf-16"), "not plain text"),
        ("", "no numbers"),
        ("# only a comment\n", "no numbers"),
        ("y z\n1 2\nleft right\n", "line 3: 'left right' does not have two numbers"),
        ("y z\nhead\n1 2\n", "there are 1 different point"),
        (
            "\x01\x02\x03\xff\n1 2 3\n",
            "line 2: 3 columns instead of 2 in .*; state which columns are y and z: give --rail-columns 2,3",
        ),
        ("140\n" + good(), "line 1: 1 column instead of 2 in '140'"),
        (
            "1,5,2,5\n",
            "line 1: 4 columns instead of 2 in '1,5,2,5'; .* commas separate columns and decimals: write decimal point",
        ),
        (good() + "36.0 nan\n", "line 142: '36.0 nan' has a number that is not finite"),
        (good() + "inf 3.0\n", "not finite"),
        ("".join(f"{y} {-y * y / 50}\n" for y in range(-4, 5)), "there are 9 different points; allowed: 10 to 10000"),
        ("1.0 2.0\n" * 40, "there are 1 different point; allowed: 10 to 10000"),
    ],
)
def test_refused_files(write, content, message):
    with pytest.raises(InputError, match=message):
        read_points(write(content), kind="rail")


@pytest.mark.parametrize("ending", [".toml", ".txt", ".csv", ""])
@pytest.mark.parametrize("resolve", [resolve_rail, resolve_wheel])
def test_what_is_no_profile_is_refused_whatever_its_ending(tmp_path, monkeypatch, resolve, ending):
    path = tmp_path / f"mine{ending}"
    contents = [
        b"",
        b"\n\n",
        b"\xef\xbb\xbf",
        b"\0",
        b"\x89PNG\r\n\x1a\n\0\0",
        bytes(range(256)),
        b"\xff\xfe1\0",
        b"[" * 5000,
    ]
    for content in contents:
        path.write_bytes(content)
        with pytest.raises(InputError, match="mine"):
            resolve(str(path))
    with pytest.raises(InputError, match=r"cannot read .*Not a directory|there is no file"):
        resolve(f"{path}/below{ending}")

    def refuse(self, *_, **__):
        raise PermissionError(13, "Permission denied", str(self))

    with monkeypatch.context() as patched:
        patched.setattr(Path, "open", refuse)
        patched.setattr(Path, "read_bytes", refuse)
        with pytest.raises(InputError, match=r"cannot read .*mine.*: Permission denied; check the path"):
            resolve(str(path))
    path.unlink()
    path.mkdir()
    with pytest.raises(InputError, match=r"cannot read .*mine.*: Is a directory; check the path"):
        resolve(str(path))


@pytest.mark.parametrize("reader", [lambda path: read_points(path, kind="rail"), read_toml])
def test_a_name_that_no_file_can_have_is_refused(reader):
    with pytest.raises(InputError, match=r"cannot read .*null"):
        reader("nul\0.txt")
    with pytest.raises(InputError, match=r"cannot read .*too long"):
        reader("x" * 5000)


@pytest.mark.parametrize("sign", ["\n", "\x1b", "\u202e", "\u2028"])
def test_a_name_that_would_turn_or_break_what_is_printed_is_refused(tmp_path, sign):
    """A profile's name stands in tables, pages and on the terminal."""
    good, bad = (tmp_path / f"head{ending}.txt" for ending in ("", sign))
    for path in (good, bad):
        np.savetxt(path, np.column_stack(rail_points()))
    resolve_rail(str(good))
    with pytest.raises(InputError, match=r"invisible characters, .*; rename the file") as error:
        resolve_rail(str(bad))
    assert sign not in str(error.value)


def test_points_farther_away_than_numbers_are_fine_are_refused():
    y, z = rail_points()
    for far in (1e308, -1e308, 2e9, math.inf, math.nan):
        with pytest.raises(
            InputError, match=r"point 8 is .* mm; allowed: -1e\+09 to 1e\+09 mm; remove it, or move the"
        ):
            profile_from_points(y, np.where(np.arange(z.size) == 7, far, z), kind="rail", name="p")


def test_unreadable_files(tmp_path):
    with pytest.raises(InputError, match=r"cannot read .*No such file"):
        read_points(tmp_path / "none.txt", kind="rail")
    with pytest.raises(InputError, match="cannot read"):
        read_points(tmp_path, kind="rail")


@given(st.binary(max_size=300))
def test_any_bytes_end_in_an_input_error_or_a_profile(data):
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    with pytest.raises(InputError):  # noqa: PT012
        table = parse_columns(text, ColumnSource(what="file", kind="rail", reading=Reading()))
        profile_from_points(table.y, table.z, kind="rail", name="file")


@given(st.one_of(st.binary(max_size=300).map(lambda data: data.decode("latin-1")), st.text(st.characters())))
def test_any_text_as_toml_ends_in_an_input_error(text):
    with pytest.raises(InputError, match="profile file"):
        parse_toml(text, name="file")


@example(
    [*((0.0, z) for z in (0.0, 4.0, 5.0, 6.0, 7.0, 8.0, 2.3e-308)), (1, 0), (1, 1), (2, 0), (0.5, 0)], "rail", True
)
@given(
    st.lists(st.tuples(st.floats(-60.0, 60.0), st.floats(-30.0, 30.0)), min_size=1, max_size=40),
    st.sampled_from(["rail", "wheel"]),
    st.booleans(),
)
def test_any_points_end_in_an_input_error_or_a_profile(points, kind, ordered):
    y, z = np.array(sorted(points) if ordered else points).T
    try:
        profile = profile_from_points(y, z, kind=kind, name="points")
    except InputError:
        return
    assert np.isfinite(profile.length_mm)
    assert profile.notes


@pytest.mark.parametrize("tiny_mm", [0.0, 2.2250738585e-313, 1.6077680026589231e-260, 5e-10])
def test_points_that_lie_on_each_other_are_one(tiny_mm):
    y, z = rail_points()
    again = np.insert(y, 100, y[100]), np.insert(z, 100, z[100])
    again[1][100] += tiny_mm
    profile = profile_from_points(*again, kind="rail", name="p")
    assert "1 repeated point left out" in profile.notes
    assert profile.length_mm == pytest.approx(profile_from_points(y, z, kind="rail", name="p").length_mm, abs=1e-8)
    with pytest.raises(InputError, match="different point"):
        profile_from_points(np.zeros(12), tiny_mm * np.arange(12.0), kind="rail", name="p")


def test_a_wheel_that_lost_its_minus_signs_has_a_kink():
    """A tread that is reflected at the tape circle is smooth except for a point."""
    y, z = sample_points(load_library_profile("S1002"), 0.5).T
    good, bad = (profile_from_points(y, line, kind="wheel", name="p").notes for line in (z, np.where(y > 0.0, -z, z)))
    assert not any("kink" in note for note in good)
    assert sum("a kink at (" in note for note in bad) == 1


@pytest.mark.parametrize("kind", ["rail", "wheel"])
def test_units_other_than_mm_are_refused(kind):
    y, z = rail_points() if kind == "rail" else wheel_points()
    for unit, mm in MM_PER_UNIT.items():
        if unit != "mm":
            with pytest.raises(
                InputError, match=rf"to 500 mm; the unit of the file may be {unit}: give --{kind}-units {unit} "
            ):
                profile_from_points(y / mm, z / mm, kind=kind, name="p")
    with pytest.raises(InputError, match=f"the unit of the file may be mm: give --{kind}-units mm"):
        profile_from_points(1e3 * y, 1e3 * z, kind=kind, name="p", reading=Reading(units="m"))


def test_axes_pointing_the_wrong_way_are_refused():
    y, z = rail_points()
    with pytest.raises(InputError, match=r"middle of the rail is .* below .*; reverse the sign of z"):
        profile_from_points(y, -z, kind="rail", name="p")
    half = y <= 0.0
    with pytest.raises(InputError, match="reverse the sign of z"):
        profile_from_points(y[half], -z[half], kind="rail", name="p")
    y, z = wheel_points()
    with pytest.raises(InputError, match=r"rises to 2\d\.\d mm above the tread at y = -55.*; reverse the sign of z"):
        profile_from_points(y, -z, kind="wheel", name="p")
    with pytest.raises(InputError, match="reverse the sign of y"):
        profile_from_points(-y, z, kind="wheel", name="p")


def test_a_long_flange_back_is_no_reason_to_refuse():
    y, z = wheel_points()
    back = np.arange(40.0, -9.6, -0.5)
    wheel = profile_from_points(
        np.concatenate((np.full(back.size, -70.0), y)), np.concatenate((back, z)), kind="wheel", name="p"
    )
    assert any("kept as a steep side" in note for note in wheel.notes)
    assert wheel.height(0.0) == pytest.approx(0.0, abs=1e-6)
    assert wheel.height(-69.0) == pytest.approx(load_library_profile("S1002").height(-69.0), abs=0.02)


def test_folded_and_unordered_lines_are_refused():
    y, z = rail_points()
    swapped = np.arange(y.size)
    swapped[[60, 61]] = 61, 60
    with pytest.raises(InputError, match="turns back at point"):
        profile_from_points(y[swapped], z[swapped], kind="rail", name="p")
    rng = np.random.default_rng(3)
    order = rng.permutation(y.size)
    with pytest.raises(InputError, match="turns back at point"):
        profile_from_points(y[order], z[order], kind="rail", name="p")
    closed = np.concatenate((y, y[::-1])), np.concatenate((z, np.full(y.size, -20.0)))
    with pytest.raises(InputError, match="turns back at point"):
        profile_from_points(*closed, kind="rail", name="p")


def test_a_gap_is_refused_and_a_coarse_file_is_noted():
    y, z = rail_points()
    keep = (y < 5.0) | (y > 12.0)
    with pytest.raises(InputError, match=r"gap of 8\.\d+ mm after \(4\.5, -0\.03.*\) mm"):
        profile_from_points(y[keep], z[keep], kind="rail", name="p")
    rail = profile_from_points(y[::7], z[::7], kind="rail", name="p")
    assert any("apart, at" in note for note in rail.notes)


def test_doubtful_origins_are_noted():
    y, z = rail_points()
    tilt = 1 / 40
    canted = profile_from_points(y + tilt * z, z - tilt * y, kind="rail", name="p")
    assert any("the rail may be canted or worn" in note for note in canted.notes)
    y, z = wheel_points()
    lifted = profile_from_points(y, z + 0.3, kind="wheel", name="p")
    assert any("z = 0.3 mm at the tape circle y = 0, not 0" in note for note in lifted.notes)
    with pytest.raises(InputError, match=r"z = 3 mm at the tape circle y = 0; allowed: -0\.5 to 0\.5 mm"):
        profile_from_points(y, z + 3.0, kind="wheel", name="p")
    with pytest.raises(InputError, match="tape circle y = 0 is outside"):
        profile_from_points(y[y < -5], z[y < -5], kind="wheel", name="p")


def test_corners_split_the_spline():
    y, z = wheel_points(y_to=65.0)
    wheel = profile_from_points(y, z, kind="wheel", name="p")
    assert any("split at 1 corner: y = 60.00 mm" in note for note in wheel.notes)
    (corner,) = wheel.junctions
    assert corner.is_corner
    assert corner.y_mm == pytest.approx(60.0, abs=1e-9)
    # the straight pieces on both sides stay straight, without overshoot across the corner
    assert wheel.curvature([59.0, 60.5, 64.0]) == pytest.approx(0.0, abs=1e-9)
    # a piece of two points is a line
    last = profile_from_points(np.append(y[y <= 60], 65.0), np.append(z[y <= 60], z[-1]), kind="wheel", name="p")
    assert isinstance(last.segments[-1], StraightSegment)


@pytest.mark.parametrize(
    ("y_from", "y_to", "tolerance_per_mm"),
    [
        # The spline errs by about h^2 / 12 times the second derivative of the curvature: 2.5e-5 in the throat...
        (-25.0, 31.0, 3e-5),
        # ...and nothing where the line is straight, away from the junction at 32.16 mm.
        (35.0, 59.0, 2e-6),
        # Within a point or two of the junction the spline rounds off the jump of 4.1e-3: half of it at the junction.
        (31.0, 35.0, 2.6e-3),
    ],
)
def test_curvature_of_an_interpolated_s1002(y_from, y_to, tolerance_per_mm):
    wheel = load_library_profile("S1002")
    interpolated = profile_from_points(*wheel_points(), kind="wheel", name="p")
    y = np.linspace(y_from, y_to, 5001)
    assert np.abs(interpolated.curvature(y) - wheel.curvature(y)).max() < tolerance_per_mm
    assert np.abs(interpolated.height(y) - wheel.height(y)).max() < 3e-5


@pytest.mark.parametrize("scatter_mm", [1e-4, 1e-3])
def test_the_noted_curvature_noise_is_the_one_that_arises(scatter_mm):
    y, z = wheel_points()
    noisy = z + scatter_mm * np.random.default_rng(7).normal(size=y.size)
    profile = profile_from_points(y, noisy, kind="wheel", name="p")
    noted = float(profile.notes[-1].split("uncertain by about ")[1].split()[0])
    tread = y[(y > -20.0) & (y < 30.0)]
    arisen = np.std(profile.curvature(tread) - load_library_profile("S1002").curvature(tread))
    # one significant digit in the note, and a sample of a hundred points
    assert noted == pytest.approx(arisen, rel=0.5)


def test_noise_factor_is_the_mean_of_the_transfer_function():
    w = np.linspace(0.0, math.pi, 20001)
    power = (12.0 * (1.0 - np.cos(w)) / (4.0 + 2.0 * np.cos(w))) ** 2
    assert math.sqrt(np.trapezoid(power, w) / math.pi) == pytest.approx(SPLINE_NOISE, rel=1e-9)


def test_a_rail_upside_down_is_seen_wherever_its_file_has_the_origin():
    y = np.linspace(-36.0, 36.0, 73)
    for origin in (0.0, 60.0, 750.0, -750.0):
        check_shape(y + origin, -(y**2) / 100.0, kind="rail", what="file")
        with pytest.raises(InputError, match=r"below the chord between its ends"):
            check_shape(y + origin, y**2 / 100.0, kind="rail", what="file")


def test_a_wheel_upside_down_whose_last_point_is_the_highest_is_told_with_that_point():
    y = np.linspace(0.0, 100.0, 101)
    with pytest.raises(InputError, match=r"above the tread at y = 100\.0 mm"):
        check_shape(y, 40.0 * (y / 100.0) ** 4, kind="wheel", what="file")


def line_through(*corners: tuple[float, float]):
    """A level line from -40 to 40 mm with straight lines between corners.

    It has a point every 0.1 mm.
    """
    y = np.round(np.arange(-40.0, 40.05, 0.1), 9)
    return y, np.interp(y, *zip(*corners, strict=True))


def v(depth: float, at: float) -> tuple[tuple[float, float], ...]:
    return ((-40.0, 0.0), (at - 8.0, 0.0), (at, -depth), (at + 8.0, 0.0), (40.0, 0.0))


def ends(depth: float, dip: float = 0.0) -> tuple[tuple[float, float], ...]:
    middle = ((-10.0, 0.0), (-8.0, -dip), (-6.0, 0.0)) if dip else ()
    return ((-40.0, -depth), (-30.0, 0.0), *middle, (30.0, 0.0), (40.0, -depth))


@pytest.mark.parametrize(
    ("kind", "good", "bad", "message"),
    [
        # a dip of 8 mm is a flange; it is a groove if on both sides at least 20 mm are within 8 mm of the top
        ("rail", v(7.9, 20.5), v(8.1, 20.5), r"the profile dips by 8\.1 mm at y = 20\.5 mm"),
        ("rail", v(7.9, 19.5), v(8.1, 19.5), r"a groove of 8\.1 mm at y = 19\.5 mm"),
        # 0.1 mm below the chord between the ends
        ("rail", ends(-0.09), ends(-0.11), r"is 0\.11 mm below the chord"),
        # both ends 8 mm below the middle, without a dip of 1 mm
        ("wheel", ends(7.9), ends(8.1), "both ends of the profile are more than 8 mm below its middle"),
        (
            "wheel",
            ends(8.1, dip=1.1),
            ends(8.1, dip=0.9),
            "both ends of the profile are more than 8 mm below its middle",
        ),
        # 10 mm up, or down on the field side
        ("wheel", v(-9.9, -25.0), v(-10.1, -25.0), r"rises to 10\.1 mm above the tread at y = -25\.0 mm"),
        ("wheel", v(9.9, 25.0), v(10.1, 25.0), r"the flange is at y = 25\.0 mm, but a flange is on the gauge side"),
    ],
)
def test_a_line_is_refused_from_the_size_on_that_its_body_does_not_have(kind, good, bad, message):
    check_shape(*line_through(*good), kind=kind, what="file")
    with pytest.raises(InputError, match=message):
        check_shape(*line_through(*bad), kind=kind, what="file")
    # independent of the origin of the file
    y, z = line_through(*bad)
    with pytest.raises(InputError, match=r"file: "):
        check_shape(y + 700.0, z + 300.0, kind=kind, what="file")


def test_a_flange_on_the_gauge_side_is_none_on_the_field_side():
    check_shape(*line_through(*v(28.0, -25.0)), kind="wheel", what="file")
    # the back of a flange (slope above 4) does not count; a flank with slope 3.9 counts
    for slope, refused in ((4.1, False), (3.9, True)):
        wall = ((-40.0, 0.0), (35.0, 0.0), (40.0, 5.0 * slope))
        if refused:
            with pytest.raises(InputError, match=r"rises to 19\.5 mm above the tread"):
                check_shape(*line_through(*wall), kind="wheel", what="file")
        else:
            check_shape(*line_through(*wall), kind="wheel", what="file")


@pytest.mark.parametrize(
    ("kind", "y_mm", "z_mm", "said"),
    [
        ("rail", 0.9, 0.09, ""),
        ("rail", -1.1, 0.0, r"the highest point is \(-1\.1, 0\) mm"),
        ("rail", 0.0, -0.11, r"the highest point is \(0, -0\.11\) mm"),
        ("wheel", 0.0, 0.09, ""),
        ("wheel", 0.0, -0.11, r"z = -0\.11 mm at the tape circle y = 0, not 0"),
    ],
)
def test_an_origin_is_noted_from_a_tenth_of_a_millimetre_on(kind, y_mm, z_mm, said):
    y, z = line_through((-40.0, -4.0), (0.0, 0.0), (40.0, -4.0)) if kind == "rail" else line_through((0.0, 0.0))
    notes = check_origin(np.column_stack((y + y_mm, z + z_mm)), kind, Reading(), "file")
    assert len(notes) == bool(said)
    assert re.search(said, " ".join(notes))
