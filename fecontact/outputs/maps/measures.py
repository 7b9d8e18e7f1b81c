"""By what a map is told and drawn: a theory's pressure, Hertz's creep forces, or the cheapest theory."""

from __future__ import annotations

from typing import Literal, TypeAlias

from fecontact.case import Case
from fecontact.comparison.theories import HERTZ, THEORIES
from fecontact.errors import InputError
from fecontact.map.cells import ApplicabilityMap
from fecontact.outputs.maps.answer import theory_sentences, verdict_sentences
from fecontact.outputs.maps.cheapest import law_view, theory_view
from fecontact.outputs.maps.table import map_table
from fecontact.outputs.maps.verdicts import force_view, verdict_view
from fecontact.outputs.maps.view import MapView
from fecontact.outputs.records.theory_alone import check_theory

MapMeasure: TypeAlias = Literal["pressure", "force", "theory"]
"""By the measures of pressure and patch, by Hertz's creep force, or by the cheapest theory that holds."""


def refuse_measure(case: Case, measure: MapMeasure, theory: str = HERTZ) -> None:
    """Refuse forces of a map without friction, and a theory that there is not, or that the measure has no room for.

    Raises
    ------
    InputError
        With what to do.
    """
    if measure == "force" and not case.creep.asked:
        raise InputError(
            f"measure is {measure!r}, but the map has no friction coefficient; give one too, for example --friction 0.3"
            " (fecontact judge FOLDER takes it for a map that was made without, and solves nothing again)"
        )
    check_theory(theory)
    if measure != "pressure" and theory != HERTZ:
        raise InputError(
            f"theory is {theory!r}, but the measure is {measure!r}; leave one of them out: a theory is that of the"
            " measure pressure, and the measure theory has all of them"
        )


def map_view(made: ApplicabilityMap, measure: MapMeasure, theory: str = HERTZ) -> MapView:
    """A map by a measure; by that of pressure for a theory by its name."""
    if measure == "pressure":
        return verdict_view(made, theory)
    return force_view(made) if measure == "force" else theory_view(made)


def map_answer(made: ApplicabilityMap, measure: MapMeasure, theory: str = HERTZ) -> list[str]:
    """The answer of a map by a measure, in sentences."""
    view = map_view(made, measure, theory)
    if measure == "theory":
        return theory_sentences(view)
    name = THEORIES[theory].words if measure == "pressure" else "Hertz's creep force"
    return verdict_sentences(made, view, name, why=measure == "pressure" and theory == HERTZ)


def measure_table(made: ApplicabilityMap, measure: MapMeasure, *, theory: str = HERTZ, width: int | None = None) -> str:
    """A map as text, by a measure; by the cheapest theory also that of the laws of forces, where they were judged."""
    text = map_table(map_view(made, measure, theory), width=width)
    if measure != "theory" or not made.laws_judged:
        return text
    return f"{text}\n\n{map_table(law_view(made), width=width)}"
