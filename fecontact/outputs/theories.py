"""Judged theories as records, columns and words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fecontact.comparison.approximation import TheoryPatch
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judgement import Judgement
from fecontact.comparison.measures import hertz_measures
from fecontact.comparison.theories import EITHER_SIDE, THEORIES
from fecontact.comparison.verdict import Verdict
from fecontact.map.cells import ApplicabilityMap
from fecontact.outputs.measure_words import WORDS
from fecontact.theory.hertz import HertzContact

Record = dict[str, Any]


def other_theories(load: JudgedLoad) -> dict[str, Judgement]:
    """The judged theories besides Hertz's ellipse at the first touch point."""
    return {name: one for name, one in load.judgements.items() if name not in EITHER_SIDE}


def theory_instead(load: JudgedLoad | None) -> str | None:
    """The cheapest theory that holds where Hertz does not; None where he does, or none holds."""
    if load is None or load.status != "converged" or load.verdict.answer == "HOLDS":
        return None
    return next((name for name, one in other_theories(load).items() if one.verdict.answer == "HOLDS"), None)


def theories_instead(made: ApplicabilityMap) -> str:
    """The theories that hold in cells of a map where Hertz does not, in words; empty where there are none."""
    found = {theory_instead(cell.judged) for cell in made.cells}
    return " or ".join(theory.words for name, theory in THEORIES.items() if name in found)


def theories_record(load: JudgedLoad) -> Record:
    """Every theory that was judged, and why another one has no contact."""
    judged = {name: judgement_record(one) for name, one in load.judgements.items()}
    found = judged | {name: {"problem": problem} for name, problem in load.without.items()}
    return {name: found[name] for name in THEORIES if name in found}


def judgement_record(judged: Judgement) -> Record:
    """A theory of the pressure and its verdict."""
    contact = judged.approximation
    assert contact is not None
    return {
        **judged.measures.as_dict(),
        "centre_mm": list(contact.centre_mm),
        "overlapping": contact.overlapping,
        "patches": [_patch_record(one) for one in contact.patches],
        "deviation": dict(judged.deviation),
        "uncertainty": dict(judged.uncertainty),
        "verdict": verdict_record(judged.verdict),
        "limit_used": judged.limit_used,
    }


def _patch_record(patch: TheoryPatch) -> Record:
    touch = patch.touch
    where: Record = (
        {}
        if touch is None
        else {
            "touch_point": patch.touch_point,
            "touch_rail_y_mm": touch.rail_y_mm,
            "contact_angle_rad": touch.contact_angle_rad,
        }
    )
    where["centre_mm"] = list(patch.centre_mm)
    if patch.hertz is not None:
        return where | ellipse_record(patch.hertz)
    return where | {
        "normal_force_N": patch.normal_force_N,
        "p_max_MPa": patch.p_max_MPa,
        "area_mm2": patch.area_mm2,
        "a_mm": patch.a_mm,
        "b_mm": patch.b_mm,
    }


def verdict_record(verdict: Verdict) -> Record:
    """A verdict without its limits and its cause."""
    return {
        "verdict": verdict.answer,
        "measure": verdict.measure,
        "each": dict(verdict.each),
        "unknown": list(verdict.unknown),
    }


def ellipse_record(hertz: HertzContact) -> Record:
    """An ellipse with its force."""
    return {
        "normal_force_N": hertz.normal_force_N,
        **hertz_measures(hertz).as_dict(),
        "orientation_rad": hertz.orientation_rad,
        "A_per_mm": hertz.A_per_mm,
        "B_per_mm": hertz.B_per_mm,
        "stiffness_GN_per_m15": hertz.stiffness_GN_per_m15,
    }


def theory_columns(load: JudgedLoad) -> Record:
    """Columns of a row for each theory but Hertz; none of one that says nothing of its own."""
    columns: Record = {}
    for name, judged in other_theories(load).items():
        assert judged.approximation is not None
        columns |= {
            f"{name}_patches": len(judged.approximation.patches),
            f"{name}_overlapping": judged.approximation.overlapping,
            f"{name}_verdict": judged.verdict.answer,
            f"{name}_measure": judged.verdict.measure,
            f"{name}_limit_used": judged.limit_used,
        }
        for measure, short in (("p_max_MPa", "p_max"), ("area_mm2", "area")):
            columns[f"{name}_{short}_deviation_percent"] = 1e2 * judged.deviation[measure]
            columns[f"{name}_{short}_uncertainty_percent"] = 1e2 * judged.uncertainty[measure]
    return columns


def theory_texts(row: Mapping[str, Any]) -> list[str]:
    """What a row says of each theory but Hertz."""
    return [_theory_text(row, name) for name in THEORIES if name not in EITHER_SIDE and row.get(f"{name}_verdict")]


def _theory_text(row: Mapping[str, Any], name: str) -> str:
    off = (float(row[f"{name}_{short}_deviation_percent"]) for short in ("p_max", "area"))
    measure = WORDS[str(row[f"{name}_measure"])].name
    # a row that was read from a table has texts
    count = int(row[f"{name}_patches"])
    overlap = "; its patches overlap" if row.get(f"{name}_overlapping") in (True, "True") else ""
    return (
        f"{THEORIES[name].words} ({count} {'patch' if count == 1 else 'patches'}):"
        f" {row[f'{name}_verdict']} by {measure} (p_max {next(off):+z.1f} %, area {next(off):+z.1f} %, part of a limit"
        f" {float(row[f'{name}_limit_used']):.2f}){overlap}"
    )
