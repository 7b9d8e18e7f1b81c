"""Creep forces of a solved load on Hertz's ellipse and on the real patch, with their verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from fecontact.comparison.creep_verdict import (
    DECIDES,
    SCREEN,
    RollingLoad,
    creepage_range,
    judge_on_hertz,
    pressure_uncertainty,
    rolling_load,
)
from fecontact.comparison.judgement import Judgement
from fecontact.comparison.measures import patch_of
from fecontact.comparison.solved_load import SolvedLoad
from fecontact.errors import FecontactError
from fecontact.geometry.placement import Placement
from fecontact.theory.creep.contact import Creepages, CreepForce, friction_warnings
from fecontact.theory.creep.forces import creep_force, creep_forces, force_difference
from fecontact.theory.creep.strips import mean_creepages
from fecontact.theory.hertz import HertzContact

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
        deviation[theory] = force_difference(force, other, rolling.limit_N)
        # what meshes leave open of the pressure is felt by the exact theory as by its fast neighbour
        uncertainty[theory] = pressure_uncertainty(SCREEN if theory == DECIDES else theory, rolling, motion)
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
        warnings=_warnings(solved, creep.friction, 0.0 if creep.curved else surface_of_muN),
    )


def _surface_effect(rolling: RollingLoad, largest: float) -> float:
    """By how much of mu N at most FASTSIM's force changes where creepages follow the curved surfaces."""
    try:
        return max(
            force_difference(
                creep_force(SCREEN, rolling.real, one),
                creep_force(SCREEN, rolling.real, replace(rolling.surface, plane=one)),
                rolling.limit_N,
            )
            for one in creepage_range(largest, rolling.creepages.spin_per_mm)
        )
    except FecontactError:
        return math.nan


def _warnings(solved: SolvedLoad, friction: float, left_out: float) -> tuple[str, ...]:
    separate = ("on separate patches the laws for one ellipse take one of the second moments of all",)
    curved = (
        f"the surfaces are curved across the patch: creepages that follow them change forces by up to"
        f" {1e2 * left_out:.1f} % of mu N; --curved takes them",
    )
    wheel, rail = solved.case.wheel_material, solved.case.rail_material
    pair = ("wheel and rail have different elastic constants: what the pressure does to the slip is left out",)
    unlike = (wheel.young_MPa, wheel.poisson) != (rail.young_MPa, rail.poisson)
    return (
        *friction_warnings(friction),
        *(pair if unlike else ()),
        *(separate if patch_of(solved.levels[0].fe).pieces > 1 else ()),
        *(curved if left_out > _CURVED else ()),
    )
