"""What a judged load has to say beside its verdict."""

from __future__ import annotations

import math
from collections.abc import Iterator

from fecontact.contact.elements import UNSEEN_COMPLIANCE
from fecontact.contact_theories.registry import HERTZ
from fecontact.judging.comparison import Comparison
from fecontact.judging.gap_faults import gap_faults
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.patch_loads import PATCH_LOADS_LIMIT
from fecontact.judging.solved_load import compare_patch_loads
from fecontact.judging.uncertainty import of_turned_force
from fecontact.judging.verdict import plastic_warnings
from fecontact.placement.wheel_on_rail import Placement

# Displacements are taken for small beside the patch.
_SMALL_SLIDE = 0.1
# What another normal changes of the force is said from here on: it leaves 0.3 % of the peak open.
_SMALL_TURN = 0.01


def warnings_of(load: JudgedLoad) -> Iterator[str]:
    """What makes a load doubtful."""
    level, sides = load.level, load.sides
    if len(sides) > 1:
        said = (
            f"with the ellipse of its {side} side Hertz {one.verdict.answer} ({one.deviation['p_max_MPa']:+.1%} in peak"
            f" pressure, {one.deviation['area_mm2']:+.1%} in area)"
            for side, one in sides.items()
        )
        yield f"the curvature is undefined at the touch point: {'; '.join(said)}"
    yield from load.solved.limits
    yield from gap_faults(load.solved)
    for loads in compare_patch_loads(load.solved.levels):
        if loads.difference > PATCH_LOADS_LIMIT:
            yield (
                f"separate patches: {loads.on_elements:.2%} of the load is on the gauge side of a free strip on the"
                f" elements' nodes and {loads.on_finer_nodes:.2%} on the finer nodes; at most"
                f" {loads.uncertainty:.2%} of the load may lie between both: how the bodies share the load between the"
                " patches is not known"
            )
    moves = load.judgements[HERTZ].moves
    if moves.other_patches:
        labels = [label for label in moves.by_line if label in moves.other_patches]
        yield (
            f"on {len(labels)} of the {len(moves.by_line)} lines that the points allow the contact has other patches"
            f" than on the solved one ({', '.join(labels)}): there Hertz is judged by the half-space on that line, and"
            " what finite elements change on the solved line is its uncertainty"
        )
    # too little is seen of a half-space on them
    if math.isnan(level.compliance_error):
        yield (
            "the compliance of the elements is not checked: there are too few of them around the patch, or the head is"
            f" narrow or round for their size; {UNSEEN_COMPLIANCE:.0%} of it is taken for its uncertainty, more"
            " elements (--resolution) may show it"
        )
    part = abs(level.slide_mm) / load.comparison.fe.b_mm
    if not part <= _SMALL_SLIDE:
        yield (
            f"the wheel slides {abs(level.slide_mm):.2f} mm down the steep rail under the load, {part:.2f} of the"
            f" patch's half-width: beyond {_SMALL_SLIDE:g} of it what is stated for the finite elements does not cover"
            " what displacements do that are not small; a smaller load or a place that is less steep is known better"
        )
    if not abs(level.turned_force) <= _SMALL_TURN:
        yield (
            "the normal force is that along the normal at first touch; along the normal at the weighted centre of the"
            f" patch, as other codes take it, the load has a force that differs by {level.turned_force:+.1%}:"
            f" ±{of_turned_force(level.turned_force):.1%} of the peak pressure are stated for it"
        )
    yield from plastic_warnings(load.plastic)


def position_notes(placement: Placement, comparison: Comparison) -> Iterator[str]:
    """What is to be known of the profiles and of the contact as a whole."""
    rail = placement.rail.profile
    yield from placement.notes
    if not rail.outline:
        yield f"rail {rail.name}: only its running surface is known; the body below it is a block down to the cut"
    if placement.first.at_junction:
        yield (
            "the touch point lies at a curvature junction: deviations are those from Hertz with the curvature of its"
            " field side; the verdict is the worse of both sides"
        )
    if (pieces := comparison.patch.pieces) > 1:
        yield f"the contact has {pieces} separate patches; Hertz stands for the first touch point alone"
