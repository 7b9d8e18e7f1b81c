"""Ellipses that share the load, next to Hertz at the first contact point.

Tested in rows, tables, reports, maps and comparisons. The contacts come from the true gap on a half-space, which
replaces the finite elements.
"""

import csv
import io

import pytest
from rich.console import Console
from rungs import on_half_space

from fecontact.case import Case
from fecontact.contact_theories.registry import MULTI_HERTZ
from fecontact.judging.judge import judge_load
from fecontact.outputs.records.cheapest import judgements_of_other_theories
from fecontact.outputs.records.results import load_row
from fecontact.outputs.study_report import parts_of_rows
from fecontact.outputs.tables import write_csv
from fecontact.outputs.terminal import print_parts
from fecontact.outputs.verdict_words import cheapest_text_of_row
from fecontact.regression.compare import compare_tables
from fecontact.regression.tables import LATER_COLUMN_PREFIXES, find_kind, load_table
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

LOAD_N = 50e3


def position(shift_mm):
    """One load of a wheelset at a shift, solved on a half-space."""
    case = Case(lateral_shift_mm=shift_mm, roll="touching", load_N=LOAD_N)
    placement = place_case(case)
    _, expected = expect_on_half_space(case, placement)
    solved_load = on_half_space(case, placement, expected.half_space, (200, 100))
    return judge_load(solved_load, placement), placement


@pytest.fixture(scope="module")
def two():
    """At 5 mm the wheel stands on the top of the head and on the gauge corner."""
    return position(5.0)


@pytest.fixture(scope="module")
def single():
    return position(-4.0)


def test_a_row_says_how_several_ellipses_do(two):
    load, placement = two
    row, judgement = load_row(load, placement), load.judgements[MULTI_HERTZ]
    assert row["verdict_answer"] == "FAILS"
    assert row["contact_points"] == len(judgement.approximation.patches) == 2
    assert not judgement.approximation.overlapping
    assert row["multi_hertz_verdict_answer"] == judgement.verdict.answer == "HOLDS"
    assert row["cheapest_theory"] == MULTI_HERTZ
    # within the limit of 5 %, where a third of the load on another patch leaves one ellipse far off
    assert row["multi_hertz_deviation_p_max_percent"] == 1e2 * judgement.deviation["p_max_MPa"]
    assert abs(row["multi_hertz_deviation_p_max_percent"]) < 5.0 < 30.0 < row["hertz_deviation_p_max_percent"]
    worst = max(abs(judgement.deviation[name]) / limit for name, limit in load.case.criteria.limits.items())
    assert row["multi_hertz_limit_utilisation"] == judgement.limit_utilisation == worst < 1.0


def test_a_single_ellipse_has_no_columns_of_its_own(single):
    row = load_row(*single)
    assert MULTI_HERTZ not in judgements_of_other_theories(single[0])
    assert not [name for name in row if name.startswith("multi_hertz_")]
    assert row["cheapest_theory"] == "hertz"
    assert cheapest_text_of_row(row) == ""


def test_every_column_has_a_known_kind(two):
    assert not [name for name in load_row(*two) if find_kind(name) == "default"]


def printed(rows, width=200):
    text = io.StringIO()
    print_parts(parts_of_rows(rows), Console(file=text, width=width))
    return text.getvalue()


def test_the_table_shows_them_where_there_are_any(two, single):
    rows = [load_row(*single), load_row(*two)]
    text = printed(rows)
    assert "; rolled until both wheels touch" in text.splitlines()[0]
    assert (
        "+5.00 mm, 50 kN: cheapest theory that holds: Hertz at all contact points, as springs (p_max +3.5 %, area"
        in text
    )
    assert "springs" not in printed(rows[:1])
    # where there is no room the line below says it
    narrow = printed(rows, width=80)
    assert "Hertz at all contact points, as springs (p_max" in narrow.replace("\n", " ")


def test_rows_of_a_csv_say_the_same(two, tmp_path):
    row = load_row(*two)
    (row_read,) = csv.DictReader(write_csv([row], tmp_path / "one.csv").read_text("utf-8").splitlines())
    assert cheapest_text_of_row(row_read) == cheapest_text_of_row(row) != ""


def compared(old, new, tmp_path):
    paths = []
    for name, rows in (("old", old), ("new", new)):
        (tmp_path / name).mkdir(exist_ok=True)
        paths.append(write_csv([{"id": str(k), **row} for k, row in enumerate(rows)], tmp_path / name / "study.csv"))
    return compare_tables(*map(load_table, paths))


def test_a_baseline_of_before_is_no_difference_and_one_of_today_is(two, single, tmp_path):
    rows = [load_row(*single), load_row(*two)]
    before = [
        {name: value for name, value in row.items() if not name.startswith(LATER_COLUMN_PREFIXES)} for row in rows
    ]
    older = compared(before, rows, tmp_path)
    assert older.same
    assert older.one_sided["extra columns"] == []
    assert set(older.later_columns) == {name for name in rows[1] if name.startswith(LATER_COLUMN_PREFIXES)}
    # what a baseline has must not go
    lost = compared(rows, before, tmp_path)
    assert not lost.same
    assert lost.one_sided["missing columns"] == older.later_columns
    # nor change
    comparison = compared(rows, [rows[0], rows[1] | {"multi_hertz_verdict_answer": "FAILS"}], tmp_path)
    assert list(comparison.differences.column) == ["multi_hertz_verdict_answer"]
    # a baseline that has some of them has all
    some = [rows[0], {name: value for name, value in rows[1].items() if name != "multi_hertz_limit_utilisation"}]
    assert compared(some, rows, tmp_path).one_sided["extra columns"] == ["multi_hertz_limit_utilisation"]
