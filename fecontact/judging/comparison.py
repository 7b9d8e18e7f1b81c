"""Comparison of the finite-element pressure with the Hertz ellipse, on equal points."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fecontact.contact.grid import Field, Rung
from fecontact.contact.patch import Patch, build_signed_square
from fecontact.contact_theories.approximation import TheoryContact
from fecontact.contact_theories.hertz import HertzContact
from fecontact.judging.measures import (
    Measures,
    compute_hertz_deviations,
    read_hertz_measures,
    read_measures,
    read_patch,
)

# Points per grid spacing for the overlap of two patches (largest and smallest number), and number of all points that
# decides between them. With 4 instead of 8 points the overlap changes by up to 1.4e-4 on 221 thousand nodes. With 2
# points it changes by 2.5e-4 on 1.3 million nodes.
_OVERLAP_REFINEMENT, _LEAST_REFINEMENT, _OVERLAP_POINTS = 8, 2, 4e6


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Hertz compared with the finite elements at equal normal force.

    Attributes
    ----------
    contact, ellipse
        Contact of the finite elements, and Hertz's ellipse.
    patch
        Patch of the finite elements.
    fe, hertz
        Measures of the finite elements, and of Hertz's ellipse.
    deviation
        (Hertz - FE) / FE for each of `MEASURES`, and the `MISFITS` (-).
    pressure_l2
        Norm of the pressure difference divided by the norm of the finite-element pressure, over both patches (-).
    """

    contact: Rung
    ellipse: HertzContact
    patch: Patch
    fe: Measures
    hertz: Measures
    deviation: Mapping[str, float]
    pressure_l2: float

    # The overlap is cached and computed only if it is read: it takes hundredths of a second, and few loads of a map
    # need it.
    @cached_property
    def overlap(self) -> float:
        """Area of the intersection of both patches divided by the area of their union (-)."""
        hertz = self.ellipse
        return _compute_overlap(self.contact.even().pressure.covering(hertz.extent_x_mm, hertz.extent_y_mm), hertz)


def compare(fe: Rung, hertz: HertzContact) -> Comparison:
    """Compare a solved contact with Hertz's ellipse at the origin of its grid.

    Parameters
    ----------
    fe
        Contact of the finite elements.
    hertz
        Hertz's ellipse under an equal normal force.

    Returns
    -------
    Comparison
        Patch, measures and deviations.
    """
    fe_pressure, hertz_pressure, weights = TheoryContact.of(hertz).beside(fe)
    return Comparison(
        contact=fe,
        ellipse=hertz,
        patch=read_patch(fe),
        fe=read_measures(fe),
        hertz=read_hertz_measures(hertz),
        deviation=compute_hertz_deviations(fe, hertz),
        # `numpy.linalg.norm` is not used: the sum of BLAS depends on the number of its threads.
        pressure_l2=float(
            np.sqrt(
                (np.square(hertz_pressure - fe_pressure) * weights).sum() / (np.square(fe_pressure) * weights).sum()
            )
        ),
    )


def _compute_overlap(pressure: Field, hertz: HertzContact) -> float:
    """Area of the intersection of patch and ellipse divided by the area of their union.

    The signed square of the pressure is interpolated on a refined grid, so that the edge of the patch is resolved
    between nodes.
    """
    from scipy.ndimage import zoom

    squared_pressure = build_signed_square(pressure.values)[1:-1, 1:-1]
    refinement = min(
        _OVERLAP_REFINEMENT, max(_LEAST_REFINEMENT, int(math.sqrt(_OVERLAP_POINTS / squared_pressure.size)))
    )
    shape = [(n - 1) * refinement + 1 for n in squared_pressure.shape]
    refined_pressure = zoom(
        squared_pressure, [c / n for c, n in zip(shape, squared_pressure.shape, strict=True)], order=1, grid_mode=False
    )
    is_in_patch = refined_pressure > 0.0
    axes = (pressure.grid.x_mm, pressure.grid.s_mm)
    x_mm, s_mm = (np.linspace(axis[0], axis[-1], n) for axis, n in zip(axes, refined_pressure.shape, strict=True))
    is_in_ellipse = hertz.pressure_MPa(x_mm[:, None], s_mm[None, :]) > 0.0
    return float(np.count_nonzero(is_in_patch & is_in_ellipse) / np.count_nonzero(is_in_patch | is_in_ellipse))
