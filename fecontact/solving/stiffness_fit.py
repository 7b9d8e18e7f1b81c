"""The stiffness of a contact over its load: a law fitted to the approaches of a load sweep."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.comparison.judged_load import JudgedLoad
from fecontact.errors import InputError

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class TangentStiffness:
    """Stiffness dF/dapproach (N/mm) under a normal force: of the fit with and without its bulk term, and Hertz's.

    Attributes
    ----------
    error_N_per_mm, contact_error_N_per_mm
        Standard errors of the fit, NaN for two points, which it goes through.
    deviation
        (Hertz - contact) / contact: against the stiffness without the bulk term.
    """

    normal_force_N: float
    with_bulk_N_per_mm: float
    error_N_per_mm: float
    contact_N_per_mm: float
    contact_error_N_per_mm: float
    hertz_N_per_mm: float
    deviation: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Stiffness:
    """The approach of a position over its normal force F: c1 F^(2/3) + c2 F.

    Attributes
    ----------
    c1_mm_per_N23, c2_mm_per_N
        Contact, which Hertz knows, and bulk compliance of the bodies down to their cut planes, which it does not. It is
        negative where the cut planes hold more than the bodies' shape gives away: Hertz's half-spaces reach further.
    covariance (2, 2)
        Of c1 and c2; NaN for two points.
    hertz_c1_mm_per_N23
        K_H^(-2/3).
    residual
        Root mean square of the relative error of the approach.
    """

    c1_mm_per_N23: float
    c2_mm_per_N: float
    covariance: Floats
    hertz_c1_mm_per_N23: float
    residual: float

    @property
    def c1_error(self) -> float:
        """Standard error of c1."""
        return math.sqrt(self.covariance[0, 0])

    @property
    def c2_error(self) -> float:
        """Standard error of c2."""
        return math.sqrt(self.covariance[1, 1])

    def tangent(self, normal_force_N: float) -> TangentStiffness:
        """Tangent stiffness under a normal force."""
        root = normal_force_N ** (-1.0 / 3.0)
        slope = np.array([2.0 / 3.0 * root, 1.0])
        contact = 1.5 / (root * self.c1_mm_per_N23)
        with_bulk = 1.0 / float(slope @ (self.c1_mm_per_N23, self.c2_mm_per_N))
        hertz = 1.5 / (root * self.hertz_c1_mm_per_N23)
        return TangentStiffness(
            normal_force_N=normal_force_N,
            with_bulk_N_per_mm=with_bulk,
            error_N_per_mm=with_bulk**2 * math.sqrt(slope @ self.covariance @ slope),
            contact_N_per_mm=contact,
            contact_error_N_per_mm=contact * self.c1_error / self.c1_mm_per_N23,
            hertz_N_per_mm=hertz,
            deviation=hertz / contact - 1.0,
        )


def fit_stiffness(points: Sequence[JudgedLoad]) -> Stiffness:
    """Fit the approach of the converged points by least squares of its relative error.

    Raises
    ------
    InputError
        For fewer than two loads.
    """
    usable = [point for point in points if point.usable]
    force = np.array([point.normal_force_N for point in usable])
    if np.unique(force).size < 2:
        raise InputError(f"stiffness: {np.unique(force).size} converged loads; give at least two, better four")
    approach = np.array([point.comparison.fe.approach_mm for point in usable])
    # meshes err by a part of the approach, not by a length: every load counts alike
    terms = np.column_stack([force ** (2.0 / 3.0), force]) / approach[:, None]
    scale = np.linalg.norm(terms, axis=0)
    scaled, *_ = np.linalg.lstsq(terms / scale, np.ones(force.size), rcond=None)
    error = (terms / scale) @ scaled - 1.0
    free = force.size - 2
    variance = float(error @ error) / free if free else math.nan
    covariance = variance * np.linalg.inv((terms / scale).T @ (terms / scale)) / np.outer(scale, scale)
    c1, c2 = scaled / scale
    hertz = usable[-1].hertz.stiffness_N_per_mm15 ** (-2.0 / 3.0)
    return Stiffness(
        c1_mm_per_N23=float(c1),
        c2_mm_per_N=float(c2),
        covariance=np.asarray(covariance),
        hertz_c1_mm_per_N23=hertz,
        residual=math.sqrt(float(np.mean(error**2))),
    )
