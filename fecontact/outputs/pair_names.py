"""Names of rails, wheels and positions for the terminal, pictures and reports."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from fecontact.profiles.library import file_of_identity, profile_identity

if TYPE_CHECKING:
    from fecontact.case import Case


RowMapping: TypeAlias = Mapping[str, Any]


# Characters of a name. Longer names leave no room for a picture.
_LONGEST_NAME = 60


BODIES = ("rail", "wheel")


def short_name(name: str) -> str:
    """Short name of a profile, without the ending and the hash of its file.

    A name of more than 60 characters is cut and keeps its hash, or its last characters without one. A file that is
    called rail or wheel keeps its complete name, because only the hash distinguishes it from other files.

    Parameters
    ----------
    name
        Name of the profile. For a file it is `NAME.ext@HASH`.

    Returns
    -------
    str
        The short name.

    Examples
    --------
    >>> from fecontact.outputs.pair_names import short_name
    >>> short_name("60E1")
    '60E1'
    """
    file = file_of_identity(name)
    is_shortened = file is not None and Path(file).stem.lower() not in BODIES
    stem = Path(file).stem if file is not None and is_shortened else name
    if len(stem) <= _LONGEST_NAME:
        return stem
    # the hash or the last letters distinguish long names with the same beginning
    return f"{stem[: _LONGEST_NAME - 20]}…{name.rpartition('@')[2] if is_shortened else stem[-19:]}"


def inclination_words(inclination_rad: float) -> str:
    """Inclination of a rail, such as " 1:40"; empty for an upright rail."""
    return f" 1:{1.0 / math.tan(inclination_rad):.3g}" if inclination_rad else ""


def pair_words(case: Case, between: str = ", ") -> str:
    """Rail and wheel of a case, such as "rail 60E1 1:40, wheel S1002"."""
    return pair_text(profile_identity(case.rail), profile_identity(case.wheel), case.inclination_rad, between)


def row_pair_text(row: RowMapping, between: str = ", ") -> str:
    """Rail and wheel of a row, in the form of `pair_words`."""
    return pair_text(str(row["rail"]), str(row["wheel"]), float(row.get("inclination_rad") or 0.0), between)


def pair_text(rail: str, wheel: str, inclination_rad: float, between: str) -> str:
    """Text for two profiles, from their identities.

    Endings and hashes of files are left out if the names are clear without them.
    """
    return f"{body_words('rail', rail)}{inclination_words(inclination_rad)}{between}{body_words('wheel', wheel)}"


def body_words(body: str, name: str) -> str:
    """Rail or wheel with its name, such as "rail 60E1".

    The name stands alone if it is `rail` or `wheel` already.

    Parameters
    ----------
    body
        `rail` or `wheel`.
    name
        Identity of the profile.

    Returns
    -------
    str
        Words without the ending and the hash of a file.
    """
    short = short_name(name)
    return short if short.lower().partition(".")[0] == body else f"{body} {short}"


VARIED_COLUMN = "varied"
"""Column of the further inputs that vary in a study: names and values, separated by commas."""


def position_text(row: RowMapping) -> str:
    """Shift and load of a row, with the distance along an irregularity and varied inputs.

    Parameters
    ----------
    row
        Row with `lateral_shift_mm` and `load_kN`; `distance_mm` and `varied` are optional.

    Returns
    -------
    str
        Text such as "+3.00 mm, 100 kN".

    Examples
    --------
    >>> from fecontact.outputs.pair_names import position_text
    >>> position_text({"lateral_shift_mm": 3.0, "load_kN": 100.0})
    '+3.00 mm, 100 kN'
    """
    along = "" if row.get("distance_mm") is None else f", at {row['distance_mm']:g} mm"
    varied = f", {row[VARIED_COLUMN]}" if row.get(VARIED_COLUMN) else ""
    return f"{row['lateral_shift_mm']:+z.2f} mm, {row['load_kN']:g} kN{along}{varied}"
