"""Refusals of profile files with the options of all problems.

A reader refuses a file for its first problem, with the option that settles it. If a second problem appears only with
this option, as in a wheel whose z points down and whose y points to the flange, the refusal has to name it too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

from fecontact.errors import InputError
from fecontact.profiles.curve import ProfileKind
from fecontact.profiles.reading import Reading, find_suggestions

T = TypeVar("T")
# Unit, columns, side, tape circle and its height: no file needs more options.
_MOST_OPTIONS = 5


def read_or_explain(read_profile: Callable[[Reading], T], reading: Reading, kind: ProfileKind) -> T:
    """Read a profile; a refusal names the options of all problems.

    Parameters
    ----------
    read_profile
        Function that reads the profile with some options.
    reading
        Options of the file.
    kind
        `rail` or `wheel`.

    Returns
    -------
    object
        Result of `read_profile`.

    Raises
    ------
    InputError
        The file is refused. Each option of the message that leads to a further refusal is followed by this refusal.
    """
    try:
        return read_profile(reading)
    except InputError as error:
        error.args = (_explain(error, read_profile, reading, kind, _MOST_OPTIONS), *error.args[1:])
        raise


def _explain(
    error: InputError,
    read_profile: Callable[[Reading], object],
    reading: Reading,
    kind: ProfileKind,
    largest_count: int,
) -> str:
    """Message of a refusal with the further refusals that its options lead to.

    Parameters
    ----------
    error
        Refusal with the options `reading`.
    read_profile
        Function that reads the profile with some options.
    reading
        Options of the file.
    kind
        `rail` or `wheel`.
    largest_count
        Largest number of further options.

    Returns
    -------
    str
        Message.
    """
    message = str(error)
    if largest_count == 0:
        return message
    parts = [message]
    for suggestion in find_suggestions(message, kind):
        option: dict[str, Any] = {suggestion.key: suggestion.value}
        changed = replace(reading, **option)
        if changed == reading:
            continue
        try:
            read_profile(changed)
        except InputError as next_error:
            parts.append(
                f"with {suggestion.option}: {_explain(next_error, read_profile, changed, kind, largest_count - 1)}"
            )
    return "; and ".join(parts)
