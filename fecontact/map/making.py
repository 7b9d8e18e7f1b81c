"""Where Hertz holds: the verdict over lateral shift and load, and for each position the load up to which it holds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import replace
from typing import Protocol

from fecontact.case import Case
from fecontact.errors import FecontactError, InputError
from fecontact.fe.memory import SHORT_OF_MEMORY
from fecontact.map.cells import ApplicabilityMap, LoadLimit, MapCell, MapPosition
from fecontact.map.inference import infer_loads
from fecontact.map.load_limit import load_limit, without_bracket
from fecontact.solving.load_sweep import LoadPoint, LoadSweep

Progress = Callable[[int, int, str], None]
StepProgress = Callable[[str], None]

_LOOK_EVERY_S = 2.0


class Sweep(Protocol):
    """What solves one position for one load after the other."""

    def solve(self, load_N: float) -> LoadPoint:
        """Solve one load."""

    def close(self) -> None:
        """Release what was kept between the loads."""


MakeSweep = Callable[[Case, StepProgress], Sweep]


def make_map(
    base_case: Case,
    shifts_mm: Sequence[float],
    loads_N: Sequence[float],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    adaptive: bool = False,
    done: Sequence[MapPosition] = (),
    progress: Progress | None = None,
    on_position: Callable[[MapPosition, ApplicabilityMap], None] | None = None,
    sweep: MakeSweep | None = None,
) -> ApplicabilityMap:
    """Solve all positions and loads, and find each position's load limit.

    Parameters
    ----------
    base_case
        Everything but lateral shift and load.
    executor
        Solves the positions, such as a pool of processes; without one they are solved here, one after the other.
    workers
        How many positions the executor solves at a time, for the progress: it calls the next ones running too.
    adaptive
        Solve every second position first, and infer those between them whose verdict is beyond doubt.
    done
        Positions that were solved before, with the same base case and loads; those of other shifts do not count.
    progress
        Called with the number of finished positions, how many there are, and what is being done.
    on_position
        Called after each position with it and the map so far, so that an interrupted map keeps what it has.
    sweep
        Makes what solves one position, a LoadSweep if not given.

    Raises
    ------
    InputError
        If there are no shifts or loads, or values that no case can have. A position that cannot be solved is not an
        error but cells whose status says why.
    """
    shifts, loads = tuple(sorted(set(shifts_mm))), tuple(sorted(set(loads_N)))
    if not shifts or not loads:
        raise InputError("map: give at least one lateral shift and one load")
    # all are made first: a value that no case can have is said before anything is solved
    every = [replace(base_case, lateral_shift_mm=shift, load_N=load) for shift in shifts for load in reversed(loads)]
    positions = {position.shift_mm: position for position in done if position.shift_mm in shifts}
    wanted = [case for case in every[:: len(loads)] if case.lateral_shift_mm not in positions]

    def so_far() -> ApplicabilityMap:
        found = tuple(positions[shift] for shift in shifts if shift in positions)
        return ApplicabilityMap(case=base_case, loads_N=loads, positions=found)

    def tell(what: str) -> None:
        if progress is not None:
            progress(len(positions), len(shifts), what)

    def solve_all(cases: Sequence[Case]) -> None:
        if executor is None:
            each = _one_by_one(cases, loads, sweep, tell)
        else:
            each = _together(cases, loads, executor, workers, tell)
        for position in each:
            keep(position)

    def keep(position: MapPosition) -> None:
        positions[position.shift_mm] = position
        if on_position is not None:
            on_position(position, so_far())

    if adaptive:
        first = {*shifts[::2], shifts[-1]}
        solve_all([case for case in wanted if case.lateral_shift_mm in first])
        for case in [case for case in wanted if case.lateral_shift_mm not in first]:
            tell(f"{case.lateral_shift_mm:+z.2f} mm: half-space")
            inferred = _inferred_position(case, loads, shifts, positions)
            if inferred is not None:
                keep(inferred)
    solve_all([case for case in wanted if case.lateral_shift_mm not in positions])
    return so_far()


def _inferred_position(
    case: Case, loads: Sequence[float], shifts: Sequence[float], positions: Mapping[float, MapPosition]
) -> MapPosition | None:
    """A position between two solved ones, None if it should be solved itself."""
    number = shifts.index(case.lateral_shift_mm)
    sides = [positions[shift] for shift in (shifts[number - 1], shifts[number + 1]) if shift in positions]
    points = [{cell.load_N: cell.point for cell in side.cells} for side in sides]
    cases = [replace(case, lateral_shift_mm=side.shift_mm) for side in sides]
    found = infer_loads(case, loads, points, cases)
    if found is None:
        return None
    shift = case.lateral_shift_mm
    cells = tuple(
        MapCell(shift_mm=shift, load_N=load, status="inferred", point=None, inferred=one) for load, one in found.items()
    )
    verdicts = [one.verdict.verdict for one in found.values()]
    return MapPosition(shift_mm=shift, cells=cells, limit=LoadLimit(reason=without_bracket(cells, verdicts)))


def _one_by_one(
    cases: Sequence[Case], loads: Sequence[float], sweep: MakeSweep | None, tell: StepProgress
) -> Iterator[MapPosition]:
    for case in cases:

        def step(what: str, shift: float = case.lateral_shift_mm) -> None:
            tell(f"{shift:+z.2f} mm: {what}")

        yield solve_position(case, loads, sweep=sweep, step=step)


def _together(
    cases: Sequence[Case], loads: Sequence[float], executor: Executor, workers: int | None, tell: StepProgress
) -> Iterator[MapPosition]:
    """Positions as they are finished; one that was short of memory beside others is solved again, alone, at the end."""
    running = {executor.submit(solve_position, case, loads): case for case in cases}
    again: list[Case] = []
    while running:
        shifts = [case.lateral_shift_mm for future, case in running.items() if future.running()][:workers]
        tell(f"solving {', '.join(f'{shift:+z.2f}' for shift in shifts)} mm")
        # not for ever: which positions are under way changes without one being finished
        for future in wait(running, timeout=_LOOK_EVERY_S, return_when=FIRST_COMPLETED).done:
            case = running.pop(future)
            position = _outcome(future, case.lateral_shift_mm, loads)
            if len(cases) > 1 and any(SHORT_OF_MEMORY in cell.status for cell in position.cells):
                again.append(case)
            else:
                yield position
    for case in again:
        tell(f"solving {case.lateral_shift_mm:+z.2f} mm, alone")
        yield _outcome(executor.submit(solve_position, case, loads), case.lateral_shift_mm, loads)


def _outcome(future: Future[MapPosition], shift: float, loads: Sequence[float]) -> MapPosition:
    error = future.exception()
    if error is None:
        return future.result()
    # a process that died, or a fault of the program: the other positions go on
    said = " ".join(f"{type(error).__name__}: {error}".split())
    return _failed_position(shift, loads, f"failed: {said}")


def _failed_position(shift: float, loads: Sequence[float], status: str) -> MapPosition:
    cells = tuple(MapCell(shift_mm=shift, load_N=load, status=status, point=None) for load in loads)
    return MapPosition(shift_mm=shift, cells=cells, limit=LoadLimit(reason=status))


def solve_position(
    case: Case, loads: Sequence[float], *, sweep: MakeSweep | None = None, step: StepProgress | None = None
) -> MapPosition:
    """Solve all loads (N, increasing) at the position of a case, and find its load limit."""
    shift = case.lateral_shift_mm
    tell: StepProgress = step or (lambda what: None)
    load = ""
    try:
        solver = (sweep or _load_sweep)(case, lambda what: tell(f"{load}{what}"))
    except FecontactError as error:
        return _failed_position(shift, loads, f"failed: {error}")
    solved = {}
    try:
        # the largest load first: its meshes serve the smaller ones
        for load_N in reversed(loads):
            load = f"{load_N / 1e3:g} kN: "
            solved[load_N] = _cell(solver, shift, load_N)
        cells = tuple(solved[load_N] for load_N in loads)

        def bisect(load_N: float) -> LoadPoint:
            nonlocal load
            load = f"limit, {load_N / 1e3:.1f} kN: "
            return solver.solve(load_N)

        return MapPosition(shift_mm=shift, cells=cells, limit=load_limit(case, cells, bisect))
    finally:
        solver.close()


def _load_sweep(case: Case, step: StepProgress) -> Sweep:
    return LoadSweep(case, progress=step)


def _cell(sweep: Sweep, shift: float, load_N: float) -> MapCell:
    try:
        point = sweep.solve(load_N)
    except FecontactError as error:
        return MapCell(shift_mm=shift, load_N=load_N, status=f"failed: {error}", point=None)
    return MapCell(shift_mm=shift, load_N=load_N, status=point.status, point=point)
