"""Where the rigid bodies touch: contact frame, contact angle and relative curvatures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.geometry.poses import RailPose, WheelPose
from fecontact.profiles.curve import Side

Floats = NDArray[np.float64]

# A touch point this close to a junction has no curvature of its own: profile tolerances are hundredths of a mm.
AT_JUNCTION_MM = 1e-3


@dataclass(frozen=True, kw_only=True)
class RelativeCurvature:
    """Curvatures at a touch point (1/mm, positive where the body is convex) and the Hessian of the gap.

    gap = 1/2 (xx x^2 + 2 xy x y + yy y^2) in the contact frame. At a junction there is one for each side of it.
    """

    rail_per_mm: float
    wheel_lateral_per_mm: float
    wheel_rolling_per_mm: float
    xx_per_mm: float
    xy_per_mm: float
    yy_per_mm: float

    @property
    def hessian(self) -> Floats:
        """Second derivatives of the gap (2, 2) in 1/mm."""
        return np.array([[self.xx_per_mm, self.xy_per_mm], [self.xy_per_mm, self.yy_per_mm]])


@dataclass(frozen=True, kw_only=True)
class TouchPoint:
    """A separate minimum of the vertical gap between wheel and rail.

    Attributes
    ----------
    x_mm, y_mm, z_mm
        Position in the track frame, on the rail.
    rail_y_mm, wheel_y_mm
        Position across the rail's and the wheel's own profile.
    contact_angle_rad
        Angle of the tangent plane about x, positive on the gauge side of the head.
    vertical_gap_mm
        Undeformed gap; 0 at the first touch point.
    curvatures
        One entry, or two (gauge side, field side) where the touch point lies at a junction.
    """

    x_mm: float
    y_mm: float
    z_mm: float
    rail_u: float
    wheel_u: float
    rail_y_mm: float
    wheel_y_mm: float
    contact_angle_rad: float
    vertical_gap_mm: float
    curvatures: tuple[RelativeCurvature, ...]

    @property
    def curvature(self) -> RelativeCurvature:
        """The curvature, that of the field side where the touch point lies at a junction."""
        return self.curvatures[-1]

    @property
    def at_junction(self) -> bool:
        """Whether the curvature is undefined here."""
        return len(self.curvatures) > 1

    @property
    def tangent(self) -> Floats:
        """Lateral unit vector of the contact frame in the track frame."""
        return np.array([0.0, np.cos(self.contact_angle_rad), np.sin(self.contact_angle_rad)])

    @property
    def normal(self) -> Floats:
        """Normal unit vector of the contact frame in the track frame, from the rail to the wheel."""
        return np.array([0.0, -np.sin(self.contact_angle_rad), np.cos(self.contact_angle_rad)])


def touch_point_at(rail: RailPose, wheel: WheelPose, u_wheel: float, u_rail: float, gap: float) -> TouchPoint:
    """The touch point at parameters of both lines that are a gap (mm) apart, with the curvatures of its sides."""
    theta, x, y, _ = wheel.silhouette(u_wheel)
    _, z_rail, angle = rail.section(u_rail)
    sides: tuple[Side, ...] = ("left", "right")
    rail_u = {s: rail.profile.snap(u_rail, AT_JUNCTION_MM) for s in sides}
    wheel_u = {s: wheel.profile.snap(u_wheel, AT_JUNCTION_MM) for s in sides}
    both = tuple(
        _relative_curvature(rail, wheel, float(wheel_u[s]), float(rail_u[s]), float(theta), float(angle), s)
        for s in sides
    )
    left, right = (c.rail_per_mm + c.wheel_lateral_per_mm for c in both)
    smooth = abs(left - right) <= 1e-6 * (abs(left) + abs(right)) + 1e-9
    return TouchPoint(
        x_mm=float(x),
        y_mm=float(y),
        z_mm=float(z_rail),
        rail_u=u_rail,
        wheel_u=u_wheel,
        rail_y_mm=float(rail.profile.evaluate(u_rail).y),
        wheel_y_mm=float(wheel.profile.evaluate(u_wheel).y),
        contact_angle_rad=float(angle),
        vertical_gap_mm=gap,
        curvatures=both[1:] if smooth else both,
    )


def _relative_curvature(
    rail: RailPose, wheel: WheelPose, u_wheel: float, u_rail: float, theta: float, angle: float, side: Side
) -> RelativeCurvature:
    p = wheel.profile.evaluate(u_wheel, side)
    meridian = np.arctan2(float(p.dz), float(p.dy))
    radial = wheel.axes @ np.array([np.sin(theta), 0.0, -np.cos(theta)])
    round_about = wheel.axes @ np.array([np.cos(theta), 0.0, np.sin(theta)])
    along = np.cos(meridian) * wheel.axes[:, 1] - np.sin(meridian) * radial
    rolling = float(np.cos(meridian) / wheel.radius(u_wheel))
    lateral = float(wheel.profile.convex_sign * p.curvature_per_mm)
    rail_curvature = float(rail.profile.convex_sign * rail.profile.evaluate(u_rail, side).curvature_per_mm)
    tangent = np.array([0.0, np.cos(angle), np.sin(angle)])
    a = np.array([round_about[0], round_about @ tangent])
    b = np.array([along[0], along @ tangent])
    hessian = rolling * np.outer(a, a) + lateral * np.outer(b, b)
    return RelativeCurvature(
        rail_per_mm=rail_curvature,
        wheel_lateral_per_mm=lateral,
        wheel_rolling_per_mm=rolling,
        xx_per_mm=float(hessian[0, 0]),
        xy_per_mm=float(hessian[0, 1]),
        yy_per_mm=float(hessian[1, 1]) + rail_curvature,
    )
