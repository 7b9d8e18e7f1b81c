"""Faults of results against the declared keys of `result.json` and columns of `study.csv`."""

import json
from collections.abc import Iterable, Mapping
from typing import Any

from jsonschema import Draft202012Validator

from fecontact.files import format_json
from fecontact.outputs.records.result_schema import list_columns, result_schema, row_column_meanings


def find_record_faults(record: Mapping[str, Any]) -> list[str]:
    """Contradictions of a record to the schema."""
    plain_record = json.loads(format_json(record))
    return [
        f"{'.'.join(map(str, fault.absolute_path))}: {fault.message[:200]}"
        for fault in Draft202012Validator(result_schema()).iter_errors(plain_record)
    ]


def find_undeclared_columns(columns: Iterable[str], own_measures: Iterable[str] = ()) -> set[str]:
    """Columns that are not declared, also not for measures of a user."""
    load_columns = list_columns("of_load", tuple(own_measures))
    return set(columns) - {*row_column_meanings(), *load_columns, *list_columns("of_case")}
