"""Contact of any gap that is even across on a half-space, on nodes that follow its patch; no profiles, no placement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact.halfspace import half_space_problem
from fecontact.contact.solver import ContactSolution, solve_contact
from fecontact.errors import ConvergenceError, InputError

Floats = NDArray[np.float64]
Gap = Callable[[Floats, Floats], Floats]
NODES = 16
"""Nodes on the half length and the half width of the narrowest piece of a patch."""
# A hundred thousandth of the approach moves it and the pressure by less than nodes do.
_TOLERANCE = 1e-5
_COARSE = (49, 13)
# Of the longest piece: shorter ones are followed by as many nodes as this has.
_FINEST = 0.2
_MOST_NODES = 60_000
_ENLARGED = 1.4


@dataclass(frozen=True, kw_only=True, eq=False)
class OnGap:
    """A solved contact.

    Attributes
    ----------
    pressure
        In MPa over (x, y), both sides of y = 0.
    approach_mm
        From where both surfaces of gap zero would touch.
    residual
        What the solution leaves open, relative to the approach.
    """

    pressure: Field
    approach_mm: float
    residual: float


def contact_on_gap(
    gap_mm: Gap,
    load_N: float,
    contact_modulus_MPa: float,
    *,
    reach_mm: float,
    far_mm: tuple[float, float],
    nodes: int = NODES,
) -> OnGap:
    """Solve a gap on a half-space, first on coarse nodes over all that may touch, then on nodes that fit the patch.

    Parameters
    ----------
    gap_mm
        From x (n, 1) and y (1, m), in mm, y >= 0, to the undeformed gap (n, m), even in y.
    reach_mm
        A first guess of the approach from the least gap; enlarged until the patch cannot reach further.
    far_mm
        Half length and half width of a box in which the contact lies.

    Raises
    ------
    InputError
        If the patch reaches the end of that box.
    ConvergenceError
        If the contact is not found.
    """
    x = np.linspace(-far_mm[0], far_mm[0], 801)
    y = np.linspace(0.0, far_mm[1], 41)
    wide = gap_mm(x[:, None], y[None, :])
    least = float(wide.min())
    for _ in range(12):
        solution, grid = _solve(gap_mm, _box(x, y, wide - least <= reach_mm), load_N, contact_modulus_MPa)
        if solution.approach_mm - least < reach_mm:
            break
        reach_mm = _ENLARGED * max(reach_mm, solution.approach_mm - least)
    else:
        raise ConvergenceError(f"the patch grows without bound under {load_N:g} N; reduce the load")
    for share in (0.5, 1.0):
        fitted = _fitted(grid, solution, nodes * share)
        solution, grid = _solve(gap_mm, fitted, load_N, contact_modulus_MPa)
    if solution.status != "converged":
        raise ConvergenceError(
            f"the contact on a half-space of {grid.shape[1]} by {grid.shape[0]} nodes did not converge (residual"
            f" {solution.residual:.1e} of the approach); another load or place may go"
        )
    whole = Field.of_nodes(grid, solution.pressure_MPa).whole()
    over = ContactGrid(x_mm=grid.s_mm, s_mm=whole.grid.x_mm, half=False)
    return OnGap(
        pressure=Field(grid=over, values=np.ascontiguousarray(whole.values.T)),
        approach_mm=solution.approach_mm,
        residual=solution.residual,
    )


def _solve(gap_mm: Gap, grid: ContactGrid, load_N: float, modulus: float) -> tuple[ContactSolution, ContactGrid]:
    """Contact on nodes, the plane of symmetry of which lies across: their first direction is y."""
    gap = np.ascontiguousarray(gap_mm(grid.s_mm[:, None], grid.x_mm[None, :]).T)
    problem = half_space_problem(grid, gap.ravel(), contact_modulus_MPa=modulus)
    return solve_contact(problem, load_N, tolerance=_TOLERANCE), grid


def _box(x: Floats, y: Floats, near: NDArray[np.bool_]) -> ContactGrid:
    """Coarse nodes over all that comes together."""
    along, across = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
    if along[0] == 0 or along[-1] == x.size - 1 or across[-1] == y.size - 1:
        raise InputError(
            f"the contact reaches the end of {x[-1]:g} by {y[-1]:g} mm beside its middle; reduce the load, or the"
            " depth of the irregularity"
        )
    low, high, wide = x[along[0] - 1], x[along[-1] + 1], y[across[-1] + 1]
    return _grid(float(low), float(high), float(wide), (high - low) / _COARSE[0], wide / _COARSE[1])


def _fitted(grid: ContactGrid, solution: ContactSolution, nodes: float) -> ContactGrid:
    inside = solution.in_contact.reshape(grid.shape)
    (step_y, step_x), columns = grid.steps_mm, np.flatnonzero(inside.any(axis=0))
    pieces = np.split(columns, np.flatnonzero(np.diff(columns) > 1) + 1)
    lengths = [piece.size * step_x for piece in pieces]
    wide = (np.flatnonzero(inside.any(axis=1))[-1] + 0.5) * step_y
    shortest = max(min(lengths), _FINEST * max(lengths))
    low, high = (float(grid.s_mm[columns[end]]) + side * 0.5 * step_x for end, side in ((0, -1.0), (-1, 1.0)))
    return _grid(low, high, float(wide), 0.5 * shortest / nodes, wide / nodes)


def _grid(low: float, high: float, wide: float, step_x: float, step_y: float) -> ContactGrid:
    """Nodes along x from low to high and across to `wide`, with two more on each end."""
    count_x, count_y = int(np.ceil((high - low) / step_x)) + 5, int(np.ceil(wide / step_y)) + 3
    if count_x * count_y > _MOST_NODES:
        raise ConvergenceError(
            f"nodes that follow the contact would be {count_x} by {count_y}, and at most {_MOST_NODES} are solved; its"
            " shortest piece is too short beside the whole; another place along the irregularity may go"
        )
    middle = 0.5 * (low + high)
    x = middle + step_x * (np.arange(count_x) - 0.5 * (count_x - 1))
    return ContactGrid(x_mm=np.asarray(step_y * np.arange(count_y)), s_mm=np.asarray(x), half=True)
