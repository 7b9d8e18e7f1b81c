"""Errors which the package raises on purpose; each carries the exit code that the command line returns."""

from __future__ import annotations

import math
from typing import ClassVar

SMALLEST, LARGEST = 1e-30, 1e20
"""Sizes between which a quantity above zero must be: powers of it are numbers of a computer then."""
EXTREME = f"no body, load or material has that, and it could not be computed with; allowed: {SMALLEST:g} to {LARGEST:g}"


class FecontactError(Exception):
    """Base of every error that the package raises on purpose."""

    exit_code: ClassVar[int] = 1


class InputError(FecontactError, ValueError):
    """A value given by the caller is outside its allowed range; the message says which, and what to do."""

    exit_code: ClassVar[int] = 2


class FoldedMesh(InputError):
    """A mesh has an element that is turned inside out; other element sizes may not have one."""


class NotCovered(InputError):
    """A body's surface does not hold, or the wheel's does not face, all of the contact zone; a narrower one may do."""


class NotEnoughMemory(InputError):
    """The machine does not have the memory that is needed now; alone on it the same may go."""


class ConvergenceError(FecontactError):
    """An iteration did not reach its tolerance; the message gives the cause and the remedy."""

    exit_code: ClassVar[int] = 3


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
