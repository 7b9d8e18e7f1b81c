"""Reader of profile files of VAMPIRE: both sides of a track or a wheelset, from its centre.

The layout follows a public reader in Matlab (read_vampire.m in CONTACT's repository): the kind, a title, two lines of
dimensions, and four columns: y and z of the left side, y and z of the right side. The left y is negative. z points up
in files of rails and down in files of wheels.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.curve import ProfileKind
from fecontact.profiles.points import ProfilePoints
from fecontact.profiles.readers.columns import ColumnSource, convert_to_mm, parse_columns, read_start, read_text
from fecontact.profiles.readers.numerals import parse_number
from fecontact.profiles.reading import Reading

_KINDS: dict[str, ProfileKind] = {"RAILPROFILE": "rail", "WHEELPROFILE": "wheel"}
# Distances of the tape circle from the back of the flange (mm): 70 mm, 2 27/32 inch, 3 1/16 inch.
_TREAD_DATUMS_MM = {"EUROPEAN": 70.0, "US1": 25.4 * (2.0 + 27.0 / 32.0), "US2": 25.4 * (3.0 + 1.0 / 16.0)}
_HEADER_LINES = 4
_LEFT, _RIGHT = "1,2", "3,4"


def is_vampire(path: Path) -> bool:
    """Whether a file begins with a word of VAMPIRE's profiles.

    Parameters
    ----------
    path
        Path of the file.

    Returns
    -------
    bool
        False for an unreadable file.
    """
    return re.match(rb"\s*(?:RAIL|WHEEL)PROFILE\b", read_start(path)) is not None


def read_vampire(path: Path, reading: Reading) -> ProfilePoints:
    """Points of a VAMPIRE file.

    They are those of the right side, unless the columns of the left side are given.

    Parameters
    ----------
    path
        Path of the file.
    reading
        Options of the file.

    Returns
    -------
    ProfilePoints
        Unchecked points in mm.

    Raises
    ------
    InputError
        The file cannot be read, or violates the format.
    """
    lines = read_text(path).lstrip().splitlines()
    kind = _KINDS[lines[0].split()[0]]
    columns = reading.columns or _RIGHT
    if columns.replace("-", "") not in (_LEFT, _RIGHT) or columns.startswith("-"):
        raise InputError(
            f"{path}: a VAMPIRE file defines its columns; leave out the option columns, or give {_LEFT} for the left"
            " side"
        )
    header, table_text = lines[:_HEADER_LINES], "\n".join(lines[_HEADER_LINES:])
    source = ColumnSource(what=str(path), kind=kind, reading=Reading(units=reading.units, columns=columns))
    table = parse_columns(table_text, source)
    is_right = columns.replace("-", "") == _RIGHT
    y = table.y if is_right else -table.y
    side, other_columns = ("right", _LEFT) if is_right else ("left", _RIGHT)
    notes = [f"VAMPIRE file: the {side} side; --{kind}-columns {other_columns} reads the other side"]
    if kind == "rail":
        highest = int(np.argmax(table.z))
        y, z = y - y[highest], table.z - table.z[highest]
        notes.append("y counts from the track centre: the origin is moved to the highest point")
    else:
        tape_circle_mm = _read_tape_circle_mm(header, path)
        y, z = y - tape_circle_mm, -table.z
        notes.append(f"y counts from the track centre: the tape circle is at y = {tape_circle_mm:g} mm of the file")
    point_source = ColumnSource(what=str(path), kind=kind, reading=reading)
    points, conversion_notes = convert_to_mm(y, z, reading.units, point_source)
    return ProfilePoints(
        points=points,
        kind=kind,
        name=path.stem,
        source=str(path),
        notes=(*notes, *table.notes, *conversion_notes),
        flipped_columns=table.columns,
    )


def _read_tape_circle_mm(header: list[str], path: Path) -> float:
    """Read the position of the tape circle (mm from the track centre) of a wheel.

    Raises
    ------
    InputError
        The header has no tread datum, or no distance of the flange backs.
    """
    words = {line.split()[0].upper(): line.split()[1:] for line in header if line.split()}
    datum = words.get("TREADDATUM", [""])
    name = datum[0].upper() if datum else ""
    datum_mm = parse_number(datum[1]) if name == "CUSTOM" and len(datum) > 1 else _TREAD_DATUMS_MM.get(name)
    backs_mm = parse_number((words.get("FLANGEBACK") or [""])[0])
    if datum_mm is None or backs_mm is None or not (np.isfinite(datum_mm) and np.isfinite(backs_mm)):
        raise InputError(
            f"{path}: the header of a VAMPIRE wheel needs a line TREADDATUM with {', '.join(_TREAD_DATUMS_MM)} or"
            " CUSTOM and a distance, and a line FLANGEBACK with the distance of the flange backs in mm; correct the"
            " header"
        )
    return 0.5 * backs_mm + datum_mm
