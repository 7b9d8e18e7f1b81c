"""Judged pressure as a relief on the rail: numbers for a page, and a still picture."""

from __future__ import annotations

from typing import Any

import numpy as np

from fecontact.arrays import Floats
from fecontact.judging.judged_load import JudgedLoad
from fecontact.outputs.figures.pressure_maps import PressureFields, ellipse_outline
from fecontact.outputs.parts import Picture
from fecontact.outputs.style import blank_figure, render_image
from fecontact.placement.wheel_on_rail import Placement

# Largest number of lines of nodes along and across. A page draws all of them in each frame.
_MAX_LINES = 110
# Height of the highest pressure, as a fraction of the longest side of the shown area.
_RELATIVE_HEIGHT = 0.3
# Distances of lines on the rail around the patch, as fractions of the length of the patch.
_SURROUNDINGS = np.linspace(0.05, 0.4, 8)


def relief_picture(load: JudgedLoad, placement: Placement) -> Picture:
    """Picture of the pressure on the rail as a coloured relief.

    The pressure on the finer nodes is raised along the normals of the rail, and Hertz's ellipse is drawn too. Lengths
    are in mm from the first contact point, pressures in whole MPa. If there are more than 110 lines of nodes along or
    across, every second line, every third line and so on are shown.

    Parameters
    ----------
    load
        Judged load.
    placement
        Placement of the load.

    Returns
    -------
    Picture
        Still picture with the numbers of the relief.
    """
    fields = PressureFields.of(load)
    (x, x_index), (s, s_index) = _grid_lines(fields, across=False), _grid_lines(fields, across=True)
    points, normals = placement.surface(0.0, s)
    is_on_rail = np.isfinite(points).all(axis=-1)
    s, s_index, points, normals = s[is_on_rail], s_index[is_on_rail], points[is_on_rail], normals[is_on_rail]
    first = placement.first
    y, z = points[:, 1] - first.y_mm, points[:, 2] - first.z_mm
    pressure = np.zeros((x.size, s.size))
    pressure[np.ix_(x_index >= 0, s_index >= 0)] = fields.fe[np.ix_(x_index[x_index >= 0], s_index[s_index >= 0])]
    relief: dict[str, Any] = {
        "x": _rounded_list(x),
        "y": _rounded_list(y),
        "z": _rounded_list(z),
        "ny": _rounded_list(normals[:, 1]),
        "nz": _rounded_list(normals[:, 2]),
        "p": np.rint(pressure).astype(int).ravel().tolist(),
        "peak_MPa": round(load.comparison.fe.p_max_MPa),
        "mm_per_MPa": _RELATIVE_HEIGHT * max(np.ptp(x), np.ptp(s)) / float(fields.fe.max()),
        "ellipse": _rounded_list(_ellipse_rows(fields, placement)),
        "sides": ["gauge side", "field side"],
    }
    words = "Pressure of the finite elements on the rail, as height and colour; dashed: Hertz's ellipse."
    return Picture(content=_still_picture(x, y, z, normals, pressure, relief), words=words, width=900, relief=relief)


def _grid_lines(fields: PressureFields, *, across: bool) -> tuple[Floats, Any]:
    """Positions (mm) of drawn grid lines, and their indices in the grid.

    The lines cover the drawn section. If the section has more than `_MAX_LINES` lines, only every n-th is drawn.
    Further lines around the section show the surroundings; their index is -1.

    Parameters
    ----------
    fields
        Pressures on a grid, with the limits of the picture.
    across
        Whether the positions are across the rail (s), and not along it (x).

    Returns
    -------
    positions, indices : ndarray of shape (n,)
        Ascending positions in mm, and indices along that axis of the grid.
    """
    coordinates_mm, (low, high) = (fields.grid.s_mm if across else fields.grid.x_mm), fields.limits_mm(across=across)
    indices = np.flatnonzero((coordinates_mm >= low) & (coordinates_mm <= high))
    indices = indices[:: -(-indices.size // _MAX_LINES)]
    distances = _SURROUNDINGS * (coordinates_mm[indices[-1]] - coordinates_mm[indices[0]])
    places_mm = np.concatenate(
        [coordinates_mm[indices[0]] - distances[::-1], coordinates_mm[indices], coordinates_mm[indices[-1]] + distances]
    )
    return places_mm, np.pad(indices, distances.size, constant_values=-1)


def _ellipse_rows(fields: PressureFields, placement: Placement) -> Floats:
    """Rows of the points of Hertz's ellipse, which is closed.

    A row has x, y, z (mm), the normal (y, z) and the pressure of the elements (MPa). Points beyond the running surface
    are left out.
    """
    from scipy.interpolate import RegularGridInterpolator

    s, x = ellipse_outline(fields.ellipse)
    points, normals = placement.surface(x, s)
    grid = (fields.grid.x_mm, fields.grid.s_mm)
    pressure = RegularGridInterpolator(grid, fields.fe, bounds_error=False, fill_value=0.0)((x, s))
    first = placement.first
    rows = np.column_stack([x, points[:, 1] - first.y_mm, points[:, 2] - first.z_mm, normals[:, 1:], pressure])
    return np.asarray(rows[np.isfinite(rows).all(axis=1)], dtype=float)


def _rounded_list(values: Floats) -> Any:
    return np.round(values, 4).tolist()


def _still_picture(x: Floats, y: Floats, z: Floats, normals: Floats, pressure: Floats, relief: dict[str, Any]) -> Any:
    """Still picture of the relief, from the first viewpoint of the page.

    Parameters
    ----------
    x
        Positions (nx,) along in mm.
    y, z
        Points (ns,) of the rail's surface in mm.
    normals
        Normals (ns, 3) of the surface.
    pressure
        Pressure (nx, ns) in MPa.
    relief
        Data of the page, with the scale `mm_per_MPa`, the peak and the ellipse.
    """
    from matplotlib import colormaps

    figure = blank_figure(8.0, 5.5)
    ax: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    height = relief["mm_per_MPa"] * pressure
    face_colours = colormaps["viridis"](pressure / relief["peak_MPa"])
    face_colours[pressure <= 0.0] = (0.66, 0.67, 0.7, 1.0)
    coordinates = (np.broadcast_to(x[:, None], pressure.shape), y + height * normals[:, 1], z + height * normals[:, 2])
    ax.plot_surface(*coordinates, facecolors=face_colours, rcount=80, ccount=80, linewidth=0, antialiased=False)
    rows = np.array(relief["ellipse"])
    ax.plot(*(rows[:, :3] + relief["mm_per_MPa"] * rows[:, 5:] * np.insert(rows[:, 3:5], 0, 0.0, axis=1)).T, "w--")
    ax.set(xlabel="x (rolling) in mm", ylabel="y across in mm", zlabel="z in mm")
    ax.set_aspect("equal")
    ax.view_init(elev=45, azim=-130)
    return render_image(figure)
