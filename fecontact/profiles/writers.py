"""Profiles into files of columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.profiles.curve import Profile
from fecontact.profiles.segments import Spline

# A file of points takes one so often, unless a line is made of points itself.
STEP_MM = 0.1


def points_along(profile: Profile, step_mm: float = STEP_MM) -> Floats:
    """Points (n, 2) in mm along a running surface, the ends of all segments among them; its own if it has some."""
    parts = []
    for number, segment in enumerate(profile.segments):
        if isinstance(segment, Spline):
            parts.append(segment.points)
            continue
        first, last = (float(s) for s in profile.arc_length([number, number + 1.0 - 1e-15]))
        count = max(1, int(np.ceil((last - first) / step_mm)))
        p = segment.evaluate(np.linspace(0.0, 1.0, count + 1))
        parts.append(np.column_stack((p.y, p.z)))
    points = np.concatenate(parts)
    # the end of a segment is the start of the next, to the rounding of the joint
    apart = np.concatenate(([True], np.hypot(*np.diff(points, axis=0).T) > 1e-2 * step_mm))
    return np.asarray(points[apart])


def csv_text(profile: Profile, *, step_mm: float = STEP_MM) -> str:
    """Text of a file of columns y, z in mm."""
    rows = "".join(f"{y:.12f},{z:.12f}\n" for y, z in points_along(profile, step_mm))
    return f"# {profile.kind} {profile.name}: y to the field side, z up\ny [mm],z [mm]\n{rows}"


def refuse_other_endings(path: Path) -> None:
    """Refuse a name that does not end in .csv."""
    if path.suffix.lower() != ".csv":
        raise InputError(
            f"profiles are written as .csv, not as {path.suffix or 'a file without ending'!r}; give a name such as"
            f" {path.stem or 'mine'}.csv"
        )
