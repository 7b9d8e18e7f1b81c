"""Polach's law of the creep force (Polach 1999)."""

from __future__ import annotations

import math

from fecontact.contact_theories.rolling.creepage import (
    Creepages,
    CreepForce,
    RollingEllipse,
    calculate_power_per_speed_N,
)
from fecontact.contact_theories.rolling.kalker import find_kalker_coefficients


def polach(contact: RollingEllipse, creepages: Creepages) -> CreepForce:
    """Creep force by Polach's law for combined creepages and spin.

    The law has no moment and no areas.

    Parameters
    ----------
    contact
        Elliptic contact that rolls.
    creepages
        Creepages at its centre.

    Returns
    -------
    CreepForce
        Force, and power without spin.

    Notes
    -----
    Source: Polach (1999). Range of validity: xi and eta share a single coefficient. Therefore the limit of small
    creepage is Kalker's only for a single creepage, and for eta with spin of equal sign. For all combinations of
    creepages except these it is not (at xi : eta = 1 : 2, a/b = 0.25 and nu = 0.3 Fx is 0.80 of Kalker's).

    Examples
    --------
    The force is close to mu N for a large creepage:

    >>> from fecontact.contact_theories.rolling.creepage import Creepages, RollingEllipse
    >>> from fecontact.contact_theories.rolling.polach import polach
    >>> ellipse = RollingEllipse(a_mm=5.0, b_mm=5.0, normal_force_N=80e3, friction=0.3, shear_MPa=80e3, poisson=0.25)
    >>> round(polach(ellipse, Creepages(xi=0.1)).fx_N / ellipse.limit_N, 3)
    -1.0
    """
    xi, eta, spin = creepages.xi, creepages.eta, creepages.spin_per_mm
    # Spin moves the trailing edge sideways. It counts only if it adds to the lateral creepage.
    trailing_edge_eta = eta + spin * contact.a_mm
    eta_c = eta if abs(trailing_edge_eta) <= abs(eta) else trailing_edge_eta
    s, s_c = math.hypot(xi, eta), math.hypot(xi, eta_c)
    if s_c == 0.0:
        return CreepForce(fx_N=0.0, fy_N=0.0, power_per_speed_N=0.0)
    coefficients, limit = find_kalker_coefficients(contact), contact.limit_N
    fx = fy = 0.0
    if s > 0.0:
        c_jj = math.hypot(coefficients.c11 * xi / s, coefficients.c22 * eta / s)
        eps = 0.25 * math.pi * contact.shear_MPa * contact.a_mm * contact.b_mm * c_jj * s_c / limit
        force = -2.0 * limit / math.pi * (eps / (1.0 + eps**2) + math.atan(eps))
        fx, fy = force * xi / s_c, force * eta / s_c
    fy -= 9.0 / 16.0 * contact.a_mm * limit * _spin_factor(contact, coefficients.c23, abs(eta_c)) * spin / s_c
    return CreepForce(fx_N=fx, fy_N=fy, power_per_speed_N=calculate_power_per_speed_N(creepages, fx, fy, None))


def _spin_factor(contact: RollingEllipse, c23: float, eta_c: float) -> float:
    """Factor kM K of the lateral force of spin (-).

    `c23` is Kalker's coefficient of spin, and `eta_c` the lateral creepage with the effect of spin (-).
    """
    a, b = contact.a_mm, contact.b_mm
    k_m = 1.0 + 6.3 * (1.0 - math.exp(-a / b))
    eps = 8.0 / 3.0 * contact.shear_MPa * b * math.sqrt(a * b) * c23 * eta_c / (contact.limit_N * k_m)
    d = (eps**2 - 1.0) / (eps**2 + 1.0)
    # The root of 1 - d^2, without cancellation.
    root = 2.0 * eps / (eps**2 + 1.0)
    return k_m * (eps * (-(d**3) / 3.0 + d**2 / 2.0 - 1.0 / 6.0) + root**3 / 3.0)
