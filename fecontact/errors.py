"""Errors with the exit code of the command line, the words of a status, and whether numbers may be used."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

SMALLEST, LARGEST = 1e-30, 1e20
"""Range of every positive quantity, in which powers of it neither overflow nor underflow."""
EXTREME = f"no body, load or material has that, and it could not be computed with; allowed: {SMALLEST:g} to {LARGEST:g}"


# Letters of a word that are shown, of one that is longer than a path usually is.
_SHOWN, _ENDLESS = 80, re.compile(r"[^\s'\"]{300,}")


def shortened(text: str) -> str:
    """A text in which of a word that nobody reads to its end, which a value may be, the beginning is left."""
    return _ENDLESS.sub(lambda word: f"{word[0][:_SHOWN]}...", text)


class FecontactError(Exception):
    """Base of every error that the package raises on purpose."""

    exit_code: ClassVar[int] = 1

    def __str__(self) -> str:
        """The message, without endless words."""
        return shortened(super().__str__())


class InputError(FecontactError, ValueError):
    """A value given by the caller is outside its allowed range; the message says which, and what to do."""

    exit_code: ClassVar[int] = 2


class FoldedMesh(InputError):
    """A mesh has an element that is turned inside out; other element sizes may avoid it."""


class NotCovered(InputError):
    """A body's surface, or the wheel's surface opposite, does not cover the contact zone; a narrower zone may work."""


class NotEnoughMemory(InputError):
    """The machine does not have the memory that is needed now; the work may succeed when it runs alone."""


class ConvergenceError(FecontactError):
    """An iteration did not reach its tolerance; the message gives the cause and the remedy."""

    exit_code: ClassVar[int] = 3


class ProgramError(FecontactError):
    """A job ended with an error of the program, which says nothing about its inputs; finished jobs are kept."""

    exit_code: ClassVar[int] = 4


def check_positive(name: str, value: float, unit: str, remedy: str, *, zero_allowed: bool = False) -> float:
    """Return `value` if it is finite, > 0 (or >= 0 with `zero_allowed`) and not extreme, else raise `InputError`.

    Raises
    ------
    InputError
        The message names the value, its unit, the allowed range and the remedy.
    """
    if SMALLEST <= value <= LARGEST or (zero_allowed and value == 0.0):
        return float(value)
    if value > 0.0 and math.isfinite(value):
        raise InputError(f"{name} is {float(value)!r} {unit}; {EXTREME}; {remedy}")
    allowed = "finite and >= 0" if zero_allowed else "finite and > 0"
    raise InputError(f"{name} is {float(value)!r} {unit}; allowed: {allowed}; {remedy}")


# --- The status of a result, in the words of rows and records: `converged`, or why the result must not be used.

CONVERGED = "converged"


@dataclass(frozen=True)
class Unusable:
    """Words for a result whose numbers must not be used: `short` is for tables."""

    short: str
    remedy: str


UNUSABLE = {
    "elements too soft or too stiff": Unusable(
        "elements off",
        "finer ones tell whether they are only too coarse: --resolution standard, or --refine verdict",
    ),
    "references disagree": Unusable(
        "references",
        "Hertz, half-space and gap contradict each other where they are one: its numbers are wrong, report the case",
    ),
    "verdicts contradict": Unusable(
        "contradict", "finer elements tell which verdict is right: --resolution standard, or --refine evidence"
    ),
    "patch at the edge of the fine mesh": Unusable(
        "at edge", "a note says what keeps the mesh from growing; another lateral shift or a smaller load may work"
    ),
    "not converged": Unusable("not conv.", "a lateral shift 0.2 mm beside it, or another load, may work"),
}
"""Words for each status except `CONVERGED`."""


def failed(why: object) -> str:
    """The status, in one line, of a case without any numbers."""
    return " ".join(f"failed: {why}".split())


def usable(row: Mapping[str, object]) -> bool:
    """Whether the numbers of a row, or of a record, may be used."""
    return row["status"] == CONVERGED


def has_numbers(row: Mapping[str, object]) -> bool:
    """Whether a row has numbers, also if they must not be used."""
    return not str(row["status"]).startswith("failed")


def short_status(row: Mapping[str, object]) -> str:
    """The status of a row that must not be used, for a table."""
    status = str(row["status"])
    if not has_numbers(row):
        return "no result"
    return UNUSABLE[status].short if status in UNUSABLE else status


def with_remedy(row: Mapping[str, object]) -> str:
    """The status of a row or record that must not be used, with a remedy."""
    status = str(row["status"])
    return f"{status}; {UNUSABLE[status].remedy}" if status in UNUSABLE else status
