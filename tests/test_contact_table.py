"""Contact tables for vehicle codes, and their verdicts compared with a stored map."""

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.io import netcdf_file

import fecontact
from fecontact.bodies import STEEL, Material
from fecontact.case import Case
from fecontact.cli import call
from fecontact.contact_theories.registry import THEORIES
from fecontact.contact_theories.rolling.creepage import Creepages, RollingEllipse
from fecontact.contact_theories.rolling.kalker import kalker_linear
from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError, ProgramError
from fecontact.guide.pages import read_page
from fecontact.outputs.alone import contact_table_lines
from fecontact.outputs.table_grid import TABLE_AXES, arrange_table, find_column_meaning, write_netcdf
from fecontact.outputs.table_jumps import describe_jumps, list_jump_intervals
from fecontact.runs import alone
from fecontact.runs.table_steps import SMALLEST_STEP_MM, refine_shifts
from fecontact.solving.alone import iterate_table_rows
from fecontact.solving.placing import place_case

ELLIPTIC = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
WHEELSET = Case(roll="touching")
SIZES = ("p_max_MPa", "area_mm2", "a_mm", "b_mm", "approach_mm")


@pytest.fixture(scope="module")
def rows():
    return fecontact.table(WHEELSET, [-4.0, 0.25, 5.0], [50e3, 100e3])


def test_where_hertz_is_exact_strips_and_springs_are_hertz():
    (row,) = fecontact.table(ELLIPTIC, [0.0], [100e3])
    for name in SIZES:
        # 100 strips; the area ends between two
        assert row[f"strip_{name}"] == pytest.approx(row[f"hertz_{name}"], rel=0.005), name
    # N goes with the power of 1.5 of the approach: a closed form for the difference quotient of the strips
    assert row["hertz_stiffness_N_per_mm"] == pytest.approx(1.5e5 / row["hertz_approach_mm"], rel=1e-12)
    assert row["strip_stiffness_N_per_mm"] == pytest.approx(row["hertz_stiffness_N_per_mm"], rel=0.01)
    assert row["springs_approach_mm"] == pytest.approx(row["hertz_approach_mm"], rel=1e-9)
    assert row["touch1_spring_N_per_mm15"] * row["hertz_approach_mm"] ** 1.5 == pytest.approx(1e5, rel=1e-9)
    assert (row["touch1_rail_radius_mm"], row["touch1_wheel_rolling_radius_mm"]) == pytest.approx((300.0, 460.0))
    assert row["touch1_wheel_lateral_radius_mm"] is None
    assert (row["cheapest_theory"], row["cheapest_theory_status"], row["problem"]) == ("hertz", "solved", "")


def test_the_stiffness_is_the_slope_over_the_loads():
    """From line to line, where the patch lies across a junction: 0.2 % are reached over 5 % of the load."""
    loads = np.array([95e3, 100e3, 105e3])
    low, middle, high = fecontact.table(WHEELSET, [3.0], loads)
    slope = (high["strip_normal_force_N"] - low["strip_normal_force_N"]) / (
        high["strip_approach_mm"] - low["strip_approach_mm"]
    )
    assert middle["strip_stiffness_N_per_mm"] == pytest.approx(slope, rel=0.01)


def test_lines_are_those_of_the_geometry_and_of_each_theory_alone(rows):
    assert [(row["lateral_shift_mm"], row["load_kN"]) for row in rows] == [
        (shift, load) for shift in (-4.0, 0.25, 5.0) for load in (50.0, 100.0)
    ]
    # all lines have the same columns, contact points last
    assert len({tuple(row) for row in rows}) == 1
    names = list(rows[0])
    first = next(place for place, name in enumerate(names) if re.match(r"touch\d", name))
    assert all(re.match(r"touch\d_", name) for name in names[first:])
    for row in rows[::2]:
        case = replace(WHEELSET, lateral_shift_mm=row["lateral_shift_mm"], load_N=50e3)
        touches = place_case(case).contact_points
        assert row["contact_points"] == len(touches)
        for number, touch in enumerate(touches, 1):
            assert row[f"touch{number}_contact_angle_rad"] == touch.contact_angle_rad
            assert row[f"touch{number}_rail_y_mm"] == touch.rail_y_mm
        for theory in ("hertz", "strip"):
            alone = fecontact.theory(case, theory)
            assert row[f"{theory}_normal_force_N"] == pytest.approx(alone["normal_force_N"], rel=1e-12)
            for name in SIZES:
                assert row[f"{theory}_{name}"] == pytest.approx(alone[name], rel=1e-12), (theory, name)
        springs = fecontact.theory(case, "multi_hertz")
        forces = [row.get(f"touch{number}_spring_force_N") or 0.0 for number in (1, 2)]
        assert sum(forces) == pytest.approx(springs["normal_force_N"], rel=1e-9)
        # with the springs the vertical load is carried
        angles = [row.get(f"touch{number}_contact_angle_rad") or 0.0 for number in (1, 2)]
        assert np.cos(angles) @ forces == pytest.approx(50e3, rel=1e-4)


def test_the_cheapest_theory_is_within_the_criteria_of_the_strips(rows):
    cheapest = {(row["lateral_shift_mm"], row["load_kN"]): row["cheapest_theory"] for row in rows}
    # by the finite elements: Hertz holds at -4 mm, nothing below the strips at 0.25 mm, springs are near at 5 mm
    assert (cheapest[-4.0, 50.0], cheapest[0.25, 50.0], cheapest[5.0, 50.0]) == ("hertz", "strip", "multi_hertz")
    for row in rows:
        if row["cheapest_theory"] == "hertz":
            assert row["hertz_p_max_MPa"] == pytest.approx(row["strip_p_max_MPa"], rel=0.05)
    # at -4 mm Hertz's peak is 0.2 % off the strips'
    (strict,) = fecontact.table(replace(WHEELSET, criteria=Criteria(p_max=1e-3)), [-4.0], [50e3])
    assert strict["cheapest_theory"] not in ("hertz", "")


def test_a_theory_that_is_near_by_chance_keeps_its_own_status(monkeypatch):
    entry = THEORIES["hertz"]
    doubtful = replace(entry, approximate=lambda position: replace(entry.approximate(position), status="out of range"))
    monkeypatch.setitem(THEORIES, "hertz", doubtful)
    (row,) = fecontact.table(WHEELSET, [-4.0], [50e3])
    assert (row["cheapest_theory"], row["cheapest_theory_status"]) == ("equivalent_ellipse", "solved")
    (row,) = fecontact.table(replace(WHEELSET, criteria=Criteria(theories_out_of_range=True)), [-4.0], [50e3])
    assert (row["cheapest_theory"], row["cheapest_theory_status"]) == ("hertz", "out of range")
    open_one = replace(
        entry, approximate=lambda position: replace(entry.approximate(position), status="several solutions")
    )
    monkeypatch.setitem(THEORIES, "hertz", open_one)
    (row,) = fecontact.table(WHEELSET, [-4.0], [50e3])
    # a theory that is known to hold comes before Hertz, which may hold
    assert (row["cheapest_theory"], row["cheapest_theory_status"]) == ("equivalent_ellipse", "solved")


def test_hertz_at_a_junction_is_the_cheapest_with_both_curvatures_alone(monkeypatch):
    """Hertz is the cheapest theory at a junction only if both sides are near, as in verdicts.

    If one of the sides is far off, Hertz is not an answer. The gauge side is not a separate theory.
    """
    (before,) = fecontact.table(WHEELSET, [-4.0], [50e3])
    far = replace(
        THEORIES["hertz_gauge"], approximate=lambda position: THEORIES["hertz"].approximate(more_loaded(position))
    )
    monkeypatch.setitem(THEORIES, "hertz_gauge", far)
    (row,) = fecontact.table(WHEELSET, [-4.0], [50e3])
    assert (before["cheapest_theory"], row["cheapest_theory"]) == ("hertz", "equivalent_ellipse")


def more_loaded(loaded):
    return replace(loaded, normal_force_N=3.0 * loaded.normal_force_N)


def test_positions_without_a_contact_are_lines_too(tmp_path, capsys):
    out = tmp_path / "table.csv"
    assert call(["table", "--shifts=-4,40", "--loads-kn", "50", "--out", str(out)]) == 3
    output = capsys.readouterr().out
    assert "+40.00 mm, 50 kN: lateral shift 40 mm of the wheelset" in output
    good, bad = csv.DictReader(out.read_text("utf-8").splitlines())
    assert float(good["strip_p_max_MPa"]) == pytest.approx(908, abs=2)
    assert "shifts between -49.5 and 6 mm" in bad["problem"]
    # nothing is known between a line and none
    assert "strip_approach_between_percent" not in good
    assert bad["strip_p_max_MPa"] == ""


def test_a_table_says_what_interpolation_between_its_lines_misses():
    # between 5 and 6 mm two patches share the load: steps of 1 mm and 20 kN
    rows = fecontact.table(WHEELSET, [4.0, 5.0, 6.0], [20e3, 40e3])
    by_place = {(row["lateral_shift_mm"], row["load_kN"]): row for row in rows}
    missed = {}
    for shift in (4.5, 5.5):
        (middle,) = fecontact.table(WHEELSET, [shift], [30e3])
        corners = [by_place[shift + side, load] for side in (-0.5, 0.5) for load in (20.0, 40.0)]
        for name in ("strip_approach_mm", "strip_stiffness_N_per_mm"):
            missed[shift, name] = 100.0 * abs(np.mean([row[name] for row in corners]) / middle[name] - 1.0)
    for row in rows:
        shifts = {4.0: (4.5,), 5.0: (4.5, 5.5), 6.0: (5.5,)}[row["lateral_shift_mm"]]
        for name, column in (("strip_approach_mm", "approach"), ("strip_stiffness_N_per_mm", "stiffness")):
            interpolation_percent = row[f"strip_{column}_between_percent"]
            assert interpolation_percent == pytest.approx(max(missed[shift, name] for shift in shifts), rel=1e-9)
    assert max(missed.values()) > 10.0
    _, said = contact_table_lines(rows)
    worst = max(row["strip_approach_between_percent"] for row in rows)
    assert f"approach of the strip method up to {worst:.2g} %" in said
    # each patch has its place and angle: at 5 mm the second one lies on the gauge side, and is steeper
    two = by_place[5.0, 40.0]
    assert two["strip_patches"] == 2
    forces = [two[f"patch{n}_normal_force_N"] for n in (1, 2)]
    assert sum(forces) == pytest.approx(two["strip_normal_force_N"], rel=1e-9)
    assert forces[0] > forces[1] > 0.0
    for n in (1, 2):
        angle = two[f"touch{n}_contact_angle_rad"]
        near = min((1, 2), key=lambda k: abs(two[f"patch{k}_rail_y_mm"] - two[f"touch{n}_rail_y_mm"]))
        assert two[f"patch{near}_contact_angle_rad"] == pytest.approx(angle, abs=0.1)


def test_a_table_as_json_is_the_table_alone(capsys):
    assert call(["table", "--shifts", "4", "--loads-kn", "100", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)
    (same,) = fecontact.table(WHEELSET, [4.0], [100e3])
    assert row["strip_p_max_MPa"] == same["strip_p_max_MPa"]


@pytest.mark.parametrize(
    ("rail_radius_mm", "poisson", "columns"),
    [(460.0, 0.25, (4.12, 3.67, 1.47, 1.19)), (460.0, 0.0, (3.4, 3.4, 1.33, 1.21))],
)
def test_a_circle_has_the_row_of_kalkers_table(rail_radius_mm, poisson, columns):
    """Crossed cylinders of equal radius have a circular patch: the row a/b = 1 of Kalker (1990), Table E.3."""
    steel = Material(young_MPa=210e3, poisson=poisson)
    case = replace(ELLIPTIC, rail=f"circle:{rail_radius_mm}", wheel_material=steel, rail_material=steel)
    (row,) = fecontact.table(case, [0.0], [100e3])
    for place in ("hertz", "touch1"):
        kalker = [row[f"{place}_kalker_c{index}"] for index in (11, 22, 23, 33)]
        assert kalker == pytest.approx(columns, rel=1e-6), place
        # the force per creepage by hand, with the semi-axis of the row
        shear = steel.young_MPa / (2.0 * (1.0 + poisson))
        powers = {"f11_N": 2, "f22_N": 2, "f23_Nmm": 3, "f33_Nmm2": 4}
        for (name, power), value in zip(powers.items(), columns, strict=True):
            assert row[f"{place}_{name}"] == pytest.approx(shear * row["hertz_a_mm"] ** power * value, rel=1e-6), name


def test_factors_of_the_table_give_the_linear_creep_force(rows):
    """Each contact point has the ellipse under its share of the load."""
    row = rows[-2]
    assert row["contact_points"] == 2
    creepages = Creepages(xi=1e-5, eta=2e-5, spin_per_mm=3e-6)
    for place in ("touch1", "touch2"):
        axes = {f"{axis}_mm": row[f"{place}_ellipse_{axis}_mm"] for axis in "ab"}
        ellipse = RollingEllipse(
            **axes, normal_force_N=1.0, friction=0.3, shear_MPa=STEEL.shear_MPa, poisson=STEEL.poisson
        )
        force = kalker_linear(ellipse, creepages)
        f11, f22, f23, f33 = (row[f"{place}_{name}"] for name in ("f11_N", "f22_N", "f23_Nmm", "f33_Nmm2"))
        assert force.fx_N == pytest.approx(-f11 * 1e-5, rel=1e-9)
        assert force.fy_N == pytest.approx(-f22 * 2e-5 - f23 * 3e-6, rel=1e-9)
        assert force.mz_Nmm == pytest.approx(f23 * 2e-5 - f33 * 3e-6, rel=1e-9)


def test_beyond_kalkers_table_the_coefficients_are_empty_with_a_reason():
    """A rail of 6 mm below a wheel of 460 mm: the patch is more than 10 times as long as it is wide."""
    (row,) = fecontact.table(replace(ELLIPTIC, rail="circle:6"), [0.0], [1e3])
    assert row["hertz_a_mm"] > 10.0 * row["hertz_b_mm"]
    assert "hertz_kalker_c11" not in row
    assert re.search(r"without Kalker's coefficients: a/b is 1\d\.\d+; allowed: 0.1 to 10", row["hertz_notes"])


YAWS_MRAD = [-10.0, 0.0, 7.0, 10.0]


@pytest.fixture(scope="module")
def yawed_rows():
    return fecontact.table(WHEELSET, [-4.0], [50e3, 60e3], yaws_mrad=YAWS_MRAD)


def test_yaw_is_an_axis_between_shift_and_load(yawed_rows):
    assert [(row["yaw_mrad"], row["load_kN"]) for row in yawed_rows] == [
        (yaw, load) for yaw in YAWS_MRAD for load in (50.0, 60.0)
    ]
    by_line = {(row["yaw_mrad"], row["load_kN"]): row for row in yawed_rows}
    # the yaw of the case gives an equal row, and a table without yaws has the yaw of its case
    (row,) = fecontact.table(replace(WHEELSET, yaw_rad=0.007), [-4.0], [50e3])
    assert row["yaw_mrad"] == 7.0
    neighbours = ("strip_approach_between_percent", "strip_stiffness_between_percent")
    assert row == {name: value for name, value in by_line[7.0, 50.0].items() if name not in neighbours}
    # a yaw and its opposite are mirror images: the rail has equal sections, and the wheel is a body of revolution
    for name in ("roll_mrad", *(f"{theory}_{size}" for theory in ("hertz", "strip") for size in SIZES)):
        left, straight, right = (by_line[yaw, 50.0][name] for yaw in (-10.0, 0.0, 10.0))
        assert left == pytest.approx(right, rel=1e-6), name
        assert straight != pytest.approx(right, rel=1e-6), name


def test_interpolation_between_yaws_is_checked_in_the_middle(yawed_rows):
    by_line = {(row["yaw_mrad"], row["load_kN"]): row for row in yawed_rows}
    (middle,) = fecontact.table(WHEELSET, [-4.0], [55e3], yaws_mrad=[-5.0])
    corners = [by_line[yaw, load]["strip_approach_mm"] for yaw in (-10.0, 0.0) for load in (50.0, 60.0)]
    missed_percent = 100.0 * abs(np.mean(corners) / middle["strip_approach_mm"] - 1.0)
    # -10 mrad has this middle alone
    assert by_line[-10.0, 50.0]["strip_approach_between_percent"] == pytest.approx(missed_percent, rel=1e-9)
    table, *notes = contact_table_lines(yawed_rows)
    assert [row.cells[1] for row in table.rows[::2]] == ["-10.00", "+0.00", "+7.00", "+10.00"]
    assert "midway between rows" in notes[0]
    assert "mrad" in notes[0]


def test_yaws_are_given_once_and_as_a_list(tmp_path, capsys):
    out = tmp_path / "table.csv"
    grid = ["--shifts=-4", "--loads-kn", "50"]
    assert call(["table", *grid, "--yaws-mrad=-10:10:10", "--out", str(out)]) == 0
    assert [row["yaw_mrad"] for row in csv.DictReader(out.read_text("utf-8").splitlines())] == ["-10.0", "0.0", "10.0"]
    assert call(["table", *grid, "--yaws-mrad", "x"]) == 2
    assert "yaws 'x'" in capsys.readouterr().err
    with pytest.raises(InputError, match=r"yaw_rad is 0\.01, and yaws_mrad is given too"):
        fecontact.table(replace(WHEELSET, yaw_rad=0.01), [0.0], [50e3], yaws_mrad=[5.0])
    with pytest.raises(InputError, match="give at least one lateral shift, one yaw and one load"):
        fecontact.table(WHEELSET, [0.0], [50e3], yaws_mrad=[])
    with pytest.raises(InputError, match=r"yaws_mrad is 5\.0; give a list"):
        fecontact.table(WHEELSET, [0.0], [50e3], yaws_mrad=5.0)


@pytest.fixture(scope="module")
def written_table(tmp_path_factory):
    """A table with a problem, two contact points and yaws, as NetCDF, with its rows."""
    path = tmp_path_factory.mktemp("table") / "table.nc"
    grid = ["--shifts=-4,5,40", "--loads-kn", "50", "--yaws-mrad", "0,10", "--roll", "touching"]
    assert call(["table", *grid, "--out", str(path)]) == 3
    return path, fecontact.table(WHEELSET, [-4.0, 5.0, 40.0], [50e3], yaws_mrad=[0.0, 10.0])


@pytest.mark.slow
def test_a_netcdf_file_has_all_rows_without_xarray(written_table):
    path, rows = written_table
    with netcdf_file(path, mmap=False) as file:
        coordinates = {name: list(file.variables[name][:]) for name in TABLE_AXES}
        assert coordinates == {"lateral_shift_mm": [-4.0, 5.0, 40.0], "yaw_mrad": [0.0, 10.0], "load_kN": [50.0]}
        assert set(file.variables) == set(rows[0])
        assert file.variables["strip_stiffness_N_per_mm"].units == b"N mm-1"
        assert file.variables["touch2_f33_Nmm2"].units == b"N mm2"
        inputs = json.loads(file.inputs)
        assert (inputs["wheel"], inputs["roll"]) == ("S1002", "touching")
        assert not {"lateral_shift_mm", "yaw_rad", "load_N"} & set(inputs)
        for row in rows:
            place = tuple(coordinates[name].index(row[name]) for name in TABLE_AXES)
            for name, value in row.items():
                if name in TABLE_AXES:
                    continue
                stored = file.variables[name][:][place]
                if isinstance(value, str):
                    assert b"".join(stored).rstrip(b"\0").decode("utf-8") == value, name
                elif value is None:
                    assert not np.any(stored) if stored.dtype.kind == "S" else np.isnan(stored), name
                else:
                    assert stored == value, name


def test_a_netcdf_file_is_the_data_set_of_the_rows(written_table):
    xarray = pytest.importorskip("xarray")
    path, rows = written_table
    expected = fecontact.to_xarray(rows)
    with xarray.open_dataset(path, engine="scipy") as stored:
        xarray.testing.assert_equal(stored.load(), expected)
        for name in stored.variables:
            assert stored[name].attrs == expected[name].attrs, name
        assert stored.strip_p_max_MPa.dims == TABLE_AXES
        assert stored.strip_p_max_MPa.units == "MPa"
        assert "40 mm of the wheelset" in stored.problem.sel(lateral_shift_mm=40.0, yaw_mrad=10.0).item()
        at_5_mm = stored.strip_patches.sel(lateral_shift_mm=5.0, yaw_mrad=0.0, load_kN=50.0)
    assert at_5_mm == 2


def test_texts_that_are_not_ascii_are_kept(tmp_path):
    texts = ["Schiene Ü", "", "ж"]
    rows = [{"lateral_shift_mm": k, "yaw_mrad": 0.0, "load_kN": 50.0, "problem": t} for k, t in enumerate(texts)]
    path = write_netcdf(arrange_table(rows), tmp_path / "texts.nc")
    with netcdf_file(path, mmap=False) as file:
        stored = [b"".join(line).rstrip(b"\0").decode("utf-8") for line in file.variables["problem"][:, 0, 0]]
    assert stored == texts
    assert find_column_meaning("map_multi_hertz_verdict") == "verdict on the theory multi_hertz; stored map"
    with pytest.raises(ProgramError, match="column touch1_colour is not declared"):
        find_column_meaning("touch1_colour")
    with pytest.raises(InputError, match="the contact table has no rows"):
        arrange_table([])


JUMP_MM = 1.2345


def analytic_row(shift_mm, load_kN=50.0):
    """Row with a curve, a kink, a zero and a jump."""
    row = {
        "lateral_shift_mm": shift_mm,
        "yaw_mrad": 0.0,
        "load_kN": load_kN,
        "problem": "",
        "strip_p_max_MPa": 1000.0 + 50.0 * load_kN * np.exp(-((shift_mm - 0.3) ** 2)),
        "strip_a_mm": 6.0 + abs(shift_mm + 0.77),
        "touch1_contact_angle_rad": 0.1 * np.tanh(shift_mm - 1.0),
        "touch1_rail_y_mm": 10.0 * shift_mm + (20.0 if shift_mm > JUMP_MM else 0.0),
        # a radius that is not checked
        "touch1_rail_radius_mm": 300.0 if shift_mm < -0.5 else 80.0,
    }
    return row | ({"touch2_spring_force_N": 2e4 + 1e3 * shift_mm} if shift_mm > JUMP_MM else {})


def analytic_rows(shifts_mm):
    return [analytic_row(shift_mm, load_kN) for shift_mm in shifts_mm for load_kN in (50.0, 80.0)]


@pytest.mark.parametrize("accuracy_percent", [0.5, 2.0])
def test_interpolation_is_within_the_accuracy_at_random_shifts_except_in_jumps(accuracy_percent):
    rows = refine_shifts([2.0, -2.0, 0.0], analytic_rows, accuracy_percent)
    shifts = np.array([row["lateral_shift_mm"] for row in rows[::2]])
    assert list(shifts) == sorted({-2.0, 0.0, 2.0, *shifts})
    jumps = [row for row in rows if row.get("shift_step_status") == "jump"]
    # one step at each load, with both sides as rows
    assert [(row["load_kN"], row["shift_step_error_column"]) for row in jumps] == [
        (load, "touch2_spring_force_N") for load in (50.0, 80.0)
    ]
    (start,) = {row["lateral_shift_mm"] for row in jumps}
    assert start < JUMP_MM < start + jumps[0]["shift_step_mm"] < start + 2.0 * SMALLEST_STEP_MM
    assert jumps[0]["shift_step_error_percent"] is None
    angle_range = 0.1 * (np.tanh(1.0) - np.tanh(-3.0))
    checked = 0
    for shift in np.random.default_rng(63).uniform(-2.0, 2.0, 50):
        number = int(np.searchsorted(shifts, shift)) - 1
        left, right = rows[2 * number], rows[2 * number + 2]
        if left["shift_step_status"] == "jump":
            continue
        checked += 1
        weight = (shift - shifts[number]) / left["shift_step_mm"]
        exact = analytic_row(shift)
        scales = {"strip_p_max_MPa": exact["strip_p_max_MPa"], "strip_a_mm": exact["strip_a_mm"]}
        for name, scale in (scales | {"touch1_contact_angle_rad": angle_range, "touch1_rail_y_mm": 60.0}).items():
            error = (1.0 - weight) * left[name] + weight * right[name] - exact[name]
            assert 100.0 * abs(error) / scale <= accuracy_percent, (shift, name)
    assert checked >= 49
    # the table states the largest error of its steps, and each jump
    texts = list(contact_table_lines(rows))
    worst = max(row["shift_step_error_percent"] for row in rows if row.get("shift_step_status") == "within accuracy")
    assert 0.0 < worst <= 0.5 * accuracy_percent
    assert f"at the checked shifts between rows: up to {worst:.2g} % (" in texts[1]
    assert texts[2].startswith("do not interpolate in 1 interval of the shift, where the accuracy cannot be reached;")
    assert "their 2 steps have the shift_step_status jump" in texts[2]
    assert re.fullmatch(
        r"  between \+1\.2\d+ and \+1\.2\d+ mm \(50 and 80 kN\): contact point jumps by 20\.[12] mm;"
        " touch2_spring_force_N is missing on one side",
        texts[3],
    )
    # a coarser accuracy needs fewer rows
    assert len(refine_shifts([-2.0, 0.0, 2.0], analytic_rows, 8.0)) < len(rows)


def test_a_table_with_an_accuracy_has_its_steps(capsys):
    """Sphere on a cylindrical rail: equal at all shifts, so that no step is halved."""
    rows = fecontact.table(ELLIPTIC, [0.0, 1.0], [50e3], accuracy_percent=2.0)
    assert [row["lateral_shift_mm"] for row in rows] == [0.0, 1.0]
    assert (rows[0]["shift_step_mm"], rows[0]["shift_step_status"]) == (1.0, "within accuracy")
    assert rows[1]["shift_step_mm"] is None
    assert find_column_meaning("shift_step_error_percent").startswith("largest error of linear interpolation")
    for accuracy in (0.0, 51.0, float("nan"), "x"):
        with pytest.raises(InputError, match=r"accuracy_percent is .*; allowed: 0\.1 to 50"):
            fecontact.table(ELLIPTIC, [0.0, 1.0], [50e3], accuracy_percent=accuracy)
    with pytest.raises(InputError, match="needs at least two lateral shifts"):
        fecontact.table(ELLIPTIC, [0.0], [50e3], accuracy_percent=2.0)
    assert call(["table", "--shifts", "0,1", "--loads-kn", "50", "--accuracy-percent", "0"]) == 2
    assert "accuracy_percent is 0.0; allowed: 0.1 to 50" in capsys.readouterr().err


def interpolated_beside_jumps(case, shifts_mm, accuracy_percent, count, seed):
    """Rows at random shifts beside jumps, with their interpolated values and ranges."""
    rows = fecontact.table(case, shifts_mm, [60e3], accuracy_percent=accuracy_percent)
    shifts = np.array([row["lateral_shift_mm"] for row in rows])
    jumps_mm = sum(row["shift_step_mm"] for row in rows if row["shift_step_status"] == "jump")
    assert jumps_mm < 0.35 * (shifts[-1] - shifts[0])
    ranges = {}
    for name in rows[0]:
        values = [row[name] for row in rows if isinstance(row[name], float)]
        ranges[name] = max(values) - min(values) if values else 0.0
    for shift in np.random.default_rng(seed).uniform(shifts[0], shifts[-1], count):
        number = int(np.searchsorted(shifts, shift)) - 1
        left, right = rows[number], rows[number + 1]
        if left["shift_step_status"] != "jump":
            weight = (shift - shifts[number]) / left["shift_step_mm"]
            (exact,) = fecontact.table(case, [shift], [60e3])
            names = [name for name in exact if isinstance(left[name], float) and isinstance(right[name], float)]
            yield exact, {name: (1.0 - weight) * left[name] + weight * right[name] for name in names}, ranges


POSITIVE_COLUMNS = (
    *(f"{theory}_{size}" for theory in ("hertz", "strip") for size in (*SIZES, "stiffness_N_per_mm")),
    *("hertz_kalker_c11", "hertz_kalker_c22", "hertz_kalker_c23", "hertz_f11_N", "hertz_f33_Nmm2", "springs_p_max_MPa"),
    *("hertz_normal_force_N", "touch1_spring_N_per_mm15", "touch1_ellipse_a_mm", "touch1_ellipse_b_mm"),
)
RANGE_COLUMNS = (
    *("roll_mrad", "touch1_rail_y_mm", "touch1_wheel_y_mm", "touch1_contact_angle_rad", "touch1_rolling_radius_mm"),
    *("strip_t_gamma_N", "hertz_t_gamma_N", "strip_creep_fx_N", "strip_creep_fy_N", "creep_xi", "creep_spin_per_mm"),
)


def check_accuracy(case, shifts_mm, accuracy_percent, count, seed, at_least):
    checked = 0
    limit = 0.01 * accuracy_percent
    for exact, interpolated, ranges in interpolated_beside_jumps(case, shifts_mm, accuracy_percent, count, seed):
        checked += 1
        place = exact["lateral_shift_mm"]
        for name in POSITIVE_COLUMNS:
            if name in interpolated:
                assert interpolated[name] == pytest.approx(exact[name], rel=limit), (place, name)
        for name in RANGE_COLUMNS:
            if name in interpolated:
                assert interpolated[name] == pytest.approx(exact[name], abs=limit * ranges[name] + 1e-9), (place, name)
        centre_error = abs(interpolated["strip_centre_mm"] - exact["strip_centre_mm"])
        assert centre_error <= limit * exact["strip_b_mm"], place
    assert checked >= at_least


def test_a_table_interpolates_with_its_accuracy_at_some_random_shifts():
    """Between 2.3 and 2.8 mm the contact passes a junction of curvatures."""
    check_accuracy(replace(WHEELSET, creep=Creep(friction=0.3)), [2.3, 2.8], 5.0, 8, 64, 5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rail", "wheel", "inclination_rad", "shifts_mm"),
    [
        ("60E1", "S1002", 1 / 40, [1.0, 3.5, 6.0]),
        ("CHN60", "LMA", 1 / 40, [-2.0, 0.0, 2.0]),
        ("54E1", "EN13715_1in40", 1 / 20, [2.0, 4.0]),
    ],
)
def test_a_table_interpolates_with_its_accuracy_at_random_shifts(rail, wheel, inclination_rad, shifts_mm):
    case = Case(rail=rail, wheel=wheel, inclination_rad=inclination_rad, roll="touching", creep=Creep(friction=0.3))
    check_accuracy(case, shifts_mm, 2.0, 50, 63, 30)


def test_a_middle_is_evaluated_once(monkeypatch):
    """Rows in the middle of steps are those between rows: no line is evaluated twice."""
    evaluated = []

    def iterate_and_count(case, shifts_mm, loads_N, yaws_rad):
        evaluated.extend(shifts_mm)
        return iterate_table_rows(case, shifts_mm, loads_N, yaws_rad)

    monkeypatch.setattr(alone, "iterate_table_rows", iterate_and_count)
    monkeypatch.setattr(alone, "compute_strip_stiffness", lambda case: evaluated.append(case.lateral_shift_mm))
    rows = fecontact.table(WHEELSET, [-4.0, -3.0], [50e3], accuracy_percent=1.0)
    # at least the middle and both quarters of each step
    assert len(evaluated) == len(set(evaluated)) >= 4 * len(rows) - 3
    # the error between rows is that of the row in the middle
    (middle,) = fecontact.table(WHEELSET, [0.5 * (rows[0]["lateral_shift_mm"] + rows[1]["lateral_shift_mm"])], [50e3])
    for name, column in (("strip_approach_mm", "approach"), ("strip_stiffness_N_per_mm", "stiffness")):
        error_percent = 100.0 * abs(0.5 * (rows[0][name] + rows[1][name]) / middle[name] - 1.0)
        assert rows[0][f"strip_{column}_between_percent"] == pytest.approx(error_percent, rel=1e-6, abs=1e-9)


def test_a_patch_that_moves_along_a_line_has_jumps_at_its_ends_alone():
    """A second patch from 0.3 to 0.5 mm, with linear place and force.

    Its columns have a common range with patch 1.
    """

    def compute_rows(shifts_mm):
        return [
            {"lateral_shift_mm": shift, "yaw_mrad": 0.0, "load_kN": 50.0, "problem": ""}
            | {"strip_patches": 1.0, "patch1_rail_y_mm": -10.0 * shift, "patch1_normal_force_N": 5e4}
            | (
                {"strip_patches": 2.0, "patch2_rail_y_mm": 20.0 + shift, "patch2_normal_force_N": 1e3 * (shift - 0.3)}
                if 0.3 < shift < 0.5
                else {}
            )
            for shift in shifts_mm
        ]

    rows = refine_shifts([0.0, 1.0], compute_rows, 2.0)
    jumps = [row for row in rows if row.get("shift_step_status") == "jump"]
    assert len(jumps) == 2
    intervals = list_jump_intervals(rows)
    assert [interval.phrases for interval in intervals] == [
        ["number of patches of the strip method changes from 1 to 2"],
        ["number of patches of the strip method changes from 2 to 1"],
    ]
    for place, interval in zip((0.3, 0.5), intervals, strict=True):
        assert interval.start_mm <= place <= interval.end_mm <= interval.start_mm + 2.0 * SMALLEST_STEP_MM


def test_jumps_are_intervals_of_at_most_twenty_lines():
    """25 intervals of three steps each at two loads: five are counted, the rest has a line each."""
    rows = [
        {"lateral_shift_mm": 0.01 * number, "yaw_mrad": 0.0, "load_kN": load_kN, "problem": ""}
        | {"touch1_rail_y_mm": 5.0 * (number // 4), "shift_step_mm": 0.01, "shift_step_error_column": "strip_a_mm"}
        | {"shift_step_status": "within accuracy" if number % 4 == 0 else "jump"}
        | {"shift_step_error_percent": 0.5 if number % 4 == 0 else 3.0 + 0.1 * number}
        for number in range(100)
        for load_kN in (50.0, 80.0)
    ] + [{"lateral_shift_mm": 1.0, "yaw_mrad": 0.0, "load_kN": load, "problem": ""} for load in (50.0, 80.0)]
    head, *texts, last = describe_jumps(rows, "table.csv")
    assert head == (
        "do not interpolate in 25 intervals of the shift, where the accuracy cannot be reached; their 150 steps have"
        " the shift_step_status jump in table.csv"
    )
    assert len(texts) == 20
    # the last interval has no jump of the contact point
    assert texts[-1] == (
        "  between +0.930 and +0.960 mm (50 and 80 kN): contact point jumps by 5.0 mm; strip_a_mm is off by up to 12 %"
    )
    assert texts[0].startswith("  between +0.170 and +0.200 mm (50 and 80 kN): contact point jumps by 5.0 mm;")
    assert last == "  and 5 further intervals"


def test_t_gamma_in_a_table_is_that_of_the_ellipse(tmp_path, capsys):
    """Where Hertz is exact the strips are the ellipse; with small creepage the force is Kalker's."""
    xi = 2e-5
    case = replace(ELLIPTIC, creep=Creep(friction=0.3, xi=xi, eta=0.0, spin_per_mm=0.0))
    (row,) = fecontact.table(case, [0.0], [100e3])
    # the saturation of FASTSIM takes 0.5 % at this creepage, and its cells 0.1 %
    assert row["hertz_t_gamma_N"] == pytest.approx(row["hertz_f11_N"] * xi**2, rel=0.01)
    assert row["hertz_creep_fx_N"] == pytest.approx(-row["hertz_t_gamma_N"] / xi, rel=1e-9)
    large = replace(case, creep=replace(case.creep, xi=1e-3, eta=-5e-4, spin_per_mm=2e-4))
    (row,) = fecontact.table(large, [0.0], [100e3])
    axes = {f"{axis}_mm": row[f"hertz_{axis}_mm"] for axis in "ab"}
    alone_record = fecontact.creep(
        **axes, normal_force_N=100e3, friction=0.3, creepages=(1e-3, -5e-4, 2e-4), theories=["fastsim"]
    )
    force = alone_record["theories"]["fastsim"]
    for name in ("fx_N", "fy_N", "mz_Nmm"):
        assert row[f"hertz_creep_{name}"] == pytest.approx(force[name], rel=1e-9), name
        # strips of equal pressure, cut out of a grid
        assert row[f"strip_creep_{name}"] == pytest.approx(force[name], rel=0.02), name
    assert row["hertz_t_gamma_N"] == pytest.approx(force["power_per_speed_N"], rel=1e-9)
    assert row["strip_t_gamma_N"] == pytest.approx(force["power_per_speed_N"], rel=0.02)
    assert (row["creep_xi"], row["creep_eta"], row["creep_spin_per_mm"], row["creep_notes"]) == (1e-3, -5e-4, 2e-4, "")
    out = tmp_path / "table.nc"
    command = ["table", "--shifts=-4", "--loads-kn=50", "--friction=0.3", f"--out={out}"]
    assert call(command) == 0
    assert "T-gamma" in capsys.readouterr().out
    with netcdf_file(out, mmap=False) as file:
        assert file.variables["strip_t_gamma_N"].units == b"N"
        assert file.variables["creep_spin_per_mm"].units == b"mm-1"
        # a wheelset without yaw has no lateral creepage, and the spin of its contact angle
        assert float(file.variables["creep_eta"][0, 0, 0]) == pytest.approx(0.0, abs=1e-12)
        angle = float(file.variables["touch1_contact_angle_rad"][0, 0, 0])
        roll = 1e-3 * float(file.variables["roll_mrad"][0, 0, 0])
        spin = float(file.variables["creep_spin_per_mm"][0, 0, 0])
        assert spin == pytest.approx(-np.sin(angle - roll) / 460.0, rel=1e-6)
    assert "hertz_t_gamma_N" not in fecontact.table(ELLIPTIC, [0.0], [100e3])[0]
    assert call(["table", "--shifts=-4", "--loads-kn=50", "--xi=0.001"]) == 2
    assert "but no friction coefficient is given" in capsys.readouterr().err


@pytest.mark.slow
def test_the_example_of_the_guide_reads_a_table(tmp_path, monkeypatch):
    """As it stands, on a part of the table of the command above it."""
    code = read_page("maps").partition("```python")[2].partition("```")[0]
    monkeypatch.chdir(tmp_path)
    assert call(["table", "--shifts=-5:5:1", "--loads-kn", "50,100", "--out", "table.csv"]) == 0
    names: dict = {}
    exec(compile(code, "maps.md", "exec"), names)
    # between two lines, and on one
    approach, stiffness = names["contact"](4.0, 100e3)
    (row,) = fecontact.table(WHEELSET, [4.0], [100e3])
    assert (approach, stiffness) == pytest.approx((row["strip_approach_mm"], row["strip_stiffness_N_per_mm"]), rel=1e-6)
    (between,) = fecontact.table(WHEELSET, [-3.5], [70e3])
    # straight between 1 mm and 50 kN
    assert names["contact"](-3.5, 70e3)[0] == pytest.approx(between["strip_approach_mm"], rel=0.02)


def test_the_map_has_its_column_also_where_it_does_not_have_the_first_line():
    place = {"problem": "", "load_kN": 50.0}
    lines = [{**place, "lateral_shift_mm": 0.0}, {**place, "lateral_shift_mm": 1.0, "map_cheapest_theory": "hertz"}]
    (summary,) = contact_table_lines(lines)
    assert summary.columns[-1].heading == "map: cheapest"
    assert [row.cells[-1] for row in summary.rows] == ["-", "Hertz"]
    (alone,) = contact_table_lines(lines[:1])
    assert alone.columns[-1].heading == "cheapest within criteria"
