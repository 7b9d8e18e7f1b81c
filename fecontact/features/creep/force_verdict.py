"""Creep forces of a solved load: does Hertz hold for them?"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from fecontact.contact.grid import Rung
from fecontact.contact_theories.rolling.creepage import (
    Creepages,
    CreepForce,
    CurvedCreepages,
    Motion,
    rolling_pair,
)
from fecontact.contact_theories.rolling.fastsim import mean_creepages
from fecontact.criteria import Creep
from fecontact.errors import FecontactError
from fecontact.features.creep.case_contact import creepages_of, real_patch
from fecontact.features.creep.forces import (
    CreepPatch,
    creep_force,
    curved_creepages,
    force_difference,
    hertz_patch,
)
from fecontact.features.creep.judged_force import ForceAt, JudgedForce, judged_force
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.measures import patch_of
from fecontact.judging.solved_load import finest_otherwise
from fecontact.placement.wheel_on_rail import Placement

# --- Does Hertz hold for forces? A judged load under friction, over a range of creepages.

SCREEN, DECIDES = "fastsim", "rolling_half_space"
"""The theory that looks where Hertz is furthest off, which it knows to 1 or 2 % of mu N, and the one that decides."""
PLACE, SHAPE = "centre of pressure beside the touch point", "shape of the patch"
"""Causes: with spin the real patch, at another place, has other creepages; or all else."""
SMALLEST_CREEPAGE = 1e-4
_SIZES, _DIRECTIONS = 8, 8
# how many creepages it decides at
_DECIDE = 2
# Hertz's deviation with 32 cells along the patch and with 72: 0.1 to 0.2 % of mu N at four positions
_OF_READING = 0.002
# as judging.solved_load has it for the measures
_OF_THE_PARTING = 2.0
# places across at which the curved surfaces are looked at
_LINES = 401


Off: TypeAlias = Callable[[Creepages], float]
"""By how much of mu N a force is off at creepages of the first touch point; NaN where that is not told."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RollingLoad:
    """A solved load as it rolls.

    Attributes
    ----------
    hertz, real
        Hertz's patch and the real one.
    others
        For the uncertainty: the patch of the next coarser mesh, and of another reading of the finest.
    creepages
        At the first touch point.
    surface
        Creepages over the curved surfaces.
    creep
        Friction, and by what forces are judged; whether the real patch follows the curved surfaces.
    usable
        Whether the load may be used.
    """

    hertz: CreepPatch
    real: CreepPatch
    others: tuple[CreepPatch, CreepPatch]
    creepages: Creepages
    surface: CurvedCreepages
    creep: Creep
    usable: bool

    @property
    def limit_N(self) -> float:
        """Coulomb's largest force mu N."""
        return self.real.ellipse.limit_N

    def off(self, one: CreepForce, other: CreepForce) -> float:
        """Size of the difference of two forces over mu N."""
        return force_difference(one, other, self.limit_N)

    def motion(self, creepages: Creepages) -> Motion:
        """What the real patch feels of creepages at the first touch point."""
        return replace(self.surface, plane=creepages) if self.creep.curved else creepages

    @property
    def every(self) -> Sequence[Creepages]:
        """The creepages over which forces are judged."""
        return creepage_range(self.creep.largest_creepage, self.creepages.spin_per_mm)

    def judged(self, looked: Off, *deciding: tuple[Off, float]) -> JudgedForce:
        """A force judged where it is furthest off, by the first of what decides that leaves nothing open.

        Parameters
        ----------
        looked
            By how much of mu N it is off at creepages, as it is looked at over all of them.
        deciding
            The same as it is decided, and what is left open of that beside the pressure.
        """
        off = {one: looked(one) for one in self.every}
        # first those where nothing could be told
        worst = sorted(off, key=lambda one: -math.inf if math.isnan(off[one]) else -off[one])[:_DECIDE]
        unsure = [pressure_uncertainty(SCREEN, self, self.motion(one)) for one in worst]
        for decided, known in deciding:
            each = [
                ForceAt(creepages=one, deviation_of_muN=decided(one), uncertainty_of_muN=pressure + known)
                for one, pressure in zip(worst, unsure, strict=True)
            ]
            found = judged_force(each, self.creep.force_limit, usable=self.usable)
            if found.verdict.answer != "UNRESOLVED":
                break
        return found


def rolling_load(load: JudgedLoad, placement: Placement, creep: Creep) -> RollingLoad:
    """A judged load and its ellipse under any friction and creepages, not only the case's."""
    assert creep.friction is not None
    case, (finest, coarser, *_) = load.case, load.solved.levels
    pair = rolling_pair(creep.friction, case.wheel_material, case.rail_material)

    def patch(rung: Rung) -> CreepPatch:
        return real_patch(rung, patch_of(rung), pair)

    real, others = patch(finest.fe), (patch(coarser.fe), patch(finest_otherwise(load.solved.levels)))
    creepages = creepages_of(replace(case, creep=creep), placement)
    ends = [float(one.cells.y_mm[end]) for one in (real, *others) for end in (0, -1)]
    s_mm = np.linspace(min(0.0, *ends), max(0.0, *ends), _LINES)
    return RollingLoad(
        hertz=hertz_patch(load.hertz, pair),
        real=real,
        others=others,
        creepages=creepages,
        surface=curved_creepages(placement, creepages, s_mm, creep.speed_ratio),
        creep=creep,
        usable=load.usable,
    )


def force_verdict(load: JudgedLoad, placement: Placement, creep: Creep | None = None) -> JudgedForce:
    """Judge Hertz for forces alone, under any friction and creepages, not only the case's."""
    return judge_on_hertz(rolling_load(load, placement, creep or load.case.creep))


def judge_on_hertz(rolling: RollingLoad) -> JudgedForce:
    """FASTSIM looks over the whole range, and the rolling half-space decides where it finds Hertz furthest off."""

    def deviation(theory: str, creepages: Creepages) -> float:
        with suppress(FecontactError):
            on_hertz = creep_force(theory, rolling.hertz, creepages)
            return rolling.off(on_hertz, creep_force(theory, rolling.real, rolling.motion(creepages)))
        return math.nan

    made = rolling.judged(partial(deviation, SCREEN), (partial(deviation, DECIDES), 0.0))
    if not made.limit_used > 1.0:
        return made
    return replace(made, verdict=replace(made.verdict, cause=_cause(rolling, made.decided[0])))


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
    by_place, by_shape = (rolling.off(one, other) for one, other in pairwise(steps))
    return PLACE if by_place > by_shape else SHAPE


def pressure_uncertainty(theory: str, rolling: RollingLoad, motion: Motion) -> float:
    """Of a theory's force on the real patch over mu N; NaN of a theory that does not cover all meshes."""
    with suppress(FecontactError):
        finest, coarser, otherwise = (creep_force(theory, one, motion) for one in (rolling.real, *rolling.others))
        return _OF_READING + rolling.off(finest, coarser) + _OF_THE_PARTING * rolling.off(finest, otherwise)
    return math.nan


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
