"""Options for reading and smoothing a profile file, and profiles that are defined by radii."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass

from fecontact.inputs.kinds import choice_field, flag_field, number_field, text_field
from fecontact.inputs.slots import input_dataclass

MM_PER_UNIT = {"mm": 1.0, "m": 1000.0, "cm": 10.0, "um": 1e-3, "in": 25.4}
"""Units of length that a file may have, with their size in mm."""


@input_dataclass
class Reading:
    """Options for a profile file; None leaves the choice to the file or the points.

    Attributes
    ----------
    units, columns
        Unit and columns of the points in the file.
    mirror
        Whether the profile belongs to the other side of the track.
    tape_circle_mm
        Position of a wheel's tape circle in the y of the file.
    tape_circle_z_mm
        Height at which a wheel has its rolling radius, in the z of the file.
    filter_mm, noise_mm, nominal
        Settings of the smoothing of measured points (`profiles.smoothing`).
    repair
        Whether wrong points are left out instead of refused (`profiles.points`).
    section
        Number of the profile, from 1, in a file of several profiles.

    Examples
    --------
    >>> from fecontact.profiles.reading import Reading
    >>> Reading(units="cm", filter_mm=4.0).units
    'cm'
    """

    units: str | None = choice_field(
        None, "Unit of the points in the file", tuple(MM_PER_UNIT), label="unit of the profile file"
    )
    mirror: bool | None = flag_field(
        "Mirror the profile left to right, for a file of the other side of the track; no confirms that it is not"
        " mirrored",
        default=None,
        alone=False,
    )
    columns: str | None = text_field(
        None,
        "Columns of y and z in a file of points; a minus sign reverses the sign of a column",
        "two column numbers from 1, such as 2,3 or 1,-2, or two names of the header, such as y,-z",
    )
    tape_circle_mm: float | None = number_field(
        None,
        "Only for a wheel: y of the file at the tape circle, such as 70 if y counts from the back of the flange",
        low=-1000.0,
        high=1000.0,
        remedy="70 mm from the back of the flange is usual",
    )
    tape_circle_z_mm: float | None = number_field(
        None,
        "Only for a wheel: z of the file at the rolling radius; if not given, the profile must have z = 0 at the tape"
        " circle",
        label="height of the tape circle",
        low=-1000.0,
        high=1000.0,
        remedy="give the height of the profile at the tape circle, or 0 if the rolling radius belongs to z = 0",
    )
    filter_mm: float | None = number_field(
        None,
        "Wavelength along the profile that smoothing halves; 0 uses the points as exact; if not given, it is chosen"
        " from"
        " the points",
        label="filter length",
        high=1000.0,
        remedy="4 to 8 mm is usual; 0 puts a spline through the points",
    )
    noise_mm: float | None = number_field(
        None,
        "Standard deviation of the points across the profile; if not given, it is estimated from the points",
        high=1.0,
        inclusive=False,
        remedy="measured profiles have 0.002 to 0.05 mm",
    )
    nominal: str = text_field(
        "auto",
        "Profile from which the deviation of the measured points is smoothed",
        "auto for the nearest library profile if it is certain, none, or a name of the library",
        label="nominal profile",
    )
    repair: bool = flag_field("Leave out wrong points of the file, and list them", alone=False)
    section: float | None = number_field(
        None,
        "Number of the profile, from 1, in a MiniProf file of several profiles",
        label="number of the profile",
        low=1.0,
        high=10000.0,
        whole_only=True,
        remedy="the first profile is 1",
    )


DEFAULT_READING = Reading()
"""Options of a file that is read without changes."""


def suggest_option(kind: str, key: str, value: str | float) -> str:
    """Option that answers a question about a file, for command line and study file.

    Parameters
    ----------
    kind
        `rail` or `wheel`.
    key
        Name of the option in a study file.
    value
        Suggested value.

    Returns
    -------
    str
        End of a message.
    """
    quoted_value = f"{value:g}" if isinstance(value, float) else {"yes": "true"}.get(value, f'"{value}"')
    plain_value = quoted_value if isinstance(value, float) else value
    return f"give --{kind}-{key.replace('_', '-')} {plain_value} ({key} = {quoted_value} in [{kind}_file])"


@dataclass(frozen=True, kw_only=True)
class Suggestion:
    """Option of a message that answers a question about a file.

    Attributes
    ----------
    option
        Option of the command line with its value.
    key, value
        Name and value in `Reading`.
    """

    option: str
    key: str
    value: str | float | bool


def find_suggestions(message: str, kind: str) -> list[Suggestion]:
    """Options that a message suggests by `suggest_option`, `suggest_mirroring` and `suggest_unmirrored`.

    Parameters
    ----------
    message
        Message of a refused file.
    kind
        `rail` or `wheel`.

    Returns
    -------
    list of Suggestion
        Each option once, in the order of the message.

    Examples
    --------
    >>> from fecontact.profiles.reading import find_suggestions, suggest_option
    >>> find_suggestions(f"z points down; {suggest_option('wheel', 'columns', '1,-2')}", "wheel")
    [Suggestion(option='--wheel-columns 1,-2', key='columns', value='1,-2')]
    """
    suggestions = []
    for match in re.finditer(rf"give (--{kind}-[a-z-]+ \S+) \(([a-z_]+) = (.*?) in \[{kind}_file\]\)", message):
        value = tomllib.loads(f"value = {match[3]}")["value"]
        # the numbers of a reading are floats
        value = float(value) if type(value) is int else value
        suggestions.append(Suggestion(option=match[1], key=match[2], value=value))
    return list(dict.fromkeys(suggestions))


def suggest_unmirrored(kind: str) -> str:
    """Option for a profile that is not mirrored."""
    return f"give --{kind}-mirror no (mirror = false in [{kind}_file])"


def suggest_mirroring(kind: str, *, mirrored: bool) -> str:
    """Option that mirrors a profile.

    If the profile is mirrored already, the text suggests to leave out the option.

    Parameters
    ----------
    kind
        `rail` or `wheel`.
    mirrored
        Whether the profile is mirrored already.

    Returns
    -------
    str
        The option, for a message.
    """
    return f"leave out --{kind}-mirror (mirror in [{kind}_file])" if mirrored else suggest_option(kind, "mirror", "yes")


# --- Profiles that are defined by their radii, such as `circle:300`, and profiles that a wheelset on a track may have.

CIRCLE_PREFIX, ARCS_PREFIX, CYLINDER_PREFIX = "circle:", "arcs:", "cylinder:"
# DIN 536-1, form A: symmetric heads without a gauge face
_CRANE_RAIL = re.compile(r"A\d{2,3}", re.IGNORECASE)


def is_short_form(spec: str) -> bool:
    """Whether a text defines a profile by its radii, such as `circle:300`.

    Such a text is neither a name nor a file.
    """
    return spec.lower().startswith((CIRCLE_PREFIX, ARCS_PREFIX, CYLINDER_PREFIX))


def has_no_gauge_face(spec: str) -> bool:
    """Whether a rail is defined by its radii alone.

    It has no gauge face, and its crown lies under the tape circle.
    """
    return spec.lower().startswith((CIRCLE_PREFIX, ARCS_PREFIX))


def can_form_wheelset(rail: str, wheel: str) -> bool:
    """Whether rail and wheel may belong to a wheelset on its track.

    A profile that is defined by its radii (`circle:300`, `arcs:300/80@2.5`, `cylinder:460`) is a test body: it has
    neither gauge face nor flange, which would define the position of a wheelset. Nor has the wheelset of a crane.

    Parameters
    ----------
    rail, wheel
        Texts of the command line.

    Returns
    -------
    bool
        False if a profile is a short form, or if the rail is a crane rail.
    """
    return not (is_short_form(rail) or is_short_form(wheel) or is_crane_rail(rail))


def is_crane_rail(rail: str) -> bool:
    """Whether a rail is a crane rail of the library."""
    return _CRANE_RAIL.fullmatch(rail) is not None
