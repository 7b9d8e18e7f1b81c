"""The judged pressure as a relief on the rail: the numbers that a page turns, and a still picture of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from fecontact.arrays import Floats
from fecontact.judging.judged_load import JudgedLoad
from fecontact.outputs.figures.pressure_maps import PressureFields, ellipse_outline
from fecontact.outputs.parts import Picture
from fecontact.outputs.style import blank_figure, image_of
from fecontact.placement.wheel_on_rail import Placement

# So many lines of nodes along and across at most: a page draws them all in each frame.
_MOST_LINES = 110
# The highest pressure is raised by so much of the longest side of what is shown.
_RAISED = 0.3
# The rail around the patch, in parts of the patch, and its lines.
_AROUND = np.linspace(0.05, 0.4, 8)


def relief_picture(load: JudgedLoad, placement: Placement) -> Picture:
    """The finer nodes' pressure of a judged load on the rail, coloured and raised along its normals, with the ellipse.

    Lengths are in mm from the first touch point, pressures in whole MPa. Of more than 110 lines of nodes along or
    across every second one, every third one and so on are shown.
    """
    fields = PressureFields.of(load)
    (x, own_x), (s, own_s) = _lines(fields, across=False), _lines(fields, across=True)
    points, normals = placement.surface(0.0, s)
    there = np.isfinite(points).all(axis=-1)
    s, own_s, points, normals = s[there], own_s[there], points[there], normals[there]
    first = placement.first
    y, z = points[:, 1] - first.y_mm, points[:, 2] - first.z_mm
    pressure = np.zeros((x.size, s.size))
    pressure[np.ix_(own_x >= 0, own_s >= 0)] = fields.fe[np.ix_(own_x[own_x >= 0], own_s[own_s >= 0])]
    relief: dict[str, Any] = {
        "x": _short(x),
        "y": _short(y),
        "z": _short(z),
        "ny": _short(normals[:, 1]),
        "nz": _short(normals[:, 2]),
        "p": np.rint(pressure).astype(int).ravel().tolist(),
        "peak_MPa": round(load.comparison.fe.p_max_MPa),
        "mm_per_MPa": _RAISED * max(np.ptp(x), np.ptp(s)) / float(fields.fe.max()),
        "ellipse": _short(_ellipse(fields, placement)),
        "sides": ["gauge side", "field side"],
    }
    words = "Pressure of the finite elements on the rail, raised and coloured by it; dashed Hertz's ellipse."
    return Picture(content=_still(x, y, z, normals, pressure, relief), words=words, width=900, relief=relief)


def _lines(fields: PressureFields, *, across: bool) -> tuple[Floats, Any]:
    """Places (mm) of lines across or along, and their numbers in the grid; -1 for those around it."""
    line, (low, high) = (fields.grid.s_mm if across else fields.grid.x_mm), fields.limits_mm(across=across)
    own = np.flatnonzero((line >= low) & (line <= high))
    own = own[:: -(-own.size // _MOST_LINES)]
    around = _AROUND * (line[own[-1]] - line[own[0]])
    places = np.concatenate([line[own[0]] - around[::-1], line[own], line[own[-1]] + around])
    return places, np.pad(own, around.size, constant_values=-1)


def _ellipse(fields: PressureFields, placement: Placement) -> Floats:
    """Hertz's ellipse: x, y, z (mm), normal (y, z) and the elements' pressure (MPa) there, closed; rows of its points.

    Left out are points beyond the running surface.
    """
    from scipy.interpolate import RegularGridInterpolator

    s, x = ellipse_outline(fields.ellipse)
    points, normals = placement.surface(x, s)
    grid = (fields.grid.x_mm, fields.grid.s_mm)
    pressure = RegularGridInterpolator(grid, fields.fe, bounds_error=False, fill_value=0.0)((x, s))
    first = placement.first
    rows = np.column_stack([x, points[:, 1] - first.y_mm, points[:, 2] - first.z_mm, normals[:, 1:], pressure])
    return np.asarray(rows[np.isfinite(rows).all(axis=1)], dtype=float)


def _short(values: Floats) -> Any:
    return np.round(values, 4).tolist()


def _still(x: Floats, y: Floats, z: Floats, normals: Floats, pressure: Floats, relief: dict[str, Any]) -> Any:
    """A picture of the relief from the side from which a page shows it first."""
    from matplotlib import colormaps

    figure = blank_figure(8.0, 5.5)
    ax: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    raised = relief["mm_per_MPa"] * pressure
    faces = colormaps["viridis"](pressure / relief["peak_MPa"])
    faces[pressure <= 0.0] = (0.66, 0.67, 0.7, 1.0)
    shape = (np.broadcast_to(x[:, None], pressure.shape), y + raised * normals[:, 1], z + raised * normals[:, 2])
    ax.plot_surface(*shape, facecolors=faces, rcount=80, ccount=80, linewidth=0, antialiased=False)
    rows = np.array(relief["ellipse"])
    ax.plot(*(rows[:, :3] + relief["mm_per_MPa"] * rows[:, 5:] * np.insert(rows[:, 3:5], 0, 0.0, axis=1)).T, "w--")
    ax.set(xlabel="x (rolling) in mm", ylabel="y across in mm", zlabel="z in mm")
    ax.set_aspect("equal")
    ax.view_init(elev=45, azim=-130)
    return image_of(figure)
