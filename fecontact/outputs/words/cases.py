"""Rails, wheels and positions in words: on the terminal, in pictures and in reports."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.geometry.placement import Placement
from fecontact.profiles.identity import file_of_identity, profile_identity
from fecontact.solving.placing import roll_of_case

Row = Mapping[str, Any]


def short_name(name: str) -> str:
    """Profile's name, of a file (`NAME.ext@HASH`) without ending and hash."""
    file = file_of_identity(name)
    return Path(file).stem if file else name


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


def case_words(case: Case, placement: Placement) -> str:
    """Pair, position and load of a case, in one line."""
    roll = 1e3 * roll_of_case(case, placement)
    turned = f", yaw {1e3 * case.yaw_rad:+.4g} mrad" if case.yaw_rad else ""
    if case.roll != "given":
        turned = f" of the wheelset, {case.side} side, roll {roll:+z.4g} mrad{turned}"
    elif roll:
        turned = f", roll {roll:+.4g} mrad{turned}"
    return (
        f"{pair_words(case)};"
        f" shift {case.lateral_shift_mm:+z.2f} mm{turned}; {case.load_kind} load {case.load_N / 1e3:.4g} kN"
    )


def position_text(row: Row) -> str:
    """Shift and load of a row."""
    return f"{row['lateral_shift_mm']:+z.2f} mm, {row['load_kN']:g} kN"
