"""Hertz's ellipse from the coefficients of a printed table, as it is found in textbooks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fecontact.errors import InputError, check_positive

# Coefficients of Whittemore and Petrenko (1921) as in Norton's table, to four decimals, over
# Phi = arccos(abs(B - A)/(A + B)).
_TABLE_PHI_DEG = (30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0)
_TABLE_M = (2.7306, 2.1357, 1.7541, 1.4858, 1.2851, 1.1278, 1.0)
_TABLE_N = (0.4931, 0.5673, 0.6407, 0.7171, 0.7999, 0.8927, 1.0)
_TABLE_LAMBDA = (1.4526, 1.6355, 1.7735, 1.8752, 1.9453, 1.9864, 2.0)


def curvature_sums_per_mm(
    *, R1_mm: float, R1_prime_mm: float, R2_mm: float, R2_prime_mm: float, plane_angle_rad: float = 0.0
) -> tuple[float, float]:
    """Sum k1 = A + B and difference k2 = abs(B - A) of the gap coefficients in 1/mm.

    Both are computed from the principal radii.

    Parameters
    ----------
    R1_mm, R1_prime_mm
        Principal radii of body 1 in mm; concave negative, straight infinite.
    R2_mm, R2_prime_mm
        The same of body 2.
    plane_angle_rad
        Angle theta between the planes of 1/R1 and 1/R2.

    Raises
    ------
    InputError
        A radius is zero or not a number.

    Notes
    -----
    Source: Johnson (1985), section 4.1; Otero Yugat, Part I, eqs 1 and 2.
    """
    for name, radius in (("R1", R1_mm), ("R1'", R1_prime_mm), ("R2", R2_mm), ("R2'", R2_prime_mm)):
        if radius == 0.0 or math.isnan(radius):
            raise InputError(f"radius {name} is {radius!r} mm; allowed: not zero; concave is negative, straight is inf")
    if not math.isfinite(plane_angle_rad):
        raise InputError(f"plane angle is {plane_angle_rad!r} rad; allowed: finite; use 0 for aligned bodies")
    k1 = 0.5 * (1.0 / R1_mm + 1.0 / R1_prime_mm + 1.0 / R2_mm + 1.0 / R2_prime_mm)
    first, second = 1.0 / R1_mm - 1.0 / R1_prime_mm, 1.0 / R2_mm - 1.0 / R2_prime_mm
    # The two differences add like vectors at the double angle; this form of eq. 2 has no root of a rounded negative.
    double = 2.0 * plane_angle_rad
    return k1, 0.5 * math.hypot(first + second * math.cos(double), second * math.sin(double))


@dataclass(frozen=True, kw_only=True)
class TableForm:
    """Hertz contact in the symbols of the table form; here a is the longer semi-axis, wherever it points.

    Attributes
    ----------
    k1_per_mm, k2_per_mm
        A + B and abs(B - A).
    k3_per_MPa
        Mean of (1 - nu^2)/E over the two bodies, 1/(2 E*).
    phi_rad
        Table angle arccos(k2/k1).
    m, n, lambda_
        Coefficients of a, of b and of the stiffness (lambda_ is the paper's I), interpolated.
    a_mm, b_mm, p0_MPa, stiffness_N_per_mm15
        Semi-axes, peak pressure and K_H.
    """

    k1_per_mm: float
    k2_per_mm: float
    k3_per_MPa: float
    phi_rad: float
    m: float
    n: float
    lambda_: float
    a_mm: float
    b_mm: float
    p0_MPa: float
    stiffness_N_per_mm15: float


def table_form(
    *,
    R1_mm: float,
    R1_prime_mm: float,
    R2_mm: float,
    R2_prime_mm: float,
    plane_angle_rad: float = 0.0,
    normal_force_N: float,
    contact_modulus_MPa: float,
) -> TableForm:
    """Hertz contact in the table form of multibody practice, for comparison with published values.

    The equations of the source and what was found on checking each against the exact theory:
        eq. 1, k1: right, A + B; concave radii count negative (a worn-type tread is concave).
        eq. 2, k2: right, abs(B - A).
        eq. 3, k3 = (1 - nu^2)/E: right for two identical bodies; in general the mean over the two, as used here.
        eq. 4, a = m (3 pi k3 F/(2 k1))^(1/3), b likewise with n: misprint, there is no pi with this k3; as printed
            a and b are pi^(1/3) = 1.4646 times too large and p0 is pi^(2/3) = 2.145 times too small. Corrected here.
        eq. 5, K_H = 4/(3 k3) sqrt(2/(k1 lambda^3)): right with the table's lambda.
        eq. 6, F = K_H d^1.5 for d > 0, else 0: right, see `hertz_spring_force_N`.

    Parameters
    ----------
    R1_mm, R1_prime_mm, R2_mm, R2_prime_mm, plane_angle_rad
        As in `curvature_sums_per_mm`.
    normal_force_N
        Load in N, >= 0.
    contact_modulus_MPa
        E* of the pair in MPa.

    Raises
    ------
    InputError
        A value is outside its range, or the table angle is outside 30 to 90 degrees.

    Notes
    -----
    Source: Otero Yugat, Study of rail vehicle dynamics in curved tracks, Part I (UPC), eqs 1 to 5; table of Whittemore
    and Petrenko (1921) after Norton. Range of validity: table angle 30 to 90 degrees, that is b/a from 0.18 to 1;
    linear interpolation in the 10 degree steps puts up to 1.6 % on a, 0.3 % on b, 1.5 % on p0 and 0.7 % on K_H.
    `hertz_ellipse` has neither limit.
    """
    check_positive("normal force", normal_force_N, "N", "give the compressive force", zero_allowed=True)
    check_positive("contact modulus", contact_modulus_MPa, "MPa", "take it from contact_modulus_MPa of two materials")
    k1, k2 = curvature_sums_per_mm(
        R1_mm=R1_mm,
        R1_prime_mm=R1_prime_mm,
        R2_mm=R2_mm,
        R2_prime_mm=R2_prime_mm,
        plane_angle_rad=plane_angle_rad,
    )
    if k2 >= k1:
        raise InputError(
            f"curvature sums are k1 = {k1!r}, k2 = {k2!r} 1/mm; allowed: k1 > k2; the bodies do not touch in a point: "
            "check the signs of the radii (concave: negative)"
        )
    phi = math.acos(k2 / k1)
    phi_deg = math.degrees(phi)
    # Rounding of arccos must not push an entry at the table's end out of it.
    if phi_deg < _TABLE_PHI_DEG[0] - 1e-9:
        raise InputError(f"table angle is {phi_deg:.3f} degrees; allowed: 30 to 90 degrees; use hertz_ellipse instead")
    m, n, lambda_ = (float(np.interp(phi_deg, _TABLE_PHI_DEG, row)) for row in (_TABLE_M, _TABLE_N, _TABLE_LAMBDA))
    k3 = 1.0 / (2.0 * contact_modulus_MPa)
    radius = math.cbrt(3.0 * normal_force_N * k3 / (2.0 * k1))
    a, b = m * radius, n * radius
    return TableForm(
        k1_per_mm=k1,
        k2_per_mm=k2,
        k3_per_MPa=k3,
        phi_rad=phi,
        m=m,
        n=n,
        lambda_=lambda_,
        a_mm=a,
        b_mm=b,
        p0_MPa=1.5 * normal_force_N / (math.pi * a * b) if normal_force_N > 0.0 else 0.0,
        stiffness_N_per_mm15=4.0 / (3.0 * k3) * math.sqrt(2.0 / (k1 * lambda_**3)),
    )
