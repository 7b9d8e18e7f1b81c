"""Refusals of profile files that name everything that is needed in one step.

A reader refuses a file for its first problem, with the option that settles it. If a second problem appears only with
this option, as in a wheel whose z points down and whose y points to the flange, the refusal has to name it too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from fecontact.errors import InputError
from fecontact.profiles.curve import ProfileKind
from fecontact.profiles.reading import Reading, find_suggestions

T = TypeVar("T")
# Unit, columns, side, tape circle and its height: no file needs more options.
_MOST_OPTIONS = 5


def read_or_explain(read: Callable[[Reading], T], reading: Reading, kind: ProfileKind) -> T:
    """Read a profile; a refusal names the options of all problems.

    Parameters
    ----------
    read
        Function that reads the profile with some options.
    reading
        Options of the file.
    kind
        `rail` or `wheel`.

    Returns
    -------
    object
        Result of `read`.

    Raises
    ------
    InputError
        The file is refused. Each option of the message that leads to a further refusal is followed by this refusal.
    """
    try:
        return read(reading)
    except InputError as error:
        error.args = (_explain(error, read, reading, kind, _MOST_OPTIONS), *error.args[1:])
        raise


def _explain(
    error: InputError, read: Callable[[Reading], object], reading: Reading, kind: ProfileKind, most: int
) -> str:
    """Message of a refusal with the further refusals that its options lead to.

    Parameters
    ----------
    error
        Refusal with the options `reading`.
    read
        Function that reads the profile with some options.
    reading
        Options of the file.
    kind
        `rail` or `wheel`.
    most
        Largest number of further options.

    Returns
    -------
    str
        Message.
    """
    message = str(error)
    if most == 0:
        return message
    parts = [message]
    for suggestion in find_suggestions(message, kind):
        changed = replace(reading, **{suggestion.key: suggestion.value})
        if changed == reading:
            continue
        try:
            read(changed)
        except InputError as next_error:
            parts.append(f"with {suggestion.option}: {_explain(next_error, read, changed, kind, most - 1)}")
    return "; and ".join(parts)
