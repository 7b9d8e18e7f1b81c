"""The strip method on a gap line."""

from __future__ import annotations

import math

import numpy as np
from scipy.interpolate import CubicSpline

from fecontact.arrays import Floats
from fecontact.contact_theories.gap_line import (
    GapLine,
    StripContact,
    gap_line,
)
from fecontact.contact_theories.strip_method import Line, Load, Search, solve_strips
from fecontact.errors import InputError, check_positive
from fecontact.placement.wheel_on_rail import Placement

# --- The strip method on a gap line.

STRIPS = 100
_FEWEST_STRIPS = 20
# They give the approach within 0.02 % of 100.
_STRIPS_OF_SLIDE = 32
# Strips narrower than half a step of the line see the kinks between its places: with five strips a step the peak of a
# patch that is 0.4 mm wide and 15 times as long is 6.6 % too high, on a smooth curve 0.5 %.
_MOST_STRIPS_A_STEP = 2
# Largest turn of the surface within a patch (rad) for which a single plane is enough. Of 600 random library positions
# three have a peak or an area outside 5 and 10 % of the half-space: with a turn of 0.29 and 0.45 rad the area is 10 and
# 13 % too large, with 0.81 rad peak and area are 12 and 21 % too large.
_LARGEST_TURN_RAD = 0.5


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


def _line_of(line: GapLine, finer: int = 1) -> Line:
    """A gap line for the strip method, with so many places for each of its own, on a smooth curve through these."""
    t = np.linspace(line.t_mm[0], line.t_mm[-1], finer * (line.t_mm.size - 1) + 1)
    surface, f, turned = (
        values if finer == 1 else CubicSpline(line.t_mm, values)(t)
        for values in (line.surface_mm, line.f_mm, line.turned_rad)
    )
    return Line(t=surface, f=f, A=line.A_per_mm, E=line.contact_modulus_MPa, closing=np.cos(turned))


def _solved(line: GapLine, strips: int, load: Load) -> StripContact:
    if strips < _FEWEST_STRIPS:
        raise InputError(f"number of strips is {strips}; allowed: {_FEWEST_STRIPS} and more; 100 are good to 0.1 %")
    search = Search(strips=strips)
    solved = solve_strips(_line_of(line), load, search)
    finer = math.ceil(line.step_mm / float(solved.h.min()))
    if finer > _MOST_STRIPS_A_STEP:
        solved = solve_strips(_line_of(line, finer), load, search)
    half_length = np.sqrt(solved.q)
    notes = []
    if solved.at_end:
        notes.append("the patch reaches the end of the line; give a longer one")
    if (turn := _turn_within_patch(line, solved.t, solved.h)) > _LARGEST_TURN_RAD:
        notes.append(
            f"the surface turns by {turn:.2f} rad within a patch; one plane is enough up to {_LARGEST_TURN_RAD:g} rad"
        )
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


def _turn_within_patch(line: GapLine, t_mm: Floats, width_mm: Floats) -> float:
    """Largest turn (rad) of the surface between the ends of a patch of adjacent strips."""
    turned_rad = np.interp(t_mm, line.surface_mm, line.turned_rad)
    ends = np.flatnonzero(np.diff(t_mm) > 0.75 * (width_mm[:-1] + width_mm[1:])) + 1
    return max(float(np.ptp(patch)) for patch in np.split(turned_rad, ends))


def gap_line_under_load(placement: Placement, normal_force_N: float, *, contact_modulus_MPa: float) -> GapLine:
    """Gap line of a wheel under a vertical load, which slides along the tangent plane by approach times tan(angle).

    Range of validity: as in `gap_line`; below a contact angle of 0.3 rad the slide changes no measure by more than 1 %.
    """
    line = gap_line(placement, contact_modulus_MPa=contact_modulus_MPa)
    approach = strip(line, normal_force_N, strips=_STRIPS_OF_SLIDE).approach_mm
    slide = -approach * math.tan(placement.first.contact_angle_rad)
    return gap_line(placement, contact_modulus_MPa=contact_modulus_MPa, slide_mm=slide)
