"""Angles of the planes in which patches of a contact press on a half-space."""

from __future__ import annotations

import numpy as np

from fecontact.arrays import Floats, find_runs
from fecontact.contact.grid import Rung
from fecontact.judging.patch_loads import find_free_strips_mm
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.true_gap import TrueGap

# Meshes do not depend on these angles: elements are made for a contact in a single plane, and finite bodies have their
# true surfaces.


def compute_plane_angles(placement: Placement, rung: Rung) -> Floats:
    """Angle of the plane below each column of nodes.

    The plane of a patch is perpendicular to its resultant force. Between separate patches the plane of the nearer patch
    is used; a single patch has a single plane.

    Parameters
    ----------
    placement
        Wheel on rail.
    rung
        Solved contact.

    Returns
    -------
    ndarray of shape (ns,)
        Angle in rad.
    """
    line_load, s_mm = rung.pressure_MPa.sum(axis=0), rung.grid.s_mm
    patches = [slice(first, last + 1) for first, last in find_runs(line_load > 0.0)]
    angle = compute_normal_angles(placement, s_mm)
    planes = [
        np.arctan2((line_load * np.sin(angle))[columns].sum(), (line_load * np.cos(angle))[columns].sum())
        for columns in patches
    ]
    return np.array(planes)[np.searchsorted(find_free_strips_mm(rung), s_mm)]


def compute_normal_angles(placement: Placement, s_mm: Floats) -> Floats:
    """Angle (ns,) in rad of the rail's normals at arc lengths from first contact (mm).

    Parameters
    ----------
    placement
        The wheel on the rail.
    s_mm : ndarray of shape (ns,)
        Arc lengths from the first contact point in mm.

    Returns
    -------
    ndarray of shape (ns,)
        Angle from the vertical in rad.
    """
    _, normals = placement.surface(0.0, s_mm)
    return np.asarray(np.arctan2(-normals[:, 1], normals[:, 2]))


def compute_turned_force(true_gap: TrueGap, rung: Rung) -> float:
    """Relative excess of the force along the normal at a patch's weighted centre.

    The reference is the force along the normal at first contact. Codes use either plane for a contact as a whole:
    CONTACT uses the weighted centre, with the overlap of the undeformed bodies as weight. 49E1 with EN13715_1in40,
    1:20, 6.24 mm, 138 kN: 0.67 and 0.52 rad, 176.1 and 158.9 kN. CONTACT has 174.7 kN and a peak that is 3.0 % higher
    than here, where each pressure acts along the normal at its place in the equilibrium (164.4 kN). On a tread both
    planes are equal.

    Parameters
    ----------
    true_gap
        True gap with the direction of the load.
    rung
        Solved contact.

    Returns
    -------
    float
        Relative excess (-); 0 for separate patches, which have a plane each.
    """
    placement, grid = true_gap.placement, rung.grid
    (first, last), *separate_patches = find_runs(rung.pressure_MPa.sum(axis=0) > 0.0)
    if separate_patches:
        return 0.0
    # Undeformed bodies also overlap outside the patch: up to 1.4 times as far if both are round.
    spacing_s_mm, count = grid.steps_mm[1], last - first + 1
    s_mm = grid.s_mm[first] + spacing_s_mm * np.arange(-count, 2 * count)
    x_mm = np.concatenate([grid.x_mm, grid.x_mm[-1] + grid.steps_mm[0] * np.arange(1, grid.x_mm.size)])
    x_mm = x_mm if grid.half else np.concatenate([(2.0 * grid.x_mm[0] - x_mm[::-1])[: grid.x_mm.size], x_mm])
    _, normals = placement.surface(0.0, s_mm)
    depth_mm = rung.approach_mm / true_gap.closing * (normals @ true_gap.direction)
    overlap = np.nan_to_num(np.maximum(depth_mm - true_gap.gap(x_mm[:, None], s_mm), 0.0)).sum(axis=0)
    # The range ends where the bodies separate: beyond it they may come near again without carrying load.
    free_columns = np.flatnonzero(overlap == 0.0)
    first_column, last_column = (
        max(free_columns[free_columns < count], default=-1) + 1,
        min(free_columns[free_columns >= 2 * count], default=s_mm.size),
    )
    centre_s_mm = (
        s_mm[first_column:last_column] @ overlap[first_column:last_column] / overlap[first_column:last_column].sum()
    )
    _, centre_normal = placement.surface(0.0, centre_s_mm)
    return float(placement.first.normal @ true_gap.direction / (centre_normal @ true_gap.direction) - 1.0)
