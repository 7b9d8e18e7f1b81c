"""An irregularity of a wheel or a rail along the track: a wave, a flat, or a measured line of missing material.

All of them are an opening e(s) in mm at the distance s in mm along the running surface, positive where material is
missing: it opens the gap, on the wheel as on the rail.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from fecontact.errors import EXTREME, LARGEST, SMALLEST, InputError

Floats = NDArray[np.float64]
Kind = Literal["sine", "chord", "imprinted", "haversine", "table"]
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
    "imprinted": ("length_mm",),
    "haversine": ("length_mm", "depth_mm"),
    "table": ("points_mm",),
}
_MAY: Mapping[str, tuple[str, ...]] = {"sine": ("phase_rad",), "chord": ("depth_mm",), "imprinted": ("depth_mm",)}
_LENGTHS = ("wavelength_mm", "amplitude_mm", "length_mm", "depth_mm")


@dataclass(frozen=True, kw_only=True)
class Irregularity:
    """An opening e(s) along the track.

    Attributes
    ----------
    kind
        `sine`: amplitude cos(2 pi s / wavelength + phase). `chord`: a fresh flat of a length, straight from edge to
        edge. `imprinted`: a flat of that length ground by the rail, which conforms across. `haversine`: a worn flat,
        depth (1 + cos(2 pi s / length)) / 2. `table`: measured.
    wavelength_mm, amplitude_mm, phase_rad
        Of a sine; the amplitude is half of peak to valley.
    length_mm, depth_mm
        Of a flat; the depth of a chord or an imprinted flat is length^2 / (8 R) where none is given, see `on_wheel`.
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
        for name in (*_LENGTHS, "phase_rad", "points_mm"):
            given = getattr(self, name) not in (None, 0.0, ()) if name in ("phase_rad", "points_mm") else None
            given = getattr(self, name) is not None if given is None else given
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
            object.__setattr__(self, "points_mm", tuple((float(s), float(e)) for s, e in self.points_mm))
            _check_points(np.array(self.points_mm))
        if self.largest_slope > STEEPEST:
            raise InputError(
                f"irregularity {self.kind}: its largest slope is {self.largest_slope:.3g}; allowed: up to {STEEPEST:g},"
                " beyond which it is a shape of the body and no line to be added to a gap; smooth it, or give the"
                " wheel or rail that has it"
            )

    def on_wheel(self, radius_mm: float) -> Irregularity:
        """With the depth that a flat of its length has on a wheel of this radius, where none is given."""
        if self.kind not in ("chord", "imprinted") or self.depth_mm is not None:
            return self
        assert self.length_mm is not None
        return replace(self, depth_mm=self.length_mm**2 / (8.0 * radius_mm))

    def opening_mm(self, s_mm: ArrayLike, undisturbed_mm: ArrayLike | None = None) -> Floats:
        """The opening e at distances s, of any shape; a table goes on as it ends.

        Parameters
        ----------
        undisturbed_mm
            Gap of both bodies without it at a contact in its middle, of the same shape: an imprinted flat is the
            rail's own shape; without it that is the line in the middle of it.
        """
        s = np.asarray(s_mm, dtype=np.float64)
        if self.kind == "imprinted" and undisturbed_mm is not None:
            return np.maximum(0.0, (self.depth_mm or 0.0) - np.asarray(undisturbed_mm))
        return _OPENINGS[self.kind](self, s)

    @property
    def largest_slope(self) -> float:
        """Largest |de/ds|; 0 of a flat whose depth is not known yet."""
        if self.kind == "table":
            s, e = np.array(self.points_mm).T
            return float(np.abs(np.diff(e) / np.diff(s)).max())
        if self.kind == "sine":
            return 2.0 * math.pi * (self.amplitude_mm or 0.0) / (self.wavelength_mm or math.inf)
        factor = math.pi if self.kind == "haversine" else 4.0
        return factor * (self.depth_mm or 0.0) / (self.length_mm or math.inf)

    @property
    def height_mm(self) -> float:
        """Largest opening less the smallest."""
        if self.kind == "table":
            openings = np.array(self.points_mm)[:, 1]
            return float(np.ptp(openings))
        return 2.0 * (self.amplitude_mm or 0.0) if self.kind == "sine" else self.depth_mm or 0.0

    @property
    def finest_mm(self) -> float:
        """The shortest length along it that nodes have to follow: a wave, a flat, four points of a table."""
        if self.kind == "table":
            return 4.0 * float(np.median(np.diff(np.array(self.points_mm)[:, 0])))
        return self.wavelength_mm or self.length_mm or math.inf

    @property
    def kinks_mm(self) -> tuple[float, ...]:
        """Where its slope jumps: a pressure there has no bound."""
        if self.kind in ("chord", "imprinted"):
            half = 0.5 * (self.length_mm or 0.0)
            return (-half, half)
        if self.kind != "table":
            return ()
        s, e = np.array(self.points_mm).T
        jumps = np.abs(np.diff(np.diff(e) / np.diff(s)))
        return tuple(float(one) for one in s[1:-1][jumps > _KINK])

    def even_about(self, s_mm: float) -> bool:
        """Whether it is its own mirror image at a distance; of a table it is not looked for."""
        if self.kind == "table":
            return False
        if self.kind == "sine":
            turns = (s_mm / (self.wavelength_mm or math.inf) + self.phase_rad / (2.0 * math.pi)) * 2.0
            return abs(turns - round(turns)) < 1e-9
        return s_mm == 0.0 or abs(s_mm) > 10.0 * (self.length_mm or 0.0)

    @cached_property
    def _spline(self) -> CubicSpline:
        s, e = np.array(self.points_mm).T
        return CubicSpline(s, e, bc_type="natural")


def _sine(one: Irregularity, s: Floats) -> Floats:
    wavelength = one.wavelength_mm or math.inf
    return np.asarray((one.amplitude_mm or 0.0) * np.cos(2.0 * np.pi * s / wavelength + one.phase_rad))


def _chord(one: Irregularity, s: Floats) -> Floats:
    return np.maximum(0.0, (one.depth_mm or 0.0) * (1.0 - (2.0 * s / (one.length_mm or math.inf)) ** 2))


def _haversine(one: Irregularity, s: Floats) -> Floats:
    length = one.length_mm or math.inf
    inside = np.abs(s) < 0.5 * length
    return np.where(inside, 0.5 * (one.depth_mm or 0.0) * (1.0 + np.cos(2.0 * np.pi * s / length)), 0.0)


def _table(one: Irregularity, s: Floats) -> Floats:
    first, last = one.points_mm[0][0], one.points_mm[-1][0]
    return np.asarray(one._spline(np.clip(s, first, last)))


_OPENINGS: Mapping[str, Callable[[Irregularity, Floats], Floats]] = {
    "sine": _sine,
    "chord": _chord,
    "imprinted": _chord,
    "haversine": _haversine,
    "table": _table,
}


def _check_points(points: Floats) -> None:
    """Refuse a table with too few points, points out of order, gaps and steps."""
    if points.shape[0] < _FEWEST_POINTS or not np.isfinite(points).all():
        raise InputError(
            f"irregularity table: {points.shape[0]} points; allowed: {_FEWEST_POINTS} and more, all of them finite"
        )
    s, e = points.T
    steps = np.diff(s)
    if not np.all(steps > 0.0):
        place = s[1:][steps <= 0.0][0]
        raise InputError(
            f"irregularity table: distances do not grow at {place:g} mm; sort it, and leave each out twice"
        )
    middle = float(np.median(steps))
    if steps.max() > _WIDEST * middle:
        at = int(np.argmax(steps))
        raise InputError(
            f"irregularity table: a gap of {steps[at]:g} mm from {s[at]:g} to {s[at + 1]:g} mm, where points are"
            f" {middle:g} mm apart; allowed: {_WIDEST:g} times that; measure it, fill it in, or cut the table there"
        )
    slopes = np.abs(np.diff(e) / steps)
    if slopes.max() > STEEPEST:
        at = int(np.argmax(slopes))
        raise InputError(
            f"irregularity table: a step of {e[at + 1] - e[at]:+.4g} mm from {s[at]:g} to {s[at + 1]:g} mm, a slope of"
            f" {slopes[at]:.3g}; allowed: up to {STEEPEST:g}; check the units of both columns, smooth it over some mm,"
            " or give the wheel or rail that has it"
        )
