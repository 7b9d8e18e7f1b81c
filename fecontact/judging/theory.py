"""One theory against the finite elements and the half-space: deviations, uncertainties, verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

from fecontact.case import Case
from fecontact.contact.grid import Rung
from fecontact.contact_theories.approximation import Approximation
from fecontact.contact_theories.registry import EITHER_SIDE, THEORIES, Loaded
from fecontact.judging.lines import EXACT, Lines, Moves
from fecontact.judging.measures import MEASURES, deviations_of, values_of
from fecontact.judging.solved_load import (
    Level,
    SolvedLoad,
    elements_uncertainties,
    uncertainties,
    unmeshed_uncertainties,
)
from fecontact.judging.uncertainty import unmeshed_uncertainty
from fecontact.judging.verdict import Judgement, judge_on_lines, worst_of
from fecontact.placement.wheel_on_rail import Placement

Evidence = Literal["fe", "elements", "profiles"]
"""What a theory is held against."""


def judge_hertz(
    case: Case,
    levels: Sequence[Level],
    placement: Placement,
    lines: Lines | None,
    *,
    by: Evidence = "fe",
    refinements: int | None = None,
) -> dict[str, Judgement]:
    """Judge Hertz with the curvature of each side of the first touch point, under the finest level's normal force."""
    found = {}
    for name in EITHER_SIDE:
        made = THEORIES[name].approximate(
            Loaded(placement=placement, case=case, normal_force_N=levels[0].fe.normal_force_N)
        )
        if isinstance(made, Approximation):
            moves = EXACT if lines is None else lines.moves(name)
            found[name] = judge_theory(case, levels, made, moves, by=by, refinements=refinements)
    return found


def profiles_leave_open(case: Case, levels: Sequence[Level], placement: Placement, lines: Lines | None) -> bool:
    """Whether Hertz is open by the lines that measured points allow alone."""
    if lines is None:
        return False
    return worst_of(judge_hertz(case, levels, placement, lines, by="profiles")).answer == "UNRESOLVED"


def no_mesh_decides(
    case: Case,
    levels: Sequence[Level],
    placement: Placement,
    lines: Lines | None,
    *,
    by: Evidence = "fe",
    refinements: int = 0,
) -> bool:
    """Whether Hertz stays open by what so many finer meshes leave as it is, if their numbers are those of today's.

    These are the lines that measured points allow, reading a measure off its nodes, and the bodies' cut planes.
    """
    worst = worst_of(judge_hertz(case, levels, placement, lines, by=by, refinements=refinements))
    return worst.answer == "UNRESOLVED" and (lines is not None or not worst.unknown)


def judge_theories(
    names: Iterable[str], solved: SolvedLoad, placement: Placement, *, usable: bool
) -> tuple[dict[str, Judgement], dict[str, str]]:
    """Each theory judged, and why others have no contact."""
    loaded = Loaded(
        placement=placement,
        case=solved.case,
        normal_force_N=solved.levels[0].fe.normal_force_N,
        half_space=solved.half_space,
    )
    found, without = {}, {}
    for name in names:
        made = THEORIES[name].approximate(loaded)
        if isinstance(made, str):
            without[name] = made
        elif made is not None:
            moves = EXACT if solved.lines is None else solved.lines.moves(name)
            one = judge_theory(solved.case, solved.levels, made, moves)
            found[name] = replace(one, verdict=one.verdict.usable(usable and made.definite))
    return found, without


def judge_theory(
    case: Case,
    levels: Sequence[Level],
    made: Approximation,
    moves: Moves = EXACT,
    *,
    by: Evidence = "fe",
    refinements: int | None = None,
) -> Judgement:
    """Judge a theory against the finest level, by the criteria of a case.

    Parameters
    ----------
    moves
        How its deviations move over the lines that points of the profiles allow.
    by
        The contact on the finer nodes, that on the elements' own ones, or the finer one as if its meshes were exact, by
        the uncertainty of the profiles alone.
    refinements
        If given, the deviations are those of the finer nodes, and their uncertainty is what so many finer meshes would
        leave of it.
    """

    def read(rung: Rung) -> dict[str, float]:
        return values_of(rung, made)

    if refinements is not None:
        deviation = deviations_of(levels[0].fe, made)
        on_elements = refinements if by == "elements" else None
        left = unmeshed_uncertainties(levels[0], read, deviation, on_elements=on_elements)
        # of what meshes know less well than that finer ones may say anything
        known = {
            name: left[name] if value <= 2.0 * left[name] else 0.0
            for name, value in uncertainties(levels, read, deviation).items()
            if name in left
        }
    elif by == "elements":
        deviation = deviations_of(levels[0].on_elements, made)
        # of (Hertz - FE) / FE, from the uncertainty of the finite-element measure
        known = {
            name: value * abs(1.0 + deviation[name]) if name in MEASURES else value
            for name, value in elements_uncertainties(levels, read).items()
        }
    else:
        deviation = deviations_of(levels[0].fe, made)
        known = uncertainties(levels, read, deviation)
    slope = sum(line.largest_slope for line in case.irregularities)
    exact = by == "profiles"
    numerical = {
        name: (0.0 if exact else value) + unmeshed_uncertainty(name, deviation[name], slope=slope)
        for name, value in known.items()
    }
    verdict, uncertainty = judge_on_lines(deviation, numerical, moves, case.criteria)
    return Judgement(
        approximation=made,
        deviation=deviation,
        uncertainty=uncertainty,
        limits=case.criteria.limits,
        verdict=verdict,
        numerical=numerical,
        moves=moves,
    )


# So many times its uncertainty beyond a limit a failure is certain, whatever the elements are.
_CERTAIN = 5.0


def fails_for_certain(judged: Mapping[str, Judgement], half_space: Rung) -> bool:
    """Whether the half-space alone says on every line of measured points that Hertz fails.

    Beyond a limit by five times any uncertainty, what the bodies change being one. Exact lines are never certain:
    meshes are refined there until they show what their numbers are.
    """
    return any(_is_certain(one, half_space) for one in judged.values() if one.moves.by_line)


def _is_certain(judged: Judgement, half_space: Rung) -> bool:
    assert judged.approximation is not None
    flat = deviations_of(half_space, judged.approximation)
    unsure = {
        name: judged.numerical.get(name, math.nan) + abs(flat[name] - judged.deviation[name]) for name in judged.limits
    }
    steps = {label: judged.moves.step_uncertainty(label, judged.deviation) for label in judged.moves.by_line}
    return all(
        any(
            abs(there[name]) - limit > _CERTAIN * (unsure[name] + steps[label][name])
            for name, limit in judged.limits.items()
        )
        for label, there in judged.moves.deviations(flat).items()
    )
