"""Standard rails and wheels, profiles from arrays, and the names of profiles in results.

The files in `data/` are the library. They are also examples for your own profile: copy a file, change it, and give its
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
from fecontact.files import hash_file, open_regular_file
from fecontact.profiles.curve import Profile, ProfileKind
from fecontact.profiles.readers.formats import parse_library_file
from fecontact.profiles.reading import is_short_form
from fecontact.profiles.unavailable import find_unavailable

# Names that national standards, railways and data sets have for profiles of the library.
ALIASES = {
    **{"UIC60": "60E1", "IRS60": "60E1", "UIC54": "54E1", "UIC54E": "54E2", "S54": "54E3", "54E1AHC": "54E5"},
    **{"U55": "55E1", "BS113A": "56E1", "52RATP": "52E1", "U50E": "50E1", "50EB-T": "50E2", "BV50": "50E3"},
    **{"UIC50": "50E4", "50UNI": "50E5", "U50": "50E6", "S49": "49E1", "S49T": "49E2", "U33": "46E2", "NP46": "46E3"},
    **{"46UNI": "46E4", "S1002CN": "S1002", "LMB": "S1002", "LMB_10": "LMB10"},
}
"""Alternative names of profiles. The source of each file has them."""
EQUAL_HEADS = {
    **{"46E2": "55E1", "49E5": "54E4", "50E1": "50E6", "50E2": "60E1", "50E4": "54E1", "50E5": "49E2"},
    **{"54E3": "49E1"},
}
"""Rails with the head of a different rail of the library, to 0.001 mm. A measured head gets the name of that rail."""
_BY_ALIAS = {alias.lower(): name for alias, name in ALIASES.items()}
_DATA = resources.files("fecontact.profiles") / "data"


@cache
def _list_all_names() -> tuple[str, ...]:
    """Names of all library profiles in alphabetical order; no file is read."""
    return tuple(sorted(file.name[:-5] for file in _DATA.iterdir() if file.name.endswith(".toml")))


@cache
def _read_library_kinds() -> dict[str, tuple[ProfileKind, str]]:
    """Kind and group of each library profile by its name."""
    contents = {name: tomllib.loads((_DATA / f"{name}.toml").read_text("utf-8")) for name in _list_all_names()}
    return {name: (content["kind"], content["group"]) for name, content in contents.items()}


def list_names(kind: ProfileKind | None = None) -> tuple[str, ...]:
    """Names of all library profiles, or of the profiles of a kind.

    Parameters
    ----------
    kind
        `rail`, `wheel`, or None for both.

    Returns
    -------
    tuple of str
        Names in alphabetical order.
    """
    if kind is None:
        return _list_all_names()
    return tuple(name for name, (its_kind, _) in _read_library_kinds().items() if its_kind == kind)


def list_reference_names(kind: ProfileKind) -> tuple[str, ...]:
    """Names of the profiles that measured points may belong to.

    Rails with a head that a different rail has too are left out (`EQUAL_HEADS`), as are profiles with a doubtful part.

    Parameters
    ----------
    kind
        `rail` or `wheel`.

    Returns
    -------
    tuple of str
        Names in alphabetical order.
    """
    return tuple(
        name
        for name in list_names(kind)
        if name not in EQUAL_HEADS and load_library_profile(name).doubtful_y_mm is None
    )


def find_group(name: str) -> str:
    """Standard or country of a library profile, by which lists are ordered.

    Parameters
    ----------
    name
        Name in the library.

    Returns
    -------
    str
        Group, for example `EN 13674-1`.

    Raises
    ------
    InputError
        The name does not exist; the message has similar names.
    """
    return _read_library_kinds()[find_library_name(name)][1]


def find_in_folder(name: str, folder: str | Path) -> str:
    """Path of a profile in a user's folder, by its name with or without ending.

    Parameters
    ----------
    name
        Name of a file.
    folder
        Folder of profile files.

    Returns
    -------
    str
        Path; `name` if no file has it.

    Raises
    ------
    InputError
        The folder does not exist, or two of its files have the name.
    """
    folder = Path(folder)
    try:
        files = sorted(path for path in folder.iterdir() if path.is_file())
    except OSError as error:
        raise InputError(f"library {folder}: {error.strerror or error}; give a folder of profile files") from None
    matches = [path for path in files if name.lower() in (path.name.lower(), path.stem.lower())]
    exact = [path for path in matches if path.name == name]
    if len(exact) != 1 and len(matches) > 1:
        raise InputError(
            f"library {folder}: {name!r} may be {' or '.join(path.name for path in matches)}; give the name with its"
            " ending"
        )
    return str((exact or matches)[0]) if matches else name


# cached: a fleet has several hundred thousand cases
@lru_cache(maxsize=1024)
def is_library_name(name: str) -> bool:
    """Whether the library has a profile of this name, in any case of letters."""
    return name.lower() in {library_name.lower() for library_name in list_names()} | _BY_ALIAS.keys()


def find_library_name(name: str, kind: ProfileKind | None = None) -> str:
    """Name of a profile in the spelling of the library.

    Parameters
    ----------
    name
        Name in any case of letters, or an alternative name.
    kind
        Kind of the profile; None searches all kinds.

    Returns
    -------
    str
        Name in the library.

    Raises
    ------
    InputError
        The name does not exist; the message has similar names of the kind, or the reason why the library does not have
        a known profile.
    """
    library_names = list_names(kind)
    by_lower = {library_name.lower(): library_name for library_name in library_names}
    lower_name = _BY_ALIAS.get(name.lower(), name).lower()
    if lower_name in by_lower:
        return by_lower[lower_name]
    if (unavailable := find_unavailable(name)) is not None:
        raise InputError(
            f"the {unavailable.kind} {name!r} ({unavailable.origin}) is not in the library: {unavailable.reason}; give"
            " a file of your own, with exact segments or points (fecontact guide profiles)"
        )
    near = difflib.get_close_matches(name.lower(), list(by_lower), n=3, cutoff=0.5)
    hint = (
        f"did you mean {' or '.join(by_lower[n] for n in near)}?"
        if near
        else f"the library has {', '.join(library_names)}"
    )
    raise InputError(f"there is no profile {name!r}; {hint}")


def toml_text(name: str) -> str:
    """Text of a library file, to copy and change.

    Parameters
    ----------
    name
        Name in the library.

    Returns
    -------
    str
        Text in TOML.

    Raises
    ------
    InputError
        The name does not exist; the message has similar names.
    """
    return (_DATA / f"{find_library_name(name)}.toml").read_text("utf-8")


@cache
def load_library_profile(name: str) -> Profile:
    """Load a profile of the library by its name, in any case of letters.

    Parameters
    ----------
    name
        Name in the library.

    Returns
    -------
    Profile
        Exact profile.

    Raises
    ------
    InputError
        The name does not exist; the message has similar names.

    Examples
    --------
    >>> from fecontact.profiles.library import load_library_profile
    >>> load_library_profile("uic60").name
    '60E1'
    """
    name = find_library_name(name)
    return parse_library_file(toml_text(name), name=name)


# --- Profiles from arrays in Python: values that can replace the name of a file.

# 32 bits: if each user has a thousand versions of a file, two versions share an identity for about one user of ten
# thousand.
HASH_DIGITS = 8
_NAME_PATTERN = re.compile(r"[A-Za-z0-9][\w.-]{0,59}", re.ASCII)


class ArrayProfile(str):
    """Profile from arrays in Python.

    Its text is the identity of the file that it would be, NAME.csv@HASH. It can be passed wherever a case can, also to
    another process. A result has the file too.

    Attributes
    ----------
    text
        Content of the file.
    """

    __slots__ = ("text",)
    text: str

    def __new__(cls, identity: str, text: str) -> ArrayProfile:  # noqa: D102
        instance = super().__new__(cls, identity)
        instance.text = text
        return instance

    def __reduce__(self) -> tuple[type[ArrayProfile], tuple[str, str]]:
        return ArrayProfile, (str(self), self.text)

    @property
    def file(self) -> str:
        """Name of the file."""
        return self.rpartition("@")[0]

    @property
    def content(self) -> bytes:
        """Content of the file."""
        return self.text.encode()


def profile(y_mm: ArrayLike, z_mm: ArrayLike, *, name: str = "points") -> ArrayProfile:
    """Profile from arrays, for `Case(rail=...)` and `Case(wheel=...)`.

    The points are treated as points from a file: checked, and smoothed if they are noisy, with the settings `rail_file`
    and `wheel_file` of the case.

    Parameters
    ----------
    y_mm, z_mm : ndarray of shape (n,)
        Coordinates in mm in the order along the running surface: y positive to the field side, z up. A rail has its
        crown and a wheel its tape circle at (0, 0).
    name
        Name in results.

    Returns
    -------
    ArrayProfile
        Value that replaces the name of a file.

    Raises
    ------
    InputError
        The arrays are not two rows of finite numbers, or the name cannot be the name of a file.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.profiles.library import profile
    >>> y = np.linspace(-35.0, 35.0, 351)
    >>> profile(y, np.sqrt(300.0**2 - y**2) - 300.0, name="R300").file
    'R300.csv'
    """
    try:
        y, z = (np.asarray(values, dtype=float) for values in (y_mm, z_mm))
    except (TypeError, ValueError) as error:
        raise InputError(
            f"profile {name!r}: y_mm and z_mm are not arrays of numbers ({error}); give both as arrays of numbers in mm"
        ) from None
    if y.ndim != 1 or y.shape != z.shape:
        raise InputError(
            f"profile {name!r}: y_mm and z_mm have the shapes {y.shape} and {z.shape}; allowed: (n,) for both"
        )
    if not np.isfinite(y + z).all():
        at = int(np.flatnonzero(~np.isfinite(y + z))[0])
        raise InputError(
            f"profile {name!r}: point {at + 1} is ({y[at]}, {z[at]}) mm; leave out points that are not finite"
        )
    if not isinstance(name, str) or not _NAME_PATTERN.fullmatch(name):
        raise InputError(
            f"profile name is {str(name)[:80]!r}; allowed: up to 60 letters, digits, dots, hyphens and underscores"
        )
    text = "y [mm],z [mm]\n" + "".join(f"{a!r},{b!r}\n" for a, b in zip(y.tolist(), z.tolist(), strict=True))
    return ArrayProfile(f"{name}.csv@{hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]}", text)


# --- Identity of a profile in results: a name that does not depend on the folders of a user.


def profile_file(spec: str) -> Path | None:
    """Path of the file that a text of the command line refers to.

    As in `resolve_rail` and `resolve_wheel`, a short form or a name of the library has priority, in any case of
    letters. Use ./60E1 for a file 60E1 in the current folder.

    Parameters
    ----------
    spec
        Text of the command line, or a profile from arrays.

    Returns
    -------
    Path or None
        Path; None if the text does not refer to an existing file.
    """
    if isinstance(spec, ArrayProfile):
        return None
    # os.path.isfile never raises, in contrast to Path.is_file
    return Path(spec) if not is_short_form(spec) and not is_library_name(spec) and os.path.isfile(spec) else None


def can_be_file(spec: str) -> bool:
    """Whether a text can be a file that appears later or is in another place.

    Such a text has an ending, a folder or a hash.

    Parameters
    ----------
    spec
        Text that gives a profile.

    Returns
    -------
    bool
        Whether the text can be a file.
    """
    return bool(Path(spec).suffix) or any(sign in spec for sign in "/\\") or file_of_identity(spec) is not None


def refuse_unknown_profile(spec: str, kind: ProfileKind | None = None) -> None:
    """Refuse a text other than a library name, a short form or a possible file.

    Parameters
    ----------
    spec
        Text of the command line.
    kind
        Kind of the profile; None for both kinds.

    Raises
    ------
    InputError
        The message has similar names of the kind.
    """
    # os.path.exists never raises, in contrast to Path.exists
    if can_be_file(spec) or is_short_form(spec) or is_library_name(spec) or os.path.exists(spec):
        return
    try:
        find_library_name(spec, kind)
    except InputError as error:
        # the message on a profile that the library cannot have asks for a file already
        remedy = "" if find_unavailable(spec) else " (give a file with its ending or its folder)"
        raise InputError(f"{error}{remedy}") from None


def profile_identity(spec: str) -> str:
    """Text that identifies a profile in results.

    A library name or a short form is its identity. The identity of a file is `NAME.ext@HASH`: its name without folder,
    and the beginning of the hash of its content. So a copy in another folder is an equal profile, and a changed file is
    a different profile. The identity of an unreadable file is its name alone.

    Parameters
    ----------
    spec
        Text of the command line, or a profile from arrays.

    Returns
    -------
    str
        Identity.
    """
    if is_short_form(spec) or is_library_name(spec) or isinstance(spec, ArrayProfile):
        return str(spec)
    path = profile_file(spec)
    if path is None:
        if file_of_identity(spec) is not None and "/" not in spec:
            # from a record; its name may have backslashes
            return spec
        # a path of Windows or POSIX, from a record of another machine
        return PureWindowsPath(spec).name or spec
    try:
        return f"{path.name}@{hash_file(path)[:HASH_DIGITS]}"
    except OSError:
        return path.name


def file_of_identity(identity: str) -> str | None:
    """Name of the file in an identity, without folder and hash; None for other identities.

    Parameters
    ----------
    identity
        Identity of a profile, such as `NAME.csv@HASH`.

    Returns
    -------
    str or None
        Name of the file.
    """
    file = re.fullmatch(rf"(.+)@[0-9a-f]{{{HASH_DIGITS}}}", identity)
    return file[1] if file else None


def read_content(spec: str) -> tuple[str, bytes] | None:
    """Name and content of the file that a text or a value refers to.

    Parameters
    ----------
    spec
        Text of the command line, or a profile from arrays.

    Returns
    -------
    tuple of str and bytes, or None
        Name and content; None if there is no file.

    Raises
    ------
    OSError
        The file cannot be read.
    """
    if isinstance(spec, ArrayProfile):
        return spec.file, spec.content
    path = profile_file(spec)
    if path is None:
        return None
    with open_regular_file(path) as file:
        return path.name, file.read()
