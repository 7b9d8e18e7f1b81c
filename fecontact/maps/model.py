"""Positions of an applicability map under many loads: their cells, load limits and stiffness."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Sized
from contextlib import closing
from dataclasses import dataclass, field, replace
from html import escape
from itertools import pairwise, takewhile
from typing import Literal, TypeAlias, TypeVar

import numpy as np

from fecontact.case import Case
from fecontact.errors import CONVERGED, FecontactError, NotEnoughMemory, failed
from fecontact.feature_registry import offered
from fecontact.judging.judge import with_readings
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.readings import MappedVerdicts
from fecontact.judging.verdict import Answer
from fecontact.outputs.records.results import Row, load_row
from fecontact.outputs.tables import picked
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.solve import LoadSweep, Stiffness, fit_stiffness

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
        return "failed" if self.judged is None else self.judged.answer.answer

    @property
    def cause(self) -> str | None:
        """Why Hertz does not hold."""
        return None if self.judged is None else self.judged.answer.cause


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


# --- At which loads Hertz holds at one position: what is known, and which load to solve next to know it better.
#
# Nothing is assumed of how the verdict changes over the load: a second lobe may come and be swallowed again.

_Word = TypeVar("_Word", bound=str)
# The loads on both sides of a limit are brought together to this part of the load; those where an open verdict begins
# or ends to the second, which follows from the uncertainty and not from the contact.
LOAD_TOLERANCE = 0.02
_OPEN_TOLERANCE = 0.05
MOST_TRIED = 14
"""Loads at a position that its limits take at most, beside the map's own."""
LOADS_FOR_LIMITS = 5.0
"""What they take about at a position of measured profiles: 14 were at one of a worn pair whose second patch comes at
once, and 3.5 at each of the 4 in 13 positions of new profiles at which the verdict changes."""
# A load beyond a limit is tried where the next one is farther away than this.
_GUARD_FROM = 1.1
# Loads on the way guard it if no gap between them is more than this part of the whole, in logarithms.
_GUARDED = 0.75


@dataclass(frozen=True, kw_only=True)
class KnownLoad:
    """Verdict at a load.

    Attributes
    ----------
    excess
        By how much the measure that uses most of its limit is beyond it, in limits.
    least, most
        How little and how much that may be: Hertz fails where the least is beyond 0, and holds where the most is not.
    """

    load_N: float
    answer: Answer
    excess: float
    least: float = math.nan
    most: float = math.nan

    @classmethod
    def of(cls, judged: JudgedLoad) -> KnownLoad:
        """The worst side of a judged load."""
        sides = judged.sides.values() if judged.plastic is None else (judged.plastic.deciding,)
        # what is not a number on one side is none on the worst
        excess, least, most = np.max([(side.limit_used, *side.limit_range) for side in sides], axis=0) - 1.0
        return cls(
            load_N=judged.load_N,
            answer=judged.answer.answer,
            excess=float(excess),
            least=float(least),
            most=float(most),
        )


def known_loads(cells: Sequence[MapCell], tried: Sequence[JudgedLoad] = ()) -> tuple[KnownLoad, ...]:
    """The loads of a position that may be used, by increasing load."""
    found = [KnownLoad.of(judged) for judged in tried if judged.usable]
    found += [KnownLoad.of(cell.usable) for cell in cells if cell.usable]
    return tuple(sorted(found, key=lambda known: known.load_N))


def next_load(known: Sequence[KnownLoad], own_N: Sequence[float], lost_N: Sequence[float] = ()) -> float | None:
    """The load (N) to solve next, None where every change of the verdict is known well, or enough loads were tried.

    Parameters
    ----------
    known
        By increasing load.
    own_N
        The loads that the map asks for.
    lost_N
        Loads that were tried and may not be used: between their neighbours nothing more is tried, for another attempt
        would end so too.

    Notes
    -----
    Between two loads whose verdicts differ, where the excess that makes the difference is zero on a straight line.
    Then, as a guard, half way from the loads that fail beside a limit to the map's next one above, where Hertz might
    hold again.
    """
    # not the difference of both numbers: of the map's own loads some may not be known
    if len(lost_N) + sum(one.load_N not in own_N for one in known) >= MOST_TRIED:
        return None
    for below, above in pairwise(known):
        if below.answer == above.answer or any(below.load_N < load_N < above.load_N for load_N in lost_N):
            continue
        within = _OPEN_TOLERANCE if "UNRESOLVED" in (below.answer, above.answer) else LOAD_TOLERANCE
        if above.load_N - below.load_N > within * above.load_N:
            return _load_between(below, above, within)
    for number, (before, first) in enumerate(pairwise(known), 1):
        if before.answer == "FAILS" or first.answer != "FAILS" or first.load_N in own_N:
            continue
        failing = [one.load_N for one in takewhile(lambda one: one.answer == "FAILS", known[number:])]
        own = next((place for place, load_N in enumerate(failing) if load_N in own_N), 0)
        if own and not lost_N and (guard := _guard(failing[: own + 1])) is not None:
            return guard
    return None


def _guard(failing_N: Sequence[float]) -> float | None:
    """A load in the widest gap between those that fail from a limit to the map's next load, None if it is narrow.

    A load that came of the search beside the limit is no guard of what lies beyond it.
    """
    gap, low_N = max((above / below, below) for below, above in pairwise(failing_N))
    whole = failing_N[-1] / failing_N[0]
    return low_N * math.sqrt(gap) if gap > max(_GUARD_FROM, whole**_GUARDED) else None


def _load_between(below: KnownLoad, above: KnownLoad, within: float) -> float:
    """A load between two: beside the zero of what makes the verdict change, on the side where more is open."""
    low, high = math.log(below.load_N), math.log(above.load_N)
    answers = {below.answer, above.answer}
    change = "excess" if "UNRESOLVED" not in answers else "least" if "FAILS" in answers else "most"
    ends: list[float] = [getattr(one, change) for one in (below, above)]
    if not math.prod(ends) < 0.0:
        return math.exp(0.5 * (low + high))
    # a second patch that comes at once is beyond its limit by far: a straight line to it would creep
    before, after = (max(-1.0, min(1.0, end)) for end in ends)
    part = before / (before - after)
    root = low + part * (high - low)
    # so that the next load lies on the other side of the limit, and the change between both
    beside = 0.4 * within
    wanted = root - beside if part > 0.5 else root + beside
    room = 0.1 * (high - low)
    return math.exp(min(max(wanted, low + room), high - room))


def load_limit(
    cells: Sequence[MapCell], tried: Sequence[JudgedLoad] = (), *, stopped: MapCell | None = None
) -> LoadLimit:
    """What the loads of one position, by increasing load, say of where Hertz holds.

    Parameters
    ----------
    tried
        Loads solved in addition to the map's loads.
    stopped
        A further load that could not be solved.
    """
    known = known_loads(cells, tried)
    lost = [] if not known else [cell for cell in cells if not cell.usable]
    lost += [] if stopped is None else [stopped]
    statuses = {cell.status for cell in cells}
    notes = [f"{cell.load_N / 1e3:.4g} kN: {cell.status}" for cell in lost]
    unusable = [judged for judged in tried if not judged.usable]
    notes += [f"{judged.load_N / 1e3:.4g} kN: {judged.status}" for judged in unusable]
    return LoadLimit(
        intervals=intervals_of([(one.load_N, one.answer) for one in known]),
        reason=None if known else statuses.pop() if len(statuses) == 1 else "no load could be solved",
        note="; ".join(notes) or None,
        tried=tuple((one.load_N, one.answer.answer) for one in tried),
        narrowed=stopped is None
        and next_load(known, [cell.load_N for cell in cells], [one.load_N for one in unusable]) is None,
    )


def intervals_of(known: Sequence[tuple[float, Answer]]) -> tuple[LoadInterval, ...]:
    """Intervals between known loads, by increasing load."""
    found = stretches(known, "UNRESOLVED")
    return tuple(LoadInterval(low_N=low_N, high_N=high_N, answer=answer) for low_N, high_N, answer in found)


def stretches(known: Sequence[tuple[float, _Word]], between: _Word) -> list[tuple[float, float, _Word]]:
    """Stretches of loads with one word each, from known loads by increasing load.

    Between two loads with one word it is theirs; between others it is the word `between`.
    """
    found: list[tuple[float, float, _Word]] = []

    def add(low_N: float, high_N: float, word: _Word) -> None:
        if found and found[-1][2] == word:
            low_N = found.pop()[0]
        found.append((low_N, high_N, word))

    for number, (load_N, word) in enumerate(known):
        if number and known[number - 1][1] != word:
            add(known[number - 1][0], load_N, between)
        add(found[-1][1] if found else load_N, load_N, word)
    return found


# --- At which loads Hertz holds by what features judge, at one position of a map: from the loads that were solved.


def limits_of(
    cells: Sequence[MapCell], tried: Sequence[JudgedLoad], placement: Placement, limit: LoadLimit
) -> dict[str, LoadLimit]:
    """At which loads of a position Hertz holds by each verdict of features that its loads have.

    Loads that the search for the limits of pressure tried tell more only between loads of the map that differ.
    """
    judged = [cell.judged for cell in cells if cell.judged is not None]
    return {
        name: _limit_by(of, cells, tried, placement, limit)
        for name, of in offered("MAPS").items()
        if any(map(of.read, judged))
    }


def _limit_by(
    of: MappedVerdicts,
    cells: Sequence[MapCell],
    tried: Sequence[JudgedLoad],
    placement: Placement,
    limit: LoadLimit,
) -> LoadLimit:
    read = [(cell.load_N, of.read(cell.usable)) for cell in cells if cell.usable]
    found = {load_N: one.verdict.answer for load_N, one in read if one is not None}
    changes = [(low, high) for low, high in pairwise(found) if found[low] != found[high]]
    between = {
        one.load_N: of.judge(one, placement).verdict.answer
        for one in tried
        if one.usable and any(low < one.load_N < high for low, high in changes)
    }
    known = sorted((found | between).items())
    return LoadLimit(
        intervals=intervals_of(known),
        reason=None if known else limit.reason,
        note=limit.note,
        tried=tuple(between.items()),
    )


def with_dear_readings(position: MapPosition) -> MapPosition:
    """A position with what features read in seconds a load, at each load that may be used."""
    if (placement := position.placement) is None:
        return position
    cells = (
        replace(cell, judged=with_readings(cell.usable, placement, "DEAR_READINGS")) if cell.usable else cell
        for cell in position.cells
    )
    return replace(position, cells=tuple(cells))


# --- The contact stiffness at one position of a map, from all its loads that may be used.

# Two loads would be met exactly, which says nothing about the fit's error.
_FEWEST_LOADS = 3


def stiffness_of(cells: Sequence[MapCell]) -> Stiffness | None:
    """The fit over the loads of a position; None for fewer than three."""
    loads = [cell.usable for cell in cells if cell.usable]
    return None if len(loads) < _FEWEST_LOADS else fit_stiffness(loads)


# --- One position of a map, solved under all loads with its factors reused.


Tell: TypeAlias = Callable[[float, str], None]
"""Hears which part of a job is done, and what is under way."""


def solve_position(case: Case, loads_N: Sequence[float], tell: Tell = lambda part, words: None) -> MapPosition:
    """Solve all loads (N, increasing) at the position of a case, and find its load limit.

    A position or a load that cannot be solved is not an error but cells whose status says why. `tell` hears before each
    load which part is done, if no limit takes more loads than so far, and how many loads.
    """
    shift = case.lateral_shift_mm
    try:
        sweep = LoadSweep(case, loads_N)
    except FecontactError as error:
        return failed_position(shift, loads_N, error)
    found: dict[float, MapCell] = {}
    tried: list[JudgedLoad] = []
    stopped: MapCell | None = None
    # the largest load first: its meshes serve the smaller ones
    waiting = list(loads_N)
    with closing(sweep):
        while waiting:
            load_N = waiting.pop()
            tell(*_part(found, loads_N, tried))
            found[load_N] = _cell(sweep, shift, load_N)
            # the limits among these loads while their meshes are there
            if not (waiting and sweep.is_ready_for(waiting[-1])):
                stopped = stopped or _search(sweep, shift, found, tried, lambda: tell(*_part(found, loads_N, tried)))
    return mapped_position(shift, map(found.__getitem__, loads_N), tried, sweep.placement, stopped=stopped)


def mapped_position(
    shift_mm: float,
    cells: Iterable[MapCell],
    tried: Sequence[JudgedLoad],
    placement: Placement,
    *,
    stopped: MapCell | None,
) -> MapPosition:
    """A position from its loads and those that the search for its limits tried; `stopped` as in `load_limit`."""
    own = tuple(cells)
    limit = load_limit(own, tried, stopped=stopped)
    return MapPosition(
        lateral_shift_mm=shift_mm,
        cells=own,
        limit=limit,
        limits_of=limits_of(own, tried, placement, limit),
        placement=placement,
        stiffness=stiffness_of(own),
        tried=tuple(tried),
        stopped=stopped,
    )


def _part(cells: Sized, loads_N: Sized, tried: Sized) -> tuple[float, str]:
    """Which part of a position is done, and the loads of it in words."""
    words = f"{len(cells)} of {len(loads_N)} loads" + (f", {len(tried)} more for limits" if tried else "")
    return (len(cells) + len(tried)) / (len(loads_N) + len(tried) + 1), words


def _search(
    sweep: LoadSweep,
    shift: float,
    cells: Mapping[float, MapCell],
    tried: list[JudgedLoad],
    begin: Callable[[], None] = lambda: None,
) -> MapCell | None:
    """Solve further loads until every change of the verdict is known well; the load that stopped it, if one did."""

    def wanted_N() -> float | None:
        lost = [one.load_N for one in tried if not one.usable]
        return next_load(known_loads(tuple(cells.values()), tried), tuple(cells), lost)

    while (wanted := wanted_N()) is not None:
        begin()
        try:
            # beside a limit every verdict is open: finer meshes would only bring the ends of the range together
            tried.append(sweep.solve(wanted, refine=False))
        except FecontactError as error:
            return _failed_cell(shift, wanted, error)
    return None


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
