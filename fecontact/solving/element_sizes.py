"""How long and how wide the elements of a case are, from its expected patch."""

from __future__ import annotations

import math

from fecontact.case import RESOLUTIONS, Case
from fecontact.solving.expected_patch import ExpectedPart, ExpectedPatch

# More than the resolution says, so that its meshes have as many where the patch is a little smaller than expected.
_ROOM = 0.25
_ELEMENTS_A_WAVE = 8.0
# Longest element over its width.
_MOST_SLENDER = 2.0
# A patch that would have more rows than this on its half length gets longer elements, up to so many times their width:
# on the flange root they would be 73.
_MOST_ROWS = 36
_MOST_SLENDER_IN_ROWS = 4.0
# Patches far apart have equally long elements. They may be longer than that for the widths of the narrowest, up to so
# many times those that each patch would have by itself, as long as each has its number of them along x too. Measured on
# S1002 and UIC60 at 5 mm, 50 kN, for six tenths of the time: forces and peaks of both patches are within 0.02 % of
# those with 2 at `quick`, and 0.035 % at `standard`, where both meshes of a case are 0.1 % apart; with 6 they are 0.1 %
# off.
_MOST_SLENDER_APART = 4.0


def element_size_mm(case: Case, expected: ExpectedPatch) -> tuple[float, float]:
    """Element sizes along x and across: the resolution's elements on the narrowest semi-axis of the expected patch.

    A slender patch gets more of them along its length: long elements answer a pressure less like a half-space.
    """
    if not isinstance(case.resolution, str):
        return case.resolution
    count = RESOLUTIONS[case.resolution] + _ROOM
    along_x, across = expected.semi_axis_x_mm / count, expected.semi_axis_s_mm / count
    longest = min(max(_MOST_SLENDER * across, expected.semi_axis_x_mm / _MOST_ROWS), _MOST_SLENDER_IN_ROWS * across)
    if len(expected.parts) > 1:
        own = (min(x, _MOST_SLENDER_APART * s) for x, s in (part.semi_axes_mm for part in expected.parts))
        longest = max(longest, min(own) / count)
    along = expected.true_gap.placement.along
    wave = math.inf if along is None else along.finest_mm / _ELEMENTS_A_WAVE
    return min(along_x, longest, wave), min(across, _MOST_SLENDER * along_x)


def element_width_mm(element_size_mm: tuple[float, float], part: ExpectedPart) -> float:
    """Width across of the elements below one of several patches far apart, from the sizes below the narrowest."""
    along_x, across = element_size_mm
    return max(across, min(part.larger * across, _MOST_SLENDER * along_x))
