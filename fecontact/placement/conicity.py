"""Equivalent conicity of a rolling-radius difference, by the kinematic motion and linearised.

A wheelset without suspension, mass or slip follows y'' = -dr(y) / (e r0). Here dr is the rolling radius of the left
wheel minus the rolling radius of the right wheel, e the distance of the contact points and r0 the mean rolling radius.
The equivalent conicity is the slope of the cones with equal wave length at equal amplitude (EN 15302:2021).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from fecontact.arrays import Floats

# Points of an integral over half a wave or over a period. A step of 2 mm of the difference costs 1e-6 of the conicity.
_PHASE_COUNT = 4000
# Differences below this (mm) are the rounding of the contact points: the radii are equal.
_EQUAL_RADII_MM = 1e-9


@dataclass(frozen=True, kw_only=True)
class KinematicMotion:
    """Motion of a wheelset between two shifts, and the cones with equal wave length.

    Attributes
    ----------
    conicity
        Slope of these cones: 0 if the wheelset does not return.
    low_mm, high_mm
        Smallest and largest shift. The amplitude is half of their distance.
    """

    conicity: float
    low_mm: float
    high_mm: float


@dataclass(frozen=True, kw_only=True, eq=False)
class RadiusDifference:
    """Rolling radius of the left wheel minus rolling radius of the right wheel.

    It is a function of the shift, and linear between the shifts.

    Attributes
    ----------
    shifts_mm : ndarray of shape (n,)
        Increasing shifts in mm, positive to the left.
    difference_mm : ndarray of shape (n,)
        Finite difference in mm at each shift.

    Examples
    --------
    >>> cones = RadiusDifference(shifts_mm=np.array([-4.0, 4.0]), difference_mm=np.array([-0.2, 0.2]))
    >>> round(cones.conicity(3.0), 9)
    0.025
    """

    shifts_mm: Floats
    difference_mm: Floats

    @classmethod
    def of(cls, shifts_mm: ArrayLike, difference_mm: ArrayLike) -> RadiusDifference | None:
        """Radius difference of the finite values next to the middle of the track.

        Parameters
        ----------
        shifts_mm : ndarray of shape (n,)
            Increasing shifts in mm.
        difference_mm : ndarray of shape (n,)
            Difference in mm at each shift; NaN where a wheel is not over its rail.

        Returns
        -------
        RadiusDifference or None
            None with fewer than two finite values.
        """
        shifts, difference = np.asarray(shifts_mm, dtype=float), np.asarray(difference_mm, dtype=float)
        finite_indices = np.flatnonzero(np.isfinite(difference))
        stretches = np.split(finite_indices, np.flatnonzero(np.diff(finite_indices) > 1) + 1)
        stretch = min(stretches, key=lambda indices: np.abs(shifts[indices]).min(initial=math.inf))
        return cls(shifts_mm=shifts[stretch], difference_mm=difference[stretch]) if stretch.size > 1 else None

    def at(self, shift_mm: ArrayLike) -> Floats:
        """Difference (mm) at shifts (mm) within the range.

        Parameters
        ----------
        shift_mm
            Lateral shifts in mm, in any shape.

        Returns
        -------
        ndarray
            Difference of the rolling radii in mm, in the shape of `shift_mm`.
        """
        return np.asarray(np.interp(np.asarray(shift_mm, dtype=float), self.shifts_mm, self.difference_mm))

    @cached_property
    def _integrals(self) -> Floats:
        """Integral (n,) of the difference in mm2 up to each shift."""
        steps = 0.5 * np.diff(self.shifts_mm) * (self.difference_mm[1:] + self.difference_mm[:-1])
        return np.concatenate(([0.0], np.cumsum(steps)))

    def integral(self, shift_mm: ArrayLike) -> Floats:
        """Integral of the difference from the smallest shift to other shifts.

        It is exact between the shifts of the difference.

        Parameters
        ----------
        shift_mm : ndarray of shape (m,)
            Upper ends of the integral in mm.

        Returns
        -------
        integral (m,)
            Integral in mm2.
        """
        shift = np.asarray(shift_mm, dtype=float)
        k = np.clip(np.searchsorted(self.shifts_mm, shift, side="right") - 1, 0, self.shifts_mm.size - 2)
        mean = 0.5 * (self.difference_mm[k] + self.at(shift))
        return np.asarray(self._integrals[k] + (shift - self.shifts_mm[k]) * mean)

    @cached_property
    def equal_radii_mm(self) -> float:
        """Shift (mm) of equal rolling radii that is nearest to the middle of the track.

        NaN if there is no such shift.
        """
        difference = np.where(np.abs(self.difference_mm) < _EQUAL_RADII_MM, 0.0, self.difference_mm)
        zeros = []
        for k in np.flatnonzero(difference[:-1] * difference[1:] <= 0.0):
            low, high = self.shifts_mm[k : k + 2]
            step = difference[k + 1] - difference[k]
            zeros.append(float(np.clip(0.0, low, high)) if step == 0.0 else low - difference[k] * (high - low) / step)
        return float(min(zeros, key=abs, default=math.nan))

    def motion(self, amplitude_mm: float) -> KinematicMotion | None:
        """Kinematic motion of an amplitude about the shift of equal radii.

        The integral of the difference is equal at both ends: there the wheelset turns round. Nowhere between them is
        the integral larger. Of several motions, the result is the motion with the middle nearest to the shift of equal
        radii.

        Parameters
        ----------
        amplitude_mm
            Half of the distance between both ends in mm.

        Returns
        -------
        KinematicMotion or None
            None if there is no such motion within the range of the shifts: the radii are nowhere equal, or they steer
            the wheelset away from there.
        """
        width, end = 2.0 * amplitude_mm, self.shifts_mm[-1]
        places = np.concatenate((self.shifts_mm, self.shifts_mm - width, [end - width]))
        places = np.unique(places[(places >= self.shifts_mm[0]) & (places <= end - width + 1e-12)])

        def integral_difference(low: ArrayLike) -> Floats:
            """Integral at the upper end minus integral at the lower end of motions, in mm2."""
            return np.asarray(self.integral(np.asarray(low) + width) - self.integral(low))

        values = integral_difference(places)
        values[np.abs(values) < _EQUAL_RADII_MM * width] = 0.0
        crossings = np.flatnonzero((values[:-1] < 0.0) & (values[1:] > 0.0))
        lows = [
            *places[values == 0.0],
            *(brentq(integral_difference, *places[k : k + 2], xtol=1e-13) for k in crossings),
        ]
        # Sorted by the distance of their middles from the shift of equal radii, which lies within the motion.
        motions = sorted((abs(low + amplitude_mm - self.equal_radii_mm), float(low)) for low in lows)
        for distance, low in motions:
            conicity = self._conicity_between(low, low + width) if distance <= amplitude_mm + _EQUAL_RADII_MM else None
            if conicity is not None:
                return KinematicMotion(conicity=conicity, low_mm=low, high_mm=low + width)
        return None

    def _conicity_between(self, low: float, high: float) -> float | None:
        """Conicity of the motion between two shifts; None if the wheelset does not reach the second shift.

        The first integral of the kinematic equation is y'^2 = 2 (S(end) - S(y)) / (e r0), with the integral S of the
        difference. Half a wave length is the integral of dy / y', and cones of the conicity g have the wave length 2 pi
        sqrt(e r0 / (2 g)).
        """
        phase = ((np.arange(_PHASE_COUNT) + 0.5) / _PHASE_COUNT - 0.5) * np.pi
        amplitude = 0.5 * (high - low)
        integral_to_end = 0.5 * float(np.sum(self.integral([low, high]))) - self.integral(
            0.5 * (low + high) + amplitude * np.sin(phase)
        )
        if integral_to_end.min() < -_EQUAL_RADII_MM * amplitude:
            return None
        with np.errstate(divide="ignore"):
            integral = np.mean(amplitude * np.cos(phase) / np.sqrt(np.maximum(integral_to_end, 0.0)))
        return float(1.0 / integral**2)

    def conicity(self, amplitude_mm: float) -> float:
        """Equivalent conicity (-) at an amplitude in mm by EN 15302.

        NaN if there is no motion of this amplitude.

        Parameters
        ----------
        amplitude_mm
            Amplitude of the wheelset's motion in mm.

        Returns
        -------
        float
            Equivalent conicity (-).
        """
        motion = self.motion(amplitude_mm)
        return math.nan if motion is None else motion.conicity

    def harmonic_conicity(self, amplitude_mm: float) -> float:
        """Conicity of cones with an equal first harmonic of the difference: harmonic (quasi-) linearisation.

        The motion is y = y0 + A cos(phase), about the middle y0 of the kinematic motion of this amplitude, or about the
        shift of equal radii if there is no such motion.

        Parameters
        ----------
        amplitude_mm
            Amplitude A of the motion in mm.

        Returns
        -------
        conicity
            Slope (-). It is negative if the wheelset is steered away from y0. NaN if the radii are nowhere equal, or
            the motion leaves the range of the shifts.
        """
        motion = self.motion(amplitude_mm)
        middle = self.equal_radii_mm if motion is None else 0.5 * (motion.low_mm + motion.high_mm)
        cosine = np.cos((np.arange(_PHASE_COUNT) + 0.5) * 2.0 * np.pi / _PHASE_COUNT)
        shift = middle + amplitude_mm * cosine
        inside = (shift >= self.shifts_mm[0] - _EQUAL_RADII_MM) & (shift <= self.shifts_mm[-1] + _EQUAL_RADII_MM)
        return float(np.mean(self.at(shift) * cosine) / amplitude_mm) if inside.all() else math.nan
