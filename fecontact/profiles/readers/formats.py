"""The formats of profile files: a new one is one function and one entry in the table."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from fecontact.profiles.curve import Kind, Profile
from fecontact.profiles.readers.points import read_points
from fecontact.profiles.readers.toml import read_toml

# The kind is the one that is wanted. A file that says its own kind is read as that; whoever resolves it compares.
Reader: TypeAlias = Callable[[Path, Kind], Profile]


def _segments(path: Path, kind: Kind) -> Profile:
    return read_toml(path)


def _columns(path: Path, kind: Kind) -> Profile:
    return read_points(path, kind=kind)


# Measuring devices give their text files endings of their own, so what is not in the table is read as text too.
DEFAULT: Reader = _columns

# By the ending of the file in small letters.
READERS: dict[str, Reader] = {
    ".toml": _segments,
    ".txt": _columns,
    ".csv": _columns,
    ".dat": _columns,
}


def reader_of(path: Path) -> Reader:
    """Reader of a file by its ending, in any case of letters."""
    return READERS.get(path.suffix.lower(), DEFAULT)
