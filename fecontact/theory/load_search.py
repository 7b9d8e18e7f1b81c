"""All approaches at which a theory carries a load: its force need neither grow steadily nor be continuous."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fecontact.errors import check_positive
from fecontact.theory.gap_line import LEAST_B_PER_MM, GapLine
from fecontact.theory.strip_contact import StripContact

AtApproach = Callable[[float], StripContact]

# Approaches from LOWEST to HIGHEST times Hertz's at the touch point, in steps of a factor.
_LOWEST, _HIGHEST, _FACTOR = 0.25, 2.0, 1.05
_BISECTIONS = 60
# The force is met to this part, or it jumps over the load.
_MET = 1e-9
_JUMP = 2e-3


def under_load(line: GapLine, normal_force_N: float, at_approach: AtApproach) -> StripContact:
    """Contact at the smallest approach that carries a load, with the number of all that were found.

    Approaches between a quarter of Hertz's and twice it are looked at, in steps of 5 %: two solutions between
    neighbouring steps are not seen. Further up and down where the load is not met there.

    Raises
    ------
    InputError
        If the load is not positive.
    """
    check_positive("normal force", normal_force_N, "N", "give the compressive force")
    guess = approach_of_hertz_mm(line, normal_force_N)
    ladder = guess * _LOWEST * _FACTOR ** np.arange(np.ceil(np.log(_HIGHEST / _LOWEST) / np.log(_FACTOR)) + 1)
    steps = [float(approach) for approach in ladder]
    above = [at_approach(approach).normal_force_N >= normal_force_N for approach in steps]
    while above[0] and len(steps) < 1000:
        steps.insert(0, steps[0] / _FACTOR)
        above.insert(0, at_approach(steps[0]).normal_force_N >= normal_force_N)
    while not above[-1] and len(steps) < 1000:
        steps.append(steps[-1] * _FACTOR)
        above.append(at_approach(steps[-1]).normal_force_N >= normal_force_N)
    changes = [number for number in range(len(steps) - 1) if above[number] != above[number + 1]]
    if not changes:
        return replace(
            at_approach(steps[-1]),
            status="not converged",
            solutions=0,
            notes=(f"no approach up to {steps[-1]:.3g} mm carries {normal_force_N:g} N",),
        )
    first = changes[0]
    contact = _bisected(at_approach, normal_force_N, steps[first], steps[first + 1])
    return _told(contact, normal_force_N, len(changes))


def approach_of_hertz_mm(line: GapLine, normal_force_N: float) -> float:
    """Approach of Hertz's ellipse with the curvature at the touch point, a least one where that is flat or concave."""
    B = max(float(line.B_per_mm[line.touch]), LEAST_B_PER_MM)
    part_t, integral = (float(v[line.touch]) for v in (line.own_ellipses.part_t, line.own_ellipses.integral))
    # N = (2 pi / 3) a b p0 with a, b and p0 of the approach
    per_approach = (part_t / B) ** 0.5 * 2.0 * np.pi * line.contact_modulus_MPa / (3.0 * integral)
    return float((normal_force_N / per_approach) ** (2.0 / 3.0))


def _bisected(at_approach: AtApproach, wanted: float, low: float, high: float) -> StripContact:
    """The force passes the wanted one between both approaches, upwards or downwards."""
    upwards = at_approach(low).normal_force_N < wanted
    middle = at_approach(0.5 * (low + high))
    for _ in range(_BISECTIONS):
        if abs(middle.normal_force_N / wanted - 1.0) < _MET:
            break
        if (middle.normal_force_N < wanted) == upwards:
            low = middle.approach_mm
        else:
            high = middle.approach_mm
        middle = at_approach(0.5 * (low + high))
    return middle


def _told(contact: StripContact, wanted: float, solutions: int) -> StripContact:
    notes = list(contact.notes)
    status = contact.status
    if solutions > 1:
        notes.append(f"{solutions} approaches carry {wanted:g} N; this is the smallest")
        status = "several solutions" if status == "solved" else status
    if abs(contact.normal_force_N / wanted - 1.0) > _JUMP:
        notes.append(f"the force jumps over {wanted:g} N at this approach: here it is {contact.normal_force_N:g} N")
        status = "jump" if status == "solved" else status
    return replace(contact, solutions=solutions, notes=tuple(notes), status=status)
