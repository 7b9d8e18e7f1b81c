"""Reliability of verdicts on worn heads: library profiles with exact wear and drawn noise.

Ten heads, each with a smooth depth taken off in the vertical: exact points every 0.05 mm are the truth, points every
0.2 mm with 10 um of noise the measurement. Hertz against the half-space on every line that these allow is kept in a
file, one head and draw a line of it; a later call goes on where the file ends, and says what all of it comes to.

    python studies/benchmark_wear.py FILE FIRST_SEED LAST_SEED

A draw takes 4 CPU seconds.
"""

import json
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import fecontact
from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ
from fecontact.criteria import Criteria
from fecontact.judging.lines import ProfileVariants, VariantResult
from fecontact.judging.lobes import judge_profile_variant
from fecontact.judging.verdict import judge, judge_profile_variants
from fecontact.profiles.library import ArrayProfile, load_library_profile
from fecontact.profiles.reading import Reading
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space
from fecontact.solving.profile_variants import judge_case_variants

NOISE_MM, STEP_MM, EXACT_STEP_MM = 0.01, 0.2, 0.05
CRITERIA = Criteria(judged_by=("p_max", "area", "a", "b", "separate"))
MEASURES = ("p_max_MPa", "area_mm2", "a_mm", "b_mm")
# Rail; middle of the wear, its half width and depth; lateral shift (mm) and load (kN).
HEADS = (
    ("60E1", -5, 18, 1.0, 0, 60),
    ("60E1", 8, 14, 1.0, -4, 60),
    ("60E1", -22, 12, 1.0, 4, 60),
    ("60E1", -8, 22, 1.0, -2, 100),
    ("60E1", 0, 12, 0.5, 2, 60),
    ("54E1", -5, 18, 1.0, -3, 60),
    ("54E1", 8, 14, 0.7, 0, 60),
    ("60E2", -10, 15, 1.0, 1, 60),
    ("49E1", 0, 20, 1.0, -4, 60),
    ("60E1", -15, 10, 0.6, 3, 100),
)


def head(number: int, noise_mm: float, step_mm: float, seed: int) -> ArrayProfile:
    """Points of a worn head."""
    name, middle, width, depth, *_ = HEADS[number]
    line = load_library_profile(name)
    p = line.evaluate(line.at_arc_length(np.arange(0.0, line.length_mm, step_mm)))
    noise = noise_mm * np.random.default_rng([seed, number]).normal(size=p.y.size)
    worn = depth * np.exp(-(((p.y - middle) / width) ** 2))
    return fecontact.profile(p.y - noise * np.sin(p.angle_rad), p.z - worn + noise * np.cos(p.angle_rad), name="worn")


def case_of(number: int, rail: ArrayProfile, **reading: float) -> Case:
    """A wheel of S1002 on a worn head."""
    *_, shift, load_kN = HEADS[number]
    return Case(
        rail=rail,
        rail_file=Reading(mirror=False, **reading),
        lateral_shift_mm=float(shift),
        load_N=1e3 * load_kN,
        roll="given",
        criteria=CRITERIA,
    )


def variant_record(variant: VariantResult) -> dict[str, Any]:
    """Stored results of a profile variant."""
    return {"p": variant.p_max_MPa, "dev": dict(variant.deviations.get(HERTZ, {}))}


@cache
def truth(number: int) -> dict[str, Any]:
    """Hertz and the half-space on the exact worn profile."""
    case = case_of(number, head(number, 0.0, EXACT_STEP_MM, 0), filter_mm=0.0)
    placement = place_case(case)
    _, expected = expect_on_half_space(case, placement, nodes=16)
    return variant_record(judge_profile_variant("exact", case, placement, expected.half_space))


def measure_draw(number: int, seed: int) -> dict[str, Any]:
    """Record of a head and a draw: the truth, and the results of each variant."""
    case = case_of(number, head(number, NOISE_MM, STEP_MM, seed))
    variants = judge_case_variants(case, place_case(case))
    assert variants is not None
    return {
        "k": number,
        "seed": seed,
        "truth": truth(number),
        "lines": {variant.label: variant_record(variant) for variant in variants.all},
    }


def judge_record(record: dict[str, Any]) -> tuple[str, str, dict[str, float]]:
    """True verdict, reported verdict, and stated uncertainty over the true error, by measure."""
    reference_variant, *other_variants = (
        VariantResult(label=label, p_max_MPa=variant["p"], deviations={HERTZ: variant["dev"]} if variant["dev"] else {})
        for label, variant in record["lines"].items()
    )
    variants, true, deviation = (
        ProfileVariants(own=reference_variant, others=tuple(other_variants)),
        record["truth"]["dev"],
        reference_variant.deviations[HERTZ],
    )
    exact = dict.fromkeys(true, 0.0)
    verdict, stated = judge_profile_variants(deviation, exact, variants.find_shifts(HERTZ), CRITERIA)
    ratios = {name: stated[name] / max(abs(true[name] - deviation[name]), 1e-9) for name in MEASURES}
    return judge(true, exact, CRITERIA).answer, verdict.answer, ratios


def summary(records: list[dict[str, Any]]) -> str:
    """Decided and correct shares, and stated uncertainties relative to the true errors."""
    judgements = [judge_record(record) for record in records]
    decided = [(true, said) for true, said, _ in judgements if said != "UNRESOLVED"]
    wrong = sum(true != said for true, said in decided)
    lines = [f"{len(judgements)} draws: {100.0 * len(decided) / len(judgements):.0f} % decided, {wrong} of them wrong"]
    for name in MEASURES:
        ratios = np.array([draw_ratios[name] for *_, draw_ratios in judgements])
        inside = 100.0 * np.mean(ratios >= 1.0)
        lines.append(f"{name}: true error inside in {inside:.0f} %, stated over true {np.median(ratios):.2f} (median)")
    return "\n".join(lines)


def main() -> None:
    path, first, last = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    records = [json.loads(line) for line in path.read_text("utf-8").splitlines()] if path.exists() else []
    finished = {(record["k"], record["seed"]) for record in records}
    with path.open("a", encoding="utf-8") as file:
        for number, seed in ((k, seed) for seed in range(first, last + 1) for k in range(len(HEADS))):
            if (number, seed) not in finished:
                records.append(measure_draw(number, seed))
                print(json.dumps(records[-1]), file=file, flush=True)
    print(summary(records))


if __name__ == "__main__":
    main()
