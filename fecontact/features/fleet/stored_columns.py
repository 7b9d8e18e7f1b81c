"""Declared columns of the stored tables of a fleet, and their check."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from fecontact.errors import InputError
from fecontact.features.fleet.packages import import_arrow, import_parquet

ColumnKind = Literal["text", "number", "integer", "flag"]
# Rows that are checked at a time.
_BATCH_ROWS = 100_000


@dataclass(frozen=True, kw_only=True)
class StoredColumn:
    """Declaration of a column of a stored table.

    Attributes
    ----------
    kind
        Type of the values: text, number, whole number or truth value.
    required
        Whether each table has the column.
    filled
        Whether each cell has a value; a number is then finite.
    choices
        Allowed texts; empty if any text is allowed.
    low, high
        Range of the numbers of a filled column.
    """

    kind: ColumnKind
    required: bool = False
    filled: bool = False
    choices: tuple[str, ...] = ()
    low: float = -math.inf
    high: float = math.inf


def check_stored_table(path: Path, columns: Mapping[str, StoredColumn], remedy: str) -> None:
    """Refuse a stored table that differs from the declaration of its columns.

    All data of the file are decoded. A column that is not declared can have any type but a list or a structure.

    Parameters
    ----------
    path
        Parquet file.
    columns
        Declared columns by name.
    remedy
        End of the message.

    Raises
    ------
    InputError
        If the file is not Parquet, or for the first missing column, wrong type or value that is not allowed.
    OSError
        If the system cannot read the file.
    """
    lib = import_arrow("lib")
    try:
        with path.open("rb") as file:
            table = import_parquet().ParquetFile(file)
            problem = _find_wrong_column(table.schema_arrow, columns)
            for batch in () if problem else table.iter_batches(batch_size=_BATCH_ROWS):
                batch.validate(full=True)
                problem = problem or next(_list_wrong_values(batch, columns), "")
    except MemoryError:
        raise
    except (lib.ArrowException, OSError) as error:
        # errors of the system have a number; those of the reader of Parquet files have none
        if isinstance(error, OSError) and error.errno:
            raise
        problem = f"cannot be read ({' '.join(str(error).split()):.200})"
    if problem:
        raise InputError(f"{path}: {problem}; {remedy}")


def _find_wrong_column(schema: Any, columns: Mapping[str, StoredColumn]) -> str:
    """First difference of the names and types of a table from their declaration; empty if there is none."""
    counts = Counter(name.casefold() for name in schema.names)
    if repeated := next((name for name, count in counts.items() if count > 1), ""):
        return f"more than one column has the name {repeated}, apart from upper case"
    if missing := next((name for name, column in columns.items() if column.required and name not in schema.names), ""):
        return f"the column {missing} is missing (an earlier version wrote the table, or it was changed)"
    types = import_arrow("types")
    for column_field in schema:
        declared = columns.get(column_field.name)
        is_wrong = (
            types.is_nested(column_field.type) if declared is None else not _has_kind(column_field.type, declared)
        )
        if is_wrong:
            kinds = "no list or structure" if declared is None else declared.kind
            return f"the column {column_field.name} has the type {column_field.type}; allowed: {kinds}"
    return ""


def _has_kind(arrow_type: Any, column: StoredColumn) -> bool:
    """Whether a type of pyarrow belongs to a declared column; a column without any value has the type null."""
    types = import_arrow("types")
    if types.is_null(arrow_type):
        return not column.filled
    if column.kind == "text":
        return bool(types.is_string(arrow_type) or types.is_large_string(arrow_type))
    if column.kind == "flag":
        return bool(types.is_boolean(arrow_type))
    return bool(types.is_integer(arrow_type) or (column.kind == "number" and types.is_floating(arrow_type)))


def _list_wrong_values(batch: Any, columns: Mapping[str, StoredColumn]) -> Iterator[str]:
    """Yield the differences of the values of some rows from the declaration of their columns."""
    compute, lib = import_arrow("compute"), import_arrow("lib")
    for name in batch.schema.names:
        declared, values = columns.get(name), batch.column(name)
        if declared is None or not len(values):
            continue
        if declared.filled and values.null_count:
            yield f"the column {name} has an empty cell"
        elif values.null_count == len(values):
            continue
        if declared.choices:
            is_allowed = compute.is_in(values, value_set=lib.array([*declared.choices, None], type=values.type))
            if not compute.all(is_allowed).as_py():
                wrong = values.filter(compute.invert(is_allowed))[0].as_py()
                yield f"the column {name} has the value {wrong!r:.80}; allowed: {', '.join(declared.choices)}"
        elif declared.filled and declared.kind == "text":
            if compute.any(compute.match_substring(values, "\0")).as_py():
                yield f"the column {name} has a text with a NUL character"
        elif declared.filled:
            extremes = compute.min_max(values)
            low, high = extremes["min"].as_py(), extremes["max"].as_py()
            # min_max leaves out values that are not numbers
            if not compute.all(compute.is_finite(values)).as_py() or not declared.low <= low <= high <= declared.high:
                yield f"the column {name} has a value outside its range, {declared.low:g} to {declared.high:g}"
