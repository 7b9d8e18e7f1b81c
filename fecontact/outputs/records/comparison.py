"""A comparison of two tables of results as a record, without time stamps."""

from __future__ import annotations

from collections.abc import Iterable

from fecontact.outputs.records.plain import Record, picked
from fecontact.regression.compare import ColumnComparison, Difference, TableComparison


def comparison_record(comparison: TableComparison) -> Record:
    """The whole comparison; numbers that are infinite (nothing was allowed) become null in the file."""
    return {
        "schema": "fecontact/comparison/1",
        **picked(comparison, "same verdict"),
        "baseline": str(comparison.baseline.path),
        "new": str(comparison.new.path),
        "matched_by": list(comparison.baseline.key),
        **picked(comparison, "cases missing_cases extra_cases missing_columns extra_columns later_columns"),
        "default_tolerance_columns": list(comparison.unknown_columns),
        "versions": _pairs_record(comparison.versions.items()),
        "settings": _pairs_record(comparison.settings.items()),
        "columns": [_column_record(column) for column in comparison.columns],
        "differences": [_difference_record(difference) for difference in comparison.differences],
        "not_compared": [_column_record(column) for column in comparison.efforts],
    }


def _pairs_record(pairs: Iterable[tuple[str, tuple[str, str]]]) -> Record:
    return {name: {"baseline": was, "new": now} for name, (was, now) in pairs}


def _column_record(column: ColumnComparison) -> Record:
    return {
        **picked(column, "column kind"),
        "tolerance": None if column.tolerance is None else picked(column.tolerance, "relative absolute reason"),
        "cases": column.cases,
        "differing": column.differing if column.compared else None,
        "worst": _difference_record(column.worst),
    }


def _difference_record(difference: Difference) -> Record:
    return {
        **picked(difference, "column case baseline new difference"),
        "tolerance": difference.allowed,
        "times_tolerance": difference.excess,
    }
