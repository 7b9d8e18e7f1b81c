"""At which loads Hertz holds for creep forces at one position of a map: from the loads that were solved, no others."""

from __future__ import annotations

from itertools import pairwise
from weakref import WeakKeyDictionary

from fecontact.comparison.creep_comparison import creep_of
from fecontact.comparison.creep_verdict import ForceVerdict, force_verdict
from fecontact.comparison.verdict import Answer
from fecontact.map.cells import LoadInterval, LoadLimit, MapCell, MapPosition
from fecontact.map.load_limit import stretches

_INFERRED = "inferred without a pressure of its own, so that it has no forces"
# a map is told as tables, records and pictures, while it is made again and again
_LIMITS: WeakKeyDictionary[MapPosition, LoadLimit] = WeakKeyDictionary()


def force_of_cell(cell: MapCell, position: MapPosition) -> ForceVerdict | None:
    """Verdict of forces of a cell; None without friction, and of one that was not solved."""
    if cell.judged is None or position.placement is None:
        return None
    found = creep_of(cell.judged, position.placement)
    return None if found is None else found.verdict


def force_limit(position: MapPosition) -> LoadLimit:
    """At which loads of a position Hertz holds for forces.

    Those that the search for the limits of pressure solved tell more only between loads of the map that differ.
    """
    if position not in _LIMITS:
        _LIMITS[position] = _force_limit(position)
    return _LIMITS[position]


def know_force_limit(position: MapPosition, limit: LoadLimit) -> None:
    """Take what another process has evaluated."""
    _LIMITS[position] = limit


def _force_limit(position: MapPosition) -> LoadLimit:
    found = {
        cell.load_N: force.answer
        for cell in position.cells
        if cell.status == "converged" and (force := force_of_cell(cell, position)) is not None
    }
    tried = _between(found, position)
    known = sorted((found | tried).items())
    return LoadLimit(
        intervals=tuple(
            LoadInterval(low_N=low_N, high_N=high_N, answer=answer)
            for low_N, high_N, answer in stretches(known, "UNRESOLVED")
        ),
        reason=None if known else _without_any(position),
        note=position.limit.note,
        tried=tuple(tried.items()),
    )


def _between(found: dict[float, Answer], position: MapPosition) -> dict[float, Answer]:
    """Answers at the loads of the search that lie between loads of the map whose answers differ."""
    changes = [(low, high) for low, high in pairwise(found) if found[low] != found[high]]
    return {
        one.load_N: force_verdict(one, position.placement, one.case.creep).answer
        for one in position.tried
        if position.placement is not None
        and one.status == "converged"
        and any(low < one.load_N < high for low, high in changes)
    }


def _without_any(position: MapPosition) -> str | None:
    return _INFERRED if any(cell.inferred for cell in position.cells) else position.limit.reason
