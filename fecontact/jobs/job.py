"""One case of a study in a worker process: solve, store, and say what came of it; nothing is raised."""

from __future__ import annotations

import contextlib
import logging
import socket
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.errors import FecontactError, InputError
from fecontact.fe.memory import SHORT_OF_MEMORY
from fecontact.files import write_text
from fecontact.jobs.provenance import case_id, difference, makers
from fecontact.jobs.store import Kept, Record, kept_case, new_case_folder

# gmsh has one state a process.
_ONE_AT_A_TIME = threading.Lock()

SolveInto = Callable[[Case, Path, str, Mapping[str, Any]], None]
"""Solve a case and write its files into a folder: (case, folder, id, settings)."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """A case for a worker.

    Attributes
    ----------
    name, out
        The case's id, and the study's folder.
    made_by
        What decides about numbers where the study was started (`identity.makers`); a worker must agree with it.
    settings
        Settings of the command; `run` names the run, whose own results are taken even with `force`.
    solve_into
        Writes the case's files; a function that a worker can import.
    force
        Solve also what is finished.
    alone
        Whether no other case of the study runs beside it on this machine.
    """

    case: Case
    name: str
    out: Path
    made_by: Mapping[str, str]
    settings: Mapping[str, Any]
    solve_into: SolveInto
    force: bool = False
    alone: bool = False


@dataclass(frozen=True, kw_only=True)
class Done:
    """What came of a task: the result record, or why there is none; `short_of_memory` if alone it may go better."""

    name: str
    record: Record | None = None
    failure: str | None = None
    short_of_memory: bool = False


class _ShortOfMemory(FecontactError):
    """The case was solved, but less far than it would have been alone."""


def run_task(task: Task) -> Done:
    """Solve a case and put its folder into the store.

    A case that was short of memory while others ran beside it is not stored: its result would depend on them.
    """
    with _ONE_AT_A_TIME:
        _reset_peak_memory()
        try:
            return Done(name=task.name, record=_record(task))
        except MemoryError:
            return _failed(task, "failed: out of memory", short=True)
        except FecontactError as error:
            short = isinstance(error, _ShortOfMemory) or SHORT_OF_MEMORY in str(error)
            return _failed(task, f"failed: {error}", short=short)
        except OSError as error:
            return _failed(task, f"failed: {error.strerror or error} ({error.filename or task.out})")
        except Exception as error:
            # a fault of the program: the row names it, the rest goes on
            file = error_file(task.out, task.name)
            with contextlib.suppress(OSError):
                write_text(file, traceback.format_exc())
            return _failed(task, f"failed: {type(error).__name__}: {error}; see {file.name}")


def error_file(out: Path, name: str) -> Path:
    """Where the traceback of a case goes that ended with an unexpected error."""
    return out / "cases" / f"{name}.error.txt"


def _failed(task: Task, failure: str, *, short: bool = False) -> Done:
    return Done(name=task.name, failure=" ".join(failure.split()), short_of_memory=short and not task.alone)


def _record(task: Task) -> Record:
    if changes := difference(task.made_by, makers(task.case)):
        raise InputError(f"worker on {socket.gethostname()} is not like the one that started the study: {changes}")
    kept = kept_case(task.out, task.name, task.made_by)
    if kept.record is not None and (not task.force or _of_this_run(kept, task)):
        # solved already, by a worker that was lost before it could say so
        return kept.record
    with _memory_warnings() as warnings, new_case_folder(task.out, task.name) as folder:
        task.solve_into(task.case, folder, task.name, task.settings)
        if case_id(task.case) != task.name:
            raise InputError("a profile's file changed while the case was solved; run the study again")
        if not task.alone and (warnings or SHORT_OF_MEMORY in (folder / "result.json").read_text("utf-8")):
            raise _ShortOfMemory("there was not enough memory to solve it as far as it would have been alone")
    error_file(task.out, task.name).unlink(missing_ok=True)
    stored = kept_case(task.out, task.name, task.made_by)
    if stored.record is None:
        raise OSError(f"what was written cannot be read again: {stored.problem}")
    return stored.record


def _of_this_run(kept: Kept, task: Task) -> bool:
    settings = (kept.record or {})["provenance"]["settings"]
    return "run" in settings and settings["run"] == task.settings.get("run")


@contextmanager
def _memory_warnings() -> Iterator[list[str]]:
    """Collect warnings of the pipeline that memory was short, which leave no other trace in a result."""
    found: list[str] = []

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if SHORT_OF_MEMORY in record.getMessage():
                found.append(record.getMessage())

    collector = Collector(logging.WARNING)
    logger = logging.getLogger("fecontact")
    logger.addHandler(collector)
    try:
        yield found
    finally:
        logger.removeHandler(collector)


def _reset_peak_memory() -> None:
    """Make the peak memory that of the case and not that of the largest case of the process; Linux only."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
