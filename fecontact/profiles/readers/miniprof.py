"""Profiles of the MiniProf instrument, .ban (rail) and .whl (wheel): lines of a header, and columns of numbers.

The columns are named by `ColumnDef` (X across, Y into the depth of the body, then angle, curvature and more that a
profile does not need). Files of the instrument itself (MiniProf for Windows 2.43 and MiniProf 2020, in the test bank of
CONTACT by Vtech CMCC, testbank/profiles: left-wheel-v1-pre-dry.whl, Car7216_0001r.whl, left-roller-v1-pre-dry.ban) have

- a wheel's X from the back of the flange to the field side, with the tape circle at `WheelDiameterTaperline` (70 mm),
  its Y growing towards the tip of the flange, its points from the field side to the flange;
- a rail's X to the field side, zero near the middle, its Y growing downwards, into the head;
- lengths in mm; `Xoffset` and `Yoffset`, which CONTACT adds to the points; a blank line before the points, or none.

Files that other programs write under the same endings have Y upwards, as avg_low2.ban there. The shape of the line says
which; the side of a rail it does not say. Where offsets, or an alignment that was found later (AlignDX, AlignDY,
AlignDA), are not zero, a user has to say whether the points have them already.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.curve import Kind
from fecontact.profiles.points import Points
from fecontact.profiles.readers.table import Source, columns_of, in_mm, read_columns, read_text
from fecontact.profiles.reading import MM, Reading
from fecontact.profiles.segments import Floats

_KEY = re.compile(r"([A-Za-z][A-Za-z0-9_. ]*?)\s*=\s*(.*)")
# The first lines of files with a header in words instead of keys.
_TITLE = re.compile(r"#\s*MINI\w*PROF", re.IGNORECASE)
_OFFSETS = ("xoffset", "yoffset", "xoff", "yoff")
_ALIGNMENT = ("aligndx", "aligndy", "alignda")
_KINDS: dict[str, Kind] = {".ban": "rail", ".whl": "wheel"}
_TAPERLINE = "wheeldiametertaperline"
# Where the tip of a flange lies over the back of the flange (mm): 15.5 mm on the S1002.
_TIP_OVER_BACK_MM = (5.0, 30.0)
_TAPE_CIRCLE_MM = (40.0, 100.0)


def read_miniprof(path: Path, kind: Kind, reading: Reading) -> Points:
    """Points of a MiniProf file; a file without its keys is read as columns.

    Raises
    ------
    InputError
        The file cannot be read, or its offsets leave open where the points lie; with the option that settles it.
    """
    keys, rest = _split(read_text(path))
    own = _KINDS.get(path.suffix.lower(), kind)
    if not keys:
        return read_columns(path, own, reading)
    columns = keys.get("columndef", "X,Y,*")
    names = [name.strip().lower() for name in columns.split(",")]
    if "x" not in names or "y" not in names or len(set(names)) != len(names):
        raise InputError(f"{path}: ColumnDef = {columns[:60]!r}; it has to name the columns X and Y, such as X,Y,A,C")
    # X is y here, and Y is z until its sign is known; columns that are not named come last
    count = next((len(_fields(line)) for line in rest.splitlines() if line.strip()), len(names))
    named = [name for name in names if name != "*"]
    named += [f"column{k}" for k in range(len(named), count if "*" in names else 0)]
    header = ",".join({"x": "y", "y": "z"}.get(name, f"_{name}") for name in named)
    source = Source(what=str(path), kind=own, reading=reading)
    table = columns_of(f"{header}\n{rest}", source)
    y, z, moved = _moved(table.y, table.z, keys, source)
    points, done = in_mm(y, z, reading.units or _unit(keys, source), reading)
    points, turned = _upwards(points, own)
    points, placed = _from_tape_circle(points, keys, source)
    said = ("MiniProf file: X taken as y, positive to the field side", *moved, *done, *turned, *placed)
    return Points(points=points, kind=own, name=path.stem, source=str(path), notes=said)


def _upwards(points: Floats, kind: Kind) -> tuple[Floats, list[str]]:
    """z upwards, by the shape of the line: a head lies above its ends, the tip of a flange below the tread."""
    if len(points) < 3:
        return points, []
    y, z = points.T
    if kind == "rail":
        middle = np.abs(y - 0.5 * (y.min() + y.max())) <= 0.2 * np.ptp(y)
        down = bool(middle.any()) and float(np.median(z[middle])) < 0.5 * (float(z[0]) + float(z[-1]))
    else:
        tread = float(np.median(z))
        down = float(z.max()) - tread > max(10.0, tread - float(z.min()))
    if down:
        return points * (1.0, -1.0), ["its Y grows into the body: z is -Y"]
    return points, ["its Y grows upwards: z is Y"]


def _from_tape_circle(points: Floats, keys: dict[str, str], source: Source) -> tuple[Floats, list[str]]:
    """Points with y of a wheel from its tape circle, where the file has it from the back of the flange."""
    tip = float(points[np.argmin(points[:, 1]), 0]) if points.size else 0.0
    low, high = _TIP_OVER_BACK_MM
    if source.kind == "rail" or not low <= tip <= high:
        return points, []
    at = _value(keys.get(_TAPERLINE, ""), "WheelDiameterTaperline", source)
    if not _TAPE_CIRCLE_MM[0] <= at <= _TAPE_CIRCLE_MM[1]:
        raise InputError(
            f"{source.what}: the tip of the flange lies at X = {tip:.1f} mm, so X begins at the back of the flange, and"
            f" the header has WheelDiameterTaperline = {keys.get(_TAPERLINE, '')[:40]!r}; write where the tape circle"
            f" is, {_TAPE_CIRCLE_MM[0]:g} to {_TAPE_CIRCLE_MM[1]:g} mm from there: the line WheelDiameterTaperline=70"
            " at the top of the file for the usual 70 mm"
        )
    said = f"X from the back of the flange: the tape circle at WheelDiameterTaperline = {at:g} mm is y = 0"
    return points - (at, 0.0), [said]


def _split(text: str) -> tuple[dict[str, str], str]:
    """Keys in small letters, and the text after them; no keys where the text has no header of a MiniProf file."""
    keys: dict[str, str] = {}
    lines = text.splitlines()
    titled = bool(lines) and _TITLE.match(lines[0]) is not None
    for number, line in enumerate(lines):
        line = line.strip()
        if line.startswith('"'):
            # a line that is quoted as a whole
            line = line.strip('"')
        if match := _KEY.fullmatch(line):
            # in quotes, or up to a remark in quotes
            keys[match[1].lower()] = match[2].removeprefix('"').partition('"')[0].strip()
        elif (line := _without_remark(line)) and not line.startswith(("#", "!")) and (not titled or _is_numbers(line)):
            return (keys or ({"columndef": "X,Y,*"} if titled else {})), "\n".join(map(_without_remark, lines[number:]))
    return keys, ""


def _without_remark(line: str) -> str:
    """A line without what it says in quotes behind its values; one that begins with a quote as it is."""
    return line if line.lstrip().startswith('"') else line.partition('"')[0]


def _is_numbers(line: str) -> bool:
    try:
        return len([float(field) for field in _fields(line)]) > 1
    except ValueError:
        return False


def _fields(line: str) -> list[str]:
    return re.split(r"\s*[,;]\s*|\s+", line.strip())


def _unit(keys: dict[str, str], source: Source) -> str | None:
    unit = keys.get("units", keys.get("unit", "")).lower()
    if unit in MM or unit in ("", "metric"):
        return unit if unit in MM else None
    raise InputError(
        f"{source.what}: the header says Units = {unit[:40]!r}; known are {', '.join(MM)}:"
        f" {source.remedy('units', 'mm')}"
    )


def _moved(y: Floats, z: Floats, keys: dict[str, str], source: Source) -> tuple[Floats, Floats, list[str]]:
    """The points with the offsets of the header, where it has some and they are to be added."""
    values = {key: _value(keys[key], key, source) for key in (*_OFFSETS, *_ALIGNMENT) if key in keys}
    given = {key: value for key, value in values.items() if value != 0.0}
    if not given:
        return y, z, []
    said = ", ".join(f"{key.upper()} = {value:g}" for key, value in given.items())
    if source.reading.offsets is None:
        raise InputError(
            f"{source.what}: the header has {said}, and does not say whether the points have it already;"
            f" {source.remedy('offsets', 'ignore')} or {source.remedy('offsets', 'add')}"
        )
    if source.reading.offsets == "ignore":
        return y, z, [f"{said} of the header not applied"]
    if given.get("alignda"):
        raise InputError(
            f"{source.what}: the header has {said}; a rotation about a point of its own cannot be added here: let"
            f" MiniProf write the aligned points, or {source.remedy('offsets', 'ignore')}"
        )
    along, up = (
        sum(value for key, value in given.items() if key.startswith((f"{axis}off", f"alignd{axis}"))) for axis in "xy"
    )
    return y + along, z + up, [f"{said} of the header added"]


def _value(text: str, key: str, source: Source) -> float:
    if not text:
        # a key of a form that was not filled in
        return 0.0
    try:
        value = float(text) if len(text) < 40 else float("nan")
    except ValueError:
        value = float("nan")
    if not abs(value) <= 1e6:
        raise InputError(
            f"{source.what}: {key.upper()} = {text[:40]!r} in the header; allowed: a number from -1e6 to 1e6"
        )
    return value
