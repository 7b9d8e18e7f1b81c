"""How far two results may be apart and still be the same: `tolerances.toml`, and a file of one's own over it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fecontact.errors import InputError

TEXT = "text"
"""Kind of a column that is compared letter by letter."""

EFFORT = "effort"
"""Kind of a column that is shown and not compared: it depends on the machine and on the path of the solver."""

LATER = (
    *(
        "multi_hertz_",
        "equivalent_ellipse_",
        "kik_piotrowski_",
        "stripes_",
        "analyn_",
        "kpec_",
        "strip_",
        "half_space_",
    ),
    *("hertz_gauge_", "cheapest_theory", "elements_", "verdict_side", "hertz_status"),
)
"""Columns that begin like this are no difference where the baseline is older than they are, and are named."""


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """Two numbers are the same if they differ by no more than the larger of both parts.

    Attributes
    ----------
    relative
        Part of the baseline's magnitude.
    absolute
        In the unit of the column.
    reason
        Why it is of this size.
    """

    relative: float = 0.0
    absolute: float = 0.0
    reason: str = ""


_OWN = tomllib.loads((files("fecontact.regression") / "tolerances.toml").read_text("utf-8"))
_NAMED = {column: kind for kind, columns in _OWN["names"].items() for column in columns.split()}

KINDS: Mapping[str, Tolerance] = {kind: Tolerance(**parts) for kind, parts in _OWN["kinds"].items()}
"""Kinds of numbers."""


def kind_of(column: str) -> str:
    """Kind of a column by its name: by the whole name, by its unit, or `default`."""
    fitting = (kind for pattern, kind in _OWN["patterns"].items() if re.search(pattern, column))
    return _NAMED.get(column) or next(fitting, "default")


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """Tolerances by kind, and by column where a column has its own."""

    kinds: Mapping[str, Tolerance] = field(default_factory=lambda: KINDS)
    columns: Mapping[str, Tolerance] = field(default_factory=dict)

    def of(self, column: str) -> Tolerance | None:
        """Tolerance of a column, or None if it is text or not compared."""
        return self.columns.get(column) or self.kinds.get(kind_of(column))

    def compares(self, column: str) -> bool:
        """Whether a column is compared: effort only where it has a tolerance of its own."""
        return kind_of(column) != EFFORT or column in self.columns


_Parts: TypeAlias = dict[Literal["relative", "absolute"], Annotated[float, Field(ge=0.0, allow_inf_nan=False)]]


class _ToleranceFile(BaseModel):
    """Layout of a tolerance file: tables [kinds.NAME] and [columns.NAME]."""

    model_config = ConfigDict(extra="forbid", strict=True)
    kinds: dict[str, _Parts] = {}
    columns: dict[str, _Parts] = {}


def read_tolerances(path: str | Path) -> Tolerances:
    """The tolerances of a TOML file over those of `KINDS`; a part that is not given stays.

    A column of kind `effort` that is named is compared.

    Raises
    ------
    InputError
        If the file does not exist, is no TOML, or names a kind or a value that there is not.
    """
    remedy = "allowed are tables [kinds.NAME] and [columns.NAME] with relative and absolute, finite and >= 0"
    try:
        given = _ToleranceFile.model_validate(tomllib.loads(Path(path).read_text("utf-8")))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise InputError(f"tolerances {path}: {where} is {first['input']!r}: {first['msg']}; {remedy}") from error
    # also what is no UTF-8, or no TOML
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"tolerances {path}: it cannot be read as TOML ({error}); {remedy}") from error
    for name in given.kinds:
        if name not in KINDS:
            raise InputError(f"tolerances {path}: kinds.{name}: no such kind; allowed are {', '.join(KINDS)}")
    for name in given.columns:
        if kind_of(name) == TEXT:
            raise InputError(f"tolerances {path}: columns.{name} is text and compared exactly; take it out")
    kinds = {**KINDS, **{name: _with(KINDS[name], parts) for name, parts in given.kinds.items()}}
    columns = {name: _with(kinds.get(kind_of(name), Tolerance()), parts) for name, parts in given.columns.items()}
    return Tolerances(kinds=kinds, columns=columns)


def _with(tolerance: Tolerance, parts: _Parts) -> Tolerance:
    return replace(tolerance, **parts, reason="given in the tolerance file")
