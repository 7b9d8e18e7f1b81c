"""Words for measures: names, units, deviations and limits."""

from __future__ import annotations

import math
import tomllib
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from fecontact.criteria import Criteria
from fecontact.files import OWN_FUNCTIONS_SETTING, describe_source
from fecontact.inputs.texts import count_text
from fecontact.outputs.flat_records import relative_name
from fecontact.own_criterion import is_own, is_own_relative, split_own_measure


@dataclass(frozen=True, kw_only=True)
class MeasureWords:
    """Words for a measure.

    Attributes
    ----------
    short
        Name of the measure in the criteria, or a short name for a picture.
    letter
        Unique letter of the measure, for the cells of a map.
    name, unit
        Name of the measure, and unit of its value.
    meaning
        Explanation of the measure.
    off_unit
        Unit of the deviation, its uncertainty and its limit: `%`, or Hertz's half-width `b`.
    signed
        Whether the deviation of Hertz can be positive or negative.
    has_any_size
        Whether deviations are differences of any size.
    rank
        Measures of the lowest rank are left out first if a table has no room. Rank 0 always stays.
    excess, deficit
        Physical meaning of a positive and of a negative deviation, with the placeholders `{name}` and `{size}`.
    """

    short: str
    letter: str
    name: str
    unit: str
    meaning: str
    off_unit: str = "%"
    signed: bool = True
    has_any_size: bool = False
    rank: int = 0
    excess: str = "{name} too large by {size}"
    deficit: str = "{name} too small by {size}"

    @property
    def title(self) -> str:
        """Name with unit, for the head of a line."""
        return f"{self.name} ({self.unit})"

    @property
    def factor(self) -> float:
        """Factor from a relative deviation to a deviation in its unit."""
        return 100.0 if self.off_unit == "%" else 1.0

    @property
    def digits(self) -> int:
        """Decimals of a deviation in its unit."""
        return 2 if self.off_unit == "%" else 3

    def number_text(self, value: float, sign: str = "", *, more_digits: int = 0) -> str:
        """Text for a deviation in its unit, without the unit.

        A difference in the unit of a user has four significant digits, since its size is not known.

        Parameters
        ----------
        value
            Relative deviation, or difference.
        sign
            `+` to show the sign of positive values.
        more_digits
            Number of additional digits.

        Returns
        -------
        str
            The number.
        """
        if self.has_any_size:
            return f"{value:{sign}.{4 + more_digits}g}"
        return f"{self.factor * value:{sign}z.{self.digits + more_digits}f}"

    def deviation_text(self, value: float | None, *, size: bool = False) -> str:
        """Text for a deviation with its unit.

        Parameters
        ----------
        value
            Relative deviation; None or NaN if it is missing.
        size
            Whether the value is an uncertainty, which has no sign.

        Returns
        -------
        str
            Text such as "+3.20 %", or a dash for a missing value.
        """
        if value is None or not math.isfinite(value):
            return "-"
        sign = "+" if self.signed and not size else ""
        return f"{self.number_text(value, sign)} {self.off_unit}".rstrip()

    def limit_text(self, value: float) -> str:
        """Text for a limit with its unit."""
        return f"{'±' if self.signed else '< '}{self.factor * value:.12g} {self.off_unit}".rstrip()

    def describe_deviation(self, deviation: float, uncertainty: float, limit: float) -> str:
        """Physical meaning of a deviation, with its uncertainty and its limit.

        Parameters
        ----------
        deviation, uncertainty, limit
            Relative values.

        Returns
        -------
        str
            Text such as "separate patches carry 8.00 ± 0.50 % of the load (limit 0.1 %)".
        """
        unit = "half-widths" if self.off_unit == "b" else self.off_unit
        size = f"{self.factor * abs(deviation):.{self.digits}f} ± {self.factor * uncertainty:.{self.digits}f} {unit}"
        meaning = (self.deficit if deviation < 0.0 else self.excess).format(name=self.name, size=size)
        return f"{meaning} (limit {self.factor * limit:.12g} {unit})"


class _WordsByMeasure(dict[str, MeasureWords]):
    """Words of each built-in measure; words of a user's measure follow from its name."""

    def __missing__(self, measure: str) -> MeasureWords:
        if not is_own(measure):
            raise KeyError(measure)
        name, unit = split_own_measure(measure)
        is_difference = not is_own_relative(measure)
        return MeasureWords(
            short=name,
            letter=OWN_LETTER,
            name=name.replace("_", " "),
            unit=unit,
            meaning="measure of a user's criterion",
            off_unit=unit.removeprefix("-") if is_difference else "%",
            has_any_size=is_difference,
        )


OWN_LETTER = "o"
"""Letter of all criteria of a user in the cells of a map."""
TEXTS = tomllib.loads((files("fecontact.outputs") / "words.toml").read_text("utf-8"))
MEASURE_WORDS: dict[str, MeasureWords] = _WordsByMeasure(
    {name: MeasureWords(**parts) for name, parts in TEXTS["measures"].items()}
)
"""Words of each measure, by its name."""
CONTRIBUTION_WORDS: dict[str, str] = TEXTS["contributions"]
"""Names of the contributions to an uncertainty, by their keys."""


def names_text(measures: Iterable[str]) -> str:
    """Names of measures, joined by commas."""
    return ", ".join(MEASURE_WORDS[measure].name for measure in measures)


def criteria_text(criteria: Criteria) -> str:
    """Text for the deciding measures, each with its limit.

    Parameters
    ----------
    criteria
        Criteria with the deciding measures.

    Returns
    -------
    str
        Measures with their limits, joined by commas.
    """
    limits_of_measures = ((MEASURE_WORDS[measure], limit) for measure, limit in criteria.limits.items())
    return ", ".join(f"{words.short} {words.limit_text(limit)}" for words, limit in limits_of_measures)


def list_criteria_texts(criteria_of_cases: Iterable[Criteria]) -> list[str]:
    """Texts for the criteria of several cases, each set once.

    Parameters
    ----------
    criteria_of_cases
        Criteria of each case.

    Returns
    -------
    list of str
        Texts as from `criteria_text`; if there are several sets, each with its number of cases.
    """
    counts = Counter(map(criteria_text, criteria_of_cases))
    return [f"{text} ({count_text(count, 'case')})" if len(counts) > 1 else text for text, count in counts.items()]


def criteria_settings(criteria_of_cases: Iterable[Criteria]) -> dict[str, Any]:
    """Settings of a table of results that name its criteria, for comparisons.

    Parameters
    ----------
    criteria_of_cases
        Criteria of each case.

    Returns
    -------
    dict
        Texts of the limits, and of the sources of own functions by the name of the criterion.
    """
    criteria_of_cases = list(criteria_of_cases)
    sources = {
        criterion.name: describe_source(criterion.source)
        for criteria in criteria_of_cases
        for criterion in criteria.own or ()
    }
    limits = " and ".join(list_criteria_texts(criteria_of_cases))
    return {"limits": limits, OWN_FUNCTIONS_SETTING: sources} if limits else {}


def limits_text(criteria: Criteria) -> str:
    """Text for the limits, such as "5 % p_max; 10 % area, a, b; 0.15 b centre".

    Parameters
    ----------
    criteria
        Criteria with a limit for each deciding measure.

    Returns
    -------
    str
        Limits in order, each with the short names of its measures.
    """
    groups: dict[str, list[str]] = {}
    for measure, limit in criteria.limits.items():
        words = MEASURE_WORDS[measure]
        groups.setdefault(f"{words.factor * limit:.4g} {words.off_unit}".rstrip(), []).append(words.short)
    return "; ".join(f"{limit} {', '.join(names)}" for limit, names in groups.items())


def unknown_text(measures: Iterable[str]) -> str:
    """Message that a stored result lacks measures, with the remedy.

    Parameters
    ----------
    measures
        Names of the measures.

    Returns
    -------
    str
        Sentences about common measures and measures of a user.
    """
    measures = [*measures]
    texts = [
        f"{names_text(names)} {remedy}"
        for names, remedy in (
            (
                [measure for measure in measures if not is_own(measure)],
                "is not in the stored result; to judge by it, solve the case again",
            ),
            (
                [measure for measure in measures if is_own(measure)],
                "is not judged: its function is not available here, and no values are stored",
            ),
        )
        if names
    ]
    return "; ".join(texts)


def deviation_columns(measure: str) -> tuple[str, str, float]:
    """Columns of the deviation and of the uncertainty of a measure, with their factor.

    Parameters
    ----------
    measure
        Name of a measure.

    Returns
    -------
    tuple
        Column of the deviation, column of the uncertainty, and factor from relative values to the numbers of both
        columns.
    """
    factor = MEASURE_WORDS[measure].factor
    name = relative_name(measure)
    return f"hertz_deviation_{name}", f"hertz_uncertainty_{name}", factor
