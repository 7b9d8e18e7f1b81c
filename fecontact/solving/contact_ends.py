"""Refusal of contacts at the end of a profile or on a corner, where the pressure has no finite value."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation

from fecontact.arrays import Floats
from fecontact.contact.grid import Rung
from fecontact.errors import InputError
from fecontact.placement.wheel_on_rail import OPEN_GAP_MM, Placement

# A kink by less than this turns the surface less than a patch's own curvature does (5 mm on R 300: 0.017).
_CORNER_RAD = 0.02


def check_ends(placement: Placement, rung: Rung, gap_mm: Floats) -> None:
    """Refuse a contact at the end of the wheel's line, on a corner or an edge: its pressure has no bound there."""
    grid, in_contact = rung.grid, rung.pressure_MPa > 0.0
    _check_irregularity(placement, rung)
    if np.any(binary_dilation(gap_mm >= OPEN_GAP_MM, structure=np.ones((3, 3))) & in_contact):
        raise InputError(
            f"the contact reaches the end of the running surface of wheel {placement.wheel.profile.name};"
            " reduce the load, change the lateral shift, or give a longer profile line"
        )
    below = grid.s_mm[in_contact.any(axis=0)]
    for place in placement.junctions:
        profile, junction = place.profile, place.junction
        convex_corner = profile.convex_sign * junction.turn_rad > _CORNER_RAD
        # its own cell counts: the pressure ends at a corner that it cannot pass
        if convex_corner and below[0] - grid.steps_mm[1] <= place.s_mm <= below[-1] + grid.steps_mm[1]:
            raise InputError(
                f"the contact reaches a corner of {profile.kind} {profile.name} at y = {junction.y_mm:.2f} mm, where"
                " its pressure has no finite value; change the lateral shift, or round the corner in the profile"
            )


def _check_irregularity(placement: Placement, rung: Rung) -> None:
    """Refuse a contact on an edge of an irregularity, and one beyond the end of its table."""
    along, x, step = placement.along, rung.grid.x_mm + placement.first.x_mm, rung.grid.steps_mm[0]
    if along is None:
        return
    rows = np.flatnonzero((rung.pressure_MPa > 0.0).any(axis=1))
    low, high = float(x[rows[0]]) - step, float(x[rows[-1]]) + step
    if any(low < kink < high for kink in along.kinks_x_mm):
        raise InputError(
            f"an edge of the irregularity lies in the patch at {along.distance_mm:g} mm: the elastic pressure there has"
            " no bound, and no peak is given; round it by a haversine or a table with its radius, or take another"
            " distance"
        )
    if not along.covers(low, high):
        raise InputError(
            f"the contact at {along.distance_mm:g} mm reaches past the end of the irregularity's table; take another"
            " distance, or a longer table"
        )
