"""Are a wrong load and a wrong correction of the elements noticed?

Each fault is planted in the solution. The profiles, the gap and the material of the elements stay as they are.
"""

from dataclasses import replace

import numpy as np
import pytest

from fecontact.case import Case
from fecontact.contact.elements import UnitResponse
from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact.halfspace import build_half_space_compliance
from fecontact.judging.judge import judge_load
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.solution_faults import CORRECTION_ERROR_LIMIT, LOAD_ERROR_LIMIT, describe_solution_faults
from fecontact.judging.solved_load import REFERENCES_STATUS
from fecontact.outputs.records.stored import solved_from_record, solved_record
from fecontact.solving.meshes import CoupledProblem, Meshes
from fecontact.solving.position import Position, expect_position
from fecontact.solving.solution_checks import compute_correction_error, compute_load_error
from fecontact.solving.true_gap import TrueGap

ROUND = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, resolution="quick", refine="never")
TREAD = Case(lateral_shift_mm=-4.0, resolution="quick", refine="never")
TWO_PATCHES = Case(lateral_shift_mm=5.0, load_N=50e3, resolution="quick", refine="never")
YAWED = Case(lateral_shift_mm=3.0, yaw_rad=8e-3, resolution="quick", refine="never")


def judge_position(position: Position) -> JudgedLoad:
    return judge_load(Meshes(position).solve(position), position.placement)


# --- healthy solutions ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(TREAD, id="tread"),
        pytest.param(TWO_PATCHES, id="two patches in bands"),
        pytest.param(YAWED, id="yaw, on whole bodies"),
        pytest.param(replace(TREAD, lateral_shift_mm=6.0, load_N=40e3), id="gauge corner"),
    ],
)
def test_a_right_solution_is_far_within_both_limits(case):
    load = judge_position(expect_position(case))
    assert load.solved.load_error < 0.01 * LOAD_ERROR_LIMIT
    assert all(abs(level.correction_error) < 0.2 * CORRECTION_ERROR_LIMIT for level in load.solved.levels)
    assert describe_solution_faults(load.solved) == ()
    assert load.status == "converged"


def test_results_without_these_checks_are_read(elliptic_quick):
    """Earlier versions stored none."""
    solution, arrays = elliptic_quick.load.solved, {}
    record = solved_record(solution, arrays)
    assert record["load_error"] == solution.load_error < 0.01 * LOAD_ERROR_LIMIT
    del record["load_error"]
    for level in record["levels"]:
        del level["correction_error"]
    restored = solved_from_record(record, arrays, solution.case)
    assert restored.load_error is None
    assert all(level.correction_error is None for level in restored.levels)
    assert describe_solution_faults(restored) == ()
    assert judge_load(restored, elliptic_quick.placement).status == "converged"


# --- loads ------------------------------------------------------------------------------------------------------------


def load_the_half_space(monkeypatch) -> None:
    """Increase the load of every contact on a half-space or on finer nodes."""
    plain = TrueGap.solve
    monkeypatch.setattr(TrueGap, "solve", lambda self, grid, load_N, **how: plain(self, grid, 1.02 * load_N, **how))


def load_the_finer_nodes(monkeypatch) -> None:
    plain = TrueGap.solve

    def wrong(self, grid, load_N, *, added=None, **how):
        return plain(self, grid, load_N if added is None else 1.02 * load_N, added=added, **how)

    monkeypatch.setattr(TrueGap, "solve", wrong)


def load_the_elements(monkeypatch) -> None:
    plain = CoupledProblem.solve
    monkeypatch.setattr(CoupledProblem, "solve", lambda self, load_N, **how: plain(self, 1.02 * load_N, **how))


def load_everything(monkeypatch) -> None:
    load_the_half_space(monkeypatch)
    load_the_elements(monkeypatch)


@pytest.mark.parametrize("plant", [load_the_half_space, load_the_finer_nodes, load_the_elements, load_everything])
def test_a_wrong_load_has_no_verdict(monkeypatch, plant):
    """Without this check, the numbers differ by up to 3.1 times their stated uncertainty."""
    plant(monkeypatch)
    load = judge_position(expect_position(ROUND))
    assert load.solved.load_error == pytest.approx(0.02, rel=1e-6)
    assert (load.status, load.verdict.answer) == (REFERENCES_STATUS, "UNRESOLVED")
    assert any("differs by 0.02 of itself from the load of the case" in warning for warning in load.warnings)


def test_the_load_of_a_contact_is_that_along_the_load(elliptic_quick):
    """The pressure of a rung on a gauge corner acts along normals that turn."""
    position = expect_position(replace(TREAD, lateral_shift_mm=6.0, load_N=40e3))
    rung, true_gap = position.expected.half_space, position.true_gap
    assert compute_load_error(true_gap, 40e3, [rung]) < 0.01 * LOAD_ERROR_LIMIT
    # along the normal at the first contact point the force is larger by several per cent
    assert abs(compute_load_error(replace(true_gap, direction=true_gap.placement.first.normal), 40e3, [rung])) > 0.02


# --- correction of the elements ---------------------------------------------------------------------------------------


def plant_correction(monkeypatch, factor: float) -> None:
    """Multiply the correction of the elements' softness by a factor."""
    plain = UnitResponse.half_space_of_elements

    def wrong(self, **how):
        right, half_space = plain(self, **how), build_half_space_compliance(self.grid, self.contact_modulus_MPa)
        return lambda pressure: half_space(pressure) + factor * (right(pressure) - half_space(pressure))

    monkeypatch.setattr(UnitResponse, "half_space_of_elements", wrong)


@pytest.mark.parametrize(
    ("case", "factor"),
    [
        pytest.param(ROUND, 0.0, id="left out"),
        pytest.param(ROUND, 2.0, id="doubled", marks=pytest.mark.slow),
        pytest.param(ROUND, 0.5, id="half of it", marks=pytest.mark.slow),
        pytest.param(TWO_PATCHES, 0.0, id="left out, two patches in bands"),
        pytest.param(YAWED, 2.0, id="doubled, whole bodies", marks=pytest.mark.slow),
    ],
)
def test_a_wrong_correction_of_the_elements_has_no_verdict(monkeypatch, case, factor):
    """Without this check, a missing correction causes 1.7 times the stated uncertainty."""
    plant_correction(monkeypatch, factor)
    load = judge_position(expect_position(case))
    for level in load.solved.levels:
        assert level.correction_error == pytest.approx(1.0 - factor, abs=0.02)
    assert (load.status, load.verdict.answer) == (REFERENCES_STATUS, "UNRESOLVED")
    assert any("correction of the elements' softness" in warning for warning in load.warnings)


def test_a_smooth_opening_is_not_taken_for_softness():
    """A parabola along the track that is much larger than the softness of the elements."""
    grid = ContactGrid(x_mm=0.5 * np.arange(12), s_mm=0.4 * np.arange(11), half=True)
    half_space = build_half_space_compliance(grid, 115e3)
    pressure = Field(
        grid=grid, values=np.sqrt(np.maximum(0.0, 1.0 - (grid.x_mm[:, None] / 4.0) ** 2)) + 0.0 * grid.s_mm
    )

    def soft(values):
        return half_space(values) + 1e-7 * values

    parabola = np.outer(1e-4 * grid.x_mm**2, np.ones(grid.s_mm.size))
    for left in (-1.0, 0.0, 0.5):
        added = Field(grid=grid, values=parabola + left * 1e-7 * pressure.values)
        assert compute_correction_error(added, pressure, soft, half_space) == pytest.approx(left, abs=1e-6)
