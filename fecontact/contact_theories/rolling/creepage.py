"""Creepages of a rolling contact, its ellipse, and the creep force on it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import Material, RollingPair
from fecontact.errors import InputError, check_positive

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


def adhesion_area_mm2(contact: RollingEllipse, e: float) -> float:
    """Area without slip after Vermeulen and Johnson, at a linear force e = |F_linear| / (mu N).

    The area is an ellipse that touches the leading edge, with the patch's semi-axes times 1 - e/3. The traction is mu
    times Hertz's pressure, minus a similar pressure over the adhesion ellipse. The force of the latter goes with the
    cube of 1 - e/3, from which the law of saturation follows.
    """
    return max(1.0 - e / 3.0, 0.0) ** 2 * contact.area_mm2
