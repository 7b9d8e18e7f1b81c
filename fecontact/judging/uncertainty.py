"""Numerical uncertainty of a measure from the same case on several meshes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from fecontact.contact.elements import COMPLIANCE_LIMIT, UNSEEN_COMPLIANCE
from fecontact.judging.measures import CUT_PLANES, FLOORS, IN_COMMON, MEASURES, NOISE, OF_SKEW

# Ratio of the element sizes of neighbouring meshes.
MESH_RATIO = 1.5
# The error that is left is this part of the change between meshes or less; studies/12_uncertainty.py counts how often.
# Of three meshes the last change alone holds the peak of 88 % of exact contacts, with the one before 99 %.
_OF_THE_CHANGE = 1.0
# A notch one to three nodes wide, and a patch that ends just beyond a junction, are read with an error that falls with
# the step of the nodes: three times what 48 nodes change is left on 32.
_OF_MORE_NODES, HALF_AS_MANY_MORE = 3.0, 1.5
# Three times as many nodes show at least 0.81 of the error of the area and of the length across wherever that error is
# above what reading states: at 70 random positions with a junction below the patch, against 192 nodes, in 8 areas (0.22
# to 0.91 %) and in 8 lengths (1.2 to 4.6 %). The change that is kept is half of the change to 96 nodes, and 1.25 of the
# whole change is stated, or what reading states elsewhere if that is more.
_SEEN_BY_MORE_NODES, _OF_SEEN_CHANGE = ("area_mm2", "extent_y_mm"), 2.5
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
# Joined lobes share it by the same springs, and the peak of the one that has it goes with the third root of its load. A
# lobe of 0.35 mm beside one of 2 mm (50E6 with S1002, 1:40, 1.74 mm, 57.1 kN) has 15.19, 15.19, 15.15 and 15.25 % of
# the load on meshes of 2.7, 4, 6 and 9 elements per semi-axis of the wider one; its peak is 0.95, 1.01, 1.15 and 0.93 %
# below that of the half-space, and 1.32 % with 13.5. Changes between meshes do not bound that: 0.28 % was stated.
# So it does with the force along another normal.
_OF_LOAD = 1.0 / 3.0
# Where a joined lobe ends is read off the nodes of its valley: in 24 exact contacts of two lobes (as those of study 12)
# the part of the load on one is within 2e-4 and two changes between meshes.
_READING_SHARE, _OF_CHANGE_OF_SHARE = 2e-4, 2.0
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
    "misplaced_load": 0.0135,
}
# Flat tops have steep flanks: of 40 exact contacts that are no ellipses (study 12) 0.018 of the load is misplaced with
# 4.5 elements (95 of 100), where 0.012 was stated.
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
        Of the elements, relative; the largest that is not told from none where it is NaN.
    parting, shared
        Whether patches just come apart, and whether several of them share the load.
    skew
        Of the pressure across (`skew_of`).
    more_nodes
        What more nodes change of some measures (`changes_on_more_nodes`).
    joined_share
        Part of the load on the lobe whose peak is measured, where others hang on to it; 1 elsewhere.
    turned_force
        By how much the force differs along another normal (`Level.turned_force`).
    """

    residual: float = 0.0
    compliance_error: float = 0.0
    parting: bool = False
    shared: bool = False
    skew: float = 0.0
    more_nodes: Mapping[str, float] = field(default_factory=dict)
    joined_share: float = 1.0
    turned_force: float = 0.0


_EXACTLY = Solved()


def uncertainty(
    measure: str, values: Sequence[float], solved: Solved = _EXACTLY, *, otherwise: float | None = None
) -> float | None:
    """Uncertainty of a measure on the finest mesh: relative, or absolute where Hertz has no value of it.

    Parameters
    ----------
    values
        The measure on two or more meshes, the finest first, each MESH_RATIO coarser than the one before; on a single
        one it is as if coarser ones had the same value.
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
    change = solved.more_nodes.get(measure, 0.0)
    if measure in _SEEN_BY_MORE_NODES:
        reading, of_nodes = max(reading, _OF_SEEN_CHANGE * change), 0.0
    else:
        of_nodes = _OF_MORE_NODES * change
    of_normal = of_turned_force(solved.turned_force) if measure == "p_max_MPa" else 0.0
    return reading + of_nodes + of_normal + step_uncertainty(measure, values, solved, otherwise=otherwise)


def reading_uncertainty(measure: str, value: float) -> float | None:
    """What reading a value of a measure off its nodes leaves open, relative or absolute; None where it is not known."""
    floor, noise = FLOORS[measure], NOISE.get(measure, 0.0)
    if floor is None:
        return None
    # what is read is the root of the sum of both squares
    return floor + (noise if value <= noise else value - math.sqrt(value**2 - noise**2))


def unmeshed(measure: str, value: float, *, shared: bool) -> float | None:
    """What no mesh takes away of the uncertainty of a measure; relative or absolute, None where it is not known."""
    return uncertainty(measure, [value], Solved(shared=shared))


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
    change, told_apart = change_between_meshes(values) / size, abs(values[0] - other) / size
    of_change = _WHERE_PATCHES_PART if solved.parting else _OF_THE_CHANGE
    # what Hertz has no value of may be nothing at all, on soft elements too
    of_elements = _OF_THE_COMPLIANCE * _at_most(solved.compliance_error, UNSEEN_COMPLIANCE) * abs(values[0]) / size
    return (
        of_change * change
        + IN_COMMON[measure]
        + OF_SKEW[measure] * abs(solved.skew)
        + _OF_THE_PARTING * told_apart
        + _cut_planes(measure, values[0], solved.shared)
        + (_of_joined_lobe(solved.joined_share) if measure == "p_max_MPa" and not solved.shared else 0.0)
        + of_elements
        + solved.residual
    )


def share_uncertainty(values: Sequence[float], solved: Solved = _EXACTLY, *, otherwise: float | None = None) -> float:
    """Uncertainty of the part of the load on a lobe or a patch, absolute, from its values as in `uncertainty`.

    What the cut planes leave open is `cut_planes_share`.
    """
    other = values[0] if otherwise is None else otherwise
    if not all(math.isfinite(value) for value in (*values, other)):
        return math.nan
    of_elements = _OF_THE_COMPLIANCE * _at_most(solved.compliance_error, UNSEEN_COMPLIANCE) * values[0]
    told_apart = _OF_THE_PARTING * abs(values[0] - other)
    return (
        _READING_SHARE
        + _OF_CHANGE_OF_SHARE * change_between_meshes(values)
        + told_apart
        + of_elements
        + solved.residual
    )


def cut_planes_share(value: float) -> float:
    """What the cut planes leave open of the part of the load on a lobe, which it takes from all others or gives."""
    return _OF_SEPARATE_LOAD * min(value, 1.0 - value)


def change_between_meshes(values: Sequence[float]) -> float:
    """Change between two meshes, of those before the last one what is left where errors fall with the elements' size.

    A last change that is small by chance does not hide them.
    """
    return max(
        (abs(finer - coarser) / MESH_RATIO**k for k, (finer, coarser) in enumerate(pairwise(values))), default=0.0
    )


def _cut_planes(measure: str, value: float, shared: bool) -> float:
    """What the cut planes leave open of a measure, of one patch or of several that share the load."""
    if not shared:
        return CUT_PLANES[measure]
    if measure == "separate_load":
        return _OF_SEPARATE_LOAD * value
    return max(CUT_PLANES[measure], _CUT_PLANES_SHARED.get(measure, 0.0))


def of_turned_force(turned_force: float) -> float:
    """What a force along another normal leaves open of the peak, relative."""
    return _OF_LOAD * abs(turned_force)


def _of_joined_lobe(share: float) -> float:
    """What its part of the load leaves open of the peak of a lobe, relative."""
    return _OF_LOAD * cut_planes_share(share) / share


def _at_most(compliance_error: float, unseen: float) -> float:
    """Size of an error of the elements' compliance, `unseen` where it is not seen."""
    return unseen if math.isnan(compliance_error) else abs(compliance_error)


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
    change = change_between_meshes(values) / size
    # more would show in this contact beside that of the finer nodes (`elements_off`)
    of_elements = _OF_MODULUS[measure] * _at_most(compliance_error, COMPLIANCE_LIMIT) * abs(values[0]) / size
    return reading + change + CUT_PLANES[measure] + of_elements + residual


def unmeshed_uncertainty(measure: str, deviation: float, *, slope: float) -> float:
    """Uncertainty of a deviation that is left as irregularities along the track are in the gap and in no mesh.

    What a body gives way below a pressure along its own normals differs from the smooth body's part by about the
    largest slope: in plane strain, waves of 14 and 30 mm with slopes of 0.002 to 0.022, by 0.15 to 1.6 % of the shape
    below the patch, and by 0.4 % at a flat of 60 mm with 0.05. What Hertz has nothing of has that part of its value.
    """
    return slope if measure in MEASURES or measure == "misplaced_load" else slope * abs(deviation)
