"""Verdicts that differ between two tables of results: how many, which, and where."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fecontact.outputs.flat_records import Record
from fecontact.outputs.tables import number, table_of, text
from fecontact.outputs.terminal import count

if TYPE_CHECKING:
    import pandas

    from fecontact.outputs.terminal import Lines
    from fecontact.regression.compare import TableComparison


def changed_verdicts(comparison: TableComparison) -> list[Record]:
    """Each change of a verdict, the most frequent first, with its number of cases and their shifts and loads."""
    verdicts = comparison.verdicts
    if verdicts.empty:
        return []
    changed = verdicts[verdicts.baseline != verdicts.new]
    found = [
        {"baseline": was, "new": now, "cases": len(own), "where": _where(own)}
        for (was, now), own in changed.groupby(["baseline", "new"])
    ]
    return sorted(found, key=lambda one: -one["cases"])


def _where(cases: pandas.DataFrame) -> str:
    by_shift = cases.sort_values(["lateral_shift_mm", "load_kN"]).groupby("lateral_shift_mm").load_kN
    return "; ".join(f"{shift:+g} mm: {', '.join(f'{load:g}' for load in loads)} kN" for shift, loads in by_shift)


def verdict_lines(comparison: TableComparison) -> Lines:
    """How many verdicts of Hertz are others, in a sentence, and which, where and how often, in a table."""
    found, cases = changed_verdicts(comparison), count(len(comparison.verdicts), "case")
    if not found:
        yield from [f"Hertz's verdict is the same in all of {cases}."] * (not comparison.verdicts.empty)
        return
    told = ", ".join(f"{one['baseline']} -> {one['new']} {count(one['cases'], 'time')}" for one in found)
    yield f"Hertz's verdict is another one in {sum(one['cases'] for one in found)} of {cases}: {told}."
    yield table_of("Verdicts that are others", _CHANGES, found)


_CHANGES = (
    text("baseline", "baseline"),
    text("new", "new"),
    number("cases", "cases", "{:.0f}"),
    text("where", "where", wraps=True),
)
