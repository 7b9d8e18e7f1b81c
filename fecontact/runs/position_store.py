"""One position of a map in its folder: solved and written, judged again from what was stored, and read back."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.comparison.judged_load import JudgedLoad, judge_load
from fecontact.creep import Creep
from fecontact.criteria import Criteria
from fecontact.errors import InputError
from fecontact.files import read_json, write_json
from fecontact.map.cells import LoadLimit, MapCell, MapPosition
from fecontact.map.load_limit import load_limit
from fecontact.map.position import solve_position, solved_cell
from fecontact.outputs.record import shown_case_record
from fecontact.outputs.stored import (
    Arrays,
    placement_from_record,
    placement_record,
    read_arrays,
    solved_from_record,
    solved_record,
    write_arrays,
)
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.runs.case_store import FIELDS, PROFILES, copy_profiles, stored_case, stored_record
from fecontact.runs.identity import position_id
from fecontact.solving.load_sweep import unrefined
from fecontact.solving.meshes import would_be_refined

SCHEMA = "fecontact/map-position/3"
POSITION = "position.json"


def position_folder(out: Path, name: str) -> Path:
    """Folder of a finished position; another one for other inputs or other loads."""
    return out / "positions" / name


@dataclass(frozen=True, kw_only=True)
class PositionWork:
    """What a worker does with a position of a map; its loads increase."""

    case: Case
    loads_N: tuple[float, ...]
    name: str

    def __call__(self, folder: Path, finished: Path | None) -> bool:
        """Solve the position and write its files; what is stored is judged again when it is read."""
        if finished is not None and self._is_decided(finished):
            shutil.copyfile(finished / FIELDS, folder / FIELDS)
            # its criteria are those by which it is judged from now on
            case = {"case": shown_case_record(self.case)}
            write_json(folder / POSITION, {**read_json(finished / POSITION), **case})
            if (finished / PROFILES).is_dir():
                shutil.copytree(finished / PROFILES, folder / PROFILES)
            return False
        position = solve_position(self.case, self.loads_N)
        if position_id(self.case, self.loads_N) != self.name:
            raise InputError("a profile's file changed while the position was solved; make the map again")
        write_position(position, self.case, folder, self.name)
        return position.short_of_memory

    def _is_decided(self, finished: Path) -> bool:
        """Whether the stored loads are all that a new solution would have, by the criteria and readings of today."""
        try:
            position = read_position(finished, criteria=self.case.criteria, creep=self.case.creep)
        except InputError:
            # of another layout
            return False
        placement = position.placement
        loads = (*position.tried, *(cell.judged for cell in position.cells if cell.judged is not None))
        return position.limit.narrowed and not (
            placement is not None and any(would_be_refined(load, placement) for load in loads)
        )


def write_position(position: MapPosition, case: Case, folder: Path, name: str) -> None:
    """Write a solved position into a folder."""
    arrays: Arrays = {}
    solved = [
        *((cell.judged, False) for cell in position.cells if cell.judged is not None),
        *((judged, True) for judged in position.tried),
    ]
    record = {
        "schema": SCHEMA,
        "id": name,
        "case": shown_case_record(case),
        "lateral_shift_mm": position.lateral_shift_mm,
        "placement": None if position.placement is None else placement_record(position.placement),
        "cells": [_cell_record(cell) for cell in position.cells],
        "stopped": None if position.stopped is None else _cell_record(position.stopped),
        "reason": position.limit.reason,
        "loads": [
            {"tried": tried, **solved_record(judged.solved, arrays, f"load{number}_")}
            for number, (judged, tried) in enumerate(solved)
        ],
    }
    copy_profiles(case, folder)
    write_arrays(folder / FIELDS, arrays)
    write_json(folder / POSITION, record)


def _cell_record(cell: MapCell) -> dict[str, Any]:
    return {"load_N": cell.load_N, "status": cell.status, "short_of_memory": cell.short_of_memory}


def has_open_loads(folder: Path) -> bool:
    """Whether a finished position has loads that failed or did not converge, so that it is worth another try."""
    try:
        return any(cell["status"] != "converged" for cell in read_json(folder / POSITION)["cells"])
    except (InputError, KeyError, TypeError):
        # not there or damaged: it is solved anyway
        return False


def read_position(folder: Path, *, criteria: Criteria | None = None, creep: Creep | None = None) -> MapPosition:
    """Read a finished position and judge it, by other criteria, friction and creepages than its own if given.

    Raises
    ------
    InputError
        If the folder holds no finished position, or one of another layout, and what to do.
    """
    with stored_record(folder / POSITION, SCHEMA, "make the map again") as record:
        return _position(folder, record, criteria, creep)


def _position(folder: Path, record: Mapping[str, Any], criteria: Criteria | None, creep: Creep | None) -> MapPosition:
    case = stored_case(folder, record["case"])
    case = replace(case, criteria=criteria or case.criteria, creep=creep or case.creep)
    shift = record["lateral_shift_mm"]
    cells = {cell["load_N"]: MapCell(lateral_shift_mm=shift, **cell) for cell in record["cells"]}
    stopped = record["stopped"] and MapCell(lateral_shift_mm=shift, **record["stopped"])
    if record["placement"] is None:
        return MapPosition(
            lateral_shift_mm=shift, cells=tuple(cells.values()), limit=LoadLimit(reason=record["reason"])
        )
    placement = placement_from_record(
        record["placement"], resolve_rail(case.rail, case.rail_file), resolve_wheel(case.wheel, case.wheel_file).profile
    )
    arrays = read_arrays(folder / FIELDS)
    tried: list[JudgedLoad] = []
    for load in record["loads"]:
        own = replace(case, load_N=load["load_N"])
        solved = solved_from_record(load, arrays, unrefined(own) if load["tried"] else own)
        judged = judge_load(solved, placement)
        if load["tried"]:
            tried.append(judged)
        else:
            cells[judged.load_N] = solved_cell(shift, judged)
    found = tuple(cells.values())
    return MapPosition(
        lateral_shift_mm=shift,
        cells=found,
        limit=load_limit(found, tried, stopped=stopped),
        placement=placement,
        tried=tuple(tried),
        stopped=stopped,
    )
