"""What a pressure field on a grid says of the contact patch: peak, area, semi-axes, extents, centre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

Floats = NDArray[np.float64]

# The ellipse is fitted where p is above this part of the peak: nodes at the edge carry the discretisation error.
_FIT_FROM = 0.5


@dataclass(frozen=True, kw_only=True)
class Patch:
    """Measures of a contact patch.

    Attributes
    ----------
    p_max_MPa
        Largest nodal pressure.
    area_mm2, extent_x_mm, extent_y_mm
        Area of the patch and full lengths of its bounding box, from the line where p^2 falls to zero between nodes.
    a_mm, b_mm
        Semi-axes along x and across of the ellipsoid p^2 = p0^2 (1 - (x/a)^2 - (y/b)^2) fitted around the peak; NaN
        where the pressure around the peak is no ellipsoid (fewer than 6 nodes, or not concave).
    centre_x_mm, centre_y_mm
        Centre of pressure, from the first touch point.
    pieces
        Number of separate patches.
    """

    p_max_MPa: float
    area_mm2: float
    a_mm: float
    b_mm: float
    extent_x_mm: float
    extent_y_mm: float
    centre_x_mm: float
    centre_y_mm: float
    pieces: int


def measure_patch(x_mm: Floats, s_mm: Floats, pressure_MPa: Floats, *, half: bool) -> Patch:
    """Measure a pressure (nx, ns) in MPa on a uniform grid x (nx,), s (ns,) in mm; a half model is mirrored."""
    if half:
        x_mm = np.concatenate([-x_mm[:0:-1], x_mm])
        pressure_MPa = np.concatenate([pressure_MPa[:0:-1], pressure_MPa])
    p = pressure_MPa
    area, low, high = _outline(x_mm, s_mm, p)
    a, b = _fitted_axes(x_mm, s_mm, p)
    total = float(p.sum())
    return Patch(
        p_max_MPa=float(p.max()),
        area_mm2=area,
        a_mm=a,
        b_mm=b,
        extent_x_mm=high[0] - low[0],
        extent_y_mm=high[1] - low[1],
        centre_x_mm=float(x_mm @ p.sum(axis=1)) / total,
        centre_y_mm=float(s_mm @ p.sum(axis=0)) / total,
        pieces=int(label(p > 0.0, structure=np.ones((3, 3)))[1]),
    )


def signed_square(pressure: Floats) -> Floats:
    """p^2 inside the patch, continued by extrapolation to negative values on the nodes around it.

    p^2 of a Hertz contact is a paraboloid, so the continuation along a grid line through its last three nodes is exact.
    """
    q = pressure**2
    inside = pressure > 0.0
    padded_q, padded_in = np.pad(q, 3), np.pad(inside, 3)
    total, count = np.zeros_like(padded_q), np.zeros_like(padded_q)
    for axis in (0, 1):
        for step in (1, -1):
            q1, q2, q3 = (np.roll(padded_q, step * k, axis) for k in (1, 2, 3))
            i1, i2, i3 = (np.roll(padded_in, step * k, axis) for k in (1, 2, 3))
            value = np.where(i3, 3.0 * q1 - 3.0 * q2 + q3, np.where(i2, 2.0 * q1 - q2, -q1))
            here = i1 & ~padded_in
            total += np.where(here, np.minimum(value, -1e-3 * q1), 0.0)
            count += here
    outside = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    # nodes that touch the patch by a corner only: the mean of their extrapolated neighbours on both sides of it
    corner = np.zeros_like(outside)
    known = np.nan_to_num(outside)
    for axis in (0, 1):
        for step in (1, -1):
            corner += np.roll(known, step, axis)
    outside = np.where(np.isnan(outside), np.minimum(corner, -1e-9 * q.max()), outside)
    return np.asarray(np.where(padded_in, padded_q, outside)[2:-2, 2:-2])


def _outline(x: Floats, s: Floats, p: Floats) -> tuple[float, tuple[float, float], tuple[float, float]]:
    from contourpy import contour_generator

    hx, hs = x[1] - x[0], s[1] - s[0]
    x = np.concatenate([[x[0] - hx], x, [x[-1] + hx]])
    s = np.concatenate([[s[0] - hs], s, [s[-1] + hs]])
    lines = cast(list[Floats], contour_generator(x=s, y=x, z=signed_square(p)).lines(0.0))
    area = 0.0
    for line in lines:
        u, v = np.asarray(line).T
        area += 0.5 * float(np.dot(u[:-1], v[1:]) - np.dot(u[1:], v[:-1]))
    points = np.vstack(lines)
    low, high = points.min(axis=0), points.max(axis=0)
    return abs(area), (float(low[1]), float(low[0])), (float(high[1]), float(high[0]))


def _fitted_axes(x: Floats, s: Floats, p: Floats) -> tuple[float, float]:
    groups, _ = label(p > _FIT_FROM * p.max())
    mask = groups == groups[np.unravel_index(np.argmax(p), p.shape)]
    i, j = np.nonzero(mask)
    if i.size < 6:
        return float("nan"), float("nan")
    xs, ss = x[i], s[j]
    columns = np.column_stack([np.ones(i.size), xs, ss, xs**2, xs * ss, ss**2])
    c, _, rank, _ = np.linalg.lstsq(columns, p[mask] ** 2, rcond=None)
    quadratic = -np.array([[c[3], 0.5 * c[4]], [0.5 * c[4], c[5]]])
    if rank < 6 or np.linalg.eigvalsh(quadratic)[0] <= 0.0:
        return float("nan"), float("nan")
    top = c[0] + 0.25 * np.array(c[1:3]) @ np.linalg.solve(quadratic, np.array(c[1:3]))
    return float(np.sqrt(top / quadratic[0, 0])), float(np.sqrt(top / quadratic[1, 1]))
