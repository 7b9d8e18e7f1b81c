"""Hertz's own gap on a discrete half-space: the rung that shows what the pressure nodes leave open."""

from __future__ import annotations

import numpy as np

from fecontact.contact.grid import ContactGrid
from fecontact.contact.halfspace import half_space_problem
from fecontact.contact.rung import Rung
from fecontact.contact.solver import solve_contact
from fecontact.geometry.touch_points import TouchPoint
from fecontact.theory.hertz import HertzContact

# How far its grid reaches beyond Hertz's ellipse.
_REACH = 1.2


def quadratic_rung(grid: ContactGrid, touch: TouchPoint, hertz: HertzContact) -> Rung:
    """Solve the quadratic gap at a touch point on a half-space, with the grid's spacing, under Hertz's normal force."""
    hx, hs = grid.steps_mm
    count_x = int(np.ceil(_REACH * 0.5 * hertz.extent_x_mm / hx))
    count_s = int(np.ceil(_REACH * 0.5 * hertz.extent_y_mm / hs))
    x = np.asarray(hx * np.arange(0 if grid.half else -count_x, count_x + 1))
    # the same position of the nodes between the patch's edges as on the grid itself
    s = np.asarray(hs * np.arange(-count_s, count_s + 1) + float(grid.s_mm[np.argmin(np.abs(grid.s_mm))]))
    own = ContactGrid(x_mm=x, s_mm=s, half=grid.half)
    h = touch.curvature
    gap = 0.5 * h.xx_per_mm * x[:, None] ** 2 + h.xy_per_mm * x[:, None] * s + 0.5 * h.yy_per_mm * s**2
    problem = half_space_problem(own, gap.ravel(), contact_modulus_MPa=hertz.contact_modulus_MPa)
    solution = solve_contact(problem, hertz.normal_force_N)
    return Rung.of(own, solution, approach_mm=solution.approach_mm)
