"""Strip method on a gap line, and the gap line of a wheel under load."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from fecontact.arrays import Floats, find_range_below, find_runs
from fecontact.contact.patch import find_ridge_peaks
from fecontact.contact_theories.gap_line import (
    GapLine,
    StripContact,
    build_gap_line,
)
from fecontact.contact_theories.strip_method import (
    DEFAULT_STRIPS,
    StripGap,
    StripLoad,
    StripSearch,
    StripSolution,
    solve_strips_of_lines,
)
from fecontact.errors import InputError, check_positive
from fecontact.placement.wheel_on_rail import Placement

# --- Strip method on a gap line.

_MIN_STRIPS = 20
# With this number of strips, the approach is within 0.02 % of the approach with 100 strips.
_SLIDE_STRIPS = 32
# Above this contact angle the slide changes the approach, and the slide is calculated again from this approach: this
# number of slides in all. With a single slide the peak of A65 under an APTA340 wheel at -7.76 mm, 250 kN (75 degrees, a
# slide of 1.6 mm in a patch 3.2 mm wide) is 27 % too high.
_STEEP_RAD, _STEEP_SLIDES = math.radians(30.0), 4
# Strips narrower than half a step of the gap line resolve the kinks between its places: with five strips per step the
# peak of a patch that is 0.4 mm wide and 15 times as long is 6.6 % too high, on a smooth curve 0.5 %.
_MAX_STRIPS_PER_STEP = 2
# Largest turn of the surface within a patch (rad) for which a single plane is enough. Of 600 random library positions
# three have a peak or an area outside 5 and 10 % of the half-space: with a turn of 0.29 and 0.45 rad the area is 10 and
# 13 % too large, with 0.81 rad peak and area are 12 and 21 % too large. Of another 4000, one with a turn of 0.49 rad
# has a peak 6 % too low and an area 8 % too large.
_MAX_TURN_RAD = 0.5
# A patch that has just closed is pressed in by a small part of the approach, so that its area changes much with the
# approach. The approach is within 0.8 % for patches up to 7 times as long as wide, and 2.4 % too small up to 16 times
# (600 random library positions). 2 % of it may change the area by 10 %.
_APPROACH_ERROR, _MAX_AREA_ERROR = 0.02, 0.10
# A lobe with fewer strips between its peak and a valley or an edge may be higher on finer strips: A150 under an APTA240
# wheel at -4.87 mm, 100 kN, has 967 MPa in a lobe 0.3 mm wide at the edge of a patch 16 mm wide, and 898 MPa on 100
# strips. The number of strips is then multiplied by these factors, until the peak changes by less than this fraction.
_LEAST_STRIPS_PER_SIDE = 4
_FINER_STRIPS, _MAX_PEAK_CHANGE = (2, 4), 0.01
_HIGH_PEAK, _LEAST_VALLEY = 0.8, 0.05


def solve_strip_theory(line: GapLine, normal_force_N: float, *, strips: int = DEFAULT_STRIPS) -> StripContact:
    """Contact by the strip method under a normal force.

    Equations, source and range of validity are in `strip_method`.

    Parameters
    ----------
    line
        Gap line.
    normal_force_N
        Force, > 0.
    strips
        Number of strips across the patch, at least 20.

    Returns
    -------
    StripContact
        Half length and pressure of each strip, and the approach.

    Raises
    ------
    InputError
        If the force is not positive, or there are too few strips.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.contact_theories.gap_line import GapLine
    >>> from fecontact.contact_theories.hertz import hertz_ellipse
    >>> from fecontact.contact_theories.strips import solve_strip_theory
    >>> t = np.linspace(-5.0, 5.0, 501)
    >>> line = GapLine(t_mm=t, f_mm=0.005 * t**2, A_per_mm=0.002, contact_modulus_MPa=115e3)
    >>> exact = hertz_ellipse(0.002, 0.005, normal_force_N=1e4, contact_modulus_MPa=115e3)
    >>> bool(abs(solve_strip_theory(line, 1e4).p_max_MPa / exact.p0_MPa - 1.0) < 0.003)
    True
    """
    (contact,) = solve_strip_theory_on_lines([line], [normal_force_N], strips=strips)
    return contact


def solve_strip_theory_on_lines(
    lines: Sequence[GapLine], normal_forces_N: Sequence[float], *, strips: int = DEFAULT_STRIPS
) -> list[StripContact]:
    """Contacts by the strip method on many gap lines, each under its normal force.

    The lines are solved together, in a part of the time of one after the other. Each contact is exactly the contact by
    `solve_strip_theory`.

    Parameters
    ----------
    lines
        Gap lines.
    normal_forces_N
        Force on each line, > 0.
    strips
        Number of strips across each patch, at least 20.

    Returns
    -------
    list of StripContact
        Contacts in the order of the lines.

    Raises
    ------
    InputError
        If a force is not positive, or there are too few strips.
    """
    for normal_force_N in normal_forces_N:
        check_positive("normal force", normal_force_N, "N", "give the compressive force")
    return _solve(lines, strips, [StripLoad(force=normal_force_N) for normal_force_N in normal_forces_N])


def solve_strip_theory_at_approach(line: GapLine, approach_mm: float, *, strips: int = DEFAULT_STRIPS) -> StripContact:
    """Contact by the strip method at an approach.

    Equations, source and range of validity are in `strip_method`.

    Parameters
    ----------
    line
        Gap line.
    approach_mm
        Approach of the bodies, > 0.
    strips
        Number of strips across the patch, at least 20.

    Returns
    -------
    StripContact
        Half length and pressure of each strip, and the force.

    Raises
    ------
    InputError
        If the approach is not positive, or there are too few strips.

    Notes
    -----
    Class of cost: a few linear systems with an equation per strip. Exact for constant curvature. The force increases
    with the approach, so that there is a single solution.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.contact_theories.gap_line import GapLine
    >>> from fecontact.contact_theories.strips import solve_strip_theory_at_approach
    >>> t = np.linspace(-5.0, 5.0, 501)
    >>> line = GapLine(t_mm=t, f_mm=0.005 * t**2, A_per_mm=0.005, contact_modulus_MPa=115e3)
    >>> force_N = solve_strip_theory_at_approach(line, 0.01).normal_force_N
    >>> bool(abs(force_N / (4.0 / 3.0 * 115e3 * 100.0**0.5 * 0.01**1.5) - 1.0) < 0.003)
    True
    """
    check_positive("approach", approach_mm, "mm", "give the displacement of the bodies towards each other")
    (contact,) = _solve([line], strips, [StripLoad(approach=approach_mm)])
    return contact


def _strip_method_line(line: GapLine, refinement: int = 1) -> StripGap:
    """Gap line for the strip method, with more places on a smooth curve through the places of the line.

    `refinement` is the number of steps for each step of the gap line; with 1 the places are unchanged.
    """
    t_mm = np.linspace(line.t_mm[0], line.t_mm[-1], refinement * (line.t_mm.size - 1) + 1)
    surface_mm, f_mm, turned_rad = (
        values if refinement == 1 else CubicSpline(line.t_mm, values)(t_mm)
        for values in (line.surface_mm, line.f_mm, line.turned_rad)
    )
    return StripGap(t=surface_mm, f=f_mm, A=line.A_per_mm, E=line.contact_modulus_MPa, closing=np.cos(turned_rad))


def _solve(lines: Sequence[GapLine], strips: int, loads: Sequence[StripLoad]) -> list[StripContact]:
    """Solve the strip method on gap lines.

    `strips` is the requested number of strips across the patch, and `loads` are forces or approaches. A gap line that
    is too coarse for the narrowest strip is refined.

    Raises
    ------
    InputError
        If the number of strips is below `_MIN_STRIPS`.
    """
    if strips < _MIN_STRIPS:
        raise InputError(f"number of strips is {strips}; allowed: at least {_MIN_STRIPS}; 100 are accurate to 0.1 %")
    solutions = _solve_on_strips(lines, strips, loads)
    return [
        _make_contact(line, *_resolve_peak(line, strips, load, solution))
        for line, load, solution in zip(lines, loads, solutions, strict=True)
    ]


def _resolve_peak(
    line: GapLine, strips: int, load: StripLoad, solution: StripSolution
) -> tuple[StripSolution, tuple[str, ...]]:
    """Solution on finer strips if a high lobe is narrow.

    A note is returned if the finest strips do not resolve the lobe.

    Parameters
    ----------
    line
        Gap line.
    strips
        Number of strips of the solution.
    load
        Force or approach.
    solution
        Contact on these strips.

    Returns
    -------
    solution, notes
        The contact on the strips with half the width as long as the peak pressure changes.
    """
    change = 0.0
    for factor in _FINER_STRIPS:
        if not solution.converged or not _has_narrow_peak(solution):
            return solution, ()
        (finer,) = _solve_on_strips([line], factor * strips, [load])
        change = abs(_peak_pressure(finer) / _peak_pressure(solution) - 1.0)
        if not finer.converged:
            break
        solution = finer
        if change <= _MAX_PEAK_CHANGE:
            return solution, ()
    return solution, (
        f"a lobe of the pressure is narrower than {_LEAST_STRIPS_PER_SIDE} strips: the peak changes by"
        f" {100.0 * change:.0f} % on strips of half the width",
    )


def _peak_pressure(solution: StripSolution) -> float:
    """Largest pressure of a strip in MPa."""
    return float((solution.c * np.sqrt(solution.q)).max())


def _has_narrow_peak(solution: StripSolution) -> bool:
    """Whether a high lobe has few strips on a side of its peak.

    A lobe is high if its peak is at least `_HIGH_PEAK` of the largest pressure, and it is a lobe if the pressure falls
    by `_LEAST_VALLEY` of this pressure on both sides.
    """
    ridge = np.concatenate(([0.0], solution.c * np.sqrt(solution.q), [0.0]))
    highest = float(ridge.max())
    peaks, _ = find_ridge_peaks(ridge, _LEAST_VALLEY)
    for peak in peaks[ridge[peaks] >= _HIGH_PEAK * highest]:
        # a lobe ends at the lowest place before the next higher strip; of several, at the nearest
        start, stop = find_range_below(ridge, int(peak))
        strips_left, strips_right = np.argmin(ridge[start : peak + 1][::-1]), np.argmin(ridge[peak:stop])
        if min(strips_left, strips_right) < _LEAST_STRIPS_PER_SIDE:
            return True
    return False


def _solve_on_strips(lines: Sequence[GapLine], strips: int, loads: Sequence[StripLoad]) -> list[StripSolution]:
    """Solve the strip method on gap lines, with smooth lines where strips are narrow."""
    search = StripSearch(strips=strips)
    solutions = solve_strips_of_lines(list(map(_strip_method_line, lines)), loads, search)
    refinements = {
        number: refinement
        for number, (line, solution) in enumerate(zip(lines, solutions, strict=True))
        if (refinement := math.ceil(line.step_mm / float(solution.h.min()))) > _MAX_STRIPS_PER_STEP
    }
    refined_lines = [_strip_method_line(lines[number], refinement) for number, refinement in refinements.items()]
    refined = solve_strips_of_lines(refined_lines, [loads[number] for number in refinements], search)
    for number, solution in zip(refinements, refined, strict=True):
        solutions[number] = solution
    return solutions


def _make_contact(line: GapLine, solution: StripSolution, lobe_notes: tuple[str, ...] = ()) -> StripContact:
    """Contact of a solution, with notes on its problems.

    Notes: `lobe_notes`, the patch reaches the end of the line, the surface turns by more than `_MAX_TURN_RAD`, the
    area depends on the approach by too much, or the sweeps did not converge.
    """
    half_length = np.sqrt(solution.q)
    notes = [*lobe_notes]
    if solution.at_end:
        notes.append("the patch reaches the end of the gap line; give longer profiles")
    if (turn_rad := _turn_within_patch(line, solution.t, half_length)) > _MAX_TURN_RAD:
        notes.append(
            f"the surface turns by {turn_rad:.2f} rad within a patch; a single plane is valid up to"
            f" {_MAX_TURN_RAD:g} rad"
        )
    if (area_error := _estimate_area_error(line, solution)) > _MAX_AREA_ERROR:
        notes.append(
            f"a patch has just closed: an error of {100.0 * _APPROACH_ERROR:g} % of the approach changes the area by"
            f" {100.0 * area_error:.0f} %"
        )
    if not solution.converged:
        notes.append(f"the iteration did not converge: c and q still change by {100.0 * solution.change:.1f} %")
    return StripContact(
        status="not converged" if not solution.converged else "out of range" if notes else "solved",
        notes=tuple(notes),
        solutions=1,
        approach_mm=solution.approach,
        normal_force_N=solution.force,
        t_mm=solution.t,
        width_mm=solution.h,
        half_length_mm=half_length,
        centre_pressure_MPa=solution.c * half_length,
    )


def _estimate_area_error(line: GapLine, solution: StripSolution) -> float:
    """Relative change of the area of several patches if the approach changes by `_APPROACH_ERROR`.

    It is 0 for a single patch. Each patch has the approach, the force and the area of Hertz's circle:
    d = 3 N / (4 E* sqrt(area / pi)), and an area in proportion to d.
    """
    half_length_mm = np.sqrt(solution.q)
    patches = [slice(first, last + 1) for first, last in find_runs(half_length_mm > 0.0)]
    if len(patches) < 2:
        return 0.0
    areas = np.array([2.0 * float(solution.h[patch] @ half_length_mm[patch]) for patch in patches])
    forces = np.array([0.5 * np.pi * float((solution.h * solution.c)[patch] @ solution.q[patch]) for patch in patches])
    approaches = 0.75 * forces / (line.contact_modulus_MPa * np.sqrt(areas / np.pi))
    return float(_APPROACH_ERROR * (areas / areas.sum()) @ (solution.approach / approaches))


def _turn_within_patch(line: GapLine, t_mm: Floats, half_length_mm: Floats) -> float:
    """Largest turn (rad) of the surface between the outer strips of a patch."""
    turned_rad = np.interp(t_mm, line.surface_mm, line.turned_rad)
    return max(
        (float(np.ptp(turned_rad[first : last + 1])) for first, last in find_runs(half_length_mm > 0.0)), default=0.0
    )


def build_gap_line_under_load(placement: Placement, normal_force_N: float, *, contact_modulus_MPa: float) -> GapLine:
    """Gap line of a wheel under a vertical load.

    The wheel slides along the tangent plane by approach times tan(contact angle).

    Parameters
    ----------
    placement
        Placed wheel and rail.
    normal_force_N
        Force along the contact normal, > 0.
    contact_modulus_MPa
        E* of the pair.

    Returns
    -------
    GapLine
        Gap after the slide.

    Notes
    -----
    Range of validity: as in `gap_line`. Below a contact angle of 0.3 rad the slide changes no measure by more than 1 %.
    """
    (line,) = build_gap_lines_under_loads([placement], [normal_force_N], contact_modulus_MPa=contact_modulus_MPa)
    return line


def build_gap_lines_under_loads(
    placements: Sequence[Placement], normal_forces_N: Sequence[float], *, contact_modulus_MPa: float
) -> list[GapLine]:
    """Gap lines of many placements, as by `build_gap_line_under_load`.

    Parameters
    ----------
    placements
        Placed wheels and rails; one placement may be there several times.
    normal_forces_N
        Force along the contact normal of each placement, > 0.
    contact_modulus_MPa
        E* of all pairs.

    Returns
    -------
    list of GapLine
        Gaps after the slides, in the order of the placements.
    """
    lines = [build_gap_line(placement, contact_modulus_MPa=contact_modulus_MPa) for placement in placements]
    numbers = list(range(len(lines)))
    for _ in range(_STEEP_SLIDES):
        loads = [StripLoad(force=normal_forces_N[number]) for number in numbers]
        solutions = _solve_on_strips([lines[number] for number in numbers], _SLIDE_STRIPS, loads)
        for number, solution in zip(numbers, solutions, strict=True):
            lines[number] = build_gap_line(
                placements[number],
                contact_modulus_MPa=contact_modulus_MPa,
                slide_mm=-solution.approach * math.tan(placements[number].first.contact_angle_rad),
            )
        numbers = [number for number in numbers if abs(placements[number].first.contact_angle_rad) > _STEEP_RAD]
    return lines
