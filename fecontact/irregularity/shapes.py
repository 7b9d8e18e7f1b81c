"""An irregularity of a wheel or a rail along the track: a wave, a flat, or a measured line of missing material.

All of them are an opening e(s) in mm at the distance s in mm along the running surface, positive where material is
missing: it opens the gap, on the wheel as on the rail.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from statistics import median
from typing import TYPE_CHECKING, Literal, get_args

from fecontact.errors import EXTREME, LARGEST, SMALLEST, InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from fecontact.irregularity.openings import Floats, Opening

Kind = Literal["sine", "chord", "haversine", "table"]
STEEPEST = 0.05
"""Largest slope of a line that is added to a gap: beyond it a surface turns by more than normals may."""
# Between two pieces of a measured line; a patch of 14 mm on points 1 mm apart bends by a tenth of it.
_KINK = 0.01
# Distances between points of a table, over the one in their middle.
_WIDEST = 4.0
_FEWEST_POINTS = 5
_NEEDS: Mapping[str, tuple[str, ...]] = {
    "sine": ("wavelength_mm", "amplitude_mm"),
    "chord": ("length_mm",),
    "haversine": ("length_mm", "depth_mm"),
    "table": ("points_mm",),
}
_MAY: Mapping[str, tuple[str, ...]] = {"sine": ("phase_rad",), "chord": ("depth_mm",)}
_LENGTHS = ("wavelength_mm", "amplitude_mm", "length_mm", "depth_mm")


@dataclass(frozen=True, kw_only=True)
class Irregularity:
    """An opening e(s) along the track.

    Attributes
    ----------
    kind
        `sine`: amplitude cos(2 pi s / wavelength + phase). `chord`: a fresh flat of a length, straight from edge to
        edge. `haversine`: a worn flat, depth (1 + cos(2 pi s / length)) / 2. `table`: measured.
    wavelength_mm, amplitude_mm, phase_rad
        Of a sine; the amplitude is half of peak to valley.
    length_mm, depth_mm
        Of a flat; the depth of a chord is length^2 / (8 R) where none is given, see `on_wheel`.
    points_mm
        Distances and openings of a table, in order of distance; between them a cubic spline.

    Notes
    -----
    Sources: the haversine of Newton and Clark (1979); the chord of a circle to first order.
    """

    kind: Kind
    wavelength_mm: float | None = None
    amplitude_mm: float | None = None
    phase_rad: float = 0.0
    length_mm: float | None = None
    depth_mm: float | None = None
    points_mm: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise InputError(f"irregularity is {self.kind!r}; allowed: {', '.join(get_args(Kind))}")
        needed, allowed = _NEEDS[self.kind], (*_NEEDS[self.kind], *_MAY.get(self.kind, ()))
        # of a file of records they come as lists
        object.__setattr__(self, "points_mm", tuple((float(s), float(e)) for s, e in self.points_mm))
        for name in (*_LENGTHS, "phase_rad", "points_mm"):
            given = getattr(self, name) is not None if name in _LENGTHS else bool(getattr(self, name))
            if name in needed and not given:
                raise InputError(f"irregularity {self.kind}: {name} is missing; give {' and '.join(needed)}")
            if given and name not in allowed:
                raise InputError(f"irregularity {self.kind}: {name} is none of its own; it has {', '.join(allowed)}")
        for name in _LENGTHS:
            value = getattr(self, name)
            if value is not None and not SMALLEST <= value <= LARGEST:
                why = EXTREME if value > 0.0 and math.isfinite(value) else "allowed: finite and > 0"
                raise InputError(f"irregularity {self.kind}: {name} is {value!r}; {why}")
        if not math.isfinite(self.phase_rad):
            raise InputError(f"irregularity sine: phase_rad is {self.phase_rad!r}; allowed: finite")
        if self.kind == "table":
            _check_points(self.points_mm)
        if self.largest_slope > STEEPEST:
            raise InputError(
                f"irregularity {self.kind}: its largest slope is {self.largest_slope:.3g}; allowed: up to {STEEPEST:g},"
                " beyond which it is a shape of the body and no line to be added to a gap; smooth it, or give the"
                " wheel or rail that has it"
            )

    def on_wheel(self, radius_mm: float) -> Irregularity:
        """With the depth that a chord of its length has on a wheel of this radius, where none is given."""
        if self.kind != "chord" or self.depth_mm is not None:
            return self
        assert self.length_mm is not None
        return replace(self, depth_mm=self.length_mm**2 / (8.0 * radius_mm))

    def opening_mm(self, s_mm: ArrayLike) -> Floats:
        """The opening e at distances s, of any shape; a table goes on as it ends."""
        return self._opening(s_mm)

    @property
    def largest_slope(self) -> float:
        """Largest |de/ds|; 0 of a flat whose depth is not known yet."""
        if self.kind == "table":
            return max(map(abs, _slopes(self.points_mm)))
        if self.kind == "sine":
            return 2.0 * math.pi * (self.amplitude_mm or 0.0) / (self.wavelength_mm or math.inf)
        factor = math.pi if self.kind == "haversine" else 4.0
        return factor * (self.depth_mm or 0.0) / (self.length_mm or math.inf)

    @property
    def height_mm(self) -> float:
        """Largest opening less the smallest."""
        if self.kind == "table":
            openings = [e for _, e in self.points_mm]
            return max(openings) - min(openings)
        return 2.0 * (self.amplitude_mm or 0.0) if self.kind == "sine" else self.depth_mm or 0.0

    @property
    def finest_mm(self) -> float:
        """The shortest length along it that nodes have to follow: a wave, a flat, four points of a table."""
        if self.kind == "table":
            return 4.0 * median(_steps(self.points_mm))
        return self.wavelength_mm or self.length_mm or math.inf

    @property
    def kinks_mm(self) -> tuple[float, ...]:
        """Where its slope jumps: a pressure there has no bound."""
        if self.kind == "chord":
            half = 0.5 * (self.length_mm or 0.0)
            return (-half, half)
        if self.kind != "table":
            return ()
        inner = [s for s, _ in self.points_mm[1:-1]]
        jumps = [abs(after - before) for before, after in pairwise(_slopes(self.points_mm))]
        return tuple(s for s, jump in zip(inner, jumps, strict=True) if jump > _KINK)

    @cached_property
    def _opening(self) -> Opening:
        from fecontact.irregularity.openings import opening_of_flat, opening_of_points, opening_of_sine

        if self.kind == "table":
            return opening_of_points(self.points_mm)
        if self.kind == "sine":
            return opening_of_sine(self.wavelength_mm or math.inf, self.amplitude_mm or 0.0, self.phase_rad)
        return opening_of_flat(self.length_mm or math.inf, self.depth_mm or 0.0, worn=self.kind == "haversine")


def _steps(points: Sequence[tuple[float, float]]) -> list[float]:
    return [after[0] - before[0] for before, after in pairwise(points)]


def _slopes(points: Sequence[tuple[float, float]]) -> list[float]:
    return [(after[1] - before[1]) / (after[0] - before[0]) for before, after in pairwise(points)]


def _check_points(points: Sequence[tuple[float, float]]) -> None:
    """Refuse a table with too few points, points out of order, gaps and steps."""
    if len(points) < _FEWEST_POINTS or not all(math.isfinite(one) for point in points for one in point):
        raise InputError(
            f"irregularity table: {len(points)} points; allowed: {_FEWEST_POINTS} and more, all of them finite"
        )
    middle = median(_steps(points))
    for (s, e), (next_s, next_e) in pairwise(points):
        if next_s <= s:
            raise InputError(
                f"irregularity table: distances do not grow at {next_s:g} mm; sort it, and leave nothing in twice"
            )
        if next_s - s > _WIDEST * middle:
            raise InputError(
                f"irregularity table: a gap of {next_s - s:g} mm from {s:g} to {next_s:g} mm, where points are"
                f" {middle:g} mm apart; allowed: {_WIDEST:g} times that; measure it, fill it in, or cut the table there"
            )
        if abs(slope := (next_e - e) / (next_s - s)) > STEEPEST:
            raise InputError(
                f"irregularity table: a step of {next_e - e:+.4g} mm from {s:g} to {next_s:g} mm, a slope of"
                f" {abs(slope):.3g}; allowed: up to {STEEPEST:g}; check the units of both columns, smooth it over some"
                " mm, or give the wheel or rail that has it"
            )
