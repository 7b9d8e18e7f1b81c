"""Where the patch will be: the true gap on a half-space, cheap enough to be solved before any mesh is made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import RectBivariateSpline
from scipy.ndimage import binary_dilation

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid, Field, Rung, in_bands
from fecontact.contact.halfspace import half_space_problem
from fecontact.contact.patch import standing_peaks
from fecontact.contact.solver import solve_contact
from fecontact.contact_theories.hertz import HertzContact
from fecontact.errors import ConvergenceError, InputError
from fecontact.placement.poses import TouchPoint
from fecontact.placement.wheel_on_rail import OPEN_GAP_MM, Placement

# --- How large the lobes of a contact are: elements are made for them, and nodes.

# Elements are made for the lobe that carries most, and at most so many times too large for the narrowest one: what the
# bodies add to a half-space is smooth below it, and its pressure is the nodes' matter. Measured at -0.5 mm and 5 mm of
# S1002 on 60E1 1:40, 100 kN: all measures with 1.5 to 2.5 elements per semi-axis of the narrow lobe are within 0.1 % of
# those with 6, for a tenth of the time; below that the load of the lobe moves.
_NARROWER = 2.5
# A lobe does not decide about the size of the elements at all if its peak is below this part of the highest one, or its
# load below that part of the whole.
_LESSER_PEAK = 0.5
_LESSER_LOAD = 0.1
# The same for the nodes.
_LEAST_LOAD = 0.002
# A peak is a lobe of its own if the pressure falls by this part of the highest peak on both sides of it.
_VALLEY = 0.05
# On nodes that are made for the lobes a peak so few of them from its valley is a step or a corner of a surface, which
# stays that few nodes wide on any: S1002 on 54E1 has one of half the highest peak 0.9 mm beside it at 4.07 mm, 50 kN.
_LEAST_NODES = 4
# Nodes follow a shallower one too: 16 on the semi-axis of the rest read 0.015 of a valley of 0.047 beside a thin lobe.
_LEAST_VALLEY = 0.01


def semi_axes_of_elements_mm(rung: Rung) -> tuple[float, float]:
    """Half length along x and smaller half width across that the elements below a contact are made for.

    The contact is on nodes that follow its lobes.
    """
    sizes = lobe_sizes(rung, least_nodes=_LEAST_NODES)
    along_x, across = (min(main, _NARROWER * least) for main, least in zip(sizes.main, sizes.narrowest, strict=True))
    return along_x, across


def narrowest_semi_axes_mm(rung: Rung) -> tuple[float, float]:
    """Half length along x and smaller half width across of the narrowest lobe of a contact, small ones left out.

    The contact is on nodes that follow its lobes.
    """
    return lobe_sizes(rung, least_nodes=_LEAST_NODES).narrowest


@dataclass(frozen=True, kw_only=True)
class LobeSizes:
    """Half length along x and smaller half width across (mm) of lobes.

    Of all that nodes follow, of large ones, and of the one that carries most.
    """

    every: list[tuple[float, float]]
    large: list[tuple[float, float]]
    main: tuple[float, float]

    @property
    def narrowest(self) -> tuple[float, float]:
        """Least half length and least half width of large ones."""
        return min(size[0] for size in self.large), min(size[1] for size in self.large)


@dataclass(frozen=True, kw_only=True)
class _Lobe:
    """Half length along x and smaller half width across (mm), height over the highest peak and part of the load."""

    size_mm: tuple[float, float]
    height: float
    part: float


def lobe_sizes(rung: Rung, *, least_nodes: int = 1) -> LobeSizes:
    """Sizes of the lobes of a contact; what is narrower than so many nodes from peak to valley is part of another."""
    lobes = _lobes(rung, _VALLEY, least_nodes)
    every = _lobes(rung, _LEAST_VALLEY, least_nodes)
    return LobeSizes(
        every=[lobe.size_mm for lobe in every if lobe.height == 1.0 or lobe.part >= _LEAST_LOAD],
        large=[
            lobe.size_mm
            for lobe in lobes
            if lobe.height == 1.0 or (lobe.height >= _LESSER_PEAK and lobe.part >= _LESSER_LOAD)
        ],
        main=max(lobes, key=lambda lobe: lobe.part).size_mm,
    )


def _lobes(rung: Rung, valley: float, least_nodes: int) -> list[_Lobe]:
    """Peaks across that stand out by a part of the highest one, each from valley to valley."""
    p, dx, cells = rung.pressure_MPa, rung.grid.steps_mm[0], rung.grid.cells_mm
    ridge = np.concatenate(([0.0], p.max(axis=0), [0.0]))
    line_load = np.concatenate(([0.0], p.sum(axis=0) * rung.grid.weights, [0.0]))
    top, load = float(ridge.max()), float(line_load.sum())
    peaks, _ = standing_peaks(ridge, valley)
    ends = _ends(ridge, peaks)
    wide = [k for k, (left, right) in enumerate(ends) if min(peaks[k] - left, right - peaks[k]) >= least_nodes]
    if 0 < len(wide) < len(peaks):
        peaks = peaks[wide]
        ends = _ends(ridge, peaks)
    found = []
    for peak, (left, right) in zip(peaks, ends, strict=True):
        rows = np.flatnonzero(p[:, peak - 1])
        length = (rows[-1] + 0.5) * dx if rung.grid.half else 0.5 * (rows[-1] - rows[0] + 1) * dx
        found.append(
            _Lobe(
                size_mm=(length, min(peak - left, right - peak) * float(cells[peak - 1])),
                height=float(ridge[peak]) / top,
                part=float(line_load[left:right].sum()) / load,
            )
        )
    return found


def _ends(ridge: NDArray[np.float64], peaks: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Of every peak the valleys on both sides, or where the contact ends."""
    zeros = np.flatnonzero(ridge == 0.0)
    valleys = [int(low + np.argmin(ridge[low:high])) for low, high in pairwise(peaks)]
    return [
        (max(int(zeros[zeros < peak][-1]), before), min(int(zeros[zeros > peak][0]), after))
        for peak, before, after in zip(peaks, [0, *valleys], [*valleys, ridge.size], strict=True)
    ]


# --- Contacts at the end of a line or on a corner of one, where a pressure has no finite value.

# A kink by less than this turns the surface less than a patch's own curvature does (5 mm on R 300: 0.017).
_CORNER_RAD = 0.02


def check_ends(placement: Placement, rung: Rung, gap_mm: Floats) -> None:
    """Refuse a contact at the end of the wheel's line, on a corner or an edge: its pressure has no bound there."""
    grid, in_contact = rung.grid, rung.pressure_MPa > 0.0
    _check_irregularity(placement, rung)
    if np.any(binary_dilation(gap_mm >= OPEN_GAP_MM, structure=np.ones((3, 3))) & in_contact):
        raise InputError(
            f"the contact reaches the end of the running surface of wheel {placement.wheel.profile.name};"
            " reduce the load, change the lateral shift, or give a longer profile line"
        )
    below = grid.s_mm[in_contact.any(axis=0)]
    for place in placement.junctions:
        profile, junction = place.profile, place.junction
        convex_corner = profile.convex_sign * junction.turn_rad > _CORNER_RAD
        # its own cell counts: the pressure ends at a corner that it cannot pass
        if convex_corner and below[0] - grid.steps_mm[1] <= place.s_mm <= below[-1] + grid.steps_mm[1]:
            raise InputError(
                f"the contact reaches a corner of {profile.kind} {profile.name} at y = {junction.y_mm:.2f} mm, where"
                " its pressure has no finite value; change the lateral shift, or round the corner in the profile"
            )


def _check_irregularity(placement: Placement, rung: Rung) -> None:
    """Refuse a contact on an edge of an irregularity, and one beyond the end of its table."""
    along, x, step = placement.along, rung.grid.x_mm + placement.first.x_mm, rung.grid.steps_mm[0]
    if along is None:
        return
    rows = np.flatnonzero((rung.pressure_MPa > 0.0).any(axis=1))
    low, high = float(x[rows[0]]) - step, float(x[rows[-1]]) + step
    if any(low < kink < high for kink in along.kinks_x_mm):
        raise InputError(
            f"an edge of the irregularity lies in the patch at {along.distance_mm:g} mm: the elastic pressure there has"
            " no bound, and no peak is given; round it by a haversine or a table with its radius, or take another"
            " distance"
        )
    if not along.covers(low, high):
        raise InputError(
            f"the contact at {along.distance_mm:g} mm reaches past the end of the irregularity's table; take another"
            " distance, or a longer table"
        )


# --- Angles of the planes in which patches of a contact press on a half-space, or of the normals along which they do.
#
# Meshes do not depend on them: elements are made for a contact in one plane, and finite bodies know their own surfaces.


def angle_of_patches(placement: Placement, rung: Rung) -> Floats:
    """Angle (ns,) in rad of the plane below each node: of its patch, across to the patch's resultant force.

    Between separate patches the nearer patch's plane counts; a single patch has one plane everywhere.
    """
    line_load, s = rung.pressure_MPa.sum(axis=0), rung.grid.s_mm
    below = np.flatnonzero(line_load)
    patches = np.split(below, np.flatnonzero(np.diff(below) > 1) + 1)
    angle = angle_of_normals(placement, s)
    planes = [
        np.arctan2((line_load * np.sin(angle))[own].sum(), (line_load * np.cos(angle))[own].sum()) for own in patches
    ]
    middles = [0.5 * (s[before[-1]] + s[after[0]]) for before, after in pairwise(patches)]
    return np.array(planes)[np.searchsorted(middles, s)]


def angle_of_normals(placement: Placement, s_mm: Floats) -> Floats:
    """Angle (ns,) in rad of the rail's normals at arc lengths from first touch (mm)."""
    _, normals = placement.surface(0.0, s_mm)
    return np.asarray(np.arctan2(-normals[:, 1], normals[:, 2]))


# --- Hertz's own gap on a discrete half-space: the rung that shows what the pressure nodes leave open.

# How far its grid reaches beyond Hertz's ellipse.
_REACH = 1.2


def quadratic_rung(touch: TouchPoint, hertz: HertzContact, *, half: bool, nodes: int = 16) -> Rung:
    """Solve the quadratic gap at a touch point on a half-space under Hertz's normal force; `nodes` per semi-axis."""
    hx, hs = (0.5 * extent / nodes for extent in (hertz.extent_x_mm, hertz.extent_y_mm))
    count = int(np.ceil(_REACH * nodes))
    # a third of a step beside the ellipse's centre: no node lies where the symmetry would favour it
    s = np.asarray(hs * (np.arange(-count, count + 1) + 1.0 / 3.0))
    x = np.asarray(hx * (np.arange(0, count + 1) if half else np.arange(-count, count + 1)))
    own = ContactGrid(x_mm=x, s_mm=s, half=half)
    h = touch.curvature
    gap = 0.5 * h.xx_per_mm * x[:, None] ** 2 + h.xy_per_mm * x[:, None] * s + 0.5 * h.yy_per_mm * s**2
    problem = half_space_problem(own, gap.ravel(), contact_modulus_MPa=hertz.contact_modulus_MPa)
    start = hertz.pressure_MPa(x[:, None], s).ravel()
    solution = solve_contact(problem, hertz.normal_force_N, start_MPa=start)
    return Rung.of(own, solution, approach_mm=solution.approach_mm)


# --- The contact of the true gap on a half-space, alone or with what finite bodies add to its opening.

# Above this contact angle a vertical load drives the bodies along each other by more than half of what it closes them:
# a gap whose points only come nearer then moves the patch by tenths of its width, and loses some of the load.
_STEEP_RAD = math.radians(30.0)
# Some 1e-5 of the pressure: a tenth of what the nodes leave open. For the next grid and the next slide less is enough.
TOLERANCE, _ROUGHLY = 1e-6, 1e-5
# Steps across at which surfaces beside the contact are looked at.
_STEP_MM = 0.25


@dataclass(frozen=True, kw_only=True, eq=False)
class TrueGap:
    """The gap between rail and wheel as they are, on a half-space of a contact modulus.

    Attributes
    ----------
    direction (3,)
        Unit vector along which the load acts and the bodies approach.
    slide_mm
        How far the wheel goes along the tangent at first touch under the load. Where it is not 0 it is the gap of the
        wheel after it, less what points that come nearer along the rail's normals see of it themselves.
    """

    placement: Placement
    contact_modulus_MPa: float
    direction: Floats
    slide_mm: float = 0.0
    # of the last two grids: a contact is solved on one more than once, with other planes or another opening
    _last: list[tuple[ContactGrid, Floats]] = field(default_factory=list, init=False, repr=False)

    @property
    def closing(self) -> float:
        """How much the gap at the first touch point closes when the bodies approach by 1."""
        return float(self.direction @ self.placement.first.normal)

    @property
    def is_steep(self) -> bool:
        """Whether the load drives the bodies along each other so far that it must be in the gap."""
        return abs(float(self.direction @ self.placement.first.tangent)) > math.sin(_STEEP_RAD)

    def after(self, approach_mm: float) -> TrueGap:
        """The gap after the slide that belongs to an approach along the contact normal."""
        along = float(self.direction @ self.placement.first.tangent)
        return replace(self, slide_mm=approach_mm / self.closing * along)

    def gap(self, x: ArrayLike, s: ArrayLike) -> Floats:
        """The gap (mm) along the rail's normals at x and s (mm from first touch), undeformed."""
        placement, slide = self.placement, self.slide_mm
        if slide == 0.0:
            return placement.gap(x, s)
        tangent = placement.first.tangent
        wheel = replace(placement.wheel, centre_mm=placement.wheel.centre_mm - slide * tangent)
        _, normals = placement.surface(x, s)
        return replace(placement, wheel=wheel).gap(x, s) + slide * (normals @ tangent)

    def on(self, grid: ContactGrid) -> Floats:
        """The gap (nx, ns) in mm on a grid of nodes, undeformed."""
        known = next((gap for own, gap in self._last if own is grid), None)
        if known is None:
            known = np.asarray(self.gap(grid.x_mm[:, None], grid.s_mm[None, :]))
            self._last[:] = [*self._last[-1:], (grid, known)]
        return known

    def solve(
        self,
        grid: ContactGrid,
        load_N: float,
        *,
        added: Field | None = None,
        start: Field | None = None,
        angle_rad: Floats | None = None,
        tolerance: float = TOLERANCE,
    ) -> Rung:
        """Contact on a grid of nodes.

        Pressures open a half-space in one plane, or along normals of these angles (ns,). `added` is what finite bodies
        open more than a half-space, on nodes of its own. It is smooth: a cubic spline carries it to the nodes, and
        beyond its own nodes it stays as it is at their edge. The iterations begin at `start`, a pressure of nearly
        this contact on nodes of its own.
        """
        _, normals = self.placement.surface(0.0, grid.s_mm)
        gap = self.on(grid)
        if added is not None:
            gap = gap + carried(added, grid.x_mm, grid.s_mm)
        problem = half_space_problem(
            grid,
            gap.ravel(),
            closing=np.tile(normals @ self.direction, grid.shape[0]),
            contact_modulus_MPa=self.contact_modulus_MPa,
            angle_rad=angle_rad,
        )
        first = None if start is None else carried(start, grid.x_mm, grid.s_mm, degree=1).ravel()
        solution = solve_contact(problem, load_N, start_MPa=first, tolerance=tolerance)
        upright = np.tile(normals @ self.placement.first.normal, grid.shape[0])
        return Rung.of(grid, solution, approach_mm=solution.approach_mm * self.closing, upright=upright)

    def overlaps_beyond(self, rung: Rung, added: Field) -> tuple[float, float] | None:
        """Where the bodies of a solved contact overlap beside its nodes: range of s (mm), None if they do nowhere.

        Beside the contact a half-space opens as under point forces; `added` stays as it is at the edge of its nodes.
        """
        s, line = self._surface_mm(), rung.grid.s_mm
        overlapping = self._overlapping(rung, s[(s < line[0]) | (s > line[-1])], added)
        return (float(overlapping.min()), float(overlapping.max())) if overlapping.size else None

    def overlaps_between(self, rung: Rung, added: Field | None = None) -> bool:
        """Whether the bodies of a contact that is solved in bands overlap between two of them, so that it goes on."""
        s, bands = self._surface_mm(), rung.grid.bands
        between = [s[(s > before.s_mm[-1]) & (s < after.s_mm[0])] for before, after in pairwise(bands)]
        return any(self._overlapping(rung, places, added).size > 0 for places in between)

    def _surface_mm(self) -> Floats:
        """Places all over the rail's surface (mm from first touch)."""
        placement = self.placement
        return np.arange(_STEP_MM, placement.rail.profile.length_mm, _STEP_MM) - placement.first_arc_length_mm

    def _overlapping(self, rung: Rung, s: Floats, added: Field | None) -> Floats:
        """Of places across without nodes those where the bodies of a solved contact overlap."""
        placement, grid, whole = self.placement, rung.grid, rung.pressure.whole()
        x = np.linspace(grid.x_mm[0], grid.x_mm[-1], 9)
        _, normals = placement.surface(0.0, s)
        gap = self.gap(x[:, None], s[None, :]) - rung.approach_mm / self.closing * (normals @ self.direction)
        # an opening only adds to it: most are ruled out without
        near = np.argwhere(gap < 0.0)
        if near.size == 0:
            return s[:0]
        force = whole.values * whole.grid.nodal_area_mm2().reshape(whole.grid.shape)
        i, j = np.nonzero(force)
        at_x, at_s = x[near[:, 0]], s[near[:, 1]]
        distance = np.hypot(at_x[:, None] - whole.grid.x_mm[i], at_s[:, None] - whole.grid.s_mm[j])
        opening = (force[i, j] / distance).sum(axis=1) / (np.pi * self.contact_modulus_MPa)
        if added is not None:
            lines = (at_x, added.grid.x_mm), (at_s, added.grid.s_mm)
            opening += _spline(added).ev(*(np.clip(at, line[0], line[-1]) for at, line in lines))
        return np.asarray(at_s[gap[near[:, 0], near[:, 1]] + opening < 0.0])


def carried(field: Field, x_mm: Floats, s_mm: Floats, *, degree: int = 3) -> Floats:
    """A smooth field at other places (nx, ns): a spline, cubic or linear, beyond its nodes the value at their edge."""
    x, s = field.grid.x_mm, field.grid.s_mm
    return np.asarray(_spline(field, degree)(np.clip(x_mm, x[0], x[-1]), np.clip(s_mm, s[0], s[-1])))


def _spline(field: Field, degree: int = 3) -> RectBivariateSpline:
    return RectBivariateSpline(field.grid.x_mm, field.grid.s_mm, field.values, kx=degree, ky=degree)


# --- Where the patch will be: the true gap on a half-space, cheap enough to be solved before any mesh is made.

_COARSE_STEP_S_MM = 0.2
_COARSE_NODES_X = 25
# Nodes follow a small lobe down to so much of what the others need.
_FINEST = 0.25
# Parts of its nodes with which the contact is solved one after the other, each grid made to fit the contact before it.
_FITS = (1.0, 1.0)
# On the flange root (S1002 on 60E1, 6.3 mm, 60 kN) the slides of four approaches are 9, 0.6, 0.03 and 0.002 % off.
_FITS_AFTER_SLIDES = (0.5, 0.5, 1.0)
# Planes below separate patches are those of the contact on coarser nodes. What they turn by on finer ones changes what
# one patch does to another one by less than this part, and that is some per cent of what it does to itself.
_SAME_PLANE_RAD = 5e-3
# Patches with more free surface between them than so many times the wider one's half width are far apart: each has
# elements of its own.
_FAR_APART = 1.0
# Seconds per solution, beyond it minutes; two patches of S1002 on 60E1 take up to 184 thousand.
MOST_NODES = 200_000
"""Nodes of half a model that are solved at most."""
# Patches far apart have a band of nodes each where one grid would need more than so much of them.
_ONE_BAND = 0.1
# Free nodes beside the contact in a band: an edge is read from five of them.
_RIM = 6.0
# Patches are apart by more than half of their least cell.
_SEEN_APART = 0.5
# How much longer steps are made where nodes would be too many, as nodes of the rim around a patch come on top; the
# longer one where the first is not enough.
_RIMS = (1.02, 1.05)
FEWEST_NODES = 8.0
"""Nodes that are left to lobes where all of them would be more than are solved."""
# Nodes that are not nearer to one another than this part of the distance before are no more of them.
_NO_MORE = 0.85


@dataclass(frozen=True, kw_only=True)
class ExpectedPart:
    """A patch far from all others: from where to where across (mm), and how many times larger its elements may be.

    `semi_axes_mm` are its own half length along x and smaller half width across.
    """

    s_low_mm: float
    s_high_mm: float
    larger: float
    semi_axes_mm: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class ExpectedPatch:
    """Where the patch will be on the rail's surface (mm, from the first touch point), and its contact on a half-space.

    Attributes
    ----------
    x_low_mm, x_high_mm, s_low_mm, s_high_mm
        Its bounding box.
    semi_axis_x_mm, semi_axis_s_mm
        Half length and smaller half width that elements are made for: of the lobe that carries most, where it is not
        much wider than the narrowest one; small ones are left out.
    true_gap
        The gap under the load, with the slide of the bodies on a steep surface.
    half_space
        Contact of that gap on a half-space, with 32 nodes or more on each semi-axis, of small lobes too. Separate
        patches have a plane each.
    parts
        Patches far apart, from the gauge side on; a single patch if none are.
    """

    x_low_mm: float
    x_high_mm: float
    s_low_mm: float
    s_high_mm: float
    semi_axis_x_mm: float
    semi_axis_s_mm: float
    true_gap: TrueGap
    half_space: Rung
    parts: tuple[ExpectedPart, ...]

    def joined(self) -> ExpectedPatch:
        """Expected patch as if its parts were not far apart, with equal elements for all of them."""
        whole = ExpectedPart(
            s_low_mm=self.s_low_mm,
            s_high_mm=self.s_high_mm,
            larger=1.0,
            semi_axes_mm=(self.semi_axis_x_mm, self.semi_axis_s_mm),
        )
        return replace(self, parts=(whole,))


def expected_patch(
    true_gap: TrueGap,
    load_N: float,
    *,
    half: bool,
    nodes: int = 16,
    most: int | None = None,
    guess_mm: float = 0.1,
    tolerance: float = TOLERANCE,
) -> ExpectedPatch:
    """Solve the true gap on a half-space over all of the surface in reach, then again on a grid that fits the patch.

    On a steep surface the bodies slide along each other: each solution has the slide of the approach before it.

    Parameters
    ----------
    nodes
        Of the grid, on the narrowest semi-axis of the patch.
    most
        Nodes of half a model, `MOST_NODES` if not given; the narrowest lobes get fewer of them where there would be
        more.
    guess_mm
        First guess of the approach; enlarged until the patch cannot reach further.
    tolerance
        Bound of the last solution's residuals relative to the approach.

    Raises
    ------
    InputError
        If the patch reaches the end of a running surface, or a corner of one.
    ConvergenceError
        If the patch grows without bound, or its contact is not found.
    """
    gap, rung = true_gap, _on_coarse(true_gap, load_N, half=half, guess_mm=guess_mm)
    if gap.is_steep:
        gap = gap.after(rung.approach_mm)
        rung = _on_coarse(gap, load_N, half=half, guess_mm=guess_mm)
    *fits, last = _FITS_AFTER_SLIDES if gap.is_steep else _FITS
    for share in fits:
        gap = gap.after(rung.approach_mm) if gap.is_steep else gap
        rung = _on_fitted(gap, rung, load_N, nodes=round(share * nodes), most=most, tolerance=_ROUGHLY)
    gap = gap.after(rung.approach_mm) if gap.is_steep else gap
    before = rung
    planes = before if np.ptp(angle_of_patches(gap.placement, before)) > 0.0 else None
    rung = _on_fitted(gap, before, load_N, nodes=round(last * nodes), most=most, planes=planes, tolerance=tolerance)
    if gap.overlaps_between(rung):
        before = rung
        rung = _solve(gap, before.even().grid, load_N, start=before.pressure, planes=before, tolerance=tolerance)
    turned = angle_of_patches(gap.placement, rung) - _angle_below(gap, rung.grid, before)
    if np.ptp(turned[rung.pressure_MPa.any(axis=0)]) > _SAME_PLANE_RAD:
        rung = _solve(gap, rung.grid, load_N, start=rung.pressure, planes=rung, tolerance=tolerance)
    return _patch_of(gap, rung)


def on_more_nodes(expected: ExpectedPatch, load_N: float, *, nodes: int) -> Rung:
    """The half-space of an expected patch once more, on so many nodes per semi-axis.

    Raises
    ------
    ConvergenceError
        If those would be too many, or the contact is not found on them.
    """
    grid = _fitted_grid(expected.half_space, nodes)
    step, own = grid.steps_mm[1], expected.half_space.grid.steps_mm[1]
    if step > _NO_MORE * own:
        raise ConvergenceError(f"more nodes than {own:.2g} mm apart would be too many")
    return _again_on(expected, grid, load_N)


def on_fewer_nodes(expected: ExpectedPatch, load_N: float, *, fewer: float) -> Rung:
    """The half-space of an expected patch in one band once more, on nodes so many times farther apart.

    Raises
    ------
    ConvergenceError
        If it is in several bands, or the contact is not found on them.
    """
    grid = expected.half_space.grid
    if len(grid.bands) > 1:
        raise ConvergenceError("fewer nodes: patches far apart have bands of nodes of their own")
    x, s = (
        line[0] + fewer * step * np.arange(math.ceil(np.ptp(line) / (fewer * step)) + 1)
        for line, step in zip((grid.x_mm, grid.s_mm), grid.steps_mm, strict=True)
    )
    return _again_on(expected, ContactGrid(x_mm=np.asarray(x), s_mm=np.asarray(s), half=grid.half), load_N)


def _again_on(expected: ExpectedPatch, grid: ContactGrid, load_N: float) -> Rung:
    gap, rung = expected.true_gap, expected.half_space
    return _solve(gap, grid, load_N, start=rung.pressure, planes=rung)


def _on_coarse(true_gap: TrueGap, load_N: float, *, half: bool, guess_mm: float) -> Rung:
    """The contact on coarse nodes over all of the surface in reach."""
    reach = guess_mm
    for _ in range(12):
        grid = _coarse_grid(true_gap, reach, half=half)
        rung = _solve(true_gap, grid, load_N, tolerance=_ROUGHLY)
        approach = rung.approach_mm / true_gap.closing
        if approach < reach:
            return rung
        reach = 1.3 * approach
    raise ConvergenceError(
        f"the patch grows without bound under {load_N:g} N: the bodies conform all over; reduce the load"
    )


def _coarse_grid(true_gap: TrueGap, reach_mm: float, *, half: bool) -> ContactGrid:
    (x_low, x_high), (s_low, s_high) = _region(true_gap, reach_mm, half)
    x = np.linspace(0.0 if half else x_low, x_high, _COARSE_NODES_X if half else 2 * _COARSE_NODES_X - 1)
    s = np.linspace(s_low, s_high, max(33, int(np.ceil((s_high - s_low) / _COARSE_STEP_S_MM)) + 1))
    return ContactGrid(x_mm=x, s_mm=s, half=half)


def _on_fitted(
    true_gap: TrueGap,
    rung: Rung,
    load_N: float,
    *,
    nodes: int,
    most: int | None,
    planes: Rung | None = None,
    tolerance: float = TOLERANCE,
) -> Rung:
    """Contact on a grid that fits a contact on coarser nodes, with room for one of their steps where it is cut off.

    In planes of their own patches press less on each other, and reach further: there is room at once.
    """
    fitted = rung
    for room in ((0.0, 0.0), rung.grid.steps_mm)[planes is not None :]:
        grid = _fitted_grid(rung, nodes, room, most=most)
        fitted = _solve(true_gap, grid, load_N, start=rung.pressure, planes=planes, tolerance=tolerance)
        p = fitted.pressure_MPa
        ends = (p[:, 0], p[:, -1], p[-1], p[0] if not fitted.grid.half else np.zeros(1))
        if not any(end.any() for end in ends):
            break
    return fitted


def _solve(
    true_gap: TrueGap,
    grid: ContactGrid,
    load_N: float,
    *,
    start: Field | None = None,
    planes: Rung | None = None,
    tolerance: float = TOLERANCE,
) -> Rung:
    """Contact on a grid, from a guess; refused where it ends at the end of a line or on a corner, or is not found.

    In one plane for all patches, or in those below the patches of a contact that is known.
    """
    angle = None if planes is None else _angle_below(true_gap, grid, planes)
    rung = true_gap.solve(grid, load_N, start=start, angle_rad=angle, tolerance=tolerance)
    check_ends(true_gap.placement, rung, true_gap.on(grid))
    if rung.status != "converged":
        raise ConvergenceError(
            f"the contact on a half-space of {grid.shape[0]} by {grid.shape[1]} nodes did not converge (residual"
            f" {rung.residual:.1e} of the approach); another load or lateral shift may go"
        )
    return rung


def _angle_below(true_gap: TrueGap, grid: ContactGrid, planes: Rung) -> Floats:
    """Angle (ns,) in rad of the planes below the patches of another contact, at each column of a grid."""
    return np.asarray(np.interp(grid.s_mm, planes.grid.s_mm, angle_of_patches(true_gap.placement, planes)))


def _region(true_gap: TrueGap, reach: float, half: bool) -> tuple[tuple[float, float], tuple[float, float]]:
    """Bounding box of the surface that comes together when the bodies approach rigidly by `reach`."""
    placement = true_gap.placement
    profile, origin = placement.rail.profile, placement.first_arc_length_mm
    height = 0.0 if placement.along is None else placement.along.height_mm
    width = 1.3 * np.sqrt(2.0 * placement.wheel.rolling_radius_mm * (reach + height))
    x = np.linspace(0.0 if half else -width, width, 15 if half else 29)
    # the profile's own sides and junction steps lie beyond any contact of running wheels
    s = np.arange(1e-6, profile.length_mm, _COARSE_STEP_S_MM) - origin
    _, normals = placement.surface(0.0, s)
    # nothing is near where the gap is twice as wide in the middle: a yawed wheel is lowest by a millimetre beside it
    columns = np.flatnonzero(true_gap.gap(0.0, s) <= 2.0 * (reach + height))
    near = true_gap.gap(x[:, None], s[None, columns]) <= reach * (normals[columns] @ true_gap.direction)
    rows, columns = np.flatnonzero(near.any(axis=1)), columns[near.any(axis=0)]
    if columns.size == 0:
        return (-width, width), (-1.0, 1.0)
    if columns[0] == 0 or columns[-1] == s.size - 1:
        raise InputError(
            f"the contact reaches the end of the running surface of rail {profile.name}; reduce the load or the"
            " lateral shift, or give a longer profile line"
        )
    dx = x[1] - x[0]
    return (x[rows[0]] - dx, x[rows[-1]] + dx), (s[columns[0]] - _COARSE_STEP_S_MM, s[columns[-1]] + _COARSE_STEP_S_MM)


def _fitted_grid(
    rung: Rung, nodes: int, room_mm: tuple[float, float] = (0.0, 0.0), *, most: int | None = None
) -> ContactGrid:
    grid, sizes = rung.grid, lobe_sizes(rung)
    (x_low, x_high), (s_low, s_high) = _bounds(rung)
    followed = followed_mm(sizes)
    step_x, step_s = (length / nodes for length in followed)
    models = 1 if grid.half else 2
    asked, full = models * (most or MOST_NODES), models * MOST_NODES
    area = (x_high - x_low) * (s_high - s_low) / (step_x * step_s)
    if area > _ONE_BAND * full and len(parts := _far_apart(rung)) > 1:
        banded = _grid_in_bands(rung, parts, nodes)
        if math.prod(banded.shape) <= asked:
            return banded
    # the least lobes get fewer nodes where all of them would be too many, large ones where that is not enough
    for limit, of_large in ((asked, nodes), (full, nodes), (full, FEWEST_NODES)):
        for rim in _RIMS:
            fewer = min(max(1.0, rim * math.sqrt(area / limit)), nodes / FEWEST_NODES)
            along_x, across = (
                max(step, min(fewer * step, min(large) / of_large))
                for step, large in zip((step_x, step_s), zip(*sizes.large, strict=True), strict=True)
            )
            room_x, room_s = (max(3.0 * step, room) for step, room in zip((along_x, across), room_mm, strict=True))
            first_x = 0.0 if grid.half else x_low - room_x
            first_s = s_low - room_s
            count_x = int(np.ceil((x_high + room_x - first_x) / along_x))
            count_s = int(np.ceil((s_high + room_s - first_s) / across))
            if count_x * count_s <= full:
                return ContactGrid(
                    x_mm=np.asarray(first_x + along_x * np.arange(count_x + 1)),
                    s_mm=np.asarray(first_s + across * np.arange(count_s + 1)),
                    half=grid.half,
                )
    lobe = FEWEST_NODES * across
    raise ConvergenceError(
        f"a lobe of the contact is {lobe:.2g} mm from its peak to a valley, in a patch {s_high - s_low:.1f} mm wide:"
        f" nodes that follow it would be {count_x} by {count_s}, and at most {full} are solved, which"
        f" {lobe * count_x * count_s / full:.2g} mm or more need; give a lateral shift 0.2 mm beside it, or another"
        " load"
    )


def _grid_in_bands(rung: Rung, parts: Sequence[Rung], nodes: int) -> ContactGrid:
    """A band for each of several patches far apart, whose nodes follow its own lobes across.

    Fewer nodes, but some, are below lobes that are narrower than others by `_FINEST`, and along x, where all bands have
    the same rows, below patches with little load. Steps across are whole numbers of the least one, so that nodes of all
    bands lie on one line of equal steps.
    """
    (x_low, x_high), half, large_s = _bounds(rung)[0], rung.grid.half, min(size[1] for size in lobe_sizes(rung).large)
    followed = [followed_mm(lobe_sizes(part)) for part in parts]
    loads = [float(part.pressure_MPa.sum(axis=0) @ rung.grid.weights) for part in parts]
    counts = [nodes if load >= _LESSER_LOAD * sum(loads) else FEWEST_NODES for load in loads]
    along_x = min(size[0] / count for size, count in zip(followed, counts, strict=True))
    first_x = 0.0 if half else x_low - 3.0 * along_x
    count_x = int(np.ceil((x_high + 3.0 * along_x - first_x) / along_x))
    ends = [_bounds(part)[1] for part in parts]
    steps = [
        min(max(across, _FINEST * large_s) / nodes, 0.5 * (high - low) / FEWEST_NODES)
        for (_, across), (low, high) in zip(followed, ends, strict=True)
    ]
    least, lines = min(steps), []
    for part, step, (low, high) in zip(parts, steps, ends, strict=True):
        own = least * math.floor(step / least * (1.0 + 1e-9))
        # where a coarser node was free the contact may begin
        room = max(_RIM * own, float(part.grid.cells_mm[part.pressure_MPa.any(axis=0)].max()))
        first = own * math.floor((low - room) / own)
        lines.append(np.asarray(first + own * np.arange(math.ceil((high + room - first) / own) + 1)))
    return in_bands(np.asarray(first_x + along_x * np.arange(count_x + 1)), lines, half=half)


def followed_mm(sizes: LobeSizes) -> tuple[float, float]:
    """Half length along x and half width across of the least lobes that nodes are made for."""
    along_x, across = (
        max(min(every), _FINEST * min(large))
        for every, large in zip(zip(*sizes.every, strict=True), zip(*sizes.large, strict=True), strict=True)
    )
    return along_x, across


def _patch_of(true_gap: TrueGap, rung: Rung) -> ExpectedPatch:
    (x_low, x_high), (s_low, s_high) = _bounds(rung)
    semi_axis_x, semi_axis_s = semi_axes_of_elements_mm(rung)
    return ExpectedPatch(
        x_low_mm=x_low,
        x_high_mm=x_high,
        s_low_mm=s_low,
        s_high_mm=s_high,
        semi_axis_x_mm=semi_axis_x,
        semi_axis_s_mm=semi_axis_s,
        true_gap=true_gap,
        half_space=rung,
        parts=_parts(rung, semi_axis_s),
    )


def _parts(rung: Rung, semi_axis_s: float) -> tuple[ExpectedPart, ...]:
    """Patches far apart, from the gauge side on; `semi_axis_s` across sizes the elements of the narrowest."""
    found = []
    for alone in _far_apart(rung):
        own, (_, (s_low, s_high)) = semi_axes_of_elements_mm(alone), _bounds(alone)
        part = ExpectedPart(s_low_mm=s_low, s_high_mm=s_high, larger=max(1.0, own[1] / semi_axis_s), semi_axes_mm=own)
        found.append(part)
    return tuple(found)


def _far_apart(rung: Rung) -> list[Rung]:
    """The contact of each of several patches far apart by itself, from the gauge side on."""
    # in least cells, of which rounding makes no part
    ends = np.round((rung.grid.s_mm - rung.grid.s_mm[0]) / rung.grid.steps_mm[1] + 0.5 * rung.grid.weights, 6)
    starts = np.round(ends - rung.grid.weights, 6)
    below = np.flatnonzero(rung.pressure_MPa.any(axis=0))
    parts: list[tuple[int, int]] = []
    for patch in np.split(below, np.flatnonzero(starts[below[1:]] - ends[below[:-1]] > _SEEN_APART) + 1):
        first, last = int(patch[0]), int(patch[-1])
        # joined to those before it as long as the surface between is too short
        while parts and starts[first] - ends[parts[-1][1]] <= 0.5 * _FAR_APART * max(
            ends[last] - starts[first], ends[parts[-1][1]] - starts[parts[-1][0]]
        ):
            first = parts.pop()[0]
        parts.append((first, last))
    columns = np.arange(rung.grid.s_mm.size)
    inside = [(columns >= first) & (columns <= last) for first, last in parts]
    return [replace(rung, pressure_MPa=np.where(own, rung.pressure_MPa, 0.0)) for own in inside]


def _bounds(rung: Rung) -> tuple[tuple[float, float], tuple[float, float]]:
    """Bounding box of the contact, along x and across."""
    x, s, cells, p = rung.grid.x_mm, rung.grid.s_mm, rung.grid.cells_mm, rung.pressure_MPa
    dx = rung.grid.steps_mm[0]
    rows, columns = np.flatnonzero(p.any(axis=1)), np.flatnonzero(p.any(axis=0))
    x_high = float(x[rows[-1]] + 0.5 * dx)
    x_low = -x_high if rung.grid.half else float(x[rows[0]] - 0.5 * dx)
    first, last = columns[0], columns[-1]
    return (x_low, x_high), (float(s[first] - 0.5 * cells[first]), float(s[last] + 0.5 * cells[last]))
