"""Profiles from measured or tabulated points: a text file of two columns, y and z in mm.

A file that looks wrong is refused with the remedy rather than repaired in silence: half of all trouble with profiles is
a unit, a sign or an order. What had to be assumed is written into the notes of the profile.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.curve import FARTHEST_MM, Floats, Integers, Kind, Line, Profile, Segment, Spline

FEWEST_POINTS = 10
SPAN_RANGE_MM = (10.0, 500.0)
# Angle between neighbouring chords that is a corner of the body and not a coarsely sampled fillet (rad, 20 degrees).
SPLIT_RAD = 0.35
# A step back in y is the side of the body, not a fold of the line, if it is this much steeper than wide.
_OVERHANG_SLOPE = 5.0
# Root mean square of the curvature of a cubic spline through independent errors e at spacing h, in e / h^2: the
# transfer function 12 (1 - cos w) / (4 + 2 cos w) of the spline averaged over all waves.
SPLINE_NOISE = 6.0
_COMMENT = ("#", "!", "%")
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+(?:\s*;\s*|\s+)[-+]?\d+,\d+")


def read_points(path: str | Path, *, kind: Kind) -> Profile:
    """Profile from a text file of two columns, y and z in mm, interpolated by splines.

    Columns may be separated by blanks, tabs, commas or semicolons; lines that start with # ! or % are comments, and the
    first line may be a header. The axes are those of the library: y positive to the field side, z up; a rail has its
    crown and a wheel its tape circle at (0, 0).

    Raises
    ------
    InputError
        The file cannot be read, or its points do not look like a running surface in these axes.
    """
    path = Path(path)
    return profile_from_points(*_parse(_text(path), what=str(path)), kind=kind, name=path.stem, source=str(path))


def profile_from_points(y: Floats, z: Floats, *, kind: Kind, name: str, source: str = "") -> Profile:
    """Profile through points (mm, shape (n,)) in the order along the line, with cubic splines between corners.

    Raises
    ------
    InputError
        The points do not look like a running surface; see `read_points`.
    """
    points, notes = np.column_stack((y, z)).astype(float), []
    # also false for NaN
    bad = np.flatnonzero(~(np.abs(points) <= FARTHEST_MM).all(axis=1))
    if bad.size:
        raise InputError(
            f"{name}: point {bad[0] + 1} is {_at(points[bad[0]])}; allowed: -{FARTHEST_MM:g} to {FARTHEST_MM:g} mm; "
            "remove it, or move the origin to the crown of the rail or the tape circle of the wheel"
        )

    same = np.concatenate(([False], (np.diff(points, axis=0) == 0.0).all(axis=1)))
    if same.any():
        points = points[~same]
        notes.append(f"{_count(int(same.sum()), 'repeated point')} dropped")
    if len(points) < FEWEST_POINTS:
        raise InputError(
            f"{name}: there are {_count(len(points), 'different point')}; at least {FEWEST_POINTS} are needed, "
            "better one every 0.5 mm"
        )
    if points[-1, 0] < points[0, 0]:
        points = points[::-1]
        notes.append("the points ran towards small y: their order was reversed")

    check_shape(points[:, 0], points[:, 1], kind=kind, what=name)
    notes += _check_order(points, name)
    corners = np.flatnonzero(np.abs(_turning_angles(points)) > SPLIT_RAD) + 1
    notes += _check_spacing(points, corners, name)
    notes += _assumptions(points, kind)
    if corners.size:
        where = ", ".join(f"{points[i, 0]:.2f}" for i in corners[:6]) + (" ..." if corners.size > 6 else "")
        notes.append(f"split at {_count(corners.size, 'corner')}: y = {where} mm")
    notes.append(_noise(points))
    pieces = np.split(np.arange(len(points)), corners)
    segments = [_piece(points[piece[0] : piece[-1] + 2]) for piece in pieces]
    return Profile(name=name, kind=kind, segments=tuple(segments), source=source, notes=tuple(notes))


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
        remedy = (
            "coordinates are in mm; this looks like metres, so multiply by 1000"
            if 0.01 <= span <= 0.5
            else "coordinates are in mm; convert from the unit of the file (from inches: multiply by 25.4)"
        )
        raise InputError(f"{what}: the line spans {span:.4g} mm; allowed: {low:g} to {high:g} mm; {remedy}")
    if kind == "rail":
        # a head lies above the chord between its ends, canted, worn or half
        weight = (0.5 * (y[0] + y[-1]) - y[0]) / (y[-1] - y[0]) if y[-1] != y[0] else 0.5
        middle = np.abs(y - 0.5 * (y[0] + y[-1])) <= 0.1 * abs(y[-1] - y[0])
        above = float(np.median(z[middle])) - (z[0] + weight * (z[-1] - z[0])) if middle.any() else 0.0
        if above < -0.1:
            raise InputError(
                f"{what}: the middle of the rail lies {-above:.2f} mm below the chord between its ends, but z points "
                "up and a rail head is highest in the middle; flip the sign of z"
            )
        return
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
            f"{down:.1f} mm below it, but z points up and a flange reaches down; flip the sign of z"
        )
    if down > 10.0 and y[z.argmin()] > 0.5 * (y.min() + y.max()):
        raise InputError(
            f"{what}: the flange lies at y = {y[z.argmin()]:.1f} mm, on the field side, but y is positive to the field "
            "side; flip the sign of y"
        )


def _text(path: Path) -> str:
    try:
        data = path.read_bytes()
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {path}: {getattr(error, 'strerror', error)}; check the path") from None
    if b"\0" in data:
        raise InputError(f"{path} is not plain text (a table file or UTF-16?); save it as text of two columns")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        # comments in an older encoding; the numbers are checked below
        return data.decode("latin-1")


def _parse(text: str, *, what: str) -> tuple[Floats, Floats]:
    rows: list[tuple[float, float]] = []
    header_allowed = True
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if not line or line.startswith(_COMMENT):
            continue
        if _DECIMAL_COMMA.fullmatch(line):
            raise InputError(f"{what}, line {number}: {line[:60]!r} has decimal commas; write decimal points")
        fields = re.split(r"\s*[,;]\s*|\s+", line.rstrip(",;"))
        values = [_float(field) for field in fields]
        if header_allowed and all(value is None for value in values):
            header_allowed = False
            continue
        header_allowed = False
        if len(fields) != 2:
            raise InputError(
                f"{what}, line {number}: {_count(len(fields), 'column')} instead of 2 in {line[:60]!r}; keep y and z "
                "only, and start comments with #"
            )
        if values[0] is None or values[1] is None:
            raise InputError(f"{what}, line {number}: {line[:60]!r} is not two numbers; start comments with #")
        if not np.isfinite(values[0] + values[1]):
            raise InputError(f"{what}, line {number}: {line[:60]!r} is not finite; remove the line")
        rows.append((values[0], values[1]))
    if not rows:
        raise InputError(f"{what}: no numbers; the file needs at least {FEWEST_POINTS} lines of y and z in mm")
    table = np.array(rows)
    return table[:, 0], table[:, 1]


def _float(field: str) -> float | None:
    try:
        return float(field)
    except ValueError:
        return None


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def _at(point: Floats) -> str:
    return f"({point[0]:.4g}, {point[1]:.4g}) mm"


def _turning_angles(points: Floats) -> Floats:
    """Angle between the chords before and after each inner point."""
    d = np.diff(points, axis=0)
    return np.asarray(np.arctan2(d[:-1, 0] * d[1:, 1] - d[:-1, 1] * d[1:, 0], (d[:-1] * d[1:]).sum(axis=1)))


def _check_order(points: Floats, name: str) -> list[str]:
    step = np.diff(points, axis=0)
    back = step[:, 0] <= 0.0
    folded = np.flatnonzero(back & (np.abs(step[:, 1]) < _OVERHANG_SLOPE * np.abs(step[:, 0])))
    turned = np.flatnonzero(np.abs(_turning_angles(points)) > 2.0) + 1
    for i in (*folded, *turned):
        raise InputError(
            f"{name}: the line turns back at point {i + 1}, {_at(points[i])}; give the points of the running surface "
            "in their order along the line, once, without the inside of the body"
        )
    if back.any():
        return [f"the line is vertical or overhangs at {_count(int(back.sum()), 'point')}: kept as a steep side"]
    return []


def _check_spacing(points: Floats, corners: Integers, name: str) -> list[str]:
    chord = np.hypot(*np.diff(points, axis=0).T)
    # a face between two corners needs only its ends
    is_end = np.ones(len(points), dtype=bool)
    is_end[1:-1] = False
    is_end[corners] = True
    chord[is_end[:-1] & is_end[1:]] = 0.0
    typical, i = float(np.median(chord)), int(chord.argmax())
    if chord[i] > max(2.0, 10.0 * typical):
        raise InputError(
            f"{name}: a gap of {chord[i]:.2f} mm after {_at(points[i])}, where points are usually {typical:.2g} mm "
            f"apart; allowed: {max(2.0, 10.0 * typical):.3g} mm; add points there or cut the file at the gap"
        )
    if chord[i] > 2.0:
        return [f"points are up to {chord[i]:.2g} mm apart, at {_at(points[i])}: a smaller feature is not seen"]
    return []


def _assumptions(points: Floats, kind: Kind) -> list[str]:
    y, z = points.T
    if kind == "rail":
        notes = ["taken as: mm, y positive to the field side, z up, not canted"]
        top = points[z.argmax()]
        if abs(top[0]) > 1.0 or abs(top[1]) > 0.1:
            notes.append(
                f"the highest point is {_at(top)}, not the origin: the rail may be canted already, worn, or have "
                "another origin; it is used as it is"
            )
        return notes
    notes = ["taken as: mm, y positive to the field side and 0 at the tape circle, z up"]
    if not y.min() <= 0.0 <= y.max():
        notes.append(f"the tape circle y = 0 lies outside the line, y = {y.min():.4g} to {y.max():.4g} mm")
    elif abs(at_tape := float(np.interp(0.0, np.maximum.accumulate(y), z))) > 0.1:
        notes.append(
            f"the line passes the tape circle y = 0 at z = {at_tape:.4g} mm, not 0: check the origin of the file"
        )
    return notes


def _noise(points: Floats) -> str:
    """Scatter of the points across the line, from fourth divided differences, and the curvature error it brings."""
    chord = np.hypot(*np.diff(points, axis=0).T)
    s = np.concatenate(([0.0], np.cumsum(chord)))
    windows = np.lib.stride_tricks.sliding_window_view(s, 5)
    gaps = windows[:, :, None] - windows[:, None, :] + np.eye(5)
    weights = 1.0 / gaps.prod(axis=2)
    values = np.lib.stride_tricks.sliding_window_view(points, 5, axis=0)
    fourth = np.einsum("ndk,nk->nd", values, weights)
    # the median keeps corners and junctions out; 0.6745 turns it into a standard deviation
    scatter = float(np.median(np.hypot(*fourth.T) / np.sqrt((weights**2).sum(axis=1)))) / 0.6745
    spacing = float(np.median(chord))
    noise = SPLINE_NOISE * scatter / spacing**2
    return (
        f"{len(points)} points about {spacing:.2g} mm apart, scatter about {scatter:.1g} mm: "
        f"curvature uncertain by about {noise:.1g} /mm (a radius of 300 mm has {1 / 300:.1g} /mm)"
    )


def _piece(points: Floats) -> Segment:
    if len(points) == 2:
        return Line(start=(float(points[0, 0]), float(points[0, 1])), end=(float(points[1, 0]), float(points[1, 1])))
    return Spline(points=points)
