"""Hertz's spring over an irregularity of wheel or rail.

The models are one-point models, in the order of their cost. The gap is A x^2 + B y^2 + e(x), with x along the track
from the middle of the wheel, and e > 0 where material is missing. Each model is a spring F = K_H d^1.5 and computes the
approach d from e in a different way; all models use e on the line y = 0 only. Their errors are judged by the half-space
(`model_errors`).
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

import numpy as np
from scipy.optimize import brentq

from fecontact.contact_theories.hertz import HertzContact, hertz_ellipse, hertz_spring_force_N, multi_hertz_approach_mm
from fecontact.features.irregular.limit import LIMIT
from fecontact.placement.openings import GapMinimum, GapOpening, find_gap_minima, is_on_edge

# Gauss points and weights from -1 to 1.
_GAUSS = np.polynomial.legendre.leggauss(48)
_MAX_ITERATIONS = 400
_SAMPLES = 201
_CONVERGENCE = 1e-9


@dataclass(frozen=True, kw_only=True)
class SmoothBodies:
    """Two smooth bodies in contact.

    Attributes
    ----------
    A_per_mm, B_per_mm
        Coefficients of the gap A x^2 + B y^2 in 1/mm.
    contact_modulus_MPa
        Contact modulus E*.
    """

    A_per_mm: float
    B_per_mm: float
    contact_modulus_MPa: float

    def hertz(self, normal_force_N: float, A_per_mm: float | None = None) -> HertzContact:
        """Hertz's contact under a force.

        Parameters
        ----------
        normal_force_N
            Normal force.
        A_per_mm
            Coefficient A instead of the coefficient of the pair.

        Returns
        -------
        HertzContact
            Ellipse, approach and pressure.
        """
        return hertz_ellipse(
            self.A_per_mm if A_per_mm is None else A_per_mm,
            self.B_per_mm,
            normal_force_N=normal_force_N,
            contact_modulus_MPa=self.contact_modulus_MPa,
        )


@dataclass(frozen=True, kw_only=True)
class IrregularPlace:
    """Pair of bodies at a place of an irregularity.

    Attributes
    ----------
    pair
        The smooth bodies.
    opening
        e (n,) in mm at distances x (n,) in mm from the middle of the wheel.
    reach_mm
        Half of the length that is examined: beyond it the bodies cannot touch.
    kinks_mm
        Positions at which the slope of e jumps.
    normal_force_N
        Force for which lengths are estimated.
    """

    pair: SmoothBodies
    opening: GapOpening
    reach_mm: float
    normal_force_N: float
    kinks_mm: tuple[float, ...] = ()

    @cached_property
    def hertz(self) -> HertzContact:
        """Hertz's contact of the smooth bodies under the force."""
        return self.pair.hertz(self.normal_force_N)

    @cached_property
    def touches(self) -> tuple[GapMinimum, ...]:
        """Minima of the gap, the lowest first, at which the rigid wheel touches."""
        return find_gap_minima(self.pair.A_per_mm, self.opening, self.reach_mm)

    def mean_mm(self, half_length_mm: float) -> float:
        """Mean of e from -a to a, mm.

        Parameters
        ----------
        half_length_mm
            Half length a of the patch along the rail, in mm.

        Returns
        -------
        float
            Mean opening in mm, by Gaussian quadrature.
        """
        nodes, weights = _GAUSS
        return float(0.5 * weights @ self.opening(half_length_mm * nodes))


@dataclass(frozen=True, kw_only=True)
class ModelEstimate:
    """Result of a model under a force.

    Attributes
    ----------
    approach_mm, p_max_MPa
        Approach and peak pressure; NaN without a result.
    problem
        Reason why there is no result; empty if there is a result.
    """

    approach_mm: float = np.nan
    p_max_MPa: float = np.nan
    problem: str = ""


# --- The models: approach and peak pressure under a force, and force at an approach.

EstimateFunction: TypeAlias = Callable[[IrregularPlace], ModelEstimate]
ForceFunction: TypeAlias = Callable[[IrregularPlace, float], float]


@dataclass(frozen=True, kw_only=True)
class Model:
    """Model of the contact on an irregularity.

    Attributes
    ----------
    words, cost, source, range
        Name of the model for readers, its class of cost, its source, and its range of validity.
    under
        Function for approach and peak pressure under the force of a place.
    force_N
        Function for the force at an approach; zero if the bodies are apart in the model.
    """

    words: str
    cost: str
    source: str
    range: str
    under: EstimateFunction
    force_N: ForceFunction


def _make_spring_model(gap_mm: Callable[[IrregularPlace], float]) -> tuple[EstimateFunction, ForceFunction]:
    """Make the functions of Hertz's spring over a gap.

    The spring carries a force if the approach exceeds the gap at the place.
    """
    return (
        lambda place: _shift_hertz(place, gap_mm(place)),
        lambda place, approach_mm: _compute_spring_force_N(place, approach_mm - gap_mm(place)),
    )


def estimate_filtered(place: IrregularPlace) -> ModelEstimate:
    """Estimate the contact by Hertz's spring with the mean of e over the patch's length.

    Parameters
    ----------
    place
        Place on an irregularity.

    Returns
    -------
    ModelEstimate
        Approach and peak pressure under the force.

    Notes
    -----
    Source: flat punch and reciprocity. The model is exact to first order in e. If the patch is constant, then the
    approach changes by the mean of e, weighted by the pressure of a flat punch. Integrated over y this is a plain mean
    from -a to a: sin(ka) / (ka) for a wave. Range of validity: amplitudes that are small compared with the approach.
    The model does not describe the change of the peak pressure.
    """
    return _shift_hertz(place, place.mean_mm(place.hertz.a_mm))


def compute_filtered_force_N(place: IrregularPlace, approach_mm: float) -> float:
    """Compute the force of `estimate_filtered` at an approach.

    The mean of e is over the patch of this force. If several forces fit, then the largest is returned.

    Parameters
    ----------
    place
        Place on an irregularity.
    approach_mm
        Approach.

    Returns
    -------
    float
        Force in N; zero if the bodies are apart.
    """

    def excess(spring_approach: float) -> float:
        # the half length of the patch at this spring approach
        half_length = place.hertz.a_mm * float(np.sqrt(max(spring_approach, 0.0) / place.hertz.approach_mm))
        return spring_approach + place.mean_mm(half_length) - approach_mm

    # above the highest spring approach no patch within reach has a mean low enough
    lowest_opening = float(place.opening(np.linspace(-place.reach_mm, place.reach_mm, _SAMPLES)).min())
    spring_approaches = np.linspace(
        0.0, max(approach_mm - lowest_opening, 0.0) + 1e-3 * place.hertz.approach_mm, _SAMPLES
    )
    indices_below = [
        index for index, spring_approach in enumerate(spring_approaches) if excess(float(spring_approach)) < 0.0
    ]
    if not indices_below:
        return 0.0
    last_index = indices_below[-1]
    return _compute_spring_force_N(
        place, float(brentq(excess, spring_approaches[last_index], spring_approaches[last_index + 1], xtol=1e-13))
    )


def estimate_local(place: IrregularPlace) -> ModelEstimate:
    """Estimate the contact by Hertz at each rigid contact point, with the curvature there.

    The springs share the load.

    Parameters
    ----------
    place
        Place on an irregularity.

    Returns
    -------
    ModelEstimate
        Approach and largest peak pressure; a problem if the wheel touches an edge.

    Notes
    -----
    Source: Hertz (1882), springs side by side. Range of validity: waves longer than the patch, away from hollows and
    edges.
    """
    if problem := _describe_edge_contact(place):
        return ModelEstimate(problem=problem)
    touches = place.touches
    ellipses = [place.pair.hertz(place.normal_force_N, touch.A_per_mm) for touch in touches]
    stiffness = np.array([ellipse.stiffness_N_per_mm15 for ellipse in ellipses])
    gap = np.array([touch.gap_mm for touch in touches])
    closing = np.ones(gap.size)
    approach = gap[0] + multi_hertz_approach_mm(
        stiffness, load_N=place.normal_force_N, gap_mm=gap - gap[0], closing=closing
    )
    force = stiffness * np.maximum(approach - gap, 0.0) ** 1.5
    peaks = [
        ellipse.p0_MPa * (touch_force / place.normal_force_N) ** (1.0 / 3.0)
        for ellipse, touch_force in zip(ellipses, force, strict=True)
    ]
    return ModelEstimate(approach_mm=float(approach), p_max_MPa=float(max(peaks)))


def compute_local_force_N(place: IrregularPlace, approach_mm: float) -> float:
    """Compute the force of `estimate_local` at an approach.

    Parameters
    ----------
    place
        Place on an irregularity.
    approach_mm
        Approach.

    Returns
    -------
    float
        Force in N; NaN if the wheel touches an edge.
    """
    if _describe_edge_contact(place):
        return np.nan
    return sum(
        float(
            hertz_spring_force_N(place.pair.hertz(1.0, touch.A_per_mm).stiffness_N_per_mm15, approach_mm - touch.gap_mm)
        )
        for touch in place.touches
    )


def estimate_fitted(place: IrregularPlace) -> ModelEstimate:
    """Estimate the contact by Hertz on the parabola that fits A x^2 + e.

    The fit is over the patch's length with equal weights. The model is exact to first order in e.

    Parameters
    ----------
    place
        Place on an irregularity.

    Returns
    -------
    ModelEstimate
        Approach and peak pressure; a problem if there is no such parabola.

    Notes
    -----
    Source: this program, with Legendre coefficients on the length of the patch. Range of validity: patches that do not
    bridge a hollow.

    Examples
    --------
    >>> from fecontact.features.irregular.models import IrregularPlace, SmoothBodies, estimate_fitted
    >>> pair = SmoothBodies(A_per_mm=1 / 920, B_per_mm=1 / 600, contact_modulus_MPa=115385.0)
    >>> smooth = IrregularPlace(pair=pair, opening=lambda x: 0.0 * x, reach_mm=15.0, normal_force_N=1e5)
    >>> estimate = estimate_fitted(smooth)
    >>> abs(estimate.p_max_MPa / smooth.hertz.p0_MPa - 1.0) < 1e-6
    True
    """

    def contact(A_per_mm: float, _: float) -> HertzContact:
        return place.pair.hertz(place.normal_force_N, A_per_mm)

    fit = _fit_contact(place, contact)
    if isinstance(fit, str):
        return ModelEstimate(problem=fit)
    gap, hertz = fit
    return ModelEstimate(approach_mm=gap + hertz.approach_mm, p_max_MPa=hertz.p0_MPa)


def compute_fitted_force_N(place: IrregularPlace, approach_mm: float) -> float:
    """Compute the force of `estimate_fitted` at an approach.

    Parameters
    ----------
    place
        Place on an irregularity.
    approach_mm
        Approach.

    Returns
    -------
    float
        Force in N; NaN if there is no such parabola.
    """

    def contact(A_per_mm: float, gap_mm: float) -> HertzContact:
        stiffness = place.pair.hertz(1.0, A_per_mm).stiffness_N_per_mm15
        smallest_approach = 1e-6 * place.hertz.approach_mm
        return place.pair.hertz(stiffness * max(approach_mm - gap_mm, smallest_approach) ** 1.5, A_per_mm)

    fit = _fit_contact(place, contact)
    return np.nan if isinstance(fit, str) else fit[1].normal_force_N


def _fit_contact(
    place: IrregularPlace, contact: Callable[[float, float], HertzContact]
) -> tuple[float, HertzContact] | str:
    """Fit the parabola over the length of its contact.

    Returns
    -------
    tuple or str
        Gap (mm) and contact of the parabola; or the reason why there is no such parabola.
    """
    middle, half_length = place.touches[0].x_mm, place.hertz.a_mm
    for _ in range(_MAX_ITERATIONS):
        gap, offset, A_per_mm = _fit_parabola(place, middle, half_length)
        if A_per_mm <= 0.0:
            return "the fitted parabola is concave: the patch bridges a hollow"
        hertz = contact(A_per_mm, gap)
        middle_change, length_change = (
            0.5 * float(np.clip(offset, -half_length, half_length)),
            0.5 * (hertz.a_mm - half_length),
        )
        middle, half_length = middle + middle_change, half_length + length_change
        if abs(middle) > place.reach_mm:
            break
        if max(abs(middle_change), abs(length_change)) < _CONVERGENCE * place.hertz.a_mm:
            return gap, hertz
    return "the iteration of the fitted parabola does not converge"


def _fit_parabola(place: IrregularPlace, middle_mm: float, half_mm: float) -> tuple[float, float, float]:
    """Fit a parabola to A x^2 + e about a middle.

    Returns
    -------
    tuple of float
        Smallest gap (mm), its distance from the middle (mm), and the coefficient A (1/mm) of the parabola.
    """
    nodes, weights = _GAUSS
    x = middle_mm + half_mm * nodes
    gap = place.pair.A_per_mm * x**2 + place.opening(x)
    c0, c1, c2 = (
        0.5 * order * float(weights @ (gap * legendre))
        for order, legendre in ((1.0, np.ones_like(nodes)), (3.0, nodes), (5.0, 1.5 * nodes**2 - 0.5))
    )
    A_per_mm = 1.5 * c2 / half_mm**2
    if A_per_mm <= 0.0:
        return c0, 0.0, A_per_mm
    return c0 - 0.5 * c2 - c1**2 / (4.0 * half_mm**2 * A_per_mm), -c1 / (2.0 * half_mm * A_per_mm), A_per_mm


def _shift_hertz(place: IrregularPlace, gap_mm: float) -> ModelEstimate:
    """Hertz's contact with an additional gap."""
    return ModelEstimate(approach_mm=place.hertz.approach_mm + gap_mm, p_max_MPa=place.hertz.p0_MPa)


def _compute_spring_force_N(place: IrregularPlace, d_mm: float) -> float:
    """Compute the force of Hertz's spring at an approach."""
    return float(hertz_spring_force_N(place.hertz.stiffness_N_per_mm15, d_mm))


def _describe_edge_contact(place: IrregularPlace) -> str:
    """Reason why there is no curvature at the contact point; empty if there is a curvature."""
    if is_on_edge(place.touches, place.kinks_mm, place.reach_mm):
        return "the rigid wheel touches an edge, where the curvature is undefined"
    return ""


_FUNCTIONS_BY_NAME: Mapping[str, tuple[EstimateFunction, ForceFunction]] = {
    "eq6": _make_spring_model(lambda place: float(place.opening(np.zeros(1))[0])),
    # the path of the rigid wheel's centre is the smallest A x^2 + e
    "path": _make_spring_model(lambda place: place.touches[0].gap_mm),
    "filtered": (estimate_filtered, compute_filtered_force_N),
    "local": (estimate_local, compute_local_force_N),
    "fitted": (estimate_fitted, compute_fitted_force_N),
}
_DESCRIPTIONS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
MODELS = {
    name: Model(under=under, force_N=force, **_DESCRIPTIONS[name])
    for name, (under, force) in _FUNCTIONS_BY_NAME.items()
}
"""The models by name, the cheapest model first."""


# --- Largest amplitude of a wave for Hertz's spring (eq. 6), in closed form.

# Limit of short waves, in lengths of the patch: a shorter wave is pressed flat at its crests, and a longer wave changes
# the curvature.
_SHORT_WAVE_LIMIT = 1.4
# Relative step of the curvature for derivatives.
_CURVATURE_STEP = 1e-3


@dataclass(frozen=True, kw_only=True)
class Eq6Limits:
    """Largest amplitudes of a wave for which eq. 6 is within a limit.

    The smallest of the amplitudes decides.

    Attributes
    ----------
    patch_mm
        The patch filters the wave: 1.5 (h / delta) (1 - sin(ka) / (ka)).
    slope_mm
        The wheel touches beside its middle: h k = sqrt(8 limit A delta / 3).
    peak_mm
        The wave changes the peak pressure by the curvature: h k^2 / (2 A), multiplied by the exponent of the peak.
        Below 1.4 lengths of the patch, crests are pressed flat: pi E* h / lambda.
    """

    patch_mm: float
    slope_mm: float
    peak_mm: float

    @property
    def force_mm(self) -> float:
        """Largest amplitude (mm) for the force at a given approach."""
        return min(self.patch_mm, self.slope_mm)


def compute_filter_factor(wave_number_per_mm: float, half_length_mm: float) -> float:
    """Fraction of a wave that remains in the mean over a patch: sin(ka) / (ka).

    Parameters
    ----------
    wave_number_per_mm
        Wave number k in 1/mm.
    half_length_mm
        Half length a of the patch.

    Returns
    -------
    float
        The fraction.

    Examples
    --------
    >>> import math
    >>> from fecontact.features.irregular.models import compute_filter_factor
    >>> round(compute_filter_factor(2.0 * math.pi / 60.0, 6.0), 3)
    0.935
    """
    phase = wave_number_per_mm * half_length_mm
    return math.sin(phase) / phase


def compute_eq6_limits(
    pair: SmoothBodies, normal_force_N: float, wavelength_mm: float, limit: float = LIMIT
) -> Eq6Limits:
    """Compute the largest amplitudes of a wave for eq. 6 under a force.

    Parameters
    ----------
    pair
        The smooth bodies.
    normal_force_N
        Normal force.
    wavelength_mm
        Wavelength.
    limit
        Largest relative error of force and peak pressure.

    Returns
    -------
    Eq6Limits
        Largest amplitudes in mm.

    Notes
    -----
    Source of the model: Otero Yugat, Part I, eq. 6. Range of validity: the amplitudes are within 8 % of the half-space
    for a/b 1.33 and errors of 5 %. They are within 20 % at about 4 lengths of the patch, and for a/b 0.46 and 3.2. The
    slope decides from 6 lengths of the patch.

    Examples
    --------
    >>> from fecontact.features.irregular.models import SmoothBodies, compute_eq6_limits
    >>> pair = SmoothBodies(A_per_mm=1 / 920, B_per_mm=1 / 600, contact_modulus_MPa=115385.0)
    >>> limits = compute_eq6_limits(pair, 1e5, 60.0)
    >>> round(limits.patch_mm, 3), round(limits.slope_mm, 3), round(limits.peak_mm, 3)
    (0.038, 0.037, 0.032)
    """
    hertz = pair.hertz(normal_force_N)
    wave_number = 2.0 * math.pi / wavelength_mm
    patch_limit = limit * hertz.approach_mm / (1.5 * (1.0 - compute_filter_factor(wave_number, hertz.a_mm)))
    slope_limit = math.sqrt(8.0 / 3.0 * limit * pair.A_per_mm * hertz.approach_mm) / wave_number
    if wavelength_mm <= 2.0 * _SHORT_WAVE_LIMIT * hertz.a_mm:
        peak_limit = limit * hertz.p0_MPa * wavelength_mm / (math.pi * pair.contact_modulus_MPa)
    else:
        peak_limit = 2.0 * pair.A_per_mm * limit / (wave_number**2 * compute_peak_exponent(pair))
    return Eq6Limits(patch_mm=patch_limit, slope_mm=slope_limit, peak_mm=peak_limit)


def compute_peak_exponent(pair: SmoothBodies) -> float:
    """Compute the exponent d ln p0 / d ln A of Hertz at constant force.

    Parameters
    ----------
    pair
        The smooth bodies.

    Returns
    -------
    float
        The exponent. It does not depend on the force, and is 1/3 for a circle.

    Examples
    --------
    >>> from fecontact.features.irregular.models import SmoothBodies, compute_peak_exponent
    >>> round(compute_peak_exponent(SmoothBodies(A_per_mm=1e-3, B_per_mm=1e-3, contact_modulus_MPa=115385.0)), 4)
    0.3333
    """
    log_peak_up, log_peak_down = (
        math.log(pair.hertz(1.0, pair.A_per_mm * factor).p0_MPa)
        for factor in (1.0 + _CURVATURE_STEP, 1.0 - _CURVATURE_STEP)
    )
    return (log_peak_up - log_peak_down) / math.log((1.0 + _CURVATURE_STEP) / (1.0 - _CURVATURE_STEP))
