"""Mutual checks of Hertz, the half-space and the gap, where theory requires equality."""

from __future__ import annotations

import numpy as np

from fecontact.arrays import Floats
from fecontact.judging.ladder import DISCRETE_STEP, Ladder
from fecontact.judging.measures import UNCERTAINTIES
from fecontact.placement.wheel_on_rail import Placement

REFERENCE_LIMIT = 1e-3
"""Largest `compute_reference_error` of a usable load.

Healthy loads have at most 3e-4. A fault of 1 % has 1e-2.
"""
# Step of the finite differences that give the curvatures of the gap, in mm. A larger step reaches junctions and knots
# of profiles; a smaller step is lost in rounding.
_DIFFERENCE_STEP_MM = 0.002


def compute_reference_error(ladder: Ladder, placement: Placement) -> float:
    """Largest relative error of the references against each other.

    Hertz's gap on the half-space must have the peak pressure, the semi-axes and the area of Hertz's ellipse; the
    error of each measure is divided by its declared `reference_tolerance`. The true gap must have Hertz's
    curvatures at the contact point, on its field side, since curvatures may jump there.

    Parameters
    ----------
    ladder
        Ladder of the load, with the step from Hertz to the quadratic gap.
    placement
        Wheel on rail, with the true gap.

    Returns
    -------
    float
        Relative error (-); usable up to `REFERENCE_LIMIT`.
    """
    discrete_step = ladder.steps[DISCRETE_STEP.name]
    half_space_error = max(
        abs(discrete_step[name]) / declared.reference_tolerance
        for name, declared in UNCERTAINTIES.items()
        if declared.reference_tolerance is not None
    )
    curvatures = placement.first.curvature.hessian
    curvature_error = np.abs(measure_gap_curvatures(placement) - curvatures).max() / np.abs(curvatures).max()
    return max(half_space_error, float(curvature_error))


def measure_gap_curvatures(placement: Placement) -> Floats:
    """Second derivatives of the true gap at the contact point.

    The lateral derivatives are differences towards the field side.

    Parameters
    ----------
    placement
        Wheel on rail, with the true gap.

    Returns
    -------
    ndarray of shape (2, 2)
        Second derivatives in 1/mm, along and across the rail.
    """
    step_mm = _DIFFERENCE_STEP_MM

    def gap(x: float, s: float) -> float:
        return float(placement.gap(step_mm * x, step_mm * s))

    along = gap(1, 0) - 2.0 * gap(0, 0) + gap(-1, 0)
    across = 2.0 * gap(0, 0) - 5.0 * gap(0, 1) + 4.0 * gap(0, 2) - gap(0, 3)
    mixed = 0.25 * (gap(1, 1) - gap(-1, 1) - gap(1, -1) + gap(-1, -1))
    return np.array([[along, mixed], [mixed, across]]) / step_mm**2
