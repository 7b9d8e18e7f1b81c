"""The contact as ParaView shows it: both pressures on the rail's surface, and Hertz's ellipse as a line."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.comparison.approximation import mean_pressure
from fecontact.contact.grid import Field
from fecontact.outputs.figures.pressure import ellipse_outline
from fecontact.solving.solve import CaseResult

Floats = NDArray[np.float64]

LIFT_MM = 1e-3
"""How far the contact lies above the rail, along its normals: in the rail's own surface both would flicker."""
RELIEF_MM_PER_MPA = 2e-3
"""Height of the pressure relief: the same for every case, so that reliefs can be compared."""


def contact_surface(result: CaseResult) -> Any:
    """The rail's contact surface as a pyvista mesh of quadrilaterals, their normals out of the rail.

    It lies `LIFT_MM` above the rail and holds both patches, as far as the rail has a surface there. Its nodes are those
    of the elements, and their pressure is what the bodies' displacements and stresses belong to. Arrays:
    `contact_pressure_MPa`, `hertz_pressure_MPa`, `pressure_difference_MPa` (finite elements minus Hertz), `gap_mm`
    (deformed; NaN beyond the nodes of the solution, where only Hertz presses), `in_contact` (0 or 1),
    `pressure_relief_mm` and `hertz_relief_mm` (both pressures as vectors along the normal, to warp by). Pressures are
    means over the cells of the nodes: both integrate to the force along the contact normal.
    """
    import pyvista

    fields, points, normals = _covering(result)
    index = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    surface = pyvista.PolyData.from_regular_faces((points + LIFT_MM * normals).reshape(-1, 3), quads)
    fe, hertz = fields["contact_pressure_MPa"], fields["hertz_pressure_MPa"]
    arrays: dict[str, NDArray[Any]] = {
        **fields,
        "pressure_difference_MPa": fe - hertz,
        # ParaView's readers take Booleans for field data
        "in_contact": (fe > 0.0).astype(np.uint8),
        "pressure_relief_mm": RELIEF_MM_PER_MPA * fe[..., None] * normals,
        "hertz_relief_mm": RELIEF_MM_PER_MPA * hertz[..., None] * normals,
    }
    for name, values in arrays.items():
        surface.point_data[name] = values.reshape(-1, *values.shape[2:])
    return surface


def _covering(result: CaseResult) -> tuple[dict[str, Floats], Floats, Floats]:
    """Fields (nx, ns), points (nx, ns, 3) and normals of the whole contact, far enough for Hertz's ellipse."""
    hertz = result.hertz
    lengths = (hertz.extent_x_mm, hertz.extent_y_mm)
    rung = result.load.level.on_elements
    pressure = rung.pressure.covering(*lengths)
    inside = Field(grid=rung.grid, values=np.ones(rung.grid.shape)).covering(*lengths).values > 0.0
    gap = Field(grid=rung.grid, values=rung.gap_mm).covering(*lengths).values
    grid = pressure.grid
    points, normals = result.placement.surface(grid.x_mm[:, None], grid.s_mm[None, :])
    # a rail ends where its profile does, also below an ellipse that does not know of it
    there = np.isfinite(points[0, :, 1])
    fields = {
        "contact_pressure_MPa": pressure.values,
        "hertz_pressure_MPa": mean_pressure(grid, hertz),
        "gap_mm": np.where(inside, gap, np.nan),
    }
    return {name: values[:, there] for name, values in fields.items()}, points[:, there], normals[:, there]


def ellipse_line(result: CaseResult) -> Any:
    """The edge of Hertz's ellipse on the rail as a closed line of pyvista, twice as far above it as the contact."""
    import pyvista

    s, x = ellipse_outline(result.hertz)
    points, normals = result.placement.surface(x, s)
    there = np.isfinite(points[:, 1])
    index = np.cumsum(there) - 1
    pairs = [(index[k], index[k + 1]) for k in range(len(s) - 1) if there[k] and there[k + 1]]
    lines = np.array([(2, *pair) for pair in pairs], dtype=np.int64).ravel()
    return pyvista.PolyData((points + 2.0 * LIFT_MM * normals)[there], lines=lines)
