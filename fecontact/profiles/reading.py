"""How a profile file is to be read and smoothed, and profiles that are told by their radii."""

from __future__ import annotations

import re

from fecontact.inputs.kinds import choice, flag, number, text
from fecontact.inputs.slots import inputs

MM = {"mm": 1.0, "m": 1000.0, "cm": 10.0, "um": 1e-3, "in": 25.4}
"""Units of length that a file may be in, and how many mm each is."""


@inputs
class Reading:
    """What is known about a profile file beside its content; None is what the file says or the points show.

    Attributes
    ----------
    units, columns
        Of the points in the file.
    mirror
        Whether the line is of the other side of the track.
    tape_circle_mm
        Where the tape circle of a wheel lies in the file's own y.
    tape_circle_z_mm
        Height in the file's own z at which a wheel has its rolling radius.
    filter_mm, noise_mm, nominal
        How measured points are smoothed (`profiles.smoothing`).
    repair
        Whether points that are wrong are left out instead of refused (`profiles.segments`).
    """

    units: str | None = choice(None, "Unit of the points in a file", tuple(MM), label="units of the profile file")
    mirror: bool | None = flag(
        "Turn the line over, left to right: the file has the other side of the track; no says that it is not so",
        default=None,
        alone=False,
    )
    columns: str | None = text(
        None,
        "Columns of y and z in a file of points, with a minus sign where the sign is to be turned",
        "two numbers such as 2,3 or 1,-2, counted from 1, or two names of the header such as y,-z",
    )
    tape_circle_mm: float | None = number(
        None,
        "y at which the file has the tape circle of a wheel, such as 70 where y counts from the back of the flange",
        low=-1000.0,
        high=1000.0,
        remedy="70 from the back of the flange is usual",
    )
    tape_circle_z_mm: float | None = number(
        None,
        "z of the file at which a wheel has its rolling radius; not given, the line must pass the tape circle at z = 0",
        label="height of the tape circle",
        low=-1000.0,
        high=1000.0,
        remedy="the height of the line at the tape circle, or 0 for the z = 0 of the file",
    )
    filter_mm: float | None = number(
        None,
        "Wave length along the line of which smoothing leaves half; 0 takes points as exact; from the points if not"
        " given",
        label="filter length",
        high=1000.0,
        remedy="4 to 8 mm are usual; 0 puts a spline through the points",
    )
    noise_mm: float | None = number(
        None,
        "Scatter of the points across the line, one standard deviation; estimated from the points if not given",
        high=1.0,
        inclusive=False,
        remedy="measured profiles have 0.002 to 0.05 mm",
    )
    nominal: str = text(
        "auto",
        "Profile from which a measured line is smoothed as its deviation",
        "auto for the nearest of the library where it is certain, none, or a name of the library",
        label="nominal profile",
    )
    repair: bool = flag("Leave out what is wrong in a file of points, and say what was left out", alone=False)


PLAIN = Reading()
"""A file as it is."""


def remedy(kind: str, key: str, value: str | float) -> str:
    """The exact option that settles a question about a file, on the command line and in study files."""
    shown = f"{value:g}" if isinstance(value, float) else {"yes": "true"}.get(value, f'"{value}"')
    said = shown if isinstance(value, float) else value
    return f"give --{kind}-{key.replace('_', '-')} {said} ({key} = {shown} in [{kind}_file])"


def mirror_settled(kind: str) -> str:
    """The option that says that a line is not of the other side of the track."""
    return f"give --{kind}-mirror no (mirror = false in [{kind}_file])"


def mirror_remedy(kind: str, *, mirrored: bool) -> str:
    """The option that turns a line over, or the one to leave out where it is turned over already."""
    return f"leave out --{kind}-mirror (mirror in [{kind}_file])" if mirrored else remedy(kind, "mirror", "yes")


# --- Profiles that are told by their radii, such as `circle:300`, and which lines a wheelset on a track may have.

CIRCLE, ARCS, CYLINDER = "circle:", "arcs:", "cylinder:"
# DIN 536-1, form A: symmetric heads without a gauge face
_CRANE_RAIL = re.compile(r"A\d{2,3}", re.IGNORECASE)


def is_short_form(spec: str) -> bool:
    """Whether a text gives a profile by its radii, such as `circle:300`: neither a name nor a file."""
    return spec.lower().startswith((CIRCLE, ARCS, CYLINDER))


def has_no_gauge_face(spec: str) -> bool:
    """Whether a rail is given by its radii alone: it has no gauge face, its crown lies under the tape circle."""
    return spec.lower().startswith((CIRCLE, ARCS))


def makes_a_wheelset(rail: str, wheel: str) -> bool:
    """Whether rail and wheel may belong to a wheelset on its track.

    A line that is given by its radii (`circle:300`, `arcs:300/80@2.5`, `cylinder:460`) is a body for a test: it has
    neither gauge face nor flange that would say how a wheelset stands. Nor has the wheelset of a crane.
    """
    return not (is_short_form(rail) or is_short_form(wheel) or is_crane_rail(rail))


def is_crane_rail(rail: str) -> bool:
    """Whether a rail is one of the library's crane rails."""
    return _CRANE_RAIL.fullmatch(rail) is not None
