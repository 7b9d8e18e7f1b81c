"""About what the solution of a case takes: unknowns of its first meshes, CPU time and memory."""

from __future__ import annotations

START_SECONDS = 0.9
"""CPU seconds of the start of the program and the position."""
# Unknowns of both bodies for n_x by n_s elements in the zone of a half model: eight meshes of 8 by 16 to 13 by 50
# elements have 0.93 to 1.06 of it (60E1, a cylinder, A120; quick and standard).
_UNKNOWNS, _MORE_X, _MORE_S = 125.0, 0.2, 14.4
# Of a model without symmetry over those of half of it.
_WHOLE = 2.0
_ONE_PATCH, _SECONDS, _SECONDS_POWER = 33_900.0, 2.6, 1.1
_BASE_GB, _GB_PER_UNKNOWN = 0.077, 8.2e-6


def unknowns_of(elements_x: int, elements_s: int, *, half: bool) -> float:
    """Degrees of freedom of meshes with so many elements along x and across in their fine zone."""
    return _UNKNOWNS * (elements_x + _MORE_X) * (elements_s + _MORE_S) * (1.0 if half else _WHOLE)


def cpu_seconds(unknowns: float) -> float:
    """CPU seconds of a solution on one thread, with the coarser meshes and the half-spaces, but for `START_SECONDS`.

    Measured by `fecontact solve --refine-degrees-of-freedom 0` of S1002 on 60E1 under 100 kN, by PARDISO on one core
    (AMD EPYC, virtual, 2026): -6, -2, 0, 1, 3 and 5 mm at `quick`, 1 and 3 mm at `standard`, 3 mm at `fine`, and 3 mm
    with a yaw; 32 to 183 thousand unknowns. Users' and system's seconds are met to 10 % on one patch, and are up to
    40 % more where several patches make half-spaces dear.
    """
    return float(_SECONDS * (unknowns / _ONE_PATCH) ** _SECONDS_POWER)


def memory_GB(unknowns: float) -> float:
    """Largest memory of the process that solves; of the same measurements, to 12 %."""
    return _BASE_GB + _GB_PER_UNKNOWN * unknowns
