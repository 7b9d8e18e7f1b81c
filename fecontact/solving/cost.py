"""Estimated cost of a case: unknowns of its first meshes, CPU time and memory."""

from __future__ import annotations

from fecontact.case import Case

START_SECONDS = 1.0
"""CPU seconds for the start of the program and the position."""
# Unknowns of both bodies for n_x by n_s elements in the zone of a half model: nineteen meshes of 8 by 17 to 40 by 109
# elements have 0.93 to 1.11 of the estimate (60E1 and a cylinder; quick, standard and fine).
_UNKNOWNS_FACTOR, _ELEMENTS_X_EXPONENT, _ADDED_ELEMENTS_S = 286.0, 0.66, 7.6
# Unknowns of a whole model divided by the unknowns of a half model.
_WHOLE_MODEL_FACTOR = 2.0
_REFERENCE_UNKNOWNS, _REFERENCE_SECONDS, _SECONDS_EXPONENT = 28_250.0, 1.5, 1.16
# Factor on the time if bodies yield: 3.5 at -4 mm, 4.4 at 3 mm, 4.0 at 0 mm and 3.7 with a yaw (`quick`), 6.2 at 3 mm
# (`standard`), S1002 on 60E1, 100 kN, 450 MPa. First yield is at a peak of 1.6 yield stresses (Hertz). Yield stresses
# that are 15 % lower are solved too, which gives 1.4; at 1.3 yielding takes no time.
_YIELD_FACTOR, _FIRST_YIELD_PEAK = 4.0, 1.4
# The memory of the factors grows more than in proportion to the unknowns.
_BASE_GB, _REFERENCE_GB, _GB_EXPONENT = 0.15, 0.115, 1.16


def estimate_unknowns(elements_x: int, elements_s: int, *, half: bool) -> float:
    """Estimated degrees of freedom of both meshes.

    Parameters
    ----------
    elements_x, elements_s
        Number of elements along x and across in the fine zone.
    half
        Whether the meshes are half models.

    Returns
    -------
    float
        Degrees of freedom, rounded.
    """
    return float(
        round(
            _UNKNOWNS_FACTOR
            * elements_x**_ELEMENTS_X_EXPONENT
            * (elements_s + _ADDED_ELEMENTS_S)
            * (1.0 if half else _WHOLE_MODEL_FACTOR)
        )
    )


def estimate_cpu_seconds(unknowns: float) -> float:
    """CPU seconds of a solution on a single thread, without `START_SECONDS`.

    The coarser meshes and the half-spaces are included. Measured by `fecontact solve --refine never` of S1002 on 60E1
    under 100 kN, by PARDISO on one core (AMD EPYC, virtual, 2026): -2, 1, 3, 5, 5.5 and 6 mm at `quick`, 1, 3 and 6 mm
    at `standard` and `fine`, and 3 mm with a yaw; 28 to 256 thousand unknowns. The sum of user and system seconds
    agrees within 22 %; at 6 mm on the finer meshes it is up to 45 % larger. In the flange root the first mesh may have
    to grow and is made twice: at 6.3 mm, 100 kN it takes 23 s, where the estimate is 9 s.

    Parameters
    ----------
    unknowns
        Unknowns of the finest meshes of a case.

    Returns
    -------
    float
        Time in s.
    """
    return float(_REFERENCE_SECONDS * (unknowns / _REFERENCE_UNKNOWNS) ** _SECONDS_EXPONENT)


def estimate_yield_factor(case: Case, p_max_MPa: float) -> float:
    """Factor on the time of a load if bodies yield under its peak pressure.

    Parameters
    ----------
    case
        Case with the yield stresses.
    p_max_MPa
        Elastic peak pressure in MPa.

    Returns
    -------
    float
        Factor (-); 1 if no body yields.
    """
    yield_stresses_MPa = [
        material.yield_MPa for material in (case.rail_material, case.wheel_material) if material.yield_MPa is not None
    ]
    return _YIELD_FACTOR if yield_stresses_MPa and p_max_MPa > _FIRST_YIELD_PEAK * min(yield_stresses_MPa) else 1.0


def estimate_memory_GB(unknowns: float) -> float:
    """Largest memory in GB of the solving process, for the unknowns of its finest meshes.

    Measured with a process for each case: 57 to 433 thousand unknowns at 6, 5.5, 3 and 1 mm agree within 10 %. A whole
    model takes a fifth less, since each of its halves has a factorisation.

    Parameters
    ----------
    unknowns
        Unknowns of the finest meshes of a case.

    Returns
    -------
    float
        Memory in GB.
    """
    return float(_BASE_GB + _REFERENCE_GB * (unknowns / _REFERENCE_UNKNOWNS) ** _GB_EXPONENT)
