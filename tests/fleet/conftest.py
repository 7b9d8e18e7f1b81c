"""Fleets with stand-ins for their finite elements."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest
from made_fleet import Made, made_fleet

from fecontact.features.fleet import sampling
from fecontact.features.fleet.sampling import FleetSample, draw_sample, solve_sample
from fecontact.jobs.engine import RunSettings


@dataclass(frozen=True)
class Outcome:
    rows: tuple
    reused: tuple = ()
    recomputed: dict | None = None
    all_converged: bool = True


@pytest.fixture
def fleet(tmp_path) -> Made:
    return made_fleet(tmp_path / "fleet")


@pytest.fixture
def plant_truth(monkeypatch) -> Callable[[Made], None]:
    """Stand-in for finite elements that returns the true verdicts of a fleet."""

    def stand_in(fleet: Made) -> None:
        """Replace the finite elements of the sample by the planted answers of a fleet."""

        def run_study(study, out, **_) -> Outcome:
            """Rows of a study with the planted answers."""
            rows = []
            for case in study.cases:
                answer = fleet.answer(case)
                verdict = {"verdict_answer": "UNRESOLVED" if answer == "OPEN" else answer, "verdict_cause": None}
                lost = {"status": "failed: no contact point"}
                # a time that the load determines
                solved_row = verdict | {"status": "converged", "cpu_seconds": 1e-4 * case.load_N}
                row = lost if answer == "UNSOLVED" else solved_row
                rows.append({"id": "", **row, "hertz_deviation_p_max_percent": 1.0})
            return Outcome(tuple(rows), recomputed={})

        monkeypatch.setattr(sampling, "run_study", run_study)

    return stand_in


@pytest.fixture
def sampled(plant_truth) -> Callable[..., FleetSample]:
    """Draw and "solve" a number of positions of a fleet."""

    def sample(fleet: Made, draws: int, seed: int | None = None) -> FleetSample:
        plant_truth(fleet)
        sample_drawn = draw_sample(fleet.folder, draws, seed)
        solve_sample(fleet.folder, sample_drawn, fleet.case, RunSettings())
        return sample_drawn

    return sample
