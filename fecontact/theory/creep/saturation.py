"""Saturation of a linear creep force at mu N: Vermeulen and Johnson, and Shen, Hedrick and Elkins.

With e = |F_linear| / (mu N): |F| = mu N (e - e^2/3 + e^3/27) = mu N (1 - (1 - e/3)^3) up to e = 3, mu N beyond.

Sources: Vermeulen and Johnson (1964); Shen, Hedrick and Elkins (1983); for the circle Johnson (1958).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from scipy.special import elliprd, elliprf

from fecontact.errors import InputError
from fecontact.theory.creep.contact import Creepages, CreepForce, RollingEllipse, dissipated_N
from fecontact.theory.creep.kalker import linear_force


def saturation(e: float) -> float:
    """Force over mu N for a linear force e = |F_linear| / (mu N) >= 0."""
    return 1.0 - (1.0 - min(e, 3.0) / 3.0) ** 3


@dataclass(frozen=True, kw_only=True)
class AdhesionEllipse:
    """Area without slip after Vermeulen and Johnson: an ellipse similar to the patch, touching its leading edge.

    Attributes
    ----------
    a_mm, b_mm
        Its semi-axes; zero at full slip.
    centre_x_mm
        Its centre.
    """

    a_mm: float
    b_mm: float
    centre_x_mm: float

    @property
    def area_mm2(self) -> float:
        """Its area."""
        return math.pi * self.a_mm * self.b_mm


def adhesion_ellipse(contact: RollingEllipse, e: float) -> AdhesionEllipse:
    """Area without slip at a linear force e = |F_linear| / (mu N): smaller than the patch by 1 - e/3 in each direction.

    The traction is mu times Hertz's pressure less such a one over the area of adhesion, whose force is the cube of the
    ratio, from which the law of saturation follows.
    """
    size = max(1.0 - e / 3.0, 0.0)
    return AdhesionEllipse(a_mm=size * contact.a_mm, b_mm=size * contact.b_mm, centre_x_mm=(1.0 - size) * contact.a_mm)


def vermeulen_johnson_coefficients(a_over_b: float, poisson: float) -> tuple[float, float]:
    """c11 = pi/Phi and c22 = pi/Psi1 of Vermeulen and Johnson: 9 to 27 % above Kalker's.

    Their Phi and Psi1 are complete elliptic integrals, here in Carlson's symmetric forms.
    """
    ratio2 = min(a_over_b, 1.0 / a_over_b) ** 2
    # over 0 to pi/2, with D^2 = cos^2 + g^2 sin^2: sin^2/D, and sin^2 cos^2/D^3
    whole = float(elliprf(0.0, ratio2, 1.0))
    of_sine = float(elliprd(0.0, ratio2, 1.0)) / 3.0
    of_cosine = whole - of_sine
    m = 1.0 - ratio2
    # d/dm of the integral of sin^2/D and of 1/D give it; near the circle by its series
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
    """Vermeulen and Johnson (1964): saturated force without spin, with their own coefficients; no moment.

    Raises
    ------
    InputError
        With spin, of which the theory knows nothing.
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

    The moment is the linear one scaled by the same factor, as is usual; no theory stands behind that, and it is poor
    once much of the patch slips. Areas are those of the adhesion ellipse, which is exact without spin alone.

    Range of validity: small spin. The force of large pure spin falls again beyond its maximum; here it stays at mu N.
    """
    fx, fy, mz = linear_force(contact, creepages)
    force = _saturated(contact, creepages, fx, fy)
    size = math.hypot(fx, fy)
    moment = mz * (force.force_N / size if size > 0.0 else 1.0)
    return replace(force, mz_Nmm=moment, power_per_speed_N=dissipated_N(creepages, force.fx_N, force.fy_N, moment))


def _saturated(contact: RollingEllipse, creepages: Creepages, fx: float, fy: float) -> CreepForce:
    """A linear force (N) saturated in its direction."""
    size = math.hypot(fx, fy)
    e = size / contact.limit_N
    factor = saturation(e) / e if e > 0.0 else 1.0
    adhesion = adhesion_ellipse(contact, e).area_mm2
    return CreepForce(
        fx_N=factor * fx,
        fy_N=factor * fy,
        adhesion_area_mm2=adhesion,
        slip_area_mm2=contact.area_mm2 - adhesion,
        power_per_speed_N=dissipated_N(creepages, factor * fx, factor * fy, None),
    )
