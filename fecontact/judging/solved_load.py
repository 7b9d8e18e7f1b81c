"""A load as it was solved, on all its meshes: fields and numbers alone, with nothing that needs finite elements.

So that one that was stored is judged again in milliseconds, with other criteria or by other readings.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np

from fecontact.case import Case
from fecontact.contact.elements import COMPLIANCE_LIMIT, UNSEEN_COMPLIANCE
from fecontact.contact.grid import Rung, misfit
from fecontact.contact.patch import lobe_windows
from fecontact.errors import CONVERGED
from fecontact.judging.lines import Lines
from fecontact.judging.measures import CUT_PLANES, FLOORS, IN_COMMON, MEASURES, NOISE, OF_SKEW, measures_of, patch_of

# --- A contact between bodies that have yielded, as it was solved: fields and numbers alone.

YIELD_BAND = 0.15
"""Part by which a yield stress is taken lower and higher: steels of one name differ by so much, and bend gradually."""


@dataclass(frozen=True, kw_only=True)
class PathPoint:
    """A load on the way up from first yield.

    Attributes
    ----------
    steps
        Change of each of `measures.MEASURES` by plasticity alone, relative to elastic bodies under the same load.
    largest_strain
        Largest equivalent plastic strain in either body.
    corrections, change
        How many corrections were made, and the relative change by the last of them.
    """

    load_N: float
    steps: Mapping[str, float]
    largest_strain: float
    corrections: int
    change: float


@dataclass(frozen=True, kw_only=True)
class YieldedBody:
    """Where a body has yielded; depths lie below its surface, along the normals.

    Attributes
    ----------
    first_yield_N
        Load at which it yields first, where plastic strain is followed; from the third root of the load, as below an
        ellipse, where the load is less.
    largest_strain, x_mm, y_mm, depth_mm
        Largest equivalent plastic strain, and where; 0 of a body that has not yielded.
    top_mm, bottom_mm
        Between which depths it has yielded.
    volume_mm3
        Volume that has.
    """

    yield_MPa: float
    tangent_MPa: float
    first_yield_N: float
    largest_strain: float = 0.0
    x_mm: float = 0.0
    y_mm: float = 0.0
    depth_mm: float = 0.0
    top_mm: float = 0.0
    bottom_mm: float = 0.0
    volume_mm3: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Yielded:
    """The first loading of virgin bodies on one pair of meshes.

    Attributes
    ----------
    fe, nodal
        Contact between the bodies after it, on the nodes of the elastic rungs of the same name.
    bodies
        What yielded, by `rail` and `wheel`; a body without a yield stress is not there.
    path
        Loads from first yield up to the load; none where nothing yields.
    fewer_steps
        `fe` in half as many steps; None where that was not solved.
    by_band
        Change of each measure by plasticity with yield stresses lower and higher by `YIELD_BAND`, and as they are, in
        half as many steps; empty where that was not solved.
    imprint_mm
        How far the unloaded surfaces have parted below the patch, at most.
    """

    fe: Rung
    nodal: Rung
    fewer_steps: Rung | None = None
    bodies: Mapping[str, YieldedBody]
    path: tuple[PathPoint, ...] = ()
    by_band: Mapping[str, Mapping[str, float]]
    imprint_mm: float = 0.0

    @property
    def first_body(self) -> str:
        """The body that yields first."""
        return min(self.bodies, key=lambda name: self.bodies[name].first_yield_N)

    @property
    def first_yield_N(self) -> float:
        """Load at which either body yields first."""
        return self.bodies[self.first_body].first_yield_N

    @property
    def status(self) -> str:
        """Whether the contact may be used."""
        return "converged" if self.fe.status == self.nodal.status == "converged" else "not converged"


# --- Numerical uncertainty of a measure from the same case on several meshes.

# Ratio of the element sizes of neighbouring meshes.
MESH_RATIO = 1.5
# The error that is left is this part of the change between meshes or less; studies/12_uncertainty.py counts how often.
# Of three meshes the last change alone holds the peak of 88 % of exact contacts, with the one before 99 %.
_OF_THE_CHANGE = 1.0
# A notch one to three nodes wide, and a patch that ends just beyond a junction, are read with an error that falls with
# the step of the nodes: three times what 48 nodes change is left on 32.
_OF_MORE_NODES, _HALF_AS_MANY_MORE = 3.0, 1.5
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
    change, told_apart = _change(values) / size, abs(values[0] - other) / size
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
    return _READING_SHARE + _OF_CHANGE_OF_SHARE * _change(values) + told_apart + of_elements + solved.residual


def cut_planes_share(value: float) -> float:
    """What the cut planes leave open of the part of the load on a lobe, which it takes from all others or gives."""
    return _OF_SEPARATE_LOAD * min(value, 1.0 - value)


def _change(values: Sequence[float]) -> float:
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
    change = _change(values) / size
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


# --- A load as it was solved, on all its meshes: fields and numbers alone, with nothing that needs finite elements.

Status = Literal[
    "converged",
    "not converged",
    "patch at the edge of the fine mesh",
    "elements too soft or too stiff",
    "references disagree",
    "verdicts contradict",
]
# Of the peak between two lobes, or of the patch's width between two patches: less is little.
_LITTLE = 0.1
# Most that the elements' own contact may be off the contact of the finer nodes, in uncertainties of both.
_APART = 2.0
# The centres of pressure of both contacts may be apart by what both are unsure of: of 80 contacts with healthy elements
# by 0.38 of it at most; elements with a gap 0.2 mm beside the finer nodes' by 2.2.
_CENTRES_APART, _CENTRE = 1.0, "centre_over_b"
ELEMENTS_OFF: Status = "elements too soft or too stiff"
"""Status of a load whose elements do not behave as the bodies' material does, or have too poor a shape."""
REFERENCES_OFF: Status = "references disagree"
"""Status of a load on which Hertz, the half-space or the gap are wrong (`ladder.reference_error`)."""
CONTRADICTION: Status = "verdicts contradict"
"""Status of a load on which the elements' nodes decide for the other verdict than the finer nodes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Level:
    """A load solved on one pair of meshes.

    Attributes
    ----------
    nodal
        Contact between the finite bodies, as the nodes of their elements carry it.
    fe
        Contact of the finite bodies on finer nodes: the true gap on a half-space, opened by what the bodies of
        `nodal` open more than a half-space of the same elements. That is smooth and known well on coarse meshes, so
        that the fine pressure has neither the elements' softness nor their size.
    otherwise
        As `fe`, with another idea of what of the opening is the elements' and what the bodies'; None on meshes that are
        coarser than those of the case, of which nobody asks it.
    compliance_error
        By how much the elements are softer than their material, far from a unit pressure; NaN where it is not seen.
    slide_mm
        How far the wheel goes along the rail under the load, where the surface is steep.
    yielded
        The first loading of bodies that may yield; None without a yield stress.
    degrees_of_freedom, elements
        Of rail and wheel.
    force_balance, moment_balance
        What the nodal pressure does to one body and not back to the other, relative (`fe.coupling`).
    enlarged, at_edge
        How often the fine zone was enlarged, and whether the patch still came to its edge.
    more_nodes
        What more nodes change of the half-space, where that may be more than elsewhere (`changes_on_more_nodes`).
    turned_force
        By how much more force the load takes along the normal at the weighted centre of a single patch than along that
        at first touch, relative (`solving.plane_angles.turned_force`).
    """

    nodal: Rung
    fe: Rung
    otherwise: Rung | None
    compliance_error: float
    degrees_of_freedom: Mapping[str, int]
    elements: Mapping[str, int]
    enlarged: int
    slide_mm: float = 0.0
    force_balance: float = 0.0
    moment_balance: float = 0.0
    at_edge: bool
    more_nodes: Mapping[str, float] = field(default_factory=dict)
    turned_force: float = 0.0
    yielded: Yielded | None = None

    @property
    def rungs(self) -> dict[str, Rung]:
        """Its contacts by name."""
        found = {"nodal": self.nodal, "fe": self.fe}
        return found if self.otherwise is None else {**found, "otherwise": self.otherwise}

    @property
    def status(self) -> Status:
        """Whether the level may be used."""
        return "patch at the edge of the fine mesh" if self.at_edge else _worst_status(*self.rungs.values())

    @cached_property
    def on_elements(self) -> Rung:
        """The contact on the elements' own nodes, as what reads pressures takes it."""
        return self.nodal.even()

    @property
    def misfit(self) -> float:
        """Part of the load that the elements' own nodes carry elsewhere than the finer ones."""
        return misfit(self.nodal, self.fe)


def _worst_status(*rungs: Rung) -> Status:
    return "converged" if all(rung.status == "converged" for rung in rungs) else "not converged"


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedLoad:
    """A load at a position, solved on two meshes or more.

    Attributes
    ----------
    case
        The position under this load.
    levels
        One a pair of meshes, the finest first.
    half_space
        The true gap on a half-space; separate patches have a plane each.
    turned
        The true gap on a half-space with each pressure along its own normal; None for a single lobe.
    quadratic
        Hertz's gap on a half-space, with as many nodes per semi-axis.
    lines
        Theories against the half-space on each line that measured points allow; None where both profiles are exact.
    limits
        What stopped a refinement.
    short_of_memory
        Whether the machine had too little memory for what the case asks for.
    """

    case: Case
    levels: tuple[Level, ...]
    half_space: Rung
    turned: Rung | None = None
    quadratic: Rung
    lines: Lines | None
    limits: tuple[str, ...] = ()
    short_of_memory: bool = False

    @property
    def rungs(self) -> tuple[tuple[str, Rung], ...]:
        """The rungs above Hertz by their names, in the order of the ladder."""
        return (
            ("half_space_quadratic", self.quadratic),
            ("half_space", self.half_space),
            ("elements", self.levels[0].on_elements),
            ("fe", self.levels[0].fe),
            *(() if (yielded := self.levels[0].yielded) is None else (("fe_plastic", yielded.fe),)),
        )

    # asked again for every row and verdict, also of a map that is written after each of its positions
    @cached_property
    def status(self) -> Status:
        """`converged` if all solutions on all meshes are; if not, why the load must not be used."""
        for level in self.levels:
            if level.status != "converged":
                return level.status
        turned = () if self.turned is None else (self.turned,)
        of_rungs = _worst_status(self.half_space, self.quadratic, *turned)
        return ELEMENTS_OFF if of_rungs == "converged" and elements_off(self.levels) else of_rungs

    @property
    def usable(self) -> bool:
        """Whether its numbers may be used."""
        return self.status == CONVERGED


def elements_off(levels: Sequence[Level]) -> bool:
    """Whether the elements of the finest meshes do not behave as their material.

    Seen by their compliance far from a pressure, or by their own contact: it is the finer nodes' one but for what its
    meshes leave open. Of 24 contacts with healthy elements it stays within half of that.
    """
    finest, coarser = levels[:2]
    if abs(finest.compliance_error) > COMPLIANCE_LIMIT:
        return True
    read = with_centre(finest)
    own, fine, before = (read(rung) for rung in (finest.on_elements, finest.fe, coarser.fe))
    unsure = elements_uncertainties(levels, read)
    return centres_apart(levels, unsure) > _CENTRES_APART or any(
        abs(own[name] / fine[name] - 1.0) > _APART * (unsure[name] + abs(before[name] / fine[name] - 1.0))
        for name in ("p_max_MPa", "a_mm", "b_mm")
    )


def with_centre(level: Level) -> Callable[[Rung], dict[str, float]]:
    """What reads the measures off a rung, with its centre of pressure over the half-width b of a level's contact."""
    b_mm = patch_of(level.fe).b_mm
    return lambda rung: _measures(rung) | {_CENTRE: patch_of(rung).centre_y_mm / b_mm}


def centres_apart(levels: Sequence[Level], unsure: Mapping[str, float]) -> float:
    """Distance of the centres of pressure on the elements' nodes and on the finer nodes, over what both are unsure of.

    `unsure` has that of the elements' nodes, as `with_centre` reads. It sees elements whose gap lies beside the gap
    of the finer nodes: peak and half-widths do not.
    """
    b_mm = patch_of(levels[0].fe).b_mm
    own, *fine = (patch_of(rung).centre_y_mm / b_mm for rung in (levels[0].on_elements, *(one.fe for one in levels)))
    of_fine = uncertainty(_CENTRE, fine, as_solved(levels))
    assert of_fine is not None
    return abs(own - fine[0]) / (unsure[_CENTRE] + of_fine)


def _measures(rung: Rung) -> dict[str, float]:
    return measures_of(rung).as_dict()


def elements_uncertainties(
    levels: Sequence[Level], read: Callable[[Rung], Mapping[str, float]] = _measures
) -> dict[str, float]:
    """Uncertainty of each measure on the elements' own nodes, from the load's meshes; `read` reads them off a rung.

    Relative, or absolute where Hertz has no value of a measure.
    """
    finest, rungs = levels[0], [level.on_elements for level in levels]
    elements = _elements(finest)
    measured = [read(rung) for rung in rungs]
    found = {
        name: elements_uncertainty(
            name,
            [values[name] for values in measured],
            elements=elements,
            compliance_error=finest.compliance_error,
            residual=finest.nodal.residual,
        )
        for name in measured[0]
    }
    return {name: value for name, value in found.items() if value is not None}


def _elements(level: Level) -> float:
    """Elements on the semi-axis."""
    patch, (step_x, step_s) = patch_of(level.on_elements), level.on_elements.grid.steps_mm
    return min(patch.a_mm / step_x, patch.b_mm / step_s / len(patch.lobes))


def unmeshed_uncertainties(
    level: Level,
    read: Callable[[Rung], Mapping[str, float]],
    deviation: Mapping[str, float],
    *,
    on_elements: int | None,
) -> dict[str, float]:
    """What no finer meshes take away of the uncertainty of each deviation, where it is known.

    Of the elements' own contact what so many refinements leave, if its measures are those of the finer nodes.
    """
    measured, found = read(level.fe), {}
    solved = Solved(
        shared=patch_of(level.fe).pieces > 1,
        more_nodes=level.more_nodes,
        joined_share=highest_share(level.fe),
        turned_force=level.turned_force,
    )
    for name in deviation:
        if on_elements is None:
            known = uncertainty(name, [measured[name]], solved)
        else:
            elements = _elements(level) * MESH_RATIO**on_elements
            known = elements_uncertainty(name, [measured[name]], elements=elements, compliance_error=0.0)
        if known is not None:
            found[name] = known * abs(1.0 + deviation[name]) if name in MEASURES else known
    return found


def uncertainties(
    levels: Sequence[Level],
    read: Callable[[Rung], Mapping[str, float]],
    deviation: Mapping[str, float],
    *,
    share: float | None = None,
) -> dict[str, float]:
    """Uncertainty of each deviation, where meshes tell it; `read` reads all measures off a rung.

    `share` is the part of the load on the lobe that is read, of the highest one if not given.
    """
    measured, otherwise = [read(level.fe) for level in levels], read(finest_otherwise(levels))
    solved, found = as_solved(levels), {}
    if share is not None:
        solved = replace(solved, joined_share=share)
    for name in deviation:
        known = uncertainty(name, [one[name] for one in measured], solved, otherwise=otherwise[name])
        if known is not None:
            # of (Hertz - FE) / FE, from the uncertainty of the finite-element measure
            found[name] = known * abs(1.0 + deviation[name]) if name in MEASURES else known
    return found


def finest_otherwise(levels: Sequence[Level]) -> Rung:
    """The contact of the finest level by the other idea of what is the elements'."""
    found = levels[0].otherwise
    assert found is not None, "the finest meshes are coarser than those of the case"
    return found


def as_solved(levels: Sequence[Level]) -> Solved:
    """What the uncertainty of measures of the finest level hangs on beside them."""
    finest = levels[0]
    return Solved(
        residual=finest.fe.residual,
        compliance_error=finest.compliance_error,
        parting=any(just_parts(level.fe) for level in levels),
        shared=patch_of(finest.fe).pieces > 1,
        skew=skew_of(finest.fe),
        more_nodes=finest.more_nodes,
        joined_share=highest_share(finest.fe),
        turned_force=finest.turned_force,
    )


def highest_share(rung: Rung) -> float:
    """Part of the load on the lobe that has the peak, of a patch of several lobes; 1 for a single one."""
    lobes = patch_of(rung).lobes
    return lobes[0].force_share if len(lobes) > 1 else 1.0


# The half-widths a and b, which are sums over all nodes, do not belong here: on 151 real positions and on 15 whose edge
# lies at a junction they are within 0.00022 and 0.00016, and 0.0004 and 0.0005 are stated for all.
_ON_MORE_NODES = ("p_max_MPa", "area_mm2", "extent_y_mm")


def changes_on_more_nodes(rung: Rung, finer: Rung, sizes: Sequence[str] = _ON_MORE_NODES) -> dict[str, float]:
    """Change of sizes (relative) and of the valley from a half-space to that on half as many nodes more.

    `finer` may have any number of them: of errors that fall with the step its change shows another part. What is stated
    for reading was chosen on contacts without a junction of curvatures, a step or a notch below. Of 13 valleys beside
    those three were 5 to 41 times further off than stated. Where a patch ends one to three nodes beyond a junction, its
    area was up to 1.4 % too large, of which half as many nodes more showed between a fifth and two thirds, and three
    times as many nine tenths.
    """
    shown = (1.0 - 1.0 / _HALF_AS_MANY_MORE) / (1.0 - finer.grid.steps_mm[1] / rung.grid.steps_mm[1])
    before, after = _measures(rung), _measures(finer)
    changed = {name: shown * abs(before[name] / after[name] - 1.0) for name in sizes}
    return changed | {"valley": shown * abs(patch_of(rung).valley - patch_of(finer).valley)}


def skew_of(rung: Rung) -> float:
    """Skewness of the pressure across: its third moment about its centre over that of its width, 0 if symmetric."""
    whole = rung.pressure.whole()
    load = whole.values.sum(axis=0) * whole.grid.weights
    part = load / load.sum()
    away = whole.grid.s_mm - whole.grid.s_mm @ part
    return float(away**3 @ part / (away**2 @ part) ** 1.5)


def just_parts(rung: Rung) -> bool:
    """Whether two lobes hang together by little pressure, or patches lie apart by little."""
    if len(rung.grid.bands) > 1:
        # the farthest are far apart
        return False
    ridge = rung.pressure_MPa.max(axis=0)
    below = np.flatnonzero(ridge)
    lobes = lobe_windows(rung.pressure.whole().values)
    if len(lobes) == 1:
        return False
    # between two lobes either the pressure that is left there, or the surface that is free
    least = min(float(ridge[own.columns.start]) for own in lobes[1:])
    free = int(np.diff(below).max()) - 1
    return least < _LITTLE * float(ridge.max()) and free < _LITTLE * below.size
