"""Expected patch of a load: the true gap on a half-space, solved before any mesh is made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid, Field, Rung, build_banded_grid
from fecontact.errors import ConvergenceError, InputError
from fecontact.solving.contact_ends import check_ends
from fecontact.solving.lobe_sizes import (
    SMALL_LOAD_FRACTION,
    LobeSizes,
    measure_element_semi_axes_mm,
    measure_lobe_sizes,
)
from fecontact.solving.plane_angles import compute_plane_angles
from fecontact.solving.quadratic_gap import DEFAULT_NODES
from fecontact.solving.true_gap import ROUGH_TOLERANCE, TOLERANCE, TrueGap

# --- Expected patch: the true gap on a half-space, which takes little time compared with meshes.

_COARSE_STEP_S_MM = 0.2
_COARSE_NODES_X = 25
# Least size of a small lobe that the nodes resolve, as a fraction of the size of the other lobes.
_LEAST_RESOLVED_FRACTION = 0.25
# Fractions of the nodes with which the contact is solved in turn; each grid fits the contact before it.
_FIT_FRACTIONS = (1.0, 1.0)
# Fractions for steep surfaces. On the flange root (S1002 on 60E1, 6.3 mm, 60 kN) the errors of the slides of four
# approaches are 9, 0.6, 0.03 and 0.002 %.
_STEEP_FIT_FRACTIONS = (0.5, 0.5, 1.0)
# Planes below separate patches are taken from the contact on coarser nodes. If a plane turns by less than this angle on
# finer nodes, the effect of a patch on another patch changes by less than this fraction, and this effect is some per
# cent of the effect of the patch on itself.
_PLANE_TOLERANCE_RAD = 5e-3
# Patches are at a large distance if the free surface between them is larger than this multiple of the wider patch's
# half width. Each of these patches has separate elements.
_SEPARATION_RATIO = 1.0
# Up to this number a solution takes seconds, beyond it minutes; two patches of S1002 on 60E1 take up to 184 thousand.
MOST_NODES = 200_000
"""Largest number of nodes of half a model that is solved."""
# Patches at a large distance have a band of nodes each if a single grid would need more than this fraction of the
# nodes.
_SINGLE_BAND_FRACTION = 0.1
# Free nodes outside the contact in a band: an edge is read from five of them.
_RIM_NODES = 6.0
# Least distance of separate patches in units of their least cell.
_SEPARATION_CELLS = 0.5
# Factors on the grid spacing if there would be too many nodes, since the nodes of the rim around a patch are added. The
# larger factor is used if the smaller factor is not sufficient.
_STEP_FACTORS = (1.02, 1.05)
FEWEST_NODES = 8.0
"""Number of nodes that remain for lobes if all requested nodes would be too many."""
# If a grid cuts off the contact, the room around the contact is doubled at most this number of times. Of 600 random
# positions of the library, two need a second grid and one needs a third.
_MAX_ROOM_DOUBLINGS = 5
# A new grid must have less than this fraction of the present grid spacing; if not, it does not have more nodes.
_LARGEST_SPACING_RATIO = 0.85


@dataclass(frozen=True, kw_only=True)
class DistantPatch:
    """Patch at a large distance from all other patches.

    Attributes
    ----------
    s_low_mm, s_high_mm
        Lateral limits from the first contact point.
    larger
        Factor by which the elements may be wider than below the narrowest patch.
    semi_axes_mm
        Half length along x and smaller half width of the patch.
    """

    s_low_mm: float
    s_high_mm: float
    larger: float
    semi_axes_mm: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class ExpectedPatch:
    """Expected patch on the rail's surface, with its half-space contact.

    Attributes
    ----------
    x_low_mm, x_high_mm, s_low_mm, s_high_mm
        Bounding box of the patch.
    semi_axis_x_mm, semi_axis_s_mm
        Half length and smaller half width for the size of the elements: of the lobe with the largest load, if it is not
        much wider than the narrowest lobe; small lobes are left out.
    true_gap
        Gap under the load, with the slide of the bodies on a steep surface.
    half_space
        Contact of that gap on a half-space, with at least 32 nodes on each semi-axis, also of small lobes. Separate
        patches have a plane each.
    parts
        Patches at a large distance, from the gauge side on; a single entry if there are no such patches.
    """

    x_low_mm: float
    x_high_mm: float
    s_low_mm: float
    s_high_mm: float
    semi_axis_x_mm: float
    semi_axis_s_mm: float
    true_gap: TrueGap
    half_space: Rung
    parts: tuple[DistantPatch, ...]

    def joined(self) -> ExpectedPatch:
        """Expected patch without distant patches, with equal elements everywhere.

        Returns
        -------
        ExpectedPatch
            Patch with a single stretch of elements.
        """
        whole_patch = DistantPatch(
            s_low_mm=self.s_low_mm,
            s_high_mm=self.s_high_mm,
            larger=1.0,
            semi_axes_mm=(self.semi_axis_x_mm, self.semi_axis_s_mm),
        )
        return replace(self, parts=(whole_patch,))


def find_expected_patch(
    true_gap: TrueGap,
    load_N: float,
    *,
    half: bool,
    nodes: int = DEFAULT_NODES,
    most: int | None = None,
    guess_mm: float = 0.1,
    tolerance: float = TOLERANCE,
) -> ExpectedPatch:
    """Solve the true gap on a half-space, in steps to a fitting grid.

    The first grid covers the whole surface in reach. On a steep surface the bodies slide along each other: each
    solution has the slide of the approach before it.

    Parameters
    ----------
    true_gap
        True gap without slide.
    load_N
        Load in N.
    half
        Whether the grids cover only x >= 0, by symmetry.
    nodes
        Number of nodes of the grid on the narrowest semi-axis of the patch.
    most
        Largest number of nodes of half a model, `MOST_NODES` if not given; the narrowest lobes have fewer nodes if
        there would be more.
    guess_mm
        First guess of the approach; it is enlarged until the patch cannot reach further.
    tolerance
        Bound of the last solution's residuals relative to the approach (-).

    Returns
    -------
    ExpectedPatch
        Patch with its half-space contact.

    Raises
    ------
    InputError
        If the patch reaches the end of a running surface, or a corner of a running surface.
    ConvergenceError
        If the patch grows without bound, or if its contact is not found.
    """
    gap, rung = true_gap, _solve_on_coarse_grid(true_gap, load_N, half=half, guess_mm=guess_mm)
    if gap.is_steep:
        gap = gap.after(rung.approach_mm)
        rung = _solve_on_coarse_grid(gap, load_N, half=half, guess_mm=guess_mm)
    *first_fractions, last_fraction = _STEEP_FIT_FRACTIONS if gap.is_steep else _FIT_FRACTIONS
    for fraction in first_fractions:
        gap = gap.after(rung.approach_mm) if gap.is_steep else gap
        rung = _solve_on_fitted_grid(
            gap, rung, load_N, nodes=round(fraction * nodes), most=most, tolerance=ROUGH_TOLERANCE
        )
    gap = gap.after(rung.approach_mm) if gap.is_steep else gap
    previous_rung = rung
    planes = previous_rung if np.ptp(compute_plane_angles(gap.placement, previous_rung)) > 0.0 else None
    rung = _solve_on_fitted_grid(
        gap, previous_rung, load_N, nodes=round(last_fraction * nodes), most=most, planes=planes, tolerance=tolerance
    )
    if gap.overlaps_between(rung):
        previous_rung = rung
        rung = _solve(
            gap,
            previous_rung.even().grid,
            load_N,
            start=previous_rung.pressure,
            planes=previous_rung,
            tolerance=tolerance,
        )
    turn_rad = compute_plane_angles(gap.placement, rung) - _interpolate_plane_angle(gap, rung.grid, previous_rung)
    if np.ptp(turn_rad[rung.pressure_MPa.any(axis=0)]) > _PLANE_TOLERANCE_RAD:
        rung = _solve(gap, rung.grid, load_N, start=rung.pressure, planes=rung, tolerance=tolerance)
    if _is_cut_off(rung):
        rung = _solve_on_fitted_grid(gap, rung, load_N, nodes=nodes, most=most, planes=rung, tolerance=tolerance)
    return _make_expected_patch(gap, rung)


def solve_on_more_nodes(expected: ExpectedPatch, load_N: float, *, nodes: int) -> Rung:
    """Solve the half-space of an expected patch again, on more nodes per semi-axis.

    Parameters
    ----------
    expected
        Expected patch.
    load_N
        Load in N.
    nodes
        Number of nodes per semi-axis.

    Returns
    -------
    Rung
        Contact on the new nodes.

    Raises
    ------
    ConvergenceError
        If there would be too many nodes, or if the contact is not found on them.
    """
    grid = _make_fitted_grid(expected.half_space, nodes)
    spacing_mm, present_spacing_mm = grid.steps_mm[1], expected.half_space.grid.steps_mm[1]
    if spacing_mm > _LARGEST_SPACING_RATIO * present_spacing_mm:
        raise ConvergenceError(f"more nodes: a spacing below {present_spacing_mm:.2g} mm needs too many nodes")
    return _solve_again(expected, grid, load_N)


def solve_on_fewer_nodes(expected: ExpectedPatch, load_N: float, *, fewer: float) -> Rung:
    """Solve the half-space of an expected patch in a single band again, on fewer nodes.

    Parameters
    ----------
    expected
        Expected patch.
    load_N
        Load in N.
    fewer
        Factor on the grid spacing.

    Returns
    -------
    Rung
        Contact on the new nodes.

    Raises
    ------
    ConvergenceError
        If the patch is in several bands, or if the contact is not found.
    """
    grid = expected.half_space.grid
    if len(grid.bands) > 1:
        raise ConvergenceError("fewer nodes: not possible for distant patches, which have separate bands of nodes")
    x_mm, s_mm = (
        positions_mm[0] + fewer * spacing_mm * np.arange(math.ceil(np.ptp(positions_mm) / (fewer * spacing_mm)) + 1)
        for positions_mm, spacing_mm in zip((grid.x_mm, grid.s_mm), grid.steps_mm, strict=True)
    )
    return _solve_again(expected, ContactGrid(x_mm=np.asarray(x_mm), s_mm=np.asarray(s_mm), half=grid.half), load_N)


def _solve_again(expected: ExpectedPatch, grid: ContactGrid, load_N: float) -> Rung:
    gap, rung = expected.true_gap, expected.half_space
    return _solve(gap, grid, load_N, start=rung.pressure, planes=rung)


def _solve_on_coarse_grid(true_gap: TrueGap, load_N: float, *, half: bool, guess_mm: float) -> Rung:
    """Solve the contact on coarse nodes over the whole surface in reach.

    `guess_mm` is a first guess of the rigid approach in mm; the grid grows until it covers the solved approach.

    Raises
    ------
    ConvergenceError
        If the approach exceeds the reach on all of 12 grids.
    """
    reach_mm = guess_mm
    for _ in range(12):
        grid = _make_coarse_grid(true_gap, reach_mm, half=half)
        rung = _solve(true_gap, grid, load_N, tolerance=ROUGH_TOLERANCE)
        approach_mm = rung.approach_mm / true_gap.closing
        if approach_mm < reach_mm:
            return rung
        reach_mm = 1.3 * approach_mm
    raise ConvergenceError(
        f"the patch grows without bound under {load_N:g} N: the surfaces conform everywhere; reduce the load"
    )


def _make_coarse_grid(true_gap: TrueGap, reach_mm: float, *, half: bool) -> ContactGrid:
    (x_low_mm, x_high_mm), (s_low_mm, s_high_mm) = _find_near_region(true_gap, reach_mm, half)
    x_mm = np.linspace(0.0 if half else x_low_mm, x_high_mm, _COARSE_NODES_X if half else 2 * _COARSE_NODES_X - 1)
    s_mm = np.linspace(s_low_mm, s_high_mm, max(33, int(np.ceil((s_high_mm - s_low_mm) / _COARSE_STEP_S_MM)) + 1))
    return ContactGrid(x_mm=x_mm, s_mm=s_mm, half=half)


def _solve_on_fitted_grid(
    true_gap: TrueGap,
    rung: Rung,
    load_N: float,
    *,
    nodes: int,
    most: int | None,
    planes: Rung | None = None,
    tolerance: float = TOLERANCE,
) -> Rung:
    """Solve the contact on a grid that fits a contact on coarser nodes.

    If the contact is cut off by the grid, then it is solved again with more room, first a grid spacing of the coarser
    nodes, and then twice the room each time. In separate planes the patches press less on each other and reach further:
    they have this room at once.

    Raises
    ------
    ConvergenceError
        If the contact is cut off by all of the grids.
    """
    spacing_x_mm, widest_cell_mm = rung.grid.steps_mm[0], float(rung.grid.cells_mm.max())
    rooms = (0.0, *(2.0**doublings for doublings in range(_MAX_ROOM_DOUBLINGS + 1)))
    for room in rooms[planes is not None :]:
        grid = _make_fitted_grid(rung, nodes, (room * spacing_x_mm, room * widest_cell_mm), most=most)
        fitted_rung = _solve(true_gap, grid, load_N, start=rung.pressure, planes=planes, tolerance=tolerance)
        if not _is_cut_off(fitted_rung):
            return fitted_rung
    raise ConvergenceError(
        f"the contact on a half-space reaches the edge of its nodes on {len(rooms)} grids in turn; try a different load"
        " or lateral shift"
    )


def _is_cut_off(rung: Rung) -> bool:
    """Whether a contact has pressure at an edge of a band of its nodes."""
    pressure, grid = rung.pressure_MPa, rung.grid
    last_columns = np.cumsum([band.s_mm.size for band in grid.bands]) - 1
    edge_columns = np.concatenate(([0], last_columns, last_columns[:-1] + 1))
    edge_rows = [-1] if grid.half else [0, -1]
    return bool(pressure[:, edge_columns].any() or pressure[edge_rows].any())


def _solve(
    true_gap: TrueGap,
    grid: ContactGrid,
    load_N: float,
    *,
    start: Field | None = None,
    planes: Rung | None = None,
    tolerance: float = TOLERANCE,
) -> Rung:
    """Solve the contact on a grid from a guess, and refuse unusable contacts.

    A contact is refused at the end of a profile, on a corner, and without convergence. There is a single plane for all
    patches, or the planes below the patches of a given contact.
    """
    angle_rad = None if planes is None else _interpolate_plane_angle(true_gap, grid, planes)
    rung = true_gap.solve(grid, load_N, start=start, angle_rad=angle_rad, tolerance=tolerance)
    check_ends(true_gap.placement, rung, true_gap.on(grid))
    if rung.status != "converged":
        raise ConvergenceError(
            f"the contact on a half-space of {grid.shape[0]} by {grid.shape[1]} nodes did not converge (residual"
            f" {rung.residual:.1e} of the approach); try a different load or lateral shift"
        )
    return rung


def _interpolate_plane_angle(true_gap: TrueGap, grid: ContactGrid, planes: Rung) -> Floats:
    """Angle (ns,) in rad of the planes of another contact, at each column of a grid."""
    return np.asarray(np.interp(grid.s_mm, planes.grid.s_mm, compute_plane_angles(true_gap.placement, planes)))


def _find_near_region(
    true_gap: TrueGap, reach_mm: float, half: bool
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Bounding box of the surface that comes together for a rigid approach by `reach_mm`.

    Parameters
    ----------
    true_gap
        Gap function of the placed profiles.
    reach_mm
        Approach along the direction of the load in mm.
    half
        Whether the region has only x >= 0.

    Returns
    -------
    (x_low, x_high), (s_low, s_high)
        Bounds in mm from the first contact point, extended by a sample at each end. If no sample is near, the box is
        wide along x and 2 mm wide across.

    Raises
    ------
    InputError
        If the region reaches an end of the rail's profile.
    """
    placement = true_gap.placement
    profile, origin_mm = placement.rail.profile, placement.first_arc_length_mm
    height_mm = 0.0 if placement.along is None else placement.along.height_mm
    width_mm = 1.3 * np.sqrt(2.0 * placement.wheel.rolling_radius_mm * (reach_mm + height_mm))
    x_mm = np.linspace(0.0 if half else -width_mm, width_mm, 15 if half else 29)
    # The sides of the profile and its junction steps lie outside any contact of running wheels.
    s_mm = np.arange(1e-6, profile.length_mm, _COARSE_STEP_S_MM) - origin_mm
    _, normals = placement.surface(0.0, s_mm)
    # The surfaces are not near if the central gap is wider than twice the reach: a yawed wheel is lowest at a position
    # that is a millimetre off the centre.
    # Surfaces that face away from the approach open when the bodies approach; gaps along their normals mean nothing.
    closing = normals @ true_gap.direction
    columns = np.flatnonzero((closing > 0.0) & (true_gap.gap(0.0, s_mm) <= 2.0 * (reach_mm + height_mm)))
    is_near = true_gap.gap(x_mm[:, None], s_mm[None, columns]) <= reach_mm * closing[columns]
    rows, columns = np.flatnonzero(is_near.any(axis=1)), columns[is_near.any(axis=0)]
    if columns.size == 0:
        return (-width_mm, width_mm), (-1.0, 1.0)
    if columns[0] == 0 or columns[-1] == s_mm.size - 1:
        raise InputError(
            f"the contact patch reaches the end of the running surface of rail {profile.name}; reduce the load or the"
            " lateral shift, or give a longer profile"
        )
    spacing_mm = x_mm[1] - x_mm[0]
    return (x_mm[rows[0]] - spacing_mm, x_mm[rows[-1]] + spacing_mm), (
        s_mm[columns[0]] - _COARSE_STEP_S_MM,
        s_mm[columns[-1]] + _COARSE_STEP_S_MM,
    )


def _make_fitted_grid(
    rung: Rung, nodes: int, room_mm: tuple[float, float] = (0.0, 0.0), *, most: int | None = None
) -> ContactGrid:
    """Grid that fits a contact, with a number of nodes on its narrowest semi-axis.

    If there would be too many nodes, the narrowest lobes have fewer. Distant patches have bands of nodes of their own.

    Parameters
    ----------
    rung
        Solved contact, with lobes that its nodes resolve.
    nodes
        Nodes on the narrowest semi-axis in each direction.
    room_mm
        Least room around the contact along x and across, in mm; three steps if this is more.
    most
        Largest number of nodes of a half model; `MOST_NODES` if not given.

    Returns
    -------
    ContactGrid
        Grid over the contact with its room.

    Raises
    ------
    ConvergenceError
        If nodes that follow the narrowest lobe would be more than `MOST_NODES`.
    """
    grid, sizes = rung.grid, measure_lobe_sizes(rung)
    (x_low_mm, x_high_mm), (s_low_mm, s_high_mm) = _find_bounds(rung)
    followed_lengths_mm = measure_resolved_lobes_mm(sizes)
    spacing_x_mm, spacing_s_mm = (length / nodes for length in followed_lengths_mm)
    models = 1 if grid.half else 2
    requested_limit, largest_limit = models * (most or MOST_NODES), models * MOST_NODES
    node_count = (x_high_mm - x_low_mm) * (s_high_mm - s_low_mm) / (spacing_x_mm * spacing_s_mm)
    if node_count > _SINGLE_BAND_FRACTION * largest_limit and len(patches := _split_distant_patches(rung)) > 1:
        banded_grid = _make_grid_in_bands(rung, patches, nodes, room_mm)
        if math.prod(banded_grid.shape) <= requested_limit:
            return banded_grid
    # The smallest lobes have fewer nodes if all nodes would be too many. Large lobes have fewer nodes if that is not
    # sufficient.
    for limit, large_lobe_nodes in ((requested_limit, nodes), (largest_limit, nodes), (largest_limit, FEWEST_NODES)):
        for step_factor in _STEP_FACTORS:
            coarsening = min(max(1.0, step_factor * math.sqrt(node_count / limit)), nodes / FEWEST_NODES)
            step_x_mm, step_s_mm = (
                max(step_mm, min(coarsening * step_mm, min(large_lengths_mm) / large_lobe_nodes))
                for step_mm, large_lengths_mm in zip(
                    (spacing_x_mm, spacing_s_mm), zip(*sizes.large, strict=True), strict=True
                )
            )
            room_x_mm, room_s_mm = (
                max(3.0 * step_mm, least_room_mm)
                for step_mm, least_room_mm in zip((step_x_mm, step_s_mm), room_mm, strict=True)
            )
            first_x_mm = 0.0 if grid.half else x_low_mm - room_x_mm
            first_s_mm = s_low_mm - room_s_mm
            count_x = int(np.ceil((x_high_mm + room_x_mm - first_x_mm) / step_x_mm))
            count_s = int(np.ceil((s_high_mm + room_s_mm - first_s_mm) / step_s_mm))
            if count_x * count_s <= largest_limit:
                return ContactGrid(
                    x_mm=np.asarray(first_x_mm + step_x_mm * np.arange(count_x + 1)),
                    s_mm=np.asarray(first_s_mm + step_s_mm * np.arange(count_s + 1)),
                    half=grid.half,
                )
    lobe_mm = FEWEST_NODES * step_s_mm
    raise ConvergenceError(
        f"a lobe of the pressure is {lobe_mm:.2g} mm long from its peak to a valley, in a patch"
        f" {s_high_mm - s_low_mm:.1f} mm wide: it needs {count_x} by {count_s} nodes;"
        f" allowed: at most {largest_limit} nodes, or lobes of at least"
        f" {lobe_mm * count_x * count_s / largest_limit:.2g} mm; change the lateral shift by 0.2 mm, or change the"
        " load"
    )


def _make_grid_in_bands(
    rung: Rung, patches: Sequence[Rung], nodes: int, least_room_mm: tuple[float, float]
) -> ContactGrid:
    """Grid with a band for each of several distant patches, with nodes for its lobes.

    Lobes that are narrower than other lobes by `_LEAST_RESOLVED_FRACTION` have fewer nodes, and patches with little
    load have fewer nodes along x, where all bands have equal rows. Lateral steps are whole multiples of the least step,
    so that the nodes of all bands lie on an equally spaced line. `least_room_mm` is the least room around each patch
    along x and across, in mm.
    """
    (x_low_mm, x_high_mm), half, large_width_mm = (
        _find_bounds(rung)[0],
        rung.grid.half,
        min(size[1] for size in measure_lobe_sizes(rung).large),
    )
    followed_lengths_mm = [measure_resolved_lobes_mm(measure_lobe_sizes(patch)) for patch in patches]
    loads = [float(patch.pressure_MPa.sum(axis=0) @ rung.grid.weights) for patch in patches]
    counts = [nodes if load >= SMALL_LOAD_FRACTION * sum(loads) else FEWEST_NODES for load in loads]
    step_x_mm = min(size[0] / count for size, count in zip(followed_lengths_mm, counts, strict=True))
    room_x_mm = max(3.0 * step_x_mm, least_room_mm[0])
    first_x_mm = 0.0 if half else x_low_mm - room_x_mm
    count_x = int(np.ceil((x_high_mm + room_x_mm - first_x_mm) / step_x_mm))
    ends_mm = [_find_bounds(patch)[1] for patch in patches]
    steps_mm = [
        min(max(width_mm, _LEAST_RESOLVED_FRACTION * large_width_mm) / nodes, 0.5 * (high_mm - low_mm) / FEWEST_NODES)
        for (_, width_mm), (low_mm, high_mm) in zip(followed_lengths_mm, ends_mm, strict=True)
    ]
    least_step_mm, bands_mm = min(steps_mm), []
    for patch, step_mm, (low_mm, high_mm) in zip(patches, steps_mm, ends_mm, strict=True):
        band_step_mm = least_step_mm * math.floor(step_mm / least_step_mm * (1.0 + 1e-9))
        # The contact may begin where a coarser node was free.
        widest_cell_mm = float(patch.grid.cells_mm[patch.pressure_MPa.any(axis=0)].max())
        room_mm = max(_RIM_NODES * band_step_mm, widest_cell_mm, least_room_mm[1])
        first_mm = band_step_mm * math.floor((low_mm - room_mm) / band_step_mm)
        bands_mm.append(
            np.asarray(
                first_mm + band_step_mm * np.arange(math.ceil((high_mm + room_mm - first_mm) / band_step_mm) + 1)
            )
        )
    return build_banded_grid(np.asarray(first_x_mm + step_x_mm * np.arange(count_x + 1)), bands_mm, half=half)


def measure_resolved_lobes_mm(sizes: LobeSizes) -> tuple[float, float]:
    """Half length and half width of the smallest lobes that the nodes resolve.

    Parameters
    ----------
    sizes
        Sizes of the lobes of a contact.

    Returns
    -------
    tuple of float
        Half length and half width in mm.
    """
    length_mm, width_mm = (
        max(min(all_mm), _LEAST_RESOLVED_FRACTION * min(large_mm))
        for all_mm, large_mm in zip(zip(*sizes.every, strict=True), zip(*sizes.large, strict=True), strict=True)
    )
    return length_mm, width_mm


def _make_expected_patch(true_gap: TrueGap, rung: Rung) -> ExpectedPatch:
    """Expected patch from its half-space contact.

    Bounds in mm are from the contact with pressure; the semi-axes in mm decide on the sizes of the elements.
    """
    (x_low_mm, x_high_mm), (s_low_mm, s_high_mm) = _find_bounds(rung)
    semi_axis_x_mm, semi_axis_s_mm = measure_element_semi_axes_mm(rung)
    return ExpectedPatch(
        x_low_mm=x_low_mm,
        x_high_mm=x_high_mm,
        s_low_mm=s_low_mm,
        s_high_mm=s_high_mm,
        semi_axis_x_mm=semi_axis_x_mm,
        semi_axis_s_mm=semi_axis_s_mm,
        true_gap=true_gap,
        half_space=rung,
        parts=_make_parts(rung, semi_axis_s_mm),
    )


def _make_parts(rung: Rung, semi_axis_s_mm: float) -> tuple[DistantPatch, ...]:
    """Distant patches, from the gauge side on.

    `semi_axis_s_mm` is the half width for the elements below the narrowest patch.
    """
    parts = []
    for patch in _split_distant_patches(rung):
        semi_axes_mm, (_, (s_low_mm, s_high_mm)) = measure_element_semi_axes_mm(patch), _find_bounds(patch)
        expected_part = DistantPatch(
            s_low_mm=s_low_mm,
            s_high_mm=s_high_mm,
            larger=max(1.0, semi_axes_mm[1] / semi_axis_s_mm),
            semi_axes_mm=semi_axes_mm,
        )
        parts.append(expected_part)
    return tuple(parts)


def _split_distant_patches(rung: Rung) -> list[Rung]:
    """Contact of each of several distant patches alone, from the gauge side on.

    Each contact has the grid of the given contact, and zero pressure in the columns of other patches. Patches are
    separate if they are more than `_SEPARATION_CELLS` least cells apart, and more than half of `_SEPARATION_RATIO`
    times the width of the wider patch. A single patch gives a list of one contact.
    """
    # In units of the least cell, rounded so that rounding errors do not separate patches.
    ends = np.round((rung.grid.s_mm - rung.grid.s_mm[0]) / rung.grid.steps_mm[1] + 0.5 * rung.grid.weights, 6)
    starts = np.round(ends - rung.grid.weights, 6)
    loaded_columns = np.flatnonzero(rung.pressure_MPa.any(axis=0))
    column_ranges: list[tuple[int, int]] = []
    for patch_columns in np.split(
        loaded_columns, np.flatnonzero(starts[loaded_columns[1:]] - ends[loaded_columns[:-1]] > _SEPARATION_CELLS) + 1
    ):
        first, last = int(patch_columns[0]), int(patch_columns[-1])
        # A patch is joined to the patches before it as long as the surface between them is too short.
        while column_ranges and starts[first] - ends[column_ranges[-1][1]] <= 0.5 * _SEPARATION_RATIO * max(
            ends[last] - starts[first], ends[column_ranges[-1][1]] - starts[column_ranges[-1][0]]
        ):
            first = column_ranges.pop()[0]
        column_ranges.append((first, last))
    columns = np.arange(rung.grid.s_mm.size)
    is_in_patch = [(columns >= first) & (columns <= last) for first, last in column_ranges]
    return [
        replace(rung, pressure_MPa=np.where(is_in_own_columns, rung.pressure_MPa, 0.0))
        for is_in_own_columns in is_in_patch
    ]


def _find_bounds(rung: Rung) -> tuple[tuple[float, float], tuple[float, float]]:
    """Bounding box of the contact, along x and across.

    Bounds in mm are the ends of the outermost loaded cells. A half grid is mirrored, so that x_low = -x_high.
    """
    x_mm, s_mm, cells_mm, pressure = rung.grid.x_mm, rung.grid.s_mm, rung.grid.cells_mm, rung.pressure_MPa
    spacing_x_mm = rung.grid.steps_mm[0]
    rows, columns = np.flatnonzero(pressure.any(axis=1)), np.flatnonzero(pressure.any(axis=0))
    x_high_mm = float(x_mm[rows[-1]] + 0.5 * spacing_x_mm)
    x_low_mm = -x_high_mm if rung.grid.half else float(x_mm[rows[0]] - 0.5 * spacing_x_mm)
    first_column, last_column = columns[0], columns[-1]
    return (x_low_mm, x_high_mm), (
        float(s_mm[first_column] - 0.5 * cells_mm[first_column]),
        float(s_mm[last_column] + 0.5 * cells_mm[last_column]),
    )
