"""The standard rails and wheels.

The files in `data/` are the library and also the pattern for a profile of one's own: copy one, change it and give its
path instead of a name.
"""

from __future__ import annotations

import difflib
import tomllib
from functools import cache
from importlib import resources
from pathlib import Path

from fecontact.errors import InputError
from fecontact.profiles.curve import Kind, Profile
from fecontact.profiles.readers.toml import parse_toml

# Names of the UIC, of DIN, and of British standards for rails that EN 13674-1 has under another one.
ALIASES = {"UIC60": "60E1", "UIC54": "54E1", "S49": "49E1", "U55": "55E1", "BS113A": "56E1"}
"""Other names of rails, which each file's source says."""
_BY_ALIAS = {alias.lower(): name for alias, name in ALIASES.items()}
_DATA = resources.files("fecontact.profiles") / "data"


@cache
def _kinds() -> dict[str, Kind]:
    """Kind of each library profile by its name."""
    files = sorted(_DATA.iterdir(), key=lambda entry: entry.name)
    return {f.name[:-5]: tomllib.loads(f.read_text("utf-8"))["kind"] for f in files if f.name.endswith(".toml")}


def names(kind: Kind | None = None) -> tuple[str, ...]:
    """Names in the library, all or those of one kind."""
    return tuple(name for name, its_kind in _kinds().items() if kind in (None, its_kind))


def in_folder(name: str, folder: str | Path) -> str:
    """Path of a profile in a folder of one's own, by its file's name with or without ending; otherwise the name itself.

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


def is_known(name: str) -> bool:
    """Whether the library has a profile of this name, in any case of letters."""
    return name.lower() in {known.lower() for known in names()} | _BY_ALIAS.keys()


def find(name: str, kind: Kind | None = None) -> str:
    """Name of a profile as the library writes it, from any case of letters or another name of the same rail.

    It is looked for among all or those of one kind.

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
    return parse_toml(toml_text(name), name=name)
