"""Profiles from measured or tabulated points: text files of columns, y and z.

A file that looks wrong is refused with the remedy rather than repaired in silence: half of all trouble with profiles is
a unit, a sign or an order. What had to be assumed is written into the notes of the profile.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.curve import FARTHEST_MM, Kind, Profile
from fecontact.profiles.noise import noise_of
from fecontact.profiles.problems import Problem, crossings, out_of_order, turning_angles
from fecontact.profiles.readers.table import FEWEST_POINTS, columns_of, in_mm, read_text
from fecontact.profiles.reading import PLAIN, Reading, remedy
from fecontact.profiles.segments import Floats, Integers, Line, Segment, Spline
from fecontact.profiles.spikes import spikes, unclear

SPAN_RANGE_MM = (10.0, 500.0)
# Angle between neighbouring chords that is a corner of the body and not a coarsely sampled fillet (rad, 20 degrees).
SPLIT_RAD = 0.35
# Root mean square of the curvature of a cubic spline through independent errors e at spacing h, in e / h^2: the
# transfer function 12 (1 - cos w) / (4 + 2 cos w) of the spline averaged over all waves.
SPLINE_NOISE = 6.0
# The largest part of the points that a repair may leave out.
_MOST_LEFT_OUT = 0.05
_MOST_POINTS = 10_000
# A kink turns by so much, and by so many times as much as the points beside it.
_KINK_RAD, _KINK_TIMES = 0.01, 8.0
# Points nearer than this are one: far below any instrument, and far above what arithmetic loses in some 100 mm.
_SAME_MM = 1e-9
# A rail's head has no dip, and a wheel's rim no drop at its field side, of this depth.
_DIP_MM = 8.0


def read_points(path: str | Path, *, kind: Kind, reading: Reading = PLAIN) -> Profile:
    """Profile from a text file of columns, y and z, interpolated by splines.

    Columns may be separated by blanks, tabs, commas or semicolons; what follows # ! % or // is a comment, and the first
    lines may be a header. The axes are those of the library: y positive to the field side, z up; a rail has its crown
    and a wheel its tape circle at (0, 0). `reading` says what is otherwise.

    Raises
    ------
    InputError
        The file cannot be read, or its points do not look like a running surface in these axes.
    """
    path = Path(path)
    table = columns_of(read_text(path), kind=kind, what=str(path), reading=reading)
    y, z, notes = in_mm(table.y, table.z, table.unit, reading)
    return profile_from_points(
        y, z, kind=kind, name=path.stem, source=str(path), reading=reading, notes=(*table.notes, *notes)
    )


def profile_from_points(
    y: Floats,
    z: Floats,
    *,
    kind: Kind,
    name: str,
    source: str = "",
    reading: Reading = PLAIN,
    notes: tuple[str, ...] = (),
) -> Profile:
    """Profile through points (mm, shape (n,)) in the order along the line, with cubic splines between corners.

    Raises
    ------
    InputError
        The points do not look like a running surface; see `read_points`.
    """
    points, said = np.column_stack((y, z)).astype(float), list(notes)
    # also false for NaN
    bad = np.flatnonzero(~(np.abs(points) <= FARTHEST_MM).all(axis=1))
    if bad.size:
        raise InputError(
            f"{name}: point {bad[0] + 1} is {_at(points[bad[0]])}; allowed: -{FARTHEST_MM:g} to {FARTHEST_MM:g} mm; "
            "remove it, or move the origin to the crown of the rail or the tape circle of the wheel"
        )

    same = np.concatenate(([False], np.hypot(*np.diff(points, axis=0).T) < _SAME_MM))
    if same.any():
        points = points[~same]
        said.append(f"{_count(int(same.sum()), 'repeated point')} dropped")
    if not FEWEST_POINTS <= len(points) <= _MOST_POINTS:
        raise InputError(
            f"{name}: there are {_count(len(points), 'different point')}; at least {FEWEST_POINTS} are needed, "
            f"{_MOST_POINTS} are allowed, better one every 0.1 to 0.5 mm"
        )
    if points[-1, 0] < points[0, 0]:
        points = points[::-1]
        said.append("the points ran towards small y: their order was reversed")

    # a line that turns back has no shape to speak of
    points, problems, repaired = _checked(points, kind, name, repair=reading.repair)
    check_shape(points[:, 0], points[:, 1], kind=kind, what=name)
    said += repaired
    corners = np.flatnonzero(np.abs(turning_angles(points)) > SPLIT_RAD) + 1
    said += _check_spacing(points, corners, name)
    said += _assumptions(points, kind)
    if corners.size:
        where = ", ".join(f"{points[i, 0]:.2f}" for i in corners[:6]) + (" ..." if corners.size > 6 else "")
        said.append(f"split at {_count(corners.size, 'corner')}: y = {where} mm")
    said += _kinks(points)
    said.append(_noise(points))
    pieces = np.split(np.arange(len(points)), corners)
    segments = [_piece(points[piece[0] : piece[-1] + 2]) for piece in pieces]
    return Profile(name=name, kind=kind, segments=tuple(segments), source=source, notes=tuple(said), problems=problems)


def _kinks(points: Floats) -> list[str]:
    """Where a line turns, within two points, that does not turn beside them: no junction does so, a lost sign does."""
    turning = turning_angles(points)
    if turning.size < 6:
        return []
    both = np.abs(turning[2:-3] + turning[3:-2])
    beside = np.max(np.abs([turning[:-5], turning[1:-4], turning[4:-1], turning[5:]]), axis=0)
    found = np.flatnonzero((both > _KINK_RAD) & (both < SPLIT_RAD) & (both > _KINK_TIMES * beside)) + 2
    # the sharper one of both, and each once
    places = dict.fromkeys(int(i) + int(abs(turning[i + 1]) > abs(turning[i])) for i in found)
    return [f"a kink at {_at(points[i + 1])}: a corner of the body, or a wrong sign" for i in places]


def _checked(points: Floats, kind: Kind, name: str, *, repair: bool) -> tuple[Floats, tuple[Problem, ...], list[str]]:
    """The points without those that are wrong, where leaving out is asked for; those, and what is to be said."""
    left_out: list[Problem] = []
    for find in (out_of_order, spikes, crossings):
        while problems := find(points):
            if not repair or len(left_out) + len(problems) > _MOST_LEFT_OUT * len(points):
                raise InputError(_refusal(problems, kind, name, repair=repair))
            # points out of order are found once more from their new neighbours
            gone = problems if find is spikes else problems[:1]
            left_out += gone
            points = np.delete(points, [problem.index for problem in gone], axis=0)
    said = _listed([problem.text for problem in left_out])
    notes = [f"{_count(len(left_out), 'point')} left out: {said}"] if left_out else []
    if doubtful := unclear(points):
        notes.append(
            f"{_listed([problem.text for problem in doubtful])}: wrong, or at two junctions close to one another; a"
            " spline bends there"
        )
    back = np.diff(points[:, 0]) <= 0.0
    if back.any():
        notes.append(f"the line is vertical or overhangs at {_count(int(back.sum()), 'point')}: kept as a steep side")
    return points, (*left_out, *doubtful), notes


def _refusal(problems: list[Problem], kind: Kind, name: str, *, repair: bool) -> str:
    said = _listed([problem.text for problem in problems])
    if repair:
        return f"{name}: {said}; that is more than {100 * _MOST_LEFT_OUT:g} % of the points; measure the profile again"
    if problems[0].what == "spike":
        return f"{name}: {said}; correct the file, or {remedy(kind, 'repair', 'yes')} to leave such points out"
    return (
        f"{name}: {said}; give the points of the running surface in their order along the line, once, without the"
        f" inside of the body; or {remedy(kind, 'repair', 'yes')} to leave single points out"
    )


def _listed(texts: list[str]) -> str:
    return "; ".join(texts[:4]) + (f" and {len(texts) - 4} more" if len(texts) > 4 else "")


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


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def _deepest_dip(z: Floats) -> tuple[float, int]:
    """How far a line lies below higher points on both of its sides at most, and where."""
    depth = np.minimum(np.maximum.accumulate(z), np.maximum.accumulate(z[::-1])[::-1]) - z
    at = int(np.argmax(depth))
    return float(depth[at]), at


def _at(point: Floats) -> str:
    return f"({point[0]:.4g}, {point[1]:.4g}) mm"


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
    across = "y positive to the field side" + (" and 0 at the tape circle" if kind == "wheel" else "")
    canted = ", not canted" if kind == "rail" else ""
    return [f"taken as: mm, {across}, z up{canted}", *origin_notes(points, kind)]


def origin_notes(points: Floats, kind: Kind) -> list[str]:
    """What is to be said of points (n, 2) whose origin is not a rail's crown or a wheel's tape circle."""
    y, z = points.T
    if kind == "rail":
        top = points[z.argmax()]
        if abs(top[0]) > 1.0 or abs(top[1]) > 0.1:
            return [
                f"the highest point is {_at(top)}, not the origin: the rail may be canted already, worn, or have "
                "another origin; it is used as it is"
            ]
        return []
    if not y.min() <= 0.0 <= y.max():
        return [f"the tape circle y = 0 lies outside the line, y = {y.min():.4g} to {y.max():.4g} mm"]
    if abs(at_tape := float(np.interp(0.0, np.maximum.accumulate(y), z))) > 0.1:
        return [f"the line passes the tape circle y = 0 at z = {at_tape:.4g} mm, not 0: check the origin of the file"]
    return []


def _noise(points: Floats) -> str:
    """Scatter of the points across the line, and the curvature error that a spline through them has from it."""
    scatter = noise_of(points)
    spacing = float(np.median(np.hypot(*np.diff(points, axis=0).T)))
    noise = SPLINE_NOISE * scatter / spacing**2
    return (
        f"{len(points)} points about {spacing:.2g} mm apart, scatter about {scatter:.1g} mm: "
        f"curvature uncertain by about {noise:.1g} /mm (a radius of 300 mm has {1 / 300:.1g} /mm)"
    )


def _piece(points: Floats) -> Segment:
    if len(points) == 2:
        return Line(start=(float(points[0, 0]), float(points[0, 1])), end=(float(points[1, 0]), float(points[1, 1])))
    return Spline(points=points)
