"""Touch points as records; radii are positive where convex, None where straight."""

from __future__ import annotations

from dataclasses import asdict

from fecontact.geometry.placement import Placement
from fecontact.geometry.touch_points import RelativeCurvature, TouchPoint
from fecontact.outputs.records.plain import Record, picked
from fecontact.profiles.curve import radius_mm
from fecontact.theory.touch_hertz import sides

_RADII = ("rail", "wheel_lateral", "wheel_rolling")


def profile_notes(placement: Placement) -> list[str]:
    """What is to be known of both profiles."""
    return [*placement.rail.profile.notes, *placement.wheel.profile.notes]


def touch_record(touch: TouchPoint) -> Record:
    """A touch point with its curvatures: one entry, or two (gauge side, field side) at a junction."""
    return {
        **picked(touch, "x_mm y_mm z_mm rail_y_mm wheel_y_mm contact_angle_rad vertical_gap_mm at_junction"),
        "curvatures": [
            {"side": side, **asdict(curvature), **_radii(curvature)}
            for side, curvature in zip(sides(touch), touch.curvatures, strict=True)
        ],
    }


def touch_columns(placement: Placement, touch: TouchPoint) -> Record:
    """A touch point in numbers alone, with the radii of one side of a junction."""
    return {
        **picked(touch, "rail_y_mm wheel_y_mm contact_angle_rad vertical_gap_mm"),
        "rolling_radius_mm": float(placement.wheel.radius(touch.wheel_u)),
        "at_junction": touch.at_junction,
        **_radii(touch.curvature),
    }


def _radii(curvature: RelativeCurvature) -> Record:
    return {f"{name}_radius_mm": radius_mm(getattr(curvature, f"{name}_per_mm")) for name in _RADII}
