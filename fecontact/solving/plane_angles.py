"""Angles of the planes in which patches of a contact press on a half-space."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact.grid import Rung
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.true_gap import TrueGap

#
# Meshes do not depend on them: elements are made for a contact in one plane, and finite bodies know their own surfaces.


def angle_of_patches(placement: Placement, rung: Rung) -> Floats:
    """Angle (ns,) in rad of the plane below each node: of its patch, across to the patch's resultant force.

    Between separate patches the nearer patch's plane counts; a single patch has one plane everywhere.
    """
    line_load, s = rung.pressure_MPa.sum(axis=0), rung.grid.s_mm
    below = np.flatnonzero(line_load)
    patches = np.split(below, np.flatnonzero(np.diff(below) > 1) + 1)
    angle = angle_of_normals(placement, s)
    planes = [
        np.arctan2((line_load * np.sin(angle))[own].sum(), (line_load * np.cos(angle))[own].sum()) for own in patches
    ]
    middles = [0.5 * (s[before[-1]] + s[after[0]]) for before, after in pairwise(patches)]
    return np.array(planes)[np.searchsorted(middles, s)]


def angle_of_normals(placement: Placement, s_mm: Floats) -> Floats:
    """Angle (ns,) in rad of the rail's normals at arc lengths from first touch (mm)."""
    _, normals = placement.surface(0.0, s_mm)
    return np.asarray(np.arctan2(-normals[:, 1], normals[:, 2]))


def turned_force(true_gap: TrueGap, rung: Rung) -> float:
    """Relative excess of the force along the normal at a patch's weighted centre over that at first touch.

    Both are planes in which codes put a contact as a whole: CONTACT takes the first one, weighted by how far the
    undeformed bodies overlap. 49E1 with EN13715_1in40, 1:20, 6.24 mm, 138 kN: 0.67 and 0.52 rad, 176.1 and 158.9 kN.
    CONTACT has 174.7 kN and a peak that is 3.0 % higher than here, where each pressure has its own normal in the
    equilibrium (164.4 kN). On a tread both are one. Separate patches have a plane each: 0.
    """
    placement, grid = true_gap.placement, rung.grid
    below = np.flatnonzero(rung.pressure_MPa.any(axis=0))
    if np.any(np.diff(below) > 1):
        return 0.0
    # undeformed bodies overlap beside the patch, too: 1.4 times as far where both are round
    step, count = grid.steps_mm[1], below.size
    s = grid.s_mm[below[0]] + step * np.arange(-count, 2 * count)
    x = np.concatenate([grid.x_mm, grid.x_mm[-1] + grid.steps_mm[0] * np.arange(1, grid.x_mm.size)])
    x = x if grid.half else np.concatenate([(2.0 * grid.x_mm[0] - x[::-1])[: grid.x_mm.size], x])
    _, normals = placement.surface(0.0, s)
    depth_mm = rung.approach_mm / true_gap.closing * (normals @ true_gap.direction)
    overlap = np.nan_to_num(np.maximum(depth_mm - true_gap.gap(x[:, None], s), 0.0)).sum(axis=0)
    # up to where the bodies part: beyond it another place may be near, which carries nothing
    parted = np.flatnonzero(overlap == 0.0)
    first, last = max(parted[parted < count], default=-1) + 1, min(parted[parted >= 2 * count], default=s.size)
    weighted = s[first:last] @ overlap[first:last] / overlap[first:last].sum()
    _, turned = placement.surface(0.0, weighted)
    return float(placement.first.normal @ true_gap.direction / (turned @ true_gap.direction) - 1.0)
