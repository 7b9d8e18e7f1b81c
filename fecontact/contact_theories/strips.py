"""Fast theories of a gap line: Kik and Piotrowski, KPEC, STRIPES, ANALYN, equivalent ellipse, strip method."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ellipe, ellipkm1

from fecontact.arrays import Floats
from fecontact.contact_theories.gap_line import (
    LEAST_B_PER_MM,
    GapLine,
    StripContact,
    crossings_mm,
    end_notes,
    gap_at,
    gap_line,
    regions,
    strip_contact,
)
from fecontact.contact_theories.hertz import ellipse_shape
from fecontact.contact_theories.strip_method import Line, Load, Search, solve_strips
from fecontact.errors import InputError, check_positive
from fecontact.placement.wheel_on_rail import Placement

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
    print. Range: not Hertz for constant curvature, where the peak is 6 to 11 % low and the area 7 to 12 % large.
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


# --- KPEC: Kik and Piotrowski's contact with Vollebregt's correction towards Hertz's ellipse.

_LEVEL = 0.5


def kpec_at(line: GapLine, approach_mm: float) -> StripContact:
    """KPEC at an approach (mm).

    A parabola is laid through the gap at half the approach. The part of the approach that the gap may take up varies
    across as in Hertz's ellipse for this parabola, limited to 0 to 1. The pressure is scaled as in Kik and Piotrowski.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: one sum over the strips for each approach. Source: the code CONTACT (Vollebregt), option B = 5.
    Modified: the part is limited to 0 to 1 for lengths and pressures; CONTACT d431cdb limits it for lengths only, which
    leaves a spurious peak at the edge. Range: one region below half the approach. Exact for constant curvature. The
    force falls abruptly when a further minimum of the gap comes below half the approach, so that several approaches may
    carry a load; the result gives their number.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    t, f, A = line.t_mm, line.f_mm, line.A_per_mm
    level = _LEVEL * approach_mm
    below = regions(f < level)
    low, high = crossings_mm(t, f, level, (below[0][0], below[-1][1]))
    middle, half_width = 0.5 * (low + high), 0.5 * (high - low)
    laid = level / half_width**2
    B = max(LEAST_B_PER_MM, laid)
    shape = ellipse_shape(A, B)
    # both parts: A a^2 and B b^2 of the ellipse over the approach; then the coordinate across over b
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


# --- STRIPES, Ayasse and Chollet's semi-Hertzian contact: each strip is the middle of a local ellipse.


def stripes_at(line: GapLine, approach_mm: float) -> StripContact:
    """STRIPES at an approach (mm).

    The bodies interpenetrate by the part of the approach that the gap takes up across in Hertz's ellipse at the touch
    point. In each strip the curvature along the rail is corrected, so that length and pressure follow Hertz's ellipse
    for the strip's curvature across.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: closed form. Source: Ayasse and Chollet (2005) as cited by others, with constants that give Hertz.
    The paper's rule for smoothing the curvature was not found, and the curvature is not smoothed; the rule would change
    the peak by 5 to 15 % at junctions. Range: a gap that is convex all over the patch; the peak is too high if the
    curvature rises inside the patch. Exact for constant curvature.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    f, own = line.f_mm, line.own_ellipses
    overlap = np.maximum(float(own.part_t[line.touch]) * approach_mm - f, 0.0)
    inside = overlap > 0.0
    a = own.axis_ratio * np.sqrt(overlap / np.maximum(line.B_per_mm, LEAST_B_PER_MM))
    root = np.divide(overlap, a, out=np.zeros_like(f), where=inside)
    pressure = line.contact_modulus_MPa * root / (own.integral * own.part_t)
    return strip_contact(line, approach_mm, a, pressure, line.concave_notes(inside))


# --- ANALYN's normal part (Sichani, Enblom and Berg): surfaces deform in proportion to the gap between them.


def analyn_at(line: GapLine, approach_mm: float) -> StripContact:
    """ANALYN at an approach (mm).

    Each strip is the middle of Hertz's ellipse for the strip's curvature across. Its approach is the whole approach
    minus the gap and minus a deformation in proportion to the gap.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: closed form. Source: Sichani, Enblom and Berg (2014); the code CONTACT, option B = 6 (modified
    ANALYN), which limits curvatures to at least 1e-4 1/mm, as here. How the paper treats a concave gap was not found.
    Range: a gap that is convex all over the patch; patch and peak jump where the curvature jumps. Exact for constant
    curvature.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    own = line.own_ellipses
    left = np.maximum(approach_mm - line.f_mm / own.part_t, 0.0)
    inside = left > 0.0
    a = np.sqrt(own.part_x * left / line.A_per_mm)
    root = np.divide(left, a, out=np.zeros_like(a), where=inside)
    pressure = line.contact_modulus_MPa * root / own.integral
    return strip_contact(line, approach_mm, a, pressure, line.concave_notes(inside))


# --- Equivalent ellipse: Hertz for a parabola through the two places at which the gap reaches a level.


def equivalent_ellipse_at(line: GapLine, approach_mm: float) -> StripContact:
    """Equivalent ellipse at an approach (mm).

    The parabola goes through the two places around the touch point at which the gap is 0.55 of the approach, as in
    several vehicle codes.

    Raises
    ------
    InputError
        If the approach is not positive.

    Notes
    -----
    Class of cost: closed form. Source: practice of vehicle codes (the level of Kik and Piotrowski); the definitions of
    Sauvage and of Quost et al. (2006) were not found. Range: one region of contact; the ellipse is symmetric and cannot
    represent a second region. Exact for constant curvature.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    level = VIRTUAL_PENETRATION * approach_mm
    below = regions(line.f_mm < level)
    first, last = next(run for run in below if run[0] <= line.touch <= run[1])
    low, high = crossings_mm(line.t_mm, line.f_mm, level, (first, last))
    middle, B = 0.5 * (low + high), level / (0.5 * (high - low)) ** 2
    shape, out = ellipse_shape(line.A_per_mm, B), end_notes(line, first, last)
    place_square = (line.t_mm - middle) ** 2 * B / (float(shape.part_t) * approach_mm)
    root = np.sqrt(np.maximum(1.0 - place_square, 0.0))
    a = np.sqrt(float(shape.part_x) * approach_mm / line.A_per_mm)
    peak = line.contact_modulus_MPa * approach_mm / (a * float(shape.integral))
    if len(below) > 1:
        out.append(f"{len(below)} separate regions below the level, of which the ellipse has one")
    return strip_contact(line, approach_mm, a * root, peak * root, out)


# --- Overlapping strips: each carries its interpenetration independently of the others.

# Factor C of independent strips.
_FACTOR = 1.2


def overlap_strips(
    depth_mm: Floats, curvature_along_per_mm: Floats, contact_modulus_MPa: float
) -> tuple[Floats, Floats]:
    """Half lengths (n,) and forces over width (n,) of strips: sqrt(2 depth / curvature), and (pi/2) C E* depth.

    With C = 4/pi load and lengths equal Hertz's circle, at half its approach; C = 1.2 is the usual fit for wheels on
    rails. Results are continuous in all positions, also if other places touch.

    Parameters
    ----------
    depth_mm, curvature_along_per_mm (n,)
        Interpenetration of the undeformed bodies, > 0, and their relative curvature along the rail.

    Notes
    -----
    Class of cost: closed form. Source: the idea of a virtual penetration (Kik and Piotrowski 1996), without its
    reduction and without influence between strips. Range of validity: approaches are half of the true approaches, areas
    up to twice the true areas on slender patches; the centre of pressure is within 0.5 mm of the half-space's on S1002
    and 60E1, within 1.2 mm on the flange root.
    """
    return (
        np.sqrt(2.0 * depth_mm / curvature_along_per_mm),
        np.asarray(0.5 * np.pi * _FACTOR * contact_modulus_MPa * depth_mm),
    )


# --- The strip method on a gap line.

STRIPS = 100
_FEWEST_STRIPS = 20
# They give the approach within 0.02 % of 100.
_STRIPS_OF_SLIDE = 32


def strip(line: GapLine, normal_force_N: float, *, strips: int = STRIPS) -> StripContact:
    """The strip method under a normal force; see `strip_at`."""
    check_positive("normal force", normal_force_N, "N", "give the compressive force")
    return _solved(line, strips, Load(force=normal_force_N))


def strip_at(line: GapLine, approach_mm: float, *, strips: int = STRIPS) -> StripContact:
    """The strip method at an approach (mm): equations, source and range in `strip_method`.

    Raises
    ------
    InputError
        If the approach is not positive, or there are too few strips.

    Notes
    -----
    Class of cost: a few linear systems with as many equations as strips. Exact for constant curvature; the force grows
    with the approach, so that there is one solution.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    return _solved(line, strips, Load(approach=approach_mm))


def _solved(line: GapLine, strips: int, load: Load) -> StripContact:
    if strips < _FEWEST_STRIPS:
        raise InputError(f"number of strips is {strips}; allowed: {_FEWEST_STRIPS} and more; 100 are good to 0.1 %")
    solved = solve_strips(
        Line(
            t=line.surface_mm,
            f=line.f_mm,
            A=line.A_per_mm,
            E=line.contact_modulus_MPa,
            closing=np.cos(line.turned_rad),
        ),
        load,
        Search(strips=strips),
    )
    half_length = np.sqrt(solved.q)
    notes = []
    if solved.at_end:
        notes.append("the patch reaches the end of the line; give a longer one")
    if not solved.converged:
        notes.append(f"sweeps did not end: c and q still change by {100.0 * solved.change:.1f} %")
    return StripContact(
        status="not converged" if not solved.converged else "out of range" if notes else "solved",
        notes=tuple(notes),
        solutions=1,
        approach_mm=solved.approach,
        normal_force_N=solved.force,
        t_mm=solved.t,
        width_mm=solved.h,
        half_length_mm=half_length,
        centre_pressure_MPa=solved.c * half_length,
    )


def gap_line_under_load(placement: Placement, normal_force_N: float, *, contact_modulus_MPa: float) -> GapLine:
    """Gap line of a wheel under a vertical load, which slides along the tangent plane by approach times tan(angle).

    Range of validity: as in `gap_line`; below a contact angle of 0.3 rad the slide changes no measure by more than 1 %.
    """
    line = gap_line(placement, contact_modulus_MPa=contact_modulus_MPa)
    approach = strip(line, normal_force_N, strips=_STRIPS_OF_SLIDE).approach_mm
    slide = -approach * math.tan(placement.first.contact_angle_rad)
    return gap_line(placement, contact_modulus_MPa=contact_modulus_MPa, slide_mm=slide)
