"""Numerical uncertainty of a measure from the same case on several meshes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from fecontact.comparison.measures import CUT_PLANES, FLOORS, MEASURES, NOISE
from fecontact.comparison.solved_load import Level
from fecontact.contact.rung import Rung

# Ratio of the element sizes of neighbouring meshes.
MESH_RATIO = 1.5
# The error that is left is this part of the last change or less; studies/12_uncertainty.py counts how often.
_OF_THE_CHANGE = 1.0
# What is the elements' and what the bodies' is told apart by a quadratic function of the place, and again by one of the
# fourth degree. On a head of 20 mm, where quick and fine meshes are 1.3 % apart in peak pressure, both differ by 0.4 %
# on meshes that differ by 0.2 %; on heads that are wide for their patch by 0.01 to 0.06 %.
_OF_THE_PARTING = 2.0


def uncertainty(
    measure: str, values: Sequence[float], *, otherwise: float | None = None, residual: float = 0.0
) -> float | None:
    """Uncertainty of a measure on the finest mesh: relative, or absolute where Hertz has no value of it.

    Parameters
    ----------
    values
        The measure on two or more meshes, the finest first, each MESH_RATIO coarser than the one before.
    otherwise
        The measure on the finest one with another idea of what is the elements' and what the bodies'.
    residual
        Relative residual of the contact solution.

    Returns
    -------
    float or None
        NaN where a value is none; None where meshes do not tell the measure's uncertainty.
    """
    reading = _reading_uncertainty(measure, values[0])
    return (
        None if reading is None else reading + step_uncertainty(measure, values, otherwise=otherwise, residual=residual)
    )


def _reading_uncertainty(measure: str, value: float) -> float | None:
    """What reading a value of a measure off its nodes leaves open, relative or absolute; None where it is not known."""
    floor, noise = FLOORS[measure], NOISE.get(measure, 0.0)
    if floor is None:
        return None
    # what is read is the root of the sum of both squares
    return floor + (noise if value <= noise else value - math.sqrt(value**2 - noise**2))


def step_uncertainty(
    measure: str, values: Sequence[float], *, otherwise: float | None = None, residual: float = 0.0
) -> float:
    """Uncertainty of the step of a measure from the half-space to the bodies, which have the same nodes.

    As `uncertainty`, but for what reading a pressure off its nodes leaves open: it is the same on both rungs.
    """
    other = values[0] if otherwise is None else otherwise
    if not all(math.isfinite(value) for value in (*values, other)):
        return math.nan
    size = abs(values[0]) if measure in MEASURES else 1.0
    change, parting = abs(values[0] - values[1]) / size, abs(values[0] - other) / size
    return _OF_THE_CHANGE * change + _OF_THE_PARTING * parting + CUT_PLANES[measure] + residual


def uncertainties(
    levels: Sequence[Level], read: Callable[[Rung], Mapping[str, float]], deviation: Mapping[str, float]
) -> dict[str, float]:
    """Uncertainty of each deviation, where meshes tell it; `read` reads all measures off a rung."""
    finest = levels[0]
    measured, otherwise = [read(level.fe) for level in levels], read(finest.otherwise)
    found = {}
    for name in deviation:
        values = [one[name] for one in measured]
        known = uncertainty(name, values, otherwise=otherwise[name], residual=finest.fe.residual)
        if known is not None:
            # of (Hertz - FE) / FE, from that of the finite-element measure
            found[name] = known * abs(1.0 + deviation[name]) if name in MEASURES else known
    return found
