"""The finite-element pressure beside the Hertz ellipse, on the same points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import zoom

from fecontact.comparison.approximation import mean_pressure
from fecontact.comparison.measures import Measures, deviations, hertz_measures, measures_of, patch_of
from fecontact.comparison.patch import Patch, signed_square
from fecontact.contact.grid import Field
from fecontact.contact.rung import Rung
from fecontact.theory.hertz import HertzContact

Floats = NDArray[np.float64]
_OVERLAP_REFINEMENT = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Hertz against the finite elements at equal normal force.

    Attributes
    ----------
    patch
        What the pressure of the finite elements says of its patch.
    deviation
        (Hertz - FE) / FE of each of `MEASURES`, and the `MISFITS`.
    pressure_l2
        Norm of the pressure difference over the norm of the finite-element pressure, over both patches.
    overlap
        Area of the intersection of the patches over the area of their union.
    hertz_pressure_MPa (nx, ns)
        Hertz pressure on the nodes, in the mean over their cells.
    """

    patch: Patch
    fe: Measures
    hertz: Measures
    deviation: Mapping[str, float]
    pressure_l2: float
    overlap: float
    hertz_pressure_MPa: Floats


def compare(fe: Rung, hertz: HertzContact) -> Comparison:
    """Compare a solved contact with Hertz's ellipse at the origin of its grid."""
    measured, analytic = measures_of(fe), hertz_measures(hertz)
    covering = fe.pressure.covering(hertz.extent_x_mm, hertz.extent_y_mm)
    reference = mean_pressure(covering.grid, hertz)
    return Comparison(
        patch=patch_of(fe),
        fe=measured,
        hertz=analytic,
        deviation=deviations(fe, hertz),
        pressure_l2=float(np.linalg.norm(reference - covering.values) / np.linalg.norm(covering.values)),
        overlap=_overlap(covering, hertz),
        hertz_pressure_MPa=mean_pressure(fe.grid, hertz),
    )


def _overlap(pressure: Field, hertz: HertzContact) -> float:
    square = signed_square(pressure.values)[1:-1, 1:-1]
    count = [(n - 1) * _OVERLAP_REFINEMENT + 1 for n in square.shape]
    fine = zoom(square, [c / n for c, n in zip(count, square.shape, strict=True)], order=1, grid_mode=False)
    inside = fine > 0.0
    lines = (pressure.grid.x_mm, pressure.grid.s_mm)
    xs, ss = (np.linspace(line[0], line[-1], n) for line, n in zip(lines, fine.shape, strict=True))
    ellipse = hertz.pressure_MPa(xs[:, None], ss[None, :]) > 0.0
    return float(np.count_nonzero(inside & ellipse) / np.count_nonzero(inside | ellipse))
