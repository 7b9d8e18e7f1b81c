"""A study looked at before it is solved: whether its inputs are right, and about what it costs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from fecontact.case import INPUTS, Case, unusual
from fecontact.errors import InputError
from fecontact.jobs.workers import default_workers
from fecontact.profiles.resolve import resolve_rail
from fecontact.runs.casefile import load_study
from fecontact.runs.cost import STUDY_FILES_S, Cost, cost_of, spread
from fecontact.solving.placing import place_case

# A position takes 15 ms; of more than these, some that are spread over the study.
_MOST_PLACED = 40


@dataclass(frozen=True, kw_only=True)
class StudyCheck:
    """What a study asks for.

    Attributes
    ----------
    varied
        The inputs that are not the same in all cases, with how many values they have.
    cost
        None where something is wrong.
    positions, placed
        Positions of a wheel on a rail among the cases, and how many of them were tried.
    problems
        What is wrong with profiles, or with the first position in which the wheel does not run on the rail.
    notes
        What is allowed and not usual.
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

    Raises
    ------
    InputError
        As `load_study` does.
    """
    cases = load_study(path, quick=quick).cases
    positions = _positions(cases)
    problems = tuple(_profile_problems(cases))
    placed, problem = (0, None) if problems else _place(positions)
    problems = problems if problem is None else (problem,)
    return StudyCheck(
        cases=len(cases),
        varied=tuple(_varied(cases)),
        cost=None if problems else cost_of(cases, min(default_workers(), len(cases)), files=STUDY_FILES_S),
        positions=len(positions),
        placed=placed,
        problems=problems,
        notes=unusual(cases),
    )


def _varied(cases: tuple[Case, ...]) -> Iterable[str]:
    for slot in INPUTS:
        values = {slot.of(case) for case in cases}
        if len(values) > 1:
            yield f"{len(values)} values of {slot.key}"


def _profile_problems(cases: tuple[Case, ...]) -> Iterable[str]:
    from fecontact.profiles.resolve import resolve_wheel

    for name, reading in dict.fromkeys((case.rail, case.rail_file) for case in cases):
        yield from _problem(partial(resolve_rail, name, reading))
    for name, reading in dict.fromkeys((case.wheel, case.wheel_file) for case in cases):
        yield from _problem(partial(resolve_wheel, name, reading))


# groups of inputs that say where a wheel is on its rail
_WHERE = ("pair", "position", "wheelset", "standing", "irregular", "profiles")


def _positions(cases: tuple[Case, ...]) -> list[Case]:
    """A case for each position of a wheel on a rail, whatever the load is."""
    where = [slot for slot in INPUTS if slot.group in _WHERE]
    return list({tuple(slot.of(case) for slot in where): case for case in cases}.values())


def _place(positions: Sequence[Case]) -> tuple[int, str | None]:
    """Place some positions, up to the first that is none; how many were tried, and what is wrong with the last one."""

    chosen = spread(positions, _MOST_PLACED)
    for number, case in enumerate(chosen, start=1):
        for problem in _problem(partial(place_case, case)):
            return number, problem
    return len(chosen), None


def _problem(read: Callable[[], object]) -> Iterable[str]:
    try:
        read()
    except InputError as error:
        yield str(error)
