"""The formats of profile files: a new one is one function and one entry in the table."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from fecontact.errors import InputError
from fecontact.profiles.curve import Kind, Profile
from fecontact.profiles.points import Points
from fecontact.profiles.readers.miniprof import read_miniprof
from fecontact.profiles.readers.simpack import is_simpack, read_simpack
from fecontact.profiles.readers.table import read_columns
from fecontact.profiles.readers.toml import read_toml
from fecontact.profiles.reading import Reading

# The kind is the one that is wanted. A file that says its own kind is read as that; whoever resolves it compares.
Reader: TypeAlias = Callable[[Path, Kind, Reading], Profile | Points]


def _segments(path: Path, kind: Kind, reading: Reading) -> Profile:
    return read_toml(path)


def _columns(path: Path, kind: Kind, reading: Reading) -> Points:
    """Columns of numbers, unless the content says that it is something else under another ending."""
    return read_simpack(path, reading) if is_simpack(path) else read_columns(path, kind, reading)


def _slices(path: Path, kind: Kind, reading: Reading) -> Profile:
    raise InputError(
        f"{path}: a file of slices ({path.suffix.lower()}) is a profile that changes along the track or around the"
        " wheel; fecontact takes a rail as a prism and a wheel as a body of revolution: give the file of one slice"
    )


# Measuring devices give their text files endings of their own, so what is not in the table is read as text too.
DEFAULT: Reader = _columns

# By the ending of the file in small letters.
READERS: dict[str, Reader] = {
    ".toml": _segments,
    ".txt": _columns,
    ".csv": _columns,
    ".dat": _columns,
    # other programs give their columns these endings as well: the content decides
    ".prr": _columns,
    ".prw": _columns,
    ".ban": read_miniprof,
    ".whl": read_miniprof,
    ".slcs": _slices,
    ".slcw": _slices,
}


def reader_of(path: Path) -> Reader:
    """Reader of a file by its ending, in any case of letters."""
    return READERS.get(path.suffix.lower(), DEFAULT)
