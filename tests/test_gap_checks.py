"""Is a gap noticed that is not the gap of the placed profiles?

Each fault is planted in the gap that is solved. Hertz, the placed profiles and the meshes stay as they are.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from fecontact.case import Case
from fecontact.contact.grid import Field
from fecontact.judging.judge import judge_load
from fecontact.judging.solution_faults import GAP_CURVATURE_LIMIT, GAP_DISTANCE_LIMIT_MM, describe_solution_faults
from fecontact.judging.solved_load import REFERENCES_STATUS
from fecontact.outputs.records.stored import solved_from_record, solved_record
from fecontact.placement.irregularity import parse_irregularity
from fecontact.solving.fine_zone import make_fine_zone
from fecontact.solving.gap_checks import compute_gap_curvature_error, compute_gap_distance_error_mm
from fecontact.solving.meshes import Meshes, couple_bodies
from fecontact.solving.position import Position, expect_position
from fecontact.solving.true_gap import TrueGap

TREAD = Case(lateral_shift_mm=-4.0, resolution="quick", refine="never")
ROUND = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, resolution="quick", refine="never")


@lru_cache(maxsize=1)
def errors_of(position: Position) -> tuple[float, float]:
    """Both errors of a position before it is solved.

    The elements are twice as large as those of the position.
    """
    size_x, size_s = position.element_size_mm
    zone = make_fine_zone(position.expected, (2.0 * size_x, 2.0 * size_s))
    bodies = couple_bodies(position.case, position.placement, zone, position.clock)
    grid = position.expected.half_space.grid
    try:
        return (
            compute_gap_curvature_error(position.true_gap, grid),
            compute_gap_distance_error_mm(
                position.true_gap, Field(grid=grid, values=position.true_gap.on(grid)), bodies
            ),
        )
    finally:
        bodies.close()


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(TREAD, id="tread"),
        pytest.param(replace(TREAD, lateral_shift_mm=5.0, load_N=50e3), id="two patches in bands"),
        pytest.param(replace(TREAD, lateral_shift_mm=6.3, load_N=60e3), id="flange root with a slide"),
        pytest.param(replace(TREAD, lateral_shift_mm=3.0, yaw_rad=8e-3), id="yaw"),
        pytest.param(
            replace(
                TREAD, rail_irregularity=parse_irregularity("sine:wavelength_mm=30,amplitude_mm=0.01"), distance_mm=4.0
            ),
            id="wave along the rail",
        ),
        # its segments miss each other by nanometres within a step of the nodes from the contact point
        pytest.param(
            Case(rail="50E6", wheel="EN15302_B", inclination_rad=0.05, lateral_shift_mm=5.76, load_N=45e3),
            id="junction beside the contact point",
        ),
    ],
)
def test_a_right_gap_is_far_within_both_limits(case):
    curvature, distance_mm = errors_of(expect_position(case))
    assert curvature < 0.2 * GAP_CURVATURE_LIMIT
    assert distance_mm < 0.2 * GAP_DISTANCE_LIMIT_MM


# --- faults -----------------------------------------------------------------------------------------------------------


def plant(monkeypatch, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> None:
    """Change the solved gap by a function of the gap and of the place across."""
    plain = TrueGap.gap
    monkeypatch.setattr(TrueGap, "gap", lambda self, x, s: change(plain(self, x, s), np.asarray(s, float)))


def larger(gap: np.ndarray, s: np.ndarray) -> np.ndarray:
    return 1.05 * gap


def wider_open_beside(gap: np.ndarray, s: np.ndarray) -> np.ndarray:
    """1 micrometre at 5 mm."""
    return gap + 1e-3 * (s / 5.0) ** 4


def larger_beyond_2_mm(gap: np.ndarray, s: np.ndarray) -> np.ndarray:
    return gap * np.where(np.abs(s) > 2.0, 1.01, 1.0)


@pytest.mark.parametrize("case", [ROUND, replace(TREAD, lateral_shift_mm=3.0)])
@pytest.mark.parametrize(
    ("change", "curvature", "distance_mm"),
    [
        pytest.param(larger, 0.05, None, id="gap 5 % larger"),
        # its curvature is right at the contact point
        pytest.param(wider_open_beside, 0.0, 1e-3, id="1 micrometre more at 5 mm"),
        pytest.param(larger_beyond_2_mm, 0.0, None, id="1 % more beyond 2 mm"),
    ],
)
def test_a_wrong_gap_is_beyond_a_limit(monkeypatch, case, change, curvature, distance_mm):
    plant(monkeypatch, change)
    position = expect_position(case)
    errors = errors_of(position)
    assert errors[0] == pytest.approx(curvature, rel=2e-3, abs=2e-4)
    assert errors[1] > 2.0 * GAP_DISTANCE_LIMIT_MM
    if distance_mm is not None:
        reach_mm = float(np.abs(position.expected.half_space.grid.s_mm).max())
        # the last node of these elements lies up to a third of the reach before the end of the grid
        assert 0.2 < errors[1] / (distance_mm * (reach_mm / 5.0) ** 4) < 1.0


def test_curvatures_see_a_gap_that_the_meshes_share(monkeypatch):
    """Along the track, where the meshes of both bodies have the wrong radius too."""
    position = expect_position(ROUND)
    first = position.placement.first
    wrong = replace(first.curvatures[0], xx_per_mm=1.01 * first.curvature.xx_per_mm)
    placement = replace(position.placement, contact_points=(replace(first, curvatures=(wrong,)),))
    grid = position.expected.half_space.grid
    assert (
        compute_gap_curvature_error(replace(position.true_gap, placement=placement), grid) > 5.0 * GAP_CURVATURE_LIMIT
    )


@pytest.mark.parametrize(
    ("change", "says"),
    [
        pytest.param(larger, "differ by 5.00% from the curvatures of the profiles", id="gap 5 % larger"),
        pytest.param(wider_open_beside, "from the distance of the mesh surfaces", id="1 micrometre more at 5 mm"),
    ],
)
def test_a_load_with_a_wrong_gap_has_no_verdict(monkeypatch, change, says):
    plant(monkeypatch, change)
    position = expect_position(ROUND)
    judgement = judge_load(Meshes(position).solve(position), position.placement)
    assert (judgement.status, judgement.verdict.answer) == (REFERENCES_STATUS, "UNRESOLVED")
    assert any(says in warning for warning in judgement.warnings)


def test_a_gap_that_is_wrong_on_the_finer_nodes_alone_is_seen(monkeypatch):
    """0.5 % larger, and only where the finite bodies' part is added."""
    plain = TrueGap.solve

    def wrong(self, grid, load_N, *, added=None, **how):
        if added is None:
            return plain(self, grid, load_N, **how)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(TrueGap, "on", lambda true_gap, nodes: 1.005 * true_gap.gap(nodes.x_mm[:, None], nodes.s_mm))
            return plain(self, grid, load_N, added=added, **how)

    position = expect_position(ROUND)
    monkeypatch.setattr(TrueGap, "solve", wrong)
    judgement = judge_load(Meshes(position).solve(position), position.placement)
    # the gap is 0.1 mm at the edge of the patch
    assert judgement.solved.levels[0].gap_distance_error_mm > 2.0 * GAP_DISTANCE_LIMIT_MM
    assert (judgement.status, judgement.verdict.answer) == (REFERENCES_STATUS, "UNRESOLVED")


def test_a_load_with_a_right_gap_says_nothing_of_it(elliptic_quick):
    solution = elliptic_quick.load.solved
    assert solution.gap_curvature_error < 0.1 * GAP_CURVATURE_LIMIT
    assert all(level.gap_distance_error_mm < 0.1 * GAP_DISTANCE_LIMIT_MM for level in solution.levels)
    assert describe_solution_faults(solution) == ()


def test_results_without_checks_of_the_gap_are_read(elliptic_quick):
    """Earlier versions stored none."""
    solution, arrays = elliptic_quick.load.solved, {}
    record = solved_record(solution, arrays)
    assert record["gap_curvature_error"] == solution.gap_curvature_error
    del record["gap_curvature_error"]
    for level in record["levels"]:
        del level["gap_distance_error_mm"]
    restored = solved_from_record(record, arrays, solution.case)
    assert (restored.gap_curvature_error, *(level.gap_distance_error_mm for level in restored.levels)) == (
        None,
        None,
        None,
    )
    assert describe_solution_faults(restored) == ()
    assert judge_load(restored, elliptic_quick.placement).status == "converged"
