"""Random commands that compute, over the whole library.

Each keeps its rules, and its answers have the required invariants.
"""

import json
import math
import random
from dataclasses import replace
from itertools import pairwise

import pytest
from command_matrix import FAST, SOLVING, ending, irregular, pair, try_lines

from fecontact.case import Case
from fecontact.contact_theories.registry import THEORIES
from fecontact.inputs.texts import parse_inclination
from fecontact.solving.solve import solve

# what is the same from the other side
MIRRORED = ("p_max_MPa", "area_mm2", "a_mm", "b_mm", "approach_mm", "normal_force_N")


def bad_of(tallies) -> list[str]:
    return [text for tally in tallies.values() for text in tally.bad]


def test_commands_that_compute_keep_the_rules():
    tallies = try_lines(FAST, seed=1)
    assert bad_of(tallies) == []
    # most are answered, so that the rules of answers are seen too
    assert sum(tally.answered for tally in tallies.values()) > 0.6 * sum(FAST.values())


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 12))
def test_more_commands_that_compute_keep_the_rules(seed):
    assert bad_of(try_lines(FAST, seed=seed)) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_commands_with_finite_elements_keep_the_rules(seed):
    assert bad_of(try_lines(SOLVING, seed=seed)) == []


# --- what answers have in common -----------------------------------------------------------------------------------


def answer_of(*line: str):
    """The JSON of a command, or None where it is refused."""
    ended = ending([*line, "--json"])
    return json.loads(ended.out) if ended.code == 0 else None


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 20))])
def test_the_right_wheel_is_the_mirror_image_of_the_left_one(seed):
    rng = random.Random(seed)
    shift, yaw = rng.uniform(0.5, 6.0), rng.choice((0, 4))
    body = [*pair(rng), f"--load-kn={rng.choice((20, 100))}", *irregular(rng)]
    left_at, right_at = (
        [f"--side={side}", f"--shift={sign * shift}", f"--yaw-mrad={sign * yaw}"]
        for side, sign in (("left", 1), ("right", -1))
    )
    for name in THEORIES:
        left, right = (answer_of("theory", name, *body, *at) for at in (left_at, right_at))
        assert (left is None) == (right is None), name
        if left is not None:
            assert [right[key] for key in MIRRORED] == pytest.approx([left[key] for key in MIRRORED], rel=1e-6), name


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 20))])
def test_both_sides_of_a_wheelset_are_alike(seed):
    rng = random.Random(seed)
    shift = round(rng.uniform(0.5, 6.0), 2)
    answer = answer_of("geometry", *pair(rng), f"--shifts={-shift},0,{shift}")
    if answer is None:
        # crane rails on a railway gauge: the wheelset stands at none of the shifts
        return
    outward, middle, inward = answer["positions"]
    if "left" not in outward or "right" not in outward:
        # a position that is refused is refused on both sides
        assert "left" not in inward or "right" not in inward
        return
    assert middle["left"] == middle["right"]
    for key in ("rail_y_mm", "wheel_y_mm", "contact_angle_rad", "rolling_radius_mm"):
        for side, opposite_side in (("left", "right"), ("right", "left")):
            far_side, near_side = (
                [touch[key] for touch in at[side]["contact_points"]]
                for at, side in ((outward, side), (inward, opposite_side))
            )
            assert far_side == pytest.approx(near_side, abs=1e-6), key


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 20))])
def test_more_load_presses_deeper_and_wider(seed):
    rng = random.Random(seed)
    where = [*pair(rng), f"--shift={rng.uniform(-6.0, 5.0):.2f}"]
    for name in THEORIES:
        answers = [answer_of("theory", name, *where, f"--load-kn={load}") for load in (20, 50, 110)]
        contacts = [answer for answer in answers if answer is not None]
        for lighter, heavier in pairwise(contacts):
            for measure in ("approach_mm", "area_mm2", "normal_force_N"):
                assert heavier[measure] > lighter[measure], (name, measure)


# two patches, of which the outer one is steep; and pairs at random
WHERE = ["--rail=60E1", "--wheel=S1002", "--shift=5", "--load-kn=50"]


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 20))])
def test_patches_share_the_whole_normal_force(seed):
    rng = random.Random(seed)
    where = WHERE if seed == 0 else [*pair(rng), f"--shift={rng.uniform(3.0, 7.0):.2f}", "--load-kn=50"]
    for name in ("multi_hertz", "half_space"):
        record = answer_of("theory", name, *where)
        if record is None or len(record["patches"]) < 2:
            assert seed > 0
            continue
        assert sum(patch["normal_force_N"] for patch in record["patches"]) == pytest.approx(
            record["normal_force_N"], rel=1e-6
        )
        if name == "multi_hertz":
            # along the normal of each: together they carry the wheel
            vertical = sum(
                patch["normal_force_N"] * math.cos(patch["contact_angle_rad"]) for patch in record["patches"]
            )
            assert vertical == pytest.approx(50e3, rel=1e-3)


# --- what solved cases have in common --------------------------------------------------------------------------------

OF_FE = ("p_max_MPa", "area_mm2", "a_mm", "b_mm", "approach_mm")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_solved_cases_balance_mirror_and_press_deeper(seed):
    rng = random.Random(seed)
    rail, wheel, inclination = (word.split("=")[1] for word in pair(rng))
    left = Case(
        rail=rail,
        wheel=wheel,
        inclination_rad=parse_inclination(inclination),
        lateral_shift_mm=round(rng.uniform(-6.0, 5.0), 2),
        load_N=1e3 * rng.choice((20, 60)),
        load_kind="normal",
        resolution="quick",
        refine="never",
    )
    right = replace(left, side="right", lateral_shift_mm=-left.lateral_shift_mm)
    original, mirrored, heavier = (solve(case) for case in (left, right, replace(left, load_N=1.8 * left.load_N)))
    for result in (original, mirrored, heavier):
        field = result.load.fe.pressure.whole()
        if result.load.comparison.patch.patch_count == 1:
            # where the surface turns below the patch, less of the pressure counts along the normal at first touch; in
            # planes of their own patches do so too
            area = field.grid.weights * math.prod(field.grid.steps_mm)
            assert float((area * field.values).sum()) == pytest.approx(result.normal_force_N, rel=2e-3)
            assert result.normal_force_N == pytest.approx(result.case.load_N, rel=1e-6)
        verdict, limits = result.verdict, result.case.criteria.limits
        answers = {name: answer_of_numbers(result.load, name, limit) for name, limit in limits.items()}
        assert dict(verdict.each) == answers
    measures, mirrored_measures = (result.comparison.fe.as_dict() for result in (original, mirrored))
    for measure in OF_FE:
        # the mesh is mirrored too, up to the rounding of its nodes
        assert mirrored_measures[measure] == pytest.approx(measures[measure], rel=1e-4), measure
    assert mirrored.verdict.each == original.verdict.each
    for measure in ("p_max_MPa", "area_mm2", "approach_mm"):
        assert heavier.comparison.fe.as_dict()[measure] > measures[measure], measure


def answer_of_numbers(load, measure: str, limit: float) -> str:
    """The answer that deviation, uncertainty and limit of a measure give."""
    off, uncertainty = abs(load.deviation[measure]), load.uncertainty[measure]
    if off - uncertainty > limit:
        return "FAILS"
    return "HOLDS" if off + uncertainty < limit else "UNRESOLVED"
