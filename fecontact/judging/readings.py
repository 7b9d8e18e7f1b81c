"""Readings of features on a judged load, and the views of maps on them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from fecontact.case import Case
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.verdict import Judgement
from fecontact.placement.wheel_on_rail import Placement


@dataclass(frozen=True, kw_only=True)
class ReadingView:
    """View of a map on a reading.

    Attributes
    ----------
    title
        Title of the map.
    criterion
        Limit of the judged quantity in words; None for a case that does not judge it.
    lost
        Text of a cell without the reading.
    """

    title: str
    criterion: Callable[[Case], str | None]
    lost: str


@dataclass(frozen=True, kw_only=True)
class VerdictReadingView(ReadingView):
    """View of a map on verdicts on Hertz by a measure of a feature.

    Attributes
    ----------
    name, short
        Name of the judged quantity in a sentence, and in the heading of a table.
    read
        Reader of the judgement from the readings of a load; it returns None without a judgement.
    judge
        Function that judges a load without readings.
    causes
        Letter and description of each cause, by its name.
    missing
        Text for a case that does not judge the quantity: the missing input and its remedy.
    """

    name: str
    short: str
    read: Callable[[JudgedLoad], Judgement | None]
    judge: Callable[[JudgedLoad, Placement], Judgement]
    causes: Mapping[str, tuple[str, str]]
    missing: str


@dataclass(frozen=True, kw_only=True)
class NumberReading:
    """Deviation of Hertz in a quantity of a feature, with its uncertainty.

    Attributes
    ----------
    deviation_percent, uncertainty_percent
        Deviation from the finite elements and its uncertainty, in percent of the latter; None without a value.
    """

    deviation_percent: float | None
    uncertainty_percent: float | None


@dataclass(frozen=True, kw_only=True)
class NumberReadingView(ReadingView):
    """View of a map on the deviation of Hertz in a quantity.

    The quantity belongs to a feature and has no verdict.

    Attributes
    ----------
    name
        Name of the quantity in a sentence.
    read_deviation
        Reader of the deviation from the readings of a load; it returns None without readings.
    without
        Text of a cell in which the quantity has no deviation.
    missing
        Text for a case without the quantity: the missing input and its remedy.
    """

    name: str
    read_deviation: Callable[[JudgedLoad], NumberReading | None]
    without: str
    missing: str


@dataclass(frozen=True, kw_only=True)
class LawReadingView(ReadingView):
    """View of a map on the cheapest valid law of a feature.

    Attributes
    ----------
    laws
        Descriptions of each law for readers, by its name, the cheapest law first.
    read
        Reader of the judgements from the readings of a load; empty without readings.
    marks
        Letter and colour of each law.
    note, number
        Note below a map of the cheapest law, and description of the number of a cell.
    of
        Function that returns the number of a law in a cell, in words.
    columns
        Function that returns the columns of a table for each law.
    kind, heading
        Name of the laws in the list of all theories, and their heading there.
    in_range
        Whether a law outside its range of validity is skipped.
    """

    laws: Mapping[str, Mapping[str, str]]
    read: Callable[[JudgedLoad], Mapping[str, Judgement]]
    marks: Mapping[str, tuple[str, str]]
    note: str
    number: str
    of: Callable[[str, Judgement], str]
    columns: Callable[[str, Judgement], Mapping[str, Any]] = lambda name, judgement: {}
    kind: str = ""
    heading: str = ""
    in_range: bool = False
