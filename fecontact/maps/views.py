"""What a map shows, as a value that one table and one picture draw: verdicts, the cheapest theory, the answer."""

from __future__ import annotations

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.errors import InputError
from fecontact.feature_registry import offered
from fecontact.maps.model import ApplicabilityMap
from fecontact.maps.sentences import theory_sentences, verdict_sentences
from fecontact.maps.text_map import map_table
from fecontact.maps.theory_views import law_view, laws_judged, theory_view
from fecontact.maps.verdict_views import against, offered_view, verdict_view
from fecontact.maps.view import MapView
from fecontact.outputs.theory_alone import check_theory

# --- By what a map is told and drawn: a theory's pressure, the cheapest theory, or what features judge.


def refuse_measure(case: Case, measure: str, theory: str = HERTZ) -> None:
    """Refuse a measure that there is not, or that the case does not ask for, and a theory that it has no room for.

    Raises
    ------
    InputError
        With what to do.
    """
    found = offered("MAPS")
    if measure not in ("pressure", "theory", *found):
        raise InputError(f"measure is {measure!r}; allowed: {', '.join(('pressure', 'theory', *found))}")
    if measure in found and found[measure].criterion(case) is None:
        raise InputError(f"measure is {measure!r}, but {found[measure].missing}")
    check_theory(theory)
    if measure != "pressure" and theory != HERTZ:
        raise InputError(
            f"theory is {theory!r}, but the measure is {measure!r}; leave one of them out: a theory goes with the"
            " measure pressure, and the measure theory has all of them"
        )


def views_of(made: ApplicabilityMap, theory: str = HERTZ) -> dict[str, MapView]:
    """All pictures of a map by the ending of their file names, the cheapest theory after the verdicts."""
    verdicts = {"": verdict_view(made), **({} if theory == HERTZ else {theory: verdict_view(made, theory)})}
    verdicts |= {name: offered_view(made, name) for name, of in offered("MAPS").items() if of.criterion(made.case)}
    return (
        verdicts | {"theory": theory_view(made)} | {of: law_view(made, laws) for of, laws in laws_judged(made).items()}
    )


def map_view(made: ApplicabilityMap, measure: str, theory: str = HERTZ) -> MapView:
    """A map by a measure; with the measure `pressure` also for a theory."""
    if measure == "pressure":
        return verdict_view(made, theory)
    return theory_view(made) if measure == "theory" else offered_view(made, measure)


def map_answer(made: ApplicabilityMap, measure: str, theory: str = HERTZ) -> list[str]:
    """The answer of a map by a measure, in sentences."""
    view = map_view(made, measure, theory)
    if measure == "theory":
        return theory_sentences(view)
    name = THEORIES[theory].in_sentence if measure == "pressure" else offered("MAPS")[measure].name
    bodies = against(made, theory == HERTZ).removeprefix(", ") if measure == "pressure" else ""
    more = [f"Verdicts are {bodies}."] if bodies else []
    return verdict_sentences(made, view, name, why=measure == "pressure" and theory == HERTZ) + more


def map_text(made: ApplicabilityMap, measure: str, *, theory: str = HERTZ, width: int | None = None) -> str:
    """A map as text, by a measure; for the cheapest theory also the maps of laws that features judged."""
    views = [map_view(made, measure, theory)]
    views += [law_view(made, laws) for laws in laws_judged(made).values()] if measure == "theory" else []
    return "\n\n".join(map_table(view, width=width) for view in views)
