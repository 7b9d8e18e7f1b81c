"""Equivalent ellipse: a parabola in place of the gap, through where it reaches a level, and Hertz for it."""

from __future__ import annotations

import numpy as np

from fecontact.errors import check_positive
from fecontact.theory.ellipse_shape import EllipseShape, ellipse_shape
from fecontact.theory.gap_line import GapLine, crossings_mm, end_notes, regions
from fecontact.theory.load_search import under_load
from fecontact.theory.strip_contact import StripContact, strip_contact

# The level moves by less than this part of the approach.
_SETTLED = 1e-6
_FIXED_POINT_STEPS = 50


def equivalent_ellipse(line: GapLine, normal_force_N: float, *, level: float | None = 0.55) -> StripContact:
    """Equivalent ellipse under a normal force; as `equivalent_ellipse_at`."""
    return under_load(line, normal_force_N, lambda approach: equivalent_ellipse_at(line, approach, level=level))


def equivalent_ellipse_at(line: GapLine, approach_mm: float, *, level: float | None = 0.55) -> StripContact:
    """Equivalent ellipse at an approach (mm).

    The parabola goes through the two places around the touch point where the gap is `level` of the approach, 0.55 as
    in several vehicle codes; None takes the level at which the ellipse itself ends there.

    Raises
    ------
    InputError
        If the approach or the level is not positive.

    Notes
    -----
    Class of cost: closed form. Source: practice of vehicle codes (the level of Kik and Piotrowski); the definitions of
    Sauvage and of Quost et al. (2006) were not found. Range: one region of contact; the ellipse is symmetric and knows
    nothing of a second one. Exact for constant curvature.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    if level is not None:
        check_positive("level of the equivalent ellipse", level, "", "give 0.55, or None for the ellipse's own")
    part, settled = (0.5, False) if level is None else (level, True)
    middle, B, shape, out = _parabola(line, part * approach_mm)
    for _ in range(0 if settled else _FIXED_POINT_STEPS):
        before, part = part, float(shape.part_t)
        middle, B, shape, out = _parabola(line, part * approach_mm)
        if settled := abs(part - before) < _SETTLED:
            break
    place_square = (line.t_mm - middle) ** 2 * B / (float(shape.part_t) * approach_mm)
    root = np.sqrt(np.maximum(1.0 - place_square, 0.0))
    a = np.sqrt(float(shape.part_x) * approach_mm / line.A_per_mm)
    peak = line.contact_modulus_MPa * approach_mm / (a * float(shape.integral))
    if not settled:
        out.append("the level of the ellipse's own end is not found")
    below = len(regions(line.f_mm < part * approach_mm))
    if below > 1:
        out.append(f"{below} separate regions below the level, of which the ellipse has one")
    return strip_contact(line, approach_mm, a * root, peak * root, out)


def _parabola(line: GapLine, level_mm: float) -> tuple[float, float, EllipseShape, list[str]]:
    """Middle, coefficient, ellipse and faults of the parabola through both places where the gap is at a level (mm)."""
    first, last = next(run for run in regions(line.f_mm < level_mm) if run[0] <= line.touch <= run[1])
    low, high = crossings_mm(line, level_mm, first, last)
    B = level_mm / (0.5 * (high - low)) ** 2
    return 0.5 * (low + high), B, ellipse_shape(line.A_per_mm, B), end_notes(line, first, last)
