"""Deviations of theories from the strip method, by the measures of the verdict."""

from __future__ import annotations

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact.patch import find_ridge_peaks
from fecontact.contact_theories.approximation import TheoryContact
from fecontact.judging.measures import (
    MEASURES,
    compute_misplaced_fraction,
    compute_unmatched_load,
    read_theory_measures,
)

# Uncertainty of the strips against the half-space on the same gap: relative for a measure, absolute for a misfit. For
# S1002 on 60E1 at -6 to 6 mm under 60 to 120 kN, the peak is within 0.32 %, a within 1.8 %, b and the centre within
# 0.9 %. At 5 mm, where the patches are in two planes, the peak is within 1.7 % and a within 4.8 %.
STRIP_UNCERTAINTY = {
    **{"p_max_MPa": 0.005, "area_mm2": 0.01, "a_mm": 0.02, "b_mm": 0.01},
    **{"centre_over_b": 0.01, "valley": 0.01, "separate_load": 0.0005, "misplaced_load": 0.01},
}
# Number of nodes on the narrowest semi-axis of a half-space, and the factor of its uncertainty relative to
# `READING_UNCERTAINTY`.
SCREENING_NODES, COARSE_FACTOR = 16, 4.0
# Number of points along and across at which the pressures of two theories are compared.
_POINTS_ALONG, POINTS_ACROSS = 24, 160


def compare_with_strips(strips: TheoryContact, theory: TheoryContact) -> dict[str, float]:
    """Deviations of a theory from the strip method.

    Parameters
    ----------
    strips
        Contact by the strip method.
    theory
        Contact by a theory.

    Returns
    -------
    dict
        (theory - strips) / strips of each of `MEASURES`, and the `MISFITS` of the theory relative to the strips: the
        distance of the centres over the theory's half-width b, and differences of valley and loads as fractions of peak
        and load.
    """
    theory_measures, strip_measures = (read_theory_measures(contact).as_dict() for contact in (theory, strips))
    deviations = {name: theory_measures[name] / strip_measures[name] - 1.0 for name in MEASURES}
    distance_mm = strips.centre_mm[1] - theory.centre_mm[1]
    moved_mm = distance_mm if theory.single is not None else 0.0
    pressures = _evaluate_on_common_grid(strips, theory, moved_mm)
    loads = np.array([patch.normal_force_N for patch in strips.patches])
    separate_load = 1.0 - float(loads.max() / loads.sum())
    ends_mm = [(patch.low_mm[1], patch.high_mm[1]) for patch in strips.patches]
    return deviations | {
        "centre_over_b": distance_mm / theory.half_widths_mm[1],
        "valley": _measure_valley(pressures[0]) - _measure_valley(pressures[1]),
        "separate_load": separate_load if theory.single is not None else compute_unmatched_load(ends_mm, loads, theory),
        "misplaced_load": compute_misplaced_fraction(*pressures),
    }


def _evaluate_on_common_grid(strips: TheoryContact, theory: TheoryContact, moved_mm: float) -> tuple[Floats, Floats]:
    """Pressures of both theories in MPa on the middles of equal cells, (24, 160).

    The cells cover a quarter of both contacts. The second theory is moved across by `moved_mm`.
    """
    (_, low), (length, high) = strips.box_mm
    (_, other_low), (other_length, other_high) = theory.box_mm
    low, high = min(low, other_low + moved_mm), max(high, other_high + moved_mm)
    x = (np.arange(_POINTS_ALONG) + 0.5) / _POINTS_ALONG * max(length, other_length)
    s = low + (np.arange(POINTS_ACROSS) + 0.5) / POINTS_ACROSS * (high - low)
    return evaluate_pressure(strips, x, s), evaluate_pressure(theory, x, s - moved_mm)


def evaluate_pressure(theory: TheoryContact, x: Floats, s: Floats) -> Floats:
    """Pressure of a theory at all places (x, s).

    Parameters
    ----------
    theory
        Contact by a theory.
    x, s : ndarrays of shapes (n,), (m,)
        Places along and across in mm.

    Returns
    -------
    array (n, m)
        Pressure in MPa.
    """
    patch_pressures = [
        patch.shape.pressure_MPa(x[:, None] - patch.origin_mm[0], s[None, :] - patch.origin_mm[1])
        for patch in theory.patches
    ]
    return np.asarray(sum(patch_pressures))


def _measure_valley(pressure: Floats) -> float:
    """Largest prominence of a peak other than the highest, along x = 0.

    It is relative to the highest peak.
    """
    return find_ridge_peaks(np.concatenate(([0.0], pressure[0], [0.0])), 0.0)[1]
