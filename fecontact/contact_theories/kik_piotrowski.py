"""Kik and Piotrowski's contact: virtual interpenetration of a gap line."""

from __future__ import annotations

import numpy as np
from scipy.special import ellipe, ellipkm1

from fecontact.arrays import Floats
from fecontact.contact_theories.gap_line import (
    GapLine,
    StripContact,
    crossings_mm,
    end_notes,
    gap_at,
    regions,
    strip_contact,
)
from fecontact.contact_theories.hertz import ellipse_shape
from fecontact.errors import check_positive

VIRTUAL_PENETRATION = 0.55
"""Part of the approach by which the undeformed bodies interpenetrate in the region of contact."""


def kik_piotrowski_at(line: GapLine, approach_mm: float, *, shape_correction: bool = False) -> StripContact:
    """Kik and Piotrowski's contact at an approach (mm).

    The patch is the region with a gap below 0.55 of the approach. The pressure is c sqrt(a(t)^2 - x^2), with one c for
    the patch, so that the surfaces deflect by the approach at the deepest interpenetration.

    With `shape_correction` the region is first stretched and shrunk to the axis ratio of Hertz's ellipse.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: one sum over the strips for each approach. Source: Kik and Piotrowski (1996); Piotrowski and Kik
    (2008), eqs 7 and 13. Modified: several regions are treated one by one, each with the approach of its deepest point,
    and their forces are added. The shape correction follows citations of the 2008 paper; neither paper was seen in
    print. Range: not Hertz for constant curvature, where the peak is 6 to 11 % low and the area 7 to 12 % large
    for a/b from 0.3 to 3; at 0.1 and 10 the peak is 19 % low and the area 24 % large.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    level = VIRTUAL_PENETRATION * approach_mm
    half_length, pressure = np.zeros_like(line.t_mm), np.zeros_like(line.t_mm)
    found = regions(line.f_mm < level)
    for first, last in found:
        square = np.maximum(_overlap(line, level, first, last, shape_correction=shape_correction), 0.0) / line.A_per_mm
        deepest = first + int(np.argmin(line.f_mm[first : last + 1]))
        own_approach = approach_mm - float(line.f_mm[deepest]) / VIRTUAL_PENETRATION
        a = np.sqrt(square)
        c = pressure_factor(line, a, deepest, own_approach)
        half_length, pressure = np.maximum(half_length, a), np.maximum(pressure, c * a)
    out = end_notes(line, found[0][0], found[-1][1])
    if len(found) > 1:
        out.append(f"{len(found)} separate regions, which the papers do not add up")
    return strip_contact(line, approach_mm, half_length, pressure, out)


def pressure_factor(line: GapLine, half_length_mm: Floats, place: int, deflection_mm: float) -> float:
    """Factor c (MPa/mm) of the pressure c sqrt(a(t)^2 - x^2) for a given deflection at a place of x = 0."""
    inside = np.flatnonzero(half_length_mm)
    a, away = half_length_mm[inside], line.t_mm[inside] - line.t_mm[place]
    m1 = away**2 / (away**2 + a**2)
    # the strip through the place: mean over the strip's width
    own = inside == place
    m1[own] = 1.0
    influence = 2.0 * np.hypot(a, away) * (ellipkm1(m1) - ellipe(1.0 - m1))
    influence[own] = 2.0 * a[own] * np.log(8.0 * a[own] / line.step_mm)
    return float(np.pi * line.contact_modulus_MPa * deflection_mm / (line.step_mm * influence.sum()))


def _overlap(line: GapLine, level: float, first: int, last: int, *, shape_correction: bool) -> Floats:
    """Interpenetration of a region, zero or negative outside it, with or without the shape correction."""
    overlap = np.full_like(line.f_mm, -1.0)
    overlap[first : last + 1] = level - line.f_mm[first : last + 1]
    if not shape_correction:
        return overlap
    low, high = crossings_mm(line.t_mm, line.f_mm, level, (first, last))
    width, length = high - low, 2.0 * np.sqrt(overlap.max() / line.A_per_mm)
    axis_ratio = float(ellipse_shape(line.A_per_mm, line.A_per_mm * (length / width) ** 2).axis_ratio)
    along, across = np.sqrt(width * axis_ratio / length), np.sqrt(length / (axis_ratio * width))
    deepest = line.t_mm[first + int(np.argmin(line.f_mm[first : last + 1]))]
    places = deepest + (line.t_mm - deepest) / across
    stretched = along**2 * (level - gap_at(line, places))
    return np.where((places > low) & (places < high), stretched, -1.0)
