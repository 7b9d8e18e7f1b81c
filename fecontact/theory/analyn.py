"""ANALYN's normal part (Sichani, Enblom and Berg): surfaces deform in proportion to the gap between them."""

from __future__ import annotations

import numpy as np

from fecontact.errors import check_positive
from fecontact.theory.gap_line import GapLine
from fecontact.theory.load_search import under_load
from fecontact.theory.strip_contact import StripContact, strip_contact


def analyn(line: GapLine, normal_force_N: float) -> StripContact:
    """ANALYN under a normal force; as `analyn_at`."""
    return under_load(line, normal_force_N, lambda approach: analyn_at(line, approach))


def analyn_at(line: GapLine, approach_mm: float) -> StripContact:
    """ANALYN at an approach (mm).

    Each strip is the middle of Hertz's ellipse for its own curvature across, at the approach that is left of the whole
    one after the gap and the deformation in proportion to it.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: closed form. Source: Sichani, Enblom and Berg (2014); the code CONTACT, option B = 6 (modified
    ANALYN), which holds curvatures at 1e-4 1/mm at least, as here. Not found: how the paper treats a concave gap.
    Range: a gap that is convex all over the patch; patch and peak jump where the curvature does. Exact for constant
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
