"""Record of a comparison of two tables of results."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fecontact.outputs.flat_records import Record, select_attributes

if TYPE_CHECKING:
    from fecontact.regression.compare import TableComparison
from fecontact.outputs.comparison.verdicts import changed_verdicts


def comparison_record(comparison: TableComparison) -> Record:
    """Record of a complete comparison.

    Infinite numbers, which occur if no difference is allowed, become null in the file.

    Parameters
    ----------
    comparison
        Comparison of two tables.

    Returns
    -------
    Record
        Content of `comparison.json`.
    """
    columns = comparison.columns
    return {
        "schema": "fecontact/comparison/2",
        **select_attributes(comparison, "same verdict"),
        "baseline": str(comparison.baseline.path),
        "new": str(comparison.new.path),
        "matched_by": list(comparison.baseline.key),
        "cases": comparison.cases,
        **{topic.replace(" ", "_"): names for topic, names in comparison.one_sided.items()},
        "later_columns": comparison.later_columns,
        "default_tolerance_columns": list(columns.column[columns.kind == "default"]),
        **{
            topic: {name: {"baseline": was, "new": now} for name, (was, now) in getattr(comparison, topic).items()}
            for topic in ("versions", "settings")
        },
        "columns": columns.to_dict("records"),
        "differences": comparison.differences.to_dict("records"),
        "not_compared": comparison.efforts.to_dict("records"),
        "changed_verdicts": changed_verdicts(comparison),
    }
