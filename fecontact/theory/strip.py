"""The strip method on a gap line."""

from __future__ import annotations

import math

import numpy as np

from fecontact.errors import InputError, check_positive
from fecontact.geometry.placement import Placement
from fecontact.theory.gap_line import GapLine, gap_line
from fecontact.theory.strip_contact import StripContact
from fecontact.theory.strip_method import Line, Load, Search, solve_strips

STRIPS = 100
_FEWEST_STRIPS = 20


def strip(line: GapLine, normal_force_N: float, *, strips: int = STRIPS) -> StripContact:
    """The strip method under a normal force; as `strip_at`."""
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
    Class of cost: some systems of as many equations as strips. Exact for constant curvature; the force grows with the
    approach, so that there is one solution.
    """
    check_positive("approach", approach_mm, "mm", "give how much the bodies come together")
    return _solved(line, strips, Load(approach=approach_mm))


def _solved(line: GapLine, strips: int, load: Load) -> StripContact:
    if strips < _FEWEST_STRIPS:
        raise InputError(f"number of strips is {strips}; allowed: {_FEWEST_STRIPS} and more; 100 are good to 0.1 %")
    found = solve_strips(
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
    half_length = np.sqrt(found.q)
    notes = []
    if found.at_end:
        notes.append("the patch reaches the end of the line; give a longer one")
    if not found.converged:
        notes.append(f"sweeps did not end: c and q still change by {100.0 * found.change:.1f} %")
    return StripContact(
        status="not converged" if not found.converged else "out of range" if notes else "solved",
        notes=tuple(notes),
        solutions=1,
        approach_mm=found.approach,
        normal_force_N=found.force,
        t_mm=found.t,
        width_mm=found.h,
        half_length_mm=half_length,
        centre_pressure_MPa=found.c * half_length,
    )


def gap_line_under_load(placement: Placement, normal_force_N: float, *, contact_modulus_MPa: float) -> GapLine:
    """Gap line of a wheel that a vertical load presses down: it slides along the tangent plane by the strips' approach.

    Range of validity: as `gap_line`; below a contact angle of 0.3 rad the slide changes no measure by more than 1 %.
    """
    line = gap_line(placement, contact_modulus_MPa=contact_modulus_MPa)
    slide = strip(line, normal_force_N).approach_mm * math.tan(placement.first.contact_angle_rad)
    return gap_line(placement, contact_modulus_MPa=contact_modulus_MPa, slide_mm=-slide)
