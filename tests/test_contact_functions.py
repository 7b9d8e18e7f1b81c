"""The wheelset over its shift: conicities against published values and closed forms, jumps, and the command."""

import csv
import json
import subprocess
import sys
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from fecontact.case import Case, Opposite, Track
from fecontact.cli import call
from fecontact.feature_registry import FEATURES
from fecontact.outputs.geometry import contact_functions_lines, contact_functions_record
from fecontact.outputs.terminal import print_parts
from fecontact.placement.wheel_on_rail import set_up_pair
from fecontact.placement.wheelset import Wheelset, compute_contact_functions, rolling_radius_difference_mm
from fecontact.profiles.curve import Profile, make_circular_rail_head
from fecontact.profiles.segments import StraightSegment
from fecontact.solving.placing import make_wheelset, place_case
from fecontact.solving.wheelset_geometry import geometry

TABLE = [-5.0, -3.0, -0.5, 0.0, 0.5, 1.0, 3.0, 5.0]


@pytest.fixture(scope="module")
def standard():
    return geometry(Case(), TABLE)


# --- equivalent conicity ----------------------------------------------------------------------------------------------


def test_conicity_of_s1002_on_60e1(standard):
    # gauge 1435 mm, amplitudes of 1 to 5 mm; published with two decimals, by linearisation
    harmonic = [conicity.harmonic_unrolled for conicity in standard.conicities[:5]]
    assert harmonic == pytest.approx([0.36, 0.22, 0.18, 0.16, 0.15], abs=0.005)
    unrolled = [conicity.unrolled for conicity in standard.conicities[:5]]
    assert unrolled == pytest.approx([0.36, 0.22, 0.18, 0.16, 0.15], abs=0.007)


def test_cones_on_circles_have_their_own_conicity():
    # radii grow towards the flange: 1:20
    cone = Profile(name="cone", kind="wheel", segments=(StraightSegment(start=(-60.0, -3.0), end=(60.0, 3.0)),))
    pair = set_up_pair(make_circular_rail_head(300.0), cone, inclination_rad=0.0, track=Track(rail_crown_y_mm=750.0))
    functions = compute_contact_functions(Wheelset.of(pair, pair), [-3.0, -1.0, 0.0, 1.0, 3.0])
    assert functions.jumps == ()
    assert [conicity.amplitude_mm for conicity in functions.conicities] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
    for conicity in functions.conicities:
        # linear steps between samples of the wheel, which is straight
        assert conicity.unrolled == pytest.approx(0.05, rel=1e-7)
    # rolled by f the contact points move across by R sin(f) on circles of R 300, and with the wheel: for small shifts
    # f = 0.05 y / (750 - (300 + 460) 0.05), and the radii differ by 2 * 0.05 (y + (300 + 460) f)
    roll = 0.05 / (750.0 - 760.0 * 0.05)
    assert functions.positions[1.0].roll_rad == pytest.approx(roll, rel=2e-3)
    assert functions.conicities[0].rolled == pytest.approx(0.05 * (1.0 + 760.0 * roll), rel=2e-3)


# --- jumps ------------------------------------------------------------------------------------------------------------


def test_jumps_are_where_two_points_touch(standard):
    left = [jump for jump in standard.jumps if jump.side == "left"]
    assert len(left) == 2
    for jump in left:
        placement = place_case(Case(lateral_shift_mm=jump.shift_mm, roll="touching"))
        first, second = placement.contact_points[:2]
        # the shift is known to 1e-4 mm, over which the gaps change by some tenths of that
        assert second.vertical_gap_mm < 5e-5
        rail_positions = sorted((first.rail_y_mm, second.rail_y_mm))
        assert rail_positions == pytest.approx(sorted((jump.from_rail_y_mm, jump.to_rail_y_mm)), abs=0.02)
    right = sorted(jump.shift_mm for jump in standard.jumps if jump.side == "right")
    assert right == pytest.approx([-jump.shift_mm for jump in reversed(left)], abs=1e-12)


def test_first_contact_points_lie_to_one_side_of_a_jump(standard):
    for jump in (jump for jump in standard.jumps if jump.side == "left"):
        before, after = (
            place_case(Case(lateral_shift_mm=jump.shift_mm + step, roll="touching")).first.rail_y_mm
            for step in (-2e-3, 2e-3)
        )
        assert before == pytest.approx(jump.from_rail_y_mm, abs=0.1)
        assert after == pytest.approx(jump.to_rail_y_mm, abs=0.1)


# --- the table --------------------------------------------------------------------------------------------------------


def test_positions_are_those_of_the_wheelset(standard):
    assert list(standard.positions) == TABLE
    for shift in (-3.0, 0.5, 5.0):
        position, alone = standard.positions[shift], place_case(Case(lateral_shift_mm=shift, roll="touching"))
        # the roll is found from another guess
        assert position.left.first.rail_y_mm == pytest.approx(alone.first.rail_y_mm, abs=1e-6)
        assert position.left.wheel.centre_mm == pytest.approx(alone.wheel.centre_mm, abs=1e-9)
        mirrored = standard.positions[-shift]
        if isinstance(mirrored, str):
            continue
        assert rolling_radius_difference_mm(mirrored) == pytest.approx(
            -rolling_radius_difference_mm(position), abs=1e-9
        )


def test_other_sides_are_no_mirror_images():
    case = Case(opposite=Opposite(rolling_radius_mm=459.0))
    wheelset_geometry = geometry(case, [-1.0, 1.0])
    assert not wheelset_geometry.symmetric
    for shift, position in wheelset_geometry.positions.items():
        again = make_wheelset(case).at(shift)
        assert position.roll_rad == pytest.approx(again.roll_rad, abs=1e-12)
    differences = [rolling_radius_difference_mm(position) for position in wheelset_geometry.positions.values()]
    # the wheelset is off by the 1 mm, and a little more by its roll
    assert sum(differences) / 2 == pytest.approx(1.0, abs=0.3)


def test_a_record_says_units_and_what_cannot_be(standard):
    record = contact_functions_record(Case(), geometry(Case(), [2.0, 8.0]))
    good, bad = record["positions"]
    assert "derails" in bad["problem"]
    assert good["lift_mm"] > 0.0
    touch = good["left"]["contact_points"][0]
    alone = place_case(Case(lateral_shift_mm=2.0, roll="touching")).first
    assert touch["contact_angle_rad"] == pytest.approx(alone.contact_angle_rad, abs=1e-9)
    assert touch["rail_radius_mm"] == pytest.approx(80.0, rel=1e-9)
    # without a yaw the contact point lies below the axle
    assert touch["ahead_mm"] == pytest.approx(0.0, abs=1e-9)


ALONG = "radius of the wheel along the rail"


@pytest.mark.parametrize(
    ("width", "without"), [(120, []), (100, [ALONG, "lift"]), (80, [ALONG, "lift", "rolling radius"])]
)
def test_the_table_fits_its_width_and_names_what_it_has_no_room_for(standard, width, without):
    record = contact_functions_record(Case(), standard)
    console = Console(width=width, force_terminal=True, color_system=None, file=StringIO())
    print_parts(contact_functions_lines(record), console)
    table, _, rest = console.file.getvalue().partition("The right wheel")
    assert rest
    assert "…" not in table
    assert max(len(line.rstrip()) for line in table.splitlines()) <= width
    names = table.partition("no room for: ")[2].strip()
    assert names == ", ".join(without)
    # shift, roll, the contact point and its angle always find room
    assert all(word in table for word in ("+5.00", "+0.3407", "-26.55", "+299.98"))


def test_a_table_goes_on_where_the_flange_climbs_if_that_is_asked_for():
    case = Case(flange_climb=True)
    record = contact_functions_record(case, geometry(case, [6.0, 7.0, 8.0]))
    assert record["case"]["flange_climb"] is True
    angles = [row["left"]["contact_points"][0]["contact_angle_rad"] for row in record["positions"]]
    # over 70 degrees and down again
    assert angles[0] < 0.5
    assert 1.2 > angles[1] > angles[2] > 0.9
    lifts = [row["lift_mm"] for row in record["positions"]]
    assert lifts == sorted(lifts)


# --- the command ------------------------------------------------------------------------------------------------------


def test_the_command_prints_tables_or_json_and_draws(capsys, tmp_path):
    picture = tmp_path / "geometry.png"
    assert call(["geometry", "--shifts", "-1:1:1,8", "--out", str(picture)]) == 0
    text = capsys.readouterr().out
    assert "jump at a shift of +0.226 mm" in text
    assert "no position at +8.00 mm: left side: " in text
    assert "equivalent conicity" in text
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert call(["geometry", "--shifts", "1", "--json", "--yaw-mrad", "4"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["positions"]
    # a yaw moves the contact point of a left wheel on the gauge side ahead
    assert row["left"]["contact_points"][0]["ahead_mm"] > 0.1


def test_what_a_feature_offers_is_missed_where_it_is_not_installed(monkeypatch, capsys):
    other_features = tuple(feature for feature in FEATURES if feature != "curves")
    monkeypatch.setattr("fecontact.feature_registry.FEATURES", other_features)
    assert call(["geometry", "--shifts", "0", "--loaded-kn", "60"]) == 2
    said = f"--loaded-kn needs a feature that is not installed; installed: {', '.join(other_features)}"
    assert said in capsys.readouterr().err


def test_the_command_needs_neither_gmsh_nor_finite_elements():
    code = (
        "import sys; sys.modules['gmsh'] = sys.modules['skfem'] = sys.modules['pyvista'] = None;"
        "from fecontact.cli import call; code = call(['geometry', '--shifts', '0,1']);"
        "print([name for name in sys.modules if name.startswith('fecontact.fe.')]); sys.exit(code)"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert process.stdout.strip().endswith("[]")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--shifts", "20"], "fits on the track at none of the shifts"),
        (["--shifts", "a"], "neither a number nor a range"),
        (
            ["--gauge-mm", "1400", "--shifts", "0"],
            "it fits on a gauge 20 to 80 mm wider, or with",
        ),
        (["--rail", "circle:300", "--wheel", "nowhere"], "nowhere"),
        (["--opposite", "rolling-radius-mm=-1"], "opposite rolling radius is -1.0 mm"),
    ],
)
def test_bad_input_is_one_line(arguments, says, capsys):
    assert call(["geometry", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err
    assert len(err.strip().splitlines()) == 1


def test_the_geometry_as_a_table_has_the_numbers_of_its_json(tmp_path, capsys):
    assert call(["geometry", "--shifts", "0,5,30", "--json"]) == 0
    positions = json.loads(capsys.readouterr().out)["positions"]
    assert call(["geometry", "--shifts", "0,5,30", "--out", str(tmp_path / "wheelset.csv")]) == 0
    assert "table:" in capsys.readouterr().out
    rows = list(csv.DictReader((tmp_path / "wheelset.csv").read_text("utf-8").splitlines()))
    assert [float(row["lateral_shift_mm"]) for row in rows] == [0.0, 5.0, 30.0]
    assert float(rows[1]["roll_mrad"]) == pytest.approx(positions[1]["roll_mrad"], rel=1e-12)
    for side in ("left", "right"):
        for number, touch in enumerate(positions[1][side]["contact_points"], start=1):
            for name in ("rail_y_mm", "wheel_y_mm", "contact_angle_rad"):
                assert float(rows[1][f"{side}_touch{number}_{name}"]) == pytest.approx(touch[name], rel=1e-12)
    # where it cannot stand the table says so
    assert rows[2]["problem"]
    assert rows[2]["roll_mrad"] == ""


def test_shifts_without_a_position_have_a_common_line(capsys):
    tongue = Path(__file__).parents[1] / "studies" / "profiles" / "switch_tongue_20.toml"
    assert call(["geometry", "--rail", str(tongue), "--inclination", "none", "--shifts", "-5:-4:0.5,4:8:0.5"]) == 0
    reasons = [line for line in capsys.readouterr().out.splitlines() if line.startswith("no position at ")]
    ends = [line.split(": left")[0].split(": right")[0] for line in reasons]
    assert ends == [
        "no position at -5.00 to -4.50 mm (2 shifts); at the first",
        "no position at +4.50 to +8.00 mm (8 shifts); at the first",
    ]
