"""The log file of a command: the command, what it says, and how it ends."""

from __future__ import annotations

import errno
import logging
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fecontact import __version__

LOG = logging.getLogger("fecontact")
LOG.setLevel(logging.INFO)
# it goes to the log file of a command alone
LOG.addHandler(logging.NullHandler())
LOG.propagate = False


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


class _LogFile(logging.FileHandler):
    def handleError(self, record: logging.LogRecord) -> None:
        """A full disk loses the log, not the results."""
