"""Suspicions about a profile file, in words and with a kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fecontact.errors import InputError

SuspicionKind = Literal["mirrored", "canted", "shifted", "short", "dented", "tape circle", "other body", "wear"]
"""What may be wrong: the side, the cant, the lateral origin, the extent, single places of the surface, the position of
the tape circle, the body, or the wear against the nominal profile.
"""


@dataclass(frozen=True, kw_only=True)
class Suspicion:
    """What may be wrong with a profile.

    Attributes
    ----------
    kind
        Kind of the problem.
    text
        Observation in words, without the remedy.
    """

    kind: SuspicionKind
    text: str


class SuspiciousProfileError(InputError):
    """Error for a profile that only an answer of the user can make usable.

    Parameters
    ----------
    message
        Observation, and the option that answers the question after a semicolon.
    kind
        Kind of the problem.
    """

    def __init__(self, message: str, kind: SuspicionKind) -> None:
        """Error of a message with its kind.

        Parameters
        ----------
        message
            Observation and option.
        kind
            Kind of the problem.
        """
        super().__init__(message)
        self.kind = kind

    def __reduce__(self) -> tuple[type[SuspiciousProfileError], tuple[str, SuspicionKind]]:
        """Keep the kind when a worker process sends the error."""
        return type(self), (str(self.args[0]), self.kind)
