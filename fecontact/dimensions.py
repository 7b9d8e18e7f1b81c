"""Dimensions of the track and of its wheelset, and of the bodies that are cut out of rail and wheel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fecontact.inputs.kinds import Number
from fecontact.inputs.slots import by_name, check_inputs, given

TrackSide = Literal["left", "right"]


def _length(label: str, help: str, remedy: str) -> Number:
    return Number(label=label, help=help, unit="mm", remedy=remedy)


def _cut(label: str, help: str) -> Number:
    return _length(label, help, "bodies are usually cut at 60 mm")


@by_name
@dataclass(frozen=True, kw_only=True)
class BodySize:
    """Where the bodies are cut (mm): the rail's base below its crown, the sweep to each side, the rim's thickness.

    The rail is fixed at its base and held across at its ends, where it goes on: otherwise its head would roll on the
    slender web, which is a matter of the track and not of the contact. The rim is driven at its inner face.
    """

    rail_depth_mm: float = given(60.0, _cut("rail depth", "Depth of the rail's base below its crown"))
    rail_half_length_mm: float = given(60.0, _cut("rail half length", "Length of the rail to each side"))
    rim_thickness_mm: float = given(65.0, _cut("rim thickness", "Thickness of the wheel's rim"))
    rim_half_length_mm: float = given(60.0, _cut("rim half length", "Length of the rim to each side"))

    def __post_init__(self) -> None:
        check_inputs(self)


@by_name
@dataclass(frozen=True, kw_only=True)
class Track:
    """Track and wheelset dimensions (mm).

    The gauge is measured `gauge_depth_mm` below the highest point of the inclined rail. `rail_crown_y_mm` puts the
    crown of the rail at a given distance from the track centre instead (for heads without a gauge face).
    """

    gauge_mm: float = given(1435.0, _length("gauge", "Track gauge", "usually 1435 mm"))
    gauge_depth_mm: float = given(
        14.0, _length("gauge depth", "Depth of the gauge below the rail's top", "usually 14 mm")
    )
    back_to_back_mm: float = given(
        1360.0, _length("back-to-back distance", "Distance of the wheels' backs", "usually 1360 mm")
    )
    tape_circle_from_back_mm: float = given(
        70.0, _length("tape circle", "Distance of the tape circle from the back", "usually 70 mm")
    )
    rail_crown_y_mm: float | None = given(
        None, _length("rail crown", "Crown from the track centre, instead of the gauge", "None places by the gauge")
    )

    def __post_init__(self) -> None:
        check_inputs(self)

    @property
    def tape_circle_y_mm(self) -> float:
        """Distance of the tape circle from the wheelset's centre."""
        return 0.5 * self.back_to_back_mm + self.tape_circle_from_back_mm
