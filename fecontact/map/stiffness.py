"""The contact stiffness at one position of a map, from all its loads that may be used."""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.map.cells import MapCell
from fecontact.solving.stiffness_fit import Stiffness, fit_stiffness

# Two loads would be met exactly, which says nothing about the fit's error.
_FEWEST_LOADS = 3


def stiffness_of(cells: Sequence[MapCell]) -> Stiffness | None:
    """The fit over the loads of a position; None for fewer than three."""
    loads = [cell.usable for cell in cells if cell.usable]
    return None if len(loads) < _FEWEST_LOADS else fit_stiffness(loads)
