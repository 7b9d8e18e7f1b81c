"""Tables of results, read as text from the files that a run, a map, a solved case or a baseline left."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fecontact.errors import InputError

_TABLE_NAMES = ("study.json", "study.csv", "map.csv")
_MAP_KEY = ("lateral_shift_mm", "load_kN")
_REMEDY = "give a result folder, a study.json, a study.csv, a map.csv or a CSV of studies/baselines"


@dataclass(frozen=True, kw_only=True)
class ResultTable:
    """Results as text, so that a number is the same from CSV and from JSON; a missing value and NaN are empty.

    Attributes
    ----------
    path
        The file.
    key
        The columns that name a case.
    columns
        All columns in their order, without those of `key` where that is the id alone.
    rows
        Values by column, by case.
    versions, settings
        What the results were made with; empty where it is not recorded.
    """

    path: Path
    key: tuple[str, ...]
    columns: tuple[str, ...]
    rows: Mapping[str, Mapping[str, str]]
    versions: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, str] = field(default_factory=dict)


def load_table(path: str | Path) -> ResultTable:
    """Read a table of results.

    Parameters
    ----------
    path
        A result folder, a study.json, or a CSV of a study, a map or a baseline; versions of a CSV are those of the
        .json of the same name beside it.

    Raises
    ------
    InputError
        If there is no such file, it is no table of results, or two of its rows are the same case.
    """
    file = _find(Path(path))
    if file.suffix == ".json":
        document = _json(file)
        columns, records = _rows_of_json(file, document)
    elif file.suffix == ".csv":
        columns, records = _rows_of_csv(file)
        document = _beside(file)
    else:
        raise InputError(f"results {file}: the ending {file.suffix or '(none)'} is not known; {_REMEDY}")
    key = _key(file, columns, records)
    rows: dict[str, Mapping[str, str]] = {}
    for record in records:
        name = _case_name(file, key, record)
        if name in rows:
            raise InputError(f"results {file}: case {name!r} is there twice; each case once is allowed; remove one")
        rows[name] = record
    return ResultTable(
        path=file,
        key=key,
        columns=tuple(name for name in columns if name != "id"),
        rows=rows,
        versions=_flat(document.get("versions") or {}),
        settings=_settings(document),
    )


def _find(path: Path) -> Path:
    if path.is_dir():
        for name in _TABLE_NAMES:
            if (path / name).is_file():
                return path / name
        raise InputError(f"results {path}: the folder has none of {', '.join(_TABLE_NAMES)}; {_REMEDY}")
    if not path.is_file():
        raise InputError(f"results {path}: no such file or folder; {_REMEDY}")
    return path


def _json(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text("utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(f"results {path}: it is not JSON ({error}); {_REMEDY}") from error
    if not isinstance(document, dict):
        raise InputError(f"results {path}: it is no table of results; {_REMEDY}")
    return document


def _beside(path: Path) -> dict[str, Any]:
    """The JSON of the same name, or nothing: a CSV alone is enough to compare."""
    beside = path.with_suffix(".json")
    return _json(beside) if beside.is_file() else {}


def _rows_of_json(path: Path, document: Mapping[str, Any]) -> tuple[list[str], list[dict[str, str]]]:
    rows = document.get("rows")
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InputError(f"results {path}: it has no list of rows; {_REMEDY}")
    columns = list(dict.fromkeys(name for row in rows for name in row))
    return columns, [{name: _text(row.get(name)) for name in columns} for row in rows]


def _rows_of_csv(path: Path) -> tuple[list[str], list[dict[str, str]]]:
    try:
        # the mark that spreadsheets put before UTF-8 is no part of the first name
        lines = list(csv.reader(io.StringIO(path.read_text("utf-8-sig")), strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"results {path}: it is not CSV ({error}); {_REMEDY}") from error
    if not any(lines):
        raise InputError(f"results {path}: it is empty; {_REMEDY}")
    columns, *records = (line for line in lines if line)
    if len(set(columns)) < len(columns):
        raise InputError(f"results {path}: a column name is there twice; {_REMEDY}")
    for number, record in enumerate(records, start=1):
        if len(record) != len(columns):
            raise InputError(f"results {path}: row {number} has {len(record)} values of {len(columns)}; {_REMEDY}")
    return columns, [dict(zip(columns, map(_text, record), strict=True)) for record in records]


def _text(value: Any) -> str:
    """A value as the CSV has it, empty for what is no value."""
    text = "" if value is None else value if isinstance(value, str) else str(value)
    value_of = number(text)
    return "" if value_of is not None and math.isnan(value_of) else text


def _key(path: Path, columns: Iterable[str], records: list[dict[str, str]]) -> tuple[str, ...]:
    if not records:
        raise InputError(f"results {path}: it has no rows; {_REMEDY}")
    for key in (("id",), _MAP_KEY):
        if set(key) <= set(columns):
            return key
    raise InputError(f"results {path}: it has neither a column id nor {' and '.join(_MAP_KEY)}; {_REMEDY}")


def _case_name(path: Path, key: tuple[str, ...], record: Mapping[str, str]) -> str:
    if key == ("id",):
        name = record["id"]
        if not name:
            raise InputError(f"results {path}: a row has no id; {_REMEDY}")
        return name
    shift, load = (number(record[column]) for column in key)
    if shift is None or load is None:
        values = ", ".join(f"{column} {record[column]!r}" for column in key)
        raise InputError(f"results {path}: {values}: a number is needed; {_REMEDY}")
    # nine digits: the same position also where one table was written with fewer digits
    return f"{shift:+.9g} mm, {load:.9g} kN"


def _flat(value: Mapping[str, Any], prefix: str = "") -> dict[str, str]:
    flat: dict[str, str] = {}
    for name, item in value.items():
        if isinstance(item, Mapping):
            flat |= _flat(item, f"{prefix}{name}.")
        elif not isinstance(item, list):
            flat[f"{prefix}{name}"] = "none" if item is None else str(item)
    return flat


def _settings(document: Mapping[str, Any]) -> dict[str, str]:
    """What a document says of its results as a whole: neither the results themselves nor words about the file."""
    other = ("schema", "cases", "rows", "versions", "reason")
    return _flat({name: value for name, value in document.items() if name not in other})


def number(text: str) -> float | None:
    """The number that a text is, or None."""
    try:
        return float(text)
    except ValueError:
        return None
