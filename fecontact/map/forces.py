"""At which loads Hertz holds for creep forces at one position of a map: from the loads that were solved, no others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from fecontact.comparison.creep_verdict import force_verdict
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judging import with_creep_laws
from fecontact.comparison.verdict import Answer
from fecontact.geometry.placement import Placement
from fecontact.map.cells import LoadLimit, MapCell, MapPosition
from fecontact.map.load_limit import intervals_of


def force_limit(
    cells: Sequence[MapCell], tried: Sequence[JudgedLoad], placement: Placement, limit: LoadLimit
) -> LoadLimit | None:
    """At which loads of a position Hertz holds for forces; None without friction.

    Loads that the search for the limits of pressure tried tell more only between loads of the map that differ.
    """
    usable = [cell.usable for cell in cells if cell.usable]
    found = {load.load_N: load.creep.verdict.verdict.answer for load in usable if load.creep is not None}
    if not found and not any(cell.judged is not None and cell.judged.creep is not None for cell in cells):
        return None
    between = _between(found, tried, placement)
    known = sorted((found | between).items())
    return LoadLimit(
        intervals=intervals_of(known),
        reason=None if known else limit.reason,
        note=limit.note,
        tried=tuple(between.items()),
    )


def _between(found: Mapping[float, Answer], tried: Sequence[JudgedLoad], placement: Placement) -> dict[float, Answer]:
    """Answers at the loads of the search that lie between loads of the map whose answers differ."""
    changes = [(low, high) for low, high in pairwise(found) if found[low] != found[high]]
    return {
        one.load_N: force_verdict(one.solved, one.hertz, placement, one.case.creep).verdict.answer
        for one in tried
        if one.usable and any(low < one.load_N < high for low, high in changes)
    }


def with_laws(position: MapPosition) -> MapPosition:
    """A position with the laws of creep forces judged at each load that may be used, which takes seconds a load."""
    if position.placement is None:
        return position
    return replace(position, cells=tuple(_with_laws(cell, position.placement) for cell in position.cells))


def _with_laws(cell: MapCell, placement: Placement) -> MapCell:
    return replace(cell, judged=with_creep_laws(cell.usable, placement)) if cell.usable else cell
