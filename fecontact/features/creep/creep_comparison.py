"""Creep forces of a solved load on Hertz's ellipse and on the real patch, with their verdict."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

from fecontact.contact_theories.rolling.creepage import (
    Creepages,
    CreepForce,
    friction_warnings,
)
from fecontact.contact_theories.rolling.fastsim import mean_creepages
from fecontact.errors import FecontactError
from fecontact.features.creep.force_verdict import (
    DECIDES,
    SCREEN,
    RollingLoad,
    judge_on_hertz,
    pressure_uncertainty,
    rolling_load,
)
from fecontact.features.creep.forces import (
    creep_force,
    creep_forces,
)
from fecontact.features.creep.judged_force import JudgedForce
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.measures import patch_of
from fecontact.placement.wheel_on_rail import Placement

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
