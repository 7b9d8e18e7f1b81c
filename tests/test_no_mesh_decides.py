"""Refinement only if finer meshes may decide the verdict.

Errors that no mesh removes are counted first.
"""

from dataclasses import replace

import pytest

from fecontact.criteria import Criteria
from fecontact.judging.judge import judge_load
from fecontact.judging.measures import UNCERTAINTIES
from fecontact.judging.theory import is_undecidable_by_refinement
from fecontact.judging.uncertainty import SolutionQuality, estimate_uncertainty
from fecontact.outputs.records.results import result_record
from fecontact.outputs.verdict_words import remedy_text
from fecontact.solving.meshes import is_open


def solved_with_limit(result, share):
    """Solve the elliptic test with a limit of the area near its deviation.

    The distance of the limit from the deviation is `share` times the errors that no mesh removes.
    """
    off = result.load.judgements["hertz"].deviation["area_mm2"]
    left = (
        UNCERTAINTIES["area_mm2"].reading
        + UNCERTAINTIES["area_mm2"].cut_planes
        + UNCERTAINTIES["area_mm2"].common_mesh_error
    ) * (1.0 + off)
    criteria = Criteria(area=abs(off) + share * left, judged_by=("area",))
    return replace(result.load.solved, case=replace(result.load.case, criteria=criteria))


@pytest.mark.parametrize(("share", "hopeless"), [(0.5, True), (0.95, True), (1.03, False)])
def test_a_limit_nearer_than_what_no_mesh_takes_away_is_decided_by_none(elliptic_quick, share, hopeless):
    solved_load, placement = solved_with_limit(elliptic_quick, share), elliptic_quick.placement
    assert judge_load(solved_load, placement).verdict.answer == "UNRESOLVED"
    assert is_undecidable_by_refinement(solved_load.case, solved_load.levels, placement, None) is hopeless
    assert is_open(solved_load.case, solved_load.levels, placement, None, solved_load.half_space) is not hopeless


def test_what_meshes_know_badly_may_be_decided_by_finer_ones(elliptic_quick):
    solved_load, placement = solved_with_limit(elliptic_quick, 0.5), elliptic_quick.placement
    fine, coarse = solved_load.levels
    # the area on the coarser meshes is 3 % larger
    wide = replace(coarse.fe, grid=replace(coarse.fe.grid, x_mm=1.03 * coarse.fe.grid.x_mm))
    levels = (fine, replace(coarse, fe=wide))
    assert not is_undecidable_by_refinement(solved_load.case, levels, placement, None)
    assert is_open(solved_load.case, levels, placement, None, solved_load.half_space)


def test_a_verdict_that_no_mesh_decides_says_so_and_names_no_resolution(elliptic_quick):
    solved_load = solved_with_limit(elliptic_quick, 0.5)
    load = judge_load(solved_load, elliptic_quick.placement)
    record = result_record(replace(elliptic_quick, load=load))
    remedy = remedy_text(record)
    # half of the errors of reading (0.2 %) and of cut planes (0.19 %)
    assert remedy.startswith("finer meshes cannot decide: the deviation is only 0.19 % from its limit")
    assert "0.39 % of its uncertainty" in remedy
    load = judge_load(solved_with_limit(elliptic_quick, 1.03), elliptic_quick.placement)
    assert "--resolution" in remedy_text(result_record(replace(elliptic_quick, load=load)))


def test_what_no_mesh_takes_away_is_what_one_value_alone_leaves():
    assert estimate_uncertainty("area_mm2", [100.0]) == pytest.approx(0.002 + 0.0019)
    shared = SolutionQuality(shared=True)
    assert estimate_uncertainty("p_max_MPa", [1000.0], shared) == pytest.approx(0.0006 + 0.0006 + 0.006)
    assert estimate_uncertainty("approach_mm", [0.1]) is None
