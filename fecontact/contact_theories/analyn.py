"""Normal contact by ANALYN (Sichani, Enblom, Berg).

The surfaces deform in proportion to the gap between them.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats, find_range_below, find_runs
from fecontact.contact_theories.gap_line import (
    GapLine,
    StripContact,
    build_strip_contact,
    find_close_positions,
    sum_forces_N,
)
from fecontact.errors import check_positive

# Largest share of the area in regions without a minimum of the gap. On constant curvature the theory is within 0.8 %.
_MAX_ARTIFICIAL_SHARE = 0.01


def solve_analyn(line: GapLine, approach_mm: float) -> StripContact:
    """Contact by ANALYN at an approach.

    Each strip is the middle of Hertz's ellipse for the curvature of the strip across. Its approach is the whole
    approach minus the gap and minus a deformation in proportion to the gap.

    Parameters
    ----------
    line
        Gap line.
    approach_mm
        Approach of the bodies, > 0.

    Returns
    -------
    StripContact
        Half length and pressure of each strip, and the force.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: closed form. Source: Sichani, Enblom and Berg (2014); the code CONTACT, option B = 6 (modified
    ANALYN), which limits curvatures to at least 1e-4 1/mm, as here. The treatment of a concave gap in the paper was not
    found. Range: a gap that is convex in the whole patch, and one region of contact for each minimum of the gap. Patch
    and peak jump where the curvature jumps. Exact for constant curvature in the patch and around it: beyond a jump to a
    flatter surface at the edge of the patch, the theory has a further region of contact, which makes the area 2 to 5 %
    too large (wheel EN15302_C on 54E5, 56E1 and CHN60).

    Examples
    --------
    Constant curvature, A = B = 0.005 1/mm: the semi-axis is sqrt(d / (2 A)) at the approach d.

    >>> import numpy as np
    >>> from fecontact.contact_theories.analyn import solve_analyn
    >>> from fecontact.contact_theories.gap_line import GapLine
    >>> t = np.linspace(-5.0, 5.0, 501)
    >>> line = GapLine(t_mm=t, f_mm=0.005 * t**2, A_per_mm=0.005, contact_modulus_MPa=115e3)
    >>> round(float(solve_analyn(line, 0.04).half_length_mm.max()), 3)
    2.0
    """
    check_positive("approach", approach_mm, "mm", "give the displacement of the bodies towards each other")
    half_length, pressure = _find_strips(line, approach_mm, slice(None))
    range_notes = [*line.concave_notes(half_length > 0.0), *_region_notes(line, half_length)]
    return build_strip_contact(line, approach_mm, half_length, pressure, range_notes)


def find_analyn_forces(line: GapLine, approaches_mm: Floats) -> Floats:
    """Forces by ANALYN at many approaches.

    Parameters
    ----------
    line
        Gap line.
    approaches_mm : ndarray of shape (k,)
        Approaches of the bodies, > 0.

    Returns
    -------
    ndarray of shape (k,)
        Forces in N of the contacts by `solve_analyn`.
    """
    positions = find_close_positions(line, float(approaches_mm.max()))
    return sum_forces_N(line, *_find_strips(line, approaches_mm[:, None], positions))


def _find_strips(line: GapLine, approach_mm: Floats | float, positions: slice) -> tuple[Floats, Floats]:
    """Half lengths (mm) and pressures (MPa) at x = 0 of strips.

    They are at an approach, or at approaches (k, 1).
    """
    ellipses = line.local_ellipses
    local_approach = np.maximum(approach_mm - line.f_mm[positions] / ellipses.part_t[positions], 0.0)
    a = np.sqrt(ellipses.part_x[positions] * local_approach / line.A_per_mm)
    pressure_shape = np.divide(local_approach, a, out=np.zeros_like(a), where=local_approach > 0.0)
    return a, line.contact_modulus_MPa * pressure_shape / ellipses.integral[positions]


def _region_notes(line: GapLine, half_length_mm: Floats) -> list[str]:
    """Note on regions of contact without a minimum of the gap.

    Surfaces that touch again farther from the minimum must have a wider gap between both regions. If the gap between
    them is smaller than anywhere in a region, then this region follows from a jump of the curvature alone, and the
    theory is out of its range.
    """
    f, artificial_regions = line.f_mm, set()
    for regions in pairwise(find_runs((half_length_mm > 0.0) & ~_find_necks(half_length_mm))):
        (_, last), (next_first, _) = regions
        *_, (least_gap, farther_region) = sorted((f[low : high + 1].min(), (low, high)) for low, high in regions)
        if f[last + 1 : next_first].max() < least_gap:
            artificial_regions.add(farther_region)
    length_mm = sum(float(half_length_mm[low : high + 1].sum()) for low, high in artificial_regions)
    share = length_mm / max(float(half_length_mm.sum()), np.finfo(float).tiny)
    if share <= _MAX_ARTIFICIAL_SHARE:
        return []
    return [
        f"{100.0 * share:.1f} % of the area is a region of contact without a minimum of the gap: it follows from a jump"
        " of the curvature alone"
    ]


def _find_necks(half_length_mm: Floats) -> NDArray[np.bool_]:
    """Mask (n,) of the necks between regions of contact.

    A neck is a least half length that is below half of the largest half length on both sides.
    """
    is_neck = np.zeros(half_length_mm.size, bool)
    slopes = np.sign(np.diff(half_length_mm))
    for place in np.flatnonzero((slopes[:-1] < 0.0) & (slopes[1:] > 0.0)) + 1:
        start, stop = find_range_below(-half_length_mm, int(place))
        largest_on_sides = half_length_mm[start:place].max(), half_length_mm[place:stop].max()
        is_neck[place] = min(largest_on_sides) > 2.0 * half_length_mm[place]
    return is_neck
