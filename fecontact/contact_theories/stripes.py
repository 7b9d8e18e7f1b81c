"""STRIPES, the semi-Hertzian contact of Ayasse and Chollet.

Each strip is the middle of a local ellipse.
"""

from __future__ import annotations

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact_theories.gap_line import (
    MIN_B_PER_MM,
    GapLine,
    StripContact,
    build_strip_contact,
    find_close_positions,
    sum_forces_N,
)
from fecontact.errors import check_positive

# Largest share of flat or concave places in the overlap. With 5 to 41 % of them, three random library positions had an
# area 10 to 55 % too small (seeds 108, 118 and 122 of the test).
_MAX_FLAT_SHARE = 0.05


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
    change the peak by 5 to 15 % at junctions. Range: a gap that is convex in the whole patch, and in 95 % of the places
    where the undeformed bodies overlap; the peak is too high if the curvature rises inside the patch. Exact for
    constant curvature.

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
    half_length, pressure = _find_strips(line, approach_mm, slice(None))
    range_notes = line.concave_notes(half_length > 0.0) or _overlap_notes(line, approach_mm)
    return build_strip_contact(line, approach_mm, half_length, pressure, range_notes)


def find_stripes_forces(line: GapLine, approaches_mm: Floats) -> Floats:
    """Forces by STRIPES at many approaches.

    Parameters
    ----------
    line
        Gap line.
    approaches_mm : ndarray of shape (k,)
        Approaches of the bodies, > 0.

    Returns
    -------
    ndarray of shape (k,)
        Forces in N of the contacts by `solve_stripes`.
    """
    positions = find_close_positions(line, float(approaches_mm.max()))
    return sum_forces_N(line, *_find_strips(line, approaches_mm[:, None], positions))


def _find_strips(line: GapLine, approach_mm: Floats | float, positions: slice) -> tuple[Floats, Floats]:
    """Half lengths (mm) and pressures (MPa) at x = 0 of strips.

    They are at an approach, or at approaches (k, 1).
    """
    ellipses = line.local_ellipses
    depth = np.maximum(float(ellipses.part_t[line.touch]) * approach_mm - line.f_mm[positions], 0.0)
    a = ellipses.axis_ratio[positions] * np.sqrt(depth / np.maximum(line.B_per_mm[positions], MIN_B_PER_MM))
    pressure_shape = np.divide(depth, a, out=np.zeros_like(a), where=depth > 0.0)
    return a, line.contact_modulus_MPa * pressure_shape / (ellipses.integral * ellipses.part_t)[positions]


def _overlap_notes(line: GapLine, approach_mm: float) -> list[str]:
    """Note on flat or concave places beyond the patch where the undeformed bodies overlap.

    The patch ends where the gap exceeds a fraction of the approach, which is calculated from the curvature at the
    contact point. Beyond a flat or concave place the gap grows more slowly, and the true patch may continue.
    """
    is_overlapping = line.f_mm < approach_mm
    share = np.count_nonzero(line.B_per_mm[is_overlapping] < MIN_B_PER_MM) / np.count_nonzero(is_overlapping)
    if share <= _MAX_FLAT_SHARE:
        return []
    return [
        f"{100.0 * share:.0f} % of the overlap of the undeformed bodies is flat or concave across: the patch may"
        " continue there"
    ]
