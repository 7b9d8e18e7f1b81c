"""What rail, wheel and track are as values: materials, dimensions, and how large a part of each body is cut out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from fecontact.errors import InputError, check_positive
from fecontact.inputs import Number, Text, by_name, check_inputs, given

_NAME = Text(label="name of the material", help="Label in reports", options=("material-name",))
_YOUNG = Number(
    label="Young's modulus",
    help="Young's modulus",
    usual=(50e3, 500e3),
    remedy="give it in MPa, for example 210000 for steel",
)
_POISSON = Number(
    label="Poisson's ratio",
    help="Poisson's ratio",
    low=-1.0,
    high=0.5,
    inclusive=False,
    symbol="nu",
    remedy="use 0.27 to 0.30 for steel, and a value below 0.5 for a nearly incompressible material",
)
_YIELD = Number(
    label="yield stress",
    help="Uniaxial yield stress; with it the first loading of virgin steel is solved beside the elastic contact",
    usual=(100.0, 3000.0),
    remedy="leave it out (None) if it is not known",
)
_TANGENT = Number(
    label="tangent modulus",
    help="Slope of the uniaxial stress over the strain beyond the yield stress, 0 for perfectly plastic",
    high=500e3,
    remedy="steels have 0 to a tenth of Young's modulus; it counts where there is a yield stress",
)


def check_poisson(poisson: float) -> float:
    """Return Poisson's ratio if it lies in the open range (-1, 0.5), otherwise raise `InputError`."""
    _POISSON.check(poisson)
    return float(poisson)


@by_name
@dataclass(frozen=True, kw_only=True)
class Material:
    """Isotropic linear elastic material, optionally with a yield stress and linear hardening beyond it.

    Attributes
    ----------
    name
        Label used in reports.
    young_MPa, poisson
        Young's modulus E and Poisson's ratio nu.
    yield_MPa
        Uniaxial yield stress, or None if unknown: such a body stays elastic.
    tangent_MPa
        Slope of the uniaxial stress over the strain beyond it, below Young's modulus; 0 for perfectly plastic.

    Raises
    ------
    InputError
        If a constant is outside its range.

    Notes
    -----
    Range of validity: small strains, isotropy; an incompressible material (nu = 0.5) has no finite stiffness matrix.
    """

    name: str = field(metadata={"input": _NAME})
    young_MPa: float = field(metadata={"input": _YOUNG})
    poisson: float = field(metadata={"input": _POISSON})
    yield_MPa: float | None = given(None, _YIELD)
    tangent_MPa: float = given(0.0, _TANGENT)

    def __post_init__(self) -> None:
        check_inputs(self)
        if self.tangent_MPa >= self.young_MPa:
            raise InputError(
                f"tangent modulus is {self.tangent_MPa:g} MPa, not below Young's modulus of {self.young_MPa:g} MPa;"
                f" {_TANGENT.remedy}"
            )

    @classmethod
    def from_shear(cls, *, name: str, shear_MPa: float, poisson: float, yield_MPa: float | None = None) -> Material:
        """Make a material from its shear modulus G in MPa and Poisson's ratio: E = 2 G (1 + nu).

        Raises
        ------
        InputError
            A constant is outside its range.
        """
        check_positive("shear modulus", shear_MPa, "MPa", "give it in MPa, for example 82000 for steel")
        check_poisson(poisson)
        return cls(name=name, young_MPa=2.0 * shear_MPa * (1.0 + poisson), poisson=poisson, yield_MPa=yield_MPa)

    @property
    def shear_MPa(self) -> float:
        """Shear modulus G = E / (2 (1 + nu)) in MPa."""
        return self.young_MPa / (2.0 * (1.0 + self.poisson))

    @property
    def hardening_MPa(self) -> float:
        """Plastic modulus H = E Et / (E - Et) in MPa: slope of the uniaxial stress over the plastic strain."""
        return self.young_MPa * self.tangent_MPa / (self.young_MPa - self.tangent_MPa)

    @property
    def lame_MPa(self) -> float:
        """First Lame constant lambda = E nu / ((1 + nu) (1 - 2 nu)) in MPa."""
        return self.young_MPa * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))


OF_YIELDING = ("yield_MPa", "tangent_MPa")
"""Fields of a material that say nothing of an elastic contact."""
STEEL = Material(name="steel", young_MPa=210_000.0, poisson=0.3)
"""Rail and wheel steel, elastic constants only: E 210000 MPa, nu 0.3."""


def contact_modulus_MPa(first: Material, second: Material) -> float:
    """Contact modulus E* of a pair in MPa: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.

    Source: Johnson (1985), Contact Mechanics, section 4.2.
    """
    return 1.0 / ((1.0 - first.poisson**2) / first.young_MPa + (1.0 - second.poisson**2) / second.young_MPa)


@dataclass(frozen=True, kw_only=True)
class RollingPair:
    """Two bodies that roll on each other with friction: its coefficient, their shear modulus and Poisson's ratio.

    The constants are those of two bodies of one material, or of their combination
    (`rolling.laws.rolling_pair`).
    """

    friction: float
    shear_MPa: float
    poisson: float


# --- Dimensions of the track and of its wheelset, and of the bodies that are cut out of rail and wheel.

TrackSide = Literal["left", "right"]


def _cut(help: str) -> Number:
    return Number(help=help, remedy="bodies are usually cut at 60 mm")


@by_name
@dataclass(frozen=True, kw_only=True)
class BodySize:
    """Where the bodies are cut (mm): the rail's base below its crown, the sweep to each side, the rim's thickness.

    The rail is fixed at its base and held across at its ends, where it goes on: otherwise its head would roll on the
    slender web, which is a matter of the track and not of the contact. The rim is driven at its inner face.
    """

    rail_depth_mm: float = given(60.0, _cut("Depth of the rail's base below its crown"))
    rail_half_length_mm: float = given(60.0, _cut("Length of the rail to each side"))
    rim_thickness_mm: float = given(65.0, _cut("Thickness of the wheel's rim"))
    rim_half_length_mm: float = given(60.0, _cut("Length of the rim to each side"))

    def __post_init__(self) -> None:
        check_inputs(self)


@by_name
@dataclass(frozen=True, kw_only=True)
class Track:
    """Track and wheelset dimensions (mm).

    The gauge is measured `gauge_depth_mm` below the highest point of the inclined rail. `rail_crown_y_mm` puts the
    crown of the rail at a given distance from the track centre instead (for heads without a gauge face).
    """

    gauge_mm: float = given(1435.0, Number(help="Track gauge", remedy="usually 1435 mm"))
    gauge_depth_mm: float = given(14.0, Number(help="Depth of the gauge below the rail's top", remedy="usually 14 mm"))
    back_to_back_mm: float = given(
        1360.0, Number(label="back-to-back distance", help="Distance of the wheels' backs", remedy="usually 1360 mm")
    )
    tape_circle_from_back_mm: float = given(
        70.0, Number(label="tape circle", help="Distance of the tape circle from the back", remedy="usually 70 mm")
    )
    rail_crown_y_mm: float | None = given(
        None,
        Number(
            label="rail crown",
            help="Crown from the track centre, instead of the gauge",
            remedy="None places by the gauge",
        ),
    )

    def __post_init__(self) -> None:
        check_inputs(self)

    @property
    def tape_circle_y_mm(self) -> float:
        """Distance of the tape circle from the wheelset's centre."""
        return 0.5 * self.back_to_back_mm + self.tape_circle_from_back_mm
