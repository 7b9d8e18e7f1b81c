"""Refusal of contacts at the end of a profile, at a corner, or where a profile is doubtful.

The pressure has no finite value at an end or a corner.
"""

from __future__ import annotations

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact.grid import Rung
from fecontact.errors import InputError
from fecontact.placement.wheel_on_rail import OPEN_GAP_MM, Placement

# A smaller kink turns the surface by less than the curvature of the patch does (5 mm on R 300: 0.017).
_CORNER_RAD = 0.02


def check_ends(placement: Placement, rung: Rung, gap_mm: Floats) -> None:
    """Refuse a contact at the end of the wheel's profile, a corner, an edge or a doubtful part of a profile.

    The pressure has no bound at an end, a corner or an edge.

    Parameters
    ----------
    placement
        Wheel on rail, with junctions and irregularities.
    rung
        Solved contact.
    gap_mm
        Gap (nx, ns) in mm on the grid of the contact.

    Raises
    ------
    InputError
        If the contact reaches the end of the profile, a corner, an edge of an irregularity, or a doubtful part.
    """
    from scipy.ndimage import binary_dilation

    grid, is_in_contact = rung.grid, rung.pressure_MPa > 0.0
    _check_irregularity(placement, rung)
    if np.any(binary_dilation(gap_mm >= OPEN_GAP_MM, structure=np.ones((3, 3))) & is_in_contact):
        raise InputError(
            f"the contact patch reaches the end of the running surface of wheel {placement.wheel.profile.name};"
            " reduce the load, change the lateral shift, or give a longer profile"
        )
    loaded_s_mm = grid.s_mm[is_in_contact.any(axis=0)]
    _check_doubtful_parts(placement, loaded_s_mm)
    for junction_place in placement.junctions:
        profile, junction = junction_place.profile, junction_place.junction
        is_convex_corner = profile.convex_sign * junction.turn_rad > _CORNER_RAD
        # The cell of the corner is included: the pressure ends at a corner that it cannot pass.
        if (
            is_convex_corner
            and loaded_s_mm[0] - grid.steps_mm[1] <= junction_place.s_mm <= loaded_s_mm[-1] + grid.steps_mm[1]
        ):
            raise InputError(
                f"the contact patch reaches a corner of {profile.kind} {profile.name} at y = {junction.y_mm:.2f} mm,"
                " where the pressure has no bound; change the lateral shift, or round the corner in the profile"
            )


def _check_doubtful_parts(placement: Placement, loaded_s_mm: Floats) -> None:
    """Refuse a contact where the shape of a profile is doubtful.

    Parameters
    ----------
    placement
        Wheel on rail.
    loaded_s_mm
        Arc lengths (n,) of the loaded columns of the grid, from the contact point (mm).

    Raises
    ------
    InputError
        If a loaded column is on the doubtful part.
    """
    for profile, u in (
        (placement.rail.profile, placement.first.rail_u),
        (placement.wheel.profile, placement.first.wheel_u),
    ):
        if profile.doubtful_y_mm is None:
            continue
        low_s, high_s = profile.arc_length(profile.locate(profile.doubtful_y_mm)) - float(profile.arc_length(u))
        if np.any((loaded_s_mm >= low_s) & (loaded_s_mm <= high_s)):
            low, high = profile.doubtful_y_mm
            raise InputError(
                f"the contact patch reaches the part of {profile.kind} {profile.name} from y = {low:.1f} to"
                f" {high:.1f} mm, where its shape is doubtful (fecontact profiles {profile.name}); change the lateral"
                " shift, or give a profile that is certain there"
            )


def _check_irregularity(placement: Placement, rung: Rung) -> None:
    """Refuse a contact on an edge of an irregularity, or beyond its table.

    Raises
    ------
    InputError
        If the loaded rows of the grid, extended by a node at each end, contain an edge or leave the table.
    """
    irregularity, x_mm, spacing_mm = placement.along, rung.grid.x_mm + placement.first.x_mm, rung.grid.steps_mm[0]
    if irregularity is None:
        return
    rows = np.flatnonzero((rung.pressure_MPa > 0.0).any(axis=1))
    low_mm, high_mm = float(x_mm[rows[0]]) - spacing_mm, float(x_mm[rows[-1]]) + spacing_mm
    if any(low_mm < kink_mm < high_mm for kink_mm in irregularity.kinks_x_mm):
        raise InputError(
            f"at {irregularity.distance_mm:g} mm an edge of the irregularity is in the contact patch, where the"
            " elastic pressure has no bound; give a haversine, a table with the radius of the edge, or a different"
            " distance"
        )
    if not irregularity.covers(low_mm, high_mm):
        raise InputError(
            f"at {irregularity.distance_mm:g} mm the contact patch reaches beyond the table of the irregularity; give"
            " a different distance or a longer table"
        )
