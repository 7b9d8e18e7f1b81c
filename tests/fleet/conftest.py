"""Fleets whose finite elements are stood in for."""

from dataclasses import dataclass
from pathlib import Path

import pytest
from made_fleet import Made, made_fleet

from fecontact.fleet import sampling
from fecontact.fleet.sampling import draw, solve_sample
from fecontact.jobs.engine import RunSettings


@dataclass(frozen=True)
class Outcome:
    rows: tuple


@pytest.fixture
def fleet(tmp_path) -> Made:
    return made_fleet(tmp_path / "fleet")


@pytest.fixture
def sampled(monkeypatch):
    """Draw and "solve" so many positions of a fleet: a function of it, which gives what was drawn."""

    def sample(made: Made, draws: int, seed: int | None = None):
        def run_study(study, out: Path, **_):
            rows = []
            for case in study.cases:
                answer = made.answer(case)
                told = {"verdict_answer": "UNRESOLVED" if answer == "OPEN" else answer, "verdict_cause": None}
                lost = {"status": "failed: no touch point"}
                row = lost if answer == "UNSOLVED" else told | {"status": "converged"}
                rows.append({"id": "", **row, "hertz_deviation_p_max_percent": 1.0})
            return Outcome(tuple(rows))

        monkeypatch.setattr(sampling, "run_study", run_study)
        drawn = draw(made.folder, draws, seed)
        solve_sample(made.folder, drawn, made.case, RunSettings())
        return drawn

    return sample
