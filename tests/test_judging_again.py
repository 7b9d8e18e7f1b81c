"""Stored results judged again: stored criteria stay, and only the named values change."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from kept import keep_case

import fecontact
from fecontact.cli import call
from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError
from fecontact.judging.judge import judge_load
from fecontact.outputs.study_files import write_tables
from fecontact.runs.store import name_case_folder

PAIR = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
PATCH = Criteria(area=0.07, judged_by=("patch",))
STRENGTH = Criteria(p_max=0.04, judged_by=("strength",))


@pytest.fixture(scope="module")
def exact_result() -> fecontact.CaseResult:
    """Contact of two bodies for which Hertz is exact."""
    return fecontact.solve(fecontact.Case(**PAIR, resolution="quick", refine="never"))


@pytest.fixture(scope="module")
def mixed_study(exact_result, tmp_path_factory) -> Path:
    """Study of two equal contacts with different criteria; the second has friction."""
    out = tmp_path_factory.mktemp("mixed") / "out"
    rows = []
    for load_N, criteria, creep in ((1e5, PATCH, Creep()), (1.1e5, STRENGTH, Creep(friction=0.3, xi=1e-3))):
        case = replace(exact_result.case, load_N=load_N, criteria=criteria, creep=creep)
        load = judge_load(replace(exact_result.load.solved, case=case), exact_result.placement)
        result = replace(exact_result, load=load)
        records = keep_case(result, out / "new")
        (out / "cases").mkdir(exist_ok=True)
        (out / "new").rename(name_case_folder(out, records.row["id"]))
        rows.append(records.row)
    write_tables("mixed", len(rows), rows, out / "study")
    return out


def test_only_the_named_limit_changes(mixed_study):
    judged_study = fecontact.judge(mixed_study, {"p_max": 0.03})
    assert [*judged_study.case_criteria.values()] == [replace(PATCH, p_max=0.03), replace(STRENGTH, p_max=0.03)]
    assert [row["verdict_answer"] for row in judged_study.rows] == ["HOLDS", "HOLDS"]


def test_without_criteria_the_stored_criteria_count(mixed_study):
    assert [*fecontact.judge(mixed_study).case_criteria.values()] == [PATCH, STRENGTH]
    assert [*fecontact.judge(mixed_study, Criteria()).case_criteria.values()] == [Criteria(), Criteria()]


def test_a_limit_decides_only_where_it_is_judged(mixed_study):
    # Hertz's peak is within 0.3 % of the finite elements, with an uncertainty of the same size
    judged_study = fecontact.judge(mixed_study, {"p_max": 1e-3})
    assert [row["verdict_answer"] for row in judged_study.rows] == ["HOLDS", "UNRESOLVED"]


def test_the_command_keeps_the_stored_criteria_and_names_them(mixed_study, tmp_path, capsys):
    assert call(["judge", str(mixed_study), "--p-max-percent", "3", "--out", str(tmp_path / "again")]) == 0
    assert (
        "2 cases judged by area ±7 %, a ±10 %, b ±10 %, centre ±0.15 b (1 case) and p_max ±3 % (1 case)"
        in capsys.readouterr().out
    )
    assert "The criteria differ from case to case." in (tmp_path / "again" / "report.html").read_text("utf-8")


def test_the_command_has_a_way_back_to_the_defaults(mixed_study, capsys):
    assert call(["judge", str(mixed_study), "--default-criteria", "--p-max-percent", "3"]) == 0
    assert "2 cases judged by p_max ±3 %, area ±10 %, a ±10 %," in capsys.readouterr().out


def test_stored_creepages_stay_with_new_friction(mixed_study):
    pytest.importorskip("fecontact.features.creep")
    with pytest.raises(InputError, match="no friction coefficient is given"):
        fecontact.judge(mixed_study, creep={"force_limit": 0.1})
    stored = Creep(friction=0.3, xi=1e-3)
    assert stored.apply_change({"friction": 0.4}) == Creep(friction=0.4, xi=1e-3)
    assert stored.apply_change(Creep(friction=0.4)) == Creep(friction=0.4)
    assert stored.apply_change(Creep()) == stored.apply_change(None) == stored


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"p_maks": 0.03}, "p_maks is not an input of Criteria"),
        ({"p_max": -0.03}, "limit of p_max_MPa is -0.03"),
        (0.03, "criteria is 0.03; allowed: a Criteria"),
    ],
)
def test_wrong_changes_are_refused(mixed_study, change, message):
    with pytest.raises(InputError, match=message):
        fecontact.judge(mixed_study, change)


def test_own_criteria_alone_need_an_own_criterion(mixed_study, capsys):
    assert call(["judge", str(mixed_study), "--judged-by", "own"]) == 2
    assert "there is no own criterion; give own=OwnCriterion(...), in Python, or other" in capsys.readouterr().err


def test_the_help_names_stored_values_as_defaults(capsys):
    call(["judge", "--help-all"])
    page = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "default as stored" in page
    assert "default 5" not in page


def test_an_unresolved_row_names_its_least_certain_measure(mixed_study, capsys):
    assert call(["judge", str(mixed_study), "--p-max-percent", "0.1", "--judged-by", "strength"]) == 0
    output = capsys.readouterr().out
    assert output.count("UNRESOLVED  open: p_max") == 2
    assert re.search(
        r"\+0\.00 mm, 100 kN: UNRESOLVED: least certain: peak pressure [+-]0\.\d\d % ± 0\.\d\d %\n", output
    )


def test_the_first_help_page_says_that_values_stay_as_stored(capsys):
    assert call(["judge", "--help"]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "--p-max-percent" in line]
    assert "in peak pressure in % [stored]" in line
