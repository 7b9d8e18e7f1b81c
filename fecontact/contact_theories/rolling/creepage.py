"""Creepages of a rolling contact, its ellipse, and its creep force."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import Material, RollingPair
from fecontact.errors import InputError, check_positive

_MAX_USUAL_FRICTION = 1.5
_CREEPAGE_REMEDY = "creepages are relative to the rolling speed: 0.001 is 0.1 %, spin is in 1/mm"


@dataclass(frozen=True, kw_only=True)
class Creepages:
    """Creepages of the wheel relative to the rail, divided by the rolling speed.

    Attributes
    ----------
    xi, eta
        Creepage along the rolling direction and across, without unit.
    spin_per_mm
        Relative angular velocity about the normal, divided by the rolling speed.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import Creepages
    >>> Creepages(xi=0.001, spin_per_mm=0.0001).at(0.0, 5.0)
    Creepages(xi=0.0005, eta=0.0, spin_per_mm=0.0001)
    """

    xi: float = 0.0
    eta: float = 0.0
    spin_per_mm: float = 0.0

    def __post_init__(self) -> None:
        for name, value, unit in (("xi", self.xi, ""), ("eta", self.eta, ""), ("spin", self.spin_per_mm, " 1/mm")):
            if not math.isfinite(value):
                raise InputError(f"creepage {name} is {value!r}{unit}; allowed: a finite number; {_CREEPAGE_REMEDY}")

    def at(self, x_mm: float, y_mm: float) -> Creepages:
        """Creepages of the rigid motion at a different point.

        They differ by the spin.

        Parameters
        ----------
        x_mm, y_mm
            Position along the rolling direction and across.

        Returns
        -------
        Creepages
            Creepages at this point.
        """
        return replace(self, xi=self.xi - self.spin_per_mm * y_mm, eta=self.eta + self.spin_per_mm * x_mm)

    def across(self, y_mm: Floats) -> tuple[Floats, Floats]:
        """Longitudinal creepage and spin (1/mm) on the lines y = const (n,).

        Parameters
        ----------
        y_mm : ndarray of shape (n,)
            Positions of the lines across, in mm.

        Returns
        -------
        longitudinal, spin_per_mm : ndarrays of shape (n,)
            Longitudinal creepage (-) and spin (1/mm) on each line.
        """
        return self.xi - self.spin_per_mm * y_mm, np.full_like(y_mm, self.spin_per_mm)

    def mean(self, x_mm: Floats, y_mm: Floats, share: Floats) -> Creepages:
        """Mean creepages over the positions (n,) with load shares (n,).

        For a rigid motion they are the creepages at the centre of the load.

        Parameters
        ----------
        x_mm, y_mm : ndarray of shape (n,)
            Positions along and across, in mm.
        share : ndarray of shape (n,)
            Fraction of the load at each position; the sum is 1.

        Returns
        -------
        Creepages
            Creepages at the centre of the load.
        """
        return self.at(float(x_mm @ share), float(y_mm @ share))


@dataclass(frozen=True, kw_only=True, eq=False)
class CurvedCreepages:
    """Creepages over surfaces that are curved across.

    They are stored as differences from the tangent plane at the origin. The slip of the rigid bodies at (x, y) is
    (xi(y), eta + spin(y) x), with y along the arc. For a rigid motion xi(y) is xi minus the integral of spin(y) from 0
    to y. On a cone it is the value of the tangent plane.

    Attributes
    ----------
    plane
        Creepages at the origin and in its tangent plane.
    y_mm : ndarray of shape (n,)
        Positions across, increasing. Beyond their ends the last value is used.
    xi_beside, spin_beside_per_mm : ndarray of shape (n,)
        Longitudinal creepage and spin at the positions, minus the values of the tangent plane.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.contact_theories.rolling.creepage import Creepages, CurvedCreepages
    >>> spin = np.array([0.0, 0.0, 1e-4])
    >>> curved = CurvedCreepages(
    ...     plane=Creepages(xi=1e-3), y_mm=np.array([-5.0, 0.0, 5.0]), xi_beside=np.zeros(3), spin_beside_per_mm=spin
    ... )
    >>> curved.at(0.0, 5.0).spin_per_mm, curved.at(0.0, -5.0).spin_per_mm
    (0.0001, 0.0)
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
        """Creepages at a different point.

        Parameters
        ----------
        x_mm, y_mm
            Position along and across, in mm.

        Returns
        -------
        Creepages
            Creepages of the curved surface at this position.
        """
        return self.mean(np.array([x_mm]), np.array([y_mm]), np.ones(1))

    def across(self, y_mm: Floats) -> tuple[Floats, Floats]:
        """Longitudinal creepage and spin (1/mm) on the lines y = const (n,).

        Parameters
        ----------
        y_mm : ndarray of shape (n,)
            Positions of the lines.

        Returns
        -------
        xi, spin_per_mm (n,)
            Longitudinal creepage and spin.
        """
        xi, spin = self.plane.across(y_mm)
        curvature_parts = [
            np.interp(y_mm, self.y_mm, differences) for differences in (self.xi_beside, self.spin_beside_per_mm)
        ]
        return xi + curvature_parts[0], spin + curvature_parts[1]

    def mean(self, x_mm: Floats, y_mm: Floats, share: Floats) -> Creepages:
        """Mean creepages over positions with shares of the load.

        Parameters
        ----------
        x_mm, y_mm : ndarray of shape (n,)
            Positions along the rolling direction and across.
        share : ndarray of shape (n,)
            Load shares, with the sum 1.

        Returns
        -------
        Creepages
            Mean creepages.
        """
        xi, spin = self.across(y_mm)
        return Creepages(
            xi=float(xi @ share), eta=self.plane.eta + float((spin * x_mm) @ share), spin_per_mm=float(spin @ share)
        )


CreepageField: TypeAlias = Creepages | CurvedCreepages
"""Creepages for a theory that evaluates a patch line by line."""


@dataclass(frozen=True, kw_only=True)
class RollingEllipse(RollingPair):
    """Elliptic contact that rolls.

    `shear_MPa` and `poisson` are valid for two bodies of equal material, or are combined by `combine_materials`.

    Attributes
    ----------
    a_mm, b_mm
        Semi-axes along the rolling direction and across.
    normal_force_N
        Load.
    friction, shear_MPa, poisson
        Coefficient of friction, shear modulus and Poisson's ratio of the pair.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import RollingEllipse
    >>> ellipse = RollingEllipse(
    ...     a_mm=6.0, b_mm=4.0, normal_force_N=80e3, friction=0.3, shear_MPa=82e3, poisson=0.28
    ... )
    >>> ellipse.limit_N
    24000.0
    """

    a_mm: float
    b_mm: float
    normal_force_N: float

    def __post_init__(self) -> None:
        check_positive("semi-axis a", self.a_mm, "mm", "give the half-width along the rolling direction")
        check_positive("semi-axis b", self.b_mm, "mm", "give the half-width across the rolling direction")
        check_positive("normal force", self.normal_force_N, "N", "give the compressive force")
        check_positive("friction coefficient", self.friction, "N/N", "dry steel has 0.3 to 0.6, wet 0.1 to 0.3")
        # Shear modulus and Poisson's ratio must be in the ranges of a material.
        Material.from_shear(shear_MPa=self.shear_MPa, poisson=self.poisson)

    @classmethod
    def of(cls, pair: RollingPair, *, a_mm: float, b_mm: float, normal_force_N: float) -> RollingEllipse:
        """Ellipse of a pair of bodies.

        Parameters
        ----------
        pair
            Friction and elastic constants.
        a_mm, b_mm
            Semi-axes along the rolling direction and across.
        normal_force_N
            Load.

        Returns
        -------
        RollingEllipse
            The ellipse.
        """
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
    """Forces on the wheel; None for a quantity that a law does not calculate.

    Attributes
    ----------
    fx_N, fy_N
        Force along the rolling direction and across, in the tangent plane.
    mz_Nmm
        Moment about the normal through the origin of the coordinates.
    adhesion_area_mm2, slip_area_mm2
        Areas without and with slip; their sum is the area of the patch.
    power_per_speed_N
        Dissipated power divided by the rolling speed: -(xi Fx + eta Fy + spin Mz).

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import CreepForce
    >>> force = CreepForce(fx_N=-3e3, fy_N=4e3, mz_Nmm=0.0)
    >>> force.force_N, force.at(2.0, 0.0).mz_Nmm
    (5000.0, 8000.0)
    """

    fx_N: float
    fy_N: float
    mz_Nmm: float | None = None
    adhesion_area_mm2: float | None = None
    slip_area_mm2: float | None = None
    power_per_speed_N: float | None = None

    @property
    def force_N(self) -> float:
        """Magnitude of the tangential force."""
        return math.hypot(self.fx_N, self.fy_N)

    def at(self, x_mm: float, y_mm: float) -> CreepForce:
        """Force of an ellipse at (x, y), with the moment about the origin.

        Parameters
        ----------
        x_mm, y_mm
            Centre of the ellipse.

        Returns
        -------
        CreepForce
            Force with the moment about the origin; unchanged without a moment.
        """
        if self.mz_Nmm is None:
            return self
        return replace(self, mz_Nmm=self.mz_Nmm + x_mm * self.fy_N - y_mm * self.fx_N)


def calculate_power_per_speed_N(creepages: Creepages, fx_N: float, fy_N: float, mz_Nmm: float | None) -> float | None:
    """Dissipated power divided by the rolling speed, in N.

    Parameters
    ----------
    creepages
        Creepages at the origin.
    fx_N, fy_N
        Force on the wheel along the rolling direction and across.
    mz_Nmm
        Moment on the wheel about the normal; None if the law does not calculate it.

    Returns
    -------
    float or None
        Power per speed; None if there is spin without a moment.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import Creepages, calculate_power_per_speed_N
    >>> calculate_power_per_speed_N(Creepages(xi=1e-3), -10e3, 0.0, None)
    10.0
    """
    if mz_Nmm is None and creepages.spin_per_mm != 0.0:
        return None
    # 0.0 - avoids a negative zero
    return 0.0 - (creepages.xi * fx_N + creepages.eta * fy_N + creepages.spin_per_mm * (mz_Nmm or 0.0))


def check_friction(friction: float) -> tuple[str, ...]:
    """Warnings about an unusual coefficient of friction.

    Parameters
    ----------
    friction
        Coefficient of friction.

    Returns
    -------
    tuple of str
        A warning for a coefficient above 1.5, or no warning.
    """
    if friction <= _MAX_USUAL_FRICTION:
        return ()
    return (f"friction coefficient is {friction:g}: wheels on rails rarely exceed {_MAX_USUAL_FRICTION:g}",)


def combine_materials(friction: float, first: Material, second: Material) -> RollingPair:
    """Pair of two materials with combined elastic constants.

    The constants are 2/G = 1/G1 + 1/G2 and 2 nu/G = nu1/G1 + nu2/G2 (Kalker 1990).

    Parameters
    ----------
    friction
        Coefficient of friction.
    first, second
        Materials of both bodies.

    Returns
    -------
    RollingPair
        Friction and combined constants.

    Notes
    -----
    Range of validity: the contribution of the normal pressure to the tangential displacements is left out. It vanishes
    for two bodies of equal material.

    Examples
    --------
    >>> from fecontact.bodies import Material
    >>> from fecontact.contact_theories.rolling.creepage import combine_materials
    >>> steel = Material.from_shear(shear_MPa=80e3, poisson=0.28)
    >>> round(combine_materials(0.3, steel, steel).shear_MPa)
    80000
    """
    shear = 2.0 / (1.0 / first.shear_MPa + 1.0 / second.shear_MPa)
    poisson = 0.5 * shear * (first.poisson / first.shear_MPa + second.poisson / second.shear_MPa)
    return RollingPair(friction=friction, shear_MPa=shear, poisson=poisson)


def calculate_adhesion_area_mm2(contact: RollingEllipse, e: float) -> float:
    """Area without slip by Vermeulen and Johnson.

    The area is an ellipse that touches the leading edge. Its semi-axes are the semi-axes of the patch multiplied by 1 -
    e/3. The traction is mu times Hertz's pressure, minus a similar pressure over the adhesion ellipse. The force of the
    similar pressure is proportional to the cube of 1 - e/3. The law of saturation follows from this cube.

    Parameters
    ----------
    contact
        Elliptic contact that rolls.
    e
        Linear force e = |F_linear| / (mu N).

    Returns
    -------
    float
        Area in mm^2; 0 for e of at least 3.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import RollingEllipse, calculate_adhesion_area_mm2
    >>> ellipse = RollingEllipse(a_mm=5.0, b_mm=5.0, normal_force_N=80e3, friction=0.3, shear_MPa=80e3, poisson=0.25)
    >>> calculate_adhesion_area_mm2(ellipse, 1.5) == 0.25 * ellipse.area_mm2
    True
    """
    return max(1.0 - e / 3.0, 0.0) ** 2 * contact.area_mm2
