"""An applicability map as values: the verdict at each position and load, and each position's load limit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from fecontact.case import Case
from fecontact.comparison.verdict import Answer
from fecontact.map.inference import Inferred
from fecontact.solving.load_sweep import LoadPoint

CellVerdict = Literal["HOLDS", "FAILS", "UNRESOLVED", "failed"]


@dataclass(frozen=True, kw_only=True)
class LoadLimit:
    """The load up to which Hertz holds.

    Attributes
    ----------
    F_max_N
        Largest load found within the criteria below the first that is not; None where there is none, see `reason`.
        An unresolved load counts by its deviation alone.
    holds_N, fails_N
        The loads next to the limit whose verdicts are beyond doubt: the last that HOLDS and the first that FAILS.
    reason
        Why there is no limit.
    note
        What else there is to know: more than one change of the verdict, unresolved loads at the limit.
    tried
        Loads that the bisection solved, with their verdicts.
    """

    F_max_N: float | None = None
    holds_N: float | None = None
    fails_N: float | None = None
    reason: str | None = None
    note: str | None = None
    tried: tuple[tuple[float, Answer], ...] = field(default=())


@dataclass(frozen=True, kw_only=True, eq=False)
class MapCell:
    """One position and load, solved or inferred; `status` says why there is neither, or why it must not be used."""

    shift_mm: float
    load_N: float
    status: str
    point: LoadPoint | None
    inferred: Inferred | None = None

    @property
    def solved(self) -> bool:
        """Whether finite elements say so, and not the half-space with the neighbours' finite elements."""
        return self.inferred is None

    @property
    def verdict(self) -> CellVerdict:
        """The verdict, `failed` where there is none."""
        found = self.point or self.inferred
        return "failed" if found is None else found.verdict.verdict

    @property
    def deviation(self) -> Mapping[str, float]:
        """(Hertz - FE) / FE of the measures that are known."""
        found = self.point or self.inferred
        return {} if found is None else found.deviation

    @property
    def cause(self) -> str | None:
        """Why Hertz does not hold."""
        return None if self.point is None else self.point.cause


@dataclass(frozen=True, kw_only=True, eq=False)
class MapPosition:
    """All loads of one lateral shift, by increasing load, and its load limit."""

    shift_mm: float
    cells: tuple[MapCell, ...]
    limit: LoadLimit


@dataclass(frozen=True, kw_only=True, eq=False)
class ApplicabilityMap:
    """Positions by lateral shift; while a map is made, those that are done."""

    case: Case
    loads_N: tuple[float, ...]
    positions: tuple[MapPosition, ...]

    @property
    def shifts_mm(self) -> tuple[float, ...]:
        """Lateral shifts of the positions."""
        return tuple(position.shift_mm for position in self.positions)

    @property
    def cells(self) -> tuple[MapCell, ...]:
        """Cells by position, then load."""
        return tuple(cell for position in self.positions for cell in position.cells)

    @property
    def limits(self) -> tuple[LoadLimit, ...]:
        """One limit a position."""
        return tuple(position.limit for position in self.positions)

    @property
    def all_solved(self) -> bool:
        """Whether every cell gave a result that may be used."""
        return all(cell.status in ("converged", "inferred") for cell in self.cells)
