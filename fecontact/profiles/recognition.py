"""Recognition of the library profile of measured points, and the smoothed profile."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.inputs.texts import count_text
from fecontact.profiles.curve import Profile, ProfileKind
from fecontact.profiles.library import find_library_name, list_reference_names, load_library_profile
from fecontact.profiles.nominal_choice import choose_nominal, is_nominal_supported
from fecontact.profiles.point_noise import estimate_noise_mm
from fecontact.profiles.points import (
    LARGEST_FIELD_SIDE_DROP_MM,
    ProfilePoints,
    build_profile,
    check_points,
    drop_close_points,
    fit_splines,
    is_exact,
    measure_field_side_drop_mm,
    measure_spacing_mm,
)
from fecontact.profiles.reading import Reading, suggest_mirroring, suggest_unmirrored
from fecontact.profiles.registration import (
    LEAST_NOISE_MM,
    FootPoints,
    ProfileChain,
    estimate_shift,
    register_all,
    select_unworn,
)
from fecontact.profiles.segments import Registration, SmoothingFrame, SmoothingResult
from fecontact.profiles.smoothing import (
    FIRST_LOOK_POINTS,
    PRACTICE_MIDDLE_MM,
    PRACTICE_MM,
    SECOND_LOOK_PROFILES,
    frame_on_chords,
    frame_on_reference,
    select_running_part,
    smooth_frame,
)
from fecontact.profiles.suspicions import SuspiciousProfileError
from fecontact.profiles.variants import make_segments

# Registration steps of the first look: from 50 mrad and some mm, the correct rail is the nearest of all after four.
_FIRST_STEPS = 6
# Digits (of mm) of the distances by which profiles are ranked.
_RANKING_DIGITS = 9
# Largest usual distance of points from their profile.
_LARGEST_DISTANCE_MM = 2.0
# A profile is uncertain if a point is farther off than the first distance. It is also uncertain if a point is farther
# off than the second distance and the deviation of the points has shorter waves than the points.
_LARGEST_WEAR_MM, _UNWORN_MM = 3.0, 0.3
# A profile is uncertain too if most points are off it: where the whole running surface is worn, a different profile of
# an equal kind fits equally well.
_LARGEST_TYPICAL_WEAR_MM = 0.5
# The points belong to a profile if this share of them is on it. Profiles with a smaller share, by more than the margin,
# are excluded: under 3 mm of wear the next profile is equally near to all points, and its deviation equally smooth.
_UNWORN_SHARE, _UNWORN_SHARE_MARGIN = 0.65, 0.1
# A head is worn and canted to the gauge side. It may be mirrored if it leans outwards by more, is much lower near its
# field side or has lost more material there, unless it has lost an equal surplus on its gauge side. A new head that is
# canted by 1:40 is lower by 1.1 mm. Worn heads with at least 0.5 mm lean by at least 6 mrad.
_OUTWARDS_RAD, _SIDE_LOSS_MM = 0.005, 0.5
# The loss of a side is the 0.9 quantile of its points. They are beyond this distance from the middle, and down to the
# depth below the top (mm) to which both sides are measured. The loss is undefined if a side ends above the least depth.
_SIDE_START_MM, _SIDE_DEPTH_MM, _LEAST_SIDE_DEPTH_MM, _SIDE_QUANTILE = 6.0, 14.0, 4.0, 0.9
# Cants of rails (1:n), and the relative difference between a turn and a cant at which the user is asked.
_USUAL_CANT, _CANT_TOLERANCE = (20, 30, 40), 0.12
# Points that are closer than this fraction of the usual spacing have no information about the profile between them.
_CLOSEST_OVER_SPACING = 0.2


@dataclass(frozen=True, kw_only=True)
class ProfileMatch:
    """Profile of the library that measured points may belong to.

    Attributes
    ----------
    name
        Name of the profile.
    registration
        Rigid displacement of the profile onto the points.
    usual_mm, farthest_mm
        Usual distance of the points from the profile (as a standard deviation), and the largest distance.
    at_y_mm
        Lateral position of the largest distance.
    unworn
        Share of the points that are on the profile outside their wear.
    lost_on_field_side_mm
        Loss of material on the field side minus the loss on the gauge side; None if a side is not measured.
    """

    name: str
    registration: Registration
    usual_mm: float
    farthest_mm: float
    at_y_mm: float
    unworn: float
    lost_on_field_side_mm: float | None


def find_nearest_profiles(
    points: Floats, kind: ProfileKind, among: tuple[str, ...] | None = None
) -> list[ProfileMatch]:
    """Profiles of the library that points may belong to, the nearest first.

    Parameters
    ----------
    points
        Points (n, 2) in mm.
    kind
        `rail` or `wheel`.
    among
        Names of profiles; None for all profiles of the kind that points can be distinguished by.

    Returns
    -------
    list of ProfileMatch
        Profiles with a usual distance of at most 2 mm.
    """
    library_names = list_reference_names(kind) if among is None else among
    noise = max(estimate_noise_mm(points), LEAST_NOISE_MM)
    starts = _select_candidates(points[:: max(1, len(points) // FIRST_LOOK_POINTS)], library_names, noise)
    if not starts:
        return []
    lines = ProfileChain.of(*map(load_library_profile, starts))
    registrations, usual, all_feet = register_all(lines, points, list(starts.values()))
    unworn_feet, unworn = select_unworn(lines, points, registrations, noise)
    matches = []
    for number, name in enumerate(starts):
        if usual[number] > _LARGEST_DISTANCE_MM:
            continue
        feet = all_feet.of(number)
        distances = np.where(feet.inside, np.abs(feet.off_mm), 0.0)
        farthest_index = int(np.argmax(distances))
        has_unworn_feet = unworn[number] > _UNWORN_SHARE
        matches.append(
            ProfileMatch(
                name=name,
                registration=registrations[number],
                usual_mm=usual[number],
                farthest_mm=float(distances[farthest_index]),
                at_y_mm=float(points[farthest_index, 0]),
                unworn=unworn[number],
                lost_on_field_side_mm=_measure_field_side_loss_mm(unworn_feet.of(number) if has_unworn_feet else feet),
            )
        )
    largest_share = max((match.unworn for match in matches), default=0.0)
    if largest_share > _UNWORN_SHARE:
        # little wear may make a rail more similar to a drawing with a slightly different head
        matches = [
            match
            for match in matches
            if match.unworn > largest_share - _UNWORN_SHARE_MARGIN or match.farthest_mm < _UNWORN_MM
        ]
    return sorted(matches, key=lambda match: (round(match.usual_mm, _RANKING_DIGITS), library_names.index(match.name)))


def _select_candidates(few_points: Floats, library_names: Sequence[str], noise_mm: float) -> dict[str, Registration]:
    """Select the profiles for the second look, the nearest first, with their registrations.

    Parameters
    ----------
    few_points
        Some of the points (n, 2) in mm.
    library_names
        Names of profiles.
    noise_mm
        Standard deviation of the noise of the points (mm).

    Returns
    -------
    dict of str to Registration
        Registrations on the points.
    """
    profiles = [load_library_profile(name) for name in library_names]
    start = [Registration(shift=estimate_shift(profile, few_points)) for profile in profiles]
    registrations, usual, _ = register_all(ProfileChain.of(*profiles), few_points, start, steps=_FIRST_STEPS)
    registration_by_name, usual_by_name = (
        dict(zip(library_names, registrations, strict=True)),
        dict(zip(library_names, usual, strict=True)),
    )
    close = [
        name
        for name in library_names
        if len(library_names) <= SECOND_LOOK_PROFILES or usual_by_name[name] < 2.0 * _LARGEST_DISTANCE_MM
    ]
    # two drawings of a profile have equal distances except for rounding: they keep the order of the library
    close.sort(key=lambda name: round(usual_by_name[name], _RANKING_DIGITS))
    chosen, other_names = close[:SECOND_LOOK_PROFILES], close[SECOND_LOOK_PROFILES:]
    if other_names:
        # deep wear moves a profile away from its points, and different profiles nearer
        _, shares = select_unworn(
            ProfileChain.of(*map(load_library_profile, other_names)),
            few_points,
            [registration_by_name[name] for name in other_names],
            noise_mm,
        )
        chosen += [name for name, share in zip(other_names, shares, strict=True) if share > _UNWORN_SHARE]
    return {name: registration_by_name[name] for name in chosen}


def _measure_field_side_loss_mm(feet: FootPoints) -> float | None:
    """Loss of a head on its field side minus the loss on its gauge side.

    Parameters
    ----------
    feet
        Foot points (n,) on a rail.

    Returns
    -------
    float or None
        Difference (mm); None if a side is not measured.
    """
    y, z = feet.points.T
    sides = [feet.inside & (side * y > _SIDE_START_MM) for side in (-1.0, 1.0)]
    level = max(-_SIDE_DEPTH_MM, *(float(z[side].min(initial=0.0)) for side in sides))
    if level > -_LEAST_SIDE_DEPTH_MM:
        return None
    losses_mm = [-feet.off_mm[side & (z >= level)] for side in sides]
    # a side whose points are all below the lowest point of the other side
    if not all(side_losses_mm.size for side_losses_mm in losses_mm):
        return None
    gauge, field = (np.quantile(side_losses_mm, _SIDE_QUANTILE) for side_losses_mm in losses_mm)
    return float(field - gauge)


def check_mirroring(file_points: ProfilePoints, reading: Reading, matches: Sequence[ProfileMatch] = ()) -> list[str]:
    """Check whether a head may be mirrored.

    Such a head is canted or worn to the field side.

    Parameters
    ----------
    file_points
        Checked points.
    reading
        Options of the file.
    matches
        Profiles that the points may belong to.

    Returns
    -------
    list of str
        Notes, if the options answer the question.

    Raises
    ------
    SuspiciousProfileError
        The options do not answer the question. The message has the options that do.
    """
    if file_points.kind == "wheel":
        return []
    drop_mm = measure_field_side_drop_mm(file_points.points) or 0.0
    # a wider rail may be nearer to most points, but wear does not reach as deep as its sides
    likely_first = sorted(matches, key=lambda match: match.farthest_mm >= _LARGEST_WEAR_MM)
    best_match = next(
        (match for match in likely_first if match.lost_on_field_side_mm is not None or match.farthest_mm < _UNWORN_MM),
        None,
    )
    turn, lost_mm = (
        (best_match.registration.turn_rad, best_match.lost_on_field_side_mm or 0.0) if best_match else (0.0, 0.0)
    )
    if lost_mm > _SIDE_LOSS_MM or (
        lost_mm > -_SIDE_LOSS_MM and (turn < -_OUTWARDS_RAD or drop_mm > LARGEST_FIELD_SIDE_DROP_MM)
    ):
        observations = [f"the head is {drop_mm:.1f} mm lower on its field side than on its gauge side"] * (
            drop_mm > 0.0
        )
        observations += [f"{best_match.name} fits it with a rotation of {1e3 * turn:+.1f} mrad"] if best_match else []
        observations += [f"its field side is worn {lost_mm:.1f} mm more than its gauge side"] * (
            lost_mm > _SIDE_LOSS_MM
        )
        observation_text = f"{', and '.join(observations)}, so the profile may be mirrored"
        if reading.mirror is None:
            raise SuspiciousProfileError(
                f"{file_points.name}: {observation_text}: wear and cant are on the gauge side, y < 0;"
                f" {suggest_mirroring(file_points.kind, mirrored=False)} if it is mirrored, or "
                f"{suggest_unmirrored(file_points.kind)} if it is not",
                "mirrored",
            )
        return [
            f"{observation_text}; {suggest_mirroring(file_points.kind, mirrored=True)} if it is"
            if reading.mirror
            else observation_text
        ]
    return []


def fit_profile(file_points: ProfilePoints, reading: Reading) -> Profile:
    """Profile through points, which are checked here.

    The points are smoothed. If they have no noise or are declared exact, splines go through them.

    Parameters
    ----------
    file_points
        Points of a file.
    reading
        Options of the file.

    Returns
    -------
    Profile
        Rail or wheel.

    Raises
    ------
    InputError
        The points do not look like a running surface, the requested nominal profile is not in the library, or the
        points are not over it.
    """
    file_points = check_points(file_points, reading)
    if reading.filter_mm == 0.0 or len(file_points.points) < 20:
        return fit_splines(replace(file_points, notes=(*file_points.notes, *check_mirroring(file_points, reading))))
    points = drop_close_points(file_points.points, _CLOSEST_OVER_SPACING * measure_spacing_mm(file_points.points))
    is_requested = (
        reading.filter_mm is not None or reading.noise_mm is not None or reading.nominal not in ("auto", "none")
    )
    if not is_requested and is_exact(points):
        return fit_splines(replace(file_points, notes=(*file_points.notes, *check_mirroring(file_points, reading))))
    is_named = reading.nominal not in ("auto", "none")
    matches = find_nearest_profiles(
        points, file_points.kind, (find_library_name(reading.nominal, file_points.kind),) if is_named else None
    )
    measured, equal_names = _smooth_points(replace(file_points, points=points), reading, matches)
    crowded = len(file_points.points) - len(points)
    remarks = [*check_mirroring(file_points, reading, matches), *_describe_omissions(file_points, measured, crowded)]
    remarks += [_describe_smoothing(measured, reading), *_describe_choices(measured, file_points.kind, equal_names)]
    return build_profile(file_points, make_segments(measured), remarks, measured)


def _smooth_points(
    file_points: ProfilePoints, reading: Reading, matches: Sequence[ProfileMatch]
) -> tuple[SmoothingResult, tuple[str, ...]]:
    """Smooth points, as a deviation from a library profile if it is certain.

    Parameters
    ----------
    file_points
        Checked points.
    reading
        Options of the file.
    matches
        Profiles that the points may belong to, the nearest first.

    Returns
    -------
    measured, equal_names
        Smoothing with the best score, and the profiles that cannot be told apart from its nominal profile.

    Raises
    ------
    InputError
        The points are not over the requested nominal profile.
    """
    smooth = partial(smooth_frame, filter_mm=reading.filter_mm, noise_mm=reading.noise_mm)
    free_smoothing, _ = smooth(frame_on_chords(file_points.points))
    if reading.nominal == "none":
        return free_smoothing, ()
    if reading.nominal != "auto":
        requested = [_smooth_deviation(match, file_points.points, smooth) for match in matches]
        if not requested or requested[0] is None:
            raise InputError(
                f"{file_points.name}: the points deviate from {reading.nominal} by more than {_LARGEST_DISTANCE_MM:g}"
                " mm, or extend beyond its ends; give a different nominal profile, or none"
            )
        return requested[0], ()
    smoothed_matches = [
        (match, smoothing)
        for match in matches
        if match.farthest_mm < _LARGEST_WEAR_MM
        and (smoothing := _smooth_deviation(match, file_points.points, smooth)) is not None
    ]
    certain_candidates = [
        smoothing
        for match, smoothing in smoothed_matches
        if match.farthest_mm < _UNWORN_MM or smoothing.filter_mm >= _median_running_filter_mm(free_smoothing)
    ]
    if not certain_candidates:
        return free_smoothing, ()
    chosen, equal_names = choose_nominal(certain_candidates, reading.noise_mm)
    usual_mm = next(match.usual_mm for match in matches if match.name == chosen.nominal)
    is_certain = usual_mm < _LARGEST_TYPICAL_WEAR_MM and is_nominal_supported(chosen, free_smoothing, reading.noise_mm)
    return (chosen, equal_names) if is_certain else (free_smoothing, ())


def _median_running_filter_mm(measured: SmoothingResult) -> float:
    """Median filter length on the running part of a profile (mm)."""
    relative = measured.held.relative_filter
    return measured.filter_mm * (
        1.0 if relative is None else float(np.median(relative[select_running_part(measured.held)]))
    )


def _smooth_deviation(
    match: ProfileMatch, points: Floats, smooth: Callable[[SmoothingFrame], tuple[SmoothingResult, float]]
) -> SmoothingResult | None:
    """Smooth points as their deviation from a profile.

    Parameters
    ----------
    match
        Profile that the points may belong to.
    points
        Points (n, 2) in mm.
    smooth
        Function that smooths deviations.

    Returns
    -------
    SmoothingResult or None
        Smoothing; None if the points are not over the profile.
    """
    frame = frame_on_reference(load_library_profile(match.name), match.registration, points)
    try:
        return None if frame is None else smooth(frame)[0]
    except np.linalg.LinAlgError:
        return None


def describe_turn(name: str, turn_rad: float) -> str:
    """Rotation with which a profile of the library fits points, in words.

    Parameters
    ----------
    name
        Name of the profile.
    turn_rad
        Rotation in rad, positive to the left.

    Returns
    -------
    str
        Beginning of a sentence.
    """
    return f"{name} fits the points with a rotation of {1e3 * turn_rad:+.1f} mrad"


def _describe_choices(measured: SmoothingResult, kind: ProfileKind, equal_names: Sequence[str]) -> list[str]:
    """Describe assumptions about points with a nominal profile, and the options against them.

    Parameters
    ----------
    measured
        Smoothing.
    kind
        `rail` or `wheel`.
    equal_names
        Profiles that cannot be told apart from the nominal profile.

    Returns
    -------
    list of str
        Notes.
    """
    if not measured.nominal:
        return []
    remarks = []
    if equal_names:
        remarks.append(
            f"the points do not tell {measured.nominal} from {' and '.join(equal_names)}: {measured.nominal} is used;"
            f" --{kind}-nominal {equal_names[0]} uses the other profile"
        )
    if load_library_profile(measured.nominal).junctions:
        remarks.append(
            f"at the curvature jumps of {measured.nominal} the curvature of the {kind} is assumed to jump too;"
            f" --{kind}-nominal none uses the points alone"
        )
    turn_rad = measured.held.registration.turn_rad
    near_cants = [cant for cant in _USUAL_CANT if abs(abs(turn_rad) * cant - 1.0) < _CANT_TOLERANCE]
    if kind == "rail" and near_cants:
        remarks.append(
            f"{describe_turn(measured.nominal, turn_rad)}, near 1:{near_cants[0]};"
            f" if the rail in the file is canted already, give --inclination none"
        )
    return remarks


def _describe_omissions(file_points: ProfilePoints, measured: SmoothingResult, crowded: int) -> list[str]:
    """Describe the number of points that the smoothing ignores, with the reasons."""
    beyond_ends = len(file_points.points) - crowded - len(measured.points)
    reasons = [f"{crowded} too close to the previous point"] * (crowded > 0)
    reasons += [f"{beyond_ends} beyond the ends of {measured.nominal}"] * (beyond_ends > 0)
    return [f"left out of {count_text(len(file_points.points), 'point')}: {', '.join(reasons)}"] if reasons else []


def _describe_smoothing(measured: SmoothingResult, reading: Reading) -> str:
    """Describe the noise, the filter length and the uncertainty of a smoothing.

    Parameters
    ----------
    measured
        Smoothing.
    reading
        Options of the file.

    Returns
    -------
    str
        Note.
    """
    # across the profile: along it, the points were only moved to their positions on the nominal profile
    largest = float(np.abs((measured.held.values * measured.held.normals).sum(axis=1)).max())
    subject = f"its deviation from {measured.nominal} (at most {largest:.2g} mm)" if measured.nominal else "the profile"
    reason = "chosen from the noise"
    if measured.is_filter_declared:
        reason = "declared: verdicts count for this filter alone"
    elif measured.filter_mm == PRACTICE_MIDDLE_MM:
        reason = f"the middle of the usual {PRACTICE_MM[0]:g} to {PRACTICE_MM[1]:g} mm"
    elif measured.held.relative_filter is not None:
        reason = f"chosen from the noise; down to {PRACTICE_MM[0]:g} mm where the profile is curved"
    middle = float(np.median(measured.curvature_noise_per_mm))
    return (
        f"smoothed from {len(measured.points)} points with a noise of {1e3 * measured.noise_mm:.2g} um:"
        f" {subject}, filter length {measured.filter_mm:.3g} mm ({reason}); this noise makes the curvature uncertain by"
        f" {middle:.1g} 1/mm"
    )
