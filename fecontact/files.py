"""Files that are either whole or absent."""

from __future__ import annotations

import json
import math
import os
import secrets
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.errors import InputError


def write_atomically(path: str | Path, writer: Callable[[Path], object]) -> Path:
    """Write a file so that a reader, or an interrupted run, sees the old file or the whole new one.

    Parameters
    ----------
    path
        File to write; its folder is made.
    writer
        Called with a temporary path in the same folder and with the same ending, which it has to write.

    Raises
    ------
    OSError
        If the writer made no file or the disk refused it, with the name of the file. Whatever else the writer raises
        passes through, and nothing of it is left behind.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    # the ending stays: writers choose their format by it
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(6)}{path.suffix}")
    try:
        writer(temporary)
        with temporary.open("r+b") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        # a disk that is full says so without a name
        error.filename = str(path)
        raise
    finally:
        temporary.unlink(missing_ok=True)
    return path


def write_text(path: str | Path, text: str) -> Path:
    """Write a text as UTF-8 with newlines as they are."""
    return write_atomically(path, lambda temporary: temporary.write_bytes(text.encode("utf-8")))


def write_json(path: str | Path, value: object) -> Path:
    """Write a value as JSON, see `json_text`."""
    return write_text(path, json_text(value) + "\n")


def read_json(path: str | Path) -> Any:
    """The value of a JSON file.

    Raises
    ------
    InputError
        If it cannot be read or is no JSON.
    """
    try:
        return json.loads(Path(path).read_text("utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}; solve it again") from error
    except ValueError as error:
        raise InputError(f"{path}: no JSON ({error}); solve it again") from error


def json_text(value: object) -> str:
    """A value as indented JSON.

    Keys stay in the order in which they were put in, which is the order of meaning; NaN and infinity become null
    (JSON has neither); NumPy numbers and arrays become numbers and lists.
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
