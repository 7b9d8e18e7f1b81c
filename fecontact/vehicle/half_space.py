"""The half-space under an overlap: the exact theory of flat bodies, at a given approach."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fecontact.contact.grid import ContactGrid
from fecontact.contact.halfspace import along_normals, half_space_below
from fecontact.contact.solver import Compliance
from fecontact.vehicle.surfaces import Overlap

Floats = NDArray[np.float64]
# Nodes from the middle to the end of the longest strip, and widest distance of those across: centre of pressure within
# 0.02 mm, force within 1 % of four times as many.
_NODES_ALONG, _STEP_MM, _FEWEST_ACROSS = 8, 0.3, 24
# The same where slopes are asked for: nodes that enter and leave change them by a tenth with those above.
_FINE_ALONG, _FINE_STEP_MM = 16, 0.1
_TOLERANCE, _ITERATIONS = 1e-11, 400


def pressed_strips(
    overlap: Overlap, contact_modulus_MPa: float, *, fine: bool = False
) -> tuple[Floats, Floats, Floats] | None:
    """Places across (n,), half lengths (n,) and forces over width (n,) of strips on a uniform grid; None without any.

    The half length is that of an elliptic pressure with the strip's second moment. On a `fine` grid slopes over small
    motions are good to some percent.

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
    longest = float(np.sqrt(2.0 * np.max(np.maximum(depth, 0.0) / curvature)))
    x = np.asarray(longest / (along - 0.5) * np.arange(along))
    flat = half_space_below(ContactGrid(x_mm=x, s_mm=np.asarray(s), half=True), contact_modulus_MPa)
    wanted = (depth - 0.5 * curvature * x[:, None] ** 2).ravel()
    pressure = _pressure(along_normals(flat, np.tile(angle, x.size)), wanted, x.size).reshape(x.size, -1)
    rows = np.full(x.size, 2.0 * x[1])
    rows[0] = x[1]
    force = rows @ pressure
    moment = (rows * (x**2 + x[1] ** 2 / 12.0)) @ pressure
    half = 2.0 * np.sqrt(np.divide(moment, force, out=np.zeros_like(force), where=force > 0.0))
    return s, half, force


def _pressure(compliance: Compliance, wanted: Floats, rows: int) -> Floats:
    """Pressures (n,) >= 0 whose opening is the wanted one where there is pressure, and no less elsewhere."""
    weight = np.ones(wanted.size)
    # half of the cells on the plane of symmetry is in the model
    weight[: wanted.size // rows] = 0.5
    pressure = np.zeros_like(wanted)
    gap = -wanted
    direction = np.zeros_like(wanted)
    active = wanted > 0.0
    size_before, conjugate = 1.0, False
    whole = float(weight[active] @ wanted[active] ** 2)
    for _ in range(_ITERATIONS):
        size = float(weight[active] @ gap[active] ** 2)
        if size < _TOLERANCE**2 * whole:
            break
        direction = np.where(active, gap + (size / size_before if conjugate else 0.0) * direction, 0.0)
        size_before = size
        moved = compliance(direction)
        step = float((weight * gap)[active] @ direction[active]) / float((weight * moved)[active] @ direction[active])
        pressure = np.maximum(pressure - step * direction, 0.0)
        # exact again after a pressure was cut off
        cut = active & (pressure == 0.0)
        gap = (compliance(pressure) if cut.any() else gap + wanted - step * moved) - wanted
        entering = (pressure == 0.0) & (gap < 0.0)
        conjugate = not (cut.any() or entering.any())
        active = (pressure > 0.0) | entering
    return pressure
