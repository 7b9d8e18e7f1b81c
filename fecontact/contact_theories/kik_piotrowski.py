"""Contact by Kik and Piotrowski: virtual interpenetration of a gap line."""

from __future__ import annotations

import numpy as np
from scipy.special import ellipe, ellipkm1

from fecontact.arrays import Floats, find_runs
from fecontact.contact_theories.gap_line import (
    GapLine,
    StripContact,
    build_strip_contact,
    end_notes,
    find_close_positions,
    find_crossings_mm,
    interpolate_gap,
    sum_forces_N,
)
from fecontact.contact_theories.hertz import calculate_ellipse_shape
from fecontact.errors import check_positive

VIRTUAL_PENETRATION = 0.55
"""Interpenetration of the undeformed bodies in the region of contact, as a fraction of the approach."""


def solve_kik_piotrowski(line: GapLine, approach_mm: float, *, shape_correction: bool = False) -> StripContact:
    """Contact by Kik and Piotrowski at an approach.

    The patch is the region with a gap below 0.55 of the approach. The pressure is c sqrt(a(t)^2 - x^2), with a single c
    for the patch, so that the surfaces deflect by the approach at the deepest interpenetration.

    Parameters
    ----------
    line
        Gap line.
    approach_mm
        Approach of the bodies, > 0.
    shape_correction
        Whether the region is first stretched and shrunk to the axis ratio of Hertz's ellipse.

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
    Class of cost: a single sum over the strips for each approach. Source: Kik and Piotrowski (1996); Piotrowski and Kik
    (2008), eqs 7 and 13. Modified: several regions are treated separately, each with the approach of its deepest point,
    and their forces are added. The shape correction follows citations of the 2008 paper; neither paper was seen in
    print. Range: it differs from Hertz for constant curvature, where the peak is 6 to 11 % low and the area 7 to 12 %
    large for a/b from 0.3 to 3. At a/b of 0.1 and 10 the peak is 19 % low and the area 24 % large.

    Examples
    --------
    Constant curvature, A = B = 0.005 1/mm: the half length is sqrt(0.55 d / A) at the approach d.

    >>> import numpy as np
    >>> from fecontact.contact_theories.gap_line import GapLine
    >>> from fecontact.contact_theories.kik_piotrowski import solve_kik_piotrowski
    >>> t = np.linspace(-5.0, 5.0, 501)
    >>> line = GapLine(t_mm=t, f_mm=0.005 * t**2, A_per_mm=0.005, contact_modulus_MPa=115e3)
    >>> round(float(solve_kik_piotrowski(line, 0.04).half_length_mm.max()), 3)
    2.098
    """
    check_positive("approach", approach_mm, "mm", "give the displacement of the bodies towards each other")
    level = VIRTUAL_PENETRATION * approach_mm
    half_length, pressure = np.zeros_like(line.t_mm), np.zeros_like(line.t_mm)
    contact_regions = find_runs(line.f_mm < level)
    for first, last in contact_regions:
        half_length_square = (
            np.maximum(_interpenetration(line, level, first, last, shape_correction=shape_correction), 0.0)
            / line.A_per_mm
        )
        deepest = first + int(np.argmin(line.f_mm[first : last + 1]))
        local_approach = approach_mm - float(line.f_mm[deepest]) / VIRTUAL_PENETRATION
        region_half_length = np.sqrt(half_length_square)
        factor = float(find_pressure_factors(line, region_half_length, deepest, local_approach))
        half_length, pressure = (
            np.maximum(half_length, region_half_length),
            np.maximum(pressure, factor * region_half_length),
        )
    range_notes = end_notes(line, contact_regions[0][0], contact_regions[-1][1])
    if len(contact_regions) > 1:
        range_notes.append(f"{len(contact_regions)} separate regions; the published theory has a single region")
    return build_strip_contact(line, approach_mm, half_length, pressure, range_notes)


def find_kik_piotrowski_forces(line: GapLine, approaches_mm: Floats) -> Floats:
    """Forces by Kik and Piotrowski at many approaches.

    Parameters
    ----------
    line
        Gap line.
    approaches_mm : ndarray of shape (k,)
        Approaches of the bodies, > 0.

    Returns
    -------
    ndarray of shape (k,)
        Forces in N of the contacts by `solve_kik_piotrowski`.
    """
    levels = VIRTUAL_PENETRATION * approaches_mm[:, None]
    positions = find_close_positions(line, float(levels.max()))
    depth = levels - line.f_mm[positions]
    is_closed = depth > 0.0
    regions = is_closed[:, 0] + np.count_nonzero(is_closed[:, 1:] > is_closed[:, :-1], axis=1)
    if regions.max() > 1:
        # each of several regions has its own pressure factor
        return np.array([solve_kik_piotrowski(line, float(approach)).normal_force_N for approach in approaches_mm])
    half_length = np.sqrt(np.maximum(depth, 0.0) / line.A_per_mm)
    factors = find_pressure_factors(line, half_length, line.touch, approaches_mm, positions)
    return factors * sum_forces_N(line, half_length, half_length)


def find_pressure_factors(
    line: GapLine,
    half_length_mm: Floats,
    index: int,
    deflection_mm: Floats | float,
    positions: slice = slice(None),
) -> Floats:
    """Factors c of the pressure c sqrt(a(t)^2 - x^2) for given deflections.

    The deflection is prescribed at a single position with x = 0.

    Parameters
    ----------
    line
        Gap line.
    half_length_mm : ndarray of shape (..., m)
        Half length a(t) of each strip, 0 outside the patch.
    index
        Index of the position of the line with the prescribed deflection.
    deflection_mm : float or ndarray of shape (...)
        Deflection of both surfaces together.
    positions
        Range of the strips among the positions of the line.

    Returns
    -------
    ndarray of shape (...)
        Factors c in MPa/mm.
    """
    is_loaded = half_length_mm > 0.0
    half_length = half_length_mm[is_loaded]
    strip_offsets = line.t_mm[positions] - line.t_mm[index]
    offsets = np.broadcast_to(strip_offsets, half_length_mm.shape)[is_loaded]
    complementary_parameter = offsets**2 / (offsets**2 + half_length**2)
    # In the strip at this position, the mean over the width of the strip is used.
    is_own_strip = offsets == 0.0
    complementary_parameter[is_own_strip] = 1.0
    influence = np.zeros_like(half_length_mm)
    strip_influence = (
        2.0
        * np.hypot(half_length, offsets)
        * (ellipkm1(complementary_parameter) - ellipe(1.0 - complementary_parameter))
    )
    strip_influence[is_own_strip] = (
        2.0 * half_length[is_own_strip] * np.log(8.0 * half_length[is_own_strip] / line.step_mm)
    )
    influence[is_loaded] = strip_influence
    return np.asarray(np.pi * line.contact_modulus_MPa * deflection_mm / (line.step_mm * influence.sum(axis=-1)))


def _interpenetration(line: GapLine, level: float, first: int, last: int, *, shape_correction: bool) -> Floats:
    """Interpenetration (n,) in mm of a region, zero or negative outside it.

    With the shape correction, the region is stretched and shrunk to the axis ratio of Hertz's ellipse. `level` is the
    virtual penetration in mm, `first` and `last` are the indices of the region's outermost points.
    """
    depth = np.full_like(line.f_mm, -1.0)
    depth[first : last + 1] = level - line.f_mm[first : last + 1]
    if not shape_correction:
        return depth
    low, high = find_crossings_mm(line.t_mm, line.f_mm, level, (first, last))
    width, length = high - low, 2.0 * np.sqrt(depth.max() / line.A_per_mm)
    axis_ratio = float(calculate_ellipse_shape(line.A_per_mm, line.A_per_mm * (length / width) ** 2).axis_ratio)
    stretch_along, stretch_across = np.sqrt(width * axis_ratio / length), np.sqrt(length / (axis_ratio * width))
    deepest = line.t_mm[first + int(np.argmin(line.f_mm[first : last + 1]))]
    source_positions = deepest + (line.t_mm - deepest) / stretch_across
    stretched_depth = stretch_along**2 * (level - interpolate_gap(line, source_positions))
    return np.where((source_positions > low) & (source_positions < high), stretched_depth, -1.0)
