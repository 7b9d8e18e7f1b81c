"""The cheapest creep theory that is right on a judged load: laws and patches against the exact theory on the real one.

The exact theory on coarse cells looks over the whole range of creepages; where its answer is open, cells as fine as the
verdict's decide.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from fecontact.comparison.creep_verdict import (
    DECIDES,
    SCREEN,
    ForceAt,
    ForceVerdict,
    RollingLoad,
    creepage_range,
    furthest,
    pressure_uncertainty,
    rolling_load,
    worst_of,
)
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.multi_hertz import MultiHertz
from fecontact.errors import FecontactError
from fecontact.geometry.placement import Placement
from fecontact.rolling.steady import pressure_cells
from fecontact.theory.creep.contact import Creepages, CreepForce
from fecontact.theory.creep.forces import CreepPatch, creep_force, force_difference, hertz_patch

Theory: TypeAlias = Literal["polach", "fastsim", "exact", "springs", "strips", "real"]
THEORIES_BY_COST: tuple[Theory, ...] = ("polach", "fastsim", "exact", "springs", "strips", "real")
"""Polach's law, FASTSIM and the exact theory (which may be a table) on Hertz's ellipse; FASTSIM on the ellipses at all
touch points that share the load as springs; FASTSIM in strips over the real patch; the exact theory on it."""
_COARSE = 24
# Of mu N, against very fine cells with large spin: the coarse ones (0.6 % against 48), and 48 (`rolling.steady.CELLS`).
_OF_COARSE, _OF_FINE = 0.015, 0.007
_Force: TypeAlias = Callable[[Creepages], CreepForce]


@dataclass(frozen=True, kw_only=True)
class TheoryVerdicts:
    """Verdict of forces of each theory but the last, by cost; `springs` where several ellipses share the load."""

    verdicts: Mapping[Theory, ForceVerdict]

    @property
    def first(self) -> Theory:
        """The cheapest theory that does not fail; its answer may be open."""
        return next((name for name, verdict in self.verdicts.items() if verdict.answer != "FAILS"), "real")

    @property
    def cheapest(self) -> Theory | None:
        """The cheapest theory that holds; None where a cheaper one is open."""
        first = self.first
        return first if first == "real" or self.verdicts[first].answer == "HOLDS" else None


def theory_verdicts(
    load: JudgedLoad, placement: Placement, springs: MultiHertz | None, exact: ForceVerdict
) -> TheoryVerdicts:
    """Judge each theory by the friction, limit and range of creepages of a load's case.

    Parameters
    ----------
    springs
        The ellipses that share the load; None where there is one.
    exact
        The verdict of forces itself: that of the exact theory on Hertz's ellipse.
    """
    creep = load.case.creep
    rolling = rolling_load(load, placement, creep)
    every = creepage_range(creep.largest_creepage, rolling.creepages.spin_per_mm)
    reference = _Reference(rolling, every)
    found = {name: _verdict(force, load, reference) for name, force in _forces(rolling, springs).items()}
    verdicts = found | {"exact": exact}
    return TheoryVerdicts(verdicts={name: verdicts[name] for name in THEORIES_BY_COST if name in verdicts})


def _forces(rolling: RollingLoad, springs: MultiHertz | None) -> dict[Theory, _Force]:
    forces: dict[Theory, _Force] = {
        "polach": lambda creepages: creep_force("polach", rolling.hertz, creepages),
        "fastsim": lambda creepages: creep_force("fastsim", rolling.hertz, creepages),
        "strips": lambda creepages: creep_force("fastsim", rolling.real, rolling.motion(creepages)),
    }
    if springs is not None and len(springs.ellipses) > 1:
        constants = rolling.real.ellipse
        shared = [
            (
                hertz_patch(
                    one.hertz,
                    friction=constants.friction,
                    shear_MPa=constants.shear_MPa,
                    poisson=constants.poisson,
                ),
                (one.x_mm, one.s_mm),
            )
            for one in springs.ellipses
        ]
        forces["springs"] = lambda creepages: _of_springs(shared, rolling, creepages)
    return forces


def _of_springs(
    shared: Sequence[tuple[CreepPatch, tuple[float, float]]], rolling: RollingLoad, creepages: Creepages
) -> CreepForce:
    """FASTSIM on each ellipse with the creepages of its own touch point; forces across along the arc of the surface."""
    motion = rolling.motion(creepages)
    forces = [creep_force("fastsim", patch, motion.at(*place)) for patch, place in shared]
    return CreepForce(fx_N=sum(one.fx_N for one in forces), fy_N=sum(one.fy_N for one in forces))


class _Reference:
    """The exact theory on the real patch: on coarse cells at all creepages, on fine ones where it is asked."""

    def __init__(self, rolling: RollingLoad, every: Sequence[Creepages]) -> None:
        self.rolling, self.every = rolling, every
        self._patches = {
            _OF_COARSE: coarse_patch(rolling.real),
            _OF_FINE: rolling.real,
        }
        self._forces: dict[tuple[float, Creepages], CreepForce | None] = {}

    def off(self, force: _Force, creepages: Creepages, cells: float) -> float:
        """By how much of mu N a theory's force is off; NaN where either does not tell."""
        exact = self._exact(creepages, cells)
        try:
            return math.nan if exact is None else force_difference(force(creepages), exact, self.rolling.limit_N)
        except FecontactError:
            return math.nan

    def _exact(self, creepages: Creepages, cells: float) -> CreepForce | None:
        if (cells, creepages) not in self._forces:
            try:
                found = creep_force(DECIDES, self._patches[cells], self.rolling.motion(creepages))
            except FecontactError:
                found = None
            self._forces[cells, creepages] = found
        return self._forces[cells, creepages]


def coarse_patch(real: CreepPatch) -> CreepPatch:
    """A patch with half as many cells along and across: an eighth of the time of the rolling half-space."""
    fine = real.cells
    cells = pressure_cells(
        fine.x_mm,
        fine.y_mm,
        fine.pressure_MPa,
        area_mm2=fine.area_mm2,
        cells=_COARSE,
        lobes=max(1, round(fine.y_mm.size / fine.x_mm.size)),
    )
    return replace(real, cells=cells)


def _verdict(force: _Force, load: JudgedLoad, reference: _Reference) -> ForceVerdict:
    rolling, limit = reference.rolling, load.case.creep.force_limit
    worst = furthest([(reference.off(force, one, _OF_COARSE), one) for one in reference.every])
    of_pressure = {one: pressure_uncertainty(SCREEN, rolling, rolling.motion(one)) for one in worst}

    def judged(cells: float) -> ForceVerdict:
        decided = [
            ForceAt(
                creepages=one,
                deviation=reference.off(force, one, cells),
                uncertainty=math.nan if (known := of_pressure[one]) is None else known + cells,
            )
            for one in worst
        ]
        return worst_of(decided, limit, usable=load.status == "converged")

    coarse = judged(_OF_COARSE)
    return judged(_OF_FINE) if coarse.answer == "UNRESOLVED" else coarse
