"""KPEC: Kik and Piotrowski's contact with Vollebregt's correction towards Hertz's ellipse."""

from __future__ import annotations

import numpy as np

from fecontact.arrays import Floats, find_runs
from fecontact.contact_theories.gap_line import (
    MIN_B_PER_MM,
    GapLine,
    StripContact,
    build_strip_contact,
    end_notes,
    find_close_positions,
    interpolate_crossings,
    sum_forces_N,
)
from fecontact.contact_theories.hertz import calculate_ellipse_shape
from fecontact.contact_theories.kik_piotrowski import find_pressure_factors
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
    approaches = np.array([approach_mm])
    fitted_B, _ = _fit_parabolas(line, approaches)
    half_length = _find_half_lengths(line, approaches, slice(None))[0]
    pressure = find_pressure_factors(line, half_length, line.touch, approach_mm) * half_length
    regions_below = find_runs(line.f_mm < _RELATIVE_LEVEL * approach_mm)
    range_notes = end_notes(line, regions_below[0][0], regions_below[-1][1])
    if fitted_B[0] < MIN_B_PER_MM:
        range_notes.append(f"the fitted gap coefficient B, {fitted_B[0]:.2g} 1/mm, was set to {MIN_B_PER_MM:g} 1/mm")
    if len(regions_below) > 1:
        range_notes.append(
            f"{len(regions_below)} separate regions below half the approach; a single parabola is fitted to them"
        )
    if len(find_runs(half_length > 0.0)) > 1:
        range_notes.append("the patch consists of separate regions")
    return build_strip_contact(line, approach_mm, half_length, pressure, range_notes)


def find_kpec_forces(line: GapLine, approaches_mm: Floats) -> Floats:
    """Forces by KPEC at many approaches.

    Parameters
    ----------
    line
        Gap line.
    approaches_mm : ndarray of shape (k,)
        Approaches of the bodies, > 0.

    Returns
    -------
    ndarray of shape (k,)
        Forces in N of the contacts by `solve_kpec`.
    """
    positions = find_close_positions(line, float(approaches_mm.max()))
    half_length = _find_half_lengths(line, approaches_mm, positions)
    factors = find_pressure_factors(line, half_length, line.touch, approaches_mm, positions)
    return factors * sum_forces_N(line, half_length, half_length)


def _fit_parabolas(line: GapLine, approaches_mm: Floats) -> tuple[Floats, Floats]:
    """Coefficients B (k,) in 1/mm and middles (k,) in mm of parabolas.

    The parabolas go through the gap at half of each approach.
    """
    f, levels = line.f_mm, _RELATIVE_LEVEL * approaches_mm
    # the smallest gap from either end up to each position falls below the level at the first and last position
    first = f.size - np.minimum.accumulate(f)[::-1].searchsorted(levels)
    last = np.minimum.accumulate(f[::-1])[::-1].searchsorted(levels) - 1
    low, high = interpolate_crossings(line.t_mm, f, levels, first, last)
    return levels / (0.5 * (high - low)) ** 2, 0.5 * (low + high)


def _find_half_lengths(line: GapLine, approaches_mm: Floats, positions: slice) -> Floats:
    """Half lengths (k, m) in mm of strips at approaches (k,)."""
    fitted_B, middle = _fit_parabolas(line, approaches_mm)
    B = np.maximum(MIN_B_PER_MM, fitted_B)
    shape = calculate_ellipse_shape(line.A_per_mm, B)
    # A a^2 and B b^2 of the ellipse, as fractions of the approach; then the squared offset across as a fraction of b^2.
    part_x, part_t = shape.part_x[:, None], shape.part_t[:, None]
    approaches = approaches_mm[:, None]
    offset_square = (line.t_mm[positions] - middle[:, None]) ** 2 * B[:, None] / (part_t * approaches)
    gap_fraction = np.minimum(np.maximum(part_x - (part_x - part_t) * offset_square, 0.0), 1.0)
    return np.sqrt(np.maximum(gap_fraction * approaches - line.f_mm[positions], 0.0) / line.A_per_mm)
