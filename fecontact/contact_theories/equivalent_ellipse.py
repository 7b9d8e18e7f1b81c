"""Equivalent ellipse: Hertz for a parabola through the two places at which the gap reaches a level."""

from __future__ import annotations

import numpy as np

from fecontact.contact_theories.gap_line import (
    GapLine,
    StripContact,
    crossings_mm,
    end_notes,
    regions,
    strip_contact,
)
from fecontact.contact_theories.hertz import ellipse_shape
from fecontact.contact_theories.kik_piotrowski import VIRTUAL_PENETRATION
from fecontact.errors import check_positive


def equivalent_ellipse_at(line: GapLine, approach_mm: float) -> StripContact:
    """Equivalent ellipse at an approach (mm).

    The parabola goes through the two places around the touch point at which the gap is 0.55 of the approach, as in
    several vehicle codes.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: closed form. Source: practice of vehicle codes (the level of Kik and Piotrowski); the definitions of
    Sauvage and of Quost et al. (2006) were not found. Range: one region of contact; the ellipse is symmetric and cannot
    represent a second region. Exact for constant curvature.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    level = VIRTUAL_PENETRATION * approach_mm
    below = regions(line.f_mm < level)
    first, last = next(run for run in below if run[0] <= line.touch <= run[1])
    low, high = crossings_mm(line.t_mm, line.f_mm, level, (first, last))
    middle, B = 0.5 * (low + high), level / (0.5 * (high - low)) ** 2
    shape, out = ellipse_shape(line.A_per_mm, B), end_notes(line, first, last)
    place_square = (line.t_mm - middle) ** 2 * B / (float(shape.part_t) * approach_mm)
    root = np.sqrt(np.maximum(1.0 - place_square, 0.0))
    a = np.sqrt(float(shape.part_x) * approach_mm / line.A_per_mm)
    peak = line.contact_modulus_MPa * approach_mm / (a * float(shape.integral))
    if len(below) > 1:
        out.append(f"{len(below)} separate regions below the level, of which the ellipse has one")
    return strip_contact(line, approach_mm, a * root, peak * root, out)
