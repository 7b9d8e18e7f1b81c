"""Creep forces of a judged load on Hertz's ellipse and on the real patch, with their verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

from fecontact.comparison.creep_forces import creep_force, creep_forces, force_difference
from fecontact.comparison.creep_verdict import (
    DECIDES,
    SCREEN,
    ForceVerdict,
    RollingLoad,
    creepage_range,
    pressure_uncertainty,
    rolling_load,
    verdict_of,
)
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.errors import FecontactError
from fecontact.geometry.placement import Placement
from fecontact.theory.creep.contact import Creepages, CreepForce, friction_warnings
from fecontact.theory.creep.strips import mean_creepages

# of mu N; a fifth of the usual limit
_CURVED = 0.01


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


def know_forces(evaluated: Mapping[JudgedLoad, CreepComparison]) -> None:
    """Take what another process has evaluated."""
    _EVALUATED.update(evaluated)


def _evaluated(load: JudgedLoad, placement: Placement, friction: float) -> CreepComparison:
    creep, rolling = load.case.creep, rolling_load(load, placement, load.case.creep)
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
        friction=friction,
        limit_N=rolling.limit_N,
        creepages=creepages,
        centre_creepages=mean_creepages(rolling.real.pieces, motion),
        curved=creep.curved,
        surface_of_muN=surface_of_muN,
        hertz=on_hertz,
        fe=on_real,
        deviation_of_muN=deviation,
        uncertainty_of_muN=uncertainty,
        verdict=verdict_of(load, rolling, creep),
        warnings=_warnings(load, friction, 0.0 if creep.curved else surface_of_muN),
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
