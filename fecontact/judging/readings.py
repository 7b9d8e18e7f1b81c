"""What features say of a judged load beside its theories of the pressure, as maps show it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from fecontact.case import Case
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.verdict import Judgement
from fecontact.placement.wheel_on_rail import Placement


@dataclass(frozen=True, kw_only=True)
class Mapped:
    """What a map has of a reading.

    Attributes
    ----------
    title
        What the map shows.
    criterion
        Within what it holds, in words; None of a case that does not ask for it.
    lost
        What a cell without it has.
    """

    title: str
    criterion: Callable[[Case], str | None]
    lost: str


@dataclass(frozen=True, kw_only=True)
class MappedVerdicts(Mapped):
    """Verdicts on Hertz by a measure that no theory of the pressure has.

    Attributes
    ----------
    name, short
        What is judged, in a sentence, and in the heading of a table.
    read
        The judgement among the readings of a load; None without one.
    judge
        The judgement of a load that has no readings.
    causes
        Letter of each cause, and its words.
    missing
        What a case lacks that does not ask for it, and what to do.
    """

    name: str
    short: str
    read: Callable[[JudgedLoad], Judgement | None]
    judge: Callable[[JudgedLoad, Placement], Judgement]
    causes: Mapping[str, tuple[str, str]]
    missing: str


@dataclass(frozen=True, kw_only=True)
class MappedLaws(Mapped):
    """Theories, or laws of something else than the pressure, of which the cheapest that holds is told.

    Attributes
    ----------
    laws
        What they are for readers, from the cheapest, by name.
    read
        Their judgements among the readings of a load; empty without any.
    marks
        Letter and colour of each.
    note, number
        What a map of the cheapest says, and what the number of a cell is.
    of
        The number of a law in a cell, in words.
    columns
        What a table says of each law.
    kind, heading
        Their name in the list of all theories, and the heading there.
    in_range
        Whether one that is out of its own range does not count.
    """

    laws: Mapping[str, Mapping[str, str]]
    read: Callable[[JudgedLoad], Mapping[str, Judgement]]
    marks: Mapping[str, tuple[str, str]]
    note: str
    number: str
    of: Callable[[str, Judgement], str]
    columns: Callable[[str, Judgement], Mapping[str, Any]] = lambda name, judged: {}
    kind: str = ""
    heading: str = ""
    in_range: bool = False
