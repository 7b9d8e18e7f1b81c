"""Profiles from measured or tabulated points.

A file that looks wrong is refused with the remedy rather than repaired in silence: half of all trouble with profiles is
a unit, a sign or an order. What had to be assumed is written into the notes of the profile.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.axes import check_shape, origin_notes
from fecontact.profiles.curve import FARTHEST_MM, Kind, Profile
from fecontact.profiles.measured import Measured
from fecontact.profiles.noise import noise_of
from fecontact.profiles.problems import Problem, crossings, out_of_order, turning_angles
from fecontact.profiles.reading import remedy
from fecontact.profiles.segments import Floats, Integers, Line, Segment, Spline
from fecontact.profiles.spikes import spikes, unclear

# Angle between neighbouring chords that is a corner of the body and not a coarsely sampled fillet (rad, 20 degrees).
SPLIT_RAD = 0.35
# Root mean square of the curvature of a cubic spline through independent errors e at spacing h, in e / h^2: the
# transfer function 12 (1 - cos w) / (4 + 2 cos w) of the spline averaged over all waves.
SPLINE_NOISE = 6.0
FEWEST_POINTS = 10
# The largest part of the points that a repair may leave out.
_MOST_LEFT_OUT = 0.05
_MOST_POINTS = 10_000
# A kink turns by so much, and by so many times as much as the points beside it.
_KINK_RAD, _KINK_TIMES = 0.01, 8.0
# Points nearer than this are one: far below any instrument, and far above what arithmetic loses in some 100 mm.
_SAME_MM = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Points:
    """Points along a running surface, before a line is made of them.

    Attributes
    ----------
    points (n, 2)
        y and z in mm, in the order along the line.
    kind, name, source
        Of the profile that is made of them.
    notes, problems
        What was assumed; points that were left out, and doubtful ones.
    """

    points: Floats
    kind: Kind
    name: str
    source: str = ""
    notes: tuple[str, ...] = ()
    problems: tuple[Problem, ...] = ()


def checked(given: Points, *, repair: bool = False) -> Points:
    """Points of a running surface in the axes of the library, from small to large y; `repair` leaves wrong ones out.

    Raises
    ------
    InputError
        The points do not look like a running surface.
    """
    points, said, name = given.points, list(given.notes), given.name
    # also false for NaN
    bad = np.flatnonzero(~(np.abs(points) <= FARTHEST_MM).all(axis=1))
    if bad.size:
        raise InputError(
            f"{name}: point {bad[0] + 1} is {_at(points[bad[0]])}; allowed: -{FARTHEST_MM:g} to {FARTHEST_MM:g} mm; "
            "remove it, or move the origin to the crown of the rail or the tape circle of the wheel"
        )

    points, repeated = _different(points)
    if repeated:
        said.append(f"{counted(repeated, 'repeated point')} dropped")
    if not FEWEST_POINTS <= len(points) <= _MOST_POINTS:
        raise InputError(
            f"{name}: there are {counted(len(points), 'different point')}; at least {FEWEST_POINTS} are needed, "
            f"{_MOST_POINTS} are allowed, better one every 0.1 to 0.5 mm"
        )
    if points[-1, 0] < points[0, 0]:
        points = points[::-1]
        said.append("the points ran towards small y: their order was reversed")

    # a line that turns back has no shape to speak of
    points, problems, repaired = _without_wrong_ones(points, given, repair=repair)
    check_shape(points[:, 0], points[:, 1], kind=given.kind, what=name)
    said += [*repaired, *_check_spacing(points, name), *_assumptions(points, given.kind), *_kinks(points)]
    return replace(given, points=points, notes=tuple(said), problems=problems)


def spline_through(given: Points) -> Profile:
    """Cubic splines through points that were checked, between their corners."""
    points, corners, said = given.points, _corners(given.points), []
    if corners.size:
        where = ", ".join(f"{points[i, 0]:.2f}" for i in corners[:6]) + (" ..." if corners.size > 6 else "")
        said.append(f"split at {counted(corners.size, 'corner')}: y = {where} mm")
    said.append(_noise(points))
    pieces = np.split(np.arange(len(points)), corners)
    return profile_of(given, tuple(_piece(points[piece[0] : piece[-1] + 2]) for piece in pieces), said)


def profile_of(
    given: Points, segments: tuple[Segment, ...], said: Sequence[str], measured: Measured | None = None
) -> Profile:
    """The profile of a line that was made of points, with what is said of it."""
    return Profile(
        name=given.name,
        kind=given.kind,
        segments=segments,
        source=given.source,
        notes=(*given.notes, *said),
        measured=measured,
        points=given.points,
        problems=given.problems,
    )


def _corners(points: Floats) -> Integers:
    return np.flatnonzero(np.abs(turning_angles(points)) > SPLIT_RAD) + 1


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


def _different(points: Floats) -> tuple[Floats, int]:
    """Points (n, 2) without those that repeat the one before, and how many those are."""
    same = np.concatenate(([False], np.hypot(*np.diff(points, axis=0).T) < _SAME_MM))
    return points[~same], int(same.sum())


def _without_wrong_ones(
    points: Floats, given: Points, *, repair: bool
) -> tuple[Floats, tuple[Problem, ...], list[str]]:
    """The points without those that are wrong, where leaving out is asked for; those, and what is to be said."""
    left_out: list[Problem] = []
    for find in (out_of_order, spikes, crossings):
        while problems := find(points):
            if not repair or len(left_out) + len(problems) > _MOST_LEFT_OUT * len(points):
                raise InputError(_refusal(problems, given.kind, given.name, repair=repair))
            # points out of order are found once more from their new neighbours
            gone = problems if find is spikes else problems[:1]
            left_out += gone
            # what stood between two equal points may be gone
            points, _ = _different(np.delete(points, [problem.index for problem in gone], axis=0))
    said = _listed([problem.text for problem in left_out])
    notes = [f"{counted(len(left_out), 'point')} left out: {said}"] if left_out else []
    if doubtful := unclear(points):
        notes.append(
            f"{_listed([problem.text for problem in doubtful])}: wrong, or at two junctions close to one another; a"
            " spline bends there"
        )
    back = np.diff(points[:, 0]) <= 0.0
    if back.any():
        notes.append(f"the line is vertical or overhangs at {counted(int(back.sum()), 'point')}: kept as a steep side")
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


def counted(number: int, noun: str) -> str:
    """A number of things in words."""
    return f"{number} {noun}" + ("" if number == 1 else "s")


def _listed(texts: list[str]) -> str:
    return "; ".join(texts[:4]) + (f" and {len(texts) - 4} more" if len(texts) > 4 else "")


def _at(point: Floats) -> str:
    return f"({point[0]:.4g}, {point[1]:.4g}) mm"


def _check_spacing(points: Floats, name: str) -> list[str]:
    chord = np.hypot(*np.diff(points, axis=0).T)
    # a face between two corners needs only its ends
    is_end = np.ones(len(points), dtype=bool)
    is_end[1:-1] = False
    is_end[_corners(points)] = True
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
