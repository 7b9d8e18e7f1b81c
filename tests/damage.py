"""Damage to each file of a folder of results, and the readers that notice it."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

from fecontact.errors import InputError
from fecontact.jobs.store import MANIFEST, read_intact_manifest

# Drawn, told or held anew by the next run, and read by nobody: a picture that was damaged is seen to be.
UNREAD = frozenset({".png", ".svg", ".html", ".pvd", ".log", ".lock"})


def damages(content: bytes) -> Iterator[tuple[str, bytes | None]]:
    """Damaged contents of a file: gone, empty, cut, or with a changed bit.

    The bit is changed at one of three places.
    """
    yield "removed", None
    yield "empty", b""
    yield "cut", content[: len(content) // 2]
    for third in range(3):
        at = (2 * third + 1) * len(content) // 6
        yield f"byte {at}", content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


def unnoticed(folder: Path, readers: tuple[Callable[[], object], ...], unread: frozenset[str] = UNREAD) -> set[str]:
    """Names of files in the folder with damage that no reader refuses in a single line."""
    names = set()
    for path in sorted(path for path in folder.rglob("*") if path.is_file() and path.suffix not in unread):
        content = path.read_bytes()
        for _, data in damages(content):
            path.unlink() if data is None else path.write_bytes(data)
            if not any(_refused(reader) for reader in readers) and not _says_the_same(path, content):
                names.add(path.relative_to(folder).as_posix())
            path.write_bytes(content)
    return names


def files_without_checksum(folder: Path) -> set[str]:
    """Files of a finished job with damage that the checksums do not reveal.

    Every reader checks the checksums first; pictures have checksums too. A bit of the versions in the manifest is not
    looked for: it makes the result that of another version.
    """

    def whole() -> None:
        if isinstance(problem := read_intact_manifest(folder), str):
            raise InputError(problem)

    return unnoticed(folder, (whole,), unread=frozenset()) - {MANIFEST}


def _says_the_same(path: Path, original: bytes) -> bool:
    """Whether a changed document has equal numbers; the last of 17 digits may differ."""
    try:
        return path.suffix == ".json" and json.loads(path.read_bytes()) == json.loads(original)
    except (OSError, ValueError):
        return False


def _refused(reader: Callable[[], object]) -> bool:
    try:
        reader()
    except InputError as error:
        # in a line
        return "\n" not in str(error)
    return False
