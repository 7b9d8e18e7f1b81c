"""What a profile is called in results: a name that says the same wherever the files of its user lie."""

from __future__ import annotations

import hashlib
import os
import re
from pathlib import Path, PureWindowsPath

from fecontact.profiles.given import SHOWN_DIGITS, GivenProfile
from fecontact.profiles.library import is_known
from fecontact.profiles.short_forms import is_short_form


def profile_file(spec: str) -> Path | None:
    """Path of the file that the text of the command line names, or None where it names none that is there.

    As in `resolve_rail` and `resolve_wheel` a short form or a name of the library comes first, in any case of letters:
    a file 60E1 in the current folder is reached as ./60E1.
    """
    if isinstance(spec, GivenProfile):
        return None
    # unlike Path.is_file, os.path.isfile never raises
    return Path(spec) if not is_short_form(spec) and not is_known(spec) and os.path.isfile(spec) else None


def profile_identity(spec: str) -> str:
    """The text that stands for a profile in results.

    A library name or a short form stands for itself. A file is `NAME.ext@HASH`: its own name without any folder, and
    the beginning of the hash of its content, so that a copy in another folder is the same profile and a changed file is
    another one. A file that cannot be read is its name alone.
    """
    if is_short_form(spec) or is_known(spec) or isinstance(spec, GivenProfile):
        return str(spec)
    path = profile_file(spec)
    if path is None:
        # a path of either kind of system, from a record that was made on another machine
        return PureWindowsPath(spec).name or spec
    try:
        return f"{path.name}@{content_sha256(path)[:SHOWN_DIGITS]}"
    except OSError:
        return path.name


def file_of_identity(identity: str) -> str | None:
    """Own name of the file that an identity stands for, without folder and hash; None where it stands for none."""
    file = re.fullmatch(rf"(.+)@[0-9a-f]{{{SHOWN_DIGITS}}}", identity)
    return file[1] if file else None


def content_sha256(path: str | Path) -> str:
    """SHA-256 of a file's content in hex digits.

    Raises
    ------
    OSError
        The file cannot be read.
    """
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def content_of(spec: str) -> tuple[str, bytes] | None:
    """Name and content of the file that a text or a value stands for; None where it stands for none.

    Raises
    ------
    OSError
        The file cannot be read.
    """
    if isinstance(spec, GivenProfile):
        return spec.file, spec.content
    path = profile_file(spec)
    return None if path is None else (path.name, path.read_bytes())
