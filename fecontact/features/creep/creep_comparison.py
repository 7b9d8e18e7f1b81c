"""Verdict on the creep forces of a solved load.

They are calculated on Hertz's ellipse and on the real patch.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

from fecontact.contact_theories.rolling.creepage import (
    Creepages,
    CreepForce,
    check_friction,
)
from fecontact.contact_theories.rolling.fastsim import average_creepages
from fecontact.errors import FecontactError
from fecontact.features.creep.force_verdict import (
    DECIDING_THEORY,
    SCREENING_THEORY,
    ForceUncertainty,
    RollingLoad,
    build_rolling_load,
    estimate_force_uncertainty,
    judge_hertz_ellipse,
)
from fecontact.features.creep.forces import (
    calculate_creep_force,
    calculate_creep_forces,
    calculate_y_over_q,
)
from fecontact.features.creep.judged_force import ForceJudgement
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.measures import read_patch
from fecontact.placement.wheel_on_rail import Placement

# largest effect of the curved surfaces without a warning, over mu N; a fifth of the usual limit
_NEGLIGIBLE_SURFACE_EFFECT = 0.01


@dataclass(frozen=True, kw_only=True)
class TheoryForces:
    """Forces of a theory on Hertz's ellipse and on the real patch.

    Attributes
    ----------
    hertz, fe
        Force on each patch, or the reason why there is no force.
    deviation_of_muN, uncertainty_of_muN
        Size of the difference of both forces, over mu N, and its uncertainty from mesh to mesh; None without a value.
    fx_deviation_N, fx_uncertainty_N, fy_deviation_N, fy_uncertainty_N
        Longitudinal and lateral force on Hertz's ellipse minus that on the real patch, with their uncertainties.
    mz_deviation_Nmm, mz_uncertainty_Nmm
        The same for the moment about the normal; None for laws without a moment.
    y_over_q
        Y/Q of both patches and its deviation; None for separate patches, whose normals differ.
    t_gamma_deviation_percent, t_gamma_uncertainty_percent
        Difference of Hertz's T-gamma from that of the finite elements, and its uncertainty, in percent of the latter;
        None for laws without a moment about the normal, and without slip. T-gamma is the power of the slip over the
        running speed, the wear number of Pearce and Sherratt (1991), here with the part of the spin.
    """

    hertz: CreepForce | str
    fe: CreepForce | str
    deviation_of_muN: float | None = None
    uncertainty_of_muN: float | None = None
    t_gamma_deviation_percent: float | None = None
    t_gamma_uncertainty_percent: float | None = None
    fx_deviation_N: float | None = None
    fx_uncertainty_N: float | None = None
    fy_deviation_N: float | None = None
    fy_uncertainty_N: float | None = None
    mz_deviation_Nmm: float | None = None
    mz_uncertainty_Nmm: float | None = None
    y_over_q: ForceRatios | None = None


@dataclass(frozen=True, kw_only=True)
class ForceRatios:
    """Y/Q of a theory on Hertz's ellipse and on the real patch, without a unit.

    Attributes
    ----------
    hertz, fe
        Lateral over vertical force of the wheel on the rail, outwards positive.
    deviation, uncertainty
        Hertz's Y/Q minus that of the finite elements, and its uncertainty; None if that of the force is unknown.
    """

    hertz: float
    fe: float
    deviation: float
    uncertainty: float | None


@dataclass(frozen=True, kw_only=True)
class CreepComparison:
    """Creep forces of a solved load.

    Attributes
    ----------
    friction, limit_N
        Friction coefficient, and Coulomb's largest force mu N.
    creepages
        Creepages at the first contact point.
    centre_creepages
        Creepages at the centre of pressure of the real patch: spin about the contact point moves this centre along.
        Over curved surfaces their mean over the load.
    curved, surface_of_muN
        Whether the creepages on the real patch follow the curved surfaces (`calculate_curved_creepages`), and the
        largest change of FASTSIM's force by the curved surfaces, over mu N, over the creepages of the verdict.
    theories
        Forces of each theory.
    verdict
        Verdict over a range of creepages.
    warnings
        Reasons to doubt the forces.
    """

    friction: float
    limit_N: float
    creepages: Creepages
    centre_creepages: Creepages
    curved: bool
    surface_of_muN: float
    theories: Mapping[str, TheoryForces]
    verdict: ForceJudgement
    warnings: tuple[str, ...]


def compare_creep_forces(load: JudgedLoad, placement: Placement) -> CreepComparison | None:
    """Compare creep forces of a judged load on its ellipse and on the real patch.

    Parameters
    ----------
    load
        Judged load.
    placement
        Wheel on rail.

    Returns
    -------
    CreepComparison or None
        None if the case has no friction coefficient.
    """
    creep = load.case.creep
    if creep.friction is None:
        return None
    rolling = build_rolling_load(load, placement, creep)
    creepages, motion = rolling.creepages, rolling.motion(rolling.creepages)
    on_hertz, on_real = calculate_creep_forces(rolling.hertz, creepages), calculate_creep_forces(rolling.real, motion)
    surface_of_muN = _estimate_surface_effect(rolling)
    is_single_patch = read_patch(load.fe).patch_count == 1
    return CreepComparison(
        friction=creep.friction,
        limit_N=rolling.limit_N,
        creepages=creepages,
        centre_creepages=average_creepages(rolling.real.pieces, motion),
        curved=creep.curved,
        surface_of_muN=surface_of_muN,
        theories={
            name: _compare_theory(name, force, on_real[name], rolling, placement if is_single_patch else None)
            for name, force in on_hertz.items()
        },
        verdict=judge_hertz_ellipse(rolling),
        warnings=tuple(_list_warnings(load, creep.friction, 0.0 if creep.curved else surface_of_muN)),
    )


def _compare_theory(
    theory: str, hertz: CreepForce | str, fe: CreepForce | str, rolling: RollingLoad, placement: Placement | None
) -> TheoryForces:
    """Forces of a theory on both patches, with their deviation if both have a force.

    Deviation and uncertainty are fractions of mu N. A force that is a text is the reason for which there is none.
    Without a placement there is no Y/Q.
    """
    if isinstance(hertz, str) or isinstance(fe, str):
        return TheoryForces(hertz=hertz, fe=fe)
    # the uncertainty of the pressure changes the force of the exact theory as it changes the force of FASTSIM
    uncertainty = estimate_force_uncertainty(
        SCREENING_THEORY if theory == DECIDING_THEORY else theory, rolling, rolling.motion(rolling.creepages)
    )
    t_gamma_deviation = t_gamma_uncertainty = None
    if hertz.power_per_speed_N is not None and fe.power_per_speed_N:
        t_gamma_deviation = 1e2 * (hertz.power_per_speed_N / fe.power_per_speed_N - 1.0)
        if uncertainty is not None:
            t_gamma_uncertainty = (
                1e2 * uncertainty.force_of_muN * rolling.limit_N * _measure_slip(rolling) / abs(fe.power_per_speed_N)
            )
    has_moments = hertz.mz_Nmm is not None and fe.mz_Nmm is not None
    return TheoryForces(
        hertz=hertz,
        fe=fe,
        deviation_of_muN=rolling.relative_difference(hertz, fe),
        t_gamma_deviation_percent=t_gamma_deviation,
        t_gamma_uncertainty_percent=t_gamma_uncertainty,
        fx_deviation_N=hertz.fx_N - fe.fx_N,
        fy_deviation_N=hertz.fy_N - fe.fy_N,
        mz_deviation_Nmm=(hertz.mz_Nmm or 0.0) - (fe.mz_Nmm or 0.0) if has_moments else None,
        y_over_q=None if placement is None else _compare_ratios(hertz, fe, uncertainty, rolling, placement),
        **(
            {}
            if uncertainty is None
            else {
                "uncertainty_of_muN": uncertainty.force_of_muN,
                "fx_uncertainty_N": uncertainty.fx_N,
                "fy_uncertainty_N": uncertainty.fy_N,
                "mz_uncertainty_Nmm": uncertainty.mz_Nmm,
            }
        ),
    )


def _compare_ratios(
    hertz: CreepForce,
    fe: CreepForce,
    uncertainty: ForceUncertainty | None,
    rolling: RollingLoad,
    placement: Placement,
) -> ForceRatios | None:
    """Y/Q of both forces at the contact angle of the first contact point; None without a vertical force."""
    normal_force_N = rolling.real.ellipse.normal_force_N
    ratio_hertz, ratio_fe = (calculate_y_over_q(placement, normal_force_N, force.fy_N) for force in (hertz, fe))
    if ratio_hertz is None or ratio_fe is None:
        return None
    shift_N = 0.0 if uncertainty is None else uncertainty.fy_N
    shifted_ratios = [calculate_y_over_q(placement, normal_force_N, fe.fy_N + sign * shift_N) for sign in (-1.0, 1.0)]
    spread = [abs(ratio - ratio_fe) for ratio in shifted_ratios if ratio is not None]
    return ForceRatios(
        hertz=ratio_hertz,
        fe=ratio_fe,
        deviation=ratio_hertz - ratio_fe,
        uncertainty=None if uncertainty is None or len(spread) < len(shifted_ratios) else max(spread),
    )


def _measure_slip(rolling: RollingLoad) -> float:
    """Largest rigid slip within Hertz's ellipse (-): it bounds the change of T-gamma by a change of the force."""
    creepages, ellipse = rolling.creepages, rolling.hertz.ellipse
    return math.hypot(creepages.xi, creepages.eta) + abs(creepages.spin_per_mm) * max(ellipse.a_mm, ellipse.b_mm)


def _estimate_surface_effect(rolling: RollingLoad) -> float:
    """Largest change of FASTSIM's force by creepages that follow the curved surfaces.

    The change is compared with creepages of the tangent plane and divided by mu N. The largest value is over all judged
    creepages. NaN if FASTSIM does not cover the patch.
    """
    with suppress(FecontactError):
        return max(
            rolling.relative_difference(
                *(
                    calculate_creep_force(SCREENING_THEORY, rolling.real, motion)
                    for motion in (plane, replace(rolling.surface, plane=plane))
                )
            )
            for plane in rolling.judged_creepages
        )
    return math.nan


def _list_warnings(load: JudgedLoad, friction: float, surface_effect: float) -> Iterator[str]:
    """Warnings of friction, materials, separate patches and curved surfaces.

    `surface_effect` is the largest change of a force by creepages that follow the surface, as a fraction of mu N.
    """
    yield from check_friction(friction)
    wheel, rail = load.case.wheel_material, load.case.rail_material
    if (wheel.young_MPa, wheel.poisson) != (rail.young_MPa, rail.poisson):
        yield "wheel and rail have different elastic constants: the effect of the pressure on the slip is neglected"
    if read_patch(load.fe).patch_count > 1:
        yield (
            "the contact has separate patches: laws for a single ellipse use the ellipse of the second moments of all"
            " patches"
        )
    if surface_effect > _NEGLIGIBLE_SURFACE_EFFECT:
        yield (
            "the surfaces are curved across the patch: creepages that follow them change forces by up to"
            f" {1e2 * surface_effect:.1f} % of mu N; use --curved to include this"
        )
