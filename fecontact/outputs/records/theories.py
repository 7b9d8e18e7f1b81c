"""The judged theories of a load or a map: which is the cheapest that holds, how often each is, and in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judgement import Judgement, Standing, cheapest, standings
from fecontact.comparison.theories import EITHER_SIDE, HERTZ, OF_ELLIPSES, THEORIES
from fecontact.map.cells import ApplicabilityMap, MapCell
from fecontact.outputs.records.told import Record, picked


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


def cheapest_of(load: JudgedLoad) -> Standing:
    """The cheapest theory of the pressure that holds."""
    return cheapest(standings(theories_of(load)), in_range=load.case.criteria.theories_in_range)


def ellipses_instead(load: JudgedLoad | None) -> Standing | None:
    """The theory of ellipses that holds where the single one of Hertz does not; None where it does, or none holds."""
    if load is None or not load.usable or load.verdict.answer == "HOLDS":
        return None
    holding = (one for one in standings(other_theories(load)) if one.name in OF_ELLIPSES and one.answer == "HOLDS")
    found = cheapest(holding, in_range=load.case.criteria.theories_in_range)
    return found if found.name else None


def all_ellipses_instead(made: ApplicabilityMap) -> str:
    """The theories of ellipses that hold in cells of a map where Hertz does not, in words; empty without one."""
    found = (ellipses_instead(cell.judged) for cell in made.cells)
    return " or ".join(dict.fromkeys(theory_words(one.name, "out of range" * one.out_of_range) for one in found if one))


def share_records(made: ApplicabilityMap) -> list[Record]:
    """In how many cells of a map each theory of the pressure is the cheapest that holds, and in how many it holds.

    The last lines are the cells where it is open which, where none holds, and those that may not be used.
    """
    loads = [cell.usable for cell in made.cells if cell.usable]
    cells, cheapest_ones = [theories_of(load) for load in loads], [cheapest_of(load) for load in loads]
    answers = [one.label for one in cheapest_ones] + ["failed"] * (len(made.cells) - len(loads))

    def counted(of: str, count: int) -> Record:
        return {f"{of}_cells": count, f"{of}_percent": 100.0 * count / len(answers) if answers else 0.0}

    found: list[Record] = []
    for name in (name for name in THEORIES if any(name in one for one in cells)):
        used = [one[name].limit_used for one, answer in zip(cells, answers, strict=False) if answer == name]
        found.append(
            {
                "theory": name,
                **picked(THEORIES[name], "words cost"),
                **counted("cheapest", len(used)),
                "out_of_range_cells": sum(one.label == name and one.out_of_range for one in cheapest_ones),
                "largest_limit_used": max(used, default=None),
                **counted("holds", sum(name in one and one[name].verdict.answer == "HOLDS" for one in cells)),
            }
        )
    others = ("UNRESOLVED", "none", "failed")
    return found + [{"theory": name, **counted("cheapest", answers.count(name))} for name in others]


def cheapest_columns(column: str, found: Standing) -> Record:
    """Columns of the cheapest theory that holds: its name, whether it is in its own range, and why not."""
    made = found.made if found.answer == "HOLDS" else None
    status, notes = ("", ()) if made is None else (made.status, made.notes)
    return {column: found.label, f"{column}_status": status, f"{column}_reason": "; ".join(notes)}


def theory_words(name: str | None, status: str | None = "", reason: str | None = "") -> str:
    """A theory in words, or another answer, and that it is out of its own range, and why."""
    words = THEORIES[name].words if name and name in THEORIES else name or ""
    return f"{words}, {status}{reason and f': {reason}'}" if status == "out of range" else words


def theory_text(row: Mapping[str, Any]) -> str:
    """What a row says of the theory to take where Hertz does not hold in his range; empty elsewhere."""
    name = row.get("cheapest_theory")
    if name not in THEORIES or (name == HERTZ and row.get("cheapest_theory_status") != "out of range"):
        return ""
    off = (float(row[f"{name}_deviation_{short}_percent"]) for short in ("p_max", "area"))
    return (
        f"the cheapest theory that holds: {cheapest_words(row)} (p_max {next(off):+z.1f} %, area {next(off):+z.1f} %,"
        f" part of a limit {float(row[f'{name}_limit_used']):.2f})"
    )


def cheapest_words(row: Mapping[str, Any]) -> str:
    """The cheapest theory that holds in words."""
    return theory_words(*(row.get(f"cheapest_theory{of}") for of in ("", "_status", "_reason")))
