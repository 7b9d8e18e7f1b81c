"""Contact for ParaView: pressures on the rail's surface, and Hertz's ellipses as lines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial import cKDTree

from fecontact.arrays import Floats, Integers
from fecontact.contact.grid import ContactGrid, Field, Rung
from fecontact.contact.patch import build_signed_square
from fecontact.contact_theories.approximation import average_pressure_over_cells
from fecontact.contact_theories.hertz import HertzContact
from fecontact.fe.body_mesh import BodyMesh
from fecontact.outputs.figures.pressure_maps import ellipse_outline
from fecontact.outputs.paraview.datasets import add_array, build_lines, build_surface
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.solve import CaseResult

LIFT_MM = 1e-3
"""Height of the contact above the rail, along the normals. In one surface both would flicker."""
LINE_LIFT_MM = 0.05
"""Height of the ellipses above the rail, which ParaView draws with flat facets."""
PRESSURE, PRESSURE_SQUARED, PRESSURE_VECTOR = "contact_pressure_MPa", "pressure_squared_MPa2", "pressure_vector_MPa"
"""Names of the pressure of elastic bodies, and of the square and the vector of the judged pressure."""


def contact_surface(result: CaseResult, contact: Rung, yielded: Rung | None = None) -> Any:
    """Contact on the rail's surface as a VTK mesh of quadrilaterals.

    The mesh lies `LIFT_MM` above the rail and holds the contact and Hertz's ellipse, as far as the rail's surface
    reaches. Arrays: `contact_pressure_MPa`, `hertz_pressure_MPa`, `gap_mm` (deformed; NaN beyond the nodes of the
    solution, where only Hertz has a pressure), `in_contact` (0 or 1), and with `yielded` the `plastic_pressure_MPa` of
    bodies that yield.

    Three arrays belong to the judged pressure: of bodies that yield if there is `yielded`, of elastic bodies otherwise.
    `hertz_minus_fe_MPa` is the deviation of Hertz. `pressure_vector_MPa` is the pressure times the normal out of the
    rail. Its integral is the force on the wheel in N, also on a curved patch, where the integral of the pressure is
    larger. `pressure_squared_MPa2` is continued below zero beyond the patch: its contour at zero is the edge.

    Pressures are means over the cells of the nodes.

    Parameters
    ----------
    result
        Result of a case.
    contact
        Rung with the contact of elastic bodies.
    yielded
        Rung with the contact of bodies that yield; None without a yield stress.

    Returns
    -------
    vtkPolyData
        The mesh, in mm and in the track frame.
    """
    fields, grid = _contact_fields(result, contact, yielded)
    points, normals = result.placement.surface(grid.x_mm[:, None], grid.s_mm[None, :])
    # the surface of a rail ends with its profile, even if Hertz's ellipse reaches further
    is_on_rail = np.isfinite(points[0, :, 1])
    points, normals = points[:, is_on_rail], normals[:, is_on_rail]
    index = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    surface = build_surface((points + LIFT_MM * normals).reshape(-1, 3), quads)
    vector = _judged_pressure(fields)[:, is_on_rail, None] * normals
    for name, values in fields.items():
        # single precision suffices, and halves the time to compress
        single = values if values.dtype == np.uint8 else values.astype(np.float32)
        add_array(surface.GetPointData(), name, single[:, is_on_rail].ravel())
    add_array(surface.GetPointData(), PRESSURE_VECTOR, vector.reshape(-1, 3).astype(np.float32), "XYZ")
    surface.GetPointData().SetActiveScalars(PRESSURE)
    return surface


_INSIDE_TOLERANCE = 1e-6
# Points at which the pressure of Hertz's ellipse is averaged: least number in a cell, and across the ellipse.
_MIN_POINTS_PER_CELL, _POINTS_PER_EXTENT = 5, 100
# Points of the rail's section among which the s of a node is found.
_SECTION_POINTS = 4000


def _contact_fields(
    result: CaseResult, contact: Rung, yielded: Rung | None
) -> tuple[dict[str, NDArray[Any]], ContactGrid]:
    """Fields (nx, ns) on a grid that contains Hertz's ellipse and both contacts.

    Parameters
    ----------
    result
        Result of a case, with Hertz's ellipse.
    contact
        Rung with the contact of elastic bodies.
    yielded
        Rung with the contact of bodies that yield; its grid is used if it is given.

    Returns
    -------
    fields, grid
        Arrays by the names in `contact_surface`, without `pressure_vector_MPa`: pressures in MPa, gap in mm (NaN beyond
        the nodes of the solution), `in_contact` as 0 or 1. The grid has its origin at the first contact point.
    """
    ellipse = result.load.deciding_ellipse
    extents = ellipse.extent_x_mm, ellipse.extent_y_mm
    grid = contact.pressure.covering(*extents).grid
    if yielded is not None:
        # bodies that yield may touch where elastic bodies do not
        lengths_mm = (2.0 * float(np.abs(coordinates_mm).max()) for coordinates_mm in (grid.x_mm, grid.s_mm))
        grid = yielded.pressure.covering(*lengths_mm).grid

    def interpolate(rung: Rung, values: Floats) -> Floats:
        return Field(grid=rung.grid, values=values).covering(*extents).at(grid).values

    pressure = interpolate(contact, contact.pressure_MPa)
    # an ellipse of few cells needs more points in each cell: with 5 points on 0.4 b its integral is 0.15 % too low
    largest_fraction = max(step / extent for step, extent in zip(grid.steps_mm, extents, strict=True))
    points_per_cell = max(_MIN_POINTS_PER_CELL, math.ceil(_POINTS_PER_EXTENT * largest_fraction))
    hertz = average_pressure_over_cells(grid, ellipse, points_per_cell=points_per_cell)
    is_inside = interpolate(contact, np.ones(contact.grid.shape)) > 1.0 - _INSIDE_TOLERANCE
    fields: dict[str, NDArray[Any]] = {
        PRESSURE: pressure,
        "hertz_pressure_MPa": hertz,
        "gap_mm": np.where(is_inside, interpolate(contact, contact.gap_mm), np.nan),
        # not Boolean, since ParaView's readers take Boolean arrays for field data
        "in_contact": (pressure > 0.0).astype(np.uint8),
    }
    if yielded is not None:
        fields["plastic_pressure_MPa"] = interpolate(yielded, yielded.pressure_MPa)
    judged_pressure = _judged_pressure(fields)
    # the ring of nodes around the grid is left out
    fields[PRESSURE_SQUARED] = build_signed_square(judged_pressure)[1:-1, 1:-1]
    return fields | {"hertz_minus_fe_MPa": hertz - judged_pressure}, grid


def _judged_pressure(fields: Mapping[str, NDArray[Any]]) -> Floats:
    return np.asarray(fields.get("plastic_pressure_MPa", fields[PRESSURE]))


def find_node_pressure(result: CaseResult, mesh: BodyMesh) -> Floats:
    """Pressure of the judged contact at the nodes of the rail or the wheel.

    Parameters
    ----------
    result
        Result of a case.
    mesh
        Mesh of a body with n nodes; its contact nodes are on the rail's surface, but for the gap.

    Returns
    -------
    ndarray of shape (n,)
        Pressure in MPa; zero outside the contact and inside the body.
    """
    field = result.load.level.fe.pressure.covering(0.0, 0.0)
    pressure, grid = _interpolate_field(field), field.grid
    s = np.linspace(grid.s_mm[0], grid.s_mm[-1], _SECTION_POINTS)
    section, _ = result.placement.surface(0.0, s)
    is_on_rail = np.isfinite(section[:, 1])
    nodes = np.unique(mesh.surfaces["contact"])
    # the section is equal along the rail: the nearest point of the section has the s of a node
    distance_mm, nearest = cKDTree(section[is_on_rail, 1:]).query(mesh.points[nodes, 1:])
    x_mm = mesh.points[nodes, 0] - result.placement.first.x_mm
    is_near = distance_mm < np.hypot(*np.diff(section[is_on_rail, 1:], axis=0).T).max()
    values = np.zeros(len(mesh.points))
    values[nodes] = np.where(is_near, pressure(np.stack([x_mm, s[is_on_rail][nearest]], axis=-1)), 0.0)
    return values


def _interpolate_field(field: Field) -> RegularGridInterpolator:
    """Values of a field at positions (x, s), zero outside its grid."""
    return RegularGridInterpolator((field.grid.x_mm, field.grid.s_mm), field.values, bounds_error=False, fill_value=0.0)


def ellipse_lines(result: CaseResult) -> Any:
    """Edges of Hertz's ellipses as lines of VTK.

    They are `LINE_LIFT_MM` above the rail. The cell array `lobe` is 0 for the ellipse at the first contact point under
    the complete load. It is 1, 2, ... for the ellipses of lobes and separate patches under their own forces. The point
    array `pressure_vector_MPa` is the judged pressure below the line times the normal out of the rail, as on
    `contact_surface`. The point array `contact_pressure_MPa` is NaN: ParaView colours the lines in its colour for
    missing values, which differs from the colours of the pressures around them.

    Parameters
    ----------
    result
        Result of a case.

    Returns
    -------
    vtkPolyData
        The lines, in mm and in the track frame.
    """
    level, lobes = result.load.level, result.load.lobes
    judged_rung = level.fe if level.yielded is None else level.yielded.fe
    pressure = _interpolate_field(judged_rung.pressure.covering(0.0, 0.0))
    lines = [_ellipse_line(result.placement, pressure, result.load.deciding_ellipse, 0.0, 0.0)]
    for lobe in lobes if len(lobes) > 1 else ():
        if lobe.hertz is not None and lobe.touch is not None:
            x_mm = lobe.touch.x_mm - result.placement.first.x_mm
            s_mm = result.placement.arc_mm(lobe.touch)
            lines.append(_ellipse_line(result.placement, pressure, lobe.hertz, x_mm, s_mm))
    first_nodes = np.cumsum([0, *(len(line.points) for line in lines)])
    merged = build_lines(
        np.concatenate([line.points for line in lines]),
        np.concatenate([line.segments + first for line, first in zip(lines, first_nodes, strict=False)]),
    )
    lobe_numbers = np.repeat(np.arange(len(lines), dtype=np.uint8), [len(line.segments) for line in lines])
    add_array(merged.GetCellData(), "lobe", lobe_numbers)
    add_array(merged.GetPointData(), PRESSURE, np.full(first_nodes[-1], np.nan))
    add_array(merged.GetPointData(), PRESSURE_VECTOR, np.concatenate([line.pressures_MPa for line in lines]), "XYZ")
    merged.GetPointData().SetActiveScalars(PRESSURE)
    return merged


@dataclass(frozen=True, kw_only=True, eq=False)
class _EllipseLine:
    """Edge of an ellipse: points (n, 3) in mm, segments (m, 2), and pressure vectors (n, 3) in MPa."""

    points: Floats
    segments: Integers
    pressures_MPa: Floats


def _ellipse_line(
    placement: Placement, pressure: RegularGridInterpolator, hertz: HertzContact, x_mm: float, s_mm: float
) -> _EllipseLine:
    """Edge of an ellipse about a point, as far as the rail's surface reaches.

    `pressure` is the judged pressure over (x, s).
    """
    s, x = (places + middle for places, middle in zip(ellipse_outline(hertz), (s_mm, x_mm), strict=True))
    points, normals = placement.surface(x, s)
    is_on_rail = np.isfinite(points[:, 1])
    index = np.cumsum(is_on_rail) - 1
    starts = np.flatnonzero(is_on_rail[:-1] & is_on_rail[1:])
    pressures_MPa = pressure(np.stack([x, s], axis=-1))
    return _EllipseLine(
        points=(points + LINE_LIFT_MM * normals)[is_on_rail],
        segments=np.stack([index[starts], index[starts + 1]], axis=-1),
        pressures_MPa=(pressures_MPa[:, None] * normals)[is_on_rail],
    )
