"""Several patches: ellipses that share the load, and every lobe alone, on contacts with exact answers.

The contacts are those of the true gap on a half-space, which take the place of the finite elements.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from rungs import on_half_space

from fecontact.case import Case, Track
from fecontact.contact.grid import ContactGrid
from fecontact.contact.patch import measure_area_between
from fecontact.contact_theories.approximation import TheoryContact, patch_from_ellipse
from fecontact.contact_theories.hertz import hertz_ellipse
from fecontact.contact_theories.registry import MULTI_HERTZ, THEORIES, LoadedPlacement
from fecontact.files import format_json
from fecontact.judging.judge import judge_load
from fecontact.judging.lobes import judge_lobes, judge_profile_variant, split_lobes
from fecontact.judging.measures import MEASURES, read_measures, read_patch, read_theory_measures
from fecontact.judging.theory import judge_theory
from fecontact.outputs.records.results import load_record
from fecontact.placement.wheel_on_rail import place
from fecontact.profiles.curve import Profile, make_cylinder_wheel
from fecontact.profiles.segments import Arc
from fecontact.solving.expected_patch import find_expected_patch
from fecontact.solving.hertz import compute_hertz_points
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space, make_true_gap

RADIUS, APART = 80.0, 40.0


def judged(case, placement, rung):
    """A load with a half-space as its finite elements, equal on both meshes."""
    return judge_load(on_half_space(case, placement, rung), placement)


def judgement_of(load, contact):
    return judge_theory(load.case, load.solved.levels, contact)


def two_heads() -> Profile:
    """Two arcs of equal radius with their tops 40 mm apart, and a valley between."""
    half = 0.5 * APART

    def arc(top, low, high):
        low_angle, high_angle = (math.acos((y - top) / RADIUS) for y in (low, high))
        return Arc(centre=(top, -RADIUS), radius=RADIUS, angle_from=low_angle, angle_to=high_angle)

    return Profile(name="two heads", kind="rail", segments=(arc(-half, -half - 25.0, 0.0), arc(half, 0.0, half + 25.0)))


@pytest.fixture(scope="module")
def two_patches():
    case = Case(wheel="cylinder:460", rail="circle:80", inclination_rad=0.0, load_N=20e3)
    placement = place(two_heads(), make_cylinder_wheel(), inclination_rad=0.0, track=Track(rail_crown_y_mm=750.0))
    rung = find_expected_patch(make_true_gap(case, placement), case.load_N, half=True, nodes=32).half_space
    return case, placement, judged(case, placement, rung)


def test_two_equal_patches_far_apart_are_two_ellipses(two_patches):
    case, _, load = two_patches
    multi = load.judgements[MULTI_HERTZ]
    contact = multi.approximation
    exact = hertz_ellipse(
        0.5 / 460, 0.5 / RADIUS, normal_force_N=0.5 * case.load_N, contact_modulus_MPa=case.contact_modulus_MPa
    )
    assert [patch.p_max_MPa for patch in contact.patches] == pytest.approx([exact.p0_MPa] * 2, rel=1e-6)
    # along the arcs, between the tops
    arc = 2.0 * RADIUS * math.asin(0.5 * APART / RADIUS)
    assert sorted(patch.centre_mm[1] for patch in contact.patches) == pytest.approx([0.0, arc], abs=1e-6)
    assert sorted(patch.contact_point_number for patch in contact.patches) == [0, 1]
    assert not contact.overlapping
    # patches of 5 mm by 1.6 mm, 40 mm apart: each lies on the slope that the other one presses into the half-space,
    # which moves it, and bends it by some 1e-3 of its own curvature
    assert multi.deviation["p_max_MPa"] == pytest.approx(0.0, abs=0.002)
    for name in ("area_mm2", "a_mm", "b_mm"):
        assert multi.deviation[name] == pytest.approx(0.0, abs=0.005), name
    assert multi.deviation["separate_load"] == 0.0
    # the pressure falls to zero between them, as their ellipses' does
    assert multi.deviation["valley"] == pytest.approx(0.0, abs=0.003)
    assert multi.deviation["misplaced_load"] < 0.02
    assert multi.verdict.answer == "HOLDS"
    # the cube root of 2 in the peak, and half the load on a patch that he does not know
    assert load.deviation["p_max_MPa"] == pytest.approx(2.0 ** (1 / 3) - 1.0, abs=0.005)
    assert load.deviation["separate_load"] == pytest.approx(0.5, abs=0.002)
    assert load.verdict.answer == "FAILS"


def test_a_patch_that_no_ellipse_knows_is_separate_load(two_patches):
    _, _, load = two_patches
    contact = load.judgements[MULTI_HERTZ].approximation
    single = replace(contact, patches=contact.patches[:1])
    assert judgement_of(load, single).deviation["separate_load"] == pytest.approx(0.5, abs=2e-3)
    assert judgement_of(load, single).verdict.answer == "FAILS"
    # and an ellipse where there is none
    x, s = contact.patches[1].centre_mm
    third = replace(contact, patches=(*contact.patches, patch_from_ellipse(contact.patches[1].hertz, (x, s - 60.0))))
    assert judgement_of(load, third).deviation["separate_load"] == pytest.approx(1.0 / 3.0, abs=1e-3)


def test_one_ellipse_has_one_patch_however_wide_it_is(two_patches):
    case, _, load = two_patches
    contact = load.judgements[MULTI_HERTZ].approximation
    flat_ellipse = hertz_ellipse(
        0.5 / 460, 0.5 / 1e6, normal_force_N=case.load_N, contact_modulus_MPa=case.contact_modulus_MPa
    )
    assert flat_ellipse.extent_y_mm > 4.0 * APART
    wide = patch_from_ellipse(flat_ellipse, contact.patches[0].centre_mm)
    alone = judgement_of(load, replace(contact, patches=(wide,)))
    # as Hertz is judged, who has one ellipse too
    assert alone.deviation["separate_load"] == pytest.approx(load.deviation["separate_load"], abs=1e-12)
    # two of them have both patches
    judgement = judgement_of(load, replace(contact, patches=(wide, wide)))
    assert judgement.deviation["separate_load"] == 0.0


def test_each_patch_is_a_contact_of_its_own(two_patches):
    case, placement, load = two_patches
    lobes = judge_lobes(load.solved, placement, usable=True)
    assert [lobe.separate for lobe in lobes] == [True, True]
    assert sum(lobe.normal_force_N for lobe in lobes) == pytest.approx(case.load_N, rel=1e-3)
    assert sorted(lobe.contact_point_number for lobe in lobes) == [0, 1]
    for lobe in lobes:
        assert lobe.rail_y_mm == pytest.approx(lobe.touch.rail_y_mm, abs=0.05)
        assert lobe.contact_angle_rad == pytest.approx(0.0, abs=1e-3)
        for name in ("p_max_MPa", "area_mm2", "a_mm", "b_mm"):
            # they carry the same force, and are read with nodes at other places
            assert lobe.deviation[name] == pytest.approx(0.0, abs=0.006), name
        assert lobe.rungs["half_space"] == pytest.approx(lobe.fe)
        assert lobe.verdict.answer == "HOLDS"
        assert lobe.hertz.normal_force_N == lobe.normal_force_N
        # what is stated of each patch covers it: both carry half of the load
        assert abs(lobe.normal_force_N / (0.5 * case.load_N) - 1.0) <= lobe.fe_uncertainty["normal_force_N"] < 0.02
        assert all(0.0 < lobe.fe_uncertainty[name] < 0.01 for name in lobe.fe)


def test_a_single_touch_point_is_one_ellipse_by_both_theories():
    case = Case(lateral_shift_mm=-4.0, roll="given")
    placement = place_case(case)
    _, expected = expect_on_half_space(case, placement)
    load = judged(case, placement, expected.half_space)
    # what the springs would say is Hertz, and is not told twice
    assert MULTI_HERTZ not in load.judgements
    assert (
        THEORIES[MULTI_HERTZ].approximate(
            LoadedPlacement(placement=placement, case=case, normal_force_N=load.normal_force_N)
        )
        is None
    )
    (point,) = compute_hertz_points(case, placement).points
    multi = judgement_of(load, TheoryContact.of(point.shared))
    # the normal force of one is that of the pressures, of the other one that of the load: curved bodies, 1e-5 apart
    assert multi.deviation == pytest.approx(dict(load.deviation), abs=2e-4)
    assert multi.verdict.answer == load.verdict.answer == "HOLDS"
    assert multi.verdict.each == load.verdict.each
    (only,) = judge_lobes(load.solved, placement, usable=True)
    assert only.separate
    assert only.contact_point_number == 0
    for name in ("p_max_MPa", "area_mm2", "a_mm", "b_mm", "centre_over_b", "misplaced_load"):
        assert only.deviation[name] == pytest.approx(load.deviation[name], abs=2e-4), name
    assert only.verdict.answer == "HOLDS"


def test_a_lobe_on_a_single_line_of_nodes_has_no_half_width(two_patches):
    """A patch that just appears: its half-width reads 0, and nothing may be divided by it."""
    case, placement, load = two_patches
    rung = load.solved.half_space
    arc_mm = placement.arc_mm(placement.contact_points[1])
    columns = np.arange(rung.grid.s_mm.size)
    is_other_patch = np.abs(rung.grid.s_mm - arc_mm) < 0.5 * APART
    thin = is_other_patch & (columns != np.argmin(np.abs(rung.grid.s_mm - arc_mm)))
    thin_rung = replace(rung, pressure_MPa=np.where(thin, 0.0, rung.pressure_MPa))
    wide, narrow = sorted(split_lobes(thin_rung), key=lambda lobe: -lobe.normal_force_N)
    assert read_measures(narrow.rung).b_mm < 1e-12 < read_measures(wide.rung).b_mm
    variant = judge_profile_variant("thin", case, placement, thin_rung)
    deviations = [lobe.deviation for lobe in sorted(variant.lobes, key=lambda lobe: -lobe.normal_force_N)]
    assert [math.isnan(deviation["b_mm"]) for deviation in deviations] == [False, True]
    assert all(math.isfinite(deviation["p_max_MPa"]) for deviation in deviations)
    # between the finite bodies too, with a record of plain numbers
    thin_load = judged(case, placement, thin_rung)
    verdicts = [judgement.verdict for judgement in judge_lobes(thin_load.solved, placement, usable=True)]
    assert verdicts[1].answer != "HOLDS"
    assert verdicts[1].each["b_mm"] == "UNRESOLVED"
    assert "NaN" not in format_json(load_record(thin_load))


@pytest.fixture(scope="module")
def ellipses(two_patches):
    """Two ellipses of different sizes, apart or overlapping, and a contact with the sum of their pressures."""
    _, _, load = two_patches
    small, large = (
        hertz_ellipse(0.5 / 460, 0.5 / radius, normal_force_N=force, contact_modulus_MPa=115e3)
        for radius, force in ((80.0, 8e3), (300.0, 30e3))
    )

    def made(apart):
        contact = TheoryContact(
            patches=(patch_from_ellipse(large), patch_from_ellipse(small, (0.0, apart))),
            approach_mm=0.1,
            overlapping=apart < 0.5 * (large.extent_y_mm + small.extent_y_mm),
        )
        grid = ContactGrid(x_mm=0.05 * np.arange(120), s_mm=-8.0 + 0.05 * np.arange(440), half=True)
        # the larger of both pressures: their sum has a hump of its own where they overlap
        pressures = [replace(contact, patches=(patch,)).on(grid) for patch in contact.patches]
        return contact, replace(load.fe, grid=grid, pressure_MPa=np.maximum(*pressures))

    return made


def test_measures_of_ellipses_are_what_is_read_off_their_pressures(ellipses):
    contact, rung = ellipses(9.0)
    rung_measures, theory_measures = read_measures(rung).as_dict(), read_theory_measures(contact).as_dict()
    for name in MEASURES:
        if name != "approach_mm":
            # readings of exact pressures with 24 nodes on the narrow semi-axis
            assert rung_measures[name] == pytest.approx(theory_measures[name], rel=0.005), name
    assert read_patch(rung).centre_y_mm == pytest.approx(contact.centre_mm[1], abs=2e-3)
    assert read_patch(rung).separate_load == pytest.approx(8.0 / 38.0, abs=1e-3)


@pytest.mark.parametrize("apart", [4.0, 9.0])
def test_lobes_add_up_to_the_whole(ellipses, apart):
    _, rung = ellipses(apart)
    parts, patch = split_lobes(rung), read_patch(rung)
    assert len(parts) == 2 == len(patch.lobes)
    assert sum(lobe.area_mm2 for lobe in parts) == pytest.approx(patch.area_mm2, rel=1e-9)
    total_N = float(np.sum(rung.pressure_MPa.ravel() * rung.grid.whole_area_mm2()))
    assert sum(lobe.rung.normal_force_N for lobe in parts) == pytest.approx(total_N, rel=1e-12)
    assert max(read_measures(lobe.rung).p_max_MPa for lobe in parts) == pytest.approx(patch.p_max_MPa, rel=1e-12)
    assert [lobe.separate for lobe in parts] == [apart > 6.0] * 2


def test_an_area_is_cut_where_it_is_said(ellipses):
    contact, rung = ellipses(9.0)
    large, small = (lobe.hertz for lobe in contact.patches)
    half = measure_area_between(rung.pressure, -np.inf, 0.0)
    assert half == pytest.approx(0.5 * large.area_mm2, rel=0.005)
    # nothing lies there
    gap = 0.5 * large.extent_y_mm + 0.5, 9.0 - 0.5 * small.extent_y_mm - 0.5
    assert gap[0] < gap[1]
    assert measure_area_between(rung.pressure, *gap) == 0.0
