"""Progress of long work: on a terminal one line that is kept up to date, elsewhere a line now and then.

Everything goes to standard error; standard output has results alone. Long commands keep both in a log file as well.
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
from fecontact.jobs.remaining import Progress, duration

# Seconds between two lines of progress where nobody watches: less than the 10 s of a position by finite elements, each
# of which has its line so, and many times what a pair of a fleet takes.
_BETWEEN_LINES_S = 5.0
_PART = r"\([1-9]\d* of \d+ [^)]*\)"
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
            LOG.info(text)
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
