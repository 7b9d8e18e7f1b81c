"""A study looked at before it is solved: whether its inputs are right, and about what it costs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from fecontact.case import INPUTS, RESOLUTIONS, Case, unusual
from fecontact.errors import InputError
from fecontact.jobs.workers import default_workers
from fecontact.runs.casefile import load_study

# Unknowns of the first meshes of a half model at `quick`, 60E1 and S1002 where the patch has one lobe (32 to 41
# thousand in six positions and pairs), and how they grow with the elements a semi-axis (74 thousand at `standard` and
# 114 thousand at `fine`, at 3 mm). With several lobes they are up to four times as many.
_UNKNOWNS = 34e3
_GROWTH, _GROWTH_BEYOND = 1.02, 2.0
_WHOLE = 1.95
_SEVERAL_LOBES = 3.7
# Seconds and memory of a case with the coarser meshes that it comes with: 5.8 s and 0.8 GB at 80 thousand unknowns,
# 45 s and 3.7 GB at 312 thousand, by PARDISO on one core of a virtual machine (x86-64, 2026).
_SECONDS, _SECONDS_GROWTH = 5.8, 1.45
_MEMORY_GB, _MEMORY_GROWTH = 0.85, 1.08
_START_S = 5.0
# A position takes 15 ms; of more than these, some that are spread over the study.
_MOST_PLACED = 40
# Semi-axes (mm) of a patch under 100 kN: only for element sizes that are given in mm.
_SEMI_AXES_MM = (6.5, 4.5)


@dataclass(frozen=True, kw_only=True)
class StudyCheck:
    """What a study asks for.

    Attributes
    ----------
    varied
        The inputs that are not the same in all cases, with how many values they have.
    seconds, memory_GB
        Of the whole study and of its largest case, if every patch has one lobe and every verdict is clear.
    most_seconds, most_memory_GB
        The same with several lobes, or with finer meshes where verdicts stay open.
    positions, placed
        Positions of a wheel on a rail among the cases, and how many of them were tried.
    problems
        What is wrong with profiles, or with the first position in which the wheel does not run on the rail.
    notes
        What is allowed and not usual.
    """

    cases: int
    varied: tuple[str, ...]
    workers: int
    seconds: float
    memory_GB: float
    most_seconds: float
    most_memory_GB: float
    available_GB: float
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
    import psutil

    cases = load_study(path, quick=quick).cases
    workers = min(default_workers(), len(cases))
    usual = [_unknowns(case) for case in cases]
    most = [
        max(_SEVERAL_LOBES * n, min(3.0 * n, case.refine_degrees_of_freedom))
        for n, case in zip(usual, cases, strict=True)
    ]
    positions = _positions(cases)
    problems = tuple(_profile_problems(cases))
    placed, problem = (0, None) if problems else _place(positions)
    return StudyCheck(
        cases=len(cases),
        varied=tuple(_varied(cases)),
        workers=workers,
        seconds=_START_S + sum(map(_seconds, usual)) / workers,
        memory_GB=max(map(_memory_GB, usual)),
        most_seconds=_START_S + sum(map(_seconds, most)) / workers,
        most_memory_GB=max(map(_memory_GB, most)),
        available_GB=psutil.virtual_memory().available / 1e9,
        positions=len(positions),
        placed=placed,
        problems=problems if problem is None else (problem,),
        notes=unusual(cases),
    )


def _unknowns(case: Case) -> float:
    if isinstance(case.resolution, str):
        count = RESOLUTIONS[case.resolution]
    else:
        axes = [axis * (case.load_N / 100e3) ** (1.0 / 3.0) for axis in _SEMI_AXES_MM]
        count = math.sqrt(math.prod(axis / step for axis, step in zip(axes, case.resolution, strict=True)))
    relative, finest = count / RESOLUTIONS["quick"], RESOLUTIONS["fine"] / RESOLUTIONS["quick"]
    grown = min(relative, finest) ** _GROWTH * max(1.0, relative / finest) ** _GROWTH_BEYOND
    return float(_UNKNOWNS * grown * (1.0 if case.half else _WHOLE))


def _seconds(unknowns: float) -> float:
    return float(_SECONDS * (unknowns / 80e3) ** _SECONDS_GROWTH)


def _memory_GB(unknowns: float) -> float:
    return float(_MEMORY_GB * (unknowns / 80e3) ** _MEMORY_GROWTH)


def _varied(cases: tuple[Case, ...]) -> Iterable[str]:
    for slot in INPUTS:
        values = {slot.of(case) for case in cases}
        if len(values) > 1:
            yield f"{len(values)} values of {slot.key}"


def _profile_problems(cases: tuple[Case, ...]) -> Iterable[str]:
    from fecontact.profiles.resolve import resolve_rail, resolve_wheel

    for name, reading in dict.fromkeys((case.rail, case.rail_file) for case in cases):
        yield from _problem(partial(resolve_rail, name, reading))
    for name, reading in dict.fromkeys((case.wheel, case.wheel_file) for case in cases):
        yield from _problem(partial(resolve_wheel, name, reading))


def _positions(cases: tuple[Case, ...]) -> list[Case]:
    """A case for each position of a wheel on a rail, whatever the load is."""
    where = [slot for slot in INPUTS if slot.group in ("place", "profiles")]
    return list({tuple(slot.of(case) for slot in where): case for case in cases}.values())


def _place(positions: Sequence[Case]) -> tuple[int, str | None]:
    """Place some positions, up to the first that is none; how many were tried, and what is wrong with the last one."""
    from fecontact.solving.placing import place_case

    step = max(1.0, (len(positions) - 1) / (_MOST_PLACED - 1))
    chosen = [positions[round(number * step)] for number in range(min(len(positions), _MOST_PLACED))]
    for number, case in enumerate(chosen, start=1):
        for problem in _problem(partial(place_case, case)):
            return number, problem
    return len(chosen), None


def _problem(read: Callable[[], object]) -> Iterable[str]:
    try:
        read()
    except InputError as error:
        yield str(error)
