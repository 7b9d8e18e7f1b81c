"""Texts of inputs: numbers, inclinations, lists, former names and suggestions."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from numbers import Real
from pathlib import Path

from fecontact.errors import InputError, is_invisible

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_MOST_NUMBERS = 1000
_SHORT_ESCAPES = {"\n": r"\n", "\r": r"\r", "\t": r"\t"}
INCLINATION_FORMS = "1:N such as 1:40, none, or an angle with its unit such as 25mrad or 1.43deg"


def parse_inclination(text: str) -> float:
    """Rail inclination in rad of a text.

    Parameters
    ----------
    text
        `1:40`, `none`, or an angle with its unit such as `25mrad` or `1.43deg`.

    Returns
    -------
    float
        Inclination in rad; atan(1/N) for `1:N`.

    Raises
    ------
    InputError
        If the text has a different form.

    Examples
    --------
    >>> from fecontact.inputs.texts import parse_inclination
    >>> parse_inclination("25mrad")
    0.025
    """
    text = text.strip().lower()
    if text in ("none", "0"):
        return 0.0
    if match := re.fullmatch(rf"1:({_NUMBER})", text):
        ratio = float(match[1])
        if ratio != 0.0:
            return math.atan(1.0 / ratio)
    if match := re.fullmatch(rf"({_NUMBER})\s*(mrad|rad|deg)", text):
        return float(match[1]) * {"mrad": 1e-3, "rad": 1.0, "deg": math.pi / 180.0}[match[2]]
    raise InputError(f"inclination is {text!r}; allowed: {INCLINATION_FORMS}")


def format_inclination(inclination_rad: float) -> str:
    """Shortest text of an inclination that `parse_inclination` reads back exactly.

    Parameters
    ----------
    inclination_rad
        Inclination in rad.

    Returns
    -------
    str
        `none`, `1:N`, or the angle in rad with its unit.
    """
    if inclination_rad == 0.0:
        return "none"
    ratio = f"1:{1.0 / math.tan(inclination_rad):.12g}"
    return ratio if parse_inclination(ratio) == inclination_rad else f"{inclination_rad!r}rad"


def parse_numbers(text: str, name: str, *, keep_repeated: bool = False) -> tuple[float, ...]:
    """Numbers of a comma list with ranges, such as -6:6:0.5,8.

    Parameters
    ----------
    text
        Numbers and ranges FROM:TO:STEP with both ends included, separated by commas.
    name
        Name of the list in messages.
    keep_repeated
        Whether a number that is given twice is in the result twice.

    Returns
    -------
    tuple of float
        Numbers in the order of the text. Numbers of a range are rounded to 9 decimals.

    Raises
    ------
    InputError
        If a term has a different form, or if a range is descending or has more than 1000 values.

    Examples
    --------
    >>> from fecontact.inputs.texts import parse_numbers
    >>> parse_numbers("0:1:0.5,8", "shifts")
    (0.0, 0.5, 1.0, 8.0)
    """
    numbers: list[float] = []
    for term in text.split(","):
        if re.fullmatch(rf"{_NUMBER}(:{_NUMBER}:{_NUMBER})?", term.strip()) is None:
            raise InputError(f"{name} {text!r}: {term!r} is neither a number nor a range FROM:TO:STEP such as -6:6:0.5")
        bounds = [float(bound) for bound in term.split(":")]
        numbers += bounds if len(bounds) == 1 else _expand_range(bounds[0], bounds[1], bounds[2], f"{name} {text!r}")
    return tuple(numbers if keep_repeated else dict.fromkeys(numbers))


def require_number_list(values: Sequence[float], name: str) -> tuple[float, ...]:
    """Numbers of a list as floats; a single number instead of a list is refused.

    Parameters
    ----------
    values
        List of numbers. A caller in Python may give a single number by mistake.
    name
        Name of the list in messages.

    Returns
    -------
    tuple of float
        The numbers.

    Raises
    ------
    InputError
        If `values` is a single number.
    """
    if isinstance(values, Real):
        raise InputError(f"{name} is {values}; give a list, for example [{values}]")
    return tuple(map(float, values))


def _expand_range(first: float, last: float, step: float, label: str) -> list[float]:
    """Numbers from `first` to at most `last`, `step` apart.

    Raises an `InputError` with the label for a step of zero or below, a descending range, and too many numbers.
    """
    if not step > 0.0 or last < first:
        raise InputError(f"{label}: a range must ascend with a positive step, such as -6:6:0.5")
    # The millionth of a step covers range ends that are not exact multiples of the step in binary.
    steps = (last - first) / step + 1e-6
    if not steps < _MOST_NUMBERS:
        raise InputError(f"{label}: {steps + 1.0:.6g} values; allowed: at most {_MOST_NUMBERS}; use a larger step")
    return [round(first + step * index, 9) for index in range(math.floor(steps) + 1)]


def suggest_name(name: str, proposals: Mapping[str, str]) -> str:
    """Suggestion for a misspelt name, as the end of a message.

    Parameters
    ----------
    name
        Name that was not recognised.
    proposals
        Name to propose for each spelling.

    Returns
    -------
    str
        Text such as "; did you mean load?"; empty without a similar spelling.
    """
    lower = {spelling.lower(): proposal for spelling, proposal in proposals.items()}
    matches = get_close_matches(name.lower(), lower, n=1, cutoff=0.6)
    return f"; did you mean {lower[matches[0]]}?" if matches else ""


def explain_former_name(name: str) -> str:
    """Hint for the former name of an input; empty for any other name."""
    return f"{name} is no longer an input; {FORMER_NAMES[name]}" if name in FORMER_NAMES else ""


_PROFILE_INPUTS = {
    "smoothing_mm": "use filter_mm, the wavelength that smoothing halves, or 0 to use the points as exact",
    "flip_z": "a minus sign reverses the sign of a column: columns = '1,-2'",
    "decimal": "decimal commas are recognised; if they are not, write decimal points",
    "offsets": "the offsets of a MiniProf header are added, its alignment is not; notes list both",
}
_REFINEMENT = "for finer elements use refine = 'verdict' or 'evidence', or 'never' for none"
_OPPOSITE = "use --opposite rail=...,wheel=...,rolling-radius-mm=...,load-kn=..., in files the table [opposite]"
_HALF_LENGTH = "use half_length_mm, which sets both rail and rim"
_NO_MATERIAL_NAME = "materials have no name; leave it out"
FORMER_NAMES = {
    **dict.fromkeys(
        ("html", "png"), "use compare --out FOLDER, which writes comparison.json, comparison.html and comparison.png"
    ),
    "wheelset": "use roll = 'touching' for the roll at which both wheels touch, or roll = 'given' for a fixed roll",
    "roll_under_load": "use roll = 'loaded' for the roll of the loaded wheelset",
    **dict.fromkeys(("refine_degrees_of_freedom", "evidence"), _REFINEMENT),
    **dict.fromkeys(("rail_half_length_mm", "rim_half_length_mm"), _HALF_LENGTH),
    **{
        f"opposite_{name}": _OPPOSITE for name in ("rail", "wheel", "rolling_radius_mm", "load_kN", "load_kn", "load_N")
    },
    **dict.fromkeys(("name", "material_name", "rail_material_name", "wheel_material_name"), _NO_MATERIAL_NAME),
    **{f"{body}{name}": text for name, text in _PROFILE_INPUTS.items() for body in ("", "rail_", "wheel_")},
}
"""Names of inputs from before the first release, with the present input to use; CHANGELOG.md lists these names."""


def count_text(number: int, noun: str, plural: str = "") -> str:
    """Number with its noun in the singular or the plural.

    Parameters
    ----------
    number
        Number.
    noun
        Noun in the singular, with its adjectives.
    plural
        Plural, if it is not the noun with an s.

    Returns
    -------
    str
        Text such as "1 file", "2 files", "2 studies".

    Examples
    --------
    >>> from fecontact.inputs.texts import count_text
    >>> count_text(1, "file"), count_text(0, "file"), count_text(2, "study", "studies")
    ('1 file', '0 files', '2 studies')
    """
    return f"{number} {noun if number == 1 else plural or f'{noun}s'}"


def escape_invisible(text: str) -> str:
    r"""Replace characters that a terminal would execute by escapes such as \x1b.

    Newlines and tabs stay. `format_json` has escaped these characters (`is_invisible`) in JSON.

    Parameters
    ----------
    text
        Text, for example with the name of a file or a note of a file in it.

    Returns
    -------
    str
        Text without control characters, marks of direction and halves of characters.

    Examples
    --------
    >>> from fecontact.inputs.texts import escape_invisible
    >>> print(escape_invisible("a\x1b[31m"))
    a\x1b[31m
    """
    # Most lines are printable, and `isprintable` is faster than a loop over their characters.
    return "\n".join(line if line.isprintable() else _escape_line(line) for line in text.split("\n"))


def escape_line(text: str) -> str:
    r"""Replace invisible characters by escapes, newlines and tabs included.

    Parameters
    ----------
    text
        Name that a user gave to a file, a study or a vehicle.

    Returns
    -------
    str
        Text of a single line.

    Examples
    --------
    >>> from fecontact.inputs.texts import escape_line
    >>> print(escape_line("a\nb"))
    a\nb
    """
    return _escape_line(text, unescaped="")


def quote_path(path: Path | str) -> str:
    r"""Path as a word of a shell command, on a single line.

    Parameters
    ----------
    path
        Path of a file or folder, such as in a message with the next command.

    Returns
    -------
    str
        The path, in quotes if a shell would change it. Bash reads `$'...'` with escapes of invisible characters.

    Examples
    --------
    >>> from fecontact.inputs.texts import quote_path
    >>> print(quote_path("out/a"), quote_path("$HOME"), quote_path("-x"), quote_path("it's\n"))
    out/a '$HOME' ./-x $'it\'s\n'
    """
    text = str(path)
    if text.startswith("-"):
        text = f"./{text}"
    if not any(map(is_invisible, text)):
        return shlex.quote(text)
    quoted = re.sub(r"[\\']", r"\\\g<0>", text)
    # half a character is a byte of a name that is not UTF-8
    quoted = re.sub("[\udc80-\udcff]", lambda half: f"\\x{ord(half[0]) - 0xDC00:02x}", quoted)
    return f"$'{escape_line(quoted)}'"


def _escape_line(line: str, *, unescaped: str = "\t") -> str:
    """Escape the invisible characters of a line, except for a few."""
    return "".join(
        character
        if character in unescaped or not is_invisible(character)
        else _SHORT_ESCAPES[character]
        if character in _SHORT_ESCAPES
        else f"\\x{ord(character):02x}"
        if character < "\x7f"
        else f"\\u{ord(character):04x}"
        if character <= "\uffff"
        else f"\\U{ord(character):08x}"
        for character in line
    )
