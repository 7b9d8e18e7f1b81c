"""ANALYN's normal part (Sichani, Enblom, Berg): surfaces deform in proportion to the gap between them."""

from __future__ import annotations

import numpy as np

from fecontact.contact_theories.gap_line import (
    GapLine,
    StripContact,
    strip_contact,
)
from fecontact.errors import check_positive


def analyn_at(line: GapLine, approach_mm: float) -> StripContact:
    """ANALYN at an approach (mm).

    Each strip is the middle of Hertz's ellipse for the strip's curvature across. Its approach is the whole approach
    minus the gap and minus a deformation in proportion to the gap.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: closed form. Source: Sichani, Enblom and Berg (2014); the code CONTACT, option B = 6 (modified
    ANALYN), which limits curvatures to at least 1e-4 1/mm, as here. How the paper treats a concave gap was not found.
    Range: a gap that is convex all over the patch; patch and peak jump where the curvature jumps. Exact for constant
    curvature.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    own = line.own_ellipses
    left = np.maximum(approach_mm - line.f_mm / own.part_t, 0.0)
    inside = left > 0.0
    a = np.sqrt(own.part_x * left / line.A_per_mm)
    root = np.divide(left, a, out=np.zeros_like(a), where=inside)
    pressure = line.contact_modulus_MPa * root / own.integral
    return strip_contact(line, approach_mm, a, pressure, line.concave_notes(inside))
