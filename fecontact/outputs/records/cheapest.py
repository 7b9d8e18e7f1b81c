"""The judged theories of a load, and the cheapest that holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fecontact.contact_theories.registry import EITHER_SIDE, HERTZ, THEORIES
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.verdict import Judgement, Standing, cheapest, standings
from fecontact.outputs.flat_records import Record
from fecontact.outputs.verdict_words import theory_words


def other_theories(load: JudgedLoad) -> dict[str, Judgement]:
    """The judged theories besides Hertz's ellipse at the first touch point."""
    return {name: one for name, one in load.judgements.items() if name not in EITHER_SIDE}


def theories_of(load: JudgedLoad) -> dict[str, Judgement]:
    """Every judged theory against elastic bodies; Hertz with numbers and verdict of the side that decides."""
    return {HERTZ: load.deciding} | other_theories(load)


def cheapest_of(load: JudgedLoad) -> Standing:
    """The cheapest theory of the pressure that holds."""
    return cheapest(standings(theories_of(load)), in_range=load.case.criteria.theories_in_range)


def cheapest_columns(column: str, found: Standing) -> Record:
    """Columns of the cheapest theory that holds: its name, whether it is in its own range, and why not."""
    made = found.made if found.answer == "HOLDS" else None
    status, notes = ("", ()) if made is None else (made.status, made.notes)
    return {column: found.label, f"{column}_status": status, f"{column}_reason": "; ".join(notes)}


def theory_text(row: Mapping[str, Any]) -> str:
    """What a row says of the theory to take where Hertz does not hold in its range; empty elsewhere."""
    name = row.get("cheapest_theory")
    if name not in THEORIES or (name == HERTZ and row.get("cheapest_theory_status") != "out of range"):
        return ""
    off = (float(row[f"{name}_deviation_{short}_percent"]) for short in ("p_max", "area"))
    return (
        f"the cheapest theory that holds: {cheapest_words(row)} (p_max {next(off):+z.1f} %, area {next(off):+z.1f} %,"
        f" share of the limit {float(row[f'{name}_limit_used']):.2f})"
    )


def cheapest_words(row: Mapping[str, Any]) -> str:
    """The cheapest theory that holds in words."""
    return theory_words(*(row.get(f"cheapest_theory{of}") for of in ("", "_status", "_reason")))
