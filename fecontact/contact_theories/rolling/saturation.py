"""Saturation of a linear creep force at mu N: Vermeulen and Johnson, and Shen, Hedrick and Elkins."""

from __future__ import annotations

import math
from dataclasses import replace

from scipy.special import elliprd, elliprf

from fecontact.contact_theories.rolling.creepage import (
    Creepages,
    CreepForce,
    RollingEllipse,
    adhesion_area_mm2,
    dissipated_N,
)
from fecontact.contact_theories.rolling.kalker import linear_force
from fecontact.errors import InputError

#
# With e = |F_linear| / (mu N): |F| = mu N (e - e^2/3 + e^3/27) = mu N (1 - (1 - e/3)^3) up to e = 3, mu N beyond.
#
# Sources: Vermeulen and Johnson (1964); Shen, Hedrick and Elkins (1983); for the circle Johnson (1958). Otero Yugat,
# Part I, eq. 12, leaves out e^3/27, a misprint: the force would be largest at e = 1.5, 0.75 mu N, and 0 at e = 3.


def saturation(e: float) -> float:
    """Force over mu N for a linear force e = |F_linear| / (mu N) >= 0 (Otero Yugat's eq. 12 lacks its e^3/27)."""
    return 1.0 - (1.0 - min(e, 3.0) / 3.0) ** 3


def vermeulen_johnson_coefficients(a_over_b: float, poisson: float) -> tuple[float, float]:
    """c11 = pi/Phi and c22 = pi/Psi1 of Vermeulen and Johnson: 9 to 27 % above Kalker's.

    Phi and Psi1 are complete elliptic integrals, here in Carlson's symmetric forms.
    """
    ratio2 = min(a_over_b, 1.0 / a_over_b) ** 2
    # integrals from 0 to pi/2, with D^2 = cos^2 + g^2 sin^2, of sin^2/D and of sin^2 cos^2/D^3
    whole = float(elliprf(0.0, ratio2, 1.0))
    of_sine = float(elliprd(0.0, ratio2, 1.0)) / 3.0
    of_cosine = whole - of_sine
    m = 1.0 - ratio2
    # from d/dm of the integrals of sin^2/D and of 1/D; near the circle by a series
    if m > 1e-3:
        mixed = ((2.0 - m) * whole - 2.0 * (of_cosine + ratio2 * of_sine)) / m**2
    else:
        mixed = math.pi / 16.0 * (1.0 + 0.75 * m + 0.5859375 * m**2)
    if a_over_b <= 1.0:
        phi = of_cosine - poisson * (of_sine - mixed)
        psi = of_cosine - poisson * ratio2 * mixed
    else:
        root = math.sqrt(ratio2)
        phi = root * (of_sine - poisson * (of_sine - mixed))
        psi = root * (of_sine - poisson * mixed)
    return math.pi / phi, math.pi / psi


def vermeulen_johnson(contact: RollingEllipse, creepages: Creepages) -> CreepForce:
    """Vermeulen and Johnson (1964): saturated force without spin, with their coefficients; no moment.

    Raises
    ------
    InputError
        If there is spin, which the theory leaves out.
    """
    if creepages.spin_per_mm != 0.0:
        raise InputError(
            f"spin is {creepages.spin_per_mm!r} 1/mm; allowed for Vermeulen and Johnson: 0, their theory has no spin;"
            " use she, polach, fastsim or rolling_half_space"
        )
    c11, c22 = vermeulen_johnson_coefficients(contact.a_mm / contact.b_mm, contact.poisson)
    stiffness = contact.shear_MPa * contact.a_mm * contact.b_mm
    return _saturated(contact, creepages, -stiffness * c11 * creepages.xi, -stiffness * c22 * creepages.eta)


def shen_hedrick_elkins(contact: RollingEllipse, creepages: Creepages) -> CreepForce:
    """Shen, Hedrick and Elkins (1983): Kalker's linear force, its spin part in Fy, saturated.

    The linear moment is scaled by the factor of the force, as is usual; no theory supports this, and the moment is poor
    once much of the patch slips. Areas follow from the adhesion ellipse, which is exact only without spin.

    Range of validity: small spin. The true force of large pure spin falls beyond its maximum; here it stays at mu N.
    """
    fx, fy, mz = linear_force(contact, creepages)
    force = _saturated(contact, creepages, fx, fy)
    size = math.hypot(fx, fy)
    moment = mz * (force.force_N / size if size > 0.0 else 1.0)
    return replace(force, mz_Nmm=moment, power_per_speed_N=dissipated_N(creepages, force.fx_N, force.fy_N, moment))


def _saturated(contact: RollingEllipse, creepages: Creepages, fx: float, fy: float) -> CreepForce:
    """A linear force (N), saturated without a change of direction."""
    size = math.hypot(fx, fy)
    e = size / contact.limit_N
    factor = saturation(e) / e if e > 0.0 else 1.0
    adhesion = adhesion_area_mm2(contact, e)
    return CreepForce(
        fx_N=factor * fx,
        fy_N=factor * fy,
        adhesion_area_mm2=adhesion,
        slip_area_mm2=contact.area_mm2 - adhesion,
        power_per_speed_N=dissipated_N(creepages, factor * fx, factor * fy, None),
    )
