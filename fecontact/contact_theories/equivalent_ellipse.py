"""Equivalent ellipse: Hertz for a parabola fitted to the gap at a single level."""

from __future__ import annotations

import numpy as np

from fecontact.arrays import find_runs
from fecontact.contact_theories.gap_line import (
    GapLine,
    StripContact,
    build_strip_contact,
    end_notes,
    find_crossings_mm,
)
from fecontact.contact_theories.hertz import calculate_ellipse_shape
from fecontact.contact_theories.kik_piotrowski import VIRTUAL_PENETRATION
from fecontact.errors import check_positive


def solve_equivalent_ellipse(line: GapLine, approach_mm: float) -> StripContact:
    """Contact by the equivalent ellipse at an approach.

    The parabola goes through the two positions around the contact point with a gap of 0.55 of the approach, as in
    several vehicle codes.

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
    Class of cost: closed form. Source: practice of vehicle codes (the level of Kik and Piotrowski); the definitions of
    Sauvage and of Quost et al. (2006) were not found. Range: one region of contact; the ellipse is symmetric and cannot
    represent a second region. Exact for constant curvature.

    Examples
    --------
    Constant curvature, A = B = 0.005 1/mm: the semi-axis is sqrt(d / (2 A)) at the approach d.

    >>> import numpy as np
    >>> from fecontact.contact_theories.equivalent_ellipse import solve_equivalent_ellipse
    >>> from fecontact.contact_theories.gap_line import GapLine
    >>> t = np.linspace(-5.0, 5.0, 501)
    >>> line = GapLine(t_mm=t, f_mm=0.005 * t**2, A_per_mm=0.005, contact_modulus_MPa=115e3)
    >>> round(float(solve_equivalent_ellipse(line, 0.04).half_length_mm.max()), 2)
    2.0
    """
    check_positive("approach", approach_mm, "mm", "give the displacement of the bodies towards each other")
    level = VIRTUAL_PENETRATION * approach_mm
    regions_below = find_runs(line.f_mm < level)
    first, last = next(run for run in regions_below if run[0] <= line.touch <= run[1])
    low, high = find_crossings_mm(line.t_mm, line.f_mm, level, (first, last))
    middle, B = 0.5 * (low + high), level / (0.5 * (high - low)) ** 2
    shape, range_notes = calculate_ellipse_shape(line.A_per_mm, B), end_notes(line, first, last)
    offset_square = (line.t_mm - middle) ** 2 * B / (float(shape.part_t) * approach_mm)
    ellipse_shape_factor = np.sqrt(np.maximum(1.0 - offset_square, 0.0))
    a = np.sqrt(float(shape.part_x) * approach_mm / line.A_per_mm)
    peak = line.contact_modulus_MPa * approach_mm / (a * float(shape.integral))
    if len(regions_below) > 1:
        range_notes.append(
            f"{len(regions_below)} separate regions below the level; the ellipse covers only one of them"
        )
    return build_strip_contact(line, approach_mm, a * ellipse_shape_factor, peak * ellipse_shape_factor, range_notes)
