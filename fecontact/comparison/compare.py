"""The finite-element pressure beside the Hertz ellipse, on the same points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import zoom

from fecontact.comparison.approximation import Approximation
from fecontact.comparison.measures import Measures, deviations, hertz_measures, measures_of, patch_of
from fecontact.comparison.patch import Patch, signed_square
from fecontact.contact.grid import Field
from fecontact.contact.rung import Rung
from fecontact.theory.hertz import HertzContact

_OVERLAP_REFINEMENT = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Hertz against the finite elements at equal normal force.

    Attributes
    ----------
    contact, ellipse
        What is compared.
    patch
        What the pressure of the finite elements says of its patch.
    deviation
        (Hertz - FE) / FE of each of `MEASURES`, and the `MISFITS`.
    pressure_l2
        Norm of the pressure difference over the norm of the finite-element pressure, over both patches.
    """

    contact: Rung
    ellipse: HertzContact
    patch: Patch
    fe: Measures
    hertz: Measures
    deviation: Mapping[str, float]
    pressure_l2: float

    # it takes hundredths of a second, and most loads of a map are not asked for it
    @cached_property
    def overlap(self) -> float:
        """Area of the intersection of the patches over the area of their union."""
        hertz = self.ellipse
        return _overlap(self.contact.pressure.covering(hertz.extent_x_mm, hertz.extent_y_mm), hertz)


def compare(fe: Rung, hertz: HertzContact) -> Comparison:
    """Compare a solved contact with Hertz's ellipse at the origin of its grid."""
    return Comparison(
        contact=fe,
        ellipse=hertz,
        patch=patch_of(fe),
        fe=measures_of(fe),
        hertz=hertz_measures(hertz),
        deviation=deviations(fe, hertz),
        pressure_l2=_pressure_l2(fe, hertz),
    )


def _pressure_l2(fe: Rung, hertz: HertzContact) -> float:
    contact, theory = Approximation.of(hertz).beside(fe)
    # NumPy's own sum: that of BLAS, which numpy.linalg.norm takes, depends on the number of its threads
    return float(np.sqrt(np.square(theory - contact).sum() / np.square(contact).sum()))


def _overlap(pressure: Field, hertz: HertzContact) -> float:
    square = signed_square(pressure.values)[1:-1, 1:-1]
    count = [(n - 1) * _OVERLAP_REFINEMENT + 1 for n in square.shape]
    fine = zoom(square, [c / n for c, n in zip(count, square.shape, strict=True)], order=1, grid_mode=False)
    inside = fine > 0.0
    lines = (pressure.grid.x_mm, pressure.grid.s_mm)
    xs, ss = (np.linspace(line[0], line[-1], n) for line, n in zip(lines, fine.shape, strict=True))
    ellipse = hertz.pressure_MPa(xs[:, None], ss[None, :]) > 0.0
    return float(np.count_nonzero(inside & ellipse) / np.count_nonzero(inside | ellipse))
