"""Does Hertz hold for forces? A judged load under its case's friction and creepages, and over a range of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias
from weakref import WeakKeyDictionary

import numpy as np

from fecontact.comparison.creep_forces import (
    CreepPatch,
    creep_force,
    creep_forces,
    force_difference,
    hertz_patch,
    real_patch,
)
from fecontact.comparison.creepages import creepages_of, curved_creepages
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.measures import patch_of
from fecontact.comparison.verdict import FROM_BEST, Answer, answer_of
from fecontact.contact.rung import Rung
from fecontact.creep import Creep
from fecontact.errors import FecontactError
from fecontact.geometry.placement import Placement
from fecontact.theory.creep.contact import (
    Creepages,
    CreepForce,
    CurvedCreepages,
    Motion,
    friction_warnings,
    pair_constants,
)
from fecontact.theory.creep.strips import mean_creepages

SCREEN, DECIDES = "fastsim", "rolling_half_space"
"""The theory that looks where Hertz is furthest off, which it knows to 1 or 2 % of mu N, and the one that decides."""
SMALLEST_CREEPAGE = 1e-4
_SIZES, _DIRECTIONS = 8, 8
# of mu N; a fifth of the usual limit
_CURVED = 0.01
# how many creepages it decides at
_DECIDE = 2
# Hertz's deviation with 32 cells along the patch and with 72: 0.1 to 0.2 % of mu N at four positions
_OF_READING = 0.002
# as comparison.uncertainty has it for the measures
_OF_THE_PARTING = 2.0
# places across at which the curved surfaces are looked at
_LINES = 401
_Patches: TypeAlias = tuple[CreepPatch, CreepPatch, tuple[CreepPatch, CreepPatch]]


@dataclass(frozen=True, kw_only=True)
class ForceAt:
    """By how much of mu N Hertz's force is off at creepages of the first touch point, and how well that is known."""

    creepages: Creepages
    deviation: float
    uncertainty: float


@dataclass(frozen=True, kw_only=True)
class ForceVerdict:
    """Whether Hertz's creep force is right over a range of creepages.

    Attributes
    ----------
    answer
        The worst over the range.
    decided
        Creepages at which the exact theory decided, where FASTSIM found Hertz furthest off; the worst one first.
    limit
        Of the deviation.
    """

    answer: Answer
    decided: tuple[ForceAt, ...]
    limit: float

    @property
    def worst(self) -> ForceAt:
        """Where Hertz is furthest off."""
        return self.decided[0]


@dataclass(frozen=True, kw_only=True)
class CreepComparison:
    """Creep forces of a judged load.

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
    hertz, fe
        Force of each theory on Hertz's ellipse and on the real patch, or why there is none.
    deviation_of_muN, uncertainty_of_muN
        Size of their difference over mu N, and how well it is known from mesh to mesh.
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
    hertz: Mapping[str, CreepForce | str]
    fe: Mapping[str, CreepForce | str]
    deviation_of_muN: Mapping[str, float | None]
    uncertainty_of_muN: Mapping[str, float | None]
    verdict: ForceVerdict
    warnings: tuple[str, ...]


# a result is told as a row, as a record and as a table, and is evaluated once; kept as long as the load itself
_EVALUATED: WeakKeyDictionary[JudgedLoad, CreepComparison] = WeakKeyDictionary()


def creep_of(load: JudgedLoad, placement: Placement) -> CreepComparison | None:
    """Creep forces of a judged load at its placement; None where no friction is given."""
    friction = load.case.creep.friction
    if friction is None:
        return None
    if load not in _EVALUATED:
        _EVALUATED[load] = _evaluated(load, placement, friction)
    return _EVALUATED[load]


def _evaluated(load: JudgedLoad, placement: Placement, friction: float) -> CreepComparison:
    hertz, real, others = _patches(load, friction)
    creepages, limit = creepages_of(load.case, placement), real.ellipse.limit_N
    surface = _surface(placement, creepages, (real, *others), load.case.creep.speed_ratio)
    over = surface if load.case.creep.curved else None
    motion = over or creepages
    on_hertz, on_real = creep_forces(hertz, creepages), creep_forces(real, motion)
    surface_of_muN = _surface_effect(real, surface, load.case.creep.largest_creepage)
    deviation: dict[str, float | None] = {}
    uncertainty: dict[str, float | None] = {}
    for theory, force in on_hertz.items():
        other = on_real[theory]
        if isinstance(force, str) or isinstance(other, str):
            deviation[theory] = uncertainty[theory] = None
            continue
        deviation[theory] = force_difference(force, other, limit)
        # what meshes leave open of the pressure is felt by the exact theory as by its fast neighbour
        by = SCREEN if theory == DECIDES else theory
        uncertainty[theory] = _uncertainty(by, real, others, motion)
    return CreepComparison(
        friction=friction,
        limit_N=limit,
        creepages=creepages,
        centre_creepages=mean_creepages(real.pieces, motion),
        curved=load.case.creep.curved,
        surface_of_muN=surface_of_muN,
        hertz=on_hertz,
        fe=on_real,
        deviation_of_muN=deviation,
        uncertainty_of_muN=uncertainty,
        verdict=_verdict(load, load.case.creep, (hertz, real, others), creepages.spin_per_mm, over),
        warnings=_warnings(load, friction, 0.0 if over else surface_of_muN),
    )


def force_verdict(load: JudgedLoad, placement: Placement, creep: Creep) -> ForceVerdict:
    """Verdict of forces alone, under a friction and creepages that need not be those of the case."""
    assert creep.friction is not None
    patches, creepages = _patches(load, creep.friction), creepages_of(replace(load.case, creep=creep), placement)
    surface = _surface(placement, creepages, (patches[1], *patches[2]), creep.speed_ratio)
    return _verdict(load, creep, patches, creepages.spin_per_mm, surface if creep.curved else None)


def _patches(load: JudgedLoad, friction: float) -> _Patches:
    """Hertz's, the real one, and for the uncertainty that of the next coarser mesh and of another reading of it."""
    shear, poisson = pair_constants(load.case.wheel_material, load.case.rail_material)

    def real(rung: Rung) -> CreepPatch:
        return real_patch(rung, patch_of(rung), friction=friction, shear_MPa=shear, poisson=poisson)

    coarser, otherwise = load.solved.levels[1].fe, load.level.otherwise
    hertz = hertz_patch(load.hertz, friction=friction, shear_MPa=shear, poisson=poisson)
    return hertz, real(load.fe), (real(coarser), real(otherwise))


def _surface(
    placement: Placement, creepages: Creepages, patches: Sequence[CreepPatch], speed_ratio: float
) -> CurvedCreepages:
    """Creepages over the curved surfaces below patches."""
    ends = [float(patch.cells.y_mm[end]) for patch in patches for end in (0, -1)]
    s_mm = np.linspace(min(0.0, *ends), max(0.0, *ends), _LINES)
    return curved_creepages(placement, creepages, s_mm, speed_ratio)


def _surface_effect(real: CreepPatch, surface: CurvedCreepages, largest: float) -> float:
    try:
        return max(
            force_difference(
                creep_force(SCREEN, real, one),
                creep_force(SCREEN, real, replace(surface, plane=one)),
                real.ellipse.limit_N,
            )
            for one in creepage_range(largest, surface.plane.spin_per_mm)
        )
    except FecontactError:
        return math.nan


def _uncertainty(
    theory: str, real: CreepPatch, others: tuple[CreepPatch, CreepPatch], creepages: Motion
) -> float | None:
    """Of the force on the real patch over mu N; None of a theory that does not cover all meshes."""
    limit = real.ellipse.limit_N
    try:
        finest, coarser, otherwise = (creep_force(theory, patch, creepages) for patch in (real, *others))
    except FecontactError:
        return None
    change, parting = force_difference(finest, coarser, limit), force_difference(finest, otherwise, limit)
    return _OF_READING + change + _OF_THE_PARTING * parting


def _verdict(
    load: JudgedLoad, creep: Creep, patches: _Patches, spin_per_mm: float, over: CurvedCreepages | None
) -> ForceVerdict:
    """FASTSIM looks over the whole range, and the rolling half-space decides where it finds Hertz furthest off."""
    hertz, real, others = patches
    limit_N = real.ellipse.limit_N

    def on_surface(creepages: Creepages) -> Motion:
        return replace(over, plane=creepages) if over else creepages

    def deviation(theory: str, creepages: Creepages) -> float:
        try:
            on_hertz, on_real = creep_force(theory, hertz, creepages), creep_force(theory, real, on_surface(creepages))
        except FecontactError:
            return math.nan
        return force_difference(on_hertz, on_real, limit_N)

    found = [(deviation(SCREEN, one), one) for one in creepage_range(creep.largest_creepage, spin_per_mm)]
    # what FASTSIM does not tell comes first
    furthest = sorted(found, key=lambda one: -math.inf if math.isnan(one[0]) else -one[0])[:_DECIDE]
    each = []
    for _, creepages in furthest:
        off, known = deviation(DECIDES, creepages), _uncertainty(SCREEN, real, others, on_surface(creepages))
        at = ForceAt(creepages=creepages, deviation=off, uncertainty=math.nan if known is None else known)
        each.append((answer_of(off, at.uncertainty, creep.force_limit), at))
    each.sort(key=lambda one: (FROM_BEST.index(one[0]), one[1].deviation), reverse=True)
    return ForceVerdict(
        # a result that must not be used leaves it open
        answer=each[0][0] if load.status == "converged" else "UNRESOLVED",
        decided=tuple(at for _, at in each),
        limit=creep.force_limit,
    )


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


def _warnings(load: JudgedLoad, friction: float, left_out: float) -> tuple[str, ...]:
    separate = ("on separate patches the laws for one ellipse take one of the second moments of all",)
    curved = (
        f"the surfaces are curved across the patch: creepages that follow them change forces by up to"
        f" {1e2 * left_out:.1f} % of mu N; --curved takes them",
    )
    wheel, rail = load.case.wheel_material, load.case.rail_material
    pair = ("wheel and rail have different elastic constants: what the pressure does to the slip is left out",)
    unlike = (wheel.young_MPa, wheel.poisson) != (rail.young_MPa, rail.poisson)
    return (
        *friction_warnings(friction),
        *(pair if unlike else ()),
        *(separate if load.geometry.pieces > 1 else ()),
        *(curved if left_out > _CURVED else ()),
    )
