"""Comparison of two tables of results on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fecontact.outputs.terminal import count

if TYPE_CHECKING:
    from fecontact.outputs.terminal import Lines
    from fecontact.regression.compare import TableComparison
from fecontact.outputs.comparison.tables import COLUMN_TABLE, head_lines, value_table, value_text
from fecontact.outputs.comparison.verdicts import verdict_lines

# Columns that are shown where none differs, so that one sees how close it is.
_CLOSEST = 5
# The worst columns are shown, with so many characters of a text: more hide the answer.
_MOST_COLUMNS, _MOST_LETTERS = 30, 20


def comparison_lines(comparison: TableComparison) -> Lines:
    """What differs, the worst column first, or what is closest to it where nothing does, and the verdict.

    Columns in which all values are equal are not shown.
    """
    yield from head_lines(comparison)
    columns, efforts = comparison.columns, comparison.efforts
    if columns.differing.any():
        differing = columns[columns.differing > 0]
        shown = differing[:_MOST_COLUMNS]
        numbers = shown.difference.notna()
        shown = shown.assign(
            **{side: shown[side].where(numbers, shown[side].map(_cut)) for side in ("baseline", "new")}
        )
        yield value_table("Columns that differ", COLUMN_TABLE, shown, comparison)
        if more := len(differing) - len(shown):
            yield f"{count(more, 'further column')} differ{'s' * (more == 1)}: --out FOLDER or --json has all"
    elif (columns.times_tolerance > 0.0).any():
        closest = columns[columns.times_tolerance > 0.0][:_CLOSEST]
        yield value_table("Closest to their tolerance", COLUMN_TABLE, closest, comparison)
    changed = efforts[efforts.baseline != efforts.new].to_dict("records")
    if changed:
        told = (f"{one['column']} {value_text(one, 'baseline')} -> {value_text(one, 'new')}" for one in changed)
        yield f"not compared: {', '.join(told)}"
    yield from verdict_lines(comparison)
    yield comparison.verdict


def _cut(text: str) -> str:
    return text if len(text) <= _MOST_LETTERS else f"{text[: _MOST_LETTERS - 3]}..."
