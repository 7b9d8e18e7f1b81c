"""Both wheels of a wheelset against single solutions of each wheel."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

import fecontact
from fecontact.bodies import Track
from fecontact.case import Case, Opposite
from fecontact.cli import call
from fecontact.criteria import Creep
from fecontact.errors import ConvergenceError, InputError
from fecontact.placement.irregularity import parse_irregularity
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.reading import Reading
from fecontact.profiles.writers import sample_points
from fecontact.solving import wheelset_solution
from fecontact.solving.placing import compute_roll, place_case
from fecontact.solving.wheelset_solution import list_wheelset_cases, solve_wheelset

POSITION = {"lateral_shift_mm": 2.0, "yaw_rad": 2e-3, "load_N": 80e3}
RESULTS = ("fe_", "hertz_", "creep_", "strip_", "half_space_")
QUICK = {"resolution": "quick", "refine": "never"}
# half models, which take half of the time of whole models; a yaw is solved in a slow test
WITHOUT_YAW = Case(lateral_shift_mm=2.0, load_N=80e3, **QUICK, creep=Creep(friction=0.3))


def place_both(case):
    """Placement of the left wheel and of the right wheel."""
    return {side: place_case(wheel_case) for side, wheel_case in list_wheelset_cases(case).items()}


def mirror(case):
    """Mirror image of a case at the vertical plane along the track."""
    return replace(
        case,
        side="right" if case.side == "left" else "left",
        lateral_shift_mm=-case.lateral_shift_mm,
        yaw_rad=-case.yaw_rad,
        roll_rad=-case.roll_rad,
    )


WHEELSETS = {
    "touching": Case(**POSITION),
    "loaded": Case(**POSITION, roll="loaded"),
    "unequal loads": Case(**POSITION, opposite=Opposite(wheel_load_N=50e3)),
    "load of the roll": Case(**POSITION, roll_load_N=60e3, opposite=Opposite(wheel_load_N=50e3)),
    "given": Case(**POSITION, roll_rad=2e-4),
    "unequal radii": Case(**POSITION, opposite=Opposite(rolling_radius_mm=459.5)),
    "unequal rails": Case(**POSITION, opposite=Opposite(rail="54E1"), inclination_rad=1 / 20),
}


@pytest.mark.parametrize("name", WHEELSETS)
@pytest.mark.parametrize("side", ["left", "right"])
def test_both_wheels_are_those_of_one_wheelset(name, side):
    """Both wheels share an axle with its roll, and the other case leads back."""
    case = replace(WHEELSETS[name], side=side)
    cases = list_wheelset_cases(case)
    assert list(cases) == ["left", "right"]
    assert cases[side] is case
    rolls = [compute_roll(wheel_case, place_case(wheel_case)) for wheel_case in cases.values()]
    # the searches of the roll begin from different wheels
    assert rolls[0] == pytest.approx(rolls[1], abs=1e-9)
    back_case = list_wheelset_cases(cases["right" if side == "left" else "left"])[side]
    first, again = place_case(case).first, place_case(back_case).first
    assert (again.rail_y_mm, again.wheel_y_mm) == pytest.approx((first.rail_y_mm, first.wheel_y_mm), abs=1e-6)
    assert back_case.roll_loads_N() == case.roll_loads_N()
    # the opposite load is the load of the other wheel, also if the roll of this wheel has a different load
    assert cases["right" if side == "left" else "left"].load_N == (case.opposite.wheel_load_N or case.load_N)
    assert back_case.load_N == (case.roll_load_N or case.load_N)


def test_each_side_has_its_own_inputs():
    case = Case(**POSITION, roll="loaded", opposite=Opposite(rail="60E2", rolling_radius_mm=459.0, wheel_load_N=70e3))
    other_case = list_wheelset_cases(case)["right"]
    assert (other_case.side, other_case.rail, other_case.rolling_radius_mm) == ("right", "60E2", 459.0)
    assert (other_case.load_N, other_case.opposite.wheel_load_N) == (70e3, 80e3)
    assert (other_case.opposite.rail, other_case.opposite.rolling_radius_mm) == (case.rail, 460.0)
    # without a load of the roll both loads are those of the wheels
    assert other_case.roll_load_N is None


def test_the_file_of_each_side_is_read_with_its_own_options(tmp_path):
    """Points of an S1002 in mm and in cm are equal wheels."""
    points = sample_points(load_library_profile("S1002"))
    for name, scale in (("mm", 1.0), ("cm", 0.1)):
        np.savetxt(tmp_path / f"{name}.csv", scale * points, delimiter=",", header=f"y [{name}],z [{name}]")
    options = {name: Reading(units=name, filter_mm=0.0) for name in ("mm", "cm")}
    opposite = Opposite(wheel=str(tmp_path / "cm.csv"), wheel_file=options["cm"])
    case = Case(**POSITION, wheel=str(tmp_path / "mm.csv"), wheel_file=options["mm"], opposite=opposite)
    cases = list_wheelset_cases(case)
    assert [wheel_case.wheel_file for wheel_case in cases.values()] == [options["mm"], options["cm"]]
    assert cases["right"].opposite.wheel_file == options["mm"]
    for side, placement in place_both(case).items():
        alone = place_case(replace(Case(**POSITION, wheel=case.wheel, wheel_file=options["mm"]), side=side))
        assert placement.first.rail_y_mm == pytest.approx(alone.first.rail_y_mm, abs=1e-6), side


@pytest.mark.parametrize("name", WHEELSETS)
def test_the_mirror_image_has_mirrored_wheels(name):
    case = WHEELSETS[name]
    wheels, mirrored = place_both(case), place_both(mirror(case))
    for side, opposite_side in (("left", "right"), ("right", "left")):
        first, second = wheels[side].first, mirrored[opposite_side].first
        assert first.rail_y_mm == pytest.approx(second.rail_y_mm, abs=1e-6)
        assert first.contact_angle_rad == pytest.approx(second.contact_angle_rad, abs=1e-8)


@pytest.mark.parametrize(
    ("case", "message"),
    [
        (Case(rail="circle:300", wheel="cylinder:460"), "cylinder:460 on circle:300 has no wheelset"),
        (Case(creep=Creep(friction=0.3, xi=1e-3)), "xi is 0.001, but creepages belong to a single wheel; leave them"),
        (Case(creep=Creep(friction=0.3, spin_per_mm=0.0)), "spin is 0, but creepages belong to a single wheel"),
        (
            Case(wheel_irregularity=parse_irregularity("sine:wavelength_mm=30,amplitude_um=25")),
            "belong to a single wheel; solve each wheel",
        ),
    ],
)
def test_inputs_of_a_single_wheel_are_refused(case, message):
    with pytest.raises(InputError, match=message):
        list_wheelset_cases(case)


@pytest.fixture(scope="module")
def single_results():
    """Result of each wheel, solved alone."""
    return {side: fecontact.solve(wheel_case) for side, wheel_case in list_wheelset_cases(WITHOUT_YAW).items()}


def test_a_wheelset_is_two_single_solutions(single_results, tmp_path, capsys):
    out = tmp_path / "out"
    options = ["--shift=2", "--load-kn=80", "--resolution=quick", "--refine=never", "--friction=0.3"]
    assert call(["solve", *options, "--wheelset", "--set-in=CONTACT", f"--out={out}"]) == 0
    printed = capsys.readouterr().out
    with (out / "wheelset.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    record = json.loads((out / "wheelset.json").read_text("utf-8"))
    t_gamma_N = {"hertz": 0.0, "fe": 0.0}
    for row, (side, result) in zip(rows, single_results.items(), strict=True):
        stored = fecontact.load(out / side)
        assert np.array_equal(stored.pressure_MPa, result.pressure_MPa)
        assert record[side]["case"]["side"] == row["side"] == side
        assert record[side]["verdict"]["answer"] == result.verdict.answer
        (single_row,) = fecontact.rows(result)
        names = [name for name, value in single_row.items() if isinstance(value, float) and name.startswith(RESULTS)]
        assert len(names) > 50
        for name in names:
            assert float(row[name]) == single_row[name], name
        law = result.load.features["creep"].theories["rolling_half_space"]
        for contact, force in (("hertz", law.hertz), ("fe", law.fe)):
            stored_force = record[side]["creep"]["theories"]["rolling_half_space"][contact]
            assert (stored_force["fx_N"], stored_force["mz_Nmm"]) == (force.fx_N, force.mz_Nmm)
            t_gamma_N[contact] += force.power_per_speed_N
        assert f"Fx {1e-3 * law.fe.fx_N:+.3f} kN" in printed
    assert (out / "report.html").is_file()
    answers = [result.verdict.answer for result in single_results.values()]
    head, total = record["answer"]
    assert head == (
        f"wheelset: Hertz holds for {answers.count('HOLDS')} of 2 wheels (left wheel {answers[0]}, right wheel"
        f" {answers[1]})"
    )
    deviation_percent = 100.0 * (t_gamma_N["hertz"] / t_gamma_N["fe"] - 1.0)
    assert total.startswith(f"T-gamma of 2 wheels: {t_gamma_N['fe']:.2f} N (Hertz {deviation_percent:+.1f} %")
    assert head in printed.splitlines()
    assert total in printed.splitlines()
    # the numbers to set are printed for each wheel
    assert printed.count("CONTACT") >= 2
    # the same folders are used again for the same wheelset alone
    assert call(["solve", "--shift=3", "--wheelset", f"--out={out}"]) == 2
    assert "--force" in capsys.readouterr().err


@pytest.mark.slow
def test_yawed_wheelsets_are_two_single_solutions_and_have_mirror_images():
    case = replace(WITHOUT_YAW, yaw_rad=POSITION["yaw_rad"])
    wheelset, mirrored = solve_wheelset(case), solve_wheelset(mirror(case))
    for side, opposite_side in (("left", "right"), ("right", "left")):
        result, image = wheelset[side], mirrored[opposite_side]
        alone = fecontact.solve(list_wheelset_cases(case)[side])
        assert np.array_equal(alone.pressure_MPa, result.pressure_MPa)
        assert not result.case.half
        assert image.verdict.answer == result.verdict.answer
        # the meshes are equal up to the rounding of the roll
        assert image.pressure_MPa.max() == pytest.approx(result.pressure_MPa.max(), rel=1e-5)
        force, image_force = (
            solved_wheel.load.features["creep"].theories["rolling_half_space"].fe for solved_wheel in (result, image)
        )
        # in the frame of the left side
        for component in ("fx_N", "fy_N", "mz_Nmm", "power_per_speed_N"):
            assert getattr(image_force, component) == pytest.approx(getattr(force, component), rel=1e-3), component


def fail_on(side, error, single_results):
    """Stored solutions of both wheels, with an error for a side."""

    def solve(case, *, progress=None):
        if case.side == side or side == "both":
            raise error
        return single_results[case.side]

    return solve


@pytest.mark.parametrize("error", [InputError("the wheel does not stand"), ConvergenceError("the search stalls")])
def test_a_wheel_that_cannot_be_solved_is_stated(error, single_results, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(wheelset_solution, "solve", fail_on("right", error, single_results))
    out = tmp_path / "out"
    assert call(["solve", "--shift=2", "--wheelset", f"--out={out}"]) == 3
    printed = capsys.readouterr()
    assert f"1 of 2 wheels not solved:\n  right wheel: {error}" in printed.err
    assert f"right wheel failed: {error})" in printed.out
    assert "T-gamma of 1 of 2 wheels" in printed.out
    record = json.loads((out / "wheelset.json").read_text("utf-8"))
    assert record["right"] == {"status": f"failed: {error}"}
    assert record["left"]["status"] == "converged"
    monkeypatch.setattr(wheelset_solution, "solve", fail_on("both", error, single_results))
    with pytest.raises(type(error), match=str(error)):
        solve_wheelset(Case(track=Track()))
