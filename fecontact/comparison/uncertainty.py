"""Numerical uncertainty of a measure from the same case on several meshes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

# Ratio of the element sizes of neighbouring meshes.
MESH_RATIO = 1.5
# Safety factors of the grid convergence index (Roache 1994): with an observed order, and with an assumed one.
_OBSERVED, _ASSUMED = 1.25, 3.0
_FORMAL_ORDER = 2.0
# Largest change of a measure when a cut plane of the bodies is moved out by half (studies/02_independence.py): 0.12 %.
_CUT_PLANES = 0.0015


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Relative uncertainty of the value on the finest mesh, and the observed order where three meshes give one."""

    relative: float
    observed_order: float | None


def estimate(values: Sequence[float], *, residual: float = 0.0, reading: float = 0.0) -> Estimate:
    """Uncertainty of a measure.

    Parameters
    ----------
    values
        The measure on two or more meshes, the finest first, each MESH_RATIO coarser than the one before.
    residual
        Relative residual of the contact solution.
    reading
        Relative uncertainty of reading the measure off one pressure field.

    Notes
    -----
    Two meshes: 3 |f1 - f2| / (r^2 - 1), Roache's safety factor for an assumed order. Three that converge monotonically
    at an order between 0.5 and 3: 1.25 |f1 - f2| / (r^p - 1) with the observed order p; otherwise
    as for two meshes with their whole range.
    """
    fine, coarse = values[0], values[1]
    if not all(math.isfinite(v) for v in values):
        return Estimate(relative=math.nan, observed_order=None)
    change = abs(fine - coarse)
    mesh = _ASSUMED * change / (MESH_RATIO**_FORMAL_ORDER - 1.0)
    order: float | None = None
    if len(values) > 2:
        before = values[1] - values[2]
        ratio = before / (fine - coarse) if fine != coarse else math.inf
        if ratio > 1.0 and math.isfinite(ratio):
            order = math.log(ratio) / math.log(MESH_RATIO)
        if order is not None and 0.5 <= order <= 3.0:
            mesh = _OBSERVED * change / (MESH_RATIO**order - 1.0)
        else:
            mesh = _ASSUMED * (max(values[:3]) - min(values[:3])) / (MESH_RATIO**_FORMAL_ORDER - 1.0)
    total = math.hypot(mesh / abs(fine), reading) + _CUT_PLANES + residual
    return Estimate(relative=total, observed_order=order)
