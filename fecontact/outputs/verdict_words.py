"""Verdicts and positions in words: in pictures and in reports."""

from __future__ import annotations

import math

from fecontact.case import Case
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.verdict import Answer
from fecontact.geometry.placement import Placement
from fecontact.outputs.measure_words import WORDS
from fecontact.outputs.series import short_name
from fecontact.profiles.identity import profile_identity
from fecontact.solving.placing import roll_of_case
from fecontact.solving.solve import CaseResult

_NEAREST: dict[Answer, str] = {
    "HOLDS": "nearest to its limit",
    "UNRESOLVED": "open",
    "FAILS": "furthest beyond its limit",
}


def verdict_reason(load: JudgedLoad) -> str:
    """What decided the verdict, how far Hertz is off in it, and why, in one line."""
    if load.status != "converged":
        return f"not to be used: {load.status}"
    verdict = load.verdict
    # the side whose verdict it is, that of the field side where both are the same
    side, judged = next(
        (side, judged)
        for side, judged in reversed([*load.sides.items()])
        if (judged.verdict.each, judged.verdict.measure) == (verdict.each, verdict.measure)
    )
    measure = verdict.measure
    text = measure_reason(
        measure,
        verdict.each[measure],
        judged.deviation.get(measure),
        judged.uncertainty.get(measure),
        load.case.criteria.limits[measure],
    )
    at = "" if side == "both" else f", with the curvature of the {side} side"
    return f"{text}{at}" + (f"; because: {verdict.cause}" if verdict.cause else "")


def measure_reason(
    measure: str, answer: Answer, deviation: float | None, uncertainty: float | None, limit: float
) -> str:
    """How far Hertz is off in the measure that decided, beside its uncertainty and limit."""
    words = WORDS[measure]
    return (
        f"{_NEAREST[answer]}: {words.name} {words.off(deviation)} ± {words.off(uncertainty, size=True)}"
        f" (limit {words.limit(limit)})"
    )


def case_words(case: Case, placement: Placement) -> str:
    """Pair, position and load of a case, in one line."""
    rail, wheel = (short_name(profile_identity(spec)) for spec in (case.rail, case.wheel))
    roll = 1e3 * roll_of_case(case, placement)
    turned = f", yaw {1e3 * case.yaw_rad:+.4g} mrad" if case.yaw_rad else ""
    if case.roll != "given":
        turned = f" of the wheelset, {case.side} side, roll {roll:+z.4g} mrad{turned}"
    elif roll:
        turned = f", roll {roll:+.4g} mrad{turned}"
    return (
        f"rail {rail}{inclination_words(case.inclination_rad)}, wheel {wheel};"
        f" shift {case.lateral_shift_mm:+z.2f} mm{turned}; {case.load_kind} load {case.load_N / 1e3:.4g} kN"
    )


def case_annotation(result: CaseResult) -> str:
    """A case and its verdict in three lines, for a picture."""
    fe, hertz = result.comparison.fe.p_max_MPa, result.comparison.hertz.p_max_MPa
    return (
        f"{case_words(result.case, result.placement)}\nHertz {result.verdict.answer}: {verdict_reason(result.load)}\n"
        f"peak pressure: finite elements {fe:.0f} MPa, Hertz {hertz:.0f} MPa"
    )


def inclination_words(inclination_rad: float) -> str:
    """A rail's inclination such as " 1:40", nothing for an upright one."""
    return f" 1:{1.0 / math.tan(inclination_rad):.3g}" if inclination_rad else ""
