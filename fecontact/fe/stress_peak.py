"""Where a body is strained most: the largest von Mises stress below the contact, from the finite elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CloughTocher2DInterpolator, CubicSpline

from fecontact.fe.body import ElasticBody
from fecontact.fe.body_mesh import BodyMesh
from fecontact.fe.stress import nodal_stress, von_mises

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
    """Find the largest von Mises stress below the contact zone of a body.

    The node of the uniform block with the largest stress decides about the normal on which it lies; along that normal a
    cubic spline goes through the nodes, so that depth and size do not stick to the layers. The peak below a Hertz patch
    lies at 0.48 to 0.78 of its shorter semi-axis (Johnson 1985, section 4.2 and eq. 3.69). The block is 1.5 semi-axes
    deep where the surface allows; over a tight corner it ends earlier, and the line goes on through the mesh below it.

    Parameters
    ----------
    displacements (n, 3)
        In mm, of all nodes.
    """
    mesh = body.mesh
    values = von_mises(nodal_stress(body, displacements))
    i, j, k = np.unravel_index(int(np.argmax(values[mesh.block_nodes])), mesh.block_nodes.shape)
    column = mesh.block_nodes[i, j]
    depth, stress = np.linalg.norm(mesh.points[column] - mesh.points[column[0]], axis=1), values[column]
    if k == column.size - 1:
        further = _below_the_block(mesh, int(i), int(j), values)
        depth, stress = np.concatenate([depth, further[0]]), np.concatenate([stress, further[1]])
    depth_mm, size = peak_on_line(depth, stress)
    x, y, _ = mesh.points[column[0]]
    return StressPeak(von_mises_MPa=size, depth_mm=depth_mm, x_mm=float(x), y_mm=float(y))


def _below_the_block(mesh: BodyMesh, i: int, j: int, values: Floats) -> tuple[Floats, Floats]:
    """Depths below a block's column (i, j) down to half the zone's width, and nodal values there.

    Interpolated by piecewise cubics (Clough and Tocher) among the nodes of the same cross-section.
    """
    # nodes are numbered cross-section by cross-section
    count = int(mesh.block_nodes[1, 0, 0] - mesh.block_nodes[0, 0, 0])
    first = int(mesh.block_nodes[i, j, 0]) // count * count
    line = mesh.points[mesh.block_nodes[i, j]]
    row = mesh.points[mesh.block_nodes[i, :, 0]]
    depths = np.linalg.norm(line - line[0], axis=1)
    inward = (line[-1] - line[0]) / depths[-1]
    across = row[min(j + 1, len(row) - 1)] - row[max(j - 1, 0)]
    across -= (across @ inward) * inward
    across /= np.linalg.norm(across)
    section = (mesh.points[first : first + count] - line[0]) @ np.column_stack([inward, across])
    reach = 0.5 * float(np.linalg.norm(row[-1] - row[0]))
    near = np.all(np.abs(section) < 2.0 * reach, axis=1)
    step = depths[-1] - depths[-2]
    further = np.arange(depths[-1] + step, max(reach, depths[-1] + 3.0 * step), step)
    found = CloughTocher2DInterpolator(section[near], values[first : first + count][near])(further, 0.0 * further)
    inside = np.isfinite(found)
    return further[inside], found[inside]


def peak_on_line(depth_mm: Floats, values: Floats) -> tuple[float, float]:
    """Depth and size of the largest value on a cubic spline (not-a-knot) through values at rising depths (n,)."""
    spline = CubicSpline(depth_mm, values)
    turns = spline.derivative().roots(extrapolate=False)
    # a constant piece has no single root
    candidates = np.concatenate([depth_mm, turns[np.isfinite(turns)]])
    sizes = spline(candidates)
    best = int(np.argmax(sizes))
    return float(candidates[best]), float(sizes[best])
