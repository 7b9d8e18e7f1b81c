"""Cells of a map that need no finite elements: the half-space rung, corrected by what the neighbours' bodies add to it.

From a position to the next the shape of the gap may change abruptly, which the half-space knows; what the bodies change
about it varies slowly. A cell is inferred only where this leaves no doubt about its verdict.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from fecontact.case import Case
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.ladder import BODIES
from fecontact.comparison.measures import MEASURES, deviations
from fecontact.comparison.uncertainty import reading_uncertainty
from fecontact.comparison.verdict import judge
from fecontact.errors import ConvergenceError, InputError
from fecontact.map.cells import Inferred
from fecontact.solving.measured_lines import point_noise
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

# An inferred verdict must stand with so many times what the inference adds to the neighbours' own uncertainty.
_SAFETY = 2.0


def predict(case: Case) -> dict[str, float] | None:
    """Deviations of Hertz from the half-space under the true gap.

    None where the case cannot be placed, the patch leaves the surface, or the curvature at the touch point has two
    values.
    """
    try:
        placement = place_case(case)
        if placement.first.at_junction:
            return None
        hertz, expected = expect_on_half_space(case, placement)
    except (InputError, ConvergenceError):
        return None
    return deviations(expected.half_space, hertz)


def infer_loads(
    case: Case, loads_N: Sequence[float], neighbours: Sequence[Mapping[float, JudgedLoad | None]]
) -> dict[float, Inferred] | None:
    """Infer all loads of a position from solved neighbours on both sides.

    Parameters
    ----------
    neighbours
        Their points by load (N).

    Returns
    -------
    dict or None
        None unless every load has one and the same verdict, HOLDS or FAILS, which both neighbours share: else the
        position has a load limit, or a doubt, and is worth solving.
    """
    found: dict[float, Inferred] = {}
    for load in loads_N:
        points = [neighbour.get(load) for neighbour in neighbours]
        usable = [point for point in points if point is not None and point.status == "converged"]
        if len(usable) < 2:
            return None
        one = _infer(replace(case, load_N=load), usable)
        verdicts = {point.verdict.answer for point in usable}
        if one is None or verdicts != {one.verdict.answer} or one.verdict.answer == "UNRESOLVED":
            return None
        found[load] = one
    return found if len({one.verdict.answer for one in found.values()}) == 1 else None


def _infer(case: Case, points: Sequence[JudgedLoad]) -> Inferred | None:
    half_space = predict(case)
    if half_space is None:
        return None
    of_points = _of_points(case, points)
    deviation, uncertainty, doubt = {}, {}, {}
    for name, value in half_space.items():
        reading = reading_uncertainty(name, value)
        if reading is None:
            continue
        steps = [point.ladder.steps[BODIES.name][name] for point in points]
        mean = sum(steps) / len(steps)
        solved = max(point.bodies_step_uncertainty[name] for point in points)
        added = max(steps) - min(steps) + reading
        factor = 1.0
        if name in MEASURES:
            deviation[name] = (1.0 + value) / (1.0 + mean) - 1.0
            factor = abs(1.0 + deviation[name])
        else:
            deviation[name] = value + mean
        own = of_points.get(name, 0.0)
        uncertainty[name] = factor * (solved + added) + own
        doubt[name] = factor * (solved + _SAFETY * added) + own
    return Inferred(
        deviation=deviation, uncertainty=uncertainty, doubt=doubt, verdict=judge(deviation, doubt, case.criteria)
    )


def _of_points(case: Case, points: Sequence[JudgedLoad]) -> dict[str, float]:
    """What profiles given by points leave open of each deviation here; empty where both are exact lines."""
    if all(point.solved.point_noise is None for point in points):
        return {}
    noise = point_noise(case, place_case(case))
    return {} if noise is None else noise.uncertainty()
