"""The standard rails and wheels, profiles given as arrays, and what a profile is called in results.

The files in `data/` are the library and also the pattern for a profile of one's own: copy one, change it and give its
path instead of a name.
"""

from __future__ import annotations

import difflib
import hashlib
import os
import re
import tomllib
from functools import cache, lru_cache
from importlib import resources
from pathlib import Path, PureWindowsPath

import numpy as np
from numpy.typing import ArrayLike

from fecontact.errors import InputError
from fecontact.files import sha256
from fecontact.profiles.curve import Kind, Profile
from fecontact.profiles.readers.formats import parse_library_file
from fecontact.profiles.reading import is_short_form

# Names of the UIC, of DIN, and of British standards for rails that EN 13674-1 has under another one.
ALIASES = {"UIC60": "60E1", "UIC54": "54E1", "S49": "49E1", "U55": "55E1", "BS113A": "56E1"}
"""Other names of rails, which each file's source says."""
_BY_ALIAS = {alias.lower(): name for alias, name in ALIASES.items()}
_DATA = resources.files("fecontact.profiles") / "data"


@cache
def _read_library_kinds() -> dict[str, Kind]:
    """Kind of each library profile by its name."""
    files = sorted(_DATA.iterdir(), key=lambda entry: entry.name)
    return {f.name[:-5]: tomllib.loads(f.read_text("utf-8"))["kind"] for f in files if f.name.endswith(".toml")}


def names(kind: Kind | None = None) -> tuple[str, ...]:
    """Names in the library, of all kinds or of one kind."""
    return tuple(name for name, its_kind in _read_library_kinds().items() if kind in (None, its_kind))


def in_folder(name: str, folder: str | Path) -> str:
    """Path of a profile in a user's folder, by its name with or without ending; the name itself if no file has it.

    Raises
    ------
    InputError
        There is no such folder, or two files of it have the name.
    """
    folder = Path(folder)
    try:
        files = sorted(path for path in folder.iterdir() if path.is_file())
    except OSError as error:
        raise InputError(f"library {folder}: {error.strerror or error}; give a folder of profile files") from None
    found = [path for path in files if name.lower() in (path.name.lower(), path.stem.lower())]
    exact = [path for path in found if path.name == name]
    if len(exact) != 1 and len(found) > 1:
        raise InputError(
            f"library {folder}: {name!r} may be {' or '.join(path.name for path in found)}; give it with its ending"
        )
    return str((exact or found)[0]) if found else name


# a fleet makes some hundred thousand cases
@lru_cache(maxsize=1024)
def is_known(name: str) -> bool:
    """Whether the library has a profile of this name, in any case of letters."""
    return name.lower() in {known.lower() for known in names()} | _BY_ALIAS.keys()


def find(name: str, kind: Kind | None = None) -> str:
    """Name of a profile as the library writes it, from any case of letters or another name of the same rail.

    It is looked for among all names or the names of one kind.

    Raises
    ------
    InputError
        There is no such name; the message has near ones.
    """
    among = names(kind)
    by_lower = {known.lower(): known for known in among}
    wanted = _BY_ALIAS.get(name.lower(), name).lower()
    if wanted in by_lower:
        return by_lower[wanted]
    near = difflib.get_close_matches(name.lower(), list(by_lower), n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(by_lower[n] for n in near)}?" if near else f"the library has {', '.join(among)}"
    raise InputError(f"there is no profile {name!r}; {hint}")


def toml_text(name: str) -> str:
    """Text of a library file, to copy and change.

    Raises
    ------
    InputError
        There is no such name; the message has near ones.
    """
    return (_DATA / f"{find(name)}.toml").read_text("utf-8")


@cache
def load(name: str) -> Profile:
    """Profile of the library by its name, in any case of letters.

    Raises
    ------
    InputError
        There is no such name; the message has near ones.
    """
    name = find(name)
    return parse_library_file(toml_text(name), name=name)


# --- Profiles that are given as arrays in Python: a value that stands where the name of a file does.

# 32 bits: two of a user's thousand versions of one file share an identity once in some ten thousand such users.
HASH_DIGITS = 8
_NAME_PATTERN = re.compile(r"[A-Za-z0-9][\w.-]{0,59}", re.ASCII)


class GivenProfile(str):
    """Points that were given in Python: the identity of the file that they would be, NAME.csv@HASH, with its text.

    It goes wherever a case goes, also to another process; a result has the file beside it.
    """

    __slots__ = ("text",)
    text: str

    def __new__(cls, identity: str, text: str) -> GivenProfile:  # noqa: D102
        made = super().__new__(cls, identity)
        made.text = text
        return made

    def __reduce__(self) -> tuple[type[GivenProfile], tuple[str, str]]:
        return GivenProfile, (str(self), self.text)

    @property
    def file(self) -> str:
        """Name of the file."""
        return self.rpartition("@")[0]

    @property
    def content(self) -> bytes:
        """Content of the file."""
        return self.text.encode()


def profile(y_mm: ArrayLike, z_mm: ArrayLike, *, name: str = "points") -> GivenProfile:
    """Profile of points, as `Case(rail=...)` and `Case(wheel=...)` take it beside names and files.

    Parameters
    ----------
    y_mm, z_mm (n,)
        In the order along the running surface: y positive to the field side, z up; a rail has its crown and a wheel its
        tape circle at (0, 0). The points are treated as points from a file: checked, and smoothed where they are noisy,
        both as `rail_file` and `wheel_file` of the case say.
    name
        What it is called in results.

    Raises
    ------
    InputError
        The arrays are not two rows of finite numbers, or the name cannot be the name of a file.

    Examples
    --------
    >>> import numpy as np
    >>> y = np.linspace(-35.0, 35.0, 351)
    >>> profile(y, np.sqrt(300.0**2 - y**2) - 300.0, name="R300").file
    'R300.csv'
    """
    try:
        y, z = (np.asarray(values, dtype=float) for values in (y_mm, z_mm))
    except (TypeError, ValueError) as error:
        raise InputError(
            f"profile {name!r}: y_mm and z_mm are not arrays of numbers ({error}); give both in mm"
        ) from None
    if y.ndim != 1 or y.shape != z.shape:
        raise InputError(
            f"profile {name!r}: y_mm and z_mm have the shapes {y.shape} and {z.shape}; allowed: (n,) of both"
        )
    if not np.isfinite(y + z).all():
        at = int(np.flatnonzero(~np.isfinite(y + z))[0])
        raise InputError(f"profile {name!r}: point {at + 1} is ({y[at]}, {z[at]}) mm; leave out what is not finite")
    if not isinstance(name, str) or not _NAME_PATTERN.fullmatch(name):
        raise InputError(
            f"profile name is {str(name)[:80]!r}; allowed: up to 60 letters, digits, dots, hyphens and underscores"
        )
    text = "y [mm],z [mm]\n" + "".join(f"{a!r},{b!r}\n" for a, b in zip(y.tolist(), z.tolist(), strict=True))
    return GivenProfile(f"{name}.csv@{hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]}", text)


# --- What a profile is called in results: a name that says the same wherever the files of its user lie.


def profile_file(spec: str) -> Path | None:
    """Path of the file that the text of the command line names, or None where it names none that is there.

    As in `resolve_rail` and `resolve_wheel` a short form or a name of the library comes first, in any case of letters:
    a file 60E1 in the current folder is reached as ./60E1.
    """
    if isinstance(spec, GivenProfile):
        return None
    # unlike Path.is_file, os.path.isfile never raises
    return Path(spec) if not is_short_form(spec) and not is_known(spec) and os.path.isfile(spec) else None


def can_be_file(spec: str) -> bool:
    """Whether a text is a file that may be there later, or elsewhere: it has an ending, a folder or a hash."""
    return bool(Path(spec).suffix) or any(sign in spec for sign in "/\\") or file_of_identity(spec) is not None


def refuse_unknown(spec: str) -> None:
    """Refuse what is neither in the library nor a short form, and can be no file.

    Raises
    ------
    InputError
        With near names of the library.
    """
    # unlike Path.exists, os.path.exists never raises
    if can_be_file(spec) or is_short_form(spec) or is_known(spec) or os.path.exists(spec):
        return
    try:
        find(spec)
    except InputError as error:
        raise InputError(f"{error} (a file has an ending, or a folder before its name)") from None


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
        return f"{path.name}@{sha256(path)[:HASH_DIGITS]}"
    except OSError:
        return path.name


def file_of_identity(identity: str) -> str | None:
    """Own name of the file that an identity stands for, without folder and hash; None where it stands for none."""
    file = re.fullmatch(rf"(.+)@[0-9a-f]{{{HASH_DIGITS}}}", identity)
    return file[1] if file else None


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
