"""The benchmark study where the wheelset rolls: its positions against the reference without finite elements."""

import importlib.util
from pathlib import Path

import pytest

from fecontact.judging.measures import read_measures, read_patch
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

STUDY = Path(__file__).parents[1] / "studies" / "06_manchester.py"
spec = importlib.util.spec_from_file_location("manchester", STUDY)
study = importlib.util.module_from_spec(spec)
spec.loader.exec_module(study)


def row_of(case):
    """Columns that the checks read from a row, from the true gap on a half-space."""
    placement = place_case(case)
    _, expected = expect_on_half_space(case, placement)
    patch, measures = read_patch(expected.half_space), read_measures(expected.half_space)
    return {
        "lateral_shift_mm": case.lateral_shift_mm,
        "fe_p_max_MPa": measures.p_max_MPa,
        "hertz_uncertainty_p_max_percent": 0.1,
        "fe_centre_y_mm": patch.centre_y_mm,
        "fe_patch_count": patch.patch_count,
    }


@pytest.mark.parametrize("shift", [pytest.param(-6.0, marks=pytest.mark.slow), 5.0, 6.0])
def test_the_benchmark_holds_on_the_half_space(shift):
    (case,) = (case for case in study.rolled_cases() if case.lateral_shift_mm == shift)
    row = row_of(case)
    checks = study.checks([row])
    assert {check.quantity for check in checks} == (
        {"p_max, MPa", "patches"} if shift == 5.0 else {"p_max, MPa", "place across, mm", "angle, rad"}
    )
    for check in checks:
        assert check.passed, (check.quantity, check.value, check.expected)
    # measured: -0.07, +3.6 (both patches in one plane there) and -0.55 %
    assert checks[0].deviation_percent == pytest.approx({-6.0: -0.07, 5.0: 3.6, 6.0: -0.55}[shift], abs=0.1)
    assert f"{shift:8.1f}" in study.conclude([row], Path())


def test_the_quick_study_is_that_of_before():
    assert [case.lateral_shift_mm for case in study.cases(quick=True)] == [-2.0, 2.0]
    shifts = [case.lateral_shift_mm for case in study.cases()]
    assert len(set(shifts)) == len(shifts) == len(study.REFERENCE) + len(study.ROLLED)


QUICK = (3.0, 6.5, 10.0)
SLOW = [pytest.param(shift, marks=pytest.mark.slow) for shift, *_ in study.BOTH_WHEELS if shift not in QUICK]


@pytest.mark.parametrize("shift", [*SLOW, *QUICK])
def test_both_wheels_on_the_half_space_to_10_mm(shift):
    checks = study.half_space_checks(shift)
    # places and angles where there is one lobe, approaches where they are known
    assert len(checks) >= {3.0: 8, 5.0: 6, 6.5: 8, 10.0: 8}.get(shift, 4)
    for check in checks:
        assert check.passed, (check.case, check.quantity, check.value, check.expected)
    assert any("climbs" in check.case for check in checks) == (shift > 6.0)


def test_the_half_space_belongs_to_the_whole_study_alone(monkeypatch):
    cases_asked = []
    monkeypatch.setattr(study, "half_space_checks", lambda shift: cases_asked.append(shift) or [])
    row = dict.fromkeys(
        ("fe_p_max_MPa", "fe_area_mm2", "hertz_uncertainty_p_max_percent", "hertz_uncertainty_area_percent"), 1.0
    )
    near, far = row | {"lateral_shift_mm": -2.0}, row | {"lateral_shift_mm": 5.0, "fe_patch_count": 2}
    for case_list in ([near], [far]):
        assert len(study.checks(case_list)) == 2
    assert cases_asked == []
    study.checks([near, far])
    assert cases_asked == [entry[0] for entry in study.BOTH_WHEELS]
