"""Detection of a wrong part of the finite bodies where two patches share the load.

60E1 with S1002 at 5 mm: each fault is planted in the finer nodes alone; the contact on the elements' nodes stays right.
"""

from dataclasses import replace

import numpy as np
import pytest

from fecontact.case import Case
from fecontact.contact.grid import ContactGrid, Rung
from fecontact.judging.judge import judge_load
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.patch_loads import PATCH_LOADS_LIMIT, PatchLoads, compute_load_fractions, find_free_strips_mm
from fecontact.judging.solved_load import ELEMENTS_STATUS, compare_patch_loads
from fecontact.solving.meshes import Meshes
from fecontact.solving.position import Position, expect_position
from fecontact.solving.true_gap import TrueGap

TWO_PATCHES = Case(lateral_shift_mm=5.0, load_N=100e3, resolution="quick", refine="never")


@pytest.fixture(scope="module")
def position() -> Position:
    return expect_position(TWO_PATCHES)


def judge_case(position: Position) -> JudgedLoad:
    return judge_load(Meshes(position).solve(position), position.placement)


def test_healthy_elements_share_the_load_as_the_finer_nodes_do(position):
    load = judge_case(position)
    assert load.geometry.patch_count == 2
    (loads,) = compare_patch_loads(load.solved.levels)
    assert loads.difference < 0.4 * PATCH_LOADS_LIMIT
    # the bodies change the share of the load by 0.01; the combined uncertainty is smaller
    assert loads.uncertainty < 0.006
    assert load.status == "converged"
    assert not any("separate patches" in warning for warning in load.warnings)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("factor", "difference"),
    [
        pytest.param(0.0, 2.1, id="bodies' part left out"),
        pytest.param(-1.0, 3.7, id="bodies' part of the wrong sign"),
        pytest.param(2.0, 2.1, id="bodies' part doubled"),
    ],
)
def test_a_wrong_part_of_the_bodies_is_seen_by_the_loads_on_patches(position, monkeypatch, factor, difference):
    plain = TrueGap.solve

    def wrong(self, grid, load_N, *, added=None, **how):
        field = None if added is None else replace(added, values=factor * added.values)
        return plain(self, grid, load_N, added=field, **how)

    monkeypatch.setattr(TrueGap, "solve", wrong)
    load = judge_case(position)
    (loads,) = compare_patch_loads(load.solved.levels)
    assert loads.difference == pytest.approx(difference, rel=0.15)
    assert (load.status, load.verdict.answer) == (ELEMENTS_STATUS, "UNRESOLVED")
    (warning,) = (text for text in load.warnings if text.startswith("the share of the load between separate patches"))
    assert f"{loads.on_elements:.2%}" in warning
    assert f"{loads.on_finer_nodes:.2%}" in warning


# --- readings ---------------------------------------------------------------------------------------------------------


def rung_of(columns: list[float], *, widths_mm: np.ndarray | None = None) -> Rung:
    """A contact on three rows of a half model with these line loads across.

    The line loads are 1 mm apart, from s = -2 mm on.
    """
    s = np.arange(len(columns)) - 2.0
    grid = ContactGrid(x_mm=np.arange(3.0), s_mm=s, half=True, widths_mm=widths_mm)
    pressure = np.outer([1.0, 1.0, 0.0], columns)
    zeros = dict.fromkeys(("iterations", "compliance_calls"), 0) | dict.fromkeys(
        ("contact_residual", "penetration_residual", "load_balance"), 0.0
    )
    return Rung(
        grid=grid,
        pressure_MPa=pressure,
        gap_mm=np.zeros(pressure.shape),
        approach_mm=0.1,
        normal_force_N=1.0,
        status="converged",
        **zeros,
    )


def test_strips_lie_between_patches_and_loads_before_them():
    rung = rung_of([0.0, 1.0, 3.0, 0.0, 0.0, 4.0, 0.0, 2.0, 0.0])
    # loaded at -1 and 0, at 3, and at 5 mm
    assert find_free_strips_mm(rung) == [1.5, 4.0]
    assert compute_load_fractions(rung, [1.5, 4.0]) == pytest.approx([0.4, 0.8])


def test_a_single_patch_has_no_strip():
    assert find_free_strips_mm(rung_of([0.0, 1.0, 3.0, 2.0, 0.0])) == []


def test_cells_of_other_widths_count_by_their_widths():
    widths = np.array([1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    assert compute_load_fractions(
        rung_of([0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0], widths_mm=widths), [0.5]
    ) == pytest.approx([0.5])


def test_difference_is_relative_to_the_uncertainty():
    assert PatchLoads(on_elements=0.34, on_finer_nodes=0.36, uncertainty=0.01).difference == pytest.approx(2.0)
