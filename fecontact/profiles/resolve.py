"""A profile from what a user writes for it: a library name, a short form such as circle:300, or a file."""

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
from fecontact.profiles.curve import Kind, Profile, circular_rail_head, cylinder_wheel, make_two_arc_rail_head
from fecontact.profiles.library import GivenProfile, can_be_file, find, is_known, load, names
from fecontact.profiles.points import Points
from fecontact.profiles.readers.columns import Source, file_bytes, parse_points
from fecontact.profiles.readers.formats import DEFAULT_READER, reader_of
from fecontact.profiles.reading import ARCS, CIRCLE, CYLINDER, PLAIN, Reading, has_no_gauge_face, is_short_form
from fecontact.profiles.recognition import line_through


class WrongKindError(InputError):
    """A wheel where a rail is wanted, or the other way round."""


# Control signs, signs that format, and separators of lines and paragraphs, by their category in Unicode.
_HIDDEN_CATEGORIES = ("Cc", "Cf", "Zl", "Zp")
_NO_RADIUS = " has no number after the colon; give a radius in mm, as in {}"
_NO_ARCS = (
    ": give the radii on the field and on the gauge side and the junction's distance from the crown in mm, as in"
    " arcs:300/80@2.5; a head of more radii is a file with [head], as fecontact/profiles/data/A75.toml is"
)


@dataclass(frozen=True, kw_only=True)
class WheelProfile:
    """A wheel as it is written on the command line.

    Attributes
    ----------
    profile
        The line across the tread.
    rolling_radius_mm
        Radius at the tape circle (y = 0) in mm, or None if the text names the line only.
    """

    profile: Profile
    rolling_radius_mm: float | None = None


def resolve_rail(spec: str, reading: Reading = PLAIN) -> Profile:
    """Rail from the text of the command line: a library name, `circle:R`, `arcs:R/R@D` (mm), or a profile file.

    Measured points in a file are smoothed (`profiles.smoothing`).

    Raises
    ------
    InputError
        No such name or file, or the file does not hold a rail.
    """
    if spec.lower().startswith(CIRCLE):
        return circular_rail_head(*_parse_numbers(spec, r"circle:([^:]*)", _NO_RADIUS.format("circle:300")))
    if spec.lower().startswith(ARCS):
        return make_two_arc_rail_head(*_parse_numbers(spec, r"arcs:([^/@]+)/([^/@]+)@([^/@]+)", _NO_ARCS))
    if spec.lower().startswith(CYLINDER):
        raise InputError(f"{spec!r} is a wheel; a rail may be circle:R or arcs:R/R@D")
    return _resolve(spec, "rail", reading)


def resolve_wheel(spec: str, reading: Reading = PLAIN) -> WheelProfile:
    """Wheel from the text of the command line: a library name, `cylinder:R` (mm), or the path of a profile file.

    Raises
    ------
    InputError
        No such name or file, or the file does not hold a wheel.
    """
    if spec.lower().startswith(CYLINDER):
        radius, *_ = _parse_numbers(spec, r"cylinder:([^:]*)", _NO_RADIUS.format("cylinder:460"))
        check_positive("radius of the wheel", radius, "mm", "for example cylinder:460")
        return WheelProfile(profile=cylinder_wheel(), rolling_radius_mm=radius)
    if has_no_gauge_face(spec):
        raise InputError(f"{spec!r} is a rail; a wheel may be cylinder:R")
    return WheelProfile(profile=_resolve(spec, "wheel", reading))


# What a line of exact segments uses of a reading: it has no points to be scaled, chosen or smoothed.
_EXACT_FILE_OPTIONS = ("mirror", "tape_circle_mm", "tape_circle_z_mm")


def used_reading(spec: str, reading: Reading) -> Reading:
    """The options of a reading that a profile uses; the others are as if they were not given.

    A name of the library or a short form uses none, a TOML file those of an exact line, and another file all.
    """
    if not isinstance(spec, GivenProfile):
        if is_known(spec) or is_short_form(spec):
            return PLAIN
        if Path(spec).suffix.lower() == ".toml":
            return replace(PLAIN, **{name: getattr(reading, name) for name in _EXACT_FILE_OPTIONS})
    return reading


def refuse_unused_reading(kind: Kind, specs: Iterable[str], reading: Reading) -> None:
    """Refuse options of a reading that none of its profiles uses.

    Raises
    ------
    InputError
        For the first of these options; the message has its value.
    """
    specs = tuple(specs)
    for option in fields(Reading):
        name, value = option.name, getattr(reading, option.name)
        if value != option.default and all(getattr(used_reading(spec, reading), name) != value for spec in specs):
            exact = "a TOML file of exact segments" if specs[0].lower().endswith(".toml") else "an exact profile"
            raise InputError(
                f"{name} of the {kind} file is {value!r}, but {specs[0]!r} is {exact}, which has no use for it; leave"
                f" out --{kind}-{name.replace('_', '-')} ({name} in [{kind}_file]), or give the {kind} as a file of"
                " points"
            )


def _parse_numbers(spec: str, form: str, otherwise: str) -> list[float]:
    match = re.fullmatch(form, spec.lower())
    try:
        if match:
            return [float(number) for number in match.groups()]
    except ValueError:
        pass
    raise InputError(f"{spec!r}{otherwise}")


def _read_file(spec: str, kind: Kind, reading: Reading) -> Profile:
    """A file, read once as long as its content stays the same: the smoothing of a measurement takes half a second."""
    # of one that is not there its reader says so
    content = hashlib.sha256(file_bytes(Path(spec))).hexdigest() if os.path.exists(spec) else ""
    return _read_once(spec, kind, reading, content)


@lru_cache(maxsize=16)
def _read_once(spec: str, kind: Kind, reading: Reading, content: str) -> Profile:
    read = content_of_file(spec, kind, reading)
    return read if isinstance(read, Profile) else line_through(read, reading)


def content_of_file(spec: str, kind: Kind, reading: Reading) -> Profile | Points:
    """What a file has: a line of exact segments, or points, which are not checked yet.

    Raises
    ------
    InputError
        The file cannot be read, or holds the other body; or its name has signs that move a cursor or turn a text, which
        terminals, tables and pages would show as they are.
    """
    path = Path(spec)
    if any(unicodedata.category(sign) in _HIDDEN_CATEGORIES for sign in path.name):
        raise InputError(f"{spec!r}: its name has signs that are not shown, such as a line's end; rename the file")
    read = reader_of(path)(path, kind, reading)
    _check_kind(read, spec, kind)
    return read


@lru_cache(maxsize=16)
def _read_given_profile(given: GivenProfile, kind: Kind, reading: Reading) -> Profile:
    source = Source(what=str(given), kind=kind, reading=reading)
    return line_through(parse_points(given.text, Path(given.file).stem, source), reading)


def _check_kind(read: Profile | Points, spec: str, kind: Kind) -> None:
    if read.kind != kind:
        raise WrongKindError(
            f"{spec!r} is a {read.kind} but a {kind} is wanted; give it as the {read.kind} (--{read.kind}, or --kind"
            f" {read.kind}), or as the {kind} one of {', '.join(names(kind))}"
        )


def _resolve(spec: str, kind: Kind, reading: Reading) -> Profile:
    path = Path(spec)
    if is_known(spec):
        _check_kind(load(find(spec)), spec, kind)
        return load(find(spec))
    if isinstance(spec, GivenProfile):
        return _read_given_profile(spec, kind, reading)
    # With an ending that has a reader of its own it is meant as a file, and the reader says what is wrong with it.
    if reader_of(path) is not DEFAULT_READER or os.path.exists(spec):  # unlike Path.exists, never raises
        return _read_file(spec, kind, reading)
    if can_be_file(spec):
        raise InputError(f"there is no file {spec!r}; check the path, or give one of {', '.join(names(kind))}")
    return load(find(spec, kind))
