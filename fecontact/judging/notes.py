"""Warnings and notes on a judged load, beside its verdict."""

from __future__ import annotations

import math
from collections.abc import Iterator

from fecontact.contact.elements import UNCHECKED_COMPLIANCE_ERROR
from fecontact.contact_theories.registry import HERTZ
from fecontact.judging.comparison import Comparison
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.patch_loads import PATCH_LOADS_LIMIT
from fecontact.judging.solution_faults import describe_solution_faults
from fecontact.judging.solved_load import compare_patch_loads
from fecontact.judging.uncertainty import estimate_turned_force_uncertainty
from fecontact.judging.verdict import describe_plasticity
from fecontact.placement.wheel_on_rail import Placement

# Largest slide of the wheel divided by the half-width of the patch (-). The theory assumes displacements that are small
# compared with the patch.
_SLIDE_LIMIT = 0.1
# Relative change of the normal force by another normal, from which a warning is given. It causes an uncertainty of
# 0.3 % of the peak.
_TURNED_FORCE_LIMIT = 0.01


def iterate_warnings(load: JudgedLoad) -> Iterator[str]:
    """Reasons for doubt about the numbers of a load.

    Parameters
    ----------
    load
        Judged load.

    Yields
    ------
    str
        Sentence for each reason.
    """
    level, sides = load.level, load.sides
    if len(sides) > 1:
        descriptions = (
            f"with the ellipse of its {side} side Hertz {hertz.verdict.answer} ({hertz.deviation['p_max_MPa']:+.1%} in"
            f" peak pressure, {hertz.deviation['area_mm2']:+.1%} in area)"
            for side, hertz in sides.items()
        )
        yield f"the curvature is undefined at the touch point: {'; '.join(descriptions)}"
    yield from load.solved.limits
    yield from describe_solution_faults(load.solved)
    for loads in compare_patch_loads(load.solved.levels):
        if loads.difference > PATCH_LOADS_LIMIT:
            yield (
                f"separate patches: {loads.on_elements:.2%} of the load is on the gauge side of a free strip on the"
                f" elements' nodes and {loads.on_finer_nodes:.2%} on the finer nodes; at most"
                f" {loads.uncertainty:.2%} of the load may lie between both: how the bodies share the load between the"
                " patches is not known"
            )
    shifts = load.judgements[HERTZ].moves
    if shifts.other_patches:
        labels = [label for label in shifts.by_line if label in shifts.other_patches]
        yield (
            f"on {len(labels)} of the {len(shifts.by_line)} lines that the points allow the contact has other patches"
            f" than on the solved one ({', '.join(labels)}): there Hertz is judged by the half-space on that line, and"
            " what finite elements change on the solved line is its uncertainty"
        )
    # The error of a half-space on these elements cannot be measured.
    if math.isnan(level.compliance_error):
        yield (
            "the compliance of the elements is not checked: there are too few of them around the patch, or the head is"
            f" narrow or round for their size; {UNCHECKED_COMPLIANCE_ERROR:.0%} of it is taken for its uncertainty,"
            " more"
            " elements (--resolution) may show it"
        )
    fraction = abs(level.slide_mm) / load.comparison.fe.b_mm
    if not fraction <= _SLIDE_LIMIT:
        yield (
            f"the wheel slides {abs(level.slide_mm):.2f} mm down the steep rail under the load, {fraction:.2f} of the"
            f" patch's half-width: beyond {_SLIDE_LIMIT:g} of it what is stated for the finite elements does not cover"
            " what displacements do that are not small; a smaller load or a place that is less steep is known better"
        )
    if not abs(level.turned_force) <= _TURNED_FORCE_LIMIT:
        yield (
            "the normal force is that along the normal at first touch; along the normal at the weighted centre of the"
            f" patch, as other codes take it, the load has a force that differs by {level.turned_force:+.1%}:"
            f" ±{estimate_turned_force_uncertainty(level.turned_force):.1%} of the peak pressure are stated for it"
        )
    yield from describe_plasticity(load.plastic)


def iterate_notes(placement: Placement, comparison: Comparison) -> Iterator[str]:
    """Notes on the profiles, the body of the rail and the contact as a whole.

    Parameters
    ----------
    placement
        Wheel on rail.
    comparison
        Comparison of the finite elements with Hertz's ellipse.

    Yields
    ------
    str
        Sentence for each note.
    """
    rail = placement.rail.profile
    yield from placement.notes
    if not rail.outline:
        yield f"rail {rail.name}: only its running surface is known; the body below it is a block down to the cut"
    if placement.first.at_junction:
        yield (
            "the touch point lies at a curvature junction: deviations are those from Hertz with the curvature of its"
            " field side; the verdict is the worse of both sides"
        )
    if (patch_count := comparison.patch.pieces) > 1:
        yield f"the contact has {patch_count} separate patches; Hertz stands for the first touch point alone"
