"""Hertz's ellipse as functions of its ratio of curvatures alone, for many strips at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import elliprd, elliprf

from fecontact.errors import check_positive

Floats = NDArray[np.float64]

# Logarithms of axis ratios from e^-8 to e^8; linear between them the ratio is good to 1e-7.
_LARGEST_LOG_RATIO = 8.0
_ENTRIES = 8001


@dataclass(frozen=True, kw_only=True, eq=False)
class EllipseShape:
    """Shape of Hertz's ellipse on the gap A x^2 + B t^2; arrays of any one shape.

    With the semi-axes a along x and b across and the approach d: a^2 = part_x d / A, b^2 = part_t d / B, peak pressure
    E* d / (a integral). part_x + part_t = 1.

    Attributes
    ----------
    axis_ratio
        a / b.
    integral
        R_F(0, (a/b)^2, 1).
    part_x, part_t
        How much of the approach the gap takes up at the ends of both axes.
    """

    axis_ratio: Floats
    integral: Floats
    part_x: Floats
    part_t: Floats


def ellipse_shape(A_per_mm: float, B_per_mm: ArrayLike) -> EllipseShape:
    """Shape for A > 0 and any B > 0; B beyond e^16 times A or its inverse counts as that.

    Raises
    ------
    InputError
        If a coefficient is not positive.

    Notes
    -----
    Source: Hertz (1881); Johnson (1985), section 4.2, in Carlson's integrals (DLMF 19).
    """
    check_positive("gap coefficient A", A_per_mm, "1/mm", "give cos(contact angle) / (2 rolling radius)")
    b = np.asarray(B_per_mm, dtype=np.float64)
    check_positive("smallest gap coefficient B", float(b.min()), "1/mm", "Hertz needs a gap that opens across")
    log_curvatures, log_axes = _table()
    ratio = np.exp(np.interp(np.log(A_per_mm / b), log_curvatures, log_axes))
    integral = elliprf(0.0, ratio**2, 1.0)
    part_t = elliprd(0.0, ratio**2, 1.0) / (3.0 * integral)
    return EllipseShape(
        axis_ratio=np.asarray(ratio),
        integral=np.asarray(integral),
        part_x=np.asarray(1.0 - part_t),
        part_t=np.asarray(part_t),
    )


@cache
def _table() -> tuple[Floats, Floats]:
    """Logarithms of A / B, increasing, and of a / b."""
    log_axes = np.linspace(_LARGEST_LOG_RATIO, -_LARGEST_LOG_RATIO, _ENTRIES)
    square = np.exp(2.0 * log_axes)
    return np.log(elliprd(0.0, 1.0, square) / elliprd(0.0, square, 1.0)), log_axes
