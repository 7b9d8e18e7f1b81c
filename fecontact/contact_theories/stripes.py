"""STRIPES, Ayasse and Chollet's semi-Hertzian contact: each strip is the middle of a local ellipse."""

from __future__ import annotations

import numpy as np

from fecontact.contact_theories.gap_line import (
    LEAST_B_PER_MM,
    GapLine,
    StripContact,
    strip_contact,
)
from fecontact.errors import check_positive


def stripes_at(line: GapLine, approach_mm: float) -> StripContact:
    """STRIPES at an approach (mm).

    The bodies interpenetrate by the part of the approach that the gap takes up across in Hertz's ellipse at the touch
    point. In each strip the curvature along the rail is corrected, so that length and pressure follow Hertz's ellipse
    for the strip's curvature across.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: closed form. Source: Ayasse and Chollet (2005) as cited by others, with constants that give Hertz.
    The paper's rule for smoothing the curvature was not found, and the curvature is not smoothed; the rule would change
    the peak by 5 to 15 % at junctions. Range: a gap that is convex all over the patch; the peak is too high if the
    curvature rises inside the patch. Exact for constant curvature.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    f, own = line.f_mm, line.own_ellipses
    overlap = np.maximum(float(own.part_t[line.touch]) * approach_mm - f, 0.0)
    inside = overlap > 0.0
    a = own.axis_ratio * np.sqrt(overlap / np.maximum(line.B_per_mm, LEAST_B_PER_MM))
    root = np.divide(overlap, a, out=np.zeros_like(f), where=inside)
    pressure = line.contact_modulus_MPa * root / (own.integral * own.part_t)
    return strip_contact(line, approach_mm, a, pressure, line.concave_notes(inside))
