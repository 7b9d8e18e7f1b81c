"""What is said while the program works: on a terminal one line that is kept up to date, elsewhere a short line a step.

Everything goes to standard error; standard output has results alone.
"""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

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
def many(what: str) -> Iterator[Callable[[int, int, str], None]]:
    """Progress of many jobs: hears how many are done, how many there are, and what is under way.

    Parameters
    ----------
    what
        What they are called, such as `cases`.
    """
    start, first = time.monotonic(), -1

    with _line() as say:

        def show(number: int, count: int, text: str) -> None:
            nonlocal first
            # those that were finished before took no time
            first = number if first < 0 else first
            left = ""
            if number > first and number < count:
                left = f", about {duration((time.monotonic() - start) / (number - first) * (count - number))} left"
            say(f"{number} of {count} {what} done{left}: {text}", str(number))

        yield show


def print_reasons(title: str, reasons: Mapping[str, str]) -> None:
    """Print why some jobs have no usable result, those of the same reason together; nothing if there are none."""
    if reasons:
        print(f"{title}:", file=sys.stderr)
    for reason in dict.fromkeys(reasons.values()):
        names = [name for name, why in reasons.items() if why == reason]
        print(f"  {', '.join(names)}: {reason}", file=sys.stderr)


def count(number: int, what: str) -> str:
    """A number and what it is of, which ends in s but for one."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


@contextmanager
def _line() -> Iterator[Callable[[str, str], None]]:
    """Where progress goes: takes a text and a key; where nobody watches it is said when the key changes."""
    from rich.console import Console

    console = Console(stderr=True)
    start = time.monotonic()
    if not console.is_terminal:
        said: str | None = None

        def plain(text: str, key: str) -> None:
            nonlocal said
            if key and key != said:
                print(f"{duration(time.monotonic() - start):>7} {text}", file=sys.stderr, flush=True)
            said = key

        yield plain
        return
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with Progress(*columns, console=console, transient=True) as shown:
        task = shown.add_task("", total=None)

        def update(text: str, key: str) -> None:
            shown.update(task, description=text)

        yield update


def duration(seconds: float) -> str:
    """A time as one would say it."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


def width() -> int | None:
    """Columns of the terminal, None where the output goes elsewhere."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else None
