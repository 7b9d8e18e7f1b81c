"""Kalker's linear theory of rolling contact.

It has the creepage coefficients, and the forces at vanishing creepage.
"""

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
from fecontact.contact_theories.rolling.creepage import (
    Creepages,
    CreepForce,
    RollingEllipse,
    calculate_power_per_speed_N,
)

#
# Fx = -G a b c11 xi
# Fy = -G a b c22 eta - G (a b)^(3/2) c23 spin
# Mz = G (a b)^(3/2) c23 eta - G (a b)^2 c33 spin
#
# Source: Kalker (1967; 1990, Table E.3). Range of validity: infinitesimal creepage, without slip. Compared with the
# saturated force, the linear force is 3 % too high at a tenth of mu N, and 11 % at three tenths.

_MIN_AXIS_RATIO = 0.1
_AXIS_RATIOS: Floats = np.append(np.arange(1, 11) / 10.0, 10.0 / np.arange(9, 0, -1))


@dataclass(frozen=True, kw_only=True)
class KalkerCoefficients:
    """Kalker's creepage and spin coefficients; c32 is -c23.

    Attributes
    ----------
    c11
        Coefficient of the longitudinal creepage (-).
    c22
        Coefficient of the lateral creepage (-).
    c23
        Coefficient of the spin in the lateral force (-).
    c33
        Coefficient of the spin in the spin moment (-).
    """

    c11: float
    c22: float
    c23: float
    c33: float


@dataclass(frozen=True, kw_only=True)
class LinearCreep:
    """Kalker's coefficients of an ellipse, and the factors from creepages to the linear force.

    Attributes
    ----------
    coefficients
        The coefficients, without unit.
    f11_N, f22_N
        G a b c11 and G a b c22 in N: force per longitudinal and lateral creepage.
    f23_Nmm
        G (a b)^(3/2) c23 in N mm: lateral force per spin in 1/mm, and spin moment per lateral creepage.
    f33_Nmm2
        G (a b)^2 c33 in N mm^2: spin moment per spin in 1/mm.
    """

    coefficients: KalkerCoefficients
    f11_N: float
    f22_N: float
    f23_Nmm: float
    f33_Nmm2: float


def kalker_coefficients(a_over_b: float, poisson: float) -> KalkerCoefficients:
    """Kalker's coefficients of an ellipse, interpolated in his table.

    Between the rows, ln c is a cubic spline over ln(a/b). Between the columns, 1/c is a parabola in nu through 0, 1/4
    and 1/2, except that for a > b c33 itself is this parabola. Compared with solutions without slip, all coefficients
    are within 1 % for a/b from 0.15 to 8, and within 1.3 % at 0.1 and 10, as is the table. (With linear interpolation
    in min(a/b, b/a), as in some codes, c23 is 2 % higher at a/b 3 and 16 % at 6.7, c33 12 % at 0.15.)

    Parameters
    ----------
    a_over_b
        Ratio of the semi-axis along the rolling direction to the semi-axis across, 0.1 to 10.
    poisson
        Poisson's ratio, 0 to 0.5.

    Returns
    -------
    KalkerCoefficients
        The coefficients, without unit.

    Raises
    ------
    InputError
        If a/b is not within 0.1 to 10, or Poisson's ratio is not within 0 to 0.5, where the table ends.

    Notes
    -----
    Source: Kalker (1967; 1990, Table E.3).

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.kalker import kalker_coefficients
    >>> coefficients = kalker_coefficients(1.0, 0.25)
    >>> round(coefficients.c11, 2), round(coefficients.c22, 2), round(coefficients.c23, 2)
    (4.12, 3.67, 1.47)
    """
    # Rounding may move the ratio of an ellipse of 1 by 10 mm beyond the last row of the table.
    slack = 1e-9
    if not _MIN_AXIS_RATIO * (1.0 - slack) <= a_over_b <= (1.0 + slack) / _MIN_AXIS_RATIO:
        raise InputError(
            f"a/b is {a_over_b!r}; allowed: 0.1 to 10, the range of Kalker's table; use rolling_half_space"
        )
    if not 0.0 <= poisson <= 0.5:
        raise InputError(
            f"Poisson's ratio is {poisson!r}; allowed: 0 to 0.5, the range of Kalker's table; correct the material"
        )
    weights = np.array(
        [8.0 * (poisson - 0.25) * (poisson - 0.5), -16.0 * poisson * (poisson - 0.5), 8.0 * poisson * (poisson - 0.25)]
    )
    table = np.exp(_interpolate_table()(math.log(min(max(a_over_b, _MIN_AXIS_RATIO), 1.0 / _MIN_AXIS_RATIO))))
    c11, c22, c23, c33 = (float(coefficient) for coefficient in 1.0 / ((1.0 / table) @ weights))
    if a_over_b > 1.0:
        c33 = float(table[3] @ weights)
    return KalkerCoefficients(c11=c11, c22=c22, c23=c23, c33=c33)


@cache
def _interpolate_table() -> CubicSpline:
    """Cubic spline through the logarithms of the table, over ln(a/b)."""
    from scipy.interpolate import CubicSpline

    table = tomllib.loads((files("fecontact.contact_theories.rolling") / "data" / "kalker.toml").read_text("utf-8"))[
        "rows"
    ]
    return CubicSpline(np.log(_AXIS_RATIOS), np.log(np.reshape(table, (19, 4, 3))))


def find_kalker_coefficients(contact: RollingEllipse) -> KalkerCoefficients:
    """Kalker's coefficients of a contact.

    Parameters
    ----------
    contact
        Ellipse with its semi-axes a along and b across (mm), and Poisson's ratio.

    Returns
    -------
    KalkerCoefficients
        Coefficients for the ratio a / b.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import RollingEllipse
    >>> from fecontact.contact_theories.rolling.kalker import find_kalker_coefficients
    >>> ellipse = RollingEllipse(a_mm=5.0, b_mm=5.0, normal_force_N=80e3, friction=0.3, shear_MPa=80e3, poisson=0.25)
    >>> round(find_kalker_coefficients(ellipse).c11, 2)
    4.12
    """
    return kalker_coefficients(contact.a_mm / contact.b_mm, contact.poisson)


def calculate_linear_creep(a_mm: float, b_mm: float, *, shear_MPa: float, poisson: float) -> LinearCreep:
    """Kalker's coefficients of an ellipse, and their factors of the linear force.

    Parameters
    ----------
    a_mm, b_mm
        Semi-axes along the rolling direction and across.
    shear_MPa, poisson
        Shear modulus and Poisson's ratio of the pair.

    Returns
    -------
    LinearCreep
        Coefficients and factors.

    Raises
    ------
    InputError
        As in `kalker_coefficients`.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.kalker import calculate_linear_creep
    >>> round(calculate_linear_creep(5.0, 5.0, shear_MPa=80e3, poisson=0.25).f11_N)
    8240000
    """
    coefficients, ab = kalker_coefficients(a_mm / b_mm, poisson), a_mm * b_mm
    return LinearCreep(
        coefficients=coefficients,
        f11_N=shear_MPa * ab * coefficients.c11,
        f22_N=shear_MPa * ab * coefficients.c22,
        f23_Nmm=shear_MPa * ab * math.sqrt(ab) * coefficients.c23,
        f33_Nmm2=shear_MPa * ab**2 * coefficients.c33,
    )


def kalker_linear(contact: RollingEllipse, creepages: Creepages) -> CreepForce:
    """Force by Kalker's linear theory.

    The whole patch adheres, and the force has no limit.

    Parameters
    ----------
    contact
        Elliptic contact that rolls.
    creepages
        Creepages at its centre.

    Returns
    -------
    CreepForce
        Force, moment, areas and power.

    Notes
    -----
    Source: Kalker (1967). Range of validity: infinitesimal creepage, without slip. Must not be used for finite
    creepage; use `shen_hedrick_elkins` or `fastsim` instead. Compared with the saturated force it is 3 % too high at a
    tenth of mu N, 11 % at three tenths.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import Creepages, RollingEllipse
    >>> from fecontact.contact_theories.rolling.kalker import kalker_linear
    >>> ellipse = RollingEllipse(a_mm=5.0, b_mm=5.0, normal_force_N=80e3, friction=0.3, shear_MPa=80e3, poisson=0.25)
    >>> round(kalker_linear(ellipse, Creepages(xi=1e-4)).fx_N)
    -824
    """
    fx, fy, mz = calculate_linear_force(contact, creepages)
    return CreepForce(
        fx_N=fx,
        fy_N=fy,
        mz_Nmm=mz,
        adhesion_area_mm2=contact.area_mm2,
        slip_area_mm2=0.0,
        power_per_speed_N=calculate_power_per_speed_N(creepages, fx, fy, mz),
    )


def calculate_linear_force(contact: RollingEllipse, creepages: Creepages) -> tuple[float, float, float]:
    """Force and moment of the linear theory.

    Parameters
    ----------
    contact
        Elliptic contact that rolls.
    creepages
        Creepages at its centre.

    Returns
    -------
    fx_N, fy_N, mz_Nmm
        Force along the rolling direction and across in N, and moment about the normal in N mm.
    """
    linear = calculate_linear_creep(contact.a_mm, contact.b_mm, shear_MPa=contact.shear_MPa, poisson=contact.poisson)
    xi, eta, spin = creepages.xi, creepages.eta, creepages.spin_per_mm
    return (
        -linear.f11_N * xi,
        -linear.f22_N * eta - linear.f23_Nmm * spin,
        linear.f23_Nmm * eta - linear.f33_Nmm2 * spin,
    )
