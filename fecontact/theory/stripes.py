"""STRIPES, Ayasse and Chollet's semi-Hertzian contact: each strip as the middle of an ellipse of its own."""

from __future__ import annotations

import numpy as np

from fecontact.errors import check_positive
from fecontact.theory.gap_line import LEAST_B_PER_MM, GapLine
from fecontact.theory.load_search import under_load
from fecontact.theory.strip_contact import StripContact, strip_contact


def stripes(line: GapLine, normal_force_N: float) -> StripContact:
    """STRIPES under a normal force; as `stripes_at`."""
    return under_load(line, normal_force_N, lambda approach: stripes_at(line, approach))


def stripes_at(line: GapLine, approach_mm: float) -> StripContact:
    """STRIPES at an approach (mm).

    The bodies interpenetrate by the part of the approach that Hertz's ellipse at the touch point takes up across. The
    curvature along the rail is corrected strip by strip so that the patch is Hertz's for the strip's own curvature
    across, whose pressure it has.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: closed form. Source: Ayasse and Chollet (2005), as others tell it, with constants that give Hertz.
    Not found: the paper's rule for smoothing the curvature; the peak would follow it (5 to 15 % at junctions), and here
    there is none. Range: a gap that is convex all over the patch; the peak is too high where the curvature rises
    inside it. Exact for constant curvature.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    f, own = line.f_mm, line.own_ellipses
    overlap = np.maximum(float(own.part_t[line.touch]) * approach_mm - f, 0.0)
    inside = overlap > 0.0
    a = own.axis_ratio * np.sqrt(overlap / np.maximum(line.B_per_mm, LEAST_B_PER_MM))
    root = np.divide(overlap, a, out=np.zeros_like(f), where=inside)
    pressure = line.contact_modulus_MPa * root / (own.integral * own.part_t)
    return strip_contact(line, approach_mm, a, pressure, line.concave_notes(inside))
