"""Profiles of SIMPACK, .prr (rail) and .prw (wheel): blocks of keys, and the points of a spline.

The numbers in the comments of such a file give the order in which the points are processed: points that are closer than
`point.dist.min` are left out, then they are shifted, rotated, cut at the bounds, mirrored and reversed; lengths are in
units of which `units.len.f` make a metre. z points down, and y of a wheel to its flange unless the file mirrors it. A
third column is a weight, which means nothing for a line through the points.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.curve import Kind
from fecontact.profiles.points import Points
from fecontact.profiles.readers.table import in_mm, read_text
from fecontact.profiles.reading import Reading
from fecontact.profiles.segments import Floats

_BLOCK = re.compile(r"^\s*(header|spline)\.begin\s*(?:!.*)?$", re.MULTILINE)
_KEY = re.compile(r"^\s*([a-z][a-z.]*[a-z])\s*=\s*('[^']*'|[^!\s]+)")
# The length unit in metres is 1 / units.len.f: 1000 for mm, 1 for m, 39.37 for inches.
_FACTORS = (0.5, 2e6)
_KNOWN = {
    *("version", "type", "approx.smooth", "file", "file.mtime", "comment", "point.dist.min", "shift.y", "shift.z"),
    *("rotate", "bound.y.min", "bound.y.max", "bound.z.min", "bound.z.max", "mirror.y", "mirror.z", "inversion"),
    *("units.len", "units.ang", "units.len.f", "units.ang.f", "table.nr"),
}
_MOST_DIGITS = 40


@dataclass(frozen=True, kw_only=True)
class _Keys:
    """Keys of a file, with the line that each stands in."""

    what: str
    values: dict[str, tuple[str, int]]

    def number(self, key: str, default: float) -> float:
        if key not in self.values:
            return default
        text, line = self.values[key]
        try:
            value = float(text) if len(text) <= _MOST_DIGITS else float("nan")
        except ValueError:
            value = float("nan")
        if not abs(value) <= 1e9:
            raise InputError(f"{self.what}, line {line}: {key} = {text[:60]}; allowed: a number from -1e9 to 1e9")
        return value

    def flag(self, key: str) -> bool:
        value = self.number(key, 0.0)
        if value not in (0.0, 1.0):
            line = self.values[key][1]
            raise InputError(f"{self.what}, line {line}: {key} = {value:g}; allowed: 0 and 1")
        return value == 1.0


def is_simpack(path: Path) -> bool:
    """Whether a file has SIMPACK's blocks."""
    try:
        with path.open("rb") as file:
            return _BLOCK.search(file.read(20_000).decode("latin-1")) is not None
    except (OSError, ValueError):
        return False


def read_simpack(path: Path, reading: Reading) -> Points:
    """Points of a SIMPACK file.

    Raises
    ------
    InputError
        The file cannot be read, or is not what the format allows; the message names line and key.
    """
    what = str(path)
    keys, points, lines = _parsed(read_text(path), what)
    kind: Kind = "wheel" if keys.flag("type@header") else "rail"
    if reading.columns is not None or reading.decimal is not None:
        raise InputError(f"{what}: a SIMPACK file says itself what its columns are; leave out columns and decimal sign")
    table, notes = _processed(keys, points, lines)
    factor = keys.number("units.len.f", 1000.0)
    if not _FACTORS[0] <= factor <= _FACTORS[1]:
        raise InputError(
            f"{what}, line {keys.values['units.len.f'][1]}: units.len.f = {factor:g}; the number of length units in a"
            " metre: 1000 for mm, 1 for m"
        )
    if reading.units is None:
        table = table * (1000.0 / factor) if factor != 1000.0 else table
        notes += [] if factor == 1000.0 else [f"turned into mm: the file has {factor:g} units in a metre"]
    line, done = in_mm(table[:, 0], -table[:, 1], reading.units, reading)
    said = ("SIMPACK file: z turned up", *notes, *done)
    return Points(points=line, kind=kind, name=path.stem, source=what, notes=said)


def _parsed(text: str, what: str) -> tuple[_Keys, list[list[str]], list[int]]:
    values: dict[str, tuple[str, int]] = {}
    points: list[list[str]] = []
    lines: list[int] = []
    block, inside, ended = "", False, False
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.partition("!")[0].strip() if "'" not in raw else raw.strip()
        if not line or line.startswith("!"):
            continue
        if line in ("header.begin", "spline.begin", "header.end", "spline.end"):
            block = line[:6] if line.endswith("begin") else ""
        elif line in ("point.begin", "point.end"):
            inside, ended = line == "point.begin", ended or line == "point.end"
        elif inside:
            points.append(line.split())
            lines.append(number)
        elif match := _KEY.match(line):
            # both blocks have a `type`, of the profile and of the original data
            key = f"type@{block}" if match[1] == "type" else match[1]
            if key in values:
                raise InputError(f"{what}, line {number}: {match[1]} is there twice, in line {values[key][1]} as well")
            if key.partition("@")[0] not in _KNOWN:
                raise InputError(f"{what}, line {number}: {match[1][:60]} is no key of this format that is known here")
            values[key] = match[2], number
        else:
            raise InputError(f"{what}, line {number}: {line[:60]!r} is neither a key nor a block of a SIMPACK file")
    if inside or not ended:
        raise InputError(f"{what}: the points do not stand between point.begin and point.end; the file may be cut off")
    if "type@header" not in values:
        raise InputError(f"{what}: the header has no type (0 for a rail, 1 for a wheel); the file may be damaged")
    return _Keys(what=what, values=values), points, lines


def _processed(keys: _Keys, rows: list[list[str]], lines: list[int]) -> tuple[Floats, list[str]]:
    table = np.array([_row(keys.what, row, line) for row, line in zip(rows, lines, strict=True)]).reshape(-1, 2)
    notes = []
    closest = keys.number("point.dist.min", 0.0)
    if closest > 0.0 and len(table):
        kept = [0]
        for i in range(1, len(table)):
            if np.hypot(*(table[i] - table[kept[-1]])) >= closest:
                kept.append(i)
        notes.append(f"{len(table) - len(kept)} points closer than point.dist.min left out")
        table = table[kept]
    shift = (keys.number("shift.y", 0.0), keys.number("shift.z", 0.0))
    turn = keys.number("rotate", 0.0) / (keys.number("units.ang.f", 1.0) or 1.0)
    if any(shift):
        table = table + np.array(shift)
        notes.append(f"shifted by ({shift[0]:g}, {shift[1]:g}) as the file says")
    if turn:
        c, s = np.cos(turn), np.sin(turn)
        table = table @ np.array([[c, s], [-s, c]])
        notes.append(f"rotated by {1e3 * turn:g} mrad as the file says")
    for column, axis in enumerate("yz"):
        low, high = keys.number(f"bound.{axis}.min", 1.0), keys.number(f"bound.{axis}.max", 0.0)
        # the format's own way of saying none
        if low < high:
            inside = (table[:, column] >= low) & (table[:, column] <= high)
            notes.append(f"{np.count_nonzero(~inside)} points beyond {axis} = {low:g} to {high:g} left out")
            table = table[inside]
    for column, axis in enumerate("yz"):
        if keys.flag(f"mirror.{axis}"):
            table = table * np.where(np.arange(2) == column, -1.0, 1.0)
            notes.append(f"mirrored in {axis} as the file says")
    if keys.flag("inversion"):
        table = table[::-1]
    if keys.number("approx.smooth", 0.0):
        notes.append("the file asks SIMPACK for smoothing (approx.smooth), which is SIMPACK's own; not applied here")
    return table, notes


def _row(what: str, row: list[str], line: int) -> tuple[float, float]:
    if len(row) in (2, 3) and all(len(field) <= _MOST_DIGITS and field.isascii() and "_" not in field for field in row):
        try:
            values = [float(field) for field in row]
        except ValueError:
            values = []
        if values and np.isfinite(values).all():
            return values[0], values[1]
    raise InputError(f"{what}, line {line}: {' '.join(row)[:60]!r} is not y, z and perhaps a weight as numbers")
