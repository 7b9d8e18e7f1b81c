"""Quality gate of fleets: suspicious profiles and their settlement; rows that replace inputs of the case."""

import pickle

import duckdb
import numpy as np
import pytest
from inline import inline_crew, stand_ins

import fecontact
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.features.fleet.examples import write_fleet
from fecontact.features.fleet.model import read_fleet
from fecontact.features.fleet.paired_profiles import read_paired_profiles
from fecontact.features.fleet.population import Candidate
from fecontact.features.fleet.profile_files import ReadProfile
from fecontact.profiles.examples import format_points, make_worn_points
from fecontact.profiles.library import list_names, load_library_profile
from fecontact.profiles.plausibility import find_suspicions
from fecontact.profiles.reading import Reading
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.profiles.suspicions import SuspiciousProfileError

GAUGE_DEPTH_MM = 14.0
FLEET = """
[wheels]
files = "wheels.csv"
[rails]
files = "{rails}"
[shifts_mm]
values = [-2, 0]
[loads_kN]
values = [60]
{case_text}
"""


@pytest.fixture(autouse=True)
def _one_process():
    with stand_ins(inline_crew(), None, ""):
        yield


def make_points(name, middle_mm=0.0, wear_mm=0.3, noise_mm=0.008):
    return make_worn_points(name, middle_mm, wear_mm, noise_mm, np.random.default_rng(3))


def roll_points(points, angle_rad):
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    return points @ np.array([[cosine, sine], [-sine, cosine]])


def lift_points(points, y_mm, height_mm, count=5):
    """Points with some lifted neighbours, with sharp edges."""
    first = int(np.argmin(np.abs(points[:, 0] - y_mm)))
    lifted = points.copy()
    lifted[first : first + count, 1] += height_mm
    return lifted


def bend_points(points, y_mm, height_mm, half_width_mm=1.0):
    """Points with a smooth dent or lump."""
    distance = np.clip((points[:, 0] - y_mm) / half_width_mm, -1.0, 1.0)
    return points + np.column_stack((np.zeros(len(points)), height_mm * np.cos(0.5 * np.pi * distance) ** 2))


WORN_RAIL, WORN_WHEEL = make_points("60E1", -20.0, 0.8), make_points("S1002", 0.0, 0.2)
DAMAGED = {
    "mirrored": ("rail", (WORN_RAIL * (-1.0, 1.0))[::-1], "mirrored"),
    "canted": ("rail", roll_points(make_points("60E1"), 0.05), "canted"),
    "canted40": ("rail", roll_points(make_points("54E1"), 0.025), "canted"),
    "low_gauge_side": ("rail", WORN_RAIL[WORN_RAIL[:, 1] > -12.0], "short"),
    "half": ("rail", WORN_RAIL[WORN_RAIL[:, 0] < 5.0], "short"),
    "rail_dent": ("rail", lift_points(make_points("60E1"), -5.0, -0.2), "dented"),
    "rail_as_wheel": ("wheel", make_points("60E1"), "other body"),
    "wheel_as_rail": ("rail", WORN_WHEEL, "other body"),
    "shifted": ("wheel", WORN_WHEEL + np.array([5.0, 0.0]), "shifted"),
    "shifted_back": ("wheel", WORN_WHEEL - np.array([5.0, 0.0]), "shifted"),
    "outside": ("wheel", WORN_WHEEL + np.array([100.0, 0.0]), "tape circle"),
    "short": ("wheel", WORN_WHEEL[WORN_WHEEL[:, 0] < 15.0], "short"),
    "no_flange": ("wheel", WORN_WHEEL[WORN_WHEEL[:, 0] > -30.0], "short"),
    "half_flange": ("wheel", WORN_WHEEL[WORN_WHEEL[:, 0] > -41.0], "short"),
    "dent": ("wheel", lift_points(WORN_WHEEL, 12.0, 0.2), "dented"),
    "smooth_dent": ("wheel", bend_points(WORN_WHEEL, 12.0, 0.3), "dented"),
    "wide_dent": ("rail", bend_points(make_points("60E1"), -5.0, -0.5, 2.0), "dented"),
    "spike": ("wheel", lift_points(WORN_WHEEL, 12.0, 0.3, count=1), "dented"),
    "lump": ("wheel", make_points("S1002", 26.0, -1.5), "wear"),
}


def write_points(path, points):
    path.parent.mkdir(exist_ok=True)
    path.write_text(format_points(points, "made"), "utf-8")
    return path


def list_kinds(path, body, reading=None):
    """Kinds of the suspicions about a file."""
    reading = reading or Reading(filter_mm=4.0)
    try:
        profile = resolve_rail(str(path), reading) if body == "rail" else resolve_wheel(str(path), reading).profile
    except SuspiciousProfileError as error:
        return [error.kind]
    return [suspicion.kind for suspicion in find_suspicions(profile, reading, GAUGE_DEPTH_MM)]


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_profile_is_suspicious(tmp_path, name):
    body, points, kind = DAMAGED[name]
    assert kind in list_kinds(write_points(tmp_path / f"{name}.csv", points), body)


@pytest.mark.parametrize("name", ["mirrored", "canted", "shifted"])
def test_exact_points_are_checked_too(tmp_path, name):
    body = DAMAGED[name][0]
    points = {
        "mirrored": (make_points("60E1", -20.0, 0.8, 0.0) * (-1.0, 1.0))[::-1],
        "canted": roll_points(make_points("60E1", noise_mm=0.0), 0.05),
        "shifted": make_points("S1002", wear_mm=0.0, noise_mm=0.0) + np.array([5.0, 0.0]),
    }[name]
    assert list_kinds(write_points(tmp_path / "a.csv", points), body, Reading(filter_mm=0.0)) == [name]


def test_options_of_reading_answer_suspicions(tmp_path):
    mirrored = write_points(tmp_path / "mirrored.csv", DAMAGED["mirrored"][1])
    assert list_kinds(mirrored, "rail", Reading(filter_mm=4.0, mirror=True)) == []
    assert list_kinds(mirrored, "rail", Reading(filter_mm=4.0, mirror=False)) == []
    shifted = write_points(tmp_path / "shifted.csv", DAMAGED["shifted"][1])
    assert list_kinds(shifted, "wheel", Reading(filter_mm=4.0, tape_circle_mm=5.0)) == []


def test_the_kind_of_an_error_survives_a_worker_process():
    error = pickle.loads(pickle.dumps(SuspiciousProfileError("a; b", "mirrored")))
    assert (str(error), error.kind) == ("a; b", "mirrored")


def list_healthy_alarms(folder, seeds, count):
    """Suspicions about worn examples, by file."""
    alarms = {}
    for seed in seeds:
        write_fleet(folder / str(seed), wheels=count, rails=count, seed=seed)
        for body in ("wheel", "rail"):
            for path in sorted((folder / str(seed) / f"{body}s").iterdir()):
                if kinds := list_kinds(path, body):
                    alarms[f"{seed} {path.name}"] = kinds
    return alarms


def list_library_alarms(folder, names):
    """Suspicions about library profiles as points, by name."""
    alarms = {}
    for body, name in names:
        points = make_points(name, wear_mm=0.0, noise_mm=0.0)
        if kinds := list_kinds(write_points(folder / f"{name}.csv", points), body, Reading(filter_mm=0.0)):
            alarms[name] = kinds
    return alarms


LIBRARY = [(body, name) for body in ("wheel", "rail") for name in list_names(body)]


def test_healthy_profiles_are_not_suspicious(tmp_path):
    assert list_healthy_alarms(tmp_path, (11,), 4) == {}
    assert list_library_alarms(tmp_path / "library", LIBRARY[::5]) == {}


@pytest.mark.slow
def test_no_healthy_profile_of_many_is_suspicious(tmp_path):
    assert list_healthy_alarms(tmp_path, (1, 2, 3, 4, 5), 10) == {}
    assert list_library_alarms(tmp_path / "library", LIBRARY) == {}


def write_gated_fleet(folder, *, wheels, rails="60E1", case_text=""):
    (folder / "wheels.csv").write_text(wheels)
    (folder / "fleet.toml").write_text(FLEET.format(rails=rails, case_text=case_text))
    return folder / "fleet.toml"


def read_statuses(out):
    rows = duckdb.sql(f"SELECT name, status, suspicions, reason, remedy FROM '{out}/profiles.parquet'").fetchall()
    return {name: (status, suspicions, reason, remedy) for name, status, suspicions, reason, remedy in rows}


def read_screen(out):
    columns = "wheel, rail, shift_mm, verdict, weight, place_y_mm, hertz_p_max_MPa, conicity"
    return duckdb.sql(f"SELECT {columns} FROM '{out}/screen/*.parquet' ORDER BY ALL").fetchall()


def test_suspicious_files_stay_out_until_their_rows_settle_them(tmp_path, capsys):
    for name in ("shifted", "smooth_dent", "short", "rail_as_wheel"):
        write_points(tmp_path / f"{name}.csv", DAMAGED[name][1])
    head = "file,weight,accepted,tape_circle_mm\nS1002,1,,\n"
    path = write_gated_fleet(
        tmp_path, wheels=head + "shifted.csv,2,,\nsmooth_dent.csv,3,,\nshort.csv,4,,\nrail_as_wheel.csv,6,,\n"
    )
    out = tmp_path / "out"
    assert call(["fleet", "run", str(path), "--out", str(out)]) == 0
    printed = capsys.readouterr()
    text = " ".join((printed.out + printed.err).split())
    # the weight of the suspicious wheels is 15 of 16
    assert "4 of 6 files are suspicious, and 93.8 % of the pairs" in text
    assert "accepted = yes to use it as it is" in text
    statuses = read_statuses(out)
    kinds = {"shifted": "shifted", "smooth_dent": "dented", "short": "short", "rail_as_wheel": "other body"}
    for name, kind in kinds.items():
        assert statuses[name][0] == "suspicious"
        assert kind in statuses[name][1]
        assert "accepted" in statuses[name][3]
    assert {row[0] for row in read_screen(out)} == {"S1002"}

    assert call(["fleet", "report", str(out)]) == 0
    assert "4 suspicious files and 94 % of the pairs" in " ".join(capsys.readouterr().out.split())
    page = (out / "report.html").read_text("utf-8")
    assert "Suspicious files" in page
    assert "S1002 fits the points with a lateral shift of +5.0 mm" in page

    settled = "shifted.csv,2,,5\nsmooth_dent.csv,3,yes,\nshort.csv,4,no,\nrail_as_wheel.csv,6,yes,\n"
    screening = fecontact.run_fleet(write_gated_fleet(tmp_path, wheels=head + settled), out)
    statuses = read_statuses(out)
    assert [statuses[name][0] for name in kinds] == ["read", "read", "refused", "refused"]
    assert "accepted = yes does not answer this" in statuses["rail_as_wheel"][3]
    assert {row[0] for row in read_screen(out)} == {"S1002", "shifted", "smooth_dent"}
    assert (dict(screening.suspicious), screening.suspicious_share) == ({}, 0.0)


def test_a_header_without_the_tape_circle_is_a_suspicion_that_its_row_settles(tmp_path):
    """A MiniProf wheel counts X from the back of its flange; its header may not have the tape circle."""
    points = make_points("S1002", wear_mm=0.0, noise_mm=0.0) * (1, -1) + (70, 0)
    lines = "".join(f"{x:.6f} {y:.6f}\n" for x, y in points)
    (tmp_path / "from_back.whl").write_text(f"MPTypeNo=131\nColumnDef=X,Y\n\n{lines}")
    assert list_kinds(tmp_path / "from_back.whl", "wheel") == ["tape circle"]
    for cells, status in ((",", "suspicious"), ("70,", "read"), (",no", "refused"), (",yes", "refused")):
        path = write_gated_fleet(tmp_path, wheels=f"file,tape_circle_mm,accepted\nS1002,,\nfrom_back.whl,{cells}\n")
        fecontact.run_fleet(path, tmp_path / "out")
        row = read_statuses(tmp_path / "out")["from_back"]
        assert row[0] == status, cells
    assert "accepted = yes does not answer this" in row[3]


def test_accepted_and_mirror_settle_a_mirrored_rail(tmp_path):
    write_points(tmp_path / "mirrored.csv", DAMAGED["mirrored"][1])
    for cells, status in (("yes,", "read"), (",no", "read"), (",yes", "read"), ("no,", "refused"), (",", "suspicious")):
        (tmp_path / "rails.csv").write_text(f"file,accepted,mirror\n60E1,,\nmirrored.csv,{cells}\n")
        path = write_gated_fleet(tmp_path, wheels="file\nS1002\n", rails="rails.csv")
        fecontact.run_fleet(path, tmp_path / "out")
        assert read_statuses(tmp_path / "out")["mirrored"][0] == status, cells


def test_an_accepted_rail_is_solved_as_it_was_screened(tmp_path):
    write_points(tmp_path / "mirrored.csv", DAMAGED["mirrored"][1])
    (tmp_path / "rails.csv").write_text("file,accepted\nmirrored.csv,yes\n")
    path = write_gated_fleet(tmp_path, wheels="file\nS1002\n", rails="rails.csv")
    fecontact.run_fleet(path, tmp_path / "out")
    assert fecontact.open_fleet(tmp_path / "out").case("S1002", "mirrored", 0.0, 60.0).rail_file.mirror is False


def test_inclinations_settle_a_canted_rail(tmp_path):
    write_points(tmp_path / "canted.csv", DAMAGED["canted"][1])
    for cell, case_text, status in (
        ("", "", "suspicious"),
        ("none", "", "read"),
        ("1:40", "", "read"),
        ("", '[case]\ninclination = "none"', "read"),
    ):
        (tmp_path / "rails.csv").write_text(f"file,inclination\n60E1,\ncanted.csv,{cell}\n")
        path = write_gated_fleet(tmp_path, wheels="file\nS1002\n", rails="rails.csv", case_text=case_text)
        fecontact.run_fleet(path, tmp_path / "out")
        assert read_statuses(tmp_path / "out")["canted"][0] == status, (cell, case_text)


def test_a_fleet_of_suspicious_wheels_tells_how_to_settle_them(tmp_path):
    write_points(tmp_path / "shifted.csv", DAMAGED["shifted"][1])
    with pytest.raises(InputError, match=r"lateral shift of \+5.0 mm.*tape_circle_mm"):
        fecontact.run_fleet(write_gated_fleet(tmp_path, wheels="file\nshifted.csv\n"), tmp_path / "out")


@pytest.mark.parametrize(
    ("column", "cell", "case"),
    [
        ("inclination", "1:20", '[case]\ninclination = "1:20"'),
        ("gauge_mm", "1432", "[case.track]\ngauge_mm = 1432"),
        ("back_to_back_mm", "1357", "[case.track]\nback_to_back_mm = 1357"),
        ("rolling_radius_mm", "420", "[case]\nrolling_radius_mm = 420"),
    ],
)
def test_a_column_of_a_row_equals_the_input_of_the_case(tmp_path, column, cell, case):
    screens = []
    is_wheel = column in ("back_to_back_mm", "rolling_radius_mm")
    for name, table, case_text in (
        ("default", "file\n{}\n", ""),
        ("column", f"file,{column}\n{{}},{cell}\n", ""),
        ("case", "file\n{}\n", case),
    ):
        (tmp_path / "rails.csv").write_text("file\n60E1\n" if is_wheel else table.format("60E1"))
        wheels = table.format("S1002") if is_wheel else "file\nS1002\n"
        path = write_gated_fleet(tmp_path, wheels=wheels, rails="rails.csv", case_text=case_text)
        fecontact.run_fleet(path, tmp_path / name)
        screens.append(read_screen(tmp_path / name))
        cases = fecontact.open_fleet(tmp_path / name).case("S1002", "60E1", 0.0, 60.0)
        screens.append((cases.inclination_rad, cases.track, cases.rolling_radius_mm))
    assert screens[2:4] == screens[4:6]
    assert screens[2] != screens[0]
    assert screens[3] != screens[1]


def test_a_file_with_two_inclinations_is_two_rails(tmp_path):
    write_points(tmp_path / "a.csv", make_points("60E1"))
    (tmp_path / "rails.csv").write_text("file,name,inclination\na.csv,a,1:20\na.csv,b,1:40\na.csv,c,1:40\n")
    path = write_gated_fleet(tmp_path, wheels="file\nS1002\n", rails="rails.csv")
    fecontact.run_fleet(path, tmp_path / "out")
    statuses = read_statuses(tmp_path / "out")
    assert [statuses[name][0] for name in "abc"] == ["read", "read", "refused"]
    assert len({row[5] for row in read_screen(tmp_path / "out")}) == 4


@pytest.mark.parametrize(
    ("wheels", "rails", "case_text", "message"),
    [
        ("file,inclination\nS1002,1:20\n", "file\n60E1\n", "", "only rails have it"),
        ("file,gauge_mm\nS1002,1435\n", "file\n60E1\n", "", "only rails have it"),
        ("file\nS1002\n", "file,back_to_back_mm\n60E1,1360\n", "", "only wheels have it"),
        ("file\nS1002\n", "file,inclination\n60E1,steep\n", "", "row 1: inclination is 'steep'"),
        ("file\nS1002\n", "file,gauge_mm\n60E1,-3\n", "", "gauge_mm is -3"),
        ("file,accepted\nS1002,maybe\n", "file\n60E1\n", "", "accepted is 'maybe'"),
    ],
)
def test_columns_that_are_not_allowed_are_refused(tmp_path, wheels, rails, case_text, message):
    (tmp_path / "rails.csv").write_text(rails)
    with pytest.raises(InputError) as error:
        fecontact.check_fleet(write_gated_fleet(tmp_path, wheels=wheels, rails="rails.csv", case_text=case_text))
    assert message in str(error.value)


def test_a_gauge_without_effect_is_refused(tmp_path):
    (tmp_path / "rails.csv").write_text("file,gauge_mm\n60E1,1432\n54E1,\n")
    case_text = "[case.track]\nrail_crown_y_mm = 753"
    fecontact.run_fleet(
        write_gated_fleet(tmp_path, wheels="file\nS1002\n", rails="rails.csv", case_text=case_text), tmp_path / "out"
    )
    status, _, reason, _ = read_statuses(tmp_path / "out")["60E1"]
    assert (status, "rail_crown_y_mm" in reason) == ("refused", True)


def test_the_share_of_listed_pairs_is_by_their_weights(tmp_path):
    (tmp_path / "pairs.csv").write_text("wheel,rail,weight\na,60E1,1\nb,60E1,2\nb,c,4\na,c,8\na,r,100\n")
    path = write_gated_fleet(tmp_path, wheels="file\nS1002\n", case_text='[pairs]\ntable = "pairs.csv"')
    statuses = {("wheel", "a"): "read", ("wheel", "b"): "suspicious"}
    statuses |= {("rail", "60E1"): "read", ("rail", "c"): "suspicious", ("rail", "r"): "refused"}
    paired = read_paired_profiles(
        read_fleet(path),
        [Candidate(body=body, name=name, spec=name) for body, name in statuses],
        lambda candidates: [
            ReadProfile(candidate=candidate, record={"status": statuses[candidate.body, candidate.name]})
            for candidate in candidates
        ],
    )
    # pairs of a refused profile are not counted; a on 60E1 remains of 1 + 2 + 4 + 8
    assert paired.suspicious_share == pytest.approx(14.0 / 15.0)
    assert paired.pairs == {("a", "60E1"): 1.0}


def test_check_counts_copies_and_the_disk_space_of_a_sample(tmp_path, capsys):
    points = make_points("S1002")
    for name in ("a", "b", "c"):
        write_points(tmp_path / f"{name}.csv", points)
    path = write_gated_fleet(tmp_path, wheels="file\na.csv\nb.csv\nc.csv\n")
    assert call(["fleet", "check", str(path)]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "3 wheel files, of which 2 are copies of a and not used" in text
    assert "MB of disk space per position" in text
    path = write_gated_fleet(tmp_path, wheels="file\na.csv\nb.csv\nS1002\nS1002\n")
    call(["fleet", "check", str(path)])
    assert "4 wheel files, of which 2 are copies of 2 files" in " ".join(capsys.readouterr().out.split())


def test_profiles_of_the_library_are_not_checked():
    assert find_suspicions(load_library_profile("S1002"), Reading()) == []
