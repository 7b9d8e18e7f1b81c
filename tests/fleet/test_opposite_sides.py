"""Fleets with unlike wheels or rails on both sides of the track."""

import json
from dataclasses import replace

import duckdb
import numpy as np
import pytest
from inline import inline_crew, stand_ins
from marks import slow_but

import fecontact
from fecontact.case import Case, Opposite, make_case_record, read_case_record
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.features.fleet.screened_position import make_position_row, screen_variant
from fecontact.inputs.texts import parse_inclination
from fecontact.profiles.examples import format_points, make_worn_points, write_examples
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.solving.placing import place_case
from fecontact.solving.profile_variants import join_reference_labels, label_reference, list_profile_variants

FLEET = """
[wheels]
files = "wheels.csv"
[rails]
files = "rails.csv"
[shifts_mm]
values = {shifts}
[loads_kN]
values = [80]
[case]
{case_text}
"""
AXLE = "file,name,opposite_wheel\nwheel.csv,left,right\nother_wheel.csv,right,left\n"
TRACK = "file,name,opposite_rail\nrail.csv,left,right\nother_rail.csv,right,left\n"
NUMBERS = ("place_y_mm", "contact_angle_mrad", "conicity", "contact_concentration", "hertz_p_max_MPa", "p_max_percent")


@pytest.fixture(autouse=True)
def _one_process():
    with stand_ins(inline_crew(), None, ""):
        yield


def write_points(path, name, wear_mm=0.4, factor=1.0):
    points = np.round(make_worn_points(name, 3.0, wear_mm, 0.008, np.random.default_rng(7)), 4)
    path.write_text("y,z\n" + "".join(f"{y:.7f},{z:.7f}\n" for y, z in factor * points))


@pytest.fixture(scope="module")
def profiles(tmp_path_factory):
    """Folder of the measured example pair, and of a pair with more wear."""
    folder = tmp_path_factory.mktemp("profiles")
    write_examples(folder)
    write_points(folder / "other_wheel.csv", "S1002")
    write_points(folder / "other_rail.csv", "60E1")
    return folder


def write_fleet_file(folder, wheels, rails, *, shifts=(0,), case_text="", profiles=None):
    folder.mkdir(exist_ok=True)
    for file in () if profiles is None else profiles.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    (folder / "wheels.csv").write_text(wheels)
    (folder / "rails.csv").write_text(rails)
    (folder / "fleet.toml").write_text(FLEET.format(shifts=list(shifts), case_text=case_text))
    return folder / "fleet.toml"


def read_rows(out):
    rows = duckdb.sql(f"select * from '{out}/screen/*.parquet' order by wheel, rail, shift_mm").df()
    return [row for _, row in rows.iterrows()]


def read_profile_statuses(out):
    rows = duckdb.sql(f"select name, status, reason from '{out}/profiles.parquet'").fetchall()
    return {name: (status, reason) for name, status, reason in rows}


def make_single_row(case):
    """Row of a position from its case on each profile variant."""
    rail, wheel = resolve_rail(case.rail, case.rail_file), resolve_wheel(case.wheel, case.wheel_file).profile
    rails, wheels = list_profile_variants(rail), list_profile_variants(wheel)
    labels = dict.fromkeys([join_reference_labels(label_reference(rail), label_reference(wheel)), *rails, *wheels])
    placements = {
        label: place_case(case, rail=rails.get(label, rail), wheel=wheels.get(label, wheel)) for label in labels
    }
    return make_position_row(
        {label: screen_variant(case, placement, "strip") for label, placement in placements.items()}
    )


@pytest.mark.parametrize(
    ("side", "inclination"),
    slow_but([("left", "1:40"), ("right", "1:40"), ("left", "1:20"), ("right", "1:20")], 0, 3),
)
def test_screened_rows_are_those_of_single_positions(tmp_path, profiles, side, inclination):
    rails = f"file,name,opposite_rail,inclination\nrail.csv,left,other_rail.csv,{inclination}\n"
    wheels = "file,name,opposite_wheel\nwheel.csv,left,other_wheel.csv\n"
    shifts = (-3.0, 2.0)
    path = write_fleet_file(
        tmp_path / "fleet", wheels, rails, shifts=shifts, case_text=f'side = "{side}"', profiles=profiles
    )
    fecontact.run_fleet(path, tmp_path / "out")
    screened = fecontact.open_fleet(tmp_path / "out")
    for row, shift_mm in zip(read_rows(tmp_path / "out"), shifts, strict=True):
        case = Case(
            rail=str(path.parent / "rail.csv"),
            wheel=str(path.parent / "wheel.csv"),
            opposite=Opposite(rail=str(path.parent / "other_rail.csv"), wheel=str(path.parent / "other_wheel.csv")),
            side=side,
            inclination_rad=parse_inclination(inclination),
            lateral_shift_mm=shift_mm,
            load_N=80e3,
        )
        assert screened.case("left", "left", shift_mm, 80.0) == case
        contact_point = place_case(case).first
        assert row.place_y_mm == pytest.approx(float(contact_point.rail_y_mm), abs=1e-9)
        assert row.contact_angle_mrad == pytest.approx(1e3 * float(contact_point.contact_angle_rad), abs=1e-6)
        # the mirror image has another roll
        mirror_point = place_case(replace(case, opposite=Opposite())).first
        assert abs(row.contact_angle_mrad - 1e3 * float(mirror_point.contact_angle_rad)) > 1e-3
        single = make_single_row(case)
        assert (row.verdict, row.measure, row.variants) == (
            single["verdict"],
            single["measure"],
            single["variants"],
        )
        for name in ("hertz_p_max_MPa", "screen_p_max_MPa"):
            assert row[name] == pytest.approx(single[name], rel=1e-9), name


@pytest.mark.slow
def test_both_wheels_of_an_axle_on_both_rails_are_mirrored(tmp_path, profiles):
    """Opposite shifts have equal rows."""
    rows = {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        shifts = [sign * shift for shift in (-2.0, 3.0)]
        path = write_fleet_file(
            tmp_path / side, AXLE, TRACK, shifts=shifts, case_text=f'side = "{side}"', profiles=profiles
        )
        fecontact.run_fleet(path, tmp_path / f"{side}_out")
        rows[side] = {(row.wheel, row.rail, sign * row.shift_mm): row for row in read_rows(tmp_path / f"{side}_out")}
    assert rows["left"].keys() == rows["right"].keys()
    assert len(rows["left"]) == 8
    for key, row in rows["left"].items():
        mirrored = rows["right"][key]
        assert (row.verdict, row.variants) == (mirrored.verdict, mirrored.variants)
        for name in NUMBERS:
            # a percentage is a difference of two pressures: 1e-7 % is 1e-9 of them
            least_difference = 1e-7 if name.endswith("_percent") else 1e-9
            assert row[name] == pytest.approx(mirrored[name], rel=1e-9, abs=least_difference), (key, name)
    # each wheel has its own contact: both sides differ
    places = [rows["left"][name, name, 3.0].place_y_mm for name in ("left", "right")]
    assert abs(places[0] - places[1]) > 1e-3


def test_a_profile_that_is_its_own_opposite_is_the_mirror_image(tmp_path):
    tables = ["file\nS1002\n", "file,opposite_wheel\nS1002,S1002\n", "file,name,opposite_wheel\nS1002,a,a\n"]
    screens = []
    for number, wheels in enumerate(tables):
        path = write_fleet_file(tmp_path / f"{number}", wheels, "file\n60E1\n", shifts=(-3, 3))
        fecontact.run_fleet(path, tmp_path / f"out{number}")
        screens.append(read_rows(tmp_path / f"out{number}"))
    for rows in zip(*screens, strict=True):
        assert len({row.verdict for row in rows}) == 1
        for name in NUMBERS:
            # two equal sides are placed once, others twice: rolls differ by rounding, by 1e-8 of a small deviation
            tolerance = {"abs": 1e-6} if name == "p_max_percent" else {"rel": 1e-9}
            assert [row[name] for row in rows[1:]] == pytest.approx([rows[0][name]] * 2, **tolerance), name


def test_the_other_wheel_of_a_row_has_the_radius_of_its_row(tmp_path):
    wheels = "file,name,rolling_radius_mm,opposite_wheel\nS1002,a,460,b\nS1002,b,459,a\n"
    path = write_fleet_file(tmp_path / "fleet", wheels, "file\n60E1\n")
    fecontact.run_fleet(path, tmp_path / "out")
    screened = fecontact.open_fleet(tmp_path / "out")
    for (wheel, radius_mm), other_radius_mm, row in zip(
        (("a", 460.0), ("b", 459.0)), (459.0, 460.0), read_rows(tmp_path / "out"), strict=True
    ):
        case = Case(rolling_radius_mm=radius_mm, opposite=Opposite(wheel="S1002", rolling_radius_mm=other_radius_mm))
        screened_case = screened.case(wheel, "60E1", 0.0, 80.0)
        assert (screened_case.rolling_radius_mm, screened_case.opposite) == (radius_mm, case.opposite)
        assert row.place_y_mm == pytest.approx(float(place_case(case).first.rail_y_mm), abs=1e-9)


def test_the_file_of_the_other_side_is_read_with_the_options_of_its_row(tmp_path, profiles):
    """Files in m and in mm give equal rows."""
    for folder, factor, cell in (("mm", 1.0, "mm"), ("m", 1e-3, "m")):
        (tmp_path / folder).mkdir()
        write_points(tmp_path / folder / "w.csv", "S1002", 0.3, factor)
        write_points(tmp_path / folder / "other.csv", "S1002", 0.45, factor)
        wheels = f"file,name,units,opposite_wheel\nw.csv,file,{cell},other.csv\nS1002,exact,{cell},other.csv\n"
        fecontact.run_fleet(write_fleet_file(tmp_path / folder, wheels, "file\n60E1\n"), tmp_path / f"{folder}_out")
    rows_mm, rows_m = (read_rows(tmp_path / f"{folder}_out") for folder in ("mm", "m"))
    assert len(rows_mm) == len(rows_m) == 2
    for row_mm, row_m in zip(rows_mm, rows_m, strict=True):
        assert row_mm.verdict == row_m.verdict
        # numbers in m are rounded to a double, and smoothing adds to this
        assert row_mm.place_y_mm == pytest.approx(row_m.place_y_mm, abs=1e-6)
    # a case of the position reads the other side with these options too
    case = fecontact.open_fleet(tmp_path / "m_out").case("exact", "60E1", 0.0, 80.0)
    assert case.wheel_file.units == "m"
    assert float(place_case(case).first.rail_y_mm) == pytest.approx(rows_m[0].place_y_mm, abs=1e-9)


def test_rows_that_name_each_other_are_read_with_their_own_options(tmp_path, profiles):
    """Mirrored points, and points in m with exchanged columns, give equal rows."""
    plain, changed = tmp_path / "plain", tmp_path / "changed"
    write_fleet_file(plain, AXLE, TRACK, shifts=(3,), profiles=profiles)
    write_fleet_file(
        changed,
        'file,name,opposite_wheel,units,columns\nwheel.csv,left,right,,\nother_wheel.csv,right,left,m,"2,1"\n',
        "file,name,opposite_rail,mirror\nrail.csv,left,right,\nother_rail.csv,right,left,yes\n",
        shifts=(3,),
        profiles=profiles,
    )
    for name, change in (("other_wheel", lambda y, z: (1e-3 * z, 1e-3 * y)), ("other_rail", lambda y, z: (-y, z))):
        points = np.loadtxt(changed / f"{name}.csv", delimiter=",", skiprows=1)
        rows = [change(*point) for point in points]
        (changed / f"{name}.csv").write_text("".join(f"{first:.12f},{second:.12f}\n" for first, second in rows))
    for folder in (plain, changed):
        fecontact.run_fleet(folder / "fleet.toml", folder / "out")
    screened = fecontact.open_fleet(changed / "out")
    assert len(read_rows(plain / "out")) == 4
    for row, plain_row in zip(read_rows(changed / "out"), read_rows(plain / "out"), strict=True):
        assert (row.wheel, row.rail, row.verdict) == (plain_row.wheel, plain_row.rail, plain_row.verdict)
        # mirrored points are smoothed from the other end
        assert row.place_y_mm == pytest.approx(plain_row.place_y_mm, abs=1e-3)
        # the case of the position reads each side in its way, also from its record
        case = screened.case(row.wheel, row.rail, row.shift_mm, row.load_kN)
        assert read_case_record(json.loads(json.dumps(make_case_record(case)))) == case
        assert (case.wheel_file.units, case.opposite.wheel_file.units) == {
            "left": (None, "m"),
            "right": ("m", None),
        }[row.wheel]
        assert (case.rail_file.mirror, case.opposite.rail_file.mirror) == {
            "left": (None, True),
            "right": (True, None),
        }[row.rail]
        assert float(place_case(case).first.rail_y_mm) == pytest.approx(row.place_y_mm, abs=1e-9)


def test_a_path_that_needs_options_becomes_a_row(tmp_path):
    """The remedy of the refusal works, and does not change the population."""
    folder = tmp_path / "fleet"
    folder.mkdir()
    write_points(folder / "w.csv", "S1002", 0.3)
    write_points(folder / "other.csv", "S1002", 0.45, 1e-3)
    path = write_fleet_file(folder, "file,opposite_wheel\nS1002,S1002\nw.csv,other.csv\n", "file\n60E1\n")
    screening = fecontact.run_fleet(path, tmp_path / "out")
    message = screening.refused["wheel w"]
    assert "its opposite wheel" in message
    assert "give it a row of its own with them, and name that row in opposite_wheel (weight = 0 leaves" in message
    (folder / "wheels.csv").write_text(
        "file,name,opposite_wheel,units,weight\nw.csv,w,other,,1\nother.csv,other,,m,0\n"
    )
    screening = fecontact.run_fleet(path, tmp_path / "out")
    assert (screening.refused, screening.unread) == ({}, {})
    weights = {row.wheel: row.weight for row in read_rows(tmp_path / "out")}
    assert weights == {"w": 1.0, "other": 0.0}
    case = fecontact.open_fleet(tmp_path / "out").case("w", "60E1", 0.0, 80.0)
    assert (case.wheel_file.units, case.opposite.wheel_file.units) == (None, "m")


def test_options_of_the_other_side_need_its_file():
    for name in ("rail", "wheel"):
        with pytest.raises(InputError, match=rf"{name}_file of the other side is given without its {name}; give"):
            Opposite(**{f"{name}_file": Reading()})
        with pytest.raises(InputError, match=r"allowed: None, or a Reading"):
            Opposite(**{name: "S1002", f"{name}_file": "mirror"})
    # an exact profile does not use options
    case = Case(opposite=Opposite(wheel="S1002_h30", wheel_file=Reading(units="m")))
    with pytest.raises(InputError, match=r"units of the wheel file is 'm', but 'S1002_h30' is an exact profile"):
        place_case(case)
    # a case without such options has the record of the time before them
    assert make_case_record(Case())["opposite"] == dict.fromkeys(("rail", "wheel", "rolling_radius_mm", "wheel_load_N"))


@pytest.mark.parametrize("by_row", [True, False])
def test_a_changed_file_of_the_other_side_is_screened_again(tmp_path, by_row):
    other_path = tmp_path / "fleet" / "other.csv"
    other_path.parent.mkdir()
    write_points(other_path, "S1002", 0.3)
    wheels = "file,opposite_wheel\nS1002,other.csv\n" if by_row else "file\nS1002\n"
    case_text = "" if by_row else '[case.opposite]\nwheel = "other.csv"'
    path = write_fleet_file(tmp_path / "fleet", wheels, "file\n60E1\n", shifts=(3,), case_text=case_text)
    out = tmp_path / "out"
    assert fecontact.run_fleet(path, out).reused == 0
    (first,) = read_rows(out)
    assert fecontact.run_fleet(path, out).reused == 1
    write_points(other_path, "S1002", 0.5)
    with pytest.raises(InputError, match=r"other.csv was changed after it was screened"):
        fecontact.open_fleet(out).case("S1002", "60E1", 3.0, 80.0)
    assert fecontact.run_fleet(path, out).reused == 0
    (second,) = read_rows(out)
    case = Case(opposite=Opposite(wheel=str(other_path)), lateral_shift_mm=3.0)
    assert second.place_y_mm == pytest.approx(float(place_case(case).first.rail_y_mm), abs=1e-9)
    assert abs(first.contact_angle_mrad - second.contact_angle_mrad) > 1e-4
    assert fecontact.open_fleet(out).case("S1002", "60E1", 3.0, 80.0).opposite == case.opposite


def test_a_row_whose_other_side_cannot_be_used_is_refused(tmp_path, capsys):
    points = make_worn_points("60E1", 0.0, 0.3, 0.008, np.random.default_rng(3))
    cosine, sine = np.cos(0.05), np.sin(0.05)
    (tmp_path / "fleet").mkdir()
    canted_points = points @ np.array([[cosine, sine], [-sine, cosine]])
    (tmp_path / "fleet" / "canted.csv").write_text(format_points(canted_points, "canted"))
    rails = (
        "file,name,opposite_rail,inclination,accepted\n60E1,good,54E1,,\n60E1,lost,none.csv,,\n"
        "60E1,unknown,60E11,,\n60E1,suspicious,canted.csv,,\n60E1,settled,canted.csv,none,\n"
        "54E1,refused,out,,\n49E1,out,,,no\n60E1,steep,other,1:20,\n60E2,other,,1:40,\n"
    )
    path = write_fleet_file(tmp_path / "fleet", "file\nS1002\n", rails)
    assert call(["fleet", "check", str(path)]) == 0
    printed = capsys.readouterr()
    assert "inputs file, name, opposite_rail, inclination, accepted" in printed.out
    fecontact.run_fleet(path, tmp_path / "out")
    statuses = read_profile_statuses(tmp_path / "out")
    assert {name for name, (status, _) in statuses.items() if status == "read"} == {"good", "settled", "other", "S1002"}
    assert {status for status, _ in statuses.values()} == {"read", "refused"}
    for name, said in (
        ("lost", "its opposite rail"),
        ("unknown", "60E11"),
        ("suspicious", "may be canted"),
        ("refused", "accepted is no in its table"),
        ("steep", "opposite_rail is the row 'other' with different values of inclination"),
    ):
        assert said in statuses[name][1], (name, statuses[name])
        if name != "suspicious":  # a cant is found when the profile is smoothed
            assert f"rail {name}" in printed.out + printed.err


@pytest.mark.parametrize(
    ("wheels", "rails", "message"),
    [
        ("file,opposite_rail\nS1002,60E1\n", "file\n60E1\n", "only rails have it"),
        ("file\nS1002\n", "file,opposite_wheel\n60E1,S1002\n", "only wheels have it"),
        ("file,Opposite\nS1002,S1002\n", "file\n60E1\n", "rename it to opposite_wheel"),
        ("file,Opposite_Wheel\nS1002,S1002\n", "file\n60E1\n", "Rename it to opposite_wheel"),
        ("file\nS1002\n", "file,other_rail\n60E1,60E1\n", "rename it to opposite_rail"),
        ("file,opposite_rolling_radius_mm\nS1002,459\n", "file\n60E1\n", "name this row in opposite_wheel"),
        ("file\nS1002\n", "file,opposite_mirror\n60E1,yes\n", "the other rail has the mirror of its row: name this"),
        (
            "file,opposite_wheel\na/w.csv,w\nb/w.csv,w\n",
            "file\n60E1\n",
            "row 1: opposite_wheel is 'w', the name of 2 rows",
        ),
    ],
)
def test_columns_of_the_other_side_that_are_not_allowed_are_refused(tmp_path, wheels, rails, message):
    with pytest.raises(InputError) as error:
        fecontact.check_fleet(write_fleet_file(tmp_path / "fleet", wheels, rails))
    assert message in str(error.value)
