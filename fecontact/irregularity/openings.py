"""Openings e (...) in mm as functions of distances (...) in mm, which can be pickled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Floats = NDArray[np.float64]
Opening: TypeAlias = Callable[[ArrayLike], Floats]


def opening_of_sine(wavelength_mm: float, amplitude_mm: float, phase_rad: float) -> Opening:
    """The opening of a wave."""
    return partial(_sine, wavelength=wavelength_mm, amplitude=amplitude_mm, phase=phase_rad)


def opening_of_flat(length_mm: float, depth_mm: float, *, worn: bool) -> Opening:
    """The opening of a flat, as a chord or worn to a haversine."""
    return partial(_haversine if worn else _chord, length=length_mm, depth=depth_mm)


def opening_of_points(points_mm: Sequence[tuple[float, float]]) -> Opening:
    """The opening of a table of distances and openings: a cubic spline, and beyond its ends as it ends."""
    from scipy.interpolate import CubicSpline

    s, e = np.array(points_mm).T
    return partial(_table, spline=CubicSpline(s, e, bc_type="natural"))


def _sine(s_mm: ArrayLike, *, wavelength: float, amplitude: float, phase: float) -> Floats:
    return np.asarray(amplitude * np.cos(2.0 * np.pi * np.asarray(s_mm) / wavelength + phase))


def _chord(s_mm: ArrayLike, *, length: float, depth: float) -> Floats:
    return np.maximum(0.0, depth * (1.0 - (2.0 * np.asarray(s_mm) / length) ** 2))


def _haversine(s_mm: ArrayLike, *, length: float, depth: float) -> Floats:
    inside = np.abs(s_mm) < 0.5 * length
    return np.where(inside, 0.5 * depth * (1.0 + np.cos(2.0 * np.pi * np.asarray(s_mm) / length)), 0.0)


def _table(s_mm: ArrayLike, *, spline: CubicSpline) -> Floats:
    return np.asarray(spline(np.clip(s_mm, spline.x[0], spline.x[-1])))
