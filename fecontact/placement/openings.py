"""Contact points of a round wheel on an irregularity.

They are all minima of A x^2 + e(x), with their curvatures.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from fecontact.arrays import Floats

GapOpening: TypeAlias = Callable[[Floats], Floats]
"""Function of distances x (n,) in mm from the middle of the wheel, which returns the opening e (n,) in mm."""

# Number of places, over the whole reach, for the search of contact points.
_SEARCH_PLACES = 2001


@dataclass(frozen=True, kw_only=True)
class GapMinimum:
    """A place at which the rigid bodies touch.

    Attributes
    ----------
    x_mm
        Distance from the middle of the wheel in mm.
    gap_mm
        Height of the minimum of the gap in mm.
    A_per_mm
        Coefficient A' = A + e''/2 of the gap about this place, in 1/mm.
    """

    x_mm: float
    gap_mm: float
    A_per_mm: float


def find_gap_minima(A_per_mm: float, opening: GapOpening, reach_mm: float) -> tuple[GapMinimum, ...]:
    """Minima of the gap within a reach, the lowest first.

    The rigid wheel touches at the first of them.

    Parameters
    ----------
    A_per_mm
        Half of the relative curvature along the track, in 1/mm.
    opening
        Opening e of the irregularity.
    reach_mm
        Largest distance from the middle of the wheel in mm.

    Returns
    -------
    touches
        Minima by increasing gap.

    Examples
    --------
    >>> from fecontact.placement.openings import find_gap_minima
    >>> (minimum,) = find_gap_minima(0.001, lambda x: 0.0005 * (x - 3.0) ** 2, 10.0)
    >>> round(minimum.x_mm, 6), round(minimum.A_per_mm, 6)
    (1.0, 0.0015)
    """
    x = np.linspace(-reach_mm, reach_mm, _SEARCH_PLACES)
    gap = A_per_mm * x**2 + opening(x)
    inner = np.flatnonzero((gap[1:-1] <= gap[:-2]) & (gap[1:-1] < gap[2:])) + 1
    minima = [_parabola_minimum(x[i - 1 : i + 2], gap[i - 1 : i + 2]) for i in inner]
    return tuple(sorted(minima, key=lambda touch: touch.gap_mm))


def is_on_edge(minima: tuple[GapMinimum, ...], kinks_mm: tuple[float, ...], reach_mm: float) -> bool:
    """Whether the rigid wheel touches an edge, where there is no curvature.

    Parameters
    ----------
    minima
        Contact points of the wheel.
    kinks_mm
        Places of the edges in mm from the middle of the wheel.
    reach_mm
        Reach of the search for the contact points in mm.

    Returns
    -------
    bool
        True if a contact point lies within three search steps of an edge.
    """
    max_distance = 3.0 * reach_mm / _SEARCH_PLACES
    return any(abs(touch.x_mm - kink) < max_distance for touch in minima for kink in kinks_mm)


def _parabola_minimum(x: Floats, gap: Floats) -> GapMinimum:
    """Lowest point of the parabola through three places."""
    step = float(x[1] - x[0])
    slope, bend = float(gap[2] - gap[0]) / (2.0 * step), float(gap[0] - 2.0 * gap[1] + gap[2]) / step**2
    return GapMinimum(
        x_mm=float(x[1]) - slope / bend, gap_mm=float(gap[1]) - 0.5 * slope**2 / bend, A_per_mm=0.5 * bend
    )
