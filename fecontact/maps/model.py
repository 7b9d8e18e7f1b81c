"""Positions of an applicability map under many loads: their cells, load limits and stiffness."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from html import escape
from typing import Literal

from fecontact.case import Case
from fecontact.errors import CONVERGED
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.verdict import Answer
from fecontact.outputs.flat_records import picked
from fecontact.outputs.records.results import Row, load_row
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.solve import Stiffness

# --- An applicability map as values: the verdict at each position and load, and each position's load limit.

FIRST_YIELD, PLASTIC_LIMIT = "first_yield_N", "plastic_load_N"
"""Loads of a position that a map draws where a yield stress is given."""
CellVerdict = Literal["HOLDS", "FAILS", "UNRESOLVED", "failed"]


@dataclass(frozen=True, kw_only=True)
class LoadInterval:
    """Loads with one verdict; UNRESOLVED also between two loads whose verdicts differ."""

    low_N: float
    high_N: float
    answer: Answer


@dataclass(frozen=True, kw_only=True)
class LoadLimit:
    """At which loads Hertz holds.

    Attributes
    ----------
    intervals
        By increasing load, from the smallest load that was looked at to the largest.
    reason
        Why there are none.
    note
        Loads that could not be used.
    tried
        Loads solved in addition to the map's loads, with their verdicts.
    narrowed
        Whether every change of the verdict is known as well as it can be.
    """

    intervals: tuple[LoadInterval, ...] = ()
    reason: str | None = None
    note: str | None = None
    tried: tuple[tuple[float, Answer], ...] = field(default=())
    narrowed: bool = True

    @property
    def F_max_N(self) -> float | None:
        """The load up to which Hertz holds from the smallest on; None where it does not there, or holds at all."""
        if len(self.intervals) < 2 or self.intervals[0].answer != "HOLDS":
            return None
        return self.intervals[0].high_N


@dataclass(frozen=True, kw_only=True, eq=False)
class MapCell:
    """One position and load; `status` says why it was not solved, or why what was solved must not be used.

    `short_of_memory` is set where the machine had too little memory for the load.
    """

    lateral_shift_mm: float
    load_N: float
    status: str
    judged: JudgedLoad | None = None
    short_of_memory: bool = False

    @property
    def load_kN(self) -> float:
        """The load in kN."""
        return self.load_N / 1e3

    @property
    def usable(self) -> JudgedLoad | None:
        """What was solved, where it may be used."""
        return self.judged if self.status == CONVERGED else None

    @property
    def verdict(self) -> CellVerdict:
        """The verdict, `failed` where there is none."""
        return "failed" if self.judged is None else self.judged.verdict.answer

    @property
    def cause(self) -> str | None:
        """Why Hertz does not hold."""
        return None if self.judged is None else self.judged.verdict.cause


@dataclass(frozen=True, kw_only=True, eq=False)
class MapPosition:
    """All loads of one lateral shift, by increasing load, and its load limit.

    Attributes
    ----------
    limit, limits_of
        At which loads Hertz holds, and by the verdicts of features (`MAPS`) that there are.
    placement
        None where the wheel could not be placed.
    stiffness
        Of the contact over its loads; None for fewer than three.
    tried
        Loads that the search for its limits solved.
    stopped
        The load that the search could not solve, at which it ended.
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
        """Loads of first yield, and at which yielding alone takes up a limit, as far as they are known.

        From the smallest load that tells each: its meshes are made for a patch next to that one.
        """
        found: dict[str, float] = {}
        told = (cell.usable.plastic for cell in self.cells if cell.usable is not None)
        for plastic in (one for one in told if one is not None and one.has_yielded):
            found.setdefault(FIRST_YIELD, plastic.yielded.first_yield_N)
            if plastic.plastic_load_N is not None:
                found.setdefault(PLASTIC_LIMIT, plastic.plastic_load_N)
        return found

    @property
    def solved(self) -> tuple[JudgedLoad, ...]:
        """All its loads that gave numbers, also those that the search for its limits solved."""
        return (*self.tried, *(cell.judged for cell in self.cells if cell.judged is not None))

    @property
    def converged(self) -> bool:
        """Whether finite elements gave a usable result at every load."""
        return all(cell.usable for cell in self.cells)

    @property
    def short_of_memory(self) -> bool:
        """Whether the machine had too little memory for any of its loads."""
        cells = self.cells if self.stopped is None else (*self.cells, self.stopped)
        return any(cell.short_of_memory for cell in cells) or any(one.solved.short_of_memory for one in self.solved)


@dataclass(frozen=True, kw_only=True, eq=False)
class ApplicabilityMap:
    """Positions by lateral shift; while a map is made, those that are done."""

    case: Case
    loads_N: tuple[float, ...]
    positions: tuple[MapPosition, ...]

    def __repr__(self) -> str:
        case, cells = self.case, [cell.verdict for cell in self.cells]
        told = ", ".join(f"{cells.count(answer)} {answer}" for answer in dict.fromkeys(cells))
        return (
            f"<ApplicabilityMap {case.rail} and {case.wheel}, {len(self.positions)} shifts, {len(self.loads_N)} loads:"
            f" Hertz in {len(cells)} cells {told or 'nowhere solved'}>"
        )

    def _repr_html_(self) -> str:
        rows = {
            f"{one.lateral_shift_mm:+g} mm": {f"{cell.load_kN:g} kN": cell.verdict for cell in one.cells}
            for one in self.positions
        }
        import pandas

        return f"<p>{escape(repr(self))}</p>{pandas.DataFrame.from_dict(rows, orient='index').to_html()}"

    def __len__(self) -> int:
        return len(self.cells)

    def __iter__(self) -> Iterator[MapCell]:
        """The cells by position, then load."""
        return iter(self.cells)

    def __getitem__(self, number: int) -> MapCell:
        return self.cells[number]

    @property
    def lateral_shifts_mm(self) -> tuple[float, ...]:
        """Lateral shifts of the positions."""
        return tuple(position.lateral_shift_mm for position in self.positions)

    @property
    def cells(self) -> tuple[MapCell, ...]:
        """Cells by position, then load."""
        return tuple(cell for position in self.positions for cell in position.cells)

    @property
    def limits(self) -> tuple[LoadLimit, ...]:
        """One limit a position."""
        return tuple(position.limit for position in self.positions)

    def rows(self) -> list[Row]:
        """A flat row a cell, with the columns of a case as far as it has them."""
        return [cell_row(cell, position.placement) for position in self.positions for cell in position.cells]

    @property
    def all_solved(self) -> bool:
        """Whether every cell gave a result that may be used."""
        return all(cell.usable for cell in self.cells)


def cell_row(cell: MapCell, placement: Placement | None) -> Row:
    """A cell of a map as a flat row, with the columns of a case as far as it has them."""
    head = picked(cell, "lateral_shift_mm load_kN status") | {"verdict_answer": cell.verdict}
    return head if cell.judged is None or placement is None else head | load_row(cell.judged, placement)
