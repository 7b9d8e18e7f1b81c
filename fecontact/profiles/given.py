"""Profiles that are given as arrays in Python: a value that stands where the name of a file does."""

from __future__ import annotations

import hashlib
import re

import numpy as np
from numpy.typing import ArrayLike

from fecontact.errors import InputError

# 32 bits: two of a user's thousand versions of one file share an identity once in some ten thousand such users.
SHOWN_DIGITS = 8
_NAME = re.compile(r"[A-Za-z0-9][\w.-]{0,59}", re.ASCII)


class GivenProfile(str):
    """Points that were given in Python: the identity of the file that they would be, NAME.csv@HASH, with its text.

    It goes wherever a case goes, also to another process; a result has the file beside it.
    """

    __slots__ = ("text",)
    text: str

    def __new__(cls, identity: str, text: str) -> GivenProfile:  # noqa: D102
        made = super().__new__(cls, identity)
        made.text = text
        return made

    def __reduce__(self) -> tuple[type[GivenProfile], tuple[str, str]]:
        return GivenProfile, (str(self), self.text)

    @property
    def file(self) -> str:
        """Name of the file."""
        return self.rpartition("@")[0]

    @property
    def content(self) -> bytes:
        """Content of the file."""
        return self.text.encode()


def profile(y_mm: ArrayLike, z_mm: ArrayLike, *, name: str = "points") -> GivenProfile:
    """Profile of points, as `Case(rail=...)` and `Case(wheel=...)` take it beside names and files.

    Parameters
    ----------
    y_mm, z_mm (n,)
        In the order along the running surface: y positive to the field side, z up; a rail has its crown and a wheel its
        tape circle at (0, 0). The points are treated as those of a file: checked, and smoothed where they are noisy,
        both as `rail_file` and `wheel_file` of the case say.
    name
        What it is called in results.

    Raises
    ------
    InputError
        The arrays are not two rows of finite numbers, or the name cannot be that of a file.

    Examples
    --------
    >>> import numpy as np
    >>> y = np.linspace(-35.0, 35.0, 351)
    >>> profile(y, np.sqrt(300.0**2 - y**2) - 300.0, name="R300").file
    'R300.csv'
    """
    try:
        y, z = (np.asarray(values, dtype=float) for values in (y_mm, z_mm))
    except (TypeError, ValueError) as error:
        raise InputError(
            f"profile {name!r}: y_mm and z_mm are not arrays of numbers ({error}); give both in mm"
        ) from None
    if y.ndim != 1 or y.shape != z.shape:
        raise InputError(
            f"profile {name!r}: y_mm and z_mm have the shapes {y.shape} and {z.shape}; allowed: (n,) of both"
        )
    if not np.isfinite(y + z).all():
        at = int(np.flatnonzero(~np.isfinite(y + z))[0])
        raise InputError(f"profile {name!r}: point {at + 1} is ({y[at]}, {z[at]}) mm; leave out what is not finite")
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise InputError(
            f"profile name is {str(name)[:80]!r}; allowed: up to 60 letters, digits, dots, hyphens and underscores"
        )
    text = "y [mm],z [mm]\n" + "".join(f"{a!r},{b!r}\n" for a, b in zip(y.tolist(), z.tolist(), strict=True))
    return GivenProfile(f"{name}.csv@{hashlib.sha256(text.encode()).hexdigest()[:SHOWN_DIGITS]}", text)
