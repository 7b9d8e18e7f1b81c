"""Kalker's linear theory of rolling contact: creepage coefficients and the forces at vanishing creepage.

Fx = -G a b c11 xi
Fy = -G a b c22 eta - G (a b)^(3/2) c23 spin
Mz = G (a b)^(3/2) c23 eta - G (a b)^2 c33 spin

Source: Kalker (1967; 1990, Table E.3). Range of validity: infinitesimal creepage, that is no slip; the force is 3 % too
high against the saturated one at a tenth of mu N, 11 % at three tenths.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError
from fecontact.theory.creep.contact import Creepages, CreepForce, RollingEllipse, dissipated_N

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Floats = NDArray[np.float64]

# a/b 0.1 to 1.0 and then b/a 0.9 to 0.1; for each c11, c22, c23, c33 at nu = 0, 1/4, 1/2. At a/b 0.8 and nu = 1/4
# c23 is printed as 1.15 in some copies; its neighbours and a no-slip solution say 1.25.
_TABLE = """
2.51 3.31 4.85 2.51 2.52 2.53 .334 .473 .731 6.42 8.28 11.7
2.59 3.37 4.81 2.59 2.63 2.66 .483 .603 .809 3.46 4.27 5.66
2.68 3.44 4.80 2.68 2.75 2.81 .607 .715 .889 2.49 2.96 3.72
2.78 3.53 4.82 2.78 2.88 2.98 .720 .823 .977 2.02 2.32 2.77
2.88 3.62 4.83 2.88 3.01 3.14 .827 .929 1.07 1.74 1.93 2.22
2.98 3.72 4.91 2.98 3.14 3.31 .930 1.03 1.18 1.56 1.68 1.86
3.09 3.81 4.97 3.09 3.28 3.48 1.03 1.14 1.29 1.43 1.50 1.60
3.19 3.91 5.05 3.19 3.41 3.65 1.13 1.25 1.40 1.34 1.37 1.42
3.29 4.01 5.12 3.29 3.54 3.82 1.23 1.36 1.51 1.27 1.27 1.27
3.40 4.12 5.20 3.40 3.67 3.98 1.33 1.47 1.63 1.21 1.19 1.16
3.51 4.22 5.30 3.51 3.81 4.16 1.44 1.59 1.77 1.16 1.11 1.06
3.65 4.36 5.42 3.65 3.99 4.39 1.58 1.75 1.94 1.10 1.04 .954
3.82 4.54 5.58 3.82 4.21 4.67 1.76 1.95 2.18 1.05 .965 .852
4.06 4.78 5.80 4.06 4.50 5.04 2.01 2.23 2.50 1.01 .892 .751
4.37 5.10 6.11 4.37 4.90 5.56 2.35 2.62 2.96 .958 .819 .650
4.84 5.57 6.57 4.84 5.48 6.31 2.88 3.24 3.70 .912 .747 .549
5.57 6.34 7.34 5.57 6.40 7.51 3.79 4.32 5.01 .868 .674 .446
6.96 7.78 8.82 6.96 8.14 9.79 5.72 6.63 7.89 .828 .601 .341
10.7 11.7 12.9 10.7 12.8 16.0 12.2 14.6 18.0 .795 .526 .228
"""
_COEFFICIENTS: Floats = np.array([float(number) for number in _TABLE.split()]).reshape(19, 4, 3)
_SMALLEST_RATIO = 0.1
_RATIOS: Floats = np.append(np.arange(1, 11) / 10.0, 10.0 / np.arange(9, 0, -1))


@dataclass(frozen=True, kw_only=True)
class KalkerCoefficients:
    """Kalker's creepage and spin coefficients; c32 is -c23."""

    c11: float
    c22: float
    c23: float
    c33: float


def kalker_coefficients(a_over_b: float, poisson: float) -> KalkerCoefficients:
    """Kalker's coefficients of an ellipse, from his table.

    Between the rows ln c is a cubic spline over ln(a/b), between the columns 1/c a parabola in nu through 0, 1/4 and
    1/2, c33 of a > b one itself. Against solutions without slip all are within 1 % for a/b from 0.15 to 8, and within
    1.3 % at 0.1 and 10, as the table is itself. (Straight from row to row in min(a/b, b/a), as some codes go, c23 is
    2 % higher at a/b 3 and 16 % at 6.7, c33 12 % at 0.15.)

    Raises
    ------
    InputError
        If a/b is not within 0.1 to 10, or Poisson's ratio not within 0 to 0.5: the table ends there.
    """
    # an ellipse of 1 by 10 mm has a ratio that rounding may put beyond the table's last row
    slack = 1e-9
    if not _SMALLEST_RATIO * (1.0 - slack) <= a_over_b <= (1.0 + slack) / _SMALLEST_RATIO:
        raise InputError(
            f"a/b is {a_over_b!r}; allowed: 0.1 to 10, where Kalker's table ends; use the rolling half-space beyond"
        )
    if not 0.0 <= poisson <= 0.5:
        raise InputError(f"Poisson's ratio is {poisson!r}; allowed: 0 to 0.5, where Kalker's table ends")
    weights = np.array(
        [8.0 * (poisson - 0.25) * (poisson - 0.5), -16.0 * poisson * (poisson - 0.5), 8.0 * poisson * (poisson - 0.25)]
    )
    table = np.exp(_along_the_table()(math.log(min(max(a_over_b, _SMALLEST_RATIO), 1.0 / _SMALLEST_RATIO))))
    c11, c22, c23, c33 = (float(c) for c in 1.0 / ((1.0 / table) @ weights))
    if a_over_b > 1.0:
        c33 = float(table[3] @ weights)
    return KalkerCoefficients(c11=c11, c22=c22, c23=c23, c33=c33)


@cache
def _along_the_table() -> CubicSpline:
    from scipy.interpolate import CubicSpline

    return CubicSpline(np.log(_RATIOS), np.log(_COEFFICIENTS))


def coefficients_of(contact: RollingEllipse) -> KalkerCoefficients:
    """Kalker's coefficients of a contact."""
    return kalker_coefficients(contact.a_mm / contact.b_mm, contact.poisson)


def kalker_linear(contact: RollingEllipse, creepages: Creepages) -> CreepForce:
    """Kalker's linear theory: the whole patch adheres, and the force has no limit."""
    fx, fy, mz = linear_force(contact, creepages)
    return CreepForce(
        fx_N=fx,
        fy_N=fy,
        mz_Nmm=mz,
        adhesion_area_mm2=contact.area_mm2,
        slip_area_mm2=0.0,
        power_per_speed_N=dissipated_N(creepages, fx, fy, mz),
    )


def linear_force(contact: RollingEllipse, creepages: Creepages) -> tuple[float, float, float]:
    """Fx, Fy (N) and Mz (N mm) of the linear theory."""
    c, G, ab = coefficients_of(contact), contact.shear_MPa, contact.a_mm * contact.b_mm
    xi, eta, spin = creepages.xi, creepages.eta, creepages.spin_per_mm
    spin_part = G * ab * math.sqrt(ab) * c.c23
    return (
        -G * ab * c.c11 * xi,
        -G * ab * c.c22 * eta - spin_part * spin,
        spin_part * eta - G * ab**2 * c.c33 * spin,
    )
