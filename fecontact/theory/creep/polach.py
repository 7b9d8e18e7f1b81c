"""Polach's law of the creep force (Polach 1999), with the reduction factors of Polach (2005)."""

from __future__ import annotations

import math

from fecontact.errors import InputError
from fecontact.theory.creep.contact import Creepages, CreepForce, RollingEllipse, dissipated_N
from fecontact.theory.creep.kalker import coefficients_of


def polach(
    contact: RollingEllipse, creepages: Creepages, *, adhesion_factor: float = 1.0, slip_factor: float = 1.0
) -> CreepForce:
    """Polach's force of combined creepages and spin; no moment and no areas.

    Parameters
    ----------
    adhesion_factor, slip_factor
        kA and kS of Polach (2005), which lower the initial slope in the area of adhesion and of slip (wet rails);
        0 < kS <= kA <= 1.

    Raises
    ------
    InputError
        If the factors are not in their range.

    Notes
    -----
    Range of validity: combined xi and eta share one coefficient, so that the limit of small creepage is Kalker's for
    one creepage alone, and for eta with spin of the same sign, but not for the others (at xi : eta = 1 : 2, a/b = 0.25
    and nu = 0.3 Fx is 0.80 of it).
    """
    if not 0.0 < slip_factor <= adhesion_factor <= 1.0:
        raise InputError(
            f"reduction factors are kA {adhesion_factor!r} and kS {slip_factor!r}; allowed: 0 < kS <= kA <= 1;"
            " 1 and 1 for dry, clean surfaces"
        )
    xi, eta, spin = creepages.xi, creepages.eta, creepages.spin_per_mm
    # spin moves the trailing edge sideways; it counts where it adds to the lateral creepage
    moved = eta + spin * contact.a_mm
    eta_c = eta if abs(moved) <= abs(eta) else moved
    s, s_c = math.hypot(xi, eta), math.hypot(xi, eta_c)
    if s_c == 0.0:
        return CreepForce(fx_N=0.0, fy_N=0.0, power_per_speed_N=0.0)
    c, limit = coefficients_of(contact), contact.limit_N
    fx = fy = 0.0
    if s > 0.0:
        c_jj = math.hypot(c.c11 * xi / s, c.c22 * eta / s)
        eps = 0.25 * math.pi * contact.shear_MPa * contact.a_mm * contact.b_mm * c_jj * s_c / limit
        in_adhesion, in_slip = adhesion_factor * eps, slip_factor * eps
        force = -2.0 * limit / math.pi * (in_adhesion / (1.0 + in_adhesion**2) + math.atan(in_slip))
        fx, fy = force * xi / s_c, force * eta / s_c
    fy -= 9.0 / 16.0 * contact.a_mm * limit * _spin_factor(contact, c.c23, abs(eta_c)) * spin / s_c
    return CreepForce(fx_N=fx, fy_N=fy, power_per_speed_N=dissipated_N(creepages, fx, fy, None))


def _spin_factor(contact: RollingEllipse, c23: float, eta_c: float) -> float:
    """kM K of the lateral force of spin."""
    a, b = contact.a_mm, contact.b_mm
    k_m = 1.0 + 6.3 * (1.0 - math.exp(-a / b))
    eps = 8.0 / 3.0 * contact.shear_MPa * b * math.sqrt(a * b) * c23 * eta_c / (contact.limit_N * k_m)
    d = (eps**2 - 1.0) / (eps**2 + 1.0)
    # the root of 1 - d^2, without cancellation
    root = 2.0 * eps / (eps**2 + 1.0)
    return k_m * (eps * (-(d**3) / 3.0 + d**2 / 2.0 - 1.0 / 6.0) + root**3 / 3.0)
