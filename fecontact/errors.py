"""Errors with their exit codes, and the status texts of results.

The functions at the end answer whether the numbers of a row may be used.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

SMALLEST_QUANTITY, LARGEST_QUANTITY = 1e-30, 1e20
"""Range of every positive quantity, in which powers of it neither overflow nor underflow."""
EXTREME_QUANTITY_TEXT = f"allowed: {SMALLEST_QUANTITY:g} to {LARGEST_QUANTITY:g}"


# Words of 300 letters or more are longer than a path usually is. Messages show their first 80 letters.
_LETTERS_SHOWN, _LONG_WORD = 80, re.compile(r"[^\s'\"]{300,}")


def shorten_words(text: str) -> str:
    """Shorten words of 300 letters or more to their first 80.

    Nobody reads such a word to its end. It may be a value that a user gave.

    Parameters
    ----------
    text
        A message.

    Returns
    -------
    str
        The message, with `...` for the omitted letters.

    Examples
    --------
    >>> from fecontact.errors import shorten_words
    >>> len(shorten_words("x" * 500))
    83
    """
    return _LONG_WORD.sub(lambda word: f"{word[0][:_LETTERS_SHOWN]}...", text)


def is_invisible(character: str) -> bool:
    """Whether a terminal would execute a character instead of showing it.

    Parameters
    ----------
    character
        A single character.

    Returns
    -------
    bool
        True for control characters, marks of direction and of zero width, separators of lines, halves of characters,
        and code points without a character. False for letters, signs and spaces.
    """
    return not (character.isprintable() or unicodedata.category(character) == "Zs")


class FecontactError(Exception):
    """Base class of every error that the package raises on purpose."""

    exit_code: ClassVar[int] = 1

    def __str__(self) -> str:
        """Message without very long words."""
        return shorten_words(super().__str__())


class InputError(FecontactError, ValueError):
    """Error for a value outside its allowed range.

    The message has the value, the allowed range and the remedy.
    """

    exit_code: ClassVar[int] = 2


class FoldedMeshError(InputError):
    """Error for a mesh with an element that is turned inside out.

    Different element sizes may avoid it.
    """


class CoverageError(InputError):
    """Error for a surface of a body that does not cover the contact zone.

    It is raised for the wheel's surface opposite the rail too. A narrower zone may work.
    """


class MemoryShortageError(InputError):
    """Error for work that needs more memory than the machine has free.

    The work may succeed if it runs alone.
    """


# Texts of the system for a library that does not fit into the memory.
_MEMORY_TEXTS = ("failed to map segment", "cannot allocate memory", "out of memory", "cannot apply additional memory")


def is_memory_shortage(error: BaseException) -> bool:
    """Whether a lack of memory caused an error, also the error of an import.

    Parameters
    ----------
    error
        Error of Python or of the system.

    Returns
    -------
    bool
        True for `MemoryError`, `MemoryShortageError`, and an import error with a text of the system about memory.

    Examples
    --------
    >>> from fecontact.errors import is_memory_shortage
    >>> is_memory_shortage(ImportError("libgmsh.so: failed to map segment from shared object"))
    True
    """
    if isinstance(error, ImportError):
        return any(text in str(error).lower() for text in _MEMORY_TEXTS)
    return isinstance(error, MemoryError | MemoryShortageError)


class ConvergenceError(FecontactError):
    """Error for an iteration that did not reach its tolerance.

    The message has the cause and the remedy.
    """

    exit_code: ClassVar[int] = 3


class ProgramError(FecontactError):
    """A job ended with an error of the program, which says nothing about its inputs; finished jobs are kept."""

    exit_code: ClassVar[int] = 4


def check_positive(name: str, value: float, unit: str, remedy: str, *, zero_allowed: bool = False) -> float:
    """Return a quantity as a float if it is finite, positive and not extreme.

    Parameters
    ----------
    name
        Name of the quantity in the message.
    value
        Value, in `unit`.
    unit
        Unit in the message.
    remedy
        End of the message: the action that the user can take.
    zero_allowed
        Whether 0 is allowed too.

    Returns
    -------
    float
        `value`, in `unit`.

    Raises
    ------
    InputError
        The message has the name, the value, its unit, the allowed range and the remedy.

    Examples
    --------
    >>> from fecontact.errors import check_positive
    >>> check_positive("radius", 300, "mm", "for example 300")
    300.0
    """
    if SMALLEST_QUANTITY <= value <= LARGEST_QUANTITY or (zero_allowed and value == 0.0):
        return float(value)
    if value > 0.0 and math.isfinite(value):
        raise InputError(f"{name} is {float(value)!r} {unit}; {EXTREME_QUANTITY_TEXT}; {remedy}")
    allowed_range = "finite and >= 0" if zero_allowed else "finite and > 0"
    raise InputError(f"{name} is {float(value)!r} {unit}; allowed: {allowed_range}; {remedy}")


# --- The status of a result, in the words of rows and records: `converged`, or the reason not to use the result.

CONVERGED = "converged"


@dataclass(frozen=True)
class UnusableStatus:
    """Texts for a status of results that must not be used.

    Attributes
    ----------
    short
        Text for tables.
    remedy
        Text for messages: the action that may help.
    """

    short: str
    remedy: str


UNUSABLE_STATUSES = {
    "elements too soft or too stiff": UnusableStatus(
        "FE stiffness",
        "finer elements show whether the mesh is only too coarse: use --resolution standard or --refine verdict",
    ),
    "references disagree": UnusableStatus(
        "references",
        "Hertz, half-space and gap function differ where they must agree, so the numbers are wrong: report the case",
    ),
    "verdicts contradict": UnusableStatus(
        "contradict", "finer elements show which verdict is right: use --resolution standard or --refine evidence"
    ),
    "patch at the edge of the fine mesh": UnusableStatus(
        "at mesh edge",
        "a note gives the reason why the mesh cannot grow: try a different lateral shift or a smaller load",
    ),
    "not converged": UnusableStatus("not conv.", "try a lateral shift that differs by 0.2 mm, or a different load"),
}
"""Texts for each status except `CONVERGED`."""


def describe_failure(cause: object) -> str:
    """Status of a case without any numbers, in a single line.

    Parameters
    ----------
    cause
        The error, or its message.

    Returns
    -------
    str
        The status.
    """
    return " ".join(f"failed: {cause}".split())


def is_usable_status(row: Mapping[str, object]) -> bool:
    """Whether the numbers of a row or a record may be used."""
    return row["status"] == CONVERGED


def has_numbers(row: Mapping[str, object]) -> bool:
    """Whether a row has numbers, even if they must not be used."""
    return not str(row["status"]).startswith("failed")


def short_status(row: Mapping[str, object]) -> str:
    """Status of a row that must not be used, for a table.

    Parameters
    ----------
    row
        Row with the key `status`.

    Returns
    -------
    str
        Short text of the status, or the status if it has no short text.
    """
    status = str(row["status"])
    if not has_numbers(row):
        return "no result"
    return UNUSABLE_STATUSES[status].short if status in UNUSABLE_STATUSES else status


def describe_status(row: Mapping[str, object]) -> str:
    """Status of a row or record that must not be used, with its remedy.

    Parameters
    ----------
    row
        Row or record with the key `status`.

    Returns
    -------
    str
        Status, with its remedy if there is one.
    """
    status = str(row["status"])
    return f"{status}; {UNUSABLE_STATUSES[status].remedy}" if status in UNUSABLE_STATUSES else status
