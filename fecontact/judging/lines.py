"""Shifts of deviations between the profile variants of a measured profile.

A profile variant is a smoothed profile that is consistent with the measured points. Noise and filters change a profile,
and with it the theory and the contact together. The uncertainty of a theory is therefore the change of its deviation
from variant to variant, and not the change of the contact.

A change from variant to variant can only be stated between contacts with equal patches. If a second patch exists on one
variant only, the variant is judged by its contact on the half-space.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fecontact.arrays import Floats
from fecontact.judging.measures import is_relative
from fecontact.own_criterion import is_own

Deviations = Mapping[str, float]
_NO_DEVIATIONS: Deviations = {}
_SEPARATE_LOAD = "separate_load"
FILTER_LABEL = "filter"
"""Beginning of the label of a variant with a different filter length; the length in mm follows."""
NOISE_LABEL = "noise"
"""Beginning of the label of a variant with a different noise sample."""

SHORT_FILTER_LABEL = "short filter"
"""Beginning of the label of a variant whose filter is shorter than known noise asks for; the length in mm follows."""


def is_noise_sample(label: str) -> bool:
    """Whether a variant has a different noise sample, by its label."""
    return label.startswith(NOISE_LABEL)


def is_judged(label: str) -> bool:
    """Whether a variant counts for verdicts, by its label.

    A variant whose filter is shorter than known noise asks for is not judged: noise alone can decide its answer. Its
    deviation and peak are in the stated ranges.
    """
    return not label.startswith(SHORT_FILTER_LABEL)


OPEN_CAUSES = {
    "filter": "a declared filter length",
    "nominal profile": "a given nominal profile, or none",
    "noise": "less noise, or closer points",
    "mesh": "finer meshes",
    "solution": "a usable solution",
}
"""What decides an open verdict, in words, by the name of its cause."""


def read_filter_mm(label: str) -> float | None:
    """Filter length of a variant in mm, from its label; None without a length."""
    return float(label.split()[1]) if label.startswith(f"{FILTER_LABEL} ") else None


def find_open_cause(answers: Mapping[str, str]) -> str:
    """Find the cause of an open verdict from the answers on the profile variants.

    Parameters
    ----------
    answers
        Answer on each variant by its label, with the reference variant first; empty for an exact profile.

    Returns
    -------
    str
        Name in `OPEN_CAUSES`: `filter` if the answers differ between filter lengths, `nominal profile` if they differ
        between variants of equal length, `noise` if only noise samples differ, and `mesh` if all answers are equal.

    Examples
    --------
    >>> from fecontact.judging.lines import find_open_cause
    >>> find_open_cause({"filter 5.66 mm": "HOLDS", "filter 4 mm": "FAILS", "filter 8 mm": "HOLDS"})
    'filter'
    """
    points_answers = {label: answer for label, answer in answers.items() if not is_noise_sample(label)}
    if len({*points_answers.values()}) > 1:
        has_one_filter = len({read_filter_mm(label) for label in points_answers}) == 1
        return "nominal profile" if has_one_filter else "filter"
    return "noise" if len({*answers.values()}) > 1 else "mesh"


@dataclass(frozen=True, kw_only=True)
class VariantLobe:
    """Lobe of a half-space contact on a profile variant.

    Attributes
    ----------
    low_y_mm, high_y_mm
        Lateral limits of the lobe on the rail in mm.
    normal_force_N, p_max_MPa
        Force and peak pressure of the lobe.
    deviation
        Deviation of Hertz's ellipse at the contact point below the lobe (-); empty without a contact point.
    """

    low_y_mm: float
    high_y_mm: float
    normal_force_N: float
    p_max_MPa: float
    deviation: Deviations = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class VariantResult:
    """Theories compared with the half-space on a single profile variant.

    Attributes
    ----------
    label
        Label of the variant, such as `filter 4 mm`.
    p_max_MPa
        Peak pressure of the half-space; NaN if the variant does not come into contact.
    deviations
        Deviations of each theory (-), by its name; a theory without a contact has no entry.
    patches
        Number of separate patches of the half-space.
    lobes
        Lobes of the half-space, from the gauge side on.
    """

    label: str
    p_max_MPa: float = math.nan
    deviations: Mapping[str, Deviations] = field(default_factory=dict)
    patches: int = 1
    lobes: tuple[VariantLobe, ...] = ()

    def find_lobe(self, rail_y_mm: float) -> VariantLobe | None:
        """Lobe with the largest force at a lateral position on the rail.

        Parameters
        ----------
        rail_y_mm
            Lateral position on the rail in mm.

        Returns
        -------
        VariantLobe or None
            None if no lobe covers the position.
        """
        lobes = [lobe for lobe in self.lobes if lobe.low_y_mm <= rail_y_mm <= lobe.high_y_mm]
        return max(lobes, key=lambda lobe: lobe.normal_force_N, default=None)


@dataclass(frozen=True, kw_only=True)
class VariantShifts:
    """Shifts of deviations and peak from the reference variant to each profile variant.

    The reference variant is the profile on which the finite elements are solved. Keys are labels of variants.

    Attributes
    ----------
    by_line
        Factor on 1 + deviation for each of `MEASURES`, and summand for each of the `MISFITS` (-). Empty for a variant
        without the contact.
    peaks
        Peak pressure divided by the peak pressure on the reference variant (-); NaN without a contact.
    half_space
        Deviations from the half-space on each variant (-).
    own
        Deviations from the half-space on the reference variant (-).
    other_patches
        Labels of the variants with patches that differ from the patches of the half-space on the reference variant.
    """

    by_line: Mapping[str, Deviations] = field(default_factory=dict)
    peaks: Mapping[str, float] = field(default_factory=dict)
    half_space: Mapping[str, Deviations] = field(default_factory=dict)
    own: Deviations = field(default_factory=dict)
    other_patches: frozenset[str] = frozenset()

    def deviations(self, deviation: Deviations) -> dict[str, dict[str, float]]:
        """Deviations from the finite elements on each variant.

        On a variant with different patches, they are the deviations from the half-space on that variant.

        Parameters
        ----------
        deviation
            Deviations on the reference variant (-), by the name of the measure.

        Returns
        -------
        dict of str to dict
            Deviations (-) by the label of the variant and the name of the measure; NaN without a contact.
        """
        return {
            label: {name: self.half_space[label].get(name, math.nan) for name in deviation}
            if self._is_judged_alone(label, deviation)
            else self._shifted_deviations(label, deviation)
            for label in self.by_line
        }

    def step_uncertainty(self, label: str, deviation: Deviations) -> dict[str, float]:
        """Uncertainty on a variant from the step between half-space and finite elements.

        The step is solved on the reference variant alone. It is the uncertainty on a variant with different patches. It
        is zero on a variant with equal patches, since deviations there already contain the step.

        Parameters
        ----------
        label
            Label of the variant.
        deviation
            Deviations on the reference variant (-), by the name of the measure.

        Returns
        -------
        dict of str to float
            Uncertainty of each deviation (-).
        """
        if not self._is_judged_alone(label, deviation):
            return dict.fromkeys(deviation, 0.0)
        half_space_deviation = self.half_space[label]
        return {
            name: self._step(name, value, half_space_deviation.get(name, math.nan)) for name, value in deviation.items()
        }

    def _shifted_deviations(self, label: str, deviation: Deviations) -> dict[str, float]:
        """Deviations on a variant with equal patches; NaN if the variant lacks the contact."""
        shift = self.by_line[label]
        return {
            name: (1.0 + value) * shift.get(name, math.nan) - 1.0
            if is_relative(name)
            else value + shift.get(name, math.nan)
            for name, value in deviation.items()
        }

    def _step(self, name: str, value: float, variant_value: float) -> float:
        """Step of a deviation between half-space and finite elements on the reference variant.

        For `MEASURES` it is scaled to 1 + deviation on another variant. `value` is the deviation from the finite
        elements on the reference variant, and `variant_value` the deviation from the half-space on the other variant
        (-).
        """
        reference_value = self.own.get(name, math.nan)
        return (
            abs((1.0 + variant_value) * ((1.0 + value) / (1.0 + reference_value) - 1.0))
            if is_relative(name)
            else abs(value - reference_value)
        )

    def _is_judged_alone(self, label: str, deviation: Deviations) -> bool:
        """Whether a variant is judged by its half-space contact.

        This is necessary if the shifts do not lead to its patches, or if they lead to a negative load.
        """
        shifted_load = deviation.get(_SEPARATE_LOAD, math.nan) + self.by_line[label].get(_SEPARATE_LOAD, math.nan)
        return label in self.other_patches or (label in self.half_space and shifted_load < 0.0)

    def farthest(self, name: str, value: float) -> float:
        """Largest difference of a deviation between any variant and the reference variant.

        Variants with different patches count individually, with their step to the finite elements.

        Parameters
        ----------
        name
            Name of the measure.
        value
            Deviation on the reference variant (-).

        Returns
        -------
        float
            Absolute difference (-); NaN without a finite shift.
        """
        shifts = {
            label: shift.get(name, math.nan) for label, shift in self.by_line.items() if label not in self.other_patches
        }
        combined_shifts = (
            (1.0 + value) * (_combine_filter_and_noise(shifts, np.multiply) - 1.0)
            if is_relative(name)
            else _combine_filter_and_noise(shifts, np.add)
        )
        variant_values = [self.half_space[label].get(name, math.nan) for label in self.other_patches]
        variant_shifts = [
            abs(variant_value - value) + self._step(name, value, variant_value) for variant_value in variant_values
        ]
        distances = np.array([*np.abs(combined_shifts), *variant_shifts])
        distances = distances[np.isfinite(distances)]
        return float(distances.max()) if distances.size else math.nan

    def band(self, p_max_MPa: float, relative_uncertainty: float = 0.0) -> tuple[float, float] | None:
        """Smallest and largest peak pressure over the variants.

        Parameters
        ----------
        p_max_MPa
            Peak pressure on the reference variant in MPa.
        relative_uncertainty
            Numerical uncertainty of the peak (-), by which the range is extended.

        Returns
        -------
        tuple of float or None
            Peak pressures in MPa; None for exact profiles.
        """
        peaks_MPa = p_max_MPa * _combine_filter_and_noise(self.peaks, np.multiply)
        return (
            (
                float(peaks_MPa.min()) * (1.0 - relative_uncertainty),
                float(peaks_MPa.max()) * (1.0 + relative_uncertainty),
            )
            if peaks_MPa.size
            else None
        )


def _combine_filter_and_noise(shifts: Mapping[str, float], combine: np.ufunc) -> Floats:
    """Shifts for each combination of a filter length with a noise sample.

    Filter length and noise are independent: the filter may be at an end of its usual range, and the points have their
    noise there too.
    """
    finite_shifts = {label: shift for label, shift in shifts.items() if math.isfinite(shift)}
    noise_shifts = [shift for label, shift in finite_shifts.items() if is_noise_sample(label)]
    filter_shifts = [shift for label, shift in finite_shifts.items() if not is_noise_sample(label)]
    return np.asarray(combine.outer(filter_shifts, [combine.identity, *noise_shifts])).ravel()


NO_SHIFTS = VariantShifts()
"""Shifts of exact profiles, which have no variants."""


@dataclass(frozen=True, kw_only=True)
class ProfileVariants:
    """Theories on the reference variant, and on all other profile variants.

    Finite elements are solved on the reference variant alone.

    Attributes
    ----------
    own
        Theories on the reference variant.
    others
        Theories on each other variant.
    """

    own: VariantResult
    others: tuple[VariantResult, ...]

    @property
    def all(self) -> tuple[VariantResult, ...]:
        """All variants, with the reference variant first."""
        return (self.own, *self.others)

    def select_own(self, own_measures: Collection[str]) -> ProfileVariants:
        """Variants with the deviations in some of a user's measures only.

        The deviations in a user's measure are stored with a solution. They are not valid for another function.

        Parameters
        ----------
        own_measures
            Names of the user's measures to keep.

        Returns
        -------
        ProfileVariants
            Variants without the deviations in all other measures of a user.
        """

        def select(variant: VariantResult) -> VariantResult:
            deviations = {
                theory: {name: value for name, value in values.items() if not is_own(name) or name in own_measures}
                for theory, values in variant.deviations.items()
            }
            return replace(variant, deviations=deviations)

        return ProfileVariants(own=select(self.own), others=tuple(map(select, self.others)))

    def find_shifts(self, theory: str) -> VariantShifts:
        """Shifts of the deviations of a theory.

        Parameters
        ----------
        theory
            Name of the theory.

        Returns
        -------
        VariantShifts
            Shifts from the reference variant to each variant.
        """
        shifts = _compute_shifts(
            {variant.label: (variant.deviations.get(theory, _NO_DEVIATIONS), variant.p_max_MPa) for variant in self.all}
        )
        return replace(shifts, other_patches=frozenset(self._iterate_variants_with_other_patches(theory)))

    def _iterate_variants_with_other_patches(self, theory: str) -> Iterator[str]:
        """Labels of variants with different patches than the reference variant.

        The number of patches differs, or load on patches outside the theory exists on either variant only. Variants
        without a contact are not included.
        """
        reference_deviation = self.own.deviations.get(theory, _NO_DEVIATIONS)
        for variant in self.others:
            deviation = variant.deviations.get(theory, _NO_DEVIATIONS)
            if reference_deviation and deviation:
                has_separate_load = (
                    values.get(_SEPARATE_LOAD, 0.0) > 0.0 for values in (reference_deviation, deviation)
                )
                if variant.patches != self.own.patches or len({*has_separate_load}) > 1:
                    yield variant.label

    def find_lobe_shifts(self, rail_y_mm: float) -> VariantShifts:
        """Shifts of the deviations of Hertz on the lobe at a lateral position.

        Parameters
        ----------
        rail_y_mm
            Lateral position on the rail in mm.

        Returns
        -------
        VariantShifts
            Shifts from the reference variant to each variant; empty on variants without such a lobe.
        """
        lobes = {variant.label: variant.find_lobe(rail_y_mm) for variant in self.all}
        return _compute_shifts(
            {
                label: (_NO_DEVIATIONS, math.nan) if lobe is None else (lobe.deviation, lobe.p_max_MPa)
                for label, lobe in lobes.items()
            }
        )


def _compute_shifts(variants: Mapping[str, tuple[Deviations, float]]) -> VariantShifts:
    """Shifts of the deviations from the reference variant to each variant, the reference included.

    Parameters
    ----------
    variants
        Deviations (-) and peak pressure (MPa) by the label of the variant; the reference variant is the first.

    Returns
    -------
    VariantShifts
        Factors (1 + deviation) / (1 + reference deviation) for `MEASURES`, differences for `MISFITS`, and ratios of the
        peak pressures.
    """
    (reference, reference_peak_MPa), *_ = variants.values()
    shifts = {
        label: {
            name: (1.0 + value) / (1.0 + reference[name]) if is_relative(name) else value - reference[name]
            for name, value in deviation.items()
            if name in reference
        }
        for label, (deviation, _) in variants.items()
    }
    return VariantShifts(
        by_line=shifts,
        peaks={label: peak_MPa / reference_peak_MPa for label, (_, peak_MPa) in variants.items()},
        half_space={label: deviation for label, (deviation, _) in variants.items()},
        own=reference,
    )
