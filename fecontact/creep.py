"""Friction and creepages of a case: what forces are evaluated with from its pressure, without solving it again."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from fecontact.errors import InputError
from fecontact.inputs.kinds import Flag, Number
from fecontact.inputs.slots import by_name, check_inputs, given

FRICTION = Number(
    label="friction coefficient",
    help="Coefficient of friction",
    high=2.0,
    inclusive=False,
    remedy="dry steel has 0.3 to 0.6, wet 0.1 to 0.3",
)
"""Of a contact, wherever one is asked for."""
_NO_UNIT = "it is relative to the rolling speed: 0.001 is 0.1 %"


def _creepage(label: str, help: str, *, unit: str = "") -> Number:
    return Number(label=label, help=help, low=-1.0, high=1.0, remedy=_NO_UNIT, unit=unit)


@by_name
@dataclass(frozen=True, kw_only=True)
class Creep:
    """Friction and creepages of the wheel against the rail, at the first touch point; None of all without friction.

    Creepages that are not given are those of a wheelset that runs along the track and turns at `speed_ratio` times the
    speed that rolls its tape circle: longitudinal from the rolling radius at the touch point, lateral from the yaw,
    spin from the contact angle.

    They are those at the touch point, and of its tangent plane all over the patch; with `curved` they follow the
    surfaces across the real patch.
    """

    friction: float | None = given(
        None, replace(FRICTION, help="Coefficient of friction; with it creep forces are evaluated")
    )
    xi: float | None = given(
        None, _creepage("creepage xi", "Longitudinal creepage, > 0 where the wheel slides forward")
    )
    eta: float | None = given(None, _creepage("creepage eta", "Lateral creepage, > 0 towards the field side"))
    spin_per_mm: float | None = given(None, _creepage("spin", "Spin about the normal of the contact", unit="1/mm"))
    speed_ratio: float = given(
        1.0,
        Number(
            label="speed ratio",
            help="Speed of rotation over that which rolls the tape circle; above 1 the wheel drives",
            high=2.0,
            remedy="a free wheel has 1, a driven one some thousandths more",
        ),
    )
    curved: bool = given(
        False,
        Flag(
            label="curved surfaces",
            help="Creepages on the real patch follow the rolling radius and contact angle of each line",
            alone=True,
        ),
    )
    force_limit: float = given(
        0.05,
        Number(
            label="limit of the creep force",
            help="Hertz holds for forces if its creep force is off by less of mu N",
            key="force_percent",
            shown_unit="%",
            factor=100.0,
            high=1.0,
            inclusive=False,
            remedy="for example 0.05 for 5 %",
        ),
    )
    largest_creepage: float = given(
        0.02,
        Number(
            label="largest creepage",
            help="Longitudinal and lateral creepage up to which forces are judged",
            low=1e-4,
            high=0.5,
            remedy="0.02 is 2 %, where most contacts slide",
        ),
    )

    def __post_init__(self) -> None:
        check_inputs(self)

    @property
    def asked(self) -> bool:
        """Whether forces are to be evaluated."""
        return self.friction is not None

    def refuse_unheard(self) -> None:
        """Refuse creepages without friction, of which nothing would come.

        Raises
        ------
        InputError
            With what is missing.
        """
        for one in () if self.asked else fields(self):
            if (value := getattr(self, one.name)) != one.default:
                label = one.metadata["input"].label
                raise InputError(
                    f"{label} is {value!r}, but no friction coefficient is given; give one too, for example 0.3"
                )
