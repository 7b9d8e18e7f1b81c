"""Numbers and angles as a user writes them, and the name that he may have meant."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from difflib import get_close_matches

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
    return f"{name}: there is no such input any more; {_RENAMED[name]}" if name in _RENAMED else ""


_RENAMED = {
    "wheelset": "the roll at which both wheels touch is roll = 'touching', a fixed one roll = 'given'",
    "roll_under_load": "the roll of the loaded wheelset is roll = 'loaded'",
}
