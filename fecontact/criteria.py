"""By what a solved case is judged: limits of measures, friction and creepages; no solution depends on it."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

from fecontact.errors import InputError
from fecontact.feature_registry import places
from fecontact.inputs.kinds import Number, choice, flag, given, number
from fecontact.inputs.slots import inputs


def _limit(default: float, measure: str, help: str, key: str) -> Any:
    percent = key.endswith("_percent")
    limit = Number(
        label=f"limit of {measure}",
        help=f"Hertz holds {help}",
        key=key,
        shown_unit="%" if percent else "",
        high=1.0,
        inclusive=False,
        remedy="for example 0.05 for 5 %" if percent else "for example 0.15",
    )
    return given(default, limit, measure=measure)


_SETS = {
    "strength": ("p_max",),
    "patch": ("area", "a", "b", "centre"),
    "all": ("p_max", "area", "a", "b", "centre", "valley", "separate", "misplaced"),
}


@inputs
class Criteria:
    """How far Hertz may be off the finite elements and still hold, and by which measures it is judged.

    Limits of peak pressure, area and half-widths are relative. The limit of the centre of pressure is in Hertz's
    half-width b. The limit of the valley between two lobes is a part of the peak; the limits of the load on separate
    patches and of the misplaced load are parts of the load (`judging.measures.Misfit`).

    `judged_by` names measures by the fields here, or sets of them: `strength` for the stress below the surface, which
    follows the peak; `patch` for creep forces and wear, which take the ellipse's axes and its place; `all` for whoever
    takes the ellipse for the contact.

    `theories_in_range` leaves theories that are out of their own range out of what may be the cheapest that holds.
    """

    p_max: float = _limit(0.05, "p_max_MPa", "if its peak pressure is off by less", "p_max_percent")
    area: float = _limit(0.10, "area_mm2", "if its patch area is off by less", "area_percent")
    a: float = _limit(0.10, "a_mm", "if its half-width along x is off by less", "a_percent")
    b: float = _limit(0.10, "b_mm", "if its half-width across is off by less", "b_percent")
    centre: float = _limit(
        0.15, "centre_over_b", "if the centre of pressure is off by less of its half-width b", "centre_over_b"
    )
    valley: float = _limit(
        0.10, "valley", "if the pressure falls by less of its peak between two lobes", "valley_percent"
    )
    separate: float = _limit(
        0.001, "separate_load", "if separate patches carry less of the load", "separate_load_percent"
    )
    misplaced: float = _limit(
        0.10, "misplaced_load", "if less of the load is elsewhere than Hertz predicts", "misplaced_load_percent"
    )
    judged_by: tuple[str, ...] = choice(
        ("all",),
        f"Measures that decide, or sets of them (patch: {', '.join(_SETS['patch'])}; strength: p_max)",
        (*_SETS, *_SETS["all"]),
        domain=f"sets {', '.join(_SETS)}; measures {', '.join(_SETS['all'])}; joined by commas",
        each=True,
    )
    theories_in_range: bool = flag(
        "Name no theory that is out of its own range as the cheapest that holds; by default it counts, marked as out of"
        " range, since its numbers are held against the finite elements at this very contact"
    )

    def __post_init__(self) -> None:
        # JSON has lists alone
        object.__setattr__(self, "judged_by", tuple(self.judged_by))

    @property
    def limits(self) -> dict[str, float]:
        """Limits by the name of the measure, of those that decide."""
        chosen = {name for judged in self.judged_by for name in _SETS.get(judged, (judged,))}
        return {
            limit.metadata["measure"]: getattr(self, limit.name)
            for limit in fields(self)
            if "measure" in limit.metadata and limit.name in chosen
        }


# --- Friction and creepages of a case: what forces are evaluated with from its pressure, without solving it again.

FRICTION = Number(
    label="friction coefficient",
    help="Coefficient of friction",
    high=2.0,
    inclusive=False,
    remedy="dry steel has 0.3 to 0.6, wet 0.1 to 0.3",
)
"""Of a contact, wherever one is asked for."""


def _creepage(help: str, label: str) -> Any:
    remedy = "it is relative to the rolling speed: 0.001 is 0.1 %"
    return number(None, help, label=label, low=-1.0, high=1.0, remedy=remedy)


@inputs
class Creep:
    """Friction and creepages of the wheel against the rail, at the first touch point; None of all without friction.

    Creepages not given are computed for a wheelset that runs along the track and turns at `speed_ratio` times the
    speed that rolls its tape circle: longitudinal from the rolling radius at the touch point, lateral from the yaw,
    spin from the contact angle.

    They are those at the touch point, and of its tangent plane all over the patch; with `curved` they follow the
    surfaces across the real patch.
    """

    friction: float | None = given(
        None, replace(FRICTION, help="Coefficient of friction; with it creep forces are evaluated")
    )
    xi: float | None = _creepage("Longitudinal creepage, > 0 where the wheel slides forward", "creepage xi")
    eta: float | None = _creepage("Lateral creepage, > 0 towards the field side", "creepage eta")
    spin_per_mm: float | None = _creepage("Spin about the normal of the contact", "spin")
    speed_ratio: float = number(
        1.0,
        "Speed of rotation over that which rolls the tape circle; above 1 the wheel drives",
        high=2.0,
        remedy="a free wheel has 1, a driven one some thousandths more",
    )
    curved: bool = flag(
        "Creepages on the real patch follow the rolling radius and contact angle of each line", label="curved surfaces"
    )
    force_limit: float = _limit(
        0.05, "the creep force", "for forces if its creep force is off by less of mu N", "force_percent"
    )
    largest_creepage: float = number(
        0.02,
        "Longitudinal and lateral creepage up to which forces are judged",
        low=1e-4,
        high=0.5,
        remedy="0.02 is 2 %, where most contacts slide",
    )

    @property
    def asked(self) -> bool:
        """Whether forces are to be evaluated."""
        return self.friction is not None

    def refuse_unheard(self) -> None:
        """Refuse creepages without friction, and friction where nothing evaluates it, of which nothing would come.

        Raises
        ------
        InputError
            With what is missing.
        """
        if self.asked and "creep" not in places("READINGS"):
            raise InputError(
                f"friction coefficient is {self.friction:g}, but this fecontact has no feature creep, which evaluates"
                " creep forces; leave friction out, or install fecontact with all its features"
            )
        for one in () if self.asked else fields(self):
            if (value := getattr(self, one.name)) != one.default:
                label = one.metadata["input"].label
                raise InputError(
                    f"{label} is {value!r}, but no friction coefficient is given; give one too, for example 0.3"
                )
