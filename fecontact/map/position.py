"""One position of a map: solved under all loads with its factors reused, inferred, or judged again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from fecontact.case import Case
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.errors import FecontactError, NotEnoughMemory
from fecontact.geometry.placement import Placement
from fecontact.map.cells import LoadLimit, MapCell, MapPosition
from fecontact.map.inference import infer_loads
from fecontact.map.load_limit import among, load_limit, without_bracket
from fecontact.solving.load_sweep import LoadSweep

StepProgress = Callable[[str], None]


class Sweep(Protocol):
    """What solves one position for one load after the other."""

    placement: Placement

    def solve(self, load_N: float) -> JudgedLoad:
        """Solve one load."""

    def close(self) -> None:
        """Release what was kept between the loads."""


MakeSweep = Callable[[Case, StepProgress], Sweep]


def solve_position(
    case: Case, loads_N: Sequence[float], *, sweep: MakeSweep | None = None, step: StepProgress | None = None
) -> MapPosition:
    """Solve all loads (N, increasing) at the position of a case, and find its load limit.

    A position or a load that cannot be solved is not an error but cells whose status says why.
    """
    shift = case.lateral_shift_mm
    tell: StepProgress = step or (lambda what: None)
    under_way = ""
    try:
        solver = (sweep or _load_sweep)(case, lambda what: tell(f"{under_way}{what}"))
    except FecontactError as error:
        return failed_position(shift, loads_N, error)
    solved: dict[float, MapCell] = {}
    tried: list[JudgedLoad] = []
    try:
        # the largest load first: its meshes serve the smaller ones
        for load_N in reversed(loads_N):
            under_way = f"{load_N / 1e3:g} kN: "
            solved[load_N] = _cell(solver, shift, load_N)
        cells = tuple(solved[load_N] for load_N in loads_N)

        stopped: MapCell | None = None

        def half_way(low_N: float, high_N: float) -> JudgedLoad:
            nonlocal under_way, stopped
            load_N = 0.5 * (low_N + high_N)
            under_way = f"limit, {load_N / 1e3:.1f} kN: "
            try:
                tried.append(solver.solve(load_N))
            except FecontactError as error:
                stopped = _failed_cell(shift, load_N, error)
                raise
            return tried[-1]

        limit = load_limit(case.criteria, cells, half_way)
        return MapPosition(
            lateral_shift_mm=shift,
            cells=cells,
            limit=limit,
            placement=solver.placement,
            tried=tuple(tried),
            stopped=stopped,
        )
    finally:
        solver.close()


def _load_sweep(case: Case, step: StepProgress) -> Sweep:
    return LoadSweep(case, progress=step)


def _cell(sweep: Sweep, shift: float, load_N: float) -> MapCell:
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
    return MapCell(lateral_shift_mm=shift, load_N=load_N, status=f"failed: {error}", short_of_memory=short)


def failed_position(shift_mm: float, loads_N: Sequence[float], error: Exception | str) -> MapPosition:
    """A position of which nothing is known but why."""
    cells = tuple(_failed_cell(shift_mm, load_N, error) for load_N in loads_N)
    return MapPosition(lateral_shift_mm=shift_mm, cells=cells, limit=LoadLimit(reason=f"failed: {error}"))


def limit_of_solved(
    case: Case, cells: Sequence[MapCell], tried: Sequence[JudgedLoad], stopped: MapCell | None = None
) -> LoadLimit:
    """The load limit as far as the loads that were solved tell it."""
    return load_limit(case.criteria, cells, among(tried, stopped))


def inferred_position(
    case: Case, loads_N: Sequence[float], shifts_mm: Sequence[float], positions: Mapping[float, MapPosition]
) -> MapPosition | None:
    """A position between two solved ones, None if it should be solved itself."""
    number = shifts_mm.index(case.lateral_shift_mm)
    sides = [positions[shift] for shift in (shifts_mm[number - 1], shifts_mm[number + 1]) if shift in positions]
    loads = [{cell.load_N: cell.judged for cell in side.cells} for side in sides]
    cases = [replace(case, lateral_shift_mm=side.lateral_shift_mm) for side in sides]
    found = infer_loads(case, loads_N, loads, cases)
    if found is None:
        return None
    shift = case.lateral_shift_mm
    cells = tuple(
        MapCell(lateral_shift_mm=shift, load_N=load, status="inferred", inferred=one) for load, one in found.items()
    )
    verdicts = [one.verdict.answer for one in found.values()]
    return MapPosition(lateral_shift_mm=shift, cells=cells, limit=LoadLimit(reason=without_bracket(cells, verdicts)))
