"""Lines through points of a test, as a file of them would be read."""

from pathlib import Path

import numpy as np

from fecontact.profiles.curve import Profile, ProfileKind
from fecontact.profiles.points import ProfilePoints
from fecontact.profiles.readers.columns import read_columns
from fecontact.profiles.reading import Reading
from fecontact.profiles.recognition import fit_profile

# Columns of a row that differ from run to run; all others are the same to the last bit.
MEASURED_COLUMNS = ("seconds", "cpu_seconds", "peak_memory_MB")
AS_IS = Reading(filter_mm=0.0)


def simpack(y, z, kind="rail", *, points=None, **keys):
    """A SIMPACK file with z down.

    The first is written by hand from a real file, keys by their names with underscores.
    """
    rows = points or "\n".join(f"{a:.12e} {b:.12e}" for a, b in zip(y, -np.asarray(z), strict=True))
    body = "".join(f"    {key.replace('_', '.')} = {value}   ! a comment\n" for key, value in keys.items())
    return (
        "! *** SIMPACK Rail-Wheel Profile ***\n  header.begin\n    version = 1\n"
        f"    type = {int(kind == 'wheel')} ! 0=rail profile, 1=wheel profile\n  header.end\n  spline.begin\n"
        f"    comment = 'has = and ! in it'\n{body}    point.begin\n! y z\n{rows}\n    point.end\n  spline.end\n"
    )


def profile_from_points(y, z, *, kind: ProfileKind, name: str, reading: Reading = AS_IS) -> Profile:
    """A profile of splines through points, or another requested profile."""
    return fit_profile(ProfilePoints(points=np.column_stack((y, z)).astype(float), kind=kind, name=name), reading)


def read_points(path: str | Path, *, kind: ProfileKind) -> Profile:
    """Splines through the points of a file of columns."""
    return fit_profile(read_columns(Path(path), kind, AS_IS), AS_IS)
