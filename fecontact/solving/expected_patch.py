"""Where the patch will be: the true gap on a half-space, cheap enough to be solved before any mesh is made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid, Field, Rung, in_bands
from fecontact.errors import ConvergenceError, InputError
from fecontact.solving.contact_ends import check_ends
from fecontact.solving.lobe_sizes import LESSER_LOAD, LobeSizes, lobe_sizes, semi_axes_of_elements_mm
from fecontact.solving.plane_angles import angle_of_patches
from fecontact.solving.true_gap import ROUGH_TOLERANCE, TOLERANCE, TrueGap

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
        rung = _on_fitted(gap, rung, load_N, nodes=round(share * nodes), most=most, tolerance=ROUGH_TOLERANCE)
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
        rung = _solve(true_gap, grid, load_N, tolerance=ROUGH_TOLERANCE)
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
    # surfaces that face away from the approach open when the bodies approach; gaps along their normals mean nothing
    closing = normals @ true_gap.direction
    columns = np.flatnonzero((closing > 0.0) & (true_gap.gap(0.0, s) <= 2.0 * (reach + height)))
    near = true_gap.gap(x[:, None], s[None, columns]) <= reach * closing[columns]
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
    counts = [nodes if load >= LESSER_LOAD * sum(loads) else FEWEST_NODES for load in loads]
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
