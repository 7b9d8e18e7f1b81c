"""What is said while the program works: on a terminal one line that is kept up to date, elsewhere a line now and then.

Everything goes to standard error; standard output has results alone. Long commands keep both in a log file as well.
"""

from __future__ import annotations

import errno
import logging
import math
import re
import shlex
import shutil
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING

from fecontact import __version__
from fecontact.jobs.remaining import Progress, duration

if TYPE_CHECKING:
    from fecontact.case import Case

# Seconds between two lines of progress where nobody watches: less than the 10 s of a position by finite elements, each
# of which has its line so, and many times what a pair of a fleet takes.
_BETWEEN_LINES_S = 5.0
_LOG = logging.getLogger("fecontact")
_PART = r"\([1-9]\d* of \d+ [^)]*\)"
_LOG.setLevel(logging.INFO)
# it goes to the log file of a command alone
_LOG.addHandler(logging.NullHandler())
_LOG.propagate = False

# What the steps of a solution are called in the record of its times, in words.
_WORDS = {
    "place": "putting the wheel on the rail",
    "expect the patch": "looking for the patch on a half-space",
    "mesh": "meshing both bodies",
    "assemble": "assembling the stiffness",
    "factorise": "factorising the stiffness",
    "couple": "coupling both surfaces",
    "contact": "solving the contact",
    "resolve": "reading the pressure on finer nodes",
    "recover": "displacements and stresses",
    "ladder": "comparing with Hertz",
}


@contextmanager
def solving() -> Iterator[Callable[[str], None]]:
    """Progress of a single case: hears the name of each step, on which meshes it is, and tells it in words."""
    with _line() as say:

        def step(name: str) -> None:
            stage, _, what = name.rpartition(": ")
            words = _WORDS.get(what, what)
            say(f"{stage}: {words}" if stage else words, stage)

        yield step


@contextmanager
def many(what: str, *, quiet: bool = False, before: Callable[[int], str] | None = None) -> Iterator[Progress]:
    """Progress of many jobs: hears how many are done, how many there are, and what is under way.

    Parameters
    ----------
    what
        What they are called, such as `cases`.
    quiet
        Keep it for the log.
    before
        What is announced of so many jobs when the first one begins: by then all inputs have been checked.
    """
    with several(what, quiet=quiet) as heard:
        show, unsaid = heard[what], [before]

        def announced(number: int, count: int, text: str) -> None:
            if words := unsaid.pop() if unsaid else None:
                announce(words(count), quiet=quiet)
            show(number, count, text)

        yield announced


@contextmanager
def several(*kinds: str, quiet: bool = False) -> Iterator[Mapping[str, Progress]]:
    """Progress of jobs of several kinds, done one kind after the other: as `many`, by what they are called."""
    with _line(quiet=quiet) as say:
        yield {what: partial(_count, say, what) for what in kinds}


def _count(say: Callable[[str, str], None], what: str, number: int, count: int, text: str) -> None:
    # a line for each job that is done, and for each of its parts
    say(f"{number} of {count} {what} done: {text}", f"{what} {number} {re.findall(_PART, text)}")


@contextmanager
def logged(path: Path) -> Iterator[None]:
    """Add the command, what it says and how it ends to a log file; one that cannot be written any more is no error.

    Raises
    ------
    OSError
        If the file cannot be opened, or is a link or a pipe: a link may lead out of the folder, and a pipe would wait
        for its reader.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_symlink() or path.is_fifo():
        raise OSError(errno.EINVAL, "a link or a pipe, and no file; remove it", str(path))
    handler = _LogFile(path, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)-7s %(message)s"))
    _LOG.addHandler(handler)
    _LOG.info(f"fecontact {__version__}: {shlex.join(sys.argv)}")
    try:
        yield
        _LOG.info("ended")
    except BaseException as error:
        _LOG.error(f"ended by {type(error).__name__}: {error}".rstrip(": "))
        raise
    finally:
        _LOG.removeHandler(handler)
        with suppress(OSError):
            handler.close()


class _LogFile(logging.FileHandler):
    def handleError(self, record: logging.LogRecord) -> None:
        """A full disk loses the log, not the results."""


def say(text: str, *, quiet: bool = False) -> None:
    """Print a result, or keep it for the log."""
    _LOG.info(text)
    if not quiet:
        print(text)


def announce(*lines: str, quiet: bool = False) -> None:
    """Print what is to come before it begins, or keep it for the log."""
    for line in lines:
        _LOG.info(line)
        if not quiet:
            print(line, file=sys.stderr, flush=True)


def log_only(text: str, *, warning: bool = False) -> None:
    """Keep for the log what is seen elsewhere, as in a table."""
    _LOG.log(logging.WARNING if warning else logging.INFO, text)


def print_reasons(title: str, reasons: Mapping[str, str]) -> None:
    """Print why some jobs have no usable result, grouped by reason; print nothing if all are usable."""
    if reasons:
        _problem(f"{title}:")
    for reason in dict.fromkeys(reasons.values()):
        names = [name for name, why in reasons.items() if why == reason]
        _problem(f"  {', '.join(names)}: {reason}")


def _problem(text: str) -> None:
    _LOG.warning(text)
    print(text, file=sys.stderr)


def tell_notes(notes: Iterable[str]) -> None:
    """Print what is to be known of inputs before anything is computed with them."""
    for note in notes:
        _problem(f"note: {note}")


def tell_geometry(cases: Sequence[Case]) -> None:
    """Print the geometry of each pair of own profiles at its first case that has a place on the rail."""
    from fecontact.outputs.own_profiles import own_profiles_record
    from fecontact.solving.placing import placed_or_why

    told: set[tuple[object, ...]] = set()
    for case in cases:
        pair = (case.rail, case.wheel, case.rail_file, case.wheel_file, case.track, case.inclination_rad)
        if pair not in told and not isinstance(placement := placed_or_why(case), str):
            told.add(pair)
            at = f"at a shift of {case.lateral_shift_mm:g} mm"
            announce(*(f"{at}: {text}" for text in own_profiles_record(case, placement).values()))


@contextmanager
def _line(*, quiet: bool = False) -> Iterator[Callable[[str, str], None]]:
    """Where progress goes: takes a text and a key; the log gets it when the key changes.

    Where nobody watches it is printed then, the first and the last one always, others not too often.
    """
    from rich.console import Console

    console = Console(stderr=True)
    start = time.monotonic()
    watched = console.is_terminal and not quiet
    said: str | None = None
    printed, held = -math.inf, ""

    def plain(text: str, key: str) -> None:
        nonlocal said, printed, held
        now = time.monotonic()
        if key and key != said:
            _LOG.info(text)
            held = f"{duration(now - start):>7} {text}"
            if now - printed >= _BETWEEN_LINES_S:
                release()
                printed = now
        said = key

    def release() -> None:
        nonlocal held
        if held and not watched and not quiet:
            print(held, file=sys.stderr, flush=True)
        held = ""

    if not watched:
        try:
            yield plain
        finally:
            release()
        return
    from rich import progress
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with progress.Progress(*columns, console=console, transient=True) as shown:
        task = shown.add_task("", total=None)

        def update(text: str, key: str) -> None:
            plain(text, key)
            shown.update(task, description=text)

        yield update


@contextmanager
def telling_replaced(out: Path | None) -> Iterator[None]:
    """Say afterwards which files of a folder, or which forms of one file, had another content before."""
    if out is None:
        yield
        return
    there = out.iterdir() if out.is_dir() else out.parent.glob(f"{escape(out.stem)}.*")
    before = {path: _content(path) for path in sorted(there)}
    yield
    if replaced := [str(path) for path, content in before.items() if _content(path) != content]:
        announce(f"replaced, with another content before: {', '.join(replaced)}")


def _content(path: Path) -> str:
    """What tells a file's content from another one; nothing of what cannot be read, which is not replaced either."""
    from fecontact.files import sha256

    try:
        return sha256(path)
    except OSError:
        return ""


def width() -> int | None:
    """Columns of the terminal, None where the output goes elsewhere."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else None
