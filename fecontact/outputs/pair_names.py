"""Names of rails, wheels and positions: on the terminal, in pictures and in reports."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from fecontact.profiles.library import file_of_identity, profile_identity

if TYPE_CHECKING:
    from fecontact.case import Case


Row: TypeAlias = Mapping[str, Any]


# longer ones leave no room for a picture
_LONGEST_NAME = 60


BODIES = ("rail", "wheel")


def short_name(name: str) -> str:
    """A profile's name, for a file (`NAME.ext@HASH`) without ending and hash; a long name is cut and has its hash.

    A file that is called rail or wheel, whatever it is, is told from others by its hash alone.
    """
    file = file_of_identity(name)
    if file is None or (stem := Path(file).stem).lower() in BODIES:
        return name
    return stem if len(stem) <= _LONGEST_NAME else f"{stem[: _LONGEST_NAME - 20]}…{name.rpartition('@')[2]}"


def inclination_words(inclination_rad: float) -> str:
    """A rail's inclination such as " 1:40"; empty for an upright rail."""
    return f" 1:{1.0 / math.tan(inclination_rad):.3g}" if inclination_rad else ""


def pair_words(case: Case, between: str = ", ") -> str:
    """Rail and wheel, such as "rail 60E1 1:40, wheel S1002"."""
    return pair_text(profile_identity(case.rail), profile_identity(case.wheel), case.inclination_rad, between)


def pair_of_row(row: Row, between: str = ", ") -> str:
    """Rail and wheel of a row, as in `pair_words`."""
    return pair_text(str(row["rail"]), str(row["wheel"]), float(row.get("inclination_rad") or 0.0), between)


def pair_text(rail: str, wheel: str, inclination_rad: float, between: str) -> str:
    """Two profiles by their identities, without endings and hashes where their names tell enough."""
    return f"{body_words('rail', rail)}{inclination_words(inclination_rad)}{between}{body_words('wheel', wheel)}"


def body_words(body: str, name: str) -> str:
    """A rail or a wheel with its name, such as "rail 60E1"; the name alone of a file that is called so."""
    short = short_name(name)
    return short if short.lower().partition(".")[0] == body else f"{body} {short}"


VARIED = "varied"
"""Column of what else varies in a study: names and values of inputs, separated by commas."""


def position_text(row: Row) -> str:
    """Shift and load of a row, the distance along an irregularity, and what else varies in its study."""
    along = "" if row.get("distance_mm") is None else f", at {row['distance_mm']:g} mm"
    varied = f", {row[VARIED]}" if row.get(VARIED) else ""
    return f"{row['lateral_shift_mm']:+z.2f} mm, {row['load_kN']:g} kN{along}{varied}"
