"""One position of a map, solved under all loads with its factors reused."""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.case import Case
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.errors import FecontactError, NotEnoughMemory
from fecontact.map.cells import LoadLimit, MapCell, MapPosition
from fecontact.map.load_limit import known_loads, load_limit, next_load
from fecontact.map.stiffness import stiffness_of
from fecontact.outcome import failed
from fecontact.solving.load_sweep import LoadSweep


def solve_position(case: Case, loads_N: Sequence[float]) -> MapPosition:
    """Solve all loads (N, increasing) at the position of a case, and find its load limit.

    A position or a load that cannot be solved is not an error but cells whose status says why.
    """
    try:
        solver = LoadSweep(case, loads_N)
    except FecontactError as error:
        return failed_position(case.lateral_shift_mm, loads_N, error)
    try:
        return _Loads(solver, case.lateral_shift_mm).solve(loads_N)
    finally:
        solver.close()


class _Loads:
    """The loads of one position while they are solved."""

    def __init__(self, solver: LoadSweep, shift_mm: float) -> None:
        self._solver, self._shift = solver, shift_mm
        self._cells: dict[float, MapCell] = {}
        self._tried: list[JudgedLoad] = []
        self._stopped: MapCell | None = None

    def solve(self, loads_N: Sequence[float]) -> MapPosition:
        # the largest load first: its meshes serve the smaller ones
        waiting = list(loads_N)
        while waiting:
            load_N = waiting.pop()
            self._cells[load_N] = _cell(self._solver, self._shift, load_N)
            # the limits among these loads while their meshes are there
            if not (waiting and self._solver.is_ready_for(waiting[-1])):
                self._search()
        cells = tuple(self._cells[load_N] for load_N in loads_N)
        return MapPosition(
            lateral_shift_mm=self._shift,
            cells=cells,
            limit=load_limit(cells, self._tried, stopped=self._stopped),
            placement=self._solver.placement,
            stiffness=stiffness_of(cells),
            tried=tuple(self._tried),
            stopped=self._stopped,
        )

    def _search(self) -> None:
        """Solve further loads until every change of the verdict among the solved ones is known well."""
        while self._stopped is None and all(one.usable for one in self._tried):
            wanted = next_load(known_loads(tuple(self._cells.values()), self._tried), tuple(self._cells))
            if wanted is None:
                return
            try:
                # beside a limit every verdict is open: finer meshes would only bring the ends of the range together
                self._tried.append(self._solver.solve(wanted, refine=False))
            except FecontactError as error:
                self._stopped = _failed_cell(self._shift, wanted, error)


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
