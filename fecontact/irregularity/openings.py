"""How far an irregularity opens the gap along the track, and where a wheel touches over it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from fecontact.arrays import Floats

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


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


# --- Where a round wheel touches an irregularity: every minimum of A x^2 + e(x), with the curvature there.

GapOpening: TypeAlias = Callable[[Floats], Floats]
"""e (n,) in mm at distances x (n,) in mm from the middle of the wheel."""

# Places at which the rigid bodies are looked for touching, over the whole reach.
_PLACES = 2001


@dataclass(frozen=True, kw_only=True)
class Touch:
    """A place x (mm) where the rigid bodies touch, its gap, and the coefficient A' = A + e''/2 there."""

    x_mm: float
    gap_mm: float
    A_per_mm: float


def touches(A_per_mm: float, opening: GapOpening, reach_mm: float) -> tuple[Touch, ...]:
    """Where the rigid wheel touches within a reach, and every further minimum of the gap, from the lowest up."""
    x = np.linspace(-reach_mm, reach_mm, _PLACES)
    gap = A_per_mm * x**2 + opening(x)
    inner = np.flatnonzero((gap[1:-1] <= gap[:-2]) & (gap[1:-1] < gap[2:])) + 1
    found = [_touch(x[i - 1 : i + 2], gap[i - 1 : i + 2]) for i in inner]
    return tuple(sorted(found, key=lambda touch: touch.gap_mm))


def on_edge(found: tuple[Touch, ...], kinks_mm: tuple[float, ...], reach_mm: float) -> bool:
    """Whether the rigid wheel touches an edge, where there is no curvature."""
    near = 3.0 * reach_mm / _PLACES
    return any(abs(touch.x_mm - kink) < near for touch in found for kink in kinks_mm)


def _touch(x: Floats, gap: Floats) -> Touch:
    """The lowest point of the parabola through three places."""
    step = float(x[1] - x[0])
    slope, bend = float(gap[2] - gap[0]) / (2.0 * step), float(gap[0] - 2.0 * gap[1] + gap[2]) / step**2
    return Touch(x_mm=float(x[1]) - slope / bend, gap_mm=float(gap[1]) - 0.5 * slope**2 / bend, A_per_mm=0.5 * bend)
