"""Standard output and standard error without characters that a terminal would execute."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from fecontact.inputs.texts import escape_invisible


class EscapingStream:
    """Text stream that writes escapes in place of control characters.

    Names of files and columns can have such characters. The stream has all attributes of the stream below it.

    Attributes
    ----------
    rich_proxied_file
        The stream below it. Consoles of rich write to it, because their colours are control characters; texts for these
        consoles are escaped before (`outputs.terminal`).
    """

    def __init__(self, stream: TextIO) -> None:
        """Wrap a stream.

        Parameters
        ----------
        stream
            Stream that receives the escaped text.
        """
        self.rich_proxied_file = stream

    def write(self, text: str) -> int:
        """Write a text with escapes.

        Parameters
        ----------
        text
            Text.

        Returns
        -------
        int
            Number of characters of the text.
        """
        self.rich_proxied_file.write(escape_invisible(text))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write several texts with escapes.

        Parameters
        ----------
        lines
            Texts.
        """
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        """Attribute of the stream below."""
        return getattr(self.rich_proxied_file, name)


@contextmanager
def escaping_output() -> Iterator[None]:
    """Escape control characters in all that is printed meanwhile.

    Yields
    ------
    None
    """
    streams = sys.stdout, sys.stderr
    escaping: Any = [
        stream if stream is None or isinstance(stream, EscapingStream) else EscapingStream(stream) for stream in streams
    ]
    sys.stdout, sys.stderr = escaping
    try:
        yield
    finally:
        sys.stdout, sys.stderr = streams
