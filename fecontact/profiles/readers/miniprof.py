"""Profiles of the MiniProf instrument, .ban (rail) and .whl (wheel): keys, a blank line, and columns of numbers.

The columns are named by `ColumnDef` (X across, Y up, then more that a profile does not need). Some files carry offsets
(XOFF, YOFF) or an alignment that was found later (AlignDX, AlignDY, AlignDA) and is, or is not, in the points already:
where they are not zero, a user has to say.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.curve import Kind, Profile
from fecontact.profiles.readers.points import profile_from_points, read_points
from fecontact.profiles.readers.table import columns_of, in_mm, read_text
from fecontact.profiles.reading import MM, Reading, remedy

_KEY = re.compile(r"([A-Za-z][A-Za-z0-9_.]*)\s*=\s*(.*)")
_OFFSETS = ("xoff", "yoff")
_ALIGNMENT = ("aligndx", "aligndy", "alignda")
_KINDS: dict[str, Kind] = {".ban": "rail", ".whl": "wheel"}


def read_miniprof(path: str | Path, kind: Kind, reading: Reading) -> Profile:
    """Profile from a MiniProf file, as a spline through its points; a file without its keys is read as columns.

    Raises
    ------
    InputError
        The file cannot be read, or its offsets leave open where the points lie; with the option that settles it.
    """
    path = Path(path)
    text = read_text(path)
    keys, rest = _split(text)
    own = _KINDS.get(path.suffix.lower(), kind)
    if not keys:
        return read_points(path, kind=own, reading=reading)
    columns = keys.get("columndef", "X,Y")
    names = [name.strip().lower() for name in columns.split(",")]
    if "x" not in names or "y" not in names or len(set(names)) != len(names):
        raise InputError(f"{path}: ColumnDef = {columns[:60]!r}; it has to name the columns X and Y, such as X,Y,A,C")
    # MiniProf's X and Y are y and z here
    header = ",".join({"x": "y", "y": "z"}.get(name, f"_{name}") for name in names)
    table = columns_of(f"{header}\n{rest}", kind=own, what=str(path), reading=reading)
    y, z, moved = _moved(table.y, table.z, keys, path, own, reading)
    unit = reading.units or _unit(keys, path)
    y, z, done = in_mm(y, z, unit, reading)
    return profile_from_points(
        y,
        z,
        kind=own,
        name=path.stem,
        source=str(path),
        reading=reading,
        notes=("MiniProf file: X taken as y, Y as z", *moved, *done),
    )


def _split(text: str) -> tuple[dict[str, str], str]:
    """Keys in small letters, and the text after them."""
    keys: dict[str, str] = {}
    lines = text.splitlines()
    for number, line in enumerate(lines):
        if match := _KEY.fullmatch(line.strip()):
            keys[match[1].lower()] = match[2].strip().strip('"')
        elif line.strip() and not line.lstrip().startswith(("#", "!")):
            return keys, "\n".join(lines[number:])
    return keys, ""


def _unit(keys: dict[str, str], path: Path) -> str | None:
    unit = keys.get("units", keys.get("unit", "")).lower()
    if unit in MM or unit in ("", "metric"):
        return unit if unit in MM else None
    raise InputError(f"{path}: the header says Units = {unit[:40]!r}; say which: {', '.join(MM)}, with --rail-units")


def _moved(
    y: np.ndarray, z: np.ndarray, keys: dict[str, str], path: Path, kind: Kind, reading: Reading
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """The points with the offsets of the header, where it has some and they are to be added."""
    values = {key: _value(keys[key], key, path) for key in (*_OFFSETS, *_ALIGNMENT) if key in keys}
    given = {key: value for key, value in values.items() if value != 0.0}
    if not given:
        return y, z, []
    said = ", ".join(f"{key.upper()} = {value:g}" for key, value in given.items())
    if reading.offsets is None:
        raise InputError(
            f"{path}: the header has {said}, and does not say whether the points have it already;"
            f" {remedy(kind, 'offsets', 'ignore')} or {remedy(kind, 'offsets', 'add')}"
        )
    if reading.offsets == "ignore":
        return y, z, [f"{said} of the header not applied"]
    if given.get("alignda"):
        raise InputError(
            f"{path}: the header has {said}; a rotation about a point of its own cannot be added here: let MiniProf"
            f" write the aligned points, or {remedy(kind, 'offsets', 'ignore')}"
        )
    y = y + given.get("xoff", 0.0) + given.get("aligndx", 0.0)
    return y, z + given.get("yoff", 0.0) + given.get("aligndy", 0.0), [f"{said} of the header added"]


def _value(text: str, key: str, path: Path) -> float:
    try:
        value = float(text) if len(text) < 40 else float("nan")
    except ValueError:
        value = float("nan")
    if not abs(value) <= 1e6:
        raise InputError(f"{path}: {key.upper()} = {text[:40]!r} in the header; allowed: a number from -1e6 to 1e6")
    return value
