"""Contacts at the end of a line or on a corner of one, where a pressure has no finite value."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from fecontact.contact.rung import Rung
from fecontact.errors import InputError
from fecontact.geometry.placement import OPEN_GAP_MM, Placement
from fecontact.profiles.curve import Profile

Floats = NDArray[np.float64]

# A kink by less than this turns the surface less than a patch's own curvature does (5 mm on R 300: 0.017).
_CORNER_RAD = 0.02


def check_ends(placement: Placement, rung: Rung, gap_mm: Floats) -> None:
    """Refuse a contact at the end of the wheel's line or on a corner: its pressure has no finite value there."""
    grid, in_contact = rung.grid, rung.pressure_MPa > 0.0
    if np.any(binary_dilation(gap_mm >= OPEN_GAP_MM, structure=np.ones((3, 3))) & in_contact):
        raise InputError(
            f"the contact reaches the end of the running surface of wheel {placement.wheel.profile.name};"
            " reduce the load, change the lateral shift, or give a longer profile line"
        )
    below = grid.s_mm[in_contact.any(axis=0)]
    for profile, y, arc in _corners(placement):
        # its own cell counts: the pressure ends at a corner that it cannot pass
        if below[0] - grid.steps_mm[1] <= arc <= below[-1] + grid.steps_mm[1]:
            raise InputError(
                f"the contact reaches a corner of {profile.kind} {profile.name} at y = {y:.2f} mm, where its"
                " pressure has no finite value; change the lateral shift, or round the corner in the profile"
            )


def _corners(placement: Placement) -> list[tuple[Profile, float, float]]:
    """Convex corners of both profiles: y and arc length from the touch point (mm)."""
    found = []
    touch = placement.first
    for profile, u in ((placement.rail.profile, touch.rail_u), (placement.wheel.profile, touch.wheel_u)):
        turns = (
            (junction.y_mm, math.remainder(junction.angle_right_rad - junction.angle_left_rad, math.tau))
            for junction in profile.junctions
        )
        y = np.array([place for place, turn in turns if profile.convex_sign * turn > _CORNER_RAD])
        arcs = profile.arc_length(profile.locate(y)) - float(profile.arc_length(u))
        found += [(profile, float(at), float(arc)) for at, arc in zip(y, arcs, strict=True)]
    return found
