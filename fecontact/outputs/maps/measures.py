"""By what a map is told and drawn: the measures of pressure, creep forces, or the cheapest creep theory."""

from __future__ import annotations

from typing import Literal, TypeAlias

from fecontact.case import Case
from fecontact.comparison.theories import HERTZ, THEORIES
from fecontact.errors import InputError
from fecontact.map.cells import ApplicabilityMap
from fecontact.outputs.maps.cheapest import law_view, theory_view
from fecontact.outputs.maps.table import map_table
from fecontact.outputs.maps.verdicts import force_view, verdict_view
from fecontact.outputs.maps.view import MapView

MapMeasure: TypeAlias = Literal["pressure", "force", "theory"]
"""By the measures of pressure and patch, by Hertz's creep force, or by the cheapest creep theory that holds."""
CHEAPEST = "cheapest"
"""In place of a theory's name: at each load the cheapest one that holds."""


def refuse_measure(case: Case, measure: MapMeasure, theory: str = HERTZ) -> None:
    """Refuse a measure that a map without friction does not have, and a theory that there is not.

    Raises
    ------
    InputError
        With what to do.
    """
    if measure != "pressure" and not case.creep.asked:
        raise InputError(
            f"measure is {measure!r}, but the map has no friction coefficient; give one too, for example --friction 0.3"
            " (fecontact judge FOLDER takes it for a map that was made without, and solves nothing again)"
        )
    if theory not in (*THEORIES, CHEAPEST):
        raise InputError(f"theory is {theory!r}; allowed: {', '.join((*THEORIES, CHEAPEST))}")
    if measure != "pressure" and theory != HERTZ:
        raise InputError(f"theory is {theory!r}, but the measure is {measure!r}; theories are of the measure pressure")


def map_view(made: ApplicabilityMap, measure: MapMeasure, theory: str = HERTZ) -> MapView:
    """A map by a measure; by that of pressure for a theory by its name, or for the cheapest that holds."""
    if measure == "pressure":
        return theory_view(made) if theory == CHEAPEST else verdict_view(made, theory)
    return force_view(made) if measure == "force" else law_view(made)


def measure_table(made: ApplicabilityMap, measure: MapMeasure, *, theory: str = HERTZ, width: int | None = None) -> str:
    """A map as text, by a measure."""
    return map_table(map_view(made, measure, theory), width=width)
