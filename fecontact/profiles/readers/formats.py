"""Formats of profile files.

A new format is a function and an entry in the table.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from fecontact.errors import InputError
from fecontact.files import read_toml_text
from fecontact.profiles.curve import Profile, ProfileKind, check_shape, make_arc, make_tangent_head, mirror_segments
from fecontact.profiles.origin import check_origin
from fecontact.profiles.points import LARGEST_FIELD_SIDE_DROP_MM, ProfilePoints, measure_field_side_drop_mm
from fecontact.profiles.readers.columns import (
    file_bytes,
    is_miniprof,
    is_sectioned,
    is_simpack,
    read_columns,
    read_miniprof,
    read_simpack,
    read_start,
    shorten_text,
)
from fecontact.profiles.readers.vampire import is_vampire, read_vampire
from fecontact.profiles.reading import DEFAULT_READING, Reading, suggest_mirroring, suggest_unmirrored
from fecontact.profiles.segments import Polynomial, Segment, StraightSegment, translate_segment

if TYPE_CHECKING:
    from fecontact.profiles.readers import schema


# --- Profiles from TOML files of exact segments, which is the format of the library files.

_SHOWN_ERRORS = 3
# Steps between published segments that are smaller than the second number (mm) result from the digits of their numbers,
# and are closed. Below the first number they are rounding errors of a computer. A step of 0.04 um under a contact
# causes a spike of its pressure that grows on finer nodes, with a valley of a tenth of the peak next to it. A step of
# 0.12 um (S1002 at -35 mm, on 60E1 at 6.6 mm, 50 kN) raises the peak from 1273 MPa to 1795 MPa on nodes of 3 um. Steps
# of 0.6 to 0.8 um in EN 15302 are kept: the standard has points on both sides of them.
_STEPS_CLOSED_MM = (1e-9, 2e-4)
# Number of points per segment for the checks of the size and the axes of a profile.
_POINTS_PER_SEGMENT = 17


def read_toml(path: str | Path, reading: Reading = DEFAULT_READING) -> Profile:
    """Profile from a TOML file in the format of the library files.

    Its name is the name of the file.

    Parameters
    ----------
    path
        Path of the file.
    reading
        Options of the file. Only `mirror`, `tape_circle_mm` and `tape_circle_z_mm` are used.

    Returns
    -------
    Profile
        Exact profile.

    Raises
    ------
    InputError
        The file cannot be read or does not describe a profile; the message names the key.
    """
    path = Path(path)
    try:
        text = file_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not a text file in UTF-8; save the profile as plain text") from None
    return parse_toml(text, name=path.stem, reading=reading)


def parse_toml(text: str, *, name: str, reading: Reading = DEFAULT_READING) -> Profile:
    """Profile from the text of a TOML file.

    Parameters
    ----------
    text
        Text in TOML.
    name
        Name of the profile.
    reading
        Options of the file.

    Returns
    -------
    Profile
        Exact profile.

    Raises
    ------
    InputError
        The text does not describe a profile; the message names the key.
    """
    # the import of pydantic takes longer than everything else here
    from pydantic import ValidationError

    from fecontact.profiles.readers import schema

    content = read_toml_text(text, f"profile {name}")
    try:
        file = schema.ProfileFile.model_validate(content)
    except ValidationError as error:
        details = error.errors(include_url=False, include_context=False)
        error_text = "; ".join(_explain_error(dict(e)) for e in details[:_SHOWN_ERRORS])
        count_text = f"; and {len(details) - _SHOWN_ERRORS} more" if len(details) > _SHOWN_ERRORS else ""
        raise InputError(f"profile {name}: {error_text}{count_text}") from None
    # pydantic does not catch errors that Python itself raises for a number or a list
    except (ValueError, OverflowError, RecursionError):
        raise InputError(
            f"profile {name}: a number is too long, or a list is nested too deeply; give numbers of at most 17 digits"
        ) from None

    return _build_profile(file, name, reading)


# Defaults of optional entries.
_DEFAULT_ENTRIES: dict[str, Any] = {
    **{"certainty": "", "notes": [], "doubtful_y_mm": None},
    **{"head": None, "surface": [], "body": []},
}


def parse_library_file(text: str, *, name: str) -> Profile:
    """Profile from the text of a library file, without a check against the schema.

    The tests check the library files against the schema.

    Parameters
    ----------
    text
        Text in TOML.
    name
        Name of the profile.

    Returns
    -------
    Profile
        Exact profile.
    """
    # without pydantic: its import takes a tenth of a second, which is longer than a complete small command
    return _build_profile(_make_namespace(read_toml_text(text, f"profile {name}")), name, DEFAULT_READING)


def _make_namespace(content: Any) -> Any:
    """Make objects with attributes from dictionaries, as the schema does.

    Parameters
    ----------
    content
        Dictionary, list, number or text.

    Returns
    -------
    object
        Object with the attributes of the schema.
    """
    if isinstance(content, dict):
        entries = {key: _make_namespace(value) for key, value in content.items()}
        return SimpleNamespace(**_DEFAULT_ENTRIES | entries, from_=entries.get("from"))
    if isinstance(content, list):
        values = [_make_namespace(value) for value in content]
        return tuple(values) if isinstance(values[0], float) else values
    return float(content) if isinstance(content, int) else content


def _build_profile(file: schema.ProfileFile, name: str, reading: Reading) -> Profile:
    """Build the profile of a file, with checks of its shape and its origin.

    Parameters
    ----------
    file
        Content of the file.
    name
        Name of the profile.
    reading
        Options of the file.

    Returns
    -------
    Profile
        Exact profile.

    Raises
    ------
    InputError
        The shape or the origin is implausible, or a head may be mirrored.
    """
    body = [_build_segment(s, f"profile {name}: body {i + 1}") for i, s in enumerate(file.body)]
    if file.head is not None:
        surface = make_tangent_head(
            file.head.radii, file.head.half_widths, side_one_in=file.head.side_one_in, side_to_z=file.head.side_to_z
        )
        body += mirror_segments(body)
    else:
        surface = close_small_steps(
            [_build_segment(s, f"profile {name}: surface {i + 1}") for i, s in enumerate(file.surface)]
        )
    if reading.mirror:
        surface, body = mirror_segments(surface), mirror_segments(body)
    side = -1.0 if reading.mirror else 1.0
    dy, dz = -side * (reading.tape_circle_mm or 0.0), -(reading.tape_circle_z_mm or 0.0)
    if dy or dz:
        surface, body = ([translate_segment(segment, dy, dz) for segment in chain] for chain in (surface, body))
    points = [segment.evaluate(np.linspace(0.0, 1.0, _POINTS_PER_SEGMENT)) for segment in surface]
    outline_points = np.vstack(
        [
            (points[0].y[0], points[0].z[0]),
            *(np.column_stack((segment_points.y, segment_points.z))[1:] for segment_points in points),
        ]
    )
    label = f"profile {name}"
    check_shape(*outline_points.T, kind=file.kind, what=label, is_mirrored=bool(reading.mirror))
    if (
        file.kind == "rail"
        and reading.mirror is None
        and (lower := measure_field_side_drop_mm(outline_points) or 0.0) > LARGEST_FIELD_SIDE_DROP_MM
    ):
        raise InputError(
            f"{label}: the head is {lower:.1f} mm lower on its field side than on its gauge side, y < 0; allowed: at"
            " most"
            f" {LARGEST_FIELD_SIDE_DROP_MM:g} mm; {suggest_mirroring(file.kind, mirrored=False)} if it is mirrored, or"
            f" {suggest_unmirrored(file.kind)} if it is not"
        )
    return Profile(
        name=name,
        kind=file.kind,
        segments=tuple(surface),
        source=file.source,
        certainty=file.certainty,
        outline=(*surface, *body) if body else (),
        notes=(*file.notes, *check_origin(outline_points, file.kind, reading, label)),
        doubtful_y_mm=None if file.doubtful_y_mm is None else _order_ends(side * y + dy for y in file.doubtful_y_mm),
    )


def _order_ends(ends: Iterable[float]) -> tuple[float, float]:
    """Ends of a range, the smaller end first."""
    first, last = sorted(ends)
    return first, last


def close_small_steps(surface: Sequence[Segment]) -> list[Segment]:
    """Segments without the steps that rounded digits cause.

    Segments beyond a step, as seen from y = 0, are moved vertically by the step.

    Parameters
    ----------
    surface
        Segments of a running surface.

    Returns
    -------
    list of Segment
        Segments of equal shape.
    """
    ends = [segment.evaluate(np.array([0.0, 1.0])) for segment in surface]
    steps = np.array([after.z[0] - before.z[1] for before, after in pairwise(ends)])
    smallest_step, largest_step = _STEPS_CLOSED_MM
    heights = np.concatenate(
        ([0.0], -np.cumsum(np.where((abs(steps) > smallest_step) & (abs(steps) < largest_step), steps, 0.0)))
    )
    at_origin = int(np.argmin([max(end.y[0], -end.y[1]) for end in ends]))
    displacements = heights - heights[at_origin]
    return [
        segment if dz == 0.0 else translate_segment(segment, 0.0, float(dz))
        for segment, dz in zip(surface, displacements, strict=True)
    ]


def _explain_error(error: dict[str, object]) -> str:
    """Explain an error of the schema, with the key and the value.

    Parameters
    ----------
    error
        Error of pydantic.

    Returns
    -------
    str
        Part of a message.
    """
    location = error["loc"]
    assert isinstance(location, tuple)
    location_text = ".".join(str(key) for key in location) or "file"
    input_value = error["input"]
    # Python cannot print integers of thousands of digits
    is_short = isinstance(input_value, str | float) or (isinstance(input_value, int) and abs(input_value) < 10**60)
    return f"{shorten_text(location_text)}: {shorten_text(error['msg'])}" + (
        f" (given: {shorten_text(repr(input_value))})" if is_short else ""
    )


def _build_segment(entry: schema.Entry, label: str) -> Segment:
    if entry.type == "line":
        return StraightSegment(start=entry.from_, end=entry.to)
    if entry.type == "polynomial":
        return _build_polynomial(entry, label)
    return make_arc(entry.from_, entry.to, centre=entry.centre, radius=entry.radius, label=label)


def _build_polynomial(entry: schema.PolynomialEntry, label: str) -> Polynomial:
    """Build a polynomial segment, and check that its values are finite.

    Parameters
    ----------
    entry
        Entry of a file.
    label
        Subject of the message.

    Returns
    -------
    Polynomial
        Segment.

    Raises
    ------
    InputError
        The values exceed the range of numbers.
    """
    polynomial = Polynomial(coefficients=tuple(entry.coefficients), y_from=entry.y_from, y_to=entry.y_to)
    try:
        polynomial.evaluate(np.array([0.0, 1.0]))
    except OverflowError:
        raise InputError(
            f"{label}: the polynomial between y = {entry.y_from:g} and {entry.y_to:g} mm with coefficients up to "
            f"{max(map(abs, entry.coefficients)):g} exceeds the range of numbers; check the exponents of the"
            " coefficients"
        ) from None
    return polynomial


# --- Formats of profile files: a new format is one function and one entry in the table.

# Function that reads a file. Its `kind` is the wanted kind. A file that states its kind is read with that kind, and the
# caller compares both.
Reader: TypeAlias = Callable[[Path, ProfileKind, Reading], Profile | ProfilePoints]


def _read_text_file(path: Path, kind: ProfileKind, reading: Reading) -> ProfilePoints:
    """Read columns of numbers, or a special format if the content shows it."""
    _refuse_foreign_format(path)
    if is_sectioned(path) or is_miniprof(path):
        return read_miniprof(path, kind, reading)
    if reading.section is not None:
        raise InputError(
            f"{path}: profile {reading.section:g} is wanted, but the file has no numbered profiles; leave out"
            f" --{kind}-section (section in [{kind}_file])"
        )
    if is_vampire(path):
        return read_vampire(path, reading)
    if is_simpack(path):
        return read_simpack(path, reading)
    return read_columns(path, kind, reading)


# First bytes of formats that are not read. They have numbers or columns that are no points of a profile.
_FOREIGN_FORMATS: dict[str, bytes] = {
    "a drawing of AutoCAD (DXF)": rb"\s*(?:999\s[^\n]*\n\s*)*0\s*\r?\n\s*SECTION",
    "a drawing of AutoCAD (DWG)": rb"AC10\d\d",
    "a drawing in STEP": rb"\s*ISO-10303-21",
    "an HDF5 file, such as RCM-DX,": rb"\x89HDF",
    "a workbook of a spreadsheet": rb"PK\x03\x04|\xd0\xcf\x11\xe0",
    "a PDF document": rb"%PDF-",
    "an XML document": rb"(?:\xef\xbb\xbf)?\s*<[?!a-zA-Z]",
    "a JSON document": rb"(?:\xef\xbb\xbf)?\s*(?:\{|\[\s*[\[{])",
}


def _refuse_foreign_format(path: Path) -> None:
    """Refuse a file of a format that has no reader."""
    start = read_start(path)
    for name, pattern in _FOREIGN_FORMATS.items():
        if re.match(pattern, start):
            raise InputError(
                f"{path} is {name}, which is not a format that fecontact reads; save the points of the running surface"
                " as text with the columns y and z in mm"
            )


def _refuse_slices(path: Path, kind: ProfileKind, reading: Reading) -> Profile:
    """Refuse a file of slices."""
    raise InputError(
        f"{path}: the profile of a file of slices ({path.suffix.lower()}) changes along the track or around the wheel,"
        " but"
        " in fecontact a rail is a prism and a wheel is round; give the file of a single slice"
    )


# Measuring devices have special endings for their text files, so other endings are read as text too.
DEFAULT_READER: Reader = _read_text_file

# Readers by the ending of the file in lower case.
READERS: dict[str, Reader] = {
    ".toml": lambda path, kind, reading: read_toml(path, reading),
    ".txt": _read_text_file,
    ".csv": _read_text_file,
    ".dat": _read_text_file,
    # different programs use these endings for columns too: the content decides
    ".prr": _read_text_file,
    ".prw": _read_text_file,
    ".ban": read_miniprof,
    ".whl": read_miniprof,
    ".slcs": _refuse_slices,
    ".slcw": _refuse_slices,
}


def find_reader(path: Path) -> Reader:
    """Reader of a file by its ending, in any case of letters."""
    return READERS.get(path.suffix.lower(), DEFAULT_READER)
