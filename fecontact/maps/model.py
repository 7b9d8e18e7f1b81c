"""Applicability map as values: positions under many loads, with cells, load limits and stiffness."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from html import escape
from typing import Literal

from fecontact.case import Case
from fecontact.errors import CONVERGED
from fecontact.inputs.texts import count_text
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.verdict import Answer
from fecontact.outputs.flat_records import select_attributes
from fecontact.outputs.records.results import Row, load_row
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.solve import Stiffness

# --- An applicability map as values: the verdict at each position and load, and the load limit of each position.

FIRST_YIELD, PLASTIC_LIMIT = "first_yield_N", "plastic_load_N"
"""Loads of a position that a map shows if a yield stress is given."""
CellVerdict = Literal["HOLDS", "FAILS", "UNRESOLVED", "failed"]


@dataclass(frozen=True, kw_only=True)
class LoadInterval:
    """Interval of loads with a single verdict.

    The verdict is also UNRESOLVED between two loads with different verdicts.

    Attributes
    ----------
    low_N, high_N
        Ends of the interval in N.
    answer
        Verdict in the interval.
    """

    low_N: float
    high_N: float
    answer: Answer


@dataclass(frozen=True, kw_only=True)
class LoadLimit:
    """Loads at which Hertz holds.

    Attributes
    ----------
    intervals
        Intervals by increasing load, from the smallest to the largest load that was examined.
    reason
        Reason for missing intervals.
    note
        Loads without a usable result.
    tried
        Loads (N) solved in addition to the map's loads, with their verdicts.
    narrowed
        Whether every change of the verdict is enclosed within the tolerances of the search.
    """

    intervals: tuple[LoadInterval, ...] = ()
    reason: str | None = None
    note: str | None = None
    tried: tuple[tuple[float, Answer], ...] = field(default=())
    narrowed: bool = True

    @property
    def F_max_N(self) -> float | None:
        """Load (N) up to which Hertz holds from the smallest load on.

        None if Hertz does not hold at the smallest load, or if its verdict does not change.
        """
        if len(self.intervals) < 2 or self.intervals[0].answer != "HOLDS":
            return None
        return self.intervals[0].high_N


@dataclass(frozen=True, kw_only=True, eq=False)
class MapCell:
    """Position under a load.

    Attributes
    ----------
    lateral_shift_mm, load_N
        Lateral shift in mm, and load in N.
    status
        Reason why the cell was not solved, or why its result must not be used.
    judged
        Judged load; None if the cell was not solved.
    short_of_memory
        Whether the machine had too little memory for the load.
    """

    lateral_shift_mm: float
    load_N: float
    status: str
    judged: JudgedLoad | None = None
    short_of_memory: bool = False

    @property
    def load_kN(self) -> float:
        """Load in kN."""
        return self.load_N / 1e3

    @property
    def usable(self) -> JudgedLoad | None:
        """Judged load if its result is usable, else None."""
        return self.judged if self.status == CONVERGED else None

    @property
    def verdict(self) -> CellVerdict:
        """Verdict on Hertz; `failed` without a result."""
        return "failed" if self.judged is None else self.judged.verdict.answer

    @property
    def cause(self) -> str | None:
        """Cause for which Hertz does not hold."""
        return None if self.judged is None else self.judged.verdict.cause


@dataclass(frozen=True, kw_only=True, eq=False)
class MapPosition:
    """Lateral shift with its loads, by increasing load, and its load limit.

    Attributes
    ----------
    lateral_shift_mm, cells
        Lateral shift in mm, and the cells of the map's loads.
    limit, limits_of
        Loads at which Hertz holds by the map's measures, and by each verdict of features (`MAPS`).
    placement
        None if the wheel could not be placed.
    stiffness
        Contact stiffness over the loads; None for fewer than three loads.
    tried
        Loads that the search for load limits solved.
    stopped
        Cell of the load that the search could not solve and at which it ended.
    """

    lateral_shift_mm: float
    cells: tuple[MapCell, ...]
    limit: LoadLimit
    limits_of: Mapping[str, LoadLimit] = field(default_factory=dict)
    placement: Placement | None = None
    stiffness: Stiffness | None = None
    tried: tuple[JudgedLoad, ...] = ()
    stopped: MapCell | None = None

    @property
    def yield_loads_N(self) -> dict[str, float]:
        """Loads (N) of first yield, and loads at which yielding alone reaches a limit.

        Each value is from the smallest load that gives it: the meshes of that load are made for a patch nearest to the
        patch at this value. Unavailable values are missing.
        """
        loads_N: dict[str, float] = {}
        plastic_results = (cell.usable.plastic for cell in self.cells if cell.usable is not None)
        for plastic in (result for result in plastic_results if result is not None and result.has_yielded):
            loads_N.setdefault(FIRST_YIELD, plastic.yielded.first_yield_N)
            if plastic.plastic_load_N is not None:
                loads_N.setdefault(PLASTIC_LIMIT, plastic.plastic_load_N)
        return loads_N

    @property
    def solved(self) -> tuple[JudgedLoad, ...]:
        """Judged loads of the position, including the loads of the search for limits."""
        return (*self.tried, *(cell.judged for cell in self.cells if cell.judged is not None))

    @property
    def converged(self) -> bool:
        """Whether finite elements gave a usable result at every load of the map."""
        return all(cell.usable for cell in self.cells)

    @property
    def short_of_memory(self) -> bool:
        """Whether the machine had too little memory for any of the loads."""
        cells = self.cells if self.stopped is None else (*self.cells, self.stopped)
        return any(cell.short_of_memory for cell in cells) or any(
            judged_load.solved.short_of_memory for judged_load in self.solved
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class ApplicabilityMap:
    """Positions of a map by lateral shift; in an unfinished map, the finished positions.

    Attributes
    ----------
    case
        Base case of the map.
    loads_N
        Loads in N, increasing.
    positions
        Positions by increasing lateral shift.
    """

    case: Case
    loads_N: tuple[float, ...]
    positions: tuple[MapPosition, ...]

    @property
    def yaw_mrad(self) -> float:
        """Yaw of the wheelset in mrad."""
        return 1e3 * self.case.yaw_rad

    def __repr__(self) -> str:
        case, cells = self.case, [cell.verdict for cell in self.cells]
        counts = ", ".join(f"{cells.count(answer)} {answer}" for answer in dict.fromkeys(cells))
        return (
            f"<ApplicabilityMap {case.rail} and {case.wheel},"
            f" {count_text(len(self.positions), 'shift')}, {count_text(len(self.loads_N), 'load')}:"
            f" Hertz in {count_text(len(cells), 'cell')} {counts or 'without a result'}>"
        )

    def _repr_html_(self) -> str:
        """Table of the verdicts over shift and load, for a notebook."""
        rows = {
            f"{position.lateral_shift_mm:+g} mm": {f"{cell.load_kN:g} kN": cell.verdict for cell in position.cells}
            for position in self.positions
        }
        import pandas

        return f"<p>{escape(repr(self))}</p>{pandas.DataFrame.from_dict(rows, orient='index').to_html()}"

    def __len__(self) -> int:
        return len(self.cells)

    def __iter__(self) -> Iterator[MapCell]:
        """Cells by position, then by load."""
        return iter(self.cells)

    def __getitem__(self, number: int) -> MapCell:
        return self.cells[number]

    @property
    def lateral_shifts_mm(self) -> tuple[float, ...]:
        """Lateral shifts of the positions in mm."""
        return tuple(position.lateral_shift_mm for position in self.positions)

    @property
    def cells(self) -> tuple[MapCell, ...]:
        """Cells by position, then by load."""
        return tuple(cell for position in self.positions for cell in position.cells)

    @property
    def limits(self) -> tuple[LoadLimit, ...]:
        """Load limit of each position."""
        return tuple(position.limit for position in self.positions)

    def rows(self) -> list[Row]:
        """Flat row of each cell, with the columns of a case that the cell has.

        Returns
        -------
        list of dict
            Rows by position, then by load.
        """
        return [build_cell_row(cell, position.placement) for position in self.positions for cell in position.cells]

    @property
    def all_solved(self) -> bool:
        """Whether every cell has a usable result."""
        return all(cell.usable for cell in self.cells)


def build_cell_row(cell: MapCell, placement: Placement | None) -> Row:
    """Flat row of a cell, with the columns of a case that the cell has.

    Parameters
    ----------
    cell
        Cell of a map.
    placement
        Placement of the cell's position; None if the wheel could not be placed.

    Returns
    -------
    Row
        Shift, load, status and verdict; for a solved cell also the columns of a case.
    """
    row = select_attributes(cell, "lateral_shift_mm load_kN status") | {"verdict_answer": cell.verdict}
    return row if cell.judged is None or placement is None else row | load_row(cell.judged, placement)
