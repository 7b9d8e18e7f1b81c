"""Checks of a profile's origin and of a wheel's tape circle.

A verdict needs the tape circle, so a doubtful position is refused with the remedy.
"""

from __future__ import annotations

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.profiles.curve import ProfileKind, measure_median_height
from fecontact.profiles.reading import Reading, suggest_option
from fecontact.profiles.suspicions import SuspiciousProfileError

# Least extent of a profile on both sides of its tape circle.
_LEAST_INSIDE_MM = 1.0
# Least width of the running surface of a wheel: treads without a flange have 60 mm, with a flange 120 to 145 mm.
SHORTEST_WHEEL_MM = 40.0
"""Least width of the running surface of a wheel."""
# Least depth of a flange below the tread. Flanges of trams have 15 to 20 mm.
_LEAST_FLANGE_DEPTH_MM = 12.0
# Position of the tip of a flange from the tape circle: -55 mm on most wheels, -49 to -60 mm on measured wheels.
_ALLOWED_TIP_MM = (-75.0, -40.0)
_USUAL_TIP_MM, _USUAL_FROM_BACK_MM = -55.0, 70.0
# Distance of the tip of a flange from its back. If the tip has such a y, then y is measured from the back.
_TIP_OVER_BACK_MM = (5.0, 30.0)
# Largest height at the tape circle that needs no option, and least height that is noted: instruments leave 0.35 mm.
_LARGEST_HEIGHT_MM, _NOTED_HEIGHT_MM = 0.5, 0.1


def check_origin(points: Floats, kind: ProfileKind, reading: Reading, label: str) -> list[str]:
    """Check the origin of points.

    Parameters
    ----------
    points
        Points (n, 2) in mm, in the axes of the library, after all changes that `reading` demands.
    kind
        `rail` or `wheel`.
    reading
        Options of the file.
    label
        Subject of the message.

    Returns
    -------
    list of str
        Notes on the origin.

    Raises
    ------
    InputError
        The tape circle of a wheel is outside the profile or on a flange, or the profile does not pass the tape circle
        at z = 0. The message has the option that answers the question.
    """
    if kind == "rail":
        return _check_rail_origin(points, reading, label)
    y, z = points.T
    inside = y.min() + _LEAST_INSIDE_MM <= 0.0 <= y.max() - _LEAST_INSIDE_MM
    height = float(np.interp(0.0, np.maximum.accumulate(y), z))
    tip = int(np.argmin(z))
    median_height = measure_median_height(y, z)
    tread = height if inside and not _is_flange(y, z, median_height) else median_height
    notes = []
    if _is_flange(y, z, tread) and not _ALLOWED_TIP_MM[0] <= y[tip] <= _ALLOWED_TIP_MM[1]:
        tip_text = f"the tip of the flange is at y = {y[tip]:.1f} mm"
        usual_text = f"{_ALLOWED_TIP_MM[0]:g} to {_ALLOWED_TIP_MM[1]:g} mm from the tape circle y = 0"
        # users who give the tape circle are aware of an unusual flange
        if reading.tape_circle_mm is None:
            # a tape circle outside the profile is no answer
            unusual = f", or {suggest_option('wheel', 'tape_circle_mm', 0.0)} if y = 0 is the tape circle of this wheel"
            raise SuspiciousProfileError(
                f"{label}: {tip_text}; allowed: {usual_text}; {_suggest_tape_circle(float(y[tip]), reading)}"
                f"{unusual if inside else ''}",
                "tape circle",
            )
        notes.append(f"{tip_text}; usual: {usual_text}")
    if not inside:
        ends = sorted(_locate_in_file(float(end), reading) for end in (y.min(), y.max()))
        width = ends[1] - ends[0]
        if width < SHORTEST_WHEEL_MM:
            raise SuspiciousProfileError(
                f"{label}: {describe_short_wheel(width)}; allowed: at least {SHORTEST_WHEEL_MM:g} mm; give the whole"
                " running surface, or, for a roller that has its radius in the middle of the points,"
                f" {suggest_option(kind, 'tape_circle_mm', round(0.5 * sum(ends), 1))}",
                "short",
            )
        lowest, highest = ends[0] + _LEAST_INSIDE_MM, ends[1] - _LEAST_INSIDE_MM
        example_mm = _USUAL_FROM_BACK_MM if lowest <= _USUAL_FROM_BACK_MM <= highest else float(round(0.5 * sum(ends)))
        raise SuspiciousProfileError(
            f"{label}: the tape circle y = 0 is outside the profile or at its end, y = {y.min():.4g} to "
            f"{y.max():.4g} mm;"
            f" allowed: at least {_LEAST_INSIDE_MM:g} mm within the profile; give the y of the file at which the"
            " rolling"
            f" radius is measured, {lowest:.4g} to {highest:.4g} mm, with --wheel-tape-circle-mm (tape_circle_mm in"
            f" [wheel_file]); for example, {suggest_option(kind, 'tape_circle_mm', example_mm)}",
            "tape circle",
        )
    if reading.tape_circle_z_mm is not None:
        return [*notes, f"the wheel has its rolling radius at z = {reading.tape_circle_z_mm:g} mm of the file"]
    if abs(height) > _LARGEST_HEIGHT_MM:
        raise SuspiciousProfileError(
            f"{label}: the profile has z = {height:.4g} mm at the tape circle y = 0; allowed: "
            f"{-_LARGEST_HEIGHT_MM:g} to"
            f" {_LARGEST_HEIGHT_MM:g} mm; {suggest_option(kind, 'tape_circle_z_mm', round(height, 4))} if the rolling"
            " radius belongs to the profile there, or"
            f" {suggest_option(kind, 'tape_circle_z_mm', 0.0)} if it belongs to z = 0",
            "shifted",
        )
    if abs(height) > _NOTED_HEIGHT_MM:
        notes.append(
            f"the profile has z = {height:.4g} mm at the tape circle y = 0, not 0: check the origin of the file"
        )
    return notes


def has_flange_shape(points: Floats) -> bool:
    """Whether points have the tip of a flange, in any direction of the axes.

    The tip is far from the level of both ends, and narrower than a head.

    Parameters
    ----------
    points
        Points (n, 2) in mm, in the order along the profile.

    Returns
    -------
    bool
        False for a head and for a wheel without a flange.
    """
    tips = []
    for sign in (1.0, -1.0):
        y, z = points[:, 0], sign * points[:, 1]
        top = int(np.argmax(z))
        lower = np.flatnonzero(z < z[top] - _LEAST_FLANGE_DEPTH_MM)
        before, after = lower[lower < top], lower[lower > top]
        if before.size and after.size:
            tips.append((float(z[top] - max(z[0], z[-1])), abs(float(y[after[0]] - y[before[-1]]))))
    return bool(tips) and max(tips)[1] < SHORTEST_WHEEL_MM


def describe_short_wheel(width_mm: float) -> str:
    """Describe a profile that is too narrow to be the running surface of a wheel."""
    return (
        f"the profile is {width_mm:.0f} mm wide, too narrow for the running surface of a wheel: a roller, or a part of"
        " a profile"
    )


def _is_flange(y: Floats, z: Floats, tread: float) -> bool:
    """Whether the lowest point of a wheel is on a flange.

    A flange is deep below the tread, and not at the end on the field side.
    """
    tip = int(np.argmin(z))
    return tread - float(z[tip]) > _LEAST_FLANGE_DEPTH_MM and tip < y.size - 1


def _locate_in_file(y_mm: float, reading: Reading) -> float:
    """Convert a lateral position from the tape circle to the file's y (mm)."""
    return (reading.tape_circle_mm or 0.0) + (-y_mm if reading.mirror else y_mm)


def _suggest_tape_circle(tip_mm: float, reading: Reading) -> str:
    """Suggest the option for the tape circle from the position of the flange tip.

    Parameters
    ----------
    tip_mm
        Lateral position of the flange tip (mm).
    reading
        Options of the file.

    Returns
    -------
    str
        Part of a message.
    """
    side = -1.0 if reading.mirror else 1.0
    tip_in_file_mm = _locate_in_file(tip_mm, reading)
    if _TIP_OVER_BACK_MM[0] <= side * tip_in_file_mm <= _TIP_OVER_BACK_MM[1]:
        usual = suggest_option("wheel", "tape_circle_mm", side * _USUAL_FROM_BACK_MM)
        return f"if y counts from the back of the flange, {usual}"
    rounded_mm = float(round(tip_in_file_mm - side * _USUAL_TIP_MM))
    return f"{suggest_option('wheel', 'tape_circle_mm', rounded_mm)} for the usual {-_USUAL_TIP_MM:g} mm from the tip"


def _check_rail_origin(points: Floats, reading: Reading, label: str) -> list[str]:
    """Check that a rail has no tape circle, and note an unusual highest point.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    reading
        Options of the file.
    label
        Subject of the message.

    Returns
    -------
    list of str
        Notes on the origin.

    Raises
    ------
    InputError
        The options have a tape circle.
    """
    for position_mm, option in (
        (reading.tape_circle_mm, "tape-circle-mm"),
        (reading.tape_circle_z_mm, "tape-circle-z-mm"),
    ):
        if position_mm:
            raise InputError(
                f"{label}: {position_mm:g} mm is given for a tape circle, but a rail has no tape circle; leave out "
                f"--rail-{option}"
            )
    top = points[points[:, 1].argmax()]
    if abs(top[0]) > 1.0 or abs(top[1]) > 0.1:
        return [
            f"the highest point is ({top[0]:.4g}, {top[1]:.4g}) mm, not the origin: the rail may be canted or worn, or"
            " the file has a different origin; the profile is used without a change"
        ]
    return []
