"""Laws of creep forces on a solved load: laws and patches against the exact theory on the real patch.

The exact theory on coarse cells screens the whole range of creepages. If its answer is unresolved, the fine cells of
the verdict decide.
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
from fecontact.features.creep.force_verdict import DECIDING_THEORY, RollingLoad, build_rolling_load
from fecontact.features.creep.forces import CreepPatch, calculate_creep_force, make_hertz_patch
from fecontact.features.creep.judged_force import ForceJudgement, judge_force
from fecontact.features.creep.steady import coarsen_pressure
from fecontact.judging.judged_load import JudgedLoad
from fecontact.placement.wheel_on_rail import Placement

CREEP_LAWS: Mapping[str, Mapping[str, str]] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
"""Words of the laws of creep forces, from the cheapest law to the reference of all laws."""
REFERENCE_LAW = "real"
"""Name of the reference law, the last of `CREEP_LAWS`."""
_COARSE_CELLS = 24
# Errors over mu N, against very fine cells with large spin, of the coarse cells (0.6 % against 48 cells) and of 48
# cells (`features.creep.steady.CELLS_ALONG_PATCH`).
_COARSE_UNCERTAINTY, _FINE_UNCERTAINTY = 0.015, 0.007
_ForceLaw: TypeAlias = Callable[[Creepages], CreepForce]


def judge_creep_laws(load: JudgedLoad, placement: Placement) -> dict[str, ForceJudgement] | None:
    """Judge each creep law on a solved load.

    Friction, limit and range of creepages are those of the load's case.

    Parameters
    ----------
    load
        Judged load.
    placement
        Wheel on rail.

    Returns
    -------
    dict or None
        Judgement of each law that applies, in the order of `CREEP_LAWS`; None without friction.
    """
    if "creep" not in load.features:
        return None
    hertz_judgement: ForceJudgement = load.features["creep"].verdict
    rolling = build_rolling_load(load, placement, load.case.creep)

    def make_deviation_function(patch: CreepPatch) -> Callable[[_ForceLaw, Creepages], float]:
        """Deviation of a law from the exact theory on a patch, over mu N.

        The deviation is NaN if there is no force by the law or by the exact theory.
        """

        @cache
        def calculate_exact_force(creepages: Creepages) -> CreepForce | None:
            with suppress(FecontactError):
                return calculate_creep_force(DECIDING_THEORY, patch, rolling.motion(creepages))
            return None

        def calculate_deviation(force: _ForceLaw, creepages: Creepages) -> float:
            with suppress(FecontactError):
                exact = calculate_exact_force(creepages)
                return math.nan if exact is None else rolling.relative_difference(force(creepages), exact)
            return math.nan

        return calculate_deviation

    coarse_deviation, fine_deviation = (
        make_deviation_function(coarsen_patch(rolling.real)),
        make_deviation_function(rolling.real),
    )

    def judge_law(force: _ForceLaw) -> ForceJudgement:
        screening = partial(coarse_deviation, force)
        return rolling.judge_largest_deviations(
            screening, (screening, _COARSE_UNCERTAINTY), (partial(fine_deviation, force), _FINE_UNCERTAINTY)
        )

    multi_hertz = load.judgements.get(MULTI_HERTZ)
    forces = _make_force_laws(
        rolling, () if multi_hertz is None or multi_hertz.approximation is None else multi_hertz.approximation.patches
    )
    law_judgements = {name: judge_law(force) for name, force in forces.items()}
    no_deviation = replace(hertz_judgement.decided[0], deviation_of_muN=0.0, uncertainty_of_muN=0.0)
    real_judgement = judge_force([no_deviation], load.case.creep.force_limit)
    judgements = law_judgements | {"exact": hertz_judgement, REFERENCE_LAW: real_judgement}
    return {name: judgements[name] for name in CREEP_LAWS if name in judgements}


def _make_force_laws(rolling: RollingLoad, ellipses: Sequence[TheoryPatch]) -> dict[str, _ForceLaw]:
    """Force of each law as a function of the creepages at the first contact point.

    `ellipses` are the patches of the multi-Hertzian theory; without ellipses this law is left out.
    """
    forces: dict[str, _ForceLaw] = {
        "polach": lambda creepages: calculate_creep_force("polach", rolling.hertz, creepages),
        "fastsim": lambda creepages: calculate_creep_force("fastsim", rolling.hertz, creepages),
        "strips": lambda creepages: calculate_creep_force("fastsim", rolling.real, rolling.motion(creepages)),
    }
    if ellipses:
        rolling_pair = rolling.real.ellipse
        patches = [
            (make_hertz_patch(theory_patch.hertz, rolling_pair), theory_patch.centre_mm)
            for theory_patch in ellipses
            if theory_patch.hertz is not None
        ]

        def add_patch_forces(creepages: Creepages) -> CreepForce:
            """Sum of the forces on the patches of multi-Hertz, by FASTSIM on each patch."""
            # each patch has the creepages of its contact point; forces across are along the arc of the surface
            motion = rolling.motion(creepages)
            forces_on_patches = [
                calculate_creep_force("fastsim", patch, motion.at(*centre_mm)) for patch, centre_mm in patches
            ]
            return CreepForce(
                fx_N=sum(force.fx_N for force in forces_on_patches), fy_N=sum(force.fy_N for force in forces_on_patches)
            )

        forces[MULTI_HERTZ] = add_patch_forces
    return forces


def coarsen_patch(real: CreepPatch) -> CreepPatch:
    """A patch with half the number of cells along and across.

    The rolling half-space takes an eighth of the time.

    Parameters
    ----------
    real
        Patch with fine cells.

    Returns
    -------
    CreepPatch
        The patch with 24 cells along, and 24 cells across each lobe.
    """
    fine = real.cells
    cells = coarsen_pressure(
        fine.x_mm,
        fine.y_mm,
        fine.pressure_MPa,
        area_mm2=fine.area_mm2,
        cells=_COARSE_CELLS,
        lobes=max(1, round(fine.y_mm.size / fine.x_mm.size)),
    )
    return replace(real, cells=cells)
