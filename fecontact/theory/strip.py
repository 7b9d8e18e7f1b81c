"""The strip method on a gap line."""

from __future__ import annotations

import numpy as np

from fecontact.errors import InputError, check_positive
from fecontact.theory.gap_line import GapLine
from fecontact.theory.strip_contact import StripContact
from fecontact.theory.strip_method import Strips, solve_strips

STRIPS = 100
_FEWEST_STRIPS = 20


def strip(line: GapLine, normal_force_N: float, *, strips: int = STRIPS) -> StripContact:
    """The strip method under a normal force; as `strip_at`."""
    check_positive("normal force", normal_force_N, "N", "give the compressive force")
    _check_strips(strips)
    return _told(
        line,
        solve_strips(
            line.t_mm, line.f_mm, line.A_per_mm, line.contact_modulus_MPa, force=normal_force_N, strips=strips
        ),
    )


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
    _check_strips(strips)
    return _told(
        line,
        solve_strips(
            line.t_mm, line.f_mm, line.A_per_mm, line.contact_modulus_MPa, approach=approach_mm, strips=strips
        ),
    )


def _check_strips(strips: int) -> None:
    if strips < _FEWEST_STRIPS:
        raise InputError(f"number of strips is {strips}; allowed: {_FEWEST_STRIPS} and more; 100 are good to 0.1 %")


def _told(line: GapLine, found: Strips) -> StripContact:
    half_length = np.sqrt(found.q)
    notes = []
    if found.at_end:
        notes.append("the patch reaches the end of the line; give a longer one")
    if not found.converged:
        notes.append(f"sweeps did not end: c and q still change by {100.0 * found.change:.1f} %")
    return StripContact(
        theory="strip",
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
