"""Check of a study before its solution: correct inputs, and approximate cost."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from fecontact.case import INPUTS, Case, describe_unusual_inputs
from fecontact.errors import InputError
from fecontact.jobs.workers import count_default_workers
from fecontact.profiles.resolve import resolve_rail
from fecontact.runs.casefile import load_study
from fecontact.runs.cost import STUDY_FILES_S, Cost, estimate_cost, select_evenly
from fecontact.solving.placing import place_case

# A position takes 15 ms. If there are more positions than this, some that are spread over the study are tried.
_MAX_POSITIONS_TRIED = 40


@dataclass(frozen=True, kw_only=True)
class StudyCheck:
    """Result of the check of a study.

    Attributes
    ----------
    cases
        Number of cases.
    varied
        Inputs that vary between the cases, with their numbers of values.
    cost
        Approximate cost; None if there is a problem.
    positions, placed
        Number of positions of a wheel on a rail among the cases, and number of tried positions.
    problems
        Problems of the profiles, or of the first position in which the wheel does not run on the rail.
    notes
        Allowed but unusual inputs.
    """

    cases: int
    varied: tuple[str, ...]
    cost: Cost | None
    positions: int
    placed: int
    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()


def check_study(path: Path, *, quick: bool = False) -> StudyCheck:
    """Read a study file and all its profiles, and place its wheels; nothing is meshed or solved.

    Parameters
    ----------
    path
        File of the study.
    quick
        Whether to read the small version of the study.

    Returns
    -------
    StudyCheck
        Result of the check.

    Raises
    ------
    InputError
        As `load_study` does.
    """
    cases = load_study(path, quick=quick).cases
    positions = _distinct_positions(cases)
    problems = tuple(_find_profile_problems(cases))
    tried_count, problem = (0, None) if problems else _try_positions(positions)
    problems = problems if problem is None else (problem,)
    return StudyCheck(
        cases=len(cases),
        varied=tuple(_describe_varied_inputs(cases)),
        cost=None if problems else estimate_cost(cases, min(count_default_workers(), len(cases)), files=STUDY_FILES_S),
        positions=len(positions),
        placed=tried_count,
        problems=problems,
        notes=describe_unusual_inputs(cases),
    )


def _describe_varied_inputs(cases: tuple[Case, ...]) -> Iterable[str]:
    for slot in INPUTS:
        values = {slot.of(case) for case in cases}
        if len(values) > 1:
            yield f"{len(values)} values of {slot.key}"


def _find_profile_problems(cases: tuple[Case, ...]) -> Iterable[str]:
    """Read every rail and wheel of the cases, and yield the problems."""
    from fecontact.profiles.resolve import resolve_wheel

    for name, reading in dict.fromkeys((case.rail, case.rail_file) for case in cases):
        yield from _find_problem(partial(resolve_rail, name, reading))
    for name, reading in dict.fromkeys((case.wheel, case.wheel_file) for case in cases):
        yield from _find_problem(partial(resolve_wheel, name, reading))


# groups of inputs that determine the position of a wheel on its rail
_POSITION_GROUPS = ("pair", "position", "wheelset", "standing", "irregular", "profiles")


def _distinct_positions(cases: tuple[Case, ...]) -> list[Case]:
    """A case for each position of a wheel on a rail; the load is ignored."""
    position_slots = [slot for slot in INPUTS if slot.group in _POSITION_GROUPS]
    return list({tuple(slot.of(case) for slot in position_slots): case for case in cases}.values())


def _try_positions(positions: Sequence[Case]) -> tuple[int, str | None]:
    """Place some positions, up to the first without a contact.

    Returns the number of tried positions, and the problem of the last position; None without a problem.
    """

    chosen = select_evenly(positions, _MAX_POSITIONS_TRIED)
    for number, case in enumerate(chosen, start=1):
        for problem in _find_problem(partial(place_case, case)):
            return number, problem
    return len(chosen), None


def _find_problem(load_profile: Callable[[], object]) -> Iterable[str]:
    try:
        load_profile()
    except InputError as error:
        yield str(error)
