"""How high a wave may be for Hertz's spring over it (eq. 6), in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fecontact.theory.irregular import Pair

# Where a wave shorter than this times the patch presses its crests into flat land, beyond it bends a parabola.
_SHORT = 1.4
_STEP = 1e-3


@dataclass(frozen=True, kw_only=True)
class Eq6Limits:
    """Largest amplitudes in mm of a wave over which eq. 6 is within a limit; the least of them counts.

    Attributes
    ----------
    patch_mm
        The patch filters the wave: 1.5 (h / delta) (1 - sin(ka) / (ka)).
    slope_mm
        The wheel touches beside its middle: h k = sqrt(8 limit A delta / 3).
    peak_mm
        The wave bends the surface, of the peak: h k^2 / (2 A) over its exponent; below 1.4 lengths of the patch crests
        press into flat land: pi E* h / lambda.
    """

    patch_mm: float
    slope_mm: float
    peak_mm: float

    @property
    def force_mm(self) -> float:
        """That of the force at a given approach."""
        return min(self.patch_mm, self.slope_mm)


def filter_of(wave_number_per_mm: float, half_length_mm: float) -> float:
    """How much of a wave of this number a patch of this half length lets through: sin(ka) / (ka)."""
    ka = wave_number_per_mm * half_length_mm
    return math.sin(ka) / ka


def eq6_limits(pair: Pair, normal_force_N: float, wavelength_mm: float, limit: float = 0.05) -> Eq6Limits:
    """Largest amplitudes of a wave for eq. 6 under a force.

    Range of validity: within 8 % of the half-space for a/b 1.33 and errors of 5 %, 20 % at some 4 lengths of the patch
    and for a/b 0.46 and 3.2; the slope counts from 6 lengths on.
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
    """d ln p0 / d ln A of Hertz at a given force, whatever that is; 1/3 for a circle, where both count alike."""
    up, down = (math.log(pair.hertz(1.0, pair.A_per_mm * factor).p0_MPa) for factor in (1.0 + _STEP, 1.0 - _STEP))
    return (up - down) / math.log((1.0 + _STEP) / (1.0 - _STEP))
