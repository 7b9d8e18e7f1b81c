"""Touch points of a round wheel on an irregularity: every minimum of A x^2 + e(x), with its curvature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from fecontact.arrays import Floats

GapOpening: TypeAlias = Callable[[Floats], Floats]
"""e (n,) in mm at distances x (n,) in mm from the middle of the wheel."""

# Number of places, over the whole reach, at which touch points are looked for.
_PLACES = 2001


@dataclass(frozen=True, kw_only=True)
class Touch:
    """A place x (mm) at which the rigid bodies touch, with its gap and its coefficient A' = A + e''/2."""

    x_mm: float
    gap_mm: float
    A_per_mm: float


def touches(A_per_mm: float, opening: GapOpening, reach_mm: float) -> tuple[Touch, ...]:
    """Minima of the gap within a reach, the lowest first, which is where the rigid wheel touches."""
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
    """Lowest point of the parabola through three places."""
    step = float(x[1] - x[0])
    slope, bend = float(gap[2] - gap[0]) / (2.0 * step), float(gap[0] - 2.0 * gap[1] + gap[2]) / step**2
    return Touch(x_mm=float(x[1]) - slope / bend, gap_mm=float(gap[1]) - 0.5 * slope**2 / bend, A_per_mm=0.5 * bend)
