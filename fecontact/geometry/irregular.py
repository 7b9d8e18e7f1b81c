"""A wheel on a rail that are irregular along the track: touch points and curvatures of gap and irregularity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from fecontact.errors import InputError
from fecontact.geometry.along_track import AlongTrack
from fecontact.geometry.placement import REACH_MM, Placement
from fecontact.geometry.touch_points import TouchPoint
from fecontact.irregularity.shapes import Irregularity
from fecontact.irregularity.touching import on_edge, touches


def with_irregularities(placement: Placement, lines: Sequence[Irregularity], distance_mm: float) -> Placement:
    """The rigid wheel on an irregular rail: lowered until both touch, with the touch points and curvatures there.

    The openings are taken along the normals of the rail. Range of validity: slopes along the track are small, so that
    the profile of the wheel is the same a few mm before its lowest point.

    Raises
    ------
    InputError
        If it touches an edge, where there is no curvature.
    """
    flats = [line.on_wheel(placement.wheel.rolling_radius_mm) for line in lines]
    along = AlongTrack(lines=tuple(flats), distance_mm=distance_mm, middle_x_mm=placement.first.x_mm)
    found = [touch for smooth in placement.touch_points for touch in _touches(smooth, along)]
    found.sort(key=lambda touch: touch.vertical_gap_mm)
    least = found[0].vertical_gap_mm
    near = [touch for touch in found if touch.vertical_gap_mm <= least + REACH_MM]
    return replace(
        placement,
        touch_points=tuple(replace(touch, vertical_gap_mm=touch.vertical_gap_mm - least) for touch in near),
        along=replace(along, lowered_mm=least),
    )


def _touches(smooth: TouchPoint, along: AlongTrack) -> list[TouchPoint]:
    """Touch points that a touch point of the smooth bodies becomes, their gaps from where those touch first."""
    xx, upright = smooth.curvature.xx_per_mm, float(smooth.normal[2])
    reach = math.sqrt(2.0 * (REACH_MM + along.height_mm) / xx)
    found = touches(0.5 * xx, lambda x: along.opening_mm(x + smooth.x_mm), reach)
    if on_edge(found, tuple(kink - smooth.x_mm for kink in along.kinks_x_mm), reach):
        raise InputError(
            f"at {along.distance_mm:g} mm the wheel stands on an edge of its irregularity, where there is no curvature"
            " and the pressure has no bound; give a haversine, a table with the edge's radius, or another distance"
        )
    return [
        replace(
            smooth,
            x_mm=smooth.x_mm + touch.x_mm,
            vertical_gap_mm=smooth.vertical_gap_mm + touch.gap_mm / upright,
            curvatures=tuple(replace(one, xx_per_mm=2.0 * touch.A_per_mm) for one in smooth.curvatures),
        )
        for touch in found
    ]
