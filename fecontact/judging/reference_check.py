"""Mutual checks of Hertz, the half-space and the gap, where theory requires equality."""

from __future__ import annotations

import numpy as np

from fecontact.arrays import Floats
from fecontact.judging.ladder import DISCRETE_STEP, Ladder
from fecontact.placement.wheel_on_rail import Placement

REFERENCE_LIMIT = 1e-3
"""Largest `compute_reference_error` of a usable load.

Healthy loads have at most 3e-4. A fault of 1 % has 1e-2.
"""
# Measures in which Hertz's gap on the half-space must agree with Hertz's ellipse, and the divisor of each error. The
# divisor is larger for a measure that is read less accurately. Of 84 pairs of the library (10 to 160 kN, a/b 0.5 to 22,
# yaw 0 and 5 mrad) peak, a and b agree within 6.1e-5, 2.1e-4 and 6.2e-5. The area, which ends between nodes, agrees
# within 1.4e-3. The area agrees within 2.4e-3 for ellipses with curvatures in the ratio 1 to 500 that are turned by 50
# mrad, and within 7e-3 for the ratio 1 to 1000.
_ERROR_DIVISORS = {"p_max_MPa": 1.0, "a_mm": 1.0, "b_mm": 1.0, "area_mm2": 10.0}
# Step of the finite differences that give the curvatures of the gap, in mm. A larger step reaches junctions and knots
# of profiles; a smaller step is lost in rounding.
_DIFFERENCE_STEP_MM = 0.002


def compute_reference_error(ladder: Ladder, placement: Placement) -> float:
    """Largest relative error of the references against each other.

    Hertz's gap on the half-space must have the peak pressure, the semi-axes and the area of Hertz's ellipse; the error
    of the area is divided by 10. The true gap must have Hertz's curvatures at the contact point, on its field side,
    since curvatures may jump there.

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
    half_space_error = max(abs(discrete_step[name]) / divisor for name, divisor in _ERROR_DIVISORS.items())
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
