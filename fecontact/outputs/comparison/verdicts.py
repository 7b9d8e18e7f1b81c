"""Verdicts that differ between two tables of results: number, kind and places."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fecontact.inputs.texts import count_text
from fecontact.outputs.flat_records import Record
from fecontact.outputs.tables import make_table, number_column, text_column

if TYPE_CHECKING:
    import pandas

    from fecontact.outputs.terminal import OutputLines
    from fecontact.regression.compare import TableComparison


def changed_verdicts(comparison: TableComparison) -> list[Record]:
    """Changes of verdicts, the most frequent first.

    Parameters
    ----------
    comparison
        Comparison of two tables.

    Returns
    -------
    list of Record
        Old and new verdict, number of cases, and text with their shifts and loads.
    """
    verdicts = comparison.verdicts
    if verdicts.empty:
        return []
    changed = verdicts[verdicts.baseline != verdicts.new]
    changes = [
        {"baseline": was, "new": now, "cases": len(cases), "where": _places_text(cases)}
        for (was, now), cases in changed.groupby(["baseline", "new"])
    ]
    return sorted(changes, key=lambda change: -change["cases"])


def _places_text(cases: pandas.DataFrame) -> str:
    """Shifts and loads of cases, for each yaw if there are several."""
    if "yaw_mrad" in cases:
        return "; ".join(
            f"yaw {yaw:g} mrad: {_places_text(at_yaw.drop(columns='yaw_mrad'))}"
            for yaw, at_yaw in cases.groupby("yaw_mrad")
        )
    by_shift = cases.sort_values(["lateral_shift_mm", "load_kN"]).groupby("lateral_shift_mm").load_kN
    return "; ".join(f"{shift:+g} mm: {', '.join(f'{load:g}' for load in loads)} kN" for shift, loads in by_shift)


def verdict_lines(comparison: TableComparison) -> OutputLines:
    """Iterate over the outputs on changed verdicts of Hertz: a sentence and a table.

    Parameters
    ----------
    comparison
        Comparison of two tables.

    Returns
    -------
    iterator of Table and str
        The sentence has the number of changes; the table has kind, number and places.
    """
    changes, cases = changed_verdicts(comparison), count_text(len(comparison.verdicts), "case")
    if not changes:
        yield from [f"The verdict on Hertz is unchanged ({cases})."] * (not comparison.verdicts.empty)
        return
    change_texts = ", ".join(
        f"{change['baseline']} -> {change['new']} {count_text(change['cases'], 'time')}" for change in changes
    )
    yield f"The verdict on Hertz differs in {sum(change['cases'] for change in changes)} of {cases}: {change_texts}."
    yield make_table("Verdicts that differ", _CHANGE_COLUMNS, changes)


_CHANGE_COLUMNS = (
    text_column("baseline", "baseline"),
    text_column("new", "new"),
    number_column("cases", "cases", "{:.0f}"),
    text_column("where", "where", wraps=True),
)
