"""Where the patch will be: the true gap on a half-space, cheap enough to be solved before any mesh is made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from fecontact.comparison.measures import Measures, measures_of
from fecontact.contact.halfspace import half_space_compliance
from fecontact.contact.patch import measure_patch
from fecontact.contact.solver import ContactProblem, ContactSolution, solve_contact
from fecontact.errors import ConvergenceError, InputError
from fecontact.geometry.placement import Placement

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


@dataclass(frozen=True, kw_only=True)
class ExpectedPatch:
    """Extent of the patch on the rail's surface from the first touch point, and its narrowest lobe's size (mm).

    `measures` are those of the half-space under the true gap, with 16 nodes a semi-axis; the approach is that along the
    load.
    """

    x_low_mm: float
    x_high_mm: float
    s_low_mm: float
    s_high_mm: float
    semi_axis_x_mm: float
    semi_axis_s_mm: float
    measures: Measures


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
        If the patch reaches the end of the running surface.
    """
    reach = guess_mm
    for _ in range(12):
        (x_low, x_high), (s_low, s_high) = _region(placement, reach, direction, half)
        x = np.linspace(0.0 if half else x_low, x_high, _COARSE_NODES_X if half else 2 * _COARSE_NODES_X - 1)
        s = np.linspace(s_low, s_high, max(33, int(np.ceil((s_high - s_low) / _COARSE_STEP_S_MM)) + 1))
        solution = _solve(placement, x, s, load_N, contact_modulus_MPa, direction, half)
        if solution.approach_mm < reach:
            break
        reach = 1.3 * solution.approach_mm
    else:
        raise ConvergenceError(
            f"the patch grows without bound under {load_N:g} N: the bodies conform all over; reduce the load"
        )
    for _ in range(2):
        box = _box(x, s, solution, half)
        x, s = _fitted_grid(box, half)
        solution = _solve(placement, x, s, load_N, contact_modulus_MPa, direction, half)
    return _box(x, s, solution, half)


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


def _solve(
    placement: Placement, x: Floats, s: Floats, load: float, modulus: float, direction: Floats, half: bool
) -> ContactSolution:
    _, normals = placement.surface(0.0, s)
    dx, ds = float(x[1] - x[0]), float(s[1] - s[0])
    weights = np.full((x.size, s.size), dx * ds)
    if half:
        weights[1:] *= 2.0
    problem = ContactProblem(
        compliance=half_space_compliance(
            nodes_x=x.size, nodes_s=s.size, step_x_mm=dx, step_s_mm=ds, contact_modulus_MPa=modulus, half=half
        ),
        gap_mm=placement.gap(x[:, None], s[None, :]).ravel(),
        closing=np.tile(normals @ direction, x.size),
        area_mm2=weights.ravel(),
    )
    return solve_contact(problem, load, tolerance=1e-5)


def _fitted_grid(box: ExpectedPatch, half: bool) -> tuple[Floats, Floats]:
    step_x, step_s = box.semi_axis_x_mm / _NODES_A_SEMI_AXIS, box.semi_axis_s_mm / _NODES_A_SEMI_AXIS
    x_low = 0.0 if half else box.x_low_mm - 3.0 * step_x
    s_low = box.s_low_mm - 3.0 * step_s
    count_x = int(np.ceil((box.x_high_mm + 3.0 * step_x - x_low) / step_x))
    count_s = int(np.ceil((box.s_high_mm + 3.0 * step_s - s_low) / step_s))
    return np.asarray(x_low + step_x * np.arange(count_x + 1)), np.asarray(s_low + step_s * np.arange(count_s + 1))


def _box(x: Floats, s: Floats, solution: ContactSolution, half: bool) -> ExpectedPatch:
    p = solution.pressure_MPa.reshape(x.size, s.size)
    dx, ds = float(x[1] - x[0]), float(s[1] - s[0])
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
        measures=measures_of(measure_patch(x, s, p, half=half), solution.approach_mm),
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
