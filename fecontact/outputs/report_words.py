"""Words of reports: the question, the answer, and the meaning of terms."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from fecontact.contact_theories.registry import HERTZ_OF_EACH_SIDE, THEORIES
from fecontact.criteria import Criteria
from fecontact.feature_registry import load_offers
from fecontact.judging.ladder import RUNGS
from fecontact.outputs.words import MEASURE_WORDS, TEXTS, criteria_text

_RUNGS = "; ".join(f"{name.replace('_', ' ')}: {words}" for name, words in RUNGS.items())
GLOSSARY = tuple((term, meaning.format(rungs=_RUNGS)) for term, meaning in TEXTS["terms"].items())
"""Terms of a report."""


def measure_terms() -> tuple[tuple[str, str], ...]:
    """Names of the measures with their meanings."""
    return tuple(
        (f"{words.short}: {words.title}", f"{words.meaning[0].upper()}{words.meaning[1:]}.")
        for words in MEASURE_WORDS.values()
    )


def theory_terms(names: Iterable[str], *, laws: bool) -> Iterator[tuple[str, str]]:
    """Terms for theories of the pressure and for laws of features.

    Parameters
    ----------
    names
        Names of theories of the pressure.
    laws
        Whether the laws of features are included.

    Returns
    -------
    Iterator of (str, str)
        Words of each theory or law, with its source, its range of validity and its cost.
    """
    shown_names = {*names} - {*HERTZ_OF_EACH_SIDE}
    descriptions: list[Mapping[str, Any]] = [vars(theory) for name, theory in THEORIES.items() if name in shown_names]
    if laws:
        descriptions += [
            law for laws_of_feature in load_offers("LAWS").values() for law in laws_of_feature.laws.values()
        ]
    for description in descriptions:
        yield description["words"], "{source}. Range: {range}. Cost: {cost}.".format_map(description)


def question_text(pair: str, criteria: Criteria | None, roll: str = "") -> str:
    """Question of a study or map, with the criteria and the roll of the wheels.

    Parameters
    ----------
    pair
        Words for rail and wheel.
    criteria
        Common criteria; None if each case has separate criteria.
    roll
        Words for the roll; empty if there are none.

    Returns
    -------
    str
        The question in one paragraph.
    """
    criteria_part = (
        f" Limits: {criteria_text(criteria)} (see Terms)." if criteria else " The criteria differ from case to case."
    )
    roll_part = f" {roll[0].upper()}{roll[1:]}." if roll else ""
    return f"Can Hertz's ellipse replace the contact of {pair}?{criteria_part}{roll_part}"


def answer_words(verdicts: Sequence[str], noun: str) -> str:
    """Numbers of verdicts in words, such as "Hertz holds in 4 of 9 cases".

    The numbers of failing, unresolved and unusable cases follow.

    Parameters
    ----------
    verdicts
        Verdicts. Other texts than HOLDS, FAILS and UNRESOLVED count as unusable.
    noun
        Plural noun for the judged objects, such as "cases".

    Returns
    -------
    str
        The sentence without a full stop.

    Examples
    --------
    >>> from fecontact.outputs.report_words import answer_words
    >>> answer_words(["HOLDS", "FAILS", "FAILS"], "cases")
    'Hertz holds in 1 of 3 cases, fails in 2'
    """
    count = {answer: verdicts.count(answer) for answer in ("HOLDS", "FAILS", "UNRESOLVED")}
    lost = len(verdicts) - sum(count.values())
    statements = [f"is unresolved in {count['UNRESOLVED']}"] if count["UNRESOLVED"] else []
    statements += [f"{lost} could not be used"] if lost else []
    return f"Hertz holds in {count['HOLDS']} of {len(verdicts)} {noun}, fails in {count['FAILS']}" + "".join(
        f", {clause}" for clause in statements
    )


def lead_style(verdicts: Sequence[str]) -> str:
    """Style of the answer; it has the colour of HOLDS only if all hold.

    Parameters
    ----------
    verdicts
        Verdicts of all cases.

    Returns
    -------
    str
        `lead holds`, `lead fails`, or `lead` if cases are unresolved and no case fails.
    """
    if set(verdicts) == {"HOLDS"}:
        return "lead holds"
    return "lead fails" if "FAILS" in verdicts else "lead"
