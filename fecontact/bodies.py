"""Materials and dimensions of rail, wheel and track.

The sizes of the bodies that are cut out of rail and wheel are here too.
"""

from __future__ import annotations

from dataclasses import MISSING, dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from fecontact.errors import InputError, check_positive
from fecontact.inputs.kinds import number_field
from fecontact.inputs.slots import input_dataclass, list_descriptions

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

# Of `STEEL`, and of the remedy for a modulus out of range.
_STEEL_YOUNG_MPA = 210_000.0


@input_dataclass
class Material:
    """Isotropic linear elastic material, optionally with a yield stress and linear hardening.

    Attributes
    ----------
    young_MPa, poisson
        Young's modulus E (MPa) and Poisson's ratio nu.
    yield_MPa
        Uniaxial yield stress (MPa), or None if unknown: a body without it stays elastic.
    tangent_MPa
        Slope of the uniaxial stress over the strain beyond the yield stress (MPa). It is below Young's modulus; 0 means
        perfectly plastic.

    Raises
    ------
    InputError
        If a constant is outside its range.

    Notes
    -----
    Range of validity: small strains, isotropy; an incompressible material (nu = 0.5) has no finite stiffness matrix.

    Examples
    --------
    >>> from fecontact.bodies import Material
    >>> round(Material(young_MPa=210_000.0, poisson=0.3).shear_MPa)
    80769
    """

    young_MPa: float = number_field(
        MISSING,
        "Young's modulus",
        label="Young's modulus",
        usual=(50e3, 500e3),
        remedy=f"give it in MPa, for example {_STEEL_YOUNG_MPA:.0f} for steel",
    )
    poisson: float = number_field(
        MISSING,
        "Poisson's ratio",
        label="Poisson's ratio",
        low=-1.0,
        high=0.5,
        inclusive=False,
        symbol="nu",
        remedy="use 0.27 to 0.30 for steel, and a value below 0.5 for a nearly incompressible material",
    )
    yield_MPa: float | None = number_field(
        None,
        "Uniaxial yield stress; if it is given, the first loading of virgin steel is solved after the elastic contact",
        label="yield stress",
        group="yield",
        usual=(100.0, 3000.0),
        remedy="leave it out (None) if it is unknown",
    )
    tangent_MPa: float = number_field(
        0.0,
        "Slope of the uniaxial stress over the strain beyond the yield stress; 0 is perfectly plastic",
        label="tangent modulus",
        group="yield",
        high=500e3,
        remedy="steels have 0 to a tenth of Young's modulus; it has an effect only with a yield stress",
    )

    def __post_init__(self) -> None:
        if self.tangent_MPa >= self.young_MPa:
            raise InputError(
                f"tangent modulus is {self.tangent_MPa:g} MPa; allowed: less than Young's modulus, which is"
                f" {self.young_MPa:g} MPa; steels have 0 to a tenth of Young's modulus"
            )

    @classmethod
    def from_shear(cls, *, shear_MPa: float, poisson: float, yield_MPa: float | None = None) -> Material:
        """Make a material from its shear modulus G and Poisson's ratio: E = 2 G (1 + nu).

        Parameters
        ----------
        shear_MPa
            Shear modulus G (MPa).
        poisson
            Poisson's ratio nu.
        yield_MPa
            Uniaxial yield stress (MPa), or None for an elastic body.

        Returns
        -------
        Material
            Material without hardening.

        Raises
        ------
        InputError
            A constant is outside its range.
        """
        check_positive("shear modulus", shear_MPa, "MPa", "give it in MPa, for example 82000 for steel")
        list_descriptions(cls)["poisson"].check(poisson)
        return cls(young_MPa=2.0 * shear_MPa * (1.0 + poisson), poisson=poisson, yield_MPa=yield_MPa)

    @property
    def shear_MPa(self) -> float:
        """Shear modulus G = E / (2 (1 + nu)) in MPa."""
        return self.young_MPa / (2.0 * (1.0 + self.poisson))

    @property
    def hardening_MPa(self) -> float:
        """Plastic modulus H = E Et / (E - Et) in MPa.

        It is the slope of the uniaxial stress over the plastic strain.
        """
        return self.young_MPa * self.tangent_MPa / (self.young_MPa - self.tangent_MPa)

    @property
    def lame_MPa(self) -> float:
        """First Lame constant in MPa: lambda = E nu / ((1 + nu) (1 - 2 nu))."""
        return self.young_MPa * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))


STEEL = Material(young_MPa=_STEEL_YOUNG_MPA, poisson=0.3)
"""Rail and wheel steel, elastic constants only: E 210000 MPa, nu 0.3."""


def combine_moduli_MPa(first: Material, second: Material) -> float:
    """Contact modulus E* of two elastic materials: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.

    Parameters
    ----------
    first, second
        Materials of the bodies, in any order.

    Returns
    -------
    float
        Contact modulus (MPa).

    Notes
    -----
    Source: Johnson (1985), Contact Mechanics, section 4.2. Range of validity: elastic half-spaces.

    Examples
    --------
    >>> from fecontact.bodies import STEEL, combine_moduli_MPa
    >>> round(combine_moduli_MPa(STEEL, STEEL))
    115385
    """
    return 1.0 / ((1.0 - first.poisson**2) / first.young_MPa + (1.0 - second.poisson**2) / second.young_MPa)


@dataclass(frozen=True, kw_only=True)
class RollingPair:
    """Two bodies that roll on each other with friction.

    The constants belong to two bodies of one material, or combine two materials
    (`contact_theories.rolling.creepage.combine_materials`).

    Attributes
    ----------
    friction
        Coefficient of friction.
    shear_MPa
        Shear modulus (MPa).
    poisson
        Poisson's ratio.
    """

    friction: float
    shear_MPa: float
    poisson: float


# --- Dimensions of the track and of its wheelset, and of the bodies that are cut out of rail and wheel.

TrackSide = Literal["left", "right"]
ROLLING_RADIUS_MM = 460.0
"""Rolling radius of a wheel without a given radius (mm)."""


_RAIL_DEPTH_MM, _RIM_MM, _HALF_LENGTH_MM = 60.0, 65.0, 60.0
_CUT_REMEDY = f"{_RAIL_DEPTH_MM:g} mm is usual"
# Largest default cuts of a small wheel, divided by its rolling radius. For R 50 mm the peak pressure differs from
# Hertz's by at most 0.04 %.
_RIM_OVER_RADIUS, _LENGTH_OVER_RADIUS = 0.6, 1.2
# At a larger angle about the axle the two ends of the rim would overlap. A thicker rim would reach the axle.
_LARGEST_RIM_ANGLE_RAD, _LARGEST_RIM_OVER_RADIUS = 3.0, 0.95


@input_dataclass
class BodySize:
    """Positions of the cuts through the bodies (mm).

    The rail is fixed at its base and held laterally at its ends, where the real rail continues. Without the lateral
    support its head would roll on the slender web, which is a property of the track and not of the contact. The rim is
    driven at its inner face.

    The defaults of rim and length are for wheels. A small wheel has a thinner and shorter rim (`at_radius`).

    Attributes
    ----------
    rail_depth_mm
        Depth of the rail's base below its crown.
    rim_thickness_mm
        Thickness of the wheel's rim.
    half_length_mm
        Length of rail and rim on each side of the contact.

    Examples
    --------
    >>> from fecontact.bodies import BodySize
    >>> BodySize().at_radius(100.0).rim_thickness_mm
    60.0
    """

    rail_depth_mm: float = number_field(
        _RAIL_DEPTH_MM, "Depth of the cut through the rail below its crown", remedy=_CUT_REMEDY
    )
    rim_thickness_mm: float = number_field(
        _RIM_MM,
        f"Thickness of the rim of the wheel; the default is at most {_RIM_OVER_RADIUS:g} times the radius",
        remedy=_CUT_REMEDY,
    )
    half_length_mm: float = number_field(
        _HALF_LENGTH_MM,
        "Length of rail and rim on each side of the contact; the default is at most"
        f" {_LENGTH_OVER_RADIUS:g} times the radius",
        remedy=_CUT_REMEDY,
    )

    def __post_init__(self) -> None:
        _check_dimensions(self, _LARGEST_BODY_MM)

    def at_radius(self, rolling_radius_mm: float) -> BodySize:
        """Cuts for a wheel with a given rolling radius.

        Default cuts are reduced for a small wheel.

        Parameters
        ----------
        rolling_radius_mm
            Rolling radius (mm).

        Returns
        -------
        BodySize
            Cuts (mm).

        Raises
        ------
        InputError
            The rim reaches the axle, or its two ends overlap.
        """
        rim, length = self.rim_thickness_mm, self.half_length_mm
        if rim == _RIM_MM:
            rim = min(rim, _RIM_OVER_RADIUS * rolling_radius_mm)
        if length == _HALF_LENGTH_MM:
            length = min(length, _LENGTH_OVER_RADIUS * rolling_radius_mm)
        for name, value, maximum_mm in (
            ("rim thickness (rim_thickness_mm)", rim, _LARGEST_RIM_OVER_RADIUS * rolling_radius_mm),
            ("half length of the rim (half_length_mm)", length, _LARGEST_RIM_ANGLE_RAD * rolling_radius_mm),
        ):
            if value > maximum_mm:
                raise InputError(
                    f"{name} is {value:g} mm; allowed: at most {maximum_mm:.3g} mm for a wheel of radius"
                    f" {rolling_radius_mm:g} mm; give a smaller value, or leave it out"
                )
        return replace(self, rim_thickness_mm=rim, half_length_mm=length)


# Beyond these dimensions positions lose the digits that a gap of a nanometre needs, and bodies need too many elements.
_LARGEST_TRACK_MM, _LARGEST_BODY_MM = 1e5, 1e4


def _check_dimensions(instance: DataclassInstance, largest_mm: float) -> None:
    """Refuse dimensions (mm) beyond a limit.

    Raises
    ------
    InputError
        If a dimension is above `largest_mm`.
    """
    for name, description in list_descriptions(type(instance)).items():
        value = getattr(instance, name)
        if value is not None and value > largest_mm:
            raise InputError(
                f"{description.label} is {value:g} mm; allowed: at most {largest_mm:g} mm; {description.remedy}"
            )


def _dimension_field(default_mm: float, help: str) -> Any:
    """Describe a dimension of the track, with its default as the usual value."""
    return number_field(default_mm, help, remedy=f"usually {default_mm:g} mm")


@input_dataclass
class Track:
    """Dimensions of the track and the wheelset (mm).

    The gauge is measured `gauge_depth_mm` below the highest point of the inclined rail. For heads without a gauge face,
    `rail_crown_y_mm` is the distance of the rail's crown from the track centre, and the gauge is not used.

    Examples
    --------
    >>> from fecontact.bodies import Track
    >>> Track().tape_circle_y_mm
    750.0
    """

    gauge_mm: float = _dimension_field(1435.0, "Track gauge")
    gauge_depth_mm: float = _dimension_field(14.0, "Depth below the top of the rail at which the gauge is measured")
    back_to_back_mm: float = _dimension_field(1360.0, "Back-to-back distance of the wheels")
    tape_circle_from_back_mm: float = _dimension_field(70.0, "Distance of the tape circle from the back of the wheel")
    rail_crown_y_mm: float | None = number_field(
        None,
        "Distance of the rail's crown from the track centre, instead of the gauge",
        label="rail crown",
        remedy="leave it out (None) to place the rail by the gauge",
    )

    def __post_init__(self) -> None:
        _check_dimensions(self, _LARGEST_TRACK_MM)

    @property
    def tape_circle_y_mm(self) -> float:
        """Distance of the tape circle from the wheelset's centre (mm)."""
        return 0.5 * self.back_to_back_mm + self.tape_circle_from_back_mm
