"""Positions of a map in their folders: solved by a worker, kept, and read back to be judged again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.criteria import Creep, Criteria
from fecontact.errors import InputError, usable
from fecontact.jobs.store import tell_part
from fecontact.jobs.workers import Made
from fecontact.maps.model import LoadLimit, MapCell, MapPosition
from fecontact.maps.positions import mapped_position, solve_position, solved_cell, with_dear_readings
from fecontact.outputs.flat_records import picked
from fecontact.runs.store import (
    Stored,
    copy_solved,
    judged_again,
    keep_loads,
    read_stored,
    refuse_changed_profiles,
    solved_in,
)


def position_folder(out: Path, name: str) -> Path:
    """Folder of a finished position; another one for other inputs or other loads."""
    return out / "positions" / name


@dataclass(frozen=True, kw_only=True)
class SolvingPosition:
    """What a worker does with a position under several loads, which increase: solve it and keep it.

    `dear` and `pictured` as in `found_position`.
    """

    case: Case
    name: str
    loads_N: tuple[float, ...]
    dear: bool = False
    pictured: bool = False

    def __call__(self, folder: Path, finished: Path | None) -> Made:
        """Solve, or take over what is in the finished folder where a new solution would have no more."""
        again = None if finished is None else judged_again(read_position, finished, self.case)
        if finished is not None and again is not None and again.limit.narrowed:
            copy_solved(finished, folder, self.case)
            return Made()
        position = solve_position(self.case, self.loads_N, partial(tell_part, folder, self.name))
        keep_position(position, self.case, folder)
        refuse_changed_profiles(self.case, self.name, self.loads_N)
        found = _found(position, dear=self.dear, pictured=self.pictured)
        return Made(short_of_memory=position.short_of_memory, value=found)


def keep_position(position: MapPosition, case: Case, folder: Path) -> None:
    """Put all that a position can be judged again from into a folder."""
    cells = [_cell_record(cell) for cell in position.cells]
    stopped = None if position.stopped is None else _cell_record(position.stopped)
    own = {"cells": cells, "tried": len(position.tried), "stopped": stopped, "reason": position.limit.reason}
    keep_loads(position, case, folder, **own)


def _cell_record(cell: MapCell) -> dict[str, Any]:
    return picked(cell, "load_N status short_of_memory")


def read_position(
    folder: str | Path, *, criteria: Criteria | None = None, creep: Creep | None = None, dear: bool = False
) -> MapPosition:
    """Do as `read_case` does, for a position; with `dear` what features read in seconds a load, too."""
    position = read_stored(_position_of, Path(folder), criteria, creep)
    return with_dear_readings(position) if dear else position


# --- What a worker makes of a position beside its numbers, while other workers have other positions.


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundPosition:
    """A position, and pictures of its cells by their loads (N), as WEBP."""

    position: MapPosition
    pictures: Mapping[float, bytes]


def found_position(folder: Path, *, criteria: Criteria, creep: Creep, dear: bool, pictured: bool) -> FoundPosition:
    """A stored position, with `dear` as in `read_position`; where it is `pictured`, with a picture of each cell."""
    return _found(read_position(folder, criteria=criteria, creep=creep), dear=dear, pictured=pictured)


def _found(position: MapPosition, *, dear: bool, pictured: bool) -> FoundPosition:
    from fecontact.maps.report import cell_picture

    pictures = {}
    for cell in position.cells:
        if cell.judged is not None:
            # what a row takes longest for; the load keeps it
            _ = cell.judged.comparison.overlap
            if pictured and position.placement is not None:
                pictures[cell.load_N] = cell_picture(cell.judged, position.placement)
    return FoundPosition(position=with_dear_readings(position) if dear else position, pictures=pictures)


def _position_of(stored: Stored) -> MapPosition:
    record, shift, placement = stored.record, stored.case.lateral_shift_mm, stored.placement
    cells = {cell["load_N"]: MapCell(lateral_shift_mm=shift, **cell) for cell in record["cells"]}
    stopped = record["stopped"] and MapCell(lateral_shift_mm=shift, **record["stopped"])
    if placement is None:
        limit = LoadLimit(reason=record["reason"])
        return MapPosition(lateral_shift_mm=shift, cells=tuple(cells.values()), limit=limit)
    tried = tuple(stored.judged(number, tried=True) for number in range(record["tried"]))
    for number in range(len(tried), len(record["loads"])):
        judged = stored.judged(number)
        cells[judged.load_N] = solved_cell(shift, judged)
    return mapped_position(shift, cells.values(), tried, placement, stopped=stopped)


def has_open_loads(folder: Path) -> bool:
    """Whether a finished position has loads that failed or did not converge, so that it is worth another try."""
    try:
        return not all(usable(cell) for cell in solved_in(folder)["cells"])
    except (InputError, KeyError, TypeError):
        # not there or damaged: it is solved anyway
        return False
