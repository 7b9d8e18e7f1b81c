"""Two tables of results side by side: every tolerance at both sides of its limit, and nothing lost without a word."""

import csv
import json
import math
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import own_functions
import pytest

from fecontact.cli import call
from fecontact.criteria import Criteria
from fecontact.errors import InputError
from fecontact.outputs.comparison.tables import case_names, head_lines
from fecontact.outputs.records.results import case_row as row_of
from fecontact.outputs.study_files import write_tables
from fecontact.outputs.tables import write_csv
from fecontact.outputs.words import criteria_settings
from fecontact.own_criterion import OwnCriterion
from fecontact.regression.baselines import update_baseline
from fecontact.regression.checks import compare_discretisation
from fecontact.regression.compare import compare_tables
from fecontact.regression.tables import (
    EFFORT_KIND,
    LATER_COLUMN_PREFIXES,
    TEXT_KIND,
    TOLERANCES_BY_KIND,
    find_kind,
    load_table,
    read_tolerances,
)

BASELINES = Path(__file__).parents[1] / "studies" / "baselines"
VERSIONS = {"fecontact": "0.1.0", "gmsh": "4.15.2", "platform": "Linux-6-x86_64"}

# Column, baseline, and the largest accepted difference: written by hand, not taken from the code.
LIMITS = (
    ("fe_p_max_MPa", 1200.0, 0.12),
    ("half_space_p_max_MPa", 1200.0, 0.12),
    ("verdict_limit_utilisation", 2.0, 0.01),
    ("creep_theories_rolling_half_space_fe_fx_N", 2e-12, 30.0),
    ("creep_theories_rolling_half_space_hertz_mz_Nmm", -5e4, 300.0),
    ("creep_creepages_xi", 1e-3, 1e-6),
    ("creep_creepages_spin_per_mm", -2e-4, 3e-9),
    ("hertz_p_max_MPa", 1200.0, 1.2e-3),
    ("von_mises_rail_von_mises_MPa", 800.0, 0.8),
    ("von_mises_rail_depth_mm", 3.0, 3e-3),
    ("fe_area_mm2", 120.0, 0.12),
    ("fe_a_mm", 6.0, 6e-3),
    ("fe_extent_x_mm", 12.0, 12e-3),
    ("fe_centre_y_mm", 1e-19, 2e-3),
    ("fe_centre_x_mm", -12.0, 12e-3),
    ("fe_approach_mm", 0.02, 1e-5),
    ("hertz_approach_mm", 0.02, 2e-8),
    ("contact_rail_y_mm", 700.0, 1e-4),
    ("lateral_shift_mm", 4.0, 4e-8),
    ("normal_force_N", 1e5, 0.1),
    ("contact_angle_mrad", 80.0, 1e-3),
    ("contact_angle_rad", 0.08, 1e-6),
    ("hertz_deviation_area_percent", -12.0, 0.1),
    ("pressure_l2", 0.08, 1e-3),
    ("hertz_deviation_p_max_percent", -0.5, 0.01),
    ("hertz_deviation_approach_percent", 3.0, 0.05),
    ("hertz_uncertainty_area_percent", 6.0, 1.2),
    ("hertz_uncertainty_p_max_percent", 0.6, 0.12),
    ("elements_uncertainty_p_max_percent", 1.0, 0.2),
    ("steps_uncertainty_half_space_to_bodies_p_max_percent", 0.6, 0.12),
    ("hertz_deviation_centre_over_b", -0.26, 1e-3),
    ("hertz_uncertainty_centre_over_b", 0.002, 4e-4),
    ("creep_verdict_uncertainty_of_muN", 2e-5, 1e-5),
    ("hertz_deviation_valley_percent", 22.0, 0.1),
    ("hertz_uncertainty_valley_percent", 0.2, 0.04),
    ("hertz_deviation_separate_load_percent", 0.1, 0.01),
    ("hertz_uncertainty_separate_load_percent", 0.02, 0.004),
    ("hertz_uncertainty_separate_load_percent", 0.0, 0.001),
    ("hertz_deviation_misplaced_load_percent", 15.0, 0.1),
    ("elements_misfit", 0.016, 1e-3),
    ("overlap", 0.9, 1e-3),
    ("hertz_stiffness_GN_per_m15", 100.0, 1e-4),
    ("something_new", 5.0, 5e-4),
)
TEXTS = ("status", "rail", "verdict_answer", "verdict_cause", "verdict_measure", "verdict_failing", "warnings")
TEXTS += ("at_junction", "resolution")


def case_row(name: str = "one", **columns) -> dict:
    return {"id": name, "status": "converged", "rail": "60E1", "fe_p_max_MPa": 1234.5, "fe_area_mm2": 120.0, **columns}


def write_study(folder: Path, rows: list[dict], **entries) -> Path:
    """A result folder as `fecontact run` writes it, as far as it matters here."""
    folder.mkdir(parents=True, exist_ok=True)
    document = {"schema": "fecontact/study/1", "study": "mine", "cases": len(rows), "rows": rows, "versions": VERSIONS}
    (folder / "study.json").write_text(json.dumps(document | entries).replace("NaN", "null"), "utf-8")
    write_csv(rows, folder / "study.csv")
    return folder


def rows_of_frame(values) -> list:
    """The lines of a data frame."""
    return list(values.itertuples())


def compare_rows(tmp_path: Path, baseline: list[dict], new: list[dict], tolerances=None, form: str = ""):
    tables = [load_table(write_study(tmp_path / name, rows) / form) for name, rows in (("was", baseline), ("now", new))]
    return compare_tables(*tables, tolerances)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(("column", "value", "tolerance"), LIMITS, ids=[column for column, *_ in LIMITS])
def test_each_kind_of_number_at_both_sides_of_its_limit(tmp_path, column, value, tolerance, sign):
    inside, outside = (
        compare_rows(tmp_path, [case_row(**{column: value})], [case_row(**{column: value + sign * share * tolerance})])
        for share in (0.98, 1.02)
    )
    assert inside.same
    assert rows_of_frame(inside.columns)[0].column == column
    assert not outside.same
    (difference,) = rows_of_frame(outside.differences)
    assert (difference.column, difference.case) == (column, "one")
    assert difference.times_tolerance == pytest.approx(1.02, rel=1e-3)
    assert difference.difference == pytest.approx(sign * 1.02 * tolerance, rel=1e-3)
    assert difference.tolerance == pytest.approx(tolerance, rel=1e-6)


@pytest.mark.parametrize("path", sorted(BASELINES.glob("*.csv")), ids=lambda path: path.stem)
def test_each_stated_uncertainty_of_a_baseline_that_shrinks_tenfold_is_a_difference(path):
    table = load_table(path)
    columns = [name for name in table.columns if "uncertainty" in name]

    def scale_uncertainties(factor: float):
        rows = table.rows.copy()
        for name in columns:
            rows[name] = [str(factor * float(text)) if text else "" for text in rows[name]]
        return replace(table, rows=rows)

    stated = {(name, case) for name in columns for case, text in table.rows[name].items() if float(text or 0.0)}
    assert len({name for name, _ in stated}) >= 18
    shrunk = compare_tables(table, scale_uncertainties(0.1)).differences
    assert set(zip(shrunk.column, shrunk.case, strict=True)) == stated
    # a random change with the mesh is not a difference
    assert compare_tables(table, scale_uncertainties(1.03)).same


@pytest.mark.parametrize("column", ["fe_patch_count", "fe_lobes", "contact_points"])
def test_counts_of_things_are_exact(tmp_path, column):
    assert compare_rows(tmp_path, [case_row(**{column: 2})], [case_row(**{column: 2.0})]).same
    different = compare_rows(tmp_path, [case_row(**{column: 1})], [case_row(**{column: 2})])
    assert [d.column for d in rows_of_frame(different.differences)] == [column]
    assert rows_of_frame(different.differences)[0].difference == 1.0
    assert math.isinf(rows_of_frame(different.differences)[0].times_tolerance)


@pytest.mark.parametrize("column", TEXTS)
def test_texts_are_exact(tmp_path, column):
    assert compare_rows(tmp_path, [case_row(**{column: "so"})], [case_row(**{column: "so"})]).same
    for text in ("So", "so ", "", None):
        different = compare_rows(tmp_path, [case_row(**{column: "so"})], [case_row(**{column: text})])
        assert [d.column for d in rows_of_frame(different.differences)] == [column]


@pytest.mark.parametrize("prefix", ["", "stripes_"])
def test_two_measures_that_use_as_much_of_their_limits_may_change_places(tmp_path, prefix):
    """Two measures with nearly equal limit utilisation may change places.

    On an exact ellipse, the limit utilisation of STRIPES is 0.01276 or 0.01270, by two measures on two processors.
    """
    share = f"{prefix}limit_utilisation" if prefix else "verdict_limit_utilisation"

    def judged_rows(measure: str, utilisation: float, answer: str = "HOLDS") -> list[dict]:
        return [
            case_row(**{f"{prefix}verdict_answer": answer, f"{prefix}verdict_measure": measure, share: utilisation})
        ]

    was = judged_rows("p_max_MPa", 0.01276)
    assert compare_rows(tmp_path, was, judged_rows("misplaced_load", 0.01270)).same
    differ = rows_of_frame(compare_rows(tmp_path, was, judged_rows("misplaced_load", 0.0247)).differences)
    assert {line.column for line in differ} == {f"{prefix}verdict_measure", share}
    differ = rows_of_frame(compare_rows(tmp_path, was, judged_rows("misplaced_load", 0.01270, "FAILS")).differences)
    assert {line.column for line in differ} == {f"{prefix}verdict_answer"}


def test_a_rail_whose_name_is_a_number_is_text(tmp_path):
    # float("60E1") is 600
    different = compare_rows(tmp_path, [case_row(rail="60E1")], [case_row(rail="600")])
    (rail,) = rows_of_frame(different.differences)
    assert (rail.baseline, rail.new) == ("60E1", "600")
    assert math.isnan(rail.difference)


def test_effort_is_shown_and_not_compared(tmp_path):
    names = ("solver_iterations", "solver_degrees_of_freedom_rail", "seconds", "peak_memory_MB", "solver_load_balance")
    names += ("solver_meshes", "cpu_seconds")
    comparison = compare_rows(tmp_path, [case_row(**dict.fromkeys(names, 1))], [case_row(**dict.fromkeys(names, 99))])
    assert comparison.same
    assert [(c.column, c.new) for c in rows_of_frame(comparison.efforts)] == [(name, "99") for name in names]
    # missing effort columns are accepted too: a baseline has no effort columns
    assert compare_rows(tmp_path / "b", [case_row()], [case_row(**dict.fromkeys(names, 99))]).same


def test_nothing_equals_nothing_only(tmp_path):
    for was, now in ((None, math.nan), (math.nan, ""), (None, None)):
        assert compare_rows(tmp_path, [case_row(fe_b_mm=was)], [case_row(fe_b_mm=now)]).same
    for was, now in ((None, 0.0), (0.0, None), (math.nan, 2.0), (2.0, math.nan)):
        different = compare_rows(tmp_path, [case_row(fe_b_mm=was)], [case_row(fe_b_mm=now)])
        assert [d.column for d in rows_of_frame(different.differences)] == ["fe_b_mm"]
        assert math.isinf(rows_of_frame(different.differences)[0].times_tolerance)


@pytest.mark.parametrize("text", ["nan", "NaN", "-nan", " NAN "])
def test_nan_written_as_text_is_no_number(tmp_path, text):
    for name, value in (("was", "1.5"), ("now", text)):
        (tmp_path / f"{name}.csv").write_text(f"id,a_fe_mm\none,{value}\n")
    assert not compare_tables(load_table(tmp_path / "was.csv"), load_table(tmp_path / "now.csv")).same
    assert compare_tables(load_table(tmp_path / "now.csv"), load_table(tmp_path / "now.csv")).same


def test_a_text_that_a_spreadsheet_would_evaluate_is_guarded_and_read_back(tmp_path):
    rows = [case_row(rail=text) for text in ("=cmd|' /C calc'!A0@1f", "+a", "-a", "@a", "'=a", "60E1")]
    rows = [{**row, "id": str(place)} for place, row in enumerate(rows)]
    folder = write_study(tmp_path / "study", rows)
    with (folder / "study.csv").open(newline="", encoding="utf-8") as file:
        cells = [row["rail"] for row in csv.DictReader(file)]
    assert cells == [*(f"'{row['rail']}" for row in rows[:5]), "60E1"]
    tables = [load_table(folder / f"study.{ending}") for ending in ("csv", "json")]
    for table in tables:
        assert list(table.rows.rail) == [row["rail"] for row in rows]


def test_infinite_values(tmp_path):
    for name, values in (("was", "inf,1,inf"), ("now", "inf,inf,-inf")):
        (tmp_path / f"{name}.csv").write_text(f"id,a_fe_mm,fe_b_mm,fe_p_max_MPa\none,{values}\n")
    comparison = compare_tables(load_table(tmp_path / "was.csv"), load_table(tmp_path / "now.csv"))
    assert {d.column for d in rows_of_frame(comparison.differences)} == {"fe_b_mm", "fe_p_max_MPa"}


def test_missing_and_extra_cases_and_columns_are_differences_and_named(tmp_path):
    common, missing, added = case_row("both"), case_row("gone"), case_row("added")
    comparison = compare_rows(tmp_path, [common, missing], [common, added])
    assert not comparison.same
    assert comparison.cases == ["both"]
    assert comparison.one_sided["missing cases"] == ["gone"]
    assert comparison.one_sided["extra cases"] == ["added"]
    assert rows_of_frame(comparison.differences) == []
    for rows, key in (
        (([case_row(lost_MPa=1.0)], [case_row()]), "missing columns"),
        (([case_row()], [case_row(lost_MPa=1.0)]), "extra columns"),
    ):
        one_sided = compare_rows(tmp_path, *rows)
        assert not one_sided.same
        assert one_sided.one_sided[key] == ["lost_MPa"]
        assert f"1 {key.removesuffix('s')} (1 case, 4 columns in common)" in one_sided.verdict


def test_the_worst_column_is_first_whatever_its_unit(tmp_path):
    was = [case_row("one"), case_row("two")]
    now = [case_row("one", fe_p_max_MPa=1234.5 * (1 + 2e-4)), case_row("two", fe_area_mm2=121.2)]
    comparison = compare_rows(tmp_path, was, now)
    assert [(c.column, c.differing, c.case) for c in rows_of_frame(comparison.columns)[:2]] == [
        ("fe_area_mm2", 1, "two"),
        ("fe_p_max_MPa", 1, "one"),
    ]
    assert [round(d.times_tolerance, 6) for d in rows_of_frame(comparison.differences)] == [10.0, 2.0]
    assert [c.times_tolerance > 0.0 for c in rows_of_frame(comparison.columns)] == [True, True, False, False]
    assert comparison.verdict.startswith("DIFFERENT: 2 values beyond tolerance, worst fe_area_mm2 (10 times")


def test_order_of_rows_and_columns_does_not_matter(tmp_path):
    first, second = case_row("one"), case_row("two", fe_area_mm2=99.0)
    assert compare_rows(tmp_path, [first, second], [dict(reversed(row.items())) for row in (second, first)]).same


def test_csv_and_json_give_the_same_comparison(tmp_path):
    was = [
        case_row("a", fe_patch_count=1, at_junction=False, overlap=0.1 + 0.2, verdict_cause=None),
        case_row("b", fe_patch_count=2),
    ]
    now = [
        case_row("a", fe_patch_count=1, at_junction=True, overlap=0.35, verdict_cause="x"),
        case_row("b", fe_patch_count=math.nan),
    ]
    from_json = compare_rows(tmp_path, was, now, form="study.json")
    from_csv = compare_rows(tmp_path, was, now, form="study.csv")
    assert len(from_json.differences) == len(from_csv.differences) > 0
    for name in ("columns", "differences"):
        assert getattr(from_json, name).equals(getattr(from_csv, name))
    for name in ("cases", "versions", "settings", "one_sided"):
        assert getattr(from_json, name) == getattr(from_csv, name)
    mixed = compare_tables(load_table(tmp_path / "was" / "study.csv"), load_table(tmp_path / "was" / "study.json"))
    assert mixed.same
    assert set(mixed.columns.times_tolerance) == {0.0}
    assert load_table(tmp_path / "was").path.name == "study.json"


def test_versions_and_settings_that_differ_are_shown_and_are_no_difference(tmp_path):
    was = write_study(tmp_path / "was", [case_row()])
    now = write_study(
        tmp_path / "now", [case_row()], study="other", versions={**VERSIONS, "gmsh": "4.13.1", "new": "1"}
    )
    comparison = compare_tables(load_table(was), load_table(now))
    assert comparison.same
    assert comparison.versions == {"gmsh": ("4.15.2", "4.13.1")}
    assert comparison.settings == {"study": ("mine", "other")}


def test_limits_and_functions_of_own_criteria_that_differ_are_shown(tmp_path):
    # as studies and cases record them
    sides = {
        "was": criteria_settings(
            [Criteria(judged_by=("strength",), own=OwnCriterion(own_functions.peak, "mine", 0.1))]
        ),
        "now": criteria_settings(
            [Criteria(judged_by=("strength",), own=OwnCriterion(own_functions.text, "mine", 0.2))]
        ),
    }
    tables = [load_table(write_study(tmp_path / side, [case_row()], **sides[side])) for side in sides]
    settings = compare_tables(*tables).settings
    assert settings["limits"] == ("p_max ±5 %, mine ±10 %", "p_max ±5 %, mine ±20 %")
    was, now = settings["own_functions.mine"]
    assert was.startswith("source ")
    assert was != now
    assert any("setting own_functions.mine: source " in line for line in head_lines(compare_tables(*tables)))


def test_limits_and_functions_of_own_criteria_of_maps_that_differ_are_shown(tmp_path):
    peak, text = (OwnCriterion(function, "mine", 0.1) for function in (own_functions.peak, own_functions.text))
    tables = [
        load_table(write_study(tmp_path / f"{number}", [case_row()], criteria=Criteria(own=criteria).record))
        for number, criteria in enumerate(((peak,), (replace(text, limit=0.2),), None))
    ]
    settings = compare_tables(*tables[:2]).settings
    assert {*settings} == {"own_limits.mine", "own_functions.mine"}
    assert settings["own_limits.mine"] == ("0.1 -", "0.2 -")
    # the criterion is in a single table
    assert compare_tables(tables[0], tables[2]).settings["own_limits.mine"] == ("0.1 -", "none")


def test_a_shift_of_minus_zero_is_zero(tmp_path):
    head = "lateral_shift_mm,load_kN,status\n"
    for name, shift in (("was", "-0.0"), ("now", "0")):
        (tmp_path / f"{name}.csv").write_text(f"{head}{shift},50,converged\n")
    comparison = compare_tables(load_table(tmp_path / "was.csv"), load_table(tmp_path / "now.csv"))
    assert comparison.cases == ["lateral_shift_mm 0, load_kN 50"]
    assert comparison.same


def position_row(shift: float, load: float, name: str = "", **columns) -> dict:
    inputs = {"wheel": "S1002", "lateral_shift_mm": shift, "load_kN": load, "roll_mrad": 0.0, "resolution": "quick"}
    return case_row(name or f"{shift}_{load}_{columns.get('resolution', '')}", **inputs) | columns


def refuse_comparison(capsys, *arguments) -> str:
    """The single line of a refused comparison."""
    assert call(["compare", *map(str, arguments)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.strip().splitlines()) == 1
    return err


POSITIONS = ((-1.0, 50.0), (0.1 + 0.2, 50.0), (0.0, 100.0))


def quick_and_standard(tmp_path: Path) -> tuple[Path, Path]:
    """Equal positions with different order, ids and arithmetic, and a single different value."""
    quick = [position_row(*at) for at in POSITIONS]
    positions = ((-0.0, 100), (0.3, 50.0), (-1, 50))
    standard = [position_row(*at, resolution="standard", fe_area_mm2=121.0 if at[0] < 0 else 120.0) for at in positions]
    return write_study(tmp_path / "quick", quick), write_study(tmp_path / "standard", standard)


@pytest.mark.parametrize("match", ["shift,load", "load_kN, lateral_shift_mm ", "shift,load,lateral_shift_mm,roll,rail"])
def test_cases_are_matched_by_columns_where_ids_differ(tmp_path, capsys, match):
    quick, standard = quick_and_standard(tmp_path)
    comparison = compare_tables(load_table(quick), load_table(standard), match=match.split(","))
    assert len(comparison.cases) == 3
    assert not any(comparison.one_sided.values())
    assert not {"id", "lateral_shift_mm", "load_kN"} & {column.column for column in rows_of_frame(comparison.columns)}
    assert [d.column for d in rows_of_frame(comparison.differences) if d.column != "resolution"] == ["fe_area_mm2"]
    (area,) = (d for d in rows_of_frame(comparison.differences) if d.column == "fe_area_mm2")
    assert "lateral_shift_mm -1" in area.case
    assert "load_kN 50" in area.case
    assert area.difference == 1.0
    assert call(["compare", str(quick), str(standard), "--match", match, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["matched_by"] == list(comparison.baseline.key)
    assert call(["compare", str(quick), str(standard), "--match", match]) == 1
    assert f"cases are matched by {', '.join(comparison.baseline.key)}" in capsys.readouterr().out


def test_matched_columns_are_in_the_order_given_and_numbers_have_nine_digits(tmp_path):
    quick, standard = map(load_table, quick_and_standard(tmp_path))
    comparison = compare_tables(quick, standard, match=["load", "shift"])
    assert comparison.baseline.key == ("load_kN", "lateral_shift_mm")
    assert comparison.cases[1:] == ["load_kN 50, lateral_shift_mm 0.3", "load_kN 100, lateral_shift_mm 0"]
    for off, common in ((1e-11, 1), (1e-7, 0)):
        tables = [[position_row(1.0, 50.0), position_row(9.0, 50.0)], [position_row(1.0 + off, 50.0, "b")]]
        was, now = (load_table(write_study(tmp_path / f"{off}{k}", rows)) for k, rows in enumerate(tables))
        if common:
            assert compare_tables(was, now, match=["shift"]).cases == ["lateral_shift_mm 1"]
        else:
            with pytest.raises(InputError, match="choose fewer or different columns for --match"):
                compare_tables(was, now, match=["shift"])


def test_texts_are_matched_letter_by_letter(tmp_path):
    # float("60E1") is 600
    was, now = ([case_row("a", rail="60E1")], [case_row("b", rail="600")])
    with pytest.raises(InputError, match="rail 60E1 and rail 600"):
        compare_tables(
            *(load_table(write_study(tmp_path / rows[0]["id"], rows)) for rows in (was, now)), match=["rail"]
        )


def test_cases_that_only_one_side_has_are_named_by_what_they_are_matched_by(tmp_path):
    was = load_table(write_study(tmp_path / "was", [position_row(0.0, 50.0), position_row(1.0, 50.0)]))
    now = load_table(write_study(tmp_path / "now", [position_row(0.0, 50.0, "x"), position_row(2.0, 50.0, "y")]))
    comparison = compare_tables(was, now, match=["shift"])
    assert comparison.one_sided["missing cases"] == ["lateral_shift_mm 1"]
    assert comparison.one_sided["extra cases"] == ["lateral_shift_mm 2"]
    assert not comparison.same


def test_two_cases_with_the_same_match_are_refused_and_what_tells_them_apart_is_named(tmp_path, capsys):
    rows = [
        position_row(0.0, 50.0, "one"),
        position_row(0.0, 50.0, "two", resolution="fine", roll_mrad=3.0, fe_p_max_MPa=1300.0),
    ]
    good, bad = write_study(tmp_path / "good", [rows[0]]), write_study(tmp_path / "bad", rows)
    for pair in ((good, bad), (bad, good)):
        err = refuse_comparison(capsys, *pair, "--match", "shift,load")
        assert "'one' and 'two' are both lateral_shift_mm 0, load_kN 50" in err
        assert str(bad) in err
        assert err.rstrip().endswith("add to --match a column in which they differ: roll_mrad, resolution")
    for column in ("roll", "resolution"):
        assert call(["compare", str(bad), str(bad), "--match", f"shift,load,{column}"]) == 0
    capsys.readouterr()
    # a column that is missing in the second table would not help
    for form in ("csv", "json"):
        path = good / f"study.{form}"
        path.write_text(path.read_text().replace("roll_mrad", "rolling"))
    assert "in which they differ: resolution\n" in refuse_comparison(capsys, bad, good, "--match", "shift,load")


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"fe_p_max_MPa": 1300.0}, "no input in both tables distinguishes them; remove one of them"),
        ({"resolution": None, "solver_element_size_mm_x": 0.2}, "in which they differ: solver_element_size_mm_x\n"),
        ({"speed_limit": 7.0}, "in which they differ: speed_limit\n"),
    ],
)
def test_what_tells_two_cases_apart(tmp_path, capsys, changes, says):
    common = {"solver_element_size_mm_x": 0.4, "speed_limit": 5.0}
    rows = [position_row(0.0, 50.0, "one", **common), position_row(0.0, 50.0, "two", **(common | changes))]
    study = write_study(tmp_path / "study", rows)
    assert says in refuse_comparison(capsys, study, study, "--match", "shift")


@pytest.mark.parametrize("missing", [None, "", math.nan])
def test_a_case_without_a_value_to_match_by_is_named(tmp_path, capsys, missing):
    rows = [position_row(0.0, 50.0), position_row(1.0, 50.0, "bad", status="failed: no touch", resolution=missing)]
    study, good = write_study(tmp_path / "study", rows), write_study(tmp_path / "good", rows[:1])
    for pair in ((study, good), (good, study)):
        err = refuse_comparison(capsys, *pair, "--match", "shift,resolution")
        assert "'bad' has no value of resolution (1 of 2 cases have none)" in err
    assert call(["compare", str(study), str(study), "--match", "shift"]) == 0


@pytest.mark.parametrize(
    ("match", "says"),
    [
        ("shft", ["no column 'shft'", "did you mean shift?", "allowed: shift, load, roll, id, status, rail"]),
        ("lateral_shift", ["no column 'lateral_shift'", "did you mean lateral_shift_mm?"]),
        ("shift,lode_kN", ["--match 'lode_kN': no column", "load_kN"]),
        ("yaw", ["no column 'yaw_mrad'"]),
        ("", ["no column ''"]),
        (",", ["no column ''"]),
        ("shift;load", ["no column 'shift;load'"]),
    ],
)
def test_an_unknown_column_to_match_by_is_refused(tmp_path, capsys, match, says):
    study = write_study(tmp_path / "study", [position_row(0.0, 50.0)])
    err = refuse_comparison(capsys, study, study, "--match", match)
    for text in says:
        assert text in err


def test_a_renamed_column_is_refused_with_the_table_that_lacks_it(tmp_path, capsys):
    was = write_study(tmp_path / "was", [position_row(0.0, 50.0)])
    row = {name.replace("lateral_shift_mm", "shift_mm"): value for name, value in position_row(0.0, 50.0, "b").items()}
    now = write_study(tmp_path / "now", [row])
    for pair in ((was, now), (now, was)):
        err = refuse_comparison(capsys, *pair, "--match", "shift,load")
        assert f"--match 'shift': no column 'lateral_shift_mm' in {now / 'study.json'};" in err
        assert "allowed: load, roll, id" in err
    # if a table has a column with the short name, this column is used
    for folder in (was, now):
        for form in ("study.json", "study.csv"):
            spoil(folder / form, "shift_mm" if folder == now else "lateral_shift_mm", "shift")
    assert compare_tables(load_table(was), load_table(now), match=["shift"]).cases == ["shift 0"]


def test_a_solved_case_is_matched_with_a_study(tmp_path):
    study = write_study(tmp_path / "study", [position_row(0.0, 50.0, "a"), position_row(1.0, 50.0, "b")])
    case = write_row(tmp_path / "case", position_row(1.0, 50.0, "c"))
    comparison = compare_tables(load_table(case), load_table(study), match=["shift", "load"])
    assert comparison.cases == ["lateral_shift_mm 1, load_kN 50"]
    assert comparison.one_sided.pop("extra cases") == ["lateral_shift_mm 0, load_kN 50"]
    assert comparison.same


@pytest.mark.parametrize(
    ("was", "now", "says"),
    [
        # quick against standard; the suggestion leaves out columns that are equal in all cases of a table
        (
            [position_row(0.0, 50.0), position_row(1.0, 50.0)],
            [position_row(0.0, 50.0, resolution="fine"), position_row(1.0, 50.0, resolution="fine")],
            ", or match the cases by inputs with --match shift,load (2 in common)\n",
        ),
        # rolls that differ by rounding only
        (
            [position_row(0.0, 50.0, "a", roll_mrad=0.3), position_row(1.0, 50.0, "b", roll_mrad=0.1 + 0.2)],
            [position_row(0.0, 50.0, "c", roll_mrad=0.3), position_row(1.0, 50.0, "d", roll_mrad=0.3)],
            "with --match shift,load (2 in common)\n",
        ),
        # two rails in one table
        (
            [position_row(0.0, 50.0, "a"), position_row(0.0, 50.0, "b", rail="worn")],
            [position_row(0.0, 50.0, "c"), position_row(0.0, 50.0, "d", rail="worn")],
            "with --match shift,load,rail (2 in common)\n",
        ),
        # a different load for all cases
        (
            [position_row(0.0, 50.0), position_row(1.0, 50.0)],
            [position_row(0.0, 60.0), position_row(1.0, 60.0)],
            "with --match shift (2 in common)\n",
        ),
        # a case that failed before its resolution was determined
        (
            [position_row(0.0, 50.0), position_row(1.0, 50.0, "f", resolution=None)],
            [position_row(0.0, 50.0, "x"), position_row(1.0, 50.0, "y")],
            "with --match shift,load (2 in common)\n",
        ),
        # completely different positions
        ([position_row(0.0, 50.0)], [position_row(1.0, 60.0)], ", such as --match shift,load\n"),
        (
            [case_row("a", rail="x")],
            [case_row("b", rail="y")],
            "of the same study, both with or both without --quick\n",
        ),
    ],
)
def test_nothing_in_common_by_id_suggests_what_to_match_by(tmp_path, capsys, was, now, says):
    folders = write_study(tmp_path / "was", was), write_study(tmp_path / "now", now)
    err = refuse_comparison(capsys, *folders)
    assert "have no case in common" in err
    assert err.endswith(says)
    # a suggestion with a number of cases works
    if suggestion := re.search(r"--match (\S+) \((\d+) in common\)", err):
        comparison = compare_tables(*map(load_table, folders), match=suggestion[1].split(","))
        assert len(comparison.cases) == int(suggestion[2])


def test_nothing_is_the_same_without_a_column_to_compare(tmp_path, capsys):
    study = write_study(tmp_path / "study", [{"id": "a", "load_kN": 50.0, "seconds": 1.0}])
    assert "no column to compare except load_kN" in refuse_comparison(capsys, study, study, "--match", "load")
    assert call(["compare", str(study), str(study)]) == 0


def test_a_tolerance_of_a_column_that_is_matched_by_is_refused(tmp_path, capsys):
    study = write_study(tmp_path / "study", [position_row(0.0, 50.0)])
    tolerances = tolerance_file(tmp_path, "[columns.load_kN]\nabsolute = 1\n")
    assert call(["compare", str(study), str(study), "--tolerance", str(tolerances)]) == 0
    capsys.readouterr()
    assert "this column is not compared" in refuse_comparison(
        capsys, study, study, "--tolerance", tolerances, "--match", "load"
    )


def test_exit_codes(tmp_path, capsys):
    was = str(write_study(tmp_path / "was", [case_row()]))
    assert call(["compare", was, was]) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith("SAME, all values are equal (1 case, 4 columns)")
    for name, rows in (
        ("value", [case_row(fe_p_max_MPa=1300.0)]),
        ("extra", [case_row(), case_row("two")]),
        ("text", [case_row(status="not converged")]),
    ):
        assert call(["compare", was, str(write_study(tmp_path / name, rows))]) == 1
        assert "DIFFERENT: 1 " in capsys.readouterr().out
    assert call(["compare", str(tmp_path / "extra"), was]) == 1


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("nothing.csv", None, "no such file"),
        ("empty.csv", "", "empty"),
        ("head.csv", "id,a_fe_mm\n", "no rows"),
        ("other.csv", "time,value\n1,2\n", "neither a column id"),
        ("semicolons.csv", "id;a_fe_mm\none;2\n", "neither a column id"),
        ("twice.csv", "id,a_fe_mm\none,2\none,2\n", "'row 1' and 'row 2' are both one"),
        ("columns.csv", "id,a_fe_mm,a_fe_mm\none,2,3\n", "column name appears twice"),
        ("ragged.csv", "id,a_fe_mm\none,2,3\n", "row 1 has 3 values for 2 columns"),
        ("nameless.csv", "id,a_fe_mm\n,2\n", "no value of id"),
        ("map.csv", "lateral_shift_mm,load_kN\n,3\n", "no value of lateral_shift_mm"),
        ("samecell.csv", "lateral_shift_mm,load_kN\n1,3\n1.0,3.0\n", "are both lateral_shift_mm 1, load_kN 3"),
        ("bytes.csv", b"\xff\xfe\x00", "not CSV"),
        ("broken.json", "{", "is not valid JSON"),
        ("list.json", "[1]", "not a table of results"),
        ("map.json", '{"cells": []}', "no list of rows"),
        ("rows.json", '{"rows": [1]}', "no list of rows"),
        ("result.json", '{"schema": "fecontact/result/1", "status": "converged"}', "no list of rows"),
        ("row.json", '{"schema": "fecontact/row/1", "row": [1]}', "no list of rows"),
        ("emptyrow.json", '{"schema": "fecontact/row/1", "row": {}}', "neither a column id"),
        ("nameless.json", '{"schema": "fecontact/row/1", "row": {"a_fe_mm": 1.0}}', "neither a column id"),
        ("deep.json", "[" * 100_000, "is not valid JSON"),
        ("digits.json", '{"rows": [{"id": ' + 5000 * "1" + "}]}", "is not valid JSON"),
        ("half.json", '{"rows": [{"id": "\\ud800", "a_fe_mm": 1}]}', "is not valid JSON"),
        ("bytes.json", b"\xff\xfe\x00", "is not valid JSON"),
        ("field.csv", "id,a_fe_mm\none," + 140_000 * "1", "not CSV"),
        ("open.csv", 'id,a_fe_mm\n"one,2\n', "not CSV"),
        ("table.txt", "id\n1\n", "ending .txt"),
        ("disjoint.csv", "id,a_fe_mm\nother,2\n", "no case in common"),
    ],
)
def test_unusable_input_is_one_line_and_exit_code_2(tmp_path, capsys, name, text, says):
    good = str(write_study(tmp_path / "good", [case_row()]))
    path = tmp_path / name
    if text is not None:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    for pair in ([good, str(path)], [str(path), good]):
        assert call(["compare", *pair]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.startswith("error: ")
        assert len(err.strip().splitlines()) == 1
        assert says in err


@pytest.mark.parametrize("versions", ["[1]", "3", '"4.15"', "null", '{"gmsh": [1]}', '{"gmsh": {"a": null}}'])
def test_versions_of_another_form_are_none(tmp_path, versions):
    document = '{"rows": [{"id": "one", "a_fe_mm": [1, {}]}], "versions": ' + versions + "}"
    (tmp_path / "study.json").write_text(document)
    assert compare_tables(load_table(tmp_path), load_table(tmp_path)).same


def write_row(folder: Path, row: dict, **entries) -> Path:
    """The table of a folder that `fecontact solve --out` writes."""
    folder.mkdir(parents=True, exist_ok=True)
    document = {"schema": "fecontact/row/1", "row": row, "versions": VERSIONS}
    (folder / "row.json").write_text(json.dumps(document | entries).replace("NaN", "null"), "utf-8")
    return folder


def test_solved_cases_are_compared_by_folder_and_by_file(tmp_path, capsys):
    was = write_row(tmp_path / "was", case_row(fe_b_mm=math.nan))
    same = write_row(tmp_path / "same", case_row(fe_b_mm=None))
    now = write_row(
        tmp_path / "now", case_row(fe_b_mm=None, fe_p_max_MPa=1300.0), versions={**VERSIONS, "gmsh": "4.13.1"}
    )
    for folder in (same, same / "row.json"):
        assert call(["compare", str(was), str(folder)]) == 0
    capsys.readouterr()
    assert call(["compare", str(was / "row.json"), str(now)]) == 1
    out = capsys.readouterr().out
    assert "version gmsh: 4.15.2 -> 4.13.1" in out
    assert "setting" not in out
    assert "worst fe_p_max_MPa (531 times its tolerance)" in out
    # a study with this case has equal columns
    study = load_table(write_study(tmp_path / "study", [case_row(fe_b_mm=None)]))
    assert compare_tables(study, load_table(same)).same
    # if a folder has both, the tables of the study are used
    shutil.copy(now / "row.json", tmp_path / "study")
    assert load_table(tmp_path / "study").path.name == "study.json"


def spoil(path: Path, old: str, new: str) -> None:
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), "utf-8")


@pytest.mark.parametrize("form", ["", ".json", ".csv"])
@pytest.mark.parametrize("spoilt", [".json", ".csv"])
@pytest.mark.parametrize("stem", ["study", "study.part-1-of-2"])
@pytest.mark.parametrize("new", ["1271.5", "1234.50000000001", ""])
def test_a_table_that_was_changed_after_it_was_written_is_refused(tmp_path, capsys, form, spoilt, stem, new):
    for name in ("good", "bad"):
        write_tables("mine", 2, [case_row("two"), case_row("one")], tmp_path / name / stem)
    good, bad = (tmp_path / name / f"{stem}{form or '.csv'}" for name in ("good", "bad"))
    if not form and stem == "study":
        good, bad = good.parent, bad.parent
    assert call(["compare", str(good), str(bad)]) == 0
    capsys.readouterr()
    spoil(tmp_path / "bad" / f"{stem}{spoilt}", "1234.5", new or "null" if spoilt == ".json" else new)
    for pair in ((good, bad), (bad, good)):
        err = refuse_comparison(capsys, *pair)
        assert f"{stem}{spoilt} was changed after it was written" in err
        assert "run the study again, or restore the original files" in err


def test_what_is_no_value_and_the_order_are_the_same_in_csv_and_json(tmp_path):
    rows = [
        case_row(
            "a", fe_b_mm=math.nan, junction_distance_mm=math.inf, at_junction=False, status="failed: two\r\nlines"
        ),
        case_row(
            "b", fe_patch_count=1, overlap=0.1 + 0.2, load_kN=1e22, warnings='"quoted", and; more', verdict_cause=""
        ),
    ]
    study = write_study(tmp_path / "study", rows)
    # infinity is null in JSON and empty in the CSV
    spoil(study / "study.json", "Infinity", "null")
    with (study / "study.csv").open(newline="") as file:
        head, *lines = csv.reader(file)
    with (study / "study.csv").open("w", newline="") as file:
        csv.writer(file).writerows([row[::-1] for row in (head, *lines[::-1])])
    for form in ("", "study.json", "study.csv"):
        assert set(load_table(study / form).rows.index) == {"a", "b"}


def test_a_folder_without_results_is_exit_code_2(tmp_path, capsys):
    good = str(write_study(tmp_path / "good", [case_row()]))
    assert call(["compare", good, str(tmp_path)]) == 2
    assert "a folder of results that fecontact wrote, a study.json, a study.csv, a " in capsys.readouterr().err


def test_nothing_is_left_out_or_broken_where_the_output_is_no_terminal(tmp_path, capsys):
    name = f"fe_{'very_' * 20}long_MPa"
    was, now = (write_study(tmp_path / str(value), [case_row(**{name: value})]) for value in (1000.5, 2000.25))
    assert call(["compare", str(was), str(now)]) == 1
    (line,) = [printed for printed in capsys.readouterr().out.splitlines() if printed.startswith(name)]
    # column, number of differences, case, both values, difference, tolerance, difference divided by tolerance
    assert line.split()[1] == "1/1"
    assert line.split()[-5:] == ["1000.5", "2000.25", "+1e+03", "0.1", "9.99e+03"]


def test_a_table_saved_by_a_spreadsheet_is_read(tmp_path):
    was = write_study(tmp_path / "was", [case_row()]) / "study.csv"
    saved = tmp_path / "saved.csv"
    saved.write_bytes(b"\xef\xbb\xbf" + was.read_bytes().replace(b"\n", b"\r\n"))
    assert compare_tables(load_table(was), load_table(saved)).same


def tolerance_file(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "tolerance.toml"
    path.write_text(text)
    return path


def test_a_tolerance_file_widens_and_narrows(tmp_path):
    was, now = [case_row()], [case_row(fe_p_max_MPa=1234.5 * 1.001, fe_area_mm2=120.06)]
    assert [d.column for d in rows_of_frame(compare_rows(tmp_path, was, now).differences)] == ["fe_p_max_MPa"]
    tolerances = read_tolerances(tolerance_file(tmp_path, "[kinds.pressure]\nrelative = 2e-3\n"))
    assert compare_rows(tmp_path, was, now, tolerances).same
    tolerances = read_tolerances(
        tolerance_file(tmp_path, "[columns.fe_p_max_MPa]\nabsolute = 2\n[kinds.area]\nrelative = 0\n")
    )
    assert [d.column for d in rows_of_frame(compare_rows(tmp_path, was, now, tolerances).differences)] == [
        "fe_area_mm2"
    ]
    # tolerances that are not given stay unchanged
    assert tolerances.of("fe_p_max_MPa").relative == TOLERANCES_BY_KIND["pressure"].relative
    assert tolerances.of("p_max_half_space_MPa").absolute == 0.0


def test_effort_that_is_named_is_compared(tmp_path):
    tolerances = read_tolerances(tolerance_file(tmp_path, "[columns.iterations]\nabsolute = 2\n"))
    assert compare_rows(tmp_path, [case_row(iterations=10)], [case_row(iterations=12)], tolerances).same
    different = compare_rows(tmp_path, [case_row(iterations=10)], [case_row(iterations=13)], tolerances)
    assert [d.column for d in rows_of_frame(different.differences)] == ["iterations"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[kinds.pressure\n", "is not valid TOML"),
        ("[kinds.pressures]\nrelative = 1e-3\n", "pressure, approach"),
        ("[kinds.text]\nrelative = 1e-3\n", "no such kind"),
        ("[kinds.pressure]\nrelativ = 1e-3\n", "kinds.pressure.relativ"),
        ("[kinds.pressure]\nrelative = -1e-3\n", "finite and >= 0"),
        ("[kinds.pressure]\nabsolute = inf\n", "finite and >= 0"),
        ("[kinds.pressure]\nabsolute = nan\n", "finite and >= 0"),
        ("[kinds.pressure]\nabsolute = '1'\n", "kinds.pressure.absolute is '1'"),
        ("[kinds]\npressure = 1e-3\n", "kinds.pressure is 0.001"),
        ("[column.fe_area_mm2]\nrelative = 1\n", "column is"),
        ("[columns.verdict_answer]\nrelative = 1\n", "is text, which is compared exactly"),
        ("[columns.fe_p_mx_MPa]\nrelative = 1\n", "this column is not compared; allowed: status, rail, fe_p_max_MPa"),
    ],
)
def test_a_wrong_tolerance_file_is_exit_code_2(tmp_path, capsys, text, says):
    good = str(write_study(tmp_path / "good", [case_row()]))
    assert call(["compare", good, good, "--tolerance", str(tolerance_file(tmp_path, text))]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.strip().splitlines()) == 1
    assert says in err


def test_a_tolerance_file_that_is_not_there_is_exit_code_2(tmp_path, capsys):
    good = str(write_study(tmp_path / "good", [case_row()]))
    assert call(["compare", good, good, "--tolerance", str(tmp_path / "none.toml")]) == 2
    assert "No such file" in capsys.readouterr().err


def write_reports(tmp_path: Path) -> tuple[str, str]:
    """JSON and HTML of two completely different studies, with special characters of HTML."""
    bad = "<script>alert('&')</script>"
    was = [case_row("a<b>", fe_patch_count=1, strange=1.0, seconds=1.0, verdict_answer="HOLDS"), case_row("gone")]
    now = [
        case_row("a<b>", fe_patch_count=2, strange=1.5, seconds=9.0, verdict_answer=bad, more_MPa=1),
        case_row("added"),
    ]
    folders = [write_study(tmp_path / "was", was), write_study(tmp_path / "now", now, versions={"gmsh": bad})]
    out = tmp_path / "deep"
    assert call(["compare", *map(str, folders), "--out", str(out)]) == 1
    return (out / "comparison.json").read_text("utf-8"), (out / "comparison.html").read_text("utf-8")


def test_json_is_printed_and_older_options_name_what_stands_for_them(tmp_path, capsys):
    same = str(write_study(tmp_path / "one", [case_row()]))
    assert call(["compare", same, same, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["same"] is True
    for older, newer in (
        (
            ["--html", "a.html"],
            "compare --out FOLDER, which writes comparison.json, comparison.html and comparison.png",
        ),
        (["--png", "a.png"], "compare --out FOLDER, which writes comparison.json, comparison.html and comparison.png"),
        (["--json", "a.json"], "--json is a flag without a value; to write a file: --json > a.json"),
        (["--json=a.json"], "--json is a flag without a value; leave out a.json"),
    ):
        assert call(["compare", same, same, *older]) == 2
        assert newer in capsys.readouterr().err


def test_several_cases_at_one_shift_and_load_have_no_picture(tmp_path):
    cases = [case_row(name, lateral_shift_mm=1.0, load_kN=50.0, verdict_answer="HOLDS") for name in ("one", "two")]
    same = str(write_study(tmp_path / "cases", cases))
    assert call(["compare", same, same, "--out", str(tmp_path / "out")]) == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["comparison.html", "comparison.json"]


def test_json_has_everything(tmp_path):
    record = json.loads(write_reports(tmp_path)[0])
    assert record["schema"] == "fecontact/comparison/2"
    assert record["same"] is False
    assert (record["cases"], record["missing_cases"], record["extra_cases"]) == (["a<b>"], ["gone"], ["added"])
    assert (record["missing_columns"], record["extra_columns"]) == ([], ["more_MPa"])
    assert record["default_tolerance_columns"] == ["strange"]
    assert record["versions"]["gmsh"]["baseline"] == "4.15.2"
    by_column = {difference["column"]: difference for difference in record["differences"]}
    assert set(by_column) == {"fe_patch_count", "strange", "verdict_answer"}
    strange = by_column["strange"]
    assert (strange["baseline"], strange["new"], strange["difference"]) == ("1.0", "1.5", 0.5)
    assert strange["times_tolerance"] == pytest.approx(0.5 / 1e-4)
    # infinite, because the tolerance is zero
    assert by_column["fe_patch_count"]["times_tolerance"] is None
    assert [difference["column"] for difference in record["not_compared"]] == ["seconds"]
    assert record["columns"][0]["differing"] == 1
    assert strange["reason"]


def test_html_is_one_well_formed_file_with_all_texts_escaped(tmp_path):
    text = write_reports(tmp_path)[1]
    page = ElementTree.fromstring(text.removeprefix("<!DOCTYPE html>\n"))
    assert page.find(".//script") is None
    assert not re.search(r"https?:|src=|href=\"(?!data:)", text)
    cells = ["".join(cell.itertext()) for cell in page.iter("td")]
    assert "a<b>" in cells
    assert "<script>alert('&')</script>" in cells
    marked = ["".join(line[0].itertext()) for line in page.iter("tr") if line.get("class") == "beyond"]
    assert set(marked) == {"fe_patch_count", "strange", "verdict_answer"}
    bullets = ["".join(bullet.itertext()) for bullet in page.iter("li")]
    assert {"missing cases: gone", "extra cases: added", "extra columns: more_MPa"} <= set(bullets)


def test_reports_are_the_same_each_time(tmp_path):
    first = write_reports(tmp_path)
    assert write_reports(tmp_path) == first


def test_the_terminal_shows_the_worst_first_with_both_values(tmp_path, capsys):
    was = write_study(tmp_path / "was", [case_row(seconds=1.0)])
    now = write_study(tmp_path / "now", [case_row(fe_p_max_MPa=1235.5, fe_area_mm2=132.0, seconds=2.0)])
    assert call(["compare", str(was), str(now)]) == 1
    lines = capsys.readouterr().out.splitlines()
    area, pressure = (next(k for k, line in enumerate(lines) if name in line) for name in ("fe_area", "fe_p_max"))
    assert area < pressure
    assert lines[area].split() == ["fe_area_mm2", "1/1", "one", "120", "132", "+12", "0.12", "100"]
    assert any(line.startswith("not compared: seconds 1 -> 2") for line in lines)
    assert not any(line.startswith("status") for line in lines)


def test_the_terminal_shows_the_worst_columns_and_says_how_many_more_differ(tmp_path, capsys):
    """Rails that differ in a hundred columns, and texts of the width of a terminal."""
    # numbers with many digits are not cut like texts
    many = {f"area{number}_mm2": -0.048264705382461234 for number in range(40)}
    was = write_study(tmp_path / "was", [case_row(**many, reason="38 % of the patch is flat or concave")])
    now = write_study(tmp_path / "now", [case_row(**{name: 2.0 for name in many}, reason="")])
    assert call(["compare", str(was), str(now)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert sum(" 1/1 " in line for line in lines) == 30
    assert "11 further columns differ; for all: --out FOLDER or --json" in lines
    assert any("38 % of the patch..." in line for line in lines)
    assert sum(" -0.048264705 " in line for line in lines) == 29


def test_the_same_shows_only_what_is_not_equal(tmp_path, capsys):
    was = write_study(tmp_path / "was", [case_row(seconds=1.0, fe_patch_count=1)])
    near = write_study(
        tmp_path / "near", [case_row(seconds=1.0, fe_patch_count=1.0) | {"fe_p_max_MPa": 1234.5 * (1 + 5e-5)}]
    )
    equal = write_study(tmp_path / "equal", [case_row(seconds=2.0, fe_patch_count=1.0)])
    assert call(["compare", str(was), str(near)]) == 0
    out = capsys.readouterr().out
    assert "Closest to their tolerance" in out
    assert [line.split()[0] for line in out.splitlines() if " 0/1 " in line] == ["fe_p_max_MPa"]
    assert out.splitlines()[-1] == (
        "SAME within tolerance (1 case, 5 columns; closest: fe_p_max_MPa at 0.5 of its tolerance)"
    )
    assert call(["compare", str(was), str(equal)]) == 0
    out = capsys.readouterr().out
    assert "Closest" not in out
    assert " 0/1 " not in out
    assert out.splitlines()[-1] == "SAME, all values are equal (1 case, 5 columns)"


@pytest.mark.parametrize(
    ("changes", "state", "open_columns", "title"),
    [
        ({}, "same", [], "SAME, all values are equal (1 case, 4 columns)"),
        ({"fe_p_max_MPa": 1234.5 * (1 + 5e-5)}, "same", ["fe_p_max_MPa"], None),
        (
            {"fe_area_mm2": 132.0},
            "different",
            ["fe_area_mm2"],
            "DIFFERENT: 1 value beyond tolerance, worst fe_area_mm2 (100 times its tolerance)"
            " (1 case, 4 columns in common)",
        ),
    ],
)
def test_html_folds_columns_that_are_equal(tmp_path, changes, state, open_columns, title):
    was = write_study(tmp_path / "was", [case_row()])
    now = write_study(tmp_path / "now", [case_row() | changes])
    assert call(["compare", str(was), str(now), "--out", str(tmp_path)]) == int(state == "different")
    text = (tmp_path / "comparison.html").read_text("utf-8")
    page = ElementTree.fromstring(text.removeprefix("<!DOCTYPE html>\n"))
    assert page.find(f".//h1[@class='lead {state}']") is not None
    if title is not None:
        assert page.find(".//title").text == page.find(f".//h1[@class='lead {state}']").text == title
    folded = next(section for section in page.iter("details") if "equal values" in section.findtext("summary"))
    assert not [section for section in page.iter("details") if section.get("open") is not None]
    equal = [name for name in ("status", "rail", "fe_p_max_MPa", "fe_area_mm2") if name not in open_columns]
    assert folded.find("summary").text == f"Columns with equal values: {len(equal)}"
    assert [line[0].text for line in folded.iter("tr") if line[0].tag == "td"] == equal
    tables = {table.findtext("caption"): table for table in page.iter("table")}
    table_of_columns = tables.get("Columns, the worst first")
    lines = [] if table_of_columns is None else table_of_columns.findall("tbody/tr")
    assert [line[0].text for line in lines] == open_columns
    # the different columns are above
    assert table_of_columns is None or text.index("Columns, the worst first") < text.index("<details>")


def test_html_folds_nothing_where_every_column_differs(tmp_path):
    for name, value in (("was", 1.0), ("now", 2.0)):
        (tmp_path / f"{name}.csv").write_text(f"id,a_fe_mm\none,{value}\n")
    page = tmp_path / "comparison.html"
    assert call(["compare", str(tmp_path / "was.csv"), str(tmp_path / "now.csv"), "--out", str(tmp_path)]) == 1
    text = page.read_text("utf-8")
    assert "Columns with equal values" not in text
    assert "Columns, the worst first" in text


def test_cases_are_called_by_what_was_solved(tmp_path, capsys):
    place = {"wheel": "S1002", "lateral_shift_mm": 3.0, "load_kN": 100.0}
    first, second = "60E1_S1002_+3.00mm_100kN_0123abcd", "60E1_S1002_+3.00mm_100kN_89abcdef"
    third = "worn_S1002_-1.50mm_50kN_00000000"
    rows = [case_row(first, **place), case_row(second, **place)]
    rows.append(case_row(third, **place | {"rail": "worn.csv@0123abcd", "lateral_shift_mm": -1.5, "load_kN": 50.0}))
    comparison = compare_rows(tmp_path, rows, rows)
    assert case_names(comparison) == {
        # two cases that differ in other inputs keep the end of their ids
        first: "S1002 on 60E1, +3 mm, 100 kN (0123abcd)",
        second: "S1002 on 60E1, +3 mm, 100 kN (89abcdef)",
        third: "S1002 on worn, -1.5 mm, 50 kN",
    }


def test_a_baseline_is_written_and_compares_with_its_results(tmp_path, capsys):
    rows = [case_row("a", fe_centre_x_mm=4e-19, overlap=1 / 3, fe_patch_count=1, seconds=3.2, verdict_cause=None)]
    study = write_study(tmp_path / "study", rows)
    arguments = ["baseline", "update", str(study), "--baselines", str(tmp_path / "b")]
    assert call([*arguments, "--reason", "  the first  "]) == 0
    assert "new baseline of 1 case\n" in capsys.readouterr().out
    with (tmp_path / "b" / "mine.csv").open() as file:
        (written,) = csv.DictReader(file)
    assert written == {
        **{"id": "a", "status": "converged", "rail": "60E1", "fe_p_max_MPa": "1234.5", "fe_area_mm2": "120"},
        **{"fe_centre_x_mm": "0", "overlap": "0.3333333333", "fe_patch_count": "1", "verdict_cause": ""},
    }
    record = json.loads((tmp_path / "b" / "mine.json").read_text())
    assert (record["study"], record["reason"]) == ("mine", "the first")
    assert record["versions"] == {"fecontact": "0.1.0", "gmsh": "4.15.2"}
    assert call(["compare", str(tmp_path / "b" / "mine.csv"), str(study)]) == 0
    comparison = compare_tables(load_table(tmp_path / "b" / "mine.csv"), load_table(study))
    assert comparison.versions == comparison.settings == {}


def test_a_baseline_is_found_by_its_folder_its_name_and_either_file(tmp_path, capsys):
    study = write_study(tmp_path / "study", [case_row()])
    folder = tmp_path / "own"
    update_baseline(study, folder, reason="first")
    # a file in this folder that is not a baseline
    (folder / "notes.json").write_text("[1]", "utf-8")
    for path in (folder, folder / "mine", folder / "mine.csv", folder / "mine.json"):
        assert call(["compare", str(path), str(study)]) == 0, path
        assert load_table(path).path == folder / "mine.csv"
    for ending in (".csv", ".json"):
        shutil.copy(folder / f"mine{ending}", folder / f"another{ending}")
    capsys.readouterr()
    assert call(["compare", str(folder), str(study)]) == 2
    said = capsys.readouterr().err
    assert f"has 2 baselines; give one of them, such as {folder / 'another.csv'}" in said
    assert "no such file or folder" in refuse_comparison(capsys, folder / "mime", study)


def test_a_baseline_is_not_written_where_nobody_keeps_any(tmp_path, capsys, monkeypatch):
    study = write_study(tmp_path / "study", [case_row()])
    monkeypatch.chdir(tmp_path)
    assert call(["baseline", "update", str(study), "--reason", "first"]) == 2
    assert "studies/baselines does not exist here" in capsys.readouterr().err
    assert not (tmp_path / "studies").exists()
    (tmp_path / "studies" / "baselines").mkdir(parents=True)
    assert call(["baseline", "update", str(study), "--reason", "first"]) == 0
    assert (tmp_path / "studies" / "baselines" / "mine.csv").is_file()


def test_an_update_says_what_changed(tmp_path, capsys):
    folder = tmp_path / "b"
    update_baseline(write_study(tmp_path / "one", [case_row()]), folder, reason="first")
    changed = str(write_study(tmp_path / "two", [case_row(fe_p_max_MPa=1300.0), case_row("two")]))
    assert call(["baseline", "update", changed, "--baselines", str(folder), "--reason", "mended"]) == 0
    out = capsys.readouterr().out
    assert "fe_p_max_MPa" in out
    assert "extra cases: two" in out
    assert "mine.csv: DIFFERENT: 1 value beyond tolerance" in out
    assert json.loads((folder / "mine.json").read_text())["reason"] == "mended"
    assert load_table(folder / "mine.csv").rows.loc["one", "fe_p_max_MPa"] == "1300"
    replaced = update_baseline(write_study(tmp_path / "three", [case_row("x")]), folder, reason="other cases")
    assert replaced.comparison is None
    assert replaced.text == "2 cases replaced by 1 new case"


@pytest.mark.parametrize("reason", ["", "   "])
def test_an_update_without_a_reason_is_refused(tmp_path, capsys, reason):
    study = str(write_study(tmp_path / "study", [case_row()]))
    assert call(["baseline", "update", study, "--reason", reason, "--baselines", str(tmp_path / "b")]) == 2
    assert "reason" in capsys.readouterr().err
    assert call(["baseline", "update", study, "--baselines", str(tmp_path / "b")]) == 2
    assert not (tmp_path / "b").exists()


@pytest.mark.parametrize("status", ["failed: no contact point", "patch at the edge of the fine mesh", None])
def test_an_update_from_unusable_rows_is_refused_unless_allowed(tmp_path, capsys, status):
    study = str(write_study(tmp_path / "study", [case_row(), case_row("two", status=status)]))
    arguments = ["baseline", "update", study, "--reason", "so", "--baselines", str(tmp_path / "b")]
    assert call(arguments) == 2
    assert "--allow-failed" in capsys.readouterr().err
    assert not (tmp_path / "b").exists()
    assert call([*arguments, "--allow-failed"]) == 0
    assert call(["compare", str(tmp_path / "b" / "mine.csv"), study]) == 0


@pytest.mark.parametrize("name", ["", "../mine", "a/b", None])
def test_an_update_needs_the_name_of_the_study(tmp_path, name):
    study = write_study(tmp_path / "study", [case_row()], study=name)
    if name is None:
        (study / "study.json").unlink()
    with pytest.raises(InputError, match=r"name of (a|the) study"):
        update_baseline(study, tmp_path / "b", reason="so")
    assert not (tmp_path / "b").exists()


def test_an_update_needs_a_status(tmp_path):
    with pytest.raises(InputError, match="no column status"):
        update_baseline(write_study(tmp_path / "s", [{"id": "a", "a_fe_mm": 1.0}]), tmp_path / "b", reason="so")


@pytest.mark.parametrize("path", sorted(BASELINES.glob("*.csv")), ids=lambda path: path.stem)
def test_the_baselines_are_whole(path):
    table = load_table(path)
    record = json.loads(path.with_suffix(".json").read_text("utf-8"))
    assert record["study"] == path.stem
    assert record["reason"].strip()
    assert "gmsh" in table.versions
    assert (BASELINES.parent / f"{path.stem}.py").is_file()
    assert set(table.rows.status) == {"converged"}
    assert not [name for name in table.columns if find_kind(name) in (EFFORT_KIND, "default")]


def test_every_column_of_a_result_is_known_and_the_baselines_have_them_all(elliptic_quick):
    columns = list(row_of(elliptic_quick))
    assert [name for name in columns if find_kind(name) == "default"] == []
    compared_columns = tuple(name for name in columns if find_kind(name) != EFFORT_KIND)
    baseline = load_table(BASELINES / "01_elliptic_hertz.csv").columns
    assert baseline == [
        name for name in compared_columns if name in baseline or not name.startswith(LATER_COLUMN_PREFIXES)
    ]


def test_the_tables_that_a_study_writes_fit_each_other(elliptic_quick, tmp_path):
    failed = {
        "id": "b",
        "status": 'failed: a "name", and\ntwo lines\r\n',
        "rail": "60E1",
        "lateral_shift_mm": np.float64(0.1),
    }
    rows = [
        {"id": "a", **row_of(elliptic_quick), "fe_patch_count": np.int64(1), "at_junction": np.True_},
        failed,
    ]
    write_tables("mine", 2, rows, tmp_path / "study")
    tables = [load_table(tmp_path / form) for form in ("", "study.json", "study.csv")]
    assert tables[0].rows.equals(tables[1].rows)
    assert tables[0].rows.equals(tables[2].rows)
    # without a junction, its distance is infinite
    assert math.inf in rows[0].values()


def test_the_discretisation_is_that_of_hertz_s_own_gap(elliptic_quick):
    """Half-space under Hertz's gap, from a row of results.

    A row has the half-space under the true gap and the step to it, from which the half-space under Hertz's gap follows.
    """
    row = {"id": "one", **row_of(elliptic_quick)}
    (check,) = compare_discretisation([row], 1.0)
    quadratic = elliptic_quick.load.ladder.rungs["half_space_quadratic"].p_max_MPa
    assert check.value == pytest.approx(quadratic, rel=1e-12)
    assert check.expected == elliptic_quick.hertz.p0_MPa
    assert check.passed
    assert not compare_discretisation([row], 1e-3)[0].passed


def test_every_kind_is_one_that_exists():
    kinds = {find_kind(column) for column, *_ in LIMITS} | {find_kind(column) for column in TEXTS}
    assert kinds <= {*TOLERANCES_BY_KIND, TEXT_KIND}
    # each kind of number is tested at its limit above; counts have a separate test
    assert {*TOLERANCES_BY_KIND} - kinds == {"count"}
    assert all(tolerance.reason for tolerance in TOLERANCES_BY_KIND.values())


def test_comparing_needs_no_finite_elements(tmp_path):
    shutil.copy(BASELINES / "01_elliptic_hertz.csv", tmp_path / "one.csv")
    heavy = {"skfem", "gmsh", "scipy", "vtk", "pyvista", "matplotlib"}
    code = (
        "import sys; from fecontact.cli import call; code = call(['compare', 'one.csv', 'one.csv']);"
        f"print(code, sorted({heavy!r} & set(sys.modules)))"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert process.stdout.splitlines()[-1] == "0 []"


def test_two_maps_are_compared_by_their_verdicts(tmp_path, capsys):
    pytest.importorskip("fecontact.maps")

    def write_map(name: str, answers: dict[tuple[float, float], str]) -> Path:
        """Write `map.csv` with verdicts by shift (mm) and load (kN)."""
        (tmp_path / name).mkdir()
        cells = [
            {"lateral_shift_mm": shift, "load_kN": load, "status": "converged", "verdict_answer": answer}
            for (shift, load), answer in answers.items()
        ]
        write_csv(cells, tmp_path / name / "map.csv")
        return tmp_path / name

    was = {(-4.0, 50.0): "HOLDS", (-4.0, 80.0): "HOLDS", (0.0, 50.0): "HOLDS", (0.0, 80.0): "", (4.0, 50.0): "FAILS"}
    now = was | {(-4.0, 80.0): "FAILS", (0.0, 50.0): "FAILS", (0.0, 80.0): "HOLDS"}
    folders = [str(write_map(name, answers_of_map)) for name, answers_of_map in (("was", was), ("now", now))]
    assert call(["compare", *folders, "--out", str(tmp_path / "changes")]) == 1
    printed = " ".join(capsys.readouterr().out.split())
    assert "differs in 3 of 5 cases: HOLDS -> FAILS 2 times, failed -> HOLDS 1 time." in printed
    assert "HOLDS FAILS 2 -4 mm: 80 kN; +0 mm: 50 kN" in printed
    first, second = json.loads((tmp_path / "changes" / "comparison.json").read_text())["changed_verdicts"]
    assert first == {"baseline": "HOLDS", "new": "FAILS", "cases": 2, "where": "-4 mm: 80 kN; +0 mm: 50 kN"}
    assert second["where"] == "+0 mm: 80 kN"
    assert (tmp_path / "changes" / "comparison.png").stat().st_size > 5000
    # if matched by other columns, cases keep their shift and load
    assert call(["compare", *folders, "--match", "shift,load"]) == 1
    assert "differs in 3 of 5 cases" in " ".join(capsys.readouterr().out.split())
    assert call(["compare", folders[0], folders[0]]) == 0
    assert "The verdict on Hertz is unchanged (5 cases)." in capsys.readouterr().out
