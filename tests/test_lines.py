"""Verdicts on measured profiles: the deviation has the uncertainty, line by line."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from points import profile_from_points
from rungs import planted_lines

from fecontact.case import Case
from fecontact.contact.grid import Rung
from fecontact.contact_theories.registry import HERTZ
from fecontact.criteria import Criteria
from fecontact.judging.judge import judge_load
from fecontact.judging.lines import NO_SHIFTS, ProfileVariants, VariantResult, VariantShifts, find_open_cause
from fecontact.judging.measures import compute_hertz_deviations
from fecontact.judging.solved_load import ELEMENTS_STATUS
from fecontact.judging.theory import has_certain_failure, judge_theory
from fecontact.judging.verdict import (
    ELEMENTS_CAUSE,
    PROFILE_CAUSE,
    Judgement,
    Verdict,
    judge,
    judge_profile_variants,
)
from fecontact.outputs.cases import verdict_of
from fecontact.outputs.records.results import load_record, load_row
from fecontact.outputs.verdict_words import (
    BY_EACH_VARIANT,
    deciding_measure_text,
    deciding_text,
    peak_range_text,
    variant_share_text,
    verdict_reason,
)
from fecontact.profiles.curve import Profile
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.reading import Reading
from fecontact.solving.meshes import is_open
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space
from fecontact.solving.profile_variants import REFERENCE_LABEL, judge_case_variants

PEAK = Criteria(judged_by=("p_max",))


def factor_moves(*factors: float) -> VariantShifts:
    return VariantShifts(by_line={f"filter {k} mm": {"p_max_MPa": factor} for k, factor in enumerate(factors, start=4)})


def judge_variants(deviation: float, uncertainty: float, *factors: float):
    return judge_profile_variants({"p_max_MPa": deviation}, {"p_max_MPa": uncertainty}, factor_moves(*factors), PEAK)


# --- the answer is the one that lines have ------------------------------------------------------------------------


def test_without_other_lines_a_verdict_is_what_it_was():
    deviation, uncertainty = {"p_max_MPa": 0.03}, {"p_max_MPa": 0.01}
    assert judge_profile_variants(deviation, uncertainty, NO_SHIFTS, PEAK) == (
        judge(deviation, uncertainty, PEAK),
        uncertainty,
    )


def test_it_holds_where_it_holds_on_every_line():
    # the farthest line is 4.8 % off: symmetric bounds about 1 % would reach 4.8 % and leave nothing for the meshes
    verdict, stated = judge_variants(0.01, 0.001, 1.0, 1.0376, 0.98)
    assert verdict.answer == "HOLDS"
    assert set(verdict.variant_answers.values()) == {"HOLDS"}
    assert stated["p_max_MPa"] == pytest.approx(0.001 + 1.01 * 0.0376)


def test_one_line_of_twenty_is_left_out_and_one_of_twelve_is_not():
    assert judge_variants(0.02, 0.001, *[1.0] * 19, 1.1)[0].answer == "HOLDS"
    verdict = judge_variants(0.02, 0.001, *[1.0] * 11, 1.1)[0]
    assert (verdict.answer, [*verdict.variant_answers.values()].count("HOLDS")) == ("UNRESOLVED", 11)
    assert judge_variants(0.12, 0.001, *[1.0] * 19, 0.9)[0].answer == "FAILS"


def test_what_meshes_leave_open_is_added_on_every_line():
    assert judge_variants(0.03, 0.005, 1.0, 1.01)[0].answer == "HOLDS"
    assert judge_variants(0.03, 0.012, 1.0, 1.01)[0].answer == "UNRESOLVED"


def test_measures_that_fail_one_after_the_other_make_it_fail():
    """The peak fails on one variant and the area on the other.

    Neither of the measures fails with certainty; Hertz does.
    """
    line_moves = VariantShifts(
        by_line={"filter 4 mm": {"p_max_MPa": 1.1, "area_mm2": 1.0}, "filter 8 mm": {"p_max_MPa": 1.0, "area_mm2": 1.3}}
    )
    deviations = {"p_max_MPa": 0.0, "area_mm2": 0.0}
    verdict, _ = judge_profile_variants(
        deviations, dict.fromkeys(deviations, 0.001), line_moves, Criteria(judged_by=("p_max", "area"))
    )
    assert verdict.answer == "FAILS"
    assert verdict.each == {"p_max_MPa": "UNRESOLVED", "area_mm2": "UNRESOLVED"}


def test_what_hertz_has_no_value_of_moves_by_what_is_added():
    line_moves = VariantShifts(by_line={REFERENCE_LABEL: {"valley": 0.0}, "filter 8 mm": {"valley": 0.06}})
    verdict, stated = judge_profile_variants(
        {"valley": 0.05}, {"valley": 0.001}, line_moves, Criteria(judged_by=("valley",))
    )
    assert (verdict.variant_answers["filter 8 mm"], stated["valley"]) == ("FAILS", pytest.approx(0.061))


def test_a_filter_at_its_end_has_the_noise_of_the_points_too():
    """The farthest of seven variants is nearer than the farthest variant that the points allow.

    The points of the farthest variant have noise as well.
    """
    variant_count = {REFERENCE_LABEL: 1.0, "filter 4 mm": 0.98, "filter 8 mm": 1.05, "noise 1": 1.02, "noise 2": 0.97}
    line_moves = VariantShifts(
        by_line={
            label: {"p_max_MPa": deviation, "valley": deviation - 1.0} for label, deviation in variant_count.items()
        },
        peaks=variant_count,
    )
    assert line_moves.band(1000.0) == pytest.approx((1000.0 * 0.98 * 0.97, 1000.0 * 1.05 * 1.02))
    assert line_moves.farthest("p_max_MPa", 0.1) == pytest.approx(1.1 * (1.05 * 1.02 - 1.0))
    assert line_moves.farthest("valley", 0.1) == pytest.approx(0.05 + 0.02)
    # lines that do not have the contact say nothing, and where none has it nothing is known
    missing = replace(line_moves, peaks=variant_count | {"noise 1": float("nan")})
    assert missing.band(1000.0) == pytest.approx((1000.0 * 0.98 * 0.97, 1050.0))
    assert math.isnan(VariantShifts(by_line={"noise 1": {}}).farthest("p_max_MPa", 0.1))
    assert NO_SHIFTS.band(1000.0) is None


# --- a second patch that some lines have and others do not ---------------------------------------------------------

# Hertz against the half-space on three lines of a worn rail and wheel of one measurement, 20 kN: what filters of 4 and
# 8 mm and a draw of noise say. The line of 4 mm has a second patch, and so has the draw.
SECOND_PATCH = {
    "filter 4 mm": (2, {"p_max_MPa": 0.0222, "b_mm": -0.899, "separate_load": 0.0963}),
    "filter 8 mm": (1, {"p_max_MPa": -0.0089, "b_mm": -0.0317, "separate_load": 0.0}),
    "noise 3": (2, {"p_max_MPa": -0.0032, "b_mm": -0.8002, "separate_load": 0.021}),
}
# and against finite elements on the line of 4 mm
BY_ELEMENTS = {"p_max_MPa": 0.0415, "b_mm": -0.908, "separate_load": 0.1192}


def lines_with(contacts: dict[str, tuple[int, dict[str, float]]]) -> ProfileVariants:
    reference, *other_variants = (
        VariantResult(label=label, p_max_MPa=1e3, patches=patches, deviations={HERTZ: deviation})
        for label, (patches, deviation) in contacts.items()
    )
    return ProfileVariants(own=reference, others=tuple(other_variants))


def test_a_line_without_the_second_patch_is_judged_by_its_own_contact():
    line_moves = lines_with(SECOND_PATCH).find_shifts(HERTZ)
    assert line_moves.other_patches == {"filter 8 mm"}
    deviations = line_moves.deviations(BY_ELEMENTS)
    # 0.1192 - 0.0963 = 0.0229 of the load would lie on a patch that this line does not have
    assert deviations["filter 8 mm"] == SECOND_PATCH["filter 8 mm"][1]
    # the step on the line of 4 mm: (1.0415 / 1.0222 - 1) x 0.9911, (0.092 / 0.101 - 1) x 0.9683, 0.0229
    step = {"p_max_MPa": 0.01871, "b_mm": 0.08628, "separate_load": 0.0229}
    assert line_moves.step_uncertainty("filter 8 mm", BY_ELEMENTS) == pytest.approx(step, abs=1e-5)
    # the draw of noise has the patches of the solved line, and moves with it
    assert deviations["noise 3"]["separate_load"] == pytest.approx(0.1192 + 0.021 - 0.0963)
    assert set(line_moves.step_uncertainty("noise 3", BY_ELEMENTS).values()) == {0.0}


def test_a_verdict_with_a_second_patch_on_some_lines_is_open():
    limits = Criteria(judged_by=("p_max", "b", "separate"))
    verdict, stated = judge_profile_variants(
        BY_ELEMENTS, dict.fromkeys(BY_ELEMENTS, 1e-4), lines_with(SECOND_PATCH).find_shifts(HERTZ), limits
    )
    assert verdict.variant_answers == {"filter 4 mm": "FAILS", "filter 8 mm": "UNRESOLVED", "noise 3": "FAILS"}
    assert verdict.answer == "UNRESOLVED"
    # the line of 8 mm is as far as its own contact is, and is not taken together with noise on other patches
    assert stated["b_mm"] == pytest.approx(1e-4 + (0.908 - 0.0317) + 0.08628, abs=1e-5)
    assert stated["separate_load"] == pytest.approx(1e-4 + 0.1192 + 0.0229)
    # finite elements that say what the half-space does leave the line to its half-space
    exact = SECOND_PATCH["filter 4 mm"][1]
    verdict, _ = judge_profile_variants(
        exact, dict.fromkeys(exact, 1e-4), lines_with(SECOND_PATCH).find_shifts(HERTZ), limits
    )
    assert verdict.variant_answers == {"filter 4 mm": "FAILS", "filter 8 mm": "HOLDS", "noise 3": "FAILS"}


def test_a_second_patch_on_another_line_alone_fails_there():
    """The solved variant has a single patch.

    The half-space and the finite elements differ by 0.5 % in its peak pressure.
    """
    single_patch, two_patches = {"p_max_MPa": 0.01, "separate_load": 0.0}, {"p_max_MPa": 0.02, "separate_load": 0.05}
    variants = lines_with(
        {"filter 4 mm": (1, single_patch), "filter 8 mm": (2, two_patches), "noise 1": (1, single_patch)}
    )
    by_elements = {"p_max_MPa": 0.015, "separate_load": 0.0}
    criteria = Criteria(judged_by=("p_max", "separate"))
    verdict, _ = judge_profile_variants(
        by_elements, dict.fromkeys(single_patch, 1e-4), variants.find_shifts(HERTZ), criteria
    )
    assert verdict.variant_answers == {"filter 4 mm": "HOLDS", "filter 8 mm": "FAILS", "noise 1": "HOLDS"}


def test_no_line_gets_a_negative_load_on_a_separate_patch():
    """A second patch has 24 % by the half-space and 21 % by finite elements; on another line the half-space has 2 %."""
    variants = lines_with({"filter 4 mm": (2, {"separate_load": 0.24}), "noise 1": (2, {"separate_load": 0.02})})
    line_moves = variants.find_shifts(HERTZ)
    assert line_moves.other_patches == set()
    assert line_moves.deviations({"separate_load": 0.21})["noise 1"] == {"separate_load": 0.02}
    verdict, _ = judge_profile_variants(
        {"separate_load": 0.21}, {"separate_load": 1e-4}, line_moves, Criteria(judged_by=("separate",))
    )
    assert verdict.variant_answers == {"filter 4 mm": "FAILS", "noise 1": "UNRESOLVED"}


# --- a load that was solved, with lines that are planted -----------------------------------------------------------


def judged_with(result, **changes):
    return judge_load(replace(result.load.solved, **changes), result.placement)


def test_a_load_on_lines_that_do_not_move_it_is_what_it_was(elliptic_quick):
    judgement = judged_with(elliptic_quick, lines=planted_lines(1.0, 1.0))
    assert (judgement.verdict.answer, judgement.verdict.each) == ("HOLDS", elliptic_quick.verdict.each)
    assert judgement.uncertainty == pytest.approx(elliptic_quick.load.uncertainty, rel=1e-12)


def test_peaks_that_move_leave_a_verdict_alone_where_the_theory_moves_with_them(elliptic_quick):
    """The peak has an uncertainty of 30 %, and Hertz has no deviation.

    Noise charged to the theory in full would leave this open.
    """
    lines = planted_lines(1.0, 1.0, peaks=(700.0, 1300.0))
    judgement = judged_with(elliptic_quick, lines=lines)
    assert judgement.verdict.answer == "HOLDS"
    fe = load_record(judgement)["fe"]
    peak_MPa = judgement.comparison.fe.p_max_MPa
    # and what two meshes leave open of the peak
    uncertainty = elliptic_quick.load.uncertainty["p_max_MPa"] / (1.0 + judgement.deviation["p_max_MPa"])
    assert 0.0 < uncertainty < 0.01
    low, high = 0.7 * peak_MPa * (1.0 - uncertainty), 1.3 * peak_MPa * (1.0 + uncertainty)
    assert (fe["p_max_low_MPa"], fe["p_max_high_MPa"]) == pytest.approx((low, high))
    assert peak_range_text(fe) == f"peak pressure {low:.0f} to {high:.0f} MPa over the profile variants"


def test_lines_that_differ_leave_it_open_and_say_on_how_many_it_holds(elliptic_quick):
    judgement = judged_with(elliptic_quick, lines=planted_lines(1.0, 1.0, 1.0, 1.2, 1.3))
    verdict = judgement.verdict
    assert (verdict.answer, verdict.measure, verdict.cause) == ("UNRESOLVED", "p_max_MPa", PROFILE_CAUSE)
    said = "holds on 4 of 6 profile variants (it fails with filters above 6 mm)"
    assert variant_share_text(verdict.variant_answers) == said
    assert said in verdict_reason(load_record(judgement))
    record = json.loads(json.dumps(load_record(judgement)))
    verdict_record = record["verdict"]
    assert (
        verdict_record["variants_holding"],
        verdict_record["variants_failing"],
        verdict_record["variant_count"],
    ) == (4, 2, 6)
    assert record["uncertainty_of_profile"]["p_max_MPa"] == pytest.approx(0.3, rel=0.01)


def test_a_line_that_does_not_touch_leaves_the_answer_open(elliptic_quick):
    judgement = judged_with(elliptic_quick, lines=planted_lines(without=1))
    # nothing failed to converge, but what Hertz is off on one of two lines is not known
    assert judgement.status == "converged"
    assert set(judgement.verdict.each.values()) == {"UNRESOLVED"}
    assert judgement.verdict.variant_answers == {REFERENCE_LABEL: "HOLDS", "noise 0": "UNRESOLVED"}
    assert judgement.verdict.cause == PROFILE_CAUSE
    # the others say how far it is off
    assert judgement.uncertainty == pytest.approx(elliptic_quick.load.uncertainty, rel=1e-12)


def test_lines_with_other_patches_are_named(elliptic_quick):
    planted = planted_lines(1.0, 1.0)
    filtered, *rest = planted.others
    judgement = judged_with(elliptic_quick, lines=replace(planted, others=(replace(filtered, patches=2), *rest)))
    (note,) = (warning for warning in judgement.warnings if "the patches differ" in warning)
    assert note.startswith("on 1 of 3 profile variants the patches differ from the patches of the reference variant")
    assert "(filter 4 mm)" in note
    assert not any("the patches differ" in warning for warning in judged_with(elliptic_quick, lines=planted).warnings)


def test_every_theory_has_moves_of_its_own(elliptic_quick):
    """Noise moves a single ellipse more than the half-space, which has no deviation on any variant."""
    lines = planted_lines(1.2, others={"half_space": 1.0})
    judgement = judged_with(elliptic_quick, lines=lines)
    assert judgement.judgements[HERTZ].verdict.answer == "UNRESOLVED"
    assert judgement.judgements["half_space"].verdict.answer == "HOLDS"


def test_words_of_shares():
    answers = {"filter 4 mm": "FAILS", "filter 8 mm": "HOLDS", "noise 1": "HOLDS"}
    assert variant_share_text(answers) == "holds on 2 of 3 profile variants (it fails with filters below 8 mm)"
    assert variant_share_text(dict.fromkeys(answers, "HOLDS")) == "holds on all 3 profile variants"
    assert variant_share_text(answers | {"noise 1": "FAILS"}).endswith("(it fails on filter 4 mm, noise 1)")
    assert variant_share_text(answers | {"noise 1": "UNRESOLVED"}).endswith("below 8 mm; it is unresolved on 1)")
    # a line within a limit's uncertainty, and none beyond it: a rail and a wheel of high mileage at 6 mm
    some = dict.fromkeys(answers, "HOLDS") | {"noise 1": "UNRESOLVED"}
    assert variant_share_text(some) == "holds on 2 of 3 profile variants (it is unresolved on 1)"
    assert variant_share_text(dict.fromkeys(answers, "UNRESOLVED")).endswith(
        "holds on 0 of 3 profile variants (it is unresolved on 3)"
    )


def test_a_verdict_variant_count_does_not_contradict_the_numbers_beside_it():
    """Every line fails, and the farthest is farther off than the limit: the ± alone would leave it open."""
    line_moves = VariantShifts(
        by_line={REFERENCE_LABEL: {"separate_load": 0.0}, "filter 8 mm": {"separate_load": 0.416}}
    )
    criteria = Criteria(judged_by=("separate",))
    deviation = {"separate_load": 0.2147}
    verdict, stated = judge_profile_variants(deviation, {"separate_load": 0.0}, line_moves, criteria)
    assert verdict.answer == "FAILS"
    record = {
        "verdict": {**vars(verdict), "limits": criteria.limits, "side": "both"},
        "theories": {HERTZ: {"deviation": deviation, "uncertainty": stated}},
    }
    assert deciding_text(record).startswith(
        "furthest beyond its limit: load on separate patches 21.47 % ± 41.60 % over all profile variants, each of"
        " which is judged separately (limit < 0.1 %)"
    )
    row = {
        "status": "converged",
        "verdict_answer": "FAILS",
        "verdict_measure": "separate_load",
        "hertz_deviation_separate_load_percent": 21.47,
        "hertz_uncertainty_separate_load_percent": 41.60,
    }
    assert BY_EACH_VARIANT in deciding_measure_text(row, criteria.limits)
    # numbers that give the verdict by themselves need no words
    assert BY_EACH_VARIANT not in deciding_measure_text(
        row | {"hertz_uncertainty_separate_load_percent": 4.0}, criteria.limits
    )
    assert BY_EACH_VARIANT not in deciding_measure_text(row | {"verdict_answer": "UNRESOLVED"}, criteria.limits)


def test_measures_that_fail_one_after_the_other_are_not_called_open():
    line_moves = VariantShifts(
        by_line={"filter 4 mm": {"p_max_MPa": 1.1, "area_mm2": 1.0}, "filter 8 mm": {"p_max_MPa": 1.0, "area_mm2": 1.3}}
    )
    deviations, criteria = {"p_max_MPa": 0.0, "area_mm2": 0.0}, Criteria(judged_by=("p_max", "area"))
    verdict, stated = judge_profile_variants(deviations, dict.fromkeys(deviations, 0.001), line_moves, criteria)
    record = {
        "verdict": {**vars(verdict), "limits": criteria.limits, "side": "both"},
        "theories": {HERTZ: {"deviation": deviations, "uncertainty": stated}},
    }
    text = deciding_text(record)
    assert text.startswith("the profile variants exceed different limits: ")
    assert BY_EACH_VARIANT in text
    assert text.endswith("it fails on all 2 profile variants")


# --- wear whose truth is known ---------------------------------------------------------------------------------------


def worn(noise_mm: float, step_mm: float, **reading: object) -> Profile:
    """60E1 with 1 mm of wear on the field side, smoothed from points."""
    line = load_library_profile("60E1")
    p = line.evaluate(line.at_arc_length(np.arange(0.0, line.length_mm, step_mm)))
    noise = noise_mm * np.random.default_rng([500, 23]).normal(size=p.y.size)
    y = p.y - noise * np.sin(p.angle_rad)
    z = p.z - np.exp(-(((p.y - 8.0) / 14.0) ** 2)) + noise * np.cos(p.angle_rad)
    return profile_from_points(y, z, kind="rail", name="worn", reading=Reading(mirror=False, **reading))


def test_a_worn_head_is_decided_as_its_true_line_is():
    """Points with 10 um of noise every 0.2 mm.

    The peak has an uncertainty of 5 %, the deviation of Hertz less than a third of it.
    """
    case = Case(lateral_shift_mm=-4.0, roll="given")
    hertz, expected = expect_on_half_space(case, place_case(case, rail=worn(0.0, 0.05, filter_mm=0.0)), nodes=16)
    true = compute_hertz_deviations(expected.half_space, hertz)
    exact = dict.fromkeys(true, 0.0)
    assert judge(true, exact, case.criteria).answer == "HOLDS"
    lines = judge_case_variants(case, place_case(case, rail=worn(0.01, 0.2)))
    solved_deviations, line_moves = lines.own.deviations[HERTZ], lines.find_shifts(HERTZ)
    verdict, stated = judge_profile_variants(solved_deviations, exact, line_moves, case.criteria)
    assert (verdict.answer, set(verdict.variant_answers.values())) == ("HOLDS", {"HOLDS"})
    # the truth is inside what is stated, or nearly: seven lines of a noise are not all
    assert abs(true["p_max_MPa"] - solved_deviations["p_max_MPa"]) < stated["p_max_MPa"] + 0.01
    # the half-space on each line is itself
    half_space_answer = judge_profile_variants(
        lines.own.deviations["half_space"], exact, lines.find_shifts("half_space"), case.criteria
    )
    assert half_space_answer[0].answer == "HOLDS"
    assert max(half_space_answer[1].values()) < 1e-9
    low, high = line_moves.band(1.0)
    assert 3.0 * stated["p_max_MPa"] < max(1.0 - low, high - 1.0) < 0.06


# --- a failure that is certain --------------------------------------------------------------------------------------


def test_a_failure_by_far_is_certain_whatever_the_elements_are(elliptic_quick):
    """Hertz is right here: another ellipse, with half its peak, is not."""
    judgement, lines = elliptic_quick.load, planted_lines(1.0)
    half_space = judgement.solved.half_space
    right = judged_with(elliptic_quick, lines=lines).judgements[HERTZ]

    def wrong(factor: float) -> Judgement:
        (patch,) = right.approximation.patches
        approximation = replace(right.approximation, patches=(replace(patch, p_max_MPa=factor * patch.p_max_MPa),))
        return judge_theory(judgement.case, judgement.solved.levels, approximation, lines.find_shifts(HERTZ))

    assert not has_certain_failure({HERTZ: right}, half_space)
    assert has_certain_failure({HERTZ: wrong(0.5)}, half_space)
    # beyond its limit, by less than five times what the meshes leave open
    assert wrong(0.943).verdict.answer == "FAILS"
    assert not has_certain_failure({HERTZ: wrong(0.943)}, half_space)
    # on exact lines meshes are refined until they show what their numbers are
    assert not has_certain_failure({HERTZ: replace(wrong(0.5), moves=NO_SHIFTS)}, half_space)


def test_a_certain_failure_is_said_where_elements_are_off_and_takes_no_finer_ones(elliptic_quick):
    judgement, placement = elliptic_quick.load, elliptic_quick.placement
    fine, *rest = judgement.solved.levels
    off = (replace(fine, compliance_error=0.5), *rest)
    # Hertz at its own load is right, and its ellipse for a limit that nothing keeps is not
    lines = planted_lines(1.0)
    doubtful = judged_with(elliptic_quick, levels=off, lines=lines)
    assert (doubtful.usable, doubtful.verdict.answer, doubtful.verdict.cause) == (False, "UNRESOLVED", ELEMENTS_CAUSE)
    assert is_open(judgement.case, off, placement, lines, judgement.solved.half_space)
    # a half-space with a second patch of a tenth of the load
    two = add_second_patch(judgement.solved.half_space)
    changed = ({name: add_second_patch(level.rungs[name]) for name in level.rungs if name != "nodal"} for level in off)
    levels = tuple(replace(level, **rungs) for level, rungs in zip(off, changed, strict=True))
    sure = judged_with(elliptic_quick, levels=levels, half_space=two, lines=lines)
    assert (sure.status, sure.verdict.answer) == (ELEMENTS_STATUS, "FAILS")
    assert sure.verdict.cause != ELEMENTS_CAUSE
    assert verdict_reason(load_record(sure)).startswith("certain from the half-space alone, ")
    assert verdict_of(load_row(sure, placement)) == "FAILS"
    assert not is_open(judgement.case, levels, placement, lines, two)


def add_second_patch(rung: Rung) -> Rung:
    """A contact that has another patch far beside it, half as wide as the grid."""
    s = rung.grid.s_mm
    count = 2 * s.size
    wider = replace(rung.grid, s_mm=s[0] + (s[1] - s[0]) * np.arange(count))
    pressure = np.zeros(wider.shape)
    pressure[:, : s.size] = rung.pressure_MPa
    pressure[:, s.size :] = 0.2 * rung.pressure_MPa
    return replace(rung, grid=wider, pressure_MPa=pressure, gap_mm=np.zeros(wider.shape))


# --- what an open verdict needs -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("answers", "cause"),
    [
        ({}, "mesh"),
        ({"filter 5.66 mm": "UNRESOLVED", "filter 4 mm": "UNRESOLVED"}, "mesh"),
        ({"filter 5.66 mm": "HOLDS", "filter 4 mm": "FAILS", "noise 1": "FAILS"}, "filter"),
        ({"filter 5.66 mm": "HOLDS", "filter 8 mm": "UNRESOLVED"}, "filter"),
        ({"filter 8 mm from 60E1": "HOLDS", "filter 8 mm": "FAILS"}, "nominal profile"),
        ({"filter 5.66 mm": "HOLDS", "filter 4 mm": "HOLDS", "noise 2": "UNRESOLVED"}, "noise"),
    ],
)
def test_an_open_verdict_names_what_decides_it(answers, cause):
    assert find_open_cause(answers) == cause
    verdict = Verdict(
        answer="UNRESOLVED", measure="p_max_MPa", each={"p_max_MPa": "UNRESOLVED"}, variant_answers=answers
    )
    assert verdict.open_because == cause
    assert replace(verdict, answer="HOLDS").open_because is None
    assert replace(verdict, cause=ELEMENTS_CAUSE).open_because == (
        "solution" if len({*answers.values()}) < 2 else cause
    )


def test_a_decided_verdict_of_an_unusable_result_needs_a_solution():
    verdict = Verdict(answer="FAILS", measure="p_max_MPa", each={"p_max_MPa": "FAILS"})
    assert verdict.usable(False).open_because == "solution"


def test_all_variants_near_a_limit_are_decided_by_a_declared_filter():
    """No variant is decided with the uncertainty of its meshes."""
    answers = {"filter 5.66 mm": "UNRESOLVED", "filter 4 mm": "UNRESOLVED"}
    verdict = Verdict(
        answer="UNRESOLVED", measure="p_max_MPa", each={"p_max_MPa": "UNRESOLVED"}, variant_answers=answers
    )
    assert replace(verdict, cause=PROFILE_CAUSE).open_because == "filter"
