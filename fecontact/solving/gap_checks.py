"""Checks of the solved gap, with the profiles' curvatures and with the surfaces of both meshes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import RectBivariateSpline

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid, Field, Rung
from fecontact.contact.halfspace import build_half_space_compliance
from fecontact.fe.coupling import CoupledBodies
from fecontact.placement.wheel_on_rail import OPEN_GAP_MM, Placement
from fecontact.solving.true_gap import TrueGap, interpolate_field

# Number of positions between two neighbours of a node at which the profiles' curvatures are averaged.
_SAMPLE_COUNT = 401


def compute_gap_curvature_error(true_gap: TrueGap, grid: ContactGrid) -> float:
    """Largest error of the gap's second differences at the node nearest to the contact point.

    The gap is the gap on the solved nodes. Its lateral second difference is the mean of the profiles' relative
    curvature between both neighbours of the node, with weights that decrease linearly from the node. The node is the
    nearest node without a curvature junction beside it. The slide of steep surfaces is left out;
    `compute_gap_distance_error_mm` includes it. Irregularities curve the gap along the track; the gap over them is
    therefore checked laterally only.

    Parameters
    ----------
    true_gap
        True gap.
    grid
        Grid of the solved nodes.

    Returns
    -------
    float
        Error relative to the largest curvature of the gap at the contact point (-).
    """
    unslid_gap = true_gap if true_gap.slide_mm == 0.0 else replace(true_gap, slide_mm=0.0)
    gap_mm = unslid_gap.on(grid)
    row = 0 if grid.half else _nearest_inner_node(grid.x_mm)
    column = _column_at_contact_point(true_gap.placement, grid)
    left_mm, centre_mm, right_mm = gap_mm[row, column - 1 : column + 2]
    spacing_x_mm, spacing_s_mm = grid.steps_mm[0], float(grid.s_mm[column + 1] - grid.s_mm[column])
    along = (gap_mm[row + 1, column] - 2.0 * centre_mm + gap_mm[1 if grid.half else row - 1, column]) / spacing_x_mm**2
    across = (left_mm - 2.0 * centre_mm + right_mm) / spacing_s_mm**2
    expected_along, expected_across = _expected_curvatures(true_gap.placement, float(grid.s_mm[column]), spacing_s_mm)
    errors = [across - expected_across]
    if true_gap.placement.along is None:
        errors.append(along - expected_along)
    scale = np.abs(true_gap.placement.first.curvature.hessian).max()
    return float(np.nan_to_num(np.abs(errors), nan=scale).max() / scale)


def _nearest_inner_node(positions_mm: Floats) -> int:
    """Number of the node nearest to 0 that has neighbours on both sides."""
    return int(np.clip(np.argmin(np.abs(positions_mm)), 1, positions_mm.size - 2))


def _column_at_contact_point(placement: Placement, grid: ContactGrid) -> int:
    """Column nearest to the contact point with no junction between its neighbours, if possible.

    Published segments miss each other by at least 1e-7 mm at their joints: over steps of 0.02 mm that is at least 1e-3
    of the curvature.
    """
    starts = np.cumsum([0, *(band.s_mm.size for band in grid.bands)])
    inner_columns = np.concatenate([np.arange(start + 1, stop - 1) for start, stop in pairwise(starts)])
    middles_mm, junctions_mm = grid.s_mm[inner_columns], [junction.s_mm for junction in placement.junctions]
    reaches_mm = 2.0 * (grid.s_mm[inner_columns + 1] - middles_mm)
    has_junction = [
        bool(np.any(np.abs(np.subtract(junctions_mm, middle_mm)) < reach_mm))
        for middle_mm, reach_mm in zip(middles_mm, reaches_mm, strict=True)
    ]
    return int(inner_columns[np.lexsort((np.abs(middles_mm), has_junction))[0]])


def _expected_curvatures(placement: Placement, s_mm: float, step_mm: float) -> tuple[float, float]:
    """Relative curvatures (1/mm) along and across near the contact point, by the profiles alone.

    The curvature across is a mean over `step_mm` on both sides of `s_mm`, with weights that fall linearly to zero, as a
    second difference of the gap has them.

    Parameters
    ----------
    placement
        Wheel on rail.
    s_mm
        Arc length across, from the first contact point.
    step_mm
        Step of the second difference.
    """
    contact_point, curvature = placement.first, placement.first.curvature
    offsets = np.linspace(-1.0, 1.0, _SAMPLE_COUNT)
    weights = 1.0 - np.abs(offsets)
    rail, wheel = placement.rail.profile, placement.wheel.profile
    rail_arcs_mm = placement.first_arc_length_mm + s_mm + step_mm * offsets
    wheel_arcs_mm = float(wheel.arc_length(contact_point.wheel_u)) + s_mm + step_mm * offsets
    wheel_points = wheel.evaluate(wheel.at_arc_length(wheel_arcs_mm))
    lateral = rail.convex_sign * rail.evaluate(rail.at_arc_length(rail_arcs_mm)).curvature_per_mm
    lateral = lateral + wheel.convex_sign * wheel_points.curvature_per_mm
    # Yaw adds a constant fraction of the rolling curvature.
    yaw_curvature = curvature.yy_per_mm - curvature.rail_per_mm - curvature.wheel_lateral_per_mm
    middle = _SAMPLE_COUNT // 2
    rolling = np.cos(wheel_points.angle_rad[middle]) / (placement.wheel.rolling_radius_mm - wheel_points.z[middle])
    along = curvature.xx_per_mm + abs(rolling) - curvature.wheel_rolling_per_mm
    return float(along), float(weights @ lateral / weights.sum() + yaw_curvature)


def recover_gap(true_gap: TrueGap, rung: Rung, added: Field) -> Field:
    """Undeformed gap of a solved contact, from its deformed gap.

    Parameters
    ----------
    true_gap
        True gap with the contact modulus and the direction of the load.
    rung
        Contact on a half-space in a single plane.
    added
        Opening of finite bodies minus opening of a half-space, as in `TrueGap.solve`.

    Returns
    -------
    Field
        Gap (nx, ns) in mm on the grid of the contact.
    """
    grid = rung.grid
    _, normals = true_gap.placement.surface(0.0, grid.s_mm)
    closing_mm = rung.approach_mm / true_gap.closing * (normals @ true_gap.direction)
    opening_mm = build_half_space_compliance(grid, true_gap.contact_modulus_MPa)(rung.pressure_MPa.ravel()).reshape(
        grid.shape
    )
    return Field(
        grid=grid, values=rung.gap_mm + closing_mm - opening_mm - interpolate_field(added, grid.x_mm, grid.s_mm)
    )


def compute_gap_distance_error_mm(true_gap: TrueGap, gap: Field, bodies: CoupledBodies) -> float:
    """Largest difference between the undeformed gap and the distance of both meshes' surfaces.

    A cubic spline interpolates the gap at the wheel's nodes within the grid. Their distance from the rail is measured
    along the rail's normals, and the rail's nodes must lie on the surface with these normals.

    Parameters
    ----------
    true_gap
        True gap with the slide.
    gap
        Undeformed gap in mm on the solved nodes.
    bodies
        Both coupled bodies with their meshes.

    Returns
    -------
    float
        Difference in mm.
    """
    placement, slide, grid = true_gap.placement, true_gap.slide_mm, gap.grid
    rail_surface, _ = placement.surface(bodies.grid.x_mm[:, None], bodies.grid.s_mm[None, :])
    rail_offsets = bodies.rail.mesh.points[bodies.rail_nodes] - rail_surface.reshape(-1, 3)
    tangent = placement.first.tangent
    wheel_points = bodies.wheel.mesh.points[bodies.wheel_nodes]
    # Points outside the grid may slide past the end of the rail's surface.
    unslid_s_mm = placement.project(wheel_points)[:, 1]
    wheel_points = wheel_points[(unslid_s_mm >= grid.s_mm[0]) & (unslid_s_mm <= grid.s_mm[-1])] - slide * tangent
    x_mm, s_mm = placement.project(wheel_points).T
    feet, normals = placement.surface(x_mm, s_mm)
    distance = ((wheel_points - feet) * normals).sum(axis=-1) + slide * (normals @ tangent)
    smooth_gap_mm = gap.values - _opening_mm(placement, grid.x_mm[:, None], grid.s_mm[None, :])
    differences, start = [np.abs(rail_offsets).ravel()], 0
    for band in grid.bands:
        columns = slice(start, start + band.s_mm.size)
        start = columns.stop
        is_in_band = (x_mm >= band.x_mm[0]) & (x_mm <= band.x_mm[-1]) & (s_mm >= band.s_mm[0]) & (s_mm <= band.s_mm[-1])
        gap_at_nodes_mm = RectBivariateSpline(band.x_mm, band.s_mm, smooth_gap_mm[:, columns]).ev(
            x_mm[is_in_band], s_mm[is_in_band]
        )
        differences.append(np.abs(gap_at_nodes_mm - distance[is_in_band]))
    return float(np.nan_to_num(np.concatenate(differences), nan=OPEN_GAP_MM).max())


def _opening_mm(placement: Placement, x: Floats, s: Floats) -> Floats:
    """Contribution of irregularities to the gap (mm), which the meshes of smooth bodies lack."""
    if placement.along is None:
        return np.zeros(1)
    points, normals = placement.surface(x, s)
    return placement.along.opening_mm(points[..., 0]) - placement.along.lowered_mm * normals[..., 2]
