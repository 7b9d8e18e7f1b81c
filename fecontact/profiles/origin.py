"""Where a file has the tape circle of a wheel: a verdict needs it, so a doubtful place is refused with the remedy."""

from __future__ import annotations

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.profiles.curve import Kind
from fecontact.profiles.reading import Reading, remedy

# A line reaches so far to both sides of its tape circle at least.
_INSIDE_MM = 1.0
# A part that lies so deep below the tread is a flange. Flanges of trams have 15 to 20 mm.
_FLANGE_MM = 12.0
# The tip of a flange from the tape circle: -55 mm on most wheels, -49 to -60 mm on measured ones.
_TIP_MM = (-75.0, -40.0)
_USUAL_TIP_MM, _USUAL_FROM_BACK_MM = -55.0, 70.0
# The tip of a flange from its back: where it lies there, y counts from the back.
_TIP_OVER_BACK_MM = (5.0, 30.0)
# Largest height at the tape circle without an answer, and the one from which it is noted: instruments leave 0.35 mm.
_HEIGHT_MM, _NOTED_MM = 0.5, 0.1


def check_origin(points: Floats, kind: Kind, reading: Reading, what: str) -> list[str]:
    """Check where points (n, 2) have their origin, in the axes of the library after all that `reading` asks for.

    Returns
    -------
    list of str
        What is to be said of the origin.

    Raises
    ------
    InputError
        The tape circle of a wheel lies outside the line or on a flange, or the line does not pass it at z = 0; with the
        option that settles it.
    """
    if kind == "rail":
        return _check_rail(points, reading, what)
    y, z = points.T
    inside = y.min() + _INSIDE_MM <= 0.0 <= y.max() - _INSIDE_MM
    height = float(np.interp(0.0, np.maximum.accumulate(y), z))
    tip = int(np.argmin(z))
    tread = height if inside and not _is_flange(y, z, float(np.median(z))) else float(np.median(z))
    notes = []
    if _is_flange(y, z, tread) and not _TIP_MM[0] <= y[tip] <= _TIP_MM[1]:
        found = f"the tip of the flange lies at y = {y[tip]:.1f} mm"
        usual = f"{_TIP_MM[0]:g} to {_TIP_MM[1]:g} mm from the tape circle y = 0"
        # whoever gives the tape circle knows a wheel with an unusual flange
        if reading.tape_circle_mm is None:
            raise InputError(
                f"{what}: {found}; allowed: {usual}; {_tape_circle_remedy(float(y[tip]), reading)}, or"
                f" {remedy('wheel', 'tape_circle_mm', 0.0)} if y = 0 is the tape circle of this wheel"
            )
        notes.append(f"{found}; usual are {usual}")
    if not inside:
        ends = sorted(_in_file(float(end), reading) for end in (y.min(), y.max()))
        raise InputError(
            f"{what}: the tape circle y = 0 lies outside the line or at its end, y = {y.min():.4g} to {y.max():.4g} mm;"
            f" allowed: at least {_INSIDE_MM:g} mm within it; give the y of the file at which the rolling radius is"
            f" measured, {ends[0] + _INSIDE_MM:.4g} to {ends[1] - _INSIDE_MM:.4g} mm, by --wheel-tape-circle-mm"
            " (tape_circle_mm in [wheel_file])"
        )
    if reading.tape_circle_z_mm is not None:
        return [*notes, f"z = {reading.tape_circle_z_mm:g} mm of the file has the rolling radius"]
    if abs(height) > _HEIGHT_MM:
        raise InputError(
            f"{what}: the line passes the tape circle y = 0 at z = {height:.4g} mm; allowed: {-_HEIGHT_MM:g} to"
            f" {_HEIGHT_MM:g} mm; {remedy(kind, 'tape_circle_z_mm', round(height, 4))} if the rolling radius is that of"
            f" the line there, or {remedy(kind, 'tape_circle_z_mm', 0.0)} if it belongs to z = 0"
        )
    if abs(height) > _NOTED_MM:
        notes.append(
            f"the line passes the tape circle y = 0 at z = {height:.4g} mm, not 0: check the origin of the file"
        )
    return notes


def _is_flange(y: Floats, z: Floats, tread: float) -> bool:
    """Whether the lowest point of a wheel lies on a flange: deep below the tread, and not at the field side's end."""
    tip = int(np.argmin(z))
    return tread - float(z[tip]) > _FLANGE_MM and tip < y.size - 1


def _in_file(y_mm: float, reading: Reading) -> float:
    """Position in the file of a position from the tape circle."""
    return (reading.tape_circle_mm or 0.0) + (-y_mm if reading.mirror else y_mm)


def _tape_circle_remedy(tip_mm: float, reading: Reading) -> str:
    side = -1.0 if reading.mirror else 1.0
    at = _in_file(tip_mm, reading)
    if _TIP_OVER_BACK_MM[0] <= side * at <= _TIP_OVER_BACK_MM[1]:
        usual = remedy("wheel", "tape_circle_mm", side * _USUAL_FROM_BACK_MM)
        return f"where y counts from the back of the flange, {usual}"
    near = float(round(at - side * _USUAL_TIP_MM))
    return f"{remedy('wheel', 'tape_circle_mm', near)} for the usual {-_USUAL_TIP_MM:g} mm from the tip"


def _check_rail(points: Floats, reading: Reading, what: str) -> list[str]:
    for given, option in ((reading.tape_circle_mm, "tape-circle-mm"), (reading.tape_circle_z_mm, "tape-circle-z-mm")):
        if given:
            raise InputError(
                f"{what}: {given:g} mm is given for a tape circle, but a rail has none; leave out --rail-{option}"
            )
    top = points[points[:, 1].argmax()]
    if abs(top[0]) > 1.0 or abs(top[1]) > 0.1:
        return [
            f"the highest point is ({top[0]:.4g}, {top[1]:.4g}) mm, not the origin: the rail may be canted already,"
            " worn, or have another origin; it is used as it is"
        ]
    return []
