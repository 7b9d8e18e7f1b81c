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
            f"with the curvature of the {side} side Hertz {hertz.verdict.answer} (peak pressure"
            f" {hertz.deviation['p_max_MPa']:+.1%}, area {hertz.deviation['area_mm2']:+.1%})"
            for side, hertz in sides.items()
        )
        yield f"the curvature is undefined at the contact point: {'; '.join(descriptions)}"
    # stored values change no number: a table that is judged again without a change has no new warning
    _, unjudged_texts = load.case.criteria.describe_unavailable_own(load.stored_own)
    yield from (f"not judged: {text}" for text in unjudged_texts)
    yield from load.solved.limits
    yield from describe_solution_faults(load.solved)
    for loads in compare_patch_loads(load.solved.levels):
        if loads.difference > PATCH_LOADS_LIMIT:
            yield (
                f"the share of the load between separate patches is not known: the patches on the gauge side carry"
                f" {loads.on_elements:.2%} of the load on the nodes of the elements and {loads.on_finer_nodes:.2%} on"
                f" the finer nodes (allowed difference: {loads.uncertainty:.2%})"
            )
    shifts = load.judgements[HERTZ].moves
    if shifts.other_patches:
        labels = [label for label in shifts.by_line if label in shifts.other_patches]
        yield (
            f"on {len(labels)} of {len(shifts.by_line)} profile variants the patches differ from the patches of"
            f" the reference variant ({', '.join(labels)}): there Hertz is compared with the half-space, and the change"
            " from half-space to finite elements on the reference variant is part of the uncertainty"
        )
    # The error of a half-space on these elements cannot be measured.
    if math.isnan(level.compliance_error):
        yield (
            "the compliance of the elements is not checked, because there are too few elements around the patch, or the"
            " head is narrow or round relative to their size; the uncertainty includes"
            f" {UNCHECKED_COMPLIANCE_ERROR:.0%} of the compliance; smaller elements (--resolution) may make the check"
            " possible"
        )
    fraction = abs(level.slide_mm) / load.comparison.fe.b_mm
    if not fraction <= _SLIDE_LIMIT:
        yield (
            f"the wheel slides {abs(level.slide_mm):.2f} mm down the steep rail under the load, {fraction:.2f} of the"
            f" half-width of the patch: above {_SLIDE_LIMIT:g} the stated uncertainty does not cover the effect of"
            " large displacements; use a smaller load or a less steep position"
        )
    if not abs(level.turned_force) <= _TURNED_FORCE_LIMIT:
        yield (
            "the normal force acts along the normal at the first contact point; along the normal at the weighted centre"
            f" of the patch, as in other codes, it would differ by {level.turned_force:+.1%}; the uncertainty of the"
            f" peak pressure includes ±{estimate_turned_force_uncertainty(level.turned_force):.1%} for this"
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
        yield f"rail {rail.name}: only its running surface is given; the body below it is a block"
    if placement.first.at_junction:
        yield (
            "the contact point is at a curvature junction: the deviations are for Hertz with the curvature of the field"
            " side; the verdict is the worse verdict of both sides"
        )
    if (patch_count := comparison.patch.patch_count) > 1:
        yield f"the contact has {patch_count} separate patches; Hertz has a single ellipse at the first contact point"
