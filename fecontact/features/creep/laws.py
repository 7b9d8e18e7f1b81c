"""Laws of creep forces on a solved load: laws and patches against the exact theory on the real one.

The exact theory on coarse cells looks over the whole range of creepages; where its answer is open, cells as fine as the
verdict's decide.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import TypeAlias

from fecontact.contact_theories.approximation import TheoryPatch
from fecontact.contact_theories.registry import MULTI_HERTZ
from fecontact.contact_theories.rolling.creepage import Creepages, CreepForce
from fecontact.errors import FecontactError
from fecontact.features.creep.force_verdict import DECIDES, RollingLoad, rolling_load
from fecontact.features.creep.forces import CreepPatch, creep_force, hertz_patch
from fecontact.features.creep.judged_force import JudgedForce, judged_force
from fecontact.features.creep.steady import pressure_cells
from fecontact.judging.judged_load import JudgedLoad
from fecontact.placement.wheel_on_rail import Placement

CREEP_LAWS: Mapping[str, Mapping[str, str]] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
"""Laws of creep forces, from the cheapest to that by which all are judged."""
REAL = "real"
"""The last."""
_COARSE = 24
# Of mu N, against very fine cells with large spin: the coarse ones (0.6 % against 48), and 48
# (`features.creep.steady.CELLS`).
_OF_COARSE, _OF_FINE = 0.015, 0.007
_Force: TypeAlias = Callable[[Creepages], CreepForce]


def creep_laws_of(load: JudgedLoad, placement: Placement) -> dict[str, JudgedForce] | None:
    """Each law judged by the friction, limit and range of creepages of a load's case; None without friction."""
    if "creep" not in load.features:
        return None
    exact: JudgedForce = load.features["creep"].verdict
    rolling = rolling_load(load, placement, load.case.creep)

    def off_on(patch: CreepPatch) -> Callable[[_Force, Creepages], float]:
        """By how much of mu N a law is off the exact theory on some cells; NaN where either force is not told."""

        @cache
        def exact_force(creepages: Creepages) -> CreepForce | None:
            with suppress(FecontactError):
                return creep_force(DECIDES, patch, rolling.motion(creepages))
            return None

        def off(force: _Force, creepages: Creepages) -> float:
            with suppress(FecontactError):
                one = exact_force(creepages)
                return math.nan if one is None else rolling.off(force(creepages), one)
            return math.nan

        return off

    coarse, fine = off_on(coarse_patch(rolling.real)), off_on(rolling.real)

    def judged_law(force: _Force) -> JudgedForce:
        looked = partial(coarse, force)
        return rolling.judged(looked, (looked, _OF_COARSE), (partial(fine, force), _OF_FINE))

    several = load.judgements.get(MULTI_HERTZ)
    forces = _forces(rolling, () if several is None or several.approximation is None else several.approximation.patches)
    found = {name: judged_law(force) for name, force in forces.items()}
    none = replace(exact.decided[0], deviation_of_muN=0.0, uncertainty_of_muN=0.0)
    real = judged_force([none], load.case.creep.force_limit)
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
