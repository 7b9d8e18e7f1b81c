"""About what the solution of a case takes: unknowns of its first meshes, CPU time and memory."""

from __future__ import annotations

from fecontact.case import Case

START_SECONDS = 1.0
"""CPU seconds of the start of the program and the position."""
# Unknowns of both bodies for n_x by n_s elements in the zone of a half model: nineteen meshes of 8 by 17 to 40 by 109
# elements have 0.93 to 1.11 of it (60E1 and a cylinder; quick, standard and fine).
_UNKNOWNS, _POWER_X, _MORE_S = 286.0, 0.66, 7.6
# Unknowns of a whole model over the unknowns of half of it.
_WHOLE = 2.0
_ONE_PATCH, _SECONDS, _SECONDS_POWER = 28_250.0, 1.5, 1.16
# A load at which bodies yield takes so many times as long: 3.5 at -4 mm, 4.4 at 3 mm, 4.0 at 0 mm and 3.7 with a yaw
# (`quick`), 6.2 at 3 mm (`standard`), S1002 on 60E1, 100 kN, 450 MPa. First yield is at a peak of 1.6 yield stresses
# (Hertz), of which stresses 15 % lower, which are solved too, make 1.4; at 1.3 it takes no time.
_YIELDING, _PEAK_OF_YIELD = 4.0, 1.4
# Factors fill in by more than in proportion.
_BASE_GB, _GB, _GB_POWER = 0.15, 0.115, 1.16


def unknowns_of(elements_x: int, elements_s: int, *, half: bool) -> float:
    """Degrees of freedom of meshes with so many elements along x and across in their fine zone."""
    return float(round(_UNKNOWNS * elements_x**_POWER_X * (elements_s + _MORE_S) * (1.0 if half else _WHOLE)))


def cpu_seconds(unknowns: float) -> float:
    """CPU seconds of a solution on one thread, with the coarser meshes and the half-spaces, but for `START_SECONDS`.

    Measured by `fecontact solve --refine never` of S1002 on 60E1 under 100 kN, by PARDISO on one core
    (AMD EPYC, virtual, 2026): -2, 1, 3, 5, 5.5 and 6 mm at `quick`, 1, 3 and 6 mm at `standard` and `fine`, and 3 mm
    with a yaw; 28 to 256 thousand unknowns. Users' and system's seconds are met to 22 %, and are
    up to 45 % more at 6 mm on the finer meshes.
    In the flange root the first mesh may have to grow and is made twice: at 6.3 mm, 100 kN 23 s, where 9 s are told.
    """
    return float(_SECONDS * (unknowns / _ONE_PATCH) ** _SECONDS_POWER)


def times_by_yielding(case: Case, p_max_MPa: float) -> float:
    """How many times as long a load takes because bodies yield under its peak pressure."""
    stresses = [one.yield_MPa for one in (case.rail_material, case.wheel_material) if one.yield_MPa is not None]
    return _YIELDING if stresses and p_max_MPa > _PEAK_OF_YIELD * min(stresses) else 1.0


def memory_GB(unknowns: float) -> float:
    """Largest memory of the process that solves, with so many unknowns in its finest meshes.

    Met to 10 % by one process each: 57 to 433 thousand unknowns at 6, 5.5, 3 and 1 mm. A whole model takes a fifth
    less, since its halves have a factor each.
    """
    return float(_BASE_GB + _GB * (unknowns / _ONE_PATCH) ** _GB_POWER)
