"""Normal forces of a wheel that overlaps its rail, by several theories.

Each theory has a force over the approach. It takes an `Overlap` and the contact modulus, and returns the patches that
carry load. Each patch is divided into strips along the rail, and each strip has its force per width and its half
length. Creep forces, equilibrium and stability need nothing else of a theory, so their code is common to all theories.
This module only describes how each theory sees an overlap.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import TypeAlias

import numpy as np

from fecontact.arrays import Floats, find_runs
from fecontact.contact.grid import ContactGrid
from fecontact.contact.halfspace import build_half_space_problem
from fecontact.contact.solver import solve_contact
from fecontact.contact_theories.gap_line import GapLine, GapLineTheory, find_crossings_mm
from fecontact.contact_theories.hertz import HertzContact, hertz_ellipse
from fecontact.contact_theories.overlap import overlap_strips
from fecontact.contact_theories.registry import THEORIES
from fecontact.contact_theories.strip_method import (
    StripGap,
    StripLoad,
    StripSearch,
    StripSolution,
    estimate_ellipse_factor,
    solve_strips,
)
from fecontact.errors import ConvergenceError, InputError
from fecontact.placement.wheel_on_rail import Pair, Placement
from fecontact.placement.wheelset import Wheelset
from fecontact.profiles.segments import CurvePoints

# --- Overlap of a wheel and its rail: the wheel's silhouette and the rail's profile, for thousands of positions.

# Spacing of the points on the wheel, and of the points on the rail that cubics connect.
_WHEEL_SPACING_MM, _RAIL_SPACING_MM = 0.1, 0.05
# Feet on the rail are searched in their order along this direction (rad): head and gauge face run forward along it.
_SLANT_RAD = 0.25 * np.pi
_FOOT_STEPS = 4
# No theory closes a wider gap by the surroundings that it sees. The second value is the largest error of the first
# estimate of the depth.
_WIDEST_GAP_MM, _ROUGH_DEPTH_ERROR_MM = 0.5, 2.0
_MIN_POINTS = 3


def place_wheel(pair: Pair, shift_mm: float) -> Placement:
    """Place a wheel on its rail, shifted towards the rail, without roll and yaw.

    Parameters
    ----------
    pair
        Wheel and rail of one side.
    shift_mm
        Lateral shift of the wheel, positive towards its rail.

    Returns
    -------
    Placement
        The wheel in contact with its rail.

    Raises
    ------
    InputError
        If the wheel cannot stand on the rail at this shift; the message gives the reason.
    """
    placement = pair.placed(shift_mm, 0.0, 0.0)
    if isinstance(placement, str):
        raise InputError(
            f"the wheel cannot be placed on its rail: {placement}; check gauge, profiles and back-to-back distance"
        )
    return placement


@dataclass(frozen=True, kw_only=True, eq=False)
class Overlap:
    """Stretch of a wheel's silhouette near its rail.

    Its n points are ordered from the gauge side to the field side.

    Attributes
    ----------
    s_mm : ndarray of shape (n,)
        Arc length of the foot of each point on the rail, increasing.
    depth_mm : ndarray of shape (n,)
        Depth of each point in the rail, along the normal of the rail; negative where there is a gap.
    place_mm : ndarray of shape (n, 3)
        Position midway between both surfaces, in the track frame.
    angle_rad : ndarray of shape (n,)
        Angle of the rail's tangent plane at the foot.
    radius_mm : ndarray of shape (n,)
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

    def interpolate(self, s_mm: Floats) -> Overlap:
        """Interpolate the overlap linearly at other arc lengths.

        Parameters
        ----------
        s_mm : ndarray of shape (m,)
            Arc lengths on the rail.

        Returns
        -------
        Overlap
            Depth, position, angle and radius at the m arc lengths.
        """
        position = np.stack([np.interp(s_mm, self.s_mm, column) for column in self.place_mm.T], axis=1)
        depth, angle, radius = (
            np.interp(s_mm, self.s_mm, values) for values in (self.depth_mm, self.angle_rad, self.radius_mm)
        )
        return Overlap(s_mm=s_mm, depth_mm=depth, place_mm=position, angle_rad=angle, radius_mm=radius)


@dataclass(frozen=True, kw_only=True, eq=False)
class Surfaces:
    """Wheel and rail in the frame of the left side, with tables of both profiles.

    Attributes
    ----------
    pair
        Wheel and rail.
    """

    pair: Pair

    @classmethod
    def make_sides(cls, wheelset: Wheelset) -> tuple[Surfaces, Surfaces]:
        """Make the surfaces of both sides of a wheelset.

        Parameters
        ----------
        wheelset
            Both wheels over their rails.

        Returns
        -------
        tuple of Surfaces
            The left side, and the right side as its mirror image.
        """
        left = cls(pair=wheelset.left.pair)
        return left, left if wheelset.symmetric else cls(pair=wheelset.right.pair)

    @cached_property
    def _wheel(self) -> CurvePoints:
        """Points on the wheel, 0.1 mm apart, without both end points."""
        return self.pair.wheel.evaluate(self.pair.wheel.spread(_WHEEL_SPACING_MM)[1:-1])

    @cached_property
    def _rail(self) -> tuple[float, Floats]:
        """Spacing of the rail's table in arc length, and the table (6, n).

        The rows of the table are arc length, y, z, cosine and sine of the tangent, and position along the slant.
        """
        rail = self.pair.rail
        point_count = int(np.ceil(rail.profile.length_mm / _RAIL_SPACING_MM)) + 1
        s = np.linspace(0.0, rail.profile.length_mm, point_count)
        y, z, angle = rail.section(rail.profile.at_arc_length(s))
        # a wheel cannot roll on a side of the rail that falls back more steeply than the slant
        forward = np.cos(angle - _SLANT_RAD) > 0.05
        first, last = int(np.argmax(forward)), point_count - int(np.argmax(forward[::-1]))
        slant = y * np.cos(_SLANT_RAD) + z * np.sin(_SLANT_RAD)
        table = np.stack([s, y, z, np.cos(angle), np.sin(angle), slant])[:, first:last]
        return float(s[1]), table

    def overlap(self, shift_mm: float, height_mm: float, roll_rad: float, yaw_rad: float) -> Overlap | None:
        """Find the stretch of the wheel that is nearest to the rail or in it.

        Parameters
        ----------
        shift_mm, height_mm
            Lateral position of the wheelset's centre, and its height above the centre of the track, for the left side.
        roll_rad, yaw_rad
            Roll and yaw of the wheelset, for the left side, with the signs that all other modules use.

        Returns
        -------
        Overlap or None
            The stretch; None if fewer than 3 points of the wheel are within 0.5 mm of the rail.
        """
        pose = self.pair.hung(shift_mm, roll_rad, yaw_rad)
        _, x, y, z = pose.silhouette_of(self._wheel)
        z = z + height_mm
        # thousands of points are far from the rail
        nearby = np.flatnonzero(self._estimate_depth(y, z) > -_ROUGH_DEPTH_ERROR_MM)
        x, y, z = x[nearby], y[nearby], z[nearby]
        arc_length, depth, angle = self._find_feet(y, z)
        # feet in decreasing order belong to a flank that faces away from the rail
        close = np.flatnonzero((depth > -_WIDEST_GAP_MM) & (np.diff(arc_length, prepend=-np.inf) > 0.0))
        if close.size < _MIN_POINTS:
            return None
        close = close[np.argsort(arc_length[close], kind="stable")]
        half = 0.5 * depth[close]
        position = np.stack(
            [x[close], y[close] - np.sin(angle[close]) * half, z[close] + np.cos(angle[close]) * half], axis=1
        )
        return Overlap(
            s_mm=arc_length[close],
            depth_mm=depth[close],
            place_mm=position,
            angle_rad=angle[close],
            radius_mm=self.pair.rolling_radius_mm - self._wheel.z[nearby[close]],
        )

    def _estimate_depth(self, y: Floats, z: Floats) -> Floats:
        """Estimate the depths (n,) in mm of points below the rail, positive inside the rail.

        Each depth is relative to the tangent of the rail at the position of the point along the slant. `y` and `z` (n,)
        are in mm.
        """
        _, table = self._rail
        index = np.searchsorted(table[5, :-1], y * np.cos(_SLANT_RAD) + z * np.sin(_SLANT_RAD))
        return np.asarray((y - table[1, index]) * table[4, index] - (z - table[2, index]) * table[3, index])

    def _find_feet(self, y: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
        """Find the feet of points on the rail.

        Returns
        -------
        tuple of arrays (n,)
            Arc lengths of the feet in mm, depths of the points below the rail in mm, and angles of the rail in rad.
            Beyond the ends of the rail the depth is minus infinity.
        """
        step, table = self._rail
        slant = table[5]
        count = slant.size
        position = np.interp(y * np.cos(_SLANT_RAD) + z * np.sin(_SLANT_RAD), slant, np.arange(count, dtype=float))
        for _ in range(_FOOT_STEPS):
            index = np.clip(position.astype(int), 0, count - 2)
            fraction = position - index
            low, high = table[1:5, index], table[1:5, index + 1]
            foot_y, foot_z = (
                _interpolate_cubic(fraction, low[j], high[j], step * low[j + 2], step * high[j + 2]) for j in (0, 1)
            )
            cosine, sine = low[2] + fraction * (high[2] - low[2]), low[3] + fraction * (high[3] - low[3])
            dy, dz = y - foot_y, z - foot_z
            curvature = (low[2] * high[3] - low[3] * high[2]) / step
            along = (dy * cosine + dz * sine) / (1.0 - curvature * (dz * cosine - dy * sine))
            position = np.clip(position + np.clip(along / step, -100.0, 100.0), 0.0, count - 1.0)
        norm = np.hypot(cosine, sine)
        depth = (dy * sine - dz * cosine) / norm
        # there is no rail beyond its ends
        depth = np.where((position > 0.0) & (position < count - 1.0) & (np.abs(along) < 1e-3), depth, -np.inf)
        return table[0, 0] + position * step, depth, np.arctan2(sine, cosine)


def _interpolate_cubic(fraction: Floats, start: Floats, end: Floats, start_rate: Floats, end_rate: Floats) -> Floats:
    """Cubic between two points with given rates, at a fraction from 0 to 1.

    The rates are per unit of the fraction. All arrays are broadcast to a common shape.
    """
    change = end - start
    return np.asarray(
        start
        + fraction
        * (
            start_rate
            + fraction
            * (3.0 * change - 2.0 * start_rate - end_rate + fraction * (start_rate + end_rate - 2.0 * change))
        )
    )


# --- Normal forces of an overlap by theories, under their names in `contact_theories.registry`.

# Half of the chord over which the curvature at a contact point is measured: at the point itself it jumps from arc to
# arc.
_HALF_CHORD_MM = 1.5
_MIN_CURVATURE_PER_MM = 1e-4
_ELLIPSE_STRIPS = 20
# Number of points by which a gap line extends beyond a stretch that overlaps, spacing of the gap line, and its smallest
# number of points.
_EXTRA_POINTS, _LATTICE_SPACING_MM, _MIN_LATTICE_POINTS = 3, 0.05, 9
# Number of strips and sweeps of the strip method. With them its centre of pressure and force are within 0.03 mm and
# 0.2 % of the half-space on one patch, and within 0.2 mm and 1.2 % where two patches carry load.
_STRIP_COUNT, _SWEEP_COUNT = 60, 14
_START_STRIPS, _MIN_SQUARED_HALF_LENGTH_MM2 = 20, 1e-4
# Grid of the half-space: nodes from the middle to the end of the longest strip, largest spacing of the nodes across,
# and smallest number of nodes across. Compared with four times this number of nodes, the centre of pressure is within
# 0.02 mm and the force within 1 %.
_NODES_ALONG, _MAX_NODE_SPACING_MM, _MIN_NODES_ACROSS = 8, 0.3, 24
# Finer grid for derivatives of the force: on the grid above, nodes that enter and leave change derivatives by a tenth.
_FINE_NODES_ALONG, _FINE_NODE_SPACING_MM = 16, 0.1
# Tolerance relative to the largest overlap: Newton's method over positions uses differences of forces that are a
# billionth apart.
_RELATIVE_TOLERANCE, _ITERATIONS = 3e-11, 400


@dataclass(frozen=True, kw_only=True, eq=False)
class PatchStrips:
    """Contact patch in strips along the rail.

    Attributes
    ----------
    s_mm, width_mm : ndarray of shape (n,)
        Position of each strip on the rail's arc length, and its width across the rail.
    half_length_mm : ndarray of shape (n,)
        Half length along the rail.
    force_N_per_mm : ndarray of shape (n,)
        Force along the rail's normal, per width.
    problem
        Reason why the force is not reliable; empty if the force is reliable.
    """

    s_mm: Floats
    width_mm: Floats
    half_length_mm: Floats
    force_N_per_mm: Floats
    problem: str = ""


NormalTheory: TypeAlias = Callable[[Overlap, float], tuple[PatchStrips, ...]]


class OutOfReachError(ConvergenceError):
    """State of a wheel for which no contact force can be computed.

    For a search such a state is a failed step.
    """


@contextmanager
def errors_as_out_of_reach() -> Iterator[None]:
    """Raise `OutOfReachError` if a contact force that is computed inside has no finite value.

    Yields
    ------
    None
        Control to the enclosed code.

    Raises
    ------
    OutOfReachError
        For an `InputError`, a floating-point error, a division by zero, or a singular matrix inside.
    """
    try:
        # underflow to zero is right
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            yield
    except (InputError, FloatingPointError, ZeroDivisionError, np.linalg.LinAlgError) as error:
        raise OutOfReachError(f"the contact force cannot be computed: {error}") from error


def solve_normal_contact(
    overlap: Overlap | None, normal: NormalTheory, contact_modulus_MPa: float
) -> tuple[PatchStrips, ...]:
    """Solve the normal contact of an overlap by a theory.

    Parameters
    ----------
    overlap
        Overlap of wheel and rail; None if they are apart.
    normal
        Theory of the normal force.
    contact_modulus_MPa
        Contact modulus E*.

    Returns
    -------
    tuple of PatchStrips
        The patches that carry load; empty without an overlap.

    Raises
    ------
    OutOfReachError
        If the wheel overlaps a side of the rail that is vertical or falls back, on which it cannot roll, or if the
        theory has no finite force.

    Examples
    --------
    A ball of radius 460 mm that is 0.1 mm deep in a plane carries 104.3 kN by Hertz:

    >>> import numpy as np
    >>> from fecontact.features.curves.normal import Overlap, normal_theory, solve_normal_contact
    >>> s = np.arange(-12.0, 12.05, 0.1)
    >>> overlap = Overlap(
    ...     s_mm=s,
    ...     depth_mm=0.1 - s**2 / 920.0,
    ...     place_mm=np.zeros((s.size, 3)),
    ...     angle_rad=0.0 * s,
    ...     radius_mm=np.full(s.size, 460.0),
    ... )
    >>> (patch,) = solve_normal_contact(overlap, normal_theory("hertz"), 115385.0)
    >>> round(1e-3 * float(patch.force_N_per_mm @ patch.width_mm), 1)
    104.3
    """
    if overlap is None:
        return ()
    steepest = float(np.max(overlap.angle_rad, where=overlap.depth_mm > 0.0, initial=0.0))
    if steepest >= 0.5 * np.pi:
        raise OutOfReachError(
            f"the wheel overlaps the side of the rail, at an angle of {np.degrees(steepest):.0f} degrees"
        )
    with errors_as_out_of_reach():
        return normal(overlap, contact_modulus_MPa)


def solve_hertz(overlap: Overlap, contact_modulus_MPa: float) -> tuple[PatchStrips, ...]:
    """Hertz's spring at the deepest point alone, with the curvature of its surroundings.

    Parameters
    ----------
    overlap
        Overlap of wheel and rail.
    contact_modulus_MPa
        Contact modulus E*.

    Returns
    -------
    tuple of PatchStrips
        At most one patch, in 20 strips.

    Notes
    -----
    Source: Hertz (1882). Range of validity: a single patch with a constant curvature.
    """
    minima = _find_deepest_points(overlap)
    deepest = max(minima, key=lambda point: float(overlap.depth_mm[point]), default=None)
    return () if deepest is None else (_solve_ellipse(overlap, deepest, contact_modulus_MPa),)


def solve_multi_hertz(overlap: Overlap, contact_modulus_MPa: float) -> tuple[PatchStrips, ...]:
    """Hertz's springs side by side, at each local maximum of the overlap's depth.

    Parameters
    ----------
    overlap
        Overlap of wheel and rail.
    contact_modulus_MPa
        Contact modulus E*.

    Returns
    -------
    tuple of PatchStrips
        A patch for each local maximum.

    Notes
    -----
    Source: Otero Yugat, Part I, eq. 6. Range of validity: the springs do not interact. If a local maximum appears or
    vanishes under load, then the force jumps.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.features.curves.normal import Overlap, solve_multi_hertz
    >>> s = np.arange(-12.0, 12.05, 0.1)
    >>> overlap = Overlap(
    ...     s_mm=s,
    ...     depth_mm=0.1 - s**2 / 920.0,
    ...     place_mm=np.zeros((s.size, 3)),
    ...     angle_rad=0.0 * s,
    ...     radius_mm=np.full(s.size, 460.0),
    ... )
    >>> (patch,) = solve_multi_hertz(overlap, 115e3)
    >>> bool(abs(patch.force_N_per_mm @ patch.width_mm / (4.0 / 3.0 * 115e3 * 460.0**0.5 * 0.1**1.5) - 1.0) < 0.01)
    True
    """
    return tuple(_solve_ellipse(overlap, point, contact_modulus_MPa) for point in _find_deepest_points(overlap))


def solve_overlap(overlap: Overlap, contact_modulus_MPa: float) -> tuple[PatchStrips, ...]:
    """Strips along the rail, each with a force by its depth alone.

    Parameters
    ----------
    overlap
        Overlap of wheel and rail.
    contact_modulus_MPa
        Contact modulus E*.

    Returns
    -------
    tuple of PatchStrips
        A patch for each stretch that overlaps. The end strips are as wide as the overlap reaches.

    Notes
    -----
    The force of a strip is described in `contact_theories.overlap`.
    """
    patches = []
    for first, last in find_runs(overlap.depth_mm > 0.0):
        inside = slice(first, last + 1)
        s, curvature_along = overlap.s_mm[inside], overlap.curvature_along_per_mm[inside]
        low, high = find_crossings_mm(overlap.s_mm, -overlap.depth_mm, 0.0, (first, last))
        # the outer strips reach to the ends of the overlap, so that the force has no kink
        between = 0.5 * np.diff(s)
        width = np.append(between, 0.5 * (high - s[-1])) + np.insert(between, 0, 0.5 * (s[0] - low))
        half_length, force = overlap_strips(overlap.depth_mm[inside], curvature_along, contact_modulus_MPa)
        patches.append(PatchStrips(s_mm=s, width_mm=width, half_length_mm=half_length, force_N_per_mm=force))
    return tuple(patches)


def solve_strip_method(overlap: Overlap, contact_modulus_MPa: float) -> tuple[PatchStrips, ...]:
    """Strip method for the whole overlap at once, approached straight down.

    Each strip carries load along its normal. The number of sweeps is fixed and the start follows the overlap, so that
    forces have no steps.

    Parameters
    ----------
    overlap
        Overlap of wheel and rail.
    contact_modulus_MPa
        Contact modulus E*.

    Returns
    -------
    tuple of PatchStrips
        A patch for each unbroken run of strips that carry load.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.features.curves.normal import Overlap, solve_strip_method
    >>> s = np.arange(-12.0, 12.05, 0.1)
    >>> overlap = Overlap(
    ...     s_mm=s,
    ...     depth_mm=0.1 - s**2 / 920.0,
    ...     place_mm=np.zeros((s.size, 3)),
    ...     angle_rad=0.0 * s,
    ...     radius_mm=np.full(s.size, 460.0),
    ... )
    >>> (patch,) = solve_strip_method(overlap, 115e3)
    >>> bool(abs(patch.force_N_per_mm @ patch.width_mm / (4.0 / 3.0 * 115e3 * 460.0**0.5 * 0.1**1.5) - 1.0) < 0.01)
    True
    """
    closing = np.cos(overlap.angle_rad)
    depth_down = overlap.depth_mm / closing
    stretches = find_runs(depth_down > 0.0)
    if not stretches:
        return ()
    deepest = int(np.argmax(depth_down))
    # a circle drops by x^2 / (2 r) straight down, whatever the angle of the contact plane is
    curvature_along = 0.5 / float(overlap.radius_mm[deepest])
    contact = solve_strips(
        StripGap(
            t=overlap.s_mm,
            f=depth_down[deepest] - depth_down,
            A=curvature_along,
            E=contact_modulus_MPa,
            closing=closing,
        ),
        StripLoad(approach=float(depth_down[deepest])),
        StripSearch(strips=_STRIP_COUNT, tolerance=0.0, most_sweeps=_SWEEP_COUNT),
        start=_guess_strips(overlap.s_mm, depth_down, stretches, curvature_along, contact_modulus_MPa),
    )
    return _split_into_patches(contact.t, contact.h, np.sqrt(contact.q), 0.5 * np.pi * contact.c * contact.q)


def _guess_strips(
    s_mm: Floats, down_mm: Floats, stretches: list[tuple[int, int]], along_per_mm: float, modulus_MPa: float
) -> StripSolution:
    """Springs over the exact overlap, as the start of the strip method.

    The pressure of each stretch is the pressure of the Hertz ellipse with the length and width of the stretch.
    """
    t, h, q, c = (np.empty((len(stretches), _START_STRIPS)) for _ in range(4))
    for index, stretch in enumerate(stretches):
        low, high = find_crossings_mm(s_mm, -down_mm, 0.0, stretch)
        t[index] = low + (high - low) / _START_STRIPS * (np.arange(_START_STRIPS) + 0.5)
        h[index] = (high - low) / _START_STRIPS
        q[index] = np.maximum(0.5 * np.interp(t[index], s_mm, down_mm) / along_per_mm, _MIN_SQUARED_HALF_LENGTH_MM2)
        c[index] = modulus_MPa * along_per_mm * estimate_ellipse_factor(2.0 * np.sqrt(q[index].max()) / (high - low))
    return StripSolution(t=t.ravel(), h=h.ravel(), q=q.ravel(), c=c.ravel(), approach=float(down_mm.max()))


def solve_half_space(overlap: Overlap, contact_modulus_MPa: float, *, fine: bool = False) -> tuple[PatchStrips, ...]:
    """Half-space on a uniform grid, on which separate patches interact.

    The half length of a strip is the half length of an elliptic pressure with the second moment of the strip's
    pressure. On a `fine` grid, derivatives over small motions are accurate to some percent.

    Parameters
    ----------
    overlap
        Overlap of wheel and rail.
    contact_modulus_MPa
        Contact modulus E*.
    fine
        Whether the grid is the finer grid for derivatives.

    Returns
    -------
    tuple of PatchStrips
        A patch for each unbroken run of strips that carry load; empty if fewer than 3 points or no node overlap. If the
        iterations do not converge, then each patch has a `problem`.

    Notes
    -----
    Source: Johnson (1985), eq. 3.25 with normals that turn across (`contact.halfspace`), and Polonsky and Keer's
    conjugate gradients (1999) at a given approach. Range of validity: flat bodies, with a constant rolling radius along
    each strip.
    """
    inside = np.flatnonzero(overlap.depth_mm > 0.0)
    if inside.size < 3:
        return ()
    low, high = (float(overlap.s_mm[end]) for end in inside[[0, -1]])
    nodes_along, max_spacing = (
        (_FINE_NODES_ALONG, _FINE_NODE_SPACING_MM) if fine else (_NODES_ALONG, _MAX_NODE_SPACING_MM)
    )
    spacing = min(max_spacing, (high - low) / _MIN_NODES_ACROSS)
    # the lattice is fixed to the rail, so that a node enters the patch without pressure
    lattice = spacing * np.arange(np.floor(low / spacing), np.ceil(high / spacing) + 1.0)
    depth, curvature, angle = (
        np.interp(lattice, overlap.s_mm, values)
        for values in (overlap.depth_mm, overlap.curvature_along_per_mm, overlap.angle_rad)
    )
    deepest = float(depth.max())
    if deepest <= 0.0:
        return ()
    longest = float(np.sqrt(2.0 * np.max(np.maximum(depth, 0.0) / curvature)))
    nodes = np.asarray(longest / (nodes_along - 0.5) * np.arange(nodes_along))
    row_widths = np.full(nodes.size, 2.0 * nodes[1])
    row_widths[0] = nodes[1]
    target_depth = (depth - 0.5 * curvature * nodes[:, None] ** 2).ravel()
    grid = ContactGrid(x_mm=nodes, s_mm=np.asarray(lattice), half=True)
    contact_problem = build_half_space_problem(
        grid, deepest - target_depth, contact_modulus_MPa=contact_modulus_MPa, angle_rad=angle
    )
    solution = solve_contact(
        contact_problem, None, approach_mm=deepest, tolerance=_RELATIVE_TOLERANCE, iterations=_ITERATIONS
    )
    pressure = solution.pressure_MPa.reshape(nodes.size, -1)
    force = row_widths @ pressure
    moment = (row_widths * (nodes**2 + nodes[1] ** 2 / 12.0)) @ pressure
    half_length = 2.0 * np.sqrt(np.divide(moment, force, out=np.zeros_like(force), where=force > 0.0))
    problem = (
        f"the half-space did not converge in {solution.iterations} iterations (residual {solution.residual:.1e} of the"
        " overlap); try another theory"
    )
    widths = np.full(lattice.size, lattice[1] - lattice[0])
    return _split_into_patches(lattice, widths, half_length, force, "" if solution.status == "converged" else problem)


def adapt_gap_line_theory(at_approach: GapLineTheory) -> NormalTheory:
    """Make a normal theory of a theory for gap lines.

    Parameters
    ----------
    at_approach
        Contact of a gap line at an approach.

    Returns
    -------
    NormalTheory
        The theory, applied to each stretch that overlaps separately.
    """

    def normal(overlap: Overlap, contact_modulus_MPa: float) -> tuple[PatchStrips, ...]:
        """Solve each stretch that overlaps as a gap line.

        The gap line of a stretch is on a lattice that is fixed to the rail; its approach is the largest depth.
        Stretches with fewer than `_MIN_LATTICE_POINTS` points give no patch.
        """
        patches: list[PatchStrips] = []
        for first, last in find_runs(overlap.depth_mm > 0.0):
            low, high = max(0, first - _EXTRA_POINTS), min(overlap.s_mm.size - 1, last + _EXTRA_POINTS)
            # the lattice is fixed to the rail, so that a point enters the patch without pressure
            lattice = _LATTICE_SPACING_MM * np.arange(
                np.ceil(overlap.s_mm[low] / _LATTICE_SPACING_MM),
                np.floor(overlap.s_mm[high] / _LATTICE_SPACING_MM) + 1.0,
            )
            depth = np.interp(lattice, overlap.s_mm, overlap.depth_mm)
            deepest = int(np.argmax(depth))
            if lattice.size < _MIN_LATTICE_POINTS or depth[deepest] <= 0.0:
                continue
            curvature_along = float(np.interp(lattice[deepest], overlap.s_mm, overlap.curvature_along_per_mm))
            gap_line = GapLine(
                t_mm=lattice,
                f_mm=depth[deepest] - depth,
                A_per_mm=0.5 * curvature_along,
                contact_modulus_MPa=contact_modulus_MPa,
            )
            contact = at_approach(gap_line, float(depth[deepest]))
            force = 0.5 * np.pi * contact.half_length_mm * contact.centre_pressure_MPa
            patches += _split_into_patches(contact.t_mm, contact.width_mm, contact.half_length_mm, force)
        return tuple(patches)

    return normal


NORMAL_THEORIES: Mapping[str, NormalTheory] = {
    "hertz": solve_hertz,
    "multi_hertz": solve_multi_hertz,
    "overlap": solve_overlap,
    **{
        name: adapt_gap_line_theory(theory.at_approach)
        for name, theory in THEORIES.items()
        if theory.at_approach is not None
    },
    "strip": solve_strip_method,
    "half_space": solve_half_space,
}
"""Theories by the names of `fecontact theories`, and overlapping strips, beginning with the simplest."""


def normal_theory(name: str, *, fine: bool = False) -> NormalTheory:
    """Normal theory with a given name.

    Parameters
    ----------
    name
        A key of `NORMAL_THEORIES`.
    fine
        Whether derivatives over small motions are needed. Only the half-space has a finer grid for them.

    Returns
    -------
    NormalTheory
        The theory.

    Raises
    ------
    InputError
        If there is no theory of this name, or if the theory has no force over an approach.

    Examples
    --------
    >>> from fecontact.features.curves.normal import normal_theory
    >>> normal_theory("hertz").__name__
    'solve_hertz'
    """
    if name not in NORMAL_THEORIES:
        raise InputError(
            f"theory is {name!r}; allowed: {', '.join(NORMAL_THEORIES)}; only these theories give"
            " the force as a function of the approach"
        )
    return partial(solve_half_space, fine=True) if fine and name == "half_space" else NORMAL_THEORIES[name]


def _split_into_patches(
    s_mm: Floats, width_mm: Floats, half_length_mm: Floats, force_N_per_mm: Floats, problem: str = ""
) -> tuple[PatchStrips, ...]:
    """Split strips into a patch for each unbroken run of strips that carry load.

    All arrays are (n,); `problem` is given to each patch.
    """
    return tuple(
        PatchStrips(
            s_mm=s_mm[first : last + 1],
            width_mm=width_mm[first : last + 1],
            half_length_mm=half_length_mm[first : last + 1],
            force_N_per_mm=force_N_per_mm[first : last + 1],
            problem=problem,
        )
        for first, last in find_runs(force_N_per_mm > 0.0)
    )


def _find_deepest_points(overlap: Overlap) -> list[int]:
    """Indices of points that are in the rail and deeper than both neighbours."""
    depth = overlap.depth_mm
    inner = depth[1:-1]
    return [int(index) for index in np.flatnonzero((inner > depth[:-2]) & (inner >= depth[2:]) & (inner > 0.0)) + 1]


def _solve_ellipse(overlap: Overlap, point: int, contact_modulus_MPa: float) -> PatchStrips:
    """Hertz's spring and ellipse about a point of locally largest depth.

    Parameters
    ----------
    overlap
        Depth (mm) of the rigid overlap over s (mm), and its curvature along.
    point
        Index of the sample with the largest depth.
    contact_modulus_MPa
        E* of the pair.

    Returns
    -------
    PatchStrips
        Strips of the ellipse, with the force per width in N/mm. The curvature across is from a chord about the deepest
        point, and at least `_MIN_CURVATURE_PER_MM`.
    """
    s, depth = overlap.s_mm, overlap.depth_mm
    neighbours = slice(point - 1, point + 2)
    # the parabola through the point and its neighbours
    curvature, slope, _ = np.polyfit(s[neighbours] - s[point], depth[neighbours], 2)
    offset = -0.5 * slope / curvature
    centre, peak_depth = float(s[point] + offset), float(depth[point] - 0.25 * slope**2 / curvature)
    # only the deviation from the parabola is interpolated linearly: straight lines do not follow the parabola itself
    deviation = np.interp(
        [centre - _HALF_CHORD_MM, centre + _HALF_CHORD_MM], s, depth - peak_depth - curvature * (s - centre) ** 2
    )
    curvature_across = max(float(-2.0 * curvature - deviation.sum() / _HALF_CHORD_MM**2), _MIN_CURVATURE_PER_MM)
    curvature_along = float(np.interp(centre, s, overlap.curvature_along_per_mm))
    unit_ellipse = _solve_unit_ellipse(round(np.log(curvature_across / curvature_along), 12))
    # lengths scale with the curvature, and the stiffness of the spring with its inverse square root
    stiffness = contact_modulus_MPa * unit_ellipse.stiffness_N_per_mm15 / np.sqrt(curvature_along)
    force = stiffness * peak_depth**1.5
    scale = (force * curvature_along**2 / contact_modulus_MPa) ** (1.0 / 3.0) / curvature_along
    a, b = unit_ellipse.a_mm * scale, unit_ellipse.b_mm * scale
    positions = (np.arange(_ELLIPSE_STRIPS) + 0.5) * (2.0 / _ELLIPSE_STRIPS) - 1.0
    inside = 1.0 - positions**2
    share = inside / inside.sum()
    width = 2.0 * b / _ELLIPSE_STRIPS
    return PatchStrips(
        s_mm=centre + b * positions,
        width_mm=np.full(_ELLIPSE_STRIPS, width),
        half_length_mm=a * np.sqrt(inside),
        force_N_per_mm=force * share / width,
    )


@lru_cache(maxsize=4096)
def _solve_unit_ellipse(log_ratio: float) -> HertzContact:
    """Hertz's ellipse of curvatures 1 along and exp(log_ratio) across, modulus 1 and force 1."""
    return hertz_ellipse(0.5, 0.5 * float(np.exp(log_ratio)), normal_force_N=1.0, contact_modulus_MPa=1.0)
