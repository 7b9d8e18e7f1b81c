"""What reports say in words: the question, the answer, and the meaning of terms."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from fecontact.contact_theories.registry import EITHER_SIDE, THEORIES
from fecontact.criteria import Criteria
from fecontact.feature_registry import offered
from fecontact.judging.ladder import RUNGS
from fecontact.outputs.words import TEXTS, WORDS, criteria_text

_RUNGS = "; ".join(f"{name.replace('_', ' ')}: {words}" for name, words in RUNGS.items())
GLOSSARY = tuple((term, meaning.format(rungs=_RUNGS)) for term, meaning in TEXTS["terms"].items())
"""Terms of a report."""


def measure_terms() -> tuple[tuple[str, str], ...]:
    """Names of the measures and what they are."""
    return tuple(
        (f"{words.short}: {words.title}", f"{words.meaning[0].upper()}{words.meaning[1:]}.") for words in WORDS.values()
    )


def theory_terms(names: Iterable[str], *, laws: bool) -> Iterator[tuple[str, str]]:
    """Theories of the pressure, and the laws of features: their source, what they take for granted, and their cost."""
    wanted = {*names} - {*EITHER_SIDE}
    told: list[Mapping[str, Any]] = [vars(theory) for name, theory in THEORIES.items() if name in wanted]
    if laws:
        told += [law for found in offered("LAWS").values() for law in found.laws.values()]
    for one in told:
        yield one["words"], "{source}. It takes for granted: {range}. Cost: {cost}.".format_map(one)


def question(pair: str, criteria: Criteria | None, roll: str = "") -> str:
    """What a study or map asks, and how the wheels are rolled."""
    by = (
        f" Judged by: {criteria_text(criteria)} (what that is: see Terms)."
        if criteria
        else " Each case has its own criteria."
    )
    rolled = f" {roll[0].upper()}{roll[1:]}." if roll else ""
    return f"May Hertz's ellipse stand for the contact of {pair}?{by}{rolled}"


def answer_words(verdicts: Sequence[str], what: str) -> str:
    """How many hold, fail, and are open or lost, such as "Hertz holds in 4 of 9 cases, fails in 5"."""
    count = {one: verdicts.count(one) for one in ("HOLDS", "FAILS", "UNRESOLVED")}
    lost = len(verdicts) - sum(count.values())
    more = [f"is open in {count['UNRESOLVED']}"] if count["UNRESOLVED"] else []
    more += [f"{lost} could not be used"] if lost else []
    return f"Hertz holds in {count['HOLDS']} of {len(verdicts)} {what}, fails in {count['FAILS']}" + "".join(
        f", {one}" for one in more
    )


def lead_style(verdicts: Sequence[str]) -> str:
    """Colour of the answer: the colour of HOLDS only if all hold."""
    if set(verdicts) == {"HOLDS"}:
        return "lead holds"
    return "lead fails" if "FAILS" in verdicts else "lead"
