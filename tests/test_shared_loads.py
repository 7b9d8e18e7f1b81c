"""Loads of a position in a study.

They share meshes, and each has the result that it would have alone.
"""

from dataclasses import replace

import numpy as np
import pytest
from marks import slow_but

from fecontact.case import Case
from fecontact.solving.solve import CaseResult, SharedLoads, solve

CASE = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
LOADS_N = (60e3, 100e3)


@pytest.fixture(scope="module")
def results() -> list[CaseResult]:
    shared = SharedLoads(case=CASE, loads_N=LOADS_N)
    return [shared.sweep.result(load) for load in LOADS_N]


@pytest.mark.parametrize("solver", slow_but(["auto", "amg"], 0))
def test_a_load_that_is_solved_alone_later_is_the_same_to_the_last_bit(solver):
    # as after a run that was killed behind the first load
    shared = SharedLoads(case=replace(CASE, resolution=(2.0, 1.6), refine="never", solver=solver), loads_N=LOADS_N)
    _, second = (shared.sweep.result(load_N) for load_N in LOADS_N)
    again = replace(shared).sweep.result(LOADS_N[1])
    for first_level, second_level in zip(second.load.solved.levels, again.load.solved.levels, strict=True):
        assert np.array_equal(first_level.fe.pressure_MPa, second_level.fe.pressure_MPa)
        assert np.array_equal(first_level.nodal.pressure_MPa, second_level.nodal.pressure_MPa)
    for body, displaced in second.bodies.displacement_mm.items():
        assert np.array_equal(displaced, again.bodies.displacement_mm[body])


def test_loads_share_meshes_and_the_first_one_s_effort_has_them(results):
    one_load, two = (result.load.solved.levels for result in results)
    assert [level.degrees_of_freedom for level in one_load] == [level.degrees_of_freedom for level in two]
    assert "factorise" in results[0].effort.seconds
    assert "factorise" not in results[1].effort.seconds
    assert {"contact", "recover", "judge"} <= results[1].effort.seconds.keys()


def test_each_load_is_what_it_is_on_meshes_of_its_own(results):
    for result, load_N in zip(results, LOADS_N, strict=True):
        alone = solve(replace(CASE, load_N=load_N))
        assert result.case == alone.case
        assert result.verdict.answer == alone.verdict.answer
        for name in ("p_max_MPa", "area_mm2", "a_mm", "b_mm"):
            # 0.2 to 1.8 % of it, by other elements below the same nodes
            apart = abs(result.load.deviation[name] - alone.load.deviation[name])
            assert apart < 0.05 * alone.load.uncertainty[name]
        for body, peak in alone.von_mises.items():
            # finer elements read the depth and the size of the largest stress better
            assert result.von_mises[body].von_mises_MPa == pytest.approx(peak.von_mises_MPa, rel=0.02)
