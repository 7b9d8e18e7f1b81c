"""Length and width of the elements of a case, from its expected patch."""

from __future__ import annotations

import math

from fecontact.case import RESOLUTIONS, Case
from fecontact.solving.expected_patch import DistantPatch, ExpectedPatch

# Additional number of elements per semi-axis, so that the meshes have the number of the resolution if the patch is
# slightly smaller than expected.
_ADDED_ELEMENTS = 0.25
_ELEMENTS_PER_WAVE = 8.0
# Largest length of an element divided by its width.
_LARGEST_ASPECT = 2.0
# A patch with more rows than this on its half length has longer elements, up to this multiple of their width: on the
# flange root the number of rows would be 73.
_MOST_ROWS = 36
_LONG_PATCH_ASPECT = 4.0
# Patches at a large distance have elements of equal length. These may be longer in relation to the widths of the
# narrowest patch, up to this multiple of the widths for each patch alone, as long as each patch also has its number of
# elements along x. Measured on S1002 and UIC60 at 5 mm, 50 kN, for six tenths of the time: forces and peaks of both
# patches are within 0.02 % of the values with a factor of 2 at `quick`, and within 0.035 % at `standard`, where both
# meshes of a case differ by 0.1 %; with a factor of 6 they differ by 0.1 %.
_SEPARATE_PATCH_ASPECT = 4.0


def choose_element_size_mm(case: Case, expected: ExpectedPatch) -> tuple[float, float]:
    """Element sizes along x and across.

    The narrowest semi-axis of the expected patch has the number of elements of the resolution. A slender patch has more
    elements along its length: the response of long elements to a pressure is less similar to the response of a
    half-space.

    Parameters
    ----------
    case
        Case with the resolution.
    expected
        Expected patch.

    Returns
    -------
    tuple of float
        Length and width in mm.
    """
    if not isinstance(case.resolution, str):
        return case.resolution
    count = RESOLUTIONS[case.resolution] + _ADDED_ELEMENTS
    length_mm, width_mm = expected.semi_axis_x_mm / count, expected.semi_axis_s_mm / count
    longest_mm = min(
        max(_LARGEST_ASPECT * width_mm, expected.semi_axis_x_mm / _MOST_ROWS), _LONG_PATCH_ASPECT * width_mm
    )
    if len(expected.parts) > 1:
        part_lengths_mm = (
            min(x, _SEPARATE_PATCH_ASPECT * s) for x, s in (patch.semi_axes_mm for patch in expected.parts)
        )
        longest_mm = max(longest_mm, min(part_lengths_mm) / count)
    irregularity = expected.true_gap.placement.along
    wave_limit_mm = math.inf if irregularity is None else irregularity.finest_mm / _ELEMENTS_PER_WAVE
    return min(length_mm, longest_mm, wave_limit_mm), min(width_mm, _LARGEST_ASPECT * length_mm)


def choose_element_width_mm(element_size_mm: tuple[float, float], part: DistantPatch) -> float:
    """Width of the elements below a patch at a large distance from other patches.

    Parameters
    ----------
    element_size_mm
        Length and width below the narrowest patch in mm.
    part
        Expected patch.

    Returns
    -------
    float
        Width in mm.
    """
    length_mm, width_mm = element_size_mm
    return max(width_mm, min(part.larger * width_mm, _LARGEST_ASPECT * length_mm))
