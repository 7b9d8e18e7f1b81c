"""Laws of creep forces on an ellipse: Kalker's linear theory, its saturation, and Polach's law.

Axes: x in the rolling direction, z normal and into the body on which the forces act (here the wheel), y completes a
right-handed set. Creepages are motions of this body relative to the other body, so that positive xi gives negative Fx,
positive eta negative Fy, positive spin negative Fy. Exchanging the bodies reverses creepages and forces: all laws are
odd functions. (Kalker 1990.)
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from scipy.special import elliprd, elliprf

from fecontact.arrays import Floats
from fecontact.bodies import Material, RollingPair
from fecontact.errors import InputError, check_positive

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


_LARGEST_USUAL_FRICTION = 1.5
_NO_CREEPAGE = "creepages are relative to the rolling speed: 0.001 is 0.1 %, spin is in 1/mm"


@dataclass(frozen=True, kw_only=True)
class Creepages:
    """Creepages of the wheel against the rail, divided by the rolling speed.

    Attributes
    ----------
    xi, eta
        Creepage along the rolling direction and across, without unit.
    spin_per_mm
        Relative angular velocity about the normal over the rolling speed.
    """

    xi: float = 0.0
    eta: float = 0.0
    spin_per_mm: float = 0.0

    def __post_init__(self) -> None:
        for name, value, unit in (("xi", self.xi, ""), ("eta", self.eta, ""), ("spin", self.spin_per_mm, " 1/mm")):
            if not math.isfinite(value):
                raise InputError(f"creepage {name} is {value!r}{unit}; allowed: a finite number; {_NO_CREEPAGE}")

    def at(self, x_mm: float, y_mm: float) -> Creepages:
        """Creepages of the rigid motion at another point, which differ by the spin."""
        return replace(self, xi=self.xi - self.spin_per_mm * y_mm, eta=self.eta + self.spin_per_mm * x_mm)

    def across(self, y_mm: Floats) -> tuple[Floats, Floats]:
        """Longitudinal creepage and spin (1/mm) on the lines y = const (n,)."""
        return self.xi - self.spin_per_mm * y_mm, np.full_like(y_mm, self.spin_per_mm)

    def mean(self, x_mm: Floats, y_mm: Floats, share: Floats) -> Creepages:
        """Mean over places (n,) with shares (n,) of the load: the creepages at the load's centre."""
        return self.at(float(x_mm @ share), float(y_mm @ share))


@dataclass(frozen=True, kw_only=True, eq=False)
class CurvedCreepages:
    """Creepages over surfaces that are curved across, as differences from the tangent plane at the origin.

    The slip of the rigid bodies at (x, y) is (xi(y), eta + spin(y) x), with y along the arc. For a rigid motion xi(y)
    is xi minus the integral of spin(y) from 0 to y; on a cone it is the tangent plane's.

    Attributes
    ----------
    plane
        Creepages at the origin and in its tangent plane.
    y_mm (n,)
        Places across, increasing; beyond their ends the last value is taken.
    xi_beside, spin_beside_per_mm (n,)
        Longitudinal creepage and spin at the places, minus the values of the tangent plane.
    """

    plane: Creepages
    y_mm: Floats
    xi_beside: Floats
    spin_beside_per_mm: Floats

    @property
    def eta(self) -> float:
        """Lateral creepage at x = 0, equal on all lines."""
        return self.plane.eta

    def at(self, x_mm: float, y_mm: float) -> Creepages:
        """Creepages at another point."""
        return self.mean(np.array([x_mm]), np.array([y_mm]), np.ones(1))

    def across(self, y_mm: Floats) -> tuple[Floats, Floats]:
        """Longitudinal creepage and spin (1/mm) on the lines y = const (n,)."""
        xi, spin = self.plane.across(y_mm)
        beside = [np.interp(y_mm, self.y_mm, line) for line in (self.xi_beside, self.spin_beside_per_mm)]
        return xi + beside[0], spin + beside[1]

    def mean(self, x_mm: Floats, y_mm: Floats, share: Floats) -> Creepages:
        """Mean over places (n,) with shares (n,) of the load."""
        xi, spin = self.across(y_mm)
        return Creepages(
            xi=float(xi @ share), eta=self.plane.eta + float((spin * x_mm) @ share), spin_per_mm=float(spin @ share)
        )


Motion: TypeAlias = Creepages | CurvedCreepages
"""Creepages for a theory that works line by line over a patch."""


@dataclass(frozen=True, kw_only=True)
class RollingEllipse(RollingPair):
    """An elliptic contact that rolls: semi-axes along x (a) and across (b), load, friction, elastic constants.

    `shear_MPa` and `poisson` hold for two bodies of one material, or are combined by `rolling_pair`.
    """

    a_mm: float
    b_mm: float
    normal_force_N: float

    def __post_init__(self) -> None:
        check_positive("semi-axis a", self.a_mm, "mm", "give the half-width along the rolling direction")
        check_positive("semi-axis b", self.b_mm, "mm", "give the half-width across the rolling direction")
        check_positive("normal force", self.normal_force_N, "N", "give the compressive force")
        check_positive("friction coefficient", self.friction, "N/N", "dry steel has 0.3 to 0.6, wet 0.1 to 0.3")
        # in the ranges of a material
        Material.from_shear(shear_MPa=self.shear_MPa, poisson=self.poisson)

    @classmethod
    def of(cls, pair: RollingPair, *, a_mm: float, b_mm: float, normal_force_N: float) -> RollingEllipse:
        """An ellipse of a pair."""
        constants = {"friction": pair.friction, "shear_MPa": pair.shear_MPa, "poisson": pair.poisson}
        return cls(a_mm=a_mm, b_mm=b_mm, normal_force_N=normal_force_N, **constants)

    @property
    def limit_N(self) -> float:
        """Coulomb's largest force mu N."""
        return self.friction * self.normal_force_N

    @property
    def area_mm2(self) -> float:
        """Area of the ellipse."""
        return math.pi * self.a_mm * self.b_mm


@dataclass(frozen=True, kw_only=True)
class CreepForce:
    """Forces on the wheel; None for a quantity that a law does not give.

    Attributes
    ----------
    fx_N, fy_N
        Force along the rolling direction and across, in the tangent plane.
    mz_Nmm
        Moment about the normal through the origin of the coordinates.
    adhesion_area_mm2, slip_area_mm2
        Areas without and with slip; their sum is the area of the patch.
    power_per_speed_N
        Dissipated power over the rolling speed: -(xi Fx + eta Fy + spin Mz).
    """

    fx_N: float
    fy_N: float
    mz_Nmm: float | None = None
    adhesion_area_mm2: float | None = None
    slip_area_mm2: float | None = None
    power_per_speed_N: float | None = None

    @property
    def force_N(self) -> float:
        """Size of the tangential force."""
        return math.hypot(self.fx_N, self.fy_N)

    def at(self, x_mm: float, y_mm: float) -> CreepForce:
        """The force on an ellipse with its centre at (x, y), with the moment about the origin."""
        if self.mz_Nmm is None:
            return self
        return replace(self, mz_Nmm=self.mz_Nmm + x_mm * self.fy_N - y_mm * self.fx_N)


def dissipated_N(creepages: Creepages, fx_N: float, fy_N: float, mz_Nmm: float | None) -> float | None:
    """Power over the rolling speed in N; None if there is spin and the moment is not known."""
    if mz_Nmm is None and creepages.spin_per_mm != 0.0:
        return None
    # 0.0 - avoids a negative zero
    return 0.0 - (creepages.xi * fx_N + creepages.eta * fy_N + creepages.spin_per_mm * (mz_Nmm or 0.0))


def friction_warnings(friction: float) -> tuple[str, ...]:
    """Warnings about an unusual coefficient of friction."""
    if friction <= _LARGEST_USUAL_FRICTION:
        return ()
    return (f"friction coefficient is {friction:g}: wheels on rails hardly have one above {_LARGEST_USUAL_FRICTION:g}",)


def rolling_pair(friction: float, first: Material, second: Material) -> RollingPair:
    """A pair of two materials: 2/G = 1/G1 + 1/G2, 2 nu/G = nu1/G1 + nu2/G2 (Kalker 1990).

    Range of validity: the part of the normal pressure in the tangential displacements, which vanishes for one material,
    is left out.
    """
    shear = 2.0 / (1.0 / first.shear_MPa + 1.0 / second.shear_MPa)
    poisson = 0.5 * shear * (first.poisson / first.shear_MPa + second.poisson / second.shear_MPa)
    return RollingPair(friction=friction, shear_MPa=shear, poisson=poisson)


# --- Kalker's linear theory of rolling contact: creepage coefficients and the forces at vanishing creepage.
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


# --- Saturation of a linear creep force at mu N: Vermeulen and Johnson, and Shen, Hedrick and Elkins.
#
# With e = |F_linear| / (mu N): |F| = mu N (e - e^2/3 + e^3/27) = mu N (1 - (1 - e/3)^3) up to e = 3, mu N beyond.
#
# Sources: Vermeulen and Johnson (1964); Shen, Hedrick and Elkins (1983); for the circle Johnson (1958). Otero Yugat,
# Part I, eq. 12, leaves out e^3/27, a misprint: the force would be largest at e = 1.5, 0.75 mu N, and 0 at e = 3.


def saturation(e: float) -> float:
    """Force over mu N for a linear force e = |F_linear| / (mu N) >= 0 (Otero Yugat's eq. 12 lacks its e^3/27)."""
    return 1.0 - (1.0 - min(e, 3.0) / 3.0) ** 3


def adhesion_area_mm2(contact: RollingEllipse, e: float) -> float:
    """Area without slip after Vermeulen and Johnson, at a linear force e = |F_linear| / (mu N).

    The area is an ellipse that touches the leading edge, with the patch's semi-axes times 1 - e/3. The traction is mu
    times Hertz's pressure, minus a similar pressure over the adhesion ellipse. The force of the latter goes with the
    cube of 1 - e/3, from which the law of saturation follows.
    """
    return max(1.0 - e / 3.0, 0.0) ** 2 * contact.area_mm2


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


# --- Polach's law of the creep force (Polach 1999).


def polach(contact: RollingEllipse, creepages: Creepages) -> CreepForce:
    """Polach's force of combined creepages and spin; no moment and no areas.

    Notes
    -----
    Range of validity: xi and eta share one coefficient, so that the limit of small creepage is Kalker's only for a
    single creepage, and for eta with spin of equal sign. For other combinations it is not (at xi : eta = 1 : 2,
    a/b = 0.25 and nu = 0.3 Fx is 0.80 of Kalker's).
    """
    xi, eta, spin = creepages.xi, creepages.eta, creepages.spin_per_mm
    # spin moves the trailing edge sideways; it is taken only if it adds to the lateral creepage
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
        force = -2.0 * limit / math.pi * (eps / (1.0 + eps**2) + math.atan(eps))
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
