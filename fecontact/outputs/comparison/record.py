"""Record of a comparison of two tables of results."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fecontact.outputs.flat_records import Record, picked

if TYPE_CHECKING:
    from fecontact.regression.compare import TableComparison
from fecontact.outputs.comparison.verdicts import changed_verdicts


def comparison_record(comparison: TableComparison) -> Record:
    """The whole comparison; numbers that are infinite (nothing was allowed) become null in the file."""
    columns = comparison.columns
    return {
        "schema": "fecontact/comparison/2",
        **picked(comparison, "same verdict"),
        "baseline": str(comparison.baseline.path),
        "new": str(comparison.new.path),
        "matched_by": list(comparison.baseline.key),
        "cases": comparison.cases,
        **{what.replace(" ", "_"): names for what, names in comparison.one_sided.items()},
        "later_columns": comparison.later_columns,
        "default_tolerance_columns": list(columns.column[columns.kind == "default"]),
        **{
            what: {name: {"baseline": was, "new": now} for name, (was, now) in getattr(comparison, what).items()}
            for what in ("versions", "settings")
        },
        "columns": columns.to_dict("records"),
        "differences": comparison.differences.to_dict("records"),
        "not_compared": comparison.efforts.to_dict("records"),
        "changed_verdicts": changed_verdicts(comparison),
    }
