"""Measures of a contact patch from its pressure on a grid.

The measures are the peak pressure, area, semi-axes, extents, centre of pressure, and lobes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats, find_range_below
from fecontact.contact.grid import Field

# Number of nodes that a continuation uses.
_CONTINUATION_NODES = 3
# A peak is a lobe if the pressure falls on both its sides by at least this fraction of the highest peak. If it falls
# less, then it is a shoulder. On single patches with a given pressure it does not fall at all.
_MIN_VALLEY_DEPTH = 0.05


@dataclass(frozen=True, kw_only=True)
class Lobe:
    """Peak of the pressure across, from valley to valley.

    Attributes
    ----------
    y_mm
        Position of the peak.
    p_max_MPa
        Peak pressure at a node.
    force_share
        Fraction of the force on the lobe.
    """

    y_mm: float
    p_max_MPa: float
    force_share: float


@dataclass(frozen=True, kw_only=True)
class Patch:
    """Measures of a contact patch.

    Attributes
    ----------
    p_max_MPa
        Peak pressure: the maximum of a fit of p^2 on the nine nodes around the highest node.
    area_mm2, extent_x_mm, extent_y_mm
        Area of the patch and full lengths of its bounding box, from the contour on which p^2 falls to zero between
        nodes.
    a_mm, b_mm
        Half-widths along x and across from the second moments of the pressure about its centre, sqrt(5 <x^2>) and
        sqrt(5 <y^2>). They are the semi-axes of a Hertz ellipse along x and y, or half the extents of a turned ellipse.
    centre_x_mm, centre_y_mm
        Centre of pressure, from the first contact point.
    lobes
        Peaks of the largest pressure on each line along x, in descending order.
    valley
        Prominence of the second most prominent peak, as a fraction of the highest peak. It is 0 for a single peak. For
        a separate patch, it is the height of the peak.
    patch_count
        Number of separate patches.
    separate_load
        Fraction of the force on all patches except the patch with the largest force.
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
    patch_count: int
    separate_load: float


def measure_patch(pressure: Field) -> Patch:
    """Measure the contact patch of a pressure.

    Parameters
    ----------
    pressure
        Pressure (nx, ns) in MPa on a grid with a single band or several bands.

    Returns
    -------
    Patch
        Measures of the whole contact, also for a half model.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.contact.grid import ContactGrid, Field
    >>> from fecontact.contact.patch import measure_patch
    >>> nodes = np.linspace(-1.5, 1.5, 31)
    >>> grid = ContactGrid(x_mm=nodes, s_mm=nodes, half=False)
    >>> hertz = np.sqrt(np.maximum(0.0, 1.0 - nodes[:, None] ** 2 - nodes**2))
    >>> patch = measure_patch(Field(grid=grid, values=1000.0 * hertz))
    >>> round(patch.p_max_MPa), round(patch.area_mm2, 1), len(patch.lobes)
    (1000, 3.1, 1)
    """
    from scipy.ndimage import label

    whole_field = pressure.whole()
    x_mm, s_mm, pressures = whole_field.grid.x_mm, whole_field.grid.s_mm, whole_field.values
    force = pressures * whole_field.grid.weights
    # The cell of a node at the edge is only partly in contact. With this node the contour of zero pressure lies too far
    # out, and without it too far in. Both errors are of first order in the element size. The error of their mean is of
    # higher order.
    outer_outline, inner_outline = (
        _measure_outline(x_mm, s_mm, build_signed_square(pressures, without_edge=without_edge))
        for without_edge in (False, True)
    )
    area, extent_x, extent_s = 0.5 * (outer_outline + inner_outline)
    total_force = float(force.sum())
    force_shares_x, force_shares_s = force.sum(axis=1) / total_force, force.sum(axis=0) / total_force
    centre_x, centre_s = float(x_mm @ force_shares_x), float(s_mm @ force_shares_s)
    lobes, valley = _measure_lobes(pressures, force_shares_s, s_mm)
    patch_numbers = label(pressures > 0.0, structure=np.ones((3, 3)))[0]
    forces = np.bincount(patch_numbers.ravel(), weights=force.ravel())[1:]
    return Patch(
        p_max_MPa=_interpolate_peak(pressures),
        area_mm2=float(area),
        a_mm=float(np.sqrt(5.0 * ((x_mm - centre_x) ** 2 @ force_shares_x))),
        b_mm=float(np.sqrt(5.0 * ((s_mm - centre_s) ** 2 @ force_shares_s))),
        extent_x_mm=float(extent_x),
        extent_y_mm=float(extent_s),
        centre_x_mm=centre_x,
        centre_y_mm=centre_s,
        lobes=lobes,
        valley=valley,
        patch_count=forces.size,
        separate_load=float((forces.sum() - forces.max()) / forces.sum()),
    )


def _interpolate_peak(pressure: Floats) -> float:
    """Interpolate the peak of a pressure (nx, ns) between its nodes.

    The squared pressure is fitted by a quadratic on nine nodes, because it is quadratic for Hertz. The largest nodal
    value in MPa is returned if the peak is at the edge of the grid, next to zero pressure, or not a maximum of the fit.
    """
    row, column = (int(index) for index in np.unravel_index(np.argmax(pressure), pressure.shape))
    square = pressure[row - 1 : row + 2, column - 1 : column + 2] ** 2
    if row == 0 or column == 0 or square.shape != (3, 3) or not np.all(square > 0.0):
        return float(pressure[row, column])
    # Least squares of c + g t + t H t / 2 on the nine nodes.
    gradient = np.array([(square[2] - square[0]).sum(), (square[:, 2] - square[:, 0]).sum()]) / 6.0
    xx = (square[2] - 2.0 * square[1] + square[0]).sum() / 3.0
    ss = (square[:, 2] - 2.0 * square[:, 1] + square[:, 0]).sum() / 3.0
    xs = (square[2, 2] - square[2, 0] - square[0, 2] + square[0, 0]) / 4.0
    hessian = np.array([[xx, xs], [xs, ss]])
    if np.linalg.eigvalsh(hessian)[1] >= 0.0:
        return float(pressure[row, column])
    peak_square = float(square.mean() - (xx + ss) / 3.0 - 0.5 * gradient @ np.linalg.solve(hessian, gradient))
    # A saddle near a ridge is not a peak.
    return float(np.sqrt(peak_square)) if peak_square <= 1.1 * float(square.max()) else float(pressure[row, column])


def _measure_lobes(pressure: Floats, force_shares: Floats, positions: Floats) -> tuple[tuple[Lobe, ...], float]:
    """Lobes in descending order of their peaks, and the depth of the valley (-).

    Parameters
    ----------
    pressure
        Pressure (nx, ns) in MPa.
    force_shares
        Fraction of the force on each column (ns,).
    positions
        Lateral position of each column (ns,) in mm.
    """
    ridge, peaks, ends, valley = _find_lobes(pressure)
    lobes = (
        Lobe(
            y_mm=float(positions[peak - 1]),
            p_max_MPa=float(ridge[peak]),
            force_share=float(force_shares[window.columns] @ window.parts),
        )
        for peak, window in zip(peaks, _split_at_valleys(ridge, ends), strict=True)
    )
    return tuple(sorted(lobes, key=lambda lobe: -lobe.p_max_MPa)), valley


def measure_valley_depth(pressure: Floats) -> float:
    """Depth of the valley of a pressure, as in `Patch`.

    Parameters
    ----------
    pressure : ndarray of shape (nx, ns)
        Pressure in MPa.

    Returns
    -------
    float
        Depth of the valley as a fraction of the highest peak.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.contact.patch import measure_valley_depth
    >>> round(measure_valley_depth(np.array([[0.0, 4.0, 1.0, 2.0, 0.0]])), 6)
    0.25
    """
    return _find_lobes(pressure)[3]


@dataclass(frozen=True, kw_only=True, eq=False)
class LobeWindow:
    """Range of columns of a lobe.

    Attributes
    ----------
    columns
        Columns from valley to valley, both included.
    parts : ndarray of shape (n,)
        Fraction of each column that belongs to the lobe. In a valley, it is the fraction on the side of the lobe of the
        minimum.
    low, high
        Ends of the lobe in columns: the positions of the minima, between the columns.
    """

    columns: slice
    parts: Floats
    low: float
    high: float


def find_lobe_windows(pressure: Floats) -> tuple[LobeWindow, ...]:
    """Range of columns of each lobe, from the gauge side on.

    Parameters
    ----------
    pressure : ndarray of shape (nx, ns)
        Pressure in MPa.

    Returns
    -------
    tuple of LobeWindow
        A window for each lobe.
    """
    ridge, _, ends, _ = _find_lobes(pressure)
    return tuple(_split_at_valleys(ridge, ends))


def _split_at_valleys(ridge: Floats, ends: Sequence[int]) -> Iterator[LobeWindow]:
    """Windows of the lobes between valleys.

    The outermost lobes have all of their outermost columns. A column with a valley is divided between its two lobes.

    Parameters
    ----------
    ridge
        Largest pressure of each column in MPa, with a zero at each end: column k of the grid is `ridge[k + 1]`.
    ends
        Ascending indices in `ridge` of the valleys, with the outermost bounds: n + 1 indices for n lobes.

    Yields
    ------
    LobeWindow
        Columns of a lobe, the fraction of each column, and the bounds as fractional column numbers of the grid.
    """
    column_count = ridge.size - 2
    minima = [
        0.0,
        *(number - 1 + _parabola_minimum(ridge[number - 1 : number + 2]) for number in ends[1:-1]),
        column_count - 1.0,
    ]
    for number, (low, high) in enumerate(pairwise(minima)):
        columns = slice(ends[number] - 1, min(ends[number + 1], column_count))
        fractions = np.ones(columns.stop - columns.start)
        if number > 0:
            fractions[0] = 0.5 - (low - columns.start)
        if number + 2 < len(ends):
            fractions[-1] = 0.5 + (high - (columns.stop - 1))
        yield LobeWindow(columns=columns, parts=fractions, low=low, high=high)


def _parabola_minimum(values: Floats) -> float:
    """Position of the minimum of the parabola through three values.

    It is relative to the middle value, in steps, and 0 on a free surface.
    """
    second_difference = float(values[0] - 2.0 * values[1] + values[2])
    if values[1] == 0.0 or second_difference <= 0.0:
        return 0.0
    return float(np.clip(0.5 * (values[0] - values[2]) / second_difference, -0.5, 0.5))


def _find_lobes(pressure: Floats) -> tuple[Floats, Any, list[int], float]:
    """Ridge of a pressure, its peaks, the ends of their lobes, and the valley.

    The ridge is the largest pressure of each column, with a zero at each end.
    """
    ridge = np.concatenate(([0.0], pressure.max(axis=0), [0.0]))
    peaks, valley = find_ridge_peaks(ridge, _MIN_VALLEY_DEPTH)
    ends = [1, *(int(low + np.argmin(ridge[low:high])) for low, high in pairwise(peaks)), ridge.size - 1]
    return ridge, peaks, ends, valley


def find_ridge_peaks(ridge: Floats, min_prominence: float) -> tuple[NDArray[np.intp], float]:
    """Find the peaks of a ridge, and the depth of its valley.

    A peak counts if the ridge falls on both its sides by at least `min_prominence` times the highest peak. The highest
    peak always counts.

    Parameters
    ----------
    ridge : ndarray of shape (n,)
        Values >= 0 with zeros at both ends.
    min_prominence
        Least prominence of a peak, as a fraction of the highest peak.

    Returns
    -------
    array (m,), float
        Indices of the peaks, and the largest prominence of all peaks except the highest peak, as a fraction of the
        highest peak.
    """
    highest = np.flatnonzero(ridge == ridge.max())
    rises, falls = np.diff(ridge[: highest[0] + 1]), np.diff(ridge[highest[0] :])
    if np.all(rises >= 0.0) and np.all(falls <= 0.0):
        # There is a single peak, or no pressure at all.
        return np.array([(highest[0] + highest[-1]) // 2]), 0.0
    # A plateau is a single peak at its middle.
    plateau_starts = np.flatnonzero(np.diff(ridge, prepend=np.nan) != 0.0)
    plateaus, middles = ridge[plateau_starts], (plateau_starts + np.append(plateau_starts[1:], ridge.size) - 1) // 2
    peaks = np.flatnonzero((plateaus[1:-1] > plateaus[:-2]) & (plateaus[1:-1] > plateaus[2:])) + 1
    # One of several equal peaks is ranked as the highest. Without a rank, the prominence of each would be its whole
    # height.
    distinct_plateaus = plateaus.copy()
    distinct_plateaus[peaks] *= 1.0 + 1e-9 * np.arange(peaks.size)
    prominences = np.array([_prominence(distinct_plateaus, int(peak)) for peak in peaks]) / float(ridge.max())
    # The prominence of the highest peak is its height, and does not count.
    other_prominences = np.delete(prominences, int(np.argmax(distinct_plateaus[peaks])))
    return middles[peaks[prominences >= min_prominence]], float(other_prominences.max(initial=0.0))


def _prominence(ridge: Floats, peak: int) -> float:
    """Prominence of a peak of a ridge.

    On each side, the ridge falls by some height before it rises above the peak. The prominence is the smaller of both
    heights. It equals the result of scipy.signal.peak_prominences, but the import of scipy.signal takes longer than all
    other work before a mesh.
    """
    start, stop = find_range_below(ridge, peak)
    return float(ridge[peak] - max(ridge[start : peak + 1].min(), ridge[peak:stop].min()))


def build_signed_square(pressure: Floats, *, without_edge: bool = False) -> Floats:
    """Square of a pressure, continued to negative values around the patch.

    The square of a Hertz pressure is a paraboloid, so that the continuation along a grid line through its last three
    nodes is exact.

    Parameters
    ----------
    pressure : ndarray of shape (nx, ns)
        Pressure in MPa.
    without_edge
        Whether the outermost nodes of the patch are replaced by the continuation from the nodes inside of them.

    Returns
    -------
    array (nx + 2, ns + 2)
        p^2 in MPa^2 inside the patch, and negative values around it, with a ring of nodes around the grid.
    """
    from scipy.ndimage import binary_erosion

    margin = 5
    box = tuple(_pressed_range(pressure.any(axis=1 - axis)) for axis in (0, 1))
    square = np.pad(pressure[box] ** 2, margin)
    is_valid = square > 0.0
    is_inner = binary_erosion(is_valid, structure=np.ones((3, 3)))
    if without_edge and np.any(is_inner):
        is_valid = is_inner
    is_outside = square == 0.0
    for _ in range(3):
        continuation, is_continued = _continue_once(square, is_valid)
        square = np.where(is_continued, continuation, square)
        is_valid = is_valid | is_continued
    lowest_square = -1e-3 * float(square.max())
    square = square if without_edge else np.where(is_outside, np.minimum(square, lowest_square), square)
    padded_square = np.full([count + 2 * margin for count in pressure.shape], lowest_square)
    padded_square[tuple(slice(axis_range.start, axis_range.stop + 2 * margin) for axis_range in box)] = np.where(
        is_valid, square, lowest_square
    )
    return padded_square[margin - 1 : 1 - margin, margin - 1 : 1 - margin]


def _pressed_range(is_pressed: Any) -> slice:
    """Range of grid lines from the first to the last line with pressure."""
    lines = np.flatnonzero(is_pressed)
    return slice(lines[0], lines[-1] + 1) if lines.size else slice(0, 0)


def _continue_once(squares: Floats, is_valid: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.bool_]]:
    """Extrapolate to the nodes next to valid nodes, along both grid directions.

    If several continuations reach a node, then the value is their mean. Continuations through three nodes are
    preferred. If no continuation has two nodes to start from, then the value is the negative neighbour.

    Parameters
    ----------
    squares
        Squared pressures (nx, ns).
    is_valid
        Mask (nx, ns) of the nodes with a value.

    Returns
    -------
    squares, is_valid
        Values and mask with the new nodes.
    """
    from scipy.ndimage import binary_dilation

    is_next_to_valid = binary_dilation(is_valid) & ~is_valid
    padded, padded_is_valid = np.pad(squares, _CONTINUATION_NODES), np.pad(is_valid, _CONTINUATION_NODES)
    rows, columns = np.nonzero(is_next_to_valid)
    total, count = np.zeros((2, rows.size)), np.zeros((2, rows.size))
    fallback = np.zeros(rows.size)
    for along_x, across in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        neighbours = [
            (rows + _CONTINUATION_NODES - order * along_x, columns + _CONTINUATION_NODES - order * across)
            for order in (1, 2, 3)
        ]
        q1, q2, q3 = (padded[neighbour] for neighbour in neighbours)
        is_valid_1, is_valid_2, is_valid_3 = (padded_is_valid[neighbour] for neighbour in neighbours)
        # Beyond the contour of zero pressure the value must stay negative.
        for order, (has_nodes, extrapolated) in enumerate(
            ((is_valid_2 & is_valid_3, 3.0 * q1 - 3.0 * q2 + q3), (is_valid_2 & ~is_valid_3, 2.0 * q1 - q2))
        ):
            total[order] += np.where(is_valid_1 & has_nodes, np.where(q1 < 0.0, q1, extrapolated), 0.0)
            count[order] += is_valid_1 & has_nodes
        fallback = np.where(is_valid_1, np.minimum(fallback, -np.abs(q1)), fallback)
    # A straight line through two nodes lies above a paraboloid. It is used only if there are no three nodes in a line.
    mean_extrapolated = np.where(
        count[0] > 0.0, total[0] / np.maximum(count[0], 1.0), total[1] / np.maximum(count[1], 1.0)
    )
    is_reached = count.sum(axis=0) > 0.0
    continuation, is_continued = np.zeros_like(squares), np.zeros_like(is_valid)
    continuation[is_next_to_valid] = np.where(is_reached, mean_extrapolated, fallback)
    is_continued[is_next_to_valid] = is_reached | (fallback < 0.0)
    return continuation, is_continued


def measure_area_between(pressure: Field, low_mm: float, high_mm: float) -> float:
    """Area of a patch between two positions across, as in `measure_patch`.

    Parameters
    ----------
    pressure
        Pressure (nx, ns) in MPa.
    low_mm, high_mm
        Positions across.

    Returns
    -------
    float
        Area in mm^2.
    """
    x, s, squares = _signed_squares(pressure)
    return 0.5 * sum(float(_measure_outline(x, s, square, (low_mm, high_mm))[0]) for square in squares)


# Cached: every lobe of a contact is cut from the squares of this contact.
@lru_cache(maxsize=1)
def _signed_squares(pressure: Field) -> tuple[Floats, Floats, tuple[Floats, ...]]:
    """Positions of the whole grid, and signed squares of a pressure.

    The first signed square has the outermost nodes, the second is without them.
    """
    whole_field = pressure.whole()
    squares = (build_signed_square(whole_field.values, without_edge=without_edge) for without_edge in (False, True))
    return whole_field.grid.x_mm, whole_field.grid.s_mm, tuple(squares)


def _clip_outline(contour: Floats, low: float, high: float) -> Floats:
    """Clip a closed contour (n, 2) to a range of its first coordinate.

    The result (m, 2) is closed: its first point is repeated at its end. Points are added at both bounds.
    """
    for bound, sign in ((low, 1.0), (high, -1.0)):
        excess = sign * (contour[:, 0] - bound)
        is_inside, previous, previous_excess = excess >= 0.0, np.roll(contour, 1, axis=0), np.roll(excess, 1)
        crossings = np.flatnonzero(is_inside != np.roll(is_inside, 1))
        fractions = (previous_excess[crossings] / (previous_excess[crossings] - excess[crossings]))[:, None]
        points = np.concatenate(
            [previous[crossings] + fractions * (contour[crossings] - previous[crossings]), contour[is_inside]]
        )
        # A crossing comes before the point at its end.
        contour = points[np.argsort(np.concatenate([crossings - 0.5, np.flatnonzero(is_inside)]))]
    return np.concatenate([contour, contour[:1]])


def _measure_outline(x: Floats, s: Floats, square: Floats, range_mm: tuple[float, float] | None = None) -> Floats:
    """Area and lengths of the bounding box (3,) of a contour.

    On the contour, a signed square (nx + 2, ns + 2) is zero. The ring around the nodes is negative in it, so that each
    contour is closed.
    """
    from contourpy import contour_generator

    step_x, step_s = x[1] - x[0], s[1] - s[0]
    x = np.concatenate([[x[0] - step_x], x, [x[-1] + step_x]])
    s = np.concatenate([[s[0] - step_s], s, [s[-1] + (s[-1] - s[-2])]])
    # A patch that continues beyond the grid ends with the last cells, half a step beyond their nodes.
    square = square.copy()
    for view in (square, square.T):
        for ring, last_row in ((0, 1), (-1, -2)):
            view[ring] = np.minimum(view[ring], -np.abs(view[last_row]))
    contours = cast(list[Floats], contour_generator(x=s, y=x, z=square).lines(0.0))
    if range_mm is not None:
        contours = [clipped for contour in contours if len(clipped := _clip_outline(contour[:-1], *range_mm))]
        if not contours:
            return np.zeros(3)
    area = 0.0
    for contour in contours:
        contour_s, contour_x = contour.T
        area += 0.5 * float(np.dot(contour_s[:-1], contour_x[1:]) - np.dot(contour_s[1:], contour_x[:-1]))
    span = np.ptp(np.vstack(contours), axis=0)
    return np.array([abs(area), span[1], span[0]])
