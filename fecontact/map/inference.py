"""Cells of a map that need no finite elements: the half-space rung, corrected by what the neighbours' bodies add to it.

From a position to the next the shape of the gap may change abruptly, which the half-space knows; what the bodies change
about it varies slowly. A cell is inferred only where this leaves no doubt about its verdict.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from fecontact.case import Case
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.measures import Measures, deviations, hertz_measures, measures_of
from fecontact.comparison.verdict import judge
from fecontact.errors import ConvergenceError, InputError
from fecontact.map.cells import Inferred
from fecontact.solving.position import expect_on_half_space

# What the fitted grids of the half-spaces leave open in peak pressure and area (16 nodes a semi-axis: 0.1 and
# 0.5 % against Hertz, and both enter a ratio).
_GRID = {"p_max_MPa": 0.003, "area_mm2": 0.01}
# An inferred verdict must stand with so many times what the inference adds to the neighbours' own uncertainty.
_SAFETY = 2.0


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """Hertz and the half-space under the true gap at one position and load."""

    hertz: Measures
    half_space: Measures


def predict(case: Case) -> Prediction | None:
    """Solve the half-space rung of a case, None where it cannot be placed or the patch leaves the surface."""
    try:
        hertz, expected = expect_on_half_space(case)
    except (InputError, ConvergenceError):
        return None
    return Prediction(hertz=hertz_measures(hertz), half_space=measures_of(expected.half_space))


def infer_loads(
    case: Case,
    loads_N: Sequence[float],
    neighbours: Sequence[Mapping[float, JudgedLoad | None]],
    neighbour_cases: Sequence[Case],
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
        one = _infer(case, load, usable, neighbour_cases)
        verdicts = {point.verdict.answer for point in usable}
        if one is None or verdicts != {one.verdict.answer} or one.verdict.answer == "UNRESOLVED":
            return None
        found[load] = one
    return found if len({one.verdict.answer for one in found.values()}) == 1 else None


def _infer(case: Case, load_N: float, points: Sequence[JudgedLoad], cases: Sequence[Case]) -> Inferred | None:
    predictions = [predict(replace(each, load_N=load_N)) for each in (case, *cases)]
    own, *others = predictions
    if own is None or any(other is None for other in others):
        return None
    measures = own.half_space.as_dict()
    solved, added = {}, {}
    for name, grid in _GRID.items():
        ratios = [
            getattr(point.comparison.fe, name) / getattr(other.half_space, name)
            for point, other in zip(points, others, strict=True)
            if other is not None
        ]
        measures[name] *= sum(ratios) / len(ratios)
        # that of the finite-element measure, from that of the deviation
        solved[name] = max(point.uncertainty[name] / abs(1.0 + point.deviation[name]) for point in points)
        added[name] = max(ratios) - min(ratios) + grid
    deviation = deviations(own.hertz, replace(own.half_space, **measures))

    def unsure(factor: float) -> dict[str, float]:
        return {name: (solved[name] + factor * added[name]) * abs(1.0 + deviation[name]) for name in _GRID}

    doubt = unsure(_SAFETY)
    return Inferred(
        deviation={name: deviation[name] for name in _GRID},
        uncertainty=unsure(1.0),
        doubt=doubt,
        verdict=judge(deviation, doubt, case.criteria),
    )
