"""A load as it was solved, on all its meshes: fields and numbers alone, with nothing that needs finite elements.

So that one that was stored is judged again in milliseconds, with other criteria or by other readings.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from fecontact.case import Case
from fecontact.contact.elements import COMPLIANCE_LIMIT
from fecontact.contact.grid import Rung, misfit
from fecontact.contact.patch import lobe_windows
from fecontact.errors import CONVERGED
from fecontact.judging.lines import Lines
from fecontact.judging.measures import MEASURES, measures_of, patch_of
from fecontact.judging.patch_loads import ELEMENT_LOAD_PART, PATCH_LOADS_LIMIT, PatchLoads, free_strips_mm, load_parts
from fecontact.judging.uncertainty import (
    HALF_AS_MANY_MORE,
    MESH_RATIO,
    Solved,
    change_between_meshes,
    elements_uncertainty,
    share_uncertainty,
    uncertainty,
)
from fecontact.judging.yielded import Yielded

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
"""Status of a load on which Hertz, the half-space or the gap are wrong (`ladder.reference_error`, `gap_faults`)."""
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
    gap_distance_error_mm
        Largest difference between the gap on the nodes of `fe` and the distance of the meshes' surfaces; None if it was
        not measured.
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
    gap_distance_error_mm: float | None = None

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
    gap_curvature_error
        Error of the second differences of the gap on the nodes of `half_space` at the contact point, relative to the
        largest curvature; None if it was not measured.
    """

    case: Case
    levels: tuple[Level, ...]
    half_space: Rung
    turned: Rung | None = None
    quadratic: Rung
    lines: Lines | None
    limits: tuple[str, ...] = ()
    short_of_memory: bool = False
    gap_curvature_error: float | None = None

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
    meshes leave open. Of 24 contacts with healthy elements it stays within half of that. Of several patches each must
    have the same part of the load in both contacts.
    """
    finest, coarser = levels[:2]
    if abs(finest.compliance_error) > COMPLIANCE_LIMIT:
        return True
    read = with_centre(finest)
    own, fine, before = (read(rung) for rung in (finest.on_elements, finest.fe, coarser.fe))
    unsure = elements_uncertainties(levels, read)
    if any(loads.difference > PATCH_LOADS_LIMIT for loads in compare_patch_loads(levels)):
        return True
    return centres_apart(levels, unsure) > _CENTRES_APART or any(
        abs(own[name] / fine[name] - 1.0) > _APART * (unsure[name] + abs(before[name] / fine[name] - 1.0))
        for name in ("p_max_MPa", "a_mm", "b_mm")
    )


def compare_patch_loads(levels: Sequence[Level]) -> list[PatchLoads]:
    """Loads on separate patches by the elements' nodes and by the finer nodes, one for each strip between patches.

    It sees what finite bodies add to the finer nodes if it is left out, doubled or of the wrong sign. Peaks and areas
    of separate patches hardly show that.
    """
    strips_mm = free_strips_mm(levels[0].fe)
    if not strips_mm:
        return []
    own = [load_parts(level.nodal, strips_mm) for level in levels]
    fine = [load_parts(level.fe, strips_mm) for level in levels]
    otherwise, solved = load_parts(finest_otherwise(levels), strips_mm), as_solved(levels)
    compared = []
    for number, other in enumerate(otherwise):
        on_elements, on_finer_nodes = [parts[number] for parts in own], [parts[number] for parts in fine]
        of_fine = share_uncertainty(on_finer_nodes, solved, otherwise=other)
        compared.append(
            PatchLoads(
                on_elements=on_elements[0],
                on_finer_nodes=on_finer_nodes[0],
                uncertainty=of_fine + ELEMENT_LOAD_PART + change_between_meshes(on_elements),
            )
        )
    return compared


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
    shown = (1.0 - 1.0 / HALF_AS_MANY_MORE) / (1.0 - finer.grid.steps_mm[1] / rung.grid.steps_mm[1])
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
