"""Whether a line has the size and the axes of a rail or of a wheel: y to the field side, z up, mm."""

from __future__ import annotations

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.curve import Kind
from fecontact.profiles.reading import remedy
from fecontact.profiles.segments import Floats

SPAN_RANGE_MM = (10.0, 500.0)
# A rail's head has no dip, and a wheel's rim no drop at its field side, of this depth.
_DIP_MM = 8.0


def check_shape(y: Floats, z: Floats, *, kind: Kind, what: str) -> None:
    """Check the size of a line (mm, shape (n,)) and the direction of its axes.

    Raises
    ------
    InputError
        Implausible size, z pointing down, or a wheel with its flange on the field side.
    """
    span = float(max(np.ptp(y), np.ptp(z)))
    low, high = SPAN_RANGE_MM
    if not low <= span <= high:
        advice = (
            f"this looks like metres, so multiply by 1000, or {remedy(kind, 'units', 'm')}"
            if 0.01 <= span <= 0.5
            else f"say the unit of the file: for inches {remedy(kind, 'units', 'in')}"
        )
        raise InputError(f"{what}: the line spans {span:.4g} mm; allowed: {low:g} to {high:g} mm; {advice}")
    if kind == "rail":
        # a head lies above the chord between its ends, canted, worn or half
        weight = (0.5 * (y[0] + y[-1]) - y[0]) / (y[-1] - y[0]) if y[-1] != y[0] else 0.5
        middle = np.abs(y - 0.5 * (y[0] + y[-1])) <= 0.1 * abs(y[-1] - y[0])
        above = float(np.median(z[middle])) - (z[0] + weight * (z[-1] - z[0])) if middle.any() else 0.0
        if above < -0.1:
            raise InputError(
                f"{what}: the middle of the rail lies {-above:.2f} mm below the chord between its ends, but z points "
                "up and a rail head is highest in the middle; flip the sign of z, or " + remedy(kind, "flip_z", "yes")
            )
        dip, at = _deepest_dip(z)
        if dip > _DIP_MM:
            raise InputError(
                f"{what}: the line dips by {dip:.1f} mm at y = {y[at]:.1f} mm, as the flange of a wheel does; a rail is"
                " wanted: give the file as the wheel, or cut the line at the sides of the head"
            )
        return
    middle = z[(y > y[0] + 0.3 * (y[-1] - y[0])) & (y < y[0] + 0.7 * (y[-1] - y[0]))]
    if middle.size and float(np.median(middle)) - max(z[0], z[-1]) > _DIP_MM and _deepest_dip(z)[0] < 1.0:
        raise InputError(
            f"{what}: both ends of the line lie more than {_DIP_MM:g} mm below its middle, as those of a rail do;"
            " a wheel is wanted: give the file as the rail"
        )
    # the flange back and the rim face reach up far, so they do not count
    steep = np.abs(np.diff(z)) > 4.0 * np.abs(np.diff(y))
    gentle = np.flatnonzero(~steep)
    if not gentle.size:
        raise InputError(
            f"{what}: the whole line is steep; a wheel needs its tread, z up and y across; swap the columns"
        )
    y, z = y[gentle[0] : gentle[-1] + 2], z[gentle[0] : gentle[-1] + 2]
    tread = float(np.median(z))
    up, down = float(z.max()) - tread, tread - float(z.min())
    if up > 10.0 and up > down:
        raise InputError(
            f"{what}: the line rises to {up:.1f} mm above the tread at y = {y[z.argmax()]:.1f} mm and falls only "
            f"{down:.1f} mm below it, but z points up and a flange reaches down; flip the sign of z, or "
            + remedy(kind, "flip_z", "yes")
        )
    if down > 10.0 and y[z.argmin()] > 0.5 * (y.min() + y.max()):
        raise InputError(
            f"{what}: the flange lies at y = {y[z.argmin()]:.1f} mm, on the field side, but y is positive to the field "
            "side; flip the sign of y, or " + remedy(kind, "mirror", "yes")
        )


def _deepest_dip(z: Floats) -> tuple[float, int]:
    """How far a line lies below higher points on both of its sides at most, and where."""
    depth = np.minimum(np.maximum.accumulate(z), np.maximum.accumulate(z[::-1])[::-1]) - z
    at = int(np.argmax(depth))
    return float(depth[at]), at


def origin_notes(points: Floats, kind: Kind) -> list[str]:
    """What is to be said of points (n, 2) whose origin is not a rail's crown or a wheel's tape circle."""
    y, z = points.T
    if kind == "rail":
        top = points[z.argmax()]
        if abs(top[0]) > 1.0 or abs(top[1]) > 0.1:
            return [
                f"the highest point is ({top[0]:.4g}, {top[1]:.4g}) mm, not the origin: the rail may be canted already,"
                " worn, or have another origin; it is used as it is"
            ]
        return []
    if not y.min() <= 0.0 <= y.max():
        return [f"the tape circle y = 0 lies outside the line, y = {y.min():.4g} to {y.max():.4g} mm"]
    if abs(at_tape := float(np.interp(0.0, np.maximum.accumulate(y), z))) > 0.1:
        return [f"the line passes the tape circle y = 0 at z = {at_tape:.4g} mm, not 0: check the origin of the file"]
    return []
