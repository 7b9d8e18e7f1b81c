"""Contact points and curvatures of a wheel on a rail with irregularities."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from fecontact.errors import InputError
from fecontact.placement.along_track import PlacedIrregularities
from fecontact.placement.irregularity import Irregularity
from fecontact.placement.openings import find_gap_minima, is_on_edge
from fecontact.placement.poses import (
    ContactPoint,
)
from fecontact.placement.wheel_on_rail import TOUCH_REACH_MM, Placement


def lower_on_irregularities(
    placement: Placement, irregularities: Sequence[Irregularity], distance_mm: float
) -> Placement:
    """Lower the rigid wheel on an irregular rail, with its contact points and their curvatures.

    The openings are taken along the normals of the rail. Range of validity: slopes along the track are small, so that
    the wheel's section a few mm ahead of its lowest point equals its profile.

    Parameters
    ----------
    placement
        The wheel on the smooth rail.
    irregularities
        Irregularities of wheel and rail.
    distance_mm
        Position along the irregularities at which smooth bodies touch.

    Returns
    -------
    Placement
        The wheel on the irregular rail.

    Raises
    ------
    InputError
        If the wheel touches an edge, where there is no curvature.
    """
    deepened = [irregularity.on_wheel(placement.wheel.rolling_radius_mm) for irregularity in irregularities]
    along = PlacedIrregularities(lines=tuple(deepened), distance_mm=distance_mm, middle_x_mm=placement.first.x_mm)
    points = [touch for smooth in placement.contact_points for touch in _irregular_contact_points(smooth, along)]
    points.sort(key=lambda touch: touch.vertical_gap_mm)
    first_gap_mm = points[0].vertical_gap_mm
    near = [touch for touch in points if touch.vertical_gap_mm <= first_gap_mm + TOUCH_REACH_MM]
    return replace(
        placement,
        contact_points=tuple(replace(touch, vertical_gap_mm=touch.vertical_gap_mm - first_gap_mm) for touch in near),
        along=replace(along, lowered_mm=first_gap_mm),
    )


def _irregular_contact_points(smooth: ContactPoint, along: PlacedIrregularities) -> list[ContactPoint]:
    """Contact points that replace a contact point of the smooth bodies.

    Their gaps are measured from the first touch of the smooth bodies.
    """
    xx, upright = smooth.curvature.xx_per_mm, float(smooth.normal[2])
    reach = math.sqrt(2.0 * (TOUCH_REACH_MM + along.height_mm) / xx)
    minima = find_gap_minima(0.5 * xx, lambda x: along.opening_mm(x + smooth.x_mm), reach)
    if is_on_edge(minima, tuple(kink - smooth.x_mm for kink in along.kinks_x_mm), reach):
        raise InputError(
            f"at {along.distance_mm:g} mm the contact point is on an edge of the irregularity, where the pressure has"
            " no bound; give a haversine, a table with the radius of the edge, or a different distance"
        )
    return [
        replace(
            smooth,
            x_mm=smooth.x_mm + touch.x_mm,
            vertical_gap_mm=smooth.vertical_gap_mm + touch.gap_mm / upright,
            curvatures=tuple(replace(curvature, xx_per_mm=2.0 * touch.A_per_mm) for curvature in smooth.curvatures),
        )
        for touch in minima
    ]
