"""Does Hertz hold for forces? A judged load under friction, over a range of creepages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fecontact.comparison.creep_patch import creepages_of, real_patch
from fecontact.comparison.judgement import ForceAt, Judgement, judged_force
from fecontact.comparison.measures import patch_of
from fecontact.comparison.solved_load import SolvedLoad
from fecontact.contact.rung import Rung
from fecontact.creep import Creep
from fecontact.errors import FecontactError
from fecontact.geometry.placement import Placement
from fecontact.theory.creep.contact import Creepages, CurvedCreepages, Motion, rolling_pair
from fecontact.theory.creep.forces import CreepPatch, creep_force, force_difference, hertz_patch
from fecontact.theory.creep.motion import curved_creepages
from fecontact.theory.creep.strips import mean_creepages
from fecontact.theory.hertz import HertzContact

SCREEN, DECIDES = "fastsim", "rolling_half_space"
"""The theory that looks where Hertz is furthest off, which it knows to 1 or 2 % of mu N, and the one that decides."""
PLACE, SHAPE = "centre of pressure beside the touch point", "shape of the patch"
"""Causes: the creepages of the real patch are those of another place, which spin makes others; or all else."""
SMALLEST_CREEPAGE = 1e-4
_SIZES, _DIRECTIONS = 8, 8
# how many creepages it decides at
_DECIDE = 2
# Hertz's deviation with 32 cells along the patch and with 72: 0.1 to 0.2 % of mu N at four positions
_OF_READING = 0.002
# as comparison.uncertainty has it for the measures
_OF_THE_PARTING = 2.0
# places across at which the curved surfaces are looked at
_LINES = 401


@dataclass(frozen=True, kw_only=True, eq=False)
class RollingLoad:
    """A solved load as it rolls.

    Attributes
    ----------
    hertz, real
        Hertz's patch and the real one.
    others
        For the uncertainty that of the next coarser mesh, and of another reading of the finest.
    creepages
        At the first touch point.
    surface
        Creepages over the curved surfaces.
    curved
        Whether they are those of the real patch.
    """

    hertz: CreepPatch
    real: CreepPatch
    others: tuple[CreepPatch, CreepPatch]
    creepages: Creepages
    surface: CurvedCreepages
    curved: bool

    @property
    def limit_N(self) -> float:
        """Coulomb's largest force mu N."""
        return self.real.ellipse.limit_N

    def motion(self, creepages: Creepages) -> Motion:
        """What the real patch feels of creepages at the first touch point."""
        return replace(self.surface, plane=creepages) if self.curved else creepages


def rolling_load(solved: SolvedLoad, hertz: HertzContact, placement: Placement, creep: Creep) -> RollingLoad:
    """A solved load and its ellipse under a friction and creepages that need not be those of its case."""
    assert creep.friction is not None
    case, (finest, coarser, *_) = solved.case, solved.levels
    pair = rolling_pair(creep.friction, case.wheel_material, case.rail_material)

    def patch(rung: Rung) -> CreepPatch:
        return real_patch(rung, patch_of(rung), pair)

    real, others = patch(finest.fe), (patch(coarser.fe), patch(finest.otherwise))
    creepages = creepages_of(replace(case, creep=creep), placement)
    ends = [float(one.cells.y_mm[end]) for one in (real, *others) for end in (0, -1)]
    s_mm = np.linspace(min(0.0, *ends), max(0.0, *ends), _LINES)
    return RollingLoad(
        hertz=hertz_patch(hertz, pair),
        real=real,
        others=others,
        creepages=creepages,
        surface=curved_creepages(placement, creepages, s_mm, creep.speed_ratio),
        curved=creep.curved,
    )


def force_verdict(solved: SolvedLoad, hertz: HertzContact, placement: Placement, creep: Creep) -> Judgement:
    """Judge Hertz for forces alone, under a friction and creepages that need not be those of the case."""
    return judge_on_hertz(solved, rolling_load(solved, hertz, placement, creep), creep)


def judge_on_hertz(solved: SolvedLoad, rolling: RollingLoad, creep: Creep) -> Judgement:
    """FASTSIM looks over the whole range, and the rolling half-space decides where it finds Hertz furthest off."""

    def deviation(theory: str, creepages: Creepages) -> float:
        try:
            on_hertz = creep_force(theory, rolling.hertz, creepages)
            on_real = creep_force(theory, rolling.real, rolling.motion(creepages))
        except FecontactError:
            return math.nan
        return force_difference(on_hertz, on_real, rolling.limit_N)

    found = [
        (deviation(SCREEN, one), one) for one in creepage_range(creep.largest_creepage, rolling.creepages.spin_per_mm)
    ]
    decided = []
    for creepages in furthest(found):
        known = pressure_uncertainty(SCREEN, rolling, rolling.motion(creepages))
        off, unsure = deviation(DECIDES, creepages), math.nan if known is None else known
        decided.append(ForceAt(creepages=creepages, deviation=off, uncertainty=unsure))
    made = judged_force(decided, creep.force_limit, usable=solved.usable)
    if not made.limit_used > 1.0:
        return made
    return replace(made, verdict=replace(made.verdict, cause=_cause(rolling, made.decided[0])))


def furthest(found: Sequence[tuple[float, Creepages]]) -> list[Creepages]:
    """The creepages of the largest deviations, first those where none could be told."""
    by_size = sorted(found, key=lambda one: -math.inf if math.isnan(one[0]) else -one[0])
    return [creepages for _, creepages in by_size[:_DECIDE]]


def _cause(rolling: RollingLoad, worst: ForceAt) -> str | None:
    """What moves FASTSIM's force more: the mean creepages of the real patch, on Hertz's ellipse, or then that patch."""
    motion = rolling.motion(worst.creepages)
    try:
        steps = (
            creep_force(SCREEN, rolling.hertz, worst.creepages),
            creep_force(SCREEN, rolling.hertz, mean_creepages(rolling.real.pieces, motion)),
            creep_force(SCREEN, rolling.real, motion),
        )
    except FecontactError:
        return None
    by_place, by_shape = (force_difference(one, other, rolling.limit_N) for one, other in pairwise(steps))
    return PLACE if by_place > by_shape else SHAPE


def pressure_uncertainty(theory: str, rolling: RollingLoad, motion: Motion) -> float | None:
    """Of a theory's force on the real patch over mu N; None of a theory that does not cover all meshes."""
    try:
        finest, coarser, otherwise = (creep_force(theory, one, motion) for one in (rolling.real, *rolling.others))
    except FecontactError:
        return None
    change, parting = (force_difference(finest, other, rolling.limit_N) for other in (coarser, otherwise))
    return _OF_READING + change + _OF_THE_PARTING * parting


def creepage_range(largest: float, spin_per_mm: float) -> Sequence[Creepages]:
    """Creepages from 0.01 % to the largest one in eight directions, all with one spin."""
    ratio = (largest / SMALLEST_CREEPAGE) ** (1.0 / (_SIZES - 1))
    angles = [2.0 * math.pi * k / _DIRECTIONS for k in range(_DIRECTIONS)]
    return [
        Creepages(
            # along an axis the other one is zero
            xi=size * round(math.cos(angle), 12),
            eta=size * round(math.sin(angle), 12),
            spin_per_mm=spin_per_mm,
        )
        for size in (SMALLEST_CREEPAGE * ratio**power for power in range(_SIZES))
        for angle in angles
    ]
