"""Hertz's quadratic gap on a discrete half-space: the error of the pressure nodes alone."""

from __future__ import annotations

import numpy as np

from fecontact.contact.grid import ContactGrid, Rung
from fecontact.contact.halfspace import build_half_space_problem
from fecontact.contact.solver import solve_contact
from fecontact.contact_theories.hertz import HertzContact
from fecontact.placement.poses import ContactPoint

# Half size of the grid divided by the semi-axis of Hertz's ellipse.
_REACH = 1.2
DEFAULT_NODES = 16
"""Nodes per semi-axis if no number is given."""


def solve_quadratic_gap(
    contact_point: ContactPoint, hertz: HertzContact, *, half: bool, nodes: int = DEFAULT_NODES
) -> Rung:
    """Solve the quadratic gap at a contact point on a half-space.

    Parameters
    ----------
    contact_point
        Contact point with the curvatures of the gap.
    hertz
        Hertz's ellipse, with normal force and contact modulus.
    half
        Whether the grid covers only x >= 0, by symmetry.
    nodes
        Number of nodes per semi-axis.

    Returns
    -------
    Rung
        Solved contact.
    """
    spacing_x_mm, spacing_s_mm = (0.5 * extent / nodes for extent in (hertz.extent_x_mm, hertz.extent_y_mm))
    count = int(np.ceil(_REACH * nodes))
    # The grid is shifted by a third of its spacing from the centre of the ellipse, so that symmetry does not favour any
    # node.
    s_mm = np.asarray(spacing_s_mm * (np.arange(-count, count + 1) + 1.0 / 3.0))
    x_mm = np.asarray(spacing_x_mm * (np.arange(0, count + 1) if half else np.arange(-count, count + 1)))
    grid = ContactGrid(x_mm=x_mm, s_mm=s_mm, half=half)
    curvature = contact_point.curvature
    gap_mm = (
        0.5 * curvature.xx_per_mm * x_mm[:, None] ** 2
        + curvature.xy_per_mm * x_mm[:, None] * s_mm
        + 0.5 * curvature.yy_per_mm * s_mm**2
    )
    problem = build_half_space_problem(grid, gap_mm.ravel(), contact_modulus_MPa=hertz.contact_modulus_MPa)
    start_MPa = hertz.pressure_MPa(x_mm[:, None], s_mm).ravel()
    solution = solve_contact(problem, hertz.normal_force_N, start_MPa=start_MPa)
    return Rung.of(grid, solution, approach_mm=solution.approach_mm)
