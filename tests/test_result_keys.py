"""The keys of a result are declared, fixed and complete: schema, columns and data dictionary."""

import csv
import dataclasses
import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

import fecontact
from fecontact.bodies import STEEL
from fecontact.case import Case
from fecontact.cli import call
from fecontact.criteria import Creep
from fecontact.files import format_json
from fecontact.judging.judge import judge_load
from fecontact.outputs.records.data_dictionary import dictionary_page, iterate_columns
from fecontact.outputs.records.result_schema import (
    complete_record,
    find_unit,
    iterate_keys,
    list_column_patterns,
    list_columns,
    result_schema,
    row_column_meanings,
)
from fecontact.outputs.records.results import case_row, result_record
from fecontact.profiles.reading import Reading
from fecontact.solving.solve import solve

BASELINES = Path(__file__).parents[1] / "studies" / "baselines"
YIELDING = dataclasses.replace(STEEL, yield_MPa=500.0)
POSITIONS = {
    "a junction of curvatures": Case(refine="never"),
    "two patches": Case(rail="UIC60", lateral_shift_mm=5.0, load_N=50e3, refine="never"),
    "bodies that yield": Case(lateral_shift_mm=-4.0, rail_material=YIELDING, wheel_material=YIELDING, refine="never"),
    "friction": Case(lateral_shift_mm=-4.0, creep=Creep(friction=0.3), refine="never"),
    "yaw": Case(lateral_shift_mm=2.0, yaw_rad=0.005, refine="never"),
    "the right wheel": Case(lateral_shift_mm=2.0, side="right", refine="never"),
}


def find_faults(result: fecontact.CaseResult) -> list[str]:
    """Contradictions of a result to the schema."""
    record = json.loads(format_json(result_record(result)))
    return [
        f"{'.'.join(map(str, fault.absolute_path))}: {fault.message[:200]}"
        for fault in Draft202012Validator(result_schema()).iter_errors(record)
    ]


def unlist_columns(columns: set[str]) -> set[str]:
    """Columns that are not declared."""
    return columns - {*row_column_meanings(), *list_columns("of_load"), *list_columns("of_case")}


def test_the_schema_is_a_schema():
    Draft202012Validator.check_schema(result_schema())


def test_a_result_has_the_declared_keys(elliptic_quick):
    assert find_faults(elliptic_quick) == []
    assert unlist_columns(set(case_row(elliptic_quick))) == set()


def test_a_result_that_is_not_usable_has_the_declared_keys(elliptic_quick):
    level = elliptic_quick.load.level
    levels = (dataclasses.replace(level, fe=dataclasses.replace(level.fe, status="not converged")),)
    solved_load = dataclasses.replace(
        elliptic_quick.load.solved, levels=(*levels, *elliptic_quick.load.solved.levels[1:])
    )
    load = judge_load(solved_load, elliptic_quick.placement)
    assert find_faults(dataclasses.replace(elliptic_quick, load=load)) == []


@pytest.mark.slow
@pytest.mark.parametrize("position", POSITIONS)
def test_every_kind_of_result_has_the_declared_keys(position):
    result = solve(POSITIONS[position])
    assert find_faults(result) == []
    assert unlist_columns(set(case_row(result))) == set()


@pytest.mark.slow
def test_a_measured_pair_has_the_declared_keys(tmp_path):
    assert call(["fleet", "examples", str(tmp_path / "fleet"), "--wheels", "1", "--rails", "1"]) == 0
    wheel = next((tmp_path / "fleet" / "wheels").iterdir())
    result = solve(Case(wheel=str(wheel), wheel_file=Reading(filter_mm=4.0), refine="never", load_N=60e3))
    assert find_faults(result) == []
    record = result_record(result)
    assert record["verdict"]["variant_count"] == len(record["verdict"]["variant_answers"]) > 0
    assert record["pair_geometry"]
    assert unlist_columns(set(case_row(result))) == set()


@pytest.mark.parametrize("fault", ["missing", "undeclared", "text"])
def test_the_schema_notices_a_fault(elliptic_quick, fault):
    record = json.loads(format_json(result_record(elliptic_quick)))
    if fault == "missing":
        del record["plastic"]
    elif fault == "undeclared":
        record["fe"]["colour"] = 1.0
    else:
        record["normal_force_N"] = "100 kN"
    assert not Draft202012Validator(result_schema()).is_valid(record)


def test_a_key_that_is_not_declared_is_an_error_of_the_program():
    with pytest.raises(fecontact.errors.ProgramError, match="colour"):
        complete_record("theory", {"colour": 1})


def test_the_columns_of_the_stored_studies_are_declared():
    headers = [next(csv.reader(path.read_text("utf-8").splitlines())) for path in sorted(BASELINES.glob("*.csv"))]
    assert headers
    loads = [header for header in headers if "verdict_answer" in header]
    assert len(loads) > 10
    assert unlist_columns({column for header in loads for column in header}) == set()


def test_the_dictionary_is_complete():
    """Every key and column has a meaning; every number has a unit."""
    keys = [*iterate_keys()]
    assert len({key.key for key in keys}) == len(keys) > 200
    assert all(key.meaning for key in keys)
    page = dictionary_page()
    assert all(f"| `{key.key}` |" in page for key in keys)
    columns = [*iterate_columns()]
    assert len(columns) == len(list_column_patterns()) + len(row_column_meanings())
    assert all(column.meaning and column.unit for column in columns)
    assert len(list_columns("of_load")) == len(set(list_columns("of_load")))
    # every top-level key says where it is shown, or is a matter of the file alone
    alone = {"schema", "case", "slide_mm"}
    assert {key.key for key in keys if "." not in key.key and not key.places} <= alone


@pytest.mark.parametrize(
    ("key", "unit"),
    [("p_max_MPa", "MPa"), ("stiffness_GN_per_m15", "GN/m^1.5"), ("spin_per_mm", "1/mm"), ("overlap", "-")],
)
def test_the_unit_is_the_ending_of_the_key(key, unit):
    assert find_unit(key) == unit


def test_the_dictionary_and_the_schema_are_printed(capsys):
    assert call(["keys"]) == 0
    assert capsys.readouterr().out == dictionary_page()
    assert call(["keys", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == result_schema() == fecontact.result_schema()
