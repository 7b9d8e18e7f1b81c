"""What measures are called, and how far Hertz is off in them is shown: in tables, pictures and on the command line."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from fecontact.criteria import Criteria
from fecontact.outputs.records.told import relative_name


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
        Where a table has no room, those of the lowest rank are left out first; 0 stays.
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


WORDS = {
    "p_max_MPa": Words(
        short="p_max",
        letter="p",
        name="peak pressure",
        unit="MPa",
        meaning="the largest pressure, read between the nodes",
    ),
    "area_mm2": Words(
        short="area",
        letter="A",
        name="area",
        unit="mm²",
        meaning="of all patches together, up to where the pressure ends",
        rank=9,
    ),
    "a_mm": Words(
        short="a",
        letter="a",
        name="half-width a along x",
        unit="mm",
        meaning="sqrt(5 <x²>) over the pressure, along the rolling direction; the semi-axis of a Hertz ellipse",
        rank=4,
    ),
    "b_mm": Words(
        short="b",
        letter="b",
        name="half-width b across",
        unit="mm",
        meaning="sqrt(5 <s²>) over the pressure, across the rail; the semi-axis of a Hertz ellipse",
        rank=8,
    ),
    "extent_x_mm": Words(
        short="extent x",
        letter="l",
        name="full length along x",
        unit="mm",
        meaning="from one end of the contact to the other along the rolling direction; not judged",
    ),
    "extent_y_mm": Words(
        short="extent y",
        letter="w",
        name="full width across",
        unit="mm",
        meaning="from one end of the contact to the other across the rail; not judged",
    ),
    "approach_mm": Words(
        short="approach",
        letter="d",
        name="approach, down to the cut planes",
        unit="mm",
        meaning="how far the bodies come together from the first touch; not judged, since a deeper rail moves it",
    ),
    "centre_over_b": Words(
        short="centre",
        letter="c",
        name="centre of pressure across",
        unit="b",
        meaning="how far it lies beside the first touch point, across the rail, in half-widths b of the ellipse",
        off_unit="b",
        rank=7,
    ),
    "valley": Words(
        short="valley",
        letter="v",
        name="valley between lobes",
        unit="% of the peak",
        meaning="by how much the pressure falls between its two highest peaks, over the highest; 0 for an ellipse",
        signed=False,
        rank=6,
    ),
    "separate_load": Words(
        short="separate",
        letter="s",
        name="load on separate patches",
        unit="%",
        meaning="the part of the load that is carried by patches beside the one that carries most; 0 for an ellipse",
        signed=False,
        rank=1,
    ),
    "misplaced_load": Words(
        short="misplaced",
        letter="m",
        name="misplaced load",
        unit="%",
        meaning="load that is elsewhere than Hertz has it, with the ellipse moved to the centre of pressure",
        signed=False,
        rank=10,
    ),
}
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
