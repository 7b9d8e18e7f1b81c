"""Verdict and cause: the truth table, its boundaries, and the permitted effects of a larger uncertainty."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fecontact.case import Criteria
from fecontact.errors import InputError
from fecontact.judging.causes import PatchGeometry, find_cause
from fecontact.judging.measures import MEASURES, MISFITS
from fecontact.judging.verdict import ANSWERS_BEST_FIRST, judge

P, A = "p_max_MPa", "area_mm2"
BOTH = ("p_max", "area")
# limits that are exact in binary, so that a boundary is a boundary
CRITERIA = Criteria(p_max=0.0625, area=0.125, judged_by=BOTH)
# every limit by the name of its measure, written down a second time
LIMITS = {
    "p_max_MPa": 0.05,
    "area_mm2": 0.10,
    "a_mm": 0.10,
    "b_mm": 0.10,
    "centre_over_b": 0.15,
    "valley": 0.10,
    "separate_load": 0.001,
    "misplaced_load": 0.10,
}
FIELDS = ("p_max", "area", "a", "b", "centre", "valley", "separate", "misplaced")


def verdict(p: float, area: float, u_p: float = 0.0, u_area: float = 0.0, criteria: Criteria = CRITERIA):
    return judge({P: p, A: area, "b_mm": 9.0}, {P: u_p, A: u_area, "b_mm": 9.0}, criteria)


# --- verdict ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("p", "area", "u_p", "u_area", "answer", "measure"),
    [
        # clear cases; the measure that uses most of its limit
        (0.01, 0.01, 0.005, 0.005, "HOLDS", P),
        (0.01, 0.10, 0.005, 0.005, "HOLDS", A),
        (0.20, 0.01, 0.005, 0.005, "FAILS", P),
        (0.01, 0.30, 0.005, 0.005, "FAILS", A),
        # both beyond: 3.2 limits of the pressure against 4 of the area, and the other way round
        (0.20, 0.50, 0.005, 0.005, "FAILS", A),
        (0.20, 0.15, 0.005, 0.005, "FAILS", P),
        # a limit within the uncertainty, from below and from above
        (0.06, 0.01, 0.010, 0.005, "UNRESOLVED", P),
        (0.07, 0.01, 0.010, 0.005, "UNRESOLVED", P),
        (0.01, 0.12, 0.005, 0.010, "UNRESOLVED", A),
        # both open: the one with more uncertainty for its limit, not the one with more deviation
        (0.07, 0.12, 0.010, 0.100, "UNRESOLVED", A),
        (0.01, 0.13, 0.060, 0.010, "UNRESOLVED", P),
        # one certainly beyond decides, however open the other
        (0.20, 0.12, 0.005, 0.100, "FAILS", P),
        (0.06, 0.30, 0.500, 0.005, "FAILS", A),
        # beyond by more than its uncertainty although the other deviates more in its own limits, but openly
        (0.07, 0.40, 0.005, 0.390, "FAILS", P),
    ],
)
def test_truth_table(sign, p, area, u_p, u_area, answer, measure):
    judgement = verdict(sign * p, -sign * area, u_p, u_area)
    assert (judgement.answer, judgement.measure) == (answer, measure)


def test_boundaries():
    # exactly at the limit: neither beyond nor within
    assert verdict(0.0625, 0.0).answer == "UNRESOLVED"
    assert verdict(0.0, 0.125).answer == "UNRESOLVED"
    next_above, next_below = math.nextafter(0.0625, 1.0), math.nextafter(0.0625, 0.0)
    assert verdict(next_above, 0.0).answer == "FAILS"
    assert verdict(next_below, 0.0).answer == "HOLDS"
    # the uncertainty just reaches the limit, from both sides
    assert verdict(0.0625 + 0.03125, 0.0, 0.03125).answer == "UNRESOLVED"
    assert verdict(0.0625 - 0.03125, 0.0, 0.03125).answer == "UNRESOLVED"
    assert verdict(0.0625 + 0.03125, 0.0, 0.03124).answer == "FAILS"
    assert verdict(0.0625 - 0.03125, 0.0, 0.03124).answer == "HOLDS"


@pytest.mark.parametrize(
    ("p", "area", "u_p", "u_area"),
    [
        (math.nan, 0.01, 0.001, 0.001),
        (0.01, math.nan, 0.001, 0.001),
        (0.01, 0.01, math.nan, 0.001),
        (0.01, 0.01, 0.001, math.nan),
        (0.01, 0.01, 0.001, math.inf),
        (0.20, 0.01, math.nan, 0.001),
    ],
)
def test_a_measure_that_is_no_number_leaves_it_open(p, area, u_p, u_area):
    judgement = verdict(p, area, u_p, u_area)
    assert judgement.answer == "UNRESOLVED"
    # one measure is fine: the other one is named
    fine = A if not (math.isfinite(p) and math.isfinite(u_p)) else P
    assert judgement.measure == ({P, A} - {fine}).pop()


def test_a_certain_failure_needs_no_other_number():
    assert verdict(0.2, math.nan, 0.001, math.nan).answer == "FAILS"
    assert verdict(math.nan, 0.3, math.nan, 0.001).answer == "FAILS"


def test_the_verdict_follows_the_criteria():
    assert verdict(0.08, 0.01, 0.01, 0.01).answer == "FAILS"
    assert verdict(0.08, 0.01, 0.01, 0.01, Criteria(p_max=0.2, judged_by=BOTH)).answer == "HOLDS"
    assert verdict(0.08, 0.01, 0.01, 0.01, Criteria(p_max=0.085, judged_by=BOTH)).answer == "UNRESOLVED"


numbers = st.floats(-1.0, 1.0)
sizes = st.floats(0.0, 1.0)


@given(p=numbers, area=numbers, u_p=sizes, u_area=sizes, more_p=sizes, more_area=sizes)
def test_more_uncertainty_never_decides(p, area, u_p, u_area, more_p, more_area):
    before = verdict(p, area, u_p, u_area).answer
    after = verdict(p, area, u_p + more_p, u_area + more_area).answer
    # an open verdict stays open and a decided one may only become open
    assert after in (before, "UNRESOLVED")


@given(p=numbers, area=numbers, u_p=sizes, u_area=sizes)
def test_a_decision_is_right_wherever_the_truth_lies_within_the_uncertainty(p, area, u_p, u_area):
    answer = verdict(p, area, u_p, u_area).answer
    truths = [(abs(p) + i * u_p, abs(area) + j * u_area) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    holds = [max(t_p / CRITERIA.p_max, t_area / CRITERIA.area) <= 1.0 for t_p, t_area in truths]
    if answer == "HOLDS":
        assert all(holds)
    elif answer == "FAILS":
        assert not any(holds)
    else:
        # neither answer would be safe: some limit lies within
        exact = [
            abs(abs(d) - limit) <= u + 1e-12
            for d, u, limit in ((p, u_p, CRITERIA.p_max), (area, u_area, CRITERIA.area))
        ]
        assert any(exact)


@given(p=numbers, area=numbers, u_p=sizes, u_area=sizes, wider=st.floats(1.0, 5.0))
def test_wider_limits_never_turn_a_yes_into_a_no(p, area, u_p, u_area, wider):
    order = ("FAILS", "UNRESOLVED", "HOLDS")
    wide = Criteria(p_max=wider * CRITERIA.p_max, area=wider * CRITERIA.area, judged_by=BOTH)
    strict_, loose = verdict(p, area, u_p, u_area), verdict(p, area, u_p, u_area, wide)
    assert order.index(loose.answer) >= order.index(strict_.answer)


# --- all measures -----------------------------------------------------------------------------------------------


def judged(deviation: dict[str, float], uncertainty: dict[str, float] | None = None, **criteria: object):
    """All measures at zero with no uncertainty but these."""
    zero = dict.fromkeys((*MEASURES, *MISFITS), 0.0)
    return judge(zero | deviation, zero | (uncertainty or {}), Criteria(**criteria))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("measure", LIMITS)
def test_each_measure_is_judged_by_its_own_limit(measure, sign):
    limit = LIMITS[measure]
    for factor, answer in ((0.999, "HOLDS"), (1.0, "UNRESOLVED"), (1.001, "FAILS")):
        judgement = judged({measure: sign * factor * limit})
        assert (judgement.answer, judgement.measure) == (answer, measure)
        assert judgement.each == dict.fromkeys(LIMITS, "HOLDS") | {measure: answer}
        assert judgement.failing == ((measure,) if answer == "FAILS" else ())
        assert judgement.unknown == ()
    # an uncertainty that reaches the limit from either side leaves it open; a little less decides
    for factor, far in ((0.5, "HOLDS"), (1.5, "FAILS")):
        assert judged({measure: sign * factor * limit}, {measure: 0.501 * limit}).answer == "UNRESOLVED"
        assert judged({measure: sign * factor * limit}, {measure: 0.499 * limit}).answer == far


def test_what_is_judged_by_nobody_does_not_matter():
    # extents and approach have no limit
    off = {"extent_x_mm": 0.9, "extent_y_mm": -0.9, "approach_mm": math.nan}
    assert judged(off, dict.fromkeys(off, math.nan)).answer == "HOLDS"


def test_several_measures_fail_and_the_one_furthest_beyond_decides():
    # 3, 4 and 5 limits
    judgement = judged({"p_max_MPa": -0.15, "b_mm": 0.40, "separate_load": 0.005})
    assert (judgement.answer, judgement.measure) == ("FAILS", "separate_load")
    assert judgement.failing == ("p_max_MPa", "b_mm", "separate_load")
    assert sum(answer == "HOLDS" for answer in judgement.each.values()) == 5


def test_a_failure_is_worse_than_an_open_measure_and_that_than_none():
    assert ANSWERS_BEST_FIRST == ("HOLDS", "UNRESOLVED", "FAILS")
    judgement = judged({"valley": 0.3}, {"a_mm": 5.0})
    assert (judgement.answer, judgement.measure, judgement.failing) == ("FAILS", "valley", ("valley",))
    assert (judgement.each["a_mm"], judgement.each["b_mm"]) == ("UNRESOLVED", "HOLDS")


@pytest.mark.parametrize("measure", LIMITS)
def test_no_number_never_holds(measure):
    for deviation, uncertainty in ((math.nan, 0.0), (0.0, math.nan), (math.nan, math.nan), (0.0, math.inf)):
        judgement = judged({measure: deviation}, {measure: uncertainty})
        assert (judgement.answer, judgement.measure, judgement.each[measure]) == ("UNRESOLVED", measure, "UNRESOLVED")
        # it was told, but is no number
        assert judgement.unknown == ()


@pytest.mark.parametrize("measure", LIMITS)
@pytest.mark.parametrize("missing", ["deviation", "uncertainty", "both"])
def test_a_measure_that_the_result_does_not_tell_leaves_it_open(measure, missing):
    deviation = dict.fromkeys(LIMITS, 0.0)
    uncertainty = dict(deviation)
    if missing != "uncertainty":
        del deviation[measure]
    if missing != "deviation":
        del uncertainty[measure]
    judgement = judge(deviation, uncertainty, Criteria())
    assert (judgement.answer, judgement.measure, judgement.unknown) == ("UNRESOLVED", measure, (measure,))
    assert judgement.each == dict.fromkeys(LIMITS, "HOLDS") | {measure: "UNRESOLVED"}
    # whoever does not ask for it has his answer
    rest = tuple(name for name, field_measure in zip(FIELDS, LIMITS, strict=True) if field_measure != measure)
    assert judge(deviation, uncertainty, Criteria(judged_by=rest)).answer == "HOLDS"
    # and a certain failure needs nothing else
    failing_measure = next(name for name in LIMITS if name != measure)
    failed = judge(deviation | {failing_measure: 0.9}, uncertainty, Criteria())
    assert (failed.answer, failed.measure, failed.unknown) == ("FAILS", failing_measure, (measure,))


# --- criteria ---------------------------------------------------------------------------------------------------


def test_default_criteria_are_all_measures():
    assert Criteria().judged_by == ("all",)
    assert Criteria().limits == LIMITS
    assert set(LIMITS) <= {*MEASURES, *MISFITS}


@pytest.mark.parametrize(
    ("judged_by", "measures"),
    [
        (("strength",), {"p_max_MPa"}),
        (("patch",), {"area_mm2", "a_mm", "b_mm", "centre_over_b"}),
        (("all",), set(LIMITS)),
        (("strength", "patch"), {"p_max_MPa", "area_mm2", "a_mm", "b_mm", "centre_over_b"}),
        (("strength", "valley"), {"p_max_MPa", "valley"}),
        (("b", "patch"), {"area_mm2", "a_mm", "b_mm", "centre_over_b"}),
        (("misplaced",), {"misplaced_load"}),
        (("all", "a"), set(LIMITS)),
    ],
)
def test_sets_of_measures_and_single_ones(judged_by, measures):
    assert Criteria(judged_by=judged_by).limits == {name: LIMITS[name] for name in measures}


def test_who_asks_for_strength_does_not_hear_of_the_patch():
    deviation, uncertainty = dict.fromkeys(LIMITS, 0.0) | {"b_mm": 0.3, "valley": math.nan}, dict.fromkeys(LIMITS, 0.0)
    answers = {
        name: judge(deviation, uncertainty, Criteria(judged_by=(name,))) for name in ("strength", "patch", "all")
    }
    assert {name: judgement.answer for name, judgement in answers.items()} == {
        "strength": "HOLDS",
        "patch": "FAILS",
        "all": "FAILS",
    }
    assert set(answers["strength"].each) == {P}
    assert judge(deviation, uncertainty, Criteria(judged_by=("valley",))).answer == "UNRESOLVED"


@pytest.mark.parametrize("value", [0.0, -0.05, 1.0, 5.0, math.nan, math.inf])
@pytest.mark.parametrize(("name", "measure"), list(zip(FIELDS, LIMITS, strict=True)))
def test_limits_out_of_range(name, measure, value):
    with pytest.raises(InputError, match=f"limit of {measure} is .*between 0 and 1"):
        Criteria(**{name: value})


@pytest.mark.parametrize("value", [1e-6, 0.999])
@pytest.mark.parametrize(("name", "measure"), list(zip(FIELDS, LIMITS, strict=True)))
def test_limits_in_range(name, measure, value):
    assert Criteria(**{name: value}).limits == LIMITS | {measure: value}


@pytest.mark.parametrize(
    ("judged_by", "said"),
    [
        (("p_mx",), "judged by is 'p_mx'; allowed: .*; did you mean p_max\\?"),
        (("strength", "creep"), "judged by is 'creep'; allowed: "),
        # names of the measures are those of the fields here
        (("p_max_MPa",), "judged by is 'p_max_MPa'; allowed: .*; did you mean p_max\\?"),
        ((), "judged by is \\(\\); allowed: "),
        ("strength", "judged by is 'strength'; allowed: "),
        ((3,), "judged by is 3; allowed: "),
    ],
)
def test_unknown_measures_are_refused_with_all_that_are_known(judged_by, said):
    with pytest.raises(InputError, match=said) as refused:
        Criteria(judged_by=judged_by)
    for name in ("strength", "patch", "all", *FIELDS):
        assert name in str(refused.value).split("allowed: ")[1]


# --- cause ------------------------------------------------------------------------------------------------------

PLAIN = {
    "junction_distance_mm": 5.0,
    "junction_distance_over_b": 1.2,
    "junction_in_patch": False,
    "curvature_variation": 0.1,
    "normal_turn_rad": 0.05,
    "lobes": 1,
    "patch_count": 1,
}


def cause(gap_step: float, body_step: float, **geometry: object) -> str:
    steps = {
        "hertz_to_quadratic": {P: 0.9, A: 0.9},  # the discretisation is no cause
        "quadratic_to_true_gap": {P: gap_step, A: 0.01},
        "half_space_to_bodies": {P: body_step, A: 0.02},
    }
    return find_cause(steps, P, PatchGeometry(**{**PLAIN, **geometry}))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("geometry", "expected"),
    [
        ({}, "curvature varies over the patch"),
        ({"normal_turn_rad": 0.31}, "conformity"),
        ({"normal_turn_rad": 0.29}, "curvature varies over the patch"),
        ({"junction_in_patch": True}, "curvature change within the patch"),
        ({"patch_count": 2, "lobes": 2}, "second patch"),
        # a second patch so small that it is no lobe
        ({"patch_count": 2}, "second patch"),
        ({"lobes": 2}, "second lobe"),
        # the more specific one first
        ({"junction_in_patch": True, "normal_turn_rad": 0.5}, "curvature change within the patch"),
        ({"lobes": 2, "junction_in_patch": True, "normal_turn_rad": 0.5}, "second lobe"),
        ({"patch_count": 2, "lobes": 3, "junction_in_patch": True, "normal_turn_rad": 0.5}, "second patch"),
    ],
)
def test_cause_where_the_gap_decides(geometry, expected, sign):
    assert cause(sign * 0.2, -sign * 0.1, **geometry) == expected


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_cause_where_the_bodies_decide(sign):
    everything = {"patch_count": 2, "junction_in_patch": True, "normal_turn_rad": 0.5}
    assert cause(sign * 0.1, -sign * 0.2, **everything) == "finite bodies"
    # equal steps: the geometry, which says more
    assert cause(sign * 0.1, -sign * 0.1, **everything) == "second patch"


def test_the_cause_is_that_of_the_deciding_measure():
    steps = {
        "hertz_to_quadratic": {P: 0.0, A: 0.0},
        "quadratic_to_true_gap": {P: 0.3, A: 0.01},
        "half_space_to_bodies": {P: 0.1, A: 0.20},
    }
    geometry = PatchGeometry(**PLAIN)
    assert find_cause(steps, P, geometry) == "curvature varies over the patch"
    assert find_cause(steps, A, geometry) == "finite bodies"


@pytest.mark.parametrize(
    ("gap", "bodies", "expected"),
    [
        # S1002 on 60E1, 5 mm: at 125 kN two patches on the half-space as well; at 150 kN they just touch there
        ({"separate_load": 0.195, "valley": 0.605}, {"separate_load": -0.008, "valley": 0.012}, "second patch"),
        ({"separate_load": 0.0, "valley": 0.597}, {"separate_load": 0.197, "valley": 0.017}, "second patch"),
        # nothing there on the half-space
        ({"separate_load": 0.0, "valley": 0.0}, {"separate_load": 0.02, "valley": 0.3}, "finite bodies"),
    ],
)
def test_patches_that_just_touch_on_a_rung_are_a_second_patch_all_the_same(gap, bodies, expected):
    steps = {
        "hertz_to_quadratic": dict.fromkeys(gap, 0.0),
        "quadratic_to_true_gap": gap,
        "half_space_to_bodies": bodies,
    }
    geometry = PatchGeometry(**{**PLAIN, "patch_count": 2, "lobes": 2})
    assert find_cause(steps, "separate_load", geometry) == expected
