"""KPEC: Kik and Piotrowski's contact with Vollebregt's correction towards Hertz's ellipse."""

from __future__ import annotations

import numpy as np

from fecontact.arrays import find_runs
from fecontact.contact_theories.gap_line import (
    MIN_B_PER_MM,
    GapLine,
    StripContact,
    build_strip_contact,
    end_notes,
    find_crossings_mm,
)
from fecontact.contact_theories.hertz import calculate_ellipse_shape
from fecontact.contact_theories.kik_piotrowski import find_pressure_factor
from fecontact.errors import check_positive

_RELATIVE_LEVEL = 0.5


def solve_kpec(line: GapLine, approach_mm: float) -> StripContact:
    """Contact by KPEC at an approach.

    A parabola is fitted to the gap at half the approach. The fraction of the approach that limits the gap in the patch
    varies across as in Hertz's ellipse for this parabola, limited to 0 to 1. The pressure is scaled as in Kik and
    Piotrowski.

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
    Class of cost: a single sum over the strips for each approach. Source: the code CONTACT (Vollebregt), option B = 5.
    Modified: the fraction is limited to 0 to 1 for lengths and pressures; CONTACT d431cdb limits it for lengths only,
    which leaves a spurious peak at the edge. Range: one region below half the approach. Exact for constant curvature.
    The force falls abruptly when a further minimum of the gap comes below half the approach, so that several approaches
    may have an equal force; the result contains their number.

    Examples
    --------
    Constant curvature, A = B = 0.005 1/mm: the half length is sqrt(d / (2 A)) at the approach d.

    >>> import numpy as np
    >>> from fecontact.contact_theories.gap_line import GapLine
    >>> from fecontact.contact_theories.kpec import solve_kpec
    >>> t = np.linspace(-5.0, 5.0, 501)
    >>> line = GapLine(t_mm=t, f_mm=0.005 * t**2, A_per_mm=0.005, contact_modulus_MPa=115e3)
    >>> round(float(solve_kpec(line, 0.04).half_length_mm.max()), 3)
    2.0
    """
    check_positive("approach", approach_mm, "mm", "give the displacement of the bodies towards each other")
    t, f, A = line.t_mm, line.f_mm, line.A_per_mm
    level = _RELATIVE_LEVEL * approach_mm
    regions_below = find_runs(f < level)
    low, high = find_crossings_mm(t, f, level, (regions_below[0][0], regions_below[-1][1]))
    middle, half_width = 0.5 * (low + high), 0.5 * (high - low)
    fitted_B = level / half_width**2
    B = max(MIN_B_PER_MM, fitted_B)
    shape = calculate_ellipse_shape(A, B)
    # A a^2 and B b^2 of the ellipse, as fractions of the approach; then the squared offset across as a fraction of b^2.
    part_x, part_t = float(shape.part_x), float(shape.part_t)
    offset_square = (t - middle) ** 2 * B / (part_t * approach_mm)
    gap_fraction = np.clip(part_x - (part_x - part_t) * offset_square, 0.0, 1.0)
    a = np.sqrt(np.maximum(gap_fraction * approach_mm - f, 0.0) / A)
    pressure = find_pressure_factor(line, a, line.touch, approach_mm) * a
    range_notes = end_notes(line, regions_below[0][0], regions_below[-1][1])
    if fitted_B < B:
        range_notes.append(f"the fitted gap coefficient B, {fitted_B:.2g} 1/mm, was set to {B:g} 1/mm")
    if len(regions_below) > 1:
        range_notes.append(
            f"{len(regions_below)} separate regions below half the approach; a single parabola is fitted to them"
        )
    if len(find_runs(a > 0.0)) > 1:
        range_notes.append("the patch consists of separate regions")
    return build_strip_contact(line, approach_mm, a, pressure, range_notes)
