"""Tables of results, read as text from the files that a run, a map, a solved case or a baseline left."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.files import SEAL, broken_seal, sha256

_TABLE_NAMES = ("study.json", "study.csv", "map.csv", "row.json")
_SEALED_SCHEMAS = ("fecontact/study/2", "fecontact/map/4")
_MAP_KEY = ("lateral_shift_mm", "load_kN")
_REMEDY = (
    "give a folder that `fecontact run`, `map` or `solve --out` wrote, a study.json, a study.csv, a map.csv, a row.json"
    " or a CSV of studies/baselines"
)
_PAIR_REMEDY = "run the study again, or move the wrong one away"


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

    @property
    def all_columns(self) -> tuple[str, ...]:
        """The columns that a row has, with those of `key`."""
        return tuple(dict.fromkeys((*self.key, *self.columns)))


def load_table(path: str | Path) -> ResultTable:
    """Read a table of results.

    Parameters
    ----------
    path
        A result folder, a study.json, a row.json, or a CSV of a study, a map or a baseline; versions of a CSV are those
        of the .json of the same name beside it.

    Returns
    -------
    ResultTable
        At least one row, each of another case.

    Raises
    ------
    InputError
        If there is no such file, it is no table of results, two of its rows are the same case, or the CSV and the JSON
        of a study that stand side by side do not hold the same.
    """
    file = _find(Path(path))
    try:
        if file.suffix == ".json":
            document = _json(file)
            table = _table(file, *_rows_of_json(file, document), document)
        elif file.suffix == ".csv":
            document = _beside(file)
            table = _table(file, *_rows_of_csv(file), document)
        else:
            raise InputError(f"results {file}: the ending {file.suffix or '(none)'} is not known; {_REMEDY}")
        _check_pair(table, document)
        _check_seal(table.path, document, folder=Path(path).is_dir())
    except RecursionError as error:
        raise InputError(f"results {file}: its JSON is nested too deeply; {_REMEDY}") from error
    return table


def _table(file: Path, columns: list[str], records: list[dict[str, str]], document: Mapping[str, Any]) -> ResultTable:
    key = _key(file, columns, records)
    rows: dict[str, Mapping[str, str]] = {}
    for record in records:
        name = _case_name(file, key, record)
        if name in rows:
            raise InputError(f"results {file}: case {name!r} is there twice; each case once is allowed; remove one")
        rows[name] = record
    versions = document.get("versions")
    return ResultTable(
        path=file,
        key=key,
        columns=tuple(name for name in columns if name != "id"),
        rows=rows,
        versions=_flat(versions) if isinstance(versions, Mapping) else {},
        settings=_settings(document),
    )


def _check_pair(table: ResultTable, document: Mapping[str, Any]) -> None:
    """Refuse a table whose CSV and JSON differ: one of the two was changed after the study, and who knows which.

    The JSON of a baseline or a map has no rows, the CSV of a row is not written: there is nothing to check.
    """
    if "rows" not in document and not str(document.get("schema")).startswith("fecontact/study/"):
        return
    if table.path.suffix == ".csv":
        twin = table.path.with_suffix(".json")
        columns, records = _rows_of_json(twin, document)
    else:
        twin = table.path.with_suffix(".csv")
        if not twin.is_file():
            return
        try:
            columns, records = _rows_of_csv(twin)
        except InputError as error:
            raise InputError(f"{error}; or, as {table.path.name} is beside it, {_PAIR_REMEDY}") from error
    for name in sorted({*columns} ^ {*table.all_columns}):
        has, lacks = (twin, table.path) if name in columns else (table.path, twin)
        raise _unequal_pair(f"column {name!r} is in {has} and not in {lacks}")
    _check_pair_rows(table, twin, records)


def _check_seal(file: Path, document: Mapping[str, Any], *, folder: bool) -> None:
    """Refuse what was changed after it was written; rows that stand twice have been held against each other."""
    if document.get("schema") not in _SEALED_SCHEMAS and SEAL not in document:
        # a baseline, a row, or an earlier version's
        return
    if problem := broken_seal(file.with_suffix(".json"), document):
        raise InputError(f"results: {problem}; {_PAIR_REMEDY}")
    table = file.with_suffix(".csv")
    digest = document[SEAL].get(table.name)
    if folder and not table.is_file():
        raise InputError(f"results: {table} is missing; {_PAIR_REMEDY}")
    if "rows" not in document and digest is not None and sha256(table) != digest:
        raise InputError(f"results: {table} was changed after it was written (its checksum differs); {_PAIR_REMEDY}")


def _check_pair_rows(table: ResultTable, twin: Path, records: Iterable[Mapping[str, str]]) -> None:
    missing = dict.fromkeys(table.rows)
    for record in records:
        name = _case_name(twin, table.key, record)
        if name not in missing:
            where = f"twice in {twin}" if name in table.rows else f"in {twin} and not in {table.path}"
            raise _unequal_pair(f"case {name!r} is {where}")
        del missing[name]
        own = table.rows[name]
        if own != record:
            column = next(column for column in own if own[column] != record[column])
            raise _unequal_pair(
                f"case {name!r}, column {column!r} is {own[column]!r:.60} in {table.path}, {record[column]!r:.60} in"
                f" {twin}"
            )
    for name in missing:
        raise _unequal_pair(f"case {name!r} is in {table.path} and not in {twin}")


def _unequal_pair(what: str) -> InputError:
    return InputError(f"results: {what}; both files have to hold the same; {_PAIR_REMEDY}")


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
        text = path.read_text("utf-8")
        document = json.loads(text)
        if re.search(r"\\u[dD]", text):
            # an escape may stand for half a character, which neither a terminal nor a report takes
            json.dumps(document, ensure_ascii=False).encode("utf-8")
    # also what is not UTF-8, and a whole number of more digits than Python reads
    except ValueError as error:
        raise InputError(f"results {path}: it is not JSON ({error}); {_REMEDY}") from error
    if not isinstance(document, dict):
        raise InputError(f"results {path}: it is no table of results; {_REMEDY}")
    return document


def _beside(path: Path) -> dict[str, Any]:
    """The JSON of the same name, or nothing: a CSV alone is enough to compare."""
    beside = path.with_suffix(".json")
    return _json(beside) if beside.is_file() else {}


def _rows_of_json(path: Path, document: Mapping[str, Any]) -> tuple[list[str], list[dict[str, str]]]:
    # a solved case has one row, and no list of them
    rows = [document["row"]] if "row" in document and "rows" not in document else document.get("rows")
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
    if value_of is not None and math.isnan(value_of):
        return ""
    # as reading a CSV leaves the ends of lines
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


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
    return f"{key_text(shift, sign='+')} mm, {key_text(load)} kN"


def key_text(value: float, *, sign: str = "") -> str:
    """A number as it names a case: nine significant digits, so that fewer digits in one table are the same case.

    Parameters
    ----------
    value
        In any unit; minus zero is zero.
    sign
        "+" shows the sign of a number that is not negative as well.

    Returns
    -------
    str
        Without a unit.
    """
    return f"{value + 0.0:{sign}.9g}"


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
    other = ("schema", "cases", "rows", "row", "versions", "reason", SEAL)
    return _flat({name: value for name, value in document.items() if name not in other})


def number(text: str) -> float | None:
    """The number that a text is, or None."""
    try:
        return float(text)
    except ValueError:
        return None
