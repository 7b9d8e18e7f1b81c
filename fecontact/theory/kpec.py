"""KPEC: Kik and Piotrowski's contact with Vollebregt's correction towards Hertz's ellipse."""

from __future__ import annotations

import numpy as np

from fecontact.errors import check_positive
from fecontact.theory.ellipse_shape import ellipse_shape
from fecontact.theory.gap_line import LEAST_B_PER_MM, GapLine, crossings_mm, end_notes, regions
from fecontact.theory.kik_piotrowski import pressure_factor
from fecontact.theory.load_search import under_load
from fecontact.theory.strip_contact import StripContact, strip_contact

_LEVEL = 0.5


def kpec(line: GapLine, normal_force_N: float) -> StripContact:
    """KPEC under a normal force; as `kpec_at`."""
    return under_load(line, normal_force_N, lambda approach: kpec_at(line, approach))


def kpec_at(line: GapLine, approach_mm: float) -> StripContact:
    """KPEC at an approach (mm).

    A parabola through the gap at half the approach has an ellipse of Hertz's; the part of the approach that the gap may
    take up varies across as it does there, held between 0 and 1. The pressure is scaled as Kik and Piotrowski do.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: one sum over the strips an approach. Source: the code CONTACT (Vollebregt), option B = 5. Modified:
    the part is held in 0 to 1 for lengths and pressures alike; CONTACT d431cdb does it for lengths alone, which leaves
    a spurious peak at the edge. Range: one region below half the approach. Exact for constant curvature. The force
    jumps and falls when a further minimum of the gap comes below half the approach: several approaches may carry a
    load, and the number of those found is in the result.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    t, f, A = line.t_mm, line.f_mm, line.A_per_mm
    level = _LEVEL * approach_mm
    below = regions(f < level)
    low, high = crossings_mm(line, level, below[0][0], below[-1][1])
    middle, half_width = 0.5 * (low + high), 0.5 * (high - low)
    laid = level / half_width**2
    B = max(LEAST_B_PER_MM, laid)
    shape = ellipse_shape(A, B)
    # A a^2 and B b^2 of the ellipse over the approach are both parts; the coordinate across over b
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
