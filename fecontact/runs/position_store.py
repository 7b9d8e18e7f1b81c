"""One position of a map in its folder: solved and written, judged again from what was stored, and read back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judging import judge_load
from fecontact.comparison.theories import HERTZ, THEORIES
from fecontact.creep import Creep
from fecontact.criteria import Criteria
from fecontact.errors import InputError
from fecontact.files import read_json, write_json
from fecontact.map.cells import LoadLimit, MapCell, MapPosition
from fecontact.map.forces import force_limit, with_laws
from fecontact.map.load_limit import load_limit
from fecontact.map.position import solve_position, solved_cell
from fecontact.map.stiffness import stiffness_of
from fecontact.outcome import usable
from fecontact.outputs.records.results import shown_case_record
from fecontact.outputs.records.stored import (
    Arrays,
    placement_record,
    read_arrays,
    solved_from_record,
    solved_record,
    stored_placement,
    write_arrays,
)
from fecontact.runs.work import FIELDS, Store, StoredWork, copy_profiles, read_stored
from fecontact.solving.load_sweep import unrefined
from fecontact.solving.meshes import would_be_refined

SCHEMA = "fecontact/map-position/3"
POSITION = "position.json"


def position_folder(out: Path, name: str) -> Path:
    """Folder of a finished position; another one for other inputs or other loads."""
    return out / "positions" / name


def position_work(case: Case, loads_N: Sequence[float], name: str) -> StoredWork[MapPosition]:
    """What a worker does with a position: solve it under all loads and write its files."""
    return StoredWork(store=POSITIONS, case=case, name=name, loads_N=tuple(loads_N))


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
        return not all(usable(cell) for cell in read_json(folder / POSITION)["cells"])
    except (InputError, KeyError, TypeError):
        # not there or damaged: it is solved anyway
        return False


def read_position(
    folder: Path, *, criteria: Criteria | None = None, creep: Creep | None = None, creep_laws: bool = False
) -> MapPosition:
    """Read a finished position and judge it, by other criteria, friction and creepages than its own if given.

    With `creep_laws` also the laws of creep forces, which takes seconds a load.

    Raises
    ------
    InputError
        If the folder holds no finished position, or one of another layout, and what to do.
    """
    position = read_stored(POSITIONS, folder, criteria, creep)
    return with_laws(position) if creep_laws else position


def _read(folder: Path, record: Mapping[str, Any], case: Case) -> MapPosition:
    shift = record["lateral_shift_mm"]
    cells = {cell["load_N"]: MapCell(lateral_shift_mm=shift, **cell) for cell in record["cells"]}
    stopped = record["stopped"] and MapCell(lateral_shift_mm=shift, **record["stopped"])
    if record["placement"] is None:
        return MapPosition(
            lateral_shift_mm=shift, cells=tuple(cells.values()), limit=LoadLimit(reason=record["reason"])
        )
    placement = stored_placement(case, record["placement"])
    arrays = read_arrays(folder / FIELDS)
    tried: list[JudgedLoad] = []
    for load in record["loads"]:
        own = replace(case, load_N=load["load_N"])
        solved = solved_from_record(load, arrays, unrefined(own) if load["tried"] else own)
        judged = judge_load(solved, placement, (HERTZ,) if load["tried"] else THEORIES)
        if load["tried"]:
            tried.append(judged)
        else:
            cells[judged.load_N] = solved_cell(shift, judged)
    found = tuple(cells.values())
    limit = load_limit(found, tried, stopped=stopped)
    return MapPosition(
        lateral_shift_mm=shift,
        cells=found,
        limit=limit,
        force_limit=force_limit(found, tried, placement, limit),
        placement=placement,
        stiffness=stiffness_of(found),
        tried=tuple(tried),
        stopped=stopped,
    )


def _decided(position: MapPosition) -> bool:
    placement = position.placement
    return position.limit.narrowed and not (
        placement is not None and any(would_be_refined(load, placement) for load in position.solved)
    )


def _write(position: MapPosition, work: StoredWork[MapPosition], folder: Path, finished: Path | None) -> None:
    if finished is None:
        write_position(position, work.case, folder, work.name)
        return
    # its criteria are those by which it is judged from now on
    write_json(folder / POSITION, {**read_json(finished / POSITION), "case": shown_case_record(work.case)})


def _solve(work: StoredWork[MapPosition]) -> MapPosition:
    return solve_position(work.case, work.loads_N)


def _short_of_memory(position: MapPosition) -> bool:
    return position.short_of_memory


POSITIONS = Store(
    record=POSITION,
    schema=SCHEMA,
    unchanged=(FIELDS,),
    solve=_solve,
    write=_write,
    read=_read,
    decided=_decided,
    short_of_memory=_short_of_memory,
)
