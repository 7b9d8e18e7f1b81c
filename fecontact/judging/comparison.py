"""Comparison of the pressure of the finite elements with the Hertz ellipse, on the same points."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import zoom

from fecontact.contact.grid import Field, Rung
from fecontact.contact.patch import Patch, signed_square
from fecontact.contact_theories.approximation import Approximation
from fecontact.contact_theories.hertz import HertzContact
from fecontact.judging.measures import (
    Measures,
    deviations,
    hertz_measures,
    measures_of,
    patch_of,
)

# Points to a step of the nodes for the overlap of two patches, at most and at least, and of all of them in between:
# with 4 in place of 8 it moves by up to 1.4e-4 on 221 thousand nodes, with 2 by 2.5e-4 on 1.3 million.
_OVERLAP_REFINEMENT, _LEAST_REFINEMENT, _OVERLAP_POINTS = 8, 2, 4e6


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Hertz against the finite elements at equal normal force.

    Attributes
    ----------
    contact, ellipse
        The two contacts.
    patch
        Measures of the finite elements' patch.
    deviation
        (Hertz - FE) / FE for each of `MEASURES`, and the `MISFITS`.
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

    # cached and not computed at once: it takes hundredths of a second, and few loads of a map need it
    @cached_property
    def overlap(self) -> float:
        """Area of the intersection of the patches over the area of their union."""
        hertz = self.ellipse
        return _overlap(self.contact.even().pressure.covering(hertz.extent_x_mm, hertz.extent_y_mm), hertz)


def compare(fe: Rung, hertz: HertzContact) -> Comparison:
    """Compare a solved contact with Hertz's ellipse at the origin of its grid."""
    contact, theory, weights = Approximation.of(hertz).beside(fe)
    return Comparison(
        contact=fe,
        ellipse=hertz,
        patch=patch_of(fe),
        fe=measures_of(fe),
        hertz=hertz_measures(hertz),
        deviation=deviations(fe, hertz),
        # not by numpy.linalg.norm: the sum of BLAS depends on the number of its threads
        pressure_l2=float(
            np.sqrt((np.square(theory - contact) * weights).sum() / (np.square(contact) * weights).sum())
        ),
    )


def _overlap(pressure: Field, hertz: HertzContact) -> float:
    square = signed_square(pressure.values)[1:-1, 1:-1]
    finer = min(_OVERLAP_REFINEMENT, max(_LEAST_REFINEMENT, int(math.sqrt(_OVERLAP_POINTS / square.size))))
    count = [(n - 1) * finer + 1 for n in square.shape]
    fine = zoom(square, [c / n for c, n in zip(count, square.shape, strict=True)], order=1, grid_mode=False)
    inside = fine > 0.0
    lines = (pressure.grid.x_mm, pressure.grid.s_mm)
    xs, ss = (np.linspace(line[0], line[-1], n) for line, n in zip(lines, fine.shape, strict=True))
    ellipse = hertz.pressure_MPa(xs[:, None], ss[None, :]) > 0.0
    return float(np.count_nonzero(inside & ellipse) / np.count_nonzero(inside | ellipse))
