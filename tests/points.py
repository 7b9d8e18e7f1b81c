"""Lines through points of a test, as a file of them would be read."""

from pathlib import Path

import numpy as np

from fecontact.profiles.curve import Kind, Profile
from fecontact.profiles.points import Points
from fecontact.profiles.readers.table import read_columns
from fecontact.profiles.reading import Reading
from fecontact.profiles.recognition import line_through

AS_IS = Reading(smoothing_mm=0.0)


def profile_from_points(y, z, *, kind: Kind, name: str, reading: Reading = AS_IS) -> Profile:
    """Splines through points, or what else is asked for."""
    return line_through(Points(points=np.column_stack((y, z)).astype(float), kind=kind, name=name), reading)


def read_points(path: str | Path, *, kind: Kind) -> Profile:
    """Splines through the points of a file of columns."""
    return line_through(read_columns(Path(path), kind, AS_IS), AS_IS)
