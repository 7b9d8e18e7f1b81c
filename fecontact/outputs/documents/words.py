"""What reports say in words: the question, the answer, and what the terms mean."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from fecontact.comparison.ladder import RUNGS
from fecontact.comparison.theories import EITHER_SIDE, THEORIES
from fecontact.criteria import Criteria
from fecontact.outputs.words.measures import WORDS, criteria_text

Row = Mapping[str, Any]

GLOSSARY = (
    ("HOLDS, FAILS, UNRESOLVED", "Hertz holds where it is within every limit by more than the uncertainty, fails where"
     " it is beyond one by more than that, and is unresolved where a limit lies within the uncertainty."),
    ("Hertz", "The ellipse in closed form, with the curvatures at the first touch point of the rigid bodies, under the"
     " normal force that the finite elements carry."),
    ("FE", "Frictionless contact of two finite bodies with the true profiles, by finite elements; the pressure is read"
     " on nodes finer than the elements."),
    ("off by", "(Hertz - FE) / FE of a size; centre, valley, separate and misplaced are those of the finite elements,"
     " and zero for Hertz."),
    ("±", "Numerical uncertainty: change from mesh to mesh, separation of the bodies' compliance from the error of the"
     " elements, interpolation between nodes, truncation of the bodies, residuals, and, for profiles given by points,"
     " what changes on the other lines that these allow."),
    ("part of a limit", "The largest of all |off by| / limit: below 1 Hertz is within all limits."),
    ("ladder", "; ".join(f"{name.replace('_', ' ')}: {words}" for name, words in RUNGS.items()) +
     ". What changes from step to step is the shape of the gap, or the finite bodies."),
    ("junction", "A point of a profile at which its curvature jumps."),
    ("lobe", "A peak of the pressure beside another one, with a valley of 5 % and more between them."),
    ("L2, overlap", "Of both pressures the norm of their difference over that of FE; of both patches the area that they"
     " share over all that they cover."),
    ("springs", "Hertz's ellipses at all touch points, which share the load as springs side by side with their initial"
     " gaps: what vehicle codes with several contact points take; judged by the same measures and limits."),
    ("lateral shift", "Of the wheelset, positive towards the left rail."),
    ("roll of the wheelset", "That at which both wheels touch both rails; where it is fixed, one wheel stands alone."),
)  # fmt: skip
"""Terms of a report."""


def measure_terms() -> tuple[tuple[str, str], ...]:
    """Names of the measures and what they are."""
    return tuple(
        (f"{words.short}: {words.title}", f"{words.meaning[0].upper()}{words.meaning[1:]}.") for words in WORDS.values()
    )


def theory_terms(names: Iterable[str]) -> tuple[tuple[str, str], ...]:
    """Theories of the pressure: where each is from, what it takes for granted, and what it costs."""
    told = ((THEORIES[name].words, THEORIES[name]) for name in names if name not in EITHER_SIDE)
    return tuple((words, f"{of.source}. It takes for granted: {of.range}. Cost: {of.cost}.") for words, of in told)


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
    """Colour of the answer: that of HOLDS only where all hold."""
    if set(verdicts) == {"HOLDS"}:
        return "lead holds"
    return "lead fails" if "FAILS" in verdicts else "lead"
