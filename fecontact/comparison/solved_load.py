"""A load as it was solved, on all its meshes: fields and numbers alone, with nothing that needs finite elements.

So that one that was stored is judged again in milliseconds, with other criteria or by other readings.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Literal

from fecontact.case import Case
from fecontact.comparison.point_noise import PointNoise
from fecontact.contact.rung import Rung, misfit

Status = Literal["converged", "not converged", "patch at the edge of the fine mesh"]


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
    degrees_of_freedom, elements
        Of rail and wheel.
    enlarged, at_edge
        How often the fine zone was enlarged, and whether the patch still came to its edge.
    """

    nodal: Rung
    fe: Rung
    otherwise: Rung
    degrees_of_freedom: Mapping[str, int]
    elements: Mapping[str, int]
    enlarged: int
    at_edge: bool

    @property
    def rungs(self) -> dict[str, Rung]:
        """Its contacts by name."""
        return {name: getattr(self, name) for name in LEVEL_RUNGS}

    @property
    def status(self) -> Status:
        """Whether the level may be used."""
        return "patch at the edge of the fine mesh" if self.at_edge else _worst_status(*self.rungs.values())

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
    quadratic: Rung
    point_noise: PointNoise | None
    turned: Rung | None = None
    limits: tuple[str, ...] = ()
    short_of_memory: bool = False

    @property
    def rungs(self) -> tuple[tuple[str, Rung], ...]:
        """The rungs above Hertz by their names, in the order of the ladder."""
        return (
            ("half_space_quadratic", self.quadratic),
            ("half_space", self.half_space),
            ("fe", self.levels[0].fe),
        )

    @property
    def status(self) -> Status:
        """`converged` if all solutions are, on all meshes; otherwise why the load must not be used."""
        for level in self.levels:
            if level.status != "converged":
                return level.status
        noise = self.point_noise
        of_points = () if noise is None else [one for one in (noise.own, *noise.others) if one is not None]
        turned = () if self.turned is None else (self.turned,)
        return _worst_status(self.half_space, self.quadratic, *turned, *(rung for _, rung in of_points))
