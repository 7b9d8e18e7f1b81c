"""Comparison of two tables of results on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fecontact.inputs.texts import count_text

if TYPE_CHECKING:
    from fecontact.outputs.terminal import OutputLines
    from fecontact.regression.compare import TableComparison
from fecontact.outputs.comparison.tables import COLUMN_TABLE_COLUMNS, head_lines, value_table, value_text
from fecontact.outputs.comparison.verdicts import verdict_lines

# Number of columns that are shown if no column differs, so that the reader sees the margin.
_CLOSEST_COLUMNS = 5
# Number of worst columns that are shown, and characters of a text. More would hide the answer.
_MAX_COLUMNS, _MAX_CHARACTERS = 30, 20


def comparison_lines(comparison: TableComparison) -> OutputLines:
    """Iterate over the outputs of a comparison for the terminal: differences and verdict.

    The worst column comes first. If no column differs, the columns closest to their tolerance are shown. Columns in
    which all values are equal are not shown.

    Parameters
    ----------
    comparison
        Comparison of two tables.

    Returns
    -------
    iterator of Table and str
        Tables and lines in order.
    """
    yield from head_lines(comparison)
    columns, efforts = comparison.columns, comparison.efforts
    if columns.differing.any():
        differing = columns[columns.differing > 0]
        worst = differing[:_MAX_COLUMNS]
        are_numbers = worst.difference.notna()
        worst = worst.assign(
            **{side: worst[side].where(are_numbers, worst[side].map(_shorten)) for side in ("baseline", "new")}
        )
        yield value_table("Columns that differ", COLUMN_TABLE_COLUMNS, worst, comparison)
        if hidden := len(differing) - len(worst):
            yield f"{count_text(hidden, 'further column')} differ{'s' * (hidden == 1)}; for all: --out FOLDER or --json"
    elif (columns.times_tolerance > 0.0).any():
        closest = columns[columns.times_tolerance > 0.0][:_CLOSEST_COLUMNS]
        yield value_table("Closest to their tolerance", COLUMN_TABLE_COLUMNS, closest, comparison)
    changed_efforts = efforts[efforts.baseline != efforts.new].to_dict("records")
    if changed_efforts:
        change_texts = (
            f"{change['column']} {value_text(change, 'baseline')} -> {value_text(change, 'new')}"
            for change in changed_efforts
        )
        yield f"not compared: {', '.join(change_texts)}"
    yield from verdict_lines(comparison)
    yield comparison.verdict


def _shorten(text: str) -> str:
    return text if len(text) <= _MAX_CHARACTERS else f"{text[: _MAX_CHARACTERS - 3]}..."
