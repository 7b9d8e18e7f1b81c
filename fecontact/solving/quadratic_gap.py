"""Hertz's own gap on a discrete half-space: the error of the pressure nodes alone."""

from __future__ import annotations

import numpy as np

from fecontact.contact.grid import ContactGrid, Rung
from fecontact.contact.halfspace import half_space_problem
from fecontact.contact.solver import solve_contact
from fecontact.contact_theories.hertz import HertzContact
from fecontact.placement.poses import TouchPoint

# How far its grid reaches beyond Hertz's ellipse.
_REACH = 1.2


def quadratic_rung(touch: TouchPoint, hertz: HertzContact, *, half: bool, nodes: int = 16) -> Rung:
    """Solve the quadratic gap at a touch point on a half-space under Hertz's normal force; `nodes` per semi-axis."""
    hx, hs = (0.5 * extent / nodes for extent in (hertz.extent_x_mm, hertz.extent_y_mm))
    count = int(np.ceil(_REACH * nodes))
    # a third of a step beside the ellipse's centre: no node lies where the symmetry would favour it
    s = np.asarray(hs * (np.arange(-count, count + 1) + 1.0 / 3.0))
    x = np.asarray(hx * (np.arange(0, count + 1) if half else np.arange(-count, count + 1)))
    own = ContactGrid(x_mm=x, s_mm=s, half=half)
    h = touch.curvature
    gap = 0.5 * h.xx_per_mm * x[:, None] ** 2 + h.xy_per_mm * x[:, None] * s + 0.5 * h.yy_per_mm * s**2
    problem = half_space_problem(own, gap.ravel(), contact_modulus_MPa=hertz.contact_modulus_MPa)
    start = hertz.pressure_MPa(x[:, None], s).ravel()
    solution = solve_contact(problem, hertz.normal_force_N, start_MPa=start)
    return Rung.of(own, solution, approach_mm=solution.approach_mm)
