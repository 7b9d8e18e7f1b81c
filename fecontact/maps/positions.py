"""One position of a map: solved under all loads with its factors reused, its limits and its contact stiffness."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence, Sized
from contextlib import closing
from dataclasses import replace
from itertools import pairwise
from typing import TypeAlias

from fecontact.case import Case
from fecontact.errors import FecontactError, NotEnoughMemory, failed
from fecontact.feature_registry import offered
from fecontact.judging.judge import with_readings
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.readings import MappedVerdicts
from fecontact.maps.load_limits import intervals_of, known_loads, load_limit, next_load
from fecontact.maps.model import LoadLimit, MapCell, MapPosition
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.solve import LoadSweep, Stiffness, fit_stiffness


def limits_of(
    cells: Sequence[MapCell], tried: Sequence[JudgedLoad], placement: Placement, limit: LoadLimit
) -> dict[str, LoadLimit]:
    """At which loads of a position Hertz holds by each verdict of features that its loads have.

    Loads that the search for the limits of pressure tried tell more only between loads of the map that differ.
    """
    judged = [cell.judged for cell in cells if cell.judged is not None]
    return {
        name: _limit_by(of, cells, tried, placement, limit)
        for name, of in offered("MAPS").items()
        if any(map(of.read, judged))
    }


def _limit_by(
    of: MappedVerdicts,
    cells: Sequence[MapCell],
    tried: Sequence[JudgedLoad],
    placement: Placement,
    limit: LoadLimit,
) -> LoadLimit:
    read = [(cell.load_N, of.read(cell.usable)) for cell in cells if cell.usable]
    found = {load_N: one.verdict.answer for load_N, one in read if one is not None}
    changes = [(low, high) for low, high in pairwise(found) if found[low] != found[high]]
    between = {
        one.load_N: of.judge(one, placement).verdict.answer
        for one in tried
        if one.usable and any(low < one.load_N < high for low, high in changes)
    }
    known = sorted((found | between).items())
    return LoadLimit(
        intervals=intervals_of(known),
        reason=None if known else limit.reason,
        note=limit.note,
        tried=tuple(between.items()),
    )


def with_dear_readings(position: MapPosition) -> MapPosition:
    """A position with what features read in seconds a load, at each load that may be used."""
    if (placement := position.placement) is None:
        return position
    cells = (
        replace(cell, judged=with_readings(cell.usable, placement, "DEAR_READINGS")) if cell.usable else cell
        for cell in position.cells
    )
    return replace(position, cells=tuple(cells))


# Two loads would be met exactly, which says nothing about the fit's error.
_FEWEST_LOADS = 3


def stiffness_of(cells: Sequence[MapCell]) -> Stiffness | None:
    """The fit over the loads of a position; None for fewer than three."""
    loads = [cell.usable for cell in cells if cell.usable]
    return None if len(loads) < _FEWEST_LOADS else fit_stiffness(loads)


Tell: TypeAlias = Callable[[float, str], None]
"""Hears which part of a job is done, and what is under way."""


def solve_position(case: Case, loads_N: Sequence[float], tell: Tell = lambda part, words: None) -> MapPosition:
    """Solve all loads (N, increasing) at the position of a case, and find its load limit.

    A position or a load that cannot be solved is not an error but cells whose status says why. `tell` hears before each
    load which part is done, if no limit takes more loads than so far, and how many loads.
    """
    shift = case.lateral_shift_mm
    try:
        sweep = LoadSweep(case, loads_N)
    except FecontactError as error:
        return failed_position(shift, loads_N, error)
    found: dict[float, MapCell] = {}
    tried: list[JudgedLoad] = []
    stopped: MapCell | None = None
    # the largest load first: its meshes serve the smaller ones
    waiting = list(loads_N)
    with closing(sweep):
        while waiting:
            load_N = waiting.pop()
            tell(*_part(found, loads_N, tried))
            found[load_N] = _cell(sweep, shift, load_N)
            # the limits among these loads while their meshes are there
            if not (waiting and sweep.is_ready_for(waiting[-1])):
                stopped = stopped or _search(sweep, shift, found, tried, lambda: tell(*_part(found, loads_N, tried)))
    return mapped_position(shift, map(found.__getitem__, loads_N), tried, sweep.placement, stopped=stopped)


def mapped_position(
    shift_mm: float,
    cells: Iterable[MapCell],
    tried: Sequence[JudgedLoad],
    placement: Placement,
    *,
    stopped: MapCell | None,
) -> MapPosition:
    """A position from its loads and those that the search for its limits tried; `stopped` as in `load_limit`."""
    own = tuple(cells)
    limit = load_limit(own, tried, stopped=stopped)
    return MapPosition(
        lateral_shift_mm=shift_mm,
        cells=own,
        limit=limit,
        limits_of=limits_of(own, tried, placement, limit),
        placement=placement,
        stiffness=stiffness_of(own),
        tried=tuple(tried),
        stopped=stopped,
    )


def _part(cells: Sized, loads_N: Sized, tried: Sized) -> tuple[float, str]:
    """Which part of a position is done, and the loads of it in words."""
    words = f"{len(cells)} of {len(loads_N)} loads" + (f", {len(tried)} more for limits" if tried else "")
    return (len(cells) + len(tried)) / (len(loads_N) + len(tried) + 1), words


def _search(
    sweep: LoadSweep,
    shift: float,
    cells: Mapping[float, MapCell],
    tried: list[JudgedLoad],
    begin: Callable[[], None] = lambda: None,
) -> MapCell | None:
    """Solve further loads until every change of the verdict is known well; the load that stopped it, if one did."""

    def wanted_N() -> float | None:
        lost = [one.load_N for one in tried if not one.usable]
        return next_load(known_loads(tuple(cells.values()), tried), tuple(cells), lost)

    while (wanted := wanted_N()) is not None:
        begin()
        try:
            # beside a limit every verdict is open: finer meshes would only bring the ends of the range together
            tried.append(sweep.solve(wanted, refine=False))
        except FecontactError as error:
            return _failed_cell(shift, wanted, error)
    return None


def _cell(sweep: LoadSweep, shift: float, load_N: float) -> MapCell:
    try:
        judged = sweep.solve(load_N)
    except FecontactError as error:
        return _failed_cell(shift, load_N, error)
    return solved_cell(shift, judged)


def solved_cell(shift_mm: float, judged: JudgedLoad) -> MapCell:
    """Cell of a load that was solved."""
    return MapCell(lateral_shift_mm=shift_mm, load_N=judged.load_N, status=judged.status, judged=judged)


def _failed_cell(shift: float, load_N: float, error: Exception | str) -> MapCell:
    short = isinstance(error, NotEnoughMemory)
    return MapCell(lateral_shift_mm=shift, load_N=load_N, status=failed(error), short_of_memory=short)


def failed_position(shift_mm: float, loads_N: Sequence[float], error: Exception | str) -> MapPosition:
    """A position of which nothing is known but why."""
    cells = tuple(_failed_cell(shift_mm, load_N, error) for load_N in loads_N)
    return MapPosition(lateral_shift_mm=shift_mm, cells=cells, limit=LoadLimit(reason=failed(error)))
