"""Files of a comparison: JSON, a picture and an HTML page without time stamps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fecontact.files import write_json, write_text
from fecontact.outputs.parts import Details, Items, Lead, Part
from fecontact.outputs.style import render_page

if TYPE_CHECKING:
    from pathlib import Path

    from fecontact.regression.compare import TableComparison
from fecontact.outputs.comparison.record import comparison_record
from fecontact.outputs.comparison.tables import (
    COLUMN_TABLE_COLUMNS,
    VALUE_TABLE_COLUMNS,
    head_lines,
    tolerance_table,
    value_table,
    version_table,
)
from fecontact.outputs.comparison.verdicts import verdict_lines


def write_comparison(comparison: TableComparison, folder: Path) -> Path:
    """Write the record, the page and, if possible, the picture of a comparison.

    The picture is written only if all verdicts have different pairs of shift and load.

    Parameters
    ----------
    comparison
        Comparison of two tables.
    folder
        Folder for the files.

    Returns
    -------
    Path
        The folder.
    """
    write_json(folder / "comparison.json", comparison_record(comparison))
    write_text(folder / "comparison.html", comparison_html(comparison))
    if not comparison.verdicts.empty and not comparison.verdicts.duplicated(["lateral_shift_mm", "load_kN"]).any():
        from fecontact.outputs.figures.verdicts import verdicts_figure

        verdicts_figure(comparison, folder / "comparison.png")
    return folder


# If there are more values, they are folded.
_MAX_UNFOLDED_VALUES = 40


def comparison_html(comparison: TableComparison) -> str:
    """Render a comparison as a self-contained HTML page.

    Parameters
    ----------
    comparison
        Comparison of two tables.

    Returns
    -------
    str
        Text of the page, which is well-formed XML too.
    """
    columns, differences = comparison.columns, comparison.differences
    changed, equal = columns[columns.times_tolerance > 0.0], columns[columns.times_tolerance == 0.0]
    values_title = "All values beyond their tolerance, the worst first"
    is_folded = len(differences) > _MAX_UNFOLDED_VALUES
    values = value_table("" if is_folded else values_title, VALUE_TABLE_COLUMNS, differences, comparison)
    tables_below = {
        f"Columns with equal values: {len(equal)}": value_table("", COLUMN_TABLE_COLUMNS, equal, comparison),
        "Not compared, with the largest differences": value_table(
            "", VALUE_TABLE_COLUMNS, comparison.efforts, comparison
        ),
        "Tolerances": tolerance_table(comparison),
        "Versions": version_table(comparison),
    }
    parts: list[Part] = [
        Lead(comparison.verdict, f"lead {'same' if comparison.same else 'different'}", "Comparison of results"),
        Items(list(head_lines(comparison))),
        *verdict_lines(comparison),
        value_table("Columns, the worst first", COLUMN_TABLE_COLUMNS, changed, comparison),
        Details(f"{values_title}: {len(differences)}", [values]) if is_folded else values,
        *(Details(title, [table]) for title, table in tables_below.items()),
    ]
    return render_page(comparison.verdict, parts)
