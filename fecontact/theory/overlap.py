"""Overlapping strips: each carries its own interpenetration, and knows nothing of the others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# C of strips that know nothing of each other.
_FACTOR = 1.2


def overlap_strips(
    depth_mm: Floats, curvature_along_per_mm: Floats, contact_modulus_MPa: float
) -> tuple[Floats, Floats]:
    """Half lengths (n,) and forces over width (n,) of strips: sqrt(2 depth / curvature), and (pi/2) C E* depth.

    With C = 4/pi load and lengths are Hertz's of a circle, at half of its approach; C = 1.2 is the usual fit over the
    patches of wheels on rails. Continuous in all positions, whatever touches.

    Parameters
    ----------
    depth_mm, curvature_along_per_mm (n,)
        How deep the undeformed bodies lie in each other, > 0, and their relative curvature along the rail.

    Notes
    -----
    Class of cost: closed form. Source: the idea of a virtual penetration (Kik and Piotrowski 1996) with no reduction of
    it and no influence of one strip on another. Range of validity: approaches are half of the true ones, areas up to
    twice on slender patches; the centre of pressure is within 0.5 mm of the half-space's on S1002 and 60E1, 1.2 mm on
    the flange root.
    """
    return (
        np.sqrt(2.0 * depth_mm / curvature_along_per_mm),
        np.asarray(0.5 * np.pi * _FACTOR * contact_modulus_MPa * depth_mm),
    )
