"""Equivalent ellipse: Hertz for a parabola fitted to the gap at a single level."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats, find_runs
from fecontact.contact_theories.gap_line import (
    GapLine,
    StripContact,
    build_strip_contact,
    end_notes,
    interpolate_crossings,
    sum_forces_N,
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
    ellipses = _fit_ellipses(line, np.array([approach_mm]))
    shape_factor = ellipses.find_shape_factors(line.t_mm)[0]
    range_notes = end_notes(line, int(ellipses.first[0]), int(ellipses.last[0]))
    if (count := len(find_runs(line.f_mm < VIRTUAL_PENETRATION * approach_mm))) > 1:
        range_notes.append(f"{count} separate regions below the level; the ellipse covers only one of them")
    half_length, pressure = ellipses.a_mm[0] * shape_factor, ellipses.peak_MPa[0] * shape_factor
    return build_strip_contact(line, approach_mm, half_length, pressure, range_notes)


def find_equivalent_ellipse_forces(line: GapLine, approaches_mm: Floats) -> Floats:
    """Forces by the equivalent ellipse at many approaches.

    Parameters
    ----------
    line
        Gap line.
    approaches_mm : ndarray of shape (k,)
        Approaches of the bodies, > 0.

    Returns
    -------
    ndarray of shape (k,)
        Forces in N of the contacts by `solve_equivalent_ellipse`.
    """
    ellipses = _fit_ellipses(line, approaches_mm)
    ends = line.t_mm.searchsorted(
        ((ellipses.middle_mm - ellipses.b_mm).min(), (ellipses.middle_mm + ellipses.b_mm).max())
    )
    shape_factors = ellipses.find_shape_factors(line.t_mm[slice(*ends)])
    return ellipses.a_mm * ellipses.peak_MPa * sum_forces_N(line, shape_factors, shape_factors)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Ellipses:
    """Ellipses at k approaches.

    Attributes
    ----------
    first, last : ndarray of shape (k,)
        Indices of the ends of the region below the level.
    middle_mm, a_mm, b_mm, peak_MPa : ndarray of shape (k,)
        Position of the middle across, semi-axes along and across, and peak pressure.
    """

    first: NDArray[np.intp]
    last: NDArray[np.intp]
    middle_mm: Floats
    a_mm: Floats
    b_mm: Floats
    peak_MPa: Floats

    def find_shape_factors(self, t_mm: Floats) -> Floats:
        """Lengths (k, m) of strips at positions (m,), relative to the semi-axis along."""
        offsets = (t_mm - self.middle_mm[:, None]) / self.b_mm[:, None]
        return np.sqrt(np.maximum(1.0 - offsets * offsets, 0.0))


def _fit_ellipses(line: GapLine, approaches_mm: Floats) -> _Ellipses:
    """Ellipses of the parabolas at approaches (k,)."""
    levels, touch = VIRTUAL_PENETRATION * approaches_mm, line.touch
    # the region about the contact point ends where the largest gap from there reaches the level
    first = touch + 1 - np.maximum.accumulate(line.f_mm[touch::-1]).searchsorted(levels)
    last = touch - 1 + np.maximum.accumulate(line.f_mm[touch:]).searchsorted(levels)
    low, high = interpolate_crossings(line.t_mm, line.f_mm, levels, first, last)
    B = levels / (0.5 * (high - low)) ** 2
    shape = calculate_ellipse_shape(line.A_per_mm, B)
    a = np.sqrt(shape.part_x * approaches_mm / line.A_per_mm)
    return _Ellipses(
        first=first,
        last=last,
        middle_mm=0.5 * (low + high),
        a_mm=a,
        b_mm=np.sqrt(shape.part_t * approaches_mm / B),
        peak_MPa=line.contact_modulus_MPa * approaches_mm / (a * shape.integral),
    )
