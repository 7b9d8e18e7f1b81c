"""Writers of profiles as files of columns, or of radii and segments."""

from __future__ import annotations

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.profiles.curve import Profile
from fecontact.profiles.library import is_library_name, toml_text
from fecontact.profiles.segments import Spline

# Spacing of the points in a file. A profile through points keeps its points.
STEP_MM = 0.1
WRITTEN_ENDINGS = (".csv", ".toml")
"""Endings of the files of a profile."""


def sample_points(profile: Profile, step_mm: float = STEP_MM) -> Floats:
    """Points along a running surface, with the ends of all segments.

    Parameters
    ----------
    profile
        Rail or wheel.
    step_mm
        Largest spacing (mm). Splines keep their points.

    Returns
    -------
    ndarray
        Points (n, 2) in mm.
    """
    segment_points = []
    for number, segment in enumerate(profile.segments):
        if isinstance(segment, Spline):
            segment_points.append(segment.points)
            continue
        first, last = (float(s) for s in profile.arc_length([number, number + 1.0 - 1e-15]))
        count = max(1, int(np.ceil((last - first) / step_mm)))
        p = segment.evaluate(np.linspace(0.0, 1.0, count + 1))
        segment_points.append(np.column_stack((p.y, p.z)))
    points = np.concatenate(segment_points)
    # the end of a segment is the start of the next, except for the rounding of the joint
    is_distinct = np.concatenate(([True], np.hypot(*np.diff(points, axis=0).T) > 1e-2 * step_mm))
    return np.asarray(points[is_distinct])


def csv_text(profile: Profile, *, step_mm: float = STEP_MM) -> str:
    """Text of a file with the columns y and z in mm.

    Parameters
    ----------
    profile
        Rail or wheel.
    step_mm
        Largest spacing of the points (mm).

    Returns
    -------
    str
        Text with a header of two lines.
    """
    rows = "".join(f"{y:.12f},{z:.12f}\n" for y, z in sample_points(profile, step_mm))
    return f"# {profile.kind} {profile.name}: y to the field side, z up\ny [mm],z [mm]\n{rows}"


def write_profile_text(profile: Profile, name: str, ending: str) -> str:
    """Text of a file of a profile: points, or radii and segments with comments.

    Parameters
    ----------
    profile
        Rail or wheel.
    name
        Name or file from which the profile was read.
    ending
        Ending of the file, `.csv` or `.toml`.

    Returns
    -------
    str
        Text of the file.

    Raises
    ------
    InputError
        If a `.toml` file is wanted of a profile that is not in the library.

    Examples
    --------
    >>> from fecontact.profiles.library import load_library_profile
    >>> text = write_profile_text(load_library_profile("60E1"), "60E1", ".toml")
    >>> "radii = [300.0, 80.0, 13.0]" in text
    True
    """
    if ending.lower() == ".csv":
        return csv_text(profile)
    if not is_library_name(name):
        raise InputError(_explain_missing_segments(profile, name))
    return toml_text(name)


def _explain_missing_segments(profile: Profile, name: str) -> str:
    """Reason why a profile has no segments to write, and the remedy."""
    if name.lower().endswith(".toml"):
        return f"{name!r} has radii and segments already; copy the file and change it"
    nominal = "" if profile.measured is None else profile.measured.nominal
    similar = f"{nominal}, the nearest profile of the library," if nominal else "a similar profile of the library"
    command = f": fecontact profiles {nominal} --write own.toml" if nominal else ""
    return (
        f"{name!r} has no radii and segments in the library; write its points to a .csv file,"
        f" or write {similar} to a .toml file and change it{command}"
    )
