"""Reading and writing files, so that a file is either whole or absent."""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
import re
import secrets
import tomllib
from collections.abc import Callable, Mapping, Sequence
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.errors import InputError

# Limits of a TOML file: the parser takes a second for 200 lines of keys with 500 parts, and minutes for 100,000 parts.
_MOST_TOML, _LONGEST_TOML_LINE, _MOST_DOTS = 1_000_000, 10_000, 100
_TOML_BETWEEN = re.compile(r"[,={}\[\]]")
SEAL, SEALED = "sha256", "all but sha256"
FORMULA = ("=", "+", "-", "@", "\t", "\r", "'")
"""How a text begins that spreadsheets would evaluate; in a CSV it has an apostrophe before it, which they hide."""
# A row of a study has 4 kB, and a study up to 100,000 of them.
_MOST_BYTES = 1_000_000_000


def write_atomically(path: str | Path, writer: Callable[[Path], object]) -> Path:
    """Write a file so that a reader, or an interrupted run, sees the old file or the whole new one.

    Parameters
    ----------
    path
        File to write; its folder is made.
    writer
        Called with a temporary path, which it has to write; folder and ending are as in `path`.

    Raises
    ------
    OSError
        If the writer made no file or the disk refused it, with the name of the file. Other errors of the writer pass
        through; no temporary file is left behind.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    # the ending is kept: writers choose their format by it
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(6)}{path.suffix}")
    try:
        writer(temporary)
        with temporary.open("r+b") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        # the error of a full disk has no file name
        error.filename = str(path)
        raise
    finally:
        temporary.unlink(missing_ok=True)
    return path


def remove_unfinished(folder: Path) -> None:
    """Remove temporary files that `write_atomically` left in a folder if the process was killed."""
    for path in folder.iterdir():
        if re.fullmatch(r"\..+\.[0-9a-f]{12}(\.[^.]+)?", path.name) and path.is_file():
            path.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> Path:
    """Write a text as UTF-8 with unchanged newlines."""
    return write_atomically(path, lambda temporary: temporary.write_bytes(text.encode("utf-8")))


def write_json(path: str | Path, value: object) -> Path:
    """Write a value as JSON, see `json_text`."""
    return write_text(path, json_text(value) + "\n")


def write_sealed(path: Path, value: Mapping[str, object], beside: Sequence[Path] = ()) -> Path:
    """Write a mapping as JSON with checksums of its content, and of files that were written beside it."""
    digests = {SEALED: _digest(json_text(value)), **{file.name: sha256(file) for file in beside}}
    return write_json(path, {**value, SEAL: digests})


def broken_seal(path: Path, document: Mapping[str, Any]) -> str | None:
    """Why a document differs from what `write_sealed` wrote; None if it does not.

    Files beside the document are not checked; the document has their checksums.
    """
    seal = document.get(SEAL)
    said = json_text({name: value for name, value in document.items() if name != SEAL})
    if isinstance(seal, Mapping) and seal.get(SEALED) == _digest(said):
        return None
    return f"{path} was changed after it was written, or by an earlier version (its checksum differs)"


def _digest(text: str) -> str:
    # half a character occurs only in a damaged file, and its replacement changes the checksum
    return hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()


def sha256(path: Path) -> str:
    """SHA-256 of a regular file.

    Raises
    ------
    OSError
        If it cannot be read, or is no regular file: a pipe or a device could be read without end.
    """
    with open_regular(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def open_regular(path: Path) -> BufferedReader:
    """Open a regular file, and no folder, pipe or device.

    Raises
    ------
    OSError
        If it is no regular file, or cannot be read.
    """
    # checked before opening: opening a pipe would wait for its writer
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    return path.open("rb")


def read_json(path: str | Path) -> Any:
    """The value of a JSON file.

    Raises
    ------
    InputError
        If the file cannot be read, is larger than any file that is written, or is no JSON.
    """
    try:
        with open_regular(Path(path)) as file:
            # a read of so many bytes at once would ask for that memory, also of a small file
            if os.fstat(file.fileno()).st_size > _MOST_BYTES:
                raise InputError(f"{path}: it has more than {_MOST_BYTES / 1e6:g} MB; allowed is less; solve it again")
            content = file.read()
        return json.loads(content.decode("utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}; solve it again") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: no JSON ({error}); solve it again") from error


def json_text(value: object) -> str:
    """A value as indented JSON.

    Keys keep their order, which has a meaning; NaN and infinity become null (JSON has neither); NumPy numbers and
    arrays become numbers and lists.
    """
    return json.dumps(_plain(value), indent=2, ensure_ascii=False, allow_nan=False)


def _plain(value: object) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def toml_content(text: str, what: str) -> dict[str, Any]:
    """Content of a TOML text from an unknown source.

    Raises
    ------
    InputError
        If it is not TOML, or too large for the parser, whose time grows with the square of a key's parts.
    """
    if len(text) > _MOST_TOML:
        raise InputError(f"{what}: {len(text)} characters; allowed: {_MOST_TOML}; give the numbers in several files")
    for number, line in enumerate(text.splitlines(), start=1):
        parts = max(piece.count(".") for piece in _TOML_BETWEEN.split(line))
        if len(line) > _LONGEST_TOML_LINE or (parts > _MOST_DOTS and not line.lstrip().startswith("#")):
            raise InputError(
                f"{what}: line {number} has {len(line)} characters, and up to {parts} dots in a key or value; allowed:"
                f" {_LONGEST_TOML_LINE} and {_MOST_DOTS}; break the line"
            )
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{what}: not valid TOML: brackets are nested too deeply") from None
    # the parser also raises the ValueError of an integer with thousands of digits
    except (ValueError, OverflowError) as error:
        raise InputError(f"{what}: not valid TOML: {str(error)[:200]}") from None
