"""Profile from a user's text: a library name, a short form such as circle:300, or a file."""

from __future__ import annotations

import hashlib
import os
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from pathlib import Path

from fecontact.errors import InputError, check_positive
from fecontact.files import path_exists
from fecontact.profiles.curve import (
    Profile,
    ProfileKind,
    make_circular_rail_head,
    make_cylinder_wheel,
    make_two_arc_rail_head,
)
from fecontact.profiles.library import (
    ArrayProfile,
    can_be_file,
    find_library_name,
    is_library_name,
    list_names,
    load_library_profile,
    profile_file,
)
from fecontact.profiles.origin import has_flange_shape
from fecontact.profiles.points import ProfilePoints
from fecontact.profiles.readers.columns import ColumnSource, file_bytes, find_stated_kind, parse_points, read_header
from fecontact.profiles.readers.formats import DEFAULT_READER, find_reader
from fecontact.profiles.readers.instrument_header import InstrumentHeader
from fecontact.profiles.reading import (
    ARCS_PREFIX,
    CIRCLE_PREFIX,
    CYLINDER_PREFIX,
    DEFAULT_READING,
    Reading,
    has_no_gauge_face,
    is_short_form,
)
from fecontact.profiles.recognition import fit_profile
from fecontact.profiles.remedies import read_or_explain
from fecontact.profiles.suspicions import SuspiciousProfileError


class WrongKindError(SuspiciousProfileError):
    """Error for a wheel in place of a rail, or the reverse."""


# Unicode categories of control characters, format characters, and separators of lines and paragraphs.
_HIDDEN_CATEGORIES = ("Cc", "Cf", "Zl", "Zp")
_NO_RADIUS = " has no number after the colon; give a radius in mm, such as {}"
_NO_ARCS = (
    ": give the radii on the field side and on the gauge side, and the distance of the junction from the crown, in mm,"
    " such as arcs:300/80@2.5; for more radii give a file with [head], such as fecontact/profiles/data/A75.toml"
)


@dataclass(frozen=True, kw_only=True)
class WheelProfile:
    """Wheel from a text of the command line.

    Attributes
    ----------
    profile
        Profile across the tread.
    rolling_radius_mm
        Radius at the tape circle (y = 0) in mm, or None if the text has no radius.
    """

    profile: Profile
    rolling_radius_mm: float | None = None


def resolve_rail(spec: str, reading: Reading = DEFAULT_READING) -> Profile:
    """Rail from a text of the command line.

    Measured points in a file are smoothed (`profiles.smoothing`).

    Parameters
    ----------
    spec
        Library name, `circle:R`, `arcs:R/R@D` (mm), or path of a profile file.
    reading
        Options of the file.

    Returns
    -------
    Profile
        Rail.

    Raises
    ------
    InputError
        The name or file does not exist, or the file does not contain a rail.

    Examples
    --------
    >>> from fecontact.profiles.resolve import resolve_rail
    >>> round(1.0 / float(resolve_rail("circle:300").curvature(0.0)))
    300
    """
    if spec.lower().startswith(CIRCLE_PREFIX):
        return make_circular_rail_head(*_parse_numbers(spec, r"circle:([^:]*)", _NO_RADIUS.format("circle:300")))
    if spec.lower().startswith(ARCS_PREFIX):
        return make_two_arc_rail_head(*_parse_numbers(spec, r"arcs:([^/@]+)/([^/@]+)@([^/@]+)", _NO_ARCS))
    if spec.lower().startswith(CYLINDER_PREFIX):
        raise InputError(f"{spec!r} is a wheel, but a rail is needed; give a rail, such as circle:R or arcs:R/R@D")
    return _resolve(spec, "rail", reading)


def resolve_wheel(spec: str, reading: Reading = DEFAULT_READING) -> WheelProfile:
    """Wheel from a text of the command line.

    Parameters
    ----------
    spec
        Library name, `cylinder:R` (mm), or path of a profile file.
    reading
        Options of the file.

    Returns
    -------
    WheelProfile
        Wheel, with its radius if the text has it.

    Raises
    ------
    InputError
        The name or file does not exist, or the file does not contain a wheel.

    Examples
    --------
    >>> from fecontact.profiles.resolve import resolve_wheel
    >>> resolve_wheel("cylinder:460").rolling_radius_mm
    460.0
    """
    if spec.lower().startswith(CYLINDER_PREFIX):
        radius, *_ = _parse_numbers(spec, r"cylinder:([^:]*)", _NO_RADIUS.format("cylinder:460"))
        check_positive("radius of the wheel", radius, "mm", "for example cylinder:460")
        return WheelProfile(profile=make_cylinder_wheel(), rolling_radius_mm=radius)
    if has_no_gauge_face(spec):
        raise InputError(f"{spec!r} is a rail, but a wheel is needed; give a wheel, such as cylinder:R")
    return WheelProfile(profile=_resolve(spec, "wheel", reading))


# Rounding and wear between two measurements are smaller.
_RADIUS_TOLERANCE_MM = 1.0
# Instruments measure the gauge within some tenths of a millimetre.
_GAUGE_TOLERANCE_MM = 1.0


def header_of_file(spec: str) -> InstrumentHeader | None:
    """Header of an instrument in a profile file; None without a file or such a header.

    Parameters
    ----------
    spec
        Profile of a case: name, file or short form.

    Returns
    -------
    InstrumentHeader or None
        Entries of the header. Its `columns` are a mapping for tables.
    """
    if (path := profile_file(spec)) is None:
        return None
    state = path.stat()
    return _read_header_once(path, (state.st_dev, state.st_ino, state.st_mtime_ns, state.st_size))


@lru_cache(maxsize=64)
def _read_header_once(path: Path, state: tuple[int, ...]) -> InstrumentHeader | None:
    """Header of a file in this state; each case and each placement needs it."""
    return read_header(path)


def radius_of_file_mm(spec: str) -> float | None:
    """Rolling radius (mm) in the header of a wheel file; None without a file or such a header.

    Parameters
    ----------
    spec
        Wheel of a case: name, file or short form.

    Returns
    -------
    float or None
        Radius in mm.
    """
    header = header_of_file(spec)
    return None if header is None or find_stated_kind(Path(spec)) == "rail" else header.rolling_radius_mm


def gauge_note(spec: str, gauge_mm: float) -> str:
    """Contradiction between the gauge of a track (mm) and the header of a rail file; empty if there is none.

    Parameters
    ----------
    spec
        Rail of a case: name, file or short form.
    gauge_mm
        Gauge of the case in mm.

    Returns
    -------
    str
        Note for the user.
    """
    header = header_of_file(spec)
    header_mm = None if header is None else header.gauge_mm
    if header_mm is None or abs(header_mm - gauge_mm) <= _GAUGE_TOLERANCE_MM:
        return ""
    return (
        f"the gauge is {gauge_mm:g} mm, but {header_mm:g} mm in the header of {Path(spec).name}; --gauge-mm"
        f" {header_mm:g} takes it"
    )


def radius_note(spec: str, radius_mm: float) -> str:
    """Contradiction between a rolling radius (mm) and the header of a wheel file; empty if there is none.

    Parameters
    ----------
    spec
        Wheel of a case: name, file or short form.
    radius_mm
        Rolling radius of the case in mm.

    Returns
    -------
    str
        Note for the user.
    """
    header_mm = radius_of_file_mm(spec)
    if header_mm is None or abs(header_mm - radius_mm) <= _RADIUS_TOLERANCE_MM:
        return ""
    return f"the given rolling radius is {radius_mm:g} mm, but {header_mm:g} mm in the header of {Path(spec).name}"


# Options that a profile of exact segments uses. It has no points to scale, select or smooth.
_EXACT_FILE_OPTIONS = ("mirror", "tape_circle_mm", "tape_circle_z_mm")


def select_used_options(spec: str, reading: Reading) -> Reading:
    """Options that a profile uses, with defaults for all unused options.

    A name of the library or a short form uses no option. A TOML file uses the options of an exact profile. All other
    files use all options.

    Parameters
    ----------
    spec
        Text of the command line, or a profile from arrays.
    reading
        Options of the file.

    Returns
    -------
    Reading
        Used options.
    """
    if not isinstance(spec, ArrayProfile):
        if is_library_name(spec) or is_short_form(spec):
            return DEFAULT_READING
        if Path(spec).suffix.lower() == ".toml":
            return replace(DEFAULT_READING, **{name: getattr(reading, name) for name in _EXACT_FILE_OPTIONS})
    return reading


def refuse_unused_reading(kind: ProfileKind, specs: Iterable[str], reading: Reading) -> None:
    """Refuse options that no profile uses.

    Parameters
    ----------
    kind
        `rail` or `wheel`.
    specs
        Texts of the command line.
    reading
        Options of the files.

    Raises
    ------
    InputError
        An option is unused; the message has its value.
    """
    specs = tuple(specs)
    for option in fields(Reading):
        name, value = option.name, getattr(reading, option.name)
        if value != option.default and all(
            getattr(select_used_options(spec, reading), name) != value for spec in specs
        ):
            exact = "a TOML file of exact segments" if specs[0].lower().endswith(".toml") else "an exact profile"
            raise InputError(
                f"{name} of the {kind} file is {value!r}, but {specs[0]!r} is {exact}, which does not use it; leave"
                f" out --{kind}-{name.replace('_', '-')} ({name} in [{kind}_file]), or give the {kind} as a file of"
                " points"
            )


def _parse_numbers(spec: str, pattern: str, complaint: str) -> list[float]:
    """Parse the numbers of a short form.

    Parameters
    ----------
    spec
        Text of the command line.
    pattern
        Regular expression with a group for each number.
    complaint
        End of the message.

    Returns
    -------
    list of float
        Numbers.

    Raises
    ------
    InputError
        The text does not match the pattern.
    """
    match = re.fullmatch(pattern, spec.lower())
    try:
        if match:
            return [float(number) for number in match.groups()]
    except ValueError:
        pass
    raise InputError(f"{spec!r}{complaint}")


def _read_file(spec: str, kind: ProfileKind, reading: Reading) -> Profile:
    """Read a file, once per content.

    The smoothing of a measurement takes half a second.
    """
    # the reader of a missing file raises the error
    content = hashlib.sha256(file_bytes(Path(spec))).hexdigest() if os.path.exists(spec) else ""
    return _read_once(spec, kind, reading, content)


@lru_cache(maxsize=16)
def _read_once(spec: str, kind: ProfileKind, reading: Reading, content: str) -> Profile:
    def read(changed: Reading) -> Profile:
        content_or_points = read_profile_content(spec, kind, changed)
        return content_or_points if isinstance(content_or_points, Profile) else fit_profile(content_or_points, changed)

    return read_or_explain(read, reading, kind)


def read_profile_content(spec: str, kind: ProfileKind, reading: Reading) -> Profile | ProfilePoints:
    """Content of a file: a profile of exact segments, or unchecked points.

    Parameters
    ----------
    spec
        Path of the file.
    kind
        `rail` or `wheel`.
    reading
        Options of the file.

    Returns
    -------
    Profile or ProfilePoints
        Content.

    Raises
    ------
    InputError
        The file cannot be read, or contains the other kind of body. Or its name has characters that move a cursor or
        turn a text, which terminals, tables and pages would execute.
    """
    path = Path(spec)
    if any(unicodedata.category(sign) in _HIDDEN_CATEGORIES for sign in path.name):
        raise InputError(f"{spec!r}: its name has invisible characters, such as a line break; rename the file")
    if any(unicodedata.category(sign) == "Cs" for sign in path.name):
        raise InputError(f"{spec!r}: its name is not UTF-8; rename the file")
    # the reader would ask for options of the wrong kind
    _check_kind(find_stated_kind(path) or kind, spec, kind)
    content = find_reader(path)(path, kind, reading)
    _check_kind(content.kind, spec, kind)
    return content


def looks_like_wheel(spec: str, reading: Reading) -> bool:
    """Whether the points of a file have a flange, in any direction of the axes.

    Parameters
    ----------
    spec
        Path of a file.
    reading
        Options of the wheel file.

    Returns
    -------
    bool
        False for a file that cannot be read, and for a profile of exact segments.
    """
    try:
        content = read_profile_content(spec, "wheel", reading)
    except InputError:
        return False
    return isinstance(content, ProfilePoints) and len(content.points) > 0 and has_flange_shape(content.points)


@lru_cache(maxsize=16)
def _read_given_profile(given_profile: ArrayProfile, kind: ProfileKind, reading: Reading) -> Profile:
    def read(changed: Reading) -> Profile:
        source = ColumnSource(what=str(given_profile), kind=kind, reading=changed)
        return fit_profile(parse_points(given_profile.text, Path(given_profile.file).stem, source), changed)

    return read_or_explain(read, reading, kind)


def _check_kind(stated_kind: ProfileKind, spec: str, kind: ProfileKind) -> None:
    """Check that a file has a profile of the wanted kind.

    Parameters
    ----------
    stated_kind
        Kind of the profile or the file.
    spec
        Text of the command line.
    kind
        Wanted kind.

    Raises
    ------
    WrongKindError
        The kinds differ.
    """
    if stated_kind != kind:
        raise WrongKindError(
            f"{spec!r} is a {stated_kind}, but a {kind} is needed; give it as the {stated_kind} (--{stated_kind}, "
            f"or --kind {stated_kind}), or choose a {kind} of the library: {', '.join(list_names(kind))}",
            "other body",
        )


def _resolve(spec: str, kind: ProfileKind, reading: Reading) -> Profile:
    """Resolve a library name, a profile from arrays or a file.

    Parameters
    ----------
    spec
        Text of the command line, or a profile from arrays.
    kind
        `rail` or `wheel`.
    reading
        Options of the file.

    Returns
    -------
    Profile
        Profile of the kind.

    Raises
    ------
    InputError
        The name or file does not exist, or has the wrong kind.
    """
    path = Path(spec)
    if is_library_name(spec):
        _check_kind(load_library_profile(find_library_name(spec)).kind, spec, kind)
        return load_library_profile(find_library_name(spec))
    if isinstance(spec, ArrayProfile):
        return _read_given_profile(spec, kind, reading)
    # A text with the ending of a special reader is a file, and the reader explains errors.
    if find_reader(path) is not DEFAULT_READER or _has_file(spec):
        return _read_file(spec, kind, reading)
    if can_be_file(spec):
        raise InputError(
            f"there is no file {spec!r}; check the path, or give a name of the library: {', '.join(list_names(kind))}"
        )
    return load_library_profile(find_library_name(spec, kind))


def _has_file(spec: str) -> bool:
    """Whether something is at a path.

    A path in a folder that is closed to this user counts, because the reader of the file then gives the reason.
    """
    try:
        return path_exists(spec)
    except PermissionError:
        return True
