"""Positions of a map in their folders: solved by a worker, kept, and read back for a new verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError, is_usable_status
from fecontact.jobs.store import write_job_progress
from fecontact.jobs.workers import WorkResult
from fecontact.maps.model import LoadLimit, MapCell, MapPosition
from fecontact.maps.positions import add_slow_readings, build_position, build_solved_cell, solve_position
from fecontact.outputs.flat_records import select_attributes
from fecontact.runs.store import (
    StoredPosition,
    copy_solved,
    judge_again,
    keep_loads,
    read_solution,
    read_stored,
    refuse_changed_profiles,
)


def name_position_folder(out: Path, name: str) -> Path:
    """Folder of a finished position; different inputs or loads have different folders."""
    return out / "positions" / name


@dataclass(frozen=True, kw_only=True)
class PositionWork:
    """Work on a position under several increasing loads: solve it and keep it.

    Attributes
    ----------
    case
        Case of the position.
    name
        Id of the position.
    loads_N
        Loads in N, increasing.
    dear, pictured
        As in `read_pictured_position`.
    """

    case: Case
    name: str
    loads_N: tuple[float, ...]
    dear: bool = False
    pictured: bool = False

    def __call__(self, folder: Path, finished: Path | None) -> WorkResult:
        """Solve the position, or copy the finished folder.

        The folder is copied if a new solution would not have more data.
        """
        stored_position = None if finished is None else judge_again(read_position, finished, self.case)
        if finished is not None and stored_position is not None and stored_position.limit.narrowed:
            copy_solved(finished, folder, self.case, stored_position)
            return WorkResult()
        position = solve_position(self.case, self.loads_N, partial(write_job_progress, folder, self.name))
        keep_position(position, self.case, folder)
        refuse_changed_profiles(self.case, self.name, self.loads_N)
        position_with_pictures = _draw_position(position, dear=self.dear, pictured=self.pictured)
        return WorkResult(short_of_memory=position.short_of_memory, value=position_with_pictures)


def keep_position(position: MapPosition, case: Case, folder: Path) -> None:
    """Write all data from which a position can be judged again.

    Parameters
    ----------
    position
        Solved position.
    case
        Its case.
    folder
        Folder for the files.
    """
    cells = [_cell_record(cell) for cell in position.cells]
    stopped_record = None if position.stopped is None else _cell_record(position.stopped)
    entries = {"cells": cells, "tried": len(position.tried), "stopped": stopped_record, "reason": position.limit.reason}
    keep_loads(position, case, folder, **entries)


def _cell_record(cell: MapCell) -> dict[str, Any]:
    return select_attributes(cell, "load_N status short_of_memory")


def read_position(
    folder: str | Path, *, criteria: Criteria | None = None, creep: Creep | None = None, dear: bool = False
) -> MapPosition:
    """Read a finished position and judge it.

    Parameters
    ----------
    folder
        Folder of the position.
    criteria, creep
        Criteria, and friction with creepages; those of the stored case if not given.
    dear
        Whether to include the readings of features that take seconds per load.

    Returns
    -------
    MapPosition
        The position.

    Raises
    ------
    InputError
        As `read_case` does.
    """
    position = read_stored(_restore_position, Path(folder), criteria, creep)
    return add_slow_readings(position) if dear else position


# --- Readings and pictures of a position. A worker makes them while other workers have other positions.


@dataclass(frozen=True, kw_only=True, eq=False)
class PicturedPosition:
    """A position, and pictures of its cells.

    Attributes
    ----------
    position
        The position.
    pictures
        Pictures in WEBP format, by the load in N.
    """

    position: MapPosition
    pictures: Mapping[float, bytes]


def read_pictured_position(
    folder: Path, *, criteria: Criteria, creep: Creep, dear: bool, pictured: bool
) -> PicturedPosition:
    """Read a finished position, with pictures of its cells.

    Parameters
    ----------
    folder
        Folder of the position.
    criteria, creep
        Criteria, and friction with creepages.
    dear
        Whether to include the readings of features that take seconds per load.
    pictured
        Whether to draw a picture of each cell.

    Returns
    -------
    PicturedPosition
        The position and its pictures.

    Raises
    ------
    InputError
        As `read_case` does.
    """
    return _draw_position(read_position(folder, criteria=criteria, creep=creep), dear=dear, pictured=pictured)


def _draw_position(position: MapPosition, *, dear: bool, pictured: bool) -> PicturedPosition:
    """Draw the cells of a position, and evaluate the slow quantities of a row.

    `dear` decides whether the slow readings of features are added, and `pictured` whether cells are drawn. Pictures are
    by the load in N.
    """
    from fecontact.maps.report import draw_cell_picture

    pictures = {}
    for cell in position.cells:
        if cell.judged is not None:
            # the most expensive quantity of a row; the load keeps it
            _ = cell.judged.comparison.overlap
            if pictured and position.placement is not None:
                pictures[cell.load_N] = draw_cell_picture(cell.judged, position.placement)
    return PicturedPosition(position=add_slow_readings(position) if dear else position, pictures=pictures)


def _restore_position(stored: StoredPosition) -> MapPosition:
    """Restore a position, its load limit and its cells from the stored loads.

    The first stored loads belong to the search for the limit, the others to the cells. Without a placement the position
    has only failed cells and a reason.
    """
    record, shift, placement = stored.record, stored.case.lateral_shift_mm, stored.placement
    cells = {cell["load_N"]: MapCell(lateral_shift_mm=shift, **cell) for cell in record["cells"]}
    stopped_cell = record["stopped"] and MapCell(lateral_shift_mm=shift, **record["stopped"])
    if placement is None:
        limit = LoadLimit(reason=record["reason"])
        return MapPosition(lateral_shift_mm=shift, cells=tuple(cells.values()), limit=limit)
    tried = tuple(stored.judged(number, is_from_search=True) for number in range(record["tried"]))
    for number in range(len(tried), len(record["loads"])):
        load = stored.judged(number)
        cells[load.load_N] = build_solved_cell(shift, load)
    return build_position(shift, cells.values(), tried, placement, stopped=stopped_cell)


def has_open_loads(folder: Path) -> bool:
    """Whether a finished position has failed or not converged loads, which are worth another attempt.

    Parameters
    ----------
    folder
        Folder of the position.

    Returns
    -------
    bool
        Whether a load is open; False for a missing or damaged position, which is solved anyway.
    """
    try:
        return not all(is_usable_status(cell) for cell in read_solution(folder)["cells"])
    except (InputError, KeyError, TypeError):
        # a missing or damaged position is solved anyway
        return False
