"""Fleets whose finite elements are stood in for."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest
from made_fleet import Made, made_fleet

from fecontact.features.fleet import sampling
from fecontact.features.fleet.sampling import Drawn, draw, solve_sample
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
def known(monkeypatch) -> Callable[[Made], None]:
    """Let finite elements say what is true of a fleet."""

    def stand_in(made: Made) -> None:
        def run_study(study, out, **_) -> Outcome:
            rows = []
            for case in study.cases:
                answer = made.answer(case)
                told = {"verdict_answer": "UNRESOLVED" if answer == "OPEN" else answer, "verdict_cause": None}
                lost = {"status": "failed: no touch point"}
                row = lost if answer == "UNSOLVED" else told | {"status": "converged"}
                rows.append({"id": "", **row, "hertz_deviation_p_max_percent": 1.0})
            return Outcome(tuple(rows), recomputed={})

        monkeypatch.setattr(sampling, "run_study", run_study)

    return stand_in


@pytest.fixture
def sampled(known) -> Callable[..., Drawn]:
    """Draw and "solve" so many positions of a fleet."""

    def sample(made: Made, draws: int, seed: int | None = None) -> Drawn:
        known(made)
        drawn = draw(made.folder, draws, seed)
        solve_sample(made.folder, drawn, made.case, RunSettings())
        return drawn

    return sample
