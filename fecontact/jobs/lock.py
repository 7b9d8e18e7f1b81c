"""One run at a time in a folder: locks of the operating system, which end with the process that holds them."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO

from fecontact.errors import InputError

LOCK = "run.lock"


@contextmanager
def locked(out: Path, part: tuple[int, int] | None = None) -> Iterator[Path]:
    """Hold the folder of a run, or one part of it beside the other parts; yields the lock file.

    Parameters
    ----------
    part
        (i, N): parts share the folder with each other, but not with a run of the whole.

    Raises
    ------
    InputError
        If another process holds it (the message says which), or if the file system has no locks.
    """
    out.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        if part is None:
            stack.enter_context(_held(out / LOCK, f"process {os.getpid()} on {socket.gethostname()}"))
        else:
            me = f"process {os.getpid()} on {socket.gethostname()}, part {part[0]}/{part[1]}"
            others = f"runs of parts (--part), see {LOCK.replace('.lock', '.part-*.lock')}"
            stack.enter_context(_held(out / LOCK, others, shared=True))
            stack.enter_context(_held(out / f"run.part-{part[0]}-of-{part[1]}.lock", me))
        yield out / LOCK


@contextmanager
def _held(path: Path, holder: str, *, shared: bool = False) -> Iterator[None]:
    # not truncated before it is ours: it says who holds it
    with open(os.open(path, os.O_RDWR | os.O_CREAT, 0o666), "r+", encoding="utf-8") as file:
        try:
            _lock(file, shared)
        except BlockingIOError:
            raise InputError(
                f"{path.parent} is in use by {file.read().strip() or 'another run'}; wait for it, end it, or give"
                " another --out"
            ) from None
        except OSError as error:
            raise InputError(
                f"{path}: its file system cannot lock files ({error.strerror}); choose another --out"
            ) from error
        file.truncate(0)
        file.write(holder + "\n")
        file.flush()
        yield


if sys.platform == "win32":
    import msvcrt

    def _lock(file: IO[str], shared: bool) -> None:
        # Windows has no shared locks here: parts run one after the other. A locked byte cannot be read, so it is one
        # far behind the text.
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
