"""Normal contact by ANALYN (Sichani, Enblom, Berg).

The surfaces deform in proportion to the gap between them.
"""

from __future__ import annotations

import numpy as np

from fecontact.contact_theories.gap_line import (
    GapLine,
    StripContact,
    build_strip_contact,
)
from fecontact.errors import check_positive


def solve_analyn(line: GapLine, approach_mm: float) -> StripContact:
    """Contact by ANALYN at an approach.

    Each strip is the middle of Hertz's ellipse for the curvature of the strip across. Its approach is the whole
    approach minus the gap and minus a deformation in proportion to the gap.

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
    Class of cost: closed form. Source: Sichani, Enblom and Berg (2014); the code CONTACT, option B = 6 (modified
    ANALYN), which limits curvatures to at least 1e-4 1/mm, as here. The treatment of a concave gap in the paper was not
    found. Range: a gap that is convex in the whole patch. Patch and peak jump where the curvature jumps. Exact for
    constant curvature.

    Examples
    --------
    Constant curvature, A = B = 0.005 1/mm: the semi-axis is sqrt(d / (2 A)) at the approach d.

    >>> import numpy as np
    >>> from fecontact.contact_theories.analyn import solve_analyn
    >>> from fecontact.contact_theories.gap_line import GapLine
    >>> t = np.linspace(-5.0, 5.0, 501)
    >>> line = GapLine(t_mm=t, f_mm=0.005 * t**2, A_per_mm=0.005, contact_modulus_MPa=115e3)
    >>> round(float(solve_analyn(line, 0.04).half_length_mm.max()), 3)
    2.0
    """
    check_positive("approach", approach_mm, "mm", "give the displacement of the bodies towards each other")
    ellipses = line.local_ellipses
    local_approach = np.maximum(approach_mm - line.f_mm / ellipses.part_t, 0.0)
    is_in_contact = local_approach > 0.0
    a = np.sqrt(ellipses.part_x * local_approach / line.A_per_mm)
    pressure_shape = np.divide(local_approach, a, out=np.zeros_like(a), where=is_in_contact)
    pressure = line.contact_modulus_MPa * pressure_shape / ellipses.integral
    return build_strip_contact(line, approach_mm, a, pressure, line.concave_notes(is_in_contact))
