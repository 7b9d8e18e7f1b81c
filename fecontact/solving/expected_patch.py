"""Where the patch will be: the true gap on a half-space, cheap enough to be solved before any mesh is made."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact.rung import Rung
from fecontact.errors import ConvergenceError, InputError
from fecontact.solving.line_ends import check_ends
from fecontact.solving.lobe_sizes import LobeSizes, lobe_sizes, semi_axes_of_elements_mm
from fecontact.solving.planes import angle_of_patches
from fecontact.solving.true_gap import TrueGap

Floats = NDArray[np.float64]

SLIDES = 2
"""Further solutions on a steep surface: the approach of the second one is that of the first to some 1e-3 already."""
_COARSE_STEP_S_MM = 0.2
_COARSE_NODES_X = 25
# Nodes follow a small lobe down to so much of what the others need.
_FINEST = 0.25
# Patches with more free surface between them than so many times the wider one's half width are far apart: each has
# elements of its own.
_FAR_APART = 1.0
# Seconds a solution, beyond it minutes; two patches of S1002 on 60E1 take up to 184 thousand.
_MOST_NODES = 200_000
FEWEST_NODES = 8.0
"""Nodes that are left to the least lobes where all of them would be more than are solved."""


@dataclass(frozen=True, kw_only=True)
class ExpectedPart:
    """A patch far from all others: from where to where across (mm), and how many times larger its elements may be.

    `semi_axes_mm` are its own half length along x and smaller half width across.
    """

    s_low_mm: float
    s_high_mm: float
    larger: float
    semi_axes_mm: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class ExpectedPatch:
    """Where the patch will be on the rail's surface (mm, from the first touch point), and its contact on a half-space.

    Attributes
    ----------
    x_low_mm, x_high_mm, s_low_mm, s_high_mm
        Its bounding box.
    semi_axis_x_mm, semi_axis_s_mm
        Half length and smaller half width that elements are made for: of the lobe that carries most, where it is not
        much wider than the narrowest one; small ones are left out.
    true_gap
        The gap under the load, with the slide of the bodies on a steep surface.
    half_space
        Contact of that gap on a half-space, with 32 nodes or more on each semi-axis, of small lobes too. Separate
        patches have a plane each; all else here is that of one plane for all.
    parts
        Patches far apart, from the gauge side on; a single one otherwise.
    """

    x_low_mm: float
    x_high_mm: float
    s_low_mm: float
    s_high_mm: float
    semi_axis_x_mm: float
    semi_axis_s_mm: float
    true_gap: TrueGap
    half_space: Rung
    parts: tuple[ExpectedPart, ...]

    def joined(self) -> ExpectedPatch:
        """Expected patch as if its parts were not far apart, with equal elements for all of them."""
        whole = ExpectedPart(
            s_low_mm=self.s_low_mm,
            s_high_mm=self.s_high_mm,
            larger=1.0,
            semi_axes_mm=(self.semi_axis_x_mm, self.semi_axis_s_mm),
        )
        return replace(self, parts=(whole,))


def expected_patch(
    true_gap: TrueGap, load_N: float, *, half: bool, nodes: int = 16, guess_mm: float = 0.1
) -> ExpectedPatch:
    """Solve the true gap on a half-space over all of the surface in reach, then again on a grid that fits the patch.

    On a steep surface the bodies slide along each other: both once more, with the slide of the approach that was found.

    Parameters
    ----------
    nodes
        Of the grid, on the narrowest semi-axis of the patch.
    guess_mm
        First guess of the approach; enlarged until the patch cannot reach further.

    Raises
    ------
    InputError
        If the patch reaches the end of a running surface, or a corner of one.
    ConvergenceError
        If the patch grows without bound, or its contact is not found.
    """
    expected = _expected(true_gap, load_N, half=half, nodes=nodes, guess_mm=guess_mm)
    for _ in range(SLIDES if true_gap.is_steep else 0):
        slid = true_gap.after(expected.half_space.approach_mm)
        expected = _expected(slid, load_N, half=half, nodes=nodes, guess_mm=guess_mm)
    gap, rung = expected.true_gap, expected.half_space
    angle = angle_of_patches(gap.placement, rung)
    if np.ptp(angle) == 0.0:
        return expected
    return replace(expected, half_space=_solve(gap, rung.grid, load_N, start=rung.pressure, angle_rad=angle))


def _expected(true_gap: TrueGap, load_N: float, *, half: bool, nodes: int, guess_mm: float) -> ExpectedPatch:
    reach = guess_mm
    for _ in range(12):
        grid = _coarse_grid(true_gap, reach, half=half)
        rung = _solve(true_gap, grid, load_N)
        approach = rung.approach_mm / true_gap.closing
        if approach < reach:
            break
        reach = 1.3 * approach
    else:
        raise ConvergenceError(
            f"the patch grows without bound under {load_N:g} N: the bodies conform all over; reduce the load"
        )
    for _ in range(2):
        rung = _solve(true_gap, _fitted_grid(rung, nodes), load_N, start=rung.pressure)
    return _patch_of(true_gap, rung)


def _coarse_grid(true_gap: TrueGap, reach_mm: float, *, half: bool) -> ContactGrid:
    (x_low, x_high), (s_low, s_high) = _region(true_gap, reach_mm, half)
    x = np.linspace(0.0 if half else x_low, x_high, _COARSE_NODES_X if half else 2 * _COARSE_NODES_X - 1)
    s = np.linspace(s_low, s_high, max(33, int(np.ceil((s_high - s_low) / _COARSE_STEP_S_MM)) + 1))
    return ContactGrid(x_mm=x, s_mm=s, half=half)


def _solve(
    true_gap: TrueGap,
    grid: ContactGrid,
    load_N: float,
    *,
    start: Field | None = None,
    angle_rad: Floats | None = None,
) -> Rung:
    """Contact on a grid, from a guess; refused where it ends at the end of a line or on a corner, or is not found."""
    gap = true_gap.on(grid)
    rung = true_gap.solve(grid, load_N, gap_mm=gap, start=start, angle_rad=angle_rad)
    check_ends(true_gap.placement, rung, gap)
    if rung.status != "converged":
        raise ConvergenceError(
            f"the contact on a half-space of {grid.shape[0]} by {grid.shape[1]} nodes did not converge (residual"
            f" {rung.residual:.1e} of the approach); another load or lateral shift may go"
        )
    return rung


def _region(true_gap: TrueGap, reach: float, half: bool) -> tuple[tuple[float, float], tuple[float, float]]:
    """Bounding box of the surface that comes together when the bodies approach rigidly by `reach`."""
    placement = true_gap.placement
    profile, origin = placement.rail.profile, placement.first_arc_length_mm
    height = 0.0 if placement.along is None else placement.along.height_mm
    width = 1.3 * np.sqrt(2.0 * placement.wheel.rolling_radius_mm * (reach + height))
    x = np.linspace(0.0 if half else -width, width, 15 if half else 29)
    # the profile's own sides and junction steps lie beyond any contact of running wheels
    s = np.arange(1e-6, profile.length_mm, _COARSE_STEP_S_MM) - origin
    _, normals = placement.surface(0.0, s)
    near = true_gap.gap(x[:, None], s[None, :]) <= reach * (normals @ true_gap.direction)
    rows, columns = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
    if columns.size == 0:
        return (-width, width), (-1.0, 1.0)
    if columns[0] == 0 or columns[-1] == s.size - 1:
        raise InputError(
            f"the contact reaches the end of the running surface of rail {profile.name}; reduce the load or the"
            " lateral shift, or give a longer profile line"
        )
    dx = x[1] - x[0]
    return (x[rows[0]] - dx, x[rows[-1]] + dx), (s[columns[0]] - _COARSE_STEP_S_MM, s[columns[-1]] + _COARSE_STEP_S_MM)


def _fitted_grid(rung: Rung, nodes: int) -> ContactGrid:
    grid, sizes = rung.grid, lobe_sizes(rung)
    (x_low, x_high), (s_low, s_high) = _bounds(rung)
    followed = followed_mm(sizes)
    step_x, step_s = (length / nodes for length in followed)
    most = _MOST_NODES * (1 if grid.half else 2)
    # the least lobes get fewer nodes where all of them would be too many, no others
    wanted = (x_high - x_low) * (s_high - s_low) / (most * step_x * step_s)
    fewer = min(max(1.0, 1.02 * math.sqrt(wanted)), nodes / FEWEST_NODES)
    step_x, step_s = (
        max(step, min(fewer * step, min(large) / nodes))
        for step, large in zip((step_x, step_s), zip(*sizes.large, strict=True), strict=True)
    )
    x_low = 0.0 if grid.half else x_low - 3.0 * step_x
    s_low = s_low - 3.0 * step_s
    count_x = int(np.ceil((x_high + 3.0 * step_x - x_low) / step_x))
    count_s = int(np.ceil((s_high + 3.0 * step_s - s_low) / step_s))
    if count_x * count_s > most:
        lobe = nodes * step_s
        raise ConvergenceError(
            f"a lobe of the contact is {lobe:.2g} mm from its peak to a valley, in a patch"
            f" {s_high - s_low:.1f} mm wide: nodes that follow it would be {count_x} by {count_s}, and at most {most}"
            f" are solved, which {lobe * count_x * count_s / most:.2g} mm or more need; give a lateral shift 0.2 mm"
            " beside it, or another load"
        )
    return ContactGrid(
        x_mm=np.asarray(x_low + step_x * np.arange(count_x + 1)),
        s_mm=np.asarray(s_low + step_s * np.arange(count_s + 1)),
        half=grid.half,
    )


def followed_mm(sizes: LobeSizes) -> tuple[float, float]:
    """Half length along x and half width across of the least lobes that nodes are made for."""
    along_x, across = (
        max(min(every), _FINEST * min(large))
        for every, large in zip(zip(*sizes.every, strict=True), zip(*sizes.large, strict=True), strict=True)
    )
    return along_x, across


def _patch_of(true_gap: TrueGap, rung: Rung) -> ExpectedPatch:
    (x_low, x_high), (s_low, s_high) = _bounds(rung)
    semi_axis_x, semi_axis_s = semi_axes_of_elements_mm(rung)
    return ExpectedPatch(
        x_low_mm=x_low,
        x_high_mm=x_high,
        s_low_mm=s_low,
        s_high_mm=s_high,
        semi_axis_x_mm=semi_axis_x,
        semi_axis_s_mm=semi_axis_s,
        true_gap=true_gap,
        half_space=rung,
        parts=_parts(rung, semi_axis_s),
    )


def _parts(rung: Rung, semi_axis_s: float) -> tuple[ExpectedPart, ...]:
    """Patches far apart, from the gauge side on; elements made for `semi_axis_s` across are those of the narrowest."""
    s, step = rung.grid.s_mm, rung.grid.steps_mm[1]
    below = np.flatnonzero(rung.pressure_MPa.any(axis=0))
    parts: list[tuple[int, int]] = []
    for patch in np.split(below, np.flatnonzero(np.diff(below) > 1) + 1):
        first, last = int(patch[0]), int(patch[-1])
        # joined to those before it as long as the surface between is too short
        while parts and first - parts[-1][1] - 1 <= 0.5 * _FAR_APART * max(
            last - first + 1, parts[-1][1] - parts[-1][0] + 1
        ):
            first = parts.pop()[0]
        parts.append((first, last))
    found = []
    for first, last in parts:
        alone = np.zeros_like(rung.pressure_MPa)
        alone[:, first : last + 1] = rung.pressure_MPa[:, first : last + 1]
        own = semi_axes_of_elements_mm(replace(rung, pressure_MPa=alone))
        found.append(
            ExpectedPart(
                s_low_mm=float(s[first] - 0.5 * step),
                s_high_mm=float(s[last] + 0.5 * step),
                larger=max(1.0, own[1] / semi_axis_s),
                semi_axes_mm=own,
            )
        )
    return tuple(found)


def _bounds(rung: Rung) -> tuple[tuple[float, float], tuple[float, float]]:
    """Bounding box of the contact, along x and across."""
    (x, s), (dx, ds), p = (rung.grid.x_mm, rung.grid.s_mm), rung.grid.steps_mm, rung.pressure_MPa
    rows, columns = np.flatnonzero(p.any(axis=1)), np.flatnonzero(p.any(axis=0))
    x_high = float(x[rows[-1]] + 0.5 * dx)
    x_low = -x_high if rung.grid.half else float(x[rows[0]] - 0.5 * dx)
    return (x_low, x_high), (float(s[columns[0]] - 0.5 * ds), float(s[columns[-1]] + 0.5 * ds))
