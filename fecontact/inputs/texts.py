"""Texts of inputs: numbers, inclinations, lists, names that changed, and suggestions."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from numbers import Real

from fecontact.errors import InputError

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_MOST_NUMBERS = 1000
INCLINATION_FORMS = "1:N such as 1:40, none, or an angle with its unit such as 25mrad or 1.43deg"


def parse_inclination(text: str) -> float:
    """Rail inclination in rad from `1:40`, `none`, or an angle with its unit such as `25mrad` or `1.43deg`."""
    text = text.strip().lower()
    if text in ("none", "0"):
        return 0.0
    if match := re.fullmatch(rf"1:({_NUMBER})", text):
        ratio = float(match[1])
        if ratio != 0.0:
            return math.atan(1.0 / ratio)
    if match := re.fullmatch(rf"({_NUMBER})\s*(mrad|rad|deg)", text):
        return float(match[1]) * {"mrad": 1e-3, "rad": 1.0, "deg": math.pi / 180.0}[match[2]]
    raise InputError(f"inclination {text!r}: allowed are {INCLINATION_FORMS}")


def inclination_text(inclination_rad: float) -> str:
    """The shortest text from which `parse_inclination` makes this angle."""
    if inclination_rad == 0.0:
        return "none"
    ratio = f"1:{1.0 / math.tan(inclination_rad):.12g}"
    return ratio if parse_inclination(ratio) == inclination_rad else f"{inclination_rad!r}rad"


def parse_numbers(text: str, name: str) -> tuple[float, ...]:
    """Numbers from a comma list whose items are numbers or ranges a:b:step (both ends included), such as -6:6:0.5,8."""
    found: list[float] = []
    for item in text.split(","):
        if re.fullmatch(rf"{_NUMBER}(:{_NUMBER}:{_NUMBER})?", item.strip()) is None:
            raise InputError(f"{name} {text!r}: {item!r} is neither a number nor a range FROM:TO:STEP such as -6:6:0.5")
        parts = [float(part) for part in item.split(":")]
        found += parts if len(parts) == 1 else _range(parts[0], parts[1], parts[2], f"{name} {text!r}")
    return tuple(dict.fromkeys(found))


def listed(values: Sequence[float], name: str) -> tuple[float, ...]:
    """Numbers of a list; a single number, which a caller in Python may give in its place, is refused."""
    if isinstance(values, Real):
        raise InputError(f"{name} is {values}; give a list, for example [{values}]")
    return tuple(map(float, values))


def _range(first: float, last: float, step: float, what: str) -> list[float]:
    if not step > 0.0 or last < first:
        raise InputError(f"{what}: a range goes up, with a step above zero, such as -6:6:0.5")
    # a millionth of a step for ends that are no sums of the step in binary
    steps = (last - first) / step + 1e-6
    if not steps < _MOST_NUMBERS:
        raise InputError(f"{what}: {steps + 1.0:.6g} values; allowed are {_MOST_NUMBERS}; take a larger step")
    return [round(first + step * k, 9) for k in range(math.floor(steps) + 1)]


def nearest(name: str, known: Mapping[str, str]) -> str:
    """What a misspelt name may have meant, as the end of a message: of the known spellings the nearest, or nothing.

    Parameters
    ----------
    known
        For each spelling the name to propose.
    """
    lower = {spelling.lower(): proposal for spelling, proposal in known.items()}
    found = get_close_matches(name.lower(), lower, n=1, cutoff=0.6)
    return f"; did you mean {lower[found[0]]}?" if found else ""


def renamed(name: str) -> str:
    """What stands for an input that was another one once, in words; nothing for any other name."""
    return f"{name}: there is no such input any more; {RENAMED[name]}" if name in RENAMED else ""


_OF_PROFILES = {
    "smoothing_mm": "the wave length of which smoothing leaves half is filter_mm, 0 for points as exact",
    "flip_z": "a minus sign turns a column: columns = '1,-2'",
    "decimal": "decimal commas are recognised; where they are not, write points",
    "offsets": "offsets of a MiniProf header are added, its alignment is not, and the notes say so",
}
_FINER = "finer elements are asked for by refine = 'verdict' (the default), 'never' or 'evidence'"
_OPPOSITE = "--opposite rail=...,wheel=...,rolling-radius-mm=...,load-kn=... has it, in files the table [opposite]"
_HALF_LENGTH = "rail and rim have one half_length_mm"
_NO_NAME = "a material has no name any more; leave it out"
RENAMED = {
    **dict.fromkeys(("html", "png"), "compare --out FOLDER writes comparison.json, comparison.html and comparison.png"),
    "wheelset": "the roll at which both wheels touch is roll = 'touching', a fixed one roll = 'given'",
    "roll_under_load": "the roll of the loaded wheelset is roll = 'loaded'",
    **dict.fromkeys(("refine_degrees_of_freedom", "evidence"), _FINER),
    **dict.fromkeys(("rail_half_length_mm", "rim_half_length_mm"), _HALF_LENGTH),
    **{
        f"opposite_{name}": _OPPOSITE for name in ("rail", "wheel", "rolling_radius_mm", "load_kN", "load_kn", "load_N")
    },
    **dict.fromkeys(("name", "material_name", "rail_material_name", "wheel_material_name"), _NO_NAME),
    **{f"{body}{name}": text for name, text in _OF_PROFILES.items() for body in ("", "rail_", "wheel_")},
}
"""Names of inputs from before the first release, with what to write instead; CHANGELOG.md lists them."""
