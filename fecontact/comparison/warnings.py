"""What a judged load has to say beside its verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping

from fecontact.comparison.compare import Comparison
from fecontact.comparison.judgement import Judgement
from fecontact.comparison.solved_load import Level
from fecontact.contact.elements import COMPLIANCE_LIMIT
from fecontact.geometry.placement import Placement
from fecontact.theory.touch_hertz import Side

# Displacements are taken for small beside the patch.
_SMALL_SLIDE = 0.1


def junction_warnings(sides: Mapping[Side, Judgement]) -> list[str]:
    """What Hertz says with the curvature of either side of a junction."""
    if len(sides) == 1:
        return []
    said = (
        f"with that of its {side} side Hertz {one.verdict.answer} ({one.deviation['p_max_MPa']:+.1%} in peak"
        f" pressure, {one.deviation['area_mm2']:+.1%} in area)"
        for side, one in sides.items()
    )
    return [f"the curvature is undefined at the touch point: {'; '.join(said)}"]


def elements_warnings(level: Level) -> list[str]:
    """Elements whose compliance is not checked, since too little is seen of a half-space on them."""
    if not math.isnan(level.compliance_error):
        return []
    return [
        "the compliance of the elements is not checked: there are too few of them around the patch, or the head is"
        f" narrow or round for their size; {COMPLIANCE_LIMIT:.0%} of it is taken for its uncertainty, more elements"
        " (--resolution) show it"
    ]


def slide_warnings(slide_mm: float, comparison: Comparison) -> list[str]:
    """Bodies that slide along each other by more than displacements may be small."""
    part = abs(slide_mm) / comparison.fe.b_mm
    if part <= _SMALL_SLIDE:
        return []
    return [
        f"the wheel slides {abs(slide_mm):.2f} mm down the steep rail under the load, {part:.2f} of the patch's"
        f" half-width: beyond {_SMALL_SLIDE:g} of it what is stated for the finite elements does not cover what"
        " displacements do that are not small; a smaller load or a place that is less steep is known better"
    ]


def position_notes(placement: Placement, comparison: Comparison) -> tuple[str, ...]:
    """What is to be known of the profiles and of the contact as a whole."""
    found = [*placement.rail.profile.notes, *placement.wheel.profile.notes]
    if not placement.rail.profile.outline:
        found.append(
            f"rail {placement.rail.profile.name}: only its running surface is known; the body below"
            " it is a block down to the cut"
        )
    if placement.climbs:
        found.append(
            f"the flange climbs: it touches the rail beyond its steepest place, at"
            f" {math.degrees(placement.first.contact_angle_rad):.1f} degrees; a lateral force alone holds it there"
        )
    if placement.first.at_junction:
        found.append(
            "the touch point lies at a curvature junction: deviations are those from Hertz with the curvature of its"
            " field side; the verdict is the worse of both sides"
        )
    if comparison.patch.pieces > 1:
        found.append(
            f"the contact has {comparison.patch.pieces} separate patches; Hertz stands for the first touch point alone"
        )
    return tuple(found)
