"""Where Hertz holds: the verdict over lateral shift and load, and for each position the load up to which it holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Literal, Protocol

from fecontact.applicability import Answer
from fecontact.case import Case
from fecontact.errors import FecontactError, InputError
from fecontact.load_sweep import LoadPoint, LoadSweep

CellVerdict = Literal["HOLDS", "FAILS", "UNRESOLVED", "failed"]
Progress = Callable[[int, int, str], None]
StepProgress = Callable[[str], None]

# The load limit is bisected until its bracket is this part of the load.
LOAD_TOLERANCE = 0.02


class Sweep(Protocol):
    """What solves one position for one load after the other."""

    def solve(self, load_N: float) -> LoadPoint:
        """Solve one load."""

    def close(self) -> None:
        """Release what was kept between the loads."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MapCell:
    """One position and load; `status` says why there is no point, or why it must not be used.

    `solved` tells a cell that was solved from one that was inferred from others; all are solved.
    """

    shift_mm: float
    load_N: float
    status: str
    point: LoadPoint | None
    solved: bool = True

    @property
    def verdict(self) -> CellVerdict:
        """The verdict, `failed` where there is no point."""
        return "failed" if self.point is None else self.point.verdict.verdict

    @property
    def cause(self) -> str | None:
        """Why Hertz does not hold."""
        return None if self.point is None else self.point.cause


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
class ApplicabilityMap:
    """Cells by position, then load, and one limit a position."""

    case: Case
    shifts_mm: tuple[float, ...]
    loads_N: tuple[float, ...]
    cells: tuple[MapCell, ...]
    limits: tuple[LoadLimit, ...]

    @property
    def all_solved(self) -> bool:
        """Whether every cell gave a result that may be used."""
        return all(cell.status == "converged" for cell in self.cells)


def make_map(
    base_case: Case,
    shifts_mm: Sequence[float],
    loads_N: Sequence[float],
    *,
    progress: Progress | None = None,
    on_position: Callable[[ApplicabilityMap], None] | None = None,
    sweep: Callable[[Case, StepProgress], Sweep] = lambda case, step: LoadSweep(case, progress=step),
) -> ApplicabilityMap:
    """Solve all positions and loads, and find each position's load limit.

    Parameters
    ----------
    base_case
        Everything but lateral shift and load.
    progress
        Called with the number of the position, how many there are, and what is being done.
    on_position
        Called with the map so far after each position, so that an interrupted map keeps what it has.
    sweep
        Makes what solves one position.

    Raises
    ------
    InputError
        If there are no shifts or loads, or values that no case can have. A position that cannot be solved is not an
        error but cells whose status says why.
    """
    shifts, loads = tuple(sorted(set(shifts_mm))), tuple(sorted(set(loads_N)))
    if not shifts or not loads:
        raise InputError("map: give at least one lateral shift and one load")
    cases = [replace(base_case, lateral_shift_mm=shift, load_N=load) for shift in shifts for load in reversed(loads)]
    cells: list[MapCell] = []
    limits: list[LoadLimit] = []
    for number, case in enumerate(cases[:: len(loads)]):

        def step(what: str, number: int = number, shift: float = case.lateral_shift_mm) -> None:
            if progress is not None:
                progress(number, len(shifts), f"{shift:+z.2f} mm: {what}")

        row, limit = _solve_position(case, loads, sweep, step)
        cells += row
        limits.append(limit)
        done = ApplicabilityMap(
            case=base_case,
            shifts_mm=shifts[: number + 1],
            loads_N=loads,
            cells=tuple(cells),
            limits=tuple(limits),
        )
        if on_position is not None:
            on_position(done)
    return done


def _solve_position(
    case: Case, loads: Sequence[float], make_sweep: Callable[[Case, StepProgress], Sweep], step: StepProgress
) -> tuple[list[MapCell], LoadLimit]:
    shift = case.lateral_shift_mm
    load = ""
    try:
        sweep = make_sweep(case, lambda what: step(f"{load}{what}"))
    except FecontactError as error:
        status = f"failed: {error}"
        cells = [MapCell(shift_mm=shift, load_N=load, status=status, point=None) for load in loads]
        return cells, LoadLimit(reason=status)
    solved = {}
    try:
        # the largest load first: its meshes serve the smaller ones
        for load_N in reversed(loads):
            load = f"{load_N / 1e3:g} kN: "
            solved[load_N] = _cell(sweep, shift, load_N)
        cells = [solved[load_N] for load_N in loads]

        def bisect(load_N: float) -> LoadPoint:
            nonlocal load
            load = f"limit, {load_N / 1e3:.1f} kN: "
            return sweep.solve(load_N)

        return cells, load_limit(case, cells, bisect)
    finally:
        sweep.close()


def _cell(sweep: Sweep, shift: float, load_N: float) -> MapCell:
    try:
        point = sweep.solve(load_N)
    except FecontactError as error:
        return MapCell(shift_mm=shift, load_N=load_N, status=f"failed: {error}", point=None)
    return MapCell(shift_mm=shift, load_N=load_N, status=point.status, point=point)


def load_limit(
    case: Case,
    cells: Sequence[MapCell],
    solve: Callable[[float], LoadPoint],
    *,
    tolerance: float = LOAD_TOLERANCE,
) -> LoadLimit:
    """The load up to which Hertz holds, bisected between the last load that holds and the first that fails.

    Parameters
    ----------
    case
        Its criteria decide about unresolved loads.
    cells
        One position by increasing load.
    solve
        Solves a further load.
    """
    decided = [(c.load_N, c.verdict) for c in cells if c.verdict in ("HOLDS", "FAILS")]
    verdicts = [verdict for _, verdict in decided]
    changes = [k for k in range(1, len(decided)) if verdicts[k - 1 : k + 1] == ["HOLDS", "FAILS"]]
    note = _not_monotone(decided)
    if not changes:
        return LoadLimit(reason=_no_bracket(cells, verdicts), note=note)
    low, high = decided[changes[0] - 1][0], decided[changes[0]][0]
    return _bisect(case, (low, high), solve, tolerance, note)


def _no_bracket(cells: Sequence[MapCell], verdicts: Sequence[str]) -> str:
    if not verdicts:
        usable = any(cell.status == "converged" for cell in cells)
        return "unresolved at all loads" if usable else "no load could be solved"
    if "FAILS" in verdicts and "HOLDS" in verdicts:
        return "fails at small loads and holds above"
    rest = "" if len(verdicts) == len(cells) else " that are resolved"
    return f"holds at all loads{rest}" if "HOLDS" in verdicts else f"fails at all loads{rest}"


def _not_monotone(decided: Sequence[tuple[float, str]]) -> str | None:
    """Where Hertz holds again above a load at which it fails."""
    again = [
        f"fails at {low / 1e3:g} kN but holds at {high / 1e3:g} kN"
        for (low, before), (high, after) in pairwise(decided)
        if (before, after) == ("FAILS", "HOLDS")
    ]
    return f"not monotone: {', '.join(again)}" if again else None


def _bisect(
    case: Case,
    bracket: tuple[float, float],
    solve: Callable[[float], LoadPoint],
    tolerance: float,
    note: str | None,
) -> LoadLimit:
    low, high = bracket
    tried: list[tuple[float, Answer]] = []
    notes = [note] if note else []
    while high - low > tolerance * high:
        load = 0.5 * (low + high)
        try:
            point = solve(load)
        except FecontactError as error:
            notes.append(f"bisection stopped at {load / 1e3:.1f} kN: {error}")
            break
        if point.status != "converged":
            notes.append(f"bisection stopped at {load / 1e3:.1f} kN: {point.status}")
            break
        answer = point.verdict.verdict
        tried.append((load, answer))
        if answer == "HOLDS" or (answer == "UNRESOLVED" and _within(case, point)):
            low = load
        else:
            high = load
    # a verdict beyond doubt next to the limit, not one that a later step has passed
    holds = max([bracket[0], *(load for load, answer in tried if answer == "HOLDS" and load <= low)])
    fails = min([bracket[1], *(load for load, answer in tried if answer == "FAILS" and load >= high)])
    if any(answer == "UNRESOLVED" for _, answer in tried):
        notes.append(f"unresolved between {holds / 1e3:.1f} and {fails / 1e3:.1f} kN")
    return LoadLimit(F_max_N=low, holds_N=holds, fails_N=fails, note="; ".join(notes) or None, tried=tuple(tried))


def _within(case: Case, point: LoadPoint) -> bool:
    return all(abs(point.deviation[name]) <= limit for name, limit in case.criteria.limits.items())
