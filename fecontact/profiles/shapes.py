"""Profiles that are made from a few lengths: arcs, straight lines, and standard heads of tangent arcs."""

from __future__ import annotations

import math
from collections.abc import Sequence

from fecontact.errors import InputError, check_positive
from fecontact.profiles.curve import JOINT_GAP_MM, Profile
from fecontact.profiles.segments import Arc, Line, Polynomial, Segment

Point = tuple[float, float]


def arc_between(start: Point, end: Point, *, centre: Point, radius: float, what: str = "arc") -> Arc:
    """Shorter arc from `start` to `end` about `centre` (mm); the points only give its two angles.

    Raises
    ------
    InputError
        A point lies off the circle by more than 0.001 mm.
    """
    angles = []
    for point in (start, end):
        off = math.hypot(point[0] - centre[0], point[1] - centre[1]) - radius
        if not abs(off) <= JOINT_GAP_MM:
            raise InputError(
                f"{what}: the point {point} mm lies {off:.3g} mm off the circle of radius {radius:g} mm about {centre} "
                f"mm; allowed: {JOINT_GAP_MM:g} mm; correct the point, the centre or the radius"
            )
        angles.append(math.atan2(point[1] - centre[1], point[0] - centre[0]))
    turn = math.remainder(angles[1] - angles[0], math.tau)
    return Arc(centre=centre, radius=radius, angle_from=angles[0], angle_to=angles[0] + turn)


def tangent_head(
    radii: Sequence[float], half_widths: Sequence[float], *, side_one_in: float, side_to_z: float
) -> list[Segment]:
    """Segments of a mirror-symmetric rail head of tangent arcs and straight sides, from left to right.

    Parameters
    ----------
    radii
        Radii of the arcs from the crown outwards (mm).
    half_widths
        Distance from the axis of the point where each arc meets the next (mm), one fewer than the radii.
    side_one_in
        The sides lean outwards, 1 across to this much down; infinite for vertical sides.
    side_to_z
        Height at which the sides end (mm, negative: below the crown).

    Raises
    ------
    InputError
        The arcs do not follow one another outwards and downwards.
    """
    # Each centre lies on the radius through the joint, which makes the joint exactly tangent. Angles from the y axis.
    centre, angles = (0.0, -radii[0]), [math.pi / 2]
    right: list[Segment] = []
    for i, radius in enumerate(radii):
        if i < len(half_widths):
            reach = (half_widths[i] - centre[0]) / radius
            angle = math.acos(reach) if 0.0 < reach < 1.0 else math.nan
        else:
            angle = math.atan(1.0 / side_one_in)
        if not angle < angles[-1]:
            raise InputError(
                f"head: arc {i + 1} with radius {radius:g} mm cannot reach its outer end; give the half-widths from "
                f"the crown outwards, each within its arc (radii {list(radii)}, half_widths {list(half_widths)} mm)"
            )
        right.append(Arc(centre=centre, radius=radius, angle_from=angles[-1], angle_to=angle))
        angles.append(angle)
        if i + 1 < len(radii):
            shift = radius - radii[i + 1]
            centre = (centre[0] + shift * math.cos(angle), centre[1] + shift * math.sin(angle))
    corner = (centre[0] + radii[-1] * math.cos(angles[-1]), centre[1] + radii[-1] * math.sin(angles[-1]))
    if not side_to_z < corner[1]:
        raise InputError(f"head: side_to_z is {side_to_z:g} mm; allowed: below the last arc, {corner[1]:.4f} mm")
    foot = (corner[0] + (corner[1] - side_to_z) / side_one_in, side_to_z)
    right.append(Line(start=corner, end=foot))
    crown = Arc(centre=(0.0, -radii[0]), radius=radii[0], angle_from=math.pi - angles[1], angle_to=angles[1])
    return [*mirrored(right[1:]), crown, *right[1:]]


def mirrored(segments: Sequence[Segment]) -> list[Segment]:
    """Mirror image in y of a chain, in the order that goes on from its end on the axis."""
    image: list[Segment] = []
    for s in reversed(segments):
        if isinstance(s, Line):
            image.append(Line(start=(-s.end[0], s.end[1]), end=(-s.start[0], s.start[1])))
        elif isinstance(s, Arc):
            image.append(
                Arc(
                    centre=(-s.centre[0], s.centre[1]),
                    radius=s.radius,
                    angle_from=math.pi - s.angle_to,
                    angle_to=math.pi - s.angle_from,
                )
            )
        elif isinstance(s, Polynomial):
            flipped = tuple(c * (-1.0) ** k for k, c in enumerate(s.coefficients))
            image.append(Polynomial(coefficients=flipped, y_from=-s.y_to, y_to=-s.y_from))
        else:
            raise AssertionError("points are never mirrored")
    return image


def circular_rail_head(radius_mm: float, half_width_mm: float = 36.0) -> Profile:
    """Rail head of one arc with its crown at (0, 0), for comparisons with closed forms.

    The arc reaches to |y| = min(half_width_mm, 0.95 radius_mm).

    Raises
    ------
    InputError
        A length is not finite and positive.
    """
    check_positive("radius of the rail head", radius_mm, "mm", "for example circle:300")
    check_positive("half-width of the rail head", half_width_mm, "mm", "for example 36")
    reach = math.asin(min(half_width_mm / radius_mm, 0.95))
    arc = Arc(centre=(0.0, -radius_mm), radius=radius_mm, angle_from=math.pi / 2 + reach, angle_to=math.pi / 2 - reach)
    return Profile(name=f"circle:{radius_mm:g}", kind="rail", segments=(arc,), source="circular arc")


def two_arc_rail_head(crown_mm: float, gauge_mm: float, junction_mm: float, half_width_mm: float = 36.0) -> Profile:
    """Rail head of two tangent arcs with its crown at (0, 0): a curvature junction at a known distance from it.

    Parameters
    ----------
    crown_mm
        Radius on the field side of the junction.
    gauge_mm
        Radius on its gauge side.
    junction_mm
        Arc length from the crown to the junction, positive to the gauge side: the crown then lies on the first arc;
        negative: on the second; 0: at the junction itself.
    half_width_mm
        The arcs reach to this |y|, at most to 95 % of their radius from their centre.

    Raises
    ------
    InputError
        A length is not finite and positive, or the crown does not lie on the arcs.
    """
    for name, radius in (("field", crown_mm), ("gauge", gauge_mm)):
        check_positive(f"radius on the {name} side", radius, "mm", "for example arcs:300/80@2.5")
    radius = crown_mm if junction_mm >= 0.0 else gauge_mm
    if not abs(junction_mm) < min(radius, half_width_mm):
        raise InputError(
            f"junction at {junction_mm:g} mm from the crown; allowed: less than the arc of {radius:g} mm under it and"
            f" the half-width of {half_width_mm:g} mm"
        )
    angle = math.pi / 2 + junction_mm / radius
    normal = (math.cos(angle), math.sin(angle))
    # each centre lies on the common normal, which makes the junction exactly tangent
    joint = (radius * normal[0], radius * (normal[1] - 1.0))
    segments: list[Segment] = []
    for r, side in ((gauge_mm, -1.0), (crown_mm, 1.0)):
        centre = (joint[0] - r * normal[0], joint[1] - r * normal[1])
        reach = min(max((half_width_mm - side * centre[0]) / r, 0.0), 0.95)
        end = math.pi / 2 - side * math.asin(reach)
        first, last = (end, angle) if side < 0.0 else (angle, end)
        if not first > last:
            raise InputError(
                f"junction at {junction_mm:g} mm: the arc of {r:g} mm beside it is too steep there; give a smaller"
                " distance"
            )
        segments.append(Arc(centre=centre, radius=r, angle_from=first, angle_to=last))
    name = f"arcs:{crown_mm:g}/{gauge_mm:g}@{junction_mm:g}"
    return Profile(name=name, kind="rail", segments=tuple(segments), source="two tangent arcs")


def cylinder_wheel(y_from_mm: float = -70.0, y_to_mm: float = 65.0) -> Profile:
    """Wheel with a straight tread at z = 0 and no flange, for comparisons with closed forms.

    Raises
    ------
    InputError
        The tread does not run from small to large y.
    """
    tread = Line(start=(float(y_from_mm), 0.0), end=(float(y_to_mm), 0.0))
    return Profile(name="cylinder", kind="wheel", segments=(tread,), source="straight line")
