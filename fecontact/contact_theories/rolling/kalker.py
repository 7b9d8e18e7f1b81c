"""Kalker's linear theory of rolling contact: creepage coefficients and the forces at vanishing creepage."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline
from fecontact.contact_theories.rolling.creepage import Creepages, CreepForce, RollingEllipse, dissipated_N

#
# Fx = -G a b c11 xi
# Fy = -G a b c22 eta - G (a b)^(3/2) c23 spin
# Mz = G (a b)^(3/2) c23 eta - G (a b)^2 c33 spin
#
# Source: Kalker (1967; 1990, Table E.3). Range of validity: infinitesimal creepage, that is no slip; compared with the
# saturated force it is 3 % too high at a tenth of mu N, 11 % at three tenths.

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
    """Kalker's coefficients of an ellipse, interpolated in his table.

    Between the rows ln c is a cubic spline over ln(a/b). Between the columns 1/c is a parabola in nu through 0, 1/4 and
    1/2, but for a > b c33 itself is this parabola. Compared with solutions without slip all coefficients are within 1 %
    for a/b from 0.15 to 8, and within 1.3 % at 0.1 and 10, as is the table. (With linear interpolation in
    min(a/b, b/a), as in some codes, c23 is 2 % higher at a/b 3 and 16 % at 6.7, c33 12 % at 0.15.)

    Raises
    ------
    InputError
        If a/b is not within 0.1 to 10, or Poisson's ratio not within 0 to 0.5, where the table ends.
    """
    # rounding may put the ratio of an ellipse of 1 by 10 mm beyond the table's last row
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

    table = tomllib.loads((files("fecontact.contact_theories.rolling") / "data" / "kalker.toml").read_text("utf-8"))[
        "rows"
    ]
    return CubicSpline(np.log(_RATIOS), np.log(np.reshape(table, (19, 4, 3))))


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
