"""Each study in its quick size, run from the command line, with its findings."""

import importlib.util
import json
import math
import tomllib
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from inline import inline_crew, study_by
from pictures import draw_nothing

from fecontact.bodies import Track
from fecontact.case import Case
from fecontact.contact_theories.hertz import hertz_ellipse
from fecontact.errors import CoverageError
from fecontact.inputs.texts import parse_inclination
from fecontact.judging.measures import MEASURES, UNCERTAINTIES
from fecontact.judging.uncertainty import MESH_RATIO
from fecontact.profiles.library import find_group, list_names, load_library_profile, toml_text
from fecontact.profiles.resolve import resolve_rail
from fecontact.regression.compare import compare_tables
from fecontact.regression.tables import load_table
from fecontact.runs.casefile import load_study
from fecontact.solving.fine_zone import make_fine_zone
from fecontact.solving.meshes import CoupledMesh, couple_bodies
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space, expect_position, make_true_gap

STUDIES = Path(__file__).parents[1] / "studies"
BASELINES = STUDIES / "baselines"


def module(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"study_{name}", STUDIES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    loaded_module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded_module)
    return loaded_module


@pytest.fixture(autouse=True)
def _no_pictures(monkeypatch, solved):
    """Suppress all pictures except those that studies draw themselves.

    Cases that other tests solve too are solved only once.
    """
    draw_nothing(monkeypatch)
    monkeypatch.setattr("fecontact.runs.store.solve", solved)


Quick = Callable[[str, Path], tuple[list[dict[str, Any]], str]]


def baseline_checks(name: str, out: Path) -> tuple[list[dict[str, Any]], str]:
    """Checks of a study on the rows of its baseline."""
    rows = [
        {column: _value(column, text) for column, text in row.items()}
        for row in load_table(BASELINES / f"{name}.csv").rows.to_dict("records")
    ]
    study = module(name)
    if hasattr(study, "checks"):
        assert [check for check in study.checks(rows) if not check.passed] == []
    return rows, study.conclude(rows, out)


def _value(column: str, text: str) -> str | float | bool | None:
    """Value of a cell of a table: text, number, truth value or None."""
    if column in ("id", "rail", "wheel"):
        # 60E1 is no number
        return text
    if text in ("", "True", "False"):
        return {"": None, "True": True, "False": False}[text]
    try:
        return float(text)
    except ValueError:
        return text


# `make regress` solves all of them
@pytest.fixture(params=["of its baseline", pytest.param("solved", marks=pytest.mark.slow)])
def quick(request) -> Quick:
    """Rows of a study in its quick size, and its checks of them."""
    return baseline_checks if request.param == "of its baseline" else run_quick


def run_quick(name: str, out: Path) -> tuple[list[dict[str, Any]], str]:
    """Run a quick study, and compare it with its baseline and its checks."""
    outcome = study_by(load_study(STUDIES / f"{name}.py", quick=True), out, crew=inline_crew())
    assert outcome.all_converged
    comparison = compare_tables(load_table(BASELINES / f"{name}.csv"), load_table(out))
    assert comparison.same, comparison.verdict
    assert outcome.conclusion is not None
    study = module(name)
    if hasattr(study, "checks"):
        checks = study.checks(list(outcome.rows))
        assert checks
        assert [check for check in checks if not check.passed] == []
    return list(outcome.rows), outcome.conclusion


def test_01_elliptic_hertz(tmp_path):
    rows, said = run_quick("01_elliptic_hertz", tmp_path)
    # the deviations themselves are checks of the study
    assert {row["verdict_answer"] for row in rows} == {"HOLDS"}
    assert "Largest deviations from Hertz" in said


def test_02_independence(quick, tmp_path):
    (base, deeper, longer), said = quick("02_independence", tmp_path)
    # more rail below the contact gives way as well, more of it beside hardly: measured 4.9 and 0.3 %
    assert deeper["fe_approach_mm"] / base["fe_approach_mm"] == pytest.approx(1.05, abs=0.01)
    assert longer["fe_approach_mm"] / base["fe_approach_mm"] == pytest.approx(1.003, abs=0.003)
    assert said.count("times 1.5: p_max") == 2


def test_06_manchester(quick, tmp_path):
    rows, said = quick("06_manchester", tmp_path)
    assert [row["lateral_shift_mm"] for row in rows] == [-2.0, 2.0]
    assert "Largest deviation of the peak pressure" in said


def test_09_applicability_map(quick, tmp_path):
    rows, said = quick("09_applicability_map", tmp_path)
    peak = {row["lateral_shift_mm"]: row["hertz_deviation_p_max_percent"] for row in rows}
    # by another reading of other meshes: -0.3, -21 and 0 %
    assert peak == pytest.approx({-4.0: -0.2, 0.0: -21.3, 4.0: 0.0}, abs=0.3)
    assert "FAILS at 0 mm" in said


def test_03_curvature_junctions(quick, tmp_path):
    study = module("03_curvature_junctions")
    rows, said = quick("03_curvature_junctions", tmp_path)
    peak = {study.distance_mm(row): row["hertz_deviation_p_max_percent"] for row in rows}
    # 1.5 b away Hertz is exact but for the block
    assert abs(peak[8.0]) < 0.3
    # the tighter arc carries more the nearer it is; by another reading of other meshes -13.9 and -28.3 %
    assert peak[2.0] == pytest.approx(-13.9, abs=0.5)
    assert peak[0.0] == pytest.approx(-28.3, abs=0.5)
    assert "arcs:300/80" in said
    assert (tmp_path / "junctions.png").is_file()


def test_03_reach_is_where_the_deviation_comes_within_the_limit():
    study = module("03_curvature_junctions")
    distance = np.array([0.1, 0.5, 1.0, 2.0])
    assert study.reach(distance, np.array([-30.0, -8.0, -2.0, 0.0]), 5.0) == pytest.approx(0.75)
    assert study.reach(distance, np.array([1.0, 2.0, 0.0, 0.0]), 5.0) == 0.0
    assert study.reach(distance, np.array([1.0, 2.0, 0.0, 9.0]), 5.0) == math.inf
    # the last time that it leaves the limit counts
    assert study.reach(distance, np.array([9.0, 1.0, 9.0, 1.0]), 5.0) == pytest.approx(1.5)


def test_04_claim_of_yan_and_fischer(quick, tmp_path):
    rows, said = quick("04_claim_of_yan_and_fischer", tmp_path)
    verdicts = {row["lateral_shift_mm"]: row["verdict_answer"] for row in rows}
    # a contact point just beside the junction, and one on a plain arc
    assert verdicts == {1.0: "FAILS", -4.0: "HOLDS"}
    assert "The claim itself is right in" in said


def test_04_threshold_that_sorts_best():
    study = module("04_claim_of_yan_and_fischer")
    threshold, right = study.best_threshold(np.array([0.1, 0.2, 0.9, 1.5]), np.array([False, False, True, True]))
    assert 0.2 < threshold < 0.9
    assert right == 4
    assert study.best_threshold(np.array([1.0, 2.0]), np.array([True, False]))[1] == 1


def test_05_rail_and_inclination(quick, tmp_path):
    rows, said = quick("05_rail_and_inclination", tmp_path)
    for row in rows:
        # finite bodies of 60 mm under a patch of 10 mm: measured -0.1 and -0.4 %
        assert -0.8 < row["steps_half_space_to_bodies_p_max_percent"] < 0.2
    assert "60E1 1:40" in said
    assert (tmp_path / "ladder.png").is_file()


def test_18_finite_elements_alone(quick, tmp_path):
    rows, said = quick("18_finite_elements_alone", tmp_path)
    # measured 0.2 % at six elements per semi-axis, 0.02 % at nine
    for row in rows:
        assert abs(row["elements_p_max_MPa"] / row["fe_p_max_MPa"] - 1.0) < (
            5e-3 if row["resolution"] == "quick" else 1e-3
        )
        # of healthy elements -0.8 to 0.4 %
        assert abs(row["elements_compliance_error"]) < 0.01
    assert "the same in 2 of 2 places where they know it" in said
    assert (tmp_path / "elements_alone.png").is_file()


@pytest.mark.parametrize("number", [12, pytest.param(24, marks=pytest.mark.slow)])
def test_12_exact_contacts_on_the_elements_own_nodes(number, monkeypatch):
    """Quadratic gaps with nodes at any offset.

    The errors are within the stated uncertainty, which was chosen on other contacts.
    """
    study = module("12_uncertainty")
    monkeypatch.setattr(study, "QUICK_NUMBER", number)
    monkeypatch.setattr(study, "QUICK_OTHERS", 0)
    own_nodes_rows = [error_row for error_row in study.exact_errors(True) if error_row.of == study.OWN_NODES[0]]
    assert len(own_nodes_rows) == number
    for name in study.JUDGED:
        # one of them is not, in the misplaced load
        assert study.outside_percent(own_nodes_rows, name) <= (100.0 / number if name == "misplaced_load" else 0.0)
    # what means over hats read with four elements per semi-axis: peak 1 / (6 n^2), half-widths 5 / (12 n^2)
    count = study.FEWEST * study.MESH_RATIO
    for name, limit in (
        ("p_max_MPa", 1.0 / (6.0 * count**2)),
        ("a_mm", limit_a := 5.0 / (12.0 * count**2)),
        ("b_mm", limit_a),
    ):
        assert max(error_row.true[name] for error_row in own_nodes_rows) < limit


@pytest.mark.slow
def test_11_conforming_pair(tmp_path):
    (*grooves, row), said = run_quick("11_conforming_pair", tmp_path)
    # finite bodies by another theory, also checks of the study: healthy elements are not refused in any groove
    study = module("11_conforming_pair")
    assert [study.groove_of(groove) for groove in grooves] == ["10.25", "10.10", "10.05", "10.02"]
    assert {groove["status"] for groove in grooves} == {"converged"}
    assert [
        check
        for groove in grooves
        for check in study.groove_checks(study.groove_of(groove), groove)
        if not check.passed
    ] == []
    assert (tmp_path / "conforming.png").is_file()
    # published 12 % too low at equal load; measured -12.0 ± 0.8 %
    assert row["hertz_deviation_p_max_percent"] == pytest.approx(-12.0, abs=1.0)
    assert row["verdict_answer"] == "FAILS"
    # CONTACT's own gap: 91.84 kN, 1012 MPa; also a check of the study
    assert "91.82 kN (91.84), 1012.9 MPa (1012)" in said


def test_07_crane_rail(quick, tmp_path):
    study = module("07_crane_rail")
    (centre, corner), said = quick("07_crane_rail", tmp_path)
    # 19 mm of patch on 82 mm of crown arc: measured 0.1 %; the block of 100 mm accounts for it
    assert abs(centre["hertz_deviation_p_max_percent"]) < 0.3
    assert study.distance_mm(centre) == pytest.approx(40.86, abs=0.01)
    # contact point placed by its distance from the joint, half a semi-axis
    assert study.distance_over_b(corner) == pytest.approx(0.5, abs=1e-6)
    # far beyond the limits (5 % and 10 %) on any mesh: measured -43 %
    assert corner["verdict_answer"] == "FAILS"
    assert corner["verdict_cause"] == "curvature change within the patch"
    assert corner["hertz_deviation_p_max_percent"] < -20.0
    # Johnson (1985), eq. 4.45: 3125 N/mm on a roller of radius 400, E* 115385 MPa
    assert study.line_contact_MPa(centre) == pytest.approx(535.7, abs=0.1)
    assert "fails from 0.50 b on" in said
    assert (tmp_path / "crane_rail.png").is_file()


@pytest.mark.slow
def test_08_switch_rail(tmp_path):
    (full, tongue), said = run_quick("08_switch_rail", tmp_path)
    for row in (full, tongue):
        # the full head is a half-space to 0.02 %; what the narrow one is, quick meshes tell to 1.3 %
        assert abs(row["hertz_deviation_p_max_percent"]) < row["hertz_uncertainty_p_max_percent"] + 0.3
        assert row["verdict_answer"] != "FAILS"
    # the same crown arc under both patches
    assert tongue["hertz_p_max_MPa"] == pytest.approx(full["hertz_p_max_MPa"], rel=1e-9)
    # a head of 20 mm is compressed: measured 7 %, a matter of the bodies that 1 % of discretisation does not hide
    assert 1.04 < tongue["fe_approach_mm"] / full["fe_approach_mm"] < 1.10
    assert "HOLDS on 2 of 2" in said
    assert (tmp_path / "switch_rail.png").is_file()


@pytest.mark.slow
def test_08_the_wheel_need_not_face_all_of_a_wide_zone():
    """A narrow head with a flat wheel off its centre.

    The surface of the wheel misses the ends of the zone on the corner of the head.
    """
    (off,) = (case for case in load_study(STUDIES / "08_switch_rail.py").cases if case.lateral_shift_mm)
    # six elements per semi-axis, whose zone is wider than the head
    position = expect_position(replace(off, resolution=(0.915, 0.703)))
    zone = make_fine_zone(position.expected, tuple(MESH_RATIO * step for step in position.element_size_mm))
    with pytest.raises(CoverageError):
        couple_bodies(position.case, position.placement, zone, position.clock)
    mesh = CoupledMesh(position, MESH_RATIO)
    # two elements beside the expected patch are left
    s, expected = mesh.bodies.grid.s_mm, position.expected
    assert s[2] <= expected.s_low_mm
    assert s[-3] >= expected.s_high_mm
    mesh.close()


def test_08_sections_are_those_that_the_study_writes():
    study = module("08_switch_rail")
    for thickness in study.THICKNESS_MM:
        path = STUDIES / "profiles" / f"switch_tongue_{thickness}.toml"
        assert path.read_text("utf-8") == study.profile_toml(thickness)
        rail = resolve_rail(str(path))
        assert rail.y_range_mm == (-thickness / 2, thickness / 2)
        assert rail.curvature(0.0) == pytest.approx(1 / 300, rel=1e-9)
        assert not any(junction.is_corner for junction in rail.junctions)


def test_09_has_every_solved_load(tmp_path):
    """Loads of the search for limits are included.

    A cell that failed has no numbers.
    """
    hertz = {"deviation": {"p_max_MPa": 0.04, "separate_load": 0.25}}
    verdict = {"answer": "FAILS", "cause": "second patch"}
    load_record = {"load_N": 50e3, "status": "converged", "verdict": verdict, "theories": {"hertz": hertz}}
    cells = [load_record, {"load_N": 20e3, "status": "failed: no memory"}]
    document = {
        "cells": [{"lateral_shift_mm": 5.0, **cell} for cell in cells],
        "limits": [{"lateral_shift_mm": 5.0, "tried": [{"load_N": 30e3, "verdict": "HOLDS"}]}],
    }
    (tmp_path / "map.json").write_text(json.dumps(document))
    tried, load_rows = module("09_applicability_map").solved_loads(tmp_path)
    assert (tried["load_kN"], tried["verdict"], tried["status"]) == (30.0, "HOLDS", "tried for the limit")
    assert load_rows == {
        "lateral_shift_mm": 5.0,
        "load_kN": 50.0,
        "status": "converged",
        "verdict": "FAILS",
        "cause": "second patch",
        "p_max_percent": 4.0,
        "separate_load_percent": 25.0,
    }


def test_10_subsurface(quick, tmp_path):
    study = module("10_subsurface")
    rows, said = quick("10_subsurface", tmp_path)
    errors = [study.errors_percent(row, body) for row in rows for body in study.BODIES]
    # targets of the study at `standard`; `quick` was measured within 0.8 %, 1.5 % and 2.4 %
    for size, depth, load in errors:
        assert abs(size) < study.SIZE_LIMIT_PERCENT
        assert abs(depth) < study.DEPTH_LIMIT_PERCENT
        assert abs(load) < study.YIELD_LOAD_LIMIT_PERCENT
    assert "MISSED" not in said
    assert (tmp_path / "subsurface.png").is_file()


def test_10_the_load_of_first_yield_is_johnsons():
    study = module("10_subsurface")
    # Johnson (1985), section 4.2: crossed cylinders of radius 460 are a sphere of 460 on a plane, nu 0.3, first yield
    # at p0 = 1.61 Y; F = pi^3 R^2 p0^3 / (6 E*^2)
    p0, radius, modulus = 1.613 * study.YIELD_MPA, 460.0, 210e3 / (2 * (1 - 0.3**2))
    exact = math.pi**3 * radius**2 * p0**3 / (6.0 * modulus**2)
    assert study.yield_load_N(study._case(460, "quick")) == pytest.approx(exact, rel=2e-3)


# the same theories on the same vehicles are tested by default in test_vehicle
@pytest.mark.slow
def test_16_curves_keeps_its_limits():
    checks = module("16_curves").checks([])
    assert len(checks) == 6
    assert [check for check in checks if not check.passed] == []


# what is stated of measured lines is tested by default in test_measured_profiles and test_uncertainty
@pytest.mark.slow
def test_14_measured_profiles_keeps_its_limits():
    study = module("14_measured_profiles")
    # two seeds of twenty: closed forms alone
    errors = study.measured((0.01,), (0.2,), seeds=2)
    assert len(errors) == 2 * len(study.SHIFTS_MM)
    for error_row in errors:
        assert 100.0 * max(map(abs, error_row.error)) < study.LIMIT_PERCENT
    assert study.covered(errors) >= study.LEAST_COVERED
    # without a nominal profile the error is larger, and is said to be
    without = study.measured((0.01,), (0.2,), seeds=20, nominal="none")
    assert max(max(map(abs, error_row.error)) for error_row in without) > 0.05
    # 98.8 % of these 240; of the twelve of a single seed it may be ten
    assert study.covered(without) >= study.LEAST_COVERED
    assert [case.lateral_shift_mm for case in study.cases(quick=True)] == [4.0]


@pytest.mark.slow
def test_15_cheaper_than_finite_elements(quick, tmp_path):
    study = module("15_cheaper_than_finite_elements")
    rows, said = quick("15_cheaper_than_finite_elements", tmp_path)
    judgements = study.judged(rows)
    # Hertz holds at -4 mm alone; strips everywhere, as the half-space does, at 1 % of its cost
    assert {
        name: judgement.holds for name, judgement in judgements.items() if name in ("hertz", "strip", "half_space")
    } == {
        "hertz": 1,
        "strip": 3,
        "half_space": 3,
    }
    assert max(map(abs, judgements["strip"].p_max_percent)) < 0.6
    # 6 to 11 % too low on any ellipse
    assert -11.0 < judgements["kik_piotrowski"].p_max_percent[0] < -6.0
    assert "The cheapest that holds in all of them: Strip method" in said
    assert "Hertz: cheapest that holds in 1, holds in 1, fails in 2" in said
    assert (tmp_path / "cost.png").is_file()


def test_15_a_theory_that_says_nothing_of_its_own_is_hertz():
    study = module("15_cheaper_than_finite_elements")
    row = {"hertz_verdict_answer": "FAILS", "hertz_limit_utilisation": 2.0, "hertz_deviation_p_max_percent": 9.0}
    row |= {
        f"{name}_{key}": value
        for name in study.ALL
        if name not in ("hertz", "multi_hertz")
        for key, value in (("verdict_answer", "HOLDS"), ("limit_utilisation", 0.5), ("deviation_p_max_percent", 1.0))
    }
    judgements = study.judged([row])
    assert judgements["hertz"] == judgements["multi_hertz"]
    assert (judgements["multi_hertz"].holds, judgements["strip"].holds) == (0, 1)


@pytest.mark.slow
def test_17_irregular(tmp_path):
    study = module("17_irregular")
    outcome = study_by(load_study(STUDIES / "17_irregular.py", quick=True), tmp_path, crew=inline_crew())
    assert outcome.all_converged
    rows = list(outcome.rows)
    assert [row["distance_mm"] for row in rows if row.get("distance_mm") is not None] == [25.0]
    checks = study.checks(rows)
    assert len(checks) == 3
    assert [check for check in checks if not check.passed] == []
    assert "the half-space is enough" in outcome.conclusion


@pytest.mark.slow
def test_19_yielding(tmp_path):
    study = module("19_yielding")
    outcome = study_by(load_study(STUDIES / "19_yielding.py", quick=True), tmp_path, crew=inline_crew())
    assert outcome.all_converged
    (wheel, _) = outcome.rows
    # Hertz is right of elastic bodies here, and 27 % off those that yield; first yield is at 25 kN
    assert (wheel["elastic_verdict_answer"], wheel["verdict_answer"]) == ("HOLDS", "FAILS")
    assert study.box(wheel) == (False, True)
    assert "without shakedown, residual stress, friction and repeated passes" in wheel["verdict_warnings"]
    checks = study.checks(list(outcome.rows))
    assert [check.quantity for check in checks] == [
        "force over that of first yield",
        "p_max over that of elastic bodies",
        "area over that of elastic bodies",
    ]
    assert [check for check in checks if not check.passed] == []
    assert "The claim with both clauses is right in 1 of 1 decided cases." in outcome.conclusion
    assert (tmp_path / "yielding.png").is_file()


# Axisymmetric elements: elastic peak over yield stress, approach over that of elastic half-spaces. At 4.0, beyond the
# jump of the formula, 3.6 % are left.
@pytest.mark.parametrize(
    ("ratio", "approach", "limit"), [(2.0, 1.005, 0.01), (2.5, 1.023, 0.01), (3.5, 1.078, 0.025), (4.0, 1.109, 0.04)]
)
def test_19_force_over_interference_of_known_spheres(ratio, approach, limit):
    study = module("19_yielding")
    sphere_row = study.sphere(ratio, "quick")
    elastic = study.elastic_approach_mm()
    # Johnson (1985), eq. 3.24: the cube of the approach is 9 F^2 / (16 R E*^2)
    modulus = sphere_row.contact_modulus_MPa
    assert elastic**3 == pytest.approx(9.0 * study.FORCE_N**2 / (16.0 * study.RADIUS_MM * modulus**2), rel=1e-9)
    # bodies that end give way by more as a whole, yielding or not
    row = {
        "plastic_bodies_rail_yield_MPa": sphere_row.rail_material.yield_MPa,
        "fe_approach_mm": 0.946 * elastic,
        "plastic_approach_mm": (approach - 1.0 + 0.946) * elastic,
    }
    w, force = study.interference(row)
    assert w == pytest.approx(approach * (ratio / 1.615) ** 2, rel=1e-3)
    assert force / study.kogut_etsion(w) == pytest.approx(1.0, abs=limit)


def test_20_atlas(quick, tmp_path):
    pytest.importorskip("fecontact.features.fleet")
    rows, said = quick("20_atlas", tmp_path)
    assert len(rows) == 3
    assert "agree in" in said
    assert "of the atlas" in said


def test_20_the_atlas_says_what_finite_elements_say_of_the_usual_pair():
    pytest.importorskip("fecontact.features.fleet")
    study = module("20_atlas")
    atlas_row = study.atlas()["S1002", "1in40", "60E1"]
    # 100 kN, by finite elements (first_light.py and 09_applicability_map.py)
    by_elements = {-6.0: "H", -4.0: "H", -2.0: "H", 0.0: "F", 1.0: "F", 3.0: "F", 4.0: "H"}
    # at 3 mm the area is off by 11 % where 10 % are allowed, which strips leave open
    by_strips = {shift: atlas_row[shift][study.LOADS_KN.index(100.0)] for shift in by_elements}
    assert by_strips | {3.0: "F"} == by_elements
    assert by_strips[3.0] in "FO"
    # where it holds under all loads it does under any
    assert study.holds_up_to_kN("HHHHH") == 125.0
    assert study.holds_up_to_kN("HHFOH") == 50.0
    assert study.holds_up_to_kN("OHHHH") == 0.0


def test_20_the_tables_of_the_readme_are_those_of_the_atlas():
    pytest.importorskip("fecontact.features.fleet")
    study = module("20_atlas")
    rows, more_rows = (table(100.0).splitlines()[2:] for table in (study.table, study.more_table))
    text = (STUDIES / "README.md").read_text("utf-8")
    assert (len(rows), len(more_rows)) == (18, 26)
    assert [row for row in [*rows, *more_rows] if row not in text] == []


def test_20_the_numbers_of_the_docstring_are_those_of_the_atlas():
    """Shares of the letters, and the comparison of the sample with the screen."""
    pytest.importorskip("fecontact.features.fleet")
    study = module("20_atlas")
    docstring = " ".join(study.__doc__.split())
    for series in study.SERIES:
        counts = study.count_letters(series)
        letters = [*"HFO", "R" if series == "first" else "N"]
        holds, fails, unresolved, climbs = (100.0 * counts[letter] / counts.total() for letter in letters)
        assert (
            f"Hertz holds in {holds:.0f} % of the positions, fails in {fails:.0f} % and is unresolved in"
            f" {unresolved:.1f} %; in {climbs:.0f} % the flange climbs"
        ) in docstring
        assert counts.total() == sum(counts[letter] for letter in letters)
        positions = study.sample(series)
        decided = [p for p in positions if {p.verdict, p.fe_verdict} <= {"HOLDS", "FAILS"}]
        assert {p.verdict == p.fe_verdict for p in decided} == {True}
        assert f"agree in all {len(decided)} positions that both decide" in docstring
        sure = [p for p in positions if p.stratum.startswith("surely") and math.isfinite(p.fe_p_max_percent)]
        close = sum(abs(p.p_max_percent - p.fe_p_max_percent) <= 0.5 for p in sure)
        assert f"within 0.5 % of the deviation by elements in {close} of {len(sure)} positions" in docstring
        assert f"By the sample Hertz holds in {study.format_interval(study.share(series))}" in docstring
    sample = study.sample("more")
    judged_positions = [p for p in sample if p.cheapest_theory in study.THEORY_LETTERS and p.fe_theory_verdict]
    assert len(sample) == sum(fleet.draws for fleet in study.MORE_FLEETS.values())
    assert (
        f"{sum(p.fe_theory_verdict == 'HOLDS' for p in judged_positions)} of {len(judged_positions)} drawn positions"
        in docstring
    )
    theories = study.count_theories()
    assert f"Of {theories.total()} contacts at which Hertz is not known to hold" in docstring
    for name in ("analyn", "equivalent_ellipse", "kpec", "multi_hertz", "stripes"):
        assert f"`{name}` in {theories[name]}" in docstring
    assert not theories["kik_piotrowski"]
    assert f"at the other {theories['strip']} it is the strip method itself" in docstring


def test_20_theories_of_the_atlas_are_named_only_inside_their_range_and_where_they_hold():
    """The strip method again, at a position of each letter."""
    screened_position = pytest.importorskip("fecontact.features.fleet.screened_position")
    study = module("20_atlas")
    verdicts, theories = study.atlas("more"), study.atlas("more", "theory at")
    # where the wheel has no contact there is no theory, and elsewhere there is one
    for pair, letters_by_shift in verdicts.items():
        for shift, letters in letters_by_shift.items():
            no_contact = [letter in study.NOT_PLACED for letter in letters]
            assert [letter == study.NO_THEORY for letter in theories[pair][shift]] == no_contact
            assert len(letters) == len(study.LOADS_KN)
    fleets = {pair: fleet for fleet in study.MORE_FLEETS.values() for pair in fleet.pairs}
    assert len(fleets) == len(verdicts) == 58
    places = {
        theories[pair][shift][k]: (pair, shift, study.LOADS_KN[k])
        for pair in verdicts
        for shift in theories[pair]
        for k in range(len(study.LOADS_KN))
    }
    names = {letter: name for name, letter in study.THEORY_LETTERS.items()}
    for letter in places.keys() - {study.NO_THEORY}:
        (wheel, slope, rail), shift, load = places[letter]
        fleet = fleets[wheel, slope, rail]
        case = Case(
            wheel=wheel,
            rail=rail,
            inclination_rad=parse_inclination(study.INCLINATIONS[slope]),
            track=Track(back_to_back_mm=fleet.back_to_back_mm),
            lateral_shift_mm=shift,
            load_N=1e3 * load,
        )
        variant = screened_position.screen_variant(case, place_case(case), "strip")
        row = screened_position.make_position_row({"": variant})
        assert row["cheapest_theory"] == names[letter]
        contact = variant.contact if letter == "T" else screened_position.fast_theory(names[letter])(variant.loaded)
        assert contact.status != "out of range", (letter, places[letter])
        assert study.LETTERS[row["verdict"]] == verdicts[wheel, slope, rail][shift][study.LOADS_KN.index(load)]


def test_20_rails_of_the_library_without_rows_have_the_head_of_a_rail_with_rows():
    """Radii and slopes of the heads are equal, junctions within 1 um; treads are equal beyond the flank."""
    pytest.importorskip("fecontact.features.fleet")
    study = module("20_atlas")
    for name, other_name in study.EQUAL_HEADS.items():
        assert other_name in (*study.RAILS, *study.MORE_RAILS)
        head, other_head = (tomllib.loads(toml_text(rail))["head"] for rail in (name, other_name))
        assert (head["radii"], head["side_one_in"]) == (other_head["radii"], other_head["side_one_in"])
        assert head["half_widths"] == pytest.approx(other_head["half_widths"], abs=1e-3)
    european = {name for name in list_names("rail") if find_group(name).startswith("EN 13674-1")}
    assert european == {*study.RAILS, *study.MORE_RAILS, *study.EQUAL_HEADS}
    y = np.linspace(-38.0, 60.0, 500)
    for wheel in study.WHEELS:
        for height in ("h29", "h30", "h32"):
            treads = [load_library_profile(name).height(y) for name in (wheel, f"{wheel}_{height}")]
            assert np.abs(treads[0] - treads[1]).max() < 1e-6, (wheel, height)


def test_22_fleet_of_measured_files(quick, tmp_path):
    pytest.importorskip("fecontact.features.fleet")
    rows, said = quick("22_fleet_of_measured_files", tmp_path)
    assert [row["verdict_answer"] for row in rows] == ["UNRESOLVED", "FAILS", "HOLDS"]
    assert "of 184 positions, the interval contains" in said


def test_22_intervals_contain_the_true_share_and_no_wrong_one(monkeypatch):
    pytest.importorskip("fecontact.features.fleet")
    study = module("22_fleet_of_measured_files")
    positions = study.positions()
    assert len({position.place for position in positions}) == len(positions) == 184
    assert math.fsum(position.weight for position in positions) == pytest.approx(1.0)
    assert study.contradictions() == []
    assert {position.fe_verdict for position in positions} == set(study.FE_ANSWERS)
    true_shares = {answer: study.true_share(answer) for answer in study.FE_ANSWERS}
    assert math.fsum(true_shares.values()) == pytest.approx(1.0)
    assert min(study.covered_share(answer) for answer in study.FE_ANSWERS) >= 0.93
    # the mean of many estimates is the true share: its error is the spread of an estimate over the root of their number
    for answer, shares in study.draw_intervals().items():
        estimates = [share.estimate for share in shares]
        largest_error = 3.5 * np.std(estimates) / math.sqrt(len(estimates)) + 1e-12
        assert abs(np.mean(estimates) - true_shares[answer]) < max(largest_error, 0.005), answer
    # a share that is wrong by 20 percentage points is in few of the intervals
    monkeypatch.setattr(study, "true_share", lambda answer: true_shares[answer] + 0.2)
    assert max(study.covered_share(answer) for answer in ("HOLDS", "FAILS", "OPEN")) < 0.5


def test_22_the_docstring_and_the_readme_have_the_numbers_of_the_stored_positions():
    pytest.importorskip("fecontact.features.fleet")
    study = module("22_fleet_of_measured_files")
    counts, text = study.confusion(), " ".join((study.__doc__ or "").split())
    readme = (STUDIES / "README.md").read_text("utf-8")
    by_screen = {
        verdict: sum(number for (screen, _), number in counts.items() if screen == verdict)
        for verdict in ("HOLDS", "FAILS", "OPEN", "REFUSED")
    }
    agreed = counts["HOLDS", "HOLDS"] + counts["FAILS", "FAILS"]
    decided = counts["OPEN", "HOLDS"] + counts["OPEN", "FAILS"]
    covered = {answer: 1e2 * study.covered_share(answer) for answer in study.FE_ANSWERS}
    lengths = {
        answer: 50.0 * np.mean([share.high - share.low for share in shares])
        for answer, shares in study.draw_intervals().items()
    }
    causes = {
        cause: [position for position in study.positions() if position.open_because == cause]
        for cause in ("noise", "accuracy of the screen")
    }
    by_elements = {
        cause: sum(position.fe_verdict in ("HOLDS", "FAILS") for position in positions)
        for cause, positions in causes.items()
    }
    assert (
        f"by the screen Hertz holds in {by_screen['HOLDS']} of the contacts and fails in {by_screen['FAILS']};"
        f" {by_screen['OPEN']} are unresolved and {by_screen['REFUSED']} refused"
    ) in text
    assert f"have equal verdicts at all {agreed} positions that both decide" in text
    assert (
        f"Of the unresolved positions they decide {decided}: {by_elements['accuracy of the screen']} of the"
        f" {len(causes['accuracy of the screen'])}"
        f" that the accuracy of the screen leaves unresolved, and {by_elements['noise']} of the {len(causes['noise'])}"
        " that noise leaves unresolved"
    ) in text
    parts = ", ".join(f"{answer} {share:.3g} %" for answer, share in covered.items())
    assert f"contains the true share in the following part of the samples: {parts}" in text
    middle = ", ".join(f"{lengths[answer]:.0f}" for answer in ("HOLDS", "FAILS"))
    assert f"is {middle} and {lengths['OPEN']:.0f} percentage points for HOLDS, FAILS and OPEN" in text
    assert f"in {min(covered.values()):.3g} to {max(covered.values()):.3g} % of 200 samples" in readme
    assert f"agree at all {agreed} positions that both decide" in readme


def test_two_patches_of_measured_lines_touch_at_head_and_flange_at_once():
    """Three contact points within 0.05 mm, and a contact 65 mm wide.

    Its lobe on the flange root is 0.4 mm narrow. Few nodes suffice: with more nodes the load of a lobe changes by some
    percent, and its position does not change.
    """
    case = module("21_measured_pairs").two_patches(92.0)
    placement = place_case(case)
    places = {round(float(touch.rail_y_mm)): touch.vertical_gap_mm for touch in placement.contact_points}
    assert sorted(places) == [-35, -26, 6]
    assert max(places.values()) < 0.05
    _, expected = expect_on_half_space(case, placement, nodes=4)
    assert expected.s_high_mm - expected.s_low_mm == pytest.approx(65.3, abs=1.0)
    assert len(expected.parts) == 3
    assert min(ellipse.semi_axes_mm[1] for ellipse in expected.parts) == pytest.approx(0.36, abs=0.1)
    # its opposite has one contact point there
    mirrored_placement = place_case(replace(case, roll_rad=-case.roll_rad))
    assert len(mirrored_placement.contact_points) == 1


@pytest.mark.slow
def test_verdicts_on_files_of_rounded_points_are_those_of_the_reference(tmp_path):
    """The points of study 21, rounded to 0.01 mm before they are read."""
    study = module("21_measured_pairs")
    results = study.survey(study.round_positions(tmp_path))
    assert len(results) == len(study.positions())
    counts = Counter(result.outcome for result in results)
    assert counts["wrong"] == 0
    text = " ".join(study.__doc__.split())
    agreed = counts["decided"] + counts["open"]
    assert f"{counts['decided']} of these {agreed} positions have the verdict of the reference" in text
    assert f"{counts['open']} are unresolved, and no verdict is wrong. Of the 6" in text
    for filter_mm, least_percent in study.LEAST_COVERED_PERCENT.items():
        shares = [share for _, share in study._covered_shares(results, filter_mm)]
        assert f"with {filter_mm} mm in {100 * min(shares):.0f} to {100 * max(shares):.0f} %" in text
        assert 100.0 * min(shares) >= least_percent


def test_rounded_files_have_the_points_of_the_files(tmp_path):
    """Each coordinate is rounded to 0.01 mm, and nothing else changes."""
    study = module("21_measured_pairs")
    case = study.round_positions(tmp_path)[0].case
    rounded, exact = resolve_rail(case.rail), resolve_rail(study.positions()[0].case.rail)
    assert not np.allclose(exact.measured.points, np.round(exact.measured.points, 2), atol=1e-9)
    assert rounded.measured.is_noise_known
    y = np.linspace(-25.0, 25.0, 101)
    assert rounded.height(y) == pytest.approx(exact.height(y), abs=0.01)


def test_cells_of_constant_pressure_reach_beyond_the_contact():
    """Hertz's circle of pressure, pressed flat by cells (Love 1929).

    The edge of the cells lies where study 21 states it, and study 21 subtracts this excess.
    """
    study, radius, steps = module("21_measured_pairs"), 13.0, np.random.default_rng(5).uniform(-0.5, 0.5, (8, 2))

    def corner(u, v):
        return u * np.arcsinh(v / np.abs(u)) + v * np.arcsinh(u / np.abs(v))

    outside, peaks = [], []
    for step in steps:
        x, y = (np.arange(-15.0, 16.0)[:, None] + step).T
        x, y = (coordinates.ravel() for coordinates in np.meshgrid(x, y))
        pressed = np.hypot(x, y) < radius + 1.5
        while True:
            u, v = np.subtract.outer(x[pressed], x[pressed]), np.subtract.outer(y[pressed], y[pressed])
            of_cells = sum(i * j * corner(u + 0.5 * i, v + 0.5 * j) for i in (1, -1) for j in (1, -1))
            pressures = np.linalg.solve(of_cells, 1.0 - 0.5 * (x**2 + y**2)[pressed] / radius**2)
            if np.all(pressures > 0.0):
                break
            pressed[pressed] = pressures > 0.0
        outside.append((np.count_nonzero(pressed) - np.pi * radius**2) / (2.0 * np.pi * radius))
        # 1 = pi^2 a p0 / 2 under a unit modulus over pi
        peaks.append(pressures.max() * 0.5 * np.pi**2 * radius)
    # a contact of 26 cells across is counted to a part of a cell
    assert np.mean(outside) == pytest.approx(study.CELLS_OUTSIDE, abs=0.04)
    assert 1.0 - study.CELLS_LOWER < min(peaks) <= max(peaks) < 1.0 + 1e-3
    row = {"edge_4mm_percent": "10", **{f"{short}_4mm_percent": "2" for short in study.COVERED}}
    # the area inside the edge is smaller by 1.3 %, and Hertz's so much larger beside it
    assert study._deviations(row, 4) == pytest.approx(
        {"p_max_MPa": 0.02, "area_mm2": 1.02 / 0.987 - 1.0, "a_mm": 0.02, "b_mm": 0.02}
    )


# --- exact contacts that are no ellipses -----------------------------------------------------------------------------


def others_by_chance(number: int, seed: int):
    study, rng = module("12_uncertainty"), np.random.default_rng(seed)
    contacts = []
    while len(contacts) < number:
        if (contact := study.galin_by_chance(rng)).is_contact:
            contacts.append(contact)
    return study, contacts


def test_12_a_constant_polynomial_is_hertz():
    study = module("12_uncertainty")
    hertz = hertz_ellipse(0.5 / 460.0, 0.5 / 90.0, normal_force_N=5e4, contact_modulus_MPa=study.MODULUS_MPA)
    contact = study.Galin(coefficients=np.array([[hertz.p0_MPa]]), a_mm=hertz.a_mm, b_mm=hertz.b_mm)
    gap = contact.gap_coefficients_mm
    assert -gap[0, 0] == pytest.approx(hertz.approach_mm, rel=1e-12)
    assert gap[2, 0] / hertz.a_mm**2 == pytest.approx(0.5 / 460.0, rel=1e-11)
    assert gap[0, 2] / hertz.b_mm**2 == pytest.approx(0.5 / 90.0, rel=1e-11)
    assert contact.moment(0, 0) * hertz.a_mm * hertz.b_mm == pytest.approx(5e4, rel=1e-12)


def test_12_the_deflection_of_a_polynomial_pressure_is_the_integral_of_point_loads():
    """Deflection inside and outside, by midpoints of the area.

    The singular cell is a disc of equal size.
    """
    _, (contact, *_) = others_by_chance(1, 3)
    n = 1200
    steps = (np.arange(n) + 0.5) / n * 2.0 - 1.0
    x, y = np.meshgrid(contact.a_mm * steps, contact.b_mm * steps, indexing="ij")
    pressure, cell = contact.pressure_MPa(x, y), 4.0 * contact.a_mm * contact.b_mm / n**2
    for place in ((0.3, -0.4), (-0.7, 0.1), (0.9, 0.9), (0.2, 1.4)):
        distance = np.hypot(x - place[0] * contact.a_mm, y - place[1] * contact.b_mm)
        summed = float((pressure / distance).sum()) * cell / (math.pi * module("12_uncertainty").MODULUS_MPA)
        # measured: within 4e-4 inside, 1e-6 outside
        assert contact.deflection_mm([place[0]], [place[1]])[0] == pytest.approx(summed, rel=2e-3)


@pytest.mark.slow
def test_12_others_are_contacts_and_half_spaces_find_them():
    """No negative pressure, and an open gap outside.

    The half-space of their gap has their pressure, wherever the nodes lie.
    """
    study, contacts = others_by_chance(12, 5)
    rng = np.random.default_rng(6)
    errors = []
    for contact in contacts:
        assert contact.over_ellipse().min() >= 0.0
        assert contact.least_opening > 0.0
        exact = contact.exact
        true_gap = replace(
            make_true_gap(study.FLAT, flat_placement := place_case(study.FLAT)),
            placement=study.GivenGap(
                rail=flat_placement.rail,
                wheel=flat_placement.wheel,
                contact_points=flat_placement.contact_points,
                of=exact,
            ),
        )
        grid = exact.fine_grid((0.5, float(rng.uniform())), half=True)
        rung = true_gap.solve(grid, exact.hertz.normal_force_N, start=contact.on(grid).pressure)
        (row_read,) = study._read([rung], exact)
        errors.append(
            {
                name: abs(row_read[name] / exact.true[name] - 1.0)
                if name in MEASURES
                else abs(row_read[name] - exact.true[name])
                for name in study.JUDGED
            }
        )
        assert rung.approach_mm == pytest.approx(contact.approach_mm, rel=1e-4)
    # what reading leaves open is stated from ellipses alone; of 60 others peak 6e-5, area 0.002, centre 3e-5 at most
    for name in study.JUDGED:
        assert max(error_row[name] for error_row in errors) <= UNCERTAINTIES[name].reading, name
    assert max(error_row["p_max_MPa"] for error_row in errors) < 2e-4
    assert max(error_row["centre_over_b"] for error_row in errors) < 1e-4


@pytest.mark.slow
def test_12_elements_of_a_short_and_wide_zone_have_the_compliance_of_their_material():
    """Zones 0.32 times as long as wide.

    Blocks with a depth equal to their length give -3.5 and -2.3 %.
    """
    study = module("12_uncertainty")
    cases = [*study.exact_cases(), *study.other_cases()]
    own_cases = {case.zone: case for case in cases if math.isclose(case.zone.aspect, 10.0**-0.5)}
    assert len(own_cases) == 2
    for zone, case in own_cases.items():
        ((*_, compliance_error),) = study._on_meshes([case], 1)
        assert abs(compliance_error) < (0.018 if zone.wider == 1.0 else 0.008)


@pytest.mark.slow
def test_12_others_have_valleys_and_centres_of_all_sizes():
    study = module("12_uncertainty")
    cases = study.other_cases(True)
    assert len(cases) == study.QUICK_OTHERS
    assert all(case.fits for case in cases)
    _, contacts = others_by_chance(24, 8)
    valleys, centres = (
        [contact.exact.true["valley"] for contact in contacts],
        [abs(contact.centre) for contact in contacts],
    )
    assert max(valleys) > 0.3
    assert max(valleys) <= study.MOST_VALLEY
    assert max(centres) > 0.2
    ratios = [contact.a_mm / contact.b_mm for contact in contacts]
    assert min(ratios) < 0.4
    assert max(ratios) > 2.5


@pytest.mark.slow
def test_12_others_between_finite_elements():
    study = module("12_uncertainty")
    contact_rows = [error_row for error_row in study.exact_errors(True) if error_row.of.startswith("others")]
    on_finer_nodes = [error_row for error_row in contact_rows if error_row.of != study.OWN_NODES[1]]
    outside = {
        (error_row.case, name)
        for error_row in on_finer_nodes
        for name in study.JUDGED
        if study.outside_percent([error_row], name) > 0.0
    }
    # of the 60 of the study 3.4 % are; of these six the area of one, 2.7 % off where 2.0 % is stated
    assert outside == {("a/b 0.49, centre -0.35 b, valley 0.00", "area_mm2")}


@pytest.mark.slow
def test_the_benchmark_measures_assembly_and_files():
    """Both assemblies of the benchmark agree, and all files are written."""
    study = module("benchmark")
    case = study.cases(True)[0]
    assert all(seconds > 0.0 for seconds in (study.assembly(case) | study.files(case)).values())


def test_the_benchmark_compares_the_least_costs_of_two_checkouts(monkeypatch):
    study = module("benchmark")
    then, now = Path("then"), Path("now")
    costs = {then: [(4.0, 8.0, 1.0), (6.0, 5.0, 0.5)], now: [(3.0, 9.0, 0.25), (2.0, 10.0, 0.75)]}
    commands = []

    def run_command(root, command, threads):
        commands.append((root, command, threads))
        return costs[root].pop(0)

    monkeypatch.setattr(study, "_run_command", run_command)
    compared = study._compare_command((then, now), "solve --refine never", 1, 2)
    assert compared == ((4.0, 5.0, 0.5), (2.0, 9.0, 0.25))
    # in turn, so that the load of the machine is equal for both
    assert commands == [(then, "solve --refine never", 1), (now, "solve --refine never", 1)] * 2


@pytest.mark.slow
def test_the_benchmark_compares_a_checkout_with_itself():
    study = module("benchmark")
    table = study.compare_checkouts(STUDIES.parent, "itself", True, 1)
    lines = {line[:56].strip(): line[56:].split() for line in table.splitlines()}
    names = [f"{command}{threads}" for threads in ("", ", default threads") for command in study.QUICK_COMMANDS]
    for name in (*names, "place", "picture of a case, PNG", "ParaView files of a case", "record of a case, JSON"):
        values = [float(value) for value in lines[name]]
        # seconds and memory of both, and their ratios
        assert len(values) in (3, 9), name
        assert min(values) > 0.0, name
