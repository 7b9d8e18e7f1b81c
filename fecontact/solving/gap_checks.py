"""Checks of the gap that is solved: against the profiles' curvatures, and against the surfaces of both meshes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import RectBivariateSpline

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid, Field, Rung
from fecontact.contact.halfspace import half_space_below
from fecontact.fe.coupling import CoupledBodies
from fecontact.placement.wheel_on_rail import OPEN_GAP_MM, Placement
from fecontact.solving.true_gap import TrueGap, carried

# Places between two neighbours of a node at which the profiles' curvatures are averaged.
_PLACES = 401


def gap_curvature_error(true_gap: TrueGap, grid: ContactGrid) -> float:
    """Largest error of the gap's second differences at the node nearest to the contact point.

    The gap is the gap on the solved nodes. Its second difference across is the mean of the profiles' relative curvature
    between both neighbours of the node, with weights that fall linearly from the node. The node is the nearest one
    that has no curvature junction beside it. The slide of steep surfaces is left out; `gap_distance_error_mm` includes
    it. Irregularities curve the gap along the track, therefore the gap over them is checked across only.

    Returns
    -------
    float
        Relative to the largest curvature of the gap at the contact point.
    """
    smooth = true_gap if true_gap.slide_mm == 0.0 else replace(true_gap, slide_mm=0.0)
    gap = smooth.on(grid)
    row = 0 if grid.half else _inner_nearest(grid.x_mm)
    column = _column_at_contact_point(true_gap.placement, grid)
    before, here, after = gap[row, column - 1 : column + 2]
    step_x, step_s = grid.steps_mm[0], float(grid.s_mm[column + 1] - grid.s_mm[column])
    along = (gap[row + 1, column] - 2.0 * here + gap[1 if grid.half else row - 1, column]) / step_x**2
    across = (before - 2.0 * here + after) / step_s**2
    expected_along, expected_across = _expected_curvatures(true_gap.placement, float(grid.s_mm[column]), step_s)
    errors = [across - expected_across]
    if true_gap.placement.along is None:
        errors.append(along - expected_along)
    scale = np.abs(true_gap.placement.first.curvature.hessian).max()
    return float(np.nan_to_num(np.abs(errors), nan=scale).max() / scale)


def _inner_nearest(line: Floats) -> int:
    """Number of the node nearest to 0 that has neighbours on both sides."""
    return int(np.clip(np.argmin(np.abs(line)), 1, line.size - 2))


def _column_at_contact_point(placement: Placement, grid: ContactGrid) -> int:
    """Column nearest to the contact point with no junction between its neighbours, if there is such a column.

    Published segments miss each other by 1e-7 mm and more where they meet: over steps of 0.02 mm that is 1e-3 of the
    curvature and more.
    """
    starts = np.cumsum([0, *(band.s_mm.size for band in grid.bands)])
    inner = np.concatenate([np.arange(low + 1, high - 1) for low, high in pairwise(starts)])
    middles, places = grid.s_mm[inner], [junction.s_mm for junction in placement.junctions]
    reaches = 2.0 * (grid.s_mm[inner + 1] - middles)
    meets = [
        bool(np.any(np.abs(np.subtract(places, middle)) < reach))
        for middle, reach in zip(middles, reaches, strict=True)
    ]
    return int(inner[np.lexsort((np.abs(middles), meets))[0]])


def _expected_curvatures(placement: Placement, s_mm: float, step_mm: float) -> tuple[float, float]:
    """Relative curvatures (1/mm) along and across at a place near the contact point, by the profiles alone."""
    touch, curvature = placement.first, placement.first.curvature
    offsets = np.linspace(-1.0, 1.0, _PLACES)
    weights = 1.0 - np.abs(offsets)
    rail, wheel = placement.rail.profile, placement.wheel.profile
    rail_arcs = placement.first_arc_length_mm + s_mm + step_mm * offsets
    wheel_arcs = float(wheel.arc_length(touch.wheel_u)) + s_mm + step_mm * offsets
    on_wheel = wheel.evaluate(wheel.at_arc_length(wheel_arcs))
    lateral = rail.convex_sign * rail.evaluate(rail.at_arc_length(rail_arcs)).curvature_per_mm
    lateral = lateral + wheel.convex_sign * on_wheel.curvature_per_mm
    # yaw adds a constant part of the rolling curvature
    of_yaw = curvature.yy_per_mm - curvature.rail_per_mm - curvature.wheel_lateral_per_mm
    middle = _PLACES // 2
    rolling = np.cos(on_wheel.angle_rad[middle]) / (placement.wheel.rolling_radius_mm - on_wheel.z[middle])
    along = curvature.xx_per_mm + abs(rolling) - curvature.wheel_rolling_per_mm
    return float(along), float(weights @ lateral / weights.sum() + of_yaw)


def solved_gap(true_gap: TrueGap, rung: Rung, added: Field) -> Field:
    """Undeformed gap (nx, ns) in mm that a solved contact had, from its deformed gap.

    Parameters
    ----------
    rung
        Contact on a half-space in one plane.
    added
        Opening of finite bodies beyond a half-space, as in `TrueGap.solve`.
    """
    grid = rung.grid
    _, normals = true_gap.placement.surface(0.0, grid.s_mm)
    closed = rung.approach_mm / true_gap.closing * (normals @ true_gap.direction)
    opening = half_space_below(grid, true_gap.contact_modulus_MPa)(rung.pressure_MPa.ravel()).reshape(grid.shape)
    return Field(grid=grid, values=rung.gap_mm + closed - opening - carried(added, grid.x_mm, grid.s_mm))


def gap_distance_error_mm(true_gap: TrueGap, gap: Field, bodies: CoupledBodies) -> float:
    """Largest difference between the undeformed gap on solved nodes and the distance of both meshes' surfaces.

    A cubic spline carries the gap to the wheel's nodes within the grid. Their distance from the rail is along the
    rail's normals, and the rail's own nodes must lie on the surface that has these normals.
    """
    placement, slide, grid = true_gap.placement, true_gap.slide_mm, gap.grid
    on_rail, _ = placement.surface(bodies.grid.x_mm[:, None], bodies.grid.s_mm[None, :])
    off_rail = bodies.rail.mesh.points[bodies.rail_nodes] - on_rail.reshape(-1, 3)
    tangent = placement.first.tangent
    wheel_points = bodies.wheel.mesh.points[bodies.wheel_nodes]
    # points beyond the grid may slide past the end of the rail's surface
    unslid_s = placement.project(wheel_points)[:, 1]
    wheel_points = wheel_points[(unslid_s >= grid.s_mm[0]) & (unslid_s <= grid.s_mm[-1])] - slide * tangent
    x, s = placement.project(wheel_points).T
    feet, normals = placement.surface(x, s)
    distance = ((wheel_points - feet) * normals).sum(axis=-1) + slide * (normals @ tangent)
    smooth = gap.values - _opening_mm(placement, grid.x_mm[:, None], grid.s_mm[None, :])
    differences, start = [np.abs(off_rail).ravel()], 0
    for band in grid.bands:
        columns = slice(start, start + band.s_mm.size)
        start = columns.stop
        within = (x >= band.x_mm[0]) & (x <= band.x_mm[-1]) & (s >= band.s_mm[0]) & (s <= band.s_mm[-1])
        at_nodes = RectBivariateSpline(band.x_mm, band.s_mm, smooth[:, columns]).ev(x[within], s[within])
        differences.append(np.abs(at_nodes - distance[within]))
    return float(np.nan_to_num(np.concatenate(differences), nan=OPEN_GAP_MM).max())


def _opening_mm(placement: Placement, x: Floats, s: Floats) -> Floats:
    """Part of the gap (mm) that irregularities add; the meshes are those of smooth bodies."""
    if placement.along is None:
        return np.zeros(1)
    points, normals = placement.surface(x, s)
    return placement.along.opening_mm(points[..., 0]) - placement.along.lowered_mm * normals[..., 2]
