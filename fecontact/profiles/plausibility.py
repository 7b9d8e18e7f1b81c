"""Plausibility of a profile of points: extent, place, cant, wear and dents.

A reader refuses points that cannot be a running surface. A profile with a suspicion can be used, but its contacts may
be wrong; a user has to decide.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.profiles.curve import Profile, ProfileKind
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.points import ProfilePoints
from fecontact.profiles.reading import Reading
from fecontact.profiles.recognition import ProfileMatch, check_mirroring, describe_turn, find_nearest_profiles
from fecontact.profiles.registration import FootPoints, find_foot_points
from fecontact.profiles.suspicions import Suspicion, SuspiciousProfileError

# A profile of the library is recognised if no point is farther off than the first distance, and the points are usually
# nearer than the second distance. Made profiles with up to 1 mm of wear have at most 0.17 mm; a measured wheel that is
# not in the library has 0.28 mm.
_RECOGNISED_FARTHEST_MM, _RECOGNISED_USUAL_MM = 3.0, 0.25
# Wear turns a head by up to 17 mrad (1 mm at the gauge corner); 1:40 is 25 mrad. A canted head with wear differs from a
# profile by more than an upright one.
_CANTED_RAD, _CANTED_USUAL_MM = 0.022, 0.5
# Wear of a flange or a tread moves a wheel by less than 0.1 mm across.
_SHIFTED_MM = 2.0
# Material is not gained by wear. The registration on a worn head leaves up to 0.3 mm.
_LARGEST_GAIN_MM = 0.6
# Extent across that the contacts of a wheel need, from its tape circle; a flange must not end within its face.
_WHEEL_REACH_MM, _FLANGE_FACE_RAD, _STEEP_POINTS = (-32.0, 25.0), 0.4, 5
# Extent of a head to its field side from its highest point, or depth of its end below it.
_FIELD_REACH_MM, _FIELD_DEPTH_MM = 20.0, 3.0
# A dent is a group of neighbours off the smoothed profile. Means of five neighbours are up to 0.02 mm for a noise of
# 0.012 mm; dents of 0.09 mm are in a measured rail.
_GROUP_POINTS, _DENT_MM, _DENT_NOISES = 5, 0.05, 4.0
# Dents matter on the running surface, away from the ends of the points.
_RUNNING_SLOPE_RAD, _TREAD_MM, _END_MM = 0.4, (-35.0, 45.0), 5.0


def find_suspicions(profile: Profile, reading: Reading, gauge_depth_mm: float = 0.0) -> list[Suspicion]:
    """Find what may be wrong with a profile of points.

    Parameters
    ----------
    profile
        Profile through points, exact or smoothed. A profile without points has no suspicions.
    reading
        Options with which the file was read. Options that answer a question leave out its suspicion.
    gauge_depth_mm
        Depth below the top of a rail to which its gauge side is needed; 0 if the gauge is not used.

    Returns
    -------
    list of Suspicion
        Suspicions; empty for a plausible profile.

    Examples
    --------
    >>> from fecontact.profiles.library import load_library_profile
    >>> from fecontact.profiles.plausibility import find_suspicions
    >>> from fecontact.profiles.reading import Reading
    >>> find_suspicions(load_library_profile("60E1"), Reading())
    []
    """
    points = profile.points
    if points is None:
        return []
    matches = find_nearest_profiles(points, profile.kind)
    suspicions = [*_find_mirroring(profile, points, reading, matches)]
    if matches and matches[0].farthest_mm < _RECOGNISED_FARTHEST_MM:
        suspicions += _find_displacement(profile, reading, matches[0])
        suspicions += _find_gain(profile, points, matches[0])
    return [*suspicions, *_find_missing_extent(profile, points, gauge_depth_mm), *_find_dent(profile, points)]


def _find_mirroring(profile: Profile, points: Floats, reading: Reading, matches: list[ProfileMatch]) -> list[Suspicion]:
    """Suspicion that a head is mirrored.

    The reader has checked exact points without the recognised profiles.
    """
    try:
        check_mirroring(ProfilePoints(points=points, kind=profile.kind, name=profile.name), reading, matches)
    except SuspiciousProfileError as error:
        return [Suspicion(kind=error.kind, text=str(error).partition("; ")[0])]
    return []


def _find_displacement(profile: Profile, reading: Reading, match: ProfileMatch) -> list[Suspicion]:
    """Suspicion of a canted rail, or of a wrong origin of a wheel."""
    turn_rad = match.registration.turn_rad
    if profile.kind == "rail":
        if abs(turn_rad) < _CANTED_RAD or match.usual_mm > _CANTED_USUAL_MM:
            return []
        text = f"{profile.name}: {describe_turn(match.name, turn_rad)}: the rail in the file may be canted already"
        return [Suspicion(kind="canted", text=text)]
    shift_mm = match.registration.shift[0]
    if abs(shift_mm) < _SHIFTED_MM or match.usual_mm > _RECOGNISED_USUAL_MM or reading.tape_circle_mm is not None:
        return []
    return [
        Suspicion(
            kind="shifted",
            text=f"{profile.name}: {match.name} fits the points with a lateral shift of {shift_mm:+.1f} mm: y = 0 may"
            " not be the tape circle",
        )
    ]


def _find_gain(profile: Profile, points: Floats, match: ProfileMatch) -> list[Suspicion]:
    """Suspicion of a wrong file: more material than the recognised profile."""
    nominal = load_library_profile(match.name)
    feet = find_foot_points(nominal, match.registration.to_reference(points))
    is_running = _is_running_surface(feet, points, profile.kind)
    gain_mm = np.where(is_running, -nominal.convex_sign * feet.off_mm, 0.0)
    largest = int(gain_mm.argmax())
    if gain_mm[largest] < _LARGEST_GAIN_MM or match.usual_mm > _CANTED_USUAL_MM:
        return []
    text = (
        f"{profile.name}: at y = {points[largest, 0]:.1f} mm it has {gain_mm[largest]:.1f} mm more material than"
        f" {match.name}, which fits it best: wear does not add material"
    )
    return [Suspicion(kind="wear", text=text)]


def _is_running_surface(feet: FootPoints, points: Floats, kind: ProfileKind) -> NDArray[np.bool_]:
    """Whether points (n, 2) are on the running surface, away from its ends."""
    y = points[:, 0]
    slope_rad = np.abs(np.arctan2(-feet.normals[:, 0], feet.normals[:, 1]))
    is_running = (slope_rad < _RUNNING_SLOPE_RAD) & feet.inside & (y > y[0] + _END_MM) & (y < y[-1] - _END_MM)
    if kind == "wheel":
        is_running &= (y > _TREAD_MM[0]) & (y < _TREAD_MM[1])
    return np.asarray(is_running)


def _find_missing_extent(profile: Profile, points: Floats, gauge_depth_mm: float) -> list[Suspicion]:
    """Suspicion that the points end where contacts are possible."""
    y, z = points.T
    phrases = []
    if profile.kind == "rail":
        top = int(z.argmax())
        depths_mm = z[top] - np.array([z[: top + 1].min(), z[top:].min()])
        if depths_mm[0] < gauge_depth_mm:
            phrases.append(
                f"its gauge side ends {depths_mm[0]:.1f} mm below its highest point, but the gauge is measured"
                f" {gauge_depth_mm:g} mm below it"
            )
        if depths_mm[1] < _FIELD_DEPTH_MM and y[-1] - y[top] < _FIELD_REACH_MM:
            phrases.append(
                f"its field side ends {y[-1] - y[top]:.1f} mm from its highest point and {depths_mm[1]:.1f} mm below it"
            )
    else:
        low, high = _WHEEL_REACH_MM
        if y.min() > low:
            phrases.append(f"it begins at y = {y.min():.1f} mm, but contacts are possible from {low:g} mm")
        elif _ends_in_flange_face(points):
            phrases.append(f"it begins at y = {y.min():.1f} mm, in the face of its flange")
        if y.max() < high:
            phrases.append(f"it ends at y = {y.max():.1f} mm, but contacts are possible up to {high:g} mm")
    return [Suspicion(kind="short", text=f"{profile.name}: {phrase}") for phrase in phrases]


def _ends_in_flange_face(points: Floats) -> bool:
    """Whether the first points of a wheel fall steeply towards its end."""
    across, up = points[_STEEP_POINTS] - points[0]
    return bool(np.arctan2(up, across) > _FLANGE_FACE_RAD)


def _find_dent(profile: Profile, points: Floats) -> list[Suspicion]:
    """Suspicion of a dent: neighbours off the smoothed profile on the running surface."""
    if profile.measured is None:
        return []
    feet = find_foot_points(profile, points)
    off_mm = np.where(_is_running_surface(feet, points, profile.kind), np.abs(feet.off_mm), 0.0)
    means_mm = np.convolve(off_mm, np.full(_GROUP_POINTS, 1.0 / _GROUP_POINTS), "same")
    largest = int(means_mm.argmax())
    if means_mm[largest] < max(_DENT_MM, _DENT_NOISES * profile.measured.noise_mm):
        return []
    text = (
        f"{profile.name}: {_GROUP_POINTS} neighbours at y = {points[largest, 0]:.1f} mm are {means_mm[largest]:.2g} mm"
        f" off the profile, smoothed over {profile.measured.filter_mm:g} mm: a dent, a lump or dirt"
    )
    return [Suspicion(kind="dented", text=text)]
