"""Creep forces of a solved load: does Hertz hold for them, and which law on which patch does?"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias

import numpy as np

from fecontact.bodies import RollingPair
from fecontact.case import Case
from fecontact.comparison.measures import TheoryPatch, patch_of
from fecontact.comparison.patch import Patch
from fecontact.comparison.solved_load import SolvedLoad
from fecontact.comparison.theories import HERTZ, MULTI_HERTZ
from fecontact.comparison.verdict import ForceAt, Judgement, judged_force
from fecontact.contact.grid import Rung
from fecontact.criteria import Creep
from fecontact.errors import FecontactError
from fecontact.normal.hertz import HertzContact
from fecontact.rolling.fastsim import mean_creepages, one_ellipse, pressure_strips
from fecontact.rolling.forces import (
    CreepPatch,
    creep_force,
    creep_forces,
    curved_creepages,
    force_difference,
    hertz_patch,
    wheelset_creepages,
)
from fecontact.rolling.laws import Creepages, CreepForce, CurvedCreepages, Motion, friction_warnings, rolling_pair
from fecontact.rolling.steady import pressure_cells
from fecontact.wheel_rail.placement import Placement

# --- The pressure of a solved contact as creep theories take it, and the creepages of its case.


def real_patch(rung: Rung, patch: Patch, pair: RollingPair) -> CreepPatch:
    """The pressure of a solved contact, whose force is that along the contact normal."""
    field = rung.pressure.whole()
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
"""Causes: the creepages of the real patch are those of another place, which spin makes others; or all else."""
SMALLEST_CREEPAGE = 1e-4
_SIZES, _DIRECTIONS = 8, 8
# how many creepages it decides at
_DECIDE = 2
# Hertz's deviation with 32 cells along the patch and with 72: 0.1 to 0.2 % of mu N at four positions
_OF_READING = 0.002
# as comparison.solved_load has it for the measures
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

    def off(self, one: CreepForce, other: CreepForce) -> float:
        """Size of the difference of two forces over mu N."""
        return force_difference(one, other, self.limit_N)

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
        with suppress(FecontactError):
            on_hertz = creep_force(theory, rolling.hertz, creepages)
            return rolling.off(on_hertz, creep_force(theory, rolling.real, rolling.motion(creepages)))
        return math.nan

    found = [
        (deviation(SCREEN, one), one) for one in creepage_range(creep.largest_creepage, rolling.creepages.spin_per_mm)
    ]
    decided = []
    for creepages in furthest(found):
        unsure = pressure_uncertainty(SCREEN, rolling, rolling.motion(creepages))
        decided.append(ForceAt(creepages=creepages, deviation=deviation(DECIDES, creepages), uncertainty=unsure))
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
    verdict: Judgement
    warnings: tuple[str, ...]


def creep_of(solved: SolvedLoad, hertz: HertzContact, placement: Placement) -> CreepComparison | None:
    """Creep forces of a solved load on its ellipse and on the real patch; None where no friction is given."""
    creep = solved.case.creep
    if creep.friction is None:
        return None
    rolling = rolling_load(solved, hertz, placement, creep)
    creepages, motion = rolling.creepages, rolling.motion(rolling.creepages)
    on_hertz, on_real = creep_forces(rolling.hertz, creepages), creep_forces(rolling.real, motion)
    surface_of_muN = _surface_effect(rolling, creep.largest_creepage)
    deviation: dict[str, float | None] = {}
    uncertainty: dict[str, float | None] = {}
    for theory, force in on_hertz.items():
        other = on_real[theory]
        if isinstance(force, str) or isinstance(other, str):
            deviation[theory] = uncertainty[theory] = None
            continue
        deviation[theory] = rolling.off(force, other)
        # what meshes leave open of the pressure is felt by the exact theory as by its fast neighbour
        known = pressure_uncertainty(SCREEN if theory == DECIDES else theory, rolling, motion)
        uncertainty[theory] = None if math.isnan(known) else known
    return CreepComparison(
        friction=creep.friction,
        limit_N=rolling.limit_N,
        creepages=creepages,
        centre_creepages=mean_creepages(rolling.real.pieces, motion),
        curved=creep.curved,
        surface_of_muN=surface_of_muN,
        hertz=on_hertz,
        fe=on_real,
        deviation_of_muN=deviation,
        uncertainty_of_muN=uncertainty,
        verdict=judge_on_hertz(solved, rolling, creep),
        warnings=tuple(_warnings(solved, creep.friction, 0.0 if creep.curved else surface_of_muN)),
    )


def _surface_effect(rolling: RollingLoad, largest: float) -> float:
    """By how much of mu N at most FASTSIM's force changes where creepages follow the curved surfaces."""
    with suppress(FecontactError):
        return max(
            rolling.off(
                *(creep_force(SCREEN, rolling.real, one) for one in (flat, replace(rolling.surface, plane=flat)))
            )
            for flat in creepage_range(largest, rolling.creepages.spin_per_mm)
        )
    return math.nan


def _warnings(solved: SolvedLoad, friction: float, left_out: float) -> Iterator[str]:
    yield from friction_warnings(friction)
    wheel, rail = solved.case.wheel_material, solved.case.rail_material
    if (wheel.young_MPa, wheel.poisson) != (rail.young_MPa, rail.poisson):
        yield "wheel and rail have different elastic constants: what the pressure does to the slip is left out"
    if patch_of(solved.levels[0].fe).pieces > 1:
        yield "on separate patches the laws for one ellipse take one of the second moments of all"
    if left_out > _CURVED:
        yield (
            f"the surfaces are curved across the patch: creepages that follow them change forces by up to"
            f" {1e2 * left_out:.1f} % of mu N; --curved takes them"
        )


# --- Laws of creep forces on a solved load: laws and patches against the exact theory on the real one.
#
# The exact theory on coarse cells looks over the whole range of creepages; where its answer is open, cells as fine as
# the verdict's decide.


@dataclass(frozen=True, kw_only=True)
class CreepLaw:
    """A law of creep forces on a patch: its name for readers, class of cost, source, and what it takes for granted."""

    words: str
    cost: str
    source: str
    range: str


CREEP_LAWS: Mapping[str, CreepLaw] = {
    name: CreepLaw(**words)
    for name, words in tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8")).items()
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
    patches = {_OF_COARSE: coarse_patch(rolling.real), _OF_FINE: rolling.real}

    @cache
    def exact_force(creepages: Creepages, cells: float) -> CreepForce | None:
        """The force by which laws are judged; None where there is none."""
        with suppress(FecontactError):
            return creep_force(DECIDES, patches[cells], rolling.motion(creepages))
        return None

    def off(force: _Force, creepages: Creepages, cells: float) -> float:
        """By how much of mu N a law is off; NaN where either force is not told."""
        with suppress(FecontactError):
            exact = exact_force(creepages, cells)
            return math.nan if exact is None else rolling.off(force(creepages), exact)
        return math.nan

    def judged_law(force: _Force) -> Judgement:
        """Where a law is furthest off by coarse cells, and by fine ones there if the answer is open."""
        worst = furthest([(off(force, one, _OF_COARSE), one) for one in every])
        unsure = {one: pressure_uncertainty(SCREEN, rolling, rolling.motion(one)) for one in worst}

        def judged(cells: float) -> Judgement:
            decided = [
                ForceAt(creepages=one, deviation=off(force, one, cells), uncertainty=unsure[one] + cells)
                for one in worst
            ]
            return judged_force(decided, creep.force_limit, usable=solved.usable)

        coarse = judged(_OF_COARSE)
        return judged(_OF_FINE) if coarse.verdict.answer == "UNRESOLVED" else coarse

    several = pressures.get(MULTI_HERTZ)
    forces = _forces(rolling, () if several is None or several.approximation is None else several.approximation.patches)
    found = {name: judged_law(force) for name, force in forces.items()}
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
        pair = rolling.real.ellipse
        shared = [(hertz_patch(one.hertz, pair), one.centre_mm) for one in ellipses if one.hertz is not None]

        def on_each(creepages: Creepages) -> CreepForce:
            # each with the creepages of its own touch point; forces across along the arc of the surface
            motion = rolling.motion(creepages)
            each = [creep_force("fastsim", patch, motion.at(*place)) for patch, place in shared]
            return CreepForce(fx_N=sum(one.fx_N for one in each), fy_N=sum(one.fy_N for one in each))

        forces[MULTI_HERTZ] = on_each
    return forces


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
