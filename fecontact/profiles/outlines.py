"""Running surface of a closed outline: a whole section of a rail or of a wheel."""

from __future__ import annotations

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.inputs.texts import count_text
from fecontact.profiles.curve import ProfileKind
from fecontact.profiles.reading import suggest_option

# An outline is closed if its ends are as close as this, in multiples of the chords next to them or in mm, and if it
# encloses this fraction of its bounding box. A head that is measured to its web has ends 15 mm apart.
_CLOSED_CHORDS, _CLOSED_MM, _ENCLOSED_SHARE = 2.0, 3.0, 0.15
# Part of a section, from the top of the rail or from the tip of the flange, in which the sides are searched. The web
# and the foot of a rail, and the disc and the hub of a wheel, are beyond.
_SEARCHED_MM = {"rail": 45.0, "wheel": 75.0}
# The sides of a section are compared at this distance from its upper and its lower end: a head is narrower than a foot,
# and a flange is narrower than a hub.
_COMPARED_MM = {"rail": 45.0, "wheel": 10.0}
_LEAST_WIDTH_RATIO = 1.2


def is_closed(points: Floats) -> bool:
    """Whether points are a closed outline.

    Parameters
    ----------
    points
        Points (n, 2) in mm, in the order along the outline.

    Returns
    -------
    bool
        Whether both ends meet and the outline has an inside.
    """
    chords = np.hypot(*np.diff(points, axis=0).T)
    near_ends = float(max(chords[:3].max(), chords[-3:].max()))
    gap = float(np.hypot(*(points[-1] - points[0])))
    box = float(np.ptp(points[:, 0]) * np.ptp(points[:, 1]))
    is_meeting = gap <= max(_CLOSED_CHORDS * near_ends, _CLOSED_MM)
    return bool(is_meeting and abs(_compute_area(points)) > _ENCLOSED_SHARE * box)


def cut_outline(points: Floats, kind: ProfileKind, name: str, flipped_columns: str) -> tuple[Floats, list[str]]:
    """Cut a closed outline to its running surface.

    The surface is between the widest points of the head or the rim.

    Parameters
    ----------
    points
        Points (n, 2) in mm, in the order along the outline.
    kind
        `rail` or `wheel`.
    name
        Name in the message.
    flipped_columns
        Columns option for the file with the opposite sign of z.

    Returns
    -------
    points, notes
        Points (m, 2) of the running surface from small to large y, and a note; unchanged points of an open profile.

    Raises
    ------
    InputError
        The section is upside down.
    """
    if not is_closed(points):
        return points, []
    # upwards from the body, so that a wheel is treated as a rail
    up = 1.0 if kind == "rail" else -1.0
    height = up * points[:, 1]
    depth = _COMPARED_MM[kind]
    upper, lower = (float(np.ptp(points[side * height > (side * height).max() - depth, 0])) for side in (1.0, -1.0))
    if upper > _LEAST_WIDTH_RATIO * lower:
        ends = ("foot", "head") if kind == "rail" else ("hub", "flange")
        raise InputError(
            f"{name}: the closed outline is {upper:.0f} mm wide at its {'upper' if kind == 'rail' else 'lower'} end and"
            f" {lower:.0f} mm wide at its other end, so its {ends[0]} is where its {ends[1]} should be; reverse the"
            f" sign of z, or {suggest_option(kind, 'columns', flipped_columns)}"
        )
    # clockwise around a rail, so that its head runs from small to large y
    points = points if up * _compute_area(points) < 0.0 else points[::-1]
    start = int(np.argmin(up * points[:, 1]))
    points = np.roll(points, -start, axis=0)
    height = up * points[:, 1]
    top = int(np.argmax(height))
    deep_points = np.flatnonzero(height < height[top] - _SEARCHED_MM[kind])
    first = int(deep_points[deep_points < top].max(initial=-1)) + 1
    last = int(deep_points[deep_points > top].min(initial=len(points))) - 1
    low = first + int(np.argmin(points[first : top + 1, 0]))
    high = top + int(np.argmax(points[top : last + 1, 0]))
    omitted = len(points) - (high + 1 - low)
    surface = "head" if kind == "rail" else "running surface"
    return points[low : high + 1], [
        f"the file has a closed outline: its {surface} is used, {count_text(omitted, 'other point')} cut off"
    ]


def _compute_area(points: Floats) -> float:
    """Compute the area (mm2) of a closed outline, positive if it runs anticlockwise."""
    y, z = (points - points[0]).T
    return 0.5 * float(np.sum(y * np.roll(z, -1) - z * np.roll(y, -1)))
