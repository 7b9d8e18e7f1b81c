"""One job in a worker process: do its work, store what it wrote, and say what came of it; nothing is raised."""

from __future__ import annotations

import contextlib
import socket
import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from fecontact.errors import FecontactError, InputError, NotEnoughMemory
from fecontact.files import write_text
from fecontact.jobs.store import Kept, Origin, difference, kept_folder, new_folder

# gmsh has one state a process.
_ONE_AT_A_TIME = threading.Lock()


class Work(Protocol):
    """What a job does; something that a worker can import."""

    def __call__(self, folder: Path, finished: Path | None) -> bool:
        """Write the job's files into a folder; True if there was not enough memory to do all that was asked for.

        `finished` is the job's own folder, where its fields are to be evaluated again instead of being solved.
        """


@dataclass(frozen=True, kw_only=True)
class Job:
    """Something to be solved and kept in a folder of its own.

    Attributes
    ----------
    name, folder
        The job's id, and where it is kept when it is finished.
    origin
        What decides about its numbers where the run was started; a worker must agree with it.
    origin_here
        Finds the same on a worker.
    read
        Makes what the run needs to know of the finished folder: on the worker, whose numbers do not depend on who asks.
        It raises an `InputError` where the folder is of another layout, and the job is done again.
    label
        What it is called while it is under way; its name if not given.
    run
        Names the run, whose own results are taken even with `force`.
    force
        Solve also what is finished.
    alone
        Whether no other job runs beside it on this machine.
    """

    name: str
    folder: Path
    origin: Origin
    origin_here: Callable[[], Origin]
    work: Work
    read: Callable[[Path], Any] | None = None
    label: str = ""
    run: str = ""
    force: bool = False
    alone: bool = False


@dataclass(frozen=True, kw_only=True)
class Done:
    """What came of a job.

    Attributes
    ----------
    failure
        Why it has no result, None if it has one.
    short_of_memory
        Whether alone it may go better.
    value
        What `Job.read` made of it.
    unreadable
        Why what was finished before had to be done again.
    """

    name: str
    failure: str | None = None
    short_of_memory: bool = False
    value: Any = None
    unreadable: str | None = None


def run_job(job: Job) -> Done:
    """Do a job and put its folder into the store.

    A job that was short of memory while others ran beside it is not stored: its result would depend on them.
    """
    with _ONE_AT_A_TIME:
        _reset_peak_memory()
        try:
            return _do(job)
        except MemoryError:
            return _failed(job, "out of memory", short=True)
        except FecontactError as error:
            return _failed(job, str(error), short=isinstance(error, NotEnoughMemory))
        except OSError as error:
            # a disk that is full, most often
            return _failed(job, f"{error.strerror or error} ({error.filename})" if error.filename else str(error))
        except Exception as error:
            # a fault of the program: the row names it, the rest goes on
            file = error_file(job.folder)
            with contextlib.suppress(OSError):
                write_text(file, traceback.format_exc())
            return _failed(job, f"{type(error).__name__}: {error}; see {file.name}")


def error_file(folder: Path) -> Path:
    """Where the traceback of a job goes that ended with an unexpected error."""
    return folder.with_name(f"{folder.name}.error.txt")


def _failed(job: Job, failure: str, *, short: bool = False) -> Done:
    return Done(name=job.name, failure=failure, short_of_memory=short and not job.alone)


def _do(job: Job) -> Done:
    if problem := unlike(job):
        raise InputError(problem)
    kept, unreadable = kept_folder(job.folder, job.name, job.origin), None
    if kept.usable and (not job.force or _of_this_run(kept, job)):
        # done already: by an earlier run, or by a worker that was lost before it could say so
        try:
            return Done(name=job.name, value=_value(job))
        except InputError as error:
            unreadable = str(error)
    judged = kept.found and kept.problem is None and not job.force and unreadable is None
    with new_folder(job.folder, job.name, job.origin, job.run) as folder:
        short = job.work(folder, job.folder if judged else None)
        if short and not job.alone:
            raise NotEnoughMemory("there was not enough memory to solve it as far as it would have been alone")
    error_file(job.folder).unlink(missing_ok=True)
    stored = kept_folder(job.folder, job.name, job.origin)
    if not stored.usable:
        raise OSError(f"what was written cannot be read again: {stored.problem or stored.outdated}")
    return Done(name=job.name, value=_value(job), unreadable=unreadable)


def _value(job: Job) -> Any:
    return None if job.read is None else job.read(job.folder)


def unlike(job: Job) -> str | None:
    """Why this process must not do a job: what decides about its numbers is not as where the run was started."""
    here = job.origin_here()
    changes = [
        difference(there, own)
        for there, own in (
            (job.origin.solved_by, here.solved_by),
            (job.origin.evaluated_by, here.evaluated_by),
        )
    ]
    if not any(changes):
        return None
    said = ", ".join(filter(None, changes))
    return f"worker on {socket.gethostname()} is not like the one that started the run: {said}"


def _of_this_run(kept: Kept, job: Job) -> bool:
    return bool(job.run) and kept.run == job.run


def _reset_peak_memory() -> None:
    """Make the peak memory that of the job and not that of the largest one of the process; Linux only."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
