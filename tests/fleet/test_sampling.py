"""Draw of the positions of a fleet, and its stored files."""

import shutil
from types import SimpleNamespace

import numpy as np
import pytest
from made_fleet import made_fleet

from fecontact.errors import InputError
from fecontact.features.fleet import sampling
from fecontact.features.fleet.sampling import draw_sample
from fecontact.features.fleet.tables import POSITION_COLUMNS, STRATA, open_tables, query_rows
from fecontact.judging.solved_load import ELEMENTS_STATUS


def keys(rows) -> set:
    return {tuple(row[name] for name in POSITION_COLUMNS.split(", ")) for row in rows}


def test_a_larger_sample_keeps_the_smaller_one(fleet, sampled):
    first = sampled(fleet, 60)
    assert len(first.rows) == first.new == 60
    again = draw_sample(fleet.folder, 60)
    assert keys(again.rows) == keys(first.rows)
    assert again.new == 0
    second = sampled(fleet, 200)
    assert (len(second.rows), second.new, second.dropped) == (200, 140, 0)
    assert keys(first.rows) < keys(second.rows)
    with open_tables(fleet.folder) as tables:
        numbers = query_rows(tables, "SELECT draw, count(*) AS number FROM sample GROUP BY draw ORDER BY draw")
        rows = query_rows(tables, "SELECT * FROM sample")
    assert [(row["draw"], row["number"]) for row in numbers] == [(1, 60), (2, 140)]
    truth = {key: fleet.truth[key] for key in keys(rows)}
    assert all(row["fe_verdict"] == truth[tuple(row[name] for name in POSITION_COLUMNS.split(", "))] for row in rows)
    assert {row["fe_p_max_percent"] for row in rows if row["fe_verdict"] != "UNSOLVED"} == {1.0}


def test_another_seed_draws_others_and_is_refused_for_an_old_sample(fleet, sampled):
    assert keys(draw_sample(fleet.folder, 60, seed=2).rows) != keys(draw_sample(fleet.folder, 60, seed=3).rows)
    sampled(fleet, 60, 2)
    assert draw_sample(fleet.folder, 90).seed == 2
    with pytest.raises(InputError, match=r"^seed is -1; allowed: whole numbers from 0 to "):
        draw_sample(fleet.folder, 90, seed=-1)
    with pytest.raises(InputError, match=r"--seed is 3; earlier draws of this sample have seed 2; leave out --seed"):
        draw_sample(fleet.folder, 90, seed=3)
    with pytest.raises(InputError, match="--finite-elements is 1; allowed: at least 2"):
        draw_sample(fleet.folder, 1)


def test_probabilities_are_of_the_draws_of_each_stratum(fleet, sampled):
    sample = sampled(fleet, 150)
    with open_tables(fleet.folder) as tables:
        for name in STRATA:
            stratum_rows = [row for row in sample.rows if row["stratum"] == name]
            weights = tables.execute("SELECT weight FROM screen WHERE stratum = ?", [name]).fetchnumpy()["weight"]
            probabilities = np.array([row["inclusion_probability"] for row in stratum_rows])
            weights_drawn = np.array([row["weight"] for row in stratum_rows])
            scale = (
                np.min(probabilities / weights_drawn)
                if probabilities.max() < 1.0
                else np.max((probabilities / weights_drawn)[probabilities < 1.0])
            )
            # over all positions of the stratum they sum to its draws
            assert np.minimum(1.0, scale * weights).sum() == pytest.approx(len(stratum_rows))
            assert probabilities == pytest.approx(np.minimum(1.0, scale * weights_drawn))
            # what the drawn ones stand for is about the stratum
            assert np.sum(weights_drawn / probabilities) == pytest.approx(weights.sum(), rel=0.05)


def test_positions_are_drawn_by_their_weight(fleet):
    # the mean weight of a drawn position is sum w^2 / sum w, that of all positions is less
    with open_tables(fleet.folder) as tables:
        weights = tables.execute("SELECT weight FROM screen WHERE stratum = 'near'").fetchnumpy()["weight"]
    samples = [
        row["weight"]
        for seed in range(12)
        for row in draw_sample(fleet.folder, 60, seed=seed).rows
        if row["stratum"] == "near"
    ]
    expected, noise = np.sum(weights**2) / np.sum(weights), np.std(samples) / np.sqrt(len(samples))
    assert abs(np.mean(samples) - expected) < 3.0 * noise
    assert np.mean(samples) > np.mean(weights) + 5.0 * noise


def test_a_sample_that_is_interrupted_changes_nothing(fleet, sampled, monkeypatch):
    sampled(fleet, 60)
    before = (fleet.folder / "sample.parquet").read_bytes()

    def killed(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(sampling, "run_study", killed)
    with pytest.raises(KeyboardInterrupt):
        sampling.solve_sample(fleet.folder, draw_sample(fleet.folder, 90), fleet.case, sampling.RunSettings())
    assert (fleet.folder / "sample.parquet").read_bytes() == before


def test_a_population_that_grew_is_drawn_again(fleet, sampled):
    first = sampled(fleet, 120)
    shutil.rmtree(fleet.folder / "screen")
    larger = made_fleet(fleet.folder, wheels=14)
    second = sampled(larger, 120)
    assert len(second.rows) >= 120
    # random numbers belong to positions: most of the old sample is in the new one
    assert second.dropped < 0.4 * len(first.rows)
    assert len(keys(second.rows) & keys(first.rows)) == len(first.rows) - second.dropped


@pytest.mark.parametrize(
    ("status", "answer", "answer_kept"),
    [
        ("converged", "FAILS", "FAILS"),
        ("converged", "UNRESOLVED", "OPEN"),
        # certain by the half-space on every line that the points allow, whatever the elements are
        (ELEMENTS_STATUS, "FAILS", "FAILS"),
        (ELEMENTS_STATUS, "UNRESOLVED", "UNSOLVED"),
        ("not converged", "UNRESOLVED", "UNSOLVED"),
        ("failed: no contact point", None, "UNSOLVED"),
    ],
)
def test_a_certain_failure_counts_as_one(fleet, monkeypatch, status, answer, answer_kept):
    def run_study(study, out, **_):
        verdict = {} if answer is None else {"verdict_answer": answer, "verdict_cause": None}
        row = {"id": "", "status": status, **verdict, "hertz_deviation_p_max_percent": 7.0}
        return SimpleNamespace(rows=tuple(row for _ in study.cases))

    monkeypatch.setattr(sampling, "run_study", run_study)
    sampling.solve_sample(fleet.folder, draw_sample(fleet.folder, 8), fleet.case, sampling.RunSettings())
    with open_tables(fleet.folder) as tables:
        rows = query_rows(tables, "SELECT fe_verdict, fe_status, fe_p_max_percent FROM sample")
    # what elements that must not be used say of the deviation is not kept
    deviation = 7.0 if status == "converged" else None
    assert rows == [{"fe_verdict": answer_kept, "fe_status": status, "fe_p_max_percent": deviation}] * 8


def test_what_is_no_screened_fleet_is_refused(tmp_path):
    with pytest.raises(InputError, match="has no screened fleet"):
        draw_sample(tmp_path, 10)
