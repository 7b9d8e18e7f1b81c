"""Measures of a contact patch from its pressure on a grid: peak, area, semi-axes, extents, centre, lobes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, binary_erosion, label

from fecontact.arrays import Floats
from fecontact.contact.grid import Field

# A continuation uses three nodes.
_REACH = 3
# A peak is a lobe if the pressure falls on both its sides by this part of the highest peak; else it is a shoulder. On
# single patches with a known pressure there is no fall at all.
_LEAST_VALLEY = 0.05


@dataclass(frozen=True, kw_only=True)
class Lobe:
    """A peak of the pressure across, from valley to valley: place, height, and part of the force."""

    y_mm: float
    p_max_MPa: float
    force_share: float


@dataclass(frozen=True, kw_only=True)
class Patch:
    """Measures of a contact patch.

    Attributes
    ----------
    p_max_MPa
        Peak pressure: the top of a fit of p^2 on the nine nodes around the highest node.
    area_mm2, extent_x_mm, extent_y_mm
        Area of the patch and full lengths of its bounding box, from the line where p^2 falls to zero between nodes.
    a_mm, b_mm
        Half-widths along x and across from the second moments of the pressure about its centre, sqrt(5 <x^2>) and
        sqrt(5 <y^2>): the semi-axes of a Hertz ellipse along x and y, or half the extents of a turned ellipse.
    centre_x_mm, centre_y_mm
        Centre of pressure, from the first touch point.
    lobes
        Peaks of the largest pressure on each line along x, from the highest down.
    valley
        Prominence of the second most prominent peak, over the highest peak: 0 for a single peak, and the height of the
        peak for a separate patch.
    pieces
        Number of separate patches.
    separate_load
        Part of the force on all patches except the patch that carries most.
    """

    p_max_MPa: float
    area_mm2: float
    a_mm: float
    b_mm: float
    extent_x_mm: float
    extent_y_mm: float
    centre_x_mm: float
    centre_y_mm: float
    lobes: tuple[Lobe, ...]
    valley: float
    pieces: int
    separate_load: float


def measure_patch(pressure: Field) -> Patch:
    """Measure a pressure (nx, ns) in MPa on a grid of one band or several."""
    whole = pressure.whole()
    x_mm, s_mm, p = whole.grid.x_mm, whole.grid.s_mm, whole.values
    force = p * whole.grid.weights
    # A node at the edge stands for a cell that is only partly in contact: with it the line of zero pressure lies too
    # far out, without it too far in, both by an error of first order in the element size; their mean is of higher
    # order.
    outer, inner = (_outline(x_mm, s_mm, signed_square(p, without_edge=w)) for w in (False, True))
    area, extent_x, extent_s = 0.5 * (outer + inner)
    total = float(force.sum())
    along_x, across = force.sum(axis=1) / total, force.sum(axis=0) / total
    centre_x, centre_s = float(x_mm @ along_x), float(s_mm @ across)
    lobes, valley = _lobes(p, across, s_mm)
    pieces = label(p > 0.0, structure=np.ones((3, 3)))[0]
    forces = np.bincount(pieces.ravel(), weights=force.ravel())[1:]
    return Patch(
        p_max_MPa=_top(p),
        area_mm2=float(area),
        a_mm=float(np.sqrt(5.0 * ((x_mm - centre_x) ** 2 @ along_x))),
        b_mm=float(np.sqrt(5.0 * ((s_mm - centre_s) ** 2 @ across))),
        extent_x_mm=float(extent_x),
        extent_y_mm=float(extent_s),
        centre_x_mm=centre_x,
        centre_y_mm=centre_s,
        lobes=lobes,
        valley=valley,
        pieces=forces.size,
        separate_load=float((forces.sum() - forces.max()) / forces.sum()),
    )


def _top(p: Floats) -> float:
    """Peak of a pressure (nx, ns) between its nodes."""
    i, j = (int(k) for k in np.unravel_index(np.argmax(p), p.shape))
    square = p[i - 1 : i + 2, j - 1 : j + 2] ** 2
    if i == 0 or j == 0 or square.shape != (3, 3) or not np.all(square > 0.0):
        return float(p[i, j])
    # least squares of c + g t + t H t / 2 on the nine nodes
    g = np.array([(square[2] - square[0]).sum(), (square[:, 2] - square[:, 0]).sum()]) / 6.0
    xx = (square[2] - 2.0 * square[1] + square[0]).sum() / 3.0
    ss = (square[:, 2] - 2.0 * square[:, 1] + square[:, 0]).sum() / 3.0
    xs = (square[2, 2] - square[2, 0] - square[0, 2] + square[0, 0]) / 4.0
    hessian = np.array([[xx, xs], [xs, ss]])
    if np.linalg.eigvalsh(hessian)[1] >= 0.0:
        return float(p[i, j])
    top = float(square.mean() - (xx + ss) / 3.0 - 0.5 * g @ np.linalg.solve(hessian, g))
    # a saddle beside a ridge must not be taken for a peak
    return float(np.sqrt(top)) if top <= 1.1 * float(square.max()) else float(p[i, j])


def _lobes(p: Floats, force: Floats, s: Floats) -> tuple[tuple[Lobe, ...], float]:
    """Lobes of a pressure (nx, ns) with these parts (ns,) of the force, from the highest down, and the valley."""
    ridge, seen, ends, valley = _windows(p)
    lobes = (
        Lobe(
            y_mm=float(s[peak - 1]),
            p_max_MPa=float(ridge[peak]),
            force_share=float(force[own.columns] @ own.parts),
        )
        for peak, own in zip(seen, _between(ridge, ends), strict=True)
    )
    return tuple(sorted(lobes, key=lambda lobe: -lobe.p_max_MPa)), valley


def valley_of(p: Floats) -> float:
    """The valley of a pressure (nx, ns), as in `Patch`."""
    return _windows(p)[3]


@dataclass(frozen=True, kw_only=True, eq=False)
class Window:
    """Where a lobe lies across.

    Attributes
    ----------
    columns
        From valley to valley, both included.
    parts (n,)
        How much of each of them is the lobe's: of a valley what lies on its side of the lowest place.
    low, high
        Its ends in columns, between them where the lowest place is.
    """

    columns: slice
    parts: Floats
    low: float
    high: float


def lobe_windows(p: Floats) -> tuple[Window, ...]:
    """Where each lobe of a pressure (nx, ns) lies, from the gauge side on."""
    ridge, _, ends, _ = _windows(p)
    return tuple(_between(ridge, ends))


def _between(ridge: Floats, ends: Sequence[int]) -> Iterator[Window]:
    """Windows between ends on a line of the largest pressures with zeros around, the outermost with all of theirs."""
    count = ridge.size - 2
    lowest = [0.0, *(k - 1 + _lowest(ridge[k - 1 : k + 2]) for k in ends[1:-1]), count - 1.0]
    for k, (low, high) in enumerate(pairwise(lowest)):
        columns = slice(ends[k] - 1, min(ends[k + 1], count))
        parts = np.ones(columns.stop - columns.start)
        if k > 0:
            parts[0] = 0.5 - (low - columns.start)
        if k + 2 < len(ends):
            parts[-1] = 0.5 + (high - (columns.stop - 1))
        yield Window(columns=columns, parts=parts, low=low, high=high)


def _lowest(three: Floats) -> float:
    """Where the parabola through three values is lowest: from the middle one, in steps; 0 on free surface."""
    bend = float(three[0] - 2.0 * three[1] + three[2])
    if three[1] == 0.0 or bend <= 0.0:
        return 0.0
    return float(np.clip(0.5 * (three[0] - three[2]) / bend, -0.5, 0.5))


def _windows(p: Floats) -> tuple[Floats, Any, list[int], float]:
    """Largest pressure of each column with zeros around, peaks on it, their ends, and the valley beside the highest."""
    ridge = np.concatenate(([0.0], p.max(axis=0), [0.0]))
    seen, valley = standing_peaks(ridge, _LEAST_VALLEY)
    ends = [1, *(int(a + np.argmin(ridge[a:b])) for a, b in pairwise(seen)), ridge.size - 1]
    return ridge, seen, ends, valley


def standing_peaks(ridge: Floats, least: float) -> tuple[NDArray[np.intp], float]:
    """Places of the peaks of a line between zeros, and the largest prominence of a peak other than the highest.

    A peak counts if the line falls by `least` of the highest peak on both its sides; the highest peak always counts.
    """
    highest = np.flatnonzero(ridge == ridge.max())
    rises, falls = np.diff(ridge[: highest[0] + 1]), np.diff(ridge[highest[0] :])
    if np.all(rises >= 0.0) and np.all(falls <= 0.0):
        # a single hill, or no pressure at all
        return np.array([(highest[0] + highest[-1]) // 2]), 0.0
    # a plateau is one peak, in its middle
    starts = np.flatnonzero(np.diff(ridge, prepend=np.nan) != 0.0)
    steps, middles = ridge[starts], (starts + np.append(starts[1:], ridge.size) - 1) // 2
    peaks = np.flatnonzero((steps[1:-1] > steps[:-2]) & (steps[1:-1] > steps[2:])) + 1
    # one of several equal peaks is taken as the highest: else the prominence of each would be its whole height
    ranked = steps.copy()
    ranked[peaks] *= 1.0 + 1e-9 * np.arange(peaks.size)
    prominences = np.array([_prominence(ranked, int(peak)) for peak in peaks]) / float(ridge.max())
    # without the highest peak, whose prominence is its height
    others = np.delete(prominences, int(np.argmax(ranked[peaks])))
    return middles[peaks[prominences >= least]], float(others.max(initial=0.0))


def _prominence(line: Floats, peak: int) -> float:
    """Prominence of a peak: how far a line falls on either side before it rises above the peak, the smaller of both.

    As scipy.signal.peak_prominences, whose import takes longer than all other work before a mesh.
    """
    higher = np.flatnonzero(line > line[peak])
    after = int(np.searchsorted(higher, peak))
    start = int(higher[after - 1]) + 1 if after else 0
    stop = int(higher[after]) if after < higher.size else line.size
    return float(line[peak] - max(line[start : peak + 1].min(), line[peak:stop].min()))


def signed_square(pressure: Floats, *, without_edge: bool = False) -> Floats:
    """p^2 inside the patch (nx, ns), continued to negative values around it: an array (nx + 2, ns + 2).

    p^2 of a Hertz contact is a paraboloid, so the continuation along a grid line through its last three nodes is exact.
    With `without_edge` the outermost nodes of the patch are replaced by the continuation from the nodes inside of them.
    """
    margin = 5
    box = tuple(_from_first_to_last(pressure.any(axis=1 - axis)) for axis in (0, 1))
    value = np.pad(pressure[box] ** 2, margin)
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
    value = value if without_edge else np.where(outside, np.minimum(value, lowest), value)
    square = np.full([n + 2 * margin for n in pressure.shape], lowest)
    square[tuple(slice(one.start, one.stop + 2 * margin) for one in box)] = np.where(known, value, lowest)
    return square[margin - 1 : 1 - margin, margin - 1 : 1 - margin]


def _from_first_to_last(pressed: Any) -> slice:
    """Lines of a grid from the first to the last one that is pressed."""
    lines = np.flatnonzero(pressed)
    return slice(lines[0], lines[-1] + 1) if lines.size else slice(0, 0)


def _continue_once(value: Floats, known: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.bool_]]:
    """Extrapolate along both grid directions to the nodes next to known ones.

    If several continuations reach a node, their mean is taken, preferring continuations through three nodes. If no
    continuation has two nodes to start from, the value is the negative neighbour.
    """
    next_to_known = binary_dilation(known) & ~known
    around, known_around = np.pad(value, _REACH), np.pad(known, _REACH)
    rows, columns = np.nonzero(next_to_known)
    total, count = np.zeros((2, rows.size)), np.zeros((2, rows.size))
    bare = np.zeros(rows.size)
    for along_x, across in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        places = [(rows + _REACH - k * along_x, columns + _REACH - k * across) for k in (1, 2, 3)]
        q1, q2, q3 = (around[place] for place in places)
        i1, i2, i3 = (known_around[place] for place in places)
        # beyond the line of zero pressure the value must stay negative
        for k, (usable, guess) in enumerate(((i2 & i3, 3.0 * q1 - 3.0 * q2 + q3), (i2 & ~i3, 2.0 * q1 - q2))):
            total[k] += np.where(i1 & usable, np.where(q1 < 0.0, q1, guess), 0.0)
            count[k] += i1 & usable
        bare = np.where(i1, np.minimum(bare, -np.abs(q1)), bare)
    # a straight line through two nodes lies above a paraboloid: used only if no three nodes are in line
    best = np.where(count[0] > 0.0, total[0] / np.maximum(count[0], 1.0), total[1] / np.maximum(count[1], 1.0))
    reached = count.sum(axis=0) > 0.0
    continued, here = np.zeros_like(value), np.zeros_like(known)
    continued[next_to_known] = np.where(reached, best, bare)
    here[next_to_known] = reached | (bare < 0.0)
    return continued, here


def area_between(pressure: Field, low_mm: float, high_mm: float) -> float:
    """Area (mm^2) of a patch between two lines across, computed as in `measure_patch`."""
    x, s, squares = _squares(pressure)
    return 0.5 * sum(float(_outline(x, s, square, (low_mm, high_mm))[0]) for square in squares)


# each lobe of a contact is cut out of it
@lru_cache(maxsize=1)
def _squares(pressure: Field) -> tuple[Floats, Floats, tuple[Floats, ...]]:
    """Lines of the whole grid, and the signed square with its outermost nodes and without."""
    whole = pressure.whole()
    squares = (signed_square(whole.values, without_edge=edge) for edge in (False, True))
    return whole.grid.x_mm, whole.grid.s_mm, tuple(squares)


def _clipped(line: Floats, low: float, high: float) -> Floats:
    """A closed line (n, 2) cut off where its first coordinate is below or above bounds."""
    for bound, sign in ((low, 1.0), (high, -1.0)):
        beyond = sign * (line[:, 0] - bound)
        inside, before, beyond_before = beyond >= 0.0, np.roll(line, 1, axis=0), np.roll(beyond, 1)
        cut = np.flatnonzero(inside != np.roll(inside, 1))
        part = (beyond_before[cut] / (beyond_before[cut] - beyond[cut]))[:, None]
        points = np.concatenate([before[cut] + part * (line[cut] - before[cut]), line[inside]])
        # where the line is cut comes before the point at its end
        line = points[np.argsort(np.concatenate([cut - 0.5, np.flatnonzero(inside)]))]
    return np.concatenate([line, line[:1]])


def _outline(x: Floats, s: Floats, square: Floats, between: tuple[float, float] | None = None) -> Floats:
    """Area and lengths of the bounding box (3,), inside the line where a signed square (nx + 2, ns + 2) is zero.

    The ring around the nodes is negative in it, so that each line is closed.
    """
    from contourpy import contour_generator

    hx, hs = x[1] - x[0], s[1] - s[0]
    x = np.concatenate([[x[0] - hx], x, [x[-1] + hx]])
    s = np.concatenate([[s[0] - hs], s, [s[-1] + (s[-1] - s[-2])]])
    # a patch that goes on beyond the grid ends with the last cells: half a step beyond their nodes
    square = square.copy()
    for each in (square, square.T):
        for ring, last in ((0, 1), (-1, -2)):
            each[ring] = np.minimum(each[ring], -np.abs(each[last]))
    lines = cast(list[Floats], contour_generator(x=s, y=x, z=square).lines(0.0))
    if between is not None:
        lines = [cut for line in lines if len(cut := _clipped(line[:-1], *between))]
        if not lines:
            return np.zeros(3)
    area = 0.0
    for line in lines:
        u, v = line.T
        area += 0.5 * float(np.dot(u[:-1], v[1:]) - np.dot(u[1:], v[:-1]))
    span = np.ptp(np.vstack(lines), axis=0)
    return np.array([abs(area), span[1], span[0]])
