"""Creep forces of a solved load: does Hertz hold for them?"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from fecontact.bodies import RollingPair
from fecontact.case import Case
from fecontact.contact.grid import Rung
from fecontact.contact.patch import Patch
from fecontact.contact_theories.rolling.fastsim import mean_creepages, one_ellipse, pressure_strips
from fecontact.contact_theories.rolling.laws import (
    Creepages,
    CreepForce,
    CurvedCreepages,
    Motion,
    friction_warnings,
    rolling_pair,
)
from fecontact.criteria import Creep
from fecontact.errors import FecontactError
from fecontact.features.creep.forces import (
    CreepPatch,
    creep_force,
    creep_forces,
    curved_creepages,
    force_difference,
    hertz_patch,
    wheelset_creepages,
)
from fecontact.features.creep.steady import pressure_cells
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.measures import patch_of
from fecontact.judging.solved_load import finest_otherwise
from fecontact.judging.verdict import FROM_BEST, Judgement, Verdict, answer_of
from fecontact.placement.wheel_on_rail import Placement

# --- A creep force judged as a measure: off by so much of mu N, over a range of creepages.

FORCE = "force"
"""The measure of a law of creep forces."""


@dataclass(frozen=True, kw_only=True)
class ForceAt:
    """By how much of mu N a force is off at creepages of the first touch point, and how well that is known."""

    creepages: Creepages
    deviation_of_muN: float
    uncertainty_of_muN: float


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedForce(Judgement):
    """A law by its force, with the creepages at which the exact theory decided, the worst one first."""

    decided: tuple[ForceAt, ...]


def judged_force(decided: Sequence[ForceAt], limit: float, *, usable: bool = True) -> JudgedForce:
    """A creep law by the worst answer of some creepages; a result that must not be used leaves it open."""
    each = [(answer_of(at.deviation_of_muN, at.uncertainty_of_muN, limit), at) for at in decided]
    each.sort(key=lambda one: (FROM_BEST.index(one[0]), one[1].deviation_of_muN), reverse=True)
    answer, worst = each[0]
    return JudgedForce(
        deviation={FORCE: worst.deviation_of_muN},
        uncertainty={FORCE: worst.uncertainty_of_muN},
        limits={FORCE: limit},
        verdict=Verdict(answer=answer, measure=FORCE, each={FORCE: answer}).usable(usable),
        decided=tuple(at for _, at in each),
    )


# --- The pressure of a solved contact as creep theories take it, and the creepages of its case.


def real_patch(rung: Rung, patch: Patch, pair: RollingPair) -> CreepPatch:
    """The pressure of a solved contact, whose force is that along the contact normal."""
    field = rung.even().pressure.whole()
    cell = field.grid.steps_mm[0] * field.grid.steps_mm[1]
    pressure = field.values * (rung.normal_force_N / (cell * float(field.values.sum())))
    x, s = field.grid.x_mm, field.grid.s_mm
    pieces = pressure_strips(x, s, pressure, pair)
    ellipse, centre_x, centre_s = one_ellipse(pieces)
    return CreepPatch(
        ellipse=replace(ellipse, normal_force_N=rung.normal_force_N),
        centre_mm=(centre_x, centre_s),
        pieces=pieces,
        cells=pressure_cells(x, s, pressure, area_mm2=patch.area_mm2, lobes=max(1, len(patch.lobes))),
    )


def creepages_of(case: Case, placement: Placement) -> Creepages:
    """Creepages of the wheel against the rail at the first touch point, in the contact frame."""
    given, motion = case.creep, wheelset_creepages(placement, case.creep.speed_ratio)
    return Creepages(
        xi=motion.xi if given.xi is None else given.xi,
        eta=motion.eta if given.eta is None else given.eta,
        spin_per_mm=motion.spin_per_mm if given.spin_per_mm is None else given.spin_per_mm,
    )


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


# --- Creep forces of a solved load on Hertz's ellipse and on the real patch, with their verdict.

# of mu N; a fifth of the usual limit
_CURVED = 0.01


@dataclass(frozen=True, kw_only=True)
class BothForces:
    """A theory on Hertz's ellipse and on the real patch.

    Attributes
    ----------
    hertz, fe
        Its forces, or why there is none.
    deviation_of_muN, uncertainty_of_muN
        Size of their difference over mu N, and how well it is known from mesh to mesh; None where it is not.
    """

    hertz: CreepForce | str
    fe: CreepForce | str
    deviation_of_muN: float | None = None
    uncertainty_of_muN: float | None = None


@dataclass(frozen=True, kw_only=True)
class CreepComparison:
    """Creep forces of a solved load.

    Attributes
    ----------
    friction, creepages
        With which they are evaluated, at the first touch point.
    centre_creepages
        The creepages of the real patch's centre of pressure: spin about the touch point moves it along. Over curved
        surfaces their mean over the load.
    curved, surface_of_muN
        Whether the creepages on the real patch follow the curved surfaces (`curved_creepages`), and by how much of mu N
        at most FASTSIM's force changes by that over the creepages of the verdict.
    theories
        Forces of each theory.
    verdict
        Over a range of creepages.
    warnings
        What makes the forces doubtful.
    """

    friction: float
    limit_N: float
    creepages: Creepages
    centre_creepages: Creepages
    curved: bool
    surface_of_muN: float
    theories: Mapping[str, BothForces]
    verdict: JudgedForce
    warnings: tuple[str, ...]


def creep_of(load: JudgedLoad, placement: Placement) -> CreepComparison | None:
    """Creep forces of a judged load on its ellipse and on the real patch; None where no friction is given."""
    creep = load.case.creep
    if creep.friction is None:
        return None
    rolling = rolling_load(load, placement, creep)
    creepages, motion = rolling.creepages, rolling.motion(rolling.creepages)
    on_hertz, on_real = creep_forces(rolling.hertz, creepages), creep_forces(rolling.real, motion)
    surface_of_muN = _surface_effect(rolling)
    return CreepComparison(
        friction=creep.friction,
        limit_N=rolling.limit_N,
        creepages=creepages,
        centre_creepages=mean_creepages(rolling.real.pieces, motion),
        curved=creep.curved,
        surface_of_muN=surface_of_muN,
        theories={name: _both(name, force, on_real[name], rolling) for name, force in on_hertz.items()},
        verdict=judge_on_hertz(rolling),
        warnings=tuple(_warnings(load, creep.friction, 0.0 if creep.curved else surface_of_muN)),
    )


def _both(theory: str, hertz: CreepForce | str, fe: CreepForce | str, rolling: RollingLoad) -> BothForces:
    if isinstance(hertz, str) or isinstance(fe, str):
        return BothForces(hertz=hertz, fe=fe)
    # what meshes leave open of the pressure is felt by the exact theory as by its fast neighbour
    known = pressure_uncertainty(SCREEN if theory == DECIDES else theory, rolling, rolling.motion(rolling.creepages))
    unsure = None if math.isnan(known) else known
    return BothForces(hertz=hertz, fe=fe, deviation_of_muN=rolling.off(hertz, fe), uncertainty_of_muN=unsure)


def _surface_effect(rolling: RollingLoad) -> float:
    """By how much of mu N at most FASTSIM's force changes where creepages follow the curved surfaces."""
    with suppress(FecontactError):
        return max(
            rolling.off(
                *(creep_force(SCREEN, rolling.real, one) for one in (flat, replace(rolling.surface, plane=flat)))
            )
            for flat in rolling.every
        )
    return math.nan


def _warnings(load: JudgedLoad, friction: float, left_out: float) -> Iterator[str]:
    yield from friction_warnings(friction)
    wheel, rail = load.case.wheel_material, load.case.rail_material
    if (wheel.young_MPa, wheel.poisson) != (rail.young_MPa, rail.poisson):
        yield "wheel and rail have different elastic constants: what the pressure does to the slip is left out"
    if patch_of(load.fe).pieces > 1:
        yield "on separate patches the laws for one ellipse take one of the second moments of all"
    if left_out > _CURVED:
        yield (
            f"the surfaces are curved across the patch: creepages that follow them change forces by up to"
            f" {1e2 * left_out:.1f} % of mu N; --curved takes them"
        )
