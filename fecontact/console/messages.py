"""Messages of commands: results, announcements, notes and reasons, each kept in the log as well."""

from __future__ import annotations

import logging
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING

from fecontact.console.log import LOG

if TYPE_CHECKING:
    from fecontact.case import Case


def say(text: str, *, quiet: bool = False) -> None:
    """Print a result, or keep it for the log."""
    LOG.info(text)
    if not quiet:
        print(text)


def announce(*lines: str, quiet: bool = False) -> None:
    """Print what is to come before it begins, or keep it for the log."""
    for line in lines:
        LOG.info(line)
        if not quiet:
            print(line, file=sys.stderr, flush=True)


def log_only(text: str, *, warning: bool = False) -> None:
    """Keep for the log what is seen elsewhere, as in a table."""
    LOG.log(logging.WARNING if warning else logging.INFO, text)


def print_reasons(title: str, reasons: Mapping[str, str]) -> None:
    """Print why some jobs have no usable result, grouped by reason; print nothing if all are usable."""
    if reasons:
        _problem(f"{title}:")
    for reason in dict.fromkeys(reasons.values()):
        names = [name for name, why in reasons.items() if why == reason]
        _problem(f"  {', '.join(names)}: {reason}")


def _problem(text: str) -> None:
    LOG.warning(text)
    print(text, file=sys.stderr)


def tell_notes(notes: Iterable[str]) -> None:
    """Print what is to be known of inputs before anything is computed with them."""
    for note in notes:
        _problem(f"note: {note}")


def _tell_radii(cases: Sequence[Case]) -> None:
    """Print each rolling radius that the header of a wheel's file gives or contradicts."""
    from fecontact.profiles.resolve import radius_note, radius_of_file_mm

    for wheel, radius_mm in dict.fromkeys((case.wheel, case.rolling_radius_mm) for case in cases):
        if radius_of_file_mm(wheel) is not None:
            of_header = f"the rolling radius is {radius_mm:g} mm by the header of {Path(wheel).name}"
            tell_notes([radius_note(wheel, radius_mm) or of_header])


def tell_geometry(cases: Sequence[Case]) -> None:
    """Print geometry and radius of each pair of own profiles at its first case that has a place on the rail."""
    from fecontact.outputs.own_profiles import geometry_of_cases

    announce(*geometry_of_cases(cases))
    _tell_radii(cases)


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
