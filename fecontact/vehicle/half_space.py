"""The half-space under an overlap: the exact theory of flat bodies, at a given approach."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fecontact.contact.grid import ContactGrid
from fecontact.contact.halfspace import along_normals, half_space_below
from fecontact.contact.solver import ContactProblem, solve_contact
from fecontact.vehicle.surfaces import Overlap

Floats = NDArray[np.float64]
# Nodes from the middle to the end of the longest strip, and widest distance of those across: centre of pressure within
# 0.02 mm, force within 1 % of four times as many.
_NODES_ALONG, _STEP_MM, _FEWEST_ACROSS = 8, 0.3, 24
# The same where slopes are asked for: nodes that enter and leave change them by a tenth with those above.
_FINE_ALONG, _FINE_STEP_MM = 16, 0.1
# Of the largest overlap: Newton's method over positions takes differences of forces a billionth apart.
_TOLERANCE, _ITERATIONS = 3e-11, 400


def pressed_strips(
    overlap: Overlap, contact_modulus_MPa: float, *, fine: bool = False
) -> tuple[Floats, Floats, Floats, str] | None:
    """Places across (n,), half lengths (n,) and forces over width (n,) of strips on a uniform grid; None without any.

    The half length is that of an elliptic pressure with the strip's second moment. On a `fine` grid slopes over small
    motions are good to some percent. The text says why the forces are not to be trusted, and is empty where they are.

    Notes
    -----
    Source: Johnson (1985), eq. 3.25 with normals that turn across (`contact.halfspace`), and Polonsky and Keer's
    conjugate gradients (1999) at a given approach. Range of validity: flat bodies; the same rolling radius along each
    strip.
    """
    inside = np.flatnonzero(overlap.depth_mm > 0.0)
    if inside.size < 3:
        return None
    low, high = float(overlap.s_mm[inside[0]]), float(overlap.s_mm[inside[-1]])
    along, widest = (_FINE_ALONG, _FINE_STEP_MM) if fine else (_NODES_ALONG, _STEP_MM)
    step = min(widest, (high - low) / _FEWEST_ACROSS)
    # on a lattice of the rail, where a node enters without pressure
    s = step * np.arange(np.floor(low / step), np.ceil(high / step) + 1.0)
    depth = np.interp(s, overlap.s_mm, overlap.depth_mm)
    curvature = np.interp(s, overlap.s_mm, overlap.curvature_along_per_mm)
    angle = np.interp(s, overlap.s_mm, overlap.angle_rad)
    deepest = float(depth.max())
    if deepest <= 0.0:
        return None
    longest = float(np.sqrt(2.0 * np.max(np.maximum(depth, 0.0) / curvature)))
    x = np.asarray(longest / (along - 0.5) * np.arange(along))
    rows = np.full(x.size, 2.0 * x[1])
    rows[0] = x[1]
    flat = half_space_below(ContactGrid(x_mm=x, s_mm=np.asarray(s), half=True), contact_modulus_MPa)
    wanted = (depth - 0.5 * curvature * x[:, None] ** 2).ravel()
    contact = ContactProblem(
        compliance=along_normals(flat, np.tile(angle, x.size)),
        gap_mm=deepest - wanted,
        closing=np.ones_like(wanted),
        # half of the cells on the plane of symmetry is in the model
        area_mm2=np.repeat(rows, s.size),
    )
    solution = solve_contact(contact, None, approach_mm=deepest, tolerance=_TOLERANCE, iterations=_ITERATIONS)
    pressure = solution.pressure_MPa.reshape(x.size, -1)
    force = rows @ pressure
    moment = (rows * (x**2 + x[1] ** 2 / 12.0)) @ pressure
    half = 2.0 * np.sqrt(np.divide(moment, force, out=np.zeros_like(force), where=force > 0.0))
    problem = (
        f"the half-space did not converge in {solution.iterations} iterations: {solution.residual:.1e} of the overlap"
        " is left open; another theory may go"
    )
    return s, half, force, "" if solution.status == "converged" else problem
