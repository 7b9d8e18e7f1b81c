"""Gap on the line across through the first contact point, and contacts in strips.

Theories find the contact in strips along the rail from this gap line.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.arrays import Floats
from fecontact.contact_theories.hertz import EllipseShape, calculate_ellipse_shape
from fecontact.errors import InputError, check_positive
from fecontact.placement.wheel_on_rail import Placement

# Chord for the curvature of the gap line: long relative to rounding errors, short relative to every patch.
_CURVATURE_CHORD_MM = 0.1
# Largest gap that running wheels can close.
_MAX_GAP_MM = 1.0
# Step of the positions, fine enough for every profile, and their largest distance to each side.
_STEP_MM, _HALF_WIDTH_MM = 0.02, 40.0
# Stride of coarse positions. They show where the surfaces face each other. Interpolation of the gap between them has an
# error of 1e-5 mm.
_COARSE_STRIDE = 10
# Largest approach. A wheel that slides as far as this approach requires closes a gap by less than its slide.
_MAX_APPROACH_MM = 1.0
# Number of positions to each side of first touch.
_POSITIONS_PER_SIDE = round(_HALF_WIDTH_MM / _STEP_MM)
_MAX_STEP_DIFFERENCE = 1e-6
MIN_B_PER_MM = 1e-4
"""Smallest curvature across (1/mm), set for a flat or concave gap where a theory needs a convex gap."""


@dataclass(frozen=True, kw_only=True, eq=False)
class GapLine:
    """Gap f(t) + A x^2 of two undeformed bodies, x along the rail, t across.

    Attributes
    ----------
    t_mm : ndarray of shape (n,)
        Positions across in the tangent plane, increasing in equal steps.
    f_mm : ndarray of shape (n,)
        Gap at x = 0 along the contact normal; its minimum is subtracted.
    A_per_mm
        Half the relative curvature along x: cos(contact angle) / (2 rolling radius), > 0.
    contact_modulus_MPa
        E* of the pair.
    B_per_mm : ndarray of shape (n,)
        Half the curvature of f. By default (size 0), it is calculated from central differences over 0.1 mm to each
        side, which are noisy on measured points.
    surface_mm : ndarray of shape (n,)
        Arc length along the surface of the rail from first touch; `t_mm` by default.
    turned_rad : ndarray of shape (n,)
        Angle between the surface and the tangent plane at first touch; 0 by default. Only the strip method uses
        `surface_mm` and `turned_rad`. All other theories use the plane.

    Raises
    ------
    InputError
        If an array does not fit or is not finite, steps are not equal, or a constant is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.contact_theories.gap_line import GapLine
    >>> t = np.linspace(-5.0, 5.0, 501)
    >>> line = GapLine(t_mm=t, f_mm=0.005 * t**2, A_per_mm=0.001, contact_modulus_MPa=115e3)
    >>> round(line.step_mm, 3), line.touch, round(float(line.B_per_mm[250]), 6)
    (0.02, 250, 0.005)
    """

    t_mm: Floats
    f_mm: Floats
    A_per_mm: float
    contact_modulus_MPa: float
    B_per_mm: Floats = field(default_factory=lambda: np.empty(0))
    surface_mm: Floats = field(default_factory=lambda: np.empty(0))
    turned_rad: Floats = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        """Check the arrays and constants, and calculate the default arrays.

        Raises
        ------
        InputError
            If A or E* is not positive, if there are fewer than 5 positions, if arrays differ in shape, or if a value is
            not finite.
        """
        t, f, b, s, angle = (
            np.asarray(values, dtype=np.float64)
            for values in (self.t_mm, self.f_mm, self.B_per_mm, self.surface_mm, self.turned_rad)
        )
        check_positive("gap coefficient A", self.A_per_mm, "1/mm", "give cos(contact angle) / (2 rolling radius)")
        check_positive("contact modulus", self.contact_modulus_MPa, "MPa", "use contact_modulus_MPa of the case")
        if t.ndim != 1 or t.size < 5 or f.shape != t.shape or {b.shape, s.shape, angle.shape} - {t.shape, (0,)}:
            raise InputError(
                f"gap line has positions {t.shape}, gaps {f.shape} and curvatures {b.shape}; allowed: at least 5"
                " positions in one dimension, each with a gap; give as many gaps as positions"
            )
        for name, values in (("position", t), ("gap", f), ("curvature", b), ("place", s), ("angle", angle)):
            if not np.all(np.isfinite(values)):
                raise InputError(
                    f"a {name} of the gap line is not finite; allowed: finite; end the line where the values end"
                )
        steps = np.diff(t)
        if steps[0] <= 0.0 or np.ptp(steps) > _MAX_STEP_DIFFERENCE * steps[0]:
            raise InputError(
                f"spacing of the gap line is {steps.min():g} to {steps.max():g} mm; allowed: > 0 and equal; interpolate"
                " the gap to equal spacing"
            )
        f = f - f.min()
        object.__setattr__(self, "t_mm", t)
        object.__setattr__(self, "f_mm", f)
        object.__setattr__(self, "surface_mm", s if s.size else t)
        object.__setattr__(self, "turned_rad", angle if angle.size else np.zeros_like(t))
        object.__setattr__(self, "B_per_mm", b if b.size else _curvature(f, float(steps[0])))

    @cached_property
    def step_mm(self) -> float:
        """Distance between neighbouring positions."""
        return float((self.t_mm[-1] - self.t_mm[0]) / (self.t_mm.size - 1))

    @cached_property
    def touch(self) -> int:
        """Index of the contact point, the position of the smallest gap."""
        return int(np.argmin(self.f_mm))

    @cached_property
    def local_ellipses(self) -> EllipseShape:
        """Shape (n,) of Hertz's ellipse for the curvature at each position.

        The curvature is at least `MIN_B_PER_MM`, also at flat and concave positions.
        """
        return calculate_ellipse_shape(self.A_per_mm, np.maximum(self.B_per_mm, MIN_B_PER_MM))

    def concave_notes(self, is_in_contact: NDArray[np.bool_]) -> list[str]:
        """Note on flat or concave positions, for theories of local ellipses.

        A theory of local ellipses is out of its range there.

        Parameters
        ----------
        is_in_contact : ndarray of shape (n,)
            Mask of the positions in contact.

        Returns
        -------
        list of str
            The reason why the theory is out of its range; empty if the gap is convex in the whole contact.
        """
        is_flat = is_in_contact & (self.B_per_mm < MIN_B_PER_MM)
        if not is_flat.any():
            return []
        share = 100.0 * np.count_nonzero(is_flat) / np.count_nonzero(is_in_contact)
        return [
            f"{share:.0f} % of the patch is flat or concave across; its gap coefficient B was set to"
            f" {MIN_B_PER_MM:g} 1/mm there"
        ]


def _curvature(f: Floats, step: float) -> Floats:
    """Half the second derivative of a gap line (n,).

    Near its ends it has the value of the nearest position with a whole chord.
    """
    reach = min(max(1, round(_CURVATURE_CHORD_MM / step)), (f.size - 1) // 2)
    inner_curvature = (f[2 * reach :] - 2.0 * f[reach:-reach] + f[: -2 * reach]) / (2.0 * (reach * step) ** 2)
    return np.pad(inner_curvature, reach, mode="edge")


# Cached: all loads at a position begin with an equal gap line. A fleet has nine profile variants in turn, each with one
# more line for the load before.
@lru_cache(maxsize=32)
def build_gap_line(placement: Placement, *, contact_modulus_MPa: float, slide_mm: float = 0.0) -> GapLine:
    """Gap line of a placed wheel through its first contact point.

    The line ends where the surfaces no longer face each other within 1 mm.

    Parameters
    ----------
    placement
        Placed wheel and rail.
    contact_modulus_MPa
        E* of the pair.
    slide_mm
        Slide of the wheel along the tangent plane before the gap is calculated, positive to the field side. A load that
        is not along the contact normal moves the wheel along the plane: under a vertical load by approach times
        tan(contact angle). This slide matters on a flange root (angles above 0.3 rad).

    Returns
    -------
    GapLine
        Gap, positions along the surface, and angles of the surface.

    Notes
    -----
    Range of validity: a single plane for the whole patch; no yaw, or so little yaw that the gap is even in x.
    """
    positions = _rail_positions(placement)
    f = placement.wheel_over_plane.heights(positions.t_mm - slide_mm) - positions.height_mm
    face_range = _run_around(_is_within_gap(f), int(np.argmin(np.abs(positions.t_mm))))
    return GapLine(
        t_mm=positions.t_mm[face_range],
        f_mm=f[face_range],
        A_per_mm=0.5 * placement.first.curvature.xx_per_mm,
        contact_modulus_MPa=contact_modulus_MPa,
        surface_mm=positions.surface_mm[face_range],
        turned_rad=positions.turned_rad[face_range],
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _RailPositions:
    """Positions (n,) across in the tangent plane, with the rail's surface.

    The surface has a height, an arc length and an angle. The gap line is calculated at these positions.
    """

    t_mm: Floats
    height_mm: Floats
    surface_mm: Floats
    turned_rad: Floats


# Cached: the rail does not depend on the load and the slide of the wheel.
@lru_cache(maxsize=16)
def _rail_positions(placement: Placement) -> _RailPositions:
    """Positions where the surfaces face each other, also after a slide.

    Positions are uniform in the tangent plane, with a step of `_STEP_MM`, around the first contact point. They end
    where the gap exceeds `_MAX_GAP_MM`, with a reserve for the slide, or where a profile ends.
    """
    coarse_t = np.linspace(-_HALF_WIDTH_MM, _HALF_WIDTH_MM, 2 * _POSITIONS_PER_SIDE // _COARSE_STRIDE + 1)
    coarse_gap = placement.wheel_over_plane.heights(coarse_t) - placement.rail_over_plane(coarse_t)[1]
    largest_gap = _MAX_GAP_MM + _MAX_APPROACH_MM * abs(math.tan(placement.first.contact_angle_rad))
    coarse_range = _run_around(_is_within_gap(coarse_gap, largest_gap), _POSITIONS_PER_SIDE // _COARSE_STRIDE)
    first = max(coarse_range.start - 1, 0) * _COARSE_STRIDE
    last = min(coarse_range.stop * _COARSE_STRIDE, 2 * _POSITIONS_PER_SIDE)
    t = np.asarray(_STEP_MM * np.arange(first - _POSITIONS_PER_SIDE, last - _POSITIONS_PER_SIDE + 1), dtype=np.float64)
    profile_parameters, height, angle = placement.rail_over_plane(t)
    return _RailPositions(
        t_mm=t,
        height_mm=height,
        surface_mm=placement.rail.profile.arc_length(profile_parameters) - placement.first_arc_length_mm,
        turned_rad=angle,
    )


def _is_within_gap(f_mm: Floats, max_gap_mm: float = _MAX_GAP_MM) -> NDArray[np.bool_]:
    """Mask (n,) of the gaps smaller than the largest gap."""
    return np.nan_to_num(f_mm, nan=np.inf) < max_gap_mm


def _run_around(is_selected: NDArray[np.bool_], index: int) -> slice:
    """Range of the unbroken run of true values around an index."""
    false_indices = np.flatnonzero(~is_selected)
    next_false = np.searchsorted(false_indices, index)
    low = int(false_indices[next_false - 1]) + 1 if next_false > 0 else 0
    high = int(false_indices[next_false]) if next_false < false_indices.size else is_selected.size
    return slice(low, high)


def find_crossings_mm(t_mm: Floats, f_mm: Floats, level_mm: float, run: tuple[int, int]) -> tuple[float, float]:
    """Positions at which the gap rises above a level, on both sides of a run.

    Parameters
    ----------
    t_mm, f_mm : ndarray of shape (n,)
        Positions and gap.
    level_mm
        Level of the gap.
    run
        First and last index of a run of positions with a gap below the level.

    Returns
    -------
    low_mm, high_mm
        Interpolated positions before and after the run. If the run reaches an end of the line, then the end of the
        line.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.contact_theories.gap_line import find_crossings_mm
    >>> find_crossings_mm(np.arange(4.0), np.array([1.0, 0.0, 0.0, 1.0]), 0.5, (1, 2))
    (0.5, 2.5)
    """
    low, high = interpolate_crossings(t_mm, f_mm, *(np.array([value]) for value in (level_mm, *run)))
    return float(low[0]), float(high[0])


def interpolate_crossings(
    t_mm: Floats, f_mm: Floats, levels_mm: Floats, first: NDArray[np.intp], last: NDArray[np.intp]
) -> tuple[Floats, Floats]:
    """Positions at which the gap rises above levels, as by `find_crossings_mm`.

    Parameters
    ----------
    t_mm, f_mm : ndarray of shape (n,)
        Positions and gap.
    levels_mm : ndarray of shape (k,)
        Levels of the gap.
    first, last : ndarray of shape (k,)
        Indices of the ends of a run of positions with a gap below each level.

    Returns
    -------
    low_mm, high_mm : ndarray of shape (k,)
        Positions before and after each run.
    """
    crossings = []
    for inner, step in ((first, -1), (last, 1)):
        outer = np.minimum(np.maximum(inner + step, 0), t_mm.size - 1)
        # at an end of the line both indices are equal
        rise = np.where(outer == inner, np.inf, f_mm[outer] - f_mm[inner])
        fraction = (levels_mm - f_mm[inner]) / rise
        crossings.append(t_mm[inner] + fraction * (t_mm[outer] - t_mm[inner]))
    return crossings[0], crossings[1]


def end_notes(line: GapLine, first: int, last: int) -> list[str]:
    """Note on a region that reaches the end of the line.

    Parameters
    ----------
    line
        Gap line.
    first, last
        Indices of the region of a theory.

    Returns
    -------
    list of str
        The reason why the theory is out of its range; empty if the region ends inside the line.
    """
    is_inside = first > 0 and last < line.t_mm.size - 1
    return [] if is_inside else ["the contact region reaches the end of the gap line; give longer profiles"]


def interpolate_gap(line: GapLine, t_mm: ArrayLike) -> Floats:
    """Interpolate the gap (mm) linearly between the positions of a line.

    The gap is constant beyond the ends of the line.

    Parameters
    ----------
    line
        Gap over positions across.
    t_mm
        Positions across in mm, in any shape.

    Returns
    -------
    ndarray
        Gap in mm, in the shape of `t_mm`.
    """
    return np.asarray(np.interp(np.asarray(t_mm, dtype=np.float64), line.t_mm, line.f_mm))


# --- Contact by a theory of strips, with a half-elliptic pressure over the length of each strip along the rail.

TheoryStatus = Literal["solved", "several solutions", "jump", "out of range", "not converged"]


@dataclass(frozen=True, kw_only=True, eq=False)
class StripContact:
    """Contact in strips along x; p(x, t) = p(0, t) sqrt(1 - x^2 / a(t)^2).

    Attributes
    ----------
    status
        `solved`, or the worst problem in `notes`: several approaches have the load, the force jumps over the load, the
        theory is out of its range, or its iterations did not converge. The contact is complete for every status.
    notes
        Explanation of the status.
    solutions
        Number of approaches with the prescribed load; 1 at a prescribed approach.
    approach_mm, normal_force_N
        Approach and force of this contact, also if they differ from the prescribed load.
    t_mm, width_mm : ndarray of shape (n,)
        Middles and widths of the strips, in the tangent plane at first touch. In contacts by the strip method, they lie
        along the surface of the rail if the gap line has `surface_mm`.
    half_length_mm, centre_pressure_MPa : ndarray of shape (n,)
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
        return self._force_weighted_mean(self.t_mm)

    @property
    def a_mm(self) -> float:
        """Half-width along x from the second moment of the pressure.

        It is sqrt(5 <x^2>), and NaN without a force.
        """
        # <x^2> of a half-elliptic strip is a quarter of its half length squared.
        return math.sqrt(5.0 * self._force_weighted_mean(0.25 * self.half_length_mm**2))

    @property
    def b_mm(self) -> float:
        """Half-width across from the second moment of the pressure about its centre.

        It is sqrt(5 <t^2>).
        """
        # The second moment of the width of each strip is included.
        return math.sqrt(
            5.0 * (self._force_weighted_mean((self.t_mm - self.centre_t_mm) ** 2 + self.width_mm**2 / 12.0))
        )

    def pressure_MPa(self, x_mm: ArrayLike, t_mm: ArrayLike) -> Floats:
        """Pressure at given points, in MPa.

        The squares of lengths and pressures are linear between the strips.

        Parameters
        ----------
        x_mm, t_mm
            Points along and across in mm; any shapes that broadcast together.

        Returns
        -------
        array
            Pressures, of the broadcast shape.
        """
        x, t = np.asarray(x_mm, dtype=np.float64), np.asarray(t_mm, dtype=np.float64)
        a_square = np.interp(t, self.t_mm, self.half_length_mm**2, left=0.0, right=0.0)
        p_square = np.interp(t, self.t_mm, self.centre_pressure_MPa**2, left=0.0, right=0.0)
        # Terms in t alone come first. For a line of x and a line of t this costs four operations per point.
        inverse_a_square, p_square = (
            1.0 / np.where(a_square > 0.0, a_square, 1.0),
            np.where(a_square > 0.0, p_square, 0.0),
        )
        pressure = np.asarray(1.0 - x**2 * inverse_a_square)
        np.maximum(pressure, 0.0, out=pressure)
        pressure *= p_square
        return np.sqrt(pressure, out=pressure)

    def _force_weighted_mean(self, values: Floats) -> float:
        """Mean of values (n,) of the strips, weighted by their forces."""
        weights = self.width_mm * self.centre_pressure_MPa * self.half_length_mm
        total_weight = float(weights.sum())
        return float(weights @ values) / total_weight if total_weight > 0.0 else math.nan


def build_strip_contact(
    line: GapLine, approach_mm: float, half_length_mm: Floats, centre_pressure_MPa: Floats, range_notes: list[str]
) -> StripContact:
    """Build a contact with a strip at each position of a gap line.

    Parameters
    ----------
    line
        Gap line.
    approach_mm
        Approach of the bodies.
    half_length_mm, centre_pressure_MPa : ndarray of shape (n,)
        Half length and pressure at x = 0 of each strip.
    range_notes
        Reasons why the theory is out of its range.

    Returns
    -------
    StripContact
        The contact; its status is `out of range` if there is a reason.
    """
    notes = list(range_notes)
    if half_length_mm[0] > 0.0 or half_length_mm[-1] > 0.0:
        notes.append("the patch reaches the end of the gap line; give longer profiles")
    return StripContact(
        status="out of range" if notes else "solved",
        notes=tuple(notes),
        solutions=1,
        approach_mm=approach_mm,
        normal_force_N=float(sum_forces_N(line, half_length_mm, centre_pressure_MPa)),
        t_mm=line.t_mm,
        width_mm=np.full_like(line.t_mm, line.step_mm),
        half_length_mm=half_length_mm,
        centre_pressure_MPa=centre_pressure_MPa,
    )


def sum_forces_N(line: GapLine, half_length_mm: Floats, centre_pressure_MPa: Floats) -> Floats:
    """Force of strips at positions of a gap line.

    Parameters
    ----------
    line
        Gap line.
    half_length_mm, centre_pressure_MPa : ndarray of shape (..., m)
        Half length and pressure at x = 0 of each strip.

    Returns
    -------
    ndarray of shape (...)
        Force in N.
    """
    return np.asarray(0.5 * np.pi * line.step_mm * np.vecdot(half_length_mm, centre_pressure_MPa))


def find_close_positions(line: GapLine, gap_mm: float) -> slice:
    """Range of the positions from the first to the last gap below a value.

    Parameters
    ----------
    line
        Gap line.
    gap_mm
        Value of the gap, > 0.

    Returns
    -------
    slice
        Range of positions.
    """
    close_positions = np.flatnonzero(line.f_mm < gap_mm)
    return slice(int(close_positions[0]), int(close_positions[-1]) + 1)


# --- Approaches at which a theory has a given force. The force of a theory may decrease with the approach, and may be
# discontinuous.

GapLineTheory = Callable[[GapLine, float], StripContact]
"""Theory: function from a gap line and an approach (mm) to the contact."""
GapLineForces = Callable[[GapLine, Floats], Floats]
"""Function from a gap line and approaches (k,) in mm to the forces (k,) of a theory in N, without its contacts."""

# Smallest and largest approach, relative to Hertz's approach at the contact point, and the factor between successive
# approaches.
_MIN_RELATIVE_APPROACH, _MAX_RELATIVE_APPROACH, _APPROACH_STEP_FACTOR = 0.25, 2.0, 1.02
_MAX_ROOT_STEPS = 60
_MAX_APPROACHES = 1000
# Relative error of the force. If the force jumps over the load, then this error cannot be reached, and the error
# exceeds the second value.
_FORCE_TOLERANCE = 1e-9
_MIN_JUMP = 2e-3


def solve_under_load(
    line: GapLine,
    normal_force_N: float,
    theory: GapLineTheory,
    *,
    factor: float = _APPROACH_STEP_FACTOR,
    forces: GapLineForces | None = None,
) -> StripContact:
    """Find the smallest approach at which a theory has a given force.

    Approaches from a quarter of Hertz's approach to twice Hertz's approach are tried in steps of a factor, 2 % by
    default. Two solutions between neighbouring steps are therefore missed. If there is no solution, then smaller and
    larger approaches are tried.

    Parameters
    ----------
    line
        Gap line.
    normal_force_N
        Force, > 0.
    theory
        Function from a gap line and an approach to the contact.
    factor
        Factor between successive approaches, > 1.
    forces
        Forces of the theory at many approaches, which take less time than its contacts; None if only the contacts have
        them.

    Returns
    -------
    StripContact
        Contact at the smallest approach with this force, with the number of such approaches. If the force jumps over
        the load, the contact just below the jump.

    Raises
    ------
    InputError
        If the load is not positive.

    Examples
    --------
    ANALYN is exact for a constant curvature:

    >>> import numpy as np
    >>> from fecontact.contact_theories.analyn import solve_analyn
    >>> from fecontact.contact_theories.gap_line import GapLine, solve_under_load
    >>> from fecontact.contact_theories.hertz import hertz_ellipse
    >>> t = np.linspace(-5.0, 5.0, 501)
    >>> line = GapLine(t_mm=t, f_mm=0.005 * t**2, A_per_mm=0.002, contact_modulus_MPa=115e3)
    >>> contact = solve_under_load(line, 1e4, solve_analyn)
    >>> exact = hertz_ellipse(0.002, 0.005, normal_force_N=1e4, contact_modulus_MPa=115e3)
    >>> contact.status, bool(abs(contact.p_max_MPa / exact.p0_MPa - 1.0) < 0.001)
    ('solved', True)
    """
    check_positive("normal force", normal_force_N, "N", "give the compressive force")
    hertz_approach = estimate_hertz_approach_mm(line, normal_force_N)

    def find_errors(approaches: Floats) -> Floats:
        """Relative errors (k,) of the forces at approaches (k,)."""
        if forces is not None:
            return forces(line, approaches) / normal_force_N - 1.0
        return (
            np.array([theory(line, float(approach)).normal_force_N for approach in approaches]) / normal_force_N - 1.0
        )

    approaches = (
        hertz_approach
        * _MIN_RELATIVE_APPROACH
        * factor ** np.arange(np.ceil(np.log(_MAX_RELATIVE_APPROACH / _MIN_RELATIVE_APPROACH) / np.log(factor)) + 1)
    )
    errors = find_errors(approaches)
    while errors[0] >= 0.0 and approaches.size < _MAX_APPROACHES:
        approaches = np.append(approaches[0] / factor, approaches)
        errors = np.append(find_errors(approaches[:1]), errors)
    while errors[-1] < 0.0 and approaches.size < _MAX_APPROACHES:
        approaches = np.append(approaches, approaches[-1] * factor)
        errors = np.append(errors, find_errors(approaches[-1:]))
    is_enough = errors >= 0.0
    brackets = np.flatnonzero(is_enough[1:] != is_enough[:-1])
    if not brackets.size:
        return replace(
            theory(line, float(approaches[-1])),
            status="not converged",
            solutions=0,
            notes=(f"no approach up to {approaches[-1]:.3g} mm carries {normal_force_N:g} N",),
        )
    ends = slice(brackets[0], brackets[0] + 2)
    approach = _find_approach(find_errors, approaches[ends], errors[ends])
    return _note_solutions(theory(line, approach), normal_force_N, brackets.size)


def estimate_hertz_approach_mm(line: GapLine, normal_force_N: float) -> float:
    """Approach of Hertz's ellipse for the curvature at the contact point.

    The curvature is at least `MIN_B_PER_MM`, also at a flat or concave contact point.

    Parameters
    ----------
    line
        Gap line.
    normal_force_N
        Force, > 0.

    Returns
    -------
    float
        Approach in mm.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.contact_theories.gap_line import GapLine, estimate_hertz_approach_mm
    >>> from fecontact.contact_theories.hertz import hertz_ellipse
    >>> t = np.linspace(-5.0, 5.0, 501)
    >>> line = GapLine(t_mm=t, f_mm=0.005 * t**2, A_per_mm=0.002, contact_modulus_MPa=115e3)
    >>> exact = hertz_ellipse(0.002, 0.005, normal_force_N=1e4, contact_modulus_MPa=115e3)
    >>> abs(estimate_hertz_approach_mm(line, 1e4) / exact.approach_mm - 1.0) < 1e-6
    True
    """
    B = max(float(line.B_per_mm[line.touch]), MIN_B_PER_MM)
    shape = calculate_ellipse_shape(line.A_per_mm, B)
    # N = (2 pi / 3) a b p0, with a, b and p0 as functions of the approach.
    force_coefficient = (
        (float(shape.part_t) / B) ** 0.5 * 2.0 * np.pi * line.contact_modulus_MPa / (3.0 * float(shape.integral))
    )
    return float((normal_force_N / force_coefficient) ** (2.0 / 3.0))


def _find_approach(find_errors: Callable[[Floats], Floats], approaches: Floats, errors: Floats) -> float:
    """Find the approach between two approaches at which the force passes a value.

    The force may increase or decrease with the approach. The method uses secants, with half the value at an end that
    stays (Illinois, Dowell and Jarratt 1971). Every fourth step halves the range, for a force that jumps. The last
    approach below a jump is returned.

    Parameters
    ----------
    find_errors
        Relative errors of the forces at approaches in mm.
    approaches, errors
        Approaches in mm on both sides of the solution, and the relative errors of their forces.
    """
    low, high, error_low, error_high = map(float, (*approaches, *errors))
    for step in range(1, _MAX_ROOT_STEPS + 1):
        approach = high - error_high * (high - low) / (error_high - error_low) if step % 4 else 0.5 * (low + high)
        error = float(find_errors(np.array([approach]))[0])
        if abs(error) < _FORCE_TOLERANCE:
            return approach
        if error * error_high < 0.0:
            low, error_low = high, error_high
        else:
            error_low *= 0.5
        high, error_high = approach, error
    return min(low, high)


def _note_solutions(contact: StripContact, target_N: float, solutions: int) -> StripContact:
    """Contact with notes and a status for several solutions and for a jump."""
    notes = list(contact.notes)
    status = contact.status
    if solutions > 1:
        notes.append(f"{solutions} approaches carry {target_N:g} N; the result is for the smallest approach")
        status = "several solutions" if status == "solved" else status
    if abs(contact.normal_force_N / target_N - 1.0) > _MIN_JUMP:
        notes.append(
            f"the force jumps across {target_N:g} N at this approach; the result has {contact.normal_force_N:g} N"
        )
        status = "jump" if status == "solved" else status
    return replace(contact, solutions=solutions, notes=tuple(notes), status=status)
