"""Profile files of programs and instruments: reading, refusals and writing."""

import os
import pickle
import re
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from points import AS_IS, profile_from_points, simpack

import fecontact
from fecontact.case import Case, Opposite
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.files import read_toml_text
from fecontact.outputs.records.results import case_inputs
from fecontact.profiles.examples import NOISE_MM, WEAR_MM
from fecontact.profiles.library import load_library_profile, toml_text
from fecontact.profiles.point_problems import find_disorder
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import header_of_file, radius_of_file_mm, resolve_rail, resolve_wheel
from fecontact.profiles.writers import csv_text, sample_points
from fecontact.runs.identity import make_case_id, make_paths_absolute
from fecontact.runs.toml_cases import read_toml_cases
from fecontact.solving.placing import make_wheelset, place_case

REPAIRED = Reading(repair=True, filter_mm=0.0)
EXACT = {"rail": "54E1", "wheel": "S1002"}


def head(step=0.5):
    y = np.arange(-34.0, 34.0 + step / 2, step)
    return y, load_library_profile("54E1").height(y)


@pytest.fixture
def write(tmp_path):
    def writer(name, text):
        path = tmp_path / name
        path.write_text(text, "utf-8")
        return path

    return writer


# --- SIMPACK ---------------------------------------------------------------------------------------------------


def test_a_simpack_rail_is_read_with_z_turned_up(write):
    y, z = head()
    rail = resolve_rail(str(write("a.prr", simpack(y, z))), AS_IS)
    assert rail.kind == "rail"
    assert rail.height(y) == pytest.approx(z, abs=1e-11)
    assert "SIMPACK file: the sign of z is reversed, so z points up" in rail.notes


@pytest.mark.parametrize(("factor", "unit_mm"), [(1000.0, 1.0), (1.0, 1000.0), (39.3700787401575, 25.4)])
def test_simpack_units_are_honoured(write, factor, unit_mm):
    y, z = head()
    rail = resolve_rail(str(write("a.prr", simpack(y / unit_mm, z / unit_mm, units_len_f=factor))), AS_IS)
    assert rail.height(y[5:-5]) == pytest.approx(z[5:-5], abs=1e-8)


def test_simpack_shifts_rotates_bounds_mirrors_and_inverts_in_this_order(write):
    """The operations, undone by hand in the opposite order.

    The numbers of the file show that shifting comes before rotating.
    """
    y, z = head()
    down = np.column_stack((y, -z))
    keep = (down[:, 0] >= -30.25) & (down[:, 0] <= 20.25)
    # points of the file that its keys turn into `down`: mirroring is last, so it is undone first
    turn, shift = 0.03, np.array([2.5, -1.25])
    raw = down * [-1.0, 1.0]
    c, s = np.cos(turn), np.sin(turn)
    raw = raw @ np.array([[c, -s], [s, c]]) - shift
    text = simpack(
        raw[:, 0], -raw[:, 1], shift_y=shift[0], shift_z=shift[1], rotate=turn, mirror_y=1, inversion=1,
        bound_y_min=-20.25, bound_y_max=30.25,
    )  # fmt: skip
    rail = resolve_rail(str(write("a.prr", text)), AS_IS)
    points = sample_points(rail)
    assert points == pytest.approx(np.column_stack((y, z))[keep], abs=1e-9)
    for words in ("shifted by", "rotated by 30 mrad", "left out", "mirrored in y"):
        assert any(words in note for note in rail.notes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mirror_y": 2}, r"line \d+: mirror.y = 2; allowed: 0 or 1"),
        ({"units_len_f": 0}, "units.len.f = 0; give the number of length units per metre"),
        ({"shift_y": "three"}, "shift.y = three; allowed: a number"),
        ({"something": 1}, "something is not a supported key of a SIMPACK file"),
        ({"points": "1 2\n3 x"}, "'3 x' must be two numbers, y and z, or three with a weight"),
        ({"points": "1 2 3 4"}, "must be two numbers, y and z, or three with a weight"),
    ],
)
def test_what_simpack_does_not_allow_is_refused_with_its_line(write, changes, message):
    with pytest.raises(InputError, match=message):
        resolve_rail(str(write("a.prr", simpack(*head(), **changes))))


def test_a_cut_simpack_file_is_refused(write):
    text = simpack(*head())
    with pytest.raises(InputError, match="may be truncated"):
        resolve_rail(str(write("a.prr", text[: len(text) // 2])))


@pytest.mark.parametrize("points", ["point.begin\npoint.end\n", "point.end\n"])
def test_a_simpack_file_without_points_is_refused(write, points):
    text = f"header.begin\nversion = 1\ntype = 0\nheader.end\nspline.begin\n{points}spline.end\n"
    with pytest.raises(InputError, match="there are 0 different points; allowed: 10 to 10000"):
        resolve_rail(str(write("a.prr", text)))


def test_a_simpack_wheel_is_no_rail(write):
    y = np.arange(-69.0, 59.0, 0.5)
    path = write("a.prw", simpack(y, load_library_profile("S1002").height(y), "wheel"))
    assert resolve_wheel(str(path)).profile.kind == "wheel"
    with pytest.raises(InputError, match="is a wheel, but a rail is needed"):
        resolve_rail(str(path))


def test_slices_are_refused_by_name():
    for ending in (".slcs", ".slcw"):
        with pytest.raises(InputError, match=rf"a file of slices \({ending}\) .* a single slice"):
            resolve_rail(f"crossing{ending}")


# --- MiniProf --------------------------------------------------------------------------------------------------


def miniprof(y, z, keys="", columns="X,Y,A,C"):
    names = columns.split(",")
    rows = "\n".join(
        ",".join({"X": f"{a:.9f}", "Y": f"{b:.9f}"}.get(name, "0.5") for name in names)
        for a, b in zip(y, z, strict=True)
    )
    return f'FileName="mine.ban"\nProgramVer=2.4\nColumnDef={columns}\n{keys}\n{rows}\n'


@pytest.mark.parametrize("columns", ["X,Y,A,C", "X,Y", "N,X,Y,K"])
def test_miniprof_columns_are_those_of_its_header(write, columns):
    y, z = head()
    rail = resolve_rail(str(write("a.ban", miniprof(y, z, columns=columns))), AS_IS)
    assert rail.height(y) == pytest.approx(z, abs=1e-8)


def test_miniprof_offsets_are_added_and_its_alignment_is_not(write):
    y, z = head()
    offset = resolve_rail(str(write("a.ban", miniprof(-y - 3.0, z, "XOFF=3.0\nYOFF=0\n"))), AS_IS)
    assert offset.height(y) == pytest.approx(z, abs=1e-8)
    assert "XOFF = 3 of the header is added" in offset.notes
    aligned = resolve_rail(str(write("b.ban", miniprof(-y, z, "AlignDA=0.01\n"))), AS_IS)
    assert aligned.height(y) == pytest.approx(z, abs=1e-8)
    assert "ALIGNDA = 0.01 of the header is not applied" in aligned.notes


def test_miniprof_headers_in_quotes_count_as_those_without(write):
    y, z = head()
    for number, columns in enumerate(("X,Y,A,C", "N,X,Y,K")):
        text = miniprof(y, z, columns=columns)
        for quoted in (f'ColumnDef="{columns}"', f'ColumnDef={columns} "as measured"', f'"ColumnDef={columns}"'):
            path = write(f"quoted{number}.ban", text.replace(f"ColumnDef={columns}", quoted))
            assert resolve_rail(str(path), AS_IS).height(y) == pytest.approx(z, abs=1e-8)
    with pytest.raises(InputError, match="Units = 'furlong'"):
        resolve_rail(str(write("asked.ban", miniprof(y, z, 'Units="furlong"\n'))))
    rail = resolve_rail(str(write("told.ban", miniprof(y, z, 'AlignDX="2.5"\n'))))
    assert "ALIGNDX = 2.5 of the header is not applied" in rail.notes
    inches = write("inches.ban", miniprof(y / 25.4, z / 25.4, 'Units="in"\n'))
    assert resolve_rail(str(inches), AS_IS).height(y[1:-1]) == pytest.approx(z[1:-1], abs=1e-6)


def instrument_text(kind, first="ProgramName=MiniProf for Windows\nProgramVer=2.43.73", taper="70.0000", blank="\n"):
    """Text of a library profile in the format of MiniProf for Windows 2.43.

    The source of this format is named in the reader.
    """
    points = sample_points(load_library_profile("S1002" if kind == "wheel" else "60E1"))
    # Y grows into the body; the points of a wheel start at the field side, and X starts at the back of the flange
    x, y = (points[::-1, 0] + 70.0, -points[::-1, 1]) if kind == "wheel" else (points[:, 0], -points[:, 1])
    keys = [
        first, "MPSerNo=1197", "Xoffset=0.0000", "Yoffset=0.0000", "RefPoint1=0.0000, 0.0000", "ColumnDef=X,Y",
        f"XYPoints={len(x)}", "Chars=UTF8", *([f"WheelDiameterTaperline={taper}"] if taper else []), "Field ID=",
        '"RefPoint4="', "AlignDA=",
    ]  # fmt: skip
    return "\n".join(keys) + "\n" + blank + "".join(f" {a:9.6f} {b:9.6f} \n" for a, b in zip(x, y, strict=True))


def test_files_of_the_instrument_have_depth_and_the_back_of_the_flange(write):
    wheel = resolve_wheel(str(write("a.whl", instrument_text("wheel"))), AS_IS).profile
    y = np.linspace(-60.0, 59.0, 200)
    # with points 0.1 mm apart, the error at a junction from straight to R 13 mm is 0.04 / 13 * 0.1^2 mm
    assert wheel.height(y) == pytest.approx(load_library_profile("S1002").height(y), abs=3e-5)
    assert any("the tape circle, which is at WheelDiameterTaperline = 70 mm" in note for note in wheel.notes)
    assert "Y points into the body, so z = -Y" in wheel.notes
    # no blank line before the points, as in some of the files
    rail = resolve_rail(str(write("a.ban", instrument_text("rail", taper="", blank=""))), AS_IS)
    y = np.linspace(-35.0, 35.0, 100)
    assert rail.height(y) == pytest.approx(load_library_profile("60E1").height(y), abs=1e-5)


def test_a_wheel_from_the_back_of_its_flange_needs_its_tape_circle(write):
    path = str(write("a.whl", instrument_text("wheel", taper="")))
    with pytest.raises(
        InputError, match=r"X begins at the back .* give --wheel-tape-circle-mm 70 \(tape_circle_mm = 70 in"
    ):
        resolve_wheel(path)
    profile = resolve_wheel(path, Reading(tape_circle_mm=70.0, filter_mm=0.0)).profile
    assert profile.height(0.0) == pytest.approx(0.0, abs=1e-5)
    assert resolve_wheel(str(write("b.whl", instrument_text("wheel", taper="72.5"))), AS_IS).profile.y_range_mm[
        0
    ] == pytest.approx(-72.5, abs=1e-4)


def test_a_header_in_words_is_one(write):
    """A header of MiniProf 2020, with and without the quote before its numbers."""
    text = instrument_text("wheel", taper="").splitlines()
    rows = "\n".join(line for line in text if "=" not in line and line.strip())
    words = '#MINIWHEELPROF\nmine.whl\nMINIPROF 2020\nCar Number..:\n" 32.5 28.0 10.8\n(Sd/Sh/qR)\n\n'
    for name, header in (("a.whl", words), ("b.whl", words.replace('" 32.5', "32.5"))):
        path = str(write(name, header + rows))
        with pytest.raises(InputError, match="give --wheel-tape-circle-mm 70"):
            resolve_wheel(path)
        wheel = resolve_wheel(path, Reading(tape_circle_mm=70.0, filter_mm=0.0)).profile
        assert wheel.height(0.0) == pytest.approx(0.0, abs=1e-5)


def test_columns_that_are_not_named_are_none_of_the_two(write):
    y, z = head()
    rows = "".join(f"{a:.6f} {b:.6f} 0.1 0.002\n" for a, b in zip(y, z, strict=True))
    rail = resolve_rail(str(write("a.ban", f"ProgramName=x\nColumnDef=X,Y,*\n\n{rows}")), AS_IS)
    assert rail.height(5.0) == pytest.approx(np.interp(5.0, y, z), abs=1e-3)


def test_a_ban_file_of_plain_columns_is_one(write):
    y, z = head()
    text = "\n".join(f"{a} {b}" for a, b in zip(y, z, strict=True))
    assert resolve_rail(str(write("a.ban", text)), AS_IS).y_range_mm == pytest.approx((-34.0, 34.0), abs=1e-12)


# --- columns ---------------------------------------------------------------------------------------------------


def columns(separator=" ", header="", decimal=".", z_sign=1.0, y_sign=1.0, scale=1.0, extra=""):
    y, z = head()
    rows = (f"{extra}{y_sign * a * scale:.9f}{separator}{z_sign * b * scale:.9f}" for a, b in zip(y, z, strict=True))
    return header + "\n".join(row.replace(".", decimal) if decimal != "." else row for row in rows) + "\n"


@pytest.mark.parametrize(
    ("text", "reading", "note"),
    [
        (columns(";", decimal=","), {}, "decimal commas"),
        (columns("\t", decimal=","), {}, "decimal commas"),
        (columns("  ", header="measured\nby hand\ny z\n"), {}, "3 header lines left out"),
        (columns(",", header="y [m],z [m]\n", scale=1e-3), {}, "unit m from the header"),
        (columns(";", header="y_in;z_in\n", scale=1 / 25.4), {}, "converted from in to mm"),
        (columns(" ", scale=1e-3), {"units": "m"}, "converted from m to mm"),
        (columns(" ", z_sign=-1.0), {"columns": "1,-2"}, "the sign of z is reversed"),
        (columns(" ", z_sign=-1.0, header="n y z\n", extra="7 "), {"columns": "y,-z"}, "the sign of z is reversed"),
        (columns(" ", y_sign=-1.0), {"mirror": True}, "mirrored"),
        (columns(" ", extra="7 "), {"columns": "2,3"}, "assumed"),
        (columns(" ", header="n y z\n", extra="7 "), {}, "of 3 columns, 'y' and 'z' are used"),
        (columns(" ", header="137\n"), {}, "the first line, 137, is the number of points"),
        (columns(",", decimal=","), {}, "decimal commas"),
    ],
)
def test_columns_in_many_forms(write, text, reading, note):
    path = str(write("a.txt", text))
    rail = resolve_rail(path, Reading(filter_mm=0.0, **reading))
    y, z = head()
    assert rail.height(y[2:-2]) == pytest.approx(z[2:-2], abs=1e-6)
    assert any(note in rail_note for rail_note in rail.notes)


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        (columns(" ", scale=1e-3), "give --rail-units m"),
        (columns(" ", scale=1 / 25.4), "give --rail-units in"),
        (columns(" ", z_sign=-1.0), 'give --rail-columns 1,-2 (columns = "1,-2" in [rail_file])'),
        (columns(" ", z_sign=-1.0, header="n y z\n", extra="7 "), "give --rail-columns 2,-3"),
        (columns(" ", extra="7 "), "give --rail-columns 2,3"),
        (columns(" ").replace("\n", " 0.0\n"), "give --rail-columns 1,2"),
    ],
)
def test_what_is_ambiguous_is_refused_with_the_option_that_settles_it(write, text, remedy):
    path = str(write("a.txt", text))
    with pytest.raises(InputError, match=re.escape(remedy)):
        resolve_rail(path)


def test_a_mirrored_wheel_is_refused_with_its_option_and_read_with_it(write):
    y = np.arange(-69.0, 59.0, 0.5)
    z = load_library_profile("S1002").height(y)
    path = str(write("w.csv", "\n".join(f"{-a},{b}" for a, b in zip(y, z, strict=True))))
    with pytest.raises(InputError, match=r"give --wheel-mirror yes \(mirror = true in \[wheel_file\]\)"):
        resolve_wheel(path)
    assert resolve_wheel(path, Reading(mirror=True, filter_mm=0.0)).profile.height(y) == pytest.approx(z, abs=1e-6)
    right = str(write("right.csv", "\n".join(f"{a},{b}" for a, b in zip(y, z, strict=True))))
    with pytest.raises(InputError, match=r"or leave out --wheel-mirror \(mirror in \[wheel_file\]\)"):
        resolve_wheel(right, Reading(mirror=True))


def test_a_wheel_is_no_rail_and_a_rail_no_wheel(write):
    wheel = str(write("w.csv", csv_text(load_library_profile("S1002"))))
    rail = str(write("r.csv", csv_text(load_library_profile("60E1"))))
    with pytest.raises(InputError, match=r"a rail is needed; give the file as the wheel \(--wheel, or --kind wheel\)"):
        resolve_rail(wheel)
    with pytest.raises(InputError, match=r"a wheel is needed; give the file as the rail \(--rail, or --kind rail\)"):
        resolve_wheel(rail)


# --- problems ---------------------------------------------------------------------------------------------------


def noisy(noise=0.0, seed=0, step=0.2):
    y, z = head(step)
    return y, z + noise * np.random.default_rng(seed).normal(size=y.size)


@pytest.mark.parametrize("noise", [0.0, 0.002, 0.01])
@pytest.mark.parametrize("times", [15.0, 40.0])
def test_a_spike_is_found_with_its_place_and_left_out_on_request(noise, times):
    y, z = noisy(noise)
    size = max(times * noise, 0.05)
    z[100] += size
    with pytest.raises(InputError, match=r"(spike of .*|turns back) at point 10[12], \(-1[34].*--rail-repair yes"):
        profile_from_points(y, z, kind="rail", name="p")
    mended = profile_from_points(y, z, kind="rail", name="p", reading=REPAIRED)
    assert any("1 point left out: " in note for note in mended.notes)
    assert len(sample_points(mended)) == y.size - 1


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.01, 0.02])
@pytest.mark.parametrize("step", [0.1, 0.2, 0.5])
def test_good_points_have_no_spikes(noise, step):
    for seed in range(5):
        profile_from_points(*noisy(noise, seed, step), kind="rail", name="p")


def test_points_out_of_order_are_left_out_on_request_only():
    y, z = noisy()
    order = np.arange(y.size)
    order[[60, 61]] = 61, 60
    with pytest.raises(InputError, match=r"turns back at point 6\d.*--rail-repair yes"):
        profile_from_points(y[order], z[order], kind="rail", name="p")
    mended = profile_from_points(y[order], z[order], kind="rail", name="p", reading=Reading(repair=True, filter_mm=0.0))
    assert mended.height(0.0) == pytest.approx(0.0, abs=1e-4)


def test_what_is_wrong_everywhere_is_not_repaired():
    y, z = noisy()
    order = np.random.default_rng(3).permutation(y.size)
    with pytest.raises(InputError, match=r"this is more than 5 % of the points; give each point .* in the order"):
        profile_from_points(y[order], z[order], kind="rail", name="p", reading=REPAIRED)


# --- writers ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["rail", "wheel"])
def test_what_is_written_is_read_back(write, kind):
    profile = load_library_profile(EXACT[kind])
    path = str(write("back.csv", csv_text(profile)))
    stored = resolve_rail(path, AS_IS) if kind == "rail" else resolve_wheel(path, AS_IS).profile
    assert stored.kind == kind
    assert sample_points(stored) == pytest.approx(sample_points(profile), abs=1e-9)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.json", "the ending is .json; allowed: .csv, .toml; give a name such as a.csv"),
        ("a", "the ending is (none); allowed"),
    ],
)
def test_profiles_are_written_as_columns_or_segments_alone(tmp_path, name, message, capsys):
    assert call(["profiles", "60E1", "--write", str(tmp_path / name)]) == 2
    # refused before anything is read or printed
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert list(tmp_path.iterdir()) == []


@given(
    turn=st.floats(-0.05, 0.05), dy=st.floats(-20.0, 20.0), dz=st.floats(-5.0, 5.0), mirror=st.booleans(),
    reverse=st.booleans(),
)  # fmt: skip
def test_simpack_moves_there_and_back(tmp_path_factory, turn, dy, dz, mirror, reverse):
    """The keys of a file undo exactly the motion of its points."""
    y, z = head()
    down = np.column_stack((y, -z)) * [-1.0 if mirror else 1.0, 1.0]
    c, s = np.cos(turn), np.sin(turn)
    raw = down @ np.array([[c, -s], [s, c]]) - [dy, dz]
    raw = raw[::-1] if reverse else raw
    path = tmp_path_factory.mktemp("p") / "a.prr"
    path.write_text(
        simpack(
            raw[:, 0], -raw[:, 1], shift_y=repr(dy), shift_z=repr(dz), rotate=repr(turn), mirror_y=int(mirror),
            inversion=int(reverse),
        ),
        "utf-8",
    )  # fmt: skip
    assert sample_points(resolve_rail(str(path), AS_IS)) == pytest.approx(np.column_stack((y, z)), abs=1e-9)


@pytest.mark.parametrize("offset_mm", [(0.0, 0.0), (-50.0, 30.0), (50.0, -30.0)])
@pytest.mark.parametrize(("back_mm", "problems"), [(0.3, 0), (0.8, 1)])
def test_whether_a_line_turns_back_does_not_hang_on_where_it_lies(offset_mm, back_mm, problems):
    """A dent of 0.5 mm may be there; the line turns to either side of the fold by 1.5 rad at most."""
    steps = [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (-back_mm, 0.9 * back_mm), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)]
    points = np.cumsum([offset_mm, *steps], axis=0)
    problems_of_points = find_disorder(points, np.full(len(points), 0.01))
    assert len(problems_of_points) == problems


# --- a library of the user --------------------------------------------------------------------------------------


def test_names_are_looked_up_in_a_folder_first(tmp_path):
    from fecontact.case import Case, Opposite

    (tmp_path / "mine.csv").write_text(csv_text(load_library_profile("54E1")), "utf-8")
    (tmp_path / "S1002.toml").write_text(toml_text("S1002"), "utf-8")
    case = Case(rail="mine", wheel="S1002", library=str(tmp_path))
    assert (Path(case.rail).name, Path(case.wheel).name) == ("mine.csv", "S1002.toml")
    assert Case(rail="60E1", library=str(tmp_path)).rail == "60E1"
    across = Case(library=str(tmp_path), opposite=Opposite(rail="mine", rolling_radius_mm=459.0)).opposite
    assert across == Opposite(rail=case.rail, rolling_radius_mm=459.0)
    (tmp_path / "mine.txt").write_text("", "utf-8")
    with pytest.raises(InputError, match=r"'mine' may be mine.csv or mine.txt; give the name with its ending"):
        Case(rail="mine", library=str(tmp_path))
    with pytest.raises(InputError, match="give a folder of profile files"):
        Case(rail="mine", library=str(tmp_path / "none"))


# --- files from unknown sources ------------------------------------------------------------------------------


@pytest.mark.parametrize(("first", "last"), [(39, 42), (40, 42), (30, 33), (60, 62)])
def test_rows_that_are_there_twice_are_repaired(write, first, last):
    points = sample_points(load_library_profile("60E1"), 0.6)
    twice = np.insert(points, last, points[first:last], axis=0)
    text = "y,z\n" + "".join(f"{y:.4f},{z:.4f}\n" for y, z in twice)
    path = str(write("twice.csv", text))
    with pytest.raises(InputError, match="--rail-repair yes"):
        resolve_rail(path)
    rail = resolve_rail(path, Reading(repair=True, filter_mm=0.0))
    assert len(rail.points) == len(points)
    assert rail.points == pytest.approx(points, abs=1e-4)


@pytest.mark.parametrize("ending", [".csv", ".toml", ".prr", ".ban", ""])
def test_pipes_and_devices_are_refused_and_not_waited_for(tmp_path, ending):
    pipe = tmp_path / f"pipe{ending}"
    os.mkfifo(pipe)
    device = tmp_path / f"zero{ending}"
    device.symlink_to("/dev/zero")
    for path in (pipe, device):
        for reader in (resolve_rail, resolve_wheel):
            with pytest.raises(InputError, match="it is a device or a pipe; give the path of a file"):
                reader(str(path))


@pytest.mark.parametrize(
    "text",
    [
        "1.2.3" * 40_000,
        "".join("a" + f".b{k}" * 2000 + " = 1\n" for k in range(100)),
        "x = 1\n" * 200_000,
        "[" + "a." * 3000 + "b]\n",
        "x = { " + "a." * 3000 + "b = 1 }\n",
    ],
)
def test_toml_that_would_take_its_parser_minutes_is_refused_at_once(write, text):
    path = write("hostile.toml", text)
    started = time.process_time()
    for reader, name in ((resolve_rail, str(path)), (read_toml_cases, path)):
        with pytest.raises(InputError, match="allowed: "):
            reader(name)
    assert time.process_time() - started < 1.0


def test_long_lists_and_comments_in_toml_are_fine():
    numbers = ", ".join(f"{k}.25" for k in range(1000))
    assert len(read_toml_text(f"# {'.' * 500}\nx = [{numbers}]\n", "t")["x"]) == 1000


def test_the_example_pair_is_read_back_with_its_noise_and_its_wear(tmp_path, capsys):
    assert call(["profiles", "--examples", str(tmp_path)]) == 0
    written = [f"written: {tmp_path / name}" for name in ("rail.csv", "wheel.csv", "wheel.whl")]
    assert capsys.readouterr().out.splitlines() == written
    lines = resolve_rail(str(tmp_path / "rail.csv")), resolve_wheel(str(tmp_path / "wheel.csv")).profile
    for line, name in zip(lines, ("60E1", "S1002"), strict=True):
        assert line.measured.nominal == name
        assert line.measured.noise_mm == pytest.approx(NOISE_MM, rel=0.1)
    # in the middle of the wear, the rail is lower along its normal, and the wheel surface is higher
    for line, name, y, side in zip(lines, ("60E1", "S1002"), (-12.0, 0.0), (-1.0, 1.0), strict=True):
        new = load_library_profile(name)
        angle = np.arctan(new.slope(y))
        worn = line.height(y - side * WEAR_MM * np.sin(angle))
        assert float(worn - new.height(y)) == pytest.approx(float(side * WEAR_MM * np.cos(angle)), abs=0.01)
    # the file of the instrument has the same points, with the worn tread at z = 0; its header agrees with them
    wheel = resolve_wheel(str(tmp_path / "wheel.whl"))
    y = np.linspace(-60.0, 59.0, 200)
    depth = wheel.profile.height(y) - lines[1].height(y)
    assert depth == pytest.approx(-lines[1].height(0.0), abs=0.01)
    # 0.4 mm of wear makes the flange of 28 mm higher
    header = header_of_file(str(tmp_path / "wheel.whl"))
    assert (header.tread_diameter_mm, header.wheel_id) == (920.0, "example")
    assert header.flange_height_mm == pytest.approx(28.0 + WEAR_MM, abs=3.0 * NOISE_MM)
    assert not any("contradicts" in note or "check the origin" in note for note in wheel.profile.notes)


def test_the_example_pair_does_not_overwrite_files_with_different_content(tmp_path, capsys):
    command = ["profiles", "--examples", str(tmp_path)]
    (tmp_path / "wheel.csv").write_text("y,z\n0,0\n", "utf-8")
    assert call(command) == 2
    assert capsys.readouterr().err == (
        f"error: profiles --examples would overwrite {tmp_path / 'wheel.csv'}; give another folder, or --force\n"
    )
    # nothing is written
    assert [path.name for path in tmp_path.iterdir()] == ["wheel.csv"]
    assert (tmp_path / "wheel.csv").read_text("utf-8") == "y,z\n0,0\n"
    assert call([*command, "--force"]) == 0
    contents = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert sorted(contents) == ["rail.csv", "wheel.csv", "wheel.whl"]
    # equal files are written again
    assert call(command) == 0
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == contents
    assert call(["profiles", "60E1", "--force"]) == 2
    assert "--force is given without --examples" in capsys.readouterr().err


# --- The rolling radius in the header of a wheel's file.

OF_HEADER_MM = 0.5 * 719.1924


@pytest.fixture
def wheel_with_diameter(write):
    """The file of a wheel with a diameter in its header."""
    text = instrument_text("wheel").replace("Chars=UTF8", "Chars=UTF8\nDiameterTaperline=719.1924")
    return str(write("worn.whl", text))


def test_the_rolling_radius_is_that_of_the_header_unless_one_is_given(wheel_with_diameter, write):
    plain = str(write("plain.whl", instrument_text("wheel")))
    case = Case(wheel=wheel_with_diameter, load_N=60e3)
    assert case.rolling_radius_mm == pytest.approx(OF_HEADER_MM, abs=1e-9)
    assert [Case(wheel=name).rolling_radius_mm for name in ("S1002", "cylinder:300", plain)] == [460.0] * 3
    assert Case(wheel=wheel_with_diameter, rolling_radius_mm=459.0).rolling_radius_mm == 459.0
    # a derived case has the radius of its wheel, or the given radius
    assert replace(case, load_N=80e3).rolling_radius_mm == case.rolling_radius_mm
    assert replace(case, wheel=plain).rolling_radius_mm == 460.0
    assert replace(Case(wheel=plain), wheel=wheel_with_diameter).rolling_radius_mm == case.rolling_radius_mm
    assert replace(Case(rolling_radius_mm=459.0), wheel=wheel_with_diameter).rolling_radius_mm == 459.0
    again = pickle.loads(pickle.dumps(case))
    assert (again, replace(again, wheel=plain).rolling_radius_mm) == (case, 460.0)


def test_a_file_without_a_diameter_or_of_a_rail_gives_no_radius(write):
    for name, diameter in (("zero.whl", "0.0"), ("empty.whl", ""), ("words.whl", "unknown")):
        text = instrument_text("wheel").replace("Chars=UTF8", f"Chars=UTF8\nDiameterTaperline={diameter}")
        assert Case(wheel=str(write(name, text))).rolling_radius_mm == 460.0
    with pytest.raises(InputError, match="DIAMETERTAPERLINE = 'unknown'"):
        resolve_wheel(str(write("words.whl", text)), AS_IS)
    as_text = instrument_text("wheel").replace("Chars=UTF8", "Chars=UTF8\nDiameterTaperline=800")
    assert radius_of_file_mm(str(write("a.txt", as_text))) == 400.0
    assert radius_of_file_mm(str(write("a.ban", as_text))) is None
    assert radius_of_file_mm(str(write("a.csv", "DiameterTaperline=800\n1,2\n3,4\n"))) is None


def test_a_radius_that_nobody_gives_does_not_change_the_id_of_a_case(wheel_with_diameter, write):
    plain = str(write("plain.whl", instrument_text("wheel")))
    for wheel, radius in (("S1002", 460.0), (plain, 460.0), (wheel_with_diameter, OF_HEADER_MM)):
        case, case_with_radius = Case(wheel=wheel), Case(wheel=wheel, rolling_radius_mm=radius)
        assert case == case_with_radius
        assert make_case_id(case) == make_case_id(case_with_radius)
        # results identify a file by its content, and have the radius in use
        assert case_inputs(case)["rolling_radius_mm"] == radius
        assert make_paths_absolute(case).rolling_radius_mm == radius
        assert replace(case.with_profiles({"wheel": "gone.whl@01234567"}), load_N=1e4).rolling_radius_mm == radius
    assert Case(wheel=wheel_with_diameter) != Case(wheel=wheel_with_diameter, rolling_radius_mm=460.0)


def test_the_radius_of_the_header_counts_in_the_contact_as_a_given_one_does(wheel_with_diameter, write):
    plain = str(write("plain.whl", instrument_text("wheel")))
    of_header, of_option, usual = (
        place_case(case).wheel.rolling_radius_mm
        for case in (
            Case(wheel=wheel_with_diameter),
            Case(wheel=plain, rolling_radius_mm=OF_HEADER_MM),
            Case(wheel=plain),
        )
    )
    assert of_header == of_option == pytest.approx(OF_HEADER_MM, abs=1e-9)
    assert usual == 460.0
    areas = [
        fecontact.theory(Case(wheel=wheel, lateral_shift_mm=-3.0, load_N=60e3, **options), "hertz")["area_mm2"]
        for wheel, options in (
            *((wheel_with_diameter, {}), (plain, {"rolling_radius_mm": OF_HEADER_MM})),
            *((wheel_with_diameter, {"rolling_radius_mm": 460.0}), (plain, {})),
        )
    ]
    assert areas[0] == pytest.approx(areas[1], rel=1e-6)
    assert areas[2] == pytest.approx(areas[3], rel=1e-6)
    # a smaller wheel has a smaller patch
    assert areas[0] < 0.95 * areas[2]


def test_the_wheel_of_the_other_side_has_the_radius_of_its_own_header(wheel_with_diameter, write):
    plain = str(write("plain.whl", instrument_text("wheel")))
    for opposite, radius in (
        (Opposite(wheel=wheel_with_diameter), OF_HEADER_MM),
        (Opposite(wheel=wheel_with_diameter, rolling_radius_mm=450.0), 450.0),
        (Opposite(wheel=plain), 460.0),
    ):
        wheelset = make_wheelset(Case(wheel=plain, opposite=opposite))
        assert (wheelset.left.pair.rolling_radius_mm, wheelset.right.pair.rolling_radius_mm) == pytest.approx(
            (460.0, radius)
        )
    wheelset = make_wheelset(Case(wheel=wheel_with_diameter, opposite=Opposite(rail="54E1")))
    assert wheelset.left.pair.rolling_radius_mm == wheelset.right.pair.rolling_radius_mm == pytest.approx(OF_HEADER_MM)


COMMANDS = (
    ["place", "--shift", "-3"],
    ["hertz", "--shift", "-3"],
    ["theory", "strip", "--shift", "-3"],
    ["geometry", "--shifts", "-3"],
)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
@pytest.mark.parametrize(
    ("radii", "note"),
    [((), ""), (("460",), "the given rolling radius is 460 mm, but 359.596 mm in the header of worn.whl"),
     (("360.4",), "")],
)  # fmt: skip
def test_commands_say_which_radius_counts(command, radii, note, wheel_with_diameter, capsys):
    options = [word for radius in radii for word in ("--rolling-radius-mm", radius)]
    assert call([*command, "--wheel", wheel_with_diameter, *options]) == 0
    lines = [line for line in "".join(capsys.readouterr()).splitlines() if line.startswith("note: wheel:")]
    of_header = "DiameterTaperline = 719.192 mm of the header gives the rolling radius 359.596 mm, unless you give"
    assert [of_header in line for line in lines].count(True) == 1
    assert [line.removeprefix("note: wheel: ") for line in lines if "the given" in line] == [note] * bool(note)


@pytest.mark.parametrize(
    ("radii", "note"),
    [
        ((), "rolling radius 359.596 mm, from the header of worn.whl"),
        (("460",), "the given rolling radius is 460 mm, but 359.596 mm in the header of worn.whl"),
    ],
)
def test_what_tells_the_geometry_of_many_cases_says_it_once(radii, note, wheel_with_diameter, tmp_path, capsys):
    options = [word for radius in radii for word in ("--rolling-radius-mm", radius)]
    command = ["table", "--wheel", wheel_with_diameter, "--shifts", "-3,0", "--loads-kn", "60", *options]
    assert call([*command, "--out", str(tmp_path / "table.csv")]) == 0
    assert "".join(capsys.readouterr()).splitlines().count(f"note: {note}") == 1
