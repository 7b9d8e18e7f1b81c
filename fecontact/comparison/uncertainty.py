"""Numerical uncertainty of a measure from the same case on several meshes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from fecontact.comparison.measures import CUT_PLANES, FLOORS, IN_COMMON, MEASURES, NOISE
from fecontact.contact.elements import COMPLIANCE_LIMIT

# Ratio of the element sizes of neighbouring meshes.
MESH_RATIO = 1.5
# The error that is left is this part of the change between meshes or less; studies/12_uncertainty.py counts how often.
# Of three meshes the last change alone holds the peak of 88 % of exact contacts, with the one before 99 %.
_OF_THE_CHANGE = 1.0
# Where patches just come apart the last change is no bound: b is off by 1.07 of it, the valley by 1.09.
_WHERE_PATCHES_PART = 1.5
# Patches share the load by the springs of the bodies behind each. So much a rail cut at 90 in place of 60 mm moves two
# on 60E1 at 5 mm, 50 kN, rounded up: the peak by 0.52 %, b by 0.51, a by 0.13, the centre by 0.0056 b, the valley by
# 0.0043, what is misplaced by 0.0040, and the lesser patch's load by 1.5 % of it.
_CUT_PLANES_SHARED = {
    "p_max_MPa": 0.006,
    "a_mm": 0.0015,
    "b_mm": 0.006,
    "extent_y_mm": 0.006,
    "centre_over_b": 0.006,
    "valley": 0.005,
    "misplaced_load": 0.0045,
}
_OF_SEPARATE_LOAD = 0.016
# What is the elements' and what the bodies' is told apart by a quadratic function of the place, and again by one of the
# fourth degree. On a head of 20 mm, where quick and fine meshes are 1.3 % apart in peak pressure, both differ by 0.4 %
# on meshes that differ by 0.2 %; on heads that are wide for their patch by 0.01 to 0.06 %.
_OF_THE_PARTING = 2.0
# Bodies too soft by some part for their material move the peak of the fine pressure by 0.02 of it, half-widths by 0.015
# and its area by 0.045 (R 300, S1002 on 60E1 at 3 mm and on 60E2 at 2.5 mm, 100 kN; factors up to 1.2).
_OF_THE_COMPLIANCE = 0.05
# What reading the contact off the elements' own nodes leaves open beside its change from mesh to mesh, with six of
# them on a semi-axis. It falls with their square, or with their number where it hangs on which nodes touch and at the
# peak. Of 18 contacts on six elements the finer nodes read the peak up to 0.23 % higher, area 1.2, half-widths 0.9,
# extents 2.2 and approach 0.3 %. Of 17 places of study 18 the area is 3.0 % off where a second lobe hangs on by
# little, 6.8 % with a thin tail (of which the change shows most), the centre of pressure 0.0015 b, what is misplaced
# 0.003, the valley 0.042 (0.034 by the change); nothing is read on separate patches where there are none.
_ELEMENTS = 6.0
_ELEMENT_FLOORS = {
    "p_max_MPa": 0.0025,
    "area_mm2": 0.024,
    "a_mm": 0.01,
    "b_mm": 0.01,
    "extent_x_mm": 0.025,
    "extent_y_mm": 0.025,
    "centre_over_b": 0.003,
    "valley": 0.01,
    "separate_load": 0.0004,
    "misplaced_load": 0.006,
}
# A thin tail's area is 6.8 and 3.3 % off with 6 and 9 elements. The peak of exact contacts is off by up to 0.27, 0.20
# and 0.31 % with 4, 6 and 9 (95 of 100), what is misplaced by 0.012, 0.0065 and 0.0042.
_WITH_THEIR_NUMBER = ("p_max_MPa", "area_mm2", "extent_x_mm", "extent_y_mm", "misplaced_load")
# How much of an error of the compliance the measures of a contact have (Hertz: p0 and area go with the power 2/3 of the
# contact modulus, lengths with 1/3); a patch of two lobes or more takes somewhat more.
_OF_MODULUS = {name: 0.5 if name in ("a_mm", "b_mm", "extent_x_mm", "extent_y_mm") else 1.0 for name in _ELEMENT_FLOORS}


@dataclass(frozen=True, kw_only=True)
class Solved:
    """What is known of a contact on some meshes beside its measures.

    Attributes
    ----------
    residual
        Relative residual of the contact solution.
    compliance_error
        Of the elements, relative; the largest that is not refused where it is NaN.
    parting, shared
        Whether patches just come apart, and whether several of them share the load.
    """

    residual: float = 0.0
    compliance_error: float = 0.0
    parting: bool = False
    shared: bool = False


_EXACTLY = Solved()


def uncertainty(
    measure: str, values: Sequence[float], solved: Solved = _EXACTLY, *, otherwise: float | None = None
) -> float | None:
    """Uncertainty of a measure on the finest mesh: relative, or absolute where Hertz has no value of it.

    Parameters
    ----------
    values
        The measure on two or more meshes, the finest first, each MESH_RATIO coarser than the one before.
    otherwise
        The measure on the finest one with another idea of what is the elements' and what the bodies'.

    Returns
    -------
    float or None
        NaN where a value is none; None where meshes do not tell the measure's uncertainty.
    """
    reading = reading_uncertainty(measure, values[0])
    if reading is None:
        return None
    return reading + step_uncertainty(measure, values, solved, otherwise=otherwise)


def reading_uncertainty(measure: str, value: float) -> float | None:
    """What reading a value of a measure off its nodes leaves open, relative or absolute; None where it is not known."""
    floor, noise = FLOORS[measure], NOISE.get(measure, 0.0)
    if floor is None:
        return None
    # what is read is the root of the sum of both squares
    return floor + (noise if value <= noise else value - math.sqrt(value**2 - noise**2))


def step_uncertainty(
    measure: str, values: Sequence[float], solved: Solved = _EXACTLY, *, otherwise: float | None = None
) -> float:
    """Uncertainty of the step of a measure from the half-space to the bodies, which have the same nodes.

    As `uncertainty`, but for what reading a pressure off its nodes leaves open: it is the same on both rungs.
    """
    other = values[0] if otherwise is None else otherwise
    if not all(math.isfinite(value) for value in (*values, other)):
        return math.nan
    size = abs(values[0]) if measure in MEASURES else 1.0
    change, told_apart = _change(values) / size, abs(values[0] - other) / size
    of_change = _WHERE_PATCHES_PART if solved.parting else _OF_THE_CHANGE
    # what Hertz has no value of may be nothing at all, on soft elements too
    of_elements = _OF_THE_COMPLIANCE * _at_most(solved.compliance_error) * abs(values[0]) / size
    return (
        of_change * change
        + IN_COMMON[measure]
        + _OF_THE_PARTING * told_apart
        + _cut_planes(measure, values[0], solved.shared)
        + of_elements
        + solved.residual
    )


def _change(values: Sequence[float]) -> float:
    """Change between two meshes, of those before the last one what is left where errors fall with the elements' size.

    A last change that is small by chance does not hide them.
    """
    return max(abs(finer - coarser) / MESH_RATIO**k for k, (finer, coarser) in enumerate(pairwise(values)))


def _cut_planes(measure: str, value: float, shared: bool) -> float:
    """What the cut planes leave open of a measure, of one patch or of several that share the load."""
    if not shared:
        return CUT_PLANES[measure]
    if measure == "separate_load":
        return _OF_SEPARATE_LOAD * value
    return max(CUT_PLANES[measure], _CUT_PLANES_SHARED.get(measure, 0.0))


def _at_most(compliance_error: float) -> float:
    """Size of an error of the elements' compliance: where it is not seen, the largest that would not be refused."""
    return COMPLIANCE_LIMIT if math.isnan(compliance_error) else abs(compliance_error)


def elements_uncertainty(
    measure: str, values: Sequence[float], *, elements: float, compliance_error: float, residual: float = 0.0
) -> float | None:
    """Uncertainty of a measure of the contact on the elements' own nodes, relative or absolute as in `uncertainty`.

    Parameters
    ----------
    values
        The measure on those nodes of two or more meshes, as in `uncertainty`.
    elements
        On the semi-axis, of the finest mesh.

    Returns
    -------
    float or None
        NaN where a value is none; None where meshes do not tell the measure's uncertainty.
    """
    floor = _ELEMENT_FLOORS.get(measure)
    if floor is None:
        return None
    reading = floor * (_ELEMENTS / elements) ** (1 if measure in _WITH_THEIR_NUMBER else 2)
    size = abs(values[0]) if measure in MEASURES else 1.0
    change = _change(values) / size
    of_elements = _OF_MODULUS[measure] * _at_most(compliance_error) * abs(values[0]) / size
    return reading + change + CUT_PLANES[measure] + of_elements + residual


def unmeshed_uncertainty(measure: str, deviation: float, *, slope: float) -> float:
    """Uncertainty of a deviation that is left as irregularities along the track are in the gap and in no mesh.

    What a body gives way below a pressure along its own normals differs from that of the smooth one by about the
    largest slope: in plane strain, waves of 14 and 30 mm with slopes of 0.002 to 0.022, by 0.15 to 1.6 % of the shape
    below the patch, and by 0.4 % at a flat of 60 mm with 0.05. What Hertz has nothing of has that part of its value.
    """
    return slope if measure in MEASURES or measure == "misplaced_load" else slope * abs(deviation)
