"""Where the patch will be: the true gap on a half-space, cheap enough to be solved before any mesh is made."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation
from scipy.signal import find_peaks

from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact.halfspace import half_space_problem
from fecontact.contact.rung import Rung
from fecontact.contact.solver import ContactSolution, solve_contact
from fecontact.errors import ConvergenceError, InputError
from fecontact.geometry.placement import OPEN_GAP_MM, Placement
from fecontact.profiles.curve import Profile

Floats = NDArray[np.float64]

_COARSE_STEP_S_MM = 0.2
_COARSE_NODES_X = 25
_NODES_A_SEMI_AXIS = 16
# A lobe does not decide about the element size if its peak is below this part of the highest one, or its load below
# that part of the whole.
_LESSER_PEAK = 0.5
_LESSER_LOAD = 0.1
# A peak is a lobe of its own if the pressure falls by this part of the highest peak on both sides of it.
_VALLEY = 0.15
# A kink by less than this turns the surface less than a patch's own curvature does (5 mm on R 300: 0.017).
_CORNER_RAD = 0.02


@dataclass(frozen=True, kw_only=True)
class ExpectedPatch:
    """Extent of the patch on the rail's surface from the first touch point, and its narrowest lobe's size (mm).

    `half_space` is the contact of the true gap on a half-space, with 16 nodes a semi-axis.
    """

    x_low_mm: float
    x_high_mm: float
    s_low_mm: float
    s_high_mm: float
    semi_axis_x_mm: float
    semi_axis_s_mm: float
    half_space: Rung


def approach_direction(placement: Placement, *, normal_force: bool) -> Floats:
    """Unit vector along which the load acts and the bodies approach: vertical, or the contact normal at first touch."""
    return placement.first.normal if normal_force else np.array([0.0, 0.0, 1.0])


def expected_patch(
    placement: Placement,
    load_N: float,
    *,
    contact_modulus_MPa: float,
    direction: Floats,
    half: bool,
    guess_mm: float = 0.1,
) -> ExpectedPatch:
    """Solve the true gap on a half-space over all of the surface in reach, then again on a grid that fits the patch.

    Parameters
    ----------
    direction (3,)
        Unit vector along which the load acts.
    guess_mm
        First guess of the approach; enlarged until the patch cannot reach further.

    Raises
    ------
    InputError
        If the patch reaches the end of a running surface, or a corner of one.
    ConvergenceError
        If the patch grows without bound, or its contact is not found.
    """
    space = _HalfSpace(placement=placement, modulus=contact_modulus_MPa, direction=direction, load_N=load_N, half=half)
    reach = guess_mm
    for _ in range(12):
        (x_low, x_high), (s_low, s_high) = _region(placement, reach, direction, half)
        x = np.linspace(0.0 if half else x_low, x_high, _COARSE_NODES_X if half else 2 * _COARSE_NODES_X - 1)
        s = np.linspace(s_low, s_high, max(33, int(np.ceil((s_high - s_low) / _COARSE_STEP_S_MM)) + 1))
        rung, approach = space.solve(ContactGrid(x_mm=x, s_mm=s, half=half))
        if approach < reach:
            break
        reach = 1.3 * approach
    else:
        raise ConvergenceError(
            f"the patch grows without bound under {load_N:g} N: the bodies conform all over; reduce the load"
        )
    for _ in range(2):
        rung, _ = space.solve(_fitted_grid(_box(rung)))
    return _box(rung)


@dataclass(frozen=True, kw_only=True, eq=False)
class _HalfSpace:
    """The true gap of a placement on a half-space under one load."""

    placement: Placement
    modulus: float
    direction: Floats
    load_N: float
    half: bool

    def solve(self, grid: ContactGrid) -> tuple[Rung, float]:
        """Contact on a grid, and the approach along the load."""
        _, normals = self.placement.surface(0.0, grid.s_mm)
        weights = np.full(grid.shape, grid.steps_mm[0] * grid.steps_mm[1])
        if self.half:
            weights[1:] *= 2.0
        problem = half_space_problem(
            grid,
            self.placement.gap(grid.x_mm[:, None], grid.s_mm[None, :]).ravel(),
            closing=np.tile(normals @ self.direction, grid.shape[0]),
            contact_modulus_MPa=self.modulus,
        )
        # whole cells at the ends too: the patch does not come there
        solution = solve_contact(replace(problem, area_mm2=weights.ravel()), self.load_N, tolerance=1e-5)
        self._check_ends(grid, solution, problem.gap_mm)
        if solution.status != "converged":
            raise ConvergenceError(
                f"the contact on a half-space of {grid.shape[0]} by {grid.shape[1]} nodes did not converge (residual"
                f" {solution.residual:.1e} of the approach); another load or lateral shift may go"
            )
        upright = self.placement.first.normal
        approach = solution.approach_mm * float(self.direction @ upright)
        rung = Rung.of(grid, solution, approach_mm=approach, upright=np.tile(normals @ upright, grid.shape[0]))
        return rung, solution.approach_mm

    def _check_ends(self, grid: ContactGrid, solution: ContactSolution, gap_mm: Floats) -> None:
        """Refuse a contact at the end of the wheel's line or on a corner: its pressure has no finite value there."""
        in_contact = Field.of_nodes(grid, solution.in_contact).values
        nothing_above = Field.of_nodes(grid, gap_mm >= OPEN_GAP_MM).values
        if np.any(binary_dilation(nothing_above, structure=np.ones((3, 3))) & in_contact):
            raise InputError(
                f"the contact reaches the end of the running surface of wheel {self.placement.wheel.profile.name};"
                " reduce the load, change the lateral shift, or give a longer profile line"
            )
        below = grid.s_mm[in_contact.any(axis=0)]
        for profile, y, arc in _corners(self.placement):
            # its own cell counts: the pressure ends at a corner that it cannot pass
            if below[0] - grid.steps_mm[1] <= arc <= below[-1] + grid.steps_mm[1]:
                raise InputError(
                    f"the contact reaches a corner of {profile.kind} {profile.name} at y = {y:.2f} mm, where its"
                    " pressure has no finite value; change the lateral shift, or round the corner in the profile"
                )


def _corners(placement: Placement) -> list[tuple[Profile, float, float]]:
    """Convex corners of both profiles: y and arc length from the touch point (mm)."""
    found = []
    touch = placement.first
    for profile, u in ((placement.rail.profile, touch.rail_u), (placement.wheel.profile, touch.wheel_u)):
        turns = (
            (junction.y_mm, math.remainder(junction.angle_right_rad - junction.angle_left_rad, math.tau))
            for junction in profile.junctions
        )
        y = np.array([place for place, turn in turns if profile.convex_sign * turn > _CORNER_RAD])
        arcs = profile.arc_length(profile.locate(y)) - float(profile.arc_length(u))
        found += [(profile, float(at), float(arc)) for at, arc in zip(y, arcs, strict=True)]
    return found


def _region(
    placement: Placement, reach: float, direction: Floats, half: bool
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Bounding box of the surface that comes together when the bodies approach rigidly by `reach`."""
    profile, origin = placement.rail.profile, placement.first_arc_length_mm
    width = 1.3 * np.sqrt(2.0 * placement.wheel.rolling_radius_mm * reach)
    x = np.linspace(0.0 if half else -width, width, 15 if half else 29)
    # the profile's own sides and junction steps lie beyond any contact of running wheels
    s = np.arange(1e-6, profile.length_mm, _COARSE_STEP_S_MM) - origin
    _, normals = placement.surface(0.0, s)
    near = placement.gap(x[:, None], s[None, :]) <= reach * (normals @ direction)
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


def _fitted_grid(box: ExpectedPatch) -> ContactGrid:
    half = box.half_space.grid.half
    step_x, step_s = box.semi_axis_x_mm / _NODES_A_SEMI_AXIS, box.semi_axis_s_mm / _NODES_A_SEMI_AXIS
    x_low = 0.0 if half else box.x_low_mm - 3.0 * step_x
    s_low = box.s_low_mm - 3.0 * step_s
    count_x = int(np.ceil((box.x_high_mm + 3.0 * step_x - x_low) / step_x))
    count_s = int(np.ceil((box.s_high_mm + 3.0 * step_s - s_low) / step_s))
    return ContactGrid(
        x_mm=np.asarray(x_low + step_x * np.arange(count_x + 1)),
        s_mm=np.asarray(s_low + step_s * np.arange(count_s + 1)),
        half=half,
    )


def _box(rung: Rung) -> ExpectedPatch:
    p, x, s, half = rung.pressure_MPa, rung.grid.x_mm, rung.grid.s_mm, rung.grid.half
    dx, ds = rung.grid.steps_mm
    rows, columns = np.flatnonzero(p.any(axis=1)), np.flatnonzero(p.any(axis=0))
    x_high = float(x[rows[-1]] + 0.5 * dx)
    x_low = -x_high if half else float(x[rows[0]] - 0.5 * dx)
    sizes = _lobe_sizes(p, x, s, half)
    return ExpectedPatch(
        x_low_mm=x_low,
        x_high_mm=x_high,
        s_low_mm=float(s[columns[0]] - 0.5 * ds),
        s_high_mm=float(s[columns[-1]] + 0.5 * ds),
        semi_axis_x_mm=min(size[0] for size in sizes),
        semi_axis_s_mm=min(size[1] for size in sizes),
        half_space=rung,
    )


def _lobe_sizes(p: Floats, x: Floats, s: Floats, half: bool) -> list[tuple[float, float]]:
    """Half length along x and smaller half width across (mm) of each lobe of a pressure (nx, ns)."""
    ridge = np.concatenate(([0.0], p.max(axis=0), [0.0]))
    line_load = np.concatenate(([0.0], p.sum(axis=0), [0.0]))
    top = float(ridge.max())
    peaks, _ = find_peaks(ridge, height=_LESSER_PEAK * top, prominence=_VALLEY * top)
    dx, ds = float(x[1] - x[0]), float(s[1] - s[0])
    zeros = np.flatnonzero(ridge == 0.0)
    sizes = []
    for k, peak in enumerate(peaks):
        left, right = int(zeros[zeros < peak][-1]), int(zeros[zeros > peak][0])
        if k > 0:
            left = max(left, int(peaks[k - 1] + np.argmin(ridge[peaks[k - 1] : peak])))
        if k < len(peaks) - 1:
            right = min(right, int(peak + np.argmin(ridge[peak : peaks[k + 1]])))
        if ridge[peak] < top and float(line_load[left:right].sum()) < _LESSER_LOAD * float(line_load.sum()):
            continue
        rows = np.flatnonzero(p[:, peak - 1])
        length = (rows[-1] + 0.5) * dx if half else 0.5 * (rows[-1] - rows[0] + 1) * dx
        sizes.append((length, min(peak - left, right - peak) * ds))
    return sizes
