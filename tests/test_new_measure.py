"""A measure that is added to its declaration works in every command."""

import csv
import json
import re
from pathlib import Path

import pytest
from test_features import PAIR, copied, python

# Two measures that nothing else in the program knows: a ratio of sizes, and a distance from the theory.
MEASURE = """\
    slenderness: float = _measure(
        MeasureUncertainty(reading=0.001, cut_planes=0.002, elements_reading=0.02, strips=0.02),
        lambda patch, rung: patch.b_mm / patch.a_mm,
        lambda theory: theory.half_widths_mm[1] / theory.half_widths_mm[0],
    )
"""
MISFIT = """\
    offset_over_a: float = _measure(
        MeasureUncertainty(reading=0.001, cut_planes=0.004, elements_reading=0.003, strips=0.01),
        lambda patch, rung, theory: (patch.centre_y_mm - theory.centre_mm[1]) / theory.half_widths_mm[0],
        of_theories=lambda pair: pair.distance_mm / pair.theory.half_widths_mm[0],
    )
"""
LIMITS = """\
    slenderness: float = _limit(0.1, "slenderness", "if b / a deviates by less", "slenderness_percent")
    offset: float = _limit(0.5, "offset_over_a", "if the centre is nearer", "offset_percent")
"""
WORDS = """\
[measures.slenderness]
short = "slenderness"
letter = "r"
name = "slenderness"
unit = "-"
meaning = "b over a"
rank = 11

[measures.offset_over_a]
short = "offset"
letter = "o"
name = "offset of the centre"
unit = "-"
meaning = "distance of the centres of pressure over a"
rank = 12

"""
FLEET = """\
theory = "strip"

[wheels]
files = "wheels.csv"

[rails]
files = "rails.csv"

[shifts_mm]
values = [-2.0, 2.0]

[loads_kN]
values = [80]

[case]
inclination = "1:40"
"""


def insert(path: Path, before: str, text: str) -> None:
    """Insert text before the only occurrence of other text in a file."""
    source = path.read_text("utf-8")
    assert source.count(before) == 1, (path, before)
    path.write_text(source.replace(before, text + before), "utf-8")


@pytest.fixture(scope="module")
def tree(tmp_path_factory) -> Path:
    """Copy of the package with both measures."""
    copy = copied(tmp_path_factory.mktemp("measure"), "tests")
    package = copy / "fecontact"
    insert(package / "judging" / "measures.py", "    approach_mm: float = _measure(", MEASURE)
    insert(package / "judging" / "measures.py", "    # Cells at the edge of the patch are either", MISFIT)
    insert(package / "criteria.py", "    judged_by: tuple[str, ...] = choice_field(", LIMITS)
    criteria = package / "criteria.py"
    source = criteria.read_text("utf-8")
    assert source.count('"misplaced"),\n}') == 1
    criteria.write_text(source.replace('"misplaced"),\n}', '"misplaced", "slenderness", "offset"),\n}'), "utf-8")
    insert(package / "outputs" / "words.toml", "[measures.valley]", WORDS)
    return copy


def fecontact(tree: Path, *words: str) -> str:
    """Standard output of a command that must succeed."""
    process = python(tree, "-W", "error", "-m", "fecontact", *words)
    assert process.returncode == 0, process.stderr
    return process.stdout


@pytest.mark.slow
def test_solve_and_judge_have_a_new_measure(tree):
    printed = fecontact(tree, "solve", *PAIR, "--out", "case")
    assert re.search(r"^slenderness \(-\) +0\.75\d* +0\.75\d* .* HOLDS", printed, re.MULTILINE), printed
    assert re.search(r"^offset of the centre \(-\) .* HOLDS", printed, re.MULTILINE)
    record = json.loads((tree / "case" / "result.json").read_text("utf-8"))
    hertz = record["theories"]["hertz"]
    assert abs(hertz["deviation"]["slenderness"]) < hertz["uncertainty"]["slenderness"] < 0.02
    elements = record["elements"]["hertz"]
    assert elements["uncertainty"].keys() >= {"slenderness", "offset_over_a"}
    assert "slenderness" in fecontact(tree, "judge", "case", "--slenderness-percent", "0.01")


@pytest.mark.slow
def test_a_map_has_a_new_measure(tree):
    fecontact(tree, "map", *PAIR, "--shifts", "0", "--loads-kn", "100", "--out", "map")
    with (tree / "map" / "map.csv").open(encoding="utf-8") as file:
        (row,) = csv.DictReader(file)
    assert {name for name in row if "slenderness" in name or "offset" in name}, [*row]


@pytest.mark.slow
def test_a_fleet_screens_a_new_measure(tree):
    fecontact(tree, "fleet", "examples", "fleet", "--wheels", "1", "--rails", "1")
    (tree / "fleet" / "fleet.toml").write_text(FLEET, "utf-8")
    assert "2 positions of 1 pair," in fecontact(tree, "fleet", "run", "fleet/fleet.toml", "--out", "answer")
    script = (
        "import duckdb\n"
        'rows = duckdb.sql("select slenderness_percent, offset_uncertainty_percent, verdict'
        " from 'answer/screen/*.parquet'\").fetchall()\n"
        "assert len(rows) == 2 and all(abs(row[0]) < 100 and row[1] > 0 for row in rows), rows\n"
        "assert all(row[2] != 'REFUSED' for row in rows)\n"
    )
    process = python(tree, "-c", script)
    assert process.returncode == 0, process.stderr
