"""Checks of results against references, and the table that they make."""

import math
import re
from pathlib import Path

import pytest
from inline import inline_crew
from pictures import draw_nothing

from fecontact.cli import call
from fecontact.regression.check_pages import UnsolvedCases, render_reports
from fecontact.regression.checks import Check, compare_discretisation

LOST = UnsolvedCases(study="03_three", reason="some_case (not converged)")


def check(value: float, expected: float | None = 100.0, limit: float = 2.0, **settings: object) -> Check:
    """Check of a peak pressure with expected value and limit (%)."""
    return Check(
        quantity="p_max, MPa",
        case="one",
        reference="a book",
        kind="analytic",
        value=value,
        expected=expected,
        limit_percent=limit,
        **settings,
    )


@pytest.mark.parametrize(
    ("value", "expected", "passed"),
    [
        (101.9, 100.0, True),
        (98.1, 100.0, True),
        (102.1, 100.0, False),
        (97.9, 100.0, False),
        (math.nan, 100.0, False),
        (1.9, None, True),
        (2.1, None, False),
        (-2.1, None, False),
    ],
)
def test_a_check_passes_within_its_limit(value, expected, passed):
    assert check(value, expected).passed == passed


def test_each_study_has_a_page_and_a_line_that_says_what_failed():
    checks = {
        "01_one": [check(101.0, uncertainty_percent=0.5, explanation="cells"), check(105.0)],
        "02_two": [check(1.0, None)],
    }
    questions = {"01_one": "Is it right?"}
    files = render_reports(checks, questions, {"fecontact": "1", "absent": None}, [LOST])
    assert list(files) == ["VALIDATION.md", "validation/01_one.md", "validation/02_two.md"]
    text, first, second = files.values()
    assert text.startswith(
        "# Validation\n\n3 checks: 1 failed, 1 model difference.\n\n"
        "- 01_one, failed: p_max, MPa: +5.00 % (limit 2 %) in one."
        " The reason is not known.\n- 03_three, not solved: some_case (not converged)\n\n"
    )
    # 5 % of 2 %; 1 % over 0.5 %
    assert "| [01_one](validation/01_one.md) | Is it right? | 2 | 1 | 1 | 2.5 | 2 |" in text.splitlines()
    assert "| [02_two](validation/02_two.md) |  | 1 | 0 | 0 | 0.5 |  |" in text.splitlines()
    assert first.startswith(
        "# Validation: 01_one\n\nIs it right?\n\n2 checks: 1 failed, 1 model difference.\n\n"
        "- 01_one, failed: p_max, MPa: "
    )
    assert "## Against a book (analytic; no uncertainty)" in first
    lines = [*first.splitlines(), *second.splitlines()]
    assert "| p_max, MPa | one | 100 | 101 | 0.5 % | +1.00 % | 2 | 2 % | model difference | cells |" in lines
    assert sum("| **FAIL** |" in line for line in lines) == 1
    assert sum("| pass |" in line for line in lines) == 1
    assert "fecontact 1" in text
    assert "absent" not in text


def test_lines_of_studies_that_were_not_run_are_kept():
    first = render_reports(
        {"01_one": [check(101.0)], "02_two": [check(105.0)]}, {"01_one": "?", "02_two": "!"}, {}, [LOST]
    )
    again = render_reports(
        {"02_two": [check(101.0)] * 2}, {"02_two": "!"}, {"fecontact": "1"}, [], first["VALIDATION.md"]
    )
    assert list(again) == ["VALIDATION.md", "validation/02_two.md"]
    text = again["VALIDATION.md"]
    assert "3 checks: 0 failed, 0 model differences." in text
    assert "fecontact 1. The last run had only 02_two." in text
    assert "- 03_three, not solved: some_case (not converged)\n" in text
    lines = [line for line in text.splitlines() if line.startswith("| [")]
    assert [line[3:9] for line in lines] == ["01_one", "02_two"]
    assert lines[0] in first["VALIDATION.md"]
    text_of_all = render_reports(
        {"01_one": [], "02_two": []}, {"01_one": "", "02_two": "", "03_three": ""}, {}, [], text
    )
    assert "The last run" not in text_of_all["VALIDATION.md"]
    assert "0 checks: 0 failed, 0 model differences." in text_of_all["VALIDATION.md"]
    assert "not solved" not in text_of_all["VALIDATION.md"]


def test_a_check_without_a_number_stands_out():
    """A check without a number is the largest of its study.

    Limits of zero and uncertainties of zero are not divisors.
    """
    checks = [check(math.nan, uncertainty_percent=0.5), check(101.0, uncertainty_percent=0.0), check(0.0, None, 0.0)]
    (line,) = [
        row for row in render_reports({"one": checks}, {}, {}, [])["VALIDATION.md"].splitlines() if "[one]" in row
    ]
    assert line.endswith("| 3 | 1 | 0 | nan | nan |")


def test_the_table_links_to_a_page_of_each_study():
    root = Path(__file__).parents[1] / "studies"
    links = re.findall(r"\(validation/(\w+)\.md\)", (root / "VALIDATION.md").read_text("utf-8"))
    assert sorted(links) == sorted(path.stem for path in (root / "validation").glob("*.md"))
    assert all((root / f"{name}.py").exists() for name in links)
    counts = re.findall(r"^\| \[.*? \| (\d+) \| (\d+) \| (\d+) \|", (root / "VALIDATION.md").read_text("utf-8"), re.M)
    pages = [(root / "validation" / f"{name}.md").read_text("utf-8") for name in links]
    answers = ("| pass |", "| **FAIL** |", "| model difference |")
    numbers = [[page.count(answer) for answer in answers] for page in pages]
    assert [[int(count) for count in row] for row in counts] == [[sum(row), *row[1:]] for row in numbers]
    # what the numbers do not say is beside each of these rows
    assert [line for page in pages for line in page.splitlines() if "| model difference |  |" in line] == []


def test_discretisation_is_checked_on_the_worst_row():
    # half-space pressures of Hertz's gap
    rows = [
        {"id": "good", "half_space_quadratic_p_max_MPa": 1000.8, "hertz_p_max_MPa": 1000.0},
        {"id": "bad", "half_space_quadratic_p_max_MPa": 993.0, "hertz_p_max_MPa": 1000.0},
    ]
    (checked,) = compare_discretisation(rows, 0.5)
    assert checked.case == "worst of 2: bad"
    assert checked.deviation_percent == pytest.approx(-0.7)
    assert not checked.passed
    (checked,) = compare_discretisation(rows[:1], 0.5)
    assert checked.value == pytest.approx(1000.8)
    assert checked.passed
    assert compare_discretisation([], 0.5) == []


STUDY = """
from fecontact.case import Case
from fecontact.regression.checks import Check

def cases(quick=False):
    shape = dict(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
    good = Case(**shape, resolution=(2.0, 1.5), refine="never")
    return [good, Case(**shape, load_N=1e9)] if quick else [good]

def checks(rows):
    return [
        Check(quantity="p_max, MPa", case="R 300", reference="Hertz", kind="analytic",
              value=row["fe_p_max_MPa"], expected=row["hertz_p_max_MPa"], limit_percent=LIMIT)
        for row in rows
    ]
"""


@pytest.mark.slow
def test_validate_runs_studies_and_fails_with_a_check(tmp_path, capsys, monkeypatch):
    # what processes and pictures cost is not looked at here
    monkeypatch.setattr("fecontact.jobs.engine.make_process_crew", lambda workers, threads: inline_crew())
    draw_nothing(monkeypatch)
    for name, limit in (("good", 2.0), ("bad", 1e-9)):
        (tmp_path / f"{name}.py").write_text(STUDY.replace("LIMIT", str(limit)))
    options = ["--out", str(tmp_path / "out"), "--workers", "1"]
    assert call(["validate", str(tmp_path / "good.py"), *options]) == 0
    assert "1 check: 0 failed" in (tmp_path / "out" / "VALIDATION.md").read_text("utf-8")
    assert "| R 300 |" in (tmp_path / "out" / "validation" / "good.md").read_text("utf-8")
    written = tmp_path / "table.md"
    assert call(["validate", str(tmp_path / "bad.py"), *options, "--report", str(written)]) == 1
    assert "1 check: 1 failed" in written.read_text("utf-8")
    assert "FAIL p_max" in capsys.readouterr().out
    # a case without a usable result is no check that passed
    assert call(["validate", str(tmp_path / "good.py"), *options, "--quick"]) == 3
    assert "- good, not solved: " in (tmp_path / "out" / "VALIDATION.md").read_text("utf-8")
    # checks that cannot be made leave those of the other studies
    refused = STUDY.replace("    return [\n        Check", "    Case(load_N=-1.0)\n    return [\n        Check")
    (tmp_path / "refused.py").write_text(refused.replace("LIMIT", "2.0"))
    assert call(["validate", str(tmp_path / "refused.py"), str(tmp_path / "good.py"), *options]) == 3
    table = (tmp_path / "out" / "VALIDATION.md").read_text("utf-8")
    assert "1 check: 0 failed" in table
    assert "- refused, not solved: error in its checks: " in table


def test_validate_needs_a_study_with_checks(tmp_path, capsys):
    (tmp_path / "plain.py").write_text(STUDY.replace("def checks", "def nothing"))
    assert call(["validate", str(tmp_path / "plain.py"), "--out", str(tmp_path / "out")]) == 2
    assert "checks(rows)" in capsys.readouterr().err
