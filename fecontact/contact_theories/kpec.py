"""KPEC: Kik and Piotrowski's contact with Vollebregt's correction towards Hertz's ellipse."""

from __future__ import annotations

import numpy as np

from fecontact.contact_theories.gap_line import (
    LEAST_B_PER_MM,
    GapLine,
    StripContact,
    crossings_mm,
    end_notes,
    regions,
    strip_contact,
)
from fecontact.contact_theories.hertz import ellipse_shape
from fecontact.contact_theories.kik_piotrowski import pressure_factor
from fecontact.errors import check_positive

_LEVEL = 0.5


def kpec_at(line: GapLine, approach_mm: float) -> StripContact:
    """KPEC at an approach (mm).

    A parabola is laid through the gap at half the approach. The part of the approach that the gap may take up varies
    across as in Hertz's ellipse for this parabola, limited to 0 to 1. The pressure is scaled as in Kik and Piotrowski.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: one sum over the strips for each approach. Source: the code CONTACT (Vollebregt), option B = 5.
    Modified: the part is limited to 0 to 1 for lengths and pressures; CONTACT d431cdb limits it for lengths only, which
    leaves a spurious peak at the edge. Range: one region below half the approach. Exact for constant curvature. The
    force falls abruptly when a further minimum of the gap comes below half the approach, so that several approaches may
    carry a load; the result gives their number.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    t, f, A = line.t_mm, line.f_mm, line.A_per_mm
    level = _LEVEL * approach_mm
    below = regions(f < level)
    low, high = crossings_mm(t, f, level, (below[0][0], below[-1][1]))
    middle, half_width = 0.5 * (low + high), 0.5 * (high - low)
    laid = level / half_width**2
    B = max(LEAST_B_PER_MM, laid)
    shape = ellipse_shape(A, B)
    # both parts: A a^2 and B b^2 of the ellipse over the approach; then the coordinate across over b
    part_x, part_t = float(shape.part_x), float(shape.part_t)
    place_square = (t - middle) ** 2 * B / (part_t * approach_mm)
    part = np.clip(part_x - (part_x - part_t) * place_square, 0.0, 1.0)
    a = np.sqrt(np.maximum(part * approach_mm - f, 0.0) / A)
    pressure = pressure_factor(line, a, line.touch, approach_mm) * a
    out = end_notes(line, below[0][0], below[-1][1])
    if laid < B:
        out.append(f"the parabola has {laid:.2g} 1/mm; {B:g} 1/mm stands for it")
    if len(below) > 1:
        out.append(f"{len(below)} separate regions below half the approach, through which one parabola is laid")
    if len(regions(a > 0.0)) > 1:
        out.append("the patch falls into parts")
    return strip_contact(line, approach_mm, a, pressure, out)
