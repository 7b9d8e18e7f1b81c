"""Laws of creep forces on a solved load: laws and patches against the exact theory on the real one.

The exact theory on coarse cells looks over the whole range of creepages; where its answer is open, cells as fine as the
verdict's decide.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from fecontact.comparison.approximation import TheoryPatch
from fecontact.comparison.creep_verdict import (
    DECIDES,
    SCREEN,
    RollingLoad,
    creepage_range,
    furthest,
    pressure_uncertainty,
    rolling_load,
)
from fecontact.comparison.judgement import ForceAt, Judgement, judged_force
from fecontact.comparison.solved_load import SolvedLoad
from fecontact.comparison.theories import HERTZ, MULTI_HERTZ
from fecontact.errors import FecontactError
from fecontact.geometry.placement import Placement
from fecontact.rolling.steady import pressure_cells
from fecontact.theory.creep.contact import Creepages, CreepForce
from fecontact.theory.creep.forces import CreepPatch, creep_force, force_difference, hertz_patch


@dataclass(frozen=True, kw_only=True)
class CreepLaw:
    """A law of creep forces on a patch: its name for readers, class of cost, source, and what it takes for granted."""

    words: str
    cost: str
    source: str
    range: str


_FASTSIM = "Kalker (1982)"
_EXACT = "Kalker (1990), variational theory"
CREEP_LAWS: Mapping[str, CreepLaw] = {
    "polach": CreepLaw(
        words="Polach's law on Hertz's ellipse",
        cost="closed form",
        source="Polach (1999, 2005)",
        range="one ellipse; creepages and spin together by one formula",
    ),
    "fastsim": CreepLaw(
        words="FASTSIM on Hertz's ellipse",
        cost="a sweep over 50 x 50 cells",
        source=_FASTSIM,
        range="one ellipse; forces within 5 to 10 % of the exact theory",
    ),
    "exact": CreepLaw(
        words="the exact theory (which may be a table) on Hertz's ellipse",
        cost="a solver by FFT, or a table made by it",
        source=_EXACT,
        range="one ellipse on half-spaces of one material",
    ),
    "multi_hertz": CreepLaw(
        words="FASTSIM on the ellipses at all touch points, as springs",
        cost="a sweep over 50 x 50 cells a touch point",
        source=f"{_FASTSIM}; springs of Otero Yugat, Part I",
        range="patches small against the distance between them",
    ),
    "strips": CreepLaw(
        words="FASTSIM in strips on the real patch",
        cost="a sweep over 80 strips",
        source=_FASTSIM,
        range="any pressure that is known; forces within 5 to 10 % of the exact theory",
    ),
    "real": CreepLaw(
        words="the exact theory on the real patch",
        cost="a solver by FFT",
        source=_EXACT,
        range="any pressure that is known, on half-spaces of one material",
    ),
}
"""Laws of creep forces, from the cheapest to that by which all are judged."""
REAL = "real"
"""The last."""
_COARSE = 24
# Of mu N, against very fine cells with large spin: the coarse ones (0.6 % against 48), and 48 (`rolling.steady.CELLS`).
_OF_COARSE, _OF_FINE = 0.015, 0.007
_Force: TypeAlias = Callable[[Creepages], CreepForce]


def judge_creep_laws(
    solved: SolvedLoad, placement: Placement, pressures: Mapping[str, Judgement], exact: Judgement
) -> dict[str, Judgement]:
    """Judge each law by the friction, limit and range of creepages of a load's case.

    Parameters
    ----------
    pressures
        The judged theories of the pressure, of which the ellipses are taken.
    exact
        The judgement of the exact theory on Hertz's ellipse.
    """
    creep = solved.case.creep
    rolling = rolling_load(solved, pressures[HERTZ].hertz, placement, creep)
    every = creepage_range(creep.largest_creepage, rolling.creepages.spin_per_mm)
    reference = _Reference(rolling, every)
    several = pressures.get(MULTI_HERTZ)
    forces = _forces(rolling, () if several is None or several.approximation is None else several.approximation.patches)
    found = {name: _judged(force, solved, reference) for name, force in forces.items()}
    real = judged_force([replace(exact.decided[0], deviation=0.0, uncertainty=0.0)], creep.force_limit)
    judged = found | {"exact": exact, REAL: real}
    return {name: judged[name] for name in CREEP_LAWS if name in judged}


def _forces(rolling: RollingLoad, ellipses: Sequence[TheoryPatch]) -> dict[str, _Force]:
    forces: dict[str, _Force] = {
        "polach": lambda creepages: creep_force("polach", rolling.hertz, creepages),
        "fastsim": lambda creepages: creep_force("fastsim", rolling.hertz, creepages),
        "strips": lambda creepages: creep_force("fastsim", rolling.real, rolling.motion(creepages)),
    }
    if ellipses:
        pair = rolling.real.ellipse.pair
        shared = [(hertz_patch(one.hertz, pair), one.centre_mm) for one in ellipses if one.hertz is not None]
        forces[MULTI_HERTZ] = lambda creepages: _on_each(shared, rolling, creepages)
    return forces


def _on_each(
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


def _judged(force: _Force, solved: SolvedLoad, reference: _Reference) -> Judgement:
    rolling, limit = reference.rolling, solved.case.creep.force_limit
    worst = furthest([(reference.off(force, one, _OF_COARSE), one) for one in reference.every])
    of_pressure = {one: pressure_uncertainty(SCREEN, rolling, rolling.motion(one)) for one in worst}

    def judged(cells: float) -> Judgement:
        decided = [
            ForceAt(
                creepages=one,
                deviation=reference.off(force, one, cells),
                uncertainty=math.nan if (known := of_pressure[one]) is None else known + cells,
            )
            for one in worst
        ]
        return judged_force(decided, limit, usable=solved.usable)

    coarse = judged(_OF_COARSE)
    return judged(_OF_FINE) if coarse.verdict.answer == "UNRESOLVED" else coarse
