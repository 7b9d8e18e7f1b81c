"""Damage to each file of a folder of results, and whether those who read it notice."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

from fecontact.errors import InputError
from fecontact.jobs.store import MANIFEST, whole_manifest

# Drawn, told or held anew by the next run, and read by nobody: a picture that was damaged is seen to be.
UNREAD = frozenset({".png", ".svg", ".html", ".pvd", ".log", ".lock"})


def damages(whole: bytes) -> Iterator[tuple[str, bytes | None]]:
    """What may have become of a file: gone, empty, cut, or one bit changed at one of three places."""
    yield "removed", None
    yield "empty", b""
    yield "cut", whole[: len(whole) // 2]
    for part in range(3):
        at = (2 * part + 1) * len(whole) // 6
        yield f"byte {at}", whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :]


def unnoticed(folder: Path, readers: tuple[Callable[[], object], ...], unread: frozenset[str] = UNREAD) -> set[str]:
    """Names of the files below a folder whose damage none of its readers refuses in a line."""
    found = set()
    for path in sorted(path for path in folder.rglob("*") if path.is_file() and path.suffix not in unread):
        whole = path.read_bytes()
        for _, data in damages(whole):
            path.unlink() if data is None else path.write_bytes(data)
            if not any(_refused(reader) for reader in readers) and not _says_the_same(path, whole):
                found.add(path.relative_to(folder).as_posix())
            path.write_bytes(whole)
    return found


def files_without_checksum(folder: Path) -> set[str]:
    """Files of a finished job whose damage is not noticed by what every reader asks first; pictures have theirs too.

    A bit of the versions in the manifest is not looked for: it makes the result that of another version.
    """

    def whole() -> None:
        if isinstance(problem := whole_manifest(folder), str):
            raise InputError(problem)

    return unnoticed(folder, (whole,), unread=frozenset()) - {MANIFEST}


def _says_the_same(path: Path, whole: bytes) -> bool:
    """Whether a changed document has the same numbers: the last of 17 digits may be another one."""
    try:
        return path.suffix == ".json" and json.loads(path.read_bytes()) == json.loads(whole)
    except (OSError, ValueError):
        return False


def _refused(reader: Callable[[], object]) -> bool:
    try:
        reader()
    except InputError as error:
        # in a line
        return "\n" not in str(error)
    return False
