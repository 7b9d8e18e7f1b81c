"""The formats of profile files: a new one is one function and one entry in the table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from fecontact.errors import InputError
from fecontact.files import toml_content
from fecontact.profiles.curve import Kind, Profile, check_shape, make_arc, make_tangent_head, mirror_segments
from fecontact.profiles.origin import check_origin
from fecontact.profiles.points import LARGEST_FIELD_SIDE_DROP_MM, Points, measure_field_side_drop_mm
from fecontact.profiles.readers.columns import (
    file_bytes,
    is_miniprof,
    is_simpack,
    read_columns,
    read_miniprof,
    read_simpack,
    shorten_text,
)
from fecontact.profiles.reading import PLAIN, Reading, suggest_mirroring, suggest_unmirrored
from fecontact.profiles.segments import Line, Polynomial, Segment, translate_segment

if TYPE_CHECKING:
    from fecontact.profiles.readers import schema


# --- Profiles from TOML files of exact segments, the form of the library's own files.

_SHOWN_ERRORS = 3
# Steps between published segments that are smaller than this (mm) come from the digits of their numbers and are closed;
# below the lesser one they are the rounding of a computer. A step of 0.04 um under a contact is a spike of its pressure
# that becomes higher the finer the nodes are, with a valley beside it of a tenth of the peak; one of 0.12 um (S1002 at
# -35 mm, on 60E1 at 6.6 mm, 50 kN) makes 1795 MPa of 1273 MPa on nodes of 3 um. Steps of 0.6 to 0.8 um in EN 15302
# stay: the standard has points on both sides of them.
_STEPS_CLOSED_MM = (1e-9, 2e-4)
# Points of each segment by which the size and the axes of a line are judged.
_POINTS_PER_SEGMENT = 17


def read_toml(path: str | Path, reading: Reading = PLAIN) -> Profile:
    """Profile from a TOML file of the form of the library files; its name is the file's.

    Of the reading `mirror`, `tape_circle_mm` and `tape_circle_z_mm` count: exact segments need nothing else.

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


def parse_toml(text: str, *, name: str, reading: Reading = PLAIN) -> Profile:
    """Profile from the text of a TOML file.

    Raises
    ------
    InputError
        The text does not describe a profile; the message names the key.
    """
    # pydantic takes longer to import than everything else here
    from pydantic import ValidationError

    from fecontact.profiles.readers import schema

    content = toml_content(text, f"profile {name}")
    try:
        file = schema.ProfileFile.model_validate(content)
    except ValidationError as error:
        wrong = error.errors(include_url=False, include_context=False)
        told = "; ".join(_explain_error(dict(e)) for e in wrong[:_SHOWN_ERRORS])
        more = f"; and {len(wrong) - _SHOWN_ERRORS} more" if len(wrong) > _SHOWN_ERRORS else ""
        raise InputError(f"profile {name}: {told}{more}") from None
    # pydantic passes on what a number or a list of a file does to Python itself
    except (ValueError, OverflowError, RecursionError):
        raise InputError(
            f"profile {name}: a number is too long, or a list too deep, for a profile; numbers have 17 digits at most"
        ) from None

    return _build_profile(file, name, reading)


# What a file may leave out.
_DEFAULT_ENTRIES: dict[str, Any] = {"certainty": "", "notes": [], "head": None, "surface": [], "body": []}


def parse_library_file(text: str, *, name: str) -> Profile:
    """Profile from the text of a file of the library, which the tests hold against the schema."""
    # without pydantic: its import takes a tenth of a second, longer than all of a small command
    return _build_profile(_make_namespace(toml_content(text, f"profile {name}")), name, PLAIN)


def _make_namespace(given: Any) -> Any:
    if isinstance(given, dict):
        entries = {key: _make_namespace(one) for key, one in given.items()}
        return SimpleNamespace(**_DEFAULT_ENTRIES | entries, from_=entries.get("from"))
    if isinstance(given, list):
        made = [_make_namespace(one) for one in given]
        return tuple(made) if isinstance(made[0], float) else made
    return float(given) if isinstance(given, int) else given


def _build_profile(file: schema.ProfileFile, name: str, reading: Reading) -> Profile:
    body = [_build_segment(s, f"profile {name}: body {i + 1}") for i, s in enumerate(file.body)]
    if file.head is not None:
        surface = make_tangent_head(
            file.head.radii, file.head.half_widths, side_one_in=file.head.side_one_in, side_to_z=file.head.side_to_z
        )
        body += mirror_segments(body)
    else:
        surface = joined([_build_segment(s, f"profile {name}: surface {i + 1}") for i, s in enumerate(file.surface)])
    if reading.mirror:
        surface, body = mirror_segments(surface), mirror_segments(body)
    side = -1.0 if reading.mirror else 1.0
    dy, dz = -side * (reading.tape_circle_mm or 0.0), -(reading.tape_circle_z_mm or 0.0)
    if dy or dz:
        surface, body = ([translate_segment(segment, dy, dz) for segment in chain] for chain in (surface, body))
    points = [segment.evaluate(np.linspace(0.0, 1.0, _POINTS_PER_SEGMENT)) for segment in surface]
    line = np.vstack([(points[0].y[0], points[0].z[0]), *(np.column_stack((one.y, one.z))[1:] for one in points)])
    what = f"profile {name}"
    check_shape(*line.T, kind=file.kind, what=what, is_mirrored=bool(reading.mirror))
    if (
        file.kind == "rail"
        and reading.mirror is None
        and (lower := measure_field_side_drop_mm(line) or 0.0) > LARGEST_FIELD_SIDE_DROP_MM
    ):
        raise InputError(
            f"{what}: the head is {lower:.1f} mm lower on its field side than on its gauge side, y < 0; allowed:"
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
        notes=(*file.notes, *check_origin(line, file.kind, reading, what)),
    )


def joined(surface: Sequence[Segment]) -> list[Segment]:
    """Segments without steps of rounded digits: those beyond one, seen from y = 0, are moved up or down by it."""
    ends = [segment.evaluate(np.array([0.0, 1.0])) for segment in surface]
    steps = np.array([after.z[0] - before.z[1] for before, after in pairwise(ends)])
    least, most = _STEPS_CLOSED_MM
    raised = np.concatenate(([0.0], -np.cumsum(np.where((abs(steps) > least) & (abs(steps) < most), steps, 0.0))))
    at_origin = int(np.argmin([max(end.y[0], -end.y[1]) for end in ends]))
    moves = raised - raised[at_origin]
    return [
        segment if dz == 0.0 else translate_segment(segment, 0.0, float(dz))
        for segment, dz in zip(surface, moves, strict=True)
    ]


def _explain_error(error: dict[str, object]) -> str:
    location = error["loc"]
    assert isinstance(location, tuple)
    where = ".".join(str(part) for part in location) or "file"
    given = error["input"]
    # Python does not write whole numbers of thousands of digits
    short = isinstance(given, str | float) or (isinstance(given, int) and abs(given) < 10**60)
    return f"{shorten_text(where)}: {shorten_text(error['msg'])}" + (
        f" (given: {shorten_text(repr(given))})" if short else ""
    )


def _build_segment(entry: schema.Entry, what: str) -> Segment:
    if entry.type == "line":
        return Line(start=entry.from_, end=entry.to)
    if entry.type == "polynomial":
        return _build_polynomial(entry, what)
    return make_arc(entry.from_, entry.to, centre=entry.centre, radius=entry.radius, what=what)


def _build_polynomial(entry: schema.PolynomialEntry, what: str) -> Polynomial:
    polynomial = Polynomial(coefficients=tuple(entry.coefficients), y_from=entry.y_from, y_to=entry.y_to)
    try:
        polynomial.evaluate(np.array([0.0, 1.0]))
    except OverflowError:
        raise InputError(
            f"{what}: the polynomial between y = {entry.y_from:g} and {entry.y_to:g} mm with coefficients up to "
            f"{max(map(abs, entry.coefficients)):g} exceeds the range of numbers; check their powers of ten"
        ) from None
    return polynomial


# --- The formats of profile files: a new one is one function and one entry in the table.

# The kind is the one that is wanted. A file that says its own kind is read as that; whoever resolves it compares.
Reader: TypeAlias = Callable[[Path, Kind, Reading], Profile | Points]


def _read_text_file(path: Path, kind: Kind, reading: Reading) -> Points:
    """Columns of numbers, unless the content says that it is something else under another ending."""
    if is_simpack(path):
        return read_simpack(path, reading)
    return read_miniprof(path, kind, reading) if is_miniprof(path) else read_columns(path, kind, reading)


def _refuse_slices(path: Path, kind: Kind, reading: Reading) -> Profile:
    raise InputError(
        f"{path}: a file of slices ({path.suffix.lower()}) is a profile that changes along the track or around the"
        " wheel; fecontact takes a rail as a prism and a wheel as a body of revolution: give the file of one slice"
    )


# Measuring devices give their text files endings of their own, so what is not in the table is read as text too.
DEFAULT_READER: Reader = _read_text_file

# By the ending of the file in small letters.
READERS: dict[str, Reader] = {
    ".toml": lambda path, kind, reading: read_toml(path, reading),
    ".txt": _read_text_file,
    ".csv": _read_text_file,
    ".dat": _read_text_file,
    # other programs give their columns these endings as well: the content decides
    ".prr": _read_text_file,
    ".prw": _read_text_file,
    ".ban": read_miniprof,
    ".whl": read_miniprof,
    ".slcs": _refuse_slices,
    ".slcw": _refuse_slices,
}


def reader_of(path: Path) -> Reader:
    """Reader of a file by its ending, in any case of letters."""
    return READERS.get(path.suffix.lower(), DEFAULT_READER)
