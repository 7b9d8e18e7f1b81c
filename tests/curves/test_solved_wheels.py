"""Wheels of a curve as cases for finite elements.

The references are the strip theory in the curve itself, mirrored curves, and rows that are made here.
"""

import csv
import json
import math
from dataclasses import replace

import pytest
from marks import slow_but

import fecontact
from fecontact.case import Case
from fecontact.cli import call
from fecontact.features.curves import solved_wheels
from fecontact.features.curves.solved_wheels import (
    NOT_SOLVED,
    SolvedWheels,
    describe_solved_wheels,
    list_wheels,
    make_solved_rows,
    solve_wheels,
)
from fecontact.features.curves.visits import NO_EQUILIBRIUM
from fecontact.runs.identity import make_case_id
from fecontact.runs.study import StudyOutcome
from fecontact.solving.alone import iterate_table_rows
from fecontact.solving.placing import place_case

PAIR = {"rail": "60E1", "wheel": "S1002"}


def run(radii=(700.0,), **inputs):
    return fecontact.curve("wheelset", radii, case=Case(**PAIR, **inputs), theories=["strip"])


@pytest.mark.parametrize("inclination_rad", slow_but([1 / 40, 1 / 20], 0))
def test_a_case_has_the_contact_of_the_curve(inclination_rad):
    results = run((1500.0, -900.0), inclination_rad=inclination_rad)
    wheels = list_wheels(results)
    patches = [
        wheel.patches for curve in results.runs["strip"] for wheelset in curve.wheelsets for wheel in wheelset.wheels
    ]
    assert len(wheels) == len(patches) == 4
    for wheel, (patch, *more_patches) in zip(wheels, patches, strict=True):
        contact = fecontact.theory(wheel.case, "strip")
        # the shared load of several patches is the sum of their vertical components
        vertical = sum(force.normal_force_N * math.cos(force.angle_rad) for force in (patch, *more_patches))
        assert wheel.case.load_N == pytest.approx(vertical, rel=1e-12)
        contact_angle = place_case(wheel.case).first.contact_angle_rad
        if not more_patches:
            # the angle is that of the first contact point, and in the curve that of the centre of pressure, on R 300
            # within 7 mm; a yaw turns the normal out of the cross-section
            assert contact["normal_force_N"] * math.cos(contact_angle) == pytest.approx(vertical, rel=5e-4)
            assert contact_angle == pytest.approx(patch.angle_rad, abs=7 / 300)


@pytest.mark.parametrize("inclination_rad", slow_but([1 / 40, 1 / 20], 0))
def test_a_case_has_the_creep_forces_of_the_curve(inclination_rad):
    """Strips of the case with its creepages have the forces that balance the vehicle.

    The vehicle has the motion of each strip, and the case the creepages at its first contact point and the curved
    surfaces: midway between the heights of the axle at touch and under load. Without this middle 750 N along the rail
    remain, 4 % of mu N. With three patches one of them is on the flange root.
    """
    table_forces = pytest.importorskip("fecontact.features.creep.table_forces")
    results = run((700.0, -400.0), inclination_rad=inclination_rad)
    wheel_runs = [wheel for curve in results.runs["strip"] for wheelset in curve.wheelsets for wheel in wheelset.wheels]
    for wheel, wheel_run in zip(list_wheels(results), wheel_runs, strict=True):
        (row,) = iterate_table_rows(wheel.case, [wheel.case.lateral_shift_mm], [wheel.case.load_N])
        columns = table_forces.make_force_columns(row)
        patch_count = len(wheel_run.patches)
        limit_percent = {1: 1.5, 2: 1.0, 3: 6.5}[patch_count]
        assert columns["strip_t_gamma_N"] == pytest.approx(wheel_run.t_gamma_N, rel=0.01 * limit_percent, abs=0.002)
        if patch_count < 3:
            # measured: 7 and 16 N of 18 kN
            along_N = sum(patch.fx_N for patch in wheel_run.patches)
            assert columns["strip_creep_fx_N"] == pytest.approx(along_N, abs=20.0)


def test_a_curve_to_the_other_side_exchanges_the_wheels():
    right, left = list_wheels(run((900.0,))), list_wheels(run((-900.0,)))
    assert [wheel.is_outer for wheel in right] == [True, False]
    assert [wheel.is_outer for wheel in left] == [False, True]
    for wheel, mirrored in zip(right, left[::-1], strict=True):
        assert wheel.case.load_N == pytest.approx(mirrored.case.load_N, rel=1e-6)
        assert wheel.case.lateral_shift_mm == pytest.approx(-mirrored.case.lateral_shift_mm, abs=1e-5)
        assert wheel.case.yaw_rad == pytest.approx(-mirrored.case.yaw_rad, abs=1e-8)
        places = [place_case(case).first for case in (wheel.case, mirrored.case)]
        assert places[0].contact_angle_rad == pytest.approx(places[1].contact_angle_rad, abs=1e-6)
        assert wheel.case.creep.xi == pytest.approx(mirrored.case.creep.xi, rel=1e-4, abs=1e-9)
        assert wheel.case.creep.eta == pytest.approx(mirrored.case.creep.eta, rel=1e-4, abs=1e-9)


def answered(results, *answers, theory="kpec"):
    """The wheels of a curve with planted answers."""
    wheels = list_wheels(results)
    rows = [
        {"status": "converged", "verdict_answer": "HOLDS", "cheapest_theory": "hertz"}
        if answer == "HOLDS"
        else {"status": "no convergence"}
        if answer == NOT_SOLVED
        else {
            "status": "converged",
            "verdict_answer": answer,
            "verdict_measure": "p_max_MPa",
            "hertz_deviation_p_max_percent": -12.5,
            "hertz_uncertainty_p_max_percent": 0.4,
            "cheapest_theory": theory,
            "cheapest_theory_status": "solved",
            f"{theory}_deviation_p_max_percent": 0.5,
            f"{theory}_deviation_area_percent": -1.0,
            f"{theory}_limit_utilisation": 0.2,
        }
        for answer in answers
    ]
    share = 1.0 - sum(wheel.share for wheel in wheels)
    return SolvedWheels(theory="strip", wheels=wheels, rows=tuple(rows), share_without=share, outcome=None)


def test_the_answer_names_the_wheels_and_what_to_use_there():
    judged_wheels = answered(run(), "FAILS", "HOLDS")
    first, second = describe_solved_wheels(judged_wheels)
    assert first == "R 700 m: Hertz holds for 1 of 2 wheels"
    assert second.startswith("  outer wheel of wheelset 1 (left): Hertz FAILS; peak pressure -12.5")
    assert "cheapest theory that holds: KPEC (p_max +0.5 %" in second
    rows = make_solved_rows(judged_wheels)
    assert [row["share_of_distance_percent"] for row in rows] == [50.0, 50.0]
    assert [row["radius_m"] for row in rows] == [700.0, 700.0]


def test_shares_of_the_distance_follow_the_shares_of_the_radii():
    results = run({1500.0: 3.0, -900.0: 1.0})
    judged_wheels = answered(results, "HOLDS", "HOLDS", "FAILS", NOT_SOLVED)
    assert judged_wheels.shares() == pytest.approx({"HOLDS": 0.75, "FAILS": 0.125, NOT_SOLVED: 0.125})
    *_, last = describe_solved_wheels(judged_wheels)
    assert last == "over the distance of all wheels: HOLDS 75 %, FAILS 12.5 %, not solved 12.5 %"


def test_a_curve_without_equilibrium_has_its_share():
    results = run({1500.0: 1.0, -900.0: 1.0})
    (first, second) = results.runs["strip"]
    lost = replace(results, runs={"strip": (first, replace(second, status="no equilibrium", wheelsets=()))})
    assert not lost.runs["strip"][1].is_balanced
    judged_wheels = answered(lost, "HOLDS", "HOLDS")
    assert judged_wheels.shares() == pytest.approx({"HOLDS": 0.5, NO_EQUILIBRIUM: 0.5})


def remove_contact(results, side):
    """Results in which a wheel has no contact."""
    (curve,) = results.runs["strip"]
    (wheelset,) = curve.wheelsets
    wheels = tuple(replace(wheel, patches=()) if wheel.side == side else wheel for wheel in wheelset.wheels)
    return replace(results, runs={"strip": (replace(curve, wheelsets=(replace(wheelset, wheels=wheels),)),)})


def creep_record(hertz_N, fe_N, uncertainty_percent):
    """Record of creep forces with T-gamma on both patches."""
    law = {
        "hertz": {"power_per_speed_N": hertz_N},
        "fe": {"fx_N": -1e3, "fy_N": 2e3, "mz_Nmm": 3e3, "power_per_speed_N": fe_N, "problem": None},
        "deviation_of_muN": 0.02,
        "uncertainty_of_muN": 0.001,
        "t_gamma_deviation_percent": 100.0 * (hertz_N / fe_N - 1.0),
        "t_gamma_uncertainty_percent": uncertainty_percent,
    }
    creepages = {"xi": 1e-3, "eta": -1e-3, "spin_per_mm": 0.0}
    verdict = {"answer": "HOLDS", "cause": None, "limit_of_muN": 0.05}
    verdict |= {"deviation_of_muN": 0.03, "uncertainty_of_muN": 0.002}
    return {"theories": {"rolling_half_space": law}, "verdict": verdict, "creepages": creepages, "decided": [creepages]}


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_wheel_without_contact_is_stated_and_the_other_is_solved(side, monkeypatch, tmp_path):
    pytest.importorskip("fecontact.features.creep")
    results = remove_contact(run(), side)
    wheels = list_wheels(results)
    solved_cases = []

    def solve_cases(study, out, **_):
        solved_cases.extend(study.cases)
        rows = [{"id": make_case_id(case), "status": "converged", "verdict_answer": "HOLDS"} for case in study.cases]
        for row in rows:
            path = out / "cases" / row["id"] / "result.json"
            path.parent.mkdir(parents=True)
            path.write_text(json.dumps({"creep": creep_record(9.0, 10.0, 4.0)}), "utf-8")
        return StudyOutcome(rows=tuple(rows), conclusion=None)

    monkeypatch.setattr(solved_wheels, "run_study", solve_cases)
    judged_wheels = solve_wheels(results, tmp_path)
    assert [case.side for case in solved_cases] == [wheel.side for wheel in wheels if wheel.side != side]
    assert not judged_wheels.all_converged
    assert judged_wheels.shares() == pytest.approx({"HOLDS": 0.5, NOT_SOLVED: 0.5})
    sentences = describe_solved_wheels(judged_wheels)
    assert sentences[0] == "R 700 m: Hertz holds for 1 of 2 wheels"
    (lost,) = [sentence for sentence in sentences if "not solved" in sentence]
    assert lost.startswith(f"  {'outer' if side == 'left' else 'inner'} wheel of wheelset 1 ({side}): not solved: the")
    assert "has no contact in this curve" in lost
    assert sentences[-1] == "  T-gamma of 1 of 2 wheels: 10.00 N (Hertz -10.0 % ± 4.0 %)"
    rows = make_solved_rows(judged_wheels)
    assert len(rows) == 2
    (lost_row,) = [row for row in rows if row["status"].startswith("failed: the wheel has no contact")]
    assert lost_row["share_of_distance_percent"] == 50.0


def test_the_sum_of_t_gamma_adds_the_wheels_and_their_uncertainties():
    """12 + 30 N of Hertz against 10 + 40 N.

    The uncertainties of 5 and 2 % are 0.5 and 0.8 of 50 N.
    """
    pytest.importorskip("fecontact.features.creep")
    records = [{"creep": creep_record(12.0, 10.0, 5.0)}, {"creep": creep_record(30.0, 40.0, 2.0)}]
    judged_wheels = replace(answered(run(), "HOLDS", "HOLDS"), records=tuple(records))
    sentences = describe_solved_wheels(judged_wheels)
    assert sentences[-1] == "  T-gamma of 2 wheels: 50.00 N (Hertz -16.0 % ± 2.6 %)"
    # each wheel has its sentences of a single solution
    forces = "Fx -1.000 kN, Fy +2.000 kN, Mz +3.00 N m (Hertz differs by 2.0 ± 0.1 % of mu N)"
    assert [sentence.partition(": ")[2] for sentence in sentences if "T-gamma 1" in sentence] == [
        f"{forces}, T-gamma 10.00 N (Hertz +20.0 % ± 5.0 %)"
    ]
    without_uncertainty = replace(judged_wheels, records=(records[0], {"creep": creep_record(30.0, 40.0, None)}))
    assert describe_solved_wheels(without_uncertainty)[-1] == "  T-gamma of 2 wheels: 50.00 N (Hertz -16.0 %)"
    assert not any(
        "T-gamma" in sentence for sentence in describe_solved_wheels(replace(without_uncertainty, records=(None, None)))
    )


def test_solving_needs_a_folder(capsys):
    assert call(["curve", "--vehicle", "wheelset", "--radii", "700", "--solve"]) == 2
    assert "--solve needs a folder for the solved wheels; give --out FOLDER" in capsys.readouterr().err


@pytest.mark.slow
def test_one_command_goes_from_the_vehicle_to_the_verdict(tmp_path, capsys):
    command = ["curve", "--vehicle=wheelset", "--radii=-1500", "--theory=strip", "--solve", f"--out={tmp_path / 'out'}"]
    assert call([*command, "--refine=never", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    answer = record["solved_wheels"]
    assert sum(answer["shares"].values()) == pytest.approx(1.0)
    assert answer["answer"][0].startswith("R -1500 m: Hertz holds for ")
    with (tmp_path / "out" / "wheels.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    wheels = list_wheels(run((-1500.0,)))
    assert len(rows) == len(wheels) == 2
    # each verdict is that of a single solution of the same case
    (alone,) = fecontact.rows(fecontact.solve(replace(wheels[0].case, refine="never")))
    assert rows[0]["verdict_answer"] == alone["verdict_answer"]
    assert float(rows[0]["fe_p_max_MPa"]) == pytest.approx(alone["fe_p_max_MPa"], rel=1e-4)
