"""The gap on the line across through the first touch point, and the contact in strips that theories find on it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from fecontact.arrays import Floats
from fecontact.contact_theories.hertz import EllipseShape, ellipse_shape
from fecontact.errors import InputError, check_positive
from fecontact.placement.wheel_on_rail import Placement

# Chord for the line's curvature: long enough against rounding, short against any patch.
_CHORD_MM = 0.1
# Gaps wider than this are never closed by running wheels.
_WIDEST_GAP_MM = 1.0
# Step of the positions, fine enough for every profile, and how far they go to each side.
_STEP_MM, _HALF_WIDTH_MM = 0.02, 40.0
# A first look at every so many positions says where the surfaces face each other, and what the gap is between them but
# for 1e-5 mm.
_EVERY = 10
# Largest approach: a wheel that slides as far as it gives closes a gap by less than its slide.
_APPROACH_MM = 1.0
# Places to each side of first touch.
_COUNT = round(_HALF_WIDTH_MM / _STEP_MM)
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
        Gap at x = 0 along the contact normal; its minimum is subtracted.
    A_per_mm
        Half the relative curvature along x: cos(contact angle) / (2 rolling radius), > 0.
    contact_modulus_MPa
        E* of the pair.
    B_per_mm (n,)
        Half the curvature of f. If not given (size 0), it comes from central differences over 0.1 mm to each side,
        which are noise on measured points.
    surface_mm (n,)
        Arc length along the rail's surface from first touch; `t_mm` if not given.
    turned_rad (n,)
        Angle between the surface and the tangent plane at first touch; 0 if not given. Only the strip method uses
        `surface_mm` and `turned_rad`; all other theories work in the plane.

    Raises
    ------
    InputError
        If an array does not fit or is not finite, steps are not equal, or a constant is not positive.
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
        """Index of the touch point: the smallest gap."""
        return int(np.argmin(self.f_mm))

    @cached_property
    def own_ellipses(self) -> EllipseShape:
        """Shape (n,) of Hertz's ellipse for the curvature at each place; flat and concave: `LEAST_B_PER_MM`."""
        return ellipse_shape(self.A_per_mm, np.maximum(self.B_per_mm, LEAST_B_PER_MM))

    def concave_notes(self, inside: NDArray[np.bool_]) -> list[str]:
        """Why a theory of local ellipses is out of its range: places in contact (n,) with a flat or concave gap."""
        flat = inside & (self.B_per_mm < LEAST_B_PER_MM)
        if not flat.any():
            return []
        share = 100.0 * np.count_nonzero(flat) / np.count_nonzero(inside)
        return [f"{share:.0f} % of the patch is flat or concave across; {LEAST_B_PER_MM:g} 1/mm stands for it"]


def _curvature(f: Floats, step: float) -> Floats:
    """Half the second derivative of a line (n,); near its ends the value of the nearest place with a whole chord."""
    reach = min(max(1, round(_CHORD_MM / step)), (f.size - 1) // 2)
    inner = (f[2 * reach :] - 2.0 * f[reach:-reach] + f[: -2 * reach]) / (2.0 * (reach * step) ** 2)
    return np.pad(inner, reach, mode="edge")


# cached: loads at one position begin with the same line; a fleet has a few lines in turn
@lru_cache(maxsize=8)
def gap_line(placement: Placement, *, contact_modulus_MPa: float, slide_mm: float = 0.0) -> GapLine:
    """Gap line of a placed wheel through its first touch point, as far as the surfaces face each other within 1 mm.

    Parameters
    ----------
    slide_mm
        Slide of the wheel along the tangent plane before the gap is taken, positive to the field side. A load that is
        not along the contact normal lets the wheel slide: approach times tan(contact angle) under a vertical load,
        which matters on a flange root (angles above 0.3 rad).

    Notes
    -----
    Range of validity: one plane for the whole patch; no yaw, or so little yaw that the gap is even in x.
    """
    touch, wheel = placement.first, placement.wheel
    slid = replace(placement, wheel=replace(wheel, centre_mm=wheel.centre_mm + slide_mm * touch.tangent))
    along = _places(placement)
    f = slid.gap_over_plane(along.points_mm, along.gap_mm)
    near = _around(_facing(f), int(np.argmin(np.abs(along.t_mm))))
    return GapLine(
        t_mm=along.t_mm[near],
        f_mm=f[near],
        A_per_mm=0.5 * touch.curvature.xx_per_mm,
        contact_modulus_MPa=contact_modulus_MPa,
        surface_mm=along.surface_mm[near],
        turned_rad=along.turned_rad[near],
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Places:
    """Places (n,) across in the tangent plane at which a gap line is taken, with the rail there and about the gap."""

    t_mm: Floats
    points_mm: Floats
    surface_mm: Floats
    turned_rad: Floats
    gap_mm: Floats


# cached: the rail stays where it is, whatever the load and the slide of the wheel
@lru_cache(maxsize=16)
def _places(placement: Placement) -> _Places:
    """The places that face each other, or may do so after a slide."""
    rail, touch = placement.rail, placement.first
    coarse_t = np.linspace(-_HALF_WIDTH_MM, _HALF_WIDTH_MM, 2 * _COUNT // _EVERY + 1)
    coarse = placement.gap_over_plane(placement.over_tangent_plane(coarse_t)[1])
    widest = _WIDEST_GAP_MM + _APPROACH_MM * abs(math.tan(touch.contact_angle_rad))
    rough, met = _around(_facing(coarse, widest), _COUNT // _EVERY), np.isfinite(coarse)
    first = max(rough.start - 1, 0) * _EVERY
    last = min(rough.stop * _EVERY, 2 * _COUNT)
    t = np.asarray(_STEP_MM * np.arange(first - _COUNT, last - _COUNT + 1), dtype=np.float64)
    u, points = placement.over_tangent_plane(t)
    return _Places(
        t_mm=t,
        points_mm=points,
        surface_mm=rail.profile.arc_length(u) - placement.first_arc_length_mm,
        turned_rad=rail.section(u)[2] - touch.contact_angle_rad,
        gap_mm=CubicSpline(coarse_t[met], coarse[met])(t),
    )


def _facing(f_mm: Floats, widest_mm: float = _WIDEST_GAP_MM) -> NDArray[np.bool_]:
    return np.nan_to_num(f_mm, nan=np.inf) < widest_mm


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


def crossings_mm(t_mm: Floats, f_mm: Floats, level_mm: float, run: tuple[int, int]) -> tuple[float, float]:
    """Where the gap rises above a level before and after a run of places below it, or the end of the line."""

    def between(inner: int, outer: int) -> float:
        if not 0 <= outer < t_mm.size:
            return float(t_mm[inner])
        part = (level_mm - f_mm[inner]) / (f_mm[outer] - f_mm[inner])
        return float(t_mm[inner] + part * (t_mm[outer] - t_mm[inner]))

    return between(run[0], run[0] - 1), between(run[1], run[1] + 1)


def end_notes(line: GapLine, first: int, last: int) -> list[str]:
    """Why a theory with this run of places as its region is out of its range."""
    inside = first > 0 and last < line.t_mm.size - 1
    return [] if inside else ["the region of contact reaches the end of the line; give a longer one"]


def gap_at(line: GapLine, t_mm: ArrayLike) -> Floats:
    """Gap (mm) at any place, linear between the line's positions and constant beyond its ends."""
    return np.asarray(np.interp(np.asarray(t_mm, dtype=np.float64), line.t_mm, line.f_mm))


# --- A contact by a theory of strips: a half-elliptic pressure over the length of each strip along the rail.

TheoryStatus = Literal["solved", "several solutions", "jump", "out of range", "not converged"]


@dataclass(frozen=True, kw_only=True, eq=False)
class StripContact:
    """A contact in strips along x; p(x, t) = p(0, t) sqrt(1 - x^2 / a(t)^2).

    Attributes
    ----------
    status
        `solved`, or the worst problem in `notes`: several approaches carry the load, the force jumps over the load, the
        theory is out of its range, or its iterations did not converge. Numbers are given in any case.
    solutions
        Number of approaches found that carry the wanted load; 1 if the approach was given.
    approach_mm, normal_force_N
        Approach and force of this contact, also if another load was wanted.
    t_mm, width_mm (n,)
        Middles and widths of the strips, in the tangent plane at first touch. The strip method gives them along the
        rail's surface if the line has `surface_mm`.
    half_length_mm, centre_pressure_MPa (n,)
        a(t) and p(0, t), both 0 outside the patch.
    """

    status: TheoryStatus
    notes: tuple[str, ...]
    solutions: int
    approach_mm: float
    normal_force_N: float
    t_mm: Floats
    width_mm: Floats
    half_length_mm: Floats
    centre_pressure_MPa: Floats

    @property
    def p_max_MPa(self) -> float:
        """Largest pressure of a strip."""
        return float(self.centre_pressure_MPa.max())

    @property
    def area_mm2(self) -> float:
        """Area of the patch."""
        return float(2.0 * (self.width_mm @ self.half_length_mm))

    @property
    def centre_t_mm(self) -> float:
        """Centre of pressure across; NaN without a force."""
        return self._mean(self.t_mm)

    @property
    def a_mm(self) -> float:
        """Half-width along x from the second moment of the pressure, sqrt(5 <x^2>); NaN without a force."""
        # <x^2> of a half-elliptic strip is a quarter of its half length squared
        return math.sqrt(5.0 * self._mean(0.25 * self.half_length_mm**2))

    @property
    def b_mm(self) -> float:
        """Half-width across from the second moment of the pressure about its centre, sqrt(5 <t^2>)."""
        # with the second moment of each strip's width
        return math.sqrt(5.0 * (self._mean((self.t_mm - self.centre_t_mm) ** 2 + self.width_mm**2 / 12.0)))

    def pressure_MPa(self, x_mm: ArrayLike, t_mm: ArrayLike) -> Floats:
        """Pressure at any points; shapes broadcast. Squares of lengths and pressures are linear between the strips."""
        x, t = np.asarray(x_mm, dtype=np.float64), np.asarray(t_mm, dtype=np.float64)
        a_square = np.interp(t, self.t_mm, self.half_length_mm**2, left=0.0, right=0.0)
        p_square = np.interp(t, self.t_mm, self.centre_pressure_MPa**2, left=0.0, right=0.0)
        # terms in t alone come first: for a line of x and a line of t this costs four operations a point
        in_a, p_square = 1.0 / np.where(a_square > 0.0, a_square, 1.0), np.where(a_square > 0.0, p_square, 0.0)
        pressure = np.asarray(1.0 - x**2 * in_a)
        np.maximum(pressure, 0.0, out=pressure)
        pressure *= p_square
        return np.sqrt(pressure, out=pressure)

    def _mean(self, values: Floats) -> float:
        weights = self.width_mm * self.centre_pressure_MPa * self.half_length_mm
        total = float(weights.sum())
        return float(weights @ values) / total if total > 0.0 else math.nan


def strip_contact(
    line: GapLine, approach_mm: float, half_length_mm: Floats, centre_pressure_MPa: Floats, out: list[str]
) -> StripContact:
    """Contact with a strip at each place of a line; `out` are the reasons why the theory is out of its range."""
    notes = list(out)
    if half_length_mm[0] > 0.0 or half_length_mm[-1] > 0.0:
        notes.append("the patch reaches the end of the line; give a longer one")
    return StripContact(
        status="out of range" if notes else "solved",
        notes=tuple(notes),
        solutions=1,
        approach_mm=approach_mm,
        normal_force_N=float(0.5 * np.pi * line.step_mm * (half_length_mm @ centre_pressure_MPa)),
        t_mm=line.t_mm,
        width_mm=np.full_like(line.t_mm, line.step_mm),
        half_length_mm=half_length_mm,
        centre_pressure_MPa=centre_pressure_MPa,
    )


# --- All approaches at which a theory carries a load: its force need neither grow steadily nor be continuous.

AtApproach = Callable[[GapLine, float], StripContact]
"""A theory: the contact on a gap line at an approach (mm)."""

# Approaches from LOWEST to HIGHEST times Hertz's at the touch point, in steps of a factor.
_LOWEST, _HIGHEST, _FACTOR = 0.25, 2.0, 1.02
_STEPS = 60
# Relative error of the force; if it cannot be reached, the force jumps over the load.
_LEAST_OFF = 1e-9
_JUMP = 2e-3


def under_load(line: GapLine, normal_force_N: float, theory: AtApproach, *, factor: float = _FACTOR) -> StripContact:
    """Contact at the smallest approach that carries a load, with the number of such approaches.

    Approaches from a quarter of Hertz's to twice Hertz's are tried in steps of a factor, 2 % if not given, so that two
    solutions between neighbouring steps are missed. If none carries the load, smaller and larger approaches are tried.

    Raises
    ------
    InputError
        If the load is not positive.
    """
    check_positive("normal force", normal_force_N, "N", "give the compressive force")
    guess, at_approach = approach_of_hertz_mm(line, normal_force_N), partial(theory, line)
    ladder = guess * _LOWEST * factor ** np.arange(np.ceil(np.log(_HIGHEST / _LOWEST) / np.log(factor)) + 1)
    steps = [float(approach) for approach in ladder]
    above = [at_approach(approach).normal_force_N >= normal_force_N for approach in steps]
    while above[0] and len(steps) < 1000:
        steps.insert(0, steps[0] / factor)
        above.insert(0, at_approach(steps[0]).normal_force_N >= normal_force_N)
    while not above[-1] and len(steps) < 1000:
        steps.append(steps[-1] * factor)
        above.append(at_approach(steps[-1]).normal_force_N >= normal_force_N)
    changes = [number for number in range(len(steps) - 1) if above[number] != above[number + 1]]
    if not changes:
        return replace(
            at_approach(steps[-1]),
            status="not converged",
            solutions=0,
            notes=(f"no approach up to {steps[-1]:.3g} mm carries {normal_force_N:g} N",),
        )
    first = changes[0]
    contact = _met(at_approach, normal_force_N, steps[first], steps[first + 1])
    return _told(contact, normal_force_N, len(changes))


def approach_of_hertz_mm(line: GapLine, normal_force_N: float) -> float:
    """Approach of Hertz's ellipse for the curvature at the touch point; flat and concave: `LEAST_B_PER_MM`."""
    B = max(float(line.B_per_mm[line.touch]), LEAST_B_PER_MM)
    part_t, integral = (float(v[line.touch]) for v in (line.own_ellipses.part_t, line.own_ellipses.integral))
    # N = (2 pi / 3) a b p0 with a, b and p0 of the approach
    per_approach = (part_t / B) ** 0.5 * 2.0 * np.pi * line.contact_modulus_MPa / (3.0 * integral)
    return float((normal_force_N / per_approach) ** (2.0 / 3.0))


def _met(at_approach: Callable[[float], StripContact], wanted: float, low: float, high: float) -> StripContact:
    """Contact between two approaches at which the force passes the wanted force, upwards or downwards.

    By secants, of which the value at an end that stays is halved (Illinois, Dowell and Jarratt 1971); every fourth step
    halves the range, for a force that jumps.
    """
    off_low, off_high = (at_approach(end).normal_force_N / wanted - 1.0 for end in (low, high))
    for step in range(1, _STEPS + 1):
        place = high - off_high * (high - low) / (off_high - off_low) if step % 4 else 0.5 * (low + high)
        contact = at_approach(place)
        off = contact.normal_force_N / wanted - 1.0
        if abs(off) < _LEAST_OFF:
            break
        if off * off_high < 0.0:
            low, off_low = high, off_high
        else:
            off_low *= 0.5
        high, off_high = place, off
    return contact


def _told(contact: StripContact, wanted: float, solutions: int) -> StripContact:
    notes = list(contact.notes)
    status = contact.status
    if solutions > 1:
        notes.append(f"{solutions} approaches carry {wanted:g} N; this is the smallest")
        status = "several solutions" if status == "solved" else status
    if abs(contact.normal_force_N / wanted - 1.0) > _JUMP:
        notes.append(f"the force jumps over {wanted:g} N at this approach: here it is {contact.normal_force_N:g} N")
        status = "jump" if status == "solved" else status
    return replace(contact, solutions=solutions, notes=tuple(notes), status=status)
