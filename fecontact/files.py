"""Reading and writing files, so that a file is either whole or absent."""

from __future__ import annotations

import errno
import hashlib
import io
import json
import math
import os
import re
import secrets
import tomllib
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from io import BufferedReader
from pathlib import Path, PureWindowsPath
from typing import Any, TypeGuard

import numpy as np

from fecontact.errors import InputError, is_invisible

# Limits of a TOML file, in characters, characters per line and dots per key or value. The parser takes one second for
# 200 lines of keys with 500 parts, and minutes for 100,000 parts.
_MOST_TOML_CHARACTERS, _LONGEST_TOML_LINE, _MOST_TOML_DOTS = 1_000_000, 10_000, 100
_TOML_SEPARATORS = re.compile(r"[,={}\[\]]")
# A text in quotes on a single line. Separators in it do not end a key.
_TOML_QUOTED = re.compile(r'"(?:[^"\\]|\\.)*"|\'[^\']*\'')
SEAL_KEY, _SEALED_CONTENT = "sha256", "all but sha256"
FORMULA_PREFIXES = ("=", "+", "-", "@", "\t", "\r", "'")
"""First characters of texts that spreadsheets would evaluate. In a CSV such a text gets an apostrophe before it, which
spreadsheets hide.
"""
# Largest JSON file. A row of a study has 4 kB, and a study has up to 100,000 rows.
_LARGEST_JSON_BYTES = 1_000_000_000
# All characters of JSON with its newlines that may be invisible.
_MAYBE_INVISIBLE = re.compile(r"[^\n -~]")


def write_atomically(path: str | Path, writer: Callable[[Path], object]) -> Path:
    """Write a file so that readers see the old file or the whole new file.

    An interrupted run also leaves the old file or the whole new file, and no temporary file.

    Parameters
    ----------
    path
        File to write; its folder is created.
    writer
        Function that writes the file at a temporary path. The temporary path has the folder and the ending of `path`.

    Returns
    -------
    Path
        `path`.

    Raises
    ------
    OSError
        If the writer wrote no file, the disk refused it, or a folder, a pipe or a device is at the path. The error has
        the name of the file. Other errors of the writer pass through.
    """
    path = Path(path)
    check_regular_file(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    # The ending is kept because writers choose their format by it.
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


def remove_unfinished(folder: Path, names: Collection[str] | None = None) -> None:
    """Remove temporary files that a killed `write_atomically` left in a folder.

    Parameters
    ----------
    folder
        Folder to search, without its subfolders.
    names
        Names of the files whose temporary files are removed; None for all files.
    """
    for path in folder.iterdir():
        match = re.fullmatch(r"\.(.+)\.[0-9a-f]{12}(\.[^.]+)?", path.name)
        if match and (names is None or match[1] + (match[2] or "") in names) and path.is_file():
            path.unlink(missing_ok=True)


def _find_different_files(contents: Iterable[tuple[Path, str]]) -> list[Path]:
    """Existing objects that differ from the files that will be written at their paths.

    A file with the same content is not overwritten if it is written again, so that an interrupted command can resume.

    Parameters
    ----------
    contents
        Path and text of each file.

    Returns
    -------
    list of Path
        Files with different content, and links, folders, pipes and devices.
    """
    return [path for path, text in contents if os.path.lexists(path) and not _has_content(path, text.encode("utf-8"))]


def refuse_different_files(contents: Iterable[tuple[Path, str]], command: str, remedy: str) -> None:
    """Refuse to overwrite files with different content.

    Parameters
    ----------
    contents
        Path and text of each file.
    command
        Words for the command that would overwrite the files.
    remedy
        End of the message.

    Raises
    ------
    InputError
        With the first three files that have different content.
    """
    if different_files := [str(path) for path in _find_different_files(contents)]:
        further = f" and {len(different_files) - 3} more" * (len(different_files) > 3)
        raise InputError(f"{command} would overwrite {', '.join(different_files[:3])}{further}; {remedy}")


def _has_content(path: Path, content: bytes) -> bool:
    """Whether a path is a regular file, and not a link, with this content."""
    if path.is_symlink() or not path.is_file() or path.stat().st_size != len(content):
        return False
    return path.read_bytes() == content


def require_ending(path: str | Path, endings: Sequence[str], kind: str) -> None:
    """Refuse an output file with the ending of an unknown format.

    Parameters
    ----------
    path
        File to write.
    endings
        Allowed endings in lower case, each with its point. Capitals are allowed too.
    kind
        Kind of the file in the message, for example `table`.

    Raises
    ------
    InputError
        The message has the allowed endings, and a valid name.
    """
    path = Path(path)
    if path.suffix.lower() not in endings:
        example = path.with_suffix(endings[0]).name if path.name else f"{kind}{endings[0]}"
        raise InputError(
            f"{kind} {path}: the ending is {path.suffix or '(none)'}; allowed: {', '.join(endings)}; give a name such"
            f" as {example}"
        )


def write_text(path: str | Path, text: str) -> Path:
    """Write a text as UTF-8 with unchanged newlines.

    Parameters
    ----------
    path
        Path of the file.
    text
        The text.

    Returns
    -------
    Path
        Path of the written file.
    """
    return write_atomically(path, lambda temporary: temporary.write_bytes(text.encode("utf-8")))


def write_json(path: str | Path, value: object) -> Path:
    """Write a value as JSON, see `format_json`.

    Parameters
    ----------
    path
        Path of the file.
    value
        Value that `format_json` takes.

    Returns
    -------
    Path
        Path of the written file.
    """
    return write_text(path, format_json(value) + "\n")


def write_sealed(path: Path, value: Mapping[str, object], companions: Sequence[Path] = ()) -> Path:
    """Write a mapping as JSON with checksums of its content and of companion files.

    Parameters
    ----------
    path
        JSON file to write.
    value
        Content.
    companions
        Files that were written with the document, for example its table, in its folder or below.

    Returns
    -------
    Path
        `path`.
    """
    digests = {_SEALED_CONTENT: _digest(value)}
    digests |= {file.relative_to(path.parent).as_posix(): hash_file(file) for file in companions}
    return write_json(path, {**value, SEAL_KEY: digests})


def list_companions(document: Mapping[str, Any]) -> dict[str, str]:
    """Checksums of the companion files of a document that `write_sealed` wrote.

    Parameters
    ----------
    document
        Content of the document.

    Returns
    -------
    dict
        Checksums by the path of the file, relative to the folder of the document.
    """
    return {name: digest for name, digest in document[SEAL_KEY].items() if name != _SEALED_CONTENT}


def explain_broken_seal(path: Path, document: Mapping[str, Any]) -> str | None:
    """Reason why a document differs from the content that `write_sealed` wrote.

    Companion files are not checked; the document has their checksums.

    Parameters
    ----------
    path
        File of the document, for the message.
    document
        Content of the file.

    Returns
    -------
    str or None
        Reason; None if the document is unchanged.
    """
    seal = document.get(SEAL_KEY)
    content = {name: value for name, value in document.items() if name != SEAL_KEY}
    if isinstance(seal, Mapping) and seal.get(_SEALED_CONTENT) == _digest(content):
        return None
    return f"{path} was changed after it was written, or an earlier version wrote it (its checksum differs)"


def _digest(content: Mapping[str, object]) -> str:
    # The JSON has no escapes: which characters are invisible depends on the version of Python.
    # Half a character occurs only in a damaged file, and its replacement changes the checksum.
    return hashlib.sha256(_dump_json(content).encode("utf-8", "replace")).hexdigest()


OWN_FUNCTIONS_SETTING = "own_functions"
"""Entry of results with the sources of the functions of a user's criteria, by the name of the criterion."""


def describe_source(source: str) -> str:
    """Describe a source text by a digest.

    Parameters
    ----------
    source
        Source text.

    Returns
    -------
    str
        Text such as "source 0f343b0931126a20".
    """
    return f"source {hashlib.sha256(source.encode()).hexdigest()[:16]}"


def hash_file(path: Path) -> str:
    """SHA-256 of a regular file, in hexadecimal digits.

    Parameters
    ----------
    path
        Path of the file.

    Returns
    -------
    str
        64 digits.

    Raises
    ------
    OSError
        If the file cannot be read, or is not a regular file: reading a pipe or a device could last forever.
    """
    with open_regular_file(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def open_regular_file(path: Path) -> BufferedReader:
    """Open a regular file for reading; refuse folders, pipes and devices.

    Parameters
    ----------
    path
        File to open.

    Returns
    -------
    BufferedReader
        Open binary file.

    Raises
    ------
    OSError
        If the path is not a regular file, or cannot be read.
    """
    # The check precedes the opening because opening a pipe would wait for its writer.
    check_regular_file(path)
    return path.open("rb")


def path_exists(path: str | Path) -> bool:
    """Whether something is at a path, equally on all versions of Python.

    `Path.exists` never raises an error from Python 3.14 on, and calls a file in the closed folder of another user
    absent.

    Parameters
    ----------
    path
        Path; any text.

    Returns
    -------
    bool
        False too for a text that cannot be a path.

    Raises
    ------
    PermissionError
        If a folder of the path is closed to this user.
    """
    try:
        os.stat(path)
    except PermissionError:
        raise
    except (OSError, ValueError):
        return False
    return True


def is_file_name(text: object) -> TypeGuard[str]:
    """Whether a value of a document is the name of a file, without a path.

    Parameters
    ----------
    text
        Any value.

    Returns
    -------
    bool
        Whether the text names something directly in a folder. Only Windows takes a backslash for the end of a folder's
        name; a text that would lead out of the folder there is a name nowhere.
    """
    return isinstance(text, str) and Path(text).name == text != "" and ".." not in PureWindowsPath(text).parts


def describe_object(path: Path) -> str:
    """Kind of the object at a path, with its article.

    Parameters
    ----------
    path
        Path of an object.

    Returns
    -------
    str
        A link, a folder, a file, or a pipe or a device.
    """
    if path.is_symlink():
        return "a link"
    return "a folder" if path.is_dir() else "a file" if path.is_file() else "a pipe or a device"


def check_regular_file(path: Path, *, link_allowed: bool = True) -> None:
    """Refuse a folder, a pipe or a device in the place of a file.

    Parameters
    ----------
    path
        Path of a file that is read or written; it may be absent.
    link_allowed
        Whether the path may be a symbolic link to a file.

    Raises
    ------
    OSError
        If something different from a file is at the path. The error has its kind and the path.
    """
    if path.is_symlink() and not link_allowed:
        raise OSError(errno.EINVAL, f"{describe_object(path)} instead of a file", str(path))
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, f"{describe_object(path.resolve())} instead of a file", str(path))


def read_json(path: str | Path) -> Any:
    """Value of a JSON file.

    Parameters
    ----------
    path
        JSON file.

    Returns
    -------
    Any
        Value with dictionaries, lists, texts, numbers, truth values and None.

    Raises
    ------
    InputError
        If the file cannot be read, is larger than any file that the program writes, or is not JSON.
    """
    try:
        with open_regular_file(Path(path)) as file:
            # Reading with a limit of this many bytes would reserve that memory, even for a small file.
            if os.fstat(file.fileno()).st_size > _LARGEST_JSON_BYTES:
                raise InputError(
                    f"{path} is too large; allowed: at most {_LARGEST_JSON_BYTES / 1e6:g} MB; solve it again"
                )
            content = file.read()
        return json.loads(content.decode("utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}; solve it again") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is not valid JSON ({error}); solve it again") from error


def format_json(value: object) -> str:
    """Indented JSON of a value.

    Keys keep their order, because the order has a meaning. NaN and infinity become null (JSON has neither). NumPy
    numbers and arrays become numbers and lists. Invisible characters are escapes such as `\\u202e` (`is_invisible`);
    letters of all languages stay readable.

    Parameters
    ----------
    value
        Mappings, sequences, texts, numbers, NumPy numbers and arrays, and None.

    Returns
    -------
    str
        JSON without a newline at its end.
    """
    return _MAYBE_INVISIBLE.sub(_escape_in_json, _dump_json(value))


def _escape_in_json(match: re.Match[str]) -> str:
    return json.dumps(match[0])[1:-1] if is_invisible(match[0]) else match[0]


def _dump_json(value: object) -> str:
    """Indented JSON of a value, in which characters other than controls are themselves."""
    return json.dumps(_to_plain(value), indent=2, ensure_ascii=False, allow_nan=False)


def _to_plain(value: object) -> Any:
    """Convert a value to the types of JSON.

    NaN and infinity become None, paths become texts, and NumPy numbers and arrays become numbers and lists.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _to_plain(element) for key, element in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return [_to_plain(element) for element in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def read_toml(path: Path, source: str) -> dict[str, Any]:
    """Content of a TOML file from an untrusted source.

    Parameters
    ----------
    path
        File in UTF-8.
    source
        Name of the file in messages, for example `study FILE`.

    Returns
    -------
    dict
        Content.

    Raises
    ------
    InputError
        If the file cannot be read, is not a regular file, is not TOML, or is too large for the parser.
    """
    try:
        with io.TextIOWrapper(open_regular_file(path), "utf-8") as file:
            # A character has at most 4 bytes. The size is checked before the content is read into memory.
            if (size := os.fstat(file.fileno()).st_size) > 4 * _MOST_TOML_CHARACTERS:
                raise InputError(
                    f"{source} has {size} bytes; allowed: at most {4 * _MOST_TOML_CHARACTERS}; divide it into several"
                    " files"
                )
            text = file.read()
    except OSError as error:
        raise InputError(f"{source} cannot be read: {error.strerror or error}; check the path") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{source} is not UTF-8 ({error}); save it as UTF-8") from None
    return read_toml_text(text, source)


def read_toml_text(text: str, source: str) -> dict[str, Any]:
    """Content of a TOML text from an untrusted source.

    Parameters
    ----------
    text
        TOML text.
    source
        Name of the text in messages.

    Returns
    -------
    dict
        Content.

    Raises
    ------
    InputError
        If the text is not TOML, or is too large for the parser: its time grows with the square of the number of parts
        of a key.
    """
    if len(text) > _MOST_TOML_CHARACTERS:
        raise InputError(
            f"{source} has {len(text)} characters; allowed: at most {_MOST_TOML_CHARACTERS}; divide it into several"
            " files"
        )
    # Only a newline ends a line of TOML: keys in quotes can have other characters at which `splitlines` divides.
    for number, line in enumerate(text.split("\n"), start=1):
        # A quote may belong to a text of several lines, so that the quoted parts are counted both ways.
        dots = max(
            piece.count(".")
            for text_of_line in (line, _TOML_QUOTED.sub("", line))
            for piece in _TOML_SEPARATORS.split(text_of_line)
        )
        if len(line) > _LONGEST_TOML_LINE or (dots > _MOST_TOML_DOTS and not line.lstrip().startswith("#")):
            raise InputError(
                f"{source}: line {number} has {len(line)} characters, and up to {dots} dots in a key or value;"
                " allowed: at most"
                f" {_LONGEST_TOML_LINE} and {_MOST_TOML_DOTS}; break the line"
            )
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError(f"{source} is not valid TOML: brackets are nested too deeply") from None
    # The parser also raises the ValueError of an integer with thousands of digits.
    except (ValueError, OverflowError) as error:
        raise InputError(f"{source} is not valid TOML: {str(error)[:200]}") from None
