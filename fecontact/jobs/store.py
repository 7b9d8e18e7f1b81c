"""Finished jobs in separate folders, and locks of these folders.

A lock lets only 1 process at a time write into a folder.
"""

from __future__ import annotations

import contextlib
import errno
import glob
import itertools
import os
import re
import secrets
import shutil
import socket
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from fecontact.errors import InputError
from fecontact.files import check_regular_file, describe_object, hash_file, read_json, write_json

MANIFEST = "stored.json"
SCHEMA = "fecontact/stored/1"
# Ending of the temporary name of a folder that a new folder replaces.
_REPLACED = ".replaced"
# Names of temporary folders and files, and of the progress of a job.
_LEFTOVER = re.compile(r"\..+\.([0-9a-f]{12}(\.[^.]+)?|under-way)")

OWN_CRITERION_KEY, LIMIT_MARK = "own criterion ", ", limit "
"""Beginning of the name of a user's criterion in an origin, and mark between the digest and the limit in its value."""
CRITERIA_KEYS = ("criterion ", OWN_CRITERION_KEY, "creep ")
"""Beginnings of the names of all criteria, frictions and creepages in an origin."""


@dataclass(frozen=True, kw_only=True)
class Origin:
    """Versions and sources that decide about a result in addition to its inputs.

    Attributes
    ----------
    solved_by
        Versions and sources of the solution, by name.
    evaluated_by
        Versions, sources and criteria of the evaluation, by name.
    """

    solved_by: Mapping[str, str]
    evaluated_by: Mapping[str, str]


@dataclass(frozen=True, kw_only=True)
class StoredJob:
    """State of a stored job on disk.

    Attributes
    ----------
    found
        Whether the job has a folder.
    problem
        Reason for solving the job again.
    outdated
        Reason for evaluating the job again; its stored fields are enough for this.
    run
        Name of the run that finished the job.
    """

    found: bool = False
    problem: str | None = None
    outdated: str | None = None
    run: str = ""

    @property
    def usable(self) -> bool:
        """Whether the stored result may be taken unchanged."""
        return self.found and self.problem is None and self.outdated is None


@contextmanager
def replace_folder(final: Path, name: str, origin: Origin, run: str = "") -> Iterator[Path]:
    """Open a temporary folder for a job's files.

    If nothing is raised, the temporary folder replaces `final` in one step. Checksums of the files are written first. A
    reader, also after a killed run, sees the old folder, no folder, or the complete new folder. Files of somebody else
    in the old folder are moved into the new folder.

    Parameters
    ----------
    final
        Folder of the job.
    name
        Id of the job.
    origin
        Versions and sources of the result.
    run
        Name of the run.

    Yields
    ------
    Path
        The temporary folder.

    Raises
    ------
    InputError
        If a link or a file has the name of the folder.
    """
    if final.is_symlink() or (final.exists() and not final.is_dir()):
        raise InputError(
            f"{final} is {describe_object(final)} instead of a folder; remove it, or give a different --out"
        )
    temporary = _name_temporary_folder(final)
    try:
        temporary.mkdir(parents=True)
        yield temporary
        write_manifest(temporary, [path for path in temporary.rglob("*") if path.is_file()], name, origin, run)
        _replace_folder(temporary, final)
    except OSError as error:
        # the user knows the final name
        if error.filename is not None:
            error.filename = str(error.filename).replace(str(temporary), str(final))
        raise
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        _progress_file(final, name).unlink(missing_ok=True)


def write_job_progress(folder: Path, name: str, part: float, words: str) -> None:
    """Write the finished fraction and the present activity of a job beside its folder.

    Parameters
    ----------
    folder
        Folder of the job.
    name
        Id of the job.
    part
        Finished fraction (no unit, 0 to 1).
    words
        Present activity.
    """
    with contextlib.suppress(OSError):
        write_json(_progress_file(folder, name), [part, words])


def read_job_progress(folder: Path, name: str) -> tuple[float, str]:
    """Read the finished fraction and the activity that a job wrote last.

    Parameters
    ----------
    folder
        Folder of the job.
    name
        Id of the job.

    Returns
    -------
    tuple of float and str
        Fraction and activity in brackets; (0, "") if the job wrote nothing.
    """
    with contextlib.suppress(InputError):
        part, words = read_json(_progress_file(folder, name))
        return float(part), f"({words})"
    return 0.0, ""


def _progress_file(folder: Path, name: str) -> Path:
    return folder.with_name(f".{name}.under-way")


def write_manifest(folder: Path, files: Iterable[Path], name: str, origin: Origin, run: str = "") -> Path:
    """Write the manifest of a job's result: checksums of its files, and the versions and sources.

    Parameters
    ----------
    folder
        Folder of the result.
    files
        Files of the result, in this folder.
    name
        Id of the job.
    origin
        Versions and sources of the result.
    run
        Name of the run.

    Returns
    -------
    Path
        The manifest.
    """
    manifest = {
        "schema": SCHEMA,
        "id": name,
        "solved_by": dict(origin.solved_by),
        "evaluated_by": dict(origin.evaluated_by),
        "run": run,
        "files": {path.relative_to(folder).as_posix(): hash_file(path) for path in sorted(files)},
    }
    return write_json(folder / MANIFEST, manifest)


def _name_temporary_folder(final: Path, ending: str = "") -> Path:
    return final.with_name(f".{final.name}.{secrets.token_hex(6)}{ending}")


def _replace_folder(temporary: Path, final: Path) -> None:
    """Move a temporary folder to its final name; the folder that had this name is removed.

    If another process stores the folder at the same time, the move is repeated.
    """
    replaced = _name_temporary_folder(final, _REPLACED)
    while True:
        with contextlib.suppress(FileNotFoundError):
            final.rename(replaced)
        try:
            temporary.rename(final)
            break
        except OSError as error:
            # a worker that was taken for lost has stored the same job meanwhile
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
            _remove_replaced_folder(replaced, final)
    _remove_replaced_folder(replaced, final)


def _remove_replaced_folder(replaced: Path, final: Path) -> None:
    """Remove a replaced folder; files of somebody else are moved into the new folder."""
    if not replaced.exists():
        return
    for path in _list_foreign_files(replaced, final):
        target = _find_free_path(final, path.relative_to(replaced))
        target.parent.mkdir(parents=True, exist_ok=True)
        path.rename(target)
    shutil.rmtree(replaced, ignore_errors=True)


def _list_foreign_files(replaced: Path, final: Path) -> list[Path]:
    """Files, links and pipes in a replaced folder that its manifest does not list.

    If the manifest is damaged, the names of the new files decide.
    """
    manifest = _read_manifest(replaced)
    if isinstance(manifest, str):
        own_names = {path.relative_to(final).as_posix() for path in final.rglob("*") if not path.is_dir()}
    else:
        own_names = {*manifest["files"], MANIFEST}
    return [
        path
        for path in sorted(replaced.rglob("*"))
        if (path.is_symlink() or not path.is_dir()) and path.relative_to(replaced).as_posix() not in own_names
    ]


def _find_free_path(folder: Path, name: Path) -> Path:
    """Path of a file in a folder; the first part of its name gets a number if a new file has this name."""
    first, *further = name.parts
    for number in itertools.count():
        path = Path(folder, f"{first}.{number}" if number else first, *further)
        inner_folders = path.parents[: len(further)]
        if not os.path.lexists(path) and all(inner.is_dir() or not os.path.lexists(inner) for inner in inner_folders):
            return path
    raise AssertionError("unreachable: the numbers do not end")


def remove_leftovers(parent: Path, name: str | None = None) -> None:
    """Remove temporary folders and files of killed processes.

    A folder gets its name back if a kill interrupted its replacement.

    Parameters
    ----------
    parent
        Folder of the store.
    name
        Id of a job; None for all jobs in the store. Then no other process may be using the store.
    """
    for path in parent.glob(".*" if name is None else f".{glob.escape(name)}.*"):
        if path.is_symlink() or not _LEFTOVER.fullmatch(path.name):
            continue
        if path.is_dir() and path.suffix == _REPLACED:
            _end_replacement(path)
        elif path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def _end_replacement(replaced: Path) -> None:
    """Remove a folder that was replaced; if its successor is missing, give it its name back."""
    final = replaced.with_name(replaced.name[1:].rsplit(".", 2)[0])
    if os.path.lexists(final):
        _remove_replaced_folder(replaced, final)
    else:
        replaced.rename(final)


def check_stored_job(folder: Path, name: str, origin: Origin) -> StoredJob:
    """Check all files of a stored job, and return its state.

    Parameters
    ----------
    folder
        Folder of the job.
    name
        Id of the job.
    origin
        Versions and sources that the result must have.

    Returns
    -------
    StoredJob
        The state.
    """
    if not folder.is_dir():
        return StoredJob()
    manifest = read_intact_manifest(folder)
    if isinstance(manifest, str):
        return StoredJob(found=True, problem=manifest)
    if manifest["id"] != name:
        return StoredJob(found=True, problem=f"the folder has the result of different inputs ({manifest['id']})")
    if changes := describe_differences(manifest["solved_by"], origin.solved_by):
        is_version = not _has_only_criteria(manifest["solved_by"], origin.solved_by)
        reason = "made by a different version" if is_version else "made with different criteria"
        return StoredJob(found=True, problem=f"{reason}: {changes}")
    changes = describe_differences(manifest["evaluated_by"], origin.evaluated_by)
    is_version = not _has_only_criteria(manifest["evaluated_by"], origin.evaluated_by)
    reason = "evaluated by a different version" if is_version else "judged by different criteria"
    outdated = f"{reason}: {changes}" if changes else None
    return StoredJob(found=True, outdated=outdated, run=manifest["run"])


def read_intact_manifest(folder: Path) -> dict[str, Any] | str:
    """Read the manifest of a folder, and check that all its files are unchanged.

    Parameters
    ----------
    folder
        Folder of a result.

    Returns
    -------
    dict or str
        The manifest, or the problem of the folder.
    """
    manifest = _read_manifest(folder)
    if isinstance(manifest, str):
        return manifest
    return find_damage(folder, manifest["files"]) or manifest


def _read_manifest(folder: Path) -> dict[str, Any] | str:
    """Read the manifest of a folder; returns the problem if it cannot be used.

    The problem is a text: the manifest is missing or damaged, or has another layout.
    """
    try:
        manifest = read_json(folder / MANIFEST)
    except InputError:
        return f"{MANIFEST} is missing or damaged"
    if not isinstance(manifest, dict) or manifest.get("schema") != SCHEMA:
        return f"{MANIFEST} does not have the layout {SCHEMA}"
    shape = {"id": str, "solved_by": dict, "evaluated_by": dict, "run": str, "files": dict}
    if (
        not all(isinstance(manifest.get(key), expected_type) for key, expected_type in shape.items())
        or not manifest["files"]
    ):
        return f"{MANIFEST} is damaged"
    return manifest


def find_damage(folder: Path, files: Mapping[str, str]) -> str | None:
    """Describe the first damaged or missing file of a folder.

    Parameters
    ----------
    folder
        Folder of a result.
    files
        Checksum of each file by its path in the folder. Paths that leave the folder count as damage.

    Returns
    -------
    str or None
        The damage; None if all files are unchanged.
    """
    for name, digest in files.items():
        try:
            path = folder / name
            if not path.resolve().is_relative_to(folder.resolve()):
                return f"{name} is not a file of this folder"
            actual = hash_file(path)
        except FileNotFoundError:
            return f"{name} is missing"
        except OSError as error:
            return f"{name} cannot be read ({error.strerror})"
        except ValueError:
            return f"there are checksums of {name!r:.60}, which cannot be the name of a file"
        if actual != digest:
            return f"{name} is damaged (its checksum differs)"
    return None


def describe_differences(old: Mapping[str, str], new: Mapping[str, str]) -> str:
    """Differences between two origins of a result in words, such as `numpy 2.1.0 -> 2.2.0`.

    Parameters
    ----------
    old, new
        Versions and sources by name.

    Returns
    -------
    str
        The differences, separated by commas; empty without differences.

    Examples
    --------
    >>> from fecontact.jobs.store import describe_differences
    >>> describe_differences({"numpy": "2.1.0"}, {"numpy": "2.2.0"})
    'numpy 2.1.0 -> 2.2.0'
    """
    return ", ".join(_describe_difference(key, old.get(key), new.get(key)) for key in _list_changes(old, new))


def _list_changes(old: Mapping[str, str], new: Mapping[str, str]) -> list[str]:
    """Names with different values in two origins."""
    return [key for key in dict.fromkeys((*new, *old)) if old.get(key) != new.get(key)]


def _has_only_criteria(old: Mapping[str, str], new: Mapping[str, str]) -> bool:
    """Whether only criteria, friction or creepages differ between two origins."""
    return all(key.startswith(CRITERIA_KEYS) for key in _list_changes(old, new))


def _describe_difference(key: str, old_value: str | None, new_value: str | None) -> str:
    """Describe a difference between two origins in words; a digest of a user's function is not shown."""
    if not key.startswith(OWN_CRITERION_KEY):
        return f"{key} {old_value or 'none'} -> {new_value or 'none'}"
    if old_value is None or new_value is None:
        return f"{key} is {'new' if old_value is None else 'left out'}"
    (old_digest, _, old_limit), (new_digest, _, new_limit) = (
        value.partition(LIMIT_MARK) for value in (old_value, new_value)
    )
    changes = [
        *["function or unit changed"] * (old_digest != new_digest),
        *[f"limit {old_limit} -> {new_limit}"] * (old_limit != new_limit),
    ]
    return f"{key}: {' and '.join(changes)}"


# --- Locks of the operating system. With them only one run at a time uses a folder; they end with the process.

LOCK = "run.lock"


@contextmanager
def lock_folder(out: Path, part: tuple[int, int] | None = None) -> Iterator[Path]:
    """Lock the folder of a run, for the complete run or for a part.

    Parameters
    ----------
    out
        Folder of the run.
    part
        (i, N): parts share the folder with each other, but not with a complete run.

    Yields
    ------
    Path
        The lock file.

    Raises
    ------
    InputError
        If another process holds the folder (the message names it), or if the file system has no locks.
    """
    out.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        if part is None:
            stack.enter_context(_lock_file(out / LOCK, f"process {os.getpid()} on {socket.gethostname()}"))
        else:
            holder = f"process {os.getpid()} on {socket.gethostname()}, part {part[0]}/{part[1]}"
            other_holders = f"runs of parts (--part), see {LOCK.replace('.lock', '.part-*.lock')}"
            stack.enter_context(_lock_file(out / LOCK, other_holders, shared=True))
            stack.enter_context(_lock_file(out / f"run.part-{part[0]}-of-{part[1]}.lock", holder))
        yield out / LOCK


@contextmanager
def _lock_file(path: Path, holder: str, *, shared: bool = False) -> Iterator[None]:
    """Lock a file, and write the name of the holder into it.

    Raises
    ------
    InputError
        If another process holds the file, if the file system has no locks, or if the path is not a regular file.
    """
    try:
        # the text of a file behind a link would be lost, and a pipe has no text
        check_regular_file(path, link_allowed=False)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; remove it, or give a different --out") from None
    # not truncated before it is locked: its text names the present holder
    with open(os.open(path, os.O_RDWR | os.O_CREAT, 0o666), "r+", encoding="utf-8") as file:
        try:
            _lock(file, shared)
        except BlockingIOError:
            raise InputError(
                f"{path.parent} is in use by {file.read().strip() or 'another run'}; wait for it, end it, or give"
                " a different --out"
            ) from None
        except OSError as error:
            raise InputError(
                f"{path}: its file system cannot lock files ({error.strerror}); give an --out on a different file"
                " system"
            ) from error
        file.truncate(0)
        file.write(holder + "\n")
        file.flush()
        yield


if sys.platform == "win32":
    import msvcrt

    def _lock(file: IO[str], shared: bool) -> None:
        """Lock a file for this process; a `BlockingIOError` if another process has it."""
        # Windows has no shared locks here: parts run one after the other. A locked byte cannot be read, so a byte far
        # behind the text is locked.
        file.seek(1 << 30)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except PermissionError as error:
            file.seek(0)
            raise BlockingIOError from error
        file.seek(0)

else:
    import fcntl

    def _lock(file: IO[str], shared: bool) -> None:
        fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
