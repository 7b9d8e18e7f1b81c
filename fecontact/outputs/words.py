"""What results are called: measures, verdicts, cases, rolls and series; what reports say in words."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.resources import files

from fecontact.criteria import Criteria
from fecontact.outputs.flat_records import relative_name


@dataclass(frozen=True, kw_only=True)
class Words:
    """A measure in words.

    Attributes
    ----------
    short
        Its name in the criteria, or one for a picture.
    meaning
        What it is.
    letter
        Of its own, for the cells of a map.
    name, unit
        Its name, and the unit of its value.
    off_unit
        Unit of the deviation, its uncertainty and its limit: `%`, or Hertz's half-width `b`.
    signed
        Whether Hertz may be off to both sides.
    rank
        Where a table has no room, measures of the lowest rank are left out first; rank 0 stays.
    """

    short: str
    letter: str
    name: str
    unit: str
    meaning: str
    off_unit: str = "%"
    signed: bool = True
    rank: int = 0

    @property
    def title(self) -> str:
        """Name with unit, for the head of a line."""
        return f"{self.name} ({self.unit})"

    @property
    def factor(self) -> float:
        """What a deviation is multiplied by to be in its unit."""
        return 100.0 if self.off_unit == "%" else 1.0

    @property
    def digits(self) -> int:
        """Decimals of a deviation in its unit."""
        return 2 if self.off_unit == "%" else 3

    def off(self, value: float | None, *, size: bool = False) -> str:
        """A deviation with its unit, or with `size` its uncertainty; a dash where it is not known."""
        if value is None or not math.isfinite(value):
            return "-"
        sign = "+" if self.signed and not size else ""
        return f"{self.factor * value:{sign}z.{self.digits}f} {self.off_unit}"

    def limit(self, value: float) -> str:
        """A limit with its unit."""
        return f"{'±' if self.signed else '< '}{self.factor * value:.12g} {self.off_unit}"


TEXTS = tomllib.loads((files("fecontact.outputs") / "words.toml").read_text("utf-8"))
WORDS: dict[str, Words] = {name: Words(**parts) for name, parts in TEXTS["measures"].items()}
"""The words of every measure."""


def names_text(measures: Iterable[str]) -> str:
    """Names of measures, joined by commas."""
    return ", ".join(WORDS[measure].name for measure in measures)


def criteria_text(criteria: Criteria) -> str:
    """The measures that decide, each with its limit."""
    shown = ((WORDS[measure], limit) for measure, limit in criteria.limits.items())
    return ", ".join(f"{words.short} {words.limit(limit)}" for words, limit in shown)


def limits_text(criteria: Criteria) -> str:
    """Measures that decide by their limits, such as "5 % p_max; 10 % area, a, b; 0.15 b centre"."""
    groups: dict[str, list[str]] = {}
    for measure, limit in criteria.limits.items():
        words = WORDS[measure]
        groups.setdefault(f"{words.factor * limit:.4g} {words.off_unit}", []).append(words.short)
    return "; ".join(f"{limit} {', '.join(names)}" for limit, names in groups.items())


def unknown_text(measures: Iterable[str]) -> str:
    """That a result does not tell measures, and what to do about it."""
    return f"the stored result does not have {names_text(measures)}; solve it again to judge by them"


def deviation_column(measure: str) -> tuple[str, str, float]:
    """Columns of a measure's deviation and of its uncertainty, and what their numbers are multiplied by."""
    factor = WORDS[measure].factor
    name = relative_name(measure)
    return f"hertz_deviation_{name}", f"hertz_uncertainty_{name}", factor
