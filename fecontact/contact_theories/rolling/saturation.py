"""Saturation of a linear creep force at mu N.

The laws are by Vermeulen and Johnson, and by Shen, Hedrick and Elkins.
"""

from __future__ import annotations

import math
from dataclasses import replace

from scipy.special import elliprd, elliprf

from fecontact.contact_theories.rolling.creepage import (
    Creepages,
    CreepForce,
    RollingEllipse,
    calculate_adhesion_area_mm2,
    calculate_power_per_speed_N,
)
from fecontact.contact_theories.rolling.kalker import calculate_linear_force
from fecontact.errors import InputError

#
# With e = |F_linear| / (mu N): |F| = mu N (e - e^2/3 + e^3/27) = mu N (1 - (1 - e/3)^3) up to e = 3, mu N beyond.
#
# Sources: Vermeulen and Johnson (1964); Shen, Hedrick and Elkins (1983); for the circle Johnson (1958). Otero Yugat,
# Part I, eq. 12, lacks e^3/27, which is a misprint: the force would be largest at e = 1.5, 0.75 mu N, and 0 at e = 3.


def saturate(e: float) -> float:
    """Force divided by mu N, for a linear force e >= 0.

    The linear force is e = |F_linear| / (mu N). Otero Yugat's eq. 12 lacks e^3/27.

    Parameters
    ----------
    e
        Linear force divided by mu N, >= 0.

    Returns
    -------
    float
        Saturated force divided by mu N, from 0 to 1.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.saturation import saturate
    >>> saturate(0.0), round(saturate(1.5), 3), saturate(3.0)
    (0.0, 0.875, 1.0)
    """
    return 1.0 - (1.0 - min(e, 3.0) / 3.0) ** 3


def vermeulen_johnson_coefficients(a_over_b: float, poisson: float) -> tuple[float, float]:
    """Creepage coefficients of Vermeulen and Johnson.

    They are c11 = pi/Phi and c22 = pi/Psi1, 9 to 27 % above Kalker's. Phi and Psi1 are complete elliptic integrals,
    here in Carlson's symmetric forms.

    Parameters
    ----------
    a_over_b
        Ratio of the semi-axis along the rolling direction to the semi-axis across.
    poisson
        Poisson's ratio.

    Returns
    -------
    c11, c22
        Coefficients without unit.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.saturation import vermeulen_johnson_coefficients
    >>> c11, c22 = vermeulen_johnson_coefficients(1.0, 0.25)
    >>> round(c11 * (1.0 - 0.75 * 0.25), 9), round(c22 * (1.0 - 0.25 * 0.25), 9)
    (4.0, 4.0)
    """
    ratio2 = min(a_over_b, 1.0 / a_over_b) ** 2
    # Integrals from 0 to pi/2, with D^2 = cos^2 + g^2 sin^2, of 1/D, of sin^2/D, of cos^2/D and of sin^2 cos^2/D^3.
    integral = float(elliprf(0.0, ratio2, 1.0))
    sine_integral = float(elliprd(0.0, ratio2, 1.0)) / 3.0
    cosine_integral = integral - sine_integral
    m = 1.0 - ratio2
    # From d/dm of the integrals of sin^2/D and of 1/D; near the circle by a series.
    if m > 1e-3:
        mixed_integral = ((2.0 - m) * integral - 2.0 * (cosine_integral + ratio2 * sine_integral)) / m**2
    else:
        mixed_integral = math.pi / 16.0 * (1.0 + 0.75 * m + 0.5859375 * m**2)
    if a_over_b <= 1.0:
        phi = cosine_integral - poisson * (sine_integral - mixed_integral)
        psi = cosine_integral - poisson * ratio2 * mixed_integral
    else:
        root = math.sqrt(ratio2)
        phi = root * (sine_integral - poisson * (sine_integral - mixed_integral))
        psi = root * (sine_integral - poisson * mixed_integral)
    return math.pi / phi, math.pi / psi


def vermeulen_johnson(contact: RollingEllipse, creepages: Creepages) -> CreepForce:
    """Saturated creep force by Vermeulen and Johnson, without spin and moment.

    The linear force has their coefficients.

    Parameters
    ----------
    contact
        Elliptic contact that rolls.
    creepages
        Creepages at its centre, without spin.

    Returns
    -------
    CreepForce
        Force, areas and power.

    Raises
    ------
    InputError
        If there is spin, which is not part of the theory.

    Notes
    -----
    Source: Vermeulen and Johnson (1964). Range of validity: no spin; use `shen_hedrick_elkins` for contacts with spin.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import Creepages, RollingEllipse
    >>> from fecontact.contact_theories.rolling.saturation import vermeulen_johnson
    >>> ellipse = RollingEllipse(a_mm=5.0, b_mm=5.0, normal_force_N=80e3, friction=0.3, shear_MPa=80e3, poisson=0.25)
    >>> vermeulen_johnson(ellipse, Creepages(xi=0.1)).fx_N
    -24000.0
    """
    if creepages.spin_per_mm != 0.0:
        raise InputError(
            f"spin is {creepages.spin_per_mm!r} 1/mm; allowed: 0, because the theory of Vermeulen and Johnson has no"
            " spin; use she, polach, fastsim or rolling_half_space"
        )
    c11, c22 = vermeulen_johnson_coefficients(contact.a_mm / contact.b_mm, contact.poisson)
    stiffness = contact.shear_MPa * contact.a_mm * contact.b_mm
    return _saturate_force(contact, creepages, -stiffness * c11 * creepages.xi, -stiffness * c22 * creepages.eta)


def shen_hedrick_elkins(contact: RollingEllipse, creepages: Creepages) -> CreepForce:
    """Saturated creep force by Shen, Hedrick and Elkins.

    It is Kalker's linear force, with its spin term in Fy, saturated. The linear moment is scaled by the factor of the
    force, as is usual. No theory supports this scaling, and the moment is inaccurate if much of the patch slips. The
    areas follow from the adhesion ellipse, which is exact only without spin.

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
    Source: Shen, Hedrick and Elkins (1983). Range of validity: small spin. The true force of large pure spin falls
    beyond its maximum; here it stays at mu N.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import Creepages, RollingEllipse
    >>> from fecontact.contact_theories.rolling.saturation import shen_hedrick_elkins
    >>> ellipse = RollingEllipse(a_mm=5.0, b_mm=5.0, normal_force_N=80e3, friction=0.3, shear_MPa=80e3, poisson=0.25)
    >>> round(shen_hedrick_elkins(ellipse, Creepages(xi=0.1)).fx_N)
    -24000
    """
    fx, fy, mz = calculate_linear_force(contact, creepages)
    force = _saturate_force(contact, creepages, fx, fy)
    linear_force_N = math.hypot(fx, fy)
    moment = mz * (force.force_N / linear_force_N if linear_force_N > 0.0 else 1.0)
    return replace(
        force, mz_Nmm=moment, power_per_speed_N=calculate_power_per_speed_N(creepages, force.fx_N, force.fy_N, moment)
    )


def _saturate_force(contact: RollingEllipse, creepages: Creepages, fx: float, fy: float) -> CreepForce:
    """Saturate a linear force (N) without a change of its direction.

    `fx` and `fy` are the linear force along and across. The result is at most mu N; its power of slip is by the given
    creepages.
    """
    linear_force_N = math.hypot(fx, fy)
    e = linear_force_N / contact.limit_N
    factor = saturate(e) / e if e > 0.0 else 1.0
    adhesion = calculate_adhesion_area_mm2(contact, e)
    return CreepForce(
        fx_N=factor * fx,
        fy_N=factor * fy,
        adhesion_area_mm2=adhesion,
        slip_area_mm2=contact.area_mm2 - adhesion,
        power_per_speed_N=calculate_power_per_speed_N(creepages, factor * fx, factor * fy, None),
    )
