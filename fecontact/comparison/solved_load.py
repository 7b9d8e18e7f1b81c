"""A load as it was solved, on all its meshes: fields and numbers alone, with nothing that needs finite elements.

So that one that was stored is judged again in milliseconds, with other criteria or by other readings.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Literal

import numpy as np

from fecontact.case import Case
from fecontact.comparison.measures import MEASURES, measures_of, patch_of
from fecontact.comparison.patch import lobe_columns
from fecontact.comparison.point_noise import PointNoise
from fecontact.comparison.uncertainty import Solved, elements_uncertainty, uncertainty
from fecontact.comparison.yielded import Yielded
from fecontact.contact.elements import COMPLIANCE_LIMIT
from fecontact.contact.rung import Rung, misfit
from fecontact.outcome import CONVERGED

Status = Literal["converged", "not converged", "patch at the edge of the fine mesh", "elements too soft or too stiff"]
# Of the peak between two lobes, or of the patch's width between two patches: less is little.
_LITTLE = 0.1
# The elements' own contact may be so many times as far from that of the finer nodes as both are unsure.
_APART = 2.0
ELEMENTS_OFF: Status = "elements too soft or too stiff"
"""Status of a load whose elements are not those of the bodies' material, or of too poor a shape."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Level:
    """A load solved on one pair of meshes.

    Attributes
    ----------
    nodal
        Contact between the finite bodies, as the nodes of their elements carry it.
    fe
        Contact of the finite bodies on finer nodes: that of the true gap on a half-space, opened by what the bodies of
        `nodal` open more than a half-space of the same elements. That is smooth and known well on coarse meshes, so
        that the fine pressure has neither the elements' softness nor their size.
    otherwise
        As `fe`, with another idea of what of the opening is the elements' and what the bodies'.
    compliance_error
        By how much the elements are softer than their material, far from a unit pressure; NaN where it is not seen.
    slide_mm
        How far the wheel goes along the rail under the load, where the surface is steep.
    yielded
        The first loading of bodies that may yield; None without a yield stress.
    degrees_of_freedom, elements
        Of rail and wheel.
    enlarged, at_edge
        How often the fine zone was enlarged, and whether the patch still came to its edge.
    """

    nodal: Rung
    fe: Rung
    otherwise: Rung
    compliance_error: float
    degrees_of_freedom: Mapping[str, int]
    elements: Mapping[str, int]
    enlarged: int
    slide_mm: float = 0.0
    at_edge: bool
    yielded: Yielded | None = None

    @property
    def rungs(self) -> dict[str, Rung]:
        """Its contacts by name."""
        return {name: getattr(self, name) for name in LEVEL_RUNGS}

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


LEVEL_RUNGS = tuple(one.name for one in fields(Level) if one.type == "Rung")
"""Names of the contacts of a level."""


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
        Hertz's gap on a half-space, with as many nodes a semi-axis.
    point_noise
        None where both profiles are exact lines.
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
    point_noise: PointNoise | None
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
        """`converged` if all solutions are, on all meshes; otherwise why the load must not be used."""
        for level in self.levels:
            if level.status != "converged":
                return level.status
        noise = self.point_noise
        of_points = () if noise is None else [one for one in (noise.own, *noise.others) if one is not None]
        turned = () if self.turned is None else (self.turned,)
        of_rungs = _worst_status(self.half_space, self.quadratic, *turned, *(rung for _, rung in of_points))
        return ELEMENTS_OFF if of_rungs == "converged" and elements_off(self.levels) else of_rungs

    @property
    def usable(self) -> bool:
        """Whether its numbers may be used."""
        return self.status == CONVERGED


def elements_off(levels: Sequence[Level]) -> bool:
    """Whether the elements of the finest meshes are not those of their material.

    Seen by their compliance far from a pressure, or by their own contact: it is the finer nodes' one but for what its
    meshes leave open. Of 24 contacts with healthy elements it stays within half of that.
    """
    finest, coarser = levels[:2]
    if abs(finest.compliance_error) > COMPLIANCE_LIMIT:
        return True
    own, fine, before = (_measures(rung) for rung in (finest.on_elements, finest.fe, coarser.fe))
    unsure = elements_uncertainties(levels)
    return any(
        abs(own[name] / fine[name] - 1.0) > _APART * (unsure[name] + abs(before[name] / fine[name] - 1.0))
        for name in ("p_max_MPa", "a_mm", "b_mm")
    )


def _measures(rung: Rung) -> dict[str, float]:
    return measures_of(rung).as_dict()


def elements_uncertainties(
    levels: Sequence[Level], read: Callable[[Rung], Mapping[str, float]] = _measures
) -> dict[str, float]:
    """Uncertainty of each measure on the elements' own nodes, from those of its meshes; `read` reads them off a rung.

    Relative, or absolute where Hertz has no value of a measure.
    """
    finest, rungs = levels[0], [level.on_elements for level in levels]
    patch, (step_x, step_s) = patch_of(rungs[0]), rungs[0].grid.steps_mm
    elements = min(patch.a_mm / step_x, patch.b_mm / step_s / len(patch.lobes))
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


def uncertainties(
    levels: Sequence[Level], read: Callable[[Rung], Mapping[str, float]], deviation: Mapping[str, float]
) -> dict[str, float]:
    """Uncertainty of each deviation, where meshes tell it; `read` reads all measures off a rung."""
    finest = levels[0]
    measured, otherwise = [read(level.fe) for level in levels], read(finest.otherwise)
    solved, found = as_solved(levels), {}
    for name in deviation:
        known = uncertainty(name, [one[name] for one in measured], solved, otherwise=otherwise[name])
        if known is not None:
            # of (Hertz - FE) / FE, from that of the finite-element measure
            found[name] = known * abs(1.0 + deviation[name]) if name in MEASURES else known
    return found


def as_solved(levels: Sequence[Level]) -> Solved:
    """What the uncertainty of measures of the finest level hangs on beside them."""
    finest = levels[0]
    return Solved(
        residual=finest.fe.residual,
        compliance_error=finest.compliance_error,
        parting=any(just_parts(level.fe) for level in levels),
        shared=patch_of(finest.fe).pieces > 1,
    )


def just_parts(rung: Rung) -> bool:
    """Whether two lobes hang together by little pressure, or patches lie apart by little."""
    ridge = rung.pressure_MPa.max(axis=0)
    below = np.flatnonzero(ridge)
    columns = lobe_columns(rung.pressure.whole().values)
    if len(columns) == 1:
        return False
    # between two lobes either the pressure that is left there, or the surface that is free
    least = min(float(ridge[own.start]) for own in columns[1:])
    free = int(np.diff(below).max()) - 1
    return least < _LITTLE * float(ridge.max()) and free < _LITTLE * below.size
