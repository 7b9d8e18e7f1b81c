"""By what a map is told and drawn: the measures of pressure, creep forces, or the cheapest creep theory."""

from __future__ import annotations

from typing import Literal, TypeAlias

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.map.cells import ApplicabilityMap
from fecontact.outputs.force_map import force_table
from fecontact.outputs.map_table import map_table
from fecontact.outputs.theory_map import theory_table

MapMeasure: TypeAlias = Literal["pressure", "force", "theory"]
"""By the measures of pressure and patch, by Hertz's creep force, or by the cheapest creep theory that holds."""


def refuse_measure(case: Case, measure: MapMeasure) -> None:
    """Refuse a measure that a map without friction does not have.

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


def measure_table(made: ApplicabilityMap, measure: MapMeasure, *, width: int | None = None) -> str:
    """A map as text, by a measure."""
    tables = {"pressure": map_table, "force": force_table, "theory": theory_table}
    return tables[measure](made, width=width)
