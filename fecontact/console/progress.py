"""Progress of long work: an updated line on a terminal, a new line every few seconds elsewhere.

All progress goes to standard error; standard output has results alone. Long commands also write progress to a log file.
"""

from __future__ import annotations

import math
import re
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial

from fecontact.console.log import LOG
from fecontact.console.messages import announce
from fecontact.inputs.texts import count_text, escape_invisible
from fecontact.jobs.remaining import Progress, format_duration

# Seconds between two lines of progress without a terminal. This is less than the 10 s of a position by finite elements,
# so that each position has a line, and many times the time of a pair of a fleet.
_BETWEEN_LINES_S = 5.0
_PART_PATTERN = r"\([1-9]\d* of \d+ [^)]*\)"
# Words for the steps of a solution, by their names in the record of times.
_STEP_WORDS = {
    "place": "placing the wheel on the rail",
    "expect the patch": "estimating the patch on a half-space",
    "mesh": "meshing both bodies",
    "assemble": "assembling the stiffness matrix",
    "factorise": "factorising the stiffness matrix",
    "couple": "coupling both surfaces",
    "contact": "solving the contact",
    "resolve": "solving the pressure on finer nodes",
    "recover": "computing displacements and stresses",
    "ladder": "comparing with Hertz",
}


@contextmanager
def show_solution_progress() -> Iterator[Callable[[str], None]]:
    """Progress of a single case.

    Yields
    ------
    Callable
        Function that receives the name of each step, with its meshes, and prints it in words.
    """
    with _open_progress_line() as say:

        def step(name: str) -> None:
            stage, _, name_of_step = name.rpartition(": ")
            step_words = _STEP_WORDS.get(name_of_step, name_of_step)
            say(f"{stage}: {step_words}" if stage else step_words, stage)

        yield step


@contextmanager
def show_job_progress(
    kind: str, *, quiet: bool = False, before: Callable[[int], str] | None = None
) -> Iterator[Progress]:
    """Progress of many jobs.

    Parameters
    ----------
    kind
        Plural name of the jobs, such as `cases`.
    quiet
        Whether progress goes to the log only.
    before
        Text for a number of jobs, printed when the first job begins. By then all inputs have been checked.

    Yields
    ------
    Progress
        Function that receives the number of finished jobs, the number of all jobs, and a text on the present job.
    """
    with show_progress_by_kind(kind, quiet=quiet) as progress_by_kind:
        show_progress, announcements = progress_by_kind[kind], [before]

        def announced(number: int, count: int, text: str) -> None:
            if make_text := announcements.pop() if announcements else None:
                announce(make_text(count), quiet=quiet)
            show_progress(number, count, text)

        yield announced


@contextmanager
def show_progress_by_kind(*kinds: str, quiet: bool = False) -> Iterator[Mapping[str, Progress]]:
    """Progress of jobs of several kinds, kind by kind.

    Parameters
    ----------
    kinds
        Plural names of the jobs.
    quiet
        Whether progress goes to the log only.

    Yields
    ------
    Mapping
        Function for each kind, as `show_job_progress` yields it.
    """
    with _open_progress_line(quiet=quiet) as say:
        yield {kind: partial(_print_count, say, kind) for kind in kinds}


def _print_count(say: Callable[[str, str], None], kind: str, number: int, count: int, text: str) -> None:
    """Print the number of finished jobs, with a key for the log."""
    # A new key, and so a line, for each finished job and for each of its parts.
    words = count_text(count, re.sub(r"s\b", "", kind), kind)
    say(f"{number} of {words} done: {text}", f"{kind} {number} {re.findall(_PART_PATTERN, text)}")


@contextmanager
def _open_progress_line(*, quiet: bool = False) -> Iterator[Callable[[str, str], None]]:
    """Destination of progress: a function of a text and a key.

    The log gets the text when the key changes. Without a terminal the text is then also printed: always the first and
    the last text, other texts at most every 5 s.

    Parameters
    ----------
    quiet
        Whether nothing is printed.

    Yields
    ------
    Callable
        Function of a text and a key.
    """
    from rich.console import Console

    console = Console(stderr=True)
    start = time.monotonic()
    is_watched = console.is_terminal and not quiet
    last_key: str | None = None
    printed_at, pending_line = -math.inf, ""

    def plain(text: str, key: str) -> None:
        """Log a text with a new key, and print it after a pause.

        A text that comes too early after the last line is kept for `release`.
        """
        nonlocal last_key, printed_at, pending_line
        time_now = time.monotonic()
        if key and key != last_key:
            LOG.info(text)
            pending_line = f"{format_duration(time_now - start):>7} {text}"
            if time_now - printed_at >= _BETWEEN_LINES_S:
                release()
                printed_at = time_now
        last_key = key

    def release() -> None:
        nonlocal pending_line
        if pending_line and not is_watched and not quiet:
            print(pending_line, file=sys.stderr, flush=True)
        pending_line = ""

    if not is_watched:
        try:
            yield plain
        finally:
            release()
        return
    from rich import progress
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with progress.Progress(*columns, console=console, transient=True) as display:
        task = display.add_task("", total=None)

        def update(text: str, key: str) -> None:
            plain(text, key)
            display.update(task, description=escape_invisible(text))

        yield update
