"""Positions of a map: solved under all loads, with load limits and contact stiffness.

The factors of the stiffness matrices are reused for all loads of a position.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence, Sized
from contextlib import closing
from dataclasses import replace
from itertools import pairwise
from typing import TypeAlias

from fecontact.case import Case
from fecontact.errors import FecontactError, MemoryShortageError, describe_failure
from fecontact.inputs.texts import count_text
from fecontact.judging.judge import add_readings
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.readings import VerdictReadingView
from fecontact.maps.load_limits import choose_next_load, find_intervals, find_load_limit, list_usable_loads
from fecontact.maps.measure_views import list_verdict_measures
from fecontact.maps.model import LoadLimit, MapCell, MapPosition
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.solve import LoadSweep, Stiffness, fit_stiffness


def find_feature_limits(
    cells: Sequence[MapCell], tried: Sequence[JudgedLoad], placement: Placement, limit: LoadLimit
) -> dict[str, LoadLimit]:
    """Loads at which Hertz holds by each verdict of features and of a user's criteria.

    Loads of the search for pressure limits add information only between loads of the map with different verdicts.

    Parameters
    ----------
    cells
        Cells of the map's loads, by increasing load.
    tried
        Loads of the search for pressure limits.
    placement
        Placement of the position.
    limit
        Load limit by the pressure.

    Returns
    -------
    dict of LoadLimit
        Load limit by the measure of the map, for the verdicts that a load has.
    """
    judged_loads = [cell.judged for cell in cells if cell.judged is not None]
    return {
        name: _find_feature_limit(verdicts, cells, tried, placement, limit)
        for name, verdicts in (list_verdict_measures(judged_loads[0].case) if judged_loads else {}).items()
        if any(map(verdicts.read, judged_loads))
    }


def _find_feature_limit(
    verdicts: VerdictReadingView,
    cells: Sequence[MapCell],
    further_loads: Sequence[JudgedLoad],
    placement: Placement,
    limit: LoadLimit,
) -> LoadLimit:
    """Loads at which Hertz holds by a verdict of a feature.

    Parameters
    ----------
    verdicts
        Readings and verdicts of the feature.
    cells
        Cells of the position in ascending order of the load.
    further_loads
        Loads between the cells that were solved for the limit of the pressure; used where the answer changes.
    placement
        Wheel on rail.
    limit
        Limit of the pressure at the position.

    Returns
    -------
    LoadLimit
        Intervals of loads in N.
    """
    judgements = [(cell.load_N, verdicts.read(cell.usable)) for cell in cells if cell.usable]
    answers = {load_N: judgement.verdict.answer for load_N, judgement in judgements if judgement is not None}
    changes = [(low, high) for low, high in pairwise(answers) if answers[low] != answers[high]]
    answers_between = {
        load.load_N: verdicts.judge(load, placement).verdict.answer
        for load in further_loads
        if load.usable and any(low < load.load_N < high for low, high in changes)
    }
    answers_by_load = sorted((answers | answers_between).items())
    return LoadLimit(
        intervals=find_intervals(answers_by_load),
        reason=None if answers_by_load else limit.reason,
        note=limit.note,
        tried=tuple(answers_between.items()),
    )


def add_slow_readings(position: MapPosition) -> MapPosition:
    """Copy of a position with the slow readings of features at each usable load.

    These readings take seconds per load.

    Parameters
    ----------
    position
        Position of a map.

    Returns
    -------
    MapPosition
        Position with readings; unchanged without a placement.
    """
    if (placement := position.placement) is None:
        return position
    cells = (
        replace(cell, judged=add_readings(cell.usable, placement, "DEAR_READINGS")) if cell.usable else cell
        for cell in position.cells
    )
    return replace(position, cells=tuple(cells))


# Least number of loads for a fit. A fit through two loads is exact, which says nothing about its error.
_FEWEST_LOADS = 3


def fit_position_stiffness(cells: Sequence[MapCell]) -> Stiffness | None:
    """Contact stiffness of a position from its usable loads; None for fewer than three loads.

    Parameters
    ----------
    cells
        Cells of a position.

    Returns
    -------
    Stiffness or None
        The fitted stiffness.
    """
    loads = [cell.usable for cell in cells if cell.usable]
    return None if len(loads) < _FEWEST_LOADS else fit_stiffness(loads)


ProgressReport: TypeAlias = Callable[[float, str], None]
"""Function that receives the finished fraction of a job and a text on its progress."""


def solve_position(
    case: Case, loads_N: Sequence[float], tell: ProgressReport = lambda fraction, words: None
) -> MapPosition:
    """Solve all loads at a position, and find its load limit.

    A position or a load that cannot be solved is not an error: the status of its cells has the reason.

    Parameters
    ----------
    case
        Case at the position.
    loads_N
        Loads in N, increasing.
    tell
        Function that receives, before each load, the finished fraction (assuming that no limit takes further loads) and
        the number of loads as a text.

    Returns
    -------
    MapPosition
        Position with its cells, load limits and stiffness.
    """
    shift = case.lateral_shift_mm
    try:
        sweep = LoadSweep(case, loads_N)
    except FecontactError as error:
        return build_failed_position(shift, loads_N, error)
    cells: dict[float, MapCell] = {}
    tried: list[JudgedLoad] = []
    stopped: MapCell | None = None
    # The largest load is solved first because its meshes serve the smaller loads.
    waiting = list(loads_N)
    with closing(sweep):
        while waiting:
            load_N = waiting.pop()
            tell(*_describe_progress(cells, loads_N, tried))
            cells[load_N] = _solve_cell(sweep, shift, load_N)
            # The limits between these loads are searched while their meshes are in memory.
            if not (waiting and sweep.is_ready_for(waiting[-1])):
                stopped = stopped or _solve_for_limits(
                    sweep, shift, cells, tried, lambda: tell(*_describe_progress(cells, loads_N, tried))
                )
    return build_position(shift, map(cells.__getitem__, loads_N), tried, sweep.placement, stopped=stopped)


def build_position(
    shift_mm: float,
    solved_cells: Iterable[MapCell],
    tried: Sequence[JudgedLoad],
    placement: Placement,
    *,
    stopped: MapCell | None,
) -> MapPosition:
    """Position from its cells and the loads of the search for limits.

    Parameters
    ----------
    shift_mm
        Lateral shift in mm.
    solved_cells
        Cells of the map's loads, by increasing load.
    tried
        Loads of the search for load limits.
    placement
        Placement of the position.
    stopped
        Further load that could not be solved.

    Returns
    -------
    MapPosition
        Position with load limits and stiffness.
    """
    map_cells = tuple(solved_cells)
    limit = find_load_limit(map_cells, tried, stopped=stopped)
    return MapPosition(
        lateral_shift_mm=shift_mm,
        cells=map_cells,
        limit=limit,
        limits_of=find_feature_limits(map_cells, tried, placement, limit),
        placement=placement,
        stiffness=fit_position_stiffness(map_cells),
        tried=tuple(tried),
        stopped=stopped,
    )


def _describe_progress(cells: Sized, loads_N: Sized, tried: Sized) -> tuple[float, str]:
    """Finished fraction of a position, and its number of loads as a text."""
    words = f"{len(cells)} of {count_text(len(loads_N), 'load')}" + (f", {len(tried)} more for limits" if tried else "")
    return (len(cells) + len(tried)) / (len(loads_N) + len(tried) + 1), words


def _solve_for_limits(
    sweep: LoadSweep,
    shift: float,
    cells: Mapping[float, MapCell],
    tried: list[JudgedLoad],
    begin: Callable[[], None] = lambda: None,
) -> MapCell | None:
    """Solve further loads until every change of the verdict is enclosed within the tolerance.

    Parameters
    ----------
    sweep
        Solver of the position.
    shift
        Lateral shift in mm.
    cells
        Cells by load in N.
    tried
        Loads of the search, to which new loads are appended.
    begin
        Function called before each load.

    Returns
    -------
    MapCell or None
        Cell of the load that could not be solved, if any.
    """

    def choose_load_N() -> float | None:
        unusable_N = [load.load_N for load in tried if not load.usable]
        return choose_next_load(list_usable_loads(tuple(cells.values()), tried), tuple(cells), unusable_N)

    while (load_N := choose_load_N()) is not None:
        begin()
        try:
            # Near a limit every verdict is unresolved: finer meshes would only narrow the unresolved range.
            tried.append(sweep.solve(load_N, refine=False))
        except FecontactError as error:
            return _build_failed_cell(shift, load_N, error)
    return None


def _solve_cell(sweep: LoadSweep, shift: float, load_N: float) -> MapCell:
    """Cell of a load, solved or failed."""
    try:
        judged_load = sweep.solve(load_N)
    except FecontactError as error:
        return _build_failed_cell(shift, load_N, error)
    return build_solved_cell(shift, judged_load)


def build_solved_cell(shift_mm: float, judged_load: JudgedLoad) -> MapCell:
    """Cell of a solved load."""
    return MapCell(lateral_shift_mm=shift_mm, load_N=judged_load.load_N, status=judged_load.status, judged=judged_load)


def _build_failed_cell(shift: float, load_N: float, error: Exception | str) -> MapCell:
    is_short = isinstance(error, MemoryShortageError)
    return MapCell(lateral_shift_mm=shift, load_N=load_N, status=describe_failure(error), short_of_memory=is_short)


def build_failed_position(shift_mm: float, loads_N: Sequence[float], error: Exception | str) -> MapPosition:
    """Position that could not be solved, with the reason in every cell.

    Parameters
    ----------
    shift_mm
        Lateral shift in mm.
    loads_N
        Loads of the cells in N.
    error
        Reason of the failure.

    Returns
    -------
    MapPosition
        Position with failed cells and without a load limit.
    """
    cells = tuple(_build_failed_cell(shift_mm, load_N, error) for load_N in loads_N)
    return MapPosition(lateral_shift_mm=shift_mm, cells=cells, limit=LoadLimit(reason=describe_failure(error)))
