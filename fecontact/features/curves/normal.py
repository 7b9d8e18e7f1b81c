"""Normal forces where a wheel and its rail overlap, by the theories that have a force at an approach.

A theory takes an `Overlap` and the contact modulus, and gives the patches that carry, each in strips along the rail:
the force of a strip over its width, and its half length. Nothing else is asked of it, so that creep forces, equilibrium
and stability are the same for all. What is here says only how each of them sees an overlap.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import TypeAlias

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid
from fecontact.contact.halfspace import half_space_problem
from fecontact.contact.solver import solve_contact
from fecontact.contact_theories.gap_line import AtApproach, GapLine, crossings_mm, regions
from fecontact.contact_theories.hertz import HertzContact, hertz_ellipse
from fecontact.contact_theories.overlap import overlap_strips
from fecontact.contact_theories.registry import THEORIES
from fecontact.contact_theories.strip_method import Line, Load, Search, Strips, factor_of_ellipse, solve_strips
from fecontact.errors import ConvergenceError, InputError
from fecontact.placement.wheel_on_rail import Pair, Placement
from fecontact.placement.wheelset import Wheelset
from fecontact.profiles.segments import CurvePoints

# --- Where a wheel and its rail overlap: the wheel's silhouette against the rail's line, for thousands of positions.

# Distance of points on the wheel, and of those on the rail between which cubics run.
_WHEEL_STEP_MM, _RAIL_STEP_MM = 0.1, 0.05
# Feet on the rail are looked for in the order along this direction (rad): head and gauge face run forward along it.
_SLANT = 0.25 * np.pi
_FOOT_STEPS = 4
# Wider gaps are never closed by what theories know of their surroundings; and how far off a first guess of them may be.
_WIDEST_GAP_MM, _ROUGHLY_MM = 0.5, 2.0
_FEWEST = 3


def standing(pair: Pair, shift_mm: float) -> Placement:
    """A wheel on its rail, shifted towards it, without roll and yaw.

    Raises
    ------
    InputError
        If it does not stand there, with the reason.
    """
    placed = pair.placed(shift_mm, 0.0, 0.0)
    if isinstance(placed, str):
        raise InputError(f"a wheel cannot stand on its rail: {placed}; check gauge, profiles and back-to-back distance")
    return placed


@dataclass(frozen=True, kw_only=True, eq=False)
class Overlap:
    """A stretch of a wheel's silhouette near its rail, in points from the gauge side to the field side.

    Attributes
    ----------
    s_mm (n,)
        Arc length of their feet on the rail, increasing.
    depth_mm (n,)
        How deep they lie in the rail, along its normal; negative where there is a gap.
    place_mm (n, 3)
        Midway between both surfaces, in the track frame.
    angle_rad (n,)
        Angle of the rail's tangent plane there.
    radius_mm (n,)
        Distance from the axle.
    """

    s_mm: Floats
    depth_mm: Floats
    place_mm: Floats
    angle_rad: Floats
    radius_mm: Floats

    @property
    def curvature_along_per_mm(self) -> Floats:
        """Relative curvature (n,) along the rail: the curvature of the rolling circle in the contact plane."""
        return np.asarray(np.cos(self.angle_rad) / self.radius_mm)

    def at(self, s_mm: Floats) -> Overlap:
        """The same at other arc lengths (m,), between its points along straight lines."""
        place = np.stack([np.interp(s_mm, self.s_mm, column) for column in self.place_mm.T], axis=1)
        depth, angle, radius = (
            np.interp(s_mm, self.s_mm, values) for values in (self.depth_mm, self.angle_rad, self.radius_mm)
        )
        return Overlap(s_mm=s_mm, depth_mm=depth, place_mm=place, angle_rad=angle, radius_mm=radius)


@dataclass(frozen=True, kw_only=True, eq=False)
class Surfaces:
    """A pair in the frame of the left side with tables of both lines."""

    pair: Pair

    @classmethod
    def of(cls, wheelset: Wheelset) -> tuple[Surfaces, Surfaces]:
        """Both sides, the right one as its mirror image."""
        left = cls(pair=wheelset.left.pair)
        return left, left if wheelset.symmetric else cls(pair=wheelset.right.pair)

    @cached_property
    def _wheel(self) -> CurvePoints:
        return self.pair.wheel.evaluate(self.pair.wheel.spread(_WHEEL_STEP_MM)[1:-1])

    @cached_property
    def _rail(self) -> tuple[float, Floats]:
        """Step of the arc length, and along it y, z, cosine and sine of the tangent, and the place on the slant."""
        rail = self.pair.rail
        count = int(np.ceil(rail.profile.length_mm / _RAIL_STEP_MM)) + 1
        s = np.linspace(0.0, rail.profile.length_mm, count)
        y, z, angle = rail.section(rail.profile.at_arc_length(s))
        # a side that falls back steeper than the slant carries no wheel
        forward = np.cos(angle - _SLANT) > 0.05
        first, last = int(np.argmax(forward)), count - int(np.argmax(forward[::-1]))
        slant = y * np.cos(_SLANT) + z * np.sin(_SLANT)
        table = np.stack([s, y, z, np.cos(angle), np.sin(angle), slant])[:, first:last]
        return float(s[1]), table

    def overlap(self, shift_mm: float, height_mm: float, roll_rad: float, yaw_rad: float) -> Overlap | None:
        """Where the wheel is nearest to the rail, or in it; None where no point of it is within 0.5 mm.

        Parameters
        ----------
        shift_mm, height_mm
            Lateral position and height of the wheelset's centre over the track's.
        roll_rad, yaw_rad
            As everywhere; all of the left side.
        """
        pose = self.pair.hung(shift_mm, roll_rad, yaw_rad)
        _, x, y, z = pose.silhouette_of(self._wheel)
        z = z + height_mm
        # thousands of points are not near
        kept = np.flatnonzero(self._rough_depth(y, z) > -_ROUGHLY_MM)
        x, y, z = x[kept], y[kept], z[kept]
        s, depth, angle = self._feet(y, z)
        # feet that run back belong to a flank that faces away
        near = np.flatnonzero((depth > -_WIDEST_GAP_MM) & (np.diff(s, prepend=-np.inf) > 0.0))
        if near.size < _FEWEST:
            return None
        near = near[np.argsort(s[near], kind="stable")]
        half = 0.5 * depth[near]
        place = np.stack([x[near], y[near] - np.sin(angle[near]) * half, z[near] + np.cos(angle[near]) * half], axis=1)
        return Overlap(
            s_mm=s[near],
            depth_mm=depth[near],
            place_mm=place,
            angle_rad=angle[near],
            radius_mm=self.pair.rolling_radius_mm - self._wheel.z[kept[near]],
        )

    def _rough_depth(self, y: Floats, z: Floats) -> Floats:
        """Depths (n,) of points below the tangents of the rail at their places on the slant."""
        _, table = self._rail
        k = np.searchsorted(table[5, :-1], y * np.cos(_SLANT) + z * np.sin(_SLANT))
        return np.asarray((y - table[1, k]) * table[4, k] - (z - table[2, k]) * table[3, k])

    def _feet(self, y: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
        """Arc lengths (n,) of the feet of points on the rail, depths below it, and angles there."""
        step, table = self._rail
        slant = table[5]
        count = slant.size
        at = np.interp(y * np.cos(_SLANT) + z * np.sin(_SLANT), slant, np.arange(count, dtype=float))
        for _ in range(_FOOT_STEPS):
            k = np.clip(at.astype(int), 0, count - 2)
            v = at - k
            low, high = table[1:5, k], table[1:5, k + 1]
            py, pz = (_hermite(v, low[j], high[j], step * low[j + 2], step * high[j + 2]) for j in (0, 1))
            c, n = low[2] + v * (high[2] - low[2]), low[3] + v * (high[3] - low[3])
            dy, dz = y - py, z - pz
            bend = (low[2] * high[3] - low[3] * high[2]) / step
            along = (dy * c + dz * n) / (1.0 - bend * (dz * c - dy * n))
            at = np.clip(at + np.clip(along / step, -100.0, 100.0), 0.0, count - 1.0)
        size = np.hypot(c, n)
        depth = (dy * n - dz * c) / size
        # beyond the ends of the rail there is nothing
        depth = np.where((at > 0.0) & (at < count - 1.0) & (np.abs(along) < 1e-3), depth, -np.inf)
        return table[0, 0] + at * step, depth, np.arctan2(n, c)


def _hermite(v: Floats, p0: Floats, p1: Floats, m0: Floats, m1: Floats) -> Floats:
    """Cubic between two places with their rates, at v from 0 to 1."""
    a = p1 - p0
    return np.asarray(p0 + v * (m0 + v * (3.0 * a - 2.0 * m0 - m1 + v * (m0 + m1 - 2.0 * a))))


# --- Normal forces of an overlap by theories, under their names in `contact_theories.registry`.

# Half the chord over which the curvature of a touch point is taken: at the point itself it jumps from arc to arc.
_CHORD_MM = 1.5
_LEAST_CURVATURE_PER_MM = 1e-4
_ELLIPSE_STRIPS = 20
# Points beside a stretch that overlaps, where a gap line goes on; its step, and the fewest places that make one.
_BESIDE, _LATTICE_MM, _FEWEST_POINTS = 3, 0.05, 9
# Of the strip method: within 0.03 mm and 0.2 % of the half-space on one patch, 0.2 mm and 1.2 % where two carry.
_STRIPS, _SWEEPS = 60, 14
_STARTING, _LEAST_SQUARE_MM2 = 20, 1e-4
# Of the half-space: nodes from the middle to the end of the longest strip, and widest distance of those across: centre
# of pressure within 0.02 mm, force within 1 % of four times as many.
_NODES_ALONG, _STEP_MM, _FEWEST_ACROSS = 8, 0.3, 24
# The same where slopes are asked for: nodes that enter and leave change them by a tenth with those above.
_FINE_ALONG, _FINE_STEP_MM = 16, 0.1
# Of the largest overlap: Newton's method over positions takes differences of forces a billionth apart.
_TOLERANCE, _ITERATIONS = 3e-11, 400


@dataclass(frozen=True, kw_only=True, eq=False)
class Pressed:
    """A patch in strips along the rail.

    Attributes
    ----------
    s_mm, width_mm (n,)
        Place and width across.
    half_length_mm (n,)
        Along the rail.
    force_N_per_mm (n,)
        Along the rail's normal, over the width.
    problem
        Why its force is not to be trusted; empty where it is.
    """

    s_mm: Floats
    width_mm: Floats
    half_length_mm: Floats
    force_N_per_mm: Floats
    problem: str = ""


NormalTheory: TypeAlias = Callable[[Overlap, float], tuple[Pressed, ...]]


class OutOfReach(ConvergenceError):
    """A state of a wheel at which no force of its contact can be computed; for a search it is a failed step."""


@contextmanager
def within_reach() -> Iterator[None]:
    """Raise `OutOfReach` where the forces of a contact, computed inside, have no finite value."""
    try:
        # underflow is zero, as it should be
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            yield
    except (InputError, FloatingPointError, ZeroDivisionError, np.linalg.LinAlgError) as error:
        raise OutOfReach(f"the force of a contact cannot be computed: {error}") from error


def press(overlap: Overlap | None, normal: NormalTheory, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
    """Patches of an overlap by a theory; none without an overlap.

    Raises
    ------
    OutOfReach
        If the wheel overlaps a side of the rail that is vertical or falls back, on which it cannot roll, or if the
        theory has no finite force.
    """
    if overlap is None:
        return ()
    steepest = float(np.max(overlap.angle_rad, where=overlap.depth_mm > 0.0, initial=0.0))
    if steepest >= 0.5 * np.pi:
        raise OutOfReach(f"the wheel lies in the side of the rail, whose angle is {np.degrees(steepest):.0f} degrees")
    with within_reach():
        return normal(overlap, contact_modulus_MPa)


def hertz(overlap: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
    """Hertz's spring at the deepest point alone, with the curvature of its surroundings."""
    found = _minima(overlap)
    deepest = max(found, key=lambda place: float(overlap.depth_mm[place]), default=None)
    return () if deepest is None else (_ellipse(overlap, deepest, contact_modulus_MPa),)


def multi_hertz(overlap: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
    """Hertz's springs side by side, one at each place where the overlap is deepest (Otero Yugat, Part I, eq. 6).

    Range of validity: the springs know nothing of each other. Where such a place comes to be or ends while it is under
    load, the force jumps.
    """
    return tuple(_ellipse(overlap, place, contact_modulus_MPa) for place in _minima(overlap))


def overlap(found: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
    """Strips that carry their own overlap, with the end ones as wide as it reaches; see `contact_theories.strips`."""
    patches = []
    for first, last in regions(found.depth_mm > 0.0):
        inside = slice(first, last + 1)
        s, along = found.s_mm[inside], found.curvature_along_per_mm[inside]
        low, high = crossings_mm(found.s_mm, -found.depth_mm, 0.0, (first, last))
        # the outer ones as far as the overlap reaches: the force has no kink there
        between = 0.5 * np.diff(s)
        width = np.append(between, 0.5 * (high - s[-1])) + np.insert(between, 0, 0.5 * (s[0] - low))
        half, force = overlap_strips(found.depth_mm[inside], along, contact_modulus_MPa)
        patches.append(Pressed(s_mm=s, width_mm=width, half_length_mm=half, force_N_per_mm=force))
    return tuple(patches)


def strip(overlap: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
    """The strip method for all that overlaps at once, approached straight down, each strip along its own normal.

    The number of sweeps is fixed and the start follows the overlap, so that forces have no steps.
    """
    closing = np.cos(overlap.angle_rad)
    down = overlap.depth_mm / closing
    runs = regions(down > 0.0)
    if not runs:
        return ()
    deepest = int(np.argmax(down))
    # a circle drops by x^2 / (2 r) straight down, whatever the plane
    along = 0.5 / float(overlap.radius_mm[deepest])
    contact = solve_strips(
        Line(t=overlap.s_mm, f=down[deepest] - down, A=along, E=contact_modulus_MPa, closing=closing),
        Load(approach=float(down[deepest])),
        Search(strips=_STRIPS, tolerance=0.0, most_sweeps=_SWEEPS),
        start=_start_of_strips(overlap.s_mm, down, runs, along, contact_modulus_MPa),
    )
    return _patches(contact.t, contact.h, np.sqrt(contact.q), 0.5 * np.pi * contact.c * contact.q)


def _start_of_strips(
    s_mm: Floats, down_mm: Floats, runs: list[tuple[int, int]], along_per_mm: float, modulus_MPa: float
) -> Strips:
    """Springs over exactly what overlaps, with the pressure of Hertz's ellipse of as long and wide an overlap."""
    t, h, q, c = (np.empty((len(runs), _STARTING)) for _ in range(4))
    for k, run in enumerate(runs):
        low, high = crossings_mm(s_mm, -down_mm, 0.0, run)
        t[k] = low + (high - low) / _STARTING * (np.arange(_STARTING) + 0.5)
        h[k] = (high - low) / _STARTING
        q[k] = np.maximum(0.5 * np.interp(t[k], s_mm, down_mm) / along_per_mm, _LEAST_SQUARE_MM2)
        c[k] = modulus_MPa * along_per_mm * factor_of_ellipse(2.0 * np.sqrt(q[k].max()) / (high - low))
    return Strips(t=t.ravel(), h=h.ravel(), q=q.ravel(), c=c.ravel(), approach=float(down_mm.max()))


def half_space(overlap: Overlap, contact_modulus_MPa: float, *, fine: bool = False) -> tuple[Pressed, ...]:
    """The half-space on a uniform grid; separate patches feel each other.

    The half length belongs to an elliptic pressure with the strip's second moment. On a `fine` grid slopes over small
    motions are good to some percent.

    Notes
    -----
    Source: Johnson (1985), eq. 3.25 with normals that turn across (`contact.halfspace`), and Polonsky and Keer's
    conjugate gradients (1999) at a given approach. Range of validity: flat bodies; the same rolling radius along each
    strip.
    """
    inside = np.flatnonzero(overlap.depth_mm > 0.0)
    if inside.size < 3:
        return ()
    low, high = (float(overlap.s_mm[end]) for end in inside[[0, -1]])
    along, widest = (_FINE_ALONG, _FINE_STEP_MM) if fine else (_NODES_ALONG, _STEP_MM)
    step = min(widest, (high - low) / _FEWEST_ACROSS)
    # on a lattice of the rail, where a node enters without pressure
    s = step * np.arange(np.floor(low / step), np.ceil(high / step) + 1.0)
    depth, curvature, angle = (
        np.interp(s, overlap.s_mm, values)
        for values in (overlap.depth_mm, overlap.curvature_along_per_mm, overlap.angle_rad)
    )
    deepest = float(depth.max())
    if deepest <= 0.0:
        return ()
    longest = float(np.sqrt(2.0 * np.max(np.maximum(depth, 0.0) / curvature)))
    x = np.asarray(longest / (along - 0.5) * np.arange(along))
    rows = np.full(x.size, 2.0 * x[1])
    rows[0] = x[1]
    wanted = (depth - 0.5 * curvature * x[:, None] ** 2).ravel()
    grid = ContactGrid(x_mm=x, s_mm=np.asarray(s), half=True)
    contact = half_space_problem(grid, deepest - wanted, contact_modulus_MPa=contact_modulus_MPa, angle_rad=angle)
    solution = solve_contact(contact, None, approach_mm=deepest, tolerance=_TOLERANCE, iterations=_ITERATIONS)
    pressure = solution.pressure_MPa.reshape(x.size, -1)
    force = rows @ pressure
    moment = (rows * (x**2 + x[1] ** 2 / 12.0)) @ pressure
    half = 2.0 * np.sqrt(np.divide(moment, force, out=np.zeros_like(force), where=force > 0.0))
    problem = (
        f"the half-space did not converge in {solution.iterations} iterations: {solution.residual:.1e} of the overlap"
        " is left open; another theory may go"
    )
    widths = np.full(s.size, s[1] - s[0])
    return _patches(s, widths, half, force, "" if solution.status == "converged" else problem)


def on_gap_lines(at_approach: AtApproach) -> NormalTheory:
    """A theory of a gap line at an approach, taken on each stretch that overlaps by itself."""

    def normal(overlap: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
        found: list[Pressed] = []
        for first, last in regions(overlap.depth_mm > 0.0):
            low, high = max(0, first - _BESIDE), min(overlap.s_mm.size - 1, last + _BESIDE)
            # on a lattice of the rail, where a place enters without pressure
            t = _LATTICE_MM * np.arange(
                np.ceil(overlap.s_mm[low] / _LATTICE_MM), np.floor(overlap.s_mm[high] / _LATTICE_MM) + 1.0
            )
            depth = np.interp(t, overlap.s_mm, overlap.depth_mm)
            deepest = int(np.argmax(depth))
            if t.size < _FEWEST_POINTS or depth[deepest] <= 0.0:
                continue
            along = float(np.interp(t[deepest], overlap.s_mm, overlap.curvature_along_per_mm))
            line = GapLine(
                t_mm=t, f_mm=depth[deepest] - depth, A_per_mm=0.5 * along, contact_modulus_MPa=contact_modulus_MPa
            )
            contact = at_approach(line, float(depth[deepest]))
            force = 0.5 * np.pi * contact.half_length_mm * contact.centre_pressure_MPa
            found += _patches(contact.t_mm, contact.width_mm, contact.half_length_mm, force)
        return tuple(found)

    return normal


NORMAL_THEORIES: Mapping[str, NormalTheory] = {
    "hertz": hertz,
    "multi_hertz": multi_hertz,
    "overlap": overlap,
    **{name: on_gap_lines(theory.at_approach) for name, theory in THEORIES.items() if theory.at_approach is not None},
    "strip": strip,
    "half_space": half_space,
}
"""Theories by the names of `fecontact theories`, and overlapping strips, from the simplest on."""
DEFAULT_THEORY = "overlap"


def normal_theory(name: str, *, fine: bool = False) -> NormalTheory:
    """A theory by its name; `fine` where slopes over small motions are asked for, which only the half-space minds.

    Raises
    ------
    InputError
        If there is none of that name, or it has no force over an approach.
    """
    if name not in NORMAL_THEORIES:
        raise InputError(
            f"theory is {name!r}; allowed: {', '.join(NORMAL_THEORIES)}; a vehicle needs a force over the approach,"
            " which other theories do not have"
        )
    return partial(half_space, fine=True) if fine and name == "half_space" else NORMAL_THEORIES[name]


def _patches(
    s_mm: Floats, width_mm: Floats, half_length_mm: Floats, force_N_per_mm: Floats, problem: str = ""
) -> tuple[Pressed, ...]:
    """A patch for each unbroken run of strips that carry."""
    return tuple(
        Pressed(
            s_mm=s_mm[first : last + 1],
            width_mm=width_mm[first : last + 1],
            half_length_mm=half_length_mm[first : last + 1],
            force_N_per_mm=force_N_per_mm[first : last + 1],
            problem=problem,
        )
        for first, last in regions(force_N_per_mm > 0.0)
    )


def _minima(overlap: Overlap) -> list[int]:
    """Points that lie deeper than both their neighbours, and in the rail."""
    depth = overlap.depth_mm
    inner = depth[1:-1]
    return [int(k) for k in np.flatnonzero((inner > depth[:-2]) & (inner >= depth[2:]) & (inner > 0.0)) + 1]


def _ellipse(overlap: Overlap, place: int, contact_modulus_MPa: float) -> Pressed:
    """Hertz's spring and ellipse about a point that lies deepest."""
    s, depth = overlap.s_mm, overlap.depth_mm
    near = slice(place - 1, place + 2)
    # the parabola through the point and its neighbours
    bend, slope, _ = np.polyfit(s[near] - s[place], depth[near], 2)
    off = -0.5 * slope / bend
    centre, top = float(s[place] + off), float(depth[place] - 0.25 * slope**2 / bend)
    # between the points as far as the depth is not the parabola, which straight lines would not follow
    beside = np.interp([centre - _CHORD_MM, centre + _CHORD_MM], s, depth - top - bend * (s - centre) ** 2)
    across = max(float(-2.0 * bend - beside.sum() / _CHORD_MM**2), _LEAST_CURVATURE_PER_MM)
    along = float(np.interp(centre, s, overlap.curvature_along_per_mm))
    unit = _unit_ellipse(round(np.log(across / along), 12))
    # lengths go with the curvature, the spring with its inverse root
    stiffness = contact_modulus_MPa * unit.stiffness_N_per_mm15 / np.sqrt(along)
    force = stiffness * top**1.5
    size = (force * along**2 / contact_modulus_MPa) ** (1.0 / 3.0) / along
    a, b = unit.a_mm * size, unit.b_mm * size
    places = (np.arange(_ELLIPSE_STRIPS) + 0.5) * (2.0 / _ELLIPSE_STRIPS) - 1.0
    inside = 1.0 - places**2
    share = inside / inside.sum()
    width = 2.0 * b / _ELLIPSE_STRIPS
    return Pressed(
        s_mm=centre + b * places,
        width_mm=np.full(_ELLIPSE_STRIPS, width),
        half_length_mm=a * np.sqrt(inside),
        force_N_per_mm=force * share / width,
    )


@lru_cache(maxsize=4096)
def _unit_ellipse(log_ratio: float) -> HertzContact:
    """Hertz's ellipse of curvatures 1 along and exp(log_ratio) across, modulus 1 and force 1."""
    return hertz_ellipse(0.5, 0.5 * float(np.exp(log_ratio)), normal_force_N=1.0, contact_modulus_MPa=1.0)
