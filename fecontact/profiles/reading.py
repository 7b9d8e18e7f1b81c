"""How a profile file is to be read and smoothed, and profiles that are told by their radii."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fecontact.inputs import Choice, Flag, Number, Text, by_name, check_inputs, given

MM = {"mm": 1.0, "m": 1000.0, "cm": 10.0, "um": 1e-3, "in": 25.4}
"""Units of length that a file may be in, and how many mm each is."""

_UNITS = Choice(label="units of the profile file", help="Unit of the points in a file", names=tuple(MM))
_MIRROR = Flag(help="Turn the sign of y: the file has the other side of the track")
_FLIP_Z = Flag(help="Turn the sign of z: in the file z points down", options=("flip-z",))
_COLUMNS = Text(
    help="Columns of y and z in a file of points",
    domain="two numbers such as 2,3, counted from 1, or two names of the header such as y,z",
)
_DECIMAL = Choice(
    label="decimal sign",
    help="Decimal sign of the numbers in a file of points",
    names=("point", "comma"),
    options=("decimal",),
)
_OFFSETS = Choice(
    help="What to do with the offsets and the alignment in the header of a MiniProf file",
    names=("ignore", "add"),
)
_NOISE = Number(
    help="Repeatability of the instrument, one standard deviation across the line; estimated from the points if not"
    " given",
    high=1.0,
    inclusive=False,
    remedy="measured profiles have 0.002 to 0.05 mm",
)
_SMOOTHING = Number(
    label="smoothing width",
    help="Wave length along the line of which smoothing leaves half; 0 takes points as exact; from the noise if not"
    " given",
    high=1000.0,
    remedy="5 to 60 mm are usual; 0 puts a spline through the points",
)
_NOMINAL = Text(
    label="nominal profile",
    help="Profile from which a measured line is smoothed as its deviation",
    domain="auto for the nearest of the library if the points support it, none, or a name of the library",
)
_REPAIR = Flag(help="Leave out what is wrong in a file of points, and say what was left out")


@by_name
@dataclass(frozen=True, kw_only=True)
class Reading:
    """What is known about a profile file beside its content; None is what the file says or the points show.

    Attributes
    ----------
    units, mirror, flip_z, columns, decimal
        Of the points in the file.
    offsets
        Of the header of a MiniProf file.
    noise_mm, smoothing_mm, nominal
        How measured points are smoothed (`profiles.smoothing`).
    repair
        Whether points that are wrong are left out instead of refused (`profiles.segments`).
    """

    units: str | None = given(None, _UNITS)
    mirror: bool = given(False, _MIRROR)
    flip_z: bool = given(False, _FLIP_Z)
    columns: str | None = given(None, _COLUMNS)
    decimal: str | None = given(None, _DECIMAL)
    offsets: str | None = given(None, _OFFSETS)
    noise_mm: float | None = given(None, _NOISE)
    smoothing_mm: float | None = given(None, _SMOOTHING)
    nominal: str = given("auto", _NOMINAL)
    repair: bool = given(False, _REPAIR)

    def __post_init__(self) -> None:
        check_inputs(self)


PLAIN = Reading()
"""A file as it is."""


def remedy(kind: str, key: str, value: str) -> str:
    """The exact option that settles a question about a file, on the command line and in study files."""
    shown = {"yes": "true"}.get(value, f'"{value}"')
    return f"give --{kind}-{key.replace('_', '-')} {value} ({key} = {shown} in [{kind}_file])"


# --- Profiles that are told by their radii, such as `circle:300`, and which lines are those of a wheelset on a track.

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
    """Whether rail and wheel may be those of a wheelset on its track.

    A line that is given by its radii (`circle:300`, `arcs:300/80@2.5`, `cylinder:460`) is a body for a test: it has
    neither gauge face nor flange that would say how a wheelset stands. Nor has the wheelset of a crane.
    """
    return not (is_short_form(rail) or is_short_form(wheel) or is_crane_rail(rail))


def is_crane_rail(rail: str) -> bool:
    """Whether a rail is one of the library's crane rails."""
    return _CRANE_RAIL.fullmatch(rail) is not None
