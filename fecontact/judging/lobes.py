"""Lobes and separate patches of a contact, each compared with a Hertz ellipse."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from fecontact.case import Case
from fecontact.contact.grid import Rung
from fecontact.contact.patch import find_lobe_windows, measure_area_between
from fecontact.contact_theories.approximation import TheoryContact, patch_from_ellipse
from fecontact.contact_theories.hertz import HertzContact, hertz_from_hessian
from fecontact.contact_theories.registry import HERTZ, THEORIES, LoadedPlacement
from fecontact.judging.lines import NO_SHIFTS, VariantLobe, VariantResult, VariantShifts
from fecontact.judging.measures import (
    MEASURES,
    MISFITS,
    UNCERTAINTIES,
    compute_deviations,
    read_measures,
    read_patch,
    read_theory_measures,
    read_theory_misfit,
)
from fecontact.judging.own_measures import OwnMeasures
from fecontact.judging.solved_load import Level, SolvedLoad, estimate_budgets, read_other_fit, read_quality
from fecontact.judging.uncertainty import estimate_cut_plane_share, estimate_share_uncertainty
from fecontact.judging.verdict import Verdict, judge_profile_variants
from fecontact.placement.poses import ContactPoint
from fecontact.placement.wheel_on_rail import Placement

# Largest fraction of a measure that is rounding: a half-width of 4 mm on a single line of nodes reads 5e-14 mm.
_ROUNDING = 1e-9
# Measures of a lobe. Its approach is the approach of the bodies, and its extents end at the next lobe.
_LOBE_MEASURES = tuple(name for name, declared in UNCERTAINTIES.items() if declared.of_lobes)


@dataclass(frozen=True, kw_only=True)
class ContactLobe:
    """Lobe of a contact: its pressure alone, and its lateral limits.

    Lateral positions are in mm from the first contact point.

    Attributes
    ----------
    rung
        Contact without the pressures of all other lobes; the unchanged contact of a single lobe.
    normal_force_N
        Sum of the lobe's nodal forces.
    low_mm, high_mm
        Lateral limits of the lobe: valleys, or the edge of the patch.
    area_mm2
        Area of the lobe between its limits.
    separate
        Whether the pressure falls to zero at both limits.
    """

    rung: Rung
    normal_force_N: float
    low_mm: float
    high_mm: float
    area_mm2: float
    separate: bool


@dataclass(frozen=True, kw_only=True)
class LobeJudgement:
    """Lobe or separate patch, compared with Hertz's ellipse at the contact point below it.

    The ellipse has the normal force of the lobe.

    Attributes
    ----------
    normal_force_N
        Sum of the lobe's nodal forces.
    centre_mm, rail_y_mm, contact_angle_rad
        Centre of pressure (x, s from the first contact point), and the rail there.
    separate
        Whether the pressure falls to zero at both limits of the lobe.
    contact_point_number, touch
        Number of the contact point, and the contact point with the smallest gap between the limits of the lobe. None
        without a contact point, and then without an ellipse, deviations and a verdict.
    fe, fe_uncertainty
        Measures of the lobe between the finite bodies, and relative uncertainty of these measures and of the force (-)
        from meshes and nodes.
    rungs
        Measures of the lobe on each other rung with a lobe at this place.
    hertz
        Hertz's ellipse; None without a contact point or if the surfaces conform there.
    deviation, uncertainty
        Deviations of the ellipse from the finite elements, and their uncertainties (-).
    verdict
        Verdict on the ellipse.
    p_max_variants_MPa
        Smallest and largest peak over the profile variants, extended by the uncertainty from the meshes; None for exact
        profiles.
    """

    normal_force_N: float
    centre_mm: tuple[float, float]
    rail_y_mm: float
    contact_angle_rad: float
    separate: bool
    contact_point_number: int | None
    touch: ContactPoint | None
    fe: Mapping[str, float]
    fe_uncertainty: Mapping[str, float]
    rungs: Mapping[str, Mapping[str, float]]
    hertz: HertzContact | None = None
    deviation: Mapping[str, float] = field(default_factory=dict)
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    verdict: Verdict | None = None
    p_max_variants_MPa: tuple[float, float] | None = None


# Each lobe is matched on all rungs.
@lru_cache(maxsize=32)
def split_lobes(rung: Rung) -> tuple[ContactLobe, ...]:
    """Lobes of a contact, from the gauge side on.

    Parameters
    ----------
    rung
        Solved contact.

    Returns
    -------
    tuple of ContactLobe
        A single lobe has the unchanged contact as its rung.
    """
    pressure, s_mm = rung.pressure, rung.grid.s_mm
    lobe_regions = find_lobe_windows(pressure.whole().values)
    # The measures of a single lobe must be the measures of the whole contact.
    is_single = len(lobe_regions) == 1
    cell_area_mm2, column_pressure = rung.grid.whole_area_mm2(), rung.pressure_MPa.sum(axis=0)
    lobes = []
    for region in lobe_regions:
        lobe_pressure = np.zeros_like(rung.pressure_MPa)
        lobe_pressure[:, region.columns] = region.parts * rung.pressure_MPa[:, region.columns]
        lobe_force_N = float(np.sum(lobe_pressure.ravel() * cell_area_mm2))
        first_column, last_column = region.columns.start, region.columns.stop - 1
        low_mm, high_mm = (float(np.interp(end, np.arange(s_mm.size), s_mm)) for end in (region.low, region.high))
        lobes.append(
            ContactLobe(
                rung=rung if is_single else replace(rung, pressure_MPa=lobe_pressure, normal_force_N=lobe_force_N),
                normal_force_N=lobe_force_N,
                low_mm=low_mm,
                high_mm=high_mm,
                area_mm2=read_patch(rung).area_mm2
                if is_single
                else measure_area_between(
                    pressure,
                    -np.inf if region is lobe_regions[0] else low_mm,
                    np.inf if region is lobe_regions[-1] else high_mm,
                ),
                separate=bool(column_pressure[first_column] == 0.0 or first_column == 0)
                and bool(column_pressure[last_column] == 0.0 or last_column == s_mm.size - 1),
            )
        )
    return tuple(lobes)


def judge_lobes(solved_load: SolvedLoad, placement: Placement, *, usable: bool) -> tuple[LobeJudgement, ...]:
    """Judge all lobes of a solved load, in descending order of their forces.

    Parameters
    ----------
    solved_load
        Contacts of the load on all mesh levels.
    placement
        Wheel on rail, with the contact points.
    usable
        Whether the numbers of the load may be used; if not, each verdict is UNRESOLVED.

    Returns
    -------
    tuple of LobeJudgement
        A judgement for each lobe of the finest mesh level.
    """
    half_space_lobes = split_lobes(solved_load.half_space)
    judgements = (
        _judge_lobe(lobe, solved_load, placement, half_space_lobes, usable=usable)
        for lobe in split_lobes(solved_load.levels[0].fe)
    )
    return tuple(sorted(judgements, key=lambda judgement: -judgement.normal_force_N))


def _judge_lobe(
    lobe: ContactLobe,
    solved_load: SolvedLoad,
    placement: Placement,
    half_space_lobes: Sequence[ContactLobe],
    *,
    usable: bool,
) -> LobeJudgement:
    """Judge a lobe, with its measures on the half-space and its range of peaks.

    Parameters
    ----------
    lobe
        Lobe on the finest meshes.
    solved_load
        Load with all mesh levels and with the changes between profile variants.
    placement
        Wheel on rail.
    half_space_lobes
        Lobes on the half-space, of which the matching lobe is read.
    usable
        Whether the result of the load can be used; the verdict is withheld if not.

    Returns
    -------
    LobeJudgement
        Forces in N, lengths in mm, pressures in MPa. Without a contact point in the lobe there is no Hertz and no
        verdict.
    """
    patch = read_patch(lobe.rung)
    rail_y, _, angle = placement.on_profiles(patch.centre_x_mm, patch.centre_y_mm)
    number = _find_contact_point(lobe, placement)
    half_space_lobe = _match_lobe(half_space_lobes, lobe)
    lobe_measures, lobe_uncertainty = _read_lobe_measures(lobe), estimate_lobe_uncertainties(lobe, solved_load.levels)
    shifts = NO_SHIFTS if solved_load.lines is None else solved_load.lines.find_lobe_shifts(rail_y)
    judgement = LobeJudgement(
        normal_force_N=lobe.normal_force_N,
        centre_mm=(patch.centre_x_mm, patch.centre_y_mm),
        rail_y_mm=rail_y,
        contact_angle_rad=angle,
        separate=lobe.separate,
        contact_point_number=number,
        touch=None if number is None else placement.contact_points[number],
        fe=lobe_measures,
        fe_uncertainty=lobe_uncertainty,
        rungs={
            "fe": lobe_measures,
            **({} if half_space_lobe is None else {"half_space": _read_lobe_measures(half_space_lobe)}),
        },
        p_max_variants_MPa=shifts.band(lobe_measures["p_max_MPa"], lobe_uncertainty["p_max_MPa"]),
    )
    if number is None:
        return judgement
    compared = _compare_with_hertz(judgement, lobe, solved_load, placement, shifts)
    return compared if compared.verdict is None else replace(compared, verdict=compared.verdict.usable(usable))


def _compare_with_hertz(
    judgement: LobeJudgement, lobe: ContactLobe, solved_load: SolvedLoad, placement: Placement, shifts: VariantShifts
) -> LobeJudgement:
    """Add ellipse, deviations, uncertainties and verdict to the judgement of a lobe.

    The judgement stays unchanged if the surfaces conform at the contact point.
    """
    assert judgement.contact_point_number is not None
    theory = _make_ellipse(lobe, judgement.contact_point_number, placement, solved_load.case)
    if theory is None:
        # The surfaces conform at this contact point.
        return judgement

    def read_matched_values(rung: Rung) -> dict[str, float]:
        matched_lobe = _match_lobe(split_lobes(rung), lobe)
        return (
            dict.fromkeys((*_LOBE_MEASURES, *MISFITS), float("nan"))
            if matched_lobe is None
            else _read_lobe_values(matched_lobe, theory)
        )

    deviation = _compute_deviations(_read_lobe_values(lobe, theory), theory)
    share = lobe.normal_force_N / sum(fe_lobe.normal_force_N for fe_lobe in split_lobes(solved_load.levels[0].fe))
    budgets = estimate_budgets(solved_load.levels, read_matched_values, deviation, share=share)
    numerical = {name: budget.total for name, budget in budgets.items()}
    # a user's function reads the whole contact
    criteria = solved_load.case.criteria.common_criteria
    if criteria is None:
        return judgement
    verdict, uncertainty = judge_profile_variants(deviation, numerical, shifts, criteria)
    assert theory.single is not None
    return replace(
        judgement,
        hertz=theory.single.hertz,
        deviation=deviation,
        uncertainty=uncertainty,
        verdict=verdict,
    )


def estimate_lobe_uncertainties(lobe: ContactLobe, levels: Sequence[Level]) -> dict[str, float]:
    """Uncertainty of the force and the measures of a lobe on the finest level.

    Parameters
    ----------
    lobe
        Lobe of the finest level.
    levels
        Mesh levels, the finest first.

    Returns
    -------
    dict of str to float
        Relative uncertainty (-) of `normal_force_N`, and of the peak, the area and the half-widths.
    """

    def read_matched_measures(rung: Rung) -> dict[str, float]:
        matched_lobe = _match_lobe(split_lobes(rung), lobe)
        return (
            dict.fromkeys(_LOBE_MEASURES, float("nan")) if matched_lobe is None else _read_lobe_measures(matched_lobe)
        )

    def read_share(rung: Rung) -> float:
        """Fraction of the load on the matching lobe of a contact (-); NaN without a matching lobe."""
        lobes = split_lobes(rung)
        matched_lobe = _match_lobe(lobes, lobe)
        return (
            math.nan
            if matched_lobe is None
            else matched_lobe.normal_force_N / sum(rung_lobe.normal_force_N for rung_lobe in lobes)
        )

    shares, other_fit_share = [read_share(level.fe) for level in levels], read_share(read_other_fit(levels))
    budgets = estimate_budgets(levels, read_matched_measures, dict.fromkeys(_LOBE_MEASURES, 0.0), share=shares[0])
    share_error = estimate_share_uncertainty(
        shares, read_quality(levels), otherwise=other_fit_share
    ) + estimate_cut_plane_share(shares[0])
    return {"normal_force_N": share_error / shares[0]} | {name: budget.total for name, budget in budgets.items()}


def _make_ellipse(
    lobe: ContactLobe, contact_point_number: int, placement: Placement, case: Case
) -> TheoryContact | None:
    """Hertz's ellipse at a contact point under a lobe's force.

    None if the surfaces conform.
    """
    contact_point = placement.contact_points[contact_point_number]
    hessian = contact_point.curvature.hessian
    if np.linalg.eigvalsh(hessian)[0] <= 0.0:
        return None
    hertz = hertz_from_hessian(
        hessian, normal_force_N=lobe.normal_force_N, contact_modulus_MPa=case.contact_modulus_MPa
    )
    place = contact_point.x_mm - placement.first.x_mm, placement.arc_mm(contact_point)
    return TheoryContact(patches=(patch_from_ellipse(hertz, place),), approach_mm=hertz.approach_mm)


def _compute_deviations(values: Mapping[str, float], theory: TheoryContact) -> dict[str, float]:
    """Deviation of an ellipse from the values of a lobe (-).

    The half-width of a lobe on a single line of nodes is 0 or rounding. Its deviation is unknown (NaN), so that the
    verdict is UNRESOLVED.
    """
    theory_values = read_theory_measures(theory).as_dict()

    def read_deviation(name: str, value: float) -> float:
        theory_value = theory_values[name]
        return math.nan if value <= _ROUNDING * theory_value else theory_value / value - 1.0

    return {name: read_deviation(name, value) if name in MEASURES else value for name, value in values.items()}


def _read_lobe_measures(lobe: ContactLobe) -> dict[str, float]:
    measures = read_measures(lobe.rung).as_dict()
    return {name: measures[name] for name in _LOBE_MEASURES} | {"area_mm2": lobe.area_mm2}


def _read_lobe_values(lobe: ContactLobe, theory: TheoryContact) -> dict[str, float]:
    """Measures of a lobe, and its misfit relative to an ellipse."""
    return _read_lobe_measures(lobe) | read_theory_misfit(lobe.rung, theory).as_dict()


def _match_lobe(lobes: Sequence[ContactLobe], lobe: ContactLobe) -> ContactLobe | None:
    """Lobe with the largest force within the limits of a given lobe.

    A candidate has its centre of pressure within the limits. None without a candidate.
    """
    candidates = [
        candidate for candidate in lobes if lobe.low_mm <= read_patch(candidate.rung).centre_y_mm <= lobe.high_mm
    ]
    return max(candidates, key=lambda candidate: candidate.normal_force_N, default=None)


def _find_contact_point(lobe: ContactLobe, placement: Placement) -> int | None:
    """Number of the contact point with the smallest gap within the limits of a lobe.

    None without a contact point.
    """
    candidates = [
        number
        for number, contact_point in enumerate(placement.contact_points)
        if lobe.low_mm <= placement.arc_mm(contact_point) <= lobe.high_mm
    ]
    return min(candidates, key=lambda number: placement.contact_points[number].vertical_gap_mm, default=None)


def judge_profile_variant(label: str, case: Case, placement: Placement, half_space: Rung) -> VariantResult:
    """Compare theories with the half-space on a profile variant, and Hertz with every lobe.

    Parameters
    ----------
    label
        Label of the variant.
    case
        Case with material and load.
    placement
        Wheel on rail with this variant.
    half_space
        Contact of the true gap on the half-space.

    Returns
    -------
    VariantResult
        Deviations of each theory with a contact, and the lobes.
    """
    loaded = LoadedPlacement(
        placement=placement, case=case, normal_force_N=half_space.normal_force_N, half_space=half_space
    )
    own_measures = OwnMeasures.read_criteria(case, placement)
    deviations: dict[str, dict[str, float]] = {}
    for name, theory in THEORIES.items():
        theory_contact = theory.approximate(loaded)
        if theory_contact is None:
            # On this variant, the theory is identical to Hertz.
            deviations[name] = deviations[HERTZ]
        elif not isinstance(theory_contact, str) and theory_contact.definite:
            deviations[name] = compute_deviations(half_space, theory_contact) | own_measures.compute_deviations(
                half_space, theory_contact
            )
    lobes, patch = (
        (_read_variant_lobe(lobe, case, placement) for lobe in split_lobes(half_space)),
        read_patch(half_space),
    )
    return VariantResult(
        label=label, p_max_MPa=patch.p_max_MPa, deviations=deviations, patches=patch.patch_count, lobes=tuple(lobes)
    )


def _read_variant_lobe(lobe: ContactLobe, case: Case, placement: Placement) -> VariantLobe:
    """Lobe of a half-space contact on a profile variant, with the deviation of Hertz's ellipse.

    Lateral bounds are on the rail in mm, pressures in MPa. Without a contact point in the lobe there is no deviation.
    """
    low_y_mm, high_y_mm = sorted(placement.on_profiles(0.0, end)[0] for end in (lobe.low_mm, lobe.high_mm))
    number = _find_contact_point(lobe, placement)
    theory = None if number is None else _make_ellipse(lobe, number, placement, case)
    return VariantLobe(
        low_y_mm=low_y_mm,
        high_y_mm=high_y_mm,
        normal_force_N=lobe.normal_force_N,
        p_max_MPa=_read_lobe_measures(lobe)["p_max_MPa"],
        deviation={} if theory is None else _compute_deviations(_read_lobe_values(lobe, theory), theory),
    )
