"""Log file of a command: the command, its messages and its end."""

from __future__ import annotations

import errno
import logging
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fecontact import __version__
from fecontact.inputs.texts import escape_invisible

LOG = logging.getLogger("fecontact")
LOG.setLevel(logging.INFO)
# Messages go only to the log file of a command.
LOG.addHandler(logging.NullHandler())
LOG.propagate = False


def _escape_record(record: logging.LogRecord) -> bool:
    """Escape control characters of a message; keep the record."""
    record.msg, record.args = escape_invisible(record.getMessage()), None
    return True


LOG.addFilter(_escape_record)


@contextmanager
def log_command(path: Path) -> Iterator[None]:
    """Append a command, its messages and its end to a log file.

    If the file can no longer be written, this is not an error.

    Parameters
    ----------
    path
        Log file; its folder is created.

    Yields
    ------
    None

    Raises
    ------
    OSError
        If the file cannot be opened, or is a link or a pipe: a link may lead out of the folder, and a pipe would wait
        for its reader.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_symlink() or path.is_fifo():
        raise OSError(errno.EINVAL, "a link or a pipe instead of a file; remove it", str(path))
    handler = _LogFile(path, encoding="utf-8")
    handler.setFormatter(_LogFormat("%(asctime)s %(levelname)-7s %(message)s"))
    LOG.addHandler(handler)
    LOG.info(f"fecontact {__version__}: {shlex.join(sys.argv)}")
    try:
        yield
        LOG.info("ended")
    except BaseException as error:
        LOG.error(f"ended by {type(error).__name__}: {error}".rstrip(": "))
        raise
    finally:
        LOG.removeHandler(handler)
        with suppress(OSError):
            handler.close()


class _LogFormat(logging.Formatter):
    """Format of a log file that a terminal can show: without control characters of names."""

    def format(self, record: logging.LogRecord) -> str:
        """Entry of the log file."""
        return escape_invisible(super().format(record))


class _LogFile(logging.FileHandler):
    """Handler of a log file that ignores write errors."""

    def handleError(self, record: logging.LogRecord) -> None:
        """Ignore write errors: a full disk loses the log, but not the results."""
