"""Hertz's spring over an irregularity of wheel or rail: one-point models, from the cheapest to the best.

The gap is A x^2 + B y^2 + e(x), x along the track from the middle of the wheel, e > 0 where material is missing. Each
model is a spring F = K_H d^1.5 and computes the approach d from e in a different way; all models use e on the line
y = 0 only. Their errors are judged against the half-space (`judging`).
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
from fecontact.placement.openings import GapOpening, Touch, on_edge, touches

_GAUSS = np.polynomial.legendre.leggauss(48)
_MAX_STEP_TRIALS = 400
_LOOKED_AT = 201
_SETTLED = 1e-9


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two smooth bodies: coefficients of their gap A x^2 + B y^2 in 1/mm, and the contact modulus in MPa."""

    A_per_mm: float
    B_per_mm: float
    contact_modulus_MPa: float

    def hertz(self, normal_force_N: float, A_per_mm: float | None = None) -> HertzContact:
        """Hertz's contact under a force, with `A_per_mm` instead of the pair's coefficient if given."""
        return hertz_ellipse(
            self.A_per_mm if A_per_mm is None else A_per_mm,
            self.B_per_mm,
            normal_force_N=normal_force_N,
            contact_modulus_MPa=self.contact_modulus_MPa,
        )


@dataclass(frozen=True, kw_only=True)
class Place:
    """A pair at a place of an irregularity.

    Attributes
    ----------
    opening
        e (n,) in mm at distances x (n,) in mm from the middle of the wheel.
    reach_mm
        Half of the length that is examined: beyond it the bodies cannot touch.
    kinks_mm
        Places where the slope of e jumps.
    normal_force_N
        Force for which lengths are estimated.
    """

    pair: Pair
    opening: GapOpening
    reach_mm: float
    normal_force_N: float
    kinks_mm: tuple[float, ...] = ()

    @cached_property
    def hertz(self) -> HertzContact:
        """Hertz of the smooth bodies under the force."""
        return self.pair.hertz(self.normal_force_N)

    @cached_property
    def touches(self) -> tuple[Touch, ...]:
        """Minima of the gap, the lowest first, which is where the rigid wheel touches."""
        return touches(self.pair.A_per_mm, self.opening, self.reach_mm)

    def mean_mm(self, half_length_mm: float) -> float:
        """Mean of e from -a to a."""
        nodes, weights = _GAUSS
        return float(0.5 * weights @ self.opening(half_length_mm * nodes))


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Answer of a model under a force: approach in mm and peak pressure in MPa, or why there is no answer."""

    approach_mm: float = np.nan
    p_max_MPa: float = np.nan
    problem: str = ""


# --- The models: approach and peak under a force, and force at an approach.

Under: TypeAlias = Callable[[Place], Estimate]
Force: TypeAlias = Callable[[Place, float], float]


@dataclass(frozen=True, kw_only=True)
class Model:
    """A model of the contact on an irregularity.

    Attributes
    ----------
    words, cost, source, range
        Name of the model for readers, its class of cost, its source, and its range of validity.
    under, force_N
        Approach and peak under the force of a place; force at an approach, zero if the bodies are apart in the model.
    """

    words: str
    cost: str
    source: str
    range: str
    under: Under
    force_N: Force


def _spring_over(gap_mm: Callable[[Place], float]) -> tuple[Under, Force]:
    """Hertz's spring, which carries a force once the approach exceeds a gap at the place."""
    return (
        lambda place: _shifted(place, gap_mm(place)),
        lambda place, approach_mm: _spring(place, approach_mm - gap_mm(place)),
    )


def filtered_under(place: Place) -> Estimate:
    """Hertz's spring with the mean of e over the patch's length; exact to first order in e.

    Notes
    -----
    For a constant patch the approach changes by the mean of e, weighted by the pressure of a flat punch. Integrated
    over y this is a plain mean from -a to a: sin(ka) / (ka) for a wave.
    """
    return _shifted(place, place.mean_mm(place.hertz.a_mm))


def filtered_force_N(place: Place, approach_mm: float) -> float:
    """Force of `filtered_under` at an approach, with the mean over the patch of this force; the largest solution."""

    def excess(d: float) -> float:
        # the half length of the patch at this spring approach
        half = place.hertz.a_mm * float(np.sqrt(max(d, 0.0) / place.hertz.approach_mm))
        return d + place.mean_mm(half) - approach_mm

    # above the highest spring approach no patch within reach has a mean low enough
    least = float(place.opening(np.linspace(-place.reach_mm, place.reach_mm, _LOOKED_AT)).min())
    steps = np.linspace(0.0, max(approach_mm - least, 0.0) + 1e-3 * place.hertz.approach_mm, _LOOKED_AT)
    below = [number for number, d in enumerate(steps) if excess(float(d)) < 0.0]
    if not below:
        return 0.0
    last = below[-1]
    return _spring(place, float(brentq(excess, steps[last], steps[last + 1], xtol=1e-13)))


def local_under(place: Place) -> Estimate:
    """Hertz at every rigid touch point with the curvature there; springs share the load."""
    if problem := _edge_touched(place):
        return Estimate(problem=problem)
    touches = place.touches
    whole = [place.pair.hertz(place.normal_force_N, touch.A_per_mm) for touch in touches]
    stiffness = np.array([hertz.stiffness_N_per_mm15 for hertz in whole])
    gap = np.array([touch.gap_mm for touch in touches])
    ones = np.ones(gap.size)
    approach = gap[0] + multi_hertz_approach_mm(
        stiffness, load_N=place.normal_force_N, gap_mm=gap - gap[0], closing=ones
    )
    force = stiffness * np.maximum(approach - gap, 0.0) ** 1.5
    peaks = [h.p0_MPa * (f / place.normal_force_N) ** (1.0 / 3.0) for h, f in zip(whole, force, strict=True)]
    return Estimate(approach_mm=float(approach), p_max_MPa=float(max(peaks)))


def local_force_N(place: Place, approach_mm: float) -> float:
    """Force of `local_under` at an approach; NaN without an answer."""
    if _edge_touched(place):
        return np.nan
    return sum(
        float(
            hertz_spring_force_N(place.pair.hertz(1.0, touch.A_per_mm).stiffness_N_per_mm15, approach_mm - touch.gap_mm)
        )
        for touch in place.touches
    )


def fitted_under(place: Place) -> Estimate:
    """Hertz on the parabola that fits A x^2 + e over the patch's length, with equal weights; exact to first order."""

    def contact(A_per_mm: float, _: float) -> HertzContact:
        return place.pair.hertz(place.normal_force_N, A_per_mm)

    found = _fitted(place, contact)
    if isinstance(found, str):
        return Estimate(problem=found)
    gap, hertz = found
    return Estimate(approach_mm=gap + hertz.approach_mm, p_max_MPa=hertz.p0_MPa)


def fitted_force_N(place: Place, approach_mm: float) -> float:
    """Force of `fitted_under` at an approach; NaN without an answer."""

    def contact(A_per_mm: float, gap_mm: float) -> HertzContact:
        stiffness = place.pair.hertz(1.0, A_per_mm).stiffness_N_per_mm15
        least = 1e-6 * place.hertz.approach_mm
        return place.pair.hertz(stiffness * max(approach_mm - gap_mm, least) ** 1.5, A_per_mm)

    found = _fitted(place, contact)
    return np.nan if isinstance(found, str) else found[1].normal_force_N


def _fitted(place: Place, contact: Callable[[float, float], HertzContact]) -> tuple[float, HertzContact] | str:
    """Gap and contact of the parabola that fits over the contact's length, or why there is no such parabola."""
    middle, half = place.touches[0].x_mm, place.hertz.a_mm
    for _ in range(_MAX_STEP_TRIALS):
        gap, moved, A = _parabola(place, middle, half)
        if A <= 0.0:
            return "the parabola over the patch is hollow: the patch bridges it"
        hertz = contact(A, gap)
        move, grow = 0.5 * float(np.clip(moved, -half, half)), 0.5 * (hertz.a_mm - half)
        middle, half = middle + move, half + grow
        if abs(middle) > place.reach_mm:
            break
        if max(abs(move), abs(grow)) < _SETTLED * place.hertz.a_mm:
            return gap, hertz
    return "the iteration for the parabola over the patch does not converge"


def _parabola(place: Place, middle_mm: float, half_mm: float) -> tuple[float, float, float]:
    """Parabola that fits A x^2 + e about a middle: smallest gap, its place from the middle, and coefficient."""
    nodes, weights = _GAUSS
    x = middle_mm + half_mm * nodes
    gap = place.pair.A_per_mm * x**2 + place.opening(x)
    c0, c1, c2 = (
        0.5 * order * float(weights @ (gap * legendre))
        for order, legendre in ((1.0, np.ones_like(nodes)), (3.0, nodes), (5.0, 1.5 * nodes**2 - 0.5))
    )
    A = 1.5 * c2 / half_mm**2
    if A <= 0.0:
        return c0, 0.0, A
    return c0 - 0.5 * c2 - c1**2 / (4.0 * half_mm**2 * A), -c1 / (2.0 * half_mm * A), A


def _shifted(place: Place, gap_mm: float) -> Estimate:
    return Estimate(approach_mm=place.hertz.approach_mm + gap_mm, p_max_MPa=place.hertz.p0_MPa)


def _spring(place: Place, d_mm: float) -> float:
    return float(hertz_spring_force_N(place.hertz.stiffness_N_per_mm15, d_mm))


def _edge_touched(place: Place) -> str:
    """Why there is no curvature at the touch point; empty if there is."""
    if on_edge(place.touches, place.kinks_mm, place.reach_mm):
        return "the rigid wheel touches an edge, where there is no curvature"
    return ""


_BY_NAME: Mapping[str, tuple[Under, Force]] = {
    "eq6": _spring_over(lambda place: float(place.opening(np.zeros(1))[0])),
    # the path of the rigid wheel's centre is the smallest A x^2 + e
    "path": _spring_over(lambda place: place.touches[0].gap_mm),
    "filtered": (filtered_under, filtered_force_N),
    "local": (local_under, local_force_N),
    "fitted": (fitted_under, fitted_force_N),
}
_WORDS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
MODELS = {name: Model(under=under, force_N=force, **_WORDS[name]) for name, (under, force) in _BY_NAME.items()}
"""The models by name, the cheapest first."""


# --- Largest amplitude of a wave for Hertz's spring (eq. 6), in closed form.

# A wave shorter than this many lengths of the patch is pressed flat at its crests; a longer wave changes the curvature.
_SHORT = 1.4
_STEP = 1e-3


@dataclass(frozen=True, kw_only=True)
class Eq6Limits:
    """Largest amplitudes in mm of a wave for which eq. 6 is within a limit; the smallest of them decides.

    Attributes
    ----------
    patch_mm
        The patch filters the wave: 1.5 (h / delta) (1 - sin(ka) / (ka)).
    slope_mm
        The wheel touches beside its middle: h k = sqrt(8 limit A delta / 3).
    peak_mm
        The wave changes the peak pressure by the curvature: h k^2 / (2 A) over the peak's exponent. Below 1.4 lengths
        of the patch crests are pressed flat: pi E* h / lambda.
    """

    patch_mm: float
    slope_mm: float
    peak_mm: float

    @property
    def force_mm(self) -> float:
        """Largest amplitude for the force at a given approach."""
        return min(self.patch_mm, self.slope_mm)


def filter_of(wave_number_per_mm: float, half_length_mm: float) -> float:
    """Part of a wave of this wave number that remains in the mean over a patch of this half length: sin(ka) / (ka)."""
    ka = wave_number_per_mm * half_length_mm
    return math.sin(ka) / ka


def eq6_limits(pair: Pair, normal_force_N: float, wavelength_mm: float, limit: float = 0.05) -> Eq6Limits:
    """Largest amplitudes of a wave for eq. 6 under a force.

    Range of validity: within 8 % of the half-space for a/b 1.33 and errors of 5 %; within 20 % at some 4 lengths of the
    patch and for a/b 0.46 and 3.2. The slope decides from 6 lengths on.
    """
    hertz = pair.hertz(normal_force_N)
    k = 2.0 * math.pi / wavelength_mm
    patch = limit * hertz.approach_mm / (1.5 * (1.0 - filter_of(k, hertz.a_mm)))
    slope = math.sqrt(8.0 / 3.0 * limit * pair.A_per_mm * hertz.approach_mm) / k
    if wavelength_mm <= 2.0 * _SHORT * hertz.a_mm:
        peak = limit * hertz.p0_MPa * wavelength_mm / (math.pi * pair.contact_modulus_MPa)
    else:
        peak = 2.0 * pair.A_per_mm * limit / (k**2 * peak_exponent(pair))
    return Eq6Limits(patch_mm=patch, slope_mm=slope, peak_mm=peak)


def peak_exponent(pair: Pair) -> float:
    """d ln p0 / d ln A of Hertz at constant force, independent of the force; 1/3 for a circle."""
    up, down = (math.log(pair.hertz(1.0, pair.A_per_mm * factor).p0_MPa) for factor in (1.0 + _STEP, 1.0 - _STEP))
    return (up - down) / math.log((1.0 + _STEP) / (1.0 - _STEP))
