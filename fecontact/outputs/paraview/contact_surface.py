"""Contact for ParaView: pressures on the rail's surface, and Hertz's ellipses as lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial import cKDTree

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid, Field, Rung
from fecontact.contact_theories.approximation import average_pressure_over_cells
from fecontact.contact_theories.hertz import HertzContact
from fecontact.fe.body_mesh import BodyMesh
from fecontact.outputs.figures.pressure_maps import ellipse_outline
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.solve import CaseResult

LIFT_MM = 1e-3
"""Height of the contact above the rail, along the normals. In one surface both would flicker."""
RELIEF_MM_PER_MPA = 1e-3
"""Height of the pressure relief: equal for all cases for comparison, and flat, so that it hides no line."""
LINE_LIFT_MM = 0.05
"""Height of the ellipses above the relief, which ParaView draws with flat triangles."""


def contact_surface(result: CaseResult, contact: Rung, yielded: Rung | None = None) -> Any:
    """Contact on the rail's surface as a pyvista mesh of quadrilaterals.

    The normals point out of the rail. The mesh lies `LIFT_MM` above the rail and holds the contact and Hertz's ellipse,
    as far as the rail's surface reaches. Arrays: `contact_pressure_MPa`, `hertz_pressure_MPa`, `gap_mm` (deformed; NaN
    beyond the nodes of the solution, where only Hertz has a pressure), `in_contact` (0 or 1), and with `yielded` the
    `plastic_pressure_MPa` of bodies that yield. `hertz_minus_fe_MPa`, as the verdict's deviations, and
    `pressure_relief_mm`, a vector along the normal to warp by, belong to the pressure of bodies that yield if there is
    `yielded`, and to the pressure of elastic bodies if not. Pressures are means over the cells of the nodes: they
    integrate to the force along the contact normal.

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
    pyvista.PolyData
        The mesh, in mm and in the track frame.
    """
    import pyvista

    fields, grid = _contact_fields(result, contact, yielded)
    points, normals = result.placement.surface(grid.x_mm[:, None], grid.s_mm[None, :])
    # the surface of a rail ends with its profile, even if Hertz's ellipse reaches further
    is_on_rail = np.isfinite(points[0, :, 1])
    points, normals = points[:, is_on_rail], normals[:, is_on_rail]
    index = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    surface = pyvista.PolyData.from_regular_faces((points + LIFT_MM * normals).reshape(-1, 3), quads)
    for name, values in fields.items():
        surface.point_data[name] = values[:, is_on_rail].ravel()
    heights = RELIEF_MM_PER_MPA * _judged_pressure(fields)[:, is_on_rail]
    surface.point_data["pressure_relief_mm"] = (heights[..., None] * normals).reshape(-1, 3)
    return surface


_INSIDE_TOLERANCE = 1e-6
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
        Arrays by the names in `contact_surface`, without `pressure_relief_mm`: pressures in MPa, gap in mm (NaN beyond
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

    pressure, hertz = (
        interpolate(contact, contact.pressure_MPa),
        average_pressure_over_cells(grid, ellipse),
    )
    is_inside = interpolate(contact, np.ones(contact.grid.shape)) > 1.0 - _INSIDE_TOLERANCE
    fields: dict[str, NDArray[Any]] = {
        "contact_pressure_MPa": pressure,
        "hertz_pressure_MPa": hertz,
        "gap_mm": np.where(is_inside, interpolate(contact, contact.gap_mm), np.nan),
        # not Boolean, since ParaView's readers take Boolean arrays for field data
        "in_contact": (pressure > 0.0).astype(np.uint8),
    }
    if yielded is not None:
        fields["plastic_pressure_MPa"] = interpolate(yielded, yielded.pressure_MPa)
    return fields | {"hertz_minus_fe_MPa": hertz - _judged_pressure(fields)}, grid


def _judged_pressure(fields: Mapping[str, NDArray[Any]]) -> Floats:
    return np.asarray(fields.get("plastic_pressure_MPa", fields["contact_pressure_MPa"]))


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
    level = result.load.level
    fields, grid = _contact_fields(result, level.fe, None if level.yielded is None else level.yielded.fe)
    pressure = RegularGridInterpolator(
        (grid.x_mm, grid.s_mm), fields["contact_pressure_MPa"], bounds_error=False, fill_value=0.0
    )
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


def ellipse_lines(result: CaseResult) -> Any:
    """Edges of Hertz's ellipses as lines of pyvista.

    They are `LINE_LIFT_MM` above the relief of the judged pressure. The cell array `lobe` is 0 for the ellipse at the
    first contact point under the complete load. It is 1, 2, ... for the ellipses of lobes and separate patches under
    their own forces. The point array `contact_pressure_MPa` is the pressure of the finite elements on the line.

    Parameters
    ----------
    result
        Result of a case.

    Returns
    -------
    pyvista.PolyData
        The lines, in mm and in the track frame.
    """
    import pyvista

    level, lobes = result.load.level, result.load.lobes
    fields, grid = _contact_fields(result, level.fe, None if level.yielded is None else level.yielded.fe)
    coordinates = (grid.x_mm, grid.s_mm)
    pressures = tuple(
        RegularGridInterpolator(coordinates, values, bounds_error=False, fill_value=0.0)
        for values in (fields["contact_pressure_MPa"], _judged_pressure(fields))
    )
    lines = [_ellipse_line(result.placement, pressures, result.load.deciding_ellipse, 0.0, 0.0)]
    for lobe in lobes if len(lobes) > 1 else ():
        if lobe.hertz is not None and lobe.touch is not None:
            x_mm = lobe.touch.x_mm - result.placement.first.x_mm
            s_mm = result.placement.arc_mm(lobe.touch)
            lines.append(_ellipse_line(result.placement, pressures, lobe.hertz, x_mm, s_mm))
    for lobe_number, line in enumerate(lines):
        line.cell_data["lobe"] = np.full(line.n_cells, lobe_number, dtype=np.uint8)
    merged = pyvista.merge(lines, merge_points=False)
    merged.set_active_scalars("contact_pressure_MPa", preference="point")
    return merged


def _ellipse_line(
    placement: Placement,
    pressures: tuple[RegularGridInterpolator, RegularGridInterpolator],
    hertz: HertzContact,
    x_mm: float,
    s_mm: float,
) -> Any:
    """Edge of an ellipse about a point, as far as the rail's surface reaches.

    `pressures` are those of elastic bodies, for the array, and the judged pressures, for the height above the relief.
    """
    import pyvista

    s, x = (places + middle for places, middle in zip(ellipse_outline(hertz), (s_mm, x_mm), strict=True))
    points, normals = placement.surface(x, s)
    is_on_rail = np.isfinite(points[:, 1])
    index = np.cumsum(is_on_rail) - 1
    pairs = [(index[k], index[k + 1]) for k in range(len(s) - 1) if is_on_rail[k] and is_on_rail[k + 1]]
    contact_pressure, judged_pressure = (pressure(np.stack([x, s], axis=-1)) for pressure in pressures)
    heights = LIFT_MM + LINE_LIFT_MM + RELIEF_MM_PER_MPA * judged_pressure
    cells = np.array([(2, *pair) for pair in pairs], dtype=np.int64).ravel()
    line = pyvista.PolyData((points + heights[:, None] * normals)[is_on_rail], lines=cells)
    line.point_data["contact_pressure_MPa"] = contact_pressure[is_on_rail]
    return line
