"""STRIPES, the semi-Hertzian contact of Ayasse and Chollet.

Each strip is the middle of a local ellipse.
"""

from __future__ import annotations

import numpy as np

from fecontact.contact_theories.gap_line import (
    MIN_B_PER_MM,
    GapLine,
    StripContact,
    build_strip_contact,
)
from fecontact.errors import check_positive


def solve_stripes(line: GapLine, approach_mm: float) -> StripContact:
    """Contact by STRIPES at an approach.

    In Hertz's ellipse at the contact point, the gap across uses a fraction of the approach. The bodies interpenetrate
    by this fraction. In each strip the curvature along the rail is corrected, so that length and pressure follow
    Hertz's ellipse for the curvature of the strip across.

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
    Class of cost: closed form. Source: Ayasse and Chollet (2005) as cited by others, with constants that give Hertz.
    The rule of the paper for smoothing the curvature was not found, and the curvature is not smoothed; the rule would
    change the peak by 5 to 15 % at junctions. Range: a gap that is convex in the whole patch; the peak is too high if
    the curvature rises inside the patch. Exact for constant curvature.

    Examples
    --------
    Constant curvature, A = B = 0.005 1/mm: the half length is sqrt(d / (2 A)) at the approach d.

    >>> import numpy as np
    >>> from fecontact.contact_theories.gap_line import GapLine
    >>> from fecontact.contact_theories.stripes import solve_stripes
    >>> t = np.linspace(-5.0, 5.0, 501)
    >>> line = GapLine(t_mm=t, f_mm=0.005 * t**2, A_per_mm=0.005, contact_modulus_MPa=115e3)
    >>> round(float(solve_stripes(line, 0.04).half_length_mm.max()), 3)
    2.0
    """
    check_positive("approach", approach_mm, "mm", "give the displacement of the bodies towards each other")
    f, ellipses = line.f_mm, line.local_ellipses
    depth = np.maximum(float(ellipses.part_t[line.touch]) * approach_mm - f, 0.0)
    is_in_contact = depth > 0.0
    a = ellipses.axis_ratio * np.sqrt(depth / np.maximum(line.B_per_mm, MIN_B_PER_MM))
    pressure_shape = np.divide(depth, a, out=np.zeros_like(f), where=is_in_contact)
    pressure = line.contact_modulus_MPa * pressure_shape / (ellipses.integral * ellipses.part_t)
    return build_strip_contact(line, approach_mm, a, pressure, line.concave_notes(is_in_contact))
