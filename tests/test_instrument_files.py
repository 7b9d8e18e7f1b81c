"""Numbers, headers, outlines and formats of instruments and other programs, and remedies that are printed."""

import re
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from marks import slow_but
from points import profile_from_points

from fecontact.bodies import Track
from fecontact.case import Case
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.placement.poses import place_rail
from fecontact.profiles.library import list_names, load_library_profile
from fecontact.profiles.readers.instrument_header import measure_flange
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import header_of_file, resolve_rail, resolve_wheel
from fecontact.profiles.writers import sample_points
from fecontact.solving.placing import place_case

FILES = Path(__file__).parent / "profiles"
AS_IS = Reading(filter_mm=0.0)


def head_points(spacing_mm=0.3, name="60E1"):
    return sample_points(load_library_profile(name), spacing_mm)


def wheel_points(spacing_mm=0.3):
    return sample_points(load_library_profile("S1002"), spacing_mm)


def moved(points, y_mm=0.0, z_mm=0.0):
    return points + np.array([y_mm, z_mm])


def rows(points, separator=" "):
    return "".join(f"{separator.join(f'{value:.6f}' for value in row)}\n" for row in points)


@pytest.fixture
def write(tmp_path):
    def write_file(name, content):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return str(path)

    return write_file


# --- numbers ---------------------------------------------------------------------------------------------------------

PLAIN = rows(head_points(), ",")
FORTRAN = "".join(f"{y:.6E} {z:.6E}\n".replace("E", "D") for y, z in np.loadtxt(PLAIN.splitlines(), delimiter=","))
NUMBER_TEXTS = {
    "quoted": re.sub(r"[^,\n]+", r'"\g<0>"', PLAIN),
    "decimal commas in quotes": '"y","z"\n' + re.sub(r"([^,\n]+)", r'"\1"', PLAIN).replace(".", ","),
    "single quotes and semicolons": re.sub(r"([^,\n]+)", r"'\1'", PLAIN).replace(",", ";").replace(".", ","),
    "minus of Unicode": "y_mm,z_mm\n" + PLAIN.replace("-", "\u2212"),
    "minus in quotes": re.sub(r"([^,\n]+)", r'"\1"', PLAIN).replace(".", ",").replace("-", "\u2212"),
    "en dash": PLAIN.replace("-", "\u2013"),
    "Fortran": FORTRAN,
    "Fortran, small letters": FORTRAN.replace("D", "d"),
    "Fortran, decimal commas and minus of Unicode": FORTRAN.replace(".", ",").replace("-", "\u2212"),
    "dash of Windows-1252": PLAIN.replace("-", "\u0096").encode("latin-1"),
}


@pytest.mark.parametrize("text", NUMBER_TEXTS.values(), ids=NUMBER_TEXTS)
def test_numbers_are_read_as_programs_write_them(write, text):
    points = resolve_rail(write("a.csv", text), AS_IS).points
    # six decimals, and six decimals after the first digit
    assert points == pytest.approx(head_points(), abs=6e-6)


@pytest.mark.parametrize("text", ["1.0D", "D5", "1_0", "\u2212", '"a","b"', "1.0D+01D"])
def test_a_text_that_is_no_number_stays_none(write, text):
    with pytest.raises(InputError, match=r"does not have two numbers|columns? instead of 2|no numbers"):
        resolve_rail(write("a.csv", PLAIN + f"{text},{text}\n"), AS_IS)


# --- header ----------------------------------------------------------------------------------------------------------


def miniprof(kind, header="", points=None):
    """File of the instrument.

    A wheel's X counts from the back of its flange, a rail's X to the track centre."""
    taper = "WheelDiameterTaperline=70.0\n" if kind == "wheel" else ""
    if points is None:
        points = moved(wheel_points() * (1, -1), 70) if kind == "wheel" else head_points() * (-1, 1)
    return f"MPTypeNo=131\nColumnDef=X,Y\n{taper}{header}\n{rows(points)}"


def test_the_header_of_a_wheel_is_kept_with_its_units(write, capsys):
    header = "Stock=%Talent\nCarNo=7\nAxleNo=2\nSide=%L\nDate=08/07/2015\nSd=32.5\nSh=28\nqR=10.8\nLine=4\nCurve=R300\n"
    path = write("a.whl", miniprof("wheel", header + "DiameterTaperline=719.2\n"))
    assert header_of_file(path).columns == {
        **{"side": "left", "stock": "Talent", "car_number": "7", "axle_number": "2", "line": "4", "curve": "R300"},
        **{"date": "08/07/2015", "tread_diameter_mm": 719.2},
        **{"flange_thickness_mm": 32.5, "flange_height_mm": 28.0, "flange_gradient_mm": 10.8},
    }
    assert call(["profiles", path]) == 0
    printed = capsys.readouterr().out
    assert "header: side left, stock Talent, car 7, axle 2, line 4, curve R300, date 08/07/2015" in printed
    assert "Sd 32.5 mm, Sh 28 mm, qR 10.8 mm" in printed
    # the new S1002 has these dimensions
    assert "contradicts" not in printed


def test_the_header_of_a_rail_is_kept_and_its_gauge_is_compared(write):
    path = write("a.ban", miniprof("rail", "Gauge=1441.5\nRail=Low\nSide=R\nW1=1.2\nW2=0.3\nW3=0\nPosition=12.5\n"))
    assert header_of_file(path).columns == {
        **{"side": "right", "rail": "low", "position": "12.5", "track_gauge_mm": 1441.5},
        **{"vertical_wear_mm": 1.2, "side_wear_mm": 0.3},
    }
    notes = place_case(Case(rail=path, roll="given")).rail.profile.notes
    assert "the gauge is 1435 mm, but 1441.5 mm in the header of a.ban; --gauge-mm 1441.5 takes it" in notes
    assert not any(
        "the gauge is" in note for note in place_case(Case(rail=path, track=Track(gauge_mm=1441.5))).rail.profile.notes
    )
    # a deviation of the gauge, and no value
    for value in ("6.5", ""):
        deviating = write("b.ban", miniprof("rail", f"Gauge={value}\n"))
        assert not any(
            "the gauge is" in note for note in place_case(Case(rail=deviating, roll="given")).rail.profile.notes
        )
    assert header_of_file("60E1") is None
    assert header_of_file(write("c.csv", PLAIN)) is None


@pytest.mark.parametrize(
    ("header", "radius_mm", "note"),
    [
        ("DiameterTaperline=920.5\n", 460.25, "gives the rolling radius 460.25 mm"),
        ("diametertaperline = 920.5\n", 460.25, "gives the rolling radius 460.25 mm"),
        ("DiameterFlange=976\nSh=28\n", 460.0, "DiameterFlange = 976 mm minus twice Sh = 28 mm"),
        ("DiameterFlange=976\n", 460.0, ""),
        ("DiameterTaperline=36\n", 460.0, "give the rolling radius with --rolling-radius-mm, 457.2 if"),
        ("DiameterTaperline=70\n", 460.0, "DiameterTaperline = 70 mm of the header is not used"),
        ("DiameterTaperline=9205\n", 460.0, "DiameterTaperline = 9205 mm of the header is not used"),
    ],
)  # fmt: skip
def test_a_plausible_diameter_is_the_rolling_radius(write, header, radius_mm, note):
    path = write("a.whl", miniprof("wheel", header))
    assert Case(wheel=path).rolling_radius_mm == pytest.approx(radius_mm, abs=1e-9)
    diameter_notes = [
        text for text in resolve_wheel(path, AS_IS).profile.notes if "Diameter" in text and "of the header" in text
    ]
    assert len(diameter_notes) == bool(note)
    assert all(note in text for text in diameter_notes)
    assert Case(wheel=path, rolling_radius_mm=455.0).rolling_radius_mm == 455.0


@pytest.mark.parametrize("unit", ["in", "inch", "Inches"])
def test_lengths_of_a_header_have_the_unit_of_the_file(write, unit):
    text = miniprof(
        "wheel", f"Units={unit}\nDiameterTaperline=36\nSh=1.1\n", points=(moved(wheel_points() * (1, -1), 70)) / 25.4
    )
    path = write("a.whl", text.replace("Taperline=70.0", f"Taperline={70 / 25.4}"))
    assert Case(wheel=path).rolling_radius_mm == pytest.approx(457.2)
    assert header_of_file(path).flange_height_mm == pytest.approx(27.94)


def test_a_flange_is_measured_as_in_the_standard():
    """The S1002 has Sh 28, Sd 32.5 and qR 10.8 mm (EN 13715)."""
    measured = measure_flange(wheel_points(0.05))
    assert measured["sh"] == pytest.approx(28.0, abs=0.01)
    assert measured["sd"] + 70.0 == pytest.approx(32.5, abs=0.05)
    assert measured["qr"] == pytest.approx(10.8, abs=0.05)
    # the tread alone, and a wheel whose tape circle is not in its points
    assert measure_flange(wheel_points()[wheel_points()[:, 0] > -20.0]) == {}
    assert measure_flange(moved(wheel_points(), 70.0)) == {}


def test_a_header_of_another_wheel_is_noticed():
    """A file has the dimensions of its points within 0.04 mm. A different file has dimensions of a template."""
    agreeing = resolve_wheel(str(FILES / "whl_left_iter288.whl"), Reading(tape_circle_mm=70.0, filter_mm=0.0)).profile
    header = header_of_file(agreeing.source)
    measured = measure_flange(agreeing.points)
    assert (header.flange_thickness_mm, header.flange_height_mm, header.flange_gradient_mm) == pytest.approx(
        (measured["sd"] + 70.0, measured["sh"], measured["qr"]), abs=0.04
    )
    assert not any("contradicts" in note for note in agreeing.notes)
    contradicting = resolve_wheel(str(FILES / "Car7813_0001r.whl"), Reading(tape_circle_mm=70.0, filter_mm=0.0)).profile
    (note,) = [text for text in contradicting.notes if "contradicts the points" in text]
    assert "Sd = 32.58 mm instead of 29.52 mm, Sh = 37.11 mm instead of 27.58 mm, qR = 14.71 mm instead of 7.60" in note


def test_a_header_in_words_has_entries_and_no_points(write):
    words = "MINIPROF 101 148 1994 3 24\navg.prd\nStock.......: Talent\nCar Number..: 7\nAxle Number.:\n"
    points = moved(wheel_points() * (1, -1), 70)
    text = f"{words}32.58 37.11 14.71  (Sd/Sh/qR)\n\n{rows(np.column_stack((points, 0 * points[:, 0])))}"
    path = write("a.whl", text)
    assert header_of_file(path).columns == {
        **{"stock": "Talent", "car_number": "7", "date": "1994-03-24"},
        **{"flange_thickness_mm": 32.58, "flange_height_mm": 37.11, "flange_gradient_mm": 14.71},
    }
    wheel = resolve_wheel(path, Reading(tape_circle_mm=70.0, filter_mm=0.0)).profile
    assert wheel.points == pytest.approx(wheel_points(), abs=1e-6)


@pytest.mark.parametrize("face_mm", [0.0, 15.0, 33.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_tip_of_a_flange_shows_the_direction_of_z_beside_a_face_of_any_height(write, face_mm, sign):
    points = wheel_points()
    face = np.column_stack((np.full(60, points[-1, 0]), points[-1, 1] + np.linspace(0.0, face_mm, 61)[1:]))
    points = np.vstack((points, face)) if face_mm else points
    wheel = resolve_wheel(write("a.whl", miniprof("wheel", points=points * (1, sign) + (70, 0))), AS_IS).profile
    assert wheel.height(-20.0) == pytest.approx(load_library_profile("S1002").height(-20.0), abs=1e-4)


# --- gauge point -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("depth_mm", [12.0, 14.0, 15.875])
def test_the_gauge_point_of_a_lip_is_its_widest_point(depth_mm):
    """The widest point of the file is (25.59, -11.97) mm, above the gauge plane.

    Smoothing over 4 and 8 mm moves the end of the line by 0.1 and 0.25 mm, a spline bulges by 9 um below that point.
    """
    for reading, tolerance_mm in ((Reading(), 1e-9), (Reading(filter_mm=8.0), 1e-9), (AS_IS, 0.01)):
        rail = resolve_rail(str(FILES / "avg_low2.ban"), reading)
        assert rail.gauge_side_end_mm == (-25.59, -11.97)
        pose = place_rail(rail, 0.0, Track(gauge_depth_mm=depth_mm))
        assert pose.crown_y_mm == pytest.approx(717.5 + 25.59, abs=tolerance_mm)


@pytest.mark.parametrize("inclination_rad", [0.0, 0.025, 0.05])
@pytest.mark.parametrize("name", [*list_names("rail")])
def test_the_gauge_point_is_the_narrowest_place_of_all_above_the_gauge_plane(name, inclination_rad):
    pose = place_rail(load_library_profile(name), inclination_rad, Track())
    y, z, _ = pose.section(pose.profile.spread(0.002))
    assert y[z >= -14.0].min() == pytest.approx(717.5, abs=1e-3)


def test_a_short_gauge_side_that_was_not_cut_is_refused_still():
    points = head_points()
    short = profile_from_points(*points[(points[:, 1] > -12.0) | (points[:, 0] > 0.0)].T, kind="rail", name="short")
    with pytest.raises(InputError, match=r"gauge side ends 11\.\d* mm below the highest point"):
        place_rail(short, 0.0, Track())


# --- gaps and outlines -----------------------------------------------------------------------------------------------


def under_head(points):
    """Add the lower sides of a head, which turn in."""
    side = np.column_stack((np.linspace(points[-1, 0], 8.0, 60)[1:], np.linspace(points[-1, 1], -48.0, 60)[1:]))
    return np.vstack((side[::-1] * (-1, 1), points, side))


@pytest.mark.parametrize("noise_mm", [0.0, 0.005])
@pytest.mark.parametrize(("upper_mm", "lower_mm"), [(17.0, 30.0), (18.0, 25.0), (17.0, 36.0), (30.0, 40.0)])
def test_a_gap_below_the_head_is_filled_or_cut(noise_mm, upper_mm, lower_mm):
    points = under_head(head_points())
    points = points + noise_mm * np.random.default_rng(2).normal(size=points.shape)
    depth = -points[:, 1]
    rail = profile_from_points(*points[(depth < upper_mm) | (depth > lower_mm)].T, kind="rail", name="gap")
    # where a wheel can touch, the profile is that of all points
    complete = profile_from_points(*points.T, kind="rail", name="whole")
    y = np.linspace(-34.0, 34.0, 100)
    assert rail.height(y) == pytest.approx(complete.height(y), abs=1e-6)
    assert any("where no contact is possible" in note or "turns in beyond its widest" in note for note in rail.notes)


def test_a_gap_to_a_different_part_of_the_body_is_cut():
    """Web and foot without the lower side of the head: 20 mm of chord, flatter than a side."""
    points = head_points()
    web = np.column_stack((np.full(50, 8.0), np.linspace(-50.0, -60.0, 50)))
    rail = profile_from_points(*np.vstack((points, web)).T, kind="rail", name="web")
    assert rail.y_range_mm[1] == pytest.approx(points[-1, 0], abs=0.01)


@pytest.mark.parametrize("shift", [0, 300, 1150, 2000])
@pytest.mark.parametrize("order", [1, -1])
def test_a_whole_section_of_a_rail_is_cut_to_its_head(shift, order):
    outline = load_library_profile("60E2").outline
    ends = [segment.evaluate(np.linspace(0.0, 1.0, 60)) for segment in outline]
    loop = np.vstack([np.column_stack((points.y, points.z))[:-1] for points in ends])
    rail = profile_from_points(*np.roll(loop, shift, axis=0)[::order].T, kind="rail", name="section")
    assert rail.y_range_mm == pytest.approx((-37.05, 37.05), abs=0.01)
    y = np.linspace(-35.0, 35.0, 200)
    assert rail.height(y) == pytest.approx(load_library_profile("60E2").height(y), abs=2e-4)
    (note,) = [note for note in rail.notes if "closed outline" in note]
    assert re.search(r"its head is used, \d{3,4} other points cut off", note)
    with pytest.raises(InputError, match=r"its foot is where its head should be.* give --rail-columns 1,-2"):
        profile_from_points(*(np.roll(loop, shift, axis=0)[::order] * (1, -1)).T, kind="rail", name="section")


@pytest.mark.parametrize("shift", [0, 200, 600])
@pytest.mark.parametrize("hub", [True, False])
def test_a_whole_section_of_a_wheel_is_cut_to_its_running_surface(shift, hub):
    points = wheel_points()
    corners = [(60, 50), (10, 60), (10, 280), (60, 300), (60, 370), (-100, 370), (-100, 300), (-15, 280), (-15, 60)]
    chain = [points[-1], *(corners if hub else [(60, 45)]), (-70, 45), points[0]]
    body = [np.linspace(a, b, 40)[1:-1] for a, b in pairwise(chain)]
    loop = np.roll(np.vstack((points, *body)), shift, axis=0)
    wheel = profile_from_points(*loop.T, kind="wheel", name="section")
    assert wheel.y_range_mm == pytest.approx((points[0, 0], points[-1, 0]), abs=0.01)
    assert wheel.height(0.0) == pytest.approx(0.0, abs=1e-4)
    with pytest.raises(InputError, match=r"its hub is where its flange should be.* give --wheel-columns 1,-2"):
        profile_from_points(*(loop * (1, -1)).T, kind="wheel", name="section")


# --- other programs --------------------------------------------------------------------------------------------------


def vampire_text(kind):
    if kind == "rail":
        y, z = moved(head_points(), 753.5).T
        return "RAILPROFILE\ntitle 60\nGAUGEPOINT EUROPEAN\nGAUGE 1435\n" + rows(np.column_stack((-y, z, y, z)))
    y, z = moved(wheel_points() * (1, -1), 750).T
    return "WHEELPROFILE\ntitle\nTREADDATUM EUROPEAN\nFLANGEBACK 1360\n" + rows(np.column_stack((-y, z, y, z)))


@pytest.mark.parametrize("columns", [None, "1,2", "3,4"])
def test_both_sides_of_a_vampire_file_are_read(write, columns):
    reading = Reading(columns=columns, filter_mm=0.0)
    wheel = resolve_wheel(write("a.dat", vampire_text("wheel")), reading).profile
    assert wheel.points == pytest.approx(wheel_points(), abs=2e-6)
    rail = resolve_rail(write("b.dat", vampire_text("rail")), reading)
    assert place_rail(rail, 0.0, Track()).height_at_y(np.array([745.0])) == pytest.approx(
        place_rail(load_library_profile("60E1"), 0.0, Track()).height_at_y(np.array([745.0])), abs=1e-4
    )
    with pytest.raises(InputError, match="is a rail, but a wheel is needed"):
        resolve_wheel(write("b.dat", vampire_text("rail")))


@pytest.mark.parametrize(
    ("datum", "back_mm"), [("US1", 25.4 * 2.84375), ("US2", 25.4 * 3.0625), ("CUSTOM 65.5", 65.5), ("NONE", None)]
)
def test_the_tread_datum_of_a_vampire_wheel_gives_its_tape_circle(write, datum, back_mm):
    path = write("a.dat", vampire_text("wheel").replace("EUROPEAN", datum))
    if back_mm is None:
        with pytest.raises(InputError, match="needs a line TREADDATUM with EUROPEAN, US1, US2 or CUSTOM"):
            resolve_wheel(path)
    else:
        wheel = resolve_wheel(path, Reading(filter_mm=0.0, tape_circle_z_mm=0.0)).profile
        assert wheel.points[0, 0] == pytest.approx(wheel_points()[0, 0] + 70.0 - back_mm, abs=2e-6)


def sections_text(*points):
    sections = (
        f"[Profile{number}Info]\nMPDN=scan {number}\nColumnDef=X,Y\n[Profile{number}Points]\n{rows(section * (-1, 1))}"
        for number, section in enumerate(points, start=1)
    )
    return "[FileInfo]\nProgramName=AutoCAD\n" + 3000 * "MPD1=A 1 2 3 4 5\n" + "".join(sections)


def test_a_file_of_sections_has_a_profile_by_its_number(write):
    path = write("a.mpt", sections_text(head_points(), head_points(name="49E1")))
    with pytest.raises(
        InputError, match=r"has 2 profiles: 1 \(scan 1\), 2 \(scan 2\); give --rail-section 1 \(section = 1 in"
    ):
        resolve_rail(path)
    for number, name in ((1.0, "60E1"), (2.0, "49E1")):
        rail = resolve_rail(path, Reading(section=number, filter_mm=0.0))
        assert rail.points == pytest.approx(head_points(name=name), abs=1e-6)
        assert f"profile {number:g} (scan {number:g}) of 2 in the file" in rail.notes
    with pytest.raises(InputError, match=r"profile is 1\.5; allowed: whole numbers from 1"):
        Reading(section=1.5)
    for number in (3.0, 4.0):
        with pytest.raises(InputError, match=f"and {number:g} is none of them; give --rail-section 1 "):
            resolve_rail(path, Reading(section=number))
    assert resolve_rail(write("b.mpt", sections_text(head_points())), AS_IS).points == pytest.approx(
        head_points(), abs=1e-6
    )
    for name, text in (("c.csv", PLAIN), ("c.ban", miniprof("rail"))):
        with pytest.raises(InputError, match="has no numbered profiles; leave out --rail-section"):
            resolve_rail(write(name, text), Reading(section=1.0))


@pytest.mark.parametrize(
    ("content", "name"),
    [
        ("  0\nSECTION\n  2\nENTITIES\n 10\n1.5\n", "a drawing of AutoCAD"), (b"AC1021\0\0", "a drawing of AutoCAD"),
        ('{"points": [[1, 2]]}', "a JSON document"), (b"\x89HDF\r\n", "an HDF5 file"), (b"PK\x03\x04", "a workbook"),
        ("<?xml version='1.0'?><a/>", "an XML document"), ("ISO-10303-21;", "a drawing in STEP"),
    ],
)  # fmt: skip
def test_a_format_without_a_reader_is_named(write, content, name):
    with pytest.raises(
        InputError, match=f"is {name}.* save the points of the running surface as text with the columns"
    ):
        resolve_rail(write("a.txt", content))


# --- shapes that are no profile --------------------------------------------------------------------------------------


def test_a_roller_and_a_narrow_head_are_told(write):
    y = np.linspace(0.0, 16.0, 81)
    points = np.column_stack((y, 0.002 * np.cos(y)))
    path = write("a.csv", rows(points))
    with pytest.raises(InputError, match=r"is 16 mm wide, too narrow .* give --wheel-tape-circle-mm 8 "):
        resolve_wheel(path)
    assert any(
        "16 mm wide, too narrow" in note for note in resolve_wheel(path, Reading(tape_circle_mm=8.0)).profile.notes
    )
    t = np.linspace(-0.7, 0.7, 60)
    side = np.column_stack((np.linspace(9.8, 20.0, 100), np.linspace(-3.6, -50.0, 100)))
    nose = np.vstack((side[::-1] * (-1, 1), np.column_stack((15 * np.sin(t), 15 * np.cos(t) - 15)), side))
    rail = profile_from_points(*nose.T, kind="rail", name="nose")
    assert any("24 mm wide 14 mm below its top, narrower than any rail head" in note for note in rail.notes)
    assert not any("narrower" in note for note in profile_from_points(*head_points().T, kind="rail", name="a").notes)


def test_a_table_that_is_no_profile_is_refused_without_an_option(write):
    names = [f"E{k % 6},A/A,{k},0.125,0.175,0.075\n" for k in range(20)]
    texts = ["".join(names) + "E5,A/A diameters 920 918,1.0,0.2,0.3,0.2\n" * 20, "a,b,c,d\n1,x,y,z\n" * 20]
    for text in texts:
        with pytest.raises(InputError, match="it is not a profile; give a file with the columns y and z") as refused:
            resolve_rail(write("a.csv", text))
        assert "--rail-columns" not in str(refused.value)
    # a single wrong line among columns of numbers is a mistake of this line
    lines = [f"{k} {text}" for k, text in enumerate(rows(head_points()).splitlines())]
    lines[7] += " 1.0"
    with pytest.raises(InputError, match="--rail-columns 2,3"):
        resolve_rail(write("b.csv", "\n".join(lines)))


def test_a_rail_with_its_guard_rail_is_read_after_the_cut_that_is_named(write):
    """X of the file points to the track centre. The groove is at y = -25.3 mm, at X = 25.3 mm."""
    name = "guard_rail_test.ban"
    with pytest.raises(InputError, match=r"at y = -25\.3 mm .* cut it at 25\.3 mm"):
        resolve_rail(str(FILES / name))
    lines = []
    for line in (FILES / name).read_text("latin-1").splitlines():
        numbers = re.findall(r"^\s*(-?\d+\.\d+)\s", line)
        if not numbers or float(numbers[0]) < 25.3:
            lines.append(line)
    rail = resolve_rail(write(name, "\n".join(lines)), AS_IS)
    assert rail.y_range_mm == pytest.approx((-25.06, 67.28), abs=0.01)


# --- remedies --------------------------------------------------------------------------------------------------------

_OPTION = re.compile(r"--(?:rail|wheel)-[a-z-]+ [-\w.]+(?:,[-+]?\w+)?(?= \()|--kind (?:rail|wheel)")


def swapped(points):
    """Exchange two points near the tip of the flange, where two scans overlap."""
    k = int(np.argmax(points[:, 1]))
    return np.vstack((points[: k + 1], points[k - 4 : k - 3], points[k + 1 :]))


def made_files():
    head, wheel = head_points(), wheel_points()
    canted = head @ np.array([[np.cos(0.05), np.sin(0.05)], [-np.sin(0.05), np.cos(0.05)]])
    from_back = moved(wheel * (1, -1), 70)
    return {
        "kpf.txt": rows(wheel * (-1, -1)), "back.csv": rows(moved(wheel, 70)), "down.csv": rows(head * (1, -1)),
        "metres.csv": rows(head * 1e-3), "tread.csv": rows(moved(wheel[wheel[:, 0] > -20], 30)),
        "height.csv": rows(moved(wheel, 0, 2)), "mirrored.csv": rows(canted * (-1, 1)),
        "three.csv": rows(np.column_stack((np.arange(len(head)), head))), "exchanged.csv": rows(head[:, ::-1]),
        "old.whl": "MINIPROF 101 148 1994 3 24\n\n" + rows(swapped(from_back)),
        "two.mpt": sections_text(head, head), "vampire.dat": vampire_text("wheel"),
        "roller.csv": rows(np.column_stack((np.linspace(0, 16, 81), 0.002 * np.cos(np.linspace(0, 16, 81))))),
        "spike.csv": rows(np.where(np.arange(len(head))[:, None] == 200, moved(head, 0, 0.1), head)),
        "centre.csv": rows(moved(wheel, 750)),
    }  # fmt: skip


MADE_FILES = made_files()
REAL_FILES = [
    path.name for path in sorted(FILES.iterdir()) if path.suffix not in (".md", "") and "LICENSE" not in path.name
]
# No option reads two rails as one.
WITHOUT_REMEDY = ("guard_rail_test.ban",)


def change_options(arguments, option):
    """Add an option to a command line, or replace its value."""
    name, value = option.split(" ", 1)
    if name in arguments:
        place = arguments.index(name) + 1
        return [*arguments[:place], value, *arguments[place + 1 :]]
    return [*arguments, name, value]


def combine_options(message):
    """Options that the message asks for, as a list of alternatives.

    A part that begins with `; and with OPTION: ` is needed for this option, the other parts for all.
    """
    first, *parts = re.split(r"; and with (--\S+ \S+): ", message)
    alternatives = [[option] for option in dict.fromkeys(_OPTION.findall(first))]
    for needed_by, text in zip(parts[::2], parts[1::2], strict=True):
        further = list(dict.fromkeys(_OPTION.findall(text)))
        alternatives = [
            [*options, option]
            for options in alternatives
            for option in (further if needed_by == options[-1] else [None])
        ]
        alternatives = [[option for option in options if option] for options in alternatives]
    return alternatives


def follow_remedies(arguments, capsys):
    """Command lines with the options of a refusal, which read the file.

    The list is empty for a refusal without an option.
    """
    code = call(arguments)
    message = capsys.readouterr().err
    if code == 0:
        return [arguments]
    assert code == 2
    commands = []
    for options in combine_options(message):
        command = arguments
        for option in options:
            assert change_options(command, option) != command, f"{option} is given already: {message}"
            command = change_options(command, option)
        assert call(command) == 0, f"{command}: {capsys.readouterr().err}"
        capsys.readouterr()
        commands.append(command)
    return commands


@pytest.mark.parametrize("name", [*REAL_FILES, *MADE_FILES])
def test_every_remedy_that_is_printed_works(name, write, capsys):
    path = write(name, MADE_FILES[name]) if name in MADE_FILES else str(FILES / name)
    commands = follow_remedies(["profiles", path], capsys)
    assert bool(commands) == (name not in WITHOUT_REMEDY)


def test_a_wheel_with_two_problems_is_refused_with_both_remedies(write, capsys):
    path = write("old.whl", MADE_FILES["old.whl"])
    assert call(["profiles", path]) == 2
    assert re.search(
        r"turns back at point .* --wheel-repair yes .*; and with --wheel-repair yes: .*give --wheel-tape-circle-mm 70 ",
        capsys.readouterr().err,
    )
    assert call(["profiles", path, "--wheel-tape-circle-mm", "70"]) == 2
    message = capsys.readouterr().err
    assert "turns back at point" in message
    assert "tape circle" not in message
    assert call(["profiles", path, "--wheel-tape-circle-mm", "70", "--wheel-repair", "yes"]) == 0


def test_the_two_options_of_a_wheel_of_gensys_are_in_one_refusal(write):
    path = write("kpf.txt", MADE_FILES["kpf.txt"])
    with pytest.raises(InputError, match=r"--wheel-columns 1,-2 .*; and with --wheel-columns 1,-2: .*wheel-mirror yes"):
        resolve_wheel(path)
    wheel = resolve_wheel(path, Reading(columns="1,-2", mirror=True, filter_mm=0.0)).profile
    assert wheel.points == pytest.approx(wheel_points(), abs=1e-6)


# a wheel of one system of axes, unit and origin, as each of four problems or their combination
@pytest.mark.parametrize(
    ("shift_mm", "signs", "unit"),
    # the fast ones have each problem alone, and all together
    slow_but(product([0.0, 70.0], [(1, 1), (1, -1), (-1, 1), (-1, -1)], [1.0, 1e-3]), 1, 2, 4, 8, 15),
)
def test_all_problems_of_a_wheel_are_named_in_one_refusal(write, capsys, unit, signs, shift_mm):
    path = write("a.csv", rows(moved(wheel_points(), shift_mm) * signs * unit))
    commands = follow_remedies(["profiles", path, "--kind", "wheel", "--json"], capsys)
    assert commands
    assert all(command.count("--kind") == 1 for command in commands)
