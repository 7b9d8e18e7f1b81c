"""Creep forces of stored results and maps, in the list of theories, and in their study."""

import csv
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from inline import inline_crew, study_by
from kept import keep_case

import fecontact
from fecontact import feature_registry
from fecontact.cli import call
from fecontact.criteria import Creep
from fecontact.errors import InputError
from fecontact.features.creep.laws import CREEP_LAWS
from fecontact.judging.judge import judge_load
from fecontact.outputs.case_parts import case_parts
from fecontact.outputs.records.results import result_record
from fecontact.outputs.terminal import print_parts
from fecontact.regression.tables import load_table
from fecontact.runs.casefile import load_study
from fecontact.runs.load import load
from fecontact.runs.sources import DISPLAY_MODULES, EVALUATING_MODULES, INPUT_MODULES, collect_imports

STUDIES = Path(__file__).parents[2] / "studies"


def test_without_its_folder_friction_is_refused(monkeypatch):
    case = fecontact.Case(creep=Creep(friction=0.3))
    monkeypatch.setattr(
        feature_registry, "FEATURES", tuple(feature for feature in feature_registry.FEATURES if feature != "creep")
    )
    with pytest.raises(InputError, match=r"friction coefficient is 0\.3, but creep forces need the feature creep"):
        fecontact.solve(case)
    fecontact.Case().creep.refuse_unheard()


def test_what_judges_forces_is_in_the_digest_of_evaluation():
    package = Path(fecontact.__file__).parent
    judging = {
        "features.creep.force_verdict",
        "features.creep.telling",
        "contact_theories.rolling.kalker",
        "features.creep.steady",
    }
    assert judging <= collect_imports(package, EVALUATING_MODULES, (*INPUT_MODULES, *DISPLAY_MODULES))


def test_the_laws_of_forces_are_listed_with_their_sources():
    for name, law in CREEP_LAWS.items():
        assert all(law[field] for field in ("words", "cost", "source", "range")), name
    assert list(fecontact.theories()["forces"]) == list(CREEP_LAWS)


@pytest.mark.slow
def test_friction_gives_creep_forces_from_stored_fields(elliptic_quick, tmp_path, capsys):
    solved_folder = tmp_path / "one"
    keep_case(elliptic_quick, solved_folder)
    out = tmp_path / "judged"
    assert call(["judge", str(solved_folder), "--friction", "0.3", "--xi", "0.001", "--out", str(out)]) == 0
    assert "creep forces: Hertz HOLDS, largest deviation" in " ".join(capsys.readouterr().out.split())
    (row,) = load_table(out).rows.to_dict("records")
    page = ElementTree.fromstring((out / "report.html").read_text("utf-8").removeprefix("<!DOCTYPE html>\n"))
    heads, line = (
        ["".join(cell.itertext()) for cell in table_row] for table_row in list(next(page.iter("table")).iter("tr"))[:2]
    )
    cells_by_heading = dict(zip(heads, line, strict=True))
    assert cells_by_heading["creep forces"] == "HOLDS"
    assert cells_by_heading["force deviation, % of mu N"].startswith(
        f"{1e2 * float(row['creep_verdict_deviation_of_muN']):.1f} ±"
    )
    # Hertz is exact here: what is left are nodes, cells and the elements
    assert row["creep_verdict_answer"] == "HOLDS"
    assert float(row["creep_verdict_deviation_of_muN"]) < 0.005
    assert float(row["creep_theories_rolling_half_space_fe_fx_N"]) == pytest.approx(
        float(row["creep_theories_rolling_half_space_hertz_fx_N"]), rel=5e-3
    )
    assert float(row["creep_theories_rolling_half_space_fe_fx_N"]) < 0.0
    # a solution with them says the same
    case = replace(elliptic_quick.case, creep=Creep(friction=0.3, xi=1e-3))
    solved_load = replace(elliptic_quick.load.solved, case=case)
    record = result_record(replace(elliptic_quick, load=judge_load(solved_load, elliptic_quick.placement)))
    cells_by_heading = record["creep"]["theories"]["rolling_half_space"]
    assert cells_by_heading["fe"]["fx_N"] == pytest.approx(
        float(row["creep_theories_rolling_half_space_fe_fx_N"]), rel=1e-9
    )
    assert cells_by_heading["deviation_of_muN"] < 5e-3
    print_parts(case_parts(record), long=True)
    assert "creep forces: Hertz HOLDS" in " ".join(capsys.readouterr().out.split())
    # the stored case itself stays without, and without friction nothing is told of creepages
    assert load(solved_folder).case == elliptic_quick.case
    assert call(["judge", str(solved_folder), "--xi", "0.001"]) == 2


@pytest.mark.slow
def test_13_creep_forces(tmp_path):
    study = load_study(STUDIES / "13_creep_forces.py", quick=True)
    outcome = study_by(study, tmp_path, crew=inline_crew())
    (row,) = outcome.rows
    assert outcome.all_converged
    # at 4 mm Hertz holds in pressure and in force: measured 1.4 ± 0.2 % of mu N
    assert (row["verdict_answer"], row["creep_verdict_answer"]) == ("HOLDS", "HOLDS")
    assert 1e2 * row["creep_verdict_deviation_of_muN"] == pytest.approx(1.4, abs=0.3)
    assert all(check.passed for check in study.checks(list(outcome.rows)))
    assert "polach" in outcome.conclusion
    with (tmp_path / "creep_errors.csv").open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert {line["plane_verdict"] for line in lines} == {"HOLDS"}
    table = [{name: float(text) for name, text in line.items() if text and "verdict" not in name} for line in lines]
    assert [table_row["friction"] for table_row in table] == [0.15, 0.3, 0.5]
    # measured: the exact theory on his ellipse is off by his pressure alone, FASTSIM on the real patch by its own error
    for table_row, by_pressure, by_theory in zip(table, (2.1, 1.4, 1.0), (4.1, 3.9, 3.3), strict=True):
        assert table_row["plane_percent_1"] == pytest.approx(by_pressure, abs=0.3)
        assert table_row["fastsim_real_percent"] == pytest.approx(by_theory, abs=0.5)
