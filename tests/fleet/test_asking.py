"""The commands `fleet sample` and `fleet report`."""

import json

import pytest

from fecontact.cli import call
from fecontact.features.fleet import checking
from fecontact.features.fleet.answer import evaluate_fleet
from fecontact.features.fleet.report import write_headline
from fecontact.runs.study import StudyOutcome


@pytest.fixture
def opened(fleet, plant_truth, monkeypatch):
    """A fleet with stand-ins for its cases and finite elements.

    Returns its folder as text.
    """
    monkeypatch.setattr(checking, "open_fleet", lambda folder: fleet)
    plant_truth(fleet)
    return str(fleet.folder)


def test_sample_and_report(fleet, opened, capsys):
    assert call(["fleet", "sample", opened, "--finite-elements", "60"]) == 0
    said = capsys.readouterr()
    assert "60 positions, 60 of them new" in said.err
    assert f"next: fecontact fleet report {opened}" in said.out
    assert call(["fleet", "sample", opened, "--finite-elements", "60"]) == 0
    assert "60 positions, 0 of them new" in capsys.readouterr().err
    assert call(["fleet", "report", opened]) == 0
    said = capsys.readouterr().out
    answer = evaluate_fleet(fleet.folder)
    assert said.startswith(write_headline(answer) + ".")
    assert f"report: {fleet.folder / 'report.html'}" in said
    assert call(["fleet", "report", opened, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert (rows[0]["value"], rows[0]["drawn"]) == ("all", 60)
    assert len(rows) == 1 + len(answer.groups)


def test_a_sample_says_which_positions_were_not_solved_and_why(fleet, opened, capsys, monkeypatch):
    """Exit code 3 for unsolved positions of a sample."""
    rows = [{"id": "one", "status": "converged"}, {"id": "two", "status": "failed: no contact point"}]
    outcome = StudyOutcome(rows=tuple(rows), conclusion=None)
    monkeypatch.setattr("fecontact.features.fleet.sampling.solve_sample", lambda *_: outcome)
    assert call(["fleet", "sample", opened, "--finite-elements", "60"]) == 3
    assert "1 of 2 positions not solved:\n  two: failed: no contact point\n" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["sample", "--finite-elements", "1"], "--finite-elements is 1; allowed: at least 2"),
        (["sample", "--part", "1/2"], "--part is 1/2; a sample cannot be solved in parts"),
    ],
)
def test_what_cannot_be_is_refused(opened, capsys, words, said):
    assert call(["fleet", words[0], opened, *words[1:]]) == 2
    assert said in capsys.readouterr().err


def test_a_folder_without_a_fleet_is_refused(tmp_path, capsys):
    assert call(["fleet", "report", str(tmp_path)]) == 2
    assert "has no screened fleet" in capsys.readouterr().err
