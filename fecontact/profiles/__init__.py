"""Rail and wheel profiles: plane lines of exact segments, a library of standard ones, and readers for one's own.

    >>> from fecontact.profiles import load
    >>> rail = load("60E1")
    >>> [round(junction.y_mm, 4) for junction in rail.junctions if junction.y_mm > 0]
    [10.228, 26.0265, 35.9998]
    >>> print(f"{1 / rail.curvature(0.0):.1f} mm")
    300.0 mm

All profiles share one pair of axes: y across, positive to the field side, z up, in mm. A rail has its crown at (0, 0)
and its material below the line; a wheel has its tape circle at y = 0 and its material above.
"""

from fecontact.profiles.curve import (
    Arc,
    CurvePoints,
    Junction,
    Kind,
    Line,
    Polynomial,
    Profile,
    Segment,
    Side,
    Spline,
)
from fecontact.profiles.library import (
    WheelProfile,
    circular_rail_head,
    cylinder_wheel,
    has_no_gauge_face,
    load,
    names,
    read_toml,
    resolve_rail,
    resolve_wheel,
    toml_text,
)
from fecontact.profiles.reader import profile_from_points, read_points

__all__ = [
    "Arc",
    "CurvePoints",
    "Junction",
    "Kind",
    "Line",
    "Polynomial",
    "Profile",
    "Segment",
    "Side",
    "Spline",
    "WheelProfile",
    "circular_rail_head",
    "cylinder_wheel",
    "has_no_gauge_face",
    "load",
    "names",
    "profile_from_points",
    "read_points",
    "read_toml",
    "resolve_rail",
    "resolve_wheel",
    "toml_text",
]
