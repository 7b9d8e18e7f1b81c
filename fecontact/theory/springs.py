"""Hertz's contact as a spring, and several of them side by side (`multi_hertz`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from fecontact.errors import check_positive

FloatArray = NDArray[np.float64]


def hertz_spring_force_N(stiffness_N_per_mm15: float, approach_mm: ArrayLike) -> FloatArray:
    """Normal force in N of Hertz's spring: K_H d^1.5 for an approach d > 0, zero where the bodies are apart.

    Parameters
    ----------
    stiffness_N_per_mm15
        K_H in N/mm^1.5, > 0.
    approach_mm
        Approach in mm, any shape; the result has the same shape.

    Raises
    ------
    InputError
        The stiffness is not positive.

    Notes
    -----
    Source: Johnson (1985), eq. 4.23 for spheres; Otero Yugat, Part I, eq. 6.
    """
    check_positive("Hertz stiffness", stiffness_N_per_mm15, "N/mm^1.5", "take it from a HertzContact")
    return np.asarray(stiffness_N_per_mm15 * np.maximum(np.asarray(approach_mm, dtype=np.float64), 0.0) ** 1.5)


def multi_hertz_approach_mm(
    stiffness_N_per_mm15: ArrayLike, *, load_N: float, gap_mm: ArrayLike, closing: ArrayLike
) -> float:
    """Rigid approach at which Hertz's springs at several touch points carry a load together.

    Parameters
    ----------
    stiffness_N_per_mm15
        K_H of each contact (n,).
    load_N
        Force along the approach.
    gap_mm
        Gap of each contact along its normal (n,) when the bodies first touch, >= 0.
    closing
        Cosine between each contact's normal and the approach (n,), > 0.

    Notes
    -----
    Each contact carries K_H (closing approach - gap)^1.5 along its normal once its gap is closed.
    """
    check_positive("load", load_N, "N", "give the wheel load")
    stiffness, gap, c = (np.asarray(v, dtype=float) for v in (stiffness_N_per_mm15, gap_mm, closing))

    def excess(approach: float) -> float:
        return float(np.sum(c * hertz_spring_force_N(1.0, c * approach - gap) * stiffness)) - load_N

    # the stiffest spring alone bounds it from above
    alone = (load_N / (c * stiffness)) ** (2.0 / 3.0)
    return float(brentq(excess, 0.0, float(np.min((alone + gap) / c)) * (1.0 + 1e-12), xtol=1e-15, rtol=1e-14))
