"""Verdict of a solved load on Hertz for creep forces."""

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
    CreepageField,
    Creepages,
    CreepForce,
    CurvedCreepages,
    combine_materials,
)
from fecontact.contact_theories.rolling.fastsim import average_creepages
from fecontact.criteria import Creep
from fecontact.errors import FecontactError
from fecontact.features.creep.case_contact import calculate_case_creepages, make_real_patch
from fecontact.features.creep.forces import (
    CreepPatch,
    calculate_creep_force,
    calculate_curved_creepages,
    calculate_force_difference,
    make_hertz_patch,
)
from fecontact.features.creep.judged_force import ForceDeviation, ForceJudgement, judge_force
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.measures import read_patch
from fecontact.judging.solved_load import read_other_fit
from fecontact.placement.wheel_on_rail import Placement

SCREENING_THEORY, DECIDING_THEORY = "fastsim", "rolling_half_space"
"""Theories that find the largest deviations of Hertz, and that decide at these creepages.

The screening theory finds the deviations to 1 or 2 % of mu N.
"""
DISPLACED_CENTRE, PATCH_SHAPE = "centre of pressure beside the contact point", "shape of the patch"
"""Causes of a failure.

With spin, a displaced patch has different creepages (`DISPLACED_CENTRE`). All other causes are `PATCH_SHAPE`.
"""
SMALLEST_CREEPAGE = 1e-4
"""Smallest size of the creepages at which forces are judged, without unit."""
_CREEPAGE_SIZES, _DIRECTIONS = 8, 8
# number of creepages at which the deciding theory is evaluated
_DECIDED_CREEPAGES = 2
# Difference of Hertz's deviation between 32 and 72 cells along the patch: 0.1 to 0.2 % of mu N at four positions
_READING_UNCERTAINTY = 0.002
# factor of the difference between two readings of the finest mesh, as in `judging.uncertainty` for the measures
_READING_DIFFERENCE_FACTOR = 2.0
# number of points across at which the curved surfaces are evaluated
_SURFACE_POINTS = 401


ForceDeviationFunction: TypeAlias = Callable[[Creepages], float]
"""Deviation of a force over mu N at creepages of the first contact point; NaN if a theory does not cover them."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RollingLoad:
    """A solved load that rolls.

    Attributes
    ----------
    hertz, real
        Hertz's patch and the real patch.
    comparison_patches
        For the uncertainty: the patch of the next coarser mesh, and the patch of another reading of the finest mesh.
    creepages
        Creepages at the first contact point.
    surface
        Creepages over the curved surfaces.
    creep
        Friction, the limits and range by which forces are judged, and whether the real patch follows the curved
        surfaces.
    is_usable
        Whether the load may be used.
    """

    hertz: CreepPatch
    real: CreepPatch
    comparison_patches: tuple[CreepPatch, CreepPatch]
    creepages: Creepages
    surface: CurvedCreepages
    creep: Creep
    is_usable: bool

    @property
    def limit_N(self) -> float:
        """Coulomb's largest force mu N."""
        return self.real.ellipse.limit_N

    def relative_difference(self, first: CreepForce, second: CreepForce) -> float:
        """Size of the difference of two forces over mu N.

        Parameters
        ----------
        first, second
            Creep forces in N.

        Returns
        -------
        float
            Length of the difference divided by mu N (-).
        """
        return calculate_force_difference(first, second, self.limit_N)

    def motion(self, creepages: Creepages) -> CreepageField:
        """Creepages over the real patch for creepages at the first contact point.

        Parameters
        ----------
        creepages
            Creepages at the first contact point.

        Returns
        -------
        Creepages or CurvedCreepages
            Creepages over the patch; with the curvature of the surface if the input asks for it.
        """
        return replace(self.surface, plane=creepages) if self.creep.curved else creepages

    @property
    def judged_creepages(self) -> Sequence[Creepages]:
        """Creepages over which forces are judged."""
        return list_creepages(self.creep.largest_creepage, self.creepages.spin_per_mm)

    def judge_largest_deviations(
        self, screening: ForceDeviationFunction, *deciding: tuple[ForceDeviationFunction, float]
    ) -> ForceJudgement:
        """Judge a force at the creepages of its largest deviations.

        The first of the deciding theories with a resolved answer decides.

        Parameters
        ----------
        screening
            Deviation over mu N by creepages, evaluated over all creepages.
        deciding
            Pairs of a deviation over mu N by creepages, evaluated where `screening` is largest, and its uncertainty
            over mu N without the uncertainty of the pressure.

        Returns
        -------
        ForceJudgement
            Judgement by the first resolved pair, or by the last pair.
        """
        screened = {trial_creepages: screening(trial_creepages) for trial_creepages in self.judged_creepages}
        # creepages without a deviation come first
        worst = sorted(
            screened,
            key=lambda trial_creepages: (
                -math.inf if math.isnan(screened[trial_creepages]) else -screened[trial_creepages]
            ),
        )[:_DECIDED_CREEPAGES]
        pressure_terms = [
            estimate_pressure_uncertainty(SCREENING_THEORY, self, self.motion(trial_creepages))
            for trial_creepages in worst
        ]
        for deviation, discretisation in deciding:
            deviations = [
                ForceDeviation(
                    creepages=trial_creepages,
                    deviation_of_muN=deviation(trial_creepages),
                    uncertainty_of_muN=pressure_term + discretisation,
                )
                for trial_creepages, pressure_term in zip(worst, pressure_terms, strict=True)
            ]
            judgement = judge_force(deviations, self.creep.force_limit, usable=self.is_usable)
            if judgement.verdict.answer != "UNRESOLVED":
                break
        return judgement


def build_rolling_load(load: JudgedLoad, placement: Placement, creep: Creep) -> RollingLoad:
    """Prepare a judged load and its ellipse for rolling under any friction and creepages.

    Parameters
    ----------
    load
        Judged load.
    placement
        Wheel on rail.
    creep
        Friction, creepages and limits, which may differ from those of the case.

    Returns
    -------
    RollingLoad
        Hertz's patch, the real patch and its comparison patches.

    Raises
    ------
    AssertionError
        If `creep` has no friction coefficient.
    """
    assert creep.friction is not None
    case, (finest, coarser, *_) = load.case, load.solved.levels
    pair = combine_materials(creep.friction, case.wheel_material, case.rail_material)

    def patch(rung: Rung) -> CreepPatch:
        return make_real_patch(rung, read_patch(rung), pair)

    real, comparison_patches = patch(finest.fe), (patch(coarser.fe), patch(read_other_fit(load.solved.levels)))
    creepages = calculate_case_creepages(replace(case, creep=creep), placement)
    edges_mm = [
        float(rolling_patch.cells.y_mm[end]) for rolling_patch in (real, *comparison_patches) for end in (0, -1)
    ]
    s_mm = np.linspace(min(0.0, *edges_mm), max(0.0, *edges_mm), _SURFACE_POINTS)
    return RollingLoad(
        hertz=make_hertz_patch(load.hertz, pair),
        real=real,
        comparison_patches=comparison_patches,
        creepages=creepages,
        surface=calculate_curved_creepages(placement, creepages, s_mm, creep.speed_ratio),
        creep=creep,
        is_usable=load.usable,
    )


def judge_hertz_force(load: JudgedLoad, placement: Placement, creep: Creep | None = None) -> ForceJudgement:
    """Judge Hertz for forces alone, under any friction and creepages.

    Parameters
    ----------
    load
        Judged load.
    placement
        Wheel on rail.
    creep
        Friction, creepages and limits; None for the values of the case.

    Returns
    -------
    ForceJudgement
        Verdict on Hertz, with its deviations over mu N.
    """
    return judge_hertz_ellipse(build_rolling_load(load, placement, creep or load.case.creep))


def judge_hertz_ellipse(rolling: RollingLoad) -> ForceJudgement:
    """Judge Hertz's ellipse for forces.

    FASTSIM screens the whole range of creepages, and the rolling half-space decides where FASTSIM finds the largest
    deviations.

    Parameters
    ----------
    rolling
        Solved load that rolls.

    Returns
    -------
    ForceJudgement
        Verdict; if the limit is exceeded, with a cause.
    """

    def deviation(theory: str, creepages: Creepages) -> float:
        """Deviation of the force on Hertz's ellipse, over mu N; NaN unless the theory covers both patches."""
        with suppress(FecontactError):
            on_hertz = calculate_creep_force(theory, rolling.hertz, creepages)
            return rolling.relative_difference(
                on_hertz, calculate_creep_force(theory, rolling.real, rolling.motion(creepages))
            )
        return math.nan

    judgement = rolling.judge_largest_deviations(
        partial(deviation, SCREENING_THEORY), (partial(deviation, DECIDING_THEORY), 0.0)
    )
    if not judgement.limit_utilisation > 1.0:
        return judgement
    return replace(judgement, verdict=replace(judgement.verdict, cause=_find_cause(rolling, judgement.decided[0])))


def _find_cause(rolling: RollingLoad, worst: ForceDeviation) -> str | None:
    """The larger of two changes of FASTSIM's force: by the creepages of the real patch, or by its shape.

    The first change is from the creepages at the contact point to the mean creepages of the real patch, both on Hertz's
    ellipse. The second change is from Hertz's ellipse to the real patch. None if FASTSIM does not cover a patch.
    """
    motion = rolling.motion(worst.creepages)
    try:
        forces = (
            calculate_creep_force(SCREENING_THEORY, rolling.hertz, worst.creepages),
            calculate_creep_force(SCREENING_THEORY, rolling.hertz, average_creepages(rolling.real.pieces, motion)),
            calculate_creep_force(SCREENING_THEORY, rolling.real, motion),
        )
    except FecontactError:
        return None
    by_place, by_shape = (rolling.relative_difference(before, after) for before, after in pairwise(forces))
    return DISPLACED_CENTRE if by_place > by_shape else PATCH_SHAPE


@dataclass(frozen=True, kw_only=True)
class ForceUncertainty:
    """Uncertainty of a creep force by the solved pressure.

    Attributes
    ----------
    force_of_muN
        Uncertainty of the force as a vector, over mu N.
    fx_N, fy_N, mz_Nmm
        Uncertainty of each component, and of the moment about the normal; None for a law without a moment.
    """

    force_of_muN: float
    fx_N: float
    fy_N: float
    mz_Nmm: float | None


def estimate_force_uncertainty(theory: str, rolling: RollingLoad, motion: CreepageField) -> ForceUncertainty | None:
    """Uncertainty of a theory's force and of its components by the solved pressure.

    Parameters
    ----------
    theory
        Name, from `CREEP_THEORIES`.
    rolling
        Solved load that rolls.
    motion
        Creepages over the real patch.

    Returns
    -------
    ForceUncertainty or None
        None if the theory does not cover the patches of all meshes.
    """
    with suppress(FecontactError):
        finest, coarser, other_reading = (
            calculate_creep_force(theory, patch, motion) for patch in (rolling.real, *rolling.comparison_patches)
        )

        def add_differences(reading: float, difference: Callable[[CreepForce, CreepForce], float]) -> float:
            return (
                reading + difference(finest, coarser) + _READING_DIFFERENCE_FACTOR * difference(finest, other_reading)
            )

        reading_N, ellipse = _READING_UNCERTAINTY * rolling.limit_N, rolling.hertz.ellipse
        has_moment = None not in (finest.mz_Nmm, coarser.mz_Nmm, other_reading.mz_Nmm)
        return ForceUncertainty(
            force_of_muN=add_differences(_READING_UNCERTAINTY, rolling.relative_difference),
            fx_N=add_differences(reading_N, lambda first, second: abs(first.fx_N - second.fx_N)),
            fy_N=add_differences(reading_N, lambda first, second: abs(first.fy_N - second.fy_N)),
            mz_Nmm=add_differences(
                # 32 and 72 cells along the patch: at most 0.1 % of mu N times this arm, at S1002 on 60E1
                reading_N * math.sqrt(ellipse.a_mm * ellipse.b_mm),
                lambda first, second: abs((first.mz_Nmm or 0.0) - (second.mz_Nmm or 0.0)),
            )
            if has_moment
            else None,
        )
    return None


def estimate_pressure_uncertainty(theory: str, rolling: RollingLoad, motion: CreepageField) -> float:
    """Uncertainty of a theory's force by the solved pressure, over mu N.

    Parameters
    ----------
    theory
        Name, from `THEORIES`.
    rolling
        Solved load that rolls.
    motion
        Creepages over the real patch.

    Returns
    -------
    float
        NaN if the theory does not cover the patches of all meshes.
    """
    uncertainty = estimate_force_uncertainty(theory, rolling, motion)
    return math.nan if uncertainty is None else uncertainty.force_of_muN


def list_creepages(largest: float, spin_per_mm: float) -> Sequence[Creepages]:
    """Creepages from 0.01 % to the largest creepage in eight directions.

    Parameters
    ----------
    largest
        Largest size of the creepage, without unit.
    spin_per_mm
        Spin of all creepages.

    Returns
    -------
    list of Creepages
        Eight sizes in geometric progression, each in eight directions.

    Examples
    --------
    >>> from fecontact.features.creep.force_verdict import list_creepages
    >>> creepages = list_creepages(0.01, 0.0)
    >>> len(creepages), creepages[0].xi, round(creepages[-8].xi, 12)
    (64, 0.0001, 0.01)
    """
    ratio = (largest / SMALLEST_CREEPAGE) ** (1.0 / (_CREEPAGE_SIZES - 1))
    angles = [2.0 * math.pi * k / _DIRECTIONS for k in range(_DIRECTIONS)]
    return [
        Creepages(
            # rounding gives exact zeros along an axis
            xi=size * round(math.cos(angle), 12),
            eta=size * round(math.sin(angle), 12),
            spin_per_mm=spin_per_mm,
        )
        for size in (SMALLEST_CREEPAGE * ratio**power for power in range(_CREEPAGE_SIZES))
        for angle in angles
    ]
