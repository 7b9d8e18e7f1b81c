"""Case on each profile variant of its measured profiles: effect on Hertz and on the half-space."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from fecontact.case import Case
from fecontact.errors import ConvergenceError, InputError
from fecontact.judging.lines import (
    FILTER_LABEL,
    NOISE_LABEL,
    SHORT_FILTER_LABEL,
    ProfileVariants,
    VariantResult,
    is_noise_sample,
    read_filter_mm,
)
from fecontact.judging.lobes import judge_profile_variant
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.curve import Profile
from fecontact.profiles.variants import make_profile_variants
from fecontact.solving.hertz import compute_hertz
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

# Deviations shift between variants because of the profiles, and 16 nodes per semi-axis read these shifts as accurately
# as 32. If a narrow lobe would need more nodes in total than this limit, it has fewer. The tolerance causes an error of
# 1e-4 of the pressure.
_VARIANT_NODES, _MOST_VARIANT_NODES, _VARIANT_TOLERANCE = 16, 40_000, 1e-5
REFERENCE_LABEL = "own line"
# Student's factor for the scatter of four noise samples about the reference variant, for 95 %.
_STUDENT_FACTOR = 2.78
Value = TypeVar("Value")


def judge_case_variants(case: Case, placement: Placement) -> ProfileVariants | None:
    """Compare every theory with the half-space on each profile variant.

    Parameters
    ----------
    case
        Case with profiles, position and load.
    placement
        Wheel on rail with the reference variant.

    Returns
    -------
    ProfileVariants or None
        Theories on the reference variant and on all other variants; None for exact profiles.
    """

    def judge_variant(label: str, variant_placement: Placement) -> VariantResult:
        _, expected = expect_on_half_space(
            case, variant_placement, nodes=_VARIANT_NODES, most=_MOST_VARIANT_NODES, tolerance=_VARIANT_TOLERANCE
        )
        return judge_profile_variant(label, case, variant_placement, expected.half_space)

    results = _evaluate_variants(case, placement, judge_variant)
    if not results:
        return None
    reference, *variants = (
        VariantResult(label=label) if result is None else result for label, result in results.items()
    )
    return ProfileVariants(own=reference, others=tuple(variants))


def estimate_hertz_uncertainty(case: Case, placement: Placement) -> dict[str, float] | None:
    """Relative uncertainty of Hertz's peak pressure and semi-axes from measured profiles.

    The uncertainty is found in closed form. It combines the largest change by another filter or nominal profile with
    the scatter by other noise for 95 %, as independent errors.

    Parameters
    ----------
    case
        Case with profiles, position and load.
    placement
        Wheel on rail with the reference variant.

    Returns
    -------
    dict of str to float or None
        Relative uncertainty (-) by the name of the measure. None if both profiles are exact; NaN if a variant does not
        come into contact.
    """

    def read_hertz(_: str, variant_placement: Placement) -> dict[str, float]:
        hertz = compute_hertz(case, variant_placement)
        return {"p_max_MPa": hertz.p0_MPa, "a_mm": hertz.extent_x_mm / 2.0, "b_mm": hertz.extent_y_mm / 2.0}

    variants = _evaluate_variants(case, placement, read_hertz)
    if not variants:
        return None
    reference = read_hertz(REFERENCE_LABEL, placement)

    def combine_changes(name: str, value: float) -> float:
        changes = {label: math.nan if sizes is None else sizes[name] / value - 1.0 for label, sizes in variants.items()}
        noise_changes = np.array([change for label, change in changes.items() if is_noise_sample(label)])
        filter_change = np.abs([change for label, change in changes.items() if not is_noise_sample(label)]).max()
        scatter = math.sqrt(float(np.mean(noise_changes**2))) if noise_changes.size else 0.0
        return math.hypot(float(filter_change), _STUDENT_FACTOR * scatter)

    return {name: combine_changes(name, value) for name, value in reference.items()}


def _evaluate_variants(
    case: Case, placement: Placement, evaluate: Callable[[str, Placement], Value]
) -> dict[str, Value | None]:
    """Evaluate a function on the reference variant and on every other variant, by label.

    Rail and wheel have equal filters on a variant. None is the value of a variant that does not come into contact. The
    result is empty for exact profiles.
    """
    rail, wheel = placement.rail.profile, placement.wheel.profile
    rails, wheels = list_profile_variants(rail), list_profile_variants(wheel)
    labels = dict.fromkeys([*rails, *wheels])
    reference_label = join_reference_labels(label_reference(rail), label_reference(wheel))

    def evaluate_variant(label: str) -> Value | None:
        try:
            return evaluate(label, place_case(case, rail=rails.get(label, rail), wheel=wheels.get(label, wheel)))
        except (InputError, ConvergenceError):
            return None

    return (
        {reference_label: evaluate(reference_label, placement), **{label: evaluate_variant(label) for label in labels}}
        if labels
        else {}
    )


def label_reference(profile: Profile) -> str:
    """Label of the reference variant of a profile; empty without smoothing."""
    return "" if profile.measured is None else _filter_label(profile.measured.filter_mm, profile.measured.nominal)


def join_reference_labels(*labels: str) -> str:
    """Label of the reference variant of a pair: its filter if the lengths are equal.

    Parameters
    ----------
    *labels
        Labels of the reference variants of rail and wheel; empty for a profile that is not smoothed.

    Returns
    -------
    str
        Label.
    """
    different_labels = sorted({*labels} - {""})
    lengths = {read_filter_mm(label) for label in different_labels}
    return ", ".join(different_labels) if len(lengths) == 1 else REFERENCE_LABEL


def _filter_label(filter_mm: float, nominal: str, *, is_judged: bool = True) -> str:
    kind = FILTER_LABEL if is_judged else SHORT_FILTER_LABEL
    return f"{kind} {filter_mm:.3g} mm" + (f" from {nominal}" if nominal else "")


def list_profile_variants(profile: Profile) -> dict[str, Profile]:
    """Profile variants of a measured profile by label, without the reference variant.

    For a profile that passes through its points unsmoothed, the variants are the profiles through either half of the
    points.

    Parameters
    ----------
    profile
        Reference variant.

    Returns
    -------
    dict of str to Profile
        Empty for an exact profile.
    """
    if profile.measured is None:
        halves = {f"half {number + 1} of the points": profile.thinned(number) for number in (0, 1)}
        return {label: half for label, half in halves.items() if half is not None}
    return {
        f"{NOISE_LABEL} {variant.draw + 1}"
        if variant.draw >= 0
        else _filter_label(variant.filter_mm, variant.nominal, is_judged=variant.is_judged): variant.profile
        for variant in make_profile_variants(profile)
    }
