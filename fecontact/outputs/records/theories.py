"""Judged theories as records, columns and words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from fecontact.comparison.approximation import Approximation, TheoryPatch
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judgement import Judgement, cheapest, first_standing
from fecontact.comparison.measures import Measures, hertz_measures
from fecontact.comparison.theories import EITHER_SIDE, HERTZ, OF_ELLIPSES, THEORIES
from fecontact.comparison.verdict import Verdict
from fecontact.map.cells import ApplicabilityMap, MapCell
from fecontact.outputs.records.plain import Record, picked
from fecontact.theory.hertz import HertzContact


def other_theories(load: JudgedLoad) -> dict[str, Judgement]:
    """The judged theories besides Hertz's ellipse at the first touch point."""
    return {name: one for name, one in load.judgements.items() if name not in EITHER_SIDE}


def theories_of(load: JudgedLoad) -> dict[str, Judgement]:
    """Every judged theory; Hertz by the worst of both sides: who takes either curvature must be able to rely on it."""
    worst = max(load.sides.values(), key=lambda side: side.limit_used)
    return {HERTZ: replace(worst, verdict=load.verdict)} | other_theories(load)


def theories_of_cell(cell: MapCell) -> dict[str, Judgement]:
    """Every judged theory of a cell of a map; none of one that may not be used."""
    return theories_of(cell.usable) if cell.usable else {}


def judged_by(load: JudgedLoad | None, theory: str) -> JudgedLoad | Judgement | None:
    """A load by a theory, of Hertz the load itself; None where the theory has no contact.

    A theory that says nothing of its own, such as springs at a single touch point, is Hertz.
    """
    if load is None or theory in load.without:
        return None
    return load if theory == HERTZ else load.judgements.get(theory, load)


def ellipses_instead(load: JudgedLoad | None) -> str | None:
    """The theory of ellipses that holds where the single one of Hertz does not; None where it does, or none holds."""
    if load is None or not load.usable or load.verdict.answer == "HOLDS":
        return None
    others = other_theories(load).items()
    return next((name for name, one in others if name in OF_ELLIPSES and one.verdict.answer == "HOLDS"), None)


def all_ellipses_instead(made: ApplicabilityMap) -> str:
    """The theories of ellipses that hold in cells of a map where Hertz does not, in words; empty without one."""
    found = {ellipses_instead(cell.judged) for cell in made.cells}
    return " or ".join(theory.words for name, theory in THEORIES.items() if name in found)


def share_records(made: ApplicabilityMap) -> list[Record]:
    """In how many cells of a map each theory of the pressure is the cheapest that holds, and in how many it holds.

    The last lines are the cells where it is open which, where none holds, and those that may not be used.
    """
    cells = [theories_of_cell(cell) for cell in made.cells]
    answers = [cheapest_name(one) if one else "failed" for one in cells]

    def counted(of: str, count: int) -> Record:
        return {f"{of}_cells": count, f"{of}_percent": 100.0 * count / len(cells) if cells else 0.0}

    found: list[Record] = []
    for name in (name for name in THEORIES if any(name in one for one in cells)):
        used = [one[name].limit_used for one, answer in zip(cells, answers, strict=True) if answer == name]
        found.append(
            {
                "theory": name,
                **picked(THEORIES[name], "words cost"),
                **counted("cheapest", len(used)),
                "largest_limit_used": max(used, default=None),
                **counted("holds", sum(name in one and one[name].verdict.answer == "HOLDS" for one in cells)),
            }
        )
    others = ("UNRESOLVED", "none", "failed")
    return found + [{"theory": name, **counted("cheapest", answers.count(name))} for name in others]


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
        **contact_record(contact, judged.measures),
        **picked(judged, "deviation uncertainty"),
        "verdict": verdict_record(judged.verdict),
        "limit_used": judged.limit_used,
    }


def contact_record(contact: Approximation, measures: Measures) -> Record:
    """What a theory of the pressure says of a contact."""
    return {
        **measures.as_dict(),
        **picked(contact, "centre_mm overlapping status notes solutions"),
        "patches": [_patch_record(one) for one in contact.patches],
    }


def _patch_record(patch: TheoryPatch) -> Record:
    where = picked(patch, "centre_mm")
    if (touch := patch.touch) is not None:
        at = {"touch_point": patch.touch_point, "touch_rail_y_mm": touch.rail_y_mm}
        where = {**at, "contact_angle_rad": touch.contact_angle_rad, **where}
    if patch.hertz is not None:
        return where | ellipse_record(patch.hertz)
    return where | picked(patch, "normal_force_N p_max_MPa area_mm2 a_mm b_mm")


def answer_record(verdict: Verdict) -> Record:
    """The answer of a verdict, what decided it, and the answer of each measure."""
    return {"verdict": verdict.answer, **picked(verdict, "measure each")}


def verdict_record(verdict: Verdict) -> Record:
    """A verdict without its limits and its cause."""
    return answer_record(verdict) | picked(verdict, "unknown")


def ellipse_record(hertz: HertzContact) -> Record:
    """An ellipse with its force."""
    return {
        "normal_force_N": hertz.normal_force_N,
        **hertz_measures(hertz).as_dict(),
        **picked(hertz, "orientation_rad A_per_mm B_per_mm stiffness_GN_per_m15"),
    }


def theory_columns(load: JudgedLoad) -> Record:
    """Columns of a row: the cheapest theory that holds, and each theory but Hertz that says something of its own."""
    columns: Record = {"theory_cheapest": cheapest_name(theories_of(load))}
    for name, judged in other_theories(load).items():
        columns[f"theory_{name}_verdict"] = judged.verdict.answer
        columns[f"theory_{name}_measure"] = judged.verdict.measure
        columns[f"theory_{name}_limit_used"] = judged.limit_used
        for measure, short in (("p_max_MPa", "p_max"), ("area_mm2", "area")):
            columns[f"theory_{name}_{short}_deviation_percent"] = 1e2 * judged.deviation[measure]
    return columns


def cheapest_name(theories: Mapping[str, Judgement]) -> str:
    """The cheapest of theories that holds, UNRESOLVED where it is open which, `none` where all fail."""
    return cheapest(theories) or ("UNRESOLVED" if first_standing(theories) else "none")


def theory_text(row: Mapping[str, Any]) -> str:
    """What a row says of the theory to take where Hertz does not hold; empty where it does, and without one."""
    name = str(row.get("theory_cheapest"))
    if name not in THEORIES or name in EITHER_SIDE:
        return ""
    off = (float(row[f"theory_{name}_{short}_deviation_percent"]) for short in ("p_max", "area"))
    return (
        f"the cheapest theory that holds: {THEORIES[name].words} (p_max {next(off):+z.1f} %, area {next(off):+z.1f} %,"
        f" part of a limit {float(row[f'theory_{name}_limit_used']):.2f})"
    )


def cheapest_words(row: Mapping[str, Any]) -> str:
    """The cheapest theory that holds in words."""
    name = str(row.get("theory_cheapest") or "")
    return THEORIES[name].words if name in THEORIES else name
