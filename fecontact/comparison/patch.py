"""What a pressure field on a grid says of the contact patch: peak, area, semi-axes, extents, centre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, label

from fecontact.contact.grid import Field

Floats = NDArray[np.float64]

# The ellipse is fitted where p is above this part of the peak: nodes at the edge carry the discretisation error.
_FIT_FROM = 0.5
# A continuation goes through three nodes.
_REACH = 3


@dataclass(frozen=True, kw_only=True)
class Patch:
    """Measures of a contact patch.

    Attributes
    ----------
    p_max_MPa
        Largest nodal pressure.
    area_mm2, extent_x_mm, extent_y_mm
        Area of the patch and full lengths of its bounding box, from the line where p^2 falls to zero between nodes.
    area_spread_mm2
        Difference between the areas with and without the outermost nodes: how well the area can be read at all.
    a_mm, b_mm
        Principal semi-axes, a the one nearer to x, of the ellipsoid p^2 = p0^2 (1 - (x/a)^2 - (y/b)^2) fitted around
        the peak; NaN where the pressure there is no ellipsoid (fewer than 6 nodes, or not concave).
    centre_x_mm, centre_y_mm
        Centre of pressure, from the first touch point.
    pieces
        Number of separate patches.
    """

    p_max_MPa: float
    area_mm2: float
    area_spread_mm2: float
    a_mm: float
    b_mm: float
    extent_x_mm: float
    extent_y_mm: float
    centre_x_mm: float
    centre_y_mm: float
    pieces: int


def measure_patch(pressure: Field) -> Patch:
    """Measure a pressure (nx, ns) in MPa on a uniform grid."""
    whole = pressure.whole()
    x_mm, s_mm, p = whole.grid.x_mm, whole.grid.s_mm, whole.values
    # A node at the edge stands for a cell that is only partly in contact: with it the line of zero pressure lies too
    # far out, without it too far in, both by an error of first order in the element size; their mean is of higher
    # order.
    outer, inner = (_outline(x_mm, s_mm, signed_square(p, without_edge=w)) for w in (False, True))
    a, b = _fitted_axes(x_mm, s_mm, p)
    total = float(p.sum())
    return Patch(
        p_max_MPa=float(p.max()),
        area_mm2=0.5 * (outer.area + inner.area),
        area_spread_mm2=abs(outer.area - inner.area),
        a_mm=a,
        b_mm=b,
        extent_x_mm=0.5 * (outer.length_x + inner.length_x),
        extent_y_mm=0.5 * (outer.length_s + inner.length_s),
        centre_x_mm=float(x_mm @ p.sum(axis=1)) / total,
        centre_y_mm=float(s_mm @ p.sum(axis=0)) / total,
        pieces=int(label(p > 0.0, structure=np.ones((3, 3)))[1]),
    )


def signed_square(pressure: Floats, *, without_edge: bool = False) -> Floats:
    """p^2 inside the patch (nx, ns), continued to negative values around it: an array (nx + 2, ns + 2).

    p^2 of a Hertz contact is a paraboloid, so the continuation along a grid line through its last three nodes is exact.
    With `without_edge` the outermost nodes of the patch are replaced by the continuation from the nodes inside of them.
    """
    margin = 5
    value = np.pad(pressure**2, margin)
    known = value > 0.0
    core = binary_erosion(known, structure=np.ones((3, 3)))
    if without_edge and np.any(core):
        known = core
    outside = value == 0.0
    for _ in range(3):
        continued, here = _continue_once(value, known)
        value = np.where(here, continued, value)
        known = known | here
    lowest = -1e-3 * float(value.max())
    value = np.where(outside & ~without_edge, np.minimum(value, lowest), value)
    value = np.where(known, value, lowest)
    return np.asarray(value[margin - 1 : 1 - margin, margin - 1 : 1 - margin])


def _continue_once(value: Floats, known: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.bool_]]:
    """Extrapolate along both grid directions to the nodes next to known ones.

    The mean where several continuations reach a node, of those through three nodes if there are any; the negative
    neighbour where none has two nodes to start from.
    """
    total, count = np.zeros((2, *value.shape)), np.zeros((2, *value.shape))
    bare = np.zeros_like(value)
    around, known_around = np.pad(value, _REACH), np.pad(known, _REACH)
    for axis in (0, 1):
        for step in (1, -1):
            q1, q2, q3 = (_moved(around, step * k, axis) for k in (1, 2, 3))
            i1, i2, i3 = (_moved(known_around, step * k, axis) for k in (1, 2, 3))
            here = i1 & ~known
            # beyond the line of zero pressure the sign must not come back
            for k, (usable, guess) in enumerate(((i2 & i3, 3.0 * q1 - 3.0 * q2 + q3), (i2 & ~i3, 2.0 * q1 - q2))):
                total[k] += np.where(here & usable, np.where(q1 < 0.0, q1, guess), 0.0)
                count[k] += here & usable
            bare = np.where(here, np.minimum(bare, -np.abs(q1)), bare)
    # a straight line through two nodes lies above a paraboloid: only where no three nodes are in line
    best = np.where(count[0] > 0.0, total[0] / np.maximum(count[0], 1.0), total[1] / np.maximum(count[1], 1.0))
    reached = count.sum(axis=0) > 0.0
    return np.where(reached, best, bare), reached | (bare < 0.0)


def _moved(around: NDArray[Any], by: int, axis: int) -> NDArray[Any]:
    """An array that was padded by `_REACH`, moved along an axis, as a view without the padding."""
    window = [slice(_REACH, -_REACH), slice(_REACH, -_REACH)]
    window[axis] = slice(_REACH - by, around.shape[axis] - _REACH - by)
    return around[tuple(window)]


@dataclass(frozen=True, kw_only=True)
class _Outline:
    area: float
    length_x: float
    length_s: float


def _outline(x: Floats, s: Floats, square: Floats) -> _Outline:
    """Area and bounding box inside the line where a signed square (nx + 2, ns + 2) is zero."""
    from contourpy import contour_generator

    hx, hs = x[1] - x[0], s[1] - s[0]
    x = np.concatenate([[x[0] - hx], x, [x[-1] + hx]])
    s = np.concatenate([[s[0] - hs], s, [s[-1] + hs]])
    lines = cast(list[Floats], contour_generator(x=s, y=x, z=square).lines(0.0))
    area = 0.0
    for line in lines:
        u, v = line.T
        area += 0.5 * float(np.dot(u[:-1], v[1:]) - np.dot(u[1:], v[:-1]))
    span = np.ptp(np.vstack(lines), axis=0)
    return _Outline(area=abs(area), length_x=float(span[1]), length_s=float(span[0]))


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
    values, axes = np.linalg.eigh(quadratic)
    along_x = int(np.argmax(np.abs(axes[0])))
    return float(np.sqrt(top / values[along_x])), float(np.sqrt(top / values[1 - along_x]))
