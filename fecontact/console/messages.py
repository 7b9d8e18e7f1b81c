"""Messages of commands: results, announcements, notes and reasons, each also written to the log."""

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
from fecontact.inputs.texts import escape_invisible

if TYPE_CHECKING:
    from fecontact.case import Case


def print_result(text: str, *, quiet: bool = False) -> None:
    """Print a result and write it to the log; if quiet, only write it to the log.

    Parameters
    ----------
    text
        Result.
    quiet
        Whether nothing is printed.
    """
    LOG.info(text)
    if not quiet:
        print(escape_invisible(text))


def announce(*lines: str, quiet: bool = False) -> None:
    """Print announcements to standard error, and write them to the log.

    Parameters
    ----------
    lines
        Lines of text.
    quiet
        Whether nothing is printed.
    """
    for line in lines:
        LOG.info(line)
        if not quiet:
            print(escape_invisible(line), file=sys.stderr, flush=True)


def write_to_log(text: str, *, warning: bool = False) -> None:
    """Write a text to the log that is visible elsewhere, as in a table.

    Parameters
    ----------
    text
        The text, one or several lines.
    warning
        Whether the entry is a warning.
    """
    LOG.log(logging.WARNING if warning else logging.INFO, text)


def print_reasons(title: str, reasons: Mapping[str, str]) -> None:
    """Print the reasons why jobs have no usable result, grouped by reason.

    Parameters
    ----------
    title
        First line; not printed without reasons.
    reasons
        Reason of each unusable job, by the name of the job.
    """
    if reasons:
        _print_problem(f"{title}:")
    for reason in dict.fromkeys(reasons.values()):
        names = [name for name, job_reason in reasons.items() if job_reason == reason]
        _print_problem(f"  {', '.join(names)}: {reason}")


def _print_problem(text: str) -> None:
    LOG.warning(text)
    print(escape_invisible(text), file=sys.stderr)


def print_notes(notes: Iterable[str]) -> None:
    """Print notes on inputs before the computation starts.

    Parameters
    ----------
    notes
        Notes, each a sentence.
    """
    for note in notes:
        _print_problem(f"note: {note}")


def _print_radii(cases: Sequence[Case]) -> None:
    """Print each rolling radius that the header of a wheel's file gives or contradicts."""
    from fecontact.profiles.resolve import radius_note, radius_of_file_mm

    for wheel, radius_mm in dict.fromkeys((case.wheel, case.rolling_radius_mm) for case in cases):
        if radius_of_file_mm(wheel) is not None:
            header_note = f"rolling radius {radius_mm:g} mm, from the header of {Path(wheel).name}"
            print_notes([radius_note(wheel, radius_mm) or header_note])


def print_geometry(cases: Sequence[Case]) -> None:
    """Print geometry and radius of each pair of profiles from a user's files.

    They are for the first case of each pair in which the wheel can be placed.

    Parameters
    ----------
    cases
        Cases of the command.
    """
    from fecontact.outputs.pair_geometry import geometry_of_cases

    announce(*geometry_of_cases(cases))
    _print_radii(cases)


@contextmanager
def reporting_replaced_files(out: Path | None) -> Iterator[None]:
    """Print afterwards the files that had different content before.

    Parameters
    ----------
    out
        Folder, or a file of which all forms (endings) are compared; None for no output.

    Yields
    ------
    None
    """
    if out is None:
        yield
        return
    paths = out.iterdir() if out.is_dir() else out.parent.glob(f"{escape(out.stem)}.*")
    contents = {path: _content_checksum(path) for path in sorted(paths)}
    yield
    if replaced := [str(path) for path, content in contents.items() if _content_checksum(path) != content]:
        announce(f"replaced files that had different content: {', '.join(replaced)}")


def _content_checksum(path: Path) -> str:
    """Checksum of a file's content; empty for an unreadable file, which is not replaced either."""
    from fecontact.files import hash_file

    try:
        return hash_file(path)
    except OSError:
        return ""


def find_terminal_width() -> int | None:
    """Width of the terminal in columns; None if the output is not a terminal."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else None
