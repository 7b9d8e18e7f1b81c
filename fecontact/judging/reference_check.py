"""Checks of Hertz, the half-space and the gap against each other where all three are the same."""

from __future__ import annotations

import numpy as np

from fecontact.arrays import Floats
from fecontact.judging.ladder import DISCRETE, Ladder
from fecontact.placement.wheel_on_rail import Placement

REFERENCE_LIMIT = 1e-3
"""Largest `reference_error` with which a load may be used; healthy ones have 3e-4 at most, a fault of 1 % has 1e-2."""
# Measures in which Hertz's gap on the half-space must be Hertz's ellipse, and how many times worse than the others each
# is read. Of 84 pairs of the library (10 to 160 kN, a/b 0.5 to 22, yaw 0 and 5 mrad) peak, a and b are within 6.1e-5,
# 2.1e-4 and 6.2e-5, and the area, whose edge lies between nodes, within 1.4e-3. It is within 2.4e-3 of ellipses with
# curvatures of 1 to 500 that are turned by 50 mrad, and within 7e-3 of 1 to 1000.
_READ_WORSE = {"p_max_MPa": 1.0, "a_mm": 1.0, "b_mm": 1.0, "area_mm2": 10.0}
# Curvatures are read off the gap on so many mm: farther, junctions and knots of lines come in; nearer, rounding.
_READ_OVER_MM = 0.002


def reference_error(ladder: Ladder, placement: Placement) -> float:
    """Largest error of the references against each other, relative.

    Hertz's gap on the half-space has Hertz's peak pressure, semi-axes and area (whose error counts a tenth, as it is
    read worse), and the true gap has Hertz's curvatures at the touch point (on its field side, since curvatures may
    jump there).
    """
    discrete = ladder.steps[DISCRETE.name]
    half_space = max(abs(discrete[name]) / worse for name, worse in _READ_WORSE.items())
    curvature = placement.first.curvature.hessian
    off = np.abs(curvature_of_gap(placement) - curvature).max() / np.abs(curvature).max()
    return max(half_space, float(off))


def curvature_of_gap(placement: Placement) -> Floats:
    """Second derivatives (2, 2) of the true gap at the touch point in 1/mm; across by differences to its field side."""
    h = _READ_OVER_MM

    def gap(x: float, s: float) -> float:
        return float(placement.gap(h * x, h * s))

    along = gap(1, 0) - 2.0 * gap(0, 0) + gap(-1, 0)
    across = 2.0 * gap(0, 0) - 5.0 * gap(0, 1) + 4.0 * gap(0, 2) - gap(0, 3)
    mixed = 0.25 * (gap(1, 1) - gap(-1, 1) - gap(1, -1) + gap(-1, -1))
    return np.array([[along, mixed], [mixed, across]]) / h**2
