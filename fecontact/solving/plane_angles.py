"""Angles of the planes in which patches of a contact press on a half-space."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact.grid import Rung
from fecontact.placement.wheel_on_rail import Placement

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
