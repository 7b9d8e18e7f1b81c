"""Tables of results as data frames, and the tolerances for equal values."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
import pandas
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fecontact.errors import InputError
from fecontact.files import (
    FORMULA_PREFIXES,
    OWN_FUNCTIONS_SETTING,
    SEAL_KEY,
    describe_source,
    explain_broken_seal,
    hash_file,
    read_json,
    read_toml,
)
from fecontact.inputs.texts import count_text, escape_invisible

TEXT_KIND = "text"
"""Kind of a column that is compared letter by letter."""

EFFORT_KIND = "effort"
"""Kind of a column that is shown and not compared: its values depend on the machine and on the solver's path."""


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """Tolerance within which two numbers are equal: the larger of a relative and an absolute part.

    Attributes
    ----------
    relative
        Tolerance as a fraction of the baseline's magnitude.
    absolute
        Tolerance in the unit of the column.
    reason
        Reason for the size of the tolerance.
    """

    relative: float = 0.0
    absolute: float = 0.0
    reason: str = ""


_TOLERANCE_DOCUMENT = tomllib.loads((files("fecontact.regression") / "tolerances.toml").read_text("utf-8"))
_KIND_BY_COLUMN = {column: kind for kind, columns in _TOLERANCE_DOCUMENT["names"].items() for column in columns.split()}

LATER_COLUMN_PREFIXES = tuple(_TOLERANCE_DOCUMENT["later"])
"""Beginnings of columns that are listed, and are no difference, if the baseline is older than the columns."""
TOLERANCES_BY_KIND: Mapping[str, Tolerance] = {
    kind: Tolerance(**parts) for kind, parts in _TOLERANCE_DOCUMENT["kinds"].items()
}
"""Tolerances by kind of number."""


def find_kind(column: str) -> str:
    """Kind of a column, by its whole name, by its unit, or `default`.

    Parameters
    ----------
    column
        Name of the column.

    Returns
    -------
    str
        Kind, a key of the tolerances.
    """
    fitting = (kind for pattern, kind in _TOLERANCE_DOCUMENT["patterns"].items() if re.search(pattern, column))
    return _KIND_BY_COLUMN.get(column) or next(fitting, "default")


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """Tolerances by kind, and tolerances of single columns.

    Attributes
    ----------
    kinds
        Tolerances by kind of number.
    columns
        Tolerances of single columns, which replace the tolerance of their kind.

    Examples
    --------
    >>> Tolerances().of("p_max_MPa").relative
    0.0001
    """

    kinds: Mapping[str, Tolerance] = field(default_factory=lambda: TOLERANCES_BY_KIND)
    columns: Mapping[str, Tolerance] = field(default_factory=dict)

    def of(self, column: str) -> Tolerance | None:
        """Tolerance of a column; None for texts and columns that are not compared.

        Parameters
        ----------
        column
            Name of the column.

        Returns
        -------
        Tolerance or None
            Tolerance of the column, or of its kind.
        """
        return self.columns.get(column) or self.kinds.get(find_kind(column))

    def compares(self, column: str) -> bool:
        """Whether a column is compared.

        A column of kind `effort` is compared only if it has a tolerance in `columns`.

        Parameters
        ----------
        column
            Name of the column.

        Returns
        -------
        bool
            Whether the column is compared.
        """
        return find_kind(column) != EFFORT_KIND or column in self.columns


_ToleranceFields: TypeAlias = dict[
    Literal["relative", "absolute"], Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
]


class _ToleranceFile(BaseModel):
    """Layout of a tolerance file: tables [kinds.NAME] and [columns.NAME]."""

    model_config = ConfigDict(extra="forbid", strict=True)
    kinds: dict[str, _ToleranceFields] = {}
    columns: dict[str, _ToleranceFields] = {}


def read_tolerances(path: str | Path) -> Tolerances:
    """Read tolerances from a TOML file, which replace tolerances of `TOLERANCES_BY_KIND`.

    A missing relative or absolute part keeps its value. A column of kind `effort` is compared if the file names it.

    Parameters
    ----------
    path
        TOML file with tables [kinds.NAME] and [columns.NAME].

    Returns
    -------
    Tolerances
        Tolerances of all kinds, and of the columns in the file.

    Raises
    ------
    InputError
        If the file does not exist, is not TOML, names an unknown kind, or has a value out of range.
    """
    remedy = "allowed: tables [kinds.NAME] and [columns.NAME] with relative and absolute, finite and >= 0"
    try:
        content = read_toml(Path(path), f"tolerances {path}")
    except InputError as error:
        raise InputError(f"{error}; {remedy}") from error
    try:
        tolerance_file = _ToleranceFile.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise InputError(f"tolerances {path}: {where} is {first['input']!r}: {first['msg']}; {remedy}") from error
    for name in tolerance_file.kinds:
        if name not in TOLERANCES_BY_KIND:
            raise InputError(f"tolerances {path}: kinds.{name}: no such kind; allowed: {', '.join(TOLERANCES_BY_KIND)}")
    for name in tolerance_file.columns:
        if find_kind(name) == TEXT_KIND:
            raise InputError(
                f"tolerances {path}: columns.{name} is text, which is compared exactly; remove this tolerance"
            )
    kinds = {
        **TOLERANCES_BY_KIND,
        **{name: _replace_fields(TOLERANCES_BY_KIND[name], parts) for name, parts in tolerance_file.kinds.items()},
    }
    columns = {
        name: _replace_fields(kinds.get(find_kind(name), Tolerance()), parts)
        for name, parts in tolerance_file.columns.items()
    }
    return Tolerances(kinds=kinds, columns=columns)


def _replace_fields(tolerance: Tolerance, parts: _ToleranceFields) -> Tolerance:
    """A tolerance with the relative or absolute part of a tolerance file."""
    return replace(tolerance, **parts, reason="given in the tolerance file")


# --- Tables of results, read as text from the files of a run, a map, a solved case or a baseline.

_TABLE_NAMES = ("study.json", "study.csv", "map.csv", "row.json")
_SEALED_SCHEMAS = ("fecontact/study/", "fecontact/map/", "fecontact/yaw_map/")
# Schemas from before documents were sealed.
_SCHEMAS_BEFORE_SEALS = ("fecontact/study/1", *(f"fecontact/map/{version}" for version in (1, 2, 3)))
_GUARDED_BEGINNINGS = tuple(f"'{sign}" for sign in FORMULA_PREFIXES)
_MAP_KEY = ("lateral_shift_mm", "load_kN")
_YAW_COLUMN = "yaw_mrad"
# Entries of a document that are not settings.
_RESULT_ENTRIES = ("schema", "cases", "rows", "row", "versions", "reason", SEAL_KEY)
OWN_LIMITS_SETTING = "own_limits"
"""Setting with the limits of a user's criteria, by the name of the criterion."""
_REMEDY = f"give a folder of results that fecontact wrote, a {', a '.join(_TABLE_NAMES)} or a CSV of studies/baselines"


@dataclass(frozen=True, kw_only=True)
class ResultTable:
    """Results as text, so that CSV and JSON give equal values.

    A missing value and NaN are empty.

    Attributes
    ----------
    path
        The file.
    key
        The columns that name a case.
    rows
        Data frame with a row for each case, which is the index, and a column for each quantity.
    versions, settings
        Versions and settings of the program that made the results; empty if they are not recorded.
    """

    path: Path
    key: tuple[str, ...]
    rows: pandas.DataFrame
    versions: Mapping[str, str]
    settings: Mapping[str, str]

    @property
    def columns(self) -> list[str]:
        """All columns except the id, which names cases."""
        return [name for name in self.rows if name != "id"]


def load_table(path: str | Path) -> ResultTable:
    """Read a table of results.

    Parameters
    ----------
    path
        A result folder, a study.json, a row.json, or a CSV of a study, a map or a baseline. Versions of a CSV come from
        the .json of equal name next to it.

    Returns
    -------
    ResultTable
        At least one row. Each row is a different case.

    Raises
    ------
    InputError
        If there is no such file, it is not a table of results, two rows have equal keys, or the file was changed after
        it was written.
    """
    file = _find_file(Path(path))
    if file.suffix not in (".csv", ".json"):
        raise InputError(f"results {file}: unknown file ending {file.suffix or '(none)'}; {_REMEDY}")
    json_path = file.with_suffix(".json")
    document = _read_document(json_path) if json_path.is_file() else {}
    columns, lines = _read_csv_rows(file) if file.suffix == ".csv" else _read_json_rows(file, document)
    _check_seal(json_path, document, folder=Path(path).is_dir())
    if not lines:
        raise InputError(f"results {file}: no rows; {_REMEDY}")
    key: tuple[str, ...] | None = next((key for key in (("id",), _MAP_KEY) if {*key} <= {*columns}), None)
    if key is None:
        raise InputError(f"results {file}: neither a column id nor {' and '.join(_MAP_KEY)}; {_REMEDY}")
    if key == _MAP_KEY and _YAW_COLUMN in columns:
        # cells of a map of several yaws differ by their yaw too
        yaws = {line[columns.index(_YAW_COLUMN)] for line in lines} - {""}
        key = (_MAP_KEY[0], _YAW_COLUMN, _MAP_KEY[1]) if len(yaws) > 1 else key
    texts = np.array([[_cell_text(value) for value in line] for line in lines], dtype=object)
    names = [f"row {count}" for count in range(1, len(lines) + 1)]
    rows = pandas.DataFrame(texts, index=names, columns=columns, dtype=object)
    versions = document.get("versions")
    return ResultTable(
        path=file,
        key=key,
        rows=name_rows(file, rows, key, lambda _: "remove one of them"),
        versions=_flatten(versions) if isinstance(versions, dict) else {},
        settings=_read_settings(document),
    )


def _find_file(path: Path) -> Path:
    """File of a table of results, from a folder or a file.

    A baseline may also be given by its path without the ending.

    Raises
    ------
    InputError
        If there is no such file, or the folder has several baselines.
    """
    if path.is_dir():
        for name in _TABLE_NAMES:
            if (path / name).is_file():
                return path / name
        baselines = [
            json_path.with_suffix(".csv") for json_path in sorted(path.glob("*.json")) if _is_baseline(json_path)
        ]
        if len(baselines) > 1:
            raise InputError(
                f"results {path}: the folder has {len(baselines)} baselines; give one of them, such as {baselines[0]}"
            )
        if baselines:
            return baselines[0]
        raise InputError(f"results {path}: the folder has none of {', '.join(_TABLE_NAMES)}; {_REMEDY}")
    # a baseline by its name alone, which is the name of its study
    named_csv = path.with_name(f"{path.name}.csv")
    if not path.is_file() and not named_csv.is_file():
        raise InputError(f"results {path}: no such file or folder; {_REMEDY}")
    if not path.is_file():
        return named_csv
    return path.with_suffix(".csv") if path.suffix == ".json" and _is_baseline(path) else path


def _is_baseline(path: Path) -> bool:
    """Whether a JSON file describes the baseline in the CSV next to it."""
    if not path.with_suffix(".csv").is_file():
        return False
    try:
        return str(_read_document(path).get("schema")).startswith("fecontact/baseline/")
    except InputError:
        return False


def _read_document(path: Path) -> Mapping[str, Any]:
    """Read a JSON document.

    Raises
    ------
    InputError
        If it is not a dictionary, or has a text that cannot be written.
    """
    document = read_json(path)
    if not isinstance(document, dict):
        raise InputError(f"results {path}: not a table of results; {_REMEDY}")
    try:
        # An escape may stand for half a character, which can be written neither to a terminal nor to a report.
        json.dumps(document, ensure_ascii=False).encode("utf-8")
    except UnicodeEncodeError as error:
        raise InputError(f"results {path} is not valid JSON ({error}); {_REMEDY}") from error
    return document


def _check_seal(path: Path, document: Mapping[str, Any], *, folder: bool) -> None:
    """Refuse a document or its table if it was changed after it was written.

    `folder` decides whether a missing table is an error. Documents of schemas without a seal are accepted.
    """
    schema = str(document.get("schema"))
    if (schema in _SCHEMAS_BEFORE_SEALS or not schema.startswith(_SEALED_SCHEMAS)) and SEAL_KEY not in document:
        # A baseline, a row, or a table alone has no seal.
        return
    problem = explain_broken_seal(path, document)
    table = path.with_suffix(".csv")
    if not problem and not table.is_file():
        # A document without its folder needs no table next to it.
        problem = f"{table} is missing" if folder else None
    elif not problem and hash_file(table) != document[SEAL_KEY].get(table.name):
        problem = f"{table} was changed after it was written (its checksum differs)"
    if problem:
        raise InputError(f"results: {problem}; run the study again, or restore the original files")


def _read_settings(document: Mapping[str, Any]) -> dict[str, str]:
    """Settings of a document as texts, with the limits and functions of a user's criteria."""
    settings = _flatten({name: value for name, value in document.items() if name not in _RESULT_ENTRIES})
    criteria = document.get("criteria")
    own_criteria = criteria.get("own") if isinstance(criteria, dict) else None
    for criterion in own_criteria if isinstance(own_criteria, list) else ():
        if isinstance(criterion, dict) and isinstance(name := criterion.get("name"), str):
            settings[f"{OWN_LIMITS_SETTING}.{name}"] = f"{criterion.get('limit')} {criterion.get('unit')}"
            settings[f"{OWN_FUNCTIONS_SETTING}.{name}"] = describe_source(str(criterion.get("source")))
    return settings


def _flatten(document: Mapping[str, Any], prefix: str = "") -> dict[str, str]:
    """Entries of a nested document as texts, by names such as `fecontact.version`; lists are left out."""
    texts: dict[str, str] = {}
    for name, value in document.items():
        if isinstance(value, dict):
            texts |= _flatten(value, f"{prefix}{name}.")
        elif not isinstance(value, list):
            texts[f"{prefix}{name}"] = "none" if value is None else str(value)
    return texts


def _read_json_rows(path: Path, document: Mapping[str, Any]) -> tuple[list[str], list[list[Any]]]:
    """Columns and rows of a JSON document."""
    # A solved case has a single row instead of a list.
    rows = document.get("rows", [document.get("row")])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InputError(f"results {path}: no list of rows; {_REMEDY}")
    columns = list(dict.fromkeys(name for row in rows for name in row))
    # a CSV has escapes in place of control characters
    return columns, [
        [escape_invisible(value) if isinstance(value, str) else value for value in map(row.get, columns)]
        for row in rows
    ]


def _read_csv_rows(path: Path) -> tuple[list[str], list[list[str]]]:
    """Columns and rows of a CSV, as texts.

    Raises
    ------
    InputError
        If the file is no CSV or is empty, if a column appears twice, or if a row has a different length.
    """
    # Not by pandas: it would fill up rows that are too short, and number a repeated column name.
    try:
        # The byte order mark of spreadsheets is not part of the first name.
        lines = [line for line in csv.reader(io.StringIO(path.read_text("utf-8-sig")), strict=True) if line]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"results {path}: not CSV ({error}); {_REMEDY}") from error
    if not lines:
        raise InputError(f"results {path}: the file is empty; {_REMEDY}")
    columns, *rows = lines
    if len(set(columns)) < len(columns):
        raise InputError(f"results {path}: a column name appears twice; {_REMEDY}")
    for count, row in enumerate(rows, start=1):
        if len(row) != len(columns):
            raise InputError(
                f"results {path}: row {count} has {count_text(len(row), 'value')} for"
                f" {count_text(len(columns), 'column')}; {_REMEDY}"
            )
    # Without the apostrophe of texts that a spreadsheet would evaluate.
    return columns, [[cell[cell.startswith(_GUARDED_BEGINNINGS) :] for cell in row] for row in rows]


def _cell_text(value: Any) -> str:
    """Text of a value as in a CSV; empty for a missing value."""
    text = "" if value is None else str(value)
    if text.strip().lower() in ("nan", "+nan", "-nan"):
        return ""
    # line ends as after reading a CSV
    return text.replace("\r\n", "\n").replace("\r", "\n")


def name_rows(path: Path, rows: pandas.DataFrame, key: Sequence[str], hint: Callable[..., str]) -> pandas.DataFrame:
    """Rows with names from their values of the key.

    Numbers are equal if nine significant digits are equal. Texts must be equal letter by letter.

    Parameters
    ----------
    path
        File of the rows, for messages.
    rows
        Data frame with texts.
    key
        Columns that name a case.
    hint
        Function of two rows with equal names, which returns advice on how to distinguish them.

    Returns
    -------
    pandas.DataFrame
        The rows with their names as index.

    Raises
    ------
    InputError
        If a row has no value in a column of the key, or two rows have equal values in all of them.
    """
    for column in key:
        without = rows.index[rows[column] == ""]
        if len(without):
            raise InputError(
                f"results {path}: {without[0]!r} has no value of {column} ({len(without)} of {len(rows)} cases have"
                " none); each case needs this value to be matched; solve the case again, or match by different columns"
            )
    texts = [normalise_for_match(column, rows[column]) for column in key]
    if len(key) > 1 or key[0] != "id":
        texts = [f"{column} " + text for column, text in zip(key, texts, strict=True)]
    names = texts[0].str.cat(texts[1:], sep=", ")
    for name in names[names.duplicated()]:
        two = names.index[names == name][:2]
        raise InputError(
            f"results {path}: {two[0]!r} and {two[1]!r} are both {name}; allowed: once; {hint(rows.loc[two])}"
        )
    return rows.set_index(pandas.Index(names, name=None))


def normalise_for_match(column: str, texts: pandas.Series) -> pandas.Series:
    """Values of a column as text for matching cases.

    Minus zero is zero.

    Parameters
    ----------
    column
        Name of the column.
    texts
        Values of the column.

    Returns
    -------
    pandas.Series
        Numbers with nine significant digits; other values unchanged.
    """
    if find_kind(column) == TEXT_KIND:
        return texts
    numbers = texts.map(parse_number)
    return (numbers + 0.0).map("{:.9g}".format).where(numbers.notna(), texts)


def parse_number(text: str) -> float:
    """Number in a text.

    Parameters
    ----------
    text
        Value of a cell.

    Returns
    -------
    float
        NaN if the text is not a number.
    """
    try:
        return float(text)
    except ValueError:
        return math.nan
