"""Rails and wheels in words: on the terminal, in pictures and in reports."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from fecontact.profiles.identity import file_of_identity, profile_identity

if TYPE_CHECKING:
    from fecontact.case import Case

Row: TypeAlias = Mapping[str, Any]


# longer ones leave no room for a picture
_LONGEST_NAME = 60


def short_name(name: str) -> str:
    """Profile's name, of a file (`NAME.ext@HASH`) without ending and hash; of a very long one a part, with the hash."""
    file = file_of_identity(name)
    if file is None:
        return name
    stem = Path(file).stem
    return stem if len(stem) <= _LONGEST_NAME else f"{stem[: _LONGEST_NAME - 20]}…{name.rpartition('@')[2]}"


def inclination_words(inclination_rad: float) -> str:
    """A rail's inclination such as " 1:40", nothing for an upright one."""
    return f" 1:{1.0 / math.tan(inclination_rad):.3g}" if inclination_rad else ""


def pair_words(case: Case, between: str = ", ") -> str:
    """Rail and wheel, such as "rail 60E1 1:40, wheel S1002"."""
    return pair_text(profile_identity(case.rail), profile_identity(case.wheel), case.inclination_rad, between)


def pair_of_row(row: Row, between: str = ", ") -> str:
    """Rail and wheel of a row, as `pair_words` has them."""
    return pair_text(str(row["rail"]), str(row["wheel"]), float(row.get("inclination_rad") or 0.0), between)


def pair_text(rail: str, wheel: str, inclination_rad: float, between: str) -> str:
    """Two profiles by their identities, without endings and hashes."""
    return f"rail {short_name(rail)}{inclination_words(inclination_rad)}{between}wheel {short_name(wheel)}"


def position_text(row: Row) -> str:
    """Shift and load of a row, and along what is irregular the distance."""
    along = "" if row.get("distance_mm") is None else f", at {row['distance_mm']:g} mm"
    return f"{row['lateral_shift_mm']:+z.2f} mm, {row['load_kN']:g} kN{along}"
