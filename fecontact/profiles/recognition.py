"""Recognition of the library profile that measured points belong to, and the profile smoothed through them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.profiles.curve import Kind, Profile
from fecontact.profiles.library import find, load, names
from fecontact.profiles.point_noise import noise_of
from fecontact.profiles.points import (
    LARGEST_FIELD_SIDE_DROP_MM,
    Points,
    build_profile,
    checked,
    drop_close_points,
    fit_splines,
    format_count,
    is_exact,
    measure_field_side_drop_mm,
    spacing_mm,
)
from fecontact.profiles.reading import Reading, suggest_mirroring, suggest_unmirrored
from fecontact.profiles.registration import LEAST_NOISE_MM, FootPoints, Lines, first_shift, register_all, select_unworn
from fecontact.profiles.segments import Held, Measured, Registration
from fecontact.profiles.smoothing import (
    FIRST_LOOK_POINTS,
    PRACTICE_MM,
    SECOND_LOOK_PROFILES,
    frame_on_chords,
    frame_on_reference,
    select_running_part,
    smooth_frame,
)
from fecontact.profiles.variants import make_segments

# Steps of that: from 50 mrad and some mm off the true one of all rails is nearest after four.
_FIRST_STEPS = 6
# Digits (of mm) of how near profiles are.
_RANKING_DIGITS = 9
# A profile that the points are usually farther off is another one.
_LARGEST_DISTANCE_MM = 2.0
# One that they are farther off anywhere is not theirs for certain; nor is one that they are off by more than this, if
# their deviation has shorter waves than they have themselves.
_LARGEST_WEAR_MM, _UNWORN_MM = 3.0, 0.3
# Nor is one that most points are off: where all that runs is worn, another profile of the same kind fits as well.
_LARGEST_TYPICAL_WEAR_MM = 0.5
# A profile that so many of the points lie on is theirs, and none that fewer lie on by more than the other part: under
# 3 mm of wear the next one is as near to all of them, and what is off it as smooth.
_UNWORN_SHARE, _UNWORN_SHARE_MARGIN = 0.65, 0.1
# A head is worn and canted to the gauge side. One that leans outwards by more, is so much lower beside its field side
# or has lost so much more there is mirrored, unless it has lost as much more on its gauge side. A new one canted by
# 1:40 is lower by 1.1 mm; the worn ones of 0.5 mm and more lean by 6 mrad and more.
_OUTWARDS_RAD, _SIDE_LOSS_MM = 0.005, 0.5
# What a side has lost, nine tenths of its points have at most: from so far beside the middle, down to as deep below the
# top (mm) as both sides are measured, and that is nothing where one of them ends sooner.
_SIDE_START_MM, _SIDE_DEPTH_MM, _LEAST_SIDE_DEPTH_MM, _SIDE_QUANTILE = 6.0, 14.0, 4.0, 0.9
# Cants of rails (1:n), and how near to one a turn (as a part of it) makes one ask for it.
_USUAL_CANT, _CANT_TOLERANCE = (20, 30, 40), 0.12
# Points closer than this part of the usual spacing tell nothing about the line between them.
_CLOSEST_OVER_SPACING = 0.2


@dataclass(frozen=True, kw_only=True)
class Nearest:
    """A profile of the library beside measured points.

    Attributes
    ----------
    usual_mm, farthest_mm
        How far the points lie off it, usually (as a standard deviation) and at most.
    at_y_mm
        Where that is the most.
    unworn
        The part of the points that lie on it beside their wear.
    lost_on_field_side_mm
        How much more of its field side than of its gauge side they have lost; None where one of them is not measured.
    """

    name: str
    registration: Registration
    usual_mm: float
    farthest_mm: float
    at_y_mm: float
    unworn: float
    lost_on_field_side_mm: float | None


def nearest(points: Floats, kind: Kind, among: tuple[str, ...] | None = None) -> list[Nearest]:
    """Profiles of the library that points (n, 2) may be, the nearest first."""
    known, noise = names(kind) if among is None else among, max(noise_of(points), LEAST_NOISE_MM)
    first = _select_candidates(points[:: max(1, len(points) // FIRST_LOOK_POINTS)], known, noise)
    if not first:
        return []
    lines = Lines.of(*map(load, first))
    registrations, usual, over = register_all(lines, points, list(first.values()))
    beside, unworn = select_unworn(lines, points, registrations, noise)
    found = []
    for number, name in enumerate(first):
        if usual[number] > _LARGEST_DISTANCE_MM:
            continue
        feet = over.of(number)
        off = np.where(feet.inside, np.abs(feet.off_mm), 0.0)
        at = int(np.argmax(off))
        is_beside = unworn[number] > _UNWORN_SHARE
        found.append(
            Nearest(
                name=name,
                registration=registrations[number],
                usual_mm=usual[number],
                farthest_mm=float(off[at]),
                at_y_mm=float(points[at, 0]),
                unworn=unworn[number],
                lost_on_field_side_mm=_lost_on_field_side_mm(beside.of(number) if is_beside else feet),
            )
        )
    most = max((one.unworn for one in found), default=0.0)
    if most > _UNWORN_SHARE:
        found = [one for one in found if one.unworn > most - _UNWORN_SHARE_MARGIN]
    return sorted(found, key=lambda one: (round(one.usual_mm, _RANKING_DIGITS), known.index(one.name)))


def _select_candidates(few: Floats, known: Sequence[str], noise_mm: float) -> dict[str, Registration]:
    """Profiles that get a second look, the nearest first, and where they lie on few points (n, 2)."""
    profiles = [load(name) for name in known]
    begin = [Registration(shift=first_shift(one, few)) for one in profiles]
    registrations, usual, _ = register_all(Lines.of(*profiles), few, begin, steps=_FIRST_STEPS)
    lies, off = dict(zip(known, registrations, strict=True)), dict(zip(known, usual, strict=True))
    close = [name for name in known if len(known) <= SECOND_LOOK_PROFILES or off[name] < 2.0 * _LARGEST_DISTANCE_MM]
    # two drawings of one profile are as near, but for rounding: their order is that of the library
    close.sort(key=lambda name: round(off[name], _RANKING_DIGITS))
    chosen, others = close[:SECOND_LOOK_PROFILES], close[SECOND_LOOK_PROFILES:]
    if others:
        # deep wear pulls a profile far off its points, and others nearer
        _, parts = select_unworn(Lines.of(*map(load, others)), few, [lies[name] for name in others], noise_mm)
        chosen += [name for name, part in zip(others, parts, strict=True) if part > _UNWORN_SHARE]
    return {name: lies[name] for name in chosen}


def _lost_on_field_side_mm(feet: FootPoints) -> float | None:
    """How much more points have lost of the field side of a head than of its gauge side; None without both sides."""
    y, z = feet.points.T
    sides = [feet.inside & (side * y > _SIDE_START_MM) for side in (-1.0, 1.0)]
    level = max(-_SIDE_DEPTH_MM, *(float(z[side].min(initial=0.0)) for side in sides))
    if level > -_LEAST_SIDE_DEPTH_MM:
        return None
    gauge, field = (np.quantile(-feet.off_mm[side & (z >= level)], _SIDE_QUANTILE) for side in sides)
    return float(field - gauge)


def _check_mirroring(given: Points, reading: Reading, close: Sequence[Nearest] = ()) -> list[str]:
    """What is to be said of a head that is canted or worn to the field side, once it is said whether it is mirrored.

    Raises
    ------
    InputError
        Nothing is said about it; with the options that settle it.
    """
    if given.kind == "wheel":
        return []
    lower = measure_field_side_drop_mm(given.points) or 0.0
    near = next((one for one in close if one.lost_on_field_side_mm is not None or one.farthest_mm < _UNWORN_MM), None)
    turn, lost = (near.registration.turn_rad, near.lost_on_field_side_mm or 0.0) if near else (0.0, 0.0)
    if lost > _SIDE_LOSS_MM or (
        lost > -_SIDE_LOSS_MM and (turn < -_OUTWARDS_RAD or lower > LARGEST_FIELD_SIDE_DROP_MM)
    ):
        found = [f"the head is {lower:.1f} mm lower on its field side than on its gauge side"] * (lower > 0.0)
        found += [f"{near.name} lies on it turned by {1e3 * turn:+.1f} mrad"] if near else []
        found += [f"its field side has lost {lost:.1f} mm more than its gauge side"] * (lost > _SIDE_LOSS_MM)
        said = f"{', and '.join(found)}: it may be worn or canted and mirrored"
        if reading.mirror is None:
            raise InputError(
                f"{given.name}: {said}; a head wears and is canted to its gauge side, y < 0;"
                f" {suggest_mirroring(given.kind, mirrored=False)} if it is mirrored, or "
                f"{suggest_unmirrored(given.kind)} if it"
                " is not"
            )
        return [f"{said}; {suggest_mirroring(given.kind, mirrored=True)} if it is" if reading.mirror else said]
    return []


def line_through(given: Points, reading: Reading) -> Profile:
    """The line through points that are checked here: smoothed, or splines where they have no noise or are to be exact.

    Raises
    ------
    InputError
        The points do not look like a running surface; or the nominal profile that is asked for is not in the library,
        or they do not lie over it.
    """
    given = checked(given, reading)
    if reading.filter_mm == 0.0 or len(given.points) < 20:
        return fit_splines(replace(given, notes=(*given.notes, *_check_mirroring(given, reading))))
    points = drop_close_points(given.points, _CLOSEST_OVER_SPACING * spacing_mm(given.points))
    asked = reading.filter_mm is not None or reading.noise_mm is not None or reading.nominal not in ("auto", "none")
    if not asked and is_exact(points):
        return fit_splines(replace(given, notes=(*given.notes, *_check_mirroring(given, reading))))
    named = reading.nominal not in ("auto", "none")
    close = nearest(points, given.kind, (find(reading.nominal, given.kind),) if named else None)
    measured = _smooth_points(replace(given, points=points), reading, close)
    crowded = len(given.points) - len(points)
    said = [*_check_mirroring(given, reading, close), *_describe_omissions(given, measured, crowded)]
    said += [_describe_smoothing(measured, reading), *_choices(measured, given.kind)]
    return build_profile(given, make_segments(measured), said, measured)


def _smooth_points(given: Points, reading: Reading, near: Sequence[Nearest]) -> Measured:
    """Points as a smoothed deviation from a profile of the library that is theirs for certain, or by themselves."""
    smooth = partial(smooth_frame, filter_mm=reading.filter_mm, noise_mm=reading.noise_mm)
    by_itself = smooth(frame_on_chords(given.points))
    if reading.nominal == "none":
        return by_itself[0]
    if reading.nominal != "auto":
        named = [_smooth_deviation(one, given.points, smooth) for one in near]
        if not named or named[0] is None:
            raise InputError(
                f"{given.name}: the points do not lie over {reading.nominal} within {_LARGEST_DISTANCE_MM:g} mm, or "
                "reach"
                " beyond its ends; give another nominal profile, or none"
            )
        return named[0][0]
    close = [one for one in near if one.farthest_mm < _LARGEST_WEAR_MM]
    over = [(one, *made) for one in close if (made := _smooth_deviation(one, given.points, smooth)) is not None]
    certain = [
        (one.usual_mm, made, score)
        for one, made, score in over
        if one.farthest_mm < _UNWORN_MM or made.filter_mm >= _median_running_filter_mm(by_itself[0])
    ]
    lines = [*certain, (0.0, *by_itself)]
    best = min(score for *_, score in lines)
    # the first one of those that are as good
    usual, measured = next((usual, made) for usual, made, score in lines if score <= best * (1.0 + 1e-9))
    return measured if usual < _LARGEST_TYPICAL_WEAR_MM else by_itself[0]


def _median_running_filter_mm(line: Measured) -> float:
    """The filter length that half of the running part of a line has at most."""
    relative = line.held.relative_filter
    return line.filter_mm * (1.0 if relative is None else float(np.median(relative[select_running_part(line.held)])))


def _smooth_deviation(
    one: Nearest, points: Floats, smooth: Callable[[Held], tuple[Measured, float]]
) -> tuple[Measured, float] | None:
    """Points smoothed as their deviation from a profile; None where they do not lie over it."""
    held = frame_on_reference(load(one.name), one.registration, points)
    try:
        return None if held is None else smooth(held)
    except np.linalg.LinAlgError:
        return None


def _choices(made: Measured, kind: Kind) -> list[str]:
    """What is taken for granted of points that are held against a profile of the library, and how to take it back."""
    if not made.nominal:
        return []
    said = []
    if load(made.nominal).junctions:
        said.append(
            f"where the curvature of {made.nominal} jumps, the curvature of the {kind} is taken to jump too:"
            f" --{kind}-nominal none takes the points alone"
        )
    turn_rad = made.held.registration.turn_rad
    near = [one for one in _USUAL_CANT if abs(abs(turn_rad) * one - 1.0) < _CANT_TOLERANCE]
    if kind == "rail" and near:
        said.append(
            f"{made.nominal} lies on the points turned by {1e3 * turn_rad:+.1f} mrad, near 1:{near[0]}:"
            f" is the rail canted in the file already? Then give --inclination none"
        )
    return said


def _describe_omissions(given: Points, made: Measured, crowded: int) -> list[str]:
    """How many points tell the line nothing, and why."""
    beside = len(given.points) - crowded - len(made.points)
    said = [f"{crowded} that nearly repeat the one before"] * (crowded > 0)
    said += [f"{beside} beyond the ends of {made.nominal}"] * (beside > 0)
    return [f"of {format_count(len(given.points), 'point')} left out: {', '.join(said)}"] if said else []


def _describe_smoothing(made: Measured, reading: Reading) -> str:
    # across the line: along it they have only been slid to where they come from
    largest = float(np.abs((made.held.values * made.held.normals).sum(axis=1)).max())
    of = f"its deviation from {made.nominal} (at most {largest:.2g} mm across it)" if made.nominal else "the line"
    how = "as given" if reading.filter_mm is not None else "from the scatter of the points"
    if not made.nominal and reading.filter_mm is None and made.filter_mm == PRACTICE_MM[0]:
        how = "the least that is usual"
    if made.held.relative_filter is not None:
        how = f"from the noise of the points; {PRACTICE_MM[0]:g} mm and more where the line bends"
    middle = float(np.median(made.curvature_noise_per_mm))
    return (
        f"smoothed from {len(made.points)} points that scatter by {1e3 * made.noise_mm:.2g} um: {of}, over waves of"
        f" {made.filter_mm:.3g} mm ({how}); curvature uncertain by {middle:.1g} /mm from that"
    )
