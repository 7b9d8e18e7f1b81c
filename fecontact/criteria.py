"""By which measures Hertz is judged, and how far it may be off and still hold."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from fecontact.inputs.kinds import Flag, Names, Number
from fecontact.inputs.slots import by_name, check_inputs


def _limit(default: float, measure: str, help: str, key: str) -> Any:
    described = Number(
        label=f"limit of {measure}",
        help=f"Hertz holds if {help}",
        key=key,
        shown_unit="%" if key.endswith("_percent") else "",
        factor=100.0 if key.endswith("_percent") else 1.0,
        high=1.0,
        inclusive=False,
        remedy="for example 0.05 for 5 %" if key.endswith("_percent") else "for example 0.15",
    )
    return field(default=default, metadata={"input": described, "measure": measure})


_SETS = {
    "strength": ("p_max",),
    "patch": ("area", "a", "b", "centre"),
    "all": ("p_max", "area", "a", "b", "centre", "valley", "separate", "misplaced"),
}


@by_name
@dataclass(frozen=True, kw_only=True)
class Criteria:
    """How far Hertz may be off the finite elements and still hold, and by which measures it is judged.

    Limits of peak pressure, area and half-widths are relative; that of the centre of pressure is in Hertz's half-width
    b; those of the valley between two lobes, of the load on separate patches and of the misplaced load are parts of the
    peak and of the load (`comparison.measures.Misfit`).

    `judged_by` names measures by the fields here, or sets of them: `strength` for the stress below the surface, which
    follows the peak; `patch` for creep forces and wear, which take the ellipse's axes and its place; `all` for whoever
    takes the ellipse for the contact.

    `theories_in_range` leaves theories that are out of their own range out of what may be the cheapest that holds.
    """

    p_max: float = _limit(0.05, "p_max_MPa", "its peak pressure is off by less", "p_max_percent")
    area: float = _limit(0.10, "area_mm2", "its patch area is off by less", "area_percent")
    a: float = _limit(0.10, "a_mm", "its half-width along x is off by less", "a_percent")
    b: float = _limit(0.10, "b_mm", "its half-width across is off by less", "b_percent")
    centre: float = _limit(
        0.15, "centre_over_b", "the centre of pressure is off by less of its half-width b", "centre_over_b"
    )
    valley: float = _limit(0.10, "valley", "the pressure falls by less of its peak between two lobes", "valley_percent")
    separate: float = _limit(0.001, "separate_load", "separate patches carry less of the load", "separate_load_percent")
    misplaced: float = _limit(
        0.10, "misplaced_load", "less of the load is elsewhere than Hertz predicts", "misplaced_load_percent"
    )
    judged_by: tuple[str, ...] = field(
        default=("all",),
        metadata={
            "input": Names(
                label="judged by",
                help=f"Measures that decide, or sets of them (patch: {', '.join(_SETS['patch'])}; strength: p_max)",
                sets=_SETS,
            )
        },
    )
    theories_in_range: bool = field(
        default=False,
        metadata={
            "input": Flag(
                label="theories in range",
                help="Name no theory that is out of its own range as the cheapest that holds; by default it counts,"
                " marked as out of range, since its numbers are held against the finite elements at this very contact",
                alone=True,
            )
        },
    )

    def __post_init__(self) -> None:
        check_inputs(self)
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
