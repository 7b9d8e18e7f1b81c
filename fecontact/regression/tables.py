"""Tables of results as data frames, and the tolerances within which two of their values are the same."""

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
from fecontact.files import FORMULA, SEAL, broken_seal, read_json, sha256

TEXT = "text"
"""Kind of a column that is compared letter by letter."""

EFFORT = "effort"
"""Kind of a column that is shown and not compared: its values depend on the machine and on the solver's path."""


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """Tolerance within which two numbers are the same: the larger of a relative and an absolute part.

    Attributes
    ----------
    relative
        Tolerance as a part of the baseline's magnitude.
    absolute
        Tolerance in the unit of the column.
    reason
        Why the tolerance has this size.
    """

    relative: float = 0.0
    absolute: float = 0.0
    reason: str = ""


_OWN = tomllib.loads((files("fecontact.regression") / "tolerances.toml").read_text("utf-8"))
_NAMED = {column: kind for kind, columns in _OWN["names"].items() for column in columns.split()}

LATER = tuple(_OWN["later"])
"""Beginnings of columns that are named, and are no difference, if the baseline is older than the columns."""
KINDS: Mapping[str, Tolerance] = {kind: Tolerance(**parts) for kind, parts in _OWN["kinds"].items()}
"""Tolerances by kind of number."""


def kind_of(column: str) -> str:
    """Kind of a column, by its whole name, by its unit, or `default`."""
    fitting = (kind for pattern, kind in _OWN["patterns"].items() if re.search(pattern, column))
    return _NAMED.get(column) or next(fitting, "default")


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """Tolerances by kind, and of single columns."""

    kinds: Mapping[str, Tolerance] = field(default_factory=lambda: KINDS)
    columns: Mapping[str, Tolerance] = field(default_factory=dict)

    def of(self, column: str) -> Tolerance | None:
        """Tolerance of a column, or None if it is text or not compared."""
        return self.columns.get(column) or self.kinds.get(kind_of(column))

    def compares(self, column: str) -> bool:
        """Whether a column is compared; a column of kind `effort` only if it has its own tolerance."""
        return kind_of(column) != EFFORT or column in self.columns


_Parts: TypeAlias = dict[Literal["relative", "absolute"], Annotated[float, Field(ge=0.0, allow_inf_nan=False)]]


class _ToleranceFile(BaseModel):
    """Layout of a tolerance file: tables [kinds.NAME] and [columns.NAME]."""

    model_config = ConfigDict(extra="forbid", strict=True)
    kinds: dict[str, _Parts] = {}
    columns: dict[str, _Parts] = {}


def read_tolerances(path: str | Path) -> Tolerances:
    """Tolerances of a TOML file, which replace tolerances of `KINDS`; a part that is not given stays.

    A column of kind `effort` is compared if the file names it.

    Raises
    ------
    InputError
        If the file does not exist, is no TOML, names an unknown kind, or has a value that is not allowed.
    """
    remedy = "allowed are tables [kinds.NAME] and [columns.NAME] with relative and absolute, finite and >= 0"
    try:
        given = _ToleranceFile.model_validate(tomllib.loads(Path(path).read_text("utf-8")))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise InputError(f"tolerances {path}: {where} is {first['input']!r}: {first['msg']}; {remedy}") from error
    # ValueError is also raised for a file that is no UTF-8, or no TOML
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"tolerances {path}: it cannot be read as TOML ({error}); {remedy}") from error
    for name in given.kinds:
        if name not in KINDS:
            raise InputError(f"tolerances {path}: kinds.{name}: no such kind; allowed are {', '.join(KINDS)}")
    for name in given.columns:
        if kind_of(name) == TEXT:
            raise InputError(f"tolerances {path}: columns.{name} is text and compared exactly; take it out")
    kinds = {**KINDS, **{name: _with(KINDS[name], parts) for name, parts in given.kinds.items()}}
    columns = {name: _with(kinds.get(kind_of(name), Tolerance()), parts) for name, parts in given.columns.items()}
    return Tolerances(kinds=kinds, columns=columns)


def _with(tolerance: Tolerance, parts: _Parts) -> Tolerance:
    return replace(tolerance, **parts, reason="given in the tolerance file")


# --- Tables of results, read as text from the files of a run, a map, a solved case or a baseline.

_TABLE_NAMES = ("study.json", "study.csv", "map.csv", "row.json")
_SEALED = ("fecontact/study/", "fecontact/map/")
# Of the time before documents were sealed.
_UNSEALED = ("fecontact/study/1", *(f"fecontact/map/{version}" for version in (1, 2, 3)))
_GUARDED = tuple(f"'{sign}" for sign in FORMULA)
_MAP_KEY = ("lateral_shift_mm", "load_kN")
# Entries of a document that are neither a result nor a setting.
_NO_SETTINGS = ("schema", "cases", "rows", "row", "versions", "reason", SEAL)
_REMEDY = f"give a folder of results that fecontact wrote, a {', a '.join(_TABLE_NAMES)} or a CSV of studies/baselines"


@dataclass(frozen=True, kw_only=True)
class ResultTable:
    """Results as text, so that CSV and JSON give equal values; a missing value and NaN are empty.

    Attributes
    ----------
    path
        The file.
    key
        The columns that name a case.
    rows
        Data frame with a line for each case, which is the index, and a column for each quantity.
    versions, settings
        Versions and settings with which the results were made; empty if they are not recorded.
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
        A result folder, a study.json, a row.json, or a CSV of a study, a map or a baseline; versions of a CSV come from
        the .json of the same name beside it.

    Returns
    -------
    ResultTable
        At least one row; each row is a different case.

    Raises
    ------
    InputError
        If there is no such file, it is no table of results, two rows are the same case, or the file was changed after
        it was written.
    """
    file = _find(Path(path))
    if file.suffix not in (".csv", ".json"):
        raise InputError(f"results {file}: the ending {file.suffix or '(none)'} is not known; {_REMEDY}")
    beside = file.with_suffix(".json")
    document = _document(beside) if beside.is_file() else {}
    columns, lines = _from_csv(file) if file.suffix == ".csv" else _from_json(file, document)
    _check_seal(beside, document, folder=Path(path).is_dir())
    if not lines:
        raise InputError(f"results {file}: it has no rows; {_REMEDY}")
    key = next((key for key in (("id",), _MAP_KEY) if {*key} <= {*columns}), None)
    if key is None:
        raise InputError(f"results {file}: it has neither a column id nor {' and '.join(_MAP_KEY)}; {_REMEDY}")
    texts = np.array([[_text(value) for value in line] for line in lines], dtype=object)
    names = [f"row {count}" for count in range(1, len(lines) + 1)]
    rows = pandas.DataFrame(texts, index=names, columns=columns, dtype=object)
    versions = document.get("versions")
    return ResultTable(
        path=file,
        key=key,
        rows=named_by(file, rows, key, lambda _: "remove one of them"),
        versions=_flat(versions) if isinstance(versions, dict) else {},
        settings=_flat({name: value for name, value in document.items() if name not in _NO_SETTINGS}),
    )


def _find(path: Path) -> Path:
    if path.is_dir():
        for name in _TABLE_NAMES:
            if (path / name).is_file():
                return path / name
        baselines = [one.with_suffix(".csv") for one in sorted(path.glob("*.json")) if _is_baseline(one)]
        if len(baselines) > 1:
            raise InputError(
                f"results {path}: the folder has {len(baselines)} baselines; give one of them, such as {baselines[0]}"
            )
        if baselines:
            return baselines[0]
        raise InputError(f"results {path}: the folder has none of {', '.join(_TABLE_NAMES)}; {_REMEDY}")
    # a baseline by its name alone, as its study is called
    named = path.with_name(f"{path.name}.csv")
    if not path.is_file() and not named.is_file():
        raise InputError(f"results {path}: no such file or folder; {_REMEDY}")
    if not path.is_file():
        return named
    return path.with_suffix(".csv") if path.suffix == ".json" and _is_baseline(path) else path


def _is_baseline(path: Path) -> bool:
    """Whether a JSON file says what the baseline in the CSV beside it is."""
    if not path.with_suffix(".csv").is_file():
        return False
    try:
        return str(_document(path).get("schema")).startswith("fecontact/baseline/")
    except InputError:
        return False


def _document(path: Path) -> Mapping[str, Any]:
    document = read_json(path)
    if not isinstance(document, dict):
        raise InputError(f"results {path}: it is no table of results; {_REMEDY}")
    try:
        # an escape may stand for half a character, which can be written neither to a terminal nor to a report
        json.dumps(document, ensure_ascii=False).encode("utf-8")
    except UnicodeEncodeError as error:
        raise InputError(f"results {path}: no JSON ({error}); {_REMEDY}") from error
    return document


def _check_seal(path: Path, document: Mapping[str, Any], *, folder: bool) -> None:
    """Refuse a document, or the table beside it, that was changed after it was written."""
    schema = str(document.get("schema"))
    if (schema in _UNSEALED or not schema.startswith(_SEALED)) and SEAL not in document:
        # a baseline, a row, or a table alone has no seal
        return
    problem = broken_seal(path, document)
    table = path.with_suffix(".csv")
    if not problem and not table.is_file():
        # a document without its folder needs no table beside it
        problem = f"{table} is missing" if folder else None
    elif not problem and sha256(table) != document[SEAL].get(table.name):
        problem = f"{table} was changed after it was written (its checksum differs)"
    if problem:
        raise InputError(f"results: {problem}; run the study again, or move the wrong file away")


def _flat(document: Mapping[str, Any], before: str = "") -> dict[str, str]:
    flat: dict[str, str] = {}
    for name, item in document.items():
        if isinstance(item, dict):
            flat |= _flat(item, f"{before}{name}.")
        elif not isinstance(item, list):
            flat[f"{before}{name}"] = "none" if item is None else str(item)
    return flat


def _from_json(path: Path, document: Mapping[str, Any]) -> tuple[list[str], list[list[Any]]]:
    # a solved case has a single row instead of a list
    rows = document.get("rows", [document.get("row")])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InputError(f"results {path}: it has no list of rows; {_REMEDY}")
    columns = list(dict.fromkeys(name for row in rows for name in row))
    return columns, [[row.get(name) for name in columns] for row in rows]


def _from_csv(path: Path) -> tuple[list[str], list[list[str]]]:
    # not by pandas: it would fill up rows that are too short, and number a column name that appears twice
    try:
        # the byte order mark of spreadsheets is no part of the first name
        lines = [line for line in csv.reader(io.StringIO(path.read_text("utf-8-sig")), strict=True) if line]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"results {path}: it is not CSV ({error}); {_REMEDY}") from error
    if not lines:
        raise InputError(f"results {path}: it is empty; {_REMEDY}")
    columns, *rows = lines
    if len(set(columns)) < len(columns):
        raise InputError(f"results {path}: a column name appears twice; {_REMEDY}")
    for count, row in enumerate(rows, start=1):
        if len(row) != len(columns):
            raise InputError(f"results {path}: row {count} has {len(row)} values of {len(columns)}; {_REMEDY}")
    # without the apostrophe that texts have where a spreadsheet would evaluate them
    return columns, [[cell[cell.startswith(_GUARDED) :] for cell in row] for row in rows]


def _text(value: Any) -> str:
    """A value as in a CSV; empty for a missing value."""
    text = "" if value is None else str(value)
    if text.strip().lower() in ("nan", "+nan", "-nan"):
        return ""
    # line ends as after reading a CSV
    return text.replace("\r\n", "\n").replace("\r", "\n")


def named_by(path: Path, rows: pandas.DataFrame, key: Sequence[str], hint: Callable[..., str]) -> pandas.DataFrame:
    """Rows, each named by its values of the key; `hint` says how two rows of one name may be told apart.

    Numbers are the same if nine significant digits are equal; texts must be equal letter by letter.

    Raises
    ------
    InputError
        If a row has no value in one of the columns, or two rows have the same values in all of them.
    """
    for column in key:
        without = rows.index[rows[column] == ""]
        if len(without):
            raise InputError(
                f"results {path}: {without[0]!r} has no value of {column} ({len(without)} of {len(rows)} have none);"
                " each case needs one to be matched by; solve it again, or match by other columns"
            )
    texts = [matched_text(column, rows[column]) for column in key]
    if len(key) > 1 or key[0] != "id":
        texts = [f"{column} " + text for column, text in zip(key, texts, strict=True)]
    names = texts[0].str.cat(texts[1:], sep=", ")
    for name in names[names.duplicated()]:
        two = names.index[names == name][:2]
        raise InputError(
            f"results {path}: {two[0]!r} and {two[1]!r} are both {name}; each may be there once; {hint(rows.loc[two])}"
        )
    return rows.set_index(pandas.Index(names, name=None))


def matched_text(column: str, texts: pandas.Series) -> pandas.Series:
    """Values of a column as text for matching cases; minus zero is zero."""
    if kind_of(column) == TEXT:
        return texts
    numbers = texts.map(number)
    return (numbers + 0.0).map("{:.9g}".format).where(numbers.notna(), texts)


def number(text: str) -> float:
    """The number that a text stands for, or NaN."""
    try:
        return float(text)
    except ValueError:
        return math.nan
