"""The gap between wheel and rail on the line across through the first touch point: what the fast theories know."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.errors import InputError, check_positive
from fecontact.geometry.placement import Placement
from fecontact.theory.ellipse_shape import EllipseShape, ellipse_shape

Floats = NDArray[np.float64]

# Chord over which the line's curvature is taken: long against rounding, short against any patch.
_CHORD_MM = 0.1
# Gaps wider than this are never closed by running wheels.
_WIDEST_GAP_MM = 1.0
# Of the positions; it follows every profile. And how far they go to each side.
_STEP_MM, _HALF_WIDTH_MM = 0.02, 40.0
_EVEN = 1e-6
LEAST_B_PER_MM = 1e-4
"""Curvature across (1/mm) that stands for a flat or concave gap where a theory needs a convex one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class GapLine:
    """Gap f(t) + A x^2 of two bodies before they are pressed together, x along the rail, t across.

    Attributes
    ----------
    t_mm (n,)
        Positions across in the tangent plane, increasing in equal steps.
    f_mm (n,)
        Gap at x = 0 along the contact normal; made to have the minimum 0.
    A_per_mm
        Half the relative curvature along x: cos(contact angle) / (2 rolling radius), > 0.
    contact_modulus_MPa
        E* of the pair.
    B_per_mm (n,)
        Half the curvature of f. If it is not given (size 0): from central differences over 0.1 mm to each side, which
        on measured points is noise.
    surface_mm (n,)
        Where the positions are along the rail's surface, arc length from first touch; as `t_mm` if not given.
    turned_rad (n,)
        Angle between the surface there and the tangent plane at first touch; 0 if not given. Only the strip method
        looks at both; all else is in the plane.

    Raises
    ------
    InputError
        If an array does not fit, is not finite or not even, or a constant is not positive.
    """

    t_mm: Floats
    f_mm: Floats
    A_per_mm: float
    contact_modulus_MPa: float
    B_per_mm: Floats = field(default_factory=lambda: np.empty(0))
    surface_mm: Floats = field(default_factory=lambda: np.empty(0))
    turned_rad: Floats = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        t, f, b, s, turned = (
            np.asarray(values, dtype=np.float64)
            for values in (self.t_mm, self.f_mm, self.B_per_mm, self.surface_mm, self.turned_rad)
        )
        check_positive("gap coefficient A", self.A_per_mm, "1/mm", "give cos(contact angle) / (2 rolling radius)")
        check_positive("contact modulus", self.contact_modulus_MPa, "MPa", "take it from contact_modulus_MPa")
        if t.ndim != 1 or t.size < 5 or f.shape != t.shape or {b.shape, s.shape, turned.shape} - {t.shape, (0,)}:
            raise InputError(
                f"gap line has positions {t.shape}, gaps {f.shape} and curvatures {b.shape}; allowed: one line of 5 or"
                " more of each; give as many gaps as positions"
            )
        for name, values in (("position", t), ("gap", f), ("curvature", b), ("place", s), ("angle", turned)):
            if not np.all(np.isfinite(values)):
                raise InputError(f"a {name} of the gap line is not finite; allowed: finite; cut the line where it ends")
        steps = np.diff(t)
        if steps[0] <= 0.0 or np.ptp(steps) > _EVEN * steps[0]:
            raise InputError(
                f"steps of the gap line are {steps.min():g} to {steps.max():g} mm; allowed: > 0 and equal; interpolate"
                " the gap on equal steps"
            )
        f = f - f.min()
        object.__setattr__(self, "t_mm", t)
        object.__setattr__(self, "f_mm", f)
        object.__setattr__(self, "surface_mm", s if s.size else t)
        object.__setattr__(self, "turned_rad", turned if turned.size else np.zeros_like(t))
        object.__setattr__(self, "B_per_mm", b if b.size else _curvature(f, float(steps[0])))

    @property
    def step_mm(self) -> float:
        """Distance between neighbouring positions."""
        return float((self.t_mm[-1] - self.t_mm[0]) / (self.t_mm.size - 1))

    @property
    def touch(self) -> int:
        """Index of the touch point, where the gap is smallest."""
        return int(np.argmin(self.f_mm))

    @cached_property
    def own_ellipses(self) -> EllipseShape:
        """Shape (n,) of Hertz's ellipse for the curvature of each place, flat and concave ones as `LEAST_B_PER_MM`."""
        return ellipse_shape(self.A_per_mm, np.maximum(self.B_per_mm, LEAST_B_PER_MM))

    def concave_notes(self, inside: NDArray[np.bool_]) -> list[str]:
        """Why a theory of local ellipses is out of its range: places in contact (n,) where the gap opens nowhere."""
        flat = inside & (self.B_per_mm < LEAST_B_PER_MM)
        if not flat.any():
            return []
        share = 100.0 * np.count_nonzero(flat) / np.count_nonzero(inside)
        return [f"{share:.0f} % of the patch is flat or concave across; {LEAST_B_PER_MM:g} 1/mm stands for it"]


def _curvature(f: Floats, step: float) -> Floats:
    """Half the second derivative of a line (n,), that of the nearest place with a whole chord at its ends."""
    reach = min(max(1, round(_CHORD_MM / step)), (f.size - 1) // 2)
    inner = (f[2 * reach :] - 2.0 * f[reach:-reach] + f[: -2 * reach]) / (2.0 * (reach * step) ** 2)
    return np.pad(inner, reach, mode="edge")


def gap_line(placement: Placement, *, contact_modulus_MPa: float, slide_mm: float = 0.0) -> GapLine:
    """Gap line of a placed wheel through its first touch point, as far as the surfaces face each other within 1 mm.

    Parameters
    ----------
    slide_mm
        How far the wheel goes along the tangent plane, to the field side positive, before the gap is taken. A load
        that is not along the contact normal lets it slide: approach times tan(contact angle) under a vertical one,
        which counts on a flange root (angles above 0.3 rad).

    Notes
    -----
    Range of validity: one plane for the whole patch; the wheel stands without yaw, or with so little that the gap is
    even in x.
    """
    count = round(_HALF_WIDTH_MM / _STEP_MM)
    t = np.asarray(_STEP_MM * np.arange(-count, count + 1), dtype=np.float64)
    touch, wheel = placement.first, placement.wheel
    slid = replace(placement, wheel=replace(wheel, centre_mm=wheel.centre_mm + slide_mm * touch.tangent))
    f = slid.tangent_plane_gap(0.0, t)
    near = _around(np.isfinite(f) & (np.nan_to_num(f, nan=np.inf) < _WIDEST_GAP_MM), count)
    surface, turned = _on_surface(placement, t[near])
    return GapLine(
        t_mm=t[near],
        f_mm=f[near],
        A_per_mm=0.5 * touch.curvature.xx_per_mm,
        contact_modulus_MPa=contact_modulus_MPa,
        surface_mm=surface,
        turned_rad=turned,
    )


def _on_surface(placement: Placement, t_mm: Floats) -> tuple[Floats, Floats]:
    """Arc length from first touch and angle against the tangent plane of the rail's points at places in that plane."""
    rail, touch = placement.rail, placement.first
    foot = rail.profile.evaluate(touch.rail_u)
    tilt = touch.contact_angle_rad - rail.inclination_rad
    u = rail.profile.locate(t_mm, angle_rad=tilt, origin=(float(foot.y), float(foot.z)))
    surface = rail.profile.arc_length(u) - placement.first_arc_length_mm
    return surface, rail.section(u)[2] - touch.contact_angle_rad


def _around(wanted: NDArray[np.bool_], index: int) -> slice:
    """The unbroken run of wanted places around an index."""
    unwanted = np.flatnonzero(~wanted)
    after = np.searchsorted(unwanted, index)
    low = int(unwanted[after - 1]) + 1 if after > 0 else 0
    high = int(unwanted[after]) if after < unwanted.size else wanted.size
    return slice(low, high)


def regions(inside: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of each unbroken run of true places."""
    places = np.flatnonzero(inside)
    if places.size == 0:
        return []
    runs: Iterable[Floats] = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
    return [(int(run[0]), int(run[-1])) for run in runs]


def crossings_mm(line: GapLine, level_mm: float, first: int, last: int) -> tuple[float, float]:
    """Where the gap rises above a level before and after a run of places below it; else the end of the line."""
    t, f = line.t_mm, line.f_mm

    def between(inner: int, outer: int) -> float:
        if not 0 <= outer < t.size:
            return float(t[inner])
        part = (level_mm - f[inner]) / (f[outer] - f[inner])
        return float(t[inner] + part * (t[outer] - t[inner]))

    return between(first, first - 1), between(last, last + 1)


def end_notes(line: GapLine, first: int, last: int) -> list[str]:
    """Why a theory is out of its range whose region is a run of places."""
    inside = first > 0 and last < line.t_mm.size - 1
    return [] if inside else ["the region of contact reaches the end of the line; give a longer one"]


def gap_at(line: GapLine, t_mm: ArrayLike) -> Floats:
    """Gap (mm) between the line's positions; beyond its ends as at them."""
    return np.asarray(np.interp(np.asarray(t_mm, dtype=np.float64), line.t_mm, line.f_mm))
