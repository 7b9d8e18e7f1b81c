"""Where a body is strained most: the largest von Mises stress below the contact, from the finite elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fecontact.elasticity import ElasticBody, nodal_stress, von_mises

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class StressPeak:
    """Largest von Mises stress in a body below its contact zone, in MPa, and where.

    Attributes
    ----------
    depth_mm
        Below the surface, along its normal; 0 at the surface.
    x_mm, y_mm
        Position in the track frame of the surface point above it.
    """

    von_mises_MPa: float
    depth_mm: float
    x_mm: float
    y_mm: float


def stress_peak(body: ElasticBody, displacements: Floats) -> StressPeak:
    """Find the largest von Mises stress in the uniform block below the contact zone of a body.

    The node with the largest stress decides about the normal on which it lies; along that normal a cubic spline goes
    through the nodes, so that depth and size do not stick to the layers. The block reaches down to 0.45 of the zone's
    width, about 1.5 semi-axes: the peak below a Hertz patch lies at 0.48 to 0.78 of the shorter one (Johnson 1985,
    section 4.2 and eq. 3.69).

    Parameters
    ----------
    displacements (n, 3)
        In mm, of all nodes.
    """
    mesh = body.mesh
    values = von_mises(nodal_stress(body, displacements)[mesh.block_nodes])
    i, j, _ = np.unravel_index(int(np.argmax(values)), values.shape)
    line = mesh.points[mesh.block_nodes[i, j]]
    depth, size = peak_on_line(np.linalg.norm(line - line[0], axis=1), values[i, j])
    return StressPeak(von_mises_MPa=size, depth_mm=depth, x_mm=float(line[0, 0]), y_mm=float(line[0, 1]))


def peak_on_line(depth_mm: Floats, values: Floats) -> tuple[float, float]:
    """Depth and size of the largest value on a cubic spline (not-a-knot) through values at rising depths (n,)."""
    spline = CubicSpline(depth_mm, values)
    turns = spline.derivative().roots(extrapolate=False)
    # a constant piece has no single root
    candidates = np.concatenate([depth_mm, turns[np.isfinite(turns)]])
    sizes = spline(candidates)
    best = int(np.argmax(sizes))
    return float(candidates[best]), float(sizes[best])
